//! The file readers and the demos as the window's library.

use std::path::Path;

use glam::DVec3;

use super::document::{Library, RawLayout, ReadFailure, ReadGrid, Slice, Source};
use crate::core::Ticket;
use crate::io::{self, Endian, Format, OpenOptions, Problem, RawOverrides, ReadError};
use crate::scene::FirstLook;
use crate::volume::demo::{self, DemoError};
use crate::volume::{Samples, ScalarVolume};

/// Greatest side of a preview, pixels; larger slices are thinned out.
const PREVIEW_SIDE: usize = 512;
/// Extensions of formats with a header: without one such a file is damaged, not raw.
const WITH_HEADER: [&str; 29] = [
    "vrbf", "nrrd", "nhdr", "mha", "mhd", "vti", "vtr", "vts", "vtu", "vtp", "pvtu", "pvtp", "vtk",
    "nc", "ex2", "exo", "nii", "npy", "npz", "mrc", "dcm", "tif", "tiff", "h5", "hdf5", "nc4",
    "csv", "txt", "asc",
];

/// Files on disk and volumes made in code.
pub struct Files;

impl Library for Files {
    fn read(&self, source: &Source, ticket: &Ticket) -> Result<ReadGrid, ReadFailure> {
        match source {
            Source::File(path) => read_file(path, ticket),
            Source::Raw(path, layout) => {
                let raw = overrides(layout).ok_or_else(beyond_this_machine)?;
                let options = OpenOptions { raw: Some(raw), ..OpenOptions::default() };
                opened(io::open(path, &options, ticket))
            }
            Source::Demo(name) => made(name, ticket),
        }
    }

    fn guess_raw(&self, path: &Path) -> RawLayout {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let told = io::raw::guess(&name, self.file_bytes(path).unwrap_or(0));
        layout_of(told)
    }

    fn file_bytes(&self, path: &Path) -> Result<u64, String> {
        std::fs::metadata(path)
            .map(|facts| facts.len())
            .map_err(|error| format!("the file cannot be measured: {error}: {}", path.display()))
    }

    fn raw_slice(&self, path: &Path, layout: &RawLayout, z: u64) -> Result<Slice, String> {
        let layout = complete(layout).ok_or("the layout is beyond what this machine can count")?;
        let z = usize::try_from(z).map_err(|error| error.to_string())?;
        let samples = io::raw::read_slice(path, &layout, z).map_err(|error| error.to_string())?;
        Ok(to_grey(&samples, [layout.dims[0], layout.dims[1]]))
    }

    fn demos(&self) -> Vec<(&'static str, &'static str)> {
        demo::NAMES.into_iter().map(|name| (name, about_demo(name))).collect()
    }

    fn first_look(&self, volume: &ScalarVolume, space: Option<&str>) -> FirstLook {
        FirstLook::of(volume, space)
    }
}

fn read_file(path: &Path, ticket: &Ticket) -> Result<ReadGrid, ReadFailure> {
    let mut options = OpenOptions::default();
    if matches!(io::probe(path), Ok(Format::Raw)) {
        options.raw = Some(told_exactly(path)?);
    }
    opened(io::open(path, &options, ticket))
}

/// The layout of a raw file whose name tells it and whose length bears it out.
fn told_exactly(path: &Path) -> Result<RawOverrides, ReadFailure> {
    let length = std::fs::metadata(path).map_or(0, |facts| facts.len());
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let told = io::raw::guess(&name, length);
    let certain = told.dims.is_some() && told.scalar_type.is_some();
    if certain && layout_of(told).expected_bytes() == Some(length) {
        return Ok(told);
    }
    let reason = "This file has no header that says how its samples lie".to_owned();
    Err(ReadFailure::NotRecognised(reason))
}

fn opened(result: Result<io::Opened, ReadError>) -> Result<ReadGrid, ReadFailure> {
    match result {
        Ok(opened) => {
            let io::Opened { grid, warnings, series, encoding, .. } = opened;
            Ok(ReadGrid { grid, warnings, series, encoding })
        }
        Err(error) if error.is_cancelled() => Err(ReadFailure::Cancelled),
        Err(error) => {
            let extension = error.path.extension().unwrap_or_default().to_ascii_lowercase();
            let has_header = WITH_HEADER.iter().any(|known| extension == *known);
            Err(match &error.problem {
                Problem::Foreign { name } => ReadFailure::Foreign(name.clone()),
                Problem::Unrecognised(mismatch) if !has_header => {
                    ReadFailure::NotRecognised(format!(
                        "Expected {}, found {}: if these are samples without a header, say how they lie",
                        mismatch.expected, mismatch.found
                    ))
                }
                _ => ReadFailure::Refused(error.to_string()),
            })
        }
    }
}

fn beyond_this_machine() -> ReadFailure {
    ReadFailure::Refused("the layout is beyond what this machine can count".to_owned())
}

fn made(name: &str, ticket: &Ticket) -> Result<ReadGrid, ReadFailure> {
    match demo::open_watched(name, None, ticket) {
        Ok(grid) => Ok(ReadGrid::of(grid)),
        Err(DemoError::Cancelled(_)) => Err(ReadFailure::Cancelled),
        Err(error) => Err(ReadFailure::Refused(error.to_string())),
    }
}

/// What there is to see in a demo, one line; empty for one that is new here.
fn about_demo(name: &str) -> &'static str {
    match name {
        "head" => "A noisy phantom much like the CT scan of a head",
        "tornado" => "A turning column of wind, with its velocity as a vector field",
        "mesh" => "A ring of tetrahedra, drawn as they are, without any lattice",
        "marschner-lobb" => "The classic test of reconstruction: ripples just above the limit",
        "shells" => "Four thin shells inside each other",
        "blobs" => "A few smooth blobs",
        "checkerboard" => "Cubes of two values: hard edges everywhere",
        "constant" => "One value throughout: what opacity alone looks like",
        _ => "",
    }
}

/// What a name tells, with defaults for the rest.
fn layout_of(told: RawOverrides) -> RawLayout {
    let default = RawLayout::default();
    RawLayout {
        dims: told.dims.map_or(default.dims, |dims| dims.map(|n| n as u64)),
        scalar_type: told.scalar_type.unwrap_or(default.scalar_type),
        big_endian: told.endian == Some(Endian::Big),
        skip_bytes: told.skip_bytes.unwrap_or(default.skip_bytes),
        spacing: told.spacing.map_or(default.spacing, |spacing| spacing.to_array()),
    }
}

/// The reader's form of a layout; `None` where this machine cannot count that far.
fn complete(layout: &RawLayout) -> Option<io::RawLayout> {
    let [x, y, z] = layout.dims.map(|n| usize::try_from(n).ok());
    Some(io::RawLayout {
        dims: [x?, y?, z?],
        scalar_type: layout.scalar_type,
        endian: if layout.big_endian { Endian::Big } else { Endian::Little },
        skip_bytes: layout.skip_bytes,
        spacing: DVec3::from(layout.spacing),
    })
}

fn overrides(layout: &RawLayout) -> Option<RawOverrides> {
    let layout = complete(layout)?;
    Some(RawOverrides {
        dims: Some(layout.dims),
        scalar_type: Some(layout.scalar_type),
        endian: Some(layout.endian),
        skip_bytes: Some(layout.skip_bytes),
        spacing: Some(layout.spacing),
    })
}

/// A slice in grey, every n-th sample where it is larger than a preview; y points up.
fn to_grey(samples: &Samples, [width, height]: [usize; 2]) -> Slice {
    let step = width.max(height).div_ceil(PREVIEW_SIDE).max(1);
    let size = [width.div_ceil(step), height.div_ceil(step)];
    let rows = (0..size[1]).rev().map(|row| row * step);
    let values: Vec<f64> = rows
        .flat_map(|y| (0..size[0]).map(move |column| samples.get(y * width + column * step)))
        .collect();
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let (low, high) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let grey = values.iter().map(|&v| {
        // NaN and a flat slice are black.
        let fraction = (v / 2.0 - low / 2.0) / (high / 2.0 - low / 2.0);
        let byte = if fraction.is_nan() { 0.0 } else { fraction.clamp(0.0, 1.0) * 255.0 };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
        let byte = byte.round() as u8;
        byte
    });
    Slice { size, grey: grey.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    fn read(path: &Path) -> Result<ReadGrid, ReadFailure> {
        Files.read(&Source::File(path.to_owned()), &Ticket::new())
    }

    #[test]
    fn a_file_of_functions_tells_how_far_these_are_from_their_source() {
        use crate::task::encode::{Asked, encode_field};

        let grid = demo::open("blobs:10", None).unwrap();
        let asked = Asked {
            basis: crate::rbf::Basis::default(),
            max_error: None,
            mean_error: None,
            bytes: None,
            functions: 4,
            favour: None,
        };
        let what = (&grid, &grid.fields[0], crate::volume::Component::Index(0));
        let told = |_| std::ops::ControlFlow::Continue(());
        let encoded = encode_field(what, "blobs", asked, None, &Ticket::new(), told).unwrap();
        let (_folder, path) = written("a.vrbf", &io::vrbf::bytes(&encoded).unwrap());
        let found = read(&path).unwrap().encoding.unwrap();
        assert_eq!(found.max_error, encoded.errors.max);
        assert!(found.functions == encoded.encoding.functions().len() && found.max_error > 0.0);
        let (_folder, path) = written("a_4x3x2_uint8.raw", &[7; 24]);
        assert!(read(&path).unwrap().encoding.is_none());
    }

    #[test]
    fn a_raw_file_whose_name_tells_all_opens_without_asking() {
        let (_folder, path) = written("a_4x3x2_uint8.raw", &[7; 24]);
        assert_eq!(read(&path).unwrap().grid.lattice.dims, [4, 3, 2]);
    }

    #[test]
    fn a_raw_file_that_its_name_does_not_explain_is_asked_about() {
        for (name, bytes) in [("a.raw", 24), ("a_4x3x2_uint8.raw", 30), ("mystery", 24)] {
            let (_folder, path) = written(name, &vec![7; bytes]);
            let failure = read(&path).err();
            assert!(matches!(failure, Some(ReadFailure::NotRecognised(_))), "{name}: {failure:?}");
        }
    }

    #[test]
    fn a_damaged_header_is_refused_not_asked_about() {
        let (_folder, path) = written("a.nrrd", b"nonsense");
        assert!(matches!(read(&path).err(), Some(ReadFailure::Refused(_))));
        let (_folder, path) = written("notes.txt", b"not a table\nof points\n");
        assert!(matches!(read(&path).err(), Some(ReadFailure::Refused(_))));
        let missing = read(Path::new("/nowhere/at all.nrrd")).err();
        assert!(matches!(missing, Some(ReadFailure::Refused(_))), "{missing:?}");
    }

    #[test]
    fn a_format_that_is_not_read_is_told_by_its_name() {
        for (name, bytes, what) in [
            ("a.pdf", &b"%PDF-1.7"[..], "a PDF document"),
            ("notes.md", "To do: draw \u{e9}\n".as_bytes(), "a text file"),
            ("a_2x2x3_uint8.raw", b"\x89PNG\r\n\x1a\n", "a PNG picture"),
        ] {
            let (_folder, path) = written(name, bytes);
            let failure = read(&path).err();
            assert_eq!(failure, Some(ReadFailure::Foreign(what.to_owned())), "{name}");
        }
    }

    #[test]
    fn a_layout_that_a_person_chose_is_read_as_chosen() {
        let (_folder, path) = written("a.raw", &[9, 0, 1, 0, 2, 0, 3, 0, 4]);
        let layout = RawLayout {
            dims: [2, 2, 1],
            scalar_type: crate::volume::ScalarType::UInt16,
            big_endian: true,
            skip_bytes: 1,
            spacing: [1.0, 2.0, 3.0],
        };
        let source = Source::Raw(path.clone(), layout);
        let grid = Files.read(&source, &Ticket::new()).unwrap().grid;
        assert_eq!(*grid.fields[0].samples, Samples::UInt16(vec![1, 2, 3, 4]));
        assert_eq!(grid.lattice.spacing, DVec3::new(1.0, 2.0, 3.0));
        let slice = Files.raw_slice(&path, &layout, 0).unwrap();
        assert_eq!((slice.size, slice.grey), ([2, 2], vec![170, 255, 0, 85]));
        assert!(Files.raw_slice(&path, &layout, 1).is_err(), "there is no such slice");
    }

    #[test]
    fn a_large_slice_is_thinned_and_a_flat_one_is_black() {
        let slice = to_grey(&Samples::UInt8(vec![5; 1200 * 3]), [1200, 3]);
        assert_eq!(slice.size, [400, 1]);
        assert!(slice.grey.iter().all(|g| *g == 0));
        let odd = to_grey(&Samples::Float32(vec![f32::NAN, 0.0, 1.0]), [3, 1]);
        assert_eq!(odd.grey, [0, 0, 255]);
    }

    #[test]
    fn every_demo_opens_and_says_what_it_is() {
        for (name, about) in Files.demos() {
            assert!(!about.is_empty(), "{name}");
            let source = Source::parse(&format!("demo:{name}:8"));
            assert!(Files.read(&source, &Ticket::new()).is_ok(), "{name}");
        }
        let unknown = Files.read(&Source::Demo("none".into()), &Ticket::new()).err();
        let Some(ReadFailure::Refused(text)) = unknown else { panic!("{unknown:?}") };
        assert!(text.contains("head"), "{text}");
    }
}

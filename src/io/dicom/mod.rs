//! DICOM: a file, or the series that lies in a folder or beside a file.
//!
//! Positions are the file's own: millimetres to the patient's left, back and up. Slices are ordered by where they lie,
//! never by their names; what is missing, doubled, tilted or of another series is told.

mod dataset;
mod order;
mod pixels;
mod segments;
mod series;
mod slices;
mod tags;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use self::order::{Place, Stack, stack};
use self::pixels::Reader;
use self::series::Chosen;
use self::slices::Slices;
use super::axes;
use super::bytes;
use super::error::{Problem, header, unsupported};
use super::scale::{converted, rescaled};
use super::{Format, Opened, files};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Grid, Samples, ScalarType, Shape};

/// What DICOM's x, y and z point to.
const SPACE: &str = "left-posterior-superior";
/// A folder of more files is not looked through.
const MOST_FILES: usize = 50_000;
/// How deep folders are looked through.
const MOST_DEPTH: usize = 3;
/// Bytes that tell a file of this format.
const START_BYTES: u64 = 132;

/// Whether some first bytes are a DICOM file's, with or without the usual 128 bytes in front.
pub(super) fn looks_like_it(start: &[u8]) -> bool {
    start.get(128..132) == Some(b"DICM") || start.starts_with(b"\x02\0\0\0UL")
}

/// The DICOM files of a folder and those in it.
///
/// # Errors
/// Cancelled, or too many files.
pub(super) fn files_of(
    folder: &Path,
    depth: usize,
    ticket: &Ticket,
) -> Result<Vec<PathBuf>, Problem> {
    let mut found = Vec::new();
    let mut folders = vec![(folder.to_owned(), depth)];
    let mut seen = 0;
    while let Some((folder, depth)) = folders.pop() {
        let entries = std::fs::read_dir(&folder).map_err(Problem::from_opening)?;
        for entry in entries.filter_map(Result::ok) {
            ticket.checkpoint(0, 1)?;
            seen += 1;
            if seen > MOST_FILES {
                return Err(unsupported(
                    format!("a folder of at most {MOST_FILES} files"),
                    "more",
                    "choose one file of the series",
                ));
            }
            let path = entry.path();
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            if is_folder && depth > 0 {
                folders.push((path, depth - 1));
            } else if !is_folder && is_one(&path) {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

fn is_one(path: &Path) -> bool {
    use std::io::Read;
    let Ok((file, _)) = files::look_into(path) else { return false };
    let mut start = Vec::new();
    file.take(START_BYTES).read_to_end(&mut start).is_ok() && looks_like_it(&start)
}

/// Whether a folder has such files: the first is enough.
pub(super) fn is_folder_of_them(folder: &Path) -> bool {
    files_of(folder, MOST_DEPTH, &Ticket::new()).is_ok_and(|files| !files.is_empty())
}

pub(super) fn read(
    path: &Path,
    asked_for: Option<&str>,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Opened, Problem> {
    let mut warnings = Vec::new();
    let Chosen { files, series } = series::choose(path, asked_for, ticket, &mut warnings)?;
    let name = files.first().and_then(Slices::described);
    let name = name.unwrap_or_else(|| super::raw::stem(path));
    let stack = stack(&files, &mut warnings)?;
    told_of_pictures(&files, &mut warnings);
    let fields = fields(&files, &stack, &name, free_bytes, ticket, &mut warnings)?;
    warnings.extend(axes::several(&fields, "at the same place, as of time steps or echoes"));
    let dims = stack.lattice.dims;
    let mut grid = match stack.shape {
        Shape::Affine => Grid::of(stack.lattice, fields),
        shape => Grid::shaped(dims, shape, fields)?,
    };
    grid.space = stack.is_placed.then(|| SPACE.to_owned());
    grid.unit = Some("mm".to_owned());
    grid.label_names = files.first().map(|file| file.segments.clone()).unwrap_or_default();
    Ok(Opened { series, ..Opened::of(grid, Format::Dicom, warnings) })
}

/// What of the numbers' meaning is not shown.
fn told_of_pictures(files: &[Slices], warnings: &mut Vec<String>) {
    let Some(first) = files.first() else { return };
    if first.has_table {
        warnings.push(
            "the table that gives stored values their meaning (Modality LUT) is ignored".into(),
        );
    }
    let told = match first.form.photometric.as_str() {
        "MONOCHROME1" => {
            "low values are meant to be bright (MONOCHROME1): values are shown as they are"
        }
        "PALETTE COLOR" => "the palette is ignored: values are its indices",
        "YBR_FULL" | "YBR_FULL_422" if matches!(first.pixels, dataset::Pixels::Plain(..)) => {
            "colours are shown as they are stored: brightness and two differences"
        }
        _ => return,
    };
    warnings.push(told.into());
}

/// A field for each volume.
fn fields(
    files: &[Slices],
    stack: &Stack,
    name: &str,
    free_bytes: u64,
    ticket: &Ticket,
    warnings: &mut Vec<String>,
) -> Result<Vec<Field>, Problem> {
    let first = stack.steps[0][0];
    let form = &files[first.file].form;
    if form.photometric == "YBR_FULL_422"
        && matches!(files[first.file].pixels, dataset::Pixels::Plain(..))
    {
        return Err(unsupported("grey or RGB pictures", "YBR_FULL_422", "convert them to RGB"));
    }
    let stored = form.scalar_type()?;
    let sizes = stack.lattice.dims.map(|n| n as u64);
    let all = [sizes[0], sizes[1], sizes[2], form.components as u64, stack.steps.len() as u64];
    let count = bytes::checked_count("the series", &all, stored, free_bytes)?;
    if are_segments(files, stack) {
        warnings.push(
            "the segments are shown as labels: each voxel has the number of its segment".into(),
        );
        return Ok(vec![labels(files, stack, name, ticket)?]);
    }
    let meaning = Meaning::of(files, stack);
    let most = if meaning == Meaning::Stored { 1 } else { 3 };
    memory::require(
        "the series and what its numbers mean",
        ((count * stored.size_bytes()) as u64).saturating_mul(most),
        free_bytes,
    )?;
    if form.len() == 1 && count == 1 {
        return Err(header("more than one pixel", "one", "choose another file"));
    }
    let total = stack.steps.iter().map(Vec::len).sum::<usize>() as u64;
    let mut done = 0;
    let mut fields = Vec::new();
    for (step, places) in stack.steps.iter().enumerate() {
        let mut values = bytes::no_samples(match meaning {
            Meaning::PerSlice => ScalarType::Float32,
            _ => stored,
        });
        let mut reader: Option<(usize, Reader<'_>)> = None;
        for place in places {
            ticket.checkpoint(done, total)?;
            done += 1;
            let mut open = match reader.take() {
                Some((file, open)) if file == place.file => open,
                _ => Reader::open(&files[place.file])?,
            };
            let frame = &files[place.file].frames[place.frame];
            let mut samples = open.frame(frame.index)?;
            if meaning == Meaning::PerSlice {
                samples = converted(&samples, ScalarType::Float32, |v| {
                    v * frame.slope + frame.intercept
                })?;
            }
            append(&mut values, &samples)?;
            reader = Some((place.file, open));
        }
        if let Meaning::Scaled { slope, intercept } = meaning {
            values = rescaled(values, slope, intercept)?;
        }
        let name = if stack.steps.len() == 1 { name.to_owned() } else { format!("{name}[{step}]") };
        fields.push(Field {
            name,
            components: form.components,
            association: Association::Point,
            samples: Arc::new(values),
        });
    }
    Ok(fields)
}

/// What stored numbers mean.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Meaning {
    Stored,
    Scaled {
        slope: f64,
        intercept: f64,
    },
    /// Each slice has a scale of its own.
    PerSlice,
}

impl Meaning {
    fn of(files: &[Slices], stack: &Stack) -> Self {
        let scale = |place: &Place| {
            let frame = &files[place.file].frames[place.frame];
            (frame.slope, frame.intercept)
        };
        let (slope, intercept) = scale(&stack.steps[0][0]);
        let is_one = stack.steps.iter().flatten().all(|place| scale(place) == (slope, intercept));
        match (is_one, slope, intercept) {
            (false, _, _) => Self::PerSlice,
            (true, 1.0, 0.0) => Self::Stored,
            (true, slope, intercept) => Self::Scaled { slope, intercept },
        }
    }
}

/// Whether the frames are masks of segments.
fn are_segments(files: &[Slices], stack: &Stack) -> bool {
    stack
        .steps
        .iter()
        .flatten()
        .any(|place| files[place.file].frames[place.frame].segment.is_some())
}

/// The masks of segments as one field: the number of the segment, the last one where several overlie.
fn labels(files: &[Slices], stack: &Stack, name: &str, ticket: &Ticket) -> Result<Field, Problem> {
    let mut labels = Vec::new();
    let total = stack.heights.iter().map(Vec::len).sum::<usize>() as u64;
    let mut done = 0;
    for places in &stack.heights {
        let start = labels.len();
        labels.resize(start + stack.lattice.dims[0] * stack.lattice.dims[1], 0_u16);
        for place in places {
            ticket.checkpoint(done, total)?;
            done += 1;
            let slices = &files[place.file];
            let frame = &slices.frames[place.frame];
            let mask = Reader::open(slices)?.frame(frame.index)?;
            for (index, label) in labels[start..].iter_mut().enumerate() {
                if index < mask.len() && mask.get(index) > 0.0 {
                    *label = frame.segment.unwrap_or(1);
                }
            }
        }
    }
    Ok(Field {
        name: name.to_owned(),
        components: 1,
        association: Association::Point,
        samples: Arc::new(Samples::UInt16(labels)),
    })
}

fn append(values: &mut Samples, more: &Samples) -> Result<(), Problem> {
    bytes::reserve_samples(values, more.len())?;
    macro_rules! append {
        ($($kind:ident),*) => {
            match (values, more) {
                $((Samples::$kind(to), Samples::$kind(from)) => to.extend_from_slice(from),)*
                _ => unreachable!("frames of one form have one type"),
            }
        };
    }
    append!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64);
    Ok(())
}

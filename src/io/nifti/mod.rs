//! NIfTI-1 and NIfTI-2 (`.nii`, `.nii.gz`, `.hdr` with `.img`), and Analyze 7.5.
//!
//! Positions are the file's own: millimetres to the right, to the front and up, by the sform, else the qform.

mod header;

use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};

use self::header::{HEADER_BYTES, Header, Version};
use super::axes::{self, Axes, Role};
use super::bytes;
use super::error::{Problem, header, unrecognised};
use super::files::DataFile;
use super::scale::rescaled;
use super::stream::Stream;
use super::{Format, Opened};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Field, Grid, Lattice};

/// What NIfTI's x, y and z point to.
const SPACE: &str = "right-anterior-superior";

/// Whether some first bytes, unpacked, are a header of these formats.
pub(super) fn format_of(start: &[u8]) -> Option<Format> {
    header::recognise(start).map(|(version, _)| match version {
        Version::Analyze => Format::Analyze,
        Version::One | Version::Two => Format::Nifti,
    })
}

/// The header beside samples without one (`brain.img`), where there is one.
pub(super) fn header_beside(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let plain = name.strip_suffix(".gz").unwrap_or(name);
    let stem = plain.strip_suffix(".img").or_else(|| plain.strip_suffix(".IMG"))?;
    let names = [".hdr", ".HDR", ".hdr.gz"].map(|end| path.with_file_name(format!("{stem}{end}")));
    names.into_iter().find(|beside| {
        Stream::start(beside, HEADER_BYTES).is_ok_and(|start| format_of(&start).is_some())
    })
}

/// The samples that belong to a header alone (`brain.hdr`).
fn samples_beside(path: &Path) -> Result<PathBuf, Problem> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let plain = name.strip_suffix(".gz").unwrap_or(&name);
    let stem = plain.rsplit_once('.').map_or(plain, |(stem, _)| stem);
    let ends = [".img", ".img.gz", ".IMG"];
    let found = ends.iter().map(|end| path.with_file_name(format!("{stem}{end}")));
    match found.into_iter().find(|beside| beside.is_file()) {
        Some(beside) => Ok(beside),
        // Told by the name that is the usual one.
        None => DataFile::find(path, &format!("{stem}.img")).map(|file| file.path),
    }
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let beside = header_beside(path);
    let path = beside.as_deref().unwrap_or(path);
    let start = Stream::start(path, HEADER_BYTES)?;
    let Some((version, endian)) = header::recognise(&start) else {
        return Err(unrecognised(
            "a NIfTI or Analyze header",
            "another",
            "check that the file has the right extension and is undamaged",
        ));
    };
    let header = Header::parse(&start, version, endian)?;
    let (scalar_type, colours) = header::type_of(header.datatype)?;
    let mut warnings = Vec::new();
    let axes = axes_of(&header, colours)?;
    let wide: Vec<u64> = axes.sizes.iter().map(|&n| n as u64).collect();
    let count = bytes::checked_count("the volume", &wide, scalar_type, free_bytes)?;
    let needed = (count * scalar_type.size_bytes()) as u64;
    // Scaled or in another order they are there twice for a moment.
    let scaled = scaling(&header).is_some();
    if axes.copies() || scaled {
        let most = if scaled { 3 } else { 2 };
        memory::require("the volume and its copy", needed.saturating_mul(most), free_bytes)?;
    }
    let lattice = lattice(&header, axes.dims(), &mut warnings);
    warnings.extend(ignored_scaling(&header));

    let data = if header.is_pair { samples_beside(path)? } else { path.to_owned() };
    let (mut stream, most_bytes) = Stream::open(&data)?;
    bytes::require_stored(needed, most_bytes.saturating_sub(header.vox_offset))?;
    stream.skip(header.vox_offset, ticket)?;
    let mut samples = stream.last_samples((scalar_type, count), endian, ticket, &mut warnings)?;
    if let Some((slope, intercept)) = scaling(&header) {
        samples = rescaled(samples, slope, intercept)?;
    }

    let fields: Vec<Field> = axes.fields(&stem(path), samples, ticket)?;
    warnings.extend(axes::several(&fields, "along time or a further dimension"));
    let is_placed = lattice.is_placed;
    let unit = match header.units & 7 {
        1 => Some("m"),
        2 => Some("mm"),
        3 => Some("µm"),
        // NIfTI's lengths are in millimetres unless it says so.
        _ if version != Version::Analyze => Some("mm"),
        _ => None,
    };
    let grid = Grid {
        space: is_placed.then(|| SPACE.to_owned()),
        unit: unit.map(str::to_owned),
        ..Grid::of(lattice.lattice, fields)
    };
    let format = if version == Version::Analyze { Format::Analyze } else { Format::Nifti };
    Ok(Opened::of(grid, format, warnings))
}

/// The file's name without `.nii.gz` and the like.
fn stem(path: &Path) -> String {
    let name = super::raw::stem(path);
    match name.strip_suffix(".nii").or_else(|| name.strip_suffix(".hdr")) {
        Some(stem) if !stem.is_empty() => stem.to_owned(),
        _ => name,
    }
}

/// Slope and intercept, where there are any.
fn scaling(header: &Header) -> Option<(f64, f64)> {
    let is_told = header.slope != 0.0 && header.slope.is_finite() && header.intercept.is_finite();
    let pair = (header.slope, header.intercept);
    (is_told && pair != (1.0, 0.0) && ![128, 2304].contains(&header.datatype)).then_some(pair)
}

/// What is said of a scale that is none. A slope of 0 or NaN says that there is none, by the format.
fn ignored_scaling(header: &Header) -> Option<String> {
    let Header { slope, intercept, .. } = *header;
    let means_none = slope == 0.0 || slope.is_nan();
    let is_none = slope.is_infinite() || !intercept.is_finite();
    (!means_none && is_none).then(|| {
        format!("the scale of the values, {slope} times and {intercept} more, makes no numbers: they are as stored")
    })
}

/// What the axes are: colours, space, time, then vectors where the header says so.
fn axes_of(header: &Header, colours: i32) -> Result<Axes, Problem> {
    // Genuine vectors, displacements, matrices, quaternions, colours; all else is a list.
    let is_of_one_sample = matches!(header.intent, 1004..=1010 | 2003 | 2004);
    let mut sizes = vec![usize::try_from(colours).unwrap_or(1)];
    let mut roles = vec![Role::Component];
    for (axis, &size) in header.sizes.iter().enumerate() {
        sizes.push(usize::try_from(size).map_err(|_too_many| {
            super::error::header(
                "sizes that this machine can count",
                size.to_string(),
                "crop the volume",
            )
        })?);
        roles.push(match axis {
            0..=2 => Role::Domain,
            4 if is_of_one_sample => Role::Component,
            _ => Role::List,
        });
    }
    if sizes[1..].iter().all(|&n| n == 1) {
        return Err(header_of_one());
    }
    Ok(Axes { sizes, roles, backwards: false })
}

fn header_of_one() -> Problem {
    header("more than one sample", "one", "choose another file")
}

/// A lattice, and whether the header says where it lies in the patient.
struct Placed {
    lattice: Lattice,
    is_placed: bool,
}

fn lattice(header: &Header, dims: [usize; 3], warnings: &mut Vec<String>) -> Placed {
    let placed = |lattice| Placed { lattice, is_placed: true };
    if header.sform_code > 0 {
        let column = |c: usize| DVec3::new(header.srow[0][c], header.srow[1][c], header.srow[2][c]);
        let steps = [column(0), column(1), column(2)];
        let made = axes::lattice(dims, column(3), &steps, &mut Vec::new());
        if made.check().is_ok() {
            return placed(made);
        }
        warnings.push("the sform of the header makes no volume: it is ignored".into());
    }
    let spacing = spacing(header, dims, warnings);
    if header.qform_code > 0 {
        let [b, c, d, x, y, z] = header.quaternion;
        let origin = DVec3::new(x, y, z);
        // The real part is what is left of a length of 1.
        let a = (1.0 - (b * b + c * c + d * d)).max(0.0).sqrt();
        let turned = DMat3::from_quat(DQuat::from_xyzw(b, c, d, a).normalize());
        let third = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        let direction = turned * DMat3::from_diagonal(DVec3::new(1.0, 1.0, third));
        let made = Lattice { dims, spacing, origin, direction };
        if made.check().is_ok() {
            return placed(made);
        }
        warnings.push("the qform of the header makes no volume: it is ignored".into());
    }
    warnings.push(
        "the header does not say how the volume lies in the patient: left and right may be swapped"
            .into(),
    );
    let lattice = Lattice { dims, spacing, origin: DVec3::ZERO, direction: DMat3::IDENTITY };
    Placed { lattice, is_placed: false }
}

/// Distances of neighbours; 1 where the header has none.
fn spacing(header: &Header, dims: [usize; 3], warnings: &mut Vec<String>) -> DVec3 {
    let mut spacing = DVec3::ONE;
    for axis in 0..3 {
        let told = header.pixdim[axis + 1].abs();
        if told.is_finite() && told > 0.0 {
            spacing[axis] = told;
        } else if dims[axis] > 1 {
            warnings.push(format!("axis {axis} has no spacing: 1 is used"));
        }
    }
    spacing
}

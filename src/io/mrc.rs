//! MRC and CCP4 maps (`.mrc`, `.map`, `.ccp4`, `.rec`, `.st`): densities of electron microscopes and crystals.

use std::path::Path;

use glam::{DMat3, DVec3};

use super::axes::{self, Axes, Role};
use super::bytes::{self, Endian};
use super::error::{Problem, header, truncated, unsupported};
use super::numbers::Numbers;
use super::scale::converted;
use super::stream::Stream;
use super::{Format, Opened};
use crate::core::progress::Ticket;
use crate::core::{memory, plain_numbers};
use crate::volume::{Grid, Lattice, Samples, ScalarType};

const HEADER_BYTES: usize = 1024;
/// Extensions of such files, of which old ones have no magic.
pub(super) const EXTENSIONS: [&str; 7] = ["mrc", "ccp4", "map", "rec", "st", "ali", "mrcs"];

/// Whether some first bytes, unpacked, are a header with its magic.
pub(super) fn looks_like_it(start: &[u8]) -> bool {
    start.get(208..211) == Some(b"MAP") && endian_of(start).is_some()
}

/// Whether they may be one of before there was a magic.
pub(super) fn may_be_it(start: &[u8]) -> bool {
    start.len() >= HEADER_BYTES && endian_of(start).is_some()
}

/// The order of bytes in which the numbers make sense.
fn endian_of(start: &[u8]) -> Option<Endian> {
    [Endian::Little, Endian::Big].into_iter().find(|&endian| {
        let n = Numbers { bytes: start, endian };
        let axes = [64, 68, 72].map(|place| n.i32(place));
        let is_order = axes == [0; 3] || permutation(axes).is_some();
        is_order
            && (0..=101).contains(&n.i32(12))
            && [0, 4, 8].iter().all(|&place| (1..1 << 24).contains(&n.i32(place)))
    })
}

/// Which of x, y and z the columns, rows and sections run along.
fn permutation(axes: [i32; 3]) -> Option<[usize; 3]> {
    let told = axes.map(|axis| usize::try_from(axis - 1).unwrap_or(usize::MAX));
    (0..3).all(|axis| told.contains(&axis)).then_some(told)
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let start = Stream::start(path, HEADER_BYTES)?;
    if start.len() < HEADER_BYTES {
        return Err(truncated(
            "a header of 1024 bytes",
            format!("{} bytes", start.len()),
            "the file was cut short: copy it again",
        ));
    }
    let Some(endian) = endian_of(&start) else {
        return Err(header("an MRC header", "numbers that make none", "copy the file again"));
    };
    let n = Numbers { bytes: &start, endian };
    let mut warnings = Vec::new();
    let mode = n.i32(12);
    let stored = stored_type(mode, n)?;
    let sizes = [0, 4, 8].map(|place| u64::try_from(n.i32(place)).unwrap_or_default());
    let count = bytes::checked_count("the map", &sizes, stored, free_bytes)?;
    let extended = u64::try_from(n.i32(92)).map_err(|_negative| {
        header(
            "an extended header of 0 bytes or more (NSYMBT)",
            n.i32(92).to_string(),
            "correct the header",
        )
    })?;
    let (mut stream, most_bytes) = Stream::open(path)?;
    let before = HEADER_BYTES as u64 + extended;
    let needed = (count * stored.size_bytes()) as u64;
    bytes::require_stored(needed, most_bytes.saturating_sub(before))?;

    let axes = axes_of(sizes.map(|n| usize::try_from(n).unwrap_or(usize::MAX)), n);
    if axes.copies() || mode == 12 {
        memory::require("the map and its copy", needed.saturating_mul(3), free_bytes)?;
    }
    stream.skip(before, ticket)?;
    let mut samples = stream.last_samples((stored, count), endian, ticket, &mut warnings)?;
    if mode == 12 {
        samples = of_halves(&samples)?;
    }
    let lattice = lattice(n, axes.dims(), &mut warnings);
    let fields = axes.fields(&super::raw::stem(path), samples, ticket)?;
    warnings.extend(axes::several(&fields, "one after another"));
    let grid = Grid { unit: Some("Å".to_owned()), ..Grid::of(lattice, fields) };
    Ok(Opened::of(grid, Format::Mrc, warnings))
}

fn stored_type(mode: i32, n: Numbers<'_>) -> Result<ScalarType, Problem> {
    // IMOD's stamp, and its flag that bytes have a sign.
    let is_imod_unsigned = n.i32(152) == 1_146_047_817 && n.i32(156) & 1 == 0;
    Ok(match mode {
        0 if is_imod_unsigned => ScalarType::UInt8,
        0 => ScalarType::Int8,
        1 => ScalarType::Int16,
        2 => ScalarType::Float32,
        6 | 12 => ScalarType::UInt16,
        _ => {
            let found = match mode {
                3 | 4 => "complex numbers, as of a transform".to_owned(),
                101 => "numbers of four bits".to_owned(),
                _ => format!("the mode {mode}"),
            };
            return Err(unsupported(
                "a map of real numbers (mode 0, 1, 2, 6 or 12)",
                found,
                "convert it to mode 2",
            ));
        }
    })
}

/// Floats of 16 bits, read as numbers of as many.
fn of_halves(samples: &Samples) -> Result<Samples, Problem> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bits of 16")]
    converted(samples, ScalarType::Float32, |bits| f64::from(half::f16::from_bits(bits as u16)))
}

/// A stack of volumes has several of `MZ` sections each.
fn axes_of(sizes: [usize; 3], n: Numbers<'_>) -> Axes {
    let each = usize::try_from(n.i32(36)).unwrap_or_default();
    let mut axes = Axes { sizes: sizes.to_vec(), roles: vec![Role::Domain; 3], backwards: false };
    if n.i32(88) == 401 && each > 0 && each < sizes[2] && sizes[2].is_multiple_of(each) {
        axes.sizes = vec![sizes[0], sizes[1], each, sizes[2] / each];
        axes.roles.push(Role::List);
    }
    axes
}

fn lattice(n: Numbers<'_>, dims: [usize; 3], warnings: &mut Vec<String>) -> Lattice {
    let told = [64, 68, 72].map(|place| n.i32(place));
    let along = permutation(told).unwrap_or([0, 1, 2]);
    // Of x, y and z: steps of the cell, and its edges' directions.
    let mut step = DVec3::ONE;
    for axis in 0..3 {
        let (length, intervals) = (n.f32(40 + 4 * axis), n.i32(28 + 4 * axis));
        let found = length / f64::from(intervals);
        if intervals > 0 && found.is_finite() && found > 0.0 {
            step[axis] = found;
        } else {
            warnings
                .push(format!("the cell has no length along {}: 1 is used", ["x", "y", "z"][axis]));
        }
    }
    let angles = [0, 1, 2].map(|axis| n.f32(52 + 4 * axis));
    let edges = edges(angles).unwrap_or_else(|| {
        // Many programs leave all three at 0.
        if angles != [0.0; 3] {
            let told = plain_numbers(angles);
            warnings
                .push(format!("the cell's angles, {told}, make no cell: right angles are used"));
        }
        DMat3::IDENTITY
    });
    let starts = [0, 1, 2].map(|axis| f64::from(n.i32(16 + 4 * axis)));
    let mut lattice =
        Lattice { dims, spacing: DVec3::ONE, origin: DVec3::ZERO, direction: DMat3::IDENTITY };
    for (axis, &world) in along.iter().enumerate() {
        lattice.spacing[axis] = step[world];
        *lattice.direction.col_mut(axis) = edges.col(world);
        lattice.origin += edges.col(world) * step[world] * starts[axis];
    }
    let origin = DVec3::from([0, 1, 2].map(|axis| n.f32(196 + 4 * axis)));
    if origin != DVec3::ZERO && origin.is_finite() {
        lattice.origin = origin;
    }
    lattice
}

/// Unit edges of a cell of such angles, degrees: the first along x, the second in the plane of x and y; `None` where no cell has
/// such angles.
fn edges([alpha, beta, gamma]: [f64; 3]) -> Option<DMat3> {
    let all = [alpha, beta, gamma];
    if all == [90.0; 3] {
        return Some(DMat3::IDENTITY);
    }
    if !all.iter().all(|angle| (1.0..179.0).contains(angle)) {
        return None;
    }
    let [ca, cb, cg] = all.map(|angle| angle.to_radians().cos());
    let sg = gamma.to_radians().sin();
    let across = (ca - cb * cg) / sg;
    let up = (1.0 - cb * cb - across * across).max(0.0).sqrt();
    let columns = [DVec3::X, DVec3::new(cg, sg, 0.0), DVec3::new(cb, across, up)];
    (up > 1e-6).then(|| DMat3::from_cols(columns[0], columns[1], columns[2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_as_oblique_as_its_angles() {
        let angles = [70.0, 80.0, 100.0_f64];
        let [a, b, c] = [0, 1, 2].map(|axis| edges(angles).unwrap().col(axis));
        for (found, angle) in [(b.dot(c), 70.0), (a.dot(c), 80.0), (a.dot(b), 100.0_f64)] {
            assert!((found - angle.to_radians().cos()).abs() < 1e-12);
        }
        assert_eq!(edges([90.0; 3]), Some(DMat3::IDENTITY));
        assert_eq!((edges([0.0; 3]), edges([30.0, 30.0, 120.0])), (None, None));
    }

    #[test]
    fn columns_rows_and_sections_run_along_each_axis_once() {
        assert_eq!(permutation([3, 1, 2]), Some([2, 0, 1]));
        for bad in [[1, 1, 2], [0, 1, 2], [1, 2, 4]] {
            assert_eq!(permutation(bad), None);
        }
    }
}

//! Fields as basis functions (`.vrbf`): written by `voxsplat encode`.
//!
//! A line of letters and the version, a line of JSON that people can read, and the functions: whole numbers of two or three
//! bytes (`packed`), or, in files of version 1 and where that would bring errors, 32-bit little-endian floats, of each the
//! centre less the box's least corner, the shape (its upper triangle by rows; one number where it is as wide in every
//! direction), and the weight. Since version 3 the bits of where the
//! source has values may come last (`cover`). A CRC-32 of these bytes is in the header.

mod cover;
mod packed;

use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use flate2::Crc;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

pub use self::cover::Cover;
use self::cover::Told;
use self::packed::{Column, Packed};
use super::error::{Problem, ReadError, corrupt, header, quoted, truncated, unsupported};
use super::{Encoded, Ended, Format, Opened, Source, files};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::core::{counted, plain_number};
use crate::rbf::{Basis, Encoding, Errors, Favour, Function, few_digits};
use crate::volume::{Association, Field, Grid, Lattice, Places, Samples, StandsFor};

/// How a file begins.
pub(super) const MAGIC: &[u8] = b"VOXSPLAT RBF ";
const VERSION: &str = "3";
/// Of which the functions are floats.
const FIRST_VERSION: &str = "1";
/// Which does not tell the source's range, nor where that has values.
const SECOND_VERSION: &str = "2";
/// Of the two lines.
const MOST_HEADER_BYTES: u64 = 1 << 16;
/// What a function takes in memory, also while it is read.
const BYTES_IN_MEMORY: u64 = 400;
/// A file of more is not one of these.
const MOST_FUNCTIONS: usize = 1 << 24;
/// Rounding below this share of the values' range is not seen, of colours in 8 bits.
const SEEN: f64 = 1e-3;

/// The line that people can read.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    functions: usize,
    basis: Basis,
    bias: f64,
    /// Where functions end.
    epsilon: f64,
    /// Least x, y, z, then greatest, world.
    bounds: [f64; 6],
    errors: Errors,
    /// Greatest error that was asked for.
    #[serde(default)]
    wanted: Option<f64>,
    /// Mean error that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    wanted_mean: Option<f64>,
    /// Most bytes that were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    wanted_bytes: Option<u64>,
    /// Which samples counted more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    favour: Option<Favour>,
    /// The errors of these.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    favoured: Option<Errors>,
    source: String,
    field: String,
    /// The least and the greatest of the samples' values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    range: Option<[f64; 2]>,
    samples: usize,
    left_out: usize,
    /// The samples were those of a mesh or of points, and lie elsewhere than the lattice's.
    #[serde(default)]
    scattered: bool,
    /// Samples lie all over the box.
    #[serde(default = "usually")]
    fills_box: bool,
    /// How far the sum goes beyond the range of the samples between these.
    #[serde(default)]
    overshoot: f64,
    /// Of a mesh, how far the sum is from what lies between its points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    between: Option<Errors>,
    /// Why there are fewer functions than were allowed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ended: Option<Ended>,
    dims: [usize; 3],
    spacing: [f64; 3],
    origin: [f64; 3],
    direction: [f64; 9],
    space: Option<String>,
    unit: Option<String>,
    /// How functions are whole numbers; floats where it is not there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    packed: Option<Layout>,
    /// Where the source has values: everywhere in the box where it is not there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cover: Option<Told>,
    crc32: u32,
}

/// Files that do not say so are of grids, or of what is [`Header::scattered`].
fn usually() -> bool {
    true
}

/// How functions are whole numbers.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Layout {
    /// Of each number of a function.
    columns: Vec<Column>,
    /// By zlib.
    deflated: bool,
    /// As they are in the file.
    bytes: u64,
}

/// How finely a file holds functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Two bytes a number.
    Bits16,
    /// The same, and three of weights.
    Weights24,
    /// Three bytes a number.
    Bits24,
    /// Floats of four bytes.
    Single,
}

impl Precision {
    /// All of them, the shortest first.
    pub const ALL: [Self; 4] = [Self::Bits16, Self::Weights24, Self::Bits24, Self::Single];

    /// Of a whole number; of a function's weight, or of what else it has. `None` for floats.
    fn bytes_of(self, is_weight: bool) -> Option<u8> {
        match self {
            Self::Bits16 => Some(2),
            Self::Weights24 => Some(if is_weight { 3 } else { 2 }),
            Self::Bits24 => Some(3),
            Self::Single => None,
        }
    }
}

/// The same functions with the numbers that a file of that precision holds, at least; those that these make no more than ε are
/// left out. Stated errors are of these. What was rounded so before stays as it is.
#[must_use]
pub fn rounded(encoding: &Encoding, precision: Precision) -> Encoding {
    let low = encoding.bounds()[0];
    let functions = match Packed::of(encoding, precision) {
        Some(packed) => packed.functions(encoding.basis(), low),
        None => encoding.functions().iter().map(|f| single(f, low)).collect(),
    };
    Encoding::new(
        encoding.basis(),
        encoding.bias(),
        encoding.epsilon(),
        functions,
        encoding.bounds(),
    )
}

fn single(function: &Function, low: DVec3) -> Function {
    let narrow = |v: f64| f64::from(v as f32);
    Function {
        centre: DVec3::from((function.centre - low).to_array().map(narrow)) + low,
        shape: DMat3::from_cols_array(&function.shape.to_cols_array().map(narrow)),
        weight: narrow(function.weight),
    }
}

/// Bytes that a function of the shortest precision takes at most: deflated ones may take less.
pub fn bytes_a_function(basis: Basis) -> u64 {
    2 * numbers_of(basis) as u64
}

/// Bytes that a file of so many functions of the shortest precision takes at most, whatever their numbers and errors are.
pub fn most_bytes(functions: u64, basis: Basis, source: &Source) -> u64 {
    // The number with the most letters.
    let longest = -f64::MIN_POSITIVE;
    let errors = Errors { max: longest, mean: longest, rms: longest };
    let known = Header {
        functions: MOST_FUNCTIONS,
        bias: longest,
        epsilon: longest,
        bounds: [longest; 6],
        errors,
        favoured: source.favour.map(|_| errors),
        overshoot: longest,
        between: (!source.fills_box).then_some(errors),
        ended: Some(Ended::NoNearer { allowed: Some(usize::MAX) }),
        packed: Some(Layout {
            columns: vec![Column::LONGEST; numbers_of(basis)],
            deflated: false,
            bytes: u64::MAX,
        }),
        crc32: u32::MAX,
        ..header_of(basis, source)
    };
    // What no JSON can hold is told where it is to be written.
    let line = serde_json::to_string(&known).map_or(0, |line| line.len());
    let cover = source.cover.as_ref().map_or(0, |cover| cover.deflated().len());
    let lines = MAGIC.len() + VERSION.len() + line + 2;
    ((lines + cover) as u64).saturating_add(functions.saturating_mul(bytes_a_function(basis)))
}

/// Functions of the shortest precision that a file of so many bytes has room for, whatever their numbers and errors are.
pub fn most_functions(bytes: u64, basis: Basis, source: &Source) -> usize {
    let left = bytes.saturating_sub(most_bytes(0, basis, source));
    usize::try_from(left / bytes_a_function(basis)).unwrap_or(usize::MAX).min(MOST_FUNCTIONS)
}

/// What is told of a source, and of functions nothing.
fn header_of(basis: Basis, source: &Source) -> Header {
    let Lattice { dims, spacing, origin, direction } = source.lattice;
    Header {
        functions: 0,
        basis,
        bias: 0.0,
        epsilon: 0.0,
        bounds: [0.0; 6],
        errors: Errors::default(),
        wanted: source.wanted,
        wanted_mean: source.wanted_mean,
        wanted_bytes: source.wanted_bytes,
        favour: source.favour,
        favoured: None,
        source: source.name.clone(),
        field: source.field.clone(),
        range: source.range,
        samples: source.samples,
        left_out: source.left_out,
        scattered: memory::checked_product(&dims.map(|n| n as u64))
            != (source.samples as u64).checked_add(source.left_out as u64),
        fills_box: source.fills_box,
        overshoot: 0.0,
        between: None,
        ended: None,
        dims,
        spacing: spacing.to_array(),
        origin: origin.to_array(),
        direction: direction.to_cols_array(),
        space: source.space.clone(),
        unit: source.unit.clone(),
        packed: None,
        cover: source.cover.as_ref().map(Cover::told),
        crc32: 0,
    }
}

/// A file's content: whole numbers where functions are such ([`rounded`]), and floats where they are not.
///
/// # Errors
/// What no JSON can hold, which are numbers that are not finite.
pub fn bytes(encoded: &Encoded) -> Result<Vec<u8>, String> {
    let Encoded { encoding, errors, favoured, source, overshoot, between, ended } = encoded;
    let [low, high] = encoding.bounds();
    let is_exact =
        |packed: &Packed| packed.functions(encoding.basis(), low) == encoding.functions();
    let mut all = Precision::ALL.into_iter().filter_map(|p| Packed::of(encoding, p));
    let (packed, mut body) = match all.find(is_exact) {
        Some(packed) => {
            let (body, deflated) = packed.body();
            let (columns, bytes) = (packed.columns, body.len() as u64);
            (Some(Layout { columns, deflated, bytes }), body)
        }
        None => (None, singles(encoding)),
    };
    let header = Header {
        functions: encoding.functions().len(),
        bias: encoding.bias(),
        epsilon: encoding.epsilon(),
        bounds: [low.x, low.y, low.z, high.x, high.y, high.z],
        errors: *errors,
        favoured: *favoured,
        overshoot: *overshoot,
        between: *between,
        ended: *ended,
        packed,
        ..header_of(encoding.basis(), source)
    };
    body.extend(source.cover.iter().flat_map(Cover::deflated));
    let text = |header: &Header| serde_json::to_string(header).map_err(|error| error.to_string());
    let crc32 = checksum(text(&header)?.as_bytes(), &body);
    let line = text(&Header { crc32, ..header })?;
    Ok([MAGIC, VERSION.as_bytes(), b"\n", line.as_bytes(), b"\n", &body].concat())
}

/// Functions as floats.
fn singles(encoding: &Encoding) -> Vec<u8> {
    let low = encoding.bounds()[0];
    let mut body = Vec::new();
    for function in encoding.functions() {
        let mut numbers = (function.centre - low).to_array().to_vec();
        let rows = function.shape.transpose();
        match encoding.basis() {
            Basis::Ellipsoid => {
                numbers.extend(rows.x_axis.to_array());
                numbers.extend([rows.y_axis.y, rows.y_axis.z, rows.z_axis.z]);
            }
            Basis::Gaussian | Basis::Multiquadric => numbers.push(rows.x_axis.x),
        }
        numbers.push(function.weight);
        body.extend(numbers.into_iter().flat_map(|number| (number as f32).to_le_bytes()));
    }
    body
}

/// Of a body, and since version 2 of what is told of it before: all of the line but the checksum itself, which is its last entry.
fn checksum(line: &[u8], body: &[u8]) -> u32 {
    let told = line.windows(CHECKSUM.len()).rposition(|part| part == CHECKSUM.as_bytes());
    let mut crc = Crc::new();
    crc.update(&line[..told.unwrap_or(line.len())]);
    crc.update(body);
    crc.sum()
}

const CHECKSUM: &str = "\"crc32\":";

/// The functions of a file.
///
/// # Errors
/// No such file, or a damaged one.
pub fn load(path: &Path) -> Result<Encoded, ReadError> {
    content(path, memory::free_bytes()).map_err(|problem| problem.at(path))
}

/// The sum as a grid: at the source's samples, or at `dims` samples over the same box.
pub(super) fn read(
    path: &Path,
    dims: Option<[usize; 3]>,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Opened, Problem> {
    let encoded = content(path, free_bytes)?;
    let source = &encoded.source;
    let lattice = dims.map_or(source.lattice, |dims| with_dims(source.lattice, dims));
    let count = memory::checked_product(&lattice.dims.map(|n| n as u64));
    let bytes = count.and_then(|count| count.checked_mul(4)).unwrap_or(u64::MAX);
    memory::require("the values of the functions", bytes, free_bytes)?;
    let [x, y, z] = lattice.dims;
    let samples = Places::Lattice(lattice);
    let mut values: Vec<f32> = Vec::with_capacity(lattice.len());
    for slice in 0..z {
        ticket.checkpoint(slice as u64, z as u64)?;
        let own = slice * x * y..(slice + 1) * x * y;
        let places: Vec<DVec3> = own.map(|i| samples.at(i).0).collect();
        let is_there: Vec<bool> = places.iter().map(|at| source.has(*at)).collect();
        let there = places.iter().zip(&is_there).filter(|(_, is_there)| **is_there);
        let there: Vec<DVec3> = there.map(|(at, _)| *at).collect();
        let sums = encoded.encoding.values(&there, ticket)?.into_iter();
        let mut sums = sums.map(|sum| if encoded.may_be_of_source(sum) { sum } else { f64::NAN });
        let sum_at = |is_there: &bool| is_there.then(|| sums.next()).flatten().unwrap_or(f64::NAN);
        values.extend(is_there.iter().map(sum_at).map(|sum| sum as f32));
    }
    let finite = values.iter().copied().filter(|value| value.is_finite());
    let [least, most] =
        finite.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
    let range = (f64::from(most) - f64::from(least)).max(0.0);
    let field = Field {
        name: source.field.clone(),
        components: 1,
        association: Association::Point,
        samples: Arc::new(Samples::Float32(values)),
    };
    let count = counted(encoded.encoding.functions().len(), "basis function");
    let mut warnings = vec![format!(
        "{count}, and samples of their sum at {x} × {y} × {z} places; from the source's samples: {}",
        encoded.errors
    )];
    if let Some(errors) = encoded.favoured {
        warnings.push(format!("of the samples that were favoured: {errors}"));
    }
    warnings.extend(encoded.told_left_out());
    warnings.extend(encoded.told_beyond_samples());
    let least_told = encoded.errors.max.max(SEEN * range);
    if encoded.encoding.rounding() > least_told {
        warnings.push(format!(
            "large weights of opposite signs cancel in the sum: pictures, which are drawn in single precision, may be off by \
             up to {}",
            few_digits(encoded.encoding.rounding())
        ));
    }
    let grid = Grid {
        space: source.space.clone(),
        unit: source.unit.clone(),
        functions: Some(Arc::new(encoded.encoding.clone())),
        stands_for: source.range.map(|range| StandsFor {
            range,
            bounds: source.cover.is_some().then(|| encoded.encoding.bounds()),
        }),
        ..Grid::of(lattice, vec![field])
    };
    Ok(Opened { encoding: Some(encoded.facts()), ..Opened::of(grid, Format::Vrbf, warnings) })
}

/// As many samples over the same box.
fn with_dims(lattice: Lattice, dims: [usize; 3]) -> Lattice {
    let steps = |n: usize| n.saturating_sub(1).max(1) as f64;
    let spacing = DVec3::from(std::array::from_fn(|axis| {
        lattice.spacing[axis] * steps(lattice.dims[axis]) / steps(dims[axis])
    }));
    Lattice { dims, spacing, ..lattice }
}

fn content(path: &Path, free_bytes: u64) -> Result<Encoded, Problem> {
    let (file, len) = files::open_file(path)?;
    let mut reader = files::buffered(file);
    let mut start = Vec::new();
    reader.by_ref().take(MOST_HEADER_BYTES).read_to_end(&mut start).map_err(Problem::Io)?;
    if !start.starts_with(MAGIC) {
        return Err(super::not_as_named("basis functions (\"VOXSPLAT RBF …\")", &start));
    }
    let mut lines = start.splitn(3, |byte| *byte == b'\n');
    let (Some(first), Some(line), Some(begun)) = (lines.next(), lines.next(), lines.next()) else {
        return Err(header(
            "two lines of text before the functions",
            "fewer",
            "copy the file again",
        ));
    };
    let version = first.strip_prefix(MAGIC).unwrap_or_default();
    if ![FIRST_VERSION, SECOND_VERSION, VERSION].map(str::as_bytes).contains(&version) {
        return Err(unsupported(
            format!("version {FIRST_VERSION} to {VERSION} of the format"),
            quoted(&String::from_utf8_lossy(version)),
            "open it with the Voxsplat that wrote it",
        ));
    }
    let found: Header = serde_json::from_slice(line).map_err(|error| {
        header(
            "a line of JSON that tells of the functions",
            quoted(&error.to_string()),
            "encode the source again",
        )
    })?;
    if found.functions > MOST_FUNCTIONS {
        return Err(unsupported(
            format!("at most {MOST_FUNCTIONS} functions"),
            found.functions.to_string(),
            "encode the source again with fewer",
        ));
    }
    if let Some(packed) = &found.packed
        && !Packed::are_sound(&packed.columns, found.basis)
    {
        return Err(header(
            "whole numbers of functions, and their steps",
            "others",
            "encode the source again",
        ));
    }
    let needed = (found.functions as u64).saturating_mul(BYTES_IN_MEMORY);
    memory::require("the functions", needed, free_bytes)?;
    let each = numbers_of(found.basis);
    let of_functions = match &found.packed {
        Some(packed) => {
            // They are deflated only where that is shorter.
            let each: u64 = packed.columns.iter().map(|column| u64::from(column.2)).sum();
            let most = each.saturating_mul(found.functions as u64);
            if packed.bytes > most {
                return Err(corrupt(
                    format!("at most {most} bytes of functions"),
                    packed.bytes.to_string(),
                    "encode the source again",
                ));
            }
            packed.bytes
        }
        None => (found.functions * each * 4) as u64,
    };
    let of_cover = found.cover.map_or(0, |cover| cover.bytes);
    let expected = of_functions.saturating_add(of_cover);
    memory::require("the functions", expected.saturating_add(needed), free_bytes)?;
    let body_len = len - (start.len() - begun.len()) as u64;
    if body_len != expected {
        let sentence = (format!("{expected} bytes of functions"), body_len.to_string());
        return Err(match body_len < expected {
            true => truncated(sentence.0, sentence.1, "the file was cut short: copy it again"),
            false => corrupt(sentence.0, sentence.1, "copy the file again"),
        });
    }
    let checked = if version == FIRST_VERSION.as_bytes() { &[][..] } else { line };
    let mut body = begun.to_vec();
    reader.read_to_end(&mut body).map_err(Problem::Io)?;
    if body.len() as u64 != expected || checksum(checked, &body) != found.crc32 {
        return Err(corrupt(
            "functions, and what is told of them, with the checksum that stands there",
            "another one",
            "copy the file again",
        ));
    }
    // Both are as long as that.
    #[expect(clippy::cast_possible_truncation, reason = "it is no longer than the body")]
    let cover = body.split_off(of_functions as usize);
    let low = DVec3::from_slice(&found.bounds[..3]);
    let high = DVec3::from_slice(&found.bounds[3..]);
    let functions = match found.packed {
        Some(Layout { columns, deflated, .. }) => {
            let packed = Packed::from_body(columns, found.functions, (&body[..], deflated));
            let packed = packed.ok_or_else(|| {
                let expected = format!("the numbers of {} functions", found.functions);
                corrupt(expected, "others", "encode the source again")
            })?;
            packed.functions(found.basis, low)
        }
        None => {
            let floats: Vec<f64> = body
                .chunks_exact(4)
                .map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
                .collect();
            floats.chunks_exact(each).map(|f| function(f, found.basis, low)).collect::<Vec<_>>()
        }
    };
    let is_sound = |f: &Function| {
        let determinant = f.shape.determinant();
        f.centre.is_finite() && f.weight.is_finite() && determinant.is_finite() && determinant > 0.0
    };
    let is_box = low.is_finite() && high.is_finite() && low.cmple(high).all();
    let is_level = found.bias.is_finite() && found.epsilon.is_finite() && found.epsilon > 0.0;
    if !is_box || !is_level || !functions.iter().all(is_sound) {
        return Err(header(
            "finite functions of some width in a box",
            "others",
            "encode the source again",
        ));
    }
    let told = [Some(found.errors), found.favoured, found.between].into_iter().flatten();
    let told = told.flat_map(|errors| [errors.max, errors.mean, errors.rms]);
    let mut told = told.chain(found.wanted).chain(found.wanted_mean).chain([found.overshoot]);
    if let Some(error) = told.find(|error| error.is_nan() || *error < 0.0) {
        return Err(header("errors of 0 or more", plain_number(error), "encode the source again"));
    }
    if let Some([low, high]) = found.range
        && !(low <= high && (high - low).is_finite())
    {
        return Err(header(
            "a range of values from the least to the greatest",
            format!("{} to {}", plain_number(low), plain_number(high)),
            "encode the source again",
        ));
    }
    if let Some(Err(error)) = found.favour.map(|favour| favour.check()) {
        return Err(header(
            "samples that can be favoured",
            quoted(&error.to_string()),
            "encode the source again",
        ));
    }
    let lattice = Lattice {
        dims: found.dims,
        spacing: DVec3::from(found.spacing),
        origin: DVec3::from(found.origin),
        direction: DMat3::from_cols_array(&found.direction),
    };
    lattice.check()?;
    let places = memory::checked_product(&found.dims.map(|n| n as u64));
    let samples = (found.samples as u64).checked_add(found.left_out as u64);
    let is_as_told = match found.scattered {
        false => places == samples,
        true => places.zip(samples).is_some_and(|(places, samples)| {
            places > 0 && places <= Grid::most_samples_of_functions(samples)
        }),
    };
    if !is_as_told {
        return Err(header(
            "as many samples as the dimensions say",
            "others",
            "encode the source again",
        ));
    }
    let cover = match found.cover {
        None => None,
        Some(told) => {
            let cover = Cover::from_file(found.dims, told.edge, &cover);
            Some(cover.ok_or_else(|| {
                let expected = "a bit for each cube of the lattice's samples";
                corrupt(expected, "others", "encode the source again")
            })?)
        }
    };
    Ok(Encoded {
        encoding: Encoding::new(found.basis, found.bias, found.epsilon, functions, [low, high]),
        errors: found.errors,
        favoured: found.favoured,
        source: Source {
            name: found.source,
            field: found.field,
            samples: found.samples,
            left_out: found.left_out,
            wanted: found.wanted,
            wanted_mean: found.wanted_mean,
            wanted_bytes: found.wanted_bytes,
            favour: found.favour,
            lattice,
            fills_box: found.fills_box && !found.scattered,
            range: found.range,
            cover,
            space: found.space,
            unit: found.unit,
        },
        overshoot: found.overshoot,
        between: found.between,
        ended: found.ended,
    })
}

/// Of each function.
fn numbers_of(basis: Basis) -> usize {
    if basis == Basis::Ellipsoid { 10 } else { 5 }
}

fn function(numbers: &[f64], basis: Basis, low: DVec3) -> Function {
    let rows = match basis {
        Basis::Ellipsoid => {
            let [a, b, c, d, e, f] = std::array::from_fn(|i| numbers[3 + i]);
            DMat3::from_cols_array(&[a, b, c, 0.0, d, e, 0.0, 0.0, f])
        }
        Basis::Gaussian | Basis::Multiquadric => DMat3::from_diagonal(DVec3::splat(numbers[3])),
    };
    Function {
        centre: DVec3::from_slice(numbers) + low,
        shape: rows.transpose(),
        weight: numbers[numbers.len() - 1],
    }
}

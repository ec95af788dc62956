//! The headers of NIfTI-1, NIfTI-2 and Analyze 7.5, brought to one form.

use super::super::bytes::Endian;
use super::super::error::{Problem, header, unsupported};
use super::super::numbers::Numbers;
use crate::core::plain_number;
use crate::volume::ScalarType;

/// Bytes that hold any of the headers.
pub(super) const HEADER_BYTES: usize = 540;

/// Which of the formats it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Version {
    /// Mayo's, before NIfTI; also as SPM wrote it.
    Analyze,
    One,
    Two,
}

/// What a header says, in the words of NIfTI's own.
#[derive(Debug, Clone)]
pub(super) struct Header {
    /// The samples lie in a file of their own (`.img`).
    pub(super) is_pair: bool,
    /// Sizes of the axes in use; at least one.
    pub(super) sizes: Vec<u64>,
    pub(super) datatype: i32,
    /// `qfac` first.
    pub(super) pixdim: [f64; 8],
    pub(super) vox_offset: u64,
    pub(super) slope: f64,
    pub(super) intercept: f64,
    pub(super) intent: i32,
    pub(super) units: i32,
    pub(super) qform_code: i32,
    pub(super) sform_code: i32,
    /// b, c, d, and the place of the first sample.
    pub(super) quaternion: [f64; 6],
    /// Rows of the affine matrix.
    pub(super) srow: [[f64; 4]; 3],
}

/// Which of the formats the first bytes are, and in which order of bytes.
pub(super) fn recognise(start: &[u8]) -> Option<(Version, Endian)> {
    for endian in [Endian::Little, Endian::Big] {
        let numbers = Numbers { bytes: start, endian };
        let is = |place: usize, magic: &[u8]| start.get(place..place + magic.len()) == Some(magic);
        match numbers.i32(0) {
            540 if is(4, b"n+2\0") || is(4, b"ni2\0") => return Some((Version::Two, endian)),
            348 if is(344, b"n+1\0") || is(344, b"ni1\0") => return Some((Version::One, endian)),
            // No magic: what the numbers say must be one whole.
            348 if start.len() >= 348
                && (1..=7).contains(&numbers.i16(40))
                && type_of(i32::from(numbers.i16(70)))
                    .is_ok_and(|(t, n)| bits(t) * n == i32::from(numbers.i16(72))) =>
            {
                return Some((Version::Analyze, endian));
            }
            _ => {}
        }
    }
    None
}

fn bits(scalar_type: ScalarType) -> i32 {
    8 * i32::try_from(scalar_type.size_bytes()).unwrap_or_default()
}

/// The type of a sample's numbers, and how many there are of them.
///
/// # Errors
/// A type that is not read.
pub(super) fn type_of(datatype: i32) -> Result<(ScalarType, i32), Problem> {
    Ok(match datatype {
        2 => (ScalarType::UInt8, 1),
        4 => (ScalarType::Int16, 1),
        8 => (ScalarType::Int32, 1),
        16 => (ScalarType::Float32, 1),
        64 => (ScalarType::Float64, 1),
        128 => (ScalarType::UInt8, 3),
        256 => (ScalarType::Int8, 1),
        512 => (ScalarType::UInt16, 1),
        768 => (ScalarType::UInt32, 1),
        1024 => (ScalarType::Int64, 1),
        1280 => (ScalarType::UInt64, 1),
        2304 => (ScalarType::UInt8, 4),
        other => {
            let found = match other {
                1 => "single bits".to_owned(),
                32 | 1792 | 2048 => "complex numbers".to_owned(),
                1536 => "floats of 128 bits".to_owned(),
                _ => format!("the data type {other}"),
            };
            return Err(unsupported(
                "samples of whole numbers, floats or colours",
                found,
                "convert the file to one of these (fslmaths IN OUT -odt float)",
            ));
        }
    })
}

impl Header {
    /// # Errors
    /// Sizes that make no volume.
    pub(super) fn parse(start: &[u8], version: Version, endian: Endian) -> Result<Self, Problem> {
        let n = Numbers { bytes: start, endian };
        let is_two = version == Version::Two;
        let dims: [i64; 8] = std::array::from_fn(|i| match is_two {
            true => n.i64(16 + 8 * i),
            false => i64::from(n.i16(40 + 2 * i)),
        });
        let real = |one: usize, two: usize| if is_two { n.f64(two) } else { n.f32(one) };
        let code = |one: usize, two: usize| {
            if is_two { n.i32(two) } else { i32::from(n.i16(one)) }
        };
        let list = |one: usize, two: usize, i: usize| real(one + 4 * i, two + 8 * i);
        let byte = |place: usize| i32::from(start.get(place).copied().unwrap_or_default());
        let offset = if is_two { n.i64(168) as f64 } else { n.f32(108) };
        if !(offset.is_finite() && offset >= 0.0 && offset.fract() == 0.0) {
            return Err(header(
                "an offset of the samples (vox_offset) of whole bytes, 0 or more",
                plain_number(offset),
                "correct the header",
            ));
        }
        let is_analyze = version == Version::Analyze;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked above"
        )]
        let vox_offset = offset as u64;
        Ok(Self {
            is_pair: is_analyze
                || start.get(344..347) == Some(b"ni1") && !is_two
                || start.get(4..7) == Some(b"ni2") && is_two,
            sizes: sizes(&dims)?,
            datatype: if is_two { i32::from(n.i16(12)) } else { i32::from(n.i16(70)) },
            pixdim: std::array::from_fn(|i| list(76, 104, i)),
            vox_offset,
            slope: real(112, 176),
            intercept: if is_analyze { 0.0 } else { real(116, 184) },
            intent: if is_analyze { 0 } else { code(68, 504) },
            units: if is_two { n.i32(500) } else { byte(123) },
            qform_code: if is_analyze { 0 } else { code(252, 344) },
            sform_code: if is_analyze { 0 } else { code(254, 348) },
            quaternion: std::array::from_fn(|i| list(256, 352, i)),
            srow: std::array::from_fn(|row| {
                std::array::from_fn(|column| list(280, 400, 4 * row + column))
            }),
        })
    }
}

fn sizes(dims: &[i64; 8]) -> Result<Vec<u64>, Problem> {
    let count = usize::try_from(dims[0]).ok().filter(|n| (1..=7).contains(n));
    let sizes: Option<Vec<u64>> = count.and_then(|count| {
        dims[1..=count].iter().map(|&n| u64::try_from(n).ok().filter(|&n| n > 0)).collect()
    });
    sizes.ok_or_else(|| {
        header(
            "from 1 to 7 dimensions of at least one sample (dim)",
            format!("{dims:?}"),
            "the file was altered: copy it again",
        )
    })
}

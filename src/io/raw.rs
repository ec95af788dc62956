//! Samples without a header: their layout from flags, from the file's name, and from its length.

use std::io::{Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::bytes::{self, Endian, Progress};
use super::error::{Problem, ReadError, header, quoted, truncated};
use super::{Format, Opened, files};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Grid, Lattice, Samples, ScalarType};

/// Everything that must be known to read samples without a header.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RawLayout {
    /// Samples along x (fastest), y, z.
    pub dims: [usize; 3],
    /// Type of each sample.
    pub scalar_type: ScalarType,
    /// Order of its bytes.
    pub endian: Endian,
    /// Bytes before the first sample.
    pub skip_bytes: u64,
    /// World distance between neighbours along x, y, z.
    pub spacing: DVec3,
}

/// The parts of a [`RawLayout`] that somebody knows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct RawOverrides {
    /// See [`RawLayout::dims`].
    pub dims: Option<[usize; 3]>,
    /// See [`RawLayout::scalar_type`].
    pub scalar_type: Option<ScalarType>,
    /// See [`RawLayout::endian`].
    pub endian: Option<Endian>,
    /// See [`RawLayout::skip_bytes`].
    pub skip_bytes: Option<u64>,
    /// See [`RawLayout::spacing`].
    pub spacing: Option<DVec3>,
}

impl RawOverrides {
    /// These where they are known, else `other`'s.
    pub fn or(self, other: Self) -> Self {
        Self {
            dims: self.dims.or(other.dims),
            scalar_type: self.scalar_type.or(other.scalar_type),
            endian: self.endian.or(other.endian),
            skip_bytes: self.skip_bytes.or(other.skip_bytes),
            spacing: self.spacing.or(other.spacing),
        }
    }
}

impl RawLayout {
    /// Bytes from the file's start to the end of the samples; `None` beyond 64 bits.
    pub fn end_bytes(&self) -> Option<u64> {
        self.slice_bytes()?.checked_mul(self.dims[2] as u64)?.checked_add(self.skip_bytes)
    }

    fn slice_bytes(&self) -> Option<u64> {
        let [x, y, _] = self.dims.map(|n| n as u64);
        memory::checked_product(&[x, y, self.scalar_type.size_bytes() as u64])
    }
}

/// What a file's name and length tell of its layout, e.g. `tooth_103x94x161_uint8_big.raw`.
///
/// The type is taken from the length where the name gives dimensions but no type, and exactly one
/// of uint8, uint16, float32 and float64 fits. What nothing tells is `None`.
pub fn guess(name: &str, len_bytes: u64) -> RawOverrides {
    let name = name.rsplit(['/', '\\']).next().unwrap_or_default().to_lowercase();
    let mut told = RawOverrides::default();
    let words: Vec<&str> =
        name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty()).collect();
    for (at, word) in words.iter().enumerate() {
        if told.dims.is_none() {
            told.dims = dims_in(word);
        }
        // "unsigned_short" and the like come in two words.
        let pair = words.get(at + 1).map(|next| format!("{word}{next}"));
        let named = pair.as_deref().and_then(type_in).or_else(|| type_in(word));
        told.scalar_type = told.scalar_type.or(named);
        told.endian = told.endian.or(match *word {
            "le" | "little" | "littleendian" | "lsb" => Some(Endian::Little),
            "be" | "big" | "bigendian" | "msb" => Some(Endian::Big),
            _ => None,
        });
    }
    if told.scalar_type.is_none() {
        told.scalar_type = told.dims.and_then(|dims| type_by_length(dims, len_bytes));
    }
    told
}

/// Whether a file's name tells a layout that fills its length exactly.
pub fn is_told_exactly(name: &str, len_bytes: u64) -> bool {
    let told = guess(name, len_bytes);
    let (Some(dims), Some(scalar_type)) = (told.dims, told.scalar_type) else { return false };
    let [x, y, z] = dims.map(|n| n as u64);
    memory::checked_product(&[x, y, z, scalar_type.size_bytes() as u64]) == Some(len_bytes)
}

/// `103x94x161`, as a whole word or followed by the type's name.
fn dims_in(word: &str) -> Option<[usize; 3]> {
    let parts: Vec<&str> = word.split('x').collect();
    let [x, y, z] = parts[..] else { return None };
    let number = |text: &str| text.parse().ok().filter(|&n| n > 0);
    Some([number(x)?, number(y)?, number(z)?])
}

fn type_in(word: &str) -> Option<ScalarType> {
    ScalarType::from_name(word).or(match word {
        "uchar" | "unsignedchar" | "byte" | "ubyte" | "u8" | "8bit" => Some(ScalarType::UInt8),
        "schar" | "signedchar" | "i8" | "s8" => Some(ScalarType::Int8),
        "ushort" | "unsignedshort" | "u16" | "16bit" => Some(ScalarType::UInt16),
        "short" | "i16" | "s16" => Some(ScalarType::Int16),
        "uint" | "unsignedint" | "u32" => Some(ScalarType::UInt32),
        "int" | "i32" | "s32" => Some(ScalarType::Int32),
        "u64" => Some(ScalarType::UInt64),
        "i64" | "s64" => Some(ScalarType::Int64),
        "float" | "f32" => Some(ScalarType::Float32),
        "double" | "f64" => Some(ScalarType::Float64),
        _ => None,
    })
}

fn type_by_length(dims: [usize; 3], len_bytes: u64) -> Option<ScalarType> {
    let samples = memory::checked_product(&dims.map(|n| n as u64))?;
    let each = len_bytes.checked_div(samples).filter(|_| len_bytes.is_multiple_of(samples))?;
    match each {
        1 => Some(ScalarType::UInt8),
        2 => Some(ScalarType::UInt16),
        4 => Some(ScalarType::Float32),
        8 => Some(ScalarType::Float64),
        _ => None,
    }
}

/// A complete layout from what is known and what the name and length tell, with what had to be
/// assumed.
fn complete(
    path: &Path,
    len_bytes: u64,
    known: RawOverrides,
) -> Result<(RawLayout, Vec<String>), Problem> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut warnings = Vec::new();
    let told = guess(&name, len_bytes);
    let merged = known.or(told);
    let Some(dims) = merged.dims else {
        return Err(header(
            "the dimensions of samples without a header",
            format!("none in the name {}", quoted(&name)),
            "give --raw-dims X,Y,Z, or name the file like tooth_103x94x161_uint8.raw; if it is a PLOT3D grid \
             it is cut short or damaged: copy it again",
        ));
    };
    let skip_bytes = merged.skip_bytes.unwrap_or(0);
    let by_name = known.scalar_type.or_else(|| guess(&name, 0).scalar_type);
    let scalar_type = by_name.or_else(|| {
        let guessed = type_by_length(dims, len_bytes.saturating_sub(skip_bytes))?;
        warnings.push(format!("the type {} is taken from the file's length", guessed.name()));
        Some(guessed)
    });
    let Some(scalar_type) = scalar_type else {
        return Err(header(
            "the type of samples without a header",
            format!("none in the name {} nor from {len_bytes} bytes", quoted(&name)),
            "give --raw-type (and check --raw-dims and --raw-skip)",
        ));
    };
    let endian = merged.endian.unwrap_or_else(|| {
        if scalar_type.size_bytes() > 1 {
            warnings.push("nothing tells the byte order: little is assumed".into());
        }
        Endian::Little
    });
    let spacing = merged.spacing.unwrap_or(DVec3::ONE);
    Ok((RawLayout { dims, scalar_type, endian, skip_bytes, spacing }, warnings))
}

/// The layout that [`super::open`] would use for a file.
///
/// # Errors
/// Not a file, or nothing tells its dimensions or type.
pub fn layout(path: &Path, known: RawOverrides) -> Result<RawLayout, ReadError> {
    files::open_file(path)
        .and_then(|(_, len)| complete(path, len, known))
        .map(|(layout, _)| layout)
        .map_err(|problem| problem.at(path))
}

pub(super) fn read(
    path: &Path,
    known: &RawOverrides,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Opened, Problem> {
    let (file, len) = files::open_file(path)?;
    if len == 0 {
        return Err(Problem::Empty);
    }
    let (layout, mut warnings) = complete(path, len, *known)?;
    let sizes = layout.dims.map(|n| n as u64);
    require_stored(&layout, len)?;
    let count = bytes::checked_count("the volume", &sizes, layout.scalar_type, free_bytes)?;
    let needed = (count * layout.scalar_type.size_bytes()) as u64;
    let mut reader = files::buffered(file);
    reader.seek(SeekFrom::Start(layout.skip_bytes)).map_err(Problem::Io)?;
    let mut samples = bytes::no_samples(layout.scalar_type);
    bytes::reserve_samples(&mut samples, count)?;
    let mut progress = Progress::new(ticket, needed);
    bytes::append(&mut samples, &mut reader, count, &mut progress)?;
    bytes::to_native(&mut samples, layout.endian);
    let left = len - layout.skip_bytes - needed;
    if left > 0 {
        warnings.push(format!("{left} bytes follow the samples: they are ignored"));
    }
    let field = Field {
        name: stem(path),
        components: 1,
        association: Association::Point,
        samples: Arc::new(samples),
    };
    let lattice = Lattice {
        dims: layout.dims,
        spacing: layout.spacing,
        origin: DVec3::ZERO,
        direction: DMat3::IDENTITY,
    };
    let grid = Grid::of(lattice, vec![field]);
    Ok(Opened::of(grid, Format::Raw, warnings))
}

/// Refuses a layout that goes beyond the end of a file of `len_bytes`. There is no header that could
/// be wrong: what is known came from flags, a dialog or the file's name.
fn require_stored(layout: &RawLayout, len_bytes: u64) -> Result<(), Problem> {
    let [x, y, z] = layout.dims;
    let of = format!("{x} × {y} × {z} samples of {}", layout.scalar_type.name());
    let after = match layout.skip_bytes {
        0 => String::new(),
        skipped => format!(" after {skipped} others"),
    };
    let expected = match layout.end_bytes() {
        Some(end) if end <= len_bytes => return Ok(()),
        Some(end) => format!("{} bytes{after} for {of}", end - layout.skip_bytes),
        None => format!("{of}{after} to be less than 2⁶⁴ bytes"),
    };
    Err(truncated(
        expected,
        format!("a file of {len_bytes} bytes"),
        "check the dimensions, the type and the bytes to skip (--raw-dims, --raw-type, --raw-skip), \
         or copy the file again",
    ))
}

/// The samples of slice `z` alone, for a preview while the layout is being chosen.
///
/// # Errors
/// A slice that the file does not hold, or more than memory holds.
pub fn read_slice(path: &Path, layout: &RawLayout, z: usize) -> Result<Samples, ReadError> {
    slice(path, layout, z).map_err(|problem| problem.at(path))
}

fn slice(path: &Path, layout: &RawLayout, z: usize) -> Result<Samples, Problem> {
    let (file, len) = files::open_file(path)?;
    let sizes = [layout.dims[0] as u64, layout.dims[1] as u64];
    let free_bytes = memory::free_bytes();
    let count = bytes::checked_count("one slice", &sizes, layout.scalar_type, free_bytes)?;
    let needed = (count * layout.scalar_type.size_bytes()) as u64;
    let before = needed.checked_mul(z as u64).and_then(|n| n.checked_add(layout.skip_bytes));
    let before = before.unwrap_or(u64::MAX);
    bytes::require_stored(needed, len.saturating_sub(before))?;
    let mut reader = files::buffered(file);
    reader.seek(SeekFrom::Start(before)).map_err(Problem::Io)?;
    let mut samples = bytes::no_samples(layout.scalar_type);
    let ticket = Ticket::new();
    bytes::append(&mut samples, &mut reader, count, &mut Progress::new(&ticket, needed))?;
    bytes::to_native(&mut samples, layout.endian);
    Ok(samples)
}

/// A field's name for formats that name none: the file's own, without extension.
pub(super) fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    if stem.is_empty() { "values".to_owned() } else { stem }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_dimensions_type_and_byte_order() {
        let told = guess("/data/tooth_103x94x161_uint8.raw", 0);
        assert_eq!(told.dims, Some([103, 94, 161]));
        assert_eq!((told.scalar_type, told.endian), (Some(ScalarType::UInt8), None));
        let told = guess("CT-Head.512x512x99.Unsigned_Short.Big.raw", 0);
        assert_eq!((told.dims, told.endian), (Some([512, 512, 99]), Some(Endian::Big)));
        assert_eq!(told.scalar_type, Some(ScalarType::UInt16));
        assert_eq!(guess("a_4x4_float.raw", 0).dims, None);
        assert_eq!(guess("a_4x4x0.raw", 0).dims, None);
        assert_eq!(guess("a_99999999999999999999x4x4.raw", 0).dims, None);
        assert_eq!(guess("", 5), RawOverrides::default());
    }

    #[test]
    fn the_length_tells_the_type_where_the_name_does_not() {
        let by_length = |len| guess("a_4x4x4.raw", len).scalar_type;
        assert_eq!(by_length(64), Some(ScalarType::UInt8));
        assert_eq!(by_length(256), Some(ScalarType::Float32));
        assert_eq!((by_length(65), by_length(192), by_length(0)), (None, None, None));
    }

    #[test]
    fn what_is_given_wins_over_what_the_name_tells() {
        let known =
            RawOverrides { dims: Some([2, 2, 2]), skip_bytes: Some(5), ..Default::default() };
        let (layout, warnings) = complete(Path::new("a_4x4x4_int16.raw"), 21, known).unwrap();
        assert_eq!((layout.dims, layout.scalar_type), ([2, 2, 2], ScalarType::Int16));
        assert_eq!((layout.end_bytes(), warnings.len()), (Some(21), 1));
    }

    #[test]
    fn a_slice_is_the_volumes_whatever_comes_before_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.raw");
        let values: Vec<u16> = (0..12).map(|i| 300 * i + 7).collect();
        let mut file = vec![0xaa; 3];
        file.extend(values.iter().flat_map(|v| v.to_be_bytes()));
        std::fs::write(&path, &file).unwrap();
        let layout = RawLayout {
            dims: [2, 2, 3],
            scalar_type: ScalarType::UInt16,
            endian: Endian::Big,
            skip_bytes: 3,
            spacing: DVec3::ONE,
        };
        for z in 0..3 {
            let slice = read_slice(&path, &layout, z).unwrap();
            assert_eq!(slice, Samples::UInt16(values[4 * z..4 * z + 4].to_vec()), "slice {z}");
        }
        assert!(read_slice(&path, &layout, 3).is_err());
        let known = RawOverrides {
            dims: Some(layout.dims),
            scalar_type: Some(layout.scalar_type),
            endian: Some(layout.endian),
            skip_bytes: Some(3),
            spacing: None,
        };
        let opened = read(&path, &known, u64::MAX, &Ticket::new()).unwrap();
        assert_eq!(*opened.grid.fields[0].samples, Samples::UInt16(values));
        std::fs::write(&path, &file[..26]).unwrap();
        let short = read(&path, &known, u64::MAX, &Ticket::new());
        assert!(matches!(short, Err(Problem::Truncated { .. })), "one byte is missing");
    }

    #[test]
    fn files_shorter_than_their_layout_are_refused_without_a_word_of_headers() {
        let layout = |dims, skip_bytes| RawLayout {
            dims,
            scalar_type: ScalarType::Int16,
            endian: Endian::Little,
            skip_bytes,
            spacing: DVec3::ONE,
        };
        let refused = |layout, len| {
            let said = require_stored(&layout, len).unwrap_err().to_string();
            assert!(!said.contains("header"), "{said}");
            said
        };
        assert!(require_stored(&layout([2, 3, 4], 5), 53).is_ok());
        let short = refused(layout([2, 3, 4], 5), 52);
        assert!(
            short.contains("48 bytes after 5 others for 2 × 3 × 4 samples of int16"),
            "{short}"
        );
        assert!(short.contains("found a file of 52 bytes; ") && short.contains("--raw-dims"));
        assert!(refused(layout([2, 3, 4], 0), 47).contains("48 bytes for 2 × 3 × 4"));
        assert!(refused(layout([usize::MAX; 3], 0), 47).contains("2⁶⁴"));
        assert!(refused(layout([2, 3, 4], u64::MAX), 47).contains("2⁶⁴"));
    }
}

//! The header of a `.npy` array: a dictionary as Python writes it.

use std::io::Read;

use super::super::bytes::{self, Endian};
use super::super::error::{Problem, header, quoted, truncated, unsupported};
use crate::volume::ScalarType;

pub(super) const MAGIC: &[u8] = b"\x93NUMPY";
/// A longer header is none of numbers.
const MOST_BYTES: usize = 1 << 16;

/// How the numbers of an array are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Numbers(ScalarType),
    /// Floats of 16 bits.
    Halves,
}

impl Kind {
    /// What they are read as: halves by their bits.
    pub(super) fn stored(self) -> ScalarType {
        match self {
            Self::Numbers(scalar_type) => scalar_type,
            Self::Halves => ScalarType::UInt16,
        }
    }
}

/// What a header says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) kind: Kind,
    pub(super) endian: Endian,
    /// The first index is the fastest.
    pub(super) fortran: bool,
    /// As NumPy has it: the last index is the fastest, unless `fortran`.
    pub(super) shape: Vec<u64>,
}

impl Header {
    /// Reads up to the first number.
    ///
    /// # Errors
    /// No array of numbers.
    pub(super) fn read(reader: &mut dyn Read) -> Result<Self, Problem> {
        let cut = || {
            truncated(
                "a NumPy header",
                "that it ends within",
                "the file was cut short: copy it again",
            )
        };
        let mut start = [0; 12];
        let known = 8;
        let mut fill = |bytes: &mut [u8]| -> Result<(), Problem> {
            let wanted = bytes.len();
            match bytes::read_full(reader, bytes).map_err(Problem::Io)? {
                read if read == wanted => Ok(()),
                _ => Err(cut()),
            }
        };
        fill(&mut start[..known])?;
        if !start.starts_with(MAGIC) {
            return Err(header("a NumPy array", "other bytes", "copy the file again"));
        }
        let len = match start[6] {
            1 => {
                fill(&mut start[8..10])?;
                usize::from(u16::from_le_bytes([start[8], start[9]]))
            }
            2 | 3 => {
                fill(&mut start[8..12])?;
                let len = u32::from_le_bytes([start[8], start[9], start[10], start[11]]);
                usize::try_from(len).unwrap_or(usize::MAX)
            }
            version => {
                return Err(unsupported(
                    "a NumPy array of version 1, 2 or 3",
                    format!("version {version}"),
                    "save it again with numpy.save",
                ));
            }
        };
        if len > MOST_BYTES {
            return Err(header(
                format!("a NumPy header of at most {MOST_BYTES} bytes"),
                format!("{len}"),
                "the file was altered: copy it again",
            ));
        }
        let mut text = vec![0; len];
        fill(&mut text)?;
        Self::parse(&String::from_utf8_lossy(&text))
    }

    fn parse(text: &str) -> Result<Self, Problem> {
        let wrong = |key: &str| {
            header(
                format!("a NumPy header with the key {key}"),
                quoted(text),
                "save the array again with numpy.save",
            )
        };
        let value = |key: &str| {
            let (_, rest) = text.split_once(&format!("'{key}'"))?;
            Some(rest.trim_start().strip_prefix(':')?.trim_start())
        };
        let descr = value("descr").ok_or_else(|| wrong("descr"))?;
        let descr = match descr.strip_prefix('\'').and_then(|rest| rest.split_once('\'')) {
            Some((descr, _)) => descr,
            None => {
                return Err(unsupported(
                    "an array of numbers",
                    "records of several (a structured array)",
                    "save one of its fields (a['name'])",
                ));
            }
        };
        let (kind, endian) = kind(descr)?;
        let order = value("fortran_order").ok_or_else(|| wrong("fortran_order"))?;
        let fortran = match (order.starts_with("True"), order.starts_with("False")) {
            (true, _) => true,
            (_, true) => false,
            _ => return Err(wrong("fortran_order")),
        };
        let shape = value("shape").and_then(|rest| rest.strip_prefix('(')?.split_once(')'));
        let (shape, _) = shape.ok_or_else(|| wrong("shape"))?;
        let words = shape.split(',').map(str::trim).filter(|word| !word.is_empty());
        // Python 2 wrote whole numbers with an L.
        let numbers = words.map(|word| word.trim_end_matches('L').parse().ok());
        let shape: Option<Vec<u64>> = numbers.collect();
        Ok(Self { kind, endian, fortran, shape: shape.ok_or_else(|| wrong("shape"))? })
    }
}

fn kind(descr: &str) -> Result<(Kind, Endian), Problem> {
    let endian = match descr.as_bytes().first() {
        Some(b'>') => Endian::Big,
        Some(b'=') => Endian::NATIVE,
        _ => Endian::Little,
    };
    let kind = match descr.trim_start_matches(['<', '>', '|', '=']) {
        "b1" | "?" | "u1" => Kind::Numbers(ScalarType::UInt8),
        "i1" => Kind::Numbers(ScalarType::Int8),
        "u2" => Kind::Numbers(ScalarType::UInt16),
        "i2" => Kind::Numbers(ScalarType::Int16),
        "u4" => Kind::Numbers(ScalarType::UInt32),
        "i4" => Kind::Numbers(ScalarType::Int32),
        "u8" => Kind::Numbers(ScalarType::UInt64),
        "i8" => Kind::Numbers(ScalarType::Int64),
        "f2" => Kind::Halves,
        "f4" => Kind::Numbers(ScalarType::Float32),
        "f8" => Kind::Numbers(ScalarType::Float64),
        other => {
            let found = match other.chars().next() {
                Some('c') => "complex numbers".to_owned(),
                Some('O') => "Python objects, which are never unpacked".to_owned(),
                Some('S' | 'U' | 'a') => "text".to_owned(),
                Some('M' | 'm') => "times".to_owned(),
                _ => format!("the type {}", quoted(descr)),
            };
            return Err(unsupported(
                "an array of whole numbers or floats",
                found,
                "save what is to be seen as such an array (numpy.abs(a), a.astype(\"f4\"))",
            ));
        }
    };
    Ok((kind, endian))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_any_python_are_understood() {
        let parse = |text: &str| Header::parse(text);
        let plain = parse("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, 4), }  \n");
        let expected = Header {
            kind: Kind::Numbers(ScalarType::Float64),
            endian: Endian::Little,
            fortran: false,
            shape: vec![2, 3, 4],
        };
        assert_eq!(plain.unwrap(), expected);
        let old = parse("{'descr': '>u2', 'fortran_order': True, 'shape': (2L,)}").unwrap();
        assert_eq!((old.endian, old.fortran, old.shape), (Endian::Big, true, vec![2]));
        for bad in [
            "{'descr': '|O', 'fortran_order': False, 'shape': (2,)}",
            "{'descr': '<c16', 'fortran_order': False, 'shape': (2,)}",
            "{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (2,)}",
            "{'descr': '<f4', 'fortran_order': Maybe, 'shape': (2,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-2, 3)}",
            "{'descr': '<f4', 'fortran_order': False}",
            "",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}

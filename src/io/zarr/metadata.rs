//! What Zarr's metadata say of an array, in versions 2 and 3.

use std::path::Path;

use serde_json::Value;

use super::super::bytes::Endian;
use super::super::error::{Problem, header, quoted, unsupported};
use super::codecs::Codec;
use crate::volume::ScalarType;

/// Metadata beyond this are none.
const MOST_BYTES: u64 = 16 << 20;

/// An array: its numbers, and how its chunks are named and packed.
#[derive(Debug, Clone)]
pub(super) struct Array {
    /// The slowest axis first.
    pub(super) shape: Vec<u64>,
    /// Of the stored objects: chunks, or shards of them.
    pub(super) chunks: Vec<u64>,
    pub(super) scalar_type: ScalarType,
    /// Floats of 16 bits, whose bits are read as numbers.
    pub(super) halves: bool,
    pub(super) fill: f64,
    pub(super) packing: Packing,
    pub(super) names: Naming,
    pub(super) dimensions: Vec<String>,
}

/// How a chunk is packed.
#[derive(Debug, Clone)]
pub(super) struct Packing {
    pub(super) endian: Endian,
    /// The first axis is the fastest.
    pub(super) fortran: bool,
    /// From the numbers' bytes on.
    pub(super) codecs: Vec<Codec>,
    /// Chunks within each stored object.
    pub(super) shard: Option<Box<Shard>>,
}

/// Chunks that lie in one object together, and their index.
#[derive(Debug, Clone)]
pub(super) struct Shard {
    pub(super) chunks: Vec<u64>,
    pub(super) packing: Packing,
    /// Bytes behind the index's own: of its checksum.
    pub(super) index_checksum: bool,
    pub(super) index_at_start: bool,
}

/// What the stored objects are called.
#[derive(Debug, Clone)]
pub(super) struct Naming {
    pub(super) separator: char,
    /// A folder `c` in front.
    pub(super) has_prefix: bool,
}

impl Naming {
    pub(super) fn key(&self, place: &[u64]) -> String {
        let words: Vec<String> = place.iter().map(u64::to_string).collect();
        let joined = words.join(&self.separator.to_string());
        match (self.has_prefix, joined.is_empty()) {
            (true, true) => "c".to_owned(),
            (true, false) => format!("c{}{joined}", self.separator),
            (false, true) => "0".to_owned(),
            (false, false) => joined,
        }
    }
}

/// A file of JSON; `None` where there is none.
///
/// # Errors
/// One that is no JSON.
pub(super) fn json(path: &Path) -> Result<Option<Value>, Problem> {
    use std::io::Read;
    let Ok(file) = std::fs::File::open(path) else { return Ok(None) };
    let mut text = Vec::new();
    file.take(MOST_BYTES).read_to_end(&mut text).map_err(Problem::Io)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    serde_json::from_slice(&text).map(Some).map_err(|error| {
        header(
            format!("JSON in {name}"),
            quoted(&error.to_string()),
            "the folder was altered: copy it again",
        )
    })
}

/// The attributes of a folder's group or array.
pub(super) fn attributes(folder: &Path) -> Result<Value, Problem> {
    if let Some(found) = json(&folder.join("zarr.json"))? {
        return Ok(found["attributes"].clone());
    }
    Ok(json(&folder.join(".zattrs"))?.unwrap_or(Value::Null))
}

/// The array in a folder; `None` where it is none.
///
/// # Errors
/// An array that is not read.
pub(super) fn array(folder: &Path) -> Result<Option<Array>, Problem> {
    if let Some(found) = json(&folder.join("zarr.json"))? {
        return match found["node_type"].as_str() {
            Some("array") => of_version_3(&found).map(Some),
            _ => Ok(None),
        };
    }
    match json(&folder.join(".zarray"))? {
        Some(found) => {
            let names = json(&folder.join(".zattrs"))?.unwrap_or(Value::Null);
            let mut array = of_version_2(&found)?;
            array.dimensions = words(&names["_ARRAY_DIMENSIONS"]);
            Ok(Some(array))
        }
        None => Ok(None),
    }
}

fn words(list: &Value) -> Vec<String> {
    let list = list.as_array().into_iter().flatten();
    list.map(|word| word.as_str().unwrap_or_default().to_owned()).collect()
}

fn wrong(what: &str, found: &Value) -> Problem {
    header(
        format!("{what} in the metadata of a Zarr array"),
        quoted(&found.to_string()),
        "write the array again",
    )
}

fn sizes(list: &Value, what: &str) -> Result<Vec<u64>, Problem> {
    let read = |list: &Vec<Value>| -> Option<Vec<u64>> {
        list.iter().map(|n| n.as_u64().filter(|n| *n > 0 && *n < 1 << 48)).collect()
    };
    list.as_array().and_then(read).ok_or_else(|| wrong(what, list))
}

fn shape_and_chunks(shape: &Value, chunks: &Value) -> Result<(Vec<u64>, Vec<u64>), Problem> {
    let (shape, chunks) = (sizes(shape, "a shape")?, sizes(chunks, "sizes of chunks")?);
    if shape.len() != chunks.len() || shape.is_empty() || shape.len() > 8 {
        return Err(header(
            "as many sizes of chunks as of the array, from 1 to 8",
            format!("{chunks:?} for {shape:?}"),
            "write the array again",
        ));
    }
    Ok((shape, chunks))
}

/// A number to fill what is not stored with; 0 where none is told.
///
/// # Errors
/// What is no number.
fn fill(value: &Value) -> Result<f64, Problem> {
    match value {
        Value::String(word) if word == "NaN" => Ok(f64::NAN),
        Value::String(word) if word == "Infinity" => Ok(f64::INFINITY),
        Value::String(word) if word == "-Infinity" => Ok(f64::NEG_INFINITY),
        Value::Bool(is_true) => Ok(f64::from(u8::from(*is_true))),
        Value::Null => Ok(0.0),
        other => other.as_f64().ok_or_else(|| wrong("a number for fill_value", other)),
    }
}

/// A type by its word in version 3, and whether it is of halves.
fn type_of(word: &str) -> Result<(ScalarType, bool), Problem> {
    Ok(match word {
        "bool" => (ScalarType::UInt8, false),
        "float16" => (ScalarType::UInt16, true),
        _ => (
            ScalarType::from_name(word).ok_or_else(|| {
                unsupported(
                    "an array of whole numbers or floats",
                    format!("the type {}", quoted(word)),
                    "write it as one of these",
                )
            })?,
            false,
        ),
    })
}

fn of_version_2(found: &Value) -> Result<Array, Problem> {
    let (shape, chunks) = shape_and_chunks(&found["shape"], &found["chunks"])?;
    let dtype = found["dtype"].as_str().ok_or_else(|| {
        unsupported("an array of numbers", "records of several", "write one of their fields")
    })?;
    let endian = if dtype.starts_with('>') { Endian::Big } else { Endian::Little };
    let word = match dtype.trim_start_matches(['<', '>', '|']) {
        "b1" => "bool",
        "u1" => "uint8",
        "i1" => "int8",
        "u2" => "uint16",
        "i2" => "int16",
        "u4" => "uint32",
        "i4" => "int32",
        "u8" => "uint64",
        "i8" => "int64",
        "f2" => "float16",
        "f4" => "float32",
        "f8" => "float64",
        _ => dtype,
    };
    let (scalar_type, halves) = type_of(word)?;
    if found["filters"].as_array().is_some_and(|filters| !filters.is_empty()) {
        return Err(unsupported(
            "an array without filters",
            quoted(&found["filters"].to_string()),
            "write it without them",
        ));
    }
    let codecs = match &found["compressor"] {
        Value::Null => Vec::new(),
        compressor => vec![Codec::of(compressor["id"].as_str().unwrap_or_default())?],
    };
    let separator = found["dimension_separator"].as_str().and_then(|s| s.chars().next());
    Ok(Array {
        shape,
        chunks,
        scalar_type,
        halves,
        fill: fill(&found["fill_value"])?,
        packing: Packing { endian, fortran: found["order"] == "F", codecs, shard: None },
        names: Naming { separator: separator.unwrap_or('.'), has_prefix: false },
        dimensions: Vec::new(),
    })
}

fn of_version_3(found: &Value) -> Result<Array, Problem> {
    let grid = &found["chunk_grid"];
    if grid["name"] != "regular" {
        return Err(unsupported(
            "a regular grid of chunks",
            quoted(&grid.to_string()),
            "write it so",
        ));
    }
    let (shape, chunks) = shape_and_chunks(&found["shape"], &grid["configuration"]["chunk_shape"])?;
    let word =
        found["data_type"].as_str().ok_or_else(|| wrong("a data type", &found["data_type"]))?;
    let (scalar_type, halves) = type_of(word)?;
    let encoding = &found["chunk_key_encoding"];
    let is_default = encoding["name"] != "v2";
    let separator = encoding["configuration"]["separator"].as_str().and_then(|s| s.chars().next());
    Ok(Array {
        fill: fill(&found["fill_value"])?,
        packing: packing(&found["codecs"], chunks.len())?,
        names: Naming {
            separator: separator.unwrap_or(if is_default { '/' } else { '.' }),
            has_prefix: is_default,
        },
        dimensions: words(&found["dimension_names"]),
        shape,
        chunks,
        scalar_type,
        halves,
    })
}

fn packing(list: &Value, axes: usize) -> Result<Packing, Problem> {
    let mut packing =
        Packing { endian: Endian::Little, fortran: false, codecs: Vec::new(), shard: None };
    for codec in list.as_array().into_iter().flatten() {
        let configuration = &codec["configuration"];
        match codec["name"].as_str().unwrap_or_default() {
            "bytes" | "endian" => {
                if configuration["endian"] == "big" {
                    packing.endian = Endian::Big;
                }
            }
            "transpose" => {
                let order = configuration["order"].as_array().cloned().unwrap_or_default();
                let is = |wanted: &mut dyn Iterator<Item = usize>| {
                    order.iter().map(Value::as_u64).eq(wanted.map(|n| Some(n as u64)))
                };
                if is(&mut (0..axes).rev()) || configuration["order"] == "F" {
                    packing.fortran = true;
                } else if !is(&mut (0..axes)) {
                    return Err(unsupported(
                        "axes as they are or all turned round",
                        quoted(&configuration["order"].to_string()),
                        "write the array so",
                    ));
                }
            }
            "sharding_indexed" => {
                let chunks = sizes(&configuration["chunk_shape"], "sizes of chunks in shards")?;
                if chunks.len() != axes {
                    return Err(wrong(
                        "as many sizes of chunks as axes",
                        &configuration["chunk_shape"],
                    ));
                }
                let index = configuration["index_codecs"].as_array().cloned().unwrap_or_default();
                packing.shard = Some(Box::new(Shard {
                    chunks,
                    packing: self::packing(&configuration["codecs"], axes)?,
                    index_checksum: index.iter().any(|codec| codec["name"] == "crc32c"),
                    index_at_start: configuration["index_location"] == "start",
                }));
            }
            name => packing.codecs.push(Codec::of(name)?),
        }
    }
    Ok(packing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn both_versions_say_the_same_of_an_array() {
        let two = of_version_2(&json!({
            "shape": [3, 4], "chunks": [2, 2], "dtype": ">u2", "order": "F", "fill_value": 7,
            "compressor": {"id": "zlib", "level": 1}, "filters": null, "dimension_separator": "/"
        }))
        .unwrap();
        assert_eq!((two.shape.as_slice(), two.scalar_type), (&[3, 4][..], ScalarType::UInt16));
        assert_eq!((two.packing.endian, two.packing.fortran, two.fill), (Endian::Big, true, 7.0));
        assert_eq!(two.names.key(&[1, 0]), "1/0");
        let three = of_version_3(&json!({
            "shape": [3, 4], "data_type": "uint16", "fill_value": "NaN",
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [2, 2]}},
            "chunk_key_encoding": {"name": "default"},
            "codecs": [{"name": "transpose", "configuration": {"order": [1, 0]}},
                {"name": "bytes", "configuration": {"endian": "big"}}, {"name": "gzip"}]
        }))
        .unwrap();
        assert!(
            three.packing.fortran && three.packing.endian == Endian::Big && three.fill.is_nan()
        );
        assert_eq!(three.names.key(&[1, 0]), "c/1/0");
    }

    #[test]
    fn metadata_that_make_no_array_are_refused() {
        let right = json!({"shape": [3, 4], "chunks": [2, 2], "dtype": "<f4", "compressor": null});
        assert!(of_version_2(&right).is_ok());
        for (key, value) in [
            ("shape", json!([3, 0])),
            ("shape", json!([3])),
            ("chunks", json!([2, -2])),
            ("dtype", json!("<c8")),
            ("dtype", json!([["a", "<f4"]])),
            ("compressor", json!({"id": "snappy"})),
            ("filters", json!([{"id": "delta"}])),
        ] {
            let mut wrong = right.clone();
            wrong[key] = value;
            assert!(of_version_2(&wrong).is_err(), "{wrong}");
        }
    }
}

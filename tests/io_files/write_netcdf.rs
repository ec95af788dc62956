//! Small valid files of NetCDF's classic formats, written plainly and apart from the reader.

use std::path::{Path, PathBuf};

use crate::write::save;

/// An attribute's value.
#[derive(Debug, Clone)]
pub(crate) enum Attribute {
    Text(&'static str),
    Short(i16),
    Double(f64),
}

/// Numbers in one of the format's types.
#[derive(Debug, Clone)]
pub(crate) enum Values {
    Short(Vec<i16>),
    Float(Vec<f32>),
    Double(Vec<f64>),
    Text(&'static str),
}

impl Values {
    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Short(values) => values.iter().flat_map(|v| v.to_be_bytes()).collect(),
            Self::Float(values) => values.iter().flat_map(|v| v.to_be_bytes()).collect(),
            Self::Double(values) => values.iter().flat_map(|v| v.to_be_bytes()).collect(),
            Self::Text(text) => text.as_bytes().to_vec(),
        }
    }

    fn code(&self) -> u32 {
        match self {
            Self::Short(_) => 3,
            Self::Float(_) => 5,
            Self::Double(_) => 6,
            Self::Text(_) => 2,
        }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Variable {
    pub(crate) name: &'static str,
    /// Numbers of dimensions, the slowest first.
    pub(crate) dims: Vec<usize>,
    pub(crate) attributes: Vec<(&'static str, Attribute)>,
    pub(crate) values: Values,
}

/// A variable without attributes.
pub(crate) fn plain(name: &'static str, dims: &[usize], values: Values) -> Variable {
    Variable { name, dims: dims.to_vec(), attributes: Vec::new(), values }
}

fn padded(bytes: &[u8]) -> Vec<u8> {
    let mut padded = bytes.to_vec();
    padded.resize(bytes.len().div_ceil(4) * 4, 0);
    padded
}

fn number(n: usize) -> [u8; 4] {
    u32::try_from(n).expect("small files have small numbers").to_be_bytes()
}

fn text(name: &str) -> Vec<u8> {
    [&number(name.len())[..], &padded(name.as_bytes())].concat()
}

/// Version 1 or 2, whose places in the file have 4 or 8 bytes.
pub(crate) fn netcdf(
    folder: &Path,
    version: u8,
    dims: &[(&str, usize)],
    variables: &[Variable],
) -> PathBuf {
    let header = |starts: &[usize]| {
        let mut bytes = [b"CDF", &[version][..], &number(0)].concat();
        bytes.extend([number(10), number(dims.len())].concat());
        for (name, size) in dims {
            bytes.extend([text(name), number(*size).to_vec()].concat());
        }
        bytes.extend([0; 8]);
        bytes.extend([number(11), number(variables.len())].concat());
        for (variable, start) in variables.iter().zip(starts) {
            bytes.extend(text(variable.name));
            bytes.extend(number(variable.dims.len()));
            variable.dims.iter().for_each(|dim| bytes.extend(number(*dim)));
            let has = !variable.attributes.is_empty();
            bytes.extend(number(if has { 12 } else { 0 }));
            bytes.extend(number(variable.attributes.len()));
            for (name, value) in &variable.attributes {
                bytes.extend(text(name));
                let (code, count, value) = match value {
                    Attribute::Text(text) => (2, text.len(), text.as_bytes().to_vec()),
                    Attribute::Short(value) => (3, 1, value.to_be_bytes().to_vec()),
                    Attribute::Double(value) => (6, 1, value.to_be_bytes().to_vec()),
                };
                bytes.extend([&number(code)[..], &number(count), &padded(&value)].concat());
            }
            bytes.extend(variable.values.code().to_be_bytes());
            bytes.extend(number(padded(&variable.values.bytes()).len()));
            if version == 1 {
                bytes.extend(number(*start));
            } else {
                bytes.extend((*start as u64).to_be_bytes());
            }
        }
        bytes
    };
    let mut start = header(&vec![0; variables.len()]).len();
    let mut starts = Vec::new();
    let mut data = Vec::new();
    for variable in variables {
        starts.push(start);
        let bytes = padded(&variable.values.bytes());
        start += bytes.len();
        data.extend(bytes);
    }
    save(folder.join("v.nc"), &[&header(&starts), &data])
}

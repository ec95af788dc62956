//! NetCDF of the classic formats (CDF-1, -2 and -5) and of version 4, which is HDF5: every variable on the file's main grid is a field for
//! each entry of its further dimensions, and winds along x and y become vectors. Meshes of Exodus II are read, too.

mod exodus;
mod places;

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use netcdf_reader::{
    NcFile, NcFormat, NcOpenOptions, NcSliceInfo, NcSliceInfoElem, NcType, NcVariable,
};

use self::places::Axis;
use super::bytes;
use super::error::{Problem, corrupt, quoted, quoted_bytes, truncated, unsupported};
use super::{Format, Opened, files};
use crate::core::memory;
use crate::core::panics::caught;
use crate::core::parallel;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Grid, Samples, ScalarType, Shape};

/// More fields than this in one file are no list that anybody picks from.
const MOST_FIELDS: usize = 4096;
/// Names of the components of winds and currents along x, y and up.
const VECTORS: [[&str; 3]; 8] = [
    ["u", "v", "w"],
    ["ua", "va", "wa"],
    ["uo", "vo", "wo"],
    ["uwnd", "vwnd", "wwnd"],
    ["u10", "v10", "w10"],
    ["u100", "v100", "w100"],
    ["water_u", "water_v", "water_w"],
    ["vx", "vy", "vz"],
];

/// Whether a file's first bytes are NetCDF's.
///
/// # Errors
/// A version that is not read.
pub(super) fn format_of(start: &[u8]) -> Result<Option<Format>, Problem> {
    match start {
        [b'C', b'D', b'F', 1 | 2 | 5, ..] => Ok(Some(Format::NetCdf)),
        [b'C', b'D', b'F', version @ 0..16, ..] => Err(unsupported(
            "NetCDF of version 1, 2 or 5",
            format!("version {version}"),
            "convert it to one of these (nccopy -k cdf5 IN OUT)",
        )),
        _ => Ok(None),
    }
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let (file, len) = load(path, free_bytes, ticket)?;
    let is_packed =
        !matches!(file.format(), NcFormat::Classic | NcFormat::Offset64 | NcFormat::Cdf5);
    let most_bytes = if is_packed { len.saturating_mul(bytes::DEFLATE_MOST) } else { len };
    if exodus::is_it(&file) {
        return exodus::read(&file, most_bytes, free_bytes, ticket);
    }
    let variables = file.variables().map_err(damaged)?;
    let mut warnings = Vec::new();
    let main = main_variables(&file, variables, &mut warnings)?;
    let first = main[0];
    let spatial = space_of(&file, first);
    let names = &first.dimensions[first.ndim() - spatial..];
    // The last dimension is the fastest.
    let axes: Vec<Axis> = names.iter().rev().map(|d| Axis::of(&file, &d.name, d.size)).collect();
    let mut dims = [1; 3];
    for (dim, axis) in dims.iter_mut().zip(&axes) {
        *dim = usize::try_from(axis.size).unwrap_or(usize::MAX);
    }
    let total = checked_sizes(&main, dims, (len, most_bytes), free_bytes)?;
    let lists = places::lists(&axes, &mut warnings);

    let mut fields = Vec::new();
    let mut done = 0;
    for variable in &main {
        read_variable(&file, variable, spatial, &mut fields, |more| {
            done += more;
            ticket.checkpoint(done, total)
        })?;
    }
    let vectors = vectors(&main, &fields, &mut warnings);
    fields.extend(vectors);
    let grid = Grid::shaped(dims, Shape::Rectilinear(lists), fields)?;
    let grid = Grid { unit: places::unit(&axes), ..grid };
    Ok(Opened::of(grid, Format::NetCdf, warnings))
}

fn panicked(words: &str) -> Problem {
    corrupt("a NetCDF file that is whole", quoted(words), "copy the file again")
}

fn damaged(error: netcdf_reader::Error) -> Problem {
    corrupt("a NetCDF file that is whole", quoted(&error.to_string()), "copy the file again")
}

/// All of the file, which the reader copies once, and its length.
fn load(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<(NcFile, u64), Problem> {
    const PIECE: u64 = 1 << 20;
    let (mut file, len) = files::open_file(path)?;
    memory::require("the file", len.saturating_mul(2), free_bytes)?;
    let mut content = Vec::new();
    loop {
        ticket.checkpoint(0, 1)?;
        if (&mut file).take(PIECE).read_to_end(&mut content).map_err(Problem::Io)? == 0 {
            break;
        }
    }
    // Of version 4: no chunk can hold more than its packed bytes.
    let most = len.saturating_mul(bytes::DEFLATE_MOST).min(free_bytes);
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let options =
        NcOpenOptions { max_chunk_bytes: most, max_read_bytes: most, ..NcOpenOptions::default() };
    let read = caught(|| NcFile::from_bytes_with_options(&content, options))
        .map_err(|words| panicked(&words))?;
    let file = read.map_err(|error| {
        let text = error.to_string();
        if let Some(declared) = bytes_of_records(&text) {
            return cut_short(format!("{declared} bytes of records behind its header"), len);
        }
        if matches!(error, netcdf_reader::Error::UnexpectedEof { .. }) {
            return cut_short("a NetCDF header that is whole".to_owned(), len);
        }
        let start = quoted_bytes(&content[..content.len().min(16)]);
        corrupt(
            "a NetCDF header",
            format!("{start} and {}", quoted(&text)),
            "the file was cut short or altered: copy it again",
        )
    })?;
    Ok((file, len))
}

fn cut_short(expected: String, len: u64) -> Problem {
    truncated(
        expected,
        format!("a file of {len} bytes"),
        "the file was cut short, or its header was altered: copy it again",
    )
}

/// How many bytes of records a header declares that the file has not, as the reader says it.
fn bytes_of_records(text: &str) -> Option<u64> {
    let (_, rest) = text.split_once(" records (")?;
    let (bytes, rest) = rest.split_once(" bytes) but the file has only")?;
    rest.contains("bytes").then_some(())?;
    bytes.parse().ok()
}

fn scalar_type(variable: &NcVariable) -> Option<ScalarType> {
    Some(match variable.dtype {
        NcType::Byte => ScalarType::Int8,
        NcType::UByte => ScalarType::UInt8,
        NcType::Short => ScalarType::Int16,
        NcType::UShort => ScalarType::UInt16,
        NcType::Int => ScalarType::Int32,
        NcType::UInt => ScalarType::UInt32,
        NcType::Int64 => ScalarType::Int64,
        NcType::UInt64 => ScalarType::UInt64,
        NcType::Float => ScalarType::Float32,
        NcType::Double => ScalarType::Float64,
        _ => return None,
    })
}

/// How many of a variable's last dimensions are space: up to three, none of them a time or a list.
fn space_of(file: &NcFile, variable: &NcVariable) -> usize {
    let last = variable.dimensions.iter().rev().take(3);
    last.take_while(|dimension| !places::is_list(file, &dimension.name)).count()
}

fn space_names<'a>(file: &NcFile, variable: &'a NcVariable) -> Vec<&'a str> {
    let from = variable.ndim() - space_of(file, variable);
    variable.dimensions[from..].iter().map(|dimension| dimension.name.as_str()).collect()
}

/// The variables on the grid that most numbers are on.
fn main_variables<'a>(
    file: &NcFile,
    variables: &'a [NcVariable],
    warnings: &mut Vec<String>,
) -> Result<Vec<&'a NcVariable>, Problem> {
    let mut by_grid: BTreeMap<Vec<&str>, Vec<&NcVariable>> = BTreeMap::new();
    for variable in variables {
        let is_data = scalar_type(variable).is_some() && variable.shape().iter().all(|&n| n > 0);
        if is_data && space_of(file, variable) >= 2 {
            by_grid.entry(space_names(file, variable)).or_default().push(variable);
        }
    }
    let points = |variable: &NcVariable| {
        let from = variable.ndim() - space_of(file, variable);
        let sizes = variable.shape();
        memory::checked_product(&sizes[from..]).unwrap_or(u64::MAX)
    };
    // Three dimensions before two, then more points.
    let best = by_grid.iter().max_by_key(|(names, held)| (names.len(), points(held[0])));
    let Some((best, main)) = best else {
        return Err(unsupported(
            "a variable of numbers on a grid of two or three dimensions",
            "none",
            "extract or convert what is to be seen first",
        ));
    };
    let others: Vec<&str> = by_grid
        .iter()
        .filter(|(names, _)| *names != best)
        .flat_map(|(_, held)| held.iter().map(|variable| variable.name()))
        .collect();
    if !others.is_empty() {
        warnings.push(format!(
            "the variables on other grids than ({}) are ignored: {}",
            best.join(", "),
            others.join(", ")
        ));
    }
    Ok(main.clone())
}

/// Numbers of all fields, which the file, of so many bytes and at most so many unpacked, holds and memory can.
fn checked_sizes(
    main: &[&NcVariable],
    dims: [usize; 3],
    (file_bytes, most_bytes): (u64, u64),
    free_bytes: u64,
) -> Result<u64, Problem> {
    let (mut total, mut needed, mut fields) = (0_u64, file_bytes, 0_u64);
    for variable in main {
        let what = format!("the variable {}", quoted(variable.name()));
        let Some(stored) = scalar_type(variable) else { continue };
        let count = bytes::checked_count(&what, &variable.shape(), stored, u64::MAX)? as u64;
        bytes::require_stored(count * stored.size_bytes() as u64, most_bytes)?;
        total += count;
        // Once more for vectors, which are made of pairs.
        let kept = kept_type(variable).size_bytes() as u64;
        needed = needed.saturating_add(count.saturating_mul(kept + 6));
        fields += count / dims.iter().product::<usize>().max(1) as u64;
    }
    if fields > MOST_FIELDS as u64 {
        return Err(unsupported(
            format!("at most {MOST_FIELDS} volumes in one file"),
            fields.to_string(),
            "extract some of them first (ncks -d time,0,9 IN OUT)",
        ));
    }
    // A part of it, with 64 bits and with what says which are there.
    let one = 16 * (dims.iter().product::<usize>() as u64).div_ceil(PARTS);
    memory::require("the variables of the file", needed.saturating_add(one), free_bytes)?;
    Ok(total)
}

/// The type that a variable's values are kept in: 32-bit floats where these hold its digits.
fn kept_type(variable: &NcVariable) -> ScalarType {
    match variable.dtype {
        NcType::Byte | NcType::UByte | NcType::Short | NcType::UShort | NcType::Float => {
            ScalarType::Float32
        }
        _ => ScalarType::Float64,
    }
}

/// A field for each entry of the dimensions before space, unpacked (`scale_factor`, `add_offset`) and with
/// NaN for what is missing.
fn read_variable(
    file: &NcFile,
    variable: &NcVariable,
    spatial: usize,
    fields: &mut Vec<Field>,
    mut advance: impl FnMut(u64) -> Result<(), crate::core::Cancelled>,
) -> Result<(), Problem> {
    let further = &variable.dimensions[..variable.ndim() - spatial];
    let entries: u64 = further.iter().map(|dimension| dimension.size).product();
    let axes: Vec<Axis> = further.iter().map(|d| Axis::of(file, &d.name, d.size)).collect();
    for entry in 0..entries {
        let mut at = vec![0; further.len()];
        let mut left = entry;
        for (index, dimension) in at.iter_mut().zip(further).rev() {
            *index = left % dimension.size;
            left /= dimension.size;
        }
        let samples = entry_of(file, variable, &at, &mut advance)?;
        let told: Vec<String> = axes
            .iter()
            .zip(&at)
            .map(|(axis, &index)| format!("{}={}", axis.name, axis.value(index)))
            .collect();
        let suffix = if told.is_empty() { String::new() } else { format!("[{}]", told.join(",")) };
        fields.push(Field {
            name: format!("{}{suffix}", variable.name()),
            components: 1,
            association: Association::Point,
            samples: Arc::new(samples),
        });
    }
    Ok(())
}

/// Parts along its first axis in which an entry of a variable is read: its numbers come with 64 bits each.
const PARTS: u64 = 4;

/// The volume, or the plane, at so many indices of a variable.
fn entry_of(
    file: &NcFile,
    variable: &NcVariable,
    at: &[u64],
    mut advance: impl FnMut(u64) -> Result<(), crate::core::Cancelled>,
) -> Result<Samples, Problem> {
    let dimensions = &variable.dimensions[at.len()..];
    let Some(first) = dimensions.first() else {
        return Err(corrupt("a variable with an axis", "none", "choose another file"));
    };
    let count = dimensions.iter().map(|dimension| dimension.size).product::<u64>();
    let kept = kept_type(variable);
    let mut samples = bytes::no_samples(kept);
    bytes::reserve_samples(&mut samples, usize::try_from(count).unwrap_or(usize::MAX))?;
    let step = first.size.div_ceil(PARTS).max(1);
    for start in (0..first.size).step_by(usize::try_from(step).unwrap_or(usize::MAX)) {
        let mut selections: Vec<NcSliceInfoElem> =
            at.iter().map(|&index| NcSliceInfoElem::Index(index)).collect();
        let end = (start + step).min(first.size);
        selections.push(NcSliceInfoElem::Slice { start, end, step: 1 });
        let all = NcSliceInfoElem::Slice { start: 0, end: u64::MAX, step: 1 };
        selections.resize(variable.ndim(), all);
        let slice = NcSliceInfo { selections };
        let values = caught(|| file.read_variable_slice_unpacked_masked(variable.name(), &slice))
            .map_err(|words| panicked(&words))?
            .map_err(damaged)?;
        let (values, _offset) = values.into_raw_vec_and_offset();
        advance(values.len() as u64)?;
        #[expect(clippy::cast_possible_truncation, reason = "the file has 24 bits at most")]
        match &mut samples {
            Samples::Float32(kept) => kept.extend(values.into_iter().map(|v| v as f32)),
            Samples::Float64(kept) => kept.extend(values),
            _ => {}
        }
    }
    Ok(samples)
}

/// Winds along x and y, and up where that is told in the same units, as fields of vectors.
fn vectors(main: &[&NcVariable], fields: &[Field], warnings: &mut Vec<String>) -> Vec<Field> {
    let named = |name: &str| main.iter().find(|v| v.name().eq_ignore_ascii_case(name));
    let units = |variable: &NcVariable| {
        variable.attribute("units").and_then(|units| units.value.as_string())
    };
    let mut found = Vec::new();
    for [x, y, z] in VECTORS {
        let (Some(x), Some(y)) = (named(x), named(y)) else { continue };
        let upward = named(z).filter(|z| units(z) == units(x));
        let parts: Vec<&str> =
            [Some(x), Some(y), upward].into_iter().flatten().map(|v| v.name()).collect();
        let name = format!("({})", parts.join(", "));
        let before = found.len();
        for field in fields {
            let Some(suffix) = field.name.strip_prefix(parts[0]) else { continue };
            let part = |part: &str| fields.iter().find(|f| f.name == format!("{part}{suffix}"));
            if !(suffix.is_empty() || suffix.starts_with('[')) {
                continue;
            }
            let all: Option<Vec<&Field>> = parts.iter().map(|name| part(name)).collect();
            let Some(all) = all else { continue };
            found.push(Field {
                name: format!("{name}{suffix}"),
                components: 3,
                association: Association::Point,
                samples: Arc::new(interleaved(&all)),
            });
        }
        if found.len() > before {
            let rest = if parts.len() == 2 { ", with 0 upward" } else { "" };
            warnings.push(format!("{} are combined to the vectors {name}{rest}", parts.join(", ")));
        }
    }
    found
}

fn interleaved(parts: &[&Field]) -> Samples {
    let count = parts[0].samples.len();
    #[expect(clippy::cast_possible_truncation, reason = "directions need no more digits")]
    let value =
        |index: usize| parts.get(index % 3).map_or(0.0, |part| part.samples.get(index / 3) as f32);
    Samples::Float32(parallel::list(3 * count, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_records_are_told_where_the_reader_counts_them() {
        let text = "invalid data: classic header declares 1 records (704396 bytes) but the file has only 300000 bytes";
        assert_eq!(bytes_of_records(text), Some(704_396));
        assert_eq!(bytes_of_records("invalid data: no records (none)"), None);
    }
}

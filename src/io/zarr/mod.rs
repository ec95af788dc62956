//! Zarr folders of versions 2 and 3, and OME-Zarr: of a pyramid, the finest level that memory has room for.

mod chunks;
mod codecs;
mod metadata;

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use serde_json::Value;

use self::chunks::read_part;
use self::metadata::{Array, array, attributes};
use super::axes::{self, Axes, Role};
use super::bytes;
use super::error::{Problem, quoted, truncated, unsupported};
use super::scale::converted;
use super::{Format, Opened};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Field, Grid, Lattice, ScalarType, length_unit};

/// Files that a folder of Zarr has one of.
const MARKS: [&str; 4] = ["zarr.json", ".zarray", ".zgroup", ".zattrs"];
/// Volumes are there several times while they are drawn: as large a part of free memory one may be.
const SHARE: u64 = 6;
/// More arrays in a group are no list that anybody picks from.
const MOST_ARRAYS: usize = 4096;

/// The folder of Zarr that a path is, or whose metadata it is.
pub(super) fn folder_of(path: &Path) -> Option<PathBuf> {
    if path.is_dir() {
        let is_one = MARKS.iter().any(|mark| path.join(mark).is_file());
        return is_one.then(|| path.to_owned());
    }
    let is_mark = MARKS.iter().any(|mark| path.file_name().is_some_and(|name| name == *mark));
    match path.parent() {
        Some(parent) if is_mark && parent == Path::new("") => Some(PathBuf::from(".")),
        Some(parent) if is_mark => Some(parent.to_owned()),
        _ => None,
    }
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let folder = folder_of(path).unwrap_or_else(|| path.to_owned());
    let mut warnings = Vec::new();
    let grid = match scales(&folder)? {
        Some(scales) => of_scales(&scales, free_bytes, ticket, &mut warnings)?,
        None => of_arrays(&folder, free_bytes, ticket, &mut warnings)?,
    };
    Ok(Opened::of(grid, Format::Zarr, warnings))
}

/// OME's pyramid: what it says, and where.
struct Scales {
    folder: PathBuf,
    told: Value,
    /// Names of channels.
    channels: Vec<String>,
}

/// The pyramid of a folder, or of the first picture in it.
fn scales(folder: &Path) -> Result<Option<Scales>, Problem> {
    for folder in [folder.to_owned(), folder.join("0")] {
        let told = attributes(&folder)?;
        let told = if told["ome"].is_object() { told["ome"].clone() } else { told };
        let scales = &told["multiscales"][0];
        if scales["datasets"].is_array() {
            let channels = told["omero"]["channels"].as_array().into_iter().flatten();
            let label = |channel: &Value| channel["label"].as_str().unwrap_or_default().to_owned();
            return Ok(Some(Scales {
                folder,
                told: scales.clone(),
                channels: channels.map(label).collect(),
            }));
        }
        if array(&folder).is_ok_and(|array| array.is_some()) {
            break;
        }
    }
    Ok(None)
}

/// One axis of an array.
#[derive(Clone)]
struct Axis {
    role: Role,
    unit: Option<String>,
    is_time: bool,
}

impl Axis {
    fn named(name: &str) -> Self {
        let role = if matches!(name, "t" | "c") { Role::List } else { Role::Domain };
        Self { role, unit: None, is_time: name == "t" }
    }

    /// The axes that a pyramid tells, or those of old ones.
    fn of_scales(told: &Value, count: usize) -> Vec<Self> {
        let list = told["axes"].as_array().cloned().unwrap_or_default();
        let axes: Vec<Self> = list
            .iter()
            .map(|axis| match axis.as_str() {
                Some(name) => Self::named(name),
                None => {
                    let kind = axis["type"].as_str().unwrap_or_default();
                    let named = Self::named(axis["name"].as_str().unwrap_or_default());
                    let role = match kind {
                        "space" => Role::Domain,
                        "" => named.role,
                        _ => Role::List,
                    };
                    let unit = axis["unit"].as_str().and_then(length_unit);
                    Self { role, unit, is_time: kind == "time" || named.is_time }
                }
            })
            .collect();
        let is_right = axes.len() == count
            && (1..=3).contains(&axes.iter().filter(|a| a.role == Role::Domain).count());
        if is_right { axes } else { Self::of_count(count) }
    }

    /// Time, channel and space, as far as there are axes.
    fn of_count(count: usize) -> Vec<Self> {
        let names = ["t", "c", "z", "y", "x"];
        let missing = count.saturating_sub(names.len());
        let more = std::iter::repeat_n("c", missing);
        more.chain(names[names.len().saturating_sub(count)..].iter().copied())
            .map(Self::named)
            .collect()
    }
}

/// The product of the scales and the sum of the shifts that are told of an axis, the outer ones last.
fn placed(transformations: [&Value; 2], axis: usize) -> (f64, f64) {
    let (mut scale, mut shift) = (1.0, 0.0);
    for list in transformations {
        for step in list.as_array().into_iter().flatten() {
            if let Some(factor) = step["scale"][axis].as_f64() {
                scale *= factor;
                shift *= factor;
            }
            shift += step["translation"][axis].as_f64().unwrap_or(0.0);
        }
    }
    (scale, shift)
}

/// What of an array is read.
struct Part {
    folder: PathBuf,
    array: Array,
    axes: Vec<Axis>,
    /// As many entries of each axis.
    sizes: Vec<u64>,
}

impl Part {
    fn bytes(&self) -> u64 {
        let count = memory::checked_product(&self.sizes).unwrap_or(u64::MAX);
        count.saturating_mul(self.array.scalar_type.size_bytes() as u64)
    }

    /// Only the first entry of what is not space.
    fn of_first_entry(mut self) -> Self {
        for (size, axis) in self.sizes.iter_mut().zip(&self.axes) {
            if axis.role == Role::List {
                *size = 1;
            }
        }
        self
    }
}

fn of_scales(
    scales: &Scales,
    free_bytes: u64,
    ticket: &Ticket,
    warnings: &mut Vec<String>,
) -> Result<Grid, Problem> {
    let datasets = scales.told["datasets"].as_array().cloned().unwrap_or_default();
    let mut levels = Vec::new();
    for dataset in &datasets {
        let name = dataset["path"].as_str().unwrap_or_default();
        let folder = scales.folder.join(name);
        // What lies outside the folder is not of it.
        let is_inside = !name.is_empty() && !name.contains("..") && !name.starts_with('/');
        let found = if is_inside { array(&folder)? } else { None };
        let Some(array) = found else {
            return Err(truncated(
                format!("the array {} of the pyramid", quoted(name)),
                "none",
                "the folder was not copied whole: copy it again",
            ));
        };
        let axes = Axis::of_scales(&scales.told, array.shape.len());
        let sizes = array.shape.clone();
        levels.push((Part { folder, array, axes, sizes }, dataset.clone()));
    }
    let most = free_bytes / SHARE;
    let whole = levels.iter().position(|(part, _)| part.bytes() <= most);
    let count = levels.len();
    let (level, is_first_alone) = match whole {
        Some(level) => (level, false),
        None => (count.saturating_sub(1), true),
    };
    if count == 0 {
        return Err(unsupported(
            "a pyramid of at least one level",
            "none",
            "write the folder again",
        ));
    }
    let (mut part, dataset) = levels.swap_remove(level);
    if is_first_alone {
        part = part.of_first_entry();
        warnings
            .push("memory has no room for all channels and times: the first is shown alone".into());
    }
    if level > 0 {
        let size: Vec<String> = part.array.shape.iter().rev().take(3).map(u64::to_string).collect();
        warnings.push(format!(
            "level {} of {count} is shown, of {}: finer ones do not fit into memory",
            level + 1,
            size.join(" × ")
        ));
    }
    let place = |axis: usize| {
        let outer = &scales.told["coordinateTransformations"];
        placed([&dataset["coordinateTransformations"], outer], axis)
    };
    let name = scales.told["name"].as_str().filter(|name| !name.is_empty() && *name != "/");
    let name = name.map_or_else(|| stem(&scales.folder), str::to_owned);
    let mut grid = grid_of(&part, &name, place, free_bytes, ticket, warnings)?;
    if scales.channels.len() == grid.fields.len() && scales.channels.iter().all(|c| !c.is_empty()) {
        for (field, channel) in grid.fields.iter_mut().zip(&scales.channels) {
            field.name.clone_from(channel);
        }
    }
    Ok(grid)
}

fn stem(folder: &Path) -> String {
    super::raw::stem(folder)
}

/// An array with its place in the world; `place` tells scale and shift of an axis of the file's.
fn grid_of(
    part: &Part,
    name: &str,
    place: impl Fn(usize) -> (f64, f64),
    free_bytes: u64,
    ticket: &Ticket,
    warnings: &mut Vec<String>,
) -> Result<Grid, Problem> {
    let axes = file_axes(part)?;
    let fields = fields_of(part, &axes, name, free_bytes, ticket)?;
    warnings.extend(axes::several(&fields, "in channels or times"));
    let dims = axes.dims();
    let mut lattice =
        Lattice { dims, spacing: DVec3::ONE, origin: DVec3::ZERO, direction: DMat3::IDENTITY };
    // The last axis of space is x.
    let space: Vec<usize> =
        (0..part.axes.len()).rev().filter(|&axis| part.axes[axis].role == Role::Domain).collect();
    for (to, &axis) in space.iter().enumerate() {
        let (scale, shift) = place(axis);
        if scale.is_finite() && scale != 0.0 && shift.is_finite() {
            lattice.spacing[to] = scale;
            lattice.origin[to] = shift;
        }
    }
    let unit = space.first().and_then(|&axis| part.axes[axis].unit.clone());
    let unit =
        unit.filter(|unit| space.iter().all(|&axis| part.axes[axis].unit.as_ref() == Some(unit)));
    Ok(Grid { unit, ..Grid::of(lattice, fields) })
}

/// The part's axes with the fastest first.
fn file_axes(part: &Part) -> Result<Axes, Problem> {
    let sizes = part.sizes.iter().rev().map(|&n| usize::try_from(n));
    let sizes = sizes.collect::<Result<Vec<usize>, _>>().map_err(|_too_many| {
        unsupported(
            "sizes that this machine can count",
            format!("{:?}", part.sizes),
            "crop the array",
        )
    })?;
    let roles = part.axes.iter().rev().map(|axis| axis.role).collect();
    Ok(Axes { sizes, roles, backwards: false })
}

fn fields_of(
    part: &Part,
    axes: &Axes,
    name: &str,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Vec<Field>, Problem> {
    let times = if axes.copies() || part.array.halves { 2 } else { 1 };
    let needed = part.bytes();
    bytes::checked_count("the array", &part.sizes, part.array.scalar_type, free_bytes)?;
    memory::require("the array and its copy by channel", needed.saturating_mul(times), free_bytes)?;
    let mut samples = read_part(part, ticket)?;
    if part.array.halves {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bits of 16")]
        let value = |bits: f64| f64::from(half::f16::from_bits(bits as u16));
        samples = converted(&samples, ScalarType::Float32, value)?;
    }
    axes.fields(name, samples, ticket)
}

/// The array in a folder, or those of one shape in a group.
fn of_arrays(
    folder: &Path,
    free_bytes: u64,
    ticket: &Ticket,
    warnings: &mut Vec<String>,
) -> Result<Grid, Problem> {
    if let Some(array) = array(folder)? {
        let part = plain_part(folder.to_owned(), array)?;
        return grid_of(&part, &stem(folder), |_| (1.0, 0.0), free_bytes, ticket, warnings);
    }
    let mut names: Vec<PathBuf> = std::fs::read_dir(folder)
        .map_err(Problem::from_opening)?
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .filter(|path| path.is_dir())
        .take(MOST_ARRAYS)
        .collect();
    names.sort();
    let mut parts = Vec::new();
    let mut others = Vec::new();
    for path in names {
        match array(&path)
            .and_then(|found| found.map(|array| plain_part(path.clone(), array)).transpose())
        {
            Ok(Some(part)) => parts.push(part),
            Ok(None) => {}
            Err(_) => others.push(stem(&path)),
        }
    }
    let points = |part: &Part| memory::checked_product(&part.sizes).unwrap_or(u64::MAX);
    let Some(shape) = parts.iter().max_by_key(|part| points(part)).map(|part| part.sizes.clone())
    else {
        return Err(unsupported(
            "a Zarr folder with an array of two dimensions or more",
            "none",
            "choose the folder of an array in it",
        ));
    };
    let (main, left): (Vec<Part>, Vec<Part>) =
        parts.into_iter().partition(|part| part.sizes == shape);
    others.extend(left.iter().map(|part| stem(&part.folder)));
    if !others.is_empty() {
        warnings.push(format!(
            "the arrays of other shapes or types are ignored: {}",
            others.join(", ")
        ));
    }
    let all = main.iter().map(Part::bytes).fold(0, u64::saturating_add);
    memory::require("the arrays of the folder", all, free_bytes)?;
    let mut fields = Vec::new();
    let mut dims = [1; 3];
    for part in &main {
        let axes = file_axes(part)?;
        dims = axes.dims();
        fields.extend(fields_of(part, &axes, &stem(&part.folder), free_bytes, ticket)?);
    }
    warnings.extend(axes::several(&fields, "in the folder"));
    Ok(Grid::of(Lattice::unit(dims), fields))
}

fn plain_part(folder: PathBuf, array: Array) -> Result<Part, Problem> {
    if array.shape.len() < 2 {
        return Err(unsupported(
            "an array of two dimensions or more",
            "one",
            "choose another array",
        ));
    }
    let is_list = |name: &String| matches!(name.as_str(), "t" | "c" | "time" | "channel");
    let count = array.shape.len();
    let named = array.dimensions.len() == count
        && (1..=3).contains(&array.dimensions.iter().filter(|name| !is_list(name)).count());
    let axes = (0..count).map(|axis| {
        let is_list = if named { is_list(&array.dimensions[axis]) } else { axis + 3 < count };
        Axis { role: if is_list { Role::List } else { Role::Domain }, unit: None, is_time: false }
    });
    Ok(Part { sizes: array.shape.clone(), axes: axes.collect(), folder, array })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_and_shifts_of_a_pyramid_follow_one_another() {
        let inner = serde_json::json!([
            {"type": "scale", "scale": [1.0, 2.0]}, {"type": "translation", "translation": [0.0, 3.0]}
        ]);
        let outer = serde_json::json!([{"type": "scale", "scale": [1.0, 10.0]}]);
        assert_eq!(placed([&inner, &outer], 1), (20.0, 30.0));
        assert_eq!(placed([&Value::Null, &Value::Null], 1), (1.0, 0.0));
    }

    #[test]
    fn axes_without_names_are_those_of_microscopes() {
        let roles = |count| Axis::of_count(count).iter().map(|a| a.role).collect::<Vec<_>>();
        assert_eq!(roles(3), [Role::Domain; 3]);
        assert_eq!(roles(5)[..2], [Role::List; 2]);
        assert_eq!(roles(7).len(), 7);
    }
}

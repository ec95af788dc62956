//! What is in an opened file, for people and for scripts.

use std::fmt;
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::cells_info::CellsInfo;
use super::error::{Problem, plain};
use super::unstructured;
use super::{Facts, Opened, Series};
use crate::cells::{Cells, Listing};
use crate::core::memory;
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::core::{Srgb8, counted, plain_number};
use crate::rbf::few_digits;
use crate::volume::{Field, Grid, LabelName, ScalarType, Shape, Statistics};

/// The answer to `voxsplat info`; its JSON form keeps these names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Info {
    /// See [`super::Format::name`].
    pub format: String,
    /// `grid` for evenly spaced points, `rectilinear`, `curvilinear` or `unstructured`.
    pub kind: String,
    /// Points along x, y, z; 1 along axes that the file lacks. `unstructured` grids have none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dims: Option<[usize; 3]>,
    /// World distance between neighbours along each axis; 1 along axes that the file lacks. Of a `grid`
    /// alone, like the next two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<[f64; 3]>,
    /// World position of the first point, in the file's own numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<[f64; 3]>,
    /// World direction of x, then of y, then of z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 9]>,
    /// Coordinates along x, y, z; of `rectilinear` grids alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coordinates: Option<[CoordinateInfo; 3]>,
    /// Least and greatest x, then y, then z of the points; of `curvilinear` and `unstructured` grids alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[f64; 6]>,
    /// How many points there are; of `curvilinear` and `unstructured` grids alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
    /// Cells; of `curvilinear` and `unstructured` grids alone, and not where points are all that these have.
    #[serde(flatten)]
    pub cells: Option<CellsInfo>,
    /// The file's name for its space, where it has one.
    pub space: Option<String>,
    /// What lengths are given in, where the file says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// The active field first.
    pub fields: Vec<FieldInfo>,
    /// What values stand for, where the file says.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<LabelInfo>,
    /// What was ignored, assumed or repaired while reading.
    pub warnings: Vec<String>,
    /// The series that lie at its place, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub series: Vec<Series>,
    /// Of basis functions: how many, and how far they are from their source.
    #[serde(flatten)]
    pub encoding: Option<Facts>,
}

/// The coordinates of a rectilinear grid along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CoordinateInfo {
    /// Of the first points.
    pub first: f64,
    /// Of the last points.
    pub last: f64,
    /// Least difference of neighbours; null for one point.
    pub min_step: Option<f64>,
    /// Greatest difference of neighbours; null for one point.
    pub max_step: Option<f64>,
}

impl CoordinateInfo {
    fn of(list: &[f64]) -> Self {
        let steps = || list.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        Self {
            first: list.first().copied().unwrap_or(f64::NAN),
            last: list.last().copied().unwrap_or(f64::NAN),
            min_step: steps().reduce(f64::min),
            max_step: steps().reduce(f64::max),
        }
    }
}

/// What a value of the active field stands for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LabelInfo {
    /// Of which number of a sample.
    pub component: usize,
    /// The value.
    pub value: i64,
    /// What has it.
    pub name: String,
    /// Red, green and blue, 0 to 255, where the file gives it a colour.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color: Option<[u8; 3]>,
}

impl LabelInfo {
    fn of(name: &LabelName) -> Self {
        let LabelName { component, value, name, colour } = name.clone();
        Self { component, value, name, color: colour.map(|Srgb8(colour)| colour) }
    }
}

/// One field of an [`Info`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldInfo {
    /// The file's name for it, or the file's own name.
    pub name: String,
    /// Numbers a sample.
    pub components: usize,
    /// Whether these are taken for a vector: three that are not bytes.
    pub is_vectors: bool,
    /// As stored, in NumPy's words.
    pub scalar_type: String,
    /// `point` or `cell`.
    pub association: String,
    /// Least finite stored value of any component; null where none is finite.
    pub min: Option<f64>,
    /// Greatest finite stored value of any component; null where none is finite.
    pub max: Option<f64>,
    /// Mean of the finite stored values, each of which counts once, however much space its point or cell has; null where none
    /// is finite.
    pub mean: Option<f64>,
    /// Stored values that are NaN.
    pub nan_count: u64,
    /// Stored values that are infinite.
    pub infinite_count: u64,
    /// Greatest finite length of a sample of several components; of such fields alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnitude_max: Option<f64>,
}

/// Greatest finite length of a field's samples; `None` for scalars and where none is finite.
fn magnitude_max(field: &Field) -> Option<f64> {
    if field.components < 2 {
        return None;
    }
    let (samples, n) = (&field.samples, field.components);
    let length = |i: usize| {
        let squares = (0..n).map(|c| samples.get(n * i + c).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let greatest = |a: f64, b: f64| if b.is_finite() { a.max(b) } else { a };
    let most = parallel::merged(samples.len() / n, || f64::NEG_INFINITY, length, greatest);
    most.is_finite().then_some(most)
}

/// Looks at every sample once.
///
/// # Errors
/// [`Cancelled`].
pub fn describe(opened: &Opened, ticket: &Ticket) -> Result<Info, Cancelled> {
    let info = describe_grid(&opened.grid, opened.format.name(), &opened.warnings, ticket)?;
    Ok(Info { series: opened.series.clone(), encoding: opened.encoding.clone(), ..info })
}

/// The same for a grid from elsewhere, such as a demo.
///
/// # Errors
/// [`Cancelled`].
pub fn describe_grid(
    grid: &Grid,
    format: &str,
    warnings: &[String],
    ticket: &Ticket,
) -> Result<Info, Cancelled> {
    let lattice = &grid.lattice;
    let fields = grid.fields.iter().map(|field| {
        let statistics = Statistics::of(&field.samples, ticket)?;
        let finite = |value: f64| (statistics.finite_count > 0).then_some(value);
        Ok(FieldInfo {
            name: field.name.clone(),
            components: field.components,
            is_vectors: field.is_vectors(),
            scalar_type: field.samples.scalar_type().name().to_owned(),
            association: field.association.name().to_owned(),
            min: finite(statistics.min),
            max: finite(statistics.max),
            mean: finite(statistics.mean),
            nan_count: statistics.nan_count,
            infinite_count: statistics.infinite_count,
            magnitude_max: magnitude_max(field),
        })
    });
    let is_even = matches!(grid.shape, Shape::Affine);
    let coordinates = match &grid.shape {
        Shape::Rectilinear(lists) => Some(lists.each_ref().map(|list| CoordinateInfo::of(list))),
        _ => None,
    };
    let unstructured = match &grid.shape {
        Shape::Unstructured(cells) => Some(cells),
        _ => None,
    };
    let mut warnings = warnings.to_vec();
    let cells = cells_of(grid, &mut warnings, ticket)?;
    Ok(Info {
        format: format.to_owned(),
        kind: grid.shape.name().to_owned(),
        dims: unstructured.is_none().then_some(lattice.dims),
        spacing: is_even.then(|| lattice.spacing.to_array()),
        origin: is_even.then(|| lattice.origin.to_array()),
        direction: is_even.then(|| lattice.direction.to_cols_array()),
        coordinates,
        bounds: bounds(&grid.shape),
        points: match &grid.shape {
            Shape::Curvilinear(points) => Some(points.len()),
            _ => unstructured.map(|cells| cells.own_points()),
        },
        cells,
        space: grid.space.clone(),
        unit: grid.unit.clone(),
        fields: fields.collect::<Result<_, _>>()?,
        labels: grid.label_names.iter().map(LabelInfo::of).collect(),
        warnings,
        series: Vec::new(),
        encoding: None,
    })
}

/// What is told of a grid's cells, where it has any that lie anywhere; of those that no memory holds, why not.
fn cells_of(
    grid: &Grid,
    warnings: &mut Vec<String>,
    ticket: &Ticket,
) -> Result<Option<CellsInfo>, Cancelled> {
    let cells = match &grid.shape {
        Shape::Unstructured(cells) if !grid.are_points_alone() => Some(Arc::clone(cells)),
        Shape::Curvilinear(points) => match block_of(points, grid.lattice.dims) {
            Ok(cells) => Some(Arc::new(cells)),
            Err(why) => {
                warnings.push(format!("its cells are not counted: {why}"));
                None
            }
        },
        _ => None,
    };
    cells.map(|cells| CellsInfo::of(&cells, ticket)).transpose()
}

/// The cells between the points of a curvilinear grid.
fn block_of(points: &Arc<[DVec3]>, dims: [usize; 3]) -> Result<Cells, Problem> {
    let cells = dims.map(|n| n.saturating_sub(1).max(1)).iter().product::<usize>() as u64;
    unstructured::require_memory(points.len() as u64, cells, 8 * cells, memory::free_bytes())?;
    if dims.iter().all(|n| *n > 1) {
        return Ok(Cells::of_grid_measured(points, dims));
    }
    let mut listing = Listing { points: points.to_vec(), ..Listing::default() };
    unstructured::add_block(&mut listing, dims);
    Cells::new(listing).map_err(unstructured::no_cells)
}

/// Least and greatest x, y, z of points that lie anywhere.
fn bounds(shape: &Shape) -> Option<[f64; 6]> {
    let points = match shape {
        Shape::Curvilinear(points) => &points[..],
        Shape::Unstructured(cells) => &cells.points()[..cells.own_points()],
        _ => return None,
    };
    let points = || points.iter().filter(|point| point.is_finite());
    let low = points().fold(DVec3::INFINITY, |low, point| low.min(*point));
    let high = points().fold(DVec3::NEG_INFINITY, |high, point| high.max(*point));
    Some([low.x, high.x, low.y, high.y, low.z, high.z])
}

/// A number of single precision with the digits that it has. The JSON has those of its double.
fn single(value: f64) -> String {
    #[expect(clippy::cast_possible_truncation, reason = "it has no more digits")]
    let value = value as f32;
    plain_number(value)
}

/// A number of a file's geometry without what arithmetic added to it: twelve digits. The JSON has all of them.
fn without_rounding(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let triple = |v: [f64; 3]| v.map(|v| plain_number(without_rounding(v))).join(" ");
        writeln!(f, "{:<11}{}, {}", "format", self.format, self.kind)?;
        if let Some([x, y, z]) = self.dims {
            writeln!(f, "{:<11}{x} × {y} × {z}", "dims")?;
        }
        if let Some(points) = self.points {
            writeln!(f, "{:<11}{points}", "points")?;
        }
        if let Some(cells) = &self.cells {
            write!(f, "{cells}")?;
        }
        if let Some(spacing) = self.spacing {
            writeln!(f, "{:<11}{}", "spacing", triple(spacing))?;
        }
        if let Some(origin) = self.origin {
            writeln!(f, "{:<11}{}", "origin", triple(origin))?;
        }
        let names = ["x", "y", "z"];
        for (axis, column) in names.into_iter().zip(self.direction.iter().flat_map(|d| d.chunks(3)))
        {
            writeln!(f, "{axis:<11}{}", triple([column[0], column[1], column[2]]))?;
        }
        for (axis, list) in names.into_iter().zip(self.coordinates.iter().flatten()) {
            let number = plain_number;
            write!(f, "{axis:<11}{} to {}", number(list.first), number(list.last))?;
            match (list.min_step, list.max_step) {
                (Some(min), Some(max)) => {
                    writeln!(f, ", steps of {} to {}", number(min), number(max))?;
                }
                _ => writeln!(f)?,
            }
        }
        for (axis, ends) in names.into_iter().zip(self.bounds.iter().flat_map(|b| b.chunks(2))) {
            let [low, high] = [ends[0], ends[1]].map(|v| plain_number(without_rounding(v)));
            writeln!(f, "{axis:<11}{low} to {high}")?;
        }
        writeln!(f, "{:<11}{}", "space", self.space.as_deref().unwrap_or("not stated"))?;
        if let Some(unit) = &self.unit {
            writeln!(f, "{:<11}{unit}", "unit")?;
        }
        if let Some(encoding) = &self.encoding {
            let number = few_digits;
            writeln!(
                f,
                "{:<11}{} ({}) of {}: greatest error {}, mean {}",
                "encoding",
                counted(encoding.functions, "function"),
                encoding.basis,
                encoding.source,
                number(encoding.max_error),
                number(encoding.mean_error),
            )?;
            let favoured = encoding.favoured_max_error.zip(encoding.favoured_mean_error);
            if let Some((greatest, mean)) = favoured {
                let [greatest, mean] = [greatest, mean].map(number);
                let which = encoding.favour.map_or(String::new(), |favour| format!("{favour}: "));
                writeln!(f, "{:<11}{which}greatest error {greatest}, mean {mean}", "favoured")?;
            }
        }
        for field in &self.fields {
            let is_single = field.scalar_type == ScalarType::Float32.name();
            let one = |v| if is_single { single(v) } else { plain_number(v) };
            let number = |v: Option<f64>| v.map_or("none".to_owned(), one);
            let length = match field.magnitude_max {
                Some(length) => format!(", length up to {}", one(length)),
                None => String::new(),
            };
            // Where points and cells have more space or less, a mean by volume is another one.
            let over = match (self.kind.as_str(), &self.cells) {
                ("grid", _) | ("unstructured", None) => String::new(),
                _ => format!(" over {}s", field.association),
            };
            writeln!(
                f,
                "{:<11}{}: {} × {} per {}, {} to {}, mean {}{over}{length}",
                if field.is_vectors { "vectors" } else { "field" },
                plain(&field.name),
                field.components,
                field.scalar_type,
                field.association,
                number(field.min),
                number(field.max),
                number(field.mean),
            )?;
            if field.nan_count + field.infinite_count > 0 {
                writeln!(
                    f,
                    "{:<11}{} NaN, {} infinite",
                    "", field.nan_count, field.infinite_count
                )?;
            }
        }
        for LabelInfo { value, name, .. } in &self.labels {
            writeln!(f, "{:<11}{value} is {name}", "label")?;
        }
        self.warnings.iter().try_for_each(|warning| writeln!(f, "{:<11}{warning}", "note"))
    }
}

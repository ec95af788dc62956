//! What is in an opened file, for people and for scripts.

use std::fmt;

use serde::Serialize;

use super::Opened;
use crate::core::progress::{Cancelled, Ticket};
use crate::volume::{Grid, Statistics};

/// The answer to `voxsplat info`; its JSON form keeps these names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Info {
    /// See [`super::Format::name`].
    pub format: String,
    /// Always `grid` so far.
    pub kind: String,
    /// Points along x, y, z; 1 along axes that the file lacks.
    pub dims: [usize; 3],
    /// World distance between neighbours along each axis; 1 along axes that the file lacks.
    pub spacing: [f64; 3],
    /// World position of the first point, in the file's own numbers.
    pub origin: [f64; 3],
    /// World direction of x, then of y, then of z.
    pub direction: [f64; 9],
    /// The file's name for its space, where it has one.
    pub space: Option<String>,
    /// The active field first.
    pub fields: Vec<FieldInfo>,
    /// What was ignored, assumed or repaired while reading.
    pub warnings: Vec<String>,
}

/// One field of an [`Info`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldInfo {
    /// The file's name for it, or the file's own name.
    pub name: String,
    /// Numbers a sample.
    pub components: usize,
    /// As stored, in NumPy's words.
    pub scalar_type: String,
    /// `point` or `cell`.
    pub association: String,
    /// Least finite stored value of any component; null where none is finite.
    pub min: Option<f64>,
    /// Greatest finite stored value of any component; null where none is finite.
    pub max: Option<f64>,
    /// Mean of the finite stored values; null where none is finite.
    pub mean: Option<f64>,
    /// Stored values that are NaN.
    pub nan_count: u64,
    /// Stored values that are infinite.
    pub infinite_count: u64,
}

/// Looks at every sample once.
///
/// # Errors
/// [`Cancelled`].
pub fn describe(opened: &Opened, ticket: &Ticket) -> Result<Info, Cancelled> {
    describe_grid(&opened.grid, opened.format.name(), &opened.warnings, ticket)
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
            scalar_type: field.samples.scalar_type().name().to_owned(),
            association: field.association.name().to_owned(),
            min: finite(statistics.min),
            max: finite(statistics.max),
            mean: finite(statistics.mean),
            nan_count: statistics.nan_count,
            infinite_count: statistics.infinite_count,
        })
    });
    Ok(Info {
        format: format.to_owned(),
        kind: "grid".to_owned(),
        dims: lattice.dims,
        spacing: lattice.spacing.to_array(),
        origin: lattice.origin.to_array(),
        direction: lattice.direction.to_cols_array(),
        space: grid.space.clone(),
        fields: fields.collect::<Result<_, _>>()?,
        warnings: warnings.to_vec(),
    })
}

/// A number in full, or by its power of ten where that would be a row of zeros.
fn plain_or_power(value: f64) -> String {
    let is_plain = value == 0.0 || (1e-6..1e16).contains(&value.abs());
    if is_plain { value.to_string() } else { format!("{value:e}") }
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let triple = |v: [f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
        let [x, y, z] = self.dims;
        writeln!(f, "{:<11}{}, {}", "format", self.format, self.kind)?;
        writeln!(f, "{:<11}{x} × {y} × {z}", "dims")?;
        writeln!(f, "{:<11}{}", "spacing", triple(self.spacing))?;
        writeln!(f, "{:<11}{}", "origin", triple(self.origin))?;
        for (axis, column) in ["x", "y", "z"].into_iter().zip(self.direction.chunks_exact(3)) {
            writeln!(f, "{axis:<11}{}", triple([column[0], column[1], column[2]]))?;
        }
        writeln!(f, "{:<11}{}", "space", self.space.as_deref().unwrap_or("not told"))?;
        for field in &self.fields {
            let number = |v: Option<f64>| v.map_or("none".to_owned(), plain_or_power);
            writeln!(
                f,
                "{:<11}{}: {} × {} per {}, {} to {}, mean {}",
                "field",
                field.name,
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
        self.warnings.iter().try_for_each(|warning| writeln!(f, "{:<11}{warning}", "note"))
    }
}

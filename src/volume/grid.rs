//! Grids with one or more fields on them, and the scalar of one that is drawn.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::derived::derive;
use super::resample::Spaced;
use super::shape::Shape;
use super::{Bricks, Samples, ScalarType, Scattered, Statistics, VolumeError};
use crate::cells::{CellField, Cells};
use crate::core::parallel;
use crate::core::progress::Ticket;
use crate::core::{Srgb8, memory};
use crate::rbf::Encoding;

/// What a field's samples sit on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Association {
    /// The lattice points.
    Point,
    /// The cells between them: one fewer along each axis (at least one).
    Cell,
}

impl Association {
    /// VTK's word for it, lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Cell => "cell",
        }
    }

    /// Where values lie on cells that are no solids, world: at their points, or in their middles.
    pub fn places(self, cells: &Cells) -> Arc<[DVec3]> {
        match self {
            Self::Point if cells.points().len() == cells.own_points() => Arc::clone(cells.points()),
            // Without those that splits have added.
            Self::Point => cells.points()[..cells.own_points()].into(),
            Self::Cell => cells.middles(),
        }
    }
}

/// A regular arrangement of sample points: index space, and where it lies in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Samples along x, y, z; each at least 1.
    pub dims: [usize; 3],
    /// World distance between neighbours along each axis; negative where an axis runs backwards.
    pub spacing: DVec3,
    /// World position of sample (0, 0, 0).
    pub origin: DVec3,
    /// World directions of the three axes, as columns; as the file gives them, ideally unit.
    pub direction: DMat3,
}

impl Lattice {
    /// A lattice of unit spacing at the origin.
    pub fn unit(dims: [usize; 3]) -> Self {
        Self { dims, spacing: DVec3::ONE, origin: DVec3::ZERO, direction: DMat3::IDENTITY }
    }

    /// Number of samples. Sizes were checked when the lattice was made.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// Always false for a lattice that was checked.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// World step vectors of one index along x, y, z, as columns.
    pub fn axes(&self) -> DMat3 {
        self.direction * DMat3::from_diagonal(self.spacing)
    }

    /// World position of an index-space point.
    pub fn world_from_index(&self, index: DVec3) -> DVec3 {
        self.origin + self.axes() * index
    }

    /// Index-space point of a world position.
    pub fn index_from_world(&self, world: DVec3) -> DVec3 {
        self.axes().inverse() * (world - self.origin)
    }

    /// The indices of the sample that is nearest to a world position, which is finite; of one at the border beyond that.
    pub fn nearest(&self, world: DVec3) -> [usize; 3] {
        let index = self.index_from_world(world).round().clamp(DVec3::ZERO, self.last_index());
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        index.to_array().map(|i| i as usize)
    }

    /// The world point in the middle of the samples.
    pub fn centre(&self) -> DVec3 {
        self.world_from_index(self.last_index() / 2.0)
    }

    /// Radius of the sphere about the centre that holds every voxel's box.
    pub fn bounding_radius(&self) -> f64 {
        let half = (self.last_index() + DVec3::ONE) / 2.0;
        [
            DVec3::new(1., 1., 1.),
            DVec3::new(1., 1., -1.),
            DVec3::new(1., -1., 1.),
            DVec3::new(-1., 1., 1.),
        ]
        .into_iter()
        .map(|sign| (self.axes() * (half * sign)).length())
        .fold(0.0, f64::max)
    }

    /// The least and the greatest world coordinates of every voxel's box.
    pub fn world_bounds(&self) -> [DVec3; 2] {
        let axes = self.axes();
        let half = 0.5 * (self.last_index() + DVec3::ONE);
        let reach = DMat3::from_cols_array(&axes.to_cols_array().map(f64::abs)) * half;
        [self.centre() - reach, self.centre() + reach]
    }

    /// The smallest world distance between neighbours along an axis; > 0 once checked.
    pub fn smallest_spacing(&self) -> f64 {
        let axes = self.axes();
        axes.x_axis.length().min(axes.y_axis.length()).min(axes.z_axis.length())
    }

    /// Index of the last sample along each axis.
    fn last_index(&self) -> DVec3 {
        DVec3::from(self.dims.map(|n| n as f64)) - DVec3::ONE
    }

    /// # Errors
    /// [`VolumeError::Degenerate`] where index space cannot be recovered from the world.
    pub fn check(&self) -> Result<(), VolumeError> {
        let axes = self.axes();
        // Scale out the spacing, so that tiny but regular lattices pass.
        let lengths = DVec3::new(axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length());
        let volume = axes.determinant() / (lengths.x * lengths.y * lengths.z);
        if self.origin.is_finite() && volume.is_finite() && volume.abs() > 1e-9 {
            return Ok(());
        }
        Err(VolumeError::Degenerate {
            found: format!(
                "spacing {:?}, direction {:?}, origin {:?}",
                self.spacing.to_array(),
                self.direction.to_cols_array(),
                self.origin.to_array()
            ),
        })
    }
}

/// One named array of a file.
#[derive(Debug, Clone)]
pub struct Field {
    /// The file's name for it; empty names are given one by the reader.
    pub name: String,
    /// Values per sample point, ≥ 1.
    pub components: usize,
    /// Points or cells.
    pub association: Association,
    /// The values, components interleaved, x fastest.
    pub samples: Arc<Samples>,
}

impl Field {
    /// Whether its samples are taken for vectors: three components that are not bytes, which are colours.
    pub fn is_vectors(&self) -> bool {
        self.components == 3 && self.samples.scalar_type() != ScalarType::UInt8
    }

    /// Its name and what it sits on, which tells apart what a file calls the same.
    pub fn full_name(&self) -> String {
        format!("{} ({})", self.name, self.association.name())
    }
}

/// What a whole number among a field's values stands for.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelName {
    /// Of which number of a sample.
    pub component: usize,
    /// The value.
    pub value: i64,
    /// What has it.
    pub name: String,
    /// The colour that the file gives it.
    pub colour: Option<Srgb8>,
}

/// What the samples of an only field of one number were made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandsFor {
    /// The least and the greatest of its values.
    pub range: [f64; 2],
    /// The box about it, world, where it does not fill that of the samples: those that are NaN lie beside it.
    pub bounds: Option<[DVec3; 2]>,
}

/// Everything read from a file that holds a grid.
#[derive(Debug, Clone)]
pub struct Grid {
    /// The lattice of the *points*; see [`Grid::lattice_of`] for cell fields. Where the shape is not
    /// affine, a lattice of as many points over the same box.
    pub lattice: Lattice,
    /// How the points lie.
    pub shape: Shape,
    /// Its arrays, the active one first; at least one.
    pub fields: Vec<Field>,
    /// What the file calls its space (`left-posterior-superior`, …), where it says.
    pub space: Option<String>,
    /// What lengths are given in (`mm`), where the file or its format says.
    pub unit: Option<String>,
    /// The basis functions whose sum its only field is, where it was sampled from some.
    pub functions: Option<Arc<Encoding>>,
    /// What its samples stand for, where they were made of something else and that is known.
    pub stands_for: Option<StandsFor>,
    /// What the active field's values stand for, where the file says.
    pub label_names: Vec<LabelName>,
}

/// Which number of a field is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Component {
    /// The component of this index.
    Index(usize),
    /// The Euclidean length of all components.
    Magnitude,
    /// Of a vector: the length of its curl.
    Vorticity,
    /// Of a vector.
    Divergence,
    /// Of a vector: its scalar product with its curl (helicity density).
    Helicity,
}

impl Component {
    /// What is derived of vectors by their gradient.
    pub const DERIVED: [Self; 3] = [Self::Vorticity, Self::Divergence, Self::Helicity];

    /// What is shown of a field of so many components before anyone chooses.
    pub fn usual(components: usize) -> Self {
        if components == 1 { Self::Index(0) } else { Self::Magnitude }
    }

    /// The name scripts use, of what is not a number.
    pub fn word(self) -> &'static str {
        match self {
            Self::Index(_) => "component",
            Self::Magnitude => "magnitude",
            Self::Vorticity => "vorticity",
            Self::Divergence => "divergence",
            Self::Helicity => "helicity",
        }
    }
}

impl Grid {
    /// A grid of evenly spaced points, of no space that has a name.
    pub fn of(lattice: Lattice, fields: Vec<Field>) -> Self {
        Self {
            lattice,
            shape: Shape::Affine,
            fields,
            space: None,
            unit: None,
            functions: None,
            stands_for: None,
            label_names: Vec::new(),
        }
    }

    /// A grid of points of a shape, of no space that has a name.
    ///
    /// # Errors
    /// See [`Shape::check`].
    pub fn shaped(dims: [usize; 3], shape: Shape, fields: Vec<Field>) -> Result<Self, VolumeError> {
        shape.check(dims)?;
        let lattice = shape.outline(dims);
        Ok(Self { shape, ..Self::of(lattice, fields) })
    }

    /// # Errors
    /// Where a field's samples do not fill its lattice, or the lattice or shape is degenerate.
    pub fn check(&self) -> Result<(), VolumeError> {
        self.lattice.check()?;
        self.shape.check(self.lattice.dims)?;
        for field in &self.fields {
            let [x, y, z] = self.dims_of(field.association);
            let sizes = [x, y, z, field.components];
            let expected = memory::checked_product(&sizes.map(|n| n as u64));
            if expected != Some(field.samples.len() as u64) || expected == Some(0) {
                return Err(VolumeError::Size {
                    what: format!("field \"{}\" of {sizes:?}", field.name),
                    expected: expected.map_or("over 2^64".to_owned(), |n| n.to_string()),
                    found: field.samples.len(),
                });
            }
        }
        Ok(())
    }

    /// The lattice on which a field's samples lie: the points, or the middles of the cells. Where the
    /// shape is not affine, only its `dims` are theirs.
    pub fn lattice_of(&self, field: &Field) -> Lattice {
        self.lattice_on(field.association)
    }

    /// How many samples on points or cells there are along each axis; of unstructured cells, as many along x as there are.
    pub fn dims_of(&self, association: Association) -> [usize; 3] {
        match &self.shape {
            Shape::Unstructured(cells) => match association {
                Association::Point => [cells.own_points(), 1, 1],
                Association::Cell => [cells.own_cells(), 1, 1],
            },
            _ => self.lattice_on(association).dims,
        }
    }

    pub(super) fn lattice_on(&self, association: Association) -> Lattice {
        match association {
            Association::Point => self.lattice,
            Association::Cell => {
                // A flat grid has one cell across; its middle lies in the plane of the points.
                let inset = self.lattice.dims.map(|n| if n > 1 { 0.5 } else { 0.0 });
                Lattice {
                    dims: self.lattice.dims.map(|n| n.saturating_sub(1).max(1)),
                    origin: self.lattice.world_from_index(DVec3::from(inset)),
                    ..self.lattice
                }
            }
        }
    }

    /// The field of this name or full name (`NAME (cell)`), or the active one for `None`.
    ///
    /// # Errors
    /// [`VolumeError::NoSuchField`].
    pub fn field(&self, name: Option<&str>) -> Result<&Field, VolumeError> {
        let found = match name {
            None => self.fields.first(),
            Some(name) => {
                let by_name = self.fields.iter().find(|f| f.name == name);
                by_name.or_else(|| self.fields.iter().find(|f| f.full_name() == name))
            }
        };
        let told = |field: &Field| match self.fields.iter().filter(|f| f.name == field.name).count()
        {
            1 => field.name.clone(),
            _ => field.full_name(),
        };
        found.ok_or_else(|| VolumeError::NoSuchField {
            asked: name.unwrap_or_default().to_owned(),
            available: self.fields.iter().map(told).collect(),
        })
    }

    /// One number of each of a field's samples, where these lie.
    ///
    /// # Errors
    /// No such component, or cancelled.
    pub fn samples_of(
        &self,
        field: &Field,
        component: Component,
        ticket: &Ticket,
    ) -> Result<Arc<Samples>, VolumeError> {
        Ok(match (component, field.components) {
            (Component::Index(0), 1) => Arc::clone(&field.samples),
            (Component::Index(index), components) if index >= components => {
                return Err(VolumeError::NoSuchComponent {
                    field: field.name.clone(),
                    asked: index,
                    components,
                });
            }
            (derived, components) if Component::DERIVED.contains(&derived) => {
                if components != 3 {
                    let field = field.name.clone();
                    return Err(VolumeError::NotVectors { field, components });
                }
                Arc::new(derive(self, field, derived, ticket)?)
            }
            _ => Arc::new(extract(field, component)?),
        })
    }

    /// One scalar field of the grid, ready to be drawn: statistics and bricks computed. Where the grid is
    /// not evenly spaced, it is interpolated onto a lattice that is ([`Grid::resampling`]).
    ///
    /// A single-component field shares its samples; a component or magnitude of several, or what is
    /// derived of vectors, is made into 64-bit floats only where the type needs them, otherwise 32-bit.
    ///
    /// # Errors
    /// No such component, no finite value, too little memory, or cancelled.
    pub fn scalar(
        &self,
        field: &Field,
        component: Component,
        ticket: &Ticket,
    ) -> Result<ScalarVolume, VolumeError> {
        let samples = self.samples_of(field, component, ticket)?;
        let Spaced { lattice, samples, cells, scattered, statistics, own_bounds } =
            self.evenly_spaced(field, samples, ticket)?;
        let own_bounds = own_bounds.or(self.stands_for.and_then(|of| of.bounds));
        let statistics = match (statistics, self.stands_for) {
            (Some(own), _) => own,
            (None, None) => Statistics::of(&samples, ticket)?,
            (None, Some(StandsFor { range, bounds })) => {
                let sampled = Statistics::between(&samples, range, ticket)?;
                // No data is missing beside what was sampled.
                let nan_count = if bounds.is_some() { 0 } else { sampled.nan_count };
                Statistics { nan_count, ..sampled }
            }
        };
        if statistics.finite_count == 0 {
            return Err(VolumeError::NothingFinite {
                field: field.name.clone(),
                found: match component {
                    // The length of finite components may have no number of their bits.
                    Component::Magnitude => format!(
                        "lengths of which {} are NaN and {} infinite or beyond what {} can hold",
                        statistics.nan_count,
                        statistics.infinite_count,
                        samples.scalar_type().name()
                    ),
                    _ if !matches!(self.shape, Shape::Affine) => {
                        // What was sampled of them is not what the file has.
                        let own =
                            Statistics::of(&*self.samples_of(field, component, ticket)?, ticket)?;
                        let others = not_finite(&own);
                        let and = if others.is_empty() { "" } else { " and " };
                        match own.finite_count {
                            0 => others,
                            finite => format!(
                                "{others}{and}{finite} on no cell that can be drawn, which takes a volume and a finite \
                                 value at each corner"
                            ),
                        }
                    }
                    _ => not_finite(&statistics),
                },
            });
        }
        let bricks = Bricks::of(&samples, lattice.dims, ticket)?;
        let name = match component {
            Component::Index(_) if field.components == 1 => field.name.clone(),
            Component::Index(index) => format!("{}[{index}]", field.name),
            Component::Magnitude => format!("|{}|", field.name),
            derived => format!("{} of {}", derived.word(), field.name),
        };
        let unit = self.unit.clone();
        let functions = self.functions.clone();
        Ok(ScalarVolume {
            name,
            lattice,
            unit,
            samples,
            statistics,
            bricks,
            functions,
            cells,
            scattered,
            own_bounds,
        })
    }
}

/// One component, or the magnitude, of a field with several.
fn extract(field: &Field, component: Component) -> Result<Samples, VolumeError> {
    let n = field.components;
    let wide = field.samples.scalar_type().size_bytes() > 2
        && field.samples.scalar_type() != ScalarType::Float32;
    let needed = (field.samples.len() / n * if wide { 8 } else { 4 }) as u64;
    memory::require(
        &format!("a scalar of field \"{}\"", field.name),
        needed,
        memory::free_bytes(),
    )?;
    let samples = &field.samples;
    let value = |at: usize| match component {
        Component::Index(index) => samples.get(n * at + index),
        _ => {
            // Sixteen components cover every tensor; more are only ever asked for by index.
            let mut tuple = [0.0; 16];
            let count = n.min(tuple.len());
            for (c, to) in tuple[..count].iter_mut().enumerate() {
                *to = samples.get(n * at + c);
            }
            magnitude(&tuple[..count])
        }
    };
    let count = samples.len() / n;
    Ok(if wide {
        Samples::Float64(parallel::list(count, value))
    } else {
        #[expect(clippy::cast_possible_truncation, reason = "the sources have 24 bits at most")]
        Samples::Float32(parallel::list(count, |i| value(i) as f32))
    })
}

/// The length of a vector, also where squares overflow.
fn magnitude(tuple: &[f64]) -> f64 {
    let square: f64 = tuple.iter().map(|v| v * v).sum();
    let most = tuple.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    if square.is_finite() || !most.is_finite() {
        return square.sqrt();
    }
    most * tuple.iter().map(|v| (v / most) * (v / most)).sum::<f64>().sqrt()
}

/// The scalar field that is drawn: a lattice, one value a point, and what is known of the values.
#[derive(Debug, Clone)]
pub struct ScalarVolume {
    /// Shown to people: the field's name, with its component.
    pub name: String,
    /// Where the samples lie.
    pub lattice: Lattice,
    /// What lengths are given in (`mm`), where the file says.
    pub unit: Option<String>,
    /// One value a lattice point, x fastest.
    pub samples: Arc<Samples>,
    /// Of the finite values.
    pub statistics: Statistics,
    /// Least and greatest value of each brick.
    pub bricks: Bricks,
    /// The basis functions whose sum the samples are, or that were fitted to them.
    pub functions: Option<Arc<Encoding>>,
    /// The cells whose values the samples are.
    pub cells: Option<Arc<CellField>>,
    /// The points whose values they are: scattered ones, or those of the cells.
    pub scattered: Option<Arc<Scattered>>,
    /// Least and greatest x, y, z of the places that the file has values at, where `lattice` was made for these; `None` where the
    /// samples are the file's own.
    pub own_bounds: Option<[DVec3; 2]>,
}

impl ScalarVolume {
    /// The value at a world position, linear between the samples; NaN outside the voxels' boxes, and
    /// beside samples that are NaN.
    pub fn value_at(&self, world: DVec3) -> f64 {
        let index = self.lattice.index_from_world(world);
        let dims = self.lattice.dims;
        let (mut low, mut share) = ([[0; 2]; 3], [0.0; 3]);
        for axis in 0..3 {
            let last = dims[axis] - 1;
            if !(-0.5..=last as f64 + 0.5).contains(&index[axis]) {
                return f64::NAN;
            }
            let within = index[axis].clamp(0.0, last as f64);
            let first = (within.floor() as usize).min(last);
            low[axis] = [first, (first + 1).min(last)];
            share[axis] = within - first as f64;
        }
        let mut sum = 0.0;
        for corner in 0..8 {
            let bit = |axis: usize| corner >> axis & 1;
            let weight: f64 = (0..3)
                .map(|axis| if bit(axis) == 1 { share[axis] } else { 1.0 - share[axis] })
                .product();
            // What weighs nothing may be NaN.
            if weight > 0.0 {
                let at = |axis: usize| low[axis][bit(axis)];
                sum += weight * self.samples.get((at(2) * dims[1] + at(1)) * dims[0] + at(0));
            }
        }
        sum
    }

    /// A volume from bare samples, for analytic scenes and tests.
    ///
    /// # Errors
    /// As [`Grid::check`] and [`Grid::scalar`].
    pub fn from_samples(
        name: &str,
        lattice: Lattice,
        samples: Samples,
    ) -> Result<Self, VolumeError> {
        let field = Field {
            name: name.to_owned(),
            components: 1,
            association: Association::Point,
            samples: Arc::new(samples),
        };
        let grid = Grid::of(lattice, vec![field]);
        grid.check()?;
        grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new())
    }
}

/// How many samples are no numbers, in words; nothing where all are.
fn not_finite(statistics: &Statistics) -> String {
    match (statistics.nan_count, statistics.infinite_count) {
        (0, 0) => String::new(),
        (nan, 0) => format!("{nan} NaN"),
        (0, infinite) => format!("{infinite} infinite"),
        (nan, infinite) => format!("{nan} NaN and {infinite} infinite"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(dims: [usize; 3]) -> Samples {
        Samples::Float32((0..dims.iter().product()).map(|i| i as f32).collect())
    }

    #[test]
    fn a_long_vector_is_no_infinite_one() {
        assert_eq!(magnitude(&[3.0, -4.0]), 5.0);
        assert_eq!(magnitude(&[]), 0.0);
        let long = magnitude(&[3e200, -4e200]);
        assert!((long / 5e200 - 1.0).abs() < 1e-15, "{long}");
        assert_eq!(magnitude(&[f64::INFINITY, 1.0]), f64::INFINITY);
        assert!(magnitude(&[f64::NAN, 1e200]).is_nan());
    }

    #[test]
    fn cells_sit_between_points() {
        let lattice = Lattice {
            dims: [3, 4, 1],
            spacing: DVec3::new(2.0, 1.0, 5.0),
            origin: DVec3::new(10.0, 0.0, 0.0),
            direction: DMat3::IDENTITY,
        };
        let field = Field {
            name: "c".into(),
            components: 1,
            association: Association::Cell,
            samples: Arc::new(ramp([2, 3, 1])),
        };
        let grid = Grid::of(lattice, vec![field]);
        assert_eq!(grid.check(), Ok(()));
        let cells = grid.lattice_of(&grid.fields[0]);
        assert_eq!(cells.dims, [2, 3, 1]);
        assert_eq!(cells.origin, DVec3::new(11.0, 0.5, 0.0));
    }

    #[test]
    fn world_and_index_undo_each_other_on_a_sheared_reflected_lattice() {
        let lattice = Lattice {
            dims: [4, 5, 6],
            spacing: DVec3::new(0.5, -2.0, 1000.0),
            origin: DVec3::splat(1e7),
            direction: DMat3::from_cols(DVec3::X, DVec3::new(0.3, 0.9, 0.0), DVec3::Z),
        };
        lattice.check().unwrap();
        let index = DVec3::new(1.0, 2.5, 3.0);
        let back = lattice.index_from_world(lattice.world_from_index(index));
        assert!((back - index).length() < 1e-6, "{back}");
    }

    #[test]
    fn flat_axes_zero_spacing_and_wrong_counts_are_refused() {
        let flat = Lattice {
            direction: DMat3::from_cols(DVec3::X, DVec3::X, DVec3::Z),
            ..Lattice::unit([2; 3])
        };
        assert!(matches!(flat.check(), Err(VolumeError::Degenerate { .. })));
        let zero = Lattice { spacing: DVec3::new(1.0, 0.0, 1.0), ..Lattice::unit([2; 3]) };
        assert!(matches!(zero.check(), Err(VolumeError::Degenerate { .. })));
        let short = ScalarVolume::from_samples("s", Lattice::unit([2, 2, 2]), ramp([2, 2, 1]));
        assert!(matches!(short, Err(VolumeError::Size { .. })), "{short:?}");
    }

    #[test]
    fn a_field_of_nan_alone_is_refused() {
        let nan = ScalarVolume::from_samples(
            "n",
            Lattice::unit([2, 1, 1]),
            Samples::Float32(vec![f32::NAN; 2]),
        );
        assert!(matches!(nan, Err(VolumeError::NothingFinite { .. })), "{nan:?}");
    }

    #[test]
    fn values_run_straight_between_samples_and_end_with_the_boxes() {
        let lattice = Lattice {
            spacing: DVec3::new(2.0, 1.0, 1.0),
            origin: DVec3::new(10.0, 0.0, 0.0),
            ..Lattice::unit([3, 2, 2])
        };
        let samples = (0..12).map(|i| if i == 11 { f32::NAN } else { i as f32 }).collect();
        let volume = ScalarVolume::from_samples("v", lattice, Samples::Float32(samples)).unwrap();
        let at = |x, y, z| volume.value_at(DVec3::new(x, y, z));
        assert_eq!(at(10.0, 0.0, 0.0), 0.0);
        assert_eq!(at(11.0, 0.5, 0.25), 0.5 + 1.5 + 1.5);
        assert_eq!((at(9.1, 0.0, 0.0), at(14.9, 0.0, 0.0)), (0.0, 2.0));
        assert!(at(8.9, 0.0, 0.0).is_nan() && at(15.1, 0.0, 0.0).is_nan());
        assert!(at(13.0, 0.9, 0.9).is_nan());
        assert_eq!(at(14.0, 0.0, 1.0), 8.0);
    }

    #[test]
    fn the_magnitude_of_a_vector_is_its_length() {
        let field = Field {
            name: "v".into(),
            components: 3,
            association: Association::Point,
            samples: Arc::new(Samples::Int16(vec![2, 3, 6, 0, -4, 3])),
        };
        let grid = Grid::of(Lattice::unit([2, 1, 1]), vec![field]);
        let volume = grid.scalar(&grid.fields[0], Component::Magnitude, &Ticket::new()).unwrap();
        assert_eq!((volume.samples.get(0), volume.samples.get(1)), (7.0, 5.0));
        assert_eq!(volume.name, "|v|");
        let second = grid.scalar(&grid.fields[0], Component::Index(1), &Ticket::new()).unwrap();
        assert_eq!((second.samples.get(0), second.samples.get(1)), (3.0, -4.0));
        assert!(grid.scalar(&grid.fields[0], Component::Index(3), &Ticket::new()).is_err());
    }

    #[test]
    fn fields_of_one_name_are_told_apart_by_what_they_sit_on() {
        let field = |association, value| Field {
            name: "t".into(),
            components: 1,
            association,
            samples: Arc::new(Samples::UInt8(vec![value])),
        };
        let fields = vec![field(Association::Point, 1), field(Association::Cell, 2)];
        let grid = Grid::of(Lattice::unit([1, 1, 1]), fields);
        let value = |name| grid.field(Some(name)).map(|field| field.samples.get(0));
        assert_eq!((value("t"), value("t (cell)")), (Ok(1.0), Ok(2.0)));
        let refused = value("x").unwrap_err().to_string();
        assert!(refused.contains("t (point), t (cell)"), "{refused}");
    }
}

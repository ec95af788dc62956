//! Fields of vectors: where each stands, which way it points, and how long it is.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::resample::Spaced;
use super::shape::{Shape, axes_of};
use super::{
    Association, Component, Field, Grid, Lattice, Samples, Statistics, VectorsOnCells, VolumeError,
};
use crate::cells::On;
use crate::core::memory;
use crate::core::parallel;
use crate::core::progress::Ticket;

/// Where the vectors of a field stand.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// On a lattice, x fastest.
    Lattice(Lattice),
    /// On a grid whose points are not evenly spaced (rectilinear or curvilinear), x fastest; or wherever unstructured points
    /// are, in their order, all of them along x.
    Points {
        /// Points along x, y, z.
        dims: [usize; 3],
        /// World positions, one a vector.
        points: Arc<[DVec3]>,
        /// World steps from each point to its neighbours along x, y, z, as columns: half the
        /// difference of the two beside it, at borders the difference to the only one. Always
        /// invertible: see `usable_axes` of `shape`.
        axes: Arc<[DMat3]>,
    },
}

impl Places {
    /// Points along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        match self {
            Self::Lattice(lattice) => lattice.dims,
            Self::Points { dims, .. } => *dims,
        }
    }

    /// World position of a vector, and the steps to its neighbours as columns.
    pub fn at(&self, index: usize) -> (DVec3, DMat3) {
        match self {
            Self::Lattice(lattice) => {
                let [nx, ny, _] = lattice.dims;
                let voxel = [index % nx, index / nx % ny, index / (nx * ny)].map(|i| i as f64);
                (lattice.world_from_index(DVec3::from(voxel)), lattice.axes())
            }
            Self::Points { points, axes, .. } => (points[index], axes[index]),
        }
    }
}

/// A field of vectors. Cheap to clone: everything long is shared.
#[derive(Debug, Clone)]
pub struct VectorField {
    /// Shown to people.
    pub name: String,
    /// Where they stand.
    pub places: Places,
    /// World components, x fastest; NaN where there is no data.
    pub vectors: Arc<[Vec3]>,
    /// Their lengths, one a vector.
    pub magnitudes: Arc<Samples>,
    /// Of the finite lengths.
    pub statistics: Statistics,
    /// What they were sampled from where they were: cells between whose points they are known.
    pub on_cells: Option<Arc<VectorsOnCells>>,
}

impl VectorField {
    /// A field from vectors that fill their places.
    ///
    /// # Errors
    /// Too few or too many vectors, none of finite length, or cancelled.
    pub fn new(
        name: &str,
        places: Places,
        vectors: Arc<[Vec3]>,
        ticket: &Ticket,
    ) -> Result<Self, VolumeError> {
        let expected = places.dims().iter().product::<usize>();
        if expected != vectors.len() || expected == 0 {
            return Err(VolumeError::Size {
                what: format!("vectors of \"{name}\""),
                expected: expected.to_string(),
                found: vectors.len(),
            });
        }
        // In double precision: squares of 32-bit components overflow.
        let lengths = parallel::list(vectors.len(), |i| vectors[i].as_dvec3().length() as f32);
        let magnitudes = Samples::Float32(lengths);
        let statistics = Statistics::of(&magnitudes, ticket)?;
        if statistics.finite_count == 0 {
            return Err(VolumeError::NothingFinite {
                field: name.to_owned(),
                found: format!(
                    "lengths of which {} are NaN and {} infinite or beyond 3.4e38, which 32-bit numbers \
                     cannot hold",
                    statistics.nan_count, statistics.infinite_count
                ),
            });
        }
        let magnitudes = Arc::new(magnitudes);
        let name = name.to_owned();
        Ok(Self { name, places, vectors, magnitudes, statistics, on_cells: None })
    }
}

impl Grid {
    /// The vectors of a field of three components.
    ///
    /// # Errors
    /// Another number of components, and as [`VectorField::new`].
    pub fn vectors(&self, field: &Field, ticket: &Ticket) -> Result<VectorField, VolumeError> {
        if field.components != 3 {
            return Err(VolumeError::NotVectors {
                field: field.name.clone(),
                components: field.components,
            });
        }
        self.require_vectors(&field.name, field.samples.len() / 3)?;
        if matches!(self.shape, Shape::Unstructured(_)) {
            let own = |c: usize| self.samples_of(field, Component::Index(c), ticket);
            let parts = [own(0)?, own(1)?, own(2)?];
            return self.vectors_on_lattice(&field.name, field, parts, ticket);
        }
        let samples = &field.samples;
        let vector = |i: usize| Vec3::from_array([0, 1, 2].map(|c| narrow(samples.get(3 * i + c))));
        let vectors = parallel::list(samples.len() / 3, vector);
        VectorField::new(&field.name, self.places(field.association), vectors.into(), ticket)
    }

    /// The vectors whose components are three scalar fields, named after them.
    ///
    /// # Errors
    /// Fields of more than one component or not all on points or all on cells, and as
    /// [`VectorField::new`].
    pub fn vectors_of(
        &self,
        fields: [&Field; 3],
        ticket: &Ticket,
    ) -> Result<VectorField, VolumeError> {
        let [first, ..] = fields;
        for field in fields {
            let is_alike = field.association == first.association
                && field.samples.len() == first.samples.len();
            if field.components != 1 || !is_alike {
                return Err(VolumeError::NoTriple {
                    found: format!(
                        "field \"{}\" of {} a {} beside \"{}\" on {}s",
                        field.name,
                        field.components,
                        field.association.name(),
                        first.name,
                        first.association.name()
                    ),
                });
            }
        }
        let name = format!("({})", fields.map(|field| field.name.as_str()).join(", "));
        let count = first.samples.len();
        self.require_vectors(&name, count)?;
        if matches!(self.shape, Shape::Unstructured(_)) {
            let parts = fields.map(|field| Arc::clone(&field.samples));
            return self.vectors_on_lattice(&name, first, parts, ticket);
        }
        let vector = |index| Vec3::from_array(fields.map(|field| narrow(field.samples.get(index))));
        let vectors = parallel::list(count, vector);
        VectorField::new(&name, self.places(first.association), vectors.into(), ticket)
    }

    /// Vectors of unstructured cells, whose points are in no order that splats could be averaged by: on the lattice that
    /// scalars are sampled on, NaN outside all cells. The cells themselves are kept beside them, for what asks for places.
    fn vectors_on_lattice(
        &self,
        name: &str,
        field: &Field,
        parts: [Arc<Samples>; 3],
        ticket: &Ticket,
    ) -> Result<VectorField, VolumeError> {
        let on_cells = match &self.shape {
            Shape::Unstructured(cells) if !cells.solids().is_empty() => {
                let on = match field.association {
                    Association::Point => On::Points,
                    Association::Cell => On::Cells,
                };
                let own =
                    parts.each_ref().map(|part| (0..part.len()).map(|i| part.get(i)).collect());
                Some(Arc::new(VectorsOnCells::new(cells, on, own)))
            }
            _ => None,
        };
        let [x, y, z] = parts;
        let Spaced { lattice, samples: x, .. } = self.evenly_spaced(field, x, ticket)?;
        let Spaced { samples: y, .. } = self.evenly_spaced(field, y, ticket)?;
        let Spaced { samples: z, .. } = self.evenly_spaced(field, z, ticket)?;
        let vector = |i| Vec3::from_array([&x, &y, &z].map(|part| narrow(part.get(i))));
        let vectors = parallel::list(x.len(), vector);
        let field = VectorField::new(name, Places::Lattice(lattice), vectors.into(), ticket)?;
        Ok(VectorField { on_cells, ..field })
    }

    fn require_vectors(&self, name: &str, count: usize) -> Result<(), VolumeError> {
        let places = match self.shape {
            Shape::Affine => 0,
            Shape::Unstructured(_) => 3 * size_of::<f64>(),
            _ => size_of::<DVec3>() + size_of::<DMat3>(),
        };
        let needed = ((16 + places) as u64).saturating_mul(count as u64);
        let what = format!("the vectors of \"{name}\"");
        Ok(memory::require(&what, needed, memory::free_bytes())?)
    }

    /// Where samples on points or cells stand: at the true points of grids that are not evenly spaced.
    pub fn places(&self, association: Association) -> Places {
        let (shape, dims) = self.shape_of(association);
        if matches!(shape, Shape::Affine) {
            return Places::Lattice(self.lattice_on(association));
        }
        if let Some(lattice) = shape.even(dims) {
            return Places::Lattice(lattice);
        }
        if let Shape::Unstructured(cells) = &shape {
            let points = match association {
                Association::Point => shape.points(dims),
                Association::Cell => cells.middles(),
            };
            let edge = cells.median_edge();
            let axes = DMat3::from_diagonal(DVec3::splat(if edge > 0.0 { edge } else { 1.0 }));
            return Places::Points { dims, axes: vec![axes; points.len()].into(), points };
        }
        let points = shape.points(dims);
        let axes = axes_of(&points, dims);
        Places::Points { dims, points, axes }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "directions need no more digits")]
fn narrow(v: f64) -> f32 {
    v as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(components: usize, samples: Samples) -> Grid {
        let field = Field {
            name: "wind".into(),
            components,
            association: Association::Point,
            samples: Arc::new(samples),
        };
        let lattice = Lattice { spacing: DVec3::new(1.0, 2.0, 4.0), ..Lattice::unit([1, 2, 1]) };
        Grid::of(lattice, vec![field])
    }

    #[test]
    fn vectors_keep_their_components_places_and_lengths() {
        let grid = grid(3, Samples::Int16(vec![2, 3, 6, 0, -4, 3]));
        let field = grid.vectors(&grid.fields[0], &Ticket::new()).unwrap();
        assert_eq!(&*field.vectors, &[Vec3::new(2.0, 3.0, 6.0), Vec3::new(0.0, -4.0, 3.0)]);
        assert_eq!((field.magnitudes.get(0), field.magnitudes.get(1)), (7.0, 5.0));
        let (place, axes) = field.places.at(1);
        assert_eq!(place, DVec3::new(0.0, 2.0, 0.0));
        assert_eq!(axes, DMat3::from_diagonal(DVec3::new(1.0, 2.0, 4.0)));
    }

    #[test]
    fn long_vectors_are_not_infinite_and_holes_are_not_counted() {
        let values = vec![3e30, -4e30, 0.0, f32::NAN, 1.0, 1.0];
        let grid = grid(3, Samples::Float32(values));
        let field = grid.vectors(&grid.fields[0], &Ticket::new()).unwrap();
        assert!((field.statistics.max / 5e30 - 1.0).abs() < 1e-6, "{}", field.statistics.max);
        assert_eq!((field.statistics.finite_count, field.statistics.nan_count), (1, 1));
    }

    #[test]
    fn other_components_and_holes_alone_are_refused() {
        let two = grid(2, Samples::Float32(vec![1.0; 4]));
        let refused = two.vectors(&two.fields[0], &Ticket::new());
        assert!(matches!(refused, Err(VolumeError::NotVectors { components: 2, .. })));
        let holes = grid(3, Samples::Float32(vec![f32::NAN; 6]));
        let refused = holes.vectors(&holes.fields[0], &Ticket::new());
        assert!(matches!(refused, Err(VolumeError::NothingFinite { .. })));
    }

    #[test]
    fn vectors_of_uneven_grids_stand_at_their_true_points_and_those_of_cells_between() {
        let lists = [vec![0.0, 1.0, 4.0].into(), vec![0.0, 2.0].into(), vec![5.0].into()];
        let field = |name: &str, association, count: usize| Field {
            name: name.into(),
            components: 3,
            association,
            samples: Arc::new(Samples::Float32(vec![1.0; 3 * count])),
        };
        let fields = vec![field("p", Association::Point, 6), field("c", Association::Cell, 2)];
        let grid = Grid::shaped([3, 2, 1], Shape::Rectilinear(lists), fields).unwrap();
        let points = grid.vectors(&grid.fields[0], &Ticket::new()).unwrap();
        let (place, axes) = points.places.at(4);
        assert_eq!(place, DVec3::new(1.0, 2.0, 5.0));
        assert_eq!(axes, DMat3::from_diagonal(DVec3::new(2.0, 2.0, 2.0)));
        // Middles at 0.5 and 2.5 are even.
        let cells = grid.vectors(&grid.fields[1], &Ticket::new()).unwrap();
        let Places::Lattice(lattice) = cells.places else { panic!("{:?}", cells.places) };
        assert_eq!((lattice.dims, lattice.spacing.x), ([2, 1, 1], 2.0));
        assert_eq!(lattice.origin, DVec3::new(0.5, 1.0, 5.0));
    }

    #[test]
    fn three_scalars_of_one_kind_make_vectors_and_others_do_not() {
        let field = |name: &str, components: usize, association, samples: Samples| Field {
            name: name.into(),
            components,
            association,
            samples: Arc::new(samples),
        };
        let fields = vec![
            field("a", 1, Association::Point, Samples::Int16(vec![2, 0])),
            field("b", 1, Association::Point, Samples::Float64(vec![3.0, -4.0])),
            field("c", 1, Association::Point, Samples::UInt8(vec![6, 3])),
            field("two", 2, Association::Point, Samples::UInt8(vec![0; 4])),
            field("cells", 1, Association::Cell, Samples::UInt8(vec![1])),
        ];
        let grid = Grid::of(Lattice::unit([2, 1, 1]), fields);
        let of = |[a, b, c]: [usize; 3]| {
            let fields = [&grid.fields[a], &grid.fields[b], &grid.fields[c]];
            grid.vectors_of(fields, &Ticket::new())
        };
        let vectors = of([0, 1, 2]).unwrap();
        assert_eq!(vectors.name, "(a, b, c)");
        assert_eq!(&*vectors.vectors, &[Vec3::new(2.0, 3.0, 6.0), Vec3::new(0.0, -4.0, 3.0)]);
        assert_eq!((vectors.magnitudes.get(0), vectors.magnitudes.get(1)), (7.0, 5.0));
        for wrong in [[0, 1, 3], [0, 1, 4], [3, 0, 1]] {
            assert!(matches!(of(wrong), Err(VolumeError::NoTriple { .. })), "{wrong:?}");
        }
    }
}

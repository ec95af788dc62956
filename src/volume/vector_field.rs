//! Fields of vectors: where each stands, which way it points, and how long it is.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::samples::Scalar;
use super::{Field, Grid, Lattice, Samples, Statistics, VolumeError};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::with_samples;

/// Where the vectors of a field stand.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// On a lattice, x fastest.
    Lattice(Lattice),
    /// On a grid whose points lie anywhere (curvilinear), x fastest.
    Points {
        /// Points along x, y, z.
        dims: [usize; 3],
        /// World positions, one a vector.
        points: Arc<[DVec3]>,
        /// World steps from each point to its neighbours along x, y, z, as columns: half the
        /// difference of the two beside it, at borders the difference to the only one.
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
        let lengths = vectors.par_iter().map(|v| v.as_dvec3().length() as f32).collect();
        let magnitudes = Samples::Float32(lengths);
        let statistics = Statistics::of(&magnitudes, ticket)?;
        if statistics.finite_count == 0 {
            return Err(VolumeError::NothingFinite {
                field: name.to_owned(),
                found: format!(
                    "{} NaN and {} infinite lengths",
                    statistics.nan_count, statistics.infinite_count
                ),
            });
        }
        let magnitudes = Arc::new(magnitudes);
        Ok(Self { name: name.to_owned(), places, vectors, magnitudes, statistics })
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
        let count = field.samples.len() / 3;
        memory::require(
            &format!("the vectors of field \"{}\"", field.name),
            16 * count as u64,
            memory::free_bytes(),
        )?;
        let narrow = |v: f64| {
            #[expect(clippy::cast_possible_truncation, reason = "directions need no more digits")]
            let narrow = v as f32;
            narrow
        };
        let vectors = with_samples!(&*field.samples, values => {
            let triples = values.par_chunks_exact(3);
            triples.map(|v| Vec3::from_array([0, 1, 2].map(|c| narrow(v[c].to_f64())))).collect()
        });
        VectorField::new(&field.name, Places::Lattice(self.lattice_of(field)), vectors, ticket)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Association;

    fn grid(components: usize, samples: Samples) -> Grid {
        let field = Field {
            name: "wind".into(),
            components,
            association: Association::Point,
            samples: Arc::new(samples),
        };
        let lattice = Lattice { spacing: DVec3::new(1.0, 2.0, 4.0), ..Lattice::unit([1, 2, 1]) };
        Grid { lattice, fields: vec![field], space: None }
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
}

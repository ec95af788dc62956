//! Sampled fields in memory: lattices, samples in the file's own type, and their statistics.
//!
//! Owns what a file holds once read ([`Grid`]), the one scalar field of it that is drawn
//! ([`ScalarVolume`]), and its vectors ([`VectorField`]). Refuses files and the GPU. Imports `core`, `rbf` and `cells`.

mod coordinates;
pub mod cover;
pub mod demo;
mod depth;
mod derived;
mod error;
mod grid;
mod joint;
mod middles;
mod resample;
mod samples;
mod scattered;
mod shape;
mod statistics;
mod strays;
mod unit;
mod vector_field;
mod vectors_on_cells;

pub use coordinates::Coordinates;
pub use error::VolumeError;
pub use grid::{Association, Component, Field, Grid, LabelName, Lattice, ScalarVolume, StandsFor};
pub use joint::{JOINT_BINS, JointHistogram};
pub use samples::{Samples, Scalar, ScalarType};
pub use scattered::Scattered;
pub use shape::Shape;
pub use statistics::{BRICK, Bricks, HISTOGRAM_BINS, QUANTILES, Statistics};
pub use strays::{TIMES_FRAMED, without_strays};
pub use unit::length_unit;
pub use vector_field::{Places, VectorField};
pub use vectors_on_cells::VectorsOnCells;
#[cfg(test)]
pub(crate) use vectors_on_cells::rotation_on_wedges;

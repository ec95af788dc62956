//! Sampled fields in memory: lattices, samples in the file's own type, and their statistics.
//!
//! Owns what a file holds once read ([`Grid`]) and the one scalar field of it that is drawn
//! ([`ScalarVolume`]). Refuses files and the GPU. Imports `core` only.

pub mod demo;
mod grid;
mod samples;
mod statistics;

pub use grid::{Association, Component, Field, Grid, Lattice, ScalarVolume, VolumeError};
pub use samples::{Samples, Scalar, ScalarType};
pub use statistics::{BRICK, Bricks, HISTOGRAM_BINS, QUANTILES, Statistics};

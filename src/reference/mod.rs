//! The picture in float64, slowly: what every faster way of drawing is held to.
//!
//! Owns quadrature along rays, compositing in order, and the order itself. Of a kernel it knows h(r)
//! alone, never a footprint in closed form, a polynomial or a table, so that an error in those shows.
//! It sharpens, fills holes and classifies by ways of its own; of vectors, too, it makes splats, means of
//! these and marks itself, and asks for settings and for the sizes of the marks' table alone. [`Reference`] draws any scene's mode,
//! and the continuous integral which that mode converges to, pixel by pixel.
//! Refuses the GPU and the hierarchy. Imports `core`, `cells`, `rbf`, `volume`, `transfer`, `kernel`, `vector`, `polygons`, `scene`.

mod cells;
mod classes;
mod cut;
mod field;
mod inside;
mod kernels;
mod layers;
mod line;
mod marks;
mod mesh;
mod picture;
mod polygons;
mod polynomial;
mod probe;
mod probed_vectors;
mod projection;
mod quadrature;
mod renderer;
mod shading;
mod sources;
mod splats;
mod truth;
mod vectors;

#[cfg(test)]
mod mode_tests;
#[cfg(test)]
mod support;
#[cfg(test)]
mod truth_tests;
#[cfg(test)]
mod vector_tests;

pub use inside::Met;
pub use kernels::{RefKernel, grid_kernels, traversal};
pub use picture::{Rays, every_sample};
pub use probe::{Point, Probe, Seen, seen_alone};
pub use probed_vectors::{ProbedVector, VectorPlace};
pub use renderer::{Reference, TOLERANCE};

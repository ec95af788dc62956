//! Reconstruction kernels, their footprints, and how a kernel lands on the picture.
//!
//! Owns the mathematics of one splat. Refuses volumes of them, files and the GPU.
//! Imports `core`.

mod ellipse;
mod kind;
mod polynomial;
mod radial;

pub use ellipse::{ProjectedKernel, perspective_jacobian};
pub use kind::Kernel;
pub use polynomial::{COEFFICIENTS, FootprintPolynomial, Rim};
pub use radial::RadialKernel;

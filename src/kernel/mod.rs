//! Reconstruction kernels, their footprints, and how a kernel lands on the picture.
//!
//! Owns the mathematics of one splat, and the values that weigh a lattice of them. Refuses pictures,
//! files and the GPU. Imports `core` and `volume`.

mod bounds;
mod coefficients;
mod ellipse;
mod gouraud;
mod kind;
mod polynomial;
mod radial;
mod separable;
mod slab_share;

pub use bounds::{BOUND_BRICK, Bounds, Weighs, mirrored};
pub use coefficients::{
    Averaged, Coefficients, CoefficientsError, MOST_EXTENT, MOST_TENT_EXTENT, Residual,
    coefficients, nearest_tents,
};
pub use ellipse::{ProjectedKernel, perspective_jacobian};
pub use gouraud::{MeshVertex, SplatMesh, Subdivisions};
pub use kind::Kernel;
pub use polynomial::{COEFFICIENTS, FootprintPolynomial, Rim};
pub use radial::RadialKernel;
pub use separable::Separable;
pub use slab_share::{SHARE_FACTORS, SHARE_POWERS, SlabShare};

//! Reconstruction kernels, their footprints, and how a kernel lands on the picture.
//!
//! Owns the mathematics of one splat. Refuses volumes of them, files and the GPU.
//! Imports `core`.

mod kind;

pub use kind::Kernel;

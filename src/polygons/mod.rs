//! Polygons: triangles in the world, as files have them or as they are made here.
//!
//! Owns [`Mesh`], what it refuses, its normals and the numbers on it, and the surfaces of labelled samples ([`Nets`]). Refuses files, looks and
//! drawing. Imports `core`.
//! Read by `vector`, `io`, `scene`, `reference`, `gpu`, `task`, `app` and `cli`.

mod doubles;
mod levels;
mod mesh;
mod nets;
mod shapes;
mod shorten;
mod soft;

pub use levels::{Numbered, between_levels};
pub use mesh::{Mesh, MeshArray, MeshError, MeshValues, Triangle};
pub use nets::{NOTHING, Nets, Surface};
pub use shapes::{Paint, Shapes};
pub use soft::SOFT_DEGREES;

//! Polygons: triangles in the world, as files have them or as they are made here.
//!
//! Owns [`Mesh`], what it refuses, and its normals. Refuses files, looks and drawing. Imports `core`.
//! Read by `io`, `scene`, `reference`, `gpu`, `task`, `app` and `cli`.

mod mesh;

pub use mesh::{Mesh, MeshError, Triangle};

//! Coarser views of a classified volume: the extinction-weighted pyramid, and octree cuts of it.
//!
//! Owns Laur–Hanrahan's hierarchy. Refuses the GPU and files. Imports `core`, `volume`,
//! `transfer`.

mod cut;
mod empty_space;
mod pyramid;

pub use cut::{Cut, CutLimits, CutNode, Visibility, VisitOrder};
pub use empty_space::{EMPTY_BRICK, FieldBounds, MOST_DISTANCE};
pub use pyramid::{ActiveCounts, Node, Pyramid, PyramidLevel};

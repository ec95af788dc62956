//! Coarser views of a volume: the extinction-weighted pyramid of a classified one, octree cuts of it,
//! and the pyramid of the values themselves.
//!
//! Owns Laur–Hanrahan's hierarchy. Refuses the GPU and files. Imports `core`, `volume`,
//! `transfer`.

mod brick_errors;
mod bricks;
mod coarse;
mod columns;
mod cut;
mod empty_space;
mod moments;
mod occlusion;
mod parts;
mod pyramid;
mod specks;
mod sums;
mod thinning;

pub use brick_errors::{BrickErrors, Means, MeansOfLevel};
pub use bricks::LEVELS as BRICK_LEVELS;
pub use cut::{Cut, CutLimits, CutNode, Visibility, VisitOrder};
pub use empty_space::{EMPTY_BRICK, MOST_DISTANCE, distances, widen};
pub use moments::{ScalarLevel, ScalarPyramid, ScalarPyramidError};
pub use parts::{MergedBrick, PyramidParts};
pub use pyramid::{ActiveCounts, ErrorMeasure, Node, Pyramid, PyramidError, PyramidLevel};
pub use specks::{Speck, specks};
pub use sums::Sums;
pub use thinning::Thinning;

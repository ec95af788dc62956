//! Work off the caller's thread: the drawing engine's service, and jobs with progress and cancel.
//!
//! Owns threads and the channels to them. Refuses widgets and flags. Imports everything below it.

pub mod annotations;
pub mod cells;
mod classified;
pub mod cost;
pub mod cuts;
pub mod draw;
pub mod effect_costs;
pub mod encode;
pub mod engine;
pub mod engines;
pub mod estimate;
pub mod field_on_mesh;
mod job;
pub mod lettering;
pub mod level;
pub mod loop_file;
mod native;
mod octrees;
pub mod output_file;
pub mod picture_file;
mod previews;
pub mod probe;
pub mod remaining;
mod rows;
pub mod rung;
mod slabs;
pub mod smooth;
pub mod still;
pub mod sweep;
pub mod transfer_file;
mod vectors;

#[doc(hidden)]
pub use previews::coefficients_of as preview_field;

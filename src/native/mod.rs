//! Drawing on the processor: the same plans, the same slabs, the same pictures, where there is no GPU.
//!
//! Owns [`Renderer`], and [`supports()`], which says what of a plan it does not draw. Refuses wgpu, files, flags and
//! windows, and knows nothing of the other engine. Imports `plan` and what lies below it.
//!
//! Rays go in packets of eight, a block of 4 × 2 pixels, a ray a lane. Three things make it quick. A value is summed up
//! row by row of its samples, two rays at a time, without fetching single samples. Each patch of 4 × 4 pixels has a
//! mask of the depths at which anything can show there, from bounds of the field in bricks of 4³ cells (those of
//! B-splines by the Bézier points of the spline). And what a scene does not ask for is not in its loop.
//!
//! Fields go from slab to slab (`walk`), kernels that are shaded first from slice to slice of the lattice (`gather`),
//! or by lists (`nodes`, `kernels`).

mod along_solids;
mod among;
mod bricks;
#[cfg(test)]
mod cancel_tests;
mod cells;
mod composite;
mod functions;
mod gather;
mod grid;
mod in_order;
mod kernels;
mod landed;
mod lanes;
mod lattice;
mod laying;
mod levels;
mod light;
mod lit_cells;
mod loops;
mod marks;
mod masks;
mod nodes;
mod own;
mod passing;
#[cfg(test)]
mod picture_tests;
mod polygons;
mod project;
mod rays;
mod renderer;
mod samples;
mod seen;
mod separable;
mod shapes;
mod solids;
mod splatted;
mod sums;
mod supports;
mod surfaces;
mod table;
#[cfg(test)]
mod tests;
mod threads;
mod walk;
mod weights;
mod window;

pub use nodes::Node;
pub use rays::slab_thickness;
pub use renderer::{Renderer, Stored, StoredLevels, tile_count};
pub use samples::samples_bytes;
pub use supports::{NotBegun, Unsupported, stored_bytes, supports};

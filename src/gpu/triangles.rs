//! Kernels as footprint triangles: uploaded records, and those that a grid's voxels give.

/// What the grid pieces since `Renderer::begin` have drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridTotals {
    /// Kernels drawn.
    pub kernels: u64,
    /// The most that a piece had beyond the room it was given; 0 when all of them fitted.
    pub most_missing: u64,
}

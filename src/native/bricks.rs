//! Bricks of a field, of which its bounds are known (`kernel::Bounds`): where nothing can show, no ray asks.

use crate::core::{Cancelled, Ticket};
use crate::kernel::{BOUND_BRICK, Bounds, Weighs};

/// Edge of a brick, cells between samples.
pub(super) const BRICK: usize = BOUND_BRICK;

/// Bounds by brick: b covers the places 4b − 1 … 4b + 3 along each axis, in index space. The first begins half a cell
/// before the lattice does.
pub(super) fn bounds(
    values: &[f32],
    dims: [usize; 3],
    weighs: Weighs,
    ticket: &Ticket,
) -> Result<Bounds, Cancelled> {
    let bricks = dims.map(|n| (n + 1).div_ceil(BRICK));
    Bounds::of(values, dims, weighs, (bricks, [1, BRICK - 2]), ticket)
}

/// Where a brick begins and ends in a lattice of `dims` samples, in index space.
pub(super) fn ends(bricks: &Bounds, brick: usize, dims: [usize; 3]) -> [glam::DVec3; 2] {
    let [nx, ny, _] = bricks.dims;
    let at = [brick % nx, brick / nx % ny, brick / (nx * ny)];
    let low = at.map(|b| (b * BRICK) as f64 - 1.0);
    let begin = [0, 1, 2].map(|a| low[a].max(-0.5));
    let end = [0, 1, 2].map(|a| (low[a] + BRICK as f64).min(dims[a] as f64 - 0.5));
    [glam::DVec3::from(begin), glam::DVec3::from(end)]
}

//! Curvilinear grids cell by cell: a cell fills the lattice points inside it.
//!
//! A cell of eight corners is what trilinear interpolation between them makes of the unit cube; where a
//! point lies in that cube is found by Newton's method.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::super::shape::{corners, voxel};
use super::super::{Lattice, Samples, VolumeError};
use crate::core::progress::Ticket;

/// Slices of the lattice that are filled by one worker at a time.
const SLICES: usize = 4;
/// A point is inside a cell up to so far outside its unit cube: rounding must not open seams.
const RIM: f64 = 1e-6;
/// A solution is found once a step is no longer than this, in unit cubes.
const EXACT: f64 = 1e-9;
/// Slopes shorter than this share of the cell's diagonal lead nowhere.
const COLLAPSED: f64 = 1e-12;
/// Beside squares of unit slopes.
const DAMPING: f64 = 1e-14;
const MOST_STEPS: usize = 30;

/// The least length, over all edges between neighbours, of those that run along x more than along y and
/// z; then of those along y; then z. Where none runs along an axis, the least of all.
pub(super) fn least_edges(points: &[DVec3], dims: [usize; 3]) -> [f64; 3] {
    let [nx, ny, _] = dims;
    let strides = [1, nx, nx * ny];
    let none = || [f64::INFINITY; 3];
    let less = |a: [f64; 3], b: [f64; 3]| [a[0].min(b[0]), a[1].min(b[1]), a[2].min(b[2])];
    let of = |index: usize| {
        let place = voxel(dims, index);
        let mut least = none();
        for axis in 0..3 {
            if place[axis] + 1 < dims[axis] {
                let edge = (points[index + strides[axis]] - points[index]).abs();
                let along = edge.max_position();
                // Edges of no length tell no spacing.
                if edge[along] > 0.0 {
                    least[along] = least[along].min(edge[along]);
                }
            }
        }
        least
    };
    let least = (0..points.len()).into_par_iter().map(of).reduce(none, less);
    let all = least.into_iter().fold(f64::INFINITY, f64::min);
    least.map(|v| if v.is_finite() { v } else { all })
}

/// A cell's corners in the world.
pub(super) struct Cell {
    corners: [DVec3; 8],
    size: f64,
}

impl Cell {
    pub(super) fn new(corners: [DVec3; 8]) -> Self {
        let [low, high] = bounds(&corners);
        Self { corners, size: (high - low).length() }
    }

    /// World position of a point of the unit cube, and its derivatives as columns.
    fn at(&self, unit: DVec3) -> (DVec3, DMat3) {
        let mut place = DVec3::ZERO;
        let mut slopes = [DVec3::ZERO; 3];
        for (number, corner) in self.corners.iter().enumerate() {
            let mut weights = [0.0; 3];
            let mut signs = [0.0; 3];
            for axis in 0..3 {
                let is_far = number >> axis & 1 == 1;
                weights[axis] = if is_far { unit[axis] } else { 1.0 - unit[axis] };
                signs[axis] = if is_far { 1.0 } else { -1.0 };
            }
            let [x, y, z] = weights;
            place += *corner * (x * y * z);
            slopes[0] += *corner * (signs[0] * y * z);
            slopes[1] += *corner * (x * signs[1] * z);
            slopes[2] += *corner * (x * y * signs[2]);
        }
        (place, DMat3::from_cols(slopes[0], slopes[1], slopes[2]))
    }

    #[cfg(test)]
    pub(super) fn world_from_unit(&self, unit: DVec3) -> DVec3 {
        self.at(unit).0
    }

    /// Where in the unit cube a world position lies, if it lies in the cell.
    pub(super) fn unit_from_world(&self, world: DVec3) -> Option<DVec3> {
        let mut unit = DVec3::splat(0.5);
        for _ in 0..MOST_STEPS {
            let (place, slopes) = self.at(unit);
            let off = world - place;
            // Newton's step in the least squares, of slopes scaled to unit length (cells may be flat by
            // any factor) and damped by so little that only collapsed cells feel it, whose slopes have no
            // inverse.
            let [x, y, z] = [slopes.x_axis, slopes.y_axis, slopes.z_axis]
                .map(|slope| slope.length().max(COLLAPSED * self.size));
            let lengths = DVec3::new(x, y, z);
            let units = DMat3::from_cols(slopes.x_axis / x, slopes.y_axis / y, slopes.z_axis / z);
            let square = units.transpose() * units + DMat3::from_diagonal(DVec3::splat(DAMPING));
            let step = square.inverse() * (units.transpose() * off) / lengths;
            if !step.is_finite() {
                return None;
            }
            // What leaves the cube by more than another one does not come back.
            unit = (unit + step).clamp(DVec3::splat(-1.0), DVec3::splat(2.0));
            if step.abs().max_element() <= EXACT {
                // Where slopes have no inverse, no step is left beside the cell, too.
                let rim = DVec3::splat(RIM);
                let is_inside = unit.cmpge(-rim).all() && unit.cmple(DVec3::ONE + rim).all();
                let is_there = off.length() <= RIM * self.size;
                return (is_inside && is_there).then(|| unit.clamp(DVec3::ZERO, DVec3::ONE));
            }
        }
        None
    }
}

fn bounds(corners: &[DVec3; 8]) -> [DVec3; 2] {
    corners
        .iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(*p), high.max(*p)])
}

/// Indices of a lattice along one axis that lie from `low` to `high`, and a rim beyond.
fn covered(low: f64, high: f64, origin: f64, step: f64, n: usize) -> std::ops::Range<usize> {
    let rim = 1e-6 * (high - low).max(step);
    let first = ((low - rim - origin) / step).ceil().max(0.0);
    let end = ((high + rim - origin) / step).floor() + 1.0;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative, and no more than the lattice's size"
    )]
    let clamped = |v: f64| v.clamp(0.0, n as f64) as usize;
    clamped(first)..clamped(end)
}

/// Fills the points of an axis-aligned lattice that lie in cells. The first cell in order wins where
/// several have a point, whatever the threads do.
pub(super) fn fill<T: Copy + Send + Sync>(
    out: &mut [T],
    from_f64: impl Fn(f64) -> T + Sync,
    samples: &Samples,
    points: &[DVec3],
    dims: [usize; 3],
    lattice: &Lattice,
    ticket: &Ticket,
) -> Result<(), VolumeError> {
    let cells = dims.map(|n| n - 1);
    let count = cells.iter().product::<usize>();
    let [mx, my, mz] = lattice.dims;
    let (origin, step) = (lattice.origin, lattice.spacing);
    let of_cell = |cell: usize| {
        let numbers = corners(dims, voxel(cells, cell));
        (numbers, numbers.map(|number| points[number]))
    };
    // Cells by the first slice they reach into, and the end of what they reach into.
    let reached: Vec<[u32; 2]> = (0..count)
        .into_par_iter()
        .map(|cell| {
            let [low, high] = bounds(&of_cell(cell).1);
            let slices = covered(low.z, high.z, origin.z, step.z, mz);
            [slices.start, slices.end].map(|at| u32::try_from(at).unwrap_or(u32::MAX))
        })
        .collect();
    let done = AtomicU64::new(0);
    let pieces = mz.div_ceil(SLICES) as u64;
    out.par_chunks_mut(mx * my * SLICES).enumerate().try_for_each(|(piece, slab)| {
        let first = piece * SLICES;
        let slices = slab.len() / (mx * my);
        let mut is_filled = vec![false; slab.len()];
        for (cell, [start, end]) in reached.iter().enumerate() {
            let (start, end) = ((*start as usize).max(first), (*end as usize).min(first + slices));
            if start >= end {
                continue;
            }
            if ticket.is_cancelled() {
                return Err(crate::core::Cancelled.into());
            }
            let (numbers, places) = of_cell(cell);
            let [low, high] = bounds(&places);
            let cell = Cell::new(places);
            for z in start..end {
                for y in covered(low.y, high.y, origin.y, step.y, my) {
                    for x in covered(low.x, high.x, origin.x, step.x, mx) {
                        let at = ((z - first) * my + y) * mx + x;
                        if is_filled[at] {
                            continue;
                        }
                        let index = DVec3::new(x as f64, y as f64, z as f64);
                        let Some(unit) = cell.unit_from_world(origin + step * index) else {
                            continue;
                        };
                        is_filled[at] = true;
                        slab[at] = from_f64(between(samples, numbers, unit));
                    }
                }
            }
        }
        let before = done.fetch_add(1, Ordering::Relaxed);
        Ok(ticket.checkpoint(before + 1, pieces)?)
    })
}

/// Trilinear between eight corners; those of no weight may be holes.
fn between(samples: &Samples, corners: [usize; 8], unit: DVec3) -> f64 {
    let mut sum = 0.0;
    for (number, corner) in corners.into_iter().enumerate() {
        let mut weight = 1.0;
        for axis in 0..3 {
            weight *= if number >> axis & 1 == 1 { unit[axis] } else { 1.0 - unit[axis] };
        }
        if weight > 0.0 {
            sum += weight * samples.get(corner);
        }
    }
    sum
}

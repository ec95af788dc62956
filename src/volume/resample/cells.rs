//! Cells fill the lattice points inside them.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;

use super::super::{Lattice, VolumeError};
use crate::cells::{CellField, Kind};
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};

/// Slices of the lattice that are filled by one worker at a time.
const SLICES: usize = 4;

/// Indices of a lattice along one axis that lie from `low` to `high`, and a rim beyond.
fn covered([low, high]: [f64; 2], origin: f64, step: f64, n: usize) -> Range<usize> {
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

/// Fills the points of an axis-aligned lattice that lie in solids. The first solid in order wins where several have a
/// point, whatever the threads do.
pub(super) fn fill<T: Copy + Send + Sync>(
    out: &mut [T],
    from_f64: impl Fn(f64) -> T + Sync,
    field: &CellField,
    lattice: &Lattice,
    ticket: &Ticket,
) -> Result<(), VolumeError> {
    let cells = field.cells();
    let [mx, my, mz] = lattice.dims;
    let (origin, step) = (lattice.origin, lattice.spacing);
    // Solids by the first slice they reach into, and the end of what they reach into.
    let reached = parallel::list(cells.solids().len(), |solid| {
        if !field.is_there(solid) {
            return [0; 2];
        }
        let [low, high] = cells.placed(solid).bounds();
        let slices = covered([low.z, high.z], origin.z, step.z, mz);
        [slices.start, slices.end].map(|at| u32::try_from(at).unwrap_or(u32::MAX))
    });
    let done = AtomicU64::new(0);
    let pieces = mz.div_ceil(SLICES) as u64;
    parallel::try_each(out.chunks_mut(mx * my * SLICES).enumerate(), |(piece, slab)| {
        let first = piece * SLICES;
        let slices = slab.len() / (mx * my);
        let mut is_filled = vec![false; slab.len()];
        for (solid, [start, end]) in reached.iter().enumerate() {
            let (start, end) = ((*start as usize).max(first), (*end as usize).min(first + slices));
            if start >= end {
                continue;
            }
            if ticket.is_cancelled() {
                return Err(Cancelled.into());
            }
            let placed = cells.placed(solid);
            let [low, high] = placed.bounds();
            let is_straight = placed.kind() == Kind::Tetrahedron && !placed.is_flat();
            let rows = is_straight.then(|| placed.rows());
            let unit_of = |place| match &rows {
                Some(rows) => placed.unit_by(rows, place),
                None => placed.unit_from(place),
            };
            for z in start..end {
                for y in covered([low.y, high.y], origin.y, step.y, my) {
                    for x in covered([low.x, high.x], origin.x, step.x, mx) {
                        let at = ((z - first) * my + y) * mx + x;
                        if is_filled[at] {
                            continue;
                        }
                        let index = DVec3::new(x as f64, y as f64, z as f64);
                        let Some(unit) = unit_of(origin + step * index) else { continue };
                        is_filled[at] = true;
                        slab[at] = from_f64(field.value(solid, unit));
                    }
                }
            }
        }
        let before = done.fetch_add(1, Ordering::Relaxed);
        Ok(ticket.checkpoint(before + 1, pieces)?)
    })
}

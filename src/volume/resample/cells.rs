//! Cells fill the lattice points inside them.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;

use super::super::{Lattice, VolumeError};
use crate::cells::{CellField, Kind, Placed};
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};

/// Slices of the lattice that are filled by one worker at a time.
const SLICES: usize = 4;
/// Solids that are passed by together.
const SOME: usize = 256;

/// Indices of a lattice along one axis that lie from `low` to `high`, and a rim beyond.
fn covered([low, high]: [f64; 2], origin: f64, step: f64, n: usize) -> Range<usize> {
    let rim = 1e-6 * (high - low).max(step);
    let within = |place: f64| ((place - origin) / step).clamp(-1.0, n as f64) + 1.0;
    // Whole numbers of what is not negative: `floor` is a call where processors may be old.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to n + 1")]
    let whole = |v: f64| v as usize;
    let (before, last) = (within(low - rim), whole(within(high + rim)));
    let first = whole(before);
    let first = if (first as f64) < before { first + 1 } else { first };
    first.max(1) - 1..last.min(n)
}

/// The sides of a tetrahedron along rows of a lattice: what leads from an offset to (r, s, t), and what the heights above the four
/// sides grow by from one index to the next, and 1 over that.
struct Sides {
    rows: [DVec3; 3],
    growths: [[f64; 2]; 4],
}

impl Sides {
    fn new(rows: [DVec3; 3], step: f64) -> Self {
        let [r, s, t] = rows.map(|row| row.x * step);
        Self { rows, growths: [r, s, t, -r - s - t].map(|growth| [growth, 1.0 / growth]) }
    }

    /// The indices of a row, by its offset, at which it is between all sides, and one before them.
    fn between(&self, offset: DVec3, columns: &Range<usize>) -> Range<usize> {
        let [r, s, t] = self.rows.map(|row| row.dot(offset));
        let (mut low, mut high) = (columns.start as f64, columns.end as f64);
        for (height, [growth, inverse]) in [r, s, t, 1.0 - r - s - t].into_iter().zip(self.growths)
        {
            // What counts as inside, and a good deal more than rounding.
            let height = height + 2.0 * Placed::RIM;
            if growth > 0.0 {
                low = low.max(-height * inverse);
            } else if growth < 0.0 {
                high = high.min(-height * inverse + 1.0);
            } else if height < 0.0 {
                return 0..0;
            }
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let between = low as usize..high.max(0.0) as usize;
        between
    }
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
        let [low, high] = cells.bounds_of(solid);
        let slices = covered([low.z, high.z], origin.z, step.z, mz);
        [slices.start, slices.end].map(|at| u32::try_from(at).unwrap_or(u32::MAX))
    });
    // Neighbours in a file mostly lie close together, so that most are passed by many at a time.
    let reached_by_some: Vec<[u32; 2]> = reached
        .chunks(SOME)
        .map(|some| some.iter().fold([u32::MAX, 0], |[a, b], [c, d]| [a.min(*c), b.max(*d)]))
        .collect();
    let done = AtomicU64::new(0);
    let pieces = mz.div_ceil(SLICES) as u64;
    parallel::try_each(out.chunks_mut(mx * my * SLICES).enumerate(), |(piece, slab)| {
        let first = piece * SLICES;
        let slices = slab.len() / (mx * my);
        let mut is_filled = vec![false; slab.len()];
        let is_met =
            |[start, end]: &[u32; 2]| (*start as usize) < first + slices && *end as usize > first;
        let some = reached_by_some.iter().enumerate().filter(|(_, some)| is_met(some));
        let solids = some.flat_map(|(i, _)| parallel::part(reached.len(), SOME, i));
        for solid in solids.filter(|solid| is_met(&reached[*solid])) {
            let [start, end] = &reached[solid];
            let (start, end) = ((*start as usize).max(first), (*end as usize).min(first + slices));
            if ticket.is_cancelled() {
                return Err(Cancelled.into());
            }
            let placed = cells.placed(solid);
            let [low, high] = placed.bounds();
            let is_straight = placed.kind() == Kind::Tetrahedron && !placed.is_flat();
            let sides = is_straight.then(|| Sides::new(placed.rows(), step.x));
            let unit_of = |place| match &sides {
                Some(sides) => placed.unit_by(&sides.rows, place),
                None => placed.unit_from(place),
            };
            let columns = covered([low.x, high.x], origin.x, step.x, mx);
            for z in start..end {
                for y in covered([low.y, high.y], origin.y, step.y, my) {
                    let row = origin + step * DVec3::new(0.0, y as f64, z as f64);
                    let columns = match &sides {
                        Some(sides) => sides.between(row - placed.corners()[0], &columns),
                        None => columns.clone(),
                    };
                    for x in columns {
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

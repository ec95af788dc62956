//! Which rows of a grid's traversal are drawn in one piece.

use std::ops::Range;

use super::cost::Costs;
use super::draw::PIECE_MS;
use crate::hierarchy::ActiveCounts;
use crate::scene::View;

/// Some rows of the traversal.
pub(super) struct Piece {
    pub(super) rows: Range<u32>,
    /// Kernels thought to be in them.
    pub(super) expected: u64,
    /// Kernels there may be in them.
    pub(super) most: u64,
}

/// Cuts the traversal into pieces of about [`PIECE_MS`], from the known counts slice by slice.
pub(super) struct RowPlan {
    /// Kernels in each slice of the outermost axis, far to near.
    slices: Vec<u64>,
    rows_per_slice: u32,
    row_length: u64,
    pub(super) total: u64,
    next_row: u32,
}

impl RowPlan {
    /// For a lattice of `dims` voxels.
    pub(super) fn new(dims: [usize; 3], active: &ActiveCounts, view: &View) -> Self {
        let [a, b, c] = view.traversal.axes;
        let counts = &active.per_slice[a];
        let split = view.traversal.splits[0];
        let far_first = counts[split..].iter().rev().chain(&counts[..split]);
        #[expect(clippy::cast_possible_truncation, reason = "an axis has at most 65535 voxels")]
        let rows_per_slice = dims[b] as u32;
        Self {
            slices: far_first.map(|&n| u64::from(n)).collect(),
            rows_per_slice,
            row_length: dims[c] as u64,
            total: active.total,
            next_row: 0,
        }
    }

    /// The next piece, with at least one row.
    pub(super) fn next(&mut self, costs: &Costs) -> Option<Piece> {
        let per_slice = self.rows_per_slice;
        let mut slice = (self.next_row / per_slice) as usize;
        let within = self.next_row % per_slice;
        // Whole empty slices need not be looked at.
        if within == 0 {
            slice += self.slices[slice..].iter().take_while(|&&n| n == 0).count();
        }
        let kernels = *self.slices.get(slice)?;
        let first = slice as u32 * per_slice + within;
        let slice_ms = costs.grid_ms(kernels, u64::from(per_slice));
        if within > 0 || slice_ms > PIECE_MS {
            // Part of a slice, taken as evenly filled.
            let parts = (slice_ms / PIECE_MS).ceil().max(1.0);
            let rows = (f64::from(per_slice) / parts).ceil().max(1.0) as u32;
            let end = (first + rows).min((slice as u32 + 1) * per_slice);
            self.next_row = end;
            let count = u64::from(end - first);
            return Some(Piece {
                rows: first..end,
                expected: kernels * count / u64::from(per_slice),
                most: kernels.min(count * self.row_length),
            });
        }
        let mut expected = 0;
        let mut end = slice;
        while let Some(&more) = self.slices.get(end) {
            let rows = u64::from(per_slice) * (end - slice + 1) as u64;
            if end > slice && costs.grid_ms(expected + more, rows) > PIECE_MS {
                break;
            }
            expected += more;
            end += 1;
        }
        self.next_row = end as u32 * per_slice;
        Some(Piece { rows: first..self.next_row, expected, most: expected })
    }
}

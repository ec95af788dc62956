//! Bounds of a field, brick by brick: where nothing can show, no ray asks.

use rayon::prelude::*;

use crate::core::{Cancelled, Ticket};

/// Edge of a brick, cells between samples.
pub(super) const BRICK: usize = 4;

/// Least and greatest value of a field in each brick. Brick b covers the places 4b − 1 … 4b + 3 along each axis, in
/// index space: the first begins half a cell before the lattice does.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bricks {
    pub dims: [usize; 3],
    /// x fastest.
    pub ranges: Vec<[f32; 2]>,
}

impl Bricks {
    /// Of coefficients with `pad` samples more about `dims`.
    ///
    /// Of B-splines, from the Bézier points of the spline in each cell, which its values lie between: an axis at a
    /// time, of the least and of the greatest, as their weights are not negative. Of other kernels, whose values are
    /// means of the samples in reach, from these.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn of(
        stored: &[f32],
        dims: [usize; 3],
        pad: usize,
        is_spline: bool,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let bricks = dims.map(|n| (n + 1).div_ceil(BRICK));
        let [sx, sy, sz] = dims.map(|n| n + 2 * pad);
        let along = |values: &[[f32; 2]], n: usize, b: usize| match is_spline {
            true => of_splines(values, n, b),
            false => of_samples(values, n, pad, b),
        };
        // Along x, row by row, so that only the first pass sees every sample.
        let mut rows = vec![[0.0_f32; 2]; bricks[0] * sy * sz];
        rows.par_chunks_mut(bricks[0] * sy).zip(stored.par_chunks(sx * sy)).try_for_each(
            |(out, plane)| {
                if ticket.is_cancelled() {
                    return Err(Cancelled);
                }
                let mut line = vec![[0.0_f32; 2]; sx];
                for (out, row) in out.chunks_mut(bricks[0]).zip(plane.chunks(sx)) {
                    line.iter_mut().zip(row).for_each(|(pair, &value)| *pair = [value; 2]);
                    for (b, range) in out.iter_mut().enumerate() {
                        *range = along(&line, dims[0], b);
                    }
                }
                Ok(())
            },
        )?;
        let layer = bricks[0] * bricks[1];
        let mut layers = vec![[0.0_f32; 2]; layer * sz];
        layers.par_chunks_mut(layer).zip(rows.par_chunks(bricks[0] * sy)).for_each(
            |(out, rows)| {
                let mut line = vec![[0.0_f32; 2]; sy];
                for bx in 0..bricks[0] {
                    for (y, pair) in line.iter_mut().enumerate() {
                        *pair = rows[y * bricks[0] + bx];
                    }
                    for by in 0..bricks[1] {
                        out[by * bricks[0] + bx] = along(&line, dims[1], by);
                    }
                }
            },
        );
        let mut ranges = vec![[0.0_f32; 2]; layer * bricks[2]];
        ranges.par_chunks_mut(layer).enumerate().for_each(|(bz, out)| {
            // Of each column only the samples that brick bz asks for.
            let mut line = vec![[0.0_f32; 2]; sz];
            for (i, range) in out.iter_mut().enumerate() {
                let first = (bz * BRICK).min(sz);
                let last = (bz * BRICK + BRICK + 2 * pad + 1).min(sz);
                for z in first..last {
                    line[z] = layers[z * layer + i];
                }
                *range = along(&line, dims[2], bz);
            }
        });
        ticket.checkpoint(1, 1)?;
        Ok(Self { dims: bricks, ranges })
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> usize {
        size_of_val(&self.ranges[..])
    }

    /// Where a brick begins and ends in a lattice of `dims` samples, in index space.
    pub(super) fn ends(&self, brick: usize, dims: [usize; 3]) -> [glam::DVec3; 2] {
        let [nx, ny, _] = self.dims;
        let at = [brick % nx, brick / nx % ny, brick / (nx * ny)];
        let low = at.map(|b| (b * BRICK) as f64 - 1.0);
        let begin = [0, 1, 2].map(|a| low[a].max(-0.5));
        let end = [0, 1, 2].map(|a| (low[a] + BRICK as f64).min(dims[a] as f64 - 0.5));
        [glam::DVec3::from(begin), glam::DVec3::from(end)]
    }
}

/// The samples of brick `b` along a line of `n` with `pad` more to either side, as far as any of its places asks.
fn of_samples(line: &[[f32; 2]], n: usize, pad: usize, b: usize) -> [f32; 2] {
    // Cell i asks for samples i + 1 − pad … i + pad, sample s stands at s + pad; cells 4b − 1 … 4b + 2.
    let first = b * BRICK;
    let last = (b * BRICK + BRICK - 2 + 2 * pad).min(n - 1 + 2 * pad);
    bound(line[first..=last].iter().copied())
}

/// The Bézier points of the cells of brick `b` along a line of `n` with two more to either side.
fn of_splines(line: &[[f32; 2]], n: usize, b: usize) -> [f32; 2] {
    let first = b * BRICK;
    let cells = BRICK.min(n + 1 - first);
    let mix = |w: [f32; 3], c: &[[f32; 2]]| {
        [0, 1].map(|i| w[0] * c[0][i] + w[1] * c[1][i] + w[2] * c[2][i])
    };
    const SIXTH: f32 = 1.0 / 6.0;
    let corner = |c: &[[f32; 2]]| mix([SIXTH, 4.0 * SIXTH, SIXTH], c);
    let inner = (0..cells).flat_map(|i| {
        // Cell 4b − 1 + i has the samples stored from 4b + i on.
        let c = &line[first + i..first + i + 4];
        [
            corner(c),
            mix([4.0 * SIXTH, 2.0 * SIXTH, 0.0], &c[1..]),
            mix([2.0 * SIXTH, 4.0 * SIXTH, 0.0], &c[1..]),
        ]
    });
    bound(inner.chain([corner(&line[first + cells..])]))
}

fn bound(ranges: impl Iterator<Item = [f32; 2]>) -> [f32; 2] {
    ranges.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], [l, h]| [low.min(l), high.max(h)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a ramp along x, which splines and tents reproduce: splines are bounded by what they pass through, and no
    /// more, though their coefficients reach further.
    #[test]
    fn bounds_of_a_ramp_are_its_values_at_the_ends_of_bricks() {
        let (dims, pad) = ([10, 3, 2], 2);
        let row = |x: usize| x as f32 - pad as f32;
        let stored: Vec<f32> = (0..7 * 6).flat_map(|_| (0..14).map(row)).collect();
        let of = |is_spline| {
            let found = Bricks::of(&stored, dims, pad, is_spline, &Ticket::new());
            found.expect("not cancelled")
        };
        let splines = of(true);
        assert_eq!(splines.dims, [3, 1, 1]);
        for (found, expected) in splines.ranges.iter().zip([[-1.0, 3.0], [3.0, 7.0], [7.0, 10.0]]) {
            let off = [0, 1].map(|i| (found[i] - expected[i] as f32).abs());
            assert!(off.iter().all(|off| *off < 1e-5), "{found:?} {expected:?}");
        }
        // Two samples to either side of each cell.
        assert_eq!(of(false).ranges, [[-2.0, 4.0], [2.0, 8.0], [6.0, 11.0]]);
    }

    #[test]
    fn a_cancelled_ticket_ends_it() {
        let ticket = Ticket::new();
        ticket.cancel();
        assert!(Bricks::of(&[0.0; 125], [1, 1, 1], 2, true, &ticket).is_err());
    }
}

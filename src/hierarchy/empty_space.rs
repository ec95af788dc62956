//! Where a reconstructed field cannot show, so that rays can leap over it.

use rayon::prelude::*;

use crate::core::{Cancelled, Ticket};

/// Edge of a brick, voxels.
pub const EMPTY_BRICK: usize = 4;
/// The greatest distance that is kept, bricks.
pub const MOST_DISTANCE: u8 = 32;

/// Bounds of a field's values brick by brick.
///
/// Brick b covers the positions 4b − ½ … 4b + 3½ along each axis, in index space, and as far about
/// them as it was asked to reach: any value reconstructed there, as a mean of coefficients with
/// weights that are not negative, lies within its bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldBounds {
    /// Bricks along x, y, z.
    pub dims: [usize; 3],
    /// Least and greatest coefficient of each brick, x fastest.
    pub ranges: Vec<[f32; 2]>,
}

impl FieldBounds {
    /// Bounds of a lattice of coefficients, mirrored about its border samples.
    ///
    /// `below` and `above` are how many samples before the one at 4b, and after the one at
    /// 4b + 3, can take part in values of brick b.
    ///
    /// # Errors
    /// Cancelled by the ticket.
    pub fn of(
        values: &[f32],
        dims: [usize; 3],
        below: usize,
        above: usize,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let pairs = |v: &f32| [*v, *v];
        let [nx, ny, nz] = dims;
        let bricks = dims.map(|n| n.div_ceil(EMPTY_BRICK));
        // Along x first, row by row, so that only the first pass sees every sample.
        let mut rows = vec![[0.0_f32; 2]; bricks[0] * ny * nz];
        rows.par_chunks_mut(bricks[0]).zip(values.par_chunks(nx)).try_for_each(|(out, row)| {
            if ticket.is_cancelled() {
                return Err(Cancelled);
            }
            for (b, range) in out.iter_mut().enumerate() {
                *range = bound(window(b, nx, below, above).map(|x| pairs(&row[x])));
            }
            Ok(())
        })?;
        let mut layers = vec![[0.0_f32; 2]; bricks[0] * bricks[1] * nz];
        layers.par_chunks_mut(bricks[0] * bricks[1]).zip(rows.par_chunks(bricks[0] * ny)).for_each(
            |(out, rows)| {
                for (i, range) in out.iter_mut().enumerate() {
                    let (bx, by) = (i % bricks[0], i / bricks[0]);
                    *range = bound(window(by, ny, below, above).map(|y| rows[y * bricks[0] + bx]));
                }
            },
        );
        let layer = bricks[0] * bricks[1];
        let mut ranges = vec![[0.0_f32; 2]; layer * bricks[2]];
        ranges.par_chunks_mut(layer).enumerate().for_each(|(bz, out)| {
            for (i, range) in out.iter_mut().enumerate() {
                *range = bound(window(bz, nz, below, above).map(|z| layers[z * layer + i]));
            }
        });
        ticket.checkpoint(1, 1)?;
        Ok(Self { dims: bricks, ranges })
    }

    /// For each brick the Chebyshev distance, in bricks, to the nearest in which something can show
    /// by `shows(brick, [least, greatest])`: 0 for those themselves, at most [`MOST_DISTANCE`].
    pub fn distances(&self, shows: impl Fn(usize, [f32; 2]) -> bool + Sync) -> Vec<u8> {
        let [nx, ny, nz] = self.dims;
        let mut distances: Vec<u8> = self
            .ranges
            .par_iter()
            .enumerate()
            .map(|(brick, &range)| if shows(brick, range) { 0 } else { MOST_DISTANCE })
            .collect();
        // The box of a distance is the product of its three intervals, so one sweep up and down
        // along each axis in turn would give the city-block distance; taking at each place the
        // least, over the axis, of the greater of what is there and how far it is, gives this one.
        for (stride, n) in [(1, nx), (nx, ny), (nx * ny, nz)] {
            spread(&mut distances, stride, n);
        }
        distances
    }

    /// Distances to the nearest brick of those `further` bricks about them as well.
    pub fn widen(distances: &mut [u8], further: usize) {
        if further > 0 {
            let further = u8::try_from(further).unwrap_or(u8::MAX);
            // Those at the greatest distance may be further off, but not surely.
            distances.par_iter_mut().for_each(|d| *d = d.saturating_sub(further));
        }
    }
}

/// Samples that can take part in brick `b` along an axis of `n`: mirrored ones lie within as long as
/// the border sample's own neighbours do.
fn window(b: usize, n: usize, below: usize, above: usize) -> impl Iterator<Item = usize> {
    let first = b * EMPTY_BRICK;
    let last = (first + EMPTY_BRICK - 1).min(n - 1);
    // A mirror image of what lies beyond the border lies as far before it.
    let low = first.saturating_sub(below.max((last + above).saturating_sub(n - 1)));
    let reach = above.max(below.saturating_sub(first));
    low..=(last + reach).min(n - 1)
}

fn bound(ranges: impl Iterator<Item = [f32; 2]>) -> [f32; 2] {
    ranges.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], [l, h]| [low.min(l), high.max(h)])
}

/// dᵢ ← min over j of max(dⱼ, |i − j|) along every line of an axis.
fn spread(distances: &mut [u8], stride: usize, n: usize) {
    let block = stride * n;
    distances.par_chunks_mut(block).for_each(|block| {
        let mut line = vec![0_u8; n];
        for start in 0..stride {
            for (i, d) in line.iter_mut().enumerate() {
                *d = block[start + i * stride];
            }
            for i in 0..n {
                let mut least = line[i];
                // Only as far as it can still help.
                for step in 1..usize::from(MOST_DISTANCE) {
                    if step >= usize::from(least) {
                        break;
                    }
                    let before = if i >= step { line[i - step] } else { MOST_DISTANCE };
                    let after = if i + step < n { line[i + step] } else { MOST_DISTANCE };
                    least = least.min(before.min(after).max(step as u8));
                }
                block[start + i * stride] = least;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize) -> Vec<f32> {
        let mut seed = 5_u32;
        (0..n)
            .map(|_| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (seed >> 8) as f32 / (1 << 24) as f32
            })
            .collect()
    }

    fn mirrored(i: i64, n: usize) -> usize {
        if n == 1 {
            return 0;
        }
        let period = 2 * (n as i64 - 1);
        let i = i.rem_euclid(period);
        i.min(period - i) as usize
    }

    #[test]
    fn bounds_hold_every_sample_in_reach_mirrored_ones_too() {
        for dims in [[9, 5, 13], [1, 1, 6], [4, 2, 3]] {
            let values = noise(dims.iter().product());
            for (below, above) in [(0, 1), (2, 2), (3, 5)] {
                let bounds = FieldBounds::of(&values, dims, below, above, &Ticket::new()).unwrap();
                for (index, &[low, high]) in bounds.ranges.iter().enumerate() {
                    let [bx, by, _] = bounds.dims;
                    let brick = [index % bx, index / bx % by, index / (bx * by)];
                    let (mut least, mut greatest) = (f32::INFINITY, f32::NEG_INFINITY);
                    let span = |a: usize| {
                        let first = (brick[a] * 4) as i64;
                        let last = (first + 3).min(dims[a] as i64 - 1);
                        first - below as i64..=last + above as i64
                    };
                    for z in span(2) {
                        for y in span(1) {
                            for x in span(0) {
                                let [x, y, z] = [
                                    mirrored(x, dims[0]),
                                    mirrored(y, dims[1]),
                                    mirrored(z, dims[2]),
                                ];
                                let v = values[(z * dims[1] + y) * dims[0] + x];
                                least = least.min(v);
                                greatest = greatest.max(v);
                            }
                        }
                    }
                    assert!(low <= least && greatest <= high, "{dims:?} {brick:?}");
                    // Not much wider: the same samples, or a few more at the borders.
                    assert!(low >= 0.0 && high < 1.0);
                }
            }
        }
    }

    #[test]
    fn distances_are_chebyshevs() {
        let dims = [9, 7, 50];
        let mut ranges = vec![[0.0, 0.0]; 9 * 7 * 50];
        let seen = [[2, 3, 4], [8, 0, 20]];
        for [x, y, z] in seen {
            ranges[(z * 7 + y) * 9 + x] = [0.0, 1.0];
        }
        let bounds = FieldBounds { dims, ranges };
        let distances = bounds.distances(|_, [_, high]| high > 0.5);
        let mut wider = distances.clone();
        FieldBounds::widen(&mut wider, 2);
        for (i, &found) in distances.iter().enumerate() {
            let at = [i % 9, i / 9 % 7, i / 63];
            let far = |s: &[usize; 3]| (0..3).map(|a| s[a].abs_diff(at[a])).max().unwrap();
            let expected = seen.iter().map(far).min().unwrap().min(usize::from(MOST_DISTANCE));
            assert_eq!(usize::from(found), expected, "{at:?}");
            assert_eq!(usize::from(wider[i]), expected.saturating_sub(2), "{at:?}");
        }
    }
}

//! Bounds of a reconstructed field, brick by brick: where nothing can show, no ray asks.

use glam::DVec3;

use crate::core::parallel;
use crate::core::{Cancelled, Looks, Ticket};

/// Edge of a brick, cells between samples.
pub const BOUND_BRICK: usize = 4;
/// Bricks that boxes are put into between two looks at the ticket; a box is as much work as some more.
const BETWEEN_LOOKS: usize = 1 << 16;
const A_BOX: usize = 32;

/// Least and greatest value of a field in each brick.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Bricks along x, y, z.
    pub dims: [usize; 3],
    /// x fastest.
    pub ranges: Vec<[f32; 2]>,
}

/// What a value is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighs {
    /// So many samples to either side, each with a weight that is not negative: values lie among these.
    Samples(usize),
    /// Cubic B-splines of their natural width: values lie among the Bézier points of the spline in their cell.
    Splines,
}

impl Weighs {
    /// Samples to either side of a position that take part in its value.
    fn pad(self) -> usize {
        match self {
            Self::Samples(pad) => pad,
            Self::Splines => 2,
        }
    }
}

impl Bounds {
    /// Of coefficients, mirrored about the first and the last as often as it takes.
    ///
    /// Cell i lies between samples i and i + 1, and values are asked for in cells −1 to n − 1 of an axis. Brick b has
    /// those from 4b − `before` to 4b + `after`. Bézier points are taken an axis at a time, of the least and of the
    /// greatest, as their weights are not negative.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn of(
        values: &[f32],
        dims: [usize; 3],
        weighs: Weighs,
        (bricks, [before, after]): ([usize; 3], [usize; 2]),
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let pad = weighs.pad();
        let places: [Vec<usize>; 3] =
            dims.map(|n| (0..n + 2 * pad).map(|at| mirrored(at, pad, n)).collect());
        // The samples that brick b asks for along an axis: those before its first cell stand as far along as that cell
        // does among the samples themselves.
        let asked = |axis: usize, b: usize| {
            let first = (b * BOUND_BRICK + 1).saturating_sub(before);
            let last = (b * BOUND_BRICK + after).min(dims[axis] - 1) + 2 * pad;
            places[axis][first..=last].iter().copied()
        };
        let bound = |line: &mut Vec<[f32; 2]>, ranges: &mut dyn Iterator<Item = [f32; 2]>| {
            line.clear();
            line.extend(ranges);
            match weighs {
                Weighs::Samples(_) => bound(line.iter().copied()),
                Weighs::Splines => bound(bezier_points(line)),
            }
        };
        let [nx, ny, nz] = dims;
        let [bx, by, bz] = bricks;
        // Along x, row by row, so that only the first pass sees every sample.
        let mut rows = vec![[0.0_f32; 2]; bx * ny * nz];
        let planes = rows.chunks_mut(bx * ny).zip(values.chunks(nx * ny));
        parallel::try_each(planes, |(out, plane)| {
            ticket.look()?;
            let mut line = Vec::new();
            for (out, row) in out.chunks_mut(bx).zip(plane.chunks(nx)) {
                for (b, range) in out.iter_mut().enumerate() {
                    *range = bound(&mut line, &mut asked(0, b).map(|x| [row[x]; 2]));
                }
            }
            Ok::<(), Cancelled>(())
        })?;
        let mut layers = vec![[0.0_f32; 2]; bx * by * nz];
        let planes = layers.chunks_mut(bx * by).zip(rows.chunks(bx * ny));
        parallel::try_each(planes, |(out, rows)| {
            ticket.look()?;
            let mut line = Vec::new();
            for (i, range) in out.iter_mut().enumerate() {
                let of = |y: usize| rows[y * bx + i % bx];
                *range = bound(&mut line, &mut asked(1, i / bx).map(of));
            }
            Ok::<(), Cancelled>(())
        })?;
        let mut ranges = vec![[0.0_f32; 2]; bx * by * bz];
        parallel::try_each(ranges.chunks_mut(bx * by).enumerate(), |(b, out)| {
            ticket.look()?;
            let mut line = Vec::new();
            for (i, range) in out.iter_mut().enumerate() {
                let of = |z: usize| layers[z * bx * by + i];
                *range = bound(&mut line, &mut asked(2, b).map(of));
            }
            Ok::<(), Cancelled>(())
        })?;
        ticket.checkpoint(1, 1)?;
        Ok(Self { dims: bricks, ranges })
    }

    /// Puts in their place those of boxes, each with its least and greatest value: brick b has what lies within `beyond` of
    /// the places from 4b + `first` to 4b + 4 + `first`. Where no box is there is `nothing`.
    ///
    /// # Errors
    /// [`Cancelled`]: then they are of some boxes alone.
    pub fn set_to_boxes(
        &mut self,
        boxes: impl Iterator<Item = ([DVec3; 2], [f64; 2])>,
        (first, beyond): (f64, f64),
        nothing: f32,
        ticket: &Ticket,
    ) -> Result<(), Cancelled> {
        self.ranges.fill([f32::INFINITY, f32::NEG_INFINITY]);
        let dims = self.dims;
        let mut looks = Looks::every(ticket, BETWEEN_LOOKS);
        for ([low, high], [least, most]) in boxes {
            #[expect(clippy::cast_possible_truncation, reason = "rounded outwards")]
            let [least, most] = [(least as f32).next_down(), (most as f32).next_up()];
            let brick = |place: f64, n: usize| {
                let at = ((place - first) / BOUND_BRICK as f64).floor();
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "clamped"
                )]
                let at = at.clamp(0.0, (n - 1) as f64) as usize;
                at
            };
            let span = |axis: usize| {
                brick(low[axis] - beyond, dims[axis])..=brick(high[axis] + beyond, dims[axis])
            };
            let [xs, ys, zs] = [span(0), span(1), span(2)];
            looks.after(xs.clone().count() * ys.clone().count() * zs.clone().count() + A_BOX)?;
            for z in zs {
                for y in ys.clone() {
                    for x in xs.clone() {
                        let range = &mut self.ranges[(z * dims[1] + y) * dims[0] + x];
                        *range = [range[0].min(least), range[1].max(most)];
                    }
                }
            }
        }
        for range in self.ranges.iter_mut().filter(|range| range[0] > range[1]) {
            *range = [nothing; 2];
        }
        Ok(())
    }

    /// Bytes of memory.
    pub fn size_bytes(&self) -> usize {
        size_of_val(&self.ranges[..])
    }
}

/// The Bézier points of a spline with these coefficients, in every cell that four of them stand about.
fn bezier_points(line: &[[f32; 2]]) -> impl Iterator<Item = [f32; 2]> {
    const SIXTH: f32 = 1.0 / 6.0;
    let mix = |w: [f32; 3], c: &[[f32; 2]]| {
        [0, 1].map(|i| w[0] * c[0][i] + w[1] * c[1][i] + w[2] * c[2][i])
    };
    let corners = line.windows(3).map(move |c| mix([SIXTH, 4.0 * SIXTH, SIXTH], c));
    let inner = line.windows(4).flat_map(move |c| {
        let [from, to] = [[0.0, 4.0, 2.0], [0.0, 2.0, 4.0]].map(|w| w.map(|w| w * SIXTH));
        [mix(from, c), mix(to, c)]
    });
    corners.chain(inner)
}

fn bound(ranges: impl Iterator<Item = [f32; 2]>) -> [f32; 2] {
    ranges.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], [l, h]| [low.min(l), high.max(h)])
}

/// The sample that stands at place `at` of a line with `pad` mirrored samples about its `n`.
pub fn mirrored(at: usize, pad: usize, n: usize) -> usize {
    if n == 1 {
        return 0;
    }
    let period = 2 * (n - 1);
    // Far enough up that the remainder is never taken of a negative number.
    let i = (at + period * pad.div_ceil(period) - pad) % period;
    i.min(period - i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::assert_stops;

    /// Of cells 4b − 1 to 4b + 2.
    fn of(values: &[f32], dims: [usize; 3], weighs: Weighs) -> Bounds {
        let bricks = dims.map(|n| (n + 1).div_ceil(BOUND_BRICK));
        let found = Bounds::of(values, dims, weighs, (bricks, [1, 2]), &Ticket::new());
        found.expect("not cancelled")
    }

    /// Of a ramp along x, which splines and tents reproduce: splines are bounded by what they pass through, and no
    /// more, though their coefficients reach further.
    #[test]
    fn bounds_of_a_ramp_are_its_values_at_the_ends_of_bricks() {
        let dims = [14, 3, 2];
        let values: Vec<f32> = (0..6).flat_map(|_| (0..14_u8).map(f32::from)).collect();
        let splines = of(&values, dims, Weighs::Splines);
        assert_eq!(splines.dims, [4, 1, 1]);
        for (found, expected) in splines.ranges[1..3].iter().zip([[3.0, 7.0], [7.0, 11.0]]) {
            let off = [0, 1].map(|i| (found[i] - expected[i] as f32).abs());
            assert!(off.iter().all(|off| *off < 1e-5), "{found:?} {expected:?}");
        }
        // Two samples to either side of each cell, and their mirror images.
        let samples = of(&values, dims, Weighs::Samples(2));
        assert_eq!(samples.ranges, [[0.0, 4.0], [2.0, 8.0], [6.0, 12.0], [10.0, 13.0]]);
    }

    /// A thin shell: a brick whose coefficients reach its values shows; fewer have such values.
    #[test]
    fn fewer_bricks_of_a_shell_show_by_bezier_points_and_all_of_its_values_are_within() {
        let dims = [29, 27, 31];
        let value = |x: f32, y: f32, z: f32| {
            ((x - 14.0).powi(2) + (y - 13.2).powi(2) + (z - 15.1).powi(2)).sqrt()
        };
        let [nx, ny, nz] = dims;
        let all = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        let values: Vec<f32> = all.map(|[x, y, z]| value(x as f32, y as f32, z as f32)).collect();
        let splines = of(&values, dims, Weighs::Splines);
        let samples = of(&values, dims, Weighs::Samples(2));
        let shown = |bounds: &Bounds| {
            bounds.ranges.iter().filter(|[low, high]| *low < 9.3 && *high > 9.0).count()
        };
        let [fewer, many] = [&splines, &samples].map(shown);
        println!("measured {fewer} of {} bricks, {many} by the samples", splines.ranges.len());
        assert!(fewer * 4 < many * 3, "{fewer} {many}");
        // Of the spline itself, in a few places of every brick.
        let weights = |f: f32| {
            let g = 1.0 - f;
            let inner = |f: f32| (4.0 - 6.0 * f * f + 3.0 * f * f * f) / 6.0;
            [g * g * g / 6.0, inner(f), inner(g), f * f * f / 6.0]
        };
        for (i, [low, high]) in splines.ranges.iter().enumerate() {
            let [bx, by, _] = splines.dims;
            let brick = [i % bx, i / bx % by, i / (bx * by)];
            for step in 0..64 {
                let parts = [step % 4, step / 4 % 4, step / 16];
                let at: [f32; 3] = std::array::from_fn(|a| {
                    let first = (4 * brick[a]) as f32 - 1.0 + parts[a] as f32 * 1.3;
                    first.min(dims[a] as f32 - 1.0)
                });
                let mut sum = 0.0;
                let cell = at.map(f32::floor);
                let w: [[f32; 4]; 3] = std::array::from_fn(|a| weights(at[a] - cell[a]));
                for tap in 0..64 {
                    let k = [tap % 4, tap / 4 % 4, tap / 16];
                    let s: [usize; 3] = std::array::from_fn(|a| {
                        // Cells begin at −1, whose first sample is −2.
                        mirrored((cell[a] + 1.0) as usize + k[a], 2, dims[a])
                    });
                    sum += w[0][k[0]]
                        * w[1][k[1]]
                        * w[2][k[2]]
                        * values[(s[2] * ny + s[1]) * nx + s[0]];
                }
                assert!(low - 1e-4 <= sum && sum <= high + 1e-4, "{brick:?} {at:?}: {sum}");
            }
        }
    }

    #[test]
    fn borders_are_mirrored_about_their_samples() {
        let line = |n, pad| (0..n + 2 * pad).map(|i| mirrored(i, pad, n)).collect::<Vec<_>>();
        assert_eq!(line(4, 2), [2, 1, 0, 1, 2, 3, 2, 1]);
        assert_eq!(line(1, 2), [0; 5]);
        assert_eq!(line(2, 3), [1, 0, 1, 0, 1, 0, 1, 0]);
        assert_eq!(line(3, 5)[..6], [1, 0, 1, 2, 1, 0]);
    }

    #[test]
    fn planes_rows_and_boxes_are_left_off_where_a_ticket_says_so() {
        let dims = [96, 97, 98];
        let values = vec![1.0; dims.iter().product()];
        let bricks = dims.map(|n| (n + 1).div_ceil(BOUND_BRICK));
        // Two passes from plane to plane, and one from brick to brick.
        let least = 2 * dims[2] + bricks[2];
        assert_stops("bounds", least, |ticket| {
            Bounds::of(&values, dims, Weighs::Splines, (bricks, [1, 2]), ticket)
        });
        let boxes = |count: usize, size: f64| {
            (0..count).map(move |i| {
                let low = DVec3::from([i % 90, i / 90 % 90, i / 8100].map(|n| n as f64));
                ([low, low + size], [0.0, 1.0])
            })
        };
        let bounds = of(&values, dims, Weighs::Splines);
        for (count, size, least) in [(100_000, 0.0, 100_000 * A_BOX), (800, 90.0, 800 * 22 * 22)] {
            assert_stops("boxes", least / BETWEEN_LOOKS, |ticket| {
                let mut bounds = bounds.clone();
                bounds.set_to_boxes(boxes(count, size), (-1.0, 0.0), -1.0, ticket)
            });
        }
    }
}

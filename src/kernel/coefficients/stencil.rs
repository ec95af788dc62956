//! A kernel on the lattice: what the reconstruction is at the samples themselves.

use std::collections::{BTreeMap, VecDeque};

use super::{Residual, holes, store};
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::kernel::{Kernel, RadialKernel, Separable};

/// Rows that a worker takes at a time between two looks at the ticket.
const ROWS: usize = 8;
/// Kernels of more samples than this are compared with the samples on every n-th slice only.
const EVERY_SLICE_TAPS: usize = 64;

/// h ∗ c at the samples: a kernel's values at integer offsets, normalised to sum to 1.
#[derive(Debug)]
pub(super) struct Stencil {
    /// Greatest offset along an axis.
    radius: usize,
    groups: Vec<Group>,
    /// Offsets at which the kernel is not 0.
    taps: usize,
}

/// Rows of the kernel that have the same values.
#[derive(Debug, Default)]
struct Group {
    /// Offsets (y, z) of the rows.
    offsets: Vec<[isize; 2]>,
    /// Values at offsets 0, ±1, ±2, … along x.
    taps: Vec<f64>,
}

/// Σ of squared and greatest |difference| over some samples.
#[derive(Clone, Copy, Default)]
struct Sum {
    squares: f64,
    greatest: f64,
    count: u64,
}

impl Sum {
    fn add(&mut self, difference: f64) {
        self.squares += difference * difference;
        self.greatest = self.greatest.max(difference.abs());
        self.count += 1;
    }

    fn residual(sums: &[Self], range: f64) -> Residual {
        let total = sums.iter().fold(Self::default(), |a, b| Self {
            squares: a.squares + b.squares,
            greatest: a.greatest.max(b.greatest),
            count: a.count + b.count,
        });
        if total.count == 0 || range == 0.0 {
            return Residual { rms: 0.0, max: 0.0 };
        }
        Residual {
            rms: (total.squares / total.count as f64).sqrt() / range,
            max: total.greatest / range,
        }
    }
}

/// A kernel's value at an offset in samples.
type ValueAt = Box<dyn Fn([isize; 3]) -> f64>;

impl Stencil {
    /// A kernel's values at the lattice's offsets. A single tap for kernels that reach no other
    /// sample, and for those that have no form in space. Products reach less than 3 samples.
    pub(super) fn new(kernel: Kernel, extent: Option<f64>) -> Self {
        let (radius, value): (f64, ValueAt) = if let Some(radial) =
            RadialKernel::new(kernel, extent)
        {
            // Relative to the peak, which no extent takes beyond float64.
            let value = move |o: [isize; 3]| {
                let r = o.iter().map(|&i| (i * i) as f64).sum::<f64>().sqrt();
                radial.relative_value(r)
            };
            (radial.radius(), Box::new(value))
        } else if let Some(separable) = Separable::new(kernel, extent) {
            let value =
                move |o: [isize; 3]| o.iter().map(|&i| separable.value(i as f64)).product::<f64>();
            (separable.radius(), Box::new(value))
        } else {
            (0.0, Box::new(|_| 1.0))
        };
        #[expect(clippy::cast_possible_truncation, reason = "extents were bounded before")]
        let radius = radius.floor() as isize;
        let mut groups: BTreeMap<isize, Group> = BTreeMap::new();
        let (mut sum, mut taps) = (0.0, 0);
        let span = -radius..=radius;
        for z in span.clone() {
            for y in span.clone() {
                let row: Vec<f64> = (0..=radius)
                    .map(|x| value([x, y, z]))
                    .enumerate()
                    .take_while(|&(x, h)| x == 0 || h > 0.0)
                    .map(|(_, h)| h)
                    .collect();
                if row[0] <= 0.0 {
                    continue;
                }
                sum += row[0] + 2.0 * row[1..].iter().sum::<f64>();
                taps += 2 * row.len() - 1;
                // y² + z² names a row of a radial kernel, and of a product that ends within 2.
                let group = groups.entry(y * y + z * z).or_default();
                group.offsets.push([y, z]);
                group.taps = row;
            }
        }
        for tap in groups.values_mut().flat_map(|group| &mut group.taps) {
            *tap /= sum;
        }
        Self { radius: radius.unsigned_abs(), groups: groups.into_values().collect(), taps }
    }

    /// (h ∗ c) along the row (y, z), the lattice mirrored about its border samples; `slice` gives
    /// c's samples at a z.
    fn row<'a>(
        &self,
        slice: &impl Fn(usize) -> &'a [f32],
        dims: [usize; 3],
        [y, z]: [usize; 2],
        padded: &mut Vec<f64>,
        out: &mut [f64],
    ) {
        let [nx, ny, nz] = dims;
        out.fill(0.0);
        for group in &self.groups {
            let reach = group.taps.len() - 1;
            padded.clear();
            padded.resize(nx + 2 * reach, 0.0);
            for &[dy, dz] in &group.offsets {
                let from = mirrored(y, dy, ny) * nx;
                let row = &slice(mirrored(z, dz, nz))[from..][..nx];
                for (sum, &c) in padded[reach..].iter_mut().zip(row) {
                    *sum += f64::from(c);
                }
            }
            for k in 1..=reach {
                let k_signed = k.cast_signed();
                padded[reach - k] = padded[reach + mirrored(0, -k_signed, nx)];
                padded[reach + nx - 1 + k] = padded[reach + mirrored(nx - 1, k_signed, nx)];
            }
            for (to, c) in out.iter_mut().zip(&padded[reach..]) {
                *to += group.taps[0] * c;
            }
            for (k, tap) in group.taps.iter().enumerate().skip(1) {
                let (left, right) = (&padded[reach - k..], &padded[reach + k..]);
                for ((to, l), r) in out.iter_mut().zip(left).zip(right) {
                    *to += tap * (l + r);
                }
            }
        }
    }

    /// What `sample` leaves over the reconstruction from `c`, as a part of `range`. `sample` gives
    /// the sample of an index, or `None` where there is no data to be met.
    pub(super) fn residual(
        &self,
        c: &[f32],
        dims: [usize; 3],
        range: f64,
        sample: impl Fn(usize) -> Option<f32> + Sync,
        ticket: &Ticket,
    ) -> Result<Residual, Cancelled> {
        let [nx, ny, nz] = dims;
        let every = (self.taps / EVERY_SLICE_TAPS).max(1);
        let slice = |z: usize| &c[z * nx * ny..][..nx * ny];
        let rows = nz.div_ceil(every) * ny;
        let sums = parallel::try_list(rows.div_ceil(ROWS), |part| {
            let (mut padded, mut out, mut sum) = (Vec::new(), vec![0.0; nx], Sum::default());
            for row in parallel::part(rows, ROWS, part) {
                ticket.look()?;
                let [y, z] = [row % ny, row / ny * every];
                self.row(&slice, dims, [y, z], &mut padded, &mut out);
                for (x, h_c) in out.iter().enumerate() {
                    if let Some(s) = sample((z * ny + y) * nx + x) {
                        sum.add(f64::from(s) - h_c);
                    }
                }
            }
            Ok::<_, Cancelled>(sum)
        })?;
        Ok(Sum::residual(&sums, range))
    }

    /// One Jacobi sweep c ← c + (s − h ∗ c), in place. Returns what was left before it.
    pub(super) fn sweep(
        &self,
        c: &mut [f32],
        s: &[f32],
        dims: [usize; 3],
        range: f64,
        holes: Option<&[u32]>,
        ticket: &Ticket,
    ) -> Result<Residual, Cancelled> {
        let [nx, ny, nz] = dims;
        let size = nx * ny;
        let mut sums = Vec::new();
        // The slices z − radius … z as they were before the sweep.
        let mut kept: VecDeque<Vec<f32>> = VecDeque::with_capacity(self.radius + 1);
        for z in 0..nz {
            let (done, ahead) = c.split_at_mut((z + 1) * size);
            let current = &mut done[z * size..];
            let mut copy =
                if kept.len() > self.radius { kept.pop_front() } else { None }.unwrap_or_default();
            copy.clear();
            copy.extend_from_slice(current);
            kept.push_back(copy);
            let first = z + 1 - kept.len();
            let slice = |k: usize| -> &[f32] {
                if k > z { &ahead[(k - z - 1) * size..][..size] } else { &kept[k - first] }
            };
            let before = sums.len();
            sums.resize_with(before + ny.div_ceil(ROWS), Sum::default);
            let parts = current.chunks_mut(nx * ROWS).zip(&mut sums[before..]);
            parallel::try_each(parts.enumerate(), |(part, (rows, sum))| {
                let (mut padded, mut out) = (Vec::new(), vec![0.0; nx]);
                for (row, c) in rows.chunks_exact_mut(nx).enumerate() {
                    ticket.look()?;
                    let y = part * ROWS + row;
                    self.row(&slice, dims, [y, z], &mut padded, &mut out);
                    let from = z * size + y * nx;
                    for (x, (c, h_c)) in c.iter_mut().zip(&out).enumerate() {
                        let difference = f64::from(s[from + x]) - h_c;
                        *c = store(f64::from(*c) + difference);
                        if holes.is_none_or(|holes| !holes::contains(holes, from + x)) {
                            sum.add(difference);
                        }
                    }
                }
                Ok::<(), Cancelled>(())
            })?;
        }
        Ok(Sum::residual(&sums, range))
    }
}

/// Index `at` + `offset` of n, mirrored about the first and the last as often as it takes.
fn mirrored(at: usize, offset: isize, n: usize) -> usize {
    if n == 1 {
        return 0;
    }
    let period = 2 * (n - 1);
    let index = (at.cast_signed() + offset).rem_euclid(period.cast_signed()).unsigned_abs();
    if index < n { index } else { period - index }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_are_mirrored_about_the_border_samples() {
        let at = |i: isize, n| mirrored(0, i, n);
        assert_eq!(
            [-3, -2, -1, 0, 1, 2, 3, 4, 5, 6].map(|i| at(i, 4)),
            [3, 2, 1, 0, 1, 2, 3, 2, 1, 0]
        );
        assert_eq!([-5, -1, 0, 1, 2, 7].map(|i| at(i, 2)), [1, 1, 0, 1, 0, 1]);
        assert_eq!([-9, 0, 4].map(|i| at(i, 1)), [0, 0, 0]);
    }

    #[test]
    fn stencils_sum_to_one_and_hold_the_offsets_within_the_radius() {
        for (kernel, extent, taps) in [
            (Kernel::Cubic, None, 19),
            (Kernel::Gaussian, None, 27),
            (Kernel::BSpline, None, 27),
            (Kernel::Linear, None, 1),
            (Kernel::Nearest, None, 1),
            (Kernel::Point, None, 1),
            (Kernel::Cubic, Some(0.5), 1),
            (Kernel::Gaussian, Some(1e-200), 1),
            (Kernel::Cubic, Some(8.0), 2109),
        ] {
            let stencil = Stencil::new(kernel, extent);
            let row = |g: &Group| g.taps[0] + 2.0 * g.taps[1..].iter().sum::<f64>();
            let sum: f64 = stencil.groups.iter().map(|g| row(g) * g.offsets.len() as f64).sum();
            assert!((sum - 1.0).abs() < 1e-13, "{kernel:?} {extent:?}: {sum}");
            assert_eq!(stencil.taps, taps, "{kernel:?} {extent:?}");
        }
    }
}

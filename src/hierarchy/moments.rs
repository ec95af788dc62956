//! Means, spreads and extremes of a volume's values, level by level, whatever the transfer function.
//!
//! As in the classified pyramid, level 0 is the volume itself and is not stored, and a node of level
//! L stands for the 2^L voxels along each axis that really exist.

use crate::core::memory::{self, TooLarge};
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::volume::{Scalar, ScalarVolume};
use crate::with_samples;

/// The greatest magnitude that is stored, less the bias: as of reconstruction coefficients.
const MOST: f64 = 3.3e38;

/// Why there is no [`ScalarPyramid`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScalarPyramidError {
    /// The work was told to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// It does not fit in memory.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}

/// One level of a [`ScalarPyramid`]: arrays of a value a node, x fastest.
///
/// Of a node without data the count is 0, the mean NaN, the spread 0, and low > high.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarLevel {
    /// Nodes along x, y, z.
    pub dims: [usize; 3],
    /// Mean less [`ScalarPyramid::bias`].
    pub mean: Vec<f32>,
    /// Population standard deviation.
    pub spread: Vec<f32>,
    /// Least value less the bias, rounded down to 32 bits: no value of the node is less.
    pub low: Vec<f32>,
    /// Greatest value less the bias, rounded up.
    pub high: Vec<f32>,
    /// Voxels that hold data; 2³² − 1 where there are more, and nodes of that count weigh the same.
    pub count: Vec<u32>,
}

/// Levels 1 and up of a volume's values, finest first.
///
/// Voxels without data (NaN) count as nothing, ±∞ as the ends of the finite range, and values
/// beyond ±3.3e38 of the bias as that.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarPyramid {
    /// Voxels along x, y, z.
    pub dims: [usize; 3],
    /// What was taken off each value before it was rounded to 32 bits: the mean of the volume, so
    /// that values near 1e9 with a spread of 1 keep their differences; of whole numbers a whole
    /// number, so that extremes of 8 and 16 bits stay exact.
    pub bias: f64,
    /// `levels[i]` is level i + 1.
    pub levels: Vec<ScalarLevel>,
}

impl ScalarPyramid {
    /// Every level, up to a single node. A volume of one voxel has one level.
    ///
    /// Takes about 3 bytes a voxel, and 2 more while it is built.
    ///
    /// # Errors
    /// Cancelled, or too little memory.
    pub fn build(volume: &ScalarVolume, ticket: &Ticket) -> Result<Self, ScalarPyramidError> {
        Self::build_levels(volume, usize::MAX, ticket)
    }

    /// The same, at most so many levels; at least one.
    ///
    /// # Errors
    /// Cancelled, or too little memory.
    pub fn build_levels(
        volume: &ScalarVolume,
        at_most: usize,
        ticket: &Ticket,
    ) -> Result<Self, ScalarPyramidError> {
        let dims = volume.lattice.dims;
        let mut level_dims = vec![dims.map(|n| n.div_ceil(2))];
        while level_dims.len() < at_most && level_dims[level_dims.len() - 1] != [1; 3] {
            level_dims.push(level_dims[level_dims.len() - 1].map(|n| n.div_ceil(2)));
        }
        let nodes = |dims: &[usize; 3]| dims.iter().product::<usize>() as u64;
        let held = level_dims.iter().map(nodes).sum::<u64>() * NODE_BYTES as u64;
        // Of two levels at a time, in float64.
        let exact = level_dims.iter().take(2).map(nodes).sum::<u64>() * size_of::<Exact>() as u64;
        memory::require(
            "the means and spreads of the volume",
            held.saturating_add(exact),
            memory::free_bytes(),
        )?;
        let statistics = &volume.statistics;
        let whole = volume.samples.scalar_type().is_integer();
        let bias = if whole { statistics.mean.round() } else { statistics.mean };
        let range = [statistics.min, statistics.max];
        let (first, mut exact) = with_samples!(&*volume.samples, values => {
            first_level(values, dims, range, bias, ticket)
        })?;
        let mut levels = vec![first];
        for &dims in &level_dims[1..] {
            let (next, theirs) = next_level(&levels[levels.len() - 1], &exact, dims, ticket)?;
            levels.push(next);
            exact = theirs;
        }
        Ok(Self { dims, bias, levels })
    }

    /// Bytes held.
    pub fn size_bytes(&self) -> usize {
        self.levels.iter().map(|level| level.mean.len() * NODE_BYTES).sum()
    }
}

/// Bytes of a node of a [`ScalarLevel`].
const NODE_BYTES: usize = 4 * size_of::<f32>() + size_of::<u32>();

/// Mean less the bias and variance about it: what 32 bits would spoil.
type Exact = [f64; 2];

/// A node on its way: what is merged, and what is kept.
#[derive(Clone, Copy)]
struct Moments {
    count: u32,
    mean: f64,
    variance: f64,
    low: f32,
    high: f32,
}

impl Moments {
    const NOTHING: Self =
        Self { count: 0, mean: 0.0, variance: 0.0, low: f32::INFINITY, high: f32::NEG_INFINITY };

    /// Chan's merge of counts, means and sums of squared deviations, these divided by the counts:
    /// stable however small the spread.
    fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let (mine, theirs) = (f64::from(self.count), f64::from(other.count));
        let delta = other.mean - self.mean;
        let weight = theirs / (mine + theirs);
        self.mean += delta * weight;
        self.variance += (other.variance - self.variance + delta * delta * (1.0 - weight)) * weight;
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.count = self.count.saturating_add(other.count);
    }
}

/// One layer of nodes of a level that is being filled.
struct Layer<'a> {
    mean: &'a mut [f32],
    spread: &'a mut [f32],
    low: &'a mut [f32],
    high: &'a mut [f32],
    count: &'a mut [u32],
    exact: &'a mut [Exact],
}

impl Layer<'_> {
    fn put(&mut self, at: usize, node: &Moments) {
        let Moments { count, mean, variance, low, high } = *node;
        let is_empty = count == 0;
        #[expect(clippy::cast_possible_truncation, reason = "within ±MOST; rounded once")]
        {
            self.mean[at] = if is_empty { f32::NAN } else { mean as f32 };
            self.spread[at] = variance.max(0.0).sqrt() as f32;
        }
        self.low[at] = low;
        self.high[at] = high;
        self.count[at] = count;
        self.exact[at] = [mean, variance];
    }
}

/// A level of nothing, filled layer by layer of constant z, in parallel.
fn filled(
    dims: [usize; 3],
    ticket: &Ticket,
    fill: impl Fn(usize, &mut Layer) -> Result<(), Cancelled> + Sync,
) -> Result<(ScalarLevel, Vec<Exact>), Cancelled> {
    let nodes = dims.iter().product();
    let mut level = ScalarLevel {
        dims,
        mean: vec![0.0; nodes],
        spread: vec![0.0; nodes],
        low: vec![0.0; nodes],
        high: vec![0.0; nodes],
        count: vec![0; nodes],
    };
    let mut exact = vec![[0.0; 2]; nodes];
    let layer = dims[0] * dims[1];
    let mut counts = level.count.chunks_mut(layer);
    let mut exacts = exact.chunks_mut(layer);
    let means = level.mean.chunks_mut(layer).zip(level.spread.chunks_mut(layer));
    let ranges = level.low.chunks_mut(layer).zip(level.high.chunks_mut(layer));
    let layers: Vec<Layer> = means
        .zip(ranges)
        .filter_map(|((mean, spread), (low, high))| {
            let (count, exact) = (counts.next()?, exacts.next()?);
            Some(Layer { mean, spread, low, high, count, exact })
        })
        .collect();
    parallel::try_each(layers.into_iter().enumerate(), |(z, mut layer)| {
        if ticket.is_cancelled() {
            return Err(Cancelled);
        }
        fill(z, &mut layer)
    })?;
    Ok((level, exact))
}

fn first_level<T: Scalar>(
    values: &[T],
    dims: [usize; 3],
    range: [f64; 2],
    bias: f64,
    ticket: &Ticket,
) -> Result<(ScalarLevel, Vec<Exact>), Cancelled> {
    let coarse = dims.map(|n| n.div_ceil(2));
    // NaN stays NaN.
    let relative = |value: T| (value.to_f64().clamp(range[0], range[1]) - bias).clamp(-MOST, MOST);
    filled(coarse, ticket, |cz, layer| {
        ticket.checkpoint(cz as u64, coarse[2] as u64)?;
        for cy in 0..coarse[1] {
            let rows = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dy, dz)| {
                let (y, z) = (2 * cy + dy, 2 * cz + dz);
                // Beyond the border: no voxels.
                let is_real = y < dims[1] && z < dims[2];
                let width = if is_real { dims[0] } else { 0 };
                &values[if is_real { (z * dims[1] + y) * dims[0] } else { 0 }..][..width]
            });
            for cx in 0..coarse[0] {
                let mut held = [0.0; 8];
                let mut count = 0;
                for row in rows {
                    for &value in row.get(2 * cx..(2 * cx + 2).min(row.len())).unwrap_or(&[]) {
                        let value = relative(value);
                        if !value.is_nan() {
                            held[count] = value;
                            count += 1;
                        }
                    }
                }
                layer.put(cy * coarse[0] + cx, &of_few(&held[..count]));
            }
        }
        Ok(())
    })
}

/// Moments of the values of one node of level 1, in two passes.
fn of_few(values: &[f64]) -> Moments {
    if values.is_empty() {
        return Moments::NOTHING;
    }
    let (mut sum, mut low, mut high) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
    for &value in values {
        sum += value;
        low = low.min(value);
        high = high.max(value);
    }
    let mean = sum / values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    let variance = squares / values.len() as f64;
    #[expect(clippy::cast_possible_truncation, reason = "eight at most; within ±MOST")]
    let (count, nearest_low, nearest_high) = (values.len() as u32, low as f32, high as f32);
    let low = if f64::from(nearest_low) > low { nearest_low.next_down() } else { nearest_low };
    let high = if f64::from(nearest_high) < high { nearest_high.next_up() } else { nearest_high };
    Moments { count, mean, variance, low, high }
}

fn next_level(
    fine: &ScalarLevel,
    exact: &[Exact],
    coarse: [usize; 3],
    ticket: &Ticket,
) -> Result<(ScalarLevel, Vec<Exact>), Cancelled> {
    let dims = fine.dims;
    filled(coarse, ticket, |cz, layer| {
        for i in 0..coarse[0] * coarse[1] {
            let corner = [2 * (i % coarse[0]), 2 * (i / coarse[0]), 2 * cz];
            let mut merged = Moments::NOTHING;
            for bit in 0..8 {
                let at =
                    [corner[0] + (bit & 1), corner[1] + (bit >> 1 & 1), corner[2] + (bit >> 2)];
                if at[0] >= dims[0] || at[1] >= dims[1] || at[2] >= dims[2] {
                    continue;
                }
                let child = (at[2] * dims[1] + at[1]) * dims[0] + at[0];
                let [mean, variance] = exact[child];
                let (low, high) = (fine.low[child], fine.high[child]);
                let count = fine.count[child];
                merged.merge(&Moments { count, mean, variance, low, high });
            }
            layer.put(i, &merged);
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};

    fn volume(dims: [usize; 3], samples: Samples) -> ScalarVolume {
        ScalarVolume::from_samples("test", Lattice::unit(dims), samples).unwrap()
    }

    fn pyramid(dims: [usize; 3], samples: Samples) -> ScalarPyramid {
        ScalarPyramid::build(&volume(dims, samples), &Ticket::new()).unwrap()
    }

    /// Uniform in 0..1 (a linear congruential generator).
    fn noise(n: usize) -> Vec<f64> {
        let mut seed = 5_u32;
        (0..n)
            .map(|_| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(seed >> 8) / f64::from(1 << 24)
            })
            .collect()
    }

    /// Every value of a node, NaN left out, in float64 and relative to `origin`.
    fn held(
        values: &[f64],
        dims: [usize; 3],
        level: usize,
        at: [usize; 3],
        origin: f64,
    ) -> Vec<f64> {
        let span = |a: usize| at[a] << level..((at[a] + 1) << level).min(dims[a]);
        let mut found = Vec::new();
        for z in span(2) {
            for y in span(1) {
                for x in span(0) {
                    found.push(values[(z * dims[1] + y) * dims[0] + x] - origin);
                }
            }
        }
        found.retain(|v| !v.is_nan());
        found
    }

    /// Holds every node of every level to sums over its voxels. `tolerance` is absolute.
    #[track_caller]
    fn agrees(dims: [usize; 3], values: &[f64], pyramid: &ScalarPyramid, tolerance: f64) {
        let mut expected_dims = dims;
        for (i, level) in pyramid.levels.iter().enumerate() {
            expected_dims = expected_dims.map(|n| n.div_ceil(2));
            assert_eq!(level.dims, expected_dims, "{dims:?}");
            for node in 0..level.mean.len() {
                let [nx, ny, _] = level.dims;
                let at = [node % nx, node / nx % ny, node / (nx * ny)];
                let held = held(values, dims, i + 1, at, pyramid.bias);
                let name = format!("{dims:?} level {} {at:?}", i + 1);
                assert_eq!(level.count[node] as usize, held.len(), "{name}");
                if held.is_empty() {
                    assert!(level.mean[node].is_nan() && level.spread[node] == 0.0, "{name}");
                    assert!(level.low[node] > level.high[node], "{name}");
                    continue;
                }
                let n = held.len() as f64;
                let mean = held.iter().sum::<f64>() / n;
                let spread = (held.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
                let low = held.iter().copied().fold(f64::INFINITY, f64::min);
                let high = held.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                for (what, found, expected) in [
                    ("mean", level.mean[node], mean),
                    ("spread", level.spread[node], spread),
                    ("low", level.low[node], low),
                    ("high", level.high[node], high),
                ] {
                    let off = (f64::from(found) - expected).abs();
                    assert!(off <= tolerance, "{name}: {what} {found} for {expected}");
                }
                let bounded =
                    f64::from(level.low[node]) <= low && f64::from(level.high[node]) >= high;
                assert!(bounded, "{name}");
            }
        }
        assert_eq!(expected_dims, [1; 3], "{dims:?}");
    }

    const DIMS: [[usize; 3]; 8] = [
        [16, 16, 16],
        [19, 9, 10],
        [33, 2, 5],
        [1, 13, 6],
        [7, 1, 12],
        [9, 4, 1],
        [1, 1, 7],
        [1, 1, 1],
    ];

    #[test]
    fn nodes_are_the_moments_of_their_real_voxels_whatever_the_sizes() {
        for dims in DIMS {
            let values = noise(dims.iter().product());
            // Measured: 4e-8, single precision's rounding of numbers under 1.
            agrees(dims, &values, &pyramid(dims, Samples::Float64(values.clone())), 1e-7);
        }
    }

    #[test]
    fn large_values_of_spread_1_have_the_spread_that_they_have() {
        let dims = [19, 9, 10];
        for offset in [1e6, 1e9, -1e9] {
            let values: Vec<f64> = noise(1710).into_iter().map(|v| v * 3.5 + offset).collect();
            let built = pyramid(dims, Samples::Float64(values.clone()));
            // Measured: 1.2e-7; float64 near 1e9 is itself 1.2e-7 apart.
            agrees(dims, &values, &built, 5e-7);
            let root = &built.levels[built.levels.len() - 1];
            assert!((root.spread[0] - 1.01).abs() < 0.02, "{offset}: {}", root.spread[0]);
        }
    }

    #[test]
    fn two_far_apart_halves_keep_their_own_spreads() {
        // The bias is near neither: means have to be merged in double precision.
        let dims = [16, 8, 8];
        let values: Vec<f64> = noise(1024)
            .into_iter()
            .enumerate()
            .map(|(i, v)| if i % 16 < 8 { v } else { v + 1e6 })
            .collect();
        let built = pyramid(dims, Samples::Float64(values.clone()));
        for (i, level) in built.levels.iter().enumerate().take(3) {
            for (node, &spread) in level.spread.iter().enumerate() {
                let [nx, ny, _] = level.dims;
                let at = [node % nx, node / nx % ny, node / (nx * ny)];
                let held = held(&values, dims, i + 1, at, built.bias);
                let n = held.len() as f64;
                let mean = held.iter().sum::<f64>() / n;
                let expected = (held.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
                // Measured: 3e-8; from means in single precision it would be 1e-2.
                assert!((f64::from(spread) - expected).abs() < 1e-6, "{spread} for {expected}");
            }
        }
    }

    #[test]
    fn nan_counts_as_nothing_and_nodes_of_nan_alone_are_empty() {
        let dims = [19, 9, 10];
        let mut values = noise(1710);
        for (i, value) in values.iter_mut().enumerate() {
            if i % 19 < 4 || i % 3 == 0 {
                *value = f64::NAN;
            }
        }
        let built = pyramid(dims, Samples::Float64(values.clone()));
        agrees(dims, &values, &built, 1e-7);
        assert!(built.levels[1].count.contains(&0), "the case is there");
    }

    #[test]
    fn whole_numbers_of_16_bits_have_exact_extremes() {
        let dims = [13, 6, 9];
        let codes: Vec<u16> = noise(702).into_iter().map(|v| (v * 65_535.0) as u16).collect();
        let values: Vec<f64> = codes.iter().map(|&v| f64::from(v)).collect();
        let built = pyramid(dims, Samples::UInt16(codes));
        assert_eq!(built.bias.fract(), 0.0);
        for (i, level) in built.levels.iter().enumerate() {
            for node in 0..level.low.len() {
                let [nx, ny, _] = level.dims;
                let at = [node % nx, node / nx % ny, node / (nx * ny)];
                let held = held(&values, dims, i + 1, at, 0.0);
                let low = held.iter().copied().fold(f64::INFINITY, f64::min);
                let high = held.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                assert_eq!(f64::from(level.low[node]) + built.bias, low);
                assert_eq!(f64::from(level.high[node]) + built.bias, high);
            }
        }
        // Measured: 1.9e-3, single precision's rounding of numbers under 65 536.
        agrees(dims, &values, &built, 4e-3);
    }

    #[test]
    fn one_bright_voxel_is_the_greatest_value_of_every_node_above_it() {
        let dims = [33, 17, 20];
        let bright = [31, 5, 7];
        let mut codes = vec![0_u8; 33 * 17 * 20];
        codes[(bright[2] * 17 + bright[1]) * 33 + bright[0]] = 255;
        let built = pyramid(dims, Samples::UInt8(codes));
        for (i, level) in built.levels.iter().enumerate() {
            let [nx, ny, _] = level.dims;
            let [x, y, z] = bright.map(|n| n >> (i + 1));
            let above = (z * ny + y) * nx + x;
            for node in 0..level.high.len() {
                let high = f64::from(level.high[node]) + built.bias;
                assert_eq!(high, if node == above { 255.0 } else { 0.0 }, "level {}", i + 1);
                assert_eq!(level.spread[node] > 0.0, node == above, "level {}", i + 1);
            }
        }
    }

    #[test]
    fn infinities_count_as_the_ends_and_huge_values_stay_finite() {
        let infinite = [f64::INFINITY, 3.0, f64::NEG_INFINITY, 1.0];
        let built = pyramid([4, 1, 1], Samples::Float64(infinite.to_vec()));
        agrees([4, 1, 1], &[3.0, 3.0, 1.0, 1.0], &built, 1e-7);
        let huge = pyramid([2, 2, 1], Samples::Float64(vec![f64::MAX, f64::MIN, 0.0, 1.0]));
        let root = &huge.levels[0];
        assert!(root.spread[0].is_finite() && root.high[0].is_finite() && root.low[0].is_finite());
    }

    #[test]
    fn only_as_many_levels_are_made_as_were_asked_for() {
        let volume = volume([19, 9, 10], Samples::Float64(noise(1710)));
        let ticket = Ticket::new();
        let whole = ScalarPyramid::build(&volume, &ticket).unwrap();
        let two = ScalarPyramid::build_levels(&volume, 2, &ticket).unwrap();
        assert_eq!((whole.levels.len(), two.levels.len()), (5, 2));
        assert_eq!(two.levels[..], whole.levels[..2]);
        assert_eq!(two.size_bytes(), (10 * 5 * 5 + 5 * 3 * 3) * 20);
    }

    #[test]
    fn a_cancelled_build_stops() {
        let ticket = Ticket::new();
        ticket.cancel();
        let volume = volume([19, 9, 10], Samples::Float64(noise(1710)));
        let stopped = ScalarPyramid::build(&volume, &ticket);
        assert_eq!(stopped, Err(ScalarPyramidError::Cancelled(Cancelled)));
    }
}

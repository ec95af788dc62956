//! What is known of a field's values: extremes, mean, histogram, and extremes brick by brick.

use super::Samples;
use super::samples::Scalar;
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::with_samples;

/// Number of equal bins between the least and the greatest finite value.
pub const HISTOGRAM_BINS: usize = 256;
/// Edge of a [`Bricks`] brick, samples.
pub const BRICK: usize = 8;
/// Samples a worker takes at a time between two looks at the ticket.
const CHUNK: usize = 1 << 18;
/// Number of [`Statistics::quantiles`].
pub const QUANTILES: usize = 1025;
/// Samples that the quantiles are taken from: all of a smaller field.
const QUANTILE_SAMPLES: usize = 1 << 17;

/// Of the finite values of a field, in float64.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// Least finite value; 0 where there is none.
    pub min: f64,
    /// Greatest finite value; 0 where there is none.
    pub max: f64,
    /// Mean of the finite values; 0 where there is none.
    pub mean: f64,
    /// Number of finite values.
    pub finite_count: u64,
    /// Number of NaN.
    pub nan_count: u64,
    /// Number of ±∞.
    pub infinite_count: u64,
    /// Counts in [`HISTOGRAM_BINS`] equal bins over min..=max. A constant field fills the first.
    pub histogram: Vec<u64>,
    /// [`QUANTILES`] values that divide the finite samples evenly, least first, from an even
    /// subsample of 131 072: unlike the histogram, no outlier can spoil them. Empty where there is
    /// no finite value.
    pub quantiles: Vec<f64>,
    /// The part (0..=1) of a field, where it changes, that is as smooth as rounding to 8 bits leaves what is smooth: second
    /// differences of at most 1.5/255 of the range. From the same subsample, without the commonest value.
    pub smooth_part: f64,
}

/// Sums over one chunk; merged pairwise, so the result does not depend on the thread count.
#[derive(Clone, Copy)]
struct Partial {
    min: f64,
    max: f64,
    mean: f64,
    finite: u64,
    nan: u64,
    infinite: u64,
}

impl Partial {
    const EMPTY: Self = Self {
        min: f64::INFINITY,
        max: f64::NEG_INFINITY,
        mean: 0.0,
        finite: 0,
        nan: 0,
        infinite: 0,
    };

    fn of<T: Scalar>(values: &[T]) -> Self {
        let mut part = Self::EMPTY;
        let mut scaled_sum = 0.0;
        // Halving both the count and each term keeps a sum of values near f64::MAX finite.
        for value in values.iter().map(|v| v.to_f64()) {
            if value.is_finite() {
                part.min = part.min.min(value);
                part.max = part.max.max(value);
                scaled_sum += value / CHUNK as f64;
                part.finite += 1;
            } else if value.is_nan() {
                part.nan += 1;
            } else {
                part.infinite += 1;
            }
        }
        if part.finite > 0 {
            part.mean = scaled_sum * (CHUNK as f64 / part.finite as f64);
        }
        part
    }

    fn merge(self, other: Self) -> Self {
        let finite = self.finite + other.finite;
        let weight = if finite == 0 { 0.0 } else { other.finite as f64 / finite as f64 };
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            mean: self.mean * (1.0 - weight) + other.mean * weight,
            finite,
            nan: self.nan + other.nan,
            infinite: self.infinite + other.infinite,
        }
    }
}

impl Statistics {
    /// One pass for extremes and mean, one for the histogram.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn of(samples: &Samples, ticket: &Ticket) -> Result<Self, Cancelled> {
        with_samples!(samples, values => Self::of_values(values, None, ticket))
    }

    /// The same of samples of something that reaches from a least to a greatest value, neither of which need be among them. What
    /// lies beyond, as sums of functions may between samples, counts as the nearer of the two.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn between(samples: &Samples, range: [f64; 2], ticket: &Ticket) -> Result<Self, Cancelled> {
        with_samples!(samples, values => Self::of_values(values, Some(range), ticket))
    }

    fn of_values<T: Scalar>(
        values: &[T],
        range: Option<[f64; 2]>,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let parts = parallel::try_list(values.len().div_ceil(CHUNK), |part| {
            let chunk = &values[parallel::part(values.len(), CHUNK, part)];
            if ticket.is_cancelled() { Err(Cancelled) } else { Ok(Partial::of(chunk)) }
        })?;
        let mut total = parts.into_iter().fold(Partial::EMPTY, Partial::merge);
        if let Some([low, high]) = range {
            (total.min, total.max, total.mean) = (low, high, total.mean.clamp(low, high));
        }
        if total.finite == 0 {
            return Ok(Self {
                min: 0.0,
                max: 0.0,
                mean: 0.0,
                finite_count: 0,
                nan_count: total.nan,
                infinite_count: total.infinite,
                histogram: vec![0; HISTOGRAM_BINS],
                quantiles: Vec::new(),
                smooth_part: 0.0,
            });
        }
        let bin = Binning::new(total.min, total.max);
        let histogram = {
            let count = |counts: &mut Vec<u64>, chunk: &[T]| {
                if ticket.is_cancelled() {
                    return Err(Cancelled);
                }
                for value in chunk.iter().map(|v| v.to_f64()).filter(|v| v.is_finite()) {
                    counts[bin.of(value)] += 1;
                }
                Ok(())
            };
            let none = || vec![0; HISTOGRAM_BINS];
            parallel::try_summed(values.chunks(CHUNK), none, count, parallel::add_up)?
        };
        Ok(Self {
            min: total.min,
            max: total.max,
            mean: total.mean,
            finite_count: total.finite,
            nan_count: total.nan,
            infinite_count: total.infinite,
            smooth_part: smooth_part(values, &bin, &histogram),
            histogram,
            quantiles: quantiles(values, [total.min, total.max]),
        })
    }

    /// The value below which `fraction` (0..=1) of a subsample lies: coarser in rank than
    /// [`Statistics::percentile`], but unharmed by outliers. 0 where nothing is finite.
    pub fn quantile(&self, fraction: f64) -> f64 {
        let Some(last) = self.quantiles.len().checked_sub(1) else { return 0.0 };
        let x = fraction.clamp(0.0, 1.0) * last as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=last")]
        let index = (x as usize).min(last.saturating_sub(1));
        let f = x - index as f64;
        self.quantiles[index] * (1.0 - f) + self.quantiles[index + 1] * f
    }

    /// The value below which `fraction` (0..=1) of the finite values lie, to within one bin.
    pub fn percentile(&self, fraction: f64) -> f64 {
        if self.finite_count == 0 || self.max == self.min {
            return self.min;
        }
        let wanted = fraction.clamp(0.0, 1.0) * self.finite_count as f64;
        let mut below = 0.0;
        for (bin, &count) in self.histogram.iter().enumerate() {
            let count = count as f64;
            if count > 0.0 && below + count >= wanted {
                let within = ((wanted - below) / count).clamp(0.0, 1.0);
                return self.value_at((bin as f64 + within) / HISTOGRAM_BINS as f64);
            }
            below += count;
        }
        self.max
    }

    /// How many samples are in the histogram's bin of a value; 0 outside the range, and for NaN.
    pub fn count_near(&self, value: f64) -> u64 {
        let is_inside = self.finite_count > 0 && (self.min..=self.max).contains(&value);
        if !is_inside {
            return 0;
        }
        self.histogram[Binning::new(self.min, self.max).of(value)]
    }

    /// The value at a fraction 0..=1 of the range.
    pub fn value_at(&self, fraction: f64) -> f64 {
        // Not min + f·(max − min): that overflows for ±1e308.
        self.min * (1.0 - fraction) + self.max * fraction
    }
}

/// Which histogram bin a value falls in.
struct Binning {
    min: f64,
    half_range: f64,
}

impl Binning {
    fn new(min: f64, max: f64) -> Self {
        Self { min, half_range: max / 2.0 - min / 2.0 }
    }

    fn of(&self, value: f64) -> usize {
        if self.half_range == 0.0 {
            return 0;
        }
        let fraction = (value / 2.0 - self.min / 2.0) / self.half_range;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=1 × 256")]
        let bin = (fraction * HISTOGRAM_BINS as f64) as usize;
        bin.min(HISTOGRAM_BINS - 1)
    }
}

/// Sorted values at even ranks of an even subsample of the finite values, between two.
fn quantiles<T: Scalar>(values: &[T], [low, high]: [f64; 2]) -> Vec<f64> {
    let mut sample: Vec<f64> = subsample(values.len())
        .map(|place| values[place].to_f64())
        .filter(|v| v.is_finite())
        .map(|v| v.clamp(low, high))
        .collect();
    if sample.is_empty() {
        // Finite values so rare that the subsample missed them all.
        let finite = values.iter().map(|v| v.to_f64()).filter(|v| v.is_finite());
        sample.extend(finite.map(|v| v.clamp(low, high)).take(QUANTILE_SAMPLES));
    }
    sample.sort_unstable_by(f64::total_cmp);
    let last = (sample.len() - 1) as f64;
    (0..QUANTILES)
        .map(|i| sample[(last * i as f64 / (QUANTILES - 1) as f64).round() as usize])
        .collect()
}

/// [`Statistics::smooth_part`] of samples with this histogram.
fn smooth_part<T: Scalar>(values: &[T], bin: &Binning, histogram: &[u64]) -> f64 {
    let commonest = (0..histogram.len()).max_by_key(|&bin| histogram[bin]);
    let most = 3.0 * bin.half_range / 255.0;
    let (mut smooth, mut all) = (0_u32, 0_u32);
    for place in subsample(values.len()) {
        let Some([before, at, after]) = place
            .checked_sub(1)
            .and_then(|first| values.get(first..first + 3))
            .map(|near| [0, 1, 2].map(|i| near[i].to_f64()))
        else {
            continue;
        };
        let [first, next] = [at - before, after - at];
        let changes = first != 0.0 || next != 0.0;
        let second = next - first;
        if second.is_finite() && changes && Some(bin.of(at)) != commonest {
            all += 1;
            smooth += u32::from(second.abs() <= most);
        }
    }
    f64::from(smooth) / f64::from(all.max(1))
}

/// Places of an even subsample of [`QUANTILE_SAMPLES`] of `len` samples, or of all.
fn subsample(len: usize) -> impl Iterator<Item = usize> {
    let count = len.min(QUANTILE_SAMPLES);
    (0..count).map(move |i| {
        // One sample a stratum, at a scrambled place in it, so that rows do not alias.
        let (start, end) = (stratum(i, count, len), stratum(i + 1, count, len));
        let scrambled = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 33;
        start + scrambled as usize % (end - start)
    })
}

/// Where stratum `i` of `count` begins among `len` samples.
fn stratum(i: usize, count: usize, len: usize) -> usize {
    (i as u128 * len as u128 / count as u128) as usize
}

/// Least and greatest value of each brick of [`BRICK`]³ samples, for skipping what cannot show.
///
/// NaN counts as nothing; ±∞ as the ends of the scale. A brick of NaN alone is empty: min > max.
#[derive(Debug, Clone, PartialEq)]
pub struct Bricks {
    /// Bricks along x, y, z.
    pub dims: [usize; 3],
    /// (min, max) of each brick, x fastest.
    pub ranges: Vec<[f64; 2]>,
    /// Which bricks hold NaN, in the same order; empty where none does.
    holes: Vec<bool>,
}

impl Bricks {
    /// Whether a brick holds NaN.
    pub fn has_holes(&self, brick: usize) -> bool {
        self.holes.get(brick).is_some_and(|is| *is)
    }

    /// Reads every sample once.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn of(samples: &Samples, dims: [usize; 3], ticket: &Ticket) -> Result<Self, Cancelled> {
        with_samples!(samples, values => Self::of_values(values, dims, ticket))
    }

    fn of_values<T: Scalar>(
        values: &[T],
        dims: [usize; 3],
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let bricks = dims.map(|n| n.div_ceil(BRICK));
        let layer = bricks[0] * bricks[1];
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; layer * bricks[2]];
        let mut holes = vec![false; ranges.len()];
        let layers = ranges.chunks_mut(layer).zip(holes.chunks_mut(layer));
        parallel::try_each(layers.enumerate(), |(bz, (ranges, holes))| {
            for z in bz * BRICK..((bz + 1) * BRICK).min(dims[2]) {
                if ticket.is_cancelled() {
                    return Err(Cancelled);
                }
                for y in 0..dims[1] {
                    let row = &values[(z * dims[1] + y) * dims[0]..][..dims[0]];
                    let ranges = &mut ranges[y / BRICK * bricks[0]..][..bricks[0]];
                    let holes = &mut holes[y / BRICK * bricks[0]..][..bricks[0]];
                    let row = holes.iter_mut().zip(row.chunks(BRICK));
                    for (range, (hole, run)) in ranges.iter_mut().zip(row) {
                        for value in run.iter().map(|v| v.to_f64()) {
                            // `min` and `max` of f64 pass NaN over.
                            range[0] = range[0].min(value);
                            range[1] = range[1].max(value);
                            *hole |= value.is_nan();
                        }
                    }
                }
            }
            Ok(())
        })?;
        if !holes.contains(&true) {
            holes = Vec::new();
        }
        Ok(Self { dims: bricks, ranges, holes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(samples: Samples) -> Statistics {
        Statistics::of(&samples, &Ticket::new()).unwrap()
    }

    #[test]
    fn extremes_mean_and_counts_pass_over_what_is_not_finite() {
        let s = of(Samples::Float64(vec![1.0, f64::NAN, 5.0, f64::INFINITY, -2.0, f64::NAN]));
        assert_eq!((s.min, s.max), (-2.0, 5.0));
        assert!((s.mean - 4.0 / 3.0).abs() < 1e-12);
        assert_eq!((s.finite_count, s.nan_count, s.infinite_count), (3, 2, 1));
        assert_eq!(s.histogram.iter().sum::<u64>(), 3);
    }

    #[test]
    fn huge_values_neither_overflow_the_mean_nor_the_histogram() {
        let s = of(Samples::Float64(vec![f64::MAX, f64::MIN, f64::MAX, f64::MIN]));
        assert_eq!(s.mean, 0.0);
        assert_eq!((s.histogram[0], s.histogram[HISTOGRAM_BINS - 1]), (2, 2));
        assert!(s.percentile(0.5).is_finite());
    }

    #[test]
    fn percentiles_of_a_ramp_are_its_fractions() {
        let s = of(Samples::UInt16((0..10_000).collect()));
        for p in [0.0, 0.01, 0.25, 0.5, 0.99, 1.0] {
            assert!((s.percentile(p) - p * 9999.0).abs() < 40.0, "{p}: {}", s.percentile(p));
        }
    }

    #[test]
    fn quantiles_are_unharmed_by_one_outlier() {
        let mut values: Vec<f32> = (0..300_000).map(|i| (i % 1000) as f32).collect();
        values[77] = 1e30;
        values[78] = f32::NAN;
        let s = of(Samples::Float32(values));
        for p in [0.01, 0.25, 0.5, 0.9, 0.99] {
            assert!((s.quantile(p) - p * 999.0).abs() < 12.0, "{p}: {}", s.quantile(p));
        }
        assert_eq!(s.quantiles.len(), QUANTILES);
        assert!(s.quantiles.is_sorted());
    }

    #[test]
    fn what_lies_beyond_a_range_counts_as_its_nearer_end() {
        let samples = Samples::Float32(vec![-7.0, 0.25, 0.5, 9.0, f32::NAN]);
        let found = Statistics::between(&samples, [0.0, 1.0], &Ticket::new()).unwrap();
        assert_eq!((found.min, found.max, found.finite_count, found.nan_count), (0.0, 1.0, 4, 1));
        assert_eq!((found.histogram[0], found.histogram[255]), (1, 1));
        assert_eq!((found.quantile(0.0), found.quantile(1.0)), (0.0, 1.0));
        assert!((0.0..=1.0).contains(&found.mean));
    }

    #[test]
    fn a_smooth_field_is_one_in_8_bits_too_and_noise_is_none() {
        let part = |value: &dyn Fn(f64) -> f64| {
            of(Samples::UInt8((0..60_000).map(|i| value(f64::from(i)).round() as u8).collect()))
                .smooth_part
        };
        let wave = |x: f64| 127.0 * (1.0 + (x / 30.0).sin());
        assert!(part(&wave) > 0.8, "{}", part(&wave));
        let noisy = |x: f64| (wave(x) + 12.0 * (x * x).sin()).clamp(0.0, 255.0);
        assert!(part(&noisy) < 0.2, "{}", part(&noisy));
        // Of steps, what is flat tells nothing.
        let steps = |x: f64| (x / 10.0).floor() * 37.0 % 200.0;
        assert!(part(&steps) < 0.1, "{}", part(&steps));
        assert_eq!(part(&|_| 7.0), 0.0);
    }

    #[test]
    fn a_constant_field_has_itself_for_every_percentile() {
        let s = of(Samples::UInt8(vec![7; 100]));
        assert_eq!((s.min, s.max, s.mean, s.percentile(0.3)), (7.0, 7.0, 7.0, 7.0));
        assert_eq!(s.histogram[0], 100);
    }

    #[test]
    fn means_of_many_chunks_agree_with_the_closed_form() {
        let n = 3 * CHUNK + 17;
        let s = of(Samples::UInt32((0..n).map(|i| u32::try_from(i).unwrap()).collect()));
        assert!((s.mean - (n as f64 - 1.0) / 2.0).abs() < 1e-6, "{}", s.mean);
    }

    #[test]
    fn bricks_bound_every_sample_of_an_odd_grid() {
        let dims = [19, 9, 10];
        let values: Vec<f32> = (0..dims.iter().product::<usize>())
            .map(|i| if i % 7 == 0 { f32::NAN } else { ((i * 7919) % 1000) as f32 })
            .collect();
        let bricks = Bricks::of(&Samples::Float32(values.clone()), dims, &Ticket::new()).unwrap();
        assert_eq!(bricks.dims, [3, 2, 2]);
        assert!((0..12).all(|brick| bricks.has_holes(brick)));
        for (i, &v) in values.iter().enumerate().filter(|(_, v)| !v.is_nan()) {
            let (x, y, z) = (i % 19, i / 19 % 9, i / (19 * 9));
            let range = bricks.ranges[(z / 8 * 2 + y / 8) * 3 + x / 8];
            assert!(range[0] <= f64::from(v) && f64::from(v) <= range[1]);
        }
    }

    #[test]
    fn bricks_with_nan_are_known() {
        let dims = [19, 9, 10];
        let mut values = vec![1.0_f32; dims.iter().product()];
        let of = |values: &[f32]| {
            Bricks::of(&Samples::Float32(values.to_vec()), dims, &Ticket::new()).unwrap()
        };
        assert!(!(0..12).any(|brick| of(&values).has_holes(brick)));
        // At 17, 8, 3: brick 2, 1, 0.
        values[(3 * 9 + 8) * 19 + 17] = f32::NAN;
        let bricks = of(&values);
        let found: Vec<usize> = (0..12).filter(|&brick| bricks.has_holes(brick)).collect();
        assert_eq!(found, [5]);
        assert_eq!(bricks.ranges[5], [1.0; 2]);
    }

    #[test]
    fn a_cancelled_count_stops() {
        let ticket = Ticket::new();
        ticket.cancel();
        assert_eq!(Statistics::of(&Samples::UInt8(vec![1; 10]), &ticket), Err(Cancelled));
    }
}

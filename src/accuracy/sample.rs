//! A picture's error from some of its pixels, and how sure that is.

use super::{CompareError, psnr_from_rmse, sweep::SampledError};

/// Pixels of a picture, one at random in each cell of a grid over it.
#[derive(Debug, Clone, PartialEq)]
pub struct StratifiedPixels {
    /// Columns and rows of the pixels, from the top left.
    pub pixels: Vec<[u32; 2]>,
    /// Share of the picture that each stands for; they sum to 1.
    pub weights: Vec<f64>,
}

/// Resamples of the bootstrap.
const RESAMPLES: usize = 1000;
/// Share of them that the interval leaves out at each end.
const TAIL: f64 = 0.025;

/// Squared errors that differ by less than this share of them are equal but for their rounding.
const SAME: f64 = 1e-9;

/// A stream of random numbers (Steele, Lea and Flood 2014, SplitMix64): the same everywhere.
#[derive(Debug, Clone)]
struct Random(u64);

impl Random {
    /// Uniform in 0..n.
    fn below(&mut self, n: u32) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        // The upper half of a product: uneven by less than 2⁻³² n.
        (((z >> 32) * u64::from(n)) >> 32) as u32
    }
}

impl StratifiedPixels {
    /// At least `count` pixels of a picture of `size` (all of them where it has no more), in rows
    /// from the top left; the same for the same seed. Empty for an empty picture.
    pub fn new(size: [u32; 2], count: usize, seed: u64) -> Self {
        let [width, height] = size.map(f64::from);
        let count = count.max(1) as f64;
        // Cells about as wide as high.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1..=size")]
        let cells = {
            let columns =
                (count * width / height.max(1.0)).sqrt().ceil().clamp(1.0, width.max(1.0));
            let rows = (count / columns).ceil().clamp(1.0, height.max(1.0));
            let columns = (count / rows).ceil().clamp(1.0, width.max(1.0));
            [columns as u32, rows as u32]
        };
        let edge = |axis: usize, cell: u32| -> u32 {
            #[expect(clippy::cast_possible_truncation, reason = "at most the size")]
            let at = (u64::from(size[axis]) * u64::from(cell) / u64::from(cells[axis])) as u32;
            at
        };
        let mut random = Random(seed);
        let (mut pixels, mut weights) = (Vec::new(), Vec::new());
        let all = width * height;
        for row in 0..cells[1] {
            for column in 0..cells[0] {
                let low = [edge(0, column), edge(1, row)];
                let extent = [edge(0, column + 1) - low[0], edge(1, row + 1) - low[1]];
                if extent.contains(&0) {
                    continue;
                }
                pixels.push([0, 1].map(|a| low[a] + random.below(extent[a])));
                weights.push(f64::from(extent[0]) * f64::from(extent[1]) / all);
            }
        }
        Self { pixels, weights }
    }

    /// The error of a picture whose pixels are `found` where the truth is `truth`, both linear
    /// premultiplied RGBA in the order of [`StratifiedPixels::pixels`].
    ///
    /// The interval is the bootstrap's (Efron 1979, percentiles of 1000 resamples, seeded), which
    /// takes the pixels as drawn freely: with strata it is too wide rather than too narrow. One pixel,
    /// or equal errors, tell nothing of the spread: then there is none, rather than one of no width.
    ///
    /// # Errors
    /// See [`CompareError`].
    pub fn error(
        &self,
        found: &[[f64; 4]],
        truth: &[[f64; 4]],
        seed: u64,
    ) -> Result<SampledError, CompareError> {
        for other in [found, truth] {
            if other.len() != self.pixels.len() {
                return Err(CompareError::Size { first: other.len(), second: self.pixels.len() });
            }
        }
        if found.is_empty() {
            return Err(CompareError::Empty);
        }
        let count = found.len();
        let (mut squares, mut alpha) = (Vec::with_capacity(count), 0.0);
        let (mut max_abs, mut alpha_max) = (0.0_f64, 0.0_f64);
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for (pixel, ((a, b), weight)) in found.iter().zip(truth).zip(&self.weights).enumerate() {
            let difference: [f64; 4] = std::array::from_fn(|c| a[c] - b[c]);
            if difference.iter().any(|d| !d.is_finite()) {
                return Err(CompareError::NotFinite { pixel });
            }
            let [r, g, b, a] = difference;
            let square = (r * r + g * g + b * b) / 3.0;
            (least, most) = (least.min(square), most.max(square));
            squares.push(weight * square);
            alpha += weight * a * a;
            max_abs = difference.iter().fold(max_abs, |most, d| most.max(d.abs()));
            alpha_max = alpha_max.max(a.abs());
        }
        let mut random = Random(seed ^ 0x626f_6f74);
        #[expect(clippy::cast_possible_truncation, reason = "fewer pixels than 2³²")]
        let mut draw = || squares[random.below(count as u32) as usize];
        let mut resampled: Vec<f64> =
            (0..RESAMPLES).map(|_| (0..count).map(|_| draw()).sum::<f64>().sqrt()).collect();
        resampled.sort_by(f64::total_cmp);
        let tail = (RESAMPLES as f64 * TAIL) as usize;
        let rmse = squares.iter().sum::<f64>().sqrt();
        // Percentiles of a skewed sample need not hold its mean.
        let [low, high] = [resampled[tail], resampled[RESAMPLES - 1 - tail]];
        let is_known = most - least > SAME * most && low < high;
        let interval = is_known.then(|| [low.min(rmse), high.max(rmse)]);
        Ok(SampledError {
            rmse,
            psnr_db: psnr_from_rmse(rmse),
            rmse_interval: interval,
            psnr_interval_db: interval.map(|ends| [ends[1], ends[0]].map(psnr_from_rmse)),
            max_abs,
            alpha_rmse: alpha.sqrt(),
            alpha_max,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::rmse;

    #[test]
    fn there_is_one_pixel_in_every_cell_and_their_shares_sum_to_one() {
        for (size, count) in [([1280, 800], 2000), ([37, 91], 500), ([3000, 2], 100), ([1, 1], 9)] {
            let sample = StratifiedPixels::new(size, count, 1);
            let all = (size[0] * size[1]) as usize;
            assert!(sample.pixels.len() >= count.min(all), "{size:?}: {}", sample.pixels.len());
            assert!(sample.pixels.len() < count.min(all) * 5 / 4 + 2, "{}", sample.pixels.len());
            assert!((sample.weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            let mut once = sample.pixels.clone();
            once.sort_unstable();
            once.dedup();
            assert_eq!(once.len(), sample.pixels.len());
            assert!(once.iter().all(|p| p[0] < size[0] && p[1] < size[1]));
        }
        // Quarters of the picture have quarters of the pixels.
        let sample = StratifiedPixels::new([400, 400], 1600, 5);
        let corner = sample.pixels.iter().filter(|p| p[0] < 200 && p[1] < 200).count();
        assert_eq!(corner, 400);
    }

    #[test]
    fn the_seed_and_nothing_else_chooses_the_pixels() {
        let sample = |seed| StratifiedPixels::new([200, 100], 300, seed);
        assert_eq!(sample(3), sample(3));
        assert_ne!(sample(3), sample(4));
    }

    #[test]
    fn asked_for_every_pixel_the_error_is_the_whole_pictures() {
        let size = [13, 7];
        let sample = StratifiedPixels::new(size, 1000, 2);
        assert_eq!(sample.pixels.len(), 91);
        let found: Vec<[f64; 4]> = (0..91).map(|i| [f64::from(i) / 91.0; 4]).collect();
        let truth = vec![[0.25, 0.5, 0.75, 0.9]; 91];
        let error = sample.error(&found, &truth, 2).unwrap();
        assert!((error.rmse - rmse(&found, &truth).unwrap()).abs() < 1e-12, "{error:?}");
        assert!((error.alpha_max - 0.9).abs() < 1e-12 && (error.max_abs - 0.9).abs() < 1e-12);
        let alpha = found.iter().map(|p| (p[3] - 0.9).powi(2)).sum::<f64>() / 91.0;
        assert!((error.alpha_rmse - alpha.sqrt()).abs() < 1e-12, "{error:?}");
    }

    /// A picture whose error is 0.1 in a disc of a fifth of it, less outside.
    fn found(size: [u32; 2], pixel: [u32; 2]) -> [f64; 4] {
        let [x, y] = [0, 1].map(|a| f64::from(pixel[a]) / f64::from(size[a]) - 0.5);
        let error = if x.hypot(y) < 0.25 { 0.1 } else { 0.02 * x };
        [error, -error, error, 0.0]
    }

    #[test]
    fn the_interval_holds_the_truth_nineteen_times_in_twenty_or_more() {
        let size = [160, 120];
        let every: Vec<[f64; 4]> =
            (0..160 * 120).map(|i| found(size, [i % 160, i / 160])).collect();
        let truth = rmse(&every, &vec![[0.0; 4]; every.len()]).unwrap();
        let (mut held, mut mean) = (0, 0.0);
        for seed in 0..200 {
            let sample = StratifiedPixels::new(size, 300, seed);
            let found: Vec<_> = sample.pixels.iter().map(|&p| found(size, p)).collect();
            let error = sample.error(&found, &vec![[0.0; 4]; found.len()], seed).unwrap();
            let [low, high] = error.rmse_interval.unwrap();
            assert!(low < high && high < 1.5 * low, "{error:?}");
            held += usize::from((low..=high).contains(&truth));
            mean += error.rmse.powi(2) / 200.0;
        }
        println!("measured: {held} of 200 held, mean square off by {:e}", mean.sqrt() - truth);
        assert!(held >= 190, "{held}");
        assert!((mean.sqrt() - truth).abs() < 2e-3 * truth, "{mean} {truth}");
        // An interval about something else does not hold it.
        let sample = StratifiedPixels::new(size, 300, 0);
        let found: Vec<_> =
            sample.pixels.iter().map(|&p| found(size, p).map(|c| 2.0 * c)).collect();
        let error = sample.error(&found, &vec![[0.0; 4]; found.len()], 0).unwrap();
        assert!(error.rmse_interval.unwrap()[0] > truth);
    }

    #[test]
    fn fewer_pixels_are_less_sure() {
        let width = |count| {
            let sample = StratifiedPixels::new([160, 120], count, 9);
            let found: Vec<_> = sample.pixels.iter().map(|&p| found([160, 120], p)).collect();
            let error = sample.error(&found, &vec![[0.0; 4]; found.len()], 9).unwrap();
            let db = error.psnr_interval_db.unwrap();
            assert!(db[0] < error.psnr_db && error.psnr_db < db[1], "{error:?}");
            let [low, high] = error.rmse_interval.unwrap();
            high - low
        };
        // As the root of the count: a factor of 4 for 16 times as many.
        let ratio = width(200) / width(3200);
        assert!((2.8..5.6).contains(&ratio), "{ratio}");
    }

    #[test]
    fn pixels_that_tell_nothing_of_the_spread_have_no_interval() {
        let interval = |size, count, found: &dyn Fn(usize) -> f64| {
            let sample = StratifiedPixels::new(size, count, 1);
            let pixels = sample.pixels.len();
            let found: Vec<_> = (0..pixels).map(|i| [found(i); 4]).collect();
            let error = sample.error(&found, &vec![[0.0; 4]; pixels], 1).unwrap();
            assert_eq!(error.rmse_interval.is_some(), error.psnr_interval_db.is_some());
            error.rmse_interval
        };
        assert_eq!(interval([1, 1], 1, &|_| 0.1), None, "one pixel");
        assert_eq!(interval([200, 200], 1, &|_| 0.1), None, "one of many");
        assert_eq!(interval([48, 48], 2304, &|_| 0.3), None, "all off by the same");
        assert_eq!(interval([50, 37], 300, &|_| 0.3), None, "in cells of different sizes");
        assert_eq!(interval([48, 48], 300, &|_| 0.0), None, "all exact");
        let [low, high] = interval([48, 48], 2304, &|i| 0.3 + 1e-4 * (i % 2) as f64).unwrap();
        assert!(low < high, "the least spread is one");
        assert!(interval([2, 1], 2, &|i| i as f64).is_some(), "two pixels");
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let sample = StratifiedPixels::new([4, 4], 16, 0);
        let right = vec![[0.5; 4]; 16];
        assert!(matches!(sample.error(&right[1..], &right, 0), Err(CompareError::Size { .. })));
        assert!(matches!(sample.error(&right, &right[1..], 0), Err(CompareError::Size { .. })));
        let mut wild = right.clone();
        wild[3][3] = f64::NAN;
        assert_eq!(sample.error(&wild, &right, 0), Err(CompareError::NotFinite { pixel: 3 }));
        let empty = StratifiedPixels::new([0, 5], 16, 0);
        assert_eq!(empty.error(&[], &[], 0), Err(CompareError::Empty));
        let equal = sample.error(&right, &right, 0).unwrap();
        assert_eq!((equal.rmse, equal.psnr_db), (0.0, f64::INFINITY));
    }
}

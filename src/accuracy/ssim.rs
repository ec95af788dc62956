//! Structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004, equation 13 and §III.C).
//!
//! Written here because the crate that is maintained (`image-compare` 0.5) takes bytes and has
//! square windows of 8 pixels, whose numbers are not comparable with anybody's.

use super::picture::{Plane, luma};
use crate::core::parallel;

/// Pixels across the window.
const WINDOW: usize = 11;
/// Standard deviation of its Gaussian, pixels.
const SIGMA: f64 = 1.5;
/// (K₁ L)² and (K₂ L)² with K₁ = 0.01, K₂ = 0.03, and values in 0..=1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// A picture that others are held to.
///
/// Compared is the luma of what a display shows: light over black, held to 0..=1, sRGB-coded. Only
/// windows that lie wholly in the picture count, as in the authors' program.
#[derive(Debug, Clone)]
pub struct Ssim {
    size: [usize; 2],
    luma: Plane,
    mean: Plane,
    variance: Plane,
}

impl Ssim {
    /// Prepares linear premultiplied RGBA of `size` [width, height] pixels, rows from the top;
    /// `None` for pictures smaller than the window.
    ///
    /// # Panics
    /// Where `light` has not that many pixels.
    pub fn new(light: &[[f64; 4]], size: [u32; 2]) -> Option<Self> {
        let size = size.map(|n| n as usize);
        if size.iter().any(|&n| n < WINDOW) {
            return None;
        }
        let luma = luma(light, size);
        let mean = windowed(&luma);
        let square = windowed(&luma.map(|v| v * v));
        let variance = square.zip(&mean, |square, mean| square - mean * mean);
        Some(Self { size, luma, mean, variance })
    }

    /// Mean similarity of another picture of that size: 1 for an equal one, at least −1.
    ///
    /// # Panics
    /// Where `light` has another number of pixels.
    pub fn mean(&self, light: &[[f64; 4]]) -> f64 {
        let luma = luma(light, self.size);
        let mean = windowed(&luma);
        let square = windowed(&luma.map(|v| v * v));
        let product = windowed(&luma.zip(&self.luma, |a, b| a * b));
        let count = mean.values.len();
        let similarity = |i: usize| {
            let (x, y) = (mean.values[i], self.mean.values[i]);
            let variance = square.values[i] - x * x;
            let covariance = product.values[i] - x * y;
            (2.0 * x * y + C1) * (2.0 * covariance + C2)
                / ((x * x + y * y + C1) * (variance + self.variance.values[i] + C2))
        };
        parallel::list(count, similarity).iter().sum::<f64>() / count as f64
    }
}

/// The Gaussian-weighted mean of every whole window.
fn windowed(plane: &Plane) -> Plane {
    let weight = |i: usize| {
        let x = i as f64 - (WINDOW / 2) as f64;
        (-x * x / (2.0 * SIGMA * SIGMA)).exp()
    };
    let sum: f64 = (0..WINDOW).map(weight).sum();
    let weights: [f64; WINDOW] = std::array::from_fn(|i| weight(i) / sum);
    plane.filtered(&weights, &weights).inner(WINDOW / 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::colour::linear_from_srgb;

    /// A grey picture whose display-coded value at (x, y) is given.
    fn grey(size: [u32; 2], value: impl Fn(u32, u32) -> f64) -> Vec<[f64; 4]> {
        (0..size[0] * size[1])
            .map(|i| {
                let light = linear_from_srgb(value(i % size[0], i / size[0]));
                [light, light, light, 1.0]
            })
            .collect()
    }

    fn ssim(a: &[[f64; 4]], b: &[[f64; 4]], size: [u32; 2]) -> f64 {
        Ssim::new(b, size).unwrap().mean(a)
    }

    #[test]
    fn equal_pictures_are_wholly_similar() {
        let size = [30, 20];
        let picture = grey(size, |x, y| f64::from((7 * x + 13 * y) % 50) / 50.0);
        assert!((ssim(&picture, &picture, size) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn even_pictures_have_the_similarity_of_their_means() {
        let size = [16, 11];
        let found = ssim(&grey(size, |_, _| 0.3), &grey(size, |_, _| 0.6), size);
        // (2·0.3·0.6 + C₁) / (0.3² + 0.6² + C₁), with no variance anywhere.
        let expected = (0.36 + 1e-4) / (0.45 + 1e-4);
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }

    #[test]
    fn one_window_has_the_similarity_of_its_weighted_sums() {
        let size = [11, 11];
        let a = |x: u32, y: u32| 0.2 + 0.05 * f64::from(x) + 0.01 * f64::from(y);
        let b = |x: u32, y: u32| if (x + 2 * y).is_multiple_of(3) { 0.7 } else { 0.3 };
        let (mut total, mut sums) = (0.0, [0.0; 5]);
        for y in 0..11 {
            for x in 0..11 {
                let [dx, dy] = [x, y].map(|v| f64::from(v) - 5.0);
                let w = (-(dx * dx + dy * dy) / 4.5).exp();
                let (p, q) = (a(x, y), b(x, y));
                total += w;
                for (sum, value) in sums.iter_mut().zip([p, q, p * p, q * q, p * q]) {
                    *sum += w * value;
                }
            }
        }
        let [p, q, pp, qq, pq] = sums.map(|sum| sum / total);
        let expected = (2.0 * p * q + 1e-4) * (2.0 * (pq - p * q) + 9e-4)
            / ((p * p + q * q + 1e-4) * (pp - p * p + qq - q * q + 9e-4));
        let found = ssim(&grey(size, a), &grey(size, b), size);
        assert!((found - expected).abs() < 1e-6 && expected < 0.5, "{found} {expected}");
    }

    #[test]
    fn structure_turned_over_is_dissimilar_though_the_error_is_small() {
        let size = [40, 40];
        let pattern = |sign: f64| {
            grey(size, move |x, y| {
                0.5 + sign * 0.05 * f64::from((x / 2 + y / 2) % 2) - sign * 0.025
            })
        };
        let found = ssim(&pattern(1.0), &pattern(-1.0), size);
        assert!(found < 0.1, "{found}");
        // A shift of brightness as large costs far less.
        let brighter = ssim(&grey(size, |_, _| 0.55), &grey(size, |_, _| 0.5), size);
        assert!(brighter > 0.99, "{brighter}");
    }

    #[test]
    fn small_pictures_have_none() {
        assert!(Ssim::new(&[[0.0; 4]; 100], [10, 10]).is_none());
    }
}

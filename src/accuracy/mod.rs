//! How far one picture is from another.
//!
//! Owns the metrics, the sample of pixels they may be taken at, and what a price list holds.
//! Refuses drawing and files. Pictures are linear premultiplied RGBA over black, rows from the top.
//! Imports `kernel` and `scene`, for the names of modes.

pub mod flip;
mod picture;
pub mod sample;
pub mod ssim;
pub mod sweep;

/// Two pictures that cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// Different numbers of pixels.
    #[error("expected two pictures of one size, found {first} and {second} pixels")]
    Size {
        /// Pixels of the first.
        first: usize,
        /// Pixels of the second.
        second: usize,
    },
    /// No pixel at all.
    #[error("expected at least one pixel to compare, found none")]
    Empty,
    /// A pixel that is no colour.
    #[error("expected finite pixels, found NaN or infinity in pixel {pixel}")]
    NotFinite {
        /// Its index.
        pixel: usize,
    },
}

/// What a comparison found; first minus second where there is a sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Root of the mean squared difference over all pixels and RGB.
    pub rmse: f64,
    /// Greatest difference of any channel, alpha included.
    pub max_abs: f64,
    /// Greatest difference of alpha.
    pub max_alpha: f64,
    /// Root of the mean squared difference of alpha.
    pub rmse_alpha: f64,
    /// Mean of the difference over all pixels and RGB: what is brighter as a whole.
    pub mean_brightness: f64,
}

impl Difference {
    /// Compares two pictures over a black background.
    ///
    /// # Errors
    /// See [`CompareError`]: nothing is ever passed over.
    pub fn between(first: &[[f64; 4]], second: &[[f64; 4]]) -> Result<Self, CompareError> {
        if first.len() != second.len() {
            return Err(CompareError::Size { first: first.len(), second: second.len() });
        }
        if first.is_empty() {
            return Err(CompareError::Empty);
        }
        let (mut squares, mut sum, mut alpha_squares) = (0.0, 0.0, 0.0);
        let (mut max_abs, mut max_alpha) = (0.0_f64, 0.0_f64);
        for (pixel, (a, b)) in first.iter().zip(second).enumerate() {
            for channel in 0..4 {
                let difference = a[channel] - b[channel];
                // `max` would pass NaN over.
                if !difference.is_finite() {
                    return Err(CompareError::NotFinite { pixel });
                }
                max_abs = max_abs.max(difference.abs());
                if channel == 3 {
                    max_alpha = max_alpha.max(difference.abs());
                    alpha_squares += difference * difference;
                } else {
                    squares += difference * difference;
                    sum += difference;
                }
            }
        }
        let count = (3 * first.len()) as f64;
        Ok(Self {
            rmse: (squares / count).sqrt(),
            max_abs,
            max_alpha,
            rmse_alpha: (alpha_squares / first.len() as f64).sqrt(),
            mean_brightness: sum / count,
        })
    }

    /// Peak signal-to-noise ratio in dB, peak 1: −10 log₁₀ of the mean squared difference; +∞ for
    /// equal RGB.
    pub fn psnr(&self) -> f64 {
        psnr_from_rmse(self.rmse)
    }
}

/// −20 log₁₀ of an RMSE ≥ 0: +∞ for 0.
pub fn psnr_from_rmse(rmse: f64) -> f64 {
    -20.0 * rmse.log10()
}

/// [`Difference::rmse`] alone.
///
/// # Errors
/// See [`CompareError`].
pub fn rmse(first: &[[f64; 4]], second: &[[f64; 4]]) -> Result<f64, CompareError> {
    Difference::between(first, second).map(|d| d.rmse)
}

/// [`Difference::psnr`] alone.
///
/// # Errors
/// See [`CompareError`].
pub fn psnr(first: &[[f64; 4]], second: &[[f64; 4]]) -> Result<f64, CompareError> {
    Difference::between(first, second).map(|d| d.psnr())
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREY: [f64; 4] = [0.5, 0.5, 0.5, 1.0];

    #[test]
    fn equal_pictures_differ_by_nothing() {
        let d = Difference::between(&[GREY; 6], &[GREY; 6]).unwrap();
        assert_eq!((d.rmse, d.max_abs, d.max_alpha, d.mean_brightness), (0.0, 0.0, 0.0, 0.0));
        assert_eq!(d.psnr(), f64::INFINITY);
    }

    #[test]
    fn every_metric_reports_pictures_that_differ() {
        let mut other = [GREY; 6];
        other[4][1] += 0.3;
        let d = Difference::between(&other, &[GREY; 6]).unwrap();
        let mean_square = 0.09 / 18.0;
        assert!((d.rmse - f64::sqrt(mean_square)).abs() < 1e-15, "{d:?}");
        assert!((d.psnr() + 10.0 * f64::log10(mean_square)).abs() < 1e-12, "{d:?}");
        assert!((d.max_abs - 0.3).abs() < 1e-15 && d.max_alpha == 0.0, "{d:?}");
        assert!((d.mean_brightness - 0.3 / 18.0).abs() < 1e-15, "{d:?}");
        assert_eq!(rmse(&other, &[GREY; 6]), Ok(d.rmse));
        assert_eq!(psnr(&other, &[GREY; 6]), Ok(d.psnr()));
    }

    #[test]
    fn brightness_has_a_sign_and_errors_that_cancel_in_it_do_not_cancel_elsewhere() {
        let mut other = [GREY; 2];
        other[0][0] += 0.2;
        other[1][0] -= 0.2;
        let d = Difference::between(&other, &[GREY; 2]).unwrap();
        assert!(d.mean_brightness.abs() < 1e-15 && d.rmse > 0.1, "{d:?}");
        other[1] = [0.0; 4];
        let darker = Difference::between(&other, &[GREY; 2]).unwrap();
        assert!(darker.mean_brightness < -0.1, "{darker:?}");
    }

    #[test]
    fn alpha_counts_in_the_greatest_difference_but_not_in_the_rms() {
        let mut other = [GREY; 2];
        other[1][3] = 0.25;
        let d = Difference::between(&other, &[GREY; 2]).unwrap();
        assert_eq!((d.rmse, d.max_abs, d.max_alpha), (0.0, 0.75, 0.75));
        assert!((d.rmse_alpha - (0.75_f64.powi(2) / 2.0).sqrt()).abs() < 1e-15, "{d:?}");
    }

    #[test]
    fn psnr_is_twenty_decibels_a_decade() {
        assert!((psnr_from_rmse(0.1) - 20.0).abs() < 1e-12);
        assert!((psnr_from_rmse(1.0 / 512.0) - 54.185).abs() < 1e-3);
    }

    #[test]
    fn pictures_that_cannot_be_compared_are_refused_and_never_equal() {
        assert_eq!(rmse(&[], &[]), Err(CompareError::Empty));
        assert_eq!(rmse(&[GREY], &[GREY; 2]), Err(CompareError::Size { first: 1, second: 2 }));
        for wild in [f64::NAN, f64::INFINITY] {
            for channel in 0..4 {
                let mut other = [GREY; 3];
                other[2][channel] = wild;
                let refused = Err(CompareError::NotFinite { pixel: 2 });
                assert_eq!(rmse(&other, &[GREY; 3]), refused);
                // Even where both are wild.
                assert_eq!(psnr(&other, &other), refused);
            }
        }
    }
}

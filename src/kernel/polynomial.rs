//! Footprints as polynomials, for machines that have only single precision.

use std::sync::LazyLock;

use super::radial::{RadialKernel, Shape};

/// Coefficients of a [`FootprintPolynomial`].
pub const COEFFICIENTS: usize = 8;
/// Points at which the fit is made, and between which the finished one is checked.
const FIT_POINTS: usize = 240;
const CHECK_POINTS: usize = 2048;
/// Rounds of reweighting by the error, which lower the greatest error (Lawson's method).
const ROUNDS: usize = 24;

/// How a footprint approaches 0 at its rim, taken out of the fit so that it is met exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rim {
    /// As (1 − q)²: a smooth kernel (its own power is 5/2).
    Square,
    /// As √(1 − q): a kernel that is cut off.
    Root,
}

/// An approximation of F for shaders:
///
/// F(l) ≈ rim(1 − q)·Σ cᵢ uⁱ with q = min((l/radius)², 1) and u = 2q − 1,
///
/// rim(x) = x² or √x. One Horner scheme without branches; 0 at and beyond the radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootprintPolynomial {
    /// Where F ends, voxels.
    pub radius: f32,
    /// Which factor goes to 0 there.
    pub rim: Rim,
    /// c₀ first.
    pub coefficients: [f32; COEFFICIENTS],
    /// Greatest |error| over the footprint, evaluated in single precision, as a part of F(0).
    pub max_error: f64,
}

impl FootprintPolynomial {
    /// The polynomial of a kernel. The fits are made once a run; scaling them is free.
    pub fn of(kernel: RadialKernel) -> Self {
        static GAUSSIAN: LazyLock<FootprintPolynomial> =
            LazyLock::new(|| fit(RadialKernel::natural_of(Shape::Gaussian), Rim::Root));
        static CUBIC: LazyLock<FootprintPolynomial> =
            LazyLock::new(|| fit(RadialKernel::natural_of(Shape::Cubic), Rim::Square));
        let natural = match kernel.shape {
            Shape::Gaussian => *GAUSSIAN,
            Shape::Cubic => *CUBIC,
        };
        let shrink = kernel.scale().powi(-2);
        Self {
            radius: kernel.radius() as f32,
            coefficients: natural.coefficients.map(|c| (f64::from(c) * shrink) as f32),
            ..natural
        }
    }

    /// F(l) as a shader computes it.
    pub fn evaluate(&self, l: f32) -> f32 {
        let ratio = l / self.radius;
        let q = (ratio * ratio).min(1.0);
        let u = 2.0 * q - 1.0;
        let sum = self.coefficients.iter().rev().fold(0.0_f32, |sum, c| sum * u + c);
        rim_f32(self.rim, 1.0 - q) * sum
    }
}

fn rim_f32(rim: Rim, x: f32) -> f32 {
    match rim {
        Rim::Square => x * x,
        Rim::Root => x.sqrt(),
    }
}

fn rim_f64(rim: Rim, x: f64) -> f64 {
    match rim {
        Rim::Square => x * x,
        Rim::Root => x.sqrt(),
    }
}

/// Least squares in rim × Chebyshev polynomials at Chebyshev points, reweighted towards the
/// least greatest error; the best round is kept.
fn fit(kernel: RadialKernel, rim: Rim) -> FootprintPolynomial {
    let radius = kernel.radius();
    let points: Vec<f64> = (0..FIT_POINTS)
        .map(|i| -(std::f64::consts::PI * (i as f64 + 0.5) / FIT_POINTS as f64).cos())
        .collect();
    let wanted: Vec<f64> =
        points.iter().map(|u| kernel.footprint(radius * ((1.0 + u) / 2.0).sqrt())).collect();
    let rows: Vec<[f64; COEFFICIENTS]> =
        points.iter().map(|&u| chebyshev(u).map(|t| t * rim_f64(rim, (1.0 - u) / 2.0))).collect();
    let mut weights = vec![1.0; FIT_POINTS];
    let mut best = (f64::INFINITY, [0.0; COEFFICIENTS]);
    for _ in 0..ROUNDS {
        let solution = weighted_least_squares(&rows, &wanted, &weights);
        let errors: Vec<f64> = rows
            .iter()
            .zip(&wanted)
            .map(|(row, f)| (row.iter().zip(&solution).map(|(a, x)| a * x).sum::<f64>() - f).abs())
            .collect();
        let greatest = errors.iter().copied().fold(0.0, f64::max);
        if greatest < best.0 {
            best = (greatest, solution);
        }
        for (weight, error) in weights.iter_mut().zip(&errors) {
            *weight *= error / greatest + 0.02;
        }
    }
    let mut polynomial = FootprintPolynomial {
        radius: radius as f32,
        rim,
        coefficients: powers_from_chebyshev(best.1).map(|c| c as f32),
        max_error: 0.0,
    };
    polynomial.max_error = measured_error(&polynomial, kernel);
    polynomial
}

/// Greatest |F − polynomial| / F(0), the polynomial in single precision.
fn measured_error(polynomial: &FootprintPolynomial, kernel: RadialKernel) -> f64 {
    (0..=CHECK_POINTS)
        .map(|i| {
            let l = polynomial.radius * i as f32 / CHECK_POINTS as f32;
            (f64::from(polynomial.evaluate(l)) - kernel.footprint(f64::from(l))).abs()
        })
        .fold(0.0, f64::max)
        / kernel.footprint(0.0)
}

/// T₀(u) … of the first kind.
fn chebyshev(u: f64) -> [f64; COEFFICIENTS] {
    let mut t = [1.0; COEFFICIENTS];
    t[1] = u;
    for i in 2..COEFFICIENTS {
        t[i] = 2.0 * u * t[i - 1] - t[i - 2];
    }
    t
}

/// Power-basis coefficients of Σ cᵢ Tᵢ(u).
fn powers_from_chebyshev(c: [f64; COEFFICIENTS]) -> [f64; COEFFICIENTS] {
    let mut previous = [0.0; COEFFICIENTS];
    let mut current = [0.0; COEFFICIENTS];
    previous[0] = 1.0;
    current[1] = 1.0;
    let mut sum = [0.0; COEFFICIENTS];
    for (i, &ci) in c.iter().enumerate() {
        for (to, from) in sum.iter_mut().zip(&previous) {
            *to += ci * from;
        }
        if i + 2 < COEFFICIENTS + 1 {
            let next = std::array::from_fn(|k| {
                let raised = if k > 0 { 2.0 * current[k - 1] } else { 0.0 };
                raised - previous[k]
            });
            previous = std::mem::replace(&mut current, next);
        }
    }
    sum
}

/// min Σ wᵢ (rowᵢ·x − bᵢ)² by modified Gram–Schmidt on the weighted columns: no normal equations.
fn weighted_least_squares(
    rows: &[[f64; COEFFICIENTS]],
    b: &[f64],
    weights: &[f64],
) -> [f64; COEFFICIENTS] {
    let root: Vec<f64> = weights.iter().map(|w| w.sqrt()).collect();
    let mut columns: Vec<Vec<f64>> = (0..COEFFICIENTS)
        .map(|j| rows.iter().zip(&root).map(|(row, w)| row[j] * w).collect())
        .collect();
    let mut rest: Vec<f64> = b.iter().zip(&root).map(|(b, w)| b * w).collect();
    let mut r = [[0.0; COEFFICIENTS]; COEFFICIENTS];
    let mut projected = [0.0; COEFFICIENTS];
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for j in 0..COEFFICIENTS {
        let (done, later) = columns.split_at_mut(j + 1);
        let column = &mut done[j];
        let length = dot(column, column).sqrt();
        column.iter_mut().for_each(|x| *x /= length);
        r[j][j] = length;
        let subtract = |from: &mut [f64]| {
            let along = dot(column, from);
            from.iter_mut().zip(column.iter()).for_each(|(x, c)| *x -= along * c);
            along
        };
        for (k, other) in later.iter_mut().enumerate() {
            r[j][j + 1 + k] = subtract(other);
        }
        projected[j] = subtract(&mut rest);
    }
    let mut x = [0.0; COEFFICIENTS];
    for j in (0..COEFFICIENTS).rev() {
        let known: f64 = (j + 1..COEFFICIENTS).map(|k| r[j][k] * x[k]).sum();
        x[j] = (projected[j] - known) / r[j][j];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;

    fn error_between(kernel: Kernel, extent: Option<f64>) -> (f64, f64) {
        let kernel = RadialKernel::new(kernel, extent).unwrap();
        let polynomial = FootprintPolynomial::of(kernel);
        // Odd steps, so that neither the fit's nor the check's points are met.
        let worst = (0..=7919)
            .map(|i| {
                let l = (kernel.radius() * f64::from(i) / 7919.0) as f32;
                f64::from(polynomial.evaluate(l)) - kernel.footprint(f64::from(l))
            })
            .fold(0.0, |a: f64, b| a.max(b.abs()));
        (worst / kernel.footprint(0.0), polynomial.max_error)
    }

    /// Measured at every extent, as parts of F(0): cubic 9.8e-5, Gaussian 2.1e-5. With the twelve
    /// coefficients there once were it was 3.9e-5 and 1.5e-6; each costs every fragment a step.
    #[test]
    fn single_precision_polynomials_stay_within_their_stated_error_at_every_extent() {
        for (kernel, bound) in [(Kernel::Cubic, 1.1e-4), (Kernel::Gaussian, 2.5e-5)] {
            for extent in [None, Some(1e-6), Some(0.7), Some(1e6)] {
                let (worst, stated) = error_between(kernel, extent);
                assert!(worst < bound, "{kernel:?} {extent:?}: {worst}");
                assert!(worst < stated * 1.1 + 2e-6, "{kernel:?} {extent:?}: {worst} > {stated}");
                assert!(worst > 0.2 * stated, "a stated error of {stated} is not measured");
            }
        }
    }

    #[test]
    fn polynomials_are_nothing_beyond_the_radius_and_never_clearly_negative() {
        for kernel in [Kernel::Cubic, Kernel::Gaussian] {
            let kernel = RadialKernel::new(kernel, None).unwrap();
            let polynomial = FootprintPolynomial::of(kernel);
            for l in [1.0, 1.001, 10.0, 1e30] {
                assert_eq!(polynomial.evaluate(polynomial.radius * l), 0.0);
            }
            for i in 0..=1000 {
                let f = polynomial.evaluate(polynomial.radius * i as f32 / 1000.0);
                assert!(f > -4e-5, "{i}: {f}");
            }
        }
    }

    #[test]
    fn the_power_basis_is_that_of_chebyshevs_polynomials() {
        let mut c = [0.0; COEFFICIENTS];
        c[COEFFICIENTS - 1] = 1.0;
        c[3] = 0.5;
        let powers = powers_from_chebyshev(c);
        for u in [-0.9, -0.2, 0.3, 1.0] {
            let horner = powers.iter().rev().fold(0.0, |sum, p| sum * u + p);
            let expected: f64 = chebyshev(u).iter().zip(&c).map(|(t, c)| t * c).sum();
            assert!((horner - expected).abs() < 1e-10, "{u}: {horner} {expected}");
        }
    }
}

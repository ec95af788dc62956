//! The share of a radial kernel's line that lies before a point of it, as polynomials for shaders.

use crate::kernel::Kernel;

/// With G(l, u) = ∫ h(√(l² + w²)) dw over w < u, q = (l/radius)² and t = u/√(radius² − l²) in −1..=1,
///
/// G(l, u)/F(l) ≈ ½ + t·Σₖ (Σⱼ cₖⱼ qʲ)·t²ᵏ.
///
/// Odd about ½, so that the shares of all of a kernel's slabs add up to 1, and nowhere falling, so
/// that no slab's is negative. Fitted by least squares to quadratures: the cubic's slope as (1 − t²)²
/// times a polynomial, the Gaussian's with its slope weighed in.
type SharePolynomial = [[f32; 5]; 6];

/// Within 1.1e-3 of the exact share.
const CUBIC: SharePolynomial = [
    [1.2282097, 0.0014655079, -1.1769286, 1.7033648, -0.8191911],
    [-1.6978507, -0.4624856, 6.4289656, -8.803677, 3.912105],
    [1.6923435, 1.9904249, -14.403013, 18.5296, -7.619465],
    [-0.9845228, -3.2110162, 16.40453, -19.800385, 7.577671],
    [0.29236978, 2.2933726, -9.431238, 10.709848, -3.8494124],
    [-0.03054935, -0.6117613, 2.1776853, -2.3387537, 0.7982926],
];
/// Within 8.1e-4.
const GAUSSIAN: SharePolynomial = [
    [1.3231837, -0.6464412, -0.11589617, -0.19055486, 0.12935728],
    [-2.3504398, 3.17732, 0.045598138, -1.1393261, 0.2668602],
    [3.4052765, -6.8698597, 1.2295718, 4.6457977, -2.4136791],
    [-3.194319, 7.973856, -3.081637, -5.339763, 3.6492236],
    [1.7066234, -4.826743, 2.795589, 2.360153, -2.0391314],
    [-0.39032483, 1.1918682, -0.8732259, -0.33630675, 0.4073694],
];

/// `Lists::shares` of a kernel: zeros for those that need none.
pub(super) fn share_constants(kernel: Kernel) -> [[f32; 4]; 8] {
    let mut constants = [[0.0; 4]; 8];
    for (k, c) in share_polynomial(kernel).into_iter().flatten().enumerate() {
        constants[k].copy_from_slice(&c[..4]);
        constants[6 + k / 4][k % 4] = c[4];
    }
    constants
}

/// The polynomial of a radial kernel, whatever its extent; `None` for others.
fn share_polynomial(kernel: Kernel) -> Option<&'static SharePolynomial> {
    match kernel {
        Kernel::Gaussian => Some(&GAUSSIAN),
        Kernel::Cubic => Some(&CUBIC),
        Kernel::Point | Kernel::Nearest | Kernel::Linear | Kernel::BSpline => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::RadialKernel;

    /// The share as the shader computes it.
    fn share(polynomial: &SharePolynomial, q: f32, t: f32) -> f32 {
        let factors = polynomial.map(|c| c.iter().rev().fold(0.0, |sum, c| sum * q + c));
        0.5 + t * factors.iter().rev().fold(0.0, |sum, f| sum * (t * t) + f)
    }

    #[test]
    fn shares_are_those_of_the_kernel_never_fall_and_add_up_to_1() {
        const STEPS: u32 = 400;
        for (kind, bound) in [(Kernel::Cubic, 1.1e-3), (Kernel::Gaussian, 8.5e-4)] {
            let kernel = RadialKernel::new(kind, None).unwrap();
            let polynomial = share_polynomial(kind).unwrap();
            let mut greatest = 0.0_f64;
            for row in 0..100 {
                let q = f64::from(row) / 100.0;
                let (l, half) = (kernel.radius() * q.sqrt(), kernel.radius() * (1.0 - q).sqrt());
                let step = 2.0 / f64::from(STEPS);
                let density = |t: f64| kernel.value(l.hypot(t * half)) * half;
                let mut sum = 0.0;
                let mut before = share(polynomial, q as f32, -1.0);
                for i in 0..STEPS {
                    let a = f64::from(i) * step - 1.0;
                    let middle = density(a + step / 2.0);
                    sum += (density(a) + 4.0 * middle + density(a + step)) * step / 6.0;
                    let found = share(polynomial, q as f32, (a + step) as f32);
                    assert!(found - before > -1e-6, "{kind:?} falls at {q} {a}");
                    before = found;
                    let expected = sum / kernel.footprint(l);
                    greatest = greatest.max((f64::from(found) - expected).abs());
                }
                let whole = before - share(polynomial, q as f32, -1.0);
                // Single precision: measured 3.3e-6.
                assert!((whole - 1.0).abs() < 6e-6, "{kind:?} at {q}: {whole}");
            }
            println!("measured share, {}: {greatest:.1e}", kind.name());
            assert!(greatest < bound, "{kind:?}: {greatest}");
        }
    }
}

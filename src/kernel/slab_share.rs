//! A kernel's slab integrals as polynomials, for machines that have only single precision.

use super::radial::{RadialKernel, Shape};

/// Factors of a [`SlabShare`], one for each odd power of the place.
pub const SHARE_FACTORS: usize = 7;
/// Coefficients of each, one for each power of (l/R)².
pub const SHARE_POWERS: usize = 4;

/// Which share of a footprint F(l) a line has gathered at u along it: S = G(l, u)/F(l), see
/// [`RadialKernel::cumulative`]. A slab's integral is F(l)·(S(u₁) − S(u₀)), with F from where the
/// footprint comes from.
///
/// With q = (l/R)² and t = u/√(R² − l²) in −1..=1,
///
/// S ≈ ½ + t·Σₖ (Σⱼ cₖⱼ qʲ)·t²ᵏ.
///
/// Odd about ½, so that the shares of all of a kernel's slabs add up to 1, and nowhere falling, so
/// that no slab's is negative. The same at every extent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlabShare {
    /// R: where the kernel ends, voxels.
    pub radius: f32,
    /// cₖⱼ: by k, then by j.
    pub factors: [[f32; SHARE_POWERS]; SHARE_FACTORS],
}

// Fitted to quadratures by linear programming: the least greatest error, weighed by F(l)/F(0) (the
// cubic's by its 0.7th power), of all that nowhere fall and have ½ at t = 1 for every q. The cubic's
// two pieces keep it from gaining by more: a factor and a power more take off a tenth.

/// Within 3.5e-4 of F(0) (and 2.0e-2 of F(l)).
const CUBIC: [[f32; SHARE_POWERS]; SHARE_FACTORS] = [
    [1.2343082, -0.18584752, -0.15617341, 0.0],
    [-1.7717438, 1.2527676, -0.5698336, 0.0],
    [2.012723, -4.7308755, 7.0665965, 0.0],
    [-1.5972333, 9.408081, -18.088825, 0.0],
    [0.82173145, -8.800269, 18.132961, 0.0],
    [-0.19978565, 3.0561435, -6.3847256, 0.0],
    [0.0, 0.0, 0.0, 0.0],
];
/// Within 1.9e-5 of F(0) (and 7.0e-3 of F(l)).
const GAUSSIAN: [[f32; SHARE_POWERS]; SHARE_FACTORS] = [
    [1.3266306, -0.65875316, -0.1115191, -0.1092484],
    [-2.4312646, 3.683627, -1.6439321, 1.0153058],
    [3.9175491, -10.028999, 11.990651, -10.097623],
    [-4.6392636, 16.61751, -32.40457, 34.471794],
    [3.7580779, -16.88942, 44.266167, -54.077873],
    [-1.8258353, 9.564907, -30.453228, 40.695736],
    [0.3941061, -2.2888718, 8.356433, -11.898091],
];

impl SlabShare {
    /// That of a kernel.
    pub fn of(kernel: RadialKernel) -> Self {
        let factors = match kernel.shape {
            Shape::Gaussian => GAUSSIAN,
            Shape::Cubic => CUBIC,
        };
        #[expect(clippy::cast_possible_truncation, reason = "for single precision")]
        let radius = kernel.radius() as f32;
        Self { radius, factors }
    }

    /// S at distance `l` ≥ 0 and `u` along the line, voxels, as shaders compute it; before the chord
    /// that of its beginning, behind it that of its end.
    pub fn share(&self, l: f32, u: f32) -> f32 {
        let p = (l / self.radius).min(1.0);
        let q = p * p;
        let half_chord = self.radius * (1.0 - q).max(1e-12).sqrt();
        let t = (u / half_chord).clamp(-1.0, 1.0);
        let horner = |c: &[f32], x: f32| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
        let factors = self.factors.map(|c| horner(&c, q));
        0.5 + t * horner(&factors, t * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;

    /// Steps along each axis at which shares are checked.
    const CHECKS: u32 = 301;

    fn kernels() -> [(RadialKernel, f64); 6] {
        [
            (Kernel::Cubic, None, 3.6e-4),
            (Kernel::Cubic, Some(1e-6), 3.6e-4),
            (Kernel::Cubic, Some(1e6), 3.6e-4),
            (Kernel::Gaussian, None, 1.9e-5),
            (Kernel::Gaussian, Some(0.7), 1.9e-5),
            (Kernel::Gaussian, Some(30.0), 1.9e-5),
        ]
        .map(|(kernel, extent, bound)| (RadialKernel::new(kernel, extent).unwrap(), bound))
    }

    /// Greatest |F·S − G|/F(0), and greatest |S − G/F|.
    fn measured_errors(share: &SlabShare, kernel: RadialKernel) -> [f64; 2] {
        let mut greatest = [0.0_f64; 2];
        for i in 0..CHECKS {
            let l = kernel.radius() * f64::from(i) / f64::from(CHECKS);
            let whole = kernel.footprint(l);
            for j in 0..=CHECKS {
                let u = kernel.radius() * (2.0 * f64::from(j) / f64::from(CHECKS) - 1.0);
                let found = f64::from(share.share(l as f32, u as f32));
                let error = (whole * found - kernel.cumulative(l, u)).abs();
                greatest[0] = greatest[0].max(error / kernel.footprint(0.0));
                greatest[1] = greatest[1].max(error / whole);
            }
        }
        greatest
    }

    #[test]
    fn slab_shares_stay_within_their_stated_error_at_every_extent() {
        for (kernel, bound) in kernels() {
            let share = SlabShare::of(kernel);
            let [weighed, of_line] = measured_errors(&share, kernel);
            println!(
                "measured slab shares, {kernel:?}: {weighed:.1e} of F(0), {of_line:.1e} of F(l)"
            );
            assert!(weighed < bound, "{kernel:?}: {weighed}");
            // Near the rim there is next to nothing to share. Measured: 2.0e-2.
            assert!(of_line < 2.5e-2, "{kernel:?}: {of_line}");
            // A coefficient that is off is found.
            let mut moved = share;
            moved.factors[2][1] += 0.01;
            assert!(measured_errors(&moved, kernel)[0] > bound, "{kernel:?}");
        }
    }

    #[test]
    fn slabs_that_adjoin_add_up_to_the_footprint_and_no_share_falls() {
        for (kernel, _) in kernels() {
            let share = SlabShare::of(kernel);
            let radius = share.radius;
            for i in 0..=100 {
                let l = radius * i as f32 / 100.0;
                for end in [radius * 1.000_001, radius * 3.0, f32::INFINITY] {
                    let whole = share.share(l, end) - share.share(l, -end);
                    // Single precision: measured 6.2e-6, of a Gaussian near its rim.
                    assert!((whole - 1.0).abs() < 1e-5, "{kernel:?} {l}: {whole}");
                }
                for j in -200..200 {
                    let at = |j: i32| share.share(l, radius * j as f32 / 190.0);
                    assert!(at(j + 1) - at(j) > -2e-6, "{kernel:?} {l} {j}");
                    assert!((at(j) + at(-j) - 1.0).abs() < 1e-6, "{kernel:?} {l} {j}");
                }
            }
        }
    }
}

//! Radial kernels h(r), and their footprints F(l) in closed form.

use std::f64::consts::PI;

use super::Kernel;

/// Standard deviation of the Gaussian kernel, voxels (Westover §4).
const SIGMA: f64 = 0.6;
/// Fraction of its peak at which the Gaussian is cut (Westover §4).
const GAUSSIAN_CUT: f64 = 0.004;
/// Where the cubic's two pieces meet, and where it ends, voxels (Crawfis–Max §2, eq. for h).
const CUBIC_KNOT: f64 = 0.889_392;
const CUBIC_END: f64 = 1.556_228;
/// Powers 0 to 3 of r in the inner piece; the digit that the scan garbles is right here.
const CUBIC_INNER: [f64; 4] = [0.557_526, 0.0, -1.157_743, 0.671_033];
/// Factors of (t − r)² and (t − r)³ in the outer piece.
const CUBIC_OUTER: [f64; 2] = [0.067_599, 0.282_474];

/// The two shapes that depend on the distance from the centre alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Gaussian,
    Cubic,
}

/// A radial kernel at some extent: h_E(r) = h(r/s)/s³ with s = E/E₀, so that ∫h over space stays 1.
///
/// Distances are in voxels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadialKernel {
    pub(super) shape: Shape,
    /// s = E/E₀, > 0.
    scale: f64,
}

impl RadialKernel {
    /// The cubic one at its natural extent.
    pub const CUBIC: Self = Self { shape: Shape::Cubic, scale: 1.0 };

    /// The radial kernel of a kind, drawn with a splat radius of `extent` voxels (`None`: its
    /// natural one). A mesh's is the kernel whose footprint it approximates.
    ///
    /// `None` for kinds that are not radial. An extent that is not finite and positive counts as
    /// the natural one; whoever takes extents from people refuses those first.
    pub fn new(kernel: Kernel, extent: Option<f64>) -> Option<Self> {
        let shape = match kernel {
            Kernel::Point
            | Kernel::Nearest
            | Kernel::Linear
            | Kernel::BSpline
            | Kernel::Functions
            | Kernel::Cells
            | Kernel::Ellipsoids => return None,
            Kernel::Gaussian => Shape::Gaussian,
            Kernel::Cubic | Kernel::Gouraud => Shape::Cubic,
        };
        let natural = kernel.natural_extent()?;
        let extent = extent.filter(|e| e.is_finite() && *e > 0.0).unwrap_or(natural);
        Some(Self { shape, scale: extent / natural })
    }

    /// A shape at its natural extent.
    pub(super) fn natural_of(shape: Shape) -> Self {
        Self { shape, scale: 1.0 }
    }

    /// s = E/E₀: how much wider than natural it is.
    pub fn scale(self) -> f64 {
        self.scale
    }

    /// The distance beyond which h is 0.
    pub fn radius(self) -> f64 {
        self.scale * self.natural_radius()
    }

    /// The distance at which h passes from one formula to another, where it has two.
    pub fn knot(self) -> Option<f64> {
        match self.shape {
            Shape::Gaussian => None,
            Shape::Cubic => Some(self.scale * CUBIC_KNOT),
        }
    }

    /// h(r) for r ≥ 0.
    pub fn value(self, r: f64) -> f64 {
        let r = r / self.scale;
        let h = match self.shape {
            Shape::Gaussian => gaussian(r),
            Shape::Cubic => cubic(r),
        };
        h / self.scale.powi(3)
    }

    /// h(r)/h(0): the shape alone, finite at every extent.
    pub(super) fn relative_value(self, r: f64) -> f64 {
        let r = r / self.scale;
        match self.shape {
            Shape::Gaussian => gaussian(r) / gaussian(0.0),
            Shape::Cubic => cubic(r) / cubic(0.0),
        }
    }

    /// F(l) = ∫ h(√(l² + w²)) dw over all w, for a line that passes the centre at distance l ≥ 0.
    pub fn footprint(self, l: f64) -> f64 {
        let l = l / self.scale;
        let f = match self.shape {
            Shape::Gaussian => gaussian_footprint(l),
            Shape::Cubic => cubic_footprint(l),
        };
        f / self.scale.powi(2)
    }

    /// G(l, u) = ∫ h(√(l² + w²)) dw over w ≤ u: the part of the footprint F(l) that a line at
    /// distance l ≥ 0 has gathered at u along it, counted from the point nearest to the centre.
    ///
    /// A slab's share is a difference of two. Rises with u; exactly 0 where the line has not met
    /// the kernel yet, −∞ included, and exactly F(l) where it has left it, ∞ included.
    pub fn cumulative(self, l: f64, u: f64) -> f64 {
        let whole = self.footprint(l);
        let (l, u) = (l / self.scale, u / self.scale);
        let end = self.natural_radius();
        let half = if l < end { half_chord(end, l) } else { 0.0 };
        if u <= -half {
            return 0.0;
        }
        if u >= half {
            return whole;
        }
        let part = match self.shape {
            Shape::Gaussian => gaussian_part(l, u.abs()),
            Shape::Cubic => cubic_part(l, u.abs()),
        };
        let part = (part / self.scale.powi(2)).clamp(0.0, whole / 2.0);
        whole / 2.0 + part.copysign(u)
    }

    /// ∫ h over space: 1 for the Gaussian, which is renormalised after the cut, 0.999 999 2 for the
    /// cubic, whose digits are printed so. The same at every extent.
    pub fn energy(self) -> f64 {
        match self.shape {
            Shape::Gaussian => 1.0,
            Shape::Cubic => cubic_energy(),
        }
    }

    fn natural_radius(self) -> f64 {
        match self.shape {
            Shape::Gaussian => gaussian_radius(),
            Shape::Cubic => CUBIC_END,
        }
    }
}

/// σ√(2 ln(1/0.004)): where the Gaussian falls to [`GAUSSIAN_CUT`].
fn gaussian_radius() -> f64 {
    SIGMA * (-2.0 * GAUSSIAN_CUT.ln()).sqrt()
}

/// Part of an uncut three-dimensional Gaussian that lies within `r`:
/// erf(r/σ√2) − √(2/π)·(r/σ)·exp(−r²/2σ²).
fn gaussian_energy_within(r: f64) -> f64 {
    let x = r / SIGMA;
    libm::erf(x / 2.0_f64.sqrt()) - (2.0 / PI).sqrt() * x * (-x * x / 2.0).exp()
}

/// Peak of the cut Gaussian, renormalised so that it integrates to 1.
fn gaussian_peak() -> f64 {
    1.0 / ((2.0 * PI * SIGMA * SIGMA).powf(1.5) * gaussian_energy_within(gaussian_radius()))
}

fn gaussian(r: f64) -> f64 {
    if r > gaussian_radius() {
        return 0.0;
    }
    gaussian_peak() * (-r * r / (2.0 * SIGMA * SIGMA)).exp()
}

fn gaussian_footprint(l: f64) -> f64 {
    let half_chord_squared = gaussian_radius().powi(2) - l * l;
    if half_chord_squared <= 0.0 {
        return 0.0;
    }
    let across = (-l * l / (2.0 * SIGMA * SIGMA)).exp();
    let along = libm::erf(half_chord_squared.sqrt() / (SIGMA * 2.0_f64.sqrt()));
    gaussian_peak() * across * along * SIGMA * (2.0 * PI).sqrt()
}

/// ∫₀ᵘ of the cut Gaussian along a line at distance l; u within the half chord.
fn gaussian_part(l: f64, u: f64) -> f64 {
    let across = (-l * l / (2.0 * SIGMA * SIGMA)).exp();
    let along = libm::erf(u / (SIGMA * 2.0_f64.sqrt()));
    gaussian_peak() * across * along * SIGMA * (PI / 2.0).sqrt()
}

/// ∫g over space is 0.9999992 (see the tests): nothing to renormalise.
fn cubic(r: f64) -> f64 {
    if r <= CUBIC_KNOT {
        let [a, _, c, d] = CUBIC_INNER;
        return a + r * r * (c + r * d);
    }
    if r > CUBIC_END {
        return 0.0;
    }
    let inward = CUBIC_END - r;
    inward * inward * (CUBIC_OUTER[0] + inward * CUBIC_OUTER[1])
}

/// The outer piece as powers 0 to 3 of r.
fn cubic_outer_powers() -> [f64; 4] {
    let ([b, c], t) = (CUBIC_OUTER, CUBIC_END);
    [t * t * (b + c * t), -t * (2.0 * b + 3.0 * c * t), b + 3.0 * c * t, -c]
}

fn cubic_footprint(l: f64) -> f64 {
    if l >= CUBIC_END {
        return 0.0;
    }
    // The four terms cancel at the rim, to within rounding.
    2.0 * cubic_part(l, half_chord(CUBIC_END, l)).max(0.0)
}

/// ∫₀ᵘ g(√(l² + w²)) dw; u within the half chord.
fn cubic_part(l: f64, u: f64) -> f64 {
    let outer = cubic_outer_powers();
    if l >= CUBIC_KNOT {
        return line_integral(outer, l, u);
    }
    let knot = half_chord(CUBIC_KNOT, l);
    if u <= knot {
        return line_integral(CUBIC_INNER, l, u);
    }
    line_integral(CUBIC_INNER, l, knot) + line_integral(outer, l, u) - line_integral(outer, l, knot)
}

/// ∫ 4πr² g(r) dr.
fn cubic_energy() -> f64 {
    // ∫₀ʳ Σ cₖ rᵏ⁺² dr.
    let moment = |c: [f64; 4], r: f64| -> f64 {
        (3_i32..).zip(c).map(|(power, c)| c * r.powi(power) / f64::from(power)).sum()
    };
    let outer = cubic_outer_powers();
    4.0 * PI
        * (moment(CUBIC_INNER, CUBIC_KNOT) + moment(outer, CUBIC_END) - moment(outer, CUBIC_KNOT))
}

/// √(r² − l²) without cancellation for l near r.
fn half_chord(r: f64, l: f64) -> f64 {
    ((r - l) * (r + l)).sqrt()
}

/// ∫₀ʷ Σ cₖ rᵏ dw' with r = √(l² + w'²): the first three odd and even moments of a line.
fn line_integral(c: [f64; 4], l: f64, w: f64) -> f64 {
    let r = l.hypot(w);
    // l² asinh(w/l) tends to 0 with l.
    let twisted = if l > 0.0 { l * l * (w / l).asinh() } else { 0.0 };
    let first = (w * r + twisted) / 2.0;
    let second = w * (l * l + w * w / 3.0);
    let third = w * r.powi(3) / 4.0 + 0.75 * l * l * first;
    c[0] * w + c[1] * first + c[2] * second + c[3] * third
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cubic_kernel() -> RadialKernel {
        RadialKernel::new(Kernel::Cubic, None).unwrap()
    }

    fn gaussian_kernel() -> RadialKernel {
        RadialKernel::new(Kernel::Gaussian, None).unwrap()
    }

    /// The midpoint rule over a..b.
    fn quadrature(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
        const STEPS: u32 = 40_000;
        let step = (b - a) / f64::from(STEPS);
        (0..STEPS).map(|i| f(a + (f64::from(i) + 0.5) * step)).sum::<f64>() * step
    }

    #[test]
    fn the_cubic_has_the_designs_figures() {
        let k = cubic_kernel();
        for (l, expected) in [(0.0, 0.699_943), (0.5, 0.427_743), (1.0, 0.073_868)] {
            assert!((k.footprint(l) - expected).abs() < 1e-6, "F({l}) = {}", k.footprint(l));
        }
        let integral = quadrature(0.0, k.radius(), |r| 4.0 * PI * r * r * k.value(r));
        assert!((integral - 0.999_999_2).abs() < 1e-7, "{integral}");
    }

    #[test]
    fn the_cubics_pieces_meet_as_closely_as_their_digits_allow() {
        let [a, _, c, d] = CUBIC_INNER;
        let s = CUBIC_KNOT;
        let outer = cubic_outer_powers();
        let c0 =
            a + s * s * (c + s * d) - (outer[0] + s * (outer[1] + s * (outer[2] + s * outer[3])));
        let c1 =
            s * (2.0 * c + 3.0 * s * d) - (outer[1] + s * (2.0 * outer[2] + 3.0 * s * outer[3]));
        assert!(c0.abs() < 1.6e-7, "{c0}");
        assert!(c1.abs() < 1.5e-6, "{c1}");
    }

    #[test]
    fn closed_footprints_equal_quadrature_of_h_along_the_line_at_every_extent() {
        for kernel in [Kernel::Gaussian, Kernel::Cubic] {
            for extent in [None, Some(0.01), Some(1.0), Some(3.7), Some(1e6), Some(1e-6)] {
                let k = RadialKernel::new(kernel, extent).unwrap();
                let peak = k.footprint(0.0);
                for i in 0..=20 {
                    let l = k.radius() * f64::from(i) / 20.0;
                    let half = (k.radius().powi(2) - l * l).max(0.0).sqrt();
                    let expected = 2.0 * quadrature(0.0, half, |w| k.value(l.hypot(w)));
                    let error = (k.footprint(l) - expected).abs() / peak;
                    assert!(error < 1e-8, "{kernel:?} {extent:?} l {l}: {error}");
                }
            }
        }
    }

    #[test]
    fn cumulatives_equal_quadrature_of_h_up_to_there_at_every_extent() {
        for kernel in [Kernel::Gaussian, Kernel::Cubic] {
            for extent in [None, Some(0.01), Some(3.7), Some(1e6), Some(1e-6)] {
                let k = RadialKernel::new(kernel, extent).unwrap();
                let (peak, radius) = (k.footprint(0.0), k.radius());
                for i in 0..=8 {
                    let l = radius * f64::from(i) / 8.0;
                    let half = (radius * radius - l * l).max(0.0).sqrt();
                    for j in -8..=8 {
                        let u = half * f64::from(j) / 8.0;
                        let expected = quadrature(-half, u, |w| k.value(l.hypot(w)));
                        let error = (k.cumulative(l, u) - expected).abs() / peak;
                        assert!(error < 1e-8, "{kernel:?} {extent:?} l {l} u {u}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn cumulatives_rise_from_nothing_to_exactly_the_footprint() {
        for kernel in [Kernel::Gaussian, Kernel::Cubic] {
            for extent in [None, Some(0.3), Some(7.0)] {
                let k = RadialKernel::new(kernel, extent).unwrap();
                for i in 0..=40 {
                    let l = k.radius() * 1.05 * f64::from(i) / 40.0;
                    let whole = k.footprint(l);
                    for beyond in [k.radius(), 1e300, f64::INFINITY] {
                        assert_eq!(k.cumulative(l, -beyond), 0.0);
                        assert_eq!(k.cumulative(l, beyond), whole, "{kernel:?} {extent:?} {l}");
                    }
                    let at = |j: i32| k.cumulative(l, k.radius() * 1.1 * f64::from(j) / 500.0);
                    for j in -500..500 {
                        // Within a few roundings of the line integral's terms.
                        let rise = at(j + 1) - at(j);
                        assert!(rise >= -1e-15 * k.footprint(0.0), "{kernel:?} {l} {j}: {rise}");
                        assert!((at(j) + at(-j) - whole).abs() <= 1e-15 * k.footprint(0.0));
                    }
                }
            }
        }
    }

    #[test]
    fn energies_are_those_of_the_kernels_in_space() {
        for kernel in [Kernel::Gaussian, Kernel::Cubic] {
            for extent in [None, Some(0.3), Some(5.0)] {
                let k = RadialKernel::new(kernel, extent).unwrap();
                let ball = quadrature(0.0, k.radius(), |r| 4.0 * PI * r * r * k.value(r));
                assert!((k.energy() - ball).abs() < 2e-9, "{kernel:?} {extent:?}: {ball}");
            }
        }
        assert!((cubic_kernel().energy() - 0.999_999_2).abs() < 5e-8);
    }

    #[test]
    fn every_extent_keeps_the_integral_over_space() {
        for extent in [0.3, 1.556, 5.0] {
            for kernel in [Kernel::Gaussian, Kernel::Cubic] {
                let k = RadialKernel::new(kernel, Some(extent)).unwrap();
                let over_plane = quadrature(0.0, k.radius(), |l| 2.0 * PI * l * k.footprint(l));
                assert!((over_plane - 1.0).abs() < 1e-6, "{kernel:?} {extent}: {over_plane}");
            }
        }
    }

    #[test]
    fn outside_its_radius_a_kernel_is_nothing_and_extents_that_mean_nothing_are_natural() {
        for kernel in [Kernel::Gaussian, Kernel::Cubic] {
            let k = RadialKernel::new(kernel, Some(2.5)).unwrap();
            let beyond = k.radius() * 1.000_001;
            assert_eq!((k.value(beyond), k.footprint(beyond)), (0.0, 0.0));
            for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
                assert_eq!(RadialKernel::new(kernel, Some(bad)), RadialKernel::new(kernel, None));
            }
        }
        assert_eq!(RadialKernel::new(Kernel::Nearest, None), None);
    }

    #[test]
    fn the_gaussians_energies_are_the_designs() {
        // Within a cube of half-edge 2, a ball of radius 2, a ball cut at 0.004, and a
        // two-dimensional footprint cut at 0.004.
        let cube = libm::erf(2.0 / (SIGMA * 2.0_f64.sqrt())).powi(3);
        assert!((cube - 0.997_43).abs() < 1e-5, "{cube}");
        assert!((gaussian_energy_within(2.0) - 0.988_86).abs() < 1e-5);
        assert!((gaussian_energy_within(gaussian_radius()) - 0.988_50).abs() < 1e-5);
        let plane = quadrature(0.0, gaussian_radius(), |l| {
            l / (SIGMA * SIGMA) * (-l * l / (2.0 * SIGMA * SIGMA)).exp()
        });
        assert!((plane - 0.996).abs() < 1e-6, "{plane}");
        let ball =
            quadrature(0.0, gaussian_radius(), |r| 4.0 * PI * r * r * gaussian_kernel().value(r));
        assert!((ball - 1.0).abs() < 1e-6, "{ball}");
    }

    /// Σ h over the lattice at a point of the unit cell.
    fn lattice_sum(k: RadialKernel, p: [f64; 3]) -> f64 {
        let near = -2..=3_i32;
        let square = |n: i32, axis: usize| (p[axis] - f64::from(n)).powi(2);
        let mut sum = 0.0;
        for x in near.clone() {
            for y in near.clone() {
                for z in near.clone() {
                    sum += k.value((square(x, 0) + square(y, 1) + square(z, 2)).sqrt());
                }
            }
        }
        sum
    }

    #[test]
    fn the_cubics_lattice_sum_deviates_as_crawfis_and_max_say() {
        let k = cubic_kernel();
        let n = 24;
        let (mut squares, mut least, mut greatest) = (0.0, (0.0, [0.0; 3]), (0.0, [0.0; 3]));
        for i in 0..n * n * n {
            let p = [i % n, i / n % n, i / (n * n)].map(|j| f64::from(j) / f64::from(n));
            let deviation = lattice_sum(k, p) - 1.0;
            squares += deviation * deviation;
            if deviation < least.0 {
                least = (deviation, p);
            }
            if deviation > greatest.0 {
                greatest = (deviation, p);
            }
        }
        let rms = (squares / f64::from(n * n * n)).sqrt();
        assert!((rms - 0.001_19).abs() < 1e-5, "{rms}");
        assert!((least.0 + 0.002_33).abs() < 3e-5, "{least:?}");
        assert!(least.1.iter().all(|x| (x.min(1.0 - x) - 0.26).abs() < 0.03), "{least:?}");
        assert!((greatest.0 - 0.0053).abs() < 5e-5, "{greatest:?}");
        assert!((lattice_sum(k, [0.5, 0.5, 0.0]) - 1.0 - 0.0053).abs() < 5e-5);
    }

    #[test]
    fn one_layer_of_cubics_projected_along_its_axis_is_flat_to_a_quarter_percent() {
        let k = cubic_kernel();
        let layer = |x: f64, y: f64| -> f64 {
            (-2..=3_i32)
                .flat_map(|i| (-2..=3_i32).map(move |j| (f64::from(i), f64::from(j))))
                .map(|(i, j)| k.footprint((x - i).hypot(y - j)))
                .sum()
        };
        assert!((layer(0.5, 0.5) - 1.002_49).abs() < 1e-5, "{}", layer(0.5, 0.5));
        assert!((layer(0.25, 0.25) - 0.998_45).abs() < 1e-5, "{}", layer(0.25, 0.25));
        for i in 0..=40 {
            for j in 0..=40 {
                let sum = layer(f64::from(i) / 40.0, f64::from(j) / 40.0);
                assert!((0.998_44..=1.002_50).contains(&sum), "{i} {j}: {sum}");
            }
        }
    }
}

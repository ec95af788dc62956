//! Separable kernels on lattices: the tent and the cubic B-spline.

use super::Kernel;

/// A product h(x/s)·h(y/s)·h(z/s) of one-dimensional kernels along a lattice's axes, in voxels, at some
/// extent: s = E/E₀.
///
/// At its natural extent its values at the lattice's samples sum to 1 wherever the lattice is met (partition
/// of unity), and nothing is to be normalised. At others they do not: see [`Separable::weights`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Separable {
    shape: Shape,
    /// s, > 0.
    scale: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Tent,
    CubicBSpline,
}

impl Separable {
    /// The separable kernel of a kind, drawn with a splat radius of `extent` voxels (`None`: its natural one);
    /// `None` for kinds that are not separable.
    ///
    /// An extent that is not finite and positive counts as the natural one; whoever takes extents from people
    /// refuses those first.
    pub fn new(kernel: Kernel, extent: Option<f64>) -> Option<Self> {
        let shape = match kernel {
            Kernel::Linear => Shape::Tent,
            Kernel::BSpline => Shape::CubicBSpline,
            Kernel::Point
            | Kernel::Nearest
            | Kernel::Gaussian
            | Kernel::Cubic
            | Kernel::Gouraud
            | Kernel::Functions
            | Kernel::Cells
            | Kernel::Ellipsoids => return None,
        };
        let extent = extent.filter(|e| e.is_finite() && *e > 0.0);
        Some(Self { shape, scale: kernel.scale(extent) })
    }

    /// s = E/E₀: how much wider than natural it is.
    pub fn scale(self) -> f64 {
        self.scale
    }

    /// The distance along an axis at and beyond which the one-dimensional kernel is 0.
    pub fn radius(self) -> f64 {
        self.scale
            * match self.shape {
                Shape::Tent => 1.0,
                Shape::CubicBSpline => 2.0,
            }
    }

    /// The one-dimensional kernel h(x/s) at `x` voxels from its centre.
    pub fn value(self, x: f64) -> f64 {
        let x = (x / self.scale).abs();
        match self.shape {
            Shape::Tent => (1.0 - x).max(0.0),
            Shape::CubicBSpline if x < 1.0 => 2.0 / 3.0 - x * x * (1.0 - x / 2.0),
            Shape::CubicBSpline => (2.0 - x).max(0.0).powi(3) / 6.0,
        }
    }

    /// What samples at whole numbers weigh at `x`, h((x − i)/s) / Σ h, and the first of them. Where none is in
    /// reach it is the nearest: what kernels that narrow until they no longer meet leave.
    pub fn weights(self, x: f64) -> (i64, Vec<f64>) {
        #[expect(clippy::cast_possible_truncation, reason = "places in a lattice")]
        let [low, high] = [(x - self.radius()).ceil() as i64, (x + self.radius()).floor() as i64];
        let mut weights: Vec<f64> = (low..=high).map(|i| self.value(x - i as f64)).collect();
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 {
            weights.iter_mut().for_each(|w| *w /= sum);
            return (low, weights);
        }
        #[expect(clippy::cast_possible_truncation, reason = "places in a lattice")]
        let nearest = (x + 0.5).floor() as i64;
        (nearest, vec![1.0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn both() -> [Separable; 2] {
        [Kernel::Linear, Kernel::BSpline].map(|kernel| Separable::new(kernel, None).unwrap())
    }

    #[test]
    fn what_samples_weigh_is_a_partition_of_unity() {
        for kernel in both() {
            for i in 0..=64 {
                let fraction = f64::from(i) / 64.0;
                let weights = [-1.0, 0.0, 1.0, 2.0].map(|sample| kernel.value(fraction - sample));
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{kernel:?} {fraction}");
                let mean = weights[1] * 0.0 - weights[0] + weights[2] + 2.0 * weights[3];
                assert!((mean - fraction).abs() < 1e-15, "a ramp is kept: {kernel:?} {fraction}");
            }
        }
    }

    #[test]
    fn the_b_spline_has_its_known_values_and_two_continuous_derivatives() {
        let spline = Separable::new(Kernel::BSpline, None).unwrap();
        for (x, expected) in [(0.0, 2.0 / 3.0), (1.0, 1.0 / 6.0), (-0.5, 23.0 / 48.0), (2.0, 0.0)] {
            assert!((spline.value(x) - expected).abs() < 1e-15, "{x}");
        }
        // Second differences on either side of the knots 0, 1 and 2; a jump there would be O(1).
        let h = 1e-3;
        let second =
            |x: f64| (spline.value(x + h) - 2.0 * spline.value(x) + spline.value(x - h)) / (h * h);
        for (knot, expected) in [(0.0, -2.0), (1.0, 1.0), (2.0, 0.0)] {
            for x in [knot - 2.0 * h, knot + 2.0 * h] {
                assert!((second(x) - expected).abs() < 10.0 * h, "{x}: {}", second(x));
            }
        }
    }

    #[test]
    fn separable_kernels_end_at_their_radius_and_integrate_to_one() {
        for kernel in both() {
            let n = 4000;
            let step = kernel.radius() / f64::from(n);
            let half: f64 = (0..n).map(|i| kernel.value((f64::from(i) + 0.5) * step) * step).sum();
            assert!((2.0 * half - 1.0).abs() < 1e-6, "{kernel:?}: {half}");
            assert_eq!(kernel.value(kernel.radius()), 0.0);
            assert_eq!(kernel.value(-1e9), 0.0);
            assert!(kernel.value(0.999 * kernel.radius()) > 0.0);
        }
        assert_eq!(Separable::new(Kernel::Cubic, None), None);
    }

    #[test]
    fn weights_sum_to_one_at_every_extent_and_narrow_to_the_nearest_sample() {
        for (kernel, natural) in [(Kernel::Linear, 1.0), (Kernel::BSpline, 2.0)] {
            for scale in [1e-6, 0.1, 0.25, 0.5, 0.8, 1.0, 1.5, 3.0, 4.0] {
                let kernel = Separable::new(kernel, Some(natural * scale)).unwrap();
                assert!((kernel.radius() - natural * scale).abs() < 1e-12);
                for i in 0..=64 {
                    let x = 7.0 + f64::from(i) / 64.0;
                    let (first, weights) = kernel.weights(x);
                    assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{kernel:?} {x}");
                    // As far to one side as to the other, seen from the other end.
                    let (mirrored, reversed) = kernel.weights(15.0 - x);
                    let mean = |first: i64, weights: &[f64]| -> f64 {
                        weights.iter().zip(first..).map(|(w, i)| w * i as f64).sum()
                    };
                    let sum = mean(first, &weights) + mean(mirrored, &reversed);
                    assert!((sum - 15.0).abs() < 1e-12 || x == 7.5, "{kernel:?} {x}: {sum}");
                    if kernel.radius() < 0.5 {
                        assert_eq!(weights, [1.0]);
                        assert!((x - first as f64).abs() <= 0.5);
                    }
                }
            }
        }
    }
}

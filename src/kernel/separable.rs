//! Separable kernels on lattices: the tent and the cubic B-spline.

use super::Kernel;

/// A product h(x)·h(y)·h(z) of one-dimensional kernels along a lattice's axes, in voxels.
///
/// Its values at the lattice's samples sum to 1 wherever the lattice is met (partition of unity),
/// so nothing is to be normalised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Separable {
    shape: Shape,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Tent,
    CubicBSpline,
}

impl Separable {
    /// The separable kernel of a kind; `None` for kinds that are not separable.
    pub fn new(kernel: Kernel) -> Option<Self> {
        let shape = match kernel {
            Kernel::Linear => Shape::Tent,
            Kernel::BSpline => Shape::CubicBSpline,
            Kernel::Point
            | Kernel::Nearest
            | Kernel::Gaussian
            | Kernel::Cubic
            | Kernel::Gouraud => return None,
        };
        Some(Self { shape })
    }

    /// The distance along an axis at and beyond which the one-dimensional kernel is 0.
    pub fn radius(self) -> f64 {
        match self.shape {
            Shape::Tent => 1.0,
            Shape::CubicBSpline => 2.0,
        }
    }

    /// The one-dimensional kernel at `x` voxels from its centre.
    pub fn value(self, x: f64) -> f64 {
        let x = x.abs();
        match self.shape {
            Shape::Tent => (1.0 - x).max(0.0),
            Shape::CubicBSpline if x < 1.0 => 2.0 / 3.0 - x * x * (1.0 - x / 2.0),
            Shape::CubicBSpline => (2.0 - x).max(0.0).powi(3) / 6.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn both() -> [Separable; 2] {
        [Kernel::Linear, Kernel::BSpline].map(|kernel| Separable::new(kernel).unwrap())
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
        let spline = Separable::new(Kernel::BSpline).unwrap();
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
        assert_eq!(Separable::new(Kernel::Cubic), None);
    }
}

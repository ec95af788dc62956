//! Every kernel as a body in space: its values, what it holds, and how many pixels it may touch.

use glam::{DMat3, DVec3};

use super::{Kernel, RadialKernel, Separable};

impl Kernel {
    /// h at an `offset` from the kernel's centre, in voxels of kernel space, at a splat radius of
    /// `extent` voxels where that applies (`None`: the natural one).
    ///
    /// `None` for [`Kernel::Point`], which is one pixel and has no form in space. The box holds its
    /// lower faces, so that boxes fill space without overlap.
    pub fn value(self, extent: Option<f64>, offset: DVec3) -> Option<f64> {
        if let Some(radial) = RadialKernel::new(self, extent) {
            return Some(radial.value(offset.length()));
        }
        if let Some(separable) = Separable::new(self) {
            return Some(offset.to_array().map(|x| separable.value(x)).into_iter().product());
        }
        let inside = offset.to_array().iter().all(|x| (-0.5..0.5).contains(x));
        (self == Self::Nearest).then_some(if inside { 1.0 } else { 0.0 })
    }

    /// ∫ h over kernel space: 1, but for the cubic's digits ([`RadialKernel::energy`]). `None` for
    /// [`Kernel::Point`], which has no form in space.
    pub fn energy(self, extent: Option<f64>) -> Option<f64> {
        match self {
            Self::Point => None,
            Self::Nearest | Self::Linear | Self::BSpline => Some(1.0),
            Self::Gaussian | Self::Cubic | Self::Gouraud => {
                RadialKernel::new(self, extent).map(RadialKernel::energy)
            }
        }
    }

    /// Pixels across and down of the rectangle that the kernel's footprint may touch when it is
    /// centred on a pixel: 2⌊half-width⌋ + 1 (Westover, Table 4.01).
    ///
    /// `screen_from_kernel` is the map to (screen x, screen y, view z) in pixels. Radial kernels
    /// count as a ball of their splat radius, the others as a box. (Westover's printed extent gives
    /// 7 for the box at twice the spacing, where his table has 5.)
    pub fn footprint_pixels(self, extent: Option<f64>, screen_from_kernel: DMat3) -> [u64; 2] {
        let rows = screen_from_kernel.transpose();
        [rows.x_axis, rows.y_axis].map(|row| {
            let across = row.abs().element_sum();
            let half = match self {
                Self::Point => 0.0,
                Self::Nearest => 0.5 * across,
                Self::Linear => across,
                Self::BSpline => 2.0 * across,
                Self::Gaussian | Self::Cubic | Self::Gouraud => {
                    let extent = extent.or(self.natural_extent());
                    extent.unwrap_or_default() * row.length()
                }
            };
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "not negative, and a count beyond 2^64 saturates"
            )]
            let whole = half.floor() as u64;
            whole.saturating_mul(2).saturating_add(1)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::ProjectedKernel;

    const WITH_FORM: [Kernel; 5] =
        [Kernel::Nearest, Kernel::Linear, Kernel::Gaussian, Kernel::Cubic, Kernel::BSpline];

    #[test]
    fn energies_are_the_integrals_of_the_values_over_space() {
        // The midpoint rule over one octant; the box ends between two points.
        let (n, half) = (52_i32, 2.0);
        let step = half / f64::from(n);
        let at = |i: i32| (f64::from(i) + 0.5) * step;
        for kernel in WITH_FORM {
            let mut sum = 0.0;
            for (x, y) in (0..n).flat_map(|x| (0..n).map(move |y| (x, y))) {
                for z in 0..n {
                    sum += kernel.value(None, DVec3::new(at(x), at(y), at(z))).unwrap();
                }
            }
            let integral = 8.0 * sum * step.powi(3);
            let energy = kernel.energy(None).unwrap();
            // The rule's own error at 52 points an axis.
            assert!((integral - energy).abs() < 2e-4, "{kernel:?}: {integral} {energy}");
        }
        assert_eq!(
            (Kernel::Point.value(None, DVec3::ZERO), Kernel::Point.energy(None)),
            (None, None)
        );
    }

    #[test]
    fn values_are_those_of_the_one_dimensional_forms() {
        let at = DVec3::new(0.3, -0.4, 0.2);
        let value = |kernel: Kernel| kernel.value(None, at).unwrap();
        assert!((value(Kernel::Linear) - 0.7 * 0.6 * 0.8).abs() < 1e-15);
        let cubic = RadialKernel::new(Kernel::Cubic, None).unwrap();
        assert_eq!(value(Kernel::Cubic), cubic.value(at.length()));
        let wide = RadialKernel::new(Kernel::Cubic, Some(3.0)).unwrap();
        assert_eq!(Kernel::Cubic.value(Some(3.0), at), Some(wide.value(at.length())));
        for (x, inside) in [(-0.5, 1.0), (0.499, 1.0), (0.5, 0.0), (-0.501, 0.0)] {
            assert_eq!(Kernel::Nearest.value(None, DVec3::new(0.0, x, 0.0)), Some(inside), "{x}");
        }
    }

    #[test]
    fn boxes_tents_and_splines_sum_to_one_over_the_lattice() {
        for kernel in [Kernel::Nearest, Kernel::Linear, Kernel::BSpline] {
            for i in 0..7 * 7 * 7 {
                let at =
                    DVec3::new(f64::from(i % 7), f64::from(i / 7 % 7), f64::from(i / 49)) / 7.0;
                let mut sum = 0.0;
                for j in 0..6 * 6 * 6 {
                    let sample =
                        DVec3::new(f64::from(j % 6), f64::from(j / 6 % 6), f64::from(j / 36));
                    sum += kernel.value(None, at - sample + 2.0).unwrap();
                }
                assert!((sum - 1.0).abs() < 1e-14, "{kernel:?} {at}: {sum}");
            }
        }
    }

    #[test]
    fn footprints_have_westovers_pixels_at_scale_two_and_spacing_one_one_two() {
        // Seen along y: the long axis runs down the picture.
        let map = DMat3::from_cols(DVec3::X * 2.0, DVec3::Z * 2.0, DVec3::Y * 4.0);
        let pixels = |kernel: Kernel| kernel.footprint_pixels(None, map);
        assert_eq!(pixels(Kernel::Point), [1, 1]);
        assert_eq!(pixels(Kernel::Nearest), [3, 5]);
        assert_eq!(pixels(Kernel::Gaussian), [9, 17]);
        assert_eq!(pixels(Kernel::Linear), [5, 9]);
        // The same from the ellipse.
        let half = ProjectedKernel::new(map).unwrap().half_extents * 2.0;
        assert_eq!([half.x, half.y].map(|h| 2.0 * h.floor() + 1.0), [9.0, 17.0]);
        let wide = Kernel::Cubic.footprint_pixels(Some(1e300), map);
        assert_eq!(wide, [u64::MAX, u64::MAX]);
    }
}

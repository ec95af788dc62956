//! How a kernel lands on the picture: the ellipse it covers, and how deep it is there.

use glam::{DMat2, DMat3, DVec2, DVec3};

/// A row this much shorter than it was before its part along the others was taken out holds
/// rounding alone: the kernel has no extent in that direction.
const RANK_TOLERANCE: f64 = 1e-13;

/// A kernel seen along the depth axis of screen space.
///
/// With A the map from kernel space to (screen x, screen y, view z), Q = (A Aᵀ)⁻¹, C = Q_zz and
/// P = (upper-left 2×2 of A Aᵀ)⁻¹, the depth integral of h(|A⁻¹(p, z)|) at screen offset p is
/// F(√(pᵀPp))/√C, whatever the kernel's turn and stretch. That is Westover's ellipse (§3.7.4), with
/// the amplitude that he doubts in §5.4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProjectedKernel {
    /// 1/√C: view depth covered per voxel of kernel space; > 0.
    pub depth_per_unit: f64,
    /// L with LᵀL = P, lower triangular: `l = |L p|`.
    pub unit_from_screen: DMat2,
    /// L⁻¹: takes the unit circle to the ellipse.
    pub screen_from_unit: DMat2,
    /// The kernel's middle at offset p lies at view depth `tilt · p` from its centre:
    /// z̄ = −(Q_xz p_x + Q_yz p_y)/C.
    pub tilt: DVec2,
    /// √((A Aᵀ)₁₁), √((A Aᵀ)₂₂): half the size of the upright box about the unit ellipse.
    pub half_extents: DVec2,
}

impl ProjectedKernel {
    /// Projects a kernel whose map to (screen x, screen y, view z) is `screen_from_kernel`.
    ///
    /// `None` where the map is not finite or flattens the kernel (a zero axis, or axes in one
    /// plane): such a kernel has no well-defined depth.
    ///
    /// A = T·(rotation) with T lower triangular holds everything: A Aᵀ = T Tᵀ, so L is the inverse
    /// of T's upper-left 2×2, 1/√C is its last diagonal entry and the tilt its last row. Forming T
    /// from A's rows, not from A Aᵀ, keeps all digits at spacings like 1:1:1000.
    pub fn new(screen_from_kernel: DMat3) -> Option<Self> {
        let rows = screen_from_kernel.transpose();
        let (x, y, z) = (rows.x_axis, rows.y_axis, rows.z_axis);
        let t00 = x.length();
        let e0 = x / t00;
        let t10 = y.dot(e0);
        let y_rest = y - e0 * t10;
        let t11 = y_rest.length();
        // A second pass takes out what rounding left along the first axis.
        let e1 = y_rest / t11;
        let e1 = (e1 - e0 * e1.dot(e0)).normalize();
        let (t20, t21) = (z.dot(e0), z.dot(e1));
        let t22 = z.dot(e0.cross(e1)).abs();
        let thin = |rest: f64, whole: f64| rest <= RANK_TOLERANCE * whole;
        let finite = [t00, t11, t22, t10, t20, t21].into_iter().all(f64::is_finite);
        if !finite || t00 == 0.0 || thin(t11, y.length()) || thin(t22, z.length()) {
            return None;
        }
        let screen_from_unit = DMat2::from_cols(DVec2::new(t00, t10), DVec2::new(0.0, t11));
        let unit_from_screen =
            DMat2::from_cols(DVec2::new(1.0 / t00, -t10 / t00 / t11), DVec2::new(0.0, 1.0 / t11));
        if !unit_from_screen.is_finite() {
            return None;
        }
        Some(Self {
            depth_per_unit: t22,
            unit_from_screen,
            screen_from_unit,
            tilt: unit_from_screen.transpose() * DVec2::new(t20, t21),
            half_extents: DVec2::new(t00, y.length()),
        })
    }

    /// The same kernel with half axes, for a unit kernel, of at least `least` screen units: a
    /// low-pass for what is thinner than a pixel. The amplitude falls as the area grows, so that
    /// the depth summed over the picture stays. The tilt is kept.
    pub fn widened(&self, least: f64) -> Self {
        let k = self.screen_from_unit;
        let gram = k * k.transpose();
        let (a, b, d) = (gram.x_axis.x, gram.x_axis.y, gram.y_axis.y);
        let determinant = (k.x_axis.x * k.y_axis.y).abs();
        let spread = (0.25 * (a - d) * (a - d) + b * b).sqrt();
        let large = 0.5 * (a + d) + spread;
        // Not ½(a + d) − spread, which cancels.
        let small = determinant * determinant / large;
        let floor = least * least;
        if small >= floor {
            return *self;
        }
        let (new_large, new_small) = (large.max(floor), floor);
        // The same axes with new lengths: mean' + n·(G − mean).
        let n = if spread > 0.0 { 0.5 * (new_large - new_small) / spread } else { 0.0 };
        let mean = 0.5 * (a + d);
        let k11 = (0.5 * (new_large + new_small) + n * (a - mean)).sqrt();
        let area = (new_large * new_small).sqrt();
        let (k21, k22) = (n * b / k11, area / k11);
        Self {
            depth_per_unit: self.depth_per_unit * determinant / area,
            unit_from_screen: DMat2::from_cols(
                DVec2::new(1.0 / k11, -k21 / (k11 * k22)),
                DVec2::new(0.0, 1.0 / k22),
            ),
            screen_from_unit: DMat2::from_cols(DVec2::new(k11, k21), DVec2::new(0.0, k22)),
            tilt: self.tilt,
            half_extents: DVec2::new(k11, k21.hypot(k22)),
        }
    }

    /// Distance from the centre in voxels of kernel space, l = √(pᵀPp).
    pub fn distance(&self, offset: DVec2) -> f64 {
        (self.unit_from_screen * offset).length()
    }
}

/// J = ∂(screen x, screen y, view z)/∂(view x, y, z) in perspective, at a view-space point.
///
/// Screen units are world units at the focal plane, which lies `eye_distance` from the eye:
/// screen x = d·x/z. `None` at or behind the eye. When orthographic J is the identity.
pub fn perspective_jacobian(view: DVec3, eye_distance: f64) -> Option<DMat3> {
    if view.z.is_nan() || view.z <= 0.0 {
        return None;
    }
    let shrink = eye_distance / view.z;
    let slope = -shrink / view.z;
    let jacobian = DMat3::from_cols(
        DVec3::new(shrink, 0.0, 0.0),
        DVec3::new(0.0, shrink, 0.0),
        DVec3::new(slope * view.x, slope * view.y, 1.0),
    );
    jacobian.is_finite().then_some(jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{Kernel, RadialKernel};

    fn maps() -> Vec<(&'static str, DMat3)> {
        let turned = |angle: f64| DMat3::from_rotation_y(angle) * DMat3::from_rotation_x(0.4);
        let stretch = |x, y, z| DMat3::from_diagonal(DVec3::new(x, y, z));
        let shear =
            DMat3::from_cols(DVec3::X, DVec3::new(0.6, 1.0, 0.2), DVec3::new(-0.3, 0.1, 1.));
        let quarter = std::f64::consts::FRAC_PI_4;
        vec![
            ("identity", DMat3::IDENTITY),
            ("45° in the picture", DMat3::from_rotation_z(quarter) * stretch(1.0, 3.0, 1.0)),
            ("45° about every axis", turned(quarter) * DMat3::from_rotation_z(quarter)),
            ("turned 1:2:5", turned(0.7) * stretch(1.0, 2.0, 5.0)),
            ("flat, seen at 45°", turned(quarter) * stretch(1.0, 1.0, 0.01)),
            ("1:1:1000 end on", stretch(1.0, 1.0, 1000.0)),
            ("1:1:1000 turned", turned(1.1) * stretch(1.0, 1.0, 1000.0)),
            ("sheared", turned(0.3) * shear),
            ("reflected", turned(0.3) * shear * stretch(-1.0, 1.0, 1.0)),
        ]
    }

    /// ∫ h(|A⁻¹(p, z)|) dz by the midpoint rule over the whole ellipsoid's depth.
    fn depth_integral(kernel: RadialKernel, a: DMat3, p: DVec2) -> f64 {
        let inverse = a.inverse();
        let start = inverse * p.extend(0.0);
        let step = inverse.z_axis;
        // Only where the line can meet the ball: the nearest point ± the radius.
        let middle = -start.dot(step) / step.dot(step);
        let half = kernel.radius() / step.length();
        let n = 20_000;
        let dz = 2.0 * half / f64::from(n);
        let sum: f64 = (0..n)
            .map(|i| {
                let z = middle - half + (f64::from(i) + 0.5) * dz;
                kernel.value((start + step * z).length())
            })
            .sum();
        sum * dz
    }

    #[test]
    fn the_projected_kernel_is_its_depth_integral_for_every_map_and_extent() {
        for (name, map) in maps() {
            for world in [1.0, 1e-6, 1e6] {
                for kind in [Kernel::Cubic, Kernel::Gaussian] {
                    let kernel = RadialKernel::new(kind, Some(1.3)).unwrap();
                    let a = map * world;
                    let projected = ProjectedKernel::new(a).unwrap();
                    let scale = projected.depth_per_unit * kernel.footprint(0.0);
                    for (l, turn) in [(0.0, 0.0), (0.3, 0.5), (0.8, 2.5), (1.1, 4.0)] {
                        let p = projected.screen_from_unit * (DVec2::from_angle(turn) * l);
                        assert!((projected.distance(p) - l).abs() < 1e-9);
                        let ours = projected.depth_per_unit * kernel.footprint(l);
                        let error = (ours - depth_integral(kernel, a, p)).abs() / scale;
                        assert!(error < 1e-6, "{name} × {world} {kind:?} l {l}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_factors_are_those_of_the_quadric() {
        for (name, a) in maps() {
            let projected = ProjectedKernel::new(a).unwrap();
            let gram = a * a.transpose();
            let q = gram.inverse();
            let p = DMat2::from_cols(gram.x_axis.truncate(), gram.y_axis.truncate()).inverse();
            let l = projected.unit_from_screen;
            let difference = l.transpose() * l - p;
            // The comparison forms A Aᵀ, whose condition is 1e6 at 1:1:1000.
            let tolerance = 1e-7 * p.x_axis.length().max(p.y_axis.length());
            assert!(difference.x_axis.length() + difference.y_axis.length() < tolerance, "{name}");
            let c = q.z_axis.z;
            assert!((projected.depth_per_unit * c.sqrt() - 1.0).abs() < 1e-6, "{name}");
            let tilt = -DVec2::new(q.z_axis.x, q.z_axis.y) / c;
            assert!((projected.tilt - tilt).length() < 1e-6 * (1.0 + tilt.length()), "{name}");
            let size = DVec2::new(gram.x_axis.x.sqrt(), gram.y_axis.y.sqrt());
            assert!((projected.half_extents - size).length() < 1e-9 * size.length(), "{name}");
        }
    }

    #[test]
    fn the_tilt_points_at_the_middle_of_the_chord() {
        let a = DMat3::from_rotation_y(0.7) * DMat3::from_diagonal(DVec3::new(1.0, 2.0, 5.0));
        let projected = ProjectedKernel::new(a).unwrap();
        let p = projected.screen_from_unit * DVec2::new(0.4, -0.3);
        let inverse = a.inverse();
        let distance = |z: f64| (inverse * p.extend(z)).length();
        let middle = projected.tilt.dot(p);
        assert!((distance(middle) - 0.5).abs() < 1e-12);
        for step in [0.01, -0.01, 1.0, -1.0] {
            assert!(distance(middle + step) > distance(middle));
            assert!((distance(middle + step) - distance(middle - step)).abs() < 1e-12);
        }
    }

    #[test]
    fn kernels_without_depth_or_sense_are_none_and_never_nan() {
        let flat = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0));
        let edge_on = DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0));
        let turned = DMat3::from_rotation_y(0.8) * DMat3::from_rotation_x(0.3) * flat;
        for bad in [flat, edge_on, turned, DMat3::ZERO, DMat3::NAN, DMat3::IDENTITY * f64::INFINITY]
        {
            assert_eq!(ProjectedKernel::new(bad), None, "{bad:?}");
        }
    }

    /// A Cholesky factor exists at every angle: nothing special happens at 45°, where Westover's
    /// equations (4) to (12) divide by zero.
    #[test]
    fn an_ellipse_turned_through_forty_five_degrees_changes_no_faster_there_than_elsewhere() {
        for (long, short) in [(3.0, 1.0), (1000.0, 1.0), (1.0, 1.0)] {
            let at = |angle: f64| {
                let stretch = DMat3::from_diagonal(DVec3::new(long, short, 1.0));
                ProjectedKernel::new(DMat3::from_rotation_z(angle) * stretch).unwrap()
            };
            for quarter in [1.0, -1.0, 3.0, 5.0] {
                let angle = quarter * std::f64::consts::FRAC_PI_4;
                let (before, on, after) = (at(angle - 1e-9), at(angle), at(angle + 1e-9));
                for other in [before, after] {
                    let turned = (other.unit_from_screen - on.unit_from_screen).to_cols_array();
                    assert!(turned.iter().all(|d| d.abs() < 1e-5), "{long} {quarter}: {turned:?}");
                }
                // The ends of both axes lie on the unit circle.
                for (axis, length) in [(0.0, long), (std::f64::consts::FRAC_PI_2, short)] {
                    let end = DVec2::from_angle(angle + axis) * length;
                    assert!((on.distance(end) - 1.0).abs() < 1e-9, "{long} {quarter} {axis}");
                }
            }
        }
    }

    #[test]
    fn a_disc_on_its_way_to_edge_on_thins_steadily_and_keeps_its_depth() {
        for thickness in [1.0, 1e-3, 1e-6] {
            for lean in [0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0] {
                // Thin along z, then stood on edge: the depth axis lies in the disc.
                let disc = DMat3::from_diagonal(DVec3::new(1.0, 1.0, thickness));
                let turn = DMat3::from_rotation_x(std::f64::consts::FRAC_PI_2 - lean);
                let projected = ProjectedKernel::new(turn * disc).unwrap();
                let height = (thickness * lean.cos()).hypot(lean.sin());
                assert!((projected.half_extents.x - 1.0).abs() < 1e-12);
                let error = projected.half_extents.y / height - 1.0;
                assert!(error.abs() < 1e-9, "{thickness} {lean}: {error}");
                // Area × depth is the ellipsoid's volume, whatever the view.
                let volume = projected.depth_per_unit * projected.screen_from_unit.determinant();
                assert!((volume / thickness - 1.0).abs() < 1e-9, "{thickness} {lean}: {volume}");
            }
        }
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_projection() {
        let d = 7.0;
        let screen = |v: DVec3| DVec3::new(d * v.x / v.z, d * v.y / v.z, v.z);
        let at = DVec3::new(1.3, -2.0, 4.5);
        let jacobian = perspective_jacobian(at, d).unwrap();
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let h = 1e-6;
            let slope = (screen(at + axis * h) - screen(at - axis * h)) / (2.0 * h);
            assert!((jacobian * axis - slope).length() < 1e-8, "{axis}");
        }
        for z in [0.0, -1.0, f64::NAN] {
            assert_eq!(perspective_jacobian(DVec3::new(1.0, 1.0, z), d), None);
        }
    }

    #[test]
    fn a_widened_kernel_keeps_its_depth_and_has_the_least_half_axis() {
        for (name, map) in maps() {
            let thin = ProjectedKernel::new(map * DMat3::from_diagonal(DVec3::new(0.1, 0.2, 3.0)));
            let thin = thin.unwrap();
            for least in [0.05, 0.5, 2.0, 100.0] {
                let wide = thin.widened(least);
                let k = wide.screen_from_unit;
                let area = |k: ProjectedKernel| k.screen_from_unit.determinant();
                let (before, after) =
                    (thin.depth_per_unit * area(thin), wide.depth_per_unit * area(wide));
                assert!((after / before - 1.0).abs() < 1e-9, "{name} {least}: {after} {before}");
                assert!(
                    (k * wide.unit_from_screen - DMat2::IDENTITY).abs_diff_eq(DMat2::ZERO, 1e-9)
                );
                // Half axes squared, from the Gram matrix.
                let gram = k * k.transpose();
                let (half, product) = (0.5 * (gram.x_axis.x + gram.y_axis.y), gram.determinant());
                let large = half + (half * half - product).max(0.0).sqrt();
                assert!((product / large).sqrt() > least * (1.0 - 1e-6), "{name} {least}");
            }
        }
    }
}

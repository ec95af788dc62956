//! Integrals of kernels along straight lines, by quadrature.

use glam::DVec3;

use super::quadrature::GAUSS;
use crate::kernel::RadialKernel;

/// Panels that each smooth piece of the line is cut into.
const PANELS: u32 = 4;

/// All of a line.
pub(super) const ENDLESS: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// ∫ h(|start + t·step|) dt over t in `from`..`to`, which may be infinite. `step` is not zero.
pub(super) fn radial(kernel: RadialKernel, start: DVec3, step: DVec3, [from, to]: [f64; 2]) -> f64 {
    let length = step.length();
    let nearest = -start.dot(step) / (length * length);
    let l = (start + step * nearest).length();
    let Some(end) = half_chord(kernel.radius(), l) else { return 0.0 };
    // Distance along the line from the point nearest to the centre, in voxels.
    let first = ((from - nearest) * length).max(-end);
    let last = ((to - nearest) * length).min(end);
    let knot = kernel.knot().and_then(|r| half_chord(r, l)).unwrap_or(0.0);
    let mut sum = 0.0;
    for (a, b) in [(-end, -knot), (-knot, 0.0), (0.0, knot), (knot, end)] {
        let (a, b) = (a.max(first), b.min(last));
        if a < b {
            sum += smooth(a, b, |w| kernel.value((l * l + w * w).sqrt()));
        }
    }
    sum / length
}

/// Half of what a sphere of radius `r` cuts from a line at distance `l`; `None` where they miss.
pub(super) fn half_chord(r: f64, l: f64) -> Option<f64> {
    (l < r).then(|| ((r - l) * (r + l)).sqrt())
}

fn smooth(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let half = (b - a) / f64::from(2 * PANELS);
    let panel = |i: u32| {
        let middle = a + half * f64::from(2 * i + 1);
        GAUSS.iter().map(|(x, w)| w * f(middle + half * x)).sum::<f64>()
    };
    half * (0..PANELS).map(panel).sum::<f64>()
}

/// Length in t of start + t·step inside the box of half-size ½, for t in `from`..`to`.
pub(super) fn voxel_chord(start: DVec3, step: DVec3, [from, to]: [f64; 2]) -> f64 {
    voxel_span(start, step).map_or(0.0, |[a, b]| (b.min(to) - a.max(from)).max(0.0))
}

/// Where start + t·step is inside the box of half-size ½; `None` where it never is.
pub(super) fn voxel_span(start: DVec3, step: DVec3) -> Option<[f64; 2]> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for (s, d) in start.to_array().into_iter().zip(step.to_array()) {
        if d == 0.0 {
            // A box owns its lower faces only, so that a ray along a seam meets one voxel.
            if !(-0.5..0.5).contains(&s) {
                return None;
            }
            continue;
        }
        let (a, b) = ((-0.5 - s) / d, (0.5 - s) / d);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (leave > enter).then_some([enter, leave])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;

    #[test]
    fn quadrature_meets_the_closed_footprints() {
        for kind in [Kernel::Gaussian, Kernel::Cubic] {
            for extent in [None, Some(3.0)] {
                let kernel = RadialKernel::new(kind, extent).unwrap();
                for i in 0..=50 {
                    let l = kernel.radius() * f64::from(i) / 50.0;
                    let start = DVec3::new(l, 7.0, -2.0);
                    let found =
                        radial(kernel, start - DVec3::Z * 2.0, DVec3::new(0.0, -3.5, 2.0), ENDLESS);
                    let closest = (start - DVec3::Z * 2.0)
                        .cross(DVec3::new(0.0, -3.5, 2.0).normalize())
                        .length();
                    let expected = kernel.footprint(closest) / DVec3::new(0.0, -3.5, 2.0).length();
                    // Measured: 1.2e-9.
                    assert!((found - expected).abs() < 3e-9 * kernel.footprint(0.0), "{l}");
                }
            }
        }
    }

    #[test]
    fn a_line_that_begins_in_the_middle_has_half() {
        let kernel = RadialKernel::new(Kernel::Cubic, None).unwrap();
        let start = DVec3::new(0.3, 0.0, -5.0);
        let whole = radial(kernel, start, DVec3::Z, ENDLESS);
        let half = radial(kernel, start, DVec3::Z, [5.0, f64::INFINITY]);
        let rest = radial(kernel, start, DVec3::Z, [4.0, 5.0]);
        let before = radial(kernel, start, DVec3::Z, [-9.0, 4.0]);
        assert!((half + rest + before - whole).abs() < 1e-9 && before > 1e-3);
        assert!((half - whole / 2.0).abs() < 1e-12);
        assert_eq!(radial(kernel, start, DVec3::Z, [8.0, 9.0]), 0.0);
    }

    #[test]
    fn chords_of_a_voxel_are_exact() {
        assert_eq!(voxel_chord(DVec3::new(0.2, -0.4, 9.0), DVec3::Z, ENDLESS), 1.0);
        let diagonal = voxel_chord(DVec3::splat(-3.0), DVec3::ONE / 3.0_f64.sqrt(), ENDLESS);
        assert!((diagonal - 3.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(voxel_chord(DVec3::new(0.6, 0.0, 0.0), DVec3::Z, ENDLESS), 0.0);
        assert_eq!(voxel_chord(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, [2.0, 9.0]), 0.5);
        let seam = |x: f64| voxel_chord(DVec3::new(x, 0.0, 0.0), DVec3::Z, ENDLESS);
        assert_eq!(seam(0.5) + seam(-0.5), 1.0);
    }
}

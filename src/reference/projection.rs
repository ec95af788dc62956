//! The greatest, the least and the mean value along a ray, in float64.

use super::field::{Field, Shape};
use super::quadrature::GAUSS;
use super::sources::Line;
use crate::scene::AlongRay;

/// Places at which a piece of a ray is asked, before the best is refined.
const SAMPLES: usize = 24;
/// Steps of golden sections: each leaves 0.618 of where the top can be.
const SECTIONS: usize = 60;

/// What stands for a part of a ray; `None` where it meets no value.
pub(super) fn projected(
    field: &Field,
    line: &Line,
    along: AlongRay,
    [a, b]: [f64; 2],
) -> Option<f64> {
    let mut cuts = vec![a, b];
    for axis in 0..3 {
        let count = 2 * field.dims[axis] as i64;
        // Between samples, and where the nearest is another: nothing bends or jumps elsewhere.
        let planes = (-1..count).map(|i| i as f64 / 2.0);
        cuts.extend(line.crossings(axis, planes, [a, b]));
    }
    cuts.sort_by(f64::total_cmp);
    let pieces = cuts.windows(2).map(|pair| [pair[0], pair[1]]);
    let pieces = pieces.filter(|[a, b]| {
        b > a && !(field.has_holes() && field.is_hole(line.at(f64::midpoint(*a, *b))))
    });
    let value = |t: f64| field.value(line.at(t)).unwrap_or(f64::NAN);
    match along {
        AlongRay::Composite => None,
        AlongRay::Maximum => pieces.map(|piece| top(piece, &value)).reduce(f64::max),
        AlongRay::Minimum => pieces.map(|piece| -top(piece, &|t| -value(t))).reduce(f64::min),
        AlongRay::Average => {
            // Radial kernels begin and end anywhere.
            let parts = if matches!(field.shape, Shape::Radial(_)) { 16 } else { 1 };
            let (mut sum, mut length) = (0.0, 0.0);
            for [a, b] in pieces {
                let half = (b - a) / f64::from(2 * parts);
                for i in 0..parts {
                    let middle = a + half * f64::from(2 * i + 1);
                    sum +=
                        half * GAUSS.iter().map(|(x, w)| w * value(middle + half * x)).sum::<f64>();
                }
                length += b - a;
            }
            (length > 0.0).then(|| sum / length)
        }
    }
    .filter(|value| value.is_finite())
}

/// The greatest value of a smooth function on a..b; NaN counts as nothing.
fn top([a, b]: [f64; 2], value: &impl Fn(f64) -> f64) -> f64 {
    let place = |i: usize| a + (b - a) * i as f64 / SAMPLES as f64;
    // Nearly at the ends: on them, the next voxel's box begins.
    let inside = |t: f64| value(t.clamp(a + 1e-12 * (b - a), b - 1e-12 * (b - a)));
    let at = |i: usize| (inside(place(i)), i);
    let better = |x: (f64, usize), y: (f64, usize)| if y.0 > x.0 || x.0.is_nan() { y } else { x };
    let Some((best, i)) = (0..=SAMPLES).map(at).reduce(better) else { return f64::NAN };
    let (mut low, mut high) = (place(i.saturating_sub(1)), place((i + 1).min(SAMPLES)));
    let ratio = (5.0_f64.sqrt() - 1.0) / 2.0;
    for _ in 0..SECTIONS {
        let [left, right] = [high - ratio * (high - low), low + ratio * (high - low)];
        if inside(left) > inside(right) {
            high = right;
        } else {
            low = left;
        }
    }
    best.max(inside(f64::midpoint(low, high)))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::kernel::Kernel;
    use crate::scene::Reconstruction;
    use crate::volume::{Lattice, Samples, ScalarVolume};

    #[test]
    fn the_top_of_a_parabola_is_found_wherever_it_lies() {
        for (at, expected) in [(0.3, 2.0), (-1.0, 2.0 - 1.0), (0.999, 2.0)] {
            let found = top([0.0, 1.0], &|t| 2.0 - (t - at) * (t - at));
            // Ends are met 1e-12 inside, where this one is twice as steep.
            assert!((found - expected).abs() < 4e-12, "{at}: {found}");
        }
    }

    /// Tents through a hill: its samples' values, and the mean by hand.
    #[test]
    fn a_hill_of_tents_has_its_samples_extremes_and_its_area() {
        let values = vec![1.0, 4.0, 2.0, -3.0, 0.0];
        let volume =
            ScalarVolume::from_samples("hill", Lattice::unit([5, 1, 1]), Samples::Float64(values));
        let shape = Shape::new(Kernel::Linear, None).unwrap();
        let field = Field::new(&volume.unwrap(), shape, Reconstruction::Interpolating);
        let line = Line { start: DVec3::ZERO, step: DVec3::X, from: f64::NEG_INFINITY };
        let found = |along, part| projected(&field, &line, along, part).unwrap();
        assert!((found(AlongRay::Maximum, [0.0, 4.0]) - 4.0).abs() < 1e-9);
        assert!((found(AlongRay::Minimum, [0.0, 4.0]) + 3.0).abs() < 1e-9);
        let area = 0.5 * (1.0 + 4.0) + 0.5 * (4.0 + 2.0) + 0.5 * (2.0 - 3.0) + 0.5 * -3.0;
        assert!((found(AlongRay::Average, [0.0, 4.0]) - area / 4.0).abs() < 1e-12);
        assert!((found(AlongRay::Maximum, [1.5, 2.0]) - 3.0).abs() < 1e-9, "of the part alone");
        assert_eq!(projected(&field, &line, AlongRay::Composite, [0.0, 4.0]), None);
    }
}

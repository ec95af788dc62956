//! The greatest, the least and the mean value along a ray, in float64.

use super::field::{Field, Shape};
use super::quadrature::GAUSS;
use super::sources::Line;
use crate::scene::AlongRay;

/// Places at which a piece of a ray is asked, before the best is refined.
const SAMPLES: usize = 24;
/// Steps of golden sections: each leaves 0.618 of where the top can be.
const SECTIONS: usize = 60;

/// A value of a ray, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extreme {
    pub(super) t: f64,
    pub(super) value: f64,
}

/// What stands for a part of a ray; `None` where it meets no value.
pub(super) fn projected(
    field: &Field,
    line: &Line,
    along: AlongRay,
    part: [f64; 2],
) -> Option<f64> {
    if along == AlongRay::Average {
        return average(field, line, part);
    }
    extreme(field, line, along, part).map(|found| found.value)
}

/// Where a part of a ray has its greatest or its least value: of several places the one nearest to the
/// eye. `None` where it meets no value, and where another thing stands for it.
pub(super) fn extreme(
    field: &Field,
    line: &Line,
    along: AlongRay,
    part: [f64; 2],
) -> Option<Extreme> {
    let sign = match along {
        AlongRay::Maximum => 1.0,
        AlongRay::Minimum => -1.0,
        AlongRay::Composite | AlongRay::Average => return None,
    };
    let value = |t: f64| sign * field.value(line.at(t)).unwrap_or(f64::NAN);
    let tops = pieces(field, line, part).into_iter().map(|piece| top(piece, &value));
    let Extreme { t, value } = tops.reduce(greater)?;
    Some(Extreme { t, value: sign * value }).filter(|found| found.value.is_finite())
}

/// Mean of the values over the length that has any.
fn average(field: &Field, line: &Line, part: [f64; 2]) -> Option<f64> {
    let value = |t: f64| field.value(line.at(t)).unwrap_or(f64::NAN);
    // Radial kernels begin and end anywhere.
    let parts = if matches!(field.shape, Shape::Radial(_) | Shape::Scaled(..)) { 16 } else { 1 };
    let (mut sum, mut length) = (0.0, 0.0);
    for [a, b] in pieces(field, line, part) {
        let half = (b - a) / f64::from(2 * parts);
        for i in 0..parts {
            let middle = a + half * f64::from(2 * i + 1);
            sum += half * GAUSS.iter().map(|(x, w)| w * value(middle + half * x)).sum::<f64>();
        }
        length += b - a;
    }
    (length > 0.0).then(|| sum / length).filter(|value| value.is_finite())
}

/// The parts of a ray on which the field is smooth and has data, in their order.
fn pieces(field: &Field, line: &Line, [a, b]: [f64; 2]) -> Vec<[f64; 2]> {
    let mut cuts = vec![a, b];
    for axis in 0..3 {
        let count = 2 * field.dims[axis] as i64;
        // Between samples, and where the nearest is another: nothing bends or jumps elsewhere.
        let planes = (-1..count).map(|i| i as f64 / 2.0);
        cuts.extend(line.crossings(axis, planes, [a, b]));
    }
    cuts.extend(field.crossings(line, [a, b]));
    cuts.sort_by(f64::total_cmp);
    let pieces = cuts.windows(2).map(|pair| [pair[0], pair[1]]);
    let pieces = pieces.filter(|[a, b]| {
        let middle = line.at(f64::midpoint(*a, *b));
        let is_beside = field.has_borders && field.value(middle).is_none();
        b > a && !is_beside && !(field.has_holes() && field.is_hole(middle))
    });
    pieces.collect()
}

/// The greater of two, the first where they are alike; NaN counts as nothing.
fn greater(first: Extreme, second: Extreme) -> Extreme {
    let takes = second.value > first.value || first.value.is_nan();
    if takes { second } else { first }
}

/// The greatest value of a smooth function on a..b; NaN counts as nothing.
fn top([a, b]: [f64; 2], value: &impl Fn(f64) -> f64) -> Extreme {
    let place = |i: usize| a + (b - a) * i as f64 / SAMPLES as f64;
    // Nearly at the ends: on them, the next voxel's box begins.
    let inside = |t: f64| value(t.clamp(a + 1e-12 * (b - a), b - 1e-12 * (b - a)));
    let asked = |t: f64| Extreme { t, value: inside(t) };
    let mut best = asked(a);
    let mut i = 0;
    for next in 1..=SAMPLES {
        let found = greater(best, asked(place(next)));
        if found != best {
            (best, i) = (found, next);
        }
    }
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
    greater(best, asked(f64::midpoint(low, high)))
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
            assert!((found.value - expected).abs() < 4e-12, "{at}: {found:?}");
            // A parabola is flat about its top: half the digits are left of its place.
            assert!((found.t - at.max(0.0)).abs() < 1e-7, "{at}: {found:?}");
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
        for (along, t) in [(AlongRay::Maximum, 1.0), (AlongRay::Minimum, 3.0)] {
            let found = extreme(&field, &line, along, [0.0, 4.0]).unwrap();
            assert!((found.t - t).abs() < 1e-9, "{found:?}");
        }
        assert_eq!(extreme(&field, &line, AlongRay::Average, [0.0, 4.0]), None);
    }
}

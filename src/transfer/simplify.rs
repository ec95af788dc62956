//! Fewer points for the same curve.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::function::interpolate;

/// A stretch between two points that are kept, and what leaving out those between costs.
struct Stretch {
    error: f64,
    from: usize,
    /// The point that is missed most, strictly between the two.
    worst: usize,
    to: usize,
}

impl PartialEq for Stretch {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Stretch {}

impl PartialOrd for Stretch {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Stretch {
    fn cmp(&self, other: &Self) -> Ordering {
        // Earlier stretches first, so that the outcome is one.
        self.error.total_cmp(&other.error).then(other.from.cmp(&self.from))
    }
}

/// A polyline of some of the points of another, sorted by value, that is nowhere farther from it in
/// opacity than `tolerance`, or than what `most` ≥ 2 points allow; and how far it is. Ends and steps
/// (two points at one value) are always kept.
///
/// Points are added where they are missed most (after Ramer 1972; Douglas and Peucker 1973), with
/// distances measured along opacity.
pub(super) fn simplified(
    points: &[(f64, f64)],
    tolerance: f64,
    most: usize,
) -> (Vec<(f64, f64)>, f64) {
    let Some(last) = points.len().checked_sub(1) else { return (Vec::new(), 0.0) };
    let is_anchor = |i: usize| {
        let same = |j: usize| points.get(j).is_some_and(|p| p.0 == points[i].0);
        i == 0 || i == last || same(i - 1) || same(i + 1)
    };
    let mut kept: Vec<bool> = (0..=last).map(is_anchor).collect();
    let anchors: Vec<usize> = (0..=last).filter(|&i| kept[i]).collect();
    let mut count = anchors.len();
    let mut heap: BinaryHeap<Stretch> =
        anchors.windows(2).filter_map(|pair| stretch(points, pair[0], pair[1])).collect();
    while let Some(Stretch { error, from, worst, to }) = heap.peek() {
        if *error <= tolerance || count >= most {
            break;
        }
        let (from, worst, to) = (*from, *worst, *to);
        heap.pop();
        kept[worst] = true;
        count += 1;
        heap.extend(stretch(points, from, worst));
        heap.extend(stretch(points, worst, to));
    }
    let error = heap.peek().map_or(0.0, |stretch| stretch.error);
    let points = points.iter().zip(kept).filter_map(|(&p, kept)| kept.then_some(p)).collect();
    (points, error)
}

/// A line drawn by hand keeps to it within this opacity, unless that takes more points than
/// [`MOST_DRAWN_POINTS`]: then as near as those get.
pub const FREEHAND_TOLERANCE: f64 = 1.0 / 256.0;
/// How many points a drawn line becomes at most.
pub const MOST_DRAWN_POINTS: usize = 64;

/// Points with those between the ends of a drawn line (sorted by value, each value once) replaced by
/// it: by fewer of its points where it is `finished`. Beyond the line's own spacing to either side
/// nothing changes.
pub fn redrawn(before: &[(f64, f64)], line: &[(f64, f64)], finished: bool) -> Vec<(f64, f64)> {
    // A dot is no line.
    let [(low, _), (second, _), ..] = *line else { return before.to_vec() };
    let high = line[line.len() - 1].0;
    let spacing = second - low;
    let line = match finished {
        true => simplified(line, FREEHAND_TOLERANCE, MOST_DRAWN_POINTS).0,
        false => line.to_vec(),
    };
    let [foot, end] = [low - spacing, high + spacing];
    let opacity = |value: f64| {
        interpolate(before, value, |&a| [a]).map(|[a]| (value, a)).filter(|_| value.is_finite())
    };
    let mut points: Vec<_> = before.iter().copied().filter(|(v, _)| *v < foot).collect();
    points.extend(opacity(foot));
    points.extend(line);
    points.extend(opacity(end));
    points.extend(before.iter().copied().filter(|(v, _)| *v > end));
    points
}

/// The stretch between two points, if anything lies between.
fn stretch(points: &[(f64, f64)], from: usize, to: usize) -> Option<Stretch> {
    let (a, b) = (points[from], points[to]);
    let missed = |i: usize| {
        let (value, opacity) = points[i];
        // Halved, so that ±1e308 does not overflow.
        let f = (value / 2.0 - a.0 / 2.0) / (b.0 / 2.0 - a.0 / 2.0);
        (opacity - (a.1 * (1.0 - f) + b.1 * f)).abs()
    };
    let worst = (from + 1..to).max_by(|&i, &j| missed(i).total_cmp(&missed(j)))?;
    Some(Stretch { error: missed(worst), from, worst, to })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::transfer::{ColourMap, ColourSource, TransferFunction};

    fn opacity(points: &[(f64, f64)], value: f64) -> f64 {
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 1.0] };
        TransferFunction::of(points.to_vec(), colour).opacity_at(value)
    }

    #[test]
    fn points_on_a_line_go_and_steps_stay() {
        let line: Vec<_> = (0..50).map(|i| (f64::from(i), f64::from(i) / 64.0)).collect();
        let (fewer, error) = simplified(&line, 1e-9, 64);
        assert!(fewer == [line[0], line[49]] && error < 1e-15, "{fewer:?} {error}");
        let step = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.7), (2.0, 0.7)];
        assert_eq!(simplified(&step, 1.0, 2).0, step);
        assert_eq!(simplified(&[], 0.1, 2), (vec![], 0.0));
        assert_eq!(simplified(&[(3.0, 0.5)], 0.1, 2).0, [(3.0, 0.5)]);
    }

    #[test]
    fn a_drawn_line_replaces_what_it_passes_over_and_nothing_else() {
        let before = [(0.0, 0.0), (40.0, 0.4), (60.0, 0.9), (100.0, 1.0)];
        let line: Vec<_> = (30..=70).map(|i| (f64::from(i), 0.25)).collect();
        for finished in [false, true] {
            let points = redrawn(&before, &line, finished);
            assert!(points.is_sorted_by(|a, b| a.0 <= b.0), "{points:?}");
            for i in 0..=1000 {
                let value = f64::from(i) / 10.0;
                let expected = match value {
                    v if (30.0..=70.0).contains(&v) => 0.25,
                    v if (29.0..=71.0).contains(&v) => continue,
                    v => opacity(&before, v),
                };
                assert!((opacity(&points, value) - expected).abs() < 1e-9, "{value}: {points:?}");
            }
            assert_eq!(points.len(), if finished { 6 } else { 45 });
        }
        assert_eq!(redrawn(&before, &[], true), before);
        assert_eq!(redrawn(&before, &[(50.0, 0.1)], true), before);
        assert_eq!(redrawn(&[], &[(0.0, 0.5), (1.0, 0.5)], false), [(0.0, 0.5), (1.0, 0.5)]);
    }

    #[test]
    fn however_wild_the_hand_a_drawn_line_has_few_points() {
        let line: Vec<_> = (0..300).map(|i| (f64::from(i), f64::from(i % 7) / 6.0)).collect();
        assert_eq!(redrawn(&[], &line, true).len(), MOST_DRAWN_POINTS);
    }

    proptest! {
        #[test]
        fn nothing_is_farther_off_than_is_said(
            opacities in proptest::collection::vec(0.0..=1.0_f64, 2..200),
            tolerance in 0.0..0.3_f64,
            most in 2_usize..80,
        ) {
            let points: Vec<_> =
                opacities.iter().enumerate().map(|(i, &a)| (i as f64, a)).collect();
            let (fewer, error) = simplified(&points, tolerance, most);
            prop_assert!(fewer.len() <= most);
            prop_assert!(error <= tolerance || fewer.len() == most);
            let off = points.iter().map(|&(v, a)| (opacity(&fewer, v) - a).abs());
            let worst = off.fold(0.0, f64::max);
            prop_assert!((worst - error).abs() < 1e-12, "{} said to be {}", worst, error);
        }
    }
}

//! Colours moved to another range of values, with opacities or without.

use crate::transfer::{ColourSource, Gaussian, TransferFunction, points_of};

/// Stretches colours and opacities alike from the colours' range to `to`.
///
/// A range without width has no inner proportions: opacities then keep their values. Bells that
/// would be none any more stay as they are, and so does all else.
pub fn stretch(transfer: &mut TransferFunction, gaussians: &mut [Gaussian], to: [f64; 2]) {
    let from = transfer.colour.range();
    if from == to || !to.iter().all(|v| v.is_finite()) {
        return;
    }
    let width = from[1] / 2.0 - from[0] / 2.0;
    // A range that is reversed turns the colours round, and leaves opaque what was opaque.
    let upward = |[a, b]: [f64; 2]| [a.min(b), a.max(b)];
    let shifted = |value: f64| between(value, upward(from), upward(to));
    if width != 0.0 {
        let factor = ((to[1] / 2.0 - to[0] / 2.0) / width).abs();
        let bells: Vec<_> = gaussians
            .iter()
            .map(|g| Gaussian { centre: shifted(g.centre), width: g.width * factor, ..*g })
            .collect();
        if bells.iter().any(|bell| bell.validate().is_err()) {
            return;
        }
        gaussians.copy_from_slice(&bells);
        for point in &mut transfer.opacity {
            point.0 = shifted(point.0);
        }
        if !gaussians.is_empty() {
            transfer.opacity = points_of(gaussians);
        }
    }
    stretch_colours(transfer, to);
}

/// Stretches colours alone to the range `to`, as far as it is finite: of one without width only a map's.
pub fn stretch_colours(transfer: &mut TransferFunction, to: [f64; 2]) {
    let from = transfer.colour.range();
    if !to.iter().all(|v| v.is_finite()) {
        return;
    }
    match &mut transfer.colour {
        ColourSource::Map { range, .. } => *range = to,
        ColourSource::Stops(stops) if from[0] != from[1] => {
            for stop in stops.iter_mut() {
                stop.0 = between(stop.0, from, to);
            }
            stops.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        ColourSource::Stops(_) => {}
    }
}

/// The value that lies in a range as another does in its own.
fn between(value: f64, from: [f64; 2], to: [f64; 2]) -> f64 {
    let fraction = (value / 2.0 - from[0] / 2.0) / (from[1] / 2.0 - from[0] / 2.0);
    to[0] * (1.0 - fraction) + to[1] * fraction
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Srgb8;
    use crate::transfer::ColourMap;

    fn transfer() -> TransferFunction {
        TransferFunction::of(
            vec![(0.0, 0.0), (25.0, 0.5), (100.0, 1.0)],
            ColourSource::Map { map: ColourMap::Gray, range: [0.0, 100.0] },
        )
    }

    #[test]
    fn stretching_moves_opacities_with_the_colours() {
        let mut t = transfer();
        stretch(&mut t, &mut [], [1000.0, 1200.0]);
        assert_eq!(t.opacity, [(1000.0, 0.0), (1050.0, 0.5), (1200.0, 1.0)]);
        assert_eq!(t.colour.range(), [1000.0, 1200.0]);
        stretch(&mut t, &mut [], [0.0, 100.0]);
        assert_eq!(t, transfer());
    }

    #[test]
    fn a_reversed_range_turns_the_colours_round_and_no_opacities() {
        let mut t = transfer();
        stretch(&mut t, &mut [], [100.0, 0.0]);
        assert_eq!((&t.opacity, t.colour.range()), (&transfer().opacity, [100.0, 0.0]));
        stretch(&mut t, &mut [], [500.0, 400.0]);
        assert_eq!(t.opacity, [(400.0, 0.0), (425.0, 0.5), (500.0, 1.0)]);
    }

    #[test]
    fn what_is_not_finite_stretches_nothing() {
        let mut t = transfer();
        stretch(&mut t, &mut [], [f64::NAN, 1.0]);
        stretch(&mut t, &mut [], [0.0, f64::INFINITY]);
        assert_eq!(t, transfer());
    }

    #[test]
    fn colours_are_stretched_alone() {
        let mut t = transfer();
        stretch_colours(&mut t, [300.0, 200.0]);
        assert_eq!((&t.opacity, t.colour.range()), (&transfer().opacity, [300.0, 200.0]));
        t.colour = ColourSource::Stops(vec![(0.0, Srgb8::BLACK), (100.0, Srgb8::WHITE)]);
        stretch_colours(&mut t, [-1.0, 1.0]);
        stretch_colours(&mut t, [f64::NAN, 1.0]);
        assert_eq!((&t.opacity, t.colour.range()), (&transfer().opacity, [-1.0, 1.0]));
    }

    #[test]
    fn a_range_without_width_can_be_left_again() {
        let mut t = transfer();
        t.colour = ColourSource::Map { map: ColourMap::Gray, range: [5.0, 5.0] };
        stretch(&mut t, &mut [], [0.0, 10.0]);
        assert_eq!(t.colour.range(), [0.0, 10.0]);
        assert!(t.opacity.iter().all(|(v, _)| v.is_finite()));
    }

    #[test]
    fn custom_colours_stretch_too() {
        let mut t = transfer();
        t.colour = ColourSource::Stops(vec![(0.0, Srgb8::BLACK), (100.0, Srgb8::WHITE)]);
        stretch(&mut t, &mut [], [-1.0, 1.0]);
        assert_eq!(t.colour.range(), [-1.0, 1.0]);
        assert_eq!(t.opacity[1].0, -0.5);
    }

    #[test]
    fn bells_stretch_with_the_colours() {
        let mut t = transfer();
        let mut bells = [Gaussian { centre: 50.0, height: 0.5, width: 10.0 }];
        stretch(&mut t, &mut bells, [200.0, 0.0]);
        assert_eq!(bells[0], Gaussian { centre: 100.0, height: 0.5, width: 20.0 });
        assert_eq!(t.opacity, points_of(&bells));
        // To no width at all there would be no bells.
        stretch(&mut t, &mut bells, [7.0, 7.0]);
        assert_eq!((bells[0].width, t.colour.range()), (20.0, [200.0, 0.0]));
    }
}

//! Opacity as a few Gaussian bells: what is edited, and the points that are drawn.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use super::TransferError;
use super::simplify::simplified;

/// The points of bells are nowhere farther from them in opacity.
pub const GAUSSIAN_TOLERANCE: f64 = 1.0 / 512.0;
/// How many there may be.
pub const MOST_GAUSSIANS: usize = 32;
/// A bell ends this many widths from its centre, where it is 1/2981 of its height.
const REACH: f64 = 4.0;
/// Half of the tolerance is for straight lines between points, half for leaving some out.
const LINES: f64 = GAUSSIAN_TOLERANCE / 2.0;

/// One bell: height · exp(−((value − centre)/width)²/2), and nothing beyond four widths.
///
/// Where bells overlap the highest one counts, so that opacity never passes 1 and no bell changes
/// the height of another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a Gaussian")]
pub struct Gaussian {
    /// The value of the greatest opacity, in the data's units.
    pub centre: f64,
    /// That opacity per unit distance, 0..=1.
    pub height: f64,
    /// Standard deviation, in the data's units, > 0.
    pub width: f64,
}

impl Gaussian {
    /// Opacity per unit distance of a value; 0 for NaN.
    pub fn opacity_at(&self, value: f64) -> f64 {
        // Halved, so that ±1e308 does not overflow.
        let t = (value / 2.0 - self.centre / 2.0) / (self.width / 2.0);
        if t.abs() < REACH { self.height * (-t * t / 2.0).exp() } else { 0.0 }
    }

    /// Whether it is a bell: finite, and wide enough to be told from its centre.
    ///
    /// # Errors
    /// See [`TransferError`].
    pub fn validate(&self) -> Result<(), TransferError> {
        let Self { centre, height, width } = *self;
        let ends = [centre - REACH * width, centre + REACH * width];
        if let Some(&found) = [centre, height, width].iter().chain(&ends).find(|v| !v.is_finite()) {
            return Err(TransferError::NotFinite { of: "Gaussians", found });
        }
        if !(0.0..=1.0).contains(&height) {
            return Err(TransferError::Opacity { found: height, value: centre });
        }
        if width <= 0.0 || centre - width / 4.0 == centre {
            return Err(TransferError::Width { found: width, centre });
        }
        Ok(())
    }
}

/// Opacity of a value by some bells: that of the highest.
pub fn opacity_of(gaussians: &[Gaussian], value: f64) -> f64 {
    gaussians.iter().map(|bell| bell.opacity_at(value)).fold(0.0, f64::max)
}

/// The points whose straight lines follow bells to within [`GAUSSIAN_TOLERANCE`], sorted by value;
/// none for no bell. The bells have to be valid.
pub fn points_of(gaussians: &[Gaussian]) -> Vec<(f64, f64)> {
    let mut values: Vec<f64> = gaussians.iter().flat_map(nodes).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(values.len());
    for value in values {
        if let Some(&(before, _)) = points.last() {
            add_crossings(gaussians, before, value, 0, &mut points);
        }
        points.push((value, opacity_of(gaussians, value)));
    }
    simplified(&points, LINES, usize::MAX).0
}

/// Where one bell needs points, from its one end to the other.
fn nodes(bell: &Gaussian) -> impl Iterator<Item = f64> {
    let offsets = offsets();
    let left = offsets.iter().rev().map(|t| -t);
    let (centre, width) = (bell.centre, bell.width);
    left.chain(offsets.iter().skip(1).copied()).map(move |t| centre + t * width)
}

/// Offsets from the centre, in widths, between which a bell of height 1 is straight to within
/// [`LINES`]: 0 first, [`REACH`] last.
fn offsets() -> &'static [f64] {
    static OFFSETS: LazyLock<Vec<f64>> = LazyLock::new(|| {
        let bell = |t: f64| if t < REACH { (-t * t / 2.0).exp() } else { 0.0 };
        let is_straight = |from: f64, to: f64| {
            (1..32).map(|i| f64::from(i) / 32.0).all(|f| {
                let line = bell(from) * (1.0 - f) + bell(to) * f;
                (bell(from + (to - from) * f) - line).abs() <= LINES
            })
        };
        let mut offsets = vec![0.0];
        let mut at = 0.0;
        while at < REACH {
            let mut step = REACH - at;
            while !is_straight(at, at + step) {
                step *= 0.9;
            }
            at += step;
            offsets.push(at);
        }
        offsets
    });
    &OFFSETS
}

/// Points where another bell becomes the highest between two neighbouring nodes: a kink, which a
/// straight line would cut off.
fn add_crossings(
    gaussians: &[Gaussian],
    from: f64,
    to: f64,
    depth: u32,
    points: &mut Vec<(f64, f64)>,
) {
    let highest = |value: f64| {
        let heights = gaussians.iter().map(|bell| bell.opacity_at(value)).enumerate();
        heights.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    };
    let (Some(a), Some(b)) = (highest(from), highest(to)) else { return };
    if a == b || depth == 8 {
        return;
    }
    // Both are nearly straight here, so their difference is.
    let ahead = |value: f64| gaussians[a].opacity_at(value) - gaussians[b].opacity_at(value);
    let (begin, end) = (ahead(from), ahead(to));
    let f = begin / (begin - end);
    let at = from * (1.0 - f) + to * f;
    // Ties at an end, and neighbours without a number between, need none.
    if !(from < at && at < to) {
        return;
    }
    add_crossings(gaussians, from, at, depth + 1, points);
    points.push((at, opacity_of(gaussians, at)));
    add_crossings(gaussians, at, to, depth + 1, points);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::transfer::{ColourMap, ColourSource, TransferFunction};

    fn bell(centre: f64, height: f64, width: f64) -> Gaussian {
        Gaussian { centre, height, width }
    }

    fn function(bells: &[Gaussian]) -> TransferFunction {
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 1.0] };
        TransferFunction::new(points_of(bells), colour).unwrap()
    }

    #[test]
    fn a_bell_is_what_the_formula_says() {
        let g = bell(10.0, 0.8, 2.0);
        assert_eq!((g.opacity_at(10.0), g.opacity_at(f64::NAN)), (0.8, 0.0));
        assert!((g.opacity_at(12.0) - 0.8 * (-0.5_f64).exp()).abs() < 1e-15);
        assert_eq!([g.opacity_at(2.0), g.opacity_at(18.0), g.opacity_at(f64::MAX)], [0.0; 3]);
        let points = points_of(&[g]);
        assert!(points.contains(&(10.0, 0.8)), "the peak itself: {points:?}");
        assert_eq!([points[0], points[points.len() - 1]], [(2.0, 0.0), (18.0, 0.0)]);
        assert!(points.len() < 60, "{}", points.len());
        assert_eq!(points_of(&[]), []);
    }

    #[test]
    fn of_two_bells_the_higher_counts() {
        let bells = [bell(0.0, 0.9, 1.0), bell(1.0, 0.4, 3.0)];
        assert_eq!(opacity_of(&bells, 0.0), 0.9);
        assert_eq!(opacity_of(&bells, 4.0), bells[1].opacity_at(4.0));
        assert!((function(&bells).opacity_at(0.0) - 0.9).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_bell_is_refused() {
        for (g, word) in [
            (bell(f64::NAN, 0.5, 1.0), "finite"),
            (bell(0.0, 1.5, 1.0), "0 to 1"),
            (bell(0.0, f64::NAN, 1.0), "finite"),
            (bell(0.0, 0.5, 0.0), "width"),
            (bell(0.0, 0.5, -1.0), "width"),
            (bell(1e300, 0.5, 1.0), "width"),
            (bell(1e308, 0.5, 1e308), "finite"),
        ] {
            let refused = g.validate().unwrap_err().to_string();
            assert!(refused.contains(word), "{g:?}: {refused}");
        }
        assert_eq!(bell(0.0, 0.5, 1e-300).validate(), Ok(()));
    }

    proptest! {
        #[test]
        fn points_follow_bells_within_the_tolerance(
            bells in proptest::collection::vec(
                (-100.0..100.0_f64, 0.0..=1.0_f64, -3.0..2.0_f64), 1..6),
        ) {
            let bells: Vec<_> =
                bells.into_iter().map(|(c, h, w)| bell(c, h, 10.0_f64.powf(w))).collect();
            for bell in &bells {
                prop_assert_eq!(bell.validate(), Ok(()));
            }
            let f = function(&bells);
            for g in &bells {
                for i in -500..=500 {
                    let value = g.centre + g.width * f64::from(i) / 100.0;
                    let off = (f.opacity_at(value) - opacity_of(&bells, value)).abs();
                    prop_assert!(off <= GAUSSIAN_TOLERANCE, "{off} at {value}");
                }
            }
        }
    }
}

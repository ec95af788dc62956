//! Labels: whole numbers that name things, each with an opacity and a colour of its own.

use super::function::{ColourSource, TransferFunction, interpolate};
use super::kind::{self, Kind};
use super::presets::LABEL_OPACITY;
use crate::core::Srgb8;
use crate::volume::Statistics;

/// Beside a step of a curve, in labels.
const BESIDE: f64 = 1e-3;

/// The labels of a volume's values, least first, without 0, which is nothing; none where values are no labels.
pub fn labels_of(statistics: &Statistics) -> Vec<f64> {
    if statistics.min == statistics.max || Kind::of(statistics) != Kind::Labels {
        return Vec::new();
    }
    kind::labels(statistics).into_iter().filter(|label| *label != 0.0).collect()
}

impl TransferFunction {
    /// Shows a label, as opaque as a first look has it, or hides it; all others stay as they are.
    pub fn show_label(&mut self, label: f64, is_shown: bool) {
        let opacity = if is_shown { LABEL_OPACITY } else { 0.0 };
        set_step(&mut self.opacity, label, opacity, |&alpha| [alpha], |[alpha]| alpha);
    }

    /// Gives a label another colour, where colours are stops; whether they are.
    pub fn set_label_colour(&mut self, label: f64, colour: Srgb8) -> bool {
        let ColourSource::Stops(stops) = &mut self.colour else { return false };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "of 0 to 255")]
        let from_encoded = |parts: [f64; 3]| Srgb8(parts.map(|part| (part * 255.0).round() as u8));
        set_step(stops, label, colour, |colour| colour.encoded(), from_encoded);
        true
    }
}

/// Gives the whole number `label` a step of a piecewise linear function to itself, from half below it to half above.
fn set_step<T: Copy, const N: usize>(
    points: &mut Vec<(f64, T)>,
    label: f64,
    to: T,
    numbers: impl Fn(&T) -> [f64; N] + Copy,
    from_numbers: impl Fn([f64; N]) -> T,
) {
    let [low, high] = [label - 0.5, label + 0.5];
    let at = |value: f64| interpolate(points, value, numbers).map(&from_numbers);
    let [before, after] = [at(low - BESIDE), at(high + BESIDE)];
    let first = points.partition_point(|(value, _)| *value < low);
    let last = points.partition_point(|(value, _)| *value <= high);
    let step =
        [before.map(|of| (low, of)), Some((low, to)), Some((high, to)), after.map(|of| (high, of))];
    points.splice(first..last, step.into_iter().flatten());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Ticket;
    use crate::transfer::presets::default_for;
    use crate::volume::Samples;

    fn of_labels(labels: &[u8]) -> Statistics {
        let samples = Samples::UInt8(labels.repeat(40));
        Statistics::of(&samples, &Ticket::new()).expect("never cancelled")
    }

    #[test]
    fn labels_are_the_numbers_that_are_there_but_0() {
        assert_eq!(labels_of(&of_labels(&[0, 0, 0, 1, 2, 5])), [1.0, 2.0, 5.0]);
        let ramp: Vec<u8> = (0..=255).collect();
        assert!(labels_of(&of_labels(&ramp)).is_empty());
    }

    #[test]
    fn one_label_is_hidden_and_shown_and_coloured_and_no_other() {
        let statistics = of_labels(&[0, 0, 0, 1, 2, 3, 5]);
        let first = default_for(&statistics);
        for label in [1.0, 2.0, 3.0, 5.0] {
            let mut changed = first.clone();
            changed.show_label(label, false);
            assert!(changed.set_label_colour(label, Srgb8([1, 2, 3])));
            for other in [0.0, 1.0, 2.0, 3.0, 5.0] {
                let is_it = other == label;
                let [now, before] =
                    [&changed, &first].map(|f| (f.opacity_at(other), f.encoded_colour_at(other)));
                if is_it {
                    assert_eq!(now, (0.0, Srgb8([1, 2, 3]).encoded()), "{label}");
                } else {
                    let apart =
                        now.1.iter().zip(before.1).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(
                        (now.0 - before.0).abs() < 1e-12 && apart < 1.0 / 255.0,
                        "{other} beside {label}"
                    );
                }
            }
            changed.show_label(label, true);
            for other in [0.0, 1.0, 2.0, 3.0, 5.0] {
                let [now, before] = [&changed, &first].map(|function| function.opacity_at(other));
                assert!((now - before).abs() < 1e-12, "{other}: {now} rather than {before}");
            }
            assert!(changed.validate().is_ok());
        }
    }
}

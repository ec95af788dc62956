//! What a volume's values are, as far as they tell by themselves.

use crate::core::Srgb8;
use crate::volume::Statistics;

/// More distinct whole numbers than this are measurements, not labels.
const MOST_LABELS: usize = 32;
/// Whole numbers that name things lie close together: there are at most so many times fewer of them than their range
/// holds.
const LABEL_GAPS: f64 = 8.0;
/// Of more distinct numbers than this one stands for nothing, and most often for the most:
const FEW_LABELS: usize = 8;
/// at least such a share of all, where steps of a measurement are as frequent as each other.
const LEAST_NOTHING: f64 = 0.2;
/// What scanners add to Hounsfield units where files hold nothing below 0.
const STORED_ZERO: f64 = 1024.0;
/// From fat to muscle and blood, Hounsfield units: what most of a body is.
const SOFT: [f64; 2] = [-200.0, 200.0];
/// Denser than air and lungs, lighter than fat: what hardly any of a body is.
const SPARSE: [f64; 2] = [-850.0, -250.0];

/// What a volume's values are. It decides the colours and opacities of a first look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// X-ray CT: Hounsfield units, to which `zero` was added.
    Ct {
        /// The value of water.
        zero: f64,
    },
    /// Whole numbers that name things.
    Labels,
    /// Whole numbers up to 255 apart: a scan or a photograph, brought to 8 bits.
    EightBits,
    /// Other whole numbers, in a unit of their own: magnetic resonance, microscopes.
    WholeNumbers,
    /// Fractions, most of them about 0 as often below as above, and a few far above: maps of electron microscopes.
    Map {
        /// Standard deviation of what is about 0.
        noise: f64,
    },
    /// All other fractions: what programs compute.
    Fractions,
}

impl Kind {
    /// Of values of these statistics.
    pub fn of(statistics: &Statistics) -> Self {
        if !is_whole(statistics) {
            return noise_of_map(statistics).map_or(Self::Fractions, |noise| Self::Map { noise });
        }
        if is_hounsfield(statistics) {
            return Self::Ct { zero: 0.0 };
        }
        if is_stored_ct(statistics) {
            return Self::Ct { zero: STORED_ZERO };
        }
        if are_labels(statistics) {
            return Self::Labels;
        }
        match statistics.max - statistics.min <= 255.0 {
            true => Self::EightBits,
            false => Self::WholeNumbers,
        }
    }
}

fn is_whole(statistics: &Statistics) -> bool {
    let ends = [statistics.min, statistics.max];
    ends.iter().chain(&statistics.quantiles).all(|value| value.fract() == 0.0)
}

/// Air at −1000, or the padding that scanners put below it, and nothing far beyond metal.
fn is_hounsfield(statistics: &Statistics) -> bool {
    (-5000.0..=-900.0).contains(&statistics.min)
        && (100.0..=40_000.0).contains(&statistics.max)
        && statistics.quantile(0.99) > -300.0
        && statistics.quantile(0.99) < 4000.0
}

/// Nothing below 0, at most 12 bits and metal beyond, and most that is denser than lungs as dense as fat or muscle,
/// with a gap below that.
fn is_stored_ct(statistics: &Statistics) -> bool {
    let among = |[low, high]: [f64; 2]| {
        let is_in = |value: &&f64| (low..high).contains(*value);
        statistics.quantiles.iter().filter(is_in).count() as f64
    };
    let shifted = |range: [f64; 2]| range.map(|value| value + STORED_ZERO);
    let body = among([STORED_ZERO + SPARSE[1], f64::INFINITY]);
    let all = statistics.quantiles.len() as f64;
    (-1.0..=300.0).contains(&statistics.min)
        && (1500.0..=40_000.0).contains(&statistics.max)
        && statistics.quantile(0.99) < STORED_ZERO + 4000.0
        && body > 0.05 * all
        && among(shifted(SOFT)) > 0.5 * body
        && among(shifted(SPARSE)) < 0.5 * body
}

fn are_labels(statistics: &Statistics) -> bool {
    let range = statistics.max - statistics.min;
    if range <= 0.0 {
        return false;
    }
    // Each whole number has a bin of its own only while there are no more of them than bins.
    let occupied = statistics.histogram.iter().filter(|&&count| count > 0).count();
    let all: u64 = statistics.histogram.iter().sum();
    let most = statistics.histogram.iter().copied().max().unwrap_or(0);
    occupied <= MOST_LABELS
        && (occupied <= FEW_LABELS || most as f64 >= LEAST_NOTHING * all as f64)
        && range < statistics.histogram.len() as f64
        // Of two values one is a thing, and the other what it is not.
        && (occupied == 2 || range <= LABEL_GAPS * occupied as f64)
}

/// The whole numbers that there are, of labels.
pub(super) fn labels(statistics: &Statistics) -> Vec<f64> {
    let bins = statistics.histogram.len() as f64;
    let range = statistics.max - statistics.min;
    let occupied = statistics.histogram.iter().enumerate().filter(|(_, count)| **count > 0);
    let mut labels: Vec<f64> = occupied
        .map(|(bin, _)| statistics.min + ((bin as f64 + 0.5) / bins * range).round())
        .collect();
    labels.dedup();
    labels
}

/// The noise about 0 of a map whose matter stands out of it: as far below 0 as above for most of it, and much farther
/// above for little.
fn noise_of_map(statistics: &Statistics) -> Option<f64> {
    let at = |share: f64| statistics.quantile(share);
    let noise = (at(0.84) - at(0.16)) / 2.0;
    let is_map = statistics.min < 0.0
        && noise > 0.0
        && at(0.5).abs() < 0.5 * noise
        && at(0.999) > 4.0 * noise
        && at(0.999) > -1.2 * at(0.001);
    is_map.then_some(noise)
}

/// Colours that people of every colour vision tell apart (M. Okabe and K. Ito, *Color Universal Design*, 2008),
/// without black and grey.
const APART: [[u8; 3]; 7] = [
    [86, 180, 233],
    [230, 159, 0],
    [0, 158, 115],
    [204, 121, 167],
    [240, 228, 66],
    [213, 94, 0],
    [0, 114, 178],
];
/// How much of what is mixed into them where there are more things than colours: (of white, of black).
const MIXED: [(f64, f64); 5] = [(0.0, 0.0), (0.5, 0.0), (0.0, 0.4), (0.75, 0.0), (0.25, 0.4)];

/// The colour of the thing of a number: no two of the first 35 are alike.
pub fn colour_of_label(number: usize) -> Srgb8 {
    let base = APART[number % APART.len()];
    let (white, black) = MIXED[number / APART.len() % MIXED.len()];
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..=255")]
    let mix =
        |c: u8| ((f64::from(c) * (1.0 - white) + 255.0 * white) * (1.0 - black)).round() as u8;
    Srgb8(base.map(mix))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Ticket;
    use crate::volume::Samples;

    fn kind(samples: Samples) -> Kind {
        Kind::of(&Statistics::of(&samples, &Ticket::new()).expect("never cancelled"))
    }

    fn whole(values: impl Fn(usize) -> i16) -> Kind {
        kind(Samples::Int16((0..60_000).map(values).collect()))
    }

    #[test]
    fn ct_is_known_with_and_without_its_offset_and_told_from_other_whole_numbers() {
        let ct = |i: usize| [-1000, -1000, -90, 40, 50, 700][i % 6] + (i % 7) as i16;
        assert_eq!(whole(ct), Kind::Ct { zero: 0.0 });
        assert_eq!(whole(|i| (ct(i) + 1024).max(0)), Kind::Ct { zero: 1024.0 });
        // Spread evenly, as in magnetic resonance.
        assert_eq!(whole(|i| (i * 7919 % 3000) as i16), Kind::WholeNumbers);
        assert_eq!(whole(|i| (i * 7919 % 250) as i16), Kind::EightBits);
    }

    #[test]
    fn few_numbers_close_together_are_labels_and_so_are_two() {
        assert_eq!(whole(|i| [0, 0, 0, 1, 2, 3, 12][i % 7]), Kind::Labels);
        assert_eq!(whole(|i| if i % 3 == 0 { 0 } else { (i % 30) as i16 }), Kind::Labels);
        assert_eq!(whole(|i| (i % 30) as i16), Kind::EightBits, "steps of a measurement");
        assert_eq!(whole(|i| (i % 8) as i16), Kind::Labels);
        assert_eq!(whole(|i| [40, 200][i % 2]), Kind::Labels);
        assert_eq!(whole(|i| [40, 120, 200][i % 3]), Kind::EightBits);
        assert_eq!(whole(|_| 7), Kind::EightBits);
        let samples = Samples::Int16((0..700).map(|i| [0, 1, 2, 4, 29][i % 5]).collect());
        let statistics = Statistics::of(&samples, &Ticket::new()).expect("never cancelled");
        assert_eq!(labels(&statistics), [0.0, 1.0, 2.0, 4.0, 29.0]);
    }

    #[test]
    fn a_map_of_an_electron_microscope_is_known_by_its_noise() {
        let value = |i: usize| {
            let noise =
                (0..4).map(|k| ((i * 4 + k) * 7919 % 1009) as f32 / 1009.0 - 0.5).sum::<f32>();
            if i.is_multiple_of(50) { noise + 6.0 } else { noise }
        };
        let map = kind(Samples::Float32((0..60_000).map(value).collect()));
        let Kind::Map { noise } = map else { panic!("{map:?}") };
        assert!((0.2..0.8).contains(&noise), "{noise}");
        let even =
            Samples::Float32((0..60_000).map(|i| (i * 7919 % 60_000) as f32 / 6e4).collect());
        assert_eq!(kind(even), Kind::Fractions);
    }

    #[test]
    fn every_label_has_a_colour_of_its_own_that_is_neither_black_nor_white() {
        let colours: Vec<Srgb8> = (0..35).map(colour_of_label).collect();
        for (i, a) in colours.iter().enumerate() {
            assert!(a.0.iter().any(|&c| c > 90) && a.0.iter().any(|&c| c < 245), "{a:?}");
            assert!(colours[..i].iter().all(|b| a != b), "{i}: {a:?}");
        }
    }
}

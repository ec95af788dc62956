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
/// Air of magnetic resonance is noise at the foot of 8 bits: below this part of the range
const AIR: f64 = 0.06;
/// it is commonest, and its least value is rarer than this. (HeadMRVolume: 0.011. CT, whose air is cut off at 0: 0.65 to 0.8.)
const RAREST_AIR: f64 = 0.02;
/// Marks that somebody burned into a scan are at the greatest value that so many bits hold (8, 12, 15 or 16),
const FULL: [f64; 4] = [255.0, 4095.0, 32_767.0, 65_535.0];
/// at this part of all samples or more,
const LEAST_MARKED: f64 = 1e-3;
/// with next to nothing in this part of the range below it:
const MARK_GAP: f64 = 0.15;
/// fewer samples than this part of the marks. (avg152T1: 0.02. Where bright matter was cut off at the greatest value: 0.5 and more.)
const MOST_BETWEEN: f64 = 0.05;
/// A tenth of what is left or more lies beyond this part of its range. (avg152T1: 0.6. A bright thing in noise: 0.)
const LEAST_LEFT: f64 = 0.25;
/// Computed fields in 8 bits are as smooth as rounding leaves them in this part of their matter, or more. (neghip and ironProt: 0.65
/// and 0.63. The mean of 152 heads, avg152T1: 0.35. Scans: 0.01 to 0.26.)
const LEAST_SMOOTH: f64 = 0.5;
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
    /// Whole numbers up to 255 apart, without the noise of a scanner: what programs compute, rounded to 8 bits.
    Rounded,
    /// Other whole numbers, in a unit of their own: magnetic resonance, in 8 bits too where its air shows, and microscopes.
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
    /// The unit of its values, where that is known.
    pub fn unit(self) -> Option<&'static str> {
        matches!(self, Self::Ct { zero: 0.0 }).then_some("HU")
    }

    /// Whether they are of a scanner or a microscope, whose projections are shown in grey.
    pub fn is_of_scan(self) -> bool {
        matches!(self, Self::Ct { .. } | Self::EightBits | Self::WholeNumbers)
    }

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
            true if has_noisy_air(statistics) => Self::WholeNumbers,
            true if statistics.smooth_part >= LEAST_SMOOTH => Self::Rounded,
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

/// Whether most of the darker half is noise just above the least value, as the air of magnetic resonance is.
fn has_noisy_air(statistics: &Statistics) -> bool {
    let bins = &statistics.histogram;
    let all = statistics.finite_count as f64;
    let darker = &bins[..bins.len() / 2];
    let commonest = (0..darker.len()).max_by_key(|&bin| (darker[bin], darker.len() - bin));
    let is_at_foot = commonest.is_some_and(|bin| bin > 0 && (bin as f64) < AIR * bins.len() as f64);
    is_at_foot && (bins[0] as f64) < RAREST_AIR * all
}

/// The statistics without marks that somebody burned into a scan: many samples of the greatest value there can be, far
/// above all others; `None` where there are none.
pub(super) fn without_marks(statistics: &Statistics) -> Option<Statistics> {
    let bins = &statistics.histogram;
    let all = statistics.finite_count as f64;
    let between = MOST_BETWEEN * bins[bins.len() - 1] as f64;
    let mut passed = 0;
    let below = (0..bins.len() - 1).rev().find(|&bin| {
        passed += bins[bin];
        passed as f64 > between
    })?;
    let gap = bins.len() - 1 - below;
    let is_marked = FULL.contains(&statistics.max)
        && (bins[bins.len() - 1] as f64) >= LEAST_MARKED * all
        && gap as f64 >= MARK_GAP * bins.len() as f64
        && is_whole(statistics)
        // Labels leave gaps of their own.
        && bins.iter().filter(|count| **count > 0).count() > MOST_LABELS;
    if !is_marked {
        return None;
    }
    let max = statistics.value_at((below as f64 + 1.0) / bins.len() as f64).floor();
    let is_below = |value: &f64| *value <= max;
    let quantiles: Vec<f64> = statistics.quantiles.iter().copied().filter(is_below).collect();
    // Bins of the narrower range; what a bin had goes to where its middle lies.
    let range = max - statistics.min;
    let mut histogram = vec![0; bins.len()];
    for (bin, count) in bins.iter().enumerate().take(below + 1) {
        let value = statistics.value_at((bin as f64 + 0.5) / bins.len() as f64);
        let place = (value - statistics.min) / range * bins.len() as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a bin")]
        let place = (place.max(0.0) as usize).min(bins.len() - 1);
        histogram[place] += count;
    }
    let finite_count = histogram.iter().sum();
    // What is left is a scan only where much of it is matter; else the brightest was.
    let most = *quantiles.get(quantiles.len() * 9 / 10)?;
    let has_matter = most > statistics.min + LEAST_LEFT * range;
    (quantiles.len() > bins.len() / 2 && has_matter).then(|| Statistics {
        max,
        finite_count,
        histogram,
        quantiles,
        ..statistics.clone()
    })
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
    // Of two values one is a thing, and the other what it is not, whatever numbers stand for them.
    if occupied == 2
        && statistics.quantiles.iter().all(|v| [statistics.min, statistics.max].contains(v))
    {
        return true;
    }
    occupied <= MOST_LABELS
        && (occupied <= FEW_LABELS || most as f64 >= LEAST_NOTHING * all as f64)
        && range < statistics.histogram.len() as f64
        && range <= LABEL_GAPS * occupied as f64
}

/// The whole numbers that there are, of labels.
pub(super) fn labels(statistics: &Statistics) -> Vec<f64> {
    let bins = statistics.histogram.len() as f64;
    let range = statistics.max - statistics.min;
    let occupied = statistics.histogram.iter().enumerate().filter(|(_, count)| **count > 0);
    if occupied.clone().count() == 2 && range > 0.0 {
        return vec![statistics.min, statistics.max];
    }
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

    /// 0..1, as like its neighbours' as those of any others.
    fn noise(i: usize) -> f64 {
        ((i as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0)
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
    fn magnetic_resonance_in_8_bits_is_known_by_its_noisy_air() {
        let noise = |i: usize| (i * 7919 % 9 + i * 104_729 % 7) as i16;
        let head =
            |i: usize| if i.is_multiple_of(3) { 60 + (i * 7919 % 190) as i16 } else { noise(i) };
        assert_eq!(whole(head), Kind::WholeNumbers);
        // Air that was cut off, as of CT in a window.
        assert_eq!(whole(|i| (head(i) - 12).max(0)), Kind::EightBits);
    }

    #[test]
    fn what_was_computed_is_known_in_8_bits_by_its_smoothness() {
        let wave = |i: usize| (90.0 * (1.0 + (i as f64 / 40.0).sin())).round() as i16;
        assert_eq!(whole(wave), Kind::Rounded);
        assert_ne!(whole(|i| wave(i) + (noise(i) * 9.0) as i16), Kind::Rounded);
        assert_eq!(whole(|i| 5 * wave(i)), Kind::WholeNumbers);
    }

    #[test]
    fn marks_that_were_burned_in_are_no_matter() {
        let head = |i: usize| (i * 7919 % 180) as i16;
        let marked = |i: usize| if i.is_multiple_of(11) { 255 } else { head(i) };
        let statistics = |value: &dyn Fn(usize) -> i16| {
            let samples = Samples::Int16((0..60_000).map(value).collect());
            Statistics::of(&samples, &Ticket::new()).expect("never cancelled")
        };
        let without = without_marks(&statistics(&marked)).expect("marks");
        assert!((179.0..183.0).contains(&without.max), "{}", without.max);
        assert!(without.quantiles.iter().all(|value| *value < 180.0));
        // A few that lie between make no matter of them.
        let few = |i: usize| if i % 500 == 1 { 180 + (i / 500 % 70) as i16 } else { marked(i) };
        assert!(without_marks(&statistics(&few)).is_some_and(|scan| scan.max < 200.0));
        assert_eq!(without.histogram.iter().sum::<u64>(), without.finite_count);
        assert_eq!(without_marks(&statistics(&head)), None);
        // A scan that is too bright for its bits has no gap below these.
        let bright = |i: usize| ((i * 7919 % 300) as i16).min(255);
        assert_eq!(without_marks(&statistics(&bright)), None);
        assert_eq!(without_marks(&statistics(&|i| [0, 1, 12][i % 3])), None);
        // Nor is a thing that has a value of its own (the innermost of demo:shells).
        assert_eq!(
            without_marks(&statistics(&|i| if i % 11 == 0 { 210 } else { head(i) * 4 / 5 })),
            None
        );
        // A bright thing in faint noise is no mark.
        let thing = |i: usize| match (i % 11, i % 21) {
            (0, _) => 255,
            (_, 0) => (i * 7919 % 50) as i16,
            _ => 0,
        };
        assert_eq!(without_marks(&statistics(&thing)), None);
    }

    #[test]
    fn few_numbers_close_together_are_labels_and_so_are_two() {
        assert_eq!(whole(|i| [0, 0, 0, 1, 2, 3, 12][i % 7]), Kind::Labels);
        assert_eq!(whole(|i| if i % 3 == 0 { 0 } else { (i % 30) as i16 }), Kind::Labels);
        assert_eq!(whole(|i| (noise(i) * 30.0) as i16), Kind::EightBits, "steps of a measurement");
        assert_eq!(whole(|i| (i % 8) as i16), Kind::Labels);
        assert_eq!(whole(|i| [40, 200][i % 2]), Kind::Labels);
        assert_eq!(whole(|i| [40, 120, 230][i % 3]), Kind::EightBits);
        // A ball of 0 in 257.
        assert_eq!(whole(|i| [0, 257, 257][i % 3]), Kind::Labels);
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

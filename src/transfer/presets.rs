//! Transfer functions that look right at once, from a volume's statistics.

pub use super::named_presets::Preset;
use super::{ColourMap, ColourSource, TransferFunction};
use crate::volume::Statistics;

/// Bins of the working histogram over the robust range.
const BINS: usize = 128;
/// A value held by this part of the samples is a background of its own, whatever surrounds it.
const SPIKE: f64 = 0.05;
/// The background's peak ends where the histogram falls below this part of its height.
const FOOT: f64 = 0.05;
/// Fewer distinct integers than this are labels, not measurements.
const LABELS: usize = 24;

/// Which range of values a colour map is stretched over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RangeRule {
    /// Least to greatest finite value.
    MinMax,
    /// What all but the outermost 0.5 % at either end lie in.
    Percentiles,
}

/// The range of a rule, low to high, with some width about a single value: in a range without any,
/// the least rounding of that value would decide its colour.
pub fn range(statistics: &Statistics, rule: RangeRule) -> [f64; 2] {
    let [low, high] = match rule {
        RangeRule::MinMax => [statistics.min, statistics.max],
        RangeRule::Percentiles => [statistics.quantile(0.005), statistics.quantile(0.995)],
    };
    if low != high {
        return [low, high];
    }
    let to_either_side = if low == 0.0 { 0.5 } else { low.abs() / 64.0 };
    [low - to_either_side, high + to_either_side].map(|v| v.clamp(f64::MIN, f64::MAX))
}

/// Bone, and skin faintly, in Hounsfield units.
pub fn ct_bone() -> TransferFunction {
    ct(vec![(120.0, 0.0), (250.0, 0.12), (700.0, 0.6), (1500.0, 0.9)], [-200.0, 1200.0])
}

/// Soft tissue as a translucent body about the bones, in Hounsfield units.
pub fn ct_soft() -> TransferFunction {
    ct(
        vec![
            (-450.0, 0.0),
            (-150.0, 0.04),
            (40.0, 0.06),
            (150.0, 0.08),
            (450.0, 0.4),
            (1500.0, 0.9),
        ],
        [-600.0, 900.0],
    )
}

pub(super) fn ct(opacity: Vec<(f64, f64)>, range: [f64; 2]) -> TransferFunction {
    TransferFunction::of(opacity, ColourSource::Map { map: ColourMap::CtLike, range })
}

/// A transfer function for a volume nobody has looked at yet.
///
/// The commonest value (air, water, zero) is hidden, what lies beyond the valley after it is shown,
/// translucent where there is much of it and opaque where there is little, and coloured over the
/// range it fills. Outliers move neither. Labels are all shown alike, save the first.
pub fn default_for(statistics: &Statistics) -> TransferFunction {
    if statistics.min == statistics.max {
        return of_constant(statistics, ColourMap::Viridis);
    }
    if !(statistics.max - statistics.min).is_finite() {
        return for_huge(statistics, default_for);
    }
    if is_hounsfield(statistics) {
        return ct_soft();
    }
    if let Some(labels) = labels(statistics) {
        return labels;
    }
    by_percentiles(statistics, ColourMap::Viridis, |share| {
        // Much visible matter must be thinner to be looked through.
        let thin = (0.15 / share.max(0.01)).clamp(0.25, 1.0);
        [(0.5, 0.08 * thin), (0.9, 0.35 * thin), (0.995, 0.8)]
    })
}

/// One value throughout: all of it is seen.
pub(super) fn of_constant(statistics: &Statistics, map: ColourMap) -> TransferFunction {
    let range = range(statistics, RangeRule::MinMax);
    TransferFunction::of(vec![(statistics.min, 0.2)], ColourSource::Map { map, range })
}

/// Nothing of the commonest value; beyond it the opacities that `shape` gives to fractions of the
/// values there (ascending), knowing their share of the volume, and the last one held to the end.
pub(super) fn by_percentiles(
    statistics: &Statistics,
    map: ColourMap,
    shape: impl Fn(f64) -> [(f64, f64); 3],
) -> TransferFunction {
    let mut background = Background::find(statistics);
    // Bin edges are rounded.
    background.edge = background.edge.clamp(statistics.min, statistics.max);
    let visible = background.visible(statistics);
    let at = |fraction: f64| quantile_of(&visible, fraction);
    let [near, far] = match background.side {
        Side::Low => [background.edge, statistics.max],
        Side::High => [background.edge, statistics.min],
    };
    // From the background outwards.
    let from_edge = |fraction: f64| match background.side {
        Side::Low => at(fraction),
        Side::High => at(1.0 - fraction),
    };
    let mut opacity = vec![(near, 0.0)];
    let share = visible.len() as f64 / statistics.quantiles.len().max(1) as f64;
    let shape = shape(share);
    opacity.extend(shape.map(|(fraction, alpha)| (from_edge(fraction), alpha)));
    opacity.push((far, shape[2].1));
    if background.side == Side::High {
        opacity.reverse();
        // A step takes its later side, which here is the one nearer to the background.
        opacity.dedup_by(|later, kept| later.0 == kept.0);
    }
    // Rounding and ties must not put points out of order.
    opacity.sort_by(|a, b| a.0.total_cmp(&b.0));
    let range = match background.side {
        Side::Low => [near, at(0.995)],
        Side::High => [at(0.005), near],
    };
    let range = if range[0] < range[1] { range } else { [statistics.min, statistics.max] };
    TransferFunction::of(opacity, ColourSource::Map { map, range })
}

/// A range wider than a double's: the same at a quarter of the values, which is exact up there.
pub(super) fn for_huge(
    statistics: &Statistics,
    make: impl Fn(&Statistics) -> TransferFunction,
) -> TransferFunction {
    const SHRINK: f64 = 0.25;
    let mut shrunk = statistics.clone();
    shrunk.min *= SHRINK;
    shrunk.max *= SHRINK;
    shrunk.quantiles.iter_mut().for_each(|v| *v *= SHRINK);
    let mut function = make(&shrunk);
    let grow = |v: f64| (v / SHRINK).clamp(statistics.min, statistics.max);
    function.opacity.iter_mut().for_each(|(v, _)| *v = grow(*v));
    if let ColourSource::Map { range, .. } = &mut function.colour {
        *range = range.map(grow);
    }
    function
}

fn function(opacity: Vec<(f64, f64)>, range: [f64; 2]) -> TransferFunction {
    TransferFunction::of(opacity, ColourSource::Map { map: ColourMap::Viridis, range })
}

/// Air at −1000, or the padding that scanners put below it, and nothing far beyond metal.
pub(super) fn is_hounsfield(statistics: &Statistics) -> bool {
    (-5000.0..=-900.0).contains(&statistics.min)
        && (100.0..=40_000.0).contains(&statistics.max)
        && statistics.quantile(0.99) > -300.0
        && statistics.quantile(0.99) < 4000.0
        && statistics.quantiles.iter().all(|v| v.fract() == 0.0)
}

/// Few distinct integers: one opacity for all but the commonest end.
fn labels(statistics: &Statistics) -> Option<TransferFunction> {
    let integral = [statistics.min, statistics.max]
        .iter()
        .chain(&statistics.quantiles)
        .all(|v| v.fract() == 0.0);
    let occupied = statistics.histogram.iter().filter(|&&count| count > 0).count();
    let range = statistics.max - statistics.min;
    // Each integer has a bin of its own only while there are no more of them than bins.
    if !integral || occupied > LABELS || range >= statistics.histogram.len() as f64 {
        return None;
    }
    let (min, max) = (statistics.min, statistics.max);
    let opacity = vec![(min, 0.0), (min + 0.5, 0.0), (min + 0.5, 0.25), (max, 0.25)];
    Some(function(opacity, [min, max]))
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Low,
    High,
}

/// What most of the volume is, and so is not looked at.
struct Background {
    /// The end of the scale that it lies at.
    side: Side,
    /// Where it ends and the visible begins.
    edge: f64,
}

impl Background {
    fn find(statistics: &Statistics) -> Self {
        let quantiles = &statistics.quantiles;
        let (low, high) = (statistics.quantile(0.002), statistics.quantile(0.998));
        if low == high {
            // All but a trace is one value: everything else is visible.
            let (below, above) = (low - statistics.min, statistics.max - low);
            let side = if above >= below { Side::Low } else { Side::High };
            return Self { side, edge: low };
        }
        let bin_of = |v: f64| (((v - low) / (high - low)) * BINS as f64) as usize;
        let mut histogram = [0_u32; BINS];
        for &v in quantiles.iter().filter(|v| (low..=high).contains(*v)) {
            histogram[bin_of(v).min(BINS - 1)] += 1;
        }
        let value = |bin: usize| low + (high - low) * bin as f64 / BINS as f64;
        let peak = (0..BINS).max_by_key(|&i| (histogram[i], BINS - i)).unwrap_or(0);
        let split = otsu(&histogram);
        let spiked = f64::from(histogram[peak]) > SPIKE * quantiles.len() as f64;
        if spiked && peak + 1 == BINS && histogram[peak] as usize > quantiles.len() / 2 {
            let foot = foot_of(histogram.iter().rev());
            return Self { side: Side::High, edge: value(BINS - foot) };
        }
        if !spiked || peak > split {
            // No background stands out: the lower class, as far as it lies alone, is hidden.
            let edge = if spiked { value(split + 1) } else { value(split / 2) };
            return Self { side: Side::Low, edge };
        }
        let foot = peak + foot_of(histogram[peak..].iter());
        // Noise often trails off long before the next matter begins; half of the way is its own.
        let edge = if foot < split { value(foot).midpoint(value(split)) } else { value(foot) };
        Self { side: Side::Low, edge }
    }

    /// The quantiles beyond the edge; never empty.
    fn visible(&self, statistics: &Statistics) -> Vec<f64> {
        let beyond = |v: &f64| match self.side {
            Side::Low => *v > self.edge,
            Side::High => *v < self.edge,
        };
        let visible: Vec<f64> = statistics.quantiles.iter().copied().filter(beyond).collect();
        match (visible.len(), self.side) {
            // Too rare to have a distribution: spread over what there is.
            (0..=8, Side::Low) => spread(self.edge, statistics.max),
            (0..=8, Side::High) => spread(statistics.min, self.edge),
            _ => visible,
        }
    }
}

/// Nine values evenly from low to high.
fn spread(low: f64, high: f64) -> Vec<f64> {
    (0..9).map(|i| low + (high - low) * f64::from(i) / 8.0).collect()
}

/// Bins until a peak, first of `bins`, has fallen to its foot; at least one.
fn foot_of<'a>(mut bins: impl Iterator<Item = &'a u32>) -> usize {
    let peak = bins.next().copied().unwrap_or(0);
    let foot = FOOT * f64::from(peak);
    1 + bins.take_while(|&&count| f64::from(count) > foot).count()
}

/// The last bin of the lower of two classes that differ most (N. Otsu 1979, eq. 18).
fn otsu(histogram: &[u32]) -> usize {
    let total: f64 = histogram.iter().map(|&n| f64::from(n)).sum();
    let moment: f64 = histogram.iter().enumerate().map(|(i, &n)| i as f64 * f64::from(n)).sum();
    let (mut below, mut moment_below) = (0.0, 0.0);
    let mut best = (0.0, 0);
    for (i, &n) in histogram.iter().enumerate() {
        below += f64::from(n);
        moment_below += i as f64 * f64::from(n);
        let above = total - below;
        if below == 0.0 || above <= 0.0 {
            continue;
        }
        let difference = moment_below / below - (moment - moment_below) / above;
        let between = below * above * difference * difference;
        if between > best.0 {
            best = (between, i);
        }
    }
    best.1
}

/// The value at a fraction of sorted values.
fn quantile_of(sorted: &[f64], fraction: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * fraction).round() as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Ticket;
    use crate::volume::Samples;

    fn of(samples: Samples) -> (Statistics, TransferFunction) {
        let statistics = Statistics::of(&samples, &Ticket::new()).unwrap();
        let function = default_for(&statistics);
        assert_eq!(function.validate(), Ok(()), "{function:?}");
        (statistics, function)
    }

    fn noise(seed: &mut u32) -> f64 {
        *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(*seed >> 8) / f64::from(1_u32 << 24)
    }

    #[test]
    fn a_rare_bright_vessel_in_zeros_is_shown_and_the_zeros_are_not() {
        for visible in [3, 200, 4000] {
            let mut values = vec![0_u8; 200_000];
            for i in 0..visible {
                values[i * 49] = 60 + (i % 190) as u8;
            }
            let (_, f) = of(Samples::UInt8(values));
            assert_eq!(f.opacity_at(0.0), 0.0);
            assert!(f.opacity_at(240.0) > 0.05, "{visible}: {f:?}");
        }
    }

    #[test]
    fn noisy_air_is_hidden_and_two_tissues_are_told_apart() {
        let mut seed = 1;
        let values = (0..150_000)
            .map(|i| {
                let n = noise(&mut seed) + noise(&mut seed) - 1.0;
                let level = [12.0, 12.0, 12.0, 90.0, 90.0, 200.0][i % 6];
                (level + 10.0 * n) as u8
            })
            .collect();
        let (_, f) = of(Samples::UInt8(values));
        for air in [0.0, 12.0, 20.0] {
            assert_eq!(f.opacity_at(air), 0.0, "{f:?}");
        }
        assert!(f.opacity_at(90.0) > 0.01, "{f:?}");
        assert!(f.opacity_at(200.0) > 3.0 * f.opacity_at(90.0), "{f:?}");
    }

    #[test]
    fn one_outlier_spoils_neither_colours_nor_opacities() {
        let mut seed = 3;
        let mut values: Vec<f32> = (0..100_000).map(|_| noise(&mut seed) as f32).collect();
        values[5] = 1e30;
        values[6] = f32::INFINITY;
        let (_, f) = of(Samples::Float32(values));
        let ColourSource::Map { range, .. } = f.colour else { panic!("{f:?}") };
        assert!(range[1] < 1.1, "{range:?}");
        assert!(f.opacity_at(0.95) > f.opacity_at(0.6));
        assert!(f.opacity_at(0.6) > 0.0);
    }

    #[test]
    fn constants_and_huge_values_have_a_picture() {
        for value in [0.0, 7.0, -1e308, f64::MAX, 1e-300] {
            let (_, f) = of(Samples::Float64(vec![value; 100]));
            assert!(f.opacity_at(value) > 0.0);
            let ColourSource::Map { range: [low, high], .. } = f.colour else { panic!("{f:?}") };
            assert!(low <= value && value <= high && low < high && low.is_finite(), "{low} {high}");
            let near = f.colour_at(value * (1.0 - 1e-7));
            assert!(f.colour_at(value).0.iter().zip(near.0).all(|(a, b)| (a - b).abs() < 1e-4));
        }
        let (_, f) = of(Samples::Float64(vec![f64::MAX, f64::MIN, 0.0, f64::MIN]));
        assert!(f.opacity_at(f64::MAX) > 0.0);
        of(Samples::Float64(vec![1.0, f64::NAN]));
        of(Samples::Float64(vec![f64::NAN]));
        of(Samples::Float64(vec![1.0, 2.0]));
    }

    #[test]
    fn labels_are_shown_alike_save_the_first() {
        let values = (0..50_000).map(|i| [0, 0, 0, 0, 1, 2, 3, 12][i % 8]).collect();
        let (_, f) = of(Samples::Int16(values));
        assert_eq!(f.opacity_at(0.0), 0.0);
        for label in [1.0, 2.0, 3.0, 12.0] {
            assert_eq!(f.opacity_at(label), 0.25);
        }
    }

    #[test]
    fn hounsfield_units_are_seen_by_their_air() {
        let values = (0..50_000).map(|i| [-1000, -1000, -80, 40, 45, 700][i % 6] + (i % 7) as i16);
        let (_, f) = of(Samples::Int16(values.collect()));
        assert_eq!(f, ct_soft());
        assert_eq!(f.opacity_at(-990.0), 0.0);
        assert_eq!(f.validate(), Ok(()));
    }

    #[test]
    fn a_bright_background_is_hidden_too() {
        let values = (0..50_000).map(|i| if i % 20 == 0 { (i % 179) as u8 } else { 255 }).collect();
        let (_, f) = of(Samples::UInt8(values));
        assert_eq!(f.opacity_at(255.0), 0.0, "{f:?}");
        assert!(f.opacity_at(10.0) > 0.05, "{f:?}");
        // Rarer and farther from the background is never thinner.
        let opacities: Vec<f64> = (0..=255).map(|v| f.opacity_at(f64::from(v))).collect();
        assert!(opacities.windows(2).all(|w| w[0] >= w[1]), "{f:?}");
    }

    #[test]
    fn much_visible_matter_is_thinner_than_little() {
        let filled = |part: usize| {
            let values = (0..60_000).map(|i| if i % 100 < part { 60 + (i % 190) as u8 } else { 0 });
            of(Samples::UInt8(values.collect())).1
        };
        let (little, much) = (filled(8), filled(60));
        assert!(much.opacity_at(140.0) < 0.5 * little.opacity_at(140.0), "{little:?} {much:?}");
    }

    #[test]
    fn fractions_and_mere_air_are_no_hounsfield_units() {
        let value = |i: usize| [-1000.0, -1000.0, -80.0, 40.0, 45.0, 700.0][i % 6];
        let (_, f) = of(Samples::Float32((0..50_000).map(|i| value(i) + 0.25).collect()));
        assert_ne!(f, ct_soft());
        let air = (0..50_000).map(|i| if i == 7 { 700 } else { -1000 + (i % 300) as i16 });
        let (_, f) = of(Samples::Int16(air.collect()));
        assert_ne!(f, ct_soft());
    }

    #[test]
    fn both_ranges_are_what_they_say() {
        let (statistics, _) = of(Samples::UInt16((0..10_000).collect()));
        assert_eq!(range(&statistics, RangeRule::MinMax), [0.0, 9999.0]);
        let [low, high] = range(&statistics, RangeRule::Percentiles);
        assert!((low - 50.0).abs() < 10.0 && (high - 9949.0).abs() < 10.0, "{low} {high}");
    }
}

//! Transfer functions that look right at once, from a volume's statistics.

use super::kind::{colour_of_label, labels, without_marks};
pub use super::named_presets::Preset;
use super::{ColourMap, ColourSource, Kind, TransferFunction};
use crate::volume::Statistics;

/// Where more than this share of a volume is no background, the commonest of it hides the rest,
const FILLED: f64 = 0.5;
/// which is rare where nine tenths reach no farther up than this. (Vessels in a brick of tissue: 0.24. Heads: 0.5 and more.)
const RARE: f64 = 0.33;
/// Where nine tenths reach up to here, what is densest was cut off, as of CT in a window: all of it is the same matter. (A skull:
/// 0.961. A vase: 0.944. A tooth: 0.914.)
const CUT_OFF: f64 = 0.95;
/// Bins of the working histogram over the robust range.
const BINS: usize = 128;
/// A value held by this part of the samples is a background of its own, whatever surrounds it.
const SPIKE: f64 = 0.05;
/// The background's peak ends where the histogram falls below this part of its height.
const FOOT: f64 = 0.05;
/// Opacity of every label: little of what lies behind a face shows, so that light makes its shape.
pub(super) const LABEL_OPACITY: f64 = 0.9;
/// Over a median edge of cells, where their values are least and greatest.
const CELL_OPACITY: [f64; 2] = [0.75, 0.9];
/// So many unit distances through cells are enough to show them.
const THICK_CELLS: f64 = 1.5;
/// Opacity of thin cells at most, so that what lies behind shows a little.
const MOST_OF_CELLS: f64 = 0.995;
/// Where matter of a map begins and is dense, in standard deviations of its noise.
const MAP_LEVELS: [f64; 2] = [2.5, 5.0];
/// Values that are about normally distributed reach as far above their median as below it, up to this logarithm of the ratio,
const BELL_IS_EVEN: f64 = 0.25;
/// and the outermost hundredth lies so many times as far out as the outermost sixth (of a normal distribution 2.34 times, of
/// an even one 1.44).
const BELL_TAILS: std::ops::Range<f64> = 1.9..3.2;
/// Opacities of what stands out of such values, by standard deviations.
const FLUCTUATIONS: [(f64, f64); 3] = [(1.2, 0.0), (2.0, 0.25), (3.4, 0.8)];
/// Where the surface of a density map lies at least, in the same.
const MAP_FACE: f64 = 4.0;
/// Half the range of densities over which opacity rises at that surface, in parts of all, and the opacity behind it.
const HALF_A_FACE: f64 = 0.03;
const FACE_OPACITY: f64 = 0.95;
/// Where colours of what is seen from outside end, in parts of the visible range.
const OUTERMOST: f64 = 0.65;
/// How far below the least visible value a map that begins in black begins, in parts of the visible range: matter that
/// is black on black is a shadow that nobody understands.
const ABOVE_BLACK: f64 = 0.25;

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

/// A transfer function for a volume nobody has looked at yet, by what kind of values it has ([`Kind`]).
///
/// CT has that of soft tissue, labels a colour each, maps of electron microscopes a face at five times their noise. Of values that
/// lie about one as those of chance do what stands out is shown. Of all else the commonest value (air, water, zero) is hidden, what
/// lies beyond the valley after it is shown, translucent where there is much of it and opaque where there is little or where the scale
/// ends within it; where it fills the volume, what is rare of it alone; and it is coloured over the range it fills: in the colours of anatomy where values are whole numbers up to 255, in greys where these are larger, in
/// viridis where they are fractions or as smooth as such, or where what is hidden is the brightest. Outliers move neither, nor do
/// marks that somebody burned into a scan: these are hidden.
pub fn default_for(statistics: &Statistics) -> TransferFunction {
    if statistics.min == statistics.max {
        return of_constant(statistics, ColourMap::Viridis);
    }
    if !(statistics.max - statistics.min).is_finite() {
        return for_huge(statistics, default_for);
    }
    if let Some(scan) = without_marks(statistics) {
        // Their faces are of values that matter has, too: what it hides of them is not seen.
        return clear_of_marks(of_outside(&scan), [scan.max, statistics.max]);
    }
    let map = match (Kind::of(statistics), bell(statistics)) {
        (Kind::Ct { zero }, _) => return shifted(ct_soft(), zero),
        (Kind::Labels, _) => return of_labels(statistics),
        (Kind::Map { noise }, _) => return of_map(statistics, noise),
        (Kind::EightBits | Kind::Rounded | Kind::Fractions, Some(bell)) => {
            return of_fluctuations(statistics, bell);
        }
        (Kind::EightBits, None) => ColourMap::CtLike,
        (Kind::WholeNumbers, _) => ColourMap::Gray,
        (Kind::Rounded | Kind::Fractions, None) => ColourMap::Viridis,
    };
    by_percentiles(statistics, map, |share, upto| {
        if share > FILLED && upto < RARE {
            return [(0.5, 0.0), (0.9, 0.02), (0.995, 0.8)];
        }
        // Much visible matter must be thinner to be looked through.
        let thin = (0.15 / share.max(0.01)).clamp(0.25, 1.0);
        let is_cut_off = map == ColourMap::CtLike && upto > CUT_OFF;
        let dense = if is_cut_off { 0.8 } else { 0.35 * thin };
        [(0.5, 0.08 * thin), (0.9, dense), (0.995, 0.8)]
    })
}

/// The same where little of what lies inside could be made out, as between thick slices: what hides it is opaque.
pub fn of_outside(statistics: &Statistics) -> TransferFunction {
    if let Some(scan) = without_marks(statistics) {
        return clear_of_marks(of_outside(&scan), [scan.max, statistics.max]);
    }
    match Kind::of(statistics) {
        Kind::EightBits | Kind::WholeNumbers if statistics.min < statistics.max => {
            let map = match Kind::of(statistics) {
                Kind::EightBits => ColourMap::CtLike,
                _ => ColourMap::Gray,
            };
            let mut function =
                by_percentiles(statistics, map, |_, _| [(0.1, 0.3), (0.5, 0.5), (0.995, 0.85)]);
            if let ColourSource::Map { range: [low, high], .. } = &mut function.colour {
                // What is seen is the outermost, which is seldom the brightest.
                *high = *low + OUTERMOST * (*high - *low);
            }
            function
        }
        _ => default_for(statistics),
    }
}

/// For a picture, one slice: all of it is seen, from its darkest to its brightest.
pub fn of_picture(statistics: &Statistics) -> TransferFunction {
    if !(statistics.max - statistics.min).is_finite() {
        return for_huge(statistics, of_picture);
    }
    let map = match Kind::of(statistics) {
        Kind::Labels if statistics.min < statistics.max => return of_labels(statistics),
        Kind::Map { .. } | Kind::Fractions => ColourMap::Viridis,
        _ => ColourMap::Gray,
    };
    let range = range(statistics, RangeRule::Percentiles);
    TransferFunction::of(vec![(statistics.min, 1.0)], ColourSource::Map { map, range })
}

/// Nothing of what lies beyond the first of two values, where marks begin that reach the second.
fn clear_of_marks(mut function: TransferFunction, [low, high]: [f64; 2]) -> TransferFunction {
    let last = function.opacity_at(low);
    function.opacity.retain(|(value, _)| *value < low);
    function.opacity.extend([(low, last), (low + 0.02 * (high - low), 0.0)]);
    function
}

/// A transfer function for cells that nobody has looked at yet: all of them are seen, as in other programs, so that their shape
/// and their outer faces tell what they are; the denser, the greater their values are. Names have a colour each, 0 too. What is
/// thin, `depth` unit distances from one side to the other, is denser, so that it is seen as well.
pub fn of_cells(statistics: &Statistics, depth: f64) -> TransferFunction {
    if !(statistics.max - statistics.min).is_finite() {
        return for_huge(statistics, |statistics| of_cells(statistics, depth));
    }
    // From one side to the other as opaque as so many unit distances, where it is not.
    let times = (THICK_CELLS / depth).max(1.0);
    let denser = |opacity: f64| match times {
        1.0 => opacity,
        _ => (1.0 - (1.0 - opacity).powf(times)).min(MOST_OF_CELLS),
    };
    if statistics.min < statistics.max && Kind::of(statistics) == Kind::Labels {
        let stops = labels(statistics).into_iter().enumerate().flat_map(|(number, label)| {
            let colour = colour_of_label(number);
            [(label - 0.5, colour), (label + 0.5, colour)]
        });
        let colour = ColourSource::Stops(stops.collect());
        return TransferFunction::of(vec![(statistics.min, denser(LABEL_OPACITY))], colour);
    }
    let range = range(statistics, RangeRule::Percentiles);
    let [low, high] = [statistics.min, statistics.max];
    // Both of its ends are bright: most of a simulation is often at one of them, and thin matter that is dark is a fog on black.
    let colour = ColourSource::Map { map: ColourMap::CoolWarm, range };
    let [least, most] = CELL_OPACITY.map(denser);
    match low < high {
        true => TransferFunction::of(vec![(low, least), (high, most)], colour),
        false => TransferFunction::of(vec![(low, most)], colour),
    }
}

/// A transfer function for scattered points that nobody has looked at yet: each is seen, whatever its value is. Names have a
/// colour each.
pub fn of_points(statistics: &Statistics) -> TransferFunction {
    let colour = of_cells(statistics, f64::INFINITY).colour;
    TransferFunction::of(vec![(statistics.min, 1.0)], colour)
}

/// For a density map of molecules, in Å: an opaque surface at the density that separates matter from its surroundings, as
/// programs for molecules show it.
pub fn of_density(statistics: &Statistics) -> TransferFunction {
    let (low, high) = (statistics.quantile(0.002), statistics.quantile(0.998));
    if !(low < high && (high - low).is_finite()) {
        return default_for(statistics);
    }
    let parted = otsu(&histogram_of(statistics, [low, high])) + 1;
    let parted = low + (high - low) * parted as f64 / BINS as f64;
    // Of noise and little matter in it both parts are noise.
    let level = match Kind::of(statistics) {
        Kind::Map { noise } => parted.max(MAP_FACE * noise).min(high),
        _ => parted,
    };
    let half = HALF_A_FACE * (high - low);
    let opacity = vec![(level - half, 0.0), (level + half, FACE_OPACITY)];
    TransferFunction::of(opacity, ColourSource::Map { map: ColourMap::Lapaz, range: [low, high] })
}

/// The median and the standard deviation of values that are about normally distributed.
fn bell(statistics: &Statistics) -> Option<[f64; 2]> {
    let [least, low, middle, high, most] =
        [0.01, 0.16, 0.5, 0.84, 0.99].map(|share| statistics.quantile(share));
    let tails = [(middle - least) / (middle - low), (most - middle) / (high - middle)];
    let is_even = ((high - middle) / (middle - low)).ln().abs() < BELL_IS_EVEN;
    (is_even && tails.iter().all(|tail| BELL_TAILS.contains(tail)))
        .then_some([middle, (high - low) / 2.0])
}

/// Whether values lie about one as those of chance do, so that what stands out of them is shown.
pub fn is_of_chance(statistics: &Statistics) -> bool {
    let kind = Kind::of(statistics);
    matches!(kind, Kind::EightBits | Kind::Rounded | Kind::Fractions) && bell(statistics).is_some()
}

/// What stands out of a field that goes up and down everywhere: with the rest it would be a block.
fn of_fluctuations(statistics: &Statistics, [median, deviation]: [f64; 2]) -> TransferFunction {
    let points = FLUCTUATIONS.map(|(times, opacity)| (median + times * deviation, opacity));
    let mut opacity: Vec<_> =
        points.into_iter().filter(|(value, _)| *value < statistics.max).collect();
    opacity.push((statistics.max, FLUCTUATIONS[2].1));
    // What begins to show is no darker than the middle.
    let range = [median, statistics.quantile(0.999)];
    TransferFunction::of(opacity, ColourSource::Map { map: ColourMap::Viridis, range })
}

/// For differences: clear where they are small, and of two colours by their sign.
pub fn of_differences(statistics: &Statistics) -> TransferFunction {
    let most = statistics.min.abs().max(statistics.max.abs());
    if !(most > 0.0 && most.is_finite()) {
        return default_for(statistics);
    }
    let shares = [(-1.0, 0.5), (-0.15, 0.0), (0.15, 0.0), (1.0, 0.5)];
    let opacity = shares.map(|(share, alpha)| (share * most, alpha)).to_vec();
    let colour = ColourSource::Map { map: ColourMap::CoolWarm, range: [-most, most] };
    TransferFunction::of(opacity, colour)
}

/// The same of values to which a number was added.
pub(super) fn shifted(mut function: TransferFunction, zero: f64) -> TransferFunction {
    function.opacity.iter_mut().for_each(|(value, _)| *value += zero);
    if let ColourSource::Map { range, .. } = &mut function.colour {
        *range = range.map(|value| value + zero);
    }
    function
}

/// Matter that stands out of a map's noise, translucent where it begins.
fn of_map(statistics: &Statistics, noise: f64) -> TransferFunction {
    let [low, high] = MAP_LEVELS.map(|level| (level * noise).min(statistics.max));
    let top = statistics.quantile(0.999).max(high);
    let opacity = vec![(low, 0.0), (high, 0.3), (statistics.max.max(high), 0.7)];
    TransferFunction::of(opacity, ColourSource::Map { map: ColourMap::Viridis, range: [0.0, top] })
}

/// A colour for each label, with steps half way between them; nothing of 0, or where that is none, of the least, of two
/// of the commoner.
fn of_labels(statistics: &Statistics) -> TransferFunction {
    let labels = labels(statistics);
    let nothing = match labels[..] {
        _ if labels.contains(&0.0) => 0.0,
        // Of two the commoner is what the other one is not.
        [low, high] if statistics.count_near(high) > statistics.count_near(low) => high,
        _ => statistics.min,
    };
    let mut opacity = Vec::new();
    if nothing > statistics.min {
        opacity.extend([(statistics.min, LABEL_OPACITY), (nothing - 0.5, LABEL_OPACITY)]);
    }
    opacity.extend([(nothing - 0.5, 0.0), (nothing + 0.5, 0.0)]);
    if nothing < statistics.max {
        opacity.extend([(nothing + 0.5, LABEL_OPACITY), (statistics.max, LABEL_OPACITY)]);
    }
    let things = labels.iter().filter(|label| **label != nothing).enumerate();
    let stops = things.flat_map(|(number, label)| {
        let colour = colour_of_label(number);
        [(label - 0.5, colour), (label + 0.5, colour)]
    });
    TransferFunction::of(opacity, ColourSource::Stops(stops.collect()))
}

/// One value throughout: all of it is seen.
pub(super) fn of_constant(statistics: &Statistics, map: ColourMap) -> TransferFunction {
    let range = range(statistics, RangeRule::MinMax);
    TransferFunction::of(vec![(statistics.min, 0.2)], ColourSource::Map { map, range })
}

/// Nothing of the commonest value; beyond it the opacities that `shape` gives to fractions of the
/// values there (ascending), and the last one held to the end. It knows their share of the volume, and how far up from the commonest
/// to the greatest of them, outliers apart, nine tenths of them reach.
pub(super) fn by_percentiles(
    statistics: &Statistics,
    map: ColourMap,
    shape: impl Fn(f64, f64) -> [(f64, f64); 3],
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
    let upto = (from_edge(0.9) - near) / (from_edge(0.995) - near);
    let shape = shape(share, upto);
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
    // Maps that begin in black: darker matter than the brightest would be the more opaque the less it is seen.
    let begins_in_black = matches!(map, ColourMap::CtLike | ColourMap::Gray);
    let (map, range) = match background.side {
        Side::Low if begins_in_black => {
            let [low, high] = range;
            (map, [(low - ABOVE_BLACK * (high - low)).max(statistics.min), high])
        }
        Side::High if begins_in_black => (ColourMap::Viridis, range),
        _ => (map, range),
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
        let histogram = histogram_of(statistics, [low, high]);
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

/// How many quantiles lie in each part of a range.
fn histogram_of(statistics: &Statistics, [low, high]: [f64; 2]) -> [u32; BINS] {
    let mut histogram = [0_u32; BINS];
    for &v in statistics.quantiles.iter().filter(|v| (low..=high).contains(*v)) {
        let bin = ((v - low) / (high - low) * BINS as f64) as usize;
        histogram[bin.min(BINS - 1)] += 1;
    }
    histogram
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
            assert_eq!(f.opacity_at(label), LABEL_OPACITY);
        }
        // A colour each, on either side of it and up to half way to the next.
        let colour = |value: f64| f.colour_at(value).0.map(|c| (c * 1e6).round());
        assert_eq!(colour(1.0), colour(1.49));
        assert_eq!(colour(2.0), colour(1.51));
        let each = [1.0, 2.0, 3.0, 12.0].map(colour);
        assert!((0..4).all(|i| (0..i).all(|j| each[i] != each[j])), "{each:?}");
    }

    #[test]
    fn ct_that_was_stored_with_an_offset_looks_as_in_hounsfield_units() {
        let value = |i: usize| [-1000, -1000, -80, 40, 45, 700][i % 6] + (i % 7) as i16;
        let (_, f) = of(Samples::Int16((0..50_000).map(|i| (value(i) + 1024).max(0)).collect()));
        for hounsfield in [-1000.0, -300.0, -100.0, 40.0, 450.0, 1500.0] {
            let stored = hounsfield + 1024.0;
            assert_eq!(f.opacity_at(stored), ct_soft().opacity_at(hounsfield), "{hounsfield}");
            assert_eq!(f.colour_at(stored), ct_soft().colour_at(hounsfield), "{hounsfield}");
        }
    }

    #[test]
    fn a_map_shows_what_stands_out_of_its_noise() {
        let mut seed = 5;
        let values = (0..60_000).map(|i| {
            let noise = (0..4).map(|_| noise(&mut seed)).sum::<f64>() - 2.0;
            (if i % 50 == 0 { noise + 6.0 } else { noise }) as f32
        });
        let (_, f) = of(Samples::Float32(values.collect()));
        assert_eq!((f.opacity_at(0.0), f.opacity_at(1.2)), (0.0, 0.0), "{f:?}");
        assert!(f.opacity_at(6.0) > 0.3, "{f:?}");
    }

    #[test]
    fn of_a_field_that_goes_up_and_down_everywhere_what_stands_out_is_shown() {
        let mut seed = 8;
        // Of standard deviation 1 about 5, and evenly about the same.
        let sum = |count: u32, seed: &mut u32| (0..count).map(|_| noise(seed) - 0.5).sum::<f64>();
        let chance: Vec<f64> = (0..60_000).map(|_| 5.0 + sum(12, &mut seed)).collect();
        let even: Vec<f64> =
            (0..60_000).map(|_| 5.0 + 12.0_f64.sqrt() * sum(1, &mut seed)).collect();
        let shown = |values: Vec<f64>| {
            let (_, f) = of(Samples::Float64(values));
            [5.0, 6.0, 7.0, 8.4].map(|value| f.opacity_at(value))
        };
        let [at_the_middle, near, out, far] = shown(chance);
        assert!((at_the_middle, near) == (0.0, 0.0) && (0.2..0.3).contains(&out) && far > 0.75);
        assert!(shown(even)[1] > 0.0, "nothing of it stands out");
    }

    #[test]
    fn marks_are_hidden_and_change_nothing_of_the_scan() {
        let mut seed = 11;
        let scan: Vec<u8> = (0..60_000)
            .map(|i| ([4.0, 4.0, 90.0][i % 3] + 80.0 * noise(&mut seed)) as u8)
            .collect();
        let marked = scan.iter().enumerate().map(|(i, v)| if i % 11 == 0 { 255 } else { *v });
        let (_, with) = of(Samples::UInt8(marked.collect()));
        let (statistics, _) = of(Samples::UInt8(scan));
        let without = of_outside(&statistics);
        assert_eq!((with.opacity_at(255.0), with.opacity_at(200.0)), (0.0, 0.0), "{with:?}");
        for value in [20.0, 100.0, 140.0, 165.0] {
            let (a, b) = (with.opacity_at(value), without.opacity_at(value));
            assert!((a - b).abs() < 0.1, "{value}: {a} and {b}");
        }
        assert!(with.opacity_at(165.0) > 0.1);
    }

    #[test]
    fn all_of_a_picture_is_seen_and_what_is_seen_from_outside_is_opaque() {
        let values = (0..60_000).map(|i| if i % 3 == 0 { 90 + (i * 7919 % 160) as u8 } else { 3 });
        let (statistics, usual) = of(Samples::UInt8(values.collect()));
        let picture = of_picture(&statistics);
        assert!((0..=255).all(|v| picture.opacity_at(f64::from(v)) == 1.0));
        assert!(picture.colour_at(3.0).0[0] < 0.05 && picture.colour_at(249.0).0[0] > 0.9);
        let outside = of_outside(&statistics);
        assert_eq!(outside.opacity_at(3.0), 0.0);
        assert!(outside.opacity_at(150.0) > 3.0 * usual.opacity_at(150.0), "{outside:?} {usual:?}");
    }

    #[test]
    fn of_two_numbers_the_rarer_is_the_thing() {
        let of_share = |part: usize| {
            of(Samples::Int16((0..50_000).map(|i| if i % 7 < part { 300 } else { 2 }).collect())).1
        };
        let (few, many) = (of_share(2), of_share(5));
        assert_eq!((few.opacity_at(2.0), few.opacity_at(300.0)), (0.0, LABEL_OPACITY));
        assert_eq!((many.opacity_at(2.0), many.opacity_at(300.0)), (LABEL_OPACITY, 0.0));
        // 0 is none, however rare (a ball that fills its box).
        let (_, ball) =
            of(Samples::Int16((0..50_000).map(|i| if i % 7 < 5 { 257 } else { 0 }).collect()));
        assert_eq!((ball.opacity_at(0.0), ball.opacity_at(257.0)), (0.0, LABEL_OPACITY));
    }

    #[test]
    fn no_matter_that_shows_is_black() {
        let mut seed = 9;
        let values = (0..60_000).map(|i| [0.0, 0.0, 60.0, 90.0][i % 4] + 12.0 * noise(&mut seed));
        let (statistics, f) = of(Samples::UInt8(values.map(|v| v as u8).collect()));
        let [low, high] = f.colour.range();
        assert!(statistics.min <= low && high <= statistics.max, "of its own values: {f:?}");
        let least =
            (0..=255).map(f64::from).find(|&v| f.opacity_at(v) > 0.01).expect("something shows");
        assert!(f.colour_at(least).0[0] > 0.01, "{least}: {f:?}");
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
    fn cells_are_as_dense_from_side_to_side_however_thin_they_are() {
        let statistics = Statistics::of(&Samples::Float32(vec![0.25, 1.0]), &Ticket::new());
        let statistics = statistics.expect("never cancelled");
        let through = |depth: f64| {
            let opacity = of_cells(&statistics, depth).opacity_at(0.25);
            1.0 - (1.0 - opacity).powf(depth)
        };
        assert_eq!(of_cells(&statistics, 1.5).opacity_at(0.25), 0.75);
        assert_eq!(of_cells(&statistics, 40.0).opacity_at(0.25), 0.75);
        for depth in [0.5, 1.5] {
            // 1.5 unit distances of 0.75.
            assert!((through(depth) - (1.0 - 0.25_f64.powf(1.5))).abs() < 1e-12, "{depth}");
        }
        assert_eq!(of_cells(&statistics, 0.0).opacity_at(1.0), MOST_OF_CELLS);
    }

    #[test]
    fn of_points_all_are_seen_at_first() {
        let (statistics, _) = of(Samples::Float32((0..100).map(|v| v as f32 / 7.0).collect()));
        let shown = of_points(&statistics);
        assert!([0.0, 3.0, 14.0].iter().all(|value| shown.opacity_at(*value) == 1.0));
        // Neither end of the colours of cells is dark.
        let cells = of_cells(&statistics, f64::INFINITY).colour;
        for end in cells.range() {
            assert!(cells.srgb_at(end).0.iter().any(|channel| *channel > 150), "{end}");
        }
    }

    #[test]
    fn both_ranges_are_what_they_say() {
        let (statistics, _) = of(Samples::UInt16((0..10_000).collect()));
        assert_eq!(range(&statistics, RangeRule::MinMax), [0.0, 9999.0]);
        let [low, high] = range(&statistics, RangeRule::Percentiles);
        assert!((low - 50.0).abs() < 10.0 && (high - 9949.0).abs() < 10.0, "{low} {high}");
    }

    #[test]
    fn all_cells_are_seen_at_first_and_of_names_0_too() {
        let of = |samples: Samples| {
            let statistics = Statistics::of(&samples, &Ticket::new()).expect("never cancelled");
            (of_cells(&statistics, f64::INFINITY), statistics)
        };
        for samples in [
            Samples::UInt32((0..4).collect()),
            Samples::Int32((0..9000).map(|i| i % 700 - 3).collect()),
            Samples::Float32((0..9000).map(|i| (i as f32).sin()).collect()),
            Samples::Float64(vec![7.0; 5]),
        ] {
            let (function, statistics) = of(samples);
            let [low, high] = [statistics.min, statistics.max];
            for share in [0.0, 0.3, 0.5, 1.0] {
                let opacity = function.opacity_at(low + share * (high - low));
                assert!(opacity >= 0.3, "{share}: {opacity}");
            }
        }
        let (names, _) = of(Samples::UInt32(vec![0, 0, 0, 1, 2, 3]));
        assert_ne!(names.colour_at(0.0), names.colour_at(1.0));
    }
}

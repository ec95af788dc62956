//! A transfer function integrated over value, for classifying whole ranges of values at once.

use super::{TransferFunction, extinction_from_opacity};
use crate::volume::{ScalarType, Statistics};

/// Cells that the values are divided into, about.
const CELLS: usize = 1 << 12;
/// Part of the data's range by which reconstructed values may pass beyond it on either side before
/// the end colours are held.
const OVERSHOOT: f64 = 0.25;

/// What is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// Extinction per unit distance: depths add up.
    Extinction,
    /// Opacity per unit distance, as the papers print it.
    Opacity,
}

/// K(v) = ∫ w dv and ∫ w·c dv of a transfer function, w its [`Weight`] and c its colour in linear
/// light, in equal cells of value; lengths are counted in cells.
///
/// The mean of w over the values v₀..v₁ is (K(v₁) − K(v₀))/(v₁ − v₀). Each cell is integrated
/// between the function's breakpoints, so that no step and no peak is missed however narrow; cells
/// begin at whole values where the data are whole numbers, so that a step at a value is kept for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Cumulative {
    /// Value at which cell 0 begins.
    pub low: f64,
    /// Cells per unit of value, > 0.
    pub scale: f64,
    /// K where each cell begins, and where the last one ends.
    pub depth: Vec<f32>,
    /// ∫ w·red, green, blue at the same places; the fourth is 0.
    pub emission: Vec<[f32; 4]>,
    /// Mean colour (weighted by w, or evenly where that is 0) and mean w of each cell.
    pub cells: Vec<[f32; 4]>,
    /// Growth of w across each cell, 0 in those with a breakpoint inside. Without it a background
    /// at the foot of a ramp would have half of what the first cell ends with: a haze.
    pub slopes: Vec<f32>,
    /// What holds below the first cell and beyond the last: colour and w.
    pub ends: [[f32; 4]; 2],
    /// Colour and w of NaN; nothing where it is left out.
    pub no_data: [f32; 4],
    /// Number of cells before each in which anything shows.
    shows_before: Vec<u32>,
    /// Table entries, of two ends and every cell, whose opacity was lowered to the floor.
    pub capped_count: usize,
}

impl Cumulative {
    /// Integrates a function over the values that a field of these statistics can take.
    pub fn new(
        function: &TransferFunction,
        scalar_type: ScalarType,
        statistics: &Statistics,
        weight: Weight,
    ) -> Self {
        let (low, scale, count) = cells(function, scalar_type, statistics);
        let mut breaks: Vec<f64> = function
            .breakpoints()
            .into_iter()
            .map(|value| (value - low) * scale)
            .filter(|u| *u > 0.0 && *u < count as f64)
            .collect();
        breaks.sort_by(f64::total_cmp);
        let mut table = Self {
            low,
            scale,
            depth: vec![0.0; count + 1],
            emission: vec![[0.0; 4]; count + 1],
            cells: vec![[0.0; 4]; count],
            slopes: vec![0.0; count],
            ends: [low, low + count as f64 / scale].map(|v| {
                let [r, g, b] = function.colour_at(v).0;
                [r, g, b, weighed(function, v, weight)[3]].map(|x| x as f32)
            }),
            no_data: [0.0; 4],
            shows_before: vec![0; count + 1],
            capped_count: 0,
        };
        if function.no_data.shows() {
            let [r, g, b, w, capped] = weighed(function, f64::NAN, weight);
            table.no_data = [r, g, b, w].map(|x| x as f32);
            table.capped_count += usize::from(capped > 0.0);
        }
        let mut sums = [0.0_f64; 4];
        let mut next_break = 0;
        for cell in 0..count {
            let (begin, end) = (cell as f64, (cell + 1) as f64);
            let mut cell_sums = [0.0_f64; 4];
            let (mut from, mut capped) = (begin, false);
            let mut growth = 0.0;
            loop {
                let at_break = breaks.get(next_break).copied().filter(|b| *b < end);
                let to = at_break.unwrap_or(end);
                let points = gauss(from, to);
                let found = points.map(|u| weighed(function, low + u / scale, weight));
                if to - from == 1.0 {
                    growth = (found[1][3] - found[0][3]) / (points[1] - points[0]);
                }
                for [r, g, b, w, cap] in found {
                    let part = (to - from) / 2.0;
                    capped |= cap > 0.0 && part > 0.0;
                    for (sum, x) in cell_sums.iter_mut().zip([r * w, g * w, b * w, w]) {
                        *sum += x * part;
                    }
                }
                from = to;
                if at_break.is_none() {
                    break;
                }
                next_break += 1;
            }
            let w = cell_sums[3];
            // Nobody sees it, but slices and projections have no opacities.
            let unseen = || gauss(begin, end).map(|u| function.colour_at(low + u / scale).0);
            let unseen = if w > 0.0 { [[0.0; 3]; 2] } else { unseen() };
            let colour = |c: usize| match w > 0.0 {
                true => cell_sums[c] / w,
                false => f64::midpoint(unseen[0][c], unseen[1][c]),
            };
            table.cells[cell] = [colour(0), colour(1), colour(2), w].map(|x| x as f32);
            table.slopes[cell] = growth as f32;
            table.shows_before[cell + 1] = table.shows_before[cell] + u32::from(w > 0.0);
            table.capped_count += usize::from(capped);
            for (sum, part) in sums.iter_mut().zip(cell_sums) {
                *sum += part;
            }
            table.depth[cell + 1] = sums[3] as f32;
            table.emission[cell + 1] = [sums[0] as f32, sums[1] as f32, sums[2] as f32, 0.0];
        }
        table
    }

    /// Whether any value in low..=high, or in a cell that one of them lies in, shows at all. False
    /// for an empty range (low > high) and NaN.
    pub fn shows(&self, low: f64, high: f64) -> bool {
        if low.is_nan() || high.is_nan() || low > high {
            return false;
        }
        let count = self.cells.len() as f64;
        let [from, to] = [low, high].map(|v| (v - self.low) * self.scale);
        let below = from < 0.0 && self.ends[0][3] > 0.0;
        let beyond = to >= count && self.ends[1][3] > 0.0;
        let first = from.floor().clamp(0.0, count) as usize;
        let last = (to.floor() + 1.0).clamp(0.0, count) as usize;
        below || beyond || self.shows_before[last.max(first)] > self.shows_before[first]
    }

    /// Places in the table, in cells, that all which shows lies between, each a cell further out than it need be
    /// for rounding: infinite where what lies beyond the table shows, and empty (first > last) where nothing does.
    pub fn shown(&self) -> [f32; 2] {
        let count = self.cells.len();
        let shows = |cell: &[f32; 4]| cell[3] > 0.0;
        let first = self.cells.iter().position(shows);
        let last = self.cells.iter().rposition(shows);
        let [below, beyond] = self.ends.map(|end| end[3] > 0.0);
        let first = match first {
            _ if below => f32::NEG_INFINITY,
            Some(cell) => cell as f32 - 1.0,
            None if beyond => count as f32 - 1.0,
            None => f32::INFINITY,
        };
        let last = match last {
            _ if beyond => f32::INFINITY,
            Some(cell) => cell as f32 + 2.0,
            None if below => 1.0,
            None => f32::NEG_INFINITY,
        };
        [first, last]
    }
}

/// Colour in linear light, weight, and 1 where the opacity was capped.
fn weighed(function: &TransferFunction, value: f64, weight: Weight) -> [f64; 5] {
    let alpha = function.opacity_at(value);
    if alpha <= 0.0 {
        return [0.0; 5];
    }
    let extinction = extinction_from_opacity(alpha);
    let w = match weight {
        Weight::Extinction => extinction,
        Weight::Opacity => alpha,
    };
    let [r, g, b] = function.colour_at(value).0;
    let capped = alpha > 1.0 - super::TRANSMITTANCE_FLOOR && weight == Weight::Extinction;
    [r, g, b, w, f64::from(u8::from(capped))]
}

/// The two Gauss–Legendre points of an interval.
fn gauss(from: f64, to: f64) -> [f64; 2] {
    let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
    let offset = half / 3.0_f64.sqrt();
    [middle - offset, middle + offset]
}

/// Where the cells begin, cells per unit, and how many.
fn cells(
    function: &TransferFunction,
    scalar_type: ScalarType,
    statistics: &Statistics,
) -> (f64, f64, usize) {
    // Halved sums, so that ±1e308 does not overflow.
    let margin = OVERSHOOT * 2.0 * (statistics.max / 2.0 - statistics.min / 2.0);
    let mut low = (statistics.min - margin).max(f64::MIN / 4.0);
    let mut high = (statistics.max + margin).min(f64::MAX / 4.0);
    if let Some([from, to]) = function.span() {
        // Beyond its breakpoints a function is constant.
        low = low.max(from.min(high));
        high = high.min(to.max(low));
    }
    // So wide that single precision has a number for the cells to a unit, also of a field that is 0 throughout.
    let least_width = (low.abs().max(high.abs()) * 1e-11).max(1e-34);
    if high - low < least_width {
        let middle = low / 2.0 + high / 2.0;
        (low, high) = (middle - least_width / 2.0, middle + least_width / 2.0);
    }
    if scalar_type.is_integer() && low.abs().max(high.abs()) < 1e15 {
        let (first, end) = (low.floor() - 1.0, high.ceil() + 1.0);
        let codes = end - first;
        if codes <= CELLS as f64 {
            // A power of two, so that every code begins a cell.
            let each = 2.0_f64.powf((CELLS as f64 / codes).log2().floor());
            return (first, each, (codes * each) as usize);
        }
    }
    let cell = (high - low) / (CELLS - 2) as f64;
    (low - cell, 1.0 / cell, CELLS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Ticket;
    use crate::transfer::{ColourMap, ColourSource};
    use crate::volume::Samples;

    fn function(opacity: &[(f64, f64)], range: [f64; 2]) -> TransferFunction {
        let colour = ColourSource::Map { map: ColourMap::Inferno, range };
        TransferFunction::new(opacity.to_vec(), colour).unwrap()
    }

    fn statistics(low: f64, high: f64) -> Statistics {
        Statistics::of(&Samples::Float64(vec![low, high]), &Ticket::new()).unwrap()
    }

    /// Mean of w over low..high by a fine midpoint rule, and of w × red.
    fn mean(f: &TransferFunction, low: f64, high: f64) -> [f64; 2] {
        const STEPS: u32 = 20_000;
        let mut sums = [0.0; 2];
        for i in 0..STEPS {
            let v = low + (high - low) * (f64::from(i) + 0.5) / f64::from(STEPS);
            let w = extinction_from_opacity(f.opacity_at(v));
            sums[0] += w / f64::from(STEPS);
            sums[1] += w * f.colour_at(v).0[0] / f64::from(STEPS);
        }
        sums
    }

    #[test]
    fn differences_are_means_over_ranges_and_steps_are_kept() {
        let f = function(&[(0.2, 0.0), (0.35, 0.8), (0.35, 0.1), (0.6, 0.0)], [0.0, 1.0]);
        let table =
            Cumulative::new(&f, ScalarType::Float32, &statistics(0.0, 1.0), Weight::Extinction);
        for (i, j) in [(0, 4096), (5, 600), (900, 1900), (2000, 2001), (3000, 4000)] {
            let value = |i: usize| table.low + i as f64 / table.scale;
            let [w, red] = mean(&f, value(i), value(j));
            let cells = (j - i) as f64;
            let found = f64::from(table.depth[j] - table.depth[i]) / cells;
            assert!((found - w).abs() < 2e-4, "{i}..{j}: {found} {w}");
            let found = f64::from(table.emission[j][0] - table.emission[i][0]) / cells;
            assert!((found - red).abs() < 2e-4, "{i}..{j}: {found} {red}");
        }
    }

    #[test]
    fn a_narrow_range_of_large_values_has_all_the_cells() {
        let f = function(&[(1e6 + 0.2, 0.0), (1e6 + 0.8, 0.8)], [1e6, 1e6 + 1.0]);
        let table = Cumulative::new(
            &f,
            ScalarType::Float64,
            &statistics(1e6, 1e6 + 1.0),
            Weight::Extinction,
        );
        let high = table.low + table.cells.len() as f64 / table.scale;
        assert!(table.low <= 1e6 + 0.2 && high >= 1e6 + 0.8, "{} {high}", table.low);
        // The colours change over the whole unit.
        assert!(table.scale > 4000.0, "{}", table.scale);
    }

    #[test]
    fn a_peak_thinner_than_a_cell_keeps_its_depth() {
        let f = function(&[(0.5, 0.0), (0.5, 0.9), (0.500_01, 0.9), (0.500_01, 0.0)], [0.0, 1.0]);
        let f = TransferFunction {
            opacity: [&[(0.0, 0.0)], f.opacity.as_slice(), &[(1.0, 0.0)]].concat(),
            ..f
        };
        let table =
            Cumulative::new(&f, ScalarType::Float64, &statistics(0.0, 1.0), Weight::Extinction);
        let depth = f64::from(*table.depth.last().unwrap()) / table.scale;
        assert!((depth / (1e-5 * extinction_from_opacity(0.9)) - 1.0).abs() < 1e-3, "{depth}");
        assert!(table.shows(0.499, 0.501) && !table.shows(0.1, 0.4) && !table.shows(0.6, 2.0));
    }

    #[test]
    fn codes_begin_cells_so_that_a_step_at_a_code_is_its_own() {
        let f = function(&[(5.0, 0.0), (5.0, 0.5)], [0.0, 255.0]);
        let table =
            Cumulative::new(&f, ScalarType::UInt8, &statistics(0.0, 255.0), Weight::Opacity);
        let at = |code: f64| table.cells[((code - table.low) * table.scale) as usize][3];
        assert_eq!((at(4.0), at(5.0)), (0.0, 0.5));
        assert!(table.shows(5.0, 5.0) && !table.shows(0.0, 4.9));
        assert!(table.shows(300.0, 400.0), "ends are held");
        let f = function(&[(5.0, 0.5), (5.0, 0.0)], [0.0, 255.0]);
        let table =
            Cumulative::new(&f, ScalarType::UInt8, &statistics(0.0, 255.0), Weight::Opacity);
        assert!(table.shows(-400.0, -300.0) && !table.shows(300.0, 400.0), "ends are held");
    }

    #[test]
    fn within_a_cell_the_weight_grows_unless_it_breaks_there() {
        let f = function(&[(100.0, 0.0), (110.0, 0.5), (110.0, 0.2), (115.03, 0.3)], [0.0, 255.0]);
        let table =
            Cumulative::new(&f, ScalarType::UInt8, &statistics(0.0, 255.0), Weight::Opacity);
        let cell = |value: f64| ((value - table.low) * table.scale) as usize;
        let begin = |i: usize| table.cells[i][3] - table.slopes[i] / 2.0;
        for value in [100.0, 103.5, 109.75, 110.0, 112.0] {
            let expected = f.opacity_at(value) as f32;
            assert!(
                (begin(cell(value)) - expected).abs() < 1e-6,
                "{value}: {}",
                begin(cell(value))
            );
        }
        assert!(table.slopes[cell(100.0)] > 0.0 && table.slopes[cell(99.9)] == 0.0);
        assert_eq!(table.slopes[cell(115.03)], 0.0, "a break inside");
    }

    #[test]
    fn odd_ranges_make_finite_tables() {
        let cases = [
            (function(&[(9.0, 0.0), (9.0, 1.0)], [9.0, 9.0]), statistics(9.0, 9.0)),
            (function(&[(-1e308, 0.0), (1e308, 0.9)], [-1e308, 1e308]), statistics(-1e308, 1e308)),
            (function(&[(0.0, 0.0), (5e-324, 0.9)], [0.0, 5e-324]), statistics(0.0, 5e-324)),
            (function(&[], [0.0, 1.0]), statistics(0.0, 1.0)),
            (function(&[(50.0, 0.3)], [0.0, 1e30]), statistics(0.0, 1.0)),
        ];
        for (f, statistics) in cases {
            for scalar_type in [ScalarType::Float64, ScalarType::UInt8] {
                let table = Cumulative::new(&f, scalar_type, &statistics, Weight::Extinction);
                assert!(table.scale > 0.0 && table.low.is_finite(), "{table:?}");
                assert!(table.depth.iter().all(|x| x.is_finite()), "{f:?}");
                assert!(table.cells.iter().flatten().all(|x| x.is_finite()));
            }
        }
    }

    /// Held to [`Cumulative::shows`], value by value from far below the table to far beyond.
    #[test]
    fn all_that_shows_lies_between_the_first_and_the_last_place_that_do() {
        type Points<'a> = &'a [(f64, f64)];
        let cases: [(Points<'_>, [bool; 2]); 5] = [
            (&[(0.2, 0.0), (0.35, 0.8), (0.6, 0.0)], [true, true]),
            (&[(0.4, 0.0), (0.9, 0.5)], [true, false]),
            (&[(0.1, 0.7), (0.3, 0.0)], [false, true]),
            (&[(0.1, 0.7), (0.3, 0.0), (0.7, 0.0), (0.8, 0.2)], [false, false]),
            (&[(0.1, 0.0), (0.3, 0.0)], [true, true]),
        ];
        for (points, finite) in cases {
            let f = function(points, [0.0, 1.0]);
            let table =
                Cumulative::new(&f, ScalarType::Float32, &statistics(0.0, 1.0), Weight::Extinction);
            let [first, last] = table.shown().map(f64::from);
            let mut shows = 0;
            for i in -2000..3000 {
                let value = f64::from(i) * 1e-3;
                let place = (value - table.low) * table.scale;
                if table.shows(value, value) {
                    assert!(first + 1.0 <= place && place <= last - 1.0, "{points:?} {value}");
                    shows += 1;
                }
            }
            let (begins, ends) = (first.is_finite(), last.is_finite());
            match shows {
                0 => assert!(first > last, "{points:?}"),
                _ => assert_eq!([begins, ends], finite, "{points:?}"),
            }
            // No further out than they need be.
            for (place, step) in [(first, 2.5), (last, -2.5)] {
                let value = (place + step) / table.scale + table.low;
                assert!(!place.is_finite() || table.shows(value, value), "{points:?} {place}");
            }
        }
    }

    #[test]
    fn full_opacity_is_floored_and_counted() {
        let f = function(&[(9.0, 0.0), (9.0, 1.0)], [0.0, 255.0]);
        let table =
            Cumulative::new(&f, ScalarType::UInt8, &statistics(0.0, 255.0), Weight::Extinction);
        assert!(table.capped_count > 0);
        assert!((f64::from(table.ends[1][3]) - 1e4_f64.ln()).abs() < 1e-5);
    }
}

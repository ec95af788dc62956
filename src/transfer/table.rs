//! A transfer function tabulated for drawing.

use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::{TRANSMITTANCE_FLOOR, TransferFunction, extinction_from_opacity};
use crate::core::colour::linear_from_srgb;
use crate::core::parallel;
use crate::volume::ScalarType;

/// Entries of a table over a range of values that has no codes of its own.
const ENTRIES: usize = 1 << 16;
/// Entries a worker computes at a time.
const CHUNK: usize = 1 << 12;

/// Where a value lies in a table: u = (value − offset)·scale, clamped to 0..=last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate {
    /// The value of entry 0.
    pub offset: f64,
    /// Entries per unit of value, > 0.
    pub scale: f64,
    /// Index of the last entry.
    pub last: f64,
}

impl Coordinate {
    /// u of a value, 0..=last; ±∞ lie at the ends, NaN at 0.
    pub fn of(&self, value: f64) -> f64 {
        // Halved, so that ±1e308 does not overflow; `max` takes NaN to 0.
        let above = value / 2.0 - self.offset / 2.0;
        (above * self.scale * 2.0).max(0.0).min(self.last)
    }

    /// The value that an entry stands for.
    fn value(&self, entry: usize) -> f64 {
        2.0 * (self.offset / 2.0 + entry as f64 / (2.0 * self.scale))
    }
}

/// Colour and extinction by value, for drawing.
///
/// Entries are interpolated linearly. 8- and 16-bit types have one entry a code, wider integers too
/// where the function's breakpoints span fewer than 65 536: exact. All else has 65 536 entries over
/// the span of the breakpoints, and one before it, so that a step at the very beginning is kept;
/// any other step is smeared over one entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Linear red, green, blue, and extinction per *unit distance* (see
    /// [`extinction_from_opacity`]): divided by the unit distance it is per world unit.
    pub entries: Vec<[f32; 4]>,
    /// Which entry a value has.
    pub coordinate: Coordinate,
    /// Entries whose opacity was lowered to keep the transmittance at its floor.
    pub capped_count: usize,
    /// The same of NaN: nothing where it is left out.
    pub no_data: [f32; 4],
    /// Maxima of extinction: leaves from `entries.len()` on, node i above 2i and 2i + 1.
    maxima: Vec<f32>,
}

impl Table {
    /// Tabulates a function for samples of a type. Milliseconds at most.
    pub fn new(function: &TransferFunction, scalar_type: ScalarType) -> Self {
        let (coordinate, count) = coordinate_for(function, scalar_type);
        let mut entries = vec![[0.0; 4]; count];
        let capped_count = AtomicUsize::new(0);
        parallel::each(entries.chunks_mut(CHUNK).enumerate(), |(chunk, entries)| {
            let capped = fill(function, coordinate, chunk * CHUNK, entries);
            capped_count.fetch_add(capped, Ordering::Relaxed);
        });
        let mut maxima = vec![0.0; 2 * count];
        for (leaf, entry) in maxima[count..].iter_mut().zip(&entries) {
            *leaf = entry[3];
        }
        for node in (1..count).rev() {
            maxima[node] = maxima[2 * node].max(maxima[2 * node + 1]);
        }
        let (capped, no_data) = no_data(function);
        let capped_count = capped_count.into_inner() + usize::from(capped);
        Self { entries, coordinate, capped_count, no_data, maxima }
    }

    /// Linear red, green, blue and extinction per unit distance of a value.
    pub fn lookup(&self, value: f64) -> [f32; 4] {
        if value.is_nan() {
            return self.no_data;
        }
        let u = self.coordinate.of(value);
        let index = (u as usize).min(self.entries.len() - 2);
        let f = (u - index as f64) as f32;
        let (a, b) = (self.entries[index], self.entries[index + 1]);
        std::array::from_fn(|c| a[c] * (1.0 - f) + b[c] * f)
    }

    /// Whether anything of a brick can show: values in low..=high (none where low > high), and samples
    /// without data where it `has_holes`.
    pub fn shows(&self, [low, high]: [f64; 2], has_holes: bool) -> bool {
        self.greatest_extinction(low, high) > 0.0 || (has_holes && self.no_data[3] > 0.0)
    }

    /// The greatest extinction of any value in low..=high, or a little more: never less than
    /// [`Table::lookup`] gives. 0 for an empty range (low > high) and NaN.
    pub fn greatest_extinction(&self, low: f64, high: f64) -> f32 {
        if low.is_nan() || high.is_nan() || low > high {
            return 0.0;
        }
        let count = self.entries.len();
        let mut from = self.coordinate.of(low).floor() as usize + count;
        let mut to = self.coordinate.of(high).ceil() as usize + count + 1;
        let mut greatest = 0.0_f32;
        while from < to {
            if from % 2 == 1 {
                greatest = greatest.max(self.maxima[from]);
                from += 1;
            }
            if to % 2 == 1 {
                to -= 1;
                greatest = greatest.max(self.maxima[to]);
            }
            from /= 2;
            to /= 2;
        }
        greatest
    }
}

/// The coordinate of a table and how many entries it has (at least two).
fn coordinate_for(function: &TransferFunction, scalar_type: ScalarType) -> (Coordinate, usize) {
    let codes = |offset: f64, count: usize| {
        (Coordinate { offset, scale: 1.0, last: (count - 1) as f64 }, count)
    };
    let [low, high] = function.span().unwrap_or([0.0, 0.0]);
    match scalar_type {
        ScalarType::UInt8 => return codes(0.0, 1 << 8),
        ScalarType::Int8 => return codes(f64::from(i8::MIN), 1 << 8),
        ScalarType::UInt16 => return codes(0.0, 1 << 16),
        ScalarType::Int16 => return codes(f64::from(i16::MIN), 1 << 16),
        ScalarType::Float32 | ScalarType::Float64 => {}
        ScalarType::UInt32 | ScalarType::Int32 | ScalarType::UInt64 | ScalarType::Int64 => {
            let (first, end) = (low.floor() - 1.0, high.ceil());
            let count = end - first + 1.0;
            // Beyond 2⁵³ neighbouring codes are one double.
            let distinct = first.abs().max(end.abs()) < 2.0_f64.powi(53);
            if distinct && count <= ENTRIES as f64 {
                return codes(first, count as usize);
            }
        }
    }
    // A step in the smallest width that single precision still resolves at this value.
    let least_width = low.abs().max(high.abs()).max(1e-30) * 2.0_f64.powi(-22);
    if high - low < least_width {
        let scale = 1.0 / least_width;
        return (Coordinate { offset: low - least_width, scale, last: 1.0 }, 2);
    }
    let steps = (ENTRIES - 2) as f64;
    let scale = steps / 2.0 / (high / 2.0 - low / 2.0);
    // Near ±1e308 there is no room for the entry before the first.
    let offset = (low - 1.0 / scale).max(f64::MIN);
    (Coordinate { offset, scale, last: steps + 1.0 }, ENTRIES)
}

/// Whether the opacity of NaN was capped, and what it is drawn as.
fn no_data(function: &TransferFunction) -> (bool, [f32; 4]) {
    let alpha = function.opacity_at(f64::NAN);
    let [r, g, b] = function.encoded_colour_at(f64::NAN).map(decode);
    (alpha > 1.0 - TRANSMITTANCE_FLOOR, [r, g, b, extinction_from_opacity(alpha) as f32])
}

/// Fills a run of entries that begins at `first`; returns how many were capped.
fn fill(
    function: &TransferFunction,
    coordinate: Coordinate,
    first: usize,
    entries: &mut [[f32; 4]],
) -> usize {
    let span = function.span();
    let mut capped = 0;
    // Beyond the breakpoints, and within flat pieces, colours repeat.
    let mut known = ([f64::NAN; 3], [0.0_f32; 3]);
    for (i, entry) in entries.iter_mut().enumerate() {
        let index = first + i;
        let mut value = coordinate.value(index);
        // Rounding must not miss the last breakpoint, nor reach the first from before it.
        if let Some([low, high]) = span.filter(|_| coordinate.scale != 1.0) {
            if index as f64 == coordinate.last {
                value = high;
            } else if index == 1 {
                value = low;
            }
        }
        let alpha = function.opacity_at(value);
        capped += usize::from(alpha > 1.0 - TRANSMITTANCE_FLOOR);
        let encoded = function.encoded_colour_at(value);
        if encoded != known.0 {
            known = (encoded, encoded.map(decode));
        }
        let [r, g, b] = known.1;
        *entry = [r, g, b, extinction_from_opacity(alpha) as f32];
    }
    capped
}

/// sRGB to linear by a table, to within 3e-8: a power for each of 200 000 channels takes longer
/// than people's hands allow.
fn decode(encoded: f64) -> f32 {
    const STEPS: usize = 1 << 12;
    static LINEAR: LazyLock<Vec<f64>> =
        LazyLock::new(|| (0..=STEPS).map(|i| linear_from_srgb(i as f64 / STEPS as f64)).collect());
    let x = encoded.clamp(0.0, 1.0) * STEPS as f64;
    let index = (x as usize).min(STEPS - 1);
    let f = x - index as f64;
    (LINEAR[index] * (1.0 - f) + LINEAR[index + 1] * f) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Srgb8;
    use crate::transfer::{ColourMap, ColourSource};

    fn function(opacity: &[(f64, f64)], range: [f64; 2]) -> TransferFunction {
        let colour = ColourSource::Map { map: ColourMap::Inferno, range };
        TransferFunction::new(opacity.to_vec(), colour).unwrap()
    }

    fn assert_near(f: &TransferFunction, table: &Table, value: f64, tolerance: f64) {
        let [r, g, b] = f.colour_at(value).0;
        let expected = [r, g, b, extinction_from_opacity(f.opacity_at(value))];
        for (found, expected) in table.lookup(value).into_iter().zip(expected) {
            let error = (f64::from(found) - expected).abs();
            assert!(
                error <= tolerance,
                "{f:?} {:?} at {value}: {found} for {expected}",
                table.coordinate
            );
        }
    }

    #[test]
    fn narrow_integers_have_an_exact_entry_for_every_code() {
        let f = function(&[(-7.5, 0.0), (3.0, 0.0), (3.0, 1.0), (90.0, 0.1)], [-20.0, 100.0]);
        let cases = [
            (ScalarType::UInt8, 0..=255_i32),
            (ScalarType::Int8, -128..=127),
            (ScalarType::UInt16, 0..=65_535),
            (ScalarType::Int16, -32_768..=32_767),
            (ScalarType::Int32, -300..=300),
            (ScalarType::UInt64, 0..=300),
        ];
        for (scalar_type, codes) in cases {
            let table = Table::new(&f, scalar_type);
            for code in codes {
                assert_near(&f, &table, f64::from(code), 1e-6);
            }
        }
    }

    #[test]
    fn other_types_resolve_the_functions_own_span_and_hold_beyond_it() {
        let f = function(&[(0.1, 0.0), (0.2, 0.9), (0.4, 0.3)], [0.1, 0.3]);
        for scalar_type in [ScalarType::Float32, ScalarType::Float64] {
            let table = Table::new(&f, scalar_type);
            for i in -100..=600 {
                assert_near(&f, &table, f64::from(i) * 0.001 + 1e-5, 2e-4);
            }
            for wild in [f64::NEG_INFINITY, -1e308, 1e308, f64::INFINITY, 0.1, 0.4] {
                assert_near(&f, &table, wild, 1e-6);
            }
            assert_eq!(table.lookup(f64::NAN), [0.0; 4]);
        }
    }

    #[test]
    fn steps_at_the_ends_and_of_no_width_are_kept() {
        let steps = [
            function(&[(5.0, 0.0), (5.0, 1.0)], [5.0, 5.0]),
            function(&[(5.0, 0.0), (5.0, 1.0), (10.0, 1.0), (10.0, 0.5)], [5.0, 10.0]),
            function(&[(1e30, 0.0), (1e30, 1.0)], [1e30, 1e30]),
        ];
        for f in steps {
            for scalar_type in [ScalarType::Float32, ScalarType::Int32, ScalarType::UInt8] {
                let table = Table::new(&f, scalar_type);
                for v in [0.0, 4.0, 11.0, 200.0] {
                    assert_near(&f, &table, v, 1e-6);
                }
            }
        }
        let at_zero = function(&[(0.0, 0.0), (0.0, 1.0)], [0.0, 0.0]);
        let table = Table::new(&at_zero, ScalarType::Float64);
        assert_eq!((table.lookup(-1e-30)[3], table.lookup(0.0)[3] > 9.0), (0.0, true));
    }

    #[test]
    fn no_span_overflows_and_none_is_too_small() {
        let huge = function(&[(-1e308, 0.0), (1e308, 0.9)], [-1e308, 1e308]);
        let table = Table::new(&huge, ScalarType::Float64);
        for v in [-1e308, -0.4e308, 0.0, 0.9e308, 1e308] {
            assert_near(&huge, &table, v, 2e-4);
        }
        let tiny = function(&[(0.0, 0.0), (5e-324, 0.9)], [0.0, 5e-324]);
        let table = Table::new(&tiny, ScalarType::Float64);
        assert!(table.entries.iter().flatten().all(|x| x.is_finite()));
        assert!(table.lookup(1.0)[3] > 2.0);
        let none =
            TransferFunction::of(vec![], ColourSource::Stops(vec![(f64::NAN, Srgb8::WHITE)]));
        assert_eq!(Table::new(&none, ScalarType::Float32).lookup(3.0)[3], 0.0);
    }

    #[test]
    fn full_opacity_is_capped_and_counted() {
        let f = function(&[(9.0, 0.5), (10.0, 1.0)], [0.0, 255.0]);
        let table = Table::new(&f, ScalarType::UInt8);
        assert_eq!(table.capped_count, 246);
        assert!((f64::from(table.lookup(20.0)[3]) + TRANSMITTANCE_FLOOR.ln()).abs() < 1e-5);
    }

    #[test]
    fn the_greatest_extinction_bounds_every_value_of_a_range_and_is_met() {
        let f = function(&[(0.3, 0.0), (0.5, 0.9), (0.6, 0.0), (0.9, 0.0), (1.0, 0.2)], [0.0, 1.0]);
        for scalar_type in [ScalarType::Float32, ScalarType::UInt8] {
            let scale = if scalar_type == ScalarType::UInt8 { 255.0 } else { 1.0 };
            let mut f = f.clone();
            f.opacity.iter_mut().for_each(|p| p.0 *= scale);
            let table = Table::new(&f, scalar_type);
            let mut seed = 7_u32;
            let mut random = || {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(seed >> 8) / f64::from(1_u32 << 24) * 1.4 * scale - 0.2 * scale
            };
            for _ in 0..400 {
                let (a, b) = (random(), random());
                let (low, high) = (a.min(b), a.max(b));
                let greatest = table.greatest_extinction(low, high);
                let met = (0..=500)
                    .map(|i| table.lookup(low + (high - low) * f64::from(i) / 500.0)[3])
                    .fold(0.0, f32::max);
                assert!(met <= greatest * 1.000_001, "{low}..{high}: {met} > {greatest}");
                assert!(greatest - met < 0.05 * greatest + 0.2, "{low}..{high}: {greatest} {met}");
            }
            assert_eq!(table.greatest_extinction(0.65 * scale, 0.88 * scale), 0.0);
            assert_eq!(table.greatest_extinction(1.0, -1.0), 0.0);
            assert_eq!(table.greatest_extinction(f64::NAN, 1.0), 0.0);
            let all = table.greatest_extinction(f64::NEG_INFINITY, f64::INFINITY);
            assert!((f64::from(all) - 10.0_f64.ln()).abs() < 0.1, "{all}");
        }
    }
}

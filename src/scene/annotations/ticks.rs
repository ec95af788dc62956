//! Round numbers along an axis, and their words.

/// Tick marks are 1, 2, 2.5 or 5 times a power of ten apart: in tenths.
const STEPS: [u32; 5] = [10, 20, 25, 50, 100];
/// Powers of ten of the greatest number that are written out; others get an exponent.
const PLAIN: std::ops::RangeInclusive<i32> = -3..=5;
/// Significant digits of a number that stands alone.
const ALONE_DIGITS: i32 = 5;
/// Doubles have no more digits than these to tell them apart by.
const MOST_DECIMALS: i32 = 17;
/// More ticks than this are asked for by nobody.
const MOST_TICKS: i64 = 1000;

/// A number in words: `-2.5` and, where it has an exponent, what stands raised behind it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Number {
    /// `−2.5`, or `−2.5×10`.
    pub text: String,
    /// `−6`, or nothing.
    pub raised: String,
}

impl Number {
    /// A number that stands alone: five digits at most, without zeros at their end.
    pub fn alone(value: f64) -> Self {
        let exponent = exponent_of(value);
        Self::written(value, Style { exponent, last: exponent - ALONE_DIGITS + 1, trims: true })
    }

    /// A number with decimals down to 10^`last`, and an exponent where those beside it call for one.
    fn written(value: f64, Style { exponent, last, trims }: Style) -> Self {
        if value == 0.0 {
            return Self { text: "0".to_owned(), raised: String::new() };
        }
        let is_plain = PLAIN.contains(&exponent);
        let shift = if is_plain { 0 } else { exponent };
        let decimals = (shift - last).clamp(0, MOST_DECIMALS);
        #[expect(clippy::cast_sign_loss, reason = "clamped above 0")]
        let decimals = decimals as usize;
        let mut digits =
            if is_plain { format!("{value:.decimals$}") } else { shifted(value, shift, decimals) };
        if trims && digits.contains('.') {
            digits.truncate(digits.trim_end_matches('0').trim_end_matches('.').len());
        }
        let digits = digits.replace('-', "\u{2212}");
        if is_plain {
            return Self { text: digits, raised: String::new() };
        }
        let raised = shift.to_string().replace('-', "\u{2212}");
        Self { text: format!("{digits}\u{d7}10"), raised }
    }
}

/// How numbers beside each other are written.
#[derive(Debug, Clone, Copy)]
struct Style {
    /// Power of ten of the greatest of them.
    exponent: i32,
    /// Power of ten of their last digit.
    last: i32,
    /// Whether zeros at the end are left out.
    trims: bool,
}

/// Power of ten of a number's first digit; 0 for 0.
fn exponent_of(value: f64) -> i32 {
    // By its digits: logarithms of powers of ten are off by a rounding.
    let digits = format!("{:.*e}", 4, value);
    digits.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// The decimals of value / 10^`shift`.
fn shifted(value: f64, shift: i32, decimals: usize) -> String {
    let ratio = if shift.abs() > 300 {
        // Neither 10^308 nor 10^−320 is to be divided by at once.
        value / power(shift / 2) / power(shift - shift / 2)
    } else {
        value / power(shift)
    };
    format!("{ratio:.decimals$}")
}

/// 10^`exponent`, the double nearest to it.
fn power(exponent: i32) -> f64 {
    format!("1e{exponent}").parse().unwrap_or(f64::INFINITY)
}

/// The ticks of an axis, in ascending order, with their words.
pub fn ticks(low: f64, high: f64, most: u32) -> Vec<(f64, Number)> {
    if !low.is_finite() || !high.is_finite() || most == 0 {
        return Vec::new();
    }
    let (low, high) = (low.min(high), low.max(high));
    // Halved, so that ±1e308 does not overflow.
    let half = high / 2.0 - low / 2.0;
    let least_step = half / f64::from(most) * 2.0;
    let last = exponent_of(least_step);
    let steps = STEPS.iter().map(|&tenths| (tenths, f64::from(tenths) * power(last - 1)));
    let Some((tenths, step)) =
        steps.into_iter().find(|(_, step)| *step >= least_step * (1.0 - 1e-9))
    else {
        // Among the least of all doubles there are no round ones.
        return [low, high].map(|value| (value, Number::alone(value))).to_vec();
    };
    if !(step > 0.0 && step.is_finite()) {
        return vec![(low, Number::alone(low))];
    }
    // A little beyond the ends, so that rounding leaves none of them out.
    let slack = 1e-6;
    let (first, end) = ((low / step - slack).ceil(), (high / step + slack).floor());
    #[expect(clippy::cast_possible_truncation, reason = "checked below")]
    let count = (end - first) as i64 + 1;
    if !(1..=MOST_TICKS).contains(&count) || first + 1.0 == first {
        // Too far from 0 for doubles to tell the ticks apart.
        return vec![(low, Number::alone(low))];
    }
    let exponent = exponent_of((first * step).abs().max((end * step).abs()));
    let last = match tenths {
        25 => last - 1,
        100 => last + 1,
        _ => last,
    };
    let style = Style { exponent, last, trims: false };
    (0..count)
        .map(|i| {
            let value = (first + i as f64) * step;
            (value, Number::written(value, style))
        })
        .collect()
}

/// The greatest of 1, 2 and 5 times powers of ten that is at most `value`; `None` where that is not
/// above 0.
pub fn round_below(value: f64) -> Option<f64> {
    if !(value > 0.0 && value.is_finite()) {
        return None;
    }
    let exponent = exponent_of(value);
    let steps = [5.0, 2.0, 1.0].map(|m| m * power(exponent));
    // The first digit may have been rounded up to ten.
    let steps = steps.into_iter().chain([0.5 * power(exponent)]);
    steps.into_iter().find(|step| *step > 0.0 && *step <= value * (1.0 + 1e-9))
}

/// The least of 1, 2 and 5 times powers of ten that is at least `value`, in 0..=1: of opacities.
pub(super) fn round_above(value: f64) -> f64 {
    let below = round_below(value).unwrap_or(0.0);
    let all = [1.0, 2.0, 2.5, 4.0, 5.0].map(|times| below * times);
    // 2 → 4 is no round number, but 2 → 5 and 5 → 10 are.
    let is_round = |v: &f64| round_below(*v).is_some_and(|r| (r / v - 1.0).abs() < 1e-9);
    let found = all.into_iter().filter(is_round).find(|v| *v >= value * (1.0 - 1e-9));
    found.unwrap_or(1.0).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(low: f64, high: f64, most: u32) -> Vec<String> {
        let word = |(_, n): (f64, Number)| match n.raised.as_str() {
            "" => n.text,
            raised => format!("{}^{raised}", n.text),
        };
        ticks(low, high, most).into_iter().map(word).collect()
    }

    #[test]
    fn ticks_are_round_and_as_many_as_asked_for_at_most() {
        assert_eq!(words(0.0, 255.0, 6), ["0", "50", "100", "150", "200", "250"]);
        assert_eq!(words(-1.0, 1.0, 4), ["−1.0", "−0.5", "0", "0.5", "1.0"]);
        assert_eq!(
            words(0.0, 10.0, 4),
            ["0.0", "2.5", "5.0", "7.5", "10.0"].map(|w| match w {
                "0.0" => "0",
                w => w,
            })
        );
        assert_eq!(words(12.0, 13.0, 3), ["12.0", "12.5", "13.0"]);
        for (low, high) in [(0.1, 0.7), (-3e4, 1e3), (1e-7, 9e-7), (5e8, 6e8), (99.0, 101.0)] {
            for most in 2..9 {
                let found = ticks(low, high, most);
                assert!((1..=most as usize + 1).contains(&found.len()), "{low} {high} {most}");
                let words: Vec<_> = found.iter().map(|(_, n)| n.clone()).collect();
                for pair in words.windows(2) {
                    assert_ne!(pair[0], pair[1], "told apart");
                }
                assert!(found.iter().all(|(v, _)| *v >= low - 1e-6 * (high - low)), "{found:?}");
                assert!(found.iter().all(|(v, _)| *v <= high + 1e-6 * (high - low)), "{found:?}");
            }
        }
    }

    #[test]
    fn large_and_small_numbers_have_one_exponent_and_true_minus_signs() {
        assert_eq!(words(0.0, 3e6, 3), ["0", "1×10^6", "2×10^6", "3×10^6"]);
        assert_eq!(words(-2e-6, 0.0, 2), ["−2×10^−6", "−1×10^−6", "0"]);
        assert_eq!(words(1e6, 1.0004e6, 2), ["1.0000×10^6", "1.0002×10^6", "1.0004×10^6"]);
        assert_eq!(words(0.0, 2e-300, 2), ["0", "1×10^−300", "2×10^−300"]);
        assert_eq!(words(0.0, 2e-320, 2), ["0", "2×10^−320"]);
        let huge = words(-1.5e308, 1.5e308, 4);
        assert!(huge.contains(&"−1×10^308".to_owned()) && huge.len() >= 3, "{huge:?}");
        assert_eq!(words(4.0, 4.0, 5), ["4"]);
        assert_eq!(words(f64::NAN, 4.0, 5), [""; 0]);
        assert_eq!(words(0.0, f64::INFINITY, 5), [""; 0]);
    }

    #[test]
    fn a_number_alone_has_no_needless_digits() {
        let alone = |v: f64| {
            let Number { text, raised } = Number::alone(v);
            format!("{text}^{raised}")
        };
        assert_eq!(alone(50.0), "50^");
        assert_eq!(alone(-0.25), "−0.25^");
        assert_eq!(alone(99_999.0), "99999^");
        assert_eq!(alone(5e6), "5×10^6");
        assert_eq!(alone(2e-4), "2×10^−4");
        assert_eq!(alone(1.0 / 3.0), "0.33333^");
        assert_eq!(alone(0.0), "0^");
    }

    #[test]
    fn round_lengths_are_the_nearest_below() {
        for (value, below) in [(7.0, 5.0), (5.0, 5.0), (4.9, 2.0), (0.0199, 0.01), (1e9, 1e9)] {
            let found = round_below(value).unwrap();
            assert!((found / below - 1.0).abs() < 1e-12, "{value}: {found}");
        }
        assert!((round_below(9.999_99).unwrap() - 5.0).abs() < 1e-12);
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(round_below), [None; 4]);
        for (value, above) in [(0.03, 0.05), (0.2, 0.2), (0.21, 0.5), (0.6, 1.0), (1.0, 1.0)] {
            let found = round_above(value);
            assert!((found - above).abs() < 1e-12, "{value}: {found}");
        }
    }
}

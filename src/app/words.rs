//! Numbers and names as people read them.

use crate::kernel::Kernel;
use crate::transfer::ColourMap;

/// A no-break space between groups of three digits.
const GROUP: char = '\u{a0}';

/// A count with its digits in groups of three: `16 777 216`.
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(GROUP);
        }
        text.push(digit);
    }
    text
}

/// A value with five significant digits, without trailing zeros: `0.0123`, `-1024`, `3.2e9`.
pub fn value(v: f64) -> String {
    if v == 0.0 {
        return "0".to_owned();
    }
    let magnitude = v.abs();
    if !(1e-4..1e7).contains(&magnitude) {
        return trimmed(&format!("{v:.4e}"));
    }
    // Digits before the point take from those after it.
    let decimals = [1e4, 1e3, 1e2, 1e1, 1e0, 1e-1, 1e-2, 1e-3]
        .iter()
        .position(|&limit| magnitude >= limit)
        .unwrap_or(8);
    trimmed(&format!("{v:.decimals$}"))
}

/// Without zeros at the end of the fraction, before an exponent if there is one.
fn trimmed(text: &str) -> String {
    let (mantissa, exponent) = match text.find('e') {
        Some(at) => text.split_at(at),
        None => (text, ""),
    };
    if !mantissa.contains('.') {
        return text.to_owned();
    }
    let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
    format!("{mantissa}{exponent}")
}

/// A duration in milliseconds: `8.3 ms`, `210 ms`, `3.4 s`.
pub fn milliseconds(ms: f64) -> String {
    match ms {
        ms if ms < 10.0 => format!("{ms:.1} ms"),
        ms if ms < 1000.0 => format!("{ms:.0} ms"),
        ms => format!("{:.1} s", ms / 1000.0),
    }
}

/// A script's name for something, as the interface writes it: `ct-like` → `CT-like`.
fn sentence_case(name: &str) -> String {
    if let Some(rest) = name.strip_prefix("ct-") {
        return format!("CT-{rest}");
    }
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A colour map's name in the interface.
pub fn colour_map(map: ColourMap) -> String {
    sentence_case(map.name())
}

/// A kernel's name in the interface.
pub fn kernel(kernel: Kernel) -> String {
    match kernel {
        Kernel::BSpline => "B-spline".to_owned(),
        other => sentence_case(other.name()),
    }
}

/// What a kernel is good for, one line.
pub fn kernel_help(kernel: Kernel) -> &'static str {
    match kernel {
        Kernel::Point => "One pixel a voxel: the fastest, and full of holes up close",
        Kernel::Nearest => "Every voxel is a box: sharp edges, no smoothing at all",
        Kernel::Gaussian => "A soft blob (standard deviation 0.6 voxels): smooth, a little blurred",
        Kernel::Linear => "Straight between neighbours, as most viewers do: quick, with creases",
        Kernel::BSpline => "The smoothest: passes through every sample, without creases",
        Kernel::Cubic => "The optimal cubic (radius 1.556 voxels): smooth with the least ripple",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_grouped() {
        let plain = |n| count(n).replace(GROUP, " ");
        assert_eq!(plain(0), "0");
        assert_eq!(plain(999), "999");
        assert_eq!(plain(1_000), "1 000");
        assert_eq!(plain(16_777_216), "16 777 216");
    }

    #[test]
    fn values_keep_five_significant_digits() {
        for (v, text) in [
            (0.0, "0"),
            (255.0, "255"),
            (-1024.0, "-1024"),
            (0.5, "0.5"),
            (0.001_234_56, "0.0012346"),
            (3.2e9, "3.2e9"),
            (-1.234_56e-7, "-1.2346e-7"),
            (123_456.0, "123456"),
            (12.345_67, "12.346"),
        ] {
            assert_eq!(value(v), text);
        }
    }

    #[test]
    fn durations_have_the_digits_that_matter() {
        assert_eq!(milliseconds(8.34), "8.3 ms");
        assert_eq!(milliseconds(209.6), "210 ms");
        assert_eq!(milliseconds(3_420.0), "3.4 s");
    }

    #[test]
    fn names_are_in_sentence_case() {
        assert_eq!(colour_map(ColourMap::CtLike), "CT-like");
        assert_eq!(kernel(Kernel::Gaussian), "Gaussian");
    }
}

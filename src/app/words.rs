//! Numbers and names as people read them.

use crate::kernel::Kernel;
use crate::scene::{Backend, Classify, OpacityModel, Order, Reconstruction, Visibility};
use crate::task::level::{LevelOfDetail, SlabField};
use crate::transfer::ColourMap;
use crate::transfer::presets::Preset;

/// Levels from here on have no number of their own.
const MOST_DB: f64 = 99.5;
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

/// A range, as far as its ends are told apart: an end next to 0 beside the other one is `0`.
pub fn range([low, high]: [f64; 2]) -> String {
    /// Of the greater end.
    const NEXT_TO_0: f64 = 1e-6;
    let least = NEXT_TO_0 * low.abs().max(high.abs());
    let [low, high] = [low, high].map(|end| value(if end.abs() < least { 0.0 } else { end }));
    format!("{low} to {high}")
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

/// A duration that is only thought: `0.8 s`, `12 s`, `3 min`.
pub fn roughly(ms: f64) -> String {
    match ms / 1000.0 {
        secs if secs < 0.95 => format!("{:.1} s", secs.max(0.1)),
        secs if secs < 90.0 => format!("{secs:.0} s"),
        secs => format!("{:.0} min", secs / 60.0),
    }
}

/// Beyond twice or half an error, dB, the middle says less than the ends.
const WIDE: f64 = 6.5;

/// A level in dB: `29.8 dB`; beyond what bytes can show, and for equal pictures, `more than 99 dB`.
pub fn decibels(db: f64) -> String {
    match db {
        db if db.is_nan() => "unknown".to_owned(),
        db if db >= MOST_DB => "more than 99 dB".to_owned(),
        db => format!("{db:.1} dB"),
    }
}

/// What is said of an error that no display shows.
pub const NO_ERROR: &str = "no visible error";
/// Below half of the least step that a display can show, nobody sees an error: dB.
const SEEN_DB: f64 = 54.0;

/// The error of a level in dB, as a share of the brightest light: `error 0.5 %`, or [`NO_ERROR`].
pub fn error_of(db: f64) -> String {
    match db {
        db if db.is_nan() => "error unknown".to_owned(),
        db if db >= SEEN_DB => NO_ERROR.to_owned(),
        db => format!("error {}", percent_of(db)),
    }
}

/// The same where it is not known of the picture itself: `error about 3 %`.
pub fn error_about(db: f64) -> String {
    match db {
        db if db.is_nan() || db >= SEEN_DB => error_of(db),
        db => format!("error about {}", percent_of(db)),
    }
}

/// The same where it is known within so many dB: `error about 0.3 %`, or where that is wide the worst end, `error up to 1.6 %`.
pub fn error_within(db: f64, within: f64) -> String {
    match db {
        db if within > WIDE && db - within < SEEN_DB && db < MOST_DB => {
            format!("error up to {}", percent_of((db - within).max(0.0)))
        }
        db => error_about(db),
    }
}

/// The error of a level in dB, percent of the brightest light.
fn percent_of(db: f64) -> String {
    share_of_light(10.0_f64.powf(-db / 20.0))
}

/// A part of the brightest light, in percent: `12 %`, `3.1 %`.
pub fn share_of_light(share: f64) -> String {
    match 100.0 * share {
        percent if percent >= 9.95 => format!("{percent:.0} %"),
        percent if percent < 0.05 => "< 0.1 %".to_owned(),
        percent => format!("{percent:.1} %"),
    }
}

/// A level that is not known of the picture itself: `about 29.8 dB`, or in whole dB `about 30 dB`; as
/// [`decibels`] where that is no number.
pub fn about_decibels(db: f64, is_whole: bool) -> String {
    match db {
        db if db.is_nan() || db >= MOST_DB => decibels(db),
        db if is_whole => format!("about {db:.0} dB"),
        db => format!("about {db:.1} dB"),
    }
}

/// A level that is known within so many dB: `52 ± 3 dB`, or where that is wide `36 to 68 dB`; as [`decibels`] where that is no number.
pub fn decibels_within(db: f64, within: f64) -> String {
    match db {
        db if db.is_nan() || db >= MOST_DB => decibels(db),
        db if within > WIDE => format!("{:.0} to {:.0} dB", (db - within).max(0.0), db + within),
        db => format!("{db:.0} ± {within:.0} dB"),
    }
}

/// A script's name for something, as the interface writes it: `ct-like` → `CT-like`.
fn sentence_case(name: &str) -> String {
    if let Some(rest) = name.strip_prefix("ct-") {
        return format!("CT-{rest}");
    }
    capital(name)
}

/// Words that begin with a capital letter.
pub fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A colour map's name in the interface.
pub fn colour_map(map: ColourMap) -> String {
    sentence_case(map.name())
}

/// What a colour map is good for, one line.
pub fn colour_map_help(map: ColourMap) -> &'static str {
    match map {
        ColourMap::Turbo => {
            "A rainbow: shows many steps, but not safe for colour-blind people, nor in print"
        }
        ColourMap::CtLike => {
            "As anatomy is often coloured; lighter is more, safe for colour-blind people"
        }
        map if map.is_diverging() => {
            "From one colour over a neutral middle to another; safe for colour-blind people"
        }
        _ => "Lighter is more, in even steps; safe for colour-blind people",
    }
}

/// What a preset is called, and what it is good for, one line.
pub fn preset(preset: Preset) -> (&'static str, &'static str) {
    match preset {
        Preset::Default => ("Default", "What the histogram suggests, as when the file was opened"),
        Preset::CtBone => ("CT bone", "Bone alone, from 120 Hounsfield units"),
        Preset::CtSkin => ("CT skin", "The body's surface, nearly opaque"),
        Preset::CtVessels => {
            ("CT vessels", "Contrast medium at 200 to 500 Hounsfield units, bone fainter")
        }
        Preset::Mr => ("MR", "Tissue in greys, bright ones denser"),
        Preset::Simulation => {
            ("Simulation", "A veil over all but the commonest value, thicker the higher")
        }
    }
}

/// A kernel's name in the interface.
pub fn kernel(kernel: Kernel) -> String {
    match kernel {
        Kernel::BSpline => "B-spline".to_owned(),
        Kernel::Functions => "Basis functions".to_owned(),
        Kernel::Ellipsoids => "Points as ellipsoids".to_owned(),
        other => sentence_case(other.name()),
    }
}

/// What a kernel is good for, one line.
pub fn kernel_help(kernel: Kernel) -> &'static str {
    match kernel {
        Kernel::Point => "One pixel a voxel: the fastest, and full of holes up close",
        Kernel::Nearest => "Every voxel is a box: sharp edges, no smoothing at all",
        Kernel::Gaussian => "A soft blob (standard deviation 0.6 voxels): smooth, a little blurred",
        Kernel::Gouraud => {
            "The cubic's blob as a small mesh of triangles, shaded between its corners as in 1991: a \
             few per cent off"
        }
        Kernel::Linear => "Straight between neighbours, as most viewers do: quick, with creases",
        Kernel::BSpline => "The smoothest: passes through every sample, without creases",
        Kernel::Functions => {
            "The functions of an encoding themselves, without samples: smooth everywhere, as near to the data as its error \
             says"
        }
        Kernel::Cells => {
            "The cells of the grid themselves, without samples: straight between the points of tetrahedra, by shape functions \
             in others"
        }
        Kernel::Ellipsoids => {
            "The points themselves, without samples: the mean of ellipsoids, each as wide as its neighbours lie apart"
        }
        Kernel::Cubic => "The optimal cubic (radius 1.556 voxels): smooth with the least ripple",
    }
}

/// What a way of hiding is called, and what it means, one line.
pub fn visibility(visibility: Visibility) -> (&'static str, &'static str) {
    match visibility {
        Visibility::EverySample => (
            "Every sample",
            "Each sample's footprint is laid over those behind it: quick, but colours bleed where \
             footprints overlap",
        ),
        Visibility::Sheets => (
            "Sheets",
            "Footprints are added up in sheets along one axis of the data, then laid over each \
             other: the picture jumps when that axis changes",
        ),
        Visibility::Slabs => (
            "Slabs",
            "Each ray is cut into short steps, called slabs, in which samples are added up: no jumps, and as exact as you like",
        ),
    }
}

/// What a time of classification is called, and what it means, one line.
pub fn classify(classify: Classify) -> (&'static str, &'static str) {
    match classify {
        Classify::Before => (
            "Before",
            "Each sample is coloured first, and colours are blended: soft, and thin layers wash out",
        ),
        Classify::After => (
            "After",
            "Values are blended first, and one value in the middle of each slab is coloured",
        ),
        Classify::PreIntegrated => (
            "Pre-integrated",
            "Values are blended first, and all values through each slab are coloured: thin layers \
             stay whole",
        ),
        Classify::Mean => (
            "Mean",
            "Basis functions are splatted into slabs, and the mean value of each slab is coloured: thin layers are \
             softened",
        ),
    }
}

/// What a reconstruction is called, and what it means, one line.
pub fn reconstruction(reconstruction: Reconstruction) -> (&'static str, &'static str) {
    match reconstruction {
        Reconstruction::Smooth => {
            ("Smooth", "Samples are blended as they are: noise is softened, and so is fine detail")
        }
        Reconstruction::Interpolating => {
            ("Interpolating", "The blend passes through every sample: sharp, and true to the data")
        }
    }
}

/// What an opacity model is called, and what it means, one line.
pub fn opacity_model(model: OpacityModel) -> (&'static str, &'static str) {
    match model {
        OpacityModel::OpticalDepth => (
            "Optical depth",
            "Depths add up where kernels overlap, as light does: what is drawn does not depend on \
             how it is cut",
        ),
        OpacityModel::Published => (
            "Published",
            "Opacities add up where kernels overlap and stop at 1, as the papers print it",
        ),
    }
}

/// What an order is called, and what it means, one line.
pub fn order(order: Order) -> (&'static str, &'static str) {
    match order {
        Order::BackToFront => ("Back to front", "Far things first, near things laid over them"),
        Order::FrontToBack => {
            ("Front to back", "Near things first: what they hide need not be drawn at all")
        }
    }
}

/// What a back end is called, and what it means, one line.
pub fn backend(backend: Backend) -> (&'static str, &'static str) {
    match backend {
        Backend::Auto => ("Automatic", "Whichever is faster here: both draw the same picture"),
        Backend::Raster => ("Triangles", "Footprints as blended triangles: only for every sample"),
        Backend::Tiles => ("Tiles", "Small squares of the screen, each walked front to back"),
    }
}

/// To what level of detail a picture was drawn, without its details: `Coarse`, `Full`.
pub fn level(level: &LevelOfDetail) -> String {
    sentence_case(&level_and_details(level).0)
}

/// The same with them, as within a sentence: `coarse, full at 132 × 104`.
pub fn level_in_full(level: &LevelOfDetail) -> String {
    match level_and_details(level) {
        (level, Some(details)) => format!("{level}, {details}"),
        (level, None) => level,
    }
}

fn level_and_details(level: &LevelOfDetail) -> (String, Option<String>) {
    let with = |level: &str, details: String| (level.to_owned(), Some(details));
    match *level {
        LevelOfDetail::Octree { max_error } => {
            with("coarse", format!("octree error {max_error:.3}"))
        }
        LevelOfDetail::Reduced { field, size: [width, height], cut, is_timed } => {
            let field = match field {
                SlabField::Own => "full",
                SlabField::Preview => "linear kernels",
            };
            let cut = cut.map_or_else(String::new, |cut| {
                let waiting = match cut.waiting {
                    0 => String::new(),
                    waiting => format!(", waiting for {}", count(waiting)),
                };
                format!(", octree of {} bricks{waiting}", count(cut.nodes()))
            });
            let reduced = format!("{field} at {width} × {height}{cut}");
            if is_timed { with("coarse", reduced) } else { (reduced, None) }
        }
        LevelOfDetail::Subsampled { level } => {
            let which = if level == 1 { "second".to_owned() } else { format!("{}th", 1 << level) };
            with(&format!("every {which} sample"), "averaged".to_owned())
        }
        LevelOfDetail::Cheaper(kernel) => with("every voxel", format!("{} kernel", kernel.name())),
        LevelOfDetail::FullInPart => ("full, in part".to_owned(), None),
        LevelOfDetail::FULL => ("full".to_owned(), None),
        LevelOfDetail::Full { vectors_halved } => {
            with("full", format!("vectors halved {vectors_halved} times more"))
        }
        LevelOfDetail::Refined(convergence) => {
            let state = if convergence.is_reached() { "converged" } else { "refined" };
            with(state, format!("{} slabs per voxel", convergence.slabs_per_voxel))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::still::Convergence;

    #[test]
    fn a_level_that_is_hardly_known_is_told_by_its_ends() {
        assert_eq!(decibels_within(52.3, 3.0), "52 ± 3 dB");
        assert_eq!(decibels_within(52.3, 16.0), "36 to 68 dB");
        assert_eq!(decibels_within(9.0, 16.0), "0 to 25 dB");
        assert_eq!(error_within(52.3, 3.0), "error about 0.2 %");
        assert_eq!(error_within(52.3, 16.0), "error up to 1.5 %");
        assert_eq!(error_within(64.0, 16.0), "error up to 0.4 %");
        assert_eq!(error_within(9.0, 16.0), "error up to 100 %");
        assert_eq!(
            (error_of(53.0), error_about(24.4)),
            ("error 0.2 %".into(), "error about 6.0 %".into())
        );
        for none in [error_of(54.5), error_about(f64::INFINITY), error_within(71.0, 16.0)] {
            assert_eq!(none, NO_ERROR);
        }
        assert_eq!(decibels_within(f64::NAN, 16.0), "unknown");
    }

    #[test]
    fn ends_of_a_range_are_as_precise_as_the_range_asks_for() {
        assert_eq!(range([2.7197e-25, 1.0]), "0 to 1");
        assert_eq!(range([-1e-9, 3e4]), "0 to 30000");
        assert_eq!(range([-1024.0, 1e-7]), "-1024 to 0");
        assert_eq!(range([1e-25, 2e-25]), "1e-25 to 2e-25");
        assert_eq!(range([0.0, 0.0]), "0 to 0");
    }

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
    fn durations_that_are_only_thought_have_fewer_digits() {
        for (ms, text) in [(3.0, "0.1 s"), (812.0, "0.8 s"), (990.0, "1 s"), (12_345.0, "12 s")] {
            assert_eq!(roughly(ms), text);
        }
        assert_eq!(roughly(200_000.0), "3 min");
    }

    #[test]
    fn levels_have_one_digit_after_the_point() {
        assert_eq!(decibels(29.84), "29.8 dB");
        assert_eq!(decibels(f64::INFINITY), "more than 99 dB");
        assert_eq!(decibels(f64::NAN), "unknown");
        assert_eq!(about_decibels(29.84, false), "about 29.8 dB");
        assert_eq!(about_decibels(29.84, true), "about 30 dB");
        for is_whole in [false, true] {
            assert_eq!(about_decibels(f64::INFINITY, is_whole), "more than 99 dB");
            assert_eq!(about_decibels(99.5, is_whole), "more than 99 dB");
            assert_eq!(about_decibels(f64::NAN, is_whole), "unknown");
        }
    }

    #[test]
    fn every_choice_has_a_name_and_a_line_of_its_own() {
        let mut lines: Vec<(&str, &str)> = Vec::new();
        lines.extend(Visibility::ALL.iter().map(|&v| visibility(v)));
        lines.extend(Classify::ALL.iter().map(|&c| classify(c)));
        lines.extend(Reconstruction::ALL.iter().map(|&r| reconstruction(r)));
        lines.extend(OpacityModel::ALL.iter().map(|&o| opacity_model(o)));
        lines.extend(Order::ALL.iter().map(|&o| order(o)));
        lines.extend(Backend::ALL.iter().map(|&b| backend(b)));
        lines.extend(Preset::ALL.map(preset));
        for (i, (name, help)) in lines.iter().enumerate() {
            assert!(!help.ends_with('.') && !help.contains('\n'), "{help}");
            assert!(lines[i + 1..].iter().all(|(other, _)| other != name), "{name}");
        }
    }

    #[test]
    fn a_level_is_said_with_its_details_and_without() {
        use LevelOfDetail::{Cheaper, Full, FullInPart, Octree, Reduced, Refined, Subsampled};
        let at = |field, is_timed| Reduced { field, size: [132, 104], cut: None, is_timed };
        let slabs = |slabs_per_voxel, difference| {
            Refined(Convergence { slabs_per_voxel, last_difference: Some(difference) })
        };
        for (of, short, details) in [
            (Octree { max_error: 0.01 }, "Coarse", ", octree error 0.010"),
            (at(SlabField::Own, true), "Coarse", ", full at 132 × 104"),
            (at(SlabField::Preview, false), "Linear kernels at 132 × 104", ""),
            (Subsampled { level: 1 }, "Every second sample", ", averaged"),
            (Subsampled { level: 2 }, "Every 4th sample", ", averaged"),
            (Cheaper(Kernel::Point), "Every voxel", ", point kernel"),
            (FullInPart, "Full, in part", ""),
            (LevelOfDetail::FULL, "Full", ""),
            (Full { vectors_halved: 2 }, "Full", ", vectors halved 2 times more"),
            (slabs(4.0, 0.1), "Refined", ", 4 slabs per voxel"),
            (slabs(8.0, 0.001), "Converged", ", 8 slabs per voxel"),
        ] {
            assert_eq!(level(&of), short);
            assert_eq!(level_in_full(&of), format!("{short}{details}").to_lowercase());
        }
    }

    #[test]
    fn names_are_in_sentence_case() {
        assert_eq!(colour_map(ColourMap::CtLike), "CT-like");
        assert_eq!(kernel(Kernel::Gaussian), "Gaussian");
    }
}

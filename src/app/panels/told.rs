//! What a picture took, how near it is to the exact one and what comes next: at a glance, and in sentences.

use super::chart::number_words;
use super::status::Shown;
use crate::accuracy::psnr_from_rmse;
use crate::app::measuring::Measured;
use crate::app::{modes, words};
use crate::kernel::Kernel;
use crate::scene::{Backend, SplatSettings, Visibility};
use crate::task::draw::CutLevels;
use crate::task::engine::{EngineState, FrameReport, KernelCounts};
use crate::task::estimate::Checked;
use crate::task::level::{LevelOfDetail, SlabField};
use crate::task::remaining::{Told, WITHIN_DB};
use crate::task::smooth;

/// What the numbers of dB in the sentences mean.
pub(super) const DECIBELS: &str = "dB says how near a picture is to the exact one, which slabs of no thickness would \
                                   give: the peak signal-to-noise ratio of all its colours. 40 dB are an error of 1 % \
                                   of the brightest light, and 60 dB of 0.1 %; at 54 dB it is half of the least step \
                                   that a display can show";

/// Of a finished picture, until somebody knows.
const NOT_CHECKED: &str =
    "Not checked yet: some of its pixels are drawn again with thinner slabs once there is time";

/// How the engine stands, the time, and what that bought, on one line: `Finished · 0.2 s · exact mode`.
/// `rate`: pictures a second of a moving view, where that is known.
pub(super) fn glance(
    shown: Option<&Shown>,
    state: &EngineState,
    is_moving: bool,
    rate: Option<f64>,
) -> String {
    let mut parts = vec![state_words(shown, state, is_moving).to_owned()];
    if let Some(shown) = shown.filter(|_| !matches!(state, EngineState::Failed(_))) {
        let rate = rate.filter(|_| is_moving).map(rate_words);
        parts.push(rate.unwrap_or_else(|| took_words(shown.report.frame_ms)));
        parts.extend(near_words(shown));
    }
    parts.join(" · ")
}

fn state_words(shown: Option<&Shown>, state: &EngineState, is_moving: bool) -> &'static str {
    let report = shown.map(|shown| &shown.report);
    match (state, report) {
        (EngineState::Starting, _) => "Starting",
        (EngineState::Failed(_), _) => "Cannot draw",
        (EngineState::Idle, None) => "Nothing drawn yet",
        (EngineState::Drawing(_), None) => "Drawing",
        _ if is_moving => "Moving",
        (_, Some(report)) if report.progress < 1.0 => match report.level {
            LevelOfDetail::Full { .. } | LevelOfDetail::Refined(_) => "Refining",
            _ => "Drawing",
        },
        // Beside a finished picture another may be drawn, for comparison; but this one is to be refined.
        (EngineState::Drawing(_), Some(report))
            if report.refined.is_some_and(|refined| refined.left_ms > 0.0) =>
        {
            "Drawing"
        }
        _ => "Finished",
    }
}

/// Pictures a second: `30/s`, `4.2/s`.
fn rate_words(rate: f64) -> String {
    if rate < 9.95 { format!("{rate:.1}/s") } else { format!("{rate:.0}/s") }
}

/// A time at a glance: `12 ms`, `0.2 s`, `64 s`.
fn took_words(ms: f64) -> String {
    match ms {
        ms if ms < 95.0 => format!("{:.0} ms", ms.max(1.0)),
        ms if ms < 9950.0 => format!("{:.1} s", ms / 1000.0),
        ms => format!("{:.0} s", ms / 1000.0),
    }
}

/// How near a picture is to the exact one, in two or three words; nothing where that is not known.
fn near_words(Shown { report, mode, has_splats, measured }: &Shown) -> Option<String> {
    if !has_splats && report.level.is_full() {
        return None;
    }
    if let Some(rmse) = report.estimated_rmse {
        // The error to the exact picture, as that of the full one is: the number does not fall once that has come.
        let left = report.remaining_thought.map_or(0.0, |thought| thought.rmse);
        return Some(words::error_about(psnr_from_rmse(rmse.hypot(left))));
    }
    let found = report.remaining_rmse;
    let found =
        found.map(|rmse| words::error_within(psnr_from_rmse(rmse), report.remaining_within_db));
    match (report.level, measured) {
        (LevelOfDetail::Refined(convergence), _) if convergence.is_reached() => {
            Some(found.unwrap_or_else(|| words::NO_ERROR.to_owned()))
        }
        (LevelOfDetail::Full { .. }, Some(measured)) if measured.is_of_this_view => {
            Some(words::error_of(measured.point.db))
        }
        (LevelOfDetail::Full { .. } | LevelOfDetail::Refined(_), _) if found.is_some() => found,
        (LevelOfDetail::Full { .. } | LevelOfDetail::Refined(_), Some(measured)) => {
            let db = measured.point.db;
            Some(match measured.is_of_this_view {
                true => words::error_of(db),
                false => words::error_about(db),
            })
        }
        (LevelOfDetail::Full { .. } | LevelOfDetail::Refined(_), None) => {
            if let Some(Told { rmse, within_db }) = report.remaining_thought {
                return Some(words::error_within(psnr_from_rmse(rmse), within_db));
            }
            let name = match mode.kernel {
                _ if modes::is_exact(mode) => "exact mode",
                Kernel::Functions => "basis functions",
                Kernel::Cells => "cells",
                Kernel::Ellipsoids => "points as ellipsoids",
                _ => "approximate mode",
            };
            Some(name.to_owned())
        }
        _ => None,
    }
}

/// What the last picture of a view was found to be off by, with what that is worth: `52 ± 3 dB`.
fn found_words(rmse: f64, report: &FrameReport) -> String {
    words::decibels_within(psnr_from_rmse(rmse), report.remaining_within_db)
}

/// All there is to say of a picture: what about, and a sentence. `key` refines the view.
pub(super) fn sentences(shown: &Shown, key: &str) -> Vec<(&'static str, String)> {
    let report = &shown.report;
    let mut all = vec![("Picture", picture_words(report)), ("Accuracy", error_words(shown))];
    if let Some(checked) = report.checked {
        all.push(("Preview", checked_words(&checked)));
    }
    if let Some(next) = next_words(shown) {
        all.push(("Next", next));
    }
    if let Some(left) = left_words(report, key) {
        all.push(("Refining", left));
    }
    all.extend(report.smoothed_ms.map(|ms| ("Edges", edges_words(ms))));
    if shown.has_splats {
        all.push(("Drawn", counts_words(report)));
    }
    all
}

/// What the picture is and what it took.
fn picture_words(report: &FrameReport) -> String {
    let what = match report.level {
        LevelOfDetail::Octree { max_error } => format!(
            "A quick picture: boxes of voxels that differ little are drawn as one splat each (error up \
             to {max_error:.3})"
        ),
        LevelOfDetail::Reduced { field, size: [width, height], cut, .. } => {
            let kernels = match field {
                SlabField::Own => "",
                SlabField::Preview if report.left_out_of_quick.is_some() => {
                    ", of the functions that matter most"
                }
                SlabField::Preview => ", with linear kernels",
            };
            let cut = cut.as_ref().map_or_else(String::new, cut_words);
            let awaits = match report.awaits_cut {
                true => ", while its octree is being looked for",
                false => "",
            };
            format!("A quick picture of {width} × {height} pixels{kernels}{cut}{awaits}")
        }
        LevelOfDetail::Subsampled { .. } | LevelOfDetail::Cheaper(_) => {
            format!("A quick picture: {}", words::level_in_full(&report.level))
        }
        LevelOfDetail::FullInPart => "A part of the full picture; the rest follows".to_owned(),
        LevelOfDetail::Full { .. } => match words::level_in_full(&report.level).split_once(", ") {
            Some((_, details)) => format!("The full picture, {details}"),
            None => {
                let one = match report.own_kernels {
                    Some((Kernel::Cells, _)) => "cell",
                    Some((Kernel::Ellipsoids, _)) => "point",
                    Some(_) => "function",
                    None => "voxel",
                };
                format!("The full picture: every {one} that shows, in every pixel")
            }
        },
        LevelOfDetail::Refined(convergence) => {
            format!(
                "The full picture, refined to {}",
                slabs_words(report, convergence.slabs_per_voxel)
            )
        }
    };
    format!("{what}. It took {}", time_words(report))
}

/// From which levels of the octree a picture was drawn.
fn cut_words(cut: &CutLevels) -> String {
    let [fine, second, fourth] = cut.bricks.map(words::count);
    let waiting = match cut.waiting {
        0 => String::new(),
        1 => ". One brick will be finer: it has not come yet".to_owned(),
        many => format!(". {} bricks will be finer: they have not come yet", words::count(many)),
    };
    format!(
        ", by an octree: {fine} bricks are drawn from their samples, {second} from means of 2 × 2 × 2, and {fourth} from \
         means of 4 × 4 × 4{waiting}"
    )
}

fn slabs_words(report: &FrameReport, per_voxel: f64) -> String {
    modes::slabs(per_voxel, report.own_kernels.is_none())
}

/// What the picture took, and of how much where it was fitted to a time: `18 of 20 ms`.
fn time_words(report: &FrameReport) -> String {
    let spent = words::milliseconds(report.frame_ms);
    match report.budget_ms.map(budget_words) {
        Some(budget) => match spent.strip_suffix(" ms") {
            Some(number) if budget.ends_with(" ms") => format!("{number} of {budget}"),
            _ => format!("{spent} of {budget}"),
        },
        None => spent,
    }
}

/// A time that somebody chose: `20 ms`, `5 s`.
fn budget_words(ms: f64) -> String {
    if ms < 1000.0 {
        return format!("{} ms", words::value((ms * 10.0).round() / 10.0));
    }
    format!("{} s", words::value((ms / 100.0).round() / 10.0))
}

/// What a preview was thought to be off by, and was.
fn checked_words(checked: &Checked) -> String {
    let [estimated, measured] =
        [checked.estimated_rmse, checked.measured_rmse].map(|r| words::decibels(psnr_from_rmse(r)));
    format!(
        "The quick picture shown before was estimated at {estimated}; against the full picture it had {measured}"
    )
}

/// What comes after a coarse picture, and how that is known; nothing where it is not.
fn next_words(shown: &Shown) -> Option<String> {
    let next = shown.report.next?;
    let time = soon_words(next.ms);
    Some(match (next.rmse, next.is_full, &shown.measured) {
        (Some(rmse), ..) => format!(
            "Once the view rests, a picture of {} follows in {time}: judged by this one and by what such \
             pictures took before",
            words::about_decibels(psnr_from_rmse(rmse), true)
        ),
        (None, true, Some(measured)) => format!(
            "Once the view rests, the full picture follows in {time}, {}",
            words::about_decibels(measured.point.db, true)
        ),
        (None, true, None) => format!(
            "Once the view rests, the full picture follows in {time}: as long as the last one in this mode"
        ),
        (None, false, _) => {
            format!(
                "Once the view rests, a finer picture follows in {time}; how near is not known yet"
            )
        }
    })
}

/// A time that is only thought, in two digits: `84 ms`, `0.8 s`.
fn soon_words(ms: f64) -> String {
    match ms {
        ms if ms < 100.0 => format!("{:.0} ms", ms.max(1.0)),
        ms if ms < 945.0 => format!("{:.0} ms", (ms / 10.0).round() * 10.0),
        ms => words::roughly(ms),
    }
}

/// How far the picture is from the exact one, and how that is known.
fn error_words(shown: &Shown) -> String {
    let Shown { report, mode, has_splats, measured } = shown;
    if !has_splats && report.level.is_full() {
        return "Nothing of the field is on it: surfaces and points have edges as sharp as the pixels".to_owned();
    }
    if let Some(rmse) = report.estimated_rmse {
        let db = words::about_decibels(psnr_from_rmse(rmse), true);
        return format!(
            "{}, estimated; checked once the full picture is there",
            words::capital(&db)
        );
    }
    let doubled = report.refined.filter(|refined| refined.convergence.last_difference.is_some());
    if !report.level.is_full() && doubled.is_none() {
        return "Not estimated: this picture is on the way to the full one".to_owned();
    }
    let level = level_words(mode, measured.as_ref(), report);
    let Some(doubled) = doubled else { return level };
    let change = doubled.convergence.last_difference.map_or_else(String::new, change_words);
    let slabs = slabs_words(report, doubled.convergence.slabs_per_voxel);
    match doubled.convergence.is_reached() {
        true => format!(
            "With {slabs} instead of half as many the pixel that changed most changed by {change} of full brightness, so it \
             counts as converged: less than half a step of a display (0.2 %). {level}"
        ),
        false => {
            let state = match report.progress < 1.0 {
                true => "Still being refined",
                false => "Not refined any further",
            };
            format!(
                "{state}: with {slabs} instead of half as many some pixel changed by {change} of full brightness. {level}"
            )
        }
    }
}

/// What a finished picture of a mode is worth.
fn level_words(mode: &SplatSettings, measured: Option<&Measured>, report: &FrameReport) -> String {
    let is_measured_here = measured.is_some_and(|measured| measured.is_of_this_view)
        && matches!(report.level, LevelOfDetail::Full { .. });
    if let Some(rmse) = report.remaining_rmse.filter(|_| !is_measured_here) {
        let found = words::capital(&found_words(rmse, report));
        return match mode.visibility {
            _ if report.remaining_within_db > WITHIN_DB => format!(
                "{found}, as is usual for such pictures: memory was too short to draw any of its pixels again"
            ),
            Visibility::Slabs => format!(
                "{found} to the converged picture of this mode: found by drawing some of its pixels with twice and \
                 four times the slabs"
            ),
            _ => format!(
                "{found} to the exact mode's converged picture: found at some of its pixels"
            ),
        };
    }
    if let Some(Measured { point, is_of_this_view }) = measured {
        let numbers = number_words(point);
        if !is_of_this_view {
            let db = words::capital(&words::about_decibels(point.db, false));
            return format!("{db}: measured in another view of this volume ({numbers})");
        }
        let took = words::milliseconds(report.frame_ms);
        return format!(
            "{}, measured against the exact picture of this view ({numbers}). Drawn without \
             a break it takes that long; this one took {took} in short pieces, so that the window never waits",
            words::decibels(point.db)
        );
    }
    match report.remaining_thought {
        Some(Told { rmse, within_db }) => {
            let thought = words::decibels_within(psnr_from_rmse(rmse), within_db);
            format!("{}, as is usual for such pictures. {NOT_CHECKED}", words::capital(&thought))
        }
        None => NOT_CHECKED.to_owned(),
    }
}

/// A greatest difference, 1 being white, rounded up to one digit: `0.08 %`.
fn change_words(difference: f64) -> String {
    if difference <= 0.0 {
        return "0 %".to_owned();
    }
    let percent = 100.0 * difference;
    let digit = 10.0_f64.powf(percent.log10().floor());
    // A little more, so that 0.3 / 0.1 is no more than 3.
    format!("{} %", words::value((percent / digit - 1e-9).ceil() * digit))
}

/// What is left to be done to converge, if anything is.
fn left_words(report: &FrameReport, key: &str) -> Option<String> {
    let left_ms = report.refined.map(|refined| refined.left_ms).filter(|ms| *ms > 0.0)?;
    let time = words::roughly(left_ms);
    Some(if report.progress < 1.0 {
        format!(
            "It is drawn in ever thinner steps along the rays (slabs) until nothing changes any more, for about {time}; any movement \
             stops it"
        )
    } else {
        format!(
            "Ever thinner steps along the rays (slabs) until nothing changes would take about {time}, more than the 3 s that the \
             window allows itself: press {key} to do it for this view"
        )
    })
}

/// What was done for edges within pixels.
fn edges_words(ms: f64) -> String {
    format!(
        "Smooth: each pixel is the mean of {} rays rather than one, which took {} more",
        smooth::RAYS,
        took_words(ms)
    )
}

/// Kernels drawn of active of total, and by what.
fn counts_words(report: &FrameReport) -> String {
    let by = match report.backend {
        Backend::Tiles => "in tiles of the screen",
        _ => "as triangles",
    };
    match report.vector_splats {
        Some(0) => return format!("The vectors alone, {by}, and nothing of the scalar field"),
        Some(splats) => {
            return format!(
                "{} splats, each a vector or the mean of several, {by}; nothing of the scalar field",
                words::count(splats)
            );
        }
        None => {}
    }
    if let Some((kernel, count)) = report.own_kernels {
        let left_out = report.left_out_functions.unwrap_or_default();
        let quick = match report.left_out_of_quick {
            Some((number, rms)) => format!(
                "{} of them (off by {}, rms), or of all",
                words::count(count - number),
                words::value(rms)
            ),
            None => format!("{} samples", words::count(report.kernels_total)),
        };
        let count = words::count(count - left_out.0);
        let what = match kernel {
            Kernel::Cells => "cells, evaluated",
            Kernel::Ellipsoids => "points, each an ellipsoid, evaluated",
            _ => "basis functions, summed up",
        };
        let but = match left_out {
            (0, _) => String::new(),
            (number, rms) => format!(
                " ({} more are left out, which changes the field by {}, rms)",
                words::count(number),
                words::value(rms)
            ),
        };
        return format!(
            "{count} {what} wherever the rays through the pixels ask{but}; quick pictures are of {quick}"
        );
    }
    let total = words::count(report.kernels_total);
    match report.kernels {
        Some(KernelCounts { drawn, active }) => {
            let [drawn, active] = [drawn, active].map(words::count);
            format!(
                "{drawn} splats, {by}. Of {total} voxels {active} have opacity: so many does the full \
                 picture draw"
            )
        }
        None if total == "1" => format!("Its one voxel, {by}"),
        None => format!("Every voxel that has opacity, of {total} in the volume, {by}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::measuring::ChartPoint;
    use crate::task::engine::{Next, Refined};
    use crate::task::still::Convergence;

    const COARSE: LevelOfDetail = LevelOfDetail::Octree { max_error: 0.01 };

    fn shown(level: LevelOfDetail, mode: SplatSettings) -> Shown {
        let backend = Backend::Raster;
        let report = FrameReport {
            kernels: Some(KernelCounts { drawn: 1234, active: 56_789 }),
            progress: if matches!(level, COARSE) { 0.1 } else { 1.0 },
            ..FrameReport::last(level, 16_777_216, backend, 28.4)
        };
        Shown { report, mode, has_splats: true, measured: None }
    }

    fn measured(name: &str, db: f64, settings: SplatSettings) -> Measured {
        let point = ChartPoint {
            name: name.into(),
            ms: 5.0,
            db,
            ci: 0.2,
            settings: Some(settings),
            on_front: true,
            failed: None,
        };
        Measured { point, is_of_this_view: true }
    }

    /// What the line says of a picture at rest.
    fn at_rest(shown: &Shown) -> String {
        glance(Some(shown), &EngineState::Idle, false, None)
    }

    #[test]
    fn smooth_edges_are_told_with_what_they_took() {
        let mut shown = shown(LevelOfDetail::FULL, SplatSettings::EXACT);
        let edges = |shown: &Shown| {
            sentences(shown, "R").into_iter().find(|(what, _)| *what == "Edges").map(|(_, of)| of)
        };
        assert_eq!(edges(&shown), None);
        shown.report.smoothed_ms = Some(412.0);
        let told = edges(&shown).expect("it is told");
        assert!(told.contains("mean of 5 rays") && told.ends_with("0.4 s more"), "{told}");
    }

    #[test]
    fn the_sentences_state_drawn_active_and_total_voxels() {
        let shown = shown(COARSE, SplatSettings::EXACT);
        let words = counts_words(&shown.report).replace('\u{a0}', " ");
        assert!(
            words.starts_with("1 234 splats, as triangles. Of 16 777 216 voxels 56 789 have"),
            "{words}"
        );
        // Of vectors alone no voxel is drawn.
        let alone = FrameReport { vector_splats: Some(1728), kernels: None, ..shown.report };
        let words = counts_words(&alone).replace('\u{a0}', " ");
        assert!(
            words.starts_with("1 728 splats, each a vector") && !words.contains("voxel"),
            "{words}"
        );
    }

    #[test]
    fn every_picture_says_how_far_it_is_from_exact() {
        let coarse = shown(COARSE, SplatSettings::EXACT);
        let report = FrameReport { estimated_rmse: Some(0.0282), ..coarse.report.clone() };
        let estimated = Shown { report, ..coarse };
        assert!(error_words(&estimated).starts_with("About 31 dB, estimated"));
        assert_eq!(at_rest(&estimated), "Drawing · 28 ms · error about 2.8 %");
        let thought = Some(Told { rmse: 0.0282, within_db: 3.0 });
        let report = FrameReport { remaining_thought: thought, ..estimated.report.clone() };
        let on_the_way = Shown { report, ..estimated };
        assert_eq!(
            at_rest(&on_the_way),
            "Drawing · 28 ms · error about 4.0 %",
            "3 more of what is left then"
        );
        let exact = shown(LevelOfDetail::FULL, SplatSettings::EXACT);
        assert!(error_words(&exact).starts_with("Not checked yet"));
        assert_eq!(at_rest(&exact), "Finished · 28 ms · exact mode");
        let classic = shown(LevelOfDetail::FULL, SplatSettings::SHADE_FIRST);
        assert!(error_words(&classic).starts_with("Not checked yet"));
        let with_rmse = |shown: &Shown, rmse| {
            let report = FrameReport { remaining_rmse: Some(rmse), ..shown.report.clone() };
            Shown { report, ..shown.clone() }
        };
        let found = with_rmse(&exact, 0.0024);
        assert_eq!(at_rest(&found), "Finished · 28 ms · error about 0.2 %");
        assert!(error_words(&found).starts_with("52 ± 3 dB to the converged picture of this mode"));
        assert_eq!(at_rest(&with_rmse(&exact, 0.0)), "Finished · 28 ms · no visible error");
        let words = error_words(&with_rmse(&classic, 0.025));
        assert!(words.starts_with("32 ± 3 dB to the exact mode's converged picture"), "{words}");
        assert_eq!(at_rest(&classic), "Finished · 28 ms · approximate mode");
        let found = measured("classic", 31.94, SplatSettings::SHADE_FIRST);
        let here = Shown { measured: Some(found.clone()), ..classic.clone() };
        assert!(error_words(&here).starts_with("31.9 dB, measured against the exact picture"));
        assert!(error_words(&here).contains("that long; this one took 28 ms in short pieces"));
        assert_eq!(at_rest(&here), "Finished · 28 ms · error 2.5 %");
        // By a sweep of this view, which is surer.
        assert_eq!(at_rest(&with_rmse(&here, 0.02)), "Finished · 28 ms · error 2.5 %");
        assert!(error_words(&with_rmse(&here, 0.02)).starts_with("31.9 dB, measured"));
        let found = Measured { is_of_this_view: false, ..found };
        let elsewhere = Shown { measured: Some(found), ..classic };
        assert!(error_words(&elsewhere).starts_with("About 31.9 dB: measured in another view"));
        assert_eq!(at_rest(&elsewhere), "Finished · 28 ms · error about 2.5 %");
        assert_eq!(at_rest(&with_rmse(&elsewhere, 0.02)), "Finished · 28 ms · error about 2.0 %");
        let bodies = Shown { has_splats: false, ..exact };
        assert_eq!(at_rest(&bodies), "Finished · 28 ms");
        assert!(error_words(&bodies).starts_with("Nothing of the field is on it"));
        let about = |shown| sentences(shown, "R").into_iter().map(|(about, _)| about);
        assert!(!about(&bodies).any(|about| about == "Drawn"));
        assert!(about(&elsewhere).any(|about| about == "Drawn"));
        let partial = shown(LevelOfDetail::FullInPart, SplatSettings::EXACT);
        assert!(error_words(&partial).starts_with("Not estimated"));
    }

    #[test]
    fn a_converged_picture_says_what_it_still_changes_and_a_full_one_what_that_would_take() {
        let with = |last_difference: Option<f64>, left_ms, progress| {
            let convergence = Convergence { slabs_per_voxel: 8.0, last_difference };
            let level = last_difference.map(|_| LevelOfDetail::Refined(convergence));
            let mut shown = shown(level.unwrap_or(LevelOfDetail::FULL), SplatSettings::EXACT);
            shown.report.refined = Some(Refined { convergence, left_ms });
            shown.report.progress = progress;
            shown
        };
        let converged = with(Some(0.00079), 0.0, 1.0);
        let words = error_words(&converged);
        assert!(
            words.contains("With 8 slabs a voxel instead of half as many the pixel that changed most changed by 0.08 % of full"),
            "{words}"
        );
        assert!(words.contains("it counts as converged"), "{words}");
        assert_eq!(left_words(&converged.report, "R"), None);
        assert_eq!(at_rest(&converged), "Finished · 28 ms · no visible error");
        let mut found = converged;
        found.report.remaining_rmse = Some(1e-4);
        assert_eq!(at_rest(&found), "Finished · 28 ms · no visible error");
        assert!(error_words(&found).contains("(0.2 %). 80 ± 3 dB to the converged picture"));
        let full = with(None, 12_300.0, 1.0);
        assert!(error_words(&full).starts_with("Not checked yet"));
        let left = left_words(&full.report, "R").unwrap();
        assert!(left.contains("would take about 12 s") && left.contains("press R"), "{left}");
        let on_the_way = with(Some(0.3), 800.0, 0.7);
        let words = error_words(&on_the_way);
        assert!(
            words.contains("changed by 30 % of full brightness") && !words.contains("converged"),
            "{words}"
        );
        assert_eq!(at_rest(&on_the_way), "Refining · 28 ms · exact mode");
        let left = left_words(&on_the_way.report, "R").unwrap();
        assert!(left.contains("about 0.8 s; any movement stops it"), "{left}");
        assert_eq!(change_words(0.0), "0 %");
        assert_eq!(change_words(0.00951), "1 %");
    }

    #[test]
    fn a_coarse_picture_says_what_it_was_given_and_what_comes_next_as_far_as_that_is_known() {
        let coarse = shown(COARSE, SplatSettings::EXACT);
        let with = |frame_ms, budget_ms, next| {
            let report = FrameReport { frame_ms, budget_ms, next, ..coarse.report.clone() };
            Shown { report, ..coarse.clone() }
        };
        let next = |is_full, ms, rmse| Some(Next { is_full, ms, rmse });
        let follows = |shown: &Shown, what: &str| {
            let words = next_words(shown).unwrap();
            assert!(words.contains(what), "{words}");
        };
        let known = with(18.3, Some(20.0), next(false, 84.2, Some(0.0079)));
        assert_eq!(time_words(&known.report), "18 of 20 ms");
        follows(&known, "a picture of about 42 dB follows in 84 ms");
        let long = with(1234.0, Some(5000.0), next(true, 823.0, None));
        assert_eq!(time_words(&long.report), "1.2 s of 5 s");
        follows(&long, "the full picture follows in 820 ms: as long as the last one");
        assert_eq!(time_words(&with(812.0, Some(5000.0), None).report), "812 ms of 5 s");
        assert_eq!(next_words(&with(3.2, Some(1.0), None)), None, "nothing is made up");
        let unknown = with(3.2, Some(7.5), next(false, 5000.0, None));
        assert_eq!(time_words(&unknown.report), "3.2 of 7.5 ms");
        follows(&unknown, "a finer picture follows in 5 s; how near is not known yet");
        let found = Some(measured("exact", 51.94, SplatSettings::EXACT));
        follows(
            &Shown { measured: found, ..long },
            "the full picture follows in 820 ms, about 52 dB",
        );
        assert_eq!(time_words(&shown(LevelOfDetail::FULL, SplatSettings::EXACT).report), "28 ms");
    }

    #[test]
    fn a_coarse_picture_of_a_moving_view_is_not_called_the_last() {
        use EngineState::{Drawing, Failed, Idle, Starting};
        let coarse = shown(COARSE, SplatSettings::EXACT);
        let full = shown(LevelOfDetail::FULL, SplatSettings::EXACT);
        let line = |shown: &Shown, state: &EngineState, is_moving, rate| {
            glance(Some(shown), state, is_moving, rate)
        };
        for state in [Idle, Drawing(0.5)] {
            assert_eq!(line(&coarse, &state, true, Some(29.7)), "Moving · 30/s");
            assert_eq!(line(&coarse, &state, true, Some(4.21)), "Moving · 4.2/s");
            assert_eq!(line(&coarse, &state, true, None), "Moving · 28 ms", "too few to count");
            assert_eq!(line(&coarse, &state, false, Some(30.0)), "Drawing · 28 ms", "at rest");
            assert_eq!(line(&full, &state, false, None), "Finished · 28 ms · exact mode");
        }
        for is_moving in [false, true] {
            assert!(line(&coarse, &Starting, is_moving, None).starts_with("Starting"));
            assert_eq!(line(&coarse, &Failed("lost".into()), is_moving, None), "Cannot draw");
        }
        assert_eq!(glance(None, &Idle, false, None), "Nothing drawn yet");
        assert_eq!([412.0, 12_300.0, 0.2].map(took_words), ["0.4 s", "12 s", "1 ms"]);
    }

    #[test]
    fn cells_that_are_drawn_as_they_are_are_no_voxels() {
        let mut cells = shown(LevelOfDetail::FULL, SplatSettings::CELLS);
        cells.report.own_kernels = Some((Kernel::Cells, 2304));
        assert!(picture_words(&cells.report).starts_with("The full picture: every cell that"));
        let convergence = Convergence { slabs_per_voxel: 2.0, last_difference: Some(0.3) };
        cells.report.level = LevelOfDetail::Refined(convergence);
        assert!(picture_words(&cells.report).contains("refined to 2 slabs a sample"));
    }

    #[test]
    fn functions_that_are_left_out_are_told() {
        let mut few = shown(LevelOfDetail::FULL, SplatSettings::FUNCTIONS);
        few.report.own_kernels = Some((Kernel::Functions, 812));
        assert!(counts_words(&few.report).starts_with("812 basis functions, summed up"));
        few.report.left_out_functions = Some((412, 0.25));
        let told = counts_words(&few.report);
        assert!(told.starts_with("400 basis functions"), "{told}");
        assert!(told.ends_with(" samples"), "{told}");
        few.report.left_out_of_quick = Some((700, 2.0));
        let quick = counts_words(&few.report);
        let end = "quick pictures are of 112 of them (off by 2, rms), or of all";
        assert!(quick.ends_with(end), "{quick}");
        assert!(
            told.contains("(412 more are left out, which changes the field by 0.25, rms)"),
            "{told}"
        );
    }

    #[test]
    fn every_sentence_can_be_read_without_the_line() {
        let mut full = shown(LevelOfDetail::FULL, SplatSettings::EXACT);
        full.report.checked = Some(Checked { estimated_rmse: 0.0282, measured_rmse: 0.0224 });
        let convergence = Convergence { slabs_per_voxel: 1.0, last_difference: None };
        full.report.refined = Some(Refined { convergence, left_ms: 12_300.0 });
        let all = sentences(&full, "R");
        let abouts: Vec<_> = all.iter().map(|(about, _)| *about).collect();
        assert_eq!(abouts, ["Picture", "Accuracy", "Preview", "Refining", "Drawn"]);
        for (_, sentence) in &all {
            assert!(
                sentence.starts_with(|c: char| c.is_uppercase() || c.is_ascii_digit()),
                "{sentence}"
            );
            assert!(!sentence.ends_with('.') && sentence.contains(' '), "{sentence}");
        }
        let preview = "estimated at 31.0 dB; against the full picture it had 33.0 dB";
        assert!(all[2].1.ends_with(preview), "{}", all[2].1);
    }
}

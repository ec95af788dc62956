//! The status line: what is on screen, and how far it is from exact.

use eframe::egui::{Align, FontId, Label, Layout, ProgressBar, RichText, Ui};

use super::chart::number_words;
use crate::accuracy::psnr_from_rmse;
use crate::app::actions::{Action, entry_of};
use crate::app::measuring::Measured;
use crate::app::{modes, theme, words};
use crate::scene::{Classify, Reconstruction, SplatSettings};
use crate::task::engine::{EngineChoice, EngineState, FrameReport, KernelCounts};
use crate::task::estimate::Checked;

/// Size of the line's letters, points.
const SMALL: f32 = 12.0;
/// Width of the progress bar, in wide windows and where less than `NARROW` is left to it and the words.
const BAR: f32 = 90.0;
const NARROW_BAR: f32 = 30.0;
const NARROW: f32 = 420.0;
/// Less room than this is left free, points.
const LEAST_REST: f32 = 30.0;

/// The picture on screen.
#[derive(Debug, Clone)]
pub struct Shown {
    /// What is on it.
    pub report: FrameReport,
    /// The mode it is drawn in.
    pub mode: SplatSettings,
    /// That mode on the chart, if it was measured for this volume.
    pub measured: Option<Measured>,
}

/// What may draw, and what that means, one line.
const ENGINES: [(EngineChoice, &str, &str); 3] = [
    (
        EngineChoice::Auto,
        "Automatic",
        "A graphics processor where there is one, else the native engine",
    ),
    (
        EngineChoice::Native,
        "Native engine",
        "The processor, by its widest instructions and on all its cores; splats as triangles go to a graphics adapter",
    ),
    (
        EngineChoice::Gpu,
        "Graphics adapter",
        "A graphics processor, or a driver that stands in for one",
    ),
];

/// One line along the bottom of the window.
///
/// `is_moving`: whether pictures are asked for as of a moving view; finer ones follow once it rests. The engine that was
/// chosen, if one was.
pub fn status_ui(
    ui: &mut Ui,
    shown: Option<&Shown>,
    state: &EngineState,
    is_moving: bool,
    (adapter, engine): (Option<&str>, EngineChoice),
) -> Option<EngineChoice> {
    let mut chosen = None;
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let adapter = adapter.unwrap_or("no engine yet");
        ui.label(faint(state_words(state, is_moving)));
        ui.separator();
        let menu = ui.menu_button(faint(&short_adapter(adapter)), |ui| {
            for (choice, label, help) in ENGINES {
                let entry = ui.selectable_label(engine == choice, label).on_hover_text(help);
                if entry.clicked() {
                    chosen = Some(choice);
                    ui.close();
                }
            }
        });
        let not_native = shown.and_then(|shown| shown.report.not_native.as_deref());
        let why = not_native.map_or_else(String::new, |reason| {
            format!(": the native engine does not draw {reason}")
        });
        menu.response
            .accessible_name("Engine")
            .on_hover_text(format!("Drawn by {adapter}{why}. Click to choose the engine"));
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| match shown {
            Some(shown) => report_ui(ui, shown),
            None => {
                ui.label(faint("Nothing drawn yet"));
            }
        });
    });
    chosen
}

fn report_ui(ui: &mut Ui, shown: &Shown) {
    let report = &shown.report;
    let progress = report.progress.clamp(0.0, 1.0);
    // A narrow window has room for words alone.
    let width = if ui.available_width() < NARROW { NARROW_BAR } else { BAR };
    let bar = ProgressBar::new(progress).desired_width(width).desired_height(6.0);
    ui.add(bar.fill(theme::ACCENT.gamma_multiply(0.8)))
        .accessible_name("Progress of refinement")
        .on_hover_text("How far the picture is on its way to the last one of this view");
    let (error, why) = error_words(shown);
    let picture = format!("{} · {} · {error}", words::level(&report.level), time_words(report));
    ui.add(Label::new(RichText::new(picture).size(SMALL)).truncate()).on_hover_text(why);
    if let Some(checked) = report.checked {
        let words = fitting(ui, checked_words(&checked));
        let why =
            "What the coarse picture before this one was thought to be off by, and what it was";
        aside_ui(ui, &words, why, true);
    }
    if let Some((next, why)) = next_words(shown) {
        aside_ui(ui, &next, &why, true);
    }
    let key = entry_of(Action::Converge).shortcut;
    let key = key.map_or_else(String::new, |key| ui.ctx().format_shortcut(&key));
    if let Some((left, why)) = left_words(report, &key) {
        aside_ui(ui, &left, &why, true);
    }
    let why = format!(
        "{}, drawn with {}: {}",
        words::level_in_full(&report.level),
        words::backend(report.backend).0.to_lowercase(),
        counts_tooltip(report),
    );
    aside_ui(ui, &counts_words(report), &why, false);
}

/// Words that can be done without, cut where there is no room for all of them, and a line after them
/// where they are not the last. Those that would be cut to nothing would stand on what is at the right.
fn aside_ui(ui: &mut Ui, words: &str, why: &str, ends_in_line: bool) {
    if ui.available_width() < LEAST_REST {
        return;
    }
    ui.add(Label::new(faint(words)).truncate()).on_hover_text(why);
    if ends_in_line {
        ui.separator();
    }
}

/// What a preview was thought to be off by, and was: the longest words first.
fn checked_words(checked: &Checked) -> [String; 3] {
    let [estimated, measured] =
        [checked.estimated_rmse, checked.measured_rmse].map(|r| words::decibels(psnr_from_rmse(r)));
    [
        format!("preview estimated {estimated}, was {measured}"),
        format!("preview was {measured}"),
        format!("was {measured}"),
    ]
}

/// The first of some words, longest first, that the room is wide enough for; else the last.
fn fitting<const N: usize>(ui: &Ui, words: [String; N]) -> String {
    let font = FontId::proportional(SMALL);
    let width = |words: &String| {
        ui.painter().layout_no_wrap(words.clone(), font.clone(), theme::TEXT_FAINT).size().x
    };
    let fits = words.iter().position(|words| width(words) <= ui.available_width());
    words.into_iter().nth(fits.unwrap_or(N.saturating_sub(1))).unwrap_or_default()
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

/// What comes after a coarse picture, and how that is known; nothing where it is not.
fn next_words(shown: &Shown) -> Option<(String, String)> {
    let next = shown.report.next?;
    let time = soon_words(next.ms);
    let what = match (next.rmse, next.is_full, &shown.measured) {
        (Some(rmse), ..) => words::about_decibels(psnr_from_rmse(rmse), true),
        (None, true, Some(measured)) => words::about_decibels(measured.point.db, true),
        (None, true, None) => "full".to_owned(),
        (None, false, _) => "finer".to_owned(),
    };
    let why = match (next.rmse.is_some(), next.is_full) {
        (true, _) => {
            "The next picture of this view once it rests, judged by this one and by what such \
             pictures took before"
        }
        (false, true) => {
            "The next picture of this view once it rests is the full one; its time is that of the last \
             full picture in this mode"
        }
        (false, false) => {
            "The next picture of this view once it rests; what it will be off by is not known yet"
        }
    };
    Some((format!("next {what} in {time}"), why.to_owned()))
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
fn error_words(shown: &Shown) -> (String, String) {
    let Shown { report, mode, measured } = shown;
    if let Some(rmse) = report.estimated_rmse {
        let db = psnr_from_rmse(rmse);
        let why = "Estimated from the picture's size and detail or the octree's own error, and checked once the \
             full picture is there";
        return (words::about_decibels(db, true), why.to_owned());
    }
    let doubled = report.refined.filter(|refined| refined.convergence.last_difference.is_some());
    if !report.level.is_full() && doubled.is_none() {
        return ("not estimated".to_owned(), "On the way to the full picture".to_owned());
    }
    let (level, why) = level_words(mode, measured.as_ref(), report);
    let Some(refined) = doubled else { return (level, why) };
    let change = refined.convergence.last_difference.map_or_else(String::new, change_words);
    let slabs = words::value(refined.convergence.slabs_per_voxel);
    let mode = if measured.is_some() {
        format!("{level}, ")
    } else if modes::is_exact(mode) {
        "exact mode, ".to_owned()
    } else {
        String::new()
    };
    let why = format!(
        "No pixel differs by more from the picture with half as many slabs; what their width still \
         costs is less than that. Below 1/512, half a step of a display, the picture counts as \
         converged. {why}"
    );
    (format!("{mode}{slabs} slabs a voxel, {change}"), why)
}

/// What a finished picture of a mode is worth.
fn level_words(
    mode: &SplatSettings,
    measured: Option<&Measured>,
    report: &FrameReport,
) -> (String, String) {
    if let Some(Measured { point, is_of_this_view }) = measured {
        let numbers = number_words(point);
        if !is_of_this_view {
            let why = format!(
                "Measured against the exact picture in another view of this volume: {numbers}"
            );
            return (format!("{} in another view", words::about_decibels(point.db, false)), why);
        }
        let took = words::milliseconds(report.frame_ms);
        let why = format!(
            "Measured against the exact picture: {numbers}. That time is of a picture drawn in one \
             go; this one took {took} in short pieces, so that the hand never waits"
        );
        return (words::decibels(point.db), why);
    }
    if let Some(effect) = report.effects.first().map(|effect| effect.name()) {
        let why = format!(
            "What this mode is usually off by is known of plain pictures: with {effect} it was not \
             measured"
        );
        return (format!("not measured with {effect}"), why);
    }
    if modes::is_exact(mode) {
        let why = "What this mode has on most volumes, not measured for this one: fine detail may \
                   have less, smooth matter far more. The accuracy panel (key A) measures it";
        // Measured at one slab a voxel on aneurism (42 at 3000 pixels), bonsai (66), LIDC2, a made
        // head and Marschner-Lobb 64³; two slabs of aneurism have 61, four 83.
        return ("exact mode, usually 40 to 66 dB".to_owned(), why.to_owned());
    }
    let (low, high) = typical_db(mode);
    let why = "Typical of this mode; measured for this view in the accuracy panel (key A)";
    (format!("usually {low} to {high} dB"), why.to_owned())
}

/// A greatest difference, rounded up to one digit: `change below 0.0008`.
fn change_words(difference: f64) -> String {
    if difference <= 0.0 {
        return "no change".to_owned();
    }
    let digit = 10.0_f64.powf(difference.log10().floor());
    // A little more, so that 0.3 / 0.1 is no more than 3.
    let above = (difference / digit - 1e-9).ceil() * digit;
    format!("change below {}", words::value(above))
}

/// What is left to be done to converge, if anything is: the words and what they mean.
fn left_words(report: &FrameReport, key: &str) -> Option<(String, String)> {
    let left_ms = report.refined.map(|refined| refined.left_ms).filter(|ms| *ms > 0.0)?;
    let time = words::roughly(left_ms);
    if report.progress < 1.0 {
        let why = "Slabs are doubled until nothing changes any more; any movement stops it";
        return Some((format!("converging, about {time} left"), why.to_owned()));
    }
    let why = format!(
        "Doubling the slabs until nothing changes would take longer than the 3 s that the window \
         allows itself; press {key} to do it for this view"
    );
    Some((format!("converged would take about {time}: press {key}"), why))
}

/// How far full pictures of a mode are from the exact one, dB: the least and the greatest over two
/// analytic fields at one and two planes a voxel (docs/reproductions.md), three scans, a made head and
/// Marschner-Lobb 64³ at one.
fn typical_db(mode: &SplatSettings) -> (u32, u32) {
    match (mode.classify, mode.reconstruction) {
        (Classify::Before, _) => (26, 44),
        (Classify::After, Reconstruction::Smooth) => (25, 71),
        (Classify::After, Reconstruction::Interpolating) => (29, 71),
        (Classify::PreIntegrated, Reconstruction::Smooth) => (25, 71),
        (Classify::PreIntegrated, Reconstruction::Interpolating) => (29, 80),
    }
}

/// Kernels drawn of active of total.
fn counts_words(report: &FrameReport) -> String {
    match report.vector_splats {
        Some(0) => return "vectors alone".to_owned(),
        Some(splats) => return format!("{} splats of vectors", words::count(splats)),
        None => {}
    }
    let total = words::count(report.kernels_total);
    match report.kernels {
        Some(KernelCounts { drawn, active }) => {
            let [drawn, active] = [drawn, active].map(words::count);
            format!("{drawn} of {active} kernels drawn, {total} voxels")
        }
        None if total == "1" => "its one voxel".to_owned(),
        None => format!("all of {total} voxels"),
    }
}

fn counts_tooltip(report: &FrameReport) -> String {
    if report.vector_splats.is_some() {
        return "Each is a vector, or the mean of several, in or beside the picture; nothing is drawn of the \
                scalar field"
            .to_owned();
    }
    let total = words::count(report.kernels_total);
    match report.kernels {
        Some(KernelCounts { drawn, active }) => {
            let [drawn, active] = [drawn, active].map(words::count);
            format!(
                "{drawn} kernels drawn; the full picture draws the {active} voxels that have \
                 opacity, of {total} in the volume"
            )
        }
        None => format!("all that has opacity of the {total} voxels, in fewer pixels"),
    }
}

fn state_words(state: &EngineState, is_moving: bool) -> &'static str {
    match state {
        EngineState::Starting => "Starting",
        EngineState::Idle | EngineState::Drawing(_) if is_moving => "Moving",
        EngineState::Idle => "Idle",
        EngineState::Drawing(_) => "Drawing",
        EngineState::Failed(_) => "Cannot draw",
    }
}

/// An adapter's name without its driver's version in brackets.
fn short_adapter(name: &str) -> String {
    name.split(['(', ',']).next().unwrap_or(name).trim().to_owned()
}

fn faint(text: &str) -> RichText {
    RichText::new(text).color(theme::TEXT_FAINT).size(SMALL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::measuring::ChartPoint;
    use crate::task::engine::{Next, Refined};
    use crate::task::level::LevelOfDetail;
    use crate::task::still::Convergence;

    const COARSE: LevelOfDetail = LevelOfDetail::Octree { max_error: 0.01 };

    fn shown(level: LevelOfDetail, mode: SplatSettings) -> Shown {
        let backend = crate::scene::Backend::Raster;
        let report = FrameReport {
            kernels: Some(KernelCounts { drawn: 1234, active: 56_789 }),
            progress: 0.1,
            ..FrameReport::last(level, 16_777_216, backend, 28.4)
        };
        Shown { report, mode, measured: None }
    }

    #[test]
    fn the_line_states_drawn_active_and_total_kernels() {
        let shown = shown(COARSE, SplatSettings::EXACT);
        let words = counts_words(&shown.report).replace('\u{a0}', " ");
        assert_eq!(words, "1 234 of 56 789 kernels drawn, 16 777 216 voxels");
        // Of vectors alone no voxel is drawn.
        let alone = FrameReport { vector_splats: Some(1728), kernels: None, ..shown.report };
        assert_eq!(counts_words(&alone).replace('\u{a0}', " "), "1 728 splats of vectors");
        assert!(!counts_tooltip(&alone).contains("voxel"));
    }

    #[test]
    fn every_picture_says_how_far_it_is_from_exact() {
        let coarse = shown(COARSE, SplatSettings::EXACT);
        let report = FrameReport { estimated_rmse: Some(0.0282), ..coarse.report.clone() };
        assert_eq!(error_words(&Shown { report, ..coarse }).0, "about 31 dB");
        let exact = shown(LevelOfDetail::FULL, SplatSettings::EXACT);
        assert_eq!(error_words(&exact).0, "exact mode, usually 40 to 66 dB");
        let classic = shown(LevelOfDetail::FULL, SplatSettings::SHADE_FIRST);
        assert_eq!(error_words(&classic).0, "usually 26 to 44 dB");
        let point = ChartPoint {
            name: "classic".into(),
            ms: 5.0,
            db: 31.94,
            ci: 0.2,
            settings: Some(SplatSettings::SHADE_FIRST),
            on_front: true,
            failed: None,
        };
        let measured = Measured { point, is_of_this_view: true };
        let here = Shown { measured: Some(measured.clone()), ..classic.clone() };
        assert_eq!(error_words(&here).0, "31.9 dB");
        assert!(error_words(&here).1.contains("one go; this one took 28 ms in short pieces"));
        let measured = Measured { is_of_this_view: false, ..measured };
        let elsewhere = Shown { measured: Some(measured), ..classic };
        assert_eq!(error_words(&elsewhere).0, "about 31.9 dB in another view");
        let partial = shown(LevelOfDetail::FullInPart, SplatSettings::EXACT);
        assert_eq!(error_words(&partial).0, "not estimated");
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
        let words = error_words(&converged).0;
        assert_eq!(words, "exact mode, 8 slabs a voxel, change below 0.0008");
        assert_eq!(left_words(&converged.report, "R"), None);
        let full = with(None, 12_300.0, 1.0);
        assert_eq!(error_words(&full).0, "exact mode, usually 40 to 66 dB");
        let left = left_words(&full.report, "R").map(|(words, _)| words);
        assert_eq!(left.as_deref(), Some("converged would take about 12 s: press R"));
        let on_the_way = with(Some(0.3), 800.0, 0.7);
        let words = error_words(&on_the_way).0;
        assert_eq!(words, "exact mode, 8 slabs a voxel, change below 0.3");
        let left = left_words(&on_the_way.report, "R").map(|(words, _)| words);
        assert_eq!(left.as_deref(), Some("converging, about 0.8 s left"));
        assert_eq!(change_words(0.0), "no change");
        assert_eq!(change_words(0.00951), "change below 0.01");
    }

    #[test]
    fn a_coarse_picture_says_what_it_was_given_and_what_comes_next_as_far_as_that_is_known() {
        let coarse = shown(COARSE, SplatSettings::EXACT);
        let with = |frame_ms, budget_ms, next| {
            let report = FrameReport { frame_ms, budget_ms, next, ..coarse.report.clone() };
            Shown { report, ..coarse.clone() }
        };
        let next = |is_full, ms, rmse| Some(Next { is_full, ms, rmse });
        let words = |shown: &Shown| next_words(shown).map(|(words, _)| words);
        let known = with(18.3, Some(20.0), next(false, 84.2, Some(0.0079)));
        assert_eq!(time_words(&known.report), "18 of 20 ms");
        assert_eq!(words(&known).as_deref(), Some("next about 42 dB in 84 ms"));
        let long = with(1234.0, Some(5000.0), next(true, 823.0, None));
        assert_eq!(time_words(&long.report), "1.2 s of 5 s");
        assert_eq!(words(&long).as_deref(), Some("next full in 820 ms"));
        assert_eq!(time_words(&with(812.0, Some(5000.0), None).report), "812 ms of 5 s");
        assert_eq!(words(&with(3.2, Some(1.0), None)), None, "nothing is made up");
        let unknown = with(3.2, Some(7.5), next(false, 5000.0, None));
        assert_eq!(time_words(&unknown.report), "3.2 of 7.5 ms");
        assert_eq!(words(&unknown).as_deref(), Some("next finer in 5 s"));
        let point = ChartPoint {
            name: "exact".into(),
            ms: 5.0,
            db: 51.94,
            ci: 0.2,
            settings: Some(SplatSettings::EXACT),
            on_front: true,
            failed: None,
        };
        let measured = Some(Measured { point, is_of_this_view: true });
        assert_eq!(
            words(&Shown { measured, ..long }).as_deref(),
            Some("next about 52 dB in 820 ms")
        );
        assert_eq!(time_words(&shown(LevelOfDetail::FULL, SplatSettings::EXACT).report), "28 ms");
    }

    #[test]
    fn a_coarse_picture_of_a_moving_view_is_not_called_the_last() {
        use EngineState::{Drawing, Failed, Idle, Starting};
        assert_eq!([Idle, Drawing(0.5)].map(|state| state_words(&state, true)), ["Moving"; 2]);
        assert_eq!(
            [Idle, Drawing(0.5)].map(|state| state_words(&state, false)),
            ["Idle", "Drawing"]
        );
        for is_moving in [false, true] {
            assert_eq!(state_words(&Starting, is_moving), "Starting");
            assert_eq!(state_words(&Failed("lost".into()), is_moving), "Cannot draw");
        }
    }

    #[test]
    fn what_a_preview_was_is_said_whole_in_narrow_windows_too() {
        use eframe::egui::{Context, Pos2, RawInput, Rect, Shape, vec2};
        let mut full = shown(LevelOfDetail::FULL, SplatSettings::EXACT);
        full.report.checked = Some(Checked { estimated_rmse: 0.0282, measured_rmse: 0.0224 });
        let convergence = Convergence { slabs_per_voxel: 1.0, last_difference: None };
        full.report.refined = Some(Refined { convergence, left_ms: 12_300.0 });
        full.report.progress = 1.0;
        let mut wordings = Vec::new();
        for width in [1280.0, 700.0, 640.0, 600.0, 560.0] {
            let ctx = Context::default();
            let input = RawInput {
                screen_rect: Some(Rect::from_min_size(Pos2::ZERO, vec2(width - 24.0, 28.0))),
                ..RawInput::default()
            };
            let pass = || {
                let mut output = ctx.run_ui(input.clone(), |ui| {
                    let drawn_by = (Some("llvmpipe (x)"), EngineChoice::Auto);
                    status_ui(ui, Some(&full), &EngineState::Idle, false, drawn_by);
                });
                // Nobody paints them.
                output.textures_delta.clear();
                output.shapes
            };
            drop(pass());
            let texts: Vec<String> = pass()
                .iter()
                .filter_map(|shape| match &shape.shape {
                    // Words that are cut short are in the galley, but not among its glyphs.
                    Shape::Text(text) if !text.galley.elided => Some(text.galley.text().to_owned()),
                    _ => None,
                })
                .collect();
            let was = texts.into_iter().find(|text| text.ends_with("was 33.0 dB"));
            wordings.push(was.unwrap_or_else(|| panic!("nothing of it at {width}")));
        }
        assert_eq!(wordings[..2], ["preview estimated 31.0 dB, was 33.0 dB"; 2]);
        assert_ne!(wordings[4], wordings[0]);
    }

    #[test]
    fn words_never_stand_on_one_another_however_narrow_the_window() {
        use eframe::egui::{Context, Pos2, RawInput, Rect, Shape, vec2};
        let mut full = shown(LevelOfDetail::FULL, SplatSettings::EXACT);
        full.report.checked = Some(Checked { estimated_rmse: 0.0282, measured_rmse: 0.0224 });
        let convergence = Convergence { slabs_per_voxel: 4.0, last_difference: Some(0.01) };
        full.report.refined = Some(Refined { convergence, left_ms: 12_300.0 });
        full.report.progress = 1.0;
        for width in [1280.0, 640.0, 520.0, 480.0, 440.0, 400.0, 360.0] {
            let ctx = Context::default();
            let room = Rect::from_min_size(Pos2::ZERO, vec2(width - 24.0, 28.0));
            let input = RawInput { screen_rect: Some(room), ..RawInput::default() };
            let pass = || {
                let mut output = ctx.run_ui(input.clone(), |ui| {
                    let drawn_by = (Some("llvmpipe (x)"), EngineChoice::Auto);
                    status_ui(ui, Some(&full), &EngineState::Idle, false, drawn_by);
                });
                // Nobody paints them.
                output.textures_delta.clear();
                output.shapes
            };
            drop(pass());
            let words: Vec<(String, Rect)> = pass()
                .iter()
                .filter_map(|shape| match &shape.shape {
                    Shape::Text(text) => {
                        let place = text.galley.rect.translate(text.pos.to_vec2());
                        Some((text.galley.text().to_owned(), place))
                    }
                    _ => None,
                })
                .collect();
            assert!(words.iter().any(|(text, _)| text.starts_with("Full")), "{width}: {words:?}");
            for (i, (text, place)) in words.iter().enumerate() {
                for (other, its) in &words[i + 1..] {
                    let over = place.intersect(*its);
                    let apart = over.width() <= 0.5 || over.height() <= 0.5;
                    assert!(apart, "{width}: {text} {place} and {other} {its}");
                }
            }
        }
    }

    #[test]
    fn adapters_are_named_without_their_versions() {
        assert_eq!(short_adapter("llvmpipe (LLVM 15.0.6, 256 bits)"), "llvmpipe");
        assert_eq!(short_adapter("NVIDIA H200"), "NVIDIA H200");
    }
}

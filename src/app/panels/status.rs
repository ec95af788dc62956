//! The status line: what is on screen, and how far it is from exact.

use eframe::egui::{Align, Label, Layout, ProgressBar, RichText, Ui};

use super::chart::number_words;
use crate::accuracy::psnr_from_rmse;
use crate::app::measuring::ChartPoint;
use crate::app::{modes, theme, words};
use crate::scene::{Classify, Reconstruction, SplatSettings};
use crate::task::engine::{EngineState, FrameReport};

/// The picture on screen.
#[derive(Debug, Clone)]
pub struct Shown {
    /// What is on it.
    pub report: FrameReport,
    /// The scene's mode.
    pub mode: SplatSettings,
    /// That mode on the chart, if it was measured for this view.
    pub measured: Option<ChartPoint>,
}

/// One line along the bottom of the window.
pub fn status_ui(ui: &mut Ui, shown: Option<&Shown>, state: &EngineState, adapter: Option<&str>) {
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let adapter = adapter.unwrap_or("no adapter yet");
        ui.label(faint(state_words(state)));
        ui.separator();
        ui.add(Label::new(faint(&short_adapter(adapter))).truncate())
            .on_hover_text(format!("Drawn by {adapter}"));
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| match shown {
            Some(shown) => report_ui(ui, shown),
            None => {
                ui.label(faint("Nothing drawn yet"));
            }
        });
    });
}

fn report_ui(ui: &mut Ui, shown: &Shown) {
    let report = &shown.report;
    let progress = report.progress.clamp(0.0, 1.0);
    let bar = ProgressBar::new(progress).desired_width(90.0).desired_height(6.0);
    ui.add(bar.fill(theme::ACCENT.gamma_multiply(0.8)))
        .accessible_name("Progress to full")
        .on_hover_text("How far the picture is from one of every voxel");
    let (error, why) = error_words(shown);
    let picture =
        format!("{} · {} · {error}", rung_words(report), words::milliseconds(report.frame_ms));
    ui.label(RichText::new(picture).size(12.0)).on_hover_text(why);
    if let Some(checked) = report.checked {
        let [estimated, measured] = [checked.estimated_rmse, checked.measured_rmse]
            .map(|r| words::decibels(psnr_from_rmse(r)));
        ui.add(
            Label::new(faint(&format!("preview estimated {estimated}, was {measured}"))).truncate(),
        )
        .on_hover_text(
            "What the coarse picture before this one was thought to be off by, and what it was",
        );
        ui.separator();
    }
    let counts = ui.add(Label::new(faint(&counts_words(report))).truncate());
    counts.on_hover_text(format!(
        "{}, drawn with {}: {} kernels drawn; the full picture draws the {} voxels that have \
         opacity, of {} in the volume",
        report.rung,
        words::backend(report.backend).0.to_lowercase(),
        words::count(report.kernels_drawn),
        words::count(report.kernels_active),
        words::count(report.kernels_total),
    ));
}

/// The rung in sentence case, without its details.
fn rung_words(report: &FrameReport) -> String {
    let rung = match report.rung.split_once(',') {
        Some((rung, _)) if !report.rung.ends_with("in part") => rung,
        _ => &report.rung,
    };
    let mut letters = rung.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// How far the picture is from the exact one, and how that is known.
fn error_words(shown: &Shown) -> (String, String) {
    let Shown { report, mode, measured } = shown;
    if let Some(rmse) = report.estimated_rmse {
        let db = psnr_from_rmse(rmse);
        let why =
            "Estimated from the octree's own error, and checked once the full picture is there";
        return (format!("about {db:.0} dB"), why.to_owned());
    }
    if report.rung != "full" {
        return ("not estimated".to_owned(), "On the way to the full picture".to_owned());
    }
    if let Some(point) = measured {
        let why = format!("Measured against the exact picture: {}", number_words(point));
        return (words::decibels(point.db), why);
    }
    if modes::is_exact(mode) {
        let why = "Interpolated, pre-integrated, in slabs: what a finer cut would still change is \
                   measured in the accuracy panel (key A)";
        // Measured on four scenes at one slab a voxel; more slabs come nearer.
        return ("exact mode, 33 to 60 dB".to_owned(), why.to_owned());
    }
    let (low, high) = typical_db(mode);
    let why = "Typical of this mode; measured for this view in the accuracy panel (key A)";
    (format!("about {low} to {high} dB"), why.to_owned())
}

/// How far full pictures of a mode are from the exact one, dB: the least and the greatest over two
/// analytic fields at one and two planes a voxel; for shade first, over four scans, too.
fn typical_db(mode: &SplatSettings) -> (u32, u32) {
    match (mode.classify, mode.reconstruction) {
        (Classify::Before, _) => (26, 40),
        (Classify::After, Reconstruction::Smooth) => (28, 40),
        (Classify::After, Reconstruction::Interpolating) => (28, 62),
        (Classify::PreIntegrated, Reconstruction::Smooth) => (31, 48),
        (Classify::PreIntegrated, Reconstruction::Interpolating) => (31, 52),
    }
}

/// Kernels drawn of active of total.
fn counts_words(report: &FrameReport) -> String {
    format!(
        "{} of {} kernels drawn, {} voxels",
        words::count(report.kernels_drawn),
        words::count(report.kernels_active),
        words::count(report.kernels_total),
    )
}

fn state_words(state: &EngineState) -> &str {
    match state {
        EngineState::Starting => "Starting",
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
    RichText::new(text).color(theme::TEXT_FAINT).size(12.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(rung: &str, mode: SplatSettings) -> Shown {
        let report = FrameReport {
            rung: rung.into(),
            kernels_drawn: 1234,
            kernels_active: 56_789,
            kernels_total: 16_777_216,
            backend: crate::scene::Backend::Raster,
            frame_ms: 28.4,
            progress: 0.1,
            estimated_rmse: None,
            checked: None,
            refined: None,
        };
        Shown { report, mode, measured: None }
    }

    #[test]
    fn the_line_states_drawn_active_and_total_kernels() {
        let shown = shown("octree error 0.010", SplatSettings::EXACT);
        let words = counts_words(&shown.report).replace('\u{a0}', " ");
        assert_eq!(words, "1 234 of 56 789 kernels drawn, 16 777 216 voxels");
        assert_eq!(rung_words(&shown.report), "Octree error 0.010");
    }

    #[test]
    fn every_picture_says_how_far_it_is_from_exact() {
        let coarse = shown("coarse, octree error 0.010", SplatSettings::EXACT);
        assert_eq!(rung_words(&coarse.report), "Coarse");
        let report = FrameReport { estimated_rmse: Some(0.0282), ..coarse.report.clone() };
        assert_eq!(error_words(&Shown { report, ..coarse }).0, "about 31 dB");
        let exact = shown("full", SplatSettings::EXACT);
        assert_eq!(error_words(&exact).0, "exact mode, 33 to 60 dB");
        let classic = shown("full", SplatSettings::SHADE_FIRST);
        assert_eq!(error_words(&classic).0, "about 26 to 40 dB");
        let point = ChartPoint {
            name: "classic".into(),
            ms: 5.0,
            db: 31.94,
            ci: 0.2,
            settings: Some(SplatSettings::SHADE_FIRST),
            on_front: true,
            failed: None,
        };
        assert_eq!(error_words(&Shown { measured: Some(point), ..classic }).0, "31.9 dB");
        let partial = shown("full, in part", SplatSettings::EXACT);
        assert_eq!(rung_words(&partial.report), "Full, in part");
        assert_eq!(error_words(&partial).0, "not estimated");
    }

    #[test]
    fn adapters_are_named_without_their_versions() {
        assert_eq!(short_adapter("llvmpipe (LLVM 15.0.6, 256 bits)"), "llvmpipe");
        assert_eq!(short_adapter("NVIDIA H200"), "NVIDIA H200");
    }
}

//! The status line: what is on screen, and how far it is from exact.

use eframe::egui::{Align, Label, Layout, ProgressBar, RichText, Ui};

use crate::app::{theme, words};
use crate::task::engine::{EngineState, FrameReport};

/// One line along the bottom of the window.
pub fn status_ui(
    ui: &mut Ui,
    report: Option<&FrameReport>,
    state: &EngineState,
    adapter: Option<&str>,
) {
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let adapter = adapter.unwrap_or("no adapter yet");
        ui.label(faint(state_words(state)));
        ui.separator();
        ui.add(Label::new(faint(&short_adapter(adapter))).truncate())
            .on_hover_text(format!("Drawn by {adapter}"));
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| match report {
            Some(report) => report_ui(ui, report),
            None => {
                ui.label(faint("Nothing drawn yet"));
            }
        });
    });
}

fn report_ui(ui: &mut Ui, report: &FrameReport) {
    let progress = report.progress.clamp(0.0, 1.0);
    let bar = ProgressBar::new(progress).desired_width(90.0).desired_height(6.0);
    ui.add(bar.fill(theme::ACCENT.gamma_multiply(0.8)))
        .accessible_name("Progress to exact")
        .on_hover_text("How far the picture is from the exact one");
    ui.label(RichText::new(rung_words(report)).size(12.0));
    let counts = ui.add(Label::new(faint(&counts_words(report))).truncate());
    counts.on_hover_text(format!(
        "{} kernels drawn; the exact picture draws the {} voxels that have opacity, of {} in the \
         volume",
        words::count(report.kernels_drawn),
        words::count(report.kernels_active),
        words::count(report.kernels_total),
    ));
}

/// The rung in sentence case.
fn rung_words(report: &FrameReport) -> String {
    let mut letters = report.rung.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Kernels drawn of active of total, and the time.
fn counts_words(report: &FrameReport) -> String {
    format!(
        "{} of {} kernels drawn, {} voxels, {}",
        words::count(report.kernels_drawn),
        words::count(report.kernels_active),
        words::count(report.kernels_total),
        words::milliseconds(report.frame_ms),
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

    #[test]
    fn the_line_states_drawn_active_and_total_kernels_and_the_time() {
        let report = FrameReport {
            rung: "octree".into(),
            kernels_drawn: 1234,
            kernels_active: 56_789,
            kernels_total: 16_777_216,
            frame_ms: 28.4,
            progress: 0.1,
        };
        let words = counts_words(&report).replace('\u{a0}', " ");
        assert_eq!(words, "1 234 of 56 789 kernels drawn, 16 777 216 voxels, 28 ms");
        assert_eq!(rung_words(&report), "Octree");
    }

    #[test]
    fn adapters_are_named_without_their_versions() {
        assert_eq!(short_adapter("llvmpipe (LLVM 15.0.6, 256 bits)"), "llvmpipe");
        assert_eq!(short_adapter("NVIDIA H200"), "NVIDIA H200");
    }
}

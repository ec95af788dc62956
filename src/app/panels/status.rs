//! The status line: what is on screen, and how near it is to the exact picture; the rest at a click.

use eframe::egui::{
    Align, Atom, Button, IdSalt, Label, Layout, Painter, Popup, PopupCloseBehavior, ProgressBar,
    Rect, RectAlign, RichText, Shape, Stroke, Ui, Vec2,
};

use super::told::{DECIBELS, glance, sentences};
use crate::app::actions::{Action, entry_of};
use crate::app::measuring::Measured;
use crate::app::theme;
use crate::scene::SplatSettings;
use crate::task::engine::{EngineChoice, EngineState, FrameReport};

/// Size of the line's letters, points.
const SMALL: f32 = 12.0;
/// Width of the progress bar, in wide windows and where less than `NARROW` is left to it and the words.
const BAR: f32 = 90.0;
const NARROW_BAR: f32 = 30.0;
const NARROW: f32 = 420.0;
/// Width of the sentences, and of what they are about, points.
const DETAILS: f32 = 430.0;
const ABOUT: f32 = 66.0;
/// Side of the square with the triangle at the line's end, points.
const OPENER: f32 = 6.0;
/// What of a narrow window is left beside the sentences, points.
const BESIDE: f32 = 40.0;

/// The picture on screen.
#[derive(Debug, Clone)]
pub struct Shown {
    /// What is on it.
    pub report: FrameReport,
    /// The mode it is drawn in.
    pub mode: SplatSettings,
    /// Whether the field or vectors are on it, rather than surfaces and bodies alone, which have no error.
    pub has_splats: bool,
    /// That mode on the chart, if it was measured for this volume.
    pub measured: Option<Measured>,
}

/// What the line is about.
#[derive(Debug, Clone, Copy)]
pub struct Now<'a> {
    /// The picture on screen.
    pub shown: Option<&'a Shown>,
    /// How the engine stands.
    pub state: &'a EngineState,
    /// Whether pictures are asked for as of a moving view; finer ones follow once it rests.
    pub is_moving: bool,
    /// Pictures a second of a moving view, where that is known.
    pub rate: Option<f64>,
    /// What draws, once something does.
    pub adapter: Option<&'a str>,
    /// The engine that was chosen.
    pub engine: EngineChoice,
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

/// One line along the bottom of the window. The engine that was chosen, if one was.
pub fn status_ui(ui: &mut Ui, now: &Now<'_>) -> Option<EngineChoice> {
    let mut chosen = None;
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        // A scope with a bar or without, so that the line stays the same widget and what it has opened stays open.
        ui.scope(|ui| progress_ui(ui, now));
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            let words = glance(now.shown, now.state, now.is_moving, now.rate);
            let words = RichText::new(words).size(SMALL).color(theme::TEXT);
            let opener = IdSalt::new("opener");
            let button = Button::new((words, Atom::custom(opener, Vec2::splat(OPENER))))
                .frame_when_inactive(false)
                .truncate();
            let help = match now.is_moving {
                true => {
                    "The view moves: pictures a second, and their error: the difference from the exact picture, in percent of the brightest light. Click for more"
                }
                false => "The time of this picture, and its error: the difference from the exact one, in percent of the brightest light. Click for more",
            };
            let shown = button.atom_ui(ui);
            if let Some(square) = shown.rect(opener) {
                paint_opener(ui.painter(), square);
            }
            let line = shown.response.on_hover_text(help);
            let room = ui.ctx().content_rect().width() - BESIDE;
            Popup::menu(&line)
                .align(RectAlign::TOP_START)
                .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
                .width(DETAILS.min(room))
                .show(|ui| chosen = details_ui(ui, now));
        });
    });
    chosen
}

/// A triangle that points to where the rest will be: up.
fn paint_opener(painter: &Painter, square: Rect) {
    let corners = [square.left_bottom(), square.center_top(), square.right_bottom()];
    painter.add(Shape::convex_polygon(corners.to_vec(), theme::TEXT_FAINT, Stroke::NONE));
}

/// How far the picture is on its way, while it is; at the right, where it moves no words.
fn progress_ui(ui: &mut Ui, now: &Now<'_>) {
    let progress = now.shown.map_or(1.0, |shown| shown.report.progress.clamp(0.0, 1.0));
    if progress >= 1.0 {
        return;
    }
    // A narrow window has room for words alone.
    let width = if ui.available_width() < NARROW { NARROW_BAR } else { BAR };
    let bar = ProgressBar::new(progress).desired_width(width).desired_height(6.0);
    ui.add(bar.fill(theme::ACCENT.gamma_multiply(0.8)))
        .accessible_name("Progress of refinement")
        .on_hover_text("How far the picture is on its way to the last one of this view");
}

/// All that is known of the picture, in sentences, and the choice of engine.
fn details_ui(ui: &mut Ui, now: &Now<'_>) -> Option<EngineChoice> {
    ui.set_max_width(ui.available_width());
    ui.spacing_mut().item_spacing.y = theme::ROW_SPACING;
    if let EngineState::Failed(reason) = now.state {
        told_ui(ui, "Trouble", reason);
    }
    if let Some(shown) = now.shown {
        let key = entry_of(Action::Converge).shortcut;
        let key = key.map_or_else(String::new, |key| ui.ctx().format_shortcut(&key));
        for (about, sentence) in sentences(shown, &key) {
            told_ui(ui, about, &sentence);
        }
        told_ui(ui, "dB", DECIBELS);
        ui.separator();
    }
    let not_native = now.shown.and_then(|shown| shown.report.not_native.as_deref());
    let why = not_native
        .map_or_else(String::new, |reason| format!(": the native engine does not draw {reason}"));
    let adapter = now.adapter.unwrap_or("no engine yet");
    let own = now.shown.and_then(|shown| shown.report.native_loop);
    let own = own.map_or_else(String::new, |name| format!(", with code made for {name}"));
    told_ui(ui, "Engine", &format!("Drawn by {adapter}{own}{why}"));
    let mut chosen = None;
    ui.horizontal_wrapped(|ui| {
        ui.add_space(ABOUT);
        for (choice, label, help) in ENGINES {
            let entry = ui.selectable_label(now.engine == choice, label).on_hover_text(help);
            if entry.clicked() {
                chosen = Some(choice);
            }
        }
    });
    chosen
}

fn told_ui(ui: &mut Ui, about: &str, sentence: &str) {
    about_ui(ui, about, |ui| {
        ui.add(Label::new(RichText::new(sentence).size(SMALL + 0.5)).wrap());
    });
}

/// A faint word in a column of its own, and what belongs to it at its right.
fn about_ui(ui: &mut Ui, about: &str, add: impl FnOnce(&mut Ui)) {
    ui.horizontal_top(|ui| {
        let before = ui.cursor().left();
        ui.label(RichText::new(about).size(SMALL + 0.5).color(theme::TEXT_FAINT));
        ui.add_space((before + ABOUT - ui.cursor().left()).max(0.0));
        ui.vertical(add);
    });
}

#[cfg(test)]
mod tests {
    use eframe::egui::{Context, Pos2, RawInput, vec2};

    use super::*;
    use crate::scene::Backend;
    use crate::task::engine::Refined;
    use crate::task::level::LevelOfDetail;
    use crate::task::still::Convergence;

    /// A picture that is being refined, with as much to say as there is.
    fn shown() -> Shown {
        let convergence = Convergence { slabs_per_voxel: 4.0, last_difference: Some(0.01) };
        let level = LevelOfDetail::Refined(convergence);
        let mut report = FrameReport::last(level, 16_777_216, Backend::Tiles, 1234.0);
        report.refined = Some(Refined { convergence, left_ms: 12_300.0 });
        report.progress = 0.4;
        Shown { report, mode: SplatSettings::EXACT, has_splats: true, measured: None }
    }

    #[test]
    fn the_line_is_one_sentence_and_nothing_stands_on_it_however_narrow_the_window() {
        let shown = shown();
        for width in [1280.0, 640.0, 520.0, 360.0, 200.0] {
            let ctx = Context::default();
            let room = Rect::from_min_size(Pos2::ZERO, vec2(width - 24.0, 28.0));
            let input = RawInput { screen_rect: Some(room), ..RawInput::default() };
            let pass = || {
                let mut output = ctx.run_ui(input.clone(), |ui| {
                    let now = Now {
                        shown: Some(&shown),
                        state: &EngineState::Drawing(0.4),
                        is_moving: false,
                        rate: None,
                        adapter: Some("llvmpipe (x)"),
                        engine: EngineChoice::Auto,
                    };
                    status_ui(ui, &now);
                });
                // Nobody paints them.
                output.textures_delta.clear();
                output.shapes
            };
            drop(pass());
            let shapes = pass();
            let texts: Vec<_> = shapes
                .iter()
                .filter_map(|shape| match &shape.shape {
                    Shape::Text(text) => Some(text),
                    _ => None,
                })
                .collect();
            assert_eq!(texts.len(), 1, "{width}");
            assert_eq!(texts[0].galley.text(), "Refining · 1.2 s · exact mode");
            assert_eq!(texts[0].galley.elided, width < 250.0, "{width}");
            let place = texts[0].galley.rect.translate(texts[0].pos.to_vec2());
            let bar = shapes.iter().filter(|shape| matches!(shape.shape, Shape::Rect(_)));
            let bar = bar.map(|shape| shape.shape.visual_bounding_rect().left());
            // Around the words themselves there may be a frame.
            let bar = bar.filter(|left| *left > place.left() + 1.0);
            let least = bar.fold(f32::INFINITY, f32::min);
            assert!(place.right() < least, "{width}: {place}, the bar from {least}");
        }
    }
}

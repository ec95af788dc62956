//! What is said over the picture of the first volume that somebody opens: how to take hold of it, and where the keys are.

use eframe::egui::{
    Color32, CornerRadius, Label, Pos2, Rect, RichText, TextWrapMode, Ui, UiBuilder, vec2,
};

use super::theme;

/// What it says, and where there is little room.
const WORDS: &str = "Drag to turn · wheel to zoom · press H for all keys";
const FEW_WORDS: &str = "Drag to turn · H: every key";
/// Room that the words ask for, and their height with what they lie on, points.
const WIDTH: f32 = 340.0;
const FEW_WIDTH: f32 = 210.0;
const HEIGHT: f32 = 26.0;
/// The distance of its middle from the lower edge, points: in the margin about what a first look shows, where there is one.
const ABOVE: f32 = 20.0;
/// Seconds after which it goes by itself: it lies over the picture.
const SHOWN_SECS: f64 = 15.0;
/// Seconds that it takes to go.
const FADE_SECS: f64 = 0.8;

/// The hint. It is there for a while in each run until the first drag, and never again.
#[derive(Debug, Default)]
pub(super) struct FirstHint {
    /// When it was first seen in this run.
    shown_since: Option<f64>,
    /// When the picture was taken hold of.
    fades_since: Option<f64>,
}

impl FirstHint {
    /// The picture was taken hold of: who does that `knows` it from now on, in later runs, too.
    pub(super) fn taken(&mut self, knows: &mut bool, now_secs: f64) {
        if !*knows {
            self.fades_since = (self.opacity(false, now_secs) > 0.0).then_some(now_secs);
            *knows = true;
        }
    }

    /// How much of it is seen, 0..=1.
    fn opacity(&self, knows: bool, now_secs: f64) -> f32 {
        let by_itself = self.shown_since.map(|since| since + SHOWN_SECS);
        let goes_at = if knows { self.fades_since } else { by_itself.or(Some(now_secs)) };
        #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
        goes_at.map_or(0.0, |at| (1.0 - (now_secs - at) / FADE_SECS).clamp(0.0, 1.0) as f32)
    }

    /// Draws it at the lower edge of the viewport. The hand goes through it.
    pub(super) fn show(&mut self, ui: &mut Ui, viewport: Rect, knows: bool) {
        let now = ui.ctx().time();
        self.shown_since.get_or_insert(now);
        let opacity = self.opacity(knows, now);
        if opacity == 0.0 {
            self.fades_since = None;
            return;
        }
        let (words, width) = match viewport.width() {
            room if room >= WIDTH + 2.0 * ABOVE => (WORDS, WIDTH),
            room if room >= FEW_WIDTH => (FEW_WORDS, FEW_WIDTH),
            _ => return,
        };
        // It asks for no repaint at its time: that comes with whatever moves next.
        if opacity < 1.0 {
            ui.ctx().request_repaint();
        }
        let middle = Pos2::new(viewport.center().x, viewport.bottom() - ABOVE);
        let rect = Rect::from_center_size(middle, vec2(width, HEIGHT));
        let shade = Color32::from_black_alpha(150).gamma_multiply(opacity);
        ui.painter_at(viewport).rect_filled(rect, CornerRadius::same(8), shade);
        ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
            ui.set_opacity(opacity);
            let words = RichText::new(words).size(13.5).color(theme::TEXT);
            let label = Label::new(words).selectable(false).wrap_mode(TextWrapMode::Extend);
            ui.centered_and_justified(|ui| ui.add(label));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stays_until_the_first_drag_fades_then_and_never_comes_again() {
        let (mut hint, mut knows) = (FirstHint::default(), false);
        assert_eq!(hint.opacity(knows, 1e6), 1.0);
        hint.taken(&mut knows, 10.0);
        assert!(knows);
        assert_eq!(hint.opacity(knows, 10.0), 1.0);
        assert!((hint.opacity(knows, 10.0 + FADE_SECS / 2.0) - 0.5).abs() < 1e-6);
        hint.taken(&mut knows, 10.0 + FADE_SECS / 2.0);
        assert_eq!(
            hint.opacity(knows, 10.0 + FADE_SECS),
            0.0,
            "a second drag makes it last no longer"
        );
        assert_eq!(FirstHint::default().opacity(true, 0.0), 0.0, "in a later run");
    }

    #[test]
    fn it_goes_by_itself_after_a_while() {
        let hint = FirstHint { shown_since: Some(5.0), fades_since: None };
        assert_eq!(hint.opacity(false, 5.0 + SHOWN_SECS), 1.0);
        assert_eq!(hint.opacity(false, 5.0 + SHOWN_SECS + 1.01 * FADE_SECS), 0.0);
    }
}

//! What the window has to say: one sentence each, until dismissed.

use eframe::egui::{
    Align, Button, Color32, CornerRadius, Frame, Label, Layout, Margin, RichText, Stroke, Ui, vec2,
};

use super::theme;

/// How many are kept; older ones make room.
const LIMIT: usize = 4;
/// Room for the button at the right of a bar, points.
const BUTTON_WIDTH: f32 = 76.0;

/// Bad news or news.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Something did not work.
    Error,
    /// Something to know.
    Note,
}

/// One sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Notice {
    /// Bad news or news.
    pub kind: Kind,
    /// The sentence.
    pub text: String,
}

/// What is shown, oldest first.
#[derive(Debug, Default)]
pub struct Notices {
    shown: Vec<Notice>,
}

impl Notices {
    /// What is shown, oldest first.
    pub fn shown(&self) -> &[Notice] {
        &self.shown
    }

    /// Shows bad news.
    pub fn error(&mut self, text: impl Into<String>) {
        self.push(Kind::Error, text.into());
    }

    /// Shows news.
    pub fn note(&mut self, text: impl Into<String>) {
        self.push(Kind::Note, text.into());
    }

    /// Takes everything off the screen.
    pub fn clear(&mut self) {
        self.shown.clear();
    }

    fn push(&mut self, kind: Kind, text: String) {
        let text = one_line(&text);
        self.shown.retain(|notice| notice.text != text);
        if self.shown.len() == LIMIT {
            self.shown.remove(0);
        }
        self.shown.push(Notice { kind, text });
    }

    /// Draws the bars, newest at the bottom.
    pub fn bars_ui(&mut self, ui: &mut Ui) {
        let mut dismissed = None;
        for (index, notice) in self.shown.iter().enumerate() {
            if bar_ui(ui, notice) {
                dismissed = Some(index);
            }
        }
        if let Some(index) = dismissed {
            self.shown.remove(index);
        }
    }
}

/// One bar; true once it was dismissed.
fn bar_ui(ui: &mut Ui, notice: &Notice) -> bool {
    let (colour, fill) = match notice.kind {
        Kind::Error => (theme::ERROR, Color32::from_rgb(58, 34, 34)),
        Kind::Note => (theme::NOTE, Color32::from_rgb(31, 45, 40)),
    };
    let frame = Frame::new()
        .fill(fill)
        .stroke(Stroke::new(1.0, colour.gamma_multiply(0.5)))
        .corner_radius(CornerRadius::same(6))
        .inner_margin(Margin::symmetric(10, 6));
    let words = RichText::new(&notice.text).color(colour.lerp_to_gamma(theme::TEXT, 0.45));
    frame.show(ui, |ui| text_and_button_ui(ui, words, "Dismiss", true)).inner
}

/// Text that wraps, and a button at its right; true once that was clicked.
pub(super) fn text_and_button_ui(ui: &mut Ui, text: RichText, button: &str, enabled: bool) -> bool {
    ui.horizontal(|ui| {
        let room = vec2((ui.available_width() - BUTTON_WIDTH).max(40.0), 0.0);
        ui.allocate_ui_with_layout(room, Layout::top_down(Align::Min), |ui| {
            ui.set_min_width(room.x);
            ui.add(Label::new(text).wrap().selectable(true));
        });
        ui.add_enabled(enabled, Button::new(button)).clicked()
    })
    .inner
}

/// Messages of libraries may hold line breaks; a bar holds a sentence.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_sentence_is_shown_once_and_old_ones_make_room() {
        let mut notices = Notices::default();
        for text in ["a", "b", "a", "c", "d", "e"] {
            notices.error(text);
        }
        let texts: Vec<_> = notices.shown().iter().map(|n| n.text.as_str()).collect();
        assert_eq!(texts, ["a", "c", "d", "e"]);
    }

    #[test]
    fn a_message_of_several_lines_becomes_one() {
        let mut notices = Notices::default();
        notices.note("one\n  two\tthree");
        assert_eq!(notices.shown()[0].text, "one two three");
    }
}

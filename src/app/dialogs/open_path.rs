//! Opening by a typed path, which works where no file dialog does.

use eframe::egui::text::{CCursor, CCursorRange};
use eframe::egui::{Context, Event, Key, TextEdit};

use super::{Outcome, buttons_ui, modal};
use crate::app::document::Source;

/// A path with a leading `~` replaced by the home folder, as a shell does.
fn at_home(text: &str) -> String {
    let home = std::env::var("HOME").or_else(|_| std::env::var("USERPROFILE"));
    match (text.strip_prefix("~/"), home) {
        (Some(rest), Ok(home)) => format!("{home}/{rest}"),
        _ => text.to_owned(),
    }
}

/// A path being typed.
#[derive(Debug)]
pub struct OpenPath {
    text: String,
    /// Whether it was typed here, rather than there before.
    is_typed: bool,
    focused: bool,
}

impl OpenPath {
    /// Begins with what is there already.
    pub fn new(text: String) -> Self {
        Self { text, is_typed: false, focused: false }
    }

    /// Shows the dialog.
    pub fn show(&mut self, ctx: &Context) -> Outcome<Source> {
        modal(ctx, "open path", "Open path", 460.0, |ui| {
            let name = ui.label("A file, or demo:NAME");
            if !self.focused {
                // Typed in the pass that brought the dialog, before the field could take it.
                let typed = ui.input(|input| {
                    let text = |event: &Event| match event {
                        Event::Text(text) | Event::Paste(text) => Some(text.clone()),
                        _ => None,
                    };
                    input.events.iter().filter_map(text).collect::<String>()
                });
                // It takes the place of what is there, as if that were selected.
                if !typed.is_empty() {
                    (self.text, self.is_typed) = (typed, true);
                }
            }
            let edit = TextEdit::singleline(&mut self.text)
                .desired_width(f32::INFINITY)
                .hint_text("/path/to/volume.nrrd");
            let shown = edit.show(ui);
            let response = shown.response.response.labelled_by(name.id);
            if !self.focused {
                let mut state = shown.state;
                let end = CCursor::new(self.text.chars().count());
                let begin = if self.is_typed { end } else { CCursor::new(0) };
                state.cursor.set_char_range(Some(CCursorRange::two(begin, end)));
                state.store(ui.ctx(), response.id);
                response.request_focus();
                self.focused = true;
            }
            let text = self.text.trim();
            let refusal = text.is_empty().then_some("Type a path first");
            let enter = ui.input(|input| input.key_pressed(Key::Enter));
            buttons_ui(ui, "Open", refusal, enter, || Source::parse(&at_home(text)))
        })
    }
}

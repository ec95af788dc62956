//! Opening by a typed path, which works where no file dialog does.

use eframe::egui::{Context, Key};

use super::{Outcome, TextLine, buttons_ui, modal};
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
    path: TextLine,
}

impl OpenPath {
    /// Begins with what is there already.
    pub fn new(text: String) -> Self {
        Self { path: TextLine::new(text) }
    }

    /// Shows the dialog.
    pub fn show(&mut self, ctx: &Context) -> Outcome<Source> {
        modal(ctx, "open path", "Open path", 460.0, |ui| {
            let name = ui.label("A file, or demo:NAME");
            self.path.show(ui, "/path/to/volume.nrrd").labelled_by(name.id);
            let text = self.path.text.trim();
            let refusal = text.is_empty().then_some("Type a path first");
            let enter = ui.input(|input| input.key_pressed(Key::Enter));
            buttons_ui(ui, "Open", refusal, enter, || Source::parse(&at_home(text)))
        })
    }
}

//! Where a transfer function is loaded from, or saved to.

use std::path::{Path, PathBuf};

use eframe::egui::{Button, Context, Key, TextEdit};

use super::{Outcome, buttons_ui, modal};
use crate::app::file_dialog::FileDialog;
use crate::task::transfer_file::is_named_so;

/// A path being chosen.
pub struct TransferFileDialog {
    saving: bool,
    path: String,
    focused: bool,
    browser: Option<FileDialog>,
    trouble: Option<&'static str>,
}

impl TransferFileDialog {
    /// Asks where to save to.
    pub fn save(suggestion: &Path) -> Self {
        Self { saving: true, path: suggestion.display().to_string(), ..Self::load() }
    }

    /// Asks what to load.
    pub fn load() -> Self {
        Self { saving: false, path: String::new(), focused: false, browser: None, trouble: None }
    }

    /// Whether it asks where to save to.
    pub fn is_saving(&self) -> bool {
        self.saving
    }

    /// Shows the dialog.
    pub fn show(&mut self, ctx: &Context) -> Outcome<PathBuf> {
        FileDialog::take_path(&mut self.browser, &mut self.path, &mut self.trouble);
        let (title, verb) = match self.saving {
            true => ("Save transfer function", "Save"),
            false => ("Load transfer function", "Load"),
        };
        modal(ctx, "transfer file", title, 460.0, |ui| {
            let name = ui.label("A file that ends in .json");
            let edit = TextEdit::singleline(&mut self.path)
                .desired_width(f32::INFINITY)
                .hint_text("/path/to/function.json");
            let response = ui.add(edit).labelled_by(name.id);
            if !self.focused {
                response.request_focus();
                self.focused = true;
            }
            let asking = self.browser.is_some();
            if ui.add_enabled(!asking, Button::new("Browse…")).clicked() {
                self.browser = Some(match self.saving {
                    true => FileDialog::save_transfer(ui.ctx(), Path::new(&self.path)),
                    false => FileDialog::open_transfer(ui.ctx()),
                });
            }
            if let Some(trouble) = self.trouble {
                ui.label(trouble);
            }
            let path = PathBuf::from(self.path.trim());
            let refusal = match () {
                () if path.as_os_str().is_empty() => Some("Type a path first"),
                () if self.saving && !is_named_so(&path) => {
                    Some("The file's name must end in .json")
                }
                () => None,
            };
            let enter = ui.input(|input| input.key_pressed(Key::Enter));
            buttons_ui(ui, verb, refusal, enter, || path)
        })
    }
}

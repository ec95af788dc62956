//! Where a transfer function or labels are read from, or it or basis functions are saved to.

use std::path::{Path, PathBuf};

use eframe::egui::{Button, Context, Key};

use super::{Outcome, TextLine, buttons_ui, modal};
use crate::app::file_dialog::FileDialog;
use crate::task::transfer_file::is_named_so;

/// What a file is chosen for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Purpose {
    /// A transfer function is to be read.
    LoadTransfer,
    /// One is to be written.
    SaveTransfer,
    /// Basis functions are to be written.
    SaveEncoding,
    /// A volume of labels is to be read.
    AddLabels,
}

/// A path being chosen.
pub struct NamedFileDialog {
    purpose: Purpose,
    path: TextLine,
    browser: Option<FileDialog>,
    trouble: Option<&'static str>,
}

impl NamedFileDialog {
    /// Asks for a path, beginning with a suggested one.
    pub fn new(purpose: Purpose, suggestion: &Path) -> Self {
        let path = TextLine::new(suggestion.display().to_string());
        Self { purpose, path, browser: None, trouble: None }
    }

    /// What it asks for.
    pub fn purpose(&self) -> Purpose {
        self.purpose
    }

    /// Shows the dialog.
    pub fn show(&mut self, ctx: &Context) -> Outcome<PathBuf> {
        FileDialog::take_path(&mut self.browser, &mut self.path.text, &mut self.trouble);
        let (title, verb) = match self.purpose {
            Purpose::LoadTransfer => ("Load transfer function", "Load"),
            Purpose::SaveTransfer => ("Save transfer function", "Save"),
            Purpose::SaveEncoding => ("Save basis functions", "Save"),
            Purpose::AddLabels => ("Add labels", "Add"),
        };
        let (label, hint, misnamed) = match self.purpose {
            Purpose::LoadTransfer | Purpose::SaveTransfer => (
                "A file that ends in .json",
                "/path/to/function.json",
                "The file's name must end in .json",
            ),
            Purpose::SaveEncoding => (
                "A file that ends in .vrbf",
                "/path/to/functions.vrbf",
                "The file's name must end in .vrbf",
            ),
            Purpose::AddLabels => (
                "A segmentation of this volume, in any format that volumes have",
                "/path/to/labels.nii.gz",
                "",
            ),
        };
        modal(ctx, "named file", title, 460.0, |ui| {
            let name = ui.label(label);
            self.path.show(ui, hint).labelled_by(name.id);
            let asking = self.browser.is_some();
            if ui.add_enabled(!asking, Button::new("Browse…")).clicked() {
                let path = Path::new(&self.path.text);
                self.browser = Some(match self.purpose {
                    Purpose::LoadTransfer => FileDialog::open_transfer(ui.ctx()),
                    Purpose::SaveTransfer => FileDialog::save_transfer(ui.ctx(), path),
                    Purpose::SaveEncoding => FileDialog::save_encoding(ui.ctx(), path),
                    Purpose::AddLabels => FileDialog::open(ui.ctx()),
                });
            }
            if let Some(trouble) = self.trouble {
                ui.label(trouble);
            }
            let path = PathBuf::from(self.path.text.trim());
            let refusal = match () {
                () if path.as_os_str().is_empty() => Some("Type a path first"),
                () if !self.purpose.allows(&path) => Some(misnamed),
                () => None,
            };
            let enter = ui.input(|input| input.key_pressed(Key::Enter));
            buttons_ui(ui, verb, refusal, enter, || path)
        })
    }
}

impl Purpose {
    /// Whether the file is read, rather than written.
    pub fn reads(self) -> bool {
        matches!(self, Self::LoadTransfer | Self::AddLabels)
    }

    /// Whether a file may be called so. What is read says what it is itself.
    fn allows(self, path: &Path) -> bool {
        match self {
            Self::LoadTransfer | Self::AddLabels => true,
            Self::SaveTransfer => is_named_so(path),
            Self::SaveEncoding => {
                path.extension().is_some_and(|name| name.eq_ignore_ascii_case("vrbf"))
            }
        }
    }
}

//! The window's part in copying, pasting, loading and saving transfer functions.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui::{Context, Event, ViewportCommand};

use super::actions::Action;
use super::dialogs::named_file::{NamedFileDialog, Purpose};
use super::document::Source;
use super::job::{Ended, Job};
use super::polygons::Surfaces;
use super::saving::{self, Written};
use super::window::{Dialog, Window};
use super::words;
use crate::io::mesh::MeshFormat;
use crate::task::transfer_file;
use crate::transfer::Design;
use crate::volume::Statistics;

/// What to say where no value of a volume lies among those of a transfer function.
fn of_other_values(design: &Design, statistics: &Statistics) -> Option<String> {
    let opacities = design.function.opacity.iter().map(|(value, _)| *value);
    let regions = design.regions.iter().flat_map(|region| region.values);
    let values = opacities.chain(regions).chain(design.function.colour.range());
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    });
    let Statistics { min, max, .. } = *statistics;
    let is_beside = min <= max && (high < min || low > max);
    is_beside.then(|| {
        let [low, high, min, max] = [low, high, min, max].map(words::value);
        format!(
            "That transfer function is of values from {low} to {high}, and this volume's go from {min} to \
             {max}: Rescale to Full range, under Transfer function, fits it to them"
        )
    })
}

/// A transfer function being read.
pub(super) type LoadingDesign = Job<Result<Design, String>>;

impl Window {
    /// Does what a command about transfer functions says; they need something open.
    pub(super) fn exchange(&mut self, ctx: &Context, action: Action) {
        let Some(design) = self.design() else {
            self.notices.hint("A transfer function belongs to a volume: open one first");
            return;
        };
        match action {
            Action::CopyTransfer => {
                ctx.copy_text(design.to_text());
                self.notices.hint("Copied the transfer function as text");
            }
            // What comes of it is an event of its own.
            Action::PasteTransfer => ctx.send_viewport_cmd(ViewportCommand::RequestPaste),
            Action::LoadTransfer => self.ask_for_file(Purpose::LoadTransfer, Path::new("")),
            Action::SaveTransfer => {
                self.ask_for_file(Purpose::SaveTransfer, &self.suggested_transfer_path());
            }
            _ => {}
        }
    }

    /// Asks for the path of a file, beginning with the one that could not be read or written.
    pub(super) fn ask_for_file(&mut self, purpose: Purpose, suggestion: &Path) {
        let unfinished = self.unfinished.get(&purpose).map(PathBuf::as_path);
        let dialog = NamedFileDialog::new(purpose, unfinished.unwrap_or(suggestion));
        self.dialog = Some(Dialog::NamedFile(Box::new(dialog)));
    }

    /// The transfer function on screen with what it was made of.
    fn design(&self) -> Option<Design> {
        let scene = self.scene.as_ref()?;
        let (function, regions) = (scene.transfer()?.clone(), scene.shading.regions.clone());
        Some(Design { function, gaussians: self.gaussians.clone(), regions })
    }

    /// Beside the volume, or with the pictures where that is no file.
    pub(super) fn suggested_transfer_path(&self) -> PathBuf {
        let source = self.document.as_ref().map(|document| &document.source);
        let folder = source.and_then(Source::path).and_then(Path::parent).map(Path::to_owned);
        let folder = folder.or_else(|| self.parts.pictures_folder.clone().ok());
        let name = source.map(Source::name).unwrap_or_default();
        saving::suggested_transfer_path(&folder.unwrap_or_default(), &name)
    }

    /// Shows another transfer function, and tells where it is one of other values.
    fn adopt(&mut self, design: Design) {
        if let Some(scene) = &mut self.scene {
            let volume = scene.volume().map(Arc::clone);
            let Some((volume, transfer)) = volume.zip(scene.transfer_mut()) else { return };
            if let Some(hint) = of_other_values(&design, &volume.statistics) {
                self.notices.hint(hint);
            }
            *transfer = design.function;
            scene.shading.regions = design.regions;
            self.gaussians = design.gaussians;
            self.transfer.start_over();
        }
    }

    /// Reads or writes the file that a dialog has asked for.
    pub(super) fn take_named_file(&mut self, ctx: &Context, purpose: Purpose, path: PathBuf) {
        self.unfinished.insert(purpose, path.clone());
        match purpose {
            Purpose::LoadTransfer => self.load_transfer(ctx, path),
            Purpose::SaveTransfer => self.save_transfer(ctx, path),
            Purpose::SaveEncoding => self.save_encoding(ctx, path),
            Purpose::AddLabels => self.embed(ctx, Surfaces::Labels, path),
        }
    }

    fn save_transfer(&mut self, ctx: &Context, path: PathBuf) {
        if let Some(design) = self.design() {
            let title = "Saving the transfer function";
            self.saving.push(Job::start("save-transfer", title, ctx, move |_| {
                transfer_file::write(&design, &path).map(|()| Written::of(&path, None))
            }));
        }
    }

    /// Opens a file that was dropped or chosen: a transfer function by its name, polygons into the file that is open, else a
    /// volume, or a surface by itself, which demos give way to.
    pub(super) fn open_any(&mut self, ctx: &Context, path: PathBuf) {
        if transfer_file::is_named_so(&path) {
            self.load_transfer(ctx, path);
        } else if MeshFormat::of(&path).is_some() && self.has_file() {
            self.embed(ctx, Surfaces::Polygons, path);
        } else {
            self.open(ctx, Source::File(path));
        }
    }

    /// Whether what is open is a file, rather than a demo or nothing.
    fn has_file(&self) -> bool {
        self.document.as_ref().is_some_and(|document| document.source.path().is_some())
    }

    fn load_transfer(&mut self, ctx: &Context, path: PathBuf) {
        if self.scene.is_none() {
            self.notices.hint("A transfer function belongs to a volume: open one first");
            return;
        }
        let title = "Loading the transfer function";
        let job = Job::start("load-transfer", title, ctx, move |_| transfer_file::read(&path));
        self.loading_design = Some(job);
    }

    /// Takes a transfer function that was read.
    pub(super) fn take_design(&mut self) {
        let Some(ended) = self.loading_design.as_ref().and_then(Job::poll) else { return };
        self.loading_design = None;
        match ended {
            Ended::Finished(Ok(design)) => {
                self.unfinished.remove(&Purpose::LoadTransfer);
                self.notices.settle();
                self.adopt(design);
            }
            Ended::Finished(Err(reason)) => self.notices.error(reason),
            Ended::Lost => self.notices.error("Loading stopped on a bug of the program"),
        }
    }

    /// Copies and pastes as the desktop asks for, unless that is for a text field or a dialog.
    pub(super) fn take_clipboard(&mut self, ctx: &Context) {
        if self.dialog.is_some() || ctx.text_edit_focused() {
            return;
        }
        let wanted = |event: &Event| matches!(event, Event::Copy | Event::Paste(_));
        let events: Vec<Event> =
            ctx.input(|i| i.events.iter().filter(|e| wanted(e)).cloned().collect());
        for event in events {
            match event {
                Event::Copy => self.exchange(ctx, Action::CopyTransfer),
                Event::Paste(_) if self.scene.is_none() => {
                    self.exchange(ctx, Action::PasteTransfer);
                }
                Event::Paste(text) => match Design::from_text(&text) {
                    Ok(design) => {
                        self.notices.settle();
                        self.adopt(design);
                    }
                    Err(error) => {
                        self.notices.error(format!("What was pasted cannot be used: {error}"))
                    }
                },
                _ => {}
            }
        }
    }
}

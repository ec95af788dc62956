//! The window's part in saving pictures: what is asked, what is drawn for it, and how it ended.

use eframe::egui::Context;

use super::dialogs::save::{SaveChoice, SaveDialog};
use super::job::Ended;
use super::saving::{self, SaveRequest};
use super::window::{Dialog, Window};
use crate::scene::{Annotations, Background, Scene};
use crate::task::annotations::laid_out;

impl Window {
    pub(super) fn ask_to_save(&mut self) {
        let (Some(document), Some(scene)) = (&self.document, &self.scene) else {
            self.notices.hint("There is no picture to save yet: open a volume first");
            return;
        };
        let folder = self.parts.pictures_folder.clone().unwrap_or_default();
        let path = saving::suggested_path(&folder, &document.source.name(), "png");
        let with_background = scene.background != Background::Transparent;
        let is_annotated = self.settings.annotations.any();
        let dialog = SaveDialog::new(self.viewport_size, with_background, is_annotated, &path);
        self.dialog = Some(Dialog::Save(Box::new(dialog.with_pixel_ms(self.pixel_ms))));
    }

    /// Asks for the file of a loop of the animation.
    pub(super) fn ask_to_save_loop(&mut self) {
        let (Some(document), Some(scene)) = (&self.document, &self.scene) else { return };
        let folder = self.parts.pictures_folder.clone().unwrap_or_default();
        let path = saving::suggested_path(&folder, &document.source.name(), "gif");
        let with_background = scene.background != Background::Transparent;
        let is_annotated = self.settings.annotations.any();
        let size = self.viewport_size;
        let dialog = SaveDialog::of_cycle(size, with_background, is_annotated, &path);
        self.dialog = Some(Dialog::Save(Box::new(dialog.with_pixel_ms(self.pixel_ms))));
    }

    pub(super) fn save_picture(&mut self, ctx: &Context, choice: SaveChoice) {
        let Some(mut scene) = self.scene.clone() else { return };
        // What is saved is what is seen.
        scene.splat = self.shown_mode(&scene);
        let background = if choice.with_background {
            Background::Colour(self.settings.background)
        } else {
            Background::Transparent
        };
        let scene = Scene { background, ..scene };
        let annotations = match choice.with_annotations {
            true => self.settings.annotations,
            false => Annotations::NONE,
        };
        let space = self.document.as_ref().and_then(|document| document.grid.space.clone());
        let SaveChoice { size, path, cycle, .. } = choice;
        let smooth_edges = self.settings.smooth_edges;
        let request = SaveRequest { scene, size, annotations, space, path, cycle, smooth_edges };
        self.saving.push(saving::save_picture(ctx, &self.parts.renderer, request));
    }

    pub(super) fn save_screenshot(&mut self, ctx: &Context) {
        let (Some(document), Some(picture), Some(scene)) =
            (&self.document, self.viewport.picture(), &self.scene)
        else {
            self.notices.hint("There is no picture on screen yet");
            return;
        };
        let space = document.grid.space.as_deref();
        let layout = laid_out(self.settings.annotations, scene, space, picture.size);
        match &self.parts.pictures_folder {
            Ok(folder) => {
                let name = document.source.name();
                self.saving.push(saving::save_screenshot(
                    ctx,
                    picture,
                    layout.primitives,
                    folder,
                    &name,
                ));
            }
            Err(reason) => self.notices.error(reason.clone()),
        }
    }

    pub(super) fn take_saved(&mut self) {
        let (notices, unfinished) = (&mut self.notices, &mut self.unfinished);
        self.saving.retain(|job| {
            let Some(ended) = job.poll() else { return true };
            match ended {
                _ if job.is_cancelled() => {}
                Ended::Finished(Ok(written)) => {
                    unfinished.retain(|purpose, _| purpose.reads());
                    notices.settle();
                    notices.hint(format!("Saved {written}"));
                }
                Ended::Finished(Err(reason)) => notices.error(reason),
                Ended::Lost => notices.error("Saving stopped on a bug of the program"),
            }
            false
        });
    }
}

//! What each command does, what it needs, and whether what it switches is on.

use std::f64::consts::{FRAC_PI_2, PI};

use eframe::egui::{Context, ViewportCommand};

use super::actions::{self, Action};
use super::camera_control;
use super::compare::Display;
use super::dialogs::find::Find;
use super::file_dialog::FileDialog;
use super::flow::FlowShape;
use super::layout::{NO_SIDE_ROOM, has_side_room};
use super::panels::{self, CLIP, INSIDE, SPLATS, clip, inside};
use super::polygons::Surfaces;
use super::vectors::faded_for;
use super::window::{Dialog, Window};
use crate::core::{Camera, Projection};
use crate::scene::{
    AlongRay, Annotation, ClipBox, Inside, MOST_CLIP_PLANES, MOST_ISOSURFACES, MOST_LIGHTS,
    MOST_SLICES, NamedView, Scene,
};

/// What is told of what lies in the volume, once it changes: how many slices there are, and whether the volume is faded.
pub(super) fn told_of(inside: &Inside) -> (usize, bool) {
    (inside.slices.len(), inside.is_faded)
}

impl Window {
    /// Runs the commands whose keys were pressed.
    pub(super) fn take_keys(&mut self, ctx: &Context) {
        // While a dialog asks, keys are its own; only help closes by its own key.
        let allowed = |action: &Action| match (&self.dialog, action) {
            (None, _) | (Some(_), Action::Quit) => true,
            (Some(Dialog::Help), Action::ToggleHelp) => true,
            (Some(_), _) => false,
        };
        // The desktop's dialog for files may still be on its way: what is typed for it is no command.
        let behind_dialog = self.file_dialog.is_some()
            || self.polygons.is_choosing()
            || self.dialog.as_ref().is_some_and(|dialog| !matches!(dialog, Dialog::Help));
        if self.dialog.is_none() {
            actions::leave_to_dialog(ctx);
        }
        let pressed = actions::pressed(ctx, self.escape_ends_tools(ctx), behind_dialog);
        let pressed: Vec<Action> = pressed.into_iter().filter(allowed).collect();
        for action in pressed {
            match action {
                Action::Undo => self.step_back_by_key(ctx),
                _ => self.perform(ctx, action),
            }
        }
    }

    /// Does what a command says.
    pub(super) fn perform(&mut self, ctx: &Context, action: Action) {
        if let Some(reason) = self.why_not(action) {
            self.notices.hint(reason);
            return;
        }
        match action {
            Action::Open => self.file_dialog = Some((self.parts.chooser)(ctx)),
            Action::OpenFolder => self.file_dialog = Some(FileDialog::open_folder(ctx)),
            Action::OpenPath => self.ask_for_path(),
            Action::RawLayout => self.ask_raw_layout_again(),
            Action::EmbedPolygons => self.choose_surfaces(ctx, Surfaces::Polygons),
            Action::AddLabels => self.choose_surfaces(ctx, Surfaces::Labels),
            Action::SavePicture => self.ask_to_save(),
            Action::SaveScreenshot => self.save_screenshot(ctx),
            Action::LoadTransfer
            | Action::SaveTransfer
            | Action::CopyTransfer
            | Action::PasteTransfer => self.exchange(ctx, action),
            Action::Quit => ctx.send_viewport_cmd(ViewportCommand::Close),
            Action::Undo => self.step(ctx, true),
            Action::Redo => self.step(ctx, false),
            Action::PreviousView => self.step_view(ctx, true),
            Action::NextView => self.step_view(ctx, false),
            Action::ViewFront => self.fit(NamedView::Front),
            Action::ViewBack => self.fit(NamedView::Back),
            Action::ViewLeft => self.fit(NamedView::Left),
            Action::ViewRight => self.fit(NamedView::Right),
            Action::ViewTop => self.fit(NamedView::Top),
            Action::ViewBottom => self.fit(NamedView::Bottom),
            Action::ViewIsometric => self.fit(NamedView::Isometric),
            Action::RollLeft => self.change_camera(|camera| camera.rolled(-FRAC_PI_2)),
            Action::RollRight => self.change_camera(|camera| camera.rolled(FRAC_PI_2)),
            Action::TurnUpsideDown => self.turn_upside_down(),
            Action::ToggleProjection => {
                let angle = self.settings.view_angle_deg;
                self.change_camera(|camera| camera_control::with_other_projection(camera, angle));
            }
            Action::ResetView => self.reset_view(),
            Action::FitView => self.fit_to_window(),
            Action::Converge => self.converge(),
            Action::ToggleLeveling => self.leveling.on = !self.leveling.on,
            Action::ToggleProbe => self.toggle_probe(ctx),
            Action::EndTools => self.end_tools(ctx),
            Action::ToggleAnimation | Action::MakeStreamlines if self.can_show_vectors() => {
                self.show_vectors_first(ctx, action);
            }
            Action::ToggleAnimation => self.toggle_animation(ctx),
            Action::AddSlice => self.add_inside(ctx, inside::add_slice),
            Action::AddIsosurface => self.add_inside(ctx, inside::add_isosurface),
            Action::ToggleClipBox => self.toggle_clip_box(ctx),
            Action::AddClipPlane => {
                self.scene.iter_mut().for_each(clip::add_plane);
                self.show_section(ctx, CLIP);
            }
            Action::AddLight => self.add_light(ctx),
            Action::MakeStreamlines => {
                self.show_section(ctx, panels::VECTORS);
                panels::seek(ctx, panels::flow::FLOW);
                self.start_flow(ctx, FlowShape::Streamlines);
            }
            Action::ToggleLights => self.toggle_lights(),
            Action::ToggleMaximum => self.toggle_maximum(),
            Action::ToggleFade => self.toggle_fade(),
            Action::ShowFaded => {
                self.scene.iter_mut().for_each(|scene| scene.fade(false));
            }
            Action::ShowVectors => self.show_first_vectors(ctx),
            Action::ToggleEffects => self.effects.open = !self.effects.open,
            Action::ToggleScalarBar => self.toggle_annotation(Annotation::ScalarBar),
            Action::ToggleScaleBar => self.toggle_annotation(Annotation::ScaleBar),
            Action::ToggleAxes => self.toggle_annotation(Annotation::Axes),
            Action::ToggleTrihedron => self.toggle_annotation(Annotation::Trihedron),
            Action::ToggleCells => self.toggle_cells(),
            Action::ToggleSidePanel if !has_side_room(ctx) => self.notices.hint(NO_SIDE_ROOM),
            Action::ToggleSidePanel => self.settings.side_panel = !self.settings.side_panel,
            Action::ToggleAccuracy => self.toggle_accuracy(),
            Action::ToggleCompare => self.toggle_compare(ctx),
            Action::ToggleDifference => {
                self.compare.display = match self.compare.display {
                    Display::Split => Display::Difference,
                    Display::Difference => Display::Split,
                };
            }
            Action::Find => self.dialog = Some(Dialog::Find(Find::default())),
            Action::ToggleHelp => {
                let shown = matches!(self.dialog, Some(Dialog::Help));
                self.dialog = (!shown).then_some(Dialog::Help);
            }
            Action::About => self.dialog = Some(Dialog::About),
        }
    }

    /// Why a command has nothing to work on, if so.
    pub(super) fn why_not(&self, action: Action) -> Option<&'static str> {
        const NO_MORE_SLICES: &str = "There are as many slices as there can be";
        const NO_MORE_SURFACES: &str = "There are as many isosurfaces as there can be";
        const NO_MORE_PLANES: &str = "There are as many clip planes as there can be";
        const NO_MORE_LIGHTS: &str = "There are as many lights as there can be";
        let scene = self.scene.as_ref();
        let has_vectors = scene.is_some_and(|scene| !scene.vectors().is_empty());
        let inside = scene.map(|scene| &scene.inside);
        let has =
            |count: fn(&Inside) -> usize, most: usize| inside.is_some_and(|i| count(i) >= most);
        let lights = scene.and_then(|scene| scene.shading.lighting.as_ref());
        match action {
            Action::AddSlice | Action::AddIsosurface
                if scene.is_none_or(|scene| scene.volume().is_none()) =>
            {
                Some("There is no volume to add that to: open one first")
            }
            Action::AddSlice if has(|i| i.slices.len(), MOST_SLICES) => Some(NO_MORE_SLICES),
            Action::AddIsosurface if has(|i| i.isosurfaces.len(), MOST_ISOSURFACES) => {
                Some(NO_MORE_SURFACES)
            }
            Action::AddClipPlane if has(|i| i.clip.planes.len(), MOST_CLIP_PLANES) => {
                Some(NO_MORE_PLANES)
            }
            Action::ToggleMaximum if scene.is_none_or(|scene| !scene.shows_field()) => {
                Some("There is no volume to project: open one, or show its field")
            }
            Action::AddLight if scene.is_none_or(|scene| scene.volume().is_none()) => {
                Some("There is no volume to be lit: open one first")
            }
            Action::AddLight if lights.is_some_and(|l| l.lights.len() >= MOST_LIGHTS) => {
                Some(NO_MORE_LIGHTS)
            }
            Action::ToggleClipBox | Action::AddClipPlane if scene.is_none() => {
                Some("There is nothing to clip: open a volume first")
            }
            Action::MakeStreamlines | Action::ToggleAnimation
                if !has_vectors && !self.can_show_vectors() =>
            {
                let has_some =
                    self.document.as_ref().is_some_and(|document| document.has_vectors());
                Some(match (action, has_some) {
                    (Action::MakeStreamlines, true) => {
                        "Streamlines follow vectors that are shown: choose some under Vectors"
                    }
                    (Action::MakeStreamlines, false) => {
                        "Streamlines follow vectors, and this file has none"
                    }
                    (_, true) => "There are no vectors to animate: choose some under Vectors",
                    (_, false) => "Vectors are what is animated, and this file has none",
                })
            }
            Action::ToggleDifference if !self.compare.on => {
                Some("Differences are between two pictures: compare first, with C")
            }
            _ => None,
        }
    }

    /// Whether what a command switches is on; `None` where it switches nothing.
    pub(super) fn is_on(&self, action: Action) -> Option<bool> {
        let scene = self.scene.as_ref();
        let inside = scene.map(|scene| &scene.inside);
        let written = |which: Annotation| self.settings.annotations.has(which);
        Some(match action {
            Action::ToggleProjection => scene.is_some_and(|scene| {
                matches!(scene.camera.projection, Projection::Perspective { .. })
            }),
            Action::ToggleLights => scene.is_some_and(|scene| scene.shading.lighting.is_some()),
            Action::ToggleMaximum => inside.is_some_and(|inside| inside.along == AlongRay::Maximum),
            Action::ToggleFade => inside.is_some_and(|inside| inside.is_faded),
            Action::ToggleScalarBar => written(Annotation::ScalarBar),
            Action::ToggleScaleBar => written(Annotation::ScaleBar),
            Action::ToggleAxes => written(Annotation::Axes),
            Action::ToggleTrihedron => written(Annotation::Trihedron),
            Action::ToggleAnimation => self.vectors.clock.is_running(),
            Action::ToggleClipBox => scene.is_some_and(|scene| scene.inside.clip.bounds.is_some()),
            Action::ToggleCells => self.cells.on,
            Action::ToggleLeveling => self.leveling.on,
            Action::ToggleProbe => self.probing.is_on(),
            Action::ToggleSidePanel => self.settings.side_panel,
            Action::ToggleAccuracy => self.accuracy.open,
            Action::ToggleEffects => self.effects.open,
            Action::ToggleCompare => self.compare.on,
            Action::ToggleDifference => self.compare.display == Display::Difference,
            Action::ToggleHelp => matches!(self.dialog, Some(Dialog::Help)),
            _ => return None,
        })
    }

    pub(super) fn toggle_probe(&mut self, ctx: &Context) {
        let ctx = ctx.clone();
        if let Err(reason) = self.probing.toggle(move || ctx.request_repaint()) {
            self.notices.error(reason);
        }
    }

    fn toggle_compare(&mut self, ctx: &Context) {
        let Some(scene) = &self.scene else { return };
        self.compare.toggle(&scene.splat, &scene.inside);
        if self.compare.on {
            // Where the second mode is chosen.
            self.show_section(ctx, SPLATS);
            self.tell_of_judging(
                "While two modes are compared, pictures are not refined any further",
            );
        }
    }

    fn toggle_accuracy(&mut self) {
        self.accuracy.open = !self.accuracy.open;
        if self.accuracy.open {
            self.tell_of_judging("While modes are measured, pictures are not refined any further");
        }
    }

    /// Says why a picture that was refined is shown without that.
    fn tell_of_judging(&mut self, why: &str) {
        let refined = self.viewport.picture().and_then(|picture| picture.report.refined);
        if refined.is_some_and(|refined| refined.convergence.last_difference.is_some()) {
            self.notices.hint(why);
        }
    }

    fn toggle_fade(&mut self) {
        if let Some(scene) = &mut self.scene {
            scene.fade(!scene.inside.is_faded);
        }
    }

    /// Shows the greatest value on each line of sight, or the volume again.
    fn toggle_maximum(&mut self) {
        let Some((scene, document)) = self.scene.as_mut().zip(self.document.as_ref()) else {
            return;
        };
        let chosen = match scene.inside.along {
            AlongRay::Maximum => AlongRay::Composite,
            _ => AlongRay::Maximum,
        };
        inside::choose_rendering(scene, chosen, &document.first_look.transfer.colour);
    }

    /// Adds something that lies in the volume, whose row is in sight in the side panel then.
    fn add_inside(&mut self, ctx: &Context, add: fn(&mut Scene)) {
        let Some(scene) = &mut self.scene else { return };
        let (before, slices) = (told_of(&scene.inside), scene.inside.slices.len());
        add(scene);
        self.show_section(ctx, INSIDE);
        self.tell_of_inside(before);
        let Some(scene) = &self.scene else { return };
        if scene.inside.slices.len() > slices
            && let Some(slice) = scene.inside.slices.last()
        {
            let frame = slice.plane.outline(&scene.lattice());
            self.offer_to_fit(&frame, "The slice reaches beyond this view");
        }
    }

    /// Opens a section of the side panel, and has it scrolled into sight.
    pub(super) fn show_section(&mut self, ctx: &Context, name: &'static str) {
        self.settings.sections.insert(name.to_owned(), true);
        panels::seek(ctx, name);
    }

    /// Says where the volume was faded for slices or isosurfaces that were added.
    pub(super) fn tell_of_inside(&mut self, (slices, was_faded): (usize, bool)) {
        let Some(scene) = &self.scene else { return };
        let (now, is_faded) = told_of(&scene.inside);
        if is_faded && !was_faded {
            let name = if now > slices { "slice" } else { "isosurface" };
            self.notices.offer(Action::ShowFaded, faded_for(name));
        }
    }

    fn toggle_clip_box(&mut self, ctx: &Context) {
        if let Some(scene) = &mut self.scene {
            self.clip.toggle_box(scene);
            let is_tight = scene.inside.clip.bounds.is_some_and(|bounds| bounds != ClipBox::WHOLE);
            if is_tight {
                self.notices
                    .hint("The clip box begins around what shows: drag the handles on its faces");
            }
            let is_on = scene.inside.clip.bounds.is_some();
            self.show_section(ctx, CLIP);
            if is_on {
                self.offer_to_fit_box("The clip box reaches beyond this view");
            }
        }
    }

    fn toggle_annotation(&mut self, which: Annotation) {
        let switch = self.settings.annotations.switch(which);
        *switch = !*switch;
        if *switch && which == Annotation::Axes {
            self.offer_to_fit_box("The axes reach beyond this view");
        }
    }

    fn change_camera(&mut self, change: impl FnOnce(&Camera) -> Camera) {
        if let Some(scene) = &mut self.scene {
            scene.camera = change(&scene.camera);
        }
    }

    fn turn_upside_down(&mut self) {
        let up = self.orientation().up.flipped();
        if let Some(scene) = &mut self.scene {
            scene.up = Some(up);
            scene.camera = scene.camera.rolled(PI);
        }
    }

    fn reset_view(&mut self) {
        self.fit(self.orientation().first_view());
    }
}

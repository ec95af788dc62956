//! The window's state, and what its commands, jobs and dialogs do to it.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use eframe::egui::{Context, Ui, ViewportCommand};

use super::Content;
use super::actions::{self, Action};
use super::camera_control;
use super::cells::CellsOverlay;
use super::clip_box::BoxHandles;
use super::compare::{Compare, Display};
use super::dialogs::Outcome;
use super::dialogs::find::Find;
use super::dialogs::named_file::{NamedFileDialog, Purpose};
use super::dialogs::open_path::OpenPath;
use super::dialogs::raw::RawDialog;
use super::dialogs::save::SaveDialog;
use super::document::{Document, Library, Source};
use super::drawer::Drawer;
use super::effects::Effects;
use super::encoding::{EncodeChoice, Encoding};
use super::exchanging::LoadingDesign;
use super::field_colours::FieldColours;
use super::file_dialog::FileDialog;
use super::first_hint::FirstHint;
use super::flow::{Flow, FlowShape};
use super::history::History;
use super::job::Job;
use super::layout::{NO_SIDE_ROOM, has_side_room};
use super::leveling::Leveling;
use super::measuring::{EstimateRecord, Measuring, StartMeasuring};
use super::notices::Notices;
use super::opening::Loading;
use super::pacing::{News, Pacing};
use super::panels::accuracy::AccuracyPanel;
use super::panels::clip::{self, ClipEditor};
use super::panels::shading::ShadingEditor;
use super::panels::transfer::TransferEditor;
use super::panels::{self, CLIP, INSIDE, inside, typed};
use super::polygons::{Polygons, Surfaces};
use super::probing::Probing;
use super::rate::PictureRate;
use super::saving::{Renderer, Saved};
use super::settings::Settings;
use super::slice_handles::SliceHandles;
use super::theme;
use super::undoing::State;
use super::vectors::{Vectors, faded_for};
use super::viewport::{ScreenFormat, Viewport};
use crate::core::{Camera, Projection};
use crate::scene::{
    Annotation, Annotations, Inside, MOST_CLIP_PLANES, MOST_ISOSURFACES, MOST_LIGHTS, MOST_SLICES,
    Moving, NamedView, Orientation, Scene, SplatSettings,
};
use crate::task::annotations::beside_bars;
use crate::task::engine::EngineState;
use crate::task::level::LevelOfDetail;
use crate::transfer::Gaussian;

/// Between two looks at the progress of a job.
const PROGRESS_EVERY: Duration = Duration::from_millis(100);
/// The key of the settings in the storage.
const SETTINGS_KEY: &str = "settings";

/// Everything the window is given from outside; tests give stand-ins.
pub struct Parts {
    /// Who draws.
    pub drawer: Box<dyn Drawer>,
    /// The drawer's line to the window.
    pub news: Arc<News>,
    /// How long a pass may wait for the picture of a change it has posted.
    pub wait_for_picture: Duration,
    /// What the window's surface holds, where an adapter paints it; the processor does otherwise.
    pub screen_format: Option<ScreenFormat>,
    /// Who reads.
    pub library: Arc<dyn Library>,
    /// Who draws pictures to be saved.
    pub renderer: Renderer,
    /// Who measures modes for the accuracy panel.
    pub measure: StartMeasuring,
    /// Bytes that volumes of earlier steps may take; asked whenever a step brings another.
    pub bytes_for_steps: Box<dyn Fn() -> u64>,
    /// Asks the person for a file to open.
    pub chooser: Box<dyn Fn(&Context) -> FileDialog>,
    /// Where screenshots go, or one sentence why there is no such place.
    pub pictures_folder: Result<PathBuf, String>,
}

/// The dialog on screen.
pub(super) enum Dialog {
    OpenPath(OpenPath),
    Raw(Box<RawDialog>),
    Save(Box<SaveDialog>),
    NamedFile(Box<NamedFileDialog>),
    Find(Find),
    Help,
    About,
}

/// The window.
pub struct Window {
    pub(super) parts: Parts,
    pub(super) settings: Settings,
    pub(super) document: Option<Document>,
    pub(super) scene: Option<Scene>,
    /// What the first scene draws while the view moves.
    pub(super) moving: Moving,
    /// The bells that the scene's opacities follow; none where they are points of their own.
    pub(super) gaussians: Vec<Gaussian>,
    pub(super) transfer: TransferEditor,
    pub(super) leveling: Leveling,
    pub(super) probing: Probing,
    pub(super) history: History<State>,
    /// Steps of the camera.
    pub(super) views: History<Camera>,
    /// When the key for undo last asked whether the open file is to go.
    pub(super) undo_asked_secs: Option<f64>,
    pub(super) viewport: Viewport,
    /// The view that shows everything, and the camera that was found for it; the view is moved once its camera is another.
    pub(super) fitted: Option<(NamedView, Camera)>,
    /// The viewport's size in physical pixels at the last pass.
    pub(super) viewport_size: [u32; 2],
    /// The same, and whether axes and scalar bars take of it.
    room: ([u32; 2], bool, bool),
    /// The same with its place on the window before it: left, top, width, height.
    pub(super) viewport_pixels: [u32; 4],
    pub(super) pacing: Pacing,
    pub(super) rate: PictureRate,
    pub(super) notices: Notices,
    pub(super) first_hint: FirstHint,
    pub(super) dialog: Option<Dialog>,
    pub(super) compare: Compare,
    pub(super) cells: CellsOverlay,
    /// Of notices and jobs at the last pass, points.
    pub(super) overlays_height: f32,
    /// Annotations that the viewport had no room for at the last pass.
    pub(super) left_out: Vec<Annotation>,
    pub(super) accuracy: AccuracyPanel,
    pub(super) measuring: Measuring,
    pub(super) estimates: EstimateRecord,
    pub(super) shading: ShadingEditor,
    pub(super) clip: ClipEditor,
    pub(super) box_handles: BoxHandles,
    pub(super) slice_handles: SliceHandles,
    pub(super) effects: Effects,
    pub(super) vectors: Vectors,
    pub(super) polygons: Polygons,
    pub(super) flow: Flow,
    pub(super) encode_choice: EncodeChoice,
    pub(super) encoding: Option<Encoding>,
    pub(super) field_colours: Option<FieldColours>,
    /// Reached the engine last.
    pub(super) last_valid_mode: SplatSettings,
    pub(super) file_dialog: Option<FileDialog>,
    pub(super) loading: Option<Loading>,
    /// What was to be opened and could not be: *Open path* begins with it.
    pub(super) unopened: Option<Source>,
    /// The file of another format that was refused last, whose samples may be described all the same.
    pub(super) undescribed: Option<PathBuf>,
    /// Files that were named in a dialog and could not be read or written: the dialog begins with them again.
    pub(super) unfinished: HashMap<Purpose, PathBuf>,
    pub(super) saving: Vec<Job<Saved>>,
    /// Milliseconds of a pixel of the last picture that was drawn in full.
    pub(super) pixel_ms: Option<f64>,
    pub(super) loading_design: Option<LoadingDesign>,
    reported_failure: Option<String>,
    /// Whether something had the keyboard at the end of the last pass.
    pub(super) had_focus: bool,
}

impl Window {
    /// A window with nothing open.
    pub fn new(ctx: &Context, parts: Parts, settings: Settings) -> Self {
        theme::apply(ctx);
        Self {
            viewport: Viewport::new(parts.screen_format),
            parts,
            settings: settings.sanitised(),
            document: None,
            scene: None,
            moving: Moving::default(),
            gaussians: Vec::new(),
            transfer: TransferEditor::default(),
            leveling: Leveling::default(),
            probing: Probing::default(),
            history: History::default(),
            views: History::default(),
            undo_asked_secs: None,
            fitted: None,
            viewport_size: [1, 1],
            room: ([1, 1], false, false),
            viewport_pixels: [0, 0, 1, 1],
            pacing: Pacing::default(),
            rate: PictureRate::default(),
            notices: Notices::default(),
            first_hint: FirstHint::default(),
            dialog: None,
            compare: Compare::default(),
            cells: CellsOverlay::default(),
            overlays_height: 0.0,
            left_out: Vec::new(),
            accuracy: AccuracyPanel::default(),
            measuring: Measuring::default(),
            estimates: EstimateRecord::default(),
            shading: ShadingEditor::default(),
            clip: ClipEditor::default(),
            box_handles: BoxHandles::default(),
            slice_handles: SliceHandles::default(),
            effects: Effects::default(),
            vectors: Vectors::default(),
            polygons: Polygons::default(),
            flow: Flow::default(),
            encode_choice: EncodeChoice::default(),
            encoding: None,
            field_colours: None,
            last_valid_mode: SplatSettings::default(),
            file_dialog: None,
            loading: None,
            unopened: None,
            undescribed: None,
            unfinished: HashMap::new(),
            saving: Vec::new(),
            pixel_ms: None,
            loading_design: None,
            reported_failure: None,
            had_focus: false,
        }
    }

    /// The settings that an earlier window stored.
    pub fn stored_settings(storage: Option<&dyn eframe::Storage>) -> Settings {
        storage.and_then(|s| eframe::get_value(s, SETTINGS_KEY)).unwrap_or_default()
    }

    /// What is to be seen, once something is open.
    pub fn scene(&self) -> Option<&Scene> {
        self.scene.as_ref()
    }

    /// What is open.
    pub fn document(&self) -> Option<&Document> {
        self.document.as_ref()
    }

    /// What is remembered between runs.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What the window has to say.
    pub fn notices(&self) -> &Notices {
        &self.notices
    }

    /// The comparison of two modes.
    pub fn compare(&self) -> &Compare {
        &self.compare
    }

    /// Window and level by hand.
    pub fn leveling(&self) -> &Leveling {
        &self.leveling
    }

    /// What is under the cursor.
    pub fn probing(&self) -> &Probing {
        &self.probing
    }

    /// The octree's cells over the picture.
    pub fn cells(&self) -> &CellsOverlay {
        &self.cells
    }

    /// The accuracy panel's job.
    pub fn measuring(&self) -> &Measuring {
        &self.measuring
    }

    /// How good the estimates of coarse pictures were.
    pub fn estimates(&self) -> &EstimateRecord {
        &self.estimates
    }

    /// Whether something is being read.
    pub fn is_loading(&self) -> bool {
        self.loading.is_some()
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
            Action::Converge => self.converge(),
            Action::ToggleLeveling => self.leveling.on = !self.leveling.on,
            Action::ToggleProbe => self.toggle_probe(ctx),
            Action::EndTools => self.end_tools(ctx),
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
            Action::ToggleCompare => self.toggle_compare(),
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
            Action::AddLight if scene.is_none_or(|scene| scene.volume().is_none()) => {
                Some("There is no volume to be lit: open one first")
            }
            Action::AddLight if lights.is_some_and(|l| l.lights.len() >= MOST_LIGHTS) => {
                Some(NO_MORE_LIGHTS)
            }
            Action::ToggleClipBox | Action::AddClipPlane if scene.is_none() => {
                Some("There is nothing to clip: open a volume first")
            }
            Action::MakeStreamlines | Action::ToggleAnimation if !has_vectors => {
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
        let written = |which: Annotation| self.settings.annotations.has(which);
        Some(match action {
            Action::ToggleProjection => scene.is_some_and(|scene| {
                matches!(scene.camera.projection, Projection::Perspective { .. })
            }),
            Action::ToggleLights => scene.is_some_and(|scene| scene.shading.lighting.is_some()),
            Action::ToggleFade => scene.is_some_and(|scene| scene.inside.is_faded),
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

    fn toggle_compare(&mut self) {
        let Some(scene) = &self.scene else { return };
        self.compare.toggle(&scene.splat, &scene.inside);
        if self.compare.on {
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

    /// Adds something that lies in the volume, whose row is in sight in the side panel then.
    fn add_inside(&mut self, ctx: &Context, add: fn(&mut Scene)) {
        let Some(scene) = &mut self.scene else { return };
        let before = told_of(&scene.inside);
        add(scene);
        self.show_section(ctx, INSIDE);
        self.tell_of_inside(before);
    }

    /// Opens a section of the side panel, and has it scrolled into sight.
    pub(super) fn show_section(&mut self, ctx: &Context, name: &'static str) {
        self.settings.sections.insert(name.to_owned(), true);
        panels::seek(ctx, name);
    }

    /// What follows where slices or isosurfaces were added: a view of everything is one of these, too, and it is said where the volume
    /// was faded for them.
    pub(super) fn tell_of_inside(&mut self, (slices, was_faded): (usize, bool)) {
        let Some(scene) = &self.scene else { return };
        let (now, is_faded) = told_of(&scene.inside);
        let (has_more_slices, is_faded) = (now > slices, is_faded && !was_faded);
        if has_more_slices && let Some(view) = self.unmoved_view() {
            self.fit(view);
        }
        if is_faded {
            let name = if has_more_slices { "slice" } else { "isosurface" };
            self.notices.offer(Action::ShowFaded, faded_for(name));
        }
    }

    fn toggle_clip_box(&mut self, ctx: &Context) {
        if let Some(scene) = &mut self.scene {
            self.clip.toggle_box(scene);
            self.show_section(ctx, CLIP);
        }
    }

    fn toggle_annotation(&mut self, which: Annotation) {
        let switch = self.settings.annotations.switch(which);
        *switch = !*switch;
    }

    fn change_camera(&mut self, change: impl FnOnce(&Camera) -> Camera) {
        if let Some(scene) = &mut self.scene {
            scene.camera = change(&scene.camera);
        }
    }

    /// Which way round things are: as at the first look, with the axis up that was chosen.
    pub(super) fn orientation(&self) -> Orientation {
        let told = self.document.as_ref().map(|document| document.first_look.orientation);
        told.unwrap_or_default().with_up(self.scene.as_ref().and_then(|scene| scene.up))
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

    /// Shows everything along a named view, by the projection that there is.
    pub(super) fn fit(&mut self, view: NamedView) {
        let orientation = self.orientation();
        if let Some(scene) = &mut self.scene {
            let annotations = self.settings.annotations;
            let has_axes = annotations.has(Annotation::Axes);
            let size = beside_bars(annotations, scene, self.viewport_size);
            let framed = camera_control::framed(scene, (view, orientation), size, has_axes);
            scene.camera = framed;
            self.fitted = Some((view, scene.camera));
        }
    }

    /// The view of everything, while nobody has moved it.
    pub(super) fn unmoved_view(&self) -> Option<NamedView> {
        let camera = self.scene.as_ref().map(|scene| scene.camera)?;
        self.fitted.filter(|(_, fitted)| *fitted == camera).map(|(view, _)| view)
    }

    /// Takes note of the viewport's size in physical pixels, and of what annotations leave of it. A view of everything that nobody has
    /// moved stays one, which is no step of the view.
    pub(super) fn resize(&mut self, size: [u32; 2]) {
        self.viewport_size = size;
        let Annotations { axes, scalar_bar, .. } = self.settings.annotations;
        let room = (size, axes, scalar_bar);
        if std::mem::replace(&mut self.room, room) == room {
            return;
        }
        if let Some(view) = self.unmoved_view() {
            self.fit(view);
            self.amend_view();
        }
    }

    /// Takes what jobs, dialogs and the desktop have brought since the last pass.
    fn take_news(&mut self, ctx: &Context) {
        self.take_document(ctx);
        self.take_vectors();
        self.take_surfaces(ctx);
        self.take_flow();
        self.take_encoding();
        self.take_saved();
        self.take_design();
        self.take_clipboard(ctx);
        self.take_chosen_file(ctx);
        self.take_dropped_files(ctx);
        self.take_failure();
        // Of one that is paused there is nothing new to be seen.
        if self.jobs().iter().any(|job| !job.is_paused || job.is_cancelled) {
            ctx.request_repaint_after(PROGRESS_EVERY);
        }
    }

    /// Says once that the engine cannot draw.
    fn take_failure(&mut self) {
        let failure = match self.parts.drawer.state() {
            EngineState::Failed(reason) => Some(reason),
            _ => None,
        };
        if failure != self.reported_failure {
            if let Some(reason) = &failure {
                self.notices.error(reason.clone());
            }
            self.reported_failure = failure;
        }
    }

    /// The jobs to be shown with progress and cancel.
    pub(super) fn jobs(&self) -> Vec<JobView<'_>> {
        let loading = self.loading.iter().map(|loading| JobView::of(&loading.job));
        let meshes = self.polygons.reading.iter().map(JobView::of);
        let made = meshes.chain(self.flow.job.iter().map(JobView::of));
        let made = made.chain(self.encoding.iter().map(|encoding| JobView::of(&encoding.job)));
        loading.chain(self.saving.iter().map(JobView::of)).chain(made).collect()
    }

    fn dialogs_ui(&mut self, ctx: &Context) {
        let Some(mut dialog) = self.dialog.take() else { return };
        let stays = match &mut dialog {
            Dialog::Help => !super::dialogs::help::help_ui(ctx),
            Dialog::About => {
                let engine = self.parts.drawer.adapter_name();
                !super::dialogs::about::about_ui(ctx, engine.as_deref())
            }
            Dialog::Find(find) => match find.show(ctx, &self.findables(ctx)) {
                Outcome::Done(found) => {
                    self.go_to(ctx, found);
                    // What was found may ask for more.
                    return;
                }
                outcome => outcome == Outcome::Open,
            },
            Dialog::OpenPath(open_path) => match open_path.show(ctx) {
                Outcome::Done(Source::File(path)) => {
                    self.open_any(ctx, path);
                    false
                }
                Outcome::Done(source) => {
                    self.open(ctx, source);
                    false
                }
                outcome => outcome == Outcome::Open,
            },
            Dialog::Raw(raw) => match raw.show(ctx, &self.parts.library) {
                Outcome::Done(source) => {
                    self.open(ctx, source);
                    false
                }
                outcome => outcome == Outcome::Open,
            },
            Dialog::NamedFile(named) => match named.show(ctx) {
                Outcome::Done(path) => {
                    self.take_named_file(ctx, named.purpose(), path);
                    false
                }
                outcome => outcome == Outcome::Open,
            },
            Dialog::Save(save) => match save.show(ctx) {
                Outcome::Done(choice) => {
                    self.save_picture(ctx, choice);
                    false
                }
                outcome => outcome == Outcome::Open,
            },
        };
        if stays {
            self.dialog = Some(dialog);
        }
    }

    /// Posts what has changed, and shows what has come.
    fn pace(&mut self, ctx: &Context) {
        self.keep_mode_valid();
        self.pace_refining();
        let Some(scene) = &mut self.scene else { return };
        scene.background = self.settings.scene_background();
        let now_secs = ctx.time();
        let held = ctx.dragged_id().is_some();
        let decision =
            self.pacing.decide(scene, self.viewport_size, &self.settings, now_secs, held);
        self.parts.news.set_moving(self.pacing.is_moving());
        if let Some(secs) = decision.again_in_secs {
            ctx.request_repaint_after(Duration::from_secs_f64(secs));
        }
        let Some(request) = decision.post else { return };
        self.parts.news.forget();
        self.parts.drawer.request(request);
        if self.pacing.is_moving() {
            let news = Arc::clone(&self.parts.news);
            news.wait_for(self.parts.wait_for_picture, || self.take_picture(ctx));
        }
    }

    /// Shows the picture that has come since the last pass; whether one has.
    fn take_picture(&mut self, ctx: &Context) -> bool {
        let Some(picture) = self.parts.drawer.take_picture() else { return false };
        self.rate.note(ctx.time(), self.pacing.is_moving());
        self.record_estimate(&picture);
        self.note_effects(&picture);
        if matches!(picture.report.level, LevelOfDetail::Full { .. }) {
            let pixels = picture.size.iter().map(|n| f64::from(*n)).product::<f64>();
            self.pixel_ms = Some(picture.report.frame_ms / pixels.max(1.0));
        }
        // While the view moves, the picture before would be of another view.
        let fades = self.settings.fade && !self.pacing.is_moving();
        let moved = match fades {
            true => self.viewport.accept_fading(picture, ctx.time()),
            false => self.viewport.accept(picture),
        };
        if moved || fades {
            ctx.request_repaint();
        }
        true
    }

    /// Asks for the octree's cells, and takes those that were found meanwhile.
    fn pace_cells(&mut self, ctx: &Context) {
        let Some(scene) = &self.scene else { return };
        let drawer = &*self.parts.drawer;
        self.cells.pace(drawer, scene, self.viewport_size, self.pacing.is_moving());
        if self.cells.take(drawer) {
            // The pass that is being made has been painted without them.
            ctx.request_repaint();
        }
    }

    /// Runs the commands whose keys were pressed.
    fn take_keys(&mut self, ctx: &Context) {
        // While a dialog asks, keys are its own; only help closes by its own key. Steps go back behind it
        // all the same, where no text is being typed.
        let allowed = |action: &Action| match (&self.dialog, action) {
            (None, _) | (Some(_), Action::Quit | Action::Undo | Action::Redo) => true,
            (Some(Dialog::Help), Action::ToggleHelp) => true,
            (Some(_), _) => false,
        };
        // The desktop's dialog for files may still be on its way: what is typed for it is no command.
        let behind_dialog = self.file_dialog.is_some()
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
}

/// What is told of what lies in the volume, once it changes: how many slices there are, and whether the volume is faded.
pub(super) fn told_of(inside: &Inside) -> (usize, bool) {
    (inside.slices.len(), inside.is_faded)
}

/// A job as its progress bar shows it.
pub(super) struct JobView<'a> {
    pub(super) title: &'a str,
    pub(super) fraction: f32,
    /// Milliseconds that are thought to be left, where that is known.
    pub(super) left_ms: Option<f64>,
    pub(super) cancel: Box<dyn Fn() + 'a>,
    pub(super) is_cancelled: bool,
    pub(super) is_paused: bool,
}

impl<'a> JobView<'a> {
    fn of<T: Send + 'static>(job: &'a Job<T>) -> Self {
        Self {
            title: job.title(),
            fraction: job.fraction(),
            left_ms: job.left_ms(),
            cancel: Box::new(|| job.cancel()),
            is_cancelled: job.is_cancelled(),
            is_paused: job.is_paused(),
        }
    }
}

impl Content for Window {
    fn pass(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        self.take_news(&ctx);
        self.take_picture(&ctx);
        self.cells.take(&*self.parts.drawer);
        self.take_keys(&ctx);
        self.pace_animation(&ctx);
        self.layout_ui(ui);
        self.dialogs_ui(&ctx);
        if let Some(text) = typed::take_refusal(&ctx) {
            self.notices.hint(text);
        }
        self.colour_by_field(&ctx);
        self.pace(&ctx);
        self.record_step(&ctx);
        self.pace_judging(&ctx);
        self.pace_cells(&ctx);
        self.note_focus(&ctx);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, SETTINGS_KEY, &self.settings);
    }
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.pass(ui);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        Content::save(self, storage);
    }

    fn clear_color(&self, _visuals: &eframe::egui::Visuals) -> [f32; 4] {
        // What the panels stand on; the viewport paints itself.
        theme::PANEL.to_normalized_gamma_f32()
    }
}

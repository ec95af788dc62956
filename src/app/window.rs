//! The window's state, and what its commands, jobs and dialogs do to it.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use eframe::egui::{Context, Ui, ViewportCommand};

use super::actions::{self, Action};
use super::camera_control;
use super::cells::CellsOverlay;
use super::clip_box::BoxHandles;
use super::compare::{Compare, Display};
use super::dialogs::Outcome;
use super::dialogs::open_path::OpenPath;
use super::dialogs::raw::RawDialog;
use super::dialogs::save::{SaveChoice, SaveDialog};
use super::dialogs::transfer_file::TransferFileDialog;
use super::document::{Document, Library, ReadFailure, Source};
use super::drawer::Drawer;
use super::effects::Effects;
use super::exchanging::LoadingDesign;
use super::file_dialog::{Answer, FileDialog};
use super::history::History;
use super::job::{Ended, Job};
use super::leveling::Leveling;
use super::measuring::{EstimateRecord, Measuring, StartMeasuring};
use super::notices::Notices;
use super::pacing::{News, Pacing};
use super::panels::accuracy::AccuracyPanel;
use super::panels::clip::ClipEditor;
use super::panels::data::FieldChoice;
use super::panels::shading::ShadingEditor;
use super::panels::transfer::TransferEditor;
use super::probing::Probing;
use super::saving::{self, Renderer, SaveRequest, Saved};
use super::settings::Settings;
use super::theme;
use super::undoing::{State, Wheel};
use super::vectors::Vectors;
use super::viewport::{ScreenFormat, Viewport};
use crate::core::{Camera, Projection};
use crate::scene::{
    self, Annotation, Annotations, Background, Inside, NamedView, Scene, Shading, SplatSettings,
    VectorLayer,
};
use crate::task::annotations::laid_out;
use crate::task::engine::EngineState;
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
    /// What the window's surface holds.
    pub screen_format: ScreenFormat,
    /// Who reads.
    pub library: Arc<dyn Library>,
    /// Who draws pictures to be saved.
    pub renderer: Renderer,
    /// Who measures modes for the accuracy panel.
    pub measure: StartMeasuring,
    /// Asks the person for a file to open.
    pub chooser: Box<dyn Fn(&Context) -> FileDialog>,
    /// Where screenshots go, or one sentence why there is no such place.
    pub pictures_folder: Result<PathBuf, String>,
}

/// A volume being read, or another field of one being made ready.
struct Loading {
    job: Job<Result<Document, ReadFailure>>,
    source: Source,
    /// Another field of what is open: the view stays.
    keep_view: bool,
}

/// The dialog on screen.
pub(super) enum Dialog {
    OpenPath(OpenPath),
    Raw(Box<RawDialog>),
    Save(Box<SaveDialog>),
    Transfer(Box<TransferFileDialog>),
    Help,
}

/// The window.
pub struct Window {
    pub(super) parts: Parts,
    pub(super) settings: Settings,
    pub(super) document: Option<Document>,
    pub(super) scene: Option<Scene>,
    /// The bells that the scene's opacities follow; none where they are points of their own.
    pub(super) gaussians: Vec<Gaussian>,
    pub(super) transfer: TransferEditor,
    pub(super) leveling: Leveling,
    pub(super) probing: Probing,
    pub(super) history: History<State>,
    pub(super) wheel: Wheel,
    pub(super) viewport: Viewport,
    /// The viewport's size in physical pixels at the last pass.
    pub(super) viewport_size: [u32; 2],
    /// The same with its place on the window before it: left, top, width, height.
    pub(super) viewport_pixels: [u32; 4],
    pub(super) pacing: Pacing,
    pub(super) notices: Notices,
    pub(super) dialog: Option<Dialog>,
    pub(super) compare: Compare,
    pub(super) cells: CellsOverlay,
    /// Annotations that the viewport had no room for at the last pass.
    pub(super) left_out: Vec<Annotation>,
    pub(super) accuracy: AccuracyPanel,
    pub(super) measuring: Measuring,
    pub(super) estimates: EstimateRecord,
    pub(super) shading: ShadingEditor,
    pub(super) clip: ClipEditor,
    pub(super) box_handles: BoxHandles,
    pub(super) effects: Effects,
    pub(super) vectors: Vectors,
    /// Reached the engine last.
    pub(super) last_valid_mode: SplatSettings,
    file_dialog: Option<FileDialog>,
    loading: Option<Loading>,
    pub(super) saving: Vec<Job<Saved>>,
    pub(super) loading_design: Option<LoadingDesign>,
    reported_failure: Option<String>,
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
            gaussians: Vec::new(),
            transfer: TransferEditor::default(),
            leveling: Leveling::default(),
            probing: Probing::default(),
            history: History::default(),
            wheel: Wheel::default(),
            viewport_size: [1, 1],
            viewport_pixels: [0, 0, 1, 1],
            pacing: Pacing::default(),
            notices: Notices::default(),
            dialog: None,
            compare: Compare::default(),
            cells: CellsOverlay::default(),
            left_out: Vec::new(),
            accuracy: AccuracyPanel::default(),
            measuring: Measuring::default(),
            estimates: EstimateRecord::default(),
            shading: ShadingEditor::default(),
            clip: ClipEditor::default(),
            box_handles: BoxHandles::default(),
            effects: Effects::default(),
            vectors: Vectors::default(),
            last_valid_mode: SplatSettings::default(),
            file_dialog: None,
            loading: None,
            saving: Vec::new(),
            loading_design: None,
            reported_failure: None,
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

    /// Starts to read a source; what is open stays until it has been read.
    pub fn open(&mut self, ctx: &Context, source: Source) {
        let library = Arc::clone(&self.parts.library);
        let reading = source.clone();
        let job = Job::start("load", format!("Opening {}", source.name()), ctx, move |ticket| {
            Document::read(&*library, reading, ticket)
        });
        self.loading = Some(Loading { job, source, keep_view: false });
    }

    /// Opens the first of several sources, or the first demo for none; the others are remembered.
    pub fn open_all(&mut self, ctx: &Context, sources: Vec<Source>) {
        for other in sources.iter().skip(1).rev() {
            self.remember(other);
        }
        let demo = || Some(Source::Demo(self.parts.library.demos().first()?.0.to_owned()));
        if let Some(first) = sources.first().cloned().or_else(demo) {
            self.open(ctx, first);
        }
    }

    /// Starts to make another field of the open file ready.
    pub(super) fn choose_field(&mut self, ctx: &Context, choice: FieldChoice) {
        let Some(document) = self.document.clone() else { return };
        let source = document.source.clone();
        let job = Job::start("field", "Preparing the field", ctx, move |ticket| {
            document.with_field(choice.field, choice.component, ticket)
        });
        self.loading = Some(Loading { job, source, keep_view: true });
    }

    /// Does what a command says.
    pub(super) fn perform(&mut self, ctx: &Context, action: Action) {
        match action {
            Action::Open => self.file_dialog = Some((self.parts.chooser)(ctx)),
            Action::OpenPath => self.dialog = Some(Dialog::OpenPath(OpenPath::default())),
            Action::RawLayout => self.ask_raw_layout_again(),
            Action::SavePicture => self.ask_to_save(),
            Action::SaveScreenshot => self.save_screenshot(ctx),
            Action::LoadTransfer
            | Action::SaveTransfer
            | Action::CopyTransfer
            | Action::PasteTransfer => self.exchange(ctx, action),
            Action::Quit => ctx.send_viewport_cmd(ViewportCommand::Close),
            Action::Undo => self.step(ctx, true),
            Action::Redo => self.step(ctx, false),
            Action::ViewFront => self.look(NamedView::Front),
            Action::ViewRight => self.look(NamedView::Right),
            Action::ViewTop => self.look(NamedView::Top),
            Action::ViewIsometric => self.look(NamedView::Isometric),
            Action::ToggleProjection => {
                let angle = self.settings.view_angle_deg;
                self.change_camera(|camera| camera_control::with_other_projection(camera, angle));
            }
            Action::ResetView => self.reset_view(),
            Action::Converge => self.converge(),
            Action::ToggleLeveling => self.leveling.on = !self.leveling.on,
            Action::ToggleProbe => self.toggle_probe(ctx),
            Action::ToggleAnimation => self.toggle_animation(ctx),
            Action::ToggleLights => self.toggle_lights(),
            Action::ToggleEffects => self.effects.open = !self.effects.open,
            Action::ToggleScalarBar => self.toggle_annotation(Annotation::ScalarBar),
            Action::ToggleScaleBar => self.toggle_annotation(Annotation::ScaleBar),
            Action::ToggleAxes => self.toggle_annotation(Annotation::Axes),
            Action::ToggleTrihedron => self.toggle_annotation(Annotation::Trihedron),
            Action::ToggleCells => self.cells.on = !self.cells.on,
            Action::ToggleSidePanel => self.settings.side_panel = !self.settings.side_panel,
            Action::ToggleAccuracy => self.accuracy.open = !self.accuracy.open,
            Action::ToggleCompare => {
                if let Some(scene) = &self.scene {
                    self.compare.toggle(&scene.splat);
                }
            }
            Action::ToggleDifference => {
                self.compare.display = match self.compare.display {
                    Display::Split => Display::Difference,
                    Display::Difference => Display::Split,
                };
            }
            Action::ToggleHelp => {
                let shown = matches!(self.dialog, Some(Dialog::Help));
                self.dialog = (!shown).then_some(Dialog::Help);
            }
        }
    }

    fn toggle_probe(&mut self, ctx: &Context) {
        let ctx = ctx.clone();
        if let Err(reason) = self.probing.toggle(move || ctx.request_repaint()) {
            self.notices.error(reason);
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

    fn look(&mut self, view: NamedView) {
        let anterior_y = self.has_anterior_y();
        self.change_camera(|camera| camera_control::turned_to(camera, view, anterior_y));
    }

    fn has_anterior_y(&self) -> bool {
        let space = self.document.as_ref().and_then(|d| d.grid.space.as_deref());
        scene::is_anterior_y(space)
    }

    fn reset_view(&mut self) {
        let (anterior_y, size) = (self.has_anterior_y(), self.viewport_size.map(f64::from));
        if let Some(scene) = &mut self.scene {
            let lattice = &scene.volume.lattice;
            let framed = camera_control::framed(lattice, NamedView::Isometric, anterior_y, size);
            scene.camera = Camera { projection: scene.camera.projection, ..framed };
        }
    }

    /// The scene in which a newly opened document is seen.
    fn show_document(&mut self, ctx: &Context, document: Document, keep_view: bool) {
        let volume = Arc::clone(&document.volume);
        let transfer = self.parts.library.default_transfer(&volume.statistics);
        let before = self.scene.take();
        let before_vectors = before.as_ref().and_then(|scene| scene.vectors.clone());
        let projection =
            before.as_ref().map_or(Projection::Orthographic, |scene| scene.camera.projection);
        let splat = match &before {
            Some(scene) if keep_view => scene.splat,
            // The kernel is a habit; a unit distance belongs to its data.
            Some(scene) => SplatSettings { opacity_unit_distance: None, ..scene.splat },
            None => SplatSettings::default(),
        };
        let shading = match &before {
            Some(scene) if keep_view => scene.shading.clone(),
            // So are the lights; tables belong to their data.
            Some(scene) => {
                Shading { lighting: scene.shading.lighting.clone(), ..Shading::default() }
            }
            None => Shading::default(),
        };
        // What was cut away of another volume is not of this one.
        let inside = match &before {
            Some(scene) if keep_view => scene.inside.clone(),
            _ => Inside::default(),
        };
        let space = document.grid.space.as_deref();
        let framed = camera_control::framed(
            &volume.lattice,
            NamedView::Isometric,
            scene::is_anterior_y(space),
            self.viewport_size.map(f64::from),
        );
        let camera = match before {
            Some(scene) if keep_view => scene.camera,
            _ => Camera { projection, ..framed },
        };
        let background = self.settings.scene_background();
        let vectors = match (&document.vectors, before_vectors) {
            (_, Some(layer)) if keep_view => Some(layer),
            (Some(field), _) => Some(VectorLayer::new(Arc::clone(field), true)),
            (None, _) => None,
        };
        if !keep_view {
            self.vectors = Vectors::default();
        }
        self.scene =
            Some(Scene { volume, transfer, splat, shading, inside, vectors, camera, background });
        self.gaussians.clear();
        self.transfer.start_over();
        self.shading.start_over();
        self.clip.start_over();
        let title = format!("{} – Voxsplat", document.source.name());
        ctx.send_viewport_cmd(ViewportCommand::Title(title));
        for warning in &document.warnings {
            self.notices.note(warning.clone());
        }
        self.document = Some(document);
        if !keep_view {
            self.forget_steps();
        }
    }

    /// Takes what jobs, dialogs and the desktop have brought since the last pass.
    fn take_news(&mut self, ctx: &Context) {
        self.take_document(ctx);
        self.take_vectors();
        self.take_saved();
        self.take_design();
        self.take_clipboard(ctx);
        self.take_chosen_file(ctx);
        self.take_dropped_files(ctx);
        self.take_failure();
        if self.loading.is_some() || !self.saving.is_empty() {
            ctx.request_repaint_after(PROGRESS_EVERY);
        }
    }

    fn take_document(&mut self, ctx: &Context) {
        let Some(ended) = self.loading.as_ref().and_then(|loading| loading.job.poll()) else {
            return;
        };
        let Some(loading) = self.loading.take() else { return };
        match ended {
            // A cancel that came too late still is one.
            _ if loading.job.is_cancelled() => {}
            Ended::Finished(Ok(document)) => {
                if !loading.keep_view {
                    self.notices.clear();
                    self.remember(&loading.source);
                }
                self.show_document(ctx, document, loading.keep_view);
            }
            Ended::Finished(Err(ReadFailure::Cancelled)) => {}
            Ended::Finished(Err(ReadFailure::Refused(reason))) => self.notices.error(reason),
            Ended::Finished(Err(ReadFailure::NotRecognised(reason))) => {
                match loading.source.path() {
                    Some(path) => self.ask_raw_layout(path, None, Some(reason)),
                    None => self.notices.error(reason),
                }
            }
            Ended::Lost => {
                let name = loading.source.name();
                self.notices.error(format!("Reading stopped on a bug of the program: {name}"));
            }
        }
    }

    fn remember(&mut self, source: &Source) {
        if let Some(path) = source.path() {
            let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
            self.settings.remember(path);
        }
    }

    fn take_saved(&mut self) {
        let notices = &mut self.notices;
        self.saving.retain(|job| {
            let Some(ended) = job.poll() else { return true };
            match ended {
                _ if job.is_cancelled() => {}
                Ended::Finished(Ok(path)) => notices.hint(format!("Saved {}", path.display())),
                Ended::Finished(Err(reason)) => notices.error(reason),
                Ended::Lost => notices.error("Saving stopped on a bug of the program"),
            }
            false
        });
    }

    fn take_chosen_file(&mut self, ctx: &Context) {
        let Some(answer) = self.file_dialog.as_ref().and_then(FileDialog::poll) else { return };
        self.file_dialog = None;
        match answer {
            Answer::Chosen(path) => self.open_any(ctx, path),
            Answer::Cancelled => {}
            Answer::Unavailable => {
                self.notices.error(
                    "The file dialog could not open because no desktop portal answered; \
                     type the path, or drop the file on the window",
                );
                self.dialog = Some(Dialog::OpenPath(OpenPath::default()));
            }
        }
    }

    fn take_dropped_files(&mut self, ctx: &Context) {
        let dropped: Vec<PathBuf> = ctx.input(|input| {
            input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect()
        });
        if let Some(path) = dropped.first() {
            if dropped.len() > 1 {
                let more = dropped.len() - 1;
                self.notices.hint(format!("One file opens at a time; {more} more were left out"));
            }
            self.open_any(ctx, path.clone());
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

    fn ask_raw_layout(
        &mut self,
        path: &Path,
        layout: Option<super::document::RawLayout>,
        reason: Option<String>,
    ) {
        match RawDialog::new(&*self.parts.library, path, layout, reason) {
            Ok(dialog) => self.dialog = Some(Dialog::Raw(Box::new(dialog))),
            Err(reason) => self.notices.error(reason),
        }
    }

    fn ask_raw_layout_again(&mut self) {
        let source = self.document.as_ref().map(|document| document.source.clone());
        match source {
            Some(Source::Raw(path, layout)) => self.ask_raw_layout(&path, Some(layout), None),
            Some(Source::File(path)) => self.ask_raw_layout(&path, None, None),
            Some(Source::Demo(_)) | None => {
                self.notices.hint("Only a file has a layout to describe: open one first");
            }
        }
    }

    fn ask_to_save(&mut self) {
        let (Some(document), Some(scene)) = (&self.document, &self.scene) else {
            self.notices.hint("There is no picture to save yet: open a volume first");
            return;
        };
        let folder = self.parts.pictures_folder.clone().unwrap_or_default();
        let path = saving::suggested_path(&folder, &document.source.name());
        let with_background = scene.background != Background::Transparent;
        let is_annotated = self.settings.annotations.any();
        let dialog = SaveDialog::new(self.viewport_size, with_background, is_annotated, &path);
        self.dialog = Some(Dialog::Save(Box::new(dialog)));
    }

    /// Asks for the file of a loop of the animation.
    pub(super) fn ask_to_save_loop(&mut self) {
        let (Some(document), Some(scene)) = (&self.document, &self.scene) else { return };
        let folder = self.parts.pictures_folder.clone().unwrap_or_default();
        let path = saving::suggested_path(&folder, &document.source.name()).with_extension("gif");
        let with_background = scene.background != Background::Transparent;
        let is_annotated = self.settings.annotations.any();
        let size = self.viewport_size;
        let dialog = SaveDialog::of_cycle(size, with_background, is_annotated, &path);
        self.dialog = Some(Dialog::Save(Box::new(dialog)));
    }

    fn save_picture(&mut self, ctx: &Context, choice: SaveChoice) {
        let Some(mut scene) = self.scene.clone() else { return };
        // What is saved is what is seen.
        scene.splat = self.shown_mode(&scene);
        if scene.lacks_slabs_for_vectors() {
            scene.vectors = None;
        }
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
        let request = SaveRequest { scene, size, annotations, space, path, cycle };
        self.saving.push(saving::save_picture(ctx, &self.parts.renderer, request));
    }

    fn save_screenshot(&mut self, ctx: &Context) {
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

    /// The jobs to be shown with progress and cancel.
    pub(super) fn jobs(&self) -> Vec<JobView<'_>> {
        let loading = self.loading.iter().map(|loading| JobView::of(&loading.job));
        loading.chain(self.saving.iter().map(JobView::of)).collect()
    }

    fn dialogs_ui(&mut self, ctx: &Context) {
        let Some(mut dialog) = self.dialog.take() else { return };
        let stays = match &mut dialog {
            Dialog::Help => !super::dialogs::help::help_ui(ctx),
            Dialog::OpenPath(open_path) => match open_path.show(ctx) {
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
            Dialog::Transfer(transfer) => match transfer.show(ctx) {
                Outcome::Done(path) => {
                    self.take_transfer_path(ctx, transfer.is_saving(), path);
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
        // The panel says so.
        let without =
            scene.lacks_slabs_for_vectors().then(|| Scene { vectors: None, ..scene.clone() });
        let scene = without.as_ref().unwrap_or(scene);
        let decision =
            self.pacing.decide(scene, self.viewport_size, &self.settings, now_secs, held);
        self.parts.news.set_moving(self.pacing.is_moving());
        if let Some(secs) = decision.again_in_secs {
            ctx.request_repaint_after(Duration::from_secs_f64(secs));
        }
        let Some(request) = decision.post else { return };
        self.parts.news.forget();
        self.parts.drawer.request(request);
        if self.pacing.is_moving() && self.parts.news.wait(self.parts.wait_for_picture) {
            self.take_picture(ctx);
        }
    }

    fn take_picture(&mut self, ctx: &Context) {
        let Some(picture) = self.parts.drawer.take_picture() else { return };
        self.record_estimate(&picture);
        self.note_effects(&picture);
        // While the view moves, the picture before would be of another view.
        let fades = self.settings.fade && !self.pacing.is_moving();
        let moved = match fades {
            true => self.viewport.accept_fading(picture, ctx.time()),
            false => self.viewport.accept(picture),
        };
        if moved || fades {
            ctx.request_repaint();
        }
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
        // While a dialog asks, keys are its own; only help closes by its own key.
        let allowed = |action: &Action| match &self.dialog {
            None => true,
            Some(Dialog::Help) => matches!(action, Action::ToggleHelp | Action::Quit),
            Some(_) => *action == Action::Quit,
        };
        let pressed: Vec<Action> = actions::pressed(ctx).into_iter().filter(allowed).collect();
        for action in pressed {
            self.perform(ctx, action);
        }
    }
}

/// A job as its progress bar shows it.
pub(super) struct JobView<'a> {
    pub(super) title: &'a str,
    pub(super) fraction: f32,
    pub(super) cancel: Box<dyn Fn() + 'a>,
    pub(super) is_cancelled: bool,
}

impl<'a> JobView<'a> {
    fn of<T: Send + 'static>(job: &'a Job<T>) -> Self {
        Self {
            title: job.title(),
            fraction: job.fraction(),
            cancel: Box::new(|| job.cancel()),
            is_cancelled: job.is_cancelled(),
        }
    }
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.take_news(&ctx);
        self.take_picture(&ctx);
        self.cells.take(&*self.parts.drawer);
        self.take_keys(&ctx);
        self.pace_animation(&ctx);
        self.layout_ui(ui);
        self.dialogs_ui(&ctx);
        self.pace(&ctx);
        self.record_step(&ctx);
        self.pace_judging(&ctx);
        self.pace_cells(&ctx);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, SETTINGS_KEY, &self.settings);
    }

    fn clear_color(&self, _visuals: &eframe::egui::Visuals) -> [f32; 4] {
        // What the panels stand on; the viewport paints itself.
        theme::PANEL.to_normalized_gamma_f32()
    }
}

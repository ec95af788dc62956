//! The window's state, and what its commands, jobs and dialogs do to it.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use eframe::egui::{Context, Ui};

use super::Content;
use super::cells::CellsOverlay;
use super::clip_box::BoxHandles;
use super::compare::Compare;
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
use super::flow::Flow;
use super::history::History;
use super::job::Job;
use super::leveling::Leveling;
use super::measuring::{EstimateRecord, Measuring, StartMeasuring};
use super::notices::Notices;
use super::opening::Loading;
use super::pacing::{News, Pacing};
use super::panels::accuracy::AccuracyPanel;
use super::panels::clip::ClipEditor;
use super::panels::shading::ShadingEditor;
use super::panels::transfer::TransferEditor;
use super::panels::typed;
use super::plane_handles::PlaneHandles;
use super::polygons::Polygons;
use super::probing::Probing;
use super::rate::PictureRate;
use super::saving::{Renderer, Saved};
use super::settings::Settings;
use super::theme;
use super::undoing::State;
use super::vectors::Vectors;
use super::viewport::{ScreenFormat, Viewport};
use crate::core::Camera;
use crate::scene::{Annotation, Moving, NamedView, Orientation, Scene, SplatSettings};
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
    pub(super) room: ([u32; 2], bool, bool),
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
    pub(super) plane_handles: PlaneHandles,
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
            plane_handles: PlaneHandles::default(),
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

    /// Which way round things are: as at the first look, with the axis up that was chosen.
    pub(super) fn orientation(&self) -> Orientation {
        let told = self.document.as_ref().map(|document| document.first_look.orientation);
        told.unwrap_or_default().with_up(self.scene.as_ref().and_then(|scene| scene.up))
    }

    /// Takes what jobs, dialogs and the desktop have brought since the last pass.
    fn take_news(&mut self, ctx: &Context) {
        self.take_document(ctx);
        self.take_vectors(ctx);
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
        if matches!(picture.report.level, LevelOfDetail::Full { .. } | LevelOfDetail::Refined(_)) {
            let pixels = picture.size.iter().map(|n| f64::from(*n)).product::<f64>();
            let ms = picture.report.frame_ms + picture.report.smoothed_ms.unwrap_or(0.0);
            self.pixel_ms = Some(ms / pixels.max(1.0));
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

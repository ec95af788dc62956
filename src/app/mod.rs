//! The window: panels, dialogs and keys over one picture that follows the hand.
//!
//! Owns everything that is seen and touched. Refuses drawing and reading: it posts requests to the
//! engine and jobs to the readers, and shows what comes back. Nothing here waits for either longer
//! than a blink. Called by `main` only.

pub mod actions;
pub mod annotations;
pub mod camera_control;
pub mod cells;
pub mod clip_box;
mod commands;
pub mod compare;
pub mod dialogs;
mod display;
pub mod document;
pub mod drawer;
mod effect_rows;
pub mod effects;
pub mod encoding;
mod exchanging;
mod field_colours;
pub mod file_dialog;
mod finding;
mod first_hint;
mod fitting;
pub mod flow;
pub mod history;
pub mod job;
mod judging;
mod layout;
pub mod leveling;
pub mod measuring;
pub mod modes;
pub mod notices;
mod opening;
pub mod pacing;
mod painting;
pub mod panels;
mod picture_saving;
mod plane_handles;
mod polygons;
pub mod probing;
mod rate;
pub mod reading;
mod refining;
pub mod saving;
mod sentences;
pub mod settings;
pub mod software;
pub mod sweeping;
pub mod theme;
mod tools;
pub mod trace;
mod trihedron;
mod undoing;
mod vectors;
pub mod viewport;
mod window;
pub mod words;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::anyhow;
use eframe::egui::{self, Context, Ui, ViewportBuilder};
use eframe::{NativeOptions, egui_wgpu};

use crate::core::memory::free_bytes;
use crate::scene::Moving;
use crate::task::engine::{Choice, Engine};
use crate::task::sweep::exact_truth;
use document::Source;
use file_dialog::FileDialog;
use pacing::{News, WAIT_FOR_PICTURE};
use reading::Files;
use trace::Traced;
use viewport::ScreenFormat;
pub use window::{Parts, Window};

/// The name by which the desktop knows the window, and the folder of its settings.
const APP_ID: &str = "voxsplat";
/// Size of the window before anyone resizes it, points.
const WINDOW_SIZE: [f32; 2] = [1280.0, 800.0];
/// Below this the panels do not fit, points.
const LEAST_SIZE: [f32; 2] = [640.0, 420.0];

/// What the window starts with.
#[derive(Debug, Clone)]
pub struct Options {
    /// What to open, the first at once; the others wait among the recent files.
    pub sources: Vec<Source>,
    /// What to draw with.
    pub engine: Choice,
    /// What to draw while the view moves.
    pub moving: Moving,
    /// Where to write down what was shown when; see [`trace`].
    pub trace: Option<PathBuf>,
}

/// What a window shows, whoever paints it.
trait Content {
    /// One pass of the interface.
    fn pass(&mut self, ui: &mut Ui);

    /// Puts what is remembered between runs into the storage.
    fn save(&mut self, storage: &mut dyn eframe::Storage);
}

/// The same, where an adapter paints it.
struct OnAdapter(Box<dyn Content>);

impl eframe::App for OnAdapter {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.0.pass(ui);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        self.0.save(storage);
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        // What the panels stand on; the viewport paints itself.
        theme::PANEL.to_normalized_gamma_f32()
    }
}

/// Opens the window and returns when it is closed. A graphics processor paints it where there is one, or where the
/// engine is asked to be one; the processor does otherwise.
///
/// # Errors
/// Where there is no display, or nothing that can draw a window.
pub fn run(options: Options) -> anyhow::Result<()> {
    let viewport = ViewportBuilder::default()
        .with_app_id(APP_ID)
        .with_title("Voxsplat")
        .with_inner_size(WINDOW_SIZE)
        .with_min_inner_size(LEAST_SIZE)
        .with_drag_and_drop(true);
    let Options { sources, engine, moving, trace } = options;
    let trace = trace.map(|path| trace::create(&path)).transpose()?;
    let by_adapter = engine.wants_adapter();
    let content = move |ctx: &Context, storage: Option<&dyn eframe::Storage>, screen_format| {
        let settings = Window::stored_settings(storage);
        let mut window = Window::new(ctx, parts(ctx, engine, screen_format), settings);
        window.moving = moving;
        window.open_all(ctx, sources);
        let content: Box<dyn Content> = match trace {
            None => Box::new(window),
            Some(file) => Box::new(Traced::new(window, file)),
        };
        content
    };
    if !by_adapter {
        return software::run(viewport, Box::new(|ctx, storage| content(ctx, storage, None)));
    }
    let native = NativeOptions {
        viewport,
        wgpu_options: egui_wgpu::WgpuConfiguration::default()
            .with_surface_config(egui_wgpu::SurfaceConfig::LOW_LATENCY),
        // The picture's bytes are to reach the screen as they are.
        dithering: false,
        event_loop_builder: Some(Box::new(display::choose)),
        ..NativeOptions::default()
    };
    let create = |creation: &eframe::CreationContext<'_>| {
        let screen = creation.wgpu_render_state.as_ref();
        // Built with wgpu alone, it always has one.
        let format = screen.map_or(ScreenFormat::Rgba8Unorm, |state| state.target_format);
        let content = content(&creation.egui_ctx, creation.storage, Some(format));
        let app: Box<dyn eframe::App> = Box::new(OnAdapter(content));
        Ok(app)
    };
    eframe::run_native("Voxsplat", native, Box::new(create)).map_err(|error| match error {
        // Its own words are places in its source.
        eframe::Error::WinitEventLoop(_) => anyhow!(
            "expected a display to open a window on, found none that answers; try `voxsplat render`, which needs none"
        ),
        eframe::Error::Wgpu(_) => anyhow!(
            "expected a graphics driver to paint the window with, found none that answers; install one (on Debian and \
             Ubuntu: mesa-vulkan-drivers), or try `--engine native`, which needs none"
        ),
        error => anyhow!(
            "expected a display to open a window on, found that {error}; try `voxsplat render`, which needs none"
        ),
    })
}

/// One in so many of the free bytes may be held for steps back to other volumes: little enough to leave
/// room for the next file.
const PART_FOR_STEPS: u64 = 8;

/// The real engine, readers and dialogs.
fn parts(ctx: &Context, choice: Choice, screen_format: Option<ScreenFormat>) -> Parts {
    let news = Arc::new(News::new(ctx));
    let announced = Arc::clone(&news);
    Parts {
        drawer: Box::new(Engine::start(choice.clone(), move || announced.announce())),
        news,
        wait_for_picture: WAIT_FOR_PICTURE,
        screen_format,
        library: Arc::new(Files),
        renderer: saving::engine_renderer(choice.clone()),
        measure: sweeping::engine_measurer(choice, exact_truth),
        bytes_for_steps: Box::new(|| free_bytes() / PART_FOR_STEPS),
        chooser: Box::new(FileDialog::open),
        pictures_folder: saving::pictures_folder(),
    }
}

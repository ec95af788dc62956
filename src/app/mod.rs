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
pub mod compare;
pub mod dialogs;
pub mod document;
pub mod drawer;
mod effect_rows;
pub mod effects;
mod exchanging;
pub mod file_dialog;
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
mod polygons;
pub mod probing;
pub mod reading;
mod refining;
pub mod saving;
mod sentences;
pub mod settings;
pub mod sweeping;
pub mod theme;
mod tools;
pub mod trace;
mod undoing;
mod vectors;
pub mod viewport;
mod window;
pub mod words;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::anyhow;
use eframe::egui::{Context, ViewportBuilder};
use eframe::{NativeOptions, egui_wgpu};

use crate::core::memory::free_bytes;
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
    /// Where to write down what was shown when; see [`trace`].
    pub trace: Option<PathBuf>,
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// Where there is no display, or nothing that can draw a window.
pub fn run(options: Options) -> anyhow::Result<()> {
    let native = NativeOptions {
        viewport: ViewportBuilder::default()
            .with_app_id(APP_ID)
            .with_title("Voxsplat")
            .with_inner_size(WINDOW_SIZE)
            .with_min_inner_size(LEAST_SIZE)
            .with_drag_and_drop(true),
        wgpu_options: egui_wgpu::WgpuConfiguration::default()
            .with_surface_config(egui_wgpu::SurfaceConfig::LOW_LATENCY),
        // The picture's bytes are to reach the screen as they are.
        dithering: false,
        ..NativeOptions::default()
    };
    let trace = options.trace.map(|path| trace::create(&path)).transpose()?;
    let create = |creation: &eframe::CreationContext<'_>| {
        let ctx = &creation.egui_ctx;
        let settings = Window::stored_settings(creation.storage);
        let screen = creation.wgpu_render_state.as_ref();
        let screen_format = screen.map(|state| state.target_format);
        let parts = parts(ctx, options.engine, screen_format);
        let mut window = Window::new(ctx, parts, settings);
        window.open_all(ctx, options.sources);
        let app: Box<dyn eframe::App> = match trace {
            None => Box::new(window),
            Some(file) => Box::new(Traced::new(window, file)),
        };
        Ok(app)
    };
    eframe::run_native("Voxsplat", native, Box::new(create)).map_err(|error| match error {
        // Its own words are places in its source.
        eframe::Error::WinitEventLoop(_) => anyhow!(
            "expected a display to open a window on, found none that answers; try `voxsplat render`, which needs none"
        ),
        eframe::Error::Wgpu(_) => anyhow!(
            "expected a graphics driver to paint the window with, found none that answers; install one (on Debian and \
             Ubuntu: mesa-vulkan-drivers), or try `voxsplat render`, which needs none"
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
        // Built with wgpu alone, the window always has one.
        screen_format: screen_format.unwrap_or(ScreenFormat::Rgba8Unorm),
        library: Arc::new(Files),
        renderer: saving::engine_renderer(choice.clone()),
        measure: sweeping::engine_measurer(choice, exact_truth),
        bytes_for_steps: Box::new(|| free_bytes() / PART_FOR_STEPS),
        chooser: Box::new(FileDialog::open),
        pictures_folder: saving::pictures_folder(),
    }
}

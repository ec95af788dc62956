//! The drawing service: its own thread, its own device, latest request wins.
//!
//! The window and `render` use the same service. A caller posts a [`FrameRequest`]; whatever was
//! being drawn is dropped at its next piece. Pictures come back through [`Engine::take_picture`],
//! announced by the `wake` callback.

use std::sync::Arc;

use crate::scene::Scene;

/// What to draw until the next request.
#[derive(Debug, Clone)]
pub struct FrameRequest {
    /// What is to be seen.
    pub scene: Scene,
    /// Picture size in physical pixels, each at least 1.
    pub size: [u32; 2],
    /// How far to go.
    pub effort: Effort,
}

/// How far a request is to be refined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Effort {
    /// The view is moving: one picture, the best that fits the budget.
    Moving {
        /// Milliseconds a picture may take.
        budget_ms: f64,
    },
    /// The view rests: climb the ladder to `full`, then stop.
    Rest {
        /// Milliseconds that the first rung may take.
        budget_ms: f64,
        /// The way up.
        ladder: Ladder,
        /// Publish the picture while its last rung is still being drawn.
        show_partial: bool,
    },
}

/// Ways of successive refinement; every one ends in `full`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ladder {
    /// Octree cuts of falling error (Laur–Hanrahan).
    #[default]
    Octree,
    /// Every fourth, every second, every sample (Westover).
    Subsampling,
    /// Points, boxes, then the chosen kernel (Westover).
    CheaperKernels,
}

/// A finished (or partial) picture and what it is.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Size of `rgba` in pixels: the request's size, or less for a coarse picture that the
    /// viewer is to enlarge.
    pub size: [u32; 2],
    /// The size that was asked for.
    pub requested_size: [u32; 2],
    /// sRGB bytes with straight alpha, rows from the top, background composited.
    pub rgba: Vec<u8>,
    /// What is on it, for the status line.
    pub report: FrameReport,
}

/// What a picture shows and what it cost.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameReport {
    /// `coarse`, `octree`, `subsampled`, `full`, … in words for people.
    pub rung: String,
    /// Kernels on the picture.
    pub kernels_drawn: u64,
    /// Kernels that `full` draws: the voxels with opacity.
    pub kernels_active: u64,
    /// Voxels in the volume.
    pub kernels_total: u64,
    /// Wall milliseconds from camera set to queue finished.
    pub frame_ms: f64,
    /// Share of the way to `full`, 0..=1; 1 once nothing more will be drawn.
    pub progress: f32,
}

/// What the engine is doing, for the status line.
#[derive(Debug, Clone, PartialEq)]
pub enum EngineState {
    /// No device yet.
    Starting,
    /// Nothing to do.
    Idle,
    /// Drawing; the share done of the rung under way, 0..=1.
    Drawing(f32),
    /// It cannot draw; one sentence for people.
    Failed(String),
}

/// The caller's end of the service. Dropping it stops the thread.
#[derive(Debug)]
pub struct Engine {}

impl Engine {
    /// Starts the thread; the device is made there. `wake` is called from it whenever
    /// [`Engine::take_picture`] or [`Engine::state`] have news.
    pub fn start(_adapter: AdapterChoice, _wake: impl Fn() + Send + 'static) -> Self {
        Self {}
    }

    /// Replaces whatever was asked for before. Never blocks.
    pub fn request(&self, _request: FrameRequest) {}

    /// The newest picture not yet taken, if any. Never blocks.
    pub fn take_picture(&self) -> Option<Arc<Picture>> {
        None
    }

    /// What the engine is doing now. Never blocks.
    pub fn state(&self) -> EngineState {
        EngineState::Starting
    }

    /// The adapter's name, once there is one.
    pub fn adapter_name(&self) -> Option<String> {
        None
    }
}

/// Which adapter to draw with.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum AdapterChoice {
    /// The fastest there is.
    #[default]
    Auto,
    /// A CPU adapter.
    Software,
    /// The first whose name contains this, ignoring case.
    Named(String),
}

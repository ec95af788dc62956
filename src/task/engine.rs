//! The drawing service: its own thread, its own device, latest request wins.
//!
//! The window and `render` use the same service. A caller posts a [`FrameRequest`]; whatever was
//! being drawn is dropped at its next piece. Pictures come back through [`Engine::take_picture`],
//! announced by the `wake` callback.

mod cells;
mod converge;
mod next;
mod remaining;
mod report;
mod rungs;
mod second;
mod watch;
mod worker;

pub use cells::{CellsRequest, FoundCells, MOST_CELLS};
pub use second::{SecondPicture, SecondRequest};

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread::JoinHandle;

use serde::Serialize;

pub use crate::gpu::{AdapterChoice, OctreeBuilder};

use super::cuts::BrickSource;
pub use super::engines::{Choice, EngineChoice, EngineKind};
use super::estimate::Checked;
use super::level::LevelOfDetail;
use super::remaining::{Told, WITHIN_DB};
use super::still::{Convergence, Still, StillError, StillRequest};
use crate::core::Ticket;
use crate::gpu::{GpuError, Renderer, Wishes};
use crate::kernel::Kernel;
use crate::plan::Plan;
use crate::scene::{Backend, Effect, Scene};
use worker::Worker;

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

impl FrameRequest {
    /// The finished picture that it asks for.
    pub fn plan(&self) -> Plan {
        Plan::of(&self.scene, self.size)
    }
}

/// How far a request is to be refined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Effort {
    /// The view is moving: one picture, the best that fits the budget.
    Moving {
        /// Milliseconds a picture may take.
        budget_ms: f64,
    },
    /// The view rests: climb the ladder to `full`, double the slabs as far as time allows, then
    /// stop.
    Rest {
        /// Milliseconds that the first rung may take.
        budget_ms: f64,
        /// The way up.
        ladder: Ladder,
        /// Publish the picture while its last rung is still being drawn.
        show_partial: bool,
        /// Milliseconds that doubling the slabs after `full` may take; 0 ends in `full`. A
        /// doubling is begun where it is thought to be done in that time.
        converge_ms: f64,
        /// Smooth what ends within a pixel in the last picture (see [`super::smooth`]).
        smooth_edges: bool,
    },
}

/// Ways of successive refinement up to `full`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ladder {
    /// Octree cuts of falling error (Laur–Hanrahan).
    #[default]
    Octree,
    /// Every fourth, every second, every sample (Westover).
    Subsampling,
    /// Points, boxes, then the chosen kernel (Westover).
    CheaperKernels,
    /// Nothing before `full`.
    AtOnce,
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

impl Picture {
    /// How many times smaller it is than what it is shown at, ≥ 1.
    pub fn shrink(&self) -> f64 {
        (f64::from(self.requested_size[1]) / f64::from(self.size[1].max(1))).max(1.0)
    }
}

/// How many kernels a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct KernelCounts {
    /// Kernels on the picture.
    pub drawn: u64,
    /// Kernels that `full` draws: the voxels with opacity.
    pub active: u64,
}

/// What a picture shows and what it cost.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameReport {
    /// To what level it was drawn.
    pub level: LevelOfDetail,
    /// Kernels on the picture; `None` where nobody has counted: a preview in the scene's own mode
    /// needs no hierarchy, and waits for none.
    pub kernels: Option<KernelCounts>,
    /// Splats on a picture of vectors alone; of one in part nobody counts them, and it is 0.
    pub vector_splats: Option<u64>,
    /// What the picture is of in the place of samples, where it is, and how many there are.
    pub own_kernels: Option<(Kernel, u64)>,
    /// Of basis functions, how many are left out everywhere, and what these are thought to be, rms; `None` where none may be.
    pub left_out_functions: Option<(u64, f64)>,
    /// The same of quick pictures, where these are of functions.
    pub left_out_of_quick: Option<(u64, f64)>,
    /// Voxels in the volume.
    pub kernels_total: u64,
    /// Which engine drew it.
    pub engine: EngineKind,
    /// What the native engine does not draw of it, where that was to draw.
    pub not_native: Option<String>,
    /// Which of the native engine's loops drew it, where one did.
    pub native_loop: Option<&'static str>,
    /// What drew it.
    pub backend: Backend,
    /// Wall milliseconds from camera set to queue finished.
    pub frame_ms: f64,
    /// Milliseconds that it was to take, where it was fitted to a time.
    pub budget_ms: Option<f64>,
    /// What is known of the picture that comes after a coarse one.
    pub next: Option<Next>,
    /// Share of the whole way, 0..=1; 1 once nothing more will be drawn.
    pub progress: f32,
    /// What a coarse picture is thought to be off by: RMSE to `full` in linear light.
    pub estimated_rmse: Option<f64>,
    /// What the last picture of a view is off by, measured once it is there (see `task::remaining`): RMSE in linear light
    /// to the converged picture, or of modes without slabs to that of the exact mode.
    pub remaining_rmse: Option<f64>,
    /// What that may be off by, dB.
    pub remaining_within_db: f64,
    /// What is thought of it until then; on a coarse picture, of the full one that it is on the way to.
    pub remaining_thought: Option<Told>,
    /// On `full` and the finer ones after it: what the coarse picture of the same view was thought to be
    /// off by, and was.
    pub checked: Option<Checked>,
    /// From `full` on: how far slabs were doubled, where they can be and that is wanted.
    pub refined: Option<Refined>,
    /// What smoothing its edges took beyond that, milliseconds; `None` where they are as they were drawn.
    pub smoothed_ms: Option<f64>,
    /// What of [`Scene::effects`] it shows: nothing where kernels are coloured first.
    pub effects: Vec<Effect>,
    /// What was held on the device when it was finished, where somebody looked.
    pub held: Option<HeldBytes>,
    /// Pipelines of slabs were made for it: the next such picture takes less.
    pub made_pipelines: bool,
    /// A quick picture that might have been of a cut of its field, which was still being looked for.
    pub awaits_cut: bool,
    /// Who built the octree that was there, where one was.
    pub octree: Option<OctreeBuilder>,
}

/// Bytes on the device, as this program allocates them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct HeldBytes {
    /// All of them.
    pub all: u64,
    /// Of them, those of lights and shading tables.
    pub shading: u64,
    /// And those of what lets the inside be seen.
    pub inside: u64,
    /// And those of vectors, with the lists of where they lie.
    pub vectors: u64,
    /// And those of polygons, with the lists of where they are met.
    pub polygons: u64,
}

impl HeldBytes {
    /// What is held on the device now.
    pub(super) fn of(renderer: &Renderer) -> Self {
        Self {
            all: renderer.size_bytes(),
            shading: renderer.shading_bytes(),
            // It is among the constants that slabs have anyway.
            inside: 0,
            vectors: renderer.vector_bytes(),
            polygons: renderer.polygon_bytes(),
        }
    }
}

impl FrameReport {
    /// Of a picture after which nothing follows, of a volume of so many voxels.
    pub(crate) fn last(level: LevelOfDetail, voxels: u64, backend: Backend, frame_ms: f64) -> Self {
        Self {
            level,
            kernels: None,
            vector_splats: None,
            own_kernels: None,
            left_out_functions: None,
            left_out_of_quick: None,
            kernels_total: voxels,
            engine: EngineKind::default(),
            not_native: None,
            native_loop: None,
            backend,
            frame_ms,
            budget_ms: None,
            next: None,
            progress: 1.0,
            estimated_rmse: None,
            remaining_rmse: None,
            remaining_within_db: WITHIN_DB,
            remaining_thought: None,
            checked: None,
            refined: None,
            smoothed_ms: None,
            effects: Vec::new(),
            held: None,
            made_pipelines: false,
            awaits_cut: false,
            octree: None,
        }
    }
}

/// The picture after a coarse one, as far as it is known before it is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Next {
    /// Whether it is `full`.
    pub is_full: bool,
    /// What it is thought to take, milliseconds.
    pub ms: f64,
    /// What it is thought to be off by: RMSE to `full` in linear light.
    pub rmse: Option<f64>,
}

/// How far the slabs of a picture were doubled, and what is left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refined {
    /// Slabs of this picture, and its difference from the one with half as many.
    pub convergence: Convergence,
    /// What the rest of the way to `converged` is thought to take, milliseconds; 0 where there is
    /// none.
    pub left_ms: f64,
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
pub struct Engine {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// What both ends see.
#[derive(Debug)]
struct Shared {
    slot: Mutex<Slot>,
    posted: Condvar,
}

#[derive(Debug)]
struct Slot {
    /// The newest frame that was asked for and not yet begun.
    frame: Option<FrameRequest>,
    /// Stills are waited for: none is ever dropped, and they go before frames.
    stills: VecDeque<PostedStill>,
    /// What is to draw from now on.
    choice: Option<EngineChoice>,
    /// What was chosen last.
    chosen: EngineChoice,
    /// Drawn once nothing else is asked for.
    second: Option<SecondRequest>,
    /// Whether the second picture under way is still of use.
    second_wanted: bool,
    second_picture: Option<Arc<SecondPicture>>,
    /// Cells to be found, between two pieces of a picture or once nothing else is to be drawn.
    cells: Option<CellsRequest>,
    /// Whether the cuts of moving views are to be kept for their cells.
    cells_wanted: bool,
    found_cells: Option<Arc<FoundCells>>,
    stop: bool,
    /// The scene of the frame under way, and what cancels its preparation.
    under_way: Option<(Scene, Ticket)>,
    picture: Option<Arc<Picture>>,
    state: EngineState,
    adapter_name: Option<String>,
    /// Where bricks come from, until the thread has taken it.
    source: Option<Arc<dyn BrickSource>>,
    /// For the tests of what happens then.
    trouble: Option<Trouble>,
}

/// What befalls the thread at its next work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trouble {
    /// The device is lost before it.
    Loss,
    /// The driver says so only where the work is waited for.
    LossInWait,
    /// An error of the program's own.
    Panic,
}

#[derive(Debug)]
struct PostedStill {
    request: StillRequest,
    keeps_cells: bool,
    ticket: Ticket,
    reply: mpsc::SyncSender<Result<Still, StillError>>,
}

enum Posted {
    Choice(EngineChoice),
    Frame(FrameRequest, Ticket),
    Still(PostedStill),
    Cells(CellsRequest),
    Second(SecondRequest),
}

impl Slot {
    /// Whether nothing is asked for that goes before what is being drawn.
    fn is_empty(&self) -> bool {
        self.frame.is_none() && self.stills.is_empty() && self.choice.is_none()
    }

    /// Whether nothing is asked for that waits until there is nothing else.
    fn idle_work_is_none(&self) -> bool {
        self.second.is_none() && self.cells.is_none()
    }

    /// What is to be done next.
    fn take(&mut self) -> Option<Posted> {
        if let Some(choice) = self.choice.take() {
            return Some(Posted::Choice(choice));
        }
        if let Some(still) = self.stills.pop_front() {
            return Some(Posted::Still(still));
        }
        let Some(frame) = self.frame.take() else {
            let cells = self.cells.take().map(Posted::Cells);
            return cells.or_else(|| self.second.take().map(Posted::Second));
        };
        let ticket = Ticket::new();
        self.under_way = Some((frame.scene.clone(), ticket.clone()));
        Some(Posted::Frame(frame, ticket))
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Slot> {
        // A panic elsewhere leaves whole values behind: each is replaced in one step.
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Engine {
    /// Starts the thread; a device, where one is needed, is made there. `wake` is called from it whenever
    /// [`Engine::take_picture`] or [`Engine::state`] have news.
    pub fn start(choice: impl Into<Choice>, wake: impl Fn() + Send + 'static) -> Self {
        Self::start_with(choice, Wishes::default(), wake)
    }

    /// The same, asking the device for no more than `wishes`.
    pub fn start_with(
        choice: impl Into<Choice>,
        wishes: Wishes,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let choice = choice.into();
        let shared = Arc::new(Shared {
            slot: Mutex::new(Slot {
                frame: None,
                stills: VecDeque::new(),
                choice: None,
                chosen: choice.engine,
                second: None,
                second_wanted: false,
                second_picture: None,
                cells: None,
                cells_wanted: false,
                found_cells: None,
                stop: false,
                under_way: None,
                picture: None,
                state: EngineState::Starting,
                adapter_name: None,
                source: None,
                trouble: None,
            }),
            posted: Condvar::new(),
        });
        let worker = Worker::new(Arc::clone(&shared), Box::new(wake), choice, wishes);
        let thread = std::thread::Builder::new().name("voxsplat-engine".to_owned());
        let thread = thread.spawn(move || worker.run());
        if let Err(error) = &thread {
            shared.lock().state =
                EngineState::Failed(format!("the drawing thread did not start: {error}"));
        }
        Self { shared, thread: thread.ok() }
    }

    /// Replaces whatever was asked for before. Never blocks.
    pub fn request(&self, request: FrameRequest) {
        let mut slot = self.shared.lock();
        if let Some((scene, ticket)) = &slot.under_way
            && !scene.has_same_volume(&request.scene)
        {
            ticket.cancel();
        }
        if matches!(request.effort, Effort::Moving { .. }) {
            // The hand goes first, and will come to rest in another view.
            slot.cells = None;
        }
        slot.frame = Some(request);
        drop(slot);
        self.shared.posted.notify_one();
    }

    /// Draws one still picture and waits for it; the ticket cancels.
    ///
    /// # Errors
    /// What went wrong, in one sentence.
    pub fn still(&self, request: StillRequest, ticket: &Ticket) -> Result<Still, StillError> {
        self.post_still(request, false, ticket)
    }

    /// The same with the cells of the octree cut, where the picture is one.
    ///
    /// # Errors
    /// See [`Engine::still`].
    pub fn still_with_cells(
        &self,
        request: StillRequest,
        ticket: &Ticket,
    ) -> Result<Still, StillError> {
        self.post_still(request, true, ticket)
    }

    fn post_still(
        &self,
        request: StillRequest,
        keeps_cells: bool,
        ticket: &Ticket,
    ) -> Result<Still, StillError> {
        let ended = || GpuError::Device("the drawing thread ended early".to_owned());
        if self.thread.as_ref().is_none_or(JoinHandle::is_finished) {
            return Err(ended().into());
        }
        let (reply, receiver) = mpsc::sync_channel(1);
        let still = PostedStill { request, keeps_cells, ticket: ticket.clone(), reply };
        self.shared.lock().stills.push_back(still);
        self.shared.posted.notify_one();
        receiver.recv().unwrap_or_else(|_| Err(ended().into()))
    }

    /// The newest picture not yet taken, if any. Never blocks.
    pub fn take_picture(&self) -> Option<Arc<Picture>> {
        self.shared.lock().picture.take()
    }

    /// What the engine is doing now. Never blocks.
    pub fn state(&self) -> EngineState {
        self.shared.lock().state.clone()
    }

    /// The adapter's name, once there is one.
    pub fn adapter_name(&self) -> Option<String> {
        self.shared.lock().adapter_name.clone()
    }

    /// Which engine was asked for last. Never blocks.
    pub fn engine_choice(&self) -> EngineChoice {
        self.shared.lock().chosen
    }

    /// Has another engine draw from now on, beginning with the frame that was asked for last. Never blocks.
    pub fn choose_engine(&self, engine: EngineChoice) {
        let mut slot = self.shared.lock();
        slot.chosen = engine;
        slot.choice = Some(engine);
        drop(slot);
        self.shared.posted.notify_one();
    }

    /// From the next request on bricks of fields come from a source; without one all are there. A view at rest ends in a picture
    /// of all that has come, and is drawn on when more does. Never blocks.
    pub fn take_bricks_from(&self, source: Arc<dyn BrickSource>) {
        self.shared.lock().source = Some(source);
    }

    /// Loses the device before the next request, for the test of what happens then.
    pub fn lose_device(&self) {
        self.shared.lock().trouble = Some(Trouble::Loss);
    }

    /// Loses the device as work of the next request is waited for, where `wgpu` panics; for the test of what happens
    /// then.
    pub fn lose_device_in_wait(&self) {
        self.shared.lock().trouble = Some(Trouble::LossInWait);
    }

    /// Panics at the next request, for the test of what happens then.
    pub fn panic_at_next(&self) {
        self.shared.lock().trouble = Some(Trouble::Panic);
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        {
            let mut slot = self.shared.lock();
            slot.stop = true;
            if let Some((_, ticket)) = &slot.under_way {
                ticket.cancel();
            }
        }
        self.shared.posted.notify_one();
        if let Some(thread) = self.thread.take() {
            // A panicked thread has nothing more to say.
            drop(thread.join());
        }
    }
}

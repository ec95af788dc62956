//! The drawing service: its own thread, its own device, latest request wins.
//!
//! The window and `render` use the same service. A caller posts a [`FrameRequest`]; whatever was
//! being drawn is dropped at its next piece. Pictures come back through [`Engine::take_picture`],
//! announced by the `wake` callback.

mod second;

pub use second::{SecondPicture, SecondRequest};

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

pub use crate::gpu::AdapterChoice;

use super::draw::{DrawError, Drawer, Drawn, Observer, Rung, background_light};
use super::estimate::{self, Checked, Coarseness, Estimator};
use super::slabs;
use super::still::{self, Still, StillError, StillRequest};
use crate::core::Ticket;
use crate::gpu::{Context, GpuError, Renderer, Wishes};
use crate::kernel::Kernel;
use crate::scene::{Backend, Scene, SplatSettings};
use crate::volume::ScalarVolume;

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
    /// What drew it.
    pub backend: Backend,
    /// Wall milliseconds from camera set to queue finished.
    pub frame_ms: f64,
    /// Share of the way to `full`, 0..=1; 1 once nothing more will be drawn.
    pub progress: f32,
    /// What a coarse picture is thought to be off by: RMSE to `full` in linear light.
    pub estimated_rmse: Option<f64>,
    /// On `full`: what the coarse picture of the same view was thought to be off by, and was.
    pub checked: Option<Checked>,
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
    /// Drawn once nothing else is asked for.
    second: Option<SecondRequest>,
    /// Whether the second picture under way is still of use.
    second_wanted: bool,
    second_picture: Option<Arc<SecondPicture>>,
    stop: bool,
    /// The volume of the frame under way, and what cancels its preparation.
    under_way: Option<(Arc<ScalarVolume>, Ticket)>,
    picture: Option<Arc<Picture>>,
    state: EngineState,
    adapter_name: Option<String>,
    /// For the test of a lost device.
    lose_device: bool,
}

#[derive(Debug)]
struct PostedStill {
    request: StillRequest,
    ticket: Ticket,
    reply: mpsc::SyncSender<Result<Still, StillError>>,
}

enum Posted {
    Frame(FrameRequest, Ticket),
    Still(PostedStill),
    Second(SecondRequest),
}

impl Slot {
    fn is_empty(&self) -> bool {
        self.frame.is_none() && self.stills.is_empty()
    }

    /// What is to be done next.
    fn take(&mut self) -> Option<Posted> {
        if let Some(still) = self.stills.pop_front() {
            return Some(Posted::Still(still));
        }
        let Some(frame) = self.frame.take() else {
            return self.second.take().map(Posted::Second);
        };
        let ticket = Ticket::new();
        self.under_way = Some((Arc::clone(&frame.scene.volume), ticket.clone()));
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
    /// Starts the thread; the device is made there. `wake` is called from it whenever
    /// [`Engine::take_picture`] or [`Engine::state`] have news.
    pub fn start(adapter: AdapterChoice, wake: impl Fn() + Send + 'static) -> Self {
        Self::start_with(adapter, Wishes::default(), wake)
    }

    /// The same, asking the device for no more than `wishes`.
    pub fn start_with(
        adapter: AdapterChoice,
        wishes: Wishes,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let shared = Arc::new(Shared {
            slot: Mutex::new(Slot {
                frame: None,
                stills: VecDeque::new(),
                second: None,
                second_wanted: false,
                second_picture: None,
                stop: false,
                under_way: None,
                picture: None,
                state: EngineState::Starting,
                adapter_name: None,
                lose_device: false,
            }),
            posted: Condvar::new(),
        });
        let worker = Worker {
            shared: Arc::clone(&shared),
            wake: Box::new(wake),
            adapter,
            wishes,
            drawer: None,
            last_coarse: None,
            coarse: Vec::new(),
            estimator: Estimator::default(),
        };
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
        if let Some((volume, ticket)) = &slot.under_way
            && !Arc::ptr_eq(volume, &request.scene.volume)
        {
            ticket.cancel();
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
        let ended = || GpuError::Device("the drawing thread ended early".to_owned());
        if self.thread.as_ref().is_none_or(JoinHandle::is_finished) {
            return Err(ended().into());
        }
        let (reply, receiver) = mpsc::sync_channel(1);
        let still = PostedStill { request, ticket: ticket.clone(), reply };
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

    /// Loses the device before the next request, for the test of what happens then.
    pub fn lose_device(&self) {
        self.shared.lock().lose_device = true;
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

/// How often progress within a rung is announced.
const PROGRESS_EVERY: Duration = Duration::from_millis(250);
/// How often a partial picture is published: presenting it takes longer than a piece.
const PARTIAL_EVERY: Duration = Duration::from_millis(300);
/// A middle rung may take this share of what `full` takes.
const MIDDLE_SHARE: f64 = 0.1;
/// `full` follows the coarse picture at once where it takes no longer than this.
const MIDDLE_WORTH_MS: f64 = 700.0;
/// Two middle rungs come before a `full` that takes longer than this.
const SEVERAL_WORTH_MS: f64 = 3000.0;
/// Rebuilds of a lost device for one request.
const REBUILDS: u32 = 2;

/// The thread's end.
struct Worker {
    shared: Arc<Shared>,
    wake: Box<dyn Fn() + Send>,
    adapter: AdapterChoice,
    wishes: Wishes,
    drawer: Option<Drawer>,
    /// The scene whose coarse picture was published last.
    last_coarse: Option<(Scene, [u32; 2])>,
    /// The coarse pictures published last, one of a kind, until a finished one of their view has
    /// checked them.
    coarse: Vec<(FrameRequest, Arc<Picture>, Coarseness)>,
    estimator: Estimator,
}

impl Worker {
    fn run(mut self) {
        // The device is made before the first request, which mostly waits for a file.
        if let Err(error) = self.device() {
            self.announce(EngineState::Failed(error.to_string()));
        } else {
            self.announce(EngineState::Idle);
        }
        loop {
            let posted = {
                let mut slot = self.shared.lock();
                while slot.is_empty() && slot.second.is_none() && !slot.stop {
                    slot = self.shared.posted.wait(slot).unwrap_or_else(PoisonError::into_inner);
                }
                if slot.stop {
                    return;
                }
                slot.take()
            };
            match posted {
                Some(Posted::Frame(request, ticket)) => {
                    self.serve(request, &ticket);
                    self.shared.lock().under_way = None;
                }
                Some(Posted::Still(still)) => {
                    let result = self.still(&still.request, &still.ticket);
                    // Whoever asked may be gone.
                    drop(still.reply.send(result));
                    self.announce(EngineState::Idle);
                }
                Some(Posted::Second(request)) => self.serve_second(request),
                None => {}
            }
        }
    }

    fn still(&mut self, request: &StillRequest, ticket: &Ticket) -> Result<Still, StillError> {
        let mut tries = 0;
        loop {
            let result = self
                .device()
                .map_err(StillError::from)
                .and_then(|drawer| still::draw(drawer, request, ticket));
            match result {
                Err(StillError::Gpu(GpuError::Lost(_))) if tries < REBUILDS => self.drop_device(),
                other => return other,
            }
            tries += 1;
        }
    }

    /// The device, made anew where there is none.
    fn device(&mut self) -> Result<&mut Drawer, GpuError> {
        if self.drawer.is_none() {
            let context = Context::new(&self.adapter, self.wishes)?;
            self.shared.lock().adapter_name = Some(context.adapter_name.clone());
            self.drawer = Some(Drawer::new(Renderer::new(context)));
        }
        let Some(drawer) = &mut self.drawer else {
            return Err(GpuError::Device("no device".to_owned()));
        };
        if std::mem::take(&mut self.shared.lock().lose_device) {
            drawer.renderer.context().lose();
        }
        Ok(drawer)
    }

    fn drop_device(&mut self) {
        self.drawer = None;
        self.last_coarse = None;
    }

    fn announce(&self, state: EngineState) {
        let mut slot = self.shared.lock();
        if slot.state == state {
            return;
        }
        slot.state = state;
        drop(slot);
        (self.wake)();
    }

    /// Draws a request as far as it goes, rebuilding the device where it is lost.
    fn serve(&mut self, request: FrameRequest, ticket: &Ticket) {
        let mut tries = 0;
        let outcome = loop {
            match self.refine(&request, ticket) {
                Err(DrawError::Gpu(GpuError::Lost(reason))) if tries < REBUILDS => {
                    log::warn!("the graphics device was lost and is made anew: {reason}");
                    self.drop_device();
                    tries += 1;
                }
                outcome => break outcome,
            }
        };
        match outcome {
            Ok(()) => self.announce(EngineState::Idle),
            // By a newer frame, which takes its place, or by a still, after which it goes on.
            Err(DrawError::Interrupted) => {
                self.shared.lock().frame.get_or_insert(request);
            }
            Err(DrawError::Gpu(error)) => {
                self.drop_device();
                self.announce(EngineState::Failed(error.to_string()));
            }
        }
    }

    fn refine(&mut self, request: &FrameRequest, ticket: &Ticket) -> Result<(), DrawError> {
        self.announce(EngineState::Drawing(0.0));
        let (scene, size) = (&request.scene, request.size);
        self.device()?.prepare(scene, ticket)?;
        match request.effort {
            Effort::Moving { budget_ms } => {
                // Bounded by its budget, and so never interrupted: a hand that moves faster than
                // pictures are drawn still sees every one of them.
                self.rung(request, Rung::Coarse { budget_ms }, Manner::Whole)?;
                self.last_coarse = Some((scene.clone(), size));
                Ok(())
            }
            Effort::Rest { budget_ms, ladder, show_partial } => {
                let seen = self
                    .last_coarse
                    .as_ref()
                    .is_some_and(|(last, at)| *at == size && last.makes_same_picture(scene));
                if !seen && ladder != Ladder::AtOnce {
                    self.rung(request, Rung::Coarse { budget_ms }, Manner::Whole)?;
                }
                let rungs = self.ladder(scene, size, ladder)?;
                let steps = rungs.len() as f64;
                for (i, rung) in rungs.into_iter().enumerate() {
                    if self.newer_came() {
                        return Err(DrawError::Interrupted);
                    }
                    let show_partial = show_partial && rung == Rung::Full;
                    let (before, after) = (i as f64 / steps, (i + 1) as f64 / steps);
                    self.rung(request, rung, Manner::InPieces { show_partial, before, after })?;
                }
                self.last_coarse = None;
                Ok(())
            }
        }
    }

    /// The rungs after the coarse picture.
    fn ladder(
        &mut self,
        scene: &Scene,
        size: [u32; 2],
        ladder: Ladder,
    ) -> Result<Vec<Rung>, DrawError> {
        let drawer = self.device()?;
        let mut rungs = match ladder {
            Ladder::Octree if slabs::reconstructs(&scene.splat) => {
                let rays = f64::from(size[0]) * f64::from(size[1]);
                match rays * drawer.costs.ray_ms {
                    quick if quick < MIDDLE_WORTH_MS => Vec::new(),
                    slow if slow < SEVERAL_WORTH_MS => vec![Rung::Reduced { shrink: 4.0 }],
                    _ => vec![Rung::Reduced { shrink: 8.0 }, Rung::Reduced { shrink: 3.0 }],
                }
            }
            Ladder::Octree => {
                let full_ms = drawer.active_count() as f64 * drawer.costs.voxel_ms;
                if full_ms < MIDDLE_WORTH_MS {
                    Vec::new()
                } else {
                    vec![Rung::Coarse { budget_ms: full_ms * MIDDLE_SHARE }]
                }
            }
            Ladder::Subsampling => {
                vec![Rung::Subsampled { level: 2 }, Rung::Subsampled { level: 1 }]
            }
            Ladder::AtOnce => Vec::new(),
            Ladder::CheaperKernels => {
                vec![Rung::Cheaper(Kernel::Point), Rung::Cheaper(Kernel::Nearest)]
            }
        };
        rungs.retain(|rung| *rung != Rung::Cheaper(scene.splat.kernel));
        rungs.push(Rung::Full);
        Ok(rungs)
    }

    fn newer_came(&self) -> bool {
        let slot = self.shared.lock();
        !slot.is_empty() || slot.stop
    }

    /// Draws and publishes one rung.
    fn rung(
        &mut self,
        request: &FrameRequest,
        rung: Rung,
        manner: Manner,
    ) -> Result<(), DrawError> {
        let start = Instant::now();
        self.device()?;
        // Taken out while it draws, so that pieces can announce themselves through `self`.
        let Some(mut drawer) = self.drawer.take() else { return Ok(()) };
        let mut watch = Watch {
            worker: self,
            request,
            manner,
            start,
            last_progress: start,
            last_partial: start,
            active: drawer.active_count(),
        };
        let learnt = drawer.costs;
        let splat = match rung {
            Rung::Full | Rung::Reduced { .. } => SplatSettings {
                backend: drawer.window_backend(&request.scene),
                ..request.scene.splat
            },
            _ => request.scene.splat.previewed(),
        };
        let scene = Scene { splat, ..request.scene.clone() };
        let drawn = drawer.draw(&scene, request.size, rung, &mut watch);
        let raster_ms = drawn.as_ref().ok().map(|drawn| drawn.wall_ms);
        if matches!((rung, manner), (Rung::Coarse { .. }, Manner::InPieces { .. })) {
            // A picture that may take far longer has other prices than those the hand needs.
            drawer.costs = learnt;
        }
        let result = drawn.and_then(|drawn| {
            let background = background_light(request.scene.background);
            let rgba = drawer.renderer.present(background)?;
            let active = drawer.active_count();
            let progress = match manner {
                Manner::Whole => 0.0,
                Manner::InPieces { after, .. } => after as f32,
            };
            let words = (rung_words(rung, &drawn), progress);
            let mut picture = picture(request, words, &drawn, rgba, active);
            picture.report.backend = scene.splat.backend;
            let coarseness = match rung {
                Rung::Coarse { .. } => Some(Coarseness::Octree { max_error: drawn.max_error }),
                Rung::Reduced { .. } => Some(Coarseness::Reduced),
                _ => None,
            };
            if let Some(coarseness) = coarseness {
                let rmse = self.estimator.rmse(&request.scene, coarseness, picture.shrink());
                picture.report.estimated_rmse = Some(rmse);
            }
            if rung == Rung::Full {
                self.check(request, &mut picture);
            }
            let picture = Arc::new(picture);
            if let Some(coarseness) = coarseness {
                self.coarse.retain(|(_, _, other)| !other.is_kind_of(coarseness));
                self.coarse.push((request.clone(), Arc::clone(&picture), coarseness));
            }
            self.publish(picture);
            Ok(())
        });
        let calibrated = match raster_ms {
            Some(raster_ms)
                if rung == Rung::Full
                    && result.is_ok()
                    && drawer.is_to_be_calibrated(&request.scene) =>
            {
                let mut watch = Watch {
                    worker: self,
                    request,
                    manner,
                    start,
                    last_progress: start,
                    last_partial: Instant::now(),
                    active: drawer.active_count(),
                };
                drawer.calibrate(&request.scene, request.size, raster_ms, &mut watch)
            }
            _ => Ok(()),
        };
        self.drawer = Some(drawer);
        result.and(calibrated)
    }

    fn publish(&self, picture: Arc<Picture>) {
        self.shared.lock().picture = Some(picture);
        (self.wake)();
    }

    /// Holds the coarse pictures against the finished one of the same view, and learns from them.
    fn check(&mut self, request: &FrameRequest, picture: &mut Picture) {
        for (seen, coarse, coarseness) in std::mem::take(&mut self.coarse) {
            let same = seen.size == request.size && seen.scene.makes_same_picture(&request.scene);
            let Some(estimated_rmse) = coarse.report.estimated_rmse.filter(|_| same) else {
                continue;
            };
            if let Ok(measured_rmse) = estimate::shown_rmse(&coarse, picture) {
                let checked = Checked { estimated_rmse, measured_rmse };
                self.estimator.learn(&request.scene, coarseness, &checked);
                // The preview is the one that the hand saw.
                if matches!(coarseness, Coarseness::Octree { .. }) {
                    picture.report.checked = Some(checked);
                }
            }
        }
    }
}

/// What was drawn, with what is known of it.
fn picture(
    request: &FrameRequest,
    (rung, progress): (String, f32),
    drawn: &Drawn,
    rgba: Vec<u8>,
    kernels_active: u64,
) -> Picture {
    let report = FrameReport {
        rung,
        kernels_drawn: drawn.kernels,
        kernels_active,
        kernels_total: request.scene.volume.lattice.len() as u64,
        backend: Backend::Raster,
        frame_ms: drawn.wall_ms,
        progress,
        estimated_rmse: None,
        checked: None,
    };
    Picture { size: drawn.size, requested_size: request.size, rgba, report }
}

/// A finished rung in words.
fn rung_words(rung: Rung, drawn: &Drawn) -> String {
    match rung {
        Rung::Coarse { .. } => format!("coarse, octree error {:.3}", drawn.max_error),
        Rung::Octree { .. } => format!("octree error {:.3}", drawn.max_error),
        Rung::Subsampled { level } => format!("every {}th sample, averaged", 1 << level),
        Rung::Cheaper(kernel) => format!("every voxel, {} kernel", kernel.name()),
        Rung::Reduced { .. } => format!("full at {} × {}", drawn.size[0], drawn.size[1]),
        Rung::Full => "full".to_owned(),
    }
}

/// How a rung is drawn.
#[derive(Debug, Clone, Copy)]
enum Manner {
    /// To its end, which its budget bounds.
    Whole,
    /// Until something newer comes.
    InPieces {
        /// Publish the picture while it is drawn.
        show_partial: bool,
        /// Share of the way to `full` that is behind it, and that will be when it is done.
        before: f64,
        /// See `before`.
        after: f64,
    },
}

/// Announces a rung's progress, and stops it when something newer came.
struct Watch<'a> {
    worker: &'a Worker,
    request: &'a FrameRequest,
    manner: Manner,
    start: Instant,
    last_progress: Instant,
    last_partial: Instant,
    active: u64,
}

impl Observer for Watch<'_> {
    fn piece_done(&mut self, renderer: &mut Renderer, done: f64) -> bool {
        let Manner::InPieces { show_partial, before, after } = self.manner else { return false };
        if self.worker.newer_came() {
            return true;
        }
        let share = before + (after - before) * done;
        if self.last_progress.elapsed() >= PROGRESS_EVERY {
            self.last_progress = Instant::now();
            #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
            self.worker.announce(EngineState::Drawing(share as f32));
        }
        if show_partial && done < 1.0 && self.last_partial.elapsed() >= PARTIAL_EVERY {
            let background = background_light(self.request.scene.background);
            // A failing device is reported by the rung itself.
            if let Ok(rgba) = renderer.present(background) {
                let kernels = (self.active as f64 * done) as u64;
                let drawn = Drawn {
                    size: self.request.size,
                    kernels,
                    nodes: 0,
                    max_error: 0.0,
                    wall_ms: self.start.elapsed().as_secs_f64() * 1e3,
                };
                #[expect(clippy::cast_possible_truncation, reason = "0..1")]
                let progress = share.min(0.99) as f32;
                let words = ("full, in part".to_owned(), progress);
                let picture = picture(self.request, words, &drawn, rgba, self.active);
                self.worker.publish(Arc::new(picture));
            }
            self.last_partial = Instant::now();
        }
        false
    }
}

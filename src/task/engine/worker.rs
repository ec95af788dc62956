//! The engine's thread: what is done next, and with which device.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use super::next::LastDrawn;
use super::rungs::Unchecked;
use super::{
    EngineChoice, EngineState, FrameRequest, Ladder, Picture, Posted, PostedStill, Shared, Trouble,
};
use crate::core::Ticket;
use crate::gpu::{GpuError, Wishes};
use crate::plan::Plan;
use crate::task::cuts::BrickSource;
use crate::task::draw::{DrawError, Drawer};
use crate::task::engines::{Choice, Engines};
use crate::task::estimate::Estimator;
use crate::task::remaining::Told;
use crate::task::still::{self, Still, StillError};

/// Rebuilds of a lost device for one request.
pub(super) const REBUILDS: u32 = 2;

/// Between two looks whether bricks have come that a view at rest lacks.
const LOOK_FOR_BRICKS: Duration = Duration::from_millis(50);

/// What is said where drawing came upon an error of its own, which is told where it happened.
const FAILED: &str = "expected a picture, found an error of the program's own; change the view to try again, or report it";

/// The thread's end.
pub(super) struct Worker {
    pub(super) shared: Arc<Shared>,
    pub(super) wake: Box<dyn Fn() + Send>,
    choice: Choice,
    wishes: Wishes,
    pub(super) drawer: Option<Drawer>,
    /// The frame that was asked for last.
    last: Option<FrameRequest>,
    /// The coarse pictures published last: a preview, and one on the way up.
    pub(super) coarse: Vec<Unchecked>,
    /// The `full` that was published last, and what asked for it; `None` once something coarse was
    /// drawn.
    pub(super) finished: Option<(FrameRequest, Arc<Picture>)>,
    /// Whether the picture that is on the device is that, or one of more slabs after it.
    pub(super) holds_finished: bool,
    pub(super) estimator: Estimator,
    /// The last `full`: what comes after a coarse picture is judged by it.
    pub(super) last_full: Option<LastDrawn>,
    /// The last picture in its own mode at a smaller size.
    pub(super) last_reduced: Option<LastDrawn>,
    /// The way up that was asked for last.
    pub(super) last_ladder: Option<Ladder>,
    /// What a finished picture was found to be off by last.
    pub(super) last_told: Option<(Plan, Told)>,
    /// Where bricks come from, if not all are there.
    source: Option<Arc<dyn BrickSource>>,
    /// The view at rest of which not all bricks have come.
    pub(super) lacking: Option<FrameRequest>,
}

impl Worker {
    pub(super) fn new(
        shared: Arc<Shared>,
        wake: Box<dyn Fn() + Send>,
        choice: Choice,
        wishes: Wishes,
    ) -> Self {
        Self {
            shared,
            wake,
            choice,
            wishes,
            drawer: None,
            last: None,
            coarse: Vec::new(),
            finished: None,
            holds_finished: false,
            estimator: Estimator::default(),
            last_full: None,
            last_reduced: None,
            last_ladder: None,
            last_told: None,
            source: None,
            lacking: None,
        }
    }

    pub(super) fn run(mut self) {
        // The device is made before the first request, which mostly waits for a file.
        if let Err(error) = self.device() {
            self.announce(EngineState::Failed(error.to_string()));
        } else {
            self.announce(EngineState::Idle);
        }
        let shared = Arc::clone(&self.shared);
        loop {
            let posted = {
                let mut slot = shared.lock();
                while slot.is_empty() && slot.idle_work_is_none() && !slot.stop {
                    if self.lacking.is_none() {
                        slot = shared.posted.wait(slot).unwrap_or_else(PoisonError::into_inner);
                        continue;
                    }
                    let waited = shared.posted.wait_timeout(slot, LOOK_FOR_BRICKS);
                    (slot, _) = waited.unwrap_or_else(PoisonError::into_inner);
                    if slot.is_empty() && self.drawer.as_ref().is_some_and(Drawer::bricks_came) {
                        slot.frame.clone_from(&self.lacking);
                    }
                }
                if slot.stop {
                    return;
                }
                slot.take()
            };
            let Some(posted) = posted else { continue };
            // Whoever waits for an answer would wait for ever.
            let answered = catch_unwind(AssertUnwindSafe(|| self.answer(posted)));
            if answered.is_err() {
                self.drop_device();
                self.shared.lock().under_way = None;
                self.announce(EngineState::Failed(FAILED.to_owned()));
            }
        }
    }

    fn answer(&mut self, posted: Posted) {
        let panics = self.shared.lock().trouble.take_if(|trouble| *trouble == Trouble::Panic);
        assert!(panics.is_none(), "a test asked for this panic");
        match posted {
            Posted::Choice(choice) => self.choose(choice),
            Posted::Frame(request, ticket) => {
                self.last = Some(request.clone());
                self.serve(request, &ticket);
                self.shared.lock().under_way = None;
            }
            Posted::Still(still) => {
                let result = self.still(&still);
                // Whoever asked may be gone.
                drop(still.reply.send(result));
                self.announce(EngineState::Idle);
            }
            Posted::Cells(request) => self.serve_cells(request),
            Posted::Second(request) => self.serve_second(request),
        }
    }

    /// Draws with another engine from now on: the frame on the screen anew.
    fn choose(&mut self, choice: EngineChoice) {
        // An adapter that was named stays so.
        self.choice.engine = choice;
        self.drop_device();
        (self.finished, self.last_full, self.last_reduced) = (None, None, None);
        self.lacking = None;
        self.coarse.clear();
        let mut slot = self.shared.lock();
        slot.frame = slot.frame.take().or_else(|| self.last.clone());
    }

    fn still(&mut self, posted: &PostedStill) -> Result<Still, StillError> {
        let PostedStill { request, keeps_cells, ticket, .. } = posted;
        self.holds_finished = false;
        let mut tries = 0;
        loop {
            let result = self
                .device()
                .map_err(StillError::from)
                .and_then(|drawer| still::draw(drawer, request, *keeps_cells, ticket));
            match result {
                Err(StillError::Gpu(GpuError::Lost(_))) if tries < REBUILDS => self.drop_device(),
                other => return other,
            }
            tries += 1;
        }
    }

    /// What draws, made anew where there is nothing.
    pub(super) fn device(&mut self) -> Result<&mut Drawer, GpuError> {
        if self.drawer.is_none() {
            let engines = Engines::new(self.choice.clone(), self.wishes)?;
            self.shared.lock().adapter_name = Some(engines.name());
            let mut drawer = Drawer::with(engines);
            if let Some(source) = &self.source {
                drawer.take_bricks_from(Arc::clone(source));
            }
            self.drawer = Some(drawer);
        }
        let Some(drawer) = &mut self.drawer else {
            return Err(GpuError::Device("no device".to_owned()));
        };
        if let Some(source) = self.shared.lock().source.take() {
            drawer.take_bricks_from(Arc::clone(&source));
            self.source = Some(source);
        }
        let trouble = self.shared.lock().trouble.take_if(|trouble| *trouble != Trouble::Panic);
        if let Some(renderer) = drawer.engines.made_gpu() {
            match trouble {
                Some(Trouble::Loss) => renderer.context().lose(),
                Some(Trouble::LossInWait) => renderer.context().lose_in_wait(),
                Some(Trouble::Panic) | None => {}
            }
        }
        Ok(drawer)
    }

    pub(super) fn drop_device(&mut self) {
        (self.drawer, self.holds_finished) = (None, false);
    }

    /// Says why there is no picture. A refusal leaves the device as it is.
    pub(super) fn fail(&mut self, error: &DrawError) {
        if !error.is_refusal() {
            self.drop_device();
        }
        self.announce(EngineState::Failed(error.to_string()));
    }

    pub(super) fn announce(&self, state: EngineState) {
        let mut slot = self.shared.lock();
        if slot.state == state {
            return;
        }
        slot.state = state;
        drop(slot);
        (self.wake)();
    }

    pub(super) fn newer_came(&self) -> bool {
        let slot = self.shared.lock();
        !slot.is_empty() || slot.stop
    }

    /// Whether nobody wants the frame under way any more: another volume is to be seen, or another engine is to draw, or none.
    pub(super) fn is_unwanted(&self) -> bool {
        let slot = self.shared.lock();
        let is_of_another =
            slot.under_way.as_ref().is_some_and(|(_, ticket)| ticket.is_cancelled());
        is_of_another || slot.choice.is_some() || slot.stop
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
            Err(error) => self.fail(&error),
        }
    }
}

//! Cuts of a field for quick pictures. Bricks that look alike when drawn from means of their samples are drawn from the means,
//! in slabs as thick as these are wide. The time saved goes to more pixels.
//!
//! The error of each brick is found on a thread of its own when the transfer function changes (`hierarchy::BrickErrors`).
//! No one limit on it serves all data. So a few limits are compared, each with the size of picture that it affords, and the
//! one that is thought to lose least is drawn.

mod allowed;
mod arrived;
mod bricks;
mod by_engine;
mod candidate;
mod choice;
mod measured;
mod tried;

use std::sync::Arc;
use std::time::Duration;

use super::draw::{CutLevels, DrawError, Drawer, Observer};
use super::engines::EngineKind;
use super::job::Job;
use crate::core::Ticket;
use crate::gpu::GpuError;
use crate::hierarchy::{Means, ScalarPyramidError};
use crate::plan::{FieldCut, Plan, SlabField};
use crate::scene::{Cells, Moving};
use crate::volume::ScalarVolume;
pub use allowed::{why_no_cut, why_no_cut_of};
use arrived::Arrived;
pub use arrived::{BrickSource, InMemory, Wanted};
pub(super) use bricks::Bricks;
use bricks::{Found, Key, Outcome};
pub use bricks::{means_of, stored_levels};
use candidate::Candidate;
pub use candidate::cut_within;
use measured::Measured;
pub use tried::Tried;

/// The cut that a quick picture is drawn from: its number among those of [`FieldCuts`].
pub(super) type CutNumber = u8;
/// That of the cut of an error that somebody asked for.
const ASKED: CutNumber = CutNumber::MAX;

/// What is known of cuts of the field that is drawn.
#[derive(Debug, Default)]
pub(super) struct FieldCuts {
    means: Option<(Arc<ScalarVolume>, Arc<Means>)>,
    under_way: Option<(Key, Job<Outcome>)>,
    ready: Option<Ready>,
    /// How many times smaller the last quick picture was drawn, and what is thought to be lost for it: RMSE.
    sampling: Option<(f64, f64)>,
    /// log₂ of how many times longer cuts take than their bricks say, by [`SlabField`].
    longer: [f64; 2],
    /// Whose prices these are.
    engine: EngineKind,
    /// Which bricks there are.
    arrived: Arrived,
    /// What pictures of cuts were found to be off by.
    measured: Option<Measured>,
}

/// Cuts that may be drawn; none where a volume is too small, or memory is short.
#[derive(Debug)]
struct Ready {
    key: Key,
    candidates: Vec<Candidate>,
    /// The cut of an error that somebody asked for.
    asked: Option<Candidate>,
    bricks: Option<Arc<Bricks>>,
}

impl FieldCuts {
    /// Those of a plan.
    fn of(&self, plan: &Plan) -> &[Candidate] {
        match &self.ready {
            Some(ready) if ready.key.is_of(plan) => &ready.candidates,
            _ => &[],
        }
    }

    /// The cut of a number, and what is known of it before a plan.
    pub(super) fn numbered(&self, number: CutNumber) -> Option<(Arc<FieldCut>, CutLevels)> {
        let Candidate { cut, max_error, waiting, .. } = self.candidate(number)?;
        let (max_error, bricks, waiting) = (*max_error, cut.counts(), waiting.len() as u64);
        Some((Arc::clone(cut), CutLevels { max_error, rmse: 0.0, bricks, waiting }))
    }

    /// Takes in what has come since the last time: cuts are found anew of it.
    fn take_arrived(&mut self) {
        if self.arrived.look() {
            self.find_again();
        }
    }

    /// Finds cuts of what has come.
    fn find_again(&mut self) {
        let finest = self.arrived.finest();
        if let Some(Ready { candidates, asked, bricks: Some(bricks), .. }) = &mut self.ready {
            *candidates = bricks.candidates(finest);
            *asked = asked.take().map(|asked| bricks.candidate(asked.max_error, finest));
        }
    }

    /// Says what a picture of a cut lacked.
    pub(super) fn tell_missing(&self, number: CutNumber) {
        if let Some(found) = self.candidate(number) {
            self.arrived.want(&found.waiting);
        }
    }

    fn candidate(&self, number: CutNumber) -> Option<&Candidate> {
        let ready = self.ready.as_ref()?;
        if number == ASKED {
            return ready.asked.as_ref();
        }
        ready.candidates.get(usize::from(number))
    }

    /// The bricks of a cut as cells, at most so many of them.
    pub(super) fn cells(&self, number: CutNumber, most: usize) -> Option<Cells> {
        Some(self.bricks()?.cells(self.candidate(number)?, most))
    }

    /// What cuts are found in.
    pub(super) fn bricks(&self) -> Option<&Arc<Bricks>> {
        self.ready.as_ref()?.bricks.as_ref()
    }

    /// Finds the cut of a plan's field whose bricks are off by no more than an error.
    pub(super) fn ask(&mut self, plan: &Plan, max_error: f32) -> Option<CutNumber> {
        self.take_arrived();
        let ready = self.ready.as_mut().filter(|ready| ready.key.is_of(plan))?;
        if ready.asked.as_ref().is_none_or(|asked| asked.max_error != max_error) {
            ready.asked = Some(ready.bricks.as_ref()?.candidate(max_error, self.arrived.finest()));
        }
        Some(ASKED)
    }

    /// Turns to another engine, whose prices are its own, and which has means of its own.
    pub(super) fn turn_to(&mut self, engine: EngineKind) {
        if self.engine != engine {
            let (means, arrived) = (self.means.take(), std::mem::take(&mut self.arrived));
            *self = Self { means, engine, arrived, ..Self::default() };
        }
    }
}

impl Drawer {
    /// From now on bricks of fields come from a source; without one all are there.
    pub fn take_bricks_from(&mut self, source: Arc<dyn BrickSource>) {
        self.cuts.arrived = Arrived::from(source);
        self.cuts.take_arrived();
    }

    /// Whether more has come from that source since cuts were found last.
    pub(super) fn bricks_came(&self) -> bool {
        self.cuts.arrived.has_news()
    }

    /// Whether bricks that a plan's field shows anything in have not come: all of it cannot be drawn.
    pub(super) fn lacks_bricks(&self, plan: &Plan) -> bool {
        let Some(finest) = self.cuts.arrived.finest().filter(|_| self.may_cut(plan)) else {
            return false;
        };
        let is_lacking = |brick: usize| finest.get(brick).is_none_or(|level| *level > 0);
        match self.cuts.ready.as_ref().filter(|ready| ready.key.is_of(plan)) {
            Some(Ready { bricks: Some(bricks), .. }) => {
                let mut shown = bricks.shown.iter();
                self.has_cuts(plan) && shown.any(|&brick| is_lacking(brick as usize))
            }
            // There are no cuts to be drawn of what has come.
            Some(_) => false,
            None => (0..finest.len()).any(is_lacking),
        }
    }

    /// Begins to look for cuts of a plan's field, where there are none yet, and takes in what came of it.
    ///
    /// # Errors
    /// A thread that does not start, or fails; a failing device.
    pub(super) fn advance_cuts(&mut self, plan: &Plan) -> Result<(), DrawError> {
        if !self.may_cut(plan) {
            return Ok(());
        }
        let Some(field) = plan.field() else { return Ok(()) };
        let holds_levels = self.holds_levels(&field.volume);
        let is_known =
            |ready: &Ready| ready.key.is_of(plan) && (holds_levels || ready.candidates.is_empty());
        if self.cuts.ready.as_ref().is_some_and(is_known) {
            self.cuts.take_arrived();
            return Ok(());
        }
        // What is looked for of another transfer function is told to stop.
        drop(self.cuts.under_way.take_if(|(of, _)| !of.is_of(plan)));
        if let Some((of, job)) = self.cuts.under_way.take() {
            match job.look(Duration::ZERO)? {
                None => self.cuts.under_way = Some((of, job)),
                Some(found) => self.take_cuts(of, found)?,
            }
            return Ok(());
        }
        let holds_field = self.holds_field(SlabField::Own, &field.volume, &plan.mode);
        if !holds_field || !self.has_room_for_means(SlabField::Own) {
            return Ok(());
        }
        let key = Key::of(plan, field);
        let Some(known) = self.known_bricks(plan, &key.levels)? else { return Ok(()) };
        let stores = (!holds_levels).then_some(self.cuts.engine);
        drop(self.cuts.means.take_if(|(of, _)| !Arc::ptr_eq(of, &field.volume)));
        let means = self.cuts.means.as_ref().map(|(_, means)| Arc::clone(means));
        let of = key.clone();
        let work = move |ticket: &Ticket| of.find(means, stores, known, ticket);
        let job = Job::start(("voxsplat-cuts", "cuts of the field"), work)?;
        self.cuts.under_way = Some((key, job));
        Ok(())
    }

    /// # Errors
    /// A failing device.
    fn take_cuts(&mut self, key: Key, found: Outcome) -> Result<(), DrawError> {
        let (candidates, bricks) = match found {
            Ok(Some(Found { levels, candidates, bricks })) => {
                self.cuts.means = Some((Arc::clone(&key.volume), Arc::clone(&bricks.means)));
                match levels.map_or(Ok(()), |levels| self.take_levels(&key.volume, levels)) {
                    Ok(()) => (candidates, Some(Arc::new(bricks))),
                    Err(DrawError::Gpu(error @ GpuError::TooLarge { .. })) => {
                        log::warn!("quick pictures are of all of the field: {error}");
                        Default::default()
                    }
                    Err(error) => return Err(error),
                }
            }
            Ok(None) => Default::default(),
            Err(ScalarPyramidError::Cancelled(_)) => return Ok(()),
            Err(ScalarPyramidError::TooLarge(error)) => {
                log::warn!("quick pictures are of all of the field: {error}");
                Default::default()
            }
        };
        self.cuts.ready = Some(Ready { key, candidates, asked: None, bricks });
        self.cuts.arrived.look();
        if self.cuts.arrived.finest().is_some() {
            self.cuts.find_again();
        }
        Ok(())
    }

    /// Has a plan's field and the cuts of it at hand, as quick pictures do by and by; and the one of an error.
    ///
    /// # Errors
    /// As of any picture.
    pub fn find_cut(
        &mut self,
        plan: &Plan,
        max_error: f32,
    ) -> Result<Option<Arc<FieldCut>>, DrawError> {
        self.prepare_field(plan, SlabField::Own, &mut ())?;
        self.prepare_cuts(plan, &mut ())?;
        let number = self.cuts.ask(plan, max_error);
        Ok(number.and_then(|number| self.cuts.numbered(number)).map(|(cut, _)| cut))
    }

    /// Has the cuts of a plan's field at hand, unless something newer comes.
    ///
    /// # Errors
    /// Interrupted, and as [`Self::advance_cuts`].
    pub(super) fn prepare_cuts(
        &mut self,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        self.advance_cuts(plan)?;
        let Some((key, job)) = self.cuts.under_way.take() else { return Ok(()) };
        match job.wait(&mut self.engines, observer)? {
            Some(found) => self.take_cuts(key, found),
            None => {
                self.cuts.under_way = Some((key, job));
                Err(DrawError::Interrupted)
            }
        }
    }

    /// Whether cuts of a plan's field are at hand.
    pub(super) fn has_cuts(&self, plan: &Plan) -> bool {
        self.may_cut(plan)
            && self.has_room_for_means(SlabField::Own)
            && plan.field().is_some_and(|field| self.holds_levels(&field.volume))
            && !self.cuts.of(plan).is_empty()
    }

    /// Whether cuts of a plan's field are being looked for, and are not there yet.
    pub(super) fn awaits_cuts(&self, plan: &Plan) -> bool {
        self.cuts.under_way.as_ref().is_some_and(|(key, _)| key.is_of(plan))
            && plan.mode.cut.moving != Moving::Subsampled
    }

    /// Why quick pictures of a plan are not of cuts of its field though these were asked for; `None` where they are, or nobody
    /// did.
    pub(super) fn why_not_octree(&self, plan: &Plan) -> Option<&'static str> {
        if plan.mode.cut.moving != Moving::Octree || self.has_cuts(plan) {
            return None;
        }
        let has_none = || match () {
            () if let Some(why) = self.why_engine_has_none(plan) => why,
            () if self.cuts.ready.as_ref().is_some_and(|ready| ready.key.is_of(plan)) => {
                "the volume is too small for means, or memory for them is short"
            }
            () => "its nodes are still being looked at",
        };
        Some(why_no_cut(plan).unwrap_or_else(has_none))
    }

    /// Limits on the errors of bricks between which cuts of a plan's field differ: the least, and the most.
    pub(super) fn cut_limits_of(&self, plan: &Plan) -> Option<[f32; 2]> {
        self.cuts.bricks().filter(|_| self.has_cuts(plan))?.limits()
    }
}

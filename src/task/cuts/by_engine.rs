//! What the engine that draws is asked about cuts of a field: whether it has any, which bricks it knows, and what it takes
//! means in from. All else of cuts is the same for both.

use std::sync::Arc;

use super::bricks::{Known, MeansOfLevels};
use super::why_no_cut;
use crate::core::{Cancelled, Ticket};
use crate::native::StoredLevels;
use crate::plan::{Plan, SlabField};
use crate::task::draw::{DrawError, Drawer};
use crate::task::engines::EngineKind;
use crate::volume::ScalarVolume;

/// What an engine takes means in from.
#[derive(Debug)]
pub(super) enum Stored {
    Native(StoredLevels),
    /// The GPU engine uploads them as they are.
    Gpu(MeansOfLevels),
}

impl Stored {
    /// Of the means of a volume, on whatever thread.
    pub(super) fn new(
        engine: EngineKind,
        volume: &Arc<ScalarVolume>,
        means: MeansOfLevels,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        Ok(match engine {
            EngineKind::Native => Self::Native(StoredLevels::new(volume, means, ticket)?),
            EngineKind::Gpu => Self::Gpu(means),
        })
    }
}

impl Drawer {
    /// Whether the engine that draws has cuts of any field; the native one by the instructions that it has.
    fn engine_has_cuts(&self) -> bool {
        !self.is_native() || self.engines.native.draws_cuts()
    }

    /// Whether a field that it holds leaves room for the means: on a device they take the last of the field's bindings.
    pub(super) fn has_room_for_means(&self, field: SlabField) -> bool {
        self.is_native() || self.engines.made_gpu().is_some_and(|gpu| gpu.takes_cuts(field))
    }

    /// Whether it may draw cuts of a plan's field.
    pub(super) fn may_cut(&self, plan: &Plan) -> bool {
        why_no_cut(plan).is_none() && self.engine_has_cuts()
    }

    /// Why the engine that draws has no cuts of a field that could have some; `None` where it has.
    pub(super) fn why_engine_has_none(&self, plan: &Plan) -> Option<&'static str> {
        let holds = |volume| self.holds_field(SlabField::Own, volume, &plan.mode);
        let holds_own = || plan.field().is_some_and(|field| holds(&field.volume));
        match () {
            () if !self.engine_has_cuts() => {
                Some("the native engine draws them with AVX2 alone, which the processor has not")
            }
            () if holds_own() && !self.has_room_for_means(SlabField::Own) => {
                Some("the volume takes all of a device's bindings, and means need one")
            }
            () => None,
        }
    }

    /// Whether it has the means of a volume.
    pub(super) fn holds_levels(&self, volume: &Arc<ScalarVolume>) -> bool {
        match self.is_native() {
            true => self.engines.native.holds_levels(volume),
            false => self.engines.made_gpu().is_some_and(|gpu| gpu.holds_levels(volume)),
        }
    }

    /// Has them taken in.
    ///
    /// # Errors
    /// More than a device binds, or a failing one.
    pub(super) fn take_levels(
        &mut self,
        volume: &Arc<ScalarVolume>,
        stored: Stored,
    ) -> Result<(), DrawError> {
        match stored {
            Stored::Native(levels) => self.engines.native.set_levels(levels),
            Stored::Gpu(means) => {
                self.engines.gpu()?.set_levels(volume, &means, &Ticket::new())?;
            }
        }
        Ok(())
    }

    /// The bricks of a plan's field, which it holds, as it knows them; `levels` are values of isosurfaces.
    ///
    /// # Errors
    /// A failing device.
    pub(super) fn known_bricks(
        &mut self,
        plan: &Plan,
        levels: &[f64],
    ) -> Result<Option<Known>, DrawError> {
        if self.is_native() {
            let native = &self.engines.native;
            return Ok(native.shown_bricks().map(|(dims, shown)| Known {
                dims,
                shown: shown.to_vec(),
                passed: native.passed_bricks(levels),
            }));
        }
        // What shows is of the function that is drawn now, and quick pictures may have been of the other field.
        self.prepare_field(plan, SlabField::Own, &mut ())?;
        let Some(gpu) = self.engines.made_gpu() else { return Ok(None) };
        let passed = gpu.passed_bricks(levels);
        Ok(gpu.shown_bricks().map(|(dims, shown)| Known { dims, shown, passed }))
    }
}

//! What the choice among cuts is worth: all that might have been drawn, beside what is.

use crate::accuracy;
use crate::core::enlarge::enlarged;
use crate::gpu::GpuError;
use crate::plan::{Plan, SlabField};
use crate::task::draw::{DrawError, Drawer, Rung};
use crate::task::engines::Canvas;
use crate::task::estimate::Coarseness;
use crate::task::previews::Reduction;
use crate::task::still::widened;

/// A quick picture that might have been drawn within a time; for measurements of what the choice is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tried {
    /// Of which field.
    pub field: SlabField,
    /// The greatest error of its bricks; `None` where it is of all of the field.
    pub max_error: Option<f32>,
    /// Pixels.
    pub size: [u32; 2],
    /// What it was thought to be off by, and was: RMSE in linear light.
    pub rmse: [f64; 2],
    /// Whether it is the one that a moving view would have shown.
    pub is_chosen: bool,
}

impl Drawer {
    /// Draws every quick picture of a plan that is compared for a budget, each of the size that it is thought to afford.
    /// `full` is the finished one, premultiplied linear light.
    ///
    /// # Errors
    /// As of any picture.
    pub fn try_cuts(
        &mut self,
        plan: &Plan,
        budget_ms: f64,
        full: &[[f64; 4]],
    ) -> Result<Vec<Tried>, DrawError> {
        self.prepare_field(plan, SlabField::Own, &mut ())?;
        self.prepare_preview_field(plan, &mut ())?;
        self.prepare_cuts(plan, &mut ())?;
        self.measure_stand_ins(plan, &mut ())?;
        let rung = Rung::Coarse { budget_ms };
        // What leaving out pixels costs is learnt from pictures, as it is from those of a hand.
        for _ in 0..3 {
            let drawn = self.draw(plan, rung, &mut ())?;
            let shrink = f64::from(plan.size[1]) / f64::from(drawn.size[1]);
            let shown = self.engines.present(plan.background.light())?;
            if let Some(Coarseness::Reduced { sampling_rmse, .. }) =
                Coarseness::of(plan, rung, &drawn, shrink, &shown)
            {
                let known = self.known_rmse(plan, &drawn)?;
                self.note_sampling(shrink, &drawn, (known, sampling_rmse));
            }
        }
        let chosen = self.reduction(plan, budget_ms);
        let (costs, longer, last) = (self.costs, self.cuts.longer, self.last_reduction);
        let mut found = Vec::new();
        for field in [SlabField::Own, SlabField::Preview] {
            if !self.is_at_hand(plan, field) {
                continue;
            }
            let has_room = self.has_room_for_means(field);
            let cuts = if has_room { self.cuts.of(plan).len() } else { 0 };
            let numbers = (0..).take(cuts).map(Some);
            for cut in std::iter::once(None).chain(numbers) {
                let share = cut.map_or(1.0, |number| self.cuts.share(number, field));
                let shrink = self.affordable_at(field, share, plan.size, budget_ms);
                let tried = Reduction { field, shrink, cut };
                let thought_rmse = self.thought_rmse(plan, &tried);
                let drawn = self.draw_reduced(plan, tried, &mut ())?;
                let light = enlarged(self.engines.read_light()?, drawn.size, plan.size);
                let rmse = accuracy::rmse(&widened(&light), full).map_err(|error| {
                    GpuError::Device(format!("two pictures of one size: {error}"))
                })?;
                // The next one is to be fitted by the same prices.
                (self.costs, self.cuts.longer, self.last_reduction) = (costs, longer, last);
                found.push(Tried {
                    field,
                    max_error: drawn.cut.map(|cut| cut.max_error),
                    size: drawn.size,
                    rmse: [thought_rmse, rmse],
                    is_chosen: chosen.is_some_and(|c| (c.field, c.cut) == (field, cut)),
                });
            }
        }
        Ok(found)
    }
}

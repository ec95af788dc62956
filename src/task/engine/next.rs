//! What is known of the picture that comes after a coarse one: what it takes, and what it will be off
//! by. What nobody has measured is left out.

use super::rungs::is_worth_it;
use super::worker::Worker;
use super::{FrameRequest, Ladder, Next, Picture};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::task::draw::{Drawer, Rung};
use crate::task::estimate::Coarseness;
use crate::task::previews::Reduction;

/// A picture half as small is this power of 2 nearer: 3.1, 3.2 and 4.7 dB a halving on the scans
/// aneurism, LIDC2 and bonsai (`Drawer::reduction`), 3.7 dB in the mean.
const GAIN_A_HALVING: f64 = 0.61;

/// What the last picture of a kind was of, and what it took.
#[derive(Debug, Clone)]
pub(super) struct LastDrawn {
    scene: Scene,
    size: [u32; 2],
    ms: f64,
}

impl LastDrawn {
    pub(super) fn of(request: &FrameRequest, ms: f64) -> Self {
        Self { scene: request.scene.clone(), size: request.size, ms }
    }

    /// Whether it was of the same volume and mode.
    fn is_like(&self, scene: &Scene) -> bool {
        self.scene.has_same_volume(scene) && self.scene.splat == scene.splat
    }

    /// What a picture of its kind is thought to take at a size.
    fn ms_at(&self, size: [u32; 2]) -> f64 {
        self.ms * pixels(size) / pixels(self.size)
    }
}

fn pixels(size: [u32; 2]) -> f64 {
    f64::from(size[0]) * f64::from(size[1])
}

impl Worker {
    /// What is known of `rung`, drawn after `shown`.
    pub(super) fn next_of(
        &self,
        request: &FrameRequest,
        rung: Rung,
        shown: &Picture,
        coarseness: Coarseness,
    ) -> Option<Next> {
        let (scene, plan) = (&request.scene, request.plan());
        let drawer = self.drawer.as_ref()?;
        let is_reduced =
            matches!(coarseness, Coarseness::Reduced { .. } | Coarseness::Vectors { .. });
        let rmse_at = |shrink: f64| {
            let rmse = shown.report.estimated_rmse.filter(|_| is_reduced)?;
            Some(rmse_when_sharper(rmse, shown.shrink(), shrink))
        };
        // The price of such rays is known once some were drawn.
        let is_priced = self.last_reduced.as_ref().is_some_and(|l| l.is_like(scene));
        let reduced_ms = |Reduction { field, shrink, .. }: Reduction| {
            is_priced.then(|| drawer.thought_ms(&plan, field, shrink))
        };
        match rung {
            Rung::Full => {
                let ms = self.last_full.as_ref().filter(|l| l.is_like(scene))?.ms_at(plan.size);
                Some(Next { is_full: true, ms, rmse: None })
            }
            Rung::Reduced { field, shrink } => {
                let ms = reduced_ms(Reduction { field, shrink, cut: None })?;
                Some(Next { is_full: false, ms, rmse: rmse_at(shrink) })
            }
            Rung::Coarse { budget_ms } => match drawer.reduction(&plan, budget_ms) {
                // Less than the budget where that affords every pixel.
                Some(reduction) => {
                    let ms = reduced_ms(reduction).map_or(budget_ms, |ms| ms.min(budget_ms));
                    Some(Next { is_full: false, ms, rmse: rmse_at(reduction.shrink) })
                }
                None => {
                    let rmse = self.cut_rmse(drawer, &plan, budget_ms);
                    Some(Next { is_full: false, ms: budget_ms, rmse })
                }
            },
            Rung::Octree { .. }
            | Rung::Bricks { .. }
            | Rung::Subsampled { .. }
            | Rung::Cheaper(_) => None,
        }
    }

    /// What the cut of a budget is thought to be off by, at full size.
    fn cut_rmse(&self, drawer: &Drawer, plan: &Plan, budget_ms: f64) -> Option<f64> {
        drawer.active_count()?;
        let max_error = drawer.error_for_count(drawer.costs.splats_within(budget_ms));
        let coarseness = Coarseness::Octree { max_error, missing_rmse: 0.0 };
        Some(self.estimator.rmse(plan, coarseness, 1.0))
    }

    /// What comes after a picture of a moving view once it rests: by the way up that was asked for
    /// last.
    pub(super) fn next_at_rest(&mut self, request: &FrameRequest, sharpness: f64) -> Option<Rung> {
        let ladder = self.last_ladder?;
        if ladder == Ladder::AtOnce {
            return Some(Rung::Full);
        }
        let rungs = self.ladder(&request.plan(), ladder, 0.0).ok()?;
        rungs.into_iter().find(|rung| is_worth_it(*rung, sharpness))
    }
}

/// What a reduced picture is thought to be off by, where one `from` times smaller than shown is off by
/// `rmse`, and it is only `to` times smaller.
fn rmse_when_sharper(rmse: f64, from: f64, to: f64) -> f64 {
    rmse * (to / from).min(1.0).powf(GAIN_A_HALVING)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_halving_is_worth_three_to_four_decibels_and_no_more_pixels_nothing() {
        let gain_db = -20.0 * rmse_when_sharper(1.0, 8.0, 4.0).log10();
        assert!((3.5..3.9).contains(&gain_db), "{gain_db}");
        assert_eq!(rmse_when_sharper(0.03, 4.0, 4.0), 0.03);
        assert_eq!(rmse_when_sharper(0.03, 4.0, 5.0), 0.03);
    }
}

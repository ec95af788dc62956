//! Beyond `full`: slabs doubled until two pictures are the same, as far as time allows.

use std::sync::Arc;

use super::remaining::LastOfView;
use super::watch::Manner;
use super::worker::Worker;
use super::{FrameRequest, Refined};
use crate::scene::{MOST_SLABS_PER_VOXEL, Scene, SplatSettings, Visibility};
use crate::task::draw::{DrawError, Rung};
use crate::task::level::LevelOfDetail;
use crate::task::remaining::Told;
use crate::task::still::{CONVERGED, Convergence};

/// Doublings that are thought to be needed before any was drawn: 3 to 5 on the demos shells,
/// tornado and head and on a scan (64³ to 512² × 100), one slab a voxel, 480 × 400 pixels.
const USUAL_DOUBLINGS: f64 = 4.0;
/// How many times longer a picture of twice as many slabs takes: 1.3 to 3 there, mostly 1.9.
const USUAL_GROWTH: f64 = 1.9;
/// How many times smaller a doubling is thought to make the greatest difference: 4 on the demo head,
/// where tables are smooth (design: 12 dB); 2 at their steps.
const USUAL_DECAY: f64 = 4.0;

/// How far slabs were doubled, what that took, and what the rest is thought to take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Doublings {
    convergence: Convergence,
    /// Milliseconds of the picture drawn last, and of all since `full`.
    last_ms: f64,
    spent_ms: f64,
    /// Milliseconds that all of them may take.
    within_ms: f64,
    /// Pictures of as many slabs as the last one that are drawn of it, itself among them: smooth edges take more of these.
    each: f64,
    growth: f64,
    decay: f64,
}

impl Doublings {
    /// None yet, after a `full` that took `full_ms`; of the last of them `each` are drawn. `None` where there are no slabs to
    /// double, or nobody wants it.
    pub(super) fn after_full(
        splat: &SplatSettings,
        full_ms: f64,
        (within_ms, each): (f64, f64),
    ) -> Option<Self> {
        let wanted = splat.visibility == Visibility::Slabs && within_ms > 0.0;
        let convergence =
            Convergence { slabs_per_voxel: splat.slabs_per_voxel, last_difference: None };
        wanted.then_some(Self {
            convergence,
            last_ms: full_ms,
            spent_ms: 0.0,
            within_ms,
            each,
            growth: USUAL_GROWTH,
            decay: USUAL_DECAY,
        })
    }

    /// Takes in a picture of twice as many slabs.
    fn drawn(&mut self, ms: f64, difference: f64) {
        if self.convergence.last_difference.is_some() {
            // The first ratio is to a `full` that may have had pipelines to compile.
            self.growth = (ms / self.last_ms.max(0.01)).clamp(1.1, 4.0);
        }
        if let Some(last) = self.convergence.last_difference {
            self.decay = (last / difference.max(1e-9)).clamp(1.5, 4.0);
        }
        self.last_ms = ms;
        self.spent_ms += ms;
        self.convergence = Convergence {
            slabs_per_voxel: 2.0 * self.convergence.slabs_per_voxel,
            last_difference: Some(difference),
        };
    }

    /// What is left to be done to the end, milliseconds; 0 at the end.
    fn left_ms(&self) -> f64 {
        let finest = (MOST_SLABS_PER_VOXEL / self.convergence.slabs_per_voxel).log2().floor();
        if self.convergence.is_reached() || finest < 1.0 {
            return 0.0;
        }
        let needed = match self.convergence.last_difference {
            None => USUAL_DOUBLINGS,
            Some(difference) => (difference / CONVERGED).ln().max(0.0) / self.decay.ln(),
        };
        let count = needed.ceil().clamp(1.0, finest);
        // A geometric series of `count` pictures.
        let series = self.growth * (self.growth.powf(count) - 1.0) / (self.growth - 1.0);
        self.last_ms * series
    }

    /// Whether to double once more: as long as the next picture is thought to fit. The whole way is
    /// guessed too badly beforehand to decide by it (19 s for what took 0.8), and every doubling is
    /// some 12 dB.
    pub(super) fn goes_on(&self) -> bool {
        let left_ms = self.left_ms();
        let next_ms = left_ms.min(self.last_ms * self.growth);
        left_ms > 0.0 && self.spent_ms + next_ms * self.each <= self.within_ms
    }

    /// Shares of the way from `full` to the end that are behind, and that will be after one more.
    fn shares(&self) -> [f64; 2] {
        let left_ms = self.left_ms();
        if left_ms <= 0.0 {
            return [1.0; 2];
        }
        let next_ms = (self.last_ms * self.growth).min(left_ms);
        [self.spent_ms, self.spent_ms + next_ms].map(|ms| ms / (self.spent_ms + left_ms))
    }

    /// What a picture's report says of it.
    pub(super) fn report(&self) -> Refined {
        Refined { convergence: self.convergence, left_ms: self.left_ms() }
    }
}

impl Worker {
    /// Doubles the slabs of the `full` on the device, which is a share `full_share` of the whole
    /// way; publishes each picture once it is whole. The last of them, if any was drawn.
    pub(super) fn converge(
        &mut self,
        request: &FrameRequest,
        mut doublings: Doublings,
        full_share: f64,
    ) -> Result<Option<LastOfView>, DrawError> {
        if !doublings.goes_on() {
            return Ok(None);
        }
        if !self.holds_finished {
            // Another was drawn since, beside it.
            let manner = Manner::InPieces { show_partial: false, before: 0.0, after: full_share };
            self.drawn(request, Rung::Full, manner)?;
        }
        let mut last = None;
        let mut coarser = self.device()?.engines.read_light()?;
        let finished = self.finished.as_ref().map(|(_, full)| full);
        let checked = finished.and_then(|full| full.report.checked);
        let mut before = full_share;
        let of_whole = |share: f64| full_share + (1.0 - full_share) * share;
        while doublings.goes_on() {
            if self.newer_came() {
                return Err(DrawError::Interrupted);
            }
            let slabs_per_voxel = 2.0 * doublings.convergence.slabs_per_voxel;
            let splat = SplatSettings { slabs_per_voxel, ..request.scene.splat };
            let scene = Scene { splat, ..request.scene.clone() };
            let finer = FrameRequest { scene, ..request.clone() };
            let after = of_whole(doublings.shares()[1]).max(before);
            let learnt = self.device()?.costs;
            let manner = Manner::InPieces { show_partial: false, before, after };
            let (drawn, backend) = self.drawn(&finer, Rung::Full, manner)?;
            let drawer = self.device()?;
            // What more slabs cost says nothing of the next `full`.
            drawer.costs = learnt;
            let light = drawer.engines.read_light()?;
            doublings.drawn(drawn.wall_ms, greatest_difference(&light, &coarser));
            coarser = light;
            // Estimates may come and go; the bar does not go back.
            before = of_whole(doublings.shares()[0]).max(before);
            let progress = if doublings.goes_on() { before.min(0.99) } else { 1.0 };
            let level = LevelOfDetail::Refined(doublings.convergence);
            let mut picture = self.presented(&finer, level, progress, &drawn)?;
            picture.report.backend = backend;
            picture.report.refined = Some(doublings.report());
            picture.report.checked = checked;
            let thought = Told::thought(&request.plan(), self.last_told.as_ref());
            let doubled = slabs_per_voxel / request.scene.splat.slabs_per_voxel;
            picture.report.remaining_thought = Some(thought.with_slabs_doubled(doubled.log2()));
            let picture = Arc::new(picture);
            self.publish(Arc::clone(&picture));
            last = Some(LastOfView { request: finer, picture });
        }
        Ok(last)
    }
}

/// Greatest difference of a channel, alpha included, of two pictures of one size; infinite where a
/// pixel is no colour.
fn greatest_difference(first: &[[f32; 4]], second: &[[f32; 4]]) -> f64 {
    let channels = first.iter().flatten().zip(second.iter().flatten());
    channels
        .map(|(a, b)| f64::from((a - b).abs()))
        .fold(0.0, |most, d| if d.is_finite() { most.max(d) } else { f64::INFINITY })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after_full(within_ms: f64) -> Doublings {
        Doublings::after_full(&SplatSettings::EXACT, 10.0, (within_ms, 1.0)).unwrap()
    }

    #[test]
    fn only_slabs_are_doubled_and_only_where_that_is_wanted() {
        assert_eq!(Doublings::after_full(&SplatSettings::SHADE_FIRST, 10.0, (1e9, 1.0)), None);
        assert_eq!(Doublings::after_full(&SplatSettings::EXACT, 10.0, (0.0, 1.0)), None);
        let finest =
            SplatSettings { slabs_per_voxel: MOST_SLABS_PER_VOXEL, ..SplatSettings::EXACT };
        let finest = Doublings::after_full(&finest, 10.0, (1e9, 1.0)).unwrap();
        assert!(!finest.goes_on() && finest.left_ms() == 0.0, "{finest:?}");
    }

    #[test]
    fn it_begins_where_the_next_picture_fits_and_tells_the_whole_way() {
        let whole_ms = after_full(1.0).left_ms();
        // 19 + 36.1 + 68.6 + 130.3.
        assert!((whole_ms - 254.0).abs() < 0.1, "{whole_ms}");
        assert!(!after_full(18.0).goes_on());
        assert!(after_full(20.0).goes_on());
        // Where edges are smoothed after it, five of the next picture are to fit.
        let with_edges = |within_ms| {
            Doublings::after_full(&SplatSettings::EXACT, 10.0, (within_ms, 5.0)).unwrap()
        };
        assert!(!with_edges(94.0).goes_on() && with_edges(96.0).goes_on());
    }

    #[test]
    fn it_ends_when_two_pictures_are_the_same_or_the_next_would_take_too_long() {
        let mut doublings = after_full(300.0);
        doublings.drawn(20.0, 0.1);
        assert!(doublings.goes_on() && doublings.shares()[0] > 0.0);
        doublings.drawn(40.0, 0.001);
        assert!(doublings.convergence.is_reached() && !doublings.goes_on());
        assert_eq!((doublings.left_ms(), doublings.shares()), (0.0, [1.0; 2]));
        assert_eq!(doublings.convergence.slabs_per_voxel, 4.0);

        let mut doublings = after_full(300.0);
        doublings.drawn(20.0, 0.4);
        doublings.drawn(60.0, 0.2);
        assert!(doublings.goes_on(), "180 ms fit: {doublings:?}");
        doublings.drawn(180.0, 0.1);
        assert!(!doublings.goes_on(), "540 ms more do not: {doublings:?}");
        assert!(doublings.left_ms() > 540.0 && doublings.shares()[1] < 1.0);
        assert!(!doublings.convergence.is_reached());
        assert_eq!(doublings.convergence.slabs_per_voxel, 8.0);
    }

    #[test]
    fn the_greatest_difference_counts_alpha_and_takes_no_nonsense() {
        let grey = [[0.5_f32; 4]; 3];
        let mut other = grey;
        other[1][3] = 0.25;
        assert_eq!(greatest_difference(&grey, &grey), 0.0);
        assert_eq!(greatest_difference(&grey, &other), 0.25);
        other[2][0] = f32::NAN;
        assert_eq!(greatest_difference(&grey, &other), f64::INFINITY);
    }
}

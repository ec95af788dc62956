//! Which cut a quick picture is of, and how large it is: the pair that is thought to lose least within a time.

use super::{CutNumber, FieldCuts};
use crate::plan::{Plan, SlabField};
use crate::scene::Moving;
use crate::task::draw::Drawer;
use crate::task::engines::EngineKind;
use crate::task::previews::Reduction;

/// What is lost by leaving out pixels grows with the distance between them, as this power of it: 1.2 to 1.4 on three scans.
const SAMPLING_GROWTH: f64 = 1.35;

/// RMSE of a picture drawn twice smaller before any was seen: 36 to 53 dB on three scans.
const UNSEEN_SAMPLING: f64 = 8e-3;

/// A cut that was drawn last is kept where another one is thought to be nearer by less than this.
const WORTH_CHANGING: f64 = 0.9;

/// How far a measured picture moves what cuts are known to cost, as a share of the difference: one that took less time than
/// thought, and one that took more, for which a hand waits.
const TRUST: [f64; 2] = [0.5, 0.8];

/// Share of what was learnt that is left after each picture that is not of a cut: the machine may have been busy.
const KEPT: f64 = 0.9;

/// Cuts are never taken to need more, or less, time than thought by more than this factor.
const MOST_LONGER: f64 = 4.0;

impl FieldCuts {
    /// What a ray through a cut costs, of what one through all of a field does.
    pub(in crate::task) fn share(&self, number: CutNumber, field: SlabField) -> f64 {
        let longer = self.longer[field as usize].exp2();
        let engine = usize::from(self.engine == EngineKind::Gpu);
        self.candidate(number).map_or(1.0, |found| found.shares[engine][field as usize] * longer)
    }

    /// Takes in a picture: of a cut of which field, if of any, and how many times longer than was thought that took. Whether
    /// cuts can be so much dearer, or cheaper: else it is the field itself that costs another price.
    pub(in crate::task) fn learn(&mut self, drawn: Option<(SlabField, f64)>) -> bool {
        let most = MOST_LONGER.log2();
        let mut is_likely = true;
        for field in [SlabField::Own, SlabField::Preview] {
            let known = &mut self.longer[field as usize];
            let found = match drawn {
                Some((of, longer)) if of == field => {
                    is_likely = (*known + longer.log2()).abs() <= most;
                    *known + TRUST[usize::from(longer > 1.0)] * longer.log2()
                }
                _ => *known * KEPT,
            };
            *known = found.clamp(-most, most);
        }
        is_likely
    }

    /// Takes in what leaving out pixels is thought to have cost a picture that was drawn so many times smaller.
    pub(in crate::task) fn note_sampling(&mut self, shrink: f64, rmse: f64) {
        if shrink > 1.0 && rmse > 0.0 {
            self.sampling = Some((shrink, rmse));
        }
    }

    /// What it is thought to cost to draw a picture so many times smaller: RMSE.
    fn sampling_rmse(&self, shrink: f64) -> f64 {
        if shrink <= 1.0 {
            return 0.0;
        }
        let (at, rmse) = self.sampling.unwrap_or((2.0, UNSEEN_SAMPLING));
        rmse * (shrink / at).powf(SAMPLING_GROWTH)
    }
}

impl Drawer {
    /// What a quick picture is thought to lose: RMSE.
    pub(in crate::task) fn thought_rmse(&self, plan: &Plan, of: &Reduction) -> f64 {
        self.cuts.sampling_rmse(of.shrink).hypot(self.cuts.stand_in_rmse(plan, of.field, of.cut))
    }

    /// The cut and the size of a picture of a budget that are thought to lose least: those given, of all of a field, or a
    /// cut of one of the fields that are at hand. Where people chose one of both, that one.
    pub(in crate::task) fn with_cut(
        &self,
        plan: &Plan,
        whole: Reduction,
        budget_ms: f64,
    ) -> Reduction {
        let moving = match self.lacks_bricks(plan) {
            // Of all of the field there is no picture yet.
            true => Moving::Octree,
            false => plan.mode.cut.moving,
        };
        if moving == Moving::Subsampled || !self.has_cuts(plan) {
            return whole;
        }
        let of_whole = match moving {
            Moving::Octree => f64::INFINITY,
            _ => self.thought_rmse(plan, &whole),
        };
        let mut best = (of_whole, whole);
        for field in [SlabField::Own, SlabField::Preview] {
            if !self.is_at_hand(plan, field) || !self.has_room_for_means(field) {
                continue;
            }
            // All of a field as well, where what it loses was measured: in light more than fewer pixels do.
            let is_told = moving != Moving::Octree && self.cuts.measured.is_some();
            let numbers = (0..).take(self.cuts.of(plan).len()).map(Some);
            for cut in is_told.then_some(None).into_iter().chain(numbers) {
                let share = cut.map_or(1.0, |number| self.cuts.share(number, field));
                let shrink = self.affordable_at(field, share, plan.size, budget_ms);
                let found = Reduction { field, shrink, cut };
                let mut lost = self.thought_rmse(plan, &found);
                // What was drawn last stays where another is hardly better.
                if self.last_reduction.is_some_and(|l| (l.field, l.cut) == (field, found.cut)) {
                    lost *= WORTH_CHANGING;
                }
                if lost < best.0 {
                    best = (lost, found);
                }
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_that_took_long_is_dearer_and_is_tried_again_after_others() {
        let mut cuts = FieldCuts::default();
        let longer = |cuts: &FieldCuts| cuts.longer[SlabField::Own as usize].exp2();
        assert!(cuts.learn(Some((SlabField::Own, 4.0))));
        assert!((longer(&cuts).log2() - 1.6).abs() < 1e-12, "most of the way");
        assert!(cuts.learn(Some((SlabField::Own, 1.2))), "as dear as cuts may be");
        for _ in 0..9 {
            assert!(!cuts.learn(Some((SlabField::Own, 4.0))), "the field is dearer");
        }
        assert!((longer(&cuts) - MOST_LONGER).abs() < 1e-12, "no more than that");
        assert_eq!(cuts.longer[SlabField::Preview as usize], 0.0);
        for _ in 0..20 {
            cuts.learn(None);
        }
        assert!(longer(&cuts) < 1.2, "{}", longer(&cuts));
    }

    #[test]
    fn what_leaving_out_pixels_costs_grows_from_what_was_seen_last() {
        let mut cuts = FieldCuts::default();
        assert_eq!(cuts.sampling_rmse(1.0), 0.0);
        assert_eq!(cuts.sampling_rmse(2.0), UNSEEN_SAMPLING);
        cuts.note_sampling(1.5, 0.02);
        cuts.note_sampling(1.0, 0.5);
        assert_eq!(cuts.sampling_rmse(1.5), 0.02, "a picture of every pixel says nothing of it");
        assert!(cuts.sampling_rmse(3.0) > 2.0 * 0.02 && cuts.sampling_rmse(3.0) < 4.0 * 0.02);
    }
}

//! How far a coarse picture is thought to be from the finished one, and how far it turned out to be.

mod coarseness;
mod seen;

use crate::accuracy;
use crate::plan::Plan;
pub use coarseness::Coarseness;
use coarseness::KINDS;
pub(super) use coarseness::field_rmse;
pub(super) use seen::part_rmse;
pub use seen::{sampling_rmse, shown_rmse};

/// Share of the way that a check takes the gain towards what would have been right; the first one of
/// a mode takes it all the way.
const TRUST: f64 = 0.5;
/// A gain never leaves 1 by more than a factor of 2 to this power: it stays a number.
const MOST_DOUBLINGS: f64 = 10.0;

/// What a coarse picture was thought to be off by, and what it was. Root mean square over RGB, linear
/// light, as shown over its background.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checked {
    /// Thought before.
    pub estimated_rmse: f64,
    /// Found against the finished picture.
    pub measured_rmse: f64,
}

impl Checked {
    /// The estimate minus the truth in dB: positive where the picture was worse than thought.
    /// `None` where one of the two has no finite level.
    pub fn off_db(&self) -> Option<f64> {
        let level = accuracy::psnr_from_rmse;
        let off = level(self.estimated_rmse) - level(self.measured_rmse);
        off.is_finite().then_some(off)
    }
}

/// The model of a coarse picture's error: what its cut, its size and its shading are thought to
/// cost, times a gain learnt from the finished pictures of the same volume and mode.
#[derive(Debug, Clone, Default)]
pub struct Estimator {
    /// log₂ of the gain of each kind of coarseness.
    doublings: [f64; KINDS],
    /// Checks of each kind.
    checks: [u32; KINDS],
    learnt_from: Option<Plan>,
}

impl Estimator {
    /// The RMSE that a coarse picture of `plan` is thought to have, drawn `shrink` times smaller
    /// than it is shown.
    pub fn rmse(&self, plan: &Plan, coarseness: Coarseness, shrink: f64) -> f64 {
        let known = if self.knows(plan) { self.doublings[coarseness.kind()] } else { 0.0 };
        let first = coarseness.first_rmse(plan.mode.classify, shrink);
        first.max(coarseness.least_rmse()) * known.exp2()
    }

    /// Takes in what a coarse picture of `plan` turned out to be.
    pub fn learn(&mut self, plan: &Plan, coarseness: Coarseness, checked: &Checked) {
        if !self.knows(plan) {
            (self.doublings, self.checks) = Default::default();
            self.learnt_from = Some(plan.clone());
        }
        let off = (checked.measured_rmse / checked.estimated_rmse).log2();
        if off.is_finite() {
            let kind = coarseness.kind();
            let trust = if self.checks[kind] == 0 { 1.0 } else { TRUST };
            self.checks[kind] += 1;
            let doublings = &mut self.doublings[kind];
            *doublings = (*doublings + trust * off).clamp(-MOST_DOUBLINGS, MOST_DOUBLINGS);
        }
    }

    fn knows(&self, plan: &Plan) -> bool {
        let is_like = |of: &Plan| of.has_same_samples(plan) && of.mode == plan.mode;
        self.learnt_from.as_ref().is_some_and(is_like)
    }
}

#[cfg(test)]
mod tests {
    use super::coarseness::*;
    use super::seen::light_rms;
    use super::seen::tests::picture;
    use super::*;
    use crate::core::colour::linear_from_srgb;
    use crate::core::{Srgb8, Ticket};
    use crate::kernel::Kernel;
    use crate::plan::SlabField;
    use crate::scene::{Background, Classify};
    use crate::task::draw::{Drawn, Rung};
    use std::sync::Arc;

    use crate::scene::{Scene, VectorLayer};
    use crate::volume::{Lattice, Places, ScalarVolume, VectorField};

    fn plan(classify: Classify) -> Plan {
        Plan::of(&scene(classify), [32, 24])
    }

    fn scene(classify: Classify) -> Scene {
        use crate::volume::{Lattice, Samples};
        let samples = Samples::UInt8((0..8).collect());
        let volume = ScalarVolume::from_samples("ramp", Lattice::unit([2; 3]), samples).unwrap();
        let mut scene = crate::scene::opening(Default::default(), Arc::new(volume), None);
        scene.splat.classify = classify;
        scene
    }

    const REDUCED: Coarseness = Coarseness::Reduced {
        sampling_rmse: 0.05,
        field: SlabField::Own,
        field_rmse: 0.0,
        cut_rmse: None,
    };

    const CUT: Coarseness = Coarseness::Octree { max_error: 0.01, missing_rmse: 0.0 };

    #[test]
    fn estimates_come_to_what_was_found_and_begin_anew_for_another_mode() {
        let (before, after) = (plan(Classify::Before), plan(Classify::PreIntegrated));
        let mut estimator = Estimator::default();
        let first = estimator.rmse(&before, CUT, 1.0);
        let reduced = estimator.rmse(&before, REDUCED, 4.0);
        for _ in 0..20 {
            let estimated_rmse = estimator.rmse(&before, CUT, 1.0);
            estimator.learn(&before, CUT, &Checked { estimated_rmse, measured_rmse: 0.03 });
        }
        let learnt = estimator.rmse(&before, CUT, 1.0);
        assert!((learnt / 0.03 - 1.0).abs() < 1e-3 && learnt != first, "{first} {learnt}");
        assert_eq!(estimator.rmse(&before, REDUCED, 4.0), reduced, "another kind");
        let fresh = Estimator::default().rmse(&after, CUT, 1.0);
        assert_eq!(estimator.rmse(&after, CUT, 1.0), fresh);
        assert!(fresh >= SHADE_FIRST_RMSE, "shade first costs something: {fresh}");
    }

    /// What tents cost is no matter of what the own field costs, and what one is found to cost
    /// teaches nothing about the other.
    #[test]
    fn tents_are_thought_to_be_worse_and_are_learnt_apart() {
        let scene = plan(Classify::PreIntegrated);
        let tents = Coarseness::Reduced {
            sampling_rmse: 0.05,
            field: SlabField::Preview,
            field_rmse: TENTS_RMSE,
            cut_rmse: None,
        };
        let mut estimator = Estimator::default();
        let of = |estimator: &Estimator| {
            [CUT, REDUCED, tents].map(|kind| estimator.rmse(&scene, kind, 2.0))
        };
        let first = of(&estimator);
        assert_eq!(first[1], 0.05);
        assert!((first[2] - 0.05_f64.hypot(0.004)).abs() < 1e-12, "and tents: {first:?}");
        for (kind, coarseness) in [CUT, REDUCED, tents].into_iter().enumerate() {
            let before = of(&estimator);
            let estimated_rmse = before[kind];
            let measured_rmse = 2.0 * estimated_rmse;
            estimator.learn(&scene, coarseness, &Checked { estimated_rmse, measured_rmse });
            for (other, (before, after)) in before.into_iter().zip(of(&estimator)).enumerate() {
                let times = if other == kind { 2.0 } else { 1.0 };
                assert!((after / before - times).abs() < 1e-9, "{kind} {other}: {after}");
            }
        }
        let own = first_of_whole(SlabField::Own);
        assert!(first_of_whole(SlabField::Preview) > 3.0 * own, "even whole, tents are off: {own}");
    }

    /// Nor does a field teach anything about the vectors in it. Means are off by a share of the light that
    /// they give, whatever lies behind it; vectors that are all there, by less, as their marks are blurred.
    #[test]
    fn means_of_vectors_are_thought_to_be_off_by_a_share_of_their_light() {
        let (grey, lit) = (Srgb8([40; 3]), linear_from_srgb(200.0 / 255.0));
        let behind = linear_from_srgb(40.0 / 255.0);
        let picture = picture([40, 30], [80, 60], |x, _| if x < 10 { 200 } else { 40 });
        let rms = light_rms(Background::Colour(grey), &picture.rgba);
        assert!((rms - (lit - behind) / 2.0).abs() < 1e-9, "{rms}");
        // Each colour counts; of large pictures some pixels are looked at, and behind transparent ones is nothing.
        let large: Vec<u8> = [[40, 40, 40, 255], [200, 40, 120, 255]].repeat(90_000).concat();
        let of_three = light_rms(Background::Colour(grey), &large[..4 * 60_000]);
        let middle = linear_from_srgb(120.0 / 255.0) - behind;
        let expected = ((lit - behind).powi(2) + middle.powi(2)) / 6.0;
        assert!((of_three - expected.sqrt()).abs() < 1e-9, "{of_three}");
        let white = vec![200; 4 * 300_000];
        assert!((light_rms(Background::Transparent, &white) - lit).abs() < 1e-9);
        let mut scene = scene(Classify::PreIntegrated);
        scene.background = Background::Colour(grey);
        let field = Plan::of(&scene, [32, 24]);
        let mut scene = scene.with(vectors());
        scene.show_field(false);
        let scene = Plan::of(&scene, [32, 24]);
        let of = |averaged: usize, scene: &Plan| {
            let drawn = Drawn {
                size: picture.size,
                is_reduced: true,
                vectors_averaged: averaged,
                ..Drawn::default()
            };
            let rung = Rung::Reduced { field: SlabField::Own, shrink: 2.0 };
            Coarseness::of(scene, rung, &drawn, 2.0, &picture.rgba).unwrap()
        };
        let mut estimator = Estimator::default();
        let [all, means] = [0, 2].map(|n| estimator.rmse(&scene, of(n, &scene), 2.0));
        let plain = field;
        let field = estimator.rmse(&plain, of(0, &plain), 2.0);
        // Halved once.
        assert!((all - field.hypot(BLUR_SHARE * rms)).abs() < 1e-12, "{all} {field}");
        assert!((means - field.hypot(MEANS_SHARE * rms)).abs() < 1e-12, "{means} {field}");
        let checked = Checked { estimated_rmse: means, measured_rmse: means / 3.0 };
        estimator.learn(&scene, of(2, &scene), &checked);
        assert!((estimator.rmse(&scene, of(2, &scene), 2.0) * 3.0 / means - 1.0).abs() < 1e-9);
        assert_eq!(estimator.rmse(&plain, of(0, &plain), 2.0), field);
        assert_eq!(
            estimator.rmse(&scene, of(0, &scene), 2.0),
            all,
            "what means cost is no pixels' matter"
        );
        // Of every pixel, it is the finished picture, unless means stand for some of its vectors.
        let whole = |vectors_averaged| {
            let drawn = Drawn {
                size: picture.size,
                is_reduced: true,
                vectors_averaged,
                ..Drawn::default()
            };
            let rung = Rung::Reduced { field: SlabField::Own, shrink: 1.0 };
            Coarseness::of(&scene, rung, &drawn, 1.0, &picture.rgba)
        };
        assert_eq!(whole(0), None);
        assert!(matches!(
            whole(1),
            Some(Coarseness::Vectors { sampling_rmse: 0.0, are_means: true, .. })
        ));
    }

    fn vectors() -> VectorLayer {
        let places = Places::Lattice(Lattice::unit([2, 1, 1]));
        let vectors = vec![glam::Vec3::X; 2].into();
        let field = VectorField::new("v", places, vectors, &Ticket::new()).unwrap();
        VectorLayer::new(Arc::new(field))
    }

    /// Of a picture without detail.
    fn first_of_whole(field: SlabField) -> f64 {
        let field_rmse = field_rmse(&plan(Classify::PreIntegrated), field);
        let whole = Coarseness::Reduced { sampling_rmse: 0.0, field, field_rmse, cut_rmse: None };
        Estimator::default().rmse(&plan(Classify::PreIntegrated), whole, 1.0)
    }

    #[test]
    fn a_coarser_cut_and_a_smaller_picture_are_thought_to_be_worse() {
        let (scene, estimator) = (plan(Classify::Before), Estimator::default());
        let worse = Coarseness::Octree { max_error: 0.1, missing_rmse: 0.0 };
        assert!(estimator.rmse(&scene, worse, 1.0) > estimator.rmse(&scene, CUT, 1.0));
        let holes = Coarseness::Octree { max_error: 0.01, missing_rmse: 0.2 };
        let rmse = estimator.rmse(&scene, holes, 1.0);
        assert!((0.2..0.21).contains(&rmse), "dark pixels add to the rest: {rmse}");
        assert!(estimator.rmse(&scene, CUT, 3.0) > estimator.rmse(&scene, CUT, 1.5));
        let richer = Coarseness::Reduced {
            sampling_rmse: 0.1,
            field: SlabField::Own,
            field_rmse: 0.0,
            cut_rmse: None,
        };
        assert!(estimator.rmse(&scene, richer, 2.0) > estimator.rmse(&scene, REDUCED, 2.0));
    }

    /// What a cut of the field costs adds to the rest, and what is learnt of cuts says nothing of the whole field.
    #[test]
    fn cuts_of_the_field_are_thought_of_and_learnt_apart() {
        let (plan, mut estimator) = (plan(Classify::PreIntegrated), Estimator::default());
        let own = SlabField::Own;
        let cut = |cut_rmse| Coarseness::Reduced {
            sampling_rmse: 0.03,
            field: own,
            field_rmse: 0.0,
            cut_rmse,
        };
        let rmse = |estimator: &Estimator, cut_rmse| estimator.rmse(&plan, cut(cut_rmse), 2.0);
        assert!((rmse(&estimator, Some(0.04)) - 0.05).abs() < 1e-12);
        let checked = Checked { estimated_rmse: 0.05, measured_rmse: 0.1 };
        estimator.learn(&plan, cut(Some(0.04)), &checked);
        assert!((rmse(&estimator, Some(0.04)) - 0.1).abs() < 1e-12);
        assert!((rmse(&estimator, None) - 0.03).abs() < 1e-12);
    }

    #[test]
    fn what_is_lit_is_further_off_in_another_field() {
        let mut lit = plan(Classify::PreIntegrated);
        assert_eq!(field_rmse(&lit, SlabField::Preview), TENTS_RMSE);
        lit.shading.lighting = Some(crate::scene::Lighting::default());
        assert_eq!(field_rmse(&lit, SlabField::Preview), LIT_TENTS_RMSE);
        lit.mode.kernel = Kernel::Cells;
        assert_eq!(field_rmse(&lit, SlabField::Preview), LIT_TENTS_OF_CELLS_RMSE);
        assert_eq!(field_rmse(&lit, SlabField::Own), 0.0);
    }

    /// Rungs of other ladders are learnt like any other coarse picture.
    #[test]
    fn subsampled_pictures_and_cheaper_kernels_have_estimates_of_their_own() {
        let scene = plan(Classify::Before);
        let kinds = [
            Coarseness::Subsampled { max_error: 1.0 },
            Coarseness::Cheaper(Kernel::Point),
            Coarseness::Cheaper(Kernel::Nearest),
        ];
        let mut estimator = Estimator::default();
        let of = |estimator: &Estimator| kinds.map(|kind| estimator.rmse(&scene, kind, 1.0));
        assert_eq!(of(&estimator), [PER_ERROR * 1.5, POINTS_RMSE, NEAREST_RMSE]);
        for (kind, coarseness) in kinds.into_iter().enumerate() {
            let before = of(&estimator);
            let estimated_rmse = before[kind];
            let checked = Checked { estimated_rmse, measured_rmse: 0.5 * estimated_rmse };
            estimator.learn(&scene, coarseness, &checked);
            for (other, (before, after)) in before.into_iter().zip(of(&estimator)).enumerate() {
                let times = if other == kind { 0.5 } else { 1.0 };
                assert!((after / before - times).abs() < 1e-9, "{kind} {other}: {after}");
            }
        }
    }

    #[test]
    fn a_perfect_or_broken_check_teaches_nothing_wild() {
        let scene = plan(Classify::Before);
        for measured_rmse in [0.0, f64::NAN, f64::INFINITY, 1e300] {
            let mut estimator = Estimator::default();
            estimator.learn(&scene, CUT, &Checked { estimated_rmse: 0.01, measured_rmse });
            let estimate = estimator.rmse(&scene, CUT, 1.0);
            assert!(estimate > 0.0 && estimate < 10.0, "{measured_rmse}: {estimate}");
        }
        let perfect = Checked { estimated_rmse: 0.01, measured_rmse: 0.0 };
        assert_eq!(perfect.off_db(), None);
        let worse = Checked { estimated_rmse: 0.01, measured_rmse: 0.1 };
        assert!((worse.off_db().unwrap() - 20.0).abs() < 1e-9);
    }
}

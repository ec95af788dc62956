//! How far a coarse picture is thought to be from the finished one, and how far it turned out to be.

mod coarseness;
mod seen;

use crate::accuracy;
use crate::core::{Camera, Projection};
use crate::plan::{Plan, Way};
pub use coarseness::Coarseness;
use coarseness::KINDS;
pub(super) use coarseness::field_rmse;
use seen::Losses;
pub(super) use seen::part_rmse;
pub use seen::{sampling_rmse, shown_rmse};

/// Share of the way that a check takes the gain towards what would have been right; the first one of
/// a mode takes it all the way.
const TRUST: f64 = 0.5;
/// What leaving out pixels costs is told from a quick picture itself within so many dB rms: 1.9 and 2.3 of scans at 64 × 48 pixels for
/// 160 × 120.
const ALONE_DB: f64 = 2.1;
/// And from the finished picture of a view before it within so many dB for each radian between the two: 0.8 dB there after a turn of
/// 0.16 rad, 2.4 after 0.42, 2.2 after 1.3.
const DB_A_RADIAN: f64 = 5.0;
/// At least.
const BEFORE_DB: f64 = 0.5;
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
    /// The last view at rest, and what leaving out pixels of its finished picture costs.
    seen: Option<(Plan, Losses)>,
}

impl Estimator {
    /// The RMSE that a coarse picture of `plan` is thought to have, drawn `shrink` times smaller
    /// than it is shown.
    ///
    /// Of a smaller picture in slabs what it is of was measured, and what leaving out pixels costs is held to the finished picture
    /// that was seen before it (`see`): no gain is applied to that. What gains are learnt from is farther off.
    pub fn rmse(&self, plan: &Plan, coarseness: Coarseness, shrink: f64) -> f64 {
        match self.held_to_seen(plan, coarseness, shrink) {
            Some(held) => held.first_rmse(plan.mode.classify, shrink).max(held.least_rmse()),
            None => self.learnt_rmse(plan, coarseness, shrink),
        }
    }

    /// Takes in the finished picture of a view at rest; `size` and `rgba` as in [`crate::task::engine::Picture`].
    pub(in crate::task) fn see(&mut self, plan: &Plan, size: [u32; 2], rgba: &[u8]) {
        self.seen = (plan.way == Way::Slabs).then(|| (plan.clone(), Losses::of(size, rgba)));
    }

    /// The same coarseness, but for what leaving out pixels costs: by what the picture shows of that itself, and by what it costs the
    /// finished picture of a view before. In dB the mean of both by the squares of what they are off by, so that the latter counts
    /// for 5/6 at 0.15 rad and for half at 0.4. `None` where no like picture was seen.
    fn held_to_seen(&self, plan: &Plan, coarseness: Coarseness, shrink: f64) -> Option<Coarseness> {
        let Coarseness::Reduced { sampling_rmse, field, field_rmse, cut_rmse } = coarseness else {
            return None;
        };
        let (seen, losses) = self.seen.as_ref()?;
        let apart = apart(seen, plan)?;
        if shrink <= 1.0 {
            return Some(coarseness);
        }
        let before = losses.rmse(shrink)?;
        let [alone_db, before_db] = [ALONE_DB, BEFORE_DB.hypot(DB_A_RADIAN * apart)];
        let weight = alone_db.powi(2) / (alone_db.powi(2) + before_db.powi(2));
        let sampling_rmse = before.powf(weight) * sampling_rmse.powf(1.0 - weight);
        Some(Coarseness::Reduced { sampling_rmse, field, field_rmse, cut_rmse })
    }

    /// By the model and a gain.
    fn learnt_rmse(&self, plan: &Plan, coarseness: Coarseness, shrink: f64) -> f64 {
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
        // Of what is held to a picture that was seen there is no gain.
        let estimated_rmse = match coarseness {
            Coarseness::Reduced { .. } => self.learnt_rmse(plan, coarseness, 1.0),
            _ => checked.estimated_rmse,
        };
        let off = (checked.measured_rmse / estimated_rmse).log2();
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

/// How far apart two views are of which the same is to be seen, radians: by how much one is turned from the other, larger (log),
/// and moved (halves of the height that is seen). `None` where anything else differs.
fn apart(seen: &Plan, plan: &Plan) -> Option<f64> {
    let [a, b]: [&Camera; 2] = [&seen.camera, &plan.camera];
    let is_parallel = |of: &Camera| of.projection == Projection::Orthographic;
    let Plan { camera, size, enlarged, way, .. } = *seen;
    let left_out = seen.left_out.clone();
    let moved = Plan { camera, size, enlarged, way, left_out, ..plan.clone() };
    if moved != *seen || is_parallel(a) != is_parallel(b) {
        return None;
    }
    let [was, is] = [seen, plan].map(|plan| plan.view().voxel_pixels());
    let larger = (is / was).ln().abs();
    let turned = a.direction.dot(b.direction).clamp(-1.0, 1.0).acos();
    let moved = (b.focal_point - a.focal_point).length() / b.parallel_scale;
    Some(turned + larger + moved).filter(|apart| apart.is_finite())
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

    /// What pixels that are left out cost a view that has turned is thought of by the finished picture before, the more the less it has
    /// turned; and no gain is applied to that, nor one learnt from it.
    #[test]
    fn quick_pictures_are_held_to_what_was_seen_before() {
        let at_rest = plan(Classify::PreIntegrated);
        let lines = picture([160, 120], [160, 120], |x, _| if x / 3 % 2 == 0 { 200 } else { 40 });
        let mut estimator = Estimator::default();
        let alone = estimator.rmse(&at_rest, REDUCED, 2.0);
        assert_eq!(alone, 0.05);
        estimator.learn(&at_rest, REDUCED, &Checked { estimated_rmse: 0.05, measured_rmse: 0.2 });
        assert!((estimator.rmse(&at_rest, REDUCED, 2.0) - 0.2).abs() < 1e-12, "by a gain");
        estimator.see(&at_rest, lines.size, &lines.rgba);
        let before = Losses::of(lines.size, &lines.rgba).rmse(2.0).unwrap();
        assert!(before > 1.5 * alone, "{before}");
        let turned = |angle: f64| {
            let camera = at_rest.camera.orbited(angle, 0.0);
            Plan { camera, ..at_rest.clone() }
        };
        let told = [0.0, 0.15, 0.4, 1.2].map(|angle| {
            let rmse = estimator.rmse(&turned(angle), REDUCED, 2.0);
            (rmse / alone).ln() / (before / alone).ln()
        });
        for (weight, expected) in told.into_iter().zip([0.95, 0.84, 0.51, 0.11]) {
            assert!((weight - expected).abs() < 0.01, "{told:?}");
        }
        // Of every pixel, from another field: that alone.
        let of_cut = Coarseness::Reduced {
            sampling_rmse: 0.0,
            field: SlabField::Own,
            field_rmse: 0.0,
            cut_rmse: Some(0.03),
        };
        assert_eq!(estimator.rmse(&turned(0.1), of_cut, 1.0), 0.03);
        // Nothing is known of other light.
        let mut lit = at_rest.clone();
        lit.shading.lighting = Some(crate::scene::Lighting::default());
        assert!((estimator.rmse(&lit, REDUCED, 2.0) - 0.2).abs() < 1e-12);
        let told = estimator.rmse(&turned(0.1), REDUCED, 2.0);
        let checked = Checked { estimated_rmse: told, measured_rmse: 0.2 };
        estimator.learn(&turned(0.1), REDUCED, &checked);
        assert!((estimator.rmse(&lit, REDUCED, 2.0) - 0.2).abs() < 1e-12, "the gain was right");
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

//! Vectors beside a field in quick pictures, and while that is not on the device yet.
//!
//! Measured on llvmpipe (LLVM 15, Mesa 22.3.6).

use std::sync::Arc;

use voxsplat::accuracy::Difference;
use voxsplat::gpu::SlabField;
use voxsplat::kernel::Kernel;
use voxsplat::scene::{Effect, Order, Reconstruction, Scene, SplatSettings};
use voxsplat::task::draw::Rung;
use voxsplat::task::engine::{Effort, EngineState};
use voxsplat::task::level::LevelOfDetail;

use crate::engine::{Bench, rest};
use crate::support::{beside_field, drawer, drawn, volume_of, with_field};
use crate::vectors::{PICTURE, alone, expected};

fn beside() -> Scene {
    beside_field(alone())
}

/// The same values, as another volume: what another field or component of the file is to the engine.
fn of_another_volume(scene: Scene) -> Scene {
    let volume = Arc::new((**volume_of(&scene)).clone());
    with_field(scene, volume)
}

#[test]
fn another_field_beside_vectors_is_drawn_and_never_without_them() {
    let Some(bench) = Bench::new() else { return };
    bench.request(&beside(), PICTURE, rest());
    let first = bench.until_full(PICTURE);
    bench.request(&of_another_volume(beside()), PICTURE, rest());
    let pictures = bench.until_full(PICTURE);
    let last = |pictures: &[Arc<voxsplat::task::engine::Picture>]| pictures.last().cloned();
    let (first, second) = (last(&first).expect("a picture"), last(&pictures).expect("a picture"));
    assert!(first.rgba == second.rgba, "the same values make another picture");
    for picture in &pictures {
        let is_cut = matches!(picture.report.level, LevelOfDetail::Octree { .. });
        assert!(
            !is_cut && picture.report.effects.contains(&Effect::Vectors),
            "{:?}",
            picture.report
        );
    }
}

#[test]
fn a_moving_hand_has_the_field_alone_until_it_is_reconstructed_and_is_told_that_much_is_missing() {
    let Some(bench) = Bench::new() else { return };
    bench.request(&beside(), PICTURE, rest());
    bench.until_full(PICTURE);
    let mut smooth = of_another_volume(beside());
    // No field for previews stands in for it.
    (smooth.splat.kernel, smooth.splat.reconstruction) = (Kernel::Linear, Reconstruction::Smooth);
    bench.request(&smooth, PICTURE, Effort::Moving { budget_ms: 20.0 });
    let pictures = bench.pictures_until(|bench, seen| {
        !seen.is_empty() && bench.engine.state() == EngineState::Idle
    });
    let report = &pictures[0].report;
    assert!(matches!(report.level, LevelOfDetail::Octree { .. }), "{report:?}");
    assert!(report.effects.is_empty(), "{report:?}");
    // As much light as is on it, it is thought.
    assert!(report.estimated_rmse.is_some_and(|rmse| rmse > 0.01), "{report:?}");
    bench.request(&smooth, PICTURE, rest());
    let full = bench.until_full(PICTURE);
    assert!(full.last().is_some_and(|picture| picture.report.effects.contains(&Effect::Vectors)));
}

/// Slabs of vectors are twice as thick there as those of the field, which share each out.
#[test]
fn quick_pictures_share_vectors_out_and_keep_their_light() {
    let Some(mut drawer) = drawer() else { return };
    for order in [Order::FrontToBack, Order::BackToFront] {
        let scene = Scene { splat: SplatSettings { order, ..SplatSettings::EXACT }, ..beside() };
        let expected = expected(&scene, PICTURE);
        let rung = Rung::Reduced { field: SlabField::Own, shrink: 1.25 };
        let shown = PICTURE.map(|n| n * 5 / 4);
        let (found, how) = drawn(&mut drawer, &scene, shown, rung);
        assert_eq!((how.size, how.vectors_averaged), (PICTURE, 0));
        let sum = |light: &[[f64; 4]], c: usize| light.iter().map(|p| p[c]).sum::<f64>();
        let kept = [0, 1, 2, 3].map(|c| sum(&found, c) / sum(&expected, c));
        let rmse = Difference::between(&found, &expected).expect("comparable").rmse;
        println!("{order:?}: of each channel {kept:.4?}, rmse {rmse:.2e}");
        assert!(kept.iter().all(|kept| (0.99..1.01).contains(kept)), "{kept:?}");
        // Measured: 0.993 to 1.007, and 2.4e-3.
        assert!(rmse < 5e-3, "{rmse}");
    }
}

/// By how often pixels look at splats, which says that smaller pictures have fewer of them.
#[test]
fn quick_pictures_are_as_small_as_their_vectors_are_dear() {
    let Some(mut drawer) = drawer() else { return };
    let size = [200, 160];
    for scene in [beside(), alone()] {
        // Its field is there from then on.
        drawn(&mut drawer, &scene, size, Rung::Full);
        let mut at = |visit_ms: f64| {
            (drawer.costs.visit_ms, drawer.costs.lists_ms) = (visit_ms, 0.0);
            (drawer.costs.reduced_ray_ms, drawer.costs.ray_ms) = ([1e-9; 2], 1e-9);
            drawn(&mut drawer, &scene, size, Rung::Coarse { budget_ms: 100.0 }).1.size
        };
        assert_eq!(at(1e-12), size, "next to nothing");
        assert_eq!(at(1.0)[1], 48, "more than there is");
        let between = at(4e-4);
        assert!(between[0] < size[0] && between[1] > 48, "{between:?}");
    }
}

//! Vectors beside a field that is not on the device yet: what the engine shows meanwhile, and in the end.

use std::sync::Arc;

use voxsplat::kernel::Kernel;
use voxsplat::scene::{Reconstruction, Scene};
use voxsplat::task::engine::{Effort, EngineState};

use crate::engine::{Bench, rest};
use crate::vectors::{PICTURE, alone, with};

fn beside() -> Scene {
    with(alone(), |layer| layer.alone = false)
}

/// The same values, as another volume: what another field or component of the file is to the engine.
fn of_another_volume(mut scene: Scene) -> Scene {
    scene.volume = Arc::new((*scene.volume).clone());
    scene
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
        assert!(!picture.report.rung.contains("octree"), "{:?}", picture.report.rung);
        assert!(picture.report.effects.contains(&"vectors"), "{:?}", picture.report);
    }
}

#[test]
fn a_moving_hand_has_the_field_alone_until_it_is_reconstructed_and_no_estimate_of_it() {
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
    assert!(report.rung.starts_with("coarse, octree"), "{report:?}");
    assert!(report.effects.is_empty() && report.estimated_rmse.is_none(), "{report:?}");
    bench.request(&smooth, PICTURE, rest());
    let full = bench.until_full(PICTURE);
    assert!(full.last().is_some_and(|picture| picture.report.effects.contains(&"vectors")));
}

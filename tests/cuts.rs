//! Cuts of a field at several levels: quick pictures drawn from means where these show it well.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::{Arc, mpsc};
use std::time::Duration;

use glam::Vec3;
use voxsplat::accuracy;
use voxsplat::core::{Projection, Ticket};
use voxsplat::gpu::Wishes;
use voxsplat::hierarchy::{BrickErrors, Means};
use voxsplat::plan::Plan;
use voxsplat::polygons::Mesh;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    self, Amounts, Classify, Clip, ClipBox, Index, Inside, Isosurface, Lighting, Moving, Order,
    PolygonLayer, SampleSource, Scene, Slice, SplatSettings,
};
use voxsplat::task::cuts::{cut_within, stored_levels, why_no_cut_of};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engine::{
    CellsRequest, Choice, Effort, Engine, EngineChoice, FrameRequest, Ladder, Picture,
};
use voxsplat::task::engines::Engines;
use voxsplat::task::level::LevelOfDetail;
use voxsplat::task::still::{Refine, Still, StillRequest};
use voxsplat::transfer::{Cumulative, Weight};
use voxsplat::volume::{Component, demo};

const SIZE: [u32; 2] = [128, 96];

fn opened(name: &str) -> Scene {
    let grid = demo::open(name, None).unwrap();
    let field = grid.field(None).unwrap();
    let volume = grid.scalar(field, Component::Index(0), &Ticket::new()).unwrap();
    let mut scene = scene::opening(SampleSource::default(), Arc::new(volume), None);
    scene.splat = SplatSettings::EXACT;
    scene
}

/// Premultiplied linear colour and opacity, rows from the top.
type Light = Vec<[f32; 4]>;

/// A picture of a scene, and of cuts of its field whose bricks are off by no more than some errors, with their bricks.
fn drawn(scene: &Scene, most: &[f32]) -> (Light, Vec<([u64; 3], Light)>) {
    let engines = Engines::new(EngineChoice::Native.into(), Wishes::default()).unwrap();
    let mut drawer = Drawer::with(engines);
    let plan = Plan::of(scene, SIZE);
    let ticket = Ticket::new();
    drawer.prepare(&plan, &ticket).unwrap();
    drawer.draw(&plan, Rung::Full, &mut ()).unwrap();
    let whole = drawer.engines.native.light().0;
    let volume = scene.volume().unwrap();
    let means = Means::of(volume, &ticket).unwrap().unwrap();
    let function = Cumulative::new(
        scene.transfer().unwrap(),
        volume.samples.scalar_type(),
        &volume.statistics,
        Weight::Extinction,
    );
    let (bricks, shown) = drawer.engines.native.shown_bricks().unwrap();
    let shown = shown.to_vec();
    let asked = (bricks, &shown[..]);
    let errors = BrickErrors::of(volume, &means, (&function, 1.0), asked, &ticket).unwrap().errors;
    drawer.engines.native.set_levels(stored_levels(volume, &means, &ticket).unwrap());
    let cuts = most.iter().map(|&most| {
        let cut = cut_within(most, bricks, &shown, &errors);
        let counts = cut.counts();
        let plan = Plan { cut: Some(Arc::new(cut)), ..plan.clone() };
        drawer.draw(&plan, Rung::Full, &mut ()).unwrap();
        (counts, drawer.engines.native.light().0)
    });
    let cuts = cuts.collect();
    (whole, cuts)
}

fn db(found: &[[f32; 4]], expected: &[[f64; 4]]) -> f64 {
    let found: Vec<[f64; 4]> = found.iter().map(|pixel| pixel.map(f64::from)).collect();
    accuracy::psnr_from_rmse(accuracy::rmse(&found, expected).unwrap())
}

fn reference(scene: &Scene) -> Vec<[f64; 4]> {
    Reference::new(scene, SIZE.map(|n| n as usize)).unwrap().picture()
}

/// Where no brick may be off, all of it is drawn from the samples, but for faces at which gaps end.
#[test]
fn a_cut_without_error_is_the_picture_of_the_whole_field() {
    for name in ["demo:head:48", "demo:shells:32"] {
        let (whole, cuts) = drawn(&opened(name), &[-1.0]);
        let whole: Vec<[f64; 4]> = whole.iter().map(|pixel| pixel.map(f64::from)).collect();
        let (counts, light) = &cuts[0];
        let off = db(light, &whole);
        println!("measured {name}: {off:.1} dB, {counts:?} bricks");
        assert!(counts[0] > 100 && counts[1] + counts[2] == 0);
        // Measured 108 and 116 dB.
        assert!(off > 100.0, "{name}: {off:.1} dB");
    }
}

/// Against the float64 reference of the whole field: the less a brick may be off, the nearer; and whatever stands in the
/// scene stands in its cuts.
#[test]
fn pictures_of_cuts_are_as_near_to_the_reference_as_their_bricks_are_to_the_samples() {
    let plain = opened("demo:head:48");
    let mut lit = plain.clone();
    lit.shading.lighting = Some(Lighting::default());
    let mut near = plain.clone();
    near.camera.projection = Projection::Perspective { view_angle: 40.0_f64.to_radians() };
    let mut clipped = lit.clone();
    let bounds = Some(ClipBox { low: [0.0; 3], high: [1.0, 0.55, 1.0] });
    clipped.inside = Inside { clip: Clip { bounds, ..Clip::default() }, ..Inside::default() };
    let mut sliced = plain.clone();
    sliced.inside.slices = vec![Slice::across(&plain.lattice(), 1, 0.4, 1.0)];
    let corners = [[-0.9, -0.8, -0.7], [0.9, -0.7, 0.2], [0.1, 0.9, 0.6]];
    let centre = plain.lattice().centre().as_vec3();
    let size = plain.lattice().spacing[0] as f32 * 24.0;
    let corners = corners.map(|corner| centre + Vec3::from(corner) * size).to_vec();
    let mesh = Mesh::new("t", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]).unwrap();
    let among = plain.clone().with(PolygonLayer::new(Arc::new(mesh)));
    let scenes = [
        ("plain", plain),
        ("lit", lit),
        ("in perspective", near),
        ("clipped", clipped),
        ("sliced", sliced),
        ("beside polygons", among),
    ];
    for (name, scene) in scenes {
        let truth = reference(&scene);
        let (whole, cuts) = drawn(&scene, &[0.002, 0.02, 9.0]);
        let found: Vec<f64> = cuts.iter().map(|(_, light)| db(light, &truth)).collect();
        let counts: Vec<[u64; 3]> = cuts.iter().map(|(counts, _)| *counts).collect();
        println!(
            "measured {name}: whole {:.1}, cuts {found:.1?} dB of {counts:?}",
            db(&whole, &truth)
        );
        assert!(counts[1][0] > 0 && counts[1][2] > 0, "two levels at least: {counts:?}");
        assert!(found[0] > found[1] && found[1] > found[2], "{name}: {found:?}");
        // Measured 54.5 to 68, 40.6 to 45.6, and 14.6 to 18 dB.
        assert!(found[0] > 53.0 && found[1] > 39.0, "{name}: {found:?}");
        assert!(found[2] < 20.0, "{name}: means alone are another picture: {found:?}");
    }
}

fn engine() -> (Engine, mpsc::Receiver<()>) {
    let (sender, receiver) = mpsc::channel();
    let choice = Choice::from(EngineChoice::Native);
    (Engine::start(choice, move || sender.send(()).unwrap_or_default()), receiver)
}

fn next(engine: &Engine, wakes: &mpsc::Receiver<()>) -> Arc<Picture> {
    loop {
        wakes.recv_timeout(Duration::from_secs(60)).unwrap();
        if let Some(picture) = engine.take_picture() {
            return picture;
        }
    }
}

/// As a hand turns the view: once the first picture is there, quick ones are of a cut, say so, and have cells.
#[test]
fn a_moving_view_shows_a_cut_of_several_levels_and_its_cells() {
    let (engine, wakes) = engine();
    let mut scene = opened("demo:head:96");
    let size = [400, 300];
    let budget_ms = 6.0;
    let ladder = Ladder::Octree;
    let rest = Effort::Rest { budget_ms, ladder, show_partial: false, converge_ms: 0.0 };
    engine.request(FrameRequest { scene: scene.clone(), size, effort: rest });
    while next(&engine, &wakes).report.progress < 1.0 {}
    engine.request_cells(Some(CellsRequest { scene: scene.clone(), size, max_error: 0.01 }));
    let mut found = None;
    for _ in 0..40 {
        scene.camera = scene.camera.orbited(0.02, 0.0);
        let effort = Effort::Moving { budget_ms };
        engine.request(FrameRequest { scene: scene.clone(), size, effort });
        let picture = next(&engine, &wakes);
        if let LevelOfDetail::Reduced { cut: Some(cut), .. } = picture.report.level {
            found = Some((cut, picture));
            break;
        }
    }
    let (cut, picture) = found.expect("a cut was drawn");
    assert!(cut.levels() >= 2, "{cut:?}");
    assert!(picture.report.estimated_rmse.is_some_and(|rmse| rmse > 0.0), "its error is told");
    let mut cells = engine.take_cells();
    for _ in 0..100 {
        if cells.as_ref().is_some_and(|cells| cells.is_drawn) {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
        cells = engine.take_cells().or(cells);
    }
    let cells = cells.expect("cells were asked for");
    assert!(cells.is_drawn, "those of the picture");
    assert!(cells.cells.levels().len() >= 2 && cells.cells.total == cut.nodes());
}

/// What stands beside a field without being in its way.
fn beside() -> Vec<(&'static str, Scene)> {
    let plain = opened("demo:head:48");
    let of = |change: &dyn Fn(&mut Scene)| {
        let mut scene = plain.clone();
        change(&mut scene);
        scene
    };
    let middle = plain.volume().unwrap().statistics.mean;
    vec![
        ("plain", plain.clone()),
        ("lit", of(&|s| s.shading.lighting = Some(Lighting::default()))),
        (
            "an isosurface",
            of(&|s| {
                s.inside.isosurfaces =
                    vec![Isosurface { value: middle, opacity: 0.5, colour: None }]
            }),
        ),
        ("a slice", of(&|s| s.inside.slices = vec![Slice::across(&s.lattice(), 1, 0.4, 1.0)])),
        ("far to near", of(&|s| s.splat.order = Order::BackToFront)),
        (
            "modulated by value",
            of(&|s| {
                let points = vec![(0.0, 0.2), (middle, 1.0)];
                s.shading.modulation = Some(Amounts { index: Index::Value, points });
            }),
        ),
        ("tents", of(&|s| s.splat.kernel = voxsplat::kernel::Kernel::Linear)),
    ]
}

fn still(engine: &Engine, scene: &Scene, refine: Refine) -> Still {
    let scene = scene.clone();
    let request = StillRequest { scene, size: SIZE, refine, repeat: 0, time_passes: false };
    engine.still(request, &Ticket::new()).unwrap()
}

/// The coarsest cut within an error is within it, of fewer fine bricks the more it may be off, and has whatever stands in the
/// scene.
#[test]
fn a_still_within_an_error_is_a_cut_of_the_field_with_whatever_stands_in_it() {
    let (engine, _wakes) = engine();
    for (name, scene) in beside() {
        let full = still(&engine, &scene, Refine::Full);
        let full: Vec<[f64; 4]> = full.light.iter().map(|pixel| pixel.map(f64::from)).collect();
        let truth = reference(&scene);
        let mut fine = u64::MAX;
        // Bricks that an isosurface passes are drawn from the samples, and faces that they share with others are not: measured
        // 0.0042 and no less.
        let errors = match scene.inside.isosurfaces.is_empty() {
            true => &[0.002, 0.008, 0.03][..],
            false => &[0.006],
        };
        for &max_error in errors {
            let found = still(&engine, &scene, Refine::Error { max_error, of_voxels: false });
            let Some(cut) = found.drawn.cut else {
                panic!(
                    "{name} within {max_error}: no cut: {:?}, {}",
                    found.measured_rmse, found.is_full
                )
            };
            let [off, of_truth] = [&full, &truth].map(|of| db(&found.light, of));
            let told = found.measured_rmse.unwrap();
            println!(
                "measured {name} within {max_error}: {off:.1} dB, {of_truth:.1} to the reference, {cut:?}"
            );
            assert!(told <= max_error, "{name}: {told}");
            assert!(
                (accuracy::psnr_from_rmse(told) - off).abs() < 0.01,
                "{name}: {told} is {off} dB"
            );
            // Nor is the cut far from the truth where it is near to the finished picture.
            assert!(of_truth > accuracy::psnr_from_rmse(1.2 * max_error), "{name}: {of_truth} dB");
            assert!(cut.bricks[0] < fine, "{name}: {cut:?} is no coarser");
            fine = cut.bricks[0];
        }
    }
    // Nothing is as near as that but the picture itself.
    let (_, lit) = beside().swap_remove(1);
    let found = still(&engine, &lit, Refine::Error { max_error: 1e-9, of_voxels: false });
    assert!(found.is_full && found.measured_rmse == Some(0.0));
}

/// What was chosen for moving views is what pictures within a time are of; where there is no cut, it is said why.
#[test]
fn a_picture_within_a_time_is_of_what_was_chosen_for_it() {
    let (engine, _wakes) = engine();
    let mut scene = opened("demo:head:96");
    let found = |scene: &Scene, budget_ms: f64| still(&engine, scene, Refine::Budget { budget_ms });
    for budget_ms in [2.0, 1e4] {
        scene.splat.cut.moving = Moving::Octree;
        let octree = found(&scene, budget_ms);
        assert!(octree.drawn.cut.is_some() && octree.why_not_octree.is_none(), "{budget_ms}");
        scene.splat.cut.moving = Moving::Subsampled;
        let subsampled = found(&scene, budget_ms);
        assert!(subsampled.drawn.cut.is_none() && subsampled.why_not_octree.is_none());
    }
    scene.splat.classify = Classify::After;
    assert_eq!(found(&scene, 2.0).why_not_octree, None, "nobody asked for one");
    scene.splat.cut.moving = Moving::Octree;
    let after = found(&scene, 2.0);
    assert!(after.drawn.cut.is_none());
    assert!(
        after.why_not_octree.is_some_and(|why| why.contains("each slab")),
        "{:?}",
        after.why_not_octree
    );
}

#[test]
fn modes_that_have_no_cuts_say_why() {
    for (name, scene) in beside() {
        assert_eq!(why_no_cut_of(&scene), None, "{name}");
    }
    let plain = opened("demo:head:48");
    let of = |change: &dyn Fn(&mut Scene)| {
        let mut scene = plain.clone();
        change(&mut scene);
        why_no_cut_of(&scene).unwrap_or_default()
    };
    let points = vec![(0.0, 0.0), (1.0, 1.0)];
    for (words, why) in [
        ("classified before", of(&|s| s.splat = SplatSettings::SHADE_FIRST)),
        ("one value stands", of(&|s| s.splat.classify = Classify::After)),
        ("wider or narrower", of(&|s| s.splat.extent = Some(3.0))),
        ("smoothed", of(&|s| s.splat.reconstruction = scene::Reconstruction::Smooth)),
        ("published", of(&|s| s.splat.opacity_model = scene::OpacityModel::Published)),
        ("single values", of(&|s| s.inside.along = scene::AlongRay::Average)),
        (
            "errors of its nodes",
            of(&|s| {
                s.shading.opacity = Some(Amounts { index: Index::Value, points: points.clone() })
            }),
        ),
        (
            "gradient strength",
            of(&|s| {
                let index = Index::GradientStrength;
                s.shading.modulation = Some(Amounts { index, points: points.clone() });
            }),
        ),
    ] {
        assert!(why.contains(words), "{words}: {why:?}");
    }
}

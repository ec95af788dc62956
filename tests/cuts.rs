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
    self, Clip, ClipBox, Inside, Lighting, PolygonLayer, SampleSource, Scene, Slice, SplatSettings,
};
use voxsplat::task::cuts::{cut_within, stored_levels};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engine::{
    CellsRequest, Choice, Effort, Engine, EngineChoice, FrameRequest, Ladder, Picture,
};
use voxsplat::task::engines::Engines;
use voxsplat::task::level::LevelOfDetail;
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

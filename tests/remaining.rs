//! What finished pictures say that they are off by, beside what they are.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::{Arc, mpsc};

use voxsplat::accuracy;
use voxsplat::accuracy::sweep::exact_mode;
use voxsplat::core::{Projection, Ticket};
use voxsplat::kernel::Kernel;
use voxsplat::scene::{
    self, Classify, Lighting, SampleSource, Scene, Slice, SplatSettings, Visibility,
};
use voxsplat::task::engine::{Choice, Engine, EngineChoice};
use voxsplat::task::remaining::WITHIN_DB;
use voxsplat::task::still::{Refine, Still, StillRequest};
use voxsplat::volume::{Component, demo};

const SIZE: [u32; 2] = [160, 120];
/// Slabs per voxel of what stands for the converged picture: four times those of the last picture that is drawn for the
/// estimate of a picture of one.
const MANY: f64 = 16.0;
/// Share of pictures that is told within [`WITHIN_DB`].
const SHARE: f64 = 0.95;

fn opened(name: &str) -> Scene {
    let grid = demo::open(name, None).unwrap();
    let field = grid.field(None).unwrap();
    let volume = grid.scalar(field, Component::Index(0), &Ticket::new()).unwrap();
    let mut scene = scene::opening(SampleSource::default(), Arc::new(volume), None);
    scene.splat = SplatSettings::EXACT;
    scene
}

fn still(engine: &Engine, scene: &Scene, is_told: bool) -> Still {
    let scene = scene.clone();
    let refine = Refine::Full;
    let request = StillRequest { scene, size: SIZE, refine, repeat: 0, time_passes: is_told };
    engine.still(request, &Ticket::new()).unwrap()
}

/// The error that a finished picture is told to have, and has, dB.
fn told_and_found(engine: &Engine, scene: &Scene) -> [f64; 2] {
    let wide = |still: &Still| -> Vec<[f64; 4]> {
        still.light.iter().map(|pixel| pixel.map(f64::from)).collect()
    };
    let judged = still(engine, scene, true);
    let mut truth = scene.clone();
    truth.splat = match scene.splat.visibility {
        Visibility::Slabs => SplatSettings { slabs_per_voxel: MANY, ..scene.splat },
        _ => exact_mode(&scene.splat, MANY),
    };
    let truth = still(engine, &truth, false);
    let found = accuracy::rmse(&wide(&judged), &wide(&truth)).unwrap();
    [judged.estimated_rmse.unwrap(), found].map(accuracy::psnr_from_rmse)
}

type Change = (&'static str, fn(&mut Scene));

/// What is done to each volume.
const CHANGES: [Change; 8] = [
    ("plain", |_| ()),
    ("lit", |s| s.shading.lighting = Some(Lighting::default())),
    ("near", |s| {
        s.camera.projection = Projection::Perspective { view_angle: 40.0_f64.to_radians() };
    }),
    ("tents, lit", |s| {
        s.splat.kernel = Kernel::Linear;
        s.shading.lighting = Some(Lighting::default());
    }),
    ("after", |s| s.splat.classify = Classify::After),
    ("two slabs", |s| s.splat.slabs_per_voxel = 2.0),
    ("a slice, lit", |s| {
        s.inside.slices = vec![Slice::across(&s.lattice(), 1, 0.4, 1.0)];
        s.shading.lighting = Some(Lighting::default());
    }),
    ("every sample", |s| s.splat = SplatSettings::SHADE_FIRST),
];

/// Of volumes, views and effects, at least 95 of 100 are told within 3 dB of what they are off by.
#[test]
fn finished_pictures_are_off_by_what_they_say() {
    let (sender, _wakes) = mpsc::channel();
    let choice = Choice::from(EngineChoice::Native);
    let engine = Engine::start(choice, move || sender.send(()).unwrap_or_default());
    let (mut pictures, mut right) = (0, 0);
    let mut worst = 0.0_f64;
    for name in ["demo:head:40", "demo:shells:32", "demo:blobs:32", "demo:marschner-lobb:32"] {
        for (turn, (change, by)) in CHANGES.into_iter().enumerate() {
            let mut scene = opened(name);
            scene.camera = scene.camera.orbited(0.4 * turn as f64, 0.1);
            by(&mut scene);
            let [told, found] = told_and_found(&engine, &scene);
            let off = told - found;
            println!("measured {name}, {change}: told {told:.1} dB, is {found:.1} dB");
            pictures += 1;
            right += usize::from(off.abs() <= WITHIN_DB);
            worst = worst.max(off.abs());
        }
    }
    println!(
        "measured: {right} of {pictures} within {WITHIN_DB} dB, the worst off by {worst:.1} dB"
    );
    assert!(right as f64 >= SHARE * f64::from(pictures), "{right} of {pictures}");
}

/// Where nothing of a field shows there is nothing to be off by.
#[test]
fn an_empty_picture_is_off_by_nothing() {
    let (sender, _wakes) = mpsc::channel();
    let choice = Choice::from(EngineChoice::Native);
    let engine = Engine::start(choice, move || sender.send(()).unwrap_or_default());
    let scene = opened("demo:constant:8");
    let empty = Scene { layers: Vec::new(), ..scene };
    assert_eq!(still(&engine, &empty, true).estimated_rmse, Some(0.0));
}

//! What pictures say that they are off by, beside what they are.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod pack;

use std::sync::{Arc, mpsc};
use std::time::Duration;

use voxsplat::accuracy;
use voxsplat::accuracy::sweep::exact_mode;
use voxsplat::core::{LinearRgb, Projection, Ticket};
use voxsplat::kernel::Kernel;
use voxsplat::scene::{
    self, Classify, Lighting, SampleSource, Scene, Slice, SplatSettings, Visibility,
};
use voxsplat::task::engine::{Choice, Effort, Engine, EngineChoice, FrameRequest, Ladder, Picture};
use voxsplat::task::estimate::{self, Checked};
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
    let request = StillRequest {
        scene,
        size: SIZE,
        refine,
        repeat: 0,
        time_passes: is_told,
        smooth_edges: false,
    };
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

/// What scans of the pack are seen with.
const EFFECTS: [Change; 4] = [
    ("as it opens", |_| ()),
    ("unlit", |s| s.shading.lighting = None),
    ("lit, near", |s| {
        s.shading.lighting = Some(Lighting::default());
        s.camera.projection = Projection::Perspective { view_angle: 40.0_f64.to_radians() };
        s.camera.parallel_scale *= 0.7;
    }),
    ("a slice", |s| s.inside.slices = vec![Slice::across(&s.lattice(), 2, 0.5, 1.0)]),
];

/// Samples of the largest scan that is looked at.
const MOST_SAMPLES: u64 = 1 << 17;

/// What a hand does: pixels of its pictures, radians by which it turns a view, and a third of that upwards, and milliseconds that a
/// picture may take.
#[derive(Debug, Clone, Copy)]
struct Hand {
    size: [u32; 2],
    turn: f64,
    budget_ms: f64,
}

/// The hand that is looked at always.
const HAND: Hand = Hand { size: SIZE, turn: 0.15, budget_ms: 0.0 };

/// The picture of a hand that turns a view a little once it has come to rest, and what it was thought to be off by and was;
/// nothing where the time allows the finished one.
fn moved(
    engine: &Engine,
    wakes: &mpsc::Receiver<()>,
    scene: &Scene,
    Hand { size, turn, budget_ms }: Hand,
) -> Option<(Arc<Picture>, Checked)> {
    let next = || loop {
        wakes.recv_timeout(Duration::from_secs(60)).unwrap();
        if let Some(picture) = engine.take_picture() {
            return picture;
        }
    };
    let ladder = Ladder::Octree;
    let rest = Effort::Rest {
        budget_ms,
        ladder,
        show_partial: false,
        converge_ms: 0.0,
        smooth_edges: false,
    };
    let request = |scene: &Scene, effort| {
        engine.request(FrameRequest { scene: scene.clone(), size, effort });
    };
    request(scene, rest);
    while next().report.remaining_rmse.is_none() {}
    let mut turned = scene.clone();
    turned.camera = turned.camera.orbited(turn, turn / 3.0);
    request(&turned, Effort::Moving { budget_ms });
    let quick = loop {
        let picture = next();
        if picture.report.remaining_rmse.is_none() {
            break picture;
        }
    };
    request(&turned, rest);
    let full = loop {
        let picture = next();
        if picture.report.level.is_full() && picture.report.progress == 1.0 {
            break picture;
        }
    };
    // Not what the last of several pictures on the way up was checked to be.
    let estimated_rmse = quick.report.estimated_rmse?;
    let measured_rmse = estimate::shown_rmse(&quick, &full).unwrap();
    Some((quick, Checked { estimated_rmse, measured_rmse }))
}

/// Of files, views and effects; of finished pictures, and of quick ones.
#[test]
fn pictures_of_scans_are_off_by_what_they_say() {
    let (sender, wakes) = mpsc::channel();
    let choice = Choice::from(EngineChoice::Native);
    let engine = Engine::start(choice, move || sender.send(()).unwrap_or_default());
    let draw = |scene: &Scene, refine: Refine, is_told: bool| {
        let scene = scene.clone();
        let request = StillRequest {
            scene,
            size: SIZE,
            refine,
            repeat: 0,
            time_passes: is_told,
            smooth_edges: false,
        };
        engine.still(request, &Ticket::new()).unwrap()
    };
    // Finished ones, quick ones, the same as `--stats` measures them, and those of a hand that turns a view that was at rest.
    let mut right = [0_u32; 4];
    let mut pictures = [0_u32; 4];
    let mut wrong = Vec::new();
    for (name, opened) in pack::scans(MOST_SAMPLES) {
        for (turn, (effect, by)) in EFFECTS.into_iter().enumerate() {
            let mut scene = opened.clone();
            scene.camera = scene.camera.orbited(0.7 * turn as f64, 0.2);
            by(&mut scene);
            let mut judge = |kind: usize, what: &str, told: f64, found: f64| {
                let [told, found] = [told, found].map(accuracy::psnr_from_rmse);
                let is_right = told == found || (told - found).abs() <= WITHIN_DB;
                let line = format!("{name}, {effect}, {what}: told {told:.1} dB, is {found:.1} dB");
                println!("measured {line}");
                pictures[kind] += 1;
                right[kind] += u32::from(is_right);
                if !is_right {
                    wrong.push(line);
                }
            };
            let full = draw(&scene, Refine::Full, true);
            let mut truth = scene.clone();
            truth.splat = match scene.splat.visibility {
                Visibility::Slabs => SplatSettings {
                    slabs_per_voxel: MANY * scene.splat.slabs_per_voxel.min(2.0),
                    ..scene.splat
                },
                _ => exact_mode(&scene.splat, MANY),
            };
            let truth = draw(&truth, Refine::Full, false);
            let background = scene.background.light().unwrap_or_default();
            let over = |still: &Still, LinearRgb(behind): LinearRgb| -> Vec<[f64; 4]> {
                let pixel = |pixel: &[f32; 4]| {
                    let [r, g, b, a] = pixel.map(f64::from);
                    let left = 1.0 - a;
                    [r + left * behind[0], g + left * behind[1], b + left * behind[2], a]
                };
                still.light.iter().map(pixel).collect()
            };
            let black = LinearRgb::default();
            let off = |a: &Still, b: &Still, behind| {
                accuracy::rmse(&over(a, behind), &over(b, behind)).unwrap()
            };
            judge(0, "finished", full.estimated_rmse.unwrap(), off(&full, &truth, black));
            let full_ms = full.frame_ms[0];
            let budget_ms = 0.1 * full_ms;
            let quick = draw(&scene, Refine::Budget { budget_ms }, false);
            if let Some(rmse) = quick.estimated_rmse {
                let of = format!("quick, {:?}, {:?}", quick.drawn.size, quick.drawn.cut);
                judge(1, &of, rmse, off(&quick, &full, background));
            }
            if turn == 0 {
                let measured = draw(&scene, Refine::Budget { budget_ms }, true);
                let found = off(&measured, &truth, black);
                judge(2, "the same, measured", measured.estimated_rmse.unwrap(), found);
            }
            if let Some((picture, Checked { estimated_rmse, measured_rmse })) =
                moved(&engine, &wakes, &scene, Hand { budget_ms: 0.2 * full_ms, ..HAND })
            {
                let of = format!("moving, {:?}", picture.report.level);
                judge(3, &of, estimated_rmse, measured_rmse);
            }
        }
    }
    println!("measured: {right:?} of {pictures:?} within {WITHIN_DB} dB");
    // Measured over the scans of up to 2²⁰ samples: 91 of 92, 84 of 84, 23 of 23; and of a moving hand's own, while these were thought
    // of by themselves and a gain, 75 to 81 of 84 to 87. What the view before tells of them beside that would have been right, in
    // pictures of 64 × 48 pixels, in 60 of 60 (0.15 rad; 51 by a gain), 53 of 56 (0.4 rad; 48) and 9 of 9 (1.2 rad; 9), and in 8 of 8
    // of 64 × 48 for 320 × 240 (0.15 rad; 6): worked out from what was written down of them, on a machine that was busy.
    for kind in 0..4 {
        let [right, pictures] = [right[kind], pictures[kind]];
        // Of twelve one may be wrong: times decide what is drawn. Alone all were right, beside a build 11.
        assert!(
            f64::from(right) >= (SHARE * f64::from(pictures)).floor(),
            "{right} of {pictures}: {wrong:#?}"
        );
    }
}

/// Samples of the largest scan that is looked at where a hand turns farther, and in larger pictures.
const MOST_SAMPLES_WIDELY: u64 = 1 << 20;

/// The last of these with other turns, sizes and times: budgets that a busy machine affords small pictures for, and a quick one larger ones.
#[test]
#[ignore = "takes minutes: for whoever changes what is thought of quick pictures"]
fn pictures_of_hands_are_off_by_what_they_say() {
    let hands = [
        Hand { budget_ms: 0.25, ..HAND },
        Hand { budget_ms: 1.0, ..HAND },
        Hand { budget_ms: 2.0, ..HAND },
        Hand { turn: 0.05, budget_ms: 0.5, ..HAND },
        Hand { turn: 0.4, budget_ms: 0.5, ..HAND },
        Hand { turn: 1.2, budget_ms: 1.0, ..HAND },
        Hand { size: [320, 240], turn: 0.15, budget_ms: 4.0 },
        Hand { size: [320, 240], turn: 0.4, budget_ms: 2.0 },
    ];
    let scans = pack::scans(MOST_SAMPLES_WIDELY);
    for hand in hands {
        let (sender, wakes) = mpsc::channel();
        let choice = Choice::from(EngineChoice::Native);
        let engine = Engine::start(choice, move || sender.send(()).unwrap_or_default());
        let (mut right, mut pictures) = (0, 0);
        for (name, opened) in &scans {
            for (n, (effect, by)) in EFFECTS.into_iter().enumerate() {
                let mut scene = opened.clone();
                scene.camera = scene.camera.orbited(0.7 * n as f64, 0.2);
                by(&mut scene);
                let Some((picture, checked)) = moved(&engine, &wakes, &scene, hand) else {
                    continue;
                };
                let level = picture.report.level;
                let off = checked.off_db().unwrap_or(0.0);
                println!("measured {name}, {effect}, {level:?}: off by {off:.1} dB, {checked:?}");
                pictures += 1;
                right += u32::from(off.abs() <= WITHIN_DB);
            }
        }
        println!("measured {hand:?}: {right} of {pictures} within {WITHIN_DB} dB");
    }
}

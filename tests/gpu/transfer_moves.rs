//! A transfer function that changes while a picture of the one before is under way.

use std::sync::Arc;
use std::time::Duration;

use glam::DVec3;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::plan::Plan;
use voxsplat::scene::{Scene, SplatSettings};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engine::{Effort, EngineState, Ladder, Picture};
use voxsplat::transfer::{ColourSource, TransferFunction};
use voxsplat::volume::Lattice;

use crate::engine::{Bench, rest};
use crate::support::{context, drawn, scene, wide, with_transfer};

const FRAME: [u32; 2] = [420, 360];
/// Of many pictures, each a second or so: what changes in mid refinement must find it under way.
const SMALL: [u32; 2] = [260, 220];
/// Of noise, more voxels can show than are classified before a quick picture.
const HEAVY: [usize; 3] = [144, 136, 136];

/// One colour, so that a picture tells what it is of.
fn of_colour(colour: Srgb8, opacity: f64) -> TransferFunction {
    TransferFunction::of(
        vec![(90.0, 0.0), (160.0, 0.1 * opacity), (255.0, opacity)],
        ColourSource::Stops(vec![(0.0, colour), (255.0, colour)]),
    )
}

const RED: Srgb8 = Srgb8([255, 0, 0]);
const GREEN: Srgb8 = Srgb8([0, 255, 0]);
const BLUE: Srgb8 = Srgb8([0, 0, 255]);

fn with(scene: &Scene, colour: Srgb8, opacity: f64) -> Scene {
    with_transfer(scene.clone(), of_colour(colour, opacity))
}

fn plan_of(scene: &Scene) -> Plan {
    Plan::of(scene, FRAME)
}

/// Whether a picture shows anything of a channel.
fn shows(picture: &Picture, channel: usize) -> bool {
    picture.rgba.chunks(4).any(|pixel| pixel[channel] > 0)
}

#[test]
fn a_transfer_function_that_changes_in_mid_refinement_leaves_nothing_of_the_one_before() {
    // Slabs of single kernels take ten times as long as the others: of a tenth of the samples as long as these.
    let modes = [
        ("exact", 72, SplatSettings::EXACT),
        ("every sample", 72, SplatSettings::SHADE_FIRST),
        (
            "slabs, shaded first",
            32,
            SplatSettings {
                classify: voxsplat::scene::Classify::Before,
                opacity_model: voxsplat::scene::OpacityModel::OpticalDepth,
                ..SplatSettings::EXACT
            },
        ),
    ];
    for (name, side, splat) in modes {
        let lattice = Lattice::unit([side; 3]);
        let scene = Scene { splat, ..scene(lattice, DVec3::new(0.3, -0.5, 0.8)) };
        let new = with(&scene, GREEN, 0.9);
        // At once, on a device of its own.
        let Some(other) = Bench::new() else { return };
        other.request(&new, SMALL, rest());
        let expected = other.until_full(SMALL);
        let expected = &expected[expected.len() - 1];
        let uploads = other.still(&new).uploads;
        assert!(uploads > 0 && shows(expected, 1), "{name}");

        let (mut stopped, mut partial) = (0, 0);
        for (pause_ms, is_moving) in [(0, true), (15, false), (60, true)] {
            let Some(bench) = Bench::new() else { return };
            let effort = Effort::Rest {
                budget_ms: 20.0,
                ladder: Ladder::Octree,
                show_partial: true,
                converge_ms: 0.0,
                smooth_edges: false,
            };
            bench.request(&with(&scene, RED, 0.7), SMALL, effort);
            // Its first picture is out, and what follows has begun.
            let mut pictures = bench.pictures_until(|_, seen| !seen.is_empty());
            std::thread::sleep(Duration::from_millis(pause_ms));
            if is_moving {
                bench.request(&new, SMALL, Effort::Moving { budget_ms: 20.0 });
                std::thread::sleep(Duration::from_millis(pause_ms));
            }
            bench.request(&new, SMALL, rest());
            pictures.extend(bench.pictures_until(|bench, seen| {
                seen.last().is_some_and(|p| p.report.level.is_full() && shows(p, 1))
                    && bench.engine.state() == EngineState::Idle
            }));
            let first_new = pictures.iter().position(|p| shows(p, 1)).expect("it is there");
            let (old, after) = pictures.split_at(first_new);
            let levels: Vec<_> = pictures.iter().map(|p| p.report.level).collect();
            assert!(old.iter().all(|p| shows(p, 0)), "{name}: {levels:?}");
            assert!(after.iter().all(|p| !shows(p, 0)), "{name}: the old one again, {levels:?}");
            stopped += usize::from(old.iter().all(|p| !p.report.level.is_full()));
            partial += usize::from(after.len() > 1);
            let last = &after[after.len() - 1];
            assert!(last.rgba == expected.rgba, "{name}: other bits, {levels:?}");
            assert_eq!(last.report.kernels, expected.report.kernels, "{name}");
            // The volume, its bricks and the fields made of it are those of the first one.
            assert_eq!(bench.still(&new).uploads, uploads, "{name}: brought again");
        }
        println!(
            "measured {name}: {stopped} of 3 stopped before full, {partial} after a coarse one"
        );
        assert!(stopped > 0, "{name}: nothing was under way");
    }
}

/// Quick pictures are drawn from level 3 while the function moves; the whole octree follows.
#[test]
fn a_moving_transfer_function_is_seen_before_the_whole_octree_is_there() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let base = scene(Lattice::unit(HEAVY), DVec3::new(0.3, -0.5, 0.8));
    let ticket = Ticket::new();
    let budget_ms = 20.0;
    drawer.prepare(&plan_of(&with(&base, RED, 0.7)), &ticket).expect("prepared");
    let uploads = drawer.engines.gpu().expect("a device").upload_count();
    let moved = with(&base, GREEN, 0.02);
    let plan = plan_of(&moved);
    drawer.prepare_preview(&plan, budget_ms, &ticket).expect("prepared");
    assert!(drawer.has_coarse_octree(), "no less than would be classified at once");
    let active = drawer.active_count();
    let coarse = drawer.draw(&plan, Rung::Coarse { budget_ms }, &mut ()).expect("drawn");
    assert!(coarse.nodes > 0 && coarse.max_error > 0.0, "{coarse:?}");
    let seen = wide(&drawer.engines.gpu().expect("a device").read_light().expect("read"));
    assert!(seen.iter().all(|p| p[0] == 0.0) && seen.iter().any(|p| p[1] > 0.0));
    // Rows of voxels are planned by counts that only the whole one has.
    let refused = drawer.draw(&plan, Rung::Full, &mut ());
    assert!(refused.is_err(), "{refused:?}");

    // Begun, and there after a while.
    drawer.begin_octree(&plan).expect("begun");
    drawer.prepare_preview(&plan, budget_ms, &ticket).expect("prepared");
    drawer.prepare(&plan, &ticket).expect("prepared");
    assert!(!drawer.has_coarse_octree());
    assert_eq!(drawer.active_count(), active, "8-bit values are counted alike");
    assert_eq!(
        drawer.engines.gpu().expect("a device").upload_count(),
        uploads,
        "the volume was there"
    );
    let max_error = drawer.error_for_count(3000);
    let (found, _) = drawn(&mut drawer, &moved, FRAME, Rung::Octree { max_error });
    let Some(context) = crate::support::context(Wishes::default()) else { return };
    let mut fresh = Drawer::new(Renderer::new(context));
    fresh.prepare(&plan, &ticket).expect("prepared");
    let (expected, _) = drawn(&mut fresh, &moved, FRAME, Rung::Octree { max_error });
    assert!(found == expected, "other bits than at once");
    // As bright as the whole one's cut of about as many nodes. Measured: 0.26 of 255 apart.
    let max_error = fresh.error_for_count(coarse.nodes);
    let (near, _) = drawn(&mut fresh, &moved, FRAME, Rung::Octree { max_error });
    let mean = |light: &[[f64; 4]]| light.iter().map(|p| p[1]).sum::<f64>() / light.len() as f64;
    println!("measured {:.4} for {:.4}", mean(&seen), mean(&near));
    assert!((mean(&seen) - mean(&near)).abs() < 1.5 / 255.0, "{} {}", mean(&seen), mean(&near));
}

/// Each change of an uninterrupted drag has coarse levels of its own, and what was begun for the one before is
/// dropped; the finer levels come with the rest after it.
#[test]
fn every_change_of_a_drag_is_seen_from_its_own_coarse_levels_and_the_finer_ones_follow_it() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let base = scene(Lattice::unit(HEAVY), DVec3::new(0.3, -0.5, 0.8));
    let ticket = Ticket::new();
    let budget_ms = 15.0;
    let moved = |step: usize| plan_of(&with(&base, [GREEN, BLUE, RED][step % 3], 0.02));
    for step in 0..5 {
        let plan = moved(step);
        drawer.prepare_preview(&plan, budget_ms, &ticket).expect("prepared");
        assert!(drawer.has_coarse_octree(), "{step}: never all of it before a quick picture");
        drawer.draw(&plan, Rung::Coarse { budget_ms }, &mut ()).expect("drawn");
        let light = wide(&drawer.engines.gpu().expect("a device").read_light().expect("read"));
        let lit = [1, 2, 0].map(|channel| light.iter().any(|p| p[channel] > 0.0));
        let asked = [0, 1, 2].map(|colour| colour == step % 3);
        assert_eq!(lit, asked, "{step}: of another function");
        // As where nothing newer is asked for yet; the next change comes at once.
        drawer.begin_octree(&plan).expect("begun");
    }
    let last = moved(4);
    drawer.prepare(&last, &ticket).expect("prepared");
    assert!(!drawer.has_coarse_octree() && drawer.active_count().is_some_and(|n| n > 0));
    let Some(context) = crate::support::context(Wishes::default()) else { return };
    let mut fresh = Drawer::new(Renderer::new(context));
    fresh.prepare(&last, &ticket).expect("prepared");
    assert_eq!(fresh.active_count(), drawer.active_count(), "of another function");
    assert_eq!(fresh.error_for_count(3000), drawer.error_for_count(3000));
}

/// A drag of a slider: every picture is of what was asked for last or just before it, and they come.
#[test]
fn a_drag_of_a_slider_shows_pictures_all_along() {
    let Some(bench) = Bench::new() else { return };
    let base = scene(Lattice::unit(HEAVY), DVec3::new(0.3, -0.5, 0.8));
    bench.request(&with(&base, BLUE, 0.5), [96, 80], rest());
    bench.until_full([96, 80]);
    let mut seen: Vec<Arc<Picture>> = Vec::new();
    for step in 0..20 {
        let scene = with(&base, GREEN, 0.1 + 0.04 * f64::from(step));
        bench.request(&scene, FRAME, Effort::Moving { budget_ms: 15.0 });
        std::thread::sleep(Duration::from_millis(60));
        seen.extend(bench.engine.take_picture());
    }
    let moving = seen.len();
    println!("measured {moving} pictures of 20 moves");
    assert!(moving >= 4, "{moving} pictures of 20 moves");
    assert!(seen.iter().all(|p| shows(p, 1) && !shows(p, 2)), "of the function before the drag");
    let last = with(&base, RED, 0.8);
    bench.request(&last, [96, 80], rest());
    let full = bench.until_full([96, 80]);
    let Some(other) = Bench::new() else { return };
    other.request(&last, [96, 80], rest());
    let expected = other.until_full([96, 80]);
    assert!(full[full.len() - 1].rgba == expected[expected.len() - 1].rgba, "other bits");
}

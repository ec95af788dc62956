//! The cells that are shown are those of the cut that is drawn.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use voxsplat::core::Ticket;
use voxsplat::gpu::layout::Record;
use voxsplat::scene::{Scene, SplatSettings, View, WhyWhole};
use voxsplat::task::draw::Rung;
use voxsplat::task::engine::{CellsRequest, Effort, EngineState, FoundCells};
use voxsplat::task::level::LevelOfDetail;
use voxsplat::task::still::{Refine, StillRequest};
use voxsplat::volume::Lattice;

use crate::engine::{Bench, PATIENCE, large, rest, small};
use crate::support::{SIZE, Within, drawer, drawn, fault, in_perspective, scene, volume_of, wide};

fn cells_of(bench: &Bench) -> Arc<FoundCells> {
    let start = Instant::now();
    loop {
        if let Some(found) = bench.engine.take_cells() {
            return found;
        }
        assert!(start.elapsed() < PATIENCE, "no cells: {:?}", bench.engine.state());
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn request(scene: &Scene, max_error: f32) -> Option<CellsRequest> {
    Some(CellsRequest { scene: scene.clone(), size: SIZE, max_error })
}

/// A frame that comes while their octree is built goes first, and they are found after it.
#[test]
fn cells_keep_no_frame_waiting_and_come_after_it() {
    let Some(bench) = Bench::new() else { return };
    bench.pictures_until(|bench, _| bench.engine.state() == EngineState::Idle);
    let heavy = scene(Lattice::unit([300, 300, 300]), DVec3::Z);
    bench.engine.request_cells(request(&heavy, 0.5));
    std::thread::sleep(Duration::from_millis(20));
    bench.request(&small(), SIZE, rest());
    bench.until_full(SIZE);
    assert!(bench.engine.take_cells().is_none(), "the frame waited for them");
    assert!(cells_of(&bench).cells.total > 0);
}

/// Drawn as records in their order they are the picture of the cut, to the bit; and every voxel with
/// opacity is in one of them and no other.
#[test]
fn the_cells_that_are_published_are_the_cut_that_is_drawn() {
    let Some(bench) = Bench::new() else { return };
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice { spacing: DVec3::new(1.0, 1.3, 0.8), ..Lattice::unit([13, 8, 10]) };
    let base = scene(lattice, DVec3::new(0.35, -0.52, 0.78));
    for scene in [base.clone(), in_perspective(base, 40.0)] {
        let mut counts = Vec::new();
        for max_error in [0.9, 0.3, 0.02] {
            bench.engine.request_cells(request(&scene, max_error));
            let found = cells_of(&bench);
            let cells = &found.cells;
            assert_eq!((cells.max_error, found.asked_error), (max_error, max_error));
            assert!(!found.is_drawn && Arc::ptr_eq(&found.volume, volume_of(&scene)));
            let (cut, info) = drawn(&mut drawer, &scene, SIZE, Rung::Octree { max_error });
            assert_eq!((info.nodes, cells.cells.len() as u64), (cells.total, cells.total));
            let view = View::new(&scene, SIZE);
            let unit = scene.opacity_unit_distance();
            let splat = &scene.splat;
            let records: Vec<Record> = cells
                .cells
                .iter()
                .map(|c| Record::new(c.low, c.size, c.extinction, c.colour))
                .collect();
            drawer
                .engines
                .gpu()
                .expect("a device")
                .begin(&view, splat.kernel, splat.extent, unit)
                .expect("it begins");
            drawer.engines.gpu().expect("a device").draw_records(&records).expect("it draws");
            let by_hand = drawer.engines.gpu().expect("a device").read_light().expect("read back");
            // Cells are the host's; a device that built its own octree rounded otherwise.
            let within = if voxsplat::gpu::has_hardware() { 1e-4 } else { 0.0 };
            let within = Within { max_abs: within, rmse: within, bias: within };
            assert_eq!(fault(&wide(&by_hand), &cut, within), None);

            let mut covered = vec![0_u32; lattice.len()];
            for cell in &cells.cells {
                let side = |a: usize| cell.low[a] as usize..(cell.low[a] + cell.size[a]) as usize;
                for (x, y, z) in
                    side(0).flat_map(|x| side(1).flat_map(move |y| side(2).map(move |z| (x, y, z))))
                {
                    covered[(z * lattice.dims[1] + y) * lattice.dims[0] + x] += 1;
                }
                assert_eq!(cell.why == WhyWhole::ErrorSmallEnough, cell.voxels() > 1, "{cell:?}");
                assert!(cell.error < max_error && 1 << cell.level >= cell.size[0], "{cell:?}");
            }
            assert!(covered.iter().all(|&count| count <= 1), "cells overlap");
            for (i, &count) in covered.iter().enumerate() {
                assert!(
                    count == 1 || volume_of(&scene).samples.get(i) <= 90.0,
                    "voxel {i} is in none"
                );
            }
            counts.push(cells.total);
        }
        println!("measured {counts:?} cells");
        assert!(counts[0] < counts[1] && counts[1] < counts[2], "{counts:?}");
    }
}

#[test]
fn a_moving_view_hands_out_the_cut_on_its_picture_only_while_that_is_wanted() {
    let Some(bench) = Bench::new() else { return };
    let scene = large();
    let moving = Effort::Moving { budget_ms: 10.0 };
    let picture = |scene: &Scene| {
        bench.request(scene, [320, 200], moving);
        let pictures = bench.pictures_until(|bench, seen| {
            !seen.is_empty() && bench.engine.state() == EngineState::Idle
        });
        pictures[pictures.len() - 1].clone()
    };
    picture(&scene);
    assert!(bench.engine.take_cells().is_none(), "nobody asked");
    bench.engine.request_cells(request(&scene, 0.5));
    cells_of(&bench);
    let shown = picture(&Scene { camera: scene.camera.orbited(0.1, 0.0), ..scene.clone() });
    let found = cells_of(&bench);
    assert!(found.is_drawn);
    assert_eq!(Some(found.cells.total), shown.report.kernels.map(|kernels| kernels.drawn));
    let max_error = found.cells.max_error;
    assert_eq!(shown.report.level, LevelOfDetail::Octree { max_error });
    bench.engine.request_cells(None);
    picture(&Scene { camera: scene.camera.orbited(0.2, 0.0), ..scene });
    assert!(bench.engine.take_cells().is_none(), "nobody wants them any more");
}

/// A slider is moved while a picture takes seconds: its cells come between two pieces, and nothing
/// that was drawn is lost.
#[test]
fn cells_do_not_wait_for_a_picture_nor_stop_it() {
    let Some(bench) = Bench::new() else { return };
    let mut scene = large();
    scene.splat = SplatSettings::EXACT;
    bench.request(&scene, [700, 600], rest());
    let mut pictures = bench.pictures_until(|_, seen| !seen.is_empty());
    for i in 1..4 {
        bench.engine.request_cells(request(&scene, 0.1 * i as f32));
        assert_eq!(cells_of(&bench).cells.max_error, 0.1 * i as f32);
    }
    let during = bench.engine.state();
    pictures.extend(bench.until_full([700, 600]));
    assert!(matches!(during, EngineState::Drawing(_)), "the picture was done before: {during:?}");
    let of = |is: fn(&LevelOfDetail) -> bool| {
        pictures.iter().filter(|picture| is(&picture.report.level)).count()
    };
    let counts = (of(LevelOfDetail::is_coarse), of(LevelOfDetail::is_full));
    assert!(counts.0 <= 1 && counts.1 >= 1, "begun again");
}

#[test]
fn a_still_has_cells_only_where_it_is_a_cut_and_they_were_asked_for() {
    let Some(bench) = Bench::new() else { return };
    let request = |refine| StillRequest {
        scene: small(),
        size: SIZE,
        refine,
        repeat: 0,
        time_passes: false,
        smooth_edges: false,
    };
    let within = request(Refine::Error { max_error: 0.1, of_voxels: true });
    let still = bench.engine.still_with_cells(within.clone(), &Ticket::new()).expect("a still");
    let cells = still.cells.expect("a cut");
    assert_eq!((cells.total, cells.max_error), (still.drawn.nodes, still.drawn.max_error));
    let plain = bench.engine.still(within, &Ticket::new()).expect("a still");
    assert!(plain.cells.is_none() && plain.rgba == still.rgba);
    let full = bench.engine.still_with_cells(request(Refine::Full), &Ticket::new());
    assert!(full.expect("a still").cells.is_none());
}

/// A budget beyond a quick picture's gives a quick one first, then the long one, which a newer view
/// stops at its next piece.
#[test]
fn a_long_budget_follows_the_hand_quickly_and_is_spent_when_it_pauses() {
    let Some(bench) = Bench::new() else { return };
    let mut scene = large();
    scene.splat.visibility = voxsplat::scene::Visibility::EverySample;
    let size = [1400, 1200];
    let long = Effort::Moving { budget_ms: 10_000.0 };
    bench.request(&scene, size, long);
    let pictures = bench.pictures_until(|bench, seen| {
        !seen.is_empty() && bench.engine.state() == EngineState::Idle
    });
    let last = &pictures[pictures.len() - 1].report;
    assert_eq!(last.budget_ms, Some(10_000.0), "a pause has it all: {last:?}");
    let long_ms = last.frame_ms;
    // The engine draws until it is stopped; each view is another one.
    let mut worst = Duration::ZERO;
    for i in 1..6 {
        let turned =
            Scene { camera: scene.camera.orbited(0.1 * f64::from(i), 0.0), ..scene.clone() };
        let asked = Instant::now();
        bench.request(&turned, size, long);
        let first = bench.pictures_until(|_, seen| !seen.is_empty());
        worst = worst.max(asked.elapsed());
        let report = &first[0].report;
        assert_eq!(report.budget_ms, Some(200.0), "quick first: {report:?}");
        let next = report.next.expect("the long one follows");
        assert!(!next.is_full && next.ms == 10_000.0, "{next:?}");
    }
    println!("measured the long one {long_ms:.0} ms, the newest view after {worst:?} at most");
    assert!(worst < Duration::from_millis(2500), "{worst:?}");
}

/// What the line says of the next picture is what is known by then, and no more.
#[test]
fn a_coarse_picture_tells_of_the_next_one_only_what_was_measured() {
    let Some(bench) = Bench::new() else { return };
    let scene = Scene { splat: SplatSettings::EXACT, ..small() };
    let moving = Effort::Moving { budget_ms: 10.0 };
    let coarse = |scene: &Scene| {
        bench.request(scene, SIZE, moving);
        let pictures = bench.pictures_until(|bench, seen| {
            !seen.is_empty() && bench.engine.state() == EngineState::Idle
        });
        pictures[pictures.len() - 1].report.clone()
    };
    let first = coarse(&scene);
    assert_eq!((first.budget_ms, first.next), (Some(10.0), None), "nothing was drawn yet");
    bench.request(&scene, SIZE, rest());
    let full = bench.until_full(SIZE).pop().expect("full");
    assert_eq!((full.report.budget_ms, full.report.next), (None, None));
    let turned = Scene { camera: scene.camera.orbited(0.1, 0.0), ..scene };
    let next = coarse(&turned).next.expect("full is known now");
    let off = (next.ms / full.report.frame_ms - 1.0).abs();
    assert!(next.is_full && off < 1e-9, "{next:?} {:?}", full.report);
    assert_eq!(next.rmse, None, "what full is off by is nothing to full");
    let mut other = turned;
    other.splat = SplatSettings::SHADE_FIRST;
    assert_eq!(coarse(&other).next, None, "another mode");
}

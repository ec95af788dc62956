//! What octrees take where the host builds them and where the device does.

use std::sync::Arc;
use std::time::Instant;

use voxsplat::core::Ticket;
use voxsplat::gpu::{AdapterChoice, BrickRows, Context, OctreeBuilder, Renderer, Wishes};
use voxsplat::hierarchy::{ErrorMeasure, Pyramid, PyramidParts};
use voxsplat::scene::{self, SampleSource};
use voxsplat::transfer::{Table, TransferFunction};
use voxsplat::volume::{Component, Lattice, Samples, ScalarVolume, demo};

/// Pieces of about so many bricks: on llvmpipe of 10 ms or so.
const BRICKS: usize = 1 << 8;
const RUNS: usize = 5;
const MEASURE: ErrorMeasure = ErrorMeasure::Classified;

/// Shells in 8 bits, as they open and under a ramp where every voxel shows.
pub(crate) fn tables() {
    let wishes = Wishes { octrees: Some(OctreeBuilder::Device), ..Wishes::default() };
    let context = Context::new(&AdapterChoice::Auto, wishes).expect("an adapter");
    println!("{}, {RUNS} runs, least and median ms\n", context.adapter_name);
    let mut renderer = Renderer::new(context);
    println!("| volume | builder | coarse | all of it | longest piece |\n|---|---|---|---|---|");
    for size in [128, 256] {
        let volume = shells(size);
        let scene = scene::opening(SampleSource::default(), Arc::clone(&volume), None);
        let opening = scene.transfer().expect("a field").clone();
        let ramp = TransferFunction { opacity: vec![(0.0, 0.01), (255.0, 0.5)], ..opening.clone() };
        for (name, transfer) in [("as it opens", opening), ("a ramp", ramp)] {
            let table = Table::new(&transfer, volume.samples.scalar_type());
            let ticket = Ticket::new();
            let coarse = least(|| {
                Pyramid::coarse(&volume, &table, 1.0, MEASURE, &ticket).expect("it fits");
            });
            let whole = least(|| {
                Pyramid::build(&volume, &table, 1.0, MEASURE, &ticket).expect("it fits");
            });
            println!("| shells {size}³, {name} | host | {coarse} | {whole} | – |");
            renderer.set_volume(&volume, &ticket).expect("it fits");
            renderer.set_table(&table).expect("it fits");
            let mut longest = 0.0_f64;
            let mut built = |is_coarse: bool, bricks: usize| {
                least(|| longest = build(&mut renderer, &volume, &table, is_coarse, bricks))
            };
            let coarse = built(true, 1 << 17);
            let whole = built(false, BRICKS);
            println!("| shells {size}³, {name} | device | {coarse} | {whole} | {longest:.0} |");
        }
    }
}

fn shells(size: usize) -> Arc<ScalarVolume> {
    let grid = demo::open("shells", Some(size)).expect("a demo there is");
    let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new());
    let volume = volume.expect("finite values");
    let (low, high) = (volume.statistics.min, volume.statistics.max);
    let code = |i: usize| ((volume.samples.get(i) - low) / (high - low) * 255.0) as u8;
    let samples = Samples::UInt8((0..volume.lattice.len()).map(code).collect());
    Arc::new(
        ScalarVolume::from_samples("shells", Lattice::unit([size; 3]), samples).expect("sound"),
    )
}

/// The longest piece, milliseconds.
fn build(
    renderer: &mut Renderer,
    volume: &ScalarVolume,
    table: &Table,
    is_coarse: bool,
    bricks: usize,
) -> f64 {
    let parts = PyramidParts::new(volume, 1.0, MEASURE, is_coarse).expect("it fits");
    let mut parts = parts.expect("it has a level 3");
    let mut longest = 0.0_f64;
    while let Some([y, z]) = parts.next_rows(bricks) {
        let rows = BrickRows { y, z, voxel_depth: 1.0, measure: MEASURE, has_nodes: !is_coarse };
        let merged = renderer.merge_bricks(&rows).expect("a sound device");
        longest = longest.max(merged.wall_ms);
        parts.take([rows.y, rows.z], &merged.bricks, &merged.nodes);
    }
    parts.finish(volume, table, &Ticket::new()).expect("nobody cancels");
    longest
}

/// The least and the median of a few runs after one.
fn least(mut run: impl FnMut()) -> String {
    run();
    let mut times: Vec<f64> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    format!("{:.0}, {:.0}", times[0], times[RUNS / 2])
}

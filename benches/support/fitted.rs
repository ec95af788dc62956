//! Octree cuts as quick pictures fit them to a time, beside cuts by error alone and subsampling.

use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::gpu::layout::Record;
use voxsplat::hierarchy::{Cut, CutLimits, ErrorMeasure, Pyramid};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::scene::{Scene, SplatSettings, View};
use voxsplat::task::cost::Costs;
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::transfer::Table;

use super::clock::processor_ms;
use super::scans::{Light, light, scans};
use super::{LEAST_MS, LEAST_RUNS, LEVELS, SIZE};

const COUNTS: [u64; 9] = [500, 1_000, 2_000, 4_000, 8_000, 16_000, 32_000, 64_000, 128_000];
/// By error alone; fitted; fitted, and thinned as a whole.
const WAYS: [&str; 3] = ["by error", "fitted", "fitted and thinned"];

/// For each scan the rows of all ways: nodes, milliseconds with the finding of the cut, and dB to `full`; then
/// what they reach in the times of subsampling.
pub(crate) fn tables(drawer: &mut Drawer) {
    for (name, base) in scans() {
        let load = sysinfo::System::load_average().map_or(0.0, |load| load.one);
        println!("### {name}, load {load:.1}\n");
        table(drawer, &Scene { splat: SplatSettings::SHADE_FIRST, ..base });
    }
}

fn table(drawer: &mut Drawer, scene: &Scene) {
    let ticket = Ticket::new();
    let plan = Plan::of(scene, SIZE);
    drawer.prepare(&plan, &ticket).expect("it fits");
    drawer.draw(&plan, Rung::Full, &mut ()).expect("it draws");
    let full = light(drawer);
    let volume = scene.volume().expect("a field");
    let transfer = scene.transfer().expect("a field");
    let table = Table::new(transfer, volume.samples.scalar_type());
    let depth = scene.lattice().axes().determinant().abs().cbrt();
    let depth = depth / scene.opacity_unit_distance();
    let measure = ErrorMeasure::Classified;
    let pyramid = Pyramid::build(volume, &table, depth, measure, &ticket).expect("it fits");
    let view = View::new(scene, SIZE);
    let unit = scene.opacity_unit_distance();
    let cut_of = |limits| {
        let voxel = |i| table.lookup(volume.samples.get(i));
        Cut::of(&pyramid, limits, view.visit_order(), &view.visibility(1.556), voxel)
    };
    println!("| way | nodes | ms | dB to full | brighter, linear |\n|---|---|---|---|---|");
    let mut curves: Vec<Vec<(f64, f64)>> = Vec::new();
    for (way, name) in WAYS.into_iter().enumerate() {
        let rows = COUNTS.map(|count| {
            let plain = CutLimits::of_error(pyramid.error_for_count(count));
            let splat_px = Some(Costs::default().splat_pixels());
            let fitted = CutLimits { splat_px, minds_edges: true, ..plain };
            // As for a hand that moves on: from the error of the picture before.
            let known = match way {
                0 => plain,
                _ => Cut::of_count(fitted, count, cut_of).1,
            };
            let mut draw = || {
                let (cut, _) = Cut::of_count(known, count, cut_of);
                let factor = if way == 2 { pyramid.thinning.factor(&cut.nodes) } else { 1.0 };
                let records = cut
                    .nodes
                    .iter()
                    .map(|n| Record::new(n.low, n.size, n.node.extinction * factor, n.node.colour));
                let records: Vec<Record> = records.collect();
                drawer
                    .engines
                    .gpu()
                    .expect("a device")
                    .begin(&view, Kernel::Cubic, None, unit)
                    .expect("begun");
                drawer.engines.gpu().expect("a device").draw_records(&records).expect("drawn");
                records.len()
            };
            let (nodes, ms) = timed(&mut draw);
            row(name, nodes, ms, &light(drawer), &full)
        });
        curves.push(rows.into());
    }
    println!();
    for level in LEVELS {
        let mut draw = || {
            let rung = Rung::Subsampled { level };
            drawer.draw(&plan, rung, &mut ()).expect("it draws").kernels as usize
        };
        let (nodes, ms) = timed(&mut draw);
        let name = format!("every {}. sample", 1 << level);
        let (ms, db) = row(&name, nodes, ms, &light(drawer), &full);
        let reached = curves.iter().zip(WAYS).map(|(curve, way)| match at(curve, ms) {
            Some(found) => format!("{way} {found:.1}"),
            None => format!("{way} –"),
        });
        println!(
            "in {ms:.0} ms: subsampling {db:.1} dB, {}",
            reached.collect::<Vec<_>>().join(", ")
        );
    }
    println!();
}

/// Nodes, and processor milliseconds of all threads over two.
fn timed(draw: &mut impl FnMut() -> usize) -> (usize, f64) {
    let nodes = draw();
    let (before, mut runs) = (processor_ms(), 0);
    while runs < LEAST_RUNS || processor_ms() - before < LEAST_MS {
        draw();
        runs += 1;
    }
    (nodes, (processor_ms() - before) / runs as f64 / 2.0)
}

/// Prints a picture's row; its milliseconds and dB.
fn row(name: &str, nodes: usize, ms: f64, found: &Light, full: &Light) -> (f64, f64) {
    let off = Difference::between(found, full).expect("pictures of one size");
    let (db, brighter) = (off.psnr(), off.mean_brightness * 255.0);
    println!("| {name} | {nodes} | {ms:.0} | {db:.1} | {brighter:+.2} |");
    (ms, db)
}

/// What a curve reaches at a time, along its logarithm; `None` beyond its ends.
fn at(curve: &[(f64, f64)], ms: f64) -> Option<f64> {
    let mut points = curve.to_vec();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pair = points.windows(2).find(|pair| (pair[0].0..=pair[1].0).contains(&ms))?;
    let width = (pair[1].0 / pair[0].0).ln();
    let share = if width > 0.0 { (ms / pair[0].0).ln() / width } else { 0.0 };
    Some(pair[0].1 + (pair[1].1 - pair[0].1) * share)
}

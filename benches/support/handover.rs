//! How much brighter octree cuts are than what follows them, as they are found and as quick pictures thin them.

use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::core::colour::srgb_from_linear;
use voxsplat::gpu::layout::Record;
use voxsplat::hierarchy::{Cut, CutLimits, ErrorMeasure, Pyramid};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::scene::{Scene, SplatSettings, View};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::transfer::Table;

use super::SIZE;
use super::scans::{Light, light, scans};

const COUNTS: [u64; 7] = [250, 500, 1_000, 4_000, 16_000, 64_000, 256_000];

/// For each scan as it opens, and at half the opacity.
pub(crate) fn tables(drawer: &mut Drawer) {
    for (name, base) in scans() {
        let own = Scene { splat: SplatSettings::SHADE_FIRST, ..base };
        let mut half = own.clone();
        half.transfer_mut().expect("a field").opacity.iter_mut().for_each(|point| point.1 /= 2.0);
        for (words, scene) in [("", own), (", half", half)] {
            table(drawer, &format!("{name}{words}"), &scene);
        }
    }
}

fn table(drawer: &mut Drawer, name: &str, scene: &Scene) {
    let ticket = Ticket::new();
    let plan = Plan::of(scene, SIZE);
    drawer.prepare(&plan, &ticket).expect("it fits");
    drawer.draw(&plan, Rung::Full, &mut ()).expect("it draws");
    let full = light(drawer);
    let volume = scene.volume().expect("a field");
    let transfer = scene.transfer().expect("a field");
    let table = Table::new(transfer, volume.samples.scalar_type());
    let lattice = &scene.lattice();
    let depth = lattice.axes().determinant().abs().cbrt() / scene.opacity_unit_distance();
    let measure = ErrorMeasure::Classified;
    let whole = Pyramid::build(volume, &table, depth, measure, &ticket).expect("it fits");
    let coarse = Pyramid::coarse(volume, &table, depth, measure, &ticket).expect("it fits");
    println!(
        "| {name} | nodes | factor | brighter, linear | thinned | encoded | thinned | dB | thinned |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (levels, pyramid) in [("all", &whole), ("coarse", &coarse)] {
        for count in COUNTS {
            if levels == "coarse" && count > 4_000 {
                continue;
            }
            let view = View::new(scene, SIZE);
            let limits = CutLimits::of_error(pyramid.error_for_count(count));
            let voxel = |i| table.lookup(volume.samples.get(i));
            let cut = Cut::of(pyramid, limits, view.visit_order(), &view.visibility(1.556), voxel);
            let factor = pyramid.thinning.factor(&cut.nodes);
            let [plain, thinned] = [1.0, factor].map(|factor| {
                let records = cut
                    .nodes
                    .iter()
                    .map(|n| Record::new(n.low, n.size, n.node.extinction * factor, n.node.colour));
                let records: Vec<Record> = records.collect();
                let unit = scene.opacity_unit_distance();
                drawer
                    .engines
                    .gpu()
                    .expect("a device")
                    .begin(&view, Kernel::Cubic, None, unit)
                    .expect("begun");
                drawer.engines.gpu().expect("a device").draw_records(&records).expect("drawn");
                off(&light(drawer), &full)
            });
            println!(
                "| {levels} | {} | {factor:.2} | {:+.2} | {:+.2} | {:+.2} | {:+.2} | {:.1} | {:.1} |",
                cut.nodes.len(),
                plain[0],
                thinned[0],
                plain[1],
                thinned[1],
                plain[2],
                thinned[2]
            );
        }
    }
    println!();
}

/// How much brighter, 1/255: in linear light and encoded; and dB.
fn off(found: &Light, full: &Light) -> [f64; 3] {
    let difference = Difference::between(found, full).expect("pictures of one size");
    let encoded = |light: &Light| {
        let sum: f64 = light.iter().flat_map(|p| &p[..3]).map(|&c| srgb_from_linear(c)).sum();
        sum / (3 * light.len()) as f64
    };
    let brighter = [difference.mean_brightness, encoded(found) - encoded(full)];
    [brighter[0] * 255.0, brighter[1] * 255.0, difference.psnr()]
}

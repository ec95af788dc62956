//! Quick pictures from cuts of a field beside smaller ones of all of it: `cargo bench --bench cuts [-- FILE…]`.
//!
//! At 1280 × 800, by the native engine: for every cut and size the least time of several pictures (ms) and their
//! PSNR to the exact picture in linear light. Prints Markdown. Without files, the scenes of `benches/peers/vtk_previews.py`.

use std::sync::Arc;
use std::time::Instant;

#[path = "support/peers.rs"]
mod peers;

use voxsplat::accuracy::{self, Difference};
use voxsplat::core::Ticket;
use voxsplat::core::enlarge::enlarged;
use voxsplat::gpu::Wishes;
use voxsplat::hierarchy::{BrickErrors, Means};
use voxsplat::plan::{Plan, SlabField};
use voxsplat::scene::Scene;
use voxsplat::task::cuts::{cut_within, stored_levels};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engines::{EngineChoice, Engines};
use voxsplat::transfer::{Cumulative, Weight};

const SIZE: [u32; 2] = [1280, 800];
const ERRORS: [f32; 9] = [-1.0, 0.001, 0.002, 0.004, 0.008, 0.015, 0.025, 0.05, 9.0];
const SHRINKS: [f64; 8] = [1.0, 1.26, 1.587, 2.0, 2.52, 3.17, 4.0, 5.04];
const RUNS: usize = 5;

fn main() {
    for (name, scene) in peers::scenes() {
        measure(&name, &scene);
    }
}

fn wide(light: Vec<[f32; 4]>) -> Vec<[f64; 4]> {
    light.into_iter().map(|pixel| pixel.map(f64::from)).collect()
}

fn measure(name: &str, scene: &Scene) {
    let engines = Engines::new(EngineChoice::Native.into(), Wishes::default()).expect("native");
    let mut drawer = Drawer::with(engines);
    let plan = Plan::of(scene, SIZE);
    drawer.prepare(&plan, &Ticket::new()).expect("it fits");
    drawer.draw(&plan, Rung::Full, &mut ()).expect("it draws");
    let exact = wide(drawer.engines.native.light().0);
    let volume = scene.volume().expect("a field");
    let ticket = Ticket::new();
    let start = Instant::now();
    let means = Means::of(volume, &ticket).expect("made").expect("large enough");
    let means_ms = start.elapsed().as_secs_f64() * 1e3;
    let field = plan.field().expect("a field");
    let function = Cumulative::new(
        &field.transfer,
        volume.samples.scalar_type(),
        &volume.statistics,
        Weight::Extinction,
    );
    let thickness = plan.frame.lattice.smallest_spacing() / plan.frame.unit_distance;
    let (bricks, shown) = drawer.engines.native.shown_bricks().expect("a table");
    let shown = shown.to_vec();
    let start = Instant::now();
    let found = BrickErrors::of(volume, &means, (&function, thickness), (bricks, &shown), &ticket);
    let errors_ms = start.elapsed().as_secs_f64() * 1e3;
    let errors = found.expect("not cancelled").errors;
    let levels = stored_levels(volume, &means, &ticket).expect("not cancelled");
    drawer.engines.native.set_levels(levels);
    println!(
        "## {name}\n\nmeans {means_ms:.0} ms, errors {errors_ms:.0} ms, {} of {} bricks show\n",
        shown.len(),
        errors.len()
    );
    let sizes = SHRINKS.map(|s| format!("1/{s}")).join(" | ");
    println!(
        "| error | bricks of levels 0, 1, 2 | {sizes} |\n|---|---{}|",
        "|---".repeat(SHRINKS.len())
    );
    let mut row = |title: String, counts: String, plan: &Plan, field: SlabField| {
        let cells = SHRINKS.map(|shrink| {
            let rung = match shrink {
                1.0 if field == SlabField::Own => Rung::Full,
                shrink => Rung::Reduced { field, shrink },
            };
            let (mut least, mut size) = (f64::INFINITY, SIZE);
            for _ in 0..RUNS {
                let drawn = drawer.draw(plan, rung, &mut ()).expect("it draws");
                (least, size) = (least.min(drawn.wall_ms), drawn.size);
            }
            let shown = wide(enlarged(drawer.engines.native.light().0, size, SIZE));
            let Difference { rmse, .. } = Difference::between(&shown, &exact).expect("one size");
            format!("{least:.1}: {:.1}", accuracy::psnr_from_rmse(rmse))
        });
        println!("| {title} | {counts} | {} |", cells.join(" | "));
    };
    for field in [SlabField::Own, SlabField::Preview] {
        row(format!("{field:?} whole"), String::new(), &plan, field);
    }
    for most in ERRORS {
        let cut = cut_within(most, bricks, &shown, &errors);
        let counts = cut.counts().map(|n| n.to_string()).join(", ");
        let plan = Plan { cut: Some(Arc::new(cut)), ..plan.clone() };
        for field in [SlabField::Own, SlabField::Preview] {
            row(format!("{field:?} {most}"), counts.clone(), &plan, field);
        }
    }
    println!();
}

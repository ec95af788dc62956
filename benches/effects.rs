//! What each effect costs, alone and with others: `cargo bench --bench effects [-- FILE…]`.
//!
//! For each scan, in the exact mode at 1280 × 800 with the transfer function it opens with: the picture
//! without any effect, with each, and with several at once. Prints Markdown: wall time, the least of a few;
//! processor time of all threads over two, which stays near what a quiet machine with two cores takes
//! (Linux only); bytes on the device; pipelines; and how far the picture is from the plain one. Every row
//! has a device of its own, so that its bytes and pipelines are its own too.

#[path = "support/clock.rs"]
mod clock;
#[path = "support/scans.rs"]
mod scans;

use glam::DVec3;
use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::gpu::{AdapterChoice, Context, Renderer, Wishes};
use voxsplat::plan::Plan;
use voxsplat::scene::{
    AlongRay, Clip, ClipBox, CutFaces, Inside, Isosurface, Plane, Scene, Shading, ShadingPreset,
    Slice,
};
use voxsplat::task::draw::{Drawer, Rung};

use clock::processor_ms;
use scans::{Light, light, scans};

const SIZE: [u32; 2] = [1280, 800];
/// Each picture is drawn at least so often, and for so many milliseconds of processor time.
const LEAST_RUNS: usize = 3;
const LEAST_MS: f64 = 2000.0;

fn main() {
    let adapter = drawer().engines.made_gpu().expect("a device").context().adapter_name.clone();
    println!("{adapter}\n");
    for (name, scene) in scans() {
        scan(&name, &scene);
    }
}

fn drawer() -> Drawer {
    let context = Context::new(&AdapterChoice::Auto, Wishes::default()).expect("an adapter");
    Drawer::new(Renderer::new(context))
}

/// Everything that is measured, plain first.
fn variants(base: &Scene) -> Vec<(String, Scene)> {
    let volume = base.volume().expect("a field");
    let lattice = volume.lattice;
    let with = |name: &str, inside: Inside| (name.to_owned(), Scene { inside, ..base.clone() });
    let half = ClipBox { high: [1.0, 0.5, 1.0], ..ClipBox::WHOLE };
    let clip = |faces| Clip { bounds: Some(half), faces, ..Clip::default() };
    let oblique = Plane { point: lattice.centre(), normal: DVec3::new(0.6, -0.5, 0.4) };
    // A level with opacity: where the function first has half of its greatest.
    let points = &base.transfer().expect("a field").opacity;
    let most = points.iter().map(|point| point.1).fold(0.0, f64::max);
    let level = points.iter().find(|point| point.1 >= 0.5 * most).map_or(0.0, |point| point.0);
    let surface = Isosurface { value: level, opacity: 0.8, colour: None };
    let slices = [0, 1, 2].map(|axis| Slice::across(&lattice, axis, 0.5, 1.0)).to_vec();
    let mut all = vec![("none".to_owned(), base.clone())];
    for &preset in ShadingPreset::ALL {
        let shading = preset.shading(volume);
        all.push((preset.name().to_owned(), Scene { shading, ..base.clone() }));
    }
    let lit: Shading = ShadingPreset::Lights.shading(volume);
    let inside = Inside::default;
    let together = Inside {
        clip: clip(CutFaces::Coloured),
        isosurfaces: vec![surface],
        slices: slices[..1].to_vec(),
        ..inside()
    };
    all.extend([
        with("clip box", Inside { clip: clip(CutFaces::Through), ..inside() }),
        with(
            "clip plane",
            Inside { clip: Clip { planes: vec![oblique], ..Clip::default() }, ..inside() },
        ),
        with("clip box, cut faces", Inside { clip: clip(CutFaces::Coloured), ..inside() }),
        with("three slices", Inside { slices, ..inside() }),
        with("isosurface", Inside { isosurfaces: vec![surface], ..inside() }),
        with("maximum", Inside { along: AlongRay::Maximum, ..inside() }),
        with("average", Inside { along: AlongRay::Average, ..inside() }),
        (
            "lights, clip box, cut faces, a slice, isosurface".to_owned(),
            Scene { shading: lit, inside: together, ..base.clone() },
        ),
    ]);
    all
}

fn scan(name: &str, base: &Scene) {
    let load = sysinfo::System::load_average().map_or(0.0, |load| load.one);
    println!("## {name}\n\nLoad {load:.1} at the start.\n");
    println!("| effects | ms | processor ms / 2 | MB | pipelines | dB from none |");
    println!("|---|---|---|---|---|---|");
    let mut plain: Option<Light> = None;
    for (effects, scene) in variants(base) {
        let mut drawer = drawer();
        let plan = Plan::of(&scene, SIZE);
        drawer.prepare(&plan, &Ticket::new()).expect("it fits");
        let mut draw = || drawer.draw(&plan, Rung::Full, &mut ()).expect("it draws").wall_ms;
        // Compiles.
        draw();
        let (before, mut walls) = (processor_ms(), Vec::new());
        while walls.len() < LEAST_RUNS || processor_ms() - before < LEAST_MS {
            walls.push(draw());
        }
        let processor_ms = (processor_ms() - before) / walls.len() as f64 / 2.0;
        let least = walls.iter().copied().fold(f64::INFINITY, f64::min);
        let light = light(&mut drawer);
        let from_plain = plain.as_ref().map_or("–".to_owned(), |plain| {
            let rmse = Difference::between(&light, plain).expect("pictures of one size").rmse;
            format!("{:.1}", -20.0 * rmse.log10())
        });
        println!(
            "| {effects} | {least:.0} | {processor_ms:.0} | {:.1} | {} | {from_plain} |",
            drawer.engines.gpu().expect("a device").peak_bytes() as f64 / 1e6,
            drawer.engines.gpu().expect("a device").pipeline_count(),
        );
        plain.get_or_insert(light);
    }
    println!();
}

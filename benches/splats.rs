//! Footprints evaluated at every pixel beside meshes of triangles: `cargo bench --bench splats`.
//!
//! Kernels of some radius in pixels fill 1024 × 1024, as octree nodes do, and then whole volumes are
//! drawn. Prints milliseconds of wall time, the best of a few, and of processor time of all threads
//! over two, which stays near what a quiet machine with two cores takes. Linux only, for the latter.

#[path = "support/clock.rs"]
mod clock;

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::gpu::layout::Record;
use voxsplat::gpu::{AdapterChoice, Context, Renderer, Wishes};
use voxsplat::kernel::{Kernel, Subdivisions};
use voxsplat::plan::Plan;
use voxsplat::scene::{self, OpacityModel, SampleSource, Scene, SplatSettings, View};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::{Component, Lattice, Samples, ScalarVolume, demo};

use clock::processor_ms;

const SIDE: u32 = 1024;
/// Splats and their radius in pixels: thirty over one another everywhere, but for the smallest.
const FILLS: [(u32, f64); 8] = [
    (65_536, 3.2),
    (65_536, 6.0),
    (65_536, 12.0),
    (16_000, 25.0),
    (4_000, 50.0),
    (1_000, 100.0),
    (250, 200.0),
    (64, 400.0),
];
const MESHES: [(u32, u32); 4] = [(7, 2), (8, 4), (12, 4), (16, 6)];
/// Milliseconds of processor time to spend on each.
const LEAST_MS: f64 = 1000.0;

fn main() {
    let context = Context::new(&AdapterChoice::Auto, Wishes::default()).expect("an adapter");
    let mut drawer = Drawer::new(Renderer::new(context));
    println!("{}", drawer.engines.gpu().expect("a device").context().adapter_name);
    println!("splats, radius: how drawn, wall ms, processor ms / 2, RMSE to footprints");
    for (count, radius) in FILLS {
        fill(&mut drawer, count, radius);
    }
    println!("volume: how drawn, wall ms, processor ms / 2, RMSE to the exact picture");
    for (name, size) in [("head", 64), ("blobs", 32), ("marschner-lobb", 40)] {
        volume(&mut drawer, name, size);
    }
}

/// The least wall time of a few runs, and the mean processor time over two.
fn timed(mut draw: impl FnMut()) -> [f64; 2] {
    draw();
    let (before, mut least, mut runs) = (processor_ms(), f64::INFINITY, 0.0);
    while processor_ms() - before < LEAST_MS {
        let start = Instant::now();
        draw();
        least = least.min(start.elapsed().as_secs_f64() * 1e3);
        runs += 1.0;
    }
    [least, (processor_ms() - before) / runs / 2.0]
}

fn mode(subdivisions: Option<(u32, u32)>) -> (String, SplatSettings) {
    let base = SplatSettings::SHADE_FIRST;
    match subdivisions {
        None => ("footprints".to_owned(), base),
        Some((angles, rings)) => {
            let gouraud = Subdivisions { angles, rings };
            let splat = SplatSettings { kernel: Kernel::Gouraud, gouraud, ..base };
            (format!("mesh {angles} × {rings} ({} triangles)", gouraud.triangles()), splat)
        }
    }
}

fn modes() -> impl Iterator<Item = (String, SplatSettings)> {
    std::iter::once(None).chain(MESHES.map(Some)).map(mode)
}

fn fill(drawer: &mut Drawer, count: u32, radius: f64) {
    // The lattice only gives the scale: a record may lie anywhere in it.
    let voxels = f64::from(SIDE) / radius * 1.556;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred")]
    let n = voxels.ceil() as usize;
    let lattice = Lattice::unit([n, n, 1]);
    let samples = Samples::UInt8(vec![1; n * n]);
    let volume = ScalarVolume::from_samples("flat", lattice, samples).expect("a sound volume");
    let mut scene = scene::opening(SampleSource::default(), Arc::new(volume), None);
    scene.camera = scene::framing_camera(&lattice, DVec3::NEG_Z, DVec3::Y);
    scene.camera.parallel_scale = voxels / 2.0;
    let records: Vec<Record> = (0..count).map(|i| record(i, voxels)).collect();
    let mut truth = None;
    for (name, splat) in modes() {
        let scene = Scene { splat, ..scene.clone() };
        drawer.prepare(&Plan::of(&scene, [SIDE; 2]), &Ticket::new()).expect("it prepares");
        let view = View::new(&scene, [SIDE; 2]);
        let renderer = drawer.engines.gpu().expect("a device");
        let mut draw = || {
            match splat.kernel {
                Kernel::Gouraud => renderer.begin_meshes(&view, &splat, 1.0),
                kernel => renderer.begin(&view, kernel, None, 1.0),
            }
            .expect("it begins");
            // Pieces as the octree's are drawn.
            for piece in records.chunks(65_536) {
                renderer.draw_records(piece).expect("it draws");
            }
        };
        let [wall, processor] = timed(&mut draw);
        let light = wide(&renderer.read_light().expect("it reads back"));
        let rmse = rmse(&light, truth.get_or_insert_with(|| light.clone()));
        println!("{count}, {radius}: {name}, {wall:.0}, {processor:.0}, {rmse:.4}");
    }
}

fn record(i: u32, voxels: f64) -> Record {
    let shade = |k: u32| random(4 * i + k);
    let colour = std::array::from_fn(|k| (shade(k as u32) * 65535.0) as u16);
    let mut record = Record::new([0; 3], [1; 3], 0.1 + 0.3 * shade(3) as f32, colour);
    let place = |k: u32| (random(0x8000_0000 ^ (2 * i + k)) * voxels) as f32;
    record.centre = [place(0), place(1), 0.0];
    record
}

/// Uniform in 0..1, by index.
fn random(index: u32) -> f64 {
    let mut z = u64::from(index).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
}

fn volume(drawer: &mut Drawer, name: &str, size: usize) {
    let grid = demo::open(name, Some(size)).expect("a demo there is");
    let field = grid.field(None).expect("it has a field");
    let volume = grid.scalar(field, Component::Index(0), &Ticket::new()).expect("it is finite");
    let base = scene::opening(SampleSource::default(), Arc::new(volume), grid.space.as_deref());
    let mut draw = |splat: SplatSettings| {
        let scene = Scene { splat, ..base.clone() };
        let plan = Plan::of(&scene, [512; 2]);
        drawer.prepare(&plan, &Ticket::new()).expect("it prepares");
        let times = timed(|| {
            drawer.draw(&plan, Rung::Full, &mut ()).expect("it draws");
        });
        (times, wide(&drawer.engines.gpu().expect("a device").read_light().expect("it reads back")))
    };
    let (_, exact) = draw(SplatSettings { slabs_per_voxel: 2.0, ..SplatSettings::EXACT });
    let gaussian = SplatSettings { kernel: Kernel::Gaussian, ..SplatSettings::SHADE_FIRST };
    let modes = std::iter::once(("Gaussian footprints".to_owned(), gaussian)).chain(modes());
    for (how, splat) in modes {
        for opacity_model in [OpacityModel::OpticalDepth, OpacityModel::Published] {
            let ([wall, processor], light) = draw(SplatSettings { opacity_model, ..splat });
            let (model, rmse) = (opacity_model.name(), rmse(&light, &exact));
            println!("{name} {size}: {how}, {model}, {wall:.0}, {processor:.0}, {rmse:.4}");
        }
    }
}

fn wide(light: &[[f32; 4]]) -> Vec<[f64; 4]> {
    light.iter().map(|pixel| pixel.map(f64::from)).collect()
}

fn rmse(found: &[[f64; 4]], expected: &[[f64; 4]]) -> f64 {
    Difference::between(found, expected).expect("pictures of one size").rmse
}

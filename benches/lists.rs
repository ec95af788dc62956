//! Octree cuts by triangles and by lists, and the sort: `cargo bench --bench lists`.
//!
//! Prints milliseconds at 1280 × 800, the best of a few, and where the lists' time goes.

use std::sync::Arc;

use voxsplat::core::Ticket;
use voxsplat::gpu::{AdapterChoice, Context, Renderer, Wishes};
use voxsplat::plan::Plan;
use voxsplat::scene::{self, Backend, Order, SampleSource, Scene, SplatSettings, Visibility};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::{Component, demo};

const SIZE: [u32; 2] = [1280, 800];
const RUNS: usize = 3;

fn main() {
    let context = Context::new(&AdapterChoice::Auto, Wishes::default()).expect("an adapter");
    let mut drawer = Drawer::new(Renderer::new(context));
    println!("{}", drawer.engines.gpu().expect("a device").context().adapter_name);
    sorts(&mut drawer);
    let grid = demo::open("head", Some(128)).expect("a demo there is");
    let field = grid.field(None).expect("it has a field");
    let volume = grid.scalar(field, Component::Index(0), &Ticket::new()).expect("it is finite");
    let base = scene::opening(SampleSource::default(), Arc::new(volume), None);
    for nodes in [4_000, 16_000, 64_000] {
        for backend in [Backend::Raster, Backend::Tiles] {
            let splat = SplatSettings { backend, ..SplatSettings::SHADE_FIRST };
            measure(&mut drawer, backend.name(), &base, splat, nodes);
        }
        let order = Order::FrontToBack;
        let backend = Backend::Tiles;
        let every = SplatSettings { backend, order, ..SplatSettings::SHADE_FIRST };
        measure(&mut drawer, "tiles, front to back", &base, every, nodes);
        for slabs_per_voxel in [0.5, 1.0] {
            let slabs = SplatSettings { visibility: Visibility::Slabs, slabs_per_voxel, ..every };
            let name = format!("slabs, {slabs_per_voxel} a voxel");
            measure(&mut drawer, &name, &base, slabs, nodes);
        }
    }
}

fn measure(drawer: &mut Drawer, name: &str, base: &Scene, splat: SplatSettings, nodes: u64) {
    let plan = Plan::of(&Scene { splat, ..base.clone() }, SIZE);
    drawer.prepare(&plan, &Ticket::new()).expect("it prepares");
    let rung = Rung::Octree { max_error: drawer.error_for_count(nodes) };
    let mut drawn = || drawer.draw(&plan, rung, &mut ()).expect("it draws");
    let times: Vec<_> = (0..=RUNS).map(|_| drawn()).collect();
    let best = times[1..].iter().map(|d| d.wall_ms).fold(f64::INFINITY, f64::min);
    drawer.engines.gpu().expect("a device").time_passes();
    drawer.draw(&plan, rung, &mut ()).expect("it draws");
    let rows: Vec<String> = drawer
        .engines
        .gpu()
        .expect("a device")
        .times()
        .iter()
        .map(|t| format!("{} {:.1}", t.name, t.gpu_ms))
        .collect();
    drawer.engines.gpu().expect("a device").stop_timing();
    println!("{} nodes, {name}: {best:.1} ms ({})", times[0].nodes, rows.join(", "));
}

fn sorts(drawer: &mut Drawer) {
    for log2 in [16, 20, 22] {
        let keys: Vec<u32> =
            (0..1_u32 << log2).map(|i| i.wrapping_mul(0x9e37_79b9) >> 12).collect();
        let sorted = |_| {
            drawer
                .engines
                .gpu()
                .expect("a device")
                .sort_pairs(&keys, &keys, 20)
                .expect("it sorts")
                .2
        };
        let best = (0..RUNS).map(sorted).fold(f64::INFINITY, f64::min);
        let rate = keys.len() as f64 / best / 1e3;
        println!("sort of 2^{log2} keys of 20 bits: {best:.1} ms, {rate:.1} million a second");
    }
}

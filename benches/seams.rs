//! What an octree cut costs where nodes of levels two or more apart meet: `cargo bench --bench seams
//! [-- FILE…]`.
//!
//! For each scan, shaded first, every sample, at 1280 × 800 with the transfer function it opens with.
//! The seams of an unbalanced cut are the pixels within a kernel's radius, of the finer node's, of a face
//! that it shares with a node at least two levels up. Prints Markdown: the RMSE from `full` on those
//! pixels and on the others that anything is drawn on, of that cut, of the balanced one of the same error,
//! and of the balanced one with no more nodes. Scans are those of `VOXSPLAT_DATA` (default
//! `../shared/data`), or the files named.

#[path = "support/scans.rs"]
mod scans;

use voxsplat::core::Ticket;
use voxsplat::gpu::{AdapterChoice, Context, Renderer, Wishes};
use voxsplat::hierarchy::CutNode;
use voxsplat::kernel::RadialKernel;
use voxsplat::plan::Plan;
use voxsplat::scene::{CutSettings, Scene, SplatSettings, View};
use voxsplat::task::draw::{Drawer, Rung};

use scans::{Light, light, scans};

const SIZE: [u32; 2] = [1280, 800];
const NODES: [u64; 4] = [1_000, 4_000, 16_000, 64_000];
/// Halvings of the error's logarithm, to find the balanced cut of as many nodes.
const STEPS: u32 = 9;
/// Of a voxel that no node of the cut has.
const NOTHING: u8 = u8::MAX;

fn main() {
    let context = Context::new(&AdapterChoice::Auto, Wishes::default()).expect("an adapter");
    let mut drawer = Drawer::new(Renderer::new(context));
    println!("{}\n", drawer.engines.gpu().expect("a device").context().adapter_name);
    println!(
        "| scan | nodes | seams, % of what is drawn | at seams | balanced, same error (nodes) | \
         balanced, as many nodes (nodes) | elsewhere | balanced, same error | as many nodes |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, scene) in scans() {
        scan(&mut drawer, &name, &scene);
    }
}

fn scan(drawer: &mut Drawer, name: &str, base: &Scene) {
    let of =
        |cut| Scene { splat: SplatSettings { cut, ..SplatSettings::SHADE_FIRST }, ..base.clone() };
    let uneven = of(CutSettings::UNIFORM);
    let even = of(CutSettings { balanced: true, ..CutSettings::UNIFORM });
    let plan = Plan::of(&uneven, SIZE);
    drawer.prepare(&plan, &Ticket::new()).expect("it fits");
    drawer.draw(&plan, Rung::Full, &mut ()).expect("it draws");
    let full = light(drawer);
    for count in NODES {
        let max_error = drawer.error_for_count(count);
        let (cut, uneven_light) = drawn(drawer, &uneven, max_error);
        let mask = seams(&uneven, &cut);
        let (same_error, same_error_light) = drawn(drawer, &even, max_error);
        // The least error whose balanced cut has no more nodes.
        let (mut low, mut high) = (max_error, max_error * 16.0);
        let (mut as_many, mut as_many_light) = drawn(drawer, &even, high);
        for _ in 0..STEPS {
            let middle = (low * high).sqrt();
            let (nodes, light) = drawn(drawer, &even, middle);
            if nodes.len() <= cut.len() {
                high = middle;
                (as_many, as_many_light) = (nodes, light);
            } else {
                low = middle;
            }
        }
        let anything: Vec<bool> =
            (0..full.len()).map(|i| full[i][3] > 1e-4 || uneven_light[i][3] > 1e-4).collect();
        let drawn = anything.iter().filter(|&&shows| shows).count();
        let at_seams = mask.iter().zip(&anything).filter(|&(&seam, &shows)| seam && shows).count();
        let rmse = |light: &Light, is_seam: bool| {
            let (mut squares, mut values) = (0.0, 0.0);
            for i in (0..full.len()).filter(|&i| anything[i] && mask[i] == is_seam) {
                for c in 0..3 {
                    squares += (light[i][c] - full[i][c]).powi(2);
                    values += 1.0;
                }
            }
            (squares / f64::max(values, 1.0)).sqrt()
        };
        println!(
            "| {name} | {} | {:.0} | {:.4} | {:.4} ({}) | {:.4} ({}) | {:.4} | {:.4} | {:.4} |",
            cut.len(),
            100.0 * at_seams as f64 / drawn as f64,
            rmse(&uneven_light, true),
            rmse(&same_error_light, true),
            same_error.len(),
            rmse(&as_many_light, true),
            as_many.len(),
            rmse(&uneven_light, false),
            rmse(&same_error_light, false),
            rmse(&as_many_light, false),
        );
    }
}

fn drawn(drawer: &mut Drawer, scene: &Scene, max_error: f32) -> (Vec<CutNode>, Light) {
    drawer.keeps_cut = true;
    drawer.draw(&Plan::of(scene, SIZE), Rung::Octree { max_error }, &mut ()).expect("it draws");
    let (cut, _) = drawer.take_cut().expect("it was kept");
    (cut.nodes, light(drawer))
}

/// Pixels near a face of a node beyond which lies one at least two levels finer.
fn seams(scene: &Scene, cut: &[CutNode]) -> Vec<bool> {
    let lattice = &scene.lattice();
    let dims = lattice.dims;
    let mut level_of = vec![NOTHING; lattice.len()];
    let index = |[x, y, z]: [usize; 3]| (z * dims[1] + y) * dims[0] + x;
    for node in cut {
        let [x, y, z] = node.low.map(|n| n as usize);
        let size = node.size.map(|n| n as usize);
        for dz in 0..size[2] {
            for dy in 0..size[1] {
                level_of[index([x, y + dy, z + dz])..][..size[0]].fill(node.level);
            }
        }
    }
    let view = View::new(scene, SIZE);
    let kernel = RadialKernel::new(scene.splat.kernel, scene.splat.extent).expect("radial");
    let radius_px = kernel.radius() * view.voxel_pixels();
    let mut mask = vec![false; (SIZE[0] * SIZE[1]) as usize];
    for node in cut.iter().filter(|node| node.level >= 2) {
        for axis in 0..3 {
            let [across, along] = [(axis + 1) % 3, (axis + 2) % 3];
            for up in [false, true] {
                let low = node.low.map(|n| n as usize);
                let size = node.size.map(|n| n as usize);
                let beside = if up { low[axis] + size[axis] } else { low[axis].wrapping_sub(1) };
                if beside >= dims[axis] {
                    continue;
                }
                for i in 0..size[across] * size[along] {
                    let mut at = low;
                    at[axis] = beside;
                    at[across] += i % size[across];
                    at[along] += i / size[across];
                    let finer = level_of[index(at)];
                    if finer > node.level - 2 {
                        continue;
                    }
                    let mut face = glam::DVec3::from(at.map(|n| n as f64));
                    face[axis] += if up { -0.5 } else { 0.5 };
                    let seen = scene.camera.to_view(lattice.world_from_index(face));
                    let size = SIZE.map(f64::from);
                    if let Some(pixel) = scene.camera.pixel_from_view(seen, size) {
                        mark(&mut mask, pixel, radius_px * f64::from(1_u32 << finer));
                    }
                }
            }
        }
    }
    mask
}

/// Marks the pixels whose middles lie within a radius.
fn mark(mask: &mut [bool], at: glam::DVec2, radius: f64) {
    let span = |x: f64, n: u32| {
        let first = (x - radius - 0.5).ceil().max(0.0);
        let last = (x + radius - 0.5).floor().min(f64::from(n) - 1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a pixel")]
        let range = first as usize..if last < 0.0 { 0 } else { last as usize + 1 };
        range
    };
    for y in span(at.y, SIZE[1]) {
        for x in span(at.x, SIZE[0]) {
            let off = glam::DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - at;
            mask[y * SIZE[0] as usize + x] |= off.length_squared() <= radius * radius;
        }
    }
}

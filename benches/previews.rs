//! Which field quick pictures are best drawn from: `cargo bench --bench previews`.
//!
//! Three scans at 1280 × 800, in the scenes that `benches/peers/vtk_previews.py` draws. Fields are the
//! nearest tents, and tents through means of 2, 4 and 8 samples a side with the spread about them. For
//! each, pictures of fixed sizes, enlarged linearly: their PSNR to the exact picture in linear light, how
//! much brighter they are (1/255), and the least time of several (ms). Prints Markdown. Scans are
//! those of `VOXSPLAT_DATA` (default `../shared/data`). Of files or demos that are named instead: what the
//! engine shows of each while its view is turned, and how long it takes from a new view to the full picture,
//! by way of coarser ones and at once.

use std::path::Path;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

#[path = "support/peers.rs"]
mod peers;

use voxsplat::accuracy::{self, Difference};
use voxsplat::app::words;
use voxsplat::core::Ticket;
use voxsplat::core::enlarge::enlarged;
use voxsplat::gpu::{AdapterChoice, Context, Renderer, SlabField, Wishes};
use voxsplat::hierarchy::ScalarPyramid;
use voxsplat::kernel::{Averaged, Coefficients, Kernel, nearest_tents};
use voxsplat::plan::Plan;
use voxsplat::scene::{Scene, SplatSettings};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engine::{Effort, Engine, EngineState, FrameRequest, Ladder, Picture};
use voxsplat::volume::ScalarVolume;

const SIZE: [u32; 2] = [1280, 800];
/// How many times smaller pictures are drawn.
const SHRINKS: [f64; 6] = [4.0, 6.35, 8.0, 10.67, 12.7, 16.67];
const RUNS: usize = 5;
/// The window's viewport at 1280 × 800, and pictures of a turn.
const VIEWPORT: [u32; 2] = [944, 743];
const TURNS: usize = 40;
/// New views that are drawn up to the full picture, by rungs and at once in turns.
const CLIMBS: usize = 3;

fn main() {
    let named = peers::named();
    if !named.is_empty() {
        println!(
            "| file | samples | read, ms | first picture, ms | full, ms | while turned | ms, median and most | rung | to full by rungs, ms | at once, ms | ratio | load |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
        named.iter().for_each(|path| turned(path));
        return;
    }
    for (name, scene) in peers::scenes() {
        measure(&name, &scene);
    }
}

/// What the window shows of a file while a hand turns it, by the engine: sizes and times at 20 ms.
fn turned(path: &Path) {
    let start = Instant::now();
    let scene = match peers::open(path) {
        Ok(scene) => scene,
        Err(reason) => {
            eprintln!("skipped {}: {reason}", path.display());
            return;
        }
    };
    let load_ms = start.elapsed().as_secs_f64() * 1e3;
    let (sender, receiver) = mpsc::channel();
    let engine = Engine::start(AdapterChoice::Auto, move || sender.send(()).unwrap_or_default());
    let next = |is_it: &dyn Fn(&Picture) -> bool| loop {
        receiver.recv_timeout(Duration::from_secs(400)).expect("the engine answers");
        if let Some(picture) = engine.take_picture().filter(|picture| is_it(picture)) {
            return picture;
        }
        if let EngineState::Failed(reason) = engine.state() {
            panic!("{reason}");
        }
    };
    let budget_ms = 20.0;
    let rest = Effort::Rest {
        budget_ms,
        ladder: Ladder::Octree,
        show_partial: false,
        converge_ms: 0.0,
        smooth_edges: false,
    };
    let request = |scene: &Scene, effort| {
        engine.request(FrameRequest { scene: scene.clone(), size: VIEWPORT, effort });
    };
    let start = Instant::now();
    request(&scene, rest);
    let first = next(&|_| true);
    let first_ms = start.elapsed().as_secs_f64() * 1e3;
    let full = match first.report.progress >= 1.0 {
        true => first,
        false => next(&|picture| picture.report.progress >= 1.0),
    };
    let full_ms = start.elapsed().as_secs_f64() * 1e3;
    let mut shown: Vec<Arc<Picture>> = Vec::new();
    for turn in 0..TURNS {
        let camera = scene.camera.orbited(0.01 * (turn + 1) as f64, 0.0);
        request(&Scene { camera, ..scene.clone() }, Effort::Moving { budget_ms });
        shown.push(next(&|_| true));
    }
    let mut times: Vec<f64> = shown[TURNS / 2..].iter().map(|p| p.report.frame_ms).collect();
    times.sort_by(f64::total_cmp);
    let last = &shown[TURNS - 1];
    let mut climbs = [Ladder::Octree, Ladder::AtOnce].map(|ladder| (ladder, Vec::new()));
    for climb in 0..CLIMBS {
        for (way, (ladder, took)) in climbs.iter_mut().enumerate() {
            let turn = 0.5 + 0.02 * (2 * climb + way) as f64;
            let camera = scene.camera.orbited(turn, 0.0);
            let effort = Effort::Rest {
                budget_ms,
                ladder: *ladder,
                show_partial: false,
                converge_ms: 0.0,
                smooth_edges: false,
            };
            let start = Instant::now();
            request(&Scene { camera, ..scene.clone() }, effort);
            next(&|picture| picture.report.progress >= 1.0);
            took.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    let [rungs, at_once] = climbs.map(|(_, mut took)| {
        took.sort_by(f64::total_cmp);
        took[CLIMBS / 2]
    });
    println!(
        "| {} | {:?} | {load_ms:.0} | {first_ms:.0} | {full_ms:.0} ({:.0}) | {}×{} | {:.1}, {:.1} | {} | {rungs:.0} | {at_once:.0} | {:.2} | {:.1} |",
        path.file_name().unwrap_or_default().to_string_lossy(),
        scene.lattice().dims,
        full.report.frame_ms,
        last.size[0],
        last.size[1],
        times[times.len() / 2],
        times[times.len() - 1],
        words::level_in_full(&last.report.level),
        rungs / at_once,
        sysinfo::System::load_average().map_or(0.0, |load| load.one),
    );
}

fn drawer(scene: &Scene) -> Drawer {
    let context = Context::new(&AdapterChoice::Auto, Wishes::default()).expect("an adapter");
    let mut drawer = Drawer::new(Renderer::new(context));
    drawer.prepare(&Plan::of(scene, SIZE), &Ticket::new()).expect("it fits");
    drawer
}

fn light(drawer: &mut Drawer) -> Vec<[f32; 4]> {
    drawer.engines.gpu().expect("a device").read_light().expect("it reads back")
}

fn wide(light: Vec<[f32; 4]>) -> Vec<[f64; 4]> {
    light.into_iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// Means of 2^level samples a side, with so many times the width that `task` gives them.
fn means(volume: &ScalarVolume, level: u32, width: f32) -> Coefficients {
    let ticket = Ticket::new();
    if level == 0 {
        return nearest_tents(volume, &ticket).expect("made");
    }
    let ScalarPyramid { dims, bias, mut levels } =
        ScalarPyramid::build_levels(volume, level as usize, &ticket).expect("made");
    let coarse = levels.swap_remove(level as usize - 1);
    let half_widths = coarse.spread.iter().map(|s| s * 3.0_f32.sqrt() * width).collect();
    let averaged = Averaged { level, volume_dims: dims, half_widths };
    Coefficients::of_means(coarse.dims, coarse.mean, bias, averaged, &ticket).expect("made")
}

/// Means of the exact picture over the pixels of a smaller one: what any number of rays a pixel comes to.
fn blocks(exact: &[[f64; 4]], size: [u32; 2]) -> Vec<[f32; 4]> {
    let mut sums = vec![[0.0_f64; 5]; (size[0] * size[1]) as usize];
    for (i, pixel) in exact.iter().enumerate() {
        let (x, y) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
        let at = (y * size[1] / SIZE[1] * size[0] + x * size[0] / SIZE[0]) as usize;
        for c in 0..4 {
            sums[at][c] += pixel[c];
        }
        sums[at][4] += 1.0;
    }
    sums.iter().map(|s| [0, 1, 2, 3].map(|c| (s[c] / s[4]) as f32)).collect()
}

fn measure(name: &str, scene: &Scene) {
    let load = sysinfo::System::load_average().map_or(0.0, |load| load.one);
    let mut own = drawer(scene);
    own.draw(&Plan::of(scene, SIZE), Rung::Full, &mut ()).expect("it draws");
    let exact = wide(light(&mut own));
    println!("## {name}\n\nLoad average {load:.1}.\n\n| field | {} |", columns());
    println!("|---{}|", "|---".repeat(SHRINKS.len()));
    let against = |light: Vec<[f32; 4]>, size: [u32; 2]| {
        let shown = wide(enlarged(light, size, SIZE));
        Difference::between(&shown, &exact).expect("one size")
    };
    let cells = SHRINKS.map(|shrink| {
        let size = size_of(shrink);
        format!("{:.2}", accuracy::psnr_from_rmse(against(blocks(&exact, size), size).rmse))
    });
    println!("| means of the exact picture | {} |", cells.join(" | "));
    row("its own", scene, &mut own, SlabField::Own, &against);
    for (level, width) in [(0, 0.0), (1, 1.0), (1, 1.25), (2, 1.0), (3, 1.0)] {
        let title = match level {
            0 => "nearest tents".to_owned(),
            _ => format!("means of {}³, width × {width}", 1 << level),
        };
        let mut drawer = drawer(scene);
        let tents = SplatSettings { kernel: Kernel::Linear, ..scene.splat };
        let (field, ticket) = (SlabField::Preview, Ticket::new());
        let volume = scene.volume().expect("a field");
        let coefficients = means(volume, level, width);
        let set = drawer.engines.gpu().expect("a device").set_field(
            field,
            volume,
            &tents,
            coefficients,
            &ticket,
        );
        set.expect("it fits");
        row(&title, scene, &mut drawer, field, &against);
    }
    println!();
}

fn columns() -> String {
    SHRINKS.map(size_of).map(|[width, height]| format!("{width}×{height}")).join(" | ")
}

fn size_of(shrink: f64) -> [u32; 2] {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "of a picture")]
    let size = SIZE.map(|n| (f64::from(n) / shrink).round() as u32);
    size
}

/// A field's pictures of every size.
fn row(
    title: &str,
    scene: &Scene,
    drawer: &mut Drawer,
    field: SlabField,
    against: &impl Fn(Vec<[f32; 4]>, [u32; 2]) -> Difference,
) {
    let plan = Plan::of(scene, SIZE);
    let cells = SHRINKS.map(|shrink| {
        let mut least = f64::INFINITY;
        let mut size = SIZE;
        for _ in 0..RUNS {
            let rung = Rung::Reduced { field, shrink };
            let drawn = drawer.draw(&plan, rung, &mut ()).expect("it draws");
            (least, size) = (least.min(drawn.wall_ms), drawn.size);
        }
        let Difference { rmse, mean_brightness, .. } = against(light(drawer), size);
        let psnr = accuracy::psnr_from_rmse(rmse);
        format!("{psnr:.2}, {:+.2}, {least:.1}", mean_brightness * 255.0)
    });
    println!("| {title} | {} |", cells.join(" | "));
}

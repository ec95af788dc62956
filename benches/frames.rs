//! What pictures cost, and what they are worth: `cargo bench --bench frames`.
//!
//! For each scan: loading, the first coarse picture, coarse pictures at several budgets with their
//! PSNR to `full`, `full` itself, and the way to it over the ladder. Results go to
//! `benches/results/frames-<adapter>.json`, with the adapter's name and the active kernels beside
//! every time. Scans are those of `VOXSPLAT_DATA` (default `../shared/data`), and one made in code.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use voxsplat::accuracy;
use voxsplat::core::Ticket;
use voxsplat::core::enlarge::enlarged;
use voxsplat::gpu::{AdapterChoice, Context, Renderer, Wishes};
use voxsplat::io::{self, OpenOptions};
use voxsplat::plan::Plan;
use voxsplat::scene::{self, SampleSource, Scene};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engine::{Effort, Engine, FrameRequest, Ladder, Picture};
use voxsplat::volume::{Component, Grid, demo};

/// The window's viewport at 1280 × 800, and the size the issue asks `full` for.
const VIEWPORT: [u32; 2] = [944, 743];
const SQUARE: [u32; 2] = [512, 512];
const BUDGETS_MS: [f64; 5] = [8.0, 12.0, 20.0, 33.0, 60.0];
const RUNS: usize = 5;

fn main() {
    let data =
        std::env::var_os("VOXSPLAT_DATA").map_or(PathBuf::from("../shared/data"), PathBuf::from);
    let mut scenes = Vec::new();
    let mut skipped = 0;
    for file in
        ["scalar/aneurism.vti", "scalar/bonsai.vti", "scalar/tooth/tooth.nrrd", "scalar/LIDC2.vti"]
    {
        match open(&data.join(file)) {
            Ok(opened) => scenes.push((file.to_owned(), opened)),
            Err(reason) => {
                skipped += 1;
                eprintln!("skipped {file}: {reason}");
            }
        }
    }
    let start = Instant::now();
    let grid = demo::open("head", Some(128)).expect("a demo there is");
    scenes.push(("demo:head:128".to_owned(), (opening(&grid), start.elapsed())));

    let mut drawer = Drawer::new(Renderer::new(
        Context::new(&AdapterChoice::Auto, Wishes::default()).expect("an adapter"),
    ));
    let adapter = drawer.engines.gpu().expect("a device").context().adapter_name.clone();
    let results: Vec<Value> = scenes
        .iter()
        .map(|(name, (scene, load))| measure(&mut drawer, name, scene, *load))
        .collect();
    let report = json!({
        "adapter": adapter,
        "cores": std::thread::available_parallelism().map_or(0, usize::from),
        "skipped": skipped,
        "scenes": results,
    });
    let safe: String = adapter.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("benches/results/frames-{safe}.json"));
    std::fs::write(&path, serde_json::to_string_pretty(&report).expect("plain values") + "\n")
        .expect("the results folder can be written");
    println!("written: {}", path.display());
}

fn open(path: &Path) -> Result<(Scene, Duration), String> {
    let start = Instant::now();
    let opened =
        io::open(path, &OpenOptions::default(), &Ticket::new()).map_err(|e| e.to_string())?;
    let scene = opening(&opened.grid);
    Ok((scene, start.elapsed()))
}

fn opening(grid: &Grid) -> Scene {
    let field = grid.field(None).expect("every grid has a field");
    let component = Component::usual(field.components);
    let volume = grid.scalar(field, component, &Ticket::new()).expect("something finite");
    scene::opening(SampleSource::default(), Arc::new(volume), grid.space.as_deref())
}

fn ms(duration: Duration) -> f64 {
    (duration.as_secs_f64() * 1e4).round() / 10.0
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    (values[values.len() / 2] * 10.0).round() / 10.0
}

fn measure(drawer: &mut Drawer, name: &str, scene: &Scene, load: Duration) -> Value {
    let start = Instant::now();
    let plan = Plan::of(scene, VIEWPORT);
    drawer.prepare(&plan, &Ticket::new()).expect("it fits");
    let prepare = start.elapsed();
    drawer.draw(&plan, Rung::Coarse { budget_ms: 20.0 }, &mut ()).expect("it draws");
    let first_coarse = load + start.elapsed();
    let active = drawer.active_count().unwrap_or(0);

    let full = |drawer: &mut Drawer, plan: &Plan| {
        let times: Vec<f64> = (0..RUNS)
            .map(|_| drawer.draw(plan, Rung::Full, &mut ()).expect("it draws").wall_ms)
            .collect();
        median(times)
    };
    let square_ms = full(drawer, &Plan::of(scene, SQUARE));
    let viewport_ms = full(drawer, &plan);
    let truth = wide(drawer.engines.gpu().expect("a device").read_light().expect("it reads back"));

    let coarse: Vec<Value> = BUDGETS_MS
        .iter()
        .map(|&budget_ms| {
            let rung = Rung::Coarse { budget_ms };
            // The costs are learnt as the window learns them: picture by picture.
            let drawn: Vec<_> =
                (0..12).map(|_| drawer.draw(&plan, rung, &mut ()).expect("it draws")).collect();
            let last = &drawn[drawn.len() - 1];
            let light =
                drawer.engines.gpu().expect("a device").read_light().expect("it reads back");
            let picture = wide(enlarged(light, last.size, VIEWPORT));
            let psnr = accuracy::psnr(&picture, &truth).expect("equal sizes");
            json!({
                "budget_ms": budget_ms,
                "frame_ms": median(drawn[4..].iter().map(|d| d.wall_ms).collect()),
                "size": last.size,
                "nodes": last.nodes,
                "psnr_to_full_db": (psnr * 100.0).round() / 100.0,
            })
        })
        .collect();

    let (to_full_ms, at_once_ms) = ladder(scene);
    let row = json!({
        "name": name,
        "voxels": scene.lattice().len(),
        "active_kernels": active,
        "load_ms": ms(load),
        "prepare_ms": ms(prepare),
        "first_coarse_ms": ms(first_coarse),
        "full_512x512_ms": square_ms,
        "full_512x512_ms_per_million": (square_ms / active as f64 * 1e6).round(),
        "full_944x743_ms": viewport_ms,
        "coarse_944x743": coarse,
        "ladder_to_full_ms": to_full_ms,
        "full_at_once_ms": at_once_ms,
        "ladder_over_at_once": (to_full_ms / at_once_ms * 100.0).round() / 100.0,
        "peak_gpu_bytes": drawer.engines.gpu().expect("a device").peak_bytes(),
        "hierarchy_bytes": drawer.hierarchy_bytes(),
    });
    println!("{row:#}");
    row
}

fn wide(light: Vec<[f32; 4]>) -> Vec<[f64; 4]> {
    light.into_iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// Milliseconds from request to `full` through the engine, over the default ladder, and with
/// nothing before `full`.
fn ladder(scene: &Scene) -> (f64, f64) {
    let (sender, receiver) = mpsc::channel();
    let engine = Engine::start(AdapterChoice::Auto, move || sender.send(()).unwrap_or_default());
    let until_full = |ladder: Ladder, turned: f64| {
        // A camera of its own each time: nothing is left over from the last.
        let camera = scene.camera.orbited(turned, 0.0);
        let scene = Scene { camera, ..scene.clone() };
        let effort = Effort::Rest {
            budget_ms: 20.0,
            ladder,
            show_partial: false,
            converge_ms: 0.0,
            smooth_edges: false,
        };
        let start = Instant::now();
        engine.request(FrameRequest { scene, size: VIEWPORT, effort });
        loop {
            receiver.recv_timeout(Duration::from_secs(120)).expect("the engine answers");
            let full = |p: &Arc<Picture>| p.report.progress >= 1.0;
            if engine.take_picture().as_ref().is_some_and(full) {
                return start.elapsed().as_secs_f64() * 1e3;
            }
        }
    };
    // The first request prepares the volume.
    until_full(Ladder::AtOnce, 0.0);
    let runs = |ladder| median((0..RUNS).map(|i| until_full(ladder, 0.01 * i as f64)).collect());
    (runs(Ladder::Octree), runs(Ladder::AtOnce))
}

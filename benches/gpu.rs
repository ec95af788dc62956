//! What pictures cost on the graphics adapter that is there: `benches/gpu.sh`, which says how to run it elsewhere.
//!
//! Volumes made in code, at two sizes of picture: from samples to the first picture, exact pictures, quick ones of a
//! budget, in other modes and with effects, with vectors and with polygons. Of each the median of a few, turned by a degree
//! each, what bringing the picture back takes, and what its passes took by the device's clock. Writes Markdown, with the
//! adapter's name.
//!
//! Arguments: `--volumes 256,512,1024` (samples along an axis), `--pictures 1920x1080,3840x2160`, `--output FILE`,
//! `--only NAME` (rows that begin so).

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use voxsplat::core::{LinearRgb, Srgb8, Ticket};
use voxsplat::gpu::{AdapterChoice, Context, Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::polygons::{Paint, Shapes};
use voxsplat::scene::{
    self, AlongRay, Backend, Inside, Isosurface, PolygonLayer, SampleSource, Scene, ShadingPreset,
    SplatSettings, VectorLayer, Visibility, framing_camera,
};
use voxsplat::task::cuts::why_no_cut_of;
use voxsplat::task::draw::{DrawError, Drawer, Drawn, Rung};
use voxsplat::volume::{Component, Lattice, Samples, ScalarVolume, demo};

/// Pictures of each kind, after two that compile and upload.
const RUNS: usize = 7;
/// Fewer where they have taken so long, milliseconds.
const LONG_MS: f64 = 2000.0;
/// Of a quick picture, milliseconds.
const BUDGETS_MS: [f64; 2] = [8.0, 16.0];
/// Greatest errors of bricks that means stand for, of pictures drawn from cuts of a field.
const CUTS: [f32; 2] = [0.002, 0.016];

fn main() {
    let asked = Asked::of(std::env::args().skip(1));
    let context = Context::new(&AdapterChoice::Auto, Wishes::default()).expect("an adapter");
    let adapter = context.adapter_name.clone();
    let mut report = format!(
        "# Graphics adapter: {adapter}\n\nBy `benches/gpu.sh`. Milliseconds: the median of {RUNS} pictures, each turned by a \
         degree, from the request until the device is done; what encoding it and copying it to the host takes; then what each pass took by the device's clock, summed over its \
         pieces.\n"
    );
    let mut drawer = Drawer::new(Renderer::new(context));
    for &side in &asked.volumes {
        let volume = shells(side);
        for &size in &asked.pictures {
            let rows = rows(&mut drawer, &volume, size, &asked.only);
            let [width, height] = size;
            write!(report, "\n## {side}³ at {width} × {height}\n\n{rows}").expect("a string");
            println!("{side}³ at {width} × {height}\n{rows}");
        }
    }
    let peak = drawer.engines.made_gpu().map_or(0, Renderer::peak_bytes) >> 20;
    writeln!(report, "\nAt most {peak} MiB on the device.").expect("a string");
    let safe: String = adapter.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    let output = asked.output.unwrap_or_else(|| format!("benches/results/gpu-{safe}.md"));
    std::fs::write(&output, report).expect("the results can be written");
    println!("written: {output}");
}

/// What the command line asks for.
struct Asked {
    volumes: Vec<usize>,
    pictures: Vec<[u32; 2]>,
    output: Option<String>,
    only: String,
}

impl Asked {
    fn of(mut args: impl Iterator<Item = String>) -> Self {
        let (volumes, pictures) = (vec![256, 512, 1024], vec![[1920, 1080], [3840, 2160]]);
        let mut asked = Self { volumes, pictures, output: None, only: String::new() };
        while let Some(flag) = args.next() {
            let mut value = || args.next().expect("each flag has a value");
            let number = |text: &str| text.parse().expect("a number");
            match flag.as_str() {
                "--volumes" => {
                    asked.volumes = value().split(',').map(|n| number(n) as usize).collect();
                }
                "--pictures" => {
                    let size = |text: &str| {
                        let (width, height) = text.split_once('x').expect("WIDTHxHEIGHT");
                        [number(width), number(height)]
                    };
                    asked.pictures = value().split(',').map(size).collect();
                }
                "--output" => asked.output = Some(value()),
                "--only" => asked.only = value(),
                // Cargo's own.
                "--bench" => {}
                other => {
                    panic!("expected --volumes, --pictures, --output or --only, found {other}")
                }
            }
        }
        asked
    }
}

/// Shells of 8 bits; beyond what demos have, each sample several times.
fn shells(side: usize) -> Arc<ScalarVolume> {
    let made = side.min(*demo::SIZES.end());
    let grid = demo::open("shells", Some(made)).expect("a demo there is");
    let found = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new());
    let found = found.expect("finite values");
    let (low, high) = (found.statistics.min, found.statistics.max);
    let at = |i: usize| i * made / side;
    let code = |i: usize| {
        let [x, y, z] = [i % side, i / side % side, i / (side * side)].map(at);
        ((found.samples.get((z * made + y) * made + x) - low) / (high - low) * 255.0) as u8
    };
    let samples = Samples::UInt8((0..side.pow(3)).map(code).collect());
    let volume = ScalarVolume::from_samples("shells", Lattice::unit([side; 3]), samples);
    Arc::new(volume.expect("sound"))
}

/// What is drawn of a volume, plain first, and whether quick pictures are, too.
fn scenes(volume: &Arc<ScalarVolume>) -> Vec<(&'static str, Scene, bool)> {
    let plain = scene::opening(SampleSource::default(), Arc::clone(volume), None);
    let lit = Scene { shading: ShadingPreset::Lights.shading(volume), ..plain.clone() };
    let lattice = volume.lattice;
    let mut tubes = Shapes::default();
    let (middle, reach) = (lattice.centre(), 0.8 * lattice.bounding_radius());
    for turn in 0..24 {
        let at = |step: i32| {
            let (angle, height) = (f64::from(turn) + 0.1 * f64::from(step), f64::from(step));
            let around = DVec3::new(angle.cos(), angle.sin(), 0.0) * 0.5;
            let paint = Paint { colour: Srgb8([230, 180, 90]), number: 0.0 };
            (middle + reach * (around + DVec3::Z * (height / 100.0 - 0.5)), paint)
        };
        tubes.tube(&(0..100).map(at).collect::<Vec<_>>(), 0.01 * reach);
    }
    let mesh = PolygonLayer::new(Arc::new(tubes.mesh("tubes", "number").expect("triangles")));
    let polygons = plain.clone().with(mesh);
    let grid = demo::open("tornado", Some(64)).expect("a demo there is");
    let field = grid.fields.iter().find(|field| field.components == 3).expect("vectors");
    let winds = Arc::new(grid.vectors(field, &Ticket::new()).expect("vectors"));
    let mut vectors = Scene::seen_by(framing_camera(&grid.lattice, DVec3::Y, DVec3::Z));
    vectors = vectors.with(VectorLayer::new(winds));
    let in_mode = |splat: SplatSettings| Scene { splat, ..plain.clone() };
    let inside = |inside: Inside| Scene { inside, ..plain.clone() };
    let value = 0.5 * (volume.statistics.min + volume.statistics.max);
    let surface = Isosurface { value, opacity: 0.8, colour: None };
    let exact = SplatSettings::EXACT;
    let samples = SplatSettings::SHADE_FIRST;
    vec![
        ("plain", plain.clone(), true),
        ("lit", lit, true),
        ("with polygons", polygons, true),
        ("vectors of 64³", vectors, true),
        ("linear", in_mode(SplatSettings { kernel: Kernel::Linear, ..exact }), false),
        ("isosurface", inside(Inside { isosurfaces: vec![surface], ..Inside::default() }), false),
        ("maximum", inside(Inside { along: AlongRay::Maximum, ..Inside::default() }), false),
        (
            "samples in slabs",
            in_mode(SplatSettings {
                visibility: Visibility::Slabs,
                backend: Backend::Tiles,
                ..samples
            }),
            false,
        ),
        (
            "every sample, gathered",
            in_mode(SplatSettings { backend: Backend::Tiles, ..samples }),
            false,
        ),
        (
            "every sample, triangles",
            in_mode(SplatSettings { backend: Backend::Raster, ..samples }),
            false,
        ),
    ]
}

/// The table of a volume and a size of picture.
fn rows(drawer: &mut Drawer, volume: &Arc<ScalarVolume>, size: [u32; 2], only: &str) -> String {
    let mut rows = String::from("| picture | ms | brought back | passes |\n|---|---|---|---|\n");
    for (name, scene, quickly) in scenes(volume) {
        if !name.starts_with(only) {
            continue;
        }
        let budgets = if quickly { &BUDGETS_MS[..] } else { &[] };
        let quick = budgets.iter().map(|&budget_ms| Rung::Coarse { budget_ms });
        let has_cuts = quickly && why_no_cut_of(&scene).is_none();
        let cuts = has_cuts.then_some(CUTS).into_iter().flatten();
        let cuts = cuts.map(|max_error| Rung::Bricks { max_error });
        for rung in std::iter::once(Rung::Full).chain(quick).chain(cuts) {
            let row = match measure(drawer, &scene, size, rung) {
                Ok(row) => row,
                Err(error) => format!("| NAME, {} | – | – | {error} |\n", words(rung)),
            };
            eprint!("{}", row.replacen("NAME", name, 1));
            rows.push_str(&row.replacen("NAME", name, 1));
        }
    }
    rows
}

fn words(rung: Rung) -> String {
    match rung {
        Rung::Coarse { budget_ms } => format!("quick, {budget_ms} ms"),
        Rung::Bricks { max_error } => format!("bricks within {max_error}"),
        _ => "exact".to_owned(),
    }
}

fn measure(
    drawer: &mut Drawer,
    scene: &Scene,
    size: [u32; 2],
    rung: Rung,
) -> Result<String, DrawError> {
    let start = Instant::now();
    let plan_of = |turn: usize| {
        let camera = scene.camera.orbited((turn as f64).to_radians(), 0.0);
        Plan::of(&Scene { camera, ..scene.clone() }, size)
    };
    drawer.prepare(&plan_of(0), &Ticket::new())?;
    drawer.draw(&plan_of(0), rung, &mut ())?;
    let first_ms = start.elapsed().as_secs_f64() * 1e3;
    drawer.draw(&plan_of(1), rung, &mut ())?;
    let (mut times, mut back) = (Vec::new(), Vec::new());
    let mut drawn = Drawn::default();
    let began = Instant::now();
    for turn in 2..2 + RUNS {
        let start = Instant::now();
        drawn = drawer.draw(&plan_of(turn), rung, &mut ())?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
        let start = Instant::now();
        drawer.engines.gpu()?.present(Some(LinearRgb::default()))?;
        back.push(start.elapsed().as_secs_f64() * 1e3);
        if began.elapsed().as_secs_f64() * 1e3 > LONG_MS {
            break;
        }
    }
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let each: Vec<String> = times.iter().map(|ms| format!("{ms:.1}")).collect();
    eprint!("{} ", each.join(" "));
    let (drawn_ms, back_ms) = (median(&mut times), median(&mut back));
    drawer.engines.gpu()?.time_passes();
    drawer.draw(&plan_of(2 + RUNS), rung, &mut ())?;
    let passes: Vec<String> = drawer
        .engines
        .gpu()?
        .times()
        .iter()
        .map(|pass| format!("{} {:.2} in {}", pass.name, pass.gpu_ms, pass.runs))
        .collect();
    drawer.engines.gpu()?.stop_timing();
    let [width, height] = drawn.size;
    let what = match rung {
        Rung::Coarse { .. } => format!("{width} × {height}"),
        Rung::Bricks { .. } if let Some(cut) = drawn.cut => {
            format!("{:?} of each level", cut.bricks)
        }
        Rung::Bricks { .. } => "means not yet at hand: of the whole field".to_owned(),
        _ => format!("first {first_ms:.0} ms"),
    };
    let (kind, passes) = (words(rung), passes.join(", "));
    Ok(format!("| NAME, {kind} ({what}) | {drawn_ms:.2} | {back_ms:.2} | {passes} |\n"))
}

//! What octree cuts are worth beside subsampling: `cargo bench --bench octree [-- FILE…]`.
//!
//! For each scan, shaded first, every sample, at 1280 × 800 with the transfer function it opens with:
//! cuts of ten errors by each measure and each option, and every fourth and every second sample
//! (Westover). Prints Markdown: nodes, time, distance from `full` and from the exact picture, and how
//! much brighter the picture is than `full`. Times are processor time of all threads over two, which stays near
//! what a quiet machine with two cores takes; Linux only. Scans are those of `VOXSPLAT_DATA`
//! (default `../shared/data`), or the files named.
//!
//! `cargo bench --bench octree -- builders [FILE…]`: what building octrees takes on the host and on the device.
//! `FITTED=1 cargo bench --bench octree`: cuts as quick pictures fit them to a time, thinned and not, beside subsampling.
//! `HANDOVER=1 cargo bench --bench octree`: how much brighter cuts are than what follows them.

#[path = "support/builders.rs"]
mod builders;
#[path = "support/clock.rs"]
mod clock;
#[path = "support/fitted.rs"]
mod fitted;
#[path = "support/handover.rs"]
mod handover;
#[path = "support/scans.rs"]
mod scans;

use std::time::Instant;

use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::core::colour::srgb_from_linear;
use voxsplat::gpu::{AdapterChoice, Context, Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::scene::{CutSettings, ErrorMeasure, Scene, SplatSettings};
use voxsplat::task::draw::{Drawer, Rung};

use clock::processor_ms;
use scans::{Light, light, scans};

const SIZE: [u32; 2] = [1280, 800];
/// Cuts of an option, from so many nodes to every voxel.
const CUTS: u32 = 10;
const FEWEST_NODES: f64 = 500.0;
/// Every 4th sample along each axis, and every 2nd; the 1 of 4-2-1 is `full`.
const LEVELS: [usize; 2] = [2, 1];
/// Milliseconds at which curves are compared.
const TIMES_MS: [f64; 7] = [15.0, 30.0, 60.0, 125.0, 250.0, 500.0, 1000.0];
/// Each picture is drawn at least so often, and for so many milliseconds of processor time.
const LEAST_RUNS: usize = 3;
const LEAST_MS: f64 = 300.0;

/// A picture, what it cost and how far it is from others.
struct Row {
    name: String,
    nodes: u64,
    wall_ms: f64,
    processor_ms: f64,
    own_db: f64,
    exact_db: f64,
    /// How much brighter than `full`, 1/255, in linear light and as encoded.
    brighter: [f64; 2],
}

/// Named pictures of one kind, from the quickest.
type Curve = (String, Vec<Row>);

fn main() {
    if std::env::args().any(|argument| argument == "builders") {
        return builders::tables();
    }
    let context = Context::new(&AdapterChoice::Auto, Wishes::default()).expect("an adapter");
    let mut drawer = Drawer::new(Renderer::new(context));
    println!("{}\n", drawer.engines.gpu().expect("a device").context().adapter_name);
    if std::env::var_os("FITTED").is_some() {
        return fitted::tables(&mut drawer);
    }
    if std::env::var_os("HANDOVER").is_some() {
        return handover::tables(&mut drawer);
    }
    for (name, scene) in scans() {
        scan(&mut drawer, &name, &scene);
    }
}

fn options() -> Vec<(&'static str, CutSettings)> {
    let uniform = CutSettings::UNIFORM;
    let by = |measure| CutSettings { measure, ..uniform };
    let seen = |cut| CutSettings { view_dependent: true, ..cut };
    // Those of one measure together: the hierarchy is built again for each.
    vec![
        ("scalar", by(ErrorMeasure::Scalar)),
        ("classified", uniform),
        ("classified, by the view", seen(uniform)),
        ("classified, balanced", CutSettings { balanced: true, ..uniform }),
        ("optical depth", by(ErrorMeasure::OpticalDepth)),
        ("optical depth, by the view", seen(by(ErrorMeasure::OpticalDepth))),
    ]
}

fn scan(drawer: &mut Drawer, name: &str, base: &Scene) {
    let load = sysinfo::System::load_average().map_or(0.0, |load| load.one);
    let of = |splat: SplatSettings| Plan::of(&Scene { splat, ..base.clone() }, SIZE);
    let exact = of(SplatSettings { slabs_per_voxel: 2.0, ..SplatSettings::EXACT });
    let own = of(SplatSettings::SHADE_FIRST);
    drawer.prepare(&exact, &Ticket::new()).expect("it fits");
    drawer.draw(&exact, Rung::Full, &mut ()).expect("it draws");
    let exact = light(drawer);
    drawer.prepare(&own, &Ticket::new()).expect("it fits");
    drawer.draw(&own, Rung::Full, &mut ()).expect("it draws");
    let truths = [light(drawer), exact];
    let active = drawer.active_count().unwrap_or(0);
    println!("## {name}\n\n{active} active kernels, load {load:.1} at the start.\n");
    let full = measured(drawer, &own, Rung::Full, "full".to_owned(), &truths);
    let mut curves: Vec<Curve> = Vec::new();
    for (option, cut) in options() {
        let plan = of(SplatSettings { cut, ..SplatSettings::SHADE_FIRST });
        let start = Instant::now();
        drawer.prepare(&plan, &Ticket::new()).expect("it fits");
        eprintln!("{name}, {option}: prepared in {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
        let step = (active as f64 / FEWEST_NODES).ln() / f64::from(CUTS);
        let rows = (0..CUTS).map(|i| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "> 0")]
            let count = (FEWEST_NODES * (step * f64::from(i)).exp()) as u64;
            let max_error = drawer.error_for_count(count);
            measured(drawer, &plan, Rung::Octree { max_error }, format!("{max_error:.4}"), &truths)
        });
        curves.push((option.to_owned(), rows.collect()));
    }
    let subsampled = LEVELS.map(|level| {
        let name = format!("every {}th", 1 << level).replace("2th", "2nd");
        measured(drawer, &own, Rung::Subsampled { level }, name, &truths)
    });
    curves.push(("subsampling".to_owned(), subsampled.into_iter().chain([full]).collect()));
    let cheaper = [Kernel::Point, Kernel::Nearest].map(|kernel| {
        measured(drawer, &own, Rung::Cheaper(kernel), kernel.name().to_owned(), &truths)
    });
    curves.push(("cheaper kernels".to_owned(), cheaper.into()));
    tables(&curves);
}

/// Draws a rung several times, finding its cut each time as a moving view does.
fn measured(
    drawer: &mut Drawer,
    plan: &Plan,
    rung: Rung,
    name: String,
    [own, exact]: &[Light; 2],
) -> Row {
    let mut draw = || drawer.draw(plan, rung, &mut ()).expect("it draws");
    let nodes = draw().kernels;
    let (before, mut walls) = (processor_ms(), Vec::new());
    while walls.len() < LEAST_RUNS || processor_ms() - before < LEAST_MS {
        walls.push(draw().wall_ms);
    }
    let processor_ms = (processor_ms() - before) / walls.len() as f64 / 2.0;
    walls.sort_by(f64::total_cmp);
    let light = light(drawer);
    let against = |truth: &Light| Difference::between(&light, truth).expect("pictures of one size");
    let from_own = against(own);
    let encoded = |light: &Light| {
        let sum: f64 = light.iter().flat_map(|p| &p[..3]).map(|&c| srgb_from_linear(c)).sum();
        sum / (3 * light.len()) as f64
    };
    Row {
        name,
        nodes,
        wall_ms: walls[walls.len() / 2],
        processor_ms,
        own_db: from_own.psnr(),
        exact_db: against(exact).psnr(),
        brighter: [from_own.mean_brightness, encoded(&light) - encoded(own)].map(|b| b * 255.0),
    }
}

fn tables(curves: &[Curve]) {
    println!(
        "| | error | nodes | ms | wall ms, median | dB to full | dB to exact | brighter, linear | encoded |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, rows) in curves {
        for row in rows {
            println!(
                "| {name} | {} | {} | {:.0} | {:.0} | {} | {:.1} | {:+.2} | {:+.2} |",
                row.name,
                row.nodes,
                row.processor_ms,
                row.wall_ms,
                decibels(Some(row.own_db)),
                row.exact_db,
                row.brighter[0],
                row.brighter[1]
            );
        }
    }
    let Some((_, subsampled)) = curves.iter().find(|(name, _)| name == "subsampling") else {
        return;
    };
    let smooth: Vec<&Curve> = curves.iter().filter(|(name, _)| name != "cheaper kernels").collect();
    for (title, own) in [("dB to full", true), ("dB to exact", false)] {
        let mut times: Vec<(String, f64)> =
            TIMES_MS.iter().map(|ms| (format!("{ms:.0} ms"), *ms)).collect();
        for row in &subsampled[..LEVELS.len()] {
            times.push((format!("{} ({:.0} ms)", row.name, row.processor_ms), row.processor_ms));
        }
        let head: Vec<&str> = times.iter().map(|time| time.0.as_str()).collect();
        println!("\n{title} at equal time, interpolated along its logarithm:\n");
        println!("| | {} |", head.join(" | "));
        println!("|---{}|", "|---".repeat(times.len()));
        for (name, rows) in &smooth {
            let cells: Vec<String> =
                times.iter().map(|time| decibels(at(rows, time.1, own))).collect();
            println!("| {name} | {} |", cells.join(" | "));
        }
    }
    println!();
}

fn decibels(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(value) if value.is_finite() => format!("{value:.1}"),
        Some(_) => "∞".to_owned(),
    }
}

/// What a curve reaches at a time; `None` beyond its ends.
fn at(rows: &[Row], ms: f64, own: bool) -> Option<f64> {
    let mut points: Vec<(f64, f64)> = rows
        .iter()
        .map(|row| (row.processor_ms.ln(), if own { row.own_db } else { row.exact_db }))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let x = ms.ln();
    let pair = points.windows(2).find(|pair| (pair[0].0..=pair[1].0).contains(&x))?;
    let width = pair[1].0 - pair[0].0;
    let share = if width > 0.0 { (x - pair[0].0) / width } else { 0.0 };
    // `full` is no distance from itself: what is before it has a distance.
    let end = if pair[1].1.is_finite() { pair[1].1 } else { pair[0].1 };
    Some(pair[0].1 + (end - pair[0].1) * share)
}

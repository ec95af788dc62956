//! What cuts of a field are thought to cost beside what they do, and the choice among them beside the best one:
//! `cargo bench --bench cut_choice [-- --gpu] [FILE…]`, by the native engine or the GPU engine.
//!
//! Sizes are those that the engine's prices afford, which are learnt on the way; errors do not depend on how long a
//! picture took. What whole pictures of cuts take is the least of several. Prints Markdown. Without files, the scenes of
//! `benches/peers/vtk_previews.py`.

#[path = "support/peers.rs"]
mod peers;

use std::time::Instant;

use voxsplat::accuracy::{psnr_from_rmse, rmse};
use voxsplat::core::Ticket;
use voxsplat::gpu::Wishes;
use voxsplat::plan::Plan;
use voxsplat::scene::Scene;
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engines::{EngineChoice, Engines};

/// Of the native engine's pictures, and of those of the GPU engine on hardware.
const SIZES: [[u32; 2]; 2] = [[1280, 800], [3840, 2160]];
/// Milliseconds, likewise.
const BUDGETS_MS: [[f64; 3]; 2] = [[20.0, 33.0, 100.0], [2.0, 4.0, 8.0]];
/// Pictures of each cut, and seconds that they take at least: a card that slept needs work to come to its pace.
const RUNS: usize = 7;
const SECONDS: f64 = 0.4;
const ERRORS: [f32; 6] = [0.001, 0.002, 0.004, 0.008, 0.016, 0.032];

fn main() {
    println!(
        "| scene | whole, ms | bricks of each level: ms, thought / measured dB at full size, by their greatest error: {ERRORS:?} \
         |\n|---|---|---|"
    );
    let scenes = peers::scenes();
    let mut choices = String::new();
    for (name, scene) in &scenes {
        choices += &measure(name, scene);
    }
    println!(
        "\n| scene | budget, ms | fewer pixels, dB | chosen | its dB | thought | best | its dB |"
    );
    println!("|---|---|---|---|---|---|---|---|\n{choices}");
}

fn wide(light: Vec<[f32; 4]>) -> Vec<[f64; 4]> {
    light.into_iter().map(|pixel| pixel.map(f64::from)).collect()
}

fn measure(name: &str, scene: &Scene) -> String {
    let by_gpu = std::env::args().any(|arg| arg == "--gpu");
    let engine = if by_gpu { EngineChoice::Gpu } else { EngineChoice::Native };
    let engines = Engines::new(engine.into(), Wishes::default()).expect("an engine");
    let mut drawer = Drawer::with(engines);
    let plan = Plan::of(scene, SIZES[usize::from(by_gpu)]);
    drawer.prepare(&plan, &Ticket::new()).expect("it fits");
    let whole_ms = least_ms(&mut drawer, &plan, Rung::Full);
    let full = wide(drawer.engines.read_light().expect("a picture"));
    let mut rows = String::new();
    for budget_ms in BUDGETS_MS[usize::from(by_gpu)] {
        let tried = drawer.try_cuts(&plan, budget_ms, &full).expect("it draws");
        let db = |i: usize| tried.iter().map(move |t| psnr_from_rmse(t.rmse[i]));
        let words = |at: usize| {
            let of = &tried[at];
            let cut = of.max_error.map_or("whole".to_owned(), |error| error.to_string());
            format!("{:?} {cut}, {} × {}", of.field, of.size[0], of.size[1])
        };
        let by_db = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
        let best = db(1).enumerate().max_by(by_db).expect("some").0;
        let pixels = db(1).enumerate().filter(|(i, _)| tried[*i].max_error.is_none());
        let pixels = pixels.max_by(by_db).expect("some").1;
        let chosen = tried.iter().position(|t| t.is_chosen).expect("one of them");
        let [thought, measured] = tried[chosen].rmse.map(psnr_from_rmse);
        rows += &format!(
            "| {name} | {budget_ms} | {pixels:.1} | {} | {measured:.1} | {thought:.1} | {} | {:.1} |\n",
            words(chosen),
            words(best),
            psnr_from_rmse(tried[best].rmse[1])
        );
    }
    let cells = ERRORS.map(|max_error| {
        let rung = Rung::Bricks { max_error };
        let drawn = drawer.draw(&plan, rung, &mut ()).expect("it draws");
        let light = wide(drawer.engines.read_light().expect("a picture"));
        let found = rmse(&light, &full).expect("one size");
        let (thought, counts) = drawn.cut.map_or((0.0, [0; 3]), |cut| (cut.rmse, cut.bricks));
        let ms = least_ms(&mut drawer, &plan, rung);
        let [thought, found] = [thought, found].map(psnr_from_rmse);
        format!("{counts:?}: {ms:.2}, {thought:.1} / {found:.1}")
    });
    println!("| {name} | {whole_ms:.2} | {} |", cells.join("; "));
    rows
}

/// What a picture takes, the least of several.
fn least_ms(drawer: &mut Drawer, plan: &Plan, rung: Rung) -> f64 {
    let (start, mut least) = (Instant::now(), f64::INFINITY);
    let mut runs = 0;
    while runs < RUNS || start.elapsed().as_secs_f64() < SECONDS {
        least = least.min(drawer.draw(plan, rung, &mut ()).expect("it draws").wall_ms);
        runs += 1;
    }
    least
}

//! What cuts of a field are thought to cost beside what they do, and the choice among them beside the best one:
//! `cargo bench --bench cut_choice [-- FILE…]`.
//!
//! Sizes are those that the engine's prices afford, which are learnt on the way; errors do not depend on how long a
//! picture took. Prints Markdown. Without files, the scenes of `benches/peers/vtk_previews.py`.

#[path = "support/peers.rs"]
mod peers;

use voxsplat::accuracy::{psnr_from_rmse, rmse};
use voxsplat::core::Ticket;
use voxsplat::gpu::Wishes;
use voxsplat::plan::Plan;
use voxsplat::scene::Scene;
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engines::{EngineChoice, Engines};

const SIZE: [u32; 2] = [1280, 800];
const BUDGETS_MS: [f64; 3] = [20.0, 33.0, 100.0];
const ERRORS: [f32; 6] = [0.001, 0.002, 0.004, 0.008, 0.016, 0.032];

fn main() {
    println!(
        "| scene | thought / measured at full size, by the greatest error of bricks: {ERRORS:?} |\n|---|---|"
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
    let engines = Engines::new(EngineChoice::Native.into(), Wishes::default()).expect("native");
    let mut drawer = Drawer::with(engines);
    let plan = Plan::of(scene, SIZE);
    drawer.prepare(&plan, &Ticket::new()).expect("it fits");
    drawer.draw(&plan, Rung::Full, &mut ()).expect("it draws");
    let full = wide(drawer.engines.native.light().0);
    let mut rows = String::new();
    for budget_ms in BUDGETS_MS {
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
        let drawn = drawer.draw(&plan, Rung::Bricks { max_error }, &mut ()).expect("it draws");
        let found = rmse(&wide(drawer.engines.native.light().0), &full).expect("one size");
        let thought = drawn.cut.map_or(0.0, |cut| cut.rmse);
        format!("{:.1} / {:.1}", psnr_from_rmse(thought), psnr_from_rmse(found))
    });
    println!("| {name} | {} |", cells.join(", "));
    rows
}

//! How the real window answers the hand: `cargo bench --bench window -- [FILE…]` (Linux; Xvfb and
//! xdotool). Without files: three scans and three meshes of the data pack, written to
//! `benches/results/window.json`. With files: those, printed.
//!
//! For each: the first picture, dragging at the default frame budget, a press in the middle
//! of refinement, memory, and idling, from the window's own trace. The display is 1280 × 800, the
//! adapter a software one.

#[expect(dead_code, clippy::unwrap_used, reason = "shared with the end-to-end test")]
#[path = "../tests/desktop/mod.rs"]
mod desktop;

use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use desktop::{Display, Program};
use serde_json::{Value, json};
use voxsplat::app::trace::PassLine;

/// What it draws with: what a user has who chooses nothing.
const ENGINE: [&str; 2] = ["--engine", "auto"];
/// Moves of the mouse in a drag, one every 8 ms as a fast mouse sends them.
const MOVES: usize = 360;
/// What is measured where no file is named, below the data pack.
const FILES: [&str; 6] = [
    "scalar/aneurism.vti",
    "scalar/bonsai.vti",
    "scalar/tooth/tooth.nrrd",
    "unstructured/can.vtu",
    "unstructured/disk_out_ref.ex2",
    "unstructured/derived/bluntfin_tets.vtu",
];

fn main() {
    let data =
        std::env::var_os("VOXSPLAT_DATA").map_or(PathBuf::from("../shared/data"), PathBuf::from);
    let display = match Display::start() {
        Ok(display) => display,
        Err(reason) => return println!("skipped: {reason}"),
    };
    // Cargo adds `--bench`.
    let named: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let files = if named.is_empty() { FILES.map(str::to_owned).to_vec() } else { named.clone() };
    let mut rows = Vec::new();
    for file in files {
        let path = if named.is_empty() { data.join(&file) } else { PathBuf::from(&file) };
        if path.exists() {
            rows.push(measure(&display, &file, &path));
            println!("{:#}", rows[rows.len() - 1]);
        } else {
            println!("skipped {file}: not there");
        }
    }
    if !named.is_empty() {
        return;
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/results/window.json");
    let report = json!({
        "adapter": "software",
        // Part of every press-to-picture figure: xdotool is started for each.
        "xdotool_start_ms": xdotool_start_ms(&display),
        "display": [1280, 800],
        "scans": rows,
    });
    std::fs::write(&path, serde_json::to_string_pretty(&report).expect("plain values") + "\n")
        .expect("the results folder can be written");
}

fn now_ms() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64() * 1e3)
}

fn xdotool_start_ms(display: &Display) -> f64 {
    let mut times: Vec<f64> = (0..9)
        .map(|_| {
            let start = now_ms();
            display.hand(&["sleep", "0"]);
            now_ms() - start
        })
        .collect();
    times.sort_by(f64::total_cmp);
    tenth(times[4])
}

fn tenth(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

/// A drag along a wandering line; the pictures it made, and when it began.
fn drag(display: &Display, program: &Program, moves: usize) -> (f64, Vec<PassLine>) {
    let mut words = Vec::new();
    for i in 0..moves {
        let t = i as f64;
        let x = 400.0 + 200.0 * (t / 30.0).sin();
        let y = 400.0 + 60.0 * (t / 21.0).sin();
        words.extend(["mousemove".to_owned(), format!("{x:.0}"), format!("{y:.0}")]);
        words.extend(["sleep".to_owned(), "0.008".to_owned()]);
    }
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    display.hand(&["mousemove", "400", "400"]);
    sleep(Duration::from_millis(400));
    let first = program.passes().len();
    let pressed_ms = now_ms();
    let press_and_move = [&["mousedown", "1"], &words[..]].concat();
    display.hand(&press_and_move);
    display.hand(&["mouseup", "1"]);
    let passes = program.passes().split_off(first);
    let camera = passes.first().and_then(|p| p.camera);
    let moved = passes.into_iter().filter(|p| p.held && p.picture_is_new && p.camera != camera);
    (pressed_ms, moved.collect())
}

fn measure(display: &Display, name: &str, path: &Path) -> Value {
    let started_ms = now_ms();
    let mut program = Program::start(display, path.to_str().expect("a path in Unicode"), ENGINE);
    let first = program.wait("first picture", 0, |pass| pass.picture.is_some());
    let rested = program.wait_for_rest(0);
    let (pressed_ms, moved) = drag(display, &program, MOVES);
    let mut between: Vec<f64> = moved.windows(2).map(|w| w[1].at_ms - w[0].at_ms).collect();
    between.sort_by(f64::total_cmp);
    let at = |share: f64| tenth(between[((between.len() - 1) as f64 * share) as usize]);
    let mut sizes: Vec<[u32; 2]> =
        moved.iter().filter_map(|p| p.picture.as_ref()).map(|p| p.size).collect();
    sizes.sort_unstable();
    let span_ms = moved[moved.len() - 1].at_ms - moved[0].at_ms;
    // Let it begin to refine, then take hold of it again.
    sleep(Duration::from_millis(450));
    let (again_ms, again) = drag(display, &program, 40);
    let last = program.wait_for_rest(program.passes().len() - 1);
    let passes = program.passes().len();
    sleep(Duration::from_secs(5));
    let full = last.picture.as_ref().expect("a picture at rest");
    json!({
        "name": name,
        "active_kernels": full.kernels.map(|kernels| kernels.active),
        "start_to_first_picture_ms": tenth(first.at_ms - started_ms),
        "full_ms": tenth(rested.picture.as_ref().map_or(0.0, |p| p.frame_ms)),
        "drag_pictures": moved.len(),
        "drag_pictures_per_second": tenth((moved.len() - 1) as f64 / span_ms * 1e3),
        "between_pictures_ms": { "median": at(0.5), "95 %": at(0.95), "longest": at(1.0) },
        "median_picture_size": sizes.get(sizes.len() / 2),
        "last_picture_was": moved.last().and_then(|p| p.picture.as_ref()).map(|p| p.rung.clone()),
        "press_to_first_moved_picture_ms": tenth(moved[0].at_ms - pressed_ms),
        "press_while_refining_to_moved_picture_ms": again.first().map(|p| tenth(p.at_ms - again_ms)),
        "memory_at_rest_bytes": program.memory_bytes(),
        "passes_in_5_s_of_rest": program.passes().len() - passes,
    })
}

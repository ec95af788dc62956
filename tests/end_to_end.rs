//! The real program in a real window: opened, dragged, left alone, given a bad file, closed.
//!
//! Needs Xvfb and xdotool; without them it says that it was skipped.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod desktop;

use std::path::PathBuf;
use std::thread::sleep;
use std::time::Duration;

use desktop::{Display, Program, difference, rendered};
use voxsplat::app::trace::PassLine;

/// Side of the square in the lower left corner that the axes are painted in, pixels.
const AXES_SIDE: u32 = 112;
/// Least and most moves of the mouse in a drag, and the time between two.
const DRAG_STEPS: [usize; 2] = [60, 600];
const DRAG_EVERY: Duration = Duration::from_millis(16);
/// Views that a drag must have shown; a machine under load is given more moves for them.
const LEAST_VIEWS: usize = 6;
/// What the window allows a picture by default while it moves, milliseconds.
const BUDGET_MS: f64 = 25.0;

/// A small real scan where there is one, a demo else.
fn volume() -> String {
    let root = std::env::var_os("VOXSPLAT_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let tooth = root.join("scalar/tooth/tooth.nrrd");
    if tooth.exists() {
        return tooth.to_str().expect("a path in Unicode").to_owned();
    }
    println!("skipped scalar/tooth/tooth.nrrd in the window: not there, demo:head instead");
    "demo:head".to_owned()
}

/// Where the window says by what a picture is taken hold of, until it is: pixels from the bottom, and from the middle.
const HINT: [u32; 2] = [64, 160];

/// Fails unless the window shows in its viewport what `render` draws of the same camera, but for the axes and perhaps the
/// hint.
fn assert_equals_render(
    display: &Display,
    program: &Program,
    (file, has_hint): (&str, bool),
    pass: &PassLine,
) {
    let shown = display.shot(pass.viewport);
    let drawn = rendered(program, file, pass);
    let height = pass.viewport[3];
    let is_hint = |x: u32, y: u32| {
        has_hint && y + HINT[0] > height && x.abs_diff(pass.viewport[2] / 2) < HINT[1]
    };
    let is_free = |x: u32, y: u32| (x >= AXES_SIDE || y + AXES_SIDE < height) && !is_hint(x, y);
    let found = difference(&shown, &drawn, is_free);
    println!("window against render: {found:?}");
    if found.greatest > 1 {
        let kept = std::env::temp_dir().join("voxsplat-end-to-end");
        std::fs::create_dir_all(&kept).unwrap();
        shown.save(kept.join("window.png")).unwrap();
        drawn.save(kept.join("render.png")).unwrap();
        panic!("{found:?} of 255; pictures in {}", kept.display());
    }
    // An empty picture equals an empty picture.
    let seen = drawn.pixels().filter(|p| p.0.iter().any(|&c| c > 64)).count();
    assert!(seen > found.of / 100, "{seen} of {} pixels show anything", found.of);
}

/// How many views came with a picture while a button was held.
fn views(passes: &[PassLine]) -> usize {
    let mut cameras = Vec::new();
    for pass in passes.iter().filter(|pass| pass.held && pass.picture_is_new) {
        if !cameras.contains(&pass.camera) {
            cameras.push(pass.camera);
        }
    }
    cameras.len()
}

/// Prints how a drag went, for whoever measures.
fn print_drag(passes: &[PassLine]) {
    let pressed = passes.iter().find(|p| p.held).expect("a press");
    let moved: Vec<&PassLine> = passes
        .iter()
        .filter(|p| p.held && p.picture_is_new && p.camera != pressed.camera)
        .collect();
    let Some(first) = moved.first() else { return };
    let mut between: Vec<f64> = moved.windows(2).map(|w| w[1].at_ms - w[0].at_ms).collect();
    between.sort_by(f64::total_cmp);
    let at = |share: f64| between.get((between.len() as f64 * share) as usize);
    println!(
        "drag: {} pictures, press to first moved {:.0} ms, between two: median {:.1?} ms, 95 % \
         {:.1?} ms, longest {:.1?} ms",
        moved.len(),
        first.at_ms - pressed.at_ms,
        at(0.5),
        at(0.95),
        between.last(),
    );
}

#[test]
fn a_volume_is_coarse_while_dragged_exact_at_rest_idle_then_and_survives_a_bad_file() {
    // One after the other: two windows at a time would have a core each.
    for engine in [["--adapter", "software"], ["--engine", "native"]] {
        match Display::start() {
            Ok(display) => in_a_window(&display, engine),
            Err(reason) => println!("skipped the window end to end: {reason}"),
        }
    }
}

fn in_a_window(display: &Display, engine: [&'static str; 2]) {
    let file = volume();
    let mut program = Program::start(display, &file, engine);
    let opened = program.wait_for_rest(0);
    assert_eq!(opened.errors, [""; 0]);
    assert_equals_render(display, &program, (&file, true), &opened);

    // Taken hold of: the pictures follow, and are coarse.
    let before = display.shot(opened.viewport);
    let [left, top, width, height] = opened.viewport;
    let [x, y] = [left + width / 3, top + height / 3].map(|n| n.to_string());
    display.hand(&["mousemove", &x, &y]);
    let first = program.passes().len();
    display.hand(&["mousedown", "1"]);
    let mut differing = 0;
    for step in 0..DRAG_STEPS[1] {
        // Back and forth, so that it stays on the screen.
        let by = if step % 60 < 30 { "4" } else { "-4" };
        display.hand(&["mousemove_relative", "--", by, "1"]);
        sleep(DRAG_EVERY);
        if step % 20 == 19 {
            let now = display.shot(opened.viewport);
            differing += usize::from(difference(&now, &before, |_, _| true).greatest > 16);
        }
        if step + 1 >= DRAG_STEPS[0] && views(&program.passes()[first..]) >= LEAST_VIEWS {
            break;
        }
    }
    let passes = program.passes();
    let dragged = &passes[first..];
    print_drag(dragged);
    assert!(differing > 0, "the screen does not move with the hand");
    assert!(views(dragged) >= LEAST_VIEWS, "{} views", views(dragged));
    for pass in dragged.iter().filter(|pass| pass.held && pass.picture_is_new) {
        let picture = pass.picture.as_ref().expect("a new picture is one");
        let is_coarse = picture.kernels.is_some_and(|kernels| kernels.drawn < kernels.active)
            || picture.size != picture.requested_size;
        // A machine that can draw everything in time may.
        let may_be_exact = pass.camera == opened.camera || picture.frame_ms <= BUDGET_MS;
        assert!(is_coarse || may_be_exact, "slow while moving: {picture:?}");
    }

    // Let go: exact again, from where the hand has left it.
    let released = program.passes().len();
    display.hand(&["mouseup", "1"]);
    let rested = program.wait_for_rest(released);
    assert_ne!(rested.camera, opened.camera);
    let picture = rested.picture.clone().expect("a picture");
    match picture.kernels {
        Some(kernels) => assert_eq!(kernels.drawn, kernels.active, "{picture:?}"),
        // It needs no octree, which would have counted them.
        None => assert_eq!(engine, ["--engine", "native"]),
    }
    assert_equals_render(display, &program, (&file, false), &rested);
    let now = display.shot(rested.viewport);
    let found = difference(&now, &before, |_, _| true);
    assert!(found.pixels > found.of / 100, "the view has turned, and yet: {found:?}");

    // Left alone: nothing is drawn, by the engine or by the interface.
    let before = program.passes().len();
    sleep(Duration::from_secs(5));
    assert_eq!(program.passes().len() - before, 0, "passes in 5 s of rest");

    // What is held stays near what the file holds: three times its samples, and the program.
    let memory = program.memory_bytes();
    println!("memory at rest: {} MB", memory / 1_000_000);
    // Measured 327 MB with the software adapter, whose compiler keeps most of it, and 119 natively, in a debug build.
    let most = if engine == ["--engine", "native"] { 200_000_000 } else { 450_000_000 };
    assert!(memory < most, "{memory} bytes for a small scan");

    // A bad file: one sentence, and what was there stays.
    let bad = program.path("bad.nrrd");
    std::fs::write(&bad, "NRRD0004\ntype: float\ndimension: 3\nsizes: 9 9 9\nencoding: raw\n\n12")
        .unwrap();
    let window = ["search", "--sync", "--onlyvisible", "--name", "Voxsplat"];
    display.hand(&[&window[..], &["windowfocus", "--sync"]].concat());
    display.hand(&["key", "ctrl+l"]);
    sleep(Duration::from_millis(500));
    display.hand(&["type", "--delay", "30", bad.to_str().expect("a path in Unicode")]);
    display.hand(&["key", "Return"]);
    let refused = program.wait("error", before, |pass| !pass.errors.is_empty());
    println!("refused: {:?}", refused.errors);
    assert_eq!(refused.errors.len(), 1);
    assert!(refused.errors[0].starts_with("Expected "), "{:?}", refused.errors);
    let after = program.passes().len() - 1;
    let stayed = program.wait_for_rest(after);
    assert_eq!(stayed.camera, rested.camera);
    assert_eq!(stayed.picture.map(|p| p.rung), Some(picture.rung));

    display.hand(&["key", "ctrl+q"]);
    assert!(program.wait_for_end(), "it ends well");
}

/// A display, and the program at rest in a window on it.
fn at_rest() -> Result<(Display, Program), String> {
    let display = Display::start()?;
    let mut program = Program::start(&display, "demo:shells:24", ["--engine", "native"]);
    program.wait_for_rest(0);
    Ok((display, program))
}

#[test]
fn a_covered_window_draws_nothing_until_it_is_seen_again() {
    let (display, mut program) = match at_rest() {
        Ok(both) => both,
        Err(reason) => return println!("skipped a covered window: {reason}"),
    };
    let window = ["search", "--sync", "--onlyvisible", "--name", "Voxsplat"];
    display.hand(&[&window[..], &["windowfocus", "--sync"]].concat());
    // A key asks for a frame, whatever it does.
    let press = || {
        display.hand(&["key", "Shift_L"]);
        sleep(Duration::from_millis(700));
    };
    let open = program.passes().len();
    press();
    let before = program.passes().len();
    assert!(before > open, "a key asks for no frame");
    let cover = display.cover();
    sleep(Duration::from_millis(700));
    let covered = program.passes().len();
    press();
    press();
    assert_eq!(program.passes().len(), covered, "passes of a window that nobody sees");
    drop(cover);
    program.wait("pass once it is seen again", covered, |_| true);
}

/// By X's own words or by ours: what connection was lost, and no more than a line.
#[test]
fn a_window_whose_display_goes_away_ends_and_says_so() {
    let (display, mut program) = match at_rest() {
        Ok(both) => both,
        Err(reason) => return println!("skipped a display that goes away: {reason}"),
    };
    assert_eq!(program.said(), "");
    drop(display);
    assert!(!program.wait_for_end(), "it ends as if nothing had happened");
    let said = program.said();
    let tells = said.contains("connection") || said.contains("display");
    assert!(tells && said.trim().lines().count() == 1, "{said}");
}

/// No driver of Vulkan or OpenGL is found where they are said to be in no file.
#[test]
fn a_window_that_no_adapter_can_paint_ends_in_a_sentence_that_names_the_package() {
    let display = match Display::start() {
        Ok(display) => display,
        Err(reason) => return println!("skipped a window without a driver: {reason}"),
    };
    let none = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "__EGL_VENDOR_LIBRARY_FILENAMES"];
    let none = none.map(|name| (name, "/none"));
    let mut program = Program::start_in(&display, "demo:shells:8", ["--engine", "gpu"], &none);
    assert!(!program.wait_for_end(), "it ends as if there had been a window");
    let said = program.said();
    assert!(said.starts_with("voxsplat: expected a graphics driver"), "{said}");
    for part in [", found none", "mesa-vulkan-drivers", "--engine native"] {
        assert!(said.contains(part), "{said}");
    }
    assert_eq!(said.trim().lines().count(), 1, "{said}");
    // And the other engine has a window there.
    let native = ["--engine", "native"];
    let mut program = Program::start_in(&display, "demo:shells:8", native, &none);
    program.wait_for_rest(0);
    assert_eq!(program.said(), "");
}

mod must_fail {
    use super::difference;
    use image::{Rgb, RgbImage};

    #[test]
    fn a_pixel_two_levels_off_is_counted_unless_it_does_not_count() {
        let grey = RgbImage::from_pixel(4, 3, Rgb([9, 9, 9]));
        let mut other = grey.clone();
        other.put_pixel(2, 1, Rgb([9, 11, 9]));
        other.put_pixel(0, 0, Rgb([8, 9, 10]));
        let found = difference(&grey, &other, |_, _| true);
        assert_eq!((found.greatest, found.pixels, found.of), (2, 1, 12));
        let found = difference(&grey, &other, |x, _| x != 2);
        assert_eq!((found.greatest, found.pixels, found.of), (1, 0, 9));
    }
}

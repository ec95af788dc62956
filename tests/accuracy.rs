//! The price list, from the command line and step by step.

mod command_line;

use std::path::Path;
use std::process::Output;
use std::sync::Arc;

use serde_json::Value;
use voxsplat::accuracy::sweep::{Detail, Setting, front_of};
use voxsplat::accuracy::{Difference, psnr_from_rmse};
use voxsplat::core::Ticket;
use voxsplat::reference::Reference;
use voxsplat::scene::{Scene, SplatSettings, opening};
use voxsplat::task::engine::{AdapterChoice, Engine};
use voxsplat::task::still::{CONVERGED, Refine, StillRequest};
use voxsplat::task::sweep::{Step, Sweep, SweepError, SweepOptions, Truth, exact_truth};
use voxsplat::volume::{Component, demo};

use command_line::{errors, voxsplat};

fn can_draw() -> bool {
    command_line::can_draw("the price list")
}

fn shells(dims: usize) -> Scene {
    let grid = demo::open(&format!("shells:{dims}"), None).expect("a demo");
    let volume =
        grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).expect("a scalar");
    Scene { splat: SplatSettings::EXACT, ..opening(Default::default(), Arc::new(volume), None) }
}

/// One line on stderr with these words, and this exit code.
fn refused(output: &Output, code: i32, words: &[&str]) {
    let errors = errors(output);
    assert_eq!(output.status.code(), Some(code), "{errors}");
    assert!(output.stdout.is_empty() && errors.lines().count() == 1, "{errors}");
    assert!(errors.starts_with("voxsplat: "), "{errors}");
    assert!(words.iter().all(|word| errors.contains(word)), "{words:?}: {errors}");
}

#[test]
fn the_table_has_every_mode_with_its_price_and_the_front_is_right() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (table, plot) = (path("t.json"), path("p.png"));
    let run = voxsplat(&[
        "accuracy",
        "demo:shells:16",
        "--output",
        &table,
        "--plot",
        &plot,
        "--resolution",
        "40,32",
        "--pixels",
        "300",
        "--repeat",
        "1",
        "--camera-direction",
        "0.3,-0.5,0.8",
    ]);
    assert!(run.status.success(), "{}", errors(&run));
    let text = std::fs::read_to_string(&table).expect("a table");
    let table: Value = serde_json::from_str(&text).expect("JSON");
    the_head_is_complete(&table);
    // Quiet away from a terminal, but for a converged picture that is none.
    let converged = table["converged"]["is_reached"] == true;
    let notes = errors(&run);
    assert!(run.stdout.is_empty() && notes.lines().count() == usize::from(!converged), "{notes}");
    assert_eq!(notes.contains("did not converge up to --max-slabs 16"), !converged, "{notes}");
    let points = table["points"].as_array().expect("points");
    assert!(points.len() >= 40, "{}", points.len());
    let mut costs = Vec::new();
    for point in points {
        the_point_is_complete(point);
        let number = |key: &str| point[key].as_f64();
        costs.push(number("time_ms").zip(number("rmse")));
    }
    let undrawn = points.iter().filter(|point| point["failed"].is_string()).count();
    assert!(undrawn == 0, "{undrawn} modes were not drawn: {text}");
    let front = front_of(&costs);
    assert!(!front.is_empty());
    for (i, point) in points.iter().enumerate() {
        assert_eq!(point["on_front"], front.contains(&i), "{point}");
    }
    let names: Vec<&Value> = front.iter().map(|&i| &points[i]["name"]).collect();
    assert_eq!(table["front"].as_array().expect("a front").iter().collect::<Vec<_>>(), names);

    // More slabs are better, and shading first is worse than any of them.
    let psnr = |name: &str| {
        let point = points.iter().find(|p| p["name"] == name);
        point.and_then(|p| p["psnr_db"].as_f64()).unwrap_or_else(|| panic!("no {name}"))
    };
    let exact =
        |slabs: &str| psnr(&format!("slabs {slabs}, bspline interpolating, pre-integrated"));
    assert!(exact("1") > exact("½") && exact("4") > exact("1") + 6.0, "{text}");
    assert!(exact("1") > psnr("every sample, cubic") + 6.0, "{text}");
    let converged = table["converged"]["psnr_db"].as_f64().expect("converged");
    assert!(converged > exact("1"), "{converged}");

    let picture = image::open(&plot).expect("a PNG").into_rgb8();
    let ink = picture.pixels().filter(|p| p.0.iter().all(|c| *c < 100)).count();
    assert!(picture.width() > 800 && ink > 3000, "{ink} dark pixels: no text?");
}

fn the_head_is_complete(table: &Value) {
    assert!(table["adapter"].as_str().is_some_and(|a| !a.is_empty()));
    assert_eq!(table["resolution"], serde_json::json!([40, 32]));
    assert_eq!(table["scene"]["file"], "demo:shells:16");
    assert_eq!(table["scene"]["dims"], serde_json::json!([16, 16, 16]));
    let truth = &table["truth"];
    assert!(truth["stated_error"].as_f64().is_some_and(|e| (0.0..1e-5).contains(&e)), "{truth}");
    assert!(truth["pixels"].as_u64() >= Some(300) && truth["seed"] == 1, "{truth}");
    assert_eq!(truth["mode"]["classify"], "pre-integrated");
    let converged = &table["converged"];
    for key in ["slabs_per_voxel", "last_difference", "time_ms", "rmse", "psnr_db", "max"] {
        assert!(converged[key].is_number(), "{key} of {converged}");
    }
    let last = converged["last_difference"].as_f64().expect("a number");
    assert_eq!(converged["is_reached"], last < CONVERGED);
    assert!(table["converged_failed"].is_null());
}

fn the_point_is_complete(point: &Value) {
    assert!(point["name"].is_string() && point["settings"]["kernel"].is_string(), "{point}");
    assert!(point["on_front"].is_boolean(), "{point}");
    // Modes of one table may be drawn by two engines.
    assert!(["native", "gpu"].iter().any(|engine| point["engine"] == *engine), "{point}");
    let slabs = point["settings"]["visibility"] == "slabs";
    assert_eq!(point["slabs"].is_number(), slabs, "{point}");
    if point["failed"].is_string() {
        assert!(point["time_ms"].is_null() && point["on_front"] == false, "{point}");
        return;
    }
    for key in [
        "time_ms",
        "kernels",
        "rmse",
        "psnr_db",
        "max",
        "alpha_rmse",
        "alpha_max",
        "ssim",
        "flip",
        "whole_rmse",
        "whole_psnr_db",
        "whole_max",
        "whole_alpha_rmse",
        "whole_alpha_max",
    ] {
        assert!(point[key].is_number(), "{key} of {point}");
    }
    let number = |value: &Value| value.as_f64().expect("a number");
    assert_eq!(point["times_ms"].as_array().map(Vec::len), Some(2), "{point}");
    let rmse = number(&point["rmse"]);
    assert!((psnr_from_rmse(rmse) - number(&point["psnr_db"])).abs() < 1e-9, "{point}");
    for (key, value) in [("rmse_ci", rmse), ("psnr_ci_db", number(&point["psnr_db"]))] {
        let [low, high] = [0, 1].map(|end| number(&point[key][end]));
        assert!(low <= value && value <= high && low < high, "{key} of {point}");
    }
    assert!(number(&point["max"]) >= rmse && number(&point["time_ms"]) > 0.0, "{point}");
    assert!((-1.0..=1.0).contains(&number(&point["ssim"])), "{point}");
    assert!((0.0..=1.0).contains(&number(&point["flip"])), "{point}");
}

#[test]
fn a_table_of_nothing_says_so_and_has_no_decibels() {
    if !can_draw() {
        return;
    }
    let scene = ["accuracy", "demo:shells:8", "-o", "-", "--resolution", "12,11"];
    let run = voxsplat(&[&scene[..], &["--pixels", "20", "--opacity", "0:0,255:0"]].concat());
    assert!(run.status.success() && errors(&run).contains("nothing can be seen"), "{run:?}");
    let table: Value = serde_json::from_slice(&run.stdout).expect("JSON and nothing else");
    for point in table["points"].as_array().expect("points") {
        assert!(point["rmse"] == 0.0 && point["psnr_db"].is_null(), "{point}");
        // Equal errors do not tell how sure they are.
        assert!(point["rmse_ci"].is_null() && point["psnr_ci_db"].is_null(), "{point}");
    }
}

#[test]
fn wrong_usage_is_one_sentence_and_exit_2() {
    for more in [
        &["--pixels", "0"][..],
        &["--pixels", "many"],
        &["--repeat", "-1"],
        &["--max-slabs", "0"],
        &["--resolution", "64x64"],
        &["--no-background"],
        &["--budget-ms", "5"],
    ] {
        let run =
            voxsplat(&[&["accuracy", "demo:shells:8", "-o", "/nowhere/t.json"], more].concat());
        assert_eq!(run.status.code(), Some(2), "{more:?}: {}", errors(&run));
    }
    assert_eq!(voxsplat(&["accuracy", "demo:shells:8"]).status.code(), Some(2), "no output");
    for (more, words) in [
        (&["--plot", "p.svg"][..], &[".png", "p.svg"][..]),
        (&["--plot", "/nowhere/t.png", "-o", "/nowhere/t.png"], &["two files"]),
        (&["--max-slabs", "1000", "-o", "/nowhere/t"], &["--max-slabs", "1000"]),
        (
            &["--classify", "before", "--reconstruction", "interpolating", "-o", "/nowhere/t"],
            &["interpolating", "smooth"],
        ),
    ] {
        let output: &[&str] = if more.contains(&"-o") { &[] } else { &["-o", "/nowhere/t.json"] };
        let run = voxsplat(&[&["accuracy", "demo:shells:8"], more, output].concat());
        refused(&run, 2, words);
    }
    let run = voxsplat(&[
        "render",
        "demo:shells:8",
        "-o",
        "/nowhere/a.png",
        "--refine",
        "converged",
        "--visibility",
        "every-sample",
    ]);
    refused(&run, 2, &["--refine converged", "every-sample"]);
}

#[test]
fn places_that_cannot_be_written_to_are_found_before_the_work() {
    let folder = tempfile::tempdir().expect("a folder");
    let table = folder.path().join("t.json");
    let name = table.to_str().expect("UTF-8");
    let run = voxsplat(&["accuracy", "demo:shells:8", "-o", "/nowhere/t.json"]);
    refused(&run, 1, &["table", ": /nowhere/t.json"]);
    let run = voxsplat(&["accuracy", "demo:shells:8", "-o", name, "--plot", "/nowhere/p.png"]);
    refused(&run, 1, &["plot", ": /nowhere/p.png"]);
    let run = voxsplat(&["accuracy", "missing.nrrd", "-o", name]);
    refused(&run, 1, &["nothing of that name", "missing.nrrd"]);
    let run = voxsplat(&["accuracy", "demo:shells:8", "-o", name, "--adapter", "no such adapter"]);
    refused(&run, 1, &["no such adapter"]);
    assert!(!Path::new(name).exists(), "an empty table was left behind");
}

/// Ctrl-C while it works: nothing was there, and nothing is.
#[cfg(unix)]
#[test]
fn an_interrupted_sweep_leaves_no_file_behind() {
    use std::os::unix::process::ExitStatusExt;
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let [table, plot] = ["t.json", "p.png"].map(|name| folder.path().join(name));
    let [table, plot] = [&table, &plot].map(|path| path.to_str().expect("UTF-8"));
    let long = ["accuracy", "demo:head:64", "-o", table, "--plot", plot, "--pixels", "100000"];
    let mut child = command_line::program(&long)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(std::time::Duration::from_secs(3));
    assert!(child.try_wait().expect("a child").is_none(), "it is at work for minutes");
    let names = || std::fs::read_dir(folder.path()).expect("ours").count();
    assert_eq!(names(), 0, "something is there before there is something to write");
    // A shell may have started all this with Ctrl-C switched off: then the second one ends it.
    for signal in ["-INT", "-TERM"] {
        let id = child.id().to_string();
        let sent = std::process::Command::new("kill").args([signal, &id]).status().expect("kill");
        assert!(sent.success());
    }
    let output = child.wait_with_output().expect("it ends");
    assert!(matches!(output.status.signal(), Some(2 | 15)), "{}", errors(&output));
    assert_eq!(names(), 0, "a file was left behind");
}

fn engine() -> Engine {
    Engine::start(AdapterChoice::Auto, || ())
}

fn few(scene: &Scene) -> SweepOptions {
    let exact = SplatSettings { slabs_per_voxel: 0.5, ..SplatSettings::EXACT };
    let meaningless = SplatSettings { slabs_per_voxel: f64::NAN, ..exact };
    let setting =
        |name: &str, splat, detail| Setting { name: name.to_owned(), splat, detail, scale: 1.0 };
    SweepOptions {
        settings: vec![
            Setting::full(exact),
            setting("nothing", meaningless, Detail::Full),
            setting("cut", SplatSettings::SHADE_FIRST, Detail::Octree { max_error: 0.2 }),
        ],
        pixels: 100,
        repeat: 0,
        whole_picture: false,
        ..SweepOptions::new(scene)
    }
}

#[test]
fn a_sweep_stops_at_its_ticket_goes_on_where_it_was_and_records_what_cannot_be_drawn() {
    if !can_draw() {
        return;
    }
    let (scene, engine) = (shells(16), engine());
    let mut whole = Sweep::new(scene.clone(), [40, 32], few(&scene), exact_truth);
    let mut steps = 0;
    whole.run(&engine, &Ticket::new(), &mut |_| steps += 1).expect("to its end");
    assert_eq!(whole.next_step(), Step::Done);
    assert!(steps > whole.points().len(), "{steps}");
    let failure = whole.points()[1].outcome.as_ref().expect_err("no mode at all");
    assert!(failure.starts_with("expected --slabs-per-voxel"), "{failure}");
    assert!(!whole.front().contains(&1));

    let mut sweep = Sweep::new(scene.clone(), [40, 32], few(&scene), exact_truth);
    let cancelled = Ticket::new();
    cancelled.cancel();
    assert_eq!(sweep.step(&engine, &cancelled), Err(SweepError::Cancelled));
    assert_eq!(sweep.next_step(), Step::Truth);
    while sweep.next_step() != Step::Setting(1) {
        sweep.step(&engine, &Ticket::new()).expect("a step");
    }
    let found = sweep.points().to_vec();
    // In the middle of a step.
    let ticket = Ticket::new();
    let stopped = sweep.run(&engine, &ticket, &mut |sweep| {
        if sweep.next_step() == Step::Setting(2) {
            ticket.cancel();
        }
    });
    assert_eq!(stopped, Err(SweepError::Cancelled));
    assert_eq!(sweep.points()[..1], found[..]);
    assert_eq!(sweep.next_step(), Step::Setting(2));
    sweep.run(&engine, &Ticket::new(), &mut |_| ()).expect("to its end");
    assert!((sweep.fraction() - 1.0).abs() < 1e-6);
    // The same bits, but for the time.
    for (once, twice) in whole.points().iter().zip(sweep.points()) {
        let error = |point: &voxsplat::accuracy::sweep::Point| {
            point.outcome.as_ref().map(|found| found.sampled).map_err(String::clone)
        };
        assert_eq!(error(once), error(twice));
    }
}

/// Measured on llvmpipe (Mesa 22.3.6), 2026-11-21: full is off by at most 9.0e-2, converged
/// (at 32 slabs a voxel) by 4.3e-4, RMSE 2.8e-5.
#[test]
fn converged_is_not_full_and_nearer_to_the_reference() {
    if !can_draw() {
        return;
    }
    let (scene, engine, size) = (shells(24), engine(), [48, 40]);
    let still = |refine| {
        let request = StillRequest {
            scene: scene.clone(),
            size,
            refine,
            repeat: 0,
            time_passes: false,
            smooth_edges: false,
        };
        engine.still(request, &Ticket::new()).expect("a picture")
    };
    let light = |refine| -> Vec<[f64; 4]> {
        still(refine).light.iter().map(|pixel| pixel.map(f64::from)).collect()
    };
    let truth = Reference::exact(&scene, [48, 40]).expect("a mode").picture();
    let to_truth = |light: &[[f64; 4]]| Difference::between(light, &truth).expect("comparable");
    let full = to_truth(&light(Refine::Full));
    let found = still(Refine::Converged { most_slabs: 64.0 });
    let converged = to_truth(&light(Refine::Converged { most_slabs: 64.0 }));
    let convergence = found.convergence.expect("slabs were doubled");
    println!("measured: {convergence:?}, full {full:?}, converged {converged:?}");
    assert!(convergence.is_reached() && convergence.slabs_per_voxel >= 2.0, "{convergence:?}");
    assert!(converged.max_abs < 0.5 * full.max_abs, "{converged:?} {full:?}");
    assert!(converged.max_abs < CONVERGED, "{converged:?}");
    // One doubling fewer than there may be is no convergence, and says so.
    let short = still(Refine::Converged { most_slabs: 1.0 }).convergence.expect("slabs");
    assert_eq!((short.slabs_per_voxel, short.last_difference), (1.0, None));
    assert!(!short.is_reached());
    // A smaller picture is enlarged to the size that was asked for.
    let quarter = still(Refine::Reduced { detail: Detail::Full, scale: 0.25 });
    assert_eq!((quarter.drawn.size, quarter.size), ([12, 10], size));
    assert_eq!(quarter.light.len(), 48 * 40);
    assert!(!quarter.is_full);
}

/// A pixel is a point sample while kernels are as large as one, and the mean of 8 × 8 rays below.
#[test]
fn the_truth_of_a_volume_seen_from_afar_is_an_average() {
    let mut scene = shells(24);
    let size = [24_u32, 20];
    let at = size.map(|n| n as usize);
    let points = |scene: &Scene| Reference::exact(scene, at).expect("a mode with meaning");
    let light = |truth: &dyn Truth, x: u32, y: u32| truth.pixel([x, y]);
    scene.camera.parallel_scale *= 0.5;
    let near = exact_truth(&scene, size);
    assert_eq!(light(&*near, 9, 11), points(&scene).pixel([9, 11]));
    scene.camera.parallel_scale *= 4.0;
    let afar = exact_truth(&scene, size);
    let mean = Reference::supersampled(&scene, at, 8, true).expect("a mode with meaning");
    let found = light(&*afar, 11, 10);
    assert!(found[3] > 0.01, "{found:?}");
    assert_eq!(found, mean.pixel([11, 10]));
    assert_ne!(found, points(&scene).pixel([11, 10]));
}

//! Transfer functions and presets on the command line.

use std::path::Path;
use std::process::Output;

use crate::command_line::{errors, voxsplat};
use crate::{can_draw, fault};
use voxsplat::core::Srgb8;
use voxsplat::transfer::{
    ColourMap, ColourSource, Design, Gaussian, Region, RegionShape, TransferFunction,
};

fn render(volume: &str, more: &[&str]) -> Output {
    let size = ["render", volume, "-o", "-", "--resolution", "64,48"];
    voxsplat(&[&size[..], more].concat())
}

fn written(folder: &Path, text: &str) -> String {
    let path = folder.join("function.json");
    std::fs::write(&path, text).expect("a file");
    path.to_str().expect("UTF-8").to_owned()
}

#[test]
fn a_file_draws_what_the_flags_it_stands_for_draw_and_flags_change_it() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let colour = ColourSource::Map { map: ColourMap::Lapaz, range: [20.0, 230.5] };
    let opacity = vec![(40.0, 0.0), (100.25, 0.3), (100.25, 0.1), (255.0, 0.8)];
    let design = Design::from(TransferFunction::of(opacity, colour));
    let file = written(folder.path(), &design.to_text());
    let opacity = ["--opacity", "40:0,100.25:0.3,100.25:0.1,255:0.8"];
    let flags = ["--colormap", "lapaz", "--color-range", "20,230.5"];
    let by_flags = render("demo:shells:24", &[&opacity[..], &flags].concat());
    assert!(by_flags.status.success() && by_flags.stdout.len() > 300, "{}", errors(&by_flags));
    let by_file = render("demo:shells:24", &["--transfer", &file]);
    assert_eq!(errors(&by_file), "");
    assert!(by_file.stdout == by_flags.stdout, "the same picture");
    let changed = render("demo:shells:24", &["--transfer", &file, "--colormap", "gray"]);
    assert!(changed.status.success() && changed.stdout != by_file.stdout);

    let bells = vec![Gaussian { centre: 120.0, height: 0.6, width: 30.0 }];
    let stops = ColourSource::Stops(vec![(20.0, Srgb8([9, 8, 7])), (200.0, Srgb8::WHITE)]);
    let bells = Design::of_gaussians(bells, stops).expect("a design");
    let file = written(folder.path(), &bells.to_text());
    let drawn = render("demo:shells:24", &["--transfer", &file]);
    assert!(drawn.status.success() && drawn.stdout != by_file.stdout, "{}", errors(&drawn));
    // A map over the values of the stops, or over others.
    let of_stops = render("demo:shells:24", &["--transfer", &file, "--colormap", "vik"]);
    let same = ["--transfer", &file, "--colormap", "vik", "--color-range", "20,200"];
    assert!(of_stops.stdout == render("demo:shells:24", &same).stdout);
    let refused = render("demo:shells:24", &["--transfer", &file, "--color-range", "20,200"]);
    assert_eq!(fault(&refused, 1, &["with a colour map", "--colormap"], None), None);
}

/// Regions by gradient in a file draw; flags of opacity take their place, and modes and sweeps that
/// cannot draw them refuse.
#[test]
fn regions_of_a_file_are_drawn_or_refused() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let region = Region {
        shape: RegionShape::Rectangle,
        values: [60.0, 200.0],
        strengths: [0.0, 400.0],
        softness: 0.3,
        opacity: 0.6,
        colour: Some(Srgb8([255, 0, 0])),
    };
    let colour = ColourSource::Map { map: ColourMap::Lapaz, range: [20.0, 230.5] };
    let plain = Design::from(TransferFunction::of(vec![(40.0, 0.0), (255.0, 0.8)], colour));
    let design = Design { regions: vec![region], ..plain.clone() };
    let file = written(folder.path(), &design.to_text());
    let drawn = render("demo:shells:24", &["--transfer", &file]);
    assert!(drawn.status.success() && drawn.stdout.len() > 300, "{}", errors(&drawn));
    let by_value = render("demo:shells:24", &["--transfer", &file, "--opacity", "40:0,255:0.8"]);
    let plain = render(
        "demo:shells:24",
        &["--transfer", &{
            std::fs::write(folder.path().join("plain.json"), plain.to_text()).expect("a file");
            folder.path().join("plain.json").to_str().expect("UTF-8").to_owned()
        }],
    );
    assert!(by_value.stdout == plain.stdout && by_value.stdout != drawn.stdout);
    let first = render("demo:shells:24", &["--transfer", &file, "--classify", "before"]);
    assert!(first.status.success(), "{}", errors(&first));
    assert!(first.stdout.len() > 300 && first.stdout != drawn.stdout);
    let meshes = render("demo:shells:24", &["--transfer", &file, "--kernel", "gouraud"]);
    assert_eq!(fault(&meshes, 2, &["regions by gradient", "--kernel gouraud"], None), None);
    let table = folder.path().join("t.json");
    let table = table.to_str().expect("UTF-8");
    let small = ["--resolution", "32,24", "--pixels", "24", "--max-slabs", "32"];
    let sweep = ["accuracy", "demo:shells:16", "-o", table, "--transfer", &file];
    let sweep = voxsplat(&[&sweep[..], &small].concat());
    assert!(sweep.status.success(), "{}", errors(&sweep));
    let table = std::fs::read_to_string(table).expect("a table");
    let table: serde_json::Value = serde_json::from_str(&table).expect("JSON");
    assert_eq!(table["scene"]["regions"][0]["opacity"], 0.6);
    // Measured: 64.1 dB; triangles, which show no regions, come to 21.8, and that is told.
    let converged = table["converged"]["psnr_db"].as_f64().expect("it is drawn");
    assert!(converged > 60.0, "the truth has regions as the pictures have: {converged}");
    assert!(errors(&sweep).contains("show no regions"), "{}", errors(&sweep));
}

/// A strip of float32 with NaN in its middle.
#[test]
fn nan_has_an_opacity_and_a_colour_of_its_own() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("holed.raw");
    let values = (0..8 * 8 * 8).map(|i| if i % 8 < 4 { f32::NAN } else { 1.0 + (i % 3) as f32 });
    let bytes: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
    std::fs::write(&path, bytes).expect("a file");
    let raw = [
        "--raw-dims",
        "8,8,8",
        "--raw-type",
        "float32",
        "--raw-endian",
        "little",
        "--opacity",
        "0:0.3",
    ];
    let path = path.to_str().expect("UTF-8");
    let drawn = |more: &[&str]| render(path, &[&raw[..], more].concat());
    let left_out = drawn(&[]);
    assert_eq!(errors(&left_out), "");
    let seen = drawn(&["--nan-opacity", "0.5", "--nan-color", "00ff00"]);
    assert_eq!(errors(&seen), "");
    assert!(seen.stdout != left_out.stdout);
    let grey = drawn(&["--nan-opacity", "0.5"]);
    assert!(grey.status.success() && grey.stdout != seen.stdout, "{}", errors(&grey));
    let refused = drawn(&["--nan-color", "00ff00"]);
    assert_eq!(fault(&refused, 1, &["opacity of NaN", "--nan-opacity 1"], None), None);
    let beside = render("demo:shells:16", &["--nan-opacity", "0.5"]);
    assert!(beside.status.success() && errors(&beside).contains("nothing that is drawn is NaN"));
    let beside = render("demo:shells:16", &["--nan-color", "00ff00"]);
    assert!(beside.status.success() && errors(&beside).contains("nothing that is drawn is NaN"));
}

#[test]
fn files_that_are_no_transfer_functions_are_one_line_with_the_path_last() {
    let folder = tempfile::tempdir().expect("a folder");
    let header = "\"format\": \"voxsplat transfer function\", \"version\": 1";
    let colours = "\"colours\": {\"map\": \"gray\", \"range\": [0, 1]}";
    for (text, word) in [
        ("", "no text"),
        ("\u{1}\u{2}NRRD0004", "as JSON"),
        ("{}", "without \"format\""),
        ("{\"format\": \"voxsplat transfer function\", \"version\": 7}", "version 7"),
        (&format!("{{{header}, \"opacity\": [[1, 0.5], [0, 0.5]], {colours}}}"), "sorted"),
        (&format!("{{{header}, \"opacity\": [[0, NaN]], {colours}}}"), "as JSON"),
        (&format!("{{{header}, \"opacity\": [[0, 7]], {colours}}}"), "from 0 to 1"),
        (&format!("{{{header}, \"opacity\": 5, {colours}}}"), "invalid type"),
        (&"[".repeat(300_000), "what is none ([[["),
        (&" ".repeat(2 << 20), "1024 KiB"),
    ] {
        let file = written(folder.path(), text);
        let refused = render("demo:shells:8", &["--transfer", &file]);
        assert_eq!(fault(&refused, 1, &[word], Some(Path::new(&file))), None);
    }
    let none = folder.path().join("none.json");
    let refused = render("demo:shells:8", &["--transfer", none.to_str().expect("UTF-8")]);
    assert_eq!(fault(&refused, 1, &["transfer function"], Some(&none)), None);
    let refused = render("demo:shells:8", &["--transfer", "x.json", "--preset", "mr"]);
    assert_eq!(refused.status.code(), Some(2));
    let refused = render("demo:shells:8", &["--preset", "bone"]);
    assert!(refused.status.code() == Some(2) && errors(&refused).contains("ct-vessels"));
}

#[test]
fn presets_draw_and_say_where_they_go_by_percentiles() {
    if !can_draw() {
        return;
    }
    let mut pictures = Vec::new();
    for preset in ["default", "ct-bone", "ct-skin", "ct-vessels", "mr", "simulation"] {
        let drawn = render("demo:head:32", &["--preset", preset]);
        assert!(drawn.status.success() && errors(&drawn).is_empty(), "{}", errors(&drawn));
        assert!(!pictures.contains(&drawn.stdout), "{preset} looks like another");
        pictures.push(drawn.stdout);
    }
    assert!(pictures[0] == render("demo:head:32", &[]).stdout, "the default is the default");
    let note = errors(&render("demo:shells:24", &["--preset", "ct-bone"]));
    assert!(note.contains("no Hounsfield units") && note.lines().count() == 1, "{note}");
    assert_eq!(errors(&render("demo:shells:24", &["--preset", "simulation"])), "");
}

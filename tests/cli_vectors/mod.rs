//! Vectors on the command line: what is drawn, what is refused, and loops.

use std::fs;
use std::path::Path;

use super::{can_draw, fault};
use crate::command_line::{errors, voxsplat};

const DEMO: &str = "demo:tornado:12";

/// A picture by these flags, as bytes, and what was said.
fn drawn(folder: &Path, flags: &[&str]) -> (Vec<u8>, String) {
    let path = folder.join("picture.png");
    let mut all =
        vec!["render", DEMO, "--resolution", "48,36", "-o", path.to_str().expect("UTF-8")];
    all.extend(flags);
    let output = voxsplat(&all);
    assert!(output.status.success(), "{flags:?}: {}", errors(&output));
    (fs::read(&path).expect("a picture"), errors(&output))
}

#[test]
fn phases_count_in_cycles_and_components_may_be_fields_of_their_own() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let of = |flags: &[&str]| drawn(folder.path(), flags).0;
    let only = ["--vector", "velocity", "--vectors-only"];
    let at = |phase: &str| of(&[&only[..], &["--phase", phase]].concat());
    assert_eq!(at("0"), at("1"));
    assert_ne!(at("0"), at("0.5"));
    assert_ne!(at("0"), of(&[&only[..], &["--vector-mode", "blend"]].concat()));
    let beside = of(&["--vector", "velocity"]);
    assert!(beside != of(&[]) && beside != at("0"));
    let triple = ["--vector-components", "speed", "condensation", "speed", "--vectors-only"];
    assert_ne!(at("0"), of(&triple));
    let derived = |component: &str| of(&["--field", "velocity", "--component", component]);
    assert!(derived("vorticity") != derived("magnitude") && derived("0") != derived("magnitude"));
}

/// Lines in the middle of a ring that nothing is seen through, and beside nothing.
#[test]
fn lines_in_opaque_matter_are_told_to_be_hidden() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let said = |flags: &[&str]| {
        let path = folder.path().join("lines.png");
        let path = path.to_str().expect("UTF-8");
        let lines = ["--vector", "flow", "--streamlines", "9", "--no-vector-splats"];
        let all = ["render", "demo:mesh:4", "--resolution", "48,36", "-o", path];
        let output = voxsplat(&[&all[..], &lines, flags].concat());
        assert!(output.status.success(), "{flags:?}: {}", errors(&output));
        errors(&output)
    };
    let opaque = said(&["--opacity", "0:1"]);
    assert!(
        opaque.contains("lie in opaque matter") && opaque.contains("--vectors-only"),
        "{opaque}"
    );
    for flags in [&["--opacity", "0:0.0001"][..], &["--vectors-only"]] {
        assert!(!said(flags).contains("opaque matter"), "{flags:?}");
    }
}

/// The second of the tornado's fields is put together of its scalars.
#[test]
fn a_second_field_is_drawn_among_the_first_and_told_of() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let stats = folder.path().join("s.json");
    let of = |flags: &[&str]| drawn(folder.path(), flags).0;
    let one = ["--vector", "velocity", "--vectors-only"];
    let both =
        [&one[..], &["--second-vector-components", "speed", "condensation", "speed"]].concat();
    let told = [&both[..], &["--stats", stats.to_str().expect("UTF-8")]].concat();
    let (first, second) = (of(&one), of(&told));
    assert_ne!(first, second);
    assert_ne!(second, of(&[&both[..], &["--second-look", "mode=blend"]].concat()));
    // Without opacity it is not to be seen.
    assert_eq!(first, of(&[&both[..], &["--second-look", "opacity=0:0"]].concat()));
    let stats: serde_json::Value =
        serde_json::from_slice(&fs::read(stats).expect("statistics")).expect("JSON");
    assert_eq!(stats["effects"], serde_json::json!(["vectors", "second vectors"]));
    assert_eq!(stats["plan"]["kernels"].as_array().map(Vec::len), Some(2), "{}", stats["plan"]);
}

/// More than one dispatch could walk on a software adapter.
#[test]
fn many_vectors_over_a_tile_are_all_drawn() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("many.png");
    let output = voxsplat(&[
        "render",
        "demo:tornado:40",
        "--vector",
        "velocity",
        "--vectors-only",
        "--vector-coarser",
        "0",
        "--vector-extent",
        "8",
        "--vector-opacity",
        "0:0.01",
        "--resolution",
        "16,12",
        "-o",
        path.to_str().expect("UTF-8"),
    ]);
    let said = errors(&output);
    assert!(output.status.success(), "{said}");
    assert!(!said.contains("means of"), "{said}");
}

#[test]
fn vectors_among_triangles_are_wrong_usage_before_anything_is_opened() {
    for flags in [
        &["--vector", "v", "--backend", "raster"][..],
        &["--vector-components", "u", "v", "w", "--kernel", "gouraud"],
        &["--mesh", "m.stl", "--backend", "raster"],
        &["--streamlines", "9", "--backend", "raster"],
    ] {
        for command in ["render", "accuracy"] {
            let all = [&[command, "no such file.nrrd", "-o", "x.png"], flags].concat();
            let output = voxsplat(&all);
            let said = errors(&output);
            assert_eq!(output.status.code(), Some(2), "{all:?}: {said}");
            let found =
                if flags.contains(&"raster") { "--backend raster" } else { "--kernel gouraud" };
            assert!(said.contains(&format!("with {}, found {found}", flags[0])), "{said}");
        }
    }
}

/// Of a tornado whose middle stands still, the probe tells the vector beside the eye of the ray.
#[test]
fn probes_tell_vectors_and_meet_polygons() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = folder.path().join("wall.obj");
    fs::write(&mesh, "v -99 -99 0\nv 99 -99 0\nv 0 120 0\nf 1 2 3\n").expect("written");
    let mesh = mesh.to_str().expect("UTF-8");
    let probe = |flags: &[&str]| -> serde_json::Value {
        let up = ["--camera-direction", "0,0,-1", "--json"];
        let all =
            [&["probe", DEMO, "--at", "30,20", "--resolution", "48,36"], &up[..], flags].concat();
        let output = voxsplat(&all);
        assert!(output.status.success(), "{}", errors(&output));
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let opaque = ["--opacity", "0:0.9"];
    let plain = probe(&[&opaque[..], &["--vector", "velocity"]].concat());
    assert_eq!(plain["point"]["met"], "matter");
    assert_eq!(plain["point"]["vectors"][0]["field"], "velocity", "{plain}");
    let alone = probe(&["--vectors-only", "--vector-opacity", "0:0.9"]);
    assert_eq!(alone["point"]["met"], "vectors", "{alone}");
    assert!(alone["point"]["value"].is_null());
    let among = probe(&[&opaque[..], &["--mesh", mesh]].concat());
    assert_eq!(among["point"]["met"], "matter", "before the wall: {among}");
    assert!(among["point"]["vectors"].is_null());
    let clear = probe(&["--opacity", "0:0", "--mesh", mesh]);
    assert_eq!(clear["point"]["met"], "polygon", "{clear}");
    assert_eq!(clear["point"]["world"][2], 0.0);
}

#[test]
fn a_loop_is_one_gif_or_numbered_pictures() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str| {
        let path = folder.path().join(name);
        let output = voxsplat(&[
            "render",
            DEMO,
            "--vector",
            "velocity",
            "--vectors-only",
            "--resolution",
            "24,18",
            "--loop",
            "3",
            "-o",
            path.to_str().expect("UTF-8"),
        ]);
        assert!(output.status.success(), "{}", errors(&output));
        path
    };
    let gif = fs::read(write("wind.gif")).expect("a loop");
    assert!(gif.starts_with(b"GIF89a"));
    assert!(!write("wind.png").exists());
    let pictures: Vec<Vec<u8>> = (0..3)
        .map(|i| fs::read(folder.path().join(format!("wind-00{i}.png"))).expect("a picture"))
        .collect();
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
}

#[test]
fn what_cannot_be_meant_of_vectors_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("no.png");
    let out = path.to_str().expect("UTF-8");
    for (flags, code, words) in [
        (vec!["--vector", "nothing"], 1, vec!["nothing"]),
        (vec!["--vector", "speed"], 1, vec!["three components", "speed"]),
        (
            vec!["--field", "speed", "--component", "vorticity"],
            1,
            vec!["three components", "speed"],
        ),
        (vec!["--vector", "velocity", "--vector-stretch", "99"], 2, vec!["1 to 8", "99"]),
        (vec!["--vector-mode", "blend"], 2, vec!["--vector NAME", "--vector-mode"]),
        (vec!["--vector", "velocity", "--loop", "1"], 2, vec!["2 to 999", "found 1"]),
        (
            vec!["--vector", "velocity", "--vectors-only", "--clip-box", "0,5,0,5,0,5"],
            2,
            vec!["no clip where the field is not drawn"],
        ),
        (
            vec!["--vector", "velocity", "--projection", "maximum"],
            2,
            vec!["no projection with vectors"],
        ),
        (
            vec!["--vector", "velocity", "--refine", "coarse", "--max-error", "0.1"],
            2,
            vec!["--budget-ms", "--max-error"],
        ),
        (vec!["--vector-components", "speed", "velocity", "speed"], 1, vec!["velocity"]),
        (
            vec!["--vector", "velocity", "--loop-seconds", "2"],
            2,
            vec!["--loop with --loop-seconds"],
        ),
        (
            vec!["--vector", "velocity", "--loop", "4", "--loop-seconds", "2"],
            2,
            vec!["a GIF with --loop-seconds"],
        ),
        (
            vec!["--vector", "velocity", "--vector-marks", "ff0000"],
            2,
            vec!["--vector-mode blend with --vector-marks", "found modulate"],
        ),
        (
            vec!["--vector", "velocity", "--vector-color", "ff0000", "--vector-colormap", "gray"],
            2,
            vec!["--vector-color and --vector-colormap"],
        ),
        (
            vec!["--vector", "velocity", "--vectors-only", "--colormap", "gray"],
            2,
            vec!["no --colormap with vectors alone"],
        ),
        (
            vec!["--vector", "velocity", "--vectors-only", "--backend", "raster"],
            2,
            vec!["no --backend with vectors alone"],
        ),
        (
            vec!["--vector", "velocity", "--vectors-only", "--kernel", "cubic"],
            2,
            vec!["no --kernel with vectors alone"],
        ),
        (vec!["--second-vector", "velocity"], 2, vec!["--vector NAME with --second-vector"]),
        (
            vec!["--vector", "velocity", "--second-look", "mode=blend"],
            2,
            vec!["--second-vector NAME with --second-look"],
        ),
        (
            vec!["--vector", "velocity", "--second-vector", "speed"],
            1,
            vec!["three components", "speed"],
        ),
        (
            vec!["--vector", "velocity", "--streamline-seeds", "0,0,0"],
            2,
            vec!["--streamlines N with --streamline-seeds"],
        ),
    ] {
        let mut all = vec!["render", DEMO, "-o", out];
        all.extend(&flags);
        let output = voxsplat(&all);
        let found = fault(&output, code, &words, None);
        assert_eq!(found, None, "{flags:?}");
        assert!(!path.exists(), "{flags:?}");
    }
    // What is no value of its flag.
    for (flags, words) in [
        (["--vector-coarser", "9"], "expected a whole number from 0 to 8, found \"9\""),
        (["--vector-coarser", "-1"], "expected a whole number from 0 to 8, found \"-1\""),
        (["--seed", "-1"], "expected a whole number of at least 0, found \"-1\""),
        (["--arrows", "1,size=1e9"], "expected a size of arrows of at most 100, found \"1e9\""),
        (["--vector-color-range", "3,3"], "expected two different numbers LO,HI, found \"3,3\""),
        (["--second-look", "mode=x"], "expected one of modulate, blend, found \"x\""),
        (["--second-look", "modes=blend"], "or seed, found \"modes\""),
        (["--streamline-seeds", "1,2"], "expected one point X,Y,Z or two"),
    ] {
        let mut all = vec!["render", DEMO, "--vector", "velocity", "-o", out];
        all.extend(flags);
        let output = voxsplat(&all);
        assert_eq!(output.status.code(), Some(2), "{flags:?}");
        assert!(errors(&output).contains(words), "{flags:?}: {}", errors(&output));
    }
    let output = voxsplat(&["render", DEMO, "--vector", "velocity", "--loop", "4", "-o", "-"]);
    assert_eq!(fault(&output, 2, &["--loop", "standard output", ".gif"], None), None);
    let jpg = folder.path().join("no.jpg");
    let output = voxsplat(&[
        "render",
        DEMO,
        "--vector",
        "velocity",
        "--loop",
        "4",
        "-o",
        jpg.to_str().expect("UTF-8"),
    ]);
    assert_eq!(fault(&output, 2, &[".gif", ".png"], Some(&jpg)), None);
}

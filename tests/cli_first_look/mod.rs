//! What `render` draws where nobody says how: the first look.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::can_draw;
use crate::command_line::{errors, voxsplat};

const HEAD: &str = "demo:head:32";

/// A picture of a volume, with the statistics of it.
fn rendered(volume: &str, more: &[&str]) -> (Vec<u8>, Value) {
    let folder = tempfile::tempdir().expect("a folder");
    let stats = folder.path().join("stats.json");
    let stats = stats.to_str().expect("UTF-8");
    let fixed = ["render", volume, "-o", "-", "--resolution", "64,48", "--stats", stats];
    let output = voxsplat(&[&fixed[..], more].concat());
    assert!(output.status.success() && output.stdout.len() > 300, "{}", errors(&output));
    let text = std::fs::read_to_string(stats).expect("statistics");
    (output.stdout, serde_json::from_str(&text).expect("JSON"))
}

fn asked_for_lights(stats: &Value) -> Option<&str> {
    let rows = stats["effect_rows"].as_array().expect("rows");
    let row = rows.iter().find(|row| row["name"] == "lights" && row["runs"] == true)?;
    row["asked_by"].as_str()
}

/// It was replaced without a word.
#[test]
fn an_up_along_the_view_is_said_to_be_none() {
    if !can_draw() {
        return;
    }
    let of = |up: &str| {
        let fixed = ["render", "demo:blobs:8", "-o", "-", "--resolution", "16,16"];
        let view = ["--camera-direction", "0,0,1", "--camera-view-up", up];
        errors(&voxsplat(&[&fixed[..], &view].concat()))
    };
    let told = of("0,0,-2");
    assert!(
        told.contains("--camera-view-up 0,0,-2 is parallel to the direction of the view"),
        "{told}"
    );
    assert_eq!(of("0,1,1"), "");
}

/// It was tilted as the first view is.
#[test]
fn the_axis_that_is_up_is_up_along_any_direction() {
    if !can_draw() {
        return;
    }
    let of = |more: &[&str]| rendered(HEAD, &[&["--camera-direction", "0,1,0"], more].concat()).0;
    let upright = of(&["--camera-view-up", "0,0,1"]);
    assert!(of(&[]) == upright, "z is up where nobody says otherwise");
    assert!(of(&["--camera-up-axis", "-x"]) == of(&["--camera-view-up", "-1,0,0"]));
    assert!(of(&["--camera-up-axis", "-x"]) != upright);
}

#[test]
fn a_first_look_lights_faces_and_any_word_about_light_or_opacity_puts_it_out() {
    if !can_draw() {
        return;
    }
    let (lit, stats) = rendered(HEAD, &[]);
    assert_eq!(asked_for_lights(&stats), Some("first look"));
    let (unlit, stats) = rendered(HEAD, &["--shading", "none"]);
    assert_eq!(asked_for_lights(&stats), None);
    assert!(lit != unlit, "light changes the picture");
    for flags in [
        &["--opacity", "0:0,1200:0.5"][..],
        &["--color", "0:000000,1200:ffffff"],
        &["--modulation", "value:0:1,100:1"],
        &["--refine", "coarse", "--max-error", "0.2", "--cut-balanced"],
        &["--visibility", "every-sample", "--backend", "raster"],
    ] {
        assert_eq!(asked_for_lights(&rendered(HEAD, flags).1), None, "{flags:?}");
    }
    // Other colours of the same look, and looks with a name, keep it.
    for flags in [&["--colormap", "gray"][..], &["--preset", "ct-bone"], &["--kernel", "linear"]] {
        let (_, stats) = rendered(HEAD, flags);
        assert_eq!(asked_for_lights(&stats), Some("first look"), "{flags:?}");
    }
    let (_, stats) = rendered(HEAD, &["--shading", "lights"]);
    assert_eq!(asked_for_lights(&stats), Some("1 light"));
    assert_eq!(asked_for_lights(&rendered("demo:blobs:32", &[]).1), None, "a cloud is not lit");
}

#[test]
fn projections_of_scans_are_grey_unless_colours_are_chosen() {
    if !can_draw() {
        return;
    }
    let is_grey = |volume: &str, more: &[&str]| {
        let (png, _) = rendered(volume, &[&["--projection", "maximum"], more].concat());
        let picture = image::load_from_memory(&png).expect("a PNG").into_rgb8();
        let mut lit = picture.pixels().filter(|pixel| pixel.0.iter().any(|&part| part > 60));
        assert!(lit.next().is_some(), "something is seen");
        lit.all(|pixel| pixel.0.iter().max() == pixel.0.iter().min())
    };
    assert!(is_grey(HEAD, &[]));
    assert!(!is_grey(HEAD, &["--colormap", "inferno"]) && !is_grey(HEAD, &["--preset", "ct-bone"]));
    assert!(!is_grey("demo:blobs:16", &[]), "a simulation keeps its colours");
}

/// The colours of the transfer function, up to soft tissue, made a white blob of it.
#[test]
fn the_greatest_values_of_a_head_are_told_apart_in_a_range_of_their_own() {
    if !can_draw() {
        return;
    }
    let levels = |more: &[&str]| {
        let (png, _) = rendered(HEAD, &[&["--projection", "maximum"], more].concat());
        let picture = image::load_from_memory(&png).expect("a PNG").into_luma8();
        let seen: Vec<u8> = picture.pixels().map(|p| p.0[0]).filter(|&level| level > 8).collect();
        let white = seen.iter().filter(|&&level| level > 250).count();
        (white as f64 / seen.len() as f64, seen.iter().collect::<BTreeSet<_>>().len())
    };
    let (white, different) = levels(&[]);
    assert!(white < 0.1 && different > 60, "{white} {different}");
    let (blown, _) = levels(&["--color-range", "0,100"]);
    assert!(blown > 0.5, "what was seen before is found: {blown}");
}

#[test]
fn names_are_drawn_by_the_nearest_of_them_unless_a_mode_is_asked_for() {
    if !can_draw() {
        return;
    }
    let kernel = |more: &[&str]| {
        let (_, stats) = rendered("demo:checkerboard:16", more);
        stats["mode"]["kernel"].as_str().map(str::to_owned)
    };
    assert_eq!(kernel(&[]).as_deref(), Some("nearest"));
    assert_eq!(kernel(&["--opacity-unit-distance", "0.5"]).as_deref(), Some("nearest"));
    assert_eq!(kernel(&["--kernel", "linear"]).as_deref(), Some("linear"));
    let (_, stats) = rendered(HEAD, &[]);
    assert_eq!(stats["mode"]["kernel"], "bspline");
}

#[test]
fn the_tornado_is_seen_flowing_unless_its_values_are_asked_for() {
    if !can_draw() {
        return;
    }
    let effects = |more: &[&str]| rendered("demo:tornado:12", more).1["effects"].clone();
    assert_eq!(effects(&[]), serde_json::json!(["vectors"]));
    for flags in [
        &["--field", "condensation"][..],
        &["--opacity", "0.2:0,1:0.5"],
        &["--shading", "none"],
        &["--projection", "maximum"],
    ] {
        let effects = effects(flags);
        assert!(
            !effects.as_array().expect("a list").contains(&"vectors".into()),
            "{flags:?}: {effects}"
        );
    }
}

//! Finding commands and settings by name.

use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use voxsplat::app::panels::marked_row;
use voxsplat::app::panels::places::PLACES;
use voxsplat::app::settings::Settings;
use voxsplat::scene::AlongRay;

use crate::ui_support::Bench;

/// Asks for words, and takes what comes first, moved on by so many rows.
fn find(bench: &mut Bench, words: &str, rows: usize) {
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::F);
    bench.harness.run_steps(3);
    bench.harness.event(Event::Text(words.to_owned()));
    bench.harness.run_steps(3);
    for _ in 0..rows {
        bench.harness.key_press(Key::ArrowDown);
        bench.harness.run_steps(2);
    }
    bench.harness.key_press(Key::Enter);
    bench.harness.run_steps(4);
}

#[test]
fn commands_are_found_by_their_name_and_by_what_other_programs_call_them() {
    let mut bench = Bench::opened();
    let has_box = |bench: &Bench| bench.window().scene().unwrap().inside.clip.bounds.is_some();
    assert!(!has_box(&bench));
    find(&mut bench, "crop", 0);
    assert!(has_box(&bench) && !bench.shows("What is looked for"));
    find(&mut bench, "clip", 1);
    assert_eq!(bench.window().scene().unwrap().inside.clip.planes.len(), 1, "the second one");
    find(&mut bench, "isosurf", 0);
    assert_eq!(bench.window().scene().unwrap().inside.isosurfaces.len(), 1);
    // A command that asks for more.
    find(&mut bench, "open path", 0);
    assert!(bench.shows("A file, or demo:NAME"));
    bench.harness.key_press(Key::Escape);
    bench.harness.run_steps(3);
    let lights = |bench: &Bench| {
        let lighting = bench.window().scene().unwrap().shading.lighting.clone();
        lighting.map_or(0, |lighting| lighting.lights.len())
    };
    let before = lights(&bench);
    find(&mut bench, "light", 1);
    assert_eq!(lights(&bench), before + 1);
}

#[test]
fn what_is_not_there_or_can_do_nothing_is_not_taken() {
    let mut bench = Bench::opened();
    find(&mut bench, "streamlines", 0);
    assert!(bench.tells("Streamlines follow vectors, and this file has none"));
    assert!(bench.shows("What is looked for"), "it stays open");
    bench.harness.key_press(Key::Escape);
    bench.harness.run_steps(3);
    find(&mut bench, "xyzzy", 0);
    assert!(bench.tells("Nothing is called that"));
    bench.harness.key_press(Key::Escape);
    bench.harness.run_steps(3);
    assert!(!bench.shows("What is looked for"));
}

#[test]
fn a_setting_that_is_found_opens_its_section() {
    let settings: Settings = serde_json::from_str(r#"{"side_panel": false}"#).expect("settings");
    let mut bench = Bench::with_settings(settings);
    bench.open("good.nrrd");
    bench.settle();
    assert!(!bench.shows("Reconstruction"));
    find(&mut bench, "slabs per", 0);
    assert!(bench.window().settings().side_panel && bench.shows("Reconstruction"));
}

#[test]
fn a_row_that_is_found_comes_into_sight_even_above_all_sections() {
    let mut bench = Bench::opened();
    let at = |bench: &Bench| {
        bench.harness.get_by_role_and_label(Role::ComboBox, "Rendering").rect().center().y
    };
    let before = at(&bench);
    find(&mut bench, "background", 0);
    bench.settle();
    assert!(at(&bench) < before - 20.0, "scrolled away: {} after {before}", at(&bench));
    find(&mut bench, "rendering", 0);
    bench.settle();
    assert!((at(&bench) - before).abs() < 20.0, "{} for {before}", at(&bench));
    // The command of that name does it at once.
    find(&mut bench, "mip", 0);
    let along = |bench: &Bench| bench.window().scene().unwrap().inside.along;
    assert_eq!(along(&bench), AlongRay::Maximum);
    find(&mut bench, "splat", 0);
    assert!(!bench.shows("About Voxsplat") && bench.shows("Reconstruction"), "the section first");
}

/// Rows are marked whatever they are: with a picture of what they mean, a switch, or a slider.
#[test]
fn a_row_that_is_found_is_marked() {
    let mut bench = Bench::opened();
    for name in ["Extent", "Smooth edges at rest", "Frame budget", "Coloured faces"] {
        find(&mut bench, name, 0);
        assert_eq!(marked_row(&bench.harness.ctx), Some(name));
    }
}

/// What opens a dialog where it stands opens it from here.
#[test]
fn saving_a_loop_is_found_and_asks_where_to() {
    let mut bench = Bench::with_settings(Settings::default());
    bench.open("triples.nrrd");
    bench.settle();
    bench.choose("Vectors", "wind");
    bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.vectors().is_empty()));
    find(&mut bench, "save loop", 0);
    assert!(bench.shows("Cycle"));
}

#[test]
fn no_step_is_taken_back_behind_a_dialog_and_enter_closes_a_sheet() {
    let mut bench = Bench::opened();
    find(&mut bench, "isosurf", 0);
    let count = |bench: &Bench| bench.window().scene().unwrap().inside.isosurfaces.len();
    find(&mut bench, "about", 0);
    assert!(bench.shows("Licence"));
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.harness.run_steps(3);
    assert_eq!(count(&bench), 1);
    bench.harness.key_press(Key::Enter);
    bench.harness.run_steps(3);
    assert!(!bench.shows("Licence"));
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.harness.run_steps(3);
    assert_eq!(count(&bench), 0);
}

#[test]
fn every_setting_that_can_be_found_is_where_it_is_said_to_be() {
    let open =
        r#"{"sections": {"Splats": true, "Polygons and labels": true, "Basis functions": true}}"#;
    let mut bench = Bench::with_settings(serde_json::from_str(open).expect("settings"));
    bench.open("triples.nrrd");
    bench.settle();
    bench.choose("Vectors", "wind");
    bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.vectors().is_empty()));
    bench.settle();
    let missing: Vec<_> = PLACES.iter().filter(|place| !bench.shows(place.name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
    // Names that several have are told apart by their section.
    for (i, place) in PLACES.iter().enumerate() {
        let is_same = |(name, section)| (name, section) == (place.name, place.section);
        let mut later = PLACES[i + 1..].iter().map(|other| (other.name, other.section));
        assert!(!later.any(is_same), "{place:?}");
    }
    assert!(bench.harness.query_all_by_label("Find…").next().is_some());
}

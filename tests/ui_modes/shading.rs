//! Lights and shading tables in the side panel, and the panel of effects.

use std::sync::atomic::Ordering;

use eframe::egui::accesskit::{Role, Toggled};
use eframe::egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use voxsplat::scene::{
    Attached, Backend, Index, Lighting, MOST_LIGHTS, Shading, ShadingPreset, SplatSettings,
};
use voxsplat::task::engine::Effort;

use super::press;
use crate::ui_support::Bench;

/// What the engine is asked to draw.
fn shading(bench: &Bench) -> Shading {
    let scene = bench.window().scene().expect("something is open");
    assert_eq!(bench.last_request().scene.shading, scene.shading, "what is chosen is asked for");
    assert!(scene.shading.check(&SplatSettings::EXACT).is_ok(), "{:?}", scene.shading);
    scene.shading.clone()
}

/// Ticks or unticks a part.
fn tick(bench: &mut Bench, part: &str) {
    bench.harness.get_by_role_and_label(Role::CheckBox, part).click();
    bench.settle();
}

fn is_ticked(bench: &Bench, part: &str) -> bool {
    let node = bench.harness.get_by_role_and_label(Role::CheckBox, part);
    node.accesskit_node().toggled() == Some(Toggled::True)
}

const PARTS: [&str; 5] = ["Lights", "Opacity", "Opacity factor", "Reflection", "Emission"];

#[test]
fn presets_are_chosen_told_and_taken_back() {
    let mut bench = Bench::opened();
    assert!(shading(&bench).is_plain());
    let volume = bench.window().scene().unwrap().volume().unwrap().clone();
    for (name, preset) in [
        ("Lights", ShadingPreset::Lights),
        ("Cloud", ShadingPreset::Cloud),
        ("Surface", ShadingPreset::Surface),
        ("Depth cue", ShadingPreset::DepthCue),
        ("Colour by gradient", ShadingPreset::GradientColour),
    ] {
        bench.choose("Shading preset", name);
        assert_eq!(shading(&bench), preset.shading(&volume), "{name}");
        let list = bench.harness.get_by_role_and_label(Role::ComboBox, "Shading preset");
        assert_eq!(list.value().as_deref(), Some(name));
        bench.harness.check_accessibility();
    }
    press(&mut bench, "Reset shading");
    assert!(shading(&bench).is_plain());
    let reset = bench.harness.get_by_role_and_label(Role::Button, "Reset shading");
    assert!(reset.accesskit_node().is_disabled(), "there is nothing to take back");
    bench.choose("Shading preset", "Surface");
    tick(&mut bench, "Lights");
    let list = bench.harness.get_by_role_and_label(Role::ComboBox, "Shading preset");
    assert_eq!(list.value().as_deref(), Some("Custom"));
    bench.choose("Shading preset", "None");
    assert!(shading(&bench).is_plain());
}

#[test]
fn every_part_has_a_switch_of_its_own_and_comes_back_as_it_was() {
    let mut bench = Bench::opened();
    let parts = |shading: &Shading| {
        let Shading { opacity, modulation, reflection, emission, lighting, .. } = shading.clone();
        [
            lighting.map(|part| format!("{part:?}")),
            opacity.map(|part| format!("{part:?}")),
            modulation.map(|part| format!("{part:?}")),
            reflection.map(|part| format!("{part:?}")),
            emission.map(|part| format!("{part:?}")),
        ]
    };
    for (i, part) in PARTS.into_iter().enumerate() {
        let before = parts(&shading(&bench));
        tick(&mut bench, part);
        let after = parts(&shading(&bench));
        for j in 0..PARTS.len() {
            let is_changed = before[j] != after[j];
            assert_eq!(is_changed, i == j, "{part} and {}", PARTS[j]);
        }
        assert!(is_ticked(&bench, part));
        tick(&mut bench, part);
        assert_eq!(parts(&shading(&bench)), before, "{part} is out again");
        tick(&mut bench, part);
        assert_eq!(parts(&shading(&bench)), after, "{part} came back");
        tick(&mut bench, part);
    }
    tick(&mut bench, "Lights");
    bench.set_slider("Ambient", 0.5);
    bench.set_slider("Specular power", 80.0);
    let chosen = shading(&bench).lighting.expect("lights");
    assert_eq!((chosen.ambient, chosen.exponent), (0.5, 80.0));
    bench.harness.key_press(Key::L);
    bench.settle();
    assert!(shading(&bench).is_plain());
    bench.harness.key_press(Key::L);
    bench.settle();
    assert_eq!(shading(&bench).lighting, Some(chosen));
}

#[test]
fn a_dragged_light_turns_and_is_previewed_while_it_does() {
    let mut bench = Bench::opened();
    tick(&mut bench, "Lights");
    let towards = |bench: &Bench| {
        let scene = bench.window().scene().unwrap();
        scene.shading.lighting.as_ref().unwrap().lights[0].towards(&scene.camera)
    };
    let ball = bench.harness.get_by_role_and_label(Role::Canvas, "Light 1").rect();
    let (camera, before) = (bench.camera(), towards(&bench));
    let asked = bench.request_count();
    bench.drag_from(ball.center(), PointerButton::Primary, Modifiers::NONE, vec2(12.0, 0.0));
    let moved = bench.requests_since(asked);
    assert!(!moved.is_empty());
    assert!(moved.iter().all(|request| matches!(request.effort, Effort::Moving { .. })));
    assert_eq!(bench.camera(), camera, "the view stays");
    let after = towards(&bench);
    assert!((after - before).dot(camera.right()) > 0.2, "to the right: {before} to {after}");
    bench.settle();
    assert!(matches!(bench.last_request().effort, Effort::Rest { .. }));
    assert_eq!(shading(&bench).lighting.unwrap().lights[0].attached, Attached::Camera);

    press(&mut bench, "Light 1 with the data");
    let held = shading(&bench).lighting.unwrap().lights[0];
    assert_eq!(held.attached, Attached::Data);
    assert!((towards(&bench) - after).length() < 1e-9, "it stays where it was");
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 20.0));
    assert!((towards(&bench) - after).length() < 1e-9, "and turns with the data");
}

#[test]
fn lights_are_added_up_to_the_most_and_removed() {
    let mut bench = Bench::opened();
    tick(&mut bench, "Lights");
    let count = |bench: &Bench| shading(bench).lighting.unwrap().lights.len();
    press(&mut bench, "Add light");
    assert_eq!(count(&bench), 2);
    let second = shading(&bench).lighting.unwrap().lights[1];
    press(&mut bench, "Remove light 1");
    assert_eq!(shading(&bench).lighting.unwrap().lights, [second], "the one that was meant");
    for more in 2..=MOST_LIGHTS {
        press(&mut bench, "Add light");
        assert_eq!(count(&bench), more);
    }
    let add = bench.harness.get_by_role_and_label(Role::Button, "Add light");
    assert!(add.accesskit_node().is_disabled(), "no more than {MOST_LIGHTS}");
}

#[test]
fn a_table_is_looked_up_by_another_index_and_its_points_are_dragged() {
    let mut bench = Bench::opened();
    tick(&mut bench, "Opacity factor");
    let table = |bench: &Bench| shading(bench).modulation.expect("a table");
    assert_eq!(table(&bench).index, Index::GradientStrength);
    bench.choose("Opacity factor by", "View depth");
    assert_eq!(table(&bench).index, Index::ViewDepth);
    assert!(table(&bench).points.iter().all(|(at, _)| (0.0..=1.0).contains(at)));
    bench.choose("Opacity factor by", "Gradient azimuth");
    let before = table(&bench).points;
    assert_eq!(before.first().map(|point| point.0), Some(-180.0));

    let graph = bench.harness.get_by_role_and_label(Role::Canvas, "Opacity factor table").rect();
    // The first point stands in the lower left corner, at 0.
    let corner = graph.left_bottom() + vec2(7.0, -6.0);
    let by = vec2(graph.width() * 0.2, -graph.height() * 0.4);
    bench.drag_from(corner, PointerButton::Primary, Modifiers::NONE, by);
    bench.settle();
    let after = table(&bench).points;
    assert_eq!(after.len(), before.len());
    assert!(after[0].0 > before[0].0 + 50.0 && after[0].1 > 0.3, "{before:?} to {after:?}");

    let empty = graph.right_top() + vec2(-graph.width() * 0.15, 10.0);
    bench.double_click(empty);
    bench.settle();
    assert_eq!(table(&bench).points.len(), before.len() + 1, "a double click adds one");
    press(&mut bench, "Remove opacity factor point");
    assert_eq!(table(&bench).points, after);

    tick(&mut bench, "Reflection");
    let stops = |bench: &Bench| shading(bench).reflection.expect("colours").stops;
    let before = stops(&bench);
    let bar = bench.harness.get_by_role_and_label(Role::Canvas, "Reflection table").rect();
    bench.double_click(bar.center());
    bench.settle();
    let added = stops(&bench);
    assert_eq!(added.len(), before.len() + 1);
    bench.click(bar.center(), PointerButton::Secondary);
    bench.settle();
    assert_eq!(stops(&bench), before, "a right click removes it");
}

#[test]
fn modes_that_show_no_shading_say_so_and_offer_the_exact_one() {
    let mut bench = Bench::opened();
    let says = |bench: &Bench| bench.shows("Use the exact mode");
    assert!(!says(&bench));
    press(&mut bench, "Classic splatting");
    assert!(!says(&bench), "its samples are lit first");
    bench.harness.get_by_label("Advanced").click();
    bench.harness.run_steps(30);
    bench.choose("Back end", "Triangles");
    assert!(says(&bench));
    bench.choose("Shading preset", "Lights");
    let request = bench.last_request().scene;
    let triangles = SplatSettings { backend: Backend::Raster, ..SplatSettings::SHADE_FIRST };
    assert_eq!(request.splat, triangles, "a preset leaves the mode alone");
    assert!(!Shading::is_shown_by(&request.splat) && says(&bench));
    bench.harness.key_press(Key::C);
    bench.settle();
    let second = "The second mode draws splats as triangles, which cannot be lit: it shows the transfer function alone";
    assert!(!bench.shows(second), "the exact one");
    press(&mut bench, "Swap");
    assert!(bench.shows(second), "they have changed places");
    assert!(!says(&bench) && shading(&bench).lighting.is_some());
    press(&mut bench, "Reset shading");
    assert!(!bench.shows(second), "there is nothing that it would not show");
}

#[test]
fn another_volume_keeps_the_lights_and_loses_the_tables() {
    let mut bench = Bench::opened();
    bench.choose("Shading preset", "Surface");
    let lighting = shading(&bench).lighting;
    bench.open("other.nrrd");
    bench.settle();
    let now = shading(&bench);
    assert_eq!(now.lighting, lighting);
    assert_eq!(now.modulation, None);
}

#[test]
fn a_first_look_is_lit_by_itself_until_a_hand_chooses() {
    let mut bench = Bench::opened();
    bench.open("faces.nrrd");
    assert_eq!(shading(&bench).lighting, Some(Lighting::first_look()));
    let list = bench.harness.get_by_role_and_label(Role::ComboBox, "Shading preset");
    assert_eq!(list.value().as_deref(), Some("First look"));
    // Nobody chose that light: what has no faces does not inherit it.
    bench.open("other.nrrd");
    assert_eq!(shading(&bench).lighting, None);
    bench.open("faces.nrrd");
    bench.harness.key_press(Key::L);
    bench.settle();
    assert_eq!(shading(&bench).lighting, None, "the key puts it out");
    bench.open("faces.nrrd");
    assert_eq!(shading(&bench).lighting, None, "which was chosen, and so stays");
}

#[test]
fn the_effects_panel_says_what_runs_why_and_what_was_measured() {
    let mut bench = Bench::opened();
    bench.harness.key_press(Key::E);
    bench.settle();
    assert!(bench.shows("Memory for drawing in all: 52.4 MB"), "as the picture reports");
    let count = |bench: &Bench, text: &str| bench.harness.query_all_by_label(text).count();
    let running = |bench: &Bench| count(bench, "Yes");
    assert_eq!((count(&bench, "Lights"), count(&bench, "< 0.0 ms")), (2, 0));
    let before = running(&bench);
    let seconds = |bench: &Bench| -> Vec<Shading> {
        bench.engine.seconds().iter().flatten().map(|second| second.scene.shading.clone()).collect()
    };
    assert!(seconds(&bench).is_empty(), "nothing asks for anything");
    // The picture's own time is not known, as shaders were made for it: it is drawn once more, and
    // then without what it shows.
    bench.engine.makes_pipelines.store(true, Ordering::SeqCst);
    tick(&mut bench, "Lights");
    bench.engine.makes_pipelines.store(false, Ordering::SeqCst);
    bench.settle();
    let lit = shading(&bench);
    let plain = Shading::default();
    // All shading, gradients and lights are the lights alone: without each it is one picture.
    let drawn = seconds(&bench);
    assert_eq!(drawn.first(), Some(&lit));
    assert!(drawn.iter().all(|shading| *shading == lit || *shading == plain));
    // Three of each: what the window drew by itself counts, and what shaders were made for does not.
    assert_eq!(drawn.iter().filter(|shading| **shading == plain).count(), 2);
    assert_eq!(drawn.len(), 5);
    // All shading, gradients and lights.
    assert_eq!(running(&bench), before + 3);
    assert!(bench.shows("Shading, 1 light") && bench.shows("lights"));
    // The stand-in takes as long for each, and is 0.03 off. All shading and gradients are the lights: their figures stand once.
    assert_eq!((count(&bench, "< 0.0 ms"), count(&bench, "3.0 %")), (1, 1));
    tick(&mut bench, "Lights");
    assert_eq!((count(&bench, "< 0.0 ms"), count(&bench, "3.0 %")), (0, 0), "they are off");
    tick(&mut bench, "Lights");
    assert_eq!((count(&bench, "< 0.0 ms"), count(&bench, "3.0 %")), (1, 1));
    assert_eq!(seconds(&bench).len(), 5, "it is remembered");
    // Classic splatting lights samples; triangles show none of it.
    press(&mut bench, "Classic splatting");
    assert_eq!((running(&bench), count(&bench, "Not shown")), (before + 3, 0));
    bench.harness.get_by_label("Advanced").click();
    bench.harness.run_steps(30);
    bench.choose("Back end", "Triangles");
    assert_eq!((running(&bench), count(&bench, "Not shown")), (before, 3));
    assert_eq!((count(&bench, "< 0.0 ms"), count(&bench, "3.0 %")), (0, 0));
    // Closed, it measures nothing.
    let asked = seconds(&bench).len();
    bench.harness.key_press(Key::E);
    press(&mut bench, "Exact");
    tick(&mut bench, "Emission");
    bench.settle();
    assert_eq!(seconds(&bench).len(), asked);
    bench.harness.key_press(Key::E);
    bench.settle();
    assert!(seconds(&bench).len() > asked);
    bench.harness.check_accessibility();
}

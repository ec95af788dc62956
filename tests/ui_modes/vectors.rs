//! Vectors in the side panel, and their animation.

use std::sync::Arc;

use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers, PointerButton};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use voxsplat::app::document::Source;
use voxsplat::scene::{Classify, Scene, SplatSettings, VectorLayer};
use voxsplat::task::engine::Effort;
use voxsplat::vector::{ColourBy, Design, Foreshortening, VectorMode, VectorSettings};
use voxsplat::volume::VectorField;

use super::press;
use crate::ui_support::Bench;

/// What is drawn of vectors.
#[derive(Debug)]
struct Shown {
    field: Arc<VectorField>,
    settings: VectorSettings,
    phase: f64,
    alone: bool,
    second: Option<VectorLayer>,
}

impl PartialEq for Shown {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.field, &other.field)
            && self.settings == other.settings
            && (self.phase, self.alone) == (other.phase, other.alone)
            && self.second == other.second
    }
}

impl Shown {
    fn of(scene: &Scene) -> Option<Self> {
        let mut layers = scene.vectors().into_iter();
        let VectorLayer { field, settings } = layers.next()?;
        let (phase, alone) = (scene.phase, !scene.shows_field());
        Some(Self { field, settings, phase, alone, second: layers.next() })
    }
}

/// What the engine is asked to draw.
fn layer(bench: &Bench) -> Shown {
    let scene = bench.window().scene().expect("something is open");
    let asked = bench.last_request().scene;
    assert!(asked.makes_same_picture(scene), "what is chosen is asked for");
    let layer = Shown::of(scene).expect("vectors");
    assert!(layer.settings.check().is_ok(), "{:?}", layer.settings);
    layer
}

fn opened() -> Bench {
    let mut bench = Bench::empty();
    bench.open("vector.nrrd");
    bench.settle();
    bench
}

#[test]
fn a_field_of_three_components_opens_as_vectors_alone() {
    let mut bench = opened();
    let layer = layer(&bench);
    assert!(layer.alone && layer.field.name == "v");
    bench.open_details();
    assert!(bench.tells("321 splats, each a vector"));
    assert_eq!(layer.field.vectors.len(), 512);
}

#[test]
fn vectors_are_taken_away_and_brought_back() {
    let mut bench = opened();
    bench.choose("Vectors", "None");
    bench.settle();
    assert!(bench.window().scene().unwrap().vectors().is_empty());
    bench.choose("Vectors", "v");
    bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.vectors().is_empty()));
    bench.settle();
    assert!(!layer(&bench).alone, "beside the field that is there");
}

#[test]
fn what_follows_vectors_shows_those_of_the_file_first() {
    let shown = |bench: &Bench| bench.window().scene().is_some_and(|s| !s.vectors().is_empty());
    let mut bench = Bench::empty();
    bench.open("triples.nrrd");
    bench.settle();
    assert!(!shown(&bench));
    bench.harness.get_by_label("Add").click();
    bench.harness.run_steps(3);
    bench.harness.get_all_by_label("Streamlines").last().expect("in the menu").click();
    bench.wait_until(|window| {
        window
            .scene()
            .is_some_and(|scene| scene.layers.iter().any(|l| l.source.field == "streamlines"))
    });
    bench.settle();
    assert!(shown(&bench) && layer(&bench).field.name == "wind");
    let splats = |bench: &Bench| bench.window().scene().unwrap().vectors()[0].shows_splats();
    assert!(!splats(&bench), "lines alone were asked for");
    // What plays is seen.
    bench.harness.key_press(Key::Space);
    bench.harness.run_steps(3);
    assert!(splats(&bench));

    let mut bench = Bench::empty();
    bench.open("triples.nrrd");
    bench.settle();
    bench.harness.key_press(Key::Space);
    bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.vectors().is_empty()));
    bench.harness.run_steps(3);
    let phase = bench.window().scene().map(|scene| scene.phase);
    bench.wait_until(|window| window.scene().map(|scene| scene.phase) != phase);
}

#[test]
fn enter_chooses_from_a_list_and_closes_it() {
    let mut bench = opened();
    let list = |bench: &Bench| bench.harness.query_all_by_label("None").count();
    bench.harness.get_by_role_and_label(Role::ComboBox, "Vectors").click();
    bench.harness.run_steps(3);
    let closed = list(&bench) - 1;
    let entry = bench.harness.get_all_by_label("None").last().expect("in the list");
    entry.focus();
    bench.harness.run_steps(2);
    bench.harness.key_press(Key::Enter);
    bench.settle();
    assert!(bench.window().scene().unwrap().vectors().is_empty(), "chosen");
    assert_eq!(list(&bench), closed, "closed");
}

/// What the engine makes of these requests `tests/gpu/vectors_on_the_way.rs` holds.
#[test]
fn another_field_beside_vectors_takes_neither_them_nor_the_mode_over() {
    let mut bench = Bench::with_wind();
    let wind = layer(&bench);
    bench.choose("Field", "wind (point, vectors)");
    bench.wait_until(|window| window.document().is_some_and(|document| document.field == 3));
    bench.settle();
    for component in ["y", "Vorticity"] {
        assert_eq!(layer(&bench), wind);
        assert_eq!(bench.last_request().scene.splat, SplatSettings::EXACT);
        bench.choose("Component", component);
        bench.wait_until(|window| !window.is_loading());
        bench.settle();
    }
    assert_eq!(layer(&bench), wind);
    let notices = bench.window().notices().shown();
    assert!(notices.iter().all(|notice| notice.text.starts_with("This file has vectors")));
}

#[test]
fn three_scalar_fields_are_put_together_and_undone() {
    let mut bench = Bench::empty();
    bench.open("triples.nrrd");
    bench.settle();
    assert!(bench.window().scene().unwrap().vectors().is_empty(), "it opens as the scalar it is");
    bench.choose("Vectors", "Three scalar fields…");
    bench.choose("Along x", "w");
    bench.settle();
    assert!(bench.window().scene().unwrap().vectors().is_empty(), "nothing is drawn of a choice");
    press(&mut bench, "Draw as vectors");
    bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.vectors().is_empty()));
    bench.settle();
    let found = layer(&bench);
    // All three count up in the same way.
    assert_eq!(found.field.name, "(w, v, w)");
    assert_eq!(found.field.vectors[7], glam::Vec3::splat(7.0));
    assert!(!found.alone && !bench.shows("Along x"));
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert!(bench.window().scene().unwrap().vectors().is_empty());
    bench.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    bench.settle();
    assert_eq!(layer(&bench).field.name, "(w, v, w)");
}

#[test]
fn what_is_chosen_is_drawn_and_undone() {
    let mut bench = opened();
    let before = layer(&bench).settings;
    bench.choose("Mode", "Blend");
    bench.choose("Marks", "Comets");
    bench.choose("Coloured by", "x");
    bench.set_slider("Vector opacity", 0.25);
    bench.settle();
    let after = layer(&bench).settings;
    assert_eq!(
        (after.mode, after.design, after.colour_by),
        (VectorMode::Blend, Design::Comets, ColourBy::X,)
    );
    let greatest = after.transfer.opacity.iter().map(|(_, a)| *a).fold(0.0, f64::max);
    assert_eq!(greatest, 0.25);
    // Colours by place are of the places there are: 0 to 7 along x.
    assert_eq!(after.transfer.colour.range(), [0.0, 7.0]);
    for _ in 0..4 {
        bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        bench.settle();
    }
    assert_eq!(layer(&bench).settings, before);
}

#[test]
fn a_second_field_has_a_look_of_its_own_and_is_undone() {
    let mut bench = Bench::with_wind();
    let first = layer(&bench);
    bench.choose("Second field", "field");
    let has_second = |window: &voxsplat::app::Window| {
        window.scene().is_some_and(|scene| scene.vectors().len() > 1)
    };
    bench.wait_until(has_second);
    bench.settle();
    let found = layer(&bench);
    assert_eq!((&found.settings, &*found.field.name), (&first.settings, "wind"));
    let second = found.second.expect("a second field");
    assert_eq!(second.field.name, "field");
    assert_ne!(second.settings.transfer.colour, first.settings.transfer.colour);
    bench.choose("Mode (second)", "Blend");
    bench.choose("Marks (second)", "Dots");
    bench.set_slider("Vector opacity (second)", 0.5);
    bench.settle();
    let changed = layer(&bench);
    let look = &changed.second.as_ref().expect("a second field").settings;
    assert_eq!((look.mode, look.design), (VectorMode::Blend, Design::Dots));
    assert_eq!(changed.settings, first.settings, "the first stays as it is");
    for _ in 0..4 {
        bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        bench.settle();
    }
    assert!(layer(&bench).second.is_none(), "adding it is a step, too");
    bench.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    bench.settle();
    assert_eq!(layer(&bench).second, Some(second));
    bench.choose("Second field", "None");
    bench.settle();
    assert!(layer(&bench).second.is_none());
}

#[test]
fn opacity_is_by_place_or_by_the_scalar_field() {
    let mut bench = opened();
    let by_length = layer(&bench).settings.transfer.opacity;
    bench.choose("Opacity by", "z");
    bench.settle();
    let found = layer(&bench).settings;
    let greatest = by_length.iter().map(|(_, a)| *a).fold(0.0, f64::max);
    assert_eq!(found.opacity_by, ColourBy::Z);
    // Of the places there are: 0 to 7 along z.
    assert_eq!(found.transfer.opacity, [(0.0, 0.0), (7.0, greatest)]);
    bench.set_slider("Opaque from", 3.0);
    bench.settle();
    assert_eq!(layer(&bench).settings.transfer.opacity, [(0.0, 0.0), (3.0, greatest)]);
    bench.choose("Opacity by", "Scalar field");
    bench.settle();
    let statistics = bench.window().scene().unwrap().volume().expect("a field").statistics.clone();
    let expected = [(statistics.min, 0.0), (statistics.max, greatest)];
    assert_eq!(layer(&bench).settings.transfer.opacity, expected);
    bench.choose("Opacity by", "Length");
    bench.settle();
    assert_eq!(layer(&bench).settings.transfer.opacity, by_length);
}

#[test]
fn the_shape_of_splats_is_chosen() {
    let mut bench = opened();
    bench.harness.get_by_role_and_label(Role::DisclosureTriangle, "Shape").click();
    bench.settle();
    bench.set_slider("Stretch", 4.0);
    bench.set_slider("Splat radius", 2.5);
    bench.set_slider("Coarser", 2.0);
    bench.choose("Seen askew", "Shorter splat");
    bench.settle();
    let found = layer(&bench).settings;
    assert_eq!((found.stretch, found.extent, found.coarser), (4.0, Some(2.5), 2));
    assert_eq!(found.foreshortening, Foreshortening::Polygon);
    press(&mut bench, "Reset splat radius");
    bench.settle();
    assert_eq!(layer(&bench).settings.extent, None);
}

#[test]
fn marks_move_while_playing_and_stay_where_they_are_paused() {
    let mut bench = opened();
    assert_eq!(layer(&bench).phase, 0.0);
    bench.set_slider("Speed", 1.0);
    bench.settle();
    let asked = bench.request_count();
    bench.harness.remove_cursor();
    bench.harness.key_press(Key::Space);
    bench.harness.run_steps(30);
    let moving = bench.requests_since(asked);
    let phases: Vec<f64> = moving.iter().map(|request| request.scene.phase).collect();
    assert!(phases.len() > 6 && phases.windows(2).all(|w| w[1] > w[0]), "{phases:?}");
    // Half a second of passes at one cycle a second, no more often than 20 times a second.
    assert!((0.3..0.55).contains(phases.last().unwrap()) && phases.len() <= 11, "{phases:?}");
    assert!(moving.iter().all(|request| matches!(request.effort, Effort::Moving { .. })));
    bench.harness.key_press(Key::Space);
    bench.settle();
    let paused = layer(&bench).phase;
    assert!(matches!(bench.last_request().effort, Effort::Rest { .. }), "exact again");
    let asked = bench.request_count();
    bench.harness.run_steps(20);
    assert_eq!((bench.request_count(), layer(&bench).phase), (asked, paused));
    // Time is no step that could be undone, and is not taken back by one.
    bench.choose("Marks", "Dots");
    bench.settle();
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(layer(&bench).settings.design, Design::Streaks);
    assert!((layer(&bench).phase - paused).abs() < 1e-12);
    let speed = |bench: &Bench| {
        let node = bench.harness.get_all_by_label("Speed").last().expect("there");
        node.accesskit_node().numeric_value()
    };
    assert_eq!(speed(&bench), Some(1.0));
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(speed(&bench), Some(0.4));
}

#[test]
fn the_tornado_opens_flowing_and_space_stops_it_and_lets_it_go_on() {
    let mut bench = Bench::opened();
    let ctx = bench.harness.ctx.clone();
    bench.harness.state_mut().open(&ctx, Source::Demo("tornado".to_owned()));
    bench.wait_until(|window| !window.is_loading());
    bench.harness.remove_cursor();
    let phases = |bench: &mut Bench| {
        let asked = bench.request_count();
        bench.harness.run_steps(30);
        let phases = bench.requests_since(asked).into_iter().map(|request| request.scene.phase);
        phases.collect::<Vec<f64>>()
    };
    let flowing = phases(&mut bench);
    assert!(flowing.len() > 6 && flowing.windows(2).all(|w| w[1] > w[0]), "{flowing:?}");
    assert!(bench.window().scene().is_some_and(|scene| !scene.shows_field()), "the wind alone");
    let found = layer(&bench);
    let low = found.settings.transfer.colour.range()[0];
    assert!(low >= found.field.statistics.min, "no length is less: {low}");
    bench.harness.key_press(Key::Space);
    bench.settle();
    assert_eq!(phases(&mut bench), [0.0; 0], "it stands");
    bench.harness.key_press(Key::Space);
    let again = phases(&mut bench);
    assert!(again.len() > 6, "{again:?}");
}

#[test]
fn a_speed_beyond_all_is_not_taken_and_that_is_told() {
    let mut bench = opened();
    let speed = |bench: &Bench| {
        let node = bench.harness.get_all_by_label("Speed").last().expect("there");
        (node.rect().center(), node.accesskit_node().numeric_value())
    };
    for (typed, taken, told) in [("-3.5", -3.5, 0), ("1e30", -3.5, 1)] {
        bench.click(speed(&bench).0, PointerButton::Primary);
        bench.harness.run_steps(2);
        bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
        bench.harness.run_steps(2);
        bench.harness.event(Event::Text(typed.to_owned()));
        bench.harness.run_steps(2);
        bench.harness.key_press(Key::Enter);
        bench.harness.run_steps(4);
        assert_eq!(speed(&bench).1, Some(taken), "{typed}");
        assert_eq!(bench.window().notices().shown().len(), told, "{typed}");
    }
    assert!(bench.window().notices().shown()[0].text.contains("Speed takes -4 to 4: 1e30"));
}

#[test]
fn the_phase_is_scrubbed_and_speed_0_costs_nothing() {
    let mut bench = opened();
    bench.set_slider("Phase", 0.625);
    bench.settle();
    assert_eq!(layer(&bench).phase, 0.625);
    bench.set_slider("Phase", 1.0);
    bench.settle();
    assert_eq!(layer(&bench).phase, 1.0, "the end of the slider stays its end");
    bench.set_slider("Speed", 0.0);
    press(&mut bench, "Play");
    bench.settle();
    let asked = bench.request_count();
    bench.harness.run_steps(20);
    assert_eq!(bench.request_count(), asked);
    assert!(bench.harness.get_by_role_and_label(Role::Button, "Pause").rect().is_positive());
}

fn tick(bench: &mut Bench) {
    bench.harness.get_by_role_and_label(Role::CheckBox, "Hide the scalar field").click();
    bench.settle();
}

#[test]
fn modes_that_shade_first_have_vectors_and_triangles_say_that_they_have_none() {
    let mut bench = opened();
    tick(&mut bench);
    assert!(Shown::of(&bench.last_request().scene).is_some_and(|layer| !layer.alone));
    let says = "Not drawn: this mode has no room for vectors beside the scalar field. Hide the field, or \
                choose the exact mode under Splats";
    press(&mut bench, "Classic splatting");
    bench.settle();
    let scene = bench.last_request().scene;
    assert!(!scene.vectors().is_empty() && scene.splat.classify == Classify::Before);
    assert!(!bench.shows(says));
    bench.harness.get_by_label("Advanced").scroll_to_me();
    bench.harness.run_steps(30);
    bench.harness.get_by_label("Advanced").click();
    bench.harness.run_steps(30);
    bench.harness.get_by_role_and_label(Role::ComboBox, "Back end").scroll_to_me();
    bench.harness.run_steps(30);
    bench.choose("Back end", "Triangles");
    bench.settle();
    assert!(bench.last_request().plan().kernels.is_empty(), "the picture is of the field alone");
    assert!(bench.shows(says));
    let alone = bench.harness.get_by_role_and_label(Role::CheckBox, "Hide the scalar field");
    alone.scroll_to_me();
    bench.harness.run_steps(30);
    tick(&mut bench);
    assert!(Shown::of(&bench.last_request().scene).is_some_and(|layer| layer.alone));
}

#[test]
fn a_loop_is_saved_from_the_window() {
    let mut bench = opened();
    press(&mut bench, "Save loop…");
    assert!(bench.shows("Pictures of the loop"));
    press(&mut bench, "Save");
    bench.wait_until(|window| !window.notices().shown().is_empty());
    let request = bench.saved();
    assert!(bench.window().notices().shown()[0].text.ends_with(".gif"));
    assert_eq!(request.cycle.map(|cycle| cycle.frames), Some(32));
    assert!(request.path.extension().is_some_and(|e| e == "gif"), "{:?}", request.path);
    assert!(!request.scene.vectors().is_empty());
}

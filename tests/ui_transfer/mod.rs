//! The transfer function's editors by hand, its ways in and out, and undo and redo of everything.

mod regions;

use std::path::Path;

use eframe::egui::accesskit::{Role, Toggled};
use eframe::egui::{
    Event, Key, KeyboardShortcut, Modifiers, OutputCommand, PointerButton, Pos2, Rect,
    ViewportCommand, vec2,
};
use egui_kittest::kittest::{NodeT as _, Queryable as _};

use crate::ui_support::Bench;
use voxsplat::app::settings::Settings;
use voxsplat::core::{Projection, Srgb8};
use voxsplat::scene::{Background, Scene};
use voxsplat::transfer::{
    ColourMap, ColourSource, Design, Gaussian, MOST_DRAWN_POINTS, TransferFunction,
};

/// What a person sees of a state.
#[derive(Clone)]
struct Seen {
    scene: Scene,
    settings: Settings,
    comparison: (bool, f32),
}

impl PartialEq for Seen {
    fn eq(&self, other: &Self) -> bool {
        self.scene.makes_same_picture(&other.scene)
            && self.settings == other.settings
            && self.comparison == other.comparison
    }
}

fn seen(bench: &Bench) -> Seen {
    let window = bench.window();
    Seen {
        scene: window.scene().expect("something is open").clone(),
        // What was open is remembered, whatever is undone, and so is what was learned.
        settings: Settings { recent: Vec::new(), knows_drag: false, ..window.settings().clone() },
        comparison: (window.compare().on, window.compare().divider),
    }
}

fn press(bench: &mut Bench, modifiers: Modifiers, key: Key) {
    bench.harness.key_press_modifiers(modifiers, key);
    bench.harness.run_steps(3);
}

fn undo(bench: &mut Bench) {
    press(bench, Modifiers::COMMAND, Key::Z);
}

fn redo(bench: &mut Bench) {
    press(bench, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
}

fn previous_view(bench: &mut Bench) {
    press(bench, Modifiers::ALT, Key::ArrowLeft);
}

fn next_view(bench: &mut Bench) {
    press(bench, Modifiers::ALT, Key::ArrowRight);
}

fn click(bench: &mut Bench, label: &str) {
    bench.harness.get_all_by_label(label).last().expect("there").click();
    bench.harness.run_steps(4);
}

fn function(bench: &Bench) -> TransferFunction {
    bench.window().scene().expect("something is open").transfer().expect("a field").clone()
}

fn graph(bench: &Bench) -> Rect {
    bench.harness.get_by_label("Opacity curve over the histogram").rect()
}

fn at(rect: Rect, x: f32, y: f32) -> Pos2 {
    rect.lerp_inside(vec2(x, y))
}

/// The last one was cut off from the list, and who knew it from elsewhere missed it.
#[test]
fn all_colour_maps_are_in_sight_and_what_is_not_safe_says_so() {
    let mut bench = Bench::opened();
    bench.harness.get_by_role_and_label(Role::ComboBox, "Colours").click();
    bench.harness.run_steps(4);
    let top = |label: &str| {
        let node = bench.harness.get_all_by_label(label).last().expect("in the list");
        node.rect().top()
    };
    let names =
        ["Viridis", "Cividis", "Vik", "CT-like", "Not safe for colour-blind people", "Turbo"];
    let tops = names.map(top);
    assert!(tops[1..].is_sorted(), "the safe ones first");
    bench.harness.get_by_label("Turbo").click();
    bench.settle();
    let colour = function(&bench).colour;
    assert!(matches!(colour, ColourSource::Map { map: ColourMap::Turbo, .. }), "{colour:?}");
}

#[test]
fn window_and_level_are_one_step_of_undo() {
    let mut bench = Bench::opened();
    let before = seen(&bench);
    press(&mut bench, Modifiers::NONE, Key::W);
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(50.0, 30.0));
    bench.settle();
    assert!(seen(&bench) != before);
    undo(&mut bench);
    assert!(seen(&bench) == before);
}

type Edit = (&'static str, fn(&mut Bench));

/// A change of the view of every kind.
const VIEWS: [Edit; 5] = [
    ("orbit", |b| b.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0))),
    ("move", |b| b.drag(PointerButton::Middle, Modifiers::NONE, vec2(20.0, 10.0))),
    ("wheel", |b| {
        b.hover(b.viewport().center());
        for _ in 0..4 {
            b.wheel(1.0);
        }
    }),
    ("named view", |b| press(b, Modifiers::NONE, Key::Num7)),
    ("projection", |b| press(b, Modifiers::NONE, Key::Num5)),
];

/// A change of every other kind, none of which another one takes back.
const EDITS: [Edit; 14] = [
    ("curve", |b| {
        let rect = graph(b);
        b.drag_from(at(rect, 0.25, 0.58), PointerButton::Primary, Modifiers::NONE, vec2(9.0, -8.0));
        b.double_click(at(rect, 0.7, 0.3));
        b.harness.run_steps(2);
    }),
    ("colours", |b| b.choose("Colours", "Gray")),
    ("stops", |b| click(b, "Edit colours")),
    ("range", |b| b.set_slider("Range high", 700.0)),
    ("stretch", |b| click(b, "Full range")),
    ("gaussians", |b| click(b, "Gaussians")),
    ("extent", |b| b.set_slider("Extent", 2.5)),
    ("unit distance", |b| b.set_slider("Opacity over", 10.0)),
    ("kernel", |b| b.choose("Kernel", "Nearest")),
    ("background", |b| click(b, "Transparent")),
    ("budget", |b| b.set_slider("Frame budget", 50.0)),
    ("axes", |b| press(b, Modifiers::NONE, Key::T)),
    ("compare", |b| press(b, Modifiers::NONE, Key::C)),
    // Last: what is below it in the panel moves out of sight.
    ("regions", |b| click(b, "Add region")),
];

#[test]
fn undo_takes_back_everything_step_by_step_and_redo_does_it_again() {
    let mut bench = Bench::opened();
    let mut states = vec![seen(&bench)];
    for (name, edit) in EDITS {
        edit(&mut bench);
        bench.settle();
        assert!(states.last() != Some(&seen(&bench)), "{name} changes something");
        states.push(seen(&bench));
    }
    // Two steps of the curve count as one edit here.
    let mut steps = 0;
    for (i, state) in states.iter().enumerate().rev().skip(1) {
        let name = EDITS[i].0;
        let allowed = if name == "curve" { 3 } else { 1 };
        let mut taken = 0;
        while seen(&bench) != *state {
            assert!(taken < allowed, "{name} is not taken back by {taken} steps");
            undo(&mut bench);
            taken += 1;
        }
        steps += taken;
    }
    undo(&mut bench);
    assert!(bench.shows("There is nothing to undo"));
    assert!(seen(&bench) == states[0]);
    for _ in 0..steps {
        redo(&mut bench);
    }
    assert!(states.last() == Some(&seen(&bench)), "all done again");
    redo(&mut bench);
    assert!(bench.shows("There is nothing to redo"));
    assert!(states.last() == Some(&seen(&bench)));
    bench.harness.check_accessibility();
}

#[test]
fn views_have_steps_of_their_own_and_undo_takes_back_the_last_edit_whatever_was_turned_since() {
    let mut bench = Bench::opened();
    let colours = function(&bench);
    bench.choose("Colours", "Gray");
    let grey = function(&bench);
    let mut cameras = vec![bench.camera()];
    for (name, turn) in VIEWS {
        turn(&mut bench);
        bench.settle();
        assert_ne!(cameras.last(), Some(&bench.camera()), "{name} changes the view");
        cameras.push(bench.camera());
    }
    undo(&mut bench);
    assert_eq!(function(&bench), colours, "the edit");
    assert_eq!(cameras.last(), Some(&bench.camera()), "and not the view");
    redo(&mut bench);
    for camera in cameras.iter().rev().skip(1) {
        previous_view(&mut bench);
        assert_eq!(bench.camera(), *camera);
    }
    previous_view(&mut bench);
    assert!(bench.shows("There is no earlier view"));
    for camera in &cameras[1..] {
        next_view(&mut bench);
        assert_eq!(bench.camera(), *camera);
    }
    next_view(&mut bench);
    assert!(bench.shows("There is no later view"));
    assert_eq!(function(&bench), grey, "no view has changed anything else");
    // What is up is an edit, and brings the view that belongs to it.
    press(&mut bench, Modifiers::NONE, Key::Num8);
    undo(&mut bench);
    assert_eq!(cameras.last(), Some(&bench.camera()));
    // Another file begins anew, and the one before comes back as it was seen last.
    bench.open("second.nrrd");
    bench.settle();
    previous_view(&mut bench);
    assert!(bench.shows("There is no earlier view"));
    undo(&mut bench);
    bench.harness.run_steps(90);
    undo(&mut bench);
    assert_eq!(cameras.last(), Some(&bench.camera()));
}

#[test]
fn random_edits_and_steps_never_lose_a_state() {
    let mut bench = Bench::opened();
    // The state before each step and the present; those that were undone.
    let (mut past, mut future) = (vec![seen(&bench)], Vec::new());
    let mut seed = 20_261_122_u32;
    for _ in 0..60 {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let choice = (seed >> 16) as usize;
        match choice % 5 {
            0 | 1 => {
                undo(&mut bench);
                if past.len() > 1 {
                    future.extend(past.pop());
                }
            }
            2 => {
                redo(&mut bench);
                past.extend(future.pop());
            }
            _ => {
                // One step each, whatever the state.
                let simple: [fn(&mut Bench); 5] = [
                    |b| press(b, Modifiers::NONE, Key::B),
                    |b| click(b, "Trihedron"),
                    |b| press(b, Modifiers::NONE, Key::S),
                    |b| b.choose("Colours", "Magma"),
                    |b| b.choose("Colours", "Batlow"),
                ];
                simple[choice / 5 % simple.len()](&mut bench);
                if past.last() != Some(&seen(&bench)) {
                    past.push(seen(&bench));
                    future.clear();
                }
            }
        }
        bench.harness.run_steps(2);
        assert!(past.last() == Some(&seen(&bench)));
    }
    assert!(past.len() > 3, "{}", past.len());
}

#[test]
fn a_drag_and_a_turn_of_the_wheel_are_one_step_each_and_pauses_divide_them() {
    let mut bench = Bench::opened();
    let before = seen(&bench);
    let from = bench.viewport().center();
    bench.hover(from);
    let button = |pressed, pos| Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    bench.harness.event(button(true, from));
    for i in 1..=10_u8 {
        bench.harness.event(Event::PointerMoved(from + vec2(f32::from(i) * 5.0, 0.0)));
        // Long enough for anything that goes by time.
        bench.harness.run_steps(20);
    }
    bench.harness.event(button(false, from + vec2(50.0, 0.0)));
    bench.harness.run_steps(3);
    let dragged = seen(&bench);
    bench.hover(from);
    for _ in 0..5 {
        bench.wheel(1.0);
        bench.harness.run_steps(10);
    }
    let zoomed = seen(&bench);
    bench.harness.run_steps(60);
    bench.wheel(1.0);
    previous_view(&mut bench);
    assert!(seen(&bench) == zoomed, "a second later it is another step");
    previous_view(&mut bench);
    assert!(seen(&bench) == dragged, "five notches are one step");
    previous_view(&mut bench);
    assert!(seen(&bench) == before, "a drag is one step");
}

#[test]
fn a_step_back_in_the_midst_of_a_drag_takes_that_drag_back() {
    let mut bench = Bench::opened();
    let before = seen(&bench);
    let from = bench.viewport().center();
    bench.hover(from);
    bench.harness.event(Event::PointerButton {
        pos: from,
        button: PointerButton::Primary,
        pressed: true,
        modifiers: Modifiers::NONE,
    });
    bench.harness.event(Event::PointerMoved(from + vec2(50.0, 0.0)));
    bench.harness.run_steps(3);
    let held = seen(&bench);
    assert!(held != before);
    previous_view(&mut bench);
    assert!(seen(&bench) == before);
    next_view(&mut bench);
    assert!(seen(&bench) == held);
}

#[test]
fn what_is_typed_is_one_step_and_fields_undo_their_own_text() {
    let mut bench = Bench::opened();
    bench.choose("Colours", "Gray");
    let before = seen(&bench);
    let number = |bench: &Bench| bench.harness.get_by_label("Range high").rect().center();
    bench.click(number(&bench), PointerButton::Primary);
    bench.harness.run_steps(2);
    press(&mut bench, Modifiers::COMMAND, Key::A);
    for digit in ["6", "0", "0"] {
        bench.harness.event(Event::Text(digit.to_owned()));
        bench.harness.run_steps(40);
    }
    // Of a number only all of it says which one it is.
    assert!(seen(&bench) == before, "still typing");
    // The field's own: what was chosen before stays.
    for _ in 0..3 {
        undo(&mut bench);
    }
    let colour = function(&bench).colour;
    assert!(matches!(colour, ColourSource::Map { map: ColourMap::Gray, .. }), "{colour:?}");
    assert!(bench.harness.ctx.text_edit_focused(), "still typing");
    press(&mut bench, Modifiers::COMMAND, Key::A);
    bench.harness.event(Event::Text("800".to_owned()));
    bench.harness.run_steps(2);
    press(&mut bench, Modifiers::NONE, Key::Enter);
    assert_eq!(function(&bench).colour.range()[1], 800.0);
    undo(&mut bench);
    assert!(seen(&bench) == before, "{:?}", function(&bench));
    press(&mut bench, Modifiers::COMMAND, Key::Y);
    assert_eq!(function(&bench).colour.range()[1], 800.0);
}

#[test]
fn the_edit_menu_says_what_it_would_take_back() {
    let mut bench = Bench::opened();
    let entry = |bench: &mut Bench, name: &str| {
        bench.harness.get_by_label("Edit").click();
        bench.harness.run_steps(3);
        let node = bench.harness.get_all_by_label_contains(name).last().expect("in the menu");
        let found = (node.rect().center(), node.accesskit_node().is_disabled());
        bench.hover(found.0);
        bench.harness.run_steps(40);
        found
    };
    assert!(entry(&mut bench, "Undo").1, "nothing yet");
    press(&mut bench, Modifiers::NONE, Key::Escape);
    bench.choose("Colours", "Gray");
    let (place, disabled) = entry(&mut bench, "Undo");
    assert!(!disabled && bench.shows("Take back the last change of: colours"));
    bench.click(place, PointerButton::Primary);
    assert!(matches!(function(&bench).colour, ColourSource::Map { map: ColourMap::Viridis, .. }));
    entry(&mut bench, "Redo");
    assert!(bench.shows("Do again the last change of: colours"));
}

#[test]
fn another_file_is_a_step_and_so_is_another_field() {
    let mut bench = Bench::opened();
    let plain = seen(&bench);
    press(&mut bench, Modifiers::NONE, Key::T);
    let with_trihedron = seen(&bench);
    bench.open("vector.nrrd");
    bench.settle();
    let name = |bench: &Bench| bench.window().document().expect("open").source.name();
    let other = seen(&bench);
    bench.choose("Component", "y");
    bench.wait_until(|window| !window.is_loading());
    bench.settle();
    let other_field = seen(&bench);
    assert!(other_field != other);
    undo(&mut bench);
    assert!(seen(&bench) == other);
    let title = ViewportCommand::Title("good.nrrd – Voxsplat".to_owned());
    // It asks before it takes a file away.
    undo(&mut bench);
    bench.harness.run_steps(90);
    assert!(bench.press_sends(KeyboardShortcut::new(Modifiers::COMMAND, Key::Z), &title));
    bench.harness.run_steps(3);
    assert!(seen(&bench) == with_trihedron);
    assert_eq!(name(&bench), "good.nrrd");
    undo(&mut bench);
    assert!(seen(&bench) == plain);
    undo(&mut bench);
    assert!(bench.shows("There is nothing to undo"));
    for _ in 0..3 {
        redo(&mut bench);
    }
    assert!(seen(&bench) == other_field);
    assert_eq!(name(&bench), "vector.nrrd");
}

#[test]
fn steps_of_files_that_take_too_much_memory_are_forgotten_and_that_is_said() {
    let mut bench = Bench::opened();
    press(&mut bench, Modifiers::NONE, Key::T);
    // Each has 8³ samples of 16 bits: enough for one that is not open, not for two.
    bench.bytes_for_steps.store(2047, std::sync::atomic::Ordering::SeqCst);
    bench.open("second.nrrd");
    bench.settle();
    let note = "The oldest steps can no longer be undone: what was open then would take too much of the free \
                memory";
    assert!(!bench.shows(note));
    let second = seen(&bench);
    bench.open("third.nrrd");
    bench.settle();
    assert!(bench.shows(note));
    // It asks before it takes a file away.
    undo(&mut bench);
    bench.harness.run_steps(90);
    undo(&mut bench);
    assert!(seen(&bench) == second, "of two the older one went");
    undo(&mut bench);
    assert!(bench.shows("There is nothing to undo"));
}

#[test]
fn how_the_curve_is_shown_and_edited_is_undone_too() {
    let mut bench = Bench::opened();
    let is_on = |bench: &Bench, label: &str| {
        let node = bench.harness.get_all_by_label(label).last().expect("there");
        node.accesskit_node().toggled() == Some(Toggled::True)
    };
    assert!(is_on(&bench, "Log") && is_on(&bench, "Points"));
    click(&mut bench, "Log");
    click(&mut bench, "Freehand");
    bench.set_slider("Low percentile", 7.0);
    assert!(!is_on(&bench, "Log") && is_on(&bench, "Freehand"));
    undo(&mut bench);
    undo(&mut bench);
    assert!(!is_on(&bench, "Log") && is_on(&bench, "Points"));
    undo(&mut bench);
    assert!(is_on(&bench, "Log"));
    undo(&mut bench);
    assert!(bench.shows("There is nothing to undo"));
    redo(&mut bench);
    redo(&mut bench);
    assert!(!is_on(&bench, "Log") && is_on(&bench, "Freehand"));
}

#[test]
fn gaussians_are_added_pulled_and_removed_by_hand() {
    let mut bench = Bench::opened();
    click(&mut bench, "Gaussians");
    let rect = graph(&bench).shrink(7.0);
    let [low, high] = [0.0, 511.0];
    let value = |x: f32| low + (high - low) * f64::from((x - rect.left()) / rect.width());
    let f = function(&bench);
    assert!((f.opacity_at(255.5) - 0.8).abs() < 1e-9, "as high as the points were");
    assert!(f.opacity_at(0.0) < 1e-3);
    let peak = at(rect, 0.5, 0.2);
    bench.drag_from(peak, PointerButton::Primary, Modifiers::NONE, vec2(40.0, 20.0));
    let f = function(&bench);
    let centre = value(peak.x + 40.0);
    assert!((f.opacity_at(centre) - 0.63).abs() < 0.01, "{}", f.opacity_at(centre));
    assert!(f.opacity_at(centre - 30.0) < f.opacity_at(centre));
    // Another, well apart, and narrow.
    bench.settle();
    bench.double_click(at(rect, 0.1, 0.5));
    bench.harness.run_steps(2);
    let two = function(&bench);
    let found = two.opacity_at(value(at(rect, 0.1, 0.5).x));
    assert!((found - 0.5).abs() < 0.02, "{found}: {two:?}");
    assert_eq!(two.opacity_at(centre), f.opacity_at(centre), "the first is as it was");
    bench.set_slider("Gaussian width", 3.0);
    let narrow = function(&bench);
    assert!(narrow.opacity_at(80.0) < 0.05 && two.opacity_at(80.0) > 0.2);
    bench.click(at(rect, 0.1, 0.5), PointerButton::Secondary);
    assert_eq!(function(&bench), f);
    // As points they stay the same curve.
    click(&mut bench, "Points");
    assert_eq!(function(&bench), f);
    assert!(bench.shows("Point value"));
    bench.harness.check_accessibility();
}

#[test]
fn a_curve_drawn_by_hand_passes_where_the_mouse_did() {
    let mut bench = Bench::opened();
    let before = function(&bench);
    click(&mut bench, "Freehand");
    assert_eq!(function(&bench), before, "nothing is drawn yet");
    let rect = graph(&bench).shrink(7.0);
    let start = at(rect, 0.5, 0.9);
    bench.drag_from(start, PointerButton::Primary, Modifiers::NONE, vec2(0.4, -0.6) * rect.size());
    let drawn = function(&bench);
    assert!(drawn.opacity.len() < 10, "a line is few points: {:?}", drawn.opacity);
    for (fraction, opacity) in [(0.55, 0.175), (0.7, 0.4), (0.85, 0.625)] {
        let found = drawn.opacity_at(511.0 * fraction);
        assert!((found - opacity).abs() < 0.03, "{fraction}: {found} for {opacity}");
    }
    // But for the last digit: it lies between other points now.
    assert!((drawn.opacity_at(100.0) - before.opacity_at(100.0)).abs() < 1e-12);
    assert!(drawn.opacity.len() <= MOST_DRAWN_POINTS + before.opacity.len() + 2);
    undo(&mut bench);
    assert_eq!(function(&bench), before);
}

#[test]
fn colour_stops_are_added_coloured_moved_and_removed() {
    let mut bench = Bench::opened();
    bench.choose("Colours", "Gray");
    click(&mut bench, "Full range");
    let map = function(&bench);
    click(&mut bench, "Edit colours");
    let stops = |bench: &Bench| match function(bench).colour {
        ColourSource::Stops(stops) => stops,
        map @ ColourSource::Map { .. } => panic!("no stops: {map:?}"),
    };
    assert_eq!(stops(&bench), [(0.0, Srgb8::BLACK), (511.0, Srgb8::WHITE)]);
    let bar = bench.harness.get_by_label("Colours by value").rect();
    let inner = bar.shrink2(vec2(7.0, 0.0));
    bench.drag_from(at(inner, 0.5, 0.5), PointerButton::Primary, Modifiers::NONE, vec2(20.0, 0.0));
    let three = stops(&bench);
    assert_eq!(three.len(), 3);
    assert_eq!(three[1].1, Srgb8([128; 3]), "the colour that was there");
    assert!(three[1].0 > 270.0, "and moved on with the hand: {three:?}");
    bench.set_slider("Colour point value", 100.0);
    assert_eq!(stops(&bench)[1].0, 100.0);
    assert!(bench.shows("Colour point colour"));
    bench.click(at(inner, 100.0 / 511.0, 0.5), PointerButton::Secondary);
    assert_eq!(stops(&bench).len(), 2);
    bench.choose("Colours", "Gray");
    assert_eq!(function(&bench), map);
    bench.harness.check_accessibility();
}

#[test]
fn presets_are_chosen_and_known_again() {
    let mut bench = Bench::opened();
    let fresh = function(&bench);
    bench.choose("Preset", "MR");
    let mr = function(&bench);
    assert!(matches!(mr.colour, ColourSource::Map { map: ColourMap::Gray, .. }));
    assert_ne!(mr.opacity, fresh.opacity);
    let shown = |bench: &Bench, text: &str| {
        let list = bench.harness.get_by_role_and_label(Role::ComboBox, "Preset");
        list.accesskit_node().value().as_deref() == Some(text)
    };
    assert!(shown(&bench, "MR"));
    bench.set_slider("Point opacity", 0.5);
    assert!(shown(&bench, "Custom"));
    click(&mut bench, "Gaussians");
    assert!(bench.shows("Gaussian centre") && !bench.shows("Point value"));
    bench.choose("Preset", "Default");
    assert_eq!(function(&bench), fresh);
    assert!(bench.shows("Point value") && !bench.shows("Gaussian centre"));
}

fn copied(bench: &mut Bench) -> String {
    bench.harness.event(Event::Copy);
    bench.harness.step();
    let commands = &bench.harness.output().platform_output.commands;
    let text = commands.iter().find_map(|command| match command {
        OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    });
    text.expect("something was copied")
}

#[test]
fn what_is_copied_can_be_pasted_and_other_text_is_refused() {
    let mut bench = Bench::opened();
    let before = function(&bench);
    let text = copied(&mut bench);
    assert_eq!(Design::from_text(&text).unwrap().function, before);
    click(&mut bench, "Gaussians");
    let bells = copied(&mut bench);
    assert!(bells.contains("\"gaussians\""), "{bells}");
    let with_bells = function(&bench);
    bench.harness.event(Event::Paste(text));
    bench.harness.run_steps(3);
    assert_eq!(function(&bench), before);
    undo(&mut bench);
    assert_eq!(function(&bench), with_bells);
    assert!(bench.shows("Gaussian centre"), "bells come back as such");
    bench.harness.event(Event::Paste("good morning".to_owned()));
    bench.harness.run_steps(3);
    let notice = &bench.window().notices().shown().last().expect("a bar").text;
    assert!(notice.contains("expected a transfer function as JSON"), "{notice}");
    assert_eq!(function(&bench), with_bells);
    // Text fields paste for themselves.
    press(&mut bench, Modifiers::COMMAND, Key::L);
    bench.harness.event(Event::Paste("/tmp/a.nrrd".to_owned()));
    bench.harness.run_steps(3);
    assert_eq!(bench.window().notices().shown().len(), 2, "the hint and the bar from before");
}

/// The ramp's values go from 0 to 511.
#[test]
fn a_transfer_function_of_other_values_says_so_and_how_to_fit_it() {
    let mut bench = Bench::opened();
    let pasted = |bench: &mut Bench, low: f64, high: f64| {
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [low, high] };
        let of = TransferFunction::of(vec![(low, 0.0), (high, 0.5)], colour);
        bench.harness.event(Event::Paste(Design::from(of).to_text()));
        bench.harness.run_steps(3);
        let notices = bench.window().notices().shown();
        notices.iter().any(|notice| notice.text.contains("this volume's go from 0 to 511"))
    };
    assert!(!pasted(&mut bench, 500.0, 900.0), "some of them");
    assert!(pasted(&mut bench, -3.0, -0.5));
    click(&mut bench, "Full range");
    assert_eq!(function(&bench).colour.range(), [0.0, 511.0]);
    assert_eq!(function(&bench).opacity, [(0.0, 0.0), (511.0, 0.5)]);
}

fn some_design() -> Design {
    let gaussians = vec![Gaussian { centre: 300.0, height: 0.25, width: 12.5 }];
    let stops = vec![(100.0, Srgb8([1, 2, 3])), (400.0, Srgb8([250, 200, 100]))];
    Design::of_gaussians(gaussians, ColourSource::Stops(stops)).expect("a design")
}

#[test]
fn a_transfer_function_is_saved_loaded_and_dropped() {
    let mut bench = Bench::opened();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("some.json");
    std::fs::write(&path, some_design().to_text()).unwrap();
    bench.drop_file(path.to_str().unwrap());
    bench.wait_until(|w| *w.scene().unwrap().transfer().unwrap() == some_design().function);
    assert_eq!(bench.window().document().unwrap().source.name(), "good.nrrd", "no other volume");
    assert!(!bench.window().settings().recent.contains(&path));

    click(&mut bench, "Save transfer function…");
    let saved = folder.path().join("saved.json");
    type_path(&mut bench, &saved);
    bench.wait_until(|window| !window.notices().shown().is_empty());
    assert_eq!(std::fs::read_to_string(&saved).unwrap(), some_design().to_text());

    bench.choose("Preset", "Default");
    assert_ne!(function(&bench), some_design().function);
    click(&mut bench, "Load transfer function…");
    type_path(&mut bench, &saved);
    bench.wait_until(|w| *w.scene().unwrap().transfer().unwrap() == some_design().function);

    let wrong = folder.path().join("wrong.json");
    std::fs::write(&wrong, "{\"format\": \"voxsplat transfer function\", \"version\": 9}").unwrap();
    bench.drop_file(wrong.to_str().unwrap());
    let refused = |text: &str| text.contains("found version 9") && text.ends_with("wrong.json");
    bench.wait_until(|w| w.notices().shown().iter().any(|notice| refused(&notice.text)));
    assert_eq!(function(&bench), some_design().function);
}

/// Types a path into the dialog that is open, and confirms.
fn type_path(bench: &mut Bench, path: &Path) {
    press(bench, Modifiers::COMMAND, Key::A);
    bench.harness.event(Event::Text(path.to_str().expect("UTF-8").to_owned()));
    bench.harness.run_steps(2);
    press(bench, Modifiers::NONE, Key::Enter);
}

#[test]
fn without_a_volume_there_is_no_transfer_function_to_exchange() {
    let mut bench = Bench::empty();
    bench.drop_file("some.json");
    bench.harness.run_steps(2);
    assert!(bench.shows("A transfer function belongs to a volume: open one first"));
    bench.harness.event(Event::Paste("x".to_owned()));
    bench.harness.event(Event::Copy);
    bench.harness.run_steps(2);
    assert_eq!(bench.window().notices().shown().len(), 1);
}

#[test]
fn the_graph_is_zoomed_counted_and_stretched_by_percentiles() {
    let mut bench = Bench::opened();
    bench.harness.get_by_label("Log").click();
    bench.set_slider("Low percentile", 25.0);
    bench.set_slider("High percentile", 75.0);
    bench.choose("Graph", "Between percentiles");
    let before = function(&bench);
    let rect = graph(&bench);
    bench.hover(at(rect, 0.5, 0.5));
    let label = bench.harness.get_by_label_contains("samples in its bin");
    let text = label.accesskit_node().value().unwrap_or_default();
    let value: f64 = text.split(':').next().unwrap().parse().unwrap();
    assert!((value - 255.5).abs() < 3.0 && text.contains(": 2 samples"), "{text}");
    bench.hover(at(rect.shrink(7.0), 0.0, 0.5));
    let label = bench.harness.get_by_label_contains("samples in its bin");
    let text = label.accesskit_node().value().unwrap_or_default();
    let value: f64 = text.split(':').next().unwrap().parse().unwrap();
    assert!((value - 128.0).abs() < 4.0, "the graph begins at the percentile: {text}");
    assert_eq!(function(&bench), before, "looking changes nothing");
    bench.harness.get_all_by_label("Percentiles").last().unwrap().click();
    bench.harness.run_steps(2);
    let [low, high] = function(&bench).colour.range();
    assert!((low - 128.0).abs() < 4.0 && (high - 383.0).abs() < 4.0, "{low} {high}");
}

#[test]
fn a_background_and_a_projection_survive_undo_of_each_other() {
    let mut bench = Bench::opened();
    press(&mut bench, Modifiers::NONE, Key::Num5);
    click(&mut bench, "Transparent");
    undo(&mut bench);
    bench.settle();
    let scene = &bench.last_request().scene;
    assert!(matches!(scene.camera.projection, Projection::Perspective { .. }));
    assert_eq!(scene.background, Background::Colour(Srgb8::BLACK));
}

#[test]
fn labels_are_listed_by_name_hidden_and_coloured_one_by_one() {
    let mut bench = Bench::opened();
    assert!(!bench.tells("Label "), "values of a ramp name nothing");
    bench.open("names.nrrd");
    bench.settle();
    let opacities = |bench: &Bench| {
        let transfer = bench.window().scene().unwrap().transfer().unwrap().clone();
        [0.0, 1.0, 3.0].map(|label| (transfer.opacity_at(label) * 100.0).round() / 100.0)
    };
    assert_eq!(opacities(&bench), [0.0, 0.9, 0.9]);
    bench.harness.get_by_role_and_label(Role::CheckBox, "heart shown").click();
    bench.settle();
    assert_eq!(opacities(&bench), [0.0, 0.0, 0.9]);
    bench.harness.get_by_role_and_label(Role::CheckBox, "Label 3 shown").click();
    bench.settle();
    assert_eq!(opacities(&bench), [0.0; 3]);
    bench.harness.get_by_role_and_label(Role::CheckBox, "heart shown").click();
    bench.settle();
    assert_eq!(opacities(&bench), [0.0, 0.9, 0.0]);
    assert!(bench.tells("heart colour") && !bench.tells("Label 0"));
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(opacities(&bench), [0.0; 3], "each is a step");
}

//! The window from outside: keys, mouse, widgets by their accessible names, with a stand-in for
//! the engine that draws gradients and one for the readers that knows a few names.

mod ui_annotations;
mod ui_find;
mod ui_hand;
mod ui_modes;
mod ui_probe;
mod ui_support;
mod ui_transfer;

use std::path::PathBuf;
use std::time::Duration;

use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, ViewportCommand, ViewportId, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use glam::DVec3;
use ui_support::{Bench, Painter, RAW_BYTES};
use voxsplat::app::actions::{ACTIONS, Action};
use voxsplat::app::camera_control::{framed, framed_along};
use voxsplat::app::compare::Display;
use voxsplat::app::document::Source;
use voxsplat::app::settings::Settings;
use voxsplat::core::{Projection, Srgb8};
use voxsplat::kernel::Kernel;
use voxsplat::scene::{
    AlongRay, Annotation, Background, NamedView, Orientation, SplatSettings, UpAxis,
};
use voxsplat::task::annotations::{draw, laid_out};
use voxsplat::task::engine::{Effort, Ladder};
use voxsplat::transfer::{ColourMap, ColourSource};
use voxsplat::volume::Component;

#[test]
fn a_volume_opens_and_is_asked_for_at_the_viewports_size() {
    let bench = Bench::opened();
    let request = bench.last_request();
    let viewport = bench.viewport();
    assert_eq!(request.size.map(|n| n as f32), [viewport.width(), viewport.height()]);
    assert_eq!(request.effort, bench.window().settings().effort_at_rest());
    assert_eq!(bench.window().document().unwrap().source.name(), "good.nrrd");
}

#[test]
fn an_idle_window_asks_for_nothing_and_repaints_nothing() {
    let mut bench = Bench::opened();
    let asked = bench.request_count();
    // Five seconds at sixty passes a second.
    for _ in 0..300 {
        bench.harness.step();
        let output = &bench.harness.output().viewport_output[&ViewportId::ROOT];
        assert_eq!(output.repaint_delay, Duration::MAX, "{:?}", bench.harness.ctx.repaint_causes());
    }
    assert_eq!(bench.request_count(), asked);
}

#[test]
fn a_left_drag_orbits_coarsely_and_refines_once_let_go() {
    let mut bench = Bench::opened();
    let before = bench.camera();
    let asked = bench.request_count();
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0));
    let moved = bench.requests_since(asked);
    assert!(!moved.is_empty());
    let budget_ms = bench.window().settings().budget_ms;
    for request in &moved {
        assert_eq!(request.effort, Effort::Moving { budget_ms });
    }
    let after = bench.camera();
    assert_eq!(after.focal_point, before.focal_point);
    // The front of the scene follows the hand to the right.
    let front = before.focal_point - before.direction;
    assert!(after.to_view(front).x > 0.0);

    let asked = bench.request_count();
    bench.settle();
    let rest = bench.requests_since(asked);
    assert_eq!(rest.len(), 1, "one request at rest");
    assert_eq!(rest[0].effort, bench.window().settings().effort_at_rest());
    assert_eq!(rest[0].scene.camera, after);
}

#[test]
fn another_series_of_a_folder_is_chosen_and_all_of_them_stay_to_be_chosen_among() {
    let mut bench = Bench::empty();
    bench.open("study");
    bench.settle();
    bench.choose("Series", "scout (8 slices)");
    bench.wait_until(|window| !window.is_loading());
    bench.settle();
    let document = bench.window().document().unwrap();
    assert_eq!(document.source, Source::File("study/scout.dcm".into()));
    let open: Vec<bool> = document.series.iter().map(|series| series.is_open).collect();
    assert_eq!(open, [true, false]);
    bench.choose("Series", "thorax (8 slices)");
    bench.wait_until(|window| !window.is_loading());
    bench.settle();
    let document = bench.window().document().unwrap();
    assert_eq!(document.source, Source::File("study/thorax.dcm".into()));
    assert!(bench.window().notices().shown().is_empty());
}

#[test]
fn a_file_that_is_alone_has_no_series_to_choose() {
    let bench = Bench::opened();
    assert!(!bench.tells("Series"));
}

#[test]
fn shift_left_and_middle_drags_move_the_volume_with_the_hand() {
    for (button, modifiers) in
        [(PointerButton::Primary, Modifiers::SHIFT), (PointerButton::Middle, Modifiers::NONE)]
    {
        let mut bench = Bench::opened();
        let before = bench.camera();
        bench.drag(button, modifiers, vec2(50.0, 0.0));
        let after = bench.camera();
        assert_eq!(after.direction, before.direction, "{button:?}");
        assert!(after.to_view(before.focal_point).x > 0.0, "{button:?}");
    }
}

#[test]
fn a_right_drag_upwards_comes_closer() {
    let mut bench = Bench::opened();
    let before = bench.camera();
    bench.drag(PointerButton::Secondary, Modifiers::NONE, vec2(0.0, -80.0));
    let after = bench.camera();
    assert!(after.parallel_scale < before.parallel_scale);
    assert!((after.focal_point - before.focal_point).length() < 1e-9, "about the centre");
}

#[test]
fn the_wheel_zooms_to_the_cursor() {
    let mut bench = Bench::opened();
    let before = bench.camera();
    let cursor = bench.viewport().lerp_inside(vec2(0.25, 0.25));
    bench.hover(cursor);
    bench.wheel(1.0);
    let after = bench.camera();
    assert!((before.parallel_scale / after.parallel_scale - 1.15).abs() < 1e-6);
    // What is up and left stays under the cursor, so the focal point moves there.
    let moved = before.to_view(after.focal_point);
    assert!(moved.x < 0.0 && moved.y > 0.0, "{moved}");
}

#[test]
fn the_wheel_over_the_side_panel_does_not_zoom() {
    let mut bench = Bench::opened();
    let before = bench.camera();
    bench.hover(bench.viewport().right_center() + vec2(100.0, 0.0));
    bench.wheel(1.0);
    assert_eq!(bench.camera(), before);
}

#[test]
fn a_double_click_puts_what_is_under_the_cursor_in_the_centre() {
    let mut bench = Bench::opened();
    let before = bench.camera();
    let at = bench.viewport().center() + vec2(100.0, 0.0);
    bench.double_click(at);
    let after = bench.camera();
    let height = f64::from(bench.viewport().height());
    let expected = before.right() * (100.0 / before.pixels_per_unit(height));
    assert!((after.focal_point - before.focal_point - expected).length() < 1e-6);
}

#[test]
fn every_shortcut_does_what_it_says() {
    for entry in &ACTIONS {
        let Some(shortcut) = entry.shortcut else { continue };
        let mut bench = Bench::opened();
        bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(40.0, 30.0));
        bench.settle();
        let before = bench.camera();
        let press = |bench: &mut Bench| {
            bench.harness.key_press_modifiers(shortcut.modifiers, shortcut.logical_key);
            bench.harness.run_steps(3);
        };
        let looks = |bench: &Bench, view: NamedView| {
            let camera = bench.camera();
            let (direction, up) = view.direction_and_up(Orientation::default());
            assert!((camera.direction - direction).length() < 1e-9, "{}", entry.name);
            assert!((camera.up - up).length() < 1e-9, "{}", entry.name);
        };
        press(&mut bench);
        match entry.action {
            Action::Open => {
                bench.wait_until(|window| {
                    window.document().is_some_and(|d| d.source.name() == "chosen.nrrd")
                });
            }
            Action::OpenPath => assert!(bench.shows("A file, or demo:NAME")),
            Action::OpenFolder | Action::RawLayout | Action::EmbedPolygons | Action::AddLabels => {
                unreachable!("it has no key")
            }
            Action::Find => assert!(bench.shows("What is looked for")),
            Action::SavePicture => assert!(bench.shows("Width in pixels")),
            Action::SaveScreenshot => {
                let path = bench.pictures.path().join("good_1.png");
                bench.wait_until(|window| !window.notices().shown().is_empty());
                let picture = bench.engine.newest();
                let mut rgba = picture.rgba.clone();
                let chosen = bench.window().settings().annotations;
                assert!(chosen.trihedron);
                let scene = bench.window().scene().unwrap();
                let layout = laid_out(chosen, scene, None, picture.size);
                draw(&mut rgba, picture.size, &layout.primitives);
                assert_eq!(image::open(path).unwrap().to_rgba8().into_raw(), rgba);
            }
            Action::Quit => {
                // The command leaves with the very pass in which the key went down.
                let mut bench = Bench::opened();
                assert!(bench.press_sends(shortcut, &ViewportCommand::Close));
            }
            Action::LoadTransfer
            | Action::SaveTransfer
            | Action::CopyTransfer
            | Action::PasteTransfer
            | Action::ToggleFade
            | Action::ShowFaded
            | Action::ShowVectors
            | Action::AddSlice
            | Action::AddIsosurface
            | Action::ToggleClipBox
            | Action::AddClipPlane
            | Action::AddLight
            | Action::MakeStreamlines
            | Action::About => unreachable!("it has no key"),
            Action::Undo => {
                assert!(bench.shows("There is nothing to undo"), "the view is no edit");
                let first = bench.window().settings().annotations;
                bench.harness.key_press(Key::T);
                bench.harness.run_steps(3);
                assert_ne!(bench.window().settings().annotations, first);
                press(&mut bench);
                assert_eq!(bench.window().settings().annotations, first);
                assert_eq!(bench.camera(), before);
            }
            Action::Redo => assert!(bench.shows("There is nothing to redo")),
            Action::PreviousView => {
                assert_ne!(bench.camera(), before);
                bench.harness.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
                bench.harness.run_steps(3);
                assert_eq!(bench.camera(), before);
            }
            Action::NextView => {
                assert!(bench.shows("There is no later view"));
                bench.harness.key_press_modifiers(Modifiers::ALT, Key::ArrowLeft);
                bench.harness.run_steps(3);
                assert_ne!(bench.camera(), before);
                press(&mut bench);
                assert_eq!(bench.camera(), before);
            }
            Action::ViewFront => looks(&bench, NamedView::Front),
            Action::ViewBack => looks(&bench, NamedView::Back),
            Action::ViewLeft => looks(&bench, NamedView::Left),
            Action::ViewRight => looks(&bench, NamedView::Right),
            Action::ViewBottom => looks(&bench, NamedView::Bottom),
            Action::ViewTop => looks(&bench, NamedView::Top),
            Action::ViewIsometric => looks(&bench, NamedView::Isometric),
            Action::RollLeft | Action::RollRight => {
                let camera = bench.camera();
                assert!((camera.direction - before.direction).length() < 1e-9);
                let left = if entry.action == Action::RollLeft { 1.0 } else { -1.0 };
                // What points up in the picture is now what pointed right, or left.
                assert!((camera.up - before.right() * left).length() < 1e-9, "{}", entry.name);
            }
            Action::TurnUpsideDown => {
                assert!((bench.camera().up + before.up).length() < 1e-9);
                assert_eq!(bench.window().scene().unwrap().up, Some(UpAxis::MinusZ));
                bench.harness.key_press(Key::Num1);
                bench.harness.run_steps(3);
                assert_eq!(bench.camera().up, DVec3::NEG_Z, "in every view");
            }
            Action::ToggleProjection => {
                let Projection::Perspective { view_angle } = bench.camera().projection else {
                    panic!("still orthographic");
                };
                assert!((view_angle.to_degrees() - 30.0).abs() < 1e-9);
                press(&mut bench);
                assert_eq!(bench.camera().projection, Projection::Orthographic);
            }
            Action::ResetView => {
                assert_ne!(before.direction, bench.camera().direction);
                let viewport = bench.viewport();
                let size = [viewport.width(), viewport.height()].map(f64::from);
                let scene = bench.window().scene().unwrap();
                let whole =
                    framed(scene, (NamedView::Isometric, Orientation::default()), size, false);
                assert_eq!(bench.camera(), whole);
            }
            Action::FitView => {
                let camera = bench.camera();
                assert!((camera.direction - before.direction).length() < 1e-9);
                assert!((camera.up - before.up).length() < 1e-9);
                let viewport = bench.viewport();
                let size = [viewport.width(), viewport.height()].map(f64::from);
                let scene = bench.window().scene().unwrap();
                let whole = framed_along(scene, (before.direction, before.up), size, false);
                assert_eq!(camera, whole);
            }
            Action::Converge => {
                bench.settle();
                let effort = bench.last_request().effort;
                let insists = matches!(
                    effort,
                    Effort::Rest { converge_ms, .. } if converge_ms == f64::INFINITY
                );
                assert!(insists, "{effort:?}");
            }
            Action::ToggleAnimation => {
                assert!(bench.shows("Vectors are what is animated, and this file has none"));
            }
            Action::ToggleLights => {
                assert!(bench.window().scene().unwrap().shading.lighting.is_some());
                press(&mut bench);
                assert!(bench.window().scene().unwrap().shading.is_plain());
            }
            Action::ToggleMaximum => {
                let along = |bench: &Bench| bench.window().scene().unwrap().inside.along;
                assert_eq!(along(&bench), AlongRay::Maximum);
                press(&mut bench);
                assert_eq!(along(&bench), AlongRay::Composite);
            }
            Action::ToggleEffects => {
                assert!(bench.shows("Opacity lookup"));
                press(&mut bench);
                assert!(!bench.shows("Opacity lookup"));
            }
            Action::ToggleScalarBar
            | Action::ToggleScaleBar
            | Action::ToggleAxes
            | Action::ToggleTrihedron => {
                let first = Settings::default().annotations;
                let which = Annotation::ALL.into_iter().find(|which| {
                    bench.window().settings().annotations.has(*which) != first.has(*which)
                });
                let name = which.expect("one is switched").name().replace('-', " ");
                assert_eq!(name, entry.name.to_lowercase());
                press(&mut bench);
                assert_eq!(bench.window().settings().annotations, first);
            }
            Action::ToggleCells => {
                assert!(bench.window().cells().on && bench.shows("Octree error"));
                press(&mut bench);
                assert!(!bench.window().cells().on && !bench.shows("Octree error"));
            }
            Action::ToggleProbe => {
                assert!(bench.window().probing().is_on());
                press(&mut bench);
                assert!(!bench.window().probing().is_on());
            }
            Action::EndTools => {
                for key in [Key::W, Key::P, Key::G] {
                    bench.harness.key_press(key);
                }
                bench.harness.run_steps(3);
                let window = bench.window();
                assert!(window.probing().is_on() && window.cells().on && levels(&bench));
                press(&mut bench);
                let window = bench.window();
                assert!(!window.probing().is_on() && !window.cells().on && !levels(&bench));
            }
            Action::ToggleLeveling => {
                let range =
                    |b: &Bench| b.window().scene().unwrap().transfer().unwrap().colour.range();
                let before = (bench.camera(), range(&bench));
                let by = vec2(-60.0, -40.0);
                bench.drag(PointerButton::Primary, Modifiers::NONE, by);
                assert_eq!(bench.camera(), before.0, "the view rests");
                let ([low, high], [old_low, old_high]) = (range(&bench), before.1);
                assert!(high - low < old_high - old_low, "a narrower window");
                assert!(low + high > old_low + old_high, "a higher level");
                press(&mut bench);
                bench.drag(PointerButton::Primary, Modifiers::NONE, by);
                assert_eq!(range(&bench), [low, high]);
                assert_ne!(bench.camera(), before.0);
            }
            Action::ToggleSidePanel => {
                assert!(!bench.shows("Extent"));
                press(&mut bench);
                assert!(bench.shows("Extent"));
            }
            Action::ToggleAccuracy => {
                assert!(bench.shows("Time against error"));
                press(&mut bench);
                assert!(!bench.shows("Time against error"));
            }
            Action::ToggleCompare => {
                assert!(bench.window().compare().on);
                press(&mut bench);
                assert!(!bench.window().compare().on);
            }
            Action::ToggleDifference => {
                assert_eq!(bench.window().compare().display, Display::Split);
                assert!(bench.shows("Differences are between two pictures: compare first, with C"));
                bench.harness.key_press(Key::C);
                press(&mut bench);
                assert_eq!(bench.window().compare().display, Display::Difference);
                press(&mut bench);
                assert_eq!(bench.window().compare().display, Display::Split);
            }
            Action::ToggleHelp => {
                assert!(bench.shows("Put what is under the cursor in the centre"));
                press(&mut bench);
                assert!(!bench.shows("Put what is under the cursor in the centre"));
            }
        }
    }
}

/// Whether a left drag would change window and level.
fn levels(bench: &Bench) -> bool {
    bench.window().leveling().on
}

/// Whether a menu with this entry is open.
fn is_listed(bench: &Bench, entry: &str) -> bool {
    bench.harness.query_all_by_label_contains(entry).next().is_some()
}

/// What is open, or is being typed in, is left first.
#[test]
fn escape_ends_tools_once_nothing_else_is_there_to_be_left() {
    let mut bench = Bench::opened();
    bench.harness.key_press(Key::W);
    bench.harness.run_steps(3);
    let escape = |bench: &mut Bench| {
        bench.harness.key_press(Key::Escape);
        bench.harness.run_steps(3);
    };
    for (menu, entry) in [("Edit", "Redo"), ("Help", "Keys and mouse")] {
        bench.harness.get_by_label(menu).click();
        bench.harness.run_steps(3);
        assert!(is_listed(&bench, entry), "{menu} is open");
        escape(&mut bench);
        assert!(levels(&bench) && !is_listed(&bench, entry), "{menu} was closed, and no more");
    }
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::L);
    bench.harness.run_steps(3);
    escape(&mut bench);
    // The text field was left, the dialog closed, or both.
    assert!(levels(&bench));
    escape(&mut bench);
    escape(&mut bench);
    assert!(!levels(&bench) && !bench.shows("A file, or demo:NAME"));
}

#[test]
fn steps_go_back_behind_menus_but_not_behind_dialogs() {
    let mut bench = Bench::opened();
    let annotations = |bench: &Bench| bench.window().settings().annotations;
    let before = annotations(&bench);
    let press = |bench: &mut Bench, modifiers: Modifiers, key: Key| {
        bench.harness.key_press_modifiers(modifiers, key);
        bench.harness.run_steps(3);
    };
    let undo = |bench: &mut Bench| press(bench, Modifiers::COMMAND, Key::Z);
    press(&mut bench, Modifiers::NONE, Key::B);
    let changed = annotations(&bench);
    bench.harness.get_by_label("Edit").click();
    bench.harness.run_steps(3);
    assert!(is_listed(&bench, "Redo"));
    undo(&mut bench);
    assert_eq!(annotations(&bench), before, "behind a menu");
    press(&mut bench, Modifiers::NONE, Key::Escape);
    press(&mut bench, Modifiers::COMMAND, Key::Y);
    assert_eq!(annotations(&bench), changed);
    press(&mut bench, Modifiers::NONE, Key::H);
    assert!(bench.shows("Put what is under the cursor in the centre"));
    undo(&mut bench);
    assert_eq!(annotations(&bench), changed, "behind the list of keys");
    assert!(bench.shows("Put what is under the cursor in the centre"));
    press(&mut bench, Modifiers::NONE, Key::Escape);
    // A path is being typed, and its own steps are meant.
    press(&mut bench, Modifiers::COMMAND, Key::L);
    undo(&mut bench);
    assert_eq!(annotations(&bench), changed, "while text is typed");
}

/// A window that no panel fits beside the picture keeps the picture; once wider, it is as before.
#[test]
fn tiny_windows_keep_their_menus_and_the_picture() {
    let mut bench = Bench::opened();
    assert!(bench.shows("Extent"));
    bench.harness.key_press(Key::A);
    bench.harness.set_size(vec2(200.0, 120.0));
    bench.harness.run_steps(20);
    assert!(!bench.shows("Extent") && !bench.shows("Side panel"));
    assert!(!bench.shows("Time against error"));
    let viewport = bench.viewport();
    assert!(viewport.width() > 190.0 && viewport.height() > 40.0, "{viewport:?}");
    let menus = ["File", "Edit", "Add", "View", "Camera", "Help"];
    let menus =
        menus.map(|name| bench.harness.get_all_by_label(name).next().expect("a menu").rect());
    for pair in menus.windows(2) {
        assert!(
            pair[0].right() <= pair[1].left() && pair[1].bottom() <= viewport.top(),
            "{pair:?}"
        );
    }
    bench.harness.set_size(vec2(1280.0, 2090.0));
    bench.harness.run_steps(20);
    assert!(
        bench.shows("Extent") && bench.shows("Side panel") && bench.shows("Time against error")
    );
}

/// The list of effects never covers the whole picture of a small window.
#[test]
fn the_effects_scroll_where_the_window_is_small() {
    let mut bench = Bench::opened();
    bench.harness.key_press(Key::E);
    bench.harness.run_steps(4);
    let covered = |bench: &Bench| bench.harness.get_by_label("Effects").rect();
    let whole = covered(&bench);
    bench.harness.set_size(vec2(640.0, 420.0));
    bench.harness.run_steps(20);
    let small = covered(&bench);
    assert!(small.width() < 0.75 * 640.0 && small.height() < 0.7 * 420.0, "{small:?} of {whole:?}");
    assert!(whole.width() > 500.0 && whole.height() > small.height(), "{whole:?}");
    assert!(bench.shows("Opacity lookup"));
}

#[test]
fn keys_that_are_being_typed_are_not_commands() {
    let mut bench = Bench::opened();
    let before = bench.camera();
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::L);
    bench.harness.run_steps(3);
    bench.harness.key_press(Key::Num1);
    bench.harness.key_press(Key::H);
    bench.harness.run_steps(3);
    assert_eq!(bench.camera(), before);
    assert!(!bench.shows("Put what is under the cursor in the centre"));
}

#[test]
fn a_bad_file_shows_a_bar_and_leaves_the_old_scene() {
    let mut bench = Bench::opened();
    let before = bench.window().scene().unwrap().clone();
    bench.open("bad.nrrd");
    assert!(bench.shows("Expected a header, found nonsense: bad.nrrd"));
    assert_eq!(bench.window().document().unwrap().source.name(), "good.nrrd");
    assert!(std::sync::Arc::ptr_eq(
        bench.window().scene().unwrap().volume().unwrap(),
        before.volume().unwrap()
    ));
    assert_eq!(bench.window().settings().recent, [absolute("good.nrrd")]);

    let dismiss = bench.harness.get_by_label("Dismiss").rect();
    assert!(dismiss.bottom() < bench.viewport().top() + 60.0, "a bar, not a curtain: {dismiss}");
    bench.harness.get_by_label("Dismiss").click();
    bench.harness.run_steps(2);
    assert!(!bench.shows("Expected a header, found nonsense: bad.nrrd"));
}

#[test]
fn a_reader_that_panics_is_told_as_a_bug_and_the_old_scene_stays() {
    let mut bench = Bench::opened();
    bench.open("panics.nrrd");
    assert!(bench.shows("Reading stopped on a bug of the program: panics.nrrd"));
    assert_eq!(bench.window().document().unwrap().source.name(), "good.nrrd");
}

#[test]
fn cancelling_a_load_returns_to_what_was_there() {
    let mut bench = Bench::opened();
    bench.start_opening("slow.nrrd");
    bench.harness.run_steps(3);
    assert!(bench.shows("Opening slow.nrrd"));
    bench.harness.get_by_label("Cancel").click();
    bench.wait_until(|window| !window.is_loading());
    assert_eq!(bench.window().document().unwrap().source.name(), "good.nrrd");
    assert!(bench.window().notices().shown().is_empty(), "a cancel is no trouble");
}

#[test]
fn while_the_first_file_is_read_the_middle_of_the_window_says_so() {
    let mut bench = Bench::empty();
    bench.start_opening("slow.nrrd");
    bench.harness.run_steps(4);
    let words = bench.harness.get_by_label("Opening slow.nrrd").rect();
    assert!((words.center().y - bench.viewport().center().y).abs() < 40.0, "{words}");
    bench.open("good.nrrd");
    bench.start_opening("slow.nrrd");
    bench.harness.run_steps(4);
    let words = bench.harness.get_by_label("Opening slow.nrrd").rect();
    assert!(words.top() < bench.viewport().top() + 40.0, "above what is open: {words}");
}

#[test]
fn a_new_load_replaces_one_under_way() {
    let mut bench = Bench::opened();
    bench.start_opening("slow.nrrd");
    bench.harness.run_steps(2);
    bench.open("other.nrrd");
    assert_eq!(bench.window().document().unwrap().source.name(), "other.nrrd");
}

#[test]
fn the_file_menu_begins_with_open_and_goes_on_with_recent_files_and_demos() {
    let mut bench = Bench::opened();
    bench.harness.get_by_label("File").click();
    bench.harness.run_steps(3);
    let names =
        ["Open…", "Open folder…", "Open path…", "Open recent", "Open demo", "Raw layout…", "Quit"];
    let tops = names.map(|name| {
        let node = bench.harness.get_all_by_label_contains(name).next();
        node.unwrap_or_else(|| panic!("{name} is in the menu")).rect().top()
    });
    assert!(tops.is_sorted_by(|a, b| a < b), "{tops:?}");
}

#[test]
fn menus_tick_what_is_on() {
    let mut bench = Bench::opened();
    let click_menu = |bench: &mut Bench| {
        // A section of the panel is called so, too.
        bench.harness.get_all_by_label("View").next().expect("the menu").click();
        bench.harness.run_steps(3);
    };
    let ticked = |bench: &mut Bench, name: &str| {
        click_menu(bench);
        // What has the same name in the panel comes before what lies over it.
        let nodes = bench.harness.get_all_by_label(name);
        let found = nodes.filter_map(|node| node.accesskit_node().toggled()).next_back();
        click_menu(bench);
        found.unwrap_or_else(|| panic!("{name} tells whether it is on"))
    };
    for (name, key) in [
        ("Scalar bar", Key::B),
        ("Scale bar", Key::S),
        ("Axes", Key::X),
        ("Trihedron", Key::T),
        ("Octree cells", Key::G),
        ("Window and level", Key::W),
        ("Perspective", Key::Num5),
        ("Accuracy panel", Key::A),
        ("Effects panel", Key::E),
        ("Compare two modes", Key::C),
        ("Show the difference", Key::D),
    ] {
        if key == Key::D {
            // There is one while two are compared.
            bench.harness.key_press(Key::C);
            bench.settle();
        }
        let before = ticked(&mut bench, name);
        bench.harness.key_press(key);
        bench.settle();
        let then = ticked(&mut bench, name);
        assert_ne!(before, then, "{name}");
        // The next one is asked of a window as before.
        bench.harness.key_press(key);
        bench.settle();
        assert_eq!(ticked(&mut bench, name), before, "{name}");
    }
}

#[test]
fn what_is_rarely_needed_is_closed_at_first_and_sections_stay_as_they_were_left() {
    let settings = |text: &str| serde_json::from_str::<Settings>(text).expect("settings");
    let mut bench = Bench::with_settings(settings("{}"));
    bench.open("good.nrrd");
    bench.settle();
    assert!(bench.shows("Splats") && !bench.shows("Reconstruction"), "closed at first");
    assert!(bench.shows("Polygons and labels") && !bench.shows("Add polygons…"), "closed at first");
    assert!(bench.shows("Data") && bench.shows("Dimensions"), "open at first");
    for title in ["Splats", "Data"] {
        bench.harness.get_by_label(title).click();
        bench.harness.run_steps(30);
    }
    assert!(bench.shows("Reconstruction") && !bench.shows("Dimensions"));
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.harness.run_steps(30);
    assert!(bench.shows("Reconstruction"), "what is open is no step to take back");
    let left = serde_json::to_string(bench.window().settings()).expect("text");
    let mut next = Bench::with_settings(settings(&left));
    next.open("good.nrrd");
    next.settle();
    assert!(next.shows("Reconstruction") && !next.shows("Dimensions"), "as they were left");
    assert!(!next.shows("Add polygons…") && next.shows("Background"), "the others as at first");
}

#[test]
fn much_that_is_to_be_known_of_a_file_is_listed_in_the_panel_rather_than_over_the_picture() {
    let mut bench = Bench::opened();
    assert!(!bench.tells("Notes on the file"));
    bench.open("noted.nrrd");
    bench.settle();
    assert!(bench.window().notices().shown().is_empty(), "they are in sight already");
    assert!(!bench.shows("the fourth thing to know"));
    bench.harness.get_by_label("Notes on the file (4)").click();
    bench.harness.run_steps(30);
    assert!(bench.shows("the first thing to know") && bench.shows("the fourth thing to know"));
    // Where no list is in sight one sentence says what there is.
    bench.harness.get_by_label("Data").click();
    bench.harness.run_steps(30);
    bench.open("good.nrrd");
    bench.settle();
    bench.open("noted.nrrd");
    bench.settle();
    let told: Vec<_> =
        bench.window().notices().shown().iter().map(|notice| notice.text.clone()).collect();
    assert_eq!(told, ["The first thing to know. And 3 more, under Data"]);
}

#[test]
fn opened_files_are_remembered_newest_first() {
    let mut bench = Bench::opened();
    bench.open("other.nrrd");
    bench.open("good.nrrd");
    let expected = [absolute("good.nrrd"), absolute("other.nrrd")];
    assert_eq!(bench.window().settings().recent, expected);
    bench.harness.get_by_label("File").click();
    bench.harness.run_steps(2);
    bench.harness.get_by_label_contains("Open recent").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_role_and_label(Role::Button, "other.nrrd").click();
    bench.harness.run_steps(2);
    bench.wait_until(|window| !window.is_loading());
    assert_eq!(bench.window().document().unwrap().source.name(), "other.nrrd");
}

#[test]
fn a_dropped_file_opens() {
    let mut bench = Bench::opened();
    bench.drop_file("other.nrrd");
    bench.wait_until(|window| !window.is_loading());
    assert_eq!(bench.window().document().unwrap().source.name(), "other.nrrd");
}

#[test]
fn a_typed_path_opens_and_enter_confirms() {
    let mut bench = Bench::opened();
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::L);
    bench.harness.run_steps(3);
    bench.harness.event(Event::Text("demo:shells".to_owned()));
    bench.harness.run_steps(2);
    bench.harness.key_press(Key::Enter);
    bench.harness.run_steps(3);
    bench.wait_until(|window| !window.is_loading());
    assert_eq!(bench.window().document().unwrap().source, Source::Demo("shells".to_owned()));
    assert!(!bench.shows("A file, or demo:NAME"));
}

#[test]
fn enter_saves_the_picture_and_ends_a_number_that_is_typed() {
    let mut bench = Bench::opened();
    bench.settle();
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
    bench.harness.run_steps(3);
    bench.harness.get_by_label("Width in pixels").click();
    bench.harness.run_steps(2);
    bench.harness.key_press(Key::Enter);
    bench.harness.run_steps(2);
    assert!(bench.shows("File to save"), "the number ends, the dialog stays");
    bench.harness.key_press(Key::Enter);
    bench.harness.run_steps(2);
    assert!(!bench.shows("File to save"), "saved");
}

#[test]
fn keys_without_a_modifier_do_nothing_behind_a_dialog() {
    let mut bench = Bench::opened();
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
    bench.harness.run_steps(3);
    let before = bench.camera();
    for key in [Key::Num1, Key::Num9, Key::Enter] {
        bench.harness.key_press(key);
        bench.harness.run_steps(2);
        assert_eq!(bench.camera(), before, "{key:?}");
    }
}

#[test]
fn a_missing_file_dialog_is_said_and_a_typed_path_offered() {
    let mut bench = Bench::without_file_dialog();
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::O);
    bench.harness.run_steps(2);
    bench.wait_until(|window| !window.notices().shown().is_empty());
    bench.harness.run_steps(2);
    assert!(bench.window().notices().shown()[0].text.contains("no desktop portal"));
    assert!(bench.shows("A file, or demo:NAME"));
}

#[test]
fn sliders_and_choices_change_the_scene() {
    let mut bench = Bench::opened();
    bench.set_slider("Extent", 2.5);
    assert_eq!(bench.window().scene().unwrap().splat.extent, Some(2.5));
    let extent = bench.harness.get_by_role_and_label(Role::Slider, "Extent");
    assert!(!extent.accesskit_node().is_disabled(), "the exact mode has one");
    // The exact mode stays the exact mode.
    let wide = SplatSettings { extent: Some(2.5), ..SplatSettings::EXACT };
    assert!(bench.last_request().scene.splat.makes_same_picture(&wide));
    bench.harness.get_by_label("Reset extent").click();
    bench.harness.run_steps(2);
    assert_eq!(bench.window().scene().unwrap().splat.extent, None);
    bench.set_slider("Opacity over", 10.0);
    assert_eq!(bench.window().scene().unwrap().splat.opacity_unit_distance, Some(10.0));
    bench.set_slider("Frame budget", 50.0);
    assert_eq!(bench.window().settings().budget_ms, 50.0);

    bench.choose("Kernel", "Nearest");
    assert_eq!(bench.window().scene().unwrap().splat.kernel, Kernel::Nearest);
    let extent = bench.harness.get_by_role_and_label(Role::Slider, "Extent");
    assert!(extent.accesskit_node().is_disabled(), "boxes have a size of their own");
    bench.choose("Colours", "Gray");
    let colour = bench.window().scene().unwrap().transfer().unwrap().colour.clone();
    assert!(matches!(colour, ColourSource::Map { map: ColourMap::Gray, .. }), "{colour:?}");
    bench.unfold("Advanced refinement");
    bench.choose("Coarse first", "Every fourth voxel");
    let Effort::Rest { ladder, .. } = bench.last_request().effort else { panic!("not at rest") };
    assert_eq!(ladder, Ladder::Subsampling);

    bench.harness.get_by_role_and_label(Role::Button, "Perspective").click();
    bench.harness.run_steps(2);
    bench.set_slider("View angle", 60.0);
    let Projection::Perspective { view_angle } = bench.camera().projection else {
        panic!("still orthographic");
    };
    assert!((view_angle.to_degrees() - 60.0).abs() < 1e-9);
    bench.harness.get_by_label("Transparent").click();
    bench.settle();
    assert_eq!(bench.last_request().scene.background, Background::Transparent);
}

#[test]
fn full_quality_while_moving_asks_for_rest_during_a_drag() {
    let mut bench = Bench::opened();
    bench.harness.get_by_label("Full quality while moving").click();
    bench.settle();
    let asked = bench.request_count();
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0));
    let moved = bench.requests_since(asked);
    assert!(!moved.is_empty());
    assert!(moved.iter().all(|request| matches!(request.effort, Effort::Rest { .. })));
}

#[test]
fn ranges_stretch_colours_and_opacities_and_the_default_is_a_choice() {
    let mut bench = Bench::opened();
    let fresh = bench.window().scene().unwrap().transfer().unwrap().clone();
    bench.harness.get_by_label("Full range").click();
    bench.settle();
    let transfer = bench.last_request().scene.transfer().unwrap().clone();
    let ColourSource::Map { range, .. } = transfer.colour else { panic!("custom colours") };
    let statistics = &bench.window().scene().unwrap().volume().unwrap().statistics;
    assert_eq!(range, [statistics.min, statistics.max]);
    assert_ne!(transfer.opacity, fresh.opacity, "the stand-in starts elsewhere");
    bench.choose("Preset", "Default");
    bench.settle();
    assert_eq!(*bench.last_request().scene.transfer().unwrap(), fresh);
}

#[test]
fn points_of_the_curve_are_added_moved_and_removed_by_hand() {
    let mut bench = Bench::opened();
    let points =
        |bench: &Bench| bench.window().scene().unwrap().transfer().unwrap().opacity.clone();
    let before = points(&bench);
    let curve = bench.harness.get_by_label("Opacity curve over the histogram").rect();
    let empty = Pos2::new(curve.left() + curve.width() * 0.2, curve.top() + 20.0);
    bench.double_click(empty);
    bench.harness.run_steps(2);
    assert_eq!(points(&bench).len(), before.len() + 1, "added by a double click");

    let added = points(&bench);
    bench.drag_from(empty, PointerButton::Primary, Modifiers::NONE, vec2(20.0, 30.0));
    let moved = points(&bench);
    assert_eq!(moved.len(), added.len(), "{added:?} {moved:?}");
    let changed: Vec<_> = moved.iter().zip(&added).filter(|(a, b)| a != b).collect();
    let [(to, from)] = changed[..] else { panic!("{changed:?}") };
    assert!(to.0 > from.0 && to.1 < from.1, "right and down: {from:?} to {to:?}");

    bench.click(empty + vec2(20.0, 30.0), PointerButton::Secondary);
    assert_eq!(points(&bench), before, "removed by a right click");

    bench.double_click(empty);
    bench.harness.run_steps(2);
    bench.drag_from(empty, PointerButton::Primary, Modifiers::NONE, vec2(0.0, -120.0));
    assert_eq!(points(&bench), before, "removed by pulling it out");
}

#[test]
fn the_side_panel_keeps_its_width_whatever_it_shows() {
    let mut bench = Bench::empty();
    let before = bench.viewport();
    bench.open("good.nrrd");
    assert_eq!(bench.viewport(), before);
    bench.open("vector.nrrd");
    bench.set_slider("Point value", 123.456_78);
    bench.set_slider("Extent", 2.5);
    bench.set_slider("Opacity over", 0.012_345_678);
    assert_eq!(bench.viewport(), before);
}

#[test]
fn the_selected_point_can_be_typed() {
    let mut bench = Bench::opened();
    bench.harness.get_by_label("Next point").click();
    bench.harness.run_steps(2);
    bench.set_slider("Point opacity", 0.25);
    assert_eq!(bench.window().scene().unwrap().transfer().unwrap().opacity[1].1, 0.25);
}

#[test]
fn a_vectors_component_can_be_chosen_and_the_view_stays() {
    let mut bench = Bench::opened();
    bench.open("vector.nrrd");
    assert_eq!(bench.window().document().unwrap().component, Component::Magnitude);
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(40.0, 30.0));
    bench.settle();
    let before = bench.camera();
    bench.choose("Component", "y");
    bench.wait_until(|window| !window.is_loading());
    assert_eq!(bench.window().document().unwrap().component, Component::Index(1));
    assert_eq!(bench.window().scene().unwrap().volume().unwrap().name, "v[1]");
    assert_eq!(bench.camera(), before);
}

#[test]
fn an_unknown_file_is_asked_about_and_opens_as_told() {
    let mut bench = Bench::opened();
    bench.open("mystery.bin");
    assert!(bench.shows("nobody knows this content: mystery.bin"));
    assert_eq!(bench.window().document().unwrap().source.name(), "good.nrrd");
    let open = |bench: &Bench| {
        bench.harness.get_by_role_and_label(Role::Button, "Open").accesskit_node().is_disabled()
    };
    // 4 × 4 × 4 bytes are guessed and fit.
    assert!(!open(&bench));
    bench.set_slider("Dimension x", 40.0);
    assert!(open(&bench), "more than the file holds");
    assert!(
        bench.harness.query_by_label_contains("This does not fit").is_some(),
        "the reason is on screen"
    );
    bench.set_slider("Dimension x", 2.0);
    bench.set_slider("Bytes to skip", 8.0);
    assert!(!open(&bench));
    bench.harness.get_by_role_and_label(Role::Button, "Open").click();
    bench.harness.run_steps(3);
    bench.wait_until(|window| !window.is_loading());
    let Source::Raw(path, layout) = &bench.window().document().unwrap().source else {
        panic!("not opened as raw");
    };
    assert_eq!((path, layout.dims, layout.skip_bytes), (&"mystery.bin".into(), [2, 4, 4], 8));
    assert_eq!(RAW_BYTES, 64);
}

#[test]
fn the_raw_preview_follows_the_slice() {
    let mut bench = Bench::opened();
    bench.open("mystery.bin");
    bench.set_slider("Slice", 3.0);
    for _ in 0..200 {
        if bench.slices().last() == Some(&3) {
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
        bench.harness.step();
    }
    panic!("slice 3 was never read: {:?}", bench.slices());
}

#[test]
fn a_picture_is_saved_at_twice_the_viewport_with_or_without_background() {
    for without_background in [false, true] {
        let mut bench = Bench::opened();
        bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
        bench.harness.run_steps(3);
        if without_background {
            bench.harness.get_by_label("Draw the background").click();
            bench.harness.run_steps(2);
        }
        bench.harness.get_by_role_and_label(Role::Button, "Save").click();
        bench.harness.run_steps(2);
        bench.wait_until(|window| !window.notices().shown().is_empty());
        let saved = bench.saved();
        let viewport = bench.viewport();
        let size = [viewport.width(), viewport.height()];
        assert_eq!(saved.size.map(|n| n as f32), size.map(|n| 2.0 * n));
        assert_eq!(saved.path, bench.pictures.path().join("good.png"));
        let background = saved.scene.background;
        assert_eq!(background == Background::Transparent, without_background);
        assert_eq!(saved.scene.camera, bench.camera());
    }
}

#[test]
fn the_file_menu_says_what_cannot_be_done_yet() {
    let mut bench = Bench::empty();
    bench.harness.key_press(Key::F12);
    bench.harness.run_steps(2);
    assert!(bench.shows("There is no picture on screen yet"));
    assert!(bench.shows("Nothing is open"));
}

#[test]
fn the_pictures_bytes_reach_the_screen_unchanged() {
    let each = [1.0_f32, 1.5].into_iter().flat_map(|scale| Painter::BOTH.map(|by| (scale, by)));
    for (scale, by) in each {
        let mut bench = Bench::rendered(scale, by);
        let picture = bench.engine.newest();
        assert_eq!(picture.size, picture.requested_size);
        let viewport = bench.viewport();
        let screen = bench.harness.render().expect("a software adapter is installed");
        let corner = [viewport.left(), viewport.top()].map(|c| (c * scale).round() as u32);
        let mut compared = 0_u32;
        let mut worst = 0_u8;
        // The trihedron stands in the lower left corner.
        for y in (0..picture.size[1] * 2 / 3).step_by(3) {
            for x in (0..picture.size[0]).step_by(2) {
                let at = ((y * picture.size[0] + x) * 4) as usize;
                let shown = screen.get_pixel(corner[0] + x, corner[1] + y).0;
                for (sent, shown) in picture.rgba[at..at + 3].iter().zip(shown) {
                    worst = worst.max(sent.abs_diff(shown));
                }
                compared += 1;
            }
        }
        assert!(compared > 10_000, "{compared}");
        assert_eq!(worst, 0, "at {scale} pixels a point, by {by:?}");
    }
}

/// Bytes that are more than `levels` apart, as a share of all.
fn share_apart(one: &image::RgbaImage, other: &image::RgbaImage, levels: u8) -> f64 {
    assert_eq!(one.dimensions(), other.dimensions());
    let bytes = one.as_raw().iter().zip(other.as_raw());
    bytes.filter(|(a, b)| a.abs_diff(**b) > levels).count() as f64 / one.as_raw().len() as f64
}

/// What was painted onto nothing, on the colour that the window begins with.
fn on_panel(mut screen: image::RgbaImage) -> image::RgbaImage {
    let [r, g, b, _] = voxsplat::app::theme::PANEL.to_array();
    for pixel in screen.pixels_mut() {
        let rest = u16::from(255 - pixel.0[3]);
        for (channel, behind) in pixel.0.iter_mut().zip([r, g, b, 255]) {
            *channel += u8::try_from((u16::from(behind) * rest + 127) / 255).expect("a byte");
        }
    }
    screen
}

/// Without a graphics processor the window is the same: words, lines, graphs, menus, half transparent ones too.
#[test]
fn the_processor_paints_what_an_adapter_paints() {
    for scale in [1.0_f32, 1.5] {
        let shots = Painter::BOTH.map(|by| {
            let mut bench = Bench::rendered(scale, by);
            let plain = bench.harness.render().expect("a software adapter is installed");
            bench.harness.key_press(Key::H);
            bench.settle();
            let help = bench.harness.render().expect("a software adapter is installed");
            [plain, help]
        });
        let [adapter, processor] = &shots;
        let adapter = &adapter.clone().map(on_panel);
        for (one, other) in adapter.iter().zip(processor) {
            // Measured: none beyond 2 levels, where words fade in over a shadow; 0.6 % of the bytes at all.
            assert_eq!(share_apart(one, other, 2), 0.0, "at {scale}");
            let apart = share_apart(one, other, 0);
            assert!(apart <= 1e-2, "at {scale}: {apart}");
        }
        // The comparison sees a window that is a pixel off, and one with other words in it.
        let mut moved = processor[0].clone();
        image::imageops::replace(&mut moved, &processor[0], 1, 0);
        assert!(share_apart(&adapter[0], &moved, 3) > 1e-2);
        assert!(share_apart(&adapter[1], &processor[0], 3) > 1e-2);
    }
}

#[test]
fn habits_survive_and_volumes_do_not() {
    let mut bench = Bench::opened();
    bench.set_slider("Frame budget", 80.0);
    let mut storage = ui_support::Storage::default();
    eframe::App::save(bench.harness.state_mut(), &mut storage);
    let stored = voxsplat::app::Window::stored_settings(Some(&storage));
    assert_eq!(stored.budget_ms, 80.0);
    assert_eq!(stored.recent, [absolute("good.nrrd")]);
    assert_eq!(stored.background, Settings::default().background);
    let text = storage.text();
    assert!(!text.contains("samples"), "{text}");
}

#[test]
fn a_first_view_looks_at_the_middle_before_black() {
    let bench = Bench::opened();
    assert_eq!(bench.camera().focal_point, DVec3::splat(3.5));
    assert_eq!(bench.last_request().scene.background, Background::Colour(Srgb8::BLACK));
}

fn absolute(name: &str) -> PathBuf {
    std::path::absolute(name).expect("there is a working folder")
}

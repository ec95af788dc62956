//! The hand on the view and on what lies over it: what is up, rolling, the trihedron, slices, ranges of projections; and
//! what must not be lost by a key or a click.

use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use glam::DVec3;
use voxsplat::app::camera_control::Turning;
use voxsplat::scene::annotations::AxisEnd;
use voxsplat::scene::{AlongRay, NamedView, Orientation, Slice, UpAxis, View, projected_range};
use voxsplat::task::annotations::laid_out;
use voxsplat::transfer::{ColourMap, ColourSource, Design, TransferFunction};

use crate::ui_support::Bench;

fn press(bench: &mut Bench, modifiers: Modifiers, key: Key) {
    bench.harness.key_press_modifiers(modifiers, key);
    bench.harness.run_steps(3);
}

#[test]
fn a_turntable_keeps_up_what_is_up_and_a_trackball_does_not() {
    let mut bench = Bench::opened();
    assert_eq!(bench.window().settings().turning, Turning::Turntable, "at first");
    let by = [vec2(90.0, 30.0), vec2(-40.0, -70.0), vec2(10.0, 2000.0)];
    for by in by {
        bench.drag(PointerButton::Primary, Modifiers::NONE, by);
        let camera = bench.camera();
        assert!(camera.right().z.abs() < 1e-6 && camera.up.z > 0.0, "{}", camera.up);
    }
    assert!((bench.camera().direction + DVec3::Z).length() < 1e-3, "from above, and no further");
    bench.harness.get_by_label("Trackball").click();
    bench.settle();
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(90.0, 30.0));
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(-40.0, 70.0));
    let rolled = bench.camera();
    assert!(rolled.right().z.abs() > 1e-3, "any way round");
    bench.harness.get_by_label("Turntable").click();
    bench.settle();
    let level = bench.camera();
    assert!(level.right().z.abs() < 1e-6 && level.direction == rolled.direction, "level again");
}

/// A slow pass may hold the way to the place where the button was pressed.
#[test]
fn a_pointer_that_jumps_and_presses_within_one_pass_turns_nothing() {
    let mut bench = Bench::opened();
    let (before, viewport) = (bench.camera(), bench.viewport());
    bench.hover(viewport.center() - vec2(200.0, 150.0));
    let at = viewport.center();
    let press = |pressed| Event::PointerButton {
        pos: at,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    bench.harness.input_mut().events.extend([Event::PointerMoved(at), press(true)]);
    bench.harness.step();
    assert_eq!(bench.camera(), before, "the hand has not moved since it pressed");
    bench.harness.event(Event::PointerMoved(at + vec2(30.0, 0.0)));
    bench.harness.step();
    assert_ne!(bench.camera(), before, "now it has");
    bench.harness.event(press(false));
    bench.settle();
}

/// Nothing on screen said how to turn the view, or where the keys are.
#[test]
fn the_first_picture_says_how_to_take_hold_of_it_until_somebody_does() {
    let words = "Drag to turn · wheel to zoom · press H for all keys";
    let mut bench = Bench::opened();
    assert!(bench.shows(words) && !bench.window().settings().knows_drag);
    // The hand goes through it.
    let before = bench.camera();
    let at = bench.harness.get_by_label(words).rect().center();
    bench.drag_from(at, PointerButton::Primary, Modifiers::NONE, vec2(60.0, -20.0));
    assert_ne!(bench.camera(), before);
    assert!(bench.window().settings().knows_drag, "kept for later runs");
    bench.harness.run_steps(120);
    assert!(!bench.shows(words));
    bench.open("other.mha");
    bench.settle();
    assert!(!bench.shows(words), "said once");
}

#[test]
fn a_drag_with_ctrl_rolls_the_picture_about_its_middle() {
    let mut bench = Bench::opened();
    let (before, viewport) = (bench.camera(), bench.viewport());
    let at = viewport.center() + vec2(0.0, -120.0);
    bench.drag_from(at, PointerButton::Primary, Modifiers::COMMAND, vec2(120.0, 120.0));
    let after = bench.camera();
    assert!((after.direction - before.direction).length() < 1e-9);
    // From above the middle to its right: a quarter clockwise.
    let top = before.focal_point + before.up;
    let seen = after.to_view(top) - after.to_view(before.focal_point);
    assert!(seen.x > 0.9 && seen.y.abs() < 0.3, "the top follows the hand: {seen}");
}

#[test]
fn an_axis_is_chosen_to_be_up_for_the_session_and_taken_back() {
    let mut bench = Bench::opened();
    let own = Orientation::default();
    let isometric = |orientation| NamedView::Isometric.direction_and_up(orientation);
    press(&mut bench, Modifiers::NONE, Key::Num9);
    bench.choose("Up axis", "+y");
    let chosen = own.with_up(Some(UpAxis::PlusY));
    let (direction, up) = isometric(chosen);
    let camera = bench.camera();
    assert!((camera.direction - direction).length() < 1e-9, "the same side is seen");
    assert!((camera.up - up).length() < 1e-9);
    press(&mut bench, Modifiers::NONE, Key::Num1);
    assert_eq!((bench.camera().direction, bench.camera().up), (DVec3::NEG_Z, DVec3::Y));
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(90.0, 30.0));
    assert!(bench.camera().right().y.abs() < 1e-9, "turned about it");
    bench.open("other.mha");
    bench.settle();
    assert_eq!(bench.window().scene().unwrap().up, Some(UpAxis::PlusY), "for the session");
    assert!((bench.camera().up - up).length() < 1e-9, "and what is opened is seen so");
    bench.choose("Up axis", "Not stated (+z)");
    assert_eq!(bench.window().scene().unwrap().up, None);
    assert!((bench.camera().up - isometric(own).1).length() < 1e-9);
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    assert_eq!(bench.window().scene().unwrap().up, Some(UpAxis::PlusY), "a step of its own");
}

#[test]
fn a_click_on_an_end_of_the_trihedron_looks_from_there_and_again_from_the_other_side() {
    let mut bench = Bench::opened();
    let ends = |bench: &Bench| -> Vec<AxisEnd> {
        let annotations = bench.window().settings().annotations;
        let scene = bench.window().scene().unwrap();
        laid_out(annotations, scene, None, bench.last_request().size).axis_ends
    };
    let click = |bench: &mut Bench, axis: usize, is_positive: bool| {
        let end = ends(bench)
            .into_iter()
            .find(|end| end.axis == axis && end.is_positive == is_positive)
            .expect("it is shown");
        let at = end.at.as_vec2();
        let viewport = bench.viewport();
        let scale = viewport.width() / bench.last_request().size[0] as f32;
        bench.click(viewport.min + vec2(at.x, at.y) * scale, PointerButton::Primary);
        bench.settle();
    };
    click(&mut bench, 0, true);
    assert_eq!((bench.camera().direction, bench.camera().up), (DVec3::NEG_X, DVec3::Z));
    click(&mut bench, 0, true);
    assert_eq!(bench.camera().direction, DVec3::X, "from the other side");
    click(&mut bench, 2, true);
    assert_eq!((bench.camera().direction, bench.camera().up), (DVec3::NEG_Z, DVec3::Y), "the top");
    click(&mut bench, 1, false);
    assert_eq!(bench.camera().direction, DVec3::Y, "an end that is not drawn");
    bench.harness.check_accessibility();
}

/// Passes of a second and more.
const A_REST: usize = 90;

#[test]
fn undo_right_after_opening_asks_before_it_takes_the_file_away() {
    let mut bench = Bench::opened();
    bench.open("other.mha");
    bench.settle();
    let name = |bench: &Bench| bench.window().document().unwrap().source.name();
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    assert_eq!(name(&bench), "other.mha", "nothing was changed, and nothing is taken away");
    let said = bench.window().notices().shown().last().unwrap().text.clone();
    assert!(said.contains("other.mha") && said.contains("go back to good.nrrd"), "{said}");
    for _ in 0..3 {
        press(&mut bench, Modifiers::COMMAND, Key::Z);
        assert_eq!(name(&bench), "other.mha", "keys of one burst are not meant for the file");
    }
    bench.harness.run_steps(A_REST);
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    assert_eq!(name(&bench), "good.nrrd", "who asks again gets it");
    press(&mut bench, Modifiers::COMMAND, Key::Y);
    assert_eq!(name(&bench), "other.mha");
    // The menu says what it does, and does it.
    bench.harness.get_by_label("Edit").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_role_and_label(Role::Button, "Undo").click();
    bench.settle();
    assert_eq!(name(&bench), "good.nrrd");
}

#[test]
fn letters_typed_while_a_dialog_is_coming_are_its_own() {
    let mut bench = Bench::opened();
    let before = bench.window().settings().annotations;
    let key = |key, modifiers| Event::Key {
        key,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers,
    };
    // A quick hand: the path begins in the very pass that the dialog is asked for in.
    let events = &mut bench.harness.input_mut().events;
    events.push(key(Key::L, Modifiers::COMMAND));
    for (letter, text) in [(Key::B, "b"), (Key::X, "x"), (Key::T, "t")] {
        events.push(key(letter, Modifiers::NONE));
        events.push(Event::Text(text.to_owned()));
    }
    bench.harness.run_steps(3);
    assert_eq!(bench.window().settings().annotations, before, "no command");
    bench.harness.event(Event::Text("1.nrrd".to_owned()));
    bench.harness.run_steps(3);
    press(&mut bench, Modifiers::NONE, Key::Enter);
    bench.wait_until(|window| window.document().is_some_and(|d| d.source.name() == "bxt1.nrrd"));
}

#[test]
fn a_click_beside_a_dialog_loses_nothing_that_was_typed() {
    let mut bench = Bench::opened();
    press(&mut bench, Modifiers::COMMAND, Key::L);
    bench.harness.event(Event::Text("long/path.nrrd".to_owned()));
    bench.harness.run_steps(3);
    let beside = bench.viewport().left_top() + vec2(60.0, 60.0);
    bench.click(beside, PointerButton::Primary);
    assert!(bench.shows("A file, or demo:NAME"), "it stays");
    press(&mut bench, Modifiers::NONE, Key::Escape);
    press(&mut bench, Modifiers::NONE, Key::Escape);
    assert!(!bench.shows("A file, or demo:NAME"), "Escape leaves it");
    press(&mut bench, Modifiers::NONE, Key::H);
    assert!(bench.shows("Turn the volume"));
    bench.click(beside, PointerButton::Primary);
    assert!(!bench.shows("Turn the volume"), "where nothing is typed, a click beside closes");
}

#[test]
fn the_key_list_fits_a_usual_window_and_a_small_one_shows_that_there_is_more() {
    let mut bench = Bench::opened();
    bench.harness.set_size(vec2(1280.0, 720.0));
    press(&mut bench, Modifiers::NONE, Key::H);
    bench.harness.run_steps(3);
    let last = "Show or hide this list of all keys and mouse buttons";
    let place = |bench: &Bench| bench.harness.get_by_label(last).rect();
    let close = bench.harness.get_by_label("Close").rect();
    let end = place(&bench);
    assert!(end.bottom() < close.top() && close.bottom() < 720.0, "{end} above {close}");
    assert!(end.right() < 1280.0, "{end}");
    bench.harness.set_size(vec2(700.0, 420.0));
    bench.harness.run_steps(4);
    let close = bench.harness.get_by_label("Close").rect();
    assert!(close.bottom() < 420.0, "the button stays in sight: {close}");
}

#[test]
fn a_view_of_everything_stays_one_however_wide_the_window_and_one_that_was_moved_stays_as_it_is() {
    let mut bench = Bench::opened();
    let per_shape = |bench: &Bench| {
        let viewport = bench.viewport();
        bench.camera().parallel_scale / f64::from(viewport.height() / viewport.width()).max(1.0)
    };
    let before = per_shape(&bench);
    for size in [[700.0, 900.0], [900.0, 300.0], [1280.0, 2090.0]] {
        bench.harness.set_size(size.into());
        bench.settle();
        let now = per_shape(&bench);
        assert!((now / before - 1.0).abs() < 0.01, "{size:?}: {now} rather than {before}");
    }
    press(&mut bench, Modifiers::ALT, Key::ArrowLeft);
    assert!(bench.shows("There is no earlier view"));
    bench.wheel(2.0);
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(20.0, 0.0));
    let moved = bench.camera();
    bench.harness.set_size(vec2(700.0, 900.0));
    bench.settle();
    assert_eq!(bench.camera(), moved);
}

#[test]
fn a_window_that_is_too_narrow_for_the_side_panel_says_so() {
    let mut bench = Bench::opened();
    bench.harness.set_size(vec2(500.0, 700.0));
    bench.harness.run_steps(4);
    let button = bench.harness.get_by_role_and_label(Role::Button, "Side panel");
    assert!(button.accesskit_node().is_disabled());
    bench.harness.key_press(Key::F9);
    bench.harness.run_steps(4);
    assert!(bench.tells("too narrow for the side panel") && bench.window().settings().side_panel);
}

/// Key 9 showed the left side of patients, where key 3 shows their right.
#[test]
fn the_corner_is_that_of_the_front_the_right_and_the_top() {
    for space in [None, Some("LPS"), Some("RAS")] {
        let along = |view: NamedView| view.direction_and_up(Orientation::of(space)).0;
        for side in [NamedView::Front, NamedView::Right, NamedView::Top] {
            assert!(along(NamedView::Isometric).dot(along(side)) > 0.5, "{space:?}, {side:?}");
        }
    }
}

#[test]
fn the_first_slice_is_across_what_is_looked_along() {
    let mut bench = Bench::opened();
    press(&mut bench, Modifiers::NONE, Key::Num3);
    bench.harness.get_by_label("Add slice").click();
    bench.settle();
    let scene = bench.last_request().scene;
    let normal = scene.inside.slices[0].plane.normal;
    assert!(normal.dot(scene.camera.direction).abs() > 0.99, "{normal}");
}

#[test]
fn about_names_the_papers_and_what_draws() {
    let mut bench = Bench::opened();
    bench.harness.get_by_label("Help").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_label("About Voxsplat").click();
    bench.harness.run_steps(4);
    for part in
        [env!("CARGO_PKG_VERSION"), "Westover", "Laur and Hanrahan", "Crawfis and Max", "Jang"]
    {
        assert!(bench.tells(part), "{part}");
    }
    bench.harness.get_by_label("Close").click();
    bench.harness.run_steps(4);
    assert!(!bench.tells("Westover"));
}

#[test]
fn a_path_that_could_not_be_opened_is_there_to_be_corrected() {
    let mut bench = Bench::opened();
    let begins_with = |bench: &mut Bench| {
        press(bench, Modifiers::COMMAND, Key::L);
        let field = bench.harness.get_by_label("A file, or demo:NAME");
        let begins_with = field.accesskit_node().value();
        press(bench, Modifiers::NONE, Key::Escape);
        bench.harness.run_steps(4);
        press(bench, Modifiers::NONE, Key::Escape);
        bench.harness.run_steps(4);
        begins_with.unwrap_or_default()
    };
    bench.open("folder/bad.nrrd");
    assert_eq!(begins_with(&mut bench), "folder/bad.nrrd");
    bench.open("good.nrrd");
    assert_eq!(begins_with(&mut bench), "");
}

#[test]
fn a_file_that_has_vectors_beside_its_values_says_so() {
    let mut bench = Bench::opened();
    bench.open("triples.nrrd");
    assert!(bench.tells("has vectors, too: wind"));
    bench.harness.get_by_role_and_label(Role::Button, "Show the vectors").click();
    bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.vectors().is_empty()));
    bench.harness.run_steps(3);
    assert!(!bench.tells("has vectors, too"), "done");
    bench.open("vector.nrrd");
    assert!(!bench.tells("has vectors, too"), "they are seen");
}

#[test]
fn a_projection_of_a_scan_is_grey_until_colours_are_chosen() {
    let mut bench = Bench::opened();
    let is_grey = |bench: &Bench| {
        let drawn = bench.last_request().scene.drawn_transfer().expect("one").into_owned();
        matches!(drawn.colour, ColourSource::Map { map: ColourMap::Gray, .. })
    };
    bench.choose("Rendering", "Maximum (MIP)");
    assert!(is_grey(&bench));
    bench.harness.get_by_label("In grey").click();
    bench.settle();
    assert!(!is_grey(&bench));
    bench.choose("Rendering", "Volume");
    bench.choose("Colours", "Magma");
    bench.choose("Rendering", "Average");
    assert!(!is_grey(&bench));
}

#[test]
fn a_projection_has_a_range_of_its_own_that_can_be_set() {
    let mut bench = Bench::opened();
    let range = |bench: &Bench| bench.last_request().scene.inside.projected_range;
    let own = |bench: &Bench, along| {
        projected_range(bench.window().scene().unwrap().volume().unwrap(), along)
    };
    bench.choose("Rendering", "Maximum (MIP)");
    assert_eq!(range(&bench), own(&bench, AlongRay::Maximum));
    assert!(range(&bench).is_some());
    bench.choose("Rendering", "Average");
    assert_eq!(range(&bench), own(&bench, AlongRay::Average));
    bench.set_slider("Range to", 400.0);
    assert_eq!(range(&bench).unwrap()[1], 400.0);
    // Window and level are those of what is seen.
    let before = bench.window().scene().unwrap().transfer().unwrap().clone();
    press(&mut bench, Modifiers::NONE, Key::W);
    let shown = range(&bench).unwrap();
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(-30.0, -40.0));
    bench.settle();
    assert_ne!(range(&bench).unwrap(), shown);
    assert_eq!(bench.window().scene().unwrap().transfer(), Some(&before));
    press(&mut bench, Modifiers::NONE, Key::W);
    bench.harness.get_by_label("Fit the range").click();
    bench.settle();
    assert_eq!(range(&bench), own(&bench, AlongRay::Average));
    bench.choose("Rendering", "Volume");
    assert_eq!(range(&bench), None);
}

#[test]
fn a_slice_shows_its_section_whole_at_first_and_is_dragged_by_its_handle() {
    let mut bench = Bench::opened();
    let dense = bench.last_request().scene.transfer().cloned();
    bench.harness.get_by_label("Add slice").click();
    bench.settle();
    let slice = |bench: &Bench| -> Slice { bench.last_request().scene.inside.slices[0] };
    assert!(!slice(&bench).only_shown);
    let scene = bench.last_request().scene;
    assert_eq!(scene.little_seen_of_slice(&slice(&bench)), None, "what hid it is faint");
    assert!(
        scene.inside.is_faded && bench.shows("The volume would hide the slice, so it was faded")
    );
    assert_eq!(scene.transfer(), dense.as_ref(), "the curve stays");
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    let scene = bench.window().scene().expect("something is open");
    assert!(scene.inside.slices.is_empty() && !scene.inside.is_faded, "one step");
    assert!(!bench.shows("The volume would hide the slice, so it was faded"), "nothing is faded");
    press(&mut bench, Modifiers::COMMAND, Key::Y);
    bench.harness.get_all_by_label("Show the volume again").next().expect("a button").click();
    bench.settle();
    assert!(!bench.last_request().scene.inside.is_faded);
    bench.harness.get_by_role_and_label(Role::CheckBox, "Slice 1 hides transparent parts").click();
    bench.settle();
    assert!(slice(&bench).only_shown);
    let scene = bench.last_request().scene;
    let lattice = scene.lattice();
    assert_eq!(slice(&bench).plane.share_across(&lattice, 2), Some(0.5));
    let (camera, viewport) = (bench.camera(), bench.viewport());
    let view = View::new(&scene, bench.last_request().size);
    let place = |at: DVec3| {
        let pixel = view.point_on_picture(at).expect("orthographic").as_vec2();
        viewport.min + vec2(pixel.x, pixel.y) * (viewport.width() / view.size[0] as f32)
    };
    // The side of the slice that lies lowest on the picture.
    let size = DVec3::from(lattice.dims.map(|n| n as f64));
    let middle = size / 2.0 - 0.5;
    let sides =
        [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y].map(|way| middle + way * size / 2.0);
    let lowest = sides.into_iter().max_by(|a, b| place(*a).y.total_cmp(&place(*b).y)).unwrap();
    let by = place(lowest + DVec3::Z * (size.z / 4.0)) - place(lowest);
    bench.drag_from(place(lowest), PointerButton::Primary, Modifiers::NONE, by);
    bench.settle();
    assert_eq!(bench.camera(), camera, "the view stays");
    let share = slice(&bench).plane.share_across(&lattice, 2).expect("still across z");
    assert!((share - 0.75).abs() < 0.03, "{share}");
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(slice(&bench).plane.share_across(&lattice, 2), Some(0.5), "a drag is one step");
}

#[test]
fn a_clip_plane_is_dragged_by_its_handle_face_on_too_unless_it_is_not_on_the_picture() {
    let mut bench = Bench::opened();
    bench.harness.get_by_label("Add clip plane").click();
    bench.settle();
    let plane = |bench: &Bench| bench.window().scene().expect("open").inside.clip.planes[0];
    let (before, camera) = (plane(&bench), bench.camera());
    assert!((before.normal.dot(camera.direction) - 1.0).abs() < 1e-9, "across the view");
    let scene = bench.last_request().scene;
    let (viewport, lattice) = (bench.viewport(), scene.lattice());
    let view = View::new(&scene, bench.last_request().size);
    let place = |at: DVec3| {
        let pixel = view.point_on_picture(at).expect("orthographic").as_vec2();
        viewport.min + vec2(pixel.x, pixel.y) * (viewport.width() / view.size[0] as f32)
    };
    let outline = before.outline(&lattice);
    let ends = outline.iter().zip(outline.iter().cycle().skip(1));
    let lowest = ends.map(|(a, b)| place((*a + *b) / 2.0)).max_by(|a, b| a.y.total_cmp(&b.y));
    let handle = lowest.expect("a side");
    let up = vec2(0.0, -viewport.height() / 20.0);
    bench.drag_from(handle, PointerButton::Primary, Modifiers::NONE, up);
    bench.settle();
    assert_eq!(bench.camera(), camera, "the view stays");
    // Away from the eye by a twentieth of the volume's size.
    let moved = (plane(&bench).point - before.point).dot(camera.direction);
    let asked = 2.0 * lattice.bounding_radius() / 20.0;
    assert!((moved / asked - 1.0).abs() < 0.2, "{moved} of {asked}");
    press(&mut bench, Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(plane(&bench), before, "a drag is one step");
    bench.harness.get_by_role_and_label(Role::CheckBox, "On the picture").click();
    bench.settle();
    bench.drag_from(handle, PointerButton::Primary, Modifiers::NONE, up);
    bench.settle();
    assert_eq!(plane(&bench), before);
    assert_ne!(bench.camera(), camera, "the view is turned");
}

/// What did not work stays on screen until it was read.
#[test]
fn escape_takes_errors_off_the_picture() {
    let mut bench = Bench::opened();
    bench.open("bad.nrrd");
    bench.wait_until(|window| window.notices().has_errors());
    let before = bench.camera();
    press(&mut bench, Modifiers::NONE, Key::Escape);
    assert!(!bench.window().notices().has_errors());
    assert_eq!(bench.camera(), before);
}

#[test]
fn an_extent_belongs_to_its_file_and_a_kernel_is_a_habit() {
    let mut bench = Bench::opened();
    let splat = |bench: &Bench| bench.window().scene().expect("open").splat;
    let natural = splat(&bench).extent;
    bench.set_slider("Extent", 1.6);
    bench.choose("Kernel", "Linear");
    bench.settle();
    assert_ne!(splat(&bench).extent, natural);
    let kernel = splat(&bench).kernel;
    bench.open("triples.nrrd");
    bench.settle();
    assert_eq!((splat(&bench).extent, splat(&bench).kernel), (natural, kernel));
}

#[test]
fn vectors_that_matter_would_hide_are_seen_in_it_and_in_other_colours() {
    let mut bench = Bench::empty();
    bench.open("triples.nrrd");
    bench.settle();
    let colour = ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 511.0] };
    let of = TransferFunction::of(vec![(0.0, 1.0), (511.0, 1.0)], colour);
    bench.harness.event(Event::Paste(Design::from(of).to_text()));
    bench.harness.run_steps(3);
    bench.harness.get_by_role_and_label(Role::Button, "Show the vectors").click();
    bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.vectors().is_empty()));
    bench.settle();
    let scene = bench.window().scene().expect("open");
    assert!(scene.shows_field() && scene.inside.is_faded);
    let map = |transfer: &TransferFunction| transfer.colour.map();
    assert_ne!(map(&scene.vectors()[0].settings.transfer), scene.transfer().and_then(map));
}

#[test]
fn the_wheel_ends_at_a_voxel_and_far_from_the_volume() {
    let mut bench = Bench::opened();
    bench.hover(bench.viewport().center());
    let first = bench.camera().parallel_scale;
    let mut scale_after = |notches: f32| {
        for _ in 0..60 {
            bench.wheel(notches);
        }
        bench.camera().parallel_scale
    };
    let (near, far) = (scale_after(4.0), scale_after(-4.0));
    // Samples are 1 apart.
    assert!((0.05..first).contains(&near), "{near} of {first}");
    assert!((first..100.0 * first).contains(&far), "{far} of {first}");
    assert_eq!(scale_after(-4.0), far, "there it stays");
}

#[test]
fn views_by_name_show_all_that_can_be_seen() {
    let mut bench = Bench::opened();
    press(&mut bench, Modifiers::NONE, Key::Num1);
    let front = bench.camera();
    bench.hover(bench.viewport().center() + vec2(60.0, 20.0));
    bench.wheel(3.0);
    assert!(bench.camera().parallel_scale < 0.9 * front.parallel_scale);
    press(&mut bench, Modifiers::NONE, Key::Num1);
    assert_eq!(bench.camera(), front, "as before the hand came near");
    bench.wheel(3.0);
    press(&mut bench, Modifiers::NONE, Key::Num3);
    let right = bench.camera();
    press(&mut bench, Modifiers::NONE, Key::Num1);
    press(&mut bench, Modifiers::NONE, Key::Num3);
    assert_eq!(bench.camera(), right);
    assert!((right.focal_point - front.focal_point).length() < 0.5 * front.parallel_scale);
}

/// Chooses an entry of a menu that is named so.
fn choose_from(bench: &mut Bench, menu: &str, entry: &str) {
    bench.harness.get_all_by_label(menu).next().expect("the menu").click();
    bench.harness.run_steps(3);
    bench.harness.get_all_by_label(entry).last().expect("in the menu").click();
    bench.settle();
}

#[test]
fn slices_isosurfaces_and_a_clip_box_are_in_a_menu_and_leave_the_volume_as_it_was() {
    let mut bench = Bench::opened();
    let before = bench.window().scene().expect("open").transfer().cloned();
    for (entry, counts) in [("Slice", [1, 0]), ("Isosurface", [1, 1])] {
        choose_from(&mut bench, "Add", entry);
        let inside = &bench.window().scene().expect("open").inside;
        assert_eq!([inside.slices.len(), inside.isosurfaces.len()], counts, "{entry}");
    }
    for name in ["Remove isosurface 1", "Remove slice 1"] {
        bench.harness.get_by_label(name).click();
        bench.settle();
    }
    let scene = bench.window().scene().expect("open");
    assert!(!scene.inside.is_faded && scene.inside.slices.is_empty());
    let after = scene.transfer().cloned();
    let opacities = |transfer: &Option<TransferFunction>| {
        let transfer = transfer.as_ref().expect("a field");
        transfer.opacity.iter().map(|(_, a)| (a * 1e9).round()).collect::<Vec<_>>()
    };
    assert_eq!(opacities(&after), opacities(&before));
    for is_on in [true, false] {
        choose_from(&mut bench, "Add", "Clip box");
        let bounds = bench.window().scene().expect("open").inside.clip.bounds;
        assert_eq!(bounds.is_some(), is_on);
    }
}

#[test]
fn words_that_offer_something_do_it() {
    let mut bench = Bench::opened();
    bench.open("triples.nrrd");
    bench.harness.get_by_label_contains("has vectors, too").click();
    bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.vectors().is_empty()));
}

//! What lets the inside be seen: the clip box with its handles, planes, undo.

use eframe::egui::accesskit::{Role, Toggled};
use eframe::egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use voxsplat::scene::{AlongRay, ClipBox, CutFaces, Inside, MOST_CLIP_PLANES, SplatSettings, View};
use voxsplat::task::engine::Effort;

use super::press;
use crate::ui_support::Bench;

/// What the engine is asked to draw.
fn inside(bench: &Bench) -> Inside {
    let scene = bench.window().scene().expect("something is open");
    assert_eq!(bench.last_request().scene.inside, scene.inside, "what is chosen is asked for");
    let projects = scene.inside.along != AlongRay::Composite;
    assert!(projects || scene.inside.check(&SplatSettings::EXACT).is_ok());
    scene.inside.clone()
}

fn tick(bench: &mut Bench, part: &str) {
    bench.harness.get_by_role_and_label(Role::CheckBox, part).click();
    bench.settle();
}

fn bounds(bench: &Bench) -> ClipBox {
    inside(bench).clip.bounds.expect("a box")
}

#[test]
fn the_clip_box_is_switched_set_by_numbers_and_taken_back() {
    let mut bench = Bench::opened();
    assert!(inside(&bench).is_plain());
    tick(&mut bench, "Clip box");
    assert_eq!(
        bounds(&bench),
        ClipBox::WHOLE,
        "all of the volume shows, so nothing is cut at first"
    );
    bench.set_slider("Along x to", 50.0);
    bench.set_slider("Along y from", 25.0);
    bench.set_slider("Along z to", 75.0);
    let chosen = ClipBox { low: [0.0, 0.25, 0.0], high: [0.5, 1.0, 0.75] };
    assert_eq!(bounds(&bench), chosen);
    bench.set_slider("Along x from", 99.0);
    let ClipBox { low, high } = bounds(&bench);
    assert!(low[0] == 0.99 && high[0] > low[0], "an end takes the other along: {low:?} {high:?}");
    bench.harness.check_accessibility();
    for _ in 0..2 {
        bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        bench.settle();
    }
    assert_eq!(bounds(&bench).high, [0.5, 1.0, 1.0], "each number was a step");
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Y);
    bench.settle();
    assert_eq!(bounds(&bench), chosen);
    tick(&mut bench, "Clip box");
    assert!(inside(&bench).is_plain());
    tick(&mut bench, "Clip box");
    assert_eq!(bounds(&bench), chosen, "as it was");
    tick(&mut bench, "Coloured faces");
    assert_eq!(inside(&bench).clip.faces, CutFaces::Coloured);
    press(&mut bench, "Reset clip");
    assert!(inside(&bench).is_plain());
}

#[test]
fn a_face_of_the_box_is_dragged_on_the_picture_and_the_view_stays() {
    let mut bench = Bench::opened();
    tick(&mut bench, "Clip box");
    bench.set_slider("Along x to", 50.0);
    let (camera, viewport) = (bench.camera(), bench.viewport());
    let scene = bench.last_request().scene;
    let view = View::new(&scene, bench.last_request().size);
    let [low, high] = bounds(&bench).in_index(scene.lattice().dims);
    let mut at = (low + high) / 2.0;
    at.x = high.x;
    let place = |at| {
        let pixel = view.point_on_picture(at).expect("orthographic").as_vec2();
        viewport.min + vec2(pixel.x, pixel.y) * (viewport.width() / view.size[0] as f32)
    };
    let (here, end) = (place(at), place(at + glam::DVec3::X));
    let asked = bench.request_count();
    // Towards smaller x, by a quarter of the volume.
    let by = (end - here) * (-0.25 * scene.lattice().dims[0] as f32);
    bench.drag_from(here, PointerButton::Primary, Modifiers::NONE, by);
    let moved = bench.requests_since(asked);
    assert!(moved.iter().any(|request| matches!(request.effort, Effort::Moving { .. })));
    bench.settle();
    assert_eq!(bench.camera(), camera, "the view stays");
    let ClipBox { low, high } = bounds(&bench);
    assert!((high[0] - 0.25).abs() < 0.03, "{high:?}");
    assert_eq!((low, [high[1], high[2]]), ([0.0; 3], [1.0; 2]), "no other face moved");
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(bounds(&bench).high[0], 0.5, "a drag is one step");
    tick(&mut bench, "On the picture");
    bench.drag_from(here, PointerButton::Primary, Modifiers::NONE, by);
    assert_ne!(bench.camera(), camera, "without handles it is the view that turns");
}

#[test]
fn a_face_beyond_the_picture_is_dragged_by_a_handle_at_its_edge() {
    let mut bench = Bench::opened();
    tick(&mut bench, "Clip box");
    bench.hover(bench.viewport().center());
    for _ in 0..14 {
        bench.wheel(1.0);
        bench.harness.run_steps(3);
    }
    bench.settle();
    let (camera, viewport) = (bench.camera(), bench.viewport());
    let scene = bench.last_request().scene;
    let view = View::new(&scene, bench.last_request().size);
    let [low, high] = bounds(&bench).in_index(scene.lattice().dims);
    let mut at = (low + high) / 2.0;
    at.x = high.x;
    let place = |at| {
        let pixel = view.point_on_picture(at).expect("orthographic").as_vec2();
        viewport.min + vec2(pixel.x, pixel.y) * (viewport.width() / view.size[0] as f32)
    };
    let (here, end) = (place(at), place(at + glam::DVec3::X));
    assert!(!viewport.contains(here), "zoomed in: {here}");
    // On the way from the middle to the face, as far as a handle's room from the edge.
    let (away, half) = (here - viewport.center(), viewport.shrink(10.0).size() / 2.0);
    let edge = viewport.center() + away / (away.x / half.x).abs().max((away.y / half.y).abs());
    let by = (end - here) * (-0.05 * scene.lattice().dims[0] as f32);
    bench.drag_from(edge, PointerButton::Primary, Modifiers::NONE, by);
    bench.settle();
    assert_eq!(bench.camera(), camera, "the view stays");
    let ClipBox { low, high } = bounds(&bench);
    assert!((high[0] - 0.95).abs() < 0.01, "{high:?}");
    assert_eq!((low, [high[1], high[2]]), ([0.0; 3], [1.0; 2]), "no other face moved");
}

#[test]
fn planes_are_added_turned_flipped_moved_and_removed() {
    let mut bench = Bench::opened();
    let planes = |bench: &Bench| inside(bench).clip.planes;
    press(&mut bench, "Add clip plane");
    let [plane] = planes(&bench)[..] else { panic!("one") };
    let lattice = bench.window().scene().unwrap().lattice();
    assert_eq!((plane.normal, plane.point), (bench.camera().direction, lattice.centre()));
    let list =
        |bench: &Bench| bench.harness.get_by_role_and_label(Role::ComboBox, "Plane 1 lies").value();
    assert_eq!(list(&bench).as_deref(), Some("Across the view"));
    bench.choose("Plane 1 lies", "Across y");
    let normal = planes(&bench)[0].normal;
    assert!((normal - lattice.axes().y_axis.normalize()).length() < 1e-12, "{normal}");
    bench.set_slider("Plane 1 offset", -50.0);
    let plane = planes(&bench)[0];
    let expected = -0.25 * lattice.dims[1] as f64 * lattice.spacing.y;
    assert!(((plane.point - lattice.centre()).dot(normal) - expected).abs() < 1e-9);
    press(&mut bench, "Flip plane 1");
    let flipped = planes(&bench)[0];
    assert_eq!((flipped.normal, flipped.point), (-plane.normal, plane.point));
    for _ in 1..MOST_CLIP_PLANES {
        press(&mut bench, "Add clip plane");
    }
    let add = bench.harness.get_by_role_and_label(Role::Button, "Add clip plane");
    assert!(add.accesskit_node().is_disabled());
    bench.harness.check_accessibility();
    press(&mut bench, "Remove plane 1");
    assert_eq!(planes(&bench).len(), MOST_CLIP_PLANES - 1);
    assert_ne!(planes(&bench)[0], flipped);
}

/// A row of sliders without a name is guessed at.
#[test]
fn sliders_of_slices_and_planes_say_what_they_move() {
    let mut bench = Bench::opened();
    press(&mut bench, "Add slice");
    for name in ["Slice 1", "Position", "Opacity"] {
        assert!(bench.shows(name), "{name}");
    }
    press(&mut bench, "Add clip plane");
    let places = bench.harness.query_all_by_label("Position").count();
    assert_eq!(places, 2, "of the slice and of the plane");
}

#[test]
fn modes_that_show_nothing_of_it_say_so_and_another_file_is_whole() {
    let mut bench = Bench::opened();
    let note = "Use the exact mode to see inside";
    tick(&mut bench, "Clip box");
    bench.set_slider("Along x to", 50.0);
    assert!(!bench.shows(note));
    press(&mut bench, "Classic splatting");
    assert!(bench.shows(note));
    press(&mut bench, note);
    assert_eq!(bench.window().scene().unwrap().splat, SplatSettings::EXACT);
    assert!(!bench.shows(note));
    let on = bench.harness.get_by_role_and_label(Role::CheckBox, "Clip box");
    assert_eq!(on.accesskit_node().toggled(), Some(Toggled::True));
    bench.open("other.mha");
    assert!(inside(&bench).is_plain());
}

#[test]
fn the_rendering_is_chosen_where_one_looks_first_and_undone() {
    let mut bench = Bench::opened();
    let place = |name: &str| bench.harness.get_by_label(name).rect().center();
    let rendering = bench.harness.get_by_role_and_label(Role::ComboBox, "Rendering").rect();
    assert!(rendering.bottom() < place("Data").y, "before all sections");
    for (name, along) in [
        ("Maximum (MIP)", AlongRay::Maximum),
        ("Minimum (MinIP)", AlongRay::Minimum),
        ("Average", AlongRay::Average),
    ] {
        bench.choose("Rendering", name);
        assert_eq!(inside(&bench).along, along);
    }
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(inside(&bench).along, AlongRay::Minimum);
    bench.choose("Rendering", "Volume");
    assert!(inside(&bench).is_plain());
}

#[test]
fn isosurfaces_and_slices_are_added_set_and_removed() {
    let mut bench = Bench::opened();
    press(&mut bench, "Add isosurface");
    let volume = bench.window().scene().unwrap().volume().unwrap().clone();
    let iso = |bench: &Bench| inside(bench).isosurfaces[0];
    let dense = bench.window().scene().unwrap().transfer().unwrap().opacity_at(iso(&bench).value);
    let points = &bench.window().scene().unwrap().transfer().unwrap().opacity;
    let most = points.iter().fold(0.0_f64, |most, (_, opacity)| most.max(*opacity));
    assert!((dense / most - 0.4).abs() < 1e-9, "{dense} of {most}");
    let value = (volume.statistics.min + volume.statistics.max) / 2.0;
    bench.set_slider("Isosurface 1 value", value);
    bench.set_slider("Isosurface 1 opacity", 0.4);
    tick(&mut bench, "Isosurface 1 own colour");
    assert!((iso(&bench).value - value).abs() < 1e-2 * value.abs().max(1.0));
    assert_eq!((iso(&bench).opacity, iso(&bench).colour.is_some()), (0.4, true));
    press(&mut bench, "Add slice");
    press(&mut bench, "Add slice");
    let lattice = volume.lattice;
    let share =
        |bench: &Bench, i: usize, axis| inside(bench).slices[i].plane.share_across(&lattice, axis);
    assert_eq!((share(&bench, 0, 2), share(&bench, 1, 1)), (Some(0.5), Some(0.5)));
    bench.set_slider("Slice 2 position", 0.0);
    let first = 0.5 / lattice.dims[1] as f64;
    assert!((share(&bench, 1, 1).unwrap() - first).abs() < 1e-9);
    bench.choose("Slice 1 lies", "Across the view");
    assert_eq!(inside(&bench).slices[0].plane.normal, bench.camera().direction);
    bench.set_slider("Slice 1 position", 50.0);
    bench.set_slider("Slice 1 opacity", 0.25);
    assert_eq!(inside(&bench).slices[0].opacity, 0.25);
    bench.harness.check_accessibility();
    bench.choose("Rendering", "Maximum (MIP)");
    assert!(bench.shows("Isosurfaces and slices are shown where Rendering is Volume"));
    bench.choose("Rendering", "Volume");
    for part in ["Remove slice 2", "Remove slice 1", "Remove isosurface 1"] {
        press(&mut bench, part);
    }
    assert!(inside(&bench).is_plain());
}

#[test]
fn places_in_meshes_and_points_are_coordinates_and_their_box_opens_whole() {
    let mut bench = Bench::opened();
    for name in ["ring.vtu", "points.csv"] {
        bench.open(name);
        bench.settle();
        let has_cells = bench.harness.query_by_role_and_label(Role::Label, "Cells").is_some();
        assert_eq!(has_cells, name == "ring.vtu", "points that no cell joins are told once");
        if name == "points.csv" {
            tick(&mut bench, "Its points as a volume");
        }
        let volume = bench.window().scene().unwrap().volume().unwrap().clone();
        tick(&mut bench, "Clip box");
        assert_eq!(bounds(&bench), ClipBox::WHOLE, "{name}: nothing of it is hidden");
        let value = |bench: &Bench, label: &str| {
            let node = bench.harness.get_by_role_and_label(Role::SpinButton, label);
            node.accesskit_node().numeric_value().expect("a number")
        };
        let [low, high] = volume.own_bounds.expect("no lattice of its own");
        for (label, end) in [("Along z from", low.z), ("Along z to", high.z)] {
            assert!(
                (value(&bench, label) - end).abs() < 1e-3,
                "{name}, {label}: as the file has it"
            );
        }
        bench.set_slider("Along z to", 0.125);
        let lattice = &volume.lattice;
        let [_, cut] = bounds(&bench).in_index(lattice.dims);
        assert!((lattice.world_from_index(cut).z - 0.125).abs() < 1e-9, "{name}");
        bench.set_slider("Along z to", high.z);
        assert_eq!(bounds(&bench), ClipBox::WHOLE, "{name}: its end is the volume's");
        press(&mut bench, "Add slice");
        bench.set_slider("Slice 1 position", -0.25);
        let at = inside(&bench).slices[0].plane.point.z;
        assert!((at + 0.25).abs() < 1e-9, "{name}: {at}");
        press(&mut bench, "Remove slice 1");
        tick(&mut bench, "Clip box");
    }
}

#[test]
fn a_slice_in_opaque_matter_says_why_nothing_is_seen_of_it() {
    let says = |bench: &Bench| {
        bench.tells("hidden inside what is opaque") || bench.tells("Hidden inside what is opaque")
    };
    let mut bench = Bench::opened();
    bench.open("block.csv");
    bench.settle();
    press(&mut bench, "Add slice");
    let alone = "A surface by itself has neither slices nor isosurfaces: show its points under Data for these";
    assert!(bench.shows(alone) && !says(&bench), "points open as small bodies");
    tick(&mut bench, "Its points as a volume");
    assert!(!bench.shows(alone));
    assert!(says(&bench), "points are opaque at first");
    press(&mut bench, "Fade the volume");
    assert!(!says(&bench), "what hid it is faint");
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert!(says(&bench), "it is as it was");
    tick(&mut bench, "Clip box");
    assert!(says(&bench), "nothing is cut");
    // It is looked at from above.
    bench.set_slider("Along z to", 0.01);
    assert!(!says(&bench), "the slice lies open");
}

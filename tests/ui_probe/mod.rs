//! The probe under the cursor.

use eframe::egui::{Event, Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable as _;
use voxsplat::task::probe::{Met, Point, Seen};
use voxsplat::transfer::{ColourMap, ColourSource, Design, TransferFunction};

use crate::ui_support::Bench;

/// The answer to what is under the pointer now.
fn answered(bench: &mut Bench) -> Seen {
    bench.wait_until(|window| window.probing().answer().is_some());
    bench.harness.run_steps(2);
    let answer = bench.window().probing().answer().expect("just awaited");
    answer.seen.clone().expect("it fits into memory")
}

fn press(bench: &mut Bench, key: Key, modifiers: Modifiers) {
    bench.harness.key_press_modifiers(modifiers, key);
    bench.harness.run_steps(3);
}

#[test]
fn pointing_at_the_picture_tells_what_is_there_and_is_no_step() {
    let mut bench = Bench::opened();
    press(&mut bench, Key::Num1, Modifiers::NONE);
    bench.settle();
    let before = bench.camera();
    press(&mut bench, Key::P, Modifiers::NONE);
    assert!(bench.shows("Probe: Probe Point at the picture"));
    bench.hover(bench.viewport().center() + vec2(10.0, -6.0));
    let Seen::Point(Point { world, index, value, .. }) = answered(&mut bench) else {
        panic!("the middle of the volume is seen");
    };
    // On the ray through the middle of that pixel.
    let request = bench.last_request();
    let size = request.size.map(f64::from);
    let pixel = before.pixel_from_view(before.to_view(world), size).expect("orthographic");
    let [width, height] = size;
    let (right, down) = (pixel.x - width / 2.0 - 10.0, pixel.y - height / 2.0 + 6.0);
    assert!(right.abs() <= 0.5 + 1e-6 && down.abs() <= 0.5 + 1e-6, "{right} {down}");
    let scene = bench.window().scene().expect("something is open");
    let lattice = scene.lattice();
    assert!((lattice.index_from_world(world) - index).length() < 1e-9);
    assert!(
        scene.volume().expect("a field").statistics.min - 1.0 <= value
            && value <= scene.volume().expect("a field").statistics.max + 1.0
    );
    let says = |part: &str| bench.harness.query_by_label_contains(part).is_some();
    assert!(says("Probe: World x") && says("per unit") && says("reaches 10 %"));
    // Beside the volume there is nothing, and it is said.
    bench.hover(bench.viewport().left_top() + vec2(3.0, 200.0));
    assert_eq!(answered(&mut bench), Seen::Beside);
    // Taking back is of the view, not of what was pointed at.
    press(&mut bench, Key::ArrowLeft, Modifiers::ALT);
    assert_ne!(bench.camera(), before);
    press(&mut bench, Key::P, Modifiers::NONE);
    assert!(!bench.window().probing().is_on());
}

#[test]
fn a_moving_view_is_not_asked_about_and_one_at_rest_again_is() {
    let mut bench = Bench::opened();
    press(&mut bench, Key::P, Modifiers::NONE);
    let centre = bench.viewport().center();
    bench.hover(centre);
    answered(&mut bench);
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(40.0, 10.0));
    assert!(bench.window().probing().answer().is_none(), "of another view");
    bench.harness.run_steps(20);
    assert!(matches!(answered(&mut bench), Seen::Point(_)));
}

#[test]
fn notices_do_not_cover_what_the_probe_tells() {
    let mut bench = Bench::opened();
    press(&mut bench, Key::P, Modifiers::NONE);
    bench.start_opening("bad.nrrd");
    bench.wait_until(|window| !window.notices().shown().is_empty());
    bench.hover(bench.viewport().center());
    answered(&mut bench);
    bench.harness.run_steps(3);
    let told = bench.harness.get_by_label_contains("Probe: World x").rect();
    let notice = bench.harness.get_by_label_contains("found nonsense").rect();
    let dismiss = bench.harness.get_by_label("Dismiss").rect();
    assert!(!told.intersects(notice) && !told.intersects(dismiss), "{told} {notice} {dismiss}");
    assert!(bench.viewport().contains_rect(notice) && bench.viewport().contains_rect(dismiss));
}

/// What the picture shows first is what is pointed at.
#[test]
fn surfaces_and_projections_are_pointed_at_as_the_picture_shows_them() {
    let mut bench = Bench::opened();
    let gray = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 511.0] };
    let clear = Design::from(TransferFunction::of(vec![(0.0, 0.0)], gray));
    bench.harness.event(Event::Paste(clear.to_text()));
    bench.harness.get_by_label("Add isosurface").click();
    bench.harness.run_steps(4);
    bench.set_slider("Isosurface 1 value", 255.5);
    bench.settle();
    press(&mut bench, Key::P, Modifiers::NONE);
    let middle = bench.viewport().center();
    bench.hover(middle);
    let Seen::Point(Point { met, .. }) = answered(&mut bench) else { panic!("it is seen") };
    let says = |bench: &Bench, part: &str| bench.harness.query_by_label_contains(part).is_some();
    assert_eq!(met, Met::Isosurface);
    assert!(says(&bench, "On an isosurface, where opacity along the ray reaches 10 %"));
    bench.choose("Rendering", "Maximum (MIP)");
    bench.hover(middle);
    let Seen::Point(Point { met, value, .. }) = answered(&mut bench) else { panic!("it is seen") };
    assert_eq!(met, Met::Maximum);
    assert!(value > 256.0 && says(&bench, "The greatest value along the ray"), "{value}");
    bench.choose("Rendering", "Average");
    bench.hover(middle);
    assert_eq!(answered(&mut bench), Seen::Average);
    assert!(says(&bench, "lies at no one point"));
}

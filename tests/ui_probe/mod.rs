//! The probe under the cursor.

use eframe::egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable as _;
use voxsplat::task::probe::{Point, Seen};

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
    let lattice = scene.volume.lattice;
    assert!((lattice.index_from_world(world) - index).length() < 1e-9);
    assert!(
        scene.volume.statistics.min - 1.0 <= value && value <= scene.volume.statistics.max + 1.0
    );
    let says = |part: &str| bench.harness.query_by_label_contains(part).is_some();
    assert!(says("Probe: World x") && says("a unit") && says("gathered 10 %"));
    // Beside the volume there is nothing, and it is said.
    bench.hover(bench.viewport().left_top() + vec2(3.0, 200.0));
    assert_eq!(answered(&mut bench), Seen::Beside);
    // Taking back is of the view, not of what was pointed at.
    press(&mut bench, Key::Z, Modifiers::COMMAND);
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

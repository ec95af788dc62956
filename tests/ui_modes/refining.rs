//! Beyond the full picture: slabs doubled at rest, and on demand.

use eframe::egui::accesskit::Role;
use eframe::egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable as _;
use voxsplat::app::settings::CONVERGE_WITHIN_MS;
use voxsplat::task::engine::Effort;

use super::press;
use crate::ui_support::Bench;

/// What the status line keeps for a click while the view could be refined further.
const LEFT: &str =
    "Ever thinner steps along the rays (slabs) until nothing changes would take about 12 s";

/// Milliseconds that doubling slabs may take at rest.
fn converge_ms(bench: &Bench) -> f64 {
    match bench.last_request().effort {
        Effort::Rest { converge_ms, .. } => converge_ms,
        moving @ Effort::Moving { .. } => panic!("not at rest: {moving:?}"),
    }
}

#[test]
fn a_key_refines_the_view_until_it_converges_and_the_next_one_only_as_time_allows() {
    let mut bench = Bench::opened();
    assert_eq!(converge_ms(&bench), CONVERGE_WITHIN_MS);
    bench.open_details();
    assert!(bench.tells(LEFT));
    bench.harness.key_press(Key::R);
    bench.settle();
    assert_eq!(converge_ms(&bench), f64::INFINITY);
    assert!(bench.shows("Finished · 12 ms · no visible error"), "the line says so");
    assert!(
        bench.tells("With 8 slabs a voxel instead of half as many the pixel that changed most changed by 0.08 % of full")
    );
    let asked = bench.request_count();
    bench.harness.key_press(Key::R);
    bench.settle();
    assert_eq!(bench.request_count(), asked, "nothing is left to be done");

    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
    bench.harness.run_steps(3);
    press(&mut bench, "Save");
    bench.wait_until(|window| !window.notices().shown().is_empty());
    assert_eq!(bench.saved().scene.splat.slabs_per_voxel, 8.0, "what is seen is saved");

    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0));
    bench.settle();
    assert_eq!(converge_ms(&bench), CONVERGE_WITHIN_MS);
    bench.harness.get_by_role_and_label(Role::CheckBox, "Go on refining at rest").click();
    bench.settle();
    assert_eq!(converge_ms(&bench), 0.0);
    assert!(bench.shows("Finished · 12 ms · exact mode"));
    bench.open_details();
    assert!(bench.tells("Not checked yet") && !bench.tells(LEFT));
}

#[test]
fn modes_that_are_judged_are_shown_as_they_are() {
    let mut bench = Bench::opened();
    for key in [Key::A, Key::C] {
        let before = bench.request_count();
        bench.harness.key_press(key);
        bench.settle();
        let asked = bench.request_count();
        match key {
            // The panel takes room: the picture is another.
            Key::A => assert_eq!(converge_ms(&bench), 0.0),
            _ => assert_eq!(asked, before, "the full picture is there already"),
        }
        bench.open_details();
        // Whatever was measured meanwhile.
        assert!(bench.tells("peak signal-to-noise ratio") && !bench.tells(LEFT));
        bench.harness.key_press(Key::R);
        bench.settle();
        assert_eq!(bench.request_count(), asked);
        let hint = match key {
            Key::A => "To refine further, close the accuracy panel (A)",
            _ => "To refine further, close the comparison (C)",
        };
        assert!(bench.harness.query_by_label(hint).is_some(), "{hint}");
        // It goes by itself, and leaves nothing to be drawn.
        bench.wait_until(|window| window.notices().shown().is_empty());
        bench.harness.key_press(key);
        bench.settle();
        assert_eq!(converge_ms(&bench), CONVERGE_WITHIN_MS);
    }
    bench.harness.key_press(Key::R);
    bench.settle();
    bench.harness.key_press(Key::C);
    bench.settle();
    assert_eq!(converge_ms(&bench), 0.0, "from the converged picture back to the mode itself");
    bench.harness.key_press(Key::C);
    bench.settle();
    press(&mut bench, "Classic splatting");
    let asked = bench.request_count();
    bench.harness.key_press(Key::R);
    bench.settle();
    assert_eq!(bench.request_count(), asked);
    assert!(bench.harness.query_by_label_contains("This mode cannot be refined further").is_some());
}

/// Whether edges are to be smooth at rest.
fn smooths(bench: &Bench) -> bool {
    match bench.last_request().effort {
        Effort::Rest { smooth_edges, .. } => smooth_edges,
        moving @ Effort::Moving { .. } => panic!("not at rest: {moving:?}"),
    }
}

/// Edges are smooth at rest and in files unless somebody says otherwise, and never while modes are judged.
#[test]
fn edges_are_smooth_at_rest_and_in_files_until_that_is_switched_off() {
    let mut bench = Bench::opened();
    assert!(smooths(&bench));
    bench.harness.key_press(Key::A);
    bench.settle();
    assert!(!smooths(&bench), "the accuracy panel shows modes as they are");
    bench.harness.key_press(Key::A);
    bench.settle();
    assert!(smooths(&bench));
    let save = |bench: &mut Bench| {
        bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
        bench.harness.run_steps(3);
        press(bench, "Save");
        bench.wait_until(|window| !window.notices().shown().is_empty());
        bench.saved().smooth_edges
    };
    assert!(save(&mut bench));
    bench.wait_until(|window| window.notices().shown().is_empty());
    bench.harness.get_by_role_and_label(Role::CheckBox, "Smooth edges at rest").click();
    bench.settle();
    assert!(!smooths(&bench) && !save(&mut bench));
}

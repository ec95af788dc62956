//! Modes: their controls, the accuracy panel, the comparison of two.

mod cells;
mod functions;
mod inside;
mod meshes;
mod polygons;
mod refining;
mod shading;
mod vectors;

use std::sync::atomic::Ordering;
use std::time::Duration;

use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, ViewportId, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use voxsplat::app::compare::Display;
use voxsplat::app::measuring::State;
use voxsplat::core::Srgb8;
use voxsplat::kernel::{Kernel, Subdivisions};
use voxsplat::scene::{
    Backend, Background, Classify, ErrorMeasure, OpacityModel, Order, Reconstruction,
    SplatSettings, Visibility,
};

use voxsplat::task::engine::EngineChoice;

use crate::ui_support::{Bench, MeasureLog, Painter, SECOND_DARKER, chart_points};

/// What the engine is asked to draw.
fn mode(bench: &Bench) -> SplatSettings {
    let mode = bench.window().scene().expect("something is open").splat;
    assert_eq!(mode.check(), Ok(()));
    let asked = bench.last_request().scene.splat;
    assert!(
        asked.makes_same_picture(&mode),
        "what is chosen is what is asked for: {asked:?} {mode:?}"
    );
    mode
}

/// Presses a button by its name; of two, as a menu and a dialog's, the one on top, which comes last.
fn press(bench: &mut Bench, name: &str) {
    let buttons = bench.harness.get_all_by_role_and_label(Role::Button, name);
    buttons.last().expect("the button").click();
    bench.settle();
}

/// Opens the panel and waits until everything is measured.
fn measured() -> Bench {
    let mut bench = Bench::opened();
    bench.harness.key_press(Key::A);
    bench.wait_until(|window| window.measuring().state() == State::Done);
    bench.settle();
    bench
}

#[test]
fn every_choice_of_a_mode_reaches_the_engine_and_takes_along_what_contradicts_it() {
    let mut bench = Bench::opened();
    assert_eq!(mode(&bench), SplatSettings::EXACT);
    press(&mut bench, "Classic splatting");
    assert_eq!(mode(&bench), SplatSettings::SHADE_FIRST);

    bench.choose("Reconstruction", "Interpolating");
    let now = mode(&bench);
    assert_eq!((now.classify, now.visibility), (Classify::PreIntegrated, Visibility::Slabs));
    assert_eq!(now.kernel, Kernel::Cubic, "what goes with it stays");

    bench.choose("Colouring", "After");
    assert_eq!(mode(&bench).classify, Classify::After);
    assert_eq!(mode(&bench).reconstruction, Reconstruction::Interpolating);
    bench.choose("Colouring", "Before");
    assert_eq!(mode(&bench).reconstruction, Reconstruction::Smooth);

    bench.choose("Visibility", "Sheets");
    assert_eq!(mode(&bench).visibility, Visibility::Sheets);
    bench.set_slider("Sheets per kernel", 4.0);
    assert_eq!(mode(&bench).sheets_per_kernel, 4);
    bench.choose("Kernel", "Linear");
    assert_eq!(mode(&bench).visibility, Visibility::Slabs, "only slabs take it");
    bench.set_slider("Slabs per voxel", 2.0);
    assert_eq!(mode(&bench).slabs_per_voxel, 2.0);
    bench.choose("Visibility", "Every sample");
    assert_eq!(mode(&bench).kernel, Kernel::Cubic, "which has a footprint");

    // Of a field of samples.
    for kernel in Kernel::ALL.into_iter().filter(|kernel| kernel.is_of_samples()) {
        let name = voxsplat::app::words::kernel(kernel);
        if mode(&bench).kernel != kernel {
            bench.choose("Kernel", &name);
        }
        assert_eq!(mode(&bench).kernel, kernel);
        if kernel == Kernel::Gouraud {
            bench.set_slider("Mesh angles", 7.0);
            bench.set_slider("Mesh rings", 2.0);
            assert_eq!(mode(&bench).gouraud, Subdivisions { angles: 7, rings: 2 });
            assert_eq!(mode(&bench).kernel, kernel);
        }
    }
    press(&mut bench, "Exact");
    assert_eq!(mode(&bench), SplatSettings::EXACT);
}

#[test]
fn rarer_choices_are_folded_away_and_work_alike() {
    let mut bench = Bench::opened();
    assert!(!bench.shows("Back end"));
    bench.harness.get_by_label("Advanced").click();
    bench.harness.run_steps(30);
    bench.choose("Back end", "Triangles");
    let now = mode(&bench);
    assert_eq!((now.backend, now.visibility), (Backend::Raster, Visibility::EverySample));
    bench.choose("Visibility", "Slabs");
    assert_eq!(mode(&bench).backend, Backend::Auto, "triangles draw no slabs");
    bench.choose("Opacity", "Published");
    assert_eq!(mode(&bench).opacity_model, OpacityModel::Published);
    bench.choose("Order", "Back to front");
    assert_eq!(mode(&bench).order, Order::BackToFront);
}

#[test]
fn octree_cuts_are_fitted_as_chosen_whatever_the_mode() {
    let mut bench = Bench::opened();
    assert!(!bench.shows("Error of"));
    bench.harness.get_by_label("Coarse octree").click();
    bench.harness.run_steps(30);
    bench.choose("Error of", "Optical depth");
    assert_eq!(mode(&bench).cut.measure, ErrorMeasure::OpticalDepth);
    for name in ["By what shows", "Balanced"] {
        bench.harness.get_by_role_and_label(Role::CheckBox, name).click();
        bench.settle();
    }
    let cut = mode(&bench).cut;
    assert!(cut.view_dependent && cut.balanced, "{cut:?}");
    press(&mut bench, "Classic splatting");
    bench.choose("Visibility", "Slabs");
    assert_eq!(mode(&bench).cut, cut, "it belongs to no mode");
}

#[test]
fn a_mode_survives_another_volume_and_its_unit_distance_does_not() {
    let mut bench = Bench::opened();
    bench.choose("Colouring", "After");
    bench.set_slider("Opacity over", 10.0);
    bench.open("other.nrrd");
    bench.settle();
    let now = mode(&bench);
    assert_eq!((now.classify, now.opacity_unit_distance), (Classify::After, None));
}

#[test]
fn presets_keep_the_unit_distance_of_the_data() {
    let mut bench = Bench::opened();
    bench.set_slider("Opacity over", 10.0);
    press(&mut bench, "Classic splatting");
    assert_eq!(mode(&bench).opacity_unit_distance, Some(10.0));
}

#[test]
fn the_status_line_says_what_the_picture_costs_and_is_off_by() {
    let mut bench = Bench::opened();
    assert!(bench.shows("Finished · 12 ms · exact mode"));
    assert!(!bench.tells("dB") && !bench.tells("Drawn by"), "the rest waits for a click");
    bench.open_details();
    assert!(bench.tells("Not checked yet"));
    assert!(bench.tells("estimated at 31.0 dB; against the full picture it had 30.0 dB"));
    assert!(bench.tells("peak signal-to-noise ratio") && bench.tells("Drawn by gradients (test)"));
    assert!(bench.tells("with code made for gradients (loop)"));
    bench.harness.check_accessibility();
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0));
    assert!(bench.tells("Moving · ") && bench.tells(" · error about 2.8 %"));
    bench.settle();
    press(&mut bench, "Classic splatting");
    assert!(bench.shows("Finished · 12 ms · approximate mode"));
    bench.open_details();
    assert!(bench.tells("Not checked yet"));
}

#[test]
fn what_was_measured_holds_for_the_volume_whatever_the_view() {
    let mut bench = measured();
    bench.harness.key_press(Key::A);
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0));
    bench.settle();
    assert!(bench.shows("Finished · 12 ms · error about 0.6 %"));
    bench.open_details();
    assert!(bench.tells("About 45.0 dB: measured in another view"));
    bench.open("other.nrrd");
    bench.settle();
    assert!(bench.shows("Finished · 12 ms · exact mode"), "another volume");
}

#[test]
fn the_back_end_says_what_it_was_chosen_by() {
    let mut bench = Bench::opened();
    bench.harness.get_by_label("Advanced").click();
    bench.harness.run_steps(30);
    assert!(bench.shows("Tiles draw this mode"));
    press(&mut bench, "Classic splatting");
    assert!(bench.shows("Triangles on a graphics processor"));
    bench.choose("Back end", "Triangles");
    assert!(bench.shows("Chosen by you"));
}

#[test]
fn the_chart_has_a_legend_where_there_is_room() {
    let mut bench = measured();
    let legend = |bench: &Bench| {
        let found = bench.harness.query_by_label_contains("Legend: ");
        found.map(|node| node.accesskit_node().value().unwrap_or_default())
    };
    let all = "Legend: Best for its time, Smaller or coarser, for comparison, On screen";
    assert_eq!(legend(&bench).as_deref(), Some(all));
    let at = bench.harness.get_by_label_contains("classic: ").rect().center();
    shift_click(&mut bench, at);
    assert_eq!(legend(&bench), Some(format!("{all}, Compared with it")));
    bench.harness.set_size(vec2(760.0, 700.0));
    bench.wait_until(|window| window.measuring().state() == State::Done);
    bench.settle();
    assert_eq!(legend(&bench), None, "no room for it");
    assert!(bench.harness.query_by_label_contains("classic: ").is_some(), "but for the points");
}

#[test]
fn the_record_of_estimates_grows_with_every_finished_picture() {
    let mut bench = measured();
    let before = bench.window().estimates().count;
    assert!(before > 0);
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0));
    bench.settle();
    let record = *bench.window().estimates();
    assert!(record.count > before);
    // 20 log10(0.0316 / 0.0282).
    assert!((record.mean_db - 0.988).abs() < 0.01, "{record:?}");
    assert!(bench.harness.query_by_label_contains("1.0 dB too hopeful ± 0.0 dB").is_some());
}

#[test]
fn the_chart_fills_while_the_panel_is_open_and_nothing_runs_afterwards() {
    let mut bench = Bench::opened();
    bench.harness.run_steps(60);
    assert_eq!(MeasureLog::count(&bench.measured.started), 0, "the panel is closed");
    let mut bench = measured();
    assert_eq!(MeasureLog::count(&bench.measured.started), 1);
    assert_eq!(MeasureLog::count(&bench.measured.steps), chart_points().len());
    assert!(bench.shows("5 modes measured") && bench.shows("One mode could not be drawn"));
    for point in chart_points().into_iter().filter(|point| point.failed.is_none()) {
        let name = format!("{}: ", point.name);
        let found = bench.harness.query_by_label_contains(&name);
        assert!(found.is_some(), "{name}");
    }
    let asked = bench.request_count();
    for _ in 0..200 {
        bench.harness.step();
        let output = &bench.harness.output().viewport_output[&ViewportId::ROOT];
        assert_eq!(output.repaint_delay, Duration::MAX, "{:?}", bench.harness.ctx.repaint_causes());
    }
    assert_eq!(bench.request_count(), asked);
    assert_eq!(MeasureLog::count(&bench.measured.started), 1);
    assert!(!bench.window().measuring().is_running());
}

#[test]
fn a_measured_mode_says_its_own_error_in_the_status_line() {
    let bench = measured();
    assert!(bench.shows("Finished · 12 ms · error 0.6 %"));
}

#[test]
fn hovering_a_point_names_it_clicking_uses_it_and_shift_compares_with_it() {
    let mut bench = measured();
    let place = |bench: &Bench, name: &str| {
        let name = format!("{name}: ");
        bench.harness.get_by_label_contains(&name).rect().center()
    };
    let at = place(&bench, "exact, double");
    bench.hover(at);
    bench.harness.run_steps(40);
    assert!(bench.harness.query_by_label_contains("900 ms, 55.0 ± 0.3 dB\n").is_some());

    bench.click(at, PointerButton::Primary);
    bench.settle();
    assert_eq!(mode(&bench), SplatSettings { slabs_per_voxel: 2.0, ..SplatSettings::EXACT });
    assert!(!bench.window().compare().on);
    assert_eq!(MeasureLog::count(&bench.measured.started), 1, "the chart stays");

    let at = place(&bench, "classic");
    shift_click(&mut bench, at);
    assert!(bench.window().compare().on);
    assert_eq!(bench.window().compare().second, SplatSettings::SHADE_FIRST);
    assert_eq!(mode(&bench).slabs_per_voxel, 2.0, "the first stays");

    let before = mode(&bench);
    let at = place(&bench, "exact at half the size");
    bench.click(at, PointerButton::Primary);
    bench.settle();
    assert_eq!(mode(&bench), before, "no mode of its own");
}

fn shift_click(bench: &mut Bench, at: Pos2) {
    bench.hover(at);
    bench.harness.event(Event::ModifiersChanged(Modifiers::SHIFT));
    for pressed in [true, false] {
        let button = PointerButton::Primary;
        let modifiers = Modifiers::SHIFT;
        bench.harness.event(Event::PointerButton { pos: at, button, pressed, modifiers });
    }
    bench.harness.step();
    bench.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    bench.settle();
}

#[test]
fn the_slider_walks_the_front_by_time_and_by_error() {
    let mut bench = measured();
    bench.set_slider("Time for a picture", 150.0);
    assert_eq!(mode(&bench).slabs_per_voxel, 0.5);
    bench.set_slider("Time for a picture", 900.0);
    assert_eq!(mode(&bench).slabs_per_voxel, 2.0);
    bench.set_slider("Time for a picture", 21.0);
    assert_eq!(mode(&bench), SplatSettings::SHADE_FIRST);
    press(&mut bench, "Error");
    bench.set_slider("Level of a picture", 41.0);
    assert_eq!(mode(&bench), SplatSettings::EXACT, "the quickest with at least that");
}

#[test]
fn measuring_yields_to_the_hand_and_goes_on_where_it_was() {
    let mut bench = Bench::opened();
    bench.measured.holds.store(true, Ordering::SeqCst);
    bench.harness.key_press(Key::A);
    bench.wait_until(|window| window.measuring().points().0.len() == 2);
    // Another mode of the same view: the chart is the same.
    press(&mut bench, "Classic splatting");
    bench.wait_until(|window| !window.measuring().is_running());
    assert_eq!(MeasureLog::count(&bench.measured.stopped), 1);
    bench.measured.holds.store(false, Ordering::SeqCst);
    bench.wait_until(|window| window.measuring().state() == State::Done);
    assert_eq!(MeasureLog::count(&bench.measured.started), 1, "it was not begun again");
    assert_eq!(MeasureLog::count(&bench.measured.steps), chart_points().len());
}

#[test]
fn another_view_begins_another_chart_and_the_old_points_stay_until_then() {
    let mut bench = measured();
    bench.measured.holds.store(true, Ordering::SeqCst);
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(60.0, 10.0));
    let (points, is_old) = bench.window().measuring().points();
    assert!(is_old && points.len() == chart_points().len());
    bench.wait_until(|window| window.measuring().points() == (chart_points()[..2].to_vec(), false));
    assert_eq!(MeasureLog::count(&bench.measured.started), 2);
    // While it is under way the view moves on: it is told to stop.
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(-60.0, 10.0));
    assert!(!bench.window().measuring().is_running());
    let stopped = || MeasureLog::count(&bench.measured.stopped) == 1;
    for _ in 0..2000 {
        if stopped() {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(stopped());
    // What it found until then is of the view before.
    std::thread::sleep(Duration::from_millis(30));
    assert!(bench.window().measuring().points().1, "old");
}

#[test]
fn closing_the_panel_stops_the_job() {
    let mut bench = Bench::opened();
    bench.measured.holds.store(true, Ordering::SeqCst);
    bench.harness.key_press(Key::A);
    bench.wait_until(|window| window.measuring().points().0.len() == 2);
    assert!(bench.window().measuring().is_running());
    bench.harness.key_press(Key::A);
    bench.harness.run_steps(3);
    assert!(!bench.window().measuring().is_running());
    for _ in 0..2000 {
        if MeasureLog::count(&bench.measured.stopped) == 1 {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("the job goes on behind a closed panel");
}

#[test]
fn two_modes_are_compared_at_rest_only() {
    let mut bench = Bench::opened();
    assert!(bench.engine.seconds().is_empty());
    bench.harness.key_press(Key::C);
    bench.settle();
    let seconds = bench.engine.seconds();
    let [Some(second)] = &seconds[..] else { panic!("{} requests", seconds.len()) };
    assert_eq!(second.scene.splat, SplatSettings::SHADE_FIRST);
    assert_eq!(second.scene.camera, bench.camera());
    assert!(bench.shows("Line between two modes"));

    let beside = bench.viewport().center() - vec2(100.0, 0.0);
    bench.drag_from(beside, PointerButton::Primary, Modifiers::NONE, vec2(200.0, 60.0));
    assert!(!bench.shows("Line between two modes"), "one picture while moving");
    assert_eq!(bench.engine.seconds().len(), 1);
    bench.settle();
    assert!(bench.shows("Line between two modes"));
    assert_eq!(bench.engine.seconds().len(), 2);

    bench.harness.key_press(Key::C);
    bench.settle();
    assert!(!bench.shows("Line between two modes"));
    assert!(bench.engine.seconds().last().expect("asked").is_none(), "it is let go");
}

#[test]
fn an_idle_comparison_repaints_nothing() {
    let mut bench = Bench::opened();
    bench.harness.key_press(Key::C);
    bench.settle();
    for _ in 0..100 {
        bench.harness.step();
        let output = &bench.harness.output().viewport_output[&ViewportId::ROOT];
        assert_eq!(output.repaint_delay, Duration::MAX, "{:?}", bench.harness.ctx.repaint_causes());
    }
    assert_eq!(bench.engine.seconds().len(), 1);
}

#[test]
fn the_line_is_dragged_and_the_view_stays() {
    let mut bench = Bench::opened();
    bench.harness.key_press(Key::C);
    bench.settle();
    let before = bench.camera();
    let line = bench.harness.get_by_label("Line between two modes").rect().center();
    bench.drag_from(line, PointerButton::Primary, Modifiers::NONE, vec2(120.0, 0.0));
    bench.settle();
    assert_eq!(bench.camera(), before);
    let share = bench.window().compare().divider;
    let expected = 0.5 + 120.0 / bench.viewport().width();
    assert!((share - expected).abs() < 0.01, "{share} {expected}");
    assert_eq!(bench.engine.seconds().len(), 1, "nothing is drawn for it");
}

#[test]
fn the_controls_change_the_first_or_the_second_mode_and_swap_them() {
    let mut bench = Bench::opened();
    bench.harness.get_by_label("Compare two modes").click();
    bench.settle();
    press(&mut bench, "Second");
    bench.choose("Kernel", "Gaussian");
    assert_eq!(bench.window().compare().second.kernel, Kernel::Gaussian);
    assert_eq!(mode(&bench), SplatSettings::EXACT);
    let last = bench.engine.seconds().last().cloned().flatten().expect("asked");
    assert_eq!(last.scene.splat.kernel, Kernel::Gaussian);
    press(&mut bench, "Swap");
    assert_eq!(mode(&bench).kernel, Kernel::Gaussian);
    assert_eq!(bench.window().compare().second, SplatSettings::EXACT);
    press(&mut bench, "First");
    bench.choose("Kernel", "Cubic");
    assert_eq!(mode(&bench).kernel, Kernel::Cubic);
}

#[test]
fn buttons_that_take_a_long_number_back_are_whole() {
    let mut bench = Bench::opened();
    let voxel = bench.window().scene().expect("something is open").lattice().smallest_spacing();
    for share in [0.012_345_67, 12.345_678] {
        bench.set_slider("Opacity over", voxel * share);
        bench.set_slider("Slabs per voxel", 1.23);
        bench.settle();
        for name in ["Reset unit distance", "Reset slabs per voxel"] {
            let button = bench.harness.get_by_label(name).rect();
            // The side panel ends with the window, and what is in it 12 points before.
            assert!(button.right() <= 1280.0 - 12.0 + 0.5, "{name}: {button}");
        }
    }
}

#[test]
fn a_difference_is_amplified_from_1_to_64_times() {
    let mut bench = Bench::opened();
    bench.harness.key_press(Key::C);
    bench.settle();
    let amplify = bench.harness.get_by_role_and_label(Role::Slider, "Amplify");
    assert!(amplify.accesskit_node().is_disabled(), "only a difference is amplified");
    bench.harness.key_press(Key::D);
    bench.settle();
    assert_eq!(bench.window().compare().display, Display::Difference);
    assert_eq!(bench.window().compare().gain(), 8.0, "the greatest one is an eighth");
    bench.harness.get_by_label("Fit the amplification").click();
    bench.settle();
    assert_eq!(bench.window().compare().gain(), 16.0);
    for (doublings, gain) in [(0.0, 1.0), (6.0, 64.0)] {
        bench.set_slider("Amplify", doublings);
        assert_eq!(bench.window().compare().gain(), gain);
    }
    assert!(!bench.shows("Line between two modes"));
}

/// At rest a picture gives way to the next little by little, where that is wanted; otherwise at once.
#[test]
fn a_picture_gives_way_to_the_next_at_rest() {
    for by in Painter::BOTH {
        picture_gives_way(by);
    }
}

#[test]
fn a_first_picture_that_takes_long_is_said_to_come() {
    let mut bench = Bench::empty();
    bench.engine.keeps_back.store(true, Ordering::SeqCst);
    bench.open("good.nrrd");
    let words = "Drawing the first picture…";
    assert!(!bench.shows(words), "at once");
    bench.harness.run_steps(60);
    assert!(bench.shows(words));
    bench.engine.keeps_back.store(false, Ordering::SeqCst);
    bench.settle();
    assert!(!bench.shows(words));
}

/// A black window says nothing of why: of the opacities, of a clip box, of a view that looks elsewhere.
#[test]
fn a_picture_of_the_background_alone_says_what_to_try() {
    let mut bench = Bench::opened();
    let words = "Next to nothing shows in this view";
    assert!(!bench.shows(words));
    let Background::Colour(Srgb8([behind, ..])) = bench.last_request().scene.background else {
        panic!("a grey");
    };
    bench.engine.hand_out_grey(behind);
    bench.settle();
    assert!(bench.shows(words));
    bench.engine.hand_out_grey(behind + 1);
    bench.settle();
    assert!(!bench.shows(words), "matter of one colour that fills the view");
}

fn picture_gives_way(by: Painter) {
    let mut bench = Bench::rendered(1.0, by);
    let middle = bench.viewport().center();
    let grey = |bench: &mut Bench| {
        let screen = bench.harness.render().expect("a software adapter is installed");
        screen.get_pixel(middle.x as u32, middle.y as u32).0[0]
    };
    bench.engine.hand_out_grey(40);
    bench.settle();
    bench.engine.hand_out_grey(200);
    bench.harness.run_steps(2);
    assert_eq!(grey(&mut bench), 200, "at once, where nothing was chosen");
    bench.unfold("Advanced refinement");
    bench.harness.get_by_label("Fade between pictures").scroll_to_me();
    bench.settle();
    bench.harness.get_by_label("Fade between pictures").click();
    bench.settle();
    assert!(bench.window().settings().fade);
    bench.engine.hand_out_grey(40);
    // A fade takes nine passes; this is one in its middle.
    bench.harness.run_steps(5);
    let found = grey(&mut bench);
    assert!((60..180).contains(&found), "{found}");
    bench.harness.run_steps(12);
    assert_eq!(grey(&mut bench), 40, "and then it is gone");
}

#[test]
fn both_pictures_and_their_difference_reach_the_screen() {
    for by in Painter::BOTH {
        both_reach_the_screen(by);
    }
}

fn both_reach_the_screen(by: Painter) {
    let mut bench = Bench::rendered(1.0, by);
    let first = bench.engine.newest();
    let viewport = bench.viewport();
    bench.harness.key_press(Key::C);
    bench.settle();
    let corner = [viewport.left(), viewport.top()].map(|c| c.round() as u32);
    let [width, height] = first.size;
    let pixel = |screen: &image::RgbaImage, x: u32, y: u32| {
        screen.get_pixel(corner[0] + x, corner[1] + y).0
    };
    let sent = |x: u32, y: u32| {
        let at = ((y * width + x) * 4) as usize;
        [first.rgba[at], first.rgba[at + 1], first.rgba[at + 2]]
    };
    let screen = bench.harness.render().expect("a software adapter is installed");
    for y in (8..height / 2).step_by(7) {
        for x in (4..width - 4).step_by(5).filter(|x| x.abs_diff(width / 2) > 6) {
            let darker = if x < width / 2 { 0 } else { SECOND_DARKER };
            let expected = sent(x, y).map(|byte| byte.saturating_sub(darker));
            assert_eq!(pixel(&screen, x, y)[..3], expected, "{x}, {y}");
        }
    }

    bench.harness.key_press(Key::D);
    bench.settle();
    let gain = f64::from(bench.window().compare().gain());
    assert_eq!(gain, 8.0, "it fits the greatest");
    let screen = bench.harness.render().expect("a software adapter is installed");
    let light = |byte: u8| voxsplat::core::colour::linear_from_srgb(f64::from(byte) / 255.0);
    let mut lit = 0;
    for y in (8..height / 2).step_by(7) {
        for x in (4..width - 4).step_by(5) {
            for (channel, byte) in sent(x, y).into_iter().enumerate() {
                let apart = light(byte) - light(byte.saturating_sub(SECOND_DARKER));
                let shown = voxsplat::core::colour::srgb_from_linear((gain * apart).min(1.0));
                let expected = (shown * 255.0).round();
                let found = f64::from(pixel(&screen, x, y)[channel]);
                // Measured: at most 1, by rounding.
                assert!((found - expected).abs() <= 1.0, "{x}, {y}: {found} for {expected}");
                lit += u32::from(found > 20.0);
            }
        }
    }
    assert!(lit > 1000, "{lit}");
}

#[test]
fn the_engine_is_chosen_among_what_the_status_line_keeps_for_a_click() {
    let mut bench = Bench::opened();
    assert_eq!(bench.engine.engine(), EngineChoice::Auto);
    for (entry, engine) in [
        ("Native engine", EngineChoice::Native),
        ("Graphics adapter", EngineChoice::Gpu),
        ("Automatic", EngineChoice::Auto),
    ] {
        bench.open_details();
        press(&mut bench, entry);
        assert_eq!(bench.engine.engine(), engine);
    }
}

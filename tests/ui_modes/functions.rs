//! Encoding the open field as basis functions.

use std::path::Path;
use std::sync::Arc;

use eframe::egui::accesskit::Role;
use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use voxsplat::io::Encoded;
use voxsplat::kernel::Kernel;
use voxsplat::rbf::{Errors, Limits};
use voxsplat::scene::{Classify, Scene, SplatSettings};
use voxsplat::volume::{Shape, demo};

use super::press;
use crate::ui_support::Bench;

fn scene(bench: &Bench) -> &Scene {
    bench.window().scene().expect("something is open")
}

fn has_functions(scene: &Scene) -> bool {
    scene.volume().is_some_and(|volume| volume.functions.is_some())
}

/// With the section of basis functions open.
fn opened(name: &str) -> Bench {
    let mut bench = Bench::empty();
    bench.open(name);
    bench.settle();
    bench.harness.get_by_label("Basis functions").click();
    bench.settle();
    bench
}

fn encoded(bench: &mut Bench) {
    press(bench, "Encode");
    bench.wait_until(|window| window.scene().is_some_and(has_functions));
    bench.settle();
}

#[test]
fn at_first_as_many_functions_are_asked_for_as_encode_takes() {
    let mut bench = opened("some.nrrd");
    let asked = |bench: &Bench| {
        let mut nodes = bench.harness.get_all_by_label("Most functions");
        nodes.find_map(|node| node.accesskit_node().numeric_value()).expect("a number")
    };
    let samples = scene(&bench).volume().expect("a field").samples.len();
    assert_eq!((samples, asked(&bench)), (512, 50.0));
    bench.set_slider("Most functions", 60.0);
    assert_eq!(asked(&bench), 60.0);
}

#[test]
fn a_field_is_encoded_and_drawn_by_its_functions_which_undo_takes_away() {
    let mut bench = opened("some.nrrd");
    assert!(!bench.shows("Compare") && !bench.shows("Residual") && !bench.shows("Save…"));
    bench.set_slider("Greatest error", 5.0);
    bench.set_slider("Most functions", 60.0);
    encoded(&mut bench);
    let splat = scene(&bench).splat;
    assert_eq!((splat.kernel, splat.classify), (Kernel::Functions, Classify::PreIntegrated));
    let said = bench.window().notices().shown().last().expect("told").text.clone();
    assert!(said.contains("basis functions: greatest error"), "{said}");
    // What the notice and the panel say is what an independent evaluation finds.
    let volume = scene(&bench).volume().expect("a field").clone();
    let functions = volume.functions.clone().expect("functions");
    let worst = (0..volume.samples.len()).map(|i| {
        let at = [i % 8, i / 8 % 8, i / 64].map(|n| n as f64);
        let world = volume.lattice.world_from_index(at.into());
        (volume.samples.get(i) - functions.value(world)).abs()
    });
    let worst = worst.fold(0.0, f64::max);
    let shown = voxsplat::app::words::value(worst);
    assert!(said.contains(&format!("greatest error {shown},")), "{said}: {shown}");

    press(&mut bench, "Compare");
    assert!(bench.window().compare().on);
    assert_eq!(bench.window().compare().second.kernel, Kernel::BSpline);
    for _ in 0..2 {
        bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        bench.settle();
    }
    assert!(!has_functions(scene(&bench)));
    assert_eq!(scene(&bench).splat, SplatSettings::EXACT);
}

#[test]
fn what_functions_leave_is_a_field_and_going_back_finds_them_again() {
    let mut bench = opened("some.nrrd");
    encoded(&mut bench);
    let before = scene(&bench).volume().expect("a field").samples.len();
    press(&mut bench, "Residual");
    bench.wait_until(|window| {
        window.scene().and_then(Scene::volume).is_some_and(|volume| volume.functions.is_none())
    });
    bench.settle();
    let left = scene(&bench).volume().expect("a field");
    assert!(left.name.ends_with("less its functions") && left.samples.len() == before);
    assert!(left.statistics.min < 0.0 && left.statistics.max > 0.0);
    assert_ne!(scene(&bench).splat.kernel, Kernel::Functions, "it has none");
    bench.choose("Field", "ramp (point)");
    bench.wait_until(|window| window.scene().is_some_and(has_functions));
}

/// Saves the functions, for which a name is suggested, at a path; what the file holds.
fn saved(bench: &mut Bench, suggested: &str, path: &Path) -> Encoded {
    press(bench, "Save…");
    let field = bench.harness.get_by_label("A file that ends in .vrbf");
    field.focus();
    bench.harness.run_steps(2);
    let field = bench.harness.get_by_label("A file that ends in .vrbf");
    assert!(field.value().is_some_and(|text| text.ends_with(suggested)));
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    bench.harness.get_by_label("A file that ends in .vrbf").type_text(&path.display().to_string());
    bench.settle();
    press(bench, "Save");
    bench.wait_until(|_| voxsplat::io::vrbf::load(path).is_ok());
    voxsplat::io::vrbf::load(path).expect("a file of functions")
}

#[test]
fn a_dropped_mesh_is_encoded_and_compared_with_its_cells() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut bench = Bench::empty();
    bench.drop_file("ring.vtu");
    bench.wait_until(|window| !window.is_loading() && window.scene().is_some());
    bench.settle();
    assert_eq!(scene(&bench).splat.kernel, Kernel::Cells);
    bench.harness.get_by_label("Basis functions").click();
    bench.settle();
    bench.set_slider("Greatest error", 20.0);
    bench.set_slider("Most functions", 40.0);
    encoded(&mut bench);
    assert_eq!(scene(&bench).splat.kernel, Kernel::Functions);

    // Independently, at the mesh's own points, from what was read.
    let grid = demo::open("mesh", Some(4)).expect("a demo");
    let Shape::Unstructured(cells) = &grid.shape else { panic!("a mesh") };
    let field = &grid.fields[0];
    let volume = scene(&bench).volume().expect("a field").clone();
    assert_eq!(volume.name, field.name);
    let functions = volume.functions.clone().expect("functions");
    let points = &cells.points()[..cells.own_points()];
    assert_eq!(points.len(), field.samples.len());
    let off: Vec<f64> = points
        .iter()
        .enumerate()
        .map(|(i, at)| (field.samples.get(i) - functions.value(*at)).abs())
        .collect();
    let count = off.len() as f64;
    let found = Errors {
        max: off.iter().copied().fold(0.0, f64::max),
        mean: off.iter().sum::<f64>() / count,
        rms: (off.iter().map(|d| d * d).sum::<f64>() / count).sqrt(),
    };
    assert!(found.max > 0.0);
    let said = bench.window().notices().shown().last().expect("told").text.clone();
    let [max, mean] = [found.max, found.mean].map(voxsplat::app::words::value);
    assert!(said.contains(&format!("greatest error {max}, mean {mean}")), "{said}");
    assert!(!said.contains("in the whole box"), "nothing is drawn outside the cells: {said}");
    let told = saved(&mut bench, "ring.vrbf", &folder.path().join("ring.vrbf"));
    assert_eq!(told.encoding.functions(), functions.functions());
    let pairs = [
        (told.errors.max, found.max),
        (told.errors.mean, found.mean),
        (told.errors.rms, found.rms),
    ];
    for (told, found) in pairs {
        // Parts of the sums may be added up in another order.
        assert!((told - found).abs() < 1e-12, "{told} {found}");
    }

    press(&mut bench, "Compare");
    assert_eq!(scene(&bench).splat.kernel, Kernel::Functions, "the first picture");
    let second = bench.engine.seconds().last().cloned().flatten().expect("it is asked for");
    assert_eq!(second.scene.splat.kernel, Kernel::Cells);
    assert!(second.scene.volume().is_some_and(|volume| volume.cells.is_some()));
}

#[test]
fn functions_are_saved_as_a_file_that_tells_their_errors() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("some.vrbf");
    let mut bench = opened("some.nrrd");
    encoded(&mut bench);
    let read = saved(&mut bench, "some.vrbf", &path);
    let functions = scene(&bench).volume().and_then(|v| v.functions.clone()).expect("functions");
    assert_eq!(read.encoding.functions(), functions.functions());
}

#[test]
fn kernels_of_functions_are_offered_where_there_are_some() {
    let mut bench = opened("some.nrrd");
    let offers = |bench: &mut Bench| {
        bench.harness.get_by_role_and_label(Role::ComboBox, "Kernel").click();
        bench.settle();
        let found = bench.harness.query_all_by_label("Basis functions").count() > 1;
        bench.harness.key_press(Key::Escape);
        bench.settle();
        found
    };
    assert!(!offers(&mut bench));
    encoded(&mut bench);
    bench.choose("Kernel", "B-spline");
    assert!(offers(&mut bench));
}

#[test]
fn functions_a_cell_and_those_left_out_are_chosen_where_they_are_drawn_and_undone() {
    let mut bench = opened("some.nrrd");
    assert!(!bench.shows("Functions per cell"), "there are none yet");
    bench.set_slider("Greatest error", 5.0);
    bench.set_slider("Most functions", 60.0);
    encoded(&mut bench);
    let limits = |bench: &Bench| scene(bench).splat.functions;
    assert_eq!(limits(&bench), Limits::NONE);
    bench.set_slider("Functions per cell", 3.0);
    bench.settle();
    assert_eq!(limits(&bench), Limits { per_cell: Some(3), ..Limits::NONE });
    bench.harness.get_by_label("Correct between corners").click();
    bench.settle();
    assert_eq!(limits(&bench), Limits { per_cell: Some(3), corrects: false, ..Limits::NONE });
    // Means of slabs are of whole functions.
    let mean = voxsplat::app::words::classify(Classify::Mean).0;
    bench.choose("Colouring", mean);
    bench.settle();
    assert_eq!((scene(&bench).splat.classify, limits(&bench).per_cell), (Classify::Mean, None));
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(limits(&bench).per_cell, Some(3));
    press(&mut bench, "Reset functions per cell");
    assert_eq!(limits(&bench).per_cell, None);
    bench.set_slider("Error of functions left out", 2.0);
    bench.set_slider("Error of functions while moving", 4.0);
    bench.settle();
    assert_eq!(limits(&bench).max_rms, 2.0);
    assert_eq!(scene(&bench).splat.quick_functions, Some(4.0));
    bench.choose("Kernel", "B-spline");
    bench.settle();
    assert!(!bench.shows("Functions per cell"), "samples are drawn");
}

#[test]
fn a_fit_goes_on_from_the_functions_that_there_are() {
    let mut bench = opened("some.nrrd");
    bench.set_slider("Greatest error", 20.0);
    bench.set_slider("Most functions", 60.0);
    assert!(!bench.shows("Continue"), "there are none yet");
    encoded(&mut bench);
    let functions = |bench: &Bench| {
        scene(bench).volume().and_then(|volume| volume.functions.clone()).expect("functions")
    };
    let worst = |bench: &Bench| {
        let volume = scene(bench).volume().expect("a field").clone();
        let own = functions(bench);
        let error = |i: usize| {
            let at = [i % 8, i / 8 % 8, i / 64].map(|n| n as f64);
            (volume.samples.get(i) - own.value(volume.lattice.world_from_index(at.into()))).abs()
        };
        (0..volume.samples.len()).map(error).fold(0.0, f64::max)
    };
    let (first, before) = (functions(&bench), worst(&bench));
    bench.set_slider("Greatest error", 0.5);
    press(&mut bench, "Continue");
    bench.wait_until(|window| {
        let volume = window.scene().and_then(Scene::volume);
        let now = volume.and_then(|volume| volume.functions.as_ref());
        now.is_some_and(|now| !Arc::ptr_eq(now, &first))
    });
    bench.settle();
    assert!(worst(&bench) < before, "{} after {before}", worst(&bench));
    let said = bench.window().notices().shown().last().expect("told").text.clone();
    assert!(said.contains("basis functions: greatest error"), "{said}");

    // Fewer cannot be gone on to, and another shape neither.
    let is_offered = |bench: &Bench| {
        let button = bench.harness.get_by_role_and_label(Role::Button, "Continue");
        !button.accesskit_node().is_disabled()
    };
    assert!(is_offered(&bench));
    bench.choose("Shape", "Spheres");
    assert!(!is_offered(&bench));
}

#[test]
fn a_goal_is_chosen_and_the_file_is_no_longer_than_it_says() {
    let mut bench = opened("some.nrrd");
    assert!(!bench.shows("Most kilobytes"));
    bench.choose("Goal", "Size of the file");
    bench.set_slider("Most kilobytes", 2.0);
    encoded(&mut bench);
    let said = bench.window().notices().shown().last().expect("told").text.clone();
    assert!(said.contains("basis functions: greatest error"), "{said}");
    assert!(!said.contains("takes more functions"), "nobody asked for an error: {said}");
    let by_size = functions_of(&bench);
    // 20 bytes each, and some hundreds of what is told of them.
    assert!(by_size > 4 && by_size < 2000 / 20, "{by_size}");
    bench.choose("Goal", "Mean error");
    bench.set_slider("Mean error", 10.0);
    press(&mut bench, "Encode");
    bench.wait_until(|window| count(window.scene()).is_some_and(|now| now != by_size));
}

fn count(scene: Option<&Scene>) -> Option<usize> {
    let functions = scene?.volume()?.functions.as_ref()?;
    Some(functions.functions().len())
}

fn functions_of(bench: &Bench) -> usize {
    count(bench.window().scene()).expect("functions")
}

#[test]
fn values_are_favoured_and_told_apart() {
    let mut bench = opened("some.nrrd");
    assert!(!bench.shows("Favour the clip box") && !bench.shows("Favoured times"));
    assert!(!bench.shows("Favoured"), "there are none yet");
    bench.harness.get_by_label("Favour values").click();
    bench.settle();
    assert!(bench.shows("Favoured from") && bench.shows("Favoured times"));
    bench.set_slider("Most functions", 20.0);
    encoded(&mut bench);
    let said = bench.window().notices().shown().last().expect("told").text.clone();
    assert!(said.contains("Of the favoured samples: greatest error"), "{said}");
    assert!(bench.shows("Favoured"), "among what is told of the functions");
}

/// A fit that is far from its end for as long as a test may wait.
fn under_way() -> Bench {
    let mut bench = opened("rough.nrrd");
    bench.set_slider("Greatest error", 0.05);
    bench.set_slider("Most functions", 20_000.0);
    press(&mut bench, "Encode");
    assert!(bench.shows("Enough") && bench.shows("Pause"), "it is under way");
    bench
}

#[test]
fn a_fit_under_way_is_forgotten_where_it_is_cancelled() {
    let mut bench = under_way();
    assert!(bench.shows("Cancel") && !has_functions(scene(&bench)));
    bench.harness.get_all_by_label("Cancel").next().expect("shown").click();
    bench.wait_until_gone("Enough");
    // Nothing comes of it later.
    std::thread::sleep(std::time::Duration::from_millis(300));
    bench.settle();
    assert!(!has_functions(scene(&bench)) && bench.shows("Encode"));
    assert!(!bench.shows("Compare") && !bench.tells("basis functions: greatest error"));
}

#[test]
fn a_paused_fit_says_so_and_is_cancelled_all_the_same() {
    let mut bench = under_way();
    press(&mut bench, "Pause");
    assert!(bench.shows("Go on"), "it is paused");
    assert!(bench.tells("· paused"), "beside its progress");
    std::thread::sleep(std::time::Duration::from_millis(300));
    bench.harness.run_steps(2);
    assert!(bench.shows("Go on") && !has_functions(scene(&bench)), "it waits");
    // The one in the panel, which is drawn last of all, or the one of the job: both end it.
    bench.harness.get_all_by_label("Cancel").last().expect("shown").click();
    bench.wait_until_gone("Go on");
    bench.settle();
    assert!(!has_functions(scene(&bench)) && bench.shows("Encode"));
}

//! Meshes: drawn as they are, with every control that grids have.

use eframe::egui::{Key, Modifiers};
use voxsplat::app::words;
use voxsplat::kernel::Kernel;
use voxsplat::scene::Scene;

use crate::ui_support::Bench;

fn scene(bench: &Bench) -> &Scene {
    bench.window().scene().expect("something is open")
}

fn opened(name: &str) -> Bench {
    let mut bench = Bench::empty();
    bench.open(name);
    bench.settle();
    bench
}

#[test]
fn a_mesh_opens_as_its_cells_which_the_data_panel_counts() {
    let mut bench = opened("ring.vtu");
    assert_eq!(scene(&bench).splat.kernel, Kernel::Cells);
    assert!(scene(&bench).volume().is_some_and(|volume| volume.cells.is_some()));
    // 24 around, five by five across; four by four cubes of six tetrahedra between them.
    assert!(bench.tells(&format!("600 points, {} cells", words::count(2304))));
    // What another file has no cells for is drawn as that opens.
    bench.open("some.nrrd");
    bench.settle();
    assert_eq!(scene(&bench).splat.kernel, Kernel::BSpline);
}

#[test]
fn other_kernels_take_turns_with_cells_which_undo_brings_back() {
    let mut bench = opened("ring.vtu");
    bench.choose("Kernel", "Linear");
    assert_eq!(scene(&bench).splat.kernel, Kernel::Linear);
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(scene(&bench).splat.kernel, Kernel::Cells);
}

#[test]
fn scattered_points_open_as_ellipsoids_and_meshes_are_drawn_so_where_that_is_chosen() {
    let mut bench = opened("points.csv");
    assert_eq!(scene(&bench).splat.kernel, Kernel::Ellipsoids);
    assert!(scene(&bench).volume().is_some_and(|volume| volume.cells.is_none()));
    assert!(bench.tells("600 points"));
    let spacing = scene(&bench).opacity_unit_distance();
    let share = spacing / scene(&bench).lattice().bounding_radius();
    assert!((0.01..0.2).contains(&share), "{spacing}");

    bench.open("ring.vtu");
    bench.settle();
    assert_eq!(scene(&bench).splat.kernel, Kernel::Cells);
    bench.choose("Kernel", "Points as ellipsoids");
    assert_eq!(scene(&bench).splat.kernel, Kernel::Ellipsoids);
    assert_eq!(scene(&bench).own_kernels(), Some((Kernel::Ellipsoids, 600)));
}

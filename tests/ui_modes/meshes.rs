//! Meshes: drawn as they are, with every control that grids have.

use eframe::egui::accesskit::Role;
use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use voxsplat::app::words;
use voxsplat::kernel::Kernel;
use voxsplat::scene::{ByArray, PolygonLook, Scene};
use voxsplat::transfer::ColourMap;

use super::press;
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
    assert!(bench.tells("600") && bench.tells(&words::count(2304)) && bench.shows("Median edge"));
    assert!(bench.tells(" by volume"), "points lie closer together here than there");
    // Evenly spaced samples stand for it only while it moves: they have no dimensions of their own.
    assert!(bench.shows("Sampled") && !bench.shows("Dimensions"));
    // What another file has no cells for is drawn as that opens.
    bench.open("some.nrrd");
    bench.settle();
    assert_eq!(scene(&bench).splat.kernel, Kernel::BSpline);
}

/// The lattice that stands for it has dimensions that the file knows nothing of.
#[test]
fn a_curvilinear_grid_is_told_by_its_own_points_and_cells() {
    let bench = opened("bent.vts");
    assert_eq!(scene(&bench).splat.kernel, Kernel::Cells);
    assert!(
        bench.tells("5 × 4 × 3, curvilinear") && bench.tells("24") && bench.shows("Median edge")
    );
    assert!(bench.shows("Sampled") && !bench.shows("Dimensions") && !bench.shows("In the file"));
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
fn what_is_of_samples_alone_is_not_shown_of_cells() {
    let mut bench = opened("ring.vtu");
    let of_samples = [
        "Splats",
        "Classic splatting",
        "Reconstruction",
        "Visibility",
        "Extent",
        "Coarse octree",
        "Show octree cells",
        "Slabs per voxel",
    ];
    for name in of_samples {
        assert!(!bench.shows(name), "{name}");
    }
    for name in ["Drawing", "Kernel", "Colouring", "Slabs per sample", "Opacity over"] {
        assert!(bench.shows(name), "{name}");
    }
    // What it is told to be is what it is.
    let unit = bench.harness.get_by_role_and_label(Role::Slider, "Opacity over");
    let shown = unit.accesskit_node().numeric_value();
    assert_eq!(shown, Some(scene(&bench).opacity_unit_distance()));
    bench.harness.key_press(Key::G);
    bench.settle();
    assert!(!bench.window().cells().on && bench.tells("have no octree"));
    // Its samples have all of it.
    bench.choose("Kernel", "Linear");
    for name in of_samples {
        assert!(bench.shows(name), "{name}");
    }
}

#[test]
fn scattered_points_open_as_ellipsoids_and_meshes_are_drawn_so_where_that_is_chosen() {
    let mut bench = opened("points.csv");
    assert_eq!(scene(&bench).splat.kernel, Kernel::Ellipsoids);
    assert!(scene(&bench).volume().is_some_and(|volume| volume.cells.is_none()));
    assert!(bench.tells("600") && !bench.shows("Median edge"));
    let spacing = scene(&bench).opacity_unit_distance();
    let share = spacing / scene(&bench).lattice().bounding_radius();
    assert!((0.01..0.2).contains(&share), "{spacing}");

    bench.open("ring.vtu");
    bench.settle();
    assert_eq!(scene(&bench).splat.kernel, Kernel::Cells);
    press(&mut bench, "Ellipsoids");
    assert_eq!(scene(&bench).splat.kernel, Kernel::Ellipsoids);
    assert_eq!(scene(&bench).own_kernels(), Some((Kernel::Ellipsoids, 600)));
    press(&mut bench, "Cells");
    assert_eq!(scene(&bench).splat.kernel, Kernel::Cells);
}

/// How the only mesh of a scene looks, and what its numbers are called by which it is coloured.
fn surface(bench: &Bench) -> (PolygonLook, Option<String>) {
    let [layer] = &scene(bench).polygons()[..] else { panic!("one surface") };
    let name = |by: ByArray| layer.mesh.arrays()[by.array].name.clone();
    (layer.look, layer.look.by.map(name))
}

#[test]
fn polygons_open_as_a_surface_in_the_colours_of_the_field_that_is_chosen() {
    let mut bench = opened("sheet.vtp");
    assert!(!scene(&bench).shows_field(), "its points are hidden");
    let (look, name) = surface(&bench);
    assert_eq!(name.as_deref(), Some("heat"));
    assert_eq!(look.by.map(|by| by.range), Some([0.0, 3.0]));
    assert!(scene(&bench).shading.lighting.is_some(), "lit");
    assert!(bench.shows("Mesh 1 colours"), "its section is open");
    // Other colours stay where another field is chosen.
    bench.choose("Mesh 1 colours", "Inferno");
    assert_eq!(surface(&bench).0.by.map(|by| by.map), Some(ColourMap::Inferno));
    bench.set_slider("Mesh 1 opacity", 0.5);
    bench.choose("Field", "load (cell)");
    bench.wait_until(|window| !window.is_loading());
    bench.settle();
    let (look, name) = surface(&bench);
    assert_eq!((name.as_deref(), look.opacity), (Some("load"), 0.5));
    let by = look.by.expect("coloured");
    assert_eq!((by.map, by.range), (ColourMap::Inferno, [10.0, 20.0]));
    assert!(!scene(&bench).shows_field());
    let shown = bench.harness.get_by_role_and_label(Role::CheckBox, "Its points as a volume");
    shown.click();
    bench.settle();
    assert!(scene(&bench).shows_field() && bench.shows("Graph"));
    bench.harness.get_by_role_and_label(Role::CheckBox, "Its points as a volume").click();
    bench.settle();
    assert!(
        !scene(&bench).shows_field()
            && bench.tells("The transfer function is for its points as a volume")
    );
    assert!(!bench.shows("Graph"), "nothing is edited that nobody sees");
    // And by none.
    bench.choose("Mesh 1 colour by", "Nothing");
    assert_eq!(surface(&bench).1, None);
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(surface(&bench).1.as_deref(), Some("load"));
}

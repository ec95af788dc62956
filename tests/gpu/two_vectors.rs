//! Two vector fields among each other and beside a scalar field, against their float64 reference.
//!
//! Measured on llvmpipe (LLVM 15, Mesa 22.3.6).

use glam::{DMat3, DVec3};
use voxsplat::core::{Camera, Srgb8};
use voxsplat::scene::{OpacityModel, Order, Scene, VectorLayer};
use voxsplat::task::draw::Rung;
use voxsplat::transfer::ColourSource;
use voxsplat::vector::{Design, Foreshortening, VectorMode, VectorSettings};
use voxsplat::volume::{Lattice, Places};

use crate::support::*;
use crate::vectors::{CLOSE, PICTURE, alone, field, holds, holds_at, settings, with};

/// The handful of vectors and as many others on the same grid, that look as differently as they can.
pub(crate) fn both() -> Scene {
    let first = alone();
    let other = field(first.vectors()[0].field.places.clone(), 21);
    let mut settings = VectorSettings {
        mode: VectorMode::Blend,
        design: Design::Comets,
        foreshortening: Foreshortening::Coordinates,
        stretch: 2.5,
        extent: Some(1.1),
        seed: 4,
        marks: Some(Srgb8([40, 255, 90])),
        ..settings(&other)
    };
    settings.transfer.opacity = vec![(2.0, 0.0), (9.0, 0.7)];
    settings.transfer.colour =
        ColourSource::Stops(vec![(0.0, Srgb8([255, 220, 0])), (10.0, Srgb8([200, 0, 255]))]);
    first.with(VectorLayer { field: other, settings })
}

/// With the second of its fields changed.
fn with_second(scene: Scene, change: impl FnOnce(&mut VectorLayer)) -> Scene {
    let mut layers = scene.vectors();
    change(layers.get_mut(1).expect("a second field"));
    with_vectors(scene, layers)
}

/// With one of its fields alone.
fn of_one(scene: Scene, which: usize) -> Scene {
    let layer = scene.vectors().swap_remove(which);
    with_vectors(scene, [layer])
}

fn with_modes(modes: [VectorMode; 2], (model, order): (OpacityModel, Order)) -> Scene {
    let scene = with(both(), |first| first.settings.mode = modes[0]);
    let mut scene = with_second(scene, |second| second.settings.mode = modes[1]);
    (scene.splat.opacity_model, scene.splat.order) = (model, order);
    scene
}

#[test]
fn two_fields_are_those_of_the_reference_in_every_pair_of_modes() {
    use OpacityModel::{OpticalDepth, Published};
    use Order::{BackToFront, FrontToBack};
    use VectorMode::{Blend, Modulate};
    for (modes, how) in [
        ([Modulate, Blend], (OpticalDepth, FrontToBack)),
        ([Blend, Modulate], (OpticalDepth, BackToFront)),
        ([Blend, Blend], (Published, FrontToBack)),
        ([Modulate, Modulate], (Published, BackToFront)),
    ] {
        let scene = with_modes(modes, how);
        holds(&format!("two fields, {modes:?}, {how:?}"), &scene, CLOSE);
        let mut beside = beside_field(scene);
        beside.splat.classify = match modes[1] {
            Modulate => voxsplat::scene::Classify::PreIntegrated,
            Blend => voxsplat::scene::Classify::After,
        };
        holds(&format!("two fields beside a scalar one, {modes:?}, {how:?}"), &beside, CLOSE);
    }
}

#[test]
fn ways_of_foreshortening_and_means_are_each_fields_own() {
    let scene = with(both(), |first| {
        first.settings.coarser = 1;
        first.settings.foreshortening = Foreshortening::Polygon;
    });
    let scene = with_second(scene, |second| second.settings.foreshortening = Foreshortening::Table);
    holds("two fields, one halved", &scene, CLOSE);
    let scene = with(scene, |first| {
        first.settings.coarser = 0;
        first.settings.foreshortening = Foreshortening::Coordinates;
    });
    let scene = with_second(scene, |second| {
        second.settings.coarser = 1;
        second.settings.foreshortening = Foreshortening::Polygon;
    });
    holds("two fields, the other halved", &scene, CLOSE);
}

#[test]
fn fields_on_points_and_cells_and_on_points_of_their_own_share_their_slabs() {
    let moved = Lattice {
        spacing: DVec3::new(1.7, 1.1, 1.4),
        origin: DVec3::new(0.8, -0.7, 1.1),
        direction: DMat3::from_rotation_z(0.4),
        ..Lattice::unit([3, 3, 2])
    };
    for model in [OpacityModel::OpticalDepth, OpacityModel::Published] {
        let moved = field(Places::Lattice(moved), 9);
        let mut scene = with_second(both(), |second| second.field = moved);
        scene.splat.opacity_model = model;
        holds(&format!("two fields on two lattices, {model:?}"), &scene, CLOSE);
    }
    // Points of a sheared grid, told one by one.
    let places = Places::Lattice(moved);
    let count = moved.len();
    let at = |i: usize| places.at(i);
    let points = (0..count).map(|i| at(i).0 * 1.2).collect();
    let axes = (0..count).map(|i| at(i).1 * 1.2).collect();
    let uneven = field(Places::Points { dims: moved.dims, points, axes }, 9);
    let first_uneven = with(both(), |layer| layer.field = uneven.clone());
    holds("points of their own, then a lattice", &first_uneven, CLOSE);
    let second_uneven = with_second(both(), |second| second.field = uneven);
    holds("a lattice, then points of their own", &second_uneven, CLOSE);
}

/// A picture of either field alone is not that of both: what is compared could fail.
#[test]
fn either_field_would_be_missed() {
    let Some(mut drawer) = drawer() else { return };
    let mut light = |scene: &Scene| drawn(&mut drawer, scene, PICTURE, Rung::Full).0;
    let found = light(&both());
    let [first, second] = [0, 1].map(|which| light(&of_one(both(), which)));
    for missing in [first, second] {
        assert!(fault(&found, &missing, CLOSE).is_some(), "a field is not missed");
    }
}

#[test]
fn a_second_field_of_nothing_changes_no_bit_and_one_field_has_no_trace_of_another() {
    let Some(context) = context(voxsplat::gpu::Wishes::default()) else { return };
    let mut drawer = voxsplat::task::draw::Drawer::new(voxsplat::gpu::Renderer::new(context));
    let all = both();
    let one = of_one(all.clone(), 0);
    let (before, _) = drawn(&mut drawer, &one, PICTURE, Rung::Full);
    let (bytes, pipelines) = (
        drawer.engines.gpu().expect("a device").size_bytes(),
        drawer.engines.gpu().expect("a device").pipeline_count(),
    );
    let nothing = with_second(all.clone(), |second| second.settings.transfer.opacity.clear());
    assert_eq!(drawn(&mut drawer, &nothing, PICTURE, Rung::Full).0, before);
    // Nor do the shorter steps of what does not show make slabs thinner.
    let near = Lattice { spacing: DVec3::splat(0.2), ..Lattice::unit([5, 4, 4]) };
    let finer = with_second(nothing, |second| second.field = field(Places::Lattice(near), 21));
    assert_eq!(drawn(&mut drawer, &finer, PICTURE, Rung::Full).0, before);
    drawn(&mut drawer, &all, PICTURE, Rung::Full);
    // A second field is more of the same: nothing is compiled for it.
    assert_eq!(drawer.engines.gpu().expect("a device").pipeline_count(), pipelines);
    drawer.engines.gpu().expect("a device").time_passes();
    let mut names = |scene: &Scene| {
        let (light, _) = drawn(&mut drawer, scene, PICTURE, Rung::Full);
        let times = drawer.engines.gpu().expect("a device").times();
        (light, times.iter().map(|pass| pass.name).collect::<Vec<_>>())
    };
    let (_, with_second) = names(&Scene { phase: 0.4, ..all.clone() });
    let (after, with_one) = names(&one);
    assert_eq!(after, before);
    assert!(with_one.contains(&"count_vectors"), "{with_one:?}");
    assert_eq!(with_second, ["composite_vectors"], "lists stay while time passes");
    let lists = drawer.engines.gpu().expect("a device").list_bytes();
    assert!(
        drawer.engines.gpu().expect("a device").size_bytes() - lists <= bytes,
        "records and marks are let go of"
    );
}

/// Marks of a few pixels: each design is as bright as it is from near, by what its own table has lost.
#[test]
fn marks_of_both_are_seen_from_afar_as_the_reference_has_them() {
    let modes = [VectorMode::Modulate; 2];
    for foreshortening in [Foreshortening::Table, Foreshortening::Coordinates] {
        let scene = with_modes(modes, (OpacityModel::OpticalDepth, Order::FrontToBack));
        let scene = with_second(scene, |second| second.settings.foreshortening = foreshortening);
        holds_at(&format!("two designs from afar, {foreshortening:?}"), &scene, [24, 20], CLOSE);
    }
}

/// Layers are counted for the splats of both: farther than those of the first may reach.
#[test]
fn a_second_field_far_before_and_behind_the_first_is_whole() {
    let (spacing, origin) = (DVec3::new(1.0, 1.0, 20.0), DVec3::new(0.3, 0.2, -70.0));
    let long = Lattice { spacing, origin, ..Lattice::unit([3, 3, 8]) };
    let mut scene = with_second(both(), |second| second.field = field(Places::Lattice(long), 9));
    let Camera { focal_point, up, parallel_scale, .. } = scene.camera;
    let along = DVec3::new(-0.02, 0.03, -1.0);
    scene.camera = Camera::new(focal_point, along, up, parallel_scale);
    holds("two fields, one far before and behind", &scene, CLOSE);
}

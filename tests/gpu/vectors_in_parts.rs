//! Rays among vectors that wait for further dispatches: the same bits as in one, and the float64 reference's
//! picture where one is not enough.
//!
//! Measured on llvmpipe (LLVM 15, Mesa 22.3.6).

use glam::DVec3;
use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::scene::{
    Classify, Clip, ClipBox, CutFaces, Inside, Isosurface, OpacityModel, Order, Plane, Scene,
    Slice, SplatSettings, VectorLayer,
};
use voxsplat::task::draw::{Drawer, Observer, Rung};
use voxsplat::task::engines::Canvas;
use voxsplat::vector::VectorMode;
use voxsplat::volume::{Lattice, Places};

use crate::polygons::{layer, squares};
use crate::support::*;
use crate::vectors::{CLOSE, alone, expected, field, settings, with};

const SIZE: [u32; 2] = [40, 36];

/// Lets pieces take as long as they will, and so be as large as they may.
struct Patient;

impl Observer for Patient {
    fn piece_done(&mut self, _: &mut dyn Canvas, _: f64) -> bool {
        false
    }

    fn piece_ms(&self) -> f64 {
        1e9
    }
}

/// The picture, dispatches of the pass that composites it, and how often vectors were halved.
fn light(scene: &Scene, most_turns: Option<u64>) -> Option<(Light, u32, u32)> {
    light_at(scene, SIZE, most_turns)
}

fn light_at(scene: &Scene, size: [u32; 2], most_turns: Option<u64>) -> Option<(Light, u32, u32)> {
    let mut context = context(Wishes::default())?;
    context.most_turns = most_turns;
    let mut drawer = Drawer::new(Renderer::new(context));
    drawer.engines.gpu().expect("a device").time_passes().expect("it times");
    let plan = Plan::of(scene, size);
    drawer.prepare(&plan, &Ticket::new()).expect("prepared");
    let how = drawer.draw(&plan, Rung::Full, &mut Patient).expect("drawn");
    let light = wide(&drawer.engines.gpu().expect("a device").read_light().expect("read back"));
    let composites = ["composite_vectors", "reconstruct_slabs", "gather_kernels"];
    let passes = drawer
        .engines
        .gpu()
        .expect("a device")
        .times()
        .iter()
        .filter(|pass| composites.contains(&pass.name));
    Some((light, passes.map(|pass| pass.runs).sum(), how.vectors_halved))
}

/// Whether a picture has the same bits in parts, of at least so many dispatches.
#[track_caller]
fn is_the_same(name: &str, scene: &Scene, most_turns: u64, least: u32) {
    let (Some((whole, once, _)), Some((parts, runs, halved))) =
        (light(scene, None), light(scene, Some(most_turns)))
    else {
        return;
    };
    assert!(whole.iter().map(|p| p[3]).fold(0.0, f64::max) > 0.1, "{name} shows nothing");
    let apart = Difference::between(&whole, &parts).expect("comparable").max_abs;
    println!("measured {name}: {once} and {runs} dispatches, {apart:.1e} apart");
    assert!(once == 1 && runs >= least && halved == 0, "{name}: {once} {runs} {halved}");
    assert_eq!(apart, 0.0, "{name}");
}

fn back_to_front(mut scene: Scene) -> Scene {
    scene.splat.order = Order::BackToFront;
    scene
}

#[test]
fn vectors_alone_are_the_same_in_parts() {
    let scene = alone();
    is_the_same("vectors alone", &scene, 120, 10);
    is_the_same("vectors alone, back to front", &back_to_front(scene.clone()), 120, 10);
    let mut both = crate::two_vectors::both();
    both.splat.opacity_model = OpacityModel::Published;
    is_the_same("two fields", &in_perspective(both, 30.0), 120, 10);
    // Thin slabs, and so long lists.
    let mut embedded = scene;
    embedded.splat.slabs_per_voxel = 16.0;
    let squares = layer(squares(&embedded, 3, &[-1.1, -0.3, 0.17, 0.9]), 0.4);
    let embedded = with_polygons(embedded, [squares]);
    is_the_same("polygons among vectors", &embedded, 800, 3);
    is_the_same("polygons, back to front", &back_to_front(embedded), 800, 3);
}

#[test]
fn vectors_beside_a_field_are_the_same_in_parts() {
    let beside = beside_field(alone());
    is_the_same("beside a field", &beside, 160, 20);
    is_the_same("beside a field, back to front", &back_to_front(beside.clone()), 160, 20);
    let mut after = with(beside.clone(), |layer| layer.settings.mode = VectorMode::Blend);
    (after.splat.classify, after.splat.opacity_model) = (Classify::After, OpacityModel::Published);
    is_the_same("classified after", &in_perspective(after, 40.0), 100, 20);
    // Where rays meet no field, too.
    let wide = Lattice { origin: DVec3::new(-3.0, 1.0, -2.0), ..Lattice::unit([7, 3, 6]) };
    let other = field(Places::Lattice(wide), 9);
    let around = with(beside, |layer| {
        layer.settings = settings(&other);
        layer.field = other;
    });
    is_the_same("about a field", &crate::polygons::clear(around.clone()), 100, 20);
    is_the_same("about a field that shows", &around, 100, 20);
}

/// Polygons, slices, faces and levels among both, where rays wait in the midst of them.
#[test]
fn what_lies_among_a_field_and_vectors_keeps_its_place_in_parts() {
    let beside = beside_field(alone());
    let lattice = beside.lattice();
    let plane = |x, y, z| Plane {
        point: lattice.world_from_index(DVec3::new(2.1, 1.4, 1.7)),
        normal: DVec3::new(x, y, z),
    };
    let bounds = ClipBox { low: [0.2, 0.0, 0.13], high: [1.0, 0.8, 0.9] };
    let inside = Inside {
        clip: Clip {
            bounds: Some(bounds),
            planes: vec![plane(0.6, -0.3, 0.7)],
            faces: CutFaces::Coloured,
        },
        slices: vec![Slice { plane: plane(0.2, 0.9, 0.1), opacity: 0.6 }],
        isosurfaces: vec![Isosurface { value: 128.0, opacity: 0.7, colour: None }],
        ..Inside::default()
    };
    let opened = Scene { inside, ..beside.clone() };
    is_the_same("cut, sliced, with a level", &opened, 600, 4);
    is_the_same("the same, back to front", &back_to_front(opened.clone()), 600, 4);
    for (name, mut scene) in [("polygons", beside), ("polygons and all else", opened)] {
        scene.splat.slabs_per_voxel = 12.0;
        let squares = layer(squares(&scene, 3, &[-1.1, -0.3, 0.17, 0.9]), 0.4);
        let scene = with_polygons(scene, [squares]);
        is_the_same(name, &scene, 1500, 4);
        is_the_same(&format!("{name}, back to front"), &back_to_front(scene), 1500, 4);
    }
}

/// Levels far apart, as winds have them: very many slabs along a ray, which one dispatch could not walk.
#[test]
fn a_field_of_very_many_slabs_has_its_vectors() {
    let spacing = DVec3::new(1.0, 1.0, 20.0);
    let lattice = Lattice { spacing, ..Lattice::unit([5, 4, 4]) };
    let winds = field(Places::Lattice(lattice), 3);
    let settings = settings(&winds);
    let mut scene = scene(lattice, DVec3::new(-0.2, 0.3, -1.0));
    (scene.splat, scene.phase) = (alone().splat, alone().phase);
    let mut scene = scene.with(VectorLayer { field: winds, settings });
    scene.splat.slabs_per_voxel = 4.0;
    transfer_of(&mut scene).opacity = vec![(90.0, 0.0), (255.0, 0.02)];
    let Some((found, runs, halved)) = light(&scene, Some(300)) else { return };
    assert!(runs > 1 && halved == 0, "{runs} dispatches, halved {halved} times");
    let expected = expected(&scene, SIZE);
    print_measured("very many slabs", &found, &expected);
    assert_eq!(fault(&found, &expected, CLOSE), None);
}

/// Room is kept for some tiles, and a picture of more is drawn in several ranges of them.
#[test]
fn more_tiles_than_are_kept_at_a_time_lose_nothing() {
    const LARGE: [u32; 2] = [140, 140];
    let beside = beside_field(alone());
    let mut among = beside.clone();
    among.splat = SplatSettings { order: Order::FrontToBack, ..SplatSettings::SHADE_FIRST };
    among.splat.kernel = Kernel::Cubic;
    for (name, scene, turns) in
        [("alone", alone(), 100), ("beside a field", beside, 100), ("among samples", among, 1100)]
    {
        let (Some((whole, ..)), Some((parts, runs, _))) =
            (light_at(&scene, LARGE, None), light_at(&scene, LARGE, Some(turns)))
        else {
            return;
        };
        assert!(runs > 4, "{name}: {runs} dispatches");
        let apart = Difference::between(&whole, &parts).expect("comparable").max_abs;
        assert_eq!(apart, 0.0, "{name} of many tiles");
    }
}

/// What did not do in one dispatch is not tried again in one while lists and view are the same.
#[test]
fn an_animated_picture_in_parts_is_begun_once() {
    let Some(mut context) = context(Wishes::default()) else { return };
    context.most_turns = Some(120);
    let mut drawer = Drawer::new(Renderer::new(context));
    drawer.engines.gpu().expect("a device").time_passes().expect("it times");
    let still = alone();
    let mut passes = |phase: f64| {
        let scene = Scene { phase, ..still.clone() };
        drawn(&mut drawer, &scene, SIZE, Rung::Full);
        let times = drawer.engines.gpu().expect("a device").times().iter();
        times.map(|pass| (pass.name, pass.runs)).collect::<Vec<_>>()
    };
    passes(0.1);
    let again = passes(0.2);
    assert!(matches!(again[..], [("composite_vectors", 2..)]), "{again:?}");
}

//! Polygons where two things meet: at one depth, with clips alone, with isosurfaces, beside vectors in
//! every model, and at the limits of what is sorted. Against the float64 reference.

use glam::DVec3;
use voxsplat::core::Camera;
use voxsplat::polygons::Mesh;
use voxsplat::scene::{
    Classify, Clip, ClipBox, CutFaces, Inside, Isosurface, OpacityModel, Order, Plane, Scene,
};
use voxsplat::task::draw::Rung;
use voxsplat::task::engines::EngineKind;
use voxsplat::volume::{Lattice, demo};

use crate::inside::hill;
use crate::polygons::{
    CLOSE, SIZE, WITHIN, agrees, both, clear, coloured, compares, exact, expected, lattice, layer,
    shards, squares, with_tornado,
};
use crate::support::{drawer, drawn, drawn_or_refused, in_perspective, scene, with_polygons};

fn cut() -> Clip {
    let point = lattice().world_from_index(DVec3::new(4.6, 4.1, 6.3));
    let plane = Plane { point, normal: DVec3::new(0.5, -0.8, 0.6) };
    let bounds = ClipBox { low: [0.2, 0.13, 0.0], high: [0.83, 0.7, 0.61] };
    Clip { bounds: Some(bounds), planes: vec![plane], faces: CutFaces::Through }
}

/// Coloured faces are the lattice's: polygons beyond it are cut by the clip alone.
#[test]
fn polygons_beyond_the_lattice_are_cut_by_clips_alone() {
    let clip = Clip { bounds: None, faces: CutFaces::Coloured, ..cut() };
    let inside = Inside { clip, ..Inside::default() };
    let wide = layer(shards(10, 11, 3.0), 0.5);
    agrees("cut beyond", &Scene { inside, ..with_polygons(exact(), vec![wide]) }, WITHIN);
}

/// Polygons are the only surfaces of such a scene: another piece of shader than beside cut faces and slices.
#[test]
fn clips_without_faces_cut_polygons() {
    let inside = Inside { clip: cut(), ..Inside::default() };
    agrees("cut", &Scene { inside, ..with_polygons(exact(), both()) }, WITHIN);
    // An opaque square that is cut away hides nothing of the one behind it.
    let base = along_an_axis(13);
    let point = base.lattice().centre() + DVec3::Z;
    let planes = vec![Plane { point, normal: DVec3::NEG_Z }];
    let clip = Clip { bounds: None, planes, ..cut() };
    let inside = Inside { clip, ..Inside::default() };
    let squares = layer(squares(&base, 1, &[-3.0, 1.0]), 1.0);
    agrees("one of two cut away", &Scene { inside, ..with_polygons(base, vec![squares]) }, WITHIN);
}

/// Surfaces of both kinds are looked for in every slab, and the nearer one is laid down first.
#[test]
fn isosurfaces_and_polygons_lie_at_their_depths() {
    let Some(mut drawer) = drawer() else { return };
    for order in [Order::FrontToBack, Order::BackToFront] {
        let mut scene = with_polygons(hill(lattice()), both());
        scene.splat.slabs_per_voxel = 2.0;
        scene.splat.order = order;
        let level = |value, opacity| Isosurface { value, opacity, colour: None };
        scene.inside.isosurfaces = vec![level(60.0, 0.4), level(150.0, 0.7)];
        let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
        compares(&format!("levels, {order:?}"), &found, &expected(&scene), WITHIN);
    }
}

/// Along an axis of a lattice of unit cubes, with the middle one's centre at depth 0.
fn along_an_axis(depth: usize) -> Scene {
    let lattice = Lattice::unit([11, 9, depth]);
    let mut scene = Scene { splat: exact().splat, ..scene(lattice, DVec3::NEG_Z) };
    scene.camera = Camera::new(lattice.centre(), DVec3::NEG_Z, DVec3::Y, 6.37);
    scene
}

/// Three squares in the plane through the lattice's middle, alike but for their colours: their triangles'
/// numbers decide. Depth 0 is exact, and the face of a slab.
#[test]
fn what_lies_at_one_depth_lies_in_the_order_of_its_triangles() {
    let base = along_an_axis(13);
    let of = |colour, opacity| coloured(layer(squares(&base, 1, &[0.0]), opacity), colour);
    let layers = vec![of([250, 20, 20], 0.6), of([20, 250, 30], 0.5), of([30, 40, 250], 0.7)];
    for order in [Order::FrontToBack, Order::BackToFront] {
        let mut scene = with_polygons(base.clone(), layers.clone());
        scene.splat.order = order;
        agrees(&format!("three at one depth, {order:?}"), &scene, WITHIN);
    }
}

/// Up to 1e-4 of the way from the eye to the plane in focus.
#[test]
fn polygons_close_to_the_eye_are_seen_up_to_where_they_are_left_out() {
    let base = in_perspective(clear(exact()), 60.0);
    let eye = base.camera.eye_distance().expect("an eye");
    let of = |share: f64, colour| {
        coloured(layer(squares(&base, 1, &[eye * (share - 1.0)]), 0.5), colour)
    };
    let layers = vec![of(3e-4, [250, 20, 20]), of(3e-5, [20, 250, 30]), of(0.9, [30, 40, 250])];
    agrees("close to the eye", &with_polygons(base.clone(), layers), WITHIN);
}

/// So many that sorting them takes more turns than a software adapter's loops have, though all but the first are
/// hidden in the end.
#[test]
fn more_polygons_over_a_pixel_than_can_be_sorted_are_refused() {
    let Some(mut drawer) = drawer() else { return };
    let base = exact();
    // Two triangles each, on their common edge.
    let depths: Vec<f64> = (0..3000).map(|i| f64::from(i) * 0.0005).collect();
    let scene = with_polygons(base.clone(), vec![layer(squares(&base, 1, &depths), 1.0)]);
    let ends_loops = drawer.engines.gpu().expect("a device").context().ends_loops;
    let (found, engine) = drawn_or_refused(&mut drawer, &scene, SIZE);
    assert_eq!(engine == EngineKind::Native, ends_loops);
    let first = with_polygons(base.clone(), vec![layer(squares(&base, 1, &depths[..1]), 1.0)]);
    let (alone, _) = drawn_or_refused(&mut drawer, &first, SIZE);
    let apart = found.iter().flatten().zip(alone.iter().flatten()).map(|(a, b)| (a - b).abs());
    // Edges are sampled on other places by the two engines: 24 of 255 at most, in a few pixels.
    assert!(apart.clone().filter(|&off| off > 2e-3).count() < 60, "hidden ones were seen");
    drawn(&mut drawer, &base, SIZE, Rung::Full);
}

/// What vectors have of a slab is shared out beside its matter in every model.
#[test]
fn polygons_split_vectors_and_matter_in_every_model() {
    let grid = demo::open("tornado:10", None).expect("a demo");
    let mut base = scene(grid.lattice, DVec3::new(0.4, 0.9, -0.5));
    base.splat = exact().splat;
    let reach = grid.lattice.bounding_radius();
    let depths = [-0.4, -0.1, 0.13, 0.3].map(|share| share * reach);
    let tilted: Mesh = squares(&base, 3, &depths);
    let body = coloured(layer(tilted, 0.5), [90, 200, 240]);
    for (name, classify, model) in [
        ("in the middle", Classify::After, OpacityModel::OpticalDepth),
        ("published", Classify::PreIntegrated, OpacityModel::Published),
    ] {
        let mut scene = with_polygons(with_tornado(base.clone(), false), vec![body.clone()]);
        (scene.splat.classify, scene.splat.opacity_model) = (classify, model);
        agrees(&format!("beside vectors, {name}"), &scene, CLOSE);
    }
}

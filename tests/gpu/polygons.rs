//! Polygons embedded in a volume, against the float64 reference, which meets triangles one by one.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use voxsplat::core::Srgb8;
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::polygons::Mesh;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    Classify, Clip, ClipBox, CutFaces, Inside, Isosurface, Lighting, OpacityModel, Order, Plane,
    PolygonLayer, Scene, Shading, Slice, SplatSettings, VectorLayer,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::Lattice;

use crate::support::{
    Light, Within, context, drawer, drawn, fault, in_perspective, print_measured, random, scene,
};

const SIZE: [u32; 2] = [36, 30];

/// As without polygons (`inside`).
const WITHIN: Within = Within { max_abs: 2e-3, rmse: 2.2e-4, bias: 5e-5 };
/// Pixels, of 1080, in which an edge passes so near to a sample that 8 bits of a pixel decide otherwise.
const MOST_AT_EDGES: usize = 12;

fn lattice() -> Lattice {
    Lattice { spacing: DVec3::new(1.0, 1.3, 0.7), ..Lattice::unit([11, 9, 13]) }
}

fn exact() -> Scene {
    Scene { splat: SplatSettings::EXACT, ..scene(lattice(), DVec3::new(0.4, 0.9, -0.5)) }
}

/// Triangles of random corners about the lattice, some beyond it, none sharing any.
fn shards(count: usize, seed: u64, reach: f64) -> Mesh {
    let lattice = lattice();
    let half = lattice.bounding_radius() * reach;
    let at = |i: usize| {
        let part = |axis: usize| 2.0 * random(seed, 3 * i + axis) - 1.0;
        (lattice.centre() + DVec3::new(part(0), part(1), part(2)) * half).as_vec3()
    };
    let positions: Vec<Vec3> = (0..3 * count).map(at).collect();
    let colour = |i: usize| Srgb8([0, 1, 2].map(|c| (random(seed + 1, 3 * i + c) * 255.0) as u8));
    let colours = (0..3 * count).map(colour).collect();
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new("shards", positions, Vec::new(), colours, triangles).expect("a mesh")
}

/// A closed body with shared corners about the lattice's middle: an octahedron.
fn octahedron(size: f32) -> Mesh {
    let middle = lattice().centre().as_vec3() + Vec3::new(0.3, -0.2, 0.4);
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * size);
    let positions =
        axes.iter().flat_map(|&axis| [middle + axis, middle - axis]).collect::<Vec<_>>();
    let mut triangles = Vec::new();
    for i in 0..8_u32 {
        let side = |axis: u32| 2 * axis + (i >> axis & 1);
        triangles.push([side(0), side(1), side(2)]);
    }
    Mesh::new("octahedron", positions, Vec::new(), Vec::new(), triangles).expect("a mesh")
}

fn layer(mesh: Mesh, opacity: f64) -> PolygonLayer {
    PolygonLayer { opacity, ..PolygonLayer::new(Arc::new(mesh)) }
}

fn with(scene: Scene, polygons: Vec<PolygonLayer>) -> Scene {
    Scene { polygons, ..scene }
}

/// Translucent shards and an opaque, smooth body among them.
fn both() -> Vec<PolygonLayer> {
    let body = PolygonLayer {
        colour: Some(Srgb8([240, 200, 90])),
        is_smooth: true,
        ..layer(octahedron(2.7), 1.0)
    };
    vec![layer(shards(14, 3, 0.9), 0.45), body]
}

fn clear(mut scene: Scene) -> Scene {
    scene.transfer.opacity.iter_mut().for_each(|(_, alpha)| *alpha = 0.0);
    scene
}

fn expected(scene: &Scene) -> Light {
    Reference::new(scene, SIZE.map(|n| n as usize)).expect("a mode with meaning").picture()
}

/// Whether a picture is the reference's but for few pixels at edges, and not one without polygons.
#[track_caller]
fn agrees(name: &str, scene: &Scene, within: Within) {
    let Some(mut drawer) = drawer() else { return };
    let expected = expected(scene);
    let plain = Scene { polygons: Vec::new(), ..scene.clone() };
    let (plain, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    assert!(fault(&plain, &expected, within).is_some(), "{name} changes nothing");
    let (found, _) = drawn(&mut drawer, scene, SIZE, Rung::Full);
    compares(name, &found, &expected, within);
}

#[track_caller]
fn compares(name: &str, found: &Light, expected: &Light, within: Within) {
    print_measured(name, found, expected);
    let is_near =
        |(a, b): &(&[f64; 4], &[f64; 4])| (0..4).all(|c| (a[c] - b[c]).abs() < within.max_abs);
    let near: Vec<_> = found.iter().zip(expected).filter(is_near).collect();
    let off = found.len() - near.len();
    let (found, expected): (Light, Light) = near.into_iter().map(|(a, b)| (*a, *b)).unzip();
    print_measured(&format!("{name}, but for {off} pixels"), &found, &expected);
    assert!(off <= MOST_AT_EDGES, "{name}: {off} pixels");
    assert_eq!(fault(&found, &expected, within), None, "{name}");
}

#[test]
fn polygons_alone_are_the_references() {
    agrees("opaque", &with(clear(exact()), vec![layer(shards(8, 5, 0.9), 1.0)]), WITHIN);
    agrees("translucent", &with(clear(exact()), both()), WITHIN);
    let wide = vec![layer(shards(10, 11, 3.0), 0.5)];
    agrees("far beyond", &with(clear(exact()), wide.clone()), WITHIN);
    let perspective = in_perspective(clear(exact()), 60.0);
    agrees("perspective", &with(perspective.clone(), both()), WITHIN);
    // Some pass the eye's plane.
    agrees("about the eye", &with(perspective, wide), WITHIN);
}

#[test]
fn polygons_in_matter_are_the_references_in_every_slab_mode() {
    for (name, change) in [
        ("exact", (|_| ()) as fn(&mut SplatSettings)),
        ("back to front", |s| s.order = Order::BackToFront),
        ("published", |s| s.opacity_model = OpacityModel::Published),
        ("in the middle", |s| s.classify = Classify::After),
        ("tents", |s| s.kernel = Kernel::Linear),
    ] {
        let mut scene = with(exact(), both());
        change(&mut scene.splat);
        agrees(name, &scene, WITHIN);
    }
    agrees("in perspective", &with(in_perspective(exact(), 60.0), both()), WITHIN);
}

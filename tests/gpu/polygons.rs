//! Polygons embedded in a volume, against the float64 reference, which meets triangles one by one.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use voxsplat::core::Srgb8;
use voxsplat::gpu::{GpuError, Renderer, SlabField, Wishes};
use voxsplat::plan::Plan;
use voxsplat::polygons::Mesh;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    Classify, Clip, ClipBox, CutFaces, Inside, Lighting, OpacityModel, Order, Plane, PolygonLayer,
    Scene, Shading, Slice, SplatSettings, VectorLayer,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::{Lattice, demo};

use crate::support::{
    Light, Within, context, drawer, drawn, fault, in_perspective, print_measured, random, scene,
    transfer_of, with_polygons, without_field,
};

pub(crate) const SIZE: [u32; 2] = [36, 30];

/// As without polygons (`inside`).
pub(crate) const WITHIN: Within = Within { max_abs: 2e-3, rmse: 2.2e-4, bias: 5e-5 };
/// Pixels, of 1080, in which an edge passes so near to a sample that 8 bits of a pixel decide otherwise.
const MOST_AT_EDGES: usize = 12;
/// See the field and vectors of `vectors`.
pub(crate) const CLOSE: Within = Within { max_abs: 4e-3, rmse: 4e-4, bias: 1e-4 };

pub(crate) fn lattice() -> Lattice {
    Lattice { spacing: DVec3::new(1.0, 1.3, 0.7), ..Lattice::unit([11, 9, 13]) }
}

pub(crate) fn exact() -> Scene {
    Scene { splat: SplatSettings::EXACT, ..scene(lattice(), DVec3::new(0.4, 0.9, -0.5)) }
}

/// Triangles of random corners about the lattice, some beyond it, none sharing any.
pub(crate) fn shards(count: usize, seed: u64, reach: f64) -> Mesh {
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

pub(crate) fn layer(mesh: Mesh, opacity: f64) -> PolygonLayer {
    let mut layer = PolygonLayer::new(Arc::new(mesh));
    layer.look.opacity = opacity;
    layer
}

pub(crate) fn coloured(mut layer: PolygonLayer, colour: [u8; 3]) -> PolygonLayer {
    layer.look.colour = Some(Srgb8(colour));
    layer
}

/// Translucent shards and an opaque, smooth body among them.
pub(crate) fn both() -> Vec<PolygonLayer> {
    let mut body = coloured(layer(octahedron(2.7), 1.0), [240, 200, 90]);
    body.look.is_smooth = true;
    vec![layer(shards(14, 3, 0.9), 0.45), body]
}

pub(crate) fn clear(mut scene: Scene) -> Scene {
    transfer_of(&mut scene).opacity.iter_mut().for_each(|(_, alpha)| *alpha = 0.0);
    scene
}

pub(crate) fn expected(scene: &Scene) -> Light {
    Reference::new(scene, SIZE.map(|n| n as usize)).expect("a mode with meaning").picture()
}

/// Whether a picture is the reference's but for few pixels at edges, and not one without polygons.
#[track_caller]
pub(crate) fn agrees(name: &str, scene: &Scene, within: Within) {
    let Some(mut drawer) = drawer() else { return };
    let expected = expected(scene);
    let plain = with_polygons(scene.clone(), []);
    let (plain, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    assert!(fault(&plain, &expected, within).is_some(), "{name} changes nothing");
    let (found, _) = drawn(&mut drawer, scene, SIZE, Rung::Full);
    compares(name, &found, &expected, within);
}

#[track_caller]
pub(crate) fn compares(name: &str, found: &Light, expected: &Light, within: Within) {
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
    agrees("opaque", &with_polygons(clear(exact()), vec![layer(shards(8, 5, 0.9), 1.0)]), WITHIN);
    agrees("translucent", &with_polygons(clear(exact()), both()), WITHIN);
    let wide = vec![layer(shards(10, 11, 3.0), 0.5)];
    agrees("far beyond", &with_polygons(clear(exact()), wide.clone()), WITHIN);
    let perspective = in_perspective(clear(exact()), 60.0);
    agrees("perspective", &with_polygons(perspective.clone(), both()), WITHIN);
    // Some pass the eye's plane.
    agrees("about the eye", &with_polygons(perspective, wide), WITHIN);
}

#[test]
fn polygons_in_matter_are_the_references_in_every_slab_mode() {
    for (name, change) in [
        ("exact", (|_| ()) as fn(&mut SplatSettings)),
        ("back to front", |s| s.order = Order::BackToFront),
        ("published", |s| s.opacity_model = OpacityModel::Published),
        ("in the middle", |s| s.classify = Classify::After),
    ] {
        let mut scene = with_polygons(exact(), both());
        change(&mut scene.splat);
        agrees(name, &scene, WITHIN);
    }
    agrees("in perspective", &with_polygons(in_perspective(exact(), 60.0), both()), WITHIN);
}

/// What is cut away, faces, slices, isosurfaces and polygons, each at its depth.
#[test]
fn polygons_among_all_other_surfaces_are_the_references() {
    let lattice = lattice();
    let plane = Plane {
        point: lattice.world_from_index(DVec3::new(4.6, 4.1, 6.3)),
        normal: DVec3::new(0.5, -0.8, 0.6),
    };
    let across = Plane { normal: DVec3::new(0.1, 0.2, -0.9), ..plane };
    let inside = Inside {
        clip: Clip {
            bounds: Some(ClipBox { low: [0.2, 0.13, 0.0], high: [0.83, 0.7, 0.61] }),
            planes: vec![plane],
            faces: CutFaces::Coloured,
        },
        slices: vec![Slice { plane: across, opacity: 0.6, only_shown: false, edges: false }],
        ..Inside::default()
    };
    let mut scene = Scene { inside, ..with_polygons(exact(), both()) };
    scene.shading = Shading {
        lighting: Some(Lighting { ambient: 0.1, specular: 0.6, ..Lighting::default() }),
        ..Shading::default()
    };
    agrees("cut and sliced", &scene, WITHIN);
    scene.splat.order = Order::BackToFront;
    agrees("cut and sliced, back to front", &scene, WITHIN);
}

/// A scene without polygons is drawn with the passes, pipelines and bytes that it had before, and after
/// some were seen to the bit as before; and so are the polygons after another view.
#[test]
fn what_has_no_polygons_costs_nothing_and_the_same_ones_are_the_same_bits() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let plain = exact();
    let (before, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    let held = |drawer: &Drawer| {
        (
            drawer.engines.made_gpu().expect("a device").pipeline_count(),
            drawer.engines.made_gpu().expect("a device").size_bytes(),
        )
    };
    let (pipelines, bytes) = held(&drawer);
    assert_eq!(drawer.engines.gpu().expect("a device").polygon_bytes(), 0);
    let embedded = with_polygons(plain.clone(), both());
    let (first, _) = drawn(&mut drawer, &embedded, SIZE, Rung::Full);
    // The walk, and the two passes over pixels; those that rasterise are the polygons' own.
    assert_eq!(drawer.engines.gpu().expect("a device").pipeline_count(), pipelines + 3);
    let taken = drawer.engines.gpu().expect("a device").polygon_bytes();
    assert_eq!(held(&drawer).1, bytes + taken);
    let mut turned = embedded.clone();
    turned.camera = turned.camera.orbited(0.4, 0.2);
    drawn(&mut drawer, &turned, SIZE, Rung::Full);
    let (again, _) = drawn(&mut drawer, &embedded, SIZE, Rung::Full);
    assert_eq!(first, again, "the same bits");
    let mut hidden = embedded.clone();
    hidden.layers.iter_mut().filter(|l| l.look.is_surface()).for_each(|l| l.is_shown = false);
    let (after, _) = drawn(&mut drawer, &hidden, SIZE, Rung::Full);
    assert_eq!(after, before);
    assert_eq!(held(&drawer).1, bytes, "let go of");
}

/// A square across the view at a depth of the lattice, in so many strips, each of two triangles.
pub(crate) fn squares(scene: &Scene, strips: u32, depths: &[f64]) -> Mesh {
    let camera = &scene.camera;
    let reach = camera.parallel_scale * 0.8;
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for &depth in depths {
        let first = positions.len() as u32;
        for i in 0..=strips {
            let across = (2.0 * f64::from(i) / f64::from(strips) - 1.0) * reach;
            for up in [-reach, reach] {
                let place = camera.focal_point
                    + camera.right() * across
                    + camera.up * (up + 0.03 * across)
                    + camera.direction * depth;
                positions.push(place.as_vec3());
            }
        }
        for i in 0..strips {
            let [a, b] = [first + 2 * i, first + 2 * i + 1];
            triangles.extend([[a, b, a + 2], [a + 2, b, b + 2]]);
        }
    }
    Mesh::new("squares", positions, Vec::new(), Vec::new(), triangles).expect("a mesh")
}

/// Where triangles meet nothing shows between them, and nothing twice.
#[test]
fn seams_are_closed() {
    let Some(mut drawer) = drawer() else { return };
    let base = clear(exact());
    for opacity in [1.0, 0.5] {
        let scene = with_polygons(base.clone(), vec![layer(squares(&base, 57, &[0.3]), opacity)]);
        let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
        let inner = |i: usize| (6..30).contains(&(i % 36)) && (6..24).contains(&(i / 36));
        let inner: Vec<f64> = (0..found.len()).filter(|i| inner(*i)).map(|i| found[i][3]).collect();
        assert!(inner.iter().all(|alpha| (alpha - opacity).abs() < 1e-6), "{inner:?}");
        // And its edges are shares of a pixel.
        let partly = found.iter().filter(|p| p[3] > 0.01 && p[3] < opacity - 0.01).count();
        assert!(partly > 20, "{partly}");
    }
}

/// Hundreds over a pixel, some of them at one depth; and more than can be walked, in words.
#[test]
fn many_polygons_over_a_pixel_are_drawn_or_refused() {
    let base = exact();
    let depths: Vec<f64> = (0..300).map(|i| f64::from(i / 2) * 0.02 - 1.5).collect();
    let many = with_polygons(base.clone(), vec![layer(squares(&base, 1, &depths), 0.01)]);
    agrees("300 over a pixel", &many, WITHIN);
    let Some(mut drawer) = drawer() else { return };
    let depths: Vec<f64> = (0..1100).map(|i| f64::from(i) * 0.002).collect();
    // Of opaque ones the first hides all others.
    let opaque = with_polygons(base.clone(), vec![layer(squares(&base, 1, &depths), 1.0)]);
    drawn(&mut drawer, &opaque, SIZE, Rung::Full);
    let scene = with_polygons(base.clone(), vec![layer(squares(&base, 1, &depths), 0.01)]);
    let plan = Plan::of(&scene, SIZE);
    drawer.prepare(&plan, &voxsplat::core::Ticket::new()).expect("prepared");
    let is_drawn = match drawer.draw(&plan, Rung::Full, &mut ()) {
        Err(error) => error != GpuError::EndedLoops.into(),
        Ok(_) => true,
    };
    drawn(&mut drawer, &base, SIZE, Rung::Full);
    drop(drawer);
    if is_drawn {
        agrees("1100 over a pixel", &scene, WITHIN);
    }
}

/// What the mode converges to meets them too.
#[test]
fn fine_slabs_come_to_the_continuous_integral_with_polygons() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = with_polygons(exact(), both());
    let limit = Reference::exact(&scene, SIZE.map(|n| n as usize)).expect("a mode").picture();
    scene.splat.slabs_per_voxel = 16.0;
    let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    compares("16 slabs a voxel", &found, &limit, WITHIN);
}

/// Where kernels are smaller than pixels, each of a pixel's rays meets the pixel's polygons.
#[test]
fn all_rays_of_a_pixel_meet_its_polygons() {
    let Some(mut drawer) = drawer() else { return };
    let size = [12, 10];
    let mut scene = with_polygons(exact(), both());
    scene.camera.parallel_scale *= 2.2;
    let view = voxsplat::scene::View::new(&scene, size);
    let rays = view.rays_per_side(scene.splat.kernel, scene.splat.extent);
    assert!(rays > 1, "{rays}");
    let expected = Reference::supersampled(&scene, [12, 10], rays as usize, false);
    let expected = expected.expect("a mode").picture();
    let (found, _) = drawn(&mut drawer, &scene, size, Rung::Full);
    compares("several rays", &found, &expected, WITHIN);
}

pub(crate) fn with_tornado(scene: Scene, alone: bool) -> Scene {
    let grid = demo::open("tornado:10", None).expect("a demo");
    let field = grid.fields.iter().find(|field| field.components == 3).expect("vectors");
    let vectors = grid.vectors(field, &voxsplat::core::Ticket::new()).expect("vectors");
    let mut layer = VectorLayer::new(Arc::new(vectors));
    layer.settings.coarser = 0;
    let scene = scene.with(layer);
    if alone { without_field(scene) } else { scene }
}

/// What slabs have of vectors is split at polygons, beside a field and alone.
#[test]
fn polygons_among_vectors_are_the_references() {
    let grid = demo::open("tornado:10", None).expect("a demo");
    let lattice = grid.lattice;
    let mut base = scene(lattice, DVec3::new(0.4, 0.9, -0.5));
    base.splat = SplatSettings::EXACT;
    let body = |opacity| {
        let reach = lattice.bounding_radius();
        let depths = [-0.4, -0.1, 0.13, 0.3].map(|share| share * reach);
        let tilted = squares(&base, 3, &depths);
        vec![coloured(layer(tilted, opacity), [90, 200, 240])]
    };
    for alone in [true, false] {
        for order in [Order::FrontToBack, Order::BackToFront] {
            let mut scene = with_polygons(with_tornado(base.clone(), alone), body(0.5));
            scene.splat.order = order;
            agrees(&format!("among vectors, alone {alone}, {order:?}"), &scene, CLOSE);
        }
    }
}

/// Quick pictures show them, at their size.
#[test]
fn previews_show_polygons() {
    let Some(mut drawer) = drawer() else { return };
    let scene = with_polygons(clear(exact()), vec![layer(octahedron(3.0), 1.0)]);
    drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let rung = Rung::Reduced { field: SlabField::Own, shrink: 2.0 };
    let (quick, drawn) = drawn(&mut drawer, &scene, SIZE, rung);
    assert_eq!(drawn.size, [18, 15]);
    let expected = Reference::new(&scene, [18, 15]).expect("a mode").picture();
    compares("a preview", &quick, &expected, WITHIN);
}

//! Scenes that few have, by the native engine: each held to the float64 reference, or to the same scene drawn another
//! way.

mod beside;
mod borders;
mod field_colours;
mod hard;
mod hard_cells;
mod jumps;
mod unasked;
mod within;

use std::sync::Arc;

use glam::{DQuat, DVec3, Vec3};
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::kernel::Kernel;
use voxsplat::polygons::Mesh;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    self, Classify, Isosurface, Lighting, OpacityModel, Order, PolygonLayer, Reconstruction,
    SampleSource, Scene, Slice, SplatSettings, VectorLayer, Visibility,
};
use voxsplat::task::engine::Engine;
use voxsplat::task::still::{Refine, Still, StillRequest};
use voxsplat::transfer::{ColourSource, TransferFunction};
use voxsplat::vector::{Design, VectorSettings};
use voxsplat::volume::{Lattice, Places, Samples, ScalarVolume, VectorField};

use crate::{alone, opened, still};

/// Odd, so that tiles and blocks reach beyond, and more than a cell of lists is large.
const SIZE: [u32; 2] = [45, 37];

/// A volume of values at indices.
fn volume(dims: [usize; 3], value: impl Fn([usize; 3]) -> f32) -> Arc<ScalarVolume> {
    let at = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
    let values = (0..dims.iter().product()).map(|i| value(at(i))).collect();
    let lattice = Lattice::unit(dims);
    let made = ScalarVolume::from_samples("made", lattice, Samples::Float32(values));
    Arc::new(made.unwrap())
}

/// The same look of values as they grow: red to blue, of opacities at values.
fn transfer(opacity: &[(f64, f64)]) -> TransferFunction {
    let [first, last] = [opacity[0].0, opacity[opacity.len() - 1].0];
    let stops = vec![(first, Srgb8([250, 60, 20])), (last, Srgb8([20, 90, 250]))];
    TransferFunction::of(opacity.to_vec(), ColourSource::Stops(stops))
}

/// A scene of a volume in the exact mode, seen askew.
fn scene_of(volume: Arc<ScalarVolume>, opacity: &[(f64, f64)]) -> Scene {
    let mut scene = scene::opening(SampleSource::default(), volume, None);
    *scene.transfer_mut().unwrap() = transfer(opacity);
    scene.splat = SplatSettings::EXACT;
    let lattice = scene.lattice();
    scene.camera =
        scene::framing_camera(&lattice, DVec3::new(0.35, -0.52, 0.78), DVec3::new(0.1, 0.9, 0.3));
    scene
}

/// Waves of 0 to 1.
fn waves(dims: [usize; 3]) -> Arc<ScalarVolume> {
    volume(dims, |at| {
        let [x, y, z] = at.map(|n| n as f32);
        0.5 + ((0.6 * x).sin() + (0.5 * y).sin() + (0.7 * z).sin()) / 6.0
    })
}

/// Winds about the middle of a scene, to all sides.
fn winds(scene: &Scene, design: Design) -> VectorLayer {
    let lattice = scene.lattice();
    let dims = [4; 3];
    let spacing = DVec3::from(lattice.dims.map(|n| n as f64 - 1.0)) / 4.0;
    let there = Lattice { spacing, ..Lattice::unit(dims) };
    let there = Lattice { origin: lattice.centre() - there.centre(), ..there };
    let vector = |i: u32| {
        let angle = 0.7 * i as f32;
        Vec3::new(angle.cos(), angle.sin(), 0.8 * (0.3 * i as f32).cos()) * (1 + i % 5) as f32
    };
    let vectors = (0..64).map(vector).collect();
    let field = VectorField::new("winds", Places::Lattice(there), vectors, &Ticket::new());
    let field = Arc::new(field.unwrap());
    let settings = VectorSettings {
        design,
        transfer: transfer(&[(0.0, 0.2), (5.0, 0.7)]),
        coarser: 0,
        ..VectorSettings::for_field(&field)
    };
    VectorLayer { field, settings }
}

/// Triangles by their corners, in shares of the lattice, with colours of corners if any.
fn triangles(scene: &Scene, corners: &[[[f32; 3]; 3]], colours: &[Srgb8]) -> PolygonLayer {
    let dims = scene.lattice().dims.map(|n| n as f32 - 1.0);
    let at = |share: &[f32; 3]| Vec3::from(*share) * Vec3::from(dims);
    let positions: Vec<Vec3> = corners.iter().flatten().map(at).collect();
    let sides = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh::new("shards", positions, Vec::new(), colours.to_vec(), sides).unwrap();
    PolygonLayer::new(Arc::new(mesh))
}

const SHARD: [[f32; 3]; 3] = [[0.1, 0.2, 0.3], [0.9, 0.25, 0.5], [0.4, 0.95, 0.8]];

/// A picture of a size.
fn drawn(engine: &Engine, scene: &Scene, size: [u32; 2]) -> Still {
    let (scene, refine) = (scene.clone(), Refine::Full);
    let request =
        StillRequest { scene, size, refine, repeat: 0, time_passes: false, smooth_edges: false };
    engine.still(request, &Ticket::new()).unwrap()
}

/// The root of the mean square of what two pictures are apart.
fn apart(one: &[[f32; 4]], other: &[[f64; 4]]) -> f64 {
    let pairs = one.as_flattened().iter().zip(other.as_flattened());
    let squares: f64 = pairs.map(|(a, b)| (f64::from(*a) - b).powi(2)).sum();
    (squares / (4 * one.len()) as f64).sqrt()
}

/// How far pictures are from the reference's: each says what it is of, and how far it may be off.
fn held_to_the_reference(scenes: &[(&str, Scene, [u32; 2], f64)]) {
    let engine = alone();
    let mut faults = Vec::new();
    for (name, scene, size, most) in scenes {
        let side = scene::View::new(scene, *size)
            .rays_per_side(scene.splat.kernel, scene.splat.extent) as usize;
        let truth = Reference::supersampled(scene, size.map(|n| n as usize), side, false);
        let truth = truth.unwrap().picture();
        let found = drawn(&engine, scene, *size);
        assert_eq!(found.not_native, None, "{name}");
        let off = apart(&found.light, &truth);
        let nothing = apart(&vec![[0.0; 4]; truth.len()], &truth);
        println!("measured {name}: {off:.1e}, of nothing {nothing:.1e}");
        faults.extend((off > *most).then(|| format!("{name}: {off:.1e} over {most:.1e}")));
        faults.extend((nothing < 10.0 * most).then(|| format!("{name}: hardly anything is seen")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// What an engine keeps from picture to picture serves only what it is of.
#[test]
fn nothing_is_left_of_pictures_before() {
    let plain = scene_of(waves([13, 12, 14]), &[(0.3, 0.0), (0.9, 0.6)]);
    let with = |splat: SplatSettings| Scene { splat, ..plain.clone() };
    let exact = SplatSettings::EXACT;
    let turned = |scene: &Scene| {
        let camera = scene.camera.rotated(DQuat::from_rotation_z(0.8));
        Scene { camera, ..scene.clone() }
    };
    let blown = plain.clone().with(winds(&plain, Design::default()));
    let later = Scene { phase: 0.4, ..blown.clone() };
    let comets = plain.clone().with(winds(&plain, Design::Comets));
    let cut = plain.clone().with(triangles(&plain, &[SHARD], &[]));
    let mut lit = with(SplatSettings::SHADE_FIRST);
    lit.shading.lighting = Some(Lighting::default());
    let mut denser = with(SplatSettings::SHADE_FIRST);
    denser.transfer_mut().unwrap().opacity = vec![(0.2, 0.0), (0.9, 0.9)];
    let mut capped = with(SplatSettings {
        opacity_model: OpacityModel::Published,
        slabs_per_voxel: 0.2,
        ..exact
    });
    capped.transfer_mut().unwrap().opacity = vec![(0.2, 0.9)];
    let other = scene_of(volume([13, 12, 14], |at| at[0] as f32 / 12.0), &[(0.2, 0.0), (0.9, 0.6)]);
    let first = |scene: &Scene| Scene { splat: SplatSettings::SHADE_FIRST, ..scene.clone() };
    let in_turn = [
        ("exact", plain.clone()),
        ("wider", with(SplatSettings { extent: Some(3.0), ..exact })),
        ("smooth", with(SplatSettings { reconstruction: Reconstruction::Smooth, ..exact })),
        ("capped", capped),
        ("exact again", plain.clone()),
        ("vectors", blown.clone()),
        ("vectors later", later.clone()),
        ("vectors turned", turned(&later)),
        ("other marks", comets),
        ("polygons", cut.clone()),
        ("polygons turned", turned(&cut)),
        ("shaded first", first(&plain)),
        ("denser", denser),
        ("lit", lit.clone()),
        ("lit, turned", turned(&lit)),
        ("another volume", other.clone()),
        ("another volume's samples", first(&other)),
        ("vectors alone", {
            let mut alone = blown;
            alone.show_field(false);
            alone
        }),
    ];
    let engine = alone();
    let mut most_bytes = 0;
    for (name, scene) in in_turn {
        let found = still(&engine, &scene).unwrap();
        let fresh = still(&alone(), &scene).unwrap();
        assert!(found.light == fresh.light, "{name}: {}", {
            let wide = fresh.light.iter().map(|p| p.map(f64::from)).collect::<Vec<_>>();
            apart(&found.light, &wide)
        });
        assert_eq!(found.capped_sums, fresh.capped_sums, "{name}");
        assert_eq!(found.capped_sums > 0, name == "capped", "{name}");
        let names = |still: &Still| still.passes.iter().map(|pass| pass.name).collect::<Vec<_>>();
        assert!(names(&fresh).iter().all(|name| names(&found).contains(name)), "{name}");
        assert!(names(&found).len() <= names(&fresh).len(), "{name}: {:?}", names(&found));
        most_bytes = found.peak_gpu_bytes.max(most_bytes);
        assert_eq!(found.peak_gpu_bytes, most_bytes, "{name}: what it held at most");
        assert!(most_bytes >= found.held.all, "{name}");
    }
}

/// Far to near and near to far are two ways to one picture, but for what rays leave out behind what hides all.
#[test]
fn both_orders_of_compositing_show_the_same() {
    let engine = alone();
    let mut scene = scene_of(waves([13, 12, 14]), &[(0.35, 0.0), (0.9, 0.5)]);
    let lattice = scene.lattice();
    scene.inside.slices =
        vec![Slice::across(&lattice, 2, 0.5, 0.4), Slice::across(&lattice, 0, 0.3, 0.5)];
    let level = Isosurface { value: 0.62, opacity: 0.5, colour: Some(Srgb8([230, 210, 90])) };
    scene.inside.isosurfaces = vec![level];
    let mut shards =
        triangles(&scene, &[SHARD, [[0.0, 0.1, 0.6], [0.8, 0.9, 0.6], [1.0, 0.0, 0.2]]], &[]);
    shards.look.opacity = 0.5;
    let scene = scene.clone().with(winds(&scene, Design::default())).with(shards);
    for (classify, opacity_model, slabs_per_voxel) in [
        (Classify::PreIntegrated, OpacityModel::OpticalDepth, 1.0),
        (Classify::PreIntegrated, OpacityModel::Published, 1.0),
        (Classify::PreIntegrated, OpacityModel::OpticalDepth, 0.4),
        (Classify::After, OpacityModel::OpticalDepth, 1.0),
        (Classify::After, OpacityModel::Published, 0.4),
    ] {
        let [near, far] = [Order::FrontToBack, Order::BackToFront].map(|order| {
            let exact = SplatSettings::EXACT;
            let splat = SplatSettings { classify, opacity_model, slabs_per_voxel, order, ..exact };
            drawn(&engine, &Scene { splat, ..scene.clone() }, SIZE).light
        });
        let wide: Vec<[f64; 4]> = far.iter().map(|pixel| pixel.map(f64::from)).collect();
        let off = apart(&near, &wide);
        println!(
            "measured both orders, {classify:?} {opacity_model:?} {slabs_per_voxel}: {off:.1e}"
        );
        // Of what lies behind it shows less than 5e-4.
        assert!(off < 1e-4, "{classify:?} {opacity_model:?} {slabs_per_voxel}: {off}");
        assert!(near.iter().filter(|pixel| pixel[3] > 0.3).count() > 400);
    }
}

/// Products and radial kernels of other widths, of which some leave gaps: nothing is there, and nothing lights it.
#[test]
fn fields_of_radial_kernels_of_any_width_are_those_of_the_reference() {
    let plain = scene_of(waves([11, 10, 12]), &[(0.3, 0.1), (0.9, 0.6)]);
    let mut scenes = Vec::new();
    for (name, kernel, extent, classify) in [
        ("a narrow cubic", Kernel::Cubic, 0.7, Classify::After),
        ("a narrow cubic, integrated", Kernel::Cubic, 0.7, Classify::PreIntegrated),
        ("a wide Gaussian", Kernel::Gaussian, 2.6, Classify::PreIntegrated),
    ] {
        let extent = Some(extent);
        let exact = SplatSettings::EXACT;
        let splat = SplatSettings { kernel, extent, classify, ..exact };
        let splat = SplatSettings { reconstruction: Reconstruction::Smooth, ..splat };
        let mut scene = Scene { splat, ..plain.clone() };
        scenes.push((name, scene.clone(), [24, 20], 1e-4));
        scene.shading.lighting = Some(Lighting::default());
        scenes.push((name, scene, [24, 20], 1e-4));
    }
    held_to_the_reference(&scenes);
}

/// Rays that pass along faces of what is kept, and along the lattice's axes.
#[test]
fn rays_along_the_planes_that_cut_see_what_the_reference_does() {
    let mut scene = scene_of(waves([12, 11, 13]), &[(0.3, 0.0), (0.9, 0.6)]);
    let bounds = scene::ClipBox { low: [0.3, 0.0, 0.2], high: [0.7, 0.6, 1.0] };
    scene.inside.clip.bounds = Some(bounds);
    let lattice = scene.lattice();
    let scenes = [("along z", DVec3::Z, DVec3::Y), ("along x", -DVec3::X, DVec3::Z)];
    let scenes = scenes.map(|(name, direction, up)| {
        let camera = scene::framing_camera(&lattice, direction, up);
        (name, Scene { camera, ..scene.clone() }, SIZE, 1e-4)
    });
    held_to_the_reference(&scenes);
}

/// A picture whose last kernels are shaded first, from within: boxes end at the eye.
#[test]
fn boxes_about_the_eye_end_there() {
    let mut scene = scene_of(waves([12, 11, 13]), &[(0.3, 0.0), (0.9, 0.4)]);
    scene.camera.focal_point = scene.lattice().centre();
    scene.camera.projection = voxsplat::core::Projection::Perspective { view_angle: 1.2 };
    scene.camera.parallel_scale = 0.8;
    let first = SplatSettings { kernel: Kernel::Nearest, ..SplatSettings::SHADE_FIRST };
    let ways = [("every box", Visibility::EverySample), ("slabs of boxes", Visibility::Slabs)];
    let scenes = ways.map(|(name, visibility)| {
        let splat = SplatSettings { visibility, ..first };
        (name, Scene { splat, ..scene.clone() }, [24, 20], 1e-5)
    });
    held_to_the_reference(&scenes);
}

/// The eye is in a box, and boxes far away are smaller than a pixel: each pixel is the mean of several rays.
#[test]
fn boxes_in_sheets_about_the_eye_are_those_of_the_reference() {
    let mut scene = opened("demo:head:24");
    scene.camera.projection = voxsplat::core::Projection::Perspective { view_angle: 2.1 };
    scene.camera.parallel_scale = 1.0;
    let sheets = SplatSettings {
        kernel: Kernel::Nearest,
        visibility: Visibility::Sheets,
        ..SplatSettings::SHADE_FIRST
    };
    let front = SplatSettings { order: Order::FrontToBack, ..sheets };
    // Measured 6e-7 at most, far to near. Rays that end early leave 2e-4 of what is behind.
    let scenes = [("far to near", sheets, 1e-5), ("near to far", front, 1e-4)]
        .map(|(name, splat, most)| (name, Scene { splat, ..scene.clone() }, [36, 24], most));
    held_to_the_reference(&scenes);
}

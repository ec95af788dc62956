//! Polygons in the colours of the field that they lie in, held to the field itself.

use glam::{DMat3, DVec2};
use voxsplat::rbf::{Basis, Encoding, Function};
use voxsplat::scene::POLYGON_COLOUR;
use voxsplat::task::field_on_mesh::field_on_meshes;

use super::*;

/// Samples along each axis.
const SIDE: usize = 17;

/// One function, which is known at every place, and a plane across it that reaches far beyond; the field itself is clear.
fn scene() -> Scene {
    let shape = DMat3::from_diagonal(DVec3::splat(3.0_f64.recip()));
    let function = Function::about(DVec3::new(8.0, 7.5, 8.5), shape, 0.7);
    let bounds = [DVec3::splat(-0.5), DVec3::splat(SIDE as f64 - 0.5)];
    let functions = Encoding::new(Basis::Gaussian, 0.2, 1e-9, [function], bounds);
    let at = |at: [usize; 3]| functions.value(DVec3::from(at.map(|n| n as f64))) as f32;
    let samples = volume([SIDE; 3], at);
    let volume = ScalarVolume { functions: Some(Arc::new(functions)), ..(*samples).clone() };
    let mut scene = scene_of(Arc::new(volume), &[(0.2, 0.0), (0.9, 0.0)]);
    scene.splat = SplatSettings::FUNCTIONS;
    // Colours shine by themselves.
    let shines = Lighting {
        ambient: 1.0,
        diffuse: 0.0,
        specular: 0.0,
        lights: Vec::new(),
        ..Default::default()
    };
    scene.shading.lighting = Some(shines);
    let plane = [[[-6.0, -6.0, 0.0775], [18.0, -6.0, 1.0375], [-6.0, 18.0, 0.6775]]];
    let mut layer = triangles(&scene, &plane, &[]);
    layer.look.by_field = true;
    scene.with(layer)
}

/// Where the middle of a pixel meets the plane of the mesh, world.
fn met(scene: &Scene, pixel: [u32; 2], size: [u32; 2]) -> DVec3 {
    let layer = &scene.polygons()[0];
    let triangle = layer.mesh.triangles(false).next().unwrap();
    let [a, b, c] = triangle.corners.map(|corner| layer.mesh.origin() + corner.as_dvec3());
    let normal = (b - a).cross(c - a);
    let middle = DVec2::from(pixel.map(|n| f64::from(n) + 0.5));
    let (start, along) = scene.camera.ray(middle, size.map(f64::from));
    start + along * ((a - start).dot(normal) / along.dot(normal))
}

/// The greatest difference of a channel from the colours of the field where it is met, from the plain colour beside it, and from
/// the plain colour within it.
fn off(scene: &Scene, found: &Still, size: [u32; 2]) -> [f64; 3] {
    let volume = scene.volume().unwrap();
    let functions = volume.functions.as_ref().unwrap();
    let plain = POLYGON_COLOUR.to_linear().0;
    let [mut within, mut beside, mut plainly] = [0.0_f64; 3];
    for (i, pixel) in found.light.iter().enumerate() {
        let at = met(scene, [i as u32 % size[0], i as u32 / size[0]], size);
        let from = |colour: [f64; 3]| {
            let differences = colour.iter().zip(pixel).map(|(a, b)| (a - f64::from(*b)).abs());
            differences.fold(0.0, f64::max)
        };
        let last = SIDE as f64 - 0.5;
        let is_in = |margin: f64| {
            at.cmpge(DVec3::splat(-0.5 - margin)).all()
                && at.cmple(DVec3::splat(last + margin)).all()
        };
        if is_in(-1.5) {
            let colour = scene.transfer().unwrap().colour.srgb_at(functions.value(at));
            within = within.max(from(colour.to_linear().0));
            plainly = plainly.max(from(plain));
        } else if !is_in(1.5) {
            beside = beside.max(from(plain));
        }
    }
    [within, beside, plainly]
}

#[test]
fn polygons_in_the_fields_colours_have_them_at_every_place_and_are_plain_beside_it() {
    let size = [90, 74];
    let mut scene = scene();
    // Before its values are known a mesh is plain.
    let engine = alone();
    let before = drawn(&engine, &scene, size);
    let found = field_on_meshes(&scene, &Ticket::new()).unwrap();
    assert!(found.len() == 1 && found[0].told.is_none());
    found.into_iter().for_each(|found| scene.give_field_values(found.values));
    let after = drawn(&engine, &scene, size);
    assert_eq!(after.not_native, None);
    let [within, beside, plainly] = off(&scene, &after, size);
    println!(
        "measured: {within:.1e} off the field's colours, {beside:.1e} off the plain one beside it"
    );
    // Measured: 1.8e-2 and 1.2e-8. Between corners a sample apart values bend by 0.01 of 0.7, and encoded colours as much again.
    assert!(within < 0.05, "{within}");
    assert!(beside < 1e-6, "{beside}");
    assert!(plainly > 0.3, "a comparison that cannot tell them apart: {plainly}");
    let [within, beside, _] = off(&scene, &before, size);
    assert!(within > 0.3 && beside < 1e-2, "{within} {beside}");
    // Another function has other colours, and needs no other values.
    let colour =
        ColourSource::Stops(vec![(0.2, Srgb8([10, 200, 40])), (0.9, Srgb8([240, 240, 10]))]);
    scene.transfer_mut().unwrap().colour = colour;
    let [within, ..] = off(&scene, &drawn(&engine, &scene, size), size);
    assert!(within < 0.05, "{within}");
    held_to_the_reference(&[("in the field's colours", scene, SIZE, 3e-3)]);
}

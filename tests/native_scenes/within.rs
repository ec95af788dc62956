//! What is within a field: samples without data, surfaces, tables and regions, single values.

use voxsplat::scene::{AlongRay, Shading};
use voxsplat::transfer::{NoData, Region, RegionShape};

use super::*;

/// Clear waves with holes at corners, and inside, of bricks.
fn holed() -> Scene {
    let full =
        |[x, y, z]: [usize; 3]| ((0.6 * x as f32).sin() + (0.5 * (y + z) as f32).cos()) / 4.0 + 0.5;
    let holes = [[3, 3, 3], [4, 8, 12], [7, 0, 15], [0, 11, 2], [8, 9, 4], [12, 12, 7]];
    let value = |at: [usize; 3]| if holes.contains(&at) { f32::NAN } else { full(at) };
    let mut scene = scene_of(volume([17, 14, 18], value), &[(0.0, 0.0), (1.0, 0.0)]);
    let no_data = NoData { opacity: 0.7, colour: Srgb8([250, 0, 200]) };
    scene.transfer_mut().unwrap().no_data = no_data;
    scene
}

#[test]
fn samples_without_data_show_where_nothing_else_does() {
    let clear = holed();
    let opacity = vec![(0.4, 0.0), (0.9, 0.3)];
    let mut shown = clear.clone();
    shown.transfer_mut().unwrap().opacity = opacity;
    let mut hidden = shown.clone();
    hidden.transfer_mut().unwrap().no_data.opacity = 0.0;
    let exact = SplatSettings::EXACT;
    let after = SplatSettings { classify: Classify::After, ..exact };
    let published = SplatSettings { opacity_model: OpacityModel::Published, ..after };
    let first = SplatSettings::SHADE_FIRST;
    let lit = |mut scene: Scene| {
        scene.shading.lighting = Some(Lighting::default());
        scene
    };
    let surfaces = |mut scene: Scene| {
        scene.inside.slices = vec![Slice::across(&scene.lattice(), 2, 4.0 / 17.0, 0.8)];
        let level = Isosurface { value: 0.5, opacity: 0.6, colour: None };
        scene.inside.isosurfaces = vec![level];
        // What passes a level twice in a slab is not met.
        scene.splat.slabs_per_voxel = 4.0;
        scene
    };
    let with = |scene: &Scene, splat: SplatSettings| Scene { splat, ..scene.clone() };
    let scenes = [
        ("alone", clear.clone()),
        ("alone, values in the middle", with(&clear, after)),
        ("published, values in the middle", with(&shown, published)),
        ("lit", lit(shown.clone())),
        ("shaded first, lit", lit(with(&shown, first))),
        ("hidden, shaded first, lit", lit(with(&hidden, first))),
        ("surfaces", surfaces(shown)),
        ("surfaces, hidden", surfaces(hidden)),
    ];
    let most = |name: &str| if name.starts_with("surfaces") { 6e-3 } else { 1e-4 };
    let scenes = scenes.map(|(name, scene)| (name, scene, SIZE, most(name)));
    held_to_the_reference(&scenes);
}

#[test]
fn isosurfaces_show_where_no_matter_does() {
    let mut scene = scene_of(waves([13, 12, 14]), &[(0.0, 0.0), (1.0, 0.0)]);
    let surface = |value, opacity| Isosurface { value, opacity, colour: None };
    scene.inside.isosurfaces = vec![surface(0.8, 0.6), surface(0.3, 1.0)];
    // What passes a level twice in a slab is not met.
    scene.splat.slabs_per_voxel = 4.0;
    held_to_the_reference(&[("isosurfaces alone", scene, SIZE, 6e-3)]);
}

/// The only value that shows is the first of its cell.
#[test]
fn a_single_label_shows() {
    let label = |[x, y, z]: [usize; 3]| ((x / 3 + y / 4 + z / 5) % 6) as u8;
    let dims = [12, 11, 13];
    let at = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
    let samples = Samples::UInt8((0..dims.iter().product()).map(|i| label(at(i))).collect());
    let volume = ScalarVolume::from_samples("labels", Lattice::unit(dims), samples).unwrap();
    let opacity = [(2.0, 0.0), (2.5, 0.0), (2.6, 0.5), (3.4, 0.5), (3.5, 0.0), (5.0, 0.0)];
    let mut scene = scene_of(Arc::new(volume), &opacity);
    scene.splat = SplatSettings { kernel: Kernel::Nearest, ..SplatSettings::EXACT };
    held_to_the_reference(&[("a label", scene, SIZE, 2e-4)]);
}

/// Gradients that are all rounding light nothing; those of twice the least do.
#[test]
fn noise_far_under_what_values_differ_by_is_not_lit() {
    let dims = [12, 11, 13];
    let value = |[x, y, z]: [usize; 3]| match [x, y, z] {
        // A corner that says how far values reach.
        [0, 0, 0] => 1000.0,
        _ => 1.0 + 1e-6 * ((x * 7 + y * 5 + z * 3) % 4) as f32,
    };
    let mut scene = scene_of(volume(dims, value), &[(0.0, 0.3), (1000.0, 0.4)]);
    scene.shading.lighting = Some(Lighting::default());
    scene.splat.kernel = Kernel::Linear;
    held_to_the_reference(&[("noise", scene, [24, 20], 1e-4)]);
}

/// Regions by gradients under published opacities, and lights of which only what is ambient counts.
#[test]
fn regions_and_ambient_light_are_those_of_the_reference() {
    let plain = scene_of(waves([12, 11, 13]), &[(0.2, 0.1), (0.9, 0.5)]);
    let mut regions = plain.clone();
    regions.splat.opacity_model = OpacityModel::Published;
    regions.shading = Shading {
        regions: vec![Region {
            shape: RegionShape::Rectangle,
            values: [0.3, 0.8],
            strengths: [0.0, 0.3],
            softness: 0.5,
            opacity: 0.9,
            colour: Some(Srgb8([255, 40, 10])),
        }],
        ..Shading::default()
    };
    let mut ambient = plain.clone();
    let none = Lighting { ambient: 0.4, diffuse: 0.0, specular: 0.0, ..Lighting::default() };
    ambient.shading.lighting = Some(none);
    let mut without_lights = plain;
    without_lights.shading.lighting =
        Some(Lighting { ambient: 0.5, lights: Vec::new(), ..Lighting::default() });
    let scenes = [
        ("published regions", regions),
        ("ambient light alone", ambient),
        ("no lights", without_lights),
    ];
    let scenes = scenes.map(|(name, scene)| (name, scene, [30, 24], 3e-4));
    held_to_the_reference(&scenes);
}

/// Several rays a pixel share it.
#[test]
fn projected_values_of_few_pixels_are_means_of_rays() {
    let mut scene = scene_of(waves([24, 22, 26]), &[(0.1, 0.2), (0.9, 0.6)]);
    let mut scenes = Vec::new();
    for (name, along) in [("greatest", AlongRay::Maximum), ("mean", AlongRay::Average)] {
        scene.inside.along = along;
        scenes.push((name, scene.clone(), [9, 7], 1e-3));
    }
    held_to_the_reference(&scenes);
}

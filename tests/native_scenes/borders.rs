//! Cells where they end: lit as their outer faces are turned.

use voxsplat::cells::{CellField, Cells, On};
use voxsplat::scene::{Attached, Light, Shading};

use super::*;

const SIDES: [u32; 2] = [72, 60];

/// Blocks of one value, opaque within a hundredth of a sample, so many along each axis between two corners of the lattice, under one light.
fn block(blocks: [usize; 3], [low, high]: [DVec3; 2], slabs_per_voxel: f64) -> Scene {
    let sides = blocks.map(|n| n + 1);
    let place = |i: usize| {
        let at = [i % sides[0], i / sides[0] % sides[1], i / (sides[0] * sides[1])];
        let share = DVec3::from([0, 1, 2].map(|axis| at[axis] as f64 / blocks[axis] as f64));
        low + (high - low) * share
    };
    let count = sides.iter().product();
    let points: Arc<[DVec3]> = (0..count).map(place).collect();
    let cells = Arc::new(Cells::of_grid(&points, sides));
    let mut made =
        ScalarVolume::clone(&volume([10, 8, 8], |[x, ..]| if x < 5 { 4.0 } else { 6.0 }));
    made.cells = Some(Arc::new(CellField::new(cells, On::Points, vec![5.0; count])));
    let mut scene = scene_of(Arc::new(made), &[(4.0, 0.999), (6.0, 0.999)]);
    scene.splat = SplatSettings {
        slabs_per_voxel,
        opacity_unit_distance: Some(0.05),
        ..SplatSettings::CELLS
    };
    let light = Light {
        direction: DVec3::new(0.4, 0.3, 1.0),
        colour: Srgb8([255; 3]),
        attached: Attached::Camera,
    };
    let lights = vec![light];
    let lighting = Lighting { ambient: 0.15, diffuse: 0.8, specular: 0.0, exponent: 1.0, lights };
    scene.shading = Shading { lighting: Some(lighting), ..Shading::default() };
    scene
}

/// The shares of light of the three faces that are seen of a box.
fn shares(scene: &Scene) -> [f64; 3] {
    let lighting = scene.shading.lighting.as_ref().expect("lit");
    let towards = lighting.lights[0].towards(&scene.camera);
    DVec3::AXES.map(|axis| {
        let normal = if axis.dot(scene.camera.direction) > 0.0 { -axis } else { axis };
        lighting.ambient + lighting.diffuse * normal.dot(towards).max(0.0)
    })
}

/// A value that does not grow has no gradient: what is seen is the border alone. The plate is a seventh of a slab thick: each
/// slab that meets it has its front and its back.
#[test]
fn blocks_of_one_value_are_lit_as_their_faces_are_turned() {
    let engine = alone();
    let bulk = [DVec3::splat(1.0), DVec3::new(8.0, 6.0, 6.0)];
    let plate = [DVec3::new(1.0, 1.0, 3.0), DVec3::new(8.0, 6.0, 3.15)];
    for (name, blocks, ends, slabs) in [
        ("bulk", [2, 2, 2], bulk, 16.0),
        ("one", [1, 1, 1], bulk, 16.0),
        ("plate", [3, 2, 1], plate, 1.0),
    ] {
        let scene = block(blocks, ends, slabs);
        let plain = Scene { shading: Shading::default(), ..scene.clone() };
        let [lit, shining] = [&scene, &plain].map(|scene| drawn(&engine, scene, SIDES).light);
        let truth = Reference::new(&scene, SIDES.map(|n| n as usize)).unwrap().picture();
        let expected = shares(&scene);
        let mut seen = [0; 3];
        let (mut others, mut off) = (0, 0.0_f64);
        for ((lit, shining), truth) in lit.iter().zip(&shining).zip(&truth) {
            // Blue is least of the colour.
            if shining[3] < 0.05 {
                continue;
            }
            let share = f64::from(lit[0] / shining[0]);
            let face = expected.iter().position(|expected| (share - expected).abs() < 0.01);
            match face {
                Some(face) => seen[face] += 1,
                None => others += 1,
            }
            let apart = lit.iter().zip(truth).map(|(a, b)| (f64::from(*a) - b).abs());
            off = apart.fold(off, f64::max);
        }
        println!(
            "measured {name}: {seen:?} of {expected:?}, {others} otherwise, {off:.1e} off the reference"
        );
        let all = seen.iter().sum::<usize>() + others;
        // Edges are where two faces meet in a slab.
        assert!(others * 8 < all, "{name}: {others} of {all}");
        let faces = if name == "plate" { &seen[2..] } else { &seen[..] };
        assert!(faces.iter().all(|count| *count > 60), "{name}: {seen:?}");
    }
}

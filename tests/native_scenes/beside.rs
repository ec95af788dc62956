//! Vectors and polygons beside a field.

use voxsplat::core::Projection;
use voxsplat::scene::{Attached, Light};
use voxsplat::vector::{Foreshortening, VectorMode};

use super::*;

/// Each way of foreshortening, of both modes, under every rule of compositing.
#[test]
fn vectors_are_foreshortened_blended_and_composited_as_the_references_are() {
    let plain = scene_of(waves([9, 8, 10]), &[(0.4, 0.0), (0.9, 0.4)]);
    let exact = SplatSettings::EXACT;
    let published = OpacityModel::Published;
    let after = SplatSettings { classify: Classify::After, ..exact };
    let mut scenes = Vec::new();
    for (name, mode, foreshortening, splat) in [
        ("shortened", VectorMode::Modulate, Foreshortening::Polygon, exact),
        ("stretched", VectorMode::Modulate, Foreshortening::Coordinates, exact),
        ("blended", VectorMode::Blend, Foreshortening::Table, exact),
        ("values in the middle", VectorMode::Modulate, Foreshortening::Table, after),
        (
            "published",
            VectorMode::Blend,
            Foreshortening::Table,
            SplatSettings { opacity_model: published, ..exact },
        ),
        (
            "published, values in the middle",
            VectorMode::Blend,
            Foreshortening::Polygon,
            SplatSettings { opacity_model: published, ..after },
        ),
    ] {
        let mut layer = winds(&plain, Design::default());
        layer.settings.mode = mode;
        layer.settings.foreshortening = foreshortening;
        layer.settings.stretch = 2.0;
        let mut scene = Scene { splat, ..plain.clone() }.with(layer);
        scene.phase = 0.3;
        scenes.push((name, scene, [24, 20], 2e-4));
    }
    // Each is drawn as it is seen in its middle.
    let mut near = scenes[0].1.clone();
    near.camera.projection = Projection::Perspective { view_angle: 1.0 };
    scenes.push(("in perspective", near, [24, 20], 1.6e-2));
    held_to_the_reference(&scenes);
}

/// Corners' colours and the layer's, lights from behind, triangles in one plane, and edges where lists of cells meet.
#[test]
fn polygons_are_coloured_lit_and_laid_down_as_the_references_are() {
    let mut plain = scene_of(waves([9, 8, 10]), &[(0.4, 0.0), (0.9, 0.4)]);
    let light =
        |direction, colour| Light { direction, colour: Srgb8(colour), attached: Attached::Camera };
    plain.shading.lighting = Some(Lighting {
        ambient: 0.2,
        diffuse: 0.5,
        specular: 0.9,
        exponent: 2.0,
        lights: vec![
            light(DVec3::new(0.9, 0.3, -0.4), [255, 240, 200]),
            light(DVec3::new(-0.5, 0.6, 1.0), [90, 120, 255]),
        ],
    });
    let colours = [[250, 30, 20], [20, 240, 60], [40, 60, 255]].map(Srgb8);
    // The second in the plane of the first, and over half of it.
    let flat = [
        [[0.1, 0.1, 0.5], [0.9, 0.15, 0.5], [0.5, 0.9, 0.5]],
        [[0.3, 0.0, 0.5], [1.0, 0.5, 0.5], [0.2, 0.7, 0.5]],
    ];
    let own = triangles(&plain, &flat, &[colours, colours].concat());
    let mut one = own.clone();
    one.look.colour = Some(Srgb8([220, 200, 40]));
    let mut seen_through = own.clone();
    seen_through.look.opacity = 0.5;
    let mut green = triangles(&plain, &flat[1..], &[Srgb8([10, 250, 10]); 3]);
    green.look.opacity = 0.5;
    let mut in_one_plane = plain.clone().with(seen_through);
    in_one_plane.add(SampleSource::made("green"), green);
    let scenes = [
        ("corners' colours", plain.clone().with(own)),
        ("one colour", plain.clone().with(one)),
        ("one plane", in_one_plane),
        ("askew", plain.clone().with(triangles(&plain, &[SHARD], &[]))),
    ];
    let scenes = scenes.map(|(name, scene)| (name, scene, SIZE, 5e-4));
    held_to_the_reference(&scenes);
}

/// An edge that ends just beyond where a list's cell does, at every place of it.
#[test]
fn no_sample_is_lost_where_the_lists_of_two_cells_meet() {
    let engine = alone();
    let plain = scene_of(waves([9, 8, 10]), &[(0.0, 0.0), (1.0, 0.0)]);
    let camera = scene::framing_camera(&plain.lattice(), DVec3::Z, DVec3::Y);
    let plain = Scene { camera, ..plain };
    // 40 × 36 pixels: cells end 32 from the left and from above.
    let size = [40, 36];
    let pixel = 2.0 * camera.parallel_scale / f64::from(size[1]);
    let centre = plain.lattice().centre();
    for part in 0..8 {
        let shift = f64::from(part) / 8.0;
        let at = |right: f64, down: f64| {
            let (right, up) = (right - 20.0 + shift, 18.0 - down - shift);
            (centre + camera.right() * (right * pixel) + camera.up * (up * pixel)).as_vec3()
        };
        let corners = vec![at(3.0, 3.0), at(32.0, 3.5), at(3.5, 32.0)];
        let mesh = Mesh::new("t", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]).unwrap();
        let scene = plain.clone().with(PolygonLayer::new(Arc::new(mesh)));
        let truth = Reference::new(&scene, size.map(|n| n as usize)).unwrap().picture();
        let off = apart(&drawn(&engine, &scene, size).light, &truth);
        assert!(off < 1e-5, "{shift}: {off}");
    }
}

/// A ball in a cube, as opaque as said, and lines from its middle on, or beside it.
#[test]
fn a_field_that_hides_lines_is_faded_and_one_that_does_not_stays() {
    let ball = |opacity: f64| {
        let volume = volume([33; 3], |at| {
            let [x, y, z] = at.map(|n| n as f32 - 16.0);
            1.0 - (x * x + y * y + z * z).sqrt() / 16.0
        });
        let mut scene = scene_of(volume, &[(0.1, 0.0), (0.1, opacity), (1.0, opacity)]);
        scene.camera.direction = DVec3::Z;
        scene
    };
    let line = |from: f64| {
        let line = (0..500).map(|i| DVec3::new(from + 0.004 * f64::from(i), 16.0, 16.0));
        line.collect::<Vec<_>>().into_iter()
    };
    let mut opaque = ball(1.0);
    assert!(!opaque.uncover(line(-2.4)) && !opaque.inside.is_faded);
    assert!(!opaque.uncover([].into_iter()) && !opaque.uncover(line(900.0)));
    assert!(opaque.little_seen_of_places(line(15.0)).is_some_and(|seen| seen < 1e-3));
    assert!(opaque.uncover(line(15.0)) && opaque.inside.is_faded);
    assert_eq!(opaque.little_seen_of_places(line(15.0)), None, "it is seen now");
    let mut thin = ball(0.01);
    assert!(!thin.uncover(line(15.0)) && !thin.inside.is_faded);
}

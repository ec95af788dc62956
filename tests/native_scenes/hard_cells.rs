//! Meshes that few have: cells that are needles, flat, turned over or there several times, gaps, faces of three, far away, and an
//! eye among them.

use std::time::Instant;

use voxsplat::cells::{Cells, Listing};
use voxsplat::core::Projection;
use voxsplat::volume::{Association, Component, Field, Grid, Shape};

use super::*;

const SIDES: [u32; 2] = [72, 60];

/// A unit tetrahedron, and the corner across from it.
const CORNERS: [[f64; 3]; 5] =
    [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 1.]];

/// A mesh as it opens from a file, with a number from 0 to 1 at each point.
fn mesh(points: &[[f64; 3]], cells: &[(u8, &[u32])], values: &[f64]) -> Scene {
    let mut listing = Listing {
        points: points.iter().map(|place| DVec3::from(*place)).collect(),
        starts: vec![0],
        ..Listing::default()
    };
    for (kind, corners) in cells {
        listing.types.push(*kind);
        listing.corners.extend(*corners);
        listing.starts.push(listing.corners.len());
    }
    let cells = Cells::new(listing).unwrap();
    let samples = Arc::new(Samples::Float64(values.to_vec()));
    let association = Association::Point;
    let field = Field { name: "v".into(), components: 1, association, samples };
    let shape = Shape::Unstructured(Arc::new(cells));
    let grid = Grid::shaped([points.len(), 1, 1], shape, vec![field]).unwrap();
    let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).unwrap();
    let mut scene = scene_of(Arc::new(volume), &[(0.0, 0.4), (1.0, 0.95)]);
    scene.splat = SplatSettings { slabs_per_voxel: 0.5, ..SplatSettings::CELLS };
    scene
}

/// Between the first four points.
const TETRAHEDRON: (u8, &[u32]) = (10, &[0, 1, 2, 3]);

/// Two tetrahedra that overlap in a third of each: what both hold is of the one that comes first, whatever the other has there.
#[test]
fn where_cells_overlap_the_first_is_drawn() {
    let shift = DVec3::new(0.15, 0.1, 0.05);
    let other = CORNERS[..4].iter().map(|at| (DVec3::from(*at) + shift).to_array());
    let points: Vec<[f64; 3]> = CORNERS[..4].iter().copied().chain(other).collect();
    let values = [0.9, 1.0, 0.9, 1.0, 0.0, 0.1, 0.0, 0.1];
    let pair: [(u8, &[u32]); 2] = [TETRAHEDRON, (10, &[4, 5, 6, 7])];
    let [first, second] = [pair, [pair[1], pair[0]]].map(|cells| mesh(&points, &cells, &values));
    held_to_the_reference(&[
        ("one first", first.clone(), SIDES, 1e-3),
        ("the other first", second.clone(), SIDES, 1e-3),
    ]);
    let [a, b] = [first, second].map(|scene| drawn(&alone(), &scene, SIDES).light);
    let red = |light: &[[f32; 4]]| light.iter().map(|pixel| pixel[0]).sum::<f32>();
    assert!(red(&b) > 1.02 * red(&a), "low values are red: {} {}", red(&a), red(&b));
}

/// A thousand cells at one place, with points of their own or not, are drawn as one of them is, lit and all, and hardly longer.
#[test]
fn a_thousand_cells_at_one_place_are_drawn_as_the_first() {
    let engine = alone();
    let values = [0.0, 0.3, 0.6, 1.0];
    let timed = |mut scene: Scene| {
        scene.shading.lighting = Some(Lighting::first_look());
        let light = drawn(&engine, &scene, SIDES).light;
        let start = Instant::now();
        assert_eq!(drawn(&engine, &scene, SIDES).light, light);
        (light, start.elapsed().as_secs_f64())
    };
    let (one, one_s) = timed(mesh(&CORNERS[..4], &[TETRAHEDRON], &values));
    assert!(one.iter().filter(|pixel| pixel[3] > 0.02).count() > 300);
    for has_own_points in [false, true] {
        let count = if has_own_points { 1000 } else { 1 };
        let points = CORNERS[..4].repeat(count);
        let numbers: Vec<u32> = (0..4000).map(|i| i % (4 * count as u32)).collect();
        let cells: Vec<(u8, &[u32])> = numbers.chunks(4).map(|own| (10, own)).collect();
        // The others have other values, of which nothing is seen.
        let rest = [0.7, 0.2, 1.0, 0.0].repeat(count - 1);
        let (many, many_s) = timed(mesh(&points, &cells, &[&values[..], &rest].concat()));
        println!("measured {has_own_points}: {one_s:.3} and {many_s:.3} s");
        let off = one.as_flattened().iter().zip(many.as_flattened());
        let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{has_own_points}: {off}");
        assert!(many_s < 50.0 * one_s + 0.5, "{has_own_points}: {one_s} and {many_s} s");
    }
}

/// A needle fifty times as long as wide, of which few pixels see anything, a flat sliver, one that is turned over and one without any volume.
#[test]
fn needles_slivers_and_cells_that_are_turned_over_or_flat_are_the_references() {
    let values = [0.0, 0.3, 0.6, 1.0, 0.8];
    let needle = [[0., 0., 0.], [0.02, 0., 0.], [0., 0.02, 0.], [0.3, 0.4, 1.0], [1., 1., 1.]];
    let sliver = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0.9, 0.9, 0.004], [0., 0., 1.]];
    let turned: [(u8, &[u32]); 1] = [(10, &[0, 2, 1, 3])];
    let flat = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 0.]];
    let with_flat: [(u8, &[u32]); 2] = [(10, &[0, 1, 2, 4]), TETRAHEDRON];
    held_to_the_reference(&[
        ("needle", mesh(&needle, &[TETRAHEDRON], &values), SIDES, 2e-5),
        ("sliver", mesh(&sliver, &[TETRAHEDRON, (10, &[0, 2, 1, 4])], &values), SIDES, 1e-3),
        ("turned over", mesh(&CORNERS, &turned, &values), SIDES, 1e-3),
        ("flat beside", mesh(&flat, &with_flat, &values), SIDES, 1e-3),
    ]);
}

/// Three cells on one face, of which two overlap; and two with a gap between them that no slab's face lies in.
#[test]
fn faces_of_three_cells_and_gaps_between_two_are_the_references() {
    let points = [
        [0., 0., 0.],
        [1., 0., 0.],
        [0., 1., 0.],
        [0.1, 0.2, 1.0],
        [0.4, 0.3, 0.6],
        [0.3, 0.3, -0.9],
    ];
    let values = [0.0, 0.3, 0.6, 1.0, 0.8, 0.2];
    let three: [(u8, &[u32]); 3] = [TETRAHEDRON, (10, &[0, 1, 2, 4]), (10, &[0, 2, 1, 5])];
    let above = CORNERS[..4].iter().map(|[x, y, z]| [*x, *y, *z + 0.002]);
    let below = CORNERS[..4].iter().map(|[x, y, z]| [*x, *y, -*z]);
    let apart: Vec<[f64; 3]> = above.chain(below).collect();
    let pair: [(u8, &[u32]); 2] = [TETRAHEDRON, (10, &[4, 5, 6, 7])];
    held_to_the_reference(&[
        ("three", mesh(&points, &three, &values), SIDES, 1e-3),
        ("gap", mesh(&apart, &pair, &[values, values].concat()[..8]), SIDES, 1e-3),
    ]);
}

/// An eye in the middle of a hexahedron, and of a tetrahedron.
#[test]
fn an_eye_inside_a_cell_sees_what_the_reference_does() {
    let cube: Vec<[f64; 3]> =
        (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|n: u32| f64::from(n))).collect();
    let values: Vec<f64> = (0..8).map(|i| f64::from(i) / 7.0).collect();
    let within = |mut scene: Scene, middle: DVec3| {
        scene.camera.focal_point = middle;
        scene.camera.projection = Projection::Perspective { view_angle: 1.2 };
        // The eye lies where the view's distance ends, before the place that is looked at.
        scene.camera.parallel_scale = 0.05;
        scene
    };
    let hexahedron = mesh(&cube, &[(12, &[0, 1, 3, 2, 4, 5, 7, 6])], &values);
    let tetrahedron = mesh(&CORNERS[..4], &[TETRAHEDRON], &values[..4]);
    held_to_the_reference(&[
        ("hexahedron", within(hexahedron, DVec3::splat(0.5)), SIDES, 1e-3),
        ("tetrahedron", within(tetrahedron, DVec3::splat(0.25)), SIDES, 1e-3),
    ]);
}

/// World coordinates of 10⁷ with detail of 10⁻³: seen as about 0.
#[test]
fn cells_far_from_0_are_seen_as_they_are_near() {
    let engine = alone();
    let picture = |about: DVec3| {
        let place = |at: &[f64; 3]| (about + DVec3::from(*at) * 1e-3).to_array();
        let points: Vec<[f64; 3]> = CORNERS.iter().map(place).collect();
        let cells: [(u8, &[u32]); 2] = [TETRAHEDRON, (10, &[1, 2, 3, 4])];
        let mut scene = mesh(&points, &cells, &[0.0, 0.3, 0.6, 1.0, 0.8]);
        scene.shading.lighting = Some(Lighting::first_look());
        drawn(&engine, &scene, SIDES).light
    };
    let (near, there) = (picture(DVec3::ZERO), picture(DVec3::new(1e7, -2e7, 3e7)));
    let off =
        |(a, b): (&[f32; 4], &[f32; 4])| (0..4).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
    // Coordinates are rounded to 4e-9, a 250 000th of a cell.
    let others = near.iter().zip(&there).filter(|pair| off(*pair) > 2e-2).count();
    let seen = near.iter().filter(|pixel| pixel[3] > 0.05).count();
    assert!(seen > 300 && others < seen / 50, "{others} of {seen}");
}

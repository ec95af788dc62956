//! Meshes that few have: cells that are needles, flat, turned over or there several times, gaps, faces of three, far away, points
//! that no cell has or that are there twice, and an eye among them. And points alone: on a line, on a plane, at one place.

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

/// Points alone, as they open from a file, by the ellipsoids about them.
fn points(places: &[[f64; 3]], values: &[f64]) -> Scene {
    let mut scene = mesh(places, &[], values);
    scene.splat = SplatSettings { slabs_per_voxel: 2.0, ..SplatSettings::ELLIPSOIDS };
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

/// Points that no cell has, wherever they lie and whatever is there, are as if they were not: in the picture, its frame, the range
/// of values and their mean.
#[test]
fn points_that_no_cell_has_are_not_there() {
    let engine = alone();
    let cells: [(u8, &[u32]); 2] = [TETRAHEDRON, (10, &[1, 2, 3, 4])];
    let values = [0.0, 0.3, 0.6, 1.0, 0.8];
    let plain = mesh(&CORNERS, &cells, &values);
    let unused = [[500., -90., 3.], [f64::NAN, 0., 0.], [0.2, 0.2, 0.2], [-4., f64::INFINITY, 0.]];
    let with_unused: Vec<[f64; 3]> = CORNERS.iter().chain(&unused).copied().collect();
    let more = mesh(&with_unused, &cells, &[&values[..], &[-70.0, 5.0, 99.0, f64::NAN]].concat());
    assert_eq!(plain.camera, more.camera);
    let [a, b] = [&plain, &more].map(|scene| scene.volume().unwrap());
    assert_eq!((a.lattice.dims, a.lattice.origin), (b.lattice.dims, b.lattice.origin));
    let [a, b] = [a, b].map(|volume| volume.statistics.clone());
    assert_eq!((a.min, a.max, a.mean), (b.min, b.max, b.mean));
    let [a, b] = [&plain, &more].map(|scene| drawn(&engine, scene, SIDES).light);
    assert!(a.iter().filter(|pixel| pixel[3] > 0.05).count() > 300 && a == b);
    // Nor is anything drawn about them where points are.
    let [a, b] = [plain, more].map(|mut scene| {
        scene.splat = SplatSettings::ELLIPSOIDS;
        drawn(&engine, &scene, SIDES).light
    });
    assert!(a.iter().filter(|pixel| pixel[3] > 0.05).count() > 300 && a == b);
}

/// Cells with points of their own at the same places are drawn as those that share theirs: there is no seam.
#[test]
fn points_of_cells_that_are_there_twice_are_drawn_as_those_that_are_shared() {
    let engine = alone();
    let values = [0.0, 0.3, 0.6, 1.0, 0.8];
    let shared: [(u8, &[u32]); 2] = [TETRAHEDRON, (10, &[1, 2, 3, 4])];
    let of_shared = mesh(&CORNERS, &shared, &values);
    let twice: Vec<[f64; 3]> = CORNERS[..4].iter().chain(&CORNERS[1..]).copied().collect();
    let own: [(u8, &[u32]); 2] = [TETRAHEDRON, (10, &[4, 5, 6, 7])];
    let of_own = mesh(&twice, &own, &[&values[..4], &values[1..]].concat());
    for kernel in [SplatSettings::CELLS, SplatSettings::ELLIPSOIDS] {
        let [a, b] = [&of_shared, &of_own].map(|scene| {
            let scene = Scene { splat: kernel, ..scene.clone() };
            drawn(&engine, &scene, SIDES).light
        });
        let seen = a.iter().filter(|pixel| pixel[3] > 0.05).count();
        let off = a.as_flattened().iter().zip(b.as_flattened());
        let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(seen > 300 && off < 2e-4, "{:?}: {seen} {off}", kernel.kernel);
    }
    held_to_the_reference(&[("own points", of_own, SIDES, 1e-3)]);
}

/// Points on a line, along an axis or askew, on a plane, some of them at one place, two, and one alone.
#[test]
fn points_on_a_line_on_a_plane_and_at_one_place_are_the_references() {
    let at = |count: usize, place: &dyn Fn(f64, f64) -> [f64; 3]| -> Vec<[f64; 3]> {
        (0..count).map(|i| place((i % 7) as f64, (i / 7) as f64)).collect()
    };
    let along = at(7, &|i, _| [i, 0.0, 0.0]);
    let askew = at(7, &|i, _| [1.0 + 0.3 * i, 0.8 * i, 5.0 - 0.5 * i]);
    let plane = at(49, &|i, k| [i, k, 0.0]);
    let leaning = at(49, &|i, k| [i, 0.6 * k, 0.8 * k + 0.4 * i]);
    let values: Vec<f64> = (0..49).map(|i| f64::from(i * 5 % 9) / 8.0).collect();
    let twice: Vec<[f64; 3]> = plane.iter().flat_map(|place| [*place; 2]).collect();
    // Whose mean is that of the others.
    let apart: Vec<f64> = values.iter().flat_map(|value| [value - 0.25, value + 0.25]).collect();
    let one = [[2.0, -3.0, 4.0]; 3];
    held_to_the_reference(&[
        ("line", points(&along, &values[..7]), SIDES, 1e-3),
        ("line askew", points(&askew, &values[..7]), SIDES, 1e-3),
        ("plane", points(&plane, &values), SIDES, 1e-3),
        ("leaning plane", points(&leaning, &values), SIDES, 1e-3),
        ("each twice", points(&twice, &apart), SIDES, 1e-3),
        ("two", points(&along[..2], &[0.2, 0.9]), SIDES, 1e-3),
        ("one, thrice", points(&one, &[0.3, 0.6, 0.9]), SIDES, 1e-3),
    ]);
    let engine = alone();
    let light = |scene: &Scene| drawn(&engine, scene, SIDES).light;
    // The same ellipsoids are listed in the same order; their opacity is one over the range of values.
    let mut doubled = points(&twice, &apart);
    let single = points(&plane, &values);
    doubled.camera = single.camera;
    let off = light(&single)
        .as_flattened()
        .iter()
        .zip(light(&doubled).as_flattened())
        .fold(0.0_f32, |most, (a, b)| most.max((a - b).abs()));
    assert!(off < 1e-3, "points that are there twice have the mean of their values: {off}");
}

/// Cells whose points all lie on a plane, or on a line, have no volume and hide nothing: a picture of others beside them is of these.
#[test]
fn cells_of_points_on_a_plane_or_a_line_are_nothing_beside_others() {
    let values = [0.0, 0.3, 0.6, 1.0, 0.8];
    let plane = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.], [0.5, 0.5, 0.]];
    let line = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [3., 0., 0.], [4., 0., 0.]];
    for (name, places) in [("plane", plane), ("line", line)] {
        let both: Vec<[f64; 3]> = CORNERS[..4].iter().chain(&places[..4]).copied().collect();
        let beside: [(u8, &[u32]); 2] = [TETRAHEDRON, (10, &[4, 5, 6, 7])];
        let scene = mesh(&both, &beside, &[&values[..4], &values[..4]].concat());
        held_to_the_reference(&[(name, scene, SIDES, 1e-3)]);
    }
}

//! Isosurfaces of cells that overlap: where values jump past a level there is none.

use voxsplat::cells::{CellField, Cells, Listing, On};

use super::*;

const SIDES: [u32; 2] = [80, 64];

/// A block of a hexahedron and two wedges, of values from 10 to 11, and a pyramid of 90 to 91 that begins in its middle: both
/// grow along z. What both hold the block has, which comes first.
fn overlapping(on: On, level: f64) -> Scene {
    let place = |i: usize| {
        let (x, y) = ([1.0, 3.0, 5.0][i % 3], [1.0, 6.0][i / 3 % 2]);
        DVec3::new(x, y, [1.0, 6.0][i / 6])
    };
    let spike = [[8.0, 2.0, 2.0], [8.0, 5.0, 2.0], [8.0, 5.0, 5.0], [8.0, 2.0, 5.0]];
    let mut points: Vec<DVec3> = (0..12).map(place).chain(spike.map(DVec3::from)).collect();
    points.push(DVec3::new(2.0, 3.5, 3.5));
    let cells: [&[u32]; 4] = [
        &[0, 1, 4, 3, 6, 7, 10, 9],
        &[1, 2, 4, 7, 8, 10],
        &[2, 5, 4, 8, 11, 10],
        &[12, 13, 14, 15, 16],
    ];
    let values = match on {
        On::Points => {
            let of = |(i, point): (usize, &DVec3)| match i {
                0..12 => 10.0 + (point.z - 1.0) / 5.0,
                _ => 90.0 + (point.z - 2.0) / 3.0,
            };
            points.iter().enumerate().map(of).collect()
        }
        On::Cells => vec![10.0, 10.0, 10.0, 90.0],
    };
    let listing = Listing {
        points,
        types: vec![12, 13, 13, 14],
        starts: vec![0, 8, 14, 20, 25],
        corners: cells.concat(),
        ..Listing::default()
    };
    let cells = Arc::new(Cells::new(listing).unwrap());
    let samples = volume([10, 8, 8], |[x, ..]| if x < 6 { 10.0 } else { 91.0 });
    let mut made = ScalarVolume::clone(&samples);
    made.cells = Some(Arc::new(CellField::new(cells, on, values)));
    let mut scene = scene_of(Arc::new(made), &[(10.0, 0.0), (91.0, 0.0)]);
    // What passes a level twice in a slab is not met.
    scene.splat = SplatSettings { slabs_per_voxel: 4.0, ..SplatSettings::CELLS };
    scene.inside.isosurfaces = vec![Isosurface { value: level, opacity: 1.0, colour: None }];
    scene
}

/// Half of the block's values are above 10.5, and half of the pyramid's above 90.5; none of either is 50, which is between
/// theirs. Values of cells are nowhere 50 either: there the surface is the face between those below and above.
#[test]
fn cells_that_overlap_have_no_surface_where_values_jump_past_a_level() {
    let engine = alone();
    for (on, level, least) in [
        (On::Points, 10.5, 150),
        (On::Points, 90.5, 45),
        (On::Points, 50.0, 0),
        (On::Cells, 50.0, 5),
    ] {
        let scene = overlapping(on, level);
        let truth = Reference::new(&scene, SIDES.map(|n| n as usize)).unwrap().picture();
        let found = drawn(&engine, &scene, SIDES);
        assert_eq!(found.not_native, None);
        let seen = truth.iter().filter(|pixel| pixel[3] > 0.5).count();
        let others = found.light.iter().zip(&truth);
        let others = others.filter(|(a, b)| (f64::from(a[3]) - b[3]).abs() > 0.5).count();
        println!("measured {on:?} {level}: {seen} pixels, {others} of them otherwise");
        if least == 0 {
            assert_eq!((seen, others), (0, 0), "{on:?} {level}");
        } else {
            assert!(seen >= least, "{on:?} {level}: {seen}");
            // At the borders of surfaces.
            assert!(others <= 2 + seen / 8, "{on:?} {level}: {others} of {seen}");
        }
    }
}

//! A ring of tetrahedra: warm where it bulges, hollow where a channel runs through it.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::super::{Association, Field, Grid, Samples, Shape};
use crate::cells::{Cells, Listing};

/// From the ring's axis to the middle of its section, and that one's radius.
const RING: f64 = 0.66;
const SECTION: f64 = 0.34;
/// Cubes around the ring for each across its section.
const AROUND: usize = 6;
/// Kuhn's six tetrahedra of a cube: from one corner to the opposite one, axis by axis in each order.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
/// VTK's number of tetrahedra.
const TETRAHEDRON: u8 = 10;

/// Of so many cubes across the section, each of six tetrahedra.
pub(super) fn grid(size: usize) -> Grid {
    let (across, around) = (size, AROUND * size);
    let side = across + 1;
    let mut points = Vec::with_capacity(around * side * side);
    let mut warmth = Vec::with_capacity(points.capacity());
    let mut flow = Vec::with_capacity(3 * points.capacity());
    for turn in 0..around {
        let angle = TAU * turn as f64 / around as f64;
        let outwards = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let along = DVec3::new(-angle.sin(), angle.cos(), 0.0);
        let bulge = 1.0 + 0.22 * (3.0 * angle).sin();
        for j in 0..side {
            for i in 0..side {
                let square = DVec2::new(i as f64, j as f64) * (2.0 / across as f64) - 1.0;
                let disc = rounded(square);
                let place = disc * (SECTION * bulge);
                let twist = DVec2::from_angle(2.0 * angle).rotate(place);
                points.push(outwards * (RING + twist.x) + DVec3::Z * twist.y);
                let ripple = 0.5 + 0.5 * (9.0 * angle + 5.0 * disc.x).sin() * (1.0 - 0.4 * disc.y);
                let value = (1.0 - disc.length_squared()) * 0.75 + 0.25 * ripple;
                warmth.push(value as f32);
                let speed = along * (1.2 - disc.length()) + DVec3::Z * (0.4 * disc.x);
                flow.extend(speed.as_vec3().to_array());
            }
        }
    }
    let (mut corners, mut parts) = (Vec::new(), Vec::new());
    let at = |turn: usize, j: usize, i: usize| {
        #[expect(clippy::cast_possible_truncation, reason = "512³ at most")]
        let at = (((turn % around) * side + j) * side + i) as u32;
        at
    };
    for turn in 0..around {
        for j in 0..across {
            for i in 0..across {
                for (path, order) in PATHS.into_iter().enumerate() {
                    let mut step = [0; 3];
                    let mut own = vec![at(turn, j, i)];
                    for axis in order {
                        step[axis] = 1;
                        own.push(at(turn + step[2], j + step[1], i + step[0]));
                    }
                    // The last three go the other way round.
                    if path >= 3 {
                        own.swap(2, 3);
                    }
                    corners.extend(own);
                    parts.push(u8::try_from(turn * 6 / around).unwrap_or_default());
                }
            }
        }
    }
    let count = parts.len();
    let listing = Listing {
        points,
        types: vec![TETRAHEDRON; count],
        starts: (0..=count).map(|cell| 4 * cell).collect(),
        corners,
        ..Listing::default()
    };
    let field = |name: &str, components, association, samples| Field {
        name: name.to_owned(),
        components,
        association,
        samples: Arc::new(samples),
    };
    let fields = vec![
        field("temperature", 1, Association::Point, Samples::Float32(warmth)),
        field("flow", 3, Association::Point, Samples::Float32(flow)),
        field("part", 1, Association::Cell, Samples::UInt8(parts)),
    ];
    #[expect(clippy::expect_used, reason = "every corner is a point of the ring")]
    let cells = Cells::new(listing).expect("tetrahedra of the ring's own points");
    let dims = [cells.own_points(), 1, 1];
    let shape = Shape::Unstructured(Arc::new(cells));
    Grid { shape: shape.clone(), ..Grid::of(shape.outline(dims), fields) }
}

/// A square as a disc of radius 1, rings of it as circles.
fn rounded(square: DVec2) -> DVec2 {
    let ring = square.abs().max_element();
    if ring > 0.0 { square.normalize() * ring } else { square }
}

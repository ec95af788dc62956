//! The cells of the table's scenes: of every kind, warped, with a gap in them.

use std::sync::Arc;

use glam::DVec3;
use voxsplat::cells::{CellField, Cells, Listing, On};
use voxsplat::volume::{Lattice, Samples};

use crate::scenes::{Field, random};

/// Cubes along each axis of what cells are made of.
const CUBES: [usize; 3] = [4, 3, 5];

/// Kuhn's six tetrahedra of a cube, by the axes that lead from corner to corner.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// The cells of a field over most of a lattice, if it is of cells.
pub(crate) fn cells_of(field: Field, lattice: &Lattice) -> Option<Arc<CellField>> {
    let on = match field {
        Field::Tetrahedra | Field::MixedCells => On::Points,
        Field::CellValues => On::Cells,
        _ => return None,
    };
    let listing = listing(lattice, field != Field::Tetrahedra);
    let count = match on {
        On::Points => listing.points.len(),
        On::Cells => listing.types.len(),
    };
    let values = (0..count).map(|i| random(57, i) * 255.99).collect();
    let cells = Arc::new(Cells::new(listing).expect("sound cells"));
    Some(Arc::new(CellField::new(cells, on, values)))
}

/// Tetrahedra, or cells of a kind for each layer of cubes along z.
fn listing(lattice: &Lattice, is_mixed: bool) -> Listing {
    let sides = CUBES.map(|n| n + 1);
    let last = DVec3::from(lattice.dims.map(|n| n as f64 - 1.0));
    let place = |[x, y, z]: [usize; 3]| {
        let i = (z * sides[1] + y) * sides[0] + x;
        let shaken = DVec3::new(random(41, i), random(42, i), random(43, i)) - 0.5;
        let at = DVec3::new(x as f64, y as f64, z as f64) + 0.45 * shaken;
        let share = at / DVec3::from(CUBES.map(|n| n as f64));
        lattice.world_from_index(last * (0.1 + 0.8 * share))
    };
    let mut found = Listing { starts: vec![0], ..Listing::default() };
    for z in 0..sides[2] {
        for y in 0..sides[1] {
            found.points.extend((0..sides[0]).map(|x| place([x, y, z])));
        }
    }
    let number = |[x, y, z]: [usize; 3]| ((z * sides[1] + y) * sides[0] + x) as u32;
    let mut push = |kind: u8, corners: &[u32]| {
        found.types.push(kind);
        found.corners.extend(corners);
        found.starts.push(found.corners.len());
    };
    for z in 0..CUBES[2] {
        for y in 0..CUBES[1] {
            for x in 0..CUBES[0] {
                // A gap, in which rays leave the cells and enter them again.
                if [x, y, z] == [1, 1, 2] {
                    continue;
                }
                let ring = |z| {
                    let at = [[x, y, z], [x + 1, y, z], [x + 1, y + 1, z], [x, y + 1, z]];
                    at.map(number)
                };
                let ([a, b, c, d], [e, f, g, h]) = (ring(z), ring(z + 1));
                match z {
                    0 | 1 if is_mixed => push(12, &[a, b, c, d, e, f, g, h]),
                    2 if is_mixed => {
                        push(13, &[a, b, d, e, f, h]);
                        push(13, &[b, c, d, f, g, h]);
                    }
                    // Three pyramids about a corner.
                    3 if is_mixed => {
                        push(14, &[a, b, c, d, g]);
                        push(14, &[a, e, f, b, g]);
                        push(14, &[a, d, h, e, g]);
                    }
                    _ => {
                        for path in PATHS {
                            let mut at = [x, y, z];
                            let mut corners = vec![number(at)];
                            for axis in path {
                                at[axis] += 1;
                                corners.push(number(at));
                            }
                            push(10, &corners);
                        }
                    }
                }
            }
        }
    }
    found
}

/// The values at a lattice's samples, NaN outside all cells.
pub(crate) fn samples_of(field: &CellField, lattice: &Lattice) -> Samples {
    let [nx, ny, _] = lattice.dims;
    let value = |i: usize| {
        let at = DVec3::from([i % nx, i / nx % ny, i / (nx * ny)].map(|i| i as f64));
        let world = lattice.world_from_index(at);
        let count = field.cells().solids().len();
        let found = (0..count).find_map(|solid| {
            let unit = field.cells().placed(solid).unit_from(world)?;
            Some(field.value(solid, unit))
        });
        found.unwrap_or(f64::NAN) as f32
    };
    Samples::Float32((0..lattice.len()).map(value).collect())
}

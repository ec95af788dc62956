use super::*;
use crate::core::assert_stops;
use crate::core::progress::{Cancelled, Ticket};
use glam::DMat3;

/// The corners of a unit cube in VTK's order.
const CUBE: [[f64; 3]; 8] = [
    [0., 0., 0.],
    [1., 0., 0.],
    [1., 1., 0.],
    [0., 1., 0.],
    [0., 0., 1.],
    [1., 0., 1.],
    [1., 1., 1.],
    [0., 1., 1.],
];

fn random(state: &mut u64) -> f64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    (*state % 1_000_001) as f64 / 1e6
}

/// A solid of a kind, bent a little.
fn bent(kind: Kind, state: &mut u64) -> Placed {
    let corners: [[f64; 3]; 8] = match kind {
        Kind::Tetrahedron => {
            let mut own = CUBE;
            (own[2], own[3]) = ([0., 1., 0.], [0., 0., 1.]);
            own
        }
        Kind::Pyramid => {
            let mut own = CUBE;
            own[4] = [0.5, 0.4, 1.0];
            own
        }
        Kind::Wedge => {
            let mut own = CUBE;
            (own[2], own[3], own[4], own[5]) =
                ([0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [0., 1., 1.]);
            own
        }
        Kind::Hexahedron => CUBE,
    };
    let mut corners = corners.map(|corner| {
        let moved =
            DVec3::from(corner) + 0.15 * DVec3::new(random(state), random(state), random(state));
        // Flat by six orders, as in a boundary layer, turned, and far away.
        let flat = moved * DVec3::new(2.0, 2e-6, 30.0);
        DVec3::new(flat.x + flat.y, flat.y - flat.x, flat.z + 40.0)
    });
    if kind == Kind::Hexahedron && *state & 1 == 1 {
        // Two edges fall together, as on an axis that a grid turns about.
        (corners[1], corners[5]) = (corners[0], corners[4]);
    }
    Placed::new(kind, corners)
}

const KINDS: [Kind; 4] = [Kind::Tetrahedron, Kind::Pyramid, Kind::Wedge, Kind::Hexahedron];

/// Newton's steps never ended where coordinates had few digits of the cell, which then held no place: lines along vectors
/// broke off.
#[test]
fn places_of_small_solids_far_from_the_origin_are_found() {
    let state = &mut 5;
    for kind in KINDS {
        let at = |corner: [f64; 3]| 1e7 + 1e-3 * DVec3::from(corner);
        let corners = match kind {
            Kind::Tetrahedron => [0, 1, 3, 4, 4, 4, 4, 4],
            Kind::Pyramid => [0, 1, 2, 3, 4, 4, 4, 4],
            Kind::Wedge => [0, 1, 3, 4, 5, 7, 7, 7],
            Kind::Hexahedron => [0, 1, 2, 3, 4, 5, 6, 7],
        };
        let solid = Placed::new(kind, corners.map(|i: usize| at(CUBE[i])));
        for _ in 0..100 {
            let unit = 0.1 + 0.2 * DVec3::new(random(state), random(state), random(state));
            let found = solid.unit_from(solid.at(unit).0).expect("a place of the solid is in it");
            // Coordinates are told to 2e-9, 2e-6 of the solid.
            assert!((found - unit).abs().max_element() < 1e-5, "{kind:?}: {found} {unit}");
        }
    }
}

#[test]
fn places_are_found_in_solids_of_all_kinds_and_beside_them_not() {
    let mut state = 0x5eed_0009_u64;
    for round in 0..400 {
        let kind = KINDS[round % 4];
        let solid = bent(kind, &mut state);
        let mut unit = DVec3::new(
            random(&mut state),
            0.05 + 0.9 * random(&mut state),
            0.9 * random(&mut state),
        );
        while kind.beyond(unit) > -0.02 {
            unit = unit.lerp(kind.middle(), 0.3);
        }
        let place = solid.at(unit).0;
        let found = solid.unit_from(place).expect("a place of the solid is in it");
        assert!((found - unit).length() < 1e-5, "seed 0x5eed0009, round {round}: {found}, {unit}");
        let sum: DVec3 = solid
            .corners()
            .iter()
            .zip(kind.weights(unit))
            .map(|(corner, weight)| *corner * weight)
            .sum();
        assert!((sum - place).length() < 1e-9, "{kind:?}: factors and shape functions are one");
        let beside = solid.at(unit + DVec3::new(1.5, 0.0, 0.0)).0;
        assert_eq!(solid.unit_from(beside), None, "round {round}");
    }
}

#[test]
fn a_solid_without_depth_holds_what_is_on_it_and_nothing_beside() {
    let solid =
        Placed::new(Kind::Hexahedron, CUBE.map(|[_, y, z]| DVec3::new(0.0, 2.0 * y, 3.0 * z + y)));
    let on = solid.at(DVec3::new(0.5, 0.25, 0.75)).0;
    let found = solid.unit_from(on).expect("a place of the solid is in it");
    assert!((found.y - 0.25).abs() < 1e-9 && (found.z - 0.75).abs() < 1e-9, "{found}");
    assert_eq!(solid.unit_from(on + DVec3::X * 0.01), None);
    assert!(solid.is_flat());
}

#[test]
fn weights_are_one_at_their_corner_and_add_up_to_one() {
    let own = |kind: Kind| {
        let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]];
        let triangle = [[0., 0.], [1., 0.], [0., 1.]];
        let (ring, top): (&[[f64; 2]], f64) = match kind {
            Kind::Tetrahedron => return vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
            Kind::Wedge => (&triangle, 1.0),
            Kind::Pyramid => (&square, 0.0),
            Kind::Hexahedron => (&square, 1.0),
        };
        let mut corners: Vec<DVec3> = ring.iter().map(|[r, s]| DVec3::new(*r, *s, 0.0)).collect();
        match kind {
            Kind::Pyramid => corners.push(DVec3::new(0.3, 0.7, 1.0)),
            _ => corners.extend(ring.iter().map(|[r, s]| DVec3::new(*r, *s, top))),
        }
        corners
    };
    for kind in KINDS {
        for (i, corner) in own(kind).into_iter().enumerate() {
            for (j, weight) in kind.weights(corner).into_iter().enumerate() {
                assert!((weight - f64::from(u8::from(i == j))).abs() < 1e-15, "{kind:?} {i} {j}");
            }
            assert!(kind.beyond(corner) <= 0.0);
        }
        assert!((kind.weights(kind.middle()).iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }
}

/// So many unit cubes along each axis, of a field at their points.
fn cubes(
    [nx, ny, nz]: [usize; 3],
    place: impl Fn(DVec3) -> DVec3,
    of: fn(DVec3) -> f64,
) -> CellField {
    let mut points = Vec::new();
    for i in 0..nx * ny * nz {
        let at = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64);
        points.push(DVec3::from(at));
    }
    let values = points.iter().map(|at| of(*at)).collect();
    let points: Arc<[DVec3]> = points.into_iter().map(place).collect();
    let cells = Cells::of_grid(&points, [nx, ny, nz]);
    CellField::new(Arc::new(cells), On::Points, values)
}

#[test]
fn light_falls_on_the_border_of_cells_and_deeper_on_what_grows() {
    let field = cubes([4, 4, 4], |at| at, |at| 2.0 * at.x);
    let lit = field.shading_normals(&Ticket::new()).expect("not cancelled");
    let growth = |place: [f64; 3], direction: [f64; 3]| {
        let [place, direction] = [place, direction].map(DVec3::from);
        let cells = field.cells();
        let solid = (0..27).find(|solid| cells.placed(*solid).unit_from(place).is_some()).unwrap();
        let unit = cells.placed(solid).unit_from(place).unwrap();
        lit.growth((solid, &cells.solids()[solid]), unit, (place, direction))
    };
    let is = |found: DVec3, expected: [f64; 3]| {
        assert!((found - DVec3::from(expected)).length() < 1e-9, "{found}");
    };
    let [along_x, along_z, aslant] = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.5]];
    // Into the cells, as strong as the field grows anywhere, up to the edges, which are sharp.
    is(growth([1.5, 1.5, 0.0], along_z), [0.0, 0.0, 2.0]);
    is(growth([1.5, 1.5, 3.0], along_z), [0.0, 0.0, -2.0]);
    is(growth([0.02, 1.5, 0.0], along_z), [0.0, 0.0, 2.0]);
    is(growth([0.0, 1.5, 0.02], along_x), [2.0, 0.0, 0.0]);
    is(growth([3.0, 0.03, 0.03], along_x), [-2.0, 0.0, 0.0]);
    // Where a ray came in, whichever face is nearer: half as steep, it is twice as far along x that it came in by x.
    is(growth([0.02, 1.5, 0.0], aslant), [0.0, 0.0, 2.0]);
    is(growth([0.3, 1.5, 0.2], aslant), [2.0, 0.0, 0.0]);
    is(growth([0.5, 1.5, 0.2], aslant), [0.2, 0.0, 1.8]);
    // And where it leaves, as it came in by none of this cell's.
    is(growth([2.7, 1.5, 2.9], aslant), [0.06, 0.0, -1.94]);
    is(growth([2.9, 1.5, 2.7], aslant), [-2.0, 0.0, 0.0]);
    // One layer deep as the field, and in between both.
    is(growth([1.5, 1.5, 1.5], along_z), [2.0, 0.0, 0.0]);
    is(growth([1.5, 1.5, 0.25], along_z), [0.5, 0.0, 1.5]);
    // A surface and its back are lit alike: nothing cancels out where the border is turned against the growth.
    is(growth([2.75, 1.5, 1.5], along_x), [-2.0, 0.0, 0.0]);
}

#[test]
fn a_cell_that_was_split_is_lit_as_one() {
    // A hexagonal prism is six wedges. A ray that comes in through one side has its light in all of them.
    let ring = |z: f64| {
        (0..6).map(move |i| {
            let turn = f64::from(i) * std::f64::consts::FRAC_PI_3;
            DVec3::new(turn.cos(), turn.sin(), z)
        })
    };
    let points: Vec<DVec3> = ring(0.0).chain(ring(1.0)).collect();
    let cells = Arc::new(Cells::new(listing(16, &points)).expect("a prism"));
    assert_eq!(cells.solids().len(), 6);
    let field = CellField::new(Arc::clone(&cells), On::Cells, vec![7.0]);
    let lit = field.shading_normals(&Ticket::new()).expect("not cancelled");
    // From the middle of the side between the first two points to the one across.
    let turn = std::f64::consts::FRAC_PI_6;
    let inwards = -DVec3::new(turn.cos(), turn.sin(), 0.0);
    let direction = DVec3::new(inwards.x, inwards.y, 0.05);
    let begin = -inwards * (0.75_f64.sqrt() - 1e-6) + DVec3::Z * 0.4;
    let mut passed = std::collections::BTreeSet::new();
    for i in 0..100 {
        // A little beside the axis, where all wedges meet.
        let beside = DVec3::new(-inwards.y, inwards.x, 0.0) * 0.2;
        let place = begin + beside + direction * (f64::from(i) / 99.0 * 1.732);
        let holds = |solid: &usize| cells.placed(*solid).unit_from(place).is_some();
        let Some(solid) = (0..6).find(holds) else { continue };
        passed.insert(solid);
        let unit = cells.placed(solid).unit_from(place).expect("it holds it");
        let at = (solid, &cells.solids()[solid]);
        let growth = lit.growth(at, unit, (place, direction));
        assert!((growth - inwards).length() < 1e-9, "{i} in {solid}: {growth}");
    }
    assert!(passed.len() >= 3, "{passed:?}");
    // Two faces of its own and the top and the bottom, which each has: five others.
    assert!((0..6).all(|solid| lit.faces_of(solid).len() == 8));
}

#[test]
fn light_on_a_bent_border_is_smooth_and_on_a_sharp_one_is_not() {
    let folded = |degrees: f64| {
        let turn = glam::DQuat::from_rotation_y(-degrees.to_radians());
        let place = move |at: DVec3| match at.x > 1.0 {
            true => DVec3::X + DVec3::new(0.0, at.y, at.z) + turn * DVec3::X,
            false => at,
        };
        let field = cubes([3, 2, 2], place, |_| 5.0);
        let lit = field.shading_normals(&Ticket::new()).unwrap();
        // On the lower faces, at the fold and a step from it, and above the fold.
        [[0.999, 0.0], [0.0, 0.0], [0.999, 0.3]].map(|[r, t]| {
            let first = (0, &field.cells().solids()[0]);
            let place = DVec3::new(r, 0.5, t);
            lit.growth(first, place, (place, DVec3::Z))
        })
    };
    let angle = |a: DVec3, b: DVec3| a.angle_between(b).to_degrees();
    let [at_fold, beside, above] = folded(20.0);
    assert!((angle(at_fold, beside) - 10.0).abs() < 0.1, "{}", angle(at_fold, beside));
    assert!((above - at_fold).length() < 1e-9, "what lies behind is lit alike: {at_fold} {above}");
    let [at_fold, beside, above] = folded(40.0);
    assert!(angle(at_fold, beside) < 1e-6, "{}", angle(at_fold, beside));
    // What does not grow at all is lit all the same.
    assert!([at_fold, beside, above].iter().all(|growth| (growth.length() - 1.0).abs() < 1e-9));
}

#[test]
fn volumes_are_exact_where_geometry_knows_them() {
    let volume = |kind, corners: &[[f64; 3]]| {
        let mut own = [DVec3::ZERO; 8];
        own.iter_mut().zip(corners).for_each(|(to, from)| *to = DVec3::from(*from));
        Placed::new(kind, own).volume()
    };
    assert!((volume(Kind::Hexahedron, &CUBE) - 1.0).abs() < 1e-12);
    let pyramid = [CUBE[0], CUBE[1], CUBE[2], CUBE[3], [0.2, 0.9, 3.0]];
    assert!((volume(Kind::Pyramid, &pyramid) - 1.0).abs() < 1e-12);
    let wedge = [CUBE[0], CUBE[1], CUBE[3], CUBE[4], CUBE[5], CUBE[7]];
    assert!((volume(Kind::Wedge, &wedge) - 0.5).abs() < 1e-12);
    let tetrahedron = [CUBE[0], CUBE[1], CUBE[3], CUBE[4]];
    assert!((volume(Kind::Tetrahedron, &tetrahedron) - 1.0 / 6.0).abs() < 1e-15);
    let turned = [CUBE[0], CUBE[3], CUBE[1], CUBE[4]];
    assert!(volume(Kind::Tetrahedron, &turned) < 0.0);
}

/// A cell of its type with its own points.
fn listing(kind: u8, points: &[DVec3]) -> Listing {
    Listing {
        points: points.to_vec(),
        types: vec![kind],
        starts: vec![0, points.len()],
        corners: (0..points.len() as u32).collect(),
        faces: BTreeMap::new(),
    }
}

/// The points of a quadratic cell: corners, and middles of edges.
fn with_middles(corners: &[[f64; 3]], edges: &[[usize; 2]]) -> Vec<DVec3> {
    let corners: Vec<DVec3> = corners.iter().map(|c| DVec3::from(*c)).collect();
    let middles = edges.iter().map(|[a, b]| corners[*a].midpoint(corners[*b]));
    corners.iter().copied().chain(middles).collect()
}

#[test]
fn split_cells_fill_the_same_space_once_and_keep_what_is_linear() {
    let tetrahedron = [CUBE[0], CUBE[1], CUBE[3], CUBE[4]];
    let wedge = [CUBE[0], CUBE[1], CUBE[3], CUBE[4], CUBE[5], CUBE[7]];
    let pyramid = [CUBE[0], CUBE[1], CUBE[2], CUBE[3], [0.5, 0.5, 1.0]];
    let hexahedron = Kind::Hexahedron.edges();
    // VTK has the edges of a ring, of the other, and then those between.
    let cases: [(u8, Vec<DVec3>, f64, usize); 11] = [
        (24, with_middles(&tetrahedron, Kind::Tetrahedron.edges()), 1.0 / 6.0, 8),
        (25, with_middles(&CUBE, hexahedron), 1.0, 8),
        (26, with_middles(&wedge, Kind::Wedge.edges()), 0.5, 8),
        (27, with_middles(&pyramid, Kind::Pyramid.edges()), 1.0 / 3.0, 10),
        (31, with_middles(&wedge, &Kind::Wedge.edges()[..6]), 0.5, 4),
        (32, of_lagrange(&wedge, 2), 0.5, 8),
        (71, of_lagrange(&tetrahedron, 5), 1.0 / 6.0, 125),
        (72, lagrange(3), 1.0, 27),
        (73, of_lagrange(&wedge, 4), 0.5, 64),
        (11, [0, 1, 3, 2, 4, 5, 7, 6].map(|i| DVec3::from(CUBE[i])).to_vec(), 1.0, 1),
        (15, prism(5), 5.0 / 2.0 * (72_f64).to_radians().sin(), 5),
    ];
    for (kind, points, volume, solids) in cases {
        let linear = |p: DVec3| 3.0 * p.x - 2.0 * p.y + 0.5 * p.z + 1.0;
        let own: Vec<f64> = points.iter().map(|p| linear(*p)).collect();
        let cells = Arc::new(Cells::new(listing(kind, &points)).unwrap());
        assert_eq!(cells.solids().len(), solids, "type {kind}");
        let volumes: Vec<f64> = (0..solids).map(|i| cells.placed(i).volume()).collect();
        let sum: f64 = volumes.iter().map(|v| v.abs()).sum();
        assert!((sum - volume).abs() < 1e-9, "type {kind}: {sum}, not {volume}");
        assert_eq!(cells.census().flat, 0, "type {kind}: {volumes:?}");
        let field = CellField::new(Arc::clone(&cells), On::Points, own);
        for solid in 0..solids {
            let middle = cells.solids()[solid].kind().middle();
            let expected = linear(cells.placed(solid).at(middle).0);
            let found = field.value(solid, middle);
            assert!(
                (found - expected).abs() < 1e-9,
                "type {kind}, piece {solid}: {found}, {expected}"
            );
        }
        for growth in field.growths(&Ticket::new()).unwrap().iter() {
            assert!(
                (*growth - DVec3::new(3.0, -2.0, 0.5)).length() < 1e-9,
                "type {kind}: {growth}"
            );
        }
        // No piece lies within another: their faces meet, and what is left is the hull.
        let hull: f64 = cells
            .surface(|_| true, &Ticket::new())
            .unwrap()
            .faces
            .iter()
            .flat_map(|face| face.triangles())
            .map(|t| area(&cells, t))
            .sum();
        let expected = hull_of(kind);
        assert!((hull - expected).abs() < 1e-9, "type {kind}: a hull of {hull}, not {expected}");
    }
}

fn area(cells: &Cells, [a, b, c]: [u32; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|i| cells.points()[i as usize]);
    (b - a).cross(c - a).length() / 2.0
}

/// The area about the cells of the test above.
fn hull_of(kind: u8) -> f64 {
    match kind {
        24 | 71 => 1.5 + 3.0_f64.sqrt() / 2.0,
        26 | 31 | 32 | 73 => 1.0 + 2.0 + 2.0_f64.sqrt(),
        27 => 1.0 + 4.0 * 1.25_f64.sqrt() / 2.0,
        15 => {
            let half = (36_f64).to_radians();
            2.0 * 2.5 * (2.0 * half).sin() + 5.0 * 2.0 * half.sin()
        }
        _ => 6.0,
    }
}

/// An upright prism of height 1 over a regular polygon of radius 1.
fn prism(corners: usize) -> Vec<DVec3> {
    let ring = |z: f64| {
        (0..corners).map(move |i| {
            let turn = std::f64::consts::TAU * i as f64 / corners as f64;
            DVec3::new(turn.cos(), turn.sin(), z)
        })
    };
    ring(0.0).chain(ring(1.0)).collect()
}

/// A tetrahedron's or wedge's points of an order. That VTK numbers them so has a test beside what numbers them.
fn of_lagrange(corners: &[[f64; 3]], order: usize) -> Vec<DVec3> {
    let corners: Vec<DVec3> = corners.iter().map(|c| DVec3::from(*c)).collect();
    let n = order as f64;
    let weights: Vec<Vec<f64>> = match corners.len() {
        4 => split::lagrange::tetrahedron(order)
            .iter()
            .map(|w| w.map(|w| w as f64 / n).to_vec())
            .collect(),
        _ => {
            let of = |[i, j, k]: &[usize; 3]| {
                let [i, j, k] = [i, j, k].map(|at| *at as f64 / n);
                let ring = [1.0 - i - j, i, j];
                ring.map(|w| w * (1.0 - k)).into_iter().chain(ring.map(|w| w * k)).collect()
            };
            split::lagrange::wedge(order).iter().map(of).collect()
        }
    };
    let place = |own: &Vec<f64>| corners.iter().zip(own).map(|(at, weight)| *at * *weight).sum();
    weights.iter().map(place).collect()
}

/// The unit cube as Lagrange's hexahedron, each point found by the corner, edge, face or inside that VTK numbers it in.
fn lagrange(order: usize) -> Vec<DVec3> {
    let n = order as f64;
    let mut points: Vec<DVec3> = CUBE.iter().map(|c| DVec3::from(*c)).collect();
    let between = |a: usize, b: usize| {
        let (a, b) = (DVec3::from(CUBE[a]), DVec3::from(CUBE[b]));
        (1..order).map(move |i| a.lerp(b, i as f64 / n))
    };
    // Edges run along the positive axes.
    for [a, b] in [[0, 1], [1, 2], [3, 2], [0, 3], [4, 5], [5, 6], [7, 6], [4, 7]] {
        points.extend(between(a, b));
    }
    for [a, b] in [[0, 4], [1, 5], [2, 6], [3, 7]] {
        points.extend(between(a, b));
    }
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (u, v) = (u.min(v), u.max(v));
        for end in [0.0, 1.0] {
            for j in 1..order {
                for i in 1..order {
                    let mut p = DVec3::ZERO;
                    (p[axis], p[u], p[v]) = (end, i as f64 / n, j as f64 / n);
                    points.push(p);
                }
            }
        }
    }
    for k in 1..order {
        for j in 1..order {
            points.extend((1..order).map(|i| DVec3::new(i as f64, j as f64, k as f64) / n));
        }
    }
    points
}

#[test]
fn a_polyhedron_is_split_about_its_middle() {
    let mut of = listing(42, &CUBE.map(DVec3::from));
    let faces: Vec<Vec<u32>> = Kind::Hexahedron
        .faces()
        .iter()
        .map(|face| face.iter().map(|i| *i as u32).collect())
        .collect();
    of.faces.insert(0, faces);
    let cells = Cells::new(of).unwrap();
    assert_eq!((cells.solids().len(), cells.points().len(), cells.own_points()), (24, 15, 8));
    let volume: f64 = (0..24).map(|i| cells.placed(i).volume().abs()).sum();
    assert!((volume - 1.0).abs() < 1e-12);
}

#[test]
fn what_is_no_cell_is_refused_and_what_has_no_volume_counted() {
    let points = CUBE.map(DVec3::from);
    let refused = |listing: Listing| Cells::new(listing).unwrap_err().to_string();
    let mut beyond = listing(12, &points);
    beyond.corners[3] = 8;
    assert_eq!(refused(beyond), "expected corners from 0 to 7, found 8");
    assert!(refused(listing(10, &points)).contains("4 corners of cell 0"));
    assert!(refused(listing(200, &points)).contains("type 200 at cell 0"));
    let mut lists = listing(12, &points);
    lists.starts.push(8);
    assert!(refused(lists).contains("found 8 in 2 lists"));

    let mut flat = points;
    flat.iter_mut().for_each(|p| p.z = 0.0);
    let cells = Cells::new(listing(12, &flat)).unwrap();
    assert_eq!((cells.census().flat, cells.solids().len(), cells.is_surface()), (1, 0, true));
    let mut nan = points;
    nan[2].y = f64::NAN;
    let cells = Cells::new(listing(12, &nan)).unwrap();
    assert_eq!((cells.census().not_finite, cells.solids().len()), (1, 0));
    let quad = Cells::new(listing(9, &points[..4])).unwrap();
    assert_eq!((quad.solids().len(), quad.census().by_type.get(&9)), (0, Some(&1)));
}

#[test]
fn thin_solids_have_volume_and_only_rounding_has_none() {
    let tetrahedron = |points: [DVec3; 4]| {
        let mut corners = [DVec3::ZERO; 8];
        corners[..4].copy_from_slice(&points);
        Placed::new(Kind::Tetrahedron, corners)
    };
    // A needle, along an axis and turned.
    let turns = [DMat3::IDENTITY, DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(0.3)];
    for turn in turns {
        let needle = [DVec3::ZERO, 1e9 * DVec3::X, 1e-3 * DVec3::Y, 1e-3 * DVec3::Z];
        assert!(!tetrahedron(needle.map(|p| turn * p)).is_flat());
        let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.3, 0.4, 0.0)];
        let away = DVec3::new(1e6, 3e5, 7e4);
        assert!(tetrahedron(flat.map(|p| turn * p)).is_flat());
        assert!(tetrahedron(flat.map(|p| turn * p + away)).is_flat(), "rounding is no volume");
        let line = [0.0, 0.1, 0.7, 1.0].map(|t| turn * DVec3::new(t, 3.0 * t, 0.1 * t) + away);
        assert!(tetrahedron(line).is_flat());
    }
}

/// A grid of hexahedra over a box, with a wave in it.
fn waves(dims: [usize; 3]) -> Arc<Cells> {
    let [nx, ny, nz] = dims;
    let points: Arc<[DVec3]> = (0..nx * ny * nz)
        .map(|i| DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / (nx * ny)) as f64))
        .map(|p| p + 0.2 * DVec3::new((p.y + p.z).sin(), (p.x * 1.3).cos(), (p.x - p.y).sin()))
        .collect();
    Arc::new(Cells::of_grid(&points, dims))
}

#[test]
fn every_place_of_a_grid_is_in_one_of_the_solids_that_are_listed_near_it() {
    let cells = waves([7, 6, 5]);
    let listed =
        Listed::new(&cells, ([13, 12, 11], |p: DVec3| p * 2.0), |_| true, &Ticket::new()).unwrap();
    let mut state = 0x5eed_000a_u64;
    for (i, _) in cells.solids().iter().enumerate() {
        let unit = DVec3::new(random(&mut state), random(&mut state), random(&mut state));
        let place = cells.placed(i).at(unit).0;
        let near = listed.near(place * 2.0);
        assert!(near.contains(&(i as u32)), "seed 0x5eed000a, solid {i}");
        assert!(near.is_sorted() && near.len() < 60, "{}", near.len());
        let holding = near.iter().filter(|n| cells.placed(**n as usize).unit_from(place).is_some());
        assert!(holding.count() >= 1);
    }
    let none = Listed::new(&cells, ([13, 12, 11], |p| p), |i| i != 3, &Ticket::new()).unwrap();
    assert!(!none.lists.contains(&3) && none.lists.contains(&4));
}

#[test]
fn the_surface_of_a_grid_has_the_faces_of_its_borders() {
    let (cells, [x, y, z]) = (waves([7, 6, 5]), [6, 5, 4]);
    let faces = cells.surface(|_| true, &Ticket::new()).unwrap().faces;
    assert_eq!(faces.len(), 2 * (x * y + y * z + z * x));
    // A hole has faces of its own.
    let holed = cells.surface(|i| i != x * y + x + 1, &Ticket::new()).unwrap().faces;
    assert_eq!(holed.len(), faces.len() + 6);
}

#[test]
fn numbers_of_cells_are_the_same_throughout_and_grow_as_their_neighbours_do() {
    let cells = waves([9, 3, 3]);
    let own = (0..cells.own_cells()).map(|i| (i % 8) as f64).collect();
    let field = CellField::new(cells, On::Cells, own);
    assert_eq!(field.range(), Some([0.0, 7.0]));
    assert_eq!(field.value(5, DVec3::new(0.9, 0.1, 0.3)), field.value(5, DVec3::splat(0.5)));
    let growths = field.growths(&Ticket::new()).unwrap();
    let inner = growths[9 * (3 + 1) + 4];
    assert!((inner.x - 1.0).abs() < 0.3 && inner.y.abs() < 0.4, "{inner}");
}

#[test]
fn solids_beside_numbers_that_are_not_finite_are_nowhere() {
    let cells = waves([3, 2, 2]);
    let mut own: Vec<f64> = (0..12).map(f64::from).collect();
    own[2] = f64::NAN;
    let field = CellField::new(cells, On::Points, own);
    assert_eq!((field.is_there(0), field.is_there(1)), (true, false));
    assert_eq!(field.range(), Some([0.0, 10.0]));
}

#[test]
fn cells_with_their_middle_inside_another_are_counted_and_no_others() {
    let overlapping = |cells: &Arc<Cells>| {
        let finder = Finder::new(cells, |_| true, &Ticket::new()).unwrap();
        finder.overlapping(&Ticket::new()).unwrap()
    };
    assert_eq!(overlapping(&waves([7, 6, 5])), 0, "neighbours share faces");
    let cubes = |offsets: &[DVec3]| {
        let mut of = Listing { starts: vec![0], ..Listing::default() };
        for offset in offsets {
            let first = u32::try_from(of.points.len()).unwrap();
            of.points.extend(CUBE.map(|corner| DVec3::from(corner) + *offset));
            of.types.push(12);
            of.corners.extend(first..first + 8);
            of.starts.push(of.corners.len());
        }
        Arc::new(Cells::new(of).unwrap())
    };
    let apart = DVec3::new(3.0, 0.0, 0.0);
    assert_eq!(
        overlapping(&cubes(&[DVec3::ZERO, DVec3::X, apart])),
        0,
        "one ends where one begins"
    );
    let little = DVec3::new(0.3, 0.2, 0.1);
    assert_eq!(overlapping(&cubes(&[DVec3::ZERO, little, apart])), 2, "each is in the other");
    assert_eq!(overlapping(&cubes(&[DVec3::ZERO, apart, apart])), 2, "twice the same");
    // More than half of it beside: their middles are not in one another.
    assert_eq!(overlapping(&cubes(&[DVec3::ZERO, 0.6 * DVec3::X])), 0);
    let ticket = Ticket::new();
    let finder = Finder::new(&cubes(&[DVec3::ZERO, little]), |_| true, &ticket).unwrap();
    ticket.cancel();
    assert_eq!(finder.overlapping(&ticket), Err(Cancelled));
}

/// Hexahedra between so many points along each axis, 1 apart.
fn grid_of_cubes(sides: usize) -> Arc<Cells> {
    let place = |i: usize| {
        DVec3::from([i % sides, i / sides % sides, i / (sides * sides)].map(|n| n as f64))
    };
    let points: Arc<[DVec3]> = (0..sides.pow(3)).map(place).collect();
    Arc::new(Cells::of_grid(&points, [sides; 3]))
}

#[test]
fn lists_and_surfaces_of_many_cells_are_left_off_where_a_ticket_says_so() {
    let cells = grid_of_cubes(41);
    let (count, points) = (cells.solids().len(), cells.points().len());
    // Points, solids, bounds and boxes are found; one part of eight lists each solid, in eight boxes or more, and the others pass it.
    let least = (points + 3 * count + 16 * count + 7 * count) >> 14;
    assert_stops("lists", least, |ticket| {
        Listed::new(&cells, ([41; 3], |place| place), |_| true, ticket)
    });
    // Points at one place are sought, faces put in buckets and these sorted, and what is left taken out; each time anew.
    let buckets = 4 * count / (1 << 14);
    assert_stops("a surface", count / (1 << 12) + buckets, |ticket| {
        cells.surface(|_| true, ticket)
    });
    let outer = cells.surface(|_| true, &Ticket::new()).unwrap().faces;
    assert_eq!(outer.len(), 6 * 40 * 40);
    assert!(outer.is_sorted_by_key(|face| (face.solid, face.number)));
}

#[test]
fn growths_of_many_cells_and_their_borders_are_left_off_where_a_ticket_says_so() {
    let cells = grid_of_cubes(41);
    let (count, points) = (cells.solids().len(), cells.points().len());
    for (on, loops) in [(On::Points, 3), (On::Cells, 4)] {
        let numbers = if on == On::Points { points } else { count };
        let values: Vec<f64> = (0..numbers).map(|i| (i % 977) as f64).collect();
        // Volumes are found, summed up and weighed.
        assert_stops(&format!("growths {on:?}"), loops * (count >> 12) - 1, |ticket| {
            CellField::new(Arc::clone(&cells), on, values.clone()).growths(ticket)
        });
    }
    // Every other cell is there, and has a border all around.
    let is_there = |i: usize| (i % 40 + i / 40 % 40 + i / 1600).is_multiple_of(2);
    let values: Vec<f64> =
        (0..count).map(|i| if is_there(i) { i as f64 } else { f64::NAN }).collect();
    let faces = 6 * count / 2;
    // Areas, corners, flat normals and depths; and each face with all others about its corners, twelve at most.
    let least = (faces + 4 * faces + faces + faces) / (1 << 13) + 4 * faces * 6 / (1 << 13);
    assert_stops("borders", least, |ticket| {
        let field = CellField::new(Arc::clone(&cells), On::Cells, values.clone());
        field.shading_normals(ticket)
    });
}

/// Tetrahedra by their points, with a listing of their own.
fn tetrahedra(points: &[[f64; 3]], corners: &[[u32; 4]]) -> Arc<Cells> {
    let listing = Listing {
        points: points.iter().map(|point| DVec3::from(*point)).collect(),
        types: vec![10; corners.len()],
        starts: (0..=corners.len()).map(|i| 4 * i).collect(),
        corners: corners.as_flattened().to_vec(),
        ..Listing::default()
    };
    Arc::new(Cells::new(listing).unwrap())
}

#[test]
fn a_face_is_an_outer_one_where_all_cells_that_share_it_lie_on_one_side() {
    let unit = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    let below = [0.2, 0.3, -1.0];
    let points = [&unit[..], &[below, [0.3, 0.2, 0.5], [1., 1., 0.]]].concat();
    let outer = |points: &[[f64; 3]], corners: &[[u32; 4]]| {
        let Surface { faces, twins } =
            tetrahedra(points, corners).surface(|_| true, &Ticket::new()).unwrap();
        assert!(faces.is_sorted_by_key(|face| (face.solid, face.number)));
        let mut counts = vec![0; corners.len()];
        faces.iter().for_each(|face| counts[face.solid as usize] += 1);
        // Those that are there twice have no faces left.
        let is_twin = |i: &u32| counts[*i as usize] == 0;
        assert_eq!(twins, (0..counts.len() as u32).filter(is_twin).collect::<Vec<_>>());
        counts
    };
    let own = [0, 1, 2, 3];
    assert_eq!(outer(&points, &[own]), [4]);
    assert_eq!(outer(&points, &[own, own]), [4, 0], "the same twice");
    assert_eq!(outer(&points, &[own, [1, 2, 0, 3], own]), [4, 0, 0], "the same, however it begins");
    // A neighbour, whichever way its points go round.
    assert_eq!(outer(&points, &[own, [0, 2, 1, 4]]), [3, 3]);
    assert_eq!(outer(&points, &[own, [0, 1, 2, 4]]), [3, 3]);
    // Two on one side of a face, which is the first one's; and a third on the other.
    assert_eq!(outer(&points, &[own, [0, 1, 2, 5]]), [4, 3]);
    assert_eq!(outer(&points, &[own, [0, 1, 2, 5], [0, 2, 1, 4]]), [3, 3, 3]);
    // One without volume joins whatever it lies between.
    assert_eq!(outer(&points, &[own, [0, 1, 2, 6]]), [3, 3]);
    // Pieces have points of their own at the same places.
    let pieces = [&unit[..], &[unit[0], unit[2], unit[1], below]].concat();
    assert_eq!(outer(&pieces, &[own, [4, 5, 6, 7]]), [3, 3]);
    let twice = [unit, unit].concat();
    assert_eq!(outer(&twice, &[own, [4, 5, 6, 7]]), [4, 0]);
    // Where the first has no value the second is seen.
    let cells = tetrahedra(&twice, &[own, [4, 5, 6, 7]]);
    let field = CellField::new(cells, On::Cells, vec![f64::NAN, 1.0]);
    assert_eq!(field.drawn(&Ticket::new()), Ok(vec![false, true]));
}

#[test]
fn faces_go_round_as_seen_from_outside() {
    let mut state = 0x5eed_0041_u64;
    for kind in KINDS {
        let solid = bent(kind, &mut state);
        let way = solid.at(kind.middle()).1.determinant().signum();
        for face in kind.faces() {
            let corner =
                |i: usize| solid.corners()[face[i % face.len()]] - solid.corners()[face[0]];
            let area: DVec3 = (0..face.len()).map(|i| corner(i).cross(corner(i + 1))).sum();
            let outwards = solid.corners()[face[0]] - solid.at(kind.middle()).0;
            // None is left of a face where two edges fall together.
            assert!(area.dot(outwards) * way >= 0.0, "{kind:?} {face:?}");
        }
    }
}

/// Long and short, flat and turned over, some of them beyond all boxes; where several have a place, the first does.
#[test]
fn every_place_of_tetrahedra_that_overlap_is_in_those_that_are_listed_near_it() {
    let mut state = 0x5eed_0042_u64;
    let mut points = Vec::new();
    for i in 0..300 {
        let mut place = |by: f64| [0, 1, 2].map(|_| by * random(&mut state));
        let about = place(9.0);
        let size = [0.3, 2.0, 12.0][i % 3];
        for _ in 0..4 {
            let [x, y, z] = place(size);
            let flat = if i % 5 == 0 { 1e-3 } else { 1.0 };
            points.push([about[0] + x - 1.0, about[1] + y - 1.0, about[2] + z * flat - 1.0]);
        }
    }
    let corners: Vec<[u32; 4]> = (0..300).map(|i| [0, 1, 2, 3].map(|c| 4 * i + c)).collect();
    let cells = tetrahedra(&points, &corners);
    let near = Listed::new(&cells, ([9; 3], |p| p), |_| true, &Ticket::new()).unwrap();
    let finder = Finder::new(&cells, |_| true, &Ticket::new()).unwrap();
    let (mut listed, mut held) = (0, 0);
    for i in 0..300 {
        for _ in 0..20 {
            let [r, s, t] = [0, 1, 2].map(|_| random(&mut state));
            let sum = (r + s + t).max(1.0) * 1.001;
            let place = cells.placed(i).at(DVec3::new(r, s, t) / sum).0;
            let own = near.near(place);
            assert!(own.contains(&(i as u32)) && own.is_sorted(), "seed 0x5eed0042, {i}: {place}");
            listed += own.len();
            let holds = |solid: &usize| cells.placed(*solid).unit_from(place).is_some();
            held += (0..300).filter(holds).count();
            let first = (0..300).find(holds);
            assert_eq!(finder.find(place).map(|(solid, _)| solid), first, "{i}: {place}");
        }
    }
    println!("measured {listed} listed of {held} that hold the places");
    assert!(listed < 20 * held, "{listed} listed, {held} hold the places");
}

/// One cell of a kind, on the points of a lattice in a plane.
fn polygon(kind: u8, points: &[[f64; 2]]) -> Result<Cells, CellsError> {
    #[expect(clippy::cast_possible_truncation, reason = "a few points")]
    let count = points.len() as u32;
    Cells::new(Listing {
        points: points.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect(),
        types: vec![kind],
        starts: vec![0, count as usize],
        corners: (0..count).collect(),
        ..Listing::default()
    })
}

/// Twice the areas of a cell's triangles, which all go round one way, and how many of its points they have.
fn doubled_areas(cells: &Cells) -> (Vec<f64>, usize) {
    let found = cells.triangles(&Ticket::new()).expect("not cancelled");
    let area = |(triangle, _): &([u32; 3], u32)| {
        let [a, b, c] = triangle.map(|point| cells.points()[point as usize]);
        (b - a).cross(c - a).z
    };
    let mut used: Vec<u32> = found.iter().flat_map(|(triangle, _)| *triangle).collect();
    used.sort_unstable();
    used.dedup();
    (found.iter().map(area).collect(), used.len())
}

#[test]
fn polygons_of_higher_orders_are_triangles_between_all_of_their_points() {
    // Corners, edges, then the inside (`vtkHigherOrderTriangle`, `vtkHigherOrderQuadrilateral`).
    let triangle = [
        [0., 0.],
        [3., 0.],
        [0., 3.],
        [1., 0.],
        [2., 0.],
        [2., 1.],
        [1., 2.],
        [0., 2.],
        [0., 1.],
        [1., 1.],
    ];
    let third = polygon(69, &triangle).expect("a triangle of the third order");
    assert!(third.is_surface() && third.census().split == 1);
    assert_eq!(doubled_areas(&third), (vec![1.0; 9], 10));
    let second = [[0., 0.], [2., 0.], [0., 2.], [1., 0.], [1., 1.], [0., 1.]];
    let second = polygon(69, &second).expect("a triangle of the second order");
    assert_eq!(doubled_areas(&second), (vec![1.0; 4], 6));
    let square =
        [[0., 0.], [2., 0.], [2., 2.], [0., 2.], [1., 0.], [2., 1.], [1., 2.], [0., 1.], [1., 1.]];
    let square = polygon(70, &square).expect("a quadrilateral of the second order");
    assert_eq!(doubled_areas(&square), (vec![1.0; 8], 9));
    let (areas, used) =
        doubled_areas(&polygon(70, &[[0., 0.], [1., 0.], [1., 1.], [0., 1.]]).unwrap());
    assert_eq!((areas, used), (vec![1.0; 2], 4));
    // Quadratic along two of four edges, and along all of three.
    let strip = [[0., 0.], [2., 0.], [2., 1.], [0., 1.], [1., 0.], [1., 1.]];
    let (areas, used) = doubled_areas(&polygon(30, &strip).unwrap());
    assert_eq!((areas.iter().sum::<f64>(), used), (4.0, 6));
    let ring = [[0., 0.], [2., 0.], [0., 2.], [1., 0.], [1., 1.], [0., 1.]];
    let (areas, used) = doubled_areas(&polygon(36, &ring).unwrap());
    assert_eq!((areas.iter().sum::<f64>(), used), (4.0, 6));
    let five = polygon(70, &[[0., 0.], [1., 0.], [1., 1.], [0., 1.], [0.5, 0.5]]);
    assert!(five.is_err_and(|error| error.to_string().ends_with("found 5")));
    for kind in [61, 62, 63, 76, 77] {
        let error = polygon(kind, &[[0., 0.], [1., 0.], [0., 1.]]).expect_err("not read");
        assert!(error.found.contains(&format!("type {kind}")), "{error}");
        assert!(error.advice.contains("into triangles"), "{error}");
    }
}

#[test]
fn solids_without_volume_are_seen_by_their_faces() {
    let hexahedra = |points: Vec<DVec3>, corners: Vec<u32>| {
        let count = corners.len() / 8;
        let starts = (0..=count).map(|cell| 8 * cell).collect();
        let types = vec![split::HEXAHEDRON; count];
        Cells::new(Listing { points, types, starts, corners, ..Listing::default() }).unwrap()
    };
    // Two squares side by side, as hexahedra whose upper points lie at their lower ones.
    let layer = || (0..6).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3), 0.0));
    let corners = [[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]].concat();
    let flat = hexahedra(layer().chain(layer()).collect(), corners);
    assert!(flat.census().flat == 2 && flat.is_surface() && flat.solids().is_empty());
    let found = flat.triangles(&Ticket::new()).unwrap();
    let sources: Vec<u32> = found.iter().map(|(_, source)| *source).collect();
    assert_eq!(sources, [0, 0, 1, 1], "each square once, by the cell that it is of");
    let area = |(triangle, _): &([u32; 3], u32)| {
        let [a, b, c] = triangle.map(|point| flat.points()[point as usize]);
        (b - a).cross(c - a).length() / 2.0
    };
    assert_eq!(found.iter().map(area).sum::<f64>(), 2.0);
    // On a line there is nothing.
    let line = (0..8).map(|i| DVec3::X * f64::from([0, 1, 1, 0, 0, 1, 1, 0][i])).collect();
    let line = hexahedra(line, (0..8).collect());
    assert!(!line.is_surface() && line.solids().is_empty());
    assert_eq!(line.triangles(&Ticket::new()).unwrap(), []);
    // What has an outer face is as it was.
    let cube = hexahedra(CUBE.map(DVec3::from).to_vec(), (0..8).collect());
    assert_eq!(cube.triangles(&Ticket::new()).unwrap().len(), 12);
}

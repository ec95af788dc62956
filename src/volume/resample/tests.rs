use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use super::super::shape::voxel;
use super::super::{Component, Samples};
use super::*;
use crate::cells::Listing;

fn at(dims: [usize; 3], index: usize) -> DVec3 {
    DVec3::from(voxel(dims, index).map(|i| i as f64))
}

/// A grid of a shape with one field.
fn grid(dims: [usize; 3], shape: Shape, association: Association, values: Vec<f64>) -> Grid {
    let field = Field {
        name: "f".into(),
        components: 1,
        association,
        samples: Arc::new(Samples::Float64(values)),
    };
    let grid = Grid::shaped(dims, shape, vec![field]).unwrap();
    grid.check().unwrap();
    grid
}

fn scalar(grid: &Grid) -> (Lattice, Vec<f64>) {
    let field = &grid.fields[0];
    let volume = grid.scalar(field, Component::Index(0), &Ticket::new()).unwrap();
    let values = (0..volume.samples.len()).map(|i| volume.samples.get(i)).collect();
    (volume.lattice, values)
}

fn rectilinear(x: &[f64], y: &[f64], z: &[f64]) -> ([usize; 3], Shape) {
    ([x.len(), y.len(), z.len()], Shape::Rectilinear([x.into(), y.into(), z.into()]))
}

/// Trilinear interpolation loses nothing of this.
fn product(p: DVec3) -> f64 {
    1.0 + 2.0 * p.x - 3.0 * p.y + 0.5 * p.z + 0.25 * p.x * p.y * p.z - 0.5 * p.x * p.z
}

#[test]
fn a_rectilinear_grid_becomes_a_lattice_of_its_smallest_steps_with_the_same_values() {
    let x = [0.0, 0.5, 2.0, 3.0, 5.0];
    let y = [4.0, 3.0, 0.0];
    let z = [-1.0, 0.0, 1.0];
    let (dims, shape) = rectilinear(&x, &y, &z);
    let points = shape.points(dims);
    let grid = grid(dims, shape, Association::Point, points.iter().map(|p| product(*p)).collect());
    let (lattice, values) = scalar(&grid);
    assert_eq!(lattice.dims, [11, 5, 3]);
    assert_eq!(
        (lattice.origin, lattice.spacing),
        (DVec3::new(0., 0., -1.), DVec3::new(0.5, 1., 1.))
    );
    for (index, value) in values.iter().enumerate() {
        let expected = product(lattice.world_from_index(at(lattice.dims, index)));
        assert!((value - expected).abs() < 1e-12, "{index}: {value}, not {expected}");
    }
    let told = grid.resampling().unwrap();
    assert!(told.contains("11 × 5 × 3 for its 5 × 3 × 3 points"), "{told}");
}

#[test]
fn cells_of_a_rectilinear_grid_are_drawn_between_their_middles() {
    let (dims, shape) = rectilinear(&[0.0, 1.0, 3.0, 4.0], &[0.0, 2.0], &[0.0, 1.0]);
    let grid = grid(dims, shape, Association::Cell, vec![10.0, 20.0, 30.0]);
    let (lattice, values) = scalar(&grid);
    // Middles at 0.5, 2, 3.5: even, so nothing is interpolated.
    assert_eq!((lattice.dims, lattice.spacing.x, lattice.origin.y), ([3, 1, 1], 1.5, 1.0));
    assert_eq!(values, [10.0, 20.0, 30.0]);
    assert_eq!(grid.resampling(), None);
}

#[test]
fn a_hole_reaches_no_further_than_its_cells() {
    let (dims, shape) = rectilinear(&[0.0, 1.0, 2.0, 4.0], &[0.0, 1.0], &[0.0, 1.0]);
    let mut values = vec![1.0; 16];
    values[0] = f64::NAN;
    let (lattice, values) = scalar(&grid(dims, shape, Association::Point, values));
    let holes: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_nan()).collect();
    assert_eq!((lattice.dims, holes), ([5, 2, 2], vec![0]));
}

#[test]
fn an_even_axis_keeps_its_samples_beside_an_uneven_one() {
    let x: Vec<f64> = (0..47).map(|i| f64::from(0.05208_f32 * i as f32 - 1.22396)).collect();
    let (dims, shape) = rectilinear(&x, &[0.0, 1.0], &[0.0, 0.05, 0.15]);
    assert_eq!(lattice(&shape, dims).dims, [47, 2, 4]);
}

#[test]
fn a_lattice_is_never_of_more_than_four_times_the_samples() {
    // A boundary layer: steps from 1e-6 to 1.
    let layered: Vec<f64> = (0..48).map(|i| 10_f64.powf(i as f64 / 8.0 - 6.0)).collect();
    let (dims, shape) = rectilinear(&layered, &layered, &layered);
    let of = lattice(&shape, dims);
    let (had, has) = (48_usize.pow(3), of.len());
    assert!(has <= 4 * had && has > 3 * had, "{of:?}");
    assert!(of.dims.iter().all(|&n| n >= 48), "{of:?}");
    let points = shape.points(dims);
    let cells = Cells::of_grid(&points, dims);
    let of = lattice_in(cells.bounds(), cells.solids().len());
    let wanted = 47_usize.pow(3) * 8;
    assert!(of.len() < wanted + wanted / 10 && of.len() > wanted - wanted / 10, "{of:?}");
}

/// A quarter of a thick shell: radius 1 to 2, both angles up to a right one.
#[test]
fn coordinates_next_to_each_other_cost_no_more_samples_than_others() {
    let close = [0.0, 1e-300, 1.0];
    let (dims, shape) = rectilinear(&close, &close, &close);
    let of = lattice(&shape, dims);
    assert!(of.len() <= 1 << 15, "{:?}", of.dims);
    assert!(of.dims.iter().all(|n| *n >= 3), "{:?}", of.dims);
}

fn shell(dims: [usize; 3]) -> Arc<[DVec3]> {
    let last = DVec3::from(dims.map(|n| (n - 1) as f64));
    (0..dims.iter().product())
        .map(|index| {
            let part = at(dims, index) / last;
            let (radius, turn, tilt) =
                (1.0 + part.x, FRAC_PI_2 * part.y, FRAC_PI_2 * (part.z - 0.5));
            radius * DVec3::new(turn.cos() * tilt.cos(), turn.sin() * tilt.cos(), tilt.sin())
        })
        .collect()
}

#[test]
fn a_curvilinear_grid_keeps_what_is_linear_in_the_world_and_leaves_the_rest_of_its_box_empty() {
    let dims = [9, 14, 13];
    let points = shell(dims);
    let linear = |p: DVec3| 3.0 * p.x - 2.0 * p.y + 0.5 * p.z + 10.0;
    let values = points.iter().map(|p| linear(*p)).collect();
    let grid = grid(dims, Shape::Curvilinear(points), Association::Point, values);
    let (lattice, values) = scalar(&grid);
    // Chords over 1/13 and 1/12 of a right angle lie inside their arcs by no more than
    // 2 (1 - cos(π/52) cos(π/48)) = 0.0079.
    const BULGE: f64 = 0.008;
    let (mut inside, mut outside) = (0, 0);
    for (index, value) in values.iter().enumerate() {
        let p = lattice.world_from_index(at(lattice.dims, index));
        let (radius, turn) = (p.length(), p.y.atan2(p.x));
        let tilt = (p.z / radius).asin();
        let depth = (radius - 1.0).min(2.0 - radius);
        let turned = turn.min(FRAC_PI_2 - turn).min(FRAC_PI_2 / 2.0 - tilt.abs());
        if depth > BULGE && turned > BULGE {
            inside += 1;
            assert!((value - linear(p)).abs() < 1e-5, "{p}: {value}, not {}", linear(p));
        } else if depth < -BULGE || turned < -BULGE {
            outside += 1;
            assert!(value.is_nan(), "{p} is outside but has {value}");
        }
    }
    assert!(inside > 4000 && outside > 4000, "{inside} inside, {outside} outside");
}

#[test]
fn values_along_a_curvilinear_grid_are_found_by_inverting_its_map() {
    let dims = [21, 41, 41];
    let points = shell(dims);
    // The radius itself: the first index, halved and halved again.
    let values = (0..points.len()).map(|i| 1.0 + at(dims, i).x / 20.0).collect();
    let grid = grid(dims, Shape::Curvilinear(points), Association::Point, values);
    let (lattice, values) = scalar(&grid);
    let mut worst = 0.0_f64;
    for (index, value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let radius = lattice.world_from_index(at(lattice.dims, index)).length();
        worst = worst.max((value - radius).abs());
    }
    // Chords lie inside their arcs by up to radius · (step / 2)² / 2 in two directions: 7.7e-4 at radius
    // 2 and steps of a right angle's fortieth.
    assert!(worst < 8e-4 && worst > 1e-5, "{worst}");
}

#[test]
fn curved_surfaces_have_no_scalars_but_vectors_and_a_cancel_is_answered() {
    let dims = [5, 4, 1];
    let points: Arc<[DVec3]> =
        (0..20).map(|i| at(dims, i) + DVec3::Z * at(dims, i).x.powi(2)).collect();
    let surface = grid(dims, Shape::Curvilinear(points), Association::Point, vec![1.0; 20]);
    let field = &surface.fields[0];
    let refused = surface.scalar(field, Component::Index(0), &Ticket::new()).unwrap_err();
    assert!(refused.to_string().contains("5 × 4 × 1"), "{refused}");
    assert!(surface.vectors_of([field; 3], &Ticket::new()).is_ok());

    let ticket = Ticket::new();
    ticket.cancel();
    let scalar = |shape, dims| {
        let grid = grid(dims, shape, Association::Point, vec![0.0; 64]);
        grid.scalar(&grid.fields[0], Component::Index(0), &ticket)
    };
    let (dims, shape) = rectilinear(&[0., 1., 3., 4.], &[0., 1., 3., 4.], &[0., 1., 3., 4.]);
    let points = shape.points(dims);
    assert!(matches!(scalar(shape, dims), Err(VolumeError::Cancelled(_))));
    assert!(matches!(scalar(Shape::Curvilinear(points), dims), Err(VolumeError::Cancelled(_))));
}

#[test]
fn points_are_filled_from_the_ellipsoids_about_them_and_nothing_lies_beside_them() {
    let places = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::NAN, DVec3::ONE];
    let listing = Listing { points: places.to_vec(), starts: vec![0], ..Listing::default() };
    let cells = Arc::new(Cells::new(listing).unwrap());
    let own = Samples::Float64(vec![1.0, 2.0, 3.0, 4.0, 5.0, f64::NAN]);
    let field = Field {
        name: "f".into(),
        components: 1,
        association: Association::Point,
        samples: Arc::new(own),
    };
    let grid = Grid::shaped([6, 1, 1], Shape::Unstructured(cells), vec![field]).unwrap();
    let field = grid.field(None).unwrap();
    let volume = grid.scalar(field, Component::Index(0), &Ticket::new()).unwrap();
    let scattered = volume.scattered.as_ref().expect("points");
    assert!(volume.cells.is_none() && scattered.count() == 4, "two are not finite");
    let statistics = &volume.statistics;
    // Of the points' own values: the mean of the lattice's would weigh each by its ellipsoid.
    let known = (statistics.min, statistics.max, statistics.mean, statistics.nan_count);
    assert_eq!(known, (1.0, 4.0, 2.5, 1));
    let ellipsoids = scattered.ellipsoids(&Ticket::new()).unwrap();
    let [nx, ny, nz] = volume.lattice.dims;
    let (mut inside, mut outside) = (0, 0);
    for i in (0..nx * ny * nz).step_by(97) {
        let at = DVec3::from([i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64));
        let expected = ellipsoids.value(volume.lattice.world_from_index(at));
        let found = volume.samples.get(i);
        assert!(found == expected || found.is_nan() && expected.is_nan());
        inside += u32::from(!found.is_nan());
        outside += u32::from(found.is_nan());
    }
    assert!(inside > 100 && outside > 100, "{inside} {outside}");
}

/// One point at a distance of a million leaves the rest a lattice of their own, few or many.
#[test]
fn points_far_from_all_others_have_no_sample() {
    for side in [8, 25] {
        let near = (0..side * side * side).map(|i| at([side; 3], i));
        let points: Vec<DVec3> = near.chain([DVec3::X * 1e6]).collect();
        let count = points.len();
        let values = (0..count).map(|i| i as f64).collect();
        let listing = Listing { points, starts: vec![0], ..Listing::default() };
        let shape = Shape::Unstructured(Arc::new(Cells::new(listing).unwrap()));
        let grid = grid([count, 1, 1], shape, Association::Point, values);
        let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).unwrap();
        let extent = volume.lattice.world_from_index(volume.lattice.dims.map(|n| n as f64).into());
        assert!(extent.max_element() < 4.0 * side as f64, "{extent}");
        let there = (0..volume.samples.len()).filter(|i| volume.samples.get(*i).is_finite());
        assert!(there.count() * 2 > side * side * side, "{side}");
        assert_eq!(volume.scattered.as_ref().expect("points").strays(), 1);
        // Its value counts all the same.
        assert_eq!(volume.statistics.max, count as f64 - 1.0);
    }
}

#[test]
fn cells_of_curvilinear_grids_are_drawn_themselves_and_so_is_what_leans() {
    let dims = [3, 3, 3];
    let upright: Arc<[DVec3]> = (0..27).map(|i| at(dims, i)).collect();
    let leaning: Arc<[DVec3]> = upright.iter().map(|p| DVec3::new(p.x + p.y, p.y, p.z)).collect();
    let is_of_cells = |points: &Arc<[DVec3]>, association: Association| {
        let count = if association == Association::Cell { 8 } else { 27 };
        let values = (0..count).map(f64::from).collect();
        let grid = grid(dims, Shape::Curvilinear(Arc::clone(points)), association, values);
        let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new());
        volume.expect("a volume").cells.is_some()
    };
    assert!(!is_of_cells(&upright, Association::Point), "the samples of a lattice");
    assert!(is_of_cells(&leaning, Association::Point));
    assert!(is_of_cells(&upright, Association::Cell) && is_of_cells(&leaning, Association::Cell));
}

/// Tetrahedra of every size over one another, some of them flat: each sample is of the first that has its place.
#[test]
fn samples_of_cells_that_overlap_are_of_the_first() {
    use crate::cells::Finder;
    let mut state = 0x5eed_0043_u64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % 1_000_001) as f64 / 1e6
    };
    let mut listing = Listing { starts: vec![0], ..Listing::default() };
    for i in 0..120_u32 {
        let about = DVec3::new(random(), random(), random());
        let size = [0.05, 0.4, 1.5][i as usize % 3];
        for _ in 0..4 {
            let offset = DVec3::new(random(), random(), random()) * size;
            let flat = if i % 7 == 0 { DVec3::new(1.0, 1.0, 0.0) } else { DVec3::ONE };
            listing.points.push(about + offset * flat);
        }
        listing.types.push(10);
        listing.corners.extend(4 * i..4 * i + 4);
        listing.starts.push(listing.corners.len());
    }
    let values: Vec<f64> = (0..480).map(|_| random()).collect();
    let cells = Arc::new(Cells::new(listing).unwrap());
    let field = CellField::new(Arc::clone(&cells), On::Points, values);
    let step = DVec3::new(0.031, 0.047, 0.039);
    let lattice = Lattice { spacing: step, ..Lattice::unit([70, 50, 60]) };
    let found = Fill::Cells(&field).samples(&lattice, true, &Ticket::new()).unwrap();
    let finder = Finder::new(&cells, |_| true, &Ticket::new()).unwrap();
    let mut count = 0;
    for i in 0..lattice.len() {
        let index = DVec3::from([i % 70, i / 70 % 50, i / 3500].map(|n| n as f64));
        let here = finder.find(lattice.world_from_index(index));
        let expected = here.map_or(f64::NAN, |(solid, unit)| field.value(solid, unit));
        let is_same = (found.get(i) - expected).abs() < 1e-9;
        assert!(is_same || (found.get(i).is_nan() && here.is_none()), "seed 0x5eed0043, {index}");
        count += usize::from(here.is_some());
    }
    assert!(count > 10_000, "{count}");
}

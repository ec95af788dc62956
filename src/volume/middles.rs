//! Places between samples: where what was fitted to these may be far from them.

use glam::DVec3;

use super::{Association, Grid, Places, Samples, Shape};
use crate::cells::Cells;
use crate::core::{Cancelled, Ticket};

impl Grid {
    /// Middles between samples that are finite, `most` of them at most, which lie evenly among all: of grids between each two,
    /// four or eight that are next to each other; of unstructured samples on points the middles of cells (of a surface those
    /// of its triangles), of each two of a cell's corners, and halfway from its middle to each; of samples on cells their points.
    /// Points that no cell joins have none. Beside each place the mean of the samples that it is between, which is not a number
    /// where these are not known.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn middles(
        &self,
        association: Association,
        samples: &Samples,
        most: usize,
        ticket: &Ticket,
    ) -> Result<Vec<(DVec3, f64)>, Cancelled> {
        match &self.shape {
            Shape::Unstructured(cells) => of_cells(cells, association, samples, most, ticket),
            _ => Ok(half_steps(&self.places(association), samples, most)),
        }
    }
}

/// Numbers below a count: all of them, or `most` that lie evenly. The stride is a fraction, so that it does not follow the rows
/// of a grid.
fn evenly(count: usize, most: usize) -> impl Iterator<Item = usize> {
    let some = count.min(most);
    let stride = count as f64 / some.max(1) as f64;
    (0..some).map(move |k| ((k as f64 * stride) as usize).min(count - 1))
}

/// Places half a step from samples along one axis or more.
fn half_steps(places: &Places, samples: &Samples, most: usize) -> Vec<(DVec3, f64)> {
    let [nx, ny, nz] = places.dims();
    let halves = [nx, ny, nz].map(|n| 2 * n - 1);
    let middle = |i: usize| {
        let half = [i % halves[0], i / halves[0] % halves[1], i / (halves[0] * halves[1])];
        // Where all steps are whole there is a sample.
        half.iter().any(|steps| !steps.is_multiple_of(2)).then_some(())?;
        let (mut sum, mut value) = (DVec3::ZERO, 0.0);
        // Along an axis whose steps are whole both ends are the same sample.
        for corner in 0..8_usize {
            let [x, y, z] = [0, 1, 2].map(|axis| (half[axis] + (corner >> axis & 1)) / 2);
            let at = (z * ny + y) * nx + x;
            samples.get(at).is_finite().then_some(())?;
            sum += places.at(at).0;
            value += samples.get(at) / 8.0;
        }
        Some((sum / 8.0, value))
    };
    evenly(halves.iter().product(), most).filter_map(middle).collect()
}

/// Middles of cells, or their points.
fn of_cells(
    cells: &Cells,
    association: Association,
    samples: &Samples,
    most: usize,
    ticket: &Ticket,
) -> Result<Vec<(DVec3, f64)>, Cancelled> {
    let points = cells.points();
    let finite = |(at, value): (DVec3, f64)| at.is_finite().then_some((at, value));
    if association == Association::Cell {
        let of_point = |i: usize| finite((points[i], f64::NAN));
        return Ok(evenly(cells.own_points(), most).filter_map(of_point).collect());
    }
    // Points that splits add have no sample of their own.
    let is_known = |corner: &u32| {
        let corner = *corner as usize;
        corner >= samples.len() || samples.get(corner).is_finite()
    };
    let place = |corners: &[u32], number: usize| {
        corners.iter().all(is_known).then_some(())?;
        let sample = |corner: u32| {
            let corner = corner as usize;
            (points[corner], if corner < samples.len() { samples.get(corner) } else { f64::NAN })
        };
        let amid =
            |(a, u): (DVec3, f64), (b, v): (DVec3, f64)| finite(((a + b) / 2.0, (u + v) / 2.0));
        let count = corners.len();
        if number <= count {
            let none = (DVec3::ZERO, 0.0);
            let add = |(at, value): (DVec3, f64), corner: &u32| {
                let (own_at, own) = sample(*corner);
                (at + own_at, value + own)
            };
            let (at, value) = corners.iter().fold(none, add);
            let middle = (at / count as f64, value / count as f64);
            return amid(middle, number.checked_sub(1).map_or(middle, |own| sample(corners[own])));
        }
        // Corners by the distance between them in the list.
        let (apart, first) = ((number - 1) / count, (number - 1) % count);
        let second = corners.get(first + apart)?;
        amid(sample(corners[first]), sample(*second))
    };
    let solids = cells.solids();
    if !solids.is_empty() {
        let most_corners = solids.iter().map(|solid| solid.corners().len()).max().unwrap_or(1);
        let each = places_in(most_corners);
        let of_solid = |i: usize| place(solids[i / each].corners(), i % each);
        return Ok(evenly(solids.len() * each, most).filter_map(of_solid).collect());
    }
    let triangles = cells.triangles(ticket)?;
    let each = places_in(3);
    let of_triangle = |i: usize| place(&triangles[i / each].0, i % each);
    Ok(evenly(triangles.len() * each, most).filter_map(of_triangle).collect())
}

/// Numbers of the places in a cell of so many corners, some of which are none: its middle, halfway to each corner, and each two.
fn places_in(corners: usize) -> usize {
    1 + corners * corners
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::cells::Listing;
    use crate::volume::{Field, Lattice};

    fn floats(values: &[f32]) -> Samples {
        Samples::Float32(values.to_vec())
    }

    /// Of samples that are all there.
    fn of(grid: &Grid, association: Association, count: usize) -> Vec<DVec3> {
        found_in(grid, association, &floats(&vec![1.0; count]), usize::MAX)
    }

    fn found_in(
        grid: &Grid,
        association: Association,
        samples: &Samples,
        most: usize,
    ) -> Vec<DVec3> {
        let found = grid.middles(association, samples, most, &Ticket::new());
        found.expect("not cancelled").into_iter().map(|(at, _)| at).collect()
    }

    #[test]
    fn grids_have_a_middle_between_each_two_four_and_eight_samples() {
        let lattice = Lattice {
            origin: DVec3::new(10.0, 0.0, 0.0),
            spacing: DVec3::new(1.0, 2.0, 4.0),
            ..Lattice::unit([3, 2, 2])
        };
        let grid = Grid::of(lattice, Vec::<Field>::new());
        let found = of(&grid, Association::Point, 12);
        assert_eq!(found.len(), 5 * 3 * 3 - 12);
        assert_eq!(found[0], DVec3::new(10.5, 0.0, 0.0));
        assert!(found.contains(&DVec3::new(11.5, 1.0, 2.0)), "amid eight");
        assert!(found.contains(&DVec3::new(12.0, 1.0, 4.0)), "at a border");
        // On cells there are two, and one middle between them.
        assert_eq!(of(&grid, Association::Cell, 2), [DVec3::new(11.0, 1.0, 2.0)]);
        let alone = Grid::of(Lattice::unit([1; 3]), Vec::new());
        assert!(of(&alone, Association::Point, 1).is_empty());

        // Beside what is not finite nothing is known.
        let mut values = [1.0; 12];
        values[0] = f32::NAN;
        let beside = found_in(&grid, Association::Point, &floats(&values), usize::MAX);
        assert_eq!(beside.len(), found.len() - 7, "one cell has lost all seven that touch it");
        assert!(!beside.contains(&DVec3::new(10.5, 1.0, 2.0)));
    }

    #[test]
    fn middles_have_the_means_of_the_samples_about_them() {
        let lattice = Lattice::unit([3, 2, 2]);
        let grid = Grid::of(lattice, Vec::<Field>::new());
        let along = |at: DVec3| 1.0 + at.x + 2.0 * at.y - 4.0 * at.z;
        let places = grid.places(Association::Point);
        #[expect(clippy::cast_possible_truncation, reason = "small whole numbers")]
        let values: Vec<f32> = (0..12).map(|i| along(places.at(i).0) as f32).collect();
        let found = grid.middles(Association::Point, &floats(&values), usize::MAX, &Ticket::new());
        for (at, value) in found.expect("not cancelled") {
            assert!((value - along(at)).abs() < 1e-6, "{at}: {value}");
        }
        let corners =
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(DVec3::from);
        let listing = Listing {
            points: corners.to_vec(),
            types: vec![10],
            starts: vec![0, 4],
            corners: vec![0, 1, 2, 3],
            ..Listing::default()
        };
        let cells = Arc::new(Cells::new(listing).expect("sound cells"));
        let mesh = Grid::shaped([4, 1, 1], Shape::Unstructured(cells), Vec::new()).expect("a grid");
        let values = floats(&[1.0, 2.0, 3.0, -3.0]);
        let of_mesh = |association| {
            mesh.middles(association, &values, usize::MAX, &Ticket::new()).expect("not cancelled")
        };
        let found = of_mesh(Association::Point);
        assert_eq!(found.len(), 11);
        for (at, value) in found {
            assert!((value - along(at)).abs() < 1e-6, "{at}: {value}");
        }
        assert!(of_mesh(Association::Cell).iter().all(|(_, value)| value.is_nan()));
    }

    #[test]
    fn bent_grids_have_them_between_their_own_points() {
        let points = [0.0, 1.0, 4.0].map(|x| DVec3::new(x, x * x, 0.0));
        let shape = Shape::Curvilinear(points.into());
        let grid = Grid::shaped([3, 1, 1], shape, Vec::new()).expect("a grid");
        let expected = [DVec3::new(0.5, 0.5, 0.0), DVec3::new(2.5, 8.5, 0.0)];
        assert_eq!(of(&grid, Association::Point, 3), expected);
    }

    #[test]
    fn meshes_have_those_of_their_cells_and_points_alone_have_none() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]]
            .map(DVec3::from);
        let mesh = |types: Vec<u8>, starts: Vec<usize>, cells: Vec<u32>| {
            let listing = Listing {
                points: corners.to_vec(),
                types,
                starts,
                corners: cells,
                ..Listing::default()
            };
            let cells = Cells::new(listing).expect("sound cells");
            Grid::shaped([5, 1, 1], Shape::Unstructured(Arc::new(cells)), Vec::new())
                .expect("a grid")
        };
        let two = mesh(vec![10, 10], vec![0, 4, 8], vec![0, 1, 2, 3, 1, 2, 3, 4]);
        let found = of(&two, Association::Point, 5);
        // The middle, halfway to four corners, and six edges of each.
        assert_eq!(found.len(), 22);
        assert!(found.contains(&DVec3::splat(0.25)) && found.contains(&DVec3::splat(0.5)));
        assert!(found.contains(&DVec3::splat(0.125)), "halfway to the corner at 0");
        for edge in [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3], [1, 4], [2, 4], [3, 4]] {
            let middle = (corners[edge[0]] + corners[edge[1]]) / 2.0;
            assert!(found.contains(&middle), "of {edge:?}");
        }
        assert!(!found.iter().any(|at| corners.contains(at)), "where a sample is");
        assert_eq!(of(&two, Association::Cell, 2), corners);
        let holed = floats(&[f32::NAN, 1.0, 1.0, 1.0, 1.0]);
        let found = found_in(&two, Association::Point, &holed, usize::MAX);
        assert!(found.len() == 11 && found.contains(&DVec3::splat(0.5)), "{found:?}");
        let sheet = mesh(vec![5], vec![0, 3], vec![0, 1, 2]);
        let third = 1.0 / 3.0;
        let found = of(&sheet, Association::Point, 5);
        assert_eq!(found.len(), 7);
        assert!(found[0].distance(DVec3::new(third, third, 0.0)) < 1e-12, "{}", found[0]);
        let points = mesh(Vec::new(), vec![0], Vec::new());
        assert!(of(&points, Association::Point, 5).is_empty());
    }

    #[test]
    fn of_many_as_many_as_asked_for_lie_all_over_the_grid() {
        let grid = Grid::of(Lattice::unit([20; 3]), Vec::new());
        let all = floats(&[1.0; 8000]);
        let found = found_in(&grid, Association::Point, &all, 1000);
        // One in eight of the places is a sample's.
        assert!((800..=1000).contains(&found.len()), "{}", found.len());
        for axis in 0..3 {
            let half = |at: &&DVec3| at[axis] < 9.5;
            let below = found.iter().filter(half).count() as f64 / found.len() as f64;
            assert!((0.4..0.6).contains(&below), "{axis}: {below}");
            let whole = found.iter().filter(|at| at[axis].fract() == 0.0).count();
            assert!(whole > 200 && whole < found.len() - 200, "{axis}: {whole}");
        }
    }
}

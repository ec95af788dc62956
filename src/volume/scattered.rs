//! Samples that form no lattice: scattered points, and the points or middles of cells.

use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

use super::without_strays;
use crate::cells::CellField;
use crate::core::progress::{Cancelled, Ticket};
use crate::rbf::{Encoding, log_spread, next_distance};

/// Samples at places anywhere, and the ellipsoids about them as which they can be drawn.
#[derive(Debug)]
pub struct Scattered {
    count: usize,
    source: Source,
    /// Once someone has asked for them.
    ellipsoids: Mutex<Option<Arc<Encoding>>>,
}

#[derive(Debug)]
enum Source {
    /// Places with a value each, and how far apart they lie.
    Points { samples: Vec<(DVec3, f64)>, spacing: f64 },
    /// Those of cells.
    Cells(Arc<CellField>),
}

impl Scattered {
    /// Points or polygons from which on a look at their neighbours would take seconds.
    pub(super) const MOST_SAMPLED: usize = 10_000;
    /// Bytes that a sample takes while ellipsoids are made.
    pub(super) const BYTES: u64 = 400;

    /// Of world positions with a value each. Those that lie nowhere are left out, those whose value is not finite are holes;
    /// `None` where nothing else is left.
    pub fn new(mut samples: Vec<(DVec3, f64)>) -> Option<Self> {
        samples.retain(|(at, _)| at.is_finite());
        let count = samples.iter().filter(|(_, value)| value.is_finite()).count();
        let places: Vec<DVec3> = samples.iter().map(|(at, _)| *at).collect();
        let source = Source::Points { spacing: next_distance(&places), samples };
        (count > 0).then_some(Self { count, source, ellipsoids: Mutex::default() })
    }

    /// Of the points, or middles, of cells; `None` where no cell is there.
    pub(super) fn of_cells(field: &Arc<CellField>) -> Option<Self> {
        let count = field.sample_count();
        let source = Source::Cells(Arc::clone(field));
        (count > 0).then_some(Self { count, source, ellipsoids: Mutex::default() })
    }

    /// How many there are with a value, those that lie at one place counted each.
    pub fn count(&self) -> usize {
        self.count
    }

    /// How far apart points lie, world; those of cells lie as far apart as their edges are long.
    pub fn spacing(&self) -> Option<f64> {
        match self.source {
            Source::Points { spacing, .. } => Some(spacing),
            Source::Cells { .. } => None,
        }
    }

    /// How many points lie far from all others, and are left out of the field that is made of them; 0 of cells.
    pub fn strays(&self) -> usize {
        let Source::Points { samples, .. } = &self.source else { return 0 };
        let places: Vec<DVec3> = samples.iter().map(|(at, _)| *at).collect();
        without_strays(&places).map_or(0, |(_, count)| count)
    }

    /// Whether they are points alone, rather than those of cells.
    pub fn are_points(&self) -> bool {
        matches!(self.source, Source::Points { .. })
    }

    /// Whether they are points so many that evenly spaced samples are of the points themselves, most of them of none: those of the
    /// ellipsoids would take seconds.
    pub fn are_many_points(&self) -> bool {
        self.are_points() && self.count > Self::MOST_SAMPLED
    }

    /// The ellipsoids, as [`Encoding::about_samples`] has them, made at the first call; of cells as [`Encoding::about_cells`] has
    /// them, which end about where these do.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn ellipsoids(&self, ticket: &Ticket) -> Result<Arc<Encoding>, Cancelled> {
        // Whoever died holding it left what was there.
        let mut made = self.ellipsoids.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = &*made {
            return Ok(Arc::clone(known));
        }
        let found = Arc::new(match &self.source {
            Source::Points { samples, .. } => {
                Encoding::about_samples(samples.iter().copied(), ticket)?
            }
            Source::Cells(field) => {
                // Cells that are points have none.
                let unit = field.cells().median_edge().max(f64::MIN_POSITIVE);
                Encoding::about_cells(field.samples(unit, log_spread, ticket)?, unit, ticket)?
            }
        });
        *made = Some(Arc::clone(&found));
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::cells::{Cells, Listing, On};

    /// Boxes of a size each, four along each axis, as hexahedra or six tetrahedra each, and a number that grows along all axes.
    fn boxes(size: DVec3, is_of_tetrahedra: bool, on: On) -> Arc<CellField> {
        let at = |i: usize| DVec3::from([i % 5, i / 5 % 5, i / 25].map(|n| n as f64)) * size;
        let points: Vec<DVec3> = (0..125).map(at).collect();
        let linear = |place: DVec3| (place / size).dot(DVec3::new(1.0, 2.0, 3.0));
        let cells = match is_of_tetrahedra {
            false => Cells::of_grid(&points.iter().copied().collect(), [5; 3]),
            true => tetrahedra(points.clone()),
        };
        let places = if on == On::Points { points } else { cells.middles().to_vec() };
        let values = places.into_iter().map(linear).collect();
        Arc::new(CellField::new(Arc::new(cells), on, values))
    }

    /// Those along the diagonals of the boxes between some points.
    fn tetrahedra(points: Vec<DVec3>) -> Cells {
        let mut corners: Vec<u32> = Vec::new();
        for low in (0..125).filter(|i| i % 5 < 4 && i / 5 % 5 < 4 && i / 25 < 4) {
            for [a, b] in [[1, 5], [5, 1], [1, 25], [25, 1], [5, 25], [25, 5]] {
                corners.extend([low, low + a, low + a + b, low + 31]);
            }
        }
        let count = corners.len() / 4;
        let starts = (0..=count).map(|i| 4 * i).collect();
        let types = vec![10; count];
        let faces = BTreeMap::new();
        Cells::new(Listing { points, types, starts, corners, faces }).expect("cells")
    }

    fn about(field: &Arc<CellField>) -> Arc<Encoding> {
        let scattered = Scattered::of_cells(field).expect("cells");
        let found = scattered.ellipsoids(&Ticket::new()).expect("not cancelled");
        let there = found.heights().iter().filter(|height| **height > 0.0).count();
        assert_eq!(there, scattered.count());
        found
    }

    /// Neighbours of points that lie close along an axis are those along it alone, if they are the nearest ones: ellipsoids about
    /// them reached no others, and between them there was nothing.
    #[test]
    fn ellipsoids_about_long_thin_cells_reach_all_of_these() {
        for size in [DVec3::ONE, DVec3::new(1.0, 0.05, 1.0), DVec3::new(0.004, 0.02, 1.0)] {
            for (is_of_tetrahedra, on, most) in
                [(false, On::Points, 0.3), (true, On::Points, 0.4), (false, On::Cells, 0.3)]
            {
                let found = about(&boxes(size, is_of_tetrahedra, on));
                // Within the middles of the outermost cells: beyond them values go on as they are.
                for i in 0..1000 {
                    let share = DVec3::from([i % 10, i / 10 % 10, i / 100].map(f64::from)) / 9.0;
                    let place = 0.5 + 3.0 * share;
                    let value = found.value(place * size);
                    let expected = place.dot(DVec3::new(1.0, 2.0, 3.0));
                    let off = (value - expected).abs();
                    assert!(off < 6.0 * most, "{size} {is_of_tetrahedra} {on:?} {place}: {off}");
                }
                // They end about where the boxes do.
                for i in 0..600 {
                    let (axis, side) = (i % 3, i / 3 % 2);
                    let share = |n: usize| 0.8 + 0.24 * (n % 11) as f64;
                    let mut place = DVec3::new(share(i / 6), share(i / 66), share(i / 7));
                    let is_there = |beyond: f64| {
                        place[axis] = if side == 0 { -beyond } else { 4.0 + beyond };
                        !found.value(place * size).is_nan()
                    };
                    let shown = [-0.2, 0.3].map(is_there);
                    assert_eq!(shown, [true, false], "{size} {is_of_tetrahedra} {on:?} {place}");
                }
            }
        }
    }

    #[test]
    fn ellipsoids_about_the_corners_of_boxes_are_six_tenths_as_wide_as_these() {
        let size = DVec3::new(0.01, 2.0, 0.5);
        for on in [On::Points, On::Cells] {
            let found = about(&boxes(size, false, on));
            for (function, axis) in
                found.functions().iter().flat_map(|f| DVec3::AXES.map(|axis| (f, axis)))
            {
                let width = (function.shape * (axis * size)).length().recip();
                assert!((width - 0.6).abs() < 0.01, "{on:?} {}: {width}", function.centre);
            }
        }
    }

    /// Two boxes with corners of their own on the face between them, and a constant.
    #[test]
    fn points_that_are_there_twice_are_one_and_a_constant_stays_one() {
        let corner = |i: usize, shift: usize| {
            DVec3::from([i % 2, i / 2 % 2, i / 4 + shift].map(|n| n as f64))
        };
        let points = (0..16).map(|i| corner(i % 8, i / 8)).collect();
        let ring = [0, 1, 3, 2, 4, 5, 7, 6];
        let corners = ring.iter().copied().chain(ring.map(|i| i + 8)).collect();
        let faces = BTreeMap::new();
        let listing =
            Listing { points, types: vec![12; 2], starts: vec![0, 8, 16], corners, faces };
        let cells = Arc::new(Cells::new(listing).expect("cells"));
        let field = Arc::new(CellField::new(cells, On::Points, vec![7.25; 16]));
        let found = Scattered::of_cells(&field).expect("cells").ellipsoids(&Ticket::new());
        let found = found.expect("not cancelled");
        assert_eq!(found.heights().iter().filter(|height| **height > 0.0).count(), 12);
        for i in 0..200 {
            let share = DVec3::new(f64::from(i % 11), f64::from(i % 13), f64::from(i % 17));
            let place = 0.15 + share / DVec3::new(15.0, 18.0, 10.0);
            assert!((found.value(place) - 7.25).abs() < 1e-12, "{place}");
        }
    }
}

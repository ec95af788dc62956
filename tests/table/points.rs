//! The scattered points of the table's scenes: dense and sparse, some far from others, some at one place.

use std::sync::Arc;

use glam::DVec3;
use voxsplat::core::progress::Ticket;
use voxsplat::volume::{Lattice, Samples, Scattered};

use crate::scenes::random;

/// How many there are.
const POINTS: usize = 70;

/// Points over most of a lattice, a gap among them.
pub(crate) fn points(lattice: &Lattice) -> Arc<Scattered> {
    let last = DVec3::from(lattice.dims.map(|n| n as f64 - 1.0));
    let place = |i: usize| {
        let at = [61, 62, 63].map(|seed| random(seed, i));
        // Half of them lie in a corner.
        let at = if i.is_multiple_of(2) { at } else { at.map(|share| 0.45 * share) };
        lattice.world_from_index(last * (0.15 + 0.7 * DVec3::from(at)))
    };
    let middle = lattice.world_from_index(last * 0.6);
    let gap = 0.2 * (lattice.axes() * last).length();
    let sample = |i: usize| (place(i), random(64, i) * 255.99);
    let mut all: Vec<(DVec3, f64)> =
        (0..POINTS).map(sample).filter(|(at, _)| at.distance(middle) > gap).collect();
    let (first, _) = all[0];
    // One alone in the gap, and two at one place.
    all.extend([(middle, 200.0), (first, 90.0)]);
    let found = Scattered::new(all);
    Arc::new(found.expect("finite points"))
}

/// The values at a lattice's samples, NaN beside all points.
pub(crate) fn samples_of(points: &Scattered, lattice: &Lattice) -> Samples {
    let [nx, ny, _] = lattice.dims;
    let ellipsoids = points.ellipsoids(&Ticket::new()).expect("not cancelled");
    let value = |i: usize| {
        let at = DVec3::from([i % nx, i / nx % ny, i / (nx * ny)].map(|i| i as f64));
        ellipsoids.value(lattice.world_from_index(at)) as f32
    };
    Samples::Float32((0..lattice.len()).map(value).collect())
}

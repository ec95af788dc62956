//! Index space of a grid: where its places lie in the world, between its points too.

use glam::{DMat3, DVec3};

use crate::volume::Places;

/// The places of a grid between its points: on lattices as they are, and else linear along each axis of
/// index space within a cell, as vectors are.
pub(super) struct GridMap<'a> {
    places: &'a Places,
    dims: [usize; 3],
    /// Of a lattice.
    index_from_world: DMat3,
}

/// A cell of a grid, and how far a place is along each of its axes, 0..=1.
pub(super) struct Cell {
    low: [usize; 3],
    share: DVec3,
}

/// Newton's steps towards a world position at most; it takes a handful, and one a cell on the way.
const MOST_STEPS: usize = 64;
/// How near to it, in steps of the grid.
const NEAR: f64 = 1e-7;

impl<'a> GridMap<'a> {
    pub(super) fn new(places: &'a Places) -> Self {
        let index_from_world = match places {
            Places::Lattice(lattice) => lattice.axes().inverse(),
            Places::Points { .. } => DMat3::IDENTITY,
        };
        Self { places, dims: places.dims(), index_from_world }
    }

    /// Whether directions of index space are those of the world everywhere.
    pub(super) fn is_even(&self) -> bool {
        matches!(self.places, Places::Lattice(_))
    }

    /// The cell about a place of index space; `None` beyond the outermost points. A single layer has the
    /// thickness of a step.
    pub(super) fn cell(&self, at: DVec3) -> Option<Cell> {
        let mut cell = Cell { low: [0; 3], share: DVec3::ZERO };
        for axis in 0..3 {
            let last = self.dims[axis] as f64 - 1.0;
            let reach = if self.dims[axis] == 1 { 0.5 } else { 1e-12 };
            if !(-reach..=last + reach).contains(&at[axis]) {
                return None;
            }
            let place = at[axis].clamp(0.0, last);
            cell.low[axis] = (place as usize).min(self.dims[axis].saturating_sub(2));
            cell.share[axis] = place - cell.low[axis] as f64;
        }
        Some(cell)
    }

    /// The points about a place, and the weight of each: those of none are left out.
    pub(super) fn weights(&self, cell: &Cell) -> impl Iterator<Item = (usize, f64)> {
        let Cell { low, share } = *cell;
        let dims = self.dims;
        (0..8).filter_map(move |corner| {
            let bit = |axis: usize| corner >> axis & 1;
            let weight = (0..3)
                .map(|axis| if bit(axis) == 1 { share[axis] } else { 1.0 - share[axis] })
                .product::<f64>();
            let [x, y, z] = [0, 1, 2].map(|axis| low[axis] + bit(axis));
            (weight != 0.0).then_some(((z * dims[1] + y) * dims[0] + x, weight))
        })
    }

    /// World position of a place of index space; beyond the border that of the border.
    pub(super) fn world(&self, at: DVec3) -> DVec3 {
        match self.places {
            Places::Lattice(lattice) => lattice.world_from_index(at),
            Places::Points { points, axes, .. } => {
                let Some(cell) = self.cell(self.within(at)) else { return points[0] };
                let sum = |of: &dyn Fn(usize) -> DVec3| {
                    self.weights(&cell).map(|(i, weight)| of(i) * weight).sum::<DVec3>()
                };
                let flat = (0..3).filter(|&axis| self.dims[axis] == 1);
                // A single layer has nothing beside it to be linear to.
                let beside = flat.map(|axis| sum(&|i| axes[i].col(axis)) * at[axis]);
                sum(&|i| points[i]) + beside.sum::<DVec3>()
            }
        }
    }

    /// World steps along the axes of index space, as columns.
    fn steps(&self, cell: &Cell) -> DMat3 {
        let Places::Points { points, axes, .. } = self.places else { return DMat3::IDENTITY };
        let mut columns = [DVec3::ZERO; 3];
        for (axis, column) in columns.iter_mut().enumerate() {
            let along = |share: f64| {
                let mut cell = Cell { low: cell.low, share: cell.share };
                cell.share[axis] = share;
                self.weights(&cell).map(|(i, weight)| points[i] * weight).sum::<DVec3>()
            };
            *column = match self.dims[axis] {
                1 => self.weights(cell).map(|(i, weight)| axes[i].col(axis) * weight).sum(),
                _ => along(1.0) - along(0.0),
            };
        }
        DMat3::from_cols(columns[0], columns[1], columns[2])
    }

    /// A world vector at a place as steps of index space; not finite where the grid has no extent.
    pub(super) fn index_vector(&self, cell: &Cell, vector: DVec3) -> DVec3 {
        match self.places {
            Places::Lattice(_) => self.index_from_world * vector,
            Places::Points { .. } => self.steps(cell).inverse() * vector,
        }
    }

    /// The nearest place of index space that is not beyond the border.
    fn within(&self, at: DVec3) -> DVec3 {
        let last = DVec3::from(self.dims.map(|n| n as f64 - 1.0));
        let thick = DVec3::from(self.dims.map(|n| if n == 1 { 0.5 } else { 0.0 }));
        at.clamp(-thick, last + thick)
    }

    /// The place of index space at a world position; of grids with points of their own `None` beyond the
    /// border.
    pub(super) fn index_of(&self, world: DVec3) -> Option<DVec3> {
        let points = match self.places {
            Places::Lattice(lattice) => return Some(lattice.index_from_world(world)),
            Places::Points { points, .. } => points,
        };
        let distances = points.iter().map(|point| (*point - world).length_squared());
        let (nearest, _) = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let [nx, ny, _] = self.dims;
        let voxel = [nearest % nx, nearest / nx % ny, nearest / (nx * ny)];
        let mut at = DVec3::from(voxel.map(|i| i as f64));
        for _ in 0..MOST_STEPS {
            let cell = self.cell(at)?;
            let step = self.index_vector(&cell, world - self.world(at));
            if !step.is_finite() {
                return None;
            }
            if step.length() < NEAR {
                return Some(at);
            }
            // No farther than the next cell, whose steps are others.
            at = self.within(at + step.clamp_length_max(1.0));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Lattice;

    fn ring() -> Places {
        let dims = [5, 20, 3];
        let at = |x: f64, y: f64, z: f64| {
            let angle = 0.2 * y;
            DVec3::new((2.0 + x) * angle.cos(), (2.0 + x) * angle.sin(), 0.7 * z + 0.1 * x)
        };
        let points: Vec<DVec3> = (0..300)
            .map(|i| [i % 5, i / 5 % 20, i / 100].map(|v| v as f64))
            .map(|[x, y, z]| at(x, y, z))
            .collect();
        let axes = vec![DMat3::IDENTITY; 300];
        Places::Points { dims, points: points.into(), axes: axes.into() }
    }

    #[test]
    fn places_of_a_ring_are_found_again_and_none_beyond_it() {
        let places = ring();
        let map = GridMap::new(&places);
        for i in 0..200 {
            let part = |p: f64| (f64::from(i) * p).fract();
            let at = DVec3::new(4.0 * part(0.618), 19.0 * part(0.414), 2.0 * part(0.732));
            let found = map.index_of(map.world(at)).expect("it is inside");
            assert!((found - at).length() < 1e-5, "{at} {found}");
        }
        assert_eq!(map.index_of(DVec3::ZERO), None, "the hole in the middle");
        assert_eq!(map.index_of(DVec3::splat(1e3)), None);
        assert_eq!(map.index_of(DVec3::NAN), None);
    }

    #[test]
    fn a_single_layer_is_as_thick_as_a_step() {
        let lattice = Lattice::unit([4, 3, 1]);
        let even = Places::Lattice(lattice);
        let points = (0..12).map(|i| even.at(i).0).collect();
        let axes = vec![DMat3::from_diagonal(DVec3::new(1.0, 1.0, 2.0)); 12].into();
        let places = Places::Points { dims: [4, 3, 1], points, axes };
        let map = GridMap::new(&places);
        let found = map.index_of(DVec3::new(1.25, 0.5, 0.6)).expect("within the layer");
        assert!((found - DVec3::new(1.25, 0.5, 0.3)).length() < 1e-6, "{found}");
        assert_eq!(map.index_of(DVec3::new(1.0, 1.0, 1.2)), None);
    }
}

//! How thick what lies on cells is.

use super::ScalarVolume;
use crate::cells::On;
use crate::core::parallel;

/// Solids whose volume is looked at, about.
const MOST: usize = 20_000;
/// Of the faces of cubes that stand for a surface in any direction, the part that it has: 1 along an axis, 2/3 on average.
const OF_FACES: f64 = 0.75;

impl ScalarVolume {
    /// Whether it is on cells that have one number each.
    pub fn has_values_of_cells(&self) -> bool {
        self.cells.as_ref().is_some_and(|cells| cells.on() == On::Cells)
    }

    /// How thick its cells are from one side to the other, in their median edges: 2 V / S of their volume and their surface, which
    /// is exact of plates. The surface is that of the samples within them. `None` of volumes that are on no cells.
    pub fn depth_in_cells(&self) -> Option<f64> {
        let (cells, lattice) = (self.cells.as_ref()?, &self.lattice);
        let solids = cells.cells().solids().len();
        let every = solids.div_ceil(MOST).max(1);
        let looked_at = (0..solids).step_by(every).filter(|solid| cells.is_there(*solid));
        let volume: f64 = looked_at.map(|solid| cells.cells().placed(solid).volume().abs()).sum();
        let [nx, ny, _] = lattice.dims;
        let steps = [1, nx, nx * ny];
        let is_in = |at: usize| self.samples.get(at).is_finite();
        let open_faces = |at: usize| -> usize {
            let place = [at % nx, at / nx % ny, at / (nx * ny)];
            let open = (0..3).map(|axis| {
                let is_open_below = place[axis] == 0 || !is_in(at - steps[axis]);
                let is_last = place[axis] + 1 == lattice.dims[axis];
                usize::from(is_open_below) + usize::from(is_last || !is_in(at + steps[axis]))
            });
            open.sum()
        };
        let open_faces = |at: usize| if is_in(at) { open_faces(at) } else { 0 };
        let faces = parallel::merged(lattice.len(), || 0, open_faces, |a, b| a + b);
        let surface = OF_FACES * faces as f64 * lattice.spacing.x * lattice.spacing.y;
        Some(2.0 * volume * every as f64 / surface / cells.cells().median_edge())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use crate::cells::{Cells, Listing};
    use crate::core::Ticket;
    use crate::volume::{Association, Component, Field, Grid, Samples, Shape};

    /// A box of so many cubes along x, y and z, each of unit edges, but so thick along z.
    fn depth(cubes: [usize; 3], thick: f64) -> f64 {
        let [nx, ny, nz] = cubes.map(|n| n + 1);
        let at = |i: usize| {
            DVec3::new((i % nx) as f64, (i / nx % ny) as f64, thick * (i / (nx * ny)) as f64)
        };
        let points: Arc<[DVec3]> = (0..nx * ny * nz).map(at).collect();
        let cells = Cells::of_grid(&points, [nx, ny, nz]);
        let listing = Listing {
            points: points.to_vec(),
            types: vec![12; cells.solids().len()],
            starts: (0..=cells.solids().len()).map(|i| 8 * i).collect(),
            corners: cells.solids().iter().flat_map(|solid| solid.corners().to_vec()).collect(),
            ..Listing::default()
        };
        let shape = Shape::Unstructured(Arc::new(Cells::new(listing).unwrap()));
        let values = (0..nx * ny * nz).map(|i| i as f32).collect();
        let field = Field {
            name: "f".into(),
            components: 1,
            association: Association::Point,
            samples: Arc::new(Samples::Float32(values)),
        };
        let grid = Grid::shaped([nx * ny * nz, 1, 1], shape, vec![field]).unwrap();
        let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).unwrap();
        volume.depth_in_cells().unwrap()
    }

    #[test]
    fn plates_are_as_thick_as_they_are_and_cubes_a_third_of_their_side() {
        // Its faces are along the axes: 4/3 of what they would be on average.
        let plate = depth([20, 20, 2], 0.1);
        assert!((0.15..0.35).contains(&plate), "{plate}");
        let thick = depth([20, 20, 2], 0.3);
        assert!((2.0..4.0).contains(&(thick / plate)), "{plate} {thick}");
        let cube = depth([10, 10, 10], 1.0);
        assert!((10.0 / 3.0..10.0 / 3.0 * 1.5).contains(&cube), "{cube}");
    }
}

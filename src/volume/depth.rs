//! How thick what lies on cells is.

use super::ScalarVolume;
use crate::cells::On;
use crate::core::{Ticket, parallel};

/// Solids whose volume is looked at, about.
const MOST: usize = 20_000;
/// Solids whose outer faces are found for it: of more the first picture would wait for them.
const MOST_WITH_FACES: usize = 200_000;
/// Of the faces of cubes that stand for a surface in any direction, the part that it has: 1 along an axis, 2/3 on average.
const OF_FACES: f64 = 0.75;

impl ScalarVolume {
    /// Whether it is on cells that have one number each.
    pub fn has_values_of_cells(&self) -> bool {
        self.cells.as_ref().is_some_and(|cells| cells.on() == On::Cells)
    }

    /// How thick its cells are from one side to the other, in their median edges: 2 V / S of their volume and their surface, which
    /// is exact of plates. The surface of many cells is that of the samples within them. `None` of volumes that are on no cells.
    pub fn depth_in_cells(&self) -> Option<f64> {
        let cells = self.cells.as_ref()?;
        let solids = cells.cells().solids().len();
        let every = solids.div_ceil(MOST).max(1);
        let looked_at = (0..solids).step_by(every).filter(|solid| cells.is_there(*solid));
        let volume: f64 = looked_at.map(|solid| cells.cells().placed(solid).volume().abs()).sum();
        let surface = if solids <= MOST_WITH_FACES {
            // Nobody cancels a fresh ticket.
            let faces = &cells.surface(&Ticket::new()).ok()?.faces;
            faces.iter().map(|face| cells.cells().area(face).length()).sum()
        } else {
            self.surface_of_samples()
        };
        Some(2.0 * volume * every as f64 / surface / cells.cells().median_edge())
    }

    /// The surface of the samples that have numbers, square world units; their lattice is of cubes.
    fn surface_of_samples(&self) -> f64 {
        let lattice = &self.lattice;
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
        OF_FACES * faces as f64 * lattice.spacing.x * lattice.spacing.y
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use crate::cells::{Cells, Listing};
    use crate::core::Ticket;
    use crate::volume::{Association, Component, Field, Grid, Samples, ScalarVolume, Shape};

    /// A box of so many cubes along x, y and z, each of unit edges, but so thick along z.
    fn plate(cubes: [usize; 3], thick: f64) -> ScalarVolume {
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
        grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).unwrap()
    }

    #[test]
    fn plates_are_as_thick_as_they_are_and_cubes_a_third_of_their_side() {
        // Twice the volume by the surface, in edges of 1; the last is thinner than samples lie apart.
        for (cubes, thick) in [([20, 20, 2], 0.1), ([10, 10, 10], 1.0), ([20, 20, 1], 1e-4)] {
            let [x, y, z] = cubes.map(|n| n as f64);
            let z = z * thick;
            let expected = 2.0 * x * y * z / (2.0 * (x * y + x * z + y * z));
            let found = plate(cubes, thick).depth_in_cells().unwrap();
            assert!((found - expected).abs() < 1e-9 * expected, "{cubes:?}: {found}");
        }
    }

    #[test]
    fn the_surface_of_samples_is_about_that_of_what_they_lie_in() {
        // Faces along the axes are 4/3 of what those of all directions would be on average: up to 3/4 is taken of them.
        for (cubes, thick, surface) in
            [([20, 20, 2], 0.3, 848.0), ([10, 10, 10], 1.0, 600.0), ([30, 4, 4], 1.0, 512.0)]
        {
            let found = plate(cubes, thick).surface_of_samples() / surface;
            assert!((0.6..1.0).contains(&found), "{cubes:?}: {found}");
        }
    }
}

//! Vectors on cells that lie anywhere, between their points.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::cells::{CellField, Cells, Finder, On};
use crate::core::progress::{Cancelled, Ticket};

/// Vectors on the points of cells, or one a cell.
#[derive(Debug, Clone)]
pub struct VectorsOnCells {
    parts: [CellField; 3],
    /// Made when somebody first asks for a place.
    finder: OnceLock<Arc<Finder>>,
}

impl VectorsOnCells {
    /// Of three numbers for each of the file's points or cells.
    pub fn new(cells: &Arc<Cells>, on: On, parts: [Vec<f64>; 3]) -> Self {
        let parts = parts.map(|part| CellField::new(Arc::clone(cells), on, part));
        Self { parts, finder: OnceLock::new() }
    }

    /// Prepares for places to be asked for: some tenths of a second for a million cells.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn prepare(&self, ticket: &Ticket) -> Result<(), Cancelled> {
        if self.finder.get().is_none() {
            let is_there = |solid: usize| self.parts.iter().all(|part| part.is_there(solid));
            let finder = Finder::new(self.parts[0].cells(), is_there, ticket)?;
            self.finder.get_or_init(|| Arc::new(finder));
        }
        Ok(())
    }

    /// The vector at a place of the world, by the shape functions of the cell that holds it, and which of the file's cells that
    /// is. `None` outside all cells, and in those where a vector is missing.
    pub fn at(&self, place: DVec3) -> Option<(DVec3, u32)> {
        // Nobody cancels this ticket.
        self.prepare(&Ticket::new()).ok()?;
        let (solid, unit) = self.finder.get()?.find(place)?;
        let vector = DVec3::from(self.parts.each_ref().map(|part| part.value(solid, unit)));
        Some((vector, self.parts[0].cells().sources()[solid]))
    }
}

/// A cube of wedges about [−9, 9]³ whose points lie askew, with (−y, x, 0) on them, which is linear in space and so in any of them.
#[cfg(test)]
pub(crate) fn rotation_on_wedges() -> VectorsOnCells {
    use crate::cells::Listing;
    let n = 6;
    let at = |i: usize| {
        let [x, y, z] = [i % n, i / n % n, i / (n * n)].map(|v| 4.0 * v as f64 - 10.0);
        let sway = |s: f64| (s * (x + 2.0 * y + 3.0 * z)).sin();
        DVec3::new(x + sway(0.7), y + sway(1.3), z + sway(1.9))
    };
    let points: Vec<DVec3> = (0..n * n * n).map(at).collect();
    let is_cube = |i: &usize| i % n < n - 1 && i / n % n < n - 1 && i / (n * n) < n - 1;
    let wedge = |i: usize, ring: [usize; 3]| -> Vec<u32> {
        [0, n * n].iter().flat_map(|up| ring.map(|r| (i + r + up) as u32)).collect()
    };
    let corners: Vec<u32> = (0..n * n * n)
        .filter(is_cube)
        .flat_map(|i| [wedge(i, [0, 1, n + 1]), wedge(i, [0, n + 1, n])].concat())
        .collect();
    let count = corners.len() / 6;
    let starts = (0..=count).map(|i| 6 * i).collect();
    let vectors =
        [0, 1, 2].map(|c| points.iter().map(|p| [-p.y, p.x, 0.0][c]).collect::<Vec<f64>>());
    let listing = Listing { points, types: vec![13; count], starts, corners, ..Listing::default() };
    VectorsOnCells::new(&Arc::new(Cells::new(listing).unwrap()), On::Points, vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_lie_in_the_cell_that_holds_a_place_and_nowhere_else() {
        let vectors = rotation_on_wedges();
        let mut cells = std::collections::BTreeSet::new();
        for i in 0..200 {
            let part = |p: f64| 16.0 * (f64::from(i) * p).fract() - 8.0;
            let place = DVec3::new(part(0.618), part(0.414), part(0.732));
            let (vector, cell) = vectors.at(place).expect("inside");
            assert!(
                (vector - DVec3::new(-place.y, place.x, 0.0)).length() < 1e-6,
                "{place} {vector}"
            );
            // Which the first cell that holds it is, by a look at each.
            let own = &vectors.parts[0];
            let holds = |solid: &usize| own.cells().placed(*solid).unit_from(place).is_some();
            let first = (0..own.cells().solids().len()).find(holds);
            assert_eq!(first.map(|solid| own.cells().sources()[solid]), Some(cell));
            cells.insert(cell);
        }
        assert!(cells.len() > 50, "{}", cells.len());
        assert_eq!(vectors.at(DVec3::splat(11.9)), None);
        assert_eq!(vectors.at(DVec3::NAN), None);
    }
}

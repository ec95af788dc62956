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

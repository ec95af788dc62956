//! The solid that a place of the world lies in.

use std::sync::Arc;

use glam::DVec3;

use super::{Cells, Listed};
use crate::core::progress::{Cancelled, Ticket};

/// Steps along the longest side of the box about all cells, which lists are made in.
const STEPS: f64 = 256.0;

/// Finds the solid about places of the world, by lists of those near each.
#[derive(Debug, Clone)]
pub struct Finder {
    cells: Arc<Cells>,
    listed: Listed,
    low: DVec3,
    step: f64,
}

impl Finder {
    /// Among the solids of cells that are `there`.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn new(
        cells: &Arc<Cells>,
        is_there: impl Fn(usize) -> bool,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let [low, high] = cells.bounds();
        let size = high - low;
        let longest = size.max_element();
        let step = if longest > 0.0 { longest / STEPS } else { 1.0 };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "257 at most")]
        let dims = (size / step).to_array().map(|n| n.ceil() as usize + 1);
        let index = |place: DVec3| (place - low) / step;
        let listed = Listed::new(cells, (dims, index), is_there, ticket)?;
        Ok(Self { cells: Arc::clone(cells), listed, low, step })
    }

    /// The solid that holds a place, and where in it; the first of several. `None` outside all of them.
    pub fn find(&self, place: DVec3) -> Option<(usize, DVec3)> {
        let near = self.listed.near((place - self.low) / self.step);
        near.iter().find_map(|solid| {
            let solid = *solid as usize;
            Some((solid, self.cells.placed(solid).unit_from(place)?))
        })
    }
}

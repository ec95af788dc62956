//! The solid that a place of the world lies in.

use std::sync::Arc;

use glam::DVec3;

use super::{Cells, Kind, Listed};
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};

/// Steps along the longest side of the box about all cells, which lists are made in.
const STEPS: f64 = 256.0;
/// Solids looked at between two looks at the ticket.
const A_PART: usize = 1 << 12;
/// Nearer to its border, in units of a solid, a place is not said to be inside it: rounding may have taken it there.
const BORDER: f64 = 1e-3;

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

    /// Whether a place is inside a solid, and not at its border: sooner told than which.
    pub(super) fn holds(&self, place: DVec3) -> bool {
        let near = self.listed.near((place - self.low) / self.step);
        near.iter().any(|solid| self.is_inside(*solid as usize, place))
    }

    /// How many of the file's cells overlap others deeply: the middle of one of their solids lies inside another cell. Takes
    /// about as long as the lists.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn overlapping(&self, ticket: &Ticket) -> Result<usize, Cancelled> {
        let count = self.cells.solids().len();
        let of_part = |part: usize| -> Result<Vec<u32>, Cancelled> {
            if ticket.is_cancelled() {
                return Err(Cancelled);
            }
            let solids = parallel::part(count, A_PART, part);
            let found = solids.filter(|solid| self.is_inside_another(*solid));
            Ok(found.map(|solid| self.cells.sources()[solid]).collect())
        };
        let found: Vec<Vec<u32>> = parallel::try_list(count.div_ceil(A_PART), of_part)?;
        // The solids of a cell follow one another.
        let mut found = found.concat();
        found.dedup();
        Ok(found.len())
    }

    /// Whether the middle of a solid lies inside a solid of another cell.
    fn is_inside_another(&self, solid: usize) -> bool {
        let sources = self.cells.sources();
        let placed = self.cells.placed(solid);
        let middle = placed.at(placed.kind().middle()).0;
        let near = self.listed.near((middle - self.low) / self.step);
        let holds = |other: &u32| {
            let other = *other as usize;
            sources[other] != sources[solid] && self.is_inside(other, middle)
        };
        near.iter().any(holds) && !placed.is_flat()
    }

    /// Whether a place is inside a solid with volume, and not at its border.
    fn is_inside(&self, solid: usize, place: DVec3) -> bool {
        let (own, points) = (&self.cells.solids()[solid], self.cells.points());
        // Most of those near are beside it, which their boxes say soonest.
        let corners = || own.corners().iter().map(|corner| points[*corner as usize]);
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        if place.cmplt(low).any() || place.cmpgt(high).any() {
            return false;
        }
        let placed = own.placed(points);
        let unit = match placed.kind() {
            Kind::Tetrahedron => placed.unit_by(&placed.rows(), place),
            _ => placed.unit_from(place),
        };
        unit.is_some_and(|unit| placed.kind().beyond(unit) < -BORDER) && !placed.is_flat()
    }
}

//! Samples that form no lattice: scattered points, and the points or middles of cells.

use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

use crate::cells::CellField;
use crate::core::progress::{Cancelled, Ticket};
use crate::rbf::Encoding;

/// Samples at places anywhere, and the ellipsoids about them as which they are drawn.
#[derive(Debug)]
pub struct Scattered {
    count: usize,
    source: Source,
}

#[derive(Debug)]
enum Source {
    /// The ellipsoids, how far apart they lie, and least and greatest value.
    Points { ellipsoids: Arc<Encoding>, spacing: f64, range: [f64; 2] },
    /// The cells, and the ellipsoids once someone has asked for these.
    Cells { field: Arc<CellField>, ellipsoids: Mutex<Option<Arc<Encoding>>> },
}

impl Scattered {
    /// Bytes that a sample takes while ellipsoids are made.
    pub(super) const BYTES: u64 = 400;

    /// Of world positions with a value each. What is not finite is left out; `None` where nothing is left.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn new(mut samples: Vec<(DVec3, f64)>, ticket: &Ticket) -> Result<Option<Self>, Cancelled> {
        samples.retain(|(at, value)| at.is_finite() && value.is_finite());
        let count = samples.len();
        if count == 0 {
            return Ok(None);
        }
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let range = samples.iter().fold(none, |[a, b], (_, v)| [a.min(*v), b.max(*v)]);
        let ellipsoids = Arc::new(Encoding::about_samples(samples, ticket)?);
        let spacing = ellipsoids.sample_spacing();
        Ok(Some(Self { count, source: Source::Points { ellipsoids, spacing, range } }))
    }

    /// Of the points, or middles, of cells; `None` where no cell is there.
    pub(super) fn of_cells(field: &Arc<CellField>) -> Option<Self> {
        let count = field.sample_count();
        let source = Source::Cells { field: Arc::clone(field), ellipsoids: Mutex::default() };
        (count > 0).then_some(Self { count, source })
    }

    /// How many there are, those that lie at one place counted each.
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

    /// Least and greatest value; `None` where there is none.
    pub(super) fn range(&self) -> Option<[f64; 2]> {
        match &self.source {
            Source::Points { range, .. } => Some(*range),
            Source::Cells { field, .. } => field.range(),
        }
    }

    /// The ellipsoids, as [`Encoding::about_samples`] has them; those about points of cells are made at the first call.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn ellipsoids(&self, ticket: &Ticket) -> Result<Arc<Encoding>, Cancelled> {
        let (field, made) = match &self.source {
            Source::Points { ellipsoids, .. } => return Ok(Arc::clone(ellipsoids)),
            Source::Cells { field, ellipsoids } => (field, ellipsoids),
        };
        // Whoever died holding it left what was there.
        let mut made = made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = &*made {
            return Ok(Arc::clone(known));
        }
        let found = Arc::new(Encoding::about_samples(field.samples(), ticket)?);
        *made = Some(Arc::clone(&found));
        Ok(found)
    }
}

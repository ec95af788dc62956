//! Samples that form no lattice: scattered points, and the points or middles of cells.

use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

use crate::cells::CellField;
use crate::core::progress::{Cancelled, Ticket};
use crate::rbf::{Encoding, next_distance};

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

    /// Of world positions with a value each. What is not finite is left out; `None` where nothing is left.
    pub fn new(mut samples: Vec<(DVec3, f64)>) -> Option<Self> {
        samples.retain(|(at, value)| at.is_finite() && value.is_finite());
        let count = samples.len();
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

    /// Whether they are points alone, rather than those of cells.
    pub fn are_points(&self) -> bool {
        matches!(self.source, Source::Points { .. })
    }

    /// Whether they are points so many that evenly spaced samples are of the points themselves, most of them of none: those of the
    /// ellipsoids would take seconds.
    pub fn are_many_points(&self) -> bool {
        self.are_points() && self.count > Self::MOST_SAMPLED
    }

    /// The ellipsoids, as [`Encoding::about_samples`] has them, made at the first call; about points none is much wider than
    /// others.
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
                Encoding::about_samples(samples.iter().copied(), ticket)?.without_wide()
            }
            Source::Cells(field) => Encoding::about_samples(field.samples(), ticket)?,
        });
        *made = Some(Arc::clone(&found));
        Ok(found)
    }
}

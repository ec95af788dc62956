//! Samples that form no lattice: scattered points, and the points or middles of cells.

use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

use crate::cells::CellField;
use crate::core::progress::{Cancelled, Ticket};
use crate::rbf::Encoding;

/// Samples at places anywhere, and the ellipsoids about them as which they are drawn, once someone has asked for these.
#[derive(Debug)]
pub struct Scattered {
    samples: Source,
    count: usize,
    /// And how far apart they lie.
    ellipsoids: Mutex<Option<(Arc<Encoding>, f64)>>,
}

#[derive(Debug)]
enum Source {
    /// World positions and values.
    Points(Vec<(DVec3, f64)>),
    Cells(Arc<CellField>),
}

impl Scattered {
    /// Bytes that a sample takes once its ellipsoid is there.
    pub(super) const BYTES: u64 = 400;

    /// Of world positions with a value each, where one of them at least is finite; others are left out.
    pub fn new(mut samples: Vec<(DVec3, f64)>) -> Option<Self> {
        samples.retain(|(at, value)| at.is_finite() && value.is_finite());
        let count = samples.len();
        let ellipsoids = Mutex::default();
        (count > 0).then(|| Self { samples: Source::Points(samples), count, ellipsoids })
    }

    /// Of the points, or middles, of cells; `None` where no cell is there.
    pub(super) fn of_cells(field: &Arc<CellField>) -> Option<Self> {
        let count = field.sample_count();
        let samples = Source::Cells(Arc::clone(field));
        (count > 0).then(|| Self { samples, count, ellipsoids: Mutex::default() })
    }

    /// How many there are, those that lie at one place counted each.
    pub fn count(&self) -> usize {
        self.count
    }

    /// How far apart they lie, world: the median of the geometric means of ellipsoids' widths, as a cubic lattice would have
    /// them. `None` as long as nobody has asked for these.
    pub fn spacing(&self) -> Option<f64> {
        let made = self.ellipsoids.lock().unwrap_or_else(PoisonError::into_inner);
        made.as_ref().map(|(_, spacing)| *spacing)
    }

    /// Least and greatest value.
    pub(super) fn range(&self) -> [f64; 2] {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let wider = |[a, b]: [f64; 2], value: f64| [a.min(value), b.max(value)];
        match &self.samples {
            Source::Points(samples) => samples.iter().map(|(_, value)| *value).fold(none, wider),
            Source::Cells(field) => field.range().unwrap_or(none),
        }
    }

    /// The ellipsoids, as [`Encoding::about_samples`] has them. Made at the first call.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn ellipsoids(&self, ticket: &Ticket) -> Result<Arc<Encoding>, Cancelled> {
        // Whoever died holding it left what was there.
        let mut made = self.ellipsoids.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, _)) = &*made {
            return Ok(Arc::clone(known));
        }
        let found = Arc::new(match &self.samples {
            Source::Points(samples) => Encoding::about_samples(samples.iter().copied(), ticket)?,
            Source::Cells(field) => Encoding::about_samples(field.samples(), ticket)?,
        });
        *made = Some((Arc::clone(&found), found.sample_spacing()));
        Ok(found)
    }
}

//! A vector field in a scene.

use std::sync::Arc;

use crate::vector::{ColourBy, VectorSettings};
use crate::volume::{ScalarVolume, VectorField};

/// A vector field that is drawn beside the scalar field, or alone.
#[derive(Debug, Clone)]
pub struct VectorLayer {
    /// The vectors.
    pub field: Arc<VectorField>,
    /// What they look like.
    pub settings: VectorSettings,
    /// How far the marks have moved, in cycles: 0 and 1 are the same.
    pub phase: f64,
    /// Without the scalar field.
    pub alone: bool,
}

impl VectorLayer {
    /// A field as it is first seen.
    pub fn new(field: Arc<VectorField>, alone: bool) -> Self {
        let settings = VectorSettings::for_field(&field);
        Self { field, settings, phase: 0.0, alone }
    }

    /// Least and greatest of what colours or opacities may be looked up by; `scalar` is the field beside
    /// it.
    pub fn range_of(&self, by: ColourBy, scalar: &ScalarVolume) -> [f64; 2] {
        let along = |axis: usize| {
            let count = self.field.vectors.len();
            let places = (0..count).map(|i| self.field.places.at(i).0[axis]);
            places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
                [low.min(v), high.max(v)]
            })
        };
        match by {
            ColourBy::Magnitude => [self.field.statistics.min, self.field.statistics.max],
            ColourBy::X => along(0),
            ColourBy::Y => along(1),
            ColourBy::Z => along(2),
            ColourBy::Scalar => [scalar.statistics.min, scalar.statistics.max],
        }
    }

    /// Whether two layers make the same picture but for the phase.
    pub fn differs_by_phase_alone(&self, other: &Self) -> bool {
        let Self { field, settings, phase: _, alone } = self;
        Arc::ptr_eq(field, &other.field) && *settings == other.settings && *alone == other.alone
    }
}

impl PartialEq for VectorLayer {
    /// The same field, not an equal one.
    fn eq(&self, other: &Self) -> bool {
        self.differs_by_phase_alone(other) && self.phase == other.phase
    }
}

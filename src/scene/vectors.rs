//! Vector fields in a scene: one, or two of them among each other.

use std::sync::Arc;

use glam::DVec3;

use crate::transfer::{ColourMap, ColourSource};
use crate::vector::{ColourBy, VectorSettings};
use crate::volume::{Places, ScalarVolume, VectorField};

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
    /// Another field among the first: what a slab has of both is composited together.
    pub second: Option<SecondVectors>,
}

/// A second vector field; the phase, and whether the scalar field is drawn, are those of the first.
#[derive(Debug, Clone)]
pub struct SecondVectors {
    /// The vectors.
    pub field: Arc<VectorField>,
    /// What they look like.
    pub settings: VectorSettings,
}

impl SecondVectors {
    /// A field as it is first seen beside another: in colours of its own, and out of step with it.
    pub fn new(field: Arc<VectorField>) -> Self {
        let mut settings = VectorSettings { seed: 1, ..VectorSettings::for_field(&field) };
        if let ColourSource::Map { map, .. } = &mut settings.transfer.colour {
            *map = ColourMap::Inferno;
        }
        Self { field, settings }
    }
}

impl PartialEq for SecondVectors {
    /// The same field, not an equal one.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.field, &other.field) && self.settings == other.settings
    }
}

impl VectorLayer {
    /// A field as it is first seen.
    pub fn new(field: Arc<VectorField>, alone: bool) -> Self {
        let settings = VectorSettings::for_field(&field);
        Self { field, settings, phase: 0.0, alone, second: None }
    }

    /// The fields and how each looks, the first one first.
    pub fn looks(&self) -> impl Iterator<Item = (&Arc<VectorField>, &VectorSettings)> {
        let second = self.second.iter().map(|second| (&second.field, &second.settings));
        std::iter::once((&self.field, &self.settings)).chain(second)
    }

    /// Whether two layers make the same picture but for the phase.
    pub fn differs_by_phase_alone(&self, other: &Self) -> bool {
        let Self { field, settings, phase: _, alone, second } = self;
        Arc::ptr_eq(field, &other.field)
            && *settings == other.settings
            && *alone == other.alone
            && *second == other.second
    }
}

impl PartialEq for VectorLayer {
    /// The same field, not an equal one.
    fn eq(&self, other: &Self) -> bool {
        self.differs_by_phase_alone(other) && self.phase == other.phase
    }
}

/// Least and greatest of what colours or opacities of vectors may be looked up by; `scalar` is the field
/// beside them.
pub fn vector_range(field: &VectorField, by: ColourBy, scalar: &ScalarVolume) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let wider = |[low, high]: [f64; 2], v: f64| [low.min(v), high.max(v)];
    let along = |axis: usize| match &field.places {
        // The corners are farthest.
        Places::Lattice(lattice) => (0..8).fold(none, |range, corner| {
            let last = lattice.dims.map(|n| n as f64 - 1.0);
            let at = std::array::from_fn(|a| if corner >> a & 1 == 1 { last[a] } else { 0.0 });
            wider(range, lattice.world_from_index(DVec3::from_array(at))[axis])
        }),
        Places::Points { points, .. } => {
            points.iter().fold(none, |range, point| wider(range, point[axis]))
        }
    };
    match by {
        ColourBy::Magnitude => [field.statistics.min, field.statistics.max],
        ColourBy::X => along(0),
        ColourBy::Y => along(1),
        ColourBy::Z => along(2),
        ColourBy::Scalar => [scalar.statistics.min, scalar.statistics.max],
    }
}

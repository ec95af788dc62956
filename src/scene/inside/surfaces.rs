//! Surfaces inside a volume: slices, and where values pass a level.

use serde::{Deserialize, Serialize};

use super::{InsideError, Plane};
use crate::core::Srgb8;
use crate::transfer::TransferFunction;

/// Slices in a scene at most.
pub const MOST_SLICES: usize = 6;
/// Isosurfaces in a scene at most.
pub const MOST_ISOSURFACES: usize = 6;

/// Values on a plane, in their colours and not lit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slice {
    /// Which; of the side that its normal points to nothing depends.
    pub plane: Plane,
    /// 0..=1, whatever the values.
    pub opacity: f64,
}

/// Where values pass a level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Isosurface {
    /// The level, data units.
    pub value: f64,
    /// 0..=1.
    pub opacity: f64,
    /// Its colour; `None` is the transfer function's of the level.
    pub colour: Option<Srgb8>,
}

impl Isosurface {
    /// Its colour in linear light.
    #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
    pub fn linear_colour(&self, transfer: &TransferFunction) -> [f32; 3] {
        let colour = self.colour.map_or_else(|| transfer.colour_at(self.value), Srgb8::to_linear);
        colour.0.map(|c| c as f32)
    }

    pub(super) fn check(&self) -> Result<(), InsideError> {
        if !self.value.is_finite() {
            return Err(InsideError::Level { found: self.value });
        }
        check_opacity("an isosurface", self.opacity)
    }
}

impl Slice {
    pub(super) fn check(&self) -> Result<(), InsideError> {
        self.plane.check()?;
        check_opacity("a slice", self.opacity)
    }
}

fn check_opacity(of: &'static str, found: f64) -> Result<(), InsideError> {
    if (0.0..=1.0).contains(&found) { Ok(()) } else { Err(InsideError::Opacity { of, found }) }
}

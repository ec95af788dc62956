//! Samples that count more than others.

use std::fmt;

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::encoding::few_digits;
use crate::core::plain_number;

/// How far beyond its faces a region reaches, as a share of its sides: samples on a face lie in it, whatever rounding says.
const ON_FACE: f64 = 1e-7;
/// How many times as much a sample may count: squares of what is left there stay finite.
const MOST_TIMES: f64 = 1e9;

/// A box along any three axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// One of its corners, world.
    pub corner: DVec3,
    /// Its three sides from there, world, as columns.
    pub sides: DMat3,
}

impl Region {
    /// Whether a place lies in it, or on its faces.
    pub fn has(&self, at: DVec3) -> bool {
        let share = self.sides.inverse() * (at - self.corner);
        share.cmpge(DVec3::splat(-ON_FACE)).all() && share.cmple(DVec3::splat(1.0 + ON_FACE)).all()
    }

    fn has_volume(&self) -> bool {
        let volume = self.sides.determinant();
        self.corner.is_finite() && volume.is_finite() && volume != 0.0
    }
}

/// Which samples count more than the others, and how much more: those within the range of values and within the region, of
/// which either may be everything.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Favour {
    /// How many times as much they count: as if each were there so often.
    pub times: f64,
    /// Their least and greatest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// Where they lie.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<Region>,
}

/// Why samples cannot be favoured so.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FavourError {
    /// They would count for less than others, or without end.
    #[error("expected samples to count 1 to {} times as much, found {}; give such a number", MOST_TIMES, plain_number(*.0))]
    Times(f64),
    /// The range has no values.
    #[error("expected a range of values from the least to the greatest, found {} to {}; exchange them", plain_number(.0[0]), plain_number(.0[1]))]
    Range([f64; 2]),
    /// The box holds nothing.
    #[error("expected a box with a volume, found one without; give it another end along each axis")]
    Flat,
}

/// `values 3 to 5 in the box from (0, 0, 0) to (1, 2, 3) counted 10 times`.
impl fmt::Display for Favour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some([low, high]) = self.range {
            write!(f, "values {} to {} ", few_digits(low), few_digits(high))?;
        }
        if let Some(Region { corner, sides }) = self.region {
            let ends = [corner, corner + sides.x_axis + sides.y_axis + sides.z_axis];
            let [from, to] = ends.map(|at| at.to_array().map(few_digits).join(", "));
            write!(f, "in the box from ({from}) to ({to}) ")?;
        }
        write!(f, "counted {} times", few_digits(self.times))
    }
}

impl Favour {
    /// How many times as much samples count where nobody says.
    pub const TIMES: f64 = 10.0;

    /// Whether it means anything.
    ///
    /// # Errors
    /// See [`FavourError`].
    pub fn check(&self) -> Result<(), FavourError> {
        if !(1.0..=MOST_TIMES).contains(&self.times) {
            return Err(FavourError::Times(self.times));
        }
        if let Some([low, high]) = self.range
            && !(low <= high && low.is_finite() && high.is_finite())
        {
            return Err(FavourError::Range([low, high]));
        }
        match self.region.is_none_or(|region| region.has_volume()) {
            true => Ok(()),
            false => Err(FavourError::Flat),
        }
    }

    /// Whether a sample is one of those.
    pub fn has(&self, at: DVec3, value: f64) -> bool {
        let is_of_range = self.range.is_none_or(|[low, high]| low <= value && value <= high);
        is_of_range && self.region.is_none_or(|region| region.has(at))
    }

    /// How much a sample counts.
    pub fn weight(&self, at: DVec3, value: f64) -> f64 {
        if self.has(at, value) { self.times } else { 1.0 }
    }
}

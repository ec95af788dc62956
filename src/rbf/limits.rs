//! What of a sum of functions is left out as it is drawn.

use std::ops::RangeInclusive;

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::encoding::Encoding;
use super::listed::Listed;
use crate::core::progress::{Cancelled, Ticket};

/// What of an encoding is left out as it is drawn: by default nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Limits {
    /// Functions that each cell keeps at most, those that are greatest in it (Jang, section 5); `None`: all that reach it.
    pub per_cell: Option<u32>,
    /// Whether what a cell leaves out, which is known at its corners, is added between them.
    pub corrects: bool,
    /// The least functions are left out everywhere, as long as the sum is thought to be off by no more, rms over the box of
    /// the encoding, in the units of values (see [`Encoding::without_least`]).
    pub max_rms: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self::NONE
    }
}

impl Limits {
    /// All functions.
    pub const NONE: Self = Self { per_cell: None, corrects: true, max_rms: 0.0 };
    /// What a cell can be told to keep.
    pub const PER_CELL: RangeInclusive<u32> = 1..=65_536;

    /// Whether anything may be left out.
    pub fn leaves_out(&self) -> bool {
        self.per_cell.is_some() || self.max_rms != 0.0
    }

    /// The functions of an encoding that are left, listed over a lattice of `dims` samples (see [`Listed::new`]).
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn listed(
        &self,
        encoding: &Encoding,
        space: ([usize; 3], DMat3, DVec3),
        ticket: &Ticket,
    ) -> Result<Listed, Cancelled> {
        let listed = match self.max_rms > 0.0 {
            true => {
                encoding.find_least(ticket)?;
                Listed::new(&encoding.without_least(self.max_rms), space, ticket)?
            }
            false => Listed::new(encoding, space, ticket)?,
        };
        match self.per_cell {
            Some(most) => listed.limited(most as usize, self.corrects, ticket),
            None => Ok(listed),
        }
    }
}

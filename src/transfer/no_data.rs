//! What is drawn where a volume holds no data.

use serde::{Deserialize, Serialize};

use crate::core::Srgb8;

/// Opacity and colour of NaN. By default it is left out.
///
/// Where values are reconstructed, a sample without data is a box of its own size: nothing can be
/// interpolated between a value and none. Where samples are classified first it is a sample like any
/// other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NoData {
    /// Per unit distance, 0..=1.
    pub opacity: f64,
    /// Its colour, which no light falls on.
    pub colour: Srgb8,
}

impl Default for NoData {
    fn default() -> Self {
        Self { opacity: 0.0, colour: Srgb8([160, 160, 160]) }
    }
}

impl NoData {
    /// Whether anything of it can be seen.
    pub fn shows(self) -> bool {
        self.opacity > 0.0
    }
}

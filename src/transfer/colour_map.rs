//! Named colour maps.

use serde::{Deserialize, Serialize};

use crate::core::Srgb8;

/// A named map from 0..=1 to colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "the names say it all")]
pub enum ColourMap {
    Gray,
    CtLike,
}

impl ColourMap {
    /// Every map, in the order it is offered.
    pub const ALL: [Self; 2] = [Self::Gray, Self::CtLike];

    /// The name scripts use: lower case, Matplotlib's where it has one.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gray => "gray",
            Self::CtLike => "ct-like",
        }
    }

    /// The map of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|map| map.name() == name)
    }

    /// Evenly spaced colours from 0 to 1, at least two, interpolated linearly as sRGB.
    pub fn stops(self) -> &'static [Srgb8] {
        &[Srgb8::BLACK, Srgb8::WHITE]
    }
}

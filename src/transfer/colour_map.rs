//! Named colour maps.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use super::diverging;
use crate::core::Srgb8;

/// Colours a sampled map has.
const SAMPLES: usize = 256;

/// A named map from 0..=1 to colour.
///
/// Viridis, inferno, magma and plasma are Matplotlib's tables (by way of `colorous`); cividis is
/// d3's polynomial for it, a few steps of 255 away from the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "the names say it all")]
pub enum ColourMap {
    Viridis,
    Cividis,
    Inferno,
    Magma,
    Plasma,
    Gray,
    CoolWarm,
    CtLike,
}

/// From air by muscle and fat to bone, as anatomy is often coloured.
const CT_LIKE: [Srgb8; 7] = [
    Srgb8([0, 0, 0]),
    Srgb8([74, 20, 14]),
    Srgb8([148, 58, 40]),
    Srgb8([206, 122, 90]),
    Srgb8([232, 186, 146]),
    Srgb8([247, 232, 205]),
    Srgb8([255, 255, 255]),
];

impl ColourMap {
    /// Every map, in the order it is offered.
    pub const ALL: [Self; 8] = [
        Self::Viridis,
        Self::Cividis,
        Self::Inferno,
        Self::Magma,
        Self::Plasma,
        Self::Gray,
        Self::CoolWarm,
        Self::CtLike,
    ];

    /// The name scripts use: lower case, Matplotlib's where it has one.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viridis => "viridis",
            Self::Cividis => "cividis",
            Self::Inferno => "inferno",
            Self::Magma => "magma",
            Self::Plasma => "plasma",
            Self::Gray => "gray",
            Self::CoolWarm => "cool-warm",
            Self::CtLike => "ct-like",
        }
    }

    /// The map of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|map| map.name() == name)
    }

    /// Evenly spaced colours from 0 to 1, at least two, interpolated linearly as sRGB.
    pub fn stops(self) -> &'static [Srgb8] {
        static VIRIDIS: LazyLock<Vec<Srgb8>> = LazyLock::new(|| sample(&colorous::VIRIDIS));
        static CIVIDIS: LazyLock<Vec<Srgb8>> = LazyLock::new(|| sample(&colorous::CIVIDIS));
        static INFERNO: LazyLock<Vec<Srgb8>> = LazyLock::new(|| sample(&colorous::INFERNO));
        static MAGMA: LazyLock<Vec<Srgb8>> = LazyLock::new(|| sample(&colorous::MAGMA));
        static PLASMA: LazyLock<Vec<Srgb8>> = LazyLock::new(|| sample(&colorous::PLASMA));
        static COOL_WARM: LazyLock<Vec<Srgb8>> = LazyLock::new(|| diverging::cool_warm(SAMPLES));
        match self {
            Self::Viridis => &VIRIDIS,
            Self::Cividis => &CIVIDIS,
            Self::Inferno => &INFERNO,
            Self::Magma => &MAGMA,
            Self::Plasma => &PLASMA,
            Self::Gray => &[Srgb8::BLACK, Srgb8::WHITE],
            Self::CoolWarm => &COOL_WARM,
            Self::CtLike => &CT_LIKE,
        }
    }
}

fn sample(gradient: &colorous::Gradient) -> Vec<Srgb8> {
    (0..SAMPLES)
        .map(|i| {
            let colour = gradient.eval_rational(i, SAMPLES);
            Srgb8([colour.r, colour.g, colour.b])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(colour: Srgb8) -> f64 {
        let [r, g, b] = colour.to_linear().0;
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    #[test]
    fn names_round_trip_here_and_in_sessions() {
        for map in ColourMap::ALL {
            assert_eq!(ColourMap::from_name(map.name()), Some(map));
            assert_eq!(serde_json::to_string(&map).unwrap(), format!("\"{}\"", map.name()));
        }
        assert_eq!(ColourMap::from_name("jet"), None);
    }

    #[test]
    fn sequential_maps_only_ever_get_lighter() {
        for map in ColourMap::ALL.into_iter().filter(|map| *map != ColourMap::CoolWarm) {
            let stops = map.stops();
            assert!(stops.len() >= 2, "{map:?}");
            for pair in stops.windows(2) {
                // Rounding to bytes may cost a step.
                let rise = luminance(pair[1]) - luminance(pair[0]);
                assert!(rise > -3e-4, "{map:?} {pair:?}: {rise}");
            }
            let rise = luminance(stops[stops.len() - 1]) - luminance(stops[0]);
            assert!(rise > 0.5, "{map:?}: {rise}");
        }
    }

    #[test]
    fn the_sampled_maps_begin_and_end_as_published() {
        let ends = |map: ColourMap| {
            let stops = map.stops();
            (stops[0].0, stops[stops.len() - 1].0)
        };
        assert_eq!(ends(ColourMap::Viridis), ([68, 1, 84], [253, 231, 37]));
        assert_eq!(ends(ColourMap::Plasma), ([13, 8, 135], [240, 249, 33]));
        assert_eq!(ends(ColourMap::Inferno).0, [0, 0, 4]);
        assert_eq!(ends(ColourMap::Magma), ([0, 0, 4], [252, 253, 191]));
    }
}

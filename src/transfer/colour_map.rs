//! Named colour maps.

use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use super::diverging;
use crate::core::{Srgb8, names};

/// Colours a sampled map has.
const SAMPLES: usize = 256;

/// A named map from 0..=1 to colour.
///
/// Viridis, inferno, magma, plasma and turbo are Matplotlib's tables (by way of `colorous`); cividis
/// is d3's polynomial for it, a few steps of 255 away from the table. Batlow, lajolla, oslo, lapaz,
/// roma and vik are F. Crameri's; cool–warm is K. Moreland's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "the names say it all")]
pub enum ColourMap {
    Viridis,
    Cividis,
    Inferno,
    Magma,
    Plasma,
    Batlow,
    Lajolla,
    Oslo,
    Lapaz,
    Gray,
    CoolWarm,
    Roma,
    Vik,
    CtLike,
    Turbo,
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

names!(
    /// Even ones first, then diverging ones; in lower case, Matplotlib's or Crameri's names where they have one.
    ColourMap[15] {
        Viridis => "viridis",
        Cividis => "cividis",
        Inferno => "inferno",
        Magma => "magma",
        Plasma => "plasma",
        Batlow => "batlow",
        Lajolla => "lajolla",
        Oslo => "oslo",
        Lapaz => "lapaz",
        Gray => "gray",
        CoolWarm => "cool-warm" | "coolwarm",
        Roma => "roma",
        Vik => "vik",
        CtLike => "ct-like",
        Turbo => "turbo",
    }
);

impl ColourMap {
    /// Whether it runs from one colour over a neutral middle to another, rather than from dark to
    /// light.
    pub fn is_diverging(self) -> bool {
        matches!(self, Self::CoolWarm | Self::Roma | Self::Vik)
    }

    /// Whether people who do not tell red from green tell its values apart; a test holds it.
    pub fn is_safe(self) -> bool {
        self != Self::Turbo
    }

    /// Evenly spaced colours from 0 to 1, at least two, interpolated linearly as sRGB.
    pub fn stops(self) -> &'static [Srgb8] {
        // In the order of the names.
        static STOPS: LazyLock<[Vec<Srgb8>; 15]> = LazyLock::new(|| ColourMap::ALL.map(made));
        &STOPS[self as usize]
    }
}

fn made(map: ColourMap) -> Vec<Srgb8> {
    match map {
        ColourMap::Viridis => sample(&colorous::VIRIDIS),
        ColourMap::Cividis => sample(&colorous::CIVIDIS),
        ColourMap::Inferno => sample(&colorous::INFERNO),
        ColourMap::Magma => sample(&colorous::MAGMA),
        ColourMap::Plasma => sample(&colorous::PLASMA),
        ColourMap::Turbo => sample(&colorous::TURBO),
        ColourMap::Batlow => read(include_str!("../../assets/colour-maps/batlow.txt")),
        ColourMap::Lajolla => read(include_str!("../../assets/colour-maps/lajolla.txt")),
        ColourMap::Oslo => read(include_str!("../../assets/colour-maps/oslo.txt")),
        ColourMap::Lapaz => read(include_str!("../../assets/colour-maps/lapaz.txt")),
        ColourMap::Roma => read(include_str!("../../assets/colour-maps/roma.txt")),
        ColourMap::Vik => read(include_str!("../../assets/colour-maps/vik.txt")),
        ColourMap::Gray => vec![Srgb8::BLACK, Srgb8::WHITE],
        ColourMap::CoolWarm => diverging::cool_warm(SAMPLES),
        ColourMap::CtLike => CT_LIKE.to_vec(),
    }
}

/// The colours of a table; a test holds that each can be read.
fn read(table: &str) -> Vec<Srgb8> {
    table.split_whitespace().filter_map(Srgb8::parse).collect()
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
        assert_eq!(ColourMap::from_name("coolwarm"), Some(ColourMap::CoolWarm));
    }

    #[test]
    fn every_map_has_the_colours_of_its_name() {
        for (i, map) in ColourMap::ALL.into_iter().enumerate() {
            assert_eq!(map as usize, i, "{map:?}");
            assert_eq!(map.stops(), made(map), "{map:?}");
            let count = match map {
                ColourMap::Gray => 2,
                ColourMap::CtLike => CT_LIKE.len(),
                _ => SAMPLES,
            };
            assert_eq!(map.stops().len(), count, "{map:?}");
        }
    }

    /// What a dichromat sees in place of a colour: linear RGB by way of cone responses, one of
    /// which the others stand in for (Viénot, Brettel and Mollon 1999, eqs. 1 to 5).
    fn as_seen(rgb: [f64; 3], blind: Blind) -> [f64; 3] {
        let [r, g, b] = rgb;
        let l = 17.8824 * r + 43.5161 * g + 4.11935 * b;
        let m = 3.45565 * r + 27.1554 * g + 3.86714 * b;
        let s = 0.029_956_6 * r + 0.184_309 * g + 1.467_09 * b;
        let (l, m) = match blind {
            Blind::Not => (l, m),
            Blind::ToRed => (2.023_44 * m - 2.525_81 * s, m),
            Blind::ToGreen => (l, 0.494_207 * l + 1.248_27 * s),
        };
        [
            0.080_944_4 * l - 0.130_504 * m + 0.116_721 * s,
            -0.010_248_5 * l + 0.054_019_4 * m - 0.113_615 * s,
            -0.000_365_294 * l - 0.004_121_63 * m + 0.693_513 * s,
        ]
        .map(|c| c.clamp(0.0, 1.0))
    }

    #[derive(Clone, Copy)]
    enum Blind {
        Not,
        ToRed,
        ToGreen,
    }

    /// Oklab (B. Ottosson 2020) of linear sRGB: about equal distances look about equally large.
    fn oklab([r, g, b]: [f64; 3]) -> [f64; 3] {
        let l = (0.412_221_47 * r + 0.536_332_54 * g + 0.051_445_99 * b).cbrt();
        let m = (0.211_903_5 * r + 0.680_699_55 * g + 0.107_396_96 * b).cbrt();
        let s = (0.088_302_46 * r + 0.281_718_84 * g + 0.629_978_7 * b).cbrt();
        [
            0.210_454_26 * l + 0.793_617_78 * m - 0.004_072_05 * s,
            1.977_998_5 * l - 2.428_592_2 * m + 0.450_593_7 * s,
            0.025_904_04 * l + 0.782_771_77 * m - 0.808_675_77 * s,
        ]
    }

    /// How much closer two colours of a map, a quarter of it or more apart, come at most for people
    /// who see no red or no green: 1 where they stay as different as they are for others.
    fn kept_contrast(map: ColourMap) -> f64 {
        const LAST: usize = 48;
        let stops = map.stops();
        let at = |i: usize, blind: Blind| {
            let x = i as f64 / LAST as f64 * (stops.len() - 1) as f64;
            let index = (x as usize).min(stops.len() - 2);
            let (a, b) = (stops[index].encoded(), stops[index + 1].encoded());
            let f = x - index as f64;
            let mixed = [0, 1, 2].map(|c| a[c] * (1.0 - f) + b[c] * f);
            oklab(as_seen(mixed.map(crate::core::colour::linear_from_srgb), blind))
        };
        let distance = |i: usize, j: usize, blind: Blind| {
            let (a, b) = (at(i, blind), at(j, blind));
            a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        let pairs = (0..=LAST).flat_map(|i| (i + LAST / 4..=LAST).map(move |j| (i, j)));
        let kept = pairs.flat_map(|(i, j)| {
            [Blind::ToRed, Blind::ToGreen]
                .map(|blind| distance(i, j, blind) / distance(i, j, Blind::Not))
        });
        kept.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn safe_maps_tell_values_apart_without_red_or_green() {
        for map in ColourMap::ALL {
            let kept = kept_contrast(map);
            println!("{map:?}: {kept:.3}");
            // Measured: turbo 0.33, all others 0.45 or more.
            assert_eq!(kept > 0.4, map.is_safe(), "{map:?}: {kept:.3}");
        }
    }

    #[test]
    fn safe_maps_come_first() {
        assert!(ColourMap::ALL.is_sorted_by_key(|map| !map.is_safe()));
    }

    #[test]
    fn sequential_maps_only_ever_get_lighter() {
        for map in
            ColourMap::ALL.into_iter().filter(|map| !map.is_diverging() && *map != ColourMap::Turbo)
        {
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

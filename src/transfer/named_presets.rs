//! Presets: looks that many data call for, by name.

use super::presets::{by_percentiles, ct, ct_bone, default_for, for_huge, of_constant, shifted};
use super::{ColourMap, Kind, TransferFunction};
use crate::core::names;
use crate::volume::Statistics;

/// A look that many data call for, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Preset {
    /// What [`default_for`] finds.
    Default,
    /// Bone.
    CtBone,
    /// Skin, and under it what is denser.
    CtSkin,
    /// Vessels with contrast medium, and bone faintly.
    CtVessels,
    /// Tissue in greys, brighter ones denser.
    Mr,
    /// What lies beyond the commonest value, as a veil that thickens with the value.
    Simulation,
}

names!(Preset[6] {
    Default => "default",
    CtBone => "ct-bone",
    CtSkin => "ct-skin",
    CtVessels => "ct-vessels",
    Mr => "mr",
    Simulation => "simulation",
});

impl Preset {
    /// The transfer function for values of these statistics: that of CT in Hounsfield units where
    /// the values are such (whole numbers from about −1000, as scanners write them, or with 1024 added), all else by
    /// percentiles of what lies beyond the commonest value.
    pub fn function(self, statistics: &Statistics) -> TransferFunction {
        if self == Self::Default {
            return default_for(statistics);
        }
        if statistics.min == statistics.max {
            return of_constant(statistics, self.map());
        }
        if !(statistics.max - statistics.min).is_finite() {
            return for_huge(statistics, |shrunk| self.function(shrunk));
        }
        match (self.in_hounsfield_units(), Kind::of(statistics)) {
            (Some(function), Kind::Ct { zero }) => shifted(function, zero),
            _ => by_percentiles(statistics, self.map(), |_, _| self.by_fraction()),
        }
    }

    /// Whether it is meant for Hounsfield units, and the values are none.
    pub fn lacks_hounsfield_units(self, statistics: &Statistics) -> bool {
        self.in_hounsfield_units().is_some() && !matches!(Kind::of(statistics), Kind::Ct { .. })
    }

    fn map(self) -> ColourMap {
        match self {
            Self::CtBone | Self::CtSkin | Self::CtVessels => ColourMap::CtLike,
            Self::Mr => ColourMap::Gray,
            Self::Default | Self::Simulation => ColourMap::Viridis,
        }
    }

    fn in_hounsfield_units(self) -> Option<TransferFunction> {
        let (opacity, range) = match self {
            Self::CtBone => return Some(ct_bone()),
            // Between air and skin all is partial volume; fat begins at −120.
            Self::CtSkin => {
                (vec![(-400.0, 0.0), (-150.0, 0.35), (50.0, 0.6), (300.0, 0.9)], [-500.0, 500.0])
            }
            // Contrast medium fills vessels to 200..500; what is denser is bone.
            Self::CtVessels => (
                vec![(130.0, 0.0), (220.0, 0.35), (450.0, 0.7), (650.0, 0.3), (1500.0, 0.3)],
                [0.0, 700.0],
            ),
            Self::Default | Self::Mr | Self::Simulation => return None,
        };
        Some(ct(opacity, range))
    }

    /// (fraction of the values beyond the commonest one, opacity), the last one held beyond.
    fn by_fraction(self) -> [(f64, f64); 3] {
        match self {
            Self::CtBone => [(0.7, 0.0), (0.85, 0.15), (0.98, 0.8)],
            Self::CtSkin => [(0.05, 0.3), (0.4, 0.6), (0.9, 0.9)],
            Self::CtVessels => [(0.85, 0.0), (0.95, 0.3), (0.995, 0.8)],
            Self::Mr => [(0.3, 0.02), (0.7, 0.1), (0.97, 0.5)],
            Self::Default | Self::Simulation => [(0.5, 0.02), (0.9, 0.12), (0.99, 0.5)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Ticket;
    use crate::volume::Samples;

    /// Statistics of every kind of data.
    fn kinds() -> Vec<(&'static str, Statistics)> {
        let of = |samples: Samples| Statistics::of(&samples, &Ticket::new()).unwrap();
        // Evenly spread, in no order.
        let noisy = |n: usize| (0..n).map(|i| (i * 7919 % n) as f64 / n as f64).collect::<Vec<_>>();
        let hounsfield = |i: usize| [-1000, -1000, -80, 40, 45, 700][i % 6] + (i % 7) as i16;
        vec![
            ("hounsfield", of(Samples::Int16((0..50_000).map(hounsfield).collect()))),
            ("noise", of(Samples::Float64(noisy(50_000)))),
            ("sparse", of(Samples::UInt8((0..50_000).map(|i| u8::from(i % 997 == 0)).collect()))),
            (
                "bright",
                of(Samples::UInt8(
                    (0..50_000).map(|i| if i % 20 == 0 { (i % 179) as u8 } else { 255 }).collect(),
                )),
            ),
            (
                "labels",
                of(Samples::Int16((0..50_000).map(|i| [0, 0, 1, 2, 3, 12][i % 6]).collect())),
            ),
            ("constant", of(Samples::Float32(vec![7.0; 100]))),
            ("zero", of(Samples::UInt8(vec![0; 100]))),
            ("greatest", of(Samples::Float64(vec![f64::MAX; 9]))),
            ("widest", of(Samples::Float64(vec![f64::MIN, -1.0, 0.0, 1.0, f64::MAX]))),
            ("two", of(Samples::Float64(vec![1.0, 2.0]))),
            ("one", of(Samples::Float64(vec![-3.0]))),
            ("no number", of(Samples::Float64(vec![f64::NAN, f64::INFINITY]))),
            (
                "outlier",
                of(Samples::Float32(
                    (0..50_000).map(|i| if i == 5 { 1e30 } else { (i % 100) as f32 }).collect(),
                )),
            ),
        ]
    }

    #[test]
    fn every_preset_shows_something_of_every_kind_of_data() {
        for (kind, statistics) in kinds() {
            for preset in Preset::ALL {
                let f = preset.function(&statistics);
                assert_eq!(f.validate(), Ok(()), "{preset:?} of {kind}: {f:?}");
                let values = [statistics.min, statistics.max].into_iter();
                let seen = values
                    .chain(statistics.quantiles.iter().copied())
                    .map(|v| f.opacity_at(v))
                    .fold(0.0, f64::max);
                assert!(seen > 0.1, "{preset:?} of {kind}: {f:?}");
                let [low, high] = f.colour.range();
                assert!(low < high, "{preset:?} of {kind}: {low} {high}");
            }
        }
    }

    #[test]
    fn ct_presets_are_in_hounsfield_units_where_the_data_are() {
        let kinds = kinds();
        let hounsfield = &kinds[0].1;
        let at = |preset: Preset, value: f64| preset.function(hounsfield).opacity_at(value);
        // Air, fat, muscle, contrast medium, compact bone.
        let [air, fat, muscle, medium, bone] = [-1000.0, -80.0, 50.0, 350.0, 1200.0];
        for preset in [Preset::CtBone, Preset::CtSkin, Preset::CtVessels] {
            assert_eq!(at(preset, air), 0.0, "{preset:?}");
        }
        assert!(at(Preset::CtBone, bone) > 0.7 && at(Preset::CtBone, muscle) == 0.0);
        assert!(at(Preset::CtSkin, fat) > 0.3 && at(Preset::CtSkin, bone) > 0.8);
        assert!(at(Preset::CtVessels, medium) > 1.5 * at(Preset::CtVessels, bone));
        assert_eq!(at(Preset::CtVessels, muscle), 0.0);
        // Elsewhere the same names go by percentiles, within the data.
        let noise = &kinds[1].1;
        for preset in Preset::ALL {
            let f = preset.function(noise);
            assert!(f.opacity.iter().all(|(v, _)| (0.0..=1.0).contains(v)), "{preset:?}: {f:?}");
        }
        assert!(Preset::ALL.iter().all(|&p| Preset::from_name(p.name()) == Some(p)));
        assert_eq!(Preset::from_name("bone"), None);
    }
}

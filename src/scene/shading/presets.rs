//! Westover's examples of what tables and lights are for.

use super::{Amounts, Colours, Index, Lighting, Shading};
use crate::core::{Srgb8, names};
use crate::transfer::ColourMap;
use crate::transfer::presets::{RangeRule, range};
use crate::volume::ScalarVolume;

/// The gradient strength that presets take for strong: this part of the middle range of values per
/// smallest spacing. Faces between two matters that a scanner blurs over five voxels have it.
const STRONG: f64 = 0.2;

/// The gradient strength that presets take for strong, data units per world unit; 1 where all values
/// are one.
pub fn strong_gradient(volume: &ScalarVolume) -> f64 {
    let [low, high] = range(&volume.statistics, RangeRule::Percentiles);
    // Halved, so that ±1e308 does not overflow.
    let width = 2.0 * (high / 2.0 - low / 2.0);
    let strong = (STRONG * width / volume.lattice.smallest_spacing()).abs();
    if strong > 0.0 && strong.is_finite() { strong } else { 1.0 }
}

/// A shading to begin with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShadingPreset {
    /// Lights alone.
    Lights,
    /// No lights; where values change abruptly it thins out, so that only soft matter is left.
    Cloud,
    /// Lights, and opacity only where values change: faces without what lies between them.
    Surface,
    /// Lights, and colours that cool and darken with depth.
    DepthCue,
    /// Lights, and colours by how abruptly values change.
    GradientColour,
}

names!(ShadingPreset {
    Lights => "lights",
    Cloud => "cloud",
    Surface => "surface",
    DepthCue => "depth-cue",
    GradientColour => "gradient-colour",
});

impl ShadingPreset {
    /// What it is for a volume, whose values say how strong gradients are.
    pub fn shading(self, volume: &ScalarVolume) -> Shading {
        let strong = strong_gradient(volume);
        let by_strength = |points: [(f64, f64); 3]| Amounts {
            index: Index::GradientStrength,
            points: points.map(|(share, amount)| (share * strong, amount)).to_vec(),
        };
        let lit = Shading { lighting: Some(Lighting::default()), ..Shading::default() };
        match self {
            Self::Lights => lit,
            Self::Cloud => Shading {
                modulation: Some(by_strength([(0.0, 1.0), (0.5, 0.3), (1.0, 0.0)])),
                ..Shading::default()
            },
            Self::Surface => Shading {
                modulation: Some(by_strength([(0.0, 0.0), (0.25, 0.1), (1.0, 1.0)])),
                ..lit
            },
            Self::DepthCue => Shading {
                reflection: Some(Colours {
                    index: Index::ViewDepth,
                    stops: vec![
                        (0.25, Srgb8([255, 246, 224])),
                        (0.5, Srgb8([196, 170, 150])),
                        (0.75, Srgb8([46, 62, 104])),
                    ],
                }),
                ..lit
            },
            Self::GradientColour => {
                let stops = ColourMap::Viridis.stops();
                let last = (stops.len() - 1).max(1) as f64;
                // Faces of bone are stronger than most: colours are left for them.
                let stop = |(i, colour): (usize, &Srgb8)| (2.0 * i as f64 / last * strong, *colour);
                let stops = stops.iter().enumerate().map(stop).collect();
                let reflection = Some(Colours { index: Index::GradientStrength, stops });
                Shading { reflection, ..lit }
            }
        }
    }
}

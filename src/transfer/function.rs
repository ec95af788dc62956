//! Transfer functions in the data's own units.

use serde::{Deserialize, Serialize};

use super::ColourMap;
use crate::core::colour::linear_from_srgb;
use crate::core::{LinearRgb, Srgb8};

/// Least transmittance per unit distance: what opacity 1 is drawn as, since its extinction would
/// be infinite. Opacities above `1 − TRANSMITTANCE_FLOOR` are counted, never hidden.
pub const TRANSMITTANCE_FLOOR: f64 = 1e-4;

/// Where a value's colour comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ColourSource {
    /// A named map stretched over `range` (low, high; reversed ranges reverse the map).
    Map {
        /// Which map.
        map: ColourMap,
        /// The values that take its first and its last colour.
        range: [f64; 2],
    },
    /// Colours at given values, sorted by value; at least one.
    Stops(Vec<(f64, Srgb8)>),
}

/// Opacity and colour of a value.
///
/// Both interpolate linearly (colours as sRGB) and hold their end values. Two points at one value
/// make a step; the value itself takes the later one. NaN is fully transparent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TransferFunction {
    /// (value, opacity per unit distance in 0..=1), sorted by value. None: all transparent.
    pub opacity: Vec<(f64, f64)>,
    /// The colours.
    pub colour: ColourSource,
}

/// Extinction per unit distance of an opacity per unit distance: −ln(1 − α), at most
/// −ln [`TRANSMITTANCE_FLOOR`]. Precise near 0; NaN and negative opacities give 0.
pub fn extinction_from_opacity(alpha: f64) -> f64 {
    if alpha.is_nan() || alpha <= 0.0 {
        return 0.0;
    }
    -(-alpha.min(1.0 - TRANSMITTANCE_FLOOR)).ln_1p()
}

impl TransferFunction {
    /// Opacity per unit distance of a value, 0..=1.
    pub fn opacity_at(&self, value: f64) -> f64 {
        if value.is_nan() {
            return 0.0;
        }
        let alpha = interpolate(&self.opacity, value, |&a| [a]).map_or(0.0, |[a]| a);
        alpha.clamp(0.0, 1.0)
    }

    /// Colour of a value in linear light; black for NaN.
    pub fn colour_at(&self, value: f64) -> LinearRgb {
        if value.is_nan() {
            return LinearRgb::default();
        }
        let encoded = match &self.colour {
            ColourSource::Stops(stops) => {
                interpolate(stops, value, |c| c.encoded()).unwrap_or_default()
            }
            ColourSource::Map { map, range } => {
                let stops = map.stops();
                let last = (stops.len() - 1) as f64;
                let x = position(*range, value) * last;
                let index = (x.floor() as usize).min(stops.len() - 2);
                let (a, b) = (stops[index].encoded(), stops[index + 1].encoded());
                let f = x - index as f64;
                std::array::from_fn(|c| a[c] * (1.0 - f) + b[c] * f)
            }
        };
        LinearRgb(encoded.map(linear_from_srgb))
    }
}

/// Where a value lies in a range, clamped to 0..=1; a zero-width range is a step at its value.
fn position(range: [f64; 2], value: f64) -> f64 {
    let [low, high] = range;
    if low == high {
        return if value < low { 0.0 } else { 1.0 };
    }
    // Halved, so that a range of ±1e308 does not overflow.
    ((value / 2.0 - low / 2.0) / (high / 2.0 - low / 2.0)).clamp(0.0, 1.0)
}

/// Linear interpolation in sorted points, ends held; `None` without points.
fn interpolate<T, const N: usize>(
    points: &[(f64, T)],
    value: f64,
    read: impl Fn(&T) -> [f64; N],
) -> Option<[f64; N]> {
    let above = points.partition_point(|(v, _)| *v <= value);
    let Some(low) = above.checked_sub(1) else {
        return points.first().map(|(_, t)| read(t));
    };
    let (a, b) = (&points[low], points.get(low + 1));
    let Some(b) = b else { return Some(read(&a.1)) };
    let f = position([a.0, b.0], value);
    let (x, y) = (read(&a.1), read(&b.1));
    Some(std::array::from_fn(|i| x[i] * (1.0 - f) + y[i] * f))
}

//! Values as densities: the transfer function itself, never a table of it.

use super::quadrature::{self, Density};
use crate::transfer::{
    ColourSource, TRANSMITTANCE_FLOOR, TransferFunction, extinction_from_opacity,
};

/// How closely the function is integrated over values, as a part of its size.
const PRECISION: f64 = 1e-12;
/// The sRGB channel at which decoding goes from its straight line to its power (IEC 61966-2-1).
const SRGB_BEND: f64 = 0.040_45;

/// A transfer function as densities per world unit.
pub(super) struct Classes {
    function: TransferFunction,
    unit: f64,
    /// Opacity instead of extinction.
    published: bool,
    /// Opacity's points and what bends or jumps beside them, sorted, each once.
    stops: Vec<f64>,
    /// Those across which the light must be split: opacity's points, and jumps of colour.
    splits: Vec<f64>,
    /// ∫ of the density from the first stop to each.
    until: Vec<Density>,
}

impl Classes {
    /// `unit` is the world length ℓ of the opacities. `published` gives α/ℓ in place of κ, with α
    /// lowered to the floor of transmittance, as κ is.
    pub(super) fn new(function: &TransferFunction, unit: f64, published: bool) -> Self {
        let mut splits: Vec<f64> = function.opacity.iter().map(|(v, _)| *v).collect();
        let floor = 1.0 - TRANSMITTANCE_FLOOR;
        for pair in function.opacity.windows(2) {
            let ((v0, a0), (v1, a1)) = (pair[0], pair[1]);
            if (a0 - floor) * (a1 - floor) < 0.0 {
                splits.push(v0 + (floor - a0) / (a1 - a0) * (v1 - v0));
            }
        }
        let mut stops = splits.clone();
        match &function.colour {
            ColourSource::Stops(colours) => {
                let encoded: Vec<_> = colours.iter().map(|(v, c)| (*v, c.encoded())).collect();
                stops.extend(bends(&encoded));
                stops.extend(colours.iter().map(|(v, _)| *v));
                splits.extend(colours.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[0].0));
            }
            ColourSource::Map { map, range: [low, high] } => {
                let last = (map.stops().len() - 1) as f64;
                let encoded: Vec<_> = (0_u32..)
                    .zip(map.stops())
                    .map(|(i, colour)| {
                        let f = f64::from(i) / last;
                        (low * (1.0 - f) + high * f, colour.encoded())
                    })
                    .collect();
                stops.extend(bends(&encoded));
                stops.extend(encoded.iter().map(|(v, _)| *v));
                if low == high {
                    splits.push(*low);
                }
            }
        }
        for list in [&mut stops, &mut splits] {
            list.sort_by(f64::total_cmp);
            list.dedup();
        }
        let mut classes =
            Self { function: function.clone(), unit, published, stops, splits, until: Vec::new() };
        let mut until = vec![[0.0; 4]];
        for pair in classes.stops.windows(2) {
            let part = classes.smooth_mean(pair[0], pair[1]).map(|m| m * (pair[1] - pair[0]));
            let so_far = until[until.len() - 1];
            until.push(std::array::from_fn(|c| so_far[c] + part[c]));
        }
        classes.until = until;
        classes
    }

    /// Density of a value.
    pub(super) fn at(&self, value: f64) -> Density {
        let alpha = self.function.opacity_at(value);
        let weight = if self.published {
            alpha.min(1.0 - TRANSMITTANCE_FLOOR)
        } else {
            extinction_from_opacity(alpha)
        } / self.unit;
        if weight <= 0.0 {
            return [0.0; 4];
        }
        let [r, g, b] = self.function.colour_at(value).0;
        [weight, weight * r, weight * g, weight * b]
    }

    /// Linear colour of a value, whatever its opacity.
    pub(super) fn colour(&self, value: f64) -> [f64; 3] {
        self.function.colour_at(value).0
    }

    /// Whether no value in low..=high has any opacity. True for an empty range.
    pub(super) fn is_clear(&self, low: f64, high: f64) -> bool {
        let clear = |v| self.function.opacity_at(v) <= 0.0;
        let inside = |&&(v, _): &&(f64, f64)| (low..=high).contains(&v);
        low > high
            || clear(low)
                && clear(high)
                && self.function.opacity.iter().filter(inside).all(|(_, a)| *a <= 0.0)
    }

    /// Values inside low..high at which light along a ray must be split.
    pub(super) fn splits_within(&self, low: f64, high: f64) -> &[f64] {
        let from = self.splits.partition_point(|v| *v <= low);
        let to = self.splits.partition_point(|v| *v < high);
        self.splits.get(from..to).unwrap_or_default()
    }

    /// Mean density over all values between two: (K(v₁) − K(v₀))/(v₁ − v₀), the local one where
    /// they are equal.
    pub(super) fn mean(&self, v0: f64, v1: f64) -> Density {
        let (low, high) = (v0.min(v1), v0.max(v1));
        if low == high {
            return self.at(low);
        }
        let from = self.stops.partition_point(|v| *v <= low);
        let to = self.stops.partition_point(|v| *v < high);
        if from >= to {
            return self.smooth_mean(low, high);
        }
        let (first, last) = (self.stops[from], self.stops[to - 1]);
        let (near, far) = (self.smooth_mean(low, first), self.smooth_mean(last, high));
        std::array::from_fn(|c| {
            let whole = self.until[to - 1][c] - self.until[from][c];
            (near[c] * (first - low) + whole + far[c] * (high - last)) / (high - low)
        })
    }

    fn smooth_mean(&self, low: f64, high: f64) -> Density {
        quadrature::mean(low, high, PRECISION, &|v| self.at(v))
    }
}

/// Values between colours, sRGB, at which a channel's decoding bends.
fn bends(colours: &[(f64, [f64; 3])]) -> impl Iterator<Item = f64> {
    colours.windows(2).flat_map(|pair| {
        let ((v0, c0), (v1, c1)) = (pair[0], pair[1]);
        c0.into_iter().zip(c1).filter_map(move |(c0, c1)| {
            let f = (SRGB_BEND - c0) / (c1 - c0);
            (f > 0.0 && f < 1.0).then_some(v0 + f * (v1 - v0))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::ColourMap;

    fn classes(opacity: Vec<(f64, f64)>, published: bool) -> Classes {
        let colour = ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 1.0] };
        Classes::new(&TransferFunction::of(opacity, colour), 0.5, published)
    }

    /// ∫ −ln(1 − α) dα = (1 − α) ln(1 − α) + α.
    fn antiderivative(alpha: f64) -> f64 {
        (1.0 - alpha) * (-alpha).ln_1p() + alpha
    }

    #[test]
    fn the_mean_of_a_ramp_is_its_closed_form_over_any_interval() {
        let ramp = classes(vec![(0.0, 0.0), (1.0, 0.9)], false);
        for (a, b) in [(0.1, 0.8), (0.800, 0.100), (0.3, 0.3 + 1e-7), (0.123, 0.124), (0.9, 0.2)] {
            let exact = (antiderivative(0.9 * b) - antiderivative(0.9 * a)) / (0.9 * (b - a)) / 0.5;
            let found = ramp.mean(a, b)[0];
            assert!((found / exact - 1.0).abs() < 1e-8, "{a}..{b}: {found} {exact}");
        }
        let published = classes(vec![(0.0, 0.0), (1.0, 0.9)], true).mean(0.2, 0.6)[0];
        assert!((published - 0.4 * 0.9 / 0.5).abs() < 1e-12, "{published}");
    }

    #[test]
    fn steps_count_for_the_part_that_lies_beyond_them() {
        let step = classes(vec![(0.4, 0.0), (0.4, 0.5)], false);
        let full = 2.0_f64.ln() / 0.5;
        assert!((step.mean(0.3, 0.7)[0] - 0.75 * full).abs() < 1e-10);
        assert!((step.mean(0.7, 0.3)[0] - 0.75 * full).abs() < 1e-10);
        assert_eq!(step.mean(0.1, 0.3)[0], 0.0);
        assert!(step.is_clear(-1.0, 0.39) && !step.is_clear(-1.0, 0.4) && !step.is_clear(0.5, 9.0));
    }

    #[test]
    fn a_peak_inside_a_range_is_not_clear() {
        let peak = classes(vec![(0.4, 0.0), (0.5, 0.8), (0.6, 0.0)], false);
        assert!(!peak.is_clear(0.0, 1.0) && peak.is_clear(0.61, 1.0) && peak.is_clear(1.0, 0.0));
        assert_eq!(peak.splits_within(0.4, 0.6), [0.5]);
    }

    /// Of channels that rise and fall past the place where sRGB bends.
    #[test]
    fn means_of_colours_are_those_of_many_small_parts() {
        use crate::core::Srgb8;
        let stops =
            [(0.0, [0, 3, 0]), (0.4, [9, 255, 30]), (0.6, [0, 0, 255]), (1.0, [200, 0, 11])];
        let stops = stops.map(|(v, c)| (v, Srgb8(c))).to_vec();
        let map = ColourSource::Map { map: ColourMap::Inferno, range: [0.9, 0.1] };
        for colour in [ColourSource::Stops(stops), map] {
            for published in [false, true] {
                let opacity = vec![(0.05, 0.0), (0.5, 0.9), (0.8, 0.2)];
                let function = TransferFunction::of(opacity, colour.clone());
                let classes = Classes::new(&function, 0.5, published);
                for (a, b) in [(0.02, 0.97), (0.31, 0.11), (0.43, 0.44), (0.6, 0.65)] {
                    // A hundred thousand midpoints.
                    let count = 100_000;
                    let mut expected = [0.0; 4];
                    for i in 0..count {
                        let at = classes.at(a + (b - a) * (f64::from(i) + 0.5) / f64::from(count));
                        let parts = expected.iter_mut().zip(at);
                        parts.for_each(|(sum, v)| *sum += v / f64::from(count));
                    }
                    let found = classes.mean(a, b);
                    for (found, expected_channel) in found.iter().zip(expected) {
                        let off = (found - expected_channel).abs() / expected[0];
                        // Measured: 1.1e-10; 2.4e-9 where parts may lie across bends.
                        assert!(off < 3e-10, "{a}..{b}: {found:?} {expected_channel:?} {off:e}");
                    }
                }
            }
        }
    }
}

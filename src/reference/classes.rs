//! Values as densities: the transfer function itself, never a table of it.

use super::quadrature::{self, Density};
use crate::transfer::{
    ColourSource, TRANSMITTANCE_FLOOR, TransferFunction, extinction_from_opacity,
};

/// How closely the function is integrated over values, as a part of its size.
const PRECISION: f64 = 1e-12;

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
                stops.extend(colours.iter().map(|(v, _)| *v));
                splits.extend(colours.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[0].0));
            }
            ColourSource::Map { map, range: [low, high] } => {
                let last = (map.stops().len() - 1) as f64;
                stops.extend((0..map.stops().len()).map(|i| {
                    let f = i as f64 / last;
                    low * (1.0 - f) + high * f
                }));
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
}

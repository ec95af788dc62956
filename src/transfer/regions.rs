//! Regions of the plane of value and gradient strength: a transfer function of two variables.
//!
//! A value alone cannot tell matter from the blur between two others that passes through it; together
//! with the strength of the gradient it can (Levoy 1988; Kindlmann and Durkin 1998; Kniss, Kindlmann and
//! Hansen 2001: matter is where the gradient is weak, boundaries are arches between two matters).

use serde::{Deserialize, Serialize};

use super::extinction_from_opacity;
use crate::core::{Srgb8, names, plain_number};

/// Regions at most.
pub const MOST_REGIONS: usize = 16;
/// Sharper borders than this part of a region are as sharp as this.
const LEAST_SOFTNESS: f64 = 1e-6;

/// What a region is in its box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RegionShape {
    /// All of it. One that begins at strength 0 has no border there.
    #[default]
    Rectangle,
    /// The ellipse in it.
    Ellipse,
    /// From the middle of its lower side widening to its upper one: the surface of one value, as thick
    /// on the screen whether the gradient is weak or strong (Levoy 1988).
    Triangle,
}

names!(RegionShape[3] { Rectangle => "rectangle", Ellipse => "ellipse", Triangle => "triangle" });

/// A part of the plane of value and gradient strength, with an opacity and perhaps a colour.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// What it is in its box.
    pub shape: RegionShape,
    /// The box from low to high: values in the data's units.
    pub values: [f64; 2],
    /// Gradient strengths, data units per world unit, from 0 on.
    pub strengths: [f64; 2],
    /// From the border inwards, the opacity rises over this part of the way to the middle, 0..=1.
    pub softness: f64,
    /// Opacity per unit distance in the middle, 0..=1.
    pub opacity: f64,
    /// Its colour; that of the value where it has none of its own.
    pub colour: Option<Srgb8>,
}

/// What is no region.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegionError {
    /// Too many.
    #[error("expected at most {MOST_REGIONS} regions, found {found}; remove some")]
    Many {
        /// How many.
        found: usize,
    },
    /// A box that is none.
    #[error(
        "expected a region's {of} as two numbers, the lower one first{least}, found {} and {}",
        plain_number(found[0]), plain_number(found[1])
    )]
    Box {
        /// Values or strengths.
        of: &'static str,
        /// What the lower one must be, in words.
        least: &'static str,
        /// The two.
        found: [f64; 2],
    },
    /// A share that is none.
    #[error("expected a region's {of} from 0 to 1, found {}", plain_number(*found))]
    Share {
        /// Opacity or softness.
        of: &'static str,
        /// The offending number.
        found: f64,
    },
}

impl Region {
    /// Whether it means something.
    ///
    /// # Errors
    /// See [`RegionError`].
    pub fn validate(&self) -> Result<(), RegionError> {
        let is_box = |[low, high]: [f64; 2]| low.is_finite() && high.is_finite() && low < high;
        if !is_box(self.values) {
            return Err(RegionError::Box { of: "values", least: "", found: self.values });
        }
        if !is_box(self.strengths) || self.strengths[0] < 0.0 {
            let least = " and not below 0";
            return Err(RegionError::Box { of: "strengths", least, found: self.strengths });
        }
        for (of, found) in [("opacity", self.opacity), ("softness", self.softness)] {
            if !(0.0..=1.0).contains(&found) {
                return Err(RegionError::Share { of, found });
            }
        }
        Ok(())
    }

    /// How much of its opacity a point of the plane has, 0..=1: 0 outside.
    pub fn share(&self, value: f64, strength: f64) -> f64 {
        if value.is_nan() || strength.is_nan() {
            return 0.0;
        }
        // −1..=1 from side to side; halved, so that ±1e308 does not overflow.
        let across = |x: f64, [low, high]: [f64; 2]| {
            let middle = low / 2.0 + high / 2.0;
            (x / 2.0 - middle / 2.0) / (high / 2.0 - low / 2.0) * 2.0
        };
        let x = across(value, self.values);
        let y = across(strength, self.strengths);
        // From 0 in the middle to 1 at the border.
        let way = match self.shape {
            RegionShape::Rectangle if self.strengths[0] <= 0.0 => {
                x.abs().max(strength / self.strengths[1])
            }
            RegionShape::Rectangle => x.abs().max(y.abs()),
            RegionShape::Ellipse => x.hypot(y),
            RegionShape::Triangle if y <= -1.0 => f64::INFINITY,
            RegionShape::Triangle => (x.abs() / (0.5 + 0.5 * y)).max(y),
        };
        ((1.0 - way) / self.softness.max(LEAST_SOFTNESS)).clamp(0.0, 1.0)
    }
}

/// What several regions make of a point: their matter is mixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Painted {
    /// Extinction per unit distance, of all together.
    pub extinction: f64,
    /// Linear colour: the mean, by extinction.
    pub colour: [f64; 3],
}

/// The regions at a point of the plane; `by_value` is the linear colour of its value.
pub fn painted(regions: &[Region], value: f64, strength: f64, by_value: [f64; 3]) -> Painted {
    let mut sum = Painted { extinction: 0.0, colour: [0.0; 3] };
    for region in regions {
        let part = extinction_from_opacity(region.opacity * region.share(value, strength));
        let colour = region.colour.map_or(by_value, |colour| colour.to_linear().0);
        sum.extinction += part;
        sum.colour.iter_mut().zip(colour).for_each(|(sum, c)| *sum += part * c);
    }
    if sum.extinction > 0.0 {
        sum.colour = sum.colour.map(|c| c / sum.extinction);
    }
    sum
}

/// The values that any of the regions with opacity has, as few intervals from low to high.
pub fn values_of(regions: &[Region]) -> Vec<[f64; 2]> {
    let mut boxes: Vec<[f64; 2]> =
        regions.iter().filter(|r| r.opacity > 0.0).map(|r| r.values).collect();
    boxes.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut merged: Vec<[f64; 2]> = Vec::new();
    for [low, high] in boxes {
        match merged.last_mut() {
            Some(last) if low <= last[1] => last[1] = last[1].max(high),
            _ => merged.push([low, high]),
        }
    }
    merged
}

/// Whether regions mean something together.
///
/// # Errors
/// See [`RegionError`].
pub fn validate(regions: &[Region]) -> Result<(), RegionError> {
    if regions.len() > MOST_REGIONS {
        return Err(RegionError::Many { found: regions.len() });
    }
    regions.iter().try_for_each(Region::validate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region(shape: RegionShape) -> Region {
        Region {
            shape,
            values: [10.0, 30.0],
            strengths: [4.0, 8.0],
            softness: 0.5,
            opacity: 0.8,
            colour: None,
        }
    }

    #[test]
    fn each_shape_fills_its_box_and_nothing_outside() {
        for shape in RegionShape::ALL {
            let region = region(shape);
            for (value, strength) in [
                (9.9, 6.0),
                (30.1, 6.0),
                (20.0, 3.9),
                (20.0, 8.1),
                (f64::NAN, 6.0),
                (20.0, f64::NAN),
            ] {
                assert_eq!(region.share(value, strength), 0.0, "{shape:?} {value} {strength}");
            }
            assert_eq!(region.share(20.0, 5.99), 1.0, "{shape:?}");
        }
        let corner = |shape| region(shape).share(11.0, 4.2);
        assert!((corner(RegionShape::Rectangle) - 0.2).abs() < 1e-12);
        assert_eq!((corner(RegionShape::Ellipse), corner(RegionShape::Triangle)), (0.0, 0.0));
        // Halfway up a triangle is half as wide as its top.
        let triangle = region(RegionShape::Triangle);
        assert!((triangle.share(24.0, 6.0) - 0.4).abs() < 1e-12);
        assert_eq!((triangle.share(25.1, 6.0), triangle.share(15.01, 6.0) > 0.0), (0.0, true));
        assert_eq!(RegionShape::from_name("triangle"), Some(RegionShape::Triangle));
    }

    #[test]
    fn borders_are_as_soft_as_is_said_and_strength_0_is_none() {
        let mut square = Region { strengths: [0.0, 8.0], ..region(RegionShape::Rectangle) };
        assert_eq!((square.share(20.0, 0.0), square.share(20.0, 3.9)), (1.0, 1.0));
        assert!((square.share(20.0, 6.0) - 0.5).abs() < 1e-12);
        square.softness = 0.0;
        assert_eq!((square.share(20.0, 7.99), square.share(20.0, 8.01)), (1.0, 0.0));
        let wide = Region { values: [f64::MIN, f64::MAX], ..square };
        assert_eq!(wide.share(1e300, 0.0), 1.0);
    }

    #[test]
    fn matter_of_several_regions_is_mixed_by_extinction() {
        let red = Region { colour: Some(Srgb8([255, 0, 0])), ..region(RegionShape::Rectangle) };
        let plain = Region { opacity: 0.5, ..region(RegionShape::Ellipse) };
        let found = painted(&[red, plain], 20.0, 6.0, [0.0, 1.0, 0.0]);
        // 1 − α = 0.2 · 0.5.
        assert!((found.extinction - 10.0_f64.ln()).abs() < 1e-12);
        let share = 5.0_f64.ln() / 10.0_f64.ln();
        assert!((found.colour[0] - share).abs() < 1e-12 && (found.colour[1] - 1.0 + share) < 1e-12);
        let outside = painted(&[red, plain], 0.0, 6.0, [0.0, 1.0, 0.0]);
        assert_eq!((outside.extinction, outside.colour), (0.0, [0.0; 3]));
    }

    #[test]
    fn values_of_all_are_as_few_intervals_as_can_be() {
        let of = |values| Region { values, ..region(RegionShape::Ellipse) };
        let unseen = Region { opacity: 0.0, ..of([-5.0, 99.0]) };
        let all = [of([5.0, 7.0]), of([1.0, 2.0]), of([6.0, 9.0]), unseen, of([2.0, 3.0])];
        assert_eq!(values_of(&all), [[1.0, 3.0], [5.0, 9.0]]);
        assert!(values_of(&[]).is_empty());
    }

    #[test]
    fn what_is_no_region_is_refused() {
        let good = region(RegionShape::Ellipse);
        assert_eq!(good.validate(), Ok(()));
        for (bad, word) in [
            (Region { values: [3.0, 3.0], ..good }, "values as two numbers"),
            (Region { values: [f64::NAN, 3.0], ..good }, "values"),
            (Region { strengths: [-1.0, 3.0], ..good }, "not below 0, found -1 and 3"),
            (Region { strengths: [1.0, f64::INFINITY], ..good }, "strengths"),
            (Region { opacity: 1.5, ..good }, "opacity from 0 to 1, found 1.5"),
            (Region { softness: f64::NAN, ..good }, "softness"),
        ] {
            let refused = bad.validate().unwrap_err().to_string();
            assert!(refused.contains(word), "{word}: {refused}");
        }
        assert!(validate(&[good; MOST_REGIONS]).is_ok());
        let refused = validate(&[good; MOST_REGIONS + 1]).unwrap_err().to_string();
        assert!(refused.contains("at most 16 regions, found 17"), "{refused}");
    }
}

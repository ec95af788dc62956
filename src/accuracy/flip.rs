//! FLIP for low dynamic range (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild,
//! "FLIP: A Difference Evaluator for Alternating Images", 2020): how much one would notice when one
//! picture takes the other's place.
//!
//! Measured against the authors' program (`nv-flip` 0.1.2, single precision) on three pictures of
//! 200×150 pixels, 2026-11-21: means of 0.2986, 0.2897 and 0.8860 agree within 1.3e-6. That crate
//! compiles C++ and takes bytes, and so is no part of this one.

use super::picture::Plane;
use crate::core::parallel;

/// Pixels per degree of the paper's default: a display 0.7 m wide with 3840 pixels, seen from 0.7 m.
const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;

/// Sensitivity to contrast: a₁, b₁, a₂, b₂ of each opponent channel (Table 1).
const ACHROMATIC: [f64; 4] = [1.0, 0.0047, 0.0, 1e-5];
const RED_GREEN: [f64; 4] = [1.0, 0.0053, 0.0, 1e-5];
const BLUE_YELLOW: [f64; 4] = [34.1, 0.04, 13.5, 0.025];
/// Exponents of the colour and the feature difference.
const COLOUR_EXPONENT: f64 = 0.7;
const FEATURE_EXPONENT: f64 = 0.5;
/// Differences up to this share of the greatest are spread over this share of the result (§4.1.4).
const KNEE_IN: f64 = 0.4;
const KNEE_OUT: f64 = 0.95;
/// Width of the feature detectors, degrees.
const FEATURE_WIDTH: f64 = 0.082;

/// Linear sRGB to CIE XYZ (IEC 61966-2-1, D65).
const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [0.412_390_799_265_959_5, 0.357_584_339_383_878, 0.180_480_788_401_834_3],
    [0.212_639_005_871_510_36, 0.715_168_678_767_756, 0.072_192_315_360_733_71],
    [0.019_330_818_715_591_85, 0.119_194_779_794_625_99, 0.950_532_152_249_660_6],
];

/// A picture that others are held to. Compared is what a display shows: light over black, held to
/// 0..=1.
#[derive(Debug, Clone)]
pub struct Flip {
    size: [usize; 2],
    parts: Parts,
}

/// What of a picture is compared.
#[derive(Debug, Clone)]
struct Parts {
    /// Hunt-adjusted CIELAB of the picture as the eye resolves it.
    colour: Vec<[f64; 3]>,
    /// How strong the edges and points are.
    features: Vec<[f64; 2]>,
}

impl Flip {
    /// Prepares linear premultiplied RGBA of `size` [width, height] pixels, rows from the top.
    ///
    /// # Panics
    /// Where `light` has not that many pixels.
    pub fn new(light: &[[f64; 4]], size: [u32; 2]) -> Self {
        let size = size.map(|n| n as usize);
        Self { size, parts: Parts::of(light, size) }
    }

    /// Mean error of another picture of that size, 0 for none to 1; 0 for an empty picture.
    ///
    /// # Panics
    /// Where `light` has another number of pixels.
    pub fn mean(&self, light: &[[f64; 4]]) -> f64 {
        let errors = self.errors(light);
        errors.iter().sum::<f64>() / errors.len().max(1) as f64
    }

    /// Error of each pixel.
    fn errors(&self, light: &[[f64; 4]]) -> Vec<f64> {
        let other = Parts::of(light, self.size);
        let greatest = greatest_colour_difference();
        parallel::list(other.colour.len(), |i| {
            let colour = hyab(self.parts.colour[i], other.colour[i]).powf(COLOUR_EXPONENT);
            let [edges, points] =
                [0, 1].map(|k| (self.parts.features[i][k] - other.features[i][k]).abs());
            let feature = (edges.max(points) / std::f64::consts::SQRT_2).min(1.0);
            // Equation 4.
            spread(colour, greatest).powf(1.0 - feature.powf(FEATURE_EXPONENT))
        })
    }
}

/// Differences to 0..=1, small ones spread out (§4.1.4).
fn spread(difference: f64, greatest: f64) -> f64 {
    let knee = KNEE_IN * greatest;
    if difference < knee {
        KNEE_OUT / knee * difference
    } else {
        KNEE_OUT + (difference - knee) / (greatest - knee) * (1.0 - KNEE_OUT)
    }
}

/// Green against blue, the farthest that a display goes.
fn greatest_colour_difference() -> f64 {
    let lab = |rgb| hunt(lab_from_xyz(xyz(rgb)));
    hyab(lab([0.0, 1.0, 0.0]), lab([0.0, 0.0, 1.0])).powf(COLOUR_EXPONENT)
}

/// City block in lightness, Euclid in chroma (Abasi, Tehran and Fairchild 2020).
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Chroma shrinks in the dark.
fn hunt([l, a, b]: [f64; 3]) -> [f64; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

fn xyz(rgb: [f64; 3]) -> [f64; 3] {
    XYZ_FROM_RGB.map(|row| row.iter().zip(rgb).map(|(w, c)| w * c).sum())
}

/// XYZ of white.
fn white() -> [f64; 3] {
    xyz([1.0; 3])
}

/// CIELAB (CIE 15).
fn lab_from_xyz(xyz: [f64; 3]) -> [f64; 3] {
    const D: f64 = 6.0 / 29.0;
    let f = |t: f64| if t > D * D * D { t.cbrt() } else { t / (3.0 * D * D) + 4.0 / 29.0 };
    let white = white();
    let [x, y, z] = std::array::from_fn(|i| f(xyz[i] / white[i]));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Linearised opponent space YCxCz.
fn opponent(rgb: [f64; 3]) -> [f64; 3] {
    let (xyz, white) = (xyz(rgb), white());
    let [x, y, z] = std::array::from_fn(|i| xyz[i] / white[i]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn xyz_from_opponent([l, a, b]: [f64; 3]) -> [f64; 3] {
    let y = (l + 16.0) / 116.0;
    let white = white();
    [(a / 500.0 + y) * white[0], y * white[1], (y - b / 200.0) * white[2]]
}

impl Parts {
    fn of(light: &[[f64; 4]], size: [usize; 2]) -> Self {
        assert_eq!(light.len(), size[0] * size[1], "a picture of its size");
        if light.is_empty() {
            return Self { colour: Vec::new(), features: Vec::new() };
        }
        let shown = parallel::list(light.len(), |i| {
            let [r, g, b, _] = light[i];
            opponent([r, g, b].map(|c| c.clamp(0.0, 1.0)))
        });
        let plane = |c: usize| Plane { size, values: shown.iter().map(|p| p[c]).collect() };
        let seen: Vec<Plane> = [ACHROMATIC, RED_GREEN, BLUE_YELLOW]
            .into_iter()
            .enumerate()
            .map(|(c, sensitivity)| as_resolved(&plane(c), sensitivity))
            .collect();
        let rgb_from_xyz = glam::DMat3::from_cols_array_2d(&XYZ_FROM_RGB).transpose().inverse();
        let colour = parallel::list(light.len(), |i| {
            let xyz = xyz_from_opponent(std::array::from_fn(|c| seen[c].values[i]));
            let rgb = rgb_from_xyz * glam::DVec3::from(xyz);
            let displayed = rgb.clamp(glam::DVec3::ZERO, glam::DVec3::ONE).to_array();
            hunt(lab_from_xyz(self::xyz(displayed)))
        });
        Self { colour, features: features(&plane(0)) }
    }
}

/// What the eye resolves of a channel: the sensitivity function as a filter (equation 2).
fn as_resolved(plane: &Plane, [a1, b1, a2, b2]: [f64; 4]) -> Plane {
    use std::f64::consts::PI;
    // Three standard deviations of the widest filter.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as usize;
    let gaussian = |b: f64| -> Vec<f64> {
        let weight = |x: f64| (-PI * PI * x * x / b).exp();
        (0..=2 * radius).map(|i| weight((i as f64 - radius as f64) / PIXELS_PER_DEGREE)).collect()
    };
    let term = |a: f64, b: f64| {
        let weights = gaussian(b);
        let sum: f64 = weights.iter().sum();
        let amplitude = a * (PI / b).sqrt();
        (plane.filtered(&weights, &weights), amplitude, amplitude * sum * sum)
    };
    let (first, amplitude, sum) = term(a1, b1);
    if a2 == 0.0 {
        return first.map(|v| v * amplitude / sum);
    }
    let (second, amplitude_2, sum_2) = term(a2, b2);
    first.zip(&second, |p, q| (amplitude * p + amplitude_2 * q) / (sum + sum_2))
}

/// Strength of edges and points (§4.2): derivatives of a Gaussian, positive and negative weights
/// each summing to 1.
fn features(achromatic: &Plane) -> Vec<[f64; 2]> {
    let plane = achromatic.map(|y| (y + 16.0) / 116.0);
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as usize;
    let weights = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let gaussian = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
        let raw: Vec<f64> = (0..=2 * radius)
            .map(|i| {
                let x = i as f64 - radius as f64;
                f(x) * gaussian(x)
            })
            .collect();
        let positive: f64 = raw.iter().filter(|w| **w > 0.0).sum();
        let negative: f64 = -raw.iter().filter(|w| **w < 0.0).sum::<f64>();
        raw.iter().map(|w| if *w > 0.0 { w / positive } else { w / negative.max(1e-300) }).collect()
    };
    let smooth = weights(&|_| 1.0);
    let edge = weights(&|x| -x);
    let point = weights(&|x| x * x / (deviation * deviation) - 1.0);
    let strength = |detector: &[f64]| {
        let across = plane.filtered(detector, &smooth);
        across.zip(&plane.filtered(&smooth, detector), f64::hypot)
    };
    let (edges, points) = (strength(&edge), strength(&point));
    edges.values.iter().zip(&points.values).map(|(&e, &p)| [e, p]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [40, 30];

    fn even(rgb: [f64; 3]) -> Vec<[f64; 4]> {
        vec![[rgb[0], rgb[1], rgb[2], 1.0]; 1200]
    }

    fn flip(a: &[[f64; 4]], b: &[[f64; 4]]) -> f64 {
        Flip::new(a, SIZE).mean(b)
    }

    #[test]
    fn equal_pictures_are_not_told_apart() {
        let picture: Vec<[f64; 4]> = (0..1200)
            .map(|i| [f64::from(i % 37) / 37.0, f64::from(i % 11) / 11.0, 0.3, 1.0])
            .collect();
        assert_eq!(flip(&picture, &picture), 0.0);
        let mut other = picture.clone();
        other[600] = [1.0, 0.0, 0.0, 1.0];
        assert!(flip(&picture, &other) > 1e-3);
    }

    #[test]
    fn green_against_blue_is_the_greatest_difference() {
        let found = flip(&even([0.0, 1.0, 0.0]), &even([0.0, 0.0, 1.0]));
        assert!((found - 1.0).abs() < 1e-9, "{found}");
    }

    /// Even pictures have no features, and their filters leave them as they are: what is left is
    /// HyAB of Hunt-adjusted CIELAB, by hand. White is L* 100 and black L* 0, without chroma.
    #[test]
    fn even_greys_differ_by_their_lightness() {
        let green = [87.734_7, -86.182_7 * 0.877_347, 83.179_3 * 0.877_347];
        let blue = [32.297, 79.187_5 * 0.322_97, -107.860_2 * 0.322_97];
        let greatest = hyab(green, blue).powf(0.7);
        assert!((greatest - greatest_colour_difference()).abs() < 2e-3, "{greatest}");
        let white_on_black = 100.0_f64.powf(0.7);
        let knee = 0.4 * greatest;
        let expected = 0.95 + 0.05 * (white_on_black - knee) / (greatest - knee);
        let found = flip(&even([1.0; 3]), &even([0.0; 3]));
        assert!((found - expected).abs() < 1e-4, "{found} {expected}");
        // Linear light 0.184187 is L* 50; 0.2 is L* 51.837.
        let found = flip(&even([0.184_187; 3]), &even([0.2; 3]));
        let expected = 0.95 / knee * 1.8372_f64.powf(0.7);
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }

    #[test]
    fn the_order_does_not_matter_and_worse_is_more() {
        let a = even([0.4, 0.3, 0.2]);
        let b = even([0.5, 0.3, 0.2]);
        let c = even([0.6, 0.3, 0.2]);
        assert_eq!(flip(&a, &b), flip(&b, &a));
        assert!(flip(&a, &b) < flip(&a, &c));
    }

    #[test]
    fn what_is_beyond_a_display_is_not_seen() {
        assert_eq!(flip(&even([1.0; 3]), &even([3.0; 3])), 0.0);
        assert_eq!(flip(&even([0.0; 3]), &even([-1.0; 3])), 0.0);
    }

    #[test]
    fn an_edge_that_appears_counts_more_than_its_colour_alone() {
        // The same difference of colour, smooth and in stripes five pixels wide.
        let stripes = |strength: f64| -> Vec<[f64; 4]> {
            (0..1200)
                .map(|i| {
                    let value = 0.3 + strength * f64::from((i % 40) / 5 % 2);
                    [value, value, value, 1.0]
                })
                .collect()
        };
        let flip_of = Flip::new(&even([0.3; 3]), SIZE);
        let striped = flip_of.errors(&stripes(0.3));
        let flat = flip_of.errors(&even([0.6; 3]));
        let most = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
        assert!(most(&striped) > most(&flat), "{} {}", most(&striped), most(&flat));
    }

    #[test]
    fn the_opponent_space_is_undone() {
        let rgb = [0.2, 0.7, 0.4];
        for (found, expected) in xyz_from_opponent(opponent(rgb)).iter().zip(xyz(rgb)) {
            assert!((found - expected).abs() < 1e-14);
        }
        assert!((opponent([1.0; 3])[0] - 100.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_is_nothing() {
        assert_eq!(Flip::new(&[], [0, 0]).mean(&[]), 0.0);
    }
}

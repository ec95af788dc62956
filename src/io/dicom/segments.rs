//! What the numbers of a segmentation stand for (DICOM PS3.3, C.8.20.2).

use glam::{DMat3, DVec3};

use super::super::error::plain;
use super::dataset::Dataset;
use super::tags;
use crate::core::{LinearRgb, Srgb8};
use crate::volume::LabelName;

/// The names of a file's segments; none of other files.
pub(super) fn named(dataset: &Dataset) -> Vec<LabelName> {
    let named = |item: &Dataset| {
        Some(LabelName {
            component: 0,
            value: i64::from(item.short(tags::SEGMENT_NUMBER)?),
            name: plain(&item.text(tags::SEGMENT_LABEL)?),
            colour: item.shorts(tags::SEGMENT_COLOUR).map(colour),
        })
    };
    dataset.items(tags::SEGMENTS).iter().filter_map(named).collect()
}

/// The colour of CIE L*a*b* numbers (white of D50), each brought to 16 bits (PS3.3, C.10.7.1.1).
fn colour(lab: [u16; 3]) -> Srgb8 {
    /// From XYZ of D50 to sRGB in linear light (B. Lindbloom, Bradford-adapted), row by row.
    const TO_RGB: [[f64; 3]; 3] = [
        [3.133_856_1, -1.616_866_7, -0.490_614_6],
        [-0.978_768_4, 1.916_141_5, 0.033_454],
        [0.071_945_3, -0.228_991_4, 1.405_242_7],
    ];
    const WHITE: DVec3 = DVec3::new(0.964_22, 1.0, 0.825_21);
    let [l, a, b] = lab.map(|number| f64::from(number) / 65535.0);
    let (l, a, b) = (100.0 * l, 255.0 * a - 128.0, 255.0 * b - 128.0);
    let y = (l + 16.0) / 116.0;
    let light =
        |f: f64| if f > 6.0 / 29.0 { f.powi(3) } else { (116.0 * f - 16.0) * 27.0 / 24389.0 };
    let xyz = WHITE * DVec3::new(light(y + a / 500.0), light(y), light(y - b / 200.0));
    let rgb = DMat3::from_cols_array_2d(&TO_RGB).transpose() * xyz;
    LinearRgb(rgb.clamp(DVec3::ZERO, DVec3::ONE).to_array()).to_srgb()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_segments_are_those_that_lab_means() {
        let of = |l: f64, a: f64, b: f64| {
            let numbers = [l / 100.0, (a + 128.0) / 255.0, (b + 128.0) / 255.0];
            colour(numbers.map(|n| (n * 65535.0).round() as u16))
        };
        // sRGB's own white, black and primaries in L*a*b* of D50, as colour-management programs print them.
        for (lab, expected) in [
            ((100.0, 0.0, 0.0), [255, 255, 255]),
            ((0.0, 0.0, 0.0), [0, 0, 0]),
            ((54.29, 80.81, 69.89), [255, 0, 0]),
            ((87.82, -79.27, 80.99), [0, 255, 0]),
            ((29.57, 68.30, -112.03), [0, 0, 255]),
        ] {
            let Srgb8(found) = of(lab.0, lab.1, lab.2);
            let is_near = found.iter().zip(expected).all(|(a, b): (&u8, u8)| a.abs_diff(b) <= 3);
            assert!(is_near, "{lab:?} {found:?}");
        }
    }
}

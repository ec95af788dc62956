//! Colour: sRGB as people give it, linear light as it is composited (IEC 61966-2-1).

use serde::{Deserialize, Serialize};

/// A colour as written by a person: sRGB-encoded, 8 bits a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Srgb8(pub [u8; 3]);

/// A colour in linear light, each channel in 0..=1 for what a display can show.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LinearRgb(pub [f64; 3]);

impl Srgb8 {
    /// No light at all.
    pub const BLACK: Self = Self([0, 0, 0]);
    /// All the light a display has.
    pub const WHITE: Self = Self([255, 255, 255]);

    /// Reads `RRGGBB`, with or without a leading `#`; `None` for anything else.
    pub fn parse(text: &str) -> Option<Self> {
        let hex = text.strip_prefix('#').unwrap_or(text);
        if hex.len() != 6 || !hex.bytes().all(|b| b.is_ascii_hexdigit()) {
            return None;
        }
        let value = u32::from_str_radix(hex, 16).ok()?;
        let [_, r, g, b] = value.to_be_bytes();
        Some(Self([r, g, b]))
    }

    /// The encoded channels in 0..=1, as colour tables interpolate them.
    pub fn encoded(self) -> [f64; 3] {
        self.0.map(|c| f64::from(c) / 255.0)
    }

    /// The same colour in linear light.
    pub fn to_linear(self) -> LinearRgb {
        LinearRgb(self.encoded().map(linear_from_srgb))
    }
}

/// Decodes one sRGB channel in 0..=1 to linear light.
pub fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Encodes one channel of linear light in 0..=1 as sRGB.
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Lays premultiplied linear pixels over a background (`None`: nothing) and encodes them as sRGB
/// bytes with straight alpha, as `shaders/present.wgsl` does on the device.
pub fn srgb_bytes(light: &[[f32; 4]], background: Option<LinearRgb>) -> Vec<u8> {
    let (behind, there) =
        (background.unwrap_or_default().0, f64::from(u8::from(background.is_some())));
    let byte = |value: f64| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
    light
        .iter()
        .flat_map(|pixel| {
            let [r, g, b, a] = pixel.map(f64::from);
            let alpha = a + (1.0 - a) * there;
            let straight = |front: f64, behind: f64| {
                let light = front + behind * there * (1.0 - a);
                if alpha > 0.0 {
                    srgb_from_linear((light / alpha.max(1e-6)).clamp(0.0, 1.0))
                } else {
                    0.0
                }
            };
            [
                byte(straight(r, behind[0])),
                byte(straight(g, behind[1])),
                byte(straight(b, behind[2])),
                byte(alpha),
            ]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_undoes_decoding_for_every_byte() {
        for byte in 0..=255_u8 {
            let encoded = f64::from(byte) / 255.0;
            let back = srgb_from_linear(linear_from_srgb(encoded));
            assert!((back - encoded).abs() < 1e-7, "{byte}: {back}");
        }
    }

    #[test]
    fn the_middle_of_the_scale_is_a_fifth_of_the_light() {
        // sRGB 0.5 is 0.2140 in linear light.
        assert!((linear_from_srgb(0.5) - 0.214_041).abs() < 1e-6);
    }

    #[test]
    fn pixels_are_laid_over_the_background_or_keep_straight_alpha() {
        let half_red = [0.5, 0.0, 0.0, 0.5];
        let white = Some(LinearRgb([1.0; 3]));
        // Half red over white: linear (1, 0.5, 0.5).
        assert_eq!(srgb_bytes(&[half_red], white), [255, 188, 188, 255]);
        assert_eq!(srgb_bytes(&[half_red], None), [255, 0, 0, 128]);
        assert_eq!(srgb_bytes(&[[0.0; 4]], None), [0, 0, 0, 0]);
    }

    #[test]
    fn hex_colours_are_read_and_others_refused() {
        assert_eq!(Srgb8::parse("ff8000"), Some(Srgb8([255, 128, 0])));
        assert_eq!(Srgb8::parse("#00000a"), Some(Srgb8([0, 0, 10])));
        for bad in ["", "fff", "gg0000", "+12345", "ff80000", "ffé00"] {
            assert_eq!(Srgb8::parse(bad), None, "{bad}");
        }
    }
}

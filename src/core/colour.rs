//! Colour: sRGB as people give it, linear light as it is composited (IEC 61966-2-1).

use std::sync::LazyLock;

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
        LinearRgb(self.0.map(|byte| LIGHT_OF_BYTES[usize::from(byte)]))
    }
}

impl LinearRgb {
    /// The bytes that a display is given; what is beyond 0..=1 is clamped.
    pub fn to_srgb(self) -> Srgb8 {
        Srgb8(self.0.map(srgb_byte))
    }
}

/// Decodes one sRGB channel in 0..=1 to linear light.
pub fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The linear light of each byte of a channel.
pub static LIGHT_OF_BYTES: LazyLock<[f64; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear_from_srgb(byte as f64 / 255.0)));

/// Encodes one channel of linear light in 0..=1 as sRGB.
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The byte of a channel of linear light, rounded: what is beyond 0..=1 is clamped, what is no number is 0.
fn srgb_byte(linear: f64) -> u8 {
    (srgb_from_linear(linear.clamp(0.0, 1.0)).clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Bytes of linear light in single precision, without a power for each.
struct SrgbBytes {
    /// The byte at the lower end of each of [`SrgbBytes::CELLS`] equal parts of 0..=1.
    lowest: Vec<u8>,
    /// The least light that has the next byte.
    next: [f32; 256],
}

impl SrgbBytes {
    /// So many that no two bytes begin within one: where it is steepest sRGB rises by 12.92 × 255 bytes.
    const CELLS: u16 = 4096;

    fn new() -> Self {
        let cell = |n: u16| srgb_byte(f64::from(n) / f64::from(Self::CELLS));
        let next = std::array::from_fn(|byte| {
            // By halves of the bits: numbers that are not negative are in the order of theirs.
            let (mut below, mut from) = (0_u32, f32::INFINITY.to_bits());
            while byte < 255 && from - below > 1 {
                let middle = below + (from - below) / 2;
                let has = usize::from(srgb_byte(f64::from(f32::from_bits(middle)))) > byte;
                *(if has { &mut from } else { &mut below }) = middle;
            }
            f32::from_bits(from)
        });
        Self { lowest: (0..=Self::CELLS).map(cell).collect(), next }
    }

    fn byte(&self, light: f32) -> u8 {
        let light = light.clamp(0.0, 1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0..=1, or no number, which is 0"
        )]
        let lowest = self.lowest[(light * f32::from(Self::CELLS)) as usize];
        lowest + u8::from(light >= self.next[usize::from(lowest)])
    }
}

static SRGB_BYTES: LazyLock<SrgbBytes> = LazyLock::new(SrgbBytes::new);

/// What lays a premultiplied linear pixel over a background (`None`: nothing) and encodes it as sRGB bytes with
/// straight alpha, as `shaders/present.wgsl` does on the device.
pub fn srgb_encoder(background: Option<LinearRgb>) -> impl Fn(&[f32; 4]) -> [u8; 4] + Sync {
    let there = f32::from(u8::from(background.is_some()));
    #[expect(clippy::cast_possible_truncation, reason = "pixels are single precision, too")]
    let behind = background.unwrap_or_default().0.map(|channel| channel as f32);
    let table = &*SRGB_BYTES;
    move |&[r, g, b, a]| {
        let alpha = a + (1.0 - a) * there;
        let whole = if alpha > 0.0 { 1.0 / alpha.max(1e-6) } else { 0.0 };
        let rest = there * (1.0 - a);
        let straight = |front: f32, behind: f32| table.byte((front + behind * rest) * whole);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let alpha = (alpha.clamp(0.0, 1.0) * 255.0).round() as u8;
        [straight(r, behind[0]), straight(g, behind[1]), straight(b, behind[2]), alpha]
    }
}

/// The bytes of many pixels; see [`srgb_encoder`].
pub fn srgb_bytes(light: &[[f32; 4]], background: Option<LinearRgb>) -> Vec<u8> {
    light.iter().map(srgb_encoder(background)).collect::<Vec<_>>().into_flattened()
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
    fn bytes_without_powers_are_those_of_the_formula() {
        let table = SrgbBytes::new();
        let check = |light: f32| {
            assert_eq!(table.byte(light), srgb_byte(f64::from(light)), "{light:e}");
        };
        for n in 0..=1_000_003 {
            check(n as f32 / 1_000_003.0);
        }
        for next in table.next {
            for bits in next.to_bits() - 2..=next.to_bits() + 2 {
                check(f32::from_bits(bits));
            }
        }
        for odd in [-0.0, -1.0, 1.5, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-40] {
            check(odd);
        }
        assert_eq!([table.byte(0.0), table.byte(1.0)], [0, 255]);
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

//! The diverging map "cool–warm", computed as K. Moreland publishes it (*Diverging Color Maps for
//! Scientific Visualization*, 2009, §5): two colours are joined through a white by straight lines
//! in Msh, the polar form of CIE L*a*b*.

use crate::core::Srgb8;
use crate::core::colour::{linear_from_srgb, srgb_from_linear};

/// The map's two ends (Moreland §5).
const COOL: Srgb8 = Srgb8([59, 76, 192]);
const WARM: Srgb8 = Srgb8([180, 4, 38]);
/// Least magnitude M of the white in the middle.
const WHITE_M: f64 = 88.0;
/// Below this saturation a colour has no hue of its own, radians.
const UNSATURATED: f64 = 0.05;
/// D65 reference white.
const WHITE: [f64; 3] = [0.950_47, 1.0, 1.088_83];
/// XYZ from linear sRGB (IEC 61966-2-1), rows.
const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [0.412_453, 0.357_580, 0.180_423],
    [0.212_671, 0.715_160, 0.072_169],
    [0.019_334, 0.119_193, 0.950_227],
];
const RGB_FROM_XYZ: [[f64; 3]; 3] = [
    [3.240_479, -1.537_150, -0.498_535],
    [-0.969_256, 1.875_992, 0.041_556],
    [0.055_648, -0.204_043, 1.057_311],
];

/// Magnitude, saturation and hue, the angles in radians.
#[derive(Clone, Copy)]
struct Msh {
    m: f64,
    s: f64,
    h: f64,
}

/// `count` ≥ 2 colours, evenly spaced from cool to warm.
pub(super) fn cool_warm(count: usize) -> Vec<Srgb8> {
    let (cool, warm) = (msh_from_srgb(COOL), msh_from_srgb(WARM));
    let middle = Msh { m: cool.m.max(warm.m).max(WHITE_M), s: 0.0, h: 0.0 };
    (0..count)
        .map(|i| {
            let x = i as f64 / (count - 1) as f64;
            let half = if x < 0.5 {
                towards(cool, middle, 2.0 * x)
            } else {
                towards(warm, middle, 2.0 - 2.0 * x)
            };
            srgb_from_msh(half)
        })
        .collect()
}

/// From a saturated colour (0) to the white (1); the white takes a hue that keeps the path even.
fn towards(colour: Msh, white: Msh, x: f64) -> Msh {
    let white = Msh { h: hue_of_white(colour, white.m), ..white };
    let mix = |a: f64, b: f64| a * (1.0 - x) + b * x;
    Msh { m: mix(colour.m, white.m), s: mix(colour.s, white.s), h: mix(colour.h, white.h) }
}

/// Moreland's hue adjustment: spin the hue as far as the change in M asks for, away from purple.
fn hue_of_white(colour: Msh, white_m: f64) -> f64 {
    if colour.s < UNSATURATED || colour.m >= white_m {
        return colour.h;
    }
    let rise = (white_m * white_m - colour.m * colour.m).sqrt();
    let spin = colour.s * rise / (colour.m * colour.s.sin());
    if colour.h > -std::f64::consts::FRAC_PI_3 { colour.h + spin } else { colour.h - spin }
}

fn apply(matrix: [[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn msh_from_srgb(colour: Srgb8) -> Msh {
    let xyz = apply(XYZ_FROM_RGB, colour.encoded().map(linear_from_srgb));
    let f = |i: usize| {
        let t = xyz[i] / WHITE[i];
        if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 }
    };
    let (l, a, b) = (116.0 * f(1) - 16.0, 500.0 * (f(0) - f(1)), 200.0 * (f(1) - f(2)));
    let m = (l * l + a * a + b * b).sqrt();
    Msh { m, s: (l / m).acos(), h: b.atan2(a) }
}

fn srgb_from_msh(c: Msh) -> Srgb8 {
    let (l, a, b) = (c.m * c.s.cos(), c.m * c.s.sin() * c.h.cos(), c.m * c.s.sin() * c.h.sin());
    let y = (l + 16.0) / 116.0;
    let cube = |t: f64| if t > 0.206_893 { t.powi(3) } else { (t - 16.0 / 116.0) / 7.787 };
    let scaled = [a / 500.0 + y, y, y - b / 200.0];
    let xyz = std::array::from_fn(|i| WHITE[i] * cube(scaled[i]));
    Srgb8(apply(RGB_FROM_XYZ, xyz).map(|c| {
        let byte = (srgb_from_linear(c.clamp(0.0, 1.0)) * 255.0).round();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
        let byte = byte as u8;
        byte
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_runs_from_morelands_blue_by_his_grey_white_to_his_red() {
        let map = cool_warm(257);
        let near = |a: Srgb8, b: [u8; 3]| a.0.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1);
        assert!(near(map[0], COOL.0), "{:?}", map[0]);
        assert!(near(map[128], [221, 221, 221]), "{:?}", map[128]);
        assert!(near(map[256], WARM.0), "{:?}", map[256]);
        // From Moreland's table of 33.
        assert!(near(map[64], [141, 176, 254]), "{:?}", map[64]);
    }

    #[test]
    fn no_step_of_the_map_jumps() {
        for pair in cool_warm(256).windows(2) {
            let step = pair[0].0.iter().zip(pair[1].0).map(|(a, b)| a.abs_diff(b)).max();
            assert!(step <= Some(8), "{pair:?}");
        }
    }
}

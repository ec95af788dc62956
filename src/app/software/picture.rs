//! The engine's pictures on a window's pixels: what `shaders/picture.wgsl` does, by the processor.

use std::sync::LazyLock;

use super::super::painting::{Entry, Painted};
use super::triangle::{Bounds, Target, over};
use crate::core::enlarge::Taps;
use crate::task::engine::Picture;

/// The four channels of a pixel, 0 to 255.
type Levels = [f32; 4];

fn levels(rgba: &[u8]) -> Levels {
    [0, 1, 2, 3].map(|channel| f32::from(rgba[channel]))
}

/// Channels of 0 to 255, rounded.
fn channels(levels: Levels) -> [u32; 4] {
    /// Floats from here on, up to twice as large, are whole numbers, and the lowest bits are those of what was added.
    const WHOLE: f32 = 8_388_608.0;
    levels.map(|level| (level + WHOLE).to_bits() & 0xff)
}

/// A row of a picture at the columns of a tile, enlarged smoothly.
struct Rows<'a> {
    picture: &'a Picture,
    /// From the first sample that is needed on.
    taps: Vec<Taps>,
    /// The samples that the taps need, of four rows.
    along: Vec<Levels>,
    begin: usize,
}

/// The middle of a pixel of `length` from `begin` on, that show so many samples.
fn taps(pixel: usize, begin: i64, length: i64, samples: u32) -> Taps {
    let share = (pixel as f64 + 0.5 - begin as f64) / length.max(1) as f64;
    Taps::new(share * f64::from(samples) - 0.5, samples as usize)
}

impl<'a> Rows<'a> {
    fn new(picture: &'a Picture, columns: std::ops::Range<usize>, area: [i64; 4]) -> Self {
        let width = picture.size[0];
        let of = |x| taps(x, area[0], area[2] - area[0], width);
        let mut taps: Vec<Taps> = columns.map(of).collect();
        let begin = taps.first().map_or(0, |taps| taps.at[0]);
        let end = taps.last().map_or(0, |taps| taps.at[3] + 1);
        taps.iter_mut().for_each(|taps| taps.at = taps.at.map(|x| x - begin));
        Self { picture, taps, along: vec![[0.0; 4]; end - begin], begin }
    }

    /// The row that pixel `y` shows.
    fn at(&mut self, y: usize, area: [i64; 4]) {
        let [width, height] = self.picture.size;
        let taps = taps(y, area[1], area[3] - area[1], height);
        let rows = taps.at.map(|y| &self.picture.rgba[4 * (y * width as usize + self.begin)..]);
        for (x, pixel) in self.along.iter_mut().enumerate() {
            *pixel = taps.sum(rows.map(|row| levels(&row[4 * x..4 * x + 4])));
        }
    }

    #[inline(always)]
    fn pixel(&self, column: usize) -> Levels {
        let taps = &self.taps[column];
        taps.sum(taps.at.map(|x| self.along[x])).map(|level| level.clamp(0.0, 255.0))
    }
}

/// Light of encoded bytes, as sRGB defines it.
static LIGHT: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let encoded = byte as f32 / 255.0;
        if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    })
});

fn encoded(light: f32) -> u32 {
    let encoded =
        if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let byte = (encoded.clamp(0.0, 1.0) * 255.0).round() as u32;
    byte
}

/// How far two pixels are apart, in linear light, so many times as large.
fn difference(one: &[u8], other: &[u8], gain: f32) -> u32 {
    let light = |pixel: &[u8], channel: usize| {
        LIGHT[usize::from(pixel[channel])] * f32::from(pixel[3]) / 255.0
    };
    let apart = |channel| ((light(one, channel) - light(other, channel)).abs() * gain).min(1.0);
    (encoded(apart(0)) << 16) | (encoded(apart(1)) << 8) | encoded(apart(2))
}

/// Writes a pixel with straight alpha, over what is there where it has holes.
fn put(pixel: &mut u32, rgba: [u32; 4], blended: bool) {
    let [r, g, b, a] = rgba;
    let times = |channel: u32| (channel * a + 127) / 255;
    *pixel = match blended {
        false if a == 255 => (r << 16) | (g << 8) | b,
        false => (times(r) << 16) | (times(g) << 8) | times(b),
        true => over(*pixel, [times(r), times(g), times(b), a]),
    };
}

/// Paints what of a picture falls into `clip`; `area` is where all of it stands: left, top, right, bottom in pixels.
pub(super) fn paint_picture(
    target: &mut Target<'_>,
    clip: Bounds,
    area: [i64; 4],
    painted: &Painted,
) {
    let edge = |edge: i64| usize::try_from(edge.max(0)).unwrap_or(0);
    let clip = super::triangle::common(clip, area.map(edge));
    if clip[0] >= clip[2] || clip[1] >= clip[3] {
        return;
    }
    let picture = &*painted.picture;
    // A picture that came after its place was found may have another size for one frame.
    let fits = |picture: &Picture| {
        let size = picture.size.map(i64::from);
        size == [area[2] - area[0], area[3] - area[1]]
            && i64::try_from(picture.rgba.len()) == Ok(4 * size[0] * size[1])
    };
    let entry = match painted.entry {
        Entry::Exact | Entry::Difference
            if !fits(picture) || painted.other.as_deref().is_some_and(|other| !fits(other)) =>
        {
            Entry::Enlarged
        }
        entry => entry,
    };
    let blended = painted.blended;
    let exact = |picture: &'_ Picture, y: usize| {
        let (row, column) = (edge(y as i64 - area[1]), edge(clip[0] as i64 - area[0]));
        4 * (row * picture.size[0] as usize + column)
    };
    match (entry, &painted.other) {
        (Entry::Difference, Some(other)) => {
            for y in clip[1]..clip[3] {
                let (one, two) =
                    (&picture.rgba[exact(picture, y)..], &other.rgba[exact(other, y)..]);
                let texels = one.chunks_exact(4).zip(two.chunks_exact(4));
                for (pixel, (one, two)) in target.span(y, clip[0], clip[2]).iter_mut().zip(texels) {
                    *pixel = difference(one, two, painted.amount);
                }
            }
        }
        (Entry::Faded, Some(other)) => {
            let mut after = Rows::new(picture, clip[0]..clip[2], area);
            let mut before = Rows::new(other, clip[0]..clip[2], area);
            let share = painted.amount.clamp(0.0, 1.0);
            for y in clip[1]..clip[3] {
                after.at(y, area);
                before.at(y, area);
                for (n, pixel) in target.span(y, clip[0], clip[2]).iter_mut().enumerate() {
                    let (after, before) = (after.pixel(n), before.pixel(n));
                    let mixed = std::array::from_fn(|i| after[i] + (before[i] - after[i]) * share);
                    put(pixel, channels(mixed), blended);
                }
            }
        }
        (Entry::Enlarged, _) => {
            let mut rows = Rows::new(picture, clip[0]..clip[2], area);
            for y in clip[1]..clip[3] {
                rows.at(y, area);
                for (n, pixel) in target.span(y, clip[0], clip[2]).iter_mut().enumerate() {
                    put(pixel, channels(rows.pixel(n)), blended);
                }
            }
        }
        _ => {
            for y in clip[1]..clip[3] {
                let texels = picture.rgba[exact(picture, y)..].chunks_exact(4);
                for (pixel, texel) in target.span(y, clip[0], clip[2]).iter_mut().zip(texels) {
                    put(pixel, [0, 1, 2, 3].map(|channel| u32::from(texel[channel])), blended);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::core::colour::{linear_from_srgb, srgb_from_linear};
    use crate::scene::Backend;
    use crate::task::engine::FrameReport;
    use crate::task::level::LevelOfDetail;

    /// Bytes without an order that repeats.
    fn picture(size: [u32; 2], seed: u32, alpha: Option<u8>) -> Arc<Picture> {
        let bytes = (0..size[0] * size[1] * 4).map(|n| {
            let byte = ((n + seed).wrapping_mul(2_654_435_761) >> 24) as u8;
            if n % 4 == 3 { alpha.unwrap_or(byte) } else { byte }
        });
        let report = FrameReport::last(LevelOfDetail::FULL, 1, Backend::Tiles, 1.0);
        Arc::new(Picture { size, requested_size: size, rgba: bytes.collect(), report })
    }

    /// A channel of a picture at a pixel of `area`, by the cubic convolution kernel (Keys, equation 15).
    fn truth(picture: &Picture, pixel: [usize; 2], area: [i64; 4], channel: usize) -> f64 {
        let size = picture.size.map(i64::from);
        let at = |axis: usize| {
            let length = (area[axis + 2] - area[axis]) as f64;
            let share = (pixel[axis] as f64 + 0.5 - area[axis] as f64) / length;
            (share * size[axis] as f64 - 0.5).clamp(0.0, (size[axis] - 1) as f64)
        };
        let kernel = |s: f64| match s.abs() {
            s if s < 1.0 => 1.5 * s.powi(3) - 2.5 * s.powi(2) + 1.0,
            s if s < 2.0 => -0.5 * s.powi(3) + 2.5 * s.powi(2) - 4.0 * s + 2.0,
            _ => 0.0,
        };
        let around = |at: f64| (at.floor() as i64 - 2)..=(at.floor() as i64 + 3);
        let (x, y) = (at(0), at(1));
        let mut sum = 0.0;
        for row in around(y) {
            for column in around(x) {
                let (i, j) = (column.clamp(0, size[0] - 1), row.clamp(0, size[1] - 1));
                let sample = f64::from(picture.rgba[4 * (j * size[0] + i) as usize + channel]);
                sum += sample * kernel(x - column as f64) * kernel(y - row as f64);
            }
        }
        sum.clamp(0.0, 255.0)
    }

    /// The most that any pixel is from `expected`, levels.
    fn worst(
        painted: &Painted,
        area: [i64; 4],
        clip: Bounds,
        expected: impl Fn([usize; 2], usize) -> f64,
    ) -> f64 {
        let (width, height) = (90, 70);
        let mut pixels = vec![0x0040_8020; width * height];
        let mut target = Target { pixels: &mut pixels, width };
        // By tiles, as a window does.
        for left in (0..width).step_by(32) {
            let tile = [left, 0, (left + 32).min(width), height];
            paint_picture(&mut target, super::super::triangle::common(tile, clip), area, painted);
        }
        let mut worst = 0.0_f64;
        for (n, pixel) in pixels.iter().enumerate() {
            let (x, y) = (n % width, n / width);
            let inside = |axis: usize, at: usize| {
                at >= clip[axis]
                    && at < clip[axis + 2]
                    && (area[axis]..area[axis + 2]).contains(&(at as i64))
            };
            if !(inside(0, x) && inside(1, y)) {
                assert_eq!(*pixel, 0x0040_8020, "beyond its place: {x}, {y}");
                continue;
            }
            for channel in 0..3 {
                let found = f64::from((pixel >> (16 - 8 * channel)) & 0xff);
                worst = worst.max((found - expected([x, y], channel)).abs());
            }
        }
        worst
    }

    fn painted(picture: Arc<Picture>, other: Option<Arc<Picture>>, entry: Entry) -> Painted {
        Painted { picture, other, entry, amount: 0.3, blended: false }
    }

    const AREA: [i64; 4] = [-5, 3, 80, 66];
    const CLIP: Bounds = [2, 0, 77, 70];

    #[test]
    fn pictures_are_enlarged_by_cubic_convolution() {
        for size in [[13, 9], [1, 1], [85, 63], [200, 150]] {
            let one = picture(size, 7, Some(255));
            // Whoever thinks that it fits is no reason to read beyond it.
            let entry = if size == [13, 9] { Entry::Exact } else { Entry::Enlarged };
            let painted = painted(Arc::clone(&one), None, entry);
            let apart = worst(&painted, AREA, CLIP, |at, channel| truth(&one, at, AREA, channel));
            // Measured: 0.50, of bytes alone.
            assert!(apart <= 0.51, "{size:?}: {apart}");
            let moved = [-4, 3, 81, 66];
            let apart = worst(&painted, AREA, CLIP, |at, channel| truth(&one, at, moved, channel));
            assert!(apart > 8.0 || size == [1, 1], "{size:?}: it does not see a pixel's shift");
        }
    }

    #[test]
    fn pictures_of_the_same_size_are_byte_for_byte_and_fade_between() {
        let (one, two) = (picture([85, 63], 7, Some(255)), picture([85, 63], 9000, Some(255)));
        let of = |picture: &Picture, at: [usize; 2], channel: usize| {
            let [x, y] = [at[0] as i64 - AREA[0], at[1] as i64 - AREA[1]].map(|n| n as usize);
            f64::from(picture.rgba[4 * (y * 85 + x) + channel])
        };
        for entry in [Entry::Exact, Entry::Enlarged] {
            let painted = painted(Arc::clone(&one), None, entry);
            assert_eq!(worst(&painted, AREA, CLIP, |at, c| of(&one, at, c)), 0.0, "{entry:?}");
        }
        let faded = painted(Arc::clone(&one), Some(Arc::clone(&two)), Entry::Faded);
        let apart =
            worst(&faded, AREA, CLIP, |at, c| 0.7 * of(&one, at, c) + 0.3 * of(&two, at, c));
        assert!(apart <= 0.51, "{apart}");
        let apart = painted(Arc::clone(&one), Some(Arc::clone(&two)), Entry::Difference);
        let light = |byte: f64| linear_from_srgb(byte / 255.0);
        let found = worst(&apart, AREA, CLIP, |at, c| {
            let gap = (light(of(&one, at, c)) - light(of(&two, at, c))).abs();
            255.0 * srgb_from_linear((0.3 * gap).min(1.0))
        });
        assert!(found <= 0.51, "{found}");
    }

    #[test]
    fn holes_show_what_is_behind() {
        let one = picture([85, 63], 7, None);
        let painted = Painted { blended: true, ..painted(Arc::clone(&one), None, Entry::Exact) };
        let behind = [64.0, 128.0, 32.0];
        let apart = worst(&painted, AREA, CLIP, |at, c| {
            let alpha = truth(&one, at, AREA, 3) / 255.0;
            truth(&one, at, AREA, c) * alpha + behind[c] * (1.0 - alpha)
        });
        assert!(apart <= 1.01, "{apart}");
    }
}

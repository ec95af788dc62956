//! What pictures show of their error by themselves, and how far two are from one another.

use crate::accuracy::{self, CompareError};
use crate::core::colour::LIGHT_OF_BYTES;
use crate::scene::Background;
use crate::task::engine::Picture;

/// How fast what is lost may grow with the distance between pixels, as powers of it: linear
/// interpolation of what is smooth loses four times as much at twice the distance; noise, no more.
const GROWTH: [f64; 2] = [0.2, 2.0];
/// Pixels along each side that two pictures are compared at, at most.
const COMPARED_SIDE: u32 = 256;
/// Pixels of a picture that are looked at for its detail, about: 1 to 2 ms.
const MOST_PIXELS: usize = 1 << 16;

/// From one pixel to the next of those that are left of a finished picture, where it is found what leaving out the others costs.
const STEPS: [usize; 7] = [2, 3, 4, 6, 8, 12, 16];
/// Pixels that are left of it along each side, at least.
const LEAST_LEFT: usize = 32;

/// What leaving out pixels of a finished picture costs.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Losses {
    /// log₂ of the distance between the pixels that are left, ascending, and of the RMSE over RGB, linear light, of what is enlarged
    /// from them linearly.
    of_steps: Vec<[f64; 2]>,
}

impl Losses {
    /// Of a picture of every pixel; `size` and `rgba` as in [`Picture`]. 17 ms of 1280 × 800 pixels on
    /// a busy core.
    pub(super) fn of(size: [u32; 2], rgba: &[u8]) -> Self {
        let has_enough = |step: &usize| size.iter().all(|&n| n as usize >= step * LEAST_LEFT);
        let steps = STEPS.into_iter().filter(has_enough);
        let lost = steps.map(|step| [(step as f64).log2(), detail_rmse(size, rgba, step).log2()]);
        Self { of_steps: lost.filter(|[_, rmse]| rmse.is_finite()).collect() }
    }

    /// Of the same picture drawn `shrink` times smaller: RMSE. `None` where too little was found.
    pub(super) fn rmse(&self, shrink: f64) -> Option<f64> {
        let distance = shrink.log2();
        let next = self.of_steps.iter().position(|[step, _]| distance <= *step);
        let next = next.unwrap_or(self.of_steps.len().checked_sub(1)?).max(1);
        let [from, from_rmse] = *self.of_steps.get(next - 1)?;
        let [to, to_rmse] = *self.of_steps.get(next)?;
        let growth = (to_rmse - from_rmse) / (to - from);
        let growth = match (from..=to).contains(&distance) {
            true => growth,
            false => growth.clamp(GROWTH[0], GROWTH[1]),
        };
        Some((from_rmse + growth * (distance - from)).exp2())
    }
}

/// What a picture in part is off by, of which a share is drawn, where a coarse one of the same view was shown before it,
/// thought to be off by so much: as much as the two differ, less what that one lacks where the part has it.
pub(in crate::task) fn part_rmse(part: &Picture, done: f64, coarse: Option<&Picture>) -> f64 {
    let known = coarse.and_then(|coarse| Some((coarse, coarse.report.estimated_rmse?)));
    let found = known.and_then(|(coarse, rmse)| {
        let differ = shown_rmse(part, coarse).ok()?;
        let of_rest = differ * differ - done * rmse * rmse;
        // Nor is it nearer than a picture of which as much were coarse.
        Some(of_rest.max((1.0 - done) * rmse * rmse).sqrt())
    });
    found.unwrap_or_else(|| {
        // As bright as what is there.
        let light = light_rms(Background::Transparent, &part.rgba);
        light * ((1.0 - done) / done.max(1e-3)).sqrt()
    })
}

/// RMSE between two pictures as they are shown at the size they were asked for: sRGB bytes enlarged
/// linearly, then taken as linear premultiplied light over RGB; at up to 256² pixels.
///
/// # Errors
/// Where a picture is empty or incomplete.
pub fn shown_rmse(first: &Picture, second: &Picture) -> Result<f64, CompareError> {
    let light = &*LIGHT_OF_BYTES;
    let size = second.requested_size;
    accuracy::rmse(&sampled(first, size, light)?, &sampled(second, size, light)?)
}

/// What a picture that is enlarged linearly is thought to be off by for lack of pixels: RMSE over RGB,
/// linear light. By what leaving out every second pixel of it, and two of three, would cost, with as much
/// growth from no pixel left out to the first as from the first to the second. `size` and `rgba` as in
/// [`Picture`].
///
/// Exact pictures of three scans at every 4th to 10th pixel, and of four demos at every 2nd to 5th, were
/// off by as much within 1.6 dB rms (0.4 dB better in the mean, 5.2 worse at worst).
pub fn sampling_rmse(size: [u32; 2], rgba: &[u8]) -> f64 {
    let [second, third] = [2, 3].map(|step| detail_rmse(size, rgba, step));
    let growth = (third / second).ln() / 1.5_f64.ln();
    // Nothing lost, or too few pixels to tell.
    if !growth.is_finite() {
        return second;
    }
    second / growth.clamp(GROWTH[0], GROWTH[1]).exp2()
}

/// Root mean square over RGB of what a picture's light is beyond its background's, linear; at up to
/// [`MOST_PIXELS`] pixels.
pub(super) fn light_rms(background: Background, rgba: &[u8]) -> f64 {
    let behind = background.light().map_or([0.0; 3], |colour| colour.0);
    let light = &*LIGHT_OF_BYTES;
    let step = (rgba.len() / 4).div_ceil(MOST_PIXELS).max(1);
    let pixels = rgba.chunks_exact(4).step_by(step);
    let count = pixels.len().max(1) as f64;
    let square =
        |(c, behind): (usize, f64), pixel: &[u8]| (light[usize::from(pixel[c])] - behind).powi(2);
    let squares: f64 = pixels
        .flat_map(|pixel| behind.into_iter().enumerate().map(move |of| (of, pixel)))
        .map(|(of, pixel)| square(of, pixel))
        .sum();
    (squares / (3.0 * count)).sqrt()
}

/// What leaving out all but every `step`-th pixel of a picture, in both directions, would cost: RMSE over
/// RGB, linear light, of what is enlarged from them linearly against the picture itself. 0 for
/// pictures of fewer than four pixels a side.
fn detail_rmse(size: [u32; 2], rgba: &[u8], step: usize) -> f64 {
    let [width, height] = size.map(|n| n as usize);
    if width < 4 || height < 4 || rgba.len() != width * height * 4 {
        return 0.0;
    }
    let light = &*LIGHT_OF_BYTES;
    // Pixels between the middles of the first and the last whole block.
    let middle = step / 2;
    let [columns, rows] = [width, height].map(|n| middle..=(n / step - 1) * step + middle);
    let share = |at: usize| ((at - middle) % step) as f64 / step as f64;
    // Rows at all distances from those that are kept.
    let mut row_step = (width * height).div_ceil(MOST_PIXELS);
    while !is_coprime(row_step, step) {
        row_step += 1;
    }
    let byte = |x: usize, y: usize, c: usize| f64::from(rgba[(y * width + x) * 4 + c]);
    let (mut squares, mut count) = (0.0, 0.0);
    for y in rows.step_by(row_step) {
        let (top, down) = ((y - middle) / step * step + middle, share(y));
        let bottom = if down > 0.0 { top + step } else { top };
        for x in columns.clone() {
            let (left, across) = ((x - middle) / step * step + middle, share(x));
            let right = if across > 0.0 { left + step } else { left };
            for c in 0..3 {
                let row = |y| byte(left, y, c) + (byte(right, y, c) - byte(left, y, c)) * across;
                let mixed = row(top) + (row(bottom) - row(top)) * down;
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a byte"
                )]
                let off = light[(mixed + 0.5) as usize] - light[byte(x, y, c) as usize];
                squares += off * off;
                count += 1.0;
            }
        }
    }
    (squares / f64::max(count, 1.0)).sqrt()
}

fn is_coprime(a: usize, b: usize) -> bool {
    if b == 0 { a == 1 } else { is_coprime(b, a % b) }
}

/// The light of a picture at the centres of evenly spaced pixels of `size`.
fn sampled(
    picture: &Picture,
    size: [u32; 2],
    light: &[f64],
) -> Result<Vec<[f64; 4]>, CompareError> {
    let [width, height] = picture.size.map(|n| n as usize);
    if picture.rgba.len() != width * height * 4 {
        let (first, second) = (picture.rgba.len() / 4, width * height);
        return Err(CompareError::Size { first, second });
    }
    if picture.rgba.is_empty() || size.contains(&0) {
        return Err(CompareError::Empty);
    }
    let [across, down] = [0, 1].map(|axis| positions(size[axis], picture.size[axis]));
    let texel = |x: usize, y: usize| -> [f64; 4] {
        let at = (y * width + x) * 4;
        std::array::from_fn(|channel| f64::from(picture.rgba[at + channel]))
    };
    let decode = |pixel: [f64; 4]| {
        let alpha = pixel[3] / 255.0;
        let lit = |byte: f64| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
            let low = byte as usize;
            let (low, high) = (light[low], light[(low + 1).min(255)]);
            (low + (high - low) * byte.fract()) * alpha
        };
        [lit(pixel[0]), lit(pixel[1]), lit(pixel[2]), alpha]
    };
    let mix = |a: [f64; 4], b: [f64; 4], share: f64| -> [f64; 4] {
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * share)
    };
    let row = |&(top, bottom, share): &(usize, usize, f64)| {
        let pixel = |&(left, right, beside): &(usize, usize, f64)| {
            let above = mix(texel(left, top), texel(right, top), beside);
            let below = mix(texel(left, bottom), texel(right, bottom), beside);
            decode(mix(above, below, share))
        };
        across.iter().map(pixel).collect::<Vec<_>>()
    };
    Ok(down.iter().flat_map(row).collect())
}

/// For evenly spaced pixels of `shown`, the two of `stored` around each centre and the share of the
/// second.
fn positions(shown: u32, stored: u32) -> Vec<(usize, usize, f64)> {
    let count = shown.min(COMPARED_SIDE);
    let last = stored as usize - 1;
    (0..count)
        .map(|i| {
            // The centre of a whole pixel, so that a picture of that size is taken as it is.
            let pixel = (f64::from(i) + 0.5) * f64::from(shown) / f64::from(count);
            let centre = pixel.floor() + 0.5;
            let x = centre * f64::from(stored) / f64::from(shown) - 0.5;
            let x = x.clamp(0.0, last as f64);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=last")]
            let left = x as usize;
            (left, (left + 1).min(last), x.fract())
        })
        .collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::core::colour::linear_from_srgb;
    use crate::scene::Backend;
    use crate::task::engine::FrameReport;
    use crate::task::level::LevelOfDetail;

    pub(in crate::task::estimate) fn picture(
        size: [u32; 2],
        requested_size: [u32; 2],
        pixel: impl Fn(u32, u32) -> u8,
    ) -> Picture {
        let rgba = (0..size[1])
            .flat_map(|y| (0..size[0]).map(move |x| (x, y)))
            .flat_map(|(x, y)| [pixel(x, y), pixel(x, y), pixel(x, y), 255])
            .collect();
        let report = FrameReport::last(LevelOfDetail::FULL, 1, Backend::Raster, 1.0);
        Picture { size, requested_size, rgba, report }
    }

    #[test]
    fn detail_is_what_two_thirds_of_the_pixels_add() {
        let detail = |picture: Picture| detail_rmse(picture.size, &picture.rgba, 3);
        let grey = |of: fn(u32, u32) -> u8| detail(picture([32, 23], [64, 46], of));
        assert_eq!(grey(|_, _| 90), 0.0);
        assert_eq!(detail(picture([3, 20], [6, 40], |x, _| (x * 50) as u8)), 0.0, "too few");
        // Bytes along a ramp are met by interpolation, in both directions.
        assert_eq!(grey(|x, y| (3 * x + 2 * y) as u8), 0.0);
        // A line of light beside the pixels that are kept is lost: one of 28 columns.
        let line = grey(|x, _| if x == 12 { 255 } else { 0 });
        assert!((line - (1.0_f64 / 28.0).sqrt()).abs() < 1e-9, "{line}");
        let row = grey(|_, y| if y == 12 { 255 } else { 0 });
        assert!((row - (1.0_f64 / 19.0).sqrt()).abs() < 1e-9, "{row}");
    }

    /// Of large pictures some rows are looked at, whose distances from those that are kept are as of all.
    #[test]
    fn what_lines_across_lose_is_found_in_large_pictures() {
        for step in [2, 3, 4] {
            let lines = |height: u32| {
                let lines = picture([640, height], [640, height], |_, y| {
                    (128.0 + 100.0 * (f64::from(y) / 2.5).sin()) as u8
                });
                detail_rmse(lines.size, &lines.rgba, step)
            };
            let [small, large] = [100, 400].map(lines);
            assert!((large / small - 1.0).abs() < 0.1, "{step}: {small} {large}");
        }
    }

    /// What is lost at any size follows from what is lost at a few.
    #[test]
    fn losses_of_a_finished_picture_are_those_of_smaller_ones() {
        let rings = |x: u32, y: u32| {
            let [x, y] = [x, y].map(|n| f64::from(n) - 97.0);
            (128.0 + 100.0 * (x.hypot(1.3 * y) / 7.0).sin()) as u8
        };
        let full = picture([320, 240], [320, 240], rings);
        let losses = Losses::of(full.size, &full.rgba);
        assert_eq!(losses.of_steps.len(), 4, "five or more leave too few: {losses:?}");
        for (step, within) in [(2_u8, 1e-9), (3, 1e-9), (5, 0.1), (7, 0.25)] {
            let (told, is) = (
                losses.rmse(f64::from(step)),
                detail_rmse(full.size, &full.rgba, usize::from(step)),
            );
            let told = told.unwrap();
            assert!((told / is - 1.0).abs() < within, "{step}: {told} {is}");
        }
        assert!(losses.rmse(1.2).unwrap() < losses.rmse(2.0).unwrap());
        let flat = picture([320, 240], [320, 240], |_, _| 90);
        assert_eq!(Losses::of(flat.size, &flat.rgba).rmse(2.0), None, "nothing is lost");
        assert_eq!(Losses::of([80, 60], &[0; 80 * 60 * 4]).rmse(2.0), None, "too few pixels");
    }

    /// Every fourth pixel of a picture, and what that has lost.
    #[test]
    fn what_is_lost_is_told_from_a_small_picture_alone() {
        fn estimated_and_true(of: fn(u32, u32) -> u8) -> [f64; 2] {
            let fine = picture([320, 240], [320, 240], of);
            let middles = |x: u32, y: u32| of(4 * x + 2, 4 * y + 2);
            let every_fourth = (0..60_u32)
                .flat_map(|y| (0..80).map(move |x| (x, y)))
                .flat_map(|(x, y)| [middles(x, y), middles(x, y), middles(x, y), 255])
                .collect::<Vec<u8>>();
            [sampling_rmse([80, 60], &every_fourth), detail_rmse(fine.size, &fine.rgba, 4)]
        }
        let [smooth, lost] = estimated_and_true(|x, y| {
            let wave = (f64::from(x) / 13.0).sin() * (f64::from(y) / 17.0).cos();
            (128.0 + 100.0 * wave) as u8
        });
        // Measured: 0.77.
        assert!((smooth / lost - 1.0).abs() < 0.25, "{smooth} {lost}");
        let [noise, lost] = estimated_and_true(|x, y| {
            let hash = x.wrapping_mul(374_761_393).wrapping_add(y.wrapping_mul(668_265_263));
            ((hash ^ hash >> 13).wrapping_mul(1_274_126_177) >> 24) as u8
        });
        // Measured: 0.75.
        assert!((noise / lost - 1.0).abs() < 0.3, "{noise} {lost}");
    }

    #[test]
    fn equal_pictures_differ_by_nothing_and_others_by_their_light() {
        let grey = picture([40, 30], [40, 30], |_, _| 128);
        assert_eq!(shown_rmse(&grey, &grey), Ok(0.0));
        let black = picture([40, 30], [40, 30], |_, _| 0);
        let expected = linear_from_srgb(128.0 / 255.0);
        assert!((shown_rmse(&grey, &black).unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn a_small_picture_is_compared_as_it_is_enlarged() {
        let small = picture([5, 5], [40, 40], |_, _| 200);
        let large = picture([40, 40], [40, 40], |_, _| 200);
        assert_eq!(shown_rmse(&small, &large), Ok(0.0));
        let edge = picture([40, 40], [40, 40], |x, _| if x < 20 { 0 } else { 200 });
        let soft = picture([5, 5], [40, 40], |x, _| if x < 3 { 0 } else { 200 });
        let rmse = shown_rmse(&soft, &edge).unwrap();
        assert!((0.05..0.4).contains(&rmse), "{rmse}");
    }

    #[test]
    fn large_pictures_are_compared_at_whole_pixels_only() {
        // Lines one pixel wide would blur between pixels.
        let lines = picture([1000, 700], [1000, 700], |x, _| if x % 2 == 0 { 0 } else { 255 });
        assert_eq!(shown_rmse(&lines, &lines), Ok(0.0));
        let shifted = picture([1000, 700], [1000, 700], |x, _| if x % 2 == 1 { 0 } else { 255 });
        let rmse = shown_rmse(&lines, &shifted).unwrap();
        assert!((rmse - 1.0).abs() < 1e-12, "{rmse}");
    }

    #[test]
    fn pictures_that_are_none_are_refused() {
        let good = picture([4, 4], [4, 4], |_, _| 1);
        let mut bad = picture([4, 4], [4, 4], |_, _| 1);
        bad.rgba.pop();
        assert!(matches!(shown_rmse(&bad, &good), Err(CompareError::Size { .. })));
        let none = picture([0, 0], [4, 4], |_, _| 1);
        assert_eq!(shown_rmse(&none, &good), Err(CompareError::Empty));
    }

    /// A part is held to what was shown before it.
    #[test]
    fn a_picture_in_part_is_off_by_what_it_lacks() {
        let fine = |x: u32, y: u32| (40 + 3 * x + (y % 7) * 8) as u8;
        let full = picture([64, 48], [64, 48], fine);
        let mut coarse = picture([64, 48], [64, 48], |x, y| fine(x, y).saturating_add(6));
        coarse.report.estimated_rmse = Some(shown_rmse(&coarse, &full).unwrap());
        for rows in [6, 24, 45] {
            let done = f64::from(rows) / 48.0;
            let part = picture([64, 48], [64, 48], |x, y| if y < rows { fine(x, y) } else { 0 });
            let is = shown_rmse(&part, &full).unwrap();
            let told = part_rmse(&part, done, Some(&coarse));
            // Measured: 0.92 to 1.1.
            assert!((told / is - 1.0).abs() < 0.2, "{rows}: {told} {is}");
            // Nothing was shown: as bright as what is there. Measured: 0.98 to 1.02.
            let alone = part_rmse(&part, done, None);
            assert!((alone / is - 1.0).abs() < 0.2, "{rows}: {alone} {is}");
        }
        assert_eq!(part_rmse(&full, 1.0, None), 0.0);
    }
}

//! Annotations painted into a finished picture.

use glam::DVec2;

use super::lettering;
use crate::core::Srgb8;
use crate::scene::annotations::{Area, Ink, Layout, Primitive};
use crate::scene::{Annotations, Scene, lay_out_annotations};

/// How far the halo of words reaches beyond them, ems, and pixels at least.
const HALO: f64 = 0.12;
const LEAST_HALO: f64 = 1.3;
/// Places around each letter from which its halo is made.
const AROUND: usize = 12;
/// The greatest part of a picture's width that is left to scalar bars.
const MOST_OF_BARS: f64 = 0.2;

/// Annotations of a scene's picture of `size` pixels, laid out with the font that files are lettered
/// with. `space` is what the file calls its space.
pub fn laid_out(
    annotations: Annotations,
    scene: &Scene,
    space: Option<&str>,
    size: [u32; 2],
) -> Layout {
    lay_out_annotations(annotations, scene, space, size, &lettering::width)
}

/// Of a scene's picture the width and height in which a view of everything lies beside the scalar bars, if these are asked for. As much
/// as they take is left at the other side, too, so that what is seen stays in the middle however it is turned.
pub fn beside_bars(annotations: Annotations, scene: &Scene, size: [u32; 2]) -> [f64; 2] {
    let bars = Annotations { scalar_bar: annotations.scalar_bar, ..Annotations::NONE };
    let [width, height] = size.map(f64::from);
    // What stands over them may reach farther: there is less to be hidden near a corner.
    let lefts = laid_out(bars, scene, None, size).primitives.into_iter().filter_map(|primitive| {
        let Primitive::Rectangle { area, .. } = primitive else { return None };
        Some(area.low.x)
    });
    let bars = width - lefts.fold(width, f64::min);
    [width - 2.0 * bars.min(MOST_OF_BARS * width), height]
}

/// Paints annotations over a picture of straight sRGB bytes, `size` [width, height] pixels.
pub fn draw(rgba: &mut [u8], size: [u32; 2], primitives: &[Primitive]) {
    let mut picture = Picture { rgba, size: size.map(i64::from) };
    for primitive in primitives {
        match primitive {
            Primitive::Line { ends, width, ink } => picture.line(*ends, *width, *ink),
            Primitive::Dot { centre, radius, ink } => {
                picture.line([*centre, *centre], 2.0 * radius, *ink);
            }
            Primitive::Rectangle { area, ink } => picture.rectangle(*area, *ink),
            Primitive::Text { at, size, text, ink, halo } => {
                picture.text((*at, *size), text, *ink, *halo);
            }
        }
    }
}

/// How far the halo of words of a size reaches beyond them, pixels.
pub fn halo_reach(em: f64) -> f64 {
    (HALO * em).max(LEAST_HALO)
}

struct Picture<'a> {
    rgba: &'a mut [u8],
    /// Columns and rows.
    size: [i64; 2],
}

#[expect(clippy::cast_possible_truncation, reason = "pixels of a picture")]
fn whole(value: f64) -> i64 {
    value as i64
}

impl Picture<'_> {
    /// Lays an ink over a share of a pixel.
    fn lay(&mut self, column: i64, row: i64, ink: Ink, share: f64) {
        let inside = (0..self.size[0]).contains(&column) && (0..self.size[1]).contains(&row);
        if !inside || share <= 0.0 {
            return;
        }
        let index = usize::try_from((row * self.size[0] + column) * 4).unwrap_or(usize::MAX - 4);
        if let Some(pixel) = self.rgba.get_mut(index..index + 4) {
            lay_over(pixel, ink.colour, ink.opacity * share.min(1.0));
        }
    }

    /// A line with round ends: each pixel by its middle's distance.
    fn line(&mut self, [a, b]: [DVec2; 2], width: f64, ink: Ink) {
        // Lines thinner than a pixel are paler instead.
        let (radius, pale) = ((width / 2.0).max(0.5), width.clamp(0.0, 1.0));
        let ink = Ink { opacity: ink.opacity * pale, ..ink };
        let reach = radius + 0.5;
        let along = b - a;
        let length2 = along.length_squared();
        let distance = |p: DVec2| {
            let share =
                if length2 > 0.0 { ((p - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
            (p - a - along * share).length()
        };
        let [top, bottom] = [a.y.min(b.y) - reach, a.y.max(b.y) + reach];
        let last_row = whole(bottom.floor()).min(self.size[1] - 1);
        for row in whole(top.floor()).max(0)..=last_row {
            // Of the line only what is near this row, and not all of the rectangle around it.
            let y = row as f64 + 0.5;
            let shares = [y - reach, y + reach].map(|y| (y - a.y) / along.y);
            let [from, to] = match shares {
                [p, q] if along.y != 0.0 && p.is_finite() && q.is_finite() => {
                    [p.min(q).clamp(0.0, 1.0), p.max(q).clamp(0.0, 1.0)]
                }
                _ => [0.0, 1.0],
            };
            let ends = [from, to].map(|share| a.x + along.x * share);
            let first = whole((ends[0].min(ends[1]) - reach).floor()).max(0);
            let last = whole((ends[0].max(ends[1]) + reach).floor()).min(self.size[0] - 1);
            for column in first..=last {
                let share = reach - distance(DVec2::new(column as f64 + 0.5, y));
                self.lay(column, row, ink, share.clamp(0.0, 1.0));
            }
        }
    }

    fn rectangle(&mut self, area: Area, ink: Ink) {
        let share = |axis: usize, pixel: i64| {
            let (low, high) = (area.low[axis], area.high[axis]);
            (high.min(pixel as f64 + 1.0) - low.max(pixel as f64)).clamp(0.0, 1.0)
        };
        let span = |axis: usize| {
            let last = whole(area.high[axis].ceil()).min(self.size[axis]);
            whole(area.low[axis].floor()).max(0)..last
        };
        let (columns, rows) = (span(0), span(1));
        for row in rows {
            for column in columns.clone() {
                self.lay(column, row, ink, share(0, column) * share(1, row));
            }
        }
    }

    fn text(&mut self, (at, em): (DVec2, f64), text: &str, ink: Ink, halo: Ink) {
        let reach = halo_reach(em);
        let Some(mask) =
            lettering::mask(text, at, em, whole(reach.ceil()).unsigned_abs() as u32 + 1)
        else {
            return;
        };
        let around: Vec<[i64; 2]> = (0..AROUND)
            .flat_map(|i| {
                let angle = i as f64 / AROUND as f64 * std::f64::consts::TAU;
                // Half as far, too, so that wide halos have no holes.
                [1.0, 0.5].map(|part| {
                    let to = DVec2::from_angle(angle) * reach * part;
                    [whole(to.x.round()), whole(to.y.round())]
                })
            })
            .collect();
        for row in 0..mask.size[1] as i64 {
            for column in 0..mask.size[0] as i64 {
                let (x, y) = (mask.corner[0] + column, mask.corner[1] + row);
                let near = around.iter().map(|[dx, dy]| mask.at(x + dx, y + dy));
                let near = near.fold(mask.at(x, y), f32::max);
                self.lay(x, y, halo, f64::from(near));
            }
        }
        for row in 0..mask.size[1] as i64 {
            for column in 0..mask.size[0] as i64 {
                let (x, y) = (mask.corner[0] + column, mask.corner[1] + row);
                // As the interface has it: what is half covered would look too thin.
                let cover = f64::from(mask.at(x, y));
                self.lay(x, y, ink, cover * (2.0 - cover));
            }
        }
    }
}

/// Lays a colour over a pixel of straight alpha, as screens do: in sRGB.
pub(super) fn lay_over(pixel: &mut [u8], colour: Srgb8, opacity: f64) {
    let behind = f64::from(pixel[3]) / 255.0 * (1.0 - opacity);
    let alpha = opacity + behind;
    if alpha <= 0.0 {
        return;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
    let byte = |value: f64| value.round().clamp(0.0, 255.0) as u8;
    for (channel, line) in pixel.iter_mut().zip(colour.0) {
        *channel = byte((f64::from(line) * opacity + f64::from(*channel) * behind) / alpha);
    }
    pixel[3] = byte(alpha * 255.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    const INK: Ink = Ink { colour: Srgb8::WHITE, opacity: 1.0 };

    /// Red of each pixel of a black picture with something painted into it.
    fn painted(size: [u32; 2], primitives: &[Primitive]) -> Vec<u8> {
        let mut rgba = [0, 0, 0, 255].repeat((size[0] * size[1]) as usize);
        draw(&mut rgba, size, primitives);
        rgba.chunks(4).map(|pixel| pixel[0]).collect()
    }

    fn line(a: [f64; 2], b: [f64; 2], width: f64) -> Primitive {
        Primitive::Line { ends: [a.into(), b.into()], width, ink: INK }
    }

    #[test]
    fn lines_have_their_width_in_any_direction_and_end_where_they_do() {
        for (a, b) in
            [([5.0, 30.0], [55.0, 30.0]), ([30.5, 5.0], [30.5, 55.0]), ([8.0, 9.0], [52.0, 40.0])]
        {
            for width in [0.5, 1.0, 2.0, 5.0] {
                let ink: f64 =
                    painted([60, 60], &[line(a, b, width)]).iter().map(|v| f64::from(*v)).sum();
                let length = DVec2::from(a).distance(DVec2::from(b));
                // A band with half a disc at either end; a pixel is the least width of those.
                let round = width.max(1.0);
                let pale = width.min(1.0);
                let expected = length * width + pale * std::f64::consts::PI * round * round / 4.0;
                assert!(
                    (ink / 255.0 / expected - 1.0).abs() < 0.05,
                    "{a:?} {width}: {}",
                    ink / 255.0
                );
            }
        }
        // Outside the picture nothing happens.
        assert!(painted([4, 4], &[line([-90.0, 3.0], [-5.0, 900.0], 3.0)]).iter().all(|v| *v == 0));
    }

    #[test]
    fn dots_are_discs_and_rectangles_are_sharp_where_they_meet_pixels() {
        let dot = Primitive::Dot { centre: DVec2::new(20.0, 20.0), radius: 8.0, ink: INK };
        let ink: f64 = painted([40, 40], &[dot]).iter().map(|v| f64::from(*v) / 255.0).sum();
        assert!((ink / (64.0 * std::f64::consts::PI) - 1.0).abs() < 0.02, "{ink}");
        let area = Area { low: DVec2::new(1.0, 1.0), high: DVec2::new(2.5, 3.0) };
        let found = painted([4, 4], &[Primitive::Rectangle { area, ink: INK }]);
        assert_eq!(found, [0, 0, 0, 0, 0, 255, 128, 0, 0, 255, 128, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn words_can_be_read_over_their_own_colour() {
        let halo = Ink { colour: Srgb8::BLACK, opacity: 0.75 };
        let (at, text) = (DVec2::new(6.0, 24.0), "8".to_owned());
        let words = Primitive::Text { at, size: 24.0, text, ink: INK, halo };
        let mut rgba = vec![255; 32 * 32 * 4];
        draw(&mut rgba, [32, 32], &[words]);
        let darkest = rgba.chunks(4).map(|pixel| pixel[0]).min();
        assert_eq!(darkest, Some(64), "the halo");
        assert!(rgba[..4 * 32 * 3].iter().all(|byte| *byte == 255), "and no farther");
        let stem = rgba.chunks(4).filter(|pixel| pixel[0] == 255).count();
        assert!(stem > 32 * 32 / 2, "{stem}");
    }

    #[test]
    fn over_nothing_ink_is_what_is_there() {
        let mut rgba = vec![0; 4];
        let area = Area { low: DVec2::ZERO, high: DVec2::ONE };
        let ink = Ink { colour: Srgb8([10, 20, 30]), opacity: 0.5 };
        draw(&mut rgba, [1, 1], &[Primitive::Rectangle { area, ink }]);
        assert_eq!(rgba, [10, 20, 30, 128]);
    }
}

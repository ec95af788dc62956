//! Words as pixels: how wide they are, and what of each pixel they cover.
//!
//! The font is the interface's own (Ubuntu Light, which its licence lets anyone pass on): pictures look
//! alike on every machine, and need no system font.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, point};
use glam::DVec2;

static FONT: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok());

/// Width of words, ems.
pub fn width(text: &str) -> f64 {
    let Some(font) = FONT.as_ref() else { return 0.0 };
    advances(font, text).last().map_or(0.0, |(_, _, end)| end)
}

/// The glyphs of words, each with where it begins and where the next one does, ems.
fn advances(font: &FontRef<'_>, text: &str) -> impl Iterator<Item = (GlyphId, f64, f64)> {
    let per_em = f64::from(font.units_per_em().unwrap_or(1000.0));
    let mut at = 0.0;
    text.chars().map(move |letter| {
        let glyph = font.glyph_id(letter);
        let begin = at;
        at += f64::from(font.h_advance_unscaled(glyph)) / per_em;
        (glyph, begin, at)
    })
}

/// Coverage of a rectangle of pixels, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mask {
    /// Column and row of its first pixel on the picture; may be negative.
    pub(super) corner: [i64; 2],
    /// Columns and rows.
    pub(super) size: [usize; 2],
    /// 0..=1 for each pixel.
    pub(super) cover: Vec<f32>,
}

impl Mask {
    /// The coverage of a pixel of the picture; 0 outside.
    pub(super) fn at(&self, column: i64, row: i64) -> f32 {
        let [x, y] = [column - self.corner[0], row - self.corner[1]];
        match (usize::try_from(x), usize::try_from(y)) {
            (Ok(x), Ok(y)) if x < self.size[0] && y < self.size[1] => {
                self.cover[y * self.size[0] + x]
            }
            _ => 0.0,
        }
    }
}

/// What words cover whose baseline begins at `at`, with ems of so many pixels, and `margin` more
/// pixels of nothing around them. `None` for what has no outline, or is larger than a picture may be.
pub(super) fn mask(text: &str, at: DVec2, em: f64, margin: u32) -> Option<Mask> {
    let font = FONT.as_ref()?;
    // Its scale is of ascent and descent together, not of the em.
    let per_em = font.units_per_em().unwrap_or(1000.0);
    #[expect(clippy::cast_possible_truncation, reason = "pixels")]
    let scale = em as f32 * font.height_unscaled() / per_em;
    let outlines: Vec<_> = advances(font, text)
        .filter_map(|(glyph, begin, _)| {
            let left = at.x + begin * em;
            #[expect(clippy::cast_possible_truncation, reason = "pixels of a picture")]
            let place = point(left as f32, at.y as f32);
            font.outline_glyph(glyph.with_scale_and_position(scale, place))
        })
        .collect();
    let bounds = outlines.iter().map(|outline| outline.px_bounds());
    let bounds = bounds.reduce(|a, b| ab_glyph::Rect {
        min: point(a.min.x.min(b.min.x), a.min.y.min(b.min.y)),
        max: point(a.max.x.max(b.max.x), a.max.y.max(b.max.y)),
    })?;
    let margin = i64::from(margin);
    #[expect(clippy::cast_possible_truncation, reason = "whole pixels")]
    let [left, top, right, bottom] = [
        bounds.min.x.floor() as i64 - margin,
        bounds.min.y.floor() as i64 - margin,
        bounds.max.x.ceil() as i64 + margin,
        bounds.max.y.ceil() as i64 + margin,
    ];
    let size = [usize::try_from(right - left).ok()?, usize::try_from(bottom - top).ok()?];
    let mut mask =
        Mask { corner: [left, top], size, cover: vec![0.0; size[0].checked_mul(size[1])?] };
    for outline in outlines {
        let corner = outline.px_bounds().min;
        #[expect(clippy::cast_possible_truncation, reason = "whole pixels")]
        let corner = [corner.x as i64 - left, corner.y as i64 - top];
        outline.draw(|x, y, cover| {
            let [x, y] = [corner[0] + i64::from(x), corner[1] + i64::from(y)];
            if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y))
                && x < size[0]
                && let Some(pixel) = mask.cover.get_mut(y * size[0] + x)
            {
                *pixel = (*pixel + cover).min(1.0);
            }
        });
    }
    Some(mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_that_annotations_write_is_in_the_font() {
        let font = FONT.as_ref().expect("the font can be read");
        for letter in "0123456789.\u{2212}\u{d7}xyzLRAPSI()°…,".chars() {
            assert_ne!(font.glyph_id(letter).0, 0, "{letter}");
        }
    }

    #[test]
    fn words_lie_on_their_baseline_and_are_as_wide_as_said() {
        let (em, at) = (40.0, DVec2::new(10.0, 50.0));
        let mask = mask("100", at, em, 0).unwrap();
        let inked = |row: i64| (0..200).map(|x| f64::from(mask.at(x, row))).sum::<f64>();
        // Figures stand on the line (round ones reach a little below) and are 0.7 ems high.
        assert!(inked(49) > 2.0 && inked(51) == 0.0, "{} {}", inked(49), inked(51));
        let top = (0..100).find(|&row| inked(row) > 0.5).unwrap();
        assert!((50 - top - 28).abs() <= 1, "{top}");
        let right = (0..300).rev().find(|&x| (0..100).any(|y| mask.at(x, y) > 0.0)).unwrap();
        let expected = 10.0 + em * width("100");
        assert!((right as f64) < expected && right as f64 > expected - 0.15 * em, "{right}");
        assert!((width("1111") - 4.0 * width("1")).abs() < 1e-12);
        assert_eq!(width(""), 0.0);
        assert!(super::mask("  ", at, em, 3).is_none());
    }
}

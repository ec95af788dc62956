//! A round length in world units.

use glam::DVec2;

use super::MARGIN;
use super::primitives::{Area, FIGURE, Sheet};
use super::ticks::{Number, round_below};
use crate::core::Camera;

/// Greatest length of the bar, as a part of the picture's width.
const MOST: f64 = 0.22;
/// Greatest width of its words, as a part of the same.
const MOST_WORDS: f64 = 0.6;
/// Half the height of the marks at its ends, ems.
const END: f64 = 0.3;
/// Distance of its words, ems.
const ABOVE: f64 = 0.6;

/// Room around it that nothing else comes into, ems.
const APART: f64 = 0.6;

/// Height of what stands at the lower edge of the picture, with its margin, ems.
pub(super) const HEIGHT: f64 = MARGIN + END + ABOVE + FIGURE;

/// Lays it out in the lower right corner; whether there is room.
///
/// In perspective lengths are what they are only at the focal plane, and the words say so.
/// Without a unit of the file's the length is one of units.
pub(super) fn lay_out(sheet: &mut Sheet<'_>, camera: &Camera, unit: Option<&str>) -> bool {
    let (em, size) = (sheet.em, sheet.picture.size());
    let scale = camera.pixels_per_unit(size.y);
    let Some(length) = round_below(MOST * size.x / scale) else { return false };
    let pixels = length * scale;
    let number = Number::alone(length);
    let place = match camera.eye_distance() {
        None => "",
        Some(_) => " at the focal plane",
    };
    let unit = unit.unwrap_or(if length == 1.0 { "unit" } else { "units" });
    let words = format!(" {unit}{place}");
    let width = sheet.number_width(&number) + em * (sheet.width_of)(&words);
    let right = (size.x - MARGIN * em).round();
    let y = (size.y - (MARGIN + END) * em).round();
    let middle = right - width.max(pixels) / 2.0;
    let at = DVec2::new((middle - width / 2.0).round(), y - ABOVE * em);
    let ends = [-pixels, pixels].map(|p| DVec2::new(middle + p / 2.0, y));
    let top = at.y - FIGURE * em;
    let area =
        Area { low: DVec2::new(at.x.min(ends[0].x), top), high: DVec2::new(right, y + END * em) };
    if width > MOST_WORDS * size.x || !sheet.is_free(&area) {
        return false;
    }
    // Its words are not to be read on into those of an axis.
    sheet.take(area.grown(APART * em));
    let (ink, hair) = (sheet.inks.ink, sheet.hair());
    let up = DVec2::new(0.0, END * em);
    for line in [[ends[0] - up, ends[0] + up], [ends[1] - up, ends[1] + up], ends] {
        sheet.line(line, 1.5 * hair, ink);
    }
    sheet.number(at, &number, ink);
    let beyond = DVec2::new(sheet.number_width(&number), 0.0);
    sheet.words(at + beyond, &words, 1.0, ink);
    true
}

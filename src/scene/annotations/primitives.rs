//! What annotations are painted from: lines, dots, rectangles and words, in pixels.

use glam::DVec2;

use super::ticks::Number;
use crate::core::Srgb8;

/// A colour and how much of it is laid over what is there, as screens do: in sRGB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ink {
    /// The colour.
    pub colour: Srgb8,
    /// 0..=1.
    pub opacity: f64,
}

/// One thing to be painted, over those before it. Pixels from the upper left corner, y down.
#[derive(Debug, Clone, PartialEq)]
pub enum Primitive {
    /// A straight line with round ends.
    Line {
        /// Where it begins and ends.
        ends: [DVec2; 2],
        /// Pixels.
        width: f64,
        /// Its colour.
        ink: Ink,
    },
    /// A disc.
    Dot {
        /// Its middle.
        centre: DVec2,
        /// Pixels.
        radius: f64,
        /// Its colour.
        ink: Ink,
    },
    /// An upright rectangle.
    Rectangle {
        /// What it covers.
        area: Area,
        /// Its colour.
        ink: Ink,
    },
    /// Words on one line.
    Text {
        /// Where the baseline begins.
        at: DVec2,
        /// Pixels of an em.
        size: f64,
        /// The words.
        text: String,
        /// Their colour.
        ink: Ink,
        /// What is around them, so that they can be read over anything.
        halo: Ink,
    },
}

/// An upright rectangle, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// The upper left corner.
    pub low: DVec2,
    /// The lower right one.
    pub high: DVec2,
}

impl Area {
    /// From its upper left corner and its size.
    pub fn new(low: DVec2, size: DVec2) -> Self {
        Self { low, high: low + size }
    }

    /// Width and height.
    pub fn size(&self) -> DVec2 {
        self.high - self.low
    }

    /// With so much more on every side.
    #[must_use]
    pub fn grown(&self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    /// Whether two have a point in common.
    pub fn meets(&self, other: &Self) -> bool {
        self.low.cmplt(other.high).all() && other.low.cmplt(self.high).all()
    }

    /// Whether the other lies within.
    pub fn holds(&self, other: &Self) -> bool {
        self.low.cmple(other.low).all() && other.high.cmple(self.high).all()
    }

    /// The part of a line within (its ends as shares of it), if any.
    pub fn part_of(&self, [a, b]: [DVec2; 2]) -> Option<[f64; 2]> {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let (start, step) = (a[axis], b[axis] - a[axis]);
            let (low, high) = (self.low[axis], self.high[axis]);
            if step == 0.0 {
                if start < low || start > high {
                    return None;
                }
                continue;
            }
            let (p, q) = ((low - start) / step, (high - start) / step);
            enter = enter.max(p.min(q));
            leave = leave.min(p.max(q));
        }
        (enter < leave).then_some([enter, leave])
    }
}

/// Colours that can be read over a background.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inks {
    /// Words and lines.
    pub(super) ink: Ink,
    /// What is around them.
    pub(super) halo: Ink,
    /// The three axes.
    pub(super) axes: [Ink; 3],
}

impl Inks {
    /// Light ones, for dark pictures and those with nothing behind, or dark ones.
    pub(super) fn over(background: Option<Srgb8>) -> Self {
        let opaque = |rgb| Ink { colour: Srgb8(rgb), opacity: 1.0 };
        let [r, g, b] = background.map_or([0.0; 3], |colour| colour.to_linear().0);
        // Relative luminance: a mid grey in between has contrast with either.
        let is_light = 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.18;
        if is_light {
            Self {
                ink: opaque([24, 27, 32]),
                halo: Ink { colour: Srgb8::WHITE, opacity: 0.75 },
                axes: [[168, 44, 32], [44, 112, 32], [30, 84, 176]].map(opaque),
            }
        } else {
            Self {
                ink: opaque([226, 229, 234]),
                halo: Ink { colour: Srgb8::BLACK, opacity: 0.75 },
                axes: [[226, 122, 110], [139, 195, 120], [112, 160, 226]].map(opaque),
            }
        }
    }
}

/// What is being laid out: primitives, and the room that they have taken.
pub(super) struct Sheet<'a> {
    /// The picture.
    pub(super) picture: Area,
    /// Pixels of an em of ordinary words.
    pub(super) em: f64,
    pub(super) inks: Inks,
    /// Width of words, ems.
    pub(super) width_of: &'a dyn Fn(&str) -> f64,
    pub(super) primitives: Vec<Primitive>,
    pub(super) taken: Vec<Area>,
}

/// Size of raised figures, and how far they stand above the baseline, ems.
const RAISED: f64 = 0.7;
const RAISED_BY: f64 = 0.38;
/// Height of figures, ems: what is centred is centred by them.
pub(super) const FIGURE: f64 = 0.7;
/// Distance of words that do not touch, ems.
const APART: f64 = 0.25;

impl<'a> Sheet<'a> {
    pub(super) fn new(
        size: [u32; 2],
        em: f64,
        inks: Inks,
        width_of: &'a dyn Fn(&str) -> f64,
    ) -> Self {
        let picture = Area::new(DVec2::ZERO, DVec2::from(size.map(f64::from)));
        Self { picture, em, inks, width_of, primitives: Vec::new(), taken: Vec::new() }
    }

    /// Width of a hair line, pixels: one, and more in large pictures.
    pub(super) fn hair(&self) -> f64 {
        (self.em / 12.0).max(1.0)
    }

    /// Takes room that nothing else is to be put into.
    pub(super) fn take(&mut self, area: Area) {
        self.taken.push(area);
    }

    /// Room that has been taken.
    pub(super) fn taken(&self) -> impl Iterator<Item = &Area> {
        self.taken.iter()
    }

    /// Whether words would have an area of the picture to themselves.
    pub(super) fn is_free(&self, area: &Area) -> bool {
        let apart = area.grown(APART * self.em);
        self.picture.holds(area) && self.taken.iter().all(|taken| !taken.meets(&apart))
    }

    /// What has been laid out so far, to be returned to.
    pub(super) fn mark(&self) -> [usize; 2] {
        [self.primitives.len(), self.taken.len()]
    }

    /// Takes back what was laid out since.
    pub(super) fn return_to(&mut self, [primitives, taken]: [usize; 2]) {
        self.primitives.truncate(primitives);
        self.taken.truncate(taken);
    }

    /// Width of a number, pixels.
    pub(super) fn number_width(&self, number: &Number) -> f64 {
        self.em * ((self.width_of)(&number.text) + RAISED * (self.width_of)(&number.raised))
    }

    /// Size of a number as placing it counts it, pixels.
    pub(super) fn number_size(&self, number: &Number) -> DVec2 {
        DVec2::new(self.number_width(number), FIGURE * self.em)
    }

    /// Words whose baseline begins at a place; `scale` in ordinary ems.
    pub(super) fn words(&mut self, at: DVec2, text: &str, scale: f64, ink: Ink) {
        if text.is_empty() {
            return;
        }
        self.primitives.push(Primitive::Text {
            at,
            size: self.em * scale,
            text: text.to_owned(),
            ink,
            halo: self.inks.halo,
        });
    }

    /// A number whose baseline begins at a place.
    pub(super) fn number(&mut self, at: DVec2, number: &Number, ink: Ink) {
        self.scaled_number(at, number, 1.0, ink);
    }

    /// The same; `scale` in ordinary ems.
    pub(super) fn scaled_number(&mut self, at: DVec2, number: &Number, scale: f64, ink: Ink) {
        self.words(at, &number.text, scale, ink);
        let em = scale * self.em;
        let beyond = DVec2::new(em * (self.width_of)(&number.text), -RAISED_BY * em);
        self.words(at + beyond, &number.raised, RAISED * scale, ink);
    }

    /// A line that can be seen over anything.
    pub(super) fn line(&mut self, ends: [DVec2; 2], width: f64, ink: Ink) {
        let halo = Ink { opacity: 0.5 * self.inks.halo.opacity * ink.opacity, ..self.inks.halo };
        let around = width + 2.0 * self.hair();
        self.primitives.push(Primitive::Line { ends, width: around, ink: halo });
        self.primitives.push(Primitive::Line { ends, width, ink });
    }

    /// A rectangle.
    pub(super) fn rectangle(&mut self, area: Area, ink: Ink) {
        self.primitives.push(Primitive::Rectangle { area, ink });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_of_a_line_within_an_area_is_found_from_any_side() {
        let area = Area::new(DVec2::ZERO, DVec2::new(10.0, 10.0));
        let part = |a: [f64; 2], b: [f64; 2]| area.part_of([a.into(), b.into()]);
        assert_eq!(part([-10.0, 5.0], [30.0, 5.0]), Some([0.25, 0.5]));
        assert_eq!(part([5.0, 2.0], [5.0, 4.0]), Some([0.0, 1.0]));
        assert_eq!(part([11.0, 0.0], [11.0, 4.0]), None);
        assert_eq!(part([-4.0, 8.0], [4.0, 16.0]), None, "past a corner");
    }

    #[test]
    fn inks_have_contrast_with_what_they_are_over() {
        let light = |c: Srgb8| {
            let [r, g, b] = c.to_linear().0;
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for grey in 0..=255 {
            let background = Srgb8([grey; 3]);
            let inks = Inks::over(Some(background));
            for ink in [inks.ink].into_iter().chain(inks.axes) {
                // WCAG's contrast of words to their halo, which is nearly opaque.
                let [a, b] = [ink.colour, inks.halo.colour].map(light);
                let contrast = (a.max(b) + 0.05) / (a.min(b) + 0.05);
                assert!(contrast > 4.5, "{ink:?} over {grey}: {contrast}");
            }
        }
        assert_eq!(Inks::over(None).halo.colour, Srgb8::BLACK);
    }
}

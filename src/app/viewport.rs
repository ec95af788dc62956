//! The picture on screen: which, where, and what is seen beside it.
//!
//! A picture of the size that was asked for is shown pixel for pixel on a rectangle of whole
//! physical pixels. Other sizes are enlarged smoothly. A second picture of the same size can stand
//! beside it, or be subtracted from it.

use std::sync::{Arc, Mutex};

use eframe::egui::{
    Color32, ColorImage, Context, Painter, Pos2, Rect, TextureHandle, TextureOptions, pos2, vec2,
};

pub use super::painting::ScreenFormat;
use super::painting::{PaintPicture, Part, Shown, lock};
use super::theme;
use crate::task::engine::{Picture, SecondPicture};

/// One pixel in so many is a speck.
const SPECKS: usize = 20_000;
/// Side of a square of the checkerboard that stands for no background, points.
const CHECKER_POINTS: f32 = 10.0;

/// A rectangle on screen made of whole physical pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelArea {
    /// Where it is, in points; its corners lie on pixel corners.
    pub rect: Rect,
    /// Its size in physical pixels, each at least 1.
    pub size: [u32; 2],
}

impl PixelArea {
    /// The whole physical pixels that cover `rect` best, for a screen of `pixels_per_point`.
    pub fn covering(rect: Rect, pixels_per_point: f32) -> Self {
        let corner = |p: Pos2| [p.x, p.y].map(|c| (c * pixels_per_point).round());
        let (min, max) = (corner(rect.min), corner(rect.max));
        let side = |axis: usize| {
            let pixels = (max[axis] - min[axis]).clamp(1.0, 16_384.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            let whole = pixels as u32;
            whole
        };
        let size = [side(0), side(1)];
        let min = pos2(min[0] / pixels_per_point, min[1] / pixels_per_point);
        let extent = vec2(size[0] as f32, size[1] as f32) / pixels_per_point;
        Self { rect: Rect::from_min_size(min, extent), size }
    }

    /// Left, top, width and height in physical pixels; what is beyond the screen's edge is 0.
    pub fn pixels(&self, pixels_per_point: f32) -> [u32; 4] {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole, ≥ 0")]
        let whole = |points: f32| (points * pixels_per_point).round().max(0.0) as u32;
        [whole(self.rect.min.x), whole(self.rect.min.y), self.size[0], self.size[1]]
    }
}

/// The picture on screen.
pub struct Viewport {
    /// What the window's surface holds; `None` where the processor paints it.
    screen_format: Option<ScreenFormat>,
    checker: Option<TextureHandle>,
    /// Shared with what was queued for painting: a picture that comes in the same pass is shown
    /// by it.
    shown: Arc<Mutex<Option<Shown>>>,
    /// What is still seen of the picture before.
    fading: Option<Fading>,
}

/// A picture that gives way to the one shown.
#[derive(Clone)]
struct Fading {
    from: Arc<Picture>,
    begun_secs: f64,
}

/// How long one picture takes to give way to the next, seconds.
const FADE_SECS: f64 = 0.15;

/// How a second picture is shown with the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Beside {
    /// To the right of this share of the width.
    Split(f32),
    /// Subtracted from the first, the difference this many times as large.
    Difference(f32),
}

impl Viewport {
    /// Shows nothing yet, on an adapter's surface of `screen_format`, or by the processor.
    pub fn new(screen_format: Option<ScreenFormat>) -> Self {
        Self { screen_format, checker: None, shown: Arc::default(), fading: None }
    }

    /// The picture on screen, if there is one.
    pub fn picture(&self) -> Option<Arc<Picture>> {
        lock(&self.shown).as_ref().map(|shown| Arc::clone(&shown.picture))
    }

    /// The colour of the picture on screen, where all pixels have one, but for specks.
    pub fn only_colour(&self) -> Option<[u8; 4]> {
        lock(&self.shown).as_ref()?.only_colour
    }

    /// Shows `picture` from now on; what was queued for painting in this pass shows it already.
    /// Whether another pass is needed because its place changed.
    ///
    /// A picture whose bytes do not fill its size is our own bug: it is logged and passed over.
    pub fn accept(&mut self, picture: Arc<Picture>) -> bool {
        let size = picture.size.map(|n| n as usize);
        if size.contains(&0) || picture.rgba.len() != size[0] * size[1] * 4 {
            log::error!("a picture of {size:?} pixels came with {} bytes", picture.rgba.len());
            return false;
        }
        let pixels = picture.rgba.as_chunks::<4>().0;
        let has_holes = pixels.iter().any(|pixel| pixel[3] != 255);
        let others = pixels.iter().filter(|pixel| **pixel != pixels[0]).count();
        let only_colour = (others * SPECKS < pixels.len()).then_some(pixels[0]);
        let place = |shown: &Shown| (shown.picture.requested_size, shown.has_holes);
        let shown = Shown { picture, has_holes, only_colour };
        self.fading = None;
        let mut slot = lock(&self.shown);
        let moved = slot.as_ref().map(place) != Some(place(&shown));
        *slot = Some(shown);
        moved
    }

    /// The same, but that the picture shown before gives way to it little by little from `now_secs`
    /// on, where both fill the same place.
    pub fn accept_fading(&mut self, picture: Arc<Picture>, now_secs: f64) -> bool {
        // What has not yet gone is left out: one picture gives way at a time.
        let from = self.picture();
        let moved = self.accept(picture);
        let begun_secs = now_secs;
        self.fading = from.filter(|_| !moved).map(|from| Fading { from, begun_secs });
        moved
    }

    /// What is still seen of the picture before, 0..=1, and whether that will change by itself.
    pub fn fade(&mut self, now_secs: f64) -> Option<f32> {
        let begun_secs = self.fading.as_ref()?.begun_secs;
        let share = 1.0 - (now_secs - begun_secs) / FADE_SECS;
        if !(0.0..=1.0).contains(&share) {
            self.fading = None;
            return None;
        }
        #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
        let share = share as f32;
        Some(share)
    }

    /// Whether a picture gives way to the next at `now_secs`.
    pub fn is_fading(&self, now_secs: f64) -> bool {
        let is_under_way = |fading: &Fading| now_secs - fading.begun_secs <= FADE_SECS;
        self.fading.as_ref().is_some_and(is_under_way)
    }

    /// Paints the picture into `area`, at `now_secs`.
    ///
    /// A picture that was asked for at another size (the window was just resized) is scaled to
    /// the area's height, as the camera does, and centred. A `second` picture is shown while it
    /// belongs to the one on screen and both fill the area.
    pub fn paint(
        &mut self,
        painter: &Painter,
        area: PixelArea,
        second: Option<(&Arc<SecondPicture>, Beside)>,
        now_secs: f64,
    ) {
        let Some(shown) = lock(&self.shown).clone() else {
            painter.rect_filled(area.rect, 0.0, theme::VIEWPORT);
            return;
        };
        if shown.has_holes {
            let checker = self.checker.get_or_insert_with(|| load_checker(painter.ctx()));
            let squares = area.rect.size() / (2.0 * CHECKER_POINTS);
            let uv = Rect::from_min_size(Pos2::ZERO, squares);
            painter.image(checker.id(), area.rect, uv, Color32::WHITE);
        }
        let asked = shown.picture.requested_size;
        let rect = if asked == area.size {
            area.rect
        } else {
            painter.rect_filled(area.rect, 0.0, theme::VIEWPORT);
            let height = area.rect.height();
            let width = height * asked[0] as f32 / (asked[1] as f32).max(1.0);
            Rect::from_center_size(area.rect.center(), vec2(width, height))
        };
        let second = second.filter(|(second, _)| {
            [&shown.picture, &second.picture]
                .iter()
                .all(|p| p.size == area.size && p.requested_size == area.size)
        });
        let fade = self.fade(now_secs).filter(|_| second.is_none());
        let add = |part: Part, clip: Rect| {
            let callback = PaintPicture {
                shown: Arc::clone(&self.shown),
                second: second.map(|(second, _)| Arc::clone(second)),
                from: self.fading.as_ref().map(|fading| Arc::clone(&fading.from)),
                part,
                format: self.screen_format,
                area: area.size,
            };
            painter.with_clip_rect(clip).add(callback.callback(rect));
        };
        match second {
            None => add(fade.map_or(Part::First, Part::Fade), area.rect),
            Some((_, Beside::Difference(gain))) => add(Part::Difference(gain), area.rect),
            Some((_, Beside::Split(share))) => {
                let (mut left, mut right) = (area.rect, area.rect);
                left.max.x = divider_x(area, share);
                right.min.x = left.max.x;
                add(Part::First, left);
                add(Part::Second, right);
            }
        }
    }
}

/// A drawing of the window's own that lies over the picture, pixel for pixel.
#[derive(Default)]
pub struct Overlay {
    texture: Option<TextureHandle>,
}

impl std::fmt::Debug for Overlay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Overlay").field("size", &self.texture.as_ref().map(|t| t.size())).finish()
    }
}

impl Overlay {
    /// Shows sRGB bytes with straight alpha from now on, `size` pixels of them.
    pub fn set(&mut self, ctx: &Context, size: [u32; 2], rgba: &[u8]) {
        let image = ColorImage::from_rgba_unmultiplied(size.map(|n| n as usize), rgba);
        match &mut self.texture {
            Some(texture) => texture.set(image, TextureOptions::NEAREST),
            None => {
                self.texture = Some(ctx.load_texture("overlay", image, TextureOptions::NEAREST))
            }
        }
    }

    /// Paints it into an area of its size.
    pub fn paint(&self, painter: &Painter, area: PixelArea) {
        let Some(texture) = &self.texture else { return };
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(texture.id(), area.rect, whole, Color32::WHITE);
    }
}

/// Where the divider between two pictures is, points: on a whole pixel inside the area.
pub fn divider_x(area: PixelArea, share: f32) -> f32 {
    let pixel = area.rect.width() / area.size[0] as f32;
    let pixels = (share.clamp(0.0, 1.0) * area.size[0] as f32).round();
    area.rect.left() + pixels * pixel
}

/// Two by two squares, to be repeated.
fn load_checker(ctx: &Context) -> TextureHandle {
    let (dark, light) = (Color32::from_gray(34), Color32::from_gray(44));
    let image = ColorImage::new([2, 2], vec![dark, light, light, dark]);
    ctx.load_texture("checkerboard", image, TextureOptions::NEAREST_REPEAT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::engine::FrameReport;
    use crate::task::level::LevelOfDetail;

    #[test]
    fn an_area_is_whole_pixels_at_every_scale() {
        for scale in [1.0_f32, 1.25, 1.5, 1.75, 2.0, 2.625] {
            let rect = Rect::from_min_max(pos2(0.3, 27.7), pos2(801.9, 599.2));
            let area = PixelArea::covering(rect, scale);
            for edge in [area.rect.min.x, area.rect.min.y, area.rect.max.x, area.rect.max.y] {
                let pixels = edge * scale;
                assert!((pixels - pixels.round()).abs() < 1e-3, "{scale}: {pixels}");
            }
            let width = area.rect.width() * scale;
            assert!((width - area.size[0] as f32).abs() < 1e-2, "{scale}: {width}");
        }
    }

    #[test]
    fn the_divider_is_on_a_pixel_and_never_outside() {
        let area = PixelArea::covering(Rect::from_min_max(pos2(3.0, 0.0), pos2(104.0, 50.0)), 1.5);
        for share in [-1.0, 0.0, 0.31, 0.5, 1.0, 7.0] {
            let x = divider_x(area, share);
            assert!(area.rect.x_range().expand(1e-3).contains(x), "{share}: {x}");
            let pixels = x * 1.5;
            assert!((pixels - pixels.round()).abs() < 1e-3, "{share}: {pixels}");
        }
    }

    fn picture(size: [u32; 2], byte: u8) -> Arc<Picture> {
        let rgba = vec![byte; (size[0] * size[1] * 4) as usize];
        let report = FrameReport::last(LevelOfDetail::FULL, 1, crate::scene::Backend::Tiles, 1.0);
        Arc::new(Picture { size, requested_size: [8, 8], rgba, report })
    }

    #[test]
    fn a_picture_gives_way_within_its_time_and_then_is_let_go() {
        let mut viewport = Viewport::new(None);
        viewport.accept_fading(picture([4, 4], 255), 0.0);
        assert_eq!(viewport.fade(0.0), None, "there was nothing before it");
        viewport.accept_fading(picture([8, 8], 255), 10.0);
        assert_eq!(viewport.fade(10.0), Some(1.0));
        let half = viewport.fade(10.0 + FADE_SECS / 2.0).expect("under way");
        assert!((half - 0.5).abs() < 1e-3, "{half}");
        assert_eq!(viewport.fade(10.0 + FADE_SECS * 1.01), None);
        assert!(viewport.fading.is_none(), "it keeps no picture");
        viewport.accept_fading(picture([4, 4], 255), 20.0);
        viewport.accept(picture([8, 8], 255));
        assert_eq!(viewport.fade(20.0), None, "a moving view shows each at once");
        viewport.accept_fading(picture([8, 8], 100), 30.0);
        assert_eq!(viewport.fade(30.0), None, "with holes it lies elsewhere");
    }

    #[test]
    fn an_empty_area_still_has_one_pixel() {
        let area = PixelArea::covering(Rect::from_min_max(pos2(5.0, 5.0), pos2(5.0, 2.0)), 1.0);
        assert_eq!(area.size, [1, 1]);
    }
}

//! The one bridge between the engine's pictures and egui: a texture, and where it is painted.
//!
//! A picture of the size that was asked for is shown pixel for pixel: nearest sampling on a
//! rectangle of whole physical pixels, undithered, so that every byte arrives on screen as the
//! engine wrote it. Other sizes are enlarged smoothly.

use std::sync::Arc;

use eframe::egui::{
    Color32, ColorImage, Context, Painter, Pos2, Rect, TextureHandle, TextureOptions, Vec2, pos2,
    vec2,
};

use crate::task::engine::Picture;

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
#[derive(Default)]
pub struct Viewport {
    texture: Option<TextureHandle>,
    checker: Option<TextureHandle>,
    picture: Option<Arc<Picture>>,
    has_holes: bool,
}

impl Viewport {
    /// The picture on screen, if there is one.
    pub fn picture(&self) -> Option<&Arc<Picture>> {
        self.picture.as_ref()
    }

    /// Shows `picture` from the next painting on; what was painted with the texture in this pass
    /// shows it already. Whether another pass is needed because its place changed.
    ///
    /// A picture whose bytes do not fill its size is our own bug: it is logged and passed over.
    pub fn accept(&mut self, ctx: &Context, picture: Arc<Picture>) -> bool {
        let size = picture.size.map(|n| n as usize);
        if size.contains(&0) || picture.rgba.len() != size[0] * size[1] * 4 {
            log::error!("a picture of {size:?} pixels came with {} bytes", picture.rgba.len());
            return false;
        }
        let before = (self.picture.as_ref().map(|shown| shown.requested_size), self.has_holes);
        self.has_holes = picture.rgba.chunks_exact(4).any(|pixel| pixel[3] != 255);
        let image = if self.has_holes {
            ColorImage::from_rgba_unmultiplied(size, &picture.rgba)
        } else {
            ColorImage::from_rgba_premultiplied(size, &picture.rgba)
        };
        let exact = picture.size == picture.requested_size;
        let options = if exact { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
        match &mut self.texture {
            // In place: the texture on the card is kept.
            Some(texture) if texture.size() == size => {
                texture.set_partial([0, 0], image, options);
            }
            Some(texture) => texture.set(image, options),
            None => self.texture = Some(ctx.load_texture("viewport", image, options)),
        }
        let after = (Some(picture.requested_size), self.has_holes);
        self.picture = Some(picture);
        before != after
    }

    /// Paints the picture into `area`.
    ///
    /// A picture that was asked for at another size (the window was just resized) is scaled to
    /// the area's height, as the camera does, and centred.
    pub fn paint(&mut self, painter: &Painter, area: PixelArea) {
        let (Some(texture), Some(picture)) = (&self.texture, &self.picture) else { return };
        let texture = texture.id();
        if self.has_holes {
            let checker = self.checker.get_or_insert_with(|| load_checker(painter.ctx()));
            let squares = area.rect.size() / (2.0 * CHECKER_POINTS);
            let uv = Rect::from_min_size(Pos2::ZERO, squares);
            painter.image(checker.id(), area.rect, uv, Color32::WHITE);
        }
        let asked = picture.requested_size;
        let rect = if asked == area.size {
            area.rect
        } else {
            let height = area.rect.height();
            let width = height * asked[0] as f32 / (asked[1] as f32).max(1.0);
            Rect::from_center_size(area.rect.center(), vec2(width, height))
        };
        let uv = Rect::from_min_size(Pos2::ZERO, Vec2::splat(1.0));
        painter.with_clip_rect(area.rect).image(texture, rect, uv, Color32::WHITE);
    }
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
    fn an_empty_area_still_has_one_pixel() {
        let area = PixelArea::covering(Rect::from_min_max(pos2(5.0, 5.0), pos2(5.0, 2.0)), 1.0);
        assert_eq!(area.size, [1, 1]);
    }
}

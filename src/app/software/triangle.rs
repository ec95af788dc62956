//! One triangle of egui's, painted: colours and texels interpolated, premultiplied, over what is there.

use eframe::egui::epaint::{ImageDelta, Vertex};
use eframe::egui::{Color32, ImageData, TextureFilter, TextureOptions, TextureWrapMode};

/// Pixels from a corner up to, without, another: left, top, right, bottom.
pub(super) type Bounds = [usize; 4];

/// What both have.
pub(super) fn common(a: Bounds, b: Bounds) -> Bounds {
    [a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])]
}

/// Rows of pixels, 0x00RRGGBB each.
pub(super) struct Target<'a> {
    pub(super) pixels: &'a mut [u32],
    pub(super) width: usize,
}

impl Target<'_> {
    pub(super) fn span(&mut self, y: usize, from: usize, to: usize) -> &mut [u32] {
        &mut self.pixels[y * self.width + from..y * self.width + to]
    }
}

/// A texture of egui's in memory.
#[derive(Debug, Clone)]
pub(super) struct Texture {
    size: [usize; 2],
    texels: Vec<Color32>,
    options: TextureOptions,
    /// Changes when texels that were there do.
    pub(super) generation: u64,
}

impl Texture {
    pub(super) fn new(delta: &ImageDelta, generation: u64) -> Self {
        let ImageData::Color(image) = &delta.image;
        Self { size: image.size, texels: image.pixels.clone(), options: delta.options, generation }
    }

    /// Replaces a part.
    pub(super) fn patch(&mut self, delta: &ImageDelta, [left, top]: [usize; 2]) {
        let ImageData::Color(image) = &delta.image;
        for (row, texels) in image.pixels.chunks_exact(image.size[0].max(1)).enumerate() {
            let begin = (top + row) * self.size[0] + left;
            if let Some(place) = self.texels.get_mut(begin..begin + texels.len()) {
                place.copy_from_slice(texels);
            }
        }
    }

    /// Where a whole coordinate lies within `size` texels.
    fn wrapped(&self, at: f32, size: usize) -> usize {
        #[expect(clippy::cast_possible_truncation, reason = "saturates, and is wrapped")]
        let (at, size) = (at as i64, size as i64);
        let at = match self.options.wrap_mode {
            TextureWrapMode::ClampToEdge => at.clamp(0, size - 1),
            TextureWrapMode::Repeat => at.rem_euclid(size),
            TextureWrapMode::MirroredRepeat => {
                let at = at.rem_euclid(2 * size);
                at.min(2 * size - 1 - at)
            }
        };
        usize::try_from(at).unwrap_or(0)
    }

    fn texel(&self, x: f32, y: f32) -> [f32; 4] {
        let place = self.wrapped(y, self.size[1]) * self.size[0] + self.wrapped(x, self.size[0]);
        self.texels.get(place).map_or([0.0; 4], |texel| texel.to_array().map(f32::from))
    }

    /// At texel coordinates, 0..=255 premultiplied.
    fn sample(&self, x: f32, y: f32, filter: TextureFilter) -> [f32; 4] {
        if filter == TextureFilter::Nearest {
            return self.texel(x.floor(), y.floor());
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (right, down) = (x - left, y - top);
        let row = |y: f32| mix(self.texel(left, y), self.texel(left + 1.0, y), right);
        match down == 0.0 {
            true => row(top),
            false => mix(row(top), row(top + 1.0), down),
        }
    }
}

fn mix(a: [f32; 4], b: [f32; 4], share: f32) -> [f32; 4] {
    std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
}

/// Something that is linear over the triangle: at the origin of pixels, and a pixel to the right and down.
#[derive(Clone, Copy)]
struct Plane {
    at: f32,
    right: f32,
    down: f32,
}

impl Plane {
    fn over(corners: [[f32; 2]; 3], values: [f32; 3]) -> Self {
        let [a, b, c] = corners;
        let (ab, ac) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let area = ab[0] * ac[1] - ac[0] * ab[1];
        let (up, vp) = (values[1] - values[0], values[2] - values[0]);
        let right = (up * ac[1] - vp * ab[1]) / area;
        let down = (vp * ab[0] - up * ac[0]) / area;
        // So thin that it has no slope.
        let [right, down] = [right, down].map(|slope| if slope.is_finite() { slope } else { 0.0 });
        Self { at: values[0] - a[0] * right - a[1] * down, right, down }
    }

    fn value(&self, x: f32, y: f32) -> f32 {
        self.at + x * self.right + y * self.down
    }
}

/// Lays a premultiplied colour over a pixel: rounded once, at most one level from the true product.
pub(super) fn over(pixel: u32, [r, g, b, a]: [u32; 4]) -> u32 {
    let rest = 255 - a;
    let scaled = |pair: u32| {
        let product = pair * rest + 0x0080_0080;
        ((product + ((product >> 8) & 0x00ff_00ff)) >> 8) & 0x00ff_00ff
    };
    let (red_blue, green) = (scaled(pixel & 0x00ff_00ff), scaled((pixel >> 8) & 0xff));
    if r.max(g).max(b) <= a {
        return red_blue + (green << 8) + ((r << 16) | (g << 8) | b);
    }
    // Colours that only add light may add up to more than there is.
    let channel = |there: u32, more: u32| (there + more).min(255);
    (channel(red_blue >> 16, r) << 16) | (channel(green, g) << 8) | channel(red_blue & 0xff, b)
}

/// The product of two numbers of 0..=255 as one of 0..=255.
fn product(a: u32, b: u32) -> u32 {
    let product = a * b + 128;
    (product + (product >> 8)) >> 8
}

fn bytes(colour: [f32; 4]) -> [u32; 4] {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    colour.map(|channel| channel.clamp(0.0, 255.0).round() as u32)
}

/// What a triangle's pixels get.
enum Source {
    /// The same everywhere.
    Plain([u32; 4]),
    /// One colour times texels, a texel a pixel: the row and column less the pixel's.
    Texels {
        colour: [u32; 4],
        offset: [isize; 2],
    },
    Mixed {
        colour: [Plane; 4],
        texel: [Plane; 2],
        filter: TextureFilter,
    },
}

impl Source {
    fn of(corners: [[f32; 2]; 3], vertices: [&Vertex; 3], texture: &Texture) -> Self {
        let size = texture.size.map(|n| n as f32);
        let [a, b, c] = vertices;
        let is_one_colour = a.color == b.color && b.color == c.color;
        if is_one_colour && a.uv == b.uv && b.uv == c.uv {
            let texel = texture.sample(a.uv.x * size[0], a.uv.y * size[1], TextureFilter::Nearest);
            let colour = a.color.to_array().map(f32::from);
            return Self::Plain(bytes(std::array::from_fn(|i| texel[i] * colour[i] / 255.0)));
        }
        let along = |axis: usize| {
            Plane::over(corners, vertices.map(|v| [v.uv.x, v.uv.y][axis] * size[axis]))
        };
        let texel = [along(0), along(1)];
        let colour = std::array::from_fn(|i| {
            Plane::over(corners, vertices.map(|v| f32::from(v.color.to_array()[i])))
        });
        let steps = [texel[0].right, texel[0].down, texel[1].right, texel[1].down];
        let is_enlarged = steps.iter().all(|step| step.abs() <= 1.0);
        let options = &texture.options;
        let filter = if is_enlarged { options.magnification } else { options.minification };
        let is_near = |a: f32, b: f32| (a - b).abs() < 2e-3;
        // Offsets of middles of pixels from middles of texels.
        let offset = [
            texel[0].value(corners[0][0], corners[0][1]) - corners[0][0],
            texel[1].value(corners[0][0], corners[0][1]) - corners[0][1],
        ];
        let is_pixel_for_pixel =
            steps.iter().zip([1.0, 0.0, 0.0, 1.0]).all(|(s, t)| is_near(*s, t))
                && offset.iter().all(|o| is_near(*o, o.round()));
        if is_one_colour && is_pixel_for_pixel {
            let colour = a.color.to_array().map(u32::from);
            #[expect(clippy::cast_possible_truncation, reason = "a place in a texture")]
            return Self::Texels { colour, offset: offset.map(|o| o.round() as isize) };
        }
        Self::Mixed { colour, texel, filter }
    }

    fn paint(&self, span: &mut [u32], at: [usize; 2], texture: &Texture) {
        match self {
            Self::Plain([.., 0]) if matches!(self, Self::Plain([0, 0, 0, 0])) => {}
            &Self::Plain([r, g, b, 255]) => span.fill((r << 16) | (g << 8) | b),
            &Self::Plain(colour) => {
                for pixel in span {
                    *pixel = over(*pixel, colour);
                }
            }
            Self::Texels { colour, offset } => {
                let place = [0, 1].map(|axis| at[axis].checked_add_signed(offset[axis]));
                let [Some(column), Some(row)] = place else { return };
                let begin = row * texture.size[0] + column;
                let texels = texture.texels.get(begin..begin + span.len()).unwrap_or_default();
                for (pixel, texel) in span.iter_mut().zip(texels) {
                    if *texel != Color32::TRANSPARENT {
                        let texel = texel.to_array().map(u32::from);
                        let source = std::array::from_fn(|i| product(texel[i], colour[i]));
                        *pixel = over(*pixel, source);
                    }
                }
            }
            Self::Mixed { colour, texel, filter } => {
                let y = at[1] as f32 + 0.5;
                for (n, pixel) in span.iter_mut().enumerate() {
                    let x = (at[0] + n) as f32 + 0.5;
                    let [u, v] = texel.map(|plane| plane.value(x, y));
                    let texel = texture.sample(u, v, *filter);
                    let colour = colour.map(|plane| plane.value(x, y).clamp(0.0, 255.0));
                    let source = std::array::from_fn(|i| texel[i] * colour[i] / 255.0);
                    *pixel = over(*pixel, bytes(source));
                }
            }
        }
    }
}

/// The first pixel whose middle is not before a place.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates at 0")]
pub(super) fn first_from(place: f32) -> usize {
    (place - 0.5).ceil() as usize
}

/// Paints a triangle, whose corners are in points, where `clip` lets it.
///
/// A pixel belongs to it if its middle does; what lies on an edge between two triangles belongs to one of them.
pub(super) fn paint_triangle(
    target: &mut Target<'_>,
    clip: Bounds,
    vertices: [&Vertex; 3],
    pixels_per_point: f32,
    texture: &Texture,
) {
    let mut vertices = vertices;
    vertices.sort_by(|a, b| a.pos.y.total_cmp(&b.pos.y));
    let corners = vertices.map(|v| [v.pos.x * pixels_per_point, v.pos.y * pixels_per_point]);
    let [top, middle, bottom] = corners;
    let rows = clip[1].max(first_from(top[1]))..clip[3].min(first_from(bottom[1]));
    if rows.is_empty() {
        return;
    }
    let source = Source::of(corners, vertices, texture);
    // The same arithmetic for both triangles that share an edge.
    let crossing =
        |a: [f32; 2], b: [f32; 2], y: f32| a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]));
    for row in rows {
        let y = row as f32 + 0.5;
        let long = crossing(top, bottom, y);
        let short = match y < middle[1] {
            true => crossing(top, middle, y),
            false => crossing(middle, bottom, y),
        };
        let from = clip[0].max(first_from(long.min(short)));
        let to = clip[2].min(first_from(long.max(short)));
        if from < to {
            source.paint(target.span(row, from, to), [from, row], texture);
        }
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::{ColorImage, Pos2, pos2};

    use super::*;

    /// A texture of greys, a row after the other.
    fn texture(size: [usize; 2], greys: &[u8], options: TextureOptions) -> Texture {
        let image = ColorImage::new(size, greys.iter().map(|g| Color32::from_gray(*g)).collect());
        Texture::new(&ImageDelta::full(image, options), 1)
    }

    #[test]
    fn colours_are_laid_over_others_as_premultiplied_light_is() {
        for there in 0..=255_u32 {
            for alpha in 0..=255_u32 {
                let found = over(there << 16 | there << 8 | there, [alpha / 2, 0, alpha, alpha]);
                let left = f64::from(there) * f64::from(255 - alpha) / 255.0;
                let expected = [alpha / 2, 0, alpha].map(|more| left.round() as u32 + more);
                let found = [found >> 16, found >> 8 & 0xff, found & 0xff];
                assert_eq!(found, expected, "{there} under {alpha}");
            }
        }
        // Light that is added hides nothing, and ends at white.
        assert_eq!(over(0x00f0_8010, [0x20, 0x20, 0x20, 0]), 0x00ff_a030);
    }

    #[test]
    fn textures_go_on_beyond_their_edges_as_they_are_told_to() {
        let greys = [10, 20, 30, 40];
        for (wrap_mode, expected) in [
            (TextureWrapMode::ClampToEdge, [10, 10, 10, 20, 30, 40, 40, 40]),
            (TextureWrapMode::Repeat, [30, 40, 10, 20, 30, 40, 10, 20]),
            (TextureWrapMode::MirroredRepeat, [20, 10, 10, 20, 30, 40, 40, 30]),
        ] {
            let options = TextureOptions { wrap_mode, ..TextureOptions::NEAREST };
            let texture = texture([4, 1], &greys, options);
            let found = [-2, -1, 0, 1, 2, 3, 4, 5].map(|at| texture.texel(at as f32, 0.0)[0] as u8);
            assert_eq!(found, expected, "{wrap_mode:?}");
        }
    }

    #[test]
    fn texels_are_taken_whole_or_mixed_between_their_middles() {
        let texture = texture([2, 2], &[0, 100, 50, 250], TextureOptions::LINEAR);
        let at = |x, y, filter| texture.sample(x, y, filter)[0];
        assert_eq!(at(0.9, 0.2, TextureFilter::Nearest), 0.0);
        assert_eq!(at(1.1, 1.2, TextureFilter::Nearest), 250.0);
        assert_eq!(at(0.5, 0.5, TextureFilter::Linear), 0.0);
        assert_eq!(at(1.0, 0.5, TextureFilter::Linear), 50.0);
        assert_eq!(at(1.0, 1.0, TextureFilter::Linear), 100.0);
    }

    /// Paints a square of pixels from (4, 3) on, of a whole texture.
    fn painted(texture: &Texture, side: f32, color: Color32) -> Vec<u32> {
        let mut pixels = vec![0; 20 * 20];
        let corner = |x: f32, y: f32| Vertex {
            pos: Pos2::new(4.0 + side * x, 3.0 + side * y),
            uv: pos2(x, y),
            color,
        };
        let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        for triangle in [[0, 1, 2], [0, 2, 3]] {
            let mut target = Target { pixels: &mut pixels, width: 20 };
            let vertices = triangle.map(|i: usize| &corners[i]);
            paint_triangle(&mut target, [0, 0, 20, 20], vertices, 1.0, texture);
        }
        pixels
    }

    /// As glyphs are: a texel a pixel, times a colour.
    #[test]
    fn a_texel_a_pixel_is_that_texel_in_its_colour() {
        let greys: Vec<u8> = (0..16).map(|i| 10 + 15 * i).collect();
        let texture = texture([4, 4], &greys, TextureOptions::LINEAR);
        let found = painted(&texture, 4.0, Color32::from_rgb(255, 128, 0));
        for (i, pixel) in found.iter().enumerate() {
            let (x, y) = (i % 20, i / 20);
            let is_in = (4..8).contains(&x) && (3..7).contains(&y);
            let grey = if is_in { f64::from(greys[(y - 3) * 4 + x - 4]) } else { 0.0 };
            let expected = (grey as u32) << 16 | ((grey * 128.0 / 255.0).round() as u32) << 8;
            assert_eq!(*pixel, expected, "{x}, {y}");
        }
    }

    #[test]
    fn what_is_made_larger_and_smaller_is_filtered_each_in_its_way() {
        let options = TextureOptions {
            magnification: TextureFilter::Nearest,
            minification: TextureFilter::Linear,
            ..TextureOptions::LINEAR
        };
        let stripes = |n: usize| (0..n * n).map(|i| 200 * (i % 2) as u8).collect::<Vec<_>>();
        let greys = |side: f32, n: usize| {
            let found = painted(&texture([n, n], &stripes(n), options), side, Color32::WHITE);
            let mut greys: Vec<u32> = found.iter().map(|pixel| pixel & 0xff).collect();
            greys.sort_unstable();
            greys.dedup();
            greys
        };
        assert_eq!(greys(7.0, 4), [0, 200], "whole texels");
        assert!(greys(4.0, 6).len() > 2, "mixtures");
    }

    #[test]
    fn a_part_of_a_texture_is_replaced_where_it_is() {
        let mut texture = texture([3, 3], &[0; 9], TextureOptions::NEAREST);
        let image = ColorImage::new([2, 1], vec![Color32::from_gray(7), Color32::from_gray(8)]);
        texture.patch(&ImageDelta::partial([1, 2], image, TextureOptions::NEAREST), [1, 2]);
        let found: Vec<u8> = texture.texels.iter().map(Color32::r).collect();
        assert_eq!(found, [0, 0, 0, 0, 0, 0, 0, 7, 8]);
    }
}

//! The window's pixels in memory: egui's meshes and the engine's pictures, painted again only where they changed.
//!
//! The window is cut into tiles. Each has a number made of all that touches it; a tile whose number is the one that it
//! was painted with is left as it is.

use std::collections::HashMap;

use eframe::egui::epaint::{Mesh, Primitive, Vertex};
use eframe::egui::{ClippedPrimitive, Color32, Rect, TextureId, TexturesDelta};

use super::super::painting::{PaintPicture, Painted};
use super::picture::paint_picture;
use super::triangle::{Bounds, Target, Texture, common, first_from, paint_triangle};

/// Sides of a tile, pixels: a line of text high.
const TILE: [usize; 2] = [64, 32];
/// What stands for a picture in place of a triangle's first index.
const PICTURE: u32 = u32::MAX;

/// A rectangle of pixels that was painted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Damage {
    /// Its left edge.
    pub x: u32,
    /// Its upper edge.
    pub y: u32,
    /// Its width.
    pub width: u32,
    /// Its height.
    pub height: u32,
}

/// What touches a tile.
#[derive(Debug, Default)]
struct Tile {
    hash: u64,
    /// Primitives, and where in their indices a triangle begins.
    entries: Vec<[u32; 2]>,
}

/// A window's pixels.
#[derive(Debug, Default)]
pub struct Canvas {
    size: [usize; 2],
    pixels: Vec<u32>,
    background: Color32,
    tiles: Vec<Tile>,
    /// What each tile was painted with; `None` before it was.
    painted: Vec<Option<u64>>,
    textures: HashMap<TextureId, Texture>,
    generation: u64,
    /// The pictures that were painted last: as long as they live no other has their addresses.
    pictures: Vec<Painted>,
}

impl Canvas {
    /// Takes new and changed textures out of what egui says of them, before what shows them is painted.
    pub fn set_textures(&mut self, delta: &mut TexturesDelta) {
        for (id, changes) in delta.set.drain() {
            for change in changes {
                self.generation += 1;
                match (change.pos, self.textures.get_mut(&id)) {
                    (None, _) => {
                        self.textures.insert(id, Texture::new(&change, self.generation));
                    }
                    (Some(place), Some(texture)) => {
                        texture.patch(&change, place);
                        // The atlas of glyphs only grows: what was painted of it is as it was.
                        if id != TextureId::default() {
                            texture.generation = self.generation;
                        }
                    }
                    (Some(_), None) => log::error!("a part of a texture that is not there: {id:?}"),
                }
            }
        }
    }

    /// Lets go of textures, after what showed them was painted.
    pub fn free_textures(&mut self, freed: impl IntoIterator<Item = TextureId>) {
        for id in freed {
            self.textures.remove(&id);
        }
    }

    /// Its pixels row by row from the upper left one, 0x00RRGGBB each.
    pub fn pixels(&self) -> &[u32] {
        &self.pixels
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Paints a frame of `size` pixels, and tells what of it is not as it was before.
    pub fn paint(
        &mut self,
        size: [usize; 2],
        pixels_per_point: f32,
        background: Color32,
        primitives: &[ClippedPrimitive],
    ) -> Vec<Damage> {
        if size != self.size || background != self.background {
            let count = size[0].div_ceil(TILE[0]) * size[1].div_ceil(TILE[1]);
            self.size = size;
            self.background = background;
            self.pixels = vec![0; size[0] * size[1]];
            self.tiles.resize_with(count, Tile::default);
            self.painted = vec![None; count];
        }
        for tile in &mut self.tiles {
            tile.hash = 0;
            tile.entries.clear();
        }
        let mut pictures = Vec::new();
        // Where the picture of a primitive stands among them.
        let mut places = HashMap::new();
        for (number, primitive) in primitives.iter().enumerate() {
            let clip = bounds(primitive.clip_rect, pixels_per_point, size);
            if clip[0] >= clip[2] || clip[1] >= clip[3] {
                continue;
            }
            match &primitive.primitive {
                Primitive::Mesh(mesh) => self.enter_mesh(mesh, number, clip, pixels_per_point),
                Primitive::Callback(callback) => {
                    let picture = callback.callback.downcast_ref::<PaintPicture>();
                    let Some(picture) = picture.and_then(PaintPicture::painted) else { continue };
                    let area = pixel_rect(callback.rect, pixels_per_point);
                    let hash = picture.identity().into_iter().fold(1, mixed);
                    let hash = area.iter().fold(hash, |hash, edge| mixed(hash, *edge as u64));
                    self.enter(clip, hash, clip, [number, PICTURE as usize]);
                    places.insert(number, (pictures.len(), area));
                    pictures.push(picture);
                }
            }
        }
        let mut damage = Vec::new();
        let across = size[0].div_ceil(TILE[0]);
        for place in 0..self.tiles.len() {
            if self.painted[place] == Some(self.tiles[place].hash) {
                continue;
            }
            self.painted[place] = Some(self.tiles[place].hash);
            let corner = [place % across * TILE[0], place / across * TILE[1]];
            let tile = [
                corner[0],
                corner[1],
                (corner[0] + TILE[0]).min(size[0]),
                (corner[1] + TILE[1]).min(size[1]),
            ];
            add_damage(&mut damage, tile);
            let mut target = Target { pixels: &mut self.pixels, width: size[0] };
            let [r, g, b, _] = background.to_array().map(u32::from);
            for row in tile[1]..tile[3] {
                target.span(row, tile[0], tile[2]).fill((r << 16) | (g << 8) | b);
            }
            for &[number, first] in &self.tiles[place].entries {
                let number = number as usize;
                let primitive = &primitives[number];
                let clip = common(tile, bounds(primitive.clip_rect, pixels_per_point, size));
                if let Some((picture, area)) = places.get(&number) {
                    paint_picture(&mut target, clip, *area, &pictures[*picture]);
                } else if let Primitive::Mesh(mesh) = &primitive.primitive
                    && let Some(texture) = self.textures.get(&mesh.texture_id)
                {
                    let corners = corners(mesh, first as usize);
                    paint_triangle(&mut target, clip, corners, pixels_per_point, texture);
                }
            }
        }
        self.pictures = pictures;
        damage
    }

    fn enter_mesh(&mut self, mesh: &Mesh, number: usize, clip: Bounds, pixels_per_point: f32) {
        let Some(texture) = self.textures.get(&mesh.texture_id) else { return };
        let of_texture = match mesh.texture_id {
            TextureId::Managed(id) => id << 1,
            TextureId::User(id) => (id << 1) | 1,
        };
        let seed = clip.iter().fold(of_texture, |hash, edge| mixed(hash, *edge as u64));
        let seed = mixed(seed, texture.generation);
        for first in (0..mesh.indices.len() / 3).map(|triangle| 3 * triangle) {
            let vertices = corners(mesh, first);
            let [a, b, c] = vertices.map(|v| v.pos);
            let least = [a.x.min(b.x).min(c.x), a.y.min(b.y).min(c.y)];
            let most = [a.x.max(b.x).max(c.x), a.y.max(b.y).max(c.y)];
            let [left, top] = least.map(|place| first_from(place * pixels_per_point));
            let [right, bottom] = most.map(|place| first_from(place * pixels_per_point));
            let touched = common(clip, [left, top, right, bottom]);
            let hash = vertices.into_iter().fold(seed, |hash, vertex| {
                let pair = |a: f32, b: f32| u64::from(a.to_bits()) << 32 | u64::from(b.to_bits());
                let hash = mixed(hash, pair(vertex.pos.x, vertex.pos.y));
                let hash = mixed(hash, pair(vertex.uv.x, vertex.uv.y));
                mixed(hash, u64::from(u32::from_le_bytes(vertex.color.to_array())))
            });
            self.enter(touched, hash, clip, [number, first]);
        }
    }

    /// Enters something into the tiles that it touches.
    fn enter(&mut self, touched: Bounds, hash: u64, clip: Bounds, [number, first]: [usize; 2]) {
        let touched = common(touched, clip);
        if touched[0] >= touched[2] || touched[1] >= touched[3] {
            return;
        }
        let across = self.size[0].div_ceil(TILE[0]);
        #[expect(clippy::cast_possible_truncation, reason = "indices of egui's are 32 bits")]
        let entry = [number as u32, first as u32];
        for row in touched[1] / TILE[1]..touched[3].div_ceil(TILE[1]) {
            for column in touched[0] / TILE[0]..touched[2].div_ceil(TILE[0]) {
                let tile = &mut self.tiles[row * across + column];
                tile.hash = mixed(tile.hash, hash);
                tile.entries.push(entry);
            }
        }
    }
}

fn corners(mesh: &Mesh, first: usize) -> [&Vertex; 3] {
    [0, 1, 2].map(|corner| &mesh.vertices[mesh.indices[first + corner] as usize])
}

/// A step of a hash of 64 bits: multiplied by an odd number and folded, so that every bit moves others.
fn mixed(hash: u64, word: u64) -> u64 {
    let product = u128::from(hash ^ word ^ 0x9e37_79b9_7f4a_7c15) * 0xd6e8_feb8_6659_fd93_u128;
    #[expect(clippy::cast_possible_truncation, reason = "both halves are taken")]
    let folded = (product as u64) ^ ((product >> 64) as u64);
    folded.wrapping_add(hash.rotate_left(23))
}

/// Joins a tile to the one before it in the row.
fn add_damage(damage: &mut Vec<Damage>, tile: Bounds) {
    #[expect(clippy::cast_possible_truncation, reason = "a window's pixels")]
    let [x, y, right, bottom] = tile.map(|edge| edge as u32);
    match damage.last_mut() {
        Some(last) if last.y == y && last.x + last.width == x => last.width = right - last.x,
        _ => damage.push(Damage { x, y, width: right - x, height: bottom - y }),
    }
}

/// Whole pixels of a clip rectangle on the window, as egui's own painters round it.
fn bounds(rect: Rect, pixels_per_point: f32, size: [usize; 2]) -> Bounds {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates at 0")]
    let pixel = |points: f32| (points * pixels_per_point).round() as usize;
    let least = [pixel(rect.min.x).min(size[0]), pixel(rect.min.y).min(size[1])];
    let most = [pixel(rect.max.x).min(size[0]), pixel(rect.max.y).min(size[1])];
    [least[0], least[1], most[0], most[1]]
}

/// A rectangle in whole pixels, which may lie beyond the window.
fn pixel_rect(rect: Rect, pixels_per_point: f32) -> [i64; 4] {
    #[expect(clippy::cast_possible_truncation, reason = "saturates")]
    [rect.min.x, rect.min.y, rect.max.x, rect.max.y]
        .map(|edge| (edge * pixels_per_point).round() as i64)
}

#[cfg(test)]
mod tests {
    use eframe::egui::epaint::ImageDelta;
    use eframe::egui::{ColorImage, Context, RawInput, Slider, TextureOptions, pos2, vec2};

    use super::*;

    const SIZE: [usize; 2] = [403, 301];
    const BACKGROUND: Color32 = Color32::from_rgb(20, 30, 40);

    /// A frame of a small interface that shows a number.
    fn frame(
        ctx: &Context,
        number: f32,
        red: u8,
        scale: f32,
    ) -> (Vec<ClippedPrimitive>, TexturesDelta) {
        let size = vec2(SIZE[0] as f32, SIZE[1] as f32) / scale;
        let mut input = RawInput {
            screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), size)),
            ..RawInput::default()
        };
        input.viewports.entry(input.viewport_id).or_default().native_pixels_per_point = Some(scale);
        let output = ctx.run_ui(input, |ui| {
            ui.heading("Words that stay");
            let mut shown = number;
            ui.add(Slider::new(&mut shown, 0.0..=1.0).text("Share"));
            ui.label("More words, and a circle");
            let painter = ui.painter();
            painter.circle_filled(
                pos2(150.3, 200.7),
                31.4,
                Color32::from_rgba_unmultiplied(red, 90, 10, 128),
            );
        });
        let primitives = ctx.tessellate(output.shapes, output.pixels_per_point);
        (primitives, output.textures_delta)
    }

    #[test]
    fn what_changed_is_painted_and_nothing_else() {
        for scale in [1.0, 1.5] {
            let (ctx, mut kept) = (Context::default(), Canvas::default());
            // Widgets take their places in the first passes.
            // The last one has another colour and nothing else.
            let numbers = [0.2, 0.2, 0.2, 0.7, 0.7, 0.71, 0.1, 0.1];
            for (pass, number) in numbers.into_iter().enumerate() {
                let red = if pass == 7 { 201 } else { 200 };
                let (primitives, mut textures) = frame(&ctx, number, red, scale);
                kept.set_textures(&mut textures);
                let damage = kept.paint(SIZE, scale, BACKGROUND, &primitives);
                kept.free_textures(textures.free.drain());
                let area: u32 = damage.iter().map(|part| part.width * part.height).sum();
                let mut fresh = Canvas { textures: kept.textures.clone(), ..Canvas::default() };
                fresh.paint(SIZE, scale, BACKGROUND, &primitives);
                assert!(kept.pixels() == fresh.pixels(), "{number} is not as if painted anew");
                if pass >= 3 {
                    assert!(area < (SIZE[0] * SIZE[1] / 3) as u32, "{number}: {area} pixels");
                    assert_eq!(area == 0, pass == 4, "{number}: {area} pixels");
                }
            }
        }
    }

    /// A square of 40 × 20 pixels, of a texture of its own.
    fn square(clip_rect: Rect, uv: f32, color: Color32) -> [ClippedPrimitive; 1] {
        let mut mesh = Mesh { texture_id: TextureId::Managed(7), ..Mesh::default() };
        let corner = |x: f32, y: f32| Vertex {
            pos: pos2(70.0 + 40.0 * x, 40.0 + 20.0 * y),
            uv: pos2(x * uv, y * uv),
            color,
        };
        mesh.vertices =
            vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        mesh.add_triangle(0, 1, 2);
        mesh.add_triangle(0, 2, 3);
        [ClippedPrimitive { clip_rect, primitive: Primitive::Mesh(mesh) }]
    }

    /// A texture of 4 × 4, or a part of it, of one colour.
    fn texels(place: Option<[usize; 2]>, color: Color32) -> TexturesDelta {
        let options = TextureOptions::NEAREST;
        let of = |size| ColorImage::filled(size, color);
        let mut delta = TexturesDelta::default();
        let change = match place {
            None => ImageDelta::full(of([4, 4]), options),
            Some(place) => ImageDelta::partial(place, of([2, 1]), options),
        };
        delta.set.entry(TextureId::Managed(7)).or_default().push(change);
        delta
    }

    /// Each change alone: of texels, of a part of them, of where they are taken from, of what is let through, of what is
    /// behind, of whether the texture is there.
    #[test]
    fn whatever_changes_of_a_square_has_its_tile_painted_again() {
        let size = [200, 90];
        let whole = Rect::from_min_size(pos2(0.0, 0.0), vec2(200.0, 90.0));
        let part = Rect::from_min_size(pos2(0.0, 0.0), vec2(90.0, 50.0));
        let (red, white) = (Color32::from_rgb(200, 10, 10), Color32::WHITE);
        let of = |clip| square(clip, 1.0, white);
        let mut kept = Canvas::default();
        let mut free = TexturesDelta::default();
        free.free.insert(TextureId::Managed(7));
        let none = TexturesDelta::default;
        for (what, mut textures, shown, behind, changes) in [
            ("at first", texels(None, red), of(whole), Color32::BLACK, true),
            ("the same", none(), of(whole), Color32::BLACK, false),
            ("a part", texels(Some([2, 2]), white), of(whole), Color32::BLACK, true),
            ("from elsewhere", none(), square(whole, 0.5, white), Color32::BLACK, true),
            ("tinted", none(), square(whole, 0.5, red), Color32::BLACK, true),
            ("cut off", none(), square(part, 0.5, red), Color32::BLACK, true),
            (
                "all of it",
                texels(None, Color32::from_rgb(10, 90, 250)),
                of(whole),
                Color32::BLACK,
                true,
            ),
            ("before another wall", none(), of(whole), Color32::GRAY, true),
            ("let go of", free, of(whole), Color32::GRAY, false),
            ("gone", none(), of(whole), Color32::GRAY, true),
        ] {
            kept.set_textures(&mut textures);
            let before = kept.pixels().to_vec();
            let damage = kept.paint(size, 1.0, behind, &shown);
            let mut fresh = Canvas { textures: kept.textures.clone(), ..Canvas::default() };
            fresh.paint(size, 1.0, behind, &shown);
            assert!(kept.pixels() == fresh.pixels(), "{what}: not as if painted anew");
            assert_eq!(kept.pixels() != before, changes, "{what}");
            assert_eq!(damage.is_empty(), !changes, "{what}");
            kept.free_textures(textures.free.drain());
        }
    }

    #[test]
    fn tiles_side_by_side_are_one_part_and_others_are_not() {
        let part = |x, y, width| Damage { x, y, width, height: 32 };
        let mut damage = Vec::new();
        for [x, y] in [[0, 0], [64, 0], [192, 0], [256, 32], [320, 32]] {
            add_damage(&mut damage, [x, y, x + 64, y + 32]);
        }
        assert_eq!(damage, [part(0, 0, 128), part(192, 0, 64), part(256, 32, 128)]);
    }

    #[test]
    fn triangles_that_share_an_edge_leave_no_gap_and_no_pixel_twice() {
        let mut canvas = Canvas::default();
        let ctx = Context::default();
        let mut textures = frame(&ctx, 0.0, 200, 1.0).1;
        canvas.set_textures(&mut textures);
        canvas.free_textures(textures.free.drain());
        let white = eframe::egui::epaint::WHITE_UV;
        // A fan about an odd place, half transparent: a pixel painted twice would be brighter.
        let colour = Color32::from_rgba_premultiplied(100, 100, 100, 100);
        let mut mesh = Mesh::default();
        let middle = pos2(71.31, 83.77);
        mesh.vertices.push(Vertex { pos: middle, uv: white, color: colour });
        for spoke in 0..24_u32 {
            let angle = spoke as f32 * std::f32::consts::TAU / 24.0 + 0.1;
            let pos = middle + vec2(angle.cos(), angle.sin()) * 57.3;
            mesh.vertices.push(Vertex { pos, uv: white, color: colour });
            mesh.add_triangle(0, 1 + spoke, 1 + (spoke + 1) % 24);
        }
        let clip_rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(200.0, 200.0));
        let primitives = [ClippedPrimitive { clip_rect, primitive: Primitive::Mesh(mesh) }];
        canvas.paint([200, 200], 1.0, Color32::BLACK, &primitives);
        for (n, pixel) in canvas.pixels().iter().enumerate() {
            let at = pos2((n % 200) as f32 + 0.5, (n / 200) as f32 + 0.5);
            let distance = at.distance(middle);
            if distance < 56.0 {
                assert_eq!(*pixel, 0x0064_6464, "{at:?}");
            } else if distance > 58.0 {
                assert_eq!(*pixel, 0, "{at:?}");
            }
        }
    }
}

//! The one bridge between the engine's pictures and egui: a texture, and where it is painted.
//!
//! A picture of the size that was asked for is shown pixel for pixel on a rectangle of whole
//! physical pixels, by a pipeline of our own (`shaders/picture.wgsl`), so that every byte arrives
//! on screen as the engine wrote it. Other sizes are enlarged smoothly.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use eframe::egui::{
    Color32, ColorImage, Context, PaintCallbackInfo, Painter, Pos2, Rect, TextureHandle,
    TextureOptions, pos2, vec2,
};
use eframe::egui_wgpu;
pub use wgpu::TextureFormat as ScreenFormat;

use super::theme;
use crate::gpu::shader;
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
pub struct Viewport {
    /// What the window's surface holds.
    screen_format: wgpu::TextureFormat,
    checker: Option<TextureHandle>,
    /// Shared with what was queued for painting: a picture that comes in the same pass is shown
    /// by it.
    shown: Arc<Mutex<Option<Shown>>>,
}

/// A picture, and what painting it needs to know.
#[derive(Clone)]
struct Shown {
    picture: Arc<Picture>,
    has_holes: bool,
}

impl Viewport {
    /// Shows nothing yet, on a surface of `screen_format`.
    pub fn new(screen_format: wgpu::TextureFormat) -> Self {
        Self { screen_format, checker: None, shown: Arc::default() }
    }

    /// The picture on screen, if there is one.
    pub fn picture(&self) -> Option<Arc<Picture>> {
        lock(&self.shown).as_ref().map(|shown| Arc::clone(&shown.picture))
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
        let has_holes = picture.rgba.chunks_exact(4).any(|pixel| pixel[3] != 255);
        let place = |shown: &Shown| (shown.picture.requested_size, shown.has_holes);
        let shown = Shown { picture, has_holes };
        let mut slot = lock(&self.shown);
        let moved = slot.as_ref().map(place) != Some(place(&shown));
        *slot = Some(shown);
        moved
    }

    /// Paints the picture into `area`.
    ///
    /// A picture that was asked for at another size (the window was just resized) is scaled to
    /// the area's height, as the camera does, and centred.
    pub fn paint(&mut self, painter: &Painter, area: PixelArea) {
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
        let callback = PaintPicture {
            shown: Arc::clone(&self.shown),
            format: self.screen_format,
            area: area.size,
        };
        painter
            .with_clip_rect(area.rect)
            .add(egui_wgpu::Callback::new_paint_callback(rect, callback));
    }
}

/// Which pipeline paints a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Variant {
    format: wgpu::TextureFormat,
    /// Pixel for pixel, rather than enlarged.
    exact: bool,
    /// Over what is there, rather than instead of it.
    blended: bool,
}

/// One painting of one picture, as egui's renderer runs it.
struct PaintPicture {
    shown: Arc<Mutex<Option<Shown>>>,
    format: wgpu::TextureFormat,
    /// Size of the place on screen, physical pixels.
    area: [u32; 2],
}

/// What is kept on the window's device between paintings.
#[derive(Default)]
struct Kept {
    texture: Option<wgpu::Texture>,
    /// What the texture holds.
    picture: Option<Arc<Picture>>,
    pipelines: HashMap<Variant, wgpu::RenderPipeline>,
    /// The texture bound to a pipeline, and which.
    bound: Option<(Variant, wgpu::BindGroup)>,
}

impl Kept {
    /// Uploads a picture unless it is there already; the texture is kept while its size fits.
    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, picture: &Arc<Picture>) {
        if self.picture.as_ref().is_some_and(|kept| Arc::ptr_eq(kept, picture)) {
            return;
        }
        let [width, height] = picture.size;
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        if self.texture.as_ref().is_none_or(|texture| texture.size() != size) {
            // The bind group holds the old texture.
            self.bound = None;
            self.texture = Some(device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8Unorm,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            }));
        }
        let Some(texture) = &self.texture else { return };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * width),
            rows_per_image: None,
        };
        queue.write_texture(texture.as_image_copy(), &picture.rgba, layout, size);
        self.picture = Some(Arc::clone(picture));
    }

    fn bind(&mut self, device: &wgpu::Device, variant: Variant) {
        let Some(texture) = &self.texture else { return };
        if self.bound.as_ref().is_some_and(|(bound, _)| *bound == variant) {
            return;
        }
        let pipeline = self.pipelines.entry(variant).or_insert_with(|| pipeline(device, variant));
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("picture"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let view = texture.create_view(&Default::default());
        let picture = wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::TextureView(&view),
        };
        let smoothly =
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) };
        let entries = [picture, smoothly];
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("picture"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: if variant.exact { &entries[..1] } else { &entries },
        });
        self.bound = Some((variant, group));
    }
}

fn pipeline(device: &wgpu::Device, variant: Variant) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(shader::PICTURE.name),
        source: wgpu::ShaderSource::Wgsl(shader::PICTURE.source().into()),
    });
    let linear = f64::from(u8::from(variant.format.is_srgb()));
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shader::PICTURE.name),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(if variant.exact { "exact" } else { "enlarged" }),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &[("linear_target", linear)],
                ..Default::default()
            },
            targets: &[Some(wgpu::ColorTargetState {
                format: variant.format,
                blend: variant.blended.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

impl egui_wgpu::CallbackTrait for PaintPicture {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &egui_wgpu::ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut egui_wgpu::CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let Some(shown) = lock(&self.shown).clone() else { return Vec::new() };
        let picture = &shown.picture;
        let kept = resources.entry::<Kept>().or_insert_with(Kept::default);
        kept.upload(device, queue, picture);
        let variant = Variant {
            format: self.format,
            exact: picture.size == self.area && picture.requested_size == self.area,
            blended: shown.has_holes,
        };
        kept.bind(device, variant);
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &egui_wgpu::CallbackResources,
    ) {
        let Some(kept) = resources.get::<Kept>() else { return };
        let Some((variant, group)) = &kept.bound else { return };
        let Some(pipeline) = kept.pipelines.get(variant) else { return };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }
}

fn lock(shown: &Mutex<Option<Shown>>) -> MutexGuard<'_, Option<Shown>> {
    // Replaced in one step: a panic elsewhere leaves it whole.
    shown.lock().unwrap_or_else(PoisonError::into_inner)
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

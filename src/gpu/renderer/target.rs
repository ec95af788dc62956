//! The picture under way: cleared, encoded and brought back.

use super::Renderer;
use crate::core::LinearRgb;
use crate::gpu::buffers::{read_texture, texture};
use crate::gpu::clock::Timestamps;
use crate::gpu::compute::{bind_group, buffer, render_pass, view as picture_at};
use crate::gpu::frame::Pass;
use crate::gpu::layout;
use crate::gpu::target::{Target, WRITTEN, blended_format};
use crate::gpu::{GpuError, shader};

impl Renderer {
    pub(super) fn resize(&mut self, size: [u32; 2]) -> Result<(), GpuError> {
        let limit = self.context.limits.max_texture_dimension_2d;
        if size.iter().any(|&n| n > limit || n == 0) {
            return Err(GpuError::TooLarge {
                what: "a picture",
                limit: format!("{limit} pixels a side, and one at least,"),
                found: format!("{} × {}", size[0], size[1]),
                advice: "choose another size",
            });
        }
        self.make_target(size, WRITTEN);
        Ok(())
    }

    /// Makes the picture, which nothing was drawn on yet, one that splats can be blended over.
    pub(super) fn blend_light(&mut self) {
        let Some(target) = &self.target else { return };
        let (size, format) = (target.size, blended_format(&self.context));
        if self.make_target(size, format) {
            self.clear_light();
        }
    }

    /// A target of a size and a format; whether it is a new one.
    fn make_target(&mut self, size: [u32; 2], format: wgpu::TextureFormat) -> bool {
        if self.target.as_ref().is_some_and(|t| t.size == size && t.light.format() == format) {
            return false;
        }
        self.target = None;
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING;
        let light = texture(&self.context, "light", size, format, usage);
        self.target = Some(Target { size, light, encoded: None, staging: None });
        self.note_bytes();
        true
    }

    /// Nothing is drawn.
    pub(super) fn clear_light(&self) {
        let Some(target) = &self.target else { return };
        let mut encoder = self.context.device.create_command_encoder(&Default::default());
        let view = target.light.create_view(&Default::default());
        let ops = wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            store: wgpu::StoreOp::Store,
        };
        drop(render_pass(&mut encoder, "clear", &view, ops, None));
        self.context.queue.submit([encoder.finish()]);
    }

    /// The picture so far as sRGB bytes with straight alpha, rows from the top.
    ///
    /// # Errors
    /// A failing device.
    pub fn present(&mut self, background: Option<LinearRgb>) -> Result<Vec<u8>, GpuError> {
        let colour = background.unwrap_or_default().0;
        #[expect(clippy::cast_possible_truncation, reason = "colours in 0..=1")]
        let settings = layout::Present {
            background: [
                colour[0] as f32,
                colour[1] as f32,
                colour[2] as f32,
                f32::from(u8::from(background.is_some())),
            ],
        };
        self.context.queue.write_buffer(&self.present, 0, bytemuck::bytes_of(&settings));
        let Some(target) = &mut self.target else { return Ok(Vec::new()) };
        let size = target.size;
        let encoded = target.encoded.get_or_insert_with(|| {
            texture(
                &self.context,
                "encoded",
                size,
                wgpu::TextureFormat::Rgba8Unorm,
                wgpu::TextureUsages::empty(),
            )
        });
        let encoded = encoded.clone();
        self.note_bytes();
        self.run(&[Pass::Present])?;
        let Some(target) = &mut self.target else { return Ok(Vec::new()) };
        read_texture(&self.context, &encoded, size, 4, &mut target.staging)
    }

    /// The picture so far as premultiplied linear RGBA, rows from the top.
    ///
    /// # Errors
    /// A failing device.
    pub fn read_light(&mut self) -> Result<Vec<[f32; 4]>, GpuError> {
        let Some(target) = &mut self.target else { return Ok(Vec::new()) };
        let wide = target.light.format() == WRITTEN;
        let texel = if wide { 16 } else { 8 };
        let bytes =
            read_texture(&self.context, &target.light, target.size, texel, &mut target.staging)?;
        if wide {
            return Ok(bytemuck::pod_collect_to_vec(&bytes));
        }
        Ok(bytes
            .chunks_exact(8)
            .map(|t| {
                std::array::from_fn(|c| half::f16::from_le_bytes([t[2 * c], t[2 * c + 1]]).to_f32())
            })
            .collect())
    }

    pub(super) fn encode_present(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        clock: Option<&Timestamps>,
    ) {
        let pipeline = self.pipelines.present(&self.context).clone();
        let Some(target) = &self.target else { return };
        let Some(encoded) = &target.encoded else { return };
        let light = target.light.create_view(&Default::default());
        let entries = [buffer(0, &self.present), picture_at(1, &light)];
        let layout = pipeline.get_bind_group_layout(0);
        let group = bind_group(&self.context, shader::PRESENT.name, &layout, &entries);
        let view = encoded.create_view(&Default::default());
        let ops = wgpu::Operations::default();
        let mut render = render_pass(encoder, shader::PRESENT.name, &view, ops, clock);
        render.set_pipeline(&pipeline);
        render.set_bind_group(0, &group, &[]);
        render.draw(0..3, 0..1);
    }
}

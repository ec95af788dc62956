//! The picture under way: its light, its encoding, and bringing both back.

use super::buffers::{read_texture, texture};
use super::compute::{bind_group, render_pass};
use super::context::Context;
use super::frame::Pass;
use super::layout;
use super::renderer::Renderer;
use super::timing::Timestamps;
use super::{GpuError, shader};
use crate::core::LinearRgb;

/// The picture under way.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) size: [u32; 2],
    pub(super) light: wgpu::Texture,
    pub(super) encoded: Option<wgpu::Texture>,
    pub(super) staging: Option<wgpu::Buffer>,
}

/// What light is kept as.
pub(super) fn light_format(context: &Context) -> wgpu::TextureFormat {
    if context.granted.float32_blending {
        wgpu::TextureFormat::Rgba32Float
    } else {
        wgpu::TextureFormat::Rgba16Float
    }
}

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
        if self.target.as_ref().is_some_and(|t| t.size == size) {
            return Ok(());
        }
        self.target = None;
        let format = self.light_format();
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING;
        let light = texture(&self.context, "light", size, format, usage);
        self.target = Some(Target { size, light, encoded: None, staging: None });
        self.note_bytes();
        Ok(())
    }

    pub(super) fn light_format(&self) -> wgpu::TextureFormat {
        light_format(&self.context)
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
        let wide = self.context.granted.float32_blending;
        let Some(target) = &mut self.target else { return Ok(Vec::new()) };
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
        let bound = [self.present.as_entire_binding(), wgpu::BindingResource::TextureView(&light)];
        let layout = pipeline.get_bind_group_layout(0);
        let group = bind_group(&self.context, shader::PRESENT.name, &layout, bound);
        let view = encoded.create_view(&Default::default());
        let ops = wgpu::Operations::default();
        let mut render = render_pass(encoder, shader::PRESENT.name, &view, ops, clock);
        render.set_pipeline(&pipeline);
        render.set_bind_group(0, &group, &[]);
        render.draw(0..3, 0..1);
    }
}

//! Buffers that grow, targets, and bringing both back to the host.

use super::GpuError;
use super::context::Context;

/// A buffer that is replaced by a larger one when more is needed; its contents are not kept.
#[derive(Debug)]
pub(super) struct Growing {
    pub(super) buffer: wgpu::Buffer,
    label: &'static str,
    usage: wgpu::BufferUsages,
}

impl Growing {
    pub(super) fn new(context: &Context, label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self { buffer: Self::make(context, label, usage, 256), label, usage }
    }

    pub(super) fn make(
        context: &Context,
        label: &'static str,
        usage: wgpu::BufferUsages,
        size: u64,
    ) -> wgpu::Buffer {
        let size = size.next_multiple_of(16);
        let descriptor =
            wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        context.device.create_buffer(&descriptor)
    }

    /// Makes room for so many bytes, where there is less.
    ///
    /// # Errors
    /// More than a pass can be bound to.
    pub(super) fn reserve(&mut self, context: &Context, bytes: u64) -> Result<(), GpuError> {
        if self.buffer.size() >= bytes {
            return Ok(());
        }
        let limits = &context.limits;
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / 16 * 16;
        if bytes > most {
            return Err(GpuError::TooLarge {
                what: self.label,
                limit: format!("{most} bytes in one buffer"),
                found: bytes.to_string(),
                advice: "let less show, choose a smaller picture, or --engine native",
            });
        }
        // Half as much again, so that a slowly growing need does not reallocate every time.
        let size = (bytes + bytes / 2).min(most);
        self.buffer = Self::make(context, self.label, self.usage, size);
        Ok(())
    }
}

pub(super) fn texture(
    context: &Context,
    label: &str,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    more: wgpu::TextureUsages,
) -> wgpu::Texture {
    context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC | more,
        view_formats: &[],
    })
}

/// Does something with the bytes of a mappable buffer, once everything submitted is done.
pub(super) fn read_buffer<T>(
    context: &Context,
    buffer: &wgpu::Buffer,
    read: impl FnOnce(&[u8]) -> T,
) -> Result<T, GpuError> {
    buffer.map_async(wgpu::MapMode::Read, .., |_| ());
    context.finish()?;
    let found = {
        let bytes = buffer
            .get_mapped_range(..)
            .map_err(|error| GpuError::Device(format!("reading back: {error}")))?;
        read(&bytes)
    };
    buffer.unmap();
    Ok(found)
}

/// The first `bytes` of a buffer as words, once everything submitted is done.
pub(super) fn read_words(
    context: &Context,
    buffer: &wgpu::Buffer,
    bytes: u64,
) -> Result<Vec<u32>, GpuError> {
    if bytes == 0 {
        return Ok(Vec::new());
    }
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let staging = Growing::make(context, "words read back", usage, bytes);
    let mut encoder = context.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes);
    context.queue.submit([encoder.finish()]);
    read_buffer(context, &staging, |read| bytemuck::pod_collect_to_vec(&read[..bytes as usize]))
}

/// Bytes of a texture that are read back at once, but for a single row.
const MOST_READ_BYTES: u64 = 64 << 20;

/// The texels of a texture, rows from the top, without the padding that copies need. They come some rows at a
/// time: no buffer need be as large as a large picture.
pub(super) fn read_texture(
    context: &Context,
    texture: &wgpu::Texture,
    size: [u32; 2],
    texel_bytes: u32,
    staging: &mut Option<wgpu::Buffer>,
) -> Result<Vec<u8>, GpuError> {
    let row = size[0] * texel_bytes;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let most = MOST_READ_BYTES.min(context.limits.max_buffer_size) / u64::from(padded);
    #[expect(clippy::cast_possible_truncation, reason = "at most the height")]
    let rows = most.clamp(1, u64::from(size[1])) as u32;
    let bytes = u64::from(padded) * u64::from(rows);
    if staging.as_ref().is_none_or(|s| s.size() != bytes) {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        *staging = Some(Growing::make(context, "picture read back", usage, bytes));
    }
    let Some(buffer) = staging else { return Ok(Vec::new()) };
    let mut texels = Vec::with_capacity(row as usize * size[1] as usize);
    for first in (0..size[1]).step_by(rows as usize) {
        let height = rows.min(size[1] - first);
        let mut encoder = context.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x: 0, y: first, z: 0 },
                ..texture.as_image_copy()
            },
            wgpu::TexelCopyBufferInfo {
                buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d { width: size[0], height, depth_or_array_layers: 1 },
        );
        context.queue.submit([encoder.finish()]);
        read_buffer(context, buffer, |padded_rows| {
            for padded_row in padded_rows.chunks(padded as usize).take(height as usize) {
                texels.extend_from_slice(&padded_row[..row as usize]);
            }
        })?;
    }
    Ok(texels)
}

//! A reconstructed field on the device: its coefficients, and where it can show.

use rayon::prelude::*;

use super::GpuError;
use super::context::Context;
use crate::core::{Cancelled, Ticket};
use crate::hierarchy::{EMPTY_BRICK, FieldBounds};
use crate::kernel::{Coefficients, Kernel, RadialKernel};
use crate::transfer::Cumulative;
use crate::volume::{ScalarType, ScalarVolume};

/// The most samples that are stored twice, to halve the fetches: a gibibyte.
const MOST_PAIRS: u64 = 1 << 28;
/// Texels packed between two looks at the ticket.
const UPLOAD_TEXELS: usize = 1 << 20;

/// How a coefficient is stored; numbered as `reconstruct_slabs.wgsl` does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Format {
    /// 16 bits, beside those of the next sample along x: one fetch brings two.
    Pairs,
    /// 16 bits.
    Singles,
    /// 32-bit floats.
    Floats,
}

/// Coefficients on the device, with as many mirrored samples about them as their kernel reaches.
#[derive(Debug)]
pub(super) struct DeviceField {
    pub kernel: Kernel,
    pub extent: Option<f64>,
    pub texture: wgpu::TextureView,
    pub format: Format,
    /// The value that is stored as 0, and what the stored value 1 is more.
    pub offset: f64,
    pub scale: f64,
    /// Mirrored samples beyond each border.
    pub pad: usize,
    pub dims: [usize; 3],
    pub holes: wgpu::TextureView,
    pub has_holes: bool,
    /// Host copy for bounds, without mirrored samples.
    values: Vec<f32>,
    bias: f64,
    bounds: Option<(usize, FieldBounds)>,
    size_bytes: u64,
}

/// Samples to either side of a position that take part in its value.
pub(super) fn window(kernel: Kernel, extent: Option<f64>) -> usize {
    match kernel {
        Kernel::Point | Kernel::Nearest | Kernel::Linear => 1,
        Kernel::BSpline => 2,
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1..=16")]
        Kernel::Gaussian | Kernel::Cubic => RadialKernel::new(kernel, extent)
            .map_or(2.0, |radial| radial.radius().ceil().clamp(1.0, 16.0))
            as usize,
    }
}

impl DeviceField {
    pub(super) fn upload(
        context: &Context,
        volume: &ScalarVolume,
        kernel: Kernel,
        extent: Option<f64>,
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<Self, GpuError> {
        let Coefficients { dims, values, bias, min, max, holes, .. } = coefficients;
        let pad = window(kernel, extent);
        let stored = dims.map(|n| n + 2 * pad);
        let format = storage(context, stored, sixteen_bits_suffice(volume, min, max))?;
        let (offset, scale) = match format {
            Format::Floats => (bias, 1.0),
            Format::Pairs | Format::Singles => (min, (max - min).max(f64::MIN_POSITIVE)),
        };
        let index = |[x, y, z]: [usize; 3]| {
            let at = [x, y, z];
            let [x, y, z] = [0, 1, 2].map(|a| mirrored(at[a], pad, dims[a]));
            (z * dims[1] + y) * dims[0] + x
        };
        let code = |at: [usize; 3]| -> u16 {
            let share = (f64::from(values[index(at)]) + bias - min) / scale;
            // Rounded to the nearest of 65 536.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            let code = (share * 65535.0 + 0.5).clamp(0.0, 65535.0) as u16;
            code
        };
        let [sx, sy, sz] = stored;
        let (texture_format, texel_bytes) = match format {
            Format::Singles => (wgpu::TextureFormat::R16Uint, 2),
            Format::Pairs | Format::Floats => (wgpu::TextureFormat::R32Uint, 4),
        };
        let texture = empty_volume_texture(context, "field", stored, texture_format);
        let layers = (UPLOAD_TEXELS / (sx * sy)).max(1);
        for first in (0..sz).step_by(layers) {
            ticket.checkpoint(first as u64, sz as u64).map_err(|_| GpuError::Cancelled)?;
            let count = layers.min(sz - first);
            let mut bytes = vec![0_u8; sx * sy * count * texel_bytes];
            bytes.par_chunks_mut(sx * texel_bytes).enumerate().for_each(|(row, out)| {
                let (y, z) = (row % sy, first + row / sy);
                match format {
                    Format::Singles => {
                        for (x, texel) in out.chunks_exact_mut(2).enumerate() {
                            texel.copy_from_slice(&code([x, y, z]).to_le_bytes());
                        }
                    }
                    Format::Pairs => {
                        let mut next = code([0, y, z]);
                        for (x, texel) in out.chunks_exact_mut(4).enumerate() {
                            let this = next;
                            next = code([(x + 1).min(sx - 1), y, z]);
                            let pair = u32::from(this) | u32::from(next) << 16;
                            texel.copy_from_slice(&pair.to_le_bytes());
                        }
                    }
                    Format::Floats => {
                        for (x, texel) in out.chunks_exact_mut(4).enumerate() {
                            texel.copy_from_slice(&values[index([x, y, z])].to_le_bytes());
                        }
                    }
                }
            });
            write_layers(context, &texture, [sx, sy, count], first, texel_bytes, &bytes);
            // Let the copies go before the next ones are staged.
            context.queue.submit([]);
            context.finish()?;
        }
        let has_holes = holes.is_some();
        let (hole_dims, hole_bytes) = match holes {
            None => ([1; 3], vec![0]),
            Some(bits) => {
                let is_hole = |i: usize| (bits[i / 32] >> (i % 32) & 1) as u8;
                (dims, (0..values.len()).map(is_hole).collect())
            }
        };
        let format_of_holes = wgpu::TextureFormat::R8Uint;
        let holes = volume_texture(context, "holes", hole_dims, format_of_holes, &hole_bytes)?;
        Ok(Self {
            kernel,
            extent,
            texture: texture.create_view(&Default::default()),
            format,
            offset,
            scale,
            pad,
            dims,
            holes,
            has_holes,
            values,
            bias,
            bounds: None,
            size_bytes: (sx * sy * sz * texel_bytes + hole_bytes.len()) as u64,
        })
    }

    /// Bytes on the device.
    pub(super) fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    /// For each brick the distance to the nearest in which a position, or a step of `reach` voxels
    /// from it, can have a value that shows.
    pub(super) fn distances(
        &mut self,
        table: &Cumulative,
        reach: usize,
        ticket: &Ticket,
    ) -> Result<Vec<u8>, Cancelled> {
        if self.bounds.as_ref().is_none_or(|(known, _)| *known != reach) {
            // From floor(4b − ½ − reach) to floor(4b + 3½ + reach), and the kernel's own samples.
            let side = reach + window(self.kernel, self.extent);
            self.bounds =
                Some((reach, FieldBounds::of(&self.values, self.dims, side, side, ticket)?));
        }
        let Some((_, bounds)) = &self.bounds else { return Ok(Vec::new()) };
        // Half a step of 16 bits, and the rounding of 32.
        let slack = match self.format {
            Format::Floats => 0.0,
            Format::Pairs | Format::Singles => self.scale / 65535.0,
        };
        Ok(bounds.distances(|low, high| {
            let (low, high) = (f64::from(low) + self.bias, f64::from(high) + self.bias);
            let slack = slack + 1e-6 * low.abs().max(high.abs());
            table.shows(low - slack, high + slack)
        }))
    }

    /// Bricks along x, y, z.
    pub(super) fn bricks(&self) -> [usize; 3] {
        self.dims.map(|n| n.div_ceil(EMPTY_BRICK))
    }
}

/// The sample that stands at place `at` of a line with `pad` mirrored samples about its `n`.
fn mirrored(at: usize, pad: usize, n: usize) -> usize {
    if n == 1 {
        return 0;
    }
    let period = 2 * (n - 1);
    // Far enough up that the remainder is never taken of a negative number.
    let i = (at + period * pad.div_ceil(period) - pad) % period;
    i.min(period - i)
}

/// Whether 65 536 steps over the coefficients are fine enough: a quarter of a code of whole-number
/// data; of others a 4096th of the range that holds all values but the outer hundredths.
fn sixteen_bits_suffice(volume: &ScalarVolume, min: f64, max: f64) -> bool {
    let step = (max - min) / 65535.0;
    match volume.samples.scalar_type() {
        ScalarType::Float32 | ScalarType::Float64 => {
            let quantiles = &volume.statistics.quantiles;
            let last = quantiles.len().saturating_sub(1);
            let at = |share: f64| quantiles.get((share * last as f64) as usize);
            match (at(0.01), at(0.99)) {
                (Some(low), Some(high)) => step <= (high - low) / 4096.0,
                _ => true,
            }
        }
        _ => step <= 0.25,
    }
}

/// The quickest storage that fits the device.
fn storage(context: &Context, stored: [usize; 3], sixteen: bool) -> Result<Format, GpuError> {
    let limit = context.limits.max_texture_dimension_3d;
    if stored.iter().any(|&n| n as u64 > u64::from(limit)) {
        return Err(GpuError::TooLarge {
            what: "a volume in slabs",
            limit: format!("{limit} voxels a side with its borders"),
            found: format!("{} × {} × {}", stored[0], stored[1], stored[2]),
            advice: "open a subsampled copy, or choose --visibility every-sample",
        });
    }
    let samples: u64 = stored.iter().map(|&n| n as u64).product();
    Ok(match sixteen {
        true if samples <= MOST_PAIRS => Format::Pairs,
        true => Format::Singles,
        false => Format::Floats,
    })
}

/// A texture as large as a lattice.
fn empty_volume_texture(
    context: &Context,
    label: &str,
    dims: [usize; 3],
    format: wgpu::TextureFormat,
) -> wgpu::Texture {
    use wgpu::TextureUsages as Usage;
    let flat = dims[2] == 1 && format == wgpu::TextureFormat::Rgba32Float;
    let [width, height, depth_or_array_layers] = dims.map(|n| n as u32);
    context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: if flat { wgpu::TextureDimension::D2 } else { wgpu::TextureDimension::D3 },
        format,
        usage: Usage::TEXTURE_BINDING | Usage::COPY_DST,
        view_formats: &[],
    })
}

fn write_layers(
    context: &Context,
    texture: &wgpu::Texture,
    [width, height, layers]: [usize; 3],
    first: usize,
    texel_bytes: usize,
    bytes: &[u8],
) {
    context.queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: 0, y: 0, z: first as u32 },
            ..texture.as_image_copy()
        },
        bytes,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((width * texel_bytes) as u32),
            rows_per_image: Some(height as u32),
        },
        wgpu::Extent3d {
            width: width as u32,
            height: height as u32,
            depth_or_array_layers: layers as u32,
        },
    );
}

/// A texture filled with bytes, x fastest; a table of 32-bit floats where it has one layer.
pub(super) fn volume_texture(
    context: &Context,
    label: &str,
    dims: [usize; 3],
    format: wgpu::TextureFormat,
    bytes: &[u8],
) -> Result<wgpu::TextureView, GpuError> {
    let texture = empty_volume_texture(context, label, dims, format);
    let texels: usize = dims.iter().product();
    write_layers(context, &texture, dims, 0, bytes.len() / texels.max(1), bytes);
    context.check()?;
    Ok(texture.create_view(&Default::default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_are_mirrored_about_their_samples() {
        let line = |n, pad| (0..n + 2 * pad).map(|i| mirrored(i, pad, n)).collect::<Vec<_>>();
        assert_eq!(line(4, 2), [2, 1, 0, 1, 2, 3, 2, 1]);
        assert_eq!(line(1, 2), [0; 5]);
        assert_eq!(line(2, 3), [1, 0, 1, 0, 1, 0, 1, 0]);
        assert_eq!(line(3, 5)[..6], [1, 0, 1, 2, 1, 0]);
    }
}

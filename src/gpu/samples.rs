//! A volume's samples on the device: their own width up to 16 bits, 32-bit floats beyond.

use super::GpuError;
use super::buffers::Growing;
use super::context::Context;
use super::layout::{MOST_SAMPLE, NO_DATA};
use super::shade::CellsOfValues;
use crate::core::Ticket;
use crate::volume::{Samples, Scalar, ScalarVolume, Statistics};
use crate::with_samples;

/// Storage bindings that hold samples.
pub(super) const CHUNKS: usize = 4;
/// Samples converted between two looks at the ticket.
const UPLOAD_SAMPLES: usize = 1 << 20;

/// Samples on the device, in up to [`CHUNKS`] buffers.
#[derive(Debug)]
pub(super) struct DeviceSamples {
    pub chunks: Vec<wgpu::Buffer>,
    /// Samples in each buffer but the last.
    pub chunk_samples: u32,
    /// Bytes a sample takes on the device: 1, 2 or 4.
    pub width: u32,
    /// What was taken off each value before it was rounded to 32 bits,
    pub bias: f64,
    /// and what the rest was multiplied with.
    pub unit: f64,
    /// The value of the code 0.
    pub first: f64,
    pub size_bytes: u64,
}

/// What 32-bit floats are stored relative to: the end of the range nearest to zero where zero is
/// outside it, so that values near 1e6 with a spread of 1 keep their differences.
fn bias(statistics: &Statistics) -> f64 {
    0.0_f64.clamp(statistics.min, statistics.max)
}

/// Values that are farther from the bias than 32-bit floats reach, or nearer than these tell apart, are stored in a
/// unit of their own: a power of two, which rounds nothing.
fn unit(statistics: &Statistics, bias: f64) -> f64 {
    let farthest = (statistics.min - bias).abs().max((statistics.max - bias).abs());
    match farthest {
        0.0 | 1e-20..=1e20 => 1.0,
        _ => (-farthest.log2().clamp(-1020.0, 1020.0).round()).exp2(),
    }
}

/// Samples in each buffer but the last, of so many of a width in bytes, where a pass is bound to so many bytes in one
/// buffer: all alike, and as few buffers as will do.
///
/// # Errors
/// The most samples that there is room for.
fn share(samples: usize, width: usize, binding: u64) -> Result<usize, usize> {
    // Whole words, and numbers of 32 bits.
    let most = (binding / width as u64).min(1 << 31) as usize / 4 * 4;
    if samples > CHUNKS * most || u32::try_from(samples).is_err() {
        return Err((CHUNKS * most).min(u32::MAX as usize));
    }
    let shares = samples.div_ceil(most).max(1);
    Ok(samples.div_ceil(shares).next_multiple_of(4).max(4))
}

impl DeviceSamples {
    pub(super) fn upload(
        context: &Context,
        volume: &ScalarVolume,
        ticket: &Ticket,
    ) -> Result<Self, GpuError> {
        let bias = bias(&volume.statistics);
        let unit = unit(&volume.statistics, bias);
        match &*volume.samples {
            Samples::UInt8(values) => Self::codes(context, values, ticket, |v| v),
            Samples::Int8(values) => {
                let samples = Self::codes(context, values, ticket, |v| v.cast_unsigned() ^ 0x80)?;
                Ok(Self { first: f64::from(i8::MIN), ..samples })
            }
            Samples::UInt16(values) => Self::codes(context, values, ticket, |v| v),
            Samples::Int16(values) => {
                let samples = Self::codes(context, values, ticket, |v| v.cast_unsigned() ^ 0x8000)?;
                Ok(Self { first: f64::from(i16::MIN), ..samples })
            }
            wide => with_samples!(wide, values => {
                let samples = Self::codes(context, values, ticket, |v| {
                    to_f32(v.to_f64(), bias, unit)
                })?;
                Ok(Self { bias, unit, first: bias, ..samples })
            }),
        }
    }

    fn codes<T: Scalar, C: bytemuck::Pod>(
        context: &Context,
        values: &[T],
        ticket: &Ticket,
        code: impl Fn(T) -> C,
    ) -> Result<Self, GpuError> {
        let width = size_of::<C>();
        let binding =
            context.limits.max_storage_buffer_binding_size.min(context.limits.max_buffer_size);
        let chunk_samples =
            share(values.len(), width, binding).map_err(|most| GpuError::TooLarge {
                what: "a volume",
                limit: format!("{most} voxels"),
                found: format!("{} voxels", values.len()),
                advice: "open a subsampled copy, or choose an adapter with more memory",
            })?;
        let mut chunks = Vec::new();
        let mut size_bytes = 0;
        for (index, chunk) in values.chunks(chunk_samples).enumerate() {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            let buffer = Growing::make(context, "samples", usage, (chunk.len() * width) as u64);
            size_bytes += buffer.size();
            for (part, run) in chunk.chunks(UPLOAD_SAMPLES).enumerate() {
                let done = (index * chunk_samples + part * UPLOAD_SAMPLES) as u64;
                ticket.checkpoint(done, values.len() as u64).map_err(|_| GpuError::Cancelled)?;
                let mut codes: Vec<C> = run.iter().map(|&v| code(v)).collect();
                // Writes go in whole words.
                codes.resize(run.len().next_multiple_of(4 / width.min(4)), C::zeroed());
                let offset = (part * UPLOAD_SAMPLES * width) as u64;
                context.queue.write_buffer(&buffer, offset, bytemuck::cast_slice(&codes));
                // Let the copies go before the next ones are staged.
                context.queue.submit([]);
                context.finish()?;
            }
            chunks.push(buffer);
        }
        let [chunk_samples, width] = [chunk_samples, width].map(|n| n as u32);
        Ok(Self { chunks, chunk_samples, width, bias: 0.0, unit: 1.0, first: 0.0, size_bytes })
    }

    /// What is bound of them: bindings beyond the last chunk repeat it; no index leads there.
    pub(super) fn bound(&self) -> impl Iterator<Item = &wgpu::Buffer> {
        (0..CHUNKS).map(|i| &self.chunks[i.min(self.chunks.len() - 1)])
    }

    /// Where a value lies among what is stored.
    pub(super) fn values(&self) -> CellsOfValues {
        CellsOfValues { at_zero: -self.first * self.unit, per_value: self.unit }
    }

    /// What stands for a value in a table's span.
    pub(super) fn stored(&self, value: f64) -> f32 {
        to_f32(value, self.bias, self.unit)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "this is where 64 bits become 32")]
fn to_f32(value: f64, bias: f64, unit: f64) -> f32 {
    if value.is_nan() {
        return NO_DATA;
    }
    (((value - bias) * unit) as f32).clamp(-MOST_SAMPLE, MOST_SAMPLE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_of_large_values_survive_in_32_bits() {
        let statistics = Statistics::of(&Samples::Float64(vec![1e6, 1e6 + 1.0]), &Ticket::new());
        let bias = bias(&statistics.unwrap());
        assert_eq!(bias, 1e6);
        assert_eq!(to_f32(1e6 + 1.0 / 1024.0, bias, 1.0), 1.0 / 1024.0);
    }

    #[test]
    fn a_volume_of_1024_cubed_floats_takes_two_buffers_or_three_of_what_adapters_bind() {
        let samples = 1_usize << 30;
        // 2 GiB as most adapters say, 4 bytes less as some do; 1.5 GiB; 1 GiB and 4 bytes less than that.
        for (binding, buffers) in [
            (1_u64 << 32, 1),
            ((1 << 32) - 1, 2),
            (1 << 31, 2),
            ((1 << 31) - 4, 3),
            (3 << 29, 3),
            (1 << 30, 4),
        ] {
            let share = share(samples, 4, binding).expect("room");
            assert_eq!(samples.div_ceil(share), buffers, "{binding}");
            assert!(4 * share as u64 <= binding && share.is_multiple_of(4), "{binding}: {share}");
            // Alike but for whole words.
            assert!(samples - (buffers - 1) * share >= share - 4 * buffers, "{binding}: {share}");
        }
        assert_eq!(share(samples, 4, (1 << 30) - 4), Err((1 << 30) - 16));
        assert_eq!(share(samples, 1, (1 << 30) - 4), Ok(1 << 29));
    }

    #[test]
    fn nan_and_infinities_have_places_of_their_own() {
        assert_eq!(to_f32(f64::NAN, 0.0, 1.0), NO_DATA);
        assert_eq!(to_f32(f64::INFINITY, 0.0, 1.0), MOST_SAMPLE);
        assert_eq!(to_f32(-1e300, 5.0, 1.0), -MOST_SAMPLE);
        const { assert!(NO_DATA < -MOST_SAMPLE) }
    }

    #[test]
    fn values_that_single_precision_cannot_hold_have_a_unit_of_their_own() {
        for most in [1e300, 1e-300, f64::MAX, 5e-324] {
            let statistics = Statistics::of(&Samples::Float64(vec![0.0, most]), &Ticket::new());
            let statistics = statistics.unwrap();
            let unit = unit(&statistics, bias(&statistics));
            let stored = to_f32(most, 0.0, unit);
            assert!(stored.is_normal() && stored < 1e20, "{most}: {stored}");
            assert_eq!(unit.log2().fract(), 0.0, "a power of two");
        }
        let usual = Statistics::of(&Samples::Float64(vec![0.0, 255.0]), &Ticket::new()).unwrap();
        assert_eq!(unit(&usual, 0.0), 1.0);
    }
}

//! The device's own clock.

use super::GpuError;
use super::buffers::{self, Growing};
use super::context::Context;

/// Begin and end times of a fixed number of passes.
#[derive(Debug)]
pub(super) struct Timestamps {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
    passes: u32,
}

impl Timestamps {
    pub(super) fn new(context: &Context, passes: u32) -> Self {
        let size = u64::from(passes) * 16;
        let buffer = |label, usage| Growing::make(context, label, usage, size);
        Self {
            set: context.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: passes * 2,
            }),
            resolved: buffer(
                "timestamps",
                wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            ),
            staging: buffer(
                "timestamps read back",
                wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            ),
            passes,
        }
    }

    pub(super) fn compute(&self, pass: u32) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.set,
            beginning_of_pass_write_index: Some(2 * pass),
            end_of_pass_write_index: Some(2 * pass + 1),
        }
    }

    pub(super) fn render(&self, pass: u32) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.set,
            beginning_of_pass_write_index: Some(2 * pass),
            end_of_pass_write_index: Some(2 * pass + 1),
        }
    }

    pub(super) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.set, 0..self.passes * 2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.staging, 0, self.staging.size());
    }

    /// Milliseconds of each pass; the submit must be finished.
    pub(super) fn read_ms(&self, context: &Context) -> Result<Vec<f64>, GpuError> {
        let period_ms = f64::from(context.queue.get_timestamp_period()) / 1e6;
        let ticks: Vec<u64> = buffers::read_buffer(context, &self.staging, |ticks| {
            bytemuck::pod_collect_to_vec(ticks)
        })?;
        Ok(ticks.chunks_exact(2).map(|t| t[1].saturating_sub(t[0]) as f64 * period_ms).collect())
    }
}

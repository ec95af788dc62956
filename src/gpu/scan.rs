//! Counts, and where each one's own begin: summed by blocks, a workgroup each (`sum_counts`, `scan_counts`).

use super::GpuError;
use super::buffers::Growing;
use super::clock::Timestamps;
use super::compute::{bind_group, buffers, rows_of};
use super::context::Context;
use super::layout::{self, COUNT_HEADER_WORDS, SCAN_BLOCK};
use super::pipelines::{Pipelines, Program};
use super::shader;

/// Counts on the device, behind a draw's arguments.
#[derive(Debug)]
pub(super) struct Scan {
    settings: wgpu::Buffer,
    pub(super) counts: Growing,
    block_sums: Growing,
    /// Workgroups.
    blocks: u32,
}

impl Scan {
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        let size = size_of::<layout::Scan>() as u64;
        let settings = Growing::make(context, "scan", Usage::UNIFORM | Usage::COPY_DST, size);
        let storage = |label, more| Growing::new(context, label, Usage::STORAGE | more);
        Self {
            settings,
            counts: storage("counts", Usage::INDIRECT),
            block_sums: storage("sums of counts", Usage::empty()),
            blocks: 1,
        }
    }

    pub(super) fn size_bytes(&self) -> u64 {
        self.counts.buffer.size() + self.block_sums.buffer.size()
    }

    /// Makes ready to scan so many counts, of which `capacity` in all fit; each splat that is drawn has so many `corners`.
    pub(super) fn prepare(
        &mut self,
        context: &Context,
        count: u32,
        capacity: u32,
        corners: u32,
    ) -> Result<(), GpuError> {
        self.blocks = count.div_ceil(SCAN_BLOCK).max(1);
        self.counts.reserve(context, 4 * (u64::from(count) + COUNT_HEADER_WORDS as u64))?;
        self.block_sums.reserve(context, 4 * u64::from(self.blocks))?;
        let settings = layout::Scan { counts: [count, capacity, corners, 0] };
        context.queue.write_buffer(&self.settings, 0, bytemuck::bytes_of(&settings));
        Ok(())
    }

    /// Encodes both steps as one pass; sums are added to `totals`.
    pub(super) fn encode(
        &self,
        (context, pipelines): (&Context, &mut Pipelines),
        encoder: &mut wgpu::CommandEncoder,
        totals: &wgpu::Buffer,
        clock: Option<&Timestamps>,
    ) {
        let bound = [&self.settings, &self.counts.buffer, &self.block_sums.buffer, totals];
        let [across, down, deep] = rows_of(self.blocks);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(shader::SCAN_COUNTS.name),
            timestamp_writes: clock.map(|c| c.compute(0)),
        });
        for (shader, bindings) in [(shader::SUM_COUNTS, 3), (shader::SCAN_COUNTS, 4)] {
            let pipeline = pipelines.compute(context, &Program::plain(shader));
            let entries: Vec<_> = buffers(0, bound.into_iter().take(bindings)).collect();
            let layout = pipeline.get_bind_group_layout(0);
            let group = bind_group(context, shader.name, &layout, &entries);
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(across, down, deep);
        }
    }
}

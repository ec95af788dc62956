//! Kernels as footprint triangles: uploaded records, and those that a grid's voxels give.

use super::Renderer;
use crate::gpu::buffers::read_words;
use crate::gpu::clock::Timestamps;
use crate::gpu::compute::{bind_group, buffers, dispatch, groups_of, render_pass};
use crate::gpu::frame::{self, Source};
use crate::gpu::layout::{self, Record, SEGMENT_THREADS};
use crate::gpu::pipelines::Program;
use crate::gpu::triangles::GridTotals;
use crate::gpu::{GpuError, shader};
use crate::kernel::Kernel;
use crate::scene::View;
use crate::volume::BRICK;
use std::ops::Range;

impl Renderer {
    /// Draws records over the picture, in their order, and waits; returns wall milliseconds.
    ///
    /// # Errors
    /// A failing device.
    pub fn draw_records(&mut self, records: &[Record]) -> Result<f64, GpuError> {
        if records.is_empty() {
            return Ok(0.0);
        }
        let bytes: &[u8] = bytemuck::cast_slice(records);
        self.uploads.reserve(&self.context, bytes.len() as u64)?;
        self.context.queue.write_buffer(&self.uploads.buffer, 0, bytes);
        self.variant.one_footprint = false;
        self.blend_light();
        let count = u32::try_from(records.len())
            .map_err(|_| GpuError::Device("over 2^32 records at once".to_owned()))?;
        self.run(&frame::node_piece(count))
    }

    /// Segments that each row of the traversal has.
    pub fn segments_per_row(&self, view: &View) -> u32 {
        let Some(volume) = &self.volume else { return 0 };
        let n = volume.source.lattice.dims[view.traversal.axes[2]];
        // One more where the eye's brick is walked from both its ends.
        #[expect(clippy::cast_possible_truncation, reason = "an axis has at most 65535 voxels")]
        let segments = n.div_ceil(BRICK) as u32 + 1;
        segments
    }

    /// Draws every voxel with opacity of some rows of the traversal, far to near: at most
    /// `capacity` of them. [`Renderer::grid_totals`] tells whether that was enough. Returns
    /// milliseconds as [`Renderer::draw_records`] does.
    ///
    /// # Errors
    /// A failing device.
    pub fn draw_rows(
        &mut self,
        view: &View,
        rows: Range<u32>,
        capacity: u64,
    ) -> Result<f64, GpuError> {
        let segments = rows.len() as u32 * self.segments_per_row(view);
        if segments == 0 || capacity == 0 {
            return Ok(0.0);
        }
        let record_bytes = size_of::<Record>() as u64;
        let most = self.context.limits.max_storage_buffer_binding_size / record_bytes * 2 / 3;
        if capacity > most {
            return Err(GpuError::Device(format!("{capacity} kernels in one piece")));
        }
        self.variant.one_footprint = view.eye_distance.is_none();
        self.blend_light();
        let corners = self.corner_count();
        self.scan.prepare(&self.context, segments, capacity as u32, corners)?;
        self.records.reserve(&self.context, capacity * record_bytes)?;
        self.note_bytes();
        self.write_traversal(view, &rows, capacity as u32);
        self.run(&frame::grid_piece(segments))
    }

    /// Waits for the pieces drawn so far and sums them up.
    ///
    /// # Errors
    /// A failing device.
    pub fn grid_totals(&mut self) -> Result<GridTotals, GpuError> {
        let words = read_words(&self.context, &self.totals, 16)?;
        Ok(GridTotals { kernels: u64::from(words[0]), most_missing: u64::from(words[1]) })
    }

    /// The first `count` records that the piece drawn last has emitted, in their order; for tests.
    ///
    /// # Errors
    /// A failing device.
    #[doc(hidden)]
    pub fn read_records(&self, count: u64) -> Result<Vec<Record>, GpuError> {
        let bytes = (count * size_of::<Record>() as u64).min(self.records.buffer.size());
        let words = read_words(&self.context, &self.records.buffer, bytes)?;
        Ok(bytemuck::pod_collect_to_vec(&words))
    }

    pub(super) fn write_traversal(&self, view: &View, rows: &Range<u32>, capacity: u32) {
        let Some(volume) = &self.volume else { return };
        let Some(table) = &volume.table else { return };
        let [x, y, z] = volume.source.lattice.dims.map(|n| n as u32);
        let [bx, by, bz] = volume.source.bricks.dims.map(|n| n as u32);
        let [a, b, c] = view.traversal.axes.map(|n| n as u32);
        let [sa, sb, sc] = view.traversal.splits.map(|n| n as u32);
        let constants = layout::Traversal {
            dims: [x, y, z, volume.samples.width],
            bricks: [bx, by, bz, volume.samples.chunk_samples],
            axes: [a, b, c, self.segments_per_row(view)],
            splits: [sa, sb, sc, rows.start],
            counts: [rows.len() as u32, capacity, table.no_data, 0],
            table: table.span,
        };
        self.context.queue.write_buffer(&self.traversal, 0, bytemuck::bytes_of(&constants));
    }

    pub(super) fn walk_segments(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shader: shader::Shader,
        threads: u32,
        clock: Option<&Timestamps>,
    ) {
        let pipeline = self.pipelines.compute(&self.context, &Program::plain(shader));
        let mut bound: Vec<&wgpu::Buffer> = Vec::new();
        let Some(volume) = &self.volume else { return };
        let Some(table) = &volume.table else { return };
        bound.push(&self.traversal);
        bound.extend(volume.samples.bound());
        bound.extend([&table.entries, &table.visible, &self.scan.counts.buffer]);
        if shader.name == shader::EMIT_KERNELS.name {
            bound.push(&self.records.buffer);
        }
        let entries: Vec<_> = buffers(0, bound).collect();
        let groups = groups_of(threads, SEGMENT_THREADS);
        dispatch(&self.context, encoder, shader.name, &pipeline, &entries, groups, clock);
    }

    pub(super) fn splat(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        source: Source,
        clock: Option<&Timestamps>,
    ) {
        let pipeline = self.pipelines.splat(&self.context, self.variant).clone();
        let Some(target) = &self.target else { return };
        let mesh = self.mesh.as_ref().filter(|_| self.variant.kernel == Kernel::Gouraud);
        // Meshes alone count what they cap.
        let totals = mesh.map(|_| &self.totals);
        let entries: Vec<_> = buffers(0, [&self.frame].into_iter().chain(totals)).collect();
        let layout = pipeline.get_bind_group_layout(0);
        let group = bind_group(&self.context, shader::SPLAT.name, &layout, &entries);
        let view = target.light.create_view(&Default::default());
        let ops = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
        let mut render = render_pass(encoder, shader::SPLAT.name, &view, ops, clock);
        render.set_pipeline(&pipeline);
        render.set_bind_group(0, &group, &[]);
        if let Some(mesh) = mesh {
            render.set_vertex_buffer(1, mesh.corners.slice(..));
            render.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint16);
        }
        match source {
            Source::Emitted => {
                render.set_vertex_buffer(0, self.records.buffer.slice(..));
                match mesh {
                    Some(_) => render.draw_indexed_indirect(&self.scan.counts.buffer, 0),
                    None => render.draw_indirect(&self.scan.counts.buffer, 0),
                }
            }
            Source::Uploaded(records) => {
                render.set_vertex_buffer(0, self.uploads.buffer.slice(..));
                match mesh {
                    Some(mesh) => render.draw_indexed(0..mesh.index_count, 0, 0..records),
                    None => render.draw(0..self.variant.vertices(), 0..records),
                }
            }
        }
    }
}

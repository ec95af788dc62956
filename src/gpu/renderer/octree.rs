//! The finest levels of an octree are merged.

use super::Renderer;
use crate::gpu::buffers::read_words;
use crate::gpu::clock::Timestamps;
use crate::gpu::compute::{buffer, buffers, dispatch};
use crate::gpu::context::OctreeBuilder;
use crate::gpu::frame::Pass;
use crate::gpu::layout::narrow;
use crate::gpu::octree::{BrickBuffers, BrickRows, MergedBricks, bricks_of, merged};
use crate::gpu::pipelines::Program;
use crate::gpu::{GpuError, layout, shader};
use crate::hierarchy::{ErrorMeasure, Node};
use crate::volume::ScalarVolume;

impl Renderer {
    /// Whether the device is to build octrees of a volume with errors of `measure`: where it is the one
    /// that does, the measure is of voxels, and 32 bits have room for the range of values.
    pub fn builds_octree(&self, volume: &ScalarVolume, measure: ErrorMeasure) -> bool {
        let range = volume.statistics.max / 2.0 - volume.statistics.min / 2.0;
        let has_room = match measure {
            ErrorMeasure::Classified => true,
            ErrorMeasure::Scalar => range < f64::from(layout::MOST_SAMPLE) / 2.0,
            ErrorMeasure::OpticalDepth => false,
        };
        self.context.octrees == OctreeBuilder::Device && has_room
    }

    /// Merges rows of bricks of the volume and under the table that were set last, and waits.
    ///
    /// # Errors
    /// A failing device.
    pub fn merge_bricks(&mut self, rows: &BrickRows) -> Result<MergedBricks, GpuError> {
        let start = std::time::Instant::now();
        let Some(volume) = &self.volume else {
            return Err(GpuError::Device("bricks came before their volume".to_owned()));
        };
        let Some(table) = &volume.table else {
            return Err(GpuError::Device("bricks came before their table".to_owned()));
        };
        let source = &volume.source;
        let dims = source.lattice.dims;
        let counts = [source.bricks.dims[0], rows.y.len(), rows.z.len()];
        let bricks: usize = counts.iter().product();
        let levels = bricks_of(dims, &rows.y, &rows.z).map(|dims| dims.iter().product::<usize>());
        let begin = [0, levels[0], levels[0] + levels[1]];
        let node_bytes =
            if rows.has_nodes { size_of::<Node>() * levels.iter().sum::<usize>() } else { 0 };
        let brick_bytes = bricks * size_of::<layout::Brick>();
        let buffers = self.bricks.get_or_insert_with(|| BrickBuffers::new(&self.context));
        buffers.bricks.reserve(&self.context, brick_bytes as u64)?;
        buffers.nodes.reserve(&self.context, node_bytes as u64)?;

        // Of the samples as they are stored: codes count from the value of the first entry.
        let statistics = &source.statistics;
        let zero = match volume.samples.width {
            1 | 2 => f64::from(table.span[0]),
            _ => volume.samples.bias,
        };
        let [low, high] =
            [statistics.min, statistics.max].map(|v| (v - zero) * volume.samples.unit);
        let per_range = if high > low { 1.0 / (high - low) } else { 0.0 };
        let by_value = u32::from(rows.measure == ErrorMeasure::Scalar);
        let [x, y, z] = counts.map(|n| n as u32);
        let begin = begin.map(|n| n as u32);
        #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
        let piece = layout::BrickPiece {
            first: [0, rows.y.start as u32, rows.z.start as u32, u32::from(rows.has_nodes)],
            bricks: [x, y, z, by_value],
            nodes: [begin[0], begin[1], begin[2], volume.samples.width],
            scale: [rows.voxel_depth, narrow(low), narrow(high), narrow(per_range)],
        };
        self.context.queue.write_buffer(&buffers.piece, 0, bytemuck::bytes_of(&piece));
        let [nx, ny, nz] = dims.map(|n| n as u32);
        let [bx, by, bz] = source.bricks.dims.map(|n| n as u32);
        let traversal = layout::Traversal {
            dims: [nx, ny, nz, volume.samples.width],
            bricks: [bx, by, bz, volume.samples.chunk_samples],
            axes: [0; 4],
            splits: [0; 4],
            counts: [0, 0, table.no_data, 0],
            table: table.span,
        };
        self.context.queue.write_buffer(&self.traversal, 0, bytemuck::bytes_of(&traversal));
        self.note_bytes();
        self.run(&[Pass::MergeBricks { bricks: [x, y, z] }])?;

        let Some(buffers) = &self.bricks else { return Err(GpuError::Cancelled) };
        let found = read_words(&self.context, &buffers.bricks.buffer, brick_bytes as u64)?;
        let bricks =
            bytemuck::cast_slice::<u32, layout::Brick>(&found).iter().map(merged).collect();
        let found = read_words(&self.context, &buffers.nodes.buffer, node_bytes as u64)?;
        let mut found: &[Node] = bytemuck::cast_slice(&found);
        let nodes = levels.map(|count| {
            let level = found.split_off(..count.min(found.len()));
            level.unwrap_or_default().to_vec()
        });
        Ok(MergedBricks { bricks, nodes, wall_ms: start.elapsed().as_secs_f64() * 1e3 })
    }

    /// Lets go of what building octrees took.
    pub fn drop_bricks(&mut self) {
        self.bricks = None;
    }

    pub(super) fn encode_bricks(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        groups: [u32; 3],
        clock: Option<&Timestamps>,
    ) {
        let (Some(volume), Some(held)) = (&self.volume, &self.bricks) else { return };
        let Some(table) = &volume.table else { return };
        let pipeline = self.pipelines.compute(&self.context, &Program::plain(shader::MERGE_BRICKS));
        let mut entries = vec![buffer(0, &self.traversal)];
        entries.extend(buffers(1, volume.samples.bound()));
        entries.extend(buffers(5, [&table.entries, &table.visible, &held.piece]));
        entries.extend(buffers(8, [&held.bricks.buffer, &held.nodes.buffer]));
        let name = shader::MERGE_BRICKS.name;
        dispatch(&self.context, encoder, name, &pipeline, &entries, groups, clock);
    }
}

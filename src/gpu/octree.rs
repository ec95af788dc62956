//! The finest levels of an octree, merged on the device from the samples and the table that it holds.

use std::ops::Range;

use super::buffers::Growing;
use super::context::Context;
use super::layout;
use crate::hierarchy::{BRICK_LEVELS, ErrorMeasure, MergedBrick, Node, Sums};
use crate::volume::BRICK;

/// Whole rows of a volume's bricks, and what is asked of them.
#[derive(Debug, Clone, PartialEq)]
pub struct BrickRows {
    /// Bricks along y.
    pub y: Range<usize>,
    /// Bricks along z.
    pub z: Range<usize>,
    /// Thickness of a voxel in opacity unit distances.
    pub voxel_depth: f32,
    /// What errors are of: not optical depths.
    pub measure: ErrorMeasure,
    /// Whether nodes are wanted beside what level 4 is made of.
    pub has_nodes: bool,
}

/// What they come to.
#[derive(Debug, Clone, PartialEq)]
pub struct MergedBricks {
    /// A brick each, x fastest.
    pub bricks: Vec<MergedBrick>,
    /// Nodes of levels 1, 2, 3, x fastest; empty where none were asked for.
    pub nodes: [Vec<Node>; BRICK_LEVELS],
    /// Wall milliseconds, of reading back, too.
    pub wall_ms: f64,
}

/// Buffers of a piece.
#[derive(Debug)]
pub(super) struct BrickBuffers {
    pub(super) piece: wgpu::Buffer,
    pub(super) bricks: Growing,
    pub(super) nodes: Growing,
}

impl BrickBuffers {
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        let size = size_of::<layout::BrickPiece>() as u64;
        let result = Usage::STORAGE | Usage::COPY_SRC;
        Self {
            piece: Growing::make(context, "bricks' piece", Usage::UNIFORM | Usage::COPY_DST, size),
            bricks: Growing::new(context, "merged bricks", result),
            nodes: Growing::new(context, "nodes of bricks", result),
        }
    }

    pub(super) fn size_bytes(&self) -> u64 {
        self.piece.size() + self.bricks.buffer.size() + self.nodes.buffer.size()
    }
}

/// Nodes along each axis of each level in whole rows of bricks of a volume of `dims` voxels.
pub fn bricks_of(
    dims: [usize; 3],
    y: &Range<usize>,
    z: &Range<usize>,
) -> [[usize; 3]; BRICK_LEVELS] {
    let voxels = |n: usize, rows: &Range<usize>| (rows.end * BRICK).min(n) - rows.start * BRICK;
    let voxels = [dims[0], voxels(dims[1], y), voxels(dims[2], z)];
    std::array::from_fn(|level| voxels.map(|n| n.div_ceil(2 << level)))
}

pub(super) fn merged(brick: &layout::Brick) -> MergedBrick {
    let layout::Brick { appearance, emission, count, weight, m2, effective, error, .. } = *brick;
    MergedBrick {
        sums: Sums { count, weight, appearance, m2, emission, effective, error },
        slices: std::array::from_fn(|axis| {
            let words = [brick.slices[2 * axis], brick.slices[2 * axis + 1]];
            bytemuck::cast(words.map(u32::to_le_bytes))
        }),
    }
}

//! Scattered kernels (octree cuts) by lists: binned by tile and layer, sorted, composited in one loop.
//!
//! A rectangle of tiles at a time: the records are projected and counted, each writes an entry for
//! every tile and layer that it touches, the entries are sorted by tile and layer, and each pixel
//! walks its tile's list. The sort is stable and the records come in the order of compositing, so
//! that the order is total: the same records make the same bits.

use super::GpuError;
use super::buffers::Growing;
use super::context::Context;
use super::layout::{self, Record};
use super::pipelines::ListVariant;
use super::scan::Scan;
use super::sort::Sorter;
use crate::kernel::Kernel;
use crate::scene::SplatSettings;

/// 64 MiB of keys and words.
const MOST_ENTRIES: u32 = 1 << 22;
/// Vec4s of a projected kernel.
const PROJECTED_VEC4S: u64 = 4;
/// The most turns of a kernel's thread, which walks rows and tiles and writes its entries, on adapters that end loops.
pub(super) const MOST_TURNS: u32 = 65_000;

/// Kernels to draw by lists, and how.
#[derive(Debug, Clone, Copy)]
pub struct Scattered<'a> {
    /// Back to front.
    pub records: &'a [Record],
    /// Visibility, slabs per voxel, opacity model and order count; kernel and extent are those of
    /// `Renderer::begin`.
    pub settings: &'a SplatSettings,
    /// Front to back, a pixel is done once less of what lies behind shows through; 0 for never.
    pub stop_below: f32,
    /// Milliseconds between two calls of the observer, about.
    pub piece_ms: f64,
    /// Entries that there is room for at first, at most.
    pub room: u32,
    /// The most entries that are sorted at once, where a rectangle of tiles can still be halved.
    pub most_entries: u32,
}

impl<'a> Scattered<'a> {
    /// With room for whatever comes.
    pub fn new(records: &'a [Record], settings: &'a SplatSettings) -> Self {
        Self {
            records,
            settings,
            stop_below: 0.0,
            piece_ms: 10.0,
            room: u32::MAX,
            most_entries: MOST_ENTRIES,
        }
    }
}

/// What drawing by lists came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ListTotals {
    /// Kernel, tile, layer: entries that were sorted.
    pub entries: u64,
    /// How often entries had too little room, and were written again.
    pub rewritten: u32,
    /// Rectangles of tiles that lists were made for.
    pub rectangles: u32,
    /// False where the observer stopped it.
    pub finished: bool,
}

/// What lists are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ListsOf {
    /// Records of kernels.
    Kernels,
    /// Vector splats, which stay on the device from one picture to the next.
    Vectors,
}

/// What lists take on the device.
#[derive(Debug)]
pub(super) struct Lists {
    pub(super) sorter: Sorter,
    pub(super) settings: wgpu::Buffer,
    pub(super) scan: Scan,
    pub(super) totals: wgpu::Buffer,
    pub(super) records: Growing,
    pub(super) bounds: Growing,
    pub(super) projected: Growing,
    pub(super) ranges: Growing,
    /// Where the last sort left its keys.
    pub(super) side: usize,
    pub(super) of: ListsOf,
    pub(super) variant: ListVariant,
}

impl Lists {
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        let small = |label| {
            Growing::make(context, label, Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC, 16)
        };
        let storage = |label| Growing::new(context, label, Usage::STORAGE | Usage::COPY_DST);
        Self {
            sorter: Sorter::new(context),
            settings: Growing::make(
                context,
                "lists",
                Usage::STORAGE | Usage::COPY_DST,
                size_of::<layout::Lists>() as u64,
            ),
            scan: Scan::new(context),
            totals: small("entry totals"),
            records: storage("scattered records"),
            bounds: storage("bounds"),
            projected: storage("projected kernels"),
            ranges: Growing::new(
                context,
                "tile ranges",
                Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC,
            ),
            side: 0,
            of: ListsOf::Kernels,
            variant: ListVariant {
                kernel: Kernel::Cubic,
                perspective: false,
                slabs: false,
                front_to_back: false,
                published: false,
            },
        }
    }

    pub(super) fn size_bytes(&self) -> u64 {
        let own = [&self.records, &self.bounds, &self.projected, &self.ranges];
        let bytes = own.iter().map(|g| g.buffer.size()).sum::<u64>();
        self.sorter.size_bytes() + self.scan.size_bytes() + bytes
    }

    /// Makes room for what is kept of so many kernels.
    pub(super) fn reserve(&mut self, context: &Context, count: u64) -> Result<(), GpuError> {
        self.bounds.reserve(context, 16 * count)?;
        self.projected.reserve(context, 16 * PROJECTED_VEC4S * count)
    }

    /// Lists that were made: projected kernels, keys, words, and the ranges of tiles.
    pub(super) fn made(&self) -> [&wgpu::Buffer; 4] {
        [
            &self.projected.buffer,
            &self.sorter.keys[self.side].buffer,
            &self.sorter.words[self.side].buffer,
            &self.ranges.buffer,
        ]
    }

    /// Uploads the records.
    pub(super) fn load(&mut self, context: &Context, records: &[Record]) -> Result<(), GpuError> {
        let count = records.len() as u64;
        self.records.reserve(context, count * size_of::<Record>() as u64)?;
        self.reserve(context, count)?;
        self.of = ListsOf::Kernels;
        context.queue.write_buffer(&self.records.buffer, 0, bytemuck::cast_slice(records));
        Ok(())
    }
}

pub(super) fn too_many(found: String) -> GpuError {
    GpuError::TooLarge {
        what: "layers of slabs over a tile of the picture",
        limit: format!("{} entries", super::MOST_KEYS),
        found,
        advice: "choose fewer --slabs-per-voxel",
    }
}

//! Scattered kernels (octree cuts) by lists: binned by tile and layer, sorted, composited in one loop.
//!
//! A rectangle of tiles at a time: the records are projected and counted, each writes an entry for
//! every tile and layer that it touches, the entries are sorted by tile and layer, and each pixel
//! walks its tile's list. The sort is stable and the records come in the order of compositing, so
//! that the order is total: the same records make the same bits.

use super::GpuError;
use super::buffers::{Growing, read_words};
use super::compute::{compute, groups_of};
use super::context::Context;
use super::frame::{self, Pass};
use super::layout::{self, COUNT_HEADER_WORDS, LAYER_SLABS, LIST_THREADS, Record, TILE};
use super::pipelines::ListVariant;
use super::renderer::Renderer;
use super::shader;
use super::share::share_constants;
use super::sort::Sorter;
use super::timing::Timestamps;
use crate::kernel::{Kernel, RadialKernel};
use crate::scene::{OpacityModel, Order, SplatSettings, View, Visibility};

/// 64 MiB of keys and words.
const MOST_ENTRIES: u32 = 1 << 22;
/// Bits of a layer's number: beyond, single precision would not tell slabs apart.
const MOST_LAYER_BITS: u32 = 22;
/// Vec4s of a projected kernel.
const PROJECTED_VEC4S: u64 = 4;

/// Kernels to draw by lists, and how.
#[derive(Debug, Clone, Copy)]
pub struct Scattered<'a> {
    /// Back to front.
    pub records: &'a [Record],
    /// Visibility, slabs per voxel, opacity model and order count; kernel and extent are those of
    /// [`Renderer::begin`].
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
    /// Published opacities that were over 1, all pixels and layers together.
    pub capped: u64,
    /// False where the observer stopped it.
    pub finished: bool,
}

/// What lists take on the device.
#[derive(Debug)]
pub(super) struct Lists {
    pub(super) sorter: Sorter,
    settings: wgpu::Buffer,
    scan: wgpu::Buffer,
    totals: wgpu::Buffer,
    capped: wgpu::Buffer,
    records: Growing,
    counts: Growing,
    bounds: Growing,
    projected: Growing,
    ranges: Growing,
    /// Where the last sort left its keys.
    side: usize,
    variant: ListVariant,
}

impl Lists {
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        let uniform = |label, size: usize| {
            Growing::make(context, label, Usage::UNIFORM | Usage::COPY_DST, size as u64)
        };
        let small = |label| {
            Growing::make(context, label, Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC, 16)
        };
        let storage = |label| Growing::new(context, label, Usage::STORAGE | Usage::COPY_DST);
        Self {
            sorter: Sorter::new(context),
            settings: uniform("lists", size_of::<layout::Lists>()),
            scan: uniform("entry scan", size_of::<layout::Scan>()),
            totals: small("entry totals"),
            capped: small("capped"),
            records: storage("scattered records"),
            counts: storage("entry counts"),
            bounds: storage("bounds"),
            projected: storage("projected kernels"),
            ranges: storage("tile ranges"),
            side: 0,
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
        let own = [&self.records, &self.counts, &self.bounds, &self.projected, &self.ranges];
        self.sorter.size_bytes() + own.iter().map(|g| g.buffer.size()).sum::<u64>()
    }

    /// Uploads the records.
    fn load(&mut self, context: &Context, records: &[Record]) {
        let count = records.len() as u64;
        self.records.reserve(context, count * size_of::<Record>() as u64);
        self.counts.reserve(context, 4 * (count + 1 + COUNT_HEADER_WORDS as u64));
        self.bounds.reserve(context, 16 * count);
        self.projected.reserve(context, 16 * PROJECTED_VEC4S * count);
        context.queue.write_buffer(&self.records.buffer, 0, bytemuck::cast_slice(records));
        context.queue.write_buffer(&self.capped, 0, &[0; 16]);
    }
}

/// Tiles of a picture: first column and row, columns, rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Rectangle([u32; 4]);

impl Rectangle {
    fn of(size: [u32; 2]) -> Self {
        Self([0, 0, size[0].div_ceil(TILE), size[1].div_ceil(TILE)])
    }

    fn tiles(self) -> u32 {
        self.0[2] * self.0[3]
    }

    /// Its halves, across the longer side; `None` for a single tile.
    fn halves(self) -> Option<[Self; 2]> {
        let [x, y, columns, rows] = self.0;
        if self.tiles() < 2 {
            return None;
        }
        Some(if columns > rows {
            let left = columns / 2;
            [Self([x, y, left, rows]), Self([x + left, y, columns - left, rows])]
        } else {
            let top = rows / 2;
            [Self([x, y, columns, top]), Self([x, y + top, columns, rows - top])]
        })
    }
}

/// Bits that hold the numbers below `count`.
fn bits_below(count: u32) -> u32 {
    u32::BITS - count.saturating_sub(1).leading_zeros()
}

/// Layers of slabs that hold every kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Layers {
    /// The nearest, counted from the one behind the lattice's centre.
    first: i32,
    count: u32,
    /// Thickness of a slab in pixels of view depth.
    slab: f64,
}

impl Layers {
    const ONE: Self = Self { first: 0, count: 1, slab: 0.0 };

    /// Slabs' faces lie at whole multiples of the smallest spacing / `slabs_per_voxel` from the
    /// middle of the lattice, in view depth; `radius` is the kernel's, in voxels.
    fn of(view: &View, records: &[Record], radius: f64, slabs_per_voxel: f64) -> Option<Self> {
        let m = view.view_from_index;
        let spacing = m.x_axis.length().min(m.y_axis.length()).min(m.z_axis.length());
        let slab = spacing / slabs_per_voxel;
        let depth = glam::DVec3::new(m.x_axis.z, m.y_axis.z, m.z_axis.z);
        let (mut near, mut far) = (0.0_f64, 0.0_f64);
        for record in records {
            let [xy, z, _] = record.packed;
            let size = [xy & 0xffff, xy >> 16, z & 0xffff].map(f64::from);
            let middle =
                (glam::Vec3::from(record.centre).as_dvec3() - view.lattice_centre).dot(depth);
            let reach = (glam::DVec3::from(size) * depth).length() * radius;
            near = near.min(middle - reach);
            far = far.max(middle + reach);
        }
        let layer = slab * f64::from(LAYER_SLABS);
        // One more on each side: the device rounds.
        let (first, last) = ((near / layer).floor() - 1.0, (far / layer).floor() + 1.0);
        let count = last - first + 1.0;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "2^22 at most")]
        (count <= f64::from(1_u32 << MOST_LAYER_BITS)).then_some(Self {
            first: first as i32,
            count: count as u32,
            slab,
        })
    }
}

fn too_many(found: String) -> GpuError {
    GpuError::TooLarge {
        what: "layers of slabs over a tile of the picture",
        limit: format!("{} entries", super::MOST_KEYS),
        found,
        advice: "choose fewer --slabs-per-voxel",
    }
}

impl Renderer {
    /// Draws records by lists, as the whole picture that [`Renderer::begin`] began, and waits.
    ///
    /// `piece_done` is told how much is drawn after each piece; false stops. Every-sample draws the
    /// picture of [`Renderer::draw_records`]. In slabs a kernel gives each its own integral along the
    /// pixel's ray, where in perspective the kernel is seen as in its middle; a box gives its chord's
    /// part, a point all of it to the slab of its centre.
    ///
    /// # Errors
    /// Sheets, more layers than can be told apart, or a failing device.
    pub fn draw_scattered(
        &mut self,
        view: &View,
        what: &Scattered<'_>,
        piece_done: &mut dyn FnMut(&mut Self, f64) -> bool,
    ) -> Result<ListTotals, GpuError> {
        let settings = what.settings;
        let slabs = match settings.visibility {
            Visibility::Sheets => return Err(GpuError::NoSheets),
            Visibility::Slabs => true,
            Visibility::EverySample => false,
        };
        let count = u32::try_from(what.records.len())
            .map_err(|_| GpuError::Device("over 2^32 records at once".to_owned()))?;
        if count == 0 {
            return Ok(ListTotals { finished: true, ..ListTotals::default() });
        }
        let kernel = self.variant.kernel;
        let layers = if slabs {
            let radius = RadialKernel::new(kernel, settings.extent).map_or(0.9, |k| k.radius());
            Layers::of(view, what.records, radius, settings.slabs_per_voxel)
                .ok_or_else(|| too_many(format!("over 2^{MOST_LAYER_BITS} layers")))?
        } else {
            Layers::ONE
        };
        let lists = self.lists.get_or_insert_with(|| Lists::new(&self.context));
        lists.load(&self.context, what.records);
        lists.variant = ListVariant {
            kernel,
            perspective: view.eye_distance.is_some(),
            slabs,
            front_to_back: settings.order == Order::FrontToBack,
            published: settings.opacity_model == OpacityModel::Published,
        };
        let mut totals = ListTotals::default();
        let whole = Rectangle::of(view.size);
        let mut left = vec![whole];
        let mut done = 0;
        while let Some(rectangle) = left.pop() {
            let plan = Plan { rectangle, layers, count, stop_below: what.stop_below };
            let Some(entries) = self.make_lists(&plan, what, &mut totals)? else {
                let halves = rectangle.halves().ok_or_else(|| {
                    too_many(format!("{count} kernels in {} layers", layers.count))
                })?;
                // The upper or left one comes off first.
                left.extend([halves[1], halves[0]]);
                continue;
            };
            totals.entries += u64::from(entries);
            totals.rectangles += 1;
            let mut rows = 0;
            let mut step = 1;
            while rows < rectangle.0[3] {
                let end = (rows + step).min(rectangle.0[3]);
                self.write_lists(&plan, 0, entries, rows..end);
                let tiles = [rectangle.0[2], end - rows];
                let wall_ms = self.run(&[Pass::CompositeLists { tiles }])?;
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "positive, and clamped"
                )]
                let fitting = (f64::from(end - rows) * what.piece_ms / wall_ms.max(0.01)) as u32;
                done += tiles[0] * tiles[1];
                step = fitting.clamp(1, step * 4);
                rows = end;
                if !piece_done(self, f64::from(done) / f64::from(whole.tiles())) {
                    return Ok(totals);
                }
            }
        }
        if let Some(lists) = &self.lists {
            totals.capped = u64::from(read_words(&self.context, &lists.capped, 4)?[0]);
        }
        totals.finished = true;
        Ok(totals)
    }

    /// Makes the sorted lists of a rectangle; how many entries they have, or `None` where it must be
    /// halved first. Entries that do not fit are counted all the same, and written again with room
    /// for all of them.
    fn make_lists(
        &mut self,
        plan: &Plan,
        what: &Scattered<'_>,
        totals: &mut ListTotals,
    ) -> Result<Option<u32>, GpuError> {
        if plan.key_bits() > u32::BITS - 1 {
            return Ok(None);
        }
        let Some(lists) = &mut self.lists else { return Ok(Some(0)) };
        let tiles = u64::from(plan.rectangle.tiles());
        lists.ranges.reserve(&self.context, 8 * tiles);
        let mut capacity = what.room.min(lists.sorter.capacity());
        let scan = layout::Scan { counts: [plan.count + 1, capacity, 0, 0] };
        self.context.queue.write_buffer(&lists.scan, 0, bytemuck::bytes_of(&scan));
        self.context.queue.write_buffer(&lists.totals, 0, &[0; 16]);
        self.write_lists(plan, capacity, 0, 0..0);
        self.run(&frame::list_entries(plan.count))?;
        let Some(lists) = &mut self.lists else { return Ok(Some(0)) };
        let counted = read_words(&self.context, &lists.totals, 8)?;
        let demanded = counted[0].saturating_add(counted[1]);
        let bindable = self.context.limits.max_storage_buffer_binding_size / 4;
        let most = match plan.rectangle.tiles() {
            1 => super::MOST_KEYS,
            _ => what.most_entries.min(super::MOST_KEYS),
        };
        if u64::from(demanded) > u64::from(most).min(bindable) {
            return Ok(None);
        }
        if demanded > capacity {
            lists.sorter.reserve(&self.context, demanded);
            capacity = demanded;
            totals.rewritten += 1;
            self.write_lists(plan, capacity, 0, 0..0);
            self.run(&[Pass::WriteEntries { records: plan.count }])?;
        }
        let Some(lists) = &mut self.lists else { return Ok(Some(0)) };
        let (mut passes, side) = lists.sorter.prepare(&self.context, demanded, plan.key_bits());
        lists.side = side;
        passes.push(Pass::FindRanges { entries: demanded });
        self.note_bytes();
        self.write_lists(plan, capacity, demanded, 0..0);
        self.run(&passes)?;
        Ok(Some(demanded))
    }

    fn write_lists(&self, plan: &Plan, capacity: u32, entries: u32, rows: std::ops::Range<u32>) {
        let Some(lists) = &self.lists else { return };
        let Layers { first, count, slab } = plan.layers;
        let whole = |n: u32| n.cast_signed();
        #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
        let settings = layout::Lists {
            tiles: plan.rectangle.0,
            counts: [plan.count, capacity, bits_below(count), entries],
            layers: [first, whole(count), whole(rows.start), whole(rows.end - rows.start)],
            slabs: [slab as f32, plan.stop_below, 0.0, 0.0],
            shares: share_constants(lists.variant.kernel),
        };
        self.context.queue.write_buffer(&lists.settings, 0, bytemuck::bytes_of(&settings));
    }

    pub(super) fn encode_lists(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        pass: Pass,
        clock: Option<&Timestamps>,
    ) {
        let Some(lists) = &self.lists else { return };
        let Some(target) = &self.target else { return };
        let light = target.light.create_view(&Default::default());
        let settings = lists.settings.as_entire_binding();
        let frame = self.frame.as_entire_binding();
        let keys = &lists.sorter.keys[lists.side].buffer;
        let words = &lists.sorter.words[lists.side].buffer;
        let context = &self.context;
        let threads = |n| groups_of(n, LIST_THREADS);
        let pipelines = &mut self.pipelines;
        let (pipeline, bound, groups) = match pass {
            Pass::CountEntries { records } => (
                pipelines.lists(context, shader::COUNT_ENTRIES, lists.variant),
                vec![
                    frame,
                    settings,
                    lists.records.buffer.as_entire_binding(),
                    lists.counts.buffer.as_entire_binding(),
                    lists.bounds.buffer.as_entire_binding(),
                    lists.projected.buffer.as_entire_binding(),
                ],
                threads(records),
            ),
            Pass::ScanEntries => (
                pipelines.compute(context, shader::SCAN_SEGMENTS),
                vec![
                    lists.scan.as_entire_binding(),
                    lists.counts.buffer.as_entire_binding(),
                    lists.totals.as_entire_binding(),
                ],
                [1, 1],
            ),
            Pass::WriteEntries { records } => (
                pipelines.compute(context, shader::WRITE_ENTRIES),
                vec![
                    settings,
                    lists.counts.buffer.as_entire_binding(),
                    lists.bounds.buffer.as_entire_binding(),
                    lists.sorter.keys[0].buffer.as_entire_binding(),
                    lists.sorter.words[0].buffer.as_entire_binding(),
                ],
                threads(records),
            ),
            Pass::FindRanges { entries } => {
                // Tiles that nothing touches keep 0 to 0.
                encoder.clear_buffer(&lists.ranges.buffer, 0, None);
                (
                    pipelines.compute(context, shader::FIND_RANGES),
                    vec![
                        settings,
                        keys.as_entire_binding(),
                        lists.ranges.buffer.as_entire_binding(),
                    ],
                    threads(entries),
                )
            }
            Pass::CompositeLists { tiles } => (
                pipelines.lists(context, shader::COMPOSITE_LISTS, lists.variant),
                vec![
                    frame,
                    settings,
                    lists.projected.buffer.as_entire_binding(),
                    keys.as_entire_binding(),
                    words.as_entire_binding(),
                    lists.ranges.buffer.as_entire_binding(),
                    lists.capped.as_entire_binding(),
                    wgpu::BindingResource::TextureView(&light),
                ],
                tiles,
            ),
            _ => return,
        };
        compute(context, encoder, pipeline, pass, &bound, groups, clock);
    }
}

/// Lists of one rectangle.
#[derive(Debug, Clone, Copy)]
struct Plan {
    rectangle: Rectangle,
    layers: Layers,
    /// Records.
    count: u32,
    stop_below: f32,
}

impl Plan {
    fn key_bits(&self) -> u32 {
        bits_below(self.rectangle.tiles()) + bits_below(self.layers.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_the_whole_and_end_at_single_tiles() {
        let mut left = vec![Rectangle::of([100, 33])];
        assert_eq!(left[0], Rectangle([0, 0, 13, 5]));
        let mut seen = std::collections::BTreeSet::new();
        while let Some(rectangle) = left.pop() {
            match rectangle.halves() {
                Some(halves) => left.extend(halves),
                None => assert!(seen.insert(rectangle.0), "{rectangle:?} twice"),
            }
        }
        assert_eq!(seen.len(), 65);
        assert!(seen.iter().all(|&[x, y, w, h]| x < 13 && y < 5 && (w, h) == (1, 1)));
    }

    #[test]
    fn as_many_bits_as_the_largest_number_has() {
        assert_eq!([1, 2, 3, 4, 5, 1 << 22].map(bits_below), [0, 1, 2, 2, 3, 22]);
    }
}

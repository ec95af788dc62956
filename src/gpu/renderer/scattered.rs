//! Octree cuts by lists.

use super::Renderer;
use crate::core::Pace;
use crate::gpu::GpuError;
use crate::gpu::buffers::read_words;
use crate::gpu::clock::Timestamps;
use crate::gpu::compute::{buffer, buffers, dispatch, groups_of, view as picture_at};
use crate::gpu::frame::{self, Pass};
use crate::gpu::layout::{self, GROUP_TILES, LIST_THREADS};
use crate::gpu::list_plan::{Layers, MOST_LAYER_BITS, Plan, Rectangle, bits_below};
use crate::gpu::pipelines::{ListVariant, Program};
use crate::gpu::scattered::{ListTotals, Lists, ListsOf, MOST_TURNS, Scattered, too_many};
use crate::gpu::shader;
use crate::kernel::RadialKernel;
use crate::scene::{OpacityModel, Order, View, Visibility};

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
            let radius =
                RadialKernel::new(kernel, settings.splatted_extent()).map_or(0.9, |k| k.radius());
            Layers::of(view, what.records, radius, settings.slabs_per_voxel)
                .ok_or_else(|| too_many(format!("over 2^{MOST_LAYER_BITS} layers")))?
        } else {
            Layers::ONE
        };
        let lists = self.lists.get_or_insert_with(|| Lists::new(&self.context));
        lists.load(&self.context, what.records)?;
        lists.variant = ListVariant {
            kernel,
            perspective: view.eye_distance.is_some(),
            slabs,
            front_to_back: settings.order == Order::FrontToBack,
            published: settings.opacity_model == OpacityModel::Published,
        };
        let mut totals = ListTotals::default();
        let whole = Rectangle::of(view.size);
        // Halved where its lists come out too long.
        let mut left = vec![whole];
        let mut done = 0;
        while let Some(rectangle) = left.pop() {
            let half_size = view.size.map(|n| n as f32 / 2.0);
            let plan = Plan { rectangle, layers, count, stop_below: what.stop_below, half_size };
            let room = (what.room, what.most_entries);
            let Some(entries) = self.make_lists(&plan, room, &mut totals)? else {
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
            let mut pace = Pace::new(1, 1);
            while rows < rectangle.0[3] {
                let end = (rows + pace.piece()).min(rectangle.0[3]);
                let tiles = [rectangle.0[2], end - rows];
                self.write_lists(&plan, 0, entries, rows..end);
                let wall_ms = self.run(&[Pass::CompositeLists { tiles }])?;
                self.check_loops()?;
                pace.learn(f64::from(end - rows), wall_ms, what.piece_ms);
                done += tiles[0] * tiles[1];
                rows = end;
                if !piece_done(self, f64::from(done) / f64::from(whole.tiles())) {
                    return Ok(totals);
                }
            }
        }
        totals.finished = true;
        Ok(totals)
    }

    /// Makes the sorted lists of a rectangle, and says how many entries they have; `None` where it must be halved
    /// first. Entries that do not fit are counted all the same, and written again with room for all of them.
    pub(super) fn make_lists(
        &mut self,
        plan: &Plan,
        (room, most_entries): (u32, u32),
        totals: &mut ListTotals,
    ) -> Result<Option<u32>, GpuError> {
        let rectangle = plan.rectangle;
        // A kernel's thread walks the tiles that it touches.
        let turns = rectangle.tiles() + rectangle.0[3];
        if plan.key_bits() > u32::BITS - 1 || self.context.ends_loops && turns > MOST_TURNS {
            return Ok(None);
        }
        let Some(lists) = &mut self.lists else { return Ok(Some(0)) };
        let tiles = u64::from(plan.rectangle.tiles());
        // One more for entries of no tile.
        lists.ranges.reserve(&self.context, 8 * (tiles + 1))?;
        let mut capacity = room.min(lists.sorter.capacity());
        lists.scan.prepare(&self.context, plan.count + 1, capacity, 0)?;
        self.context.queue.write_buffer(&lists.totals, 0, &[0; 16]);
        let passes = match lists.of {
            ListsOf::Kernels => frame::list_entries(plan.count),
            ListsOf::Vectors => frame::vector_entries(plan.count),
        };
        self.write_lists(plan, capacity, 0, 0..0);
        self.run(&passes)?;
        let Some(lists) = &mut self.lists else { return Ok(Some(0)) };
        let counted = read_words(&self.context, &lists.totals, 12)?;
        let demanded = counted[0].saturating_add(counted[1]);
        let bindable = self.context.limits.max_storage_buffer_binding_size / 4;
        let most = match plan.rectangle.tiles() {
            1 => crate::gpu::MOST_KEYS,
            _ => most_entries.min(crate::gpu::MOST_KEYS),
        };
        let turns = turns.saturating_add(counted[2]);
        if u64::from(demanded) > u64::from(most).min(bindable)
            || self.context.ends_loops && turns > MOST_TURNS
        {
            return Ok(None);
        }
        if demanded > capacity {
            lists.sorter.reserve(&self.context, demanded)?;
            capacity = demanded;
            totals.rewritten += 1;
            self.write_lists(plan, capacity, 0, 0..0);
            self.run(&[Pass::WriteEntries { records: plan.count }])?;
        }
        let Some(lists) = &mut self.lists else { return Ok(Some(0)) };
        let (mut passes, side) = lists.sorter.prepare(&self.context, demanded, plan.key_bits())?;
        lists.side = side;
        passes.push(Pass::FindRanges { entries: demanded });
        self.note_bytes();
        self.write_lists(plan, capacity, demanded, 0..0);
        self.run(&passes)?;
        Ok(Some(demanded))
    }

    /// `rows` of tiles to composite.
    fn write_lists(&self, plan: &Plan, capacity: u32, entries: u32, rows: std::ops::Range<u32>) {
        let Some(lists) = &self.lists else { return };
        let Layers { first, count, slab } = plan.layers;
        let whole = |n: u32| n.cast_signed();
        #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
        let settings = layout::Lists {
            tiles: plan.rectangle.0,
            counts: [plan.count, capacity, bits_below(count), entries],
            layers: [first, whole(count), whole(rows.start), whole(rows.end - rows.start)],
            slabs: [slab as f32, plan.stop_below, plan.half_size[0], plan.half_size[1]],
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
        let (settings, frame) = (&lists.settings, &self.frame);
        let keys = &lists.sorter.keys[lists.side].buffer;
        let words = &lists.sorter.words[lists.side].buffer;
        let [bounds, projected, ranges] =
            [&lists.bounds, &lists.projected, &lists.ranges].map(|b| &b.buffer);
        let counts = &lists.scan.counts.buffer;
        let totals = &lists.totals;
        let context = &self.context;
        let threads = |n| groups_of(n, LIST_THREADS);
        let vector_bindings =
            self.vectors.as_ref().map(crate::gpu::vectors::DeviceVectors::counted);
        let of_lists = |shader| lists.variant.program(shader);
        let (program, bound, groups) = match pass {
            Pass::CountEntries { records } => (
                of_lists(shader::COUNT_ENTRIES),
                vec![frame, settings, &lists.records.buffer, counts, bounds, projected, totals],
                threads(records),
            ),
            Pass::CountVectors { splats } => {
                let Some([records, vectors]) = vector_bindings else { return };
                (
                    of_lists(shader::COUNT_VECTORS),
                    vec![frame, settings, records, counts, bounds, projected, totals, vectors],
                    threads(splats),
                )
            }
            Pass::ScanEntries => {
                let device = (context, &mut self.pipelines);
                return lists.scan.encode(device, encoder, totals, clock);
            }
            Pass::WriteEntries { records } => {
                let [keys, words] = [&lists.sorter.keys, &lists.sorter.words].map(|s| &s[0].buffer);
                (
                    of_lists(shader::WRITE_ENTRIES),
                    vec![settings, counts, bounds, projected, keys, words],
                    threads(records),
                )
            }
            Pass::FindRanges { entries } => {
                // Tiles that nothing touches keep 0 to 0.
                encoder.clear_buffer(ranges, 0, None);
                (
                    Program::plain(shader::FIND_RANGES),
                    vec![settings, keys, ranges],
                    threads(entries),
                )
            }
            Pass::CompositeLists { tiles } => (
                of_lists(shader::COMPOSITE_LISTS),
                vec![frame, settings, projected, keys, words, ranges],
                [tiles[0].div_ceil(GROUP_TILES), tiles[1], 1],
            ),
            _ => return,
        };
        let pipeline = self.pipelines.compute(context, &program);
        let mut entries: Vec<_> = buffers(0, bound).collect();
        if matches!(pass, Pass::CompositeLists { .. }) {
            entries.extend([picture_at(6, &light), buffer(8, &self.totals)]);
        }
        dispatch(context, encoder, pass.name(), &pipeline, &entries, groups, clock);
    }
}

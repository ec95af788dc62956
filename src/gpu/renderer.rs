//! Runs passes: the target, the buffers between passes, and reading back.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use super::buffers::{Growing, read_texture, read_words, texture};
use super::compute::{compute, groups_of};
use super::constants::frame_constants;
use super::context::Context;
use super::frame::{self, Pass, PassTime, Source};
use super::gather::Gathering;
use super::layout::{self, COUNT_HEADER_WORDS, Record, SEGMENT_THREADS};
use super::pipelines::{Pipelines, SplatVariant};
use super::samples::{CHUNKS, DeviceSamples};
use super::scattered::Lists;
use super::slabs::{PictureConstants, SlabPass, step_reach};
use super::timing::{Timer, Timestamps};
use super::{GpuError, shader};
use crate::core::{LinearRgb, Ticket};
use crate::kernel::{Coefficients, Kernel};
use crate::scene::{SplatSettings, View};
use crate::transfer::{Cumulative, Table};
use crate::volume::{BRICK, ScalarVolume};

/// Draws pieces of one picture at a time. Everything it holds can be made again from the scene.
#[derive(Debug)]
pub struct Renderer {
    pub(super) context: Context,
    pub(super) pipelines: Pipelines,
    timer: Option<Timer>,
    pub(super) frame: wgpu::Buffer,
    pub(super) traversal: wgpu::Buffer,
    scan: wgpu::Buffer,
    pub(super) totals: wgpu::Buffer,
    present: wgpu::Buffer,
    records: Growing,
    uploads: Growing,
    counts: Growing,
    pub(super) volume: Option<DeviceVolume>,
    pub(super) target: Option<Target>,
    pub(super) variant: SplatVariant,
    pub(super) slabs: SlabPass,
    /// The mode of the slabs being drawn.
    slab_settings: SplatSettings,
    pub(super) gathering: Gathering,
    /// Lists of scattered kernels, from the first time that they are asked for.
    pub(super) lists: Option<Lists>,
    times: Vec<PassTime>,
    peak_bytes: u64,
}

/// A volume and its classification on the device.
#[derive(Debug)]
pub(super) struct DeviceVolume {
    pub(super) source: Arc<ScalarVolume>,
    pub(super) samples: DeviceSamples,
    pub(super) table: Option<DeviceTable>,
}

#[derive(Debug)]
pub(super) struct DeviceTable {
    pub(super) entries: wgpu::Buffer,
    pub(super) visible: wgpu::Buffer,
    /// First and last brick along x, y, z that can show; the first beyond the last where none can.
    pub(super) showing: [[usize; 3]; 2],
    /// `Traversal::table`: span, entries per unit, last entry.
    span: [f32; 4],
}

/// The picture under way.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) size: [u32; 2],
    pub(super) light: wgpu::Texture,
    encoded: Option<wgpu::Texture>,
    staging: Option<wgpu::Buffer>,
}

/// What the grid pieces since [`Renderer::begin`] have drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridTotals {
    /// Kernels drawn.
    pub kernels: u64,
    /// The most that a piece had beyond the room it was given; 0 when all of them fitted.
    pub most_missing: u64,
}

impl Renderer {
    /// A renderer on its own device, with nothing compiled or allocated yet.
    pub fn new(context: Context) -> Self {
        use wgpu::BufferUsages as Usage;
        let uniform = |label, size: usize| {
            Growing::make(&context, label, Usage::UNIFORM | Usage::COPY_DST, size as u64)
        };
        Self {
            frame: uniform("frame", size_of::<layout::Frame>()),
            traversal: uniform("traversal", size_of::<layout::Traversal>()),
            scan: uniform("scan", size_of::<layout::Scan>()),
            present: uniform("present", size_of::<layout::Present>()),
            totals: Growing::make(
                &context,
                "totals",
                Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC,
                16,
            ),
            records: Growing::new(
                &context,
                "records",
                Usage::STORAGE | Usage::VERTEX | Usage::COPY_SRC,
            ),
            uploads: Growing::new(&context, "uploads", Usage::VERTEX | Usage::COPY_DST),
            counts: Growing::new(
                &context,
                "counts",
                Usage::STORAGE | Usage::INDIRECT | Usage::COPY_SRC,
            ),
            slabs: SlabPass::new(&context),
            slab_settings: SplatSettings::EXACT,
            pipelines: Pipelines::default(),
            timer: None,
            volume: None,
            target: None,
            variant: SplatVariant {
                kernel: Kernel::Cubic,
                perspective: false,
                one_footprint: false,
            },
            gathering: Gathering::new(&context),
            lists: None,
            times: Vec::new(),
            peak_bytes: 0,
            context,
        }
    }

    /// The device underneath.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Times every pass from now on; each is then submitted on its own where the device's clock
    /// cannot be believed.
    ///
    /// # Errors
    /// Where the device fails.
    pub fn time_passes(&mut self) -> Result<Timer, GpuError> {
        let timer = super::timing::choose(&self.context)?;
        self.timer = Some(timer);
        Ok(timer)
    }

    /// Passes go together again, untimed.
    pub fn stop_timing(&mut self) {
        self.timer = None;
    }

    /// Pass times since [`Renderer::begin`].
    pub fn times(&self) -> &[PassTime] {
        &self.times
    }

    /// Most bytes held on the device at once, as this program allocates them.
    pub fn peak_bytes(&self) -> u64 {
        self.peak_bytes
    }

    /// Pipelines compiled so far.
    pub fn pipeline_count(&self) -> usize {
        self.pipelines.len() + self.slabs.pipeline_count() + self.gathering.len()
    }

    /// Uploads a volume unless it is there already.
    ///
    /// # Errors
    /// Too large, cancelled, or a failing device.
    pub fn set_volume(
        &mut self,
        volume: &Arc<ScalarVolume>,
        ticket: &Ticket,
    ) -> Result<(), GpuError> {
        if self.volume.as_ref().is_some_and(|held| Arc::ptr_eq(&held.source, volume)) {
            return Ok(());
        }
        // The old one goes first: two need not fit.
        self.volume = None;
        self.slabs.clear();
        if volume.lattice.dims.iter().any(|&n| n > 0xffff) {
            return Err(GpuError::TooLarge {
                what: "an axis",
                limit: "65535 voxels".to_owned(),
                found: format!("{:?}", volume.lattice.dims),
                advice: "open a subsampled copy",
            });
        }
        let samples = DeviceSamples::upload(&self.context, volume, ticket)?;
        self.volume = Some(DeviceVolume { source: Arc::clone(volume), samples, table: None });
        self.note_bytes();
        Ok(())
    }

    /// Sets the classification of the volume that was set last.
    ///
    /// # Errors
    /// A failing device.
    pub fn set_table(&mut self, table: &Table) -> Result<(), GpuError> {
        let Some(volume) = &mut self.volume else {
            return Err(GpuError::Device("a table came before its volume".to_owned()));
        };
        let storage = |label, bytes: &[u8]| {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            let buffer = Growing::make(&self.context, label, usage, bytes.len() as u64);
            self.context.queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        let ranges = &volume.source.bricks.ranges;
        let bricks = volume.source.bricks.dims;
        let mut visible = vec![0_u32; ranges.len().div_ceil(32)];
        let mut showing = [[usize::MAX; 3], [0; 3]];
        for (index, &[low, high]) in ranges.iter().enumerate() {
            let shows = low <= high && table.greatest_extinction(low, high) > 0.0;
            visible[index / 32] |= u32::from(shows) << (index % 32);
            if shows {
                let at = [
                    index % bricks[0],
                    index / bricks[0] % bricks[1],
                    index / bricks[0] / bricks[1],
                ];
                for axis in 0..3 {
                    showing[0][axis] = showing[0][axis].min(at[axis]);
                    showing[1][axis] = showing[1][axis].max(at[axis]);
                }
            }
        }
        let last = table.entries.len() - 1;
        let coordinate = table.coordinate;
        let low = coordinate.offset - volume.samples.bias;
        #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
        let span = [
            low as f32,
            (low + last as f64 / coordinate.scale) as f32,
            coordinate.scale as f32,
            last as f32,
        ];
        volume.table = Some(DeviceTable {
            entries: storage("table", bytemuck::cast_slice(&table.entries)),
            visible: storage("visible bricks", bytemuck::cast_slice(&visible)),
            showing,
            span,
        });
        self.note_bytes();
        self.context.check()
    }

    /// Begins a picture: a cleared target of the view's size, and the frame's constants.
    ///
    /// `unit_distance` is the world length over which the table's extinctions are given.
    ///
    /// # Errors
    /// A picture beyond the device's limits, or a failing device.
    pub fn begin(
        &mut self,
        view: &View,
        kernel: Kernel,
        extent: Option<f64>,
        unit_distance: f64,
    ) -> Result<(), GpuError> {
        self.resize(view.size)?;
        self.times.clear();
        self.variant =
            SplatVariant { kernel, perspective: view.eye_distance.is_some(), one_footprint: false };
        let constants = frame_constants(view, kernel, extent, unit_distance);
        self.context.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&constants));
        self.context.queue.write_buffer(&self.totals, 0, &[0; 16]);
        self.context.queue.write_buffer(self.slabs.capped(), 0, &[0; 16]);
        let Some(target) = &self.target else { return Ok(()) };
        let mut encoder = self.context.device.create_command_encoder(&Default::default());
        let view = target.light.create_view(&Default::default());
        drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("clear"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        }));
        self.context.queue.submit([encoder.finish()]);
        self.context.check()
    }

    fn resize(&mut self, size: [u32; 2]) -> Result<(), GpuError> {
        let limit = self.context.limits.max_texture_dimension_2d;
        if size.iter().any(|&n| n > limit || n == 0) {
            return Err(GpuError::TooLarge {
                what: "a picture",
                limit: format!("1 to {limit} pixels a side"),
                found: format!("{} × {}", size[0], size[1]),
                advice: "choose another size",
            });
        }
        if self.target.as_ref().is_some_and(|t| t.size == size) {
            return Ok(());
        }
        self.target = None;
        let format = self.light_format();
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING;
        let light = texture(&self.context, "light", size, format, usage);
        self.target = Some(Target { size, light, encoded: None, staging: None });
        self.note_bytes();
        Ok(())
    }

    pub(super) fn light_format(&self) -> wgpu::TextureFormat {
        if self.context.granted.float32_blending {
            wgpu::TextureFormat::Rgba32Float
        } else {
            wgpu::TextureFormat::Rgba16Float
        }
    }

    /// Draws records over the picture, in their order, and waits; returns wall milliseconds.
    ///
    /// # Errors
    /// A failing device.
    pub fn draw_records(&mut self, records: &[Record]) -> Result<f64, GpuError> {
        if records.is_empty() {
            return Ok(0.0);
        }
        let bytes: &[u8] = bytemuck::cast_slice(records);
        self.uploads.reserve(&self.context, bytes.len() as u64);
        self.context.queue.write_buffer(&self.uploads.buffer, 0, bytes);
        self.variant.one_footprint = false;
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
        self.counts.reserve(&self.context, 4 * (u64::from(segments) + COUNT_HEADER_WORDS as u64));
        self.records.reserve(&self.context, capacity * record_bytes);
        self.note_bytes();
        self.write_traversal(view, &rows, segments, capacity as u32);
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

    pub(super) fn write_traversal(
        &self,
        view: &View,
        rows: &Range<u32>,
        segments: u32,
        capacity: u32,
    ) {
        let Some(volume) = &self.volume else { return };
        let Some(table) = &volume.table else { return };
        let [x, y, z] = volume.source.lattice.dims.map(|n| n as u32);
        let [bx, by, bz] = volume.source.bricks.dims.map(|n| n as u32);
        let [a, b, c] = view.traversal.axes.map(|n| n as u32);
        let [sa, sb, sc] = view.traversal.splits.map(|n| n as u32);
        let constants = layout::Traversal {
            dims: [x, y, z, volume.samples.width],
            bricks: [bx, by, bz, volume.samples.chunk_log2],
            axes: [a, b, c, self.segments_per_row(view)],
            splits: [sa, sb, sc, rows.start],
            counts: [rows.len() as u32, capacity, 0, 0],
            table: table.span,
        };
        self.context.queue.write_buffer(&self.traversal, 0, bytemuck::bytes_of(&constants));
        let scan = layout::Scan { counts: [segments, capacity, self.variant.vertices(), 0] };
        self.context.queue.write_buffer(&self.scan, 0, bytemuck::bytes_of(&scan));
    }

    /// Whether the field that these settings reconstruct is on the device.
    pub fn holds_field(&self, volume: &Arc<ScalarVolume>, settings: &SplatSettings) -> bool {
        self.slabs.holds(volume, settings)
    }

    /// Sets the field that slabs are reconstructed from; it needs a table next.
    ///
    /// # Errors
    /// Too large, cancelled, or a failing device.
    pub fn set_field(
        &mut self,
        volume: &Arc<ScalarVolume>,
        settings: &SplatSettings,
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<(), GpuError> {
        self.slabs.set_field(&self.context, volume, settings, coefficients, ticket)?;
        self.note_bytes();
        self.context.check()
    }

    /// Sets the classification of the field that was set last, for steps of up to `reach` voxels
    /// between two slab faces ([`Renderer::slab_reach`]).
    ///
    /// # Errors
    /// A failing device.
    pub fn set_slab_table(&mut self, table: &Cumulative, reach: usize) -> Result<(), GpuError> {
        self.slabs.set_table(&self.context, table, reach);
        self.note_bytes();
        self.context.check()
    }

    /// Voxels that a ray may cross between two slab faces, rounded up.
    pub fn slab_reach(view: &View, smallest_spacing: f64, settings: &SplatSettings) -> usize {
        step_reach(view, smallest_spacing, settings)
    }

    /// Draws the slabs of some tiles of the picture, row by row from the top, and waits; returns
    /// milliseconds as [`Renderer::draw_records`] does. Front to back, a ray ends where less
    /// transmittance than `stop_below` is left.
    ///
    /// # Errors
    /// A failing device.
    pub fn draw_slab_tiles(
        &mut self,
        view: &View,
        settings: &SplatSettings,
        unit_distance: f64,
        smallest_spacing: f64,
        stop_below: f64,
        tiles: Range<u32>,
    ) -> Result<f64, GpuError> {
        let picture = PictureConstants { unit_distance, smallest_spacing, stop_below };
        self.slab_settings = *settings;
        if !self.slabs.write(&self.context, view, settings, picture, &tiles) {
            return Err(GpuError::Device("slabs came before their field".to_owned()));
        }
        self.run(&frame::slab_piece(tiles.len() as u32))
    }

    fn reconstruct_slabs(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        tiles: u32,
        clock: Option<&Timestamps>,
    ) {
        let Some(target) = &self.target else { return };
        let light = (&target.light.create_view(&Default::default()), target.light.format());
        let settings = self.slab_settings;
        let timestamps = clock.map(|c| c.compute(0));
        self.slabs.encode(&self.context, encoder, &settings, light, tiles, timestamps);
    }

    /// The picture so far as sRGB bytes with straight alpha, rows from the top.
    ///
    /// # Errors
    /// A failing device.
    pub fn present(&mut self, background: Option<LinearRgb>) -> Result<Vec<u8>, GpuError> {
        let colour = background.unwrap_or_default().0;
        #[expect(clippy::cast_possible_truncation, reason = "colours in 0..=1")]
        let settings = layout::Present {
            background: [
                colour[0] as f32,
                colour[1] as f32,
                colour[2] as f32,
                f32::from(u8::from(background.is_some())),
            ],
        };
        self.context.queue.write_buffer(&self.present, 0, bytemuck::bytes_of(&settings));
        let Some(target) = &mut self.target else { return Ok(Vec::new()) };
        let size = target.size;
        let encoded = target.encoded.get_or_insert_with(|| {
            texture(
                &self.context,
                "encoded",
                size,
                wgpu::TextureFormat::Rgba8Unorm,
                wgpu::TextureUsages::empty(),
            )
        });
        let encoded = encoded.clone();
        self.note_bytes();
        self.run(&[Pass::Present])?;
        let Some(target) = &mut self.target else { return Ok(Vec::new()) };
        read_texture(&self.context, &encoded, size, 4, &mut target.staging)
    }

    /// The picture so far as premultiplied linear RGBA, rows from the top.
    ///
    /// # Errors
    /// A failing device.
    pub fn read_light(&mut self) -> Result<Vec<[f32; 4]>, GpuError> {
        let wide = self.context.granted.float32_blending;
        let Some(target) = &mut self.target else { return Ok(Vec::new()) };
        let texel = if wide { 16 } else { 8 };
        let bytes =
            read_texture(&self.context, &target.light, target.size, texel, &mut target.staging)?;
        if wide {
            return Ok(bytemuck::pod_collect_to_vec(&bytes));
        }
        Ok(bytes
            .chunks_exact(8)
            .map(|t| {
                std::array::from_fn(|c| half::f16::from_le_bytes([t[2 * c], t[2 * c + 1]]).to_f32())
            })
            .collect())
    }

    /// Submits passes and waits; returns wall milliseconds.
    ///
    /// Nothing is queued behind: the software adapter finishes one submission before it begins the
    /// next, and a newer request would wait for one piece more.
    pub(super) fn run(&mut self, passes: &[Pass]) -> Result<f64, GpuError> {
        let start = Instant::now();
        match self.timer {
            None => {
                let mut encoder = self.context.device.create_command_encoder(&Default::default());
                for &pass in passes {
                    self.encode(&mut encoder, pass, None);
                }
                self.context.queue.submit([encoder.finish()]);
                self.context.finish()?;
            }
            Some(timer) => {
                for &pass in passes {
                    let clock = (timer == Timer::Device).then(|| Timestamps::new(&self.context, 1));
                    let mut encoder =
                        self.context.device.create_command_encoder(&Default::default());
                    self.encode(&mut encoder, pass, clock.as_ref());
                    if let Some(clock) = &clock {
                        clock.resolve(&mut encoder);
                    }
                    let pass_start = Instant::now();
                    self.context.queue.submit([encoder.finish()]);
                    self.context.finish()?;
                    let gpu_ms = match &clock {
                        Some(clock) => clock.read_ms(&self.context)?[0],
                        None => pass_start.elapsed().as_secs_f64() * 1e3,
                    };
                    frame::add_time(&mut self.times, pass, gpu_ms);
                }
            }
        }
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        pass: Pass,
        clock: Option<&Timestamps>,
    ) {
        match pass {
            Pass::CountSegments { segments } => {
                self.dispatch(encoder, pass, shader::COUNT_SEGMENTS, segments, clock);
            }
            Pass::EmitKernels { segments } => {
                self.dispatch(encoder, pass, shader::EMIT_KERNELS, segments, clock);
            }
            Pass::ScanSegments => {
                self.dispatch(encoder, pass, shader::SCAN_SEGMENTS, 1, clock);
            }
            Pass::Gather { shader, tiles } => self.gather(encoder, shader, tiles, clock),
            Pass::Splat(source) => self.splat(encoder, source, clock),
            Pass::ReconstructSlabs { tiles } => self.reconstruct_slabs(encoder, tiles, clock),
            Pass::Present => self.encode_present(encoder, clock),
            Pass::CountDigits(_) | Pass::ScanDigits | Pass::ScatterDigits(_) => {
                let Some(lists) = &self.lists else { return };
                lists.sorter.encode(&self.context, &mut self.pipelines, encoder, pass, clock);
            }
            Pass::CountEntries { .. }
            | Pass::ScanEntries
            | Pass::WriteEntries { .. }
            | Pass::FindRanges { .. }
            | Pass::CompositeLists { .. } => self.encode_lists(encoder, pass, clock),
        }
    }

    fn dispatch(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        pass: Pass,
        shader: shader::Shader,
        threads: u32,
        clock: Option<&Timestamps>,
    ) {
        let pipeline = self.pipelines.compute(&self.context, shader).clone();
        let mut bound: Vec<&wgpu::Buffer> = Vec::new();
        if shader.name == shader::SCAN_SEGMENTS.name {
            bound.extend([&self.scan, &self.counts.buffer, &self.totals]);
        } else {
            let Some(volume) = &self.volume else { return };
            let Some(table) = &volume.table else { return };
            bound.push(&self.traversal);
            // Bindings beyond the last chunk repeat it; no index leads there.
            bound.extend(
                (0..CHUNKS).map(|i| &volume.samples.chunks[i.min(volume.samples.chunks.len() - 1)]),
            );
            bound.extend([&table.entries, &table.visible, &self.counts.buffer]);
            if shader.name == shader::EMIT_KERNELS.name {
                bound.push(&self.records.buffer);
            }
        }
        let bound: Vec<_> = bound.into_iter().map(wgpu::Buffer::as_entire_binding).collect();
        let groups = groups_of(threads, SEGMENT_THREADS);
        compute(&self.context, encoder, &pipeline, pass, &bound, groups, clock);
    }

    fn splat(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        source: Source,
        clock: Option<&Timestamps>,
    ) {
        let format = self.light_format();
        let pipeline = self.pipelines.splat(&self.context, format, self.variant).clone();
        let Some(target) = &self.target else { return };
        let group = self.context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(shader::SPLAT.name),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: self.frame.as_entire_binding(),
            }],
        });
        let view = target.light.create_view(&Default::default());
        let mut render = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(shader::SPLAT.name),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            timestamp_writes: clock.map(|c| c.render(0)),
            ..Default::default()
        });
        render.set_pipeline(&pipeline);
        render.set_bind_group(0, &group, &[]);
        match source {
            Source::Emitted => {
                render.set_vertex_buffer(0, self.records.buffer.slice(..));
                render.draw_indirect(&self.counts.buffer, 0);
            }
            Source::Uploaded(records) => {
                render.set_vertex_buffer(0, self.uploads.buffer.slice(..));
                render.draw(0..self.variant.vertices(), 0..records);
            }
        }
    }

    fn encode_present(&mut self, encoder: &mut wgpu::CommandEncoder, clock: Option<&Timestamps>) {
        let pipeline = self.pipelines.present(&self.context).clone();
        let Some(target) = &self.target else { return };
        let Some(encoded) = &target.encoded else { return };
        let light = target.light.create_view(&Default::default());
        let group = self.context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(shader::PRESENT.name),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: self.present.as_entire_binding() },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&light),
                },
            ],
        });
        let view = encoded.create_view(&Default::default());
        let mut render = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(shader::PRESENT.name),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            timestamp_writes: clock.map(|c| c.render(0)),
            ..Default::default()
        });
        render.set_pipeline(&pipeline);
        render.set_bind_group(0, &group, &[]);
        render.draw(0..3, 0..1);
    }

    /// Counts what is held now towards the peak.
    pub(super) fn note_bytes(&mut self) {
        let texel = if self.context.granted.float32_blending { 16 } else { 8 };
        let target = self.target.as_ref().map_or(0, |t| {
            let pixels = u64::from(t.size[0]) * u64::from(t.size[1]);
            pixels * (texel + if t.encoded.is_some() { 4 } else { 0 })
                + t.staging.as_ref().map_or(0, wgpu::Buffer::size)
        });
        let volume = self.volume.as_ref().map_or(0, |v| {
            v.samples.size_bytes
                + v.table.as_ref().map_or(0, |t| t.entries.size() + t.visible.size())
        });
        let between: u64 = [&self.records, &self.uploads, &self.counts]
            .iter()
            .map(|g| g.buffer.size())
            .sum::<u64>()
            + self.lists.as_ref().map_or(0, Lists::size_bytes);
        let held = target + volume + between + self.slabs.size_bytes();
        self.peak_bytes = self.peak_bytes.max(held);
    }
}

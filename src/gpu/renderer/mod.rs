//! Runs passes: the buffers between them, and their times.

mod gather;
mod meshes;
mod octree;
mod polygons;
mod scattered;
mod shaded_samples;
mod sort;
mod target;
mod triangles;
mod vectors;
mod volume;

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use crate::core::Ticket;
use crate::gpu::buffers::{Growing, read_words};
use crate::gpu::clock::Timestamps;
use crate::gpu::constants::frame_constants;
use crate::gpu::context::Context;
use crate::gpu::device_volume::DeviceVolume;
use crate::gpu::frame::{self, Pass, PassTime};
use crate::gpu::gather::Gathering;
use crate::gpu::inside::Opening;
use crate::gpu::levels::DeviceLevels;
use crate::gpu::meshes::MeshTable;
use crate::gpu::octree::BrickBuffers;
use crate::gpu::pipelines::{Pipelines, SplatVariant};
use crate::gpu::polygons::DevicePolygons;
use crate::gpu::scan::Scan;
use crate::gpu::scattered::Lists;
use crate::gpu::shade::Shade;
use crate::gpu::shaded_samples::ShadedSamples;
use crate::gpu::slabs::{Beside, Looks, PictureConstants, SlabPass, step_reach};
use crate::gpu::target::{Target, WRITTEN};
use crate::gpu::timing::Timer;
use crate::gpu::vectors::DeviceVectors;
use crate::gpu::{GpuError, layout, shader};
use crate::kernel::{Coefficients, Kernel, Subdivisions};
use crate::plan::{COARSER, FieldCut, Plan, SlabField};
use crate::scene::{SplatSettings, View};
use crate::transfer::Cumulative;
use crate::volume::ScalarVolume;

/// Draws pieces of one picture at a time. Everything it holds can be made again from the scene.
#[derive(Debug)]
pub struct Renderer {
    pub(super) context: Context,
    pub(super) pipelines: Pipelines,
    timer: Option<Timer>,
    pub(super) frame: wgpu::Buffer,
    pub(super) traversal: wgpu::Buffer,
    pub(super) scan: Scan,
    pub(super) totals: wgpu::Buffer,
    pub(super) present: wgpu::Buffer,
    /// Of pictures without a field.
    pub(super) tiles: wgpu::Buffer,
    pub(super) records: Growing,
    pub(super) uploads: Growing,
    pub(super) volume: Option<DeviceVolume>,
    pub(super) target: Option<Target>,
    pub(super) variant: SplatVariant,
    /// From the first time that meshes are asked for.
    pub(super) mesh: Option<MeshTable>,
    /// By [`SlabField`].
    pub(super) slabs: [SlabPass; 2],
    /// What the slabs being drawn are of, and their mode.
    slab_field: SlabField,
    pub(super) slab_settings: SplatSettings,
    /// Their lights and shading tables.
    pub(super) shade: Option<Shade>,
    pub(super) shaded: ShadedSamples,
    /// What lets the inside be seen.
    inside: Option<Opening>,
    pub(super) gathering: Gathering,
    /// Lists of scattered kernels, from the first time that they are asked for.
    pub(super) lists: Option<Lists>,
    /// Vector splats, while a scene has them.
    pub(super) vectors: Option<DeviceVectors>,
    /// Whether the slabs being drawn have them, too.
    pub(super) slabs_have_vectors: bool,
    /// While an octree is built on the device.
    pub(super) bricks: Option<BrickBuffers>,
    /// Polygons, while a picture has them.
    pub(super) polygons: Option<DevicePolygons>,
    /// Those of the picture before.
    pub(super) polygons_before: Option<DevicePolygons>,
    /// Means of a volume, from the first cut of its field on.
    pub(super) levels: Option<DeviceLevels>,
    /// The cut that slabs are of.
    cut: Option<Arc<FieldCut>>,
    /// Of passes that came before the picture was begun.
    times_before: Vec<PassTime>,
    times: Vec<PassTime>,
    peak_bytes: u64,
    pub(super) upload_count: u64,
}

/// What the scene being drawn asks for beside its transfer function and its mode.
fn looks_of<'a>(
    shade: &'a Option<Shade>,
    inside: &'a Option<Opening>,
    polygons: &Option<DevicePolygons>,
) -> Looks<'a> {
    Looks { shade: shade.as_ref(), inside: inside.as_ref(), polygons: polygons.is_some() }
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
            scan: Scan::new(&context),
            present: uniform("present", size_of::<layout::Present>()),
            tiles: Growing::make(
                &context,
                "tiles without a field",
                Usage::STORAGE | Usage::COPY_DST,
                size_of::<layout::VectorTiles>() as u64,
            ),
            totals: Growing::make(
                &context,
                "totals",
                Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC,
                32,
            ),
            records: Growing::new(
                &context,
                "records",
                Usage::STORAGE | Usage::VERTEX | Usage::COPY_SRC,
            ),
            uploads: Growing::new(&context, "uploads", Usage::VERTEX | Usage::COPY_DST),
            slabs: [SlabPass::new(&context), SlabPass::new(&context)],
            slab_field: SlabField::Own,
            slab_settings: SplatSettings::EXACT,
            shade: None,
            shaded: ShadedSamples::default(),
            inside: None,
            pipelines: Pipelines::default(),
            timer: None,
            volume: None,
            target: None,
            variant: SplatVariant {
                kernel: Kernel::Cubic,
                perspective: false,
                one_footprint: false,
                published: false,
            },
            mesh: None,
            gathering: Gathering::new(&context),
            lists: None,
            vectors: None,
            slabs_have_vectors: false,
            bricks: None,
            polygons: None,
            polygons_before: None,
            levels: None,
            cut: None,
            times_before: Vec::new(),
            times: Vec::new(),
            peak_bytes: 0,
            upload_count: 0,
            context,
        }
    }

    /// The device underneath.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Times every pass from now on; each is then submitted on its own where the device's clock
    /// cannot be believed.
    pub fn time_passes(&mut self) -> Timer {
        let timer = Timer::of(&self.context);
        self.timer = Some(timer);
        // Else their pass would not be among those that are timed.
        self.shaded.clear();
        timer
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

    /// Volumes and fields brought to the device so far: a transfer function alone brings none.
    pub fn upload_count(&self) -> u64 {
        self.upload_count
    }

    /// Pipelines compiled so far.
    pub fn pipeline_count(&self) -> usize {
        self.pipelines.len()
    }

    /// Begins a picture: a cleared target of the view's size, and the frame's constants.
    ///
    /// `unit_distance` is the world length over which the table's extinctions are given.
    ///
    /// [`Renderer::begin_meshes`] says which meshes; here they are those of before, or the usual ones.
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
        self.times = std::mem::take(&mut self.times_before);
        self.variant = SplatVariant {
            kernel,
            perspective: view.eye_distance.is_some(),
            one_footprint: false,
            published: false,
        };
        if kernel == Kernel::Gouraud && self.mesh.is_none() {
            self.mesh = MeshTable::new(&self.context, Subdivisions::default());
        }
        let constants = frame_constants(view, kernel, extent, unit_distance);
        self.context.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&constants));
        let totals = [0, 0, 0, 0, 0, 2 * u32::from(self.context.ends_loops), 0, 0];
        self.context.queue.write_buffer(&self.totals, 0, bytemuck::cast_slice(&totals));
        self.clear_light();
        self.context.check()
    }

    /// Whether the field that these settings reconstruct is on the device.
    pub fn holds_field(
        &self,
        which: SlabField,
        volume: &Arc<ScalarVolume>,
        settings: &SplatSettings,
    ) -> bool {
        self.slabs[which as usize].holds(volume, settings)
    }

    /// Lets go of a field.
    pub fn clear_field(&mut self, which: SlabField) {
        self.slabs[which as usize].clear();
    }

    /// Whether light that falls on the border of cells (`Shading::lights_borders`) finds what it takes for their growths.
    pub fn is_field_lit(&self, which: SlabField) -> bool {
        self.slabs[which as usize].is_lit()
    }

    /// Whether a field that was set has got its table since.
    pub fn holds_slab_table(&self, which: SlabField) -> bool {
        self.slabs[which as usize].holds_table()
    }

    /// The kernel of a field that was set, and its samples along each axis.
    pub fn field_shape(&self, which: SlabField) -> Option<(Kernel, [usize; 3])> {
        self.slabs[which as usize].shape()
    }

    /// Sets a field that slabs are reconstructed from; it needs a table next.
    ///
    /// # Errors
    /// Too large, cancelled, or a failing device.
    pub fn set_field(
        &mut self,
        which: SlabField,
        volume: &Arc<ScalarVolume>,
        settings: &SplatSettings,
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<(), GpuError> {
        self.set_field_for(which, volume, (settings, false), coefficients, ticket)
    }

    /// The same with what light that falls on the border of cells takes for their growths.
    ///
    /// # Errors
    /// Too large, cancelled, or a failing device.
    pub fn set_lit_field(
        &mut self,
        which: SlabField,
        volume: &Arc<ScalarVolume>,
        settings: &SplatSettings,
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<(), GpuError> {
        self.set_field_for(which, volume, (settings, true), coefficients, ticket)
    }

    fn set_field_for(
        &mut self,
        which: SlabField,
        volume: &Arc<ScalarVolume>,
        settings: (&SplatSettings, bool),
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<(), GpuError> {
        drop(self.levels.take_if(|levels| !levels.are_of(volume)));
        let slabs = &mut self.slabs[which as usize];
        slabs.set_field(&self.context, volume, settings, coefficients, ticket)?;
        self.upload_count += 1;
        self.note_bytes();
        self.context.check()
    }

    /// Brings means of 2³ and of 4³ samples of a volume to the device, for cuts of its fields. They are let go of with the volume.
    ///
    /// # Errors
    /// Too large, cancelled, or a failing device.
    pub fn set_levels(
        &mut self,
        volume: &Arc<ScalarVolume>,
        means: &[Coefficients; COARSER],
        ticket: &Ticket,
    ) -> Result<(), GpuError> {
        // The old ones go first: two need not fit.
        self.levels = None;
        self.levels = Some(DeviceLevels::upload(&self.context, volume, means, ticket)?);
        self.note_bytes();
        self.context.check()
    }

    /// Whether the means of a volume are there.
    pub fn holds_levels(&self, volume: &Arc<ScalarVolume>) -> bool {
        self.levels.as_ref().is_some_and(|levels| levels.are_of(volume))
    }

    /// Whether cuts of a field that was set can be drawn.
    pub fn takes_cuts(&self, which: SlabField) -> bool {
        self.slabs[which as usize].takes_cuts()
    }

    /// Bricks of a cut along each axis of the scene's own field, and those in which anything may show.
    pub fn shown_bricks(&self) -> Option<([usize; 3], Vec<u32>)> {
        self.slabs[SlabField::Own as usize].shown_bricks()
    }

    /// Those in which the scene's own field may have any of some values, as isosurfaces do.
    pub fn passed_bricks(&self, levels: &[f64]) -> Vec<u32> {
        self.slabs[SlabField::Own as usize].passed_bricks(levels)
    }

    /// Sets the classification of a field that was set, for steps of up to `reach` voxels between
    /// two slab faces ([`Renderer::slab_reach`]); values of `levels` are looked for whether they show
    /// or not.
    ///
    /// # Errors
    /// A failing device.
    pub fn set_slab_table(
        &mut self,
        which: SlabField,
        table: &Cumulative,
        reach: usize,
        levels: &[f64],
    ) -> Result<(), GpuError> {
        self.slabs[which as usize].set_table(&self.context, table, reach, levels);
        self.note_bytes();
        self.context.check()
    }

    /// Voxels that a ray may cross between two slab faces, rounded up.
    pub fn slab_reach(view: &View, smallest_spacing: f64, settings: &SplatSettings) -> usize {
        step_reach(view, smallest_spacing, settings)
    }

    /// Distance between the slab faces of a field that was set, pixels of view depth.
    pub fn slab_thickness(
        &self,
        which: SlabField,
        view: &View,
        settings: &SplatSettings,
        smallest_spacing: f64,
    ) -> f64 {
        self.slabs[which as usize].thickness(view, settings, smallest_spacing)
    }

    /// Marks the pixels of a smaller picture (`View::enlarged`) in which single rays would miss small
    /// things; the number of rays that they get more, `most_rays` at most. They are drawn with the next
    /// picture of this view, unless its table changes before.
    pub fn mark_specks(
        &mut self,
        which: SlabField,
        view: &View,
        settings: &SplatSettings,
        most_rays: u64,
    ) -> u64 {
        let rays = self.slabs[which as usize].mark(&self.context, view, settings, most_rays);
        self.note_bytes();
        rays
    }

    /// Whether slabs, and what is gathered, have vectors in them from now on, whose lists are made before
    /// each piece.
    pub fn put_vectors_in_slabs(&mut self, have: bool) {
        self.slabs_have_vectors = have;
    }

    /// Whether every ray of the picture came to its end so far.
    ///
    /// What rays and polygons walk says so where it was ended. No other pass has loops that may be long: those over
    /// lists are refused where a kernel touches too many tiles (`MOST_TURNS`); a thread of
    /// `count_segments`, `emit_kernels` and `shade_samples` walks the samples along a brick, with a turn for each light,
    /// table and region; `merge_bricks` the nodes of 8³ voxels; `count_digits` and `scatter_digits` 256 keys.
    ///
    /// # Errors
    /// [`GpuError::EndedLoops`], or a failing device.
    pub(in crate::gpu) fn check_loops(&self) -> Result<(), GpuError> {
        if self.context.ends_loops && read_words(&self.context, &self.totals, 20)?[4] > 0 {
            return Err(GpuError::EndedLoops);
        }
        Ok(())
    }

    /// Draws the slabs of some tiles of the picture, row by row from the top, and waits; returns
    /// milliseconds as [`Renderer::draw_records`] does.
    ///
    /// # Errors
    /// A failing device.
    pub fn draw_slab_tiles(
        &mut self,
        which: SlabField,
        view: &View,
        settings: &SplatSettings,
        picture: PictureConstants,
        tiles: Range<u32>,
    ) -> Result<f64, GpuError> {
        (self.slab_field, self.slab_settings) = (which, *settings);
        let which = which as usize;
        let looks = looks_of(&self.shade, &self.inside, &self.polygons);
        let slabs = &mut self.slabs[which];
        slabs.check(view, settings, picture, looks)?;
        if !slabs.write(&self.context, view, settings, picture, &tiles, looks) {
            return Err(GpuError::Device("slabs came before their field".to_owned()));
        }
        if let Some(cut) = &self.cut {
            let levels = self.levels.as_mut().filter(|levels| slabs.is_of(levels));
            let (Some(levels), Some(values), true) = (levels, slabs.values(), slabs.takes_cuts())
            else {
                let what = "a cut came before the means of its field, or of a field that has none";
                return Err(GpuError::Device(what.to_owned()));
            };
            levels.set_cut(&self.context, cut, values)?;
        }
        let projects = looks.variant(false).projects();
        let wall_ms = self.run(&frame::slab_piece(tiles.len() as u32, projects))?;
        self.check_loops()?;
        Ok(wall_ms)
    }

    fn reconstruct_slabs(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        tiles: u32,
        clock: Option<&Timestamps>,
    ) {
        let Some(target) = &self.target else { return };
        let light = target.light.create_view(&Default::default());
        let looks = looks_of(&self.shade, &self.inside, &self.polygons);
        let variant = looks.variant(self.slab_field == SlabField::Preview);
        let vectors = match (&self.vectors, &self.lists) {
            (Some(vectors), Some(lists)) if self.slabs_have_vectors => Some((vectors, lists)),
            _ => None,
        };
        let levels = self.levels.as_ref().filter(|_| self.cut.is_some());
        let beside = Beside { vectors, polygons: self.polygons.as_ref(), levels };
        let device = (&self.context, &mut self.pipelines);
        let into = (&light, &self.totals);
        let what = (tiles, variant, beside);
        let slabs = &self.slabs[self.slab_field as usize];
        slabs.encode(device, encoder, &self.slab_settings, into, what, clock);
    }

    /// Whether slabs are of a plan's cut of its field, from now on.
    ///
    /// # Errors
    /// A plan of which no cuts are drawn.
    pub fn put_cut(&mut self, plan: &Plan) -> Result<(), GpuError> {
        crate::gpu::supports(plan)?;
        self.cut.clone_from(&plan.cut);
        Ok(())
    }

    /// Takes what a plan says besides its samples, until [`Renderer::end_plan`]: lights and shading tables, what
    /// lets the inside be seen, polygons. What it does not ask for takes no buffer, no pipeline and no gradient.
    ///
    /// # Errors
    /// See [`crate::gpu::supports()`]; too many polygons, or a failing device.
    pub fn begin_plan(&mut self, plan: &Plan) -> Result<(), GpuError> {
        self.put_cut(plan)?;
        self.shade = Shade::of(plan);
        self.inside = Opening::of(plan);
        self.put_vectors_in_slabs(false);
        if self.polygons.is_none() {
            self.polygons = self.polygons_before.take();
        }
        self.set_polygons(plan)
    }

    /// Nothing of a plan decides what is drawn from now on. Its picture stays, and what it may have in common with
    /// the next.
    pub fn end_plan(&mut self) {
        (self.shade, self.inside, self.cut) = (None, None, None);
        self.put_vectors_in_slabs(false);
        if let Some(polygons) = self.polygons.take() {
            self.polygons_before = Some(polygons);
        }
    }

    /// Runs passes that belong to the picture that will be begun next.
    pub(in crate::gpu) fn run_before(&mut self, passes: &[Pass]) -> Result<f64, GpuError> {
        let times = std::mem::take(&mut self.times);
        self.times = std::mem::take(&mut self.times_before);
        let ran = self.run(passes);
        self.times_before = std::mem::replace(&mut self.times, times);
        ran
    }

    /// Submits passes and waits; returns wall milliseconds.
    ///
    /// Nothing is queued behind: a newer request would wait for one piece more.
    pub(in crate::gpu) fn run(&mut self, passes: &[Pass]) -> Result<f64, GpuError> {
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
                self.walk_segments(encoder, shader::COUNT_SEGMENTS, segments, clock);
            }
            Pass::EmitKernels { segments } => {
                self.walk_segments(encoder, shader::EMIT_KERNELS, segments, clock);
            }
            Pass::ScanSegments => {
                let device = (&self.context, &mut self.pipelines);
                self.scan.encode(device, encoder, &self.totals, clock);
            }
            Pass::ShadeSamples { bricks } => self.shade_samples(encoder, bricks, clock),
            Pass::Gather { tiles, .. } => self.gather(encoder, tiles, clock),
            Pass::Splat(source) => self.splat(encoder, source, clock),
            Pass::ReconstructSlabs { tiles } | Pass::ProjectValues { tiles } => {
                self.reconstruct_slabs(encoder, tiles, clock);
            }
            Pass::CompositeVectors { tiles } => self.composite_vectors(encoder, tiles, clock),
            Pass::MergeBricks { bricks } => self.encode_bricks(encoder, bricks, clock),
            Pass::CountPolygons { .. }
            | Pass::PlacePolygons { .. }
            | Pass::WritePolygons { .. }
            | Pass::SortPolygons { .. } => self.encode_polygons(encoder, pass, clock),
            Pass::Present => self.encode_present(encoder, clock),
            Pass::CountDigits(_) | Pass::ScanDigits | Pass::ScatterDigits(_) => {
                let Some(lists) = &self.lists else { return };
                lists.sorter.encode(&self.context, &mut self.pipelines, encoder, pass, clock);
            }
            Pass::CountEntries { .. }
            | Pass::CountVectors { .. }
            | Pass::ScanEntries
            | Pass::WriteEntries { .. }
            | Pass::FindRanges { .. }
            | Pass::CompositeLists { .. } => self.encode_lists(encoder, pass, clock),
        }
    }

    /// Bytes held on the device now, as this program allocates them.
    pub fn size_bytes(&self) -> u64 {
        let target = self.target.as_ref().map_or(0, |t| {
            let texel = if t.light.format() == WRITTEN { 16 } else { 8 };
            let pixels = u64::from(t.size[0]) * u64::from(t.size[1]);
            pixels * (texel + if t.encoded.is_some() { 4 } else { 0 })
                + t.staging.as_ref().map_or(0, wgpu::Buffer::size)
        });
        let volume = self.volume.as_ref().map_or(0, |v| {
            v.samples.size_bytes
                + v.table.as_ref().map_or(0, |t| t.entries.size() + t.visible.size())
        });
        let between: u64 =
            [&self.records, &self.uploads].iter().map(|g| g.buffer.size()).sum::<u64>()
                + self.scan.size_bytes()
                + self.lists.as_ref().map_or(0, Lists::size_bytes)
                + self.mesh.as_ref().map_or(0, MeshTable::size_bytes)
                + self.vectors.as_ref().map_or(0, DeviceVectors::size_bytes)
                + self.bricks.as_ref().map_or(0, BrickBuffers::size_bytes)
                + self.polygon_bytes();
        let slabs: u64 = self.slabs.iter().map(SlabPass::size_bytes).sum();
        target
            + volume
            + between
            + slabs
            + self.gathering.shading_bytes()
            + self.shaded.size_bytes()
            + self.levels.as_ref().map_or(0, DeviceLevels::size_bytes)
    }

    /// Of them, what lists take: octree cuts and vectors share them.
    pub fn list_bytes(&self) -> u64 {
        self.lists.as_ref().map_or(0, Lists::size_bytes)
    }

    /// Of them, what vectors take, with the lists of where they lie while they are drawn.
    pub fn vector_bytes(&self) -> u64 {
        let own = self.vectors.as_ref().map_or(0, DeviceVectors::size_bytes);
        if own > 0 { own + self.list_bytes() } else { 0 }
    }

    /// Of them, what lights and shading tables take: nothing once a picture without was drawn.
    pub fn shading_bytes(&self) -> u64 {
        self.slabs.iter().map(SlabPass::shading_bytes).sum::<u64>()
            + self.gathering.shading_bytes()
            + self.shaded.size_bytes()
    }

    /// Counts what is held now towards the peak.
    pub(in crate::gpu) fn note_bytes(&mut self) {
        self.peak_bytes = self.peak_bytes.max(self.size_bytes());
    }
}

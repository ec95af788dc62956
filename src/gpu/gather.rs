//! Grids without lists: each pixel gathers the lattice's kernels along its own ray, shaded first.

mod constants;

use std::collections::HashMap;
use std::ops::Range;

use constants::Constants;

use super::GpuError;
use super::buffers::{Growing, read_words};
use super::compute::{dispatch, groups_of_tiles};
use super::context::Context;
use super::frame::Pass;
use super::layout::{self, TILE};
use super::pipelines::{
    compute_pipeline, flag, footprint_constants, share_constants, vector_constants,
};
use super::renderer::Renderer;
use super::shade::{Shade, ShadeVariant};
use super::shader::{self, GatherPieces, SampleLooks, Shader};
use super::timing::Timestamps;
use super::turns::{self, Among, Layers};
use crate::kernel::{Kernel, RadialKernel};
use crate::scene::{OpacityModel, Order, SplatSettings, View, Visibility};

/// Tiles of a picture, numbered along its rows from the top left.
pub fn tile_count(size: [u32; 2]) -> u32 {
    size[0].div_ceil(TILE) * size[1].div_ceil(TILE)
}

/// What is composited at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Layering {
    /// Each sample.
    Sample,
    /// Each slice of the lattice's outermost axis, footprints whole.
    Slice,
    /// Layers perpendicular to that axis, which cut kernels.
    Sheets,
    /// Layers perpendicular to the view.
    Slabs,
}

/// What a pipeline is compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Variant {
    kernel: Kernel,
    layering: Layering,
    opacity_model: OpacityModel,
    order: Order,
    perspective: bool,
    in_parts: bool,
    looks: Looks,
    polygons: bool,
    vectors: bool,
}

/// What samples are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Looks {
    /// What their values are classified as.
    Plain,
    /// Each ray shades those it meets.
    Shaded(ShadeVariant),
    /// They are shaded already.
    Kept,
}

impl Variant {
    fn new(view: &View, settings: &SplatSettings) -> Self {
        let whole = settings.sheets_per_kernel == 1 || settings.kernel == Kernel::Point;
        Self {
            kernel: settings.kernel,
            layering: match settings.visibility {
                Visibility::EverySample => Layering::Sample,
                Visibility::Sheets if whole => Layering::Slice,
                Visibility::Sheets => Layering::Sheets,
                Visibility::Slabs => Layering::Slabs,
            },
            opacity_model: settings.opacity_model,
            order: settings.order,
            perspective: view.eye_distance.is_some(),
            in_parts: false,
            looks: Looks::Plain,
            polygons: false,
            vectors: false,
        }
    }

    fn is_of_cells(self) -> bool {
        matches!(self.kernel, Kernel::Nearest | Kernel::Linear | Kernel::BSpline)
    }

    /// The pass's name.
    fn pass(self) -> &'static str {
        if self.is_of_cells() { shader::GATHER_CELLS } else { shader::GATHER_KERNELS }
    }

    fn shader(self) -> Shader {
        let looks = match self.looks {
            Looks::Plain => SampleLooks::Plain,
            Looks::Shaded(shade) if shade.regions > 0 => SampleLooks::Painted,
            Looks::Shaded(_) => SampleLooks::Shaded,
            Looks::Kept => SampleLooks::Kept,
        };
        let Self { in_parts, polygons, vectors, .. } = self;
        GatherPieces { cells: self.is_of_cells(), in_parts, looks, polygons, vectors }.shader()
    }

    fn layers(self) -> Layers {
        match self.layering {
            Layering::Sample | Layering::Slice => Layers::None,
            Layering::Sheets => Layers::Sheets,
            Layering::Slabs => Layers::Slabs,
        }
    }

    fn constants(self) -> Vec<(&'static str, f64)> {
        let layering = match self.layering {
            Layering::Sample => 0.0,
            Layering::Slice => 1.0,
            Layering::Sheets | Layering::Slabs => 2.0,
        };
        let mut constants = vec![
            ("layering", layering),
            ("sheets", flag(self.layering == Layering::Sheets)),
            ("published", flag(self.opacity_model == OpacityModel::Published)),
            ("front_to_back", flag(self.order == Order::FrontToBack)),
            ("perspective", flag(self.perspective)),
        ];
        if self.polygons || self.vectors {
            constants.push(("back_to_front", flag(self.order == Order::BackToFront)));
        }
        if let Looks::Shaded(shade) = &self.looks {
            constants.extend(shade.constants());
        }
        match self.kernel {
            Kernel::Nearest => constants.push(("support", 1.0)),
            Kernel::Linear => constants.push(("support", 2.0)),
            Kernel::BSpline => constants.push(("support", 4.0)),
            Kernel::Point | Kernel::Gaussian | Kernel::Cubic | Kernel::Gouraud => {
                constants.push(("points", flag(self.kernel == Kernel::Point)));
                if let Some(radial) = RadialKernel::new(self.kernel, None) {
                    constants.extend(footprint_constants(self.kernel));
                    constants.extend(share_constants(radial));
                }
            }
        }
        constants
    }
}

/// What the gathering passes keep on the device.
#[derive(Debug)]
pub(super) struct Gathering {
    constants: wgpu::Buffer,
    /// Of scenes that shade samples; else they are not there.
    shade: Option<wgpu::Buffer>,
    regions: Option<wgpu::Buffer>,
    /// What those hold.
    looks: Vec<u8>,
    /// Of the pass that shades samples.
    pub(super) shading: layout::Gather,
    variant: Option<Variant>,
    pipelines: HashMap<Variant, wgpu::ComputePipeline>,
}

impl Gathering {
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        let size = size_of::<layout::Gather>() as u64;
        Self {
            constants: Growing::make(context, "gather", Usage::UNIFORM | Usage::COPY_DST, size),
            shade: None,
            regions: None,
            looks: Vec::new(),
            shading: bytemuck::Zeroable::zeroed(),
            variant: None,
            pipelines: HashMap::new(),
        }
    }

    /// How many pipelines are compiled.
    pub(super) fn len(&self) -> usize {
        self.pipelines.len()
    }

    /// Bytes that lights, tables and regions take.
    pub(super) fn shading_bytes(&self) -> u64 {
        [&self.shade, &self.regions].into_iter().flatten().map(wgpu::Buffer::size).sum()
    }

    /// What samples are shaded by, byte for byte.
    pub(super) fn looks_bytes(&self) -> &[u8] {
        &self.looks
    }

    /// The same on the device, with the numbers of its bindings.
    pub(super) fn looks(&self) -> impl Iterator<Item = (u32, &wgpu::Buffer)> {
        let looks = [(9, &self.shade), (10, &self.regions)];
        looks.into_iter().filter_map(|(at, buffer)| Some((at, buffer.as_ref()?)))
    }

    /// What passes are given.
    pub(super) fn buffer(&self) -> &wgpu::Buffer {
        &self.constants
    }

    pub(super) fn write(&self, context: &Context, constants: &layout::Gather) {
        context.queue.write_buffer(&self.constants, 0, bytemuck::bytes_of(constants));
    }

    /// Brings what samples are shaded by to the device, or lets it go.
    fn write_shade(
        &mut self,
        context: &Context,
        shade: Option<(layout::Shade, Option<layout::Regions>)>,
    ) {
        let (shade, regions) =
            shade.map_or((None, None), |(shade, regions)| (Some(shade), regions));
        self.looks.clear();
        self.looks.extend(shade.iter().flat_map(bytemuck::bytes_of));
        self.looks.extend(regions.iter().flat_map(bytemuck::bytes_of));
        write_uniform(context, &mut self.shade, "shade", shade.as_ref());
        write_uniform(context, &mut self.regions, "regions", regions.as_ref());
    }
}

/// Brings a uniform to the device, or lets it go.
fn write_uniform<T: bytemuck::Pod>(
    context: &Context,
    buffer: &mut Option<wgpu::Buffer>,
    label: &'static str,
    constants: Option<&T>,
) {
    use wgpu::BufferUsages as Usage;
    let Some(constants) = constants else {
        *buffer = None;
        return;
    };
    let size = size_of::<T>() as u64;
    let made = || Growing::make(context, label, Usage::UNIFORM | Usage::COPY_DST, size);
    context.queue.write_buffer(buffer.get_or_insert_with(made), 0, bytemuck::bytes_of(constants));
}

impl Renderer {
    /// Draws some tiles of a picture that [`Renderer::begin`] began, whole: samples classified
    /// first ([`crate::scene::Classify::Before`]), in the mode that `settings` name, and the polygons and
    /// vectors that were set, whose lists were made for this view. Tiles are numbered as [`tile_count`] counts them.
    /// Returns wall milliseconds.
    ///
    /// Samples and whole slices stay whole: a polygon has its turn in the traversal's order between two
    /// slices, as a sample would where the ray meets it, and so has a slab of vectors in its middle. Sheets
    /// that cut kernels, and slabs, are split: what is in one, vectors and all, is taken to be as dense
    /// everywhere between its two planes.
    ///
    /// `unit_distance` is the world length over which the table's extinctions are given. Front to
    /// back, a pixel ends where its transmittance is under `stop_below`.
    ///
    /// # Errors
    /// Kernels so wide that a single step of a ray is too much for the adapter's loops, more polygons
    /// over a pixel or vectors along a ray than these allow, or a failing device.
    pub fn draw_gathered(
        &mut self,
        view: &View,
        settings: &SplatSettings,
        unit_distance: f64,
        stop_below: f64,
        tiles: Range<u32>,
    ) -> Result<f64, GpuError> {
        let tiles = tiles.start..tiles.end.min(tile_count(view.size));
        let lengths = (unit_distance, stop_below);
        let Some(mut constants) = self.gather_constants(view, settings, lengths, tiles.clone())
        else {
            return Ok(0.0);
        };
        // Nothing to draw leaves the picture clear, as it was begun.
        if tiles.is_empty() {
            return Ok(0.0);
        }
        let mut variant = Variant::new(view, settings);
        variant.looks = match self.sample_shade() {
            None => Looks::Plain,
            Some(_) if self.shaded.whole().is_some() => Looks::Kept,
            Some(shade) => Looks::Shaded(shade.variant),
        };
        self.write_looks(view);
        let most = self.context.most_turns;
        let side = view.rays_per_side(settings.kernel, settings.extent);
        let polygons = self.polygons.as_ref().map(|polygons| polygons.longest);
        variant.polygons = polygons.is_some();
        let splats = self.vectors.as_ref().filter(|_| self.slabs_have_vectors);
        variant.vectors = splats.is_some();
        if variant.polygons && variant.vectors && variant.looks == Looks::Kept {
            // There are no bindings left for what was shaded.
            variant.looks = self.sample_shade().map_or(Looks::Plain, |s| Looks::Shaded(s.variant));
        }
        let walked = (settings.kernel, variant.layers());
        let quartered = variant.vectors.then_some(self.vectors_quartered);
        let among = Among { polygons, vectors: quartered };
        let parts = turns::gathered(&constants, walked, side, among, most)?;
        variant.in_parts = parts.len() > 1;
        self.write_traversal(view, &(0..0), 0, 0);
        self.gathering.variant = Some(variant);
        // What is kept of a pixel's samples takes twice the room, and vectors a place more.
        let among = variant.polygons || variant.vectors;
        let slots = 1 + u32::from(among) + u32::from(variant.vectors);
        let ranges = self.tiles_at_a_time((variant.in_parts, slots), tiles);
        let mut wall_ms = 0.0;
        for tiles in ranges {
            constants.splits[3] = tiles.start as i32;
            constants.strides[3] = tiles.end;
            for &part in &parts {
                (constants.part, constants.rays) = (part.along, part.rays);
                self.gathering.write(&self.context, &constants);
                let pass = variant.pass();
                wall_ms += self.run(&[Pass::Gather { pass, tiles: tiles.len() as u32 }])?;
            }
        }
        let kept = self.kept.buffer().filter(|_| variant.in_parts);
        let totals = kept.unwrap_or(&self.totals).clone();
        self.check_turns(&totals)?;
        Ok(wall_ms)
    }

    /// What a picture's samples are gathered with; `None` where nothing can show, nor anything lies among
    /// them. Of the lengths, the first is that over which the table's extinctions are given, the second
    /// the transmittance at which rays end.
    pub(super) fn gather_constants(
        &self,
        view: &View,
        settings: &SplatSettings,
        (unit_distance, stop_below): (f64, f64),
        tiles: Range<u32>,
    ) -> Option<layout::Gather> {
        let volume = self.volume.as_ref()?;
        let table = volume.table.as_ref()?;
        let lattice = volume.source.lattice;
        let shows = table.showing[0][0] <= table.showing[1][0];
        // Any brick, which is known to show nothing.
        let showing = if shows { table.showing } else { [[0; 3]; 2] };
        (shows || self.polygons.is_some() || self.slabs_have_vectors).then(|| {
            Constants {
                view,
                settings,
                unit_distance,
                stop_below,
                dims: lattice.dims,
                bricks: volume.source.bricks.dims,
                smallest_spacing: lattice.smallest_spacing(),
                showing,
                tiles,
            }
            .gather()
        })
    }

    /// What samples are shaded by, where a scene shades any.
    pub(super) fn sample_shade(&self) -> Option<&Shade> {
        self.shade.as_ref().filter(|shade| !shade.is_of_surfaces)
    }

    /// Brings what a scene's samples are shaded by to the device, or lets it go.
    pub(super) fn write_looks(&mut self, view: &View) {
        let shade = self.sample_shade();
        let values = self.volume.as_ref().map_or_else(Default::default, |v| v.samples.values());
        let growth = view.eye_distance.map_or(0.0, |eye| (1.0 / eye) as f32);
        let looks = shade.map(|shade| {
            let constants = shade.constants(values, 0, view.pixels_per_unit, growth);
            (constants, shade.regions(values))
        });
        self.gathering.write_shade(&self.context, looks);
    }

    /// Sums of published opacities that were over 1 since [`Renderer::begin`], and were capped.
    ///
    /// # Errors
    /// A failing device.
    pub fn capped_sums(&mut self) -> Result<u64, GpuError> {
        let gathered = read_words(&self.context, &self.totals, 16)?;
        let mut in_slabs = 0;
        for slabs in &self.slabs {
            in_slabs += u64::from(read_words(&self.context, slabs.capped(), 4)?[0]);
        }
        let in_parts = match self.kept.buffer() {
            Some(buffer) => read_words(&self.context, buffer, 16)?,
            None => vec![0; 4],
        };
        let counted = |words: &[u32]| u64::from(words[2]) | u64::from(words[3]) << 32;
        Ok(counted(&gathered) + counted(&in_parts) + u64::from(in_parts[0]) + in_slabs)
    }

    pub(super) fn gather(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        tiles: u32,
        clock: Option<&Timestamps>,
    ) {
        let format = self.light_format();
        let Some(variant) = self.gathering.variant else { return };
        let context = &self.context;
        let pipelines = &mut self.gathering.pipelines;
        let pipeline =
            pipelines.entry(variant).or_insert_with(|| pipeline(context, variant, format)).clone();
        let Some(target) = &self.target else { return };
        let Some(volume) = &self.volume else { return };
        let Some(table) = &volume.table else { return };
        let light = target.light.create_view(&Default::default());
        let kept = self.shaded.whole().filter(|_| variant.looks == Looks::Kept);
        let totals = self.kept.buffer().filter(|_| variant.in_parts).unwrap_or(&self.totals);
        let mut bound = vec![(0, &self.traversal)];
        if kept.is_none() {
            bound.extend((1..).zip(volume.samples.bound()));
            bound.push((5, &table.entries));
            bound.extend(self.gathering.looks());
        }
        bound.extend([(6, &table.visible), (7, &self.gathering.constants), (8, totals)]);
        let entries: Vec<_> = bound.into_iter().map(entry).collect();
        let resource = wgpu::BindingResource::TextureView(&light);
        let light = vec![wgpu::BindGroupEntry { binding: 0, resource }];
        let samples: Vec<_> = (0..).zip(kept.into_iter().flatten()).map(entry).collect();
        let group = |at: u32, entries: &[wgpu::BindGroupEntry<'_>]| {
            context.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(variant.pass()),
                layout: &pipeline.get_bind_group_layout(at),
                entries,
            })
        };
        let words = self.polygons.as_ref().filter(|_| variant.polygons);
        let words: Vec<_> =
            words.map(|polygons| entry((0, polygons.words()))).into_iter().collect();
        let groups = [entries, light, samples, words];
        let groups = groups.iter().filter(|entries| !entries.is_empty());
        let groups = (0..).zip(groups);
        let mut groups: Vec<_> = groups.map(|(at, entries)| group(at, entries)).collect();
        if let (true, Some(vectors), Some(lists)) = (variant.vectors, &self.vectors, &self.lists) {
            let layout = pipeline.get_bind_group_layout(groups.len() as u32);
            groups.push(vectors.group(context, lists, &layout));
        }
        let [across, down] = groups_of_tiles(tiles);
        dispatch(encoder, variant.pass(), &pipeline, &groups, [across, down, 1], clock);
    }
}

/// A buffer at a binding.
pub(super) fn entry((binding, buffer): (u32, &wgpu::Buffer)) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }
}

fn pipeline(
    context: &Context,
    variant: Variant,
    format: wgpu::TextureFormat,
) -> wgpu::ComputePipeline {
    let shader = variant.shader();
    let constants = variant.constants();
    let of_vectors = match variant.vectors {
        true => vector_constants(),
        false => Vec::new(),
    };
    let own: Vec<_> =
        of_vectors.into_iter().map(|(name, value)| (shader::own_name(name), value)).collect();
    let own = own.iter().map(|(name, value)| (name.as_str(), *value));
    let constants: Vec<(&str, f64)> = constants.into_iter().chain(own).collect();
    let module = shader.module_writing(&context.device, format);
    compute_pipeline(context, shader, &module, &constants)
}

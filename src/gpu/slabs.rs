//! Slabs of a field that is classified after reconstruction (`reconstruct_slabs.wgsl`).

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::GpuError;
use super::buffers::Growing;
use super::compute::groups_of_tiles;
use super::context::Context;
use super::field::{DeviceField, FIELD_CHUNKS, Format, window};
use super::inside::{InsideVariant, Opening};
use super::layout;
use super::marks::Marked;
use super::pipelines::vector_constants;
use super::polygons::DevicePolygons;
use super::scattered::Lists;
use super::shade::{CellsOfValues, Shade, ShadeVariant};
use super::shader::{Faces, PROJECT_VALUES, RECONSTRUCT_SLABS, SlabPieces};
use super::turns::{SlabPart, SlabRays};
use super::vectors::DeviceVectors;
use crate::core::Ticket;
use crate::hierarchy::Speck;
use crate::kernel::{Coefficients, Kernel, RadialKernel};
use crate::scene::{AlongRay, Classify, OpacityModel, Order, SplatSettings, View};
use crate::transfer::Cumulative;
use crate::volume::ScalarVolume;

use layout::TILE;

/// Everything that slabs of a reconstructed field keep on the device.
#[derive(Debug)]
pub(super) struct SlabPass {
    pipelines: HashMap<Variant, wgpu::ComputePipeline>,
    uniform: wgpu::Buffer,
    /// Lights and shading tables, while they are asked for.
    shade: Option<wgpu::Buffer>,
    /// Regions of value and gradient strength, likewise.
    regions: Option<wgpu::Buffer>,
    /// What lets the inside be seen, likewise.
    inside: Option<wgpu::Buffer>,
    capped: wgpu::Buffer,
    source: Option<Arc<ScalarVolume>>,
    interpolating: bool,
    pub(super) field: Option<DeviceField>,
    pub(super) table: Option<SlabTable>,
    /// Pixels of the next picture that have more rays than one.
    pub(super) marked: Option<Marked>,
}

#[derive(Debug)]
pub(super) struct SlabTable {
    sums: wgpu::Buffer,
    /// With room for marks once there were some.
    pub(super) empty: wgpu::Buffer,
    /// Words of it without them.
    pub(super) empty_words: u64,
    /// Bricks that show within a voxel of them.
    pub(super) shows: Vec<bool>,
    /// What is small among them, by plates of so many bricks, once someone has asked.
    pub(super) specks: Option<(usize, Vec<Speck>)>,
    holes_at: u32,
    /// Whether samples without data can be seen.
    holes_show: bool,
    coordinate: [f32; 2],
    values: CellsOfValues,
    count: u32,
    /// Between which cells all lie that show.
    shown: [f32; 2],
    ends: [[f32; 4]; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Variant {
    kernel: Kernel,
    window: usize,
    format: Format,
    one_chunk: bool,
    has_holes: bool,
    holes_show: bool,
    has_widths: bool,
    middle: bool,
    published: bool,
    back_to_front: bool,
    target: wgpu::TextureFormat,
    in_parts: bool,
    looks: LooksVariant,
    vectors: bool,
}

/// What a scene asks for beside its transfer function and its mode.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Looks<'a> {
    pub shade: Option<&'a Shade>,
    pub inside: Option<&'a Opening>,
    /// Polygons that a pixel sees at most.
    pub polygons: Option<u32>,
}

/// What lies in the slabs of a field.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside<'a> {
    pub vectors: Option<(&'a DeviceVectors, &'a Lists)>,
    pub polygons: Option<&'a DevicePolygons>,
}

/// What of it a pipeline is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct LooksVariant {
    pub shade: Option<ShadeVariant>,
    pub inside: InsideVariant,
    pub polygons: bool,
}

impl Looks<'_> {
    /// `quickly`: of a field for previews.
    pub(super) fn variant(&self, quickly: bool) -> LooksVariant {
        let inside = self.inside.map_or_else(InsideVariant::default, |inside| inside.variant);
        // Nothing falls on values that are projected.
        let shade = self.shade.filter(|_| inside.along == AlongRay::Composite);
        let shade = shade.map(|shade| ShadeVariant { quickly, ..shade.variant });
        LooksVariant { shade, inside, polygons: self.polygons.is_some() }
    }
}

impl LooksVariant {
    /// Whether values are projected, rather than slabs composited.
    pub(super) fn projects(&self) -> bool {
        self.inside.along != AlongRay::Composite
    }

    /// The pass.
    fn pass(&self) -> &'static str {
        if self.projects() { PROJECT_VALUES } else { RECONSTRUCT_SLABS }
    }
}

impl SlabPass {
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        Self {
            pipelines: HashMap::new(),
            uniform: Growing::make(
                context,
                "slabs",
                Usage::STORAGE | Usage::COPY_DST,
                size_of::<layout::Slabs>() as u64,
            ),
            shade: None,
            regions: None,
            inside: None,
            capped: Growing::make(
                context,
                "capped",
                Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC,
                16,
            ),
            source: None,
            interpolating: false,
            field: None,
            table: None,
            marked: None,
        }
    }

    pub(super) fn pipeline_count(&self) -> usize {
        self.pipelines.len()
    }

    pub(super) fn size_bytes(&self) -> u64 {
        self.field.as_ref().map_or(0, DeviceField::size_bytes)
            + self.table.as_ref().map_or(0, |t| t.sums.size() + t.empty.size())
            + self.shading_bytes()
            + self.inside_bytes()
    }

    /// Of them, what lets the inside be seen takes.
    pub(super) fn inside_bytes(&self) -> u64 {
        self.inside.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// Of them, what lights, shading tables and regions take.
    pub(super) fn shading_bytes(&self) -> u64 {
        let size = |buffer: &Option<wgpu::Buffer>| buffer.as_ref().map_or(0, wgpu::Buffer::size);
        size(&self.shade) + size(&self.regions)
    }

    /// Whether the field of these settings is there.
    pub(super) fn holds(&self, volume: &Arc<ScalarVolume>, settings: &SplatSettings) -> bool {
        let same = self.source.as_ref().is_some_and(|held| Arc::ptr_eq(held, volume));
        same && self.interpolating == is_interpolating(settings)
            && self.field.as_ref().is_some_and(|field| {
                field.kernel == settings.kernel && field.extent == settings.extent
            })
    }

    /// The kernel of the field held, and its samples along each axis.
    pub(super) fn shape(&self) -> Option<(Kernel, [usize; 3])> {
        self.field.as_ref().map(|field| (field.kernel, field.dims))
    }

    /// Lets go of a volume that is not drawn any more.
    pub(super) fn clear(&mut self) {
        (self.source, self.field, self.table, self.marked) = (None, None, None, None);
    }

    pub(super) fn set_field(
        &mut self,
        context: &Context,
        volume: &Arc<ScalarVolume>,
        settings: &SplatSettings,
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<(), GpuError> {
        self.clear();
        let SplatSettings { kernel, extent, .. } = *settings;
        let field = DeviceField::upload(context, volume, kernel, extent, coefficients, ticket)?;
        self.field = Some(field);
        self.source = Some(Arc::clone(volume));
        self.interpolating = is_interpolating(settings);
        Ok(())
    }

    /// Sets the classification, and finds what it leaves empty for steps of `reach` voxels.
    /// Isosurfaces of `levels` are not empty.
    pub(super) fn set_table(
        &mut self,
        context: &Context,
        table: &Cumulative,
        reach: usize,
        levels: &[f64],
    ) {
        let Some(field) = &self.field else { return };
        let (empty, holes_at, shows) = field.empty_space(table, reach, levels);
        let storage = |label, bytes: &[u8]| {
            use wgpu::BufferUsages as Usage;
            let usage = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
            let buffer = Growing::make(context, label, usage, bytes.len() as u64);
            context.queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        let mut sums: Vec<[u32; 4]> = table
            .cells
            .iter()
            .zip(&table.slopes)
            .map(|(&cell, &slope)| packed(cell, slope))
            .collect();
        let integrated = table.emission.iter().zip(&table.depth);
        sums.extend(integrated.map(|(e, &w)| [e[0], e[1], e[2], w].map(f32::to_bits)));
        let holes_show = field.holes.is_some() && table.no_data[3] > 0.0;
        sums.extend(holes_show.then(|| table.no_data.map(f32::to_bits)));
        let (offset, scale) = (field.offset, field.scale);
        #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
        let coordinate = [
            ((offset - table.low) * table.scale + layout::LIFT_CELLS) as f32,
            (scale * table.scale) as f32,
        ];
        #[expect(clippy::cast_possible_truncation, reason = "a few thousand")]
        let count = table.cells.len() as u32;
        self.marked = None;
        // An edit seldom changes where something can show.
        let before = self.table.take().filter(|before| before.shows == shows);
        self.table = Some(SlabTable {
            sums: storage("slab table", bytemuck::cast_slice(&sums)),
            empty: storage("empty space", bytemuck::cast_slice(&empty)),
            empty_words: empty.len() as u64,
            shows,
            specks: before.and_then(|before| before.specks),
            holes_at,
            holes_show,
            coordinate,
            values: CellsOfValues {
                at_zero: layout::LIFT_CELLS - table.low * table.scale,
                per_value: table.scale,
            },
            count,
            shown: table.shown(),
            ends: table.ends,
        });
    }

    pub(super) fn holds_table(&self) -> bool {
        self.table.is_some()
    }

    /// Distance between slab faces, pixels of view depth.
    pub(super) fn thickness(
        &self,
        view: &View,
        settings: &SplatSettings,
        smallest_spacing: f64,
    ) -> f64 {
        let level = self.field.as_ref().map_or(0, |field| field.level);
        slab_pixels(view, smallest_spacing * f64::from(1_u32 << level), settings)
    }

    /// The dispatches that walk the rays of a picture: `None` for a single one.
    ///
    /// # Errors
    /// More slabs than can be told apart.
    pub(super) fn parts(
        &self,
        context: &Context,
        view: &View,
        settings: &SplatSettings,
        picture: PictureConstants,
        looks: Looks<'_>,
    ) -> Result<Option<Vec<SlabPart>>, GpuError> {
        let Some(halved) = self.halved(view) else { return Ok(None) };
        let side = halved.rays_per_side(settings.kernel, settings.extent);
        let Some(rays) = self.rays(view, settings, picture, looks, side) else { return Ok(None) };
        rays.check(context.most_turns)?;
        Ok(rays.parts(context.most_turns))
    }

    /// A view as the lattice of the field has it, which may be halved.
    pub(super) fn halved(&self, view: &View) -> Option<View> {
        Some(view.halved(self.field.as_ref()?.level))
    }

    /// The rays of a picture, so many along the side of a pixel.
    pub(super) fn rays(
        &self,
        view: &View,
        settings: &SplatSettings,
        picture: PictureConstants,
        looks: Looks<'_>,
        side: u32,
    ) -> Option<SlabRays> {
        let field = self.field.as_ref()?;
        let (view, picture) = &seen(view, picture, field.level);
        let SplatSettings { kernel, extent, .. } = *settings;
        let is_radial = RadialKernel::new(kernel, extent).is_some();
        let samples = window(kernel, extent);
        Some(SlabRays {
            view_from_index: view.view_from_index,
            dims: field.dims,
            thickness: face_pixels(view, picture.smallest_spacing, settings, looks),
            side,
            // Two to either side are summed up without loops.
            window: (is_radial && samples != 2).then_some(samples),
            surfaces: looks.inside.map_or(0, |inside| inside.variant.surfaces()),
            projects: looks.variant(false).projects(),
            polygons: looks.polygons,
            seeks_specks: field.has_widths,
        })
    }

    /// Writes the constants of a piece; false where nothing is set up.
    pub(super) fn write(
        &mut self,
        context: &Context,
        view: &View,
        settings: &SplatSettings,
        picture: PictureConstants,
        (tiles, part): (&Range<u32>, SlabPart),
        looks: Looks<'_>,
    ) -> bool {
        let (Some(field), Some(table)) = (&self.field, &self.table) else { return false };
        let seen_view = view;
        let (view, picture) = &seen(view, picture, field.level);
        let mut constants = slab_constants(view, settings, *picture, tiles);
        let last = |v: &mut [f32; 4], w: f32| v[3] = w;
        let step = face_pixels(view, picture.smallest_spacing, settings, looks);
        last(&mut constants.base, step as f32);
        let [x, y, z] = field.dims.map(|n| n as u32);
        let [sx, sy, _] = field.stored.map(|n| n as u32);
        let [bx, by, bz] = field.bricks().map(|n| n as u32);
        constants.dims = [x, y, z, field.pad as u32];
        let [ex, ey, ez] = field.end.map(|end| end as f32);
        let [first, last] = table.shown;
        constants.end = [ex, ey, ez, last];
        constants.stored =
            [sx, sy, field.chunk_log2, window(settings.kernel, settings.extent) as u32];
        constants.bricks = [bx, by, bz, table.count];
        let stretch =
            RadialKernel::new(settings.kernel, settings.extent).map_or(1.0, |k| k.scale());
        constants.table = [table.coordinate[0], table.coordinate[1], stretch as f32, first];
        [constants.below, constants.beyond] = table.ends;
        let side = view.rays_per_side(settings.kernel, settings.extent);
        let marked = self.marked.as_ref().map_or(0, |marked| marked.word_of(seen_view, part));
        constants.more = [tiles.len() as u32, side, table.holes_at, marked];
        constants.part = part;
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&constants));
        write_inside(context, &mut self.inside, (field.level, table.values), looks.inside);
        let projects = looks.variant(false).projects();
        let shade = looks.shade.filter(|_| !projects);
        write_regions(
            context,
            &mut self.regions,
            shade.and_then(|shade| shade.regions(table.values)),
        );
        match shade {
            None => self.shade = None,
            Some(shade) => {
                let growth = constants.up[3];
                let (values, pixels) = (table.values, view.pixels_per_unit);
                let constants = shade.constants(values, field.level, pixels, growth);
                let buffer = self.shade.get_or_insert_with(|| {
                    use wgpu::BufferUsages as Usage;
                    let size = size_of::<layout::Shade>() as u64;
                    Growing::make(context, "shade", Usage::UNIFORM | Usage::COPY_DST, size)
                });
                context.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&constants));
            }
        }
        true
    }

    /// Encodes a piece of `tiles` tiles, or a part of its rays that `kept` keeps.
    pub(super) fn encode(
        &mut self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        settings: &SplatSettings,
        (light, format): (&wgpu::TextureView, wgpu::TextureFormat),
        (tiles, kept): (u32, Option<&wgpu::Buffer>),
        (looks, beside, timestamps): (
            LooksVariant,
            Beside<'_>,
            Option<wgpu::ComputePassTimestampWrites<'_>>,
        ),
    ) {
        let (Some(field), Some(table)) = (&self.field, &self.table) else { return };
        let variant = Variant {
            kernel: settings.kernel,
            window: field.pad,
            format: field.format,
            one_chunk: field.chunks.len() == 1,
            has_holes: field.holes.is_some(),
            holes_show: table.holes_show,
            has_widths: field.has_widths,
            middle: settings.classify == Classify::After,
            published: settings.opacity_model == OpacityModel::Published,
            back_to_front: settings.order == Order::BackToFront,
            target: format,
            in_parts: kept.is_some(),
            looks,
            vectors: beside.vectors.is_some(),
        };
        let pipeline =
            self.pipelines.entry(variant).or_insert_with(|| compile(context, variant)).clone();
        let mut bound: Vec<wgpu::BindingResource<'_>> = vec![self.uniform.as_entire_binding()];
        // Bindings beyond the last chunk repeat it; no index leads there.
        bound.extend(
            (0..FIELD_CHUNKS)
                .map(|i| field.chunks[i.min(field.chunks.len() - 1)].as_entire_binding()),
        );
        bound.extend([&table.empty, &table.sums].map(|b| b.as_entire_binding()));
        bound.push(wgpu::BindingResource::TextureView(light));
        // Projections count nothing.
        bound.extend(match kept {
            None if looks.projects() => None,
            None => Some(self.capped.as_entire_binding()),
            Some(kept) => Some(kept.as_entire_binding()),
        });
        bound.extend(self.shade.as_ref().map(|b| b.as_entire_binding()));
        bound.extend(self.regions.as_ref().map(|b| b.as_entire_binding()));
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0_u32..)
            .zip(bound)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(looks.pass()),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        // Groups count up, whichever there are: see `Shader::source`.
        let inside = self.inside.as_ref().map(|buffer| {
            context.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("inside"),
                layout: &pipeline.get_bind_group_layout(1),
                entries: &[wgpu::BindGroupEntry {
                    binding: 0,
                    resource: buffer.as_entire_binding(),
                }],
            })
        });
        let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(looks.pass()),
            timestamp_writes: timestamps,
        });
        compute.set_pipeline(&pipeline);
        compute.set_bind_group(0, &group, &[]);
        let mut next = 1;
        if let Some(inside) = &inside {
            compute.set_bind_group(next, inside, &[]);
            next += 1;
        }
        if let Some((vectors, lists)) = beside.vectors {
            let layout = pipeline.get_bind_group_layout(next);
            compute.set_bind_group(next, &vectors.group(context, lists, &layout), &[]);
            next += 1;
        }
        if let Some(polygons) = beside.polygons.filter(|_| !looks.projects()) {
            let layout = pipeline.get_bind_group_layout(next);
            compute.set_bind_group(next, &polygons.group(context, &layout), &[]);
        }
        let [across, down] = groups_of_tiles(tiles);
        compute.dispatch_workgroups(across, down, 1);
    }

    /// The counter of capped opacities.
    pub(super) fn capped(&self) -> &wgpu::Buffer {
        &self.capped
    }
}

/// Writes what lets the inside be seen, or lets go of it.
fn write_inside(
    context: &Context,
    buffer: &mut Option<wgpu::Buffer>,
    (level, values): (u32, CellsOfValues),
    inside: Option<&Opening>,
) {
    let Some(inside) = inside.filter(|inside| inside.variant.is_bound()) else {
        *buffer = None;
        return;
    };
    let buffer = buffer.get_or_insert_with(|| {
        use wgpu::BufferUsages as Usage;
        let size = size_of::<layout::Inside>() as u64;
        Growing::make(context, "inside", Usage::UNIFORM | Usage::COPY_DST, size)
    });
    context.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&inside.constants(level, values)));
}

/// Writes regions, or lets go of them.
fn write_regions(
    context: &Context,
    buffer: &mut Option<wgpu::Buffer>,
    regions: Option<layout::Regions>,
) {
    let Some(regions) = regions else {
        *buffer = None;
        return;
    };
    let buffer = buffer.get_or_insert_with(|| {
        use wgpu::BufferUsages as Usage;
        let size = size_of::<layout::Regions>() as u64;
        Growing::make(context, "regions", Usage::UNIFORM | Usage::COPY_DST, size)
    });
    context.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&regions));
}

fn is_interpolating(settings: &SplatSettings) -> bool {
    settings.reconstruction == crate::scene::Reconstruction::Interpolating
}

/// What a picture has beside its view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureConstants {
    /// World length over which opacities are given.
    pub unit_distance: f64,
    /// The lattice's smallest spacing, world units.
    pub smallest_spacing: f64,
    /// Front to back, rays end where less transmittance is left.
    pub stop_below: f64,
}

/// A view and its constants, as a lattice that was halved so many times has them.
fn seen(view: &View, picture: PictureConstants, level: u32) -> (View, PictureConstants) {
    let smallest_spacing = picture.smallest_spacing * f64::from(1_u32 << level);
    (view.halved(level), PictureConstants { smallest_spacing, ..picture })
}

/// Distance between slab faces, pixels of view depth.
fn slab_pixels(view: &View, smallest_spacing: f64, settings: &SplatSettings) -> f64 {
    smallest_spacing / settings.slabs_per_voxel * view.pixels_per_unit
}

/// Faces in a slab of which values are projected: those have more to them than light that adds up. Of
/// noise, the greatest values are off by 2.0e-2 with one (as colours, rmse), by 1.2e-3 with two.
const PROJECTED_FACES: f64 = 2.0;

/// Distance between the places at which a ray's values are asked, pixels of view depth.
fn face_pixels(
    view: &View,
    smallest_spacing: f64,
    settings: &SplatSettings,
    looks: Looks<'_>,
) -> f64 {
    let slab = slab_pixels(view, smallest_spacing, settings);
    if looks.variant(false).projects() { slab / PROJECTED_FACES } else { slab }
}

/// Voxels that a ray may cross between two slab faces along any axis, rounded up: at least 1.
pub(super) fn step_reach(view: &View, smallest_spacing: f64, settings: &SplatSettings) -> usize {
    let index_from_view = view.view_from_index.inverse();
    let rows = index_from_view.transpose();
    let longest = rows.x_axis.length().max(rows.y_axis.length()).max(rows.z_axis.length());
    let half = glam::DVec2::new(f64::from(view.size[0]), f64::from(view.size[1])) / 2.0;
    // The longest ray of a perspective picture, per pixel of depth.
    let stretch = view.eye_distance.map_or(1.0, |d| (half / d).extend(1.0).length());
    let step = slab_pixels(view, smallest_spacing, settings) * stretch * longest;
    if settings.classify == Classify::After {
        // Only the middle is asked.
        return (step / 2.0 + 1e-3).ceil().clamp(1.0, 1e4) as usize;
    }
    (step + 1e-3).ceil().clamp(1.0, 1e4) as usize
}

/// The rays of a picture in index space, in double precision until the end.
fn slab_constants(
    view: &View,
    settings: &SplatSettings,
    picture: PictureConstants,
    tiles: &Range<u32>,
) -> layout::Slabs {
    let index_from_view = view.view_from_index.inverse();
    let centre = view.view_centre;
    let base = view.lattice_centre - index_from_view * centre.truncate().extend(0.0);
    let (scale, growth, eye) = match view.eye_distance {
        None => (1.0, 0.0, -1e30),
        Some(distance) => (centre.z / distance, 1.0 / distance, -centre.z),
    };
    #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
    let with = |v: glam::DVec3, w: f64| v.as_vec3().extend(w as f32).to_array();
    let half = view.size.map(|n| f64::from(n) / 2.0);
    // Far to near nothing is hidden before it is drawn.
    let stop = if settings.order == Order::FrontToBack { picture.stop_below } else { 0.0 };
    let width = slab_pixels(view, picture.smallest_spacing, settings);
    // Capped where a voxel is 1e20 unit distances thick: beyond, 32 bits would overflow.
    let per_pixel = (1.0 / (picture.unit_distance * view.pixels_per_unit)).min(1e20);
    layout::Slabs {
        base: with(base, width),
        right: with(index_from_view.x_axis, scale),
        up: with(index_from_view.y_axis, growth),
        along: with(index_from_view.z_axis, eye),
        #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
        picture: [half[0] as f32, half[1] as f32, per_pixel as f32, stop as f32],
        tiles: [tiles.start, view.size[0].div_ceil(TILE), view.size[0], view.size[1]],
        ..bytemuck::Zeroable::zeroed()
    }
}

/// A cell of the table as the shader takes it.
fn packed([r, g, b, weight]: [f32; 4], slope: f32) -> [u32; 4] {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=65535")]
    let unorm = |x: f32| (x.clamp(0.0, 1.0) * 65535.0 + 0.5) as u32;
    [unorm(r) | unorm(g) << 16, unorm(b), slope.to_bits(), weight.to_bits()]
}

fn compile(context: &Context, variant: Variant) -> wgpu::ComputePipeline {
    let kernel = match variant.kernel {
        Kernel::Point | Kernel::Nearest => 0,
        Kernel::Linear => 1,
        Kernel::Gaussian => 2,
        Kernel::Cubic | Kernel::Gouraud => 3,
        Kernel::BSpline => 4,
    };
    let format = match variant.format {
        Format::Pairs => 0,
        Format::Halves => 1,
        Format::Floats => 2,
    };
    let flag = |on: bool| f64::from(u8::from(on));
    let mut constants = vec![
        ("kernel", f64::from(kernel)),
        ("window", variant.window as f64),
        ("format", f64::from(format)),
        ("one_chunk", flag(variant.one_chunk)),
        ("has_holes", flag(variant.has_holes)),
        ("holes_show", flag(variant.holes_show)),
        ("has_widths", flag(variant.has_widths)),
        ("classify_middle", flag(variant.middle)),
        ("published", flag(variant.published)),
        ("back_to_front", flag(variant.back_to_front)),
    ];
    let LooksVariant { shade, inside, polygons } = &variant.looks;
    constants.extend(shade.iter().flat_map(ShadeVariant::constants));
    constants.extend(inside.constants());
    if variant.vectors {
        constants.extend(vector_constants());
    }
    let faces = match (shade, variant.kernel) {
        (None, _) => Faces::Unlit,
        (Some(_), Kernel::BSpline) => Faces::BSplines,
        (Some(shade), _) if shade.quickly => Faces::Tents,
        (Some(_), _) => Faces::Differences,
    };
    let pieces = SlabPieces {
        in_parts: variant.in_parts,
        faces,
        clipped: inside.is_clipped(),
        surfaces: inside.surfaces() > 0,
        levels: inside.levels > 0,
        vectors: variant.vectors,
        regions: shade.is_some_and(|shade| shade.regions > 0),
        polygons: *polygons,
        means: variant.has_widths,
    };
    let shader = if variant.looks.projects() { pieces.projecting() } else { pieces.shader() };
    let module = shader.module_writing(&context.device, variant.target);
    context.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(shader.name),
        layout: None,
        module: &module,
        entry_point: Some(shader.name),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..Default::default()
        },
        cache: None,
    })
}

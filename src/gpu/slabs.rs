//! Slabs of a field that is classified after reconstruction (`reconstruct_slabs.wgsl`).

mod marking;
mod tops;

use std::ops::Range;
use std::sync::Arc;

use super::GpuError;
use super::buffers::Growing;
use super::clock::Timestamps;
use super::compute::{buffer, buffers, dispatch, rows_of, view as picture_at};
use super::context::Context;
use super::field::{DeviceField, FIELD_CHUNKS, Format};
use super::inside::{InsideVariant, Opening};
use super::layout::{self, narrow, narrow4};
use super::levels::DeviceLevels;
use super::marks::Marked;
use super::pipelines::{Pipelines, Program, flag, vector_constants};
use super::polygons::DevicePolygons;
use super::rays;
use super::scattered::Lists;
use super::shade::{CellsOfValues, Shade, ShadeVariant};
use super::shader::{self, Among};
use super::vectors::DeviceVectors;
use crate::core::Ticket;
use crate::hierarchy::Speck;
use crate::kernel::{Coefficients, Kernel};
use crate::plan::bricks_of_cut;
use crate::rbf::Basis;
use crate::scene::{AlongRay, Classify, OpacityModel, Order, SplatSettings, View};
use crate::transfer::Cumulative;
use crate::volume::ScalarVolume;

use layout::TILE;
use tops::Tops;

/// Everything that slabs of a reconstructed field keep on the device.
#[derive(Debug)]
pub(super) struct SlabPass {
    uniform: wgpu::Buffer,
    /// Lights and shading tables, while they are asked for.
    shade: Option<wgpu::Buffer>,
    source: Option<Arc<ScalarVolume>>,
    interpolating: bool,
    pub(super) field: Option<DeviceField>,
    pub(super) table: Option<SlabTable>,
    /// While greatest or least values are sought.
    tops: Option<Tops>,
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

/// What a scene asks for beside its transfer function and its mode.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Looks<'a> {
    pub shade: Option<&'a Shade>,
    pub inside: Option<&'a Opening>,
    /// Whether there are polygons.
    pub polygons: bool,
}

/// What lies in the slabs of a field.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside<'a> {
    pub vectors: Option<(&'a DeviceVectors, &'a Lists)>,
    pub polygons: Option<&'a DevicePolygons>,
    /// What a cut of the field is of, if the picture is of one.
    pub levels: Option<&'a DeviceLevels>,
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
        LooksVariant { shade, inside, polygons: self.polygons }
    }
}

/// Bricks of a cut of a field of which something holds that is known of the field's own bricks, and of a voxel about each. Those
/// begin half a cell later than the ones of a cut.
fn of_cut(field: &DeviceField, holds: impl Fn(usize) -> bool) -> Vec<u32> {
    let (own, [nx, ny, nz]) = (field.bricks(), bricks_of_cut(field.dims));
    let holds = |at: [usize; 3]| {
        let [x, y, z] = [0, 1, 2].map(|a| at[a].min(own[a] - 1));
        holds((z * own[1] + y) * own[0] + x)
    };
    let all = (0..nx * ny * nz).filter(|i| holds([i % nx, i / nx % ny, i / (nx * ny)]));
    #[expect(clippy::cast_possible_truncation, reason = "a sixty-fourth of the samples")]
    all.map(|brick| brick as u32).collect()
}

impl LooksVariant {
    /// Whether values are projected, rather than slabs composited.
    pub(super) fn projects(&self) -> bool {
        self.inside.along != AlongRay::Composite
    }
}

impl SlabPass {
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        Self {
            uniform: Growing::make(
                context,
                "slabs",
                Usage::STORAGE | Usage::COPY_DST,
                size_of::<layout::Slabs>() as u64,
            ),
            shade: None,
            source: None,
            interpolating: false,
            field: None,
            table: None,
            tops: None,
            marked: None,
        }
    }

    pub(super) fn size_bytes(&self) -> u64 {
        self.field.as_ref().map_or(0, DeviceField::size_bytes)
            + self.table.as_ref().map_or(0, |t| t.sums.size() + t.empty.size())
            + self.tops.as_ref().map_or(0, |tops| tops.words.size())
            + self.shading_bytes()
    }

    /// Of them, what lights, shading tables and regions take.
    pub(super) fn shading_bytes(&self) -> u64 {
        self.shade.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// Whether the field of these settings is there.
    pub(super) fn holds(&self, volume: &Arc<ScalarVolume>, settings: &SplatSettings) -> bool {
        let same = self.source.as_ref().is_some_and(|held| Arc::ptr_eq(held, volume));
        same && self.interpolating == is_interpolating(settings)
            && self.field.as_ref().is_some_and(|field| {
                field.kernel == settings.kernel
                    && field.extent == settings.extent
                    && field.limits == settings.limits()
            })
    }

    /// Whether a cut may be drawn of the field, beside which it is bound: means in its place have widths, and the greatest fields
    /// leave no binding.
    pub(super) fn takes_cuts(&self) -> bool {
        let takes = |field: &DeviceField| {
            let is_own = field.functions.is_some() || field.has_widths || field.level > 0;
            !is_own && field.chunks.len() < FIELD_CHUNKS
        };
        self.field.as_ref().is_some_and(takes)
    }

    /// Whether means are of the volume that the field is of.
    pub(super) fn is_of(&self, levels: &DeviceLevels) -> bool {
        self.source.as_ref().is_some_and(|volume| levels.are_of(volume))
    }

    /// Cells of the table, by values.
    pub(super) fn values(&self) -> Option<CellsOfValues> {
        self.table.as_ref().map(|table| table.values)
    }

    /// Bricks of a cut in which anything may show, within a voxel of them, and how many there are along each axis.
    pub(super) fn shown_bricks(&self) -> Option<([usize; 3], Vec<u32>)> {
        let (field, table) = (self.field.as_ref()?, self.table.as_ref()?);
        Some((bricks_of_cut(field.dims), of_cut(field, |own| table.shows[own])))
    }

    /// Those in which the field may have one of some values, as isosurfaces do.
    pub(super) fn passed_bricks(&self, levels: &[f64]) -> Vec<u32> {
        match &self.field {
            Some(field) if !levels.is_empty() => of_cut(field, |own| field.has_any(own, levels)),
            _ => Vec::new(),
        }
    }

    /// Whether light that falls on the border of cells finds what it takes for their growths.
    pub(super) fn is_lit(&self) -> bool {
        self.field.as_ref().is_some_and(|field| field.is_lit)
    }

    /// The kernel of the field held, and its samples along each axis.
    pub(super) fn shape(&self) -> Option<(Kernel, [usize; 3])> {
        self.field.as_ref().map(|field| (field.kernel, field.dims))
    }

    /// Lets go of a volume that is not drawn any more.
    pub(super) fn clear(&mut self) {
        (self.source, self.field, self.table, self.marked) = (None, None, None, None);
        self.tops = None;
    }

    pub(super) fn set_field(
        &mut self,
        context: &Context,
        volume: &Arc<ScalarVolume>,
        (settings, is_lit): (&SplatSettings, bool),
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<(), GpuError> {
        self.clear();
        let SplatSettings { kernel, extent, .. } = *settings;
        let (kernel, extent) = ((kernel, settings.limits()), (extent, is_lit));
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
        let has_depths = field.border_strength.is_some();
        let holes_show = field.holes.is_some() && !has_depths && table.no_data[3] > 0.0;
        sums.extend(holes_show.then(|| table.no_data.map(f32::to_bits)));
        let (offset, scale) = (field.offset, field.scale);
        let coordinate = [
            narrow((offset - table.low) * table.scale + layout::LIFT_CELLS),
            narrow(scale * table.scale),
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

    /// # Errors
    /// More slabs than can be told apart.
    pub(super) fn check(
        &self,
        view: &View,
        settings: &SplatSettings,
        picture: PictureConstants,
        looks: Looks<'_>,
    ) -> Result<(), GpuError> {
        let Some(field) = &self.field else { return Ok(()) };
        let (view, picture) = seen(view, picture, field.level);
        let thickness = face_pixels(&view, picture.smallest_spacing, settings, looks);
        rays::check(rays::slabs_of_field(&view, field.dims, thickness))
    }

    /// A view as the lattice of the field has it, which may be halved.
    pub(super) fn halved(&self, view: &View) -> Option<View> {
        Some(view.halved(self.field.as_ref()?.level))
    }

    /// Writes the constants of a piece; false where nothing is set up.
    pub(super) fn write(
        &mut self,
        context: &Context,
        view: &View,
        settings: &SplatSettings,
        picture: PictureConstants,
        tiles: &Range<u32>,
        looks: Looks<'_>,
    ) -> bool {
        let (Some(field), Some(table)) = (&self.field, &self.table) else { return false };
        let seen_view = view;
        let (view, picture) = &seen(view, picture, field.level);
        let mut constants = slab_constants(view, settings, *picture, tiles);
        let last = |v: &mut [f32; 4], w: f32| v[3] = w;
        let step = face_pixels(view, picture.smallest_spacing, settings, looks);
        last(&mut constants.base, narrow(step));
        let [x, y, z] = field.dims.map(|n| n as u32);
        let [sx, sy, _] = field.stored.map(|n| n as u32);
        let [bx, by, bz] = field.bricks().map(|n| n as u32);
        constants.dims = [x, y, z, field.pad as u32];
        let [ex, ey, ez] = field.end.map(narrow);
        let [first, last] = table.shown;
        constants.end = [ex, ey, ez, last];
        constants.stored =
            [sx, sy, field.chunk_words, settings.kernel.window(settings.extent) as u32];
        if let Some((edge, _)) = field.functions {
            constants.stored[0] = edge as u32;
        }
        constants.bricks = [bx, by, bz, table.count];
        let stretch = settings.kernel.stretch(settings.extent);
        constants.table = [table.coordinate[0], table.coordinate[1], narrow(stretch), first];
        [constants.below, constants.beyond] = table.ends;
        let side = view.rays_per_side(settings.kernel, settings.extent);
        let marked = self.marked.as_ref().map_or(0, |marked| marked.word_of(seen_view));
        constants.more = [tiles.len() as u32, side, table.holes_at, marked];
        if let Some(inside) = looks.inside {
            inside.write(&mut constants, field.level, table.values);
        }
        let along = looks.variant(false).inside.along;
        match along {
            AlongRay::Maximum | AlongRay::Minimum => {
                let reach = step_reach(view, picture.smallest_spacing, settings);
                let kept = self.tops.take().filter(|tops| tops.serve(along, reach));
                let tops = kept.unwrap_or_else(|| Tops::new(context, field, along, reach));
                constants.tops = tops.in_cells(table);
                self.tops = Some(tops);
            }
            AlongRay::Average | AlongRay::Composite => self.tops = None,
        }
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&constants));
        let shade = looks.shade.filter(|_| !looks.variant(false).projects());
        match shade {
            None => self.shade = None,
            Some(shade) => {
                let growth = constants.up[3];
                let (values, pixels) = (table.values, view.pixels_per_unit);
                let of_field = (field.level, field.border_strength);
                let constants = shade.constants(values, of_field, pixels, growth);
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

    /// The shader of a picture, and its overrides.
    fn program(
        &self,
        field: &DeviceField,
        table: &SlabTable,
        settings: &SplatSettings,
        (looks, among): (LooksVariant, Among),
    ) -> Program {
        let projects = looks.projects();
        let shader = match projects {
            true => shader::PROJECT_VALUES,
            false => shader::slabs(looks.shade.is_some(), among),
        };
        let is_natural = settings.kernel.stretch(settings.extent) == 1.0;
        let kernel = match settings.kernel {
            Kernel::Point | Kernel::Nearest => 0.0,
            Kernel::Linear if is_natural => 1.0,
            Kernel::Gaussian => 2.0,
            Kernel::Cubic | Kernel::Gouraud => 3.0,
            Kernel::BSpline if is_natural => 4.0,
            Kernel::BSpline => 5.0,
            Kernel::Linear => 6.0,
            Kernel::Functions => 7.0,
            Kernel::Cells => 8.0,
            Kernel::Ellipsoids => 9.0,
        };
        let format = match field.format {
            Format::Pairs => 0.0,
            Format::Halves => 1.0,
            Format::Floats => 2.0,
        };
        let mut constants = vec![
            ("kernel", kernel),
            ("window", field.pad as f64),
            ("format", format),
            ("one_chunk", flag(field.chunks.len() == 1)),
            ("has_holes", flag(field.holes.is_some())),
            ("has_depths", flag(field.border_strength.is_some())),
            ("holes_show", flag(table.holes_show)),
            ("has_widths", flag(field.has_widths)),
            ("multiquadric", flag(matches!(field.functions, Some((_, Basis::Multiquadric))))),
            ("classify_mean", flag(settings.classify == Classify::Mean)),
            ("classify_middle", flag(settings.classify.takes_one_value())),
            ("published", flag(settings.opacity_model == OpacityModel::Published)),
            ("back_to_front", flag(settings.order == Order::BackToFront)),
        ];
        if field.adds_left_out {
            constants.push(("adds_left_out", 1.0));
        }
        constants.extend(looks.inside.constants());
        if looks.inside.levels > 0 && field.may_jump {
            constants.push(("may_jump", 1.0));
        }
        if let Some(shade) = &looks.shade {
            constants.extend(shade.constants());
            let is_late = shade.of_borders && field.border_strength.is_some();
            constants.push(("lights_border", flag(is_late)));
            constants.push(match settings.kernel {
                Kernel::BSpline if is_natural => ("growth", 0.0),
                Kernel::Ellipsoids if shade.of_borders => ("growth", 6.0),
                Kernel::Functions | Kernel::Ellipsoids => ("growth", 3.0),
                Kernel::Cells if shade.of_borders => ("growth", 5.0),
                Kernel::Cells => ("growth", 4.0),
                Kernel::Nearest if shade.of_names => ("growth", 7.0),
                _ if shade.quickly => ("growth", 1.0),
                _ => ("growth", 2.0),
            });
        }
        if among.vectors && !projects {
            constants.extend(vector_constants());
        }
        Program { shader, constants }
    }

    /// Encodes a piece of `tiles` tiles.
    pub(super) fn encode(
        &self,
        (context, pipelines): (&Context, &mut Pipelines),
        encoder: &mut wgpu::CommandEncoder,
        settings: &SplatSettings,
        (light, totals): (&wgpu::TextureView, &wgpu::Buffer),
        (tiles, looks, beside): (u32, LooksVariant, Beside<'_>),
        clock: Option<&Timestamps>,
    ) {
        let (Some(field), Some(table)) = (&self.field, &self.table) else { return };
        let among =
            Among { polygons: beside.polygons.is_some(), vectors: beside.vectors.is_some() };
        let mut program = self.program(field, table, settings, (looks, among));
        if let Some(levels) = beside.levels {
            let are_floats = flag(levels.are_floats);
            program.constants.extend([("of_cut", 1.0), ("means_are_floats", are_floats)]);
        }
        let pipeline = pipelines.compute(context, &program);
        // Bindings beyond the last chunk repeat it; no index leads there.
        let last = field.chunks.len() - 1;
        let chunks = (0..FIELD_CHUNKS).map(|i| match beside.levels {
            Some(levels) if i == FIELD_CHUNKS - 1 => &levels.buffer,
            _ => &field.chunks[i.min(last)],
        });
        let mut entries = vec![buffer(0, &self.uniform), buffer(5, &table.empty)];
        entries.extend(buffers(1, chunks));
        entries.extend([buffer(6, &table.sums), picture_at(7, light), buffer(8, totals)]);
        entries.extend(self.shade.as_ref().map(|shade| buffer(9, shade)));
        if looks.projects() {
            // A mean leaps over nothing.
            let tops = self.tops.as_ref().map_or(&table.empty, |tops| &tops.words);
            entries.push(buffer(9, tops));
        }
        let marks = beside.vectors.map(|(vectors, _)| vectors.marks());
        if !looks.projects() {
            entries.extend(beside.polygons.map(|polygons| buffer(14, polygons.words())));
            if let (Some((vectors, lists)), Some(marks)) = (beside.vectors, &marks) {
                entries.extend(vectors.entries(lists, marks));
            }
        }
        let name = program.shader.name;
        dispatch(context, encoder, name, &pipeline, &entries, rows_of(tiles), clock);
    }
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
/// The same of cells and ellipsoids, between which values bend anywhere: of noise, the greatest values are off by 1.3e-1 with two.
const PROJECTED_FACES_OF_CELLS: f64 = 8.0;

/// Distance between the places at which a ray's values are asked, pixels of view depth.
fn face_pixels(
    view: &View,
    smallest_spacing: f64,
    settings: &SplatSettings,
    looks: Looks<'_>,
) -> f64 {
    let slab = slab_pixels(view, smallest_spacing, settings);
    match settings.kernel {
        _ if !looks.variant(false).projects() => slab,
        Kernel::Cells | Kernel::Ellipsoids => slab / PROJECTED_FACES_OF_CELLS,
        _ => slab / PROJECTED_FACES,
    }
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
    let half = view.size.map(|n| f64::from(n) / 2.0);
    // Far to near nothing is hidden before it is drawn.
    let stop = if settings.order == Order::FrontToBack { picture.stop_below } else { 0.0 };
    let width = slab_pixels(view, picture.smallest_spacing, settings);
    // Capped where a voxel is 1e20 unit distances thick: beyond, 32 bits would overflow.
    let per_pixel = (1.0 / (picture.unit_distance * view.pixels_per_unit)).min(1e20);
    layout::Slabs {
        base: narrow4(base, width),
        right: narrow4(index_from_view.x_axis, scale),
        up: narrow4(index_from_view.y_axis, growth),
        along: narrow4(index_from_view.z_axis, eye),
        picture: [half[0], half[1], per_pixel, stop].map(narrow),
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

//! Vector splats on the device: their records, marks and lists, and the slabs of them alone
//! (`count_vectors.wgsl`, `lib/vectors.wgsl`, `composite_vectors.wgsl`).
//!
//! Lists are made for some rows of tiles at a time. While neither the splats nor the view changes they
//! stay, so that an animated picture at rest costs its compositing alone.

mod frame;

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;

use self::frame::VectorFrame;
use super::GpuError;
use super::buffers::Growing;
use super::compute::{buffer, buffers, dispatch, rows_of, view as picture_at};
use super::context::Context;
use super::frame::Pass;
use super::layout::{self, TILE, VECTOR_VEC4S};
use super::list_plan::{MOST_LAYER_BITS, Plan, Rectangle};
use super::pipelines::{ListVariant, Program, flag, vector_constants};
use super::renderer::Renderer;
use super::scattered::{ListTotals, Lists, ListsOf};
use super::shader;
use super::timing::Timestamps;
use crate::core::Camera;
use crate::kernel::Kernel;
use crate::scene::{OpacityModel, Order, SplatSettings, View};
use crate::vector::{
    Design, Foreshortening, MARK_COLUMNS, MARK_SIDE, Marks, PHASES, Splat, Splats, VectorMode,
    VectorSettings,
};

/// The most entries that lists of some rows are made of.
const MOST_VECTOR_ENTRIES: u32 = 1 << 23;

/// Splats of one field, and how they look.
#[derive(Debug, Clone, Copy)]
pub struct VectorLook<'a> {
    /// The splats.
    pub splats: &'a Arc<Splats>,
    /// How they look; those that they were classified by.
    pub settings: &'a VectorSettings,
}

/// Vector splats to draw, and how.
#[derive(Debug, Clone, Copy)]
pub struct VectorSplats<'a> {
    /// Those of one field, or of two.
    pub looks: &'a [VectorLook<'a>],
    /// In cycles.
    pub phase: f64,
    /// Visibility's order and opacity model count.
    pub splat: &'a SplatSettings,
    /// Where they are seen from.
    pub camera: &'a Camera,
    /// World position of the middle of the lattice that slabs are counted from.
    pub centre: DVec3,
    /// Distance between slab faces, pixels of view depth ([`Renderer::slab_thickness`]).
    pub slab: f64,
    /// How many slabs of the field lie in each: 1, but where a quick picture may share them out.
    pub field_slabs: u32,
    /// Front to back, a pixel is done once less of what lies behind shows through.
    pub stop_below: f32,
}

/// What vectors keep on the device.
#[derive(Debug)]
pub(super) struct DeviceVectors {
    /// Of each field, in the order of their records.
    splats: Vec<Arc<Splats>>,
    /// Vec4s of a record.
    record_vec4s: u32,
    records: wgpu::Buffer,
    marks: wgpu::Texture,
    /// Of the tables of marks, one above the other.
    designs: Vec<Design>,
    /// Of them, as `shaders/lib/vector_frame.wgsl` has it.
    blur: [[f32; 16]; 10],
    settings: wgpu::Buffer,
    tiles: wgpu::Buffer,
    /// What lists there are were made of.
    made: Option<MadeOf>,
    /// What pixels are drawn with.
    constants: layout::Vectors,
    /// Overrides of the pass over them alone.
    overrides: [(&'static str, f64); 2],
}

/// Everything that lists depend on.
#[derive(Debug, Clone, PartialEq)]
struct MadeOf {
    view: View,
    looks: Vec<(VectorMode, Foreshortening)>,
    slab: f64,
    published: bool,
    order: Order,
    rows: Range<u32>,
}

impl DeviceVectors {
    fn new(context: &Context, looks: &[VectorLook<'_>]) -> Result<Self, GpuError> {
        use wgpu::BufferUsages as Usage;
        // Steps of their own have all splats, or none has.
        let has_own = looks.iter().any(|look| !look.splats.own_axes.is_empty());
        let vec4s = VECTOR_VEC4S[usize::from(has_own)];
        let count: usize = looks.iter().map(|look| look.splats.list.len()).sum();
        let bytes = 16 * u64::from(vec4s) * count as u64;
        let most = context.limits.max_storage_buffer_binding_size;
        if bytes > most {
            return Err(GpuError::TooLarge {
                what: "vectors that can show",
                limit: format!("{} splats", most / (16 * u64::from(vec4s))),
                found: count.to_string(),
                advice: "lower the opacity of short vectors to 0",
            });
        }
        let records = Growing::make(
            context,
            "vector records",
            Usage::STORAGE | Usage::COPY_DST,
            bytes.max(16),
        );
        let mut at = 0;
        for VectorLook { splats, .. } in looks {
            if has_own {
                let both = splats.list.iter().enumerate();
                let words: Vec<[f32; 28]> =
                    both.map(|(i, splat)| with_axes(splat, &splats.columns_of(i))).collect();
                context.queue.write_buffer(&records, at, bytemuck::cast_slice(&words));
            } else {
                context.queue.write_buffer(&records, at, bytemuck::cast_slice(&splats.list));
            }
            at += 16 * u64::from(vec4s) * splats.list.len() as u64;
        }
        let storage = |label, size: usize| {
            Growing::make(context, label, Usage::STORAGE | Usage::COPY_DST, size as u64)
        };
        let designs = designs_of(looks);
        let tables: Vec<Marks> = designs.iter().map(|design| Marks::new(*design)).collect();
        Ok(Self {
            splats: looks.iter().map(|look| Arc::clone(look.splats)).collect(),
            record_vec4s: vec4s,
            records,
            marks: marks_texture(context, &tables),
            blur: blur_of(&tables),
            designs,
            settings: storage("vectors", size_of::<layout::Vectors>()),
            tiles: storage("vector tiles", size_of::<layout::VectorTiles>()),
            made: None,
            constants: bytemuck::Zeroable::zeroed(),
            overrides: [("published", 0.0), ("back_to_front", 0.0)],
        })
    }

    pub(super) fn size_bytes(&self) -> u64 {
        let texels: u64 = (0..5).map(|level| 64_u64 >> level).map(|side| side * side).sum();
        let tables = self.designs.len() as u64;
        self.records.size() + tables * texels * 4 * (MARK_COLUMNS * PHASES) as u64
    }

    /// The records that lists are made of, and what their passes are told.
    pub(super) fn counted(&self) -> [&wgpu::Buffer; 2] {
        [&self.records, &self.settings]
    }

    /// The tables of marks, for [`DeviceVectors::entries`].
    pub(super) fn marks(&self) -> wgpu::TextureView {
        self.marks.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        })
    }

    /// What passes over them are bound to.
    pub(super) fn entries<'a>(
        &'a self,
        lists: &'a Lists,
        marks: &'a wgpu::TextureView,
    ) -> impl Iterator<Item = wgpu::BindGroupEntry<'a>> {
        let of_lists = buffers(16, lists.made());
        std::iter::once(buffer(15, &self.settings)).chain(of_lists).chain([picture_at(20, marks)])
    }
}

fn with_axes(splat: &Splat, axes: &[[f32; 4]; 3]) -> [f32; 28] {
    let mut words = [0.0; 28];
    words[..16].copy_from_slice(bytemuck::cast_slice(std::slice::from_ref(splat)));
    words[16..].copy_from_slice(axes.as_flattened());
    words
}

/// The tables of marks that fields need: one where their designs are the same.
fn designs_of(looks: &[VectorLook<'_>]) -> Vec<Design> {
    let mut designs: Vec<Design> = looks.iter().map(|look| look.settings.design).collect();
    designs.dedup();
    designs
}

/// Every phase of every column, each beside the next phase, and these beside those of the next column;
/// further tables are below the first.
fn marks_texture(context: &Context, tables: &[Marks]) -> wgpu::Texture {
    #[expect(clippy::cast_possible_truncation, reason = "a few hundred")]
    let [side, layers, levels, count] =
        [MARK_SIDE, MARK_COLUMNS * PHASES, tables[0].levels.len(), tables.len()].map(|n| n as u32);
    let texture = context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("marks"),
        size: wgpu::Extent3d { width: side, height: count * side, depth_or_array_layers: layers },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (table, marks) in (0_u32..).zip(tables) {
        for (mip, level) in (0_u32..).zip(&marks.levels) {
            #[expect(clippy::cast_possible_truncation, reason = "64 at most")]
            let side = level.side as u32;
            context.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &texture,
                    mip_level: mip,
                    origin: wgpu::Origin3d { x: 0, y: table * side, z: 0 },
                    aspect: wgpu::TextureAspect::All,
                },
                level.texels().as_flattened(),
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * side),
                    rows_per_image: Some(side),
                },
                wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers },
            );
        }
    }
    texture
}

/// What each size of each table has lost of its contrast.
#[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
fn blur_of(tables: &[Marks]) -> [[f32; 16]; 10] {
    let mut rows = [[0.0; 16]; 10];
    let (of_tables, _) = rows.as_chunks_mut::<5>();
    for (rows, marks) in of_tables.iter_mut().zip(tables) {
        for (row, level) in rows.iter_mut().zip(&marks.levels) {
            row.iter_mut().zip(level.blur).for_each(|(to, blur)| *to = blur as f32);
        }
    }
    rows
}

impl Renderer {
    /// Brings splats and their marks to the device, where they are not there yet.
    ///
    /// # Errors
    /// Too many of them, or an adapter that binds too few buffers.
    pub fn set_vectors(&mut self, looks: &[VectorLook<'_>]) -> Result<(), GpuError> {
        let offered = self.context.limits.max_storage_buffers_per_shader_stage;
        if offered < super::context::VECTOR_BUFFERS {
            return Err(GpuError::TooLarge {
                what: "buffers of vectors and a field in one pass",
                limit: format!("{offered} buffers"),
                found: super::context::VECTOR_BUFFERS.to_string(),
                advice: "choose another --adapter",
            });
        }
        let is_there = self.vectors.as_ref().is_some_and(|held| {
            let both = held.splats.iter().zip(looks);
            held.splats.len() == looks.len()
                && both.into_iter().all(|(held, look)| Arc::ptr_eq(held, look.splats))
                && held.designs == designs_of(looks)
        });
        if !is_there {
            self.vectors = None;
            self.vectors = Some(DeviceVectors::new(&self.context, looks)?);
            self.upload_count += 1;
            self.note_bytes();
        }
        self.context.check()
    }

    /// Lets go of vectors that are not drawn any more.
    pub fn clear_vectors(&mut self) {
        self.vectors = None;
    }

    /// Makes the lists of some rows of tiles, or as many of the first of them as fit; returns these.
    ///
    /// # Errors
    /// More layers or splats over a tile than can be told apart, or a failing device.
    pub fn make_vector_lists(
        &mut self,
        view: &View,
        what: &VectorSplats<'_>,
        mut rows: Range<u32>,
    ) -> Result<Range<u32>, GpuError> {
        let published = what.splat.opacity_model == OpacityModel::Published;
        let made_of = |rows: &Range<u32>| MadeOf {
            view: *view,
            looks: what
                .looks
                .iter()
                .map(|l| (l.settings.mode, l.settings.foreshortening))
                .collect(),
            slab: what.slab,
            published,
            order: what.splat.order,
            rows: rows.clone(),
        };
        let are_there = matches!(&self.lists, Some(lists) if lists.of == ListsOf::Vectors);
        if let Some(vectors) = self.vectors.as_mut() {
            match &vectors.made {
                // Those of the first rows, if they were not enough for all.
                Some(made)
                    if are_there
                        && made.rows.start == rows.start
                        && made.rows.end <= rows.end
                        && *made == made_of(&made.rows) =>
                {
                    let made = made.rows.clone();
                    self.write_vectors(what);
                    return Ok(made);
                }
                _ => vectors.made = None,
            }
        }
        let Some(vectors) = &self.vectors else { return Ok(rows) };
        let record_vec4s = vectors.record_vec4s;
        let total: usize = vectors.splats.iter().map(|splats| splats.list.len()).sum();
        let too_many = |most: u64, found: u64| GpuError::TooManyVectors { most, found };
        let Some(frame) = VectorFrame::new(view, what) else { return Ok(rows) };
        let layers = frame
            .layers(what.slab)
            .ok_or_else(|| too_many(1 << MOST_LAYER_BITS, frame.layer_count(what.slab)))?;
        #[expect(clippy::cast_possible_truncation, reason = "bound by what one buffer holds")]
        let count = total as u32;
        let front_to_back = what.splat.order == Order::FrontToBack;
        let lists = self.lists.get_or_insert_with(|| Lists::new(&self.context));
        lists.reserve(&self.context, u64::from(count))?;
        lists.of = ListsOf::Vectors;
        lists.variant = ListVariant {
            kernel: Kernel::Cubic,
            perspective: view.eye_distance.is_some(),
            slabs: true,
            front_to_back,
            published,
        };
        let constants = frame.constants();
        self.context.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&constants));
        let columns = view.size[0].div_ceil(TILE);
        let vectors = self.vectors.as_mut().ok_or(GpuError::Cancelled)?;
        vectors.overrides =
            [("published", flag(published)), ("back_to_front", flag(!front_to_back))];
        vectors.constants = frame.vectors(view, what, record_vec4s, layers, columns);
        vectors.constants.blur = vectors.blur;
        self.write_vectors(what);
        loop {
            let plan = Plan {
                rectangle: Rectangle([0, rows.start, columns, rows.end - rows.start]),
                layers,
                count,
                stop_below: what.stop_below,
                half_size: view.size.map(|n| n as f32 / 2.0),
            };
            let room = (u32::MAX, MOST_VECTOR_ENTRIES);
            if self.make_lists(&plan, room, &mut ListTotals::default())?.is_none() {
                if rows.len() < 2 {
                    let found = u64::from(count) * u64::from(layers.count);
                    return Err(too_many(u64::from(MOST_VECTOR_ENTRIES), found));
                }
                rows.end = rows.start + (rows.end - rows.start).div_ceil(2);
                continue;
            }
            let vectors = self.vectors.as_mut().ok_or(GpuError::Cancelled)?;
            vectors.constants.layers[2] = rows.start.cast_signed();
            vectors.made = Some(made_of(&rows));
            self.write_vectors(what);
            return Ok(rows);
        }
    }

    /// What changes with the phase alone, and which rows the lists are for.
    fn write_vectors(&mut self, what: &VectorSplats<'_>) {
        let Some(vectors) = self.vectors.as_mut() else { return };
        #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
        let phase = what.phase.rem_euclid(1.0) as f32;
        vectors.constants.depth[3] = phase;
        self.context.queue.write_buffer(
            &vectors.settings,
            0,
            bytemuck::bytes_of(&vectors.constants),
        );
    }

    /// Draws tiles of vectors alone, whose lists were made, and waits; returns milliseconds.
    ///
    /// # Errors
    /// A failing device.
    pub fn draw_vector_tiles(&mut self, view: &View, tiles: Range<u32>) -> Result<f64, GpuError> {
        let Some(vectors) = &self.vectors else { return Ok(0.0) };
        #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
        let growth = view.eye_distance.map_or(0.0, |distance| 1.0 / distance) as f32;
        let [width, height] = view.size;
        let constants = layout::VectorTiles {
            tiles: [tiles.start, width.div_ceil(TILE), width, height],
            more: [tiles.len() as u32, 0, 0, 0],
            rays: [growth, 0.0, 0.0, 0.0],
        };
        self.context.queue.write_buffer(&vectors.tiles, 0, bytemuck::bytes_of(&constants));
        let wall_ms = self.run(&[Pass::CompositeVectors { tiles: tiles.len() as u32 }])?;
        self.check_loops()?;
        Ok(wall_ms)
    }

    pub(super) fn composite_vectors(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        tiles: u32,
        clock: Option<&Timestamps>,
    ) {
        let (Some(vectors), Some(lists), Some(target)) = (&self.vectors, &self.lists, &self.target)
        else {
            return;
        };
        let light = target.light.create_view(&Default::default());
        let shader = shader::vectors(self.polygons.is_some());
        let constants = vectors.overrides.into_iter().chain(vector_constants()).collect();
        let pipeline = self.pipelines.compute(&self.context, &Program { shader, constants });
        let marks = vectors.marks();
        let mut entries =
            vec![buffer(0, &vectors.tiles), picture_at(1, &light), buffer(8, &self.totals)];
        entries.extend(self.polygons.as_ref().map(|polygons| buffer(14, polygons.words())));
        entries.extend(vectors.entries(lists, &marks));
        dispatch(&self.context, encoder, shader.name, &pipeline, &entries, rows_of(tiles), clock);
    }
}

//! Vector splats on the device: their records, marks and lists, and the slabs of them alone
//! (`count_vectors.wgsl`, `lib/vectors.wgsl`, `composite_vectors.wgsl`).
//!
//! Lists are made for some rows of tiles at a time. While neither the splats nor the view changes they
//! stay, so that an animated picture at rest costs its compositing alone.

pub(super) mod frame;

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;

use super::GpuError;
use super::buffers::Growing;
use super::compute::{buffer, buffers, view as picture_at};
use super::context::Context;
use super::layout::{self, VECTOR_VEC4S};
use super::scattered::Lists;
use crate::core::Camera;
use crate::scene::{Order, SplatSettings, View};
use crate::vector::{
    Design, Foreshortening, MARK_COLUMNS, MARK_SIDE, Marks, PHASES, Splat, Splats, VectorMode,
    VectorSettings,
};

/// The most entries that lists of some rows are made of.
pub(super) const MOST_VECTOR_ENTRIES: u32 = 1 << 23;

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
    /// Distance between slab faces, pixels of view depth (`Renderer::slab_thickness`).
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
    pub(super) splats: Vec<Arc<Splats>>,
    /// Vec4s of a record.
    pub(super) record_vec4s: u32,
    pub(super) records: wgpu::Buffer,
    pub(super) marks: wgpu::Texture,
    /// Of the tables of marks, one above the other.
    pub(super) designs: Vec<Design>,
    /// Of them, as `shaders/lib/vector_frame.wgsl` has it.
    pub(super) blur: [[f32; 16]; 10],
    pub(super) settings: wgpu::Buffer,
    /// What lists there are were made of.
    pub(super) made: Option<MadeOf>,
    /// What pixels are drawn with.
    pub(super) constants: layout::Vectors,
}

/// Everything that lists depend on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MadeOf {
    pub(super) view: View,
    pub(super) looks: Vec<(VectorMode, Foreshortening)>,
    pub(super) slab: f64,
    pub(super) published: bool,
    pub(super) order: Order,
    pub(super) rows: Range<u32>,
}

impl DeviceVectors {
    pub(super) fn new(context: &Context, looks: &[VectorLook<'_>]) -> Result<Self, GpuError> {
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
        let tables: Vec<Arc<Marks>> = designs.iter().map(|design| Marks::new(*design)).collect();
        Ok(Self {
            splats: looks.iter().map(|look| Arc::clone(look.splats)).collect(),
            record_vec4s: vec4s,
            records,
            marks: marks_texture(context, &tables),
            blur: blur_of(&tables),
            designs,
            settings: storage("vectors", size_of::<layout::Vectors>()),
            made: None,
            constants: bytemuck::Zeroable::zeroed(),
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
pub(super) fn designs_of(looks: &[VectorLook<'_>]) -> Vec<Design> {
    let mut designs: Vec<Design> = looks.iter().map(|look| look.settings.design).collect();
    designs.dedup();
    designs
}

/// Every phase of every column, each beside the next phase, and these beside those of the next column;
/// further tables are below the first.
fn marks_texture(context: &Context, tables: &[Arc<Marks>]) -> wgpu::Texture {
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
fn blur_of(tables: &[Arc<Marks>]) -> [[f32; 16]; 10] {
    let mut rows = [[0.0; 16]; 10];
    let (of_tables, _) = rows.as_chunks_mut::<5>();
    for (rows, marks) in of_tables.iter_mut().zip(tables) {
        for (row, level) in rows.iter_mut().zip(&marks.levels) {
            row.iter_mut().zip(level.blur).for_each(|(to, blur)| *to = blur as f32);
        }
    }
    rows
}

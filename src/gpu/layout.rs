//! What crosses from host to shader, byte for byte.
//!
//! `tests/layout.rs` parses every shader and holds these structs to the WGSL ones of the same
//! name (size, and the offset of every member), and the constants to theirs.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// Words (`u32`) of one record; see `shaders/emit_kernels.wgsl`.
pub const RECORD_WORDS: usize = 7;
/// Words before the first segment's count: the draw's arguments, and room to 32 bytes.
pub const COUNT_HEADER_WORDS: usize = 8;
/// Threads in a workgroup of the counting and emitting passes.
pub const SEGMENT_THREADS: u32 = 64;
/// Slabs in a layer of the lists.
pub const LAYER_SLABS: u32 = 4;
/// Threads in a workgroup of the passes that make the lists.
pub const LIST_THREADS: u32 = 64;
/// Tiles of a workgroup that composites lists.
pub const GROUP_TILES: u32 = 4;
/// Threads of a tile there.
pub const LIST_TILE_THREADS: u32 = 16;
/// Threads in a workgroup of the sort.
pub const SORT_THREADS: u32 = 64;
/// Bits of a digit of the sort, and what a digit can be.
pub const DIGIT_BITS: u32 = 4;
/// See [`DIGIT_BITS`].
pub const DIGITS: u32 = 1 << DIGIT_BITS;
/// Kernels thinner than this half axis, in pixels, are widened to it.
pub const LEAST_HALF_AXIS: f64 = 1.0;
/// What lies this close before a pixel's left or upper edge, in pixels, is a point of that pixel.
pub const POINT_TIE: f64 = 1.0 / 1024.0;
/// Stands for NaN among 32-bit samples; the shaders' own `NO_DATA` lies between it and the data.
pub const NO_DATA: f32 = -3.402e38;
/// Finite 32-bit samples and infinities stay within ± this.
pub const MOST_SAMPLE: f32 = 3.3e38;

/// Numbers stay within ± this: their products with samples are finite, too.
const MOST_NUMBER: f64 = 1e30;

/// A number as the device takes it: in 32 bits, and finite, as shaders may take all numbers to be. What lies beyond
/// ±1e30 becomes that, and NaN becomes 0.
#[expect(clippy::cast_possible_truncation, reason = "this is where 64 bits become 32")]
pub fn narrow(number: f64) -> f32 {
    if number.is_nan() { 0.0 } else { number.clamp(-MOST_NUMBER, MOST_NUMBER) as f32 }
}

/// The same of a vector, and a fourth number after it.
pub fn narrow4(v: DVec3, w: f64) -> [f32; 4] {
    [v.x, v.y, v.z, w].map(narrow)
}

/// `Frame` in `shaders/lib/frame.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Frame {
    pub view_x: [f32; 4],
    pub view_y: [f32; 4],
    pub view_z: [f32; 4],
    pub view_centre: [f32; 4],
    pub lattice_centre: [f32; 4],
    pub footprint: [f32; 4],
    pub half_size: [f32; 2],
    pub radius: f32,
    pub extinction_scale: f32,
    pub footprint_scale: f32,
    pub padding0: f32,
    pub padding1: f32,
    pub padding2: f32,
}

/// `Traversal` in `shaders/lib/traversal.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Traversal {
    pub dims: [u32; 4],
    pub bricks: [u32; 4],
    pub axes: [u32; 4],
    pub splits: [u32; 4],
    pub counts: [u32; 4],
    pub table: [f32; 4],
}

/// Pixels along a side of a tile of the gathering passes.
pub const TILE: u32 = 8;
/// The most layers that a gathering pass works on at a time; see `shaders/gather_kernels.wgsl`.
pub const LAYERS: u32 = 16;
/// Faces between two looks at whether anything can show; see `shaders/reconstruct_slabs.wgsl`.
pub const LOOK_EVERY: u32 = 8;
/// Part of a cell of the table by which values are lifted, so that rounding does not take a whole
/// number out of the cell that begins with it.
pub const LIFT_CELLS: f64 = 0.0625;

/// `Gather` in `shaders/lib/gather.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Gather {
    pub base: [f32; 4],
    pub right: [f32; 4],
    pub up: [f32; 4],
    pub ahead: [f32; 4],
    pub reach: [f32; 4],
    pub scale: [f32; 4],
    pub layers: [f32; 4],
    pub centre: [f32; 4],
    pub view_a: [f32; 4],
    pub view_b: [f32; 4],
    pub view_c: [f32; 4],
    pub view_centre: [f32; 4],
    pub low: [i32; 4],
    pub high: [i32; 4],
    pub splits: [i32; 4],
    pub strides: [u32; 4],
    pub bricks: [u32; 4],
    pub piece: [u32; 4],
}

/// Vec4s of a vector splat's record, and of one with its own steps of the grid.
pub const VECTOR_VEC4S: [u32; 2] = [4, 7];

/// `Vectors` in `shaders/lib/vector_frame.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Vectors {
    pub axis_x: [f32; 4],
    pub axis_y: [f32; 4],
    pub axis_z: [f32; 4],
    pub depth: [f32; 4],
    pub picture: [f32; 4],
    pub flags: [u32; 4],
    pub layers: [i32; 4],
    pub second_x: [f32; 4],
    pub second_y: [f32; 4],
    pub second_z: [f32; 4],
    pub second_origin: [f32; 4],
    pub second_flags: [u32; 4],
    pub field_slabs: [i32; 4],
    pub blur: [[f32; 16]; 10],
}

/// `VectorTiles` in `shaders/composite_vectors.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct VectorTiles {
    pub tiles: [u32; 4],
    pub more: [u32; 4],
    pub rays: [f32; 4],
    pub clip: [[f32; 4]; MOST_CLIPS],
}

/// `Polygons` in `shaders/lib/polygon_corners.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Polygons {
    pub right: [f32; 4],
    pub up: [f32; 4],
    pub forward: [f32; 4],
    pub picture: [f32; 4],
    pub material: [f32; 4],
    pub towards: [[f32; 4]; MOST_LIGHTS],
    pub colours: [[f32; 4]; MOST_LIGHTS],
    pub counts: [u32; 4],
}

/// `Corner` in `shaders/lib/polygon_corners.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct PolygonCorner {
    pub place: [f32; 4],
    pub normal: [f32; 4],
}

/// Words of a polygon in a pixel; see `shaders/lib/polygon_corners.wgsl`.
pub const FRAGMENT_WORDS: u32 = 6;
/// Threads in a workgroup of the passes over pixels' polygons.
pub const POLYGON_THREADS: u32 = 64;

/// Counts that a workgroup sums up: `BLOCK` in `shaders/lib/blocks.wgsl`.
pub const SCAN_BLOCK: u32 = 2048;

/// `Scan` in `shaders/lib/blocks.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Scan {
    pub counts: [u32; 4],
}

/// `Lists` in `shaders/lib/lists.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Lists {
    pub tiles: [u32; 4],
    pub counts: [u32; 4],
    pub layers: [i32; 4],
    pub slabs: [f32; 4],
}

/// `Sort` in `shaders/lib/sort.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Sort {
    pub counts: [u32; 4],
}

/// `BrickPiece` in `shaders/merge_bricks.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct BrickPiece {
    pub first: [u32; 4],
    pub bricks: [u32; 4],
    pub nodes: [u32; 4],
    pub scale: [f32; 4],
}

/// `Brick` in `shaders/merge_bricks.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Brick {
    pub appearance: [f32; 4],
    pub emission: [f32; 4],
    pub count: f32,
    pub weight: f32,
    pub m2: f32,
    pub effective: f32,
    pub error: f32,
    pub showing: u32,
    pub slices: [u32; 6],
}

/// `Present` in `shaders/present.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Present {
    pub background: [f32; 4],
}

/// `Slabs` in `shaders/lib/slabs.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Slabs {
    pub base: [f32; 4],
    pub right: [f32; 4],
    pub up: [f32; 4],
    pub along: [f32; 4],
    pub picture: [f32; 4],
    pub dims: [u32; 4],
    pub end: [f32; 4],
    pub stored: [u32; 4],
    pub bricks: [u32; 4],
    pub table: [f32; 4],
    pub below: [f32; 4],
    pub beyond: [f32; 4],
    pub tiles: [u32; 4],
    pub more: [u32; 4],
    pub tops: [f32; 4],
    pub clip: [[f32; 4]; MOST_CLIPS],
    pub slices: [[f32; 4]; crate::scene::MOST_SLICES],
    pub levels: [[f32; 4]; crate::scene::MOST_ISOSURFACES],
    pub opacities: [[f32; 4]; 6],
}

/// Words before the bricks of a cut (`shaders/lib/cut.wgsl`).
pub const CUT_HEAD: u32 = 16;

/// Planes that cut a volume, and the shader has room for: of a box, and free ones.
pub const MOST_CLIPS: usize = 6 + crate::scene::MOST_CLIP_PLANES;

const _: () = assert!(crate::scene::MOST_SLICES == 6 && crate::scene::MOST_ISOSURFACES == 6);

/// Entries of each shading table: a cell more than `SHADE_CELLS`.
pub const SHADE_ENTRIES: usize = 256;
/// Cells of a shading table.
pub const SHADE_CELLS: u32 = SHADE_ENTRIES as u32 - 1;
/// Lights that the shader has room for.
pub const MOST_LIGHTS: usize = crate::scene::MOST_LIGHTS;

/// Regions that the shader has room for.
pub const MOST_REGIONS: usize = crate::transfer::MOST_REGIONS;

/// `Shade` in `shaders/lib/shade.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader")]
pub struct Shade {
    pub world_x: [f32; 4],
    pub world_y: [f32; 4],
    pub world_z: [f32; 4],
    pub right: [f32; 4],
    pub up: [f32; 4],
    pub forward: [f32; 4],
    pub material: [f32; 4],
    pub towards: [[f32; 4]; MOST_LIGHTS],
    pub colours: [[f32; 4]; MOST_LIGHTS],
    pub places: [[f32; 4]; 4],
    pub tables: [[f32; 4]; 4 * SHADE_ENTRIES],
    pub region_places: [[f32; 4]; MOST_REGIONS],
    pub region_looks: [[f32; 4]; MOST_REGIONS],
    pub region_shapes: [[f32; 4]; MOST_REGIONS],
}

/// One splat as the vertex stage reads it; emitted by the GPU for voxels, by the host for nodes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Record {
    /// Middle of the kernel's box in index space.
    pub centre: [f32; 3],
    /// Extinction per unit distance.
    pub extinction: f32,
    /// Voxels along x, y, z and linear red, green, blue as fractions of 65535, 16 bits each.
    pub packed: [u32; 3],
}

const _: () = assert!(size_of::<Record>() == RECORD_WORDS * 4);

/// A corner of a splat's mesh as the vertex stage reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Corner {
    /// Offset on the kernel's unit disc, in radii.
    pub position: [f32; 2],
    /// F there at the kernel's natural extent, voxels.
    pub factor: f32,
}

impl Record {
    /// A record from a box of voxels. Boxes over 65535 voxels along an axis do not exist: the
    /// octree ends at level 15 (`Renderer` refuses larger volumes).
    pub fn new(low: [u32; 3], size: [u32; 3], extinction: f32, colour: [u16; 3]) -> Self {
        let [sx, sy, sz] = size.map(|s| s.min(0xffff));
        let [r, g, b] = colour.map(u32::from);
        Self {
            centre: std::array::from_fn(|a| low[a] as f32 + (size[a] as f32 - 1.0) / 2.0),
            extinction,
            packed: [sx | sy << 16, sz | r << 16, g | b << 16],
        }
    }
}

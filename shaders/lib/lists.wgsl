// Lists of scattered kernels: for each tile of the picture the kernels that touch it, in layers.
//
// A layer is a group of neighbouring slabs; there is but one where every kernel is composited on its
// own. An entry's key is its tile and then its layer, in the order of compositing; its word is the
// place of its kernel among the projected ones, which have that order too.

// Pixels along a tile's side.
const TILE: u32 = 8u;
// Slabs in a layer.
const LAYER_SLABS: u32 = 4u;
// Threads in a workgroup of the passes that make the lists.
const LIST_THREADS: u32 = 64u;

struct Lists {
    // First column and row of tiles, columns, rows: what part of the picture the lists are for.
    tiles: vec4<u32>,
    // Kernels; entries that fit; bits of a key's layer; entries.
    counts: vec4<u32>,
    // First layer from the front, layers; first row and rows of tiles to composite.
    layers: vec4<i32>,
    // Thickness of a slab in pixels of view depth; the transmittance below which nothing behind can
    // show; 0; 0.
    slabs: vec4<f32>,
    // A radial kernel's `gpu::share::SharePolynomial`: six rows of the powers 0 to 3, and what stands
    // by the fourth in the last two.
    shares: array<vec4<f32>, 8>,
}

// Kernels give their integrals to slabs, rather than being composited on their own.
override slabs: bool = false;
override front_to_back: bool = false;
// Opacity times footprint, with sums capped at 1, rather than optical depth.
override published: bool = false;
// 0: a radial kernel, 1: a box, 2: a point.
override shape: u32 = 0u;

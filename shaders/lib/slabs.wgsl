// What slabs of a reconstructed field are given: constants, coefficients, tables.

// Stands for "no value here".
const NOTHING: f32 = -3e38;

override has_holes: bool = false;
// These are samples outside of cells, of which it is known how deep each lies in them.
override has_depths: bool = false;
// Samples without data have a colour and an opacity of their own.
override holes_show: bool = false;
// Coefficients are means, each stored beside half the width of the values about it.
override has_widths: bool = false;
// Classify the value in the middle of a slab rather than all between its faces.
override classify_middle: bool = false;
// Of that, the mean of its values.
override classify_mean: bool = false;
// Opacity is weight times length, capped, rather than 1 - exp(-depth).
override published: bool = false;
override back_to_front: bool = false;

struct Slabs {
    // Where the ray through the picture's middle meets the plane through the lattice's centre, in
    // index space; w: distance between slab faces, pixels of view depth.
    base: vec4<f32>,
    // Index step of one pixel to the right; w: its scale at that plane.
    right: vec4<f32>,
    // Index step of one pixel up; w: its growth per pixel of depth, 0 when orthographic.
    up: vec4<f32>,
    // Index step of one pixel of view depth; w: depth of the eye, very small when orthographic.
    along: vec4<f32>,
    // Half the picture's width and height; unit distances a pixel; transmittance to stop at.
    picture: vec4<f32>,
    // Samples along x, y, z; w: mirrored samples beyond each border.
    dims: vec4<u32>,
    // Where the lattice ends along x, y, z, in index space: means at its borders may stand for less; w: no
    // cell of the table beyond shows.
    end: vec4<f32>,
    // Stored samples along x and y; words in a chunk; radius of the window, samples.
    stored: vec4<u32>,
    // Bricks along x, y, z; cells of the table.
    bricks: vec4<u32>,
    // Cell of a stored value s: x + y * s. z: what distances are divided by before the kernel. w: no cell
    // before it shows.
    table: vec4<f32>,
    // Colour and weight below the first cell and beyond the last.
    below: vec4<f32>,
    beyond: vec4<f32>,
    // First tile, tiles across, picture width, picture height.
    tiles: vec4<u32>,
    // Tiles in this piece; rays along the side of a pixel; word of `empty` at which the bits of
    // samples without data begin. Last, 0 or the word at which the bits of pixels begin that have
    // more rays, and above bit 28 how many along a side.
    more: vec4<u32>,
    // Of values of which the greatest is sought, turned about for the least: as cells, what byte 0 of `tops` stands
    // for, and what one more is.
    tops: vec4<f32>,
    // What lets the inside be seen, in the index space of the field that is drawn. Of what cuts, xyz: a normal
    // of length 1; kept is what has a greater product with it than w.
    clip: array<vec4<f32>, 12>,
    // xyz: a normal of length 1; on the slice is what has the product w with it.
    slices: array<vec4<f32>, 6>,
    // Of isosurfaces: linear colour, and the value in cells of the slab table.
    levels: array<vec4<f32>, 6>,
    // Of isosurfaces in x, of slices in y.
    opacities: array<vec4<f32>, 6>,
}

// Storage rather than uniform: lavapipe compiles a shader anew, and keeps it, for every value of a
// uniform that decides a branch.
@group(0) @binding(0) var<storage, read> slabs: Slabs;
// Coefficients, with the mirrored samples beyond the borders, in up to four chunks.
@group(0) @binding(1) var<storage, read> field0: array<u32>;
@group(0) @binding(2) var<storage, read> field1: array<u32>;
@group(0) @binding(3) var<storage, read> field2: array<u32>;
@group(0) @binding(4) var<storage, read> field3: array<u32>;
// Four bytes a word: for each brick the distance, in bricks, to the nearest that can show. Then,
// where samples are without data, a bit for each sample, or of samples of cells a byte, how deep it lies in them.
@group(0) @binding(5) var<storage, read> empty: array<u32>;
// Each cell: mean red and green, blue, 16-bit fractions of 1; then 32-bit floats: the weight's growth
// across it, and its mean. After all cells, in 32-bit floats, weight times colour, and weight,
// integrated up to where each cell begins, and to the end. Where they show, the colour and weight of
// samples without data come last.
@group(0) @binding(6) var<storage, read> table: array<vec4<u32>>;
@group(0) @binding(7) var picture: texture_storage_2d<rgba32float, write>;

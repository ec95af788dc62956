// What the passes over vector splats are told of a picture.

struct Vectors {
    // Steps of the grid in units, along its first, second and third axis. w: length along the flow over
    // width; factor of the extent; texels along the side of the finest marks.
    axis_x: vec4<f32>,
    axis_y: vec4<f32>,
    axis_z: vec4<f32>,
    // View depth of the origin beyond the lattice's centre, pixels; thickness of a slab in pixels of view
    // depth; the transmittance below which nothing behind can show; the phase, in cycles.
    depth: vec4<f32>,
    // Half the picture's width and height; how much wider the window of the marks is than the splat's
    // ellipse; 1 over the footprint of a line through the middle.
    picture: vec4<f32>,
    // Vec4s of a record; see BLEND; see POLYGON and COORDINATES; bits of a key's layer.
    flags: vec4<u32>,
    // First layer from the front, layers; first row of tiles, tiles across.
    layers: vec4<i32>,
    // Of the splats of a second field, which come after those of the first, in units of that. Axes as
    // above, with the factor of the extent so that what is drawn has the first field's radius. w: length
    // along the flow over width; factor of the extent; `picture.z`.
    second_x: vec4<f32>,
    second_y: vec4<f32>,
    second_z: vec4<f32>,
    // Its origin from the first field's; its own unit.
    second_origin: vec4<f32>,
    // Its first splat; see BLEND; see POLYGON and COORDINATES; which table of marks is its.
    second_flags: vec4<u32>,
    // Slabs of the field in each of theirs.
    field_slabs: vec4<i32>,
    // Of each table of marks: what each size has lost of their contrast, by foreshortening.
    blur: array<f32, 160>,
}

// Of `blur`: numbers of a table, and of a size.
const BLURS: u32 = 80u;
const BLUR_COLUMNS: u32 = 16u;

// Whether a splat is of the second field.
fn is_second(splat: u32) -> bool {
    return splat >= vectors.second_flags.x;
}

// `flags.y`: 0 is MODULATE.
const BLEND: u32 = 1u;
// `flags.z`: 0 is the table.
const POLYGON: u32 = 1u;
const COORDINATES: u32 = 2u;
// Splats are not shortened, nor coordinates stretched, beyond this.
const LEAST_ACROSS: f32 = 0.1;
// Texels along the side of a picture of the table at its finest, and the sizes after it.
const MARK_SIDE: u32 = 64u;
const LAST_MARK_LEVEL: f32 = 4.0;

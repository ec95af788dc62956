// What lets a volume's inside be seen, all in the index space of the field that is drawn.

// A group of its own, since the other one ends with what a scene is lit by, or before. A uniform, as
// storage buffers are few: no branch is decided by it alone.
@group(1) @binding(0) var<uniform> inside: Inside;

struct Inside {
    // xyz: a normal of length 1; kept is what has a greater product with it than w.
    clip: array<vec4<f32>, 12>,
    // xyz: a normal of length 1; on the plane is what has the product w with it.
    slices: array<vec4<f32>, 6>,
    // Of isosurfaces: linear colour, and the value in cells of the slab table.
    levels: array<vec4<f32>, 6>,
    // Of isosurfaces in x, of slices in y.
    opacities: array<vec4<f32>, 6>,
}

// Where a kernel lands on the picture: its footprint's ellipse and its depth.
//
// design: a kernel of map M at a point seen through J has A = J M. With the rows a1, a2 of A for
// screen x and y, unit kernel offsets u land at K u, K the Cholesky factor of the rows' Gram
// matrix, and the kernel's depth axis is 1 / sqrt(C) = |det A| / |a1 x a2|.

@group(0) @binding(0) var<uniform> frame: Frame;

override perspective: bool = false;

// Kernels nearer to the eye than this part of its distance to the focal plane are not drawn.
const NEAR: f32 = 1e-3;
// Kernels thinner than a pixel are widened to this half axis, in pixels, and keep their depth.
const LEAST_HALF_AXIS: f32 = 1.0;
// A point belongs to one pixel, which owns its left and its upper edge and what lies this close before
// them, in pixels: rounding decides nothing where voxels lie on the edges.
const POINT_TIE: f32 = 0.0009765625;

// Eye to pixel over eye to plane: 1 / cos of the ray's angle to the view axis.
fn slant(pixel: vec2<f32>) -> f32 {
    if !perspective {
        return 1.0;
    }
    let tangent = (pixel - frame.half_size) / frame.view_centre.w;
    return sqrt(1.0 + dot(tangent, tangent));
}

// The middle of the pixel that holds a point, as the point: an offset from the picture's middle.
fn pixel_of_point(point: vec2<f32>) -> vec2<f32> {
    let down = vec2<f32>(point.x, -point.y) + frame.half_size;
    let pixel = floor(down + POINT_TIE) + 0.5;
    return vec2<f32>(pixel.x - frame.half_size.x, frame.half_size.y - pixel.y);
}

struct Projected {
    // Screen offset of the centre from the picture's middle, pixels, y up.
    middle: vec2<f32>,
    // View depth of the centre beyond the lattice's, pixels.
    depth: f32,
    // Rows of A: how screen x, screen y and depth change along the kernel's own axes.
    row_x: vec3<f32>,
    row_y: vec3<f32>,
    row_z: vec3<f32>,
    determinant: f32,
    // At or behind the eye.
    hidden: bool,
}

// The kernel of a box of voxels about `centre` (index space), which a record packs behind its sides.
fn project(centre: vec3<f32>, packed: vec3<u32>) -> Projected {
    let size = vec3<f32>(f32(packed.x & 0xffffu), f32(packed.x >> 16u), f32(packed.y & 0xffffu));
    let from_centre = centre - frame.lattice_centre.xyz;
    let from_middle = frame.view_x.xyz * from_centre.x
        + frame.view_y.xyz * from_centre.y
        + frame.view_z.xyz * from_centre.z;
    let view = frame.view_centre.xyz + from_middle;
    var out: Projected;
    out.middle = view.xy;
    out.depth = from_middle.z;
    out.row_x = vec3<f32>(frame.view_x.x, frame.view_y.x, frame.view_z.x) * size;
    out.row_y = vec3<f32>(frame.view_x.y, frame.view_y.y, frame.view_z.y) * size;
    out.row_z = vec3<f32>(frame.view_x.z, frame.view_y.z, frame.view_z.z) * size;
    out.determinant = frame.lattice_centre.w * size.x * size.y * size.z;
    if perspective {
        let eye = frame.view_centre.w;
        out.hidden = view.z <= eye * NEAR;
        let depth = max(view.z, eye * NEAR);
        let shrink = eye / depth;
        out.middle = view.xy * shrink;
        out.row_x = (out.row_x - out.row_z * (view.x / depth)) * shrink;
        out.row_y = (out.row_y - out.row_z * (view.y / depth)) * shrink;
        out.determinant *= shrink * shrink;
    }
    return out;
}

// Widens an ellipse (k11, k21, k22, depth axis) whose half axes, at the kernel's radius, are under
// a pixel; the amplitude falls so that the depth summed over the picture stays.
fn widened(factor: vec4<f32>) -> vec4<f32> {
    let least = LEAST_HALF_AXIS / frame.radius;
    let k = factor.xyz;
    // Gram matrix and its eigenvalues.
    let a = k.x * k.x;
    let b = k.x * k.y;
    let d = k.y * k.y + k.z * k.z;
    let half_trace = 0.5 * (a + d);
    let spread = sqrt(max(0.25 * (a - d) * (a - d) + b * b, 0.0));
    let determinant = k.x * k.z;
    let large = half_trace + spread;
    let small = determinant * determinant / large;
    let floor2 = least * least;
    if small >= floor2 {
        return factor;
    }
    let new_small = floor2;
    let new_large = max(large, floor2);
    // Same axes, new lengths: G' = m + n (G - half_trace) with m, n from the new eigenvalues.
    let m = 0.5 * (new_large + new_small);
    let n = select(0.0, 0.5 * (new_large - new_small) / spread, spread > 0.0);
    let ga = m + n * (a - half_trace);
    let gb = n * b;
    let k11 = sqrt(max(ga, 0.0));
    let k22 = sqrt(new_large * new_small) / k11;
    return vec4<f32>(k11, gb / k11, k22, factor.w * determinant / sqrt(new_large * new_small));
}

// Lower triangle k11, k21, k22 of the map from unit kernel offsets to pixels, and the depth of the
// kernel axis: Cholesky's factor of A's first two rows.
fn ellipse(kernel: Projected) -> vec4<f32> {
    let k11 = length(kernel.row_x);
    let across = length(cross(kernel.row_x, kernel.row_y));
    return vec4<f32>(
        k11,
        dot(kernel.row_x, kernel.row_y) / k11,
        across / k11,
        kernel.determinant / across,
    );
}

// Linear colour behind a record's packed sides.
fn colour_of(packed: vec3<u32>) -> vec3<f32> {
    return vec3<f32>(unpack2x16unorm(packed.y).y, unpack2x16unorm(packed.z));
}

// Optical depth of an extinction over a depth in pixels.
fn optical_depth(extinction: f32, depth: f32) -> f32 {
    return min(extinction * frame.extinction_scale * depth, MOST_DEPTH);
}

// Where the ray enters and leaves the unit box, in pixels of depth; nowhere as (0, 0).
fn chord(point: vec3<f32>, ray: vec3<f32>) -> vec2<f32> {
    var enter = -1e30;
    var leave = 1e30;
    for (var axis = 0u; axis < 3u; axis++) {
        if abs(ray[axis]) < 1e-12 {
            if abs(point[axis]) > 0.5 {
                return vec2<f32>(0.0);
            }
        } else {
            let a = (-0.5 - point[axis]) / ray[axis];
            let b = (0.5 - point[axis]) / ray[axis];
            enter = max(enter, min(a, b));
            leave = min(leave, max(a, b));
        }
    }
    return vec2<f32>(enter, max(leave, enter));
}

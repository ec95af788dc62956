// Draws records as footprints, back to front, over a premultiplied linear target.
//
// design: a kernel of map M at a point seen through J has A = J M. With the rows a1, a2 of A for
// screen x and y, unit kernel offsets u land at K u, K the Cholesky factor of the rows' Gram
// matrix, and the kernel's depth axis is 1 / sqrt(C) = |det A| / |a1 x a2|.

@group(0) @binding(0) var<uniform> frame: Frame;

// All kernels are one voxel large and seen in parallel: one footprint, given by the frame.
override one_footprint: bool = false;
override perspective: bool = false;

struct Record {
    @location(0) centre: vec3<f32>,
    @location(1) extinction: f32,
    @location(2) packed: vec3<u32>,
}

// As few as each kind needs: every one costs a set-up per triangle.
struct Radial {
    @builtin(position) position: vec4<f32>,
    // Unit kernel offset over the radius. Not `linear`, though w is 1 throughout: llvmpipe (Mesa
    // 22.3.6) loses linear varyings along vertical edges that its own clipping made.
    @location(0) local: vec2<f32>,
    // Linear colour, and optical depth per unit of footprint.
    @location(1) @interpolate(flat) matter: vec4<f32>,
}

struct Box {
    @builtin(position) position: vec4<f32>,
    // Kernel-space point of the pixel's ray, and its step per pixel of depth.
    @location(0) local: vec3<f32>,
    @location(1) @interpolate(flat) matter: vec4<f32>,
    @location(2) @interpolate(flat) ray: vec3<f32>,
}

struct Point {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) matter: vec4<f32>,
}

const NEAR: f32 = 1e-3;
// Vertices snap to 1/256 of a pixel: a box's quad is this much larger, or it would lose pixels.
const SNAP: f32 = 0.0078125;
// Kernels thinner than a pixel are widened to this half axis, in pixels, and keep their depth.
const LEAST_HALF_AXIS: f32 = 1.0;

// Corners of a triangle about the unit circle, and of the square [-1, 1]^2 as a strip.
const TRIANGLE = array(vec2<f32>(0.0, 2.0), vec2<f32>(-1.7320508, -1.0), vec2<f32>(1.7320508, -1.0));

fn corner_of(vertex: u32) -> vec2<f32> {
    return vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
}

// Eye to pixel over eye to plane: 1 / cos of the ray's angle to the view axis.
fn slant(pixel: vec2<f32>) -> f32 {
    if !perspective {
        return 1.0;
    }
    let tangent = (pixel - frame.half_size) / frame.view_centre.w;
    return sqrt(1.0 + dot(tangent, tangent));
}

struct Projected {
    // Screen offset of the centre from the picture's middle, pixels, y up.
    middle: vec2<f32>,
    // Rows of A: how screen x, screen y and depth change along the kernel's own axes.
    row_x: vec3<f32>,
    row_y: vec3<f32>,
    row_z: vec3<f32>,
    determinant: f32,
    // At or behind the eye.
    hidden: bool,
}

fn project(record: Record) -> Projected {
    let size = vec3<f32>(
        f32(record.packed.x & 0xffffu),
        f32(record.packed.x >> 16u),
        f32(record.packed.y & 0xffffu),
    );
    let from_centre = record.centre - frame.lattice_centre.xyz;
    let view = frame.view_centre.xyz
        + frame.view_x.xyz * from_centre.x
        + frame.view_y.xyz * from_centre.y
        + frame.view_z.xyz * from_centre.z;
    var out: Projected;
    out.middle = view.xy;
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

fn matter_of(record: Record, depth: f32) -> vec4<f32> {
    return vec4<f32>(
        unpack2x16unorm(record.packed.y).y,
        unpack2x16unorm(record.packed.z),
        min(record.extinction * frame.extinction_scale * depth, MOST_DEPTH),
    );
}

fn clip(screen: vec2<f32>, hidden: bool) -> vec4<f32> {
    // Hidden ones lie beyond the far plane: clipped.
    return vec4<f32>(screen / frame.half_size, select(0.5, 2.0, hidden), 1.0);
}

@vertex
fn vertex_radial(record: Record, @builtin(vertex_index) index: u32) -> Radial {
    let kernel = project(record);
    var factor = frame.footprint;
    if !one_footprint {
        let k11 = length(kernel.row_x);
        let across = length(cross(kernel.row_x, kernel.row_y));
        factor = widened(vec4<f32>(
            k11,
            dot(kernel.row_x, kernel.row_y) / k11,
            across / k11,
            kernel.determinant / across,
        ));
    }
    // One triangle is quicker to set up, and covers 1.3 times the pixels of the square.
    let corner = select(corner_of(index), TRIANGLE[index % 3u], one_footprint);
    let unit = corner * frame.radius;
    let offset = vec2<f32>(factor.x * unit.x, factor.y * unit.x + factor.z * unit.y);
    return Radial(
        clip(kernel.middle + offset, kernel.hidden),
        corner,
        matter_of(record, factor.w * frame.footprint_scale),
    );
}

@vertex
fn vertex_box(record: Record, @builtin(vertex_index) index: u32) -> Box {
    let kernel = project(record);
    // The box's shadow, and the inverse of A for the ray through each pixel.
    let reach = SNAP + 0.5 * vec2<f32>(
        dot(abs(kernel.row_x), vec3<f32>(1.0)),
        dot(abs(kernel.row_y), vec3<f32>(1.0)),
    );
    let offset = corner_of(index) * reach;
    let volume = dot(kernel.row_x, cross(kernel.row_y, kernel.row_z));
    let from_x = cross(kernel.row_y, kernel.row_z) / volume;
    let from_y = cross(kernel.row_z, kernel.row_x) / volume;
    return Box(
        clip(kernel.middle + offset, kernel.hidden),
        from_x * offset.x + from_y * offset.y,
        matter_of(record, 1.0),
        cross(kernel.row_x, kernel.row_y) / volume,
    );
}

@vertex
fn vertex_point(record: Record, @builtin(vertex_index) index: u32) -> Point {
    let kernel = project(record);
    // The one pixel that holds the centre.
    let down = vec2<f32>(kernel.middle.x, -kernel.middle.y) + frame.half_size;
    let pixel = floor(down) + 0.5;
    let middle = vec2<f32>(pixel.x - frame.half_size.x, frame.half_size.y - pixel.y);
    let across = length(cross(kernel.row_x, kernel.row_y));
    return Point(
        clip(middle + corner_of(index) * 0.5, kernel.hidden),
        matter_of(record, kernel.determinant / across),
    );
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

// Length of the ray inside the unit box, in pixels of depth.
fn chord(point: vec3<f32>, ray: vec3<f32>) -> f32 {
    var enter = -1e30;
    var leave = 1e30;
    for (var axis = 0u; axis < 3u; axis++) {
        if abs(ray[axis]) < 1e-12 {
            if abs(point[axis]) > 0.5 {
                return 0.0;
            }
        } else {
            let a = (-0.5 - point[axis]) / ray[axis];
            let b = (0.5 - point[axis]) / ray[axis];
            enter = max(enter, min(a, b));
            leave = min(leave, max(a, b));
        }
    }
    return max(leave - enter, 0.0);
}

fn splat(matter: vec4<f32>, footprint: f32, position: vec4<f32>) -> vec4<f32> {
    let alpha = opacity(matter.w * footprint * slant(position.xy));
    return vec4<f32>(matter.rgb * alpha, alpha);
}

@fragment
fn fragment_radial(in: Radial) -> @location(0) vec4<f32> {
    return splat(in.matter, footprint(dot(in.local, in.local)), in.position);
}

@fragment
fn fragment_box(in: Box) -> @location(0) vec4<f32> {
    return splat(in.matter, chord(in.local, in.ray), in.position);
}

@fragment
fn fragment_point(in: Point) -> @location(0) vec4<f32> {
    return splat(in.matter, 1.0, in.position);
}

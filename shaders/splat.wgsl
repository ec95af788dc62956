// Draws records as footprints, back to front, over a premultiplied linear target.
//
// design: a kernel of map M at a point seen through J has A = J M. With the rows a1, a2 of A for
// screen x and y, unit kernel offsets u land at K u, K the Cholesky factor of the rows' Gram
// matrix, and the kernel's depth axis is 1 / sqrt(C) = |det A| / |a1 x a2|.

@group(0) @binding(0) var<uniform> frame: Frame;

// Which footprint: 0 a radial kernel's polynomial, 1 the voxel's box, 2 one pixel.
override footprint_kind: u32 = 0u;
// All kernels are one voxel large and seen in parallel: one footprint, given by the frame.
override one_footprint: bool = false;
override perspective: bool = false;
// The footprint ends as a square root (a kernel that is cut off) rather than as a square.
override rim_root: bool = false;

struct Record {
    @location(0) centre: vec3<f32>,
    @location(1) extinction: f32,
    @location(2) packed: vec3<u32>,
}

struct Splat {
    @builtin(position) position: vec4<f32>,
    // Radial: unit kernel offset over the radius. Box: kernel-space point of the pixel's ray.
    @location(0) local: vec3<f32>,
    // Screen offset from the picture's middle, pixels, y up.
    @location(1) screen: vec2<f32>,
    @location(2) @interpolate(flat) colour: vec3<f32>,
    // Optical depth per unit of footprint.
    @location(3) @interpolate(flat) depth: f32,
    // Box: kernel-space step per pixel of depth.
    @location(4) @interpolate(flat) ray: vec3<f32>,
}

const NEAR: f32 = 1e-3;
// Kernels thinner than a pixel are widened to this half axis, in pixels, and keep their depth.
const LEAST_HALF_AXIS: f32 = 1.0;

fn corner_of(vertex: u32) -> vec2<f32> {
    return vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
}

// Eye to pixel over eye to plane: 1 / cos of the ray's angle to the view axis.
fn slant(screen: vec2<f32>) -> f32 {
    if !perspective {
        return 1.0;
    }
    let tangent = screen / frame.view_centre.w;
    return sqrt(1.0 + dot(tangent, tangent));
}

@vertex
fn vertex(record: Record, @builtin(vertex_index) vertex_index: u32) -> Splat {
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
    var out: Splat;
    out.colour = vec3<f32>(
        unpack2x16unorm(record.packed.y).y,
        unpack2x16unorm(record.packed.z),
    );
    let corner = corner_of(vertex_index);
    let extinction = record.extinction * frame.extinction_scale;

    var middle = view.xy;
    // Rows of A: how screen x, screen y and depth change along the kernel's own axes.
    var row_x = vec3<f32>(frame.view_x.x, frame.view_y.x, frame.view_z.x) * size;
    var row_y = vec3<f32>(frame.view_x.y, frame.view_y.y, frame.view_z.y) * size;
    let row_z = vec3<f32>(frame.view_x.z, frame.view_y.z, frame.view_z.z) * size;
    var determinant = frame.lattice_centre.w * size.x * size.y * size.z;
    var hidden = false;
    if perspective {
        let eye = frame.view_centre.w;
        hidden = view.z <= eye * NEAR;
        let depth = max(view.z, eye * NEAR);
        let shrink = eye / depth;
        middle = view.xy * shrink;
        row_x = (row_x - row_z * (view.x / depth)) * shrink;
        row_y = (row_y - row_z * (view.y / depth)) * shrink;
        determinant *= shrink * shrink;
    }

    var offset: vec2<f32>;
    if footprint_kind == 0u {
        var factor: vec4<f32>;
        if one_footprint {
            factor = frame.footprint;
        } else {
            let k11 = length(row_x);
            let across = length(cross(row_x, row_y));
            factor = widened(vec4<f32>(
                k11,
                dot(row_x, row_y) / k11,
                across / k11,
                determinant / across,
            ));
        }
        let unit = corner * frame.radius;
        offset = vec2<f32>(factor.x * unit.x, factor.y * unit.x + factor.z * unit.y);
        out.local = vec3<f32>(corner, 0.0);
        out.depth = extinction * factor.w;
    } else if footprint_kind == 1u {
        // The box's shadow, and its inverse map for the ray through each pixel.
        let reach = 0.5 * vec2<f32>(
            dot(abs(row_x), vec3<f32>(1.0)),
            dot(abs(row_y), vec3<f32>(1.0)),
        );
        offset = corner * reach;
        let volume = dot(row_x, cross(row_y, row_z));
        let from_x = cross(row_y, row_z) / volume;
        let from_y = cross(row_z, row_x) / volume;
        out.local = from_x * offset.x + from_y * offset.y;
        out.ray = cross(row_x, row_y) / volume;
        out.depth = extinction;
    } else {
        // The one pixel that holds the centre.
        let pixel = floor(vec2<f32>(middle.x, -middle.y) + frame.half_size) + 0.5;
        middle = vec2<f32>(pixel.x - frame.half_size.x, frame.half_size.y - pixel.y);
        offset = corner * 0.5;
        out.depth = extinction * determinant / length(cross(row_x, row_y));
    }
    out.screen = middle + offset;
    out.position = vec4<f32>(out.screen / frame.half_size, 0.5, 1.0);
    if hidden {
        // Behind every pixel: clipped.
        out.position = vec4<f32>(0.0, 0.0, 2.0, 1.0);
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

// F(l) of kernel::FootprintPolynomial, q = (l / radius)^2; nothing beyond the radius.
fn footprint(q_any: f32) -> f32 {
    let q = min(q_any, 1.0);
    let u = 2.0 * q - 1.0;
    var sum = 0.0;
    for (var i = 3u; i > 0u; i--) {
        let c = frame.coefficients[i - 1u];
        sum = (((sum * u + c.w) * u + c.z) * u + c.y) * u + c.x;
    }
    let inside = 1.0 - q;
    return sum * select(inside * inside, sqrt(inside), rim_root);
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

// 1 - exp(-depth), without cancellation near 0 (relative error below 1e-6).
fn opacity(depth: f32) -> f32 {
    let series = depth * (1.0 - depth * (0.5 - depth * (1.0 / 6.0 - depth * (1.0 / 24.0))));
    return select(1.0 - exp(-depth), series, depth < 0.03);
}

@fragment
fn fragment(in: Splat) -> @location(0) vec4<f32> {
    var depth = in.depth;
    if footprint_kind == 0u {
        depth *= footprint(dot(in.local.xy, in.local.xy));
    } else if footprint_kind == 1u {
        depth *= chord(in.local, in.ray);
    }
    let alpha = opacity(depth * slant(in.screen));
    return vec4<f32>(in.colour * alpha, alpha);
}

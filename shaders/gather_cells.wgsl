// Boxes and separable kernels of a lattice, gathered along each pixel's ray cell by cell, shaded
// first, and composited each (boxes), in sheets or in slabs.
//
// Within a cell the same samples contribute, as polynomials: of degree 3 along a ray for tents, 9
// for B-splines. A segment ends at a cell's or a layer's face, so quadrature over it is exact for
// boxes and tents, and near exact for B-splines.

// 0: each voxel; 1: each slice; 2: layers.
override layering: u32 = 0u;
// Samples a cell has along each axis: 1 boxes, 2 tents, 4 cubic B-splines, and as many as it takes of those of another
// than their natural width.
override support: u32 = 1u;
override tents: bool = false;
override is_scaled: bool = false;

// Parts that a cell is summed up in where kernels are of another than their natural width, since these begin, end and
// bend anywhere in it; for each of that width where they are narrower.
const TENT_PARTS = 4.0;
const SPLINE_PARTS = 2.0;

// Quadrature (Gauss-Legendre) on 0..1: three places at a time.
const TENT_NODES = vec3<f32>(0.21132487, 0.78867513, 0.0);
const TENT_WEIGHTS = vec3<f32>(0.5, 0.5, 0.0);
const SPLINE_NODES = vec3<f32>(0.11270167, 0.5, 0.88729833);
const SPLINE_WEIGHTS = vec3<f32>(0.27777778, 0.44444444, 0.27777778);

var<private> sum: vec4<f32>;

// The kernel along one axis, at three places.
fn weights(offset: vec3<f32>) -> vec3<f32> {
    let x = abs(offset);
    if tents {
        return max(1.0 - x, vec3<f32>(0.0));
    }
    let outer = max(2.0 - x, vec3<f32>(0.0));
    let inner = max(1.0 - x, vec3<f32>(0.0));
    return (outer * outer * outer - 4.0 * (inner * inner * inner)) / 6.0;
}

// Adds what a cell gives to a segment of the ray, of kernels of another than their natural width.
fn add_scaled(ray: Ray, low: vec3<i32>, high: vec3<i32>, first: f32, end: f32) {
    let scale = gather.layers.z;
    let parts = ceil(select(SPLINE_PARTS, TENT_PARTS, tents) / min(scale, 1.0));
    let part = (end - first) / parts;
    let depth = part * ray.length * gather.scale.y / (scale * scale * scale);
    let strides = gather.strides;
    let nodes = select(SPLINE_NODES, TENT_NODES, tents);
    let node_weights = select(SPLINE_WEIGHTS, TENT_WEIGHTS, tents);
    for (var a = low.x; a <= high.x; a++) {
        for (var b = low.y; b <= high.y; b++) {
            let row = u32(a) * strides.x + u32(b) * strides.y;
            for (var c = low.z; c <= high.z; c++) {
                let entry = classified(vec3<i32>(a, b, c), row + u32(c) * strides.z);
                if entry.w <= 0.0 {
                    continue;
                }
                var share = 0.0;
                for (var i = 0.0; i < parts; i += 1.0) {
                    let places = first + part * (nodes + i);
                    let xa = ray.origin.x + ray.step.x * places - f32(a);
                    let xb = ray.origin.y + ray.step.y * places - f32(b);
                    let xc = ray.origin.z + ray.step.z * places - f32(c);
                    let h = weights(xa / scale) * weights(xb / scale) * weights(xc / scale);
                    share += dot(node_weights, h);
                }
                sum += matter(entry) * min(share * depth, MOST_DEPTH);
            }
        }
    }
}

// Adds what the cell whose first sample is `cell` gives to a segment of the ray.
fn add_segment(ray: Ray, cell: vec3<i32>, first: f32, end: f32) {
    let low = max(cell, gather.low.xyz);
    let high = min(cell + i32(support) - 1, gather.high.xyz);
    if any(low > high) || !any_visible(low, high) {
        return;
    }
    let depth = (end - first) * ray.length * gather.scale.y;
    let strides = gather.strides;
    if support == 1u {
        let at = vec3<u32>(cell);
        let linear = at.x * strides.x + at.y * strides.y + at.z * strides.z;
        let entry = classified(cell, linear);
        sum += matter(entry) * min(depth, MOST_DEPTH);
        return;
    }
    if is_scaled {
        add_scaled(ray, low, high, first, end);
        return;
    }
    var nodes = SPLINE_NODES;
    var node_weights = SPLINE_WEIGHTS;
    if tents {
        nodes = TENT_NODES;
        node_weights = TENT_WEIGHTS;
    }
    let places = first + (end - first) * nodes;
    let xa = ray.origin.x + ray.step.x * places;
    let xb = ray.origin.y + ray.step.y * places;
    let xc = ray.origin.z + ray.step.z * places;
    var inner: array<vec3<f32>, 4>;
    for (var k = 0u; k < support; k++) {
        inner[k] = weights(xc - f32(cell.z + i32(k)));
    }
    for (var a = low.x; a <= high.x; a++) {
        let wa = node_weights * weights(xa - f32(a));
        for (var b = low.y; b <= high.y; b++) {
            let wab = wa * weights(xb - f32(b));
            let row = u32(a) * strides.x + u32(b) * strides.y;
            for (var c = low.z; c <= high.z; c++) {
                let entry = classified(vec3<i32>(a, b, c), row + u32(c) * strides.z);
                if entry.w > 0.0 {
                    let part = dot(wab, inner[c - cell.z]);
                    sum += matter(entry) * min(part * depth, MOST_DEPTH);
                }
            }
        }
    }
}

// Lays what was summed up of a slice or of a layer. The ray's way is that of its slices.
fn lay_sum(ray: Ray, slice: i32, layer: i32) {
    if sum.w > 1e-30 {
        if layering == 2u {
            lay_layer(ray, sum, layer);
        } else {
            lay_before_slice(ray, slice, select(gather.splits.x <= 0, ray.step.x > 0.0, perspective));
            lay(sum);
        }
    }
    sum = vec4<f32>(0.0);
}

// Walks from one end of the span to the other: cells and layers each in exact integers.
fn walk(ray_forward: Ray, span: vec2<f32>) {
    var ray = ray_forward;
    var layer_step = ray.layer.y;
    if front_to_back {
        ray.origin += ray.step * span.x;
        ray.layer.x += layer_step * span.x;
    } else {
        ray.origin += ray.step * span.y;
        ray.layer.x += layer_step * span.y;
        ray.step = -ray.step;
        layer_step = -layer_step;
    }
    let last = span.y - span.x;
    // Boxes have faces halfway between samples, the others at them.
    let shift = select(0.0, 0.5, support == 1u);
    var cell = vec3<i32>(floor(ray.origin + shift));
    let ahead = select(vec3<i32>(0), vec3<i32>(1), ray.step > vec3<f32>(0.0));
    let sign = 2 * ahead - 1;
    let moves = abs(ray.step) > vec3<f32>(1e-9);
    let inverse = 1.0 / select(vec3<f32>(1.0), ray.step, moves);
    var layer = i32(floor(ray.layer.x));
    let layer_sign = select(-1, 1, front_to_back);
    let layer_ahead = select(0, 1, front_to_back);
    // The first of a cell's samples, seen from the cell's own index.
    let back = max(i32(support) / 2 - 1, 0);
    var at = 0.0;
    sum = vec4<f32>(0.0);
    while at < last {
        let faces = (vec3<f32>(cell + ahead) - shift - ray.origin) * inverse;
        let next = select(vec3<f32>(3e30), faces, moves);
        var layer_end = 3e30;
        if layering == 2u {
            layer_end = (f32(layer + layer_ahead) - ray.layer.x) / layer_step;
        }
        let cell_end = min(next.x, min(next.y, next.z));
        let end = min(min(cell_end, layer_end), last);
        if end > at {
            add_segment(ray, cell - back, at, end);
            at = end;
        }
        let is_over = min(cell_end, layer_end) >= last;
        let ends_layer = is_over || layer_end <= cell_end;
        // At one place, since what lies among the samples is much to compile.
        if ends_layer || layering == 0u || (layering == 1u && next.x <= cell_end) {
            lay_sum(ray_forward, cell.x, layer);
        }
        if ends_layer {
            layer += layer_sign;
        } else if next.x <= cell_end {
            cell.x += sign.x;
        } else if next.y <= cell_end {
            cell.y += sign.y;
        } else {
            cell.z += sign.z;
        }
        if is_over || is_opaque() {
            break;
        }
    }
}

@compute @workgroup_size(TILE, TILE)
fn gather_cells(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
) {
    let pixel = pixel_of(group, groups, local);
    if !is_in_picture(pixel) {
        return;
    }
    for (var number = 0u; number < gather.piece.x * gather.piece.x; number++) {
        let ray = ray_at(pixel, number);
        let span = span_of(ray);
        begin_light(ray, pixel);
        if span.x < span.y {
            walk(ray, span);
        }
        end_ray();
    }
    finish(pixel);
}

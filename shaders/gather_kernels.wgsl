// Radial kernels and points of a lattice, gathered along each pixel's ray slice by slice, shaded
// first, and composited each, in sheets or in slabs.

// 0: each kernel; 1: each slice, footprints whole; 2: layers, which cut kernels.
override layering: u32 = 0u;
// Each sample is one pixel (Westover's single point).
override points: bool = false;

// As in shaders/lib/project.wgsl.
const POINT_TIE: f32 = 0.0009765625;
// The most layers worked on at a time.
const LAYERS: i32 = 16;

var<private> sum: vec4<f32>;
var<private> layers: array<vec4<f32>, LAYERS>;
// First and last layer that `layers` holds now.
var<private> chunk: vec2<i32>;

// A range of indices from far to near (scene::Traversal), or from near to far.
struct Run {
    low: i32,
    high: i32,
    // Indices beyond the eye, and all.
    beyond: i32,
    count: i32,
}

fn run_of(low: i32, high: i32, split: i32) -> Run {
    let beyond = max(high - max(split, low) + 1, 0);
    let before = max(min(split - 1, high) - low + 1, 0);
    return Run(low, high, beyond, beyond + before);
}

fn index_in(run: Run, step: i32) -> i32 {
    let position = select(step, run.count - 1 - step, front_to_back);
    return select(run.low + position - run.beyond, run.high - position, position < run.beyond);
}

// The indices of low..=high within +- reach of a place.
fn window(middle: f32, reach: f32, low: i32, high: i32) -> vec2<i32> {
    let limits = vec2<f32>(f32(low), f32(high));
    return vec2<i32>(
        i32(ceil(clamp(middle - reach, limits.x, limits.y + 1.0))),
        i32(floor(clamp(middle + reach, limits.x - 1.0, limits.y))),
    );
}

// Shares a kernel out among the layers of the chunk: `middle` and `chord` along the ray.
fn share_out(ray: Ray, matter: vec4<f32>, q: f32, middle: f32, chord: f32) {
    let first_of_all = i32(floor(ray.layer.x + ray.layer.y * (middle - chord)));
    let last_of_all = i32(floor(ray.layer.x + ray.layer.y * (middle + chord)));
    let first = max(first_of_all, chunk.x);
    let last = min(last_of_all, chunk.y);
    if first > last {
        return;
    }
    let per_layer = 1.0 / (ray.layer.y * chord);
    let from_middle = (ray.layer.x + ray.layer.y * middle) * per_layer;
    var before = 0.0;
    if first > first_of_all {
        before = share(q, f32(first) * per_layer - from_middle);
    }
    if perspective && ray.begin > middle - chord {
        before = max(before, share(q, (ray.begin - middle) / chord));
    }
    for (var k = first; k <= last; k++) {
        var after = 1.0;
        if k < last_of_all {
            after = max(share(q, f32(k + 1) * per_layer - from_middle), before);
        }
        layers[k - chunk.x] += matter * (after - before);
        before = after;
    }
}

fn add(whole: vec4<f32>) {
    if layering == 0u {
        lay(whole);
    } else {
        sum += whole;
    }
}

// A sample as one pixel's splat: as shaders/splat.wgsl projects it.
fn add_point(ray: Ray, voxel: vec3<i32>, linear: u32) {
    let from_centre = vec3<f32>(voxel) - gather.centre.xyz;
    let view = gather.view_centre.xyz
        + gather.view_a.xyz * from_centre.x
        + gather.view_b.xyz * from_centre.y
        + gather.view_c.xyz * from_centre.z;
    var middle = view.xy;
    var row_x = vec3<f32>(gather.view_a.x, gather.view_b.x, gather.view_c.x);
    var row_y = vec3<f32>(gather.view_a.y, gather.view_b.y, gather.view_c.y);
    var determinant = gather.centre.w;
    var slant = 1.0;
    if perspective {
        let eye = gather.scale.w;
        if view.z <= eye * 1e-3 {
            return;
        }
        let row_z = vec3<f32>(gather.view_a.z, gather.view_b.z, gather.view_c.z);
        let shrink = eye / view.z;
        middle *= shrink;
        row_x = (row_x - row_z * (view.x / view.z)) * shrink;
        row_y = (row_y - row_z * (view.y / view.z)) * shrink;
        determinant *= shrink * shrink;
        slant = length(vec3<f32>(ray.pixel / eye, 1.0));
    }
    let offset = vec2<f32>(middle.x - ray.pixel.x, ray.pixel.y - middle.y) + POINT_TIE;
    if any(offset < vec2<f32>(-0.5)) || any(offset >= vec2<f32>(0.5)) {
        return;
    }
    var layer = 0;
    if layering == 2u {
        layer = i32(floor((view.z - gather.view_centre.z) / gather.layers.x));
        if layer < chunk.x || layer > chunk.y {
            return;
        }
    }
    let entry = classified(voxel, linear);
    if entry.w <= 0.0 {
        return;
    }
    let depth = min(determinant / length(cross(row_x, row_y)) * slant * gather.scale.y, MOST_DEPTH);
    if layering == 2u {
        layers[layer - chunk.x] += matter(entry) * depth;
    } else {
        add(matter(entry) * depth);
    }
}

// So nearly along the slices that it does not cross them one by one.
fn is_along_slices(ray: Ray) -> bool {
    return abs(ray.step.x) < 0.02;
}

// How far from where the ray crosses a slice its kernels may lie, along the two inner axes.
fn reach_of(ray: Ray) -> vec2<f32> {
    let slope = ray.step.yz / ray.step.x;
    if points {
        return gather.reach.yz + abs(slope) * gather.reach.x;
    }
    return gather.reach.yz * sqrt(1.0 + slope * slope);
}

// Whether nothing can show about the ray in all slices between two of one brick.
fn is_clear(ray: Ray, first: i32, last: i32) -> bool {
    if is_along_slices(ray) {
        return false;
    }
    let slope = ray.step.yz / ray.step.x;
    let from_x = vec2<f32>(f32(first), f32(last)) - ray.origin.x;
    let b = ray.origin.y + slope.x * from_x;
    let c = ray.origin.z + slope.y * from_x;
    let reach = reach_of(ray);
    let rows = window(0.5 * (b.x + b.y), 0.5 * abs(b.y - b.x) + reach.x, gather.low.y, gather.high.y);
    let columns =
        window(0.5 * (c.x + c.y), 0.5 * abs(c.y - c.x) + reach.y, gather.low.z, gather.high.z);
    return rows.x > rows.y
        || columns.x > columns.y
        || !any_visible(
            vec3<i32>(min(first, last), rows.x, columns.x),
            vec3<i32>(max(first, last), rows.y, columns.y),
        );
}

// Adds the samples of one slice that the ray passes within the kernel's radius.
fn gather_slice(ray: Ray, span: vec2<f32>, slice: i32) {
    let step = ray.step;
    var at = (f32(slice) - ray.origin.x) / step.x;
    var reach = reach_of(ray);
    if is_along_slices(ray) {
        // All that the ray passes of the slice.
        at = 0.5 * (span.x + span.y);
        reach = gather.reach.yz + abs(step.yz) * (0.5 * (span.y - span.x));
    }
    let place = ray.origin + step * at;
    let rows = window(place.y, reach.x, gather.low.y, gather.high.y);
    let columns = window(place.z, reach.y, gather.low.z, gather.high.z);
    if rows.x > rows.y || columns.x > columns.y {
        return;
    }
    if !any_visible(vec3<i32>(slice, rows.x, columns.x), vec3<i32>(slice, rows.y, columns.y)) {
        return;
    }
    let ea = f32(slice) - place.x;
    let radius2 = gather.scale.x * gather.scale.x;
    // Of the step, what lies across a row.
    let bend = max(step.x * step.x + step.y * step.y, 1e-12);
    let row_run = run_of(rows.x, rows.y, gather.splits.y);
    for (var i = 0; i < row_run.count; i++) {
        let b = index_in(row_run, i);
        let eb = f32(b) - place.y;
        var within = columns;
        // l is the length of (offset x step): of this row's part, and linear in the column.
        let row_part = vec2<f32>(eb * step.z, -ea * step.z);
        let row_rest = ea * step.y - eb * step.x;
        if !points {
            let middle = (step.y * row_part.x - step.x * row_part.y) / bend;
            let nearest = dot(row_part, step.xy);
            let half2 = (radius2 - row_rest * row_rest - nearest * nearest / bend) / bend;
            if half2 <= 0.0 {
                continue;
            }
            within = window(place.z + middle, sqrt(half2) + 1e-3, columns.x, columns.y);
        }
        let row = u32(slice) * gather.strides.x + u32(b) * gather.strides.y;
        let run = run_of(within.x, within.y, gather.splits.z);
        for (var j = 0; j < run.count; j++) {
            let c = index_in(run, j);
            let linear = row + u32(c) * gather.strides.z;
            if points {
                add_point(ray, vec3<i32>(slice, b, c), linear);
                continue;
            }
            let ec = f32(c) - place.z;
            let across = row_part + ec * vec2<f32>(-step.y, step.x);
            let l2 = dot(across, across) + row_rest * row_rest;
            if l2 >= radius2 {
                continue;
            }
            let entry = classified(vec3<i32>(slice, b, c), linear);
            if entry.w <= 0.0 {
                continue;
            }
            let q = l2 / radius2;
            let middle = at + ea * step.x + eb * step.y + ec * step.z;
            let chord = sqrt(radius2 - l2);
            var depth = max(footprint(q), 0.0) * gather.scale.z * ray.length;
            depth = min(depth, MOST_DEPTH);
            if layering == 2u {
                share_out(ray, matter(entry) * depth, q, middle, chord);
                continue;
            }
            if perspective && ray.begin > middle - chord {
                depth *= 1.0 - share(q, (ray.begin - middle) / chord);
            }
            add(matter(entry) * depth);
        }
    }
}

// Slices whose kernels the ray can meet between two places on it.
fn slices_of(ray: Ray, span: vec2<f32>) -> Run {
    let ends = ray.origin.x + ray.step.x * span;
    let middle = 0.5 * (ends.x + ends.y);
    let reach = 0.5 * abs(ends.y - ends.x) + gather.reach.x;
    let range = window(middle, reach, gather.low.x, gather.high.x);
    return run_of(range.x, range.y, gather.splits.x);
}

// Gathers the slices of a run in order, leaping over bricks in which nothing can show.
fn gather_slices(ray: Ray, span: vec2<f32>, slices: Run) {
    let brick = i32(BRICK);
    var i = 0;
    // The first slice that has not been looked at as part of a brick.
    var unknown = i;
    while i < slices.count {
        let slice = index_in(slices, i);
        if i >= unknown {
            // The slices of one brick that follow, up to where the order turns at the eye.
            let turn = select(slices.beyond, slices.count - slices.beyond, front_to_back);
            let end = select(slices.count, turn, i < turn);
            let up = index_in(slices, min(i + 1, end - 1)) >= slice;
            let left = select(slice % brick, brick - 1 - slice % brick, up);
            let more = min(left, end - 1 - i);
            unknown = i + more + 1;
            if is_clear(ray, slice, index_in(slices, i + more)) {
                i = unknown;
                continue;
            }
        }
        if layering < 2u {
            lay_before_slice(ray, slice, slice >= gather.splits.x);
        }
        gather_slice(ray, span, slice);
        if layering == 1u {
            lay(sum);
            sum = vec4<f32>(0.0);
        }
        if layering < 2u && is_opaque() {
            return;
        }
        i++;
    }
}

fn gather_layers(ray: Ray, span: vec2<f32>) {
    // Points and kernels reach a little beyond where the ray is within their reach.
    let first = i32(floor(ray.layer.x + ray.layer.y * span.x)) - select(0, 1, points);
    let last = i32(floor(ray.layer.x + ray.layer.y * span.y)) + select(0, 1, points);
    let chunks = (last - first) / LAYERS + 1;
    for (var n = 0; n < chunks; n++) {
        let begin = first + LAYERS * select(chunks - 1 - n, n, front_to_back);
        chunk = vec2<i32>(begin, min(begin + LAYERS - 1, last));
        for (var k = 0; k < LAYERS; k++) {
            layers[k] = vec4<f32>(0.0);
        }
        let faces = vec2<f32>(f32(begin), f32(chunk.y + 1));
        let within = clamp(
            (faces - ray.layer.x) / ray.layer.y,
            vec2<f32>(span.x),
            vec2<f32>(span.y),
        );
        let slices = slices_of(ray, within);
        let near = within + vec2<f32>(-1.0, 1.0) * length(gather.reach.xyz);
        gather_slices(ray, near, slices);
        for (var k = 0; k < LAYERS; k++) {
            let at = select(LAYERS - 1 - k, k, front_to_back);
            lay_layer(ray, layers[at], begin + at);
        }
        if is_opaque() {
            return;
        }
    }
}

@compute @workgroup_size(TILE, TILE)
fn gather_kernels(
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
        if span.x < span.y && !is_opaque() {
            if layering == 2u {
                gather_layers(ray, span);
            } else {
                gather_slices(ray, span, slices_of(ray, span));
            }
        }
        end_ray();
    }
    finish(pixel);
}

// Composites the slabs of a field that is classified after reconstruction.
//
// One invocation a pixel. It walks its ray from slab face to slab face, gathers the field's value
// there from the lattice's coefficients, classifies what lies between, and composites. Where no
// value in reach can show it leaps.

const TILE: u32 = 8u;
// Edge of a brick of `empty`, voxels.
const EMPTY_BRICK: i32 = 4;
// Faces between two looks at whether anything can show: about a brick.
const LOOK_EVERY: u32 = 4u;
// Least depth of three slabs together, in slabs, for all three to be whole: at the borders of the
// lattice they are clipped.
const WHOLE_SLABS: f32 = 2.99;
// Part of a cell by which values are lifted, so that rounding does not take one out of the cell that
// begins with it.
const LIFT_CELLS: f32 = 0.0625;
// Stands for "no value here".
const NOTHING: f32 = -3e38;

// How coefficients are stored: two neighbours along x in a word for every sample, two samples a
// word, or 32-bit floats. With widths: both in a word, or in two of 32 bits.
const PAIRS: u32 = 0u;
const HALVES: u32 = 1u;
const FLOATS: u32 = 2u;
// Values nearer to each other than this many cells are classified by the one in their middle: single
// precision has too few digits for the difference of their integrals.
const NEAR_CELLS: f32 = 4.0;

// Kernels, as the host numbers them.
const NEAREST: u32 = 0u;
const LINEAR: u32 = 1u;
const GAUSSIAN: u32 = 2u;
const CUBIC: u32 = 3u;

override kernel: u32 = 4u;
// Samples to either side of a position that a radial kernel reaches.
override window: i32 = 2;
override format: u32 = 0u;
override one_chunk: bool = true;
override has_holes: bool = false;
// Coefficients are means, each stored beside half the width of the values about it.
override has_widths: bool = false;
// Classify the value in the middle of a slab rather than all between its faces.
override classify_middle: bool = false;
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
    // Where the lattice ends along x, y, z, in index space: means at its borders may stand for less.
    end: vec4<f32>,
    // Stored samples along x and y; log2 of the words in a chunk; radius of the window, samples.
    stored: vec4<u32>,
    // Bricks along x, y, z; cells of the table.
    bricks: vec4<u32>,
    // Cell of a stored value s: x + y * s. z: what distances are divided by before the kernel.
    table: vec4<f32>,
    // Colour and weight below the first cell and beyond the last.
    below: vec4<f32>,
    beyond: vec4<f32>,
    // First tile, tiles across, picture width, picture height.
    tiles: vec4<u32>,
    // Tiles in this piece; rays along the side of a pixel; word of `empty` at which the bits of
    // samples without data begin.
    more: vec4<u32>,
    // What this dispatch walks of each pixel: first ray, the one after the last; looks along each
    // ray. w: bit 0, it goes on where the dispatch before ended; bit 1, it ends the ray.
    part: vec4<u32>,
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
// where samples are without data, a bit for each sample.
@group(0) @binding(5) var<storage, read> empty: array<u32>;
// Each cell: mean red and green, blue, 16-bit fractions of 1; then 32-bit floats: the weight's growth
// across it, and its mean. After all cells, in 32-bit floats, weight times colour, and weight,
// integrated up to where each cell begins, and to the end.
@group(0) @binding(6) var<storage, read> table: array<vec4<u32>>;
@group(0) @binding(7) var picture: texture_storage_2d<rgba32float, write>;

fn word(index: u32) -> u32 {
    if one_chunk {
        return field0[index];
    }
    let within = index & ((1u << slabs.stored.z) - 1u);
    switch index >> slabs.stored.z {
        case 0u: { return field0[within]; }
        case 1u: { return field1[within]; }
        case 2u: { return field2[within]; }
        default: { return field3[within]; }
    }
}

// The stored values at an index and at the next one along x.
fn two(index: u32) -> vec2<f32> {
    if format == PAIRS {
        return unpack2x16unorm(word(index));
    }
    if format == HALVES {
        let first = unpack2x16unorm(word(index / 2u));
        let second = unpack2x16unorm(word((index + 1u) / 2u));
        return select(first, vec2<f32>(first.y, second.x), (index & 1u) == 1u);
    }
    return vec2<f32>(bitcast<f32>(word(index)), bitcast<f32>(word(index + 1u)));
}

fn bspline_weights(f: f32) -> vec4<f32> {
    let g = 1.0 - f;
    let f2 = f * f;
    let g2 = g * g;
    return vec4<f32>(
        g2 * g,
        4.0 - 6.0 * f2 + 3.0 * f2 * f,
        4.0 - 6.0 * g2 + 3.0 * g2 * g,
        f2 * f,
    ) / 6.0;
}

fn row4(index: u32, w: vec4<f32>) -> f32 {
    return dot(two(index), w.xy) + dot(two(index + 2u), w.zw);
}

fn plane4(index: u32, wx: vec4<f32>, wy: vec4<f32>) -> f32 {
    let row = slabs.stored.x;
    return wy.x * row4(index, wx) + wy.y * row4(index + row, wx)
        + wy.z * row4(index + 2u * row, wx) + wy.w * row4(index + 3u * row, wx);
}

// A radial kernel's value, to a factor that normalisation takes out.
fn radial(squared: f32) -> f32 {
    if kernel == GAUSSIAN {
        // sigma 0.6, cut where exp falls to 0.004.
        return select(0.0, exp(squared * (-1.0 / 0.72)), squared <= 3.975530);
    }
    let r = sqrt(squared);
    let t = 1.556228 - r;
    let inner = 0.557526 + squared * (0.671033 * r - 1.157743);
    let outer = t * t * (0.067599 + 0.282474 * t);
    return select(select(0.0, outer, t > 0.0), inner, r <= 0.889392);
}

// A mean and half the width about it.
fn mean_and_width(index: u32) -> vec2<f32> {
    if format == FLOATS {
        return bitcast<vec2<f32>>(vec2<u32>(word(2u * index), word(2u * index + 1u)));
    }
    return unpack2x16unorm(word(index));
}

// The same between two neighbours along x.
fn along_x(index: u32, f: f32) -> vec2<f32> {
    return mix(mean_and_width(index), mean_and_width(index + 1u), f);
}

// Weighted sum and sum of weights of four samples of a row, at this squared distance beside them.
fn radial_row4(index: u32, dx: f32, across: f32, scale: f32) -> vec2<f32> {
    let x = vec4<f32>(dx, dx + 1.0, dx + 2.0, dx + 3.0);
    let squared = (x * x + across) * (scale * scale);
    let h = vec4<f32>(radial(squared.x), radial(squared.y), radial(squared.z), radial(squared.w));
    let values = vec4<f32>(two(index), two(index + 2u));
    return vec2<f32>(dot(values, h), h.x + h.y + h.z + h.w);
}

fn radial_plane4(corner: vec3<i32>, fraction: vec3<f32>, z: i32, scale: f32) -> vec2<f32> {
    let index = stored_index(corner + vec3<i32>(-1, -1, z));
    let row = slabs.stored.x;
    let dx = -1.0 - fraction.x;
    let dz = f32(z) - fraction.z;
    let dy = vec4<f32>(-1.0, 0.0, 1.0, 2.0) - fraction.y;
    let across = dy * dy + dz * dz;
    return radial_row4(index, dx, across.x, scale)
        + radial_row4(index + row, dx, across.y, scale)
        + radial_row4(index + 2u * row, dx, across.z, scale)
        + radial_row4(index + 3u * row, dx, across.w, scale);
}

fn radial_mean(corner: vec3<i32>, fraction: vec3<f32>) -> f32 {
    let scale = 1.0 / slabs.table.z;
    var sum = vec2<f32>(0.0);
    if window == 2 {
        // No loops: software adapters end a shader after 65 535 turns of them.
        sum = radial_plane4(corner, fraction, -1, scale)
            + radial_plane4(corner, fraction, 0, scale)
            + radial_plane4(corner, fraction, 1, scale)
            + radial_plane4(corner, fraction, 2, scale);
    } else {
        for (var z = 1 - window; z <= window; z++) {
            for (var y = 1 - window; y <= window; y++) {
                let dy = f32(y) - fraction.y;
                let dz = f32(z) - fraction.z;
                let across = dy * dy + dz * dz;
                let row = stored_index(corner + vec3<i32>(1 - window, y, z));
                for (var x = 0; x < 2 * window; x += 2) {
                    let dx = f32(x + 1 - window) - fraction.x;
                    let pair = two(row + u32(x));
                    let h = vec2<f32>(
                        radial((across + dx * dx) * scale * scale),
                        radial((across + (dx + 1.0) * (dx + 1.0)) * scale * scale),
                    );
                    sum += vec2<f32>(dot(pair, h), h.x + h.y);
                }
            }
        }
    }
    return select(NOTHING, sum.x / sum.y, sum.y > 0.0);
}

fn stored_index(voxel: vec3<i32>) -> u32 {
    let at = vec3<u32>(voxel + vec3<i32>(i32(slabs.dims.w)));
    return (at.z * slabs.stored.y + at.y) * slabs.stored.x + at.x;
}

fn nearest(position: vec3<f32>) -> vec3<i32> {
    let last = vec3<i32>(slabs.dims.xyz) - vec3<i32>(1);
    return clamp(vec3<i32>(floor(position + 0.5)), vec3<i32>(0), last);
}

// The field at a position in index space, and half the width of the values there, in cells of the
// table.
fn value(position: vec3<f32>) -> vec2<f32> {
    var stored: f32;
    var width = 0.0;
    if has_widths {
        let floored = floor(position);
        let f = position - floored;
        let i = stored_index(vec3<i32>(floored));
        let row = slabs.stored.x;
        let plane = row * slabs.stored.y;
        let near = mix(along_x(i, f.x), along_x(i + row, f.x), f.y);
        let far = mix(along_x(i + plane, f.x), along_x(i + plane + row, f.x), f.y);
        let found = mix(near, far, f.z);
        stored = found.x;
        width = slabs.table.y * found.y;
    } else if kernel == NEAREST {
        stored = two(stored_index(nearest(position))).x;
    } else {
        let floored = floor(position);
        let f = position - floored;
        let corner = vec3<i32>(floored);
        if kernel == LINEAR {
            let i = stored_index(corner);
            let row = slabs.stored.x;
            let plane = row * slabs.stored.y;
            let wx = vec2<f32>(1.0 - f.x, f.x);
            let near = mix(dot(two(i), wx), dot(two(i + row), wx), f.y);
            let far = mix(dot(two(i + plane), wx), dot(two(i + plane + row), wx), f.y);
            stored = mix(near, far, f.z);
        } else if kernel == CUBIC || kernel == GAUSSIAN {
            stored = radial_mean(corner, f);
        } else {
            let wx = bspline_weights(f.x);
            let wy = bspline_weights(f.y);
            let wz = bspline_weights(f.z);
            let i = stored_index(corner - vec3<i32>(1));
            let plane = slabs.stored.x * slabs.stored.y;
            stored = wz.x * plane4(i, wx, wy) + wz.y * plane4(i + plane, wx, wy)
                + wz.z * plane4(i + 2u * plane, wx, wy) + wz.w * plane4(i + 3u * plane, wx, wy);
        }
    }
    if stored == NOTHING {
        return vec2<f32>(NOTHING, 0.0);
    }
    return vec2<f32>(slabs.table.x + slabs.table.y * stored, width);
}

fn is_hole(position: vec3<f32>) -> bool {
    let at = vec3<u32>(nearest(position));
    let index = (at.z * slabs.dims.y + at.y) * slabs.dims.x + at.x;
    let bits = empty[slabs.more.z + index / 32u];
    return (bits >> (index % 32u) & 1u) == 1u;
}

// Mean colour and weight about a place in a cell, from what the table holds of it.
fn within_cell(cell: vec4<u32>, place: f32) -> vec4<f32> {
    let weight = bitcast<f32>(cell.w) + bitcast<f32>(cell.z) * (fract(place) - 0.5 - LIFT_CELLS);
    return vec4<f32>(unpack2x16unorm(cell.x), unpack2x16unorm(cell.y).x, max(weight, 0.0));
}

// Colour and weight of one value.
fn classify(u: f32) -> vec4<f32> {
    let last = f32(slabs.bricks.w);
    let inside = within_cell(table[u32(clamp(u, 0.0, last - 1.0))], u);
    return select(select(inside, slabs.beyond, u >= last), slabs.below, u < 0.0);
}

// What the table holds about a place: colour and weight, or what is integrated up to there, where
// places are whole.
fn fetched(place: f32, is_cell: bool) -> vec4<f32> {
    let last = f32(slabs.bricks.w);
    let most = select(last, last - 1.0, is_cell);
    let found = table[u32(clamp(place, 0.0, most)) + select(slabs.bricks.w, 0u, is_cell)];
    let inside = within_cell(found, place);
    let cell = select(select(inside, slabs.beyond, place >= last), slabs.below, place < 0.0);
    let below = vec4<f32>(slabs.below.rgb * slabs.below.w, slabs.below.w);
    let beyond = vec4<f32>(slabs.beyond.rgb * slabs.beyond.w, slabs.beyond.w);
    let sum = bitcast<vec4<f32>>(found) + below * min(place, 0.0) + beyond * max(place - last, 0.0);
    return select(sum, cell, is_cell);
}

// Mean colour and weight from an integral over values, and their number of cells.
fn mean_of(part: vec4<f32>, width: f32) -> vec4<f32> {
    let colour = clamp(part.rgb / select(part.w, 1.0, part.w == 0.0), vec3<f32>(0.0), vec3<f32>(1.0));
    return vec4<f32>(colour, max(part.w / select(width, 1.0, width == 0.0), 0.0));
}

// Mean colours and weights of the two halves of a slab.
struct Halves {
    near: vec4<f32>,
    far: vec4<f32>,
}

// All values between two faces, along a parabola whose mean differs by `bend` from theirs: in each
// half along the straight line with its mean.
fn classify_between(near: f32, far: f32, bend: f32) -> Halves {
    let shift = 0.25 * bend;
    let half = 0.5 * (near + far) + 1.5 * bend;
    // The nearest places in the table: unbiased, and never further off than half a cell.
    let begin = floor(near + shift + 0.5);
    let middle = floor(half + shift + 0.5);
    let end = floor(far + shift + 0.5);
    // Close ones by the weight in their middle. One fetch for either, because software adapters run
    // both sides of a branch.
    let close_near = abs(middle - begin) < NEAR_CELLS;
    let close_far = abs(end - middle) < NEAR_CELLS;
    let first = fetched(select(begin, 0.5 * (near + half) + shift, close_near), close_near);
    let second = fetched(middle, false);
    let third = fetched(select(end, 0.5 * (half + far) + shift, close_far), close_far);
    return Halves(
        select(mean_of(second - first, middle - begin), first, close_near),
        select(mean_of(third - second, end - middle), third, close_far),
    );
}

// All values between two faces, and up to `width` cells beyond, as if spread evenly.
fn classify_about(near: f32, far: f32, width: f32) -> Halves {
    let begin = floor(min(near, far) - width + 0.5);
    let end = floor(max(near, far) + width + 0.5);
    let close = end - begin < NEAR_CELLS;
    let first = fetched(select(begin, 0.5 * (near + far), close), close);
    let whole = mean_of(fetched(end, false) - first, end - begin);
    let found = select(whole, first, close);
    return Halves(found, found);
}

// The field on the face of a slab.
struct Face {
    // As `value` finds it.
    value: vec2<f32>,
    // Growth per index, in cells, where lights or tables ask for it.
    gradient: vec3<f32>,
}

// What a ray has gathered so far.
struct Gathered {
    // Premultiplied.
    colour: vec3<f32>,
    transmittance: f32,
    // Added up: 1 - transmittance has no digits left where opacities are small.
    alpha: f32,
}

// One layer more, of a weight times its length.
fn composite(light: ptr<function, Gathered>, colour: vec3<f32>, amount: f32) {
    var opacity: f32;
    if published {
        opacity = min(amount, 1.0);
        if amount > 1.0 {
            atomicAdd(&totals.counts[0], 1u);
        }
    } else {
        opacity = select(1.0 - exp(-amount), amount * (1.0 - 0.5 * amount), amount < 1e-3);
    }
    if back_to_front {
        (*light).colour = mix((*light).colour, colour, opacity);
    } else {
        (*light).colour += colour * (opacity * (*light).transmittance);
    }
    (*light).alpha += opacity * (*light).transmittance;
    (*light).transmittance *= 1.0 - opacity;
}

fn distance_at(position: vec3<f32>) -> i32 {
    let brick = vec3<u32>(clamp((position + 0.5) * 0.25, vec3<f32>(0.0), vec3<f32>(slabs.bricks.xyz) - 0.5));
    let index = (brick.z * slabs.bricks.y + brick.y) * slabs.bricks.x + brick.x;
    return i32(empty[index / 4u] >> (8u * (index % 4u)) & 0xffu);
}

// How far a ray goes on from a position before it leaves the bricks nearer than `distance`.
fn leap(position: vec3<f32>, distance: i32, inverse: vec3<f32>) -> f32 {
    let brick = floor((position + 0.5) * 0.25);
    let reach = f32(distance) * f32(EMPTY_BRICK);
    let low = brick * f32(EMPTY_BRICK) - 0.5;
    let exit = select(low + f32(EMPTY_BRICK) - reach, low + reach, inverse > vec3<f32>(0.0));
    let t = (exit - position) * inverse;
    return min(t.x, min(t.y, t.z));
}

// Premultiplied colour and opacity along the ray through a point of the screen, pixels from the
// picture's middle, as far as this dispatch walks it.
fn ray(screen: vec2<f32>, slot: u32) -> vec4<f32> {
    let across = slabs.right.xyz * screen.x + slabs.up.xyz * screen.y;
    let origin = slabs.base.xyz + across * slabs.right.w;
    let direction = slabs.along.xyz + across * slabs.up.w;
    // A ray along a plane of the lattice is inside it or it is not: no infinities are needed.
    let tiny = abs(direction) < vec3<f32>(1e-20);
    let inverse = 1.0 / select(direction, vec3<f32>(1e-20), tiny);
    let lower = (vec3<f32>(-0.5) - origin) * inverse;
    let upper = (slabs.end.xyz - origin) * inverse;
    let entries = min(lower, upper);
    let exits = max(lower, upper);
    let enter = max(max(entries.x, entries.y), max(entries.z, slabs.along.w));
    let leave = min(exits.x, min(exits.y, exits.z));
    if enter >= leave {
        return vec4<f32>(0.0);
    }

    var light = Gathered(vec3<f32>(0.0), 1.0, 0.0);
    let step = slabs.base.w;
    let first = i32(floor(enter / step));
    let last = i32(ceil(leave / step));
    // Length of the ray per pixel of depth, in unit distances.
    let stretch = length(vec3<f32>(screen * slabs.up.w, 1.0)) * slabs.picture.z;
    // Faces are counted in the order of compositing. Between faces, a slab is classified once the
    // face behind it is known too: that takes one turn more.
    let way = select(1, -1, back_to_front);
    let ahead = select(1, 0, classify_middle);
    var k = select(first, last, back_to_front);
    var remaining = last - first + ahead;
    // The faces before the one at k: values, and depths in pixels. The slab between the last two is
    // the next to be classified.
    var u_before = NOTHING;
    var u_near = NOTHING;
    var u_far = NOTHING;
    var width_near = 0.0;
    var width_far = 0.0;
    var g_near = vec3<f32>(0.0);
    var g_far = vec3<f32>(0.0);
    var t_before = 0.0;
    var t_near = 0.0;
    var t_far = 0.0;
    // How many of them there are.
    var have = 0;
    var looks = 0u;
    if IN_PARTS && (slabs.part.w & 1u) != 0u {
        let done = bitcast<vec4<f32>>(kept(slot, 0u));
        let values = bitcast<vec4<f32>>(kept(slot, 1u));
        let place = kept(slot, 2u);
        light = Gathered(done.rgb, values.w, done.a);
        u_before = values.x;
        u_near = values.y;
        u_far = values.z;
        let depths = bitcast<vec3<f32>>(place.xyz);
        t_before = depths.x;
        t_near = depths.y;
        t_far = depths.z;
        if has_widths {
            // Where those are, there is no parabola and no face before.
            width_near = values.x;
            width_far = depths.x;
        }
        k = bitcast<i32>(place.w) >> 2u;
        have = i32(place.w & 3u);
        if SHADED {
            // Rather than kept: found again.
            g_near = face(origin + direction * t_near).gradient;
            g_far = face(origin + direction * t_far).gradient;
        }
        remaining = select(last - k, k - first, back_to_front) + ahead;
    }
    while remaining >= 0 && light.transmittance >= slabs.picture.w {
        if IN_PARTS {
            if looks == slabs.part.z {
                break;
            }
            looks += 1u;
        }
        // Where the next slab begins.
        var at = k - way * min(have, 2 * ahead);
        var look_t = clamp(f32(at) * step, enter, leave);
        var far = distance_at(origin + direction * look_t);
        while far > 0 && remaining >= 0 {
            if IN_PARTS {
                if looks == slabs.part.z {
                    break;
                }
                looks += 1u;
            }
            // To the first face that is not known to be followed by nothing.
            let free = leap(origin + direction * look_t, far, inverse * f32(way));
            let faces = max(i32(ceil((abs(look_t - f32(at) * step) + free) / step)), 1);
            at += way * faces;
            // One sooner, for the face before the slab.
            let next = at - way * ahead;
            if (next - k) * way > 0 {
                k = next;
                remaining = select(last - k, k - first, back_to_front) + ahead;
                have = 0;
                u_near = NOTHING;
                u_far = NOTHING;
            }
            look_t = clamp(f32(at) * step, enter, leave);
            far = distance_at(origin + direction * look_t);
        }
        // Loops rather than branches: software adapters run both sides of a branch.
        for (var n = 0u; n < LOOK_EVERY && remaining >= 0 && light.transmittance >= slabs.picture.w; n++) {
            let t = clamp(f32(k) * step, enter, leave);
            var found = Halves(vec4<f32>(0.0), vec4<f32>(0.0));
            var from_t = t_near;
            var to_t = t_far;
            var u_middle = 0.5 * (u_near + u_far);
            var g_middle = 0.5 * (g_near + g_far);
            if classify_middle {
                from_t = t;
                to_t = clamp(f32(k + way) * step, enter, leave);
                let middle = face(origin + direction * (0.5 * (from_t + to_t)));
                let u = middle.value;
                u_middle = u.x;
                g_middle = middle.gradient;
                if u.x != NOTHING {
                    if has_widths {
                        found.near = classify_about(u.x, u.x, u.y).near;
                    } else {
                        found.near = classify(u.x);
                    }
                }
            } else {
                let here = face(origin + direction * t);
                let u = here.value.x;
                // The parabola has the mean of the cubic through four faces.
                let whole = abs(t - t_before) >= WHOLE_SLABS * step
                    && u_before != NOTHING && u != NOTHING;
                let bend = ((u_near - u_before) + (u_far - u)) * (1.0 / 24.0);
                if u_near != NOTHING && u_far != NOTHING {
                    if has_widths {
                        found = classify_about(u_near, u_far, 0.5 * (width_near + width_far));
                    } else {
                        found = classify_between(u_near, u_far, select(0.0, bend, whole));
                    }
                }
                width_near = width_far;
                width_far = here.value.y;
                g_near = g_far;
                g_far = here.gradient;
                u_before = u_near;
                u_near = u_far;
                u_far = u;
                t_before = t_near;
                t_near = t_far;
                t_far = t;
                have += 1;
            }
            k += way;
            remaining -= 1;
            if SHADED {
                // A loop for the same reason.
                for (var once = found.near.w + found.far.w > 0.0; once; once = false) {
                    found = shaded(found, u_middle, g_middle, 0.5 * (from_t + to_t), screen);
                }
            }
            let weight = found.near.w + found.far.w;
            if weight <= 0.0 {
                continue;
            }
            if has_holes {
                if is_hole(origin + direction * (0.5 * (from_t + to_t))) {
                    continue;
                }
            }
            let length = stretch * abs(to_t - from_t);
            if classify_middle {
                composite(&light, found.near.rgb, weight * length);
            } else if published {
                // Opacities are given to slabs: the mean of the two.
                let sum = found.near.rgb * found.near.w + found.far.rgb * found.far.w;
                composite(&light, sum / weight, 0.5 * weight * length);
            } else {
                composite(&light, found.near.rgb, 0.5 * found.near.w * length);
                composite(&light, found.far.rgb, 0.5 * found.far.w * length);
            }
        }
    }
    if IN_PARTS && (slabs.part.w & 2u) == 0u {
        keep(slot, 0u, bitcast<vec4<u32>>(vec4<f32>(light.colour, light.alpha)));
        let before = select(vec2<f32>(u_before, t_before), vec2<f32>(width_near, width_far), has_widths);
        let values = vec4<f32>(before.x, u_near, u_far, light.transmittance);
        keep(slot, 1u, bitcast<vec4<u32>>(values));
        let depths = bitcast<vec3<u32>>(vec3<f32>(before.y, t_near, t_far));
        keep(slot, 2u, vec4<u32>(depths, bitcast<u32>(k << 2u) | u32(min(have, 2))));
        return vec4<f32>(0.0);
    }
    return vec4<f32>(light.colour, light.alpha);
}

@compute @workgroup_size(TILE, TILE)
fn reconstruct_slabs(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
) {
    let within = group.x * groups.y + group.y;
    let tile = slabs.tiles.x + within;
    let pixel = vec2<u32>(tile % slabs.tiles.y, tile / slabs.tiles.y) * TILE + local.xy;
    if within >= slabs.more.x || pixel.x >= slabs.tiles.z || pixel.y >= slabs.tiles.w {
        return;
    }
    let corner = vec2<f32>(f32(pixel.x), f32(slabs.tiles.w - pixel.y)) - slabs.picture.xy;
    // One ray a pixel, or a square of them where kernels are smaller than a pixel.
    let side = slabs.more.y;
    var sum = vec4<f32>(0.0);
    var i = 0u;
    var end = side * side;
    let slot = (within * TILE + local.y) * TILE + local.x;
    if IN_PARTS {
        i = slabs.part.x;
        end = slabs.part.y;
        if i > 0u || (slabs.part.w & 1u) != 0u {
            sum = bitcast<vec4<f32>>(kept(slot, 3u));
        }
    }
    for (; i < end; i++) {
        let part = (vec2<f32>(f32(i % side), f32(i / side)) + 0.5) / f32(side);
        sum += ray(corner + vec2<f32>(part.x, -part.y), slot);
    }
    if IN_PARTS {
        keep(slot, 3u, bitcast<vec4<u32>>(sum));
    }
    textureStore(picture, pixel, sum / f32(side * side));
}

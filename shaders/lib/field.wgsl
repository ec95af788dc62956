// The value of a field between its samples, from the coefficients stored of it.

// How coefficients are stored: two neighbours along x in a word for every sample, two samples a
// word, or 32-bit floats. With widths: both in a word, or in two of 32 bits.
const PAIRS: u32 = 0u;
const HALVES: u32 = 1u;
const FLOATS: u32 = 2u;

// Kernels, as the host numbers them.
const NEAREST: u32 = 0u;
const LINEAR: u32 = 1u;
const GAUSSIAN: u32 = 2u;
const CUBIC: u32 = 3u;
const NARROW_BSPLINE: u32 = 5u;
const SCALED_TENT: u32 = 6u;
// Basis functions, which stand in the place of coefficients.
const FUNCTIONS: u32 = 7u;
// Cells, alike.
const CELLS: u32 = 8u;
// Ellipsoids about points, each weighed against the others: stored as basis functions are.
const ELLIPSOIDS: u32 = 9u;

override kernel: u32 = 4u;
// Samples to either side of a position that a radial kernel reaches.
override window: i32 = 2;
override format: u32 = 0u;
override one_chunk: bool = true;
// Basis functions are 1/sqrt(1 + r^2) rather than exp(-r^2/2).
override multiquadric: bool = false;
// Something is added for basis functions that cells leave out.
override adds_left_out: bool = false;

fn word(index: u32) -> u32 {
    if one_chunk {
        return field0[index];
    }
    let chunk = index / slabs.stored.z;
    let within = index - chunk * slabs.stored.z;
    switch chunk {
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

// What four samples weigh by B-splines narrower than natural, or by tents of another width, normalised. Where none is
// in reach, the nearest alone.
fn scaled_weights(f: f32) -> vec4<f32> {
    let x = abs(vec4<f32>(f + 1.0, f, f - 1.0, f - 2.0)) / slabs.table.z;
    let inner = max(vec4<f32>(1.0) - x, vec4<f32>(0.0));
    var h = inner;
    if kernel == NARROW_BSPLINE {
        let outer = max(vec4<f32>(2.0) - x, vec4<f32>(0.0));
        h = outer * outer * outer - 4.0 * (inner * inner * inner);
    }
    let total = h.x + h.y + h.z + h.w;
    if total > 0.0 {
        return h / total;
    }
    return select(vec4<f32>(0.0, 1.0, 0.0, 0.0), vec4<f32>(0.0, 0.0, 1.0, 0.0), f >= 0.5);
}

// What four samples of an axis weigh.
fn weights4(f: f32) -> vec4<f32> {
    if kernel == NARROW_BSPLINE || kernel == SCALED_TENT {
        return scaled_weights(f);
    }
    return bspline_weights(f);
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

// Basis functions are stored as `gpu::functions` writes them: words 0 and 1 say where the lists and the functions begin,
// then come the beginnings of the cells' lists, and what is added at the corners of each cell, if anything is.
struct Summand {
    centre: vec3<f32>,
    // What takes an offset to one in widths.
    shape: mat3x3<f32>,
    weight: f32,
    // The squared distance, in widths, at which it ends.
    reach: f32,
    // Of a mean, what it is at its centre, less than 0 of a hole; 1 of a sum.
    height: f32,
}

// The function that an entry of the lists names.
fn summand(entry: u32) -> Summand {
    let at = word(1u) + 12u * word(word(0u) + entry);
    let x = vec3<f32>(number(at + 3u), number(at + 4u), number(at + 5u));
    let y = vec3<f32>(0.0, number(at + 6u), number(at + 7u));
    let z = vec3<f32>(0.0, 0.0, number(at + 8u));
    return Summand(
        vec3<f32>(number(at), number(at + 1u), number(at + 2u)),
        transpose(mat3x3<f32>(x, y, z)),
        number(at + 9u),
        number(at + 10u),
        number(at + 11u),
    );
}

fn edge_of_cells() -> f32 {
    return f32(slabs.stored.x);
}

fn cells_along() -> vec3<u32> {
    return (slabs.dims.xyz + vec3<u32>(slabs.stored.x - 1u)) / slabs.stored.x;
}

// The cell that a position lies in, or the nearest.
fn cell_of(position: vec3<f32>) -> vec3<u32> {
    let last = vec3<f32>(cells_along() - vec3<u32>(1u));
    return vec3<u32>(clamp(floor((position + 0.5) / edge_of_cells()), vec3<f32>(0.0), last));
}

// The first entry of a cell's list, and the one behind the last.
fn entries_of(cell: vec3<u32>) -> vec2<u32> {
    let cells = cells_along();
    let at = 3u + (cell.z * cells.y + cell.y) * cells.x + cell.x;
    return vec2<u32>(word(at), word(at + 1u));
}

fn basis_of(square: f32) -> f32 {
    if multiquadric {
        return inverseSqrt(1.0 + square);
    }
    return exp(-0.5 * square);
}

// What is added at a position for the functions that its cell leaves out: linear along each axis between the cell's corners; and
// its growth per index.
fn added_at(position: vec3<f32>, cell: vec3<u32>) -> vec4<f32> {
    let cells = cells_along();
    let at = 4u + cells.x * cells.y * cells.z + 8u * ((cell.z * cells.y + cell.y) * cells.x + cell.x);
    let part = (position + 0.5) / edge_of_cells() - vec3<f32>(cell);
    // Along x: both ends of four edges.
    let low = vec4<f32>(number(at), number(at + 2u), number(at + 4u), number(at + 6u));
    let high = vec4<f32>(number(at + 1u), number(at + 3u), number(at + 5u), number(at + 7u));
    let along = mix(low, high, part.x);
    let near_far = mix(along.xz, along.yw, part.y);
    let slopes = mix((high - low).xz, (high - low).yw, part.y);
    let across = along.yw - along.xz;
    let growth = vec3<f32>(
        mix(slopes.x, slopes.y, part.z),
        mix(across.x, across.y, part.z),
        near_far.y - near_far.x,
    );
    return vec4<f32>(growth / edge_of_cells(), mix(near_far.x, near_far.y, part.z));
}

// The coverage of a mean from which on light falls as values grow (`rbf::LIT`).
const LIT_COVERAGE: f32 = 2.25;

// What functions have at a position.
struct Summed {
    // How they grow per index, and the value; of a mean nothing where they do not cover the position (`rbf::Blend`).
    found: vec4<f32>,
    // Of a mean, what light that falls on borders takes beside the growth.
    border: vec3<f32>,
}

fn summed(position: vec3<f32>) -> Summed {
    let cell = cell_of(position);
    let entries = entries_of(cell);
    var sum = vec4<f32>(0.0);
    var total = vec4<f32>(0.0);
    var coverage = vec4<f32>(0.0);
    for (var i = entries.x; i < entries.y; i++) {
        let function = summand(i);
        let offset = function.shape * (position - function.centre);
        let square = dot(offset, offset);
        if square > function.reach {
            continue;
        }
        let phi = basis_of(square);
        let slope = select(phi, phi * phi * phi, multiquadric);
        // Of a mean less what it is where it ends, so that no step is there.
        let end = select(0.0, exp(-0.5 * function.reach), kernel == ELLIPSOIDS);
        let share = function.height * vec4<f32>(-slope * (offset * function.shape), phi - end);
        coverage += share;
        if function.height > 0.0 {
            sum += function.weight * share;
            total += share;
        }
    }
    if kernel == ELLIPSOIDS {
        let is_there = total.w > 0.0;
        let scale = select(0.0, 1.0 / total.w, is_there);
        let mean = sum.w * scale;
        let value = select(NOTHING, mean, coverage.w >= 1.0);
        let near = clamp((LIT_COVERAGE - coverage.w) / (LIT_COVERAGE - 1.0), 0.0, 1.0);
        let border = coverage.xyz * (number(2u) * near * near);
        return Summed(vec4<f32>((sum.xyz - mean * total.xyz) * scale, value), border);
    }
    if adds_left_out {
        sum += added_at(position, cell);
    }
    return Summed(sum, vec3<f32>(0.0));
}

// The sum of the functions at a position, and its growth per index; of ellipsoids the mean of their weights.
fn sum_of_functions(position: vec3<f32>) -> vec4<f32> {
    return summed(position).found;
}

// The same, and what light takes for the growth (`rbf::Encoding::growth_for_light`). A surface and its back are lit alike.
fn lit_sum_of_functions(position: vec3<f32>) -> vec4<f32> {
    let here = summed(position);
    let growth = here.found.xyz * select(1.0, -1.0, dot(here.border, here.found.xyz) < 0.0);
    return vec4<f32>(here.border + growth, here.found.w);
}

// erf(x) to 1.5e-7 (Abramowitz and Stegun 7.1.26).
fn error_function(x: f32) -> f32 {
    let size = abs(x);
    let t = 1.0 / (1.0 + 0.3275911 * size);
    let series = ((((1.0614054 * t - 1.453152) * t + 1.4214137) * t - 0.28449674) * t + 0.2548296) * t;
    return sign(x) * (1.0 - series * exp(-size * size));
}

// The integral of a function's share between two places of a ray, by the distance along it.
fn integral_of(function: Summand, origin: vec3<f32>, direction: vec3<f32>, ends: vec2<f32>) -> f32 {
    // From a place nearby: far from it the squares would leave few digits to their difference.
    let begin = 0.5 * (ends.x + ends.y);
    let offset = function.shape * (origin + direction * begin - function.centre);
    let speed = function.shape * direction;
    let a = dot(speed, speed);
    let nearest = -dot(offset, speed) / a;
    let near = offset + speed * nearest;
    let square = dot(near, near);
    if square >= function.reach {
        return 0.0;
    }
    let half = sqrt((function.reach - square) / a);
    let parts = clamp(ends - begin - nearest, vec2<f32>(-half), vec2<f32>(half));
    if multiquadric {
        let scale = sqrt(a / (1.0 + square));
        return function.weight * (asinh(parts.y * scale) - asinh(parts.x * scale)) / sqrt(a);
    }
    let scale = sqrt(0.5 * a);
    let share = error_function(parts.y * scale) - error_function(parts.x * scale);
    // Half the root of pi.
    return function.weight * 0.8862269 * exp(-0.5 * square) * share / scale;
}

// The mean of the sums between two places of a ray, from cell to cell.
fn mean_of_functions(origin: vec3<f32>, direction: vec3<f32>, ends: vec2<f32>) -> f32 {
    let from_t = min(ends.x, ends.y);
    let to_t = max(ends.x, ends.y);
    if from_t >= to_t {
        return 0.0;
    }
    let edge = edge_of_cells();
    let last = vec3<i32>(cells_along()) - vec3<i32>(1);
    var cell = vec3<i32>(cell_of(origin + direction * from_t));
    let way = vec3<i32>(sign(direction));
    var t = from_t;
    var sum = 0.0;
    // A ray passes through each cell once.
    let most = u32(last.x + last.y + last.z) + 1u;
    for (var turn = 0u; turn < most && t < to_t; turn++) {
        // Where it leaves the cell, along each axis.
        let border = (vec3<f32>(cell) + select(vec3<f32>(0.0), vec3<f32>(1.0), way > vec3<i32>(0))) * edge - 0.5;
        let leaves = select(vec3<f32>(3e38), (border - origin) / direction, way != vec3<i32>(0));
        // Beyond the last cell there is no other.
        let ahead = cell + way;
        let is_last = (ahead < vec3<i32>(0)) | (ahead > last);
        let exits = select(leaves, vec3<f32>(3e38), is_last);
        let exit = min(exits.x, min(exits.y, exits.z));
        let next = clamp(exit, t, to_t);
        let entries = entries_of(vec3<u32>(cell));
        for (var i = entries.x; i < entries.y; i++) {
            sum += integral_of(summand(i), origin, direction, vec2<f32>(t, next));
        }
        t = next;
        cell += select(vec3<i32>(0), way, exits <= vec3<f32>(exit));
    }
    return sum / (to_t - from_t);
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
    } else if kernel == FUNCTIONS || kernel == ELLIPSOIDS {
        stored = sum_of_functions(position).w;
    } else if kernel == CELLS {
        stored = value_in(cell_at(position));
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
            let wx = weights4(f.x);
            let wy = weights4(f.y);
            let wz = weights4(f.z);
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

// The field on the face of a slab.
struct Face {
    // As `value` finds it.
    value: vec2<f32>,
    // Growth per index, in cells, where lights or tables ask for it.
    gradient: vec3<f32>,
}

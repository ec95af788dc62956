// Composites each tile's list, four pixels a thread, and writes premultiplied linear light.
//
// Kernels come in the order of compositing. Each is a layer of its own, or gives the slabs of its
// entry's layer its integrals (image-aligned sheets: Mueller and Crawfis 1998), which
// are composited once the layer is past: what a slab holds is then complete.
//
// A thread's pixels stand one below the other, and a vector has their values from the top.

@group(0) @binding(1) var<storage, read> lists: Lists;
// Four a kernel. First: screen offset of the centre, pixels, y up; view depth of the centre beyond
// the lattice's, pixels; optical depth per unit of footprint (published: opacity).
// A radial kernel: L of `kernel::ProjectedKernel` over the radius (00, 10, 11), and 1 over the half
// depth of its middle line; then its tilt.
// A box or point: the columns of the inverse of A, the third one's parts last.
// In the fourth the linear colour.
@group(0) @binding(2) var<storage, read> projected: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> keys: array<u32>;
@group(0) @binding(4) var<storage, read> kernels: array<u32>;
@group(0) @binding(5) var<storage, read> ranges: array<vec2<u32>>;
@group(0) @binding(6) var light: texture_storage_2d<rgba32float, write>;

// Pixels of a thread.
const PIXELS: u32 = 4u;
// Tiles of a workgroup.
const GROUP_TILES: u32 = 4u;
// Less hides nothing, and could not be divided by.
const LEAST_SUM: f32 = 1e-30;
// No layer has this number.
const NO_LAYER: u32 = 0xffffffffu;

// A kernel on the lines through the pixels.
struct Lines {
    // Optical depths, or published opacities, of all of it.
    amount: vec4<f32>,
    // View depths of its middle beyond the lattice's centre, and half lengths per depth.
    middle: vec4<f32>,
    per_depth: vec4<f32>,
    // (l / radius)^2, at most 1.
    q: vec4<f32>,
}

fn lines_of(kernel: u32, x: f32, y: vec4<f32>, slanted: vec4<f32>) -> Lines {
    let head = projected[4u * kernel];
    let first = projected[4u * kernel + 1u];
    let right = x - head.x;
    let up = y - head.y;
    var lines = Lines(vec4<f32>(0.0), vec4<f32>(head.z), vec4<f32>(0.0), vec4<f32>(0.0));
    if shape == 0u {
        let across = first.x * right;
        let along = first.y * right + first.z * up;
        let q = min(across * across + along * along, vec4<f32>(1.0));
        let depth = vec4<f32>(footprint(q.x), footprint(q.y), footprint(q.z), footprint(q.w));
        // The polynomial may fall a little below 0 at its rim.
        lines.amount = max(head.w * depth, vec4<f32>(0.0)) * slanted;
        if slabs {
            let tilt = projected[4u * kernel + 2u].xy;
            lines.middle += tilt.x * right + tilt.y * up;
            lines.per_depth = first.w * inverseSqrt(max(1.0 - q, vec4<f32>(1e-12)));
            lines.q = q;
        }
    } else if shape == 1u {
        let second = projected[4u * kernel + 2u];
        let ray = vec3<f32>(first.w, second.w, projected[4u * kernel + 3u].w);
        let column = first.xyz * right;
        let span0 = chord(column + second.xyz * up.x, ray);
        let span1 = chord(column + second.xyz * up.y, ray);
        let span2 = chord(column + second.xyz * up.z, ray);
        let span3 = chord(column + second.xyz * up.w, ray);
        let enter = vec4<f32>(span0.x, span1.x, span2.x, span3.x);
        let leave = vec4<f32>(span0.y, span1.y, span2.y, span3.y);
        lines.amount = head.w * (leave - enter) * slanted;
        lines.middle += 0.5 * (enter + leave);
        lines.per_depth = 2.0 / max(leave - enter, vec4<f32>(1e-30));
    } else {
        let there = abs(up) < vec4<f32>(0.25);
        lines.amount = select(vec4<f32>(0.0), head.w * slanted, there);
        lines.amount *= select(0.0, 1.0, abs(right) < 0.25);
    }
    return lines;
}

// The parts of a kernel that lie before a view depth.
fn parts_before(lines: Lines, depth: f32) -> vec4<f32> {
    if shape == 2u {
        return select(vec4<f32>(0.0), vec4<f32>(1.0), vec4<f32>(depth) > lines.middle);
    }
    let place = (depth - lines.middle) * lines.per_depth;
    if shape == 1u {
        return 0.5 + 0.5 * clamp(place, vec4<f32>(-1.0), vec4<f32>(1.0));
    }
    return vec4<f32>(
        share(lines.q.x, place.x),
        share(lines.q.y, place.y),
        share(lines.q.z, place.z),
        share(lines.q.w, place.w),
    );
}

// Red, green, blue and amount of the pixels, the colours times the amount.
fn matter(colour: vec3<f32>, amount: vec4<f32>) -> mat4x4<f32> {
    return mat4x4<f32>(colour.r * amount, colour.g * amount, colour.b * amount, amount);
}

fn weighed(colours: mat4x4<f32>, by: vec4<f32>) -> mat4x4<f32> {
    return mat4x4<f32>(colours[0] * by, colours[1] * by, colours[2] * by, colours[3] * by);
}

struct Pixels {
    // Premultiplied red, green, blue and opacity of what was composited so far.
    light: mat4x4<f32>,
    transmittance: vec4<f32>,
    capped: u32,
}

// One more layer of matter.
fn laid(pixels: Pixels, sum: mat4x4<f32>) -> Pixels {
    let there = sum[3] > vec4<f32>(LEAST_SUM);
    var out = pixels;
    var alpha: vec4<f32>;
    if published {
        alpha = min(sum[3], vec4<f32>(1.0));
        let over = select(vec4<u32>(0u), vec4<u32>(1u), sum[3] > vec4<f32>(1.0));
        out.capped += over.x + over.y + over.z + over.w;
    } else {
        alpha = vec4<f32>(
            opacity(sum[3].x), opacity(sum[3].y), opacity(sum[3].z), opacity(sum[3].w));
    }
    alpha = select(vec4<f32>(0.0), alpha, there);
    let per_amount = alpha / select(vec4<f32>(1.0), sum[3], there);
    let layer = mat4x4<f32>(sum[0] * per_amount, sum[1] * per_amount, sum[2] * per_amount, alpha);
    if front_to_back {
        out.light += weighed(layer, pixels.transmittance);
    } else {
        out.light = layer + weighed(pixels.light, 1.0 - alpha);
    }
    out.transmittance *= 1.0 - alpha;
    return out;
}

// The sums of a layer's slabs, from the front.
struct Sums {
    slab0: mat4x4<f32>,
    slab1: mat4x4<f32>,
    slab2: mat4x4<f32>,
    slab3: mat4x4<f32>,
}

fn laid_slabs(pixels: Pixels, sums: Sums) -> Pixels {
    if front_to_back {
        return laid(laid(laid(laid(pixels, sums.slab0), sums.slab1), sums.slab2), sums.slab3);
    }
    return laid(laid(laid(laid(pixels, sums.slab3), sums.slab2), sums.slab1), sums.slab0);
}

@compute @workgroup_size(TILE, TILE / PIXELS, GROUP_TILES)
fn composite_lists(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
) {
    let column = group.x * GROUP_TILES + local.z;
    let row = u32(lists.layers.z) + group.y;
    if column >= lists.tiles.z {
        return;
    }
    let pixel = TILE * (lists.tiles.xy + vec2<u32>(column, row)) + vec2<u32>(local.x, PIXELS * local.y);
    let size = vec2<u32>(2.0 * frame.half_size);
    let below = pixel.y + vec4<u32>(0u, 1u, 2u, 3u);
    let inside = below < vec4<u32>(select(0u, size.y, pixel.x < size.x));
    let down = vec4<f32>(below) + 0.5;
    let x = f32(pixel.x) + 0.5 - frame.half_size.x;
    let y = frame.half_size.y - down;
    let across = f32(pixel.x) + 0.5;
    let slanted = vec4<f32>(
        slant(vec2<f32>(across, down.x)),
        slant(vec2<f32>(across, down.y)),
        slant(vec2<f32>(across, down.z)),
        slant(vec2<f32>(across, down.w)),
    ) * select(vec4<f32>(0.0), vec4<f32>(1.0), inside);
    let mask = (1u << lists.counts.z) - 1u;
    let last = u32(lists.layers.y) - 1u;
    let first_layer = lists.layers.x;
    let thickness = lists.slabs.x;
    let least = lists.slabs.y;

    let range = ranges[row * lists.tiles.z + column];
    var entry = range.x;
    let end = range.y;
    let nothing = mat4x4<f32>();
    let no_sums = Sums(nothing, nothing, nothing, nothing);
    // Beyond the picture there is nothing to wait for.
    var out = Pixels(nothing, select(vec4<f32>(0.0), vec4<f32>(1.0), inside), 0u);
    var sums = no_sums;
    var layer = NO_LAYER;
    while entry < end {
        if front_to_back && all(out.transmittance < vec4<f32>(least)) {
            break;
        }
        if slabs {
            let own = keys[entry] & mask;
            if own != layer {
                out = laid_slabs(out, sums);
                sums = no_sums;
                layer = own;
            }
            let from_front = i32(select(last - own, own, front_to_back)) + first_layer;
            // Faces of its slabs, in view depth beyond the lattice's centre.
            let near = f32(from_front) * (f32(LAYER_SLABS) * thickness);
            // As the next layer takes its own, bit for bit: a kernel's shares add up to 1.
            let far = f32(from_front + 1) * (f32(LAYER_SLABS) * thickness);
            while entry < end {
                if (keys[entry] & mask) != own {
                    break;
                }
                let kernel = kernels[entry];
                let lines = lines_of(kernel, x, y, slanted);
                let colour = projected[4u * kernel + 3u].rgb;
                let part0 = parts_before(lines, near);
                let part1 = parts_before(lines, near + thickness);
                let part2 = parts_before(lines, near + 2.0 * thickness);
                let part3 = parts_before(lines, near + 3.0 * thickness);
                let part4 = parts_before(lines, far);
                sums.slab0 += matter(colour, lines.amount * (part1 - part0));
                sums.slab1 += matter(colour, lines.amount * (part2 - part1));
                sums.slab2 += matter(colour, lines.amount * (part3 - part2));
                sums.slab3 += matter(colour, lines.amount * (part4 - part3));
                entry++;
            }
        } else {
            let kernel = kernels[entry];
            let lines = lines_of(kernel, x, y, slanted);
            out = laid(out, matter(projected[4u * kernel + 3u].rgb, lines.amount));
            entry++;
        }
    }
    if slabs {
        out = laid_slabs(out, sums);
    }
    let rows = transpose(out.light);
    for (var i = 0u; i < PIXELS; i++) {
        if inside[i] {
            textureStore(light, vec2<u32>(pixel.x, below[i]), rows[i]);
        }
    }
    if out.capped > 0u {
        note_capped(out.capped);
    }
    note_ended_loops();
}

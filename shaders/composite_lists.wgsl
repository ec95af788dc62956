// Composites each tile's list, a pixel a thread, and writes premultiplied linear light.
//
// Kernels come in the order of compositing. Each is a layer of its own, or gives the slabs of its
// entry's layer its integrals (image-aligned sheets: Mueller and Crawfis 1998), which
// are composited once the layer is past: what a slab holds is then complete.

@group(0) @binding(1) var<uniform> lists: Lists;
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
// Sums, over all pixels, that were capped at 1.
@group(0) @binding(6) var<storage, read_write> capped: atomic<u32>;
@group(0) @binding(7) var light: texture_storage_2d<rgba32float, write>;

// Less hides nothing, and could not be divided by.
const LEAST_SUM: f32 = 1e-30;

// A kernel on the line through a pixel.
struct Line {
    // Optical depth, or published opacity, of all of it.
    amount: f32,
    // View depth of its middle beyond the lattice's centre, and half lengths per depth.
    middle: f32,
    per_depth: f32,
    // (l / radius)^2.
    q: f32,
}

fn line_of(kernel: u32, screen: vec2<f32>, slanted: f32) -> Line {
    let head = projected[4u * kernel];
    let first = projected[4u * kernel + 1u];
    let p = screen - head.xy;
    var line = Line(0.0, head.z, 0.0, 0.0);
    if shape == 0u {
        let unit = vec2<f32>(first.x * p.x, first.y * p.x + first.z * p.y);
        let q = dot(unit, unit);
        // The polynomial may fall a little below 0 at its rim.
        line.amount = max(head.w * footprint(q), 0.0) * slanted;
        if slabs && q < 1.0 {
            let second = projected[4u * kernel + 2u];
            line.middle += dot(second.xy, p);
            line.per_depth = first.w * inverseSqrt(1.0 - q);
            line.q = q;
        }
    } else if shape == 1u {
        let second = projected[4u * kernel + 2u];
        let ray = vec3<f32>(first.w, second.w, projected[4u * kernel + 3u].w);
        let span = chord(first.xyz * p.x + second.xyz * p.y, ray);
        line.amount = head.w * (span.y - span.x) * slanted;
        line.middle += 0.5 * (span.x + span.y);
        line.per_depth = 2.0 / max(span.y - span.x, 1e-30);
    } else {
        line.amount = select(0.0, head.w * slanted, all(abs(p) < vec2<f32>(0.25)));
    }
    return line;
}

// The factors of the place's powers in a radial kernel's share.
struct Factors {
    f0: f32,
    f1: f32,
    f2: f32,
    f3: f32,
    f4: f32,
    f5: f32,
}

fn cubic(c: vec4<f32>, q: f32) -> f32 {
    return c.x + q * (c.y + q * (c.z + q * c.w));
}

fn factors_at(q: f32) -> Factors {
    let q4 = q * q * q * q;
    return Factors(
        cubic(lists.shares[0], q) + q4 * lists.shares[6].x,
        cubic(lists.shares[1], q) + q4 * lists.shares[6].y,
        cubic(lists.shares[2], q) + q4 * lists.shares[6].z,
        cubic(lists.shares[3], q) + q4 * lists.shares[6].w,
        cubic(lists.shares[4], q) + q4 * lists.shares[7].x,
        cubic(lists.shares[5], q) + q4 * lists.shares[7].y,
    );
}

// The part of a kernel that lies before a view depth.
fn share(line: Line, factors: Factors, depth: f32) -> f32 {
    if shape == 2u {
        return select(0.0, 1.0, depth > line.middle);
    }
    let place = clamp((depth - line.middle) * line.per_depth, -1.0, 1.0);
    if shape == 1u {
        return 0.5 + 0.5 * place;
    }
    let x = place * place;
    return 0.5 + place * (factors.f0 + x * (factors.f1 + x * (factors.f2 + x * (factors.f3
        + x * (factors.f4 + x * factors.f5)))));
}

struct Pixel {
    // Premultiplied, of what was composited so far.
    light: vec4<f32>,
    transmittance: f32,
    capped: u32,
}

// One more layer: colour times amount, and amount.
fn laid(pixel: Pixel, sum: vec4<f32>) -> Pixel {
    if sum.w <= LEAST_SUM {
        return pixel;
    }
    var out = pixel;
    var alpha: f32;
    if published {
        alpha = min(sum.w, 1.0);
        out.capped += select(0u, 1u, sum.w > 1.0);
    } else {
        alpha = opacity(sum.w);
    }
    let layer = vec4<f32>(sum.rgb * (alpha / sum.w), alpha);
    if front_to_back {
        out.light += layer * pixel.transmittance;
    } else {
        out.light = layer + pixel.light * (1.0 - alpha);
    }
    out.transmittance *= 1.0 - alpha;
    return out;
}

// The sums of a layer's slabs, from the front.
struct Sums {
    slab0: vec4<f32>,
    slab1: vec4<f32>,
    slab2: vec4<f32>,
    slab3: vec4<f32>,
}

fn laid_slabs(pixel: Pixel, sums: Sums) -> Pixel {
    if front_to_back {
        return laid(laid(laid(laid(pixel, sums.slab0), sums.slab1), sums.slab2), sums.slab3);
    }
    return laid(laid(laid(laid(pixel, sums.slab3), sums.slab2), sums.slab1), sums.slab0);
}

@compute @workgroup_size(TILE, TILE)
fn composite_lists(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
) {
    let row = u32(lists.layers.z) + group.y;
    let pixel = TILE * (lists.tiles.xy + vec2<u32>(group.x, row)) + local.xy;
    let position = vec2<f32>(pixel) + 0.5;
    let size = 2.0 * frame.half_size;
    if any(position >= size) {
        return;
    }
    let screen = vec2<f32>(position.x - frame.half_size.x, frame.half_size.y - position.y);
    let slanted = slant(position);
    let range = ranges[row * lists.tiles.z + group.x];
    let mask = (1u << lists.counts.z) - 1u;
    let last = u32(lists.layers.y) - 1u;
    var out = Pixel(vec4<f32>(0.0), 1.0, 0u);
    let nothing = Sums(vec4<f32>(0.0), vec4<f32>(0.0), vec4<f32>(0.0), vec4<f32>(0.0));
    var sums = nothing;
    // No layer has this number.
    var layer = 0xffffffffu;
    // Faces of its slabs, in view depth beyond the lattice's centre.
    let thickness = lists.slabs.x;
    var near = 0.0;
    var far = 0.0;
    for (var entry = range.x; entry < range.y; entry++) {
        if slabs {
            let own = keys[entry] & mask;
            if own != layer {
                out = laid_slabs(out, sums);
                sums = nothing;
                layer = own;
                let from_front = i32(select(last - own, own, front_to_back)) + lists.layers.x;
                near = f32(from_front) * (f32(LAYER_SLABS) * thickness);
                // As the next layer takes its own, bit for bit: a kernel's shares add up to 1.
                far = f32(from_front + 1) * (f32(LAYER_SLABS) * thickness);
            }
        }
        if front_to_back && out.transmittance < lists.slabs.y {
            break;
        }
        let kernel = kernels[entry];
        let line = line_of(kernel, screen, slanted);
        if line.amount <= 0.0 {
            continue;
        }
        let matter = vec4<f32>(projected[4u * kernel + 3u].rgb, 1.0) * line.amount;
        if slabs {
            var factors: Factors;
            if shape == 0u {
                factors = factors_at(line.q);
            }
            let share0 = share(line, factors, near);
            let share1 = share(line, factors, near + thickness);
            let share2 = share(line, factors, near + 2.0 * thickness);
            let share3 = share(line, factors, near + 3.0 * thickness);
            let share4 = share(line, factors, far);
            sums.slab0 += matter * (share1 - share0);
            sums.slab1 += matter * (share2 - share1);
            sums.slab2 += matter * (share3 - share2);
            sums.slab3 += matter * (share4 - share3);
        } else {
            out = laid(out, matter);
        }
    }
    if slabs {
        out = laid_slabs(out, sums);
    }
    if out.capped > 0u {
        atomicAdd(&capped, out.capped);
    }
    textureStore(light, pixel, out.light);
}

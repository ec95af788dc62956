// Colours the greatest, the least or the mean value that each ray meets in what is kept of a field.
//
// One invocation a pixel. It walks its ray from slab face to slab face as reconstruct_slabs does. What
// lies between two faces is taken for a parabola. Where its top is greater than all before, the field
// itself is asked there.

const TILE: u32 = 8u;
// Least depth of three slabs together, in slabs, for all three to be whole.
const WHOLE_SLABS: f32 = 2.99;

const MAXIMUM: u32 = 1u;
const MINIMUM: u32 = 2u;
const AVERAGE: u32 = 3u;

override along: u32 = 1u;

// Four bytes a word: the greatest value within a step of each brick (`Slabs::tops`).
@group(0) @binding(9) var<storage, read> tops: array<u32>;

// Stands for "nowhere": a depth.
const NOWHERE: f32 = -3e38;

// What is known of a ray. Values are turned about for the minimum: the greatest is looked for.
struct Projected {
    // The greatest value so far.
    greatest: f32,
    // Where a greater one may be, not yet asked.
    perhaps: f32,
    // Of the values times their length, and of the lengths.
    sum: f32,
    length: f32,
}

// What no value within a step of a position's brick is greater than.
fn top_near(position: vec3<f32>) -> f32 {
    let brick = brick_at(position);
    return slabs.tops.x + slabs.tops.y * f32(tops[brick / 4u] >> (8u * (brick % 4u)) & 0xffu);
}

// The field's value, turned about for the minimum, and as far beyond as means stand for.
fn turned_value(place: vec3<f32>) -> f32 {
    let u = value(place);
    let is_nothing = u.x == NOTHING || (has_holes && is_hole(place));
    let turned = select(u.x, -u.x, along == MINIMUM) + select(u.y, 0.0, along == AVERAGE);
    return select(turned, NOTHING, is_nothing);
}

// The value that stands for the ray through a point of the screen, pixels from the picture's middle, in
// its colour.
fn ray(screen: vec2<f32>) -> vec4<f32> {
    let through = ray_through(screen);
    let part = part_of(through);
    let enter = part.ends.x;
    let leave = part.ends.y;
    if enter >= leave {
        return vec4<f32>(0.0);
    }
    let step = slabs.base.w;
    let first = i32(floor(enter / step));
    let last = i32(ceil(leave / step));
    var found = Projected(NOTHING, NOWHERE, 0.0, 0.0);
    // The faces before the one at k, as in reconstruct_slabs.
    var u = vec3<f32>(NOTHING);
    var ts = vec3<f32>(0.0);
    var k = first;
    // Once more after the last face, for the slab before it.
    let end = last + 1;
    // Whether nothing within a step of the face before is greater than what was found.
    var was_low = true;
    loop {
        let asks = found.perhaps != NOWHERE;
        if along != AVERAGE && !asks {
            let has_slab = u.y != NOTHING && u.z != NOTHING;
            var at = through.origin + through.direction * clamp(f32(k) * step, enter, leave);
            var is_low = top_near(at) <= found.greatest;
            let leaps = is_low && (was_low || !has_slab);
            while leaps && is_low && k <= end {
                let free = leap(at, 1, through.inverse);
                let t = clamp(f32(k) * step, enter, leave);
                k += max(i32(ceil((abs(t - f32(k) * step) + free) / step)), 1);
                at = through.origin + through.direction * clamp(f32(k) * step, enter, leave);
                is_low = top_near(at) <= found.greatest;
            }
            if leaps && k <= end {
                // One back, for the parabola of the slab after the next.
                k = max(k - 1, first);
                u = vec3<f32>(NOTHING);
                ts = vec3<f32>(0.0);
            }
            was_low = is_low;
        }
        if k > end && !asks {
            break;
        }
        let t = select(clamp(f32(k) * step, enter, leave), found.perhaps, asks);
        let here = turned_value(through.origin + through.direction * t);
        found.greatest = max(found.greatest, here);
        found.perhaps = NOWHERE;
        if asks {
            continue;
        }
        let middle = through.origin + through.direction * (0.5 * (ts.y + ts.z));
        let length = ts.z - ts.y;
        if u.y != NOTHING && u.z != NOTHING && length > 0.0 && !(has_holes && is_hole(middle)) {
            let rise = u.z - u.y;
            let is_whole = t - ts.x >= WHOLE_SLABS * step && u.x != NOTHING && here != NOTHING;
            // The mean is that of the cubic through four faces.
            let bend = ((u.y - u.x) + (u.z - here)) * (1.0 / 24.0);
            found.sum += (0.5 * (u.y + u.z) + select(0.0, bend, is_whole)) * length;
            found.length += length;
            // At the ends of the ray, that of the parabola through three.
            let has_next = here != NOTHING && t > ts.z;
            let has_last = u.x != NOTHING && ts.y > ts.x;
            let next = (here - u.z) / select(1.0, t - ts.z, has_next) - rise / length;
            let last = rise / length - (u.y - u.x) / select(1.0, ts.y - ts.x, has_last);
            let third = select(
                select(0.0, last / (ts.z - ts.x), has_last),
                next / (t - ts.y),
                has_next,
            );
            let bulge = select(third * length * length * (-1.0 / 6.0), bend, is_whole);
            // u.y (1 - s) + u.z s + 6 bulge s (1 - s), at its top.
            let s = 0.5 + rise / (12.0 * max(bulge, 1e-30));
            let top = mix(u.y, u.z, s) + 6.0 * bulge * s * (1.0 - s);
            let rises = bulge > 0.0 && abs(rise) < 6.0 * bulge && top > found.greatest;
            found.perhaps = select(NOWHERE, mix(ts.y, ts.z, s), rises && along != AVERAGE);
        }
        u = vec3<f32>(u.yz, here);
        ts = vec3<f32>(ts.yz, t);
        k += 1;
    }
    let mean = found.sum / select(found.length, 1.0, found.length == 0.0);
    let extreme = select(found.greatest, -found.greatest, along == MINIMUM);
    let stands = select(extreme, mean, along == AVERAGE);
    let is_met = select(found.greatest != NOTHING, found.length > 0.0, along == AVERAGE);
    return select(vec4<f32>(0.0), vec4<f32>(classify(stands).rgb, 1.0), is_met);
}

@compute @workgroup_size(TILE, TILE)
fn project_values(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
) {
    let within = group.y * groups.x + group.x;
    let tile = slabs.tiles.x + within;
    let pixel = vec2<u32>(tile % slabs.tiles.y, tile / slabs.tiles.y) * TILE + local.xy;
    if within >= slabs.more.x || pixel.x >= slabs.tiles.z || pixel.y >= slabs.tiles.w {
        return;
    }
    let corner = vec2<f32>(f32(pixel.x), f32(slabs.tiles.w - pixel.y)) - slabs.picture.xy;
    // One ray a pixel, or a square of them where kernels are smaller than a pixel, or things are.
    let side = rays_along_side(pixel);
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < side * side; i++) {
        let part = (vec2<f32>(f32(i % side), f32(i / side)) + 0.5) / f32(side);
        sum += ray(corner + vec2<f32>(part.x, -part.y));
    }
    textureStore(picture, pixel, sum / f32(side * side));
    note_ended_loops();
}

// What passes share that gather a lattice's kernels along each pixel's ray: the ray, and layers.
//
// One invocation a pixel, 8 x 8 a workgroup. Rays are straight lines in index space in both
// projections. Vectors over lattice axes have them in the traversal's order: outermost first.

const TILE: u32 = 8u;

// Sheets rather than slabs (with layers).
override sheets: bool = false;
// Sums of opacities, capped at 1, rather than optical depths (Westover).
override published: bool = false;
override front_to_back: bool = true;
override perspective: bool = false;

struct Gather {
    // Where the ray through the picture's middle meets the plane of reference; w: pixels of that
    // plane over pixels of the focal plane.
    base: vec4<f32>,
    // Index-space step of one pixel to the right and up at the focal plane; of one pixel of depth
    // or, in perspective, from the eye to the focal plane.
    right: vec4<f32>,
    up: vec4<f32>,
    ahead: vec4<f32>,
    // How far kernels reach along each axis, in voxels; w: transmittance below which to stop.
    reach: vec4<f32>,
    // Kernel radius, voxels; tabulated extinction to optical depth per pixel; the same for
    // footprints of a stretched kernel; eye distance in pixels.
    scale: vec4<f32>,
    // Thickness of a layer (slabs: pixels of view depth; sheets: slices), view depth of the plane of
    // reference from the lattice's centre; 0; 0.
    layers: vec4<f32>,
    // The middle of the lattice; w: |det| of the steps below.
    centre: vec4<f32>,
    // View-space steps of one index along each axis, and the lattice's middle in view space.
    view_a: vec4<f32>,
    view_b: vec4<f32>,
    view_c: vec4<f32>,
    view_centre: vec4<f32>,
    // First and last sample along each axis of the bricks that can show; w: picture width, height.
    low: vec4<i32>,
    high: vec4<i32>,
    // Indices at or before the eye along each axis; w: first tile of this piece.
    splits: vec4<i32>,
    // Linear steps of one sample along each axis; w: the tile after the last of this piece.
    strides: vec4<u32>,
    // The same of one brick; w: tiles along a row of the picture.
    bricks: vec4<u32>,
    // Rays along a pixel's side; of the pass that shades samples: the first brick of this piece, and the one
    // after its last; 0.
    piece: vec4<u32>,
}

@group(0) @binding(7) var<uniform> gather: Gather;
@group(0) @binding(11) var light_out: texture_storage_2d<rgba32float, write>;

// Premultiplied light of the pixel's rays that have ended; sums capped in it.
var<private> rays_light: vec4<f32>;
var<private> caps: u32;

struct Ray {
    origin: vec3<f32>,
    // Of length 1 in index space.
    step: vec3<f32>,
    // Pixels of world length per index length.
    length: f32,
    // Where it begins: at the eye.
    begin: f32,
    // Layer coordinate at the origin, and per index length, >= 0: a layer between two integers.
    layer: vec2<f32>,
    // Offset from the picture's middle, pixels at the focal plane, y up.
    pixel: vec2<f32>,
}

// The pixel of an invocation; beyond the picture where there is none.
fn pixel_of(group: vec3<u32>, groups: vec3<u32>, local: vec3<u32>) -> vec2<u32> {
    let within = group.y * groups.x + group.x;
    let tile = u32(gather.splits.w) + within;
    if tile >= gather.strides.w {
        return vec2<u32>(0xffffffffu);
    }
    return vec2<u32>(tile % gather.bricks.w, tile / gather.bricks.w) * TILE + local.xy;
}

fn is_in_picture(pixel: vec2<u32>) -> bool {
    return pixel.x < u32(gather.low.w) && pixel.y < u32(gather.high.w);
}

// One of a pixel's square of rays: one where kernels are a pixel wide.
fn ray_at(pixel: vec2<u32>, number: u32) -> Ray {
    let half = 0.5 * vec2<f32>(f32(gather.low.w), f32(gather.high.w));
    let side = gather.piece.x;
    let part = (vec2<f32>(f32(number % side), f32(number / side)) + 0.5) / f32(side);
    let from_middle = vec2<f32>(pixel) + part - half;
    var out: Ray;
    out.pixel = vec2<f32>(from_middle.x, -from_middle.y);
    let across = gather.right.xyz * out.pixel.x + gather.up.xyz * out.pixel.y;
    out.origin = gather.base.xyz + gather.base.w * across;
    var view_step: f32;
    if perspective {
        let direction = gather.ahead.xyz + across;
        let size = length(direction);
        out.step = direction / size;
        out.length = length(vec3<f32>(out.pixel, gather.scale.w)) / size;
        out.begin = -size * gather.base.w;
        view_step = gather.scale.w / size;
    } else {
        let size = length(gather.ahead.xyz);
        out.step = gather.ahead.xyz / size;
        out.length = 1.0 / size;
        out.begin = -1e30;
        view_step = 1.0 / size;
    }
    let thickness = gather.layers.x;
    if sheets {
        let forwards = select(-1.0, 1.0, out.step.x >= 0.0);
        out.layer = vec2<f32>(forwards * (out.origin.x - gather.centre.x), abs(out.step.x));
    } else {
        out.layer = vec2<f32>(gather.layers.y, view_step);
    }
    // A ray along the sheets stays in one.
    out.layer = vec2<f32>(out.layer.x, max(out.layer.y, 1e-6 * thickness)) / thickness;
    return out;
}

// Where the ray is within reach of samples that can show: from and to, in index lengths.
fn span_of(ray: Ray) -> vec2<f32> {
    var enter = ray.begin;
    var leave = 1e30;
    for (var axis = 0u; axis < 3u; axis++) {
        let low = f32(gather.low[axis]) - gather.reach[axis] - ray.origin[axis];
        let high = f32(gather.high[axis]) + gather.reach[axis] - ray.origin[axis];
        let step = ray.step[axis];
        if abs(step) < 1e-9 {
            if low > 0.0 || high < 0.0 {
                return vec2<f32>(1.0, 0.0);
            }
        } else {
            enter = max(enter, min(low / step, high / step));
            leave = min(leave, max(low / step, high / step));
        }
    }
    return vec2<f32>(enter, leave);
}

// Whether any brick with samples of low..=high (in axis order) can show.
fn any_visible(low: vec3<i32>, high: vec3<i32>) -> bool {
    let first = vec3<u32>(low) / BRICK;
    let last = vec3<u32>(high) / BRICK;
    for (var a = first.x; a <= last.x; a++) {
        for (var b = first.y; b <= last.y; b++) {
            for (var c = first.z; c <= last.z; c++) {
                let index = a * gather.bricks.x + b * gather.bricks.y + c * gather.bricks.z;
                if (visible_bricks[index / 32u] >> (index % 32u) & 1u) != 0u {
                    return true;
                }
            }
        }
    }
    return false;
}

// What a sum of matter hides, capped and counted where opacities were summed.
fn opacity_of(sum: vec4<f32>) -> f32 {
    if published {
        caps += select(0u, 1u, sum.w > 1.0);
        return min(sum.w, 1.0);
    }
    return opacity(sum.w);
}

fn end_ray() {
    lay_rest();
    rays_light += light_of_ray();
}

fn finish(pixel: vec2<u32>) {
    textureStore(light_out, pixel, rays_light / f32(gather.piece.x * gather.piece.x));
    note_ended_loops();
    if published && caps > 0u {
        note_capped(caps);
    }
}

// What a ray has gathered of kernels that are shaded first, with polygons among them, for four samples of its
// pixel at once (lib/light_of_samples.wgsl).
//
// Samples and slices are whole: a polygon has its turn among them as a sample would where the ray meets
// it. What lies between two planes, sheets and slabs, is as dense everywhere there, and is split.

// As gather.wgsl's `front_to_back` has it.
override back_to_front: bool = false;

// See lib/gathered_light.wgsl and lib/kept_samples.wgsl.
const RAYS_SLOT: u32 = 1u;
const RAYS_PART: u32 = 3u;
const CURSOR_PART: u32 = 4u;
// Polygons so near behind a slice count as before it: rounding must not decide, pixel by pixel.
const SLICE_TIE: f32 = 0.00390625;
const BEYOND_ALL: f32 = 3e38;

struct Met {
    polygons: PolygonRay,
}

var<private> gathered: Gathered;
var<private> met: Met;

fn picture_width() -> u32 {
    return u32(gather.low.w);
}

// View depth beyond the lattice's centre, pixels, of a place on a ray, and its growth along it.
fn depth_along(ray: Ray) -> vec2<f32> {
    var slant = 1.0;
    if perspective {
        slant = length(vec3<f32>(ray.pixel / gather.scale.w, 1.0));
    }
    return vec2<f32>(gather.layers.y, ray.length / slant);
}

// Lays matter between two depths, the first on the way first, with the polygons up to there. It is as
// dense everywhere.
fn lay_among(sum: vec4<f32>, ends: vec2<f32>) {
    var light = gathered;
    var on_the_way = met;
    let span = select(ends.y - ends.x, 1.0, ends.y == ends.x);
    // Shares of the matter: what is laid down ends here.
    var begin = 0.0;
    let most = 1u + polygons_left(on_the_way.polygons);
    for (var turn = 0u; turn < most; turn++) {
        let is_polygon = is_polygon_next(on_the_way.polygons, ends.y, 0.0, true);
        let depth = polygon_depth(on_the_way.polygons);
        let end = select(1.0, clamp((depth - ends.x) / span, begin, 1.0), is_polygon);
        let part = sum * (end - begin);
        if part.w > 1e-30 {
            cover(&light, part.xyz / part.w, opacity_of(part));
        }
        if !is_polygon {
            break;
        }
        begin = end;
        lay_polygon(&light, &on_the_way);
    }
    gathered = light;
    met = on_the_way;
}

// Lays a sum of matter over, or under, what there is.
fn lay(sum: vec4<f32>) {
    if sum.w <= 1e-30 {
        return;
    }
    var light = gathered;
    cover(&light, sum.xyz / sum.w, opacity_of(sum));
    gathered = light;
}

// The same of what lies between two planes, as far as the ray has begun there.
fn lay_layer(ray: Ray, sum: vec4<f32>, layer: i32) {
    if sum.w <= 1e-30 {
        return;
    }
    let faces = vec2<f32>(f32(layer), f32(layer + 1));
    let along = max((faces - ray.layer.x) / ray.layer.y, vec2<f32>(ray.begin));
    let depths = depth_along(ray);
    let ends = depths.x + depths.y * along;
    lay_among(sum, select(ends, ends.yx, back_to_front));
}

// Lays down what comes before a slice, which is beyond the eye (scene::Traversal) or before it.
fn lay_before_slice(ray: Ray, slice: i32, is_beyond: bool) {
    let is_upward = ray.step.x > 0.0;
    let way = select(-1.0, 1.0, is_upward);
    let depths = depth_along(ray);
    var depth: f32;
    if abs(ray.step.x) < 1e-9 {
        let is_behind = (f32(slice) > ray.origin.x) == is_beyond;
        depth = select(-BEYOND_ALL, BEYOND_ALL, is_behind);
    } else if perspective && is_beyond != is_upward {
        // Behind the eye.
        depth = select(-BEYOND_ALL, BEYOND_ALL, is_beyond);
    } else {
        let along = (f32(slice) + way * SLICE_TIE - ray.origin.x) / ray.step.x;
        depth = depths.x + depths.y * along;
    }
    lay_among(vec4<f32>(0.0), vec2<f32>(depth));
}

// Nothing behind can be seen any more.
fn is_opaque() -> bool {
    return front_to_back && left_of(gathered) < gather.reach.w;
}

fn lay_rest() {
    let end = select(BEYOND_ALL, -BEYOND_ALL, back_to_front);
    lay_among(vec4<f32>(0.0), vec2<f32>(end));
}

fn begin_light(pixel: vec2<u32>) {
    gathered = NO_LIGHT;
    met = Met(polygon_ray(pixel, vec2<f32>(-BEYOND_ALL, BEYOND_ALL)));
}

fn take_up_light() {
    gathered = kept_light(slot, 0.0);
    let cursor = kept(slot + RAYS_SLOT, CURSOR_PART);
    met.polygons.at = cursor.x;
    met.polygons.left = cursor.y;
}

fn keep_light_of_ray() {
    _ = keep_light(slot, gathered);
    keep(slot + RAYS_SLOT, CURSOR_PART, vec4<u32>(met.polygons.at, met.polygons.left, 0u, 0u));
}

fn light_of_ray() -> vec4<f32> {
    return light_of(gathered);
}

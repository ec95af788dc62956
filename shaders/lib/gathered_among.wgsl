// What a ray has gathered of kernels that are shaded first, with polygons and vectors among them, for four
// samples of its pixel at once (lib/light_of_samples.wgsl).
//
// Samples and slices are whole: a polygon has its turn among them as a sample would where the ray meets
// it, and so has what a slab holds of vectors, in its middle. What lies between two planes is as dense
// everywhere there, and is split by what lies in it: sheets by polygons and by slabs of vectors, slabs by
// polygons, with the vectors that are in the same slab.

// As gather.wgsl's `front_to_back` has it.
override back_to_front: bool = false;

// Polygons so near behind a slice count as before it: rounding must not decide, pixel by pixel.
const SLICE_TIE: f32 = 0.00390625;
const BEYOND_ALL: f32 = 3e38;
struct Met {
    polygons: PolygonRay,
    // What lies between two planes, their depths, the first on the way first, and how much of it is laid
    // down: a share.
    layer: vec4<f32>,
    ends: vec2<f32>,
    laid: f32,
}

var<private> gathered: Gathered;
var<private> met: Met;
var<private> splats: VectorRay;
// Where the ray is on the screen: pixels from its middle, y up.
var<private> at_screen: vec2<f32>;

fn frame_growth() -> f32 {
    return select(0.0, 1.0 / select(1.0, gather.scale.w, perspective), perspective);
}

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

// Whether what a slab holds of vectors is composited together with the kernels in it.
fn shares_slabs() -> bool {
    return layering == 2u && !sheets;
}

fn begin_layer(met: ptr<function, Met>, sum: vec4<f32>, ends: vec2<f32>) {
    (*met).layer = sum;
    (*met).ends = ends;
    (*met).laid = 0.0;
}

// Lays what there is up to a depth down: of the layer, which is as dense everywhere, and of polygons.
fn lay_until(light: ptr<function, Gathered>, met: ptr<function, Met>, depth: f32) {
    let ends = (*met).ends;
    // Of no length, it comes after all that is before it.
    let span = select(ends.y - ends.x, select(1.0, -1.0, back_to_front), ends.y == ends.x);
    let share = select((depth - ends.x) / span, 1.0, depth == ends.y);
    let most = 1u + polygons_left((*met).polygons);
    for (var turn = 0u; turn < most; turn++) {
        let is_polygon = is_polygon_next((*met).polygons, depth, 0.0, true);
        let before = (polygon_depth((*met).polygons) - ends.x) / span;
        let laid = (*met).laid;
        let end = clamp(select(share, before, is_polygon), laid, 1.0);
        let part = (*met).layer * (end - laid);
        if part.w > 1e-30 {
            cover(light, part.xyz / part.w, opacity_of(part));
        }
        (*met).laid = end;
        if !is_polygon {
            break;
        }
        lay_polygon(light, met);
    }
}

// Lays a slab of vectors alone down.
fn lay_vectors(
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    sum: vec4<f32>,
    ends: vec2<f32>,
) {
    if shares_slabs() {
        begin_layer(met, sum, ends);
        lay_until(light, met, ends.y);
    } else if sum.w > 1e-30 {
        lay_until(light, met, 0.5 * (ends.x + ends.y));
        cover(light, sum.xyz / sum.w, opacity_of(sum));
    }
}

// The last slab of vectors whose middle lies before a depth.
fn slab_before(depth: f32) -> i32 {
    let place = clamp(depth / vectors_thickness() - 0.5, -1e9, 1e9);
    return select(i32(ceil(place)) - 1, i32(floor(place)) + 1, back_to_front);
}

// Lays matter between two depths, with what a slab has of vectors, after the slabs before that one.
fn lay_among(sum: vec4<f32>, ends: vec2<f32>, slab: i32) {
    var light = gathered;
    var on_the_way = met;
    var beside_ray = splats;
    begin_layer(&on_the_way, sum, ends);
    let beside = vectors_in(&beside_ray, &light, &on_the_way, slab, at_screen);
    if shares_slabs() {
        begin_layer(&on_the_way, sum + beside, ends);
    } else if VECTORS {
        let middle = (f32(slab) + 0.5) * vectors_thickness();
        lay_vectors(&light, &on_the_way, beside, vec2<f32>(middle));
    }
    lay_until(&light, &on_the_way, ends.y);
    gathered = light;
    met = on_the_way;
    splats = beside_ray;
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
    let on_the_way = select(ends, ends.yx, back_to_front);
    lay_among(sum, on_the_way, select(layer, slab_before(on_the_way.y), sheets));
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
    lay_among(vec4<f32>(0.0), vec2<f32>(depth), slab_before(depth));
}

// Nothing behind can be seen any more.
fn is_opaque() -> bool {
    return front_to_back && left_of(gathered) < gather.reach.w;
}

fn lay_rest() {
    let end = select(BEYOND_ALL, -BEYOND_ALL, back_to_front);
    lay_among(vec4<f32>(0.0), vec2<f32>(end), EVERY_SLAB);
}

fn begin_light(ray: Ray, pixel: vec2<u32>) {
    gathered = NO_LIGHT;
    at_screen = ray.pixel;
    splats = vector_ray(pixel, vec2<f32>(-1e30, 1e30));
    met.polygons = polygon_ray(pixel, vec2<f32>(-BEYOND_ALL, BEYOND_ALL));
}

fn light_of_ray() -> vec4<f32> {
    return light_of(gathered);
}

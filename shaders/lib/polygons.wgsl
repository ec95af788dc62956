// Polygons along a ray: a pixel's fragments, sorted from the eye inwards, each of some of the pixel's four
// samples. All rays of a pixel meet those of the pixel.

const POLYGONS: bool = true;
// Words of a fragment: depth, triangle and samples, opacity, linear red, green, blue.
const FRAGMENT_WORDS: u32 = 6u;

@group(0) @binding(14) var<storage, read> polygon_words: array<u32>;

struct PolygonRay {
    // Word of the next one on the way, and how many there are from it on.
    at: u32,
    left: u32,
    // What lies between these depths is kept.
    kept: vec2<f32>,
}

fn polygon_ray(pixel: vec2<u32>, kept: vec2<f32>) -> PolygonRay {
    let head = 2u * (pixel.y * picture_width() + pixel.x);
    let count = polygon_words[head + 1u];
    let end = polygon_words[head];
    let ways = select(count, 1u, back_to_front);
    return PolygonRay(end - FRAGMENT_WORDS * ways, count, kept);
}

// How many are ahead.
fn polygons_left(ray: PolygonRay) -> u32 {
    return ray.left;
}

fn polygon_depth(ray: PolygonRay) -> f32 {
    return bitcast<f32>(polygon_words[select(0u, ray.at, ray.left > 0u)]);
}

// Whether one comes next on the way to `end`, before a surface at `t` where there is one: from the eye it
// is behind one of the same depth.
fn is_polygon_next(ray: PolygonRay, end: f32, t: f32, is_alone: bool) -> bool {
    let depth = polygon_depth(ray);
    let is_within = select((depth <= end), (depth >= end), back_to_front);
    let is_first = select((depth < t), (depth >= t), back_to_front);
    return ray.left > 0u && is_within && (is_alone || is_first);
}

// Lays the next one down.
fn lay_polygon(light: ptr<function, Gathered>, met: ptr<function, Met>) {
    let at = (*met).polygons.at;
    let depth = bitcast<f32>(polygon_words[at]);
    let opacity = bitcast<f32>(polygon_words[at + 2u]);
    let colour = vec3<f32>(
        bitcast<f32>(polygon_words[at + 3u]),
        bitcast<f32>(polygon_words[at + 4u]),
        bitcast<f32>(polygon_words[at + 5u]),
    );
    let is_kept = depth >= (*met).polygons.kept.x && depth <= (*met).polygons.kept.y;
    cover_samples(light, colour, select(0.0, opacity, is_kept), polygon_words[at + 1u]);
    (*met).polygons.at = select(at + FRAGMENT_WORDS, at - FRAGMENT_WORDS, back_to_front);
    (*met).polygons.left -= 1u;
}

// Triangles in the world, and where they land: what both passes that rasterise them begin with.
//
// Nothing is hidden and nothing tested: each triangle notes a fragment in every pixel of which it covers
// any of four samples, and pixels sort theirs afterwards.

struct Polygons {
    // Of a place about the lattice's centre, in radii of the lattice: pixels to the right, up and into
    // the picture. w: view-space position of the centre, pixels.
    right: vec4<f32>,
    up: vec4<f32>,
    forward: vec4<f32>,
    // Half the picture's width and height; distance of the eye, 0 when orthographic; what is nearer to
    // the eye than this is left out.
    picture: vec4<f32>,
    // Ambient, diffuse, specular, exponent.
    material: vec4<f32>,
    // Unit vectors towards the lights, in the world; their colours.
    towards: array<vec4<f32>, 8>,
    colours: array<vec4<f32>, 8>,
    // Pixels across; all pixels; words that `polygon_words` has; lights.
    counts: vec4<u32>,
}

struct PolygonCorner {
    // About the lattice's centre, in radii of the lattice; w: opacity.
    place: vec4<f32>,
    // Unit, in the world; w: sRGB bytes.
    normal: vec4<f32>,
}

// Words of a fragment: depth, triangle and samples, opacity, linear red, green, blue.
const FRAGMENT_WORDS: u32 = 6u;

@group(0) @binding(0) var<uniform> polygons: Polygons;
@group(0) @binding(1) var<storage, read> corners: array<PolygonCorner>;
// Two words a pixel: where its fragments end, or begin until they are written, and how many there are.
// After all pixels the fragments.
@group(0) @binding(2) var<storage, read_write> polygon_words: array<atomic<u32>>;

struct Landed {
    // Both passes must cover the same pixels.
    @invariant @builtin(position) at: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
}

// View space in pixels, depth beyond the lattice's centre.
fn seen(place: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(polygons.right.xyz, place) + polygons.right.w,
        dot(polygons.up.xyz, place) + polygons.up.w,
        dot(polygons.forward.xyz, place),
    );
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Landed {
    let place = seen(corners[index].place.xyz);
    let half = polygons.picture.xy;
    let eye = polygons.picture.z;
    let depth = place.z + polygons.forward.w;
    // Parallel rays have no beginning.
    var at = vec4<f32>(place.xy / half, 0.5, 1.0);
    if eye > 0.0 {
        at = vec4<f32>(place.xy * (eye / half), depth - polygons.picture.w, depth);
    }
    return Landed(at, index / 3u);
}

// The pixel of a fragment.
fn pixel_of(at: vec4<f32>) -> u32 {
    return u32(at.y) * polygons.counts.x + u32(at.x);
}

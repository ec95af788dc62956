// Lists of scattered kernels: for each tile of the picture the kernels that touch it, in layers.
//
// A layer is a group of neighbouring slabs; there is but one where every kernel is composited on its
// own. An entry's key is its tile and then its layer, in the order of compositing; its word is the
// place of its kernel among the projected ones, which have that order too.

// Pixels along a tile's side.
const TILE: u32 = 8u;
// Slabs in a layer.
const LAYER_SLABS: u32 = 4u;
// Threads in a workgroup of the passes that make the lists.
const LIST_THREADS: u32 = 64u;

// Bound as storage: software adapters compile a shader anew for each value of a uniform that decides
// where it goes.
struct Lists {
    // First column and row of tiles, columns, rows: what part of the picture the lists are for.
    tiles: vec4<u32>,
    // Kernels; entries that fit; bits of a key's layer; entries.
    counts: vec4<u32>,
    // First layer from the front, layers; first row and rows of tiles to composite.
    layers: vec4<i32>,
    // Thickness of a slab in pixels of view depth; the transmittance below which nothing behind can
    // show; half the picture's width and height.
    slabs: vec4<f32>,
}

// Kernels give their integrals to slabs, rather than being composited on their own.
override slabs: bool = false;
override front_to_back: bool = false;
// Opacity times footprint, with sums capped at 1, rather than optical depth.
override published: bool = false;
// 0: a radial kernel, 1: a box, 2: a point.
override shape: u32 = 0u;

// Pixels, along one axis, whose centres lie within `reach` of `middle`: first and after the last.
fn pixels(middle: f32, reach: f32, size: f32) -> vec2<u32> {
    let first = clamp(ceil(middle - reach - 0.5), 0.0, size);
    let end = clamp(floor(middle + reach - 0.5) + 1.0, 0.0, size);
    return vec2<u32>(u32(first), u32(max(end, first)));
}

// Tiles that hold pixels first..end, counted from `origin` and within `count`.
fn tiles(pixels: vec2<u32>, origin: u32, count: u32) -> vec2<u32> {
    let first = max(pixels.x / TILE, origin) - origin;
    let end = max(min((pixels.y + TILE - 1u) / TILE, origin + count), origin) - origin;
    return vec2<u32>(min(first, end), end);
}

// Layers from `low` to `high`, pixels of view depth beyond the lattice's centre, in the order of
// compositing: the first, and how many.
fn layers_between(low: f32, high: f32) -> vec2<u32> {
    let thickness = f32(LAYER_SLABS) * lists.slabs.x;
    let last = lists.layers.y - 1;
    let nearest = clamp(i32(floor(low / thickness)) - lists.layers.x, 0, last);
    let farthest = clamp(i32(floor(high / thickness)) - lists.layers.x, nearest, last);
    return vec2<u32>(
        u32(select(last - farthest, nearest, front_to_back)),
        u32(farthest - nearest + 1),
    );
}

// What a radial kernel touches of a tile: its layers as above, none for a tile beside its ellipse.
// `head`, `first` and `second` are those of `composite_lists`. Never less than what it touches: its
// ellipse is taken for the circle, and the tile for the box about the parallelogram, that the map to
// the unit circle makes of them.
fn touched(head: vec4<f32>, first: vec4<f32>, second: vec4<f32>, tile: vec2<u32>) -> vec2<u32> {
    // From the middle of a tile to the farthest centres of its pixels.
    let half = 0.5 * f32(TILE) - 0.5;
    let down = f32(TILE) * (vec2<f32>(lists.tiles.xy + tile) + 0.5);
    let p = vec2<f32>(down.x - lists.slabs.z, lists.slabs.w - down.y) - head.xy;
    let unit = vec2<f32>(first.x * p.x, first.y * p.x + first.z * p.y);
    let box = half * vec2<f32>(abs(first.x), abs(first.y) + abs(first.z));
    let nearest = max(abs(unit) - box, vec2<f32>(0.0));
    let q = dot(nearest, nearest);
    if !(q < 1.0001) {
        return vec2<u32>(0u);
    }
    if !slabs {
        return vec2<u32>(0u, 1u);
    }
    let middle = head.z + dot(second.xy, p);
    let reach = half * (abs(second.x) + abs(second.y)) + sqrt(max(1.0 - q, 0.0)) / first.w;
    return layers_between(middle - reach, middle + reach);
}

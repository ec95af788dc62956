// What the passes that begin lists write of a kernel: what it is on the screen, and how many tiles and layers it touches.

@group(0) @binding(1) var<storage, read> lists: Lists;
@group(0) @binding(3) var<storage, read_write> counts: array<u32>;
// First column and row of tiles in the lower halves, those after the last in the upper; first layer
// and layers. Columns, rows and layers are counted from the first of the lists.
@group(0) @binding(4) var<storage, read_write> bounds: array<vec4<u32>>;
// Four a kernel; see `composite_lists`.
@group(0) @binding(5) var<storage, read_write> projected: array<vec4<f32>>;
// Word 2: the most entries of a kernel.
@group(0) @binding(6) var<storage, read_write> totals: array<atomic<u32>>;

// Words of `counts` before the first kernel's.
const COUNT_HEADER_WORDS: u32 = 8u;

// What a radial kernel is on the screen, by its ellipse as it is drawn (`wide`: widened to a pixel) and as it was (`narrow`).
struct Footprint {
    // Half its box, in pixels and pixels of depth.
    reach: vec3<f32>,
    // The first of what is told of it; see `composite_lists`.
    first: vec4<f32>,
    // Pixels to the unit circle.
    inverse: vec3<f32>,
}

fn footprint_of(kernel: Projected, narrow: vec4<f32>, wide: vec4<f32>) -> Footprint {
    let reach = frame.radius * vec3<f32>(wide.x, length(wide.yz), length(kernel.row_z));
    let inverse = inverse_of(wide);
    return Footprint(
        reach, vec4<f32>(inverse / frame.radius, 1.0 / (narrow.w * frame.radius)), inverse);
}

// The map from pixels to the unit circle of an ellipse.
fn inverse_of(k: vec4<f32>) -> vec3<f32> {
    return vec3<f32>(1.0 / k.x, -k.y / (k.x * k.z), 1.0 / k.z);
}

// How the middle of a kernel of an ellipse leans: view depth per pixel, once `inverse` has led to its circle.
fn tilt_of(kernel: Projected, narrow: vec4<f32>, inverse: vec3<f32>) -> vec2<f32> {
    // The part of the depth row along the first two.
    let along_x = kernel.row_x / narrow.x;
    let rest = kernel.row_y - along_x * narrow.y;
    let lean = vec2<f32>(
        dot(kernel.row_z, along_x),
        dot(kernel.row_z, rest) / max(length(rest), 1e-30),
    );
    return vec2<f32>(lean.x * inverse.x + lean.y * inverse.y, lean.y * inverse.z);
}

// Writes kernel `slot`, which reaches so far about the middle of `head`.
fn note_kernel(
    slot: u32,
    hidden: bool,
    reach: vec3<f32>,
    head: vec4<f32>,
    first: vec4<f32>,
    second: vec4<f32>,
    last: vec4<f32>,
) {
    if slot == 0u {
        // So that the last kernel's entries have an end.
        counts[COUNT_HEADER_WORDS + lists.counts.x] = 0u;
    }
    let size = 2.0 * frame.half_size;
    let columns = pixels(head.x + frame.half_size.x, reach.x, size.x);
    let rows = pixels(frame.half_size.y - head.y, reach.y, size.y);
    let tile_columns = tiles(columns, lists.tiles.x, lists.tiles.z);
    let tile_rows = tiles(rows, lists.tiles.y, lists.tiles.w);
    var layers = vec2<u32>(0u, 1u);
    if slabs {
        layers = layers_between(head.z - reach.z, head.z + reach.z);
    }
    // False where anything is not a number, too.
    let shows = !hidden && head.w > 0.0 && reach.x >= 0.0 && reach.y >= 0.0
        && columns.y > columns.x && rows.y > rows.x;
    var count = 0u;
    for (var row = tile_rows.x; row < tile_rows.y && shows; row++) {
        for (var column = tile_columns.x; column < tile_columns.y; column++) {
            if shape == 0u {
                layers.y = touched(head, first, second, vec2<u32>(column, row)).y;
            }
            // At most 2^32 - 1: more than ever fits.
            count = select(count + layers.y, 0xffffffffu, count + layers.y < count);
        }
    }
    counts[COUNT_HEADER_WORDS + slot] = count;
    atomicMax(&totals[2], count);
    bounds[slot] = vec4<u32>(
        tile_columns.x | (tile_columns.y << 16u),
        tile_rows.x | (tile_rows.y << 16u),
        layers,
    );
    projected[4u * slot] = head;
    projected[4u * slot + 1u] = first;
    projected[4u * slot + 2u] = second;
    projected[4u * slot + 3u] = last;
}

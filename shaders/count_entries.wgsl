// Projects each record, and counts the tiles and layers that it touches.

@group(0) @binding(1) var<storage, read> lists: Lists;
// `Record`s, back to front.
@group(0) @binding(2) var<storage, read> records: array<u32>;
@group(0) @binding(3) var<storage, read_write> counts: array<u32>;
// First column and row of tiles in the lower halves, those after the last in the upper; first layer
// and layers. Columns, rows and layers are counted from the first of the lists.
@group(0) @binding(4) var<storage, read_write> bounds: array<vec4<u32>>;
// Four a kernel; see `composite_lists`.
@group(0) @binding(5) var<storage, read_write> projected: array<vec4<f32>>;
// Word 2: the most entries of a kernel.
@group(0) @binding(6) var<storage, read_write> totals: array<atomic<u32>>;

const RECORD_WORDS: u32 = 7u;
// Words of `counts` before the first kernel's.
const COUNT_HEADER_WORDS: u32 = 8u;

@compute @workgroup_size(LIST_THREADS)
fn count_entries(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = id.y * groups.x * LIST_THREADS + id.x;
    let total = lists.counts.x;
    if slot >= total {
        return;
    }
    if slot == 0u {
        // So that the last kernel's entries have an end.
        counts[COUNT_HEADER_WORDS + total] = 0u;
    }
    let at = RECORD_WORDS * select(slot, total - 1u - slot, front_to_back);
    let centre = bitcast<vec3<f32>>(vec3<u32>(records[at], records[at + 1u], records[at + 2u]));
    var extinction = bitcast<f32>(records[at + 3u]);
    if published {
        extinction = opacity(extinction);
    }
    let packed = vec3<u32>(records[at + 4u], records[at + 5u], records[at + 6u]);
    let kernel = project(centre, packed);

    var reach: vec3<f32>;
    var matter: f32;
    // What is told of the shape: see `composite_lists`.
    var first = vec4<f32>(0.0);
    var second = vec4<f32>(0.0);
    var third = 0.0;
    var middle = kernel.middle;
    if shape == 0u {
        let narrow = ellipse(kernel);
        let k = widened(narrow);
        reach = frame.radius
            * vec3<f32>(k.x, length(k.yz), length(kernel.row_z));
        matter = optical_depth(extinction, k.w * frame.footprint_scale);
        // The part of the depth row along the first two: how the kernel's middle leans.
        let along_x = kernel.row_x / narrow.x;
        let rest = kernel.row_y - along_x * narrow.y;
        let lean = vec2<f32>(
            dot(kernel.row_z, along_x),
            dot(kernel.row_z, rest) / max(length(rest), 1e-30),
        );
        let inverse = vec3<f32>(1.0 / k.x, -k.y / (k.x * k.z), 1.0 / k.z);
        first = vec4<f32>(inverse / frame.radius, 1.0 / (narrow.w * frame.radius));
        // Of a widened kernel as of the ellipse that is drawn, which keeps it in its own depth.
        second = vec4<f32>(
            lean.x * inverse.x + lean.y * inverse.y, lean.y * inverse.z, 0.0, 0.0);
    } else {
        let volume = dot(kernel.row_x, cross(kernel.row_y, kernel.row_z));
        let ray = cross(kernel.row_x, kernel.row_y) / volume;
        reach = 0.5 * vec3<f32>(
            dot(abs(kernel.row_x), vec3<f32>(1.0)),
            dot(abs(kernel.row_y), vec3<f32>(1.0)),
            dot(abs(kernel.row_z), vec3<f32>(1.0)),
        );
        matter = optical_depth(extinction, 1.0);
        first = vec4<f32>(cross(kernel.row_y, kernel.row_z) / volume, ray.x);
        second = vec4<f32>(cross(kernel.row_z, kernel.row_x) / volume, ray.y);
        third = ray.z;
        if shape == 2u {
            middle = pixel_of_point(middle);
            reach = vec3<f32>(0.25, 0.25, 0.0);
            let across = length(cross(kernel.row_x, kernel.row_y));
            matter = optical_depth(extinction, kernel.determinant / across);
        }
    }

    let size = 2.0 * frame.half_size;
    let columns = pixels(middle.x + frame.half_size.x, reach.x, size.x);
    let rows = pixels(frame.half_size.y - middle.y, reach.y, size.y);
    let tile_columns = tiles(columns, lists.tiles.x, lists.tiles.z);
    let tile_rows = tiles(rows, lists.tiles.y, lists.tiles.w);
    var layers = vec2<u32>(0u, 1u);
    if slabs {
        layers = layers_between(kernel.depth - reach.z, kernel.depth + reach.z);
    }
    // False where anything is not a number, too.
    let shows = !kernel.hidden && matter > 0.0 && reach.x >= 0.0 && reach.y >= 0.0
        && columns.y > columns.x && rows.y > rows.x;
    let head = vec4<f32>(middle, kernel.depth, matter);
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
    projected[4u * slot + 3u] = vec4<f32>(colour_of(packed), third);
}

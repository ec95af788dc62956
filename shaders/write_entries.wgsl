// Writes each kernel's entries, one for every tile and layer that it touches.

@group(0) @binding(0) var<storage, read> lists: Lists;
// Of `count_entries`: where each kernel's entries begin, and what it touches.
@group(0) @binding(1) var<storage, read> offsets: array<u32>;
@group(0) @binding(2) var<storage, read> bounds: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> projected: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> keys: array<u32>;
@group(0) @binding(5) var<storage, read_write> kernels: array<u32>;

// Words of `offsets` before the first kernel's.
const COUNT_HEADER_WORDS: u32 = 8u;

@compute @workgroup_size(LIST_THREADS)
fn write_entries(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = id.y * groups.x * LIST_THREADS + id.x;
    if slot >= lists.counts.x {
        return;
    }
    var at = offsets[COUNT_HEADER_WORDS + slot];
    // Where the next kernel's begin: one that does not show has none.
    var end = offsets[COUNT_HEADER_WORDS + slot + 1u];
    end = min(end, lists.counts.y);
    let columns = vec2<u32>(bounds[slot].x & 0xffffu, bounds[slot].x >> 16u);
    let rows = vec2<u32>(bounds[slot].y & 0xffffu, bounds[slot].y >> 16u);
    var layers = bounds[slot].zw;
    let head = projected[4u * slot];
    let first = projected[4u * slot + 1u];
    let second = projected[4u * slot + 2u];
    for (var row = rows.x; row < rows.y && at < end; row++) {
        for (var column = columns.x; column < columns.y && at < end; column++) {
            if shape == 0u {
                layers = touched(head, first, second, vec2<u32>(column, row));
            }
            let tile = (row * lists.tiles.z + column) << lists.counts.z;
            let after = layers.x + layers.y;
            for (var layer = layers.x; layer < after && at < end; layer++) {
                keys[at] = tile | layer;
                kernels[at] = slot;
                at += 1u;
            }
        }
    }
    // Were a tile's border rounded another way here than where it was counted: to no tile.
    for (; at < end; at++) {
        keys[at] = (lists.tiles.z * lists.tiles.w) << lists.counts.z;
        kernels[at] = slot;
    }
}

// Where each tile's entries begin and end in the sorted lists.

@group(0) @binding(0) var<storage, read> lists: Lists;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
// First and after the last; 0 and 0 for a tile that nothing touches.
@group(0) @binding(2) var<storage, read_write> ranges: array<vec2<u32>>;

@compute @workgroup_size(LIST_THREADS)
fn find_ranges(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let entry = id.y * groups.x * LIST_THREADS + id.x;
    let total = lists.counts.w;
    if entry >= total {
        return;
    }
    let tile = keys[entry] >> lists.counts.z;
    if entry == 0u || (keys[entry - 1u] >> lists.counts.z) != tile {
        ranges[tile].x = entry;
    }
    if entry + 1u == total || (keys[entry + 1u] >> lists.counts.z) != tile {
        ranges[tile].y = entry + 1u;
    }
}

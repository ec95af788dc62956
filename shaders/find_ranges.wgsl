// Where each tile's entries begin and end in the sorted lists.

@group(0) @binding(0) var<storage, read> lists: Lists;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
// First and after the last; 0 and 0 for a tile that nothing touches.
@group(0) @binding(2) var<storage, read_write> ranges: array<vec2<u32>>;
// Word 3: the most whole parts of a tile's entries, not counting the last one.
@group(0) @binding(3) var<storage, read_write> totals: array<atomic<u32>>;

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
    // Entries that a whole number of parts lies before, in the same tile.
    var parts = 0u;
    var before = lists.parts.y;
    while before <= entry && (keys[entry - before] >> lists.counts.z) == tile {
        parts += 1u;
        before += lists.parts.y;
    }
    // A loop, since a software adapter would walk past an `if` with everything in it.
    for (var some = parts > 0u; some; some = false) {
        atomicMax(&totals[3], parts);
    }
}

// How many voxels of each segment have opacity.

// Draw arguments (4 words), 4 unused; then one count a segment.
@group(0) @binding(7) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(SEGMENT_THREADS)
fn count_segments(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let thread = id.y * groups.x * SEGMENT_THREADS + id.x;
    let per_row = traversal.axes.w;
    if thread >= traversal.counts.x * per_row {
        return;
    }
    let segment = segment_at(traversal.splits.w + thread / per_row, thread % per_row);
    var voxel = vec3<i32>(segment.start);
    let c = traversal.axes.z;
    var visible = 0u;
    for (var i = 0u; i < segment.length; i++) {
        visible += select(0u, 1u, classify(linear_index(vec3<u32>(voxel))).w > 0.0);
        voxel[c] += segment.step;
    }
    counts[COUNT_HEADER_WORDS + thread] = visible;
}

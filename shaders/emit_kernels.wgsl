// Writes a record for every voxel with opacity, in drawing order.

@group(0) @binding(7) var<storage, read> offsets: array<u32>;
@group(0) @binding(8) var<storage, read_write> records: array<u32>;

const RECORD_WORDS: u32 = 7u;

@compute @workgroup_size(SEGMENT_THREADS)
fn emit_kernels(
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
    var slot = offsets[COUNT_HEADER_WORDS + thread];
    for (var i = 0u; i < segment.length; i++) {
        let entry = classify(linear_index(vec3<u32>(voxel)));
        if entry.w > 0.0 && slot < traversal.counts.y {
            let at = slot * RECORD_WORDS;
            let centre = vec3<f32>(voxel);
            records[at] = bitcast<u32>(centre.x);
            records[at + 1u] = bitcast<u32>(centre.y);
            records[at + 2u] = bitcast<u32>(centre.z);
            records[at + 3u] = bitcast<u32>(entry.w);
            // Size 1 along each axis, beside the colour's 16-bit fractions.
            records[at + 4u] = 1u | (1u << 16u);
            records[at + 5u] = 1u | (pack2x16unorm(vec2<f32>(entry.x, 0.0)) << 16u);
            records[at + 6u] = pack2x16unorm(entry.yz);
            slot += 1u;
        }
        voxel[c] += segment.step;
    }
}

// Sums each block of counts, for `scan_counts`.

@compute @workgroup_size(THREADS)
fn sum_counts(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = group.y * groups.x + group.x;
    var own = 0u;
    for (var i = 0u; i < RUN; i++) {
        own = added(own, count_at(block * BLOCK + i * THREADS + thread));
    }
    sum_over_threads(thread, own);
    if thread == THREADS - 1u && block < (scan.counts.x + BLOCK - 1u) / BLOCK {
        block_sums[block] = sums[thread];
    }
}

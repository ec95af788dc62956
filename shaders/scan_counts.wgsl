// Turns counts into where each one's own begin, and their sum into a draw's arguments.
//
// A workgroup adds up the blocks before its own, which `sum_counts` has summed, and then the counts within it.

// Over the pieces of a picture: kernels, and the most by which one did not fit.
@group(0) @binding(3) var<storage, read_write> totals: array<u32>;

var<workgroup> block: array<u32, BLOCK>;

@compute @workgroup_size(THREADS)
fn scan_counts(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let before = group.y * groups.x + group.x;
    let first = before * BLOCK;
    var sum = 0u;
    for (var i = thread; i < min(before, arrayLength(&block_sums)); i += THREADS) {
        sum = added(sum, block_sums[i]);
    }
    sum_over_threads(thread, sum);
    let start = sums[THREADS - 1u];
    // Neighbouring threads fetch neighbouring words; then each has a run of them.
    for (var i = thread; i < BLOCK; i += THREADS) {
        block[i] = count_at(first + i);
    }
    workgroupBarrier();
    var own = 0u;
    for (var i = 0u; i < RUN; i++) {
        own = added(own, block[thread * RUN + i]);
    }
    sum_over_threads(thread, own);
    var place = start;
    if thread > 0u {
        place = added(start, sums[thread - 1u]);
    }
    for (var i = 0u; i < RUN; i++) {
        let count = block[thread * RUN + i];
        block[thread * RUN + i] = place;
        place = added(place, count);
    }
    workgroupBarrier();
    for (var i = thread; i < BLOCK; i += THREADS) {
        if first + i < scan.counts.x {
            counts[COUNT_HEADER_WORDS + first + i] = block[i];
        }
    }
    // The last thread of the last block has come to the sum of all.
    let is_last = first < max(scan.counts.x, 1u) && first + BLOCK >= scan.counts.x;
    if thread == THREADS - 1u && is_last {
        let fitting = min(place, scan.counts.y);
        counts[0] = scan.counts.z;
        counts[1] = fitting;
        counts[2] = 0u;
        counts[3] = 0u;
        // A draw by indices has its first instance here.
        counts[4] = 0u;
        totals[0] += fitting;
        totals[1] = max(totals[1], place - fitting);
    }
}

// How often each digit stands in each thread's run of keys.

// Digit by digit, each thread's count.
@group(0) @binding(2) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(SORT_THREADS)
fn count_digits(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let thread = id.y * groups.x * SORT_THREADS + id.x;
    let threads = sort.counts.w;
    if thread >= threads {
        return;
    }
    let first = thread * sort.counts.z;
    let end = min(first + sort.counts.z, sort.counts.x);
    var tally: array<u32, DIGITS>;
    for (var i = first; i < end; i++) {
        tally[digit(keys[i])] += 1u;
    }
    for (var d = 0u; d < DIGITS; d++) {
        counts[COUNT_HEADER_WORDS + d * threads + thread] = tally[d];
    }
}

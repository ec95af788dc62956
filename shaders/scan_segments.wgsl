// Turns the segments' counts into where each begins, and sums them into the draw's arguments.
//
// One workgroup: each thread sums a run, the runs' sums are added up, each thread rewrites its run.

struct Scan {
    // Segments; kernels that fit; vertices, or indices, a splat; 0.
    counts: vec4<u32>,
}

@group(0) @binding(0) var<uniform> scan: Scan;
@group(0) @binding(1) var<storage, read_write> counts: array<u32>;
// Over the pieces of a picture: kernels, and the most by which one did not fit.
@group(0) @binding(2) var<storage, read_write> totals: array<u32>;

// Words of `counts` before the first segment's.
const COUNT_HEADER_WORDS: u32 = 8u;
const THREADS: u32 = 256u;

// Sums that no word holds are 2^32 - 1, which never fits either.
fn added(a: u32, b: u32) -> u32 {
    return select(a + b, 0xffffffffu, a + b < a);
}

var<workgroup> sums: array<u32, THREADS>;

@compute @workgroup_size(THREADS)
fn scan_segments(@builtin(local_invocation_index) thread: u32) {
    let total = scan.counts.x;
    let run = (total + THREADS - 1u) / THREADS;
    let first = min(thread * run, total);
    let end = min(first + run, total);
    var sum = 0u;
    for (var i = first; i < end; i++) {
        sum = added(sum, counts[COUNT_HEADER_WORDS + i]);
    }
    sums[thread] = sum;
    workgroupBarrier();
    var start = 0u;
    for (var i = 0u; i < thread; i++) {
        start = added(start, sums[i]);
    }
    for (var i = first; i < end; i++) {
        let count = counts[COUNT_HEADER_WORDS + i];
        counts[COUNT_HEADER_WORDS + i] = start;
        start = added(start, count);
    }
    if thread == THREADS - 1u {
        counts[0] = scan.counts.z;
        counts[1] = min(start, scan.counts.y);
        counts[2] = 0u;
        counts[3] = 0u;
        // A draw by indices has its first instance here.
        counts[4] = 0u;
        let fitting = min(start, scan.counts.y);
        totals[0] += fitting;
        totals[1] = max(totals[1], start - fitting);
    }
}

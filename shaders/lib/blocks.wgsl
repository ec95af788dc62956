// Counts that are turned into where each one's own begin, by blocks: a workgroup a block.

struct Scan {
    // Counts; kernels that fit; vertices, or indices, a splat; 0.
    counts: vec4<u32>,
}

@group(0) @binding(0) var<uniform> scan: Scan;
@group(0) @binding(1) var<storage, read_write> counts: array<u32>;
// The sum of each block.
@group(0) @binding(2) var<storage, read_write> block_sums: array<u32>;

// Words of `counts` before the first.
const COUNT_HEADER_WORDS: u32 = 8u;
const THREADS: u32 = 256u;
// Neighbouring counts that a thread sums up.
const RUN: u32 = 8u;
const BLOCK: u32 = 2048u;

// Sums that no word holds are 2^32 - 1, which never fits either.
fn added(a: u32, b: u32) -> u32 {
    return select(a + b, 0xffffffffu, a + b < a);
}

fn count_at(index: u32) -> u32 {
    if index >= scan.counts.x {
        return 0u;
    }
    return counts[COUNT_HEADER_WORDS + index];
}

var<workgroup> sums: array<u32, THREADS>;

// Leaves in `sums` what the threads up to each one have together.
fn sum_over_threads(thread: u32, own: u32) {
    sums[thread] = own;
    workgroupBarrier();
    for (var reach = 1u; reach < THREADS; reach *= 2u) {
        var sum = sums[thread];
        if thread >= reach {
            sum = added(sums[thread - reach], sum);
        }
        workgroupBarrier();
        sums[thread] = sum;
        workgroupBarrier();
    }
}

// Stable sort of 32-bit keys with a word each, the lowest digit first: each thread takes a run of
// neighbours in their order, so that no thread waits for another.

// Bits of a digit, and what a digit can be.
const DIGIT_BITS: u32 = 4u;
const DIGITS: u32 = 16u;
// Threads in a workgroup.
const SORT_THREADS: u32 = 64u;
// Words of `counts` before the first count; see `scan_segments`.
const COUNT_HEADER_WORDS: u32 = 8u;

struct Sort {
    // Keys; the digit's lowest bit; keys in a thread's run; threads.
    counts: vec4<u32>,
}

@group(0) @binding(0) var<uniform> sort: Sort;
@group(0) @binding(1) var<storage, read> keys: array<u32>;

fn digit(key: u32) -> u32 {
    return (key >> sort.counts.y) & (DIGITS - 1u);
}

// Rays that end in the dispatch in which they begin: see lib/parts.wgsl.

const IN_PARTS: bool = false;

struct Totals {
    // Word 1: invocations whose loops were ended. Words 2 and 3: sums of opacity that were capped, low word first.
    counts: array<atomic<u32>, 4>,
}

@group(0) @binding(8) var<storage, read_write> totals: Totals;

fn kept(slot: u32, part: u32) -> vec4<u32> {
    return vec4<u32>(0u);
}

fn keep(slot: u32, part: u32, value: vec4<u32>) {}

fn note_waiting(waits: bool) {}

// Rays that are walked in several dispatches, and what is kept of each pixel from one to the next:
// software adapters end the loops of an invocation after 65 535 turns, all loops together
// (gpu::turns).

const IN_PARTS: bool = true;
// Vec4s that are kept of a pixel.
const KEPT_VEC4S: u32 = 5u;

struct Totals {
    // Word 1: invocations whose loops were ended. Words 2 and 3: sums of opacity that were capped, low word
    // first. Word 4: rays among vectors that wait for another dispatch.
    counts: array<atomic<u32>, 8>,
    rays: array<vec4<u32>>,
}

@group(0) @binding(8) var<storage, read_write> totals: Totals;

fn kept(slot: u32, part: u32) -> vec4<u32> {
    return totals.rays[KEPT_VEC4S * slot + part];
}

fn keep(slot: u32, part: u32, value: vec4<u32>) {
    totals.rays[KEPT_VEC4S * slot + part] = value;
}

fn note_waiting(waits: bool) {
    if waits {
        atomicAdd(&totals.counts[4], 1u);
    }
}

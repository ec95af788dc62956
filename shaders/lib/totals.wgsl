// What passes along rays count over a picture.

struct Totals {
    // Words 2 and 3: sums of opacity that were capped, low word first. Word 4: invocations whose loops the
    // adapter has ended. Word 5: 2 where adapters do so, else 0.
    counts: array<atomic<u32>, 8>,
}

@group(0) @binding(8) var<storage, read_write> totals: Totals;

fn note_capped(count: u32) {
    let before = atomicAdd(&totals.counts[2], count);
    if before + count < before {
        atomicAdd(&totals.counts[3], 1u);
    }
}

// Counts an invocation whose loops were ended, and so may have left something out: software adapters end all
// loops of an invocation after 65 535 turns of them together, and each after that turns once.
fn note_ended_loops() {
    let asked = atomicLoad(&totals.counts[5]);
    var turns = 0u;
    while turns < asked {
        turns++;
    }
    if turns < asked {
        atomicAdd(&totals.counts[4], 1u);
    }
}

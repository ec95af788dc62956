// Sorts every pixel's fragments from the eye inwards, those of one depth by their triangles: a total
// order, so that pictures are the same in every bit, whoever came first.
//
// Then leaves out what is hidden. A heap in place: its turns hardly grow faster than the fragments (gpu::polygons bounds these).

const THREADS: u32 = 64u;
const FRAGMENT_WORDS: u32 = 6u;

@group(0) @binding(0) var<storage, read_write> words: array<u32>;
@group(0) @binding(1) var<storage, read_write> sums: array<atomic<u32>, 8>;

fn is_before(a: u32, b: u32) -> bool {
    let depth_a = bitcast<f32>(words[a]);
    let depth_b = bitcast<f32>(words[b]);
    return depth_a < depth_b || (depth_a == depth_b && words[a + 1u] < words[b + 1u]);
}

fn swap_word(a: u32, b: u32) {
    let word = words[a];
    words[a] = words[b];
    words[b] = word;
}

fn swap(a: u32, b: u32) {
    swap_word(a, b);
    swap_word(a + 1u, b + 1u);
    swap_word(a + 2u, b + 2u);
    swap_word(a + 3u, b + 3u);
    swap_word(a + 4u, b + 4u);
    swap_word(a + 5u, b + 5u);
}

@compute @workgroup_size(THREADS)
fn sort_polygons(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let pixel = (group.y * groups.x + group.x) * THREADS + local;
    if pixel >= atomicLoad(&sums[2]) {
        return;
    }
    let count = words[2u * pixel + 1u];
    var end = count;
    // Where they end, since they were written.
    let begin = words[2u * pixel] - FRAGMENT_WORDS * end;
    var heap = end / 2u;
    while end > 1u {
        if heap > 0u {
            heap -= 1u;
        } else {
            end -= 1u;
            swap(begin, begin + FRAGMENT_WORDS * end);
        }
        var root = heap;
        loop {
            var child = 2u * root + 1u;
            if child >= end {
                break;
            }
            let first = begin + FRAGMENT_WORDS * child;
            if child + 1u < end && is_before(first, first + FRAGMENT_WORDS) {
                child += 1u;
            }
            let above = begin + FRAGMENT_WORDS * root;
            let below = begin + FRAGMENT_WORDS * child;
            if !is_before(above, below) {
                break;
            }
            swap(above, below);
            root = child;
        }
    }
    // What lies behind opaque ones on all of its samples is seen by nobody.
    let can_hide = atomicLoad(&sums[3]) != 0u;
    var hidden = 0u;
    var seen = 0u;
    for (var i = 0u; i < count && hidden != 15u; i++) {
        let at = begin + FRAGMENT_WORDS * i;
        let samples = words[at + 1u] & 15u;
        let hides = can_hide && bitcast<f32>(words[at + 2u]) >= 1.0;
        if (samples & ~hidden) != 0u {
            if seen != i {
                swap(begin + FRAGMENT_WORDS * seen, at);
            }
            seen += 1u;
        }
        hidden |= select(0u, samples, hides);
    }
    words[2u * pixel] = begin + FRAGMENT_WORDS * seen;
    words[2u * pixel + 1u] = seen;
    note_ended_loops();
}

// As lib/totals.wgsl has it, in the same words of the sums.
fn note_ended_loops() {
    let asked = atomicLoad(&sums[5]);
    var turns = 0u;
    while turns < asked {
        turns++;
    }
    if turns < asked {
        atomicAdd(&sums[4], 1u);
    }
}

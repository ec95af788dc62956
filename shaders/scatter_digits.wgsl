// Moves each key, with its word, behind those of lesser digits and those before it.

@group(0) @binding(2) var<storage, read> words: array<u32>;
// Where each thread's first key of each digit goes.
@group(0) @binding(3) var<storage, read> offsets: array<u32>;
@group(0) @binding(4) var<storage, read_write> sorted_keys: array<u32>;
@group(0) @binding(5) var<storage, read_write> sorted_words: array<u32>;

@compute @workgroup_size(SORT_THREADS)
fn scatter_digits(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let thread = id.y * groups.x * SORT_THREADS + id.x;
    let threads = sort.counts.w;
    if thread >= threads {
        return;
    }
    var next: array<u32, DIGITS>;
    for (var d = 0u; d < DIGITS; d++) {
        next[d] = offsets[COUNT_HEADER_WORDS + d * threads + thread];
    }
    let first = thread * sort.counts.z;
    let end = min(first + sort.counts.z, sort.counts.x);
    for (var i = first; i < end; i++) {
        let key = keys[i];
        let d = digit(key);
        let slot = next[d];
        next[d] = slot + 1u;
        sorted_keys[slot] = key;
        sorted_words[slot] = words[i];
    }
}

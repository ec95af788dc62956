// Gives every pixel room for its fragments. Which pixel's come first changes nothing: each pixel walks
// its own.

const THREADS: u32 = 64u;
const FRAGMENT_WORDS: u32 = 6u;

@group(0) @binding(0) var<storage, read_write> words: array<u32>;
// Fragments of all pixels, below 2^32; the most of a pixel. Pixels, and whether opaque ones hide what is
// behind them, which the host writes. The most of a pixel of which nothing more is hidden.
@group(0) @binding(1) var<storage, read_write> sums: array<atomic<u32>, 8>;

@compute @workgroup_size(THREADS)
fn place_polygons(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let pixel = (group.y * groups.x + group.x) * THREADS + local;
    let pixels = atomicLoad(&sums[2]);
    if pixel >= pixels {
        return;
    }
    let count = words[2u * pixel + 1u];
    if count > 0u {
        words[2u * pixel] = 2u * pixels + FRAGMENT_WORDS * atomicAdd(&sums[0], count);
        atomicMax(&sums[1], count);
    }
}

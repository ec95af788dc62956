// Shades every sample of the bricks that can show, for all rays that will meet it.

// Samples of a brick that one invocation shades: a column.
const THREADS: u32 = 64u;

// As lib/samples.wgsl reads them.
@group(0) @binding(12) var<storage, read> brick_slots: array<u32>;
@group(0) @binding(13) var<storage, read_write> shaded_samples: array<vec4<f32>>;

@compute @workgroup_size(THREADS)
fn shade_samples(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let index = gather.piece.y + group.y * groups.x + group.x;
    if index >= gather.piece.z {
        return;
    }
    let word = visible_bricks[index / 32u];
    let bit = index % 32u;
    if (word >> bit & 1u) == 0u {
        return;
    }
    let bricks = traversal.bricks.xyz;
    let brick = vec3<u32>(index, index / bricks.x, index / (bricks.x * bricks.y)) % bricks;
    let slot = brick_slots[index / 32u] + countOneBits(word & ((1u << bit) - 1u));
    for (var z = 0u; z < BRICK; z++) {
        let at = brick * BRICK + vec3<u32>(thread % BRICK, thread / BRICK, z);
        if all(at < traversal.dims.xyz) {
            var sample = vec3<i32>(0);
            for (var k = 0u; k < 3u; k++) {
                sample[k] = i32(at[traversal.axes[k]]);
            }
            let place = slot * (THREADS * BRICK) + z * THREADS + thread;
            shaded_samples[place] = classified(sample, linear_index(at));
        }
    }
}

// Samples as `shade_samples` left them: see lib/shaded_samples.wgsl.

const BRICK_SAMPLES: u32 = 512u;

// For each word of `visible_bricks`: how many bricks show before its first.
@group(1) @binding(0) var<storage, read> brick_slots: array<u32>;
// Of each brick that shows, x fastest: linear colour, and density.
@group(1) @binding(1) var<storage, read> shaded_samples: array<vec4<f32>>;

// Linear colour and density of the sample with these indices, outermost axis first.
fn classified(sample: vec3<i32>, linear: u32) -> vec4<f32> {
    var at = vec3<u32>(0u);
    for (var k = 0u; k < 3u; k++) {
        at[traversal.axes[k]] = u32(sample[k]);
    }
    let brick = at / BRICK;
    let index = (brick.z * traversal.bricks.y + brick.y) * traversal.bricks.x + brick.x;
    let word = visible_bricks[index / 32u];
    let bit = index % 32u;
    let before = countOneBits(word & ((1u << bit) - 1u));
    let within = at % BRICK;
    let place = (within.z * BRICK + within.y) * BRICK + within.x;
    let found = shaded_samples[(brick_slots[index / 32u] + before) * BRICK_SAMPLES + place];
    return select(vec4<f32>(0.0), found, (word >> bit & 1u) != 0u);
}

// What a unit of footprint of a classified sample weighs: colour times density, and density.
fn matter(entry: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(entry.xyz * entry.w, entry.w);
}

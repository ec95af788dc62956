// Samples of gathered kernels: as their values classify them, or as `shade_samples` left them.

// They are shaded: `samples0` holds, of each brick that shows, x fastest, linear colour and density as 32-bit
// floats, and `samples1`, for each word of `visible_bricks`, how many bricks show before its first.
override are_shaded: bool = false;

const BRICK_SAMPLES: u32 = 512u;

fn shaded_sample(sample: vec3<i32>) -> vec4<f32> {
    var at = vec3<u32>(0u);
    for (var k = 0u; k < 3u; k++) {
        at[traversal.axes[k]] = u32(sample[k]);
    }
    let brick = at / BRICK;
    let index = (brick.z * traversal.bricks.y + brick.y) * traversal.bricks.x + brick.x;
    let word = visible_bricks[index / 32u];
    let bit = index % 32u;
    if (word >> bit & 1u) == 0u {
        return vec4<f32>(0.0);
    }
    let before = samples1[index / 32u] + countOneBits(word & ((1u << bit) - 1u));
    let within = at % BRICK;
    let place = before * BRICK_SAMPLES + (within.z * BRICK + within.y) * BRICK + within.x;
    return bitcast<vec4<f32>>(vec4<u32>(
        samples0[4u * place],
        samples0[4u * place + 1u],
        samples0[4u * place + 2u],
        samples0[4u * place + 3u],
    ));
}

// Linear colour, and tabulated extinction or density, of the sample with these indices, outermost axis first,
// and this linear one.
fn classified(sample: vec3<i32>, linear: u32) -> vec4<f32> {
    if are_shaded {
        return shaded_sample(sample);
    }
    return classify(linear);
}

// What a unit of footprint of a classified sample weighs: colour times density, and density.
fn matter(entry: vec4<f32>) -> vec4<f32> {
    var density = entry.w;
    if published && !are_shaded {
        density = opacity(density);
    }
    return vec4<f32>(entry.xyz * density, density);
}

// Slabs of vectors with nothing else: see lib/alone_with_polygons.wgsl.

struct Met {
    nothing: u32,
}

fn met_alone(pixel: vec2<u32>) -> Met {
    return Met(0u);
}

// What is kept of it between dispatches.
fn passed_of(met: Met) -> vec2<u32> {
    return vec2<u32>(0u);
}

fn with_passed(met: Met, passed: vec2<u32>) -> Met {
    return met;
}

fn lay_vectors(
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    sum: vec4<f32>,
    ends: vec2<f32>,
) {
    composite(light, sum.rgb / max(sum.a, 1e-30), sum.a);
}

fn lay_rest(light: ptr<function, Gathered>, met: ptr<function, Met>) {}

// Turns of loops that it takes, beside those of what lies in it (gpu::turns).
fn turns_of_slab() -> u32 {
    return 1u;
}

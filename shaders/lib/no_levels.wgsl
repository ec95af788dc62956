// Scenes without isosurfaces: see lib/levels.wgsl.

const LEVELS: bool = false;

fn level_count() -> u32 {
    return 0u;
}

fn meet_levels(
    met: ptr<function, Met>,
    ray: Ray,
    u: vec2<f32>,
    ts: vec2<f32>,
    screen: vec2<f32>,
) -> bool {
    return false;
}

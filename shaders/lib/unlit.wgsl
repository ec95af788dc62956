// Colours shine by themselves, and opacities are by value: what `shade.wgsl` does is left out.

const SHADED: bool = false;

fn face(position: vec3<f32>, direction: vec3<f32>) -> Face {
    return Face(value(position), vec3<f32>(0.0));
}

fn growth_is_late() -> bool {
    return false;
}

fn late_growth(position: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn growth_of_light(position: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn shaded(found: Halves, u: f32, g: Growths, t: f32, screen: vec2<f32>) -> Halves {
    return found;
}

// Isosurfaces are lit.
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

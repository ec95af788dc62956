// Slabs with nothing in them but matter: see lib/surfaces.wgsl.

const SURFACES: bool = false;

struct Met {
    // Nothing is met.
    done: f32,
    polygons: PolygonRay,
}

fn met_along(ray: Ray, part: Part, pixel: vec2<u32>) -> Met {
    return Met(0.0, PolygonRay(0u));
}

// Lays a slab of some length down, in unit distances, with what vectors have `beside`.
fn lay(
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    found: Halves,
    length: f32,
    ends: vec2<f32>,
    beside: vec4<f32>,
) {
    let weight = found.near.w + found.far.w;
    if classify_middle {
        composite_beside(light, found.near.rgb, weight * length, beside);
    } else if published {
        // Opacities are given to slabs: the mean of the two.
        let sum = found.near.rgb * found.near.w + found.far.rgb * found.far.w;
        composite_beside(light, sum / weight, 0.5 * weight * length, beside);
    } else {
        let near = 0.5 * found.near.w * length;
        let far = 0.5 * found.far.w * length;
        composite_beside(light, found.near.rgb, near, 0.5 * beside);
        composite_beside(light, found.far.rgb, far, 0.5 * beside);
    }
}

fn lay_until(light: ptr<function, Gathered>, met: ptr<function, Met>, t: f32) {}

// Lays a slab of vectors alone down.
fn lay_vectors(
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    sum: vec4<f32>,
    ends: vec2<f32>,
) {
    composite(light, sum.rgb / max(sum.a, 1e-30), sum.a);
}

// Turns of loops that it takes, beside those of what lies in it (gpu::turns).
fn turns_of_slab() -> u32 {
    return 1u;
}

// Opacities by regions of the plane of value and gradient strength, in place of those by value, and
// their colours (`transfer::regions` has the definition).

// An override, as it ends a loop.
override region_count: u32 = 0u;

struct Regions {
    // Middle along value, in cells of the slab table, and 1 over half the width; the same along strength.
    places: array<vec4<f32>, 16>,
    // Linear colour; w: opacity.
    looks: array<vec4<f32>, 16>,
    // 1 over the softness; 1 for an ellipse; 1 for a triangle; 1 where the colour is that of the value.
    shapes: array<vec4<f32>, 16>,
}

// Uniform: no branch depends on it.
@group(0) @binding(10) var<uniform> regions: Regions;

// A slab as the regions paint it, by its value and the strength of its gradient.
fn painted(found: Halves, u: f32, strength: f32) -> Halves {
    // Of the colours that regions have of their own, times extinction; extinction of the others.
    var own = vec3<f32>(0.0);
    var by_value = 0.0;
    var depth = 0.0;
    for (var i = 0u; i < region_count; i++) {
        let place = regions.places[i];
        let look = regions.looks[i];
        let shape = regions.shapes[i];
        let x = abs((u - place.x) * place.y);
        let y = (strength - place.z) * place.w;
        let in_box = max(x, abs(y));
        // Nothing is below a triangle's lower corner.
        let in_triangle = max(x / max(0.5 + 0.5 * y, 1e-6), y);
        let bent = select(in_box, length(vec2<f32>(x, y)), shape.y > 0.5);
        let way = select(bent, in_triangle, shape.z > 0.5);
        let alpha = look.w * clamp((1.0 - way) * shape.x, 0.0, 1.0);
        let part = -log(1.0 - min(alpha, 0.9999));
        depth += part;
        own += look.rgb * select(part, 0.0, shape.w > 0.5);
        by_value += select(0.0, part, shape.w > 0.5);
    }
    let weight = select(depth, 1.0 - exp(-depth), published) * shade.world_z.w;
    let share = 1.0 / max(depth, 1e-30);
    let near = (own + by_value * found.near.rgb) * share;
    let far = (own + by_value * found.far.rgb) * share;
    return Halves(vec4<f32>(near, found.near.w * weight), vec4<f32>(far, found.far.w * weight));
}

// Opacities are by value, or by a table: see lib/regions.wgsl.

fn painted(found: Halves, u: f32, strength: f32) -> Halves {
    return found;
}

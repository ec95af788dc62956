// Scenes without vectors: see lib/vectors.wgsl.

const VECTORS: bool = false;
const EVERY_SLAB: i32 = 0;

struct VectorRay {
    nothing: u32,
}

fn vector_ray(pixel: vec2<u32>, kept: vec2<f32>) -> VectorRay {
    return VectorRay(0u);
}

fn vectors_thickness() -> f32 {
    return 1.0;
}

fn lay_slabs_before(
    ray: ptr<function, VectorRay>,
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    slab: i32,
) {}

fn take_slab(ray: ptr<function, VectorRay>, slab: i32) -> vec4<f32> {
    return vec4<f32>(0.0);
}

fn next_layer(ray: VectorRay) -> i32 {
    return EVERY_SLAB;
}

fn field_slab(slab: i32) -> i32 {
    return slab;
}

fn slab_of_vectors(slab: i32) -> i32 {
    return slab;
}

fn sum_next_layer(ray: ptr<function, VectorRay>, screen: vec2<f32>) {}

fn vectors_in(
    ray: ptr<function, VectorRay>,
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    slab: i32,
    screen: vec2<f32>,
) -> vec4<f32> {
    return vec4<f32>(0.0);
}

fn composite_beside(
    light: ptr<function, Gathered>,
    colour: vec3<f32>,
    amount: f32,
    beside: vec4<f32>,
) {
    composite(light, colour, amount);
}

// What a ray has gathered where there is nothing but kernels: see lib/gathered_among.wgsl.

// Premultiplied light of the ray so far.
var<private> light: vec4<f32>;

// Lays a sum of matter over, or under, what there is.
fn lay(sum: vec4<f32>) {
    if sum.w <= 1e-30 {
        return;
    }
    let alpha = opacity_of(sum);
    let layer = vec4<f32>(sum.xyz * (alpha / sum.w), alpha);
    if front_to_back {
        light += (1.0 - light.w) * layer;
    } else {
        light = layer + (1.0 - alpha) * light;
    }
}

// The same of what lies between two planes.
fn lay_layer(ray: Ray, sum: vec4<f32>, layer: i32) {
    lay(sum);
}

// What comes before a slice.
fn lay_before_slice(ray: Ray, slice: i32, is_beyond: bool) {}

fn lay_rest() {}

// Nothing behind can be seen any more.
fn is_opaque() -> bool {
    return front_to_back && 1.0 - light.w < gather.reach.w;
}

fn begin_light(ray: Ray, pixel: vec2<u32>) {
    light = vec4<f32>(0.0);
}

fn light_of_ray() -> vec4<f32> {
    return light;
}

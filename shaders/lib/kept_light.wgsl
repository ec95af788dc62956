// What is kept of a ray's light between dispatches.

// Places of a pixel in what is kept.
const SLOTS: u32 = 1u;

// `beside` is what was kept beside the values.
fn kept_light(slot: u32, beside: f32) -> Gathered {
    let done = bitcast<vec4<f32>>(kept(slot, 0u));
    return Gathered(done.rgb, beside, done.a);
}

// Returns what is to be kept beside the values.
fn keep_light(slot: u32, light: Gathered) -> f32 {
    keep(slot, 0u, bitcast<vec4<u32>>(vec4<f32>(light.colour, light.alpha)));
    return light.transmittance;
}

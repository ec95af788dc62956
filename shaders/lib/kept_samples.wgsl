// What is kept of the light of a pixel's samples between dispatches: see lib/light_of_samples.wgsl.

// Places of a pixel in what is kept.
const SLOTS: u32 = 2u;

fn kept_light(slot: u32, beside: f32) -> Gathered {
    return Gathered(
        bitcast<vec4<f32>>(kept(slot, 0u)),
        bitcast<vec4<f32>>(kept(slot, 4u)),
        bitcast<vec4<f32>>(kept(slot + 1u, 0u)),
        bitcast<vec4<f32>>(kept(slot + 1u, 1u)),
        bitcast<vec4<f32>>(kept(slot + 1u, 2u)),
    );
}

fn keep_light(slot: u32, light: Gathered) -> f32 {
    keep(slot, 0u, bitcast<vec4<u32>>(light.red));
    keep(slot, 4u, bitcast<vec4<u32>>(light.green));
    keep(slot + 1u, 0u, bitcast<vec4<u32>>(light.blue));
    keep(slot + 1u, 1u, bitcast<vec4<u32>>(light.transmittance));
    keep(slot + 1u, 2u, bitcast<vec4<u32>>(light.alpha));
    return 0.0;
}

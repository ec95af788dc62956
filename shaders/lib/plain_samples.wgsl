// Samples as their values classify them: see lib/shaded_samples.wgsl.

// Linear colour and tabulated extinction of the sample with these indices, outermost axis first, and
// this linear one.
fn classified(sample: vec3<i32>, linear: u32) -> vec4<f32> {
    return classify(linear);
}

// What a unit of footprint of a classified sample weighs: colour times density, and density.
fn matter(entry: vec4<f32>) -> vec4<f32> {
    var density = entry.w;
    if published {
        density = opacity(density);
    }
    return vec4<f32>(entry.xyz * density, density);
}

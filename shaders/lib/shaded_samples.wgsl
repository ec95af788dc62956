// Westover's shading process: each sample is lit, and looked up in tables, before its kernel is drawn.
//
// It has the gradient of the samples beside it, and is seen from where it stands itself.

// The two halves of a slab, of which a sample has only one.
struct Halves {
    near: vec4<f32>,
    far: vec4<f32>,
}

// The growths on the two faces of a slab, of which a sample has one at its place.
struct Growths {
    near: vec3<f32>,
    far: vec3<f32>,
}

// As it is stored.
fn stored(linear: u32) -> f32 {
    let chunk = linear / traversal.bricks.w;
    let within = linear - chunk * traversal.bricks.w;
    if traversal.dims.w == 1u {
        return f32(sample_word(chunk, within / 4u) >> (8u * (within % 4u)) & 0xffu);
    }
    if traversal.dims.w == 2u {
        return f32(sample_word(chunk, within / 2u) >> (16u * (within % 2u)) & 0xffffu);
    }
    return bitcast<f32>(sample_word(chunk, within));
}

// Growth along an axis: between the samples on both sides, to one where the other is missing or has no
// data, and none where both are.
fn growth_along(k: u32, sample: vec3<i32>, linear: u32, here: f32) -> f32 {
    let count = i32(traversal.dims[traversal.axes[k]]);
    let stride = gather.strides[k];
    var before = here;
    var after = here;
    var steps = 0.0;
    if sample[k] > 0 {
        let found = stored(linear - stride);
        let has_data = found > NO_DATA;
        before = select(here, found, has_data);
        steps += select(0.0, 1.0, has_data);
    }
    if sample[k] + 1 < count {
        let found = stored(linear + stride);
        let has_data = found > NO_DATA;
        after = select(here, found, has_data);
        steps += select(0.0, 1.0, has_data);
    }
    return (after - before) / max(steps, 1.0);
}

// Linear colour and density, extinction or opacity, of the sample with these indices, outermost axis
// first, and this linear one.
fn classified(sample: vec3<i32>, linear: u32) -> vec4<f32> {
    let entry = classify(linear);
    let here = stored(linear);
    // Samples without data are as they are: they have neither a value nor a gradient.
    if entry.w <= 0.0 || here <= NO_DATA {
        return vec4<f32>(entry.xyz, select(entry.w, opacity(entry.w), published));
    }
    var growth = vec3<f32>(0.0);
    if uses_gradient {
        for (var k = 0u; k < 3u; k++) {
            growth[traversal.axes[k]] = growth_along(k, sample, linear, here);
        }
    }
    let from_centre = vec3<f32>(sample) - gather.centre.xyz;
    let view = gather.view_centre.xyz
        + gather.view_a.xyz * from_centre.x
        + gather.view_b.xyz * from_centre.y
        + gather.view_c.xyz * from_centre.z;
    var screen = view.xy;
    if perspective {
        // Those behind the eye show nothing.
        screen *= gather.scale.w / max(view.z, gather.scale.w * 1e-3);
    }
    let density = select(entry.w, opacity(entry.w), published);
    let half = vec4<f32>(entry.xyz, density);
    let depth = view.z - gather.view_centre.z;
    return shaded(Halves(half, half), here, Growths(growth, growth), depth, screen).near;
}

// Faces of a field of tents, for quick pictures: values, and the derivative within the cell from the
// same samples.

// A sample, and half the width about it where there are such.
fn sample(index: u32) -> vec2<f32> {
    if has_widths {
        return mean_and_width(index);
    }
    return vec2<f32>(two(index).x, 0.0);
}

fn face(position: vec3<f32>) -> Face {
    let floored = floor(position);
    let f = position - floored;
    let i = stored_index(vec3<i32>(floored));
    let j = i + slabs.stored.x;
    let plane = slabs.stored.x * slabs.stored.y;
    // Four rows along x: beginnings, and growth.
    let a = sample(i);
    let b = sample(j);
    let c = sample(i + plane);
    let d = sample(j + plane);
    let da = sample(i + 1u) - a;
    let db = sample(j + 1u) - b;
    let dc = sample(i + plane + 1u) - c;
    let dd = sample(j + plane + 1u) - d;
    let dx = mix(mix(da, db, f.y), mix(dc, dd, f.y), f.z);
    let near_low = a + da * f.x;
    let near_high = b + db * f.x;
    let far_low = c + dc * f.x;
    let far_high = d + dd * f.x;
    let dy = mix(near_high - near_low, far_high - far_low, f.z);
    let near = mix(near_low, near_high, f.y);
    let dz = mix(far_low, far_high, f.y) - near;
    let found = near + dz * f.z;
    let u = slabs.table.x + slabs.table.y * found.x;
    let growth = slabs.table.y * vec3<f32>(dx.x, dy.x, dz.x);
    return Face(vec2<f32>(u, slabs.table.y * found.y), growth);
}


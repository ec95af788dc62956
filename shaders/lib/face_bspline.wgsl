// Faces of a field of B-splines: values, and their derivative from the same samples.

fn bspline_slopes(f: f32) -> vec4<f32> {
    let g = 1.0 - f;
    return vec4<f32>(-0.5 * g * g, f * (1.5 * f - 2.0), g * (2.0 - 1.5 * g), 0.5 * f * f);
}

// Value and growth along x of a row of four.
fn row4_slope(index: u32, w: vec4<f32>, s: vec4<f32>) -> vec2<f32> {
    let row = vec4<f32>(two(index), two(index + 2u));
    return vec2<f32>(dot(row, w), dot(row, s));
}

// Growth along x and y, and value, of a plane of four by four.
fn plane4_slope(
    index: u32,
    wx: vec4<f32>, sx: vec4<f32>,
    wy: vec4<f32>, sy: vec4<f32>,
) -> vec3<f32> {
    let row = slabs.stored.x;
    let a = row4_slope(index, wx, sx);
    let b = row4_slope(index + row, wx, sx);
    let c = row4_slope(index + 2u * row, wx, sx);
    let d = row4_slope(index + 3u * row, wx, sx);
    let values = vec4<f32>(a.x, b.x, c.x, d.x);
    return vec3<f32>(dot(vec4<f32>(a.y, b.y, c.y, d.y), wy), dot(values, sy), dot(values, wy));
}

fn face(position: vec3<f32>) -> Face {
    let floored = floor(position);
    let f = position - floored;
    let wx = bspline_weights(f.x);
    let wy = bspline_weights(f.y);
    let sx = bspline_slopes(f.x);
    let sy = bspline_slopes(f.y);
    let i = stored_index(vec3<i32>(floored) - vec3<i32>(1));
    let plane = slabs.stored.x * slabs.stored.y;
    let planes = mat4x3<f32>(
        plane4_slope(i, wx, sx, wy, sy),
        plane4_slope(i + plane, wx, sx, wy, sy),
        plane4_slope(i + 2u * plane, wx, sx, wy, sy),
        plane4_slope(i + 3u * plane, wx, sx, wy, sy),
    );
    let across = planes * bspline_weights(f.z);
    let along = planes * bspline_slopes(f.z);
    let u = slabs.table.x + slabs.table.y * across.z;
    return Face(vec2<f32>(u, 0.0), slabs.table.y * vec3<f32>(across.xy, along.z));
}


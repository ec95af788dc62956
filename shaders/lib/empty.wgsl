// Where nothing can show, and how far a ray may leap there.

// Edge of a brick of `empty`, voxels.
const EMPTY_BRICK: i32 = 4;

// The greatest depth in cells that is told, in steps: `cells::Depths`.
const MOST_DEPTH: f32 = 3.0;

// How deep a sample lies in the cells that the field is of, in steps, less than 0 outside; beyond the lattice as much less as
// that is far.
fn depth_of(sample: vec3<i32>) -> f32 {
    let at = clamp(sample, vec3<i32>(0), vec3<i32>(slabs.dims.xyz) - vec3<i32>(1));
    let index = (u32(at.z) * slabs.dims.y + u32(at.y)) * slabs.dims.x + u32(at.x);
    let four = unpack4x8snorm(empty[slabs.more.z + index / 4u]);
    return MOST_DEPTH * four[index % 4u] - length(vec3<f32>(sample - at));
}

// The same by tents between samples, in w, and in xyz its growth.
fn depth_at(position: vec3<f32>) -> vec4<f32> {
    let floored = floor(position);
    let f = position - floored;
    let i = vec3<i32>(floored);
    let near = vec4<f32>(
        depth_of(i),
        depth_of(i + vec3<i32>(1, 0, 0)),
        depth_of(i + vec3<i32>(0, 1, 0)),
        depth_of(i + vec3<i32>(1, 1, 0)),
    );
    let far = vec4<f32>(
        depth_of(i + vec3<i32>(0, 0, 1)),
        depth_of(i + vec3<i32>(1, 0, 1)),
        depth_of(i + vec3<i32>(0, 1, 1)),
        depth_of(i + vec3<i32>(1, 1, 1)),
    );
    let along_z = mix(near, far, f.z);
    let along_y = mix(along_z.xy, along_z.zw, f.y);
    let rise_y = along_z.zw - along_z.xy;
    let rise_z = mix((far - near).xy, (far - near).zw, f.y);
    return vec4<f32>(
        along_y.y - along_y.x,
        mix(rise_y.x, rise_y.y, f.x),
        mix(rise_z.x, rise_z.y, f.x),
        mix(along_y.x, along_y.y, f.x),
    );
}

fn is_hole(position: vec3<f32>) -> bool {
    if has_depths {
        return depth_at(position).w < 0.0;
    }
    let at = vec3<u32>(nearest(position));
    let index = (at.z * slabs.dims.y + at.y) * slabs.dims.x + at.x;
    let bits = empty[slabs.more.z + index / 32u];
    return (bits >> (index % 32u) & 1u) == 1u;
}

// Rays along the side of a pixel: where something small lies in it, more than elsewhere.
fn rays_along_side(pixel: vec2<u32>) -> u32 {
    let index = pixel.y * slabs.tiles.z + pixel.x;
    let bits = empty[(slabs.more.w & 0x0fffffffu) + index / 32u];
    let is_marked = slabs.more.w != 0u && (bits >> (index % 32u) & 1u) == 1u;
    return select(slabs.more.y, slabs.more.w >> 28u, is_marked);
}

// The brick that a position lies in, or is next to.
fn brick_at(position: vec3<f32>) -> u32 {
    let brick = vec3<u32>(clamp((position + 0.5) * 0.25, vec3<f32>(0.0), vec3<f32>(slabs.bricks.xyz) - 0.5));
    return (brick.z * slabs.bricks.y + brick.y) * slabs.bricks.x + brick.x;
}

fn distance_at(position: vec3<f32>) -> i32 {
    let index = brick_at(position);
    return i32(empty[index / 4u] >> (8u * (index % 4u)) & 0xffu);
}

// How far a ray goes on from a position before it leaves the bricks nearer than `distance`.
fn leap(position: vec3<f32>, distance: i32, inverse: vec3<f32>) -> f32 {
    let brick = floor((position + 0.5) * 0.25);
    let reach = f32(distance) * f32(EMPTY_BRICK);
    let low = brick * f32(EMPTY_BRICK) - 0.5;
    let exit = select(low + f32(EMPTY_BRICK) - reach, low + reach, inverse > vec3<f32>(0.0));
    let t = (exit - position) * inverse;
    return min(t.x, min(t.y, t.z));
}

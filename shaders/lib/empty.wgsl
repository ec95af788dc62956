// Where nothing can show, and how far a ray may leap there.

// Edge of a brick of `empty`, voxels.
const EMPTY_BRICK: i32 = 4;

fn is_hole(position: vec3<f32>) -> bool {
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

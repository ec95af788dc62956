// Composites the slabs of vectors alone, one invocation a pixel.

const TILE: u32 = 8u;

// Opacity times footprint, with sums capped at 1, rather than optical depth.
override published: bool = false;
override back_to_front: bool = false;

struct VectorTiles {
    // First tile, tiles across, picture width, picture height.
    tiles: vec4<u32>,
    // Tiles in this piece, planes that cut; 0.
    more: vec4<u32>,
    // Growth of the rays per pixel of depth, 0 when orthographic, and the scale of a pixel at depth 0; 0.
    rays: vec4<f32>,
    // What is kept: products with a place to the right and up, at depth 0, and with its depth, and 1, that add up to 0 or more.
    clip: array<vec4<f32>, 12>,
}

@group(0) @binding(0) var<storage, read> piece: VectorTiles;
@group(0) @binding(1) var picture: texture_storage_2d<rgba32float, write>;

fn frame_growth() -> f32 {
    return piece.rays.x;
}

fn picture_width() -> u32 {
    return piece.tiles.z;
}

// Depths between which anything of a ray is kept.
fn kept_alone(screen: vec2<f32>) -> vec2<f32> {
    var ends = vec2<f32>(-1e30, 1e30);
    for (var i = 0u; i < piece.more.y; i++) {
        let plane = piece.clip[i];
        let side = dot(plane.xy, screen);
        let height = plane.w + side * piece.rays.y;
        let growth = plane.z + side * piece.rays.x;
        // A ray along a plane is on one side of it.
        let is_along = abs(growth) < 1e-20;
        let t = -height / select(growth, 1.0, is_along);
        ends.x = select(ends.x, max(ends.x, t), !is_along && growth > 0.0);
        ends.y = select(ends.y, min(ends.y, t), !is_along && growth < 0.0);
        ends.y = select(ends.y, -1e30, is_along && height < 0.0);
    }
    return ends;
}

@compute @workgroup_size(TILE, TILE)
fn composite_vectors(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
) {
    let within = group.y * groups.x + group.x;
    let tile = piece.tiles.x + within;
    let pixel = vec2<u32>(tile % piece.tiles.y, tile / piece.tiles.y) * TILE + local.xy;
    if within >= piece.more.x || pixel.x >= piece.tiles.z || pixel.y >= piece.tiles.w {
        return;
    }
    let down = vec2<f32>(pixel) + 0.5;
    let half = 0.5 * vec2<f32>(piece.tiles.zw);
    var light = NO_LIGHT;
    let screen = vec2<f32>(down.x - half.x, half.y - down.y);
    let kept = kept_alone(screen);
    var met = met_alone(pixel, kept);
    var ray = vector_ray(pixel, kept);
    _ = vectors_in(&ray, &light, &met, EVERY_SLAB, screen);
    lay_rest(&light, &met);
    textureStore(picture, pixel, light_of(light));
    note_ended_loops();
}

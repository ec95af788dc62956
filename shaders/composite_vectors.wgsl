// Composites the slabs of vectors alone, one invocation a pixel.

const TILE: u32 = 8u;

// Opacity times footprint, with sums capped at 1, rather than optical depth.
override published: bool = false;
override back_to_front: bool = false;

struct VectorTiles {
    // First tile, tiles across, picture width, picture height.
    tiles: vec4<u32>,
    // Tiles in this piece; 0.
    more: vec4<u32>,
    // Growth of the rays per pixel of depth, 0 when orthographic.
    rays: vec4<f32>,
}

@group(0) @binding(0) var<storage, read> piece: VectorTiles;
@group(0) @binding(1) var picture: texture_storage_2d<rgba32float, write>;

fn frame_growth() -> f32 {
    return piece.rays.x;
}

fn picture_width() -> u32 {
    return piece.tiles.z;
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
    var met = met_alone(pixel);
    var ray = vector_ray(pixel, vec2<f32>(-1e30, 1e30));
    let screen = vec2<f32>(down.x - half.x, half.y - down.y);
    _ = vectors_in(&ray, &light, &met, EVERY_SLAB, screen);
    lay_rest(&light, &met);
    textureStore(picture, pixel, light_of(light));
    note_ended_loops();
}

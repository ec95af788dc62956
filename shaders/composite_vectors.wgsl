// Composites the slabs of vectors alone, one invocation a pixel.

const TILE: u32 = 8u;

// Opacity times footprint, with sums capped at 1, rather than optical depth.
override published: bool = false;
override back_to_front: bool = false;

struct VectorTiles {
    // First tile, tiles across, picture width, picture height.
    tiles: vec4<u32>,
    // Tiles in this piece. Of rays that are walked in several dispatches, turns of their loops in this one;
    // bit 0, it goes on where the one before ended; bit 1, it ends the rays.
    more: vec4<u32>,
    // Growth of the rays per pixel of depth, 0 when orthographic.
    rays: vec4<f32>,
}

@group(0) @binding(0) var<storage, read> piece: VectorTiles;
@group(0) @binding(1) var picture: texture_storage_2d<rgba32float, write>;

// Places of a pixel in what is kept between dispatches: its light and its vectors'.
const PLACES: u32 = SLOTS + VECTOR_PLACES;
// Where, in the last place of its light, stands what is laid down.
const PASSED_PART: u32 = 4u;
// Rays wait for the next dispatch where the splats in one are too many.
const PAUSES: bool = IN_PARTS;

fn most_vector_turns() -> u32 {
    return piece.more.y;
}

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
    let within = group.x * groups.y + group.y;
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
    let slot = PLACES * ((within * TILE + local.y) * TILE + local.x);
    if IN_PARTS && (piece.more.z & 1u) != 0u {
        light = kept_light(slot, bitcast<f32>(kept(slot, 1u).x));
        met = with_passed(met, kept(slot + SLOTS - 1u, PASSED_PART).xy);
        var words: array<vec4<u32>, 5>;
        for (var i = 0u; i < 5u; i++) {
            words[i] = kept(slot + SLOTS, i);
        }
        ray = with_words(ray, words);
    }
    let beyond = vectors_in(&ray, &light, &met, EVERY_SLAB, screen);
    if IN_PARTS && (piece.more.z & 2u) == 0u {
        let transmittance = keep_light(slot, light);
        keep(slot, 1u, vec4<u32>(bitcast<u32>(transmittance), 0u, 0u, 0u));
        keep(slot + SLOTS - 1u, PASSED_PART, vec4<u32>(passed_of(met), 0u, 0u));
        var words = words_of(ray);
        for (var i = 0u; i < 5u; i++) {
            keep(slot + SLOTS, i, words[i]);
        }
        note_waiting(ray.is_late);
    } else {
        lay_rest(&light, &met);
        textureStore(picture, pixel, light_of(light));
    }
    note_ended_loops();
}

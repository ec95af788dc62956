// Projects each record, and counts the tiles and layers that it touches.

// `Record`s, back to front.
@group(0) @binding(2) var<storage, read> records: array<u32>;

const RECORD_WORDS: u32 = 7u;

@compute @workgroup_size(LIST_THREADS)
fn count_entries(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = id.y * groups.x * LIST_THREADS + id.x;
    let total = lists.counts.x;
    if slot >= total {
        return;
    }
    let at = RECORD_WORDS * select(slot, total - 1u - slot, front_to_back);
    let centre = bitcast<vec3<f32>>(vec3<u32>(records[at], records[at + 1u], records[at + 2u]));
    var extinction = bitcast<f32>(records[at + 3u]);
    if published {
        extinction = opacity(extinction);
    }
    let packed = vec3<u32>(records[at + 4u], records[at + 5u], records[at + 6u]);
    let kernel = project(centre, packed);

    var reach: vec3<f32>;
    var matter: f32;
    // What is told of the shape: see `composite_lists`.
    var first = vec4<f32>(0.0);
    var second = vec4<f32>(0.0);
    var third = 0.0;
    var middle = kernel.middle;
    if shape == 0u {
        let narrow = ellipse(kernel);
        let k = widened(narrow);
        let drawn = footprint_of(kernel, narrow, k);
        reach = drawn.reach;
        matter = optical_depth(extinction, k.w * frame.footprint_scale);
        first = drawn.first;
        // Of a widened kernel as of the ellipse that is drawn, which keeps it in its own depth.
        second = vec4<f32>(tilt_of(kernel, narrow, drawn.inverse), 0.0, 0.0);
    } else {
        let volume = dot(kernel.row_x, cross(kernel.row_y, kernel.row_z));
        let ray = cross(kernel.row_x, kernel.row_y) / volume;
        reach = 0.5 * vec3<f32>(
            dot(abs(kernel.row_x), vec3<f32>(1.0)),
            dot(abs(kernel.row_y), vec3<f32>(1.0)),
            dot(abs(kernel.row_z), vec3<f32>(1.0)),
        );
        matter = optical_depth(extinction, 1.0);
        first = vec4<f32>(cross(kernel.row_y, kernel.row_z) / volume, ray.x);
        second = vec4<f32>(cross(kernel.row_z, kernel.row_x) / volume, ray.y);
        third = ray.z;
        if shape == 2u {
            middle = pixel_of_point(middle);
            reach = vec3<f32>(0.25, 0.25, 0.0);
            let across = length(cross(kernel.row_x, kernel.row_y));
            matter = optical_depth(extinction, kernel.determinant / across);
        }
    }

    let head = vec4<f32>(middle, kernel.depth, matter);
    note_kernel(slot, kernel.hidden, reach, head, first, second, vec4<f32>(colour_of(packed), third));
}

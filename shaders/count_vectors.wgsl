// Projects each vector splat, and counts the tiles and layers that it touches.
//
// What it writes of a splat is what `count_entries` writes of a radial kernel, so that the lists are
// made the same way: see `composite_lists`. But the second vec4 holds, behind the tilt, the direction of
// the flow on the unit circle, and the third what `lib/vectors.wgsl` takes apart again.

// `vector::Splat`s, each followed by its own steps of the grid where it has them.
@group(0) @binding(2) var<storage, read> records: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> vectors: Vectors;

// View-space step, in pixels, of a step in units along the world's axes.
fn in_view(step: vec3<f32>) -> vec3<f32> {
    return frame.view_x.xyz * step.x + frame.view_y.xyz * step.y + frame.view_z.xyz * step.z;
}

@compute @workgroup_size(LIST_THREADS)
fn count_vectors(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = id.y * groups.x * LIST_THREADS + id.x;
    if slot >= lists.counts.x {
        return;
    }
    let at = vectors.flags.x * slot;
    let place = records[at];
    let flow = records[at + 1u];
    let body = records[at + 2u];
    let marks = records[at + 3u];
    let of_second = is_second(slot);
    var axis_x = select(vectors.axis_x.xyz, vectors.second_x.xyz, of_second);
    var axis_y = select(vectors.axis_y.xyz, vectors.second_y.xyz, of_second);
    var axis_z = select(vectors.axis_z.xyz, vectors.second_z.xyz, of_second);
    let stretch = select(vectors.axis_x.w, vectors.second_x.w, of_second);
    let extent = select(vectors.axis_y.w, vectors.second_y.w, of_second);
    let window = select(vectors.picture.z, vectors.second_z.w, of_second);
    let way = select(vectors.flags.z, vectors.second_flags.z, of_second);
    if vectors.flags.x > 4u {
        axis_x = records[at + 4u].xyz;
        axis_y = records[at + 5u].xyz;
        axis_z = records[at + 6u].xyz;
    }
    // Stretched along the flow.
    let longer = (stretch - 1.0) * flow.xyz;
    let scale = extent * body.w;
    let step_x = in_view(scale * (axis_x + longer * dot(flow.xyz, axis_x)));
    let step_y = in_view(scale * (axis_y + longer * dot(flow.xyz, axis_y)));
    let step_z = in_view(scale * (axis_z + longer * dot(flow.xyz, axis_z)));
    let moved = place.xyz * vectors.second_origin.w + vectors.second_origin.xyz;
    let from_origin = in_view(select(place.xyz, moved, of_second));
    let view = frame.view_centre.xyz + from_origin;
    var kernel: Projected;
    kernel.middle = view.xy;
    kernel.depth = vectors.depth.x + from_origin.z;
    kernel.row_x = vec3<f32>(step_x.x, step_y.x, step_z.x);
    kernel.row_y = vec3<f32>(step_x.y, step_y.y, step_z.y);
    kernel.row_z = vec3<f32>(step_x.z, step_y.z, step_z.z);
    // The flow on the screen, and its part across the view.
    let flow_in_view = in_view(flow.xyz);
    var on_screen = flow_in_view.xy;
    var across_view = on_screen;
    var beside = 0.0;
    if perspective {
        let eye = frame.view_centre.w;
        kernel.hidden = view.z <= eye * NEAR;
        let depth = max(view.z, eye * NEAR);
        let shrink = eye / depth;
        kernel.middle = view.xy * shrink;
        kernel.row_x = (kernel.row_x - kernel.row_z * (view.x / depth)) * shrink;
        kernel.row_y = (kernel.row_y - kernel.row_z * (view.y / depth)) * shrink;
        on_screen = (on_screen - flow_in_view.z * view.xy / depth) * shrink;
        let towards = normalize(vec3<f32>(view.xy, depth));
        let rest = flow_in_view - towards * dot(flow_in_view, towards);
        across_view = rest.xy;
        beside = rest.z;
    }
    kernel.determinant = abs(dot(kernel.row_x, cross(kernel.row_y, kernel.row_z)));
    let flow_length = length(flow_in_view);
    let has_flow = flow_length > 0.0;
    let part = length(vec3<f32>(across_view, beside)) / select(1.0, flow_length, has_flow);
    let across = select(0.0, min(part, 1.0), has_flow);

    var narrow = ellipse(kernel);
    if way == POLYGON {
        // Shortened along the flow: on the unit circle its direction is e, and K (1 - (1 - f) e e^T)
        // maps the circle to the shorter ellipse.
        let on_circle = vec2<f32>(
            on_screen.x / narrow.x,
            (on_screen.y - narrow.y * on_screen.x / narrow.x) / narrow.z,
        );
        let e = on_circle / max(length(on_circle), 1e-30);
        let less = 1.0 - max(across, LEAST_ACROSS);
        let row_x = vec2<f32>(narrow.x, 0.0) - less * narrow.x * e.x * e;
        let row_y = vec2<f32>(narrow.y, narrow.z) - less * (narrow.y * e.x + narrow.z * e.y) * e;
        let k11 = length(row_x);
        let k21 = dot(row_x, row_y) / k11;
        let k22 = abs(row_x.x * row_y.y - row_x.y * row_y.x) / k11;
        narrow = vec4<f32>(k11, k21, k22, narrow.w);
    }
    let k = widened(narrow);
    let drawn = footprint_of(kernel, narrow, k);
    var matter = place.w;
    if published {
        // Widened splats of less than a pixel are as much thinner.
        matter *= k.w / narrow.w;
    } else {
        // As deep as it is with its own radius, and an extinction per unit of its own.
        let factor = window / (vectors.picture.z * vectors.second_origin.w);
        matter = optical_depth(place.w * select(1.0, factor, of_second), k.w);
    }
    // On the circle of the ellipse that is not shortened: depth does not follow what is drawn.
    let wide = ellipse(kernel);
    let tilt = tilt_of(kernel, wide, inverse_of(wide));
    let turned = vec2<f32>(
        drawn.inverse.x * on_screen.x,
        drawn.inverse.y * on_screen.x + drawn.inverse.z * on_screen.y,
    );
    let length_turned = length(turned);
    let turn = select(vec2<f32>(1.0, 0.0), turned / length_turned, length_turned > 1e-20);
    let second = vec4<f32>(tilt, turn);
    let head = vec4<f32>(kernel.middle, kernel.depth, matter);

    // The size of the marks whose texels are about as large as pixels, where the splat is narrowest.
    let trace = wide.x * wide.x + dot(wide.yz, wide.yz);
    let product = wide.x * wide.z;
    let larger = 0.5 * trace + sqrt(max(0.25 * trace * trace - product * product, 0.0));
    let radius = frame.radius * window * product / sqrt(larger);
    let level = clamp(floor(log2(0.5 * vectors.axis_z.w / max(radius, 1e-3)) + 0.5), 0.0, LAST_MARK_LEVEL);
    let word = (u32(flow.w * 4096.0) & 0xfffu) | (u32(across * 4095.0 + 0.5) << 12u) | (u32(level) << 24u);
    let last = vec4<u32>(
        pack2x16unorm(body.xy),
        pack2x16unorm(vec2<f32>(body.z, marks.x)),
        pack2x16unorm(marks.yz),
        word,
    );
    note_kernel(slot, kernel.hidden, drawn.reach, head, drawn.first, second, bitcast<vec4<f32>>(last));
}

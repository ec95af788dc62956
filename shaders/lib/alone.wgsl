// Slabs of vectors without a field, and polygons among them.

struct Met {
    polygons: PolygonRay,
}

fn met_alone(pixel: vec2<u32>, kept: vec2<f32>) -> Met {
    return Met(polygon_ray(pixel, kept));
}

// Lays a slab down, and the polygons up to where it ends. It is as dense everywhere.
fn lay_vectors(
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    sum: vec4<f32>,
    ends: vec2<f32>,
) {
    let span = select(ends.y - ends.x, 1.0, ends.y == ends.x);
    // Shares of the slab: what is laid down ends here.
    var begin = 0.0;
    let most = 1u + polygons_left((*met).polygons);
    for (var turn = 0u; turn < most; turn++) {
        let is_polygon = is_polygon_next((*met).polygons, ends.y, 0.0, true);
        let depth = polygon_depth((*met).polygons);
        let end = select(1.0, clamp((depth - ends.x) / span, begin, 1.0), is_polygon);
        composite(light, sum.rgb / max(sum.a, 1e-30), sum.a * (end - begin));
        if !is_polygon {
            break;
        }
        begin = end;
        lay_polygon(light, met);
    }
}

fn lay_rest(light: ptr<function, Gathered>, met: ptr<function, Met>) {
    let end = select(3e38, -3e38, back_to_front);
    lay_vectors(light, met, vec4<f32>(0.0), vec2<f32>(end, end));
}

// Slabs with surfaces among their matter: faces where the volume is cut, slices, isosurfaces, polygons.

const SURFACES: bool = true;

struct Surface {
    // Depth, pixels.
    t: f32,
    // 0 where there is none.
    opacity: f32,
    colour: vec3<f32>,
}

// Lays a slab of some length down, in unit distances, with what vectors have `beside`, from its first end
// on the way to the other, and the surfaces up to there. What is beside is as dense everywhere in it.
fn lay(
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    found: Halves,
    length: f32,
    ends: vec2<f32>,
    beside: vec4<f32>,
) {
    let weight = found.near.w + found.far.w;
    let span = select(ends.y - ends.x, 1.0, ends.y == ends.x);
    // Shares of the slab: what is laid down ends here.
    var begin = 0.0;
    let most = 2u + surface_count() + polygons_left((*met).polygons);
    for (var turn = 0u; turn < most; turn++) {
        let next = next_met(met, ends.y);
        let is_alone = next == MOST_MET;
        let surface = (*met).surfaces[min(next, MOST_MET - 1u)];
        let is_polygon = is_polygon_next((*met).polygons, ends.y, surface.t, is_alone);
        let is_last = is_alone && !is_polygon;
        let t = select(surface.t, polygon_depth((*met).polygons), is_polygon);
        let end = select(clamp((t - ends.x) / span, begin, 1.0), 1.0, is_last);
        let share = end - begin;
        if classify_middle {
            composite_beside(light, found.near.rgb, weight * length * share, beside * share);
        } else if published {
            let sum = found.near.rgb * found.near.w + found.far.rgb * found.far.w;
            let mean = sum / select(weight, 1.0, weight == 0.0);
            composite_beside(light, mean, 0.5 * weight * length * share, beside * share);
        } else {
            let near = max(min(end, 0.5) - begin, 0.0);
            let far = max(end - max(begin, 0.5), 0.0);
            composite_beside(light, found.near.rgb, found.near.w * length * near, beside * near);
            composite_beside(light, found.far.rgb, found.far.w * length * far, beside * far);
        }
        if is_last {
            break;
        }
        begin = end;
        if is_polygon {
            lay_polygon(light, met);
            continue;
        }
        cover(light, surface.colour, surface.opacity);
        (*met).done = surface.t;
    }
}

// Lays down the surfaces up to a depth.
fn lay_until(light: ptr<function, Gathered>, met: ptr<function, Met>, t: f32) {
    lay(light, met, Halves(vec4<f32>(0.0), vec4<f32>(0.0)), 0.0, vec2<f32>(t, t), vec4<f32>(0.0));
}

// Lays a slab of vectors alone down.
fn lay_vectors(
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    sum: vec4<f32>,
    ends: vec2<f32>,
) {
    lay(light, met, Halves(vec4<f32>(0.0), vec4<f32>(0.0)), 0.0, ends, sum);
}

// Turns of loops that it takes, beside those of what lies in it (gpu::turns).
fn turns_of_slab() -> u32 {
    return surface_count() + 6u;
}

// Slabs with surfaces among their matter: faces where the volume is cut, slices, isosurfaces, polygons.

struct Surface {
    // Depth, pixels.
    t: f32,
    // 0 where there is none.
    opacity: f32,
    colour: vec3<f32>,
}

// Of a ray, at most: a cut face, slices, levels within a slab.
const MOST_MET: u32 = 13u;

// Whether there are any of those below.
override has_surfaces: bool = false;
// Matter where it is cut shows its value.
override cut_faces: bool = false;
override slices: u32 = 0u;
// Where slices cut from one cell into another.
override edges: bool = false;
// The greatest luminance on which edges are white rather than black.
const DARK: f32 = 0.08;

fn surface_count() -> u32 {
    return slices + level_count();
}

// What a ray meets, in no order but for its polygons.
struct Met {
    surfaces: array<Surface, MOST_MET>,
    // Those up to here are laid down.
    done: f32,
    polygons: PolygonRay,
}

fn met_along(ray: Ray, part: Part, pixel: vec2<u32>) -> Met {
    var met: Met;
    met.done = select(-3e38, 3e38, back_to_front);
    met.polygons = polygon_ray(pixel, kept_of(ray, ENDLESS).ends);
    if !has_surfaces {
        return met;
    }
    // A loop, so that adapters compile `value` once.
    for (var i = 0u; i <= slices; i++) {
        let is_slice = i > 0u;
        let plane = slabs.slices[max(i, 1u) - 1u];
        let growth = dot(plane.xyz, ray.direction);
        let is_along = abs(growth) < 1e-20;
        let crossing = (plane.w - dot(plane.xyz, ray.origin)) / select(growth, 1.0, is_along);
        let t = select(part.ends.x, crossing, is_slice);
        let is_in = !is_along && t > part.ends.x && t < part.ends.y;
        met.surfaces[i].t = t;
        // Where polygons go on, the part may be none.
        let is_face = cut_faces && part.is_cut && part.ends.x < part.ends.y;
        if select(is_face, is_in, is_slice) {
            let place = ray.origin + ray.direction * t;
            let u = value(place).x;
            let in_hole = has_holes && is_hole(place);
            var found = classify(u);
            if holes_show {
                found = select(found, no_data(), in_hole);
            }
            let is_there = select(u != NOTHING, holes_show, in_hole);
            let face_opacity = select(0.0, 1.0, found.w > 0.0);
            // Of a slice, and whether it leaves out what has none by the table.
            let own = slabs.opacities[max(i, 1u) - 1u].yzw;
            let slice_opacity = own.x * select(1.0, face_opacity, own.y > 0.0);
            let opacity = select(face_opacity, slice_opacity, is_slice);
            met.surfaces[i].colour = found.rgb;
            if edges && is_slice && own.z > 0.0 {
                let luminance = dot(found.rgb, vec3<f32>(0.2126, 0.7152, 0.0722));
                let edge = select(0.0, 1.0, luminance < DARK);
                met.surfaces[i].colour = mix(found.rgb, vec3<f32>(edge), edge_share(ray, plane, place));
            }
            met.surfaces[i].opacity = select(0.0, opacity, is_there);
        }
    }
    return met;
}

// The next surface on the way, none of them further than `end`: MOST_MET where there is none.
fn next_met(met: ptr<function, Met>, end: f32) -> u32 {
    if !has_surfaces {
        return MOST_MET;
    }
    let way = select(1.0, -1.0, back_to_front);
    var next = MOST_MET;
    var nearest_t = end;
    for (var i = 0u; i <= surface_count(); i++) {
        let t = (*met).surfaces[i].t;
        let is_ahead = (t - (*met).done) * way > 0.0 && (t - nearest_t) * way <= 0.0;
        let is_next = is_ahead && (*met).surfaces[i].opacity > 0.0;
        next = select(next, i, is_next);
        nearest_t = select(nearest_t, t, is_next);
    }
    return next;
}

// Lays a slab with nothing but matter in it down, of some length in unit distances, with what vectors have
// `beside`.
fn lay_matter(
    light: ptr<function, Gathered>,
    found: Halves,
    length: f32,
    beside: vec4<f32>,
) {
    let weight = found.near.w + found.far.w;
    if classify_middle {
        composite_beside(light, found.near.rgb, weight * length, beside);
    } else if published {
        // Opacities are given to slabs: the mean of the two.
        let sum = found.near.rgb * found.near.w + found.far.rgb * found.far.w;
        composite_beside(light, sum / weight, 0.5 * weight * length, beside);
    } else {
        let near = 0.5 * found.near.w * length;
        let far = 0.5 * found.far.w * length;
        composite_beside(light, found.near.rgb, near, 0.5 * beside);
        composite_beside(light, found.far.rgb, far, 0.5 * beside);
    }
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
    if !has_surfaces && !POLYGONS {
        lay_matter(light, found, length, beside);
        return;
    }
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
    if !has_surfaces && !POLYGONS {
        composite(light, sum.rgb / max(sum.a, 1e-30), sum.a);
        return;
    }
    lay(light, met, Halves(vec4<f32>(0.0), vec4<f32>(0.0)), 0.0, ends, sum);
}

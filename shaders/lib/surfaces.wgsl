// Slabs with surfaces among their matter: faces where the volume is cut, slices, isosurfaces.

const SURFACES: bool = true;
// Of a ray, at most: a cut face, slices, levels within a slab.
const MOST_MET: u32 = 13u;

// Matter where it is cut shows its value.
override cut_faces: bool = false;
// An override, as it ends loops.
override slices: u32 = 0u;

struct Surface {
    // Depth, pixels.
    t: f32,
    // 0 where there is none.
    opacity: f32,
    colour: vec3<f32>,
}

// What a ray meets, in no order.
struct Met {
    surfaces: array<Surface, MOST_MET>,
    // Those up to here are laid down.
    done: f32,
}

fn met_along(ray: Ray, part: Part) -> Met {
    var met: Met;
    met.done = select(-3e38, 3e38, back_to_front);
    // A loop, so that adapters compile `value` once, and skip it where nothing is met.
    for (var i = 0u; i <= slices; i++) {
        let is_slice = i > 0u;
        let plane = inside.slices[max(i, 1u) - 1u];
        let growth = dot(plane.xyz, ray.direction);
        let is_along = abs(growth) < 1e-20;
        let crossing = (plane.w - dot(plane.xyz, ray.origin)) / select(growth, 1.0, is_along);
        let t = select(part.ends.x, crossing, is_slice);
        let is_in = !is_along && t > part.ends.x && t < part.ends.y;
        met.surfaces[i].t = t;
        for (var once = select(cut_faces && part.is_cut, is_in, is_slice); once; once = false) {
            let place = ray.origin + ray.direction * t;
            let u = value(place).x;
            let in_hole = has_holes && is_hole(place);
            var found = classify(u);
            if holes_show {
                found = select(found, no_data(), in_hole);
            }
            let is_there = select(u != NOTHING, holes_show, in_hole);
            let face_opacity = select(0.0, 1.0, found.w > 0.0);
            let opacity = select(face_opacity, inside.opacities[max(i, 1u) - 1u].y, is_slice);
            met.surfaces[i].colour = found.rgb;
            met.surfaces[i].opacity = select(0.0, opacity, is_there);
        }
    }
    return met;
}

// The next surface on the way, none of them further than `end`: MOST_MET where there is none.
fn next_met(met: ptr<function, Met>, end: f32) -> u32 {
    let way = select(1.0, -1.0, back_to_front);
    var next = MOST_MET;
    var nearest_t = end;
    for (var i = 0u; i <= slices + level_count(); i++) {
        let t = (*met).surfaces[i].t;
        let is_ahead = (t - (*met).done) * way > 0.0 && (t - nearest_t) * way <= 0.0;
        let is_next = is_ahead && (*met).surfaces[i].opacity > 0.0;
        next = select(next, i, is_next);
        nearest_t = select(nearest_t, t, is_next);
    }
    return next;
}

// Lays a slab of some length down, in unit distances, without vectors beside, from its first end on the way to the other, and
// the surfaces up to there.
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
    for (var turn = 0u; turn < 2u + slices + level_count(); turn++) {
        let next = next_met(met, ends.y);
        let is_last = next == MOST_MET;
        let surface = (*met).surfaces[min(next, MOST_MET - 1u)];
        let end = select(clamp((surface.t - ends.x) / span, begin, 1.0), 1.0, is_last);
        if classify_middle {
            composite(light, found.near.rgb, weight * length * (end - begin));
        } else if published {
            let sum = found.near.rgb * found.near.w + found.far.rgb * found.far.w;
            let mean = sum / select(weight, 1.0, weight == 0.0);
            composite(light, mean, 0.5 * weight * length * (end - begin));
        } else {
            let near = max(min(end, 0.5) - begin, 0.0);
            let far = max(end - max(begin, 0.5), 0.0);
            composite(light, found.near.rgb, found.near.w * length * near);
            composite(light, found.far.rgb, found.far.w * length * far);
        }
        if is_last {
            break;
        }
        cover(light, surface.colour, surface.opacity);
        (*met).done = surface.t;
        begin = end;
    }
}

// Lays down the surfaces up to a depth.
fn lay_until(light: ptr<function, Gathered>, met: ptr<function, Met>, t: f32) {
    lay(light, met, Halves(vec4<f32>(0.0), vec4<f32>(0.0)), 0.0, vec2<f32>(t, t), vec4<f32>(0.0));
}

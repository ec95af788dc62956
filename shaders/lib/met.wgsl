// What a ray meets of cut faces, slices and isosurfaces.

// Of a ray, at most: a cut face, slices, levels within a slab.
const MOST_MET: u32 = 13u;

// Matter where it is cut shows its value.
override cut_faces: bool = false;
// An override, as it ends loops.
override slices: u32 = 0u;

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
        // Where polygons go on, the part may be none.
        let is_face = cut_faces && part.is_cut && part.ends.x < part.ends.y;
        for (var once = select(is_face, is_in, is_slice); once; once = false) {
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
    for (var i = 0u; i <= surface_count(); i++) {
        let t = (*met).surfaces[i].t;
        let is_ahead = (t - (*met).done) * way > 0.0 && (t - nearest_t) * way <= 0.0;
        let is_next = is_ahead && (*met).surfaces[i].opacity > 0.0;
        next = select(next, i, is_next);
        nearest_t = select(nearest_t, t, is_next);
    }
    return next;
}

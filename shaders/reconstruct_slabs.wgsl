// Composites the slabs of a field that is classified after reconstruction.
//
// One invocation a pixel. It walks its ray from slab face to slab face, gathers the field's value
// there from the lattice's coefficients, classifies what lies between, and composites. Where no
// value in reach can show it leaps.

const TILE: u32 = 8u;
// Faces between two looks at whether anything can show: about two bricks. A slab more costs a ray less than a look.
const LOOK_EVERY: u32 = 8u;
// Least depth of three slabs together, in slabs, for all three to be whole: at the borders of the
// lattice they are clipped.
const WHOLE_SLABS: f32 = 2.99;
// The picture is of a cut of the field.
override of_cut: bool = false;
// Whether small things lie in the pixel, that a single ray may miss.
var<private> seeks_specks: bool;

fn frame_growth() -> f32 {
    return slabs.up.w;
}

// The slab that is classified next, in the order of compositing.
fn slab_ahead(k: i32, way: i32, have: i32) -> i32 {
    let at = k - way * select(min(have, 2), 0, classify_middle);
    return select(at, 1 - at, back_to_front);
}

fn picture_width() -> u32 {
    return slabs.tiles.z;
}

// Premultiplied colour and opacity along the ray through a point of the screen, pixels from the
// picture's middle.
fn ray(screen: vec2<f32>, pixel: vec2<u32>) -> vec4<f32> {
    let through = ray_through(screen);
    let origin = through.origin;
    let direction = through.direction;
    let inverse = through.inverse;
    let part = part_of(through);
    let enter = part.ends.x;
    let leave = part.ends.y;
    let misses = enter >= leave;
    if !VECTORS && !POLYGONS && misses {
        return vec4<f32>(0.0);
    }

    var light = NO_LIGHT;
    var met = met_along(through, part, pixel);
    let step = slabs.base.w;
    let first = i32(floor(enter / step));
    let last = i32(ceil(leave / step));
    // Length of the ray per pixel of depth, in unit distances.
    let stretch = length(vec3<f32>(screen * slabs.up.w, 1.0)) * slabs.picture.z;
    // Faces are counted in the order of compositing. Between faces, a slab is classified once the
    // face behind it is known too: that takes one turn more.
    let way = select(1, -1, back_to_front);
    let ahead = select(1, 0, classify_middle);
    var k = select(first, last, back_to_front);
    var remaining = last - first + ahead;
    if (VECTORS || POLYGONS) && misses {
        // They reach beyond the lattice.
        remaining = -1;
    }
    // Beyond everything on the way.
    let beyond = select(3e38, -3e38, back_to_front);
    var vector_state = vector_ray(pixel, kept_of(through, ENDLESS).ends);
    // The faces before the one at k: values, and depths in pixels. The slab between the last two is
    // the next to be classified.
    var u_before = NOTHING;
    var u_near = NOTHING;
    var u_far = NOTHING;
    var width_near = 0.0;
    var width_far = 0.0;
    var g_near = vec3<f32>(0.0);
    var g_far = vec3<f32>(0.0);
    var t_before = 0.0;
    var t_near = 0.0;
    var t_far = 0.0;
    // How many of them there are.
    var have = 0;
    // From layer to layer of vectors, so that the rays of a tile, whose list is one, come to each together.
    // Without vectors, once.
    loop {
        let layer = next_layer(vector_state);
        let bound = field_slab(layer);
        while remaining >= 0 && left_of(light) >= slabs.picture.w
            && (!VECTORS || slab_ahead(k, way, have) < bound)
        {
            // Where the next slab begins.
            var at = k - way * min(have, 2 * ahead);
            var look_t = clamp(f32(at) * step, enter, leave);
            var far = distance_at(origin + direction * look_t);
            while far > 0 && remaining >= 0 {
                // To the first face that is not known to be followed by nothing.
                let free = leap(origin + direction * look_t, far, inverse * f32(way));
                let faces = max(i32(ceil((abs(look_t - f32(at) * step) + free) / step)), 1);
                at += way * faces;
                // One sooner, for the face before the slab.
                let next = at - way * ahead;
                if (next - k) * way > 0 {
                    k = next;
                    remaining = select(last - k, k - first, back_to_front) + ahead;
                    have = 0;
                    u_near = NOTHING;
                    u_far = NOTHING;
                }
                look_t = clamp(f32(at) * step, enter, leave);
                far = distance_at(origin + direction * look_t);
            }
            for (
                var n = 0u;
                n < LOOK_EVERY && remaining >= 0 && left_of(light) >= slabs.picture.w
                    && (!VECTORS || slab_ahead(k, way, have) < bound);
                n++
            ) {
                let t = clamp(f32(k) * step, enter, leave);
                var found = Halves(vec4<f32>(0.0), vec4<f32>(0.0));
                var from_t = t_near;
                var to_t = t_far;
                var u_ends = vec2<f32>(u_near, u_far);
                var u_middle = 0.5 * (u_near + u_far);
                var growths = Growths(g_near, g_far);
                let slab = slab_ahead(k, way, have);
                if classify_middle {
                    from_t = t;
                    to_t = clamp(f32(k + way) * step, enter, leave);
                }
                let here_t = select(t, 0.5 * (from_t + to_t), classify_middle);
                var here = Face(vec2<f32>(0.0), vec3<f32>(0.0));
                if SHADED || !classify_mean {
                    here = face(origin + direction * here_t, direction);
                }
                if classify_mean {
                    let mean = mean_of_functions(origin, direction, vec2<f32>(from_t, to_t));
                    here.value.x = slabs.table.x + slabs.table.y * mean;
                }
                if classify_middle {
                    let u = here.value;
                    u_middle = u.x;
                    growths = Growths(here.gradient, here.gradient);
                    if u.x != NOTHING {
                        if has_widths {
                            found.near = classify_about(u.x, u.x, u.y).near;
                        } else {
                            found.near = classify(u.x);
                        }
                    }
                } else {
                    let u = here.value.x;
                    if (kernel == CELLS || kernel == ELLIPSOIDS) && have >= 2 && (u_near == NOTHING || u_far == NOTHING) {
                        let slab = trimmed(origin, direction, Trimmed(vec2<f32>(t_near, t_far), u_ends));
                        from_t = slab.ts.x;
                        to_t = slab.ts.y;
                        if SHADED && slab.us.x != NOTHING {
                            if u_near == NOTHING {
                                let place = origin + direction * from_t;
                                growths.near = slabs.table.y * growth_of_light(place, direction);
                            }
                            if u_far == NOTHING {
                                let place = origin + direction * to_t;
                                growths.far = slabs.table.y * growth_of_light(place, direction);
                            }
                        }
                        u_ends = slab.us;
                        u_middle = 0.5 * (u_ends.x + u_ends.y);
                    }
                    if has_depths && have >= 2 {
                        let slab = cut_off(origin, direction, Trimmed(vec2<f32>(t_near, t_far), u_ends));
                        from_t = slab.ts.x;
                        to_t = slab.ts.y;
                        u_ends = slab.us;
                        u_middle = 0.5 * (u_ends.x + u_ends.y);
                    }
                    // The parabola has the mean of the cubic through four faces.
                    let whole = abs(t - t_before) >= WHOLE_SLABS * step
                        && u_before != NOTHING && u_near != NOTHING && u_far != NOTHING && u != NOTHING;
                    let bend = ((u_near - u_before) + (u_far - u)) * (1.0 / 24.0);
                    // Most slabs near what shows are empty all the same.
                    let width = 0.5 * (width_near + width_far);
                    // Where values are straight between the points of cells there is nothing that bends.
                    let bent = select(0.0, bend, whole && !has_widths && kernel != CELLS);
                    let is_known = u_ends.x != NOTHING && u_ends.y != NOTHING;
                    if is_known && may_show(u_ends.x, u_ends.y, width, bent) {
                        if has_widths {
                            found = classify_about(u_ends.x, u_ends.y, width);
                        } else {
                            found = classify_between(u_ends.x, u_ends.y, bent);
                        }
                    }
                    width_near = width_far;
                    width_far = here.value.y;
                    g_near = g_far;
                    g_far = here.gradient;
                    u_before = u_near;
                    u_near = u_far;
                    u_far = u;
                    t_before = t_near;
                    t_near = t_far;
                    t_far = t;
                    have += 1;
                }
                if has_widths {
                    let is_slab = classify_middle || (u_ends.x != NOTHING && u_ends.y != NOTHING);
                    if seeks_specks && is_slab {
                        found = with_specks(found, origin + direction * (0.5 * (from_t + to_t)));
                    }
                }
                k += way;
                remaining -= 1;
                if SHADED && found.near.w + found.far.w > 0.0 {
                    if growth_is_late() {
                        let middle = 0.5 * (from_t + to_t);
                        let ends = select(vec2<f32>(from_t, to_t), vec2<f32>(middle), classify_middle);
                        growths.near = late_growth(origin + direction * ends.x);
                        growths.far = growths.near;
                        if !classify_middle {
                            growths.far = late_growth(origin + direction * ends.y);
                        }
                    }
                    found = shaded(found, u_middle, growths, 0.5 * (from_t + to_t), screen);
                }
                if holes_show {
                    // Boxes of samples without data: nothing is interpolated, nor lit.
                    let is_slab = classify_middle || have > 2;
                    let middle = origin + direction * (0.5 * (from_t + to_t));
                    if is_slab && is_hole(middle) {
                        found.near = no_data();
                        found.far = select(found.near, vec4<f32>(0.0), classify_middle);
                    }
                }
                let weight = found.near.w + found.far.w;
                let is_met = meet_levels(&met, through, u_ends, vec2<f32>(from_t, to_t), screen);
                if weight <= 0.0 && !is_met {
                    continue;
                }
                if has_holes && !holes_show {
                    if is_hole(origin + direction * (0.5 * (from_t + to_t))) {
                        continue;
                    }
                }
                let length = stretch * abs(to_t - from_t);
                lay_slabs_before(&vector_state, &light, &met, slab_of_vectors(slab));
                let beside = take_slab(&vector_state, slab_of_vectors(slab));
                lay(&light, &met, found, length, vec2<f32>(from_t, to_t), beside);
            }
        }
        if !VECTORS {
            break;
        }
        // What stands where the field has nothing.
        lay_slabs_before(&vector_state, &light, &met, layer);
        if layer == EVERY_SLAB || left_of(light) < slabs.picture.w {
            break;
        }
        sum_next_layer(&vector_state, screen);
    }
    if has_surfaces || POLYGONS {
        // Where nothing but surfaces is left.
        let end = select(select(leave, enter, back_to_front), beyond, POLYGONS);
        lay_until(&light, &met, end);
    }
    return light_of(light);
}

@compute @workgroup_size(TILE, TILE)
fn reconstruct_slabs(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
) {
    let within = group.y * groups.x + group.x;
    let tile = slabs.tiles.x + within;
    let pixel = vec2<u32>(tile % slabs.tiles.y, tile / slabs.tiles.y) * TILE + local.xy;
    if within >= slabs.more.x || pixel.x >= slabs.tiles.z || pixel.y >= slabs.tiles.w {
        return;
    }
    let corner = vec2<f32>(f32(pixel.x), f32(slabs.tiles.w - pixel.y)) - slabs.picture.xy;
    // One ray a pixel, or a square of them where kernels are smaller than a pixel, or things are.
    let side = rays_along_side(pixel);
    seeks_specks = side > slabs.more.y;
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < side * side; i++) {
        let part = (vec2<f32>(f32(i % side), f32(i / side)) + 0.5) / f32(side);
        let screen = corner + vec2<f32>(part.x, -part.y);
        if of_cut {
            sum += ray_of_cut(screen, pixel);
        } else {
            sum += ray(screen, pixel);
        }
    }
    textureStore(picture, pixel, sum / f32(side * side));
    note_ended_loops();
}

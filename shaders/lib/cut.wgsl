// A picture of a cut of the field, brick by brick from the field itself or from means of its samples: what a cut is says
// `plan::FieldCut`.
//
// The cut lies where the fourth chunk of a field would: words 0 to 2 have the bricks along x, y, z; 4 to 6 the stored means of
// 2^3 samples along x and y, and the word at which they begin; 8 to 10 the same of 4^3; 12 and 13, 32-bit floats, x and y of
// x + y * s, the cell of a stored mean s. Then come the bricks, four bytes a word: their level, or, where nothing shows, two more
// than their distance, in bricks, from the nearest where something does. All means have one mirrored mean beyond each border.

// Means are 32-bit floats, one a word, rather than 16 bits beside those of the next along x.
override means_are_floats: bool = false;

const CUT_HEAD: u32 = 16u;
// Slabs of which a ray has one level.
const SEGMENT: i32 = 4;
// Bytes of bricks from here on are of empty ones.
const EMPTY_LEVEL: u32 = 3u;

fn cut_word(index: u32) -> u32 {
    return field3[index];
}

// The byte of the brick that a position lies in.
fn cut_at(position: vec3<f32>) -> u32 {
    let bricks = vec3<u32>(cut_word(0u), cut_word(1u), cut_word(2u));
    let brick = vec3<u32>(clamp((position + 1.0) * 0.25, vec3<f32>(0.0), vec3<f32>(bricks) - 0.5));
    let index = (brick.z * bricks.y + brick.y) * bricks.x + brick.x;
    return cut_word(CUT_HEAD + index / 4u) >> (8u * (index % 4u)) & 0xffu;
}

// How far a ray goes on from a position in an empty brick of this byte before it leaves the bricks that are known to be.
fn leap_of_cut(position: vec3<f32>, byte: u32, inverse: vec3<f32>) -> f32 {
    let low = floor((position + 1.0) * 0.25) * 4.0 - 1.0;
    let reach = f32(byte - 2u) * 4.0;
    let exit = select(low + 4.0 - reach, low + reach, inverse > vec3<f32>(0.0));
    let t = (exit - position) * inverse;
    return min(t.x, min(t.y, t.z));
}

// Two neighbouring means along x.
fn two_means(index: u32) -> vec2<f32> {
    if means_are_floats {
        return bitcast<vec2<f32>>(vec2<u32>(cut_word(index), cut_word(index + 1u)));
    }
    return unpack2x16unorm(cut_word(index));
}

// Tents through the means of a level, at a position in the index space of the field; growth per index of that.
fn face_of_means(position: vec3<f32>, level: u32) -> Face {
    let scale = select(0.25, 0.5, level == 1u);
    let place = position * scale + (0.5 * scale - 0.5);
    let floored = floor(place);
    let f = place - floored;
    let head = 4u * level;
    let row = cut_word(head);
    let plane = row * cut_word(head + 1u);
    let at = vec3<u32>(vec3<i32>(floored) + vec3<i32>(1));
    let i = cut_word(head + 2u) + at.z * plane + at.y * row + at.x;
    let a = two_means(i);
    let b = two_means(i + row);
    let c = two_means(i + plane);
    let d = two_means(i + plane + row);
    let growth_x = mix(mix(a.y - a.x, b.y - b.x, f.y), mix(c.y - c.x, d.y - d.x, f.y), f.z);
    let near_low = mix(a.x, a.y, f.x);
    let near_high = mix(b.x, b.y, f.x);
    let far_low = mix(c.x, c.y, f.x);
    let far_high = mix(d.x, d.y, f.x);
    let growth_y = mix(near_high - near_low, far_high - far_low, f.z);
    let near = mix(near_low, near_high, f.y);
    let growth_z = mix(far_low, far_high, f.y) - near;
    let cells = bitcast<vec2<f32>>(vec2<u32>(cut_word(12u), cut_word(13u)));
    let u = cells.x + cells.y * (near + growth_z * f.z);
    return Face(vec2<f32>(u, 0.0), cells.y * scale * vec3<f32>(growth_x, growth_y, growth_z));
}

// The face at which the segment begins that a place lies in, in slabs.
fn segment_of(place: f32) -> i32 {
    return i32(floor(place / f32(SEGMENT))) * SEGMENT;
}

// As `ray` has it of all of the field.
fn ray_of_cut(screen: vec2<f32>, pixel: vec2<u32>) -> vec4<f32> {
    let through = ray_through(screen);
    let origin = through.origin;
    let direction = through.direction;
    let part = part_of(through);
    let enter = part.ends.x;
    let leave = part.ends.y;
    let misses = enter >= leave;
    if !POLYGONS && misses {
        return vec4<f32>(0.0);
    }
    var light = NO_LIGHT;
    var met = met_along(through, part, pixel);
    let step = slabs.base.w;
    let stretch = length(vec3<f32>(screen * slabs.up.w, 1.0)) * slabs.picture.z;
    // The next face, where the segment ends that it lies in, and where the last one does.
    var k = segment_of(enter / step);
    let last = select(i32(ceil(leave / step)), k, misses);
    var end = k;
    var level = EMPTY_LEVEL;
    // Whether the last face is the one that the next slab begins with.
    var is_joined = false;
    // The faces before: values, growth, depths in pixels, levels. The slab between the last two is classified once the face behind
    // it is known.
    var u_before = NOTHING;
    var u_near = NOTHING;
    var u_far = NOTHING;
    var g_near = vec3<f32>(0.0);
    var g_far = vec3<f32>(0.0);
    var t_before = 0.0;
    var t_near = 0.0;
    var t_far = 0.0;
    var level_before = EMPTY_LEVEL;
    var level_near = EMPTY_LEVEL;
    var level_far = EMPTY_LEVEL;
    while (k < last || k < end || is_joined) && left_of(light) >= slabs.picture.w {
        // After the last slab, and before what is empty, there is no face.
        var is_face = true;
        if k < end {
            k += 1i << level;
        } else if k >= last {
            is_face = false;
        } else {
            let from_t = clamp(f32(k) * step, enter, leave);
            let to_t = clamp(f32(k + SEGMENT) * step, enter, leave);
            let look_t = mix(from_t, to_t, 0.8);
            let look = origin + direction * look_t;
            let byte = cut_at(look);
            let finest = min(cut_at(origin + direction * mix(from_t, to_t, 0.2)), byte);
            if finest >= EMPTY_LEVEL {
                // Segments that end before the ray leaves what is empty are, too.
                let free_t = min(look_t + leap_of_cut(look, byte, through.inverse), leave);
                k = max(k + SEGMENT, segment_of(free_t / step));
                end = k;
                if !is_joined {
                    continue;
                }
                is_face = false;
            } else {
                level = finest;
                end = k + SEGMENT;
                k += select(0, 1i << level, is_joined);
            }
        }
        is_joined = is_face;
        let t = clamp(f32(k) * step, enter, leave);
        var here = Face(vec2<f32>(NOTHING, 0.0), vec3<f32>(0.0));
        var level_here = EMPTY_LEVEL;
        if is_face {
            level_here = level;
            let place = origin + direction * t;
            if level == 0u {
                here = face(place, direction);
            } else {
                here = face_of_means(place, level);
            }
        }
        let u = here.value.x;
        let from_t = t_near;
        let to_t = t_far;
        var is_met = false;
        if has_surfaces {
            // Bricks that an isosurface passes are of the field itself, which a segment of it may begin with a face of means.
            if u_near != NOTHING && level_far == 0u {
                var u_ends = vec2<f32>(u_near, u_far);
                if level_near != 0u && level_count() > 0u {
                    u_ends.x = face(origin + direction * from_t, direction).value.x;
                }
                is_met = meet_levels(&met, through, u_ends, vec2<f32>(from_t, to_t), screen);
            }
        }
        let u_middle = 0.5 * (u_near + u_far);
        let growths = Growths(g_near, g_far);
        var found = Halves(vec4<f32>(0.0), vec4<f32>(0.0));
        let is_slab = u_near != NOTHING && u_far != NOTHING;
        if is_slab {
            // The parabola has the mean of the cubic through four faces.
            let is_whole = (level_before | level_near | level_far | level_here) == 0u
                && abs(t - t_before) >= WHOLE_SLABS * step;
            let bend = ((u_near - u_before) + (u_far - u)) * (1.0 / 24.0);
            let bent = select(0.0, bend, is_whole);
            if may_show(u_near, u_far, 0.0, bent) {
                if level_far == 0u {
                    found = classify_between(u_near, u_far, bent);
                } else {
                    found = classify_about(u_near, u_far, 0.0);
                }
            }
        }
        u_before = u_near;
        u_near = u_far;
        u_far = u;
        g_near = g_far;
        g_far = here.gradient;
        t_before = t_near;
        t_near = t_far;
        t_far = t;
        level_before = level_near;
        level_near = level_far;
        level_far = level_here;
        let middle_t = 0.5 * (from_t + to_t);
        if SHADED && found.near.w + found.far.w > 0.0 {
            found = shaded(found, u_middle, growths, middle_t, screen);
        }
        if holes_show {
            if is_slab && is_hole(origin + direction * middle_t) {
                found.near = no_data();
                found.far = found.near;
            }
        }
        if found.near.w + found.far.w <= 0.0 && !is_met {
            continue;
        }
        if has_holes && !holes_show {
            if is_hole(origin + direction * middle_t) {
                continue;
            }
        }
        let ends = vec2<f32>(from_t, to_t);
        lay(&light, &met, found, stretch * (to_t - from_t), ends, vec4<f32>(0.0));
    }
    if has_surfaces || POLYGONS {
        // Where nothing but surfaces is left.
        lay_until(&light, &met, select(leave, 3e38, POLYGONS));
    }
    return light_of(light);
}

// The field on the faces of slabs, with its growth, where something is lit or looked up by it.

// What finds the growth.
const OF_BSPLINES: u32 = 0u;
const OF_TENTS: u32 = 1u;
const BY_DIFFERENCES: u32 = 2u;
const OF_FUNCTIONS: u32 = 3u;
const OF_CELLS: u32 = 4u;
// The same, and on their border that of light.
const OF_LIT_CELLS: u32 = 5u;
// The same of ellipsoids.
const OF_LIT_ELLIPSOIDS: u32 = 6u;

// Where things end that numbers name.
const OF_NAMES: u32 = 7u;
// Samples to either side that tell how: see `scene::shading`.
const NAMES_REACH: i32 = 2;

override growth: u32 = 2u;
// Light falls on the border of the cells that the field is samples of.
override lights_border: bool = false;
// Steps from there inwards within which it does.
const LAYER: f32 = 2.0;

// At a position of a ray that goes in a direction.
fn face(position: vec3<f32>, direction: vec3<f32>) -> Face {
    if growth == OF_BSPLINES {
        return face_of_bsplines(position);
    }
    if growth == OF_TENTS {
        return face_of_tents(position);
    }
    if growth == OF_FUNCTIONS || growth == OF_LIT_ELLIPSOIDS {
        return face_of_functions(position);
    }
    if growth == OF_NAMES {
        return Face(value(position), vec3<f32>(0.0));
    }
    if growth >= OF_CELLS {
        return face_in(cell_at(position), position, direction);
    }
    return face_by_differences(position);
}

// Whether the growth is found where something shows alone.
fn growth_is_late() -> bool {
    return growth == OF_NAMES || lights_border;
}

// What light takes for the growth at a position of cells or ellipsoids, as stored.
fn growth_of_light(position: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    if growth == OF_LIT_CELLS {
        return growth_for_light(cell_at(position), position, direction);
    }
    if growth == OF_LIT_ELLIPSOIDS {
        return lit_sum_of_functions(position).xyz;
    }
    return stored_growth(position);
}

fn face_in(found: InCell, position: vec3<f32>, direction: vec3<f32>) -> Face {
    let stored = value_in(found);
    let u = select(slabs.table.x + slabs.table.y * stored, NOTHING, stored == NOTHING);
    if growth == OF_LIT_CELLS {
        return Face(vec2<f32>(u, 0.0), slabs.table.y * growth_for_light(found, position, direction));
    }
    return Face(vec2<f32>(u, 0.0), slabs.table.y * growth_in(found));
}

fn face_of_functions(position: vec3<f32>) -> Face {
    var found: vec4<f32>;
    if growth == OF_LIT_ELLIPSOIDS {
        found = lit_sum_of_functions(position);
    } else {
        found = sum_of_functions(position);
    }
    let u = select(slabs.table.x + slabs.table.y * found.w, NOTHING, found.w == NOTHING);
    return Face(vec2<f32>(u, 0.0), slabs.table.y * found.xyz);
}

// Of B-splines: values, and their derivative from the same samples.
fn bspline_slopes(f: f32) -> vec4<f32> {
    let g = 1.0 - f;
    return vec4<f32>(-0.5 * g * g, f * (1.5 * f - 2.0), g * (2.0 - 1.5 * g), 0.5 * f * f);
}

// Value and growth along x of a row of four.
fn row4_slope(index: u32, w: vec4<f32>, s: vec4<f32>) -> vec2<f32> {
    let row = vec4<f32>(two(index), two(index + 2u));
    return vec2<f32>(dot(row, w), dot(row, s));
}

// Growth along x and y, and value, of a plane of four by four.
fn plane4_slope(
    index: u32,
    wx: vec4<f32>, sx: vec4<f32>,
    wy: vec4<f32>, sy: vec4<f32>,
) -> vec3<f32> {
    let row = slabs.stored.x;
    let a = row4_slope(index, wx, sx);
    let b = row4_slope(index + row, wx, sx);
    let c = row4_slope(index + 2u * row, wx, sx);
    let d = row4_slope(index + 3u * row, wx, sx);
    let values = vec4<f32>(a.x, b.x, c.x, d.x);
    return vec3<f32>(dot(vec4<f32>(a.y, b.y, c.y, d.y), wy), dot(values, sy), dot(values, wy));
}

fn face_of_bsplines(position: vec3<f32>) -> Face {
    let floored = floor(position);
    let f = position - floored;
    let wx = bspline_weights(f.x);
    let wy = bspline_weights(f.y);
    let sx = bspline_slopes(f.x);
    let sy = bspline_slopes(f.y);
    let i = stored_index(vec3<i32>(floored) - vec3<i32>(1));
    let plane = slabs.stored.x * slabs.stored.y;
    let planes = mat4x3<f32>(
        plane4_slope(i, wx, sx, wy, sy),
        plane4_slope(i + plane, wx, sx, wy, sy),
        plane4_slope(i + 2u * plane, wx, sx, wy, sy),
        plane4_slope(i + 3u * plane, wx, sx, wy, sy),
    );
    let across = planes * bspline_weights(f.z);
    let along = planes * bspline_slopes(f.z);
    let u = slabs.table.x + slabs.table.y * across.z;
    return Face(vec2<f32>(u, 0.0), slabs.table.y * vec3<f32>(across.xy, along.z));
}

// Of tents, for quick pictures: values, and the derivative within the cell from the same samples.

// A sample, and half the width about it where there are such.
fn sample(index: u32) -> vec2<f32> {
    if has_widths {
        return mean_and_width(index);
    }
    return vec2<f32>(two(index).x, 0.0);
}

fn face_of_tents(position: vec3<f32>) -> Face {
    let floored = floor(position);
    let f = position - floored;
    let i = stored_index(vec3<i32>(floored));
    let j = i + slabs.stored.x;
    let plane = slabs.stored.x * slabs.stored.y;
    // Four rows along x: beginnings, and growth.
    let a = sample(i);
    let b = sample(j);
    let c = sample(i + plane);
    let d = sample(j + plane);
    let da = sample(i + 1u) - a;
    let db = sample(j + 1u) - b;
    let dc = sample(i + plane + 1u) - c;
    let dd = sample(j + plane + 1u) - d;
    let dx = mix(mix(da, db, f.y), mix(dc, dd, f.y), f.z);
    let near_low = a + da * f.x;
    let near_high = b + db * f.x;
    let far_low = c + dc * f.x;
    let far_high = d + dd * f.x;
    let dy = mix(near_high - near_low, far_high - far_low, f.z);
    let near = mix(near_low, near_high, f.y);
    let dz = mix(far_low, far_high, f.y) - near;
    let found = near + dz * f.z;
    let u = slabs.table.x + slabs.table.y * found.x;
    let growth = slabs.table.y * vec3<f32>(dx.x, dy.x, dz.x);
    return Face(vec2<f32>(u, slabs.table.y * found.y), growth);
}

// Of any field, by differences between half a sample before and half a sample on, because the derivative of
// tents, boxes and normalised kernels jumps.
fn face_by_differences(position: vec3<f32>) -> Face {
    var found = Face(vec2<f32>(0.0), vec3<f32>(0.0));
    // The place itself, then half a sample on and half a sample before along each axis: a loop, so that adapters
    // compile `value` once.
    let places = select(1u, 7u, uses_gradient);
    var past = 0.0;
    for (var i = 0u; i < places; i++) {
        let axis = (max(i, 1u) - 1u) / 2u;
        let along = vec3<f32>(vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis));
        let is_on = (i & 1u) == 1u;
        let offset = select(select(-0.5, 0.5, is_on), 0.0, i == 0u);
        let here = value(position + offset * along);
        if i == 0u {
            found.value = here;
        } else if is_on {
            past = here.x;
        } else {
            found.gradient += along * select(past - here.x, 0.0, past == NOTHING || here.x == NOTHING);
        }
    }
    return found;
}

// The growth, in cells of the table, of what is lit by how it ends (`scene::shading` has the rules).
fn late_growth(position: vec3<f32>) -> vec3<f32> {
    if growth == OF_NAMES {
        return end_of_name(position);
    }
    // In the outermost layer of cells.
    let inside = face_of_tents(position).gradient;
    let depth = depth_at(position);
    let share = max(1.0 - max(depth.w, 0.0) / LAYER, 0.0);
    let inwards = share * shade.world_y.w * depth.xyz / max(length(depth.xyz), 1e-6);
    // A surface and its back are lit alike.
    return inwards + select(1.0, -1.0, dot(inwards, inside) < 0.0) * (1.0 - share) * inside;
}

// Of names: how the border is turned of what the sample nearest to a position names.
fn end_of_name(position: vec3<f32>) -> vec3<f32> {
    let middle = nearest(position);
    let own = two(stored_index(middle)).x;
    let last = vec3<i32>(slabs.dims.xyz) - vec3<i32>(1);
    var sum = vec4<f32>(0.0);
    for (var z = -NAMES_REACH; z <= NAMES_REACH; z++) {
        for (var y = -NAMES_REACH; y <= NAMES_REACH; y++) {
            for (var x = -NAMES_REACH; x <= NAMES_REACH; x++) {
                let at = middle + vec3<i32>(x, y, z);
                let away = vec3<f32>(at) - position;
                let share = away / (f32(NAMES_REACH) + 0.5);
                let hump = max(vec3<f32>(1.0) - share * share, vec3<f32>(0.0));
                let weight = hump.x * hump.x * hump.y * hump.y * hump.z * hump.z;
                let is_other = two(stored_index(clamp(at, vec3<i32>(0), last))).x != own;
                sum += weight * vec4<f32>(select(vec3<f32>(0.0), away, is_other), 1.0);
            }
        }
    }
    return sum.xyz * (shade.world_y.w / sum.w);
}

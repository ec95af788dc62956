// Cells that lie anywhere, stored in the place of coefficients as `gpu::cells` writes them.

// Kinds, as `cells::Kind` numbers them.
const TETRAHEDRON: u32 = 0u;
const PYRAMID: u32 = 1u;
const WEDGE: u32 = 2u;
// Steps of Newton's method, at most; solids that are no parallelepipeds but like one take three.
const MOST_NEWTON_STEPS: u32 = 8u;
// No more steps follow one as short as this, in units of the cell.
const SHORT_STEP: f32 = 1e-4;
// How often a slab is halved to find where a ray passes the cells' border.
const BORDER_STEPS: u32 = 16u;
// Places at which a slab between two faces outside all cells is looked at.
const PLACES_BETWEEN: u32 = 9u;

// Where a position lies: the record of a cell, 0 for none, and (r, s, t) in it.
struct InCell {
    record: u32,
    unit: vec3<f32>,
}

fn number(index: u32) -> f32 {
    return bitcast<f32>(word(index));
}

fn triple(index: u32) -> vec3<f32> {
    return vec3<f32>(number(index), number(index + 1u), number(index + 2u));
}

fn kind_of(record: u32) -> u32 {
    return word(record) & 3u;
}

// How far (r, s, t) lies beyond a cell's region.
fn beyond_region(kind: u32, unit: vec3<f32>) -> f32 {
    let below = max(-unit.x, max(-unit.y, -unit.z));
    if kind == TETRAHEDRON {
        return max(below, unit.x + unit.y + unit.z - 1.0);
    }
    if kind == WEDGE {
        return max(below, max(unit.x + unit.y - 1.0, unit.z - 1.0));
    }
    return max(below, max(unit.x, max(unit.y, unit.z)) - 1.0);
}

// (r, s, t) of a position in a cell, and how far it lies outside, less what counts as inside.
fn unit_in(record: u32, position: vec3<f32>) -> vec4<f32> {
    let kind = kind_of(record);
    let rim = number(record + 1u);
    let offset = position - triple(record + 2u);
    if kind == TETRAHEDRON {
        let unit = vec3<f32>(
            dot(triple(record + 5u), offset),
            dot(triple(record + 8u), offset),
            dot(triple(record + 11u), offset),
        );
        return vec4<f32>(unit, beyond_region(kind, unit) - rim);
    }
    let cr = triple(record + 5u);
    let cs = triple(record + 8u);
    let ct = triple(record + 11u);
    let crs = triple(record + 14u);
    let cst = triple(record + 17u);
    let crt = triple(record + 20u);
    let crst = triple(record + 23u);
    var unit = select(vec3<f32>(0.5), vec3<f32>(1.0 / 3.0, 1.0 / 3.0, 0.5), kind == WEDGE);
    if kind == PYRAMID {
        unit = vec3<f32>(0.5, 0.5, 0.25);
    }
    var last = 1.0;
    for (var i = 0u; i < MOST_NEWTON_STEPS; i++) {
        let along_t = ct + cst * unit.y + (crt + crst * unit.y) * unit.x;
        let along_s = cs + crs * unit.x + (cst + crst * unit.x) * unit.z;
        let along_r = cr + crs * unit.y + (crt + crst * unit.y) * unit.z;
        let here = cr * unit.x + (cs + crs * unit.x) * unit.y + along_t * unit.z;
        let off = offset - here;
        let across = cross(along_s, along_t);
        let determinant = dot(along_r, across);
        if abs(determinant) <= 1e-20 {
            break;
        }
        let by = vec3<f32>(
            dot(off, across),
            dot(off, cross(along_t, along_r)),
            dot(off, cross(along_r, along_s)),
        ) / determinant;
        unit = clamp(unit + by, vec3<f32>(-1.0), vec3<f32>(2.0));
        last = max(abs(by.x), max(abs(by.y), abs(by.z)));
        if last <= SHORT_STEP {
            break;
        }
    }
    let outside = beyond_region(kind, unit) - rim;
    return vec4<f32>(unit, select(outside, 1.0, last > 30.0 * SHORT_STEP));
}

// The cell that a position lies in, the first of several.
fn cell_at(position: vec3<f32>) -> InCell {
    let boxes = vec3<u32>(word(2u), word(3u), word(4u));
    let last = vec3<f32>(boxes - vec3<u32>(1u));
    let box = vec3<u32>(clamp(floor((position + 0.5) / number(5u)), vec3<f32>(0.0), last));
    let at = 7u + (box.z * boxes.y + box.y) * boxes.x + box.x;
    let end = word(at + 1u);
    let lists = word(0u);
    for (var i = word(at); i < end; i++) {
        let record = word(lists + i);
        // The box of what is no tetrahedron stands in front of its record.
        if kind_of(record) != TETRAHEDRON
            && (any(position < triple(record - 6u)) || any(position > triple(record - 3u)))
        {
            continue;
        }
        let found = unit_in(record, position);
        if found.w <= 0.0 {
            return InCell(record, found.xyz);
        }
    }
    return InCell(0u, vec3<f32>(0.0));
}

// The stored value at a place of a cell; nothing outside all of them.
fn value_in(found: InCell) -> f32 {
    if found.record == 0u {
        return NOTHING;
    }
    let unit = clamp(found.unit, vec3<f32>(0.0), vec3<f32>(1.0));
    if kind_of(found.record) == TETRAHEDRON {
        let at = found.record + 14u;
        return number(at) + dot(triple(at + 1u), unit);
    }
    let at = found.record + 26u;
    let straight = number(at) + dot(triple(at + 1u), unit);
    let products = vec3<f32>(unit.x * unit.y, unit.y * unit.z, unit.x * unit.z);
    return straight + dot(triple(at + 4u), products) + number(at + 7u) * products.x * unit.z;
}

// Where the numbers of a cell's corners are, and how many.
fn corners_of(record: u32) -> vec2<u32> {
    let kind = kind_of(record);
    let counts = vec4<u32>(4u, 5u, 6u, 8u);
    return vec2<u32>(record + select(34u, 18u, kind == TETRAHEDRON), counts[kind]);
}

// The shape function of a corner.
fn weight_of(kind: u32, corner: u32, unit: vec3<f32>) -> f32 {
    if kind == TETRAHEDRON {
        return vec4<f32>(1.0 - unit.x - unit.y - unit.z, unit)[corner];
    }
    if kind == WEDGE {
        let ring = vec3<f32>(1.0 - unit.x - unit.y, unit.x, unit.y);
        return ring[corner % 3u] * select(unit.z, 1.0 - unit.z, corner < 3u);
    }
    let below = 1.0 - unit.z;
    if kind == PYRAMID && corner == 4u {
        return unit.z;
    }
    let rest = 1.0 - unit.xy;
    let ring = vec4<f32>(rest.x * rest.y, unit.x * rest.y, unit.x * unit.y, rest.x * unit.y);
    return ring[corner & 3u] * select(unit.z, below, corner < 4u);
}

// Of the range of a cell's stored values, how much one may be off a level that the field still has there, as
// `cells::CellField::slack` defines it.
const LEVEL_SLACK: f32 = 0.0625;

// How far the stored value in a cell may be off a level that the field has there.
fn slack_in(found: InCell) -> f32 {
    if found.record == 0u {
        return 0.0;
    }
    let kind = kind_of(found.record);
    var least = 0.0;
    var most = 0.0;
    if kind == TETRAHEDRON {
        let growth = triple(found.record + 15u);
        least = min(0.0, min(growth.x, min(growth.y, growth.z)));
        most = max(0.0, max(growth.x, max(growth.y, growth.z)));
    } else {
        least = number(found.record + 26u);
        most = least;
        // Where t is 1 a pyramid has one value, whatever r and s are.
        for (var i = 1u; i < 8u; i++) {
            if kind == WEDGE && (i & 3u) == 3u {
                continue;
            }
            let corner = vec3<f32>(vec3<u32>(i & 1u, (i >> 1u) & 1u, i >> 2u));
            let at_corner = value_in(InCell(found.record, corner));
            least = min(least, at_corner);
            most = max(most, at_corner);
        }
    }
    return (LEVEL_SLACK + max(number(found.record + 1u), 0.0)) * (most - least);
}

// What values grow by per index at a place of a cell, as recovered at its corners.
fn growth_in(found: InCell) -> vec3<f32> {
    if found.record == 0u {
        return vec3<f32>(0.0);
    }
    let kind = kind_of(found.record);
    let unit = clamp(found.unit, vec3<f32>(0.0), vec3<f32>(1.0));
    let corners = corners_of(found.record);
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < corners.y; i++) {
        sum += triple(word(1u) + 3u * word(corners.x + i)) * weight_of(kind, i, unit);
    }
    return sum;
}

// Less of a ray than this crosses a face that it goes along (`cells::LitFace`).
const ALONG: f32 = 1e-3;

// What light that falls on borders takes for that, for a ray through a position in a direction
// (`cells::ShadingNormals`).
fn growth_for_light(found: InCell, position: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    if found.record == 0u {
        return vec3<f32>(0.0);
    }
    let kind = kind_of(found.record);
    let unit = clamp(found.unit, vec3<f32>(0.0), vec3<f32>(1.0));
    let corners = corners_of(found.record);
    // Of the outer face that the ray came in through, where there is one.
    var own = corners.x;
    let faces = own + corners.y;
    let forward = normalize(direction);
    var nearest = -3e38;
    for (var i = 0u; i < word(faces); i++) {
        let face = faces + 1u + i * (4u + corners.y);
        let inwards = triple(face);
        let height = abs(dot(inwards, position) - number(face + 3u));
        let slope = dot(inwards, forward);
        let entered = slope / max(height, 1e-20);
        let nearness = select(-height / max(-slope, ALONG), entered, slope > ALONG);
        if nearness > nearest {
            nearest = nearness;
            own = face + 4u;
        }
    }
    var border = vec3<f32>(0.0);
    var inside = vec3<f32>(0.0);
    for (var i = 0u; i < corners.y; i++) {
        let normal = word(6u) + 4u * word(own + i);
        let growth = triple(normal) * weight_of(kind, i, unit);
        let is_on_border = number(normal + 3u) > 0.0;
        border += select(vec3<f32>(0.0), growth, is_on_border);
        inside += select(growth, vec3<f32>(0.0), is_on_border);
    }
    // A surface and its back are lit alike.
    return border + inside * select(1.0, -1.0, dot(border, inside) < 0.0);
}

// Which of the file's cells a position lies in; a number that none has outside all of them.
fn source_at(position: vec3<f32>) -> u32 {
    let record = cell_at(position).record;
    return select(word(record) >> 2u, 0xffffffffu, record == 0u);
}

// How many of the four places half a pixel beside one on a plane lie in another cell.
fn edge_share(ray: Ray, plane: vec4<f32>, place: vec3<f32>) -> f32 {
    // A loop, so that a compiler holds the search for a cell once.
    var own = 0u;
    var share = 0.0;
    for (var i = 0u; i < 5u; i++) {
        let along = select(slabs.up.xyz, slabs.right.xyz, i < 3u);
        let side = along * select(0.5, -0.5, (i & 1u) == 1u);
        let origin = ray.origin + side * slabs.right.w;
        let direction = ray.direction + side * slabs.up.w;
        let growth = dot(plane.xyz, direction);
        let t = (plane.w - dot(plane.xyz, origin)) / select(growth, 1e-20, abs(growth) < 1e-20);
        let source = source_at(select(origin + direction * t, place, i == 0u));
        if i == 0u {
            own = source;
        } else if source != own {
            share += 0.25;
        }
    }
    return share;
}

// What a field that ends somewhere, of cells or of ellipsoids about points, has at a position, as stored, and what it grows
// by per index.
fn stored_value(position: vec3<f32>) -> f32 {
    if kernel == ELLIPSOIDS {
        return sum_of_functions(position).w;
    }
    return value_in(cell_at(position));
}

fn stored_growth(position: vec3<f32>) -> vec3<f32> {
    if kernel == ELLIPSOIDS {
        return sum_of_functions(position).xyz;
    }
    return growth_in(cell_at(position));
}

// A slab that ends where its ray enters the field and leaves it.
struct Trimmed {
    ts: vec2<f32>,
    us: vec2<f32>,
}

// The part of a slab between its faces that lies in the cells which the field is samples of.
fn cut_off(origin: vec3<f32>, direction: vec3<f32>, slab: Trimmed) -> Trimmed {
    let depths = vec2<f32>(
        depth_at(origin + direction * slab.ts.x).w,
        depth_at(origin + direction * slab.ts.y).w,
    );
    let are_outside = depths < vec2<f32>(0.0);
    if !any(are_outside) {
        return slab;
    }
    // Between two faces outside may lie an edge of the cells.
    let middle = 0.5 * (slab.ts.x + slab.ts.y);
    let at_middle = depth_at(origin + direction * middle).w;
    let is_edge = all(are_outside);
    if is_edge && at_middle < 0.0 {
        return Trimmed(slab.ts, vec2<f32>(NOTHING));
    }
    let to = select(slab.ts.yx, vec2<f32>(middle), is_edge);
    let rise = select(depths.yx, vec2<f32>(at_middle), is_edge) - depths;
    let share = -depths / select(vec2<f32>(1.0), rise, are_outside);
    let ts = select(slab.ts, slab.ts + (to - slab.ts) * share, are_outside);
    var us = slab.us;
    for (var end = 0; end < 2; end++) {
        if are_outside[end] {
            us[end] = value(origin + direction * ts[end]).x;
        }
    }
    return Trimmed(ts, us);
}

// A slab by its faces' depths and values, of which one lies outside the field, or both. One loop, so that a compiler
// holds the search for a cell once: first places between two faces outside are looked at, as a thin part of the field may
// lie there; then what is left on either side is halved in turns.
fn trimmed(origin: vec3<f32>, direction: vec3<f32>, slab: Trimmed) -> Trimmed {
    // The first and the last place that lies inside, and the values there.
    var ts = slab.ts;
    var us = slab.us;
    let are_outside = slab.us == vec2<f32>(NOTHING);
    let looks = select(0u, PLACES_BETWEEN, all(are_outside));
    if are_outside.x && looks == 0u {
        ts.x = slab.ts.y;
        us.x = slab.us.y;
    }
    if are_outside.y && looks == 0u {
        ts.y = slab.ts.x;
        us.y = slab.us.x;
    }
    // The places nearest to them that are known to lie outside.
    var outside = slab.ts;
    for (var i = 0u; i < looks + 2u * BORDER_STEPS; i++) {
        let is_look = i < looks;
        let is_far = ((i - looks) & 1u) == 1u;
        if !is_look && (us.x == NOTHING || !select(are_outside.x, are_outside.y, is_far)) {
            continue;
        }
        let between = select(0.5 * (ts.x + outside.x), 0.5 * (ts.y + outside.y), is_far);
        let at = mix(slab.ts.x, slab.ts.y, f32(i + 1u) / f32(PLACES_BETWEEN + 1u));
        let t = select(between, at, is_look);
        let stored = stored_value(origin + direction * t);
        if stored == NOTHING {
            if !is_look && is_far {
                outside.y = t;
            } else if !is_look {
                outside.x = t;
            }
            continue;
        }
        let u = slabs.table.x + slabs.table.y * stored;
        let is_first = select(!is_far, us.x == NOTHING, is_look);
        if is_first {
            ts.x = t;
            us.x = u;
        }
        if is_look || is_far {
            ts.y = t;
            us.y = u;
        }
    }
    return Trimmed(ts, us);
}

// Westover's shading: tables of opacity, modulation, reflection and emission by any index, and
// directional lights (`scene::shading` has the equations). A slab has the gradients on its faces, which share
// their samples with the values there, or that in its middle where only that is classified. Lights fall on all
// between the two, and tables look up their mean.

const SHADED: bool = true;
// Cells of each table.
const SHADE_CELLS: u32 = 255u;
const OPACITY: u32 = 0u;
const MODULATION: u32 = 1u;
const REFLECTION: u32 = 2u;
const EMISSION: u32 = 3u;

// What a table is indexed by; 0: there is no table.
const BY_NOTHING: u32 = 0u;
const BY_VALUE: u32 = 1u;
const BY_STRENGTH: u32 = 2u;
const BY_ELEVATION: u32 = 3u;
const BY_AZIMUTH: u32 = 4u;

override opacity_by: u32 = 0u;
override modulation_by: u32 = 0u;
override reflection_by: u32 = 0u;
override emission_by: u32 = 0u;
override lit: bool = false;
override lights: u32 = 0u;
override uses_gradient: bool = false;
// Regions that opacities are by, in place of values.
override region_count: u32 = 0u;

struct Shade {
    // Rows: world gradient, data units per world unit, of one in index space in cells of the slab
    // table. w: of the first, 1 over the strength below which it has no direction; of the second, what light
    // takes for the growth where cells end, or how far apart numbers that name things are at most; of the last, 1 over
    // the weight by value where opacities have another index.
    world_x: vec4<f32>,
    world_y: vec4<f32>,
    world_z: vec4<f32>,
    // To the right, up and into the picture, in the world. w: radius of the volume's sphere, pixels;
    // growth of a ray's step per pixel of depth.
    right: vec4<f32>,
    up: vec4<f32>,
    forward: vec4<f32>,
    // Ambient, diffuse, specular, exponent.
    material: vec4<f32>,
    // Unit vectors towards the lights, in the world; their colours.
    towards: array<vec4<f32>, 8>,
    colours: array<vec4<f32>, 8>,
    // Where in its table an index q is: x + y * q.
    places: array<vec4<f32>, 4>,
    // Opacities and factors in x; colours.
    tables: array<vec4<f32>, 1024>,
    // Of regions: the middle along value, in cells of the slab table, and 1 over half the width; the same along
    // strength.
    region_places: array<vec4<f32>, 16>,
    // Linear colour; w: opacity.
    region_looks: array<vec4<f32>, 16>,
    // 1 over the softness; 1 for an ellipse; 1 for a triangle; 1 where the colour is that of the value.
    region_shapes: array<vec4<f32>, 16>,
}

// Uniform: no branch depends on it, and storage buffers are few.
@group(0) @binding(9) var<uniform> shade: Shade;

// A table's entry for an index.
fn looked_up(table: u32, index: f32) -> vec4<f32> {
    let place = shade.places[table].x + shade.places[table].y * index;
    let at = clamp(place, 0.0, f32(SHADE_CELLS));
    let cell = min(u32(at), SHADE_CELLS - 1u);
    let first = table * (SHADE_CELLS + 1u) + cell;
    return mix(shade.tables[first], shade.tables[first + 1u], at - f32(cell));
}

// What is known of a point that tables are indexed by.
struct Point {
    // Cells of the slab table.
    u: f32,
    strength: f32,
    // Down the gradient; 0 where it has no direction.
    normal: vec3<f32>,
    // 0 to 1.
    depth: f32,
}

fn index_of(by: u32, point: Point) -> f32 {
    let n = point.normal;
    let flat = n.x == 0.0 && n.y == 0.0;
    switch by {
        case BY_VALUE: { return point.u; }
        case BY_STRENGTH: { return point.strength; }
        case BY_ELEVATION: { return degrees(asin(clamp(n.z, -1.0, 1.0))); }
        case BY_AZIMUTH: { return degrees(atan2(n.y, select(n.x, 1.0, flat))); }
        default: { return point.depth; }
    }
}

// What lights make of a surface: the factor of its colour, and what it mirrors.
struct Lit {
    colour: vec3<f32>,
    mirrored: vec3<f32>,
}

// `share` of the lights falls on a face, and the rest on what scatters it to all sides: a half of it, as faces turned every way
// do in the mean.
fn lit_by(normal: vec3<f32>, eye: vec3<f32>, share: f32) -> Lit {
    // Turned to the eye: what faces away shows its back.
    return lit_side(select(normal, -normal, dot(normal, eye) < 0.0), eye, share);
}

// The same of a face on the side of the eye.
fn lit_side(facing: vec3<f32>, eye: vec3<f32>, share: f32) -> Lit {
    var found = Lit(vec3<f32>(shade.material.x), vec3<f32>(0.0));
    for (var i = 0u; i < lights; i++) {
        let towards = shade.towards[i].xyz;
        let cosine = dot(facing, towards);
        let reflected = 2.0 * cosine * facing - towards;
        let mirror = pow(max(dot(reflected, eye), 1e-6), shade.material.w);
        let falls = shade.colours[i].rgb * share;
        let evenly = shade.colours[i].rgb * (0.5 * (1.0 - share));
        found.colour += shade.material.y * (falls * max(cosine, 0.0) + evenly);
        found.mirrored += falls * (shade.material.z * select(0.0, mirror, cosine > 0.0));
    }
    return found;
}

// What a gradient says of a surface.
struct Facing {
    strength: f32,
    // Of the lights that falls on it.
    share: f32,
    // Down the gradient; 0 where it has no direction.
    normal: vec3<f32>,
}

fn in_world(g: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(shade.world_x.xyz, g),
        dot(shade.world_y.xyz, g),
        dot(shade.world_z.xyz, g),
    );
}

fn greatest(v: vec3<f32>) -> f32 {
    return max(abs(v.x), max(abs(v.y), abs(v.z)));
}

// Of a growth per index.
fn facing(g: vec3<f32>) -> Facing {
    let world = in_world(g);
    // By its greatest part: squares of tiny ones are 0.
    let most = greatest(world);
    let scaled = world / max(most, 1e-37);
    let strength = most * length(scaled);
    let share = clamp(strength * shade.world_x.w - 1.0, 0.0, 1.0);
    let normal = select(vec3<f32>(0.0), -scaled / max(length(scaled), 1e-6), share > 0.0);
    return Facing(strength, share, normal);
}

fn add_lit(sum: ptr<function, Lit>, light: Lit, weight: f32) {
    (*sum).colour += weight * light.colour;
    (*sum).mirrored += weight * light.mirrored;
}

// Light on a face across a growth of some length, on one side. `strength` is 1 of a length where the least begins that has a
// direction.
fn lit_across(g: vec3<f32>, extent: f32, side: f32, eye: vec3<f32>, strength: f32) -> Lit {
    let share = clamp(extent * strength - 1.0, 0.0, 1.0);
    return lit_side(g * (side / max(extent, 1e-6)), eye, share);
}

// Light on a part of a slab, along which the growth goes straight from one to another and faces have one side to the eye: on the
// faces at its ends, and on the one halfway in direction, which parts its length as theirs are. Each end is weighed by its length.
fn lit_part(near: vec3<f32>, far: vec3<f32>, side: f32, eye: vec3<f32>, strength: f32) -> Lit {
    let begin = length(near);
    let end = length(far);
    let share = 1.0 / max(begin + end, 1e-30);
    let before = begin * share;
    let behind = end * share;
    let middle = behind * near + before * far;
    let halfway = length(middle);
    let near_weight = before * (begin / max(begin + halfway, 1e-30));
    let far_weight = behind * (end / max(end + halfway, 1e-30));
    var sum = Lit(vec3<f32>(0.0), vec3<f32>(0.0));
    add_lit(&sum, lit_across(near, begin, side, eye, strength), near_weight);
    add_lit(&sum, lit_across(middle, halfway, side, eye, strength), 1.0 - near_weight - far_weight);
    add_lit(&sum, lit_across(far, end, side, eye, strength), far_weight);
    return sum;
}

// Light on a slab, of the growths per index on its faces.
fn lit_between(g_near: vec3<f32>, g_far: vec3<f32>, eye: vec3<f32>) -> Lit {
    var near = in_world(g_near);
    var far = in_world(g_far);
    // By their greatest part: squares of tiny ones are 0.
    let most = max(greatest(near), greatest(far));
    near /= max(most, 1e-37);
    far /= max(most, 1e-37);
    let strength = most * shade.world_x.w;
    let ways = vec2<f32>(dot(near, eye), dot(far, eye));
    let side = select(1.0, -1.0, ways.x < 0.0);
    if (ways.x < 0.0) == (ways.y < 0.0) {
        return lit_part(near, far, side, eye, strength);
    }
    // Where it lies across the ray, faces turn their other side to the eye.
    let share = abs(ways.x) / (abs(ways.x) + abs(ways.y));
    let edge = mix(near, far, share);
    var sum = Lit(vec3<f32>(0.0), vec3<f32>(0.0));
    add_lit(&sum, lit_part(near, edge, side, eye, strength), share);
    add_lit(&sum, lit_part(edge, far, -side, eye, strength), 1.0 - share);
    return sum;
}

// A slab as the regions of the plane of value and gradient strength paint it (`transfer::regions` has the
// definition); as it is where there are none.
fn painted(found: Halves, u: f32, strength: f32) -> Halves {
    if region_count == 0u {
        return found;
    }
    // Of the colours that regions have of their own, times extinction; extinction of the others.
    var own = vec3<f32>(0.0);
    var by_value = 0.0;
    var depth = 0.0;
    for (var i = 0u; i < region_count; i++) {
        let place = shade.region_places[i];
        let look = shade.region_looks[i];
        let shape = shade.region_shapes[i];
        let x = abs((u - place.x) * place.y);
        let y = (strength - place.z) * place.w;
        let in_box = max(x, abs(y));
        // Nothing is below a triangle's lower corner.
        let in_triangle = max(x / max(0.5 + 0.5 * y, 1e-6), y);
        let bent = select(in_box, length(vec2<f32>(x, y)), shape.y > 0.5);
        let way = select(bent, in_triangle, shape.z > 0.5);
        let alpha = look.w * clamp((1.0 - way) * shape.x, 0.0, 1.0);
        let part = -log(1.0 - min(alpha, 0.9999));
        depth += part;
        own += look.rgb * select(part, 0.0, shape.w > 0.5);
        by_value += select(0.0, part, shape.w > 0.5);
    }
    let weight = select(depth, 1.0 - exp(-depth), published) * shade.world_z.w;
    let share = 1.0 / max(depth, 1e-30);
    let near = (own + by_value * found.near.rgb) * share;
    let far = (own + by_value * found.far.rgb) * share;
    return Halves(vec4<f32>(near, found.near.w * weight), vec4<f32>(far, found.far.w * weight));
}

// Colours and weights of a slab whose middle is `t` pixels deep on the ray through a point of the
// screen, with the value of cell `u` and the growths `g` per index on its faces, or twice that at one place.
fn shaded(slab: Halves, u: f32, g: Growths, t: f32, screen: vec2<f32>) -> Halves {
    var point = Point(u, 0.0, vec3<f32>(0.0), 0.5 + 0.5 * t / shade.right.w);
    var share = 0.0;
    if uses_gradient {
        let found_facing = facing(0.5 * (g.near + g.far));
        point.strength = found_facing.strength;
        share = found_facing.share;
        point.normal = found_facing.normal;
    }
    let found = painted(slab, u, point.strength);
    var factor = 1.0;
    if opacity_by != BY_NOTHING {
        let alpha = min(looked_up(OPACITY, index_of(opacity_by, point)).x, 0.9999);
        factor = select(-log(1.0 - alpha), alpha, published) * shade.world_z.w;
    }
    if modulation_by != BY_NOTHING {
        factor *= looked_up(MODULATION, index_of(modulation_by, point)).x;
    }
    var near = found.near.rgb;
    var far = found.far.rgb;
    if reflection_by != BY_NOTHING {
        near = looked_up(REFLECTION, index_of(reflection_by, point)).rgb;
        far = near;
    }
    if lit {
        let along = (shade.right.xyz * screen.x + shade.up.xyz * screen.y) * shade.up.w;
        let eye = -normalize(shade.forward.xyz + along);
        var light: Lit;
        if !uses_gradient || all(g.near == g.far) {
            light = lit_by(point.normal, eye, share);
        } else {
            light = lit_between(g.near, g.far, eye);
        }
        near = near * light.colour + light.mirrored;
        far = far * light.colour + light.mirrored;
    }
    if emission_by != BY_NOTHING {
        let emitted = looked_up(EMISSION, index_of(emission_by, point)).rgb;
        near += emitted;
        far += emitted;
    }
    return Halves(vec4<f32>(near, found.near.w * factor), vec4<f32>(far, found.far.w * factor));
}

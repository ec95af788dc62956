// Vector splats in the slabs along a ray: Crawfis and Max's textures, MODULATE and BLEND.
//
// A ray walks its tile's list beside whatever else it walks. Splats come layer by layer; what they give
// the slabs of a layer is summed up, and the slabs are composited when the ray comes by: those before
// the slab that is asked for on their own, that one together with what else is in it.

const VECTORS: bool = true;

@group(0) @binding(15) var<storage, read> vectors: Vectors;
// Of `count_vectors`, four a splat.
@group(0) @binding(16) var<storage, read> vector_splats: array<vec4<f32>>;
@group(0) @binding(17) var<storage, read> vector_keys: array<u32>;
@group(0) @binding(18) var<storage, read> vector_words: array<u32>;
@group(0) @binding(19) var<storage, read> vector_ranges: array<vec2<u32>>;
// Intensities: of a foreshortening and the next one (second pair), of a phase and the next one.
@group(0) @binding(20) var marks: texture_2d_array<f32>;

// Slabs in a layer of the lists.
const LAYER_SLABS: i32 = 4;
const PHASES: u32 = 16u;
const FORESHORTENINGS: u32 = 12u;
// Less depth than this changes no picture.
const LEAST_AMOUNT: f32 = 1e-7;
// No slab of any volume.
const EVERY_SLAB: i32 = 0x3fffffff;
struct VectorRay {
    // The next entry of the list, and the one after its last.
    entry: u32,
    end: u32,
    // Slabs in the order of compositing: the first of the layer that was summed up, the next to be
    // composited, and the one after its last.
    begin: i32,
    next: i32,
    after: i32,
    // What lies between these depths is kept.
    kept: vec2<f32>,
    // How many slabs of the field have taken their share of the next one.
    taken: i32,
    // Their emission and matter.
    slab0: vec4<f32>,
    slab1: vec4<f32>,
    slab2: vec4<f32>,
    slab3: vec4<f32>,
}

fn vector_ray(pixel: vec2<u32>, kept: vec2<f32>) -> VectorRay {
    let tile = vec2<i32>(pixel / TILE) - vec2<i32>(0, vectors.layers.z);
    let range = vector_ranges[u32(tile.y * vectors.layers.w + tile.x)];
    let none = vec4<f32>(0.0);
    // Of nothing, one place.
    let kept_ends = vec2<f32>(kept.x, max(kept.x, kept.y));
    return VectorRay(range.x, range.y, 0, 0, 0, kept_ends, 0, none, none, none, none);
}

// Of a slab, pixels of view depth.
fn vectors_thickness() -> f32 {
    return vectors.depth.y;
}

// Intensity of the marks at a place of the window, -1 to 1; and what that does to a colour (`Marks::light`).
fn mark_at(place: vec2<f32>, word: u32, second: bool) -> vec2<f32> {
    let is_round = select(vectors.flags.z, vectors.second_flags.z, second) == COORDINATES;
    let across = f32(word >> 12u & 0xfffu) * (1.0 / 4095.0);
    let turns = fract(vectors.depth.w + f32(word & 0xfffu) * (1.0 / 4096.0)) * f32(PHASES);
    let early = min(floor(turns), f32(PHASES - 1u));
    let column = across * f32(FORESHORTENINGS - 1u);
    let low = min(floor(column), f32(FORESHORTENINGS - 2u));
    let share = select(column - low, 0.0, is_round);
    let layer = i32(select(u32(low), FORESHORTENINGS, is_round) * PHASES + u32(early));
    let level = i32(word >> 24u);
    let side = i32(MARK_SIDE >> u32(level));
    let stretched = vec2<f32>(place.x / max(across, LEAST_ACROSS), place.y);
    let texel = (select(place, stretched, is_round) * 0.5 + 0.5) * f32(side) - 0.5;
    let corner = floor(texel);
    let f = texel - corner;
    let at = vec2<i32>(corner);
    // The side is a power of two.
    let x = select(
        clamp(vec2<i32>(at.x, at.x + 1), vec2<i32>(0), vec2<i32>(side - 1)),
        vec2<i32>(at.x, at.x + 1) & vec2<i32>(side - 1),
        is_round,
    );
    let rows = clamp(vec2<i32>(at.y, at.y + 1), vec2<i32>(0), vec2<i32>(side - 1));
    // A second table is below the first.
    let y = rows + select(0, i32(vectors.second_flags.w) * side, second);
    let low_row = mix(
        textureLoad(marks, vec2<i32>(x.x, y.x), layer, level),
        textureLoad(marks, vec2<i32>(x.y, y.x), layer, level),
        f.x,
    );
    let high_row = mix(
        textureLoad(marks, vec2<i32>(x.x, y.y), layer, level),
        textureLoad(marks, vec2<i32>(x.y, y.y), layer, level),
        f.x,
    );
    let found = mix(low_row, high_row, f.y);
    let of_columns = mix(found.xz, found.yw, turns - early);
    let mark = mix(of_columns.x, of_columns.y, share);
    let blur = select(0u, BLURS * vectors.second_flags.w, second)
        + BLUR_COLUMNS * u32(level) + select(u32(low), FORESHORTENINGS, is_round);
    let lost = mix(vectors.blur[blur], vectors.blur[blur + 1u], share);
    return vec2<f32>(mark, mark + lost * (1.0 - mark));
}

// Sums up the splats of the layer that the list comes to.
fn sum_layer(ray: ptr<function, VectorRay>, screen: vec2<f32>, nearest: f32, slant: f32) {
    let mask = (1u << vectors.flags.w) - 1u;
    let own = vector_keys[(*ray).entry] & mask;
    let thickness = vectors.depth.y;
    var sum0 = vec4<f32>(0.0);
    var sum1 = vec4<f32>(0.0);
    var sum2 = vec4<f32>(0.0);
    var sum3 = vec4<f32>(0.0);
    var entry = (*ray).entry;
    while entry < (*ray).end {
        if (vector_keys[entry] & mask) != own {
            break;
        }
        let splat = vector_words[entry];
        let at = 4u * splat;
        let head = vector_splats[at];
        let first = vector_splats[at + 1u];
        let right = screen.x - head.x;
        let up = screen.y - head.y;
        let unit = vec2<f32>(first.x * right, first.y * right + first.z * up);
        let q = dot(unit, unit);
        if q < 1.0 {
            let of_second = is_second(splat);
            let is_blend = select(vectors.flags.y, vectors.second_flags.y, of_second) == BLEND;
            // Of the circle that the ellipse becomes, in the window of the marks.
            let window = 1.0 / select(vectors.picture.z, vectors.second_z.w, of_second);
            let second = vector_splats[at + 2u];
            let packed = bitcast<vec4<u32>>(vector_splats[at + 3u]);
            let turned = vec2<f32>(
                second.z * unit.x + second.w * unit.y,
                second.z * unit.y - second.w * unit.x,
            );
            let windowed = max(footprint(q * window * window) * vectors.picture.w, 0.0);
            let marked = mark_at(turned * window, packed.w, of_second) * windowed;
            let intensity = marked.x;
            let rg = unpack2x16unorm(packed.x);
            let b_r = unpack2x16unorm(packed.y);
            let gb = unpack2x16unorm(packed.z);
            let body = vec3<f32>(rg, b_r.x);
            let of_marks = vec3<f32>(b_r.y, gb);
            // The printed operators: of the colour, then of the opacity.
            let colour = select(body * marked.y, mix(body, of_marks, intensity), is_blend);
            let texture = select(intensity, max(footprint(q), 0.0), is_blend);
            let amount = head.w * texture * slant;
            // Between the marks there is nothing to share out.
            if amount > LEAST_AMOUNT {
                let middle = head.z + second.x * right + second.y * up;
                let per_depth = first.w * inverseSqrt(max(1.0 - q, 1e-12));
                let before = (nearest - middle) * per_depth;
                let step = thickness * per_depth;
                // Of what is cut away nothing.
                let low = ((*ray).kept.x - middle) * per_depth;
                let high = ((*ray).kept.y - middle) * per_depth;
                let share0 = share(q, clamp(before, low, high));
                let share1 = share(q, clamp(before + step, low, high));
                let share2 = share(q, clamp(before + 2.0 * step, low, high));
                let share3 = share(q, clamp(before + 3.0 * step, low, high));
                let share4 = share(q, clamp(before + 4.0 * step, low, high));
                let light = vec4<f32>(colour, 1.0) * amount;
                // Rounding must not take anything away: what is divided by later would be of either sign.
                sum0 += light * max(share1 - share0, 0.0);
                sum1 += light * max(share2 - share1, 0.0);
                sum2 += light * max(share3 - share2, 0.0);
                sum3 += light * max(share4 - share3, 0.0);
            }
        }
        entry++;
    }
    (*ray).entry = entry;
    (*ray).slab0 = select(sum0, sum3, back_to_front);
    (*ray).slab1 = select(sum1, sum2, back_to_front);
    (*ray).slab2 = select(sum2, sum1, back_to_front);
    (*ray).slab3 = select(sum3, sum0, back_to_front);
}

fn slab_sum(ray: ptr<function, VectorRay>, slab: i32) -> vec4<f32> {
    let i = slab - (*ray).begin;
    let early = select((*ray).slab1, (*ray).slab0, i == 0);
    let late = select((*ray).slab3, (*ray).slab2, i == 2);
    return select(late, early, i < 2);
}

// Depths between which a slab lies, the first on the way first.
fn slab_ends(slab: i32) -> vec2<f32> {
    let nearer = f32(select(slab, -slab, back_to_front)) * vectors.depth.y;
    let ends = vec2<f32>(nearer, nearer + vectors.depth.y);
    return select(ends, ends.yx, back_to_front);
}

// Composites the slabs that were summed up and lie before one. Here and below slabs are counted in the order of
// compositing, from the lattice's centre; EVERY_SLAB is after all.
fn lay_slabs_before(
    ray: ptr<function, VectorRay>,
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    slab: i32,
) {
    for (; (*ray).next < min(slab, (*ray).after); (*ray).next++) {
        let left = vectors.field_slabs.x - (*ray).taken;
        let sum = slab_sum(ray, (*ray).next) * (f32(left) / f32(vectors.field_slabs.x));
        let ends = slab_ends((*ray).next);
        (*ray).taken = 0;
        lay_vectors(light, met, sum, clamp(ends, (*ray).kept.xx, (*ray).kept.yy));
    }
}

// The first slab of the field in a slab of vectors, which may be thicker.
fn field_slab(slab: i32) -> i32 {
    let most = vectors.field_slabs.x;
    let first = most * slab - select(0, most - 1, back_to_front);
    return select(first, EVERY_SLAB, slab == EVERY_SLAB);
}

// The slab of vectors that one of the field lies in.
fn slab_of_vectors(slab: i32) -> i32 {
    let most = vectors.field_slabs.x;
    let below = select(select(0, most - 1, slab < 0), select(0, most - 1, slab > 0), back_to_front);
    return (slab + select(-below, below, back_to_front)) / most;
}

// What vectors give a slab of the field, before whose own all is composited: emission and matter, an equal share
// for each.
fn take_slab(ray: ptr<function, VectorRay>, slab: i32) -> vec4<f32> {
    var found = vec4<f32>(0.0);
    if (*ray).next == slab && slab < (*ray).after {
        found = slab_sum(ray, slab) / f32(vectors.field_slabs.x);
        (*ray).taken += 1;
        let is_last = (*ray).taken == vectors.field_slabs.x;
        (*ray).next += i32(is_last);
        (*ray).taken = select((*ray).taken, 0, is_last);
    }
    return found;
}

// The first slab of the layer that the list comes to.
fn next_layer(ray: VectorRay) -> i32 {
    if ray.entry >= ray.end {
        return EVERY_SLAB;
    }
    let own = i32(vector_keys[ray.entry] & ((1u << vectors.flags.w) - 1u));
    let layer = select(own, vectors.layers.y - 1 - own, back_to_front) + vectors.layers.x;
    let nearest = LAYER_SLABS * layer;
    return select(nearest, 1 - nearest - LAYER_SLABS, back_to_front);
}

// Sums up that layer, once the slabs of the one before are composited.
fn sum_next_layer(ray: ptr<function, VectorRay>, screen: vec2<f32>) {
    let begin = next_layer(*ray);
    let nearest = select(begin, 1 - begin - LAYER_SLABS, back_to_front);
    let slant = length(vec3<f32>(screen * frame_growth(), 1.0));
    sum_layer(ray, screen, f32(nearest) * vectors.depth.y, slant);
    (*ray).begin = begin;
    (*ray).next = begin;
    (*ray).after = begin + LAYER_SLABS;
}

// Composites every slab of vectors before one, as they are counted from the front, and returns what they give
// that one.
fn vectors_in(
    ray: ptr<function, VectorRay>,
    light: ptr<function, Gathered>,
    met: ptr<function, Met>,
    slab: i32,
    screen: vec2<f32>,
) -> vec4<f32> {
    let until = select(slab, select(-slab, EVERY_SLAB, slab == EVERY_SLAB), back_to_front);
    while left_of(*light) >= vectors.depth.z {
        lay_slabs_before(ray, light, met, until);
        let is_behind = next_layer(*ray) > until || (*ray).entry >= (*ray).end;
        if (*ray).next < (*ray).after || is_behind {
            break;
        }
        sum_next_layer(ray, screen);
    }
    return take_slab(ray, until);
}

// A part of a slab, beside so much of vectors.
fn composite_beside(
    light: ptr<function, Gathered>,
    colour: vec3<f32>,
    amount: f32,
    beside: vec4<f32>,
) {
    let sum = amount + beside.a;
    composite(light, (colour * amount + beside.rgb) / max(sum, 1e-30), sum);
}

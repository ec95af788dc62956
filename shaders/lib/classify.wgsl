// Colour and weight of a value, and of all values between two: from the table of the transfer function
// and its integrals.

// Part of a cell by which values are lifted, so that rounding does not take one out of the cell that
// begins with it.
const LIFT_CELLS: f32 = 0.0625;
// Values nearer to each other than this many cells are classified by the one in their middle: single
// precision has too few digits for the difference of their integrals.
const NEAR_CELLS: f32 = 4.0;

// Mean colour and weight about a place in a cell, from what the table holds of it.
fn within_cell(cell: vec4<u32>, place: f32) -> vec4<f32> {
    let weight = bitcast<f32>(cell.w) + bitcast<f32>(cell.z) * (fract(place) - 0.5 - LIFT_CELLS);
    return vec4<f32>(unpack2x16unorm(cell.x), unpack2x16unorm(cell.y).x, max(weight, 0.0));
}

// Colour and weight of one value.
fn classify(u: f32) -> vec4<f32> {
    let last = f32(slabs.bricks.w);
    let inside = within_cell(table[u32(clamp(u, 0.0, last - 1.0))], u);
    return select(select(inside, slabs.beyond, u >= last), slabs.below, u < 0.0);
}

// Colour and weight of samples without data.
fn no_data() -> vec4<f32> {
    return bitcast<vec4<f32>>(table[2u * slabs.bricks.w + 1u]);
}

// What the table holds about a place: colour and weight, or what is integrated up to there, where
// places are whole.
fn fetched(place: f32, is_cell: bool) -> vec4<f32> {
    let last = f32(slabs.bricks.w);
    let most = select(last, last - 1.0, is_cell);
    let found = table[u32(clamp(place, 0.0, most)) + select(slabs.bricks.w, 0u, is_cell)];
    let inside = within_cell(found, place);
    let cell = select(select(inside, slabs.beyond, place >= last), slabs.below, place < 0.0);
    let below = vec4<f32>(slabs.below.rgb * slabs.below.w, slabs.below.w);
    let beyond = vec4<f32>(slabs.beyond.rgb * slabs.beyond.w, slabs.beyond.w);
    let sum = bitcast<vec4<f32>>(found) + below * min(place, 0.0) + beyond * max(place - last, 0.0);
    return select(sum, cell, is_cell);
}

// Mean colour and weight from an integral over values, and their number of cells.
fn mean_of(part: vec4<f32>, width: f32) -> vec4<f32> {
    let colour = clamp(part.rgb / select(part.w, 1.0, part.w == 0.0), vec3<f32>(0.0), vec3<f32>(1.0));
    return vec4<f32>(colour, max(part.w / select(width, 1.0, width == 0.0), 0.0));
}

// Mean colours and weights of the two halves of a slab.
struct Halves {
    near: vec4<f32>,
    far: vec4<f32>,
}

// How the field grows on the two faces of a slab, or twice how it does at one place.
struct Growths {
    near: vec3<f32>,
    far: vec3<f32>,
}

// Whether values between two faces, and so much beyond, along a parabola with so much `bend` (below), can lie in
// cells that show.
fn may_show(near: f32, far: f32, width: f32, bend: f32) -> bool {
    let middle = 0.5 * (near + far) + 1.5 * bend;
    let least = min(min(near, far), middle) + 0.25 * bend - width;
    let most = max(max(near, far), middle) + 0.25 * bend + width;
    return most >= slabs.table.w && least <= slabs.end.w;
}

// All values between two faces, along a parabola whose mean differs by `bend` from theirs: in each
// half along the straight line with its mean.
fn classify_between(near: f32, far: f32, bend: f32) -> Halves {
    let shift = 0.25 * bend;
    let half = 0.5 * (near + far) + 1.5 * bend;
    // The nearest places in the table: unbiased, and never further off than half a cell.
    let begin = floor(near + shift + 0.5);
    let middle = floor(half + shift + 0.5);
    let end = floor(far + shift + 0.5);
    // Close ones by the weight in their middle; one fetch for either.
    let close_near = abs(middle - begin) < NEAR_CELLS;
    let close_far = abs(end - middle) < NEAR_CELLS;
    let first = fetched(select(begin, 0.5 * (near + half) + shift, close_near), close_near);
    let second = fetched(middle, false);
    let third = fetched(select(end, 0.5 * (half + far) + shift, close_far), close_far);
    return Halves(
        select(mean_of(second - first, middle - begin), first, close_near),
        select(mean_of(third - second, end - middle), third, close_far),
    );
}

// All values between two faces, and up to `width` cells beyond, as if spread evenly.
fn classify_about(near: f32, far: f32, width: f32) -> Halves {
    let begin = floor(min(near, far) - width + 0.5);
    let end = floor(max(near, far) + width + 0.5);
    let close = end - begin < NEAR_CELLS;
    let first = fetched(select(begin, 0.5 * (near + far), close), close);
    let whole = mean_of(fetched(end, false) - first, end - begin);
    let found = select(whole, first, close);
    return Halves(found, found);
}

// Walks a lattice far to near, a segment of at most one brick of a row at a time, and classifies.
//
// Rows are numbered far to near along the two outer axes; a row's segments far to near along the
// inner axis. A brick that holds the eye's index is walked in two segments, from both its ends.

const BRICK: u32 = 8u;
// Threads in a workgroup of the passes that walk segments.
const SEGMENT_THREADS: u32 = 64u;
// Words of `counts` before the first segment's.
const COUNT_HEADER_WORDS: u32 = 8u;
// Stands for "no data" (NaN) among 32-bit samples.
const NO_DATA: f32 = -3.4e38;

struct Traversal {
    // Samples along x, y, z; w: bytes a sample takes here (1, 2 or 4).
    dims: vec4<u32>,
    // Bricks along x, y, z; w: samples in one chunk of storage.
    bricks: vec4<u32>,
    // Lattice axes, outermost first; w: segments a row.
    axes: vec4<u32>,
    // Per axis of `axes`: the number of indices at or before the eye; w: first row.
    splits: vec4<u32>,
    // Rows; kernels that fit; entry of samples without data, 0 where they are left out; 0.
    counts: vec4<u32>,
    // Table span of 32-bit samples, entries per unit, and last entry.
    table: vec4<f32>,
}

@group(0) @binding(0) var<uniform> traversal: Traversal;
@group(0) @binding(1) var<storage, read> samples0: array<u32>;
@group(0) @binding(2) var<storage, read> samples1: array<u32>;
@group(0) @binding(3) var<storage, read> samples2: array<u32>;
@group(0) @binding(4) var<storage, read> samples3: array<u32>;
// Linear red, green, blue, and extinction per unit distance. Where it is drawn, NaN comes last.
@group(0) @binding(5) var<storage, read> table: array<vec4<f32>>;
// One bit a brick: whether any of it can show.
@group(0) @binding(6) var<storage, read> visible_bricks: array<u32>;

struct Segment {
    // The segment's first voxel, and its step along the inner axis (+1 or -1).
    start: vec3<u32>,
    step: i32,
    // Voxels in it; 0 where its brick cannot show.
    length: u32,
}

// Index along an axis of the `position`-th of `count` indices, far to near (see scene::Traversal).
fn index_at(position: u32, split: u32, count: u32) -> u32 {
    let beyond = count - split;
    return select(position - beyond, count - 1u - position, position < beyond);
}

fn segment_at(row: u32, segment: u32) -> Segment {
    let a = traversal.axes.x;
    let b = traversal.axes.y;
    let c = traversal.axes.z;
    let row_length = traversal.dims[b];
    let count = traversal.dims[c];
    let split = traversal.splits.z;
    var voxel = vec3<u32>(0u);
    voxel[a] = index_at(row / row_length, traversal.splits.x, traversal.dims[a]);
    voxel[b] = index_at(row % row_length, traversal.splits.y, row_length);

    let brick_count = traversal.bricks[c];
    let low_bricks = (split + BRICK - 1u) / BRICK;
    let high_bricks = select(brick_count - split / BRICK, 0u, split >= count);
    var out: Segment;
    if segment < high_bricks {
        let brick = brick_count - 1u - segment;
        let first = max(brick * BRICK, split);
        let last = min(brick * BRICK + BRICK, count) - 1u;
        voxel[c] = last;
        out.step = -1;
        out.length = last + 1u - first;
    } else if segment - high_bricks < low_bricks {
        let brick = segment - high_bricks;
        voxel[c] = brick * BRICK;
        out.step = 1;
        out.length = min(brick * BRICK + BRICK, min(split, count)) - voxel[c];
    } else {
        out.length = 0u;
    }
    out.start = voxel;
    let at = voxel / BRICK;
    let index = (at.z * traversal.bricks.y + at.y) * traversal.bricks.x + at.x;
    if (visible_bricks[index / 32u] >> (index % 32u) & 1u) == 0u {
        out.length = 0u;
    }
    return out;
}

fn sample_word(chunk: u32, word: u32) -> u32 {
    switch chunk {
        case 0u: { return samples0[word]; }
        case 1u: { return samples1[word]; }
        case 2u: { return samples2[word]; }
        default: { return samples3[word]; }
    }
}

// Linear colour and tabulated extinction of the voxel with this linear index.
fn classify(index: u32) -> vec4<f32> {
    let chunk = index / traversal.bricks.w;
    let within = index - chunk * traversal.bricks.w;
    if traversal.dims.w == 1u {
        let word = sample_word(chunk, within / 4u);
        return table[word >> (8u * (within % 4u)) & 0xffu];
    }
    if traversal.dims.w == 2u {
        let word = sample_word(chunk, within / 2u);
        return table[word >> (16u * (within % 2u)) & 0xffffu];
    }
    let value = bitcast<f32>(sample_word(chunk, within));
    if value <= NO_DATA {
        let entry = traversal.counts.z;
        return select(vec4<f32>(0.0), table[entry], entry > 0u);
    }
    let low = traversal.table.x;
    let high = traversal.table.y;
    let last = traversal.table.w;
    let position = min((clamp(value, low, high) - low) * traversal.table.z, last);
    let entry = min(u32(position), u32(last));
    let next = min(entry + 1u, u32(last));
    return mix(table[entry], table[next], position - f32(entry));
}

fn linear_index(voxel: vec3<u32>) -> u32 {
    return (voxel.z * traversal.dims.y + voxel.y) * traversal.dims.x + voxel.x;
}

// What the classified voxels of each brick come to, level by level: levels 1 to 3 of the pyramid
// (`hierarchy::sums` merges alike). A workgroup a brick, a thread a node of level 1.

// A piece of the volume's bricks.
struct BrickPiece {
    // Its first brick along x, y, z; w: 1 where nodes are wanted beside sums.
    first: vec4<u32>,
    // Bricks in it along x, y, z; w: 1 where errors are of values.
    bricks: vec4<u32>,
    // Where the nodes of levels 1, 2, 3 begin; w: bytes a sample takes here.
    nodes: vec4<u32>,
    // Thickness of a voxel in opacity unit distances; then of values: the least, the greatest, and 1 over
    // the range.
    scale: vec4<f32>,
}

// Means over the real voxels of a brick; see `hierarchy::sums::Sums`.
struct Brick {
    appearance: vec4<f32>,
    emission: vec4<f32>,
    count: f32,
    weight: f32,
    m2: f32,
    effective: f32,
    error: f32,
    // Children that show.
    showing: u32,
    // Voxels that show by index along x, y and z, a byte each.
    slices: array<u32, 6>,
}

@group(0) @binding(7) var<uniform> piece: BrickPiece;
@group(0) @binding(8) var<storage, read_write> bricks: array<Brick>;
// Extinction, error; red, green, blue and children that show, 16 bits each.
@group(0) @binding(9) var<storage, read_write> nodes: array<vec4<u32>>;

const LEVELS: u32 = 3u;

struct Sums {
    appearance: vec4<f32>,
    emission: vec4<f32>,
    count: f32,
    weight: f32,
    m2: f32,
    effective: f32,
    error: f32,
}

// A node of each thread's: of level 1, then of those that their parents' threads have.
var<workgroup> held: array<Sums, 64>;
// Which of the eight voxels of each node of level 1 show.
var<workgroup> shown: array<u32, 64>;

fn corner(bit: u32) -> vec3<u32> {
    return vec3<u32>(bit & 1u, bit >> 1u & 1u, bit >> 2u);
}

// Chan's merge of counts, means and M2. What has no voxels changes nothing.
fn merged(a: Sums, b: Sums) -> Sums {
    var out = a;
    let share = b.weight / max(a.weight + b.weight, 1.0);
    let delta = b.appearance - a.appearance;
    out.appearance = a.appearance + delta * share;
    out.m2 = a.m2 + b.m2 + dot(delta, delta) * a.weight * share;
    out.weight = a.weight + b.weight;
    out.count = a.count + b.count;
    out.emission = a.emission + (b.emission - a.emission) * (b.count / max(out.count, 1.0));
    out.error = max(a.error, b.error);
    return out;
}

// -ln(1 - a), a <= 3/4: where a is small its logarithm would have but few digits.
fn depth_of(a: f32) -> f32 {
    let small = a * (1.0 + a * (0.5 + a * (0.33333333 + a * 0.25)));
    return select(-log(1.0 - a), small, a < 0.03);
}

// Optical depth of equal mean transmittance of up to four columns, over their length: of those that
// have one, all of the same length.
fn column_depth(sums: vec4<f32>, lengths: vec4<f32>, size: f32) -> f32 {
    let is_there = lengths > vec4<f32>(0.0);
    let depths = sums * size;
    let among = select(vec4<f32>(1e30), depths, is_there);
    let least = min(min(among.x, among.y), min(among.z, among.w));
    // Of what is beyond the least, so that nothing underflows.
    let beyond = select(vec4<f32>(0.0), depths - least, is_there);
    let hidden = opacity(beyond.x) + opacity(beyond.y) + opacity(beyond.z) + opacity(beyond.w);
    let columns = dot(select(vec4<f32>(0.0), vec4<f32>(1.0), is_there), vec4<f32>(1.0));
    let longest = max(max(lengths.x, lengths.y), max(lengths.z, lengths.w));
    return (least + depth_of(hidden / columns)) / (size * longest);
}

// Extinction whose transmittance through the node is the mean over its columns of children, averaged
// over the three axes; `near` and `far` are those of z, `has` is 1 where there is a child.
fn effective_extinction(
    near: vec4<f32>,
    far: vec4<f32>,
    has_near: vec4<f32>,
    has_far: vec4<f32>,
    size: f32,
) -> f32 {
    let along_x = column_depth(
        vec4<f32>(near.xz + near.yw, far.xz + far.yw),
        vec4<f32>(has_near.xz + has_near.yw, has_far.xz + has_far.yw),
        size,
    );
    let along_y = column_depth(
        vec4<f32>(near.xy + near.zw, far.xy + far.zw),
        vec4<f32>(has_near.xy + has_near.zw, has_far.xy + has_far.zw),
        size,
    );
    let along_z = column_depth(near + far, has_near + has_far, size);
    return (along_x + along_y + along_z) / 3.0;
}

// Where a sample lies between the least and the greatest, and 1; 0 and 0 where there is none.
fn part_of_range(index: u32) -> vec2<f32> {
    let chunk = index / traversal.bricks.w;
    let within = index - chunk * traversal.bricks.w;
    let width = piece.nodes.w;
    let samples = 4u / width;
    let word = sample_word(chunk, within / samples);
    let code = word >> (8u * width * (within % samples)) & (0xffffffffu >> (32u - 8u * width));
    let value = select(f32(code), bitcast<f32>(word), width == 4u);
    let part = (clamp(value, piece.scale.y, piece.scale.z) - piece.scale.y) * piece.scale.w;
    return select(vec2<f32>(part, 1.0), vec2<f32>(0.0), width == 4u && value <= NO_DATA);
}

fn rms(sums: Sums) -> f32 {
    return sqrt(max(sums.m2 / max(sums.weight, 1.0), 0.0));
}

// Nodes of a level along each axis of the piece.
fn piece_dims(level: u32) -> vec3<u32> {
    let edge = 1u << level;
    let all = (traversal.dims.xyz + edge - 1u) >> vec3<u32>(level);
    let before = piece.first.xyz << vec3<u32>(LEVELS - level);
    return min(all - before, piece.bricks.xyz << vec3<u32>(LEVELS - level));
}

// What is drawn of a node at a place among those of its level in the piece.
fn write_node(sums: Sums, showing: u32, level: u32, at: vec3<u32>) {
    let dims = piece_dims(level);
    // Over nothing it is nothing: what has no opacity has no light.
    let extinction = max(sums.emission.w, 1e-37);
    let colour = vec3<u32>(clamp(sums.emission.xyz / extinction, vec3<f32>(0.0), vec3<f32>(1.0)) * 65535.0 + 0.5);
    let begin = select(select(piece.nodes.x, piece.nodes.y, level == 2u), piece.nodes.z, level == LEVELS);
    nodes[begin + (at.z * dims.y + at.y) * dims.x + at.x] = vec4<u32>(
        bitcast<u32>(sums.effective),
        bitcast<u32>(sums.error),
        colour.x | colour.y << 16u,
        colour.z | showing << 16u,
    );
}

@compute @workgroup_size(4, 4, 4)
fn merge_bricks(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let dims = traversal.dims.xyz;
    let at = piece.first.xyz + group;
    let index = (at.z * traversal.bricks.y + at.y) * traversal.bricks.x + at.x;
    let low = at * BRICK;
    let by_value = piece.bricks.w;
    let shows = (visible_bricks[index / 32u] >> (index % 32u) & 1u) | by_value;
    let depth = piece.scale.x;
    let wants_nodes = piece.first.w;

    let corner_voxel = low + 2u * local;
    var node: Sums;
    var extinctions: array<f32, 8>;
    var has: array<f32, 8>;
    var mask = 0u;
    // Where nothing shows there are voxels to count all the same.
    for (var bit = 0u; bit < 8u; bit++) {
        let voxel = corner_voxel + corner(bit);
        let is_real = all(voxel < dims);
        var one: Sums;
        one.count = select(0.0, 1.0, is_real);
        one.weight = one.count;
        for (var looks = u32(is_real) & shows; looks > 0u; looks--) {
            let place = linear_index(voxel);
            let look = classify(place);
            let alpha = opacity(look.w * depth);
            one.appearance = vec4<f32>(alpha, alpha * look.xyz);
            one.emission = vec4<f32>(look.xyz * look.w, look.w);
            for (var i = by_value; i > 0u; i--) {
                let part = part_of_range(place);
                one.appearance = vec4<f32>(part.x, 0.0, 0.0, 0.0);
                one.weight = part.y;
            }
        }
        extinctions[bit] = one.emission.w;
        has[bit] = one.count;
        mask |= u32(one.emission.w > 0.0) << bit;
        node = merged(node, one);
    }
    var showing = countOneBits(mask);
    for (var i = min(showing, 1u); i > 0u; i--) {
        node.effective = effective_extinction(
            vec4<f32>(extinctions[0], extinctions[1], extinctions[2], extinctions[3]),
            vec4<f32>(extinctions[4], extinctions[5], extinctions[6], extinctions[7]),
            vec4<f32>(has[0], has[1], has[2], has[3]),
            vec4<f32>(has[4], has[5], has[6], has[7]),
            depth,
        );
        node.error = rms(node);
    }
    held[thread] = node;
    shown[thread] = mask;
    for (var i = wants_nodes * min(u32(node.count), 1u); i > 0u; i--) {
        write_node(node, showing, 1u, 4u * group + local);
    }
    for (var level = 2u; level <= LEVELS; level++) {
        workgroupBarrier();
        let step = 1u << (level - 2u);
        let is_parent = all(local % (2u * step) == vec3<u32>(0u));
        // Its own node is its first child's, which no other thread reads now.
        for (var i = u32(is_parent); i > 0u; i--) {
            var parent: Sums;
            showing = 0u;
            for (var bit = 0u; bit < 8u; bit++) {
                let child_at = local + step * corner(bit);
                let child = held[child_at.x + 4u * child_at.y + 16u * child_at.z];
                extinctions[bit] = child.effective;
                has[bit] = min(child.count, 1.0);
                showing += u32(child.effective > 0.0);
                parent = merged(parent, child);
            }
            for (var j = min(showing, 1u); j > 0u; j--) {
                parent.effective = effective_extinction(
                    vec4<f32>(extinctions[0], extinctions[1], extinctions[2], extinctions[3]),
                    vec4<f32>(extinctions[4], extinctions[5], extinctions[6], extinctions[7]),
                    vec4<f32>(has[0], has[1], has[2], has[3]),
                    vec4<f32>(has[4], has[5], has[6], has[7]),
                    depth * f32(2u * step),
                );
                // Its edge over that of a node of level 1.
                parent.error = max(parent.error, rms(parent) * f32(2u * step));
            }
            node = parent;
            held[thread] = node;
            for (var j = wants_nodes * min(u32(node.count), 1u); j > 0u; j--) {
                write_node(node, showing, level, (4u * group + local) / (2u * step));
            }
        }
    }

    let place = (group.z * piece.bricks.y + group.y) * piece.bricks.x + group.x;
    // Four of the 24 slices a thread.
    for (var word = thread; word < 6u; word += 64u) {
        var counts = 0u;
        for (var i = 0u; i < 4u; i++) {
            let axis = word / 2u;
            let slice = 4u * (word % 2u) + i;
            // The voxels of a node that lie in the slice, in x, y, z bit order.
            let low_half = select(select(0x0fu, 0x33u, axis == 1u), 0x55u, axis == 0u);
            let half = low_half << ((slice & 1u) << axis);
            let stride = 1u << (2u * axis);
            var count = 0u;
            for (var other = 0u; other < 16u; other++) {
                let below = other % stride;
                let above = other / stride * 4u * stride;
                count += countOneBits(shown[above + slice / 2u * stride + below] & half);
            }
            counts |= count << (8u * i);
        }
        bricks[place].slices[word] = counts;
    }
    for (var i = u32(thread == 0u); i > 0u; i--) {
        bricks[place].appearance = node.appearance;
        bricks[place].emission = node.emission;
        bricks[place].count = node.count;
        bricks[place].weight = node.weight;
        bricks[place].m2 = node.m2;
        bricks[place].effective = node.effective;
        bricks[place].error = node.error;
        bricks[place].showing = showing;
    }
}

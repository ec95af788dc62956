// Draws records as footprints, back to front, over a premultiplied linear target.

// All kernels are one voxel large and seen in parallel: one footprint, given by the frame.
override one_footprint: bool = false;

struct Record {
    @location(0) centre: vec3<f32>,
    @location(1) extinction: f32,
    @location(2) packed: vec3<u32>,
}

// As few as each kind needs: every one costs a set-up per triangle.
struct Radial {
    @builtin(position) position: vec4<f32>,
    // Unit kernel offset over the radius. Not `linear`, though w is 1 throughout: llvmpipe (Mesa
    // 22.3.6) loses linear varyings along vertical edges that its own clipping made.
    @location(0) local: vec2<f32>,
    // Linear colour, and optical depth per unit of footprint.
    @location(1) @interpolate(flat) matter: vec4<f32>,
}

struct Box {
    @builtin(position) position: vec4<f32>,
    // Kernel-space point of the pixel's ray, and its step per pixel of depth.
    @location(0) local: vec3<f32>,
    @location(1) @interpolate(flat) matter: vec4<f32>,
    @location(2) @interpolate(flat) ray: vec3<f32>,
}

// A corner of the mesh that stands for a footprint (kernel::SplatMesh).
struct Corner {
    // On the unit disc.
    @location(3) position: vec2<f32>,
    // F there at the natural extent.
    @location(4) factor: f32,
}

struct Gouraud {
    @builtin(position) position: vec4<f32>,
    // Linear premultiplied light, and opacity: linear on the screen, since w is 1 throughout.
    @location(0) light: vec4<f32>,
}

struct Point {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) matter: vec4<f32>,
}

// Opacity times footprint, capped at 1, rather than optical depth; of meshes alone.
override published: bool = false;

struct Totals {
    // Words 2 and 3: pixels of kernels whose opacity was capped, low word first.
    counts: array<atomic<u32>, 4>,
}

@group(0) @binding(1) var<storage, read_write> totals: Totals;

// Vertices snap to 1/256 of a pixel: a box's quad is this much larger, or it would lose pixels.
const SNAP: f32 = 0.0078125;

// Corners of a triangle about the unit circle, and of the square [-1, 1]^2 as a strip.
const TRIANGLE = array(vec2<f32>(0.0, 2.0), vec2<f32>(-1.7320508, -1.0), vec2<f32>(1.7320508, -1.0));

fn corner_of(vertex: u32) -> vec2<f32> {
    return vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
}

fn matter_of(record: Record, depth: f32) -> vec4<f32> {
    return vec4<f32>(colour_of(record.packed), optical_depth(record.extinction, depth));
}

fn clip(screen: vec2<f32>, hidden: bool) -> vec4<f32> {
    // Hidden ones lie beyond the far plane: clipped.
    return vec4<f32>(screen / frame.half_size, select(0.5, 2.0, hidden), 1.0);
}

@vertex
fn vertex_radial(record: Record, @builtin(vertex_index) index: u32) -> Radial {
    let kernel = project(record.centre, record.packed);
    var factor = frame.footprint;
    if !one_footprint {
        factor = widened(ellipse(kernel));
    }
    // One triangle is quicker to set up, and covers 1.3 times the pixels of the square.
    let corner = select(corner_of(index), TRIANGLE[index % 3u], one_footprint);
    let unit = corner * frame.radius;
    let offset = vec2<f32>(factor.x * unit.x, factor.y * unit.x + factor.z * unit.y);
    return Radial(
        clip(kernel.middle + offset, kernel.hidden),
        corner,
        matter_of(record, factor.w * frame.footprint_scale),
    );
}

@vertex
fn vertex_box(record: Record, @builtin(vertex_index) index: u32) -> Box {
    let kernel = project(record.centre, record.packed);
    // The box's shadow, and the inverse of A for the ray through each pixel.
    let reach = SNAP + 0.5 * vec2<f32>(
        dot(abs(kernel.row_x), vec3<f32>(1.0)),
        dot(abs(kernel.row_y), vec3<f32>(1.0)),
    );
    let offset = corner_of(index) * reach;
    let volume = dot(kernel.row_x, cross(kernel.row_y, kernel.row_z));
    let from_x = cross(kernel.row_y, kernel.row_z) / volume;
    let from_y = cross(kernel.row_z, kernel.row_x) / volume;
    return Box(
        clip(kernel.middle + offset, kernel.hidden),
        from_x * offset.x + from_y * offset.y,
        matter_of(record, 1.0),
        cross(kernel.row_x, kernel.row_y) / volume,
    );
}

@vertex
fn vertex_gouraud(record: Record, corner: Corner) -> Gouraud {
    let kernel = project(record.centre, record.packed);
    var factor = frame.footprint;
    if !one_footprint {
        factor = widened(ellipse(kernel));
    }
    let unit = corner.position * frame.radius;
    let offset = vec2<f32>(factor.x * unit.x, factor.y * unit.x + factor.z * unit.y);
    let place = kernel.middle + offset;
    // The corner's own ray, as each pixel of a footprint has its own.
    let length = factor.w * frame.footprint_scale * corner.factor * slant(place + frame.half_size);
    var alpha: f32;
    if published {
        // Capped where it is interpolated.
        alpha = optical_depth(opacity(record.extinction), length);
    } else {
        alpha = opacity(optical_depth(record.extinction, length));
    }
    return Gouraud(clip(place, kernel.hidden), vec4<f32>(colour_of(record.packed) * alpha, alpha));
}

@vertex
fn vertex_point(record: Record, @builtin(vertex_index) index: u32) -> Point {
    let kernel = project(record.centre, record.packed);
    let middle = pixel_of_point(kernel.middle);
    let across = length(cross(kernel.row_x, kernel.row_y));
    return Point(
        clip(middle + corner_of(index) * 0.5, kernel.hidden),
        matter_of(record, kernel.determinant / across),
    );
}

fn splat(matter: vec4<f32>, footprint: f32, position: vec4<f32>) -> vec4<f32> {
    let alpha = opacity(matter.w * footprint * slant(position.xy));
    return vec4<f32>(matter.rgb * alpha, alpha);
}

@fragment
fn fragment_radial(in: Radial) -> @location(0) vec4<f32> {
    return splat(in.matter, footprint(dot(in.local, in.local)), in.position);
}

@fragment
fn fragment_box(in: Box) -> @location(0) vec4<f32> {
    let span = chord(in.local, in.ray);
    return splat(in.matter, span.y - span.x, in.position);
}

@fragment
fn fragment_gouraud(in: Gouraud) -> @location(0) vec4<f32> {
    if published && in.light.w > 1.0 {
        let before = atomicAdd(&totals.counts[2], 1u);
        if before == 0xffffffffu {
            atomicAdd(&totals.counts[3], 1u);
        }
        return in.light / in.light.w;
    }
    // At an edge that was moved by its snapping, steep light leaves its corners' range a little: by
    // 6e-4 where opaque splats are a few pixels wide.
    let light = max(in.light, vec4<f32>(0.0));
    return min(light, vec4<f32>(min(light.w, 1.0)));
}

@fragment
fn fragment_point(in: Point) -> @location(0) vec4<f32> {
    return splat(in.matter, 1.0, in.position);
}

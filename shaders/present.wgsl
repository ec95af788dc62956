// Lays the premultiplied linear picture over the background and encodes it as sRGB.

struct Present {
    // Linear background; w: 1 opaque, 0 none.
    background: vec4<f32>,
}

@group(0) @binding(0) var<uniform> settings: Present;
@group(0) @binding(1) var picture: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    // One triangle over the whole target.
    let corner = vec2<f32>(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
    return vec4<f32>(corner, 0.5, 1.0);
}

fn encode(linear: f32) -> f32 {
    let light = clamp(linear, 0.0, 1.0);
    return select(1.055 * pow(light, 1.0 / 2.4) - 0.055, light * 12.92, light <= 0.0031308);
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let front = textureLoad(picture, vec2<i32>(position.xy), 0);
    let background = settings.background;
    let alpha = front.a + (1.0 - front.a) * background.a;
    let light = front.rgb + background.rgb * (background.a * (1.0 - front.a));
    // Files keep straight alpha.
    let straight = select(vec3<f32>(0.0), light / max(alpha, 1e-6), alpha > 0.0);
    return vec4<f32>(encode(straight.r), encode(straight.g), encode(straight.b), alpha);
}

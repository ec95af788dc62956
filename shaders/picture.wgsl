// Paints the engine's picture into the window, byte for byte or enlarged.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var second: texture_2d<f32>;
// x: how much larger a difference is shown, or the share of the second picture.
@group(0) @binding(2) var<uniform> amount: vec4<f32>;

// The target decodes sRGB when it is written to: hand it light.
override linear_target: bool = false;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(linear) at: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    // One triangle over the whole viewport.
    let corner = vec2<f32>(f32(index & 1u), f32(index >> 1u)) * 2.0;
    return Corner(vec4<f32>(corner.x * 2.0 - 1.0, 1.0 - corner.y * 2.0, 0.5, 1.0), corner);
}

fn light_of(encoded: vec3<f32>) -> vec3<f32> {
    let steep = pow((encoded + 0.055) / 1.055, vec3<f32>(2.4));
    return select(steep, encoded / 12.92, encoded <= vec3<f32>(0.04045));
}

fn encoded_of(light: vec3<f32>) -> vec3<f32> {
    let steep = 1.055 * pow(light, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(steep, light * 12.92, light <= vec3<f32>(0.0031308));
}

// Straight alpha in, premultiplied out.
fn painted(texel: vec4<f32>) -> vec4<f32> {
    let front = texel.rgb * texel.a;
    return vec4<f32>(select(front, light_of(front), linear_target), texel.a);
}

@fragment
fn exact(in: Corner) -> @location(0) vec4<f32> {
    let size = vec2<f32>(textureDimensions(picture));
    return painted(textureLoad(picture, vec2<i32>(in.at * size), 0));
}

// What four samples in a row are worth at a share of the way from the second to the third: cubic
// convolution (Keys 1981, a = -1/2), as core::enlarge has it.
fn weights(t: f32) -> vec4<f32> {
    let square = t * t;
    let cube = square * t;
    return vec4<f32>(
        square - 0.5 * (t + cube),
        1.0 - 2.5 * square + 1.5 * cube,
        0.5 * t + 2.0 * square - 1.5 * cube,
        0.5 * (cube - square),
    );
}

fn smoothly(shown: texture_2d<f32>, at: vec2<f32>) -> vec4<f32> {
    let last = vec2<i32>(textureDimensions(shown)) - 1;
    let place = clamp(at * vec2<f32>(last + 1) - 0.5, vec2<f32>(0.0), vec2<f32>(last));
    let first = vec2<i32>(floor(place));
    let across = weights(fract(place.x));
    let down = weights(fract(place.y));
    var sum = vec4<f32>(0.0);
    for (var y = 0; y < 4; y++) {
        var row = vec4<f32>(0.0);
        for (var x = 0; x < 4; x++) {
            let sample = clamp(first + vec2<i32>(x - 1, y - 1), vec2<i32>(0), last);
            row += across[x] * textureLoad(shown, sample, 0);
        }
        sum += down[y] * row;
    }
    return clamp(sum, vec4<f32>(0.0), vec4<f32>(1.0));
}

@fragment
fn enlarged(in: Corner) -> @location(0) vec4<f32> {
    return painted(smoothly(picture, in.at));
}

// One picture on its way to another: as displays add light up, in sRGB, so that neither flashes.
@fragment
fn faded(in: Corner) -> @location(0) vec4<f32> {
    return painted(mix(smoothly(picture, in.at), smoothly(second, in.at), amount.x));
}

// How far two pictures are apart, in linear light.
@fragment
fn difference(in: Corner) -> @location(0) vec4<f32> {
    let at = vec2<i32>(in.at * vec2<f32>(textureDimensions(picture)));
    let one = textureLoad(picture, at, 0);
    let other = textureLoad(second, at, 0);
    let apart = abs(light_of(one.rgb) * one.a - light_of(other.rgb) * other.a);
    let light = min(apart * amount.x, vec3<f32>(1.0));
    return vec4<f32>(select(encoded_of(light), light, linear_target), 1.0);
}

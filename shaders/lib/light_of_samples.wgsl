// Compositing of layers along a ray, for four samples of its pixel at once: what fills the pixel lies on
// all of them, and polygons on those that they cover. So edges are smooth, and where two triangles meet
// in a pixel nothing shows between them.

// What the four samples have gathered so far.
struct Gathered {
    // Premultiplied.
    red: vec4<f32>,
    green: vec4<f32>,
    blue: vec4<f32>,
    transmittance: vec4<f32>,
    // Added up: 1 - transmittance has no digits left where opacities are small.
    alpha: vec4<f32>,
}

const NO_LIGHT: Gathered = Gathered(vec4(0.0), vec4(0.0), vec4(0.0), vec4(1.0), vec4(0.0));

// What shows through at most.
fn left_of(light: Gathered) -> f32 {
    let left = max(light.transmittance.xy, light.transmittance.zw);
    return max(left.x, left.y);
}

// Premultiplied colour and opacity of the pixel.
fn light_of(light: Gathered) -> vec4<f32> {
    let quarter = vec4<f32>(0.25);
    return vec4<f32>(
        dot(light.red, quarter),
        dot(light.green, quarter),
        dot(light.blue, quarter),
        dot(light.alpha, quarter),
    );
}

// One layer more, of a weight times its length.
fn composite(light: ptr<function, Gathered>, colour: vec3<f32>, amount: f32) {
    var opacity: f32;
    if published {
        opacity = min(amount, 1.0);
        if amount > 1.0 {
            note_capped(1u);
        }
    } else {
        opacity = select(1.0 - exp(-amount), amount * (1.0 - 0.5 * amount), amount < 1e-3);
    }
    cover(light, colour, opacity);
}

// One layer more, of an opacity.
fn cover(light: ptr<function, Gathered>, colour: vec3<f32>, opacity: f32) {
    cover_samples(light, colour, opacity, 15u);
}

// One layer more on some of the samples, a bit for each.
fn cover_samples(light: ptr<function, Gathered>, colour: vec3<f32>, opacity: f32, samples: u32) {
    let bits = (vec4<u32>(samples) >> vec4<u32>(0u, 1u, 2u, 3u)) & vec4<u32>(1u);
    let opacities = opacity * vec4<f32>(bits);
    if back_to_front {
        (*light).red = mix((*light).red, vec4<f32>(colour.r), opacities);
        (*light).green = mix((*light).green, vec4<f32>(colour.g), opacities);
        (*light).blue = mix((*light).blue, vec4<f32>(colour.b), opacities);
    } else {
        let seen = opacities * (*light).transmittance;
        (*light).red += colour.r * seen;
        (*light).green += colour.g * seen;
        (*light).blue += colour.b * seen;
    }
    (*light).alpha += opacities * (*light).transmittance;
    (*light).transmittance *= 1.0 - opacities;
}

// Compositing of layers along a ray.

// What a ray has gathered so far.
struct Gathered {
    // Premultiplied.
    colour: vec3<f32>,
    transmittance: f32,
    // Added up: 1 - transmittance has no digits left where opacities are small.
    alpha: f32,
}

const NO_LIGHT: Gathered = Gathered(vec3(0.0), 1.0, 0.0);

// What shows through.
fn left_of(light: Gathered) -> f32 {
    return light.transmittance;
}

// Premultiplied colour and opacity of the pixel.
fn light_of(light: Gathered) -> vec4<f32> {
    return vec4<f32>(light.colour, light.alpha);
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
    if back_to_front {
        (*light).colour = mix((*light).colour, colour, opacity);
    } else {
        (*light).colour += colour * (opacity * (*light).transmittance);
    }
    (*light).alpha += opacity * (*light).transmittance;
    (*light).transmittance *= 1.0 - opacity;
}

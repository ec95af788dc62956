// Writes the fragments of every pixel: how deep a triangle is there, and what the lights make of it.
//
// One depth, one normal and one colour a triangle and pixel: those of the triangle where the pixel's own
// ray meets it, or where it does not, though samples beside it do, of the place on it that is nearest in
// its own coordinates: none of the three may be negative.

fn channel(byte: u32) -> f32 {
    let encoded = f32(byte) / 255.0;
    return select(pow((encoded + 0.055) / 1.055, 2.4), encoded / 12.92, encoded <= 0.04045);
}

fn linear(bits: f32) -> vec3<f32> {
    let word = bitcast<u32>(bits);
    return vec3<f32>(channel(word & 255u), channel(word >> 8u & 255u), channel(word >> 16u & 255u));
}

fn cross2(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

@fragment
fn fragment(landed: Landed, @builtin(sample_mask) samples: u32) {
    let pixel = pixel_of(landed.at);
    let centre = floor(landed.at.xy) + 0.5;
    let screen = vec2<f32>(centre.x - polygons.picture.x, polygons.picture.y - centre.y);
    let eye = polygons.picture.z;
    let a = corners[3u * landed.triangle];
    let b = corners[3u * landed.triangle + 1u];
    let c = corners[3u * landed.triangle + 2u];
    let depths = vec3<f32>(seen(a.place.xyz).z, seen(b.place.xyz).z, seen(c.place.xyz).z);
    // How far beside the ray each corner is at its own depth: nothing is divided by, and small triangles
    // keep their digits.
    let scale = select(vec3<f32>(1.0), (depths + polygons.forward.w) / eye, eye > 0.0);
    let off_a = seen(a.place.xyz).xy - screen * scale.x;
    let off_b = seen(b.place.xyz).xy - screen * scale.y;
    let off_c = seen(c.place.xyz).xy - screen * scale.z;
    let shares = vec3<f32>(cross2(off_b, off_c), cross2(off_c, off_a), cross2(off_a, off_b));
    let side = select(1.0, -1.0, shares.x + shares.y + shares.z < 0.0);
    let inner = max(shares * side, vec3<f32>(0.0));
    let sum = inner.x + inner.y + inner.z;
    // Seen from its edge it is all one.
    let at = select(inner / sum, vec3<f32>(1.0 / 3.0), sum <= 0.0);

    let normal_sum = a.normal.xyz * at.x + b.normal.xyz * at.y + c.normal.xyz * at.z;
    let normal = normal_sum / max(length(normal_sum), 1e-20);
    let albedo = linear(a.normal.w) * at.x + linear(b.normal.w) * at.y + linear(c.normal.w) * at.z;
    var along = polygons.forward.xyz;
    if eye > 0.0 {
        along += (polygons.right.xyz * screen.x + polygons.up.xyz * screen.y) / eye;
    }
    let to_eye = -normalize(along);
    // Both sides are lit.
    let facing = select(normal, -normal, dot(normal, to_eye) < 0.0);
    var colour = albedo * polygons.material.x;
    for (var i = 0u; i < polygons.counts.w; i++) {
        let towards = polygons.towards[i].xyz;
        let cosine = dot(facing, towards);
        let reflected = 2.0 * cosine * facing - towards;
        let mirror = pow(max(dot(reflected, to_eye), 1e-6), polygons.material.w);
        let falls = polygons.colours[i].rgb;
        colour += falls * albedo * (polygons.material.y * max(cosine, 0.0));
        colour += falls * (polygons.material.z * select(0.0, mirror, cosine > 0.0));
    }

    let word = atomicAdd(&polygon_words[2u * pixel], FRAGMENT_WORDS);
    if word + FRAGMENT_WORDS <= polygons.counts.z {
        atomicStore(&polygon_words[word], bitcast<u32>(dot(depths, at)));
        atomicStore(&polygon_words[word + 1u], landed.triangle << 4u | samples & 15u);
        atomicStore(&polygon_words[word + 2u], bitcast<u32>(a.place.w));
        atomicStore(&polygon_words[word + 3u], bitcast<u32>(colour.r));
        atomicStore(&polygon_words[word + 4u], bitcast<u32>(colour.g));
        atomicStore(&polygon_words[word + 5u], bitcast<u32>(colour.b));
    }
}

// The part of a radial kernel's footprint that lies before a point of the line through it.

// kernel::SlabShare: by odd powers of the place, and by powers of q. Constants of the pipeline, since
// every slab needs them all.
override s00: f32 = 0.0;
override s01: f32 = 0.0;
override s02: f32 = 0.0;
override s03: f32 = 0.0;
override s10: f32 = 0.0;
override s11: f32 = 0.0;
override s12: f32 = 0.0;
override s13: f32 = 0.0;
override s20: f32 = 0.0;
override s21: f32 = 0.0;
override s22: f32 = 0.0;
override s23: f32 = 0.0;
override s30: f32 = 0.0;
override s31: f32 = 0.0;
override s32: f32 = 0.0;
override s33: f32 = 0.0;
override s40: f32 = 0.0;
override s41: f32 = 0.0;
override s42: f32 = 0.0;
override s43: f32 = 0.0;
override s50: f32 = 0.0;
override s51: f32 = 0.0;
override s52: f32 = 0.0;
override s53: f32 = 0.0;
override s60: f32 = 0.0;
override s61: f32 = 0.0;
override s62: f32 = 0.0;
override s63: f32 = 0.0;

// q = (l / radius)^2 within 0 and 1; the place from the kernel's middle, in half chords.
fn share(q: f32, place_any: f32) -> f32 {
    let place = clamp(place_any, -1.0, 1.0);
    let x = place * place;
    let f0 = s00 + q * (s01 + q * (s02 + q * s03));
    let f1 = s10 + q * (s11 + q * (s12 + q * s13));
    let f2 = s20 + q * (s21 + q * (s22 + q * s23));
    let f3 = s30 + q * (s31 + q * (s32 + q * s33));
    let f4 = s40 + q * (s41 + q * (s42 + q * s43));
    let f5 = s50 + q * (s51 + q * (s52 + q * s53));
    let f6 = s60 + q * (s61 + q * (s62 + q * s63));
    let high = f4 + x * (f5 + x * f6);
    return 0.5 + place * (f0 + x * (f1 + x * (f2 + x * (f3 + x * high))));
}


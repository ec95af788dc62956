// What a radial kernel gives a line that passes it.

// Footprint polynomial of the kernel at its own extent (kernel::FootprintPolynomial), lowest power
// first: constants of the pipeline, since every fragment needs them all.
override c0: f32 = 0.0;
override c1: f32 = 0.0;
override c2: f32 = 0.0;
override c3: f32 = 0.0;
override c4: f32 = 0.0;
override c5: f32 = 0.0;
override c6: f32 = 0.0;
override c7: f32 = 0.0;
// The footprint ends as a square root (a kernel that is cut off) rather than as a square.
override rim_root: bool = false;

// F(l) of kernel::FootprintPolynomial, q = (l / radius)^2; nothing beyond the radius.
fn footprint(q_any: f32) -> f32 {
    let q = min(q_any, 1.0);
    let u = 2.0 * q - 1.0;
    let high = ((c7 * u + c6) * u + c5) * u + c4;
    let sum = (((high * u + c3) * u + c2) * u + c1) * u + c0;
    let inside = 1.0 - q;
    return sum * select(inside * inside, sqrt(inside), rim_root);
}


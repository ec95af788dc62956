// Optical depth to opacity.

// Deeper than any display can tell, and far from overflowing.
const MOST_DEPTH: f32 = 1e30;

// 1 - exp(-depth), to a relative 2.4e-6 for every depth >= 0 (to 1 - 1.2e-7 beyond 16): a
// polynomial for a sixteenth of the depth, doubled four times, since 1 - t^2 = a (2 - a) with
// a = 1 - t. Nothing cancels, and no exponential is taken.
fn opacity(depth: f32) -> f32 {
    // The footprint's polynomial may fall a little below 0 at its rim.
    let y = clamp(depth, 0.0, 16.0) * 0.0625;
    var a = y * (0.99999776 + y * (-0.49989422 + y * (0.1658395 + y * (-0.039332894 + y * 0.0055118293))));
    a = a * (2.0 - a);
    a = a * (2.0 - a);
    a = a * (2.0 - a);
    return a * (2.0 - a);
}


//! Adaptive Gauss–Legendre quadrature of light along a ray.

use std::sync::LazyLock;

/// Nodes of every rule here; Gauss–Legendre with five is exact to degree 9.
pub(super) const NODES: usize = 5;
/// Abscissae and weights on −1..=1.
pub(super) const GAUSS: [(f64, f64); NODES] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];
/// Halvings of an interval before what is left is taken as it is.
const DEEPEST: u32 = 52;
/// Intervals shorter than this part of the whole may have this part of the error.
const LEAST_SHARE: f64 = 1e-4;
/// Transmittance below which nothing behind is looked at.
const OPAQUE: f64 = 1e-13;

/// Weight of extinction, and of extinction × linear red, green, blue, per unit length.
pub(super) type Density = [f64; 4];

struct Rule {
    /// Row i: ∫ from −1 to node i of the polynomial through the nodes' values.
    until: [[f64; NODES]; NODES],
    /// Legendre coefficients 3 and 4 of that polynomial.
    last: [[f64; NODES]; 2],
}

static RULE: LazyLock<Rule> = LazyLock::new(|| {
    let legendre = |x: f64| {
        let mut p = [1.0; NODES + 1];
        p[1] = x;
        for k in 2..=NODES {
            let n = k as f64;
            p[k] = ((2.0 * n - 1.0) * x * p[k - 1] - (n - 1.0) * p[k - 2]) / n;
        }
        p
    };
    let coefficient = |k: usize, j: usize| {
        let (x, w) = GAUSS[j];
        (2.0 * k as f64 + 1.0) / 2.0 * w * legendre(x)[k]
    };
    // ∫ P_k from −1 to x.
    let integral = |k: usize, x: f64| match k {
        0 => x + 1.0,
        _ => (legendre(x)[k + 1] - legendre(x)[k - 1]) / (2.0 * k as f64 + 1.0),
    };
    let until = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            (0..NODES).map(|k| coefficient(k, j) * integral(k, GAUSS[i].0)).sum()
        })
    });
    let last = [3, 4].map(|k| std::array::from_fn(|j| coefficient(k, j)));
    Rule { until, last }
});

/// Size of the last Legendre terms of node values: how far they are from smooth.
fn roughness(values: [f64; NODES]) -> f64 {
    let [third, fourth] = RULE.last.map(|row| dot(row, values).abs());
    fourth + 0.1 * third
}

fn dot(a: [f64; NODES], b: [f64; NODES]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Light gathered from the eye inwards: C = ∫ q·exp(−∫κ), and exp(−∫κ).
#[derive(Debug, Clone, Copy)]
pub(super) struct Light {
    pub(super) colour: [f64; 3],
    pub(super) transmittance: f64,
    /// Error allowed over `span`.
    tolerance: f64,
    span: f64,
}

impl Light {
    /// Nothing yet, of a ray of which `span` lies in the volume.
    pub(super) fn new(tolerance: f64, span: f64) -> Self {
        Self { colour: [0.0; 3], transmittance: 1.0, tolerance, span }
    }

    /// Whether what is behind cannot show.
    pub(super) fn is_opaque(&self) -> bool {
        self.transmittance < OPAQUE
    }

    /// Adds a..b, which lies behind all that was added before. `density` may jump or bend, but what
    /// happens between the nodes of a smooth interval goes unseen: split at what is known.
    ///
    /// The error of each interval is taken as its length times the last terms of its Legendre
    /// series, far more than it is where the function is smooth.
    pub(super) fn add(&mut self, a: f64, b: f64, density: &impl Fn(f64) -> Density) {
        if b > a {
            self.step(a, b, density, DEEPEST);
        }
    }

    /// Lays something without depth behind all that was added before.
    pub(super) fn cover(&mut self, opacity: f64, colour: [f64; 3]) {
        for (sum, c) in self.colour.iter_mut().zip(colour) {
            *sum += self.transmittance * opacity * c;
        }
        self.transmittance *= 1.0 - opacity;
    }

    fn step(&mut self, a: f64, b: f64, density: &impl Fn(f64) -> Density, deepest: u32) {
        if self.is_opaque() {
            return;
        }
        let (middle, half) = (f64::midpoint(a, b), (b - a) / 2.0);
        let at = GAUSS.map(|(x, _)| density(middle + half * x));
        let extinction = at.map(|d| d[0]);
        let depth = half * GAUSS.iter().zip(extinction).map(|((_, w), k)| w * k).sum::<f64>();
        let before = RULE.until.map(|row| (-half * dot(row, extinction)).exp());
        let emitted: [[f64; NODES]; 3] =
            std::array::from_fn(|c| std::array::from_fn(|j| at[j][c + 1] * before[j]));
        let rough = emitted.iter().fold(roughness(extinction), |most, e| most.max(roughness(*e)));
        let allowed = self.tolerance * (2.0 * half / self.span).max(LEAST_SHARE);
        if deepest > 0 && rough * 2.0 * half * self.transmittance > allowed {
            self.step(a, middle, density, deepest - 1);
            self.step(middle, b, density, deepest - 1);
            return;
        }
        for (colour, emitted) in self.colour.iter_mut().zip(emitted) {
            let sum: f64 = GAUSS.iter().zip(emitted).map(|((_, w), e)| w * e).sum();
            *colour += self.transmittance * half * sum;
        }
        self.transmittance *= (-depth).exp();
    }

    /// Linear premultiplied RGBA.
    pub(super) fn pixel(&self) -> [f64; 4] {
        let [r, g, b] = self.colour;
        [r, g, b, 1.0 - self.transmittance]
    }
}

/// ∫ f over a..b by the five-point rule alone: exact to degree 9.
pub(super) fn sum(a: f64, b: f64, f: impl Fn(f64) -> Density) -> Density {
    let (middle, half) = (f64::midpoint(a, b), (b - a) / 2.0);
    let mut total = [0.0; 4];
    for (x, w) in GAUSS {
        let at = f(middle + half * x);
        total.iter_mut().zip(at).for_each(|(t, v)| *t += half * w * v);
    }
    total
}

/// The mean of `f` over a..b to about `tolerance` of its size; no difference of integrals is taken,
/// so that a and b may be as close as they like. `f` is smooth between a and b: its Legendre terms fall
/// at least geometrically, and what a rule that is exact to degree 9 misses (terms from 10 on) is then less
/// than the square of terms 3 and 4. Parts a few thousand roundings of a and b wide are not divided
/// further: what is rough there is the grain of the numbers.
pub(super) fn mean(a: f64, b: f64, tolerance: f64, f: &impl Fn(f64) -> Density) -> Density {
    const GRAINS: f64 = 4096.0 * f64::EPSILON;
    fn part(
        a: f64,
        b: f64,
        size: f64,
        tolerance: f64,
        f: &impl Fn(f64) -> Density,
        deepest: u32,
    ) -> Density {
        let (middle, half) = (f64::midpoint(a, b), (b - a) / 2.0);
        let at = GAUSS.map(|(x, _)| f(middle + half * x));
        let channel = |c: usize| at.map(|d| d[c]);
        let rough = (0..4).map(|c| roughness(channel(c))).fold(0.0, f64::max) / size;
        let is_grain = half.abs() <= GRAINS * middle.abs();
        if deepest > 0 && rough * rough > tolerance && !is_grain {
            // Half as wide, twice the error.
            let near = part(a, middle, size, 2.0 * tolerance, f, deepest - 1);
            let far = part(middle, b, size, 2.0 * tolerance, f, deepest - 1);
            return std::array::from_fn(|c| f64::midpoint(near[c], far[c]));
        }
        std::array::from_fn(|c| {
            GAUSS.iter().zip(channel(c)).map(|((_, w), v)| w * v).sum::<f64>() / 2.0
        })
    }
    let size = f(a)[0].abs().max(f(b)[0].abs()).max(f(f64::midpoint(a, b))[0].abs());
    part(a, b, size.max(f64::MIN_POSITIVE), tolerance, f, 30)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_fog_is_its_closed_form_and_order_counts() {
        let mut light = Light::new(1e-9, 3.0);
        light.add(0.0, 1.0, &|_| [2.0, 2.0, 0.0, 0.0]);
        light.add(1.0, 3.0, &|_| [0.5, 0.0, 0.5, 0.0]);
        let near = 1.0 - (-2.0_f64).exp();
        let far = (-2.0_f64).exp() * (1.0 - (-1.0_f64).exp());
        let [r, g, b, a] = light.pixel();
        // Expected, not measured: 1e-11.
        assert!((r - near).abs() < 1e-9 && (g - far).abs() < 1e-9 && b == 0.0);
        assert!((a - (1.0 - (-3.0_f64).exp())).abs() < 1e-14);
    }

    #[test]
    fn an_unknown_step_is_found_to_the_tolerance() {
        let step = |t: f64| if t < 0.637 { [0.0; 4] } else { [1.5, 0.75, 0.0, 0.0] };
        for tolerance in [1e-4, 1e-6, 1e-8] {
            let mut light = Light::new(tolerance, 1.0);
            light.add(0.0, 1.0, &step);
            let expected = 1.0 - (-1.5_f64 * 0.363).exp();
            let error = (light.pixel()[3] - expected).abs();
            assert!(error < tolerance, "{tolerance}: {error}");
            assert!((light.pixel()[0] - expected / 2.0).abs() < tolerance);
        }
    }

    #[test]
    fn means_are_precise_however_close_the_ends() {
        let f = |v: f64| [v.exp(), v, 0.0, 0.0];
        for width in [2.0, 1e-3, 1e-9, 0.0] {
            let [found, ..] = mean(0.3, 0.3 + width, 1e-12, &f);
            let expected = if width > 1e-6 {
                0.3_f64.exp() * width.exp_m1() / width
            } else {
                0.3_f64.exp() * (1.0 + width / 2.0)
            };
            assert!((found - expected).abs() < 1e-12, "{width}: {found} {expected}");
        }
    }

    #[test]
    fn means_of_what_is_smooth_cost_few_places() {
        let places = std::cell::Cell::new(0);
        let f = |v: f64| {
            places.set(places.get() + 1);
            [-(-v).ln_1p(), v, 0.0, 0.0]
        };
        let [found, ..] = mean(0.0, 0.9, 1e-12, &f);
        let expected = (0.1 * 0.1_f64.ln() + 0.9) / 0.9;
        // Measured: 1.1e-16 and 198 places; with terms 3 and 4 themselves held to 1e-12, 4258.
        assert!((found - expected).abs() < 1e-12, "{:e}", found - expected);
        assert!(places.get() < 300, "{}", places.get());
    }
}

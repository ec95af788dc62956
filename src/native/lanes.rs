//! Arithmetic on eight rays at a time, a ray a lane.
//!
//! Functions are inlined by force: they are compiled anew for each instruction set, within the loop that calls them.

use fearless_simd::{Bytes, Simd, f32x4, f32x8, i32x8, mask32x8, prelude::*, u32x8};

/// Runs an expression with the instructions that the loops have ([`super::loops`]): AVX2 where a level has it, else what its kind of
/// processor has at least. `fearless_simd::dispatch!` compiles it five times over, and this takes most of a compiler's time.
macro_rules! dispatched {
    ($level:expr, $simd:ident => $run:expr) => {{
        let level: fearless_simd::Level = $level;
        #[cfg(target_arch = "x86_64")]
        match (level.as_avx2(), level.as_sse2()) {
            (Some($simd), _) => fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $run,
            ),
            (None, Some($simd)) => fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $run,
            ),
            (None, None) => unreachable!("every x86-64 processor has SSE2"),
        }
        #[cfg(not(target_arch = "x86_64"))]
        fearless_simd::dispatch!(level, $simd => $run)
    }};
}
pub(super) use dispatched;

/// Rays of a packet: a block of 4 × 2 pixels.
pub(super) const LANES: usize = 8;

/// A number of each ray.
pub(super) type Lanes<S> = f32x8<S>;
/// A yes or no of each ray.
pub(super) type Mask<S> = mask32x8<S>;

/// The same number of every ray.
#[inline(always)]
pub(super) fn all<S: Simd>(simd: S, x: f32) -> Lanes<S> {
    f32x8::splat(simd, x)
}

/// Whether any ray says yes.
#[inline(always)]
pub(super) fn any<S: Simd>(mask: Mask<S>) -> bool {
    mask.any_true()
}

/// One of two numbers of each ray.
#[inline(always)]
pub(super) fn choose<S: Simd>(mask: Mask<S>, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
    mask.select(yes, no)
}

/// A vector of each ray.
#[derive(Clone, Copy)]
pub(super) struct Vec3<S: Simd> {
    pub x: Lanes<S>,
    pub y: Lanes<S>,
    pub z: Lanes<S>,
}

impl<S: Simd> Vec3<S> {
    #[inline(always)]
    pub(super) fn splat(simd: S, v: [f32; 3]) -> Self {
        Self { x: all(simd, v[0]), y: all(simd, v[1]), z: all(simd, v[2]) }
    }

    /// `self` + `direction` · t.
    #[inline(always)]
    pub(super) fn at(self, direction: Self, t: Lanes<S>) -> Self {
        Self {
            x: direction.x.mul_add(t, self.x),
            y: direction.y.mul_add(t, self.y),
            z: direction.z.mul_add(t, self.z),
        }
    }

    #[inline(always)]
    pub(super) fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }

    #[inline(always)]
    pub(super) fn scaled(self, by: Lanes<S>) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }

    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> Lanes<S> {
        self.x.mul_add(other.x, self.y.mul_add(other.y, self.z * other.z))
    }

    /// The greatest part, whatever its sign.
    #[inline(always)]
    pub(super) fn greatest(self) -> Lanes<S> {
        self.x.abs().max(self.y.abs()).max(self.z.abs())
    }

    /// One of two vectors of each ray.
    #[inline(always)]
    pub(super) fn choose(mask: Mask<S>, yes: Self, no: Self) -> Self {
        Self {
            x: choose(mask, yes.x, no.x),
            y: choose(mask, yes.y, no.y),
            z: choose(mask, yes.z, no.z),
        }
    }

    #[inline(always)]
    pub(super) fn length(self) -> Lanes<S> {
        self.dot(self).sqrt()
    }

    #[inline(always)]
    pub(super) fn lane(self, i: usize) -> [f32; 3] {
        [self.x[i], self.y[i], self.z[i]]
    }
}

/// Colours and a weight of each ray.
#[derive(Clone, Copy)]
pub(super) struct Look<S: Simd> {
    pub colour: Vec3<S>,
    pub weight: Lanes<S>,
}

impl<S: Simd> Look<S> {
    #[inline(always)]
    pub(super) fn splat(simd: S, [r, g, b, weight]: [f32; 4]) -> Self {
        Self { colour: Vec3::splat(simd, [r, g, b]), weight: all(simd, weight) }
    }

    #[inline(always)]
    pub(super) fn choose(mask: Mask<S>, yes: Self, no: Self) -> Self {
        Self {
            colour: Vec3::choose(mask, yes.colour, no.colour),
            weight: choose(mask, yes.weight, no.weight),
        }
    }
}

/// Four numbers of each ray, from a row of four for each.
#[inline(always)]
pub(super) fn columns<S: Simd>(rows: [f32x4<S>; LANES]) -> [Lanes<S>; 4] {
    let block = |a: f32x4<S>, b: f32x4<S>, c: f32x4<S>, d: f32x4<S>| {
        let (ac, ac_high) = (a.zip_low(c), a.zip_high(c));
        let (bd, bd_high) = (b.zip_low(d), b.zip_high(d));
        [ac.zip_low(bd), ac.zip_high(bd), ac_high.zip_low(bd_high), ac_high.zip_high(bd_high)]
    };
    let [a, b, c, d, e, f, g, h] = rows;
    let ([a, b, c, d], [e, f, g, h]) = (block(a, b, c, d), block(e, f, g, h));
    // No `map`: what the compiler does not inline of it knows no wide instructions.
    [a.combine(e), b.combine(f), c.combine(g), d.combine(h)]
}

/// 1 − exp(−depth) to a relative 2.4e-6, of depths ≥ 0: a polynomial for a sixteenth of the depth, doubled four
/// times, since 1 − t² = a (2 − a) with a = 1 − t. Nothing cancels, so that thin matter keeps its digits.
#[inline(always)]
pub(super) fn opacity<S: Simd>(simd: S, depth: Lanes<S>) -> Lanes<S> {
    let y = depth.min(all(simd, 16.0)) * 0.0625;
    let mut a = all(simd, 0.005_511_813);
    for term in [-0.039_332_894, 0.165_838_5, -0.499_894_22, 0.999_997_76] {
        a = a.mul_add(y, all(simd, term));
    }
    a *= y;
    for _ in 0..4 {
        a *= all(simd, 2.0) - a;
    }
    a
}

/// x to the power of y, of x in (0, 1] and y ≥ 0, to a relative 1e-5 for y up to 128.
#[inline(always)]
pub(super) fn power<S: Simd>(simd: S, x: Lanes<S>, y: Lanes<S>) -> Lanes<S> {
    exponential_of_2(simd, logarithm_of_2(simd, x) * y)
}

/// ln x, of x > 0, to a relative 1e-6 of what is not near 1, and as much in all there.
#[inline(always)]
pub(super) fn logarithm<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    logarithm_of_2(simd, x) * std::f32::consts::LN_2
}

#[inline(always)]
fn logarithm_of_2<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    let bits: u32x8<S> = x.to_bits();
    // The exponent, and the fraction in 1..2, less 1.
    let exponent: i32x8<S> = (bits >> 23_u32).bitcast();
    let exponent = exponent.to_float::<f32x8<S>>() - 127.0;
    let fraction: f32x8<S> =
        ((bits & u32x8::splat(simd, 0x007f_ffff)) | u32x8::splat(simd, 0x3f80_0000)).bitcast();
    // About 1: from √½ to √2.
    let large = fraction.simd_gt(all(simd, std::f32::consts::SQRT_2));
    let fraction = choose(large, fraction * 0.5, fraction);
    let exponent = choose(large, exponent + 1.0, exponent);
    // log₂ f = 2/ln 2 · artanh s, s = (f − 1)/(f + 1), |s| ≤ 0.172.
    let s = (fraction - 1.0) / (fraction + 1.0);
    let s2 = s * s;
    let mut series = all(simd, 1.0 / 9.0);
    for term in [1.0 / 7.0, 1.0 / 5.0, 1.0 / 3.0, 1.0] {
        series = series.mul_add(s2, all(simd, term));
    }
    (s * series).mul_add(all(simd, 2.0 * std::f32::consts::LOG2_E), exponent)
}

/// exp(x), of x from −87 to 0, to a relative 1e-6.
#[inline(always)]
pub(super) fn exponential<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    exponential_of_2(simd, x * std::f32::consts::LOG2_E)
}

#[inline(always)]
fn exponential_of_2<S: Simd>(simd: S, power: Lanes<S>) -> Lanes<S> {
    let power = power.max(all(simd, -126.0));
    let whole = power.floor();
    // 2^r = exp(r ln 2), r in 0..1.
    let r = (power - whole) * std::f32::consts::LN_2;
    let mut series = all(simd, 1.0 / 5040.0);
    for term in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        series = series.mul_add(r, all(simd, term));
    }
    let scale: f32x8<S> =
        ((whole.to_int::<i32x8<S>>() + i32x8::splat(simd, 127)) << 23_u32).bitcast();
    series * scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::Level;

    #[test]
    fn opacities_and_powers_are_those_of_float64() {
        let level = Level::new();
        for i in 0..2000 {
            let depth = 10_f32.powf(-6.0 + 8.0 * i as f32 / 2000.0);
            let found = dispatched!(level, simd => opacity(simd, all(simd, depth))[3]);
            let exact = -(-f64::from(depth)).exp_m1();
            assert!((f64::from(found) / exact - 1.0).abs() < 3e-6, "{depth}: {found} {exact}");
            let x = 1e-6_f32.max(i as f32 / 1999.0);
            for y in [0.0, 0.5, 1.0, 10.0, 128.0] {
                let found = dispatched!(level, simd => power(simd, all(simd, x), all(simd, y))[5]);
                let exact = f64::from(x).powf(f64::from(y));
                assert!(
                    (f64::from(found) - exact).abs() < 1e-5 * exact + 1e-30,
                    "{x}^{y}: {found} {exact}"
                );
            }
        }
    }

    #[test]
    fn rows_become_columns() {
        let level = Level::new();
        let found: [[f32; 8]; 4] = dispatched!(level, simd => {
            let row = |i: usize| f32x4::from_fn(simd, |j| (4 * i + j) as f32);
            columns([0, 1, 2, 3, 4, 5, 6, 7].map(row)).map(|c| c.to_array())
        });
        for (j, column) in found.iter().enumerate() {
            assert_eq!(column.map(|x| x as usize), [0, 1, 2, 3, 4, 5, 6, 7].map(|i| 4 * i + j));
        }
    }
}

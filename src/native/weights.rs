//! What samples weigh by tents and by cubic B-splines, along one axis.

use fearless_simd::{Simd, prelude::*};

use super::lanes::{Lanes, all};

/// Of the four samples about a place in its cell, `f` beyond the second, by B-splines of their natural width.
#[inline(always)]
pub(super) fn natural<S: Simd>(simd: S, f: Lanes<S>) -> [Lanes<S>; 4] {
    let one = all(simd, 1.0);
    let g = one - f;
    let (f2, g2) = (f * f, g * g);
    let sixth = 1.0 / 6.0;
    // 2/3 − x² + x³/2.
    let inner = |f: Lanes<S>, f2: Lanes<S>| f2.mul_add(f * 0.5 - 1.0, all(simd, 4.0 / 6.0));
    [g2 * g * sixth, inner(f, f2), inner(g, g2), f2 * f * sixth]
}

/// Of a sample `x` natural widths away, x ≥ 0; by a B-spline six times it, for whoever divides by the sum.
#[inline(always)]
pub(super) fn at<S: Simd>(simd: S, x: Lanes<S>, is_tent: bool) -> Lanes<S> {
    let zero = all(simd, 0.0);
    let inner = (all(simd, 1.0) - x).max(zero);
    if is_tent {
        return inner;
    }
    let outer = (all(simd, 2.0) - x).max(zero);
    outer * outer * outer - inner * inner * inner * 4.0
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::*;
    use crate::native::lanes::dispatched;

    /// Both are the same spline, and its weights add up to 1; tents fall off evenly.
    #[test]
    fn weights_about_a_place_are_those_at_its_distances() {
        for step in 0..=20_u8 {
            let f = f32::from(step) / 20.0;
            let away = [1.0 + f, f, 1.0 - f, 2.0 - f];
            let (found, splines, tents) = dispatched!(Level::new(), simd => {
                let of = |is_tent| away.map(|x| at(simd, all(simd, x), is_tent)[3]);
                (natural(simd, all(simd, f)).map(|w| w[3]), of(false), of(true))
            });
            for (i, found) in found.into_iter().enumerate() {
                assert!((found - splines[i] / 6.0).abs() < 1e-6, "{f}, sample {i}: {found}");
                assert!((tents[i] - (1.0 - away[i]).max(0.0)).abs() < 1e-6, "{f}, sample {i}");
            }
            assert!((found.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{f}: {found:?}");
        }
    }
}

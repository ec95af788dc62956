//! A value along a piece of a ray as a polynomial in Bernstein form, cut where it crosses a level.

use std::sync::LazyLock;

/// Highest degree: a product of three cubics.
pub(super) const MOST_DEGREE: usize = 9;
/// Halvings before a piece that still turns is taken as it is.
const DEEPEST: u32 = 40;

type Row = [f64; MOST_DEGREE + 1];

/// Bernstein coefficients from values at `nodes`, for each degree.
static FITS: LazyLock<[[Row; MOST_DEGREE + 1]; MOST_DEGREE + 1]> =
    LazyLock::new(|| std::array::from_fn(fit));

/// Chebyshev's points of 0..1; none is an end.
fn node(degree: usize, j: usize) -> f64 {
    let angle = std::f64::consts::PI * (2 * j + 1) as f64 / (2 * degree + 2) as f64;
    (1.0 - angle.cos()) / 2.0
}

/// Inverse of the Bernstein polynomials at the nodes, by Gauss–Jordan with pivots.
fn fit(degree: usize) -> [Row; MOST_DEGREE + 1] {
    let n = degree + 1;
    let choose = |k: usize| (0..k).fold(1.0, |c, i| c * (degree - i) as f64 / (i + 1) as f64);
    let mut a = [[0.0; 2 * (MOST_DEGREE + 1)]; MOST_DEGREE + 1];
    for (j, row) in a.iter_mut().enumerate().take(n) {
        let x = node(degree, j);
        for (k, v) in row.iter_mut().enumerate().take(n) {
            *v = choose(k) * x.powi(k as i32) * (1.0 - x).powi((degree - k) as i32);
        }
        row[n + j] = 1.0;
    }
    for k in 0..n {
        let best = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap_or(k);
        a.swap(k, best);
        let pivot = a[k][k];
        a[k].iter_mut().for_each(|v| *v /= pivot);
        let row = a[k];
        for (_, other) in a.iter_mut().enumerate().take(n).filter(|(i, _)| *i != k) {
            let factor = other[k];
            other.iter_mut().zip(row).for_each(|(v, r)| *v -= factor * r);
        }
    }
    let mut inverse = [[0.0; MOST_DEGREE + 1]; MOST_DEGREE + 1];
    for (to, from) in inverse.iter_mut().zip(&a).take(n) {
        to[..n].copy_from_slice(&from[n..2 * n]);
    }
    inverse
}

/// A polynomial on a..b.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) a: f64,
    pub(super) b: f64,
    degree: usize,
    c: Row,
}

impl Piece {
    /// The polynomial of a degree that has the values of `f` at as many points inside a..b.
    pub(super) fn through(a: f64, b: f64, degree: usize, f: impl Fn(f64) -> f64) -> Self {
        let mut values = [0.0; MOST_DEGREE + 1];
        for (j, v) in values.iter_mut().enumerate().take(degree + 1) {
            *v = f(a + (b - a) * node(degree, j));
        }
        let rows = &FITS[degree];
        let c = std::array::from_fn(|k| {
            if k > degree {
                return 0.0;
            }
            rows[k].iter().zip(values).map(|(m, v)| m * v).sum()
        });
        Self { a, b, degree, c }
    }

    /// Its value at t of a..b (de Casteljau).
    pub(super) fn at(&self, t: f64) -> f64 {
        let x = if self.b > self.a { (t - self.a) / (self.b - self.a) } else { 0.0 };
        let mut c = self.c;
        for level in (0..self.degree).rev() {
            for k in 0..=level {
                c[k] += x * (c[k + 1] - c[k]);
            }
        }
        c[0]
    }

    /// Bounds of its values.
    pub(super) fn range(&self) -> [f64; 2] {
        let used = &self.c[..=self.degree];
        let least = used.iter().copied().fold(f64::INFINITY, f64::min);
        [least, used.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    }

    fn halves(&self) -> [Self; 2] {
        let middle = f64::midpoint(self.a, self.b);
        let (mut left, mut right, mut c) = (*self, *self, self.c);
        (left.b, right.a) = (middle, middle);
        for level in (0..=self.degree).rev() {
            left.c[self.degree - level] = c[0];
            right.c[level] = c[level];
            for k in 0..level {
                c[k] = f64::midpoint(c[k], c[k + 1]);
            }
        }
        [left, right]
    }

    fn is_monotone(&self) -> bool {
        let steps = || self.c[..=self.degree].windows(2).map(|w| w[1] - w[0]);
        steps().all(|d| d >= 0.0) || steps().all(|d| d <= 0.0)
    }

    /// Places in a..b, ascending, where it crosses any of the levels, which `levels` gives for an open
    /// range of values, ascending.
    pub(super) fn crossings<'l>(
        &self,
        levels: &impl Fn(f64, f64) -> &'l [f64],
        found: &mut Vec<f64>,
    ) {
        self.cross(levels, found, DEEPEST);
    }

    fn cross<'l>(
        &self,
        levels: &impl Fn(f64, f64) -> &'l [f64],
        found: &mut Vec<f64>,
        deepest: u32,
    ) {
        let [low, high] = self.range();
        let between = levels(low, high);
        if between.is_empty() {
            return;
        }
        if !self.is_monotone() && deepest > 0 {
            let [left, right] = self.halves();
            left.cross(levels, found, deepest - 1);
            // The middle itself is inside neither half.
            if between.contains(&right.c[0]) {
                found.push(right.a);
            }
            right.cross(levels, found, deepest - 1);
            return;
        }
        let (first, last) = (self.c[0], self.c[self.degree]);
        let one = |level: &f64| {
            let (mut a, mut b) = (self.a, self.b);
            while b - a > 1e-15 * (self.a.abs() + self.b.abs()) {
                let middle = f64::midpoint(a, b);
                if middle <= a || middle >= b {
                    break;
                }
                if (self.at(middle) < *level) == (first < last) {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            f64::midpoint(a, b)
        };
        if first < last {
            found.extend(between.iter().map(one));
        } else {
            found.extend(between.iter().rev().map(one));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_is_the_polynomial_it_was_made_from() {
        let f = |t: f64| (0..=9).map(|k| (t - 0.3 * f64::from(k)).powi(k) / 7.0).sum::<f64>();
        let piece = Piece::through(0.2, 1.9, 9, f);
        for i in 0..=40 {
            let t = 0.2 + 1.7 * f64::from(i) / 40.0;
            assert!((piece.at(t) - f(t)).abs() < 1e-11, "{t}: {} {}", piece.at(t), f(t));
            let [left, right] = piece.halves();
            let half = if t < left.b { left } else { right };
            assert!((half.at(t) - f(t)).abs() < 1e-11, "{t}");
        }
        // A degree too few shows.
        let short = Piece::through(0.2, 1.9, 8, f);
        assert!((short.at(1.9) - f(1.9)).abs() > 1e-8);
    }

    #[test]
    fn every_crossing_is_found_in_order() {
        // Three roots of a cubic, two of them close to each other.
        let roots = [0.25, 0.2501, 0.8];
        let f = |t: f64| roots.iter().map(|r| t - r).product::<f64>();
        let piece = Piece::through(0.0, 1.0, 3, f);
        let mut found = Vec::new();
        piece
            .crossings(&|low, high| if low < 0.0 && high > 0.0 { &[0.0] } else { &[] }, &mut found);
        assert_eq!(found.len(), 3, "{found:?}");
        for (found, root) in found.iter().zip(roots) {
            assert!((found - root).abs() < 1e-10, "{found} {root}");
        }
    }

    #[test]
    fn falling_pieces_cross_their_levels_from_the_top() {
        let piece = Piece::through(1.0, 3.0, 1, |t| 10.0 - t);
        let mut found = Vec::new();
        piece.crossings(&|_, _| &[7.5, 8.0, 8.5], &mut found);
        assert!(found.iter().zip([1.5, 2.0, 2.5]).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }
}

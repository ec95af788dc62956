//! Weights by stable least squares.

use super::points::weighed;
use crate::core::parallel;

/// Columns are summed in so many parts side by side, and these in their order: the same bits by any number of threads.
const PARTS: usize = 4;

/// A function's values at the points that it reaches.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    pub(super) points: Vec<u32>,
    pub(super) values: Vec<f32>,
}

impl Column {
    fn dot(&self, residual: &[f64]) -> f64 {
        let pairs = self.points.iter().zip(&self.values);
        pairs.map(|(point, value)| residual[*point as usize] * f64::from(*value)).sum()
    }

    pub(super) fn add_to(&self, sum: &mut [f64], times: f64) {
        for (point, value) in self.points.iter().zip(&self.values) {
            sum[*point as usize] += f64::from(*value) * times;
        }
    }

    /// Of its values by the points' `roots`, where there are some.
    pub(super) fn norm(&self, roots: &[f64]) -> f64 {
        let root = |point: &u32| roots.get(*point as usize).copied().unwrap_or(1.0);
        let pairs = self.points.iter().zip(&self.values);
        pairs.map(|(point, value)| (f64::from(*value) * root(point)).powi(2)).sum::<f64>().sqrt()
    }
}

/// The changes of all weights, and last that of the bias, that make the residual least in the sense of squares. The method is
/// LSQR (Paige and Saunders 1982), which never forms the normal equations. Columns are scaled to a length of one. `damping`
/// keeps the changes small, so that two columns that are nearly the same share a change instead of cancelling each other.
///
/// `roots` are those of how much each point counts, or none: rows are multiplied by them.
///
/// The weights themselves are held back, too: least is |A x − r|² + λ² |w + x|² for columns of length one, the bias left
/// free. `weights` w are those that there are, one a column, and λ is `ridge`; 0 leaves them free. Damped changes alone add up
/// from one solution to the next.
pub(super) fn least_squares(
    columns: &[Column],
    residual: &[f64],
    roots: &[f64],
    damping: f64,
    (weights, ridge): (&[f64], f64),
) -> Vec<f64> {
    const MOST_TURNS: usize = 40;
    const ENOUGH: f64 = 1e-5;
    let scales = parallel::list(columns.len(), |i| inverse(columns[i].norm(roots)));
    let all = match roots {
        [] => residual.len() as f64,
        roots => roots.iter().map(|root| root * root).sum(),
    };
    let constant = inverse(all.sqrt());
    let transposed = |u: &[f64]| -> Vec<f64> {
        // Below the rows of points there is one for each weight that is held.
        let (u, of_weights) = u.split_at(residual.len());
        let u = weighed(roots, u);
        let mut all = parallel::list(columns.len(), |i| columns[i].dot(&u) * scales[i]);
        all.iter_mut().zip(of_weights).for_each(|(all, own)| *all += ridge * own);
        all.push(u.iter().sum::<f64>() * constant);
        all
    };
    let times = |v: &[f64]| -> Vec<f64> {
        let share = columns.len().div_ceil(PARTS).max(1);
        let sums = parallel::list(columns.len().div_ceil(share), |part| {
            let mut sum = vec![0.0; residual.len()];
            for i in parallel::part(columns.len(), share, part) {
                columns[i].add_to(&mut sum, v[i] * scales[i]);
            }
            sum
        });
        let mut sum = vec![0.0; residual.len()];
        for part in sums {
            sum.iter_mut().zip(&part).for_each(|(sum, part)| *sum += part);
        }
        let last = v.last().copied().unwrap_or_default() * constant;
        sum.iter_mut().for_each(|value| *value += last);
        sum.iter_mut().zip(roots).for_each(|(value, root)| *value *= root);
        sum.extend(v.iter().zip(weights).map(|(v, _)| ridge * v));
        sum
    };

    let mut x = vec![0.0; columns.len() + 1];
    let mut u = weighed(roots, residual).into_owned();
    // By the length of a column, whose inverse the scale is; one of nothing has no weight to hold.
    u.extend(weights.iter().zip(&scales).map(|(weight, scale)| -ridge * weight * inverse(*scale)));
    let mut beta = normalise(&mut u);
    let mut v = transposed(&u);
    let mut alpha = normalise(&mut v);
    let mut w = v.clone();
    let (mut phi_bar, mut rho_bar) = (beta, alpha);
    let first = alpha * beta;
    for _ in 0..MOST_TURNS {
        if alpha == 0.0 || phi_bar.abs() * alpha <= ENOUGH * first {
            break;
        }
        let next = times(&v);
        u.iter_mut().zip(&next).for_each(|(u, next)| *u = next - alpha * *u);
        beta = normalise(&mut u);
        let next = transposed(&u);
        v.iter_mut().zip(&next).for_each(|(v, next)| *v = next - beta * *v);
        alpha = normalise(&mut v);
        // The damping's turn, then that of the bidiagonal's own.
        let damped = rho_bar.hypot(damping);
        phi_bar *= rho_bar / damped;
        let rho = damped.hypot(beta);
        let (c, s) = (damped / rho, beta / rho);
        let theta = s * alpha;
        rho_bar = -c * alpha;
        let phi = c * phi_bar;
        phi_bar *= s;
        for ((x, w), v) in x.iter_mut().zip(&mut w).zip(&v) {
            *x += phi / rho * *w;
            *w = v - theta / rho * *w;
        }
    }
    for (x, scale) in x.iter_mut().zip(scales.iter().chain([&constant])) {
        *x *= scale;
    }
    x
}

fn inverse(length: f64) -> f64 {
    if length > 0.0 { length.recip() } else { 0.0 }
}

/// Scales to a length of one; what it was.
fn normalise(v: &mut [f64]) -> f64 {
    let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let scale = inverse(length);
    v.iter_mut().for_each(|v| *v *= scale);
    length
}

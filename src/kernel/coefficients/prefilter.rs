//! The cubic B-spline's exact recursive prefilter, and the tents nearest to its spline, in place.

use super::store;
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::kernel::Separable;

/// √3 − 2, the pole of the inverse of (1 4 1)/6 (Unser, Aldroubi, Eden 1993, part II, table I).
const POLE: f64 = -0.267_949_192_431_122_7;
/// (1 − z)(1 − 1/z): what the two recursions take off a constant.
const GAIN: f64 = 6.0;
/// Powers of the pole beyond this one vanish in float64: 0.268⁴⁰ = 1e-23.
const HORIZON: usize = 40;
/// Lines filtered side by side.
const WIDTH: usize = 16;
/// The least and the most samples of a row, and pieces of one, that a worker takes at a time.
const LEAST_PIECE: usize = 64;
const MOST_PIECES: usize = 64;
/// Samples along x between two looks at the ticket.
const CHUNK: usize = 1 << 16;

/// What samples are turned into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Target<'a> {
    /// The coefficients of the cubic B-splines that pass through them.
    Spline,
    /// The coefficients of the tents that are nearest to that spline, in the mean square over space:
    /// its products with each tent, over theirs with one another (1 4 1)/6, are the spline's
    /// coefficients filtered with B⁵ at whole numbers, (1 26 66 26 1)/120, and prefiltered once more.
    /// Tents through the samples flatten every peak by a twelfth of its curvature.
    Tents,
    /// The samples of a spline that is widened: of its own coefficients, weighed by the wider kernel.
    Widened(&'a Widened),
}

/// A spline whose kernels are wider than natural, at the samples.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Widened {
    /// h(k/s) / Σ h at offsets 0, 1, 2, …
    taps: Vec<f64>,
    /// Whether the samples are sharpened first, as the spline of natural width is to pass through them.
    interpolating: bool,
}

impl Widened {
    pub(super) fn new(kernel: Separable, interpolating: bool) -> Self {
        let (first, weights) = kernel.weights(0.0);
        let middle = usize::try_from(-first).unwrap_or(0);
        Self { taps: weights[middle..].to_vec(), interpolating }
    }
}

impl Target<'_> {
    fn filter<const W: usize>(self, lines: &mut [[f64; W]]) {
        match self {
            Self::Spline => filter(lines),
            Self::Tents => {
                filter(lines);
                filter(lines);
                weigh(lines);
            }
            Self::Widened(Widened { taps, interpolating }) => {
                if *interpolating {
                    filter(lines);
                }
                convolve(lines, taps);
            }
        }
    }
}

/// Filters every line along each axis in turn. Arithmetic within a line is in float64.
pub(super) fn prefilter(
    values: &mut [f32],
    dims: [usize; 3],
    target: Target<'_>,
    ticket: &Ticket,
) -> Result<(), Cancelled> {
    along_rows(values, dims[0], target, ticket)?;
    across_rows(values, dims[0], dims[1], target, ticket)?;
    across_rows(values, dims[0] * dims[1], dims[2], target, ticket)
}

/// Filters contiguous lines of `length`.
fn along_rows(
    values: &mut [f32],
    length: usize,
    target: Target<'_>,
    ticket: &Ticket,
) -> Result<(), Cancelled> {
    if length < 2 {
        return Ok(());
    }
    let lines = (CHUNK / length).max(1);
    parallel::try_each(values.chunks_mut(lines * length), |chunk| {
        if ticket.is_cancelled() {
            return Err(Cancelled);
        }
        let mut line = vec![[0.0]; length];
        for row in chunk.chunks_exact_mut(length) {
            for (to, &from) in line.iter_mut().zip(&*row) {
                *to = [f64::from(from)];
            }
            target.filter(&mut line);
            for (to, from) in row.iter_mut().zip(&line) {
                *to = store(from[0]);
            }
        }
        Ok(())
    })
}

/// Filters lines that run across `rows` rows of `row` samples each, in every such stack of rows.
fn across_rows(
    values: &mut [f32],
    row: usize,
    rows: usize,
    target: Target<'_>,
    ticket: &Ticket,
) -> Result<(), Cancelled> {
    if row == 1 {
        return along_rows(values, rows, target, ticket);
    }
    if rows < 2 {
        return Ok(());
    }
    let piece = row.div_ceil(MOST_PIECES).max(LEAST_PIECE);
    parallel::try_each(values.chunks_mut(row * rows), |stack| {
        // Pieces of rows that lie above one another, so that workers share no memory.
        let mut columns: Vec<Vec<&mut [f32]>> =
            (0..row.div_ceil(piece)).map(|_| Vec::with_capacity(rows)).collect();
        for row in stack.chunks_exact_mut(row) {
            for (column, piece) in columns.iter_mut().zip(row.chunks_mut(piece)) {
                column.push(piece);
            }
        }
        parallel::try_each(columns.into_iter(), |mut column| {
            let mut lines = vec![[0.0; WIDTH]; rows];
            for start in (0..column[0].len()).step_by(WIDTH) {
                if ticket.is_cancelled() {
                    return Err(Cancelled);
                }
                let end = (start + WIDTH).min(column[0].len());
                for (line, piece) in lines.iter_mut().zip(&column) {
                    for (to, &from) in line.iter_mut().zip(&piece[start..end]) {
                        *to = f64::from(from);
                    }
                }
                target.filter(&mut lines);
                for (line, piece) in lines.iter().zip(&mut column) {
                    for (&from, to) in line.iter().zip(&mut piece[start..end]) {
                        *to = store(from);
                    }
                }
            }
            Ok(())
        })
    })
}

/// Which sample stands at place `k` of a line that is mirrored about its first and its last sample, and so repeats itself
/// every `period` places.
fn mirrored(k: usize, period: usize) -> usize {
    let k = k % period;
    k.min(period - k)
}

/// Weighs lines by `taps`, at offsets 0, ±1, ±2, …, mirrored as in [`filter`].
fn convolve<const W: usize>(lines: &mut [[f64; W]], taps: &[f64]) {
    let last = lines.len() - 1;
    if last == 0 {
        return;
    }
    let period = 2 * last;
    let original = lines.to_vec();
    for (k, line) in lines.iter_mut().enumerate() {
        line.iter_mut().for_each(|weighed| *weighed *= taps[0]);
        for (offset, tap) in taps.iter().enumerate().skip(1) {
            // So many periods on that nothing before the start is negative.
            let before = &original[mirrored(k + period * offset - offset, period)];
            let after = &original[mirrored(k + offset, period)];
            for ((weighed, before), after) in line.iter_mut().zip(before).zip(after) {
                *weighed += tap * (before + after);
            }
        }
    }
}

/// (1 26 66 26 1)/120 along lines, mirrored as in [`filter`].
fn weigh<const W: usize>(lines: &mut [[f64; W]]) {
    let last = lines.len() - 1;
    if last == 0 {
        return;
    }
    let period = 2 * last;
    // Those already overwritten, and those that mirrored ones at the end are images of.
    let original = lines.to_vec();
    for (k, line) in lines.iter_mut().enumerate() {
        // Two periods on, nothing before the start is negative.
        let at = |offset: usize| &original[mirrored(k + 2 * period + offset - 2, period)];
        for (w, weighed) in line.iter_mut().enumerate() {
            let outer = at(0)[w] + at(4)[w];
            let inner = at(1)[w] + at(3)[w];
            *weighed = (outer + 26.0 * inner + 66.0 * at(2)[w]) / 120.0;
        }
    }
}

/// Filters `W` lines side by side: `lines[k]` holds sample k of each. Mirrored about the first and
/// the last sample, which is exact for every length.
fn filter<const W: usize>(lines: &mut [[f64; W]]) {
    let last = lines.len() - 1;
    if last == 0 {
        return;
    }
    // Forwards: c⁺ₖ = sₖ + z·c⁺ₖ₋₁. At the start all of the mirrored past counts:
    // c⁺₀ = Σ zᵏ sₖ, k = 0 … ∞, which repeats after 2·last samples.
    let period = 2 * last;
    let mut first = [0.0; W];
    let mut power = 1.0;
    for k in 0..period.min(HORIZON) {
        let sample = &lines[if k > last { period - k } else { k }];
        for (sum, s) in first.iter_mut().zip(sample) {
            *sum += power * s;
        }
        power *= POLE;
    }
    let repeated = if period <= HORIZON { 1.0 / (1.0 - power) } else { 1.0 };
    lines[0] = first.map(|sum| GAIN * sum * repeated);
    let mut previous = lines[0];
    for line in &mut lines[1..] {
        for (c, p) in line.iter_mut().zip(&mut previous) {
            *c = GAIN * *c + POLE * *p;
            *p = *c;
        }
    }
    // Backwards: cₖ = z·(cₖ₊₁ − c⁺ₖ); at the end from the symmetry about the last sample.
    let before = lines[last - 1];
    for (c, b) in lines[last].iter_mut().zip(before) {
        *c = POLE / (POLE * POLE - 1.0) * (*c + POLE * b);
    }
    let mut next = lines[last];
    for line in lines[..last].iter_mut().rev() {
        for (c, n) in line.iter_mut().zip(&mut next) {
            *c = POLE * (*n - *c);
            *n = *c;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the normal equations, whose integrals are taken by Gauss' rule cell by cell, on a mirrored
    /// line of every length: products of spline and tents are of degree 4.
    #[test]
    fn tents_are_the_nearest_to_the_spline() {
        fn bspline(x: f64) -> f64 {
            let x = x.abs();
            match x {
                _ if x < 1.0 => 2.0 / 3.0 - x * x + x * x * x / 2.0,
                _ if x < 2.0 => (2.0 - x).powi(3) / 6.0,
                _ => 0.0,
            }
        }
        let points =
            [(-0.6_f64.sqrt(), 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.6_f64.sqrt(), 5.0 / 18.0)];
        for n in [2_usize, 3, 7, 40] {
            let samples: Vec<f32> = (0..n).map(|i| ((i * 37 % 11) as f32) - 4.0).collect();
            let (mut spline, mut tents) = (samples.clone(), samples);
            prefilter(&mut spline, [n, 1, 1], Target::Spline, &Ticket::new()).unwrap();
            prefilter(&mut tents, [n, 1, 1], Target::Tents, &Ticket::new()).unwrap();
            let at = |line: &[f32], k: i64| {
                let period = 2 * (n as i64 - 1);
                let k = k.rem_euclid(period);
                f64::from(line[k.min(period - k) as usize])
            };
            // What is left is orthogonal to every tent.
            for i in 0..n as i64 {
                let mut product = 0.0;
                for cell in [i - 1, i] {
                    for (place, weight) in points {
                        let x = cell as f64 + 0.5 + 0.5 * place;
                        let f: f64 = (cell - 2..=cell + 3)
                            .map(|k| at(&spline, k) * bspline(x - k as f64))
                            .sum();
                        let (left, right) = (at(&tents, cell), at(&tents, cell + 1));
                        let g = left + (right - left) * (x - cell as f64);
                        product += weight * (f - g) * (1.0 - (x - i as f64).abs());
                    }
                }
                // Measured: 6e-7.
                assert!(product.abs() < 3e-6, "{n} {i}: {product}");
            }
        }
    }

    #[test]
    fn lines_of_every_length_interpolate_their_samples() {
        for n in (1..=64).chain([255, 1000]) {
            let samples: Vec<[f64; 2]> = (0..n)
                .map(|i| [((i * 7919 + 13) % 101) as f64, if i % 2 == 0 { 1.0 } else { -1.0 }])
                .collect();
            let mut c = samples.clone();
            filter(&mut c);
            for (k, sample) in samples.iter().enumerate() {
                let before = if k == 0 { 1.min(n - 1) } else { k - 1 };
                let after = if k + 1 < n { k + 1 } else { n.saturating_sub(2) };
                for w in 0..2 {
                    let value = (c[before][w] + 4.0 * c[k][w] + c[after][w]) / 6.0;
                    assert!((value - sample[w]).abs() < 1e-12 * 300.0, "{n} {k} {w}: {value}");
                }
            }
        }
    }

    #[test]
    fn the_pole_and_the_gain_are_those_of_one_four_one() {
        assert!((POLE - (3.0_f64.sqrt() - 2.0)).abs() < 1e-15);
        assert!((POLE * POLE + 4.0 * POLE + 1.0).abs() < 1e-15);
        assert!(((1.0 - POLE) * (1.0 - 1.0 / POLE) - GAIN).abs() < 1e-14);
    }

    #[test]
    fn a_cancelled_filter_stops() {
        let ticket = Ticket::new();
        ticket.cancel();
        let cancelled = prefilter(&mut [1.0; 8], [2, 2, 2], Target::Spline, &ticket);
        assert_eq!(cancelled, Err(Cancelled));
    }
}

//! Planes of numbers, and the filters that metrics need.

use crate::core::colour::srgb_from_linear;
use crate::core::parallel;

/// One number a pixel, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plane {
    /// Width and height.
    pub(super) size: [usize; 2],
    pub(super) values: Vec<f64>,
}

/// Rec. 601 luma of what a display shows of light over black, in 0..=1.
///
/// # Panics
/// Where `light` has not as many pixels as `size`.
pub(super) fn luma(light: &[[f64; 4]], size: [usize; 2]) -> Plane {
    assert_eq!(light.len(), size[0] * size[1], "a picture of its size");
    let coded = |c: f64| srgb_from_linear(c.clamp(0.0, 1.0));
    let values = parallel::list(light.len(), |i| {
        let [r, g, b, _] = light[i];
        0.299 * coded(r) + 0.587 * coded(g) + 0.114 * coded(b)
    });
    Plane { size, values }
}

impl Plane {
    pub(super) fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Self { size: self.size, values: self.values.iter().map(|&v| f(v)).collect() }
    }

    /// Both planes pixel by pixel; of one size.
    pub(super) fn zip(&self, other: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let pairs = self.values.iter().zip(&other.values);
        Self { size: self.size, values: pairs.map(|(&a, &b)| f(a, b)).collect() }
    }

    /// Correlated with the product of two odd-sized weight vectors, edges held.
    pub(super) fn filtered(&self, across: &[f64], down: &[f64]) -> Self {
        let [width, height] = self.size;
        let reach = across.len() / 2;
        let mut rows = vec![0.0; self.values.len()];
        let pairs = rows.chunks_mut(width).zip(self.values.chunks(width));
        parallel::each(pairs, |(out, row)| {
            // The row with its ends held, so that the inner loop has no edge.
            let mut held = vec![row[0]; reach];
            held.extend_from_slice(row);
            held.resize(width + 2 * reach, row[width - 1]);
            for (x, value) in out.iter_mut().enumerate() {
                *value = held[x..].iter().zip(across).map(|(v, w)| v * w).sum();
            }
        });
        let reach = down.len() / 2;
        let mut values = vec![0.0; rows.len()];
        parallel::each(values.chunks_mut(width).enumerate(), |(y, out)| {
            for (i, weight) in down.iter().enumerate() {
                let from = (y + i).saturating_sub(reach).min(height - 1);
                let row = &rows[from * width..][..width];
                out.iter_mut().zip(row).for_each(|(value, v)| *value += weight * v);
            }
        });
        Self { size: self.size, values }
    }

    /// Without `margin` pixels at each edge; smaller planes than that leave nothing.
    pub(super) fn inner(&self, margin: usize) -> Self {
        let [width, height] = self.size;
        let size = self.size.map(|n| n.saturating_sub(2 * margin));
        let values = (margin..height.saturating_sub(margin).max(margin))
            .flat_map(|y| &self.values[y * width + margin..][..size[0]])
            .copied()
            .collect();
        Self { size, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_correlate_and_hold_the_edges() {
        let plane = Plane { size: [3, 2], values: vec![1.0, 2.0, 4.0, 10.0, 20.0, 40.0] };
        let shifted = plane.filtered(&[0.0, 0.0, 1.0], &[1.0]);
        assert_eq!(shifted.values, [2.0, 4.0, 4.0, 20.0, 40.0, 40.0]);
        let below = plane.filtered(&[1.0], &[0.0, 0.0, 1.0]);
        assert_eq!(below.values, [10.0, 20.0, 40.0, 10.0, 20.0, 40.0]);
        // Wider than the plane.
        let wide = plane.filtered(&[0.2; 5], &[0.2; 5]);
        assert!((wide.values[0] - 0.04 * (3.0 * 1.0 + 2.0 + 4.0) * (3.0 + 20.0)).abs() < 1e-12);
        assert_eq!(plane.inner(1).size, [1, 0]);
        let inner = plane.filtered(&[1.0], &[1.0]).inner(0);
        assert_eq!(inner, plane);
    }

    #[test]
    fn luma_is_of_what_is_shown() {
        let shown = luma(&[[1.0; 4], [2.0, 1.0, 1.0, 1.0], [0.0, 0.214_041, 0.0, 0.3]], [3, 1]);
        for (found, expected) in shown.values.iter().zip([1.0, 1.0, 0.587 * 0.5]) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }
}

//! How much matter hides, seen along the axes of its grid: boxes of it laid over columns, and the mean opacity
//! of these.
//!
//! Coarser things that stand for finer ones spread their matter over their boxes and beyond, where the finer
//! ones leave gaps and lie behind each other: they hide more. How much less matter hides as much is what
//! [`Cover::factor`] says.

/// Edge of the box that spreads matter as far as a cubic kernel does, in the edges of what the kernel is of: √12
/// times the root of the footprint's variance along an axis, 0.1994.
pub const REACH: f32 = 1.547;
/// Cells beyond the border: a kernel of a box no larger than 32 cells ends there.
pub const PAD: usize = 10;
/// Halvings of the interval in which a factor is looked for.
const HALVINGS: u32 = 20;

/// Axes across one, the faster first.
pub fn across(axis: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][axis]
}

/// Depths of columns along an axis, with a border of [`PAD`] cells.
#[derive(Debug, Clone)]
pub struct Map {
    /// Rows of [`Self::width`]. While boxes are laid, differences along both axes; then depths.
    pub sums: Vec<f32>,
    /// Cells in a row, borders included.
    pub width: usize,
    cells: [usize; 2],
}

impl Map {
    /// Nothing over so many columns across and down.
    pub fn new(cells: [usize; 2]) -> Self {
        // A cell more, for the differences.
        let [width, height] = cells.map(|n| n + 2 * PAD + 1);
        Self { sums: vec![0.0; width * height], width, cells }
    }

    /// Adds a box, `[low, size]` across and down in cells, whose columns are so deep, spread over
    /// `reach` times its edges. What would lie beyond the border is left out.
    pub fn lay(&mut self, [u, v]: [[f32; 2]; 2], reach: f32, depth: f32) {
        let edges = |[low, size]: [f32; 2], n: usize| {
            let low = low + PAD as f32;
            let beyond = size * (reach - 1.0) / 2.0;
            [low - beyond, low + size + beyond].map(|edge| {
                let edge = edge.clamp(0.0, (n + 2 * PAD - 1) as f32);
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a cell"
                )]
                let cell = edge as usize;
                (cell, edge - cell as f32)
            })
        };
        let sum = depth / (reach * reach);
        let (us, vs) = (edges(u, self.cells[0]), edges(v, self.cells[1]));
        for ((v, part_v), sign_v) in vs.into_iter().zip([1.0, -1.0]) {
            for ((u, part_u), sign_u) in us.into_iter().zip([1.0, -1.0]) {
                let sum = sum * sign_u * sign_v;
                let place = v * self.width + u;
                self.sums[place] += sum * (1.0 - part_u) * (1.0 - part_v);
                self.sums[place + 1] += sum * part_u * (1.0 - part_v);
                self.sums[place + self.width] += sum * (1.0 - part_u) * part_v;
                self.sums[place + self.width + 1] += sum * part_u * part_v;
            }
        }
    }

    /// Depths, of the differences that boxes left.
    #[must_use]
    pub fn summed(mut self) -> Self {
        let width = self.width;
        for row in self.sums.chunks_mut(width) {
            row.iter_mut().fold(0.0, |sum, cell| {
                *cell += sum;
                *cell
            });
        }
        for place in width..self.sums.len() {
            self.sums[place] += self.sums[place - width];
        }
        self
    }
}

/// Columns by optical depth, in bins a sixteenth of a doubling wide: how many, and their mean.
#[derive(Debug, Clone)]
pub struct Cover(Vec<[f64; 2]>);

impl Cover {
    /// Bits of a depth's fraction that no bin tells apart: all but four.
    const DROPPED_BITS: u32 = f32::MANTISSA_DIGITS - 1 - 4;

    /// Of maps whose sums are in units of `depth`.
    pub fn of(maps: impl Iterator<Item = Map>, depth: f32) -> Self {
        let mut bins = vec![[0.0; 2]; 1 << (31 - Self::DROPPED_BITS)];
        for map in maps {
            for tau in map.sums.into_iter().map(|sum| sum * depth).filter(|tau| *tau > 0.0) {
                // Exponent and leading bits, which count up with the depth.
                let bin = &mut bins[(tau.to_bits() >> Self::DROPPED_BITS) as usize];
                bin[0] += 1.0;
                bin[1] += f64::from(tau);
            }
        }
        Self(bins.into_iter().filter(|bin| bin[0] > 0.0).map(|[n, sum]| [n, sum / n]).collect())
    }

    /// Opacity of all columns together, of so many times their depth.
    pub fn hidden(&self, factor: f64) -> f64 {
        self.0.iter().map(|[n, tau]| -n * (-factor * tau).exp_m1()).sum()
    }

    /// What depths are to be multiplied by, 1 at most, so that columns hide so much together.
    pub fn factor(&self, hidden: f64) -> f32 {
        let (mut low, mut high) = (0.0, 1.0);
        if self.hidden(high) <= hidden {
            return 1.0;
        }
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(low, high);
            *(if self.hidden(middle) > hidden { &mut high } else { &mut low }) = middle;
        }
        #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
        let factor = high as f32;
        factor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_of_32_cells_lose_nothing_at_the_borders() {
        let mut map = Map::new([40, 33]);
        for low in [[0.0, 0.0], [8.0, 0.0], [8.0, 1.0]] {
            map.lay(low.map(|low| [low, 32.0]), REACH, 1.0);
        }
        let sum: f32 = map.summed().sums.iter().sum();
        assert!((sum / (3.0 * 1024.0) - 1.0).abs() < 1e-3, "{sum}");
    }

    #[test]
    fn factors_hide_what_is_asked_for() {
        let mut map = Map::new([9, 9]);
        for n in 0..9 {
            map.lay([[n as f32, 1.0]; 2], REACH, 0.3 * (n + 1) as f32);
        }
        let cover = Cover::of([map.summed()].into_iter(), 2.0);
        for share in [0.03, 0.4, 0.93] {
            let wanted = cover.hidden(1.0) * share;
            let found = cover.hidden(f64::from(cover.factor(wanted)));
            assert!((found / wanted - 1.0).abs() < 1e-4, "{share}: {found} {wanted}");
        }
        assert_eq!(cover.factor(cover.hidden(1.0)), 1.0);
    }
}

//! A kernel's slab integrals as a table, for machines that have only single precision.

use std::sync::LazyLock;

use super::radial::{RadialKernel, Shape};

/// Rows of a [`SlabTable`], over l/R from 0 to 1.
///
/// Of all tables of an even number of rows and of columns divisible by four, 26 × 84 (8.7 kB) is
/// the smallest within 1e-4 of F(0) for both kernels. With rows over l²/R² the cubic, whose F falls
/// steeply at first, stays above 1.2e-4 up to 32 × 96.
pub const SLAB_ROWS: usize = 26;
/// Columns of a [`SlabTable`], over |u|/√(R² − l²) from 0 to 1.
pub const SLAB_COLUMNS: usize = 84;
/// The last row stands this close before the rim, where a share still has its digits.
const RIM: f64 = 1e-4;
/// Steps along each axis at which the finished table is checked, none of them its own.
const CHECKS: u32 = 401;

/// Which share of a footprint F(l) a line has gathered at u along it: S = G(l, u)/F(l), see
/// [`RadialKernel::cumulative`]. A slab's integral is F(l)·(S(u₁) − S(u₀)), with F from where the
/// footprint comes from.
///
/// With p = l/R and t = u/√(R² − l²), S = ½ ± T(p, |t|), and T from 0 to ½ is tabulated and
/// interpolated bilinearly. Shares of slabs that adjoin are differences at the same u, so they add
/// up to the footprint whatever the table's error; before the chord S is exactly 0, behind it
/// exactly 1. The table is the same at every extent.
#[derive(Debug, Clone, PartialEq)]
pub struct SlabTable {
    /// R: where the kernel ends, voxels.
    pub radius: f32,
    /// T, [`SLAB_ROWS`] rows of [`SLAB_COLUMNS`]; the first column is 0, the last ½.
    pub shares: Vec<f32>,
    /// Greatest |F·S − G| in single precision, as a part of F(0).
    pub max_error: f64,
}

impl SlabTable {
    /// The table of a kernel. Tables are made once a run.
    pub fn of(kernel: RadialKernel) -> Self {
        static GAUSSIAN: LazyLock<SlabTable> =
            LazyLock::new(|| make(RadialKernel::natural_of(Shape::Gaussian)));
        static CUBIC: LazyLock<SlabTable> =
            LazyLock::new(|| make(RadialKernel::natural_of(Shape::Cubic)));
        let natural = match kernel.shape {
            Shape::Gaussian => &GAUSSIAN,
            Shape::Cubic => &CUBIC,
        };
        Self { radius: kernel.radius() as f32, ..(*natural).clone() }
    }

    /// S at distance `l` ≥ 0 and `u` along the line, voxels, as a shader computes it.
    pub fn share(&self, l: f32, u: f32) -> f32 {
        let p = (l / self.radius).min(1.0);
        let half_chord = self.radius * (1.0 - p * p).sqrt();
        let t = u.abs() / half_chord;
        // Also where the chord is empty: the table would be asked for 0/0.
        if t.is_nan() || t >= 1.0 {
            return if u > 0.0 { 1.0 } else { 0.0 };
        }
        let (row, down) = split(p, SLAB_ROWS);
        let (column, along) = split(t, SLAB_COLUMNS);
        let at = row * SLAB_COLUMNS + column;
        let mix = |a: f32, b: f32, part: f32| a + (b - a) * part;
        let part = mix(
            mix(self.shares[at], self.shares[at + 1], along),
            mix(self.shares[at + SLAB_COLUMNS], self.shares[at + SLAB_COLUMNS + 1], along),
            down,
        );
        0.5 + part.copysign(u)
    }
}

/// The entry before 0 ≤ x ≤ 1 among `entries`, the last one apart, and how far it is to the next.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..entries")]
fn split(x: f32, entries: usize) -> (usize, f32) {
    let at = x * (entries - 1) as f32;
    let index = (at as usize).min(entries - 2);
    (index, at - index as f32)
}

fn make(kernel: RadialKernel) -> SlabTable {
    let radius = kernel.radius();
    let mut shares = Vec::with_capacity(SLAB_ROWS * SLAB_COLUMNS);
    for row in 0..SLAB_ROWS {
        let p = (row as f64 / (SLAB_ROWS - 1) as f64).min(1.0 - RIM);
        let (l, half) = (radius * p, radius * (1.0 - p * p).sqrt());
        let whole = kernel.footprint(l);
        shares.extend((0..SLAB_COLUMNS).map(|column| {
            if column == SLAB_COLUMNS - 1 {
                return 0.5;
            }
            let t = column as f64 / (SLAB_COLUMNS - 1) as f64;
            (kernel.cumulative(l, half * t) / whole - 0.5) as f32
        }));
    }
    let mut table = SlabTable { radius: radius as f32, shares, max_error: 0.0 };
    table.max_error = measured_error(&table, kernel);
    table
}

/// Greatest |F·S − G|/F(0), S in single precision.
fn measured_error(table: &SlabTable, kernel: RadialKernel) -> f64 {
    let mut greatest = 0.0_f64;
    for i in 0..=CHECKS {
        let l = kernel.radius() * f64::from(i) / f64::from(CHECKS);
        let whole = kernel.footprint(l);
        for j in 0..=CHECKS {
            let u = kernel.radius() * f64::from(j) / f64::from(CHECKS);
            let share = f64::from(table.share(l as f32, u as f32));
            greatest = greatest.max((whole * share - kernel.cumulative(l, u)).abs());
        }
    }
    greatest / kernel.footprint(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;

    fn tables() -> [(RadialKernel, SlabTable); 6] {
        [
            (Kernel::Cubic, None),
            (Kernel::Cubic, Some(1e-6)),
            (Kernel::Cubic, Some(1e6)),
            (Kernel::Gaussian, None),
            (Kernel::Gaussian, Some(0.7)),
            (Kernel::Gaussian, Some(30.0)),
        ]
        .map(|(kernel, extent)| {
            let kernel = RadialKernel::new(kernel, extent).unwrap();
            (kernel, SlabTable::of(kernel))
        })
    }

    /// Measured at every extent, as parts of F(0): cubic 6.4e-5, Gaussian 9.6e-5.
    #[test]
    fn slab_shares_stay_within_their_stated_error_at_every_extent() {
        for (kernel, table) in tables() {
            let worst = measured_error(&table, kernel);
            assert!(worst < 1e-4, "{kernel:?}: {worst}");
            assert!((worst - table.max_error).abs() < 1e-6, "{worst} {}", table.max_error);
            assert!(worst > 2e-5, "a table of {} is larger than it need be", table.shares.len());
        }
    }

    #[test]
    fn slabs_that_adjoin_add_up_to_the_footprint_and_nothing_is_beyond_the_chord() {
        for (kernel, table) in tables() {
            let radius = table.radius;
            for i in 0..=50 {
                let l = radius * i as f32 / 50.0;
                for end in [radius * 1.000_001, radius * 3.0, f32::INFINITY] {
                    assert_eq!(
                        (table.share(l, -end), table.share(l, end)),
                        (0.0, 1.0),
                        "{kernel:?}"
                    );
                }
                for j in -200..200 {
                    let at = |j: i32| table.share(l, radius * j as f32 / 190.0);
                    assert!(at(j + 1) >= at(j), "{kernel:?} {l} {j}");
                    assert!((at(j) + at(-j) - 1.0).abs() < 1e-6 || j == 0, "{kernel:?} {l} {j}");
                }
            }
            // At and beyond the rim there is a step and no chord.
            for l in [radius, radius * 2.0, f32::MAX] {
                let steps = [-1e-30, 0.0, 1e-30].map(|u| table.share(l, u));
                assert_eq!(steps, [0.0, 0.0, 1.0]);
            }
        }
    }
}

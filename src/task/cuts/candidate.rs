//! One cut: a level for each brick, what it leaves out, and what it costs.

use std::sync::Arc;

use super::arrived::{self, Wanted};
use crate::plan::{COARSER, EMPTY, FieldCut};

/// Errors of bricks that are tried, the least first.
pub(super) const ERRORS: [f32; 5] = [0.001, 0.002, 0.004, 0.008, 0.016];

/// Time that a brick of each level takes, as a share of one of the whole field: where that is B-splines, and where it is
/// tents. Looking up the level is in it. By engine: of the native one fitted to three scans (`benches/results/cuts.md`); of the GPU
/// engine fitted to shells and two scans on an H200 (`benches/results/gpu-NVIDIA-H200--vulkan-.md`), where a third scan, of thin
/// vessels, gains a tenth at most; its tents are a guess. What pictures take moves either (`FieldCuts::learn`).
const WORK: [[[f64; COARSER + 1]; 2]; 2] =
    [[[0.95, 0.4, 0.18], [1.05, 0.5, 0.27]], [[1.0, 0.7, 0.35], [1.05, 0.9, 0.6]]];

/// A cut that may be drawn.
#[derive(Debug)]
pub(super) struct Candidate {
    pub(super) max_error: f32,
    pub(super) cut: Arc<FieldCut>,
    /// Σ e² over its bricks: e the error of a brick a sample thick times the samples through it.
    pub(super) squares: f64,
    /// What a ray costs, of what one of all of the field does, by engine and [`crate::plan::SlabField`].
    pub(super) shares: [[f64; 2]; 2],
    /// Bricks that are coarser than they should be, those with the greatest errors first: theirs have not come.
    pub(super) waiting: Vec<Wanted>,
}

/// The coarsest cut of `bricks` along each axis whose bricks are off by no more than an error; those that are not `shown`
/// are empty. `errors` are those of means by brick (`hierarchy::BrickErrors`).
pub fn cut_within(
    max_error: f32,
    bricks: [usize; 3],
    shown: &[u32],
    errors: &[[f32; COARSER]],
) -> FieldCut {
    FieldCut::new(bricks, levels_within(max_error, shown, errors))
}

/// Its levels.
fn levels_within(max_error: f32, shown: &[u32], errors: &[[f32; COARSER]]) -> Vec<u8> {
    let mut levels = vec![EMPTY; errors.len()];
    for &brick in shown {
        let [second, fourth] = errors[brick as usize];
        levels[brick as usize] = match () {
            () if fourth <= max_error => 2,
            () if second <= max_error => 1,
            () => 0,
        };
    }
    levels
}

impl Candidate {
    pub(super) fn of(
        max_error: f32,
        bricks: [usize; 3],
        (shown, errors): (&[u32], &[[f32; COARSER]]),
        finest: Option<&[u8]>,
    ) -> Self {
        let mut levels = levels_within(max_error, shown, errors);
        let mut waiting = arrived::of_what_came(&mut levels, finest);
        // Of bricks of which nothing has come, and of those that no mean stands for, nobody knows more than that.
        let worst = match waiting.is_empty() {
            true => 0.0,
            false => {
                let all = shown.iter().flat_map(|&brick| errors[brick as usize]);
                all.filter(|error| error.is_finite()).fold(0.0, f32::max)
            }
        };
        let error_of = |brick: usize| {
            let of_means = |level: u8| errors[brick].get(usize::from(level) - 1);
            match levels[brick] {
                0 => 0.0,
                level => of_means(level).copied().filter(|e| e.is_finite()).unwrap_or(worst),
            }
        };
        let squares =
            shown.iter().map(|&brick| (4.0 * f64::from(error_of(brick as usize))).powi(2)).sum();
        waiting.sort_by(|a, b| error_of(b.brick as usize).total_cmp(&error_of(a.brick as usize)));
        let cut = FieldCut::new(bricks, levels);
        let counts = cut.counts().map(|n| n as f64);
        let total = counts.iter().sum::<f64>().max(1.0);
        let share = |work: [f64; COARSER + 1]| {
            counts.iter().zip(work).map(|(n, work)| n * work).sum::<f64>() / total
        };
        let shares = WORK.map(|work| work.map(share));
        Self { max_error, cut: Arc::new(cut), squares, shares, waiting }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidates(errors: &[[f32; COARSER]]) -> Vec<Candidate> {
        #[expect(clippy::cast_possible_truncation, reason = "a few")]
        let shown: Vec<u32> = (0..errors.len() as u32 - 1).collect();
        let of = |most| Candidate::of(most, [errors.len(), 1, 1], (&shown, errors), None);
        ERRORS.map(of).into()
    }

    #[test]
    fn bricks_are_drawn_from_the_coarsest_means_that_an_error_allows() {
        // The last brick does not show.
        let errors = [[0.5, 0.7], [0.003, 0.006], [0.0, 0.0005], [0.0, 0.0], [0.0, 0.0]];
        let found = candidates(&errors);
        let counts: Vec<[u64; 3]> = found.iter().map(|c| c.cut.counts()).collect();
        assert_eq!(counts, [[2, 0, 2], [2, 0, 2], [1, 1, 2], [1, 0, 3], [1, 0, 3]]);
        let squares: Vec<f64> = found.iter().map(|c| c.squares / 16.0).collect();
        let small = 0.0005_f64.powi(2);
        for (found, expected) in squares.iter().zip([0.0, 0.0, 9e-6, 36e-6, 36e-6]) {
            assert!((found - expected - small).abs() < 1e-9, "{found} {expected}");
        }
        // Coarser ones cost less.
        for pair in found.windows(2) {
            assert!(
                pair[1]
                    .shares
                    .as_flattened()
                    .iter()
                    .zip(pair[0].shares.as_flattened())
                    .all(|(b, a)| b <= a)
            );
        }
        assert!(found[4].shares[0][0] < 0.5 * WORK[0][0][0]);
        assert!(found[4].shares[1][0] > found[4].shares[0][0], "each engine has its own");
    }
}

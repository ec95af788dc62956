//! How values and the strengths of their gradients occur together.

use glam::DVec3;

use super::{Scalar, ScalarVolume};
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::with_samples;

/// Bins along the values and along the strengths.
pub const JOINT_BINS: [usize; 2] = [96, 64];
/// Samples whose strengths say how far the axis goes: all of a smaller field.
const MEASURED: usize = 1 << 16;
/// Of those, the share that the axis leaves out: rare faces would squeeze all others.
const LEFT_OUT: f64 = 0.001;
/// Samples that are counted at most, about: rows are left out evenly beyond.
const MOST_COUNTED: usize = 1 << 25;

/// Counts of samples by value and by the strength of the gradient there, central differences between
/// its neighbours (at borders the sample and its one neighbour). Samples without data, and beside such, are not
/// counted.
#[derive(Debug, Clone, PartialEq)]
pub struct JointHistogram {
    /// The least and the greatest value.
    pub values: [f64; 2],
    /// The strength at which the axis ends, which begins at 0; data units per world unit, > 0. Stronger
    /// ones are in the last bins.
    pub strongest: f64,
    /// [`JOINT_BINS`], values first.
    pub counts: Vec<u64>,
}

impl JointHistogram {
    /// Reads every sample once, or as many rows of a large volume as hold 33 million.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn of(volume: &ScalarVolume, ticket: &Ticket) -> Result<Self, Cancelled> {
        with_samples!(&*volume.samples, values => Self::of_values(volume, values, ticket))
    }

    fn of_values<T: Scalar>(
        volume: &ScalarVolume,
        samples: &[T],
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let dims = volume.lattice.dims;
        let world_from_gradient = volume.lattice.axes().inverse().transpose();
        let sample = |at: [usize; 3]| samples[(at[2] * dims[1] + at[1]) * dims[0] + at[0]].to_f64();
        let strength = |at: [usize; 3]| {
            let growth = |axis: usize| {
                let (mut before, mut past) = (at, at);
                before[axis] = at[axis].saturating_sub(1);
                past[axis] = (at[axis] + 1).min(dims[axis] - 1);
                // Halved, so that ±1e308 does not overflow.
                let steps = (past[axis] - before[axis]).max(1) as f64;
                (sample(past) / 2.0 - sample(before) / 2.0) / (steps / 2.0)
            };
            (world_from_gradient * DVec3::new(growth(0), growth(1), growth(2))).length()
        };
        let rows = dims[1] * dims[2];
        let strongest = strongest(volume, rows * dims[0], |i| {
            strength([i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])])
        });
        let (min, max) = (volume.statistics.min, volume.statistics.max);
        let [across, up] = JOINT_BINS;
        let half_width = max / 2.0 - min / 2.0;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=bins")]
        let bin = |share: f64, bins: usize| ((share * bins as f64) as usize).min(bins - 1);
        let step = (rows * dims[0]).div_ceil(MOST_COUNTED).max(1);
        let kept = rows.div_ceil(step);
        let count = |counts: &mut Vec<u64>, i: usize| {
            ticket.checkpoint(i as u64, kept as u64)?;
            let row = i * step;
            for x in 0..dims[0] {
                let at = [x, row % dims[1], row / dims[1]];
                let (value, strength) = (sample(at), strength(at));
                if !value.is_finite() || !strength.is_finite() {
                    continue;
                }
                let share =
                    if half_width > 0.0 { (value / 2.0 - min / 2.0) / half_width } else { 0.5 };
                counts[bin(strength / strongest, up) * across + bin(share, across)] += 1;
            }
            Ok::<(), Cancelled>(())
        };
        let none = || vec![0; across * up];
        let counts = parallel::try_summed(0..kept, none, count, parallel::add_up)?;
        Ok(Self { values: [min, max], strongest, counts })
    }
}

/// Where the axis ends: a little beyond all but the strongest gradients.
fn strongest(
    volume: &ScalarVolume,
    count: usize,
    strength: impl Fn(usize) -> f64 + Send + Sync,
) -> f64 {
    // Spread by a step that shares no factor with the axes, as far as that can be.
    let step = (count / MEASURED).max(1) | 1;
    let mut found = parallel::list(count.div_ceil(step), |i| strength(i * step));
    found.retain(|strength| strength.is_finite());
    found.sort_unstable_by(f64::total_cmp);
    let at = ((1.0 - LEFT_OUT) * found.len() as f64) as usize;
    let strongest = 1.1 * found.get(at).or(found.last()).copied().unwrap_or(0.0);
    if strongest > 0.0 && strongest.is_finite() {
        return strongest;
    }
    // No gradient anywhere, or next to none: what would be strong.
    let range = 2.0 * (volume.statistics.max / 2.0 - volume.statistics.min / 2.0);
    let strong = range / volume.lattice.smallest_spacing();
    if strong > 0.0 && strong.is_finite() { strong } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};

    fn of(lattice: Lattice, value: impl Fn([f64; 3]) -> f64) -> JointHistogram {
        let [nx, ny, _] = lattice.dims;
        let place = |i: usize| [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64);
        let samples = Samples::Float64((0..lattice.len()).map(|i| value(place(i))).collect());
        let volume = ScalarVolume::from_samples("joint", lattice, samples).unwrap();
        JointHistogram::of(&volume, &Ticket::new()).unwrap()
    }

    #[test]
    fn a_ramp_has_one_strength_by_its_spacing() {
        let lattice = Lattice { spacing: DVec3::new(2.0, 1.0, 0.5), ..Lattice::unit([9, 8, 7]) };
        // 3 a sample along x and 2 along z: 1.5 and 4 a world unit.
        let found = of(lattice, |[x, _, z]| 3.0 * x + 2.0 * z);
        let strength = 1.5_f64.hypot(4.0);
        assert!((found.strongest - 1.1 * strength).abs() < 1e-9, "{}", found.strongest);
        assert_eq!(found.values, [0.0, 36.0]);
        let row = (JOINT_BINS[1] as f64 / 1.1) as usize;
        let there: u64 = found.counts[row * JOINT_BINS[0]..][..JOINT_BINS[0]].iter().sum();
        assert_eq!((there, found.counts.iter().sum()), (504, 504));
        assert_eq!(found.counts[row * JOINT_BINS[0]], 8, "the least value, along y");
    }

    #[test]
    fn what_has_no_gradient_or_no_data_is_not_lost_and_not_counted() {
        let flat = of(Lattice::unit([5, 4, 3]), |_| 7.0);
        assert!(flat.strongest > 0.0);
        assert_eq!(flat.counts[JOINT_BINS[0] / 2], 60);
        let holed = of(Lattice::unit([6, 1, 1]), |[x, ..]| if x == 3.0 { f64::NAN } else { x });
        // 0, 1 and 5 of six: 5 has a neighbour on one side alone, 2 and 4 stand beside none.
        assert_eq!(holed.counts.iter().sum::<u64>(), 3);
    }

    #[test]
    fn a_cancelled_count_stops() {
        let volume = ScalarVolume::from_samples(
            "joint",
            Lattice::unit([4; 3]),
            Samples::UInt8((0..64).collect()),
        );
        let ticket = Ticket::new();
        ticket.cancel();
        assert_eq!(JointHistogram::of(&volume.unwrap(), &ticket), Err(Cancelled));
    }
}

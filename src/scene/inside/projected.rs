//! Which values a projection is coloured between: those that rays through the volume come to, not those of all samples.

use super::AlongRay;
use crate::core::parallel;
use crate::volume::ScalarVolume;

/// Samples that are looked at along each axis, at most.
const MOST_LOOKED_AT: usize = 1 << 21;
/// The parts of the rays that lie below the range, and up to its upper end.
const ENDS: [f64; 2] = [0.005, 0.998];

/// The values that a projection's first and last colour belong to, from what rays along a volume's own axes come to;
/// `None` where they all come to the same, or nothing is projected.
///
/// Nearly every ray through a head meets bone: the range of its values, of which few are bone, would show it as one
/// white area.
pub fn projected_range(volume: &ScalarVolume, along: AlongRay) -> Option<[f64; 2]> {
    if along == AlongRay::Composite {
        return None;
    }
    let dims = volume.lattice.dims;
    let strides = [1, dims[0], dims[0] * dims[1]];
    let mut found: Vec<f64> = (0..3)
        .flat_map(|axis| {
            let [across, down] = [(axis + 1) % 3, (axis + 2) % 3];
            let step = (volume.lattice.len() as f64 / MOST_LOOKED_AT as f64).sqrt().ceil();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a step")]
            let step = (step as usize).max(1);
            let rows: Vec<usize> = (0..dims[down]).step_by(step).collect();
            let row = |y: usize| {
                let columns = (0..dims[across]).step_by(step);
                let ray = move |x: usize| {
                    let first = x * strides[across] + y * strides[down];
                    let samples = (0..dims[axis]).map(move |z| first + z * strides[axis]);
                    projected(samples.map(|i| volume.samples.get(i)), along)
                };
                columns.filter_map(ray).collect::<Vec<_>>()
            };
            parallel::list(rows.len(), |i| row(rows[i])).concat()
        })
        .collect();
    found.sort_unstable_by(f64::total_cmp);
    let last = found.len().checked_sub(1)?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in it")]
    let range = ENDS.map(|part| found[(part * last as f64).round() as usize]);
    (range[0] < range[1]).then_some(range)
}

/// What stands for the values of a ray; `None` where none is finite.
fn projected(values: impl Iterator<Item = f64>, along: AlongRay) -> Option<f64> {
    let finite = values.filter(|value| value.is_finite());
    match along {
        AlongRay::Composite => None,
        AlongRay::Maximum => finite.reduce(f64::max),
        AlongRay::Minimum => finite.reduce(f64::min),
        AlongRay::Average => {
            let (sum, count) = finite.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
            (count > 0.0).then(|| sum / count)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};

    #[test]
    fn the_range_is_that_of_what_rays_come_to() {
        // In air a block of tissue with one plane of bone, which every ray across it meets.
        let value = |i: usize| {
            let [x, y, z] = [i % 40, i / 40 % 40, i / 1600];
            let is_in = |n: usize| (10..30).contains(&n);
            match is_in(x) && is_in(y) && is_in(z) {
                true if x == 20 || y == 20 || z == 20 => 1000 + 10 * (x + y + z) as i16,
                true => 40,
                false => -1000,
            }
        };
        let samples = Samples::Int16((0..64_000).map(value).collect());
        let volume = ScalarVolume::from_samples("head", Lattice::unit([40; 3]), samples).unwrap();
        let [low, high] = projected_range(&volume, AlongRay::Maximum).expect("they differ");
        assert_eq!(low, -1000.0, "beside it there is air");
        assert!((1700.0..=1780.0).contains(&high), "the greatest that rays meet: {high}");
        let [low, high] = projected_range(&volume, AlongRay::Average).expect("they differ");
        assert!(low == -1000.0 && (-500.0..400.0).contains(&high), "{low} {high}");
        assert_eq!(projected_range(&volume, AlongRay::Minimum), None, "air in front of everything");
        assert_eq!(projected_range(&volume, AlongRay::Composite), None);
    }

    #[test]
    fn half_a_per_cent_of_the_rays_lie_below_the_range_and_a_fifth_above() {
        let samples = Samples::Int16((0..1000).collect());
        let row = Lattice::unit([1, 1000, 1]);
        let volume = ScalarVolume::from_samples("even", row, samples).unwrap();
        let [low, high] = projected_range(&volume, AlongRay::Maximum).expect("they differ");
        assert!((4.0..=6.0).contains(&low) && (996.0..=998.0).contains(&high), "{low} {high}");
    }

    #[test]
    fn values_that_are_none_are_passed_over() {
        let values = [f64::NAN, 2.0, 4.0, f64::INFINITY];
        let of = |along| projected(values.into_iter(), along);
        assert_eq!(of(AlongRay::Maximum), Some(4.0));
        assert_eq!((of(AlongRay::Minimum), of(AlongRay::Average)), (Some(2.0), Some(3.0)));
        assert_eq!(projected([f64::NAN].into_iter(), AlongRay::Maximum), None);
    }
}

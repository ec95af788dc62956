//! Points that lie far from all others: what frames them shows nothing of the rest.

use glam::DVec3;

/// Of a hundred points so many may lie far from the others at either end of an axis.
const FAR_OF_HUNDRED: f64 = 0.5;
const LEAST_TO_STRAY: usize = 20;
/// What is framed is so many times longer than the box of those that lie near one another.
pub const TIMES_FRAMED: f64 = 3.0;
/// The box of all is so many times longer where some lie far from the others.
const FAR: f64 = 10.0;

/// A box of points of which a few lie far from all others, and how many these are: about the box that holds the rest, on each
/// side as much again. `None` where none does.
pub fn without_strays(places: &[DVec3]) -> Option<([DVec3; 2], usize)> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "fewer than there are"
    )]
    let few = (places.len() as f64 * FAR_OF_HUNDRED / 100.0).ceil() as usize;
    let last = places.len().checked_sub(1)?;
    // Of a handful none is a stray one.
    if LEAST_TO_STRAY > places.len() {
        return None;
    }
    let ends = [0, 1, 2].map(|axis| {
        let mut along: Vec<f64> = places.iter().map(|at| at[axis]).collect();
        let mut at = |place: usize| *along.select_nth_unstable_by(place, f64::total_cmp).1;
        [0, few, last - few, last].map(&mut at)
    });
    let [least, low, high, most] = [0, 1, 2, 3].map(|end| DVec3::from(ends.map(|of| of[end])));
    let rest = high - low;
    let beside = rest * ((TIMES_FRAMED - 1.0) / 2.0);
    let frame = [low - beside, high + beside];
    let extent = |low: DVec3, high: DVec3| (high - low).max_element();
    let is_far = rest.max_element() > 0.0 && extent(least, most) > FAR * extent(frame[0], frame[1]);
    let beyond = || places.iter().filter(|at| at.clamp(frame[0], frame[1]) != **at).count();
    is_far.then(|| (frame, beyond()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Vec<DVec3> {
        (0..1000).map(|i| DVec3::from([i % 10, i / 10 % 10, i / 100].map(f64::from))).collect()
    }

    #[test]
    fn what_lies_far_from_the_rest_is_counted_and_not_framed() {
        assert_eq!(without_strays(&cube()), None);
        let far = [DVec3::X * 1e5, DVec3::Y * -1e5, DVec3::new(1e4, 1e4, 0.0)];
        let with = |far: &[DVec3]| [cube(), far.to_vec()].concat();
        let (frame, beyond) = without_strays(&with(&far)).expect("three lie far away");
        assert_eq!((frame, beyond), ([DVec3::splat(-9.0), DVec3::splat(18.0)], 3));
        // Three of twelve are no stray ones, and what is within ten frames is seen all the same.
        assert_eq!(without_strays(&with(&[DVec3::X * 200.0])), None);
        assert!(without_strays(&with(&[DVec3::X * 400.0])).is_some());
        assert_eq!(without_strays(&[&cube()[..9], &far].concat()), None);
        assert_eq!(without_strays(&[]), None);
        assert_eq!(without_strays(&far[..1]), None);
        assert_eq!(without_strays(&[&cube()[..18], &far[..1]].concat()), None, "a handful");
        assert!(without_strays(&[&cube()[..30], &far[..1]].concat()).is_some());
        // Most at one place leave nothing to frame.
        assert_eq!(without_strays(&[&[DVec3::ONE; 50], &far[..1]].concat()), None);
    }
}

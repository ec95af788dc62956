//! How many pictures a second a moving view gets.

use std::collections::VecDeque;

/// Seconds that pictures are counted over: less would jump, more would lag behind the hand.
const OVER_SECS: f64 = 1.0;
/// Fewer pictures than this make no rate.
const LEAST: usize = 3;

/// When pictures of a moving view came, seconds on the interface's clock.
#[derive(Debug, Default)]
pub(super) struct PictureRate {
    came_secs: VecDeque<f64>,
}

impl PictureRate {
    /// A picture has come; one of a view at rest ends the count.
    pub(super) fn note(&mut self, now_secs: f64, is_moving: bool) {
        if is_moving {
            self.came_secs.push_back(now_secs);
            self.came_secs.retain(|came| now_secs - came <= OVER_SECS);
        } else {
            self.came_secs.clear();
        }
    }

    /// Pictures a second over the last second; `None` where too few came in it.
    pub(super) fn per_second(&self, now_secs: f64) -> Option<f64> {
        let mut recent = self.came_secs.iter().filter(|came| now_secs - **came <= OVER_SECS);
        let (first, last) = (recent.next()?, recent.next_back()?);
        let steps = recent.count() + 1;
        let took_secs = last - first;
        (steps + 1 >= LEAST && took_secs > 0.0).then(|| steps as f64 / took_secs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_of_the_last_second_and_of_a_moving_view_alone() {
        let mut rate = PictureRate::default();
        for i in 0..120 {
            rate.note(f64::from(i) / 30.0, true);
        }
        let now = 119.0 / 30.0;
        assert!((rate.per_second(now).unwrap() - 30.0).abs() < 1e-9);
        assert_eq!(rate.per_second(now + 1.5), None, "the hand stands still");
        for i in 0..20 {
            rate.note(now + 2.0 + f64::from(i) / 10.0, true);
        }
        assert!((rate.per_second(now + 3.9).unwrap() - 10.0).abs() < 1e-9);
        rate.note(now + 4.0, false);
        assert_eq!(rate.per_second(now + 4.0), None, "a view at rest has none");
        rate.note(now + 5.0, true);
        rate.note(now + 5.1, true);
        assert_eq!(rate.per_second(now + 5.1), None, "two are no rate");
    }
}

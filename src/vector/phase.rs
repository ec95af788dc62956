//! Time as a phase: a clock whose speed may change at any moment without a jump.

/// Cycles a second, either way, at most.
pub const MOST_SPEED: f64 = 4.0;

/// The phase of an animation, in cycles 0..1, and 1 where it was set to that.
///
/// What was passed before the speed last changed is kept as a phase, and only the time since is
/// multiplied: in double precision, so that a week of running leaves it 1e-10 of a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseClock {
    /// At `since`.
    phase: f64,
    /// Cycles a second; negative backwards.
    speed: f64,
    /// Seconds on the caller's clock.
    since: f64,
    is_running: bool,
}

impl PhaseClock {
    /// A clock that stands at a phase.
    pub fn new(phase: f64, speed: f64) -> Self {
        Self { phase: wrapped(phase), speed: usable(speed), since: 0.0, is_running: false }
    }

    /// The phase at a time in seconds on the caller's clock.
    pub fn phase(&self, now: f64) -> f64 {
        if !self.is_running {
            return self.phase;
        }
        let passed = now - self.since;
        // Whole cycles of the time first, so that the product stays small.
        let turns = if self.speed == 0.0 { 0.0 } else { passed % (1.0 / self.speed) * self.speed };
        wrapped(self.phase + turns)
    }

    /// Whether time passes.
    pub fn is_running(&self) -> bool {
        self.is_running
    }

    /// Whether the phase changes by itself.
    pub fn is_moving(&self) -> bool {
        self.is_running && self.speed != 0.0
    }

    /// Cycles a second.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Goes on, or stops where it is.
    pub fn set_running(&mut self, running: bool, now: f64) {
        *self = Self { phase: self.phase(now), since: now, is_running: running, ..*self };
    }

    /// Another speed from now on, from the same phase.
    pub fn set_speed(&mut self, speed: f64, now: f64) {
        *self = Self { phase: self.phase(now), since: now, speed: usable(speed), ..*self };
    }

    /// Another phase, now. The end of a cycle stays as it is, though it is its beginning, too: who drags a
    /// slider there is to find it there.
    pub fn set_phase(&mut self, phase: f64, now: f64) {
        let phase = if phase == 1.0 { phase } else { wrapped(phase) };
        *self = Self { phase, since: now, ..*self };
    }
}

/// The part of a cycle, 0..1; 0 for what is no number.
fn wrapped(phase: f64) -> f64 {
    let part = phase.rem_euclid(1.0);
    // A phase just below 0 rounds up to 1.
    if part.is_finite() && part < 1.0 { part } else { 0.0 }
}

/// A speed within ± [`MOST_SPEED`]; sliders and files give no others.
fn usable(speed: f64) -> f64 {
    if speed.is_finite() { speed.clamp(-MOST_SPEED, MOST_SPEED) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_week_later_the_phase_is_as_precise() {
        let mut clock = PhaseClock::new(0.0, 0.3);
        clock.set_running(true, 1e5);
        let week = 7.0 * 24.0 * 3600.0;
        // 0.3 · 604 800 = 181 440 whole cycles; a quarter of a cycle later.
        let found = clock.phase(1e5 + week + 0.25 / 0.3);
        assert!((found - 0.25).abs() < 1e-9, "{found}");
    }

    #[test]
    fn stopping_scrubbing_and_reversing() {
        let mut clock = PhaseClock::new(0.9, 0.5);
        assert_eq!(clock.phase(50.0), 0.9);
        clock.set_running(true, 50.0);
        assert!((clock.phase(50.4) - 0.1).abs() < 1e-12);
        clock.set_running(false, 50.4);
        assert!((clock.phase(90.0) - 0.1).abs() < 1e-12);
        clock.set_speed(-0.5, 90.0);
        clock.set_running(true, 90.0);
        assert!((clock.phase(90.4) - 0.9).abs() < 1e-12);
        clock.set_phase(0.5, 91.0);
        assert!((clock.phase(91.2) - 0.4).abs() < 1e-12);
        clock.set_speed(0.0, 91.2);
        assert!(!clock.is_moving() && (clock.phase(1e9) - 0.4).abs() < 1e-12);
        let mut at_the_end = PhaseClock::new(0.0, 0.5);
        at_the_end.set_phase(1.0, 3.0);
        assert_eq!(at_the_end.phase(9.0), 1.0, "where the slider is");
        at_the_end.set_running(true, 9.0);
        assert!((at_the_end.phase(9.4) - 0.2).abs() < 1e-12);
        assert_eq!(PhaseClock::new(f64::NAN, f64::INFINITY), PhaseClock::new(0.0, 0.0));
        assert_eq!(PhaseClock::new(-1e-20, 0.0).phase(0.0), 0.0);
    }

    proptest! {
        #[test]
        fn a_change_of_speed_is_no_jump(
            phase in 0.0..1.0_f64, a in -4.0..4.0_f64, b in -4.0..4.0_f64, now in 0.0..1e6_f64,
        ) {
            let mut clock = PhaseClock::new(phase, a);
            clock.set_running(true, 0.0);
            let before = clock.phase(now);
            clock.set_speed(b, now);
            let after = clock.phase(now);
            let jump = (before - after).abs();
            prop_assert!(jump.min(1.0 - jump) < 1e-9);
            prop_assert!((0.0..1.0).contains(&after));
        }
    }
}

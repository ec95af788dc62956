//! Undo and redo: states one after another, each whole.
//!
//! The rule: a step is what changed between two moments at which nothing was held, so that a drag,
//! or a number being typed, is one step however long it takes; notches of the wheel that follow one another are one. The last [`LIMIT`] steps are kept, and
//! fewer where they hold too much memory; the oldest makes room. A new step forgets what had been undone.

use std::collections::VecDeque;

/// How many steps are kept.
pub const LIMIT: usize = 200;
/// Seconds within which one notch of the wheel goes on with the step of the one before.
const WHEEL_SECS: f64 = 0.6;

/// What was, is, and was undone.
#[derive(Debug)]
pub struct History<T> {
    /// Oldest first, at most [`LIMIT`].
    past: VecDeque<T>,
    present: Option<T>,
    /// What was undone, the next to be done again last.
    future: Vec<T>,
    /// When the last step was recorded, if it was one of the wheel.
    last_notch_secs: Option<f64>,
}

impl<T> Default for History<T> {
    fn default() -> Self {
        Self { past: VecDeque::new(), present: None, future: Vec::new(), last_notch_secs: None }
    }
}

impl<T: Clone + PartialEq> History<T> {
    /// Takes note of a state; the first is where steps begin. One that differs from the present is a step; where the wheel turned at
    /// `notch_secs`, soon after its last notch, it takes that one's place. Whether there was one.
    pub fn record(&mut self, state: &T, notch_secs: Option<f64>) -> bool {
        let Some(present) = &mut self.present else {
            self.present = Some(state.clone());
            return false;
        };
        if present == state {
            return false;
        }
        let before = std::mem::replace(present, state.clone());
        self.future.clear();
        let last_secs = std::mem::replace(&mut self.last_notch_secs, notch_secs);
        let continues =
            notch_secs.zip(last_secs).is_some_and(|(now, last)| now - last < WHEEL_SECS);
        if !continues || self.past.is_empty() {
            self.past.push_back(before);
        } else if self.past.back() == Some(state) {
            // Back where the step began.
            self.past.pop_back();
        }
        if self.past.len() > LIMIT {
            self.past.pop_front();
        }
        true
    }

    /// The present state, to be changed without a step.
    pub fn present_mut(&mut self) -> Option<&mut T> {
        self.present.as_mut()
    }

    /// Forgets the oldest steps for as long as those that are left are too much; whether any was.
    pub fn forget_while(&mut self, is_too_much: impl Fn(&VecDeque<T>) -> bool) -> bool {
        let before = self.past.len();
        while !self.past.is_empty() && is_too_much(&self.past) {
            self.past.pop_front();
        }
        self.past.len() < before
    }

    /// Goes one step back; the state to be shown, if there is one.
    pub fn undo(&mut self) -> Option<T> {
        self.last_notch_secs = None;
        let before = self.past.pop_back()?;
        self.future.extend(self.present.replace(before.clone()));
        Some(before)
    }

    /// Goes forward to what was undone last; the state to be shown, if there is one.
    pub fn redo(&mut self) -> Option<T> {
        self.last_notch_secs = None;
        let after = self.future.pop()?;
        self.past.extend(self.present.replace(after.clone()));
        Some(after)
    }

    /// The states before and after the step that [`History::undo`] would take back.
    pub fn last_step(&self) -> Option<[&T; 2]> {
        Some([self.past.back()?, self.present.as_ref()?])
    }

    /// The states before and after the step that [`History::redo`] would do again.
    pub fn next_step(&self) -> Option<[&T; 2]> {
        Some([self.present.as_ref()?, self.future.last()?])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_oldest_steps_make_room_and_no_others() {
        let mut history = History::default();
        for state in 0..=LIMIT + 7 {
            history.record(&state, None);
        }
        let mut undone = Vec::new();
        while let Some(state) = history.undo() {
            undone.push(state);
        }
        assert_eq!(undone, (7..LIMIT + 7).rev().collect::<Vec<_>>());
    }

    #[test]
    fn a_step_that_goes_on_is_one_and_vanishes_where_it_comes_back() {
        let mut history = History::default();
        history.record(&0, None);
        history.record(&1, None);
        for (state, secs) in [(5, 3.0), (6, 3.5), (7, 4.0)] {
            history.record(&state, Some(secs));
        }
        assert_eq!(history.undo(), Some(1));
        assert_eq!(history.redo(), Some(7));
        history.record(&8, Some(4.2));
        assert_eq!(history.last_step(), Some([&7, &8]), "not after a step back");
        history.record(&7, Some(4.4));
        assert_eq!(history.undo(), Some(1));
    }

    #[test]
    fn what_is_too_much_is_forgotten_from_the_oldest_on() {
        let mut history = History::default();
        for state in [1, 2, 3, 4] {
            history.record(&state, None);
        }
        history.record(&4, None);
        assert_eq!(history.last_step(), Some([&3, &4]), "the same again is no step");
        let sum_is_over_4 = |past: &VecDeque<i32>| past.iter().sum::<i32>() > 4;
        assert!(history.forget_while(sum_is_over_4) && !history.forget_while(sum_is_over_4));
        assert_eq!((history.undo(), history.undo()), (Some(3), None));
        assert_eq!(history.redo(), Some(4), "what comes after stays");
    }

    /// What a hand may do.
    #[derive(Debug, Clone)]
    enum Deed {
        Edit(u8),
        Undo,
        Redo,
    }

    fn deed() -> impl Strategy<Value = Deed> {
        prop_oneof![
            (0_u8..5).prop_map(Deed::Edit),
            Just(Deed::Undo),
            Just(Deed::Undo),
            Just(Deed::Redo),
        ]
    }

    proptest! {
        #[test]
        fn undo_never_loses_a_step(deeds in proptest::collection::vec(deed(), 1..LIMIT)) {
            let mut history = History::default();
            history.record(&u8::MAX, None);
            // Every state from the first to the last that can be reached, and the present one.
            let (mut states, mut at) = (vec![u8::MAX], 0);
            for deed in deeds {
                match deed {
                    Deed::Edit(state) => {
                        let is_step = state != states[at];
                        prop_assert_eq!(history.record(&state, None), is_step);
                        if is_step {
                            states.truncate(at + 1);
                            states.push(state);
                            at += 1;
                        }
                    }
                    Deed::Undo => {
                        let before = at.checked_sub(1);
                        prop_assert_eq!(history.undo(), before.map(|at| states[at]));
                        at = before.unwrap_or(at);
                    }
                    Deed::Redo => {
                        prop_assert_eq!(history.redo(), states.get(at + 1).copied());
                        at = (at + 1).min(states.len() - 1);
                    }
                }
            }
            while history.redo().is_some() {}
            for (i, &state) in states.iter().enumerate().rev().skip(1) {
                prop_assert_eq!(history.last_step().map(|[_, after]| *after), Some(states[i + 1]));
                prop_assert_eq!(history.undo(), Some(state));
            }
            prop_assert_eq!(history.undo(), None);
            for &state in &states[1..] {
                prop_assert_eq!(history.redo(), Some(state));
            }
            prop_assert_eq!(history.redo(), None);
        }
    }
}

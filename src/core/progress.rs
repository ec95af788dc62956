//! Progress and cancellation of long work, shared between the worker and whoever waits for it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// The work was told to stop; what it had made so far is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// One job's line to the outside: the job reports how far it is, the outside may cancel it.
///
/// Clones share the same state. A job calls [`Ticket::checkpoint`] often enough that a cancel is
/// answered within a few milliseconds.
#[derive(Debug, Clone)]
pub struct Ticket {
    shared: Arc<Shared>,
    /// What this clone's work is of the whole: where it begins, and its share.
    part: [f64; 2],
}

impl Default for Ticket {
    fn default() -> Self {
        Self { shared: Arc::default(), part: [0.0, 1.0] }
    }
}

#[derive(Debug, Default)]
struct Shared {
    cancelled: AtomicBool,
    /// Fraction done, as the bits of an `f32` in 0..=1.
    fraction_bits: AtomicU32,
}

impl Ticket {
    /// A fresh ticket: nothing done, not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// A ticket for one of several equal parts of the job, which reports how far that is.
    #[must_use]
    pub fn part(&self, index: u32, of: u32) -> Self {
        let [begin, share] = self.part;
        let each = share / f64::from(of.max(1));
        Self { part: [begin + each * f64::from(index), each], ..self.clone() }
    }

    /// Asks the job to stop at its next checkpoint.
    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether [`Ticket::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        self.shared.cancelled.load(Ordering::Relaxed)
    }

    /// Fraction done, 0..=1.
    pub fn fraction(&self) -> f32 {
        f32::from_bits(self.shared.fraction_bits.load(Ordering::Relaxed))
    }

    /// Reports `done` of `total` and learns whether to go on.
    ///
    /// # Errors
    /// [`Cancelled`] once the ticket was cancelled.
    pub fn checkpoint(&self, done: u64, total: u64) -> Result<(), Cancelled> {
        let [begin, share] = self.part;
        let done = if total == 0 { 1.0 } else { (done as f64 / total as f64).min(1.0) };
        let fraction = begin + share * done;
        self.shared.fraction_bits.store((fraction as f32).to_bits(), Ordering::Relaxed);
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cancel_is_seen_by_every_clone_and_stops_the_next_checkpoint() {
        let ticket = Ticket::new();
        let worker = ticket.clone();
        assert_eq!(worker.checkpoint(1, 4), Ok(()));
        assert_eq!(ticket.fraction(), 0.25);
        ticket.cancel();
        assert_eq!(worker.checkpoint(2, 4), Err(Cancelled));
    }

    #[test]
    fn an_empty_job_is_done_at_once() {
        let ticket = Ticket::new();
        assert_eq!(ticket.checkpoint(0, 0), Ok(()));
        assert_eq!(ticket.fraction(), 1.0);
    }

    #[test]
    fn parts_add_up_to_the_whole_and_share_the_cancel() {
        let ticket = Ticket::new();
        let last = ticket.part(3, 4);
        assert_eq!(last.checkpoint(1, 2), Ok(()));
        assert_eq!(ticket.fraction(), 0.875);
        ticket.cancel();
        assert_eq!(last.part(0, 2).checkpoint(0, 1), Err(Cancelled));
        assert_eq!(ticket.fraction(), 0.75);
    }
}

//! Progress, pause and cancellation of long work, shared between the worker and whoever waits for it.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// The work was told to stop; what it had made so far is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// One job's line to the outside: the job reports how far it is, the outside may cancel it, or pause it where it rests.
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
    paused: Mutex<bool>,
    /// Told when it goes on, or is cancelled.
    wakes: Condvar,
    /// How often it was asked, and at which time it is cancelled for it; 0: never.
    #[cfg(test)]
    asked: std::sync::atomic::AtomicU64,
    #[cfg(test)]
    trips_at: u64,
}

impl Shared {
    fn paused(&self) -> MutexGuard<'_, bool> {
        self.paused.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts that somebody asks.
    #[cfg(test)]
    fn count(&self) {
        if self.asked.fetch_add(1, Ordering::Relaxed) + 1 == self.trips_at {
            self.cancelled.store(true, Ordering::Relaxed);
        }
    }
}

impl Ticket {
    /// A fresh ticket: nothing done, not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// One that is cancelled as it is asked for the `ask`th time, whoever asks: tests of what stops need no clock.
    #[cfg(test)]
    pub(crate) fn tripping_at(ask: u64) -> Self {
        let shared = Shared { trips_at: ask, ..Shared::default() };
        Self { shared: Arc::new(shared), ..Self::default() }
    }

    /// How often it was asked.
    #[cfg(test)]
    pub(crate) fn asked(&self) -> u64 {
        self.shared.asked.load(Ordering::Relaxed)
    }

    /// A ticket for one of several equal parts of the job, which reports how far that is.
    #[must_use]
    pub fn part(&self, index: u32, of: u32) -> Self {
        let [begin, share] = self.part;
        let each = share / f64::from(of.max(1));
        Self { part: [begin + each * f64::from(index), each], ..self.clone() }
    }

    /// Asks the job to stop at its next checkpoint. One that is paused wakes for it.
    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
        // Whoever is about to wait has seen it, or waits by the time that the lock is had.
        let paused = self.shared.paused();
        self.shared.wakes.notify_all();
        drop(paused);
    }

    /// Asks the job to wait where it next rests, or to go on. Jobs that never rest do not mind.
    pub fn pause(&self, paused: bool) {
        *self.shared.paused() = paused;
        self.shared.wakes.notify_all();
    }

    /// Whether it was asked to wait.
    pub fn is_paused(&self) -> bool {
        *self.shared.paused()
    }

    /// Waits while the job is paused, without taking the processor's time. To be called on the job's own thread, which nobody
    /// else's work waits for.
    ///
    /// # Errors
    /// [`Cancelled`] once the ticket was cancelled, paused or not.
    pub fn rest(&self) -> Result<(), Cancelled> {
        let mut paused = self.shared.paused();
        while *paused && !self.is_cancelled() {
            paused = self.shared.wakes.wait(paused).unwrap_or_else(PoisonError::into_inner);
        }
        drop(paused);
        self.look()
    }

    /// Whether [`Ticket::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        #[cfg(test)]
        self.shared.count();
        self.shared.cancelled.load(Ordering::Relaxed)
    }

    /// Learns whether to go on, where there is nothing to report.
    ///
    /// # Errors
    /// [`Cancelled`] once the ticket was cancelled.
    pub fn look(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
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
        self.look()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::time::Duration;

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

    #[test]
    fn a_ticket_that_trips_counts_whoever_asks() {
        let ticket = Ticket::tripping_at(3);
        let part = ticket.part(0, 2);
        assert_eq!([ticket.look(), part.checkpoint(0, 1)], [Ok(()); 2]);
        assert_eq!([part.look(), ticket.look()], [Err(Cancelled); 2]);
        assert_eq!(ticket.asked(), 4);
    }

    #[test]
    fn a_paused_job_rests_until_it_goes_on_or_is_cancelled() {
        for is_cancelled in [false, true] {
            let ticket = Ticket::new();
            assert_eq!(ticket.rest(), Ok(()), "nobody asked for a pause");
            ticket.pause(true);
            let (sender, ended) = mpsc::channel();
            let worker = ticket.part(0, 2);
            let thread = std::thread::spawn(move || sender.send(worker.rest()));
            assert!(ended.recv_timeout(Duration::from_millis(50)).is_err() && ticket.is_paused());
            if is_cancelled {
                ticket.cancel();
            } else {
                ticket.pause(false);
            }
            let expected = if is_cancelled { Err(Cancelled) } else { Ok(()) };
            assert_eq!(ended.recv_timeout(Duration::from_secs(30)), Ok(expected));
            thread.join().expect("it ends").expect("somebody waits");
        }
    }
}

//! Work on a named thread, watched from the window: progress, cancel, result.

use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, TryRecvError, bounded};
use eframe::egui::Context;

use crate::core::Ticket;

/// Work that has taken less than this, or got less far, tells nothing of how long the rest will take: milliseconds, and a
/// part of it.
const LEAST_MS: f64 = 1000.0;
const LEAST_FRACTION: f64 = 0.02;

/// Work under way. Dropping it cancels the work and forgets its result.
#[derive(Debug)]
pub struct Job<T> {
    title: String,
    started: Instant,
    /// Since when it is paused.
    paused: Option<Instant>,
    /// How long it was paused before.
    rested: Duration,
    ticket: Ticket,
    result: Receiver<T>,
}

/// How a job ended.
#[derive(Debug)]
pub enum Ended<T> {
    /// With a result.
    Finished(T),
    /// Without one: its thread could not be started or panicked, which is our own bug.
    Lost,
}

impl<T: Send + 'static> Job<T> {
    /// Starts `work` on a thread called `thread`; `title` says to people what is being done.
    ///
    /// The context is repainted once the work is done. A thread that cannot be started shows as
    /// [`Ended::Lost`].
    pub fn start(
        thread: &str,
        title: impl Into<String>,
        ctx: &Context,
        work: impl FnOnce(&Ticket) -> T + Send + 'static,
    ) -> Self {
        let (sender, result) = bounded(1);
        let ticket = Ticket::new();
        let (ctx, given) = (ctx.clone(), ticket.clone());
        let run = move || {
            let done = work(&given);
            // The window may have dropped the job; then nobody wants the result.
            sender.send(done).ok();
            drop(sender);
            ctx.request_repaint();
        };
        if let Err(error) = std::thread::Builder::new().name(thread.to_owned()).spawn(run) {
            log::error!("the thread {thread} could not be started: {error}");
        }
        let (paused, rested) = (None, Duration::ZERO);
        Self { title: title.into(), started: Instant::now(), paused, rested, ticket, result }
    }

    /// What is being done, for people.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Fraction done, 0..=1.
    pub fn fraction(&self) -> f32 {
        self.ticket.fraction()
    }

    /// Milliseconds that are thought to be left, once enough is done to tell; `None` while it is paused.
    pub fn left_ms(&self) -> Option<f64> {
        let at_work = self.started.elapsed().saturating_sub(self.rested);
        let left = left_ms(at_work.as_secs_f64() * 1e3, f64::from(self.fraction()));
        left.filter(|_| !self.is_paused())
    }

    /// Asks the work to wait where it next rests ([`Ticket::rest`]), or to go on.
    pub fn pause(&mut self, paused: bool) {
        if paused == self.is_paused() {
            return;
        }
        match self.paused.take() {
            Some(since) => self.rested += since.elapsed(),
            None => self.paused = Some(Instant::now()),
        }
        self.ticket.pause(paused);
    }

    /// Whether it was asked to wait.
    pub fn is_paused(&self) -> bool {
        self.paused.is_some()
    }

    /// Asks the work to stop; its end still arrives.
    pub fn cancel(&self) {
        self.ticket.cancel();
    }

    /// Whether it was asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.ticket.is_cancelled()
    }

    /// The end, once it has come.
    pub fn poll(&self) -> Option<Ended<T>> {
        match self.result.try_recv() {
            Ok(result) => Some(Ended::Finished(result)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Ended::Lost),
        }
    }
}

/// Milliseconds that are left of work that has got so far in a time, if it goes on as it went.
fn left_ms(gone_ms: f64, fraction: f64) -> Option<f64> {
    let is_known = gone_ms >= LEAST_MS && fraction >= LEAST_FRACTION;
    is_known.then(|| gone_ms * (1.0 - fraction.min(1.0)) / fraction)
}

impl<T> Drop for Job<T> {
    fn drop(&mut self) {
        self.ticket.cancel();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait<T: Send + 'static>(job: &Job<T>) -> Ended<T> {
        let deadline = Instant::now() + Duration::from_secs(10);
        loop {
            if let Some(end) = job.poll() {
                return end;
            }
            assert!(Instant::now() < deadline, "the job never ended");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_result_arrives_and_asks_for_a_repaint() {
        let ctx = Context::default();
        let job = Job::start("test-job", "Testing", &ctx, |_| 7);
        assert!(matches!(wait(&job), Ended::Finished(7)));
    }

    #[test]
    fn the_time_that_is_left_is_told_once_enough_is_done_to_tell() {
        assert_eq!(left_ms(20_000.0, 0.25), Some(60_000.0));
        assert_eq!((left_ms(900.0, 0.5), left_ms(9000.0, 0.01)), (None, None));
        assert_eq!(left_ms(5000.0, 1.0), Some(0.0));
    }

    #[test]
    fn a_cancelled_job_learns_of_it() {
        let ctx = Context::default();
        let job = Job::start("test-job", "Testing", &ctx, |ticket| {
            while !ticket.is_cancelled() {
                std::thread::sleep(Duration::from_millis(1));
            }
            "stopped"
        });
        job.cancel();
        assert!(matches!(wait(&job), Ended::Finished("stopped")));
    }

    #[test]
    fn a_paused_job_waits_until_it_goes_on_or_is_cancelled() {
        let ctx = Context::default();
        for is_cancelled in [false, true] {
            let (go, begin) = bounded::<()>(1);
            let mut job = Job::start("test-job", "Testing", &ctx, move |ticket| {
                begin.recv().expect("somebody tells it");
                ticket.rest().is_ok()
            });
            job.pause(true);
            go.send(()).expect("it waits for it");
            std::thread::sleep(Duration::from_millis(50));
            assert!(job.poll().is_none() && job.is_paused() && job.left_ms().is_none());
            if is_cancelled {
                job.cancel();
            } else {
                job.pause(false);
            }
            assert!(matches!(wait(&job), Ended::Finished(went_on) if went_on != is_cancelled));
        }
    }

    #[test]
    fn a_job_whose_thread_dies_is_lost_not_awaited_for_ever() {
        let ctx = Context::default();
        let job = Job::<()>::start("test-job", "Testing", &ctx, |_| {
            std::panic::resume_unwind(Box::new("a bug"));
        });
        assert!(matches!(wait(&job), Ended::Lost));
    }
}

//! Work on a thread of its own, which whoever waits for it may leave.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use super::draw::{DrawError, Observer};
use super::engines::Engines;
use crate::core::Ticket;
use crate::gpu::GpuError;

/// How often a wait looks whether something newer came.
pub(super) const LOOK_EVERY: Duration = Duration::from_millis(4);

/// Work under way, of which something comes once; dropping it cancels it.
#[derive(Debug)]
pub(super) struct Job<T> {
    /// What it makes, for people.
    what: &'static str,
    ticket: Ticket,
    result: Receiver<T>,
}

impl<T> Drop for Job<T> {
    fn drop(&mut self) {
        self.ticket.cancel();
    }
}

impl<T: Send + 'static> Job<T> {
    /// Begins it, on a thread with a name.
    ///
    /// # Errors
    /// A thread that does not start.
    pub(super) fn start(
        (name, what): (&str, &'static str),
        work: impl FnOnce(&Ticket) -> T + Send + 'static,
    ) -> Result<Self, GpuError> {
        let ticket = Ticket::new();
        let (sender, result) = mpsc::sync_channel(1);
        let job = {
            let ticket = ticket.clone();
            // Whoever asked may be gone.
            move || drop(sender.send(work(&ticket)))
        };
        std::thread::Builder::new().name(name.to_owned()).spawn(job).map_err(|error| {
            GpuError::Device(format!("the thread that makes {what} did not start: {error}"))
        })?;
        Ok(Self { what, ticket, result })
    }

    /// What came of it within a time; `None` while it is under way.
    ///
    /// # Errors
    /// A thread that failed.
    pub(super) fn look(&self, patience: Duration) -> Result<Option<T>, GpuError> {
        match self.result.recv_timeout(patience) {
            Ok(made) => Ok(Some(made)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => {
                Err(GpuError::Device(format!("making {} failed", self.what)))
            }
        }
    }

    /// What comes of it, waited for as long as nothing newer comes; `None` where it does.
    ///
    /// # Errors
    /// A thread that failed.
    pub(super) fn wait(
        &self,
        engines: &mut Engines,
        observer: &mut dyn Observer,
    ) -> Result<Option<T>, DrawError> {
        loop {
            let made = self.look(LOOK_EVERY)?;
            if made.is_some() || observer.piece_done(engines, 0.0) {
                return Ok(made);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::engines::{Canvas, EngineChoice};
    use super::*;
    use crate::gpu::Wishes;

    /// Stops at once.
    struct Stops;

    impl Observer for Stops {
        fn piece_done(&mut self, _: &mut dyn Canvas, _: f64) -> bool {
            true
        }
    }

    #[test]
    fn a_job_may_be_left_and_taken_up_again_and_is_cancelled_where_it_is_dropped() {
        let engines = Engines::new(EngineChoice::Native.into(), Wishes::default());
        let mut engines = engines.expect("no adapter is asked for");
        let (sender, go_on) = mpsc::channel::<()>();
        let names = ("voxsplat-test", "a number");
        let job = Job::start(names, move |_| go_on.recv().map_or(0, |()| 7)).expect("a thread");
        assert_eq!(job.wait(&mut engines, &mut Stops), Ok(None));
        sender.send(()).expect("it waits");
        assert_eq!(job.wait(&mut engines, &mut ()), Ok(Some(7)));

        let (sender, ended) = mpsc::channel();
        let job = Job::start(names, move |ticket| {
            while !ticket.is_cancelled() {
                std::thread::sleep(Duration::from_millis(1));
            }
            sender.send(()).expect("somebody waits");
        });
        drop(job);
        assert_eq!(ended.recv_timeout(Duration::from_secs(30)), Ok(()));
    }

    #[test]
    fn a_job_that_panics_is_told_in_a_sentence() {
        let names = ("voxsplat-test", "a number");
        let job = Job::<u32>::start(names, |_| std::panic::resume_unwind(Box::new("no")));
        let told = job.expect("a thread").look(Duration::from_secs(30)).expect_err("it failed");
        assert!(told.to_string().contains("making a number failed"), "{told}");
    }
}

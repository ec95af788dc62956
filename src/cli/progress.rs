//! How far long work is, on a terminal.

use std::io::{IsTerminal, Write};
use std::sync::mpsc::{Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use crate::core::Ticket;

/// Work that is done sooner says nothing.
const SILENT: Duration = Duration::from_secs(1);
/// Between two lines.
const EVERY: Duration = Duration::from_millis(250);
/// Takes back what stands in the line.
const BACK: &str = "\r\x1b[K";

/// Tells on stderr how far a ticket's work is until it is dropped, where that is a terminal: files and pipes hold what is
/// to be read later.
pub(super) struct Progress {
    /// Dropped to end it.
    ends: Option<Sender<()>>,
    teller: Option<JoinHandle<()>>,
}

impl Progress {
    /// Of what is called so.
    pub(super) fn of(ticket: &Ticket, what: &'static str) -> Self {
        let (ends, ended) = channel();
        let ticket = ticket.clone();
        let tell = move || {
            let start = Instant::now();
            let mut wait = SILENT;
            let mut is_told = false;
            while ended.recv_timeout(wait) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
                wait = EVERY;
                is_told = true;
                tell(&format!("{BACK}{}", line(what, ticket.fraction(), start.elapsed())));
            }
            if is_told {
                tell(BACK);
            }
        };
        let is_seen = std::io::stderr().is_terminal();
        // Without a thread for it there is nothing to see, and all else goes on.
        let teller = is_seen.then(|| Builder::new().name("progress".to_owned()).spawn(tell).ok());
        Self { ends: Some(ends), teller: teller.flatten() }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.ends = None;
        if let Some(teller) = self.teller.take() {
            // What it panicked of was told.
            drop(teller.join());
        }
    }
}

fn tell(text: &str) {
    let mut stderr = std::io::stderr().lock();
    // Where it cannot be written to, there is nobody left to tell.
    drop(stderr.write_all(text.as_bytes()).and_then(|()| stderr.flush()));
}

/// What stands in the line.
fn line(what: &str, fraction: f32, since: Duration) -> String {
    format!("voxsplat: {what}, {:.0} %, {} s", 100.0 * fraction, since.as_secs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_what_how_far_and_since_when() {
        let told = line("drawing", 0.424, Duration::from_millis(3900));
        assert_eq!(told, "voxsplat: drawing, 42 %, 3 s");
    }

    #[test]
    fn it_ends_at_once_when_the_work_does() {
        let start = Instant::now();
        drop(Progress::of(&Ticket::new(), "drawing"));
        assert!(start.elapsed() < SILENT, "{:?}", start.elapsed());
    }
}

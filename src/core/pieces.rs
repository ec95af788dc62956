//! Long work over many things, between which a ticket is looked at: seldom enough to cost nothing, and often enough that
//! something newer need not wait for more than a millisecond or two.

use super::parallel;
use super::progress::{Cancelled, Ticket};

/// Looks at a ticket once enough was done since the last look. For work that is too short for a look each.
#[derive(Debug)]
pub struct Looks<'a> {
    ticket: &'a Ticket,
    every: usize,
    since: usize,
}

impl<'a> Looks<'a> {
    /// After each so much of whatever is counted, and at once.
    pub fn every(ticket: &'a Ticket, every: usize) -> Self {
        Self { ticket, every, since: every }
    }

    /// Counts what is done next, or was done.
    ///
    /// # Errors
    /// [`Cancelled`] where it was time to look, and the ticket was cancelled.
    #[inline]
    pub fn after(&mut self, count: usize) -> Result<(), Cancelled> {
        self.since = self.since.saturating_add(count);
        if self.since < self.every {
            return Ok(());
        }
        self.since = 0;
        self.ticket.look()
    }
}

/// Something of each of many things, by their numbers and in their order. Pieces of so many are shared out to all threads, and
/// the ticket is looked at before each.
///
/// # Errors
/// [`Cancelled`].
pub fn mapped<T: Send>(
    count: usize,
    piece: usize,
    make: impl Fn(usize) -> T + Send + Sync,
    ticket: &Ticket,
) -> Result<Vec<T>, Cancelled> {
    let piece = piece.max(1);
    let mut made = Vec::with_capacity(count);
    for begin in (0..count).step_by(piece) {
        ticket.look()?;
        parallel::extend(&mut made, piece.min(count - begin), |i| make(begin + i));
    }
    Ok(made)
}

/// Holds work to looking at its ticket so many times at least, and to ending at any look that says so. `work` does the same
/// whenever it is called.
///
/// It takes no clock: a phase that looked too seldom, or a part of it that did not look, has too few looks.
#[cfg(test)]
pub(crate) fn assert_stops<T, E>(
    what: &str,
    least: usize,
    work: impl Fn(&Ticket) -> Result<T, E> + Sync,
) where
    T: Send,
    E: std::fmt::Debug + Send,
{
    const THREADS: usize = 2;
    // Each thread may be about to look, bands of pictures look once more as they end, and so does whoever waits for them.
    const AFTER: u64 = 10 * THREADS as u64;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(THREADS).build().expect("threads");
    let run = |ticket: &Ticket| pool.install(|| work(ticket).map(drop));
    let ticket = Ticket::new();
    assert!(run(&ticket).is_ok(), "{what}: nobody told it to stop");
    let looks = ticket.asked();
    println!("measured {what}: {looks} looks, of at least {least}");
    assert!(looks >= least as u64, "{what}: {looks} looks, of at least {least}");
    for trip in [1, 1 + looks / 3, 1 + looks * 2 / 3] {
        let ticket = Ticket::tripping_at(trip);
        let ended = run(&ticket).expect_err(what);
        assert!(format!("{ended:?}").contains("Cancelled"), "{what}, look {trip}: {ended:?}");
        let after = ticket.asked() - trip;
        assert!(after <= AFTER, "{what}: {after} looks after the one that said so, of {looks}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[should_panic(expected = "looks, of at least 5")]
    fn what_looks_too_seldom_is_found() {
        assert_stops("a piece", 5, |ticket| mapped(200, 50, |i| i, ticket));
    }

    #[test]
    #[should_panic(expected = "looks after the one that said so")]
    fn what_does_not_stop_is_found() {
        let never = |ticket: &Ticket| {
            let looks: Vec<_> = (0..100).map(|_| ticket.look()).collect();
            looks.into_iter().collect::<Result<(), Cancelled>>()
        };
        assert_stops("a loop", 5, never);
    }

    #[test]
    fn looks_come_at_once_and_then_after_so_much() {
        let ticket = Ticket::tripping_at(3);
        let mut looks = Looks::every(&ticket, 10);
        let found: Vec<bool> = (0..8).map(|_| looks.after(4).is_ok()).collect();
        // At once, after 12 and after 24.
        assert_eq!(found, [true, true, true, true, true, true, false, true]);
        assert_eq!(looks.after(usize::MAX), Err(Cancelled));
        assert_eq!(ticket.asked(), 4);
    }

    #[test]
    fn pieces_are_in_order_and_begin_with_a_look() {
        let squares = |ticket: &Ticket| mapped(1000, 64, |i| i * i, ticket);
        let expected: Vec<usize> = (0..1000).map(|i| i * i).collect();
        let ticket = Ticket::new();
        assert_eq!(squares(&ticket), Ok(expected));
        assert_eq!(ticket.asked(), 16);
        let ticket = Ticket::tripping_at(9);
        assert_eq!((squares(&ticket), ticket.asked()), (Err(Cancelled), 9));
        assert_eq!(mapped(0, 0, |i| i, &ticket), Ok(Vec::new()), "nothing to stop");
    }
}

//! How much of a long work is done before anybody is asked whether to go on.

/// No piece should take longer, milliseconds, whatever is asked for: systems end what keeps a graphics processor for
/// seconds, and a hand waits for the piece under way.
const MOST_PIECE_MS: f64 = 100.0;

/// The size of the next piece: what takes as long as a piece should, by what the last one took, but never more than twice
/// as much. So the first one, before anything was timed, should be small.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    piece: u32,
    least: u32,
}

impl Pace {
    /// From a first piece on; none is smaller than `least`.
    pub fn new(first: u32, least: u32) -> Self {
        Self { piece: first.max(least), least }
    }

    /// Of how many things the next piece is.
    pub fn piece(&self) -> u32 {
        self.piece
    }

    /// Learns from a piece of so many things what it took, and how long the next one should take, milliseconds.
    pub fn learn(&mut self, count: f64, took_ms: f64, piece_ms: f64) {
        // What costs next to nothing says little of what follows.
        let fitting = count / took_ms.max(0.01) * piece_ms.min(MOST_PIECE_MS);
        let most = 2.0 * f64::from(self.piece);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let piece = fitting.clamp(f64::from(self.least).max(1.0), most.max(1.0)) as u32;
        self.piece = piece;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_grows_by_twice_at_most_and_shrinks_at_once() {
        let mut pace = Pace::new(64, 8);
        pace.learn(64.0, 0.001, 10.0);
        assert_eq!(pace.piece(), 128);
        pace.learn(128.0, 20.0, 10.0);
        assert_eq!(pace.piece(), 64);
        pace.learn(64.0, 1e6, 10.0);
        assert_eq!(pace.piece(), 8, "no smaller than the least");
        pace.learn(8.0, f64::INFINITY, 10.0);
        assert_eq!(pace.piece(), 8);
    }

    #[test]
    fn whatever_is_asked_for_a_piece_is_to_take_a_tenth_of_a_second_at_most() {
        let mut pace = Pace::new(1000, 1);
        // A tenth of a millisecond each.
        pace.learn(1000.0, 100.0, 1e9);
        assert_eq!(pace.piece(), 1000);
        pace.learn(1000.0, 200.0, 1e9);
        assert_eq!(pace.piece(), 500);
    }

    #[test]
    fn the_first_piece_is_none_that_is_too_small() {
        assert_eq!(Pace::new(1, 64).piece(), 64);
        let mut pace = Pace::new(u32::MAX, 1);
        pace.learn(f64::from(u32::MAX), 1e-9, 10.0);
        assert!(pace.piece() > 1 << 20);
    }
}

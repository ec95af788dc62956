//! Which bricks of a field have come, and what is drawn while others have not.
//!
//! Of a field in memory all are there. Where bricks are read one by one, coarse levels come first. Until the level comes that a
//! cut asks for, a brick is drawn from the finest that has; where none has, nothing is drawn. Pictures say of how many bricks
//! that is so, and the source is told which.

use std::fmt::Debug;
use std::sync::Arc;

use crate::plan::EMPTY;

/// Where the bricks of a field come from.
pub trait BrickSource: Debug + Send + Sync {
    /// A number that is another one whenever something has come since.
    fn coming(&self) -> u64;

    /// The finest level of each brick that has come, x fastest: 0 for samples, [`EMPTY`] where nothing has. `None` where all is
    /// there. Bricks beyond the end have not come.
    fn finest(&self) -> Option<Vec<u8>>;

    /// Told which bricks the last picture of a cut lacked, those that it loses most by first.
    fn want(&self, bricks: &[Wanted]);
}

/// A brick that a cut draws coarser than it asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// Its number, x fastest.
    pub brick: u32,
    /// The level that is asked for.
    pub level: u8,
}

/// A field that is all there.
#[derive(Debug, Clone, Copy)]
pub struct InMemory;

impl BrickSource for InMemory {
    fn coming(&self) -> u64 {
        0
    }

    fn finest(&self) -> Option<Vec<u8>> {
        None
    }

    fn want(&self, _: &[Wanted]) {}
}

/// What has come from a source so far.
#[derive(Debug)]
pub(super) struct Arrived {
    source: Arc<dyn BrickSource>,
    seen: Option<u64>,
    finest: Option<Vec<u8>>,
}

impl Default for Arrived {
    fn default() -> Self {
        Self::from(Arc::new(InMemory))
    }
}

impl Arrived {
    /// Nothing is known yet of what has come.
    pub(super) fn from(source: Arc<dyn BrickSource>) -> Self {
        Self { source, seen: None, finest: None }
    }

    /// Looks what has come; whether that is another than the last time.
    pub(super) fn look(&mut self) -> bool {
        // Before the levels are: what comes in between is seen the next time.
        let now = Some(self.source.coming());
        if self.seen == now {
            return false;
        }
        let finest = self.source.finest();
        let is_other = finest != self.finest;
        (self.seen, self.finest) = (now, finest);
        is_other
    }

    /// Whether anything has come since.
    pub(super) fn has_news(&self) -> bool {
        self.seen != Some(self.source.coming())
    }

    /// By brick; see [`BrickSource::finest`].
    pub(super) fn finest(&self) -> Option<&[u8]> {
        self.finest.as_deref()
    }

    /// Tells the source.
    pub(super) fn want(&self, bricks: &[Wanted]) {
        if !bricks.is_empty() {
            self.source.want(bricks);
        }
    }
}

/// Makes of the levels that a cut asks for those that can be drawn, and says which bricks wait for theirs.
pub(super) fn of_what_came(levels: &mut [u8], finest: Option<&[u8]>) -> Vec<Wanted> {
    let Some(finest) = finest else { return Vec::new() };
    let mut waiting = Vec::new();
    for (brick, level) in levels.iter_mut().enumerate() {
        let came = finest.get(brick).copied().unwrap_or(EMPTY).min(EMPTY);
        if *level < came {
            #[expect(clippy::cast_possible_truncation, reason = "bricks have numbers of 32 bits")]
            waiting.push(Wanted { brick: brick as u32, level: *level });
            *level = came;
        }
    }
    waiting
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_are_drawn_from_the_finest_level_that_has_come() {
        let wanted = [0, 1, 2, EMPTY, 0, 2, 1, 0];
        let of = |finest: Option<&[u8]>| {
            let mut levels = wanted;
            let waiting = of_what_came(&mut levels, finest);
            (levels, waiting.into_iter().map(|of| (of.brick, of.level)).collect::<Vec<_>>())
        };
        assert_eq!(of(None), (wanted, Vec::new()), "all is there");
        // What is finer than asked for is no reason to draw it, and what does not show is not waited for.
        let (levels, waiting) = of(Some(&[2, 2, 0, EMPTY, 0, EMPTY, 1]));
        assert_eq!(levels, [2, 2, 2, EMPTY, 0, EMPTY, 1, EMPTY]);
        assert_eq!(waiting, [(0, 0), (1, 1), (5, 2), (7, 0)]);
    }
}

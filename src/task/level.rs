//! To what level of detail a picture was drawn.

pub use crate::plan::SlabField;

use super::draw::{CutLevels, Drawn, Rung};
use super::still::Convergence;
use crate::kernel::Kernel;

/// What a picture shows of its scene: a rung as it was drawn. The window puts it into words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LevelOfDetail {
    /// An octree cut.
    Octree {
        /// Greatest error of a node (see `hierarchy::Node::error`).
        max_error: f32,
    },
    /// Fewer pixels than are shown.
    Reduced {
        /// Of which field.
        field: SlabField,
        /// Pixels.
        size: [u32; 2],
        /// A cut of it.
        cut: Option<CutLevels>,
        /// Whether it was fitted to a time.
        is_timed: bool,
    },
    /// Every 2^level-th sample along each axis, averaged.
    Subsampled {
        /// Level of the pyramid.
        level: usize,
    },
    /// Every voxel with a cheaper kernel.
    Cheaper(Kernel),
    /// As much of `full` as there was by then.
    FullInPart,
    /// All of it, in the scene's own mode.
    Full {
        /// Times that vectors were halved beyond what was asked for.
        vectors_halved: u32,
    },
    /// `full` with slabs that were doubled.
    Refined(Convergence),
}

impl LevelOfDetail {
    /// All that was asked for.
    pub const FULL: Self = Self::Full { vectors_halved: 0 };

    pub(super) fn of(rung: Rung, drawn: &Drawn) -> Self {
        let &Drawn { max_error, field, size, cut, vectors_halved, .. } = drawn;
        match rung {
            Rung::Octree { .. } => Self::Octree { max_error },
            Rung::Coarse { .. } if !drawn.is_reduced => Self::Octree { max_error },
            Rung::Coarse { .. } => Self::Reduced { field, size, cut, is_timed: true },
            Rung::Reduced { .. } | Rung::Bricks { .. } => {
                Self::Reduced { field, size, cut, is_timed: false }
            }
            Rung::Subsampled { level } => Self::Subsampled { level },
            Rung::Cheaper(kernel) => Self::Cheaper(kernel),
            Rung::Full => Self::Full { vectors_halved },
        }
    }

    /// Whether it is [`LevelOfDetail::FULL`].
    pub fn is_full(&self) -> bool {
        *self == Self::FULL
    }

    /// Whether it is an octree cut, or else was fitted to a time.
    pub fn is_coarse(&self) -> bool {
        matches!(self, Self::Octree { .. } | Self::Reduced { is_timed: true, .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_of_what_was_drawn_rather_than_of_what_was_asked_for() {
        let (field, size, vectors_halved) = (SlabField::Preview, [9, 6], 2);
        let cut = Drawn { size, field, max_error: 0.25, vectors_halved, ..Drawn::default() };
        let reduced = Drawn { is_reduced: true, ..cut };
        let whole = Drawn { vectors_halved: 0, ..cut };
        let octree = LevelOfDetail::Octree { max_error: 0.25 };
        let [timed, half] = [true, false].map(|is_timed| LevelOfDetail::Reduced {
            field,
            size,
            cut: None,
            is_timed,
        });
        let coarse = Rung::Coarse { budget_ms: 1.0 };
        let shrunk = Rung::Reduced { field: SlabField::Own, shrink: 2.0 };
        for (rung, drawn, level, is) in [
            (Rung::Octree { max_error: 0.1 }, &cut, octree, [false, true]),
            (coarse, &cut, octree, [false, true]),
            (coarse, &reduced, timed, [false, true]),
            (shrunk, &reduced, half, [false, false]),
            (Rung::Full, &cut, LevelOfDetail::Full { vectors_halved }, [false, false]),
            (Rung::Full, &whole, LevelOfDetail::FULL, [true, false]),
        ] {
            let found = LevelOfDetail::of(rung, drawn);
            assert_eq!((found, [found.is_full(), found.is_coarse()]), (level, is), "{rung:?}");
        }
    }
}

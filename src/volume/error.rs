//! What cannot be made into a volume, in words for whoever opened it.

use crate::core::memory::TooLarge;
use crate::core::progress::Cancelled;

/// What cannot be made into a volume.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// Sizes and samples do not belong together, or a size is zero.
    #[error("expected {expected} samples for {what}, found {found}")]
    Size {
        /// Which field.
        what: String,
        /// Samples that the dimensions ask for.
        expected: String,
        /// Samples there are.
        found: usize,
    },
    /// A lattice that has no inverse: a zero spacing, or axes in one plane.
    #[error("expected three independent axes of finite, non-zero spacing, found {found}")]
    Degenerate {
        /// The offending spacing and direction, in words.
        found: String,
    },
    /// Points that make no grid.
    #[error(
        "expected finite points, with coordinates that rise or fall along each axis of a rectilinear \
         grid, found {found}"
    )]
    Uneven {
        /// The offending coordinates, in words.
        found: String,
    },
    /// Scalars on a grid without cells.
    #[error(
        "expected a curvilinear grid of two points or more along each axis, whose scalars can be drawn, \
         found a surface or line of {found} points; its vectors can be drawn"
    )]
    Surface {
        /// Its dimensions.
        found: String,
    },
    /// Fields that cannot be the components of one vector.
    #[error(
        "expected three fields of one component each, all on points or all on cells, found {found}; \
         choose other fields"
    )]
    NoTriple {
        /// The offending field, in words.
        found: String,
    },
    /// A field with nothing to show.
    #[error("expected at least one finite value in field \"{field}\", found only {found}")]
    NothingFinite {
        /// Which field.
        field: String,
        /// What there was instead, in words.
        found: String,
    },
    /// A field that is not there.
    #[error(
        "expected {} {}, found {asked:?}",
        if available.len() == 1 { "the field" } else { "one of the fields" },
        listed(available)
    )]
    NoSuchField {
        /// What was asked for.
        asked: String,
        /// The names there are.
        available: Vec<String>,
    },
    /// Vectors of another number of components than three.
    #[error(
        "expected three components for vectors, found {components} in field \"{field}\"; choose \
         another field"
    )]
    NotVectors {
        /// Which field.
        field: String,
        /// Components there are.
        components: usize,
    },
    /// A component that a field has not.
    #[error(
        "expected {} of field \"{field}\", found component {asked}",
        match components { 1 => "component 0".to_owned(), n => format!("a component from 0 to {}", n - 1) }
    )]
    NoSuchComponent {
        /// Which field.
        field: String,
        /// What was asked for.
        asked: usize,
        /// Components there are.
        components: usize,
    },
    /// See [`TooLarge`].
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// See [`Cancelled`].
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Names in a sentence: neither many nor long.
fn listed(names: &[String]) -> String {
    const MOST: usize = 40;
    const LONGEST: usize = 60;
    let short = |name: &String| match name.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &name[..end]),
        None => name.clone(),
    };
    let mut shown: Vec<String> = names.iter().take(MOST).map(short).collect();
    if names.len() > MOST {
        shown.push(format!("{} more", names.len() - MOST));
    }
    shown.join(", ")
}

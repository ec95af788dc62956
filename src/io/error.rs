//! What can go wrong between a file and a grid, in words for whoever opened it.

use std::io;
use std::path::{Path, PathBuf};

use crate::core::memory::TooLarge;
use crate::core::progress::Cancelled;
use crate::volume::VolumeError;

/// A file that could not be opened as a volume: one sentence, the path last.
#[derive(Debug, thiserror::Error)]
#[error("{problem}: {}", path.display())]
pub struct ReadError {
    /// What was expected, what was found and what to try.
    pub problem: Problem,
    /// The file that was asked for (of a detached pair, the header).
    pub path: PathBuf,
}

impl ReadError {
    /// Whether the work was stopped rather than failed: nothing to show to anybody.
    pub fn is_cancelled(&self) -> bool {
        matches!(self.problem, Problem::Cancelled(_) | Problem::Volume(VolumeError::Cancelled(_)))
    }
}

/// The three parts that every complaint about a file's content has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, found {found}; {advice}")]
pub struct Mismatch {
    /// What the format asks for.
    pub expected: String,
    /// What the file has instead, quoted and shortened.
    pub found: String,
    /// What to try.
    pub advice: String,
}

/// Why a file could not be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// No file of that name.
    #[error("expected a file, found nothing of that name; check the spelling and the folder")]
    NotFound,
    /// The system forbids reading it.
    #[error("expected a readable file, found that permission is denied; change its permissions")]
    Denied,
    /// A folder, a pipe or a device.
    #[error("expected a file, found {found}; give one regular file")]
    NotAFile {
        /// What it is.
        found: String,
    },
    /// Zero bytes.
    #[error("expected a volume, found an empty file; copy or write the file again")]
    Empty,
    /// No reader knows this content.
    #[error(transparent)]
    Unrecognised(Mismatch),
    /// A header that contradicts its format or itself.
    #[error(transparent)]
    Header(Mismatch),
    /// Valid, but nothing that this program reads.
    #[error(transparent)]
    Unsupported(Mismatch),
    /// Fewer samples than the header promises.
    #[error(transparent)]
    Truncated(Mismatch),
    /// Encoded samples that do not decode.
    #[error(transparent)]
    Corrupt(Mismatch),
    /// A detached data file that is not there or cannot be read.
    #[error("expected the data file {name:?} that the header names, found {found}; put it there")]
    MissingData {
        /// As resolved against the header's folder.
        name: PathBuf,
        /// The system's words.
        found: String,
    },
    /// More than memory holds.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// Samples that make no volume.
    #[error("{0}; correct the file's header, or write it again")]
    Volume(#[from] VolumeError),
    /// The system failed while reading.
    #[error("expected to read the file, found that the system failed ({0}); try again")]
    Io(io::Error),
    /// See [`Cancelled`].
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Problem {
    /// The error that names `path`.
    pub(super) fn at(self, path: &Path) -> ReadError {
        ReadError { problem: self, path: path.to_owned() }
    }

    /// What opening or inspecting a file told.
    pub(super) fn from_opening(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::NotFound => Self::NotFound,
            io::ErrorKind::PermissionDenied => Self::Denied,
            io::ErrorKind::IsADirectory => Self::NotAFile { found: "a folder".into() },
            _ => Self::Io(error),
        }
    }
}

/// Shorthand for the five kinds of [`Mismatch`].
macro_rules! shorthand {
    ($($name:ident $kind:ident),*) => { $(
        pub(super) fn $name(
            expected: impl Into<String>,
            found: impl Into<String>,
            advice: impl Into<String>,
        ) -> Problem {
            Problem::$kind(Mismatch {
                expected: expected.into(),
                found: found.into(),
                advice: advice.into(),
            })
        }
    )* };
}
shorthand!(unrecognised Unrecognised, header Header, unsupported Unsupported, truncated Truncated, corrupt Corrupt);

/// Text out of a file, quoted, on one line and short enough for a message.
pub(super) fn quoted(text: &str) -> String {
    const LONGEST: usize = 60;
    let short: String = text.trim().chars().take(LONGEST).collect();
    let ellipsis = if text.trim().chars().nth(LONGEST).is_some() { "…" } else { "" };
    format!("{short:?}{ellipsis}")
}

/// [`quoted`], for bytes of unknown encoding.
pub(super) fn quoted_bytes(bytes: &[u8]) -> String {
    quoted(&String::from_utf8_lossy(&bytes[..bytes.len().min(240)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_and_ends_with_the_path() {
        let found =
            quoted("two\nlines and more and more and more and more and more and more and on");
        let error = header("a number", found, "edit it").at(Path::new("/a/b.nrrd")).to_string();
        assert!(!error.contains('\n') && error.ends_with(": /a/b.nrrd"), "{error}");
        assert!(error.starts_with("expected a number, found \"two\\nlines"), "{error}");
    }
}

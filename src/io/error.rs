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
    /// A name that leads to no file.
    #[error("expected the name of a file, found {found}; give another name, or correct the link")]
    NoName {
        /// What it is instead.
        found: &'static str,
    },
    /// A folder, a pipe or a device.
    #[error("expected a file, found {found}; give one regular file")]
    NotAFile {
        /// What it is.
        found: String,
    },
    /// Zero bytes.
    #[error("expected data, found an empty file; copy or write the file again")]
    Empty,
    /// A well-known format that is not read.
    #[error(
        "expected a volume, found {name}, which Voxsplat cannot read; convert it to NRRD, NIfTI or TIFF"
    )]
    Foreign {
        /// What it is, with its article.
        name: String,
    },
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

    /// The same of a file that another one names.
    pub(super) fn in_piece(mut self, name: &str) -> Self {
        if let Self::Unrecognised(mismatch)
        | Self::Header(mismatch)
        | Self::Unsupported(mismatch)
        | Self::Truncated(mismatch)
        | Self::Corrupt(mismatch) = &mut self
        {
            mismatch.found = format!("{} in the piece {}", mismatch.found, quoted(name));
        }
        self
    }

    /// What opening or inspecting a file told.
    pub(super) fn from_opening(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::NotFound => Self::NotFound,
            io::ErrorKind::PermissionDenied => Self::Denied,
            io::ErrorKind::IsADirectory => Self::NotAFile { found: "a folder".into() },
            io::ErrorKind::NotADirectory => {
                Self::NoName { found: "a file where a folder was to be" }
            }
            io::ErrorKind::InvalidFilename => Self::NoName { found: "one that is too long" },
            io::ErrorKind::InvalidInput => Self::NoName { found: "one that the system forbids" },
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

/// Text out of a file, quoted, on one line and short enough for a message. Each run of what nobody
/// can read (control characters, bytes that are no text) is one `·`.
pub(super) fn quoted(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut characters: Vec<char> = text.trim().chars().take(LONGEST + 1).collect();
    let ellipsis = if characters.len() > LONGEST { "…" } else { "" };
    characters.truncate(LONGEST);
    let mut short: Vec<char> =
        characters.into_iter().map(|c| if is_readable(c) { c } else { '·' }).collect();
    short.dedup_by(|a, b| *a == '·' && *b == '·');
    format!("{:?}{ellipsis}", String::from_iter(short))
}

/// The same without its quotes: a name in a list.
pub(super) fn plain(text: &str) -> String {
    let quoted = quoted(text);
    let (name, ellipsis) = quoted.rsplit_once('"').unwrap_or((&quoted, ""));
    format!("{}{ellipsis}", name.trim_start_matches('"'))
}

/// Whether a character stands in a message as itself, or as the escape of a blank or a quote.
fn is_readable(c: char) -> bool {
    c != char::REPLACEMENT_CHARACTER && (c >= ' ' || "\n\r\t".contains(c)) && {
        !c.escape_debug().any(|escaped| escaped == '{')
    }
}

/// [`quoted`], for bytes of unknown encoding: as numbers where most of them are no text.
pub(super) fn quoted_bytes(bytes: &[u8]) -> String {
    const FEW: usize = 8;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(60)]);
    let unreadable = text.chars().filter(|c| !is_readable(*c)).count();
    if 4 * unreadable > text.chars().count() {
        let few: Vec<String> = bytes.iter().take(FEW).map(|byte| format!("{byte:02x}")).collect();
        return few.join(" ");
    }
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

    #[test]
    fn what_nobody_can_read_is_shown_shortly() {
        assert_eq!(quoted("a\u{1}\u{2}\u{fffd}b\tc \"d\" é"), "\"a·b\\tc \\\"d\\\" é\"");
        assert_eq!(quoted(&"\u{1b}".repeat(500)), "\"·\"…");
        assert_eq!(quoted_bytes(&[0; 500]), "00 00 00 00 00 00 00 00");
        assert_eq!(quoted_bytes(b"\xd3\x3c\x9f\x80"), "d3 3c 9f 80");
        assert_eq!(quoted_bytes(b"hello, w\xf6rld"), "\"hello, w·rld\"");
        // Letters of any script are text, and long ones are cut.
        assert_eq!(quoted("größe 大"), "\"größe 大\"");
        assert_eq!(quoted(&"x".repeat(61)), format!("\"{}\"…", "x".repeat(60)));
    }
}

//! Files on disk: opened, measured, and found beside the header that names them.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::error::Problem;

/// The files that were opened as parts of what was read, by the names that the system has for them.
static OPENED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn opened() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    OPENED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether a file is a part of what was read, such as the one that a header names: nothing may be written over it.
pub fn was_read(path: &Path) -> bool {
    std::fs::canonicalize(path).is_ok_and(|path| opened().contains(&path))
}

/// A file that was read may be written over.
pub fn may_be_replaced(path: &Path) {
    if let Ok(path) = std::fs::canonicalize(path) {
        opened().remove(&path);
    }
}

/// Opens a regular file, a part of what is read, and tells its length.
///
/// # Errors
/// Not there, not allowed, not a regular file.
pub(super) fn open_file(path: &Path) -> Result<(File, u64), Problem> {
    let found = look_into(path)?;
    opened().extend(std::fs::canonicalize(path));
    Ok(found)
}

/// Opens a regular file that may be no part of it, and tells its length.
///
/// # Errors
/// Not there, not allowed, not a regular file.
pub(super) fn look_into(path: &Path) -> Result<(File, u64), Problem> {
    // Asked before opening: opening a pipe would wait for its writer.
    let metadata = std::fs::metadata(path).map_err(|error| {
        let is_link = std::fs::symlink_metadata(path).is_ok_and(|own| own.is_symlink());
        match error.kind() {
            std::io::ErrorKind::PermissionDenied => Problem::Denied,
            _ if is_link => Problem::NoName { found: "a link that leads to no file" },
            _ => Problem::from_opening(error),
        }
    })?;
    if metadata.is_dir() {
        return Err(Problem::NotAFile { found: "a folder".into() });
    }
    if !metadata.is_file() {
        return Err(Problem::NotAFile { found: "a pipe or device".into() });
    }
    let file = File::open(path).map_err(Problem::from_opening)?;
    Ok((file, metadata.len()))
}

/// A detached data file named by a header, resolved against the header's folder.
pub(super) struct DataFile {
    pub(super) path: PathBuf,
    pub(super) len: u64,
}

/// One file's part of the samples.
pub(super) struct Part {
    pub(super) file: DataFile,
    /// Where the data may begin: behind the header of an attached file.
    pub(super) start: u64,
    /// Samples it holds.
    pub(super) count: usize,
}

impl DataFile {
    /// # Errors
    /// [`Problem::MissingData`].
    pub(super) fn find(header: &Path, name: &str) -> Result<Self, Problem> {
        let path = header.parent().unwrap_or(Path::new("")).join(name);
        match open_file(&path) {
            Ok((_, len)) => Ok(Self { path, len }),
            Err(problem) => Err(Self::missing(&path, &problem)),
        }
    }

    /// # Errors
    /// [`Problem::MissingData`].
    pub(super) fn open(&self) -> Result<BufReader<File>, Problem> {
        match open_file(&self.path) {
            Ok((file, _)) => Ok(buffered(file)),
            Err(problem) => Err(Self::missing(&self.path, &problem)),
        }
    }

    fn missing(path: &Path, problem: &Problem) -> Problem {
        let found = match problem {
            Problem::NotFound => "no such file".to_owned(),
            Problem::Denied => "that permission is denied".to_owned(),
            Problem::NotAFile { found } => found.clone(),
            other => other.to_string(),
        };
        Problem::MissingData { name: path.to_owned(), found }
    }
}

/// A name from a pattern with one `%d`, `%i` or `%u` of an optional width, zero-filled or not.
pub(super) fn numbered(pattern: &str, number: i64) -> Option<String> {
    const WIDEST: usize = 32;
    let (before, rest) = pattern.split_once('%')?;
    let end = rest.find(|c: char| !c.is_ascii_digit())?;
    let (digits, rest) = rest.split_at(end);
    let after = rest.strip_prefix(['d', 'i', 'u'])?;
    let width = if digits.is_empty() { 0 } else { digits.parse().ok()? };
    if width > WIDEST || after.contains('%') {
        return None;
    }
    Some(match digits.starts_with('0') {
        true => format!("{before}{number:0width$}{after}"),
        false => format!("{before}{number:width$}{after}"),
    })
}

/// A reader whose buffer is worth a system call.
pub(super) fn buffered<R: Read>(reader: R) -> BufReader<R> {
    BufReader::with_capacity(1 << 16, reader)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_filled_in_as_printf_does() {
        assert_eq!(numbered("q.%d", 7).as_deref(), Some("q.7"));
        assert_eq!(numbered("q%03d.raw", 7).as_deref(), Some("q007.raw"));
        assert_eq!(numbered("q%3i", 7).as_deref(), Some("q  7"));
        for bad in ["q", "q%s", "q%", "%d%d", "%999999999d"] {
            assert_eq!(numbered(bad, 1), None, "{bad}");
        }
    }
}

//! Files that are the outcome of long work: looked at before it, and never left half written.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use crate::io::was_read;

/// A place for a file, found fit to be written to. Nothing is there before [`OutputFile::write`], and
/// what was there stays until the new file is whole.
#[derive(Debug)]
pub struct OutputFile {
    /// As it was asked for.
    path: PathBuf,
    /// Behind links.
    target: PathBuf,
    what: &'static str,
    /// A device, or a file in a folder that takes no new ones: nothing can be renamed to it.
    in_place: bool,
    /// A pipe, open since somebody was found to read it: once closed, its reader is done.
    pipe: Option<File>,
}

impl OutputFile {
    /// Looks whether `what` (such as "the picture") can be written at `path`: a file's name in a
    /// folder that takes files, or a file that may be written to.
    ///
    /// # Errors
    /// One sentence with the path last.
    pub fn check(path: &Path, what: &'static str) -> Result<Self, String> {
        let fit = Self {
            path: path.to_owned(),
            target: behind_links(path),
            what,
            in_place: false,
            pipe: None,
        };
        fit.refuse_what_was_read()?;
        let ends_in_separator = path.to_string_lossy().ends_with(std::path::is_separator);
        match fs::metadata(&fit.target) {
            Ok(found) if found.is_dir() => Err(fit.is_a_folder()),
            Ok(found) if is_pipe(&found) => {
                let pipe = open_pipe(&fit.target).map_err(|error| fit.no_reader(&error))?;
                Ok(Self { pipe: Some(pipe), ..fit })
            }
            Ok(found) if !found.is_file() => {
                let opened = OpenOptions::new().write(true).open(&fit.target);
                opened.map_err(|error| fit.failure(&error))?;
                Ok(Self { in_place: true, ..fit })
            }
            Ok(_) => {
                let opened = OpenOptions::new().write(true).open(&fit.target);
                opened.map_err(|error| fit.failure(&error))?;
                Ok(Self { in_place: takes_files(&fit.folder()).is_err(), ..fit })
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                if ends_in_separator || fit.target.file_name().is_none() {
                    return Err(fit.is_a_folder());
                }
                takes_files(&fit.folder()).map_err(|error| fit.failure(&error))?;
                Ok(fit)
            }
            Err(error) => Err(fit.failure(&error)),
        }
    }

    /// Writes the file: beside its place first, then renamed to it. A pipe's reader that has seen
    /// enough is no failure.
    ///
    /// # Errors
    /// One sentence with the path last; what was there before still is.
    pub fn write(&self, bytes: &[u8]) -> Result<(), String> {
        // What is read is known by now.
        self.refuse_what_was_read()?;
        let written = match &self.pipe {
            Some(pipe) => write_pipe(pipe, bytes),
            None if self.in_place => fs::write(&self.target, bytes),
            None => self.write_beside(bytes),
        };
        written.map_err(|error| self.failure(&error))
    }

    fn write_beside(&self, bytes: &[u8]) -> io::Result<()> {
        let (beside, mut file) = new_file(&self.folder())?;
        let written = file.write_all(bytes).and_then(|()| {
            drop(file);
            // A file that only its owner may read stays one.
            match fs::metadata(&self.target) {
                Ok(before) => fs::set_permissions(&beside, before.permissions())?,
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                Err(error) => return Err(error),
            }
            fs::rename(&beside, &self.target)
        });
        if written.is_err() {
            // What cannot be taken away again is all that can be left.
            drop(fs::remove_file(&beside));
        }
        written
    }

    /// Refuses a file that is a part of what is read, be it named or found by the one that is.
    fn refuse_what_was_read(&self) -> Result<(), String> {
        match was_read(&self.target) {
            false => Ok(()),
            true => Err(format!(
                "expected another place for {} than a file that was read, found one; choose another place: {}",
                self.what,
                self.path.display()
            )),
        }
    }

    fn folder(&self) -> PathBuf {
        folder_of(&self.target)
    }

    fn is_a_folder(&self) -> String {
        format!(
            "expected a file's name for {}, found that of a folder; choose another place: {}",
            self.what,
            self.path.display()
        )
    }

    fn no_reader(&self, error: &io::Error) -> String {
        format!(
            "expected somebody who reads the pipe that {} goes to, found nobody ({error}); start the \
             reader first, or name a file: {}",
            self.what,
            self.path.display()
        )
    }

    fn failure(&self, error: &io::Error) -> String {
        let (what, path) = (self.what, self.path.display());
        let folder = self.folder();
        // The nearest of the folders on the way that is there.
        let there = folder.ancestors().find_map(|on_the_way| {
            let here = if on_the_way.as_os_str().is_empty() { Path::new(".") } else { on_the_way };
            fs::metadata(here).ok().map(|found| (here, found.is_dir()))
        });
        match (error.kind(), there) {
            (ErrorKind::NotFound | ErrorKind::NotADirectory, Some((file, false))) => format!(
                "expected a folder to write {what} into, found that {} is a file; choose another \
                 place: {path}",
                file.display()
            ),
            (ErrorKind::NotFound, Some((found, true))) if found == folder => format!(
                "expected a folder to write {what} into, found one that takes no new files; choose \
                 another place: {path}"
            ),
            (ErrorKind::NotFound | ErrorKind::NotADirectory, _) => format!(
                "expected a folder to write {what} into, found none of that name; make it, or \
                 choose another place: {path}"
            ),
            _ => format!(
                "expected a place that {what} can be written to, found that the system refuses \
                 ({error}); choose another place: {path}"
            ),
        }
    }
}

#[cfg(unix)]
fn is_pipe(found: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    found.file_type().is_fifo()
}

#[cfg(not(unix))]
fn is_pipe(_: &fs::Metadata) -> bool {
    false
}

/// A pipe that somebody reads, opened to be written to; an error where nobody does, for which an
/// ordinary opening would wait.
fn open_pipe(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    options.write(true).open(path)
}

/// Writes all, waiting for the reader of a full pipe that was opened so as not to wait.
fn write_pipe(mut pipe: &File, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        match pipe.write(bytes) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(written) => bytes = &bytes[written..],
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                std::thread::sleep(Duration::from_millis(2));
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            // Whoever reads has seen enough.
            Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(()),
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Whether two names, of files that need not be there, are one place.
pub fn is_one_place(first: &Path, second: &Path) -> bool {
    let place = |path: &Path| {
        let target = behind_links(path);
        let folder = fs::canonicalize(folder_of(&target)).ok();
        folder.zip(target.file_name()).map_or_else(|| target.clone(), |(f, name)| f.join(name))
    };
    first == second || place(first) == place(second)
}

/// Where a path leads, also where nothing is there yet.
fn behind_links(path: &Path) -> PathBuf {
    if let Ok(target) = fs::canonicalize(path) {
        return target;
    }
    match fs::read_link(path) {
        // A link in a circle has no end, and opening it says so.
        Ok(next) if fs::metadata(path).is_err_and(|e| e.kind() == ErrorKind::NotFound) => {
            behind_links(&folder_of(path).join(next))
        }
        _ => path.to_owned(),
    }
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder.as_os_str().is_empty() => PathBuf::from("."),
        Some(folder) => folder.to_owned(),
        None => path.to_owned(),
    }
}

/// Makes a file in a folder and takes it away again.
fn takes_files(folder: &Path) -> io::Result<()> {
    let (path, _) = new_file(folder)?;
    fs::remove_file(path)
}

/// A new file with a name that nothing else has.
fn new_file(folder: &Path) -> io::Result<(PathBuf, File)> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = folder.join(format!(".voxsplat-{count}.part"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            opened => return opened.map(|file| (path, file)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn looking_changes_nothing_and_writing_leaves_one_whole_file() {
        let folder = tempfile::tempdir().unwrap();
        let (old, new) = (folder.path().join("old.json"), folder.path().join("new.json"));
        fs::write(&old, "before").unwrap();
        let files = [&old, &new].map(|path| OutputFile::check(path, "the table").unwrap());
        assert_eq!(names(folder.path()), ["old.json"]);
        assert_eq!(fs::read_to_string(&old).unwrap(), "before");
        for file in &files {
            file.write(b"after").unwrap();
        }
        assert_eq!(names(folder.path()), ["new.json", "old.json"]);
        for path in [&old, &new] {
            assert_eq!(fs::read_to_string(path).unwrap(), "after");
        }
    }

    #[test]
    fn places_that_cannot_be_written_to_are_refused_with_a_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "").unwrap();
        let long = "n".repeat(300);
        for (path, words) in [
            (folder.path().to_owned(), "found that of a folder"),
            (at("new.png/"), "found that of a folder"),
            (PathBuf::from(""), "found that of a folder"),
            (at("none/a.png"), "expected a folder"),
            (at("file/a.png"), "file is a file"),
            (at("file/b/c/a.png"), "file is a file"),
            (at("none/file/a.png"), "found none of that name"),
            #[cfg(target_os = "linux")]
            (PathBuf::from("/proc/a.png"), "takes no new files"),
            (at(&long), "the system refuses"),
        ] {
            let error = OutputFile::check(&path, "the picture").expect_err("refused");
            assert!(error.contains("the picture") && error.contains(words), "{path:?}: {error}");
            assert!(error.starts_with("expected ") && error.contains(", found "), "{error}");
            assert!(error.ends_with(&format!(": {}", path.display())), "{error}");
        }
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn a_folder_that_has_gone_meanwhile_is_a_sentence_too() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        fs::create_dir(&inner).unwrap();
        let file = OutputFile::check(&inner.join("a.png"), "the picture").unwrap();
        fs::remove_dir(&inner).unwrap();
        assert!(file.write(b"late").is_err_and(|error| error.contains("expected a folder")));
    }

    #[cfg(unix)]
    #[test]
    fn links_permissions_and_devices_stay_what_they_are() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("own"), "").unwrap();
        fs::set_permissions(at("own"), fs::Permissions::from_mode(0o600)).unwrap();
        symlink("own", at("link")).unwrap();
        symlink("later", at("dangling")).unwrap();
        symlink("circle", at("circle")).unwrap();
        for (name, target) in [("link", "own"), ("dangling", "later")] {
            OutputFile::check(&at(name), "the table").unwrap().write(b"new").unwrap();
            assert!(fs::symlink_metadata(at(name)).unwrap().is_symlink(), "{name}");
            assert_eq!(fs::read_to_string(at(target)).unwrap(), "new");
            assert!(is_one_place(&at(name), &at(target)));
        }
        assert_eq!(fs::metadata(at("own")).unwrap().permissions().mode() & 0o777, 0o600);
        assert!(OutputFile::check(&at("circle"), "the table").is_err());
        let null = Path::new("/dev/null");
        OutputFile::check(null, "the table").unwrap().write(b"gone").unwrap();
        assert!(!fs::metadata(null).unwrap().is_file());
    }

    #[test]
    fn one_place_may_have_several_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("inner")).unwrap();
        assert!(is_one_place(&at("a"), &at("inner/../a")));
        assert!(is_one_place(Path::new("a"), Path::new("./a")));
        assert!(!is_one_place(&at("a"), &at("b")) && !is_one_place(Path::new("a"), &at("a")));
    }
}

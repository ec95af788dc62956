//! The command line: flags to requests, results to files and exit codes.
//!
//! Owns the words scripts depend on. Refuses drawing and reading, which it asks for. Called by
//! `main` only.

mod accuracy;
mod encode;
mod flags;
mod flow;
mod info;
mod inside;
mod notes;
mod open;
mod plot;
mod polygons;
mod probe;
mod progress;
mod render;
mod report;
mod shading;
mod stats;
mod surface;
mod values;
mod vector_look;
mod vectors;

use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use clap::error::{ContextKind, ContextValue};

use crate::task::engines::Choice;
use crate::task::output_file::{OutputFile, is_one_place};
use crate::task::transfer_file::is_named_so;

pub use flags::{
    AccuracyFlags, Arguments, Command, InfoFlags, ProbeFlags, RenderFlags, SceneFlags, WindowFlags,
};

/// Threads that the environment may ask for.
const MOST_THREADS: u64 = 1024;

/// What went wrong, by whose fault.
#[derive(Debug)]
pub enum Failure {
    /// Flags that do not go together or cannot be read: exit 2.
    Usage(String),
    /// Everything else: exit 1.
    Failed(String),
}

impl Failure {
    fn failed(error: impl std::fmt::Display) -> Self {
        Self::Failed(error.to_string())
    }
}

/// Parses the command line, does what it says, and gives the exit code: 0 success, 1 failure with
/// one line on stderr, 2 wrong usage.
///
/// `window` opens the window; it is passed in because this room does not know the window's.
pub fn run(
    arguments: impl IntoIterator<Item = OsString>,
    window: impl FnOnce(WindowFlags, Choice) -> Result<(), String>,
) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            let error = with_short_value(error);
            // Help and version go to stdout and are no failure; a closed pipe is nobody's.
            return match error.print() {
                _ if error.use_stderr() => ExitCode::from(2),
                Err(refused) if refused.kind() != ErrorKind::BrokenPipe => {
                    say(&not_to_stdout("the help", &refused));
                    ExitCode::FAILURE
                }
                _ => ExitCode::SUCCESS,
            };
        }
    };
    if let Some(found) = too_many_threads(std::env::var("RAYON_NUM_THREADS").ok().as_deref()) {
        say(&format!(
            "expected at most {MOST_THREADS} threads in RAYON_NUM_THREADS, found {found}; leave it unset, and there are as \
             many as the processor has"
        ));
        return ExitCode::from(2);
    }
    let outcome = match arguments.command {
        None => open_window(arguments.window, window),
        Some(Command::Render(flags)) => render::run(&flags),
        Some(Command::Probe(flags)) => probe::run(&flags),
        Some(Command::Info(flags)) => info::run(&flags),
        Some(Command::Accuracy(flags)) => accuracy::run(&flags),
        Some(Command::Encode(flags)) => encode::encode(&flags),
        Some(Command::Convert(flags)) => encode::convert(&flags),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Usage(sentence)) => {
            say(&sentence);
            ExitCode::from(2)
        }
        Err(Failure::Failed(sentence)) => {
            say(&sentence);
            ExitCode::FAILURE
        }
    }
}

/// The same error, which quotes no more of a value than anybody reads.
fn with_short_value(mut error: clap::Error) -> clap::Error {
    if let Some(ContextValue::String(value)) = error.get(ContextKind::InvalidValue)
        && let Some((end, _)) = value.char_indices().nth(values::LONGEST)
    {
        let short = format!("{}…", &value[..end]);
        error.insert(ContextKind::InvalidValue, ContextValue::String(short));
    }
    error
}

/// Of a number that the environment asks for: so many that starting them would seem to hang.
fn too_many_threads(asked: Option<&str>) -> Option<u64> {
    asked.and_then(|asked| asked.trim().parse().ok()).filter(|asked| *asked > MOST_THREADS)
}

fn open_window(
    flags: WindowFlags,
    window: impl FnOnce(WindowFlags, Choice) -> Result<(), String>,
) -> Result<(), Failure> {
    let choice = flags.engine.choice()?;
    // The window tells what is wrong with a file; a wrong name is wrong usage here as anywhere.
    flags.files.iter().try_for_each(|file| open::check_name(file))?;
    if let Some(word) = flags.files.first().filter(|file| is_bare_word(file) && !file.exists()) {
        return Err(Failure::Usage(format!(
            "expected a file or one of the commands that `voxsplat --help` lists, found neither; check the \
             name: {}",
            word.display()
        )));
    }
    let is_of_transfer = |file: &PathBuf| is_named_so(file);
    if let Some(last) = flags.files.last().filter(|_| flags.files.iter().all(is_of_transfer)) {
        return Err(Failure::Usage(format!(
            "expected a volume that transfer functions are of, found none; name one beside \
             them, which may be demo:head: {}",
            last.display()
        )));
    }
    window(flags, choice).map_err(Failure::Failed)
}

/// Whether this may be meant as a command: letters alone.
fn is_bare_word(file: &Path) -> bool {
    file.to_str().is_some_and(|name| name.bytes().all(|byte| byte.is_ascii_lowercase()))
}

/// Where an outcome goes, found fit before the work begins.
#[derive(Debug)]
enum Destination {
    /// Standard output, and what goes there.
    Stdout(&'static str),
    File(OutputFile),
}

impl Destination {
    /// `-` is standard output; `what` is such as "the picture".
    fn check(path: &Path, what: &'static str) -> Result<Self, Failure> {
        if path == Path::new("-") { Ok(Self::Stdout(what)) } else { Self::file(path, what) }
    }

    fn file(path: &Path, what: &'static str) -> Result<Self, Failure> {
        OutputFile::check(path, what).map(Self::File).map_err(Failure::Failed)
    }

    fn write(&self, bytes: &[u8]) -> Result<(), Failure> {
        match self {
            Self::File(file) => file.write(bytes).map_err(Failure::Failed),
            Self::Stdout(what) => match to_stdout(bytes) {
                Ok(()) => Ok(()),
                // Whoever reads has seen enough.
                Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
                Err(error) => Err(Failure::Failed(not_to_stdout(what, &error))),
            },
        }
    }
}

fn not_to_stdout(what: &str, error: &std::io::Error) -> String {
    format!(
        "expected to write {what} to standard output, found that the system refuses ({error}); send it to another place"
    )
}

/// Refuses two names of one file, of which each would take the other's place.
fn refuse_one_place(named: &[(&str, Option<&Path>)]) -> Result<(), Failure> {
    for (i, (first, here)) in named.iter().enumerate() {
        for (second, there) in &named[i + 1..] {
            if let Some((here, there)) = here.zip(*there)
                && is_one_place(here, there)
            {
                return Err(Failure::Usage(format!(
                    "expected {first} and {second} to name two files, found one; rename one of \
                     them: {}",
                    there.display()
                )));
            }
        }
    }
    Ok(())
}

/// All at once: what is left in a buffer at the end would be lost without a word.
fn to_stdout(bytes: &[u8]) -> std::io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(bytes)?;
    stdout.flush()
}

/// One line on stderr.
fn say(sentence: &str) {
    // Where it cannot be written to, there is nobody left to tell.
    drop(writeln!(std::io::stderr(), "voxsplat: {}", one_line(sentence)));
}

/// One line on stderr that is no failure.
fn note(sentence: &str) {
    say(&format!("note: {sentence}"));
}

/// Names of files may hold anything; a message is one line all the same.
fn one_line(sentence: &str) -> String {
    let escape = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.into() };
    sentence.chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_whatever_a_file_is_called() {
        assert_eq!(one_line("no file: a\nb\u{1b}.nrrd é"), "no file: a\\nb\\u{1b}.nrrd é");
    }
}

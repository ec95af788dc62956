//! The command line: flags to requests, results to files and exit codes.
//!
//! Owns the words scripts depend on. Refuses drawing and reading, which it asks for. Called by
//! `main` only.

mod accuracy;
mod flags;
mod info;
mod open;
mod plot;
mod render;
mod report;
mod stats;
mod values;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;

pub use flags::{
    AccuracyFlags, Arguments, Command, InfoFlags, RenderFlags, SceneFlags, WindowFlags,
};

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
    window: impl FnOnce(WindowFlags) -> Result<(), String>,
) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version go to stdout and are no failure; a closed pipe is nobody's.
            drop(error.print());
            return if error.use_stderr() { ExitCode::from(2) } else { ExitCode::SUCCESS };
        }
    };
    let outcome = match arguments.command {
        None => window(arguments.window).map_err(Failure::Failed),
        Some(Command::Render(flags)) => render::run(&flags),
        Some(Command::Info(flags)) => info::run(&flags),
        Some(Command::Accuracy(flags)) => accuracy::run(&flags),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Usage(sentence)) => {
            eprintln!("voxsplat: {}", one_line(&sentence));
            ExitCode::from(2)
        }
        Err(Failure::Failed(sentence)) => {
            eprintln!("voxsplat: {}", one_line(&sentence));
            ExitCode::FAILURE
        }
    }
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

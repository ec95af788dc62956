//! The `voxsplat` program.

use std::process::ExitCode;

use voxsplat::app::document::Source;
use voxsplat::app::{self, Options};
use voxsplat::cli::{self, WindowFlags};

fn main() -> ExitCode {
    // What libraries log is for those who ask: a failure is one line.
    let env = env_logger::Env::default().default_filter_or("off,voxsplat=warn");
    env_logger::Builder::from_env(env).init();
    cli::run(std::env::args_os(), window)
}

fn window(flags: WindowFlags) -> Result<(), String> {
    let sources = flags.files.iter().map(|file| Source::of(file)).collect();
    let options = Options { sources, adapter: flags.adapter, trace: flags.trace };
    app::run(options).map_err(|error| error.to_string())
}

//! The `voxsplat` program.

use std::io::Write;
use std::process::ExitCode;

use env_logger::Env;
use voxsplat::app::document::Source;
use voxsplat::app::{self, Options};
use voxsplat::cli::{self, WindowFlags};

fn main() -> ExitCode {
    // Libraries log what is shown to people otherwise, or is no trouble at all.
    env_logger::Builder::from_env(Env::default().default_filter_or("off,voxsplat=warn")).init();
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map_or_else(String::new, ToString::to_string);
        // Where nobody can be told, there is no use in failing once more.
        drop(writeln!(
            std::io::stderr(),
            "voxsplat: expected to go on, found an error of its own; please report it: {place}"
        ));
    }));
    // The hook has said what there is to say.
    std::panic::catch_unwind(|| cli::run(std::env::args_os(), window)).unwrap_or(ExitCode::FAILURE)
}

fn window(flags: WindowFlags) -> Result<(), String> {
    let sources = flags.files.iter().map(|file| Source::of(file)).collect();
    let options = Options { sources, engine: flags.engine.choice(), trace: flags.trace };
    app::run(options).map_err(|error| error.to_string())
}

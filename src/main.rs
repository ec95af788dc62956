//! The `voxsplat` program.

use std::io::Write;
use std::process::ExitCode;

use env_logger::Env;
use voxsplat::app::document::Source;
use voxsplat::app::{self, Options};
use voxsplat::cli::{self, WindowFlags};
use voxsplat::core::panics;
use voxsplat::task::engines::Choice;

fn main() -> ExitCode {
    name_runtime_folder();
    // Libraries log what is shown to people otherwise, or is no trouble at all.
    let mut log =
        env_logger::Builder::from_env(Env::default().default_filter_or("off,voxsplat=warn"));
    if std::env::var_os("RUST_LOG").is_none() {
        // What is left is told to people.
        log.format(|to, record| writeln!(to, "voxsplat: note: {}", record.args()));
    }
    log.init();
    std::panic::set_hook(Box::new(|panic| {
        if panics::are_caught() {
            return;
        }
        let place = panic.location().map_or_else(String::new, ToString::to_string);
        let found = match place.contains("winit") {
            // It takes the answers of a display server for granted.
            true => {
                "expected a display that stays, found that the window or its server has gone; open the file again"
            }
            false => "expected to go on, found an error of its own; please report it",
        };
        // Where nobody can be told, there is no use in failing once more.
        drop(writeln!(std::io::stderr(), "voxsplat: {found}: {place}"));
    }));
    // The hook has said what there is to say.
    std::panic::catch_unwind(|| cli::run(std::env::args_os(), window)).unwrap_or(ExitCode::FAILURE)
}

/// Names the folder of the user's sockets where the environment does not: libwayland, which Vulkan's loader asks for a screen
/// even where none is wanted, would write among the program's own words that it is missing.
#[cfg(target_os = "linux")]
fn name_runtime_folder() {
    use std::os::unix::fs::MetadataExt;

    let is_named = |name: &str| {
        std::env::var_os(name).is_some_and(|value| value.as_encoded_bytes().starts_with(b"/"))
    };
    if is_named("XDG_RUNTIME_DIR") {
        return;
    }
    let Ok(own) = std::fs::metadata("/proc/self") else { return };
    // Where login sessions have it; that it is not there is no trouble.
    let folder = format!("/run/user/{}", own.uid());
    #[expect(unsafe_code, reason = "the environment is all that libwayland looks at")]
    // SAFETY: the program has begun a moment ago, and has no other thread.
    unsafe {
        std::env::set_var("XDG_RUNTIME_DIR", folder);
    }
}

#[cfg(not(target_os = "linux"))]
fn name_runtime_folder() {}

fn window(flags: WindowFlags, engine: Choice) -> Result<(), String> {
    let sources = flags.files.iter().map(|file| Source::of(file)).collect();
    let options = Options { sources, engine, moving: flags.moving, trace: flags.trace };
    app::run(options).map_err(|error| error.to_string())
}

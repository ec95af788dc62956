//! What tests of the command line share: starting the program, and whether it can draw here.

use std::process::{Command, Output};

use voxsplat::gpu::{AdapterChoice, Context, Wishes};

/// The program with these arguments, away from any display.
pub(crate) fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_voxsplat"));
    command
        .args(arguments)
        .env_remove("RUST_LOG")
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        // Without one, libwayland writes to stderr whenever a Vulkan driver looks for a screen.
        .env("XDG_RUNTIME_DIR", std::env::temp_dir());
    command
}

/// What the program did, to its end.
pub(crate) fn voxsplat(arguments: &[&str]) -> Output {
    let output = program(arguments).output().expect("the program starts");
    let errors = errors(&output);
    assert!(!errors.contains("panicked") && !errors.contains("RUST_BACKTRACE"), "{errors}");
    output
}

/// What it wrote to stderr.
pub(crate) fn errors(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// Whether pictures can be drawn here; says that `what` was skipped where not and that is allowed.
pub(crate) fn can_draw(what: &str) -> bool {
    match Context::new(&AdapterChoice::Auto, Wishes::default()) {
        Ok(_) => true,
        Err(error) if std::env::var("VOXSPLAT_GPU").is_ok_and(|v| v == "allow-skip") => {
            println!("skipped {what}: {error}");
            false
        }
        Err(error) => panic!("{error} (or set VOXSPLAT_GPU=allow-skip)"),
    }
}

//! The `voxsplat` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    env_logger::init();
    voxsplat::cli::run(std::env::args_os(), |_| Err("the window is not wired yet".to_owned()))
}

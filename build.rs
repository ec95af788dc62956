//! Asks the linker to keep one of functions that compile to the same code: a fiftieth of the program is such copies.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let is = |key: &str, value: &str| env::var(key).is_ok_and(|found| found == value);
    // There Rust links with its own lld, which can; other systems' linkers may not know the word.
    let links_by_lld = is("CARGO_CFG_TARGET_ARCH", "x86_64")
        && is("CARGO_CFG_TARGET_OS", "linux")
        && is("CARGO_CFG_TARGET_ENV", "gnu");
    // A profiler tells functions apart by their places.
    if links_by_lld && is("PROFILE", "release") && is("DEBUG", "false") {
        println!("cargo::rustc-link-arg-bins=-Wl,--icf=all");
    }
}

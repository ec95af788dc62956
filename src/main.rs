//! The `voxsplat` program.

fn main() {}

//! Files that are named on the command line, and how they open.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use voxsplat::core::Ticket;
use voxsplat::io::{self, OpenOptions};
use voxsplat::scene::{self, SampleSource, Scene};
use voxsplat::volume::{Component, demo};

/// Files of the data pack: `VOXSPLAT_DATA`, or `../shared/data`.
pub(crate) fn data() -> PathBuf {
    std::env::var_os("VOXSPLAT_DATA").map_or(PathBuf::from("../shared/data"), PathBuf::from)
}

/// What was named.
pub(crate) fn named() -> Vec<PathBuf> {
    // Cargo's own flags are none of ours.
    let named = std::env::args_os().skip(1);
    named.filter(|arg| !arg.to_string_lossy().starts_with("--")).map(PathBuf::from).collect()
}

/// The first field of a file, or of `demo:NAME`, as it opens.
pub(crate) fn open(path: &Path) -> Result<Scene, String> {
    let grid = match path.to_str().filter(|name| name.starts_with("demo:")) {
        Some(name) => demo::open(name, None).map_err(|e| e.to_string())?,
        None => {
            let opened = io::open(path, &OpenOptions::default(), &Ticket::new());
            opened.map_err(|e| e.to_string())?.grid
        }
    };
    let field = grid.field(None).map_err(|e| e.to_string())?;
    let component = Component::usual(field.components);
    let volume = grid.scalar(field, component, &Ticket::new()).map_err(|e| e.to_string())?;
    Ok(scene::opening(SampleSource::default(), Arc::new(volume), grid.space.as_deref()))
}

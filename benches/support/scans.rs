//! The scans that are measured: three of `VOXSPLAT_DATA` (default `../shared/data`), or the files named.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use voxsplat::core::Ticket;
use voxsplat::io::{self, OpenOptions};
use voxsplat::scene::{self, SampleSource, Scene};
use voxsplat::task::draw::Drawer;
use voxsplat::volume::Component;

const SCANS: [&str; 3] = ["scalar/aneurism.vti", "scalar/bonsai.vti", "scalar/LIDC2.vti"];

/// Linear premultiplied RGBA, rows from the top.
pub(crate) type Light = Vec<[f64; 4]>;

/// Each scan by its name, as it opens; says which are left out.
pub(crate) fn scans() -> Vec<(String, Scene)> {
    let data =
        std::env::var_os("VOXSPLAT_DATA").map_or(PathBuf::from("../shared/data"), PathBuf::from);
    // Cargo's own flags are none of ours.
    let named: Vec<PathBuf> = std::env::args_os()
        .skip(1)
        .filter(|arg| !arg.to_string_lossy().starts_with("--"))
        .map(PathBuf::from)
        .collect();
    let files = if named.is_empty() { SCANS.map(|scan| data.join(scan)).to_vec() } else { named };
    let mut scans = Vec::new();
    for file in files {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match open(&file) {
            Ok(scene) => scans.push((name, scene)),
            Err(reason) => eprintln!("skipped {}: {reason}", file.display()),
        }
    }
    scans
}

fn open(path: &Path) -> Result<Scene, String> {
    let opened =
        io::open(path, &OpenOptions::default(), &Ticket::new()).map_err(|e| e.to_string())?;
    let field = opened.grid.field(None).map_err(|e| e.to_string())?;
    let component = if field.components == 1 { Component::Index(0) } else { Component::Magnitude };
    let volume = opened.grid.scalar(field, component, &Ticket::new()).map_err(|e| e.to_string())?;
    Ok(scene::opening(SampleSource::default(), Arc::new(volume), opened.grid.space.as_deref()))
}

/// The picture that was drawn last.
pub(crate) fn light(drawer: &mut Drawer) -> Light {
    let light = drawer.engines.gpu().expect("a device").read_light().expect("it reads back");
    light.iter().map(|pixel| pixel.map(f64::from)).collect()
}

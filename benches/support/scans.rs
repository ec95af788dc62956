//! The scans that are measured: three of `VOXSPLAT_DATA` (default `../shared/data`), or the files named.

#[path = "files.rs"]
mod files;

use voxsplat::scene::Scene;
use voxsplat::task::draw::Drawer;

use files::{data, named, open};

const SCANS: [&str; 3] = ["scalar/aneurism.vti", "scalar/bonsai.vti", "scalar/LIDC2.vti"];

/// Linear premultiplied RGBA, rows from the top.
pub(crate) type Light = Vec<[f64; 4]>;

/// Each scan by its name, as it opens; says which are left out.
pub(crate) fn scans() -> Vec<(String, Scene)> {
    let (data, named) = (data(), named());
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

/// The picture that was drawn last.
pub(crate) fn light(drawer: &mut Drawer) -> Light {
    let light = drawer.engines.gpu().expect("a device").read_light().expect("it reads back");
    light.iter().map(|pixel| pixel.map(f64::from)).collect()
}

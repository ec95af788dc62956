//! The scenes that other programs draw, too (`benches/peers/vtk_previews.py`): three scans of `VOXSPLAT_DATA`
//! (default `../shared/data`); or the files named, as they open.

#[path = "files.rs"]
mod files;

use glam::DVec3;
use voxsplat::core::{Camera, Srgb8};
use voxsplat::scene::{Background, Scene, SplatSettings};
use voxsplat::transfer::{ColourSource, TransferFunction};

pub(crate) use files::{data, named, open};

const DIRECTION: DVec3 = DVec3::new(0.45, 0.75, -0.48);
const SCALE: f64 = 0.38;

type Points<'a> = &'a [(f64, f64)];
type Colours<'a> = &'a [(f64, u32)];
const SCANS: [(&str, Points<'_>, Colours<'_>); 3] = [
    (
        "aneurism",
        &[(40.0, 0.0), (110.0, 0.25), (255.0, 0.8)],
        &[(40.0, 0x8c1f16), (140.0, 0xe08a4c), (255.0, 0xfff3e0)],
    ),
    (
        "LIDC2",
        &[(60.0, 0.0), (120.0, 0.02), (170.0, 0.25), (255.0, 0.7)],
        &[(60.0, 0x304a8c), (130.0, 0xc8705c), (200.0, 0xf0d8b0), (255.0, 0xffffff)],
    ),
    (
        "bonsai",
        &[(25.0, 0.0), (45.0, 0.06), (90.0, 0.1), (150.0, 0.5), (255.0, 0.8)],
        &[(25.0, 0x2c6e2c), (70.0, 0x7ab04a), (120.0, 0x9c6a3c), (255.0, 0xf4e4c8)],
    ),
];

/// Each by its name; says which are left out.
pub(crate) fn scenes() -> Vec<(String, Scene)> {
    let (data, named) = (data(), named());
    let mut scenes = Vec::new();
    let mut take = |name: String, found: Result<Scene, String>| match found {
        Ok(scene) => scenes.push((name, scene)),
        Err(reason) => eprintln!("skipped {name}: {reason}"),
    };
    for file in &named {
        take(file.display().to_string(), open(file));
    }
    if named.is_empty() {
        for (name, opacity, colours) in SCANS {
            let path = data.join("scalar").join(format!("{name}.vti"));
            take(name.to_owned(), open(&path).map(|scene| as_peers(scene, opacity, colours)));
        }
    }
    scenes
}

fn as_peers(mut scene: Scene, opacity: Points<'_>, colours: Colours<'_>) -> Scene {
    let stops = colours.iter().map(|&(value, code)| {
        let [_, r, g, b] = code.to_be_bytes();
        (value, Srgb8([r, g, b]))
    });
    let stops = ColourSource::Stops(stops.collect());
    *scene.transfer_mut().expect("a field") = TransferFunction::of(opacity.to_vec(), stops);
    let lattice = &scene.lattice();
    let extent = DVec3::from_array(lattice.dims.map(|n| n as f64)) * lattice.spacing;
    scene.camera = Camera::new(lattice.centre(), DIRECTION, DVec3::Z, SCALE * extent.length());
    scene.background = Background::Transparent;
    scene.splat = SplatSettings::EXACT;
    scene
}

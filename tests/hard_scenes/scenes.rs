//! Small scenes, and the comparator that holds their pictures to the reference.

use std::sync::Arc;

use glam::DVec3;
use voxsplat::accuracy::Difference;
use voxsplat::core::{Projection, Srgb8};
use voxsplat::kernel::Kernel;
use voxsplat::reference::{Rays, every_sample, grid_kernels};
use voxsplat::scene::{
    Background, Layer, Look, SampleSource, Sampled, Scene, SplatSettings, framing_camera,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::transfer::{ColourSource, TransferFunction};
use voxsplat::volume::{Lattice, Samples, ScalarVolume};

use crate::support::{DRAWS_TRIANGLES, drawn};

/// Wide enough for overlaps of every kind, small enough for a float64 reference.
pub(crate) const SIZE: [u32; 2] = [96, 80];

pub(crate) type Light = Vec<[f64; 4]>;

/// Uniform in 0..1, the same on every machine (SplitMix64, by index).
pub(crate) fn random(seed: u64, index: usize) -> f64 {
    let mut z = (seed << 32 ^ index as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Noise over 0..=255: neighbours have nothing in common, so that every mistake in order shows.
pub(crate) fn noise(dims: [usize; 3], seed: u64) -> Samples {
    let count = dims.iter().product();
    Samples::UInt8((0..count).map(|i| (random(seed, i) * 255.99) as u8).collect())
}

/// Clear below 90, then ever more opaque; red, green, blue.
pub(crate) fn transfer() -> TransferFunction {
    TransferFunction::of(
        vec![(90.0, 0.0), (160.0, 0.3), (255.0, 0.9)],
        ColourSource::Stops(vec![
            (90.0, Srgb8([255, 20, 0])),
            (170.0, Srgb8([30, 240, 60])),
            (255.0, Srgb8([10, 40, 255])),
        ]),
    )
}

/// The usual transfer function with its values moved: v becomes v · scale + offset.
pub(crate) fn moved(scale: f64, offset: f64) -> TransferFunction {
    let mut transfer = transfer();
    transfer.opacity.iter_mut().for_each(|(v, _)| *v = *v * scale + offset);
    if let ColourSource::Stops(stops) = &mut transfer.colour {
        stops.iter_mut().for_each(|(v, _)| *v = *v * scale + offset);
    }
    transfer
}

pub(crate) fn volume(lattice: Lattice, samples: Samples) -> Arc<ScalarVolume> {
    Arc::new(ScalarVolume::from_samples("test", lattice, samples).expect("a sound volume"))
}

/// Noise on a lattice, seen along `direction`, a little off the middle.
pub(crate) fn scene(lattice: Lattice, direction: DVec3) -> Scene {
    let mut camera = framing_camera(&lattice, direction, DVec3::new(0.1, 0.9, 0.3));
    camera.focal_point += camera.up * (0.013 * camera.parallel_scale);
    let field = Sampled::Volume(volume(lattice, noise(lattice.dims, 7)));
    Scene {
        splat: SplatSettings::SHADE_FIRST,
        background: Background::Colour(Srgb8::BLACK),
        ..Scene::seen_by(camera).with((field, Look::Field(transfer())))
    }
}

/// With other values in the place of its own, seen as those were.
pub(crate) fn with_field(mut scene: Scene, volume: Arc<ScalarVolume>) -> Scene {
    let is_field = |layer: &Layer| matches!(layer.look, Look::Field(_));
    let at = scene.layers.iter().position(is_field).expect("a field");
    let Layer { is_shown, look, .. } = scene.layers[at].clone();
    scene.replace(at, SampleSource::default(), (Sampled::Volume(volume), look));
    scene.layers[at].is_shown = is_shown;
    scene
}

/// Its opacities and colours, to be changed.
pub(crate) fn transfer_of(scene: &mut Scene) -> &mut TransferFunction {
    scene.transfer_mut().expect("a field")
}

pub(crate) fn with_transfer(mut scene: Scene, transfer: TransferFunction) -> Scene {
    *transfer_of(&mut scene) = transfer;
    scene
}

pub(crate) fn with_kernel(mut scene: Scene, kernel: Kernel) -> Scene {
    scene.splat.kernel = kernel;
    scene
}

/// The same view through an eye, at a full vertical angle in degrees.
pub(crate) fn in_perspective(mut scene: Scene, degrees: f64) -> Scene {
    scene.camera.projection = Projection::Perspective { view_angle: degrees.to_radians() };
    scene
}

pub(crate) fn wide(light: &[[f32; 4]]) -> Light {
    light.iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// The reference's picture.
pub(crate) fn reference(scene: &Scene, size: [u32; 2], rays: Rays) -> Light {
    let size = size.map(|n| n as usize);
    let SplatSettings { kernel, extent, .. } = scene.splat;
    every_sample(&grid_kernels(scene), kernel, extent, &scene.camera, size, rays)
}

/// How far two pictures may be apart; see the module's head for the machine.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Within {
    pub(crate) max_abs: f64,
    pub(crate) rmse: f64,
    pub(crate) bias: f64,
}

impl Within {
    /// Of triangles. Hardware snaps their corners to 1/256 of a pixel before it interpolates, which software adapters do
    /// not; off by so much more on an H100 and an H200: max 2.3e-3, rmse 1.7e-4 (boxes).
    pub(crate) fn of_triangles(self) -> Self {
        if !DRAWS_TRIANGLES || !voxsplat::gpu::has_hardware() {
            return self;
        }
        let Self { max_abs, rmse, bias } = self;
        Self { max_abs: max_abs + 3e-3, rmse: rmse + 2.5e-4, bias: bias + 5e-6 }
    }
}

/// What is out of bounds between a picture and its reference, in words; `None` where nothing is.
pub(crate) fn fault(found: &[[f64; 4]], expected: &[[f64; 4]], within: Within) -> Option<String> {
    let difference = match Difference::between(found, expected) {
        Ok(difference) => difference,
        Err(error) => return Some(error.to_string()),
    };
    let most = expected.iter().map(|p| p[3]).fold(0.0, f64::max);
    let bounds = [
        ("greatest difference", difference.max_abs, within.max_abs),
        ("rmse", difference.rmse, within.rmse),
        ("bias", difference.mean_brightness.abs(), within.bias),
    ];
    let exceeded: Vec<String> = bounds
        .iter()
        .filter(|(_, found, bound)| found > bound)
        .map(|(what, found, bound)| format!("{what} {found:.3e} over {bound:.1e}"))
        .collect();
    (!exceeded.is_empty())
        .then(|| format!("{} (greatest alpha {most:.3}; {difference:?})", exceeded.join(", ")))
}

/// Draws a scene at `full` and holds it to the reference; the picture must show something.
#[track_caller]
pub(crate) fn agrees(drawer: &mut Drawer, name: &str, scene: &Scene, within: Within) {
    let expected = reference(scene, SIZE, Rays::Local);
    let most = expected.iter().map(|p| p[3]).fold(0.0, f64::max);
    assert!(most > 0.0, "{name}: the reference is empty");
    let (found, _) = drawn(drawer, scene, SIZE, Rung::Full);
    print_measured(name, &found, &expected);
    assert_eq!(fault(&found, &expected, within), None, "{name}");
}

/// One line for the table of measured errors (`cargo test --test gpu --test native -- --nocapture`).
pub(crate) fn print_measured(name: &str, found: &[[f64; 4]], expected: &[[f64; 4]]) {
    if let Ok(d) = Difference::between(found, expected) {
        println!(
            "measured {name}: max {:.2e}, rmse {:.2e}, bias {:+.2e}",
            d.max_abs, d.rmse, d.mean_brightness
        );
    }
}

#[test]
fn the_comparator_refuses_what_differs_and_what_cannot_be_compared() {
    let within = Within { max_abs: 1e-3, rmse: 1e-3, bias: 1e-4 };
    let grey = vec![[0.5, 0.5, 0.5, 1.0]; 8];
    assert_eq!(fault(&grey, &grey, within), None);
    let mut spot = grey.clone();
    spot[3][3] = 0.9;
    assert!(fault(&spot, &grey, within).is_some_and(|f| f.contains("greatest difference")));
    let dark: Light = grey.iter().map(|p| p.map(|c| c - 5e-4)).collect();
    assert!(fault(&dark, &grey, within).is_some_and(|f| f.contains("bias")), "a slight veil");
    let noisy: Light =
        (0..8).map(|i| grey[i].map(|c| c + if i % 2 == 0 { 2e-3 } else { -2e-3 })).collect();
    assert!(fault(&noisy, &grey, within).is_some_and(|f| f.contains("rmse")));
    assert!(fault(&grey[1..], &grey, within).is_some());
    let mut wild = grey.clone();
    wild[0][0] = f64::NAN;
    assert!(fault(&wild, &grey, within).is_some());
}

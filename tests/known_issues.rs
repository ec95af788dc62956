//! What is known not to hold yet, as expected failures.
//!
//! Each is a test that states the claim, bears `#[should_panic(expected = "…")]` with the words in
//! which it fails today, and names its issue. The change that makes the claim true turns it into an
//! ordinary test beside the code.

use std::sync::Arc;

use glam::DVec3;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::gpu::{AdapterChoice, Context, Renderer, Wishes};
use voxsplat::scene::{Background, Scene, SplatSettings, Visibility, framing_camera};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::transfer::{ColourMap, ColourSource, Table, TransferFunction};
use voxsplat::volume::{Lattice, Samples, ScalarType, ScalarVolume};

fn extinction(function: &TransferFunction, value: f64) -> f32 {
    Table::new(function, ScalarType::Float32).lookup(value)[3]
}

/// Float tables spread their entries over opacities and colours together, so that a colour range
/// 10³⁰ times wider than the opacities leaves one entry for all of them.
#[test]
#[should_panic(expected = "a colour range hides what has opacity")]
fn opacities_of_floats_do_not_depend_on_the_colour_range() {
    let function = TransferFunction {
        opacity: vec![(0.0, 0.0), (1.0, 0.5), (2.0, 0.0)],
        colour: ColourSource::Map { map: ColourMap::Viridis, range: [-1e30, 1e30] },
    };
    assert!(extinction(&function, 1.0) > 0.0, "a colour range hides what has opacity");
}

/// The loops of one invocation seem to go round 65 535 times on llvmpipe, all together; then they
/// end, and what lies behind is lost. Shade-first layers of a ray through thousands of slices need more, and
/// so would very fine slabs or wide kernels. Issue 3.
#[test]
#[should_panic(expected = "layers are missing")]
fn thousands_of_shade_first_slabs_have_the_alpha_of_their_slices() {
    let context = Context::new(&AdapterChoice::Software, Wishes::default()).expect("a device");
    let mut drawer = Drawer::new(Renderer::new(context));
    let lattice = Lattice::unit([1, 1, 4096]);
    let samples = Samples::UInt8(vec![200; 4096]);
    let mut scene = Scene {
        volume: Arc::new(ScalarVolume::from_samples("long", lattice, samples).expect("sound")),
        transfer: TransferFunction {
            opacity: vec![(0.0, 2e-4)],
            colour: ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 255.0] },
        },
        splat: SplatSettings { visibility: Visibility::Sheets, ..SplatSettings::SHADE_FIRST },
        camera: framing_camera(&lattice, DVec3::Z, DVec3::Y),
        background: Background::Colour(Srgb8::BLACK),
    };
    let mut alpha = |scene: &Scene| {
        drawer.prepare(scene, &Ticket::new()).expect("the device prepares");
        drawer.draw(scene, [4, 4], Rung::Full, &mut ()).expect("the device draws");
        drawer.renderer.read_light().expect("the device reads back")[5][3]
    };
    let sheets = alpha(&scene);
    scene.splat.visibility = Visibility::Slabs;
    let slabs = alpha(&scene);
    assert!((sheets - slabs).abs() < 1e-4, "layers are missing: {sheets} {slabs}");
}

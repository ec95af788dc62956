//! What is known not to hold yet, as expected failures.
//!
//! Each is a test that states the claim, bears `#[should_panic(expected = "…")]` with the words in
//! which it fails today, and names its issue. The change that makes the claim true turns it into an
//! ordinary test beside the code.

use std::sync::Arc;

use voxsplat::core::{Projection, Ticket};
use voxsplat::kernel::Kernel;
use voxsplat::reference::Reference;
use voxsplat::scene::{self, SampleSource, SplatSettings, Visibility};
use voxsplat::task::engine::{Engine, EngineChoice};
use voxsplat::task::still::{Refine, StillRequest};
use voxsplat::transfer::{ColourMap, ColourSource, Cumulative, Table, TransferFunction, Weight};
use voxsplat::volume::{Component, Samples, ScalarType, Statistics, demo};

fn extinction(function: &TransferFunction, value: f64) -> f32 {
    Table::new(function, ScalarType::Float32).lookup(value)[3]
}

/// Float tables spread their entries over opacities and colours together, so that a colour range
/// 10³⁰ times wider than the opacities leaves one entry for all of them.
#[test]
#[should_panic(expected = "a colour range hides what has opacity")]
fn opacities_of_floats_do_not_depend_on_the_colour_range() {
    let function = TransferFunction::of(
        vec![(0.0, 0.0), (1.0, 0.5), (2.0, 0.0)],
        ColourSource::Map { map: ColourMap::Viridis, range: [-1e30, 1e30] },
    );
    assert!(extinction(&function, 1.0) > 0.0, "a colour range hides what has opacity");
}

/// Tables and cells are never narrower than 1e-30 · 2⁻²², and 32-bit devices flush what lies below
/// 1.2e-38: data wholly down there are one value. `io::open` tells of such fields.
#[test]
#[should_panic(expected = "denormals are all the same")]
fn values_that_lie_wholly_below_the_least_normal_float_are_told_apart() {
    let unit = 1e-41;
    let function = TransferFunction::of(
        vec![(0.0, 0.0), (200.0 * unit, 0.5)],
        ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 200.0 * unit] },
    );
    let samples = Samples::Float32((0..200_u8).map(|i| f32::from(i) * 1e-41).collect());
    let statistics = Statistics::of(&samples, &Ticket::new()).expect("finite values");
    let integrated =
        Cumulative::new(&function, ScalarType::Float32, &statistics, Weight::Extinction);
    let cells = |value: f64| (value - integrated.low) * integrated.scale;
    let [low, high] = [20.0, 180.0].map(|v| extinction(&function, v * unit));
    let told_apart = high > low && cells(180.0 * unit) - cells(20.0 * unit) > 100.0;
    assert!(told_apart, "denormals are all the same");
}

/// In sheets with the eye among samples, boxes are off in both engines, at different pixels; why is not known. Smooth
/// kernels are not. Issue 21.
#[test]
#[should_panic(expected = "boxes about the eye are not those of the reference")]
fn boxes_in_sheets_about_the_eye_are_those_of_the_reference() {
    let grid = demo::open("demo:head:24", None).expect("a demo");
    let field = grid.field(None).expect("a field");
    let volume = grid.scalar(field, Component::Index(0), &Ticket::new()).expect("a volume");
    let mut scene = scene::opening(SampleSource::default(), Arc::new(volume), None);
    scene.camera.projection = Projection::Perspective { view_angle: 2.1 };
    scene.camera.parallel_scale = 1.0;
    let (visibility, kernel) = (Visibility::Sheets, Kernel::Nearest);
    scene.splat = SplatSettings { visibility, kernel, ..SplatSettings::SHADE_FIRST };
    let size = [36, 24];
    let truth = Reference::new(&scene, size.map(|n| n as usize)).expect("a mode").picture();
    let engine = Engine::start(EngineChoice::Native, || ());
    let refine = Refine::Full;
    let request = StillRequest { scene, size, refine, repeat: 0, time_passes: false };
    let found = engine.still(request, &Ticket::new()).expect("a picture").light;
    let off = found.iter().zip(&truth).map(|(a, b)| (f64::from(a[3]) - b[3]).abs());
    let most = off.fold(0.0, f64::max);
    println!("measured boxes about the eye: {most:.1e}");
    assert!(most < 1e-2, "boxes about the eye are not those of the reference");
}

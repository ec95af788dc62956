//! What is known not to hold yet, as expected failures.
//!
//! Each is a test that states the claim, bears `#[should_panic(expected = "…")]` with the words in
//! which it fails today, and names its issue. The change that makes the claim true turns it into an
//! ordinary test beside the code.

use std::sync::Arc;

use glam::DVec3;
use voxsplat::core::{Camera, Ticket};
use voxsplat::gpu::AdapterChoice;
use voxsplat::reference::Reference;
use voxsplat::scene::{Background, Inside, Scene, Shading, SplatSettings, Visibility};
use voxsplat::task::engine::Engine;
use voxsplat::task::still::{Refine, StillError, StillRequest};
use voxsplat::transfer::{ColourMap, ColourSource, Cumulative, Table, TransferFunction, Weight};
use voxsplat::volume::{Lattice, Samples, ScalarType, ScalarVolume, Statistics};

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
/// 1.2e-38: data wholly down there are one value. Issue 3.
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

/// Opaque matter seen in parallel: every voxel of a ball in `lattice`, or of all of it.
fn opaque(lattice: Lattice, is_ball: bool, direction: DVec3, parallel_scale: f64) -> Scene {
    let half = DVec3::from_array(lattice.dims.map(|n| n as f64)) / 2.0;
    let [width, height, _] = lattice.dims;
    let sample = |i: usize| {
        let at = [i % width, i / width % height, i / (width * height)].map(|n| n as f64 + 0.5);
        let inside = ((DVec3::from_array(at) - half) / half).length() < 1.0;
        if inside || !is_ball { 255 } else { 0 }
    };
    let samples = Samples::UInt8((0..lattice.len()).map(sample).collect());
    let volume = ScalarVolume::from_samples("ball", lattice, samples).expect("a volume");
    Scene {
        camera: Camera::new(lattice.centre(), direction, DVec3::Z, parallel_scale),
        volume: Arc::new(volume),
        transfer: TransferFunction::of(
            vec![(0.0, 0.0), (255.0, 0.95)],
            ColourSource::Map { map: ColourMap::Gray, range: [0.0, 255.0] },
        ),
        splat: SplatSettings::SHADE_FIRST,
        background: Background::Transparent,
        shading: Shading::default(),
        inside: Inside::default(),
        vectors: None,
    }
}

/// The area that a picture covers, over that of 8 × 8 rays a pixel of the reference; `None` where
/// there is nothing to draw with.
fn area_ratio(scene: &Scene, size: [u32; 2]) -> Option<f64> {
    let engine = Engine::start(AdapterChoice::Auto, || ());
    let request = StillRequest {
        scene: scene.clone(),
        size,
        refine: Refine::Full,
        repeat: 0,
        time_passes: false,
    };
    let still = match engine.still(request, &Ticket::new()) {
        Ok(still) => still,
        Err(StillError::Gpu(error))
            if std::env::var("VOXSPLAT_GPU").is_ok_and(|v| v == "allow-skip") =>
        {
            println!("skipped a known issue: {error}");
            return None;
        }
        Err(error) => panic!("{error} (or set VOXSPLAT_GPU=allow-skip)"),
    };
    let found: f64 = still.light.iter().map(|pixel| f64::from(pixel[3])).sum();
    let truth = Reference::supersampled(scene, size.map(|n| n as usize), 8, false).expect("a mode");
    let expected: f64 = truth.picture().iter().map(|pixel| pixel[3]).sum();
    assert!(expected > 0.1, "nothing to see");
    println!("measured {:?}: {found:.2} of {expected:.2} pixels", scene.splat.visibility);
    Some(found / expected)
}

/// Modes that shade first take one ray a pixel (tiles), or widen kernels to a pixel, with the same
/// optical depth and so with more light where they are opaque (triangles). Reconstructed slabs are
/// averaged over up to 8 × 8 rays; these need the same.
#[test]
#[should_panic(expected = "kernels narrower than a pixel are not averaged over it")]
fn kernels_narrower_than_a_pixel_have_the_light_that_they_cover() {
    let lattice = Lattice { spacing: DVec3::new(1.0, 1.0, 1000.0), ..Lattice::unit([64, 64, 4]) };
    let mut off = Vec::new();
    for visibility in [Visibility::EverySample, Visibility::Sheets, Visibility::Slabs] {
        let mut scene = opaque(lattice, false, DVec3::new(0.4, 0.9, -0.1), 2200.0);
        scene.splat.visibility = visibility;
        let Some(ratio) = area_ratio(&scene, [24, 20]) else { continue };
        off.push((ratio - 1.0).abs());
    }
    let far = off.iter().any(|off| *off > 0.1) || off.is_empty();
    assert!(!far, "kernels narrower than a pixel are not averaged over it: off by {off:?}");
}

/// Octree nodes a pixel wide stand in for smaller voxels, and reach a pixel beyond them: opaque things
/// of a few pixels grow.
#[test]
#[should_panic(expected = "far things are too large")]
fn opaque_things_far_away_are_no_larger_than_they_are() {
    let scene = opaque(Lattice::unit([32; 3]), true, DVec3::new(0.3, 0.9, -0.2), 64.0);
    let ratio = area_ratio(&scene, [36, 36]);
    assert!(ratio.is_some_and(|ratio| ratio < 1.05), "far things are too large: {ratio:?}");
}

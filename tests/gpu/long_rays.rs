//! Rays whose loops turn more often than a software adapter lets them: their pictures are refused in one sentence,
//! and never drawn short of what such rays would have met.

use glam::DVec3;
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    Classify, MOST_SLABS_PER_VOXEL, OpacityModel, Order, Reconstruction, Scene, SplatSettings,
    Visibility,
};
use voxsplat::task::draw::Drawer;
use voxsplat::task::engines::EngineKind;
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction};
use voxsplat::volume::{Lattice, Samples};

use crate::hard_scenes::{EXACT, SHADED};
use crate::support::*;

const SIZE: [u32; 2] = [6, 5];

/// 4096 voxels in a row, noise, seen along the row: a thin veil each.
fn row(splat: SplatSettings) -> Scene {
    let mut scene = scene(Lattice::unit([1, 1, 4096]), DVec3::Z);
    scene.camera.parallel_scale = 1.3;
    transfer_of(&mut scene).opacity = vec![(0.0, 0.0), (255.0, 2e-3)];
    scene.splat = splat;
    scene
}

/// Draws the row in a mode; says what is out of bounds, of what is drawn.
fn held(name: &str, splat: SplatSettings, within: Within) -> Option<String> {
    let scene = row(splat);
    let reference = Reference::new(&scene, SIZE.map(|n| n as usize));
    let expected = reference.expect("a mode that means something").picture();
    let (found, _) = drawn_or_refused(&mut drawer().expect("a device"), &scene, SIZE);
    print_measured(&format!("a row of 4096, {name}"), &found, &expected);
    assert!(expected.iter().any(|p| p[3] > 0.05), "{name}: nothing to see");
    fault(&found, &expected, within).map(|f| format!("{name}: {f}"))
}

#[track_caller]
fn assert_none(faults: impl Iterator<Item = String>) {
    let faults: Vec<_> = faults.collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

const SHADED_SLABS: SplatSettings = SplatSettings {
    visibility: Visibility::Slabs,
    order: Order::FrontToBack,
    ..SplatSettings::SHADE_FIRST
};

/// All kinds of layers that are shaded first, against the float64 reference.
#[test]
fn thousands_of_shade_first_layers_lose_none() {
    if drawer().is_none() {
        return;
    }
    let slabs = SHADED_SLABS;
    let modes = [
        ("slabs", slabs),
        ("slabs back to front", SplatSettings { order: Order::BackToFront, ..slabs }),
        ("8 slabs a voxel", SplatSettings { slabs_per_voxel: 8.0, ..slabs }),
        ("published slabs", SplatSettings { opacity_model: OpacityModel::Published, ..slabs }),
        ("gaussian slabs", SplatSettings { kernel: Kernel::Gaussian, ..slabs }),
        ("tents", SplatSettings { kernel: Kernel::Linear, ..slabs }),
        ("B-splines", SplatSettings { kernel: Kernel::BSpline, ..slabs }),
        ("wide slabs", SplatSettings { extent: Some(6.0), ..slabs }),
        (
            "3 sheets a kernel",
            SplatSettings { visibility: Visibility::Sheets, sheets_per_kernel: 3, ..slabs },
        ),
    ];
    assert_none(modes.into_iter().filter_map(|(name, splat)| held(name, splat, SHADED)));
}

/// The exact mode: very fine slabs, and kernels so wide that a value takes loops of its own.
#[test]
fn very_fine_slabs_and_wide_kernels_of_a_long_ray_lose_nothing() {
    if drawer().is_none() {
        return;
    }
    let exact = SplatSettings::EXACT;
    let fine = SplatSettings { slabs_per_voxel: 16.0, ..exact };
    let finest = SplatSettings { slabs_per_voxel: MOST_SLABS_PER_VOXEL, ..exact };
    let wide = SplatSettings { kernel: Kernel::Cubic, extent: Some(4.5), ..exact };
    let modes = [
        ("64 slabs a voxel", finest),
        ("16 slabs a voxel, after", SplatSettings { classify: Classify::After, ..fine }),
        ("16 slabs a voxel, back to front", SplatSettings { order: Order::BackToFront, ..fine }),
        ("extent 4.5", SplatSettings { reconstruction: Reconstruction::Smooth, ..wide }),
    ];
    assert_none(modes.into_iter().filter_map(|(name, splat)| held(name, splat, EXACT)));
}

/// As the row's known issue was first told: slices composited whole, against slabs.
#[test]
fn thousands_of_shade_first_slabs_have_the_alpha_of_their_slices() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([1, 1, 4096]);
    let mut scene = scene(lattice, DVec3::Z);
    scene = with_field(scene, volume(lattice, Samples::UInt8(vec![200; 4096])));
    *transfer_of(&mut scene) = TransferFunction::of(
        vec![(0.0, 2e-4)],
        ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 255.0] },
    );
    let mut alpha = |visibility| {
        scene.splat = SplatSettings { visibility, ..SplatSettings::SHADE_FIRST };
        drawn_or_refused(&mut drawer, &scene, [4, 4]).0[5][3]
    };
    let (sheets, slabs) = (alpha(Visibility::Sheets), alpha(Visibility::Slabs));
    assert!((sheets - slabs).abs() < 1e-4, "layers are missing: {sheets} {slabs}");
}

/// What rays count says whether an adapter ended their loops: without it a picture is short, with it refused.
#[test]
fn loops_that_an_adapter_ends_are_told() {
    let scene =
        row(SplatSettings { slabs_per_voxel: MOST_SLABS_PER_VOXEL, ..SplatSettings::EXACT });
    let reference = Reference::new(&scene, SIZE.map(|n| n as usize));
    let expected = reference.expect("a mode that means something").picture();
    let drawn = |ends_loops| {
        let mut context = context(Wishes::default())?;
        context.ends_loops &= ends_loops;
        let mut drawer = Drawer::new(Renderer::new(context));
        Some(drawn_or_refused(&mut drawer, &scene, SIZE))
    };
    let (Some((whole, engine)), Some((untold, _))) = (drawn(true), drawn(false)) else { return };
    assert_eq!(fault(&whole, &expected, EXACT), None);
    let is_short = fault(&untold, &expected, EXACT).is_some();
    assert_eq!(
        engine == EngineKind::Native,
        is_short,
        "refused if it would be short, and only then"
    );
}

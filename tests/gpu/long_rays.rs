//! Rays whose loops turn more often than a software adapter lets them: they are walked in several
//! dispatches, and lose nothing.

use glam::DVec3;
use voxsplat::gpu::{GpuError, Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    Classify, MOST_SLABS_PER_VOXEL, OpacityModel, Order, Reconstruction, Scene, SplatSettings,
    Visibility,
};
use voxsplat::task::draw::{DrawError, Drawer, Rung};
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction};
use voxsplat::volume::{Lattice, Samples};

use crate::hard_cases::{EXACT, SHADED};
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

fn long(splat: SplatSettings) -> (Light, Light) {
    let scene = row(splat);
    let reference = Reference::new(&scene, SIZE.map(|n| n as usize));
    let expected = reference.expect("a mode that means something").picture();
    let mut drawer = drawer().expect("a device");
    (drawn(&mut drawer, &scene, SIZE, Rung::Full).0, expected)
}

/// Draws the row in a mode; says what is out of bounds.
fn held(name: &str, splat: SplatSettings, within: Within) -> Option<String> {
    let (found, expected) = long(splat);
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
        drawn(&mut drawer, &scene, [4, 4], Rung::Full).0[5][3]
    };
    let (sheets, slabs) = (alpha(Visibility::Sheets), alpha(Visibility::Slabs));
    assert!((sheets - slabs).abs() < 1e-4, "layers are missing: {sheets} {slabs}");
}

/// A drawer of its own whose loops are held to end after so many turns.
fn held_to(most_turns: Option<u64>) -> Option<Drawer> {
    let mut context = context(Wishes::default())?;
    context.most_turns = most_turns;
    Some(Drawer::new(Renderer::new(context)))
}

fn every_mode() -> Vec<(String, SplatSettings)> {
    let mut modes = Vec::new();
    let layered = |visibility, sheets_per_kernel| SplatSettings {
        visibility,
        sheets_per_kernel,
        ..SHADED_SLABS
    };
    for (name, splat) in [
        ("every sample", layered(Visibility::EverySample, 1)),
        ("sheets", layered(Visibility::Sheets, 1)),
        ("3 sheets a kernel", layered(Visibility::Sheets, 3)),
        ("slabs", layered(Visibility::Slabs, 1)),
    ] {
        for kernel in [Kernel::Cubic, Kernel::Nearest, Kernel::Point] {
            modes.push((format!("{} {name}", kernel.name()), SplatSettings { kernel, ..splat }));
        }
    }
    for kernel in [Kernel::Linear, Kernel::BSpline] {
        modes.push((format!("{} slabs", kernel.name()), SplatSettings { kernel, ..SHADED_SLABS }));
        for classify in [Classify::After, Classify::PreIntegrated] {
            let splat = SplatSettings { kernel, classify, ..SplatSettings::EXACT };
            modes.push((format!("{} {}", kernel.name(), classify.name()), splat));
        }
    }
    modes
}

/// Where a ray is cut makes no difference, not even of a bit; but layers of cubics may come in
/// smaller chunks, after which a ray that is opaque ends sooner.
#[test]
fn rays_in_parts_are_the_same_rays() {
    let (Some(mut whole), Some(mut parts)) = (held_to(None), held_to(Some(2000))) else { return };
    for (name, splat) in every_mode() {
        // Each order with one projection: what is compiled for either is most of the time.
        for (order, angle) in [(Order::FrontToBack, None), (Order::BackToFront, Some(50.0))] {
            let lattice = Lattice::unit([7, 6, 24]);
            let mut scene = scene(lattice, DVec3::new(0.35, -0.3, 0.9));
            scene.splat = SplatSettings { order, opacity_model: OpacityModel::Published, ..splat };
            if let Some(angle) = angle {
                scene = in_perspective(scene, angle);
            }
            let size = [24, 20];
            let one = drawn(&mut whole, &scene, size, Rung::Full).0;
            let other = drawn(&mut parts, &scene, size, Rung::Full).0;
            assert!(one.iter().any(|p| p[3] > 0.1), "{name}");
            let difference = (one.iter().flatten().zip(other.iter().flatten()))
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            let chunks = name == "cubic slabs" || name == "cubic 3 sheets a kernel";
            let most = match order {
                // Transmittance at which a ray ends.
                Order::FrontToBack if chunks => 5e-4,
                Order::BackToFront if chunks => 1e-6,
                _ => 0.0,
            };
            println!("measured in parts, {name} {order:?}: {difference:.1e}");
            assert!(difference <= most, "{name} {order:?}: {difference:e}");
            if most < 1e-4 {
                let caps = [&mut whole, &mut parts]
                    .map(|d| d.engines.gpu().expect("a device").capped_sums());
                assert_eq!(caps[0], caps[1], "{name} {order:?}");
            }
        }
    }
    let count = |drawer: &Drawer| {
        (
            drawer.engines.made_gpu().expect("a device").pipeline_count(),
            drawer.engines.made_gpu().expect("a device").peak_bytes(),
        )
    };
    assert!(count(&parts).1 > count(&whole).1, "nothing was drawn in parts");
}

/// Small kernels take many rays a pixel, and one dispatch for some of them or for a part of one.
#[test]
fn many_rays_a_pixel_in_parts_are_the_same_rays() {
    let linear = SplatSettings { kernel: Kernel::Linear, ..SHADED_SLABS };
    let sheets = SplatSettings { visibility: Visibility::Sheets, ..SHADED_SLABS };
    for (splat, limits) in [
        (SplatSettings::EXACT, [8000, 2000, 600]),
        (linear, [20_000, 4000, 1000]),
        (sheets, [20_000, 4000, 1000]),
    ] {
        let mut scene = scene(Lattice::unit([12; 3]), DVec3::new(0.35, -0.52, 0.78));
        scene.camera.parallel_scale = 40.0;
        scene.splat = splat;
        let pictures: Vec<Light> = std::iter::once(None)
            .chain(limits.map(Some))
            .filter_map(held_to)
            .map(|mut drawer| drawn(&mut drawer, &scene, [24, 20], Rung::Full).0)
            .collect();
        assert!(pictures.iter().all(|p| *p == pictures[0]), "{splat:?}");
    }
}

/// What is far from the limit costs the same with it and without.
#[test]
fn short_rays_cost_no_pass_and_no_byte_more() {
    let (Some(mut free), Some(mut limited)) = (held_to(None), held_to(Some(65_535))) else {
        return;
    };
    for (_, splat) in every_mode() {
        let mut scene = scene(Lattice::unit([7, 6, 24]), DVec3::new(0.35, -0.3, 0.9));
        scene.splat = splat;
        for drawer in [&mut free, &mut limited] {
            drawn(drawer, &scene, [24, 20], Rung::Full);
        }
    }
    let count = |d: &Drawer| {
        let renderer = d.engines.made_gpu().expect("a device");
        (renderer.pipeline_count(), renderer.peak_bytes())
    };
    assert_eq!(count(&free), count(&limited));
}

/// A single step that is too much is refused with a sentence, never cut short.
#[test]
fn a_step_that_the_loops_cannot_hold_is_refused() {
    let Some(mut drawer) = held_to(Some(300)) else { return };
    let mut scene = scene(Lattice::unit([9, 8, 10]), DVec3::new(0.35, -0.52, 0.78));
    scene.splat = SplatSettings { extent: Some(8.0), ..SHADED_SLABS };
    let plan = Plan::of(&scene, [24, 20]);
    drawer.prepare(&plan, &voxsplat::core::Ticket::new()).expect("the device prepares");
    let refused = drawer.draw(&plan, Rung::Full, &mut ());
    let Err(DrawError::Gpu(error @ GpuError::TooLarge { .. })) = refused else {
        panic!("{refused:?}");
    };
    let told = error.to_string();
    assert!(
        told.starts_with("expected samples to gather in one step of a ray of at most"),
        "{told}"
    );
    assert!(
        told.ends_with("choose a smaller --extent, a larger picture, or --backend raster"),
        "{told}"
    );
}

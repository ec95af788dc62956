//! Hard geometry and values with the other kernels, classified `after`, and by `published`
//! opacity: what `geometry` and `mode_values` leave out, against the float64 reference.

use glam::{DMat3, DVec3};
use voxsplat::core::Srgb8;
use voxsplat::scene::{Classify, OpacityModel};
use voxsplat::task::draw::Rung;
use voxsplat::transfer::{ColourSource, TransferFunction};
use voxsplat::volume::{Lattice, Samples};

use super::scenes::*;
use super::*;
use crate::support::{drawer, drawn};

const OBLIQUE: DVec3 = DVec3::new(0.35, -0.52, 0.78);
const DIMS: [usize; 3] = [7, 6, 8];
const COUNT: usize = 336;

/// A mode of each kernel and classification that the others do not draw.
fn other_modes(scene: &Scene) -> Vec<(&'static str, Scene, Within)> {
    let exact = SplatSettings::EXACT;
    let shaded = SplatSettings { order: Order::FrontToBack, ..SplatSettings::SHADE_FIRST };
    let published = OpacityModel::Published;
    [
        (
            "tents after",
            SplatSettings { kernel: Kernel::Linear, classify: Classify::After, ..exact },
        ),
        (
            "B-splines after, published",
            SplatSettings { classify: Classify::After, opacity_model: published, ..exact },
        ),
        (
            "boxes after, back to front",
            SplatSettings {
                kernel: Kernel::Nearest,
                classify: Classify::After,
                order: Order::BackToFront,
                ..exact
            },
        ),
        (
            "cubics pre-integrated, published",
            SplatSettings { kernel: Kernel::Cubic, opacity_model: published, ..exact },
        ),
        ("Gaussians pre-integrated", SplatSettings { kernel: Kernel::Gaussian, ..exact }),
        (
            "Gaussians in slabs, published",
            SplatSettings {
                kernel: Kernel::Gaussian,
                visibility: Visibility::Slabs,
                opacity_model: published,
                ..shaded
            },
        ),
        (
            "cubics in sheets, published",
            SplatSettings { visibility: Visibility::Sheets, opacity_model: published, ..shaded },
        ),
        (
            "boxes one by one, published",
            SplatSettings { kernel: Kernel::Nearest, opacity_model: published, ..shaded },
        ),
        (
            "B-splines in slabs",
            SplatSettings { kernel: Kernel::BSpline, visibility: Visibility::Slabs, ..shaded },
        ),
        (
            "tents in slabs, back to front",
            SplatSettings {
                kernel: Kernel::Linear,
                visibility: Visibility::Slabs,
                order: Order::BackToFront,
                ..shaded
            },
        ),
    ]
    .into_iter()
    .map(|(name, splat)| {
        let opacity_unit_distance = scene.splat.opacity_unit_distance;
        let splat = SplatSettings { opacity_unit_distance, ..splat };
        let mut scene = Scene { splat, ..scene.clone() };
        let within = match (splat.classify, splat.kernel) {
            (Classify::Before, _) => SHADED,
            // The same cell's rounding all through a box. Measured: max 7.4e-4, rmse 1.8e-4, bias
            // 8.3e-5.
            (_, Kernel::Nearest) => Within { rmse: 4e-4, bias: 2e-4, ..EXACT },
            _ => EXACT,
        };
        if splat.kernel == Kernel::Nearest {
            // Boxes have half a voxel's radius; under a pixel they would be averaged.
            scene.camera.parallel_scale *= 0.45;
        }
        (name, scene, within)
    })
    .collect()
}

fn in_other_modes(drawer: &mut Drawer, name: &str, scene: &Scene) -> Vec<String> {
    other_modes(scene)
        .iter()
        .flat_map(|(mode, scene, within)| held(drawer, &format!("{name}, {mode}"), scene, *within))
        .collect()
}

fn lattice() -> Lattice {
    Lattice::unit(DIMS)
}

/// So near that half the picture's height is `scale`, in world units.
fn near(lattice: Lattice, direction: DVec3, scale: f64, unit: f64) -> Scene {
    let mut scene = scene(lattice, direction);
    scene.splat.opacity_unit_distance = Some(unit);
    scene.camera.parallel_scale = scale;
    scene.camera.focal_point = lattice.centre() + DVec3::splat(0.13);
    scene
}

#[test]
fn tilted_edge_on_and_needle_voxels_with_every_kernel() {
    let Some(mut drawer) = drawer() else { return };
    let turned = DMat3::from_rotation_z(45_f64.to_radians());
    let tilted = Lattice { spacing: DVec3::new(1.0, 3.0, 1.0), direction: turned, ..lattice() };
    let mut at_45 = near(tilted, DVec3::Z, 7.0, 3.0);
    at_45.camera.up = DVec3::Y;
    // Off the planes in which boxes meet.
    at_45.camera.focal_point += DVec3::new(0.031, 0.057, 0.0);
    let needles = Lattice { spacing: DVec3::new(1.0, 1.0, 1000.0), ..Lattice::unit([5, 4, 3]) };
    // Of a thousand, the slabs of single kernels take a minute; `geometry` has those in the other modes.
    let plates = Lattice { spacing: DVec3::new(250.0, 250.0, 1.0), ..Lattice::unit([3, 3, 6]) };
    let mut faults = Vec::new();
    for (name, scene) in [
        ("45°", at_45.clone()),
        ("45°, perspective", in_perspective(at_45, 40.0)),
        ("needles, tilted", near(needles, OBLIQUE, 4.0, 1.0)),
        ("needles from their ends", near(needles, DVec3::Z, 4.0, 1000.0)),
        ("plates edge on", near(plates, DVec3::new(0.6, -0.8, 0.0), 4.0, 250.0)),
    ] {
        faults.extend(in_other_modes(&mut drawer, name, &scene));
    }
    assert_none(faults);
}

#[test]
fn sheared_far_and_thin_lattices_with_every_kernel() {
    let Some(mut drawer) = drawer() else { return };
    let sheared = DMat3::from_cols(DVec3::X, DVec3::new(0.6, 0.8, 0.1), DVec3::new(-0.3, 0.4, 1.0));
    let backwards =
        Lattice { direction: sheared, spacing: DVec3::new(-1.0, 1.0, -0.7), ..lattice() };
    let far = Lattice { origin: DVec3::new(1e7, -1e7, 1e7), ..lattice() };
    let mut long = scene(Lattice::unit([2050, 2, 2]), OBLIQUE);
    long.camera.focal_point = DVec3::new(2044.0, 0.5, 0.5);
    long.camera.parallel_scale = 5.0;
    let mut faults = in_other_modes(&mut drawer, "2050 × 2 × 2", &long);
    for (name, lattice) in [
        ("backwards", backwards),
        ("origin 1e7", far),
        ("one voxel", Lattice::unit([1; 3])),
        ("one row", Lattice::unit([1, 1, 7])),
    ] {
        let scene = scene(lattice, OBLIQUE);
        faults.extend(in_other_modes(&mut drawer, name, &scene));
        for (mode, scene, within) in other_modes(&in_perspective(scene, 45.0)) {
            // Each ray meets boxes in true depth order, not in the traversal's (measured: 2.5e-2).
            if !mode.contains("one by one") {
                let name = format!("{name}, perspective, {mode}");
                faults.extend(held(&mut drawer, &name, &scene, within));
            }
        }
    }
    assert_none(faults);
}

#[test]
fn large_kernels_and_an_eye_among_them_with_every_kernel() {
    let Some(mut drawer) = drawer() else { return };
    let mut faults = Vec::new();
    for scale in [0.05, 1e-3] {
        let mut scene = scene(lattice(), OBLIQUE);
        scene.camera.parallel_scale = scale;
        faults.extend(in_other_modes(&mut drawer, &format!("half a height of {scale}"), &scene));
    }
    let mut inside = in_perspective(scene(lattice(), OBLIQUE), 60.0);
    inside.camera.parallel_scale = 0.9;
    for (mode, scene, within) in other_modes(&inside) {
        // Composited one by one what surrounds the eye has no order.
        if !mode.contains("one by one") && !mode.contains("sheets") {
            faults.extend(held(&mut drawer, &format!("eye inside, {mode}"), &scene, within));
        }
    }
    assert_none(faults);
}

fn with_samples(samples: Samples, transfer: TransferFunction) -> Scene {
    let scene = scene(lattice(), DVec3::new(-0.6, 0.3, -0.7));
    with_transfer(with_field(scene, volume(lattice(), samples)), transfer)
}

/// 0..256, one a sample.
fn values() -> impl Iterator<Item = f64> {
    (0..COUNT).map(|i| random(11, i) * 256.0)
}

#[test]
fn values_of_every_size_with_every_kernel() {
    let Some(mut drawer) = drawer() else { return };
    let far = -(1_i64 << 40);
    let mut both_ends = moved(1.0, 0.0);
    both_ends.opacity = vec![(0.0, 0.5), (60.0, 0.0), (160.0, 0.1), (255.0, 0.9)];
    let odd = |(i, v): (usize, f64)| match i % 7 {
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        _ => v as f32,
    };
    let cases = [
        (
            "int64 near -2^40",
            Samples::Int64(values().map(|v| far + v as i64).collect()),
            moved(1.0, far as f64),
        ),
        ("±∞", Samples::Float32(values().enumerate().map(odd).collect()), both_ends),
    ];
    let mut faults = Vec::new();
    for (name, samples, transfer) in cases {
        let scene = with_samples(samples, transfer);
        faults.extend(in_other_modes(&mut drawer, name, &scene));
        if name.starts_with("int64") {
            faults.extend(in_modes(&mut drawer, name, &scene));
        }
    }
    assert_none(faults);
}

#[test]
fn steps_and_opacities_of_one_and_next_to_none_with_every_kernel() {
    let Some(mut drawer) = drawer() else { return };
    let steps = TransferFunction::of(
        vec![(99.5, 0.0), (99.5, 0.7), (180.5, 0.7), (180.5, 0.1)],
        ColourSource::Stops(vec![(140.5, Srgb8([255, 0, 0])), (140.5, Srgb8([0, 0, 255]))]),
    );
    let bytes = || Samples::UInt8(values().map(|v| v as u8).collect());
    let constant = |alpha: f64| {
        with_samples(bytes(), TransferFunction { opacity: vec![(0.0, alpha)], ..transfer() })
    };
    let mut faults = Vec::new();
    for (name, scene) in [("steps", with_samples(bytes(), steps)), ("alpha 1", constant(1.0))] {
        for (mode, scene, within) in other_modes(&scene) {
            // A step or a rim of infinite extinction. Measured: max 4.4e-3, rmse 2.2e-4.
            let within = Within { max_abs: 9e-3, rmse: 5e-4, bias: within.bias.max(5e-5) };
            faults.extend(held(&mut drawer, &format!("{name}, {mode}"), &scene, within));
        }
    }
    for (mode, scene, _) in other_modes(&constant(1e-8)) {
        let expected = truth(&scene, SMALL);
        let most = expected.iter().map(|p| p[3]).fold(0.0, f64::max);
        let (found, _) = drawn(&mut drawer, &scene, SMALL, Rung::Full);
        let relative = |l: &Light| -> Light { l.iter().map(|p| p.map(|c| c / most)).collect() };
        let (found, expected) = (relative(&found), relative(&expected));
        print_measured(&format!("alpha 1e-8, relative, {mode}"), &found, &expected);
        // Boxes, whose cells' rounding is of one sign. Measured: 6.3e-4, 1.8e-4; the others 3.2e-4.
        let within = Within { max_abs: 1.2e-3, rmse: 4e-4, bias: 2e-4 };
        faults.extend(fault(&found, &expected, within).map(|f| format!("alpha 1e-8 {mode}: {f}")));
    }
    assert_none(faults);
}

#[test]
fn the_same_bits_twice_with_every_kernel() {
    let Some(mut drawer) = drawer() else { return };
    let parallel = scene(lattice(), OBLIQUE);
    for scene in [in_perspective(parallel.clone(), 50.0), parallel] {
        let scenes = other_modes(&scene);
        let draw = |drawer: &mut _, scene: &Scene| drawn(drawer, scene, SMALL, Rung::Full).0;
        let once: Vec<Light> = scenes.iter().map(|(_, s, _)| draw(&mut drawer, s)).collect();
        for ((mode, scene, _), once) in scenes.iter().zip(&once) {
            assert!(draw(&mut drawer, scene) == *once, "{mode}");
        }
    }
}

/// The plane that rays are measured from then lies before the eye, away from the lattice's middle.
#[test]
fn an_eye_past_the_middle_of_the_volume() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = in_perspective(scene(Lattice::unit([13, 12, 14]), OBLIQUE), 60.0);
    scene.camera.parallel_scale = 0.9;
    scene.camera.focal_point += scene.camera.direction * 4.3;
    scene.splat.opacity_unit_distance = Some(2.0);
    let mut faults = Vec::new();
    for (mode, scene, within) in modes(&scene).into_iter().chain(other_modes(&scene)) {
        if mode.contains("slabs") {
            faults.extend(held(&mut drawer, &format!("past the middle, {mode}"), &scene, within));
        }
    }
    assert_none(faults);
}

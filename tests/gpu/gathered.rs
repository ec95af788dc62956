//! The passes that gather a lattice's kernels along each pixel's ray, in every mode that shades
//! first, against a float64 sum over all kernels and layers.

use glam::{DMat3, DVec3};
use voxsplat::accuracy::Difference;
use voxsplat::core::{Camera, Srgb8, Ticket};
use voxsplat::gpu::{Renderer, Wishes, tile_count};
use voxsplat::kernel::{Kernel, RadialKernel};
use voxsplat::plan::Plan;
use voxsplat::reference::Rays;
use voxsplat::scene::{Backend, OpacityModel, Order, Scene, SplatSettings, View, Visibility};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::transfer::{ColourSource, TransferFunction};
use voxsplat::volume::{Lattice, Samples};

use crate::layered_truth::expected;
use crate::support::*;

pub(crate) const OBLIQUE: DVec3 = DVec3::new(0.35, -0.52, 0.78);
/// Odd on purpose: tiles hang over both edges.
const ODD: [u32; 2] = [45, 37];

/// Cubics, whose polynomial is off by 6e-5 of its peak at each rim. Measured over all cases here:
/// max 3.3e-4, rmse 2.5e-5, bias 2.0e-6.
const CUBIC: Within = Within { max_abs: 6e-4, rmse: 5e-5, bias: 6e-6 };
/// Gaussians (measured: max 1.6e-4, rmse 9.4e-6, bias 6e-7), boxes and tents (max 9.2e-6, rmse
/// 8e-7), B-splines by three places a cell (max 1.3e-4, rmse 6.3e-6 at half a slab a voxel).
const FINE: Within = Within { max_abs: 3e-4, rmse: 2e-5, bias: 2e-6 };

pub(crate) fn within(kernel: Kernel) -> Within {
    if kernel == Kernel::Cubic { CUBIC } else { FINE }
}

pub(crate) fn lattice() -> Lattice {
    Lattice::unit([9, 8, 10])
}

/// Draws a scene's mode by gathering, in one piece.
pub(crate) fn gathered(drawer: &mut Drawer, scene: &Scene, size: [u32; 2]) -> Light {
    pieces(drawer, scene, size, 0.0, u32::MAX)
}

fn pieces(drawer: &mut Drawer, scene: &Scene, size: [u32; 2], stop: f64, piece: u32) -> Light {
    scene.splat.check().expect("a mode that means something");
    drawer.prepare(&Plan::of(scene, size), &Ticket::new()).expect("the device prepares");
    let renderer = drawer.engines.gpu().expect("a device");
    let (view, unit) = (View::new(scene, size), scene.opacity_unit_distance());
    renderer.begin(&view, scene.splat.kernel, scene.splat.extent, unit).expect("a sound view");
    let (mut first, count) = (0, tile_count(size));
    while first < count {
        let end = first.saturating_add(piece).min(count);
        renderer.draw_gathered(&view, &scene.splat, unit, stop, first..end).expect("it draws");
        first = end;
    }
    wide(&renderer.read_light().expect("the device reads back"))
}

pub(crate) fn with(scene: &Scene, change: impl FnOnce(&mut SplatSettings)) -> Scene {
    let mut scene = scene.clone();
    change(&mut scene.splat);
    scene
}

/// Every mode of a kernel that the passes draw, but for order and opacity model.
pub(crate) fn modes(scene: &Scene, kernel: Kernel) -> Vec<(String, Scene)> {
    let mut modes = Vec::new();
    let mut add = |name: &str, change: &dyn Fn(&mut SplatSettings)| {
        let mut scene = with(scene, change);
        scene.splat.kernel = kernel;
        modes.push((format!("{} {name}", kernel.name()), scene));
    };
    if !kernel.is_separable() {
        add("every sample", &|s| s.visibility = Visibility::EverySample);
        for n in [1, 3] {
            add(&format!("{n} sheets a kernel"), &|s| {
                s.visibility = Visibility::Sheets;
                s.sheets_per_kernel = n;
            });
        }
    }
    for n in [0.5, 1.0, 4.0] {
        add(&format!("{n} slabs a voxel"), &|s| {
            s.visibility = Visibility::Slabs;
            s.slabs_per_voxel = n;
        });
    }
    modes
}

/// Draws every mode of the scene with a kernel, and holds it to float64; returns what is out of
/// bounds.
fn compare(drawer: &mut Drawer, name: &str, scene: &Scene, kernel: Kernel) -> Vec<String> {
    let mut faults = Vec::new();
    for (mode, scene) in modes(scene, kernel) {
        let expected = expected(&scene, ODD);
        assert!(expected.iter().any(|p| p[3] > 0.01), "{name} {mode}: nothing to see");
        let found = gathered(drawer, &scene, ODD);
        print_measured(&format!("{name} {mode}"), &found, &expected);
        faults.extend(
            fault(&found, &expected, within(kernel)).map(|f| format!("{name} {mode}: {f}")),
        );
    }
    faults
}

#[track_caller]
pub(crate) fn assert_none(faults: Vec<String>) {
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

const WITH_VOLUME: [Kernel; 5] =
    [Kernel::Cubic, Kernel::Gaussian, Kernel::Nearest, Kernel::Linear, Kernel::BSpline];

#[test]
fn every_mode_in_parallel_is_the_sum_of_its_kernels() {
    let Some(mut drawer) = drawer() else { return };
    let scene = scene(lattice(), OBLIQUE);
    assert_none(
        WITH_VOLUME.iter().flat_map(|&k| compare(&mut drawer, "parallel", &scene, k)).collect(),
    );
}

/// Rays are straight in index space too: nothing is linearised.
#[test]
fn every_mode_in_perspective_is_the_sum_of_its_kernels() {
    let Some(mut drawer) = drawer() else { return };
    let scene = in_perspective(scene(lattice(), OBLIQUE), 50.0);
    assert_none(
        WITH_VOLUME.iter().flat_map(|&k| compare(&mut drawer, "perspective", &scene, k)).collect(),
    );
}

#[test]
fn published_opacities_back_to_front_and_front_to_back() {
    let Some(mut drawer) = drawer() else { return };
    let mut faults = Vec::new();
    for order in [Order::BackToFront, Order::FrontToBack] {
        for model in [OpacityModel::Published, OpacityModel::OpticalDepth] {
            let scene = with(&scene(lattice(), DVec3::new(-0.7, 0.5, 0.2)), |s| {
                s.order = order;
                s.opacity_model = model;
            });
            for kernel in [Kernel::Cubic, Kernel::Nearest] {
                faults.extend(compare(
                    &mut drawer,
                    &format!("{order:?} {model:?}"),
                    &scene,
                    kernel,
                ));
            }
        }
    }
    assert_none(faults);
}

#[test]
fn lattices_of_every_shape() {
    let Some(mut drawer) = drawer() else { return };
    let sheared = DMat3::from_cols(DVec3::X, DVec3::new(0.6, 0.8, 0.1), DVec3::new(-0.3, 0.4, 1.0));
    let unequal = DVec3::new(1.0, 1.0, 2.5);
    let far = DVec3::new(1e7, -1e7, 1e7);
    let mut faults = Vec::new();
    for (name, lattice) in [
        ("1:1:2.5", Lattice { spacing: unequal, ..lattice() }),
        ("sheared", Lattice { direction: sheared, ..lattice() }),
        ("reflected", Lattice { spacing: DVec3::new(-1.0, 1.2, 0.8), ..lattice() }),
        ("far away", Lattice { origin: far, ..lattice() }),
        ("1 × 1 × 7", Lattice::unit([1, 1, 7])),
        ("1 × 1 × 1", Lattice::unit([1, 1, 1])),
        ("19 × 1 × 3", Lattice::unit([19, 1, 3])),
    ] {
        for kernel in [Kernel::Cubic, Kernel::BSpline] {
            let parallel = scene(lattice, OBLIQUE);
            faults.extend(compare(&mut drawer, name, &parallel, kernel));
            let name = format!("{name}, perspective");
            faults.extend(compare(&mut drawer, &name, &in_perspective(parallel, 40.0), kernel));
        }
    }
    assert_none(faults);
}

#[test]
fn along_axes_and_diagonals_and_from_within() {
    let Some(mut drawer) = drawer() else { return };
    let mut faults = Vec::new();
    for direction in [DVec3::X, DVec3::NEG_Z, DVec3::new(1.0, 1.0, 0.0), DVec3::NEG_ONE] {
        faults.extend(compare(
            &mut drawer,
            &format!("along {direction}"),
            &scene(lattice(), direction),
            Kernel::Gaussian,
        ));
    }
    let mut inside = in_perspective(scene(lattice(), OBLIQUE), 80.0);
    inside.camera.parallel_scale = 0.9;
    // Boxes about the eye come in true depth order, not the traversal's: up to 5.6e-3 apart.
    for kernel in [Kernel::Gaussian, Kernel::Linear] {
        faults.extend(compare(&mut drawer, "eye inside", &inside, kernel));
    }
    assert_none(faults);
}

#[test]
fn extents_and_samples_without_data() {
    let Some(mut drawer) = drawer() else { return };
    let mut holes = scene(lattice(), OBLIQUE);
    let values = (0..lattice().len()).map(|i| {
        let value = random(7, i) * 255.0;
        if random(8, i) < 0.2 { f32::NAN } else { value as f32 }
    });
    holes = with_field(holes, volume(lattice(), Samples::Float32(values.collect())));
    let mut faults = compare(&mut drawer, "holes", &holes, Kernel::Gaussian);
    faults.extend(compare(&mut drawer, "holes", &holes, Kernel::Linear));
    for extent in [1.0, 3.4] {
        let scene = with(&holes, |s| s.extent = Some(extent));
        faults.extend(compare(&mut drawer, &format!("extent {extent}"), &scene, Kernel::Gaussian));
    }
    assert_none(faults);
}

/// Every sample drawn by triangles and by gathering: two ways to one picture.
#[test]
fn every_sample_is_the_triangles_picture() {
    let Some(mut drawer) = drawer() else { return };
    for kernel in [Kernel::Cubic, Kernel::Gaussian, Kernel::Nearest, Kernel::Point] {
        for direction in [OBLIQUE, DVec3::new(-0.9, 0.2, -0.3)] {
            let scene = with_kernel(scene(lattice(), direction), kernel);
            let (triangles, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
            let found = gathered(&mut drawer, &scene, SIZE);
            let name = format!("{} against triangles along {direction}", kernel.name());
            print_measured(&name, &found, &triangles);
            assert_eq!(fault(&found, &triangles, FINE.of_triangles()), None, "{name}");
        }
    }
}

#[test]
fn points_are_the_references_in_both_projections_and_in_layers() {
    let Some(mut drawer) = drawer() else { return };
    let parallel = with_kernel(scene(lattice(), OBLIQUE), Kernel::Point);
    for scene in [in_perspective(parallel.clone(), 50.0), parallel] {
        let expected = reference(&scene, SIZE, Rays::Exact);
        for (name, scene) in modes(&scene, Kernel::Point) {
            let found = gathered(&mut drawer, &scene, SIZE);
            print_measured(&name, &found, &expected);
            // Points that share a pixel and a slab are mixed, which alpha does not show.
            let alpha = |light: &[[f64; 4]]| -> Light {
                light.iter().map(|p| [p[3], p[3], p[3], p[3]]).collect()
            };
            assert_eq!(fault(&alpha(&found), &alpha(&expected), FINE), None, "{name}");
            if scene.splat.visibility != Visibility::Slabs {
                assert_eq!(fault(&found, &expected, FINE), None, "{name}");
            }
        }
    }
}

/// design.md: for optical depth, alpha is the same in every mode and order.
#[test]
fn alpha_is_the_same_in_every_mode_and_order() {
    let Some(mut drawer) = drawer() else { return };
    for kernel in [Kernel::Cubic, Kernel::Gaussian, Kernel::Nearest] {
        for scene in [scene(lattice(), OBLIQUE), in_perspective(scene(lattice(), OBLIQUE), 60.0)] {
            let mut first: Option<Light> = None;
            let (mut most, mut colour) = (0.0_f64, 0.0_f64);
            for order in [Order::BackToFront, Order::FrontToBack] {
                for (_, scene) in modes(&with(&scene, |s| s.order = order), kernel) {
                    let found = gathered(&mut drawer, &scene, ODD);
                    let first = first.get_or_insert_with(|| found.clone());
                    for (a, b) in found.iter().zip(first.iter()) {
                        most = most.max((a[3] - b[3]).abs());
                        colour = colour.max((a[0] - b[0]).abs());
                    }
                }
            }
            println!("measured alpha of {}: {most:.1e}, red {colour:.1e}", kernel.name());
            assert!(most <= 1e-5, "{}: {most}", kernel.name());
            // The modes do differ, or nothing was compared.
            assert!(kernel == Kernel::Nearest || colour > 1e-3, "{}: {colour}", kernel.name());
        }
    }
}

/// Westover §5.02: two half-opaque red footprints before opaque blue.
#[test]
fn red_over_blue_is_westovers_example() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([2, 1, 24]);
    let mut scene = scene(lattice, DVec3::Z);
    scene = with_field(
        scene,
        volume(lattice, Samples::UInt8((0..48).map(|i| u8::from(i >= 2)).collect())),
    );
    *transfer_of(&mut scene) = TransferFunction::of(
        vec![(0.0, 1.0), (1.0, 1.0)],
        ColourSource::Stops(vec![(0.0, Srgb8([255, 0, 0])), (1.0, Srgb8([0, 0, 255]))]),
    );
    scene.camera.focal_point = DVec3::new(0.5, 0.0, 5.0);
    scene.camera.up = DVec3::Y;
    // A kernel wider than the one pixel, which then takes one ray.
    scene.camera.parallel_scale = 0.4;
    let cubic = RadialKernel::new(Kernel::Cubic, None).expect("radial");
    scene.splat.opacity_unit_distance = Some(2.0 * cubic.footprint(0.5));
    scene.splat.opacity_model = OpacityModel::Published;
    for (visibility, expected) in [
        (Visibility::EverySample, [0.75, 0.0, 0.25, 1.0]),
        (Visibility::Sheets, [1.0, 0.0, 0.0, 1.0]),
    ] {
        for order in [Order::BackToFront, Order::FrontToBack] {
            let scene = with(&scene, |s| {
                s.visibility = visibility;
                s.order = order;
            });
            let found = gathered(&mut drawer, &scene, [1, 1]);
            println!("measured {visibility:?} {order:?}: {:?}", found[0]);
            for (found, expected) in found[0].into_iter().zip(expected) {
                assert!((found - expected).abs() < 5e-4, "{visibility:?}: {found} {expected}");
            }
        }
    }
}

#[test]
fn capped_sums_are_counted() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = scene(lattice(), OBLIQUE);
    scene.splat.visibility = Visibility::Sheets;
    scene.splat.opacity_model = OpacityModel::Published;
    // A slice seen obliquely is thicker than a voxel: opacities up to 0.9 would pass 1 in places.
    scene.splat.opacity_unit_distance = Some(4.0);
    gathered(&mut drawer, &scene, ODD);
    assert_eq!(drawer.engines.gpu().expect("a device").capped_sums(), Ok(0));
    scene.splat.opacity_unit_distance = Some(0.5);
    gathered(&mut drawer, &scene, ODD);
    let capped = drawer.engines.gpu().expect("a device").capped_sums().expect("it counts");
    // At most one a pixel and slice.
    assert!(capped > 100 && capped < 45 * 37 * 10, "{capped}");
    // Boxes of 0.9, five behind one another: a little over 1, or a little under.
    scene = with_field(scene, volume(Lattice::unit([6, 6, 5]), Samples::UInt8(vec![200; 180])));
    scene.camera = Camera::new(DVec3::new(2.5, 2.5, 2.0), DVec3::Z, DVec3::Y, 2.0);
    transfer_of(&mut scene).opacity = vec![(0.0, 0.9)];
    scene.splat.kernel = Kernel::Nearest;
    scene.splat.order = Order::BackToFront;
    for visibility in [Visibility::EverySample, Visibility::Sheets] {
        for (unit, expected) in [(0.89, 64 * 5), (0.91, 0)] {
            scene.splat.visibility = visibility;
            scene.splat.opacity_unit_distance = Some(unit);
            gathered(&mut drawer, &scene, [8, 8]);
            assert_eq!(
                drawer.engines.gpu().expect("a device").capped_sums(),
                Ok(expected),
                "{visibility:?} {unit}"
            );
        }
    }
}

#[test]
fn the_same_bits_come_twice_and_in_pieces() {
    let Some(mut drawer) = drawer() else { return };
    let scene = scene(lattice(), OBLIQUE);
    for kernel in [Kernel::Cubic, Kernel::BSpline] {
        for (name, scene) in modes(&scene, kernel) {
            let once = gathered(&mut drawer, &scene, ODD);
            for piece in [u32::MAX, 7, 1] {
                assert!(pieces(&mut drawer, &scene, ODD, 0.0, piece) == once, "{name} by {piece}");
            }
        }
    }
}

#[test]
fn stopping_early_costs_no_more_than_what_is_left() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = scene(lattice(), OBLIQUE);
    scene.splat.opacity_unit_distance = Some(0.4);
    scene.splat.order = Order::FrontToBack;
    let mut most = 0.0_f64;
    for kernel in [Kernel::Cubic, Kernel::BSpline] {
        for (name, scene) in modes(&scene, kernel) {
            let whole = gathered(&mut drawer, &scene, ODD);
            let stopped = pieces(&mut drawer, &scene, ODD, 0.01, u32::MAX);
            let difference = Difference::between(&stopped, &whole).expect("comparable").max_abs;
            assert!(difference < 0.01, "{name}: {difference}");
            most = most.max(difference);
        }
    }
    // It does stop.
    assert!(most > 1e-4, "{most}");
}

#[test]
fn where_32_bits_cannot_be_blended_what_is_not_blended_has_them() {
    let Some(mut shared) = drawer() else { return };
    let narrow = Wishes { float32_blending: false, ..Wishes::default() };
    let Some(context) = context(narrow) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let tiles = with(&scene(lattice(), OBLIQUE), |s| s.visibility = Visibility::Slabs);
    let triangles = with(&scene(lattice(), OBLIQUE), |s| s.backend = Backend::Raster);
    let apart = |scene: &Scene, narrow: &mut Drawer, wide: &mut Drawer| {
        let [a, b] = [narrow, wide].map(|drawer| drawn(drawer, scene, ODD, Rung::Full).0);
        Difference::between(&a, &b).expect("comparable").max_abs
    };
    assert_eq!(apart(&tiles, &mut drawer, &mut shared), 0.0);
    // Each layer is rounded to 2⁻¹¹.
    let halves = apart(&triangles, &mut drawer, &mut shared);
    println!("measured triangles in 16 bits: {halves:.1e}");
    assert!(halves > 1e-4 && halves < 2e-2, "{halves}");
    assert_eq!(apart(&tiles, &mut drawer, &mut shared), 0.0, "and back");
}

#[test]
fn another_mode_order_or_thickness_would_be_seen() {
    let Some(mut drawer) = drawer() else { return };
    let slabs = with(&scene(lattice(), OBLIQUE), |s| s.visibility = Visibility::Slabs);
    let expected = expected(&slabs, ODD);
    for (name, other) in [
        ("every sample", with(&slabs, |s| s.visibility = Visibility::EverySample)),
        ("sheets", with(&slabs, |s| s.visibility = Visibility::Sheets)),
        ("thinner slabs", with(&slabs, |s| s.slabs_per_voxel = 1.02)),
        ("published", with(&slabs, |s| s.opacity_model = OpacityModel::Published)),
        ("wider", with(&slabs, |s| s.extent = Some(1.57))),
    ] {
        let found = gathered(&mut drawer, &other, ODD);
        assert!(fault(&found, &expected, CUBIC).is_some(), "{name} passed");
    }
}

/// Boxes of single voxels, listed by tile and layer, have in each slab what rays through the lattice find;
/// and so has what is next to nothing.
#[test]
fn boxes_and_veils_in_slabs_are_the_same_by_lists() {
    let Some(mut drawer) = drawer() else { return };
    // Measured, of the greatest opacity: 7.0e-6, and 4.4e-2 where boxes are taken for as deep as their
    // middles; 3.5e-2 of 1.1e-6, and all of it where sums below 1e-6 are left out.
    for (kernel, most, within) in [(Kernel::Nearest, 0.9, 1e-3), (Kernel::Gaussian, 2e-7, 0.1)] {
        let scene = with(&with_kernel(scene(lattice(), OBLIQUE), kernel), |s| {
            s.visibility = Visibility::Slabs;
            s.slabs_per_voxel = 4.0;
        });
        let mut scene = with(&scene, |s| s.backend = Backend::Tiles);
        transfer_of(&mut scene).opacity = vec![(90.0, 0.0), (255.0, most)];
        let rays = gathered(&mut drawer, &scene, ODD);
        let (lists, _) = drawn(&mut drawer, &scene, ODD, Rung::Octree { max_error: 0.0 });
        let greatest = rays.iter().map(|p| p[3]).fold(0.0, f64::max);
        let apart = Difference::between(&lists, &rays).expect("comparable").max_abs / greatest;
        println!("measured {} in slabs by lists: {apart:.1e} of {greatest:.1e}", kernel.name());
        assert!(greatest > 0.0 && apart < within, "{}: {apart}", kernel.name());
    }
}

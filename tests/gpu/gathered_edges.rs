//! Gathered kernels where it is easy to leave some out: along slices, about an eye, on the edges of
//! pixels, and beside bricks of nothing.

use glam::DVec3;
use voxsplat::accuracy::Difference;
use voxsplat::core::{Camera, Projection};
use voxsplat::kernel::Kernel;
use voxsplat::reference::Rays;
use voxsplat::scene::{Backend, Order, Scene, SplatSettings, Visibility};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::{Lattice, Samples};

use crate::gathered::{OBLIQUE, assert_none, gathered, lattice, modes, with, within};
use crate::hard_scenes::SMALL;
use crate::layered_truth::expected;
use crate::support::*;

/// Holds slabs to float64, and of other modes the opacity: about an eye they have no order.
fn compare_about_an_eye(drawer: &mut Drawer, name: &str, scene: &Scene) -> Vec<String> {
    let alpha = |light: &[[f64; 4]]| -> Light { light.iter().map(|p| [p[3]; 4]).collect() };
    let slabs = with(scene, |s| s.visibility = Visibility::Slabs);
    let opacity = alpha(&expected(&slabs, SMALL));
    assert!(opacity.iter().any(|p| p[3] > 0.1), "{name}: nothing to see");
    let kernel = scene.splat.kernel;
    let mut faults = Vec::new();
    for (mode, scene) in modes(scene, kernel) {
        let found = gathered(drawer, &scene, SMALL);
        let fault = if scene.splat.visibility == Visibility::Slabs {
            let expected = expected(&scene, SMALL);
            print_measured(&format!("{name} {mode}"), &found, &expected);
            fault(&found, &expected, within(kernel))
        } else {
            print_measured(&format!("{name} {mode}, alpha"), &alpha(&found), &opacity);
            fault(&alpha(&found), &opacity, within(kernel))
        };
        faults.extend(fault.map(|f| format!("{name} {mode}: {f}")));
    }
    faults
}

/// A wide view along a diagonal: its rays at 45° run along the slices, one column of them exactly.
/// Measured: max 4.2e-5, rmse 6.6e-6, bias 6.5e-7.
#[test]
fn rays_that_run_along_the_slices() {
    let Some(mut drawer) = drawer() else { return };
    let size = SMALL.map(f64::from);
    let mut scene = scene(lattice(), OBLIQUE);
    scene.camera = Camera::new(lattice().centre(), DVec3::new(1.0, 1.0, 0.0), DVec3::Z, 0.7);
    scene.camera.focal_point += DVec3::new(0.13, -0.21, 0.08);
    // The middle of the fifth column beside the picture's is as far from it as the eye.
    let view_angle = 2.0 * (size[1] / 2.0 / 5.5).atan();
    scene.camera.projection = Projection::Perspective { view_angle };
    let mut faults = Vec::new();
    for order in [Order::FrontToBack, Order::BackToFront] {
        for kernel in [Kernel::Gaussian, Kernel::BSpline] {
            let scene = with_kernel(with(&scene, |s| s.order = order), kernel);
            faults.extend(compare_about_an_eye(&mut drawer, &format!("along {order:?}"), &scene));
        }
    }
    assert_none(faults);
}

/// What is behind the eye still reaches before it, also where the eye is in a brick of nothing that
/// the slices' order turns in. Measured: max 1.2e-5, rmse 3.2e-6, bias 1.5e-6; 4.5e-4 with a slice
/// lost back to front.
#[test]
fn slices_behind_an_eye_in_an_empty_brick_are_not_leapt_over() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([24, 6, 6]);
    // Bricks of 8: the eye is in the middle one, at 10.4, and kernels reach from 7 to it.
    let value = |i: usize| if (8..16).contains(&(i % 24)) { 0 } else { 120 + (i % 120) as u8 };
    let mut scene = in_perspective(scene(lattice, DVec3::new(0.8, 0.6, 0.1)), 100.0);
    scene =
        with_field(scene, volume(lattice, Samples::UInt8((0..lattice.len()).map(value).collect())));
    scene.splat.kernel = Kernel::Gaussian;
    scene.splat.extent = Some(6.0);
    scene.camera.parallel_scale = 2.0;
    let eye_distance = scene.camera.eye_distance().expect("in perspective");
    scene.camera.focal_point = DVec3::new(10.4, 2.5, 2.3) + scene.camera.direction * eye_distance;
    let mut faults = Vec::new();
    for order in [Order::FrontToBack, Order::BackToFront] {
        let scene = with(&scene, |s| s.order = order);
        faults.extend(compare_about_an_eye(&mut drawer, &format!("turn {order:?}"), &scene));
    }
    assert_none(faults);
}

/// The middle of the picture is the left and the upper edge of one of its pixels.
#[test]
fn a_point_on_an_edge_is_of_one_pixel() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = with_kernel(scene(Lattice::unit([1; 3]), DVec3::Z), Kernel::Point);
    scene = with_field(scene, volume(Lattice::unit([1; 3]), Samples::UInt8(vec![200])));
    scene.camera = Camera::new(DVec3::ZERO, DVec3::Z, DVec3::Y, 2.0);
    for (name, scene) in modes(&scene, Kernel::Point) {
        let found = gathered(&mut drawer, &scene, [4, 4]);
        let shown: Vec<usize> = (0..16).filter(|&i| found[i][3] > 0.0).collect();
        assert_eq!(shown, [4 * 2 + 2], "{name}");
    }
}

/// Every voxel of a lattice on the edges of pixels, in views that round its places differently in each
/// back end: all of them, and the reference, give it to the pixel right of and below it, and to no other.
#[test]
fn points_on_the_edges_of_pixels_are_of_the_same_pixel_in_every_back_end() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice {
        origin: DVec3::new(0.1, -0.7, 0.3),
        spacing: DVec3::splat(0.1),
        ..Lattice::unit([11, 9, 3])
    };
    let base = scene(lattice, DVec3::Z);
    let middle = lattice.centre();
    let size = [26, 22];
    let directions = [DVec3::Z, DVec3::X, -DVec3::Y];
    for (direction, up) in directions.into_iter().zip([DVec3::Y, DVec3::Z, DVec3::X]) {
        let mut scene = with_kernel(base.clone(), Kernel::Point);
        scene = with_field(scene, volume(lattice, Samples::UInt8(vec![200; lattice.len()])));
        // Two pixels a voxel.
        scene.camera = Camera::new(middle, direction, up, 0.1 * f64::from(size[1]) / 4.0);
        scene.splat = SplatSettings { kernel: Kernel::Point, ..SplatSettings::SHADE_FIRST };
        let [raster, tiles] = [Backend::Raster, Backend::Tiles].map(|backend| {
            drawn(&mut drawer, &with(&scene, |s| s.backend = backend), size, Rung::Full).0
        });
        let cut = with(&scene, |s| s.backend = Backend::Tiles);
        let (lists, _) = drawn(&mut drawer, &cut, size, Rung::Octree { max_error: 0.0 });
        let expected = reference(&scene, size, Rays::Local);
        let shown = |picture: &[[f64; 4]]| -> Vec<usize> {
            (0..picture.len()).filter(|&i| picture[i][3] > 0.0).collect()
        };
        let pixels = shown(&expected);
        // An odd number of voxels across has one in the picture's middle, on the corner of four pixels.
        assert!(pixels.contains(&(26 * 11 + 13)), "{direction}: {pixels:?}");
        for (name, picture) in [("raster", &raster), ("tiles", &tiles), ("lists", &lists)] {
            assert_eq!(shown(picture), pixels, "{name} along {direction}");
        }
    }
}

/// Bricks with nothing in them are leapt over, those with next to nothing are not.
#[test]
fn empty_bricks_change_no_picture() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([27, 20, 34]);
    let sample = |i| if random(4, i) < 1.0 / 800.0 { 200 } else { 20 };
    let sparse = volume(lattice, Samples::UInt8((0..lattice.len()).map(sample).collect()));
    let mut most = 0.0_f64;
    for kernel in [Kernel::Gaussian, Kernel::Nearest, Kernel::Linear, Kernel::BSpline] {
        for direction in [OBLIQUE, DVec3::new(-0.2, 0.9, -0.1)] {
            let mut scene = scene(lattice, direction);
            scene = with_field(scene, sparse.clone());
            if direction != OBLIQUE {
                scene = in_perspective(scene, 60.0);
            }
            let modes = modes(&scene, kernel).into_iter();
            for (name, mut scene) in modes.filter(|(_, s)| s.splat.slabs_per_voxel == 1.0) {
                let [found, expected] = [0.0, 1e-12].map(|least| {
                    transfer_of(&mut scene).opacity = vec![(100.0, least), (101.0, 0.95)];
                    gathered(&mut drawer, &scene, SMALL)
                });
                let seen = expected.iter().filter(|p| p[3] > 0.1).count();
                assert!(seen > 3, "{name}: {seen} pixels are little to see");
                let difference = Difference::between(&found, &expected).expect("comparable");
                most = most.max(difference.max_abs);
                // Measured: 2.3e-10.
                assert!(difference.max_abs < 1e-6, "{name}: {difference:?}");
            }
        }
    }
    println!("measured with bricks that are empty: {most:.1e}");
}

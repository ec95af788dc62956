//! `full` against the float64 reference: kernels, projections, lattices, views.

use glam::{DMat3, DVec3};
use voxsplat::kernel::Kernel;
use voxsplat::reference::Rays;
use voxsplat::scene::{Backend, Scene};
use voxsplat::task::draw::Rung;
use voxsplat::volume::Lattice;

use crate::support::*;

/// The cubic, whose polynomial is off by 6e-5 of its peak at each kernel's rim, and any other.
/// Measured over all cases here: max 1.6e-3 (ten rims of one row in one pixel; 3e-4 in oblique
/// views), rmse 5.8e-5, bias 3.9e-6.
const EXACT: Within = Within { max_abs: 2.5e-3, rmse: 8e-5, bias: 6e-6 };
/// Points, boxes and Gaussians. Measured: max 1.3e-4, rmse 1.1e-5, bias 2.1e-6 (colours have 16
/// bits).
const FINE: Within = Within { max_abs: 2e-4, rmse: 2e-5, bias: 4e-6 };

fn within(kernel: Kernel) -> Within {
    if kernel == Kernel::Cubic { EXACT } else { FINE }.of_triangles()
}

const DIMS: [usize; 3] = [9, 8, 10];
const OBLIQUE: DVec3 = DVec3::new(0.35, -0.52, 0.78);

fn lattice() -> Lattice {
    Lattice::unit(DIMS)
}

#[test]
fn every_kernel_in_parallel_projection_is_the_references() {
    let Some(mut drawer) = drawer() else { return };
    for kernel in [Kernel::Point, Kernel::Nearest, Kernel::Gaussian, Kernel::Cubic] {
        let scene = with_kernel(scene(lattice(), OBLIQUE), kernel);
        agrees(&mut drawer, &format!("{} parallel", kernel.name()), &scene, within(kernel));
    }
}

#[test]
fn every_kernel_in_perspective_is_the_references() {
    let Some(mut drawer) = drawer() else { return };
    for kernel in [Kernel::Cubic, Kernel::Gaussian, Kernel::Point] {
        for degrees in [20.0, 70.0] {
            let scene = in_perspective(with_kernel(scene(lattice(), OBLIQUE), kernel), degrees);
            let name = format!("{} perspective {degrees}°", kernel.name());
            agrees(&mut drawer, &name, &scene, within(kernel));
        }
    }
}

/// The reference takes the chord of the pixel's own ray; the device linearises at each box.
#[test]
fn boxes_in_perspective_are_near_their_true_chords() {
    let Some(mut drawer) = drawer() else { return };
    let bounds = [
        // Measured: 2.2e-2, 5.7e-4, 5e-6.
        (10.0, Within { max_abs: 0.04, rmse: 1e-3, bias: 2e-5 }),
        // Measured: 6.1e-2, 2.0e-3, 5.2e-5.
        (30.0, Within { max_abs: 0.1, rmse: 3e-3, bias: 1e-4 }),
    ];
    for (degrees, within) in bounds {
        let scene =
            in_perspective(with_kernel(scene(lattice(), OBLIQUE), Kernel::Nearest), degrees);
        agrees(&mut drawer, &format!("nearest perspective {degrees}°"), &scene, within);
    }
}

/// What the local affine approximation of perspective costs, in a picture of overlapping kernels.
#[test]
fn the_price_of_perspective_is_as_stated_against_exact_rays() {
    let Some(mut drawer) = drawer() else { return };
    let bounds = [
        // Measured: 8.6e-4, 6.3e-5, 1.6e-5.
        (10.0, Within { max_abs: 1.5e-3, rmse: 1e-4, bias: 3e-5 }),
        // Measured: 7.3e-3, 6.0e-4, 1.7e-4.
        (30.0, Within { max_abs: 0.012, rmse: 1e-3, bias: 3e-4 }),
        // Measured: 7.5e-2, 7.2e-3, 2.5e-3.
        (70.0, Within { max_abs: 0.12, rmse: 1.1e-2, bias: 4e-3 }),
    ];
    let mut rmse = Vec::new();
    for (degrees, within) in bounds {
        let scene = in_perspective(scene(lattice(), OBLIQUE), degrees);
        let exact = reference(&scene, SIZE, Rays::Exact);
        let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
        let name = format!("cubic {degrees}° against exact rays");
        print_measured(&name, &found, &exact);
        assert_eq!(fault(&found, &exact, within), None, "{name}");
        rmse.push(voxsplat::accuracy::rmse(&found, &exact).expect("comparable"));
    }
    assert!(rmse[0] > 1e-6 && rmse[0] < rmse[1] && rmse[1] < rmse[2], "{rmse:?}");
}

/// Seen along each axis from both ends, and exactly on the diagonals where axes tie.
#[test]
fn every_principal_axis_and_every_diagonal_is_drawn_in_the_references_order() {
    let Some(mut drawer) = drawer() else { return };
    let mut views = Vec::new();
    for axis in DVec3::AXES {
        let beside = DVec3::new(axis.y, axis.z, axis.x);
        for sign in [1.0, -1.0] {
            views.push(sign * (axis + 0.3 * beside - 0.2 * axis.cross(beside)));
            views.push(sign * axis);
            views.push(sign * (axis + beside));
            views.push(sign * (axis - beside));
        }
    }
    for signs in [[1., 1., 1.], [-1., 1., 1.], [1., -1., 1.], [-1., -1., -1.]] {
        views.push(DVec3::from(signs));
    }
    for view in views {
        agrees(&mut drawer, &format!("along {view:.1}"), &scene(lattice(), view), EXACT);
    }
}

/// A spacing, a direction to see it from, and a scale that shows a part of it.
fn stretched(spacing: DVec3, direction: DVec3, parallel_scale: Option<f64>) -> Scene {
    let mut scene = scene(Lattice { spacing, ..lattice() }, direction);
    if let Some(scale) = parallel_scale {
        scene.splat.opacity_unit_distance = Some(spacing.max_element());
        scene.camera.parallel_scale = scale;
        scene.camera.focal_point = scene.lattice().centre() + DVec3::splat(0.13);
    }
    scene
}

#[test]
fn unequal_spacings_are_drawn_from_every_side() {
    let Some(mut drawer) = drawer() else { return };
    let twice = DVec3::new(1.0, 1.0, 2.0);
    for direction in [OBLIQUE, DVec3::X, DVec3::Z, DVec3::new(0.02, 1.0, 0.01)] {
        let scene = stretched(twice, direction, None);
        agrees(&mut drawer, &format!("1:1:2 along {direction:.2}"), &scene, EXACT);
        agrees(&mut drawer, "1:1:2 in perspective", &in_perspective(scene, 40.0), EXACT);
    }
}

#[test]
fn a_thousandfold_spacing_is_drawn_edge_on_and_face_on() {
    let Some(mut drawer) = drawer() else { return };
    let needles = DVec3::new(1.0, 1.0, 1000.0);
    let plates = DVec3::new(1000.0, 1000.0, 1.0);
    // Near enough that no kernel is thinner than a pixel.
    for (name, spacing, direction) in [
        ("needles from the side", needles, DVec3::X),
        ("needles from their ends", needles, DVec3::Z),
        ("needles, nearly from their ends", needles, DVec3::new(0.0005, 0.0003, 1.0)),
        ("needles, tilted", needles, OBLIQUE),
        ("plates edge on", plates, DVec3::new(0.6, -0.8, 0.0)),
        ("plates nearly edge on", plates, DVec3::new(0.6, -0.8, 0.001)),
    ] {
        for kernel in [Kernel::Cubic, Kernel::Gaussian] {
            let scene = with_kernel(stretched(spacing, direction, Some(6.0)), kernel);
            agrees(&mut drawer, &format!("{} {name}", kernel.name()), &scene, within(kernel));
        }
    }
}

#[test]
fn sheared_and_reflected_lattices_are_drawn() {
    let Some(mut drawer) = drawer() else { return };
    let sheared = DMat3::from_cols(DVec3::X, DVec3::new(0.6, 0.8, 0.1), DVec3::new(-0.3, 0.4, 1.0));
    let reflected = sheared * DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    for (name, direction, spacing) in [
        ("sheared", sheared, DVec3::ONE),
        ("reflected", reflected, DVec3::new(1.0, 1.5, 0.8)),
        ("backwards", sheared, DVec3::new(-1.0, 1.0, -0.7)),
    ] {
        let scene = scene(Lattice { direction, spacing, ..lattice() }, OBLIQUE);
        agrees(&mut drawer, name, &scene, EXACT);
        agrees(&mut drawer, &format!("{name}, perspective"), &in_perspective(scene, 45.0), EXACT);
    }
}

#[test]
fn an_origin_ten_million_away_costs_nothing() {
    let Some(mut drawer) = drawer() else { return };
    let far = Lattice { origin: DVec3::new(1e7, -1e7, 1e7), ..lattice() };
    agrees(&mut drawer, "origin 1e7", &scene(far, OBLIQUE), EXACT);
    agrees(
        &mut drawer,
        "origin 1e7, perspective",
        &in_perspective(scene(far, OBLIQUE), 40.0),
        EXACT,
    );
}

#[test]
fn extents_and_unit_distances_are_drawn() {
    let Some(mut drawer) = drawer() else { return };
    for kernel in [Kernel::Cubic, Kernel::Gaussian] {
        let natural = kernel.natural_extent().expect("radial");
        for times in [0.7, 1.0, 2.0] {
            let mut scene = with_kernel(scene(lattice(), OBLIQUE), kernel);
            scene.splat.extent = Some(natural * times);
            agrees(
                &mut drawer,
                &format!("{} extent × {times}", kernel.name()),
                &scene,
                within(kernel),
            );
        }
    }
    for unit in [0.25, 3.7] {
        let mut scene = scene(Lattice { spacing: DVec3::new(1.0, 1.4, 0.8), ..lattice() }, OBLIQUE);
        scene.splat.opacity_unit_distance = Some(unit);
        agrees(&mut drawer, &format!("unit distance {unit}"), &scene, EXACT);
    }
}

/// Kernels about the eye are hundreds of pixels wide, and half of them lie behind it. As triangles they
/// are seen as from their middles, and so only where they are asked for.
#[test]
fn an_eye_inside_the_volume_sees_what_lies_before_it() {
    let Some(mut drawer) = drawer() else { return };
    let mut inside = in_perspective(scene(lattice(), OBLIQUE), 60.0);
    inside.camera.parallel_scale = 0.9;
    inside.splat.backend = Backend::Raster;
    let view = inside.camera.view_origin();
    let index = inside.lattice().index_from_world(view);
    assert!(index.cmpge(DVec3::ZERO).all() && index.cmple(DVec3::splat(7.0)).all(), "{index}");
    agrees(&mut drawer, "eye inside", &inside, EXACT);
}

#[test]
fn odd_flat_and_long_lattices_are_drawn() {
    let Some(mut drawer) = drawer() else { return };
    for dims in [[1, 1, 1], [1, 1, 7], [7, 1, 1], [1, 6, 5], [19, 9, 10], [8, 16, 3]] {
        agrees(&mut drawer, &format!("{dims:?}"), &scene(Lattice::unit(dims), OBLIQUE), EXACT);
    }
    for direction in [OBLIQUE, DVec3::new(-1.0, 0.02, 0.03)] {
        let mut long = scene(Lattice::unit([2049, 2, 2]), direction);
        // The far end, where indices are largest.
        long.camera.focal_point = DVec3::new(2040.0, 0.5, 0.5);
        long.camera.parallel_scale = 6.0;
        agrees(&mut drawer, &format!("2049 × 2 × 2 along {direction:.2}"), &long, EXACT);
    }
}

#[test]
fn a_wrong_kernel_order_or_scale_would_be_seen() {
    let Some(mut drawer) = drawer() else { return };
    let scene = scene(lattice(), OBLIQUE);
    let expected = reference(&scene, SIZE, Rays::Local);
    let mut wrong = Vec::new();
    let mut turned = scene.clone();
    turned.camera = turned.camera.orbited(0.01, 0.0);
    wrong.push(("turned by 0.6°", turned));
    let mut wider = scene.clone();
    wider.splat.extent = Some(1.57);
    wrong.push(("extent 1.57", wider));
    let mut denser = scene.clone();
    denser.splat.opacity_unit_distance = Some(0.99);
    wrong.push(("unit distance 0.99", denser));
    wrong.push(("a Gaussian", with_kernel(scene, Kernel::Gaussian)));
    for (name, other) in wrong {
        let (found, _) = drawn(&mut drawer, &other, SIZE, Rung::Full);
        assert!(fault(&found, &expected, EXACT).is_some(), "{name} passed");
    }
}

/// A kernel larger than the picture is clipped at its edges, which must not bend it.
#[test]
fn a_kernel_larger_than_the_picture_keeps_its_shape_at_every_zoom() {
    let Some(mut drawer) = drawer() else { return };
    for kernel in [Kernel::Cubic, Kernel::Gaussian, Kernel::Nearest] {
        for scale in [3.0, 1.5, 1.3, 1.1, 1.0, 0.8, 0.5, 0.3, 0.1] {
            let mut scene = with_kernel(scene(Lattice::unit([1, 1, 1]), OBLIQUE), kernel);
            scene.camera.parallel_scale = scale;
            // Rays would take over once the eye is in the kernel.
            scene.splat.backend = Backend::Raster;
            let name = format!("one {} at half a height of {scale}", kernel.name());
            agrees(&mut drawer, &name, &scene, within(kernel));
            if kernel != Kernel::Nearest {
                let name = format!("{name}, perspective");
                agrees(&mut drawer, &name, &in_perspective(scene, 5.0), within(kernel));
            }
        }
    }
}

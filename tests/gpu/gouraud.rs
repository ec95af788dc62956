//! Splats as meshes of triangles against barycentric coordinates in float64.

use glam::{DMat3, DVec3};
use voxsplat::accuracy::rmse;
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::kernel::{Kernel, Subdivisions};
use voxsplat::plan::Plan;
use voxsplat::reference::{RefKernel, Reference};
use voxsplat::scene::{OpacityModel, Scene, View};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::Lattice;

use crate::scattered::{dense, kernels, views};
use crate::support::*;

/// Corners are placed in single precision and snap to 1/256 of a pixel; colours have 16 bits. Measured
/// over all cases here: max 1.8e-4 (single pixels at an edge of steep meshes), rmse 4.3e-6, bias 3.3e-6.
const EXACT: Within = Within { max_abs: 6e-4, rmse: 9e-6, bias: 7e-6 };

const OBLIQUE: DVec3 = DVec3::new(0.35, -0.52, 0.78);

fn mesh(scene: Scene, angles: u32, rings: u32) -> Scene {
    let mut scene = with_kernel(scene, Kernel::Gouraud);
    scene.splat.gouraud = Subdivisions { angles, rings };
    scene
}

fn usual(lattice: Lattice) -> Scene {
    with_kernel(scene(lattice, OBLIQUE), Kernel::Gouraud)
}

fn small() -> Lattice {
    Lattice::unit([9, 8, 10])
}

fn published(mut scene: Scene) -> Scene {
    scene.splat.opacity_model = OpacityModel::Published;
    scene
}

/// The float64 picture by the scene's own mode; of kernels in place of its samples.
fn expected(scene: &Scene, kernels: Option<Vec<RefKernel>>) -> Light {
    let size = SIZE.map(|n| n as usize);
    let reference = match kernels {
        Some(kernels) => Reference::of_kernels(kernels, scene, size, false),
        None => Reference::new(scene, size),
    };
    reference.expect("a mode").picture()
}

#[track_caller]
fn agrees(drawer: &mut Drawer, name: &str, scene: &Scene) {
    let expected = expected(scene, None);
    assert!(expected.iter().any(|p| p[3] > 0.1), "{name}: the reference is empty");
    let (found, _) = drawn(drawer, scene, SIZE, Rung::Full);
    print_measured(name, &found, &expected);
    assert_eq!(fault(&found, &expected, EXACT.of_triangles()), None, "{name}");
}

#[test]
fn grids_in_both_projections_and_opacities_are_the_references() {
    let Some(mut drawer) = drawer() else { return };
    for (angles, rings) in [(3, 1), (7, 2), (8, 4), (16, 6)] {
        let base = mesh(scene(small(), OBLIQUE), angles, rings);
        let name = format!("mesh {angles} × {rings}");
        agrees(&mut drawer, &name, &base);
        agrees(&mut drawer, &format!("{name}, published"), &published(base.clone()));
        for degrees in [20.0, 70.0] {
            let scene = in_perspective(base.clone(), degrees);
            agrees(&mut drawer, &format!("{name}, {degrees}°"), &scene);
        }
    }
    let scene = published(in_perspective(usual(small()), 45.0));
    agrees(&mut drawer, "mesh, published, 45°", &scene);
}

#[test]
fn extents_spacings_and_sheared_axes_are_drawn() {
    let Some(mut drawer) = drawer() else { return };
    for extent in [0.9, 1.556, 3.2] {
        let mut scene = usual(small());
        scene.splat.extent = Some(extent);
        agrees(&mut drawer, &format!("mesh, extent {extent}"), &scene);
    }
    let spacing = DVec3::new(1.0, 1.0, 2.0);
    let stretched = usual(Lattice { spacing, ..small() });
    agrees(&mut drawer, "mesh, 1:1:2", &stretched);
    agrees(&mut drawer, "mesh, 1:1:2, published", &published(stretched.clone()));
    agrees(&mut drawer, "mesh, 1:1:2, perspective", &in_perspective(stretched, 40.0));
    let sheared = DMat3::from_cols(DVec3::X, DVec3::new(0.6, 0.8, 0.1), DVec3::new(-0.3, 0.4, 1.0));
    let reflected = sheared * DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    for (name, direction) in [("sheared", sheared), ("reflected", reflected)] {
        let scene = usual(Lattice { direction, ..small() });
        agrees(&mut drawer, &format!("mesh, {name}"), &scene);
        agrees(&mut drawer, &format!("mesh, {name}, perspective"), &in_perspective(scene, 45.0));
    }
    let mut large = usual(Lattice::unit([2, 2, 2]));
    large.camera.parallel_scale = 0.4;
    agrees(&mut drawer, "meshes larger than the picture", &large);
    let mut inside = in_perspective(usual(small()), 60.0);
    inside.camera.parallel_scale = 0.9;
    agrees(&mut drawer, "meshes about the eye", &inside);
}

#[test]
fn nodes_of_many_sides_are_the_references() {
    let Some(mut drawer) = drawer() else { return };
    for (name, base) in views() {
        let records = dense(&base, 60, 3);
        for (angles, rings) in [(7, 2), (8, 4)] {
            for scene in
                [mesh(base.clone(), angles, rings), published(mesh(base.clone(), angles, rings))]
            {
                drawer
                    .prepare(&Plan::of(&scene, SIZE), &Default::default())
                    .expect("the device prepares");
                let (view, unit) = (View::new(&scene, SIZE), scene.opacity_unit_distance());
                drawer
                    .engines
                    .gpu()
                    .expect("a device")
                    .begin_meshes(&view, &scene.splat, unit)
                    .expect("it begins");
                drawer.engines.gpu().expect("a device").draw_records(&records).expect("it draws");
                let found = wide(
                    &drawer.engines.gpu().expect("a device").read_light().expect("it reads back"),
                );
                let expected = expected(&scene, Some(kernels(&scene, &records)));
                let model = scene.splat.opacity_model.name();
                let name = format!("nodes as meshes {angles} × {rings}, {name}, {model}");
                print_measured(&name, &found, &expected);
                assert_eq!(fault(&found, &expected, EXACT.of_triangles()), None, "{name}");
            }
        }
    }
}

/// A cut that goes down to every voxel is the grid, in the traversal's order or nearly: alpha is the
/// same in any.
#[test]
fn a_cut_of_every_voxel_has_the_grids_alpha() {
    let Some(mut drawer) = drawer() else { return };
    for scene in [usual(small()), in_perspective(usual(small()), 40.0), published(usual(small()))] {
        let (grid, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
        let (cut, what) = drawn(&mut drawer, &scene, SIZE, Rung::Octree { max_error: 0.0 });
        assert_eq!(what.nodes, drawer.active_count().expect("they are counted"));
        let apart = grid.iter().zip(&cut).map(|(a, b)| (a[3] - b[3]).abs()).fold(0.0, f64::max);
        println!("measured alpha of a grid and its cut as meshes: {apart:.1e}");
        // Measured: 1.2e-6.
        assert!(grid.iter().any(|p| p[3] > 0.5) && apart < 5e-6, "{apart:e}");
        let (coarse, what) = drawn(&mut drawer, &scene, SIZE, Rung::Subsampled { level: 1 });
        assert!(
            what.nodes < drawer.active_count().expect("they are counted")
                && coarse.iter().any(|p| p[3] > 0.3)
        );
    }
}

#[test]
fn other_subdivisions_kernels_or_opacities_would_be_seen() {
    let Some(mut drawer) = drawer() else { return };
    let right = usual(small());
    let expected = expected(&right, None);
    let cubic = with_kernel(right.clone(), Kernel::Cubic);
    let mut wider = right.clone();
    wider.splat.extent = Some(1.57);
    for (name, wrong) in [
        ("9 × 4", mesh(right.clone(), 9, 4)),
        ("8 × 5", mesh(right.clone(), 8, 5)),
        ("a footprint", cubic),
        ("published", published(right)),
        ("extent 1.57", wider),
    ] {
        let (found, _) = drawn(&mut drawer, &wrong, SIZE, Rung::Full);
        assert!(fault(&found, &expected, EXACT).is_some(), "{name} passed");
    }
}

/// Doubling both subdivisions leaves a quarter of the difference to evaluated footprints.
#[test]
fn meshes_converge_to_the_footprint_at_second_order() {
    let Some(mut drawer) = drawer() else { return };
    for (name, opacity) in [("thin", 0.02), ("dense", 0.8)] {
        let mut base = scene(Lattice::unit([5, 4, 6]), OBLIQUE);
        transfer_of(&mut base).opacity = vec![(90.0, 0.0), (255.0, opacity)];
        let base = in_perspective(base, 25.0);
        let (footprints, _) = drawn(&mut drawer, &base, SIZE, Rung::Full);
        let error = |drawer: &mut Drawer, angles, rings| {
            let (found, _) = drawn(drawer, &mesh(base.clone(), angles, rings), SIZE, Rung::Full);
            rmse(&found, &footprints).expect("comparable")
        };
        let errors = [(8, 4), (16, 8), (32, 16)].map(|(a, r)| error(&mut drawer, a, r));
        println!("measured {name} meshes to footprints: {errors:.6?}");
        let most = footprints.iter().map(|p| p[3]).fold(0.0, f64::max);
        assert!(errors[0] < 0.05 * most, "{errors:?} of {most}");
        for pair in errors.windows(2) {
            assert!((2.8..6.0).contains(&(pair[0] / pair[1])), "{name}: {errors:?}");
        }
    }
}

/// One voxel twice as long as the opacities' unit, seen along it: α·F comes to 1.4, and is capped
/// wherever it is over 1.
#[test]
fn published_opacities_over_1_are_capped_and_counted() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice { spacing: DVec3::new(1.0, 1.0, 2.0), ..Lattice::unit([1, 1, 1]) };
    let mut scene = published(with_kernel(scene(lattice, DVec3::Z), Kernel::Gouraud));
    scene.splat.opacity_unit_distance = Some(1.0);
    transfer_of(&mut scene).opacity = vec![(0.0, 0.9999)];
    let expected = expected(&scene, None);
    let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    print_measured("one capped mesh", &found, &expected);
    assert_eq!(fault(&found, &expected, EXACT), None);
    let full = expected.iter().filter(|p| p[3] == 1.0).count();
    let counted = drawer.capped_sums().expect("it reads back");
    assert!(full > 100 && counted.abs_diff(full as u64) <= 2, "{counted} of {full}");
    scene.splat.opacity_unit_distance = Some(2.0);
    drawn(&mut drawer, &scene, SIZE, Rung::Full);
    assert_eq!(drawer.capped_sums(), Ok(0));
}

#[test]
fn nothing_of_meshes_is_made_before_they_are_asked_for_and_each_once() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let cubic = scene(small(), OBLIQUE);
    // Twice, as the buffer that brings the picture back is counted by the picture after.
    drawn(&mut drawer, &cubic, SIZE, Rung::Full);
    drawn(&mut drawer, &cubic, SIZE, Rung::Full);
    let count = |d: &Drawer| {
        let renderer = d.engines.made_gpu().expect("a device");
        (renderer.pipeline_count(), renderer.peak_bytes())
    };
    let before = count(&drawer);
    let meshes = usual(small());
    drawn(&mut drawer, &meshes, SIZE, Rung::Full);
    let with = count(&drawer);
    // The pass's pipeline; 33 corners of 12 bytes and 56 triangles of 6, in steps of 16.
    assert_eq!(with.0, before.0 + 1);
    let more = with.1 - before.1;
    // Pieces of the grid may still grow where a device is quick.
    assert!(more == 400 + 336 || voxsplat::gpu::has_hardware() && more > 400 + 336, "{more}");
    drawn(&mut drawer, &meshes, SIZE, Rung::Full);
    drawn(&mut drawer, &cubic, SIZE, Rung::Full);
    let after = count(&drawer);
    assert!(after == with || voxsplat::gpu::has_hardware() && after.0 == with.0, "{after:?}");
}

/// Edge on, plates of 8 : 8 : 1 are thinner than a pixel, and widened to one. What their meshes hide in
/// all is what footprints do. Measured: 0.6 % less.
#[test]
fn thin_meshes_are_widened_as_footprints_are() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice { spacing: DVec3::new(8.0, 8.0, 1.0), ..Lattice::unit([8, 8, 24]) };
    let mut plates = scene(lattice, DVec3::new(0.6, -0.8, 0.02));
    plates.camera.parallel_scale = 100.0;
    plates.splat.opacity_unit_distance = Some(8.0);
    let mut hidden = |kernel| {
        let (found, _) = drawn(&mut drawer, &with_kernel(plates.clone(), kernel), SIZE, Rung::Full);
        assert!(found.iter().flatten().all(|c| (0.0..=1.0 + 1e-6).contains(c)));
        found.iter().map(|p| p[3]).sum::<f64>()
    };
    let [meshes, footprints] = [Kernel::Gouraud, Kernel::Cubic].map(&mut hidden);
    println!("measured alpha of thin plates as meshes: {:.4} of it", meshes / footprints);
    assert!(footprints > 50.0 && (meshes / footprints - 1.0).abs() < 0.03);
}

#[test]
fn light_is_finite_at_every_extent_and_from_within() {
    let Some(mut drawer) = drawer() else { return };
    for extent in [1e-6, 1e-2, 30.0, 1e3, 1e6] {
        let mut base = usual(small());
        base.splat.extent = Some(extent);
        let mut inside = in_perspective(base.clone(), 100.0);
        inside.camera.parallel_scale = 0.01;
        for scene in [published(base.clone()), published(inside.clone()), base, inside] {
            let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
            let sound = |c: &f64| c.is_finite() && (-1e-6..=1.0 + 1e-5).contains(c);
            assert!(found.iter().flatten().all(sound), "extent {extent}");
        }
    }
}

//! Splats of whole nodes, and what is kept from one scene to the next.

use glam::{DMat3, DVec3};
use voxsplat::core::Ticket;
use voxsplat::gpu::layout::Record;
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::reference::{Rays, RefKernel, every_sample};
use voxsplat::scene::View;
use voxsplat::task::draw::Rung;
use voxsplat::volume::{Lattice, Samples};

use crate::support::{
    SIZE, Within, agrees, drawer, drawn, fault, in_perspective, print_measured, scene, transfer_of,
    volume, wide, with_field,
};

#[test]
fn a_node_is_the_kernel_of_its_own_box_whatever_its_sides() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice { spacing: DVec3::new(1.0, 1.3, 0.8), ..Lattice::unit([16; 3]) };
    let base = scene(lattice, DVec3::new(0.5, -0.4, 0.7));
    for (name, scene) in [("parallel", base.clone()), ("perspective", in_perspective(base, 30.0))] {
        drawer.prepare(&Plan::of(&scene, SIZE), &Ticket::new()).expect("the device prepares");
        let view = View::new(&scene, SIZE);
        let unit = scene.opacity_unit_distance();
        for size in [[4_u32, 2, 1], [1, 5, 2], [2, 1, 6], [3, 3, 3]] {
            let low = [5, 6, 4];
            let (extinction, colour) = (0.4_f32, [60_000_u16, 20_000, 5_000]);
            let records = [Record::new(low, size, extinction, colour)];
            drawer
                .engines
                .gpu()
                .expect("a device")
                .begin(&view, Kernel::Cubic, None, unit)
                .expect("it begins");
            drawer.engines.gpu().expect("a device").draw_records(&records).expect("it draws");
            let found =
                wide(&drawer.engines.gpu().expect("a device").read_light().expect("it reads back"));
            let centre = DVec3::from_array(std::array::from_fn(|a| {
                f64::from(low[a]) + (f64::from(size[a]) - 1.0) / 2.0
            }));
            let kernel = RefKernel {
                centre: lattice.world_from_index(centre),
                map: lattice.axes() * DMat3::from_diagonal(DVec3::from(size.map(f64::from))),
                extinction: f64::from(extinction) / unit,
                colour: colour.map(|c| f64::from(c) / 65535.0),
            };
            let pixels = SIZE.map(|n| n as usize);
            let expected =
                every_sample(&[kernel], Kernel::Cubic, None, &scene.camera, pixels, Rays::Local);
            print_measured(&format!("node {size:?}, {name}"), &found, &expected);
            // Measured on llvmpipe, 2026-11-21: max 8.4e-5, rmse 2.2e-5.
            let within = Within { max_abs: 2e-4, rmse: 5e-5, bias: 2e-5 };
            assert_eq!(fault(&found, &expected, within), None, "{size:?}, {name}");
        }
    }
}

#[test]
fn nothing_of_the_scene_before_stays_when_function_or_unit_change() {
    let Some(mut drawer) = drawer() else { return };
    let within = Within { max_abs: 2e-3, rmse: 1e-4, bias: 2e-5 };
    let mut scene = scene(Lattice::unit([9; 3]), DVec3::new(0.5, -0.4, 0.7));
    agrees(&mut drawer, "as it opens", &scene, within);
    transfer_of(&mut scene).opacity = vec![(40.0, 0.5), (120.0, 0.0)];
    agrees(&mut drawer, "another function", &scene, within);
    scene.splat.opacity_unit_distance = Some(3.0);
    agrees(&mut drawer, "another unit distance", &scene, within);
    // Nodes depend on the unit through the hierarchy, not only through the frame.
    let coarse = Rung::Subsampled { level: 2 };
    let (warm, _) = drawn(&mut drawer, &scene, SIZE, coarse);
    scene.splat.opacity_unit_distance = Some(0.5);
    let (other, _) = drawn(&mut drawer, &scene, SIZE, coarse);
    assert!(fault(&other, &warm, within).is_some(), "six times the depth changes the picture");
}

#[test]
fn no_data_stays_nothing_where_even_the_least_value_is_opaque() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = scene(Lattice::unit([6; 3]), DVec3::new(0.5, -0.4, 0.7));
    let values = (0..216).map(|i| if i % 3 == 0 { f32::NAN } else { (i % 50) as f32 });
    let values = volume(scene.lattice(), Samples::Float32(values.collect()));
    scene = with_field(scene, values);
    transfer_of(&mut scene).opacity = vec![(0.0, 0.6), (50.0, 0.2)];
    agrees(
        &mut drawer,
        "NaN beside opaque lows",
        &scene,
        Within { max_abs: 2e-3, rmse: 1e-4, bias: 2e-5 },
    );
}

#[test]
fn light_is_finite_and_alpha_within_0_and_1_however_deep_a_voxel_is() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = scene(Lattice::unit([12; 3]), DVec3::new(0.5, -0.4, 0.7));
    // From nearly clear to opaque: the polynomial's rim is where a depth could turn negative.
    transfer_of(&mut scene).opacity = vec![(0.0, 0.0), (255.0, 1.0)];
    // Basis functions are summed up before they are coloured.
    for kernel in Kernel::ALL.into_iter().filter(|kernel| kernel.is_of_samples()) {
        scene.splat.kernel = kernel;
        for unit in [1.0, 1e-4, 1e-8, 1e-12, 1e-30] {
            scene.splat.opacity_unit_distance = Some(unit);
            let (light, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
            for (i, pixel) in light.iter().enumerate() {
                let sound = pixel.iter().all(|c| c.is_finite() && (0.0..=1.0 + 1e-6).contains(c));
                assert!(sound, "{} at unit {unit}, pixel {i}: {pixel:?}", kernel.name());
            }
            let most = light.iter().map(|p| p[3]).fold(0.0, f64::max);
            assert!(most > 0.9, "{} at unit {unit}: {most}", kernel.name());
        }
    }
}

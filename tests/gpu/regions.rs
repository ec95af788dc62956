//! Regions of value and gradient strength, against the float64 reference.

use glam::{DMat3, DVec3};
use voxsplat::accuracy::{Difference, rmse};
use voxsplat::core::Srgb8;
use voxsplat::gpu::{Renderer, SlabField, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    Amounts, Classify, Index, Lighting, OpacityModel, Order, Scene, Shading, SplatSettings,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::transfer::{Region, RegionShape};
use voxsplat::volume::{Lattice, Samples};

use crate::support::*;

const SIZE: [u32; 2] = [48, 40];

/// Measured: max 2.8e-4 to 8.7e-4, rmse 1.5e-5 to 7.0e-5, bias to -1.2e-5.
const WITHIN: Within = Within { max_abs: 2e-3, rmse: 1.4e-4, bias: 3e-5 };

fn lattice() -> Lattice {
    Lattice { spacing: DVec3::new(1.0, 1.3, 0.7), ..Lattice::unit([11, 9, 13]) }
}

/// One of each shape, over most of what noise has of values and strengths; two of them overlap.
fn regions() -> Vec<Region> {
    let of = |shape, values, strengths| Region {
        shape,
        values,
        strengths,
        softness: 0.6,
        opacity: 0.5,
        colour: None,
    };
    let red = Some(Srgb8([255, 40, 10]));
    vec![
        Region { colour: red, ..of(RegionShape::Ellipse, [60.0, 190.0], [10.0, 130.0]) },
        Region { opacity: 0.9, ..of(RegionShape::Triangle, [120.0, 250.0], [0.0, 160.0]) },
        of(RegionShape::Rectangle, [20.0, 100.0], [0.0, 60.0]),
    ]
}

fn painted(shading: Shading) -> Scene {
    let scene = scene(lattice(), DVec3::new(0.4, 0.9, -0.5));
    Scene { splat: SplatSettings::EXACT, shading, ..scene }
}

fn by_regions() -> Shading {
    Shading { regions: regions(), ..Shading::default() }
}

fn reference(scene: &Scene) -> Light {
    Reference::new(scene, SIZE.map(|n| n as usize)).expect("a mode with meaning").picture()
}

#[track_caller]
fn agrees(name: &str, scene: &Scene, within: Within) {
    let expected = reference(scene);
    let mut without = scene.clone();
    without.shading.regions.clear();
    let apart = rmse(&expected, &reference(&without)).expect("one size");
    assert!(apart > 20.0 * within.rmse, "{name}: regions change little: {apart:e}");
    let Some(mut drawer) = drawer() else { return };
    let (found, _) = drawn(&mut drawer, scene, SIZE, Rung::Full);
    print_measured(name, &found, &expected);
    assert_eq!(fault(&found, &expected, within), None, "{name}");
}

#[test]
fn regions_are_the_references_with_every_kernel_and_classification() {
    use Classify::{After, PreIntegrated};
    for (kernel, classify) in [
        (Kernel::BSpline, PreIntegrated),
        (Kernel::BSpline, After),
        (Kernel::Linear, PreIntegrated),
        (Kernel::Cubic, After),
    ] {
        let mut scene = painted(by_regions());
        (scene.splat.kernel, scene.splat.classify) = (kernel, classify);
        agrees(&format!("{} {}", kernel.name(), classify.name()), &scene, WITHIN);
    }
}

#[test]
fn each_shape_is_the_references_in_every_geometry_order_and_opacity() {
    for region in regions() {
        let alone = Shading { regions: vec![region], ..Shading::default() };
        agrees(region.shape.name(), &painted(alone), WITHIN);
    }
    agrees("perspective", &in_perspective(painted(by_regions()), 60.0), WITHIN);
    let mut scene = painted(by_regions());
    scene.splat.order = Order::BackToFront;
    agrees("back to front", &scene, WITHIN);
    scene.splat.opacity_model = OpacityModel::Published;
    agrees("published", &scene, WITHIN);
    let sheared = Lattice {
        direction: DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.4, 0.9, 0.0).normalize(),
            DVec3::new(0.2, -0.1, -0.9).normalize(),
        ),
        ..lattice()
    };
    let mut scene = self::scene(sheared, DVec3::new(-0.3, 0.8, 0.6));
    (scene.splat, scene.shading) = (SplatSettings::EXACT, by_regions());
    agrees("sheared", &scene, WITHIN);
}

/// Lights fall on what regions show, and a modulation thins it out; a table of opacity takes their place.
#[test]
fn lights_and_tables_beside_regions_are_the_references() {
    let lit = Shading { lighting: Some(Lighting::default()), ..by_regions() };
    agrees("lit", &painted(lit), WITHIN);
    let points = vec![(0.0, 1.0), (120.0, 0.2)];
    let modulation = Some(Amounts { index: Index::GradientStrength, points: points.clone() });
    agrees("modulated", &painted(Shading { modulation, ..by_regions() }), WITHIN);
    let opacity = Some(Amounts { index: Index::GradientStrength, points });
    let Some(mut drawer) = drawer() else { return };
    let both = painted(Shading { opacity: opacity.clone(), ..by_regions() });
    let alone = painted(Shading { opacity, ..Shading::default() });
    let pictures = [both, alone].map(|scene| drawn(&mut drawer, &scene, SIZE, Rung::Full).0);
    assert!(pictures[0] == pictures[1]);
}

/// More slabs come nearer to the integral, whose regions are looked up everywhere.
#[test]
fn regions_converge_to_the_integral() {
    let Some(mut drawer) = drawer() else { return };
    let scene = painted(by_regions());
    let truth = Reference::exact(&scene, SIZE.map(|n| n as usize)).expect("a mode").picture();
    let errors = [1.0, 4.0, 16.0].map(|slabs_per_voxel| {
        let splat = SplatSettings { slabs_per_voxel, ..scene.splat };
        let (found, _) = drawn(&mut drawer, &Scene { splat, ..scene.clone() }, SIZE, Rung::Full);
        print_measured(&format!("{slabs_per_voxel} slabs against the integral"), &found, &truth);
        rmse(&found, &truth).expect("one size")
    });
    // Measured: 0.10, 1.1e-2 and 2.0e-3.
    assert!(errors[0] > 3.0 * errors[1] && errors[1] > 3.0 * errors[2], "{errors:?}");
}

/// Between air and a dense ball the blur passes through the value of a second, softer ball. A function of
/// the value alone that shows the soft one shows a rim about the dense one as well.
#[test]
fn regions_tell_matter_from_the_blur_between_two_others() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([40, 20, 20]);
    let sample = |i: usize| {
        let p = DVec3::new((i % 40) as f64, (i / 40 % 20) as f64, (i / 800) as f64);
        let ball = |x: f64| {
            let outside = (p - DVec3::new(x, 9.5, 9.5)).length() - 6.0;
            (0.5 - outside / 4.0).clamp(0.0, 1.0)
        };
        (100.0 * ball(9.5) + 200.0 * ball(29.5)) as f32
    };
    let mut scene = scene(lattice, DVec3::NEG_Z);
    scene.camera = voxsplat::scene::framing_camera(&lattice, DVec3::NEG_Z, DVec3::Y);
    scene = with_field(
        scene,
        volume(lattice, Samples::Float32((0..lattice.len()).map(sample).collect())),
    );
    transfer_of(&mut scene).opacity = vec![(80.0, 0.0), (90.0, 0.5), (110.0, 0.5), (120.0, 0.0)];
    scene.splat = SplatSettings::EXACT;
    // The share of the light that comes from the side of the dense ball.
    let mut beside = |scene: &Scene| {
        let (found, _) = drawn(&mut drawer, scene, SIZE, Rung::Full);
        let alpha = |right: bool| -> f64 {
            let is_there = |i: &usize| (i % 48 >= 24) == right;
            (0..found.len()).filter(is_there).map(|i| found[i][3]).sum()
        };
        let (soft, dense) = (alpha(false), alpha(true));
        assert!(soft > 20.0, "the soft ball is seen: {soft}");
        dense.min(soft) / (soft + dense)
    };
    let by_value = beside(&scene);
    scene.shading.regions = vec![Region {
        shape: RegionShape::Rectangle,
        values: [80.0, 120.0],
        strengths: [0.0, 15.0],
        softness: 0.3,
        opacity: 0.5,
        colour: None,
    }];
    let by_both = beside(&scene);
    println!("measured light of the wrong ball: {by_value:.3} by value, {by_both:.5} by both");
    assert!(by_value > 0.2 && by_both < 0.01, "{by_value} {by_both}");
}

/// A scene without regions has the passes, pipelines, bytes and bits that it had before there were any.
#[test]
fn what_is_not_asked_for_costs_nothing_and_changes_no_bit() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let held = |drawer: &Drawer| {
        (
            drawer.engines.made_gpu().expect("a device").pipeline_count(),
            drawer.engines.made_gpu().expect("a device").size_bytes(),
        )
    };
    let plain = painted(Shading::default());
    let lit = painted(Shading { lighting: Some(Lighting::default()), ..Shading::default() });
    let [before, lit_before] = [&plain, &lit].map(|s| drawn(&mut drawer, s, SIZE, Rung::Full).0);
    let lit_held = held(&drawer);
    drawn(&mut drawer, &plain, SIZE, Rung::Full);
    let (pipelines, bytes) = held(&drawer);
    let (_, what) = drawn(&mut drawer, &painted(by_regions()), SIZE, Rung::Full);
    assert!(what.field == SlabField::Own);
    let shade = size_of::<voxsplat::gpu::layout::Shade>() as u64;
    assert_eq!(held(&drawer).0, pipelines + 1);
    let (_, with_regions) = held(&drawer);
    // The table by value has other cells.
    assert!(with_regions >= shade);
    let [after, lit_after] = [&plain, &lit].map(|s| drawn(&mut drawer, s, SIZE, Rung::Full).0);
    assert!(after == before && lit_after == lit_before);
    assert_eq!(held(&drawer), (lit_held.0 + 1, lit_held.1), "let go of");
    drawn(&mut drawer, &plain, SIZE, Rung::Full);
    assert_eq!(held(&drawer), (pipelines + 1, bytes));
}

/// The tents of previews beside what they stand for. Measured: see below.
#[test]
fn previews_are_painted_as_the_exact_picture_is() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([24; 3]);
    let smooth = |i: usize| {
        let [x, y, z] = [i % 24, i / 24 % 24, i / 576].map(|n| n as f64 / 24.0);
        let waves = (9.0 * x).sin() * (7.0 * y).cos() + (8.0 * z + 2.0 * x).sin();
        (128.0 + 60.0 * waves) as u8
    };
    let mut scene = painted(by_regions());
    scene = with_field(
        scene,
        volume(lattice, Samples::UInt8((0..lattice.len()).map(smooth).collect())),
    );
    scene.camera = voxsplat::scene::framing_camera(&lattice, scene.camera.direction, DVec3::Z);
    let (exact, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let by_value = Scene { shading: Shading::default(), ..scene.clone() };
    let (by_value, _) = drawn(&mut drawer, &by_value, SIZE, Rung::Full);
    let ticket = voxsplat::core::Ticket::new();
    let tents = voxsplat::kernel::nearest_tents(volume_of(&scene), &ticket).expect("made");
    let splat = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };
    let preview = SlabField::Preview;
    drawer
        .engines
        .gpu()
        .expect("a device")
        .set_field(preview, volume_of(&scene), &splat, tents, &ticket)
        .expect("set");
    let (quick, what) =
        drawn(&mut drawer, &scene, SIZE, Rung::Reduced { field: preview, shrink: 1.0 });
    assert_eq!(what.field, preview);
    let apart = |other: &Light| Difference::between(other, &exact).expect("one size");
    let (quick, by_value) = (apart(&quick), apart(&by_value));
    println!("measured tents {quick:?}\nby value {by_value:?}");
    assert!(quick.mean_brightness.abs() < 2.0 / 255.0, "{quick:?}");
    assert!(quick.rmse < 0.2 * by_value.rmse, "{quick:?} {by_value:?}");
}

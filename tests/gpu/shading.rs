//! Lights and shading tables, against the float64 reference's same mode.

use glam::{DMat3, DVec3};
use voxsplat::accuracy::Difference;
use voxsplat::core::Srgb8;
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    Amounts, Attached, Classify, Colours, Index, Light as Lamp, Lighting, OpacityModel, Order,
    Scene, Shading, SplatSettings,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::{Lattice, Samples};

use crate::support::{
    Light, Within, context, drawer, drawn, fault, in_perspective, print_measured, scene, volume,
    volume_of, with_field,
};

const SIZE: [u32; 2] = [36, 30];

/// Measured: max 2.4e-4 to 9.4e-4, rmse 1.6e-5 to 7.7e-5, bias to 8e-6.
const LIT: Within = Within { max_abs: 2e-3, rmse: 1.2e-4, bias: 2e-5 };
/// Tables have 255 cells, and cut the corners of what bends within one. Measured: max 4.4e-3, rmse
/// 1.4e-4, bias to 2.4e-5.
const LOOKED_UP: Within = Within { max_abs: 8e-3, rmse: 3e-4, bias: 5e-5 };

pub(crate) fn lattice() -> Lattice {
    Lattice { spacing: DVec3::new(1.0, 1.3, 0.7), ..Lattice::unit([11, 9, 13]) }
}

fn exact(scene: Scene) -> Scene {
    Scene { splat: SplatSettings::EXACT, ..scene }
}

fn shaded(shading: Shading) -> Scene {
    Scene { shading, ..exact(scene(lattice(), DVec3::new(0.4, 0.9, -0.5))) }
}

fn lamps() -> Lighting {
    let lamp = |direction, colour, attached| Lamp { direction, colour: Srgb8(colour), attached };
    Lighting {
        ambient: 0.2,
        diffuse: 0.6,
        specular: 0.5,
        exponent: 8.0,
        lights: vec![
            lamp(DVec3::new(-0.5, 0.6, 1.0), [255, 240, 200], Attached::Camera),
            lamp(DVec3::new(3.0, -2.0, 0.5), [40, 90, 255], Attached::Data),
        ],
    }
}

pub(crate) fn lit() -> Shading {
    Shading { lighting: Some(lamps()), ..Shading::default() }
}

#[track_caller]
pub(crate) fn agrees(name: &str, scene: &Scene, within: Within) {
    let Some(mut drawer) = drawer() else { return };
    let reference = Reference::new(scene, SIZE.map(|n| n as usize)).expect("a mode with meaning");
    let expected: Light = reference.picture();
    let plain = Scene { shading: Shading::default(), ..scene.clone() };
    let (plain, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    assert!(fault(&plain, &expected, within).is_some(), "{name} changes nothing");
    let (found, _) = drawn(&mut drawer, scene, SIZE, Rung::Full);
    print_measured(name, &found, &expected);
    assert_eq!(fault(&found, &expected, within), None, "{name}");
}

/// The ends of what an index takes in these scenes.
fn range(index: Index) -> [f64; 2] {
    match index {
        Index::Value => [0.0, 255.0],
        Index::GradientStrength => [0.0, 160.0],
        Index::GradientElevation => [-90.0, 90.0],
        Index::GradientAzimuth => [-180.0, 180.0],
        Index::ViewDepth => [0.1, 0.8],
    }
}

pub(crate) fn amounts(index: Index) -> Amounts {
    let [low, high] = range(index);
    let at = |share: f64| low + (high - low) * share;
    Amounts { index, points: vec![(at(0.0), 0.1), (at(0.3), 0.9), (at(0.6), 0.2), (at(1.0), 0.6)] }
}

pub(crate) fn colours(index: Index) -> Colours {
    let [low, high] = range(index);
    let stops = [[250, 30, 10], [20, 200, 90], [10, 60, 250]].map(Srgb8);
    let places = [low, 0.4 * high + 0.6 * low, high];
    Colours { index, stops: places.into_iter().zip(stops).collect() }
}

/// All four at a time, each by another index, so that every table meets every index.
#[test]
fn every_table_by_every_index_is_the_references() {
    for turn in 0..Index::ALL.len() {
        let by = |table: usize| Index::ALL[(turn + table) % Index::ALL.len()];
        let shading = Shading {
            opacity: Some(amounts(by(0))),
            modulation: Some(amounts(by(1))),
            reflection: Some(colours(by(2))),
            emission: Some(colours(by(3))),
            lighting: None,
            regions: Vec::new(),
        };
        agrees(&format!("opacity by {}, …", by(0).name()), &shaded(shading), LOOKED_UP);
    }
    let emission = Some(colours(Index::ViewDepth));
    agrees("no gradient", &shaded(Shading { emission, ..Shading::default() }), LOOKED_UP);
}

/// What lies below the first of two equal places is as that, not as the second: tables are 256 entries, in
/// which a step is as wide as a cell. Measured: rmse 6e-3, max 0.20, and 8e-5 where there is nothing else.
#[test]
fn tables_that_begin_with_a_step_are_clear_below_it() {
    let within = Within { max_abs: 0.3, rmse: 0.02, bias: 0.01 };
    for points in [vec![(120.0, 0.0), (120.0, 0.5), (255.0, 0.5)], vec![(120.0, 0.0), (120.0, 0.5)]]
    {
        let name = format!("{} points", points.len());
        let opacity = Some(Amounts { index: Index::Value, points });
        agrees(&name, &shaded(Shading { opacity, ..Shading::default() }), within);
    }
}

#[test]
fn lights_are_the_references_with_every_kernel_and_classification() {
    use Classify::{After, PreIntegrated};
    for (kernel, classify) in [
        (Kernel::Nearest, After),
        (Kernel::Linear, PreIntegrated),
        (Kernel::Gaussian, PreIntegrated),
        (Kernel::Cubic, After),
        (Kernel::BSpline, After),
        (Kernel::BSpline, PreIntegrated),
    ] {
        let mut scene = shaded(lit());
        (scene.splat.kernel, scene.splat.classify) = (kernel, classify);
        agrees(&format!("{} {}", kernel.name(), classify.name()), &scene, LIT);
    }
}

#[test]
fn lights_are_the_references_in_every_geometry_and_order() {
    let direction = DVec3::new(-0.3, 0.8, 0.6);
    let lit = |lattice| Scene { shading: lit(), ..exact(scene(lattice, direction)) };
    agrees("perspective", &in_perspective(lit(lattice()), 60.0), LIT);
    let sheared = Lattice {
        direction: DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.4, 0.9, 0.0).normalize(),
            DVec3::new(0.2, -0.1, -0.9).normalize(),
        ),
        ..lattice()
    };
    agrees("sheared", &lit(sheared), LIT);
    let tiny = Lattice { spacing: DVec3::splat(1e-6), ..Lattice::unit([8, 8, 8]) };
    agrees("tiny", &lit(tiny), LIT);
    let mut backwards = lit(lattice());
    backwards.splat.order = Order::BackToFront;
    agrees("back to front", &backwards, LIT);
    let mut published = lit(lattice());
    published.splat.opacity_model = OpacityModel::Published;
    published.shading.opacity = Some(amounts(Index::GradientStrength));
    agrees("published", &published, LOOKED_UP);
}

/// What has no direction scatters light as faces turned every way do in the mean, a half of it, without noise.
#[test]
fn a_constant_field_is_lit_as_faces_turned_every_way_are_in_the_mean() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = lattice();
    let mut scene = shaded(lit());
    scene = with_field(scene, volume(lattice, Samples::Float32(vec![180.25; lattice.len()])));
    let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let plain = Scene { shading: Shading::default(), ..scene };
    let (shining, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    assert!(shining.iter().any(|p| p[1] > 0.1));
    let Lighting { ambient, diffuse, lights, .. } = lamps();
    let falls = |c: usize| lights.iter().map(|light| light.colour.to_linear().0[c]).sum::<f64>();
    let factors = [0, 1, 2].map(|c| ambient + diffuse * 0.5 * falls(c));
    assert!(factors[0] > 0.3 && factors[0] != factors[1], "{factors:?}");
    for (found, shining) in found.iter().zip(&shining) {
        let lit = [0, 1, 2].map(|c| shining[c] * factors[c]);
        assert!((0..3).all(|c| (found[c] - lit[c]).abs() < 2e-6), "{found:?} {lit:?}");
        assert_eq!(found[3], shining[3]);
    }
}

/// Lights fade in from the least strength that has a direction to twice that: here it is 1.5 times as
/// much but near two corners, about which every strength is found. Floats, as 65 536 steps are too coarse for such a ramp.
/// Measured: max 4.8e-4, rmse 2.6e-5, bias -5.8e-6.
#[test]
fn lights_fade_in_from_the_least_strength_on() {
    let lattice = lattice();
    let count = lattice.len();
    let mut values: Vec<f32> = (0..count).map(|i| 180.0 + 0.0546 * (i % 11) as f32).collect();
    (values[0], values[count - 1]) = (0.0, 255.0);
    let mut scene = shaded(lit());
    scene = with_field(scene, volume(lattice, Samples::Float32(values)));
    agrees("about the least strength", &scene, LIT);
}

/// A scene without lights or tables is drawn with the passes, pipelines and bytes that it had before
/// there were any, and after they were used, as before, to the bit.
#[test]
fn what_is_not_asked_for_costs_nothing_and_changes_no_bit() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let plain = shaded(Shading::default());
    let (before, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    let held = |drawer: &Drawer| {
        (
            drawer.engines.made_gpu().expect("a device").pipeline_count(),
            drawer.engines.made_gpu().expect("a device").size_bytes(),
        )
    };
    let (pipelines, bytes) = held(&drawer);
    drawn(&mut drawer, &shaded(lit()), SIZE, Rung::Full);
    let (more_pipelines, more_bytes) = held(&drawer);
    assert_eq!(more_pipelines, pipelines + 1);
    let shade = size_of::<voxsplat::gpu::layout::Shade>() as u64;
    assert_eq!(more_bytes, bytes + shade);
    let (after, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    assert_eq!(after, before);
    assert_eq!(held(&drawer).1, bytes, "let go of");
}

/// The tents of previews, lit by their own derivative, beside what they stand for: about as bright, and
/// lit by the same lights. Measured: bias -1.7e-4, rmse 0.0122; against the picture without lights -0.05
/// and 0.109.
#[test]
fn previews_are_lit_as_the_exact_picture_is() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([24; 3]);
    let smooth = |i: usize| {
        let [x, y, z] = [i % 24, i / 24 % 24, i / 576].map(|n| n as f64 / 24.0);
        let waves = (9.0 * x).sin() * (7.0 * y).cos() + (8.0 * z + 2.0 * x).sin();
        (128.0 + 60.0 * waves) as u8
    };
    let mut scene = shaded(lit());
    scene = with_field(
        scene,
        volume(lattice, Samples::UInt8((0..lattice.len()).map(smooth).collect())),
    );
    scene.camera = voxsplat::scene::framing_camera(&lattice, scene.camera.direction, DVec3::Z);
    let (exact, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let plain = Scene { shading: Shading::default(), ..scene.clone() };
    let (shining, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    let ticket = voxsplat::core::Ticket::new();
    let tents = voxsplat::kernel::nearest_tents(volume_of(&scene), &ticket).expect("made");
    let preview = voxsplat::gpu::SlabField::Preview;
    let splat = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };
    drawer
        .engines
        .gpu()
        .expect("a device")
        .set_field(preview, volume_of(&scene), &splat, tents, &ticket)
        .expect("set");
    let (quick, drawn) =
        drawn(&mut drawer, &scene, SIZE, Rung::Reduced { field: preview, shrink: 1.0 });
    assert_eq!(drawn.field, preview);
    let apart = |a: &Light, b: &Light| Difference::between(a, b).expect("one size");
    let (lit, unlit) = (apart(&quick, &exact), apart(&quick, &shining));
    println!("measured lit {lit:?}\nunlit {unlit:?}");
    assert!(lit.mean_brightness.abs() < 1.0 / 255.0, "{lit:?}");
    assert!(lit.rmse < 0.2 * unlit.rmse, "{lit:?} {unlit:?}");
}

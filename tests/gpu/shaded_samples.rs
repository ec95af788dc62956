//! Samples that are shaded before their kernels are put together, against the float64 reference's same
//! mode.

use glam::{DMat3, DVec3};
use voxsplat::core::Ticket;
use voxsplat::gpu::{Renderer, SlabField, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    Amounts, Classify, Index, OpacityModel, Order, Scene, Shading, SplatSettings, View, Visibility,
    framing_camera,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::transfer::{NoData, Region, RegionShape};
use voxsplat::volume::{Lattice, Samples};

use crate::shading::{agrees, amounts, colours, lattice, lit};
use crate::support::{
    ON_HOST, Within, context, drawer, drawn, in_perspective, random, scene, transfer_of, volume,
    volume_of, with_field,
};

const SIZE: [u32; 2] = [36, 30];

const LIT: Within = Within { max_abs: 1e-3, rmse: 5e-5, bias: 3e-6 };
/// Tables have 255 cells, and cut the corners of what bends within one.
const LOOKED_UP: Within = Within { max_abs: 8e-3, rmse: 3e-4, bias: 5e-5 };

fn mode(kernel: Kernel, visibility: Visibility) -> SplatSettings {
    SplatSettings { kernel, visibility, ..SplatSettings::SHADE_FIRST }
}

fn shaded(shading: Shading, splat: SplatSettings) -> Scene {
    Scene { shading, splat, ..scene(lattice(), DVec3::new(0.4, 0.9, -0.5)) }
}

#[test]
fn samples_are_lit_as_the_reference_lights_them_in_every_mode() {
    use Visibility::{EverySample, Sheets, Slabs};
    for (kernel, visibility) in [
        (Kernel::Cubic, EverySample),
        (Kernel::Gaussian, Sheets),
        (Kernel::Point, EverySample),
        (Kernel::Nearest, EverySample),
        (Kernel::Linear, Slabs),
        (Kernel::BSpline, Slabs),
    ] {
        let name = format!("{} {}", kernel.name(), visibility.name());
        let scene = shaded(lit(), mode(kernel, visibility));
        agrees(&name, &scene, LIT);
        let mut published = scene;
        published.splat.opacity_model = OpacityModel::Published;
        published.splat.order = Order::FrontToBack;
        published.shading.modulation = Some(amounts(Index::GradientStrength));
        agrees(&format!("{name}, published"), &published, LOOKED_UP);
    }
}

#[test]
fn samples_are_lit_in_every_geometry_and_of_every_type() {
    let splat = mode(Kernel::Cubic, Visibility::Slabs);
    let seen = |lattice| {
        let scene = scene(lattice, DVec3::new(-0.3, 0.8, 0.6));
        Scene { shading: lit(), splat, ..scene }
    };
    agrees("perspective", &in_perspective(seen(lattice()), 60.0), LIT);
    let sheared = Lattice {
        direction: DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.4, 0.9, 0.0).normalize(),
            DVec3::new(0.2, -0.1, -0.9).normalize(),
        ),
        ..lattice()
    };
    agrees("sheared", &seen(sheared), LIT);
    let noise = |i: usize| ((i * 7919) % 251) as f64;
    let count = lattice().len();
    // Values are looked up by their type's own steps, and colours lie over 0 to 255.
    let holes = |i: usize| if i % 7 == 3 { f32::NAN } else { noise(i) as f32 };
    for (name, samples) in [
        ("signed bytes", Samples::Int8((0..count).map(|i| (noise(i) / 2.0) as i8).collect())),
        ("signed words", Samples::Int16((0..count).map(|i| noise(i) as i16).collect())),
        ("words", Samples::UInt16((0..count).map(|i| noise(i) as u16).collect())),
        ("floats with holes", Samples::Float32((0..count).map(holes).collect())),
    ] {
        let mut scene = seen(lattice());
        scene = with_field(scene, volume(lattice(), samples));
        scene.shading.reflection = Some(colours(Index::Value));
        agrees(name, &scene, LOOKED_UP);
    }
}

#[test]
fn every_table_by_every_index_and_regions_are_the_references() {
    let splat = mode(Kernel::Cubic, Visibility::EverySample);
    for turn in 0..Index::ALL.len() {
        let by = |table: usize| Index::ALL[(turn + table) % Index::ALL.len()];
        let shading = Shading {
            opacity: Some(amounts(by(0))),
            modulation: Some(amounts(by(1))),
            reflection: Some(colours(by(2))),
            emission: Some(colours(by(3))),
            ..Shading::default()
        };
        agrees(&format!("opacity by {}, …", by(0).name()), &shaded(shading, splat), LOOKED_UP);
    }
    let region = |shape, values, strengths, opacity| Region {
        shape,
        values,
        strengths,
        softness: 0.6,
        opacity,
        colour: None,
    };
    let regions = vec![
        region(RegionShape::Ellipse, [60.0, 190.0], [10.0, 130.0], 0.5),
        region(RegionShape::Triangle, [120.0, 250.0], [0.0, 160.0], 0.9),
    ];
    for published in [OpacityModel::OpticalDepth, OpacityModel::Published] {
        let mut scene = shaded(Shading { regions: regions.clone(), ..lit() }, splat);
        scene.splat.opacity_model = published;
        agrees(&format!("regions, {}", published.name()), &scene, LIT);
    }
}

/// A ramp has one gradient, up to its borders: what light falls on it is known without a reference, and
/// every pixel has its colour.
#[test]
fn a_ramp_is_lit_by_the_cosine_to_its_gradient_up_to_its_borders() {
    let mut shading = lit();
    let lighting = shading.lighting.as_mut().expect("lights");
    (lighting.ambient, lighting.diffuse, lighting.specular) = (0.1, 0.8, 0.0);
    lighting.lights.truncate(1);
    let lamp = &mut lighting.lights[0];
    (lamp.direction, lamp.attached) =
        (DVec3::new(-2.0, -1.0, 0.5), voxsplat::scene::Attached::Data);
    let light = lamp.colour.to_linear().0;
    let mut scene = shaded(shading, mode(Kernel::Cubic, Visibility::EverySample));
    let Lattice { dims, spacing, .. } = lattice();
    let value = |i: usize| {
        let [x, y, z] = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        (5 * x + 4 * y + 3 * z) as u8
    };
    scene = with_field(
        scene,
        volume(lattice(), Samples::UInt8((0..lattice().len()).map(value).collect())),
    );
    let colour = [0.25, 0.5, 0.75];
    let grey = voxsplat::core::Srgb8([137, 188, 225]);
    *transfer_of(&mut scene) = voxsplat::transfer::TransferFunction::of(
        vec![(0.0, 0.3)],
        voxsplat::transfer::ColourSource::Stops(vec![(0.0, grey)]),
    );
    assert!((0..3).all(|c| (grey.to_linear().0[c] - colour[c]).abs() < 3e-3), "an even colour");
    let normal = -(DVec3::new(5.0, 4.0, 3.0) / spacing).normalize();
    // Turned to the eye.
    let normal = if normal.dot(scene.camera.direction) > 0.0 { -normal } else { normal };
    let cosine = normal.dot(DVec3::new(-2.0, -1.0, 0.5).normalize()).max(0.0);
    assert!(cosine > 0.2, "{normal} {cosine}");
    let expected: [f64; 3] =
        std::array::from_fn(|c| grey.to_linear().0[c] * (0.1 + 0.8 * cosine * light[c]));
    let reference = Reference::new(&scene, SIZE.map(|n| n as usize)).expect("a mode").picture();
    let mut pictures = vec![reference];
    if let Some(mut drawer) = drawer() {
        pictures.push(drawn(&mut drawer, &scene, SIZE, Rung::Full).0);
    }
    for picture in pictures {
        let seen: Vec<_> = picture.iter().filter(|p| p[3] > 0.05).collect();
        assert!(seen.len() > 100);
        for pixel in seen {
            for c in 0..3 {
                let share = pixel[c] / pixel[3];
                assert!((share - expected[c]).abs() < 2e-5, "{pixel:?} {expected:?}");
            }
        }
    }
}

#[test]
fn what_is_not_asked_for_costs_nothing_and_changes_no_bit() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let splat = mode(Kernel::Cubic, Visibility::Slabs);
    let plain = shaded(Shading::default(), splat);
    let (before, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    let held = |drawer: &Drawer| {
        (
            drawer.engines.made_gpu().expect("a device").pipeline_count(),
            drawer.engines.made_gpu().expect("a device").size_bytes(),
        )
    };
    let (pipelines, bytes) = held(&drawer);
    let (_, is_lit) = drawn(&mut drawer, &shaded(lit(), splat), SIZE, Rung::Full);
    assert!(is_lit.is_shaded);
    let (more_pipelines, more_bytes) = held(&drawer);
    assert_eq!(more_pipelines, pipelines + 2, "one shades samples, one gathers them");
    // All bricks show, of 11 x 9 x 13 samples: 2 x 2 x 2, 8^3 samples each, of 16 bytes.
    let shade = size_of::<voxsplat::gpu::layout::Shade>() as u64 + 8 * 512 * 16 + 16;
    assert_eq!(
        (more_bytes, drawer.engines.gpu().expect("a device").shading_bytes()),
        (bytes + shade, shade)
    );
    let (after, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    assert_eq!(after, before);
    assert_eq!(held(&drawer).1, bytes, "let go of");
}

/// They stay while nothing changes that they depend on, and are shaded anew for another view.
#[test]
fn samples_are_shaded_once_a_view() {
    let Some(mut drawer) = drawer() else { return };
    for kernel in [Kernel::Cubic, Kernel::Linear] {
        let mut scene = in_perspective(shaded(lit(), mode(kernel, Visibility::Slabs)), 50.0);
        scene.shading.modulation = Some(amounts(Index::GradientStrength));
        drawn(&mut drawer, &scene, SIZE, Rung::Full);
        let unit = scene.opacity_unit_distance();
        let lit = Plan::of(&scene, SIZE);
        let plain = Plan { shading: Shading::default(), ..lit.clone() };
        let camera = scene.camera.orbited(0.2, 0.0);
        let turned = View::new(&Scene { camera, ..scene.clone() }, SIZE);
        let view = View::new(&scene, SIZE);
        let renderer = drawer.engines.gpu().expect("a device");
        renderer.begin_plan(&lit).expect("begun");
        assert_eq!(renderer.bricks_to_shade(&view, &scene.splat, unit), Ok(0), "all are there");
        assert_eq!(renderer.bricks_to_shade(&turned, &scene.splat, unit), Ok(8), "another view");
        // Lets go of what was shaded.
        renderer.begin_plan(&plain).expect("begun");
        assert_eq!(renderer.bricks_to_shade(&view, &scene.splat, unit), Ok(0), "none to shade");
        renderer.begin_plan(&lit).expect("begun");
        assert_eq!(renderer.bricks_to_shade(&view, &scene.splat, unit), Ok(8), "all to shade");
    }
}

/// More of them than a buffer holds are refused, before any room is taken.
#[test]
fn more_samples_than_there_is_room_for_are_refused() {
    let Some(mut context) = context(ON_HOST) else { return };
    // Eight bricks of 8^3 samples, of 16 bytes.
    context.limits.max_storage_buffer_binding_size = 8 * 512 * 16 - 16;
    let mut drawer = Drawer::new(Renderer::new(context));
    let scene = shaded(lit(), mode(Kernel::Cubic, Visibility::Slabs));
    let plan = Plan::of(&scene, SIZE);
    drawer.prepare(&plan, &Ticket::new()).expect("prepared");
    let refused = drawer.draw(&plan, Rung::Full, &mut ()).expect_err("too many").to_string();
    assert!(refused.contains("shaded samples that can show of at most 4095"), "{refused}");
    assert!(refused.contains("found 4096"), "{refused}");
    let plain = shaded(Shading::default(), mode(Kernel::Cubic, Visibility::Slabs));
    drawn(&mut drawer, &plain, SIZE, Rung::Full);
}

/// Octree cuts are unlit; tents are not. Beside them, samples that are shaded first.
#[test]
fn quick_pictures_of_shaded_samples_are_lit() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([24; 3]);
    let smooth = |i: usize| {
        let [x, y, z] = [i % 24, i / 24 % 24, i / 576].map(|n| n as f64 / 24.0);
        let waves = (9.0 * x).sin() * (7.0 * y).cos() + (8.0 * z + 2.0 * x).sin();
        (128.0 + 60.0 * waves) as u8
    };
    let mut scene = shaded(lit(), mode(Kernel::Cubic, Visibility::EverySample));
    scene = with_field(
        scene,
        volume(lattice, Samples::UInt8((0..lattice.len()).map(smooth).collect())),
    );
    scene.camera = framing_camera(&lattice, scene.camera.direction, DVec3::Z);
    let (full, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let plain = Scene { shading: Shading::default(), ..scene.clone() };
    let (unlit, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    let ticket = Ticket::new();
    let tents = voxsplat::kernel::nearest_tents(volume_of(&scene), &ticket).expect("made");
    let splat = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };
    let preview = SlabField::Preview;
    drawer
        .engines
        .gpu()
        .expect("a device")
        .set_field(preview, volume_of(&scene), &splat, tents, &ticket)
        .expect("set");
    let (quick, what) = drawn(&mut drawer, &scene, SIZE, Rung::Coarse { budget_ms: 1e4 });
    assert!(what.is_shaded && what.is_reduced && what.field == preview, "{what:?}");
    let apart = |other| voxsplat::accuracy::Difference::between(&quick, other).expect("one size");
    let (lit, unlit) = (apart(&full), apart(&unlit));
    println!("measured lit {lit:?}\nunlit {unlit:?}");
    assert!(lit.rmse < 0.5 * unlit.rmse, "{lit:?} {unlit:?}");
    // Without shading the same mode has its octree.
    let (_, what) = drawn(&mut drawer, &plain, SIZE, Rung::Coarse { budget_ms: 1e4 });
    assert!(!what.is_reduced && !what.is_shaded);
    assert_eq!(plain.splat.classify, Classify::Before);
}

/// Few of many bricks show: their samples lie one after the other, by a count over words of bits, and
/// bricks that do not show have none. In pieces, they are the same.
#[test]
fn bricks_that_show_are_found_among_many_that_do_not() {
    let lattice = Lattice::unit([26, 26, 18]);
    // 4 x 4 x 3 bricks: two words of bits.
    let brick = |i: usize| (i % 26 / 8) + 4 * (i / 26 % 26 / 8) + 16 * (i / 676 / 8);
    let shows = |i: usize| random(4, brick(i)) < 0.4;
    let value = |i: usize| if shows(i) { (random(3, i) * 255.0) as u8 } else { 40 };
    let direction = DVec3::new(0.4, 0.9, -0.5);
    let splat = mode(Kernel::Linear, Visibility::Slabs);
    let mut scene = Scene { shading: lit(), splat, ..scene(lattice, direction) };
    // One ray a pixel.
    scene.camera.parallel_scale *= 0.5;
    let samples = (0..lattice.len()).map(value).collect();
    scene = with_field(scene, volume(lattice, Samples::UInt8(samples)));
    agrees("scattered bricks", &scene, LIT);

    let Some(mut drawer) = drawer() else { return };
    let (whole, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let view = View::new(&scene, SIZE);
    let unit = scene.opacity_unit_distance();
    let renderer = drawer.engines.gpu().expect("a device");
    // Lets go of what was shaded.
    let lit = Plan::of(&scene, SIZE);
    let plain = Plan { shading: Shading::default(), ..lit.clone() };
    renderer.begin_plan(&plain).expect("begun");
    assert_eq!(renderer.bricks_to_shade(&view, &scene.splat, unit), Ok(0));
    renderer.begin_plan(&lit).expect("begun");
    assert_eq!(renderer.bricks_to_shade(&view, &scene.splat, unit), Ok(48));
    for piece in [0..7, 7..38, 38..48] {
        renderer.shade_bricks(piece).expect("shaded");
    }
    renderer.begin(&view, scene.splat.kernel.splatted(), None, unit).expect("begun");
    let tiles = 0..voxsplat::gpu::tile_count(SIZE);
    renderer.draw_gathered(&view, &scene.splat, unit, 2e-4_f32.into(), tiles).expect("drawn");
    let pieces = crate::support::wide(&renderer.read_light().expect("read"));
    renderer.end_plan();
    assert_eq!(pieces, whole);
}

/// Samples without data that show have their colour and opacity, in either model, and no light on them.
#[test]
fn samples_without_data_that_show_are_not_lit() {
    let holes = |i: usize| if i % 7 == 3 { f32::NAN } else { (random(6, i) * 255.0) as f32 };
    for model in [OpacityModel::OpticalDepth, OpacityModel::Published] {
        let mut scene = shaded(lit(), mode(Kernel::Cubic, Visibility::EverySample));
        let samples = (0..lattice().len()).map(holes).collect();
        scene = with_field(scene, volume(lattice(), Samples::Float32(samples)));
        transfer_of(&mut scene).no_data =
            NoData { opacity: 0.6, colour: voxsplat::core::Srgb8([250, 0, 200]) };
        scene.splat.opacity_model = model;
        agrees(&format!("holes that show, {}", model.name()), &scene, LIT);
    }
}

/// Where buffers are small, samples lie in several, with neighbours in two of them.
#[test]
fn samples_in_several_buffers_are_lit_as_those_in_one() {
    let Some(mut one) = drawer() else { return };
    let Some(mut context) = context(ON_HOST) else { return };
    // Of shaded samples as many as four bricks have; 45 968 bytes, or twice as many, of others.
    context.limits.max_storage_buffer_binding_size = 4 * 512 * 16;
    let mut several = Drawer::new(Renderer::new(context));
    let lattice = Lattice::unit([26, 26, 34]);
    // Two bricks, through which the buffers are divided: at half the samples, and at two thirds.
    let shows = |i: usize| {
        let [x, y, z] = [i % 26, i / 26 % 26, i / 676];
        x < 8 && (8..16).contains(&y) && (16..24).contains(&z)
    };
    let value = |i: usize| if shows(i) { 1.0 + random(9, i) * 254.0 } else { 0.0 };
    let count = lattice.len();
    for samples in [
        Samples::UInt16((0..count).map(|i| value(i) as u16).collect()),
        Samples::Float32((0..count).map(|i| value(i) as f32).collect()),
    ] {
        let splat = mode(Kernel::Linear, Visibility::Slabs);
        let mut scene =
            Scene { shading: lit(), splat, ..scene(lattice, DVec3::new(0.4, 0.9, -0.5)) };
        scene = with_field(scene, volume(lattice, samples));
        transfer_of(&mut scene).opacity = vec![(0.0, 0.0), (0.9, 0.0), (1.0, 0.4), (255.0, 0.9)];
        let (expected, _) = drawn(&mut one, &scene, SIZE, Rung::Full);
        let (found, what) = drawn(&mut several, &scene, SIZE, Rung::Full);
        assert!(what.is_shaded && expected.iter().any(|p| p[3] > 0.5));
        assert!(found == expected);
    }
}

/// Depths count from the volume's middle, through an eye too, and opacities of 1 have an end.
#[test]
fn depths_before_an_eye_and_opacities_of_one_are_the_references() {
    let splat = mode(Kernel::Cubic, Visibility::Slabs);
    let emission = Some(colours(Index::ViewDepth));
    let deep = shaded(Shading { emission, ..Shading::default() }, splat);
    agrees("depths in perspective", &in_perspective(deep, 60.0), LOOKED_UP);
    let points = vec![(0.0, 1.0), (160.0, 1.0)];
    let opacity = Some(Amounts { index: Index::GradientStrength, points });
    // Nothing is as thick as what is opaque. Measured: max 2.4e-3, rmse 3.6e-4, bias -2.9e-6.
    let within = Within { rmse: 6e-4, ..LOOKED_UP };
    agrees("opaque", &shaded(Shading { opacity, ..Shading::default() }, splat), within);
}

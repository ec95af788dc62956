//! Sample types and values that are easy to get wrong, against the float64 reference.

use glam::DVec3;
use voxsplat::accuracy::Difference;
use voxsplat::core::Srgb8;
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::reference::{Rays, Reference};
use voxsplat::scene::{
    AlongRay, Amounts, Classify, Index, Inside, Lighting, Scene, Slice, SplatSettings,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction};
use voxsplat::volume::{Lattice, Samples};

use super::scenes::*;
use super::{assert_none, held};
use crate::support::{drawer, drawn};

/// Measured: max 1.5e-3 (opacity 1), rmse 4.1e-5, bias 3.1e-6; the same for samples with a table
/// entry a code and for those looked up between 65 536 entries.
const EXACT: Within = Within { max_abs: 2e-3, rmse: 6e-5, bias: 5e-6 };

/// Of a step of colour. Measured on llvmpipe, 2026-11-23: max 8.7e-4, rmse 5.4e-5, bias 1.9e-6.
const STEP: Within = Within { max_abs: 1.5e-3, rmse: 8e-5, bias: 4e-6 };

const DIMS: [usize; 3] = [9, 8, 10];
const COUNT: usize = 720;
const OBLIQUE: DVec3 = DVec3::new(-0.6, 0.3, -0.7);

fn with_samples(samples: Samples, transfer: TransferFunction) -> Scene {
    let lattice = Lattice::unit(DIMS);
    with_transfer(with_field(scene(lattice, OBLIQUE), volume(lattice, samples)), transfer)
}

/// 0..256, one a sample.
fn values() -> impl Iterator<Item = f64> {
    (0..COUNT).map(|i| random(11, i) * 256.0)
}

#[test]
fn every_scalar_type_is_drawn_by_its_values() {
    let Some(mut drawer) = drawer() else { return };
    let cases = [
        ("uint8", Samples::UInt8(values().map(|v| v as u8).collect()), moved(1.0, 0.0)),
        ("int8", Samples::Int8(values().map(|v| (v - 128.0) as i8).collect()), moved(1.0, -128.0)),
        (
            "uint16",
            Samples::UInt16(values().map(|v| (v * 255.0) as u16).collect()),
            moved(255.0, 0.0),
        ),
        (
            "int16",
            Samples::Int16(values().map(|v| (v * 200.0 - 3e4) as i16).collect()),
            moved(200.0, -3e4),
        ),
        ("uint32", Samples::UInt32(values().map(|v| (v * 1e7) as u32).collect()), moved(1e7, 0.0)),
        (
            "int32",
            Samples::Int32(values().map(|v| (v - 1000.0) as i32).collect()),
            moved(1.0, -1000.0),
        ),
        ("int64", Samples::Int64(values().map(|v| (v * 1e12) as i64).collect()), moved(1e12, 0.0)),
        ("float32", Samples::Float32(values().map(|v| v as f32).collect()), moved(1.0, 0.0)),
        ("float64", Samples::Float64(values().map(|v| v * -1e-9).collect()), reversed()),
    ];
    for (name, samples, transfer) in cases {
        agrees(&mut drawer, name, &with_samples(samples, transfer), EXACT);
    }
}

/// Opaque where values are most negative.
fn reversed() -> TransferFunction {
    TransferFunction::of(
        vec![(-255e-9, 0.9), (-90e-9, 0.0)],
        ColourSource::Map { map: ColourMap::Viridis, range: [-90e-9, -255e-9] },
    )
}

/// Integers above 2²⁴ with a spread of 256, and floats near 1e6 with a spread of 1.
#[test]
fn small_differences_of_large_values_are_kept() {
    let Some(mut drawer) = drawer() else { return };
    let large = 2_000_000_000;
    let integers = Samples::Int32(values().map(|v| large + v as i32).collect());
    agrees(&mut drawer, "2e9 + 0..256", &with_samples(integers, moved(1.0, 2e9)), EXACT);
    let floats = Samples::Float64(values().map(|v| 1e6 + v / 256.0).collect());
    agrees(&mut drawer, "1e6 + 0..1", &with_samples(floats, moved(1.0 / 256.0, 1e6)), EXACT);
    let huge = Samples::Float32(values().map(|v| v as f32 * 1e30).collect());
    agrees(&mut drawer, "1e30", &with_samples(huge, moved(1e30, 0.0)), EXACT);
    let tiny = Samples::Float32(values().map(|v| v as f32 * 1e-25).collect());
    agrees(&mut drawer, "1e-25", &with_samples(tiny, moved(1e-25, 0.0)), EXACT);
}

/// What 32 bits have no room for reaches the device in another unit, and no infinity does. A range of 1e-300 is a step to
/// tables of transfer functions.
#[test]
fn values_of_1e300_are_drawn_as_any_others_and_ranges_of_1e_minus_300_give_finite_light() {
    let Some(mut drawer) = drawer() else { return };
    let samples = Samples::Float64(values().map(|v| v * 1e300).collect());
    agrees(&mut drawer, "1e300", &with_samples(samples, moved(1e300, 0.0)), EXACT);
    // And beside a transfer function that is far from the data.
    let units = [(1e-300, 1e-300), (1.0, 1e300), (1.0, 1e-300), (1e300, 1.0), (1e-300, 1.0)];
    for (samples, unit) in units {
        for splat in [SplatSettings::SHADE_FIRST, SplatSettings::EXACT] {
            let values = Samples::Float64(values().map(|v| v * samples).collect());
            let scene = Scene { splat, ..with_samples(values, moved(unit, 0.0)) };
            let (light, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
            assert!(light.iter().flatten().all(|v| v.is_finite()), "{samples:e} by {unit:e}");
        }
    }
}

#[test]
fn nan_is_nothing_and_infinities_are_the_ends_of_the_table() {
    let Some(mut drawer) = drawer() else { return };
    let mut transfer = moved(1.0, 0.0);
    // The lower end shows too, so that −∞ does.
    transfer.opacity = vec![(0.0, 0.5), (60.0, 0.0), (160.0, 0.1), (255.0, 0.9)];
    let odd = |i: usize, v: f64| match i % 7 {
        0 => f64::NAN,
        1 => f64::INFINITY,
        2 => f64::NEG_INFINITY,
        _ => v,
    };
    let wide: Vec<f64> = values().enumerate().map(|(i, v)| odd(i, v)).collect();
    let narrow = wide.iter().map(|&v| v as f32).collect();
    agrees(
        &mut drawer,
        "NaN, ±∞ float32",
        &with_samples(Samples::Float32(narrow), transfer.clone()),
        EXACT,
    );
    agrees(&mut drawer, "NaN, ±∞ float64", &with_samples(Samples::Float64(wide), transfer), EXACT);
}

/// Steps lie between the values that occur: a table smears those of floats over one entry.
#[test]
fn steps_and_zero_width_functions_are_sharp() {
    let Some(mut drawer) = drawer() else { return };
    let steps = TransferFunction::of(
        vec![(99.5, 0.0), (99.5, 0.7), (180.5, 0.7), (180.5, 0.1)],
        ColourSource::Stops(vec![(140.5, Srgb8([255, 0, 0])), (140.5, Srgb8([0, 0, 255]))]),
    );
    let one_value = TransferFunction {
        opacity: vec![(120.0, 0.0), (120.0, 0.8), (120.0, 0.8), (121.0, 0.0)],
        ..steps.clone()
    };
    let at_one_point =
        TransferFunction { opacity: vec![(100.0, 0.0), (100.0, 0.6)], ..steps.clone() };
    for (name, transfer) in
        [("steps", steps), ("one value", one_value), ("one point", at_one_point)]
    {
        let bytes = Samples::UInt8(values().map(|v| v as u8).collect());
        let words = Samples::Int32(values().map(|v| v as i32).collect());
        let floats = Samples::Float32(values().map(|v| v.floor() as f32).collect());
        agrees(
            &mut drawer,
            &format!("{name}, uint8"),
            &with_samples(bytes, transfer.clone()),
            EXACT,
        );
        agrees(
            &mut drawer,
            &format!("{name}, int32"),
            &with_samples(words, transfer.clone()),
            EXACT,
        );
        agrees(&mut drawer, &format!("{name}, float32"), &with_samples(floats, transfer), EXACT);
    }
}

/// Two stops at one value and no others: below it the first colour, from it on the second, whatever looks
/// the values up; the step lies at values that occur.
#[test]
fn two_colours_at_one_value_are_a_step_there_in_every_way_of_drawing() {
    let Some(mut drawer) = drawer() else { return };
    let size = [36, 30];
    let [red, green] = [Srgb8([255, 0, 0]), Srgb8([0, 255, 0])];
    let transfer = TransferFunction::of(
        vec![(-200.0, 0.3)],
        ColourSource::Stops(vec![(0.0, red), (0.0, green)]),
    );
    let moved = |v: f64| v.floor() - 128.0;
    let words =
        with_samples(Samples::Int32(values().map(|v| moved(v) as i32).collect()), transfer.clone());
    let floats =
        with_samples(Samples::Float32(values().map(|v| moved(v) as f32).collect()), transfer);
    let with = |scene: &Scene, inside: Inside, splat: SplatSettings| Scene {
        inside,
        splat,
        ..scene.clone()
    };
    let slices = vec![Slice::across(&Lattice::unit(DIMS), 1, 0.4, 1.0)];
    let after = SplatSettings { classify: Classify::After, ..SplatSettings::EXACT };
    let projected = Inside { along: AlongRay::Average, ..Inside::default() };
    let ways = [
        ("shade first", Inside::default(), SplatSettings::SHADE_FIRST),
        ("in the middle", Inside::default(), after),
        ("pre-integrated", Inside::default(), SplatSettings::EXACT),
        ("slice", Inside { slices, ..Inside::default() }, SplatSettings::EXACT),
        ("average", projected, SplatSettings::EXACT),
    ];
    for (kind, scene) in [("int32", words), ("float32", floats)] {
        for (way, inside, splat) in &ways {
            let scene = with(&scene, inside.clone(), *splat);
            let reference = Reference::new(&scene, size.map(|n| n as usize));
            let expected = reference.expect("a mode with meaning").picture();
            let shows = |c: usize| expected.iter().any(|pixel| pixel[c] > 0.1);
            assert!(shows(0) && shows(1), "{kind}, {way}: both sides are seen");
            let (found, _) = drawn(&mut drawer, &scene, size, Rung::Full);
            let name = format!("{kind}, {way}");
            print_measured(&name, &found, &expected);
            if *way != "average" {
                assert_eq!(fault(&found, &expected, STEP), None, "{name}");
                continue;
            }
            // Means so near to the step that the slabs' error takes them across. Measured: 6.
            let strays = found.iter().zip(&expected).filter(|(a, b)| (a[0] - b[0]).abs() > 1e-3);
            let strays = strays.count();
            println!("measured {name}: {strays} of {} on the other side", expected.len());
            assert!(strays <= 10, "{name}: {strays} of {}", expected.len());
        }
    }
}

fn constant_opacity(alpha: f64) -> Scene {
    let opacity = vec![(0.0, alpha)];
    with_samples(Samples::UInt8(vec![200; COUNT]), TransferFunction { opacity, ..transfer() })
}

#[test]
fn opacity_one_is_the_transmittance_floor_on_both_sides() {
    let Some(mut drawer) = drawer() else { return };
    let counted =
        |drawer: &Drawer, alpha| drawer.capped_count(&Plan::of(&constant_opacity(alpha), [8, 8]));
    agrees(&mut drawer, "alpha 1", &constant_opacity(1.0), EXACT);
    assert_eq!(counted(&drawer, 1.0), 256, "every entry of the table is counted");
    agrees(&mut drawer, "alpha 0.999", &constant_opacity(0.999), EXACT);
    assert_eq!(counted(&drawer, 0.999), 0);
    // One voxel alone, where the floor is what is seen.
    let mut one = scene(Lattice::unit([1, 1, 1]), OBLIQUE);
    one = with_field(one, volume(Lattice::unit([1, 1, 1]), Samples::UInt8(vec![200])));
    transfer_of(&mut one).opacity = vec![(0.0, 1.0)];
    agrees(&mut drawer, "one voxel of alpha 1", &one, EXACT);
}

/// By its definition: one box, one unit distance thick, lets 1e-4 through, and no more.
#[test]
fn the_transmittance_floor_is_one_part_in_ten_thousand() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([3, 3, 1]);
    let mut scene = with_kernel(scene(lattice, DVec3::Z), Kernel::Nearest);
    scene = with_field(scene, volume(lattice, Samples::UInt8(vec![200; 9])));
    transfer_of(&mut scene).opacity = vec![(0.0, 1.0)];
    let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let middle = found[40 * 96 + 48][3];
    // Measured: 1.0e-4 to within 1e-6.
    assert!((1.0 - middle - 1e-4).abs() < 3e-6, "{middle}");
}

/// A brick of infinities alone has no finite range, and is still seen.
#[test]
fn bricks_of_infinities_and_of_nan_alone_are_what_their_values_are() {
    let Some(mut drawer) = drawer() else { return };
    let lattice = Lattice::unit([24, 8, 8]);
    for value in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
        let sample = |i: usize| if i % 24 < 8 { value } else { (i % 24) as f32 };
        let mut scene = scene(lattice, OBLIQUE);
        scene = with_field(
            scene,
            volume(lattice, Samples::Float32((0..24 * 64).map(sample).collect())),
        );
        // Opaque at both ends, clear between but for 20..24.
        transfer_of(&mut scene).opacity = vec![(0.0, 0.4), (8.0, 0.0), (18.0, 0.0), (24.0, 0.4)];
        agrees(&mut drawer, &format!("a brick of {value}"), &scene, EXACT);
    }
}

/// Relative to a greatest alpha of about 1e-7: single precision keeps its digits near nothing.
#[test]
fn opacity_of_a_hundred_millionth_is_still_right_to_a_thousandth() {
    let Some(mut drawer) = drawer() else { return };
    let scene = constant_opacity(1e-8);
    let expected = reference(&scene, SIZE, Rays::Local);
    let most = expected.iter().map(|p| p[3]).fold(0.0, f64::max);
    assert!((5e-8..2e-7).contains(&most), "{most:e}");
    let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let scaled = |light: &Light| -> Light { light.iter().map(|p| p.map(|c| c / most)).collect() };
    let (found, expected) = (scaled(&found), scaled(&expected));
    print_measured("alpha 1e-8, relative", &found, &expected);
    // Measured: 1.1e-4, 5.0e-6, 1.3e-6.
    let within = Within { max_abs: 3e-4, rmse: 2e-5, bias: 4e-6 };
    assert_eq!(fault(&found, &expected, within), None);
}

/// Three things with whatever numbers, side by side and one in the other, opaque and half so.
fn things() -> Scene {
    let lattice = Lattice { spacing: DVec3::new(1.0, 1.2, 0.8), ..Lattice::unit([22, 18, 24]) };
    let name = |i: usize| {
        let at = DVec3::from([i % 22, i / 22 % 18, i / 396].map(|n| n as f64));
        let within = |middle: [f64; 3], radius: f64| at.distance(DVec3::from(middle)) < radius;
        match () {
            () if within([8.0, 8.0, 9.0], 3.0) => 29,
            () if within([8.0, 8.0, 9.0], 6.0) => 2,
            () if at.dot(DVec3::new(0.3, -0.4, 0.87)) > 14.0 => 7,
            () => 0,
        }
    };
    let samples = Samples::UInt8((0..lattice.len()).map(name).collect());
    let mut scene = with_field(scene(lattice, OBLIQUE), volume(lattice, samples));
    let step = |from: f64, to: f64, alpha: f64| [(from, alpha), (to, alpha)];
    transfer_of(&mut scene).opacity =
        [step(0.0, 1.0, 0.0), step(1.0, 6.0, 0.2), step(6.0, 30.0, 0.95)].concat();
    scene.splat = SplatSettings::NAMES;
    scene.shading.lighting = Some(Lighting::first_look());
    scene
}

/// Measured, 2026-11-30: native max 3.9e-4, rmse 3.2e-5, bias -4.8e-6; llvmpipe 4.0e-4, 8.8e-5, -3.0e-5.
#[test]
fn things_that_numbers_name_are_lit_where_they_end() {
    let Some(mut drawer) = drawer() else { return };
    let scene = things();
    let within = Within { bias: 4e-5, ..super::EXACT };
    assert_none(held(&mut drawer, "names", &scene, within));
    let mut by_table = scene.clone();
    // What looks the gradient up has the steps' own.
    by_table.shading.modulation =
        Some(Amounts { index: Index::GradientStrength, points: vec![(0.0, 1.0)] });
    let [(one, _), (other, _)] =
        [&scene, &by_table].map(|scene| drawn(&mut drawer, scene, SIZE, Rung::Full));
    let apart = Difference::between(&one, &other).expect("one size");
    assert!(apart.rmse > 0.01, "the rule changes nothing: {apart:?}");
}

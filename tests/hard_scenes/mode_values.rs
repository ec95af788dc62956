//! Values and transfer functions that are easy to get wrong, in every visibility, against the
//! float64 reference's same mode.

use glam::DVec3;
use voxsplat::core::Srgb8;
use voxsplat::scene::Scene;
use voxsplat::task::draw::Rung;
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction};
use voxsplat::volume::{Lattice, Samples, ScalarVolume};

use super::scenes::*;
use super::*;
use crate::support::{drawer, drawn};

const DIMS: [usize; 3] = [7, 6, 8];
const COUNT: usize = 336;

fn with_samples(samples: Samples, transfer: TransferFunction) -> Scene {
    let lattice = Lattice::unit(DIMS);
    let scene = scene(lattice, DVec3::new(-0.6, 0.3, -0.7));
    with_transfer(with_field(scene, volume(lattice, samples)), transfer)
}

/// 0..256, one a sample.
fn values() -> impl Iterator<Item = f64> {
    (0..COUNT).map(|i| random(11, i) * 256.0)
}

#[test]
fn values_of_every_size_and_sign() {
    let Some(mut drawer) = drawer() else { return };
    let mut faults = Vec::new();
    let cases = [
        (
            "uint32 above 2^24",
            Samples::UInt32(values().map(|v| 3_000_000_000 + v as u32).collect()),
            moved(1.0, 3e9),
        ),
        (
            "int64 above 2^24",
            Samples::Int64(values().map(|v| -(1 << 26) + v as i64).collect()),
            moved(1.0, -(2_f64.powi(26))),
        ),
        ("signed", Samples::Int16(values().map(|v| v as i16 - 128).collect()), moved(1.0, -128.0)),
        ("1e30", Samples::Float32(values().map(|v| v as f32 * 1e30).collect()), moved(1e30, 0.0)),
        (
            "denormals among others",
            Samples::Float32(values().map(|v| if v < 128.0 { 1e-40 } else { v as f32 }).collect()),
            moved(1.0, 0.0),
        ),
        ("1e6 + 0..1", Samples::Float64(values().map(|v| 1e6 + v / 256.0).collect()), {
            moved(1.0 / 256.0, 1e6)
        }),
        (
            "reversed",
            Samples::Float32(values().map(|v| v as f32).collect()),
            TransferFunction::of(
                vec![(0.0, 0.9), (120.0, 0.0)],
                ColourSource::Map { map: ColourMap::Viridis, range: [255.0, 0.0] },
            ),
        ),
        ("all equal, uint8", Samples::UInt8(vec![200; COUNT]), moved(1.0, 0.0)),
        ("all equal, float32", Samples::Float32(vec![200.25; COUNT]), moved(1.0, 0.0)),
        ("all 1e30", Samples::Float32(vec![200e30; COUNT]), moved(1e30, 0.0)),
    ];
    for (name, samples, transfer) in cases {
        faults.extend(in_modes(&mut drawer, name, &with_samples(samples, transfer)));
    }
    assert_none(faults);
}

#[test]
fn nan_and_infinities() {
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
    let mut faults = Vec::new();
    for (name, samples) in
        [("float32", Samples::Float32(narrow)), ("float64", Samples::Float64(wide))]
    {
        let scene = with_samples(samples, transfer.clone());
        faults.extend(in_modes(&mut drawer, &format!("NaN, ±∞ {name}"), &scene));
    }
    // Nothing else is no volume.
    for value in [f32::NAN, f32::INFINITY] {
        let samples = Samples::Float32(vec![value; COUNT]);
        let refused = ScalarVolume::from_samples("test", Lattice::unit(DIMS), samples);
        assert!(refused.is_err(), "{value}");
    }
    assert_none(faults);
}

#[test]
fn opacities_of_nothing_a_hundred_millionth_and_one() {
    let Some(mut drawer) = drawer() else { return };
    let constant = |alpha: f64| {
        let opacity = vec![(0.0, alpha)];
        let values = Samples::UInt8(values().map(|v| v as u8).collect());
        with_samples(values, TransferFunction { opacity, ..transfer() })
    };
    for (mode, scene, _) in modes(&constant(0.0)) {
        let (found, _) = drawn(&mut drawer, &scene, SMALL, Rung::Full);
        assert!(found.iter().all(|p| *p == [0.0; 4]), "alpha 0, {mode}");
    }
    for (mode, scene, _) in modes(&constant(1e-8)) {
        let expected = truth(&scene, SMALL);
        let most = expected.iter().map(|p| p[3]).fold(0.0, f64::max);
        assert!((2e-8..2e-7).contains(&most), "{mode}: {most:e}");
        let (found, _) = drawn(&mut drawer, &scene, SMALL, Rung::Full);
        let relative = |l: &Light| -> Light { l.iter().map(|p| p.map(|c| c / most)).collect() };
        let (found, expected) = (relative(&found), relative(&expected));
        print_measured(&format!("alpha 1e-8, relative, {mode}"), &found, &expected);
        // Measured: exact 3.2e-4, 3.6e-5, 1.4e-6; the others 9.4e-5, 9.0e-6, 2.7e-6.
        let within = Within { max_abs: 8e-4, rmse: 8e-5, bias: 8e-6 };
        assert_eq!(fault(&found, &expected, within), None, "alpha 1e-8, {mode}");
    }
    let mut faults = Vec::new();
    for (mode, scene, within) in modes(&constant(1.0)) {
        // Rims of infinite extinction. Measured: max 1.2e-3, rmse 1.75e-4.
        let within = Within { rmse: 3.5e-4, bias: 5e-5, ..within };
        faults.extend(held(&mut drawer, &format!("alpha 1, {mode}"), &scene, within));
    }
    assert_none(faults);
}

/// Steps lie between the whole numbers that occur; reconstructed values do fall on them.
#[test]
fn steps_and_zero_width_functions() {
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
    let mut faults = Vec::new();
    for (name, transfer) in
        [("steps", steps), ("one value", one_value), ("one point", at_one_point)]
    {
        for (kind, samples) in [
            ("uint8", Samples::UInt8(values().map(|v| v as u8).collect())),
            ("float32", Samples::Float32(values().map(|v| v.floor() as f32).collect())),
        ] {
            let scene = with_samples(samples, transfer.clone());
            faults.extend(in_modes(&mut drawer, &format!("{name}, {kind}"), &scene));
        }
    }
    assert_none(faults);
}

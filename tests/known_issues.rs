//! What is known not to hold yet, as expected failures.
//!
//! Each is a test that states the claim, bears `#[should_panic(expected = "…")]` with the words in
//! which it fails today, and says why. The change that makes the claim true turns it into an
//! ordinary test beside the code.

use voxsplat::core::Ticket;
use voxsplat::transfer::{ColourMap, ColourSource, Cumulative, Table, TransferFunction, Weight};
use voxsplat::volume::{Samples, ScalarType, Statistics};

fn extinction(function: &TransferFunction, value: f64) -> f32 {
    Table::new(function, ScalarType::Float32).lookup(value)[3]
}

/// Float tables spread their entries over opacities and colours together, so that a colour range
/// 10³⁰ times wider than the opacities leaves one entry for all of them.
#[test]
#[should_panic(expected = "a colour range hides what has opacity")]
fn opacities_of_floats_do_not_depend_on_the_colour_range() {
    let function = TransferFunction::of(
        vec![(0.0, 0.0), (1.0, 0.5), (2.0, 0.0)],
        ColourSource::Map { map: ColourMap::Viridis, range: [-1e30, 1e30] },
    );
    assert!(extinction(&function, 1.0) > 0.0, "a colour range hides what has opacity");
}

/// Tables and cells are never narrower than 1e-30 · 2⁻²², since both engines count by 32-bit numbers how many of them a
/// value is from the first, and devices flush what lies below 1.2e-38: data wholly down there are one value, whichever
/// engine draws. Samples would have to be kept in another unit from the file on, as those beyond 1e38 are on the device.
/// `io::open` tells of such fields, and what to multiply them by.
#[test]
#[should_panic(expected = "denormals are all the same")]
fn values_that_lie_wholly_below_the_least_normal_float_are_told_apart() {
    let unit = 1e-41;
    let function = TransferFunction::of(
        vec![(0.0, 0.0), (200.0 * unit, 0.5)],
        ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 200.0 * unit] },
    );
    let samples = Samples::Float32((0..200_u8).map(|i| f32::from(i) * 1e-41).collect());
    let statistics = Statistics::of(&samples, &Ticket::new()).expect("finite values");
    let integrated =
        Cumulative::new(&function, ScalarType::Float32, &statistics, Weight::Extinction);
    let cells = |value: f64| (value - integrated.low) * integrated.scale;
    let [low, high] = [20.0, 180.0].map(|v| extinction(&function, v * unit));
    let told_apart = high > low && cells(180.0 * unit) - cells(20.0 * unit) > 100.0;
    assert!(told_apart, "denormals are all the same");
}

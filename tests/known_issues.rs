//! What is known not to hold yet, as expected failures.
//!
//! Each is a test that states the claim, bears `#[should_panic(expected = "…")]` with the words in
//! which it fails today, and names its issue. The change that makes the claim true turns it into an
//! ordinary test beside the code.

use voxsplat::transfer::{ColourMap, ColourSource, Table, TransferFunction};
use voxsplat::volume::ScalarType;

fn extinction(function: &TransferFunction, value: f64) -> f32 {
    Table::new(function, ScalarType::Float32).lookup(value)[3]
}

/// Float tables spread their entries over opacities and colours together, so that a colour range
/// 10³⁰ times wider than the opacities leaves one entry for all of them.
#[test]
#[should_panic(expected = "a colour range hides what has opacity")]
fn opacities_of_floats_do_not_depend_on_the_colour_range() {
    let function = TransferFunction {
        opacity: vec![(0.0, 0.0), (1.0, 0.5), (2.0, 0.0)],
        colour: ColourSource::Map { map: ColourMap::Viridis, range: [-1e30, 1e30] },
    };
    assert!(extinction(&function, 1.0) > 0.0, "a colour range hides what has opacity");
}

//! What sharpening leaves of a real scan.
//!
//! The data pack lies at `VOXSPLAT_DATA` (default `../shared/data` beside this package); without it
//! the test says that it was skipped.

use std::path::PathBuf;

use voxsplat::core::Ticket;
use voxsplat::kernel::{Kernel, coefficients};
use voxsplat::volume::{Lattice, Samples, ScalarVolume};

/// Measured on the tooth (103 × 94 × 161, uint8), rms and greatest part of the range that is left of
/// the samples: after no step, and after the prefilter or each sweep.
#[test]
fn each_step_of_sharpening_leaves_what_is_recorded_of_a_real_scan() {
    let root = std::env::var_os("VOXSPLAT_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")),
        PathBuf::from,
    );
    let Ok(bytes) = std::fs::read(root.join("scalar/tooth/tooth_103x94x161_uint8.raw")) else {
        return println!("skipped 1: no tooth in the data pack");
    };
    let lattice = Lattice::unit([103, 94, 161]);
    let tooth = ScalarVolume::from_samples("tooth", lattice, Samples::UInt8(bytes)).unwrap();
    let expected: [(Kernel, &[[f64; 2]]); 4] = [
        (Kernel::Linear, &[[0.0, 0.0]]),
        (Kernel::Gaussian, &[[0.00687, 0.0614], [0.00392, 0.0266], [0.00291, 0.0177]]),
        (Kernel::Cubic, &[[0.00379, 0.0308], [0.00151, 0.0096], [0.00082, 0.0045]]),
        (Kernel::BSpline, &[[0.00688, 0.0615], [0.0, 0.0]]),
    ];
    for (kernel, expected) in expected {
        let c = coefficients(&tooth, kernel, None, true, &Ticket::new()).unwrap();
        assert_eq!(c.residuals.len(), expected.len(), "{kernel:?}");
        for (r, [rms, max]) in c.residuals.iter().zip(expected) {
            assert!((r.rms - rms).abs() < 1e-5, "{kernel:?}: {r:?}");
            assert!((r.max - max).abs() < 1e-4, "{kernel:?}: {r:?}");
        }
    }
}

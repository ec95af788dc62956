//! What functions cost and give: `cargo bench --bench encode [-- FILE…]`.
//!
//! neghip at 64³ and at 32³ (every other sample), and the files named, are encoded by each basis with so many functions:
//! Markdown of the greatest error, the mean and the root of mean squares in % of the range, all of them as a file of 16-bit
//! numbers holds the functions, the bytes of that file and of one of floats, and seconds.

#[path = "support/files.rs"]
mod files;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DVec3;
use voxsplat::core::Ticket;
use voxsplat::io::vrbf::{self, Precision};
use voxsplat::io::{Encoded, Source};
use voxsplat::rbf::{Basis, Encoding, Goal, Points, encode, reweighted};
use voxsplat::volume::{Lattice, ScalarVolume};

/// 812 are the paper's for neghip at 32³ (Jang, section 7.4).
const FUNCTIONS: [usize; 5] = [50, 200, 812, 1600, 3200];

fn main() {
    let neghip = files::data().join("scalar/neghip/neghip_64x64x64_uint8.raw");
    println!(
        "| field | basis | functions | greatest, % | mean, % | rms, % | bytes | as floats | s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let named = files::named();
    let given = if named.is_empty() { vec![neghip.clone()] } else { named };
    for path in given {
        let volume = volume(&path);
        let name = path.file_name().map_or(path.clone(), PathBuf::from);
        if path == neghip {
            rows(&format!("{} halved", name.display()), &points(&volume, 2));
        }
        rows(&name.display().to_string(), &points(&volume, 1));
    }
}

fn volume(path: &Path) -> ScalarVolume {
    let scene = match files::open(path) {
        Ok(scene) => scene,
        Err(error) => panic!("{error}"),
    };
    scene.volume().map(|volume| ScalarVolume::clone(volume)).expect("it has a field")
}

/// Every so manieth sample along each axis.
fn points(volume: &ScalarVolume, stride: usize) -> Points {
    let [x, y, z] = volume.lattice.dims;
    let along = |n: usize| (0..n).step_by(stride);
    let indices =
        along(z).flat_map(move |k| along(y).flat_map(move |j| along(x).map(move |i| [i, j, k])));
    Points::new(indices.map(|[i, j, k]| {
        let at = volume.lattice.world_from_index(DVec3::new(i as f64, j as f64, k as f64));
        (at, volume.samples.get((k * y + j) * x + i))
    }))
}

fn rows(name: &str, points: &Points) {
    let values = || points.values().iter().copied();
    let range = values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min);
    for basis in Basis::ALL {
        for functions in FUNCTIONS {
            let (max_error, mean_error) = (0.01 * range, f64::INFINITY);
            let goal = Goal { basis, max_error, mean_error, functions };
            let start = Instant::now();
            let encoding = encode(points, goal, &Ticket::new(), |_| ControlFlow::Continue(()))
                .expect("it has samples");
            let seconds = start.elapsed().as_secs_f64();
            let floats = bytes(&vrbf::rounded(&encoding, Precision::Single));
            // As `task::encode` does.
            let short = vrbf::rounded(&encoding, Precision::Bits16);
            let short = reweighted(points, &short).expect("it has samples");
            let encoding = vrbf::rounded(&short, Precision::Bits16);
            let errors = encoding.errors(points, &Ticket::new()).expect("nobody stops it");
            let share = |error: f64| 100.0 * error / range;
            let count = encoding.functions().len();
            println!(
                "| {name} | {} | {count} | {:.2} | {:.3} | {:.3} | {} | {floats} | {seconds:.1} |",
                basis.name(),
                share(errors.max),
                share(errors.mean),
                share(errors.rms),
                bytes(&encoding),
            );
        }
    }
}

/// Of a file that says little else.
fn bytes(encoding: &Encoding) -> usize {
    let source = Source {
        name: "a.nrrd".to_owned(),
        field: "density".to_owned(),
        samples: 1,
        left_out: 0,
        wanted: None,
        wanted_mean: None,
        wanted_bytes: None,
        favour: None,
        lattice: Lattice::unit([1; 3]),
        fills_box: true,
        range: None,
        cover: None,
        space: None,
        unit: None,
    };
    let encoding = encoding.clone();
    let encoded = Encoded {
        encoding,
        errors: Default::default(),
        favoured: None,
        source,
        overshoot: 0.0,
        between: None,
        ended: None,
    };
    vrbf::bytes(&encoded).expect("it is finite").len()
}

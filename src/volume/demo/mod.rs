//! Volumes made in code, opened as `demo:NAME` or `demo:NAME:SIZE`.
//!
//! Every one is the same on every machine: noise is hashed from its lattice point. Imports what its
//! parent does.

mod head;
mod mesh;
mod tornado;

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use crate::core::memory::{self, TooLarge};
use crate::core::{Cancelled, Ticket, parallel};

use super::{Association, Field, Grid, Lattice, Samples};

/// Every demo, the one that a window opens with first.
pub const NAMES: [&str; 8] =
    ["head", "tornado", "mesh", "marschner-lobb", "shells", "blobs", "checkerboard", "constant"];
/// Samples along each axis that may be asked for.
pub const SIZES: std::ops::RangeInclusive<usize> = 2..=512;

/// Samples between two looks at the ticket.
const A_PIECE: usize = 1 << 18;

/// A demo that there is not.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DemoError {
    /// None of [`NAMES`].
    #[error(
        "expected demo:NAME or demo:NAME:SIZE with a name of {}, found demo:{name}; choose another",
        NAMES.join(", ")
    )]
    Name {
        /// What stood for the name.
        name: String,
    },
    /// None of [`SIZES`].
    #[error(
        "expected a whole number from {} to {} as a demo's size (samples along each axis), found \
         \"{size}\"; choose another, as in demo:{name}:64",
        SIZES.start(),
        SIZES.end()
    )]
    Size {
        /// One of [`NAMES`].
        name: &'static str,
        /// What stood for the size.
        size: String,
    },
    /// More than memory holds.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// It was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The field of a demo that is first seen flowing, alone; `None` of demos that are seen as values, and of no demos.
pub fn flowing_field(name: &str) -> Option<&'static str> {
    parsed(name).ok().filter(|(name, _)| *name == "tornado").map(|_| "velocity")
}

/// Whether there is a demo of a name, which may begin with `demo:` and end with `:SIZE`.
///
/// # Errors
/// No such name or size.
pub fn check(name: &str) -> Result<(), DemoError> {
    parsed(name).map(|_| ())
}

/// The parts of `NAME`, `NAME:SIZE` or the same behind `demo:`.
fn parsed(text: &str) -> Result<(&'static str, Option<usize>), DemoError> {
    let text = text.strip_prefix("demo:").unwrap_or(text);
    let (name, size) = match text.split_once(':') {
        Some((name, size)) => (name, Some(size)),
        None => (text, None),
    };
    let known = NAMES.into_iter().find(|known| *known == name);
    let name = known.ok_or_else(|| DemoError::Name { name: name.to_owned() })?;
    let size = size.map(|size| sized(name, size.parse().ok(), size)).transpose()?;
    Ok((name, size))
}

fn sized(name: &'static str, size: Option<usize>, found: &str) -> Result<usize, DemoError> {
    let size = size.filter(|size| SIZES.contains(size));
    size.ok_or_else(|| DemoError::Size { name, size: found.to_owned() })
}

/// The demo of a name, of `size` samples along each axis, or its own size for `None`.
///
/// The name may begin with `demo:` and end with `:SIZE`, which wins over `size`.
///
/// # Errors
/// Names there are not, sizes outside [`SIZES`], and more than memory holds.
pub fn open(name: &str, size: Option<usize>) -> Result<Grid, DemoError> {
    open_watched(name, size, &Ticket::new())
}

/// [`open`], which tells a ticket how far it is.
///
/// # Errors
/// Those of [`open`], and [`DemoError::Cancelled`].
pub fn open_watched(name: &str, size: Option<usize>, ticket: &Ticket) -> Result<Grid, DemoError> {
    let (name, own) = parsed(name)?;
    let size = match (own, size) {
        (Some(own), _) => Some(own),
        (None, Some(size)) => Some(sized(name, Some(size), &size.to_string())?),
        (None, None) => None,
    };
    let own = match name {
        "head" => 128,
        "constant" => 32,
        "mesh" => 16,
        _ => 64,
    };
    let size = size.unwrap_or(own);
    // Two scalars and a vector, or one scalar, of 32 bits at most.
    let each = match name {
        "tornado" => 20,
        // Six cubes for each across, of six tetrahedra of 60 bytes, and a point of 60.
        "mesh" => 6 * 420,
        _ => 4,
    };
    memory::require(
        &format!("demo:{name}:{size}"),
        (size as u64).pow(3) * each,
        memory::free_bytes(),
    )?;
    Ok(match name {
        "head" => head::grid(size, ticket)?,
        "tornado" => tornado::grid(size, ticket)?,
        "mesh" => mesh::grid(size),
        "marschner-lobb" => {
            let lattice = centred(size);
            scalar(lattice, "density", Samples::Float32(sample(lattice, marschner_lobb, ticket)?))
        }
        "shells" => {
            let lattice = centred(size);
            let edge = lattice.spacing.x;
            let values = sample(lattice, |p| shells(p, edge), ticket)?;
            let values = values.into_iter().map(|v| v.round() as u8);
            scalar(lattice, "shell", Samples::UInt8(values.collect()))
        }
        "blobs" => {
            let lattice = centred(size);
            let blobs = blob_parameters();
            let density = |p: DVec3| {
                blobs
                    .iter()
                    .map(|(at, s, w)| w * (-(p - at).length_squared() / (2.0 * s * s)).exp())
                    .sum()
            };
            scalar(lattice, "density", Samples::Float32(sample(lattice, density, ticket)?))
        }
        "checkerboard" => {
            let lattice = centred(size);
            let values = (0..lattice.len()).map(|i| {
                let odd: usize =
                    index_of(lattice.dims, i).iter().map(|j| j * 8 / lattice.dims[0]).sum();
                if odd % 2 == 1 { 200 } else { 40 }
            });
            scalar(lattice, "check", Samples::UInt8(values.collect()))
        }
        "constant" => {
            let lattice = centred(size);
            scalar(lattice, "constant", Samples::UInt8(vec![100; lattice.len()]))
        }
        _ => return Err(DemoError::Name { name: name.to_owned() }),
    })
}

/// A lattice of size³ over −1..=1.
fn centred(size: usize) -> Lattice {
    let spacing = DVec3::splat(2.0 / (size - 1) as f64);
    Lattice { spacing, origin: DVec3::splat(-1.0), ..Lattice::unit([size; 3]) }
}

/// x, y, z of a sample.
fn index_of(dims: [usize; 3], i: usize) -> [usize; 3] {
    [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])]
}

/// A function of world position at every sample.
fn sample(
    lattice: Lattice,
    f: impl Fn(DVec3) -> f64 + Sync,
    ticket: &Ticket,
) -> Result<Vec<f32>, Cancelled> {
    let at = |i| DVec3::from(index_of(lattice.dims, i).map(|j| j as f64));
    each_of(lattice.len(), |i| f(lattice.world_from_index(at(i))) as f32, ticket)
}

/// Something of each sample, some at a time; the ticket is told how far it is.
fn each_of<T: Send>(
    count: usize,
    make: impl Fn(usize) -> T + Sync,
    ticket: &Ticket,
) -> Result<Vec<T>, Cancelled> {
    let mut made = Vec::with_capacity(count);
    for begin in (0..count).step_by(A_PIECE) {
        ticket.checkpoint(begin as u64, count as u64)?;
        parallel::extend(&mut made, A_PIECE.min(count - begin), |i| make(begin + i));
    }
    Ok(made)
}

fn field(name: &str, components: usize, samples: Samples) -> Field {
    Field {
        name: name.to_owned(),
        components,
        association: Association::Point,
        samples: Arc::new(samples),
    }
}

fn scalar(lattice: Lattice, name: &str, samples: Samples) -> Grid {
    Grid::of(lattice, vec![field(name, 1, samples)])
}

/// The test signal of S. Marschner and R. Lobb (*An Evaluation of Reconstruction Filters for Volume
/// Rendering*, 1994, §5.1), f_M = 6 and α = 0.25, in 0..=1.
fn marschner_lobb(p: DVec3) -> f64 {
    const FREQUENCY: f64 = 6.0;
    const ALPHA: f64 = 0.25;
    let radial = (2.0 * PI * FREQUENCY * (PI * p.truncate().length() / 2.0).cos()).cos();
    (1.0 - (PI * p.z / 2.0).sin() + ALPHA * (1.0 + radial)) / (2.0 * (1.0 + ALPHA))
}

/// Four nested shells of values 60, 110, 160, 210, their faces `edge` wide.
fn shells(p: DVec3, edge: f64) -> f64 {
    let r = p.length();
    (0..4_u8)
        .map(|i| {
            let off = (r - (0.85 - 0.22 * f64::from(i))).abs();
            f64::from(60 + 50 * i) * (0.5 + (0.04 - off) / edge).clamp(0.0, 1.0)
        })
        .fold(0.0, f64::max)
}

/// Centre, width and weight of each blob.
fn blob_parameters() -> Vec<(DVec3, f64, f64)> {
    let part = |i: u64, k: u64| hash_unit(i * 8 + k);
    (0..14)
        .map(|i| {
            let at = DVec3::new(part(i, 0), part(i, 1), part(i, 2)) * 1.3 - 0.65;
            (at, 0.08 + 0.14 * part(i, 3), 0.4 + 0.6 * part(i, 4))
        })
        .collect()
}

/// A number in 0..1 scrambled from a key (the finaliser of splitmix64).
fn hash_unit(key: u64) -> f64 {
    let mut x = key.wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^= x >> 31;
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

/// Smooth noise in −1..=1 of period one unit: hashed lattice values, blended cubically.
fn value_noise(p: DVec3, seed: u64) -> f64 {
    let base = p.floor();
    let f = p - base;
    let blend = f * f * (DVec3::splat(3.0) - 2.0 * f);
    let corner = |dx: f64, dy: f64, dz: f64| {
        let [x, y, z] = (base + DVec3::new(dx, dy, dz)).to_array().map(|v| v as i64 as u64);
        let key =
            x.wrapping_mul(0x8DA6_B343) ^ y.wrapping_mul(0xD816_3841) ^ z.wrapping_mul(0xCB1A_B31F);
        hash_unit(key ^ seed << 40)
    };
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let row = |dy, dz| mix(corner(0., dy, dz), corner(1., dy, dz), blend.x);
    let layer = |dz| mix(row(0., dz), row(1., dz), blend.y);
    2.0 * mix(layer(0.), layer(1.), blend.z) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::assert_stops;
    use crate::volume::Component;

    /// Cubes around the ring of tetrahedra for each across its section.
    const AROUND_RING: usize = 6;

    /// A large one tells how far it is, and stops where that is asked.
    #[test]
    fn large_demos_tell_how_far_they_are_and_stop() {
        for (name, looks) in [("head:96", 4), ("tornado:96", 8), ("blobs:96", 4)] {
            assert_stops(name, looks, |ticket| open_watched(name, None, ticket));
            let ticket = Ticket::new();
            open_watched(name, None, &ticket).unwrap();
            assert!(ticket.fraction() > 0.5, "{name}: {}", ticket.fraction());
        }
    }

    #[test]
    fn every_demo_opens_small_and_twice_the_same() {
        for name in NAMES {
            for size in [2, 3, 17] {
                let grid = open(name, Some(size)).unwrap();
                assert_eq!(grid.check(), Ok(()), "{name}");
                // Around the ring, and one more than there are cubes across it.
                let points = AROUND_RING * size * (size + 1).pow(2);
                let dims = if name == "mesh" { [points, 1, 1] } else { [size; 3] };
                assert_eq!(grid.lattice.dims, dims, "{name}");
                let again = open(&format!("demo:{name}:{size}"), None).unwrap();
                for (a, b) in grid.fields.iter().zip(&again.fields) {
                    assert_eq!(a.samples, b.samples, "{name} {}", a.name);
                }
                assert_eq!(grid.fields[0].components, 1, "{name}: a scalar is active");
                grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).unwrap();
            }
        }
    }

    #[test]
    fn names_and_sizes_there_are_not_are_refused_with_those_there_are() {
        for bad in ["", "demo:", "heads", ":", "demo:demo:head"] {
            let error = check(bad).unwrap_err();
            assert_eq!(open(bad, None).unwrap_err(), error, "{bad}");
            let words = error.to_string();
            assert!(words.contains("tornado") && words.contains("demo:NAME:SIZE"), "{words}");
        }
        for bad in ["head:", "head:x", "head:1", "head:513", "head:8:8", "head:-8", "head:2.5"] {
            let error = check(bad).unwrap_err();
            assert_eq!(open(bad, None).unwrap_err(), error, "{bad}");
            let words = error.to_string();
            assert!(words.contains("from 2 to 512") && words.contains("demo:head:64"), "{words}");
        }
        assert!(open("head", Some(1)).is_err_and(|e| e.to_string().contains("\"1\"")));
        assert_eq!(check("demo:head:512"), Ok(()));
        assert_eq!((check("head:2"), check("head")), (Ok(()), Ok(())));
    }

    #[test]
    fn marschner_and_lobbs_signal_has_its_closed_form_values() {
        // At the middle cos(0) = 1, so the radial part is cos(12π) = 1.
        assert!((marschner_lobb(DVec3::ZERO) - 1.5 / 2.5).abs() < 1e-12);
        assert!((marschner_lobb(DVec3::Z) - 0.5 / 2.5).abs() < 1e-12);
        assert!((marschner_lobb(DVec3::new(1.0, 0.0, -1.0)) - 1.0).abs() < 1e-12);
        let turned = marschner_lobb(DVec3::new(0.3, 0.4, 0.1));
        assert!((turned - marschner_lobb(DVec3::new(0.0, -0.5, 0.1))).abs() < 1e-12);
    }

    #[test]
    fn shells_are_nested_and_mirror_symmetric() {
        let grid = open("shells:65", None).unwrap();
        let get = |x: usize, y: usize, z: usize| grid.fields[0].samples.get((z * 65 + y) * 65 + x);
        assert_eq!(get(32, 32, 32), 0.0);
        for (radius, value) in [(0.85, 60.0), (0.63, 110.0), (0.41, 160.0), (0.19, 210.0)] {
            let x = (32.0_f64 + 32.0 * radius).round() as usize;
            assert_eq!(get(x, 32, 32), value);
            assert_eq!(get(32, 64 - x, 32), value);
        }
        for (x, y, z) in [(3, 9, 20), (11, 40, 29), (30, 31, 5)] {
            assert_eq!(get(x, y, z), get(64 - x, y, z));
            assert_eq!(get(x, y, z), get(z, x, y));
        }
    }

    #[test]
    fn the_checkerboard_alternates_eight_times() {
        let grid = open("checkerboard:32", None).unwrap();
        let row: Vec<f64> = (0..32).map(|x| grid.fields[0].samples.get(x)).collect();
        assert_eq!(row.windows(2).filter(|w| w[0] != w[1]).count(), 7);
        assert_eq!((row[0], row[4]), (40.0, 200.0));
    }

    #[test]
    fn noise_is_smooth_bounded_and_even() {
        let mut sum = 0.0;
        for i in 0..2000 {
            let p = DVec3::new(f64::from(i) * 0.37, f64::from(i) * -0.11, f64::from(i) * 0.05);
            let n = value_noise(p, 1);
            assert!((-1.0..=1.0).contains(&n));
            assert!((value_noise(p + DVec3::splat(1e-4), 1) - n).abs() < 2e-3);
            sum += n;
        }
        assert!((sum / 2000.0).abs() < 0.1, "{sum}");
    }
}

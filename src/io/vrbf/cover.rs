//! Where the source of functions has values: a bit for each cube of samples of its lattice.

use std::io::{Read, Write};
use std::sync::Arc;

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use serde::{Deserialize, Serialize};

/// Samples along the edges of cubes, the finest first.
const EDGES: [usize; 5] = [1, 2, 4, 8, 16];

/// Which cubes of a lattice's samples the source has values in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cover {
    /// Samples of the lattice.
    dims: [usize; 3],
    edge: usize,
    /// A bit a cube, x fastest, the lowest of a byte first; as a file holds them, by zlib.
    deflated: Arc<[u8]>,
    bits: Arc<[u8]>,
}

/// What a header tells of it.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Told {
    /// Samples along the edge of a cube.
    pub(super) edge: usize,
    /// As they are in the file.
    pub(super) bytes: u64,
}

impl Cover {
    /// Of the samples of a lattice of `dims`, x fastest: by the finest cubes that take `most` bytes at most in a file. A cube has
    /// values where one of its samples has. `None` where all samples have some, or none, and where no cubes are so few.
    pub fn of(dims: [usize; 3], is_there: &[bool], most: usize) -> Option<Self> {
        let is_of_all = is_there.iter().all(|own| *own) || !is_there.contains(&true);
        if is_of_all || is_there.len() != dims.iter().product::<usize>() {
            return None;
        }
        let found = EDGES.into_iter().find_map(|edge| {
            let bits = bits(dims, is_there, edge);
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
            // Written into memory, where nothing fails.
            let deflated = encoder.write_all(&bits).and_then(|()| encoder.finish()).ok()?;
            (deflated.len() <= most).then_some((edge, deflated, bits))
        });
        let (edge, deflated, bits) = found?;
        Some(Self { dims, edge, deflated: deflated.into(), bits: bits.into() })
    }

    /// Of a file. `None` where these are not the bits of such cubes.
    pub(super) fn from_file(dims: [usize; 3], edge: usize, deflated: &[u8]) -> Option<Self> {
        if !EDGES.contains(&edge) {
            return None;
        }
        let expected = cubes(dims, edge).iter().product::<usize>().div_ceil(8);
        let mut bits = Vec::new();
        let decoder = ZlibDecoder::new(deflated);
        decoder.take(expected as u64 + 1).read_to_end(&mut bits).ok()?;
        let is_sound = bits.len() == expected && bits.iter().any(|byte| *byte != 0);
        is_sound.then(|| Self { dims, edge, deflated: deflated.into(), bits: bits.into() })
    }

    /// Samples along the edge of a cube.
    pub fn edge(&self) -> usize {
        self.edge
    }

    pub(super) fn told(&self) -> Told {
        Told { edge: self.edge, bytes: self.deflated.len() as u64 }
    }

    /// As a file holds it.
    pub(super) fn deflated(&self) -> &[u8] {
        &self.deflated
    }

    /// Whether the source has values about a sample of its lattice. What is beyond the lattice counts as the next that is not.
    pub fn has(&self, sample: [usize; 3]) -> bool {
        let cubes = cubes(self.dims, self.edge);
        let [x, y, z] = [0, 1, 2].map(|axis| (sample[axis] / self.edge).min(cubes[axis] - 1));
        let cube = (z * cubes[1] + y) * cubes[0] + x;
        self.bits[cube / 8] >> (cube % 8) & 1 == 1
    }
}

/// How many cubes there are along each axis.
fn cubes(dims: [usize; 3], edge: usize) -> [usize; 3] {
    dims.map(|n| n.div_ceil(edge))
}

fn bits(dims: [usize; 3], is_there: &[bool], edge: usize) -> Vec<u8> {
    let cubes = cubes(dims, edge);
    let mut bits = vec![0_u8; cubes.iter().product::<usize>().div_ceil(8)];
    for (i, _) in is_there.iter().enumerate().filter(|(_, is_there)| **is_there) {
        let [x, y, z] = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        let cube = (z / edge * cubes[1] + y / edge) * cubes[0] + x / edge;
        bits[cube / 8] |= 1 << (cube % 8);
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball in a lattice.
    fn ball(dims: [usize; 3]) -> Vec<bool> {
        let [nx, ny, nz] = dims;
        let is_in = |i: usize| {
            let at = [i % nx, i / nx % ny, i / (nx * ny)];
            let off = dims.iter().zip(at).map(|(n, at)| {
                let half = (*n as f64 - 1.0) / 2.0;
                ((at as f64 - half) / half).powi(2)
            });
            off.sum::<f64>() < 0.9
        };
        (0..nx * ny * nz).map(is_in).collect()
    }

    #[test]
    fn no_sample_that_is_there_is_lost_and_fewer_bytes_make_coarser_cubes() {
        let dims = [31, 20, 17];
        let is_there = ball(dims);
        let at = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        let mut before = 0;
        for most in [1000, 100, 40, 20] {
            let cover = Cover::of(dims, &is_there, most).expect("cubes so coarse");
            assert!(cover.deflated().len() <= most && cover.edge() >= before, "{most}");
            before = cover.edge();
            let read = Cover::from_file(dims, cover.edge(), cover.deflated());
            assert_eq!(read.as_ref(), Some(&cover));
            for (i, is_there) in is_there.iter().enumerate() {
                assert!(cover.has(at(i)) || !is_there, "{:?} of {most}", at(i));
                assert!(cover.edge() > 1 || cover.has(at(i)) == *is_there, "{:?}", at(i));
            }
        }
        assert!(before > 1, "{before}");
        assert!(Cover::of(dims, &is_there, 5).is_none());
    }

    #[test]
    fn what_is_all_there_has_none_and_bits_of_other_cubes_are_refused() {
        let dims = [31, 20, 17];
        assert!(Cover::of(dims, &vec![true; 31 * 20 * 17], 1000).is_none());
        assert!(Cover::of(dims, &vec![false; 31 * 20 * 17], 1000).is_none());
        let cover = Cover::of(dims, &ball(dims), 1000).expect("a ball");
        for (dims, edge) in [([31, 20, 18], 1), ([31, 20, 16], 1), (dims, 2), (dims, 3), (dims, 0)]
        {
            assert!(Cover::from_file(dims, edge, cover.deflated()).is_none(), "{dims:?} {edge}");
        }
        assert!(Cover::from_file(dims, 1, &cover.deflated()[..20]).is_none());
    }
}

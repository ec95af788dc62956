//! Triangles that lie exactly on others.

use glam::Vec3;
use rayon::slice::ParallelSliceMut;

/// For each triangle, whether it is the first between its three places, in whatever order it names them. Those that say the
/// same place by other numbers are the same.
pub(super) fn are_first(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<bool> {
    // By a number that does not depend on the corners' order; of those that have the same one the places are compared.
    let marks: Vec<u64> = positions.iter().map(|place| mark(*place)).collect();
    let of = |triangle: &[u32; 3]| {
        triangle.iter().fold(0_u64, |sum, corner| sum.wrapping_add(marks[*corner as usize]))
    };
    let mut order: Vec<(u64, usize)> =
        triangles.iter().enumerate().map(|(at, triangle)| (of(triangle), at)).collect();
    order.par_sort_unstable();
    let mut first = vec![true; triangles.len()];
    for alike in order.chunk_by(|a, b| a.0 == b.0).filter(|alike| alike.len() > 1) {
        let places =
            |at: usize| sorted(triangles[at].map(|corner| bits(positions[corner as usize])));
        let mut known: Vec<[[u32; 3]; 3]> = Vec::new();
        for (_, at) in alike {
            let own = places(*at);
            match known.contains(&own) {
                true => first[*at] = false,
                false => known.push(own),
            }
        }
    }
    first
}

/// The bits of a place; both zeros are one.
fn bits(place: Vec3) -> [u32; 3] {
    place.to_array().map(|x| (x + 0.0).to_bits())
}

fn sorted(mut places: [[u32; 3]; 3]) -> [[u32; 3]; 3] {
    places.sort_unstable();
    places
}

/// A number for a place, well mixed, so that sums of three of them hardly ever agree by chance.
fn mark(place: Vec3) -> u64 {
    bits(place).into_iter().fold(0x9e37_79b9_7f4a_7c15, |mark: u64, bits| {
        let mixed = (mark ^ u64::from(bits)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed ^ (mixed >> 29)).wrapping_mul(0x94d0_49bb_1331_11eb) ^ (mixed >> 32)
    })
}

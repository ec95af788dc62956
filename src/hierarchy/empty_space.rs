//! Where a reconstructed field cannot show, so that rays can leap over it.

use crate::core::parallel;

/// Edge of a brick, voxels.
pub const EMPTY_BRICK: usize = 4;
/// The greatest distance that is kept, bricks.
pub const MOST_DISTANCE: u8 = 32;

/// For each of bricks along x, y, z the Chebyshev distance, in bricks, to the nearest in which something `shows`: 0 for
/// those themselves, at most [`MOST_DISTANCE`]. x fastest.
pub fn distances([nx, ny, nz]: [usize; 3], shows: impl Fn(usize) -> bool + Sync) -> Vec<u8> {
    let of = |brick| if shows(brick) { 0 } else { MOST_DISTANCE };
    let mut distances = parallel::list(nx * ny * nz, of);
    // The box of a distance is the product of its three intervals, so one sweep up and down
    // along each axis in turn would give the city-block distance; taking at each place the
    // least, over the axis, of the greater of what is there and how far it is, gives this one.
    for (stride, n) in [(1, nx), (nx, ny), (nx * ny, nz)] {
        spread(&mut distances, stride, n);
    }
    distances
}

/// Distances to the nearest brick of those `further` bricks about them as well.
pub fn widen(distances: &mut [u8], further: usize) {
    if further > 0 {
        let further = u8::try_from(further).unwrap_or(u8::MAX);
        // Those at the greatest distance may be further off, but not surely.
        distances.iter_mut().for_each(|d| *d = d.saturating_sub(further));
    }
}

/// dᵢ ← min over j of max(dⱼ, |i − j|) along every line of an axis.
fn spread(distances: &mut [u8], stride: usize, n: usize) {
    let block = stride * n;
    parallel::each(distances.chunks_mut(block), |block| {
        let mut line = vec![0_u8; n];
        for start in 0..stride {
            for (i, d) in line.iter_mut().enumerate() {
                *d = block[start + i * stride];
            }
            for i in 0..n {
                let mut least = line[i];
                // Only as far as it can still help.
                for step in 1..usize::from(MOST_DISTANCE) {
                    if step >= usize::from(least) {
                        break;
                    }
                    let before = if i >= step { line[i - step] } else { MOST_DISTANCE };
                    let after = if i + step < n { line[i + step] } else { MOST_DISTANCE };
                    least = least.min(before.min(after).max(step as u8));
                }
                block[start + i * stride] = least;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_chebyshevs() {
        let dims = [9, 7, 50];
        let seen = [[2, 3, 4], [8, 0, 20]];
        let shows = |brick: usize| seen.iter().any(|[x, y, z]| (z * 7 + y) * 9 + x == brick);
        let distances = distances(dims, shows);
        let mut wider = distances.clone();
        widen(&mut wider, 2);
        for (i, &found) in distances.iter().enumerate() {
            let at = [i % 9, i / 9 % 7, i / 63];
            let far = |s: &[usize; 3]| (0..3).map(|a| s[a].abs_diff(at[a])).max().unwrap();
            let expected = seen.iter().map(far).min().unwrap().min(usize::from(MOST_DISTANCE));
            assert_eq!(usize::from(found), expected, "{at:?}");
            assert_eq!(usize::from(wider[i]), expected.saturating_sub(2), "{at:?}");
        }
    }
}

//! Samples without data: where they are, and what stands in for them.

use rayon::prelude::*;

use crate::core::progress::{Cancelled, Ticket};

/// Samples filled between two looks at the ticket.
const STEP: usize = 1 << 14;

/// Whether bit `index` is set.
pub(super) fn contains(mask: &[u32], index: usize) -> bool {
    mask[index / 32] >> (index % 32) & 1 == 1
}

fn remove(mask: &mut [u32], index: usize) {
    mask[index / 32] &= !(1 << (index % 32));
}

/// One bit a sample, set where the value is NaN; `None` where none is.
pub(super) fn of(values: &[f32]) -> Option<Vec<u32>> {
    if !values.par_iter().any(|v| v.is_nan()) {
        return None;
    }
    let word = |run: &[f32]| {
        run.iter().enumerate().fold(0, |word, (bit, v)| word | u32::from(v.is_nan()) << bit)
    };
    Some(values.par_chunks(32).map(word).collect())
}

/// Gives every hole the mean of those of its six neighbours that have a value, ring by ring from
/// its border inwards: each ring sees the values that were there before it. Neighbours are those
/// in the lattice, not their mirror images. Where no sample has a value, all become 0.
pub(super) fn fill(
    values: &mut [f32],
    dims: [usize; 3],
    holes: &[u32],
    ticket: &Ticket,
) -> Result<(), Cancelled> {
    let mut missing = holes.to_vec();
    // Holes that no ring has taken up yet.
    let mut unseen = holes.to_vec();
    let touches = |i: &usize| neighbours(*i, dims).any(|n| !contains(holes, n));
    let mut ring: Vec<usize> =
        (0..values.len()).into_par_iter().filter(|&i| contains(holes, i)).filter(touches).collect();
    if ring.is_empty() {
        values.fill(0.0);
    }
    for &index in &ring {
        remove(&mut unseen, index);
    }
    while !ring.is_empty() {
        let mean = |&index: &usize| {
            let (mut sum, mut count) = (0.0, 0.0);
            for n in neighbours(index, dims).filter(|&n| !contains(&missing, n)) {
                sum += f64::from(values[n]);
                count += 1.0;
            }
            (sum / count) as f32
        };
        let filled = ring
            .par_chunks(STEP)
            .map(|part| {
                if ticket.is_cancelled() {
                    return Err(Cancelled);
                }
                Ok(part.iter().map(mean).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>, _>>()?;
        for (&index, value) in ring.iter().zip(filled.into_iter().flatten()) {
            values[index] = value;
            remove(&mut missing, index);
        }
        let mut next = Vec::new();
        for n in ring.iter().flat_map(|&index| neighbours(index, dims)) {
            if contains(&unseen, n) {
                remove(&mut unseen, n);
                next.push(n);
            }
        }
        ring = next;
    }
    Ok(())
}

/// The sample's neighbours along the axes that lie in the lattice.
fn neighbours(index: usize, dims: [usize; 3]) -> impl Iterator<Item = usize> {
    let [nx, ny, nz] = dims;
    let (x, y, z) = (index % nx, index / nx % ny, index / (nx * ny));
    let steps = [(x, nx, 1), (y, ny, nx), (z, nz, nx * ny)];
    steps.into_iter().flat_map(move |(at, n, stride)| {
        let before = (at > 0).then(|| index - stride);
        let after = (at + 1 < n).then(|| index + stride);
        before.into_iter().chain(after)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOLE: f32 = f32::NAN;

    fn filled(dims: [usize; 3], mut values: Vec<f32>) -> Vec<f32> {
        let holes = of(&values).unwrap();
        for (i, v) in values.iter().enumerate() {
            assert_eq!(contains(&holes, i), v.is_nan());
        }
        fill(&mut values, dims, &holes, &Ticket::new()).unwrap();
        values
    }

    #[test]
    fn holes_are_filled_ring_by_ring_from_what_was_there_before() {
        let row = filled([7, 1, 1], vec![1.0, HOLE, HOLE, HOLE, HOLE, HOLE, 5.0]);
        assert_eq!(row, [1.0, 1.0, 1.0, 3.0, 5.0, 5.0, 5.0]);
        // The first ring must not see itself: the corner's neighbours both are of the first ring.
        let plane = filled([2, 2, 1], vec![HOLE, HOLE, HOLE, 6.0]);
        assert_eq!(plane, [6.0; 4]);
        let plane = filled([1, 3, 2], vec![2.0, HOLE, HOLE, HOLE, 8.0, HOLE]);
        assert_eq!(plane, [2.0, 5.0, 6.5, 5.0, 8.0, 8.0]);
    }

    #[test]
    fn no_value_at_all_becomes_nothing_and_no_hole_has_no_mask() {
        assert_eq!(filled([2, 2, 1], vec![HOLE; 4]), [0.0; 4]);
        assert_eq!(of(&[1.0, 2.0]), None);
    }

    #[test]
    fn a_cancelled_fill_stops() {
        let ticket = Ticket::new();
        ticket.cancel();
        assert_eq!(fill(&mut [1.0, HOLE], [2, 1, 1], &[2], &ticket), Err(Cancelled));
    }
}

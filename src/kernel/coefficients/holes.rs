//! Samples without data: where they are, and what stands in for them.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::core::parallel;
use crate::core::{Cancelled, Looks, Ticket, mapped};

/// Samples filled between two looks at the ticket.
const STEP: usize = 1 << 14;
/// And samples that are only looked at: a multiple of 32.
const SEEN: usize = 1 << 16;

/// Whether bit `index` is set.
pub(super) fn contains(mask: &[u32], index: usize) -> bool {
    mask[index / 32] >> (index % 32) & 1 == 1
}

fn remove(mask: &mut [u32], index: usize) {
    mask[index / 32] &= !(1 << (index % 32));
}

/// One bit a sample, set where the value is NaN; `None` where none is.
pub(super) fn of(values: &[f32], ticket: &Ticket) -> Result<Option<Vec<u32>>, Cancelled> {
    let has_any = AtomicBool::new(false);
    parallel::try_each(values.chunks(SEEN), |run| {
        ticket.look()?;
        if run.iter().any(|v| v.is_nan()) {
            has_any.store(true, Ordering::Relaxed);
        }
        Ok::<(), Cancelled>(())
    })?;
    if !has_any.into_inner() {
        return Ok(None);
    }
    let word = |run: &[f32]| {
        run.iter().enumerate().fold(0, |word, (bit, v)| word | u32::from(v.is_nan()) << bit)
    };
    let mut words = vec![0; values.len().div_ceil(32)];
    let runs = words.chunks_mut(SEEN / 32).zip(values.chunks(SEEN));
    parallel::try_each(runs, |(words, run)| {
        ticket.look()?;
        words.iter_mut().zip(run.chunks(32)).for_each(|(to, run)| *to = word(run));
        Ok::<(), Cancelled>(())
    })?;
    Ok(Some(words))
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
    let first = parallel::try_list(values.len().div_ceil(STEP), |part| {
        ticket.look()?;
        let own = parallel::part(values.len(), STEP, part);
        Ok::<_, Cancelled>(own.filter(|&i| contains(holes, i)).filter(touches).collect::<Vec<_>>())
    });
    let mut ring = first?.concat();
    let mut looks = Looks::every(ticket, STEP);
    if ring.is_empty() {
        values.fill(0.0);
    }
    for &index in &ring {
        looks.after(1)?;
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
        let filled = mapped(ring.len(), STEP, |i| mean(&ring[i]), ticket)?;
        for (&index, value) in ring.iter().zip(filled) {
            looks.after(1)?;
            values[index] = value;
            remove(&mut missing, index);
        }
        let mut next = Vec::new();
        for n in ring.iter().flat_map(|&index| neighbours(index, dims)) {
            looks.after(1)?;
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
    use crate::core::assert_stops;

    const HOLE: f32 = f32::NAN;

    fn filled(dims: [usize; 3], mut values: Vec<f32>) -> Vec<f32> {
        let holes = of(&values, &Ticket::new()).unwrap().unwrap();
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
        assert_eq!(of(&[1.0, 2.0], &Ticket::new()), Ok(None));
    }

    #[test]
    fn many_holes_are_found_and_filled_between_looks() {
        let dims = [96; 3];
        // A ball without data.
        let value = |i: usize| {
            let off = [i % 96, i / 96 % 96, i / (96 * 96)].map(|n| n as f32 - 48.0);
            if off.iter().map(|x| x * x).sum::<f32>() < 1500.0 { HOLE } else { 1.0 }
        };
        let values: Vec<f32> = (0..96 * 96 * 96).map(value).collect();
        // Whether there are any, and where.
        assert_stops("holes", 2 * (values.len() / SEEN), |ticket| of(&values, ticket));
        let holes = of(&values, &Ticket::new()).unwrap().unwrap();
        let count: u32 = holes.iter().map(|word| word.count_ones()).sum();
        // Each is put in a ring, is given its value, and has six neighbours.
        let least = values.len() / STEP + 7 * count as usize / STEP;
        assert_stops("holes' values", least, |ticket| {
            fill(&mut values.clone(), dims, &holes, ticket)
        });
    }

    #[test]
    fn a_cancelled_fill_stops() {
        let ticket = Ticket::new();
        ticket.cancel();
        assert_eq!(fill(&mut [1.0, HOLE], [2, 1, 1], &[2], &ticket), Err(Cancelled));
        assert_eq!(of(&[1.0, HOLE], &ticket), Err(Cancelled));
        assert_eq!(of(&[1.0], &ticket), Err(Cancelled), "whether there are any");
    }
}

//! Kernels of lists in the order in which rays come to them.

use crate::core::parallel;
use crate::core::{Cancelled, Ticket};

/// Things between two looks at a ticket.
const PIECE: usize = 1 << 14;

/// Where each of many things stands in a list: those with the least first slab first, and of these the first in the list.
/// The same on any number of threads.
///
/// # Errors
/// [`Cancelled`].
#[expect(clippy::cast_possible_truncation, reason = "fewer than 2³² of everything")]
pub(super) fn by_first_slab<T>(
    list: &[T],
    first: impl Fn(&T) -> i32,
    ticket: &Ticket,
) -> Result<Vec<u32>, Cancelled> {
    let (mut least, mut most) = (i32::MAX, i32::MIN);
    for piece in list.chunks(PIECE) {
        look(ticket)?;
        for slab in piece.iter().map(&first) {
            (least, most) = (least.min(slab), most.max(slab));
        }
    }
    if list.is_empty() {
        return Ok(Vec::new());
    }
    // Where those of each slab begin.
    let mut begins = vec![0_u32; most.abs_diff(least) as usize + 2];
    let slab_of = |thing: &T| first(thing).abs_diff(least) as usize;
    for piece in list.chunks(PIECE) {
        look(ticket)?;
        for thing in piece {
            begins[slab_of(thing) + 1] += 1;
        }
    }
    for slab in 1..begins.len() {
        if slab.is_multiple_of(1 << 20) {
            look(ticket)?;
        }
        begins[slab] += begins[slab - 1];
    }
    let mut order = vec![0; list.len()];
    for (i, piece) in list.chunks(PIECE).enumerate() {
        look(ticket)?;
        for (number, thing) in (i * PIECE..).zip(piece) {
            let begin = &mut begins[slab_of(thing)];
            order[*begin as usize] = number as u32;
            *begin += 1;
        }
    }
    Ok(order)
}

/// Something of each thing of a list, in an order.
///
/// # Errors
/// [`Cancelled`].
pub(super) fn taken<T: Sync, U: Send>(
    list: &[T],
    order: &[u32],
    take: impl Fn(&T) -> U + Sync,
    ticket: &Ticket,
) -> Result<Vec<U>, Cancelled> {
    let mut made = Vec::with_capacity(order.len());
    for piece in order.chunks(PIECE) {
        look(ticket)?;
        parallel::extend(&mut made, piece.len(), |i| take(&list[piece[i] as usize]));
    }
    Ok(made)
}

/// Whether to go on.
///
/// # Errors
/// [`Cancelled`].
pub(super) fn look(ticket: &Ticket) -> Result<(), Cancelled> {
    ticket.look()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_that_of_a_stable_sort() {
        let slab = |i: i32| (i * 7919) % 211 - 100;
        let list: Vec<[i32; 2]> = (0..50_000).map(|i| [slab(i), i]).collect();
        let ticket = Ticket::new();
        let order = by_first_slab(&list, |thing| thing[0], &ticket).expect("not cancelled");
        let found = taken(&list, &order, |thing| *thing, &ticket).expect("not cancelled");
        let mut expected = list.clone();
        expected.sort_by_key(|thing| thing[0]);
        assert!(found == expected);
        assert_ne!(list, expected);
        assert_eq!(by_first_slab(&[], |_: &i32| 0, &ticket), Ok(Vec::new()));
    }

    #[test]
    fn a_cancelled_ticket_ends_both() {
        let ticket = Ticket::new();
        ticket.cancel();
        assert_eq!(by_first_slab(&[1, 2], |&slab| slab, &ticket), Err(Cancelled));
        assert_eq!(taken(&[1, 2], &[1, 0], |&slab| slab, &ticket), Err(Cancelled));
    }
}

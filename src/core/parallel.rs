//! Work shared out over all threads, in few compiled forms.
//!
//! An iterator of rayon's is compiled anew, as some sixty functions, wherever one is used: these were half of the functions of
//! the library. A place that shares its work out by one of these compiles its own loop and little else. Threads take items one
//! after the other, in their order: items should be pieces of work, not single numbers.

use std::convert::Infallible;
use std::ops::{AddAssign, Range};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Numbers that a thread makes at a time, at most.
const MOST_BLOCK: usize = 1 << 14;
/// Blocks for each thread, at least, where there are as many numbers: some take longer than others.
const BLOCKS: usize = 32;
/// Blocks that are merged, about: enough for many threads, whatever their number.
const MERGED: usize = 1 << 10;

/// Does something with each of many items.
pub fn each<I: Iterator + Send>(items: I, work: impl Fn(I::Item) + Sync) {
    let Ok(()) = try_each(items, |item| {
        work(item);
        Ok::<(), Infallible>(())
    });
}

/// The same until something goes wrong.
///
/// # Errors
/// What went wrong first. What other threads have begun by then is done; the rest is left.
pub fn try_each<I: Iterator + Send, E: Send>(
    items: I,
    work: impl Fn(I::Item) -> Result<(), E> + Sync,
) -> Result<(), E> {
    let most = items.size_hint().1.unwrap_or(usize::MAX);
    let left = Mutex::new((items, None));
    let next = || {
        let (items, wrong) = &mut *held(&left);
        if wrong.is_none() { items.next() } else { None }
    };
    on_threads(most, &|| {
        while let Some(item) = next() {
            if let Err(error) = work(item) {
                let (_, wrong) = &mut *held(&left);
                wrong.get_or_insert(error);
            }
        }
    });
    left.into_inner().unwrap_or_else(PoisonError::into_inner).1.map_or(Ok(()), Err)
}

/// Something for each of the numbers below a count, in their order.
pub fn list<T: Send>(count: usize, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut made = Vec::new();
    extend(&mut made, count, make);
    made
}

/// The same, behind what there is.
pub fn extend<T: Send>(made: &mut Vec<T>, count: usize, make: impl Fn(usize) -> T + Sync) {
    made.reserve_exact(count);
    let places = &mut made.spare_capacity_mut()[..count];
    let block = block_of(count);
    each(places.chunks_mut(block).enumerate(), |(i, places)| {
        for (j, place) in places.iter_mut().enumerate() {
            place.write(make(i * block + j));
        }
    });
    #[expect(unsafe_code, reason = "else a value would have to stand in for each thing at first")]
    // SAFETY: each of these places was written: `each` gives out every block, and unwinds where one was not done.
    unsafe {
        made.set_len(made.len() + count);
    }
}

/// The same until something goes wrong.
///
/// # Errors
/// See [`try_each`].
pub fn try_list<T: Send, E: Send>(
    count: usize,
    make: impl Fn(usize) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let block = block_of(count);
    let mut made: Vec<Vec<T>> = Vec::new();
    made.resize_with(count.div_ceil(block), Vec::new);
    try_each(made.iter_mut().enumerate(), |(i, made)| {
        let own = part(count, block, i);
        *made = own.map(&make).collect::<Result<_, _>>()?;
        Ok(())
    })?;
    Ok(made.into_iter().flatten().collect())
}

/// All that is made for the numbers below a count in one, beginning with `none`: the same on any number of threads, since what
/// is merged with what depends on the count alone.
pub fn merged<T: Send>(
    count: usize,
    none: impl Fn() -> T + Sync,
    make: impl Fn(usize) -> T + Sync,
    merge: impl Fn(T, T) -> T + Sync,
) -> T {
    let block = count.div_ceil(MERGED).clamp(1, MOST_BLOCK);
    let parts = list(count.div_ceil(block), |i| {
        let own = part(count, block, i);
        own.fold(none(), |all, at| merge(all, make(at)))
    });
    parts.into_iter().fold(none(), merge)
}

/// All that is added of many items, in one. Each thread adds to a sum of its own, which begins as `none`; these are merged at the
/// end. Which items are added to which sum is chance, so that only whole numbers are the same each time.
///
/// # Errors
/// See [`try_each`].
pub fn try_summed<I: Iterator + Send, T: Send, E: Send>(
    items: I,
    none: impl Fn() -> T + Sync,
    add: impl Fn(&mut T, I::Item) -> Result<(), E> + Sync,
    merge: impl Fn(&mut T, T),
) -> Result<T, E> {
    let kept: Mutex<Vec<T>> = Mutex::default();
    try_each(items, |item| {
        let own = held(&kept).pop();
        let mut own = own.unwrap_or_else(&none);
        add(&mut own, item)?;
        held(&kept).push(own);
        Ok(())
    })?;
    let mut total = none();
    for own in kept.into_inner().unwrap_or_else(PoisonError::into_inner) {
        merge(&mut total, own);
    }
    Ok(total)
}

/// Adds numbers to those at the same places: what merges sums that are lists.
#[expect(clippy::ptr_arg, reason = "what is merged is what was summed up, a list")]
pub fn add_up<T: AddAssign>(total: &mut Vec<T>, own: Vec<T>) {
    total.iter_mut().zip(own).for_each(|(total, own)| *total += own);
}

/// The numbers below a count that are in one of its parts of so many.
pub fn part(count: usize, size: usize, number: usize) -> Range<usize> {
    number * size..((number + 1) * size).min(count)
}

/// What is behind a lock: a panic of another thread comes back by itself.
fn held<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

fn block_of(count: usize) -> usize {
    (count / (BLOCKS * rayon::current_num_threads())).clamp(1, MOST_BLOCK)
}

/// Calls `work` on all threads at once, this one among them, but on no more than `most`; back once all have returned.
fn on_threads(most: usize, work: &(dyn Fn() + Sync)) {
    rayon::scope(|scope| {
        for _ in 1..rayon::current_num_threads().min(most) {
            scope.spawn(|_| work());
        }
        work();
    });
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn with_threads<T: Send>(count: usize, work: impl Fn() -> T + Sync + Send) -> T {
        rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("threads").install(work)
    }

    #[test]
    fn lists_are_in_order_for_any_count_and_any_number_of_threads() {
        for threads in [1, 2, 5] {
            for count in [0, 1, 2, 63, 64, 65, 1000, 3 * MOST_BLOCK * BLOCKS * 5 + 1] {
                let made = with_threads(threads, || list(count, |i| 3 * i));
                assert!(made.iter().copied().eq((0..count).map(|i| 3 * i)), "{threads}, {count}");
                let made = with_threads(threads, || try_list(count, |i| Ok::<_, ()>(3 * i)));
                assert_eq!(made.map(|made| made.len()), Ok(count), "{threads}, {count}");
            }
        }
        let mut made = vec![1, 2];
        extend(&mut made, 3, |i| i + 3);
        assert_eq!(made, [1, 2, 3, 4, 5]);
        let made = try_list(1000, |i| Ok::<_, ()>(i.to_string())).expect("nothing goes wrong");
        assert!(made.iter().enumerate().all(|(i, made)| *made == i.to_string()));
    }

    #[test]
    fn each_item_is_worked_on_once_and_parts_of_slices_may_be_changed() {
        let (mut values, added) = (vec![0_u32; 1000], vec![7_u32; 1000]);
        let items = values.chunks_mut(7).zip(added.chunks(7)).enumerate();
        each(items, |(i, (values, added))| {
            for (value, added) in values.iter_mut().zip(added) {
                *value += added + i as u32;
            }
        });
        assert!(values.iter().enumerate().all(|(at, value)| *value == 7 + at as u32 / 7));
    }

    #[test]
    fn all_threads_work_and_no_more_than_there_are_items() {
        let all = |items: usize| {
            let (met, names) = (AtomicUsize::new(0), Mutex::new(BTreeSet::new()));
            with_threads(4, || {
                each(0..items, |_| {
                    met.fetch_add(1, Ordering::SeqCst);
                    names.lock().expect("no panic").insert(rayon::current_thread_index());
                    // Each waits until all of them are here, so that nobody does the work of another.
                    while met.load(Ordering::SeqCst) < items {
                        std::thread::yield_now();
                    }
                });
            });
            names.into_inner().expect("no panic").len()
        };
        assert_eq!((all(1), all(3), all(4)), (1, 3, 4));
    }

    #[test]
    fn what_goes_wrong_is_told_and_ends_the_work() {
        let done = AtomicUsize::new(0);
        let work = |i: usize| {
            done.fetch_add(1, Ordering::Relaxed);
            if i == 5 { Err(format!("no {i}")) } else { Ok(()) }
        };
        assert_eq!(with_threads(2, || try_each(0..1_000_000, work)), Err("no 5".to_owned()));
        assert!(done.load(Ordering::Relaxed) < 900_000, "{done:?}");
        let made = try_list(1000, |i| if i == 999 { Err(i) } else { Ok(i) });
        assert_eq!(made, Err(999));
    }

    #[test]
    fn sums_are_the_same_on_any_number_of_threads() {
        let sum = |threads| {
            let part = |i: usize| 1.0 / (1.0 + i as f64);
            with_threads(threads, || merged(100_000, || 0.0, part, |a, b| a + b))
        };
        assert_eq!(sum(1).to_bits(), sum(2).to_bits());
        assert_eq!(sum(1).to_bits(), sum(7).to_bits());
        assert!((sum(1) - 12.090_146_129_863_335).abs() < 1e-9);
        assert_eq!(merged(0, || 4, |i| i, |a, b| a + b), 4);
    }

    #[test]
    fn sums_are_of_all_items_and_end_where_one_goes_wrong() {
        let digits = |counts: &mut Vec<u64>, some: usize| {
            (some..some + 10).for_each(|i| counts[i % 10] += 1);
            if some < 5000 { Ok(()) } else { Err(some) }
        };
        let of = |most: usize| {
            let items = (0..most).step_by(10);
            with_threads(3, || try_summed(items.clone(), || vec![0; 10], digits, add_up))
        };
        assert_eq!(of(1000), Ok(vec![100; 10]));
        assert_eq!(of(0), Ok(vec![0; 10]));
        assert_eq!(of(5001), Err(5000));
    }

    #[test]
    #[should_panic(expected = "one of them")]
    fn a_panic_comes_back() {
        list(100, |i| assert!(i != 50, "one of them"));
    }
}

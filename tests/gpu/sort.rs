//! The device's sort, held to the host's stable one: exact integers.

use std::time::Instant;

use voxsplat::gpu::MOST_KEYS;

use crate::support::{Shared, drawer, random};

fn noise(seed: u64, count: usize, bits: u32) -> Vec<u32> {
    (0..count).map(|i| (random(seed, i) * 2.0_f64.powi(bits.cast_signed())) as u32).collect()
}

/// Sorts on the device and on the host.
#[track_caller]
fn agrees(drawer: &mut Shared, name: &str, keys: &[u32], bits: u32) {
    let words: Vec<u32> = (0..keys.len() as u32).map(|i| i.wrapping_mul(0x9e37_79b9)).collect();
    let mut expected: Vec<(u32, u32)> = keys.iter().copied().zip(words.iter().copied()).collect();
    expected.sort_by_key(|&(key, _)| key);
    let (keys, words, _) =
        drawer.engines.gpu().expect("a device").sort_pairs(keys, &words, bits).expect("it sorts");
    let found: Vec<(u32, u32)> = keys.into_iter().zip(words).collect();
    let first = found.iter().zip(&expected).position(|(a, b)| a != b);
    assert!(found.len() == expected.len() && first.is_none(), "{name}: differs at {first:?}");
}

#[test]
fn keys_and_words_are_sorted_as_the_host_sorts_them_and_equal_ones_keep_their_order() {
    let Some(mut drawer) = drawer() else { return };
    // Runs are 256 long and workgroups 64 threads: sizes about both.
    for count in [0, 1, 2, 3, 63, 64, 65, 255, 256, 257, 511, 513, 16_383, 16_384, 16_385, 40_000] {
        for bits in [1, 3, 4, 5, 8, 17, 31, 32] {
            agrees(&mut drawer, "noise", &noise(count as u64, count, bits), bits);
        }
        let count = count as u32;
        agrees(&mut drawer, "all equal", &vec![0xdead_beef; count as usize], 32);
        agrees(&mut drawer, "all the greatest", &vec![u32::MAX; count as usize], 32);
        let rising: Vec<u32> = (0..count).collect();
        agrees(&mut drawer, "sorted already", &rising, 32);
        let falling: Vec<u32> = (0..count).rev().map(|i| i * 3).collect();
        agrees(&mut drawer, "reversed", &falling, 32);
        let few: Vec<u32> = noise(5, count as usize, 2).iter().map(|k| k << 29).collect();
        agrees(&mut drawer, "few different", &few, 32);
    }
}

#[test]
fn a_million_keys_are_sorted_and_too_many_are_refused() {
    let Some(mut drawer) = drawer() else { return };
    for seed in [1, 2] {
        agrees(&mut drawer, "a million", &noise(seed, 1_000_000, 32), 32);
    }
    let keys = noise(3, 1 << 20, 20);
    let start = Instant::now();
    let (_, _, ms) =
        drawer.engines.gpu().expect("a device").sort_pairs(&keys, &keys, 20).expect("it sorts");
    let mkeys = keys.len() as f64 / 1e3 / ms;
    println!(
        "measured sort: 2^20 keys of 20 bits in {ms:.1} ms ({mkeys:.1} million a second), with upload and reading back {:.1} ms",
        start.elapsed().as_secs_f64() * 1e3
    );
    let many = vec![0; MOST_KEYS as usize + 1];
    assert!(drawer.engines.gpu().expect("a device").sort_pairs(&many, &many, 1).is_err());
}

//! Functions in lists over a lattice, and what is left out of them.

use super::*;

/// The share of the error that is left of what cells leave out, once it is added between their corners. Of functions as wide as a
/// cell or two: Gaussians 0.12, 0.11 and 0.10 with 1, 4 and 12 functions a cell, multiquadrics 0.02 to 0.03.
const MOST_LEFT: f64 = 0.15;

/// Functions of every basis in a box of 9 × 8 × 7 samples, on axes that are neither even nor square to each other.
fn listed(basis: Basis) -> (Encoding, Listed, impl Fn(DVec3) -> DVec3) {
    let mut next = random();
    let axes = DMat3::from_cols(
        DVec3::new(1.1, 0.2, 0.0),
        DVec3::new(-0.1, 0.8, 0.1),
        DVec3::new(0.0, 0.3, 1.4),
    );
    let origin = DVec3::new(5.0, -2.0, 1.0);
    let functions: Vec<Function> = (0..30)
        .map(|_| {
            let function = some_function(&mut next);
            let place = DVec3::new(next() * 9.0, next() * 8.0, next() * 7.0);
            let wide = 1.0 / (0.3 + 2.0 * next());
            let shape = match basis {
                Basis::Ellipsoid => function.shape * wide,
                Basis::Gaussian | Basis::Multiquadric => DMat3::from_diagonal(DVec3::splat(wide)),
            };
            Function { centre: origin + axes * place, shape, ..function }
        })
        .collect();
    let bounds = [origin - 3.0, origin + 20.0];
    let encoding = Encoding::new(basis, 0.7, 0.05, functions, bounds);
    let space = ([9, 8, 7], axes, origin);
    let listed = Listed::new(&encoding, space, &Ticket::new()).expect("not cancelled");
    (encoding, listed, move |index| origin + axes * index)
}

#[test]
fn functions_in_index_space_have_the_sum_that_they_have_in_the_world() {
    for basis in Basis::ALL {
        let (encoding, listed, world) = listed(basis);
        let mut next = random();
        for _ in 0..2000 {
            let at = DVec3::new(9.0 * next() - 0.5, 8.0 * next() - 0.5, 7.0 * next() - 0.5);
            let (found, expected) = (listed.value(at) + 0.7, encoding.value(world(at)));
            assert!((found - expected).abs() < 1e-10, "{basis:?} {at}: {found} {expected}");
        }
    }
}

#[test]
fn no_sum_lies_further_beyond_those_at_the_samples_about_it_than_the_slack() {
    for basis in Basis::ALL {
        let (_, listed, _) = listed(basis);
        check_slack(basis, &listed, 0.03);
        for corrects in [false, true] {
            let limited = listed.clone().limited(5, corrects, &Ticket::new()).expect("goes on");
            assert!(limited.left_out.is_some(), "{basis:?}");
            // What cells may be off by is counted for values and for samples, each at its worst: little of it is needed.
            check_slack(basis, &limited, 0.0);
        }
    }
}

/// The greatest share of the slack that is needed anywhere is more than `least_used`.
fn check_slack(basis: Basis, listed: &Listed, least_used: f64) {
    let mut next = random();
    let mut used: f64 = 0.0;
    for _ in 0..3000 {
        // In a cell between samples, or half a sample beyond the last.
        let cell = DVec3::new(9.0 * next(), 8.0 * next(), 7.0 * next()).floor() - 0.5;
        let (low, high) = (cell, cell + 1.0);
        let at = low + DVec3::new(next(), next(), next());
        let last = DVec3::new(8.0, 7.0, 6.0);
        let corners = (0..27).map(|i| {
            let step = [i % 3, i / 3 % 3, i / 9].map(f64::from);
            ((low - 0.5) + DVec3::from(step)).clamp(DVec3::ZERO, last)
        });
        let sums = corners.map(|corner| listed.value(corner));
        let [least, most] =
            sums.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
        let (found, slack) = (listed.value(at), listed.slack(low, high));
        assert!(found >= least - slack && found <= most + slack, "{basis:?} {at}");
        used = used.max((least - found).max(found - most) / slack);
    }
    // They are of use: somewhere a part of the slack is needed. Multiquadrics, whose far flanks are counted as if all
    // bent one way, need least: 0.05.
    assert!(used > least_used, "{basis:?}: {used}");
}

/// Functions as wide as several cells, so that each cell's list is long; the space of a lattice of 21 × 18 × 23 samples; and
/// places all over it.
fn with_long_lists(basis: Basis) -> (Encoding, ([usize; 3], DMat3, DVec3), Vec<DVec3>) {
    let mut next = random();
    let dims = [21, 18, 23];
    let size = DVec3::from(dims.map(|n| n as f64));
    let mut any = || DVec3::new(next(), next(), next());
    let functions: Vec<Function> = (0..70)
        .map(|_| {
            let (centre, width) = (any() * size, 3.0 + 4.0 * any().x);
            let shape = DMat3::from_diagonal(DVec3::splat(1.0 / width));
            Function { centre, shape, weight: 10.0 * (any().x - 0.4) }
        })
        .collect();
    let places = (0..4000).map(|_| any() * size - 0.5).collect();
    let encoding = Encoding::new(basis, 0.5, 1e-3, functions, [DVec3::splat(-0.5), size - 0.5]);
    (encoding, (dims, DMat3::IDENTITY, DVec3::ZERO), places)
}

#[test]
fn a_limit_that_no_cell_reaches_changes_no_bit() {
    for basis in Basis::ALL {
        let (encoding, space, places) = with_long_lists(basis);
        let listed = Listed::new(&encoding, space, &Ticket::new()).expect("goes on");
        let longest = listed.starts.windows(2).map(|pair| pair[1] - pair[0]).max();
        let longest = longest.expect("cells");
        assert!(longest > 20, "{basis:?}: {longest}");
        for corrects in [false, true] {
            let of = |most: u32| {
                let limits = Limits { per_cell: Some(most), corrects, ..Limits::NONE };
                limits.listed(&encoding, space, &Ticket::new()).expect("goes on")
            };
            let same = of(longest);
            assert!(same.left_out.is_none() && same.lists == listed.lists, "{basis:?}");
            let is_same = |at: &DVec3| same.value(*at).to_bits() == listed.value(*at).to_bits();
            assert!(places.iter().all(is_same), "{basis:?}");
            assert!(of(longest - 1).left_out.is_some(), "{basis:?}");
        }
    }
}

#[test]
fn what_cells_leave_out_is_exact_at_their_corners_and_nearer_in_between() {
    for basis in Basis::ALL {
        let (encoding, space, places) = with_long_lists(basis);
        let whole = Listed::new(&encoding, space, &Ticket::new()).expect("goes on");
        let limited = |most: usize, corrects: bool| {
            whole.clone().limited(most, corrects, &Ticket::new()).expect("goes on")
        };
        for most in [1, 4, 12] {
            let [plain, corrected] = [limited(most, false), limited(most, true)];
            for listed in [&plain, &corrected] {
                let longest = listed.starts.windows(2).map(|pair| pair[1] - pair[0]).max();
                assert_eq!(longest, u32::try_from(most).ok(), "{basis:?}");
            }
            let rms = |listed: &Listed| {
                let square = |at: &DVec3| (listed.value(*at) - whole.value(*at)).powi(2);
                (places.iter().map(square).sum::<f64>() / places.len() as f64).sqrt()
            };
            let [off, left] = [rms(&plain), rms(&corrected)];
            assert!(left < MOST_LEFT * off, "{basis:?} {most}: {left} of {off}");
            let [nx, ny, nz] = whole.cells;
            for i in 0..nx * ny * nz {
                let cell = DVec3::from([i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64));
                let corner = cell * whole.edge as f64 - 0.5;
                let off = (corrected.value(corner) - whole.value(corner)).abs();
                assert!(off < 1e-11, "{basis:?} {most} {corner}: {off}");
                // From the cell before it, too.
                let before = corner - 1e-9;
                let off = (corrected.value(before) - whole.value(before)).abs();
                assert!(off < 1e-6, "{basis:?} {most} {before}: {off}");
            }
        }
    }
}

#[test]
fn cells_keep_the_functions_that_are_greatest_in_them() {
    let function = |x: f64, weight: f64| Function {
        centre: DVec3::new(x, 2.0, 2.0),
        shape: DMat3::from_diagonal(DVec3::splat(0.5)),
        weight,
    };
    // The lesser one is the greater at its own end.
    let all = [function(1.0, 5.0), function(8.5, -3.0)];
    let bounds = [DVec3::ZERO, DVec3::splat(10.0)];
    let encoding = Encoding::new(Basis::Gaussian, 0.0, 1e-6, all, bounds);
    let space = ([10, 4, 4], DMat3::IDENTITY, DVec3::ZERO);
    let limits = Limits { per_cell: Some(1), corrects: false, ..Limits::NONE };
    let listed = limits.listed(&encoding, space, &Ticket::new()).expect("goes on");
    for (x, kept) in [(1.0, 0), (8.5, 1)] {
        let at = DVec3::new(x, 1.0, 3.0);
        let alone = all[kept].weight * Basis::Gaussian.of_square(all[kept].square(at));
        assert!((listed.value(at) - alone).abs() < 1e-15, "{x}");
    }
}

#[test]
fn gradients_in_index_space_are_finite_differences_of_what_cells_keep_and_add() {
    for basis in Basis::ALL {
        let (_, listed, _) = listed(basis);
        let limited = |corrects| listed.clone().limited(5, corrects, &Ticket::new());
        for listed in [&listed, &limited(false).expect("goes on"), &limited(true).expect("goes on")]
        {
            let mut next = random();
            let (mut worst, mut compared): (f64, u32) = (0.0, 0);
            for _ in 0..300 {
                let at = DVec3::new(9.0 * next(), 8.0 * next(), 7.0 * next()) - 0.5;
                let step = 1e-5;
                let along = |axis: DVec3| {
                    let [past, before] = [step, -step].map(|s| listed.value(at + axis * s));
                    (past - before) / (2.0 * step)
                };
                let expected = DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z));
                let off = (listed.gradient(at) - expected).length();
                // Where a function or a cell ends within the step, the difference is of that.
                if off < 100.0 {
                    worst = worst.max(off);
                    compared += 1;
                }
            }
            assert!(worst < 1e-4 && compared > 290, "{basis:?}: {worst}, {compared}");
        }
    }
}

#[test]
fn a_sum_without_its_left_out_is_off_by_no_more_than_was_asked_for() {
    for basis in Basis::ALL {
        let (encoding, _, places) = with_long_lists(basis);
        let count = encoding.functions().len();
        let mut before = 0;
        for max_rms in [0.0, 0.05, 0.5, 2.0, 5.0, 1e6] {
            let few = encoding.without_least(max_rms);
            let left_out = count - few.functions().len();
            let (told, rms) = encoding.left_out(max_rms);
            assert_eq!(told, left_out, "{basis:?}");
            let square = |at: &DVec3| (few.value(*at) - encoding.value(*at)).powi(2);
            let off = places.iter().map(square).sum::<f64>() / places.len() as f64;
            assert!(off.sqrt() <= rms && rms <= max_rms, "{basis:?}: {} {rms}", off.sqrt());
            assert!(left_out >= before, "{basis:?} {max_rms}: {left_out} {before}");
            // Those that stay are the same, in their order.
            let mut all = encoding.functions().iter();
            assert!(few.functions().iter().all(|own| all.any(|other| other == own)));
            if max_rms == 0.0 {
                let is_same =
                    |at: &DVec3| few.value(*at).to_bits() == encoding.value(*at).to_bits();
                assert!(left_out == 0 && places.iter().all(is_same), "{basis:?}");
            }
            before = left_out;
        }
        assert_eq!(before, count, "{basis:?}: any error allows for none");
        let some = encoding.left_out(2.0).0;
        assert!(some > 0 && some < count, "{basis:?}: {some}");
        // No box has no mean, and what may be anything is nothing that was asked for.
        for max_rms in [f64::NAN, -1.0] {
            assert_eq!(encoding.without_least(max_rms).functions().len(), count);
        }
    }
}

#[test]
fn gradients_are_finite_differences() {
    for basis in Basis::ALL {
        let (encoding, _, world) = listed(basis);
        let mut next = random();
        let mut worst: f64 = 0.0;
        for _ in 0..300 {
            let at = world(DVec3::new(9.0 * next(), 8.0 * next(), 7.0 * next()));
            let step = 1e-5;
            let along = |axis: DVec3| {
                let [past, before] = [step, -step].map(|s| encoding.value(at + axis * s));
                (past - before) / (2.0 * step)
            };
            let found = encoding.gradient(at);
            let expected = DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z));
            // Where a function ends within the step, the difference is of that.
            if (found - expected).length() < 100.0 {
                worst = worst.max((found - expected).length());
            }
        }
        assert!(worst < 1e-4, "{basis:?}: {worst}");
    }
}

/// Functions are placed, counted and put in lists, each in one cell or more.
#[test]
fn lists_of_many_functions_are_left_off_where_a_ticket_says_so() {
    let mut next = random();
    let functions: Vec<Function> = (0..40_000)
        .map(|_| Function {
            centre: DVec3::new(next(), next(), next()) * 60.0,
            shape: DMat3::from_diagonal(DVec3::splat(2.0)),
            weight: next(),
        })
        .collect();
    let least = 3 * 16 * functions.len() / (1 << 14);
    let bounds = [DVec3::splat(-3.0), DVec3::splat(63.0)];
    let encoding = Encoding::new(Basis::Gaussian, 0.0, 0.05, functions, bounds);
    let space = ([61; 3], DMat3::IDENTITY, DVec3::ZERO);
    assert_stops("lists of functions", least, |ticket| Listed::new(&encoding, space, ticket));
}

#[test]
fn the_search_for_the_least_of_many_functions_ends_where_a_ticket_says_so() {
    let mut next = random();
    let functions: Vec<Function> = (0..2000).map(|_| some_function(&mut next)).collect();
    let bounds = [DVec3::ZERO, DVec3::splat(10.0)];
    let make = || Encoding::new(Basis::Ellipsoid, 0.0, 1e-3, functions.iter().copied(), bounds);
    // Sixteen parts look once in 256 functions.
    assert_stops("the least functions", 16 * 7, |ticket| make().find_least(ticket));
    // What was found so is what is asked for later.
    let (found, alone) = (make(), make());
    found.find_least(&Ticket::new()).expect("nobody stops it");
    assert_eq!(found.left_out(0.5), alone.left_out(0.5));
}

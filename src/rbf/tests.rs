//! The encoder and the sum against analytic fields, finite differences and brute force.

use std::ops::ControlFlow;
use std::sync::mpsc;
use std::time::Duration;

use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector, Matrix3};

use super::cluster::{Cluster, split_into};
use super::encode::resume_within;
use super::refine::derivatives;
use super::solve::{Column, least_squares};
use super::*;
use crate::core::{Ticket, assert_stops};

/// The share of the error that is left of what cells leave out, once it is added between their corners. Of functions as wide as a
/// cell or two: Gaussians 0.12, 0.11 and 0.10 with 1, 4 and 12 functions a cell, multiquadrics 0.02 to 0.03.
const MOST_LEFT: f64 = 0.15;

const GOAL: Goal =
    Goal { basis: Basis::Ellipsoid, max_error: 0.01, mean_error: f64::INFINITY, functions: 200 };

/// Numbers in 0 to 1, always the same.
fn random() -> impl FnMut() -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn lattice(side: usize) -> impl Iterator<Item = DVec3> {
    let at = move |i: usize| [i % side, i / side % side, i / (side * side)].map(|n| n as f64);
    (0..side.pow(3)).map(move |i| DVec3::from(at(i)))
}

fn some_function(next: &mut impl FnMut() -> f64) -> Function {
    let mut centred = || next() - 0.5;
    Function {
        centre: DVec3::new(centred(), centred(), centred()) * 8.0 + 5.0,
        shape: DMat3::from_cols_array(&[
            0.5 + centred().abs(),
            0.0,
            0.0,
            centred() * 0.4,
            0.4 + centred().abs(),
            0.0,
            centred() * 0.4,
            centred() * 0.4,
            0.6 + centred().abs(),
        ]),
        weight: centred() * 10.0,
    }
}

fn encoded(points: &Points, goal: Goal) -> Encoding {
    encode(points, goal, &Ticket::new(), |_| ControlFlow::Continue(())).expect("there are samples")
}

#[test]
fn a_function_ends_where_it_is_epsilon_and_one_below_it_reaches_nowhere() {
    for basis in Basis::ALL {
        for weight in [3.0, -0.2] {
            let reach = basis.reach_square(weight, 0.01).expect("it is above");
            assert!((weight.abs() * basis.of_square(reach) - 0.01).abs() < 1e-12, "{basis:?}");
        }
        for weight in [0.01, -0.01, 0.0, f64::NAN] {
            assert_eq!(basis.reach_square(weight, 0.01), None, "{basis:?} {weight}");
        }
    }
    // Jang, section 5: r = σ √(2 ln(|w|/ε)).
    let reach = Basis::Gaussian.reach_square(1.0, (-2.0_f64).exp()).expect("it is above");
    assert!((reach.sqrt() - 2.0).abs() < 1e-12);
}

#[test]
fn the_box_of_a_function_just_holds_all_of_it() {
    let mut next = random();
    for _ in 0..20 {
        let function = some_function(&mut next);
        let half = function.half_box(4.0);
        let mut greatest = DVec3::ZERO;
        for _ in 0..20_000 {
            let direction = DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5).normalize();
            let offset = function.shape.inverse() * direction * 2.0;
            greatest = greatest.max(offset.abs());
        }
        assert!((greatest / half).max_element() <= 1.0 + 1e-12, "{greatest} {half}");
        assert!((greatest / half).min_element() > 0.98, "{greatest} {half}");
    }
}

#[test]
fn derivatives_are_finite_differences() {
    let mut next = random();
    for basis in Basis::ALL {
        let mut function = some_function(&mut next);
        if basis != Basis::Ellipsoid {
            function.shape = DMat3::from_diagonal(DVec3::splat(0.7));
        }
        let at = function.centre + DVec3::new(0.6, -0.4, 0.8);
        let value = |f: &Function| f.weight * basis.of_square(f.square(at));
        let (by, own) = derivatives(basis, &function, at);
        assert!((own - value(&function)).abs() < 1e-14);
        let step = 1e-6;
        let moved = |parameter: usize, by: f64| {
            let mut f = function;
            match parameter {
                0 => f.weight += by,
                1..4 => f.centre[parameter - 1] += by,
                4.. if basis != Basis::Ellipsoid => f.shape *= by.exp(),
                4..7 => f.shape.col_mut(parameter - 4)[parameter - 4] *= by.exp(),
                7 => f.shape.y_axis.x += by,
                8 => f.shape.z_axis.x += by,
                _ => f.shape.z_axis.y += by,
            }
            value(&f)
        };
        let count = if basis == Basis::Ellipsoid { 10 } else { 5 };
        for (parameter, found) in by.into_iter().enumerate().take(count) {
            let expected = (moved(parameter, step) - moved(parameter, -step)) / (2.0 * step);
            assert!((found - expected).abs() < 1e-7, "{basis:?} {parameter}: {found} {expected}");
        }
    }
}

#[test]
fn weights_are_those_of_a_dense_decomposition() {
    let mut next = random();
    let (rows, count) = (60, 7);
    let dense: Vec<Vec<f32>> =
        (0..count).map(|_| (0..rows).map(|_| next() as f32).collect()).collect();
    let columns: Vec<Column> = dense
        .iter()
        .map(|values| Column { points: (0..rows as u32).collect(), values: values.clone() })
        .collect();
    let right: Vec<f64> = (0..rows).map(|_| next() * 4.0).collect();
    let found = least_squares(&columns, &right, &[], 0.0);
    let matrix = DMatrix::from_fn(rows, count + 1, |row, column| {
        if column == count { 1.0 } else { f64::from(dense[column][row]) }
    });
    let roots: Vec<f64> = (0..rows).map(|_| 0.3 + 2.0 * next()).collect();
    let scale = DMatrix::from_diagonal(&DVector::from_vec(roots.clone()));
    let weighed = least_squares(&columns, &right, &roots, 0.0);
    let right = DVector::from_vec(right);
    for (found, matrix, right) in
        [(found, matrix.clone(), right.clone()), (weighed, &scale * matrix, &scale * right)]
    {
        let expected = matrix.svd(true, true).solve(&right, 1e-12).expect("it has both sides");
        for (found, expected) in found.iter().zip(expected.iter()) {
            assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        }
    }
}

#[test]
fn columns_that_are_the_same_share_what_they_stand_for() {
    let column = Column { points: vec![0, 1, 2], values: vec![1.0, 2.0, 1.0] };
    let columns = vec![column.clone(), column, Column::default()];
    let weights = least_squares(&columns, &[2.0, 4.0, 2.0, 0.0], &[], 1e-4);
    assert!((weights[0] - 1.0).abs() < 1e-3 && (weights[1] - 1.0).abs() < 1e-3, "{weights:?}");
    assert_eq!(weights[2], 0.0, "one that reaches nothing");
}

#[test]
fn columns_that_are_nearly_the_same_get_no_huge_opposite_weights() {
    // Two Gaussians, a hundred-thousandth of their width apart, are to be a residual that only their difference is.
    let values = |shift: f64| -> Vec<f32> {
        (0..60)
            .map(|i| (-0.5 * ((f64::from(i) - 30.0) / 8.0 - shift).powi(2)).exp() as f32)
            .collect()
    };
    let column = |shift| Column { points: (0..60).collect(), values: values(shift) };
    let columns = [column(0.0), column(1e-5)];
    let pairs = columns[0].values.iter().zip(&columns[1].values);
    let difference: Vec<f64> = pairs.map(|(a, b)| f64::from(*a) - f64::from(*b)).collect();
    let length = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let right: Vec<f64> = difference.iter().map(|v| v / length(&difference)).collect();
    let size = |damping: f64| {
        let weights = least_squares(&columns, &right, &[], damping);
        weights[0].abs() + weights[1].abs()
    };
    // Measured: 187 and 75110. With damping λ no change is longer than that of the residual by 1/2λ.
    let (damped, free) = (size(1e-4), size(0.0));
    let norm = length(&columns[0].values.iter().map(|v| f64::from(*v)).collect::<Vec<_>>());
    assert!(damped <= 2.0_f64.sqrt() / 2e-4 / norm, "{damped}");
    assert!(free > 100.0 * damped, "{free} {damped}");
}

#[test]
fn weights_of_a_fit_do_not_grow_against_each_other() {
    // What two opposite Gaussians are best that lie as near to each other as can be, and what nothing is.
    let dipole = |at: DVec3| {
        let offset = at - 5.5;
        offset.x * (-0.5 * offset.length_squared() / 4.0).exp()
    };
    let mut next = random();
    let noise: Vec<f64> = (0..1000).map(|_| next()).collect();
    let cases: [(&str, Vec<f64>); 2] =
        [("dipole", lattice(12).map(dipole).collect()), ("noise", noise)];
    for (name, values) in cases {
        let side = (values.len() as f64).cbrt().round() as usize;
        let points = Points::new(lattice(side).zip(values.iter().copied()));
        let [low, high] = values
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]);
        for basis in Basis::ALL {
            let goal = Goal { basis, max_error: 1e-4 * (high - low), functions: 60, ..GOAL };
            let encoding = encoded(&points, goal);
            let sizes = |at: &DVec3| -> f64 {
                let size = |f: &Function| f.weight.abs() * basis.of_square(f.square(*at));
                encoding.functions().iter().map(size).sum()
            };
            let most = points.positions().iter().map(sizes).fold(0.0, f64::max);
            let ratio = most / (high - low);
            println!("measured {name} {basis:?}: {ratio}");
            // Measured: at most 58, 0.6 ellipsoids, and 398 multiquadrics, which are wide and much alike.
            let most = if basis == Basis::Multiquadric { 1000.0 } else { 150.0 };
            assert!(ratio < most, "{name} {basis:?}: {ratio}");
        }
    }
}

#[test]
fn no_width_is_below_the_sampling_or_beyond_the_box() {
    // A spike would have a width of 0, a ramp one without end.
    let spike = |at: DVec3| f64::from(u8::from(at == DVec3::new(5.0, 6.0, 4.0)));
    let ramp = |at: DVec3| at.x + 0.5 * at.y;
    let fields: [(&str, &dyn Fn(DVec3) -> f64); 2] = [("spike", &spike), ("ramp", &ramp)];
    for (name, field) in fields {
        let points = Points::new(lattice(12).map(|at| (at, field(at))));
        let [low, high] = points.bounds();
        let (least, most) = (0.5 * points.spacing(), (high - low).length());
        for basis in Basis::ALL {
            let goal = Goal { basis, max_error: 1e-3, functions: 40, ..GOAL };
            let encoding = encoded(&points, goal);
            assert!(!encoding.functions().is_empty(), "{name} {basis:?}");
            for function in encoding.functions() {
                let shape = Matrix3::from_column_slice(&function.shape.to_cols_array());
                for singular in shape.svd(false, false).singular_values.iter() {
                    let width = singular.recip();
                    let is_allowed = width > least * (1.0 - 1e-6) && width < most * (1.0 + 1e-6);
                    assert!(is_allowed, "{name} {basis:?}: {width} of {least} to {most}");
                }
            }
        }
    }
}

#[test]
fn a_cluster_without_points_or_of_one_place_is_not_split() {
    let points = Points::new([(DVec3::ONE, 2.0), (DVec3::ONE, 3.0), (DVec3::ONE, -1.0)]);
    let residual = [2.0, 3.0, -1.0];
    let empty = Cluster::of(Vec::new(), &residual);
    assert_eq!((empty.energy, empty.worst), (0.0, (0.0, 0)));
    let spread = empty.spread(&points, &residual);
    assert_eq!((spread.mean, spread.covariance), (DVec3::ONE, DMat3::ZERO));
    let whole = empty.split(&points, &residual).expect_err("it has no halves");
    assert!(whole.points.is_empty());
    // One of the halves would be empty.
    let one = Cluster::of(vec![0, 1, 2], &residual);
    let whole = one.split(&points, &residual).expect_err("it has no halves");
    assert_eq!((whole.points, whole.energy), (vec![0, 1, 2], 14.0));
}

#[test]
fn many_samples_at_one_place_keep_no_other_cluster_from_being_split() {
    // The pile has the most squared error of all, and cannot be split.
    let pile = (0..30).map(|i| (DVec3::new(50.0, 0.0, 0.0), f64::from(i % 2) * 200.0 - 100.0));
    let points = Points::new(pile.chain(lattice(3).map(|at| (at, at.x))));
    let residual = points.values().to_vec();
    for (count, expected) in [(1, 1), (2, 2), (20, 20), (100, 28)] {
        let all = Cluster::of((0..57).collect(), &residual);
        let found = split_into(count, all, (&points, &residual), &Ticket::new());
        let found = found.expect("nobody stops it");
        assert_eq!(found.len(), expected, "27 places and the pile's");
        let mut held: Vec<u32> = found.into_iter().flat_map(|cluster| cluster.points).collect();
        held.sort_unstable();
        assert_eq!(held, (0..57).collect::<Vec<u32>>(), "each point once");
    }
}

#[test]
fn boxes_find_all_points_in_them() {
    let mut next = random();
    let all: Vec<(DVec3, f64)> = (0..3000)
        .map(|i| (DVec3::new(next() * 9.0, next() * 0.1, next() * 40.0), f64::from(i)))
        .collect();
    let points = Points::new(all.iter().copied());
    assert_eq!(points.len(), 3000);
    for _ in 0..200 {
        let low = DVec3::new(next() * 12.0 - 2.0, next() * 0.2 - 0.05, next() * 60.0 - 10.0);
        let high = low + DVec3::new(next() * 3.0, next() * 0.1, next() * 9.0);
        let is_inside = |at: &DVec3| at.cmpge(low).all() && at.cmple(high).all();
        let expected = all.iter().filter(|(at, _)| is_inside(at)).count();
        let found = points.in_box(low, high).flatten();
        let found = found.filter(|i| is_inside(&points.positions()[*i])).count();
        assert_eq!(found, expected);
    }
}

#[test]
fn the_tree_sums_what_all_functions_do() {
    let mut next = random();
    for basis in Basis::ALL {
        let epsilon = 0.3;
        let functions: Vec<Function> = (0..300)
            .map(|_| {
                let function = some_function(&mut next);
                let spherical = DMat3::from_diagonal(DVec3::splat(1.5));
                let shape = if basis == Basis::Ellipsoid { function.shape } else { spherical };
                Function { shape: shape * 1.5, ..function }
            })
            .collect();
        let bounds = [DVec3::splat(1.0), DVec3::splat(9.0)];
        let encoding = Encoding::new(basis, 2.0, epsilon, functions.iter().copied(), bounds);
        assert!(encoding.cells() > 1, "{basis:?}");
        // What is not split fills the box; of each cell that is split there are eight parts.
        let leaves = encoding.leaves();
        assert_eq!(leaves.len(), 1 + 7 * (encoding.cells() - 1) / 8, "{basis:?}");
        let sizes = leaves.iter().map(|([low, high], _)| (high - low).element_product());
        assert!((sizes.sum::<f64>() - 512.0).abs() < 1e-9, "{basis:?}");
        for _ in 0..2000 {
            // Some of them beyond the box.
            let at = DVec3::new(next(), next(), next()) * 11.0;
            let share = |f: &Function| match basis.reach_square(f.weight, epsilon) {
                Some(reach) if f.square(at) <= reach => f.weight * basis.of_square(f.square(at)),
                _ => 0.0,
            };
            let expected = 2.0 + functions.iter().map(share).sum::<f64>();
            assert!((encoding.value(at) - expected).abs() < 1e-12, "{basis:?} {at}");
        }
    }
}

#[test]
fn a_sum_of_three_gaussians_is_found_again() {
    let functions = [
        Function {
            centre: DVec3::new(5.0, 6.0, 7.0),
            shape: DMat3::from_diagonal(DVec3::new(0.5, 0.3, 0.4)),
            weight: 10.0,
        },
        Function {
            centre: DVec3::new(11.0, 10.0, 6.0),
            shape: DMat3::from_cols_array(&[0.4, 0.0, 0.0, 0.2, 0.5, 0.0, 0.0, 0.1, 0.3]),
            weight: -6.0,
        },
        Function {
            centre: DVec3::new(8.0, 9.0, 12.0),
            shape: DMat3::from_diagonal(DVec3::splat(0.6)),
            weight: 4.0,
        },
    ];
    let value = |at: DVec3| {
        let shares = functions.iter().map(|f| f.weight * Basis::Ellipsoid.of_square(f.square(at)));
        3.0 + shares.sum::<f64>()
    };
    let points = Points::new(lattice(16).map(|at| (at, value(at))));
    let encoding = encoded(&points, Goal { max_error: 0.02, ..GOAL });
    let errors = encoding.errors(&points, &Ticket::new()).expect("nobody stops it");
    // Measured: 14 functions, 0.014.
    assert!(errors.max <= 0.02, "{errors:?}");
    assert!(encoding.functions().len() <= 40, "{}", encoding.functions().len());
    // Between the samples, too.
    let mut next = random();
    for _ in 0..500 {
        let at = DVec3::new(next(), next(), next()) * 15.0;
        assert!((encoding.value(at) - value(at)).abs() < 0.1, "{at}");
    }
}

#[test]
fn errors_fall_as_functions_are_added_and_every_basis_comes_as_near_as_asked_for() {
    let value = |at: DVec3| (at.x * 0.5).sin() * (at.y * 0.4).cos() + (at.z * 0.3).sin();
    let points = Points::new(lattice(14).map(|at| (at, value(at))));
    for basis in Basis::ALL {
        let mut steps = Vec::new();
        let goal = Goal { basis, max_error: 0.1, functions: 600, ..GOAL };
        let encoding = encode(&points, goal, &Ticket::new(), |step| {
            steps.push(step);
            ControlFlow::Continue(())
        });
        let encoding = encoding.expect("there are samples");
        let errors = encoding.errors(&points, &Ticket::new()).expect("nobody stops it");
        assert!(errors.max <= 0.1, "{basis:?} {errors:?} by {}", encoding.functions().len());
        assert!(errors.mean <= errors.rms && errors.rms <= errors.max);
        let [first, last] = [steps[0], steps[steps.len() - 1]];
        assert!(last.errors.rms < first.errors.rms / 10.0, "{basis:?} {first:?} {last:?}");
        assert!(steps.windows(2).all(|pair| pair[1].errors.rms <= pair[0].errors.rms * 1.05));
    }
}

#[test]
fn no_more_functions_than_were_allowed() {
    let mut next = random();
    let points = Points::new(lattice(10).map(|at| (at, next())));
    for functions in [1, 2, 7, 30] {
        let encoding = encoded(&points, Goal { functions, max_error: 1e-9, ..GOAL });
        assert!(encoding.functions().len() <= functions && !encoding.functions().is_empty());
    }
}

#[test]
fn few_flat_and_doubled_points_are_encoded() {
    let line = |i: usize| DVec3::new(i as f64, 2.0 * i as f64, -1.0);
    let plane = |i: usize| DVec3::new((i % 9) as f64, (i / 9) as f64, 4.0);
    let value = |i: usize| (i as f64 * 0.7).sin();
    let cases: [(&str, Vec<(DVec3, f64)>); 9] = [
        ("one", vec![(DVec3::ONE, 5.0)]),
        ("two", (0..2).map(|i| (line(i), value(i))).collect()),
        ("three", (0..3).map(|i| (line(i), value(i))).collect()),
        ("four", (0..4).map(|i| (plane(i), value(i))).collect()),
        ("a line", (0..40).map(|i| (line(i), value(i))).collect()),
        ("a plane", (0..81).map(|i| (plane(i), value(i))).collect()),
        ("all at one place", (0..20).map(|i| (DVec3::ONE, value(i))).collect()),
        ("doubled", (0..162).map(|i| (plane(i / 2), value(i / 2))).collect()),
        ("far away", (0..81).map(|i| (plane(i) * 1e-3 + 1e7, value(i))).collect()),
    ];
    for (name, samples) in cases {
        for basis in Basis::ALL {
            let points = Points::new(samples.iter().copied());
            let encoding = encoded(&points, Goal { basis, ..GOAL });
            let errors = encoding.errors(&points, &Ticket::new()).expect("nobody stops it");
            assert!(errors.max.is_finite(), "{name} {basis:?}");
            let is_sound = |f: &Function| f.weight.is_finite() && f.shape.inverse().is_finite();
            assert!(encoding.functions().iter().all(is_sound), "{name} {basis:?}");
            // At one place there is one value: the mean is as near as any.
            if name != "all at one place" {
                assert!(errors.max < 0.3, "{name} {basis:?} {errors:?}");
            }
        }
    }
}

#[test]
fn a_constant_needs_no_function() {
    let points = Points::new(lattice(6).map(|at| (at, -7.5)));
    let encoding = encoded(&points, GOAL);
    assert_eq!(encoding.functions().len(), 0);
    assert_eq!(encoding.value(DVec3::splat(2.3)), -7.5);
}

#[test]
fn what_is_not_finite_is_left_out_and_counted() {
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    let value = |i: usize| if i.is_multiple_of(11) { odd[i / 11 % 3] } else { 1.0 };
    let points = Points::new(lattice(6).enumerate().map(|(i, at)| (at, value(i))));
    assert_eq!(points.left_out(), 216_usize.div_ceil(11));
    assert_eq!(points.len() + points.left_out(), 216);
    let nothing = Points::new([(DVec3::ZERO, f64::NAN), (DVec3::NAN, 1.0)]);
    let refused = encode(&nothing, GOAL, &Ticket::new(), |_| ControlFlow::Continue(()));
    assert!(matches!(refused, Err(EncodeError::Nothing)));
}

#[test]
fn values_of_thirty_decades_are_encoded_and_ranges_beyond_squares_refused() {
    let value = |at: DVec3| 10.0_f64.powf(at.x * 5.0 - 15.0);
    let points = Points::new(lattice(7).map(|at| (at, value(at))));
    let encoding = encoded(&points, Goal { max_error: 1e13, ..GOAL });
    let errors = encoding.errors(&points, &Ticket::new()).expect("nobody stops it");
    assert!(errors.max <= 1e13, "{errors:?}");
    for (low, high) in [(-1e300, 1e300), (0.0, 1e-200)] {
        let samples = [(DVec3::ZERO, low), (DVec3::ONE, high)];
        let refused =
            encode(&Points::new(samples), GOAL, &Ticket::new(), |_| ControlFlow::Continue(()));
        assert!(matches!(refused, Err(EncodeError::Range(_))), "{low} {high}");
    }
}

#[test]
fn a_cancel_ends_it_in_any_round() {
    let mut next = random();
    let points = Points::new(lattice(10).map(|at| (at, next())));
    for rounds in 0..4 {
        let ticket = Ticket::new();
        let mut left = rounds;
        let goal = Goal { max_error: 1e-9, ..GOAL };
        let ended = encode(&points, goal, &ticket, |_| {
            if left == 0 {
                ticket.cancel();
            }
            left -= 1;
            ControlFlow::Continue(())
        });
        assert!(matches!(ended, Err(EncodeError::Cancelled(_))), "{rounds}");
    }
}

#[test]
fn a_paused_fit_waits_and_wakes_for_a_cancel() {
    let mut next = random();
    let points = Points::new(lattice(6).map(|at| (at, next())));
    for is_cancelled in [false, true] {
        let ticket = Ticket::new();
        ticket.pause(true);
        let (sender, ended) = mpsc::channel();
        let (points, own) = (points.clone(), ticket.clone());
        let fit = move || {
            let goal = Goal { functions: 12, max_error: 1e-9, ..GOAL };
            let made = encode(&points, goal, &own, |_| ControlFlow::Continue(()));
            sender.send(made.map(|encoding| encoding.functions().len()))
        };
        let thread = std::thread::spawn(fit);
        assert!(ended.recv_timeout(Duration::from_millis(200)).is_err(), "it waits");
        if is_cancelled {
            ticket.cancel();
        } else {
            ticket.pause(false);
        }
        let end = ended.recv_timeout(Duration::from_secs(60)).expect("it wakes");
        let is_as_asked_for = match &end {
            Ok(functions) => !is_cancelled && *functions > 0,
            Err(error) => is_cancelled && matches!(error, EncodeError::Cancelled(_)),
        };
        assert!(is_as_asked_for, "{end:?}");
        thread.join().expect("it ends").expect("somebody waits");
    }
}

#[test]
fn broken_off_it_keeps_the_nearest_functions() {
    let mut next = random();
    let points = Points::new(lattice(10).map(|at| (at, next())));
    let goal = Goal { max_error: 1e-9, ..GOAL };
    let until = |count: usize| {
        let told = |step: Step| match step.functions >= count {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        encode(&points, goal, &Ticket::new(), told).expect("there are samples").functions().len()
    };
    let counts = [0, 8, 40].map(until);
    assert!(counts[0] == 0 && (4..40).contains(&counts[1]) && counts[2] < 200, "{counts:?}");
    assert!(counts[2] > counts[1], "{counts:?}");
}

/// A field that no few functions are: three waves and a ridge.
fn rough(at: DVec3) -> f64 {
    let waves = (at.x * 0.9).sin() * (at.y * 0.7).cos() + (at.z * 0.8 + at.x * 0.3).sin();
    waves + (-0.5 * (at.x - at.y).powi(2)).exp()
}

fn resumed(points: &Points, start: &Encoding, goal: Goal) -> Encoding {
    let told = |_| ControlFlow::Continue(());
    resume(points, start, goal, &Ticket::new(), told).expect("it is of the same basis")
}

fn errors_of(encoding: &Encoding, points: &Points) -> Errors {
    encoding.errors(points, &Ticket::new()).expect("nobody stops it")
}

#[test]
fn a_fit_goes_on_from_an_earlier_one_and_comes_as_near_as_one_made_at_once() {
    let points = Points::new(lattice(12).map(|at| (at, rough(at))));
    for basis in Basis::ALL {
        let goal = |functions| Goal { basis, max_error: 1e-6, functions, ..GOAL };
        let few = encoded(&points, goal(40));
        let at_once = errors_of(&encoded(&points, goal(80)), &points);
        let before = errors_of(&few, &points);
        let more = resumed(&points, &few, goal(80));
        let after = errors_of(&more, &points);
        let told = format!("{basis:?}: {before:?}, then {after:?}, at once {at_once:?}");
        assert!(more.functions().len() > few.functions().len(), "{told}");
        assert!(more.functions().len() <= 80, "{told}");
        assert!(after.max <= before.max && after.rms < before.rms, "{told}");
        // Where functions lie depends on the way there: neither is always the nearer one.
        assert!(after.rms < 1.5 * at_once.rms, "{told}");
    }
}

#[test]
fn no_fit_that_goes_on_is_worse_than_it_was() {
    let mut next = random();
    let points = Points::new(lattice(8).map(|at| (at, next())));
    let mut encoding = encoded(&points, Goal { max_error: 0.3, functions: 12, ..GOAL });
    let mut before = errors_of(&encoding, &points);
    // Coarser goals than the first, none that can be reached, and fewer functions than there are.
    for (max_error, functions) in [(0.4, 16), (1e-9, 20), (0.2, 20), (1e-3, 4), (1e-3, 48)] {
        let goal = Goal { max_error, functions, ..GOAL };
        let more = resumed(&points, &encoding, goal);
        let after = errors_of(&more, &points);
        assert!(after.max <= before.max, "{goal:?}: {before:?}, then {after:?}");
        assert!(more.functions().len() <= functions.max(encoding.functions().len()), "{goal:?}");
        (encoding, before) = (more, after);
    }
}

#[test]
fn a_fit_that_is_as_near_as_asked_for_comes_back_as_it_is() {
    let points = Points::new(lattice(10).map(|at| (at, rough(at))));
    let fit = encoded(&points, Goal { functions: 30, ..GOAL });
    let max_error = errors_of(&fit, &points).max;
    let mut steps = Vec::new();
    let goal = Goal { max_error, functions: 300, ..GOAL };
    let again = resume(&points, &fit, goal, &Ticket::new(), |step| {
        steps.push(step.functions);
        ControlFlow::Continue(())
    });
    let again = again.expect("it is of the same basis");
    assert_eq!(again.functions(), fit.functions());
    assert_eq!((again.bias(), again.epsilon()), (fit.bias(), fit.epsilon()));
    assert_eq!(steps, [fit.functions().len()], "told once, of what there is");
}

#[test]
fn a_fit_that_has_all_functions_that_it_may_have_is_refined_all_the_same() {
    let points = Points::new(lattice(10).map(|at| (at, rough(at))));
    let fit = encoded(&points, Goal { functions: 30, ..GOAL });
    let halved = fit.functions().iter().map(|own| Function { weight: 0.5 * own.weight, ..*own });
    let start = Encoding::new(fit.basis(), fit.bias(), fit.epsilon(), halved, fit.bounds());
    let goal = Goal { max_error: 1e-6, functions: start.functions().len(), ..GOAL };
    let again = resumed(&points, &start, goal);
    assert!(again.functions().len() <= start.functions().len());
    let [before, after] = [&start, &again].map(|encoding| errors_of(encoding, &points));
    assert!(after.rms < 0.9 * before.rms && after.max <= before.max, "{before:?}, {after:?}");
}

#[test]
fn functions_with_more_values_at_the_samples_than_memory_holds_are_refused() {
    let points = Points::new(lattice(10).map(|at| (at, rough(at))));
    let goal = Goal { functions: 30, ..GOAL };
    let fit = encoded(&points, goal);
    let reached = |(function, reach): (&Function, &f64)| {
        points.positions().iter().filter(|at| function.square(**at) <= *reach).count() as u64
    };
    let entries: u64 = fit.functions().iter().zip(fit.reaches()).map(reached).sum();
    assert!(entries > 1000, "{entries}");
    let within = |free_bytes| {
        let told = |_| ControlFlow::Continue(());
        resume_within(&points, (&fit, goal), free_bytes, &Ticket::new(), told)
    };
    // A number of four bytes and a value of four.
    let refused = within(8 * entries - 1).expect_err("too many");
    assert!(matches!(refused, EncodeError::TooLarge(_)), "{refused}");
    let told = refused.to_string();
    assert!(told.starts_with("expected the functions' values") && !told.contains('\n'), "{told}");
    assert!(within(u64::MAX).is_ok());
}

#[test]
fn stated_errors_are_those_of_all_functions_at_all_samples() {
    let points = Points::new(lattice(10).map(|at| (at, rough(at))));
    for basis in Basis::ALL {
        let encoding = encoded(&points, Goal { basis, functions: 20, ..GOAL });
        let stated = errors_of(&encoding, &points);
        let (mut max, mut sum, mut squares) = (0.0_f64, 0.0, 0.0);
        for (at, value) in points.positions().iter().zip(points.values()) {
            let mut own = encoding.bias();
            for function in encoding.functions() {
                let reach = basis.reach_square(function.weight, encoding.epsilon());
                let square = function.square(*at);
                if reach.is_some_and(|reach| square <= reach) {
                    own += function.weight * basis.of_square(square);
                }
            }
            let off = (own - value).abs();
            (max, sum, squares) = (max.max(off), sum + off, squares + off * off);
        }
        let count = points.len() as f64;
        let expected = [max, sum / count, (squares / count).sqrt()];
        for (stated, expected) in [stated.max, stated.mean, stated.rms].into_iter().zip(expected) {
            assert!(
                (stated - expected).abs() < 1e-10 && expected > 0.0,
                "{basis:?}: {stated} {expected}"
            );
        }
    }
}

#[test]
fn each_goal_stops_a_fit_for_its_own_reason() {
    let points = Points::new(lattice(12).map(|at| (at, rough(at))));
    let by = |goal: Goal| {
        let encoding = encoded(&points, goal);
        let errors = errors_of(&encoding, &points);
        (encoding.functions().len(), errors)
    };
    let (never, any) = (1e-9, f64::INFINITY);
    let (of_greatest, greatest) = by(Goal { max_error: 0.3, ..GOAL });
    assert!(greatest.max <= 0.3 && of_greatest < 200, "{of_greatest} {greatest:?}");
    let (of_mean, mean) = by(Goal { max_error: any, mean_error: 0.08, ..GOAL });
    assert!(mean.mean <= 0.08 && of_mean < 200, "{of_mean} {mean:?}");
    // Of both the later one.
    let (of_both, both) = by(Goal { max_error: 0.3, mean_error: 0.08, ..GOAL });
    assert!(both.max <= 0.3 && both.mean <= 0.08, "{of_both} {both:?}");
    let (of_number, number) = by(Goal { max_error: never, functions: 24, ..GOAL });
    assert!(of_number <= 24 && number.max > never, "{of_number} {number:?}");
    // Where any error will do, the bias is enough.
    assert_eq!(by(Goal { max_error: any, ..GOAL }).0, 0);
}

/// Those of values about 0, which lie in a shell about the middle.
fn shell(at: DVec3) -> f64 {
    let middle = at.distance(DVec3::splat(6.5)) - 4.0;
    (0.9 * middle).tanh() + 0.4 * (at.x * 1.1).sin() * (at.y * 0.9).cos() * (at.z * 0.7).sin()
}

#[test]
fn favoured_values_are_nearer_by_as_many_functions() {
    let favour = Favour { times: 100.0, range: Some([-0.4, 0.4]), region: None };
    let even = Points::new(lattice(14).map(|at| (at, shell(at))));
    let favoured = even.clone().weighted(|at, value| favour.weight(at, value));
    let goal = Goal { max_error: 1e-6, functions: 60, ..GOAL };
    let of_shell = |points: &Points| {
        let encoding = encoded(points, goal);
        let left = left_of(&encoding, &even);
        let samples = even.positions().iter().zip(even.values()).zip(left);
        let own = samples.filter(|((at, value), _)| favour.has(**at, **value));
        let own: Vec<f64> = own.map(|(_, left)| left).collect();
        assert!(own.len() > 100 && own.len() < even.len() / 2, "{}", own.len());
        (encoding.functions().len(), Errors::of(&own), errors_of(&encoding, &even))
    };
    let ((count, alike, before), (as_many, nearer, all)) = (of_shell(&even), of_shell(&favoured));
    let told = format!("{count}: {alike:?}, {as_many}: {nearer:?}, all {all:?}");
    assert!(as_many <= count + 4, "{told}");
    // Weights of 100 to 1 take away more than a fifth.
    assert!(nearer.rms < 0.8 * alike.rms, "{told}");
    // It is paid for elsewhere.
    assert!(all.rms > before.rms, "{told}, {before:?}");
}

fn left_of(encoding: &Encoding, points: &Points) -> Vec<f64> {
    encoding.differences(points, &Ticket::new()).expect("nobody stops it")
}

#[test]
fn samples_that_count_once_are_fitted_as_if_nobody_had_said() {
    let favour = Favour { times: 1.0, range: Some([-0.4, 0.4]), region: None };
    let even = Points::new(lattice(10).map(|at| (at, shell(at))));
    let once = even.clone().weighted(|at, value| favour.weight(at, value));
    let goal = Goal { functions: 30, max_error: 1e-6, ..GOAL };
    let fits = [&even, &once].map(|points| encoded(points, goal));
    assert!(fits[0].functions().len() > 10);
    assert_eq!((fits[1].functions(), fits[1].bias()), (fits[0].functions(), fits[0].bias()));
}

#[test]
fn a_region_has_what_lies_between_its_faces_and_on_them() {
    let sides = DMat3::from_cols(
        DVec3::new(2.0, 1.0, 0.0),
        DVec3::new(-1.0, 3.0, 0.0),
        DVec3::new(0.0, 0.5, 4.0),
    );
    let region = Region { corner: DVec3::new(1e6, -2.0, 5.0), sides };
    for (share, is_in) in [
        (DVec3::ZERO, true),
        (DVec3::ONE, true),
        (DVec3::new(0.3, 0.9, 1.0), true),
        (DVec3::new(-0.01, 0.5, 0.5), false),
        (DVec3::new(0.5, 1.01, 0.5), false),
        (DVec3::new(0.5, 0.5, 7.0), false),
    ] {
        assert_eq!(region.has(region.corner + sides * share), is_in, "{share}");
    }
    let favour = Favour { times: 7.0, range: Some([1.0, 2.0]), region: Some(region) };
    assert_eq!(favour.check(), Ok(()));
    let middle = region.corner + sides * 0.5 * DVec3::ONE;
    assert_eq!([1.0, 2.0, 2.5].map(|value| favour.weight(middle, value)), [7.0, 7.0, 1.0]);
    assert_eq!(favour.weight(DVec3::ZERO, 1.5), 1.0, "beside the region");
    let flat = Region { sides: DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0)), ..region };
    for wrong in [
        Favour { times: 0.5, ..favour },
        Favour { times: f64::NAN, ..favour },
        Favour { times: f64::INFINITY, ..favour },
        Favour { range: Some([2.0, 1.0]), ..favour },
        Favour { range: Some([f64::NAN, 1.0]), ..favour },
        Favour { region: Some(flat), ..favour },
    ] {
        let told = wrong.check().expect_err("it means nothing").to_string();
        assert!(told.starts_with("expected") && !told.contains('\n'), "{told}");
    }
}

#[test]
fn what_single_precision_loses_is_told_by_the_weights_that_cancel() {
    let shape = DMat3::from_diagonal(DVec3::splat(0.5));
    let one = |x: f64, weight| Function { centre: DVec3::new(x, 4.0, 4.0), shape, weight };
    let of = |functions: &[Function]| {
        let bounds = [DVec3::ZERO, DVec3::splat(8.0)];
        Encoding::new(Basis::Gaussian, 0.0, 1e-3, functions.iter().copied(), bounds).rounding()
    };
    assert_eq!(of(&[]), 0.0);
    let alone = of(&[one(4.0, 1.0)]);
    // ε, by what a term is off by and by what it is moved by over four widths.
    let expected = (4.0 + 4.0 * (-0.5_f64).exp()) * f64::from(f32::EPSILON);
    assert!((alone / expected - 1.0).abs() < 1e-12, "{alone} {expected}");
    let pair = [one(4.0, 1e6), one(4.0 + 1e-6, -1e6)];
    assert!((of(&pair) / (2e6 * alone) - 1.0).abs() < 1e-6, "{}", of(&pair));
    // What does not reach the box counts for nothing in it.
    let beyond = of(&[one(4.0, 1.0), one(-20.0, 5.0)]);
    assert_eq!(beyond, alone);
}

#[test]
fn functions_of_another_basis_are_refused() {
    let points = Points::new(lattice(5).map(|at| (at, rough(at))));
    let fit = encoded(&points, Goal { functions: 5, ..GOAL });
    let goal = Goal { basis: Basis::Gaussian, ..GOAL };
    let refused =
        resume(&points, &fit, goal, &Ticket::new(), |_| ControlFlow::Continue(())).expect_err("no");
    let [expected, found] = [Basis::Gaussian, Basis::Ellipsoid];
    assert_eq!(refused, EncodeError::OtherBasis { expected, found });
    let told = refused.to_string();
    assert!(told.contains("basis gaussian") && told.contains("by ellipsoid"), "{told}");
}

#[test]
fn any_number_of_threads_finds_the_same_functions() {
    let value = |at: DVec3| (at.x * 0.5).sin() * (at.y * 0.4).cos() + (at.z * 0.3).sin();
    let points = Points::new(lattice(18).map(|at| (at, value(at))));
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| encoded(&points, Goal { functions: 60, max_error: 1e-9, ..GOAL }))
    };
    let (one, four) = (by(1), by(4));
    assert!(one.functions().len() > 20 && one.functions() == four.functions());
}

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

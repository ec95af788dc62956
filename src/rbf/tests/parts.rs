//! Functions, weights, clusters and the tree, each by itself.

use super::*;

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
fn weights_are_held_themselves_however_often_they_are_solved_for() {
    // As there: two columns that are nearly the same, and what only their difference is.
    let values = |shift: f64| -> Vec<f32> {
        (0..60)
            .map(|i| (-0.5 * ((f64::from(i) - 30.0) / 8.0 - shift).powi(2)).exp() as f32)
            .collect()
    };
    let column = |shift| Column { points: (0..60).collect(), values: values(shift) };
    let columns = [column(0.0), column(1e-3)];
    let difference: Vec<f64> = columns[0]
        .values
        .iter()
        .zip(&columns[1].values)
        .map(|(a, b)| 1e5 * (f64::from(*a) - f64::from(*b)))
        .collect();
    let solved = |ridge: f64| {
        let mut weights = vec![0.0; 2];
        for _ in 0..50 {
            let mut left = difference.clone();
            for (column, weight) in columns.iter().zip(&weights) {
                column.add_to(&mut left, -weight);
            }
            let held = (&weights[..], ridge);
            let changes = held_squares(&columns, &left, &[], 1e-2, held);
            weights.iter_mut().zip(&changes).for_each(|(weight, change)| *weight += change);
        }
        weights.iter().map(|weight| weight.abs()).fold(0.0, f64::max)
    };
    let (held, free) = (solved(1e-2), solved(0.0));
    println!("measured: held {held}, free {free}");
    assert!(held < 0.1 * free, "{held} {free}");
    // The dense solution of the same: rows of λ below, and what is there already on the right.
    let mut next = random();
    let (rows, count, ridge) = (40, 5, 0.7);
    let dense: Vec<Vec<f32>> =
        (0..count).map(|_| (0..rows).map(|_| next() as f32).collect()).collect();
    let columns: Vec<Column> = dense
        .iter()
        .map(|values| Column { points: (0..rows as u32).collect(), values: values.clone() })
        .collect();
    let right: Vec<f64> = (0..rows).map(|_| next() * 4.0).collect();
    let weights: Vec<f64> = (0..count).map(|_| next() * 2.0 - 1.0).collect();
    let roots: Vec<f64> = (0..rows).map(|_| 0.3 + 2.0 * next()).collect();
    let found = held_squares(&columns, &right, &roots, 0.0, (&weights, ridge));
    let length = |i: usize| ridge * columns[i].norm(&roots);
    let matrix =
        DMatrix::from_fn(rows + count, count + 1, |row, column| match row.checked_sub(rows) {
            None if column == count => roots[row],
            None => roots[row] * f64::from(dense[column][row]),
            Some(own) if own == column => length(own),
            Some(_) => 0.0,
        });
    let right = DVector::from_fn(rows + count, |row, _| match row.checked_sub(rows) {
        None => roots[row] * right[row],
        Some(own) => -length(own) * weights[own],
    });
    let expected = matrix.svd(true, true).solve(&right, 1e-12).expect("it has both sides");
    for (found, expected) in found.iter().zip(expected.iter()) {
        assert!((found - expected).abs() < 1e-4, "{found} {expected}");
    }
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
            // Measured: at most 58, 2 ellipsoids, and 5 multiquadrics: 398 where their weights were free.
            assert!(ratio < 150.0, "{name} {basis:?}: {ratio}");
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

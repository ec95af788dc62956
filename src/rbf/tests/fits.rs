//! Fits from nothing: what they reach, what they favour, and what ends them.

use super::*;

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
fn hundreds_of_features_that_are_alike_are_no_reason_to_give_up() {
    // Cubes of two values by turns: each function has one of 64 of them, and few are little.
    let value = |at: DVec3| f64::from((at / 3.0).floor().element_sum() as i32 % 2);
    let points = Points::new(lattice(12).map(|at| (at, value(at))));
    for basis in [Basis::Gaussian, Basis::Ellipsoid] {
        let fit = encoded(&points, Goal { basis, max_error: 1e-9, functions: 90, ..GOAL });
        let (count, errors) = (fit.functions().len(), errors_of(&fit, &points));
        println!("measured {basis:?}: {count} functions, {errors:?}");
        assert!(count > 80 && errors.rms < 0.35, "{basis:?}: {count} {errors:?}");
    }
}

#[test]
fn inverse_multiquadrics_are_fitted_to_what_lies_beyond_their_surroundings() {
    let bump = |at: DVec3, centre: [f64; 3]| {
        (-0.5 * (at - DVec3::from(centre)).length_squared() / 3.0).exp()
    };
    let value =
        |at: DVec3| bump(at, [4.0; 3]) - bump(at, [12.0, 5.0, 9.0]) + bump(at, [8.0, 13.0, 11.0]);
    let points = Points::new(lattice(18).map(|at| (at, value(at))));
    let basis = Basis::Multiquadric;
    let fit = encoded(&points, Goal { basis, max_error: 1e-9, functions: 24, ..GOAL });
    let errors = errors_of(&fit, &points);
    let largest = fit.functions().iter().map(|f| f.weight.abs()).fold(0.0, f64::max);
    println!("measured: {errors:?}, weights of {largest}");
    assert!(errors.rms < 0.03, "{errors:?}, weights of {largest}");
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

/// A cube of samples a step apart, and in one of its corners a cube a twentieth as large, with as many.
fn dense_in_a_corner() -> Vec<DVec3> {
    lattice(8).chain(lattice(8).map(|at| at * 0.05 + DVec3::splat(0.01))).collect()
}

#[test]
fn functions_may_be_as_narrow_as_samples_lie_close_there() {
    let places = dense_in_a_corner();
    let bump = |at: DVec3| (-(at - DVec3::splat(0.19)).length_squared() / 0.005).exp();
    let points = Points::new(places.iter().map(|at| (*at, bump(*at))));
    let own = points.own_spacings();
    let mean = points.spacing();
    for (at, own) in points.positions().iter().zip(&own) {
        // The sample of the large cube at its corner is among those of the small one.
        let is_dense = at.max_element() < 0.4;
        assert!(*own <= mean && (is_dense || *own > 0.5 * mean), "{at}: {own} of {mean}");
        // Those at its border have neighbours on one side alone.
        assert!(!is_dense || (0.04..0.12).contains(own), "{at}: {own}");
    }
    // A width of 0.05, of a mean spacing of 0.7: three functions will do.
    let goal = Goal { functions: 12, max_error: 0.05, ..GOAL };
    let fit = encoded(&points, goal);
    assert!(errors_of(&fit, &points).max <= 0.05, "{}", errors_of(&fit, &points));
    let even = Points::new(lattice(12).map(|at| (at, bump(at))));
    assert!(even.own_spacings().is_empty());
}

#[test]
fn functions_whose_values_have_no_room_end_a_fit_as_it_grows() {
    let points = Points::new(lattice(10).map(|at| (at, rough(at))));
    let start = encoded(&points, Goal { functions: 6, ..GOAL });
    let goal = Goal { functions: 200, max_error: 1e-6, ..GOAL };
    let within = |free_bytes| {
        let told = |_| ControlFlow::Continue(());
        resume_within(&points, (&start, goal), free_bytes, &Ticket::new(), told)
    };
    let Err(EncodeError::TooLarge(at_first)) = within(0) else { panic!("no room at all") };
    // Just enough for those that there are.
    let Err(EncodeError::TooLarge(later)) = within(at_first.needed_bytes) else {
        panic!("room for no more")
    };
    assert!(later.needed_bytes > at_first.needed_bytes);
}

#[test]
fn as_many_functions_as_points_go_through_them() {
    let mut next = random();
    for count in [2, 3, 4, 9] {
        let place = |next: &mut dyn FnMut() -> f64| DVec3::new(next(), next(), next()) * 10.0;
        let samples: Vec<(DVec3, f64)> =
            (0..count).map(|_| (place(&mut next), 100.0 * next())).collect();
        let points = Points::new(samples);
        let goal = Goal { functions: count, max_error: 0.1, ..GOAL };
        let fit = encoded(&points, goal);
        assert!(errors_of(&fit, &points).max <= 0.1, "{count}: {}", errors_of(&fit, &points));
    }
}

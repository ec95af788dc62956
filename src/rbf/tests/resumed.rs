//! Fits that go on from earlier ones.

use super::*;

fn resumed(points: &Points, start: &Encoding, goal: Goal) -> Encoding {
    let told = |_| ControlFlow::Continue(());
    resume(points, start, goal, &Ticket::new(), told).expect("it is of the same basis")
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

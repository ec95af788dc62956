//! Fields encoded as functions, and what is told of these.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;

use super::*;
use crate::io::vrbf::Precision;
use crate::rbf::{Function, reweighted};
use crate::volume::{Association, demo};

const FEW: Asked = Asked {
    basis: Basis::Ellipsoid,
    max_error: Some(Wanted::Percent(0.01)),
    mean_error: None,
    bytes: None,
    functions: 12,
    favour: None,
};

/// Waves at the points of a lattice.
fn grid(side: usize) -> Grid {
    let lattice = Lattice::unit([side; 3]);
    let value =
        |(at, _): (DVec3, _)| ((at.x * 0.5).sin() * (at.y * 0.4).cos() + (at.z * 0.3).sin()) as f32;
    let places = Places::Lattice(lattice);
    let samples = (0..side.pow(3)).map(|i| value(places.at(i))).collect();
    let field = Field {
        name: "waves".to_owned(),
        components: 1,
        association: Association::Point,
        samples: Arc::new(Samples::Float32(samples)),
    };
    Grid::of(lattice, vec![field])
}

fn fitted(grid: &Grid, asked: Asked, earlier: Option<&Encoded>) -> Result<Encoded, FieldError> {
    let what = (grid, &grid.fields[0], Component::Index(0));
    let told = |_| ControlFlow::Continue(());
    encode_field(what, "a.nrrd", asked, earlier, &Ticket::new(), told)
}

#[test]
fn a_fit_goes_on_to_another_goal_and_is_never_further_off() {
    let grid = grid(12);
    let few = fitted(&grid, FEW, None).expect("samples");
    // As a file that was called otherwise.
    let renamed = Source { name: "b.nrrd".to_owned(), ..few.source.clone() };
    let few = Encoded { source: renamed, ..few };
    let more =
        fitted(&grid, Asked { functions: 48, ..FEW }, Some(&few)).expect("of the same field");
    assert!(more.errors.max <= few.errors.max && more.errors.rms < few.errors.rms);
    assert!(more.encoding.functions().len() > few.encoding.functions().len());
    assert_eq!(more.source.name, "a.nrrd", "as it is called now");
    // What is told is of the numbers that a file holds.
    let read = written(&more);
    assert_eq!(read.encoding.functions(), more.encoding.functions());
    let again = read.encoding.errors(&points_of(&grid), &Ticket::new());
    assert_eq!(again.expect("nobody stops it"), more.errors);
}

fn points_of(grid: &Grid) -> Points {
    let places = Places::Lattice(grid.lattice);
    let samples = &grid.fields[0].samples;
    Points::new((0..samples.len()).map(|i| (places.at(i).0, samples.get(i))))
}

/// As it comes back from a file.
fn written(encoded: &Encoded) -> Encoded {
    let folder = tempfile::tempdir().expect("there is room");
    let path = folder.path().join("fit.vrbf");
    std::fs::write(&path, vrbf::bytes(encoded).expect("finite")).expect("there is room");
    vrbf::load(&path).expect("it was written just now")
}

#[test]
fn each_goal_is_reached_for_its_own_reason_and_told_by_the_file() {
    let grid = grid(12);
    let none = Asked { max_error: None, functions: 400, ..FEW };
    let greatest = Asked { max_error: Some(Wanted::Percent(5.0)), ..none };
    let mean = Asked { mean_error: Some(Wanted::Units(0.02)), ..none };
    let bytes = Asked { bytes: Some(1600), ..none };
    for asked in [greatest, mean, bytes, Asked { bytes: Some(1600), ..mean }] {
        let fit = fitted(&grid, asked, None).expect("samples");
        let count = fit.encoding.functions().len();
        let len = vrbf::bytes(&fit).expect("finite").len() as u64;
        let told = format!("{asked:?}: {count} functions, {len} bytes, {}", fit.errors);
        assert!(count > 1 && count < 400, "{told}");
        assert!(asked.bytes.is_none_or(|most| len <= most), "{told}");
        let is_reached = fit.is_as_near_as_asked_for();
        assert!(is_reached || asked.bytes.is_some(), "{told}");
        let read = written(&fit);
        assert_eq!(read.source, fit.source);
        assert_eq!(read.source.wanted.is_some(), asked.max_error.is_some());
        assert_eq!(
            (read.source.wanted_mean, read.source.wanted_bytes),
            match asked {
                Asked { mean_error: Some(_), bytes, .. } => (Some(0.02), bytes),
                Asked { bytes, .. } => (None, bytes),
            }
        );
    }
    // The bytes are used, but for what functions more would take.
    for most in [1200_u64, 1600, 6000] {
        let fit = fitted(&grid, Asked { bytes: Some(most), ..none }, None).expect("samples");
        let len = vrbf::bytes(&fit).expect("finite").len() as u64;
        let count = fit.encoding.functions().len();
        assert!(len <= most && len + most / 50 + 60 > most, "{len} of {most}, {count}");
        assert!(count >= vrbf::most_functions(most, Basis::Ellipsoid, &fit.source), "{count}");
    }
}

#[test]
fn bytes_that_hold_just_one_function_are_not_refused() {
    let grid = grid(9);
    let bytes = |bytes| Asked { bytes: Some(bytes), max_error: None, ..FEW };
    let refused = fitted(&grid, bytes(100), None).expect_err("there is no room");
    let FieldError::TooFewBytes { least, functions: 1, .. } = refused else { panic!("{refused}") };
    let fit =
        fitted(&grid, bytes(least + 8), None).expect("as many as it said, and for other digits");
    assert!(vrbf::bytes(&fit).expect("finite").len() as u64 <= least + 8);
    assert!(least + 8 < vrbf::most_bytes(1, Basis::Ellipsoid, &fit.source), "{least}");
}

#[test]
fn bytes_that_hold_no_function_or_not_those_of_an_earlier_fit_are_refused() {
    let grid = grid(9);
    let bytes = |bytes| Asked { bytes: Some(bytes), max_error: None, ..FEW };
    let refused = |asked: Asked, earlier: Option<&Encoded>| {
        let refused = fitted(&grid, asked, earlier).expect_err("there is no room");
        assert!(matches!(refused, FieldError::TooFewBytes { .. }), "{refused}");
        refused.to_string()
    };
    let told = refused(bytes(100), None);
    assert!(told.contains("found 100;") && told.contains("(1)"), "{told}");
    let fit = fitted(&grid, FEW, None).expect("samples");
    let len = vrbf::bytes(&fit).expect("finite").len() as u64;
    refused(bytes(len - 60), Some(&fit));
}

#[test]
fn favoured_samples_have_errors_of_their_own_which_the_file_tells_and_a_fit_goes_on_with() {
    let grid = grid(12);
    let points = points_of(&grid);
    let favour = Favour { times: 5.0, range: Some([-0.5, 0.5]), region: None };
    let asked = Asked { favour: Some(favour), functions: 30, ..FEW };
    let fit = fitted(&grid, asked, None).expect("samples");
    let left = fit.encoding.differences(&points, &Ticket::new()).expect("nobody stops it");
    let samples = points.positions().iter().zip(points.values()).zip(&left);
    let own = samples.filter(|((at, value), _)| favour.has(**at, **value));
    let own = Errors::of(&own.map(|(_, left)| *left).collect::<Vec<_>>());
    assert_eq!((fit.errors, fit.favoured), (Errors::of(&left), Some(own)));
    let read = written(&fit);
    assert_eq!((read.favoured, read.source.favour), (fit.favoured, Some(favour)));
    let even = fitted(&grid, Asked { favour: None, ..asked }, None).expect("samples");
    assert_eq!((even.favoured, even.source.favour), (None, None));

    let more = Asked { functions: 60, favour: read.source.favour, ..asked };
    let more = fitted(&grid, more, Some(&read)).expect("of the same field");
    assert!(more.errors.max <= fit.errors.max);
    assert!(more.favoured.map(|e| e.rms) < fit.favoured.map(|e| e.rms));

    let none = Favour { range: Some([7.0, 8.0]), ..favour };
    let refused = fitted(&grid, Asked { favour: Some(none), ..asked }, None);
    let told = refused.expect_err("there are no such values").to_string();
    assert!(told.contains("expected samples to favour"), "{told}");
    let wrong = Favour { times: 0.0, ..favour };
    let refused = fitted(&grid, Asked { favour: Some(wrong), ..asked }, None);
    assert!(matches!(refused, Err(FieldError::Favour(_))));
}

#[test]
fn the_fewest_digits_that_bring_no_error_are_written() {
    let grid = grid(12);
    for basis in Basis::ALL {
        let fit = fitted(&grid, Asked { basis, functions: 40, ..FEW }, None).expect("samples");
        let precise = |p: &Precision| {
            vrbf::rounded(&fit.encoding, *p).functions() == fit.encoding.functions()
        };
        let precision = Precision::ALL.into_iter().find(precise);
        assert!(precision.is_some_and(|p| p != Precision::Single), "{basis:?} {precision:?}");
        let floats = vrbf::rounded(&fit.encoding, Precision::Single);
        // Of floats that are no whole numbers of few bytes.
        let floats = reweighted(&points_of(&grid), &floats).expect("samples");
        let floats = Encoded { encoding: floats, ..fit.clone() };
        let [short, long] = [&fit, &floats].map(|e| vrbf::bytes(e).expect("finite").len());
        assert!(short < long, "{basis:?}: {short} {long}");
    }
}

/// Sums of functions at the points of a lattice, which their fit therefore is without error.
fn exact(functions: &[Function]) -> (Grid, Encoded) {
    let lattice = Lattice::unit([6; 3]);
    let places = Places::Lattice(lattice);
    let bounds = [DVec3::ZERO, DVec3::splat(5.0)];
    let functions = functions.iter().copied();
    let encoding = Encoding::new(Basis::Gaussian, 1.0, 1e-9, functions, bounds);
    let samples = (0..216).map(|i| encoding.value(places.at(i).0)).collect();
    let field = Field {
        name: "sum".to_owned(),
        components: 1,
        association: Association::Point,
        samples: Arc::new(Samples::Float64(samples)),
    };
    let source = Source {
        name: "sum.nrrd".to_owned(),
        field: "sum".to_owned(),
        samples: 216,
        left_out: 0,
        wanted: Some(1e-6),
        wanted_mean: None,
        wanted_bytes: None,
        favour: None,
        lattice,
        fills_box: true,
        range: None,
        cover: None,
        space: None,
        unit: None,
    };
    (
        Grid::of(lattice, vec![field]),
        Encoded {
            encoding,
            errors: Errors::default(),
            source,
            favoured: None,
            overshoot: 0.0,
            between: None,
            ended: None,
        },
    )
}

#[test]
fn what_a_sum_does_between_samples_is_told() {
    let narrow = |x: f64, weight: f64| Function {
        centre: DVec3::new(x, 2.5, 2.5),
        shape: glam::DMat3::from_diagonal(DVec3::splat(2.0)),
        weight,
    };
    let asked = Asked { basis: Basis::Gaussian, max_error: Some(Wanted::Units(1e-6)), ..FEW };
    let again = |functions: &[Function]| {
        let (grid, fit) = exact(functions);
        fitted(&grid, asked, Some(&fit)).expect("of the same field")
    };
    // Widths of half a step, in the middle of a cell: e^−1.5 is left of each at the nearest samples.
    let left = (-1.5_f64).exp();
    for (weight, sign) in [(8.0, 1.0), (-8.0, -1.0)] {
        let told = again(&[narrow(2.5, weight)]);
        assert!(told.errors.max < 1e-12, "{:?}", told.errors);
        let expected = sign * weight * (1.0 - left);
        assert!((told.overshoot - expected).abs() < 1e-9, "{} {expected}", told.overshoot);
        let said = told.told_beyond_samples();
        assert!(said.len() == 1 && said[0].contains("between samples"), "{said:?}");
    }
    // On a sample it is nowhere greater than there.
    let on_a_sample = Function { centre: DVec3::splat(3.0), ..narrow(3.0, 8.0) };
    let told = again(&[on_a_sample]);
    assert_eq!(told.overshoot, 0.0);
    assert!(told.told_beyond_samples().is_empty(), "{:?}", told.told_beyond_samples());
}

#[test]
fn who_is_not_all_over_a_box_is_told_that_the_sum_is() {
    let wide = Function {
        centre: DVec3::splat(2.0),
        shape: glam::DMat3::from_diagonal(DVec3::splat(0.5)),
        weight: 3.0,
    };
    let bent = |i: usize| {
        let at = Places::Lattice(Lattice::unit([6; 3])).at(i).0;
        DVec3::new(at.x, at.y + 0.04 * at.x * (5.0 - at.x), at.z)
    };
    let (mut grid, _) = exact(&[wide]);
    let asked = Asked { max_error: Some(Wanted::Percent(20.0)), functions: 20, ..FEW };
    let plain = fitted(&grid, asked, None).expect("samples");
    assert!(plain.source.fills_box);
    grid.shape = Shape::Curvilinear((0..216).map(bent).collect());
    let bent = fitted(&grid, asked, None).expect("samples");
    assert!(bent.source.cover.is_some() && !bent.told_beyond_samples().concat().contains("box"));
    // Of files that do not tell where.
    let bent = Encoded { source: Source { cover: None, ..bent.source.clone() }, ..bent };
    let said = bent.told_beyond_samples();
    assert!(!bent.source.fills_box && said[0].contains("in the whole box"), "{said:?}");
}

#[test]
fn a_goal_that_is_reached_already_leaves_the_functions_as_they_are() {
    let grid = grid(10);
    let asked = Asked { max_error: Some(Wanted::Percent(5.0)), functions: 400, ..FEW };
    let fit = fitted(&grid, asked, None).expect("samples");
    let asked = Asked { max_error: Some(Wanted::Units(fit.errors.max)), ..FEW };
    let again = fitted(&grid, asked, Some(&fit)).expect("of the same field");
    assert_eq!(again.encoding.functions(), fit.encoding.functions());
    assert_eq!((again.errors, again.source.wanted), (fit.errors, Some(fit.errors.max)));
}

#[test]
fn fits_of_anything_else_are_refused_in_a_sentence() {
    let own = grid(12);
    let asked = Asked { max_error: Some(Wanted::Percent(5.0)), ..FEW };
    let fit = fitted(&own, asked, None).expect("samples");
    let refused = |grid: &Grid, earlier: &Encoded, asked: Asked| {
        let refused = fitted(grid, asked, Some(earlier));
        let told = refused.err().map(|error| error.to_string()).unwrap_or_default();
        assert!(told.starts_with("expected") && !told.contains('\n'), "{told}");
        told
    };
    let told = refused(&grid(9), &fit, asked);
    assert!(told.contains("expected an earlier fit of 729 samples of "), "{told}");
    assert!(told.contains("found one of 1728 samples of "), "{told}");
    // As many samples, a step beside.
    let moved = Lattice { origin: DVec3::X, ..own.lattice };
    let told = refused(&Grid::of(moved, own.fields.clone()), &fit, asked);
    assert!(told.contains("expected an earlier fit of 1728 samples of "), "{told}");
    // As many values in the same box.
    let mut other = own.clone();
    let samples = &own.fields[0].samples;
    let turned = (0..samples.len()).rev().map(|i| samples.get(i) as f32 * 2.0).collect();
    other.fields[0].samples = Arc::new(Samples::Float32(turned));
    let told = refused(&other, &fit, asked);
    assert!(told.contains("that the earlier fit tells of itself"), "{told}");
    // As near at the worst of them, but not at all.
    let errors = Errors { rms: 2.0 * fit.errors.rms, ..fit.errors };
    let other = Encoded { errors, ..fit.clone() };
    let told = refused(&own, &other, asked);
    assert!(told.contains("that the earlier fit tells of itself"), "{told}");
    let told = refused(&own, &fit, Asked { basis: Basis::Gaussian, ..asked });
    assert!(told.contains("basis gaussian"), "{told}");
}

/// A ring of tetrahedra and other cells, by as few functions as go on to anything outside of it.
fn ring() -> (Grid, Encoded) {
    let grid = demo::open("mesh", Some(6)).expect("a demo");
    let asked = Asked { max_error: Some(Wanted::Percent(1.0)), functions: 60, ..FEW };
    let fit = fitted(&grid, asked, None).expect("samples");
    (grid, fit)
}

#[test]
fn what_is_told_of_where_a_mesh_lies_is_what_its_cells_say() {
    let (grid, fit) = ring();
    let cover = fit.source.cover.as_ref().expect("it does not fill its box");
    let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).expect("values");
    let samples = &volume.samples;
    let [nx, ny, _] = volume.lattice.dims;
    let (mut inside, mut outside, mut missed) = (0, 0, 0);
    for i in 0..samples.len() {
        let at = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64);
        let has = fit.source.has(volume.lattice.world_from_index(at.into()));
        match samples.get(i).is_finite() {
            true => {
                inside += 1;
                // The next sample of its own lattice may lie just outside.
                missed += usize::from(!has);
            }
            false => outside += usize::from(!has),
        }
    }
    assert!(inside > 1000 && missed * 20 < inside, "{missed} of {inside}");
    assert!(outside * 2 > samples.len() - inside, "{outside}");
    assert!(cover.edge() <= 4, "{}", cover.edge());
    let statistics = &volume.statistics;
    assert_eq!(fit.source.range, Some([statistics.min, statistics.max]));
}

#[test]
fn what_lies_between_the_points_of_a_mesh_has_errors_of_its_own_which_the_file_tells() {
    let even = fitted(&grid(6), FEW, None).expect("samples");
    assert_eq!(even.between, None, "nothing is known between samples of a grid");
    let (mesh, fit) = ring();
    let told = fit.between.expect("straight lines lie between them");
    let samples = &mesh.fields[0].samples;
    let middles = mesh.middles(Association::Point, samples, MOST_MIDDLES, &Ticket::new());
    let known = middles.expect("nobody stops it").into_iter().filter(|(_, v)| v.is_finite());
    let off: Vec<f64> = known.map(|(at, value)| value - fit.encoding.value(at)).collect();
    let own = Errors::of(&off);
    assert!((told.max / own.max - 1.0).abs() < 1e-3, "{told:?} {own:?}");
    assert!((told.mean / own.mean - 1.0).abs() < 1e-3 && own.mean > 0.0, "{told:?} {own:?}");
    assert_eq!(written(&fit).between, Some(told));
    assert_eq!(fit.facts().between_max_error, Some(told.max));
}

#[test]
fn no_place_in_a_mesh_is_further_beyond_its_range_than_is_told() {
    let (grid, fit) = ring();
    let [low, high] = fit.source.range.expect("known");
    let cells = grid.cells().expect("room").expect("cells");
    let mut beyond = 0.0_f64;
    for solid in cells.solids() {
        let corners: Vec<DVec3> =
            solid.corners().iter().map(|corner| cells.points()[*corner as usize]).collect();
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        // Among all pairs, and on the way to the middle, at thirds.
        for (a, b) in corners.iter().flat_map(|a| corners.iter().map(move |b| (a, b))) {
            for at in [a.lerp(*b, 1.0 / 3.0), a.lerp(*b, 1.0 / 3.0).lerp(middle, 0.4)] {
                let value = fit.encoding.value(at);
                beyond = beyond.max(value - high).max(low - value);
            }
        }
    }
    // Between the places that were asked is more, but not much.
    assert!(beyond <= 1.3 * fit.overshoot + 0.01 * (high - low), "{beyond} {}", fit.overshoot);
}

#[test]
fn a_mesh_is_as_near_at_its_points_as_was_asked_for_though_it_is_fitted_between_them_too() {
    let grid = demo::open("mesh", Some(6)).expect("a demo");
    for percent in [4.0, 2.0] {
        let wanted = Some(Wanted::Percent(percent));
        let asked = Asked { max_error: None, mean_error: wanted, functions: 400, ..FEW };
        let fit = fitted(&grid, asked, None).expect("samples");
        let [low, high] = fit.source.range.expect("known");
        let most = percent / 100.0 * (high - low);
        assert!(fit.errors.mean <= most, "{percent} %: {} of {most}", fit.errors.mean);
        assert!(fit.encoding.functions().len() < 400, "{percent} %");
    }
}

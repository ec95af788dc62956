//! Fields encoded as basis functions.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;

use crate::core::memory::{self, TooLarge};
use crate::core::{Cancelled, Ticket};
use crate::io::{Encoded, Source, vrbf};
use crate::rbf::{EncodeError, Encoding, Errors, Goal, Points, Step, encode, four_digits, resume};
use crate::volume::{Component, Field, Grid, Samples, Shape, VolumeError};

/// Bytes that fitting takes for each sample: its place (of uneven grids with the steps about it), its value and residual, and
/// its entries in the columns of some fifty functions that reach it.
const BYTES_A_SAMPLE: u64 = 56 + 96 + 50 * 8;

/// The fit aims at this share of the error asked for, since rounding to 32 bits adds some.
const BEFORE_ROUNDING: f64 = 0.999;

/// The errors that a file tells of its functions, and those found again, are the same up to this part of them: another build
/// may sum up in another order.
const SAME_ERROR: f64 = 0.01;
/// Where they are but rounding: this part of the samples' range.
const ROUNDING: f64 = 1e-9;
/// The same of the boxes' corners, as a part of their diagonal.
const SAME_PLACE: f64 = 1e-6;

/// Middles between samples that are looked at for what goes beyond these, at most.
const MOST_MIDDLES: usize = 1 << 20;

/// Why there is no encoding of a field.
#[derive(Debug, thiserror::Error)]
pub enum FieldError {
    /// No such number of the field.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// More samples than memory has room for.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// No functions could be fitted.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The earlier fit was one of other samples.
    #[error(
        "expected an earlier fit of {expected}, found one of {found}; go on from a fit of this field, or encode it anew"
    )]
    OtherSamples {
        /// What is to be encoded, for people.
        expected: String,
        /// What the earlier fit was made of.
        found: String,
    },
    /// The earlier fit was one of as many samples in the same box, with other values.
    #[error(
        "expected at these samples the errors that the earlier fit tells of itself ({told}), found others ({found}): it was \
         made of {whose}; go on from a fit of this field, or encode it anew"
    )]
    OtherValues {
        /// At the samples that it was made of.
        told: Errors,
        /// At these.
        found: Errors,
        /// What the earlier fit was made of, for people.
        whose: String,
    },
    /// It was told to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// How near functions are to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    /// In the samples' units.
    Units(f64),
    /// Of their range, %.
    Percent(f64),
}

/// Encodes a field, and measures the errors of the functions as a file holds them. Each round is `told`, which may break it off. The goal was reached
/// if [`Encoded::errors`] are within [`Source::wanted`].
///
/// An `earlier` fit of the same field is gone on from ([`resume`]): the greatest error is never above its own. Its functions
/// come back as they are where they reach the goal already, and where nothing nearer is found. Whether it is one of this field
/// is told by how many samples there are, by their box, and by its errors, which have to be found again. Names may have
/// changed.
///
/// # Errors
/// See [`FieldError`].
pub fn encode_field(
    (grid, field, component): (&Grid, &Field, Component),
    name: &str,
    (wanted, goal): (Wanted, Goal),
    earlier: Option<&Encoded>,
    ticket: &Ticket,
    told: impl FnMut(Step) -> ControlFlow<()>,
) -> Result<Encoded, FieldError> {
    let lattice = grid.lattice_of_functions(field);
    let count = field.samples.len() / field.components;
    let needed = (count as u64).saturating_mul(BYTES_A_SAMPLE);
    memory::require("fitting functions to the samples", needed, memory::free_bytes())?;
    let samples = grid.samples_of(field, component, ticket)?;
    let places = grid.places(field.association);
    let points = Points::new((0..samples.len()).map(|i| (places.at(i).0, samples.get(i))));
    let [low, high] = points
        .values()
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]);
    let max_error = match wanted {
        Wanted::Units(error) => error,
        Wanted::Percent(percent) => (high - low).max(0.0) * percent / 100.0,
    };
    let source = Source {
        name: name.to_owned(),
        field: field.name.clone(),
        samples: points.len(),
        left_out: points.left_out(),
        wanted: max_error,
        lattice,
        fills_box: matches!(grid.shape, Shape::Affine | Shape::Rectilinear(_)),
        space: grid.space.clone(),
        unit: grid.unit.clone(),
    };
    let goal = Goal { max_error: max_error * BEFORE_ROUNDING, ..goal };
    let measured = |encoding: &Encoding| encoding.errors(&points, ticket);
    let (encoding, errors) = match earlier {
        None => {
            let encoding = vrbf::rounded(&encode(&points, goal, ticket, told)?);
            let errors = measured(&encoding)?;
            (encoding, errors)
        }
        Some(earlier) => {
            check_place(earlier, &source, points.bounds())?;
            let before = measured(&earlier.encoding)?;
            check_errors(earlier, before, high - low)?;
            if earlier.encoding.basis() == goal.basis && before.max <= max_error {
                (earlier.encoding.clone(), before)
            } else {
                let found = resume(&points, &earlier.encoding, goal, ticket, told)?;
                let found = vrbf::rounded(&found);
                let errors = measured(&found)?;
                // Rounding may take back what little was gained.
                let is_worse = errors.max > before.max;
                if is_worse { (earlier.encoding.clone(), before) } else { (found, errors) }
            }
        }
    };
    let middles = grid.middles(field.association, &samples, MOST_MIDDLES, ticket)?;
    let between = encoding.values(&middles, ticket)?;
    let beyond = between.iter().map(|value| (value - high).max(low - value));
    let overshoot = beyond.fold(0.0, f64::max);
    Ok(Encoded { encoding, errors, source, overshoot })
}

/// Whether an earlier fit was made of as many samples, in the same box.
fn check_place(earlier: &Encoded, source: &Source, bounds: [DVec3; 2]) -> Result<(), FieldError> {
    let own = earlier.encoding.bounds();
    let far = SAME_PLACE * (bounds[1] - bounds[0]).length();
    let is_there = own.iter().zip(&bounds).all(|(a, b)| a.distance(*b) <= far);
    let counts = |source: &Source| (source.samples, source.left_out);
    if is_there && counts(&earlier.source) == counts(source) {
        return Ok(());
    }
    Err(FieldError::OtherSamples {
        expected: format!("{} {}", described(source), between(bounds)),
        found: format!("{} {}", described(&earlier.source), between(own)),
    })
}

/// Whether an earlier fit is as far from the samples as it was from those that it was made of. `range` is that of the values.
fn check_errors(earlier: &Encoded, found: Errors, range: f64) -> Result<(), FieldError> {
    let told = earlier.errors;
    let is_same =
        |a: f64, b: f64| (a - b).abs() <= SAME_ERROR * a.max(b) + ROUNDING * range.max(0.0);
    if is_same(told.max, found.max) && is_same(told.rms, found.rms) {
        return Ok(());
    }
    Err(FieldError::OtherValues { told, found, whose: described(&earlier.source) })
}

/// `8000 samples of density in scan.nrrd`.
fn described(source: &Source) -> String {
    let left_out = match source.left_out {
        0 => String::new(),
        count => format!(" and {count} that are not finite"),
    };
    format!("{} samples{left_out} of {} in {}", source.samples, source.field, source.name)
}

/// `between (0, 0, 0) and (19, 19, 19)`, the corners of a box.
fn between([low, high]: [DVec3; 2]) -> String {
    let corner = |at: DVec3| at.to_array().map(|v| four_digits(v).to_string()).join(", ");
    format!("between ({}) and ({})", corner(low), corner(high))
}

/// What functions leave of the samples that they were fitted to: these less their sum, as a field of the same grid.
///
/// # Errors
/// See [`FieldError`].
pub fn residual(
    (grid, field, component): (&Grid, &Field, Component),
    encoding: &Encoding,
    ticket: &Ticket,
) -> Result<Field, FieldError> {
    let samples = grid.samples_of(field, component, ticket)?;
    let needed = (samples.len() as u64).saturating_mul(size_of::<f32>() as u64 + 32);
    memory::require("what functions leave of the samples", needed, memory::free_bytes())?;
    let places = grid.places(field.association);
    let positions: Vec<_> = (0..samples.len()).map(|i| places.at(i).0).collect();
    let sums = encoding.values(&positions, ticket)?;
    #[expect(clippy::cast_possible_truncation, reason = "differences need no more digits")]
    let left = sums.iter().enumerate().map(|(i, sum)| (samples.get(i) - sum) as f32);
    Ok(Field {
        name: format!("{} less its functions", field.name),
        components: 1,
        association: field.association,
        samples: Arc::new(Samples::Float32(left.collect())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rbf::{Basis, Function};
    use crate::volume::{Association, Lattice, Places};

    const GOAL: Goal = Goal { basis: Basis::Ellipsoid, max_error: 0.0, functions: 12 };

    /// Waves at the points of a lattice.
    fn grid(side: usize) -> Grid {
        let lattice = Lattice::unit([side; 3]);
        let value = |(at, _): (DVec3, _)| {
            ((at.x * 0.5).sin() * (at.y * 0.4).cos() + (at.z * 0.3).sin()) as f32
        };
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

    fn fitted(
        grid: &Grid,
        (wanted, goal): (Wanted, Goal),
        earlier: Option<&Encoded>,
    ) -> Result<Encoded, FieldError> {
        let what = (grid, &grid.fields[0], Component::Index(0));
        let told = |_| ControlFlow::Continue(());
        encode_field(what, "a.nrrd", (wanted, goal), earlier, &Ticket::new(), told)
    }

    #[test]
    fn a_fit_goes_on_to_another_goal_and_is_never_further_off() {
        let grid = grid(12);
        let wanted = Wanted::Percent(0.01);
        let few = fitted(&grid, (wanted, GOAL), None).expect("samples");
        // As a file that was called otherwise.
        let renamed = Source { name: "b.nrrd".to_owned(), ..few.source.clone() };
        let few = Encoded { source: renamed, ..few };
        let goal = Goal { functions: 48, ..GOAL };
        let more = fitted(&grid, (wanted, goal), Some(&few)).expect("of the same field");
        assert!(more.errors.max <= few.errors.max && more.errors.rms < few.errors.rms);
        assert!(more.encoding.functions().len() > few.encoding.functions().len());
        assert_eq!(more.source.name, "a.nrrd", "as it is called now");
        // What is told is of 32-bit numbers, which is what a file holds.
        let places = Places::Lattice(grid.lattice);
        let samples = &grid.fields[0].samples;
        let points = Points::new((0..samples.len()).map(|i| (places.at(i).0, samples.get(i))));
        let again = vrbf::rounded(&more.encoding).errors(&points, &Ticket::new());
        assert_eq!(again.expect("nobody stops it"), more.errors);
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
            wanted: 1e-6,
            lattice,
            fills_box: true,
            space: None,
            unit: None,
        };
        (
            Grid::of(lattice, vec![field]),
            Encoded { encoding, errors: Errors::default(), source, overshoot: 0.0 },
        )
    }

    #[test]
    fn what_a_sum_does_between_samples_is_told() {
        let narrow = |x: f64, weight: f64| Function {
            centre: DVec3::new(x, 2.5, 2.5),
            shape: glam::DMat3::from_diagonal(DVec3::splat(2.0)),
            weight,
        };
        let goal = Goal { basis: Basis::Gaussian, ..GOAL };
        let again = |functions: &[Function]| {
            let (grid, fit) = exact(functions);
            fitted(&grid, (Wanted::Units(1e-6), goal), Some(&fit)).expect("of the same field")
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
        let goal = (Wanted::Percent(20.0), Goal { functions: 20, ..GOAL });
        let plain = fitted(&grid, goal, None).expect("samples");
        assert!(plain.source.fills_box);
        grid.shape = Shape::Curvilinear((0..216).map(bent).collect());
        let bent = fitted(&grid, goal, None).expect("samples");
        let said = bent.told_beyond_samples();
        assert!(!bent.source.fills_box && said[0].contains("in the whole box"), "{said:?}");
    }

    #[test]
    fn a_goal_that_is_reached_already_leaves_the_functions_as_they_are() {
        let grid = grid(10);
        let fit = fitted(&grid, (Wanted::Percent(5.0), Goal { functions: 400, ..GOAL }), None);
        let fit = fit.expect("samples");
        let wanted = Wanted::Units(fit.errors.max);
        let again = fitted(&grid, (wanted, GOAL), Some(&fit)).expect("of the same field");
        assert_eq!(again.encoding.functions(), fit.encoding.functions());
        assert_eq!((again.errors, again.source.wanted), (fit.errors, fit.errors.max));
    }

    #[test]
    fn fits_of_anything_else_are_refused_in_a_sentence() {
        let own = grid(12);
        let wanted = Wanted::Percent(5.0);
        let fit = fitted(&own, (wanted, GOAL), None).expect("samples");
        let refused = |grid: &Grid, earlier: &Encoded, goal: Goal| {
            let refused = fitted(grid, (wanted, goal), Some(earlier));
            let told = refused.err().map(|error| error.to_string()).unwrap_or_default();
            assert!(told.starts_with("expected") && !told.contains('\n'), "{told}");
            told
        };
        let told = refused(&grid(9), &fit, GOAL);
        assert!(told.contains("expected an earlier fit of 729 samples of "), "{told}");
        assert!(told.contains("found one of 1728 samples of "), "{told}");
        // As many samples, a step beside.
        let moved = Lattice { origin: DVec3::X, ..own.lattice };
        let told = refused(&Grid::of(moved, own.fields.clone()), &fit, GOAL);
        assert!(told.contains("expected an earlier fit of 1728 samples of "), "{told}");
        // As many values in the same box.
        let mut other = own.clone();
        let samples = &own.fields[0].samples;
        let turned = (0..samples.len()).rev().map(|i| samples.get(i) as f32 * 2.0).collect();
        other.fields[0].samples = Arc::new(Samples::Float32(turned));
        let told = refused(&other, &fit, GOAL);
        assert!(told.contains("that the earlier fit tells of itself"), "{told}");
        // As near at the worst of them, but not at all.
        let errors = Errors { rms: 2.0 * fit.errors.rms, ..fit.errors };
        let other = Encoded { errors, ..fit.clone() };
        let told = refused(&own, &other, GOAL);
        assert!(told.contains("that the earlier fit tells of itself"), "{told}");
        let told = refused(&own, &fit, Goal { basis: Basis::Gaussian, ..GOAL });
        assert!(told.contains("basis gaussian"), "{told}");
    }
}

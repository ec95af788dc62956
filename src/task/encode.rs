//! Fields encoded as basis functions.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;

use crate::core::memory::{self, TooLarge};
use crate::core::{Cancelled, Ticket};
use crate::io::vrbf::{self, Precision};
use crate::io::{Encoded, Source};
use crate::rbf::{
    Basis, EncodeError, Encoding, Errors, Favour, FavourError, Goal, Points, Step, encode,
    four_digits, resume, reweighted,
};
use crate::volume::{Component, Field, Grid, Samples, Shape, VolumeError};

/// Bytes that fitting takes for each sample: its place (of uneven grids with the steps about it), its value, residual and weight,
/// and its entries in the columns of some fifty functions that reach it.
const BYTES_A_SAMPLE: u64 = 56 + 96 + 32 + 50 * 8;

/// The fit aims at this share of the errors asked for: two bytes a number add that much, and shorter numbers are worth more than
/// the few functions that it takes.
const BEFORE_ROUNDING: f64 = 0.98;
/// Where no error is asked for, the fit aims at this part of the samples' range, %: few functions come that near, and more
/// digits would only make each reach further.
const FINEST_PERCENT: f64 = 0.01;
/// Where the goal is not reached, rounding may make errors so many times as large.
const MOST_BY_ROUNDING: f64 = 1.01;

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
    /// Samples cannot be favoured so.
    #[error(transparent)]
    Favour(#[from] FavourError),
    /// No sample is one of those that are to be favoured.
    #[error(
        "expected samples to favour, found none of such values and places; the finite values of this field are {} to {}",
        .0[0],
        .0[1]
    )]
    NothingFavoured([f64; 2]),
    /// A file of so many bytes has no room.
    #[error(
        "expected {least} bytes or more, which a file of as many basis functions as it must have ({functions}) may take, found {found}; \
         allow more"
    )]
    TooFewBytes {
        /// Bytes that the file may take.
        least: u64,
        /// How many it has.
        functions: usize,
        /// Bytes that were asked for.
        found: u64,
    },
    /// What is told of the functions cannot be written.
    #[error("expected finite numbers in what a file tells of its functions, found others ({0})")]
    Unwritable(String),
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

impl Wanted {
    /// In the samples' units, where these have such a range.
    fn of_range(self, range: f64) -> f64 {
        match self {
            Self::Units(error) => error,
            Self::Percent(percent) => range * percent / 100.0,
        }
    }
}

/// What an encoding is to reach, and by what. Where no error is asked for, it comes as near as its number of functions, or its
/// bytes, allow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// What functions look like.
    pub basis: Basis,
    /// The greatest error.
    pub max_error: Option<Wanted>,
    /// The mean of the errors' sizes.
    pub mean_error: Option<Wanted>,
    /// Bytes of a file of them at most.
    pub bytes: Option<u64>,
    /// Functions at most.
    pub functions: usize,
    /// Which samples count more than others. The errors asked for are of all samples alike.
    pub favour: Option<Favour>,
}

/// Encodes a field, and measures the errors of the functions as a file holds them, by as few digits as bring no more error.
/// Each round is `told`, which may break it off. Whether the errors are those that were asked for says
/// [`Encoded::is_as_near_as_asked_for`]; a file is never longer than asked for.
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
    asked: Asked,
    earlier: Option<&Encoded>,
    ticket: &Ticket,
    told: impl FnMut(Step) -> ControlFlow<()>,
) -> Result<Encoded, FieldError> {
    asked.favour.map_or(Ok(()), |favour| favour.check())?;
    let lattice = grid.lattice_of_functions(field);
    let count = field.samples.len() / field.components;
    let needed = (count as u64).saturating_mul(BYTES_A_SAMPLE);
    memory::require("fitting functions to the samples", needed, memory::free_bytes())?;
    let samples = grid.samples_of(field, component, ticket)?;
    let places = grid.places(field.association);
    let points = Points::new((0..samples.len()).map(|i| (places.at(i).0, samples.get(i))));
    let points = match asked.favour {
        Some(favour) => points.weighted(|at, value| favour.weight(at, value)),
        None => points,
    };
    let [low, high] = points
        .values()
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]);
    let range = (high - low).max(0.0);
    let of_range = |wanted: Option<Wanted>| wanted.map(|wanted| wanted.of_range(range));
    let source = Source {
        name: name.to_owned(),
        field: field.name.clone(),
        samples: points.len(),
        left_out: points.left_out(),
        wanted: of_range(asked.max_error),
        wanted_mean: of_range(asked.mean_error),
        wanted_bytes: asked.bytes,
        favour: asked.favour,
        lattice,
        fills_box: matches!(grid.shape, Shape::Affine | Shape::Rectilinear(_)),
        space: grid.space.clone(),
        unit: grid.unit.clone(),
    };
    let favoured = asked.favour.map(|favour| favoured(&points, favour));
    if favoured.as_ref().is_some_and(|own| !own.contains(&true)) && !points.is_empty() {
        return Err(FieldError::NothingFavoured([low, high]));
    }
    let whole = goal(asked, &source, range, earlier)?;
    let aim = Goal {
        max_error: whole.max_error * BEFORE_ROUNDING,
        mean_error: whole.mean_error * BEFORE_ROUNDING,
        ..whole
    };
    let judge = Judge { points: &points, goal: whole, favoured, source, ticket };
    let fitted = judge.fitted((aim, high - low), earlier, told)?;
    let middles = grid.middles(field.association, &samples, MOST_MIDDLES, ticket)?;
    let between = fitted.encoding.values(&middles, ticket)?;
    let beyond = between.iter().map(|value| (value - high).max(low - value));
    let overshoot = beyond.fold(0.0, f64::max);
    Ok(Encoded { overshoot, ..fitted })
}

/// What a fit is to reach, with the functions that a file of the bytes asked for has room for.
fn goal(
    asked: Asked,
    source: &Source,
    range: f64,
    earlier: Option<&Encoded>,
) -> Result<Goal, FieldError> {
    let Asked { basis, mut functions, .. } = asked;
    if let Some(bytes) = asked.bytes {
        let least = earlier.map_or(1, |earlier| earlier.encoding.functions().len().max(1));
        functions = functions.min(vrbf::most_functions(bytes, basis, source));
        if functions < least.min(asked.functions) {
            let functions = least;
            let least = vrbf::most_bytes(functions as u64, basis, source);
            return Err(FieldError::TooFewBytes { least, functions, found: bytes });
        }
    }
    let any = f64::INFINITY;
    let (max_error, mean_error) = match (source.wanted, source.wanted_mean) {
        (None, None) => (Wanted::Percent(FINEST_PERCENT).of_range(range), any),
        (greatest, mean) => (greatest.unwrap_or(any), mean.unwrap_or(any)),
    };
    Ok(Goal { basis, max_error, mean_error, functions })
}

/// Which points are favoured.
fn favoured(points: &Points, favour: Favour) -> Vec<bool> {
    let samples = points.positions().iter().zip(points.values());
    samples.map(|(at, value)| favour.has(*at, *value)).collect()
}

/// What sums are held against.
struct Judge<'a> {
    points: &'a Points,
    goal: Goal,
    /// Of each point, where some are.
    favoured: Option<Vec<bool>>,
    source: Source,
    ticket: &'a Ticket,
}

impl Judge<'_> {
    /// Functions that aim at a goal by rounds that are `told`, or the `earlier` ones gone on from, of samples of a range.
    fn fitted(
        &self,
        (aim, range): (Goal, f64),
        earlier: Option<&Encoded>,
        told: impl FnMut(Step) -> ControlFlow<()>,
    ) -> Result<Encoded, FieldError> {
        let Some(earlier) = earlier else {
            let found = encode(self.points, aim, self.ticket, told)?;
            return self
                .rounded(&found, f64::INFINITY)?
                .ok_or_else(|| self.no_room(found.functions().len()));
        };
        check_place(earlier, &self.source, self.points.bounds())?;
        let before = self.measured(earlier.encoding.clone())?;
        check_errors(earlier, before.errors, range)?;
        let is_there = earlier.encoding.basis() == self.goal.basis
            && self.goal.is_met(&before.errors)
            && self.fits(&before)?;
        if is_there {
            return Ok(before);
        }
        let found = resume(self.points, &earlier.encoding, aim, self.ticket, told)?;
        // What was written once is written again; rounding may take back what little was gained.
        let is_as_it_was =
            found.functions() == earlier.encoding.functions() && self.fits(&before)?;
        if !is_as_it_was && let Some(found) = self.rounded(&found, before.errors.max)? {
            return Ok(found);
        }
        match self.fits(&before)? {
            true => Ok(before),
            false => Err(self.no_room(earlier.encoding.functions().len())),
        }
    }

    /// With the errors of all samples, and of those that are favoured.
    fn measured(&self, encoding: Encoding) -> Result<Encoded, Cancelled> {
        let left = encoding.differences(self.points, self.ticket)?;
        let favoured = self.favoured.as_ref().map(|favoured| {
            let own = left.iter().zip(favoured).filter(|(_, is_favoured)| **is_favoured);
            Errors::of(&own.map(|(left, _)| *left).collect::<Vec<_>>())
        });
        let errors = Errors::of(&left);
        Ok(Encoded { encoding, errors, favoured, source: self.source.clone(), overshoot: 0.0 })
    }

    /// Whether a file of them is as short as asked for.
    fn fits(&self, encoded: &Encoded) -> Result<bool, FieldError> {
        let Some(most) = self.source.wanted_bytes else { return Ok(true) };
        // How far it goes beyond is found last, and may have the most letters.
        let longest = Encoded { overshoot: -f64::MIN_POSITIVE, ..encoded.clone() };
        let bytes = vrbf::bytes(&longest).map_err(FieldError::Unwritable)?;
        Ok(bytes.len() as u64 <= most)
    }

    fn no_room(&self, functions: usize) -> FieldError {
        let least = vrbf::most_bytes(functions as u64, self.goal.basis, &self.source);
        let found = self.source.wanted_bytes.unwrap_or_default();
        FieldError::TooFewBytes { least, functions, found }
    }

    /// The same functions as a file holds them: by the fewest digits that keep the goal reached, or where it is not, that add
    /// little to the errors; else by those that come nearest. Weights are found anew for centres and widths as they are then.
    /// `None` where the file would be longer than asked for, or the greatest error above `most`.
    fn rounded(&self, found: &Encoding, most: f64) -> Result<Option<Encoded>, FieldError> {
        let exact = self.measured(found.clone())?;
        let is_met = self.goal.is_met(&exact.errors);
        let is_kept = |own: &Errors, exact: &Errors| {
            own.max <= MOST_BY_ROUNDING * exact.max && own.rms <= MOST_BY_ROUNDING * exact.rms
        };
        let is_enough = |own: &Encoded| {
            let favoured = own.favoured.zip(exact.favoured);
            let is_as_asked_for = match is_met {
                true => self.goal.is_met(&own.errors),
                false => is_kept(&own.errors, &exact.errors),
            };
            is_as_asked_for && favoured.is_none_or(|(own, exact)| is_kept(&own, &exact))
        };
        let rank = |own: &Encoded| (!is_enough(own), own.favoured.unwrap_or(own.errors).rms);
        let mut best: Option<Encoded> = None;
        for precision in Precision::ALL {
            let first = vrbf::rounded(found, precision);
            let second = vrbf::rounded(&reweighted(self.points, &first)?, precision);
            for encoding in [first, second] {
                let encoded = self.measured(encoding)?;
                let may_be = encoded.errors.max <= most && self.fits(&encoded)?;
                if may_be && best.as_ref().is_none_or(|best| rank(&encoded) < rank(best)) {
                    best = Some(encoded);
                }
            }
            if best.as_ref().is_some_and(is_enough) {
                break;
            }
        }
        Ok(best)
    }
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
        // Most of the bytes are used.
        let fit = fitted(&grid, bytes, None).expect("samples");
        let most = vrbf::most_functions(1600, Basis::Ellipsoid, &fit.source);
        assert!(fit.encoding.functions().len() + 8 > most, "{most}");
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
        refused(bytes(vrbf::most_bytes(2, Basis::Ellipsoid, &fit.source)), Some(&fit));
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
            space: None,
            unit: None,
        };
        (
            Grid::of(lattice, vec![field]),
            Encoded { encoding, errors: Errors::default(), source, favoured: None, overshoot: 0.0 },
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
}

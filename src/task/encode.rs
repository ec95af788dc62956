//! Fields encoded as basis functions.

mod judge;
#[cfg(test)]
mod tests;

use std::cell::Cell;
use std::ops::ControlFlow;
use std::sync::Arc;

use self::judge::Judge;
use crate::core::memory::{self, TooLarge};
use crate::core::{Cancelled, Ticket, plain_number};
use crate::io::vrbf::{self, Cover};
use crate::io::{Encoded, Source};
use crate::rbf::{
    Basis, EncodeError, Encoding, Errors, Favour, FavourError, Goal, Points, Step, four_digits,
};
use crate::volume::{Component, Field, Grid, Lattice, Places, Samples, Shape, VolumeError};

/// Bytes that fitting takes for each sample: its place (of uneven grids with the steps about it), its value, residual and weight,
/// and its entries in the columns of some fifty functions that reach it.
const BYTES_A_SAMPLE: u64 = 56 + 96 + 32 + 50 * 8;

/// The fit aims at this share of the errors asked for: two bytes a number add that much, and shorter numbers are worth more than
/// the few functions that it takes.
const BEFORE_ROUNDING: f64 = 0.98;
/// Where no error is asked for, the fit aims at this part of the samples' range, %: few functions come that near, and more
/// digits would only make each reach further.
const FINEST_PERCENT: f64 = 0.01;
/// Places between samples that are looked at for what goes beyond these, at most, and those of the lattice besides.
const MOST_MIDDLES: usize = 1 << 20;

/// Of meshes as many places between samples, for each of these, are fitted to as well: a sum that is held at their points alone goes
/// anywhere in their cells. (post.vtk, 2 288 points, 114 functions: 1.85 beyond a range of 1.29.)
const MIDDLES_A_SAMPLE: usize = 2;

/// What is told of where a field has values takes so many bytes at most, and an eighth of those that are asked for.
const COVER_BYTES: u64 = 1024;
const PARTS_OF_COVER: u64 = 8;

/// Samples for each function at least, where nobody says how many functions: more are no encoding.
const SAMPLES_A_FUNCTION: usize = 20;
/// But as many functions as samples where these are no more: few may be far from each other.
const FEW_SAMPLES: usize = 50;

/// The most functions that so many samples are encoded by where nobody says how many.
pub fn usual_functions(samples: usize) -> usize {
    (samples / SAMPLES_A_FUNCTION).max(samples.min(FEW_SAMPLES))
}

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
        plain_number(.0[0]),
        plain_number(.0[1])
    )]
    NothingFavoured([f64; 2]),
    /// A file of so many bytes has no room.
    #[error(
        "expected {least} bytes or more, which a file of as many basis functions as it must have ({functions}) takes, found {found}; \
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
/// An `earlier` fit of the same field is gone on from ([`crate::rbf::resume`]): the greatest error is never above its own. Its functions
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
    let is_mesh = matches!(grid.shape, Shape::Unstructured(_));
    let fitted = if is_mesh { 1 + MIDDLES_A_SAMPLE as u64 } else { 1 };
    let needed = (count as u64 * fitted).saturating_mul(BYTES_A_SAMPLE);
    memory::require("fitting functions to the samples", needed, memory::free_bytes())?;
    let samples = grid.samples_of(field, component, ticket)?;
    let places = grid.places(field.association);
    let own = || (0..samples.len()).map(|i| (places.at(i).0, samples.get(i)));
    let weighted = |points: Points| match asked.favour {
        Some(favour) => points.weighted(|at, value| favour.weight(at, value)),
        None => points,
    };
    let points = weighted(Points::new(own()));
    let mut between = Vec::new();
    if is_mesh {
        between = grid.middles(field.association, &samples, MIDDLES_A_SAMPLE * count, ticket)?;
        between.retain(|(_, value)| value.is_finite());
    }
    let denser = (!between.is_empty()).then(|| weighted(Points::new(own().chain(between))));
    let [low, high] = points
        .values()
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]);
    let range = (high - low).max(0.0);
    let of_range = |wanted: Option<Wanted>| wanted.map(|wanted| wanted.of_range(range));
    let is_there = where_it_is((grid, field, &samples), &lattice, ticket)?;
    let most = asked.bytes.map_or(u64::MAX, |bytes| bytes / PARTS_OF_COVER);
    let most = most.min(COVER_BYTES);
    let cover = Cover::of(lattice.dims, &is_there, most as usize);
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
        range: (low <= high).then_some([low, high]),
        cover,
        space: grid.space.clone(),
        unit: grid.unit.clone(),
    };
    let favoured = asked.favour.map(|favour| favoured(&points, favour));
    if favoured.as_ref().is_some_and(|own| !own.contains(&true)) && !points.is_empty() {
        return Err(FieldError::NothingFavoured([low, high]));
    }
    let whole = goal(asked, &source, range, earlier);
    let aim = Goal {
        max_error: whole.max_error * BEFORE_ROUNDING,
        mean_error: whole.mean_error * BEFORE_ROUNDING,
        ..whole
    };
    let most_functions = asked.functions;
    let fitted_to = denser.as_ref().unwrap_or(&points);
    let is_broken_off = Cell::new(false);
    let judge = Judge {
        points: &points,
        fitted_to,
        goal: whole,
        most_functions,
        favoured,
        source,
        is_mesh,
        is_broken_off,
        ticket,
    };
    let fitted = judge.fitted((aim, high - low), earlier, told)?;
    let ended = if judge.is_broken_off.get() { None } else { judge.ended(&fitted)? };
    let middles = grid.middles(field.association, &samples, MOST_MIDDLES, ticket)?;
    let mut places: Vec<_> = middles.iter().map(|(at, _)| *at).collect();
    if !fitted.source.fills_box {
        // Where it is drawn, too.
        let lattice = Places::Lattice(lattice);
        let there = is_there.iter().enumerate().filter(|(_, is_there)| **is_there);
        places.extend(there.map(|(i, _)| lattice.at(i).0));
    }
    let between = fitted.encoding.values(&places, ticket)?;
    let beyond = between.iter().map(|value| (value - high).max(low - value));
    let overshoot = beyond.fold(0.0, f64::max);
    // Places come first, those of the lattice after them.
    let known = middles.iter().zip(&between).filter(|((_, value), _)| value.is_finite());
    let off: Vec<f64> = known.map(|((_, value), sum)| value - sum).collect();
    let between = (is_mesh && !off.is_empty()).then(|| {
        let Errors { max, mean, rms } = Errors::of(&off);
        // Digits that nobody needs would take bytes.
        Errors { max: four_digits(max), mean: four_digits(mean), rms: four_digits(rms) }
    });
    Ok(Encoded { overshoot, between, ended, ..fitted })
}

/// Whether a field has values at each sample of a lattice; of none where it has some at all.
fn where_it_is(
    (grid, field, samples): (&Grid, &Field, &Samples),
    lattice: &Lattice,
    ticket: &Ticket,
) -> Result<Vec<bool>, FieldError> {
    let is_whole = matches!(grid.shape, Shape::Affine | Shape::Rectilinear(_))
        && (0..samples.len()).all(|i| samples.get(i).is_finite());
    if is_whole {
        return Ok(Vec::new());
    }
    Ok(grid.has_values((field, samples), lattice, ticket)?)
}

/// What a fit is to reach, with the functions that a file of the bytes asked for has room for.
fn goal(asked: Asked, source: &Source, range: f64, earlier: Option<&Encoded>) -> Goal {
    let Asked { basis, mut functions, .. } = asked;
    if let Some(bytes) = asked.bytes {
        // As many as fit whatever their numbers are, and as there must be; others come later.
        let least = earlier.map_or(1, |earlier| earlier.encoding.functions().len().max(1));
        functions = functions.min(vrbf::most_functions(bytes, basis, source).max(least));
    }
    let any = f64::INFINITY;
    let (max_error, mean_error) = match (source.wanted, source.wanted_mean) {
        (None, None) => (Wanted::Percent(FINEST_PERCENT).of_range(range), any),
        (greatest, mean) => (greatest.unwrap_or(any), mean.unwrap_or(any)),
    };
    Goal { basis, max_error, mean_error, functions }
}

/// Which points are favoured.
fn favoured(points: &Points, favour: Favour) -> Vec<bool> {
    let samples = points.positions().iter().zip(points.values());
    samples.map(|(at, value)| favour.has(*at, *value)).collect()
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

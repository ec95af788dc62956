//! Fields encoded as basis functions.

use crate::core::memory::{self, TooLarge};
use crate::core::{Cancelled, Ticket};
use crate::io::vrbf;
use crate::rbf::{EncodeError, Encoded, Goal, Points, Source, Step, encode};
use crate::volume::{Component, Field, Grid, VolumeError};

/// Bytes that fitting takes for each sample: its place and value, what is left of it, and its part in some fifty functions.
const BYTES_A_SAMPLE: u64 = 56 + 50 * 8;

/// Of the error asked for, what 32-bit floats leave.
const BEFORE_ROUNDING: f64 = 0.999;

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

/// A field as functions, with the errors of those that a file holds; told after each round. Whether they come as near as
/// was asked for is in [`Encoded::errors`] and [`Source::wanted`].
///
/// # Errors
/// See [`FieldError`].
pub fn encode_field(
    (grid, field, component): (&Grid, &Field, Component),
    name: &str,
    (wanted, goal): (Wanted, Goal),
    ticket: &Ticket,
    told: impl FnMut(Step),
) -> Result<Encoded, FieldError> {
    let lattice = grid.lattice_of(field);
    let needed = (lattice.len() as u64).saturating_mul(BYTES_A_SAMPLE);
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
    let encoding =
        encode(&points, Goal { max_error: max_error * BEFORE_ROUNDING, ..goal }, ticket, told)?;
    let encoding = vrbf::rounded(&encoding);
    let errors = encoding.errors(&points, ticket)?;
    Ok(Encoded {
        encoding,
        errors,
        source: Source {
            name: name.to_owned(),
            field: field.name.clone(),
            samples: points.len(),
            left_out: points.left_out(),
            wanted: max_error,
            lattice,
            space: grid.space.clone(),
            unit: grid.unit.clone(),
        },
    })
}

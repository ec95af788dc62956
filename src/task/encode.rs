//! Fields encoded as basis functions.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::core::memory::{self, TooLarge};
use crate::core::{Cancelled, Ticket};
use crate::io::{Encoded, Source, vrbf};
use crate::rbf::{EncodeError, Encoding, Goal, Points, Step, encode};
use crate::volume::{Component, Field, Grid, Samples, VolumeError};

/// Bytes that fitting takes for each sample: its place (of uneven grids with the steps about it), its value and residual, and
/// its entries in the columns of some fifty functions that reach it.
const BYTES_A_SAMPLE: u64 = 56 + 96 + 50 * 8;

/// The fit aims at this share of the error asked for, since rounding to 32 bits adds some.
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

/// Encodes a field, and measures the errors of the functions as a file holds them. Each round is `told`, which may break it off. The goal was reached
/// if [`Encoded::errors`] are within [`Source::wanted`].
///
/// # Errors
/// See [`FieldError`].
pub fn encode_field(
    (grid, field, component): (&Grid, &Field, Component),
    name: &str,
    (wanted, goal): (Wanted, Goal),
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

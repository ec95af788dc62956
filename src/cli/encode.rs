//! `voxsplat encode` and `voxsplat convert`.

use std::time::Instant;

use super::flags::{ConvertFlags, EncodeFlags};
use super::progress::Progress;
use super::{Destination, Failure, note, open};
use crate::core::Ticket;
use crate::core::memory::human_bytes;
use crate::io::vrbf;
use crate::rbf::{Goal, four_digits};
use crate::task::encode::encode_field;
use crate::volume::Component;

/// Samples for each function at least, where nobody says how many functions: more are no encoding.
const SAMPLES_A_FUNCTION: usize = 20;

pub(super) fn encode(flags: &EncodeFlags) -> Result<(), Failure> {
    let destination = Destination::check(&flags.output, "the functions")?;
    let input = open::grid(&flags.input, flags.field.as_deref())?;
    let failed = |error: &dyn std::fmt::Display| Failure::Failed(input.about(&error.to_string()));
    let field = input.field(flags.field.as_deref()).map_err(|error| failed(&error))?;
    let usual = if field.components == 1 { Component::Index(0) } else { Component::Magnitude };
    let component = flags.component.unwrap_or(usual);
    let most = field.samples.len() / field.components / SAMPLES_A_FUNCTION;
    let goal = Goal {
        basis: flags.basis,
        max_error: 0.0,
        functions: flags.functions.unwrap_or(most.max(1)),
    };
    let ticket = Ticket::new();
    let start = Instant::now();
    let encoded = {
        let _progress = Progress::of(&ticket, "Encoding");
        let what = (&input.grid, field, component);
        encode_field(what, &input.name(), (flags.max_error, goal), &ticket, |_| {})
    };
    let encoded = encoded.map_err(|error| failed(&error))?;
    let (wanted, errors) = (encoded.source.wanted, encoded.errors);
    let count = encoded.encoding.functions().len();
    if errors.max > wanted {
        let least = four_digits(wanted);
        if flags.functions.is_none() {
            return Err(failed(&format!(
                "expected a greatest error of {least} at most, found that {count} functions have this: {errors}; ask for less, or \
                 say with --functions how many may be taken: what comes nearest is written then"
            )));
        }
        note(&format!("a greatest error of {least} was not reached"));
    }
    let bytes = vrbf::bytes(&encoded).map_err(Failure::Failed)?;
    destination.write(&bytes)?;
    if matches!(destination, Destination::File(_)) {
        note(&format!(
            "{count} functions, {errors}, {} for {} samples, {:.1} s",
            human_bytes(bytes.len() as u64),
            encoded.source.samples,
            start.elapsed().as_secs_f64()
        ));
    }
    Ok(())
}

pub(super) fn convert(flags: &ConvertFlags) -> Result<(), Failure> {
    let destination = Destination::check(&flags.output, "the volume")?;
    let input = open::grid_at(&flags.input, flags.field.as_deref(), flags.dims)?;
    if flags.dims.is_some() && input.encoding.is_none() {
        return Err(Failure::Failed(input.about(
            "expected basis functions with --dims, found samples, which are converted as they are; leave it out",
        )));
    }
    let field = input.field(flags.field.as_deref());
    let field = field.map_err(|error| Failure::Failed(input.about(&error.to_string())))?;
    if !matches!(input.grid.shape, crate::volume::Shape::Affine) {
        return Err(Failure::Failed(input.about(
            "expected evenly spaced samples, which NRRD has, found others; encode them, and convert the functions",
        )));
    }
    destination.write(&crate::io::nrrd_bytes(&input.grid, field))
}

//! `voxsplat encode` and `voxsplat convert`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::flags::InputFlags;
use super::progress::Progress;
use super::{Destination, Failure, note, open, values};
use crate::core::Ticket;
use crate::core::memory::human_bytes;
use crate::io::{Encoded, nrrd_bytes, vrbf};
use crate::rbf::{Basis, Goal, four_digits};
use crate::task::encode::{Wanted, encode_field};
use crate::volume::{Component, Field, Shape};

/// Samples for each function at least, where nobody says how many functions: more are no encoding.
const SAMPLES_A_FUNCTION: usize = 20;

/// `voxsplat encode`.
#[derive(Debug, Args)]
pub struct EncodeFlags {
    /// The file.
    #[command(flatten)]
    pub input: InputFlags,
    /// File to write (.vrbf); - for standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Greatest difference of the functions' sum from any sample, in the data's units; with % of their range
    /// [with --resume, default: what the earlier fit was to reach]
    #[arg(long, value_name = "E", value_parser = values::wanted_error, allow_hyphen_values = true,
        required_unless_present = "resume")]
    pub max_error: Option<Wanted>,
    /// Functions at most: what comes nearest by so many is written, also if that is further than --max-error
    /// [default: one for 20 samples, and else nothing is written]
    #[arg(long, value_name = "N", value_parser = values::functions, allow_hyphen_values = true)]
    pub functions: Option<usize>,
    /// Ends after the round in which so many seconds have passed: what comes nearest until then is written, also if that is
    /// further than --max-error. Ctrl-C writes nothing
    #[arg(long, value_name = "T", value_parser = values::positive, allow_hyphen_values = true)]
    pub seconds: Option<f64>,
    /// Basis: ellipsoid (Gaussians as wide as they have to be in each direction), gaussian (one width each), or
    /// multiquadric (inverse, one width each) [default: ellipsoid; with --resume that of the earlier fit]
    #[arg(long, value_name = "BASIS", value_parser = values::basis)]
    pub basis: Option<Basis>,
    /// Functions of an earlier fit of the same field (.vrbf) to go on from: they are kept, refined and added to, and the
    /// greatest error never grows
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,
    /// Field to encode [default: the active one]
    #[arg(long, value_name = "NAME")]
    pub field: Option<String>,
    /// Component of the field, as of `render` [default: magnitude, where there is more than one]
    #[arg(long, value_name = "N", value_parser = values::component, allow_hyphen_values = true)]
    pub component: Option<Component>,
}

/// `voxsplat convert`.
#[derive(Debug, Args)]
pub struct ConvertFlags {
    /// The file.
    #[command(flatten)]
    pub input: InputFlags,
    /// File to write (.nrrd); - for standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Of basis functions: samples along each axis, over the box of their source [default: those of the source]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::dims, allow_hyphen_values = true)]
    pub dims: Option<[usize; 3]>,
    /// Field to write [default: the active one]
    #[arg(long, value_name = "NAME")]
    pub field: Option<String>,
}

pub(super) fn encode(flags: &EncodeFlags) -> Result<(), Failure> {
    let destination = Destination::check(&flags.output, "the functions")?;
    let earlier = flags.resume.as_deref().map(vrbf::load).transpose().map_err(Failure::failed)?;
    let input = open::grid(&flags.input, flags.field.as_deref())?;
    let failed = |error: &dyn std::fmt::Display| Failure::Failed(input.about(&error.to_string()));
    let field = input.field(flags.field.as_deref()).map_err(|error| failed(&error))?;
    let component = flags.component.unwrap_or(Component::usual(field.components));
    let goal = Goal {
        basis: basis(flags, earlier.as_ref()),
        max_error: 0.0,
        functions: most_functions(flags, field, earlier.as_ref())?,
    };
    let wanted = wanted(flags, earlier.as_ref())?;
    let ticket = Ticket::new();
    let start = Instant::now();
    let encoded = {
        let _progress = Progress::of(&ticket, "Encoding");
        let what = (&input.grid, field, component);
        encode_field(what, &input.name(), (wanted, goal), earlier.as_ref(), &ticket, |step| {
            // Where there is no function yet, the first round is awaited.
            let is_late = flags.seconds.is_some_and(|most| start.elapsed().as_secs_f64() >= most);
            match is_late && step.functions > 0 {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        })
    };
    let encoded = encoded.map_err(|error| failed(&error))?;
    let (wanted, errors) = (encoded.source.wanted, encoded.errors);
    let count = encoded.encoding.functions().len();
    if errors.max > wanted {
        let least = four_digits(wanted);
        if flags.functions.is_none() && flags.seconds.is_none() {
            return Err(failed(&format!(
                "expected a greatest error of {least} at most, found that {count} functions have this: {errors}; ask for less, or \
                 say with --functions how many may be taken, or with --seconds how long it may take: what comes nearest is written then"
            )));
        }
        note(&format!("a greatest error of {least} was not reached"));
    }
    let is_as_it_was =
        |earlier: &Encoded| earlier.encoding.functions() == encoded.encoding.functions();
    if earlier.as_ref().is_some_and(is_as_it_was) {
        note(match errors.max <= wanted {
            true => "the earlier fit is as near already: its functions are written as they are",
            false => {
                "nothing nearer was found: the functions of the earlier fit are written as they are"
            }
        });
    }
    encoded.told_beyond_samples().iter().for_each(|what| note(what));
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

/// What functions look like: as asked for, or as those of an earlier fit.
fn basis(flags: &EncodeFlags, earlier: Option<&Encoded>) -> Basis {
    let own = earlier.map(|earlier| earlier.encoding.basis());
    flags.basis.or(own).unwrap_or_default()
}

/// How near they are to come: as asked for, or as an earlier fit was to.
fn wanted(flags: &EncodeFlags, earlier: Option<&Encoded>) -> Result<Wanted, Failure> {
    let own = earlier.map(|earlier| Wanted::Units(earlier.source.wanted));
    flags.max_error.or(own).ok_or_else(|| {
        Failure::Usage("expected --max-error, found nothing; say how near it is to come".to_owned())
    })
}

/// Functions at most: not fewer than those of an earlier fit, of which none are taken away.
fn most_functions(
    flags: &EncodeFlags,
    field: &Field,
    earlier: Option<&Encoded>,
) -> Result<usize, Failure> {
    let own = earlier.map_or(0, |earlier| earlier.encoding.functions().len());
    let usual = field.samples.len() / field.components / SAMPLES_A_FUNCTION;
    match flags.functions {
        Some(most) if most < own => Err(Failure::Failed(format!(
            "expected --functions of at least {own}, as many as the earlier fit has, found {most}; \
             allow more, or encode anew: {}",
            flags.resume.as_deref().unwrap_or(Path::new("")).display()
        ))),
        Some(most) => Ok(most),
        None => Ok(usual.max(own).max(1)),
    }
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
    if !matches!(input.grid.shape, Shape::Affine) {
        return Err(Failure::Failed(input.about(
            "expected evenly spaced samples, which NRRD has, found others; encode them, and convert the functions",
        )));
    }
    destination.write(&nrrd_bytes(&input.grid, field))
}

//! `voxsplat encode` and `voxsplat convert`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::flags::InputFlags;
use super::inside::{self, Place};
use super::progress::Progress;
use super::{Destination, Failure, note, open, refuse_one_place, values};
use crate::core::Ticket;
use crate::core::counted;
use crate::core::memory::human_bytes;
use crate::io::{Encoded, Ended, may_be_replaced, nrrd_bytes, vrbf};
use crate::rbf::{Basis, Favour, few_digits};
use crate::task::encode::{Asked, Wanted, encode_field, usual_functions};
use crate::volume::{Component, Field, Shape};

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
    #[arg(long, value_name = "E", value_parser = values::wanted_error, allow_hyphen_values = true)]
    pub max_error: Option<Wanted>,
    /// Mean of the differences' sizes, likewise; with --max-error both are to be reached
    #[arg(long, value_name = "E", value_parser = values::wanted_error, allow_hyphen_values = true)]
    pub mean_error: Option<Wanted>,
    /// Bytes of the file at most: what comes nearest within them is written, also if that is further than an error that is
    /// asked for
    #[arg(long, value_name = "N", value_parser = values::bytes, allow_hyphen_values = true)]
    pub bytes: Option<u64>,
    /// Functions at most: what comes nearest by so many is written, also if that is further than --max-error or
    /// --mean-error [default: one for every 20 samples, one for each where these are at most 50, and an error where they do
    /// not suffice, with what came nearest unless another file would be replaced; with --bytes as many as they hold]
    #[arg(long, value_name = "N", value_parser = values::functions, allow_hyphen_values = true)]
    pub functions: Option<usize>,
    /// Ends after the round in which so many seconds have passed: what comes nearest until then is written, also if that is
    /// further than an error that is asked for. Ctrl-C writes nothing
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
    /// Favour samples of these values: they count more than the others, so that the sum comes nearer there. The errors
    /// asked for are of all samples alike [with --resume, default: those that the earlier fit favoured]
    #[arg(long, value_name = "LOW:HIGH", value_parser = values::value_range, allow_hyphen_values = true)]
    pub favour_range: Option<[f64; 2]>,
    /// Favour samples in a box, given as that of `render --clip-box`; with --favour-range those that are of both
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = inside::places,
        allow_hyphen_values = true)]
    pub favour_box: Option<[Place; 6]>,
    /// How many times as much favoured samples count, 1 or more [default: 10]
    #[arg(long, value_name = "T", value_parser = values::times, allow_hyphen_values = true)]
    pub favour_times: Option<f64>,
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
    let EncodeFlags { max_error, mean_error, bytes, functions, resume, .. } = flags;
    let has_goal = max_error.is_some() || mean_error.is_some() || resume.is_some();
    if !has_goal && bytes.is_none() && functions.is_none() {
        return Err(Failure::Usage(
            "expected --max-error, --mean-error, --functions, --bytes or --resume, found none of them; say what the functions are \
             to reach"
                .to_owned(),
        ));
    }
    let named =
        [("the file", Some(flags.input.file.as_path())), ("--output", Some(&*flags.output))];
    refuse_one_place(&named)?;
    require_ending(&flags.output, "basis functions", "vrbf")?;
    let destination = Destination::check(&flags.output, "the functions")?;
    // What falls short of a goal takes the place of nothing but the fit that it went on from.
    let is_free = match &destination {
        Destination::File(_) => {
            !flags.output.exists() || flags.resume.as_ref() == Some(&flags.output)
        }
        Destination::Stdout(_) => false,
    };
    let earlier = flags.resume.as_deref().map(vrbf::load).transpose().map_err(Failure::failed)?;
    // The fit goes on in its place.
    flags.resume.as_deref().into_iter().for_each(may_be_replaced);
    let input = open::grid(&flags.input, flags.field.as_deref())?;
    let failed = |error: &dyn std::fmt::Display| Failure::Failed(input.about(&error.to_string()));
    let field = input.field(flags.field.as_deref()).map_err(|error| failed(&error))?;
    let component = flags.component.unwrap_or(Component::usual(field.components));
    let ticket = Ticket::new();
    let region = match flags.favour_box {
        None => None,
        Some(places) => {
            let volume = input.grid.scalar(field, component, &ticket);
            let volume = volume.map_err(|error| failed(&error))?;
            let within = inside::box_between(places, "--favour-box", &volume);
            Some(within.map_err(|error| failed(&error))?.region(&volume.lattice))
        }
    };
    let favour = Favour { times: Favour::TIMES, range: flags.favour_range, region };
    let (max_error, mean_error, bytes) = goals(flags, earlier.as_ref());
    let asked = Asked {
        basis: basis(flags, earlier.as_ref()),
        max_error,
        mean_error,
        bytes,
        functions: most_functions(flags, bytes, field, earlier.as_ref())?,
        favour: favoured(flags, favour, earlier.as_ref())?,
    };
    let start = Instant::now();
    let mut is_late = false;
    let encoded = {
        let _progress = Progress::of(&ticket, "Encoding");
        let what = (&input.grid, field, component);
        encode_field(what, &input.name(), asked, earlier.as_ref(), &ticket, |step| {
            // Where there is no function yet, the first round is awaited.
            is_late = flags.seconds.is_some_and(|most| start.elapsed().as_secs_f64() >= most)
                && step.functions > 0;
            match is_late {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        })
    };
    let encoded = encoded.map_err(|error| failed(&error))?;
    let errors = encoded.errors;
    let count = counted(encoded.encoding.functions().len(), "function");
    let is_reached = encoded.is_as_near_as_asked_for();
    let mut short = None;
    if !is_reached {
        let wanted = wanted_words(&encoded);
        if flags.functions.is_none() && bytes.is_none() && flags.seconds.is_none() {
            let advice = match encoded.ended {
                // Of the number that is usual.
                Some(Ended::NoNearer { .. }) => {
                    "more of them brought it no nearer: ask for less, or have them written with --functions and a number"
                }
                _ => {
                    "ask for less, or say with --functions how many may be taken, or with --seconds how long it may take: what \
                     comes nearest is enough then"
                }
            };
            let sentence = format!(
                "expected {wanted} at most, found that {count} have this: {errors}; {advice}"
            );
            if !is_free {
                return Err(failed(&sentence));
            }
            short = Some(failed(&format!("{sentence}. These are written all the same")));
        } else {
            note(&format!("{wanted} was not reached"));
        }
    }
    if is_late && encoded.encoding.functions().len() < asked.functions {
        note(&ended_early(&encoded, asked.functions));
    }
    let is_as_it_was =
        |earlier: &Encoded| earlier.encoding.functions() == encoded.encoding.functions();
    if earlier.as_ref().is_some_and(is_as_it_was) {
        note(match is_reached {
            true => "the earlier fit is as near already: its functions are written as they are",
            false => {
                "nothing nearer was found: the functions of the earlier fit are written as they are"
            }
        });
    }
    encoded.told_left_out().iter().for_each(|what| note(what));
    encoded.told_beyond_samples().iter().for_each(|what| note(what));
    let bytes = vrbf::bytes(&encoded).map_err(Failure::Failed)?;
    destination.write(&bytes)?;
    if matches!(destination, Destination::File(_)) {
        let favoured = match encoded.favoured {
            Some(errors) => format!(" (of the favoured samples {errors})"),
            None => String::new(),
        };
        note(&format!(
            "{count}, {errors}{favoured}, {} for {} samples, {:.1} s",
            human_bytes(bytes.len() as u64),
            encoded.source.samples,
            start.elapsed().as_secs_f64()
        ));
    }
    short.map_or(Ok(()), Err)
}

/// A name that says what is written to it, or `-`.
fn require_ending(path: &Path, what: &str, ending: &str) -> Result<(), Failure> {
    let has_it = path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    match has_it || path == Path::new("-") {
        true => Ok(()),
        false => Err(Failure::Usage(format!(
            "expected a name that ends in .{ending} for {what}, found another; choose such a name: {}",
            path.display()
        ))),
    }
}

/// That no more functions were made in the time that there was.
fn ended_early(encoded: &Encoded, allowed: usize) -> String {
    let count = encoded.encoding.functions().len();
    match allowed {
        usize::MAX => format!("the time is up: the fit ended with {}", counted(count, "function")),
        allowed => {
            format!(
                "the time is up: the fit ended with {count} of {}",
                counted(allowed, "function")
            )
        }
    }
}

/// What functions look like: as asked for, or as those of an earlier fit.
fn basis(flags: &EncodeFlags, earlier: Option<&Encoded>) -> Basis {
    let own = earlier.map(|earlier| earlier.encoding.basis());
    flags.basis.or(own).unwrap_or_default()
}

/// The greatest and the mean error, and the bytes of a file: as asked for, or where nothing is, as an earlier fit was to reach.
fn goals(
    flags: &EncodeFlags,
    earlier: Option<&Encoded>,
) -> (Option<Wanted>, Option<Wanted>, Option<u64>) {
    let own = (flags.max_error, flags.mean_error, flags.bytes);
    match earlier.map(|earlier| &earlier.source) {
        Some(source) if own == (None, None, None) => {
            // Who says how many functions there may be has said how long it may get.
            let bytes = source.wanted_bytes.filter(|_| flags.functions.is_none());
            (source.wanted.map(Wanted::Units), source.wanted_mean.map(Wanted::Units), bytes)
        }
        _ => own,
    }
}

/// The errors that were asked for, for people.
fn wanted_words(encoded: &Encoded) -> String {
    let wanted = |what: &str, error: Option<f64>| {
        error.map(|error| format!("a {what} error of {}", few_digits(error)))
    };
    let all =
        [wanted("greatest", encoded.source.wanted), wanted("mean", encoded.source.wanted_mean)];
    all.into_iter().flatten().collect::<Vec<_>>().join(" and ")
}

/// Which samples count more: those of the flags, or else of an earlier fit; how much more as said, as there, or as usual.
fn favoured(
    flags: &EncodeFlags,
    own: Favour,
    earlier: Option<&Encoded>,
) -> Result<Option<Favour>, Failure> {
    let before = earlier.and_then(|earlier| earlier.source.favour);
    let is_said = own.range.is_some() || own.region.is_some();
    let chosen = if is_said { Some(own) } else { before };
    match (chosen, flags.favour_times) {
        (None, Some(_)) => Err(Failure::Usage(
            "expected --favour-range or --favour-box with --favour-times, found neither; say which samples are favoured"
                .to_owned(),
        )),
        (Some(favour), Some(times)) => Ok(Some(Favour { times, ..favour })),
        (chosen, None) => Ok(chosen),
    }
}

/// Functions at most: not fewer than those of an earlier fit, of which none are taken away.
fn most_functions(
    flags: &EncodeFlags,
    bytes: Option<u64>,
    field: &Field,
    earlier: Option<&Encoded>,
) -> Result<usize, Failure> {
    let own = earlier.map_or(0, |earlier| earlier.encoding.functions().len());
    let usual = usual_functions(field.samples.len() / field.components);
    match flags.functions {
        Some(most) if most < own => Err(Failure::Failed(format!(
            "expected --functions of at least {own}, as many as the earlier fit has, found {most}; \
             allow more, or encode anew: {}",
            flags.resume.as_deref().unwrap_or(Path::new("")).display()
        ))),
        Some(most) => Ok(most),
        None if bytes.is_some() => Ok(usize::MAX),
        None => Ok(usual.max(own).max(1)),
    }
}

pub(super) fn convert(flags: &ConvertFlags) -> Result<(), Failure> {
    let named =
        [("the file", Some(flags.input.file.as_path())), ("--output", Some(&*flags.output))];
    refuse_one_place(&named)?;
    require_ending(&flags.output, "samples", "nrrd")?;
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

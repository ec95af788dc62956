//! Flag values from text: each says what it expected and what it found.

use std::ops::RangeInclusive;

use crate::core::{Srgb8, plain_number};
use crate::io::Endian;
use crate::kernel::Kernel;
use crate::rbf::Basis;
use crate::scene::{
    AlongRay, Annotation, Annotations, Backend, Classify, ErrorMeasure, Index,
    MOST_SHEETS_PER_KERNEL, Moving, OpacityModel, Order, Reconstruction, ShadingPreset, UpAxis,
    Visibility,
};
use crate::task::encode::Wanted;
use crate::task::engine::{AdapterChoice, EngineChoice};
use crate::transfer::ColourMap;
use crate::transfer::presets::Preset;
use crate::vector::{ColourBy, Design, Foreshortening, MOST_COARSER, VectorMode};
use crate::volume::{Component, ScalarType};

/// Characters of a value that a message quotes.
pub(super) const LONGEST: usize = 60;

type Parsed<T> = Result<T, String>;

/// A flag that is given once and holds several things.
#[derive(Debug, Clone, PartialEq)]
pub struct List<T>(pub Vec<T>);

/// (value, opacity) pairs.
pub(super) type Points = List<(f64, f64)>;
/// A colour at a data value.
pub(super) type Stop = (f64, Srgb8);

/// What was found, as a message quotes it: on one line, no longer than anybody reads, and where it is nothing, that.
pub(super) fn found(text: &str) -> String {
    if text.trim().is_empty() {
        return "nothing".to_owned();
    }
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{:?}…", &text[..end]),
        None => format!("{text:?}"),
    }
}

pub(super) fn number(text: &str) -> Parsed<f64> {
    let value: f64 = text
        .trim()
        .parse()
        .map_err(|_| format!("expected a number such as 0.5, found {}", found(text)))?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(format!("expected a finite number, found {}", found(text)))
    }
}

pub(super) fn numbers<const N: usize>(text: &str, what: &str) -> Parsed<[f64; N]> {
    let values: Vec<f64> = text.split(',').map(number).collect::<Parsed<_>>()?;
    values.try_into().map_err(|_| format!("expected {what}, found {}", found(text)))
}

/// A whole number within a range.
fn whole_number(text: &str, range: RangeInclusive<u64>) -> Parsed<u64> {
    let value = text.trim().parse().ok().filter(|value| range.contains(value));
    value.ok_or_else(|| match range.into_inner() {
        (least, u64::MAX) => {
            format!("expected a whole number of at least {least}, found {}", found(text))
        }
        (least, most) => {
            format!("expected a whole number from {least} to {most}, found {}", found(text))
        }
    })
}

pub(super) fn count(text: &str) -> Parsed<u64> {
    whole_number(text, 0..=u64::MAX)
}

fn small(text: &str, range: RangeInclusive<u32>) -> Parsed<u32> {
    let (least, most) = range.into_inner();
    let value = whole_number(text, u64::from(least)..=u64::from(most))?;
    u32::try_from(value).map_err(|error| error.to_string())
}

/// How often vectors are halved.
pub(super) fn halvings(text: &str) -> Parsed<u32> {
    small(text, 0..=MOST_COARSER)
}

/// A whole number whose range the mode or the picture has a say in.
pub(super) fn natural(text: &str) -> Parsed<u32> {
    small(text, 0..=u32::MAX)
}

pub(super) fn frames(text: &str) -> Parsed<u32> {
    small(text, 0..=u32::MAX)
}

pub(super) fn pixels(text: &str) -> Parsed<u32> {
    small(text, 1..=u32::MAX)
}

/// Column and row of a pixel.
pub(super) fn pixel(text: &str) -> Parsed<[u32; 2]> {
    let parts: Vec<u32> =
        text.split(',').map(|part| small(part, 0..=u32::MAX)).collect::<Parsed<_>>()?;
    parts.try_into().map_err(|_| format!("expected two numbers X,Y, found {}", found(text)))
}

/// A share of something that is neither none of it nor all.
pub(super) fn inner_share(text: &str) -> Parsed<f64> {
    match number(text)? {
        value if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err(format!("expected a number above 0 and below 1, found {}", found(text))),
    }
}

pub(super) fn sheets(text: &str) -> Parsed<u32> {
    small(text, 1..=MOST_SHEETS_PER_KERNEL)
}

pub(super) fn component(text: &str) -> Parsed<Component> {
    let words = [Component::Magnitude].into_iter().chain(Component::DERIVED);
    if let Some(word) = words.into_iter().find(|component| component.word() == text) {
        return Ok(word);
    }
    let number = small(text, 0..=u32::MAX).map_err(|_| {
        format!(
            "expected a whole number from 0, or magnitude, vorticity, divergence or helicity, found {}",
            found(text)
        )
    })?;
    Ok(Component::Index(number as usize))
}

pub(super) fn vector(text: &str) -> Parsed<[f64; 3]> {
    numbers(text, "three numbers X,Y,Z")
}

pub(super) fn direction(text: &str) -> Parsed<[f64; 3]> {
    let value = vector(text)?;
    if value.iter().all(|&v| v == 0.0) {
        return Err("expected a direction of non-zero length, found 0,0,0".to_owned());
    }
    Ok(of_plain_length(value))
}

/// The same direction, where only that counts, of a length whose square is a number.
pub(super) fn of_plain_length(direction: [f64; 3]) -> [f64; 3] {
    let greatest = direction.iter().map(|v| v.abs()).fold(0.0, f64::max);
    match (1e-100..=1e100).contains(&greatest) {
        true => direction,
        false => direction.map(|v| v / greatest),
    }
}

pub(super) fn spacing(text: &str) -> Parsed<[f64; 3]> {
    let value = vector(text)?;
    if value.contains(&0.0) {
        return Err(format!("expected three distances other than 0, found {}", found(text)));
    }
    Ok(value)
}

pub(super) fn range(text: &str) -> Parsed<[f64; 2]> {
    numbers(text, "two numbers LO,HI")
}

/// A range that holds more than one value.
pub(super) fn unequal(text: &str) -> Parsed<[f64; 2]> {
    match range(text)? {
        [low, high] if low == high => Err(format!(
            "expected two different numbers LO,HI, found {}; give the values of the map's two ends",
            found(text)
        )),
        range => Ok(range),
    }
}

pub(super) fn positive(text: &str) -> Parsed<f64> {
    match number(text)? {
        value if value > 0.0 => Ok(value),
        _ => Err(format!("expected a number above 0, found {}", found(text))),
    }
}

/// An error: in the data's units, or % of their range.
pub(super) fn wanted_error(text: &str) -> Parsed<Wanted> {
    let (number, wanted): (_, fn(f64) -> Wanted) = match text.trim().strip_suffix('%') {
        Some(percent) => (percent, Wanted::Percent),
        None => (text, Wanted::Units),
    };
    let expected =
        |_| format!("expected a number above 0, or so many percent, found {}", found(text));
    positive(number).map(wanted).map_err(expected)
}

/// Two values LOW:HIGH, the least first; they may be the same.
pub(super) fn value_range(text: &str) -> Parsed<[f64; 2]> {
    let ends = text.split_once(':');
    let (low, high) =
        ends.ok_or_else(|| format!("expected two values LOW:HIGH, found {}", found(text)))?;
    match [number(low)?, number(high)?] {
        [low, high] if low > high => {
            Err(format!("expected LOW:HIGH, the least value first, found {}", found(text)))
        }
        range => Ok(range),
    }
}

/// How many times as much samples count.
pub(super) fn times(text: &str) -> Parsed<f64> {
    match number(text)? {
        value if value >= 1.0 => Ok(value),
        _ => Err(format!("expected a number of at least 1, found {}", found(text))),
    }
}

/// The most bytes of a file.
pub(super) fn bytes(text: &str) -> Parsed<u64> {
    whole_number(text, 1..=u64::MAX)
}

/// How many basis functions.
pub(super) fn functions(text: &str) -> Parsed<usize> {
    whole_number(text, 1..=1 << 24).map(|n| n as usize)
}

/// Names of annotations, or all of them.
pub(super) fn annotations(text: &str) -> Parsed<Annotations> {
    let mut chosen = Annotations::NONE;
    for name in text.split(',').map(str::trim) {
        match Annotation::from_name(name) {
            Some(which) => *chosen.switch(which) = true,
            None if name == "all" => {
                Annotation::ALL.into_iter().for_each(|which| *chosen.switch(which) = true);
            }
            None => {
                let names = Annotation::ALL.map(Annotation::name).join(", ");
                return Err(format!("expected all, or some of {names}, found {}", found(name)));
            }
        }
    }
    Ok(chosen)
}

pub(super) fn share(text: &str) -> Parsed<f64> {
    within(text, 1.0)
}

pub(super) fn exponent(text: &str) -> Parsed<f64> {
    within(text, 1000.0)
}

fn within(text: &str, most: f64) -> Parsed<f64> {
    match number(text)? {
        value if (0.0..=most).contains(&value) => Ok(value),
        _ => Err(format!("expected a number from 0 to {most}, found {}", found(text))),
    }
}

pub(super) fn view_angle(text: &str) -> Parsed<f64> {
    match number(text)? {
        value if value > 0.0 && value < 180.0 => Ok(value),
        _ => Err(format!("expected an angle between 0 and 180 degrees, found {}", found(text))),
    }
}

fn whole<T: std::str::FromStr, const N: usize>(text: &str, what: &str) -> Parsed<[T; N]> {
    let wrong = || format!("expected {what}, found {}", found(text));
    let values: Vec<T> =
        text.split(',').map(|t| t.trim().parse().map_err(|_| wrong())).collect::<Parsed<_>>()?;
    values.try_into().map_err(|_| wrong())
}

pub(super) fn dims(text: &str) -> Parsed<[usize; 3]> {
    let dims: [usize; 3] = whole(text, "three whole numbers X,Y,Z such as 256,256,110")?;
    if dims.contains(&0) {
        return Err(format!("expected dimensions of at least 1, found {}", found(text)));
    }
    Ok(dims)
}

pub(super) fn resolution(text: &str) -> Parsed<[u32; 2]> {
    let size: [u32; 2] = whole(text, "two whole numbers W,H such as 640,480")?;
    if size.contains(&0) {
        return Err(format!("expected a size of at least 1,1, found {}", found(text)));
    }
    Ok(size)
}

/// Splits `V:X,V:X,…`, the least V first; one that is there twice is a step.
fn pairs<T>(text: &str, what: &str, read: impl Fn(&str) -> Parsed<T>) -> Parsed<List<(f64, T)>> {
    let mut pairs = Vec::new();
    for pair in text.split(',') {
        let (value, thing) = pair
            .split_once(':')
            .ok_or_else(|| format!("expected {what}, found {}", found(pair)))?;
        pairs.push((number(value)?, read(thing)?));
    }
    match pairs.windows(2).find(|two: &&[(f64, T)]| two[1].0 < two[0].0) {
        Some(two) => Err(format!(
            "expected {what} by value, the least first, found {} after {}; sort them",
            plain_number(two[1].0),
            plain_number(two[0].0)
        )),
        None => Ok(List(pairs)),
    }
}

pub(super) fn opacity(text: &str) -> Parsed<Points> {
    pairs(text, "VALUE:OPACITY", |text| match number(text)? {
        alpha if (0.0..=1.0).contains(&alpha) => Ok(alpha),
        _ => Err(format!("expected an opacity from 0 to 1, found {}", found(text))),
    })
}

pub(super) fn colours(text: &str) -> Parsed<List<Stop>> {
    pairs(text, "VALUE:RRGGBB", colour)
}

pub(super) fn colour(text: &str) -> Parsed<Srgb8> {
    match text {
        "white" => Ok(Srgb8([255; 3])),
        "black" => Ok(Srgb8::BLACK),
        _ => Srgb8::parse(text).ok_or_else(|| {
            format!(
                "expected a colour RRGGBB such as ff8000, black or white, found {}",
                found(text)
            )
        }),
    }
}

pub(super) fn one_of<T>(
    text: &str,
    known: Option<T>,
    names: impl Iterator<Item = &'static str>,
) -> Parsed<T> {
    known.ok_or_else(|| {
        let names = names.collect::<Vec<_>>().join(", ");
        format!("expected one of {names}, found {}", found(text))
    })
}

macro_rules! named {
    ($($function:ident: $type:ty),* $(,)?) => {
        $(pub(super) fn $function(text: &str) -> Parsed<$type> {
            let names = <$type>::ALL.iter().map(|one| one.name());
            one_of(text, <$type>::from_name(text), names)
        })*
    };
}

named!(
    visibility: Visibility,
    opacity_model: OpacityModel,
    classify: Classify,
    reconstruction: Reconstruction,
    order: Order,
    backend: Backend,
    cut_error: ErrorMeasure,
    shading_preset: ShadingPreset,
    along_ray: AlongRay,
    up_axis: UpAxis,
    vector_mode: VectorMode,
    colour_by: ColourBy,
    design: Design,
    foreshortening: Foreshortening,
    colour_map: ColourMap,
    preset: Preset,
    kernel: Kernel,
    basis: Basis,
    scalar_type: ScalarType,
    index: Index,
);

pub(super) fn endian(text: &str) -> Parsed<Endian> {
    let known = match text {
        "little" => Some(Endian::Little),
        "big" => Some(Endian::Big),
        _ => None,
    };
    one_of(text, known, ["little", "big"].into_iter())
}

pub(super) fn moving(text: &str) -> Parsed<Moving> {
    one_of(text, Moving::from_name(text), Moving::ALL.map(Moving::name).into_iter())
}

pub(super) fn engine(text: &str) -> Parsed<EngineChoice> {
    let known = match text {
        "auto" => Some(EngineChoice::Auto),
        "native" => Some(EngineChoice::Native),
        "gpu" => Some(EngineChoice::Gpu),
        _ => None,
    };
    one_of(text, known, ["auto", "native", "gpu"].into_iter())
}

pub(super) fn adapter(text: &str) -> Parsed<AdapterChoice> {
    match text {
        "auto" => Ok(AdapterChoice::Auto),
        "software" => Ok(AdapterChoice::Software),
        name if name.trim().is_empty() => {
            Err("expected auto, software, or part of an adapter's name, found nothing".to_owned())
        }
        name => Ok(AdapterChoice::Named(name.to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_and_white_are_colours_by_name() {
        assert_eq!(colour("white"), colour("ffffff"));
        assert_eq!(colour("black"), colour("000000"));
        assert!(colour("whitish").is_err_and(|told| told.contains("black or white")));
    }

    #[test]
    fn steps_keep_their_order_and_lists_out_of_order_are_refused() {
        let points = opacity("-2:0,5:1,5:0.5").unwrap();
        assert_eq!(points.0, [(-2.0, 0.0), (5.0, 1.0), (5.0, 0.5)]);
        let refused = opacity("5:0.1,2:0.3").unwrap_err();
        assert!(refused.contains("the least first, found 2 after 5; sort them"), "{refused}");
        assert!(colours("0:ff0000,-1:00ff00").is_err());
        assert_eq!(colours("1:ff0000").unwrap().0, [(1.0, Srgb8([255, 0, 0]))]);
    }

    #[test]
    fn what_is_quoted_is_no_longer_than_anybody_reads() {
        assert_eq!(found("é"), "\"é\"");
        assert_eq!(found(&"9".repeat(60)), format!("\"{}\"", "9".repeat(60)));
        assert_eq!(found(&"é".repeat(5000)), format!("\"{}\"…", "é".repeat(60)));
        let refused = opacity("1e300:0.1,-1e300:0.3").unwrap_err();
        assert!(refused.contains("found -1e300 after 1e300; sort them"), "{refused}");
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_what_was_found() {
        for refused in [
            opacity("5").unwrap_err(),
            opacity("5:1.5").unwrap_err(),
            opacity("").unwrap_err(),
            vector("1,2").unwrap_err(),
            vector("1,2,nan").unwrap_err(),
            direction("0,0,0").unwrap_err(),
            positive("-1").unwrap_err(),
            times("0").unwrap_err(),
            value_range("3").unwrap_err(),
            value_range("3:2").unwrap_err(),
            value_range("3:nan").unwrap_err(),
            bytes("-4").unwrap_err(),
            positive("inf").unwrap_err(),
            view_angle("180").unwrap_err(),
            dims("4,0,4").unwrap_err(),
            natural("x").unwrap_err(),
            natural("-1").unwrap_err(),
            dims("4,-1,4").unwrap_err(),
            resolution("640x480").unwrap_err(),
            colour("red").unwrap_err(),
            kernel("sinc").unwrap_err(),
            colour_map("jet").unwrap_err(),
            preset("bone").unwrap_err(),
            endian("middle").unwrap_err(),
            scalar_type("u8").unwrap_err(),
        ] {
            assert!(refused.contains("expected") && refused.contains("found"), "{refused}");
        }
    }

    #[test]
    fn the_ends_of_what_can_be_meant_are_where_they_are_said_to_be() {
        assert!(positive("0").is_err() && positive("1e-9").is_ok());
        assert!(times("0.999").is_err() && times("1").is_ok() && times("inf").is_err());
        assert_eq!(value_range("-1:2"), Ok([-1.0, 2.0]));
        assert_eq!(value_range("2:2"), Ok([2.0, 2.0]));
        assert!(value_range("2:1").is_err() && bytes("0").is_err());
        assert!(view_angle("0").is_err() && view_angle("179.9").is_ok());
        assert!(resolution("0,4").is_err() && resolution("4,0").is_err());
        assert_eq!(resolution("1, 4"), Ok([1, 4]));
        assert_eq!(direction("0,0,-1"), Ok([0.0, 0.0, -1.0]));
        // Neither the square of 1e-200 nor that of 1e200 is a number that could be divided by.
        assert_eq!(direction("1e-200,0,-2e-200"), Ok([0.5, 0.0, -1.0]));
        assert_eq!(direction("1e200,0,-2e200"), Ok([0.5, 0.0, -1.0]));
        assert_eq!(opacity("1:0,2:1").unwrap().0, [(1.0, 0.0), (2.0, 1.0)]);
        assert_eq!((endian("little"), endian("big")), (Ok(Endian::Little), Ok(Endian::Big)));
        assert_eq!(adapter("software"), Ok(AdapterChoice::Software));
        assert_eq!(adapter("auto"), Ok(AdapterChoice::Auto));
        assert_eq!(adapter("H200"), Ok(AdapterChoice::Named("H200".to_owned())));
    }
}

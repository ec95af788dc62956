//! PLY, read by `ply-rs-bw`: positions, normals, colours and other numbers of corners, and faces; all else is passed over.

use std::io::BufReader;

use glam::{DVec3, Vec3};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::{Parts, Watched, corrupt, truncated, unreadable};
use crate::core::Srgb8;
use crate::core::progress::Ticket;
use crate::io::error::{Problem, header, quoted};

/// Any element, as far as it is of use.
struct Element {
    position: DVec3,
    normal: Vec3,
    colour: [u8; 3],
    corners: Vec<u32>,
    /// Other numbers, in their order.
    others: Vec<f64>,
}

/// The properties of a corner that have a place of their own.
const KNOWN: [&str; 12] = ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "r", "g", "b"];

impl PropertyAccess for Element {
    fn new() -> Self {
        Self {
            position: DVec3::NAN,
            normal: Vec3::ZERO,
            colour: [0; 3],
            corners: Vec::new(),
            others: Vec::new(),
        }
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let number = || value.to_f32_lossy();
        let place = || match &value {
            Property::Double(place) => Some(*place),
            Property::Int(place) => Some(f64::from(*place)),
            Property::UInt(place) => Some(f64::from(*place)),
            other => other.to_f32_lossy().map(f64::from),
        };
        let channel = || colour(&value);
        match name {
            "x" => set(&mut self.position.x, place()),
            "y" => set(&mut self.position.y, place()),
            "z" => set(&mut self.position.z, place()),
            "nx" => set(&mut self.normal.x, number()),
            "ny" => set(&mut self.normal.y, number()),
            "nz" => set(&mut self.normal.z, number()),
            "red" | "r" => set(&mut self.colour[0], channel()),
            "green" | "g" => set(&mut self.colour[1], channel()),
            "blue" | "b" => set(&mut self.colour[2], channel()),
            "vertex_indices" | "vertex_index" => set(&mut self.corners, value.to_u32_list()),
            _ => match place() {
                Some(number) => {
                    self.others.push(number);
                    PropertyAccessResult::Set
                }
                None => PropertyAccessResult::Ignored,
            },
        }
    }
}

fn set<T>(to: &mut T, value: Option<T>) -> PropertyAccessResult {
    match value {
        Some(value) => {
            *to = value;
            PropertyAccessResult::Set
        }
        None => PropertyAccessResult::UnsupportedType,
    }
}

/// A channel of 8 bits: bytes as they are, 16 bits by their upper half, fractions of 1.
fn colour(value: &Property) -> Option<u8> {
    match value {
        Property::UShort(value) => Some((value >> 8) as u8),
        Property::Float(_) | Property::Double(_) => {
            let share = value.to_f32_lossy()?.clamp(0.0, 1.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
            let byte = (share * 255.0).round() as u8;
            Some(byte)
        }
        _ => value.to_u8_color_lossy(),
    }
}

/// The least bytes that an element takes.
fn least_bytes(element: &ElementDef, encoding: Encoding) -> u64 {
    let scalar = |kind: &ScalarType| match (encoding, kind) {
        // A digit, and a blank or the end of the line.
        (Encoding::Ascii, _) => 2,
        (_, ScalarType::Char | ScalarType::UChar) => 1,
        (_, ScalarType::Short | ScalarType::UShort) => 2,
        (_, ScalarType::Int | ScalarType::UInt | ScalarType::Float) => 4,
        (_, ScalarType::Double) => 8,
    };
    let kinds = element.properties.iter().map(|(_, property)| match &property.data_type {
        PropertyType::Scalar(kind) | PropertyType::List(kind, _) => scalar(kind),
    });
    kinds.sum()
}

fn has(element: &ElementDef, name: &str) -> bool {
    element.properties.iter().any(|(property, _)| property == name)
}

/// What stands in text for numbers that are none: the parser knows no word for them, and takes this for infinite.
const BEYOND: &str = "1e999";

/// Puts [`BEYOND`] in the place of words of an ascii file that say that a number is none; whether there were any.
fn without_words(bytes: &mut Vec<u8>) -> bool {
    let is_ascii = bytes.windows(12).take(4096).any(|words| words == b"format ascii");
    let end = bytes.windows(11).position(|words| words == b"end_header\n");
    let end = end.or_else(|| bytes.windows(11).position(|words| words == b"end_header\r"));
    let (true, Some(end)) = (is_ascii, end) else { return false };
    let begin = end + 11;
    let is_word = |word: &[u8]| {
        let word = word.strip_prefix(b"-").or(word.strip_prefix(b"+")).unwrap_or(word);
        word.get(..3)
            .is_some_and(|w| w.eq_ignore_ascii_case(b"nan") || w.eq_ignore_ascii_case(b"inf"))
    };
    let words = || bytes[begin..].split_inclusive(u8::is_ascii_whitespace);
    if !words().any(is_word) {
        return false;
    }
    let mut other = bytes[..begin].to_vec();
    for word in words() {
        match is_word(word) {
            true => {
                other.extend(BEYOND.as_bytes());
                other.extend(word.iter().filter(|c| c.is_ascii_whitespace()));
            }
            false => other.extend(word),
        }
    }
    *bytes = other;
    true
}

/// Nothing where a number is none.
fn known(number: f64) -> f64 {
    if number.is_finite() { number } else { f64::NAN }
}

pub(super) fn read(mut bytes: Vec<u8>, ticket: &Ticket) -> Result<Parts, Problem> {
    let has_words = without_words(&mut bytes);
    let mut parts = parsed(bytes, ticket)?;
    if has_words {
        for place in &mut parts.positions {
            *place = DVec3::from(place.to_array().map(known));
        }
        let numbers = parts.numbers.iter_mut().flat_map(|(_, numbers)| numbers);
        numbers.for_each(|number| *number = known(*number));
    }
    Ok(parts)
}

fn parsed(bytes: Vec<u8>, ticket: &Ticket) -> Result<Parts, Problem> {
    let len = bytes.len() as u64;
    let mut reader = Reader::new(BufReader::new(Watched::new(bytes, ticket)));
    let parser = Parser::<Element>::new();
    let failed = |error: ParseError| unreadable("a PLY file", &error.into());
    let found = parser.read_header(&mut reader).map_err(failed)?;
    let mut parts = Parts::default();
    for (name, element) in &found.elements {
        let least = least_bytes(element, found.encoding);
        let needed = (element.count as u64).saturating_mul(least.max(1));
        // The last line of text need not end.
        if needed > len + 1 {
            return Err(truncated(
                format!("{} elements {} of {least} bytes or more", element.count, quoted(name)),
                format!("a file of {len} bytes"),
                "the file was cut short or its header is wrong: copy it again",
            ));
        }
        if name == "vertex" && !["x", "y", "z"].iter().all(|axis| has(element, axis)) {
            return Err(header(
                "properties x, y and z of the element vertex",
                "that one is missing",
                "write the file with positions",
            ));
        }
        let elements = parser.read_payload_for_element(&mut reader, element, &found);
        let elements = elements.map_err(failed)?;
        match name.as_str() {
            "vertex" => {
                parts.positions = elements.iter().map(|e| e.position).collect();
                if ["nx", "ny", "nz"].iter().all(|axis| has(element, axis)) {
                    parts.normals = elements.iter().map(|e| e.normal).collect();
                }
                let is_number =
                    |property: &PropertyType| matches!(property, PropertyType::Scalar(_));
                let others = element.properties.iter().filter(|(name, property)| {
                    !KNOWN.contains(&name.as_str()) && is_number(&property.data_type)
                });
                parts.numbers = others
                    .enumerate()
                    .map(|(i, (name, _))| {
                        let number = |e: &Element| e.others.get(i).copied().unwrap_or(f64::NAN);
                        (name.clone(), elements.iter().map(number).collect())
                    })
                    .collect();
                let is_coloured = |names: [&str; 3]| names.iter().all(|name| has(element, name));
                if is_coloured(["red", "green", "blue"]) || is_coloured(["r", "g", "b"]) {
                    parts.colours = elements.iter().map(|e| Srgb8(e.colour)).collect();
                }
            }
            "face" => {
                if let Some(face) = elements.iter().position(|e| e.corners.len() < 3) {
                    return Err(corrupt(
                        "faces of three corners or more",
                        format!("{} in face {face}", elements[face].corners.len()),
                        "write the file again",
                    ));
                }
                elements.iter().for_each(|e| parts.push_polygon(&e.corners));
            }
            _ => {}
        }
    }
    Ok(parts)
}

//! STL, read by `stl_io`: corners that are the same number by number become one.

use std::collections::HashMap;

use glam::Vec3;

use super::{Parts, Watched, truncated, unreadable};
use crate::core::progress::Ticket;
use crate::io::error::Problem;

/// Bytes before a binary file's triangles: 80 of a comment, and their number.
const HEADER_BYTES: usize = 84;
/// Bytes of a triangle.
const TRIANGLE_BYTES: u64 = 50;

pub(super) fn read(
    mut bytes: Vec<u8>,
    ticket: &Ticket,
    warnings: &mut Vec<String>,
) -> Result<Parts, Problem> {
    let len = bytes.len() as u64;
    let word = bytes.get(80..HEADER_BYTES).and_then(|word| word.try_into().ok());
    let needed = word.map(|word| u64::from(u32::from_le_bytes(word)) * TRIANGLE_BYTES + 84);
    if needed == Some(len) {
        // Whatever the comment says: some begin with the word of ascii files.
        bytes[..80].fill(0);
    } else if bytes.starts_with(b"solid") {
        // A name need not follow, but the parser wants to see a blank.
        if bytes.get(5).is_some_and(|c| *c != b' ') {
            bytes.splice(5..5, [b' ']);
        }
    } else {
        match needed {
            Some(needed) if needed < len => warnings
                .push(format!("{} bytes after the last triangle were left out", len - needed)),
            _ => {
                let found = match needed {
                    Some(needed) => format!("{len} bytes instead of {needed}"),
                    None => format!("{len} bytes"),
                };
                return Err(truncated(
                    "an ascii STL file (\"solid …\"), or as many triangles as a binary one says",
                    found,
                    "the file was cut short, or is of another format: copy it again",
                ));
            }
        }
    }
    let mut reader = Watched::new(bytes, ticket);
    let failed = |error: &std::io::Error| unreadable("an STL file", error);
    let triangles = stl_io::create_stl_reader(&mut reader).map_err(|e| failed(&e))?;
    let mut parts = Parts::default();
    let mut known = HashMap::new();
    for triangle in triangles {
        let triangle = triangle.map_err(|error| failed(&error))?;
        let corners = triangle.vertices.map(|vertex| {
            // Both zeros are one place.
            let position = Vec3::from(vertex.0.map(|x| x + 0.0));
            let next = parts.positions.len() as u32;
            let index = *known.entry(position.to_array().map(f32::to_bits)).or_insert(next);
            if index == next {
                parts.positions.push(position.as_dvec3());
            }
            index
        });
        parts.triangles.push(corners);
    }
    Ok(parts)
}

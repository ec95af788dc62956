//! VTK's XML image data (`.vti`): text, base64 or appended, plain or zlib, in one piece or more.

mod data;
mod xml;

use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use self::data::{Appended, Packing};
use self::xml::{Array, Document, Extent, Piece};
use super::bytes::{self, Progress};
use super::error::{Problem, header, quoted, truncated, unsupported};
use super::{Format, Opened, axes, files};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Grid, Lattice, Samples};

/// The `type` of a VTK XML file, from its first bytes; `None` if it is none.
pub(super) fn file_type(start: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(start);
    let (_, tag) = text.split_once("<VTKFile")?;
    let tag = tag.split('>').next().unwrap_or_default();
    let (_, value) = tag.split_once("type=")?;
    let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    value[1..].split_once(quote).map(|(kind, _)| kind.to_owned())
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let (text, appended) = head(path, free_bytes, ticket)?;
    let mut document = Document::parse(&text, appended.start.is_some())?;
    let mut warnings = std::mem::take(&mut document.warnings);
    let packing = Packing {
        endian: document.endian,
        word_bytes: document.word_bytes,
        is_compressed: document.is_compressed,
    };
    let extent = covered(&document, &mut warnings)?;
    let dims = sizes(&extent)?;
    let arrays = arrays(&document)?;
    let needed = needed_bytes(&document, &arrays, dims)?;
    memory::require("the arrays of the image", needed, free_bytes)?;

    let mut progress = Progress::new(ticket, needed);
    let mut fields = Vec::with_capacity(arrays.len());
    for array in arrays {
        let samples = if let [piece] = &document.pieces[..] {
            let count = array_sizes(array, sizes(&piece.extent)?).iter().product();
            data::read(array, count, packing, &appended, &mut progress)?
        } else {
            assemble(array, &document.pieces, &extent, packing, &appended, &mut progress)?
        };
        fields.push(Field {
            name: array.name.clone(),
            components: usize::try_from(array.components).unwrap_or(usize::MAX),
            association: array.association,
            samples: Arc::new(samples),
        });
    }
    activate(&mut fields, &document.active);
    let first = DVec3::from_array(extent.map(|[first, _]| first as f64));
    let origin = document.origin + document.direction * (document.spacing * first);
    let lattice: Lattice =
        axes::lattice_of_spacing(dims, origin, document.spacing, document.direction, &mut warnings);
    Ok(Opened { grid: Grid { lattice, fields, space: None }, format: Format::Vti, warnings })
}

/// The XML, up to the appended data where there are any, and where these begin.
fn head<'a>(
    path: &'a Path,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<(String, Appended<'a>), Problem> {
    const PIECE: u64 = 1 << 18;
    const NEEDLE: &[u8] = b"<AppendedData";
    let (mut file, len) = files::open_file(path)?;
    let mut head = Vec::new();
    let mut found = None;
    while found.is_none() {
        ticket.checkpoint(0, 1)?;
        memory::require("the text of the file", head.len() as u64 * 2, free_bytes)?;
        let searched = head.len().saturating_sub(NEEDLE.len());
        if (&mut file).take(PIECE).read_to_end(&mut head).map_err(Problem::Io)? == 0 {
            break;
        }
        found = head[searched..]
            .windows(NEEDLE.len())
            .position(|window| window == NEEDLE)
            .map(|at| searched + at);
    }
    let mut appended = Appended { path, start: None, is_base64: true, len };
    if let Some(at) = found {
        // The tag itself and its underscore may lie in the next piece.
        file.take(PIECE).read_to_end(&mut head).map_err(Problem::Io)?;
        let tag_end = head[at..].iter().position(|&b| b == b'>').map(|end| at + end + 1);
        let opening = tag_end.and_then(|end| {
            let blank = head[end..].iter().take_while(|b| b.is_ascii_whitespace()).count();
            (head.get(end + blank) == Some(&b'_')).then_some((end, end + blank + 1))
        });
        let Some((tag_end, start)) = opening else {
            return Err(truncated(
                "an underscore before the appended data",
                "none",
                "the file was cut short: copy it again",
            ));
        };
        let tag = String::from_utf8_lossy(&head[at..tag_end]);
        appended.is_base64 = !(tag.contains("\"raw\"") || tag.contains("'raw'"));
        appended.start = Some(start as u64);
        head.truncate(at);
    }
    let text = String::from_utf8(head).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        header("XML in UTF-8", format!("other bytes at {at}"), "copy or write the file again")
    })?;
    Ok((text, appended))
}

/// Points along each axis of an extent.
fn sizes(extent: &Extent) -> Result<[usize; 3], Problem> {
    let mut sizes = [0; 3];
    for (size, [first, last]) in sizes.iter_mut().zip(extent) {
        let points = last.checked_sub(*first).and_then(|n| n.checked_add(1));
        *size = points.and_then(|n| usize::try_from(n).ok()).ok_or_else(|| {
            header("an extent that fits in 63 bits", format!("{extent:?}"), "correct the extent")
        })?;
    }
    Ok(sizes)
}

/// Values of an array over so many points along each axis: components, x, y, z.
fn array_sizes(array: &Array<'_>, points: [usize; 3]) -> [usize; 4] {
    let [x, y, z] = match array.association {
        Association::Point => points,
        Association::Cell => points.map(|n| n.saturating_sub(1).max(1)),
    };
    [usize::try_from(array.components).unwrap_or(usize::MAX), x, y, z]
}

/// The box of all pieces, which they must fill.
fn covered(document: &Document<'_>, warnings: &mut Vec<String>) -> Result<Extent, Problem> {
    let Some(first) = document.pieces.first() else {
        return Err(truncated("at least one Piece", "none", "copy or write the file again"));
    };
    let mut extent = first.extent;
    for piece in &document.pieces[1..] {
        for (all, one) in extent.iter_mut().zip(piece.extent) {
            *all = [all[0].min(one[0]), all[1].max(one[1])];
        }
    }
    if extent != document.whole_extent {
        warnings.push(format!(
            "WholeExtent is {:?}, but the pieces cover {extent:?}: what they cover is opened",
            document.whole_extent
        ));
    }
    Ok(extent)
}

/// The arrays of the first piece, which every piece must have.
fn arrays<'d, 'a>(document: &'d Document<'a>) -> Result<Vec<&'d Array<'a>>, Problem> {
    let arrays: Vec<&Array<'_>> =
        document.pieces.first().map(|piece| piece.arrays.iter().collect()).unwrap_or_default();
    if arrays.is_empty() {
        return Err(unsupported(
            "at least one array of numbers on points or cells",
            "none",
            "write the file again with its data",
        ));
    }
    Ok(arrays)
}

/// Bytes of all arrays, and of one more where pieces are put together.
fn needed_bytes(
    document: &Document<'_>,
    arrays: &[&Array<'_>],
    dims: [usize; 3],
) -> Result<u64, Problem> {
    let mut needed = 0_u64;
    let mut largest = 0;
    for array in arrays {
        let sizes = array_sizes(array, dims).map(|n| n as u64);
        let name = format!("the array {}", quoted(&array.name));
        let count = bytes::checked_count(&name, &sizes, array.scalar_type, u64::MAX)?;
        let size = (count * array.scalar_type.size_bytes()) as u64;
        needed = needed.saturating_add(size);
        largest = largest.max(size);
    }
    let copies = if document.pieces.len() > 1 { largest.saturating_mul(2) } else { 0 };
    Ok(needed.saturating_add(copies))
}

/// One array over all pieces.
fn assemble(
    array: &Array<'_>,
    pieces: &[Piece<'_>],
    extent: &Extent,
    packing: Packing,
    appended: &Appended<'_>,
    progress: &mut Progress<'_>,
) -> Result<Samples, Problem> {
    let points = sizes(extent)?;
    let [components, x, y, z] = array_sizes(array, points);
    // Every piece is decoded, and so shown to be in the file, before room for the whole is taken.
    let mut parts = Vec::with_capacity(pieces.len());
    for piece in pieces {
        let part = piece
            .arrays
            .iter()
            .find(|part| part.name == array.name && part.association == array.association)
            .filter(|p| p.components == array.components && p.scalar_type == array.scalar_type);
        let Some(part) = part else {
            return Err(header(
                format!("the array {} of one type in every piece", quoted(&array.name)),
                format!("a piece {:?} without it", piece.extent),
                "write the file again",
            ));
        };
        let piece_points = sizes(&piece.extent)?;
        if (0..3).any(|axis| piece_points[axis] == 1 && points[axis] > 1) {
            return Err(unsupported(
                "pieces of at least one cell along each axis",
                format!("{:?}", piece.extent),
                "write the image in one piece",
            ));
        }
        let part_sizes = array_sizes(part, piece_points);
        let wide = part_sizes.map(|n| n as u64);
        let count = bytes::checked_count("a piece", &wide, part.scalar_type, u64::MAX)?;
        parts.push((part_sizes, data::read(part, count, packing, appended, progress)?));
    }
    // Pieces far apart would ask for room that no file of theirs justifies.
    let held: usize = parts.iter().map(|(_, samples)| samples.len()).sum();
    if held < components * x * y * z {
        return Err(gap_between());
    }
    let mut whole = bytes::zero_samples(array.scalar_type, components * x * y * z)?;
    let mut is_filled = vec![false; x * y * z];
    for (piece, (part_sizes, samples)) in pieces.iter().zip(&parts) {
        let mut shift = [0; 3];
        for axis in 0..3 {
            // The box of all pieces starts no later than any of them.
            shift[axis] = usize::try_from(piece.extent[axis][0] - extent[axis][0]).unwrap_or(0);
        }
        let [_, nx, ny, nz] = *part_sizes;
        for k in 0..nz {
            progress.advance(0)?;
            for j in 0..ny {
                let from = (k * ny + j) * nx;
                let to = ((k + shift[2]) * y + j + shift[1]) * x + shift[0];
                is_filled[to..to + nx].fill(true);
                copy(samples, from * components, &mut whole, to * components, nx * components);
            }
        }
    }
    if is_filled.contains(&false) {
        return Err(gap_between());
    }
    Ok(whole)
}

fn gap_between() -> Problem {
    header("pieces that fill the image", "a gap between them", "write the image in one piece")
}

/// Copies a run between samples of the same type.
fn copy(from: &Samples, at: usize, to: &mut Samples, start: usize, count: usize) {
    macro_rules! copy {
        ($($kind:ident),*) => {
            match (from, to) {
                $((Samples::$kind(from), Samples::$kind(to)) => {
                    to[start..start + count].copy_from_slice(&from[at..at + count]);
                })*
                _ => unreachable!("pieces of another type were refused"),
            }
        };
    }
    copy!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64);
}

/// Puts the first array that the file calls active in front.
fn activate(fields: &mut [Field], active: &[(Association, String)]) {
    let place = active.iter().find_map(|(association, name)| {
        fields.iter().position(|f| f.association == *association && f.name == *name)
    });
    if let Some(place) = place {
        fields[..=place].rotate_right(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_type_is_found_behind_a_declaration_and_in_either_quotes() {
        let kind = |text: &str| file_type(text.as_bytes());
        assert_eq!(
            kind("<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\">"),
            Some("ImageData".into())
        );
        assert_eq!(kind("<VTKFile version='1' type='PolyData'>"), Some("PolyData".into()));
        assert_eq!(kind("<VTKFile>"), None);
        assert_eq!(kind("<svg type=\"ImageData\">"), None);
    }
}

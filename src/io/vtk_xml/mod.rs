//! VTK's XML of images (`.vti`), rectilinear (`.vtr`), structured (`.vts`) and unstructured (`.vtu`) grids and polygons
//! (`.vtp`); text, base64 or appended, plain, zlib, LZ4 or LZMA, in one piece or more, or in several files (`.pvtu`, `.pvtp`).

mod cells;
mod data;
mod pieces;
mod xml;

use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use self::data::{Appended, CountedBy, Packing};
use self::pieces::Store;
use self::xml::{Document, Kind};
use super::bytes::Progress;
use super::error::{Problem, header, quoted, truncated, unsupported};
use super::{Format, Opened, axes, files, unstructured};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Field, Grid, Shape};

/// The `type` of a VTK XML file, from its first bytes; `None` if it is none.
pub(super) fn file_type(start: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(start);
    let (_, tag) = text.split_once("<VTKFile")?;
    let tag = tag.split('>').next().unwrap_or_default();
    let (_, value) = tag.split_once("type=")?;
    let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    value[1..].split_once(quote).map(|(kind, _)| kind.to_owned())
}

/// The format of a VTK XML file of a type.
///
/// # Errors
/// A type that is not read.
pub(super) fn format_of(kind: &str) -> Result<Format, Problem> {
    match Kind::from_name(kind) {
        Some(Kind::Image) => Ok(Format::Vti),
        Some(Kind::Rectilinear) => Ok(Format::Vtr),
        Some(Kind::Structured) => Ok(Format::Vts),
        Some(Kind::Unstructured) => Ok(Format::Vtu),
        Some(Kind::PolyData) => Ok(Format::Vtp),
        Some(Kind::Parallel) => Ok(if kind == "PPolyData" { Format::Vtp } else { Format::Vtu }),
        None if kind == "Collection" => Err(unsupported(
            "one grid of VTK's XML",
            "a list of grids (.pvd)",
            "open one of the files that it names",
        )),
        None => Err(unsupported(
            "VTK XML of type \"ImageData\", \"RectilinearGrid\", \"StructuredGrid\", \"UnstructuredGrid\" or \"PolyData\"",
            quoted(kind),
            "resample the data to an image (.vti) first",
        )),
    }
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let (text, appended) = head(path, free_bytes, ticket)?;
    let mut document = Document::parse(&text, appended.start.is_some())?;
    let mut warnings = std::mem::take(&mut document.warnings);
    let store = Store { packing: packing(&document), appended };
    if document.kind.is_unstructured() {
        return cells::read(path, &document, &store, warnings, (free_bytes, ticket));
    }
    let extent = pieces::covered(&document, &mut warnings)?;
    let dims = pieces::sizes(&extent)?;
    let arrays = pieces::arrays(&document)?;
    let needed = pieces::needed_bytes(&document, &arrays, dims)?;
    memory::require("the arrays of the file", needed, free_bytes)?;

    let mut progress = Progress::new(ticket, needed);
    let mut fields = Vec::with_capacity(arrays.len());
    for array in arrays {
        let samples = pieces::field(array, &document.pieces, &extent, &store, &mut progress)?;
        fields.push(Field {
            name: array.name.clone(),
            components: usize::try_from(array.components).unwrap_or(usize::MAX),
            association: array.association,
            samples: Arc::new(samples),
        });
    }
    axes::activate(&mut fields, &document.active);
    let (grid, format) = match document.kind {
        Kind::Image => {
            let first = DVec3::from_array(extent.map(|[first, _]| first as f64));
            let (spacing, direction) = (document.spacing, document.direction);
            let origin = document.origin + direction * (spacing * first);
            let lattice = axes::lattice_of_spacing(dims, origin, spacing, direction, &mut warnings);
            (Grid::of(lattice, fields), Format::Vti)
        }
        Kind::Rectilinear => {
            let mut list =
                |axis| pieces::coordinates(axis, &document.pieces, &extent, &store, &mut progress);
            let lists = [list(0)?.into(), list(1)?.into(), list(2)?.into()];
            (Grid::shaped(dims, Shape::Rectilinear(lists), fields)?, Format::Vtr)
        }
        // The others were read above.
        Kind::Structured | Kind::Unstructured | Kind::PolyData | Kind::Parallel => {
            let points = pieces::points(&document.pieces, &extent, &store, &mut progress)?;
            let block = (axes::positions(&points), dims);
            let active = &document.active;
            let grid = unstructured::curvilinear(block, fields, active, free_bytes, &mut warnings)?;
            warnings.extend(unstructured::points_alone(&grid));
            (grid, Format::Vts)
        }
    };
    Ok(Opened::of(grid, format, warnings))
}

fn packing(document: &Document<'_>) -> Packing {
    Packing {
        endian: document.endian,
        word_bytes: document.word_bytes,
        compressor: document.compressor,
        counted_by: match document.kind.is_unstructured() {
            true => CountedBy::Piece,
            false => CountedBy::Extent,
        },
    }
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

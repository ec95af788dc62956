//! Arrays over all pieces of a file: their sizes, and putting them together.

use super::super::bytes::{self, Progress};
use super::super::error::{Problem, header, quoted, truncated, unsupported};
use super::data::{self, Appended, Packing};
use super::xml::{Array, Document, Extent, KNOWN_TYPES, Kind, Piece};
use crate::volume::{Association, Samples, ScalarType};

/// Where a file's numbers are, and how they are written.
pub(super) struct Store<'a> {
    pub(super) packing: Packing,
    pub(super) appended: Appended<'a>,
}

/// Points along each axis of an extent.
pub(super) fn sizes(extent: &Extent) -> Result<[usize; 3], Problem> {
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
pub(super) fn array_sizes(array: &Array<'_>, points: [usize; 3]) -> [usize; 4] {
    let [x, y, z] = match array.association {
        Association::Point => points,
        Association::Cell => points.map(|n| n.saturating_sub(1).max(1)),
    };
    [usize::try_from(array.components).unwrap_or(usize::MAX), x, y, z]
}

/// The box of all pieces, which they must fill.
pub(super) fn covered(
    document: &Document<'_>,
    warnings: &mut Vec<String>,
) -> Result<Extent, Problem> {
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
pub(super) fn arrays<'d, 'a>(document: &'d Document<'a>) -> Result<Vec<&'d Array<'a>>, Problem> {
    let arrays: Vec<&Array<'_>> =
        document.pieces.first().map(|piece| piece.arrays.iter().collect()).unwrap_or_default();
    if arrays.is_empty() {
        return Err(unsupported(
            format!(
                "at least one array of numbers on points or cells, of a type that is {KNOWN_TYPES}"
            ),
            "none",
            "write the file again with its data",
        ));
    }
    Ok(arrays)
}

/// Bytes of all arrays and of what places the points, and of one more array where pieces are put together.
pub(super) fn needed_bytes(
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
    // Points as read, and as they are kept.
    if document.kind == Kind::Structured {
        let points = dims.map(|n| n as u64);
        let count = bytes::checked_count("the points", &points, ScalarType::UInt8, u64::MAX)?;
        needed = needed.saturating_add((count as u64).saturating_mul(2 * 24));
    }
    let copies = if document.pieces.len() > 1 { largest.saturating_mul(2) } else { 0 };
    Ok(needed.saturating_add(copies))
}

/// A field's array over all pieces.
pub(super) fn field(
    array: &Array<'_>,
    pieces: &[Piece<'_>],
    extent: &Extent,
    store: &Store<'_>,
    progress: &mut Progress<'_>,
) -> Result<Samples, Problem> {
    let of_piece = |piece: &'_ Piece<'_>| {
        let is_same = |p: &Array<'_>| p.name == array.name && p.association == array.association;
        piece.arrays.iter().position(is_same)
    };
    let parts = pieces.iter().map(|piece| of_piece(piece).map(|at| &piece.arrays[at]));
    whole(array, pieces, parts.collect(), extent, store, progress)
}

/// The points of a structured grid, three components each.
pub(super) fn points(
    pieces: &[Piece<'_>],
    extent: &Extent,
    store: &Store<'_>,
    progress: &mut Progress<'_>,
) -> Result<Samples, Problem> {
    let first = geometry_of(pieces, 1)?[0];
    if first.components != 3 {
        return Err(header(
            "points of three components",
            first.components.to_string(),
            "correct NumberOfComponents of the points, or write the file again",
        ));
    }
    let parts = pieces.iter().map(|piece| piece.geometry.first()).collect();
    whole(first, pieces, parts, extent, store, progress)
}

/// The coordinates along one axis of a rectilinear grid.
pub(super) fn coordinates(
    axis: usize,
    pieces: &[Piece<'_>],
    extent: &Extent,
    store: &Store<'_>,
    progress: &mut Progress<'_>,
) -> Result<Vec<f64>, Problem> {
    let count = sizes(extent)?[axis];
    let mut all = vec![None; count];
    for piece in pieces {
        let array = geometry_of(std::slice::from_ref(piece), 3)?[axis];
        if array.components != 1 {
            return Err(header(
                "coordinates of one component",
                array.components.to_string(),
                "correct NumberOfComponents of the coordinates, or write the file again",
            ));
        }
        let n = sizes(&piece.extent)?[axis];
        let samples = data::read(array, n, store.packing, &store.appended, progress)?;
        let shift = usize::try_from(piece.extent[axis][0] - extent[axis][0]).unwrap_or(0);
        for i in 0..n {
            all[shift + i] = Some(samples.get(i));
        }
    }
    all.into_iter().collect::<Option<Vec<f64>>>().ok_or_else(gap_between)
}

/// The first piece's arrays of coordinates or points, of which there must be `count`.
fn geometry_of<'d, 'a>(
    pieces: &'d [Piece<'a>],
    count: usize,
) -> Result<Vec<&'d Array<'a>>, Problem> {
    let found: Vec<&Array<'_>> =
        pieces.first().map(|piece| piece.geometry.iter().collect()).unwrap_or_default();
    if found.len() == count {
        return Ok(found);
    }
    let expected = if count == 3 {
        "three arrays in the element Coordinates"
    } else {
        "one array in the element Points"
    };
    Err(header(expected, found.len().to_string(), "copy or write the file again"))
}

/// One array over all pieces, of which `parts` has each one's.
fn whole(
    array: &Array<'_>,
    pieces: &[Piece<'_>],
    found: Vec<Option<&Array<'_>>>,
    extent: &Extent,
    store: &Store<'_>,
    progress: &mut Progress<'_>,
) -> Result<Samples, Problem> {
    if let [piece] = pieces {
        let count = array_sizes(array, sizes(&piece.extent)?).iter().product();
        return data::read(array, count, store.packing, &store.appended, progress);
    }
    let points = sizes(extent)?;
    let [components, x, y, z] = array_sizes(array, points);
    // Every piece is decoded, and so shown to be in the file, before room for the whole is taken.
    let mut parts = Vec::with_capacity(pieces.len());
    for (piece, part) in pieces.iter().zip(found) {
        let part =
            part.filter(|p| p.components == array.components && p.scalar_type == array.scalar_type);
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
                "write the data in one piece",
            ));
        }
        let part_sizes = array_sizes(part, piece_points);
        let wide = part_sizes.map(|n| n as u64);
        let count = bytes::checked_count("a piece", &wide, part.scalar_type, u64::MAX)?;
        parts
            .push((part_sizes, data::read(part, count, store.packing, &store.appended, progress)?));
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
    header("pieces that fill the grid", "a gap between them", "write the data in one piece")
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

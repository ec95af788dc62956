//! What readers of cells share: numbers of a file as checked lists, pieces joined, and the grid made of them.

mod told;

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::DVec3;

use super::axes;
use super::bytes::{DEFLATE_MOST, no_samples, reserve_samples};
use super::error::{Problem, header, quoted, truncated, unsupported};
use crate::cells::{Cells, CellsError, Listing, has_extent};
use crate::core::counted;
use crate::core::memory::{self, TooLarge};
use crate::volume::{Association, Field, Grid, Samples, ScalarType, Shape};

pub(super) use told::{
    EMBED_THEM, THINNER_THAN_A_PIXEL, holds_colours, in_short, points_alone, tell_apart,
};

/// VTK's numbers of cells (`vtkCellType.h`), of those that readers name themselves.
pub(super) mod kind {
    pub(in super::super) const EMPTY: u8 = 0;
    pub(in super::super) const VERTEX: u8 = 1;
    pub(in super::super) const POLY_VERTEX: u8 = 2;
    pub(in super::super) const LINE: u8 = 3;
    pub(in super::super) const POLY_LINE: u8 = 4;
    pub(in super::super) const TRIANGLE: u8 = 5;
    pub(in super::super) const TRIANGLE_STRIP: u8 = 6;
    pub(in super::super) const POLYGON: u8 = 7;
    pub(in super::super) const QUAD: u8 = 9;
    pub(in super::super) const HEXAHEDRON: u8 = 12;
    pub(in super::super) const POLYHEDRON: u8 = 42;
}

/// Coordinates farther from 0 have no volume that 64 bits hold.
const FARTHEST: f64 = 1e100;
/// Points within less have no volume that 64 bits hold.
const NARROWEST: f64 = 1e-100;
/// Bytes of a point while it is read and joined, and as it is kept.
const POINT_BYTES: u64 = 72;
/// Bytes of a cell's type and start, twice.
const CELL_BYTES: u64 = 18;
/// Bytes of a solid that a cell becomes, and of lists that grow.
const SOLID_BYTES: u64 = 96;
/// Bytes of a corner: as stored with 64 bits, and as it is kept, twice.
const CORNER_BYTES: u64 = 16;

/// Points, cells on them and arrays: a file's, or one piece's of it.
#[derive(Debug, Clone, Default)]
pub(super) struct Part {
    pub(super) listing: Listing,
    pub(super) fields: Vec<Field>,
}

impl Part {
    /// Bytes that it takes until it is a grid.
    pub(super) fn bytes(&self) -> u64 {
        let Listing { points, types, corners, .. } = &self.listing;
        let [points, cells, corners] = [points.len(), types.len(), corners.len()].map(|n| n as u64);
        let of_field =
            |field: &Field| (field.samples.len() * field.samples.scalar_type().size_bytes()) as u64;
        bytes_of(points, cells, corners) + self.fields.iter().map(of_field).sum::<u64>()
    }
}

/// How a list of corners is made of cells that are all alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Group {
    /// Types are told beside.
    Cells,
    /// Points.
    Vertices,
    /// Lines of two points or more.
    Lines,
    /// Triangles, squares and polygons.
    Polygons,
    /// Strips of triangles.
    Strips,
}

impl Group {
    /// VTK's number for a cell of so many corners.
    pub(super) fn kind_of(self, corners: usize) -> u8 {
        match (self, corners) {
            (Self::Vertices, 0..=1) => kind::VERTEX,
            (Self::Vertices, _) => kind::POLY_VERTEX,
            (Self::Lines, 0..=2) => kind::LINE,
            (Self::Lines, _) => kind::POLY_LINE,
            (Self::Strips, _) => kind::TRIANGLE_STRIP,
            (_, 3) => kind::TRIANGLE,
            (_, 4) => kind::QUAD,
            _ => kind::POLYGON,
        }
    }
}

/// Refuses counts that no memory holds, before anything is allocated for them.
pub(super) fn require_memory(
    points: u64,
    cells: u64,
    corners: u64,
    free_bytes: u64,
) -> Result<(), Problem> {
    check_number("points", points)?;
    check_number("cells", cells)?;
    let needed = bytes_of(points, cells, corners);
    Ok(memory::require("the points and cells of the file", needed, free_bytes)?)
}

/// Refuses counts that a file of so many bytes cannot hold, however well it is packed.
pub(super) fn require_stored(points: u64, cells: u64, len: u64) -> Result<(), Problem> {
    if points.max(cells) <= len.saturating_mul(DEFLATE_MOST) {
        return Ok(());
    }
    Err(truncated(
        format!("{points} points and {cells} cells, as the file promises"),
        format!("{len} bytes in all"),
        "it was cut short, or a count is wrong: copy or write it again",
    ))
}

/// Bytes that points, cells and corners take until they are a grid.
pub(super) fn bytes_of(points: u64, cells: u64, corners: u64) -> u64 {
    points
        .saturating_mul(POINT_BYTES)
        .saturating_add(cells.saturating_mul(CELL_BYTES + SOLID_BYTES))
        .saturating_add(corners.saturating_mul(CORNER_BYTES))
}

/// Numbers of points and cells have 32 bits.
pub(super) fn check_number(what: &str, count: u64) -> Result<(), Problem> {
    if count < u64::from(u32::MAX) {
        return Ok(());
    }
    Err(unsupported(
        format!("fewer than 2^32 {what}"),
        count.to_string(),
        "correct the number, or extract a part of the data first",
    ))
}

/// Triples of numbers as places.
pub(super) fn places(triples: &Samples) -> Vec<DVec3> {
    axes::positions(triples).to_vec()
}

/// Whole numbers of a file, whatever their type; the reader has refused others.
pub(super) fn whole_numbers(samples: &Samples) -> Vec<i64> {
    macro_rules! wide {
        ($($kind:ident),*) => {
            match samples {
                $(Samples::$kind(values) => {
                    values.iter().map(|v| i64::try_from(*v).unwrap_or(i64::MAX)).collect()
                })*
                Samples::Float32(_) | Samples::Float64(_) => Vec::new(),
            }
        };
    }
    wide!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64)
}

/// Refuses numbers of points or cells that are no whole numbers.
pub(super) fn check_whole(what: &str, scalar_type: ScalarType) -> Result<(), Problem> {
    if !matches!(scalar_type, ScalarType::Float32 | ScalarType::Float64) {
        return Ok(());
    }
    Err(header(
        format!("{what} of a type of whole numbers"),
        scalar_type.name(),
        "correct the type, or write the file again",
    ))
}

/// Corners as numbers of points.
///
/// # Errors
/// The first that is no point.
pub(super) fn corners(numbers: &[i64], points: usize) -> Result<Vec<u32>, Problem> {
    let mut corners = reserved("the corners of cells", numbers.len())?;
    extend_corners(&mut corners, numbers, points)?;
    Ok(corners)
}

fn extend_corners(corners: &mut Vec<u32>, numbers: &[i64], points: usize) -> Result<(), Problem> {
    let before = corners.len();
    for (at, number) in numbers.iter().enumerate() {
        let corner = usize::try_from(*number).ok().filter(|corner| *corner < points);
        let Some(corner) = corner.and_then(|corner| u32::try_from(corner).ok()) else {
            return Err(beyond_points(*number, before + at, points));
        };
        corners.push(corner);
    }
    Ok(())
}

fn beyond_points(number: i64, at: usize, points: usize) -> Problem {
    let expected = match points {
        0 => "no corners where there are no points".to_owned(),
        _ => format!("corners of cells that are points, 0 to {}", points - 1),
    };
    header(
        expected,
        format!("{number} as number {at} of the connectivity"),
        "the file was altered or cut short: copy or write it again",
    )
}

/// An empty list with room for so many entries.
pub(super) fn reserved<T>(what: &str, count: usize) -> Result<Vec<T>, Problem> {
    let mut list = Vec::new();
    list.try_reserve_exact(count).map_err(|_refused| {
        let needed_bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
        TooLarge { what: what.into(), needed_bytes, free_bytes: 0 }
    })?;
    Ok(list)
}

/// Where the corners of each cell begin, and the end, from where each cell's end; with or without the 0 that the first begins
/// at.
///
/// # Errors
/// Offsets that are too few or too many, that fall, or that end elsewhere than the corners do.
pub(super) fn starts(offsets: &[i64], cells: usize, corners: usize) -> Result<Vec<usize>, Problem> {
    let ends = match offsets.len() {
        n if n == cells => offsets,
        n if n == cells + 1 && offsets[0] == 0 => &offsets[1..],
        n => {
            return Err(header(
                format!("an offset for each of {cells} cells"),
                n.to_string(),
                "the file was altered: copy or write it again",
            ));
        }
    };
    let mut starts: Vec<usize> = reserved("the offsets of cells", cells + 1)?;
    starts.push(0);
    let mut before = 0;
    for (cell, end) in ends.iter().enumerate() {
        let found = usize::try_from(*end).ok().filter(|end| (before..=corners).contains(end));
        let Some(end) = found else {
            return Err(header(
                format!("offsets of cells that rise, up to {corners} corners"),
                format!("{end} after {before} for cell {cell}"),
                "the file was altered: copy or write it again",
            ));
        };
        starts.push(end);
        before = end;
    }
    if before != corners {
        return Err(header(
            format!("offsets that end with the connectivity, at {corners}"),
            before.to_string(),
            "one of the two was cut short: copy or write the file again",
        ));
    }
    Ok(starts)
}

/// The corners of cells written as a count and so many numbers, one cell after another; polyhedra as a count of faces, each
/// such a list.
///
/// # Errors
/// Counts that do not end with the numbers, and corners that are no points.
pub(super) fn add_counted(
    listing: &mut Listing,
    numbers: &[i64],
    (group, types, cells): (Group, &[u8], usize),
) -> Result<(), Problem> {
    let points = listing.points.len();
    if listing.starts.is_empty() {
        listing.starts.push(0);
    }
    let mut at = 0;
    for cell in 0..cells {
        let count = numbers.get(at).and_then(|count| usize::try_from(*count).ok());
        let own = count.and_then(|count| numbers.get(at + 1..(at + 1).checked_add(count)?));
        let Some(own) = own else {
            return Err(header(
                format!("{cells} cells in {} numbers", numbers.len()),
                format!("that cell {cell} ends beyond them"),
                "a count before it is wrong, or the file was cut short: copy or write it again",
            ));
        };
        let kind = types.get(cell).copied().unwrap_or_else(|| group.kind_of(own.len()));
        add(listing, kind, own, points)?;
        at += 1 + own.len();
    }
    if at == numbers.len() {
        return Ok(());
    }
    Err(header(
        format!("{cells} cells that end with their {} numbers", numbers.len()),
        format!("that they end after {at}"),
        "correct one of the two, or write the file again",
    ))
}

/// Cells whose corners lie between starts; polyhedra as streams of faces.
///
/// # Errors
/// Corners that are no points.
pub(super) fn add_parted(
    listing: &mut Listing,
    numbers: &[i64],
    starts: &[usize],
    (group, types): (Group, &[u8]),
) -> Result<(), Problem> {
    let points = listing.points.len();
    if listing.starts.is_empty() {
        listing.starts.push(0);
    }
    for (cell, pair) in starts.windows(2).enumerate() {
        let own = &numbers[pair[0]..pair[1]];
        let kind = types.get(cell).copied().unwrap_or_else(|| group.kind_of(own.len()));
        add(listing, kind, own, points)?;
    }
    Ok(())
}

/// One cell behind the others.
fn add(listing: &mut Listing, kind: u8, own: &[i64], points: usize) -> Result<(), Problem> {
    if kind == kind::POLYHEDRON {
        let faces = faces_of(own, points, listing.types.len())?;
        add_polyhedron(listing, faces);
        return Ok(());
    }
    extend_corners(&mut listing.corners, own, points)?;
    listing.types.push(kind);
    listing.starts.push(listing.corners.len());
    Ok(())
}

/// VTK's types of cells, which have a byte.
pub(super) fn types(numbers: &[i64]) -> Result<Vec<u8>, Problem> {
    let one = |number: &i64| {
        u8::try_from(*number).map_err(|_beyond| {
            header(
                "types of cells from 0 to 255",
                number.to_string(),
                "the file was altered, or a count before it is wrong: copy it again",
            )
        })
    };
    numbers.iter().map(one).collect()
}

/// The faces of a polyhedron from a count of faces, each a count and so many points.
pub(super) fn faces_of(
    numbers: &[i64],
    points: usize,
    cell: usize,
) -> Result<Vec<Vec<u32>>, Problem> {
    let wrong = || {
        header(
            format!("faces of polyhedron {cell} that end with its {} numbers", numbers.len()),
            "other counts",
            "the file was altered: copy or write it again",
        )
    };
    let (count, mut rest) = numbers.split_first().ok_or_else(wrong)?;
    let mut faces = Vec::new();
    for _ in 0..*count {
        let (size, behind) = rest.split_first().ok_or_else(wrong)?;
        let size = usize::try_from(*size).ok().filter(|size| *size <= behind.len());
        let (own, behind) = behind.split_at(size.ok_or_else(wrong)?);
        faces.push(corners(own, points)?);
        rest = behind;
    }
    if rest.is_empty() { Ok(faces) } else { Err(wrong()) }
}

/// Refuses faces of polyhedra, by their numbers among `all`, that no memory holds, before anything is allocated for them: each takes
/// its own however often it is named. `taken` are bytes of those before.
pub(super) fn require_faces<'a>(
    all: &[Vec<i64>],
    numbers: impl Iterator<Item = &'a i64>,
    (taken, free_bytes): (&mut u64, u64),
) -> Result<(), Problem> {
    let face = |number: &i64| usize::try_from(*number).ok().and_then(|number| all.get(number));
    for number in numbers {
        let corners = face(number).map_or(0, Vec::len) as u64;
        *taken = taken.saturating_add(size_of::<Vec<u32>>() as u64 + corners * CORNER_BYTES);
    }
    Ok(memory::require("the faces of polyhedra", *taken, free_bytes)?)
}

/// The faces of a polyhedron by their numbers among `all`.
///
/// # Errors
/// Numbers that no face has, and corners that are no points.
pub(super) fn faces_among(
    all: &[Vec<i64>],
    numbers: &[i64],
    (cell, points): (usize, usize),
) -> Result<Vec<Vec<u32>>, Problem> {
    let face = |number: &i64| {
        let own = usize::try_from(*number).ok().and_then(|number| all.get(number));
        let own = own.ok_or_else(|| {
            header(
                format!("faces from 0 to {}", all.len() as i64 - 1),
                format!("{number} of polyhedron {cell}"),
                "the file was altered: copy or write it again",
            )
        })?;
        corners(own, points)
    };
    numbers.iter().map(face).collect()
}

/// One polyhedron behind the other cells.
pub(super) fn add_polyhedron(listing: &mut Listing, faces: Vec<Vec<u32>>) {
    listing.corners.extend(corners_of_faces(&faces));
    listing.faces.insert(listing.types.len(), faces);
    listing.types.push(kind::POLYHEDRON);
    listing.starts.push(listing.corners.len());
}

/// The points of faces, each once, in the order in which they come.
fn corners_of_faces(faces: &[Vec<u32>]) -> Vec<u32> {
    let mut found = Vec::new();
    let mut seen = std::collections::HashSet::new();
    for point in faces.iter().flatten() {
        if seen.insert(*point) {
            found.push(*point);
        }
    }
    found
}

/// Pieces one after another: points, cells with their corners moved on, and the arrays that all of them have.
///
/// # Errors
/// More points or cells than have numbers.
pub(super) fn joined(parts: Vec<Part>, warnings: &mut Vec<String>) -> Result<Part, Problem> {
    // Pieces of nothing, as parallel writers leave them, have arrays of nothing.
    let has_any = |part: &Part| !(part.listing.points.is_empty() && part.listing.types.is_empty());
    let mut parts: Vec<Part> = parts.into_iter().filter(has_any).collect();
    if parts.len() < 2 {
        return Ok(parts.pop().unwrap_or_default());
    }
    let count = |of: fn(&Part) -> usize| parts.iter().map(of).sum::<usize>();
    let points = count(|part| part.listing.points.len());
    let cells = count(|part| part.listing.types.len());
    check_number("points", points as u64)?;
    check_number("cells", cells as u64)?;
    let fields = joined_fields(&parts, warnings)?;
    let mut whole = Listing { starts: vec![0], ..Listing::default() };
    whole.points = reserved("the points", points)?;
    whole.types = reserved("the cells", cells)?;
    whole.corners = reserved("the corners", count(|part| part.listing.corners.len()))?;
    for part in parts {
        let Listing { points, types, starts, corners, faces } = part.listing;
        #[expect(clippy::cast_possible_truncation, reason = "all points have fewer than 2^32")]
        let shift = whole.points.len() as u32;
        let (first_cell, first_corner) = (whole.types.len(), whole.corners.len());
        whole.points.extend(points);
        whole.types.extend(types);
        whole.starts.extend(starts.iter().skip(1).map(|start| start + first_corner));
        whole.corners.extend(corners.iter().map(|corner| corner + shift));
        let moved = |face: Vec<u32>| face.into_iter().map(|point| point + shift).collect();
        whole.faces.extend(
            faces
                .into_iter()
                .map(|(cell, faces)| (cell + first_cell, faces.into_iter().map(moved).collect())),
        );
    }
    Ok(Part { listing: whole, fields })
}

fn joined_fields(parts: &[Part], warnings: &mut Vec<String>) -> Result<Vec<Field>, Problem> {
    let Some((first, rest)) = parts.split_first() else { return Ok(Vec::new()) };
    let ignored = |name: &str| {
        format!("the array {} is ignored: not every piece has it of one type", quoted(name))
    };
    let mut fields = Vec::new();
    for field in &first.fields {
        let same = |other: &&Field| {
            other.name == field.name
                && other.association == field.association
                && other.components == field.components
                && other.samples.scalar_type() == field.samples.scalar_type()
        };
        let others: Option<Vec<&Field>> =
            rest.iter().map(|part| part.fields.iter().find(same)).collect();
        let Some(others) = others else {
            warnings.push(ignored(&field.name));
            continue;
        };
        let all = others.iter().map(|other| other.samples.len()).sum::<usize>();
        let mut samples = no_samples(field.samples.scalar_type());
        reserve_samples(&mut samples, field.samples.len() + all)?;
        for part in std::iter::once(&field).chain(&others) {
            append(&mut samples, &part.samples);
        }
        fields.push(Field { samples: Arc::new(samples), ..field.clone() });
    }
    let is_in_first = |other: &Field| {
        let is_it =
            |field: &Field| (&field.name, field.association) == (&other.name, other.association);
        first.fields.iter().any(is_it)
    };
    let others = rest.iter().flat_map(|part| &part.fields).filter(|field| !is_in_first(field));
    let others: BTreeSet<&str> = others.map(|field| field.name.as_str()).collect();
    warnings.extend(others.into_iter().map(ignored));
    Ok(fields)
}

/// Samples behind others of the same type.
pub(super) fn append(to: &mut Samples, from: &Samples) {
    macro_rules! append {
        ($($kind:ident),*) => {
            match (to, from) {
                $((Samples::$kind(to), Samples::$kind(from)) => to.extend_from_slice(from),)*
                _ => unreachable!("arrays of another type were left out"),
            }
        };
    }
    append!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64);
}

/// The grid of a file: its cells checked and split, and something to show where it has no array.
///
/// # Errors
/// No point, more memory than is free, and cells that cannot be.
pub(super) fn grid(
    part: Part,
    active: &[(Association, String)],
    free_bytes: u64,
    warnings: &mut Vec<String>,
) -> Result<Grid, Problem> {
    let Part { mut listing, mut fields } = part;
    if listing.starts.is_empty() {
        listing.starts.push(0);
    }
    let (points, cells) = (listing.points.len(), listing.types.len());
    if points == 0 {
        return Err(header("at least one point", "none", "write the file again with its points"));
    }
    let finite = || listing.points.iter().filter(|point| point.is_finite());
    if finite().next().is_none() {
        let lie = if points == 1 { "lies" } else { "lie" };
        return Err(header(
            "at least one point at a finite place",
            format!("{} that {lie} nowhere (NaN or infinite)", counted(points, "point")),
            "write the file again with its places",
        ));
    }
    let farthest = finite().map(|point| point.abs().max_element()).fold(0.0, f64::max);
    if farthest > FARTHEST {
        return Err(header(
            format!("coordinates within {FARTHEST:e} of 0, whose volumes have a number"),
            format!("{farthest:e}"),
            "write them in a greater unit",
        ));
    }
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [low, high] = finite().fold(none, |[low, high], at| [low.min(*at), high.max(*at)]);
    let width = (high - low).max_element();
    if width > 0.0 && width < NARROWEST {
        return Err(header(
            format!("points over more than {NARROWEST:e}, whose volumes have a number"),
            format!("all of them within {width:e}"),
            "write them in a smaller unit",
        ));
    }
    // Those that are empty by themselves are told before ghosts are made so.
    warnings.extend(told::empty_cells(&listing.types));
    warnings.extend(leave_out_ghosts(&mut listing, &mut fields));
    let solids = solids_most(&listing);
    let needed = solids.saturating_mul(SOLID_BYTES).saturating_add(points as u64 * POINT_BYTES);
    memory::require("the cells of the file, split into simple ones", needed, free_bytes)?;
    // What lies on no cell is no field.
    fields.retain(|field| !field.samples.is_empty());
    tell_apart(&mut fields, warnings);
    let polygons = told::flat_cells(&listing.types);
    warnings.extend(told::thin_cells(&listing.types));
    warnings.extend(told::open_polyhedra(&listing));
    warnings.extend(told::straightened(&listing, &fields));
    let have_extent = listing.types.iter().any(|kind| has_extent(*kind));
    if !have_extent {
        warnings.extend(told::nowhere(&listing));
        warnings.extend(told::coincident(&listing.points));
    }
    told::in_order(&mut fields);
    axes::activate(&mut fields, active);
    if fields.is_empty() {
        // Vertices and lines, no cells at all, or none that lies anywhere: what points have themselves is how dense they lie.
        let lie_nowhere = told::lie_nowhere(&listing);
        let are_points_alone = lie_nowhere || !have_extent;
        let is_surface = told::are_surface(&listing.types) && !lie_nowhere;
        fields.push(match are_points_alone {
            // They colour nothing, so that nothing is to be said of them.
            _ if is_surface => told::numbers(points, cells, &mut Vec::new()),
            true => told::density(&listing.points, warnings),
            false => told::numbers(points, cells, warnings),
        });
    }
    let cells = Cells::new(listing).map_err(no_cells)?;
    let left_out = cells.census().not_finite;
    // Of points it was told.
    if left_out > 0 && have_extent {
        warnings.push(format!(
            "{} with corners that lie nowhere (NaN or infinite): left out",
            counted(left_out, "cell")
        ));
    }
    // Beside cells with volume they are left out.
    warnings.extend(polygons.filter(|_| !cells.is_surface()));
    warnings.extend(told::as_polygons(&cells));
    warnings.extend(told::thin(&cells));
    Ok(Grid::shaped([points, 1, 1], Shape::Unstructured(Arc::new(cells)), fields)?)
}

/// Empties the cells that VTK marks as ghosts: those that another piece has, too (1), and hidden ones (32). What marks them
/// is no field.
fn leave_out_ghosts(listing: &mut Listing, fields: &mut Vec<Field>) -> Option<String> {
    const LEFT_OUT: i64 = 1 | 32;
    let is_mark = |field: &Field| field.name == "vtkGhostType" && field.components == 1;
    let of_cells = fields
        .iter()
        .find(|field| is_mark(field) && field.association == Association::Cell)
        .map(|field| whole_numbers(&field.samples));
    fields.retain(|field| !is_mark(field));
    let mut count = 0;
    for (kind, mark) in listing.types.iter_mut().zip(of_cells?) {
        if mark & LEFT_OUT != 0 {
            *kind = kind::EMPTY;
            count += 1;
        }
    }
    let verb = if count == 1 { "is a ghost" } else { "are ghosts" };
    (count > 0).then(|| {
        format!(
            "{} {verb} of another piece, or hidden (vtkGhostType): left out",
            counted(count, "cell")
        )
    })
}

/// The grid of a block of points. Where some of them lie nowhere its cells are listed, so that those there can be left out.
///
/// # Errors
/// See [`grid`]; points of a surface that lie nowhere, too.
pub(super) fn curvilinear(
    (points, dims): (Arc<[DVec3]>, [usize; 3]),
    fields: Vec<Field>,
    active: &[(Association, String)],
    free_bytes: u64,
    warnings: &mut Vec<String>,
) -> Result<Grid, Problem> {
    let is_whole = points.len() == dims.iter().product::<usize>();
    let is_solid = dims.iter().all(|n| *n > 1);
    if !is_whole || !is_solid || points.iter().all(|point| point.is_finite()) {
        return Ok(Grid::shaped(dims, Shape::Curvilinear(points), fields)?);
    }
    let cells = dims.iter().map(|n| n - 1).product::<usize>() as u64;
    require_memory(points.len() as u64, cells, 8 * cells, free_bytes)?;
    let mut listing = Listing { points: points.to_vec(), ..Listing::default() };
    add_block(&mut listing, dims);
    grid(Part { listing, fields }, active, free_bytes, warnings)
}

/// The cells between a block's points: hexahedra, or squares where it is flat.
pub(super) fn add_block(listing: &mut Listing, dims: [usize; 3]) {
    let strides = [1, dims[0], dims[0] * dims[1]];
    let wide: Vec<usize> =
        (0..3).filter(|axis| dims[*axis] > 1).map(|axis| strides[axis]).collect();
    let (corners, kind): (Vec<usize>, u8) = match wide[..] {
        [x, y, z] => (vec![0, x, x + y, y, z, z + x, z + x + y, z + y], kind::HEXAHEDRON),
        [x, y] => (vec![0, x, x + y, y], kind::QUAD),
        [x] => (vec![0, x], kind::LINE),
        _ => (vec![0], kind::VERTEX),
    };
    let cells = dims.map(|n| n.saturating_sub(1).max(1));
    if listing.starts.is_empty() {
        listing.starts.push(0);
    }
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let first = x + y * strides[1] + z * strides[2];
                #[expect(
                    clippy::cast_possible_truncation,
                    reason = "fewer than 2^32 points were checked"
                )]
                listing.corners.extend(corners.iter().map(|corner| (first + corner) as u32));
                listing.types.push(kind);
                listing.starts.push(listing.corners.len());
            }
        }
    }
}

/// What is said of cells that cannot be.
pub(super) fn no_cells(error: CellsError) -> Problem {
    header(error.expected, error.found, error.advice)
}

/// As many solids as the cells can become at most.
fn solids_most(listing: &Listing) -> u64 {
    let (mut all, starts) = (0_u64, &listing.starts);
    for (cell, kind) in listing.types.iter().enumerate() {
        let own = starts[cell + 1].saturating_sub(starts[cell]) as u64;
        all += match kind {
            10..=14 => 1,
            15..=16 => 6,
            24..=29 | 31 | 32 => 10,
            71 => 6 * own,
            73 => 2 * own,
            // A tetrahedron for each corner of each face.
            42 => {
                listing.faces.get(&cell).map_or(0, |faces| faces.iter().map(Vec::len).sum()) as u64
            }
            // No more than points.
            _ => own,
        };
    }
    all
}

/// A field of a name.
pub(super) fn field_of(
    name: impl Into<String>,
    (components, association): (usize, Association),
    samples: Samples,
) -> Field {
    Field { name: name.into(), components, association, samples: Arc::new(samples) }
}

/// Numbers in planes, one component behind another, as tuples.
pub(super) fn interleaved(planes: &Samples, components: usize) -> Samples {
    macro_rules! interleave {
        ($($kind:ident),*) => {
            match planes {
                $(Samples::$kind(values) => {
                    let count = values.len() / components;
                    let at = |i: usize| values[i % components * count + i / components];
                    Samples::$kind((0..count * components).map(at).collect())
                })*
            }
        };
    }
    interleave!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64)
}

/// A run of samples.
pub(super) fn run(samples: &Samples, range: std::ops::Range<usize>) -> Samples {
    macro_rules! run {
        ($($kind:ident),*) => {
            match samples {
                $(Samples::$kind(from) => Samples::$kind(from[range].to_vec()),)*
            }
        };
    }
    run!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64)
}

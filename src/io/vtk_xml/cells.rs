//! Unstructured grids and polygons: pieces of a file, or of the files that another one names, one after another.

use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use super::super::bytes::{self, Progress};
use super::super::error::{Problem, header, quoted};
use super::super::files::DataFile;
use super::super::unstructured::{self, Group, Part};
use super::super::{Format, Opened};
use super::data;
use super::pieces::Store;
use super::xml::{Array, Document, Kind, Piece};
use crate::cells::Listing;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Samples};

/// The pieces of a document as one grid.
pub(super) fn read(
    path: &Path,
    document: &Document<'_>,
    store: &Store<'_>,
    mut warnings: Vec<String>,
    (free_bytes, ticket): (u64, &Ticket),
) -> Result<Opened, Problem> {
    let mut active = document.active.clone();
    let (parts, format) = match document.kind {
        Kind::Parallel if document.pieces.is_empty() => {
            return Err(header(
                "at least one Piece, which is a file of its own",
                "none",
                "write the file again, or open a file of its cells (.vtu, .vtp)",
            ));
        }
        Kind::Parallel => {
            let (parts, format, told) =
                of_files(path, document, &mut warnings, free_bytes, ticket)?;
            active = told;
            (parts, format)
        }
        kind => {
            let format = if kind == Kind::PolyData { Format::Vtp } else { Format::Vtu };
            (of_document(document, store, free_bytes, ticket)?, format)
        }
    };
    let whole = unstructured::joined(parts, &mut warnings)?;
    let grid = unstructured::grid(whole, &active, free_bytes, &mut warnings)?;
    warnings.extend(unstructured::points_alone(&grid));
    Ok(Opened::of(grid, format, warnings))
}

/// Refuses a file that is named as two pieces, before any of them is read: its cells would lie in each other.
fn refuse_twins(document: &Document<'_>) -> Result<(), Problem> {
    let mut seen = HashSet::new();
    for source in document.pieces.iter().filter_map(|piece| piece.source.as_deref()) {
        let parts = Path::new(source).components().filter(|part| *part != Component::CurDir);
        if !seen.insert(parts.collect::<PathBuf>()) {
            return Err(header(
                "a file of its own for every piece",
                format!("the piece {} twice", quoted(source)),
                "name each piece once",
            ));
        }
    }
    Ok(())
}

/// The pieces in the files that a document names, beside it.
#[expect(clippy::type_complexity, reason = "pieces, what they are, and their active arrays")]
fn of_files(
    path: &Path,
    document: &Document<'_>,
    warnings: &mut Vec<String>,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<(Vec<Part>, Format, Vec<(Association, String)>), Problem> {
    refuse_twins(document)?;
    let (mut parts, mut active, mut format) = (Vec::new(), Vec::new(), Format::Vtu);
    let of = u32::try_from(document.pieces.len()).unwrap_or(u32::MAX);
    for (index, piece) in document.pieces.iter().enumerate() {
        let Some(source) = &piece.source else {
            return Err(header(
                "a Source, which is a file, for every piece",
                format!("none for piece {index}"),
                "write the file again",
            ));
        };
        let part = ticket.part(u32::try_from(index).unwrap_or(u32::MAX), of);
        let free_bytes = free_bytes.saturating_sub(parts.iter().map(Part::bytes).sum());
        let file = DataFile::find(path, source)?;
        let in_piece = |problem: Problem| problem.in_piece(source);
        let (text, appended) = super::head(&file.path, free_bytes, &part).map_err(in_piece)?;
        let own = Document::parse(&text, appended.start.is_some()).map_err(in_piece)?;
        if !matches!(own.kind, Kind::Unstructured | Kind::PolyData) {
            return Err(header(
                format!("an UnstructuredGrid or PolyData in the piece {}", quoted(source)),
                own.kind.name(),
                "name its pieces in the file, or open it alone",
            ));
        }
        if own.kind == Kind::PolyData {
            format = Format::Vtp;
        }
        if active.is_empty() {
            active = own.active.clone();
        }
        warnings.extend(
            own.warnings.iter().filter(|w| !warnings.contains(w)).cloned().collect::<Vec<_>>(),
        );
        let store = Store { packing: super::packing(&own), appended };
        parts.extend(of_document(&own, &store, free_bytes, &part).map_err(in_piece)?);
    }
    Ok((parts, format, active))
}

fn of_document(
    document: &Document<'_>,
    store: &Store<'_>,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Vec<Part>, Problem> {
    // All of it before any of it is read.
    let (mut points, mut cells, mut values) = (0_u64, 0_u64, 0_u64);
    for piece in &document.pieces {
        let own = cells_of(piece);
        points = points.saturating_add(piece.points);
        cells = cells.saturating_add(own);
        for array in &piece.arrays {
            let tuples = if array.association == Association::Point { piece.points } else { own };
            let size = array.scalar_type.size_bytes() as u64;
            values =
                values.saturating_add(tuples.saturating_mul(array.components).saturating_mul(size));
        }
    }
    unstructured::require_stored(points, cells, store.appended.len)?;
    unstructured::require_memory(points, cells, 0, free_bytes)?;
    crate::core::memory::require("the arrays of the file", values, free_bytes)?;
    let mut progress = Progress::new(ticket, values.saturating_add(points.saturating_mul(12)));
    let read = |piece| of_piece(piece, store, free_bytes, &mut progress);
    document.pieces.iter().map(read).collect()
}

fn cells_of(piece: &Piece<'_>) -> u64 {
    piece.counts.iter().fold(0, |sum, (_, count)| sum.saturating_add(*count))
}

/// All numbers of an array of so many tuples.
fn numbers(
    array: &Array<'_>,
    tuples: u64,
    store: &Store<'_>,
    progress: &mut Progress<'_>,
) -> Result<Samples, Problem> {
    if tuples == 0 {
        return Ok(bytes::no_samples(array.scalar_type));
    }
    let what = format!("the array {}", quoted(&array.name));
    let sizes = [tuples, array.components];
    let count = bytes::checked_count(&what, &sizes, array.scalar_type, u64::MAX)?;
    data::read(array, count, store.packing, &store.appended, progress)
}

fn of_piece(
    piece: &Piece<'_>,
    store: &Store<'_>,
    free_bytes: u64,
    progress: &mut Progress<'_>,
) -> Result<Part, Problem> {
    let mut listing = Listing { starts: vec![0], ..Listing::default() };
    if piece.points > 0 {
        let [array] = &piece.geometry[..] else {
            return Err(header(
                "one array in the element Points",
                piece.geometry.len().to_string(),
                "copy or write the file again",
            ));
        };
        if array.components != 3 {
            return Err(header(
                "points of three components",
                array.components.to_string(),
                "correct NumberOfComponents of the points, or write the file again",
            ));
        }
        listing.points = unstructured::places(&numbers(array, piece.points, store, progress)?);
    }
    for (group, count) in piece.counts.iter().filter(|(_, count)| *count > 0) {
        let arrays: Vec<&Array<'_>> =
            piece.cells.iter().filter(|(of, _)| of == group).map(|(_, array)| array).collect();
        let lists = Lists { arrays, store, free_bytes };
        lists.add(&mut listing, (*group, *count), progress)?;
    }
    let cells = cells_of(piece);
    let mut fields = Vec::with_capacity(piece.arrays.len());
    for array in &piece.arrays {
        let tuples = if array.association == Association::Point { piece.points } else { cells };
        fields.push(Field {
            name: array.name.clone(),
            components: usize::try_from(array.components).unwrap_or(usize::MAX),
            association: array.association,
            samples: Arc::new(numbers(array, tuples, store, progress)?),
        });
    }
    Ok(Part { listing, fields })
}

/// The arrays that list a group of cells.
struct Lists<'d, 'a> {
    arrays: Vec<&'d Array<'a>>,
    store: &'d Store<'d>,
    free_bytes: u64,
}

impl Lists<'_, '_> {
    fn array(&self, name: &str) -> Option<&Array<'_>> {
        self.arrays.iter().copied().find(|array| array.name == name)
    }

    fn needed(&self, name: &str) -> Result<&Array<'_>, Problem> {
        self.array(name).ok_or_else(|| {
            header(
                format!("the array {} of cells", quoted(name)),
                "none of that name",
                "the file was cut short or altered: copy or write it again",
            )
        })
    }

    fn whole(
        &self,
        array: &Array<'_>,
        count: u64,
        progress: &mut Progress<'_>,
    ) -> Result<Vec<i64>, Problem> {
        unstructured::check_whole(
            &format!("the array {}", quoted(&array.name)),
            array.scalar_type,
        )?;
        unstructured::require_memory(0, 0, count, self.free_bytes)?;
        let one = Array { components: 1, ..array.clone() };
        Ok(unstructured::whole_numbers(&numbers(&one, count, self.store, progress)?))
    }

    fn add(
        &self,
        listing: &mut Listing,
        (group, count): (Group, u64),
        progress: &mut Progress<'_>,
    ) -> Result<(), Problem> {
        let cells = usize::try_from(count).unwrap_or(usize::MAX);
        let offsets = self.whole(self.needed("offsets")?, count, progress)?;
        let corners = length(&offsets)?;
        let connectivity = self.needed("connectivity")?;
        // Of text, more would be passed over.
        let found = self.count(connectivity, progress)?;
        if found != corners {
            return Err(header(
                format!("a connectivity of {corners} corners, where the offsets of cells end"),
                found.to_string(),
                "one of the two was cut short or altered: copy or write the file again",
            ));
        }
        let connectivity = self.whole(connectivity, corners, progress)?;
        let starts = unstructured::starts(&offsets, cells, connectivity.len())?;
        let types = match group {
            Group::Cells => {
                unstructured::types(&self.whole(self.needed("types")?, count, progress)?)?
            }
            _ => Vec::new(),
        };
        let first = listing.types.len();
        let points = listing.points.len();
        // Corners of polyhedra are written out beside their faces.
        let behind = listing.corners.len();
        listing.corners.extend(unstructured::corners(&connectivity, points)?);
        listing.starts.extend(starts.iter().skip(1).map(|start| start + behind));
        for cell in 0..cells {
            let corners = starts[cell + 1] - starts[cell];
            let own = types.get(cell).copied();
            listing.types.push(own.unwrap_or_else(|| group.kind_of(corners)));
        }
        if listing.types[first..].contains(&unstructured::kind::POLYHEDRON) {
            self.add_faces(listing, first, progress)?;
        }
        Ok(())
    }

    /// The faces of polyhedra: in one stream, or (since version 2.3) as lists of lists.
    fn add_faces(
        &self,
        listing: &mut Listing,
        first: usize,
        progress: &mut Progress<'_>,
    ) -> Result<(), Problem> {
        let cells = listing.types.len() - first;
        let points = listing.points.len();
        let is_polyhedron = |listing: &Listing, cell: usize| {
            listing.types[first + cell] == unstructured::kind::POLYHEDRON
        };
        if let (Some(_), None) = (self.array("faceoffsets"), self.array("face_connectivity")) {
            let ends = self.whole(self.needed("faceoffsets")?, cells as u64, progress)?;
            // Cells that are no polyhedra have −1.
            let total = ends.iter().copied().max().unwrap_or(0).max(0);
            let stream = self.whole(self.needed("faces")?, total.unsigned_abs(), progress)?;
            let mut begin = 0;
            for (cell, end) in ends.iter().enumerate() {
                if !is_polyhedron(listing, cell) {
                    continue;
                }
                let end = usize::try_from(*end).ok().filter(|end| *end >= begin);
                let own = end.and_then(|end| stream.get(begin..end)).ok_or_else(|| {
                    header(
                        "faceoffsets that rise from polyhedron to polyhedron",
                        format!("{} after {begin}", ends[cell]),
                        "the file was altered: copy or write it again",
                    )
                })?;
                listing.faces.insert(first + cell, unstructured::faces_of(own, points, cell)?);
                begin += own.len();
            }
            return Ok(());
        }
        if self.array("face_connectivity").is_none() {
            let has_faces = self.array("faces").is_some();
            return Err(header(
                "the arrays \"faces\" and \"faceoffsets\", which hold the faces of polyhedra (VTK's type 42)",
                if has_faces { "the first alone" } else { "neither" },
                "write the file again with them",
            ));
        }
        let of_faces = self.lists("face_offsets", "face_connectivity", progress)?;
        let of_cells = self.lists("polyhedron_offsets", "polyhedron_to_faces", progress)?;
        let polyhedra: Vec<usize> =
            (0..cells).filter(|cell| is_polyhedron(listing, *cell)).collect();
        let own = |cell: usize| of_cells.get(cell).map(Vec::as_slice).unwrap_or_default();
        let all = polyhedra.iter().flat_map(|cell| own(*cell));
        unstructured::require_faces(&of_faces, all, (&mut 0, self.free_bytes))?;
        for cell in polyhedra {
            let faces = unstructured::faces_among(&of_faces, own(cell), (cell, points))?;
            listing.faces.insert(first + cell, faces);
        }
        Ok(())
    }

    /// Lists of numbers by where each ends.
    fn lists(
        &self,
        offsets: &str,
        numbers_of: &str,
        progress: &mut Progress<'_>,
    ) -> Result<Vec<Vec<i64>>, Problem> {
        let array = self.needed(offsets)?;
        let count = self.count(array, progress)?;
        let ends = self.whole(array, count, progress)?;
        let total = length(&ends)?;
        let numbers = self.whole(self.needed(numbers_of)?, total, progress)?;
        let lists = if ends.first() == Some(&0) { ends.len() - 1 } else { ends.len() };
        let starts = unstructured::starts(&ends, lists, numbers.len())?;
        Ok(starts.windows(2).map(|pair| numbers[pair[0]..pair[1]].to_vec()).collect())
    }

    /// How many numbers an array has, where nothing else tells: it is written in its header, or as words.
    fn count(&self, array: &Array<'_>, progress: &mut Progress<'_>) -> Result<u64, Problem> {
        data::count(array, self.store.packing, &self.store.appended, progress)
    }
}

/// As many corners as the last offset says.
fn length(offsets: &[i64]) -> Result<u64, Problem> {
    let last = offsets.last().copied().unwrap_or(0);
    u64::try_from(last).map_err(|_negative| {
        header(
            "offsets of cells that rise from 0",
            last.to_string(),
            "the file was altered: copy or write it again",
        )
    })
}

//! The cells of unstructured grids and polygons: `n i j k` one after another, or (since version 5.1) offsets and
//! connectivity.

use super::super::bytes;
use super::super::error::{Problem, header, quoted};
use super::super::unstructured::{self, Group};
use super::missing;
use super::scanner::{Scanner, Stored, number};
use crate::cells::Listing;
use crate::volume::{Samples, ScalarType};

/// One list of cells.
struct CellList {
    group: Group,
    cells: usize,
    numbers: Vec<i64>,
    /// Where the corners of each cell end, where they are written so.
    offsets: Option<Vec<i64>>,
}

/// What a file lists of cells, as far as read.
#[derive(Default)]
pub(super) struct CellLists {
    lists: Vec<CellList>,
    types: Option<Vec<u8>>,
}

/// A count of a line of keywords.
pub(super) fn count(words: &[String], at: usize, what: &str) -> Result<usize, Problem> {
    let word = words.get(at).ok_or_else(|| {
        header(
            format!("a number of {what} after {}", quoted(&words[0])),
            quoted(&words.join(" ")),
            "correct the line, or copy the file again",
        )
    })?;
    let found: u64 = number(&words[0], word)?;
    unstructured::check_number(what, found)?;
    Ok(usize::try_from(found).unwrap_or(usize::MAX))
}

impl CellLists {
    /// How many cells there are.
    pub(super) fn count(&self) -> usize {
        self.lists.iter().map(|list| list.cells).sum()
    }

    /// Whether the file lists none, not even of no cells.
    pub(super) fn are_missing(&self) -> bool {
        self.lists.is_empty() && self.types.is_none()
    }

    /// Reads a list; whether the keyword is one of one.
    pub(super) fn read(
        &mut self,
        scanner: &mut Scanner<'_>,
        words: &[String],
        is_poly_data: bool,
    ) -> Result<bool, Problem> {
        let group = match (words[0].to_ascii_lowercase().as_str(), is_poly_data) {
            ("cells", false) => Group::Cells,
            ("cell_types", false) => {
                let count = count(words, 1, "cells")?;
                self.types = Some(types(scanner, count)?);
                return Ok(true);
            }
            ("vertices", true) => Group::Vertices,
            ("lines", true) => Group::Lines,
            ("polygons", true) => Group::Polygons,
            ("triangle_strips", true) => Group::Strips,
            _ => return Ok(false),
        };
        let (first, second) = (count(words, 1, "cells")?, count(words, 2, "numbers of cells")?);
        let list = if scanner.is_next("OFFSETS")? {
            // One more than there are cells; none at all where there are none.
            let cells = first.saturating_sub(1);
            scanner.require_numbers(first.saturating_add(second))?;
            scanner.take_memory(unstructured::bytes_of(0, cells as u64, second as u64))?;
            let offsets = behind(scanner, "OFFSETS", first)?;
            let numbers = behind(scanner, "CONNECTIVITY", second)?;
            CellList { group, cells, numbers, offsets: (cells > 0).then_some(offsets) }
        } else {
            // Each cell is a count at least.
            if first > second {
                return Err(header(
                    format!("{first} numbers or more for {first} cells"),
                    second.to_string(),
                    "correct one of the two, or copy the file again",
                ));
            }
            scanner.require_numbers(second)?;
            scanner.take_memory(unstructured::bytes_of(0, first as u64, second as u64))?;
            let numbers = whole(scanner, ScalarType::Int32, second)?;
            CellList { group, cells: first, numbers, offsets: None }
        };
        self.lists.push(list);
        Ok(true)
    }

    /// The cells of all lists: as VTK numbers them, points before lines, polygons and strips.
    ///
    /// # Errors
    /// Types that are too few or too many, and lists that contradict themselves.
    pub(super) fn listing(mut self, points: &Samples) -> Result<Listing, Problem> {
        let mut listing = Listing { starts: vec![0], ..Listing::default() };
        listing.points = unstructured::places(points);
        let types = self.types.unwrap_or_default();
        let has_types = self.lists.iter().any(|list| list.group == Group::Cells);
        let cells = self.lists.iter().map(|list| list.cells).sum::<usize>();
        if has_types && types.len() != cells {
            if types.is_empty() {
                return Err(missing("CELL_TYPES"));
            }
            return Err(header(
                format!("CELL_TYPES of {cells}, as many as CELLS has"),
                types.len().to_string(),
                "correct one of the two, or copy the file again",
            ));
        }
        self.lists.sort_by_key(|list| list.group as u8);
        for list in self.lists {
            let own: &[u8] = if has_types { &types } else { &[] };
            match list.offsets {
                None => {
                    let how = (list.group, own, list.cells);
                    unstructured::add_counted(&mut listing, &list.numbers, how)?;
                }
                Some(offsets) => {
                    let starts = unstructured::starts(&offsets, list.cells, list.numbers.len())?;
                    unstructured::add_parted(
                        &mut listing,
                        &list.numbers,
                        &starts,
                        (list.group, own),
                    )?;
                }
            }
        }
        Ok(listing)
    }
}

/// The numbers behind a keyword and a type.
fn behind(scanner: &mut Scanner<'_>, keyword: &str, count: usize) -> Result<Vec<i64>, Problem> {
    let words = scanner.line()?.ok_or_else(|| missing(keyword))?;
    if words.len() != 2 || !words[0].eq_ignore_ascii_case(keyword) {
        return Err(header(
            format!("{keyword} and a type"),
            quoted(&words.join(" ")),
            "the file was altered: copy or write it again",
        ));
    }
    match Stored::from_name(&words[1])? {
        Stored::Numbers(scalar_type) => whole(scanner, scalar_type, count),
        _ => Err(header(
            format!("{keyword} of a type of whole numbers"),
            quoted(&words[1]),
            "write the file again",
        )),
    }
}

fn whole(
    scanner: &mut Scanner<'_>,
    scalar_type: ScalarType,
    count: usize,
) -> Result<Vec<i64>, Problem> {
    unstructured::check_whole("numbers of points", scalar_type)?;
    Ok(unstructured::whole_numbers(&scanner.samples(Stored::Numbers(scalar_type), count)?))
}

fn types(scanner: &mut Scanner<'_>, count: usize) -> Result<Vec<u8>, Problem> {
    // Each is a character or a byte at least, which the scanner looks for.
    bytes::checked_count("CELL_TYPES", &[count.max(1) as u64], ScalarType::Int32, u64::MAX)?;
    unstructured::types(&whole(scanner, ScalarType::Int32, count)?)
}

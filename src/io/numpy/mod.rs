//! NumPy arrays: `.npy`, and `.npz` archives of them.
//!
//! The last index is taken as x, as of arrays `a[z, y, x]`; a short one behind three others as components. Tables of
//! floats, of three or four columns or of many more rows than columns, are points: their places, then one field a column.

mod header;

use std::io::{Read, Seek};
use std::path::Path;

use glam::DVec3;
use zip::ZipArchive;

use self::header::{Header, Kind, MAGIC};
use super::axes::{self, Axes, Role};
use super::bytes::{self, DEFLATE_MOST, Progress};
use super::error::{Problem, corrupt, quoted, unsupported};
use super::scale::converted;
use super::unstructured::{self, Part};
use super::{Format, Opened, files, table};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Grid, Lattice, Samples, ScalarType};

/// As many values a sample at most make its components, rather than an axis.
const MOST_COMPONENTS: u64 = 4;
/// More arrays than this are no list that anybody picks from.
const MOST_ARRAYS: usize = 4096;

/// Whether some first bytes are an array, or an archive that begins with one.
pub(super) fn looks_like_it(start: &[u8]) -> bool {
    // The first entry's name, in a zip archive.
    let len = start.get(26..28).map_or(0, |n| usize::from(u16::from_le_bytes([n[0], n[1]])));
    let is_archive = || {
        start.starts_with(ZIP_MAGIC)
            && start.get(30..30 + len).is_some_and(|name| name.ends_with(b".npy"))
    };
    start.starts_with(MAGIC) || is_archive()
}

pub(super) const ZIP_MAGIC: &[u8] = b"PK\x03\x04";

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let (file, len) = files::open_file(path)?;
    let mut reader = files::buffered(file);
    let mut warnings = Vec::new();
    let mut start = [0; 4];
    let read = bytes::read_full(&mut reader, &mut start).map_err(Problem::Io)?;
    reader.rewind().map_err(Problem::Io)?;
    let (dims, fields) = if start[..read] == *ZIP_MAGIC {
        let archive = ZipArchive::new(reader).map_err(|error| damaged(&error))?;
        of_archive(archive, free_bytes, ticket, &mut warnings)?
    } else {
        let header = Header::read(&mut reader)?;
        if is_table(&header) {
            return read_table(&header, &mut reader, len, (free_bytes, ticket));
        }
        let plan = Plan::of(&header, free_bytes)?;
        bytes::require_stored(plan.stored_bytes(), len)?;
        let fields = plan.read(&super::raw::stem(path), &mut reader, true, ticket)?;
        if bytes::rest(&mut reader)? > 0 {
            warnings.push("more bytes follow the samples: they are ignored".into());
        }
        (plan.axes.dims(), fields)
    };
    warnings.extend(axes::several(&fields, "along a further index, or in several arrays"));
    let grid = Grid::of(Lattice::unit(dims), fields);
    Ok(Opened::of(grid, Format::NumPy, warnings))
}

/// Tables of more columns than these are pictures.
const MOST_COLUMNS: u64 = 16;
/// Tables of five columns and more are pictures, unless they have as many rows.
const LEAST_ROWS: u64 = 1000;

/// Whether an array is one of points: floats in three or four columns, which no picture has, or in a few more and many rows.
fn is_table(header: &Header) -> bool {
    let is_float = matches!(
        header.kind,
        Kind::Halves | Kind::Numbers(ScalarType::Float32 | ScalarType::Float64)
    );
    let &[rows, columns] = &header.shape[..] else { return false };
    let is_long = columns <= MOST_COLUMNS && rows >= LEAST_ROWS;
    is_float && columns >= 3 && (columns <= MOST_COMPONENTS || is_long)
}

fn read_table(
    header: &Header,
    reader: &mut dyn Read,
    len: u64,
    (free_bytes, ticket): (u64, &Ticket),
) -> Result<Opened, Problem> {
    let mut warnings = Vec::new();
    let stored = header.kind.stored();
    let count = bytes::checked_count("the array", &header.shape, stored, free_bytes)?;
    bytes::require_stored((count * stored.size_bytes()) as u64, len)?;
    let [rows, columns] =
        [0, 1].map(|axis| usize::try_from(header.shape[axis]).unwrap_or(usize::MAX));
    unstructured::require_memory(rows as u64, rows as u64, rows as u64, free_bytes)?;
    let mut samples = bytes::no_samples(stored);
    bytes::reserve_samples(&mut samples, count)?;
    let mut progress = Progress::new(ticket, (count * stored.size_bytes()) as u64);
    bytes::append(&mut samples, reader, count, &mut progress)?;
    bytes::to_native(&mut samples, header.endian);
    if header.kind == Kind::Halves {
        samples = of_halves(&samples)?;
    }
    if bytes::rest(reader)? > 0 {
        warnings.push("more bytes follow the samples: they are ignored".into());
    }
    // Columns one behind another.
    if !header.fortran {
        samples = unstructured::interleaved(&samples, rows);
    }
    let column = |at: usize| unstructured::run(&samples, at * rows..(at + 1) * rows);
    let places = [column(0), column(1), column(2)];
    let at = |i: usize| DVec3::from_array(places.each_ref().map(|column| column.get(i)));
    let listing = table::cloud((0..rows).map(at).collect());
    let on = (1, Association::Point);
    let field = |at: usize| unstructured::field_of(format!("column {}", at + 1), on, column(at));
    let fields = (3..columns).map(field).collect();
    warnings.push(format!(
        "the array is taken for a table of {rows} points, with x, y and z in its first three columns"
    ));
    let part = Part { listing, fields };
    let grid = unstructured::grid(part, &[], free_bytes, &mut warnings)?;
    Ok(Opened::of(grid, Format::NumPy, warnings))
}

fn damaged(error: &zip::result::ZipError) -> Problem {
    corrupt("a zip archive that is whole", quoted(&error.to_string()), "copy the file again")
}

/// What is read of one array.
struct Plan {
    header: Header,
    axes: Axes,
    count: usize,
}

impl Plan {
    fn of(header: &Header, free_bytes: u64) -> Result<Self, Problem> {
        let kept: Vec<u64> = header.shape.clone();
        let (components, lists, space) = roles(&kept)?;
        let stored = header.kind.stored();
        let count = bytes::checked_count("the array", &kept, stored, free_bytes)?;
        let size = |n: &u64| usize::try_from(*n).unwrap_or(usize::MAX);
        let mut sizes: Vec<usize> = kept.iter().rev().map(size).collect();
        let mut roles = vec![Role::Component; components];
        roles.extend(vec![Role::Domain; space]);
        roles.extend(vec![Role::List; lists]);
        let backwards = header.fortran;
        if backwards {
            sizes.reverse();
            roles.reverse();
        }
        let axes = Axes { sizes, roles, backwards };
        if axes.copies() || header.kind == Kind::Halves {
            let bytes = (count * stored.size_bytes()) as u64;
            memory::require("the array and its copy", bytes.saturating_mul(3), free_bytes)?;
        }
        Ok(Self { header: header.clone(), axes, count })
    }

    fn stored_bytes(&self) -> u64 {
        (self.count * self.header.kind.stored().size_bytes()) as u64
    }

    /// The fields of an array behind its header; `at_once` where it is known to be there.
    fn read(
        &self,
        name: &str,
        reader: &mut dyn Read,
        at_once: bool,
        ticket: &Ticket,
    ) -> Result<Vec<Field>, Problem> {
        let mut samples = bytes::no_samples(self.header.kind.stored());
        if at_once {
            bytes::reserve_samples(&mut samples, self.count)?;
        }
        let mut progress = Progress::new(ticket, self.stored_bytes());
        bytes::append(&mut samples, reader, self.count, &mut progress)?;
        bytes::to_native(&mut samples, self.header.endian);
        if self.header.kind == Kind::Halves {
            samples = of_halves(&samples)?;
        }
        self.axes.fields(name, samples, ticket)
    }
}

fn of_halves(samples: &Samples) -> Result<Samples, Problem> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bits of 16")]
    converted(samples, ScalarType::Float32, |bits| f64::from(half::f16::from_bits(bits as u16)))
}

/// How many indices are components, lists and space: of the last, the first and those between.
fn roles(shape: &[u64]) -> Result<(usize, usize, usize), Problem> {
    let last = shape.last().copied().unwrap_or_default();
    match shape.len() {
        2 if last <= MOST_COMPONENTS => Err(unsupported(
            "an array of two dimensions or more with values in space",
            format!("a table of {last} columns"),
            "save the values on a grid, as an array a[z, y, x]",
        )),
        n @ (2 | 3) => Ok((0, 0, n)),
        n @ 4..=8 if last <= MOST_COMPONENTS => Ok((1, n - 4, 3)),
        n @ 4..=8 => Ok((0, n - 3, 3)),
        n => Err(unsupported(
            "an array of 2 to 8 dimensions",
            format!("{n}"),
            "save the values on a grid, as an array a[z, y, x]",
        )),
    }
}

/// The arrays of the shape that has most numbers.
fn of_archive<R: Read + Seek>(
    mut archive: ZipArchive<R>,
    free_bytes: u64,
    ticket: &Ticket,
    warnings: &mut Vec<String>,
) -> Result<([usize; 3], Vec<Field>), Problem> {
    let mut plans: Vec<(usize, String, Plan)> = Vec::new();
    let mut others = Vec::new();
    let mut last_problem = None;
    if archive.len() > MOST_ARRAYS {
        return Err(unsupported(
            format!("at most {MOST_ARRAYS} arrays in one file"),
            archive.len().to_string(),
            "split the file",
        ));
    }
    for index in 0..archive.len() {
        ticket.checkpoint(0, 1)?;
        let mut entry = archive.by_index(index).map_err(|error| damaged(&error))?;
        let name = entry.name().map_or_else(|_| index.to_string(), |name| name.into_owned());
        let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else { continue };
        let packed = entry.compressed_size();
        let plan = Header::read(&mut entry).and_then(|header| Plan::of(&header, free_bytes));
        match plan {
            Ok(plan) => {
                bytes::require_stored(plan.stored_bytes(), packed.saturating_mul(DEFLATE_MOST))?;
                plans.push((index, name, plan));
            }
            Err(problem) => {
                others.push(name);
                last_problem = Some(problem);
            }
        }
    }
    let points = |plan: &Plan| plan.axes.dims().iter().product::<usize>();
    let Some(main) = plans.iter().max_by_key(|(_, _, plan)| points(plan)) else {
        return Err(last_problem.unwrap_or_else(|| {
            unsupported("an archive with an array of numbers", "none", "save one with numpy.savez")
        }));
    };
    let dims = main.2.axes.dims();
    let (main, left): (Vec<_>, Vec<_>) =
        plans.into_iter().partition(|(_, _, plan)| plan.axes.dims() == dims);
    others.extend(left.into_iter().map(|(_, name, _)| name));
    if !others.is_empty() {
        warnings.push(format!(
            "the arrays of other shapes or types are ignored: {}",
            others.join(", ")
        ));
    }
    let all = main.iter().map(|(_, _, plan)| plan.stored_bytes()).fold(0, u64::saturating_add);
    memory::require("the arrays of the file", all, free_bytes)?;
    let mut fields = Vec::new();
    let of = u32::try_from(main.len()).unwrap_or(u32::MAX);
    for (part, (index, name, plan)) in main.iter().enumerate() {
        let mut entry = archive.by_index(*index).map_err(|error| damaged(&error))?;
        Header::read(&mut entry)?;
        let part = ticket.part(u32::try_from(part).unwrap_or(u32::MAX), of);
        fields.extend(plan.read(name, &mut entry, false, &part)?);
        // To the end, which has the checksum checked.
        if bytes::rest(&mut entry)? > 0 {
            return Err(corrupt(
                format!("the array {} to end with its samples", quoted(name)),
                "more data",
                "the file was altered: copy it again",
            ));
        }
    }
    Ok((dims, fields))
}

//! PLOT3D: curvilinear blocks of points, and in other files beside the flow at them (`q`) and functions (`f`). (*PLOT3D User's
//! Manual*, NASA TM-101067.)
//!
//! Nothing in such a file says what it is: it is one where every size adds up exactly.

mod layout;
mod names;

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use self::layout::{Layout, Misfit, Numbers, Role};
use self::names::Files;
use super::bytes::{self, Endian, Progress};
use super::error::{Problem, corrupt, header, quoted_bytes, truncated, unrecognised};
use super::unstructured::{self, Part, field_of};
use super::{Format, Opened, axes, files};
use crate::cells::Listing;
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Samples, ScalarType};

/// Numbers of the flow at a point.
const UNKNOWNS: usize = 5;
/// Numbers of the free stream before them: Mach number, angle of attack, Reynolds number, time.
const STREAM: usize = 4;

/// The field of what is blanked: 0 at points that are not there.
const IBLANK: &str = "IBlank";

/// Whether a file is one of a pair, or names one.
///
/// # Errors
/// Those of reading it.
pub(super) fn is_it(path: &Path, extension: &str, start: &[u8]) -> Result<bool, Problem> {
    let is_grid = names::GRIDS.contains(&extension);
    if !is_grid && extension != "q" && !names::FUNCTIONS.contains(&extension) {
        return Ok(false);
    }
    if extension == "p3d" && names::looks_like_it(start) {
        return Ok(true);
    }
    if is_grid && Layout::of_grid(path)?.is_some() {
        return Ok(true);
    }
    // A solution, and functions, stand for the grid beside them.
    match names::grid_beside(path) {
        Some(grid) => Ok(Layout::of_grid(&grid)?.is_some()),
        None => Ok(false),
    }
}

/// Why a file whose name is that of a grid is none; `None` of other names.
///
/// # Errors
/// Those of reading it.
pub(super) fn refusal(
    path: &Path,
    extension: &str,
    start: &[u8],
) -> Result<Option<Problem>, Problem> {
    if !["xyz", "x", "p3d", "grd"].contains(&extension) {
        return Ok(None);
    }
    let Some(Misfit { blocks, possible, found, unit }) = Layout::misfit(path)? else {
        let table = if extension == "xyz" { "a table of points, or " } else { "" };
        return Ok(Some(unrecognised(
            format!(
                "{table}a PLOT3D grid, which begins with how many points it has along each axis"
            ),
            format!("bytes that begin with {}", quoted_bytes(start)),
            "check that the file has the right extension and is undamaged",
        )));
    };
    let sizes = match blocks[..] {
        [[x, y, z]] => format!("{x} × {y} × {z} points"),
        _ => format!("{} blocks", blocks.len()),
    };
    let lengths = possible.iter().map(u64::to_string).collect::<Vec<_>>().join(" or ");
    let advice = match possible.iter().any(|length| found < *length) {
        true => "the file was cut short, or its sizes were altered: copy it again",
        false => "its sizes were altered, or more follows than a grid: copy or write it again",
    };
    Ok(Some(truncated(
        format!("{lengths} {unit} for the {sizes} that a PLOT3D grid begins with"),
        found.to_string(),
        advice,
    )))
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let mut warnings = Vec::new();
    let Files { grid, solution, functions } = names::files(path, &mut warnings)?;
    let Some(layout) = Layout::of_grid(&grid)? else {
        return Err(header(
            "a PLOT3D grid whose sizes add up to the length of its file",
            "that they do not",
            "copy the file again, or write it as a whole, in three dimensions",
        ));
    };
    if solution.is_none() && functions.is_none() {
        warnings.push("no solution (q) lies beside the grid: it has no flow".into());
    }
    let flow = fitting(solution.as_deref(), Role::Solution, &layout, &mut warnings)?;
    let functions = fitting(functions.as_deref(), Role::Functions, &layout, &mut warnings)?;
    let points = layout.points();
    let width = if layout.is_wide { 8 } else { 4 };
    unstructured::require_memory(points as u64, points as u64, 8 * points as u64, free_bytes)?;
    let most = functions.as_ref().and_then(|(_, own)| own.functions.iter().max());
    let each = UNKNOWNS as u64 + most.map_or(0, |most| *most as u64);
    let needed = (points as u64).saturating_mul(width * 3 * each);
    memory::require("the flow", needed, free_bytes)?;

    let mut progress = Progress::new(ticket, points as u64 * width * (3 + each));
    let mut reader = Reader::open(&grid, &layout)?;
    let mut parts = Vec::with_capacity(layout.blocks.len());
    for number in 0..layout.blocks.len() {
        parts.push(block(&mut reader, number, &layout, &mut progress)?);
    }
    if let Some((path, layout)) = &functions {
        let mut reader = Reader::open(path, layout)?;
        let most = layout.functions.iter().copied().max().unwrap_or(0);
        let names = names::names_of(path, most);
        for (number, part) in parts.iter_mut().enumerate() {
            let own = of_functions(&mut reader, (number, layout), &names, &mut progress)?;
            part.fields.splice(0..0, own);
        }
    }
    if let Some((path, layout)) = &flow {
        let mut reader = Reader::open(path, layout)?;
        for (number, part) in parts.iter_mut().enumerate() {
            let own = of_flow(&mut reader, (number, layout), &mut progress)?;
            part.fields.splice(0..0, own);
        }
    }
    for (number, part) in parts.iter_mut().enumerate() {
        // What is said of one is true of all.
        let (mut rest, first) = (Vec::new(), &mut warnings);
        let said = if number == 0 { first } else { &mut rest };
        unstructured::tell_apart(&mut part.fields, said);
    }
    let blanked: usize = parts.iter_mut().map(blank).sum();
    if blanked > 0 {
        let what = match flow.is_some() || functions.is_some() {
            true => "cells at them are left out",
            false => "without a flow, cells at them are drawn like others",
        };
        warnings.push(format!(
            "{} blanked (IBlank 0): {what}",
            if blanked == 1 { "1 point is".to_owned() } else { format!("{blanked} points are") }
        ));
    }
    let is_solid = layout.blocks.iter().flatten().all(|n| *n > 1);
    if let ([dims], [part], true) = (&layout.blocks[..], &mut parts[..], is_solid) {
        let mut fields = std::mem::take(&mut part.fields);
        if fields.is_empty() {
            fields.push(numbers(dims, &mut warnings));
        }
        let points = Arc::from(std::mem::take(&mut part.listing.points));
        let block = (points, *dims);
        let grid = unstructured::curvilinear(block, fields, &[], free_bytes, &mut warnings)?;
        warnings.extend(unstructured::points_alone(&grid));
        return Ok(Opened::of(grid, Format::Plot3d, warnings));
    }
    for (part, dims) in parts.iter_mut().zip(&layout.blocks) {
        unstructured::add_block(&mut part.listing, *dims);
    }
    if parts.len() > 1 {
        let count = parts.len();
        warnings.push(format!("{count} blocks are opened as one unstructured grid"));
    }
    let whole = unstructured::joined(parts, &mut warnings)?;
    let grid = unstructured::grid(whole, &[], free_bytes, &mut warnings)?;
    Ok(Opened::of(grid, Format::Plot3d, warnings))
}

/// A file of numbers at the points of a grid, and how it is laid out; `None` where there is none, and where it is none, which is
/// told.
fn fitting<'a>(
    path: Option<&'a Path>,
    role: Role,
    grid: &Layout,
    warnings: &mut Vec<String>,
) -> Result<Option<(&'a Path, Layout)>, Problem> {
    let Some(path) = path else { return Ok(None) };
    let (what, it) = match role {
        Role::Functions => ("the functions", "it has no functions"),
        _ => ("the flow", "it is no flow of five numbers"),
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Ok(match Layout::on_grid(path, role, grid)? {
        Some((layout, more)) => {
            if more > 0 {
                warnings
                    .push(format!("{more} more bytes follow {what} in {name}: they are ignored"));
            }
            Some((path, layout))
        }
        None => {
            warnings.push(format!("{name} is left out: {it} at the points of this grid"));
            None
        }
    })
}

/// A field for a block without any: the cells' numbers.
fn numbers(dims: &[usize; 3], warnings: &mut Vec<String>) -> Field {
    warnings.push(
        "the file has no array of numbers: the numbers of its cells stand in as the field \"cell\""
            .into(),
    );
    let count = dims.map(|n| n - 1).iter().product::<usize>();
    #[expect(clippy::cast_possible_truncation, reason = "fewer than 2^32 points were checked")]
    let samples = Samples::UInt32((0..count as u32).collect());
    field_of("cell", (1, Association::Cell), samples)
}

/// A file, behind what it says of its sizes.
struct Reader {
    reader: BufReader<File>,
    numbers: Numbers,
}

impl Reader {
    fn open(path: &Path, layout: &Layout) -> Result<Self, Problem> {
        let (file, _) = files::open_file(path)?;
        let mut reader = files::buffered(file);
        match layout.numbers {
            Numbers::Text => {
                let mut sizes = bytes::no_samples(ScalarType::Int64);
                let ticket = Ticket::new();
                let mut progress = Progress::new(&ticket, 1);
                bytes::append_text(
                    &mut sizes,
                    &mut reader,
                    layout.header_numbers(),
                    &mut progress,
                )?;
            }
            Numbers::Binary { .. } => {
                reader.seek(SeekFrom::Start(layout.header_bytes())).map_err(Problem::Io)?;
            }
        }
        Ok(Self { reader, numbers: layout.numbers })
    }

    fn samples(
        &mut self,
        scalar_type: ScalarType,
        count: usize,
        progress: &mut Progress<'_>,
    ) -> Result<Samples, Problem> {
        let mut samples = bytes::no_samples(scalar_type);
        match self.numbers {
            Numbers::Text => {
                bytes::append_text(&mut samples, &mut self.reader, count, progress)?;
            }
            Numbers::Binary { endian, .. } => {
                bytes::reserve_samples(&mut samples, count)?;
                bytes::append(&mut samples, &mut self.reader, count, progress)?;
                bytes::to_native(&mut samples, endian);
            }
        }
        Ok(samples)
    }

    /// The length of a record before or behind it, where the file has these.
    fn marker(&mut self, expected: u64) -> Result<(), Problem> {
        let Numbers::Binary { endian, has_markers: true } = self.numbers else { return Ok(()) };
        let mut bytes = [0; 4];
        if bytes::read_full(&mut self.reader, &mut bytes).map_err(Problem::Io)? < 4 {
            return Err(truncated(
                "a record's length",
                "that the file ends",
                "the file was cut short: copy it again",
            ));
        }
        let found = match endian {
            Endian::Little => u32::from_le_bytes(bytes),
            Endian::Big => u32::from_be_bytes(bytes),
        };
        if u64::from(found) == expected {
            return Ok(());
        }
        Err(corrupt(
            format!("a record of {expected} bytes"),
            found.to_string(),
            "the file was altered: copy it again",
        ))
    }
}

/// Takes the flow from points that are blanked, so that the cells there are nowhere; how many these points are.
fn blank(part: &mut Part) -> usize {
    let Some(blanks) = part.fields.iter().find(|field| field.name == IBLANK) else { return 0 };
    let blanks = Arc::clone(&blanks.samples);
    let blanked: Vec<usize> = (0..blanks.len()).filter(|at| blanks.get(*at) == 0.0).collect();
    for field in part.fields.iter_mut().filter(|field| field.name != IBLANK) {
        let components = field.components;
        let all = blanked.iter().flat_map(|at| components * at..components * (at + 1));
        match Arc::make_mut(&mut field.samples) {
            Samples::Float32(values) => all.for_each(|at| values[at] = f32::NAN),
            Samples::Float64(values) => all.for_each(|at| values[at] = f64::NAN),
            // A flow has fractions.
            _ => {}
        }
    }
    blanked.len()
}

/// The points of a block, and which of them are blanked.
fn block(
    reader: &mut Reader,
    number: usize,
    layout: &Layout,
    progress: &mut Progress<'_>,
) -> Result<Part, Problem> {
    let count = layout.blocks[number].iter().product::<usize>();
    let record = layout.record_bytes(Role::Grid, number);
    reader.marker(record)?;
    let planes = reader.samples(layout.scalar_type(), 3 * count, progress)?;
    let mut fields = Vec::new();
    if layout.has_blanks {
        let blanks = reader.samples(ScalarType::Int32, count, progress)?;
        fields.push(field_of(IBLANK, (1, Association::Point), blanks));
    }
    reader.marker(record)?;
    let points = axes::positions(&unstructured::interleaved(&planes, 3)).to_vec();
    Ok(Part { listing: Listing { points, ..Listing::default() }, fields })
}

fn of_flow(
    reader: &mut Reader,
    (number, layout): (usize, &Layout),
    progress: &mut Progress<'_>,
) -> Result<[Field; 3], Problem> {
    let count = layout.blocks[number].iter().product::<usize>();
    let width = layout.scalar_type().size_bytes() as u64;
    let stream = STREAM as u64 * width;
    reader.marker(stream)?;
    reader.samples(layout.scalar_type(), STREAM, progress)?;
    reader.marker(stream)?;
    let record = layout.record_bytes(Role::Solution, number);
    reader.marker(record)?;
    let all = reader.samples(layout.scalar_type(), UNKNOWNS * count, progress)?;
    reader.marker(record)?;
    let run = |from: usize, to: usize| unstructured::run(&all, from * count..to * count);
    let on = |components| (components, Association::Point);
    Ok([
        field_of("Density", on(1), run(0, 1)),
        field_of("Momentum", on(3), unstructured::interleaved(&run(1, 4), 3)),
        field_of("StagnationEnergy", on(1), run(4, 5)),
    ])
}

fn of_functions(
    reader: &mut Reader,
    (number, layout): (usize, &Layout),
    names: &[String],
    progress: &mut Progress<'_>,
) -> Result<Vec<Field>, Problem> {
    let count = layout.blocks[number].iter().product::<usize>();
    let record = layout.record_bytes(Role::Functions, number);
    reader.marker(record)?;
    let names = names.iter().take(layout.functions[number]);
    let function = |name: &String| {
        let own = reader.samples(layout.scalar_type(), count, progress)?;
        Ok(field_of(name, (1, Association::Point), own))
    };
    let own = names.map(function).collect::<Result<Vec<Field>, Problem>>()?;
    reader.marker(record)?;
    Ok(own)
}

/// Reads as much as is there, up to so many bytes.
fn start_of(path: &Path, most: u64) -> Result<(Vec<u8>, u64), Problem> {
    let (file, len) = files::open_file(path)?;
    let mut start = Vec::new();
    file.take(most).read_to_end(&mut start).map_err(Problem::Io)?;
    Ok((start, len))
}

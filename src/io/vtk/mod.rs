//! VTK's legacy format (`.vtk`), ascii or binary: structured points, rectilinear, structured and unstructured grids,
//! polygons.
//! (*The VTK User's Guide*, VTK File Formats; and what VTK 9's writers add.)

mod attributes;
mod cells;
mod scanner;

use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use self::attributes::{Attributes, Section};
use self::cells::CellLists;
use self::scanner::{Scanner, Stored, number};
use super::bytes;
use super::error::{Problem, corrupt, header, quoted, truncated, unsupported};
use super::{Format, Opened, axes, files, unstructured};
use crate::core::progress::Ticket;
use crate::volume::{Association, Grid, Samples, Scalar, ScalarType, Shape};
use crate::with_samples;

/// How every such file begins.
pub(super) const MAGIC: &[u8] = b"# vtk DataFile";

/// What the file says it holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dataset {
    StructuredPoints,
    RectilinearGrid,
    StructuredGrid,
    UnstructuredGrid,
    PolyData,
}

impl Dataset {
    /// Whether its cells lie in no order.
    fn is_unstructured(self) -> bool {
        matches!(self, Self::UnstructuredGrid | Self::PolyData)
    }
}

/// Where the points are, as far as read.
struct Geometry {
    dims: Option<[usize; 3]>,
    origin: DVec3,
    spacing: DVec3,
    lists: [Option<Vec<f64>>; 3],
    points: Option<Samples>,
    cells: CellLists,
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let (file, len) = files::open_file(path)?;
    let mut scanner = Scanner::new(files::buffered(file), len, free_bytes, ticket);
    let mut attributes = Attributes::default();
    let dataset = head(&mut scanner, &mut attributes)?;
    let mut geometry = Geometry {
        dims: None,
        origin: DVec3::ZERO,
        spacing: DVec3::ONE,
        lists: [const { None }; 3],
        points: None,
        cells: CellLists::default(),
    };
    let mut section = None;
    while let Some(words) = scanner.line()? {
        match words[0].to_ascii_lowercase().as_str() {
            "metadata" => skip_metadata(&mut scanner)?,
            "point_data" => {
                section = Some(section_of(
                    &geometry,
                    (dataset, Association::Point),
                    &mut scanner,
                    words,
                )?);
            }
            "cell_data" => {
                section =
                    Some(section_of(&geometry, (dataset, Association::Cell), &mut scanner, words)?);
            }
            _ => {
                let is_known = attributes.read(&mut scanner, &words, section)?
                    || (section.is_none() && geometry.read(&mut scanner, &words, dataset)?);
                if !is_known {
                    return Err(unknown(&words, section));
                }
            }
        }
    }
    if attributes.fields.is_empty() && !dataset.is_unstructured() {
        return Err(unsupported(
            "at least one array of numbers on points or cells",
            "none",
            "write the file again with its data",
        ));
    }
    let active = attributes.active();
    let Attributes { mut fields, mut warnings, .. } = attributes;
    axes::activate(&mut fields, &active);
    let dims = if dataset.is_unstructured() { [0; 3] } else { geometry.dims()? };
    let grid = match dataset {
        Dataset::StructuredPoints => {
            let (origin, spacing) = (geometry.origin, geometry.spacing);
            let lattice =
                axes::lattice_of_spacing(dims, origin, spacing, DMat3::IDENTITY, &mut warnings);
            Grid::of(lattice, fields)
        }
        Dataset::RectilinearGrid => {
            let mut lists = geometry.lists.into_iter().zip(["X", "Y", "Z"]);
            let mut list = || -> Result<Arc<[f64]>, Problem> {
                let (list, axis) = lists.next().unwrap_or((None, ""));
                list.map(Arc::from).ok_or_else(|| missing(&format!("{axis}_COORDINATES")))
            };
            Grid::shaped(dims, Shape::Rectilinear([list()?, list()?, list()?]), fields)?
        }
        Dataset::StructuredGrid => {
            let points = geometry.points.ok_or_else(|| missing("POINTS"))?;
            let block = (axes::positions(&points), dims);
            unstructured::curvilinear(block, fields, &active, free_bytes, &mut warnings)?
        }
        Dataset::UnstructuredGrid | Dataset::PolyData => {
            let points = geometry.points.ok_or_else(|| missing("POINTS"))?;
            // With data on its points it goes on, and has no cells.
            if dataset == Dataset::UnstructuredGrid
                && geometry.cells.are_missing()
                && section.is_none()
            {
                return Err(truncated(
                    "CELLS and CELL_TYPES behind the POINTS of an unstructured grid",
                    "that the file ends",
                    "it was cut short: copy or write it again; of points alone, write POLYDATA in place of \
                     UNSTRUCTURED_GRID",
                ));
            }
            let part = unstructured::Part { listing: geometry.cells.listing(&points)?, fields };
            unstructured::grid(part, &active, free_bytes, &mut warnings)?
        }
    };
    warnings.extend(unstructured::points_alone(&grid));
    Ok(Opened::of(grid, Format::Vtk, warnings))
}

/// Everything up to the kind of the data set.
fn head(scanner: &mut Scanner<'_>, attributes: &mut Attributes) -> Result<Dataset, Problem> {
    // The first line is known, the second one is a title.
    scanner.raw_line()?;
    scanner.raw_line()?;
    let mut words = scanner.line()?.unwrap_or_default();
    let mode = words.first().map(String::as_str).unwrap_or_default();
    scanner.is_binary = match mode.to_ascii_lowercase().as_str() {
        "ascii" => false,
        "binary" => true,
        _ => {
            return Err(header(
                "ASCII or BINARY on the third line",
                quoted(mode),
                "correct the line, or copy the file again",
            ));
        }
    };
    loop {
        words = match scanner.line()? {
            Some(words) => words,
            None => {
                return Err(unsupported(
                    "a DATASET",
                    "a file without one",
                    "write the file again with its grid",
                ));
            }
        };
        match words[0].to_ascii_lowercase().as_str() {
            "dataset" => break,
            "metadata" => skip_metadata(scanner)?,
            _ if attributes.read(scanner, &words, None)? => {}
            _ => return Err(header("DATASET", quoted(&words.join(" ")), "copy the file again")),
        }
    }
    let kind = words.get(1).map(String::as_str).unwrap_or_default();
    match kind.to_ascii_lowercase().as_str() {
        "structured_points" => Ok(Dataset::StructuredPoints),
        "rectilinear_grid" => Ok(Dataset::RectilinearGrid),
        "structured_grid" => Ok(Dataset::StructuredGrid),
        "unstructured_grid" => Ok(Dataset::UnstructuredGrid),
        "polydata" => Ok(Dataset::PolyData),
        _ => Err(unsupported(
            "a DATASET of STRUCTURED_POINTS, RECTILINEAR_GRID, STRUCTURED_GRID, UNSTRUCTURED_GRID or POLYDATA",
            quoted(kind),
            "resample the data to an image (.vti) first",
        )),
    }
}

impl Geometry {
    fn dims(&self) -> Result<[usize; 3], Problem> {
        self.dims.ok_or_else(|| missing("DIMENSIONS"))
    }

    /// Reads what places the points; whether the keyword is one of these.
    fn read(
        &mut self,
        scanner: &mut Scanner<'_>,
        words: &[String],
        dataset: Dataset,
    ) -> Result<bool, Problem> {
        match (words[0].to_ascii_lowercase().as_str(), dataset) {
            ("dimensions", _) => {
                let sizes: [u64; 3] = triple(scanner, words)?;
                bytes::checked_count("a grid", &sizes, ScalarType::UInt8, u64::MAX)?;
                // Their product fits, so each of them does.
                self.dims = Some(sizes.map(|n| usize::try_from(n).unwrap_or(usize::MAX)));
            }
            ("origin", Dataset::StructuredPoints) => {
                self.origin = DVec3::from_array(triple(scanner, words)?);
            }
            ("spacing" | "aspect_ratio", Dataset::StructuredPoints) => {
                self.spacing = DVec3::from_array(triple(scanner, words)?);
            }
            (
                keyword @ ("x_coordinates" | "y_coordinates" | "z_coordinates"),
                Dataset::RectilinearGrid,
            ) => {
                let axis = usize::from(keyword.as_bytes()[0] - b'x');
                let expected = self.dims()?[axis];
                let samples = places(scanner, words, expected, 1)?;
                self.lists[axis] =
                    Some(with_samples!(&samples, v => v.iter().map(|v| v.to_f64()).collect()));
            }
            ("points", Dataset::StructuredGrid) => {
                let dims = self.dims()?;
                let count = dims.iter().product::<usize>();
                scanner.require_numbers(count.saturating_mul(3))?;
                // As they are kept, beside the numbers of the file.
                scanner.take_memory((count as u64).saturating_mul(24))?;
                self.points = Some(places(scanner, words, count, 3)?);
            }
            ("points", Dataset::UnstructuredGrid | Dataset::PolyData) => {
                let count = cells::count(words, 1, "points")?;
                scanner.require_numbers(count.saturating_mul(3))?;
                scanner.take_memory(unstructured::bytes_of(count as u64, 0, 0))?;
                self.points = Some(places(scanner, words, count, 3)?);
            }
            (_, Dataset::UnstructuredGrid | Dataset::PolyData) => {
                return self.cells.read(scanner, words, dataset == Dataset::PolyData);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Numbers that an array on points or cells has for each component.
    fn tuples(&self, dataset: Dataset, association: Association) -> Result<usize, Problem> {
        if dataset.is_unstructured() {
            let points = || self.points.as_ref().map(|points| points.len() / 3);
            return match association {
                Association::Point => points().ok_or_else(|| missing("POINTS")),
                Association::Cell => Ok(self.cells.count()),
            };
        }
        let dims = self.dims()?;
        Ok(match association {
            Association::Point => dims.iter().product(),
            Association::Cell => dims.map(|n| n.saturating_sub(1).max(1)).iter().product(),
        })
    }
}

/// Three numbers behind a keyword.
fn triple<T: std::str::FromStr + Copy>(
    scanner: &mut Scanner<'_>,
    words: &[String],
) -> Result<[T; 3], Problem> {
    let words = scanner.words(words.to_vec(), 4)?;
    let value = |at: usize| number::<T>(&words[0], &words[at]);
    Ok([value(1)?, value(2)?, value(3)?])
}

/// The numbers of `KEYWORD count type`, `components` each.
fn places(
    scanner: &mut Scanner<'_>,
    words: &[String],
    expected: usize,
    components: usize,
) -> Result<Samples, Problem> {
    let [keyword, found, name] = words else {
        return Err(header(
            format!("a number and a type after {}", quoted(&words[0])),
            quoted(&words.join(" ")),
            "correct the line, or copy the file again",
        ));
    };
    check_count(keyword, found, expected)?;
    scanner.samples(Stored::from_name(name)?, expected.saturating_mul(components))
}

fn section_of(
    geometry: &Geometry,
    (dataset, association): (Dataset, Association),
    scanner: &mut Scanner<'_>,
    words: Vec<String>,
) -> Result<Section, Problem> {
    let tuples = geometry.tuples(dataset, association)?;
    let words = scanner.words(words, 2)?;
    check_count(&words[0], &words[1], tuples)?;
    Ok(Section { association, tuples })
}

/// Refuses another number behind a keyword than the grid has.
fn check_count(keyword: &str, found: &str, expected: usize) -> Result<(), Problem> {
    if number::<u64>(keyword, found)? == expected as u64 {
        return Ok(());
    }
    let expected = format!("{keyword} of {expected}, as many as the grid has");
    Err(header(expected, quoted(found), "correct one of the two"))
}

/// Reads over the block that VTK 4.2 and later put behind an array: lines up to an empty one.
fn skip_metadata(scanner: &mut Scanner<'_>) -> Result<(), Problem> {
    while let Some(line) = scanner.raw_line()? {
        if line.trim().is_empty() {
            break;
        }
    }
    Ok(())
}

fn missing(keyword: &str) -> Problem {
    truncated(
        format!("{keyword} before the data"),
        "none",
        "the file was cut short or its parts are out of order: copy or write it again",
    )
}

fn unknown(words: &[String], section: Option<Section>) -> Problem {
    let expected = match section {
        Some(_) => "a keyword such as SCALARS, VECTORS or FIELD",
        None => "a keyword of the grid, POINT_DATA or CELL_DATA",
    };
    corrupt(
        expected,
        quoted(&words.join(" ")),
        "the file was altered, or a count before it is wrong: copy it again",
    )
}

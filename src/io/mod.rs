//! Files to grids: one file a format, recognised by content first and extension second.
//!
//! Owns readers and what they refuse. Refuses drawing. Imports `core`, `cells`, `volume`, `polygons`, `rbf`. [`open`] is the
//! one way in; every size is checked against the file and against memory before it is allocated.

mod axes;
mod bytes;
mod cells_info;
mod dicom;
mod encoded;
mod error;
mod files;
mod hdf5;
mod images;
pub mod info;
pub mod labels;
pub mod mesh;
mod metaimage;
mod mrc;
mod netcdf;
mod nifti;
mod nrrd;
mod numbers;
mod numpy;
mod plot3d;
mod precision;
pub mod raw;
mod scale;
mod stream;
mod table;
mod tiff;
mod unstructured;
pub mod vrbf;
mod vtk;
mod vtk_xml;
mod zarr;

use std::io::Read;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub use bytes::Endian;
pub use cells_info::CellsInfo;
pub use encoded::{Encoded, Ended, Facts, Source};
pub use error::{Mismatch, Problem, ReadError};
pub use files::{may_be_replaced, was_read};
pub use info::{Info, describe};
pub use raw::{RawLayout, RawOverrides};

use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Field, Grid};
use error::{quoted_bytes, unrecognised};

/// A file format that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// NRRD, attached or detached.
    Nrrd,
    /// MetaImage, `.mha` or `.mhd`.
    MetaImage,
    /// VTK's XML image data.
    Vti,
    /// VTK's XML rectilinear grid.
    Vtr,
    /// VTK's XML structured (curvilinear) grid.
    Vts,
    /// VTK's XML unstructured grid, in one file or in several (`.pvtu`).
    Vtu,
    /// VTK's XML polygons, lines and points.
    Vtp,
    /// VTK's legacy format, ascii or binary, of one of those five.
    Vtk,
    /// NetCDF, classic formats.
    NetCdf,
    /// NIfTI-1 or -2, in one file or in two.
    Nifti,
    /// Analyze 7.5, NIfTI's predecessor.
    Analyze,
    /// A NumPy array, or an archive of them.
    NumPy,
    /// An MRC or CCP4 map.
    Mrc,
    /// A DICOM file, or a series of them.
    Dicom,
    /// TIFF, of one page or of many.
    Tiff,
    /// A folder of pictures.
    Images,
    /// HDF5, of no other format that is written in it.
    Hdf5,
    /// A folder of Zarr or OME-Zarr.
    Zarr,
    /// Exodus II: a mesh of elements, in NetCDF.
    Exodus,
    /// PLOT3D: curvilinear blocks, and the flow at their points in a second file.
    Plot3d,
    /// A table of points, one a line of text.
    Table,
    /// Triangles, or points, in a file of polygons.
    Polygons(mesh::MeshFormat),
    /// Radial basis functions, as this program encodes fields.
    Vrbf,
    /// Samples and nothing else.
    Raw,
}

impl Format {
    /// The lower-case word that `info` and scripts use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nrrd => "nrrd",
            Self::MetaImage => "metaimage",
            Self::Vti => "vti",
            Self::Vtr => "vtr",
            Self::Vts => "vts",
            Self::Vtu => "vtu",
            Self::Vtp => "vtp",
            Self::Vtk => "vtk",
            Self::NetCdf => "netcdf",
            Self::Nifti => "nifti",
            Self::Analyze => "analyze",
            Self::NumPy => "numpy",
            Self::Mrc => "mrc",
            Self::Dicom => "dicom",
            Self::Tiff => "tiff",
            Self::Images => "images",
            Self::Hdf5 => "hdf5",
            Self::Zarr => "zarr",
            Self::Exodus => "exodus",
            Self::Plot3d => "plot3d",
            Self::Table => "table",
            Self::Polygons(format) => format.name(),
            Self::Vrbf => "vrbf",
            Self::Raw => "raw",
        }
    }
}

/// What the caller knows or allows.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// Given: the file is headerless, whatever it looks like, and laid out so.
    pub raw: Option<RawOverrides>,
    /// Which of several series in a folder, by its [`Series::name`]; that with most pixels, or the file's own, where none is
    /// called so.
    pub series: Option<String>,
    /// Of basis functions: samples along each axis at which their sum is taken; those of the source for `None`.
    pub dims: Option<[usize; 3]>,
    /// Most bytes that may be allocated; what the system says is free for `None`.
    pub memory_limit_bytes: Option<u64>,
}

impl OpenOptions {
    fn free_bytes(&self) -> u64 {
        self.memory_limit_bytes.unwrap_or_else(memory::free_bytes)
    }
}

/// A file's content in memory.
#[derive(Debug, Clone)]
pub struct Opened {
    /// Lattice and fields, the active one first; checked.
    pub grid: Grid,
    /// As recognised.
    pub format: Format,
    /// What was ignored, assumed or repaired, one sentence each.
    pub warnings: Vec<String>,
    /// The series that lie at its place, it among them; empty where it is the only one.
    pub series: Vec<Series>,
    /// Of basis functions: how many, and how far they are from their source.
    pub encoding: Option<Facts>,
}

impl Opened {
    /// What is alone at its place.
    pub(crate) fn of(grid: Grid, format: Format, warnings: Vec<String>) -> Self {
        Self { grid, format, warnings, series: Vec::new(), encoding: None }
    }
}

/// One of several volumes in a folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Series {
    /// What it is called, by its description or its number; no two of a folder alike.
    pub name: String,
    /// A file of it, which opens all of it.
    pub path: PathBuf,
    /// How many slices it has.
    pub slices: usize,
    /// Whether it is the one that was opened.
    pub is_open: bool,
}

/// What kind of file it is: by its first bytes, and only where these say nothing by its name.
///
/// # Errors
/// Not a file, empty, or nothing that is read.
pub fn probe(path: &Path) -> Result<Format, ReadError> {
    recognise(path).map_err(|problem| problem.at(path))
}

/// Reads a volume.
///
/// # Errors
/// Whatever keeps the file from being a volume in memory; cancelled.
pub fn open(path: &Path, options: &OpenOptions, ticket: &Ticket) -> Result<Opened, ReadError> {
    read(path, options, ticket).map_err(|problem| problem.at(path))
}

/// A field as a file of NRRD; of a grid that is not evenly spaced, as if it were.
pub fn nrrd_bytes(grid: &Grid, field: &Field) -> Vec<u8> {
    nrrd::bytes(grid, field)
}

fn read(path: &Path, options: &OpenOptions, ticket: &Ticket) -> Result<Opened, Problem> {
    let format = match &options.raw {
        Some(_) => Format::Raw,
        None => recognise(path)?,
    };
    ticket.checkpoint(0, 1)?;
    let free_bytes = options.free_bytes();
    let mut opened = match format {
        Format::Nrrd => nrrd::read(path, free_bytes, ticket),
        Format::MetaImage => metaimage::read(path, free_bytes, ticket),
        Format::Vti | Format::Vtr | Format::Vts | Format::Vtu | Format::Vtp => {
            vtk_xml::read(path, free_bytes, ticket)
        }
        Format::Vtk => vtk::read(path, free_bytes, ticket),
        Format::NetCdf | Format::Exodus => netcdf::read(path, free_bytes, ticket),
        Format::Nifti | Format::Analyze => nifti::read(path, free_bytes, ticket),
        Format::NumPy => numpy::read(path, free_bytes, ticket),
        Format::Mrc => mrc::read(path, free_bytes, ticket),
        Format::Dicom => dicom::read(path, options.series.as_deref(), free_bytes, ticket),
        Format::Tiff => tiff::read(path, free_bytes, ticket),
        Format::Images => images::read(path, free_bytes, ticket),
        Format::Hdf5 => hdf5::read(path, free_bytes, ticket),
        Format::Zarr => zarr::read(path, free_bytes, ticket),
        Format::Plot3d => plot3d::read(path, free_bytes, ticket),
        Format::Table => table::read(path, free_bytes, ticket),
        Format::Polygons(_) => mesh::read_alone(path, free_bytes, ticket),
        Format::Vrbf => vrbf::read(path, options.dims, free_bytes, ticket),
        Format::Raw => raw::read(path, &options.raw.unwrap_or_default(), free_bytes, ticket),
    }?;
    opened.grid.check()?;
    opened.warnings.extend(opened.grid.fields.iter().filter_map(precision::merged_neighbours));
    opened.warnings.extend(opened.grid.fields.iter().filter_map(precision::merged_at_zero));
    opened.warnings.extend(opened.grid.resampling());
    ticket.checkpoint(1, 1)?;
    Ok(opened)
}

/// Bytes that are looked at to tell a format.
const PROBE_BYTES: u64 = 4096;

fn recognise(path: &Path) -> Result<Format, Problem> {
    if path.is_dir() {
        return recognise_folder(path);
    }
    if zarr::folder_of(path).is_some() {
        return Ok(Format::Zarr);
    }
    let (file, len) = files::open_file(path)?;
    let mut start = Vec::new();
    file.take(PROBE_BYTES).read_to_end(&mut start).map_err(Problem::Io)?;
    if len == 0 || start.is_empty() {
        return Err(Problem::Empty);
    }
    if let Some(format) = by_content(&start)? {
        return Ok(format);
    }
    if start.starts_with(hdf5::MAGIC) {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        const OF_NETCDF: [&str; 7] = ["nc", "nc4", "ex2", "exo", "exii", "e", "g"];
        let is_netcdf = OF_NETCDF.iter().any(|of| extension == *of) || hdf5::is_netcdf(path);
        return Ok(if is_netcdf { Format::NetCdf } else { Format::Hdf5 });
    }
    if start.starts_with(&bytes::GZIP_MAGIC) {
        let unpacked = stream::Stream::start(path, PROBE_BYTES as usize)?;
        if let Some(format) = packed(&unpacked) {
            return Ok(format);
        }
        if unpacked.is_empty() {
            return Err(error::truncated(
                "a volume packed with gzip",
                "packed bytes that give none back",
                "the file was cut short or damaged: copy it again",
            ));
        }
    }
    if let Some(format) = mesh::format_of(path, &start) {
        return Ok(Format::Polygons(format));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    match extension {
        "nrrd" | "nhdr" => Err(not_as_named("an NRRD header (\"NRRD000…\")", &start)),
        "mha" | "mhd" => Err(not_as_named("a MetaImage header (\"NDims = …\")", &start)),
        "vti" => Err(not_as_named("VTK image data (\"<VTKFile …\")", &start)),
        "vtr" | "vts" | "vtu" | "pvtu" | "vtp" | "pvtp" => {
            Err(not_as_named("a VTK grid (\"<VTKFile …\")", &start))
        }
        "vtk" => Err(not_as_named("a legacy VTK header (\"# vtk DataFile …\")", &start)),
        "nc" | "cdf" | "ex2" | "exo" | "exii" => {
            Err(not_as_named("a NetCDF header (\"CDF\")", &start))
        }
        "nii" => Err(not_as_named("a NIfTI header", &start)),
        _ if name.ends_with(".nii.gz") => Err(not_as_named("a packed NIfTI header", &start)),
        "vrbf" => Err(not_as_named("basis functions (\"VOXSPLAT RBF …\")", &start)),
        "npy" | "npz" => Err(not_as_named("a NumPy array", &start)),
        "img" if nifti::header_beside(path).is_some() => Ok(Format::Nifti),
        _ if name.ends_with(".img.gz") && nifti::header_beside(path).is_some() => Ok(Format::Nifti),
        extension if mrc::EXTENSIONS.contains(&extension) && mrc::may_be_it(&start) => {
            Ok(Format::Mrc)
        }
        _ if raw::is_told_exactly(&name, len) => Ok(Format::Raw),
        _ if plot3d::is_it(path, extension, &start)? => Ok(Format::Plot3d),
        _ if table::is_it(extension, &start) => Ok(Format::Table),
        "csv" | "tsv" if foreign(&start).is_none() => Err(table::refusal(&start)),
        "txt" | "asc" if is_text(&start) => Err(table::refusal(&start)),
        _ if foreign(&start).is_some() => {
            Err(Problem::Foreign { name: foreign(&start).unwrap_or_default().to_owned() })
        }
        "raw" | "bin" | "dat" | "img" | "vol" => Ok(Format::Raw),
        _ if raw::guess(&name, len).dims.is_some() => Ok(Format::Raw),
        _ => Err(match plot3d::refusal(path, extension, &start)? {
            Some(refusal) => refusal,
            None if is_text(&start) => Problem::Foreign { name: "a text file".to_owned() },
            None => unrecognised(
                "a volume in one of the formats that are read",
                format!("bytes that begin with {}", quoted_bytes(&start)),
                "convert it, or give --raw-dims and --raw-type for samples without a header",
            ),
        }),
    }
}

/// What a folder holds: Zarr by its metadata, else DICOM files, else pictures.
fn recognise_folder(path: &Path) -> Result<Format, Problem> {
    if zarr::folder_of(path).is_some() {
        return Ok(Format::Zarr);
    }
    if dicom::is_folder_of_them(path) {
        return Ok(Format::Dicom);
    }
    if !images::pictures(path)?.is_empty() {
        return Ok(Format::Images);
    }
    let files = files_by_name(path);
    let is_volume = |name: &&String| {
        !matches!(recognise(&path.join(name)), Err(_) | Ok(Format::Raw | Format::Table))
    };
    let volumes: Vec<String> = files.iter().take(LOOKED_AT).filter(is_volume).cloned().collect();
    let found = match (told(&volumes), files.is_empty()) {
        (Some(volumes), _) => format!("a folder that holds {volumes}"),
        (None, true) => "a folder without DICOM files, pictures or Zarr metadata".into(),
        (None, false) => {
            format!("a folder of other files, such as {}", told(&files).unwrap_or_default())
        }
    };
    Err(Problem::NotAFile { found })
}

/// Files of a folder that are looked into.
const LOOKED_AT: usize = 500;

/// As many names as a sentence has room for; `None` of none.
fn told(names: &[String]) -> Option<String> {
    const TOLD: usize = 3;
    let some = &names[..names.len().min(TOLD)];
    (!some.is_empty()).then(|| some.join(", "))
}

/// The names of a folder's files, in order.
fn files_by_name(folder: &Path) -> Vec<String> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let files = files.filter(|entry| entry.path().is_file());
    let mut names: Vec<String> =
        files.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort_unstable();
    names
}

/// What a gzip file holds, by its first bytes; only formats that are read so.
fn packed(unpacked: &[u8]) -> Option<Format> {
    nifti::format_of(unpacked).or_else(|| mrc::looks_like_it(unpacked).then_some(Format::Mrc))
}

fn not_as_named(expected: &str, start: &[u8]) -> Problem {
    let found = match foreign(start) {
        Some(other) => other.to_owned(),
        None => format!("bytes that begin with {}", quoted_bytes(start)),
    };
    unrecognised(expected, found, "check that the file has the right extension and is undamaged")
}

fn by_content(start: &[u8]) -> Result<Option<Format>, Problem> {
    // Its first 128 bytes may be those of another format.
    if dicom::looks_like_it(start) {
        return Ok(Some(Format::Dicom));
    }
    if tiff::looks_like_it(start) {
        return Ok(Some(Format::Tiff));
    }
    if start.starts_with(b"NRRD") {
        return Ok(Some(Format::Nrrd));
    }
    if let Some(kind) = vtk_xml::file_type(start) {
        return vtk_xml::format_of(&kind).map(Some);
    }
    if start.starts_with(vrbf::MAGIC) {
        return Ok(Some(Format::Vrbf));
    }
    if start.starts_with(vtk::MAGIC) {
        return Ok(Some(Format::Vtk));
    }
    if let Some(format) = netcdf::format_of(start)? {
        return Ok(Some(format));
    }
    if let Some(format) = nifti::format_of(start) {
        return Ok(Some(format));
    }
    if numpy::looks_like_it(start) {
        return Ok(Some(Format::NumPy));
    }
    if mrc::looks_like_it(start) {
        return Ok(Some(Format::Mrc));
    }
    Ok(metaimage::looks_like_it(start).then_some(Format::MetaImage))
}

/// Whether the first bytes of a file are words rather than samples.
fn is_text(start: &[u8]) -> bool {
    let whole = match std::str::from_utf8(start) {
        Ok(text) => text.len(),
        // The last letter may be cut off.
        Err(error) if error.error_len().is_none() => error.valid_up_to(),
        Err(_) => return false,
    };
    let is_written = |byte: &u8| !byte.is_ascii_control() || byte.is_ascii_whitespace();
    whole > 0 && start[..whole].iter().all(is_written)
}

/// The name of a well-known format that is not read, by its first bytes.
fn foreign(start: &[u8]) -> Option<&'static str> {
    const MAGIC: [(&[u8], &str); 14] = [
        (b"\x1f\x8b", "a gzip file"),
        (b"BZh", "a bzip2 file"),
        (b"\xfd7zXZ", "an xz file"),
        (b"\x28\xb5\x2f\xfd", "a zstd file"),
        (b"7z\xbc\xaf", "a 7z archive"),
        (b"Rar!", "a RAR archive"),
        (b"PK\x03\x04", "a zip archive"),
        (b"\x89PNG", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (b"GIF8", "a GIF picture"),
        (b"BM", "a BMP picture"),
        (b"%PDF", "a PDF document"),
        (b"\x7fELF", "a program"),
        (b"MATLAB 5.0", "a MATLAB file"),
    ];
    MAGIC.iter().find(|(magic, _)| start.starts_with(magic)).map(|(_, name)| *name)
}

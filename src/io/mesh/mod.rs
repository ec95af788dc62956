//! Files of triangles: STL, PLY and OBJ, positions as they stand, which is world space.
//!
//! A file that holds nothing else is opened alone as a volume's is ([`surface_of`]): its points and what they carry as a grid,
//! its triangles as a mesh with the same numbers on it.
//!
//! Crates parse; here is what is checked before they may and after. A file is read whole, once memory
//! is known to hold it and what becomes of it.

mod alone;
mod obj;
mod ply;
mod points;
mod stl;

use std::io::{self, Cursor, Read, Seek};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::{Problem, ReadError, corrupt, quoted_bytes, truncated, unrecognised};
use super::files;
use crate::core::memory::{self, require};
use crate::core::progress::Ticket;
use crate::core::triangles_of;
use crate::polygons::{Mesh, MeshArray, MeshError, MeshValues};

pub use alone::{array_name, drawn_name, surface_of};
pub(super) use alone::{format_of, read_alone};

/// A file format of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MeshFormat {
    /// Stereolithography, ascii or binary.
    Stl,
    /// Stanford's polygon format, ascii or binary.
    Ply,
    /// Wavefront's, without materials.
    Obj,
}

impl MeshFormat {
    /// The lower-case word that `info` and scripts use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Ply => "ply",
            Self::Obj => "obj",
        }
    }

    /// What files of it end in.
    pub const EXTENSIONS: [&str; 3] = ["stl", "ply", "obj"];

    /// The format of files of this name.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_lowercase();
        match extension.as_str() {
            "stl" => Some(Self::Stl),
            "ply" => Some(Self::Ply),
            "obj" => Some(Self::Obj),
            _ => None,
        }
    }
}

/// A file's triangles in memory.
#[derive(Debug, Clone)]
pub struct OpenedMesh {
    /// The triangles, named as the file is.
    pub mesh: Mesh,
    /// The file.
    pub path: PathBuf,
    /// What was ignored or repaired, one sentence each.
    pub warnings: Vec<String>,
}

/// Bytes that become of one byte of a file, at most: of binary PLY with 8-bit coordinates, beside its
/// elements while they are sorted out.
const MOST_GROWTH: u64 = 40;

/// Reads a file of triangles; `memory_limit_bytes` of `None` is what the system says is free.
///
/// # Errors
/// What was expected, what was found and what to try, with the path last.
pub fn open(
    path: &Path,
    memory_limit_bytes: Option<u64>,
    ticket: &Ticket,
) -> Result<OpenedMesh, ReadError> {
    let free_bytes = memory_limit_bytes.unwrap_or_else(memory::free_bytes);
    read(path, free_bytes, ticket).map_err(|problem| match ticket.checkpoint(0, 1) {
        Err(cancelled) => Problem::from(cancelled).at(path),
        Ok(()) => problem.at(path),
    })
}

fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<OpenedMesh, Problem> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if MeshFormat::of(path).is_none()
        && let Some(opened) = alone::of_cells(path, &name, free_bytes, ticket)?
    {
        return Ok(opened);
    }
    let (parts, _, mut warnings) = parts_of(path, free_bytes, ticket)?;
    let Parts { positions, normals, colours, triangles, numbers } = parts;
    #[expect(clippy::cast_possible_truncation, reason = "colours need no more digits")]
    let narrow = |values: Vec<f64>| values.into_iter().map(|v| v as f32).collect();
    let array = |(name, values)| MeshArray { name, values: MeshValues::Corners(narrow(values)) };
    let arrays = numbers.into_iter().map(array).collect();
    let mesh = Mesh::of_places(name, &positions, normals, colours, triangles)
        .and_then(|mesh| mesh.with_arrays(arrays))
        .map_err(no_mesh)?;
    let mesh = without_doubles(mesh, &mut warnings).softened();
    let degenerate = mesh.degenerate();
    if degenerate > 0 {
        warnings.push(format!(
            "{degenerate} of {} triangles have no area and are not drawn",
            mesh.len()
        ));
    }
    Ok(OpenedMesh { mesh, path: path.to_owned(), warnings })
}

/// Leaves out triangles that lie exactly on others, and says so.
fn without_doubles(mesh: Mesh, warnings: &mut Vec<String>) -> Mesh {
    let all = mesh.len();
    let (mesh, doubles) = mesh.without_doubles();
    if doubles > 0 {
        warnings
            .push(format!("{doubles} of {all} triangles lie exactly on others and are left out"));
    }
    mesh
}

/// What a file of triangles holds, and what was ignored of it.
fn parts_of(
    path: &Path,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<(Parts, MeshFormat, Vec<String>), Problem> {
    let (mut file, len) = files::open_file(path)?;
    if len == 0 {
        return Err(Problem::Empty);
    }
    require("a mesh", len.saturating_mul(MOST_GROWTH), free_bytes)?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(Problem::Io)?;
    let format = recognise(path, &bytes)?;
    let mut warnings = Vec::new();
    let parts = match format {
        MeshFormat::Stl => stl::read(bytes, ticket, &mut warnings),
        MeshFormat::Ply => ply::read(bytes, ticket),
        MeshFormat::Obj => obj::read(bytes, ticket),
    }?;
    Ok((parts, format, warnings))
}

/// What readers find.
#[derive(Debug, Default)]
struct Parts {
    /// World.
    positions: Vec<glam::DVec3>,
    normals: Vec<glam::Vec3>,
    colours: Vec<crate::core::Srgb8>,
    triangles: Vec<[u32; 3]>,
    /// Other numbers of the corners, by name.
    numbers: Vec<(String, Vec<f64>)>,
}

impl Parts {
    /// A polygon's triangles. Corners that are not there are told later.
    fn push_polygon(&mut self, corners: &[u32]) {
        let place = |corner: &u32| self.positions.get(*corner as usize).copied();
        let places: Vec<_> =
            corners.iter().map(|corner| place(corner).unwrap_or(glam::DVec3::NAN)).collect();
        self.triangles.extend(triangles_of(&places).into_iter().map(|t| t.map(|i| corners[i])));
    }
}

/// What a file of triangles may be.
const EXPECTED: &str =
    "a mesh in an STL, PLY or OBJ file (.stl, .ply, .obj), or cells of VTK or Exodus II";

fn recognise(path: &Path, bytes: &[u8]) -> Result<MeshFormat, Problem> {
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Ok(MeshFormat::Ply);
    }
    MeshFormat::of(path).ok_or_else(|| {
        unrecognised(
            EXPECTED,
            format!("bytes that begin with {}", quoted_bytes(bytes)),
            "convert it, or give the file the ending of its format",
        )
    })
}

/// What the triangles of a file do not make.
pub(super) fn no_mesh(error: MeshError) -> Problem {
    let text = error.to_string();
    // It says what was expected, found and to be tried, as a mismatch does.
    let (expected, rest) = text.split_once(", found ").unwrap_or((&text, ""));
    let (found, advice) = rest.split_once("; ").unwrap_or((rest, ""));
    corrupt(expected.trim_start_matches("expected "), found, advice)
}

/// What a parser says of a file that it cannot read.
fn unreadable(what: &str, error: &io::Error) -> Problem {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => truncated(
            format!("the whole of {what}"),
            "that it ends too soon",
            "the file was cut short: copy it again",
        ),
        _ => corrupt(
            format!("{what} that can be read"),
            // The line that it is about; behind it stands how far the parser had come.
            super::error::quoted(error.to_string().lines().next().unwrap_or_default()),
            "the file is damaged, or of another format: write it again",
        ),
    }
}

/// Bytes in memory that stop coming once a ticket is cancelled, and tell it how far they are.
struct Watched<'a> {
    bytes: Cursor<Vec<u8>>,
    ticket: &'a Ticket,
}

impl<'a> Watched<'a> {
    fn new(bytes: Vec<u8>, ticket: &'a Ticket) -> Self {
        Self { bytes: Cursor::new(bytes), ticket }
    }
}

impl Read for Watched<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let total = self.bytes.get_ref().len() as u64;
        let checked = self.ticket.checkpoint(self.bytes.position(), total);
        checked.map_err(io::Error::other)?;
        self.bytes.read(to)
    }
}

impl Seek for Watched<'_> {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

//! Surfaces as files that are opened by themselves, and the surfaces of files of cells.

use std::path::Path;

use glam::{DVec3, Vec3};

use super::super::error::{Problem, ReadError, header, unrecognised};
use super::super::unstructured::{self, Part, field_of, kind};
use super::super::{Format, OpenOptions, Opened};
use super::points;
use super::{EXPECTED, MeshFormat, OpenedMesh, Parts, no_mesh, parts_of, without_doubles};
use crate::cells::Listing;
use crate::core::Srgb8;
use crate::core::progress::Ticket;
use crate::polygons::{Mesh, MeshArray, MeshError, MeshValues};
use crate::volume::{Association, Component, Field, Grid, Samples, Shape, VolumeError};

/// The format of a file of triangles, by its first bytes, and only where these say nothing by its name.
pub(in super::super) fn format_of(path: &Path, start: &[u8]) -> Option<MeshFormat> {
    if start.starts_with(b"ply\n") || start.starts_with(b"ply\r") {
        return Some(MeshFormat::Ply);
    }
    MeshFormat::of(path)
}

/// A file of triangles or points as a grid: its points with the numbers that they carry, and its triangles as cells.
pub(in super::super) fn read_alone(
    path: &Path,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Opened, Problem> {
    let (parts, format, mut warnings) = parts_of(path, free_bytes, ticket)?;
    let Parts { positions, colours, triangles, numbers, .. } = parts;
    if positions.is_empty() {
        let (expected, advice) = match format {
            // Its points are read as corners of faces.
            MeshFormat::Obj => {
                ("at least one face (a line \"f …\") on points of an OBJ file", "faces")
            }
            MeshFormat::Stl => ("at least one triangle in an STL file", "triangles"),
            MeshFormat::Ply => ("at least one vertex in a PLY file", "vertices"),
        };
        return Err(header(expected, "none", format!("write the file again with its {advice}")));
    }
    let has_triangles = !triangles.is_empty();
    let types = vec![kind::TRIANGLE; triangles.len()];
    let starts = (0..=triangles.len()).map(|triangle| 3 * triangle).collect();
    let corners = triangles.into_iter().flatten().collect();
    let listing = Listing { points: positions, types, starts, corners, ..Listing::default() };
    let field = |(name, values): (String, Vec<f64>)| {
        field_of(name, (1, Association::Point), Samples::Float64(values))
    };
    let own_colours = (!colours.is_empty()).then(|| {
        let bytes = colours.iter().flat_map(|colour| colour.0).collect();
        field_of("rgb", (3, Association::Point), Samples::UInt8(bytes))
    });
    let fields = own_colours.into_iter().chain(numbers.into_iter().map(field)).collect();
    let grid = unstructured::grid(Part { listing, fields }, &[], free_bytes, &mut warnings)?;
    // Files of points have none, which is not worth a word.
    warnings.extend(unstructured::points_alone(&grid).filter(|_| has_triangles));
    Ok(Opened::of(grid, Format::Polygons(format), warnings))
}

/// The surface of a file of cells: its polygons, and the outer faces of its solids. `None` of other files.
pub(super) fn of_cells(
    path: &Path,
    name: &str,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Option<OpenedMesh>, Problem> {
    let format = match super::super::recognise(path) {
        Ok(Format::Polygons(_)) | Err(_) => return Ok(None),
        Ok(format) => format,
    };
    let no_triangles = || {
        unrecognised(
            EXPECTED,
            format!("a volume or points ({})", format.name()),
            "open it by itself; an isosurface (--iso) shows where a volume has a value",
        )
    };
    if !matches!(format, Format::Vtu | Format::Vtp | Format::Vtk | Format::Exodus | Format::NetCdf)
    {
        return Err(no_triangles());
    }
    let options = OpenOptions { memory_limit_bytes: Some(free_bytes), ..OpenOptions::default() };
    let opened = super::super::read(path, &options, ticket)?;
    if !matches!(opened.grid.shape, Shape::Unstructured(_)) {
        return Err(no_triangles());
    }
    let mesh = mesh_of(&opened.grid, name, None, ticket).map_err(|error| match error {
        Unmade::Mesh(error) => no_mesh(error),
        Unmade::Volume(error) => Problem::from(error),
    })?;
    let is_told = |warning: &String| !warning.contains(unstructured::EMBED_THEM);
    let mut warnings = opened.warnings.into_iter().filter(is_told).collect();
    let mesh = without_doubles(mesh, &mut warnings).softened();
    Ok(Some(OpenedMesh { mesh, path: path.to_owned(), warnings }))
}

/// The polygons of a file that has no cell with volume, or bodies about its points where it has no polygons either, with its fields
/// as numbers on them ([`array_name`]), that which is drawn among them; `None` of other files. What was told of the file already is
/// not told again.
///
/// # Errors
/// Too little memory; cancelled; a file that changed since it was opened.
pub fn surface_of(
    path: &Path,
    grid: &Grid,
    drawn: (&Field, Component),
    told: &[String],
    ticket: &Ticket,
) -> Result<Option<OpenedMesh>, ReadError> {
    let Shape::Unstructured(cells) = &grid.shape else { return Ok(None) };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if cells.solids().is_empty() && !cells.is_surface() {
        let mesh = points::mesh(&name, grid, drawn, ticket);
        let mesh = mesh.map_err(|problem| problem.at(path))?;
        let opened = |(mesh, mut warnings): (_, Vec<String>)| {
            warnings.retain(|warning| !told.contains(warning));
            OpenedMesh { mesh, path: path.to_owned(), warnings }
        };
        return Ok(mesh.map(opened));
    }
    if !cells.is_surface() {
        return Ok(None);
    }
    if MeshFormat::of(path).is_some() {
        // It may have normals and colours, too, which grids have not. What has corners that lie nowhere is no mesh, and
        // a grid without them.
        match super::open(path, None, ticket) {
            Ok(mut opened) => {
                opened.warnings.retain(|warning| !told.contains(warning));
                return Ok(Some(opened));
            }
            Err(error) if error.is_cancelled() => return Err(error),
            Err(_) => {}
        }
    }
    match mesh_of(grid, &name, Some(drawn), ticket) {
        Ok(mesh) => {
            let mut warnings = Vec::new();
            let mesh = without_doubles(mesh, &mut warnings).softened();
            warnings.retain(|warning| !told.contains(warning));
            Ok(Some(OpenedMesh { mesh, path: path.to_owned(), warnings }))
        }
        // All of its polygons are of points that lie nowhere.
        Err(Unmade::Mesh(_)) => Ok(None),
        Err(Unmade::Volume(error)) => Err(Problem::from(error).at(path)),
    }
}

/// Why there is no mesh.
enum Unmade {
    Mesh(MeshError),
    Volume(VolumeError),
}

fn mesh_of(
    grid: &Grid,
    name: &str,
    drawn: Option<(&Field, Component)>,
    ticket: &Ticket,
) -> Result<Mesh, Unmade> {
    let Shape::Unstructured(cells) = &grid.shape else {
        return Err(Unmade::Mesh(MeshError::Empty));
    };
    let triangles =
        cells.triangles(ticket).map_err(|cancelled| Unmade::Volume(cancelled.into()))?;
    let (triangles, sources): (Vec<[u32; 3]>, Vec<u32>) = triangles.into_iter().unzip();
    // Points that no triangle has may lie anywhere.
    let mut is_used = vec![false; cells.points().len()];
    triangles.iter().flatten().for_each(|point| is_used[*point as usize] = true);
    let first = triangles.first().map_or(DVec3::ZERO, |t| cells.points()[t[0] as usize]);
    let place = |(point, is_used): (&DVec3, bool)| if is_used { *point } else { first };
    let positions: Vec<_> = cells.points().iter().zip(is_used).map(place).collect();
    let mut arrays: Vec<MeshArray> = Vec::new();
    let usual = grid.fields.iter().map(|field| (field, Component::usual(field.components)));
    for (field, component) in drawn.into_iter().chain(usual) {
        let name = array_name(field, component);
        if arrays.iter().any(|array| array.name == name) {
            continue;
        }
        let own = grid.samples_of(field, component, ticket).map_err(Unmade::Volume)?;
        let own: Vec<f64> = (0..own.len()).map(|i| own.get(i)).collect();
        if stands_in(grid, field) {
            continue;
        }
        #[expect(clippy::cast_possible_truncation, reason = "colours need no more digits")]
        let narrow = |v: f64| v as f32;
        let values = match field.association {
            Association::Point => {
                MeshValues::Corners(cells.with_added(own).into_iter().map(narrow).collect())
            }
            Association::Cell => MeshValues::Triangles(
                sources.iter().map(|cell| narrow(own[*cell as usize])).collect(),
            ),
        };
        arrays.push(MeshArray { name, values });
    }
    let own = colours_of(grid, drawn.map(|(field, _)| field));
    let at = |i: usize| own.map(|field| colour_at(field, i));
    let (mut of_corners, mut of_triangles) = (Vec::new(), Vec::new());
    match own.map(|field| field.association) {
        // Splits add points to cells with volume alone, whose files have such colours hardly ever.
        Some(Association::Point) if positions.len() == cells.own_points() => {
            of_corners = (0..positions.len()).filter_map(at).collect();
        }
        Some(Association::Cell) => {
            of_triangles = sources.iter().filter_map(|cell| at(*cell as usize)).collect();
        }
        _ => {}
    }
    let mesh = Mesh::of_places(name, &positions, normals_of(grid), of_corners, triangles);
    let mesh = mesh.and_then(|mesh| mesh.with_arrays(arrays)).map_err(Unmade::Mesh)?;
    match of_triangles.is_empty() {
        true => Ok(mesh),
        false => mesh.with_triangle_colours(of_triangles).map_err(Unmade::Mesh),
    }
}

/// The field that holds a file's own colours: that which is drawn where it does, else the first.
pub(super) fn colours_of<'a>(grid: &'a Grid, drawn: Option<&'a Field>) -> Option<&'a Field> {
    let is_it = |field: &&Field| unstructured::holds_colours(field);
    drawn.filter(is_it).or_else(|| grid.fields.iter().find(is_it))
}

/// The colour of a point or cell.
pub(super) fn colour_at(field: &Field, i: usize) -> Srgb8 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bytes")]
    let channel = |c: usize| field.samples.get(field.components * i + c) as u8;
    Srgb8([0, 1, 2].map(channel))
}

/// Whether a field stands in for those that a file has none of, which says nothing.
fn stands_in(grid: &Grid, field: &Field) -> bool {
    let is_alone = grid.fields.len() == 1 && ["cell", "point"].contains(&&*field.name);
    is_alone && (0..field.samples.len()).all(|i| field.samples.get(i) == i as f64)
}

/// The normals that a file has at its points; none of others.
fn normals_of(grid: &Grid) -> Vec<Vec3> {
    let Shape::Unstructured(cells) = &grid.shape else { return Vec::new() };
    let are_normals = |field: &&Field| {
        field.name.eq_ignore_ascii_case("normals")
            && field.components == 3
            && field.association == Association::Point
            // Splits add points, which have none.
            && field.samples.len() == 3 * cells.points().len()
    };
    let Some(field) = grid.fields.iter().find(are_normals) else { return Vec::new() };
    let at = |i: usize| DVec3::from([0, 1, 2].map(|c| field.samples.get(3 * i + c))).as_vec3();
    (0..cells.points().len()).map(at).collect()
}

/// What a surface is coloured by where a number of a field is chosen: [`array_name`], and `None` where that are colours, which it
/// has of its own.
pub fn drawn_name(field: &Field, component: Component) -> Option<String> {
    let are_colours = unstructured::holds_colours(field) && component == Component::Magnitude;
    (!are_colours).then(|| array_name(field, component))
}

/// What a number of a field is called among the numbers on a mesh.
pub fn array_name(field: &Field, component: Component) -> String {
    match (field.components, component) {
        (1, _) => field.name.clone(),
        (_, Component::Index(index)) => format!("{} [{index}]", field.name),
        _ => format!("{} ({})", field.name, component.word()),
    }
}

//! Points that no cell joins: a small octahedron about each, lit as a ball is, in the point's own colour or by its numbers.

use glam::{DVec3, Vec3};

use super::super::error::Problem;
use super::alone::{array_name, colour_at, colours_of};
use super::no_mesh;
use crate::core::memory::{self, require};
use crate::core::progress::Ticket;
use crate::polygons::{Mesh, MeshArray, MeshValues};
use crate::rbf::next_distance;
use crate::volume::{Component, Field, Grid, Shape};

/// How far corners lie from their point, of how far apart points lie.
const RADIUS: f64 = 0.75;
/// Bytes of a point: corners, normals, colours and triangles, and as much while they are drawn.
const BYTES: u64 = 1500;
/// The corners of each triangle of an octahedron, whose corners lie at the ends of the axes.
const FACES: [[u32; 3]; 8] =
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];

/// The octahedra, about the places that the drawn field has values at, with these and the numbers of other fields there.
/// `None` where no place is finite.
pub(super) fn mesh(
    name: &str,
    grid: &Grid,
    (drawn, component): (&Field, Component),
    ticket: &Ticket,
) -> Result<Option<Mesh>, Problem> {
    let Shape::Unstructured(cells) = &grid.shape else { return Ok(None) };
    let places = drawn.association.places(cells);
    require("the points as small bodies", BYTES * places.len() as u64, memory::free_bytes())?;
    let there: Vec<usize> = (0..places.len()).filter(|i| places[*i].is_finite()).collect();
    if there.is_empty() {
        return Ok(None);
    }
    let radius = RADIUS * next_distance(&places);
    let ends = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    let about = |i: &usize| {
        let centre = places[*i];
        ends.clone().map(move |end| centre + end * radius)
    };
    let positions: Vec<DVec3> = there.iter().flat_map(about).collect();
    let normals: Vec<Vec3> = there.iter().flat_map(|_| ends.clone().map(|e| e.as_vec3())).collect();
    let own = colours_of(grid, Some(drawn)).filter(|own| own.association == drawn.association);
    let colours = own.map(|own| there.iter().flat_map(|i| [colour_at(own, *i); 6]).collect());
    #[expect(clippy::cast_possible_truncation, reason = "memory was asked for")]
    let faces = (0..there.len() as u32).flat_map(|i| FACES.map(|face| face.map(|c| 6 * i + c)));
    let mut arrays: Vec<MeshArray> = Vec::new();
    let usual = grid.fields.iter().map(|field| (field, Component::usual(field.components)));
    for (field, component) in std::iter::once((drawn, component)).chain(usual) {
        let name = array_name(field, component);
        let is_known = arrays.iter().any(|array| array.name == name);
        if is_known || field.association != drawn.association {
            continue;
        }
        let samples = grid.samples_of(field, component, ticket)?;
        #[expect(clippy::cast_possible_truncation, reason = "colours need no more digits")]
        let values = there.iter().flat_map(|i| [samples.get(*i) as f32; 6]).collect();
        arrays.push(MeshArray { name, values: MeshValues::Corners(values) });
    }
    let mesh =
        Mesh::of_places(name, &positions, normals, colours.unwrap_or_default(), faces.collect());
    mesh.and_then(|mesh| mesh.with_arrays(arrays)).map(Some).map_err(no_mesh)
}

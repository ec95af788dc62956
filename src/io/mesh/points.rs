//! Points that no cell joins: a small octahedron about each, lit as a ball is, in the point's own colour or by its numbers.

use glam::{DVec3, Vec3};

use super::super::error::Problem;
use super::super::unstructured::{THINNER_THAN_A_PIXEL, in_short};
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

/// Of a hundred points so many may lie far from the others at either end of an axis.
const FAR_OF_HUNDRED: f64 = 0.5;
const LEAST_TO_STRAY: usize = 20;
/// The box of all is so many times longer where some lie far from the others.
const FAR: f64 = 10.0;

/// What is to be framed of points of which a few lie far from all others, and how many these are: about the box that holds
/// the rest, on each side as much again. `None` where none does.
fn frame_of(places: &[DVec3]) -> Option<([DVec3; 2], usize)> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "fewer than there are"
    )]
    let few = (places.len() as f64 * FAR_OF_HUNDRED / 100.0).ceil() as usize;
    let last = places.len().checked_sub(1)?;
    // Of a handful none is a stray one.
    if LEAST_TO_STRAY > places.len() {
        return None;
    }
    let ends = [0, 1, 2].map(|axis| {
        let mut along: Vec<f64> = places.iter().map(|at| at[axis]).collect();
        let mut at = |place: usize| *along.select_nth_unstable_by(place, f64::total_cmp).1;
        [0, few, last - few, last].map(&mut at)
    });
    let [least, low, high, most] = [0, 1, 2, 3].map(|end| DVec3::from(ends.map(|of| of[end])));
    let rest = high - low;
    let frame = [low - rest, high + rest];
    let extent = |low: DVec3, high: DVec3| (high - low).max_element();
    let is_far = rest.max_element() > 0.0 && extent(least, most) > FAR * extent(frame[0], frame[1]);
    let beyond = || places.iter().filter(|at| at.clamp(frame[0], frame[1]) != **at).count();
    is_far.then(|| (frame, beyond()))
}

/// The octahedra, about the places that the drawn field has values at, with these and the numbers of other fields there,
/// and what is told of them. `None` where no place is finite.
pub(super) fn mesh(
    name: &str,
    grid: &Grid,
    (drawn, component): (&Field, Component),
    ticket: &Ticket,
) -> Result<Option<(Mesh, Vec<String>)>, Problem> {
    let Shape::Unstructured(cells) = &grid.shape else { return Ok(None) };
    let places = drawn.association.places(cells);
    require("the points as small bodies", BYTES * places.len() as u64, memory::free_bytes())?;
    let there: Vec<usize> = (0..places.len()).filter(|i| places[*i].is_finite()).collect();
    if there.is_empty() {
        return Ok(None);
    }
    let all: Vec<DVec3> = there.iter().map(|i| places[*i]).collect();
    let frame = frame_of(&all);
    let far = frame.map(|(_, beyond)| {
        let lie = if beyond == 1 { "lies" } else { "lie" };
        format!(
            "{beyond} of {} points {lie} far from the others, which the first view frames; zoom out to see all",
            all.len()
        )
    });
    let spacing = next_distance(&places);
    let radius = RADIUS * spacing;
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let whole = all.iter().fold(none, |[low, high], at| [low.min(*at), high.max(*at)]);
    let [low, high] = frame.map_or(whole, |(frame, _)| frame);
    let extent = (high - low).max_element();
    let small = (spacing * THINNER_THAN_A_PIXEL < extent).then(|| {
        format!(
            "the points lie about {} apart, and {} from one end to the other: each is smaller than a pixel of a picture of them \
             all; zoom in to see them",
            in_short(spacing),
            in_short(extent)
        )
    });
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
    let mesh = mesh.and_then(|mesh| mesh.with_arrays(arrays)).map_err(no_mesh)?;
    Ok(Some((
        mesh.framed_by(frame.map(|(frame, _)| frame)),
        far.into_iter().chain(small).collect(),
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Vec<DVec3> {
        (0..1000).map(|i| DVec3::from([i % 10, i / 10 % 10, i / 100].map(f64::from))).collect()
    }

    #[test]
    fn what_lies_far_from_the_rest_is_counted_and_not_framed() {
        assert_eq!(frame_of(&cube()), None);
        let far = [DVec3::X * 1e5, DVec3::Y * -1e5, DVec3::new(1e4, 1e4, 0.0)];
        let with = |far: &[DVec3]| [cube(), far.to_vec()].concat();
        let (frame, beyond) = frame_of(&with(&far)).expect("three lie far away");
        assert_eq!((frame, beyond), ([DVec3::splat(-9.0), DVec3::splat(18.0)], 3));
        // Three of twelve are no stray ones, and what is within ten frames is seen all the same.
        assert_eq!(frame_of(&with(&[DVec3::X * 200.0])), None);
        assert!(frame_of(&with(&[DVec3::X * 400.0])).is_some());
        assert_eq!(frame_of(&[&cube()[..9], &far].concat()), None);
        assert_eq!(frame_of(&[]), None);
        assert_eq!(frame_of(&far[..1]), None);
        assert_eq!(frame_of(&[&cube()[..18], &far[..1]].concat()), None, "a handful");
        assert!(frame_of(&[&cube()[..30], &far[..1]].concat()).is_some());
        // Most at one place leave nothing to frame.
        assert_eq!(frame_of(&[&[DVec3::ONE; 50], &far[..1]].concat()), None);
    }
}

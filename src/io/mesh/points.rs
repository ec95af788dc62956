//! Points that no cell joins: a small ball about each place, an octahedron where there are many, in its own colour or by its
//! numbers.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::iter::repeat_n;

use glam::{DVec3, Vec3};

use super::super::error::Problem;
use super::super::unstructured::{THINNER_THAN_A_PIXEL, in_short};
use super::alone::{array_name, colour_at, colours_of};
use super::no_mesh;
use crate::core::memory::{self, require};
use crate::core::progress::Ticket;
use crate::polygons::{Mesh, MeshArray, MeshValues};
use crate::rbf::next_distance;
use crate::volume::{Component, Field, Grid, Shape, TIMES_FRAMED, without_strays};

/// How far the corners of octahedra lie from their place, and the surface of balls, of how far places lie apart.
const OCTAHEDRON: f64 = 0.75;
const BALL: f64 = 0.45;
/// No body's radius is a larger share of what holds all that do not stray.
const WIDEST: f64 = 0.05;
/// Bytes of a triangle with its part of corners, normals and colours, and as much while they are drawn.
const BYTES: u64 = 190;
/// Balls have no more triangles than this, all together.
const MOST_TRIANGLES: usize = 1 << 18;
/// An octahedron's triangles are split so often, at most.
const FINEST: u32 = 3;

/// The corners of a ball of radius 1, and of each of its triangles, counter-clockwise from outside.
struct Ball {
    corners: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
}

impl Ball {
    /// An octahedron whose triangles were split into four so often.
    fn split(times: u32) -> Self {
        let faces = vec![
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        let mut ball = Self {
            corners: DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).collect(),
            faces,
        };
        for _ in 0..times {
            let mut middles = HashMap::new();
            let corners = &mut ball.corners;
            let mut middle = |a: u32, b: u32| {
                *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    corners.push((corners[a as usize] + corners[b as usize]).normalize());
                    corners.len() as u32 - 1
                })
            };
            let split = |[a, b, c]: [u32; 3]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            };
            ball.faces = std::mem::take(&mut ball.faces).into_iter().flat_map(split).collect();
        }
        ball
    }

    /// As round as so many may be.
    fn of_many(count: usize) -> (Self, u32) {
        let triangles = |times: &u32| count.saturating_mul(8 << (2 * times));
        let times = (0..=FINEST).rev().find(|times| triangles(times) <= MOST_TRIANGLES);
        let times = times.unwrap_or(0);
        (Self::split(times), times)
    }
}

/// The numbers of those that lie at one place, for each place, in the order of the first of each.
fn by_place(places: &[DVec3]) -> Vec<Vec<usize>> {
    let mut numbers: HashMap<[u64; 3], usize> = HashMap::new();
    let mut all: Vec<Vec<usize>> = Vec::new();
    for (i, at) in places.iter().enumerate().filter(|(_, at)| at.is_finite()) {
        // −0 is at the place of 0.
        let key = (*at + DVec3::ZERO).to_array().map(f64::to_bits);
        match numbers.entry(key) {
            Entry::Occupied(known) => all[*known.get()].push(i),
            Entry::Vacant(new) => {
                new.insert(all.len());
                all.push(vec![i]);
            }
        }
    }
    all
}

/// The mean of the numbers that are there; NaN of none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let there: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    let count = there.len() as f64;
    if there.is_empty() { f64::NAN } else { there.into_iter().map(|value| value / count).sum() }
}

/// The bodies, about the places that the drawn field has values at, with these and the numbers of other fields there, of
/// several at one place their means; and what is told of them. `None` where no place is finite.
pub(super) fn mesh(
    name: &str,
    grid: &Grid,
    (drawn, component): (&Field, Component),
    ticket: &Ticket,
) -> Result<Option<(Mesh, Vec<String>)>, Problem> {
    let Shape::Unstructured(cells) = &grid.shape else { return Ok(None) };
    let places = drawn.association.places(cells);
    let there = by_place(&places);
    if there.is_empty() {
        return Ok(None);
    }
    let (ball, times) = Ball::of_many(there.len());
    let needed = BYTES * (ball.faces.len() * there.len()) as u64;
    require("the points as small bodies", needed, memory::free_bytes())?;
    let all: Vec<DVec3> = there.iter().flatten().map(|i| places[*i]).collect();
    let frame = without_strays(&all);
    let far = frame.map(|(_, beyond)| {
        let (lie, they) = if beyond == 1 { ("lies", "it is") } else { ("lie", "they are") };
        format!(
            "{beyond} of {} points {lie} far from the others, which the first view frames; zoom out to see all. As ellipsoids \
             {they} left out",
            all.len()
        )
    });
    let values = grid.samples_of(drawn, component, ticket)?;
    let without = all.len() - there.iter().flatten().filter(|i| !values.get(**i).is_nan()).count();
    let holes = (without > 0).then(|| {
        let has = if without == 1 { "has" } else { "have" };
        let is = if without == 1 { "is" } else { "are" };
        format!(
            "{without} of {} points {has} no value of {:?} (NaN) and {is} not drawn",
            all.len(),
            drawn.name
        )
    });
    let spacing = next_distance(&places);
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let whole = all.iter().fold(none, |[low, high], at| [low.min(*at), high.max(*at)]);
    let [low, high] = frame.map_or(whole, |(frame, _)| frame);
    let extent = (high - low).max_element();
    // One alone has nothing to be small beside.
    let body = if frame.is_some() { extent / TIMES_FRAMED } else { extent };
    let widest = if body > 0.0 { WIDEST * body } else { f64::INFINITY };
    let radius = (if times == 0 { OCTAHEDRON } else { BALL } * spacing).min(widest);
    let small = (spacing * THINNER_THAN_A_PIXEL < extent).then(|| {
        format!(
            "the points lie about {} apart, and {} from one end to the other: each is smaller than a pixel of a picture of them \
             all; zoom in to see them",
            in_short(spacing),
            in_short(extent)
        )
    });
    let about = |own: &Vec<usize>| {
        let centre = places[own[0]];
        ball.corners.iter().map(move |corner| centre + *corner * radius)
    };
    let positions: Vec<DVec3> = there.iter().flat_map(about).collect();
    let of_ball = || ball.corners.iter().map(|corner| corner.as_vec3());
    let normals: Vec<Vec3> = there.iter().flat_map(|_| of_ball()).collect();
    let own = colours_of(grid, Some(drawn)).filter(|own| own.association == drawn.association);
    let corners = ball.corners.len();
    let of_first =
        |colours| there.iter().flat_map(move |own| repeat_n(colour_at(colours, own[0]), corners));
    let colours = own.map(|own| of_first(own).collect());
    #[expect(clippy::cast_possible_truncation, reason = "memory was asked for")]
    let faces = (0..there.len() as u32)
        .flat_map(|i| ball.faces.iter().map(move |face| face.map(|c| corners as u32 * i + c)));
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
        let value = |own: &Vec<usize>| mean(own.iter().map(|i| samples.get(*i))) as f32;
        let values = there.iter().flat_map(|own| repeat_n(value(own), corners)).collect();
        arrays.push(MeshArray { name, values: MeshValues::Corners(values) });
    }
    let mesh =
        Mesh::of_places(name, &positions, normals, colours.unwrap_or_default(), faces.collect());
    let mesh = mesh.and_then(|mesh| mesh.with_arrays(arrays)).map_err(no_mesh)?;
    Ok(Some((
        mesh.framed_by(frame.map(|(frame, _)| frame)).of_points(),
        far.into_iter().chain(small).chain(holes).collect(),
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balls_are_as_round_as_their_number_allows() {
        for (count, times) in
            [(1, 3), (512, 3), (513, 2), (2048, 2), (8192, 1), (8193, 0), (usize::MAX, 0)]
        {
            assert_eq!(Ball::of_many(count).1, times, "{count}");
        }
        for times in 0..=FINEST {
            let ball = Ball::split(times);
            assert_eq!(ball.faces.len(), 8 << (2 * times));
            // Euler's formula of a closed surface: no corner is there twice.
            assert_eq!(ball.corners.len(), ball.faces.len() / 2 + 2);
            for face in &ball.faces {
                let [a, b, c] = face.map(|corner| ball.corners[corner as usize]);
                assert!([a, b, c].iter().all(|at| (at.length() - 1.0).abs() < 1e-12));
                assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "seen from outside");
            }
        }
    }

    #[test]
    fn points_at_one_place_are_one_and_have_their_mean() {
        let nowhere = DVec3::new(0.0, f64::NAN, 0.0);
        let places = [DVec3::X, DVec3::ZERO, nowhere, DVec3::X, DVec3::new(-0.0, 0.0, -0.0)];
        assert_eq!(by_place(&places), [vec![0, 3], vec![1, 4]]);
        assert_eq!(mean([1.0, f64::NAN, 5.0].into_iter()), 3.0);
        assert!(mean([f64::NAN].into_iter()).is_nan());
        assert_eq!(mean([f64::MAX, f64::MAX].into_iter()), f64::MAX);
    }
}

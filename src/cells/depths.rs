//! How deep places lie in cells.

use std::ops::Range;

use glam::{DVec3, I64Vec3};

use super::{CellField, ShadingNormals};
use crate::core::parallel;
use crate::core::{Cancelled, Looks, Ticket};

/// Planes of a lattice whose depths are found together.
const A_PART: usize = 4;
/// Samples that are compared with a triangle between two looks at the ticket.
const A_RUN: usize = 1 << 14;

/// How deep the samples of a lattice lie in the solids of a field that are there.
#[derive(Debug, Clone, PartialEq)]
pub struct Depths {
    /// Of each sample, x fastest: its distance to the nearest outer face, in steps of the lattice, less than 0 outside all solids;
    /// ± [`Depths::MOST`] where that is as far or farther.
    pub depths: Vec<f32>,
    /// Samples outside whose nearest face lies within [`Depths::BESIDE`], and the field's value there.
    pub beside: Vec<(usize, f64)>,
    /// What light takes for the field's growth at the border, per unit of the world: as much as it grows anywhere.
    pub strength: f64,
}

impl Depths {
    /// The greatest distance that is told, in steps.
    pub const MOST: f64 = 3.0;
    /// Samples of a step that crosses the border lie no farther from it: √3, the diagonal of a cube, and what rounding needs.
    pub const BESIDE: f64 = 1.75;
}

/// A triangle of the border in steps of the lattice, and the field at its corners.
struct Part {
    corners: [DVec3; 3],
    values: [f64; 3],
    /// The samples that it may be near to: the first, and behind the last.
    near: [I64Vec3; 2],
}

impl CellField {
    /// Depths of the samples of a lattice of cubes, `dims` along x, y, z: `index_of` leads from the world to its steps, and `is_outside`
    /// tells which of its samples no solid holds. Faces are taken as triangles.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn depths(
        &self,
        dims: [usize; 3],
        index_of: impl Fn(DVec3) -> DVec3,
        is_outside: impl Fn(usize) -> bool + Sync,
        ticket: &Ticket,
    ) -> Result<Depths, Cancelled> {
        let parts = self.border(dims, index_of, ticket)?;
        let [nx, ny, nz] = dims;
        let of_planes = |part: usize| {
            let planes = parallel::part(nz, A_PART, part);
            let first = planes.start * nx * ny;
            let mut found = vec![(Depths::MOST, f64::NAN); planes.len() * nx * ny];
            compare(&parts, dims, planes, &mut found, ticket)?;
            let mut beside = Vec::new();
            let depths = found.into_iter().enumerate().map(|(i, (distance, value))| {
                let is_outside = is_outside(first + i);
                if is_outside && distance <= Depths::BESIDE {
                    beside.push((first + i, value));
                }
                #[expect(clippy::cast_possible_truncation, reason = "a few steps")]
                let depth = if is_outside { -distance } else { distance } as f32;
                depth
            });
            Ok((depths.collect::<Vec<_>>(), beside))
        };
        let found: Vec<(Vec<f32>, Vec<_>)> = parallel::try_list(nz.div_ceil(A_PART), of_planes)?;
        let (depths, beside): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let strength = ShadingNormals::strength(self, &self.growths(ticket)?);
        Ok(Depths { depths: depths.concat(), beside: beside.concat(), strength })
    }

    /// The outer faces as triangles.
    fn border(
        &self,
        dims: [usize; 3],
        index_of: impl Fn(DVec3) -> DVec3,
        ticket: &Ticket,
    ) -> Result<Vec<Part>, Cancelled> {
        let points = self.cells().points();
        let faces = &self.surface(ticket)?.faces;
        let mut looks = Looks::every(ticket, A_RUN);
        let mut parts = Vec::with_capacity(faces.len());
        for face in faces {
            looks.after(1)?;
            for triangle in face.triangles() {
                let corners = triangle.map(|corner| index_of(points[corner as usize]));
                let values = triangle.map(|corner| self.at_corner(face.solid as usize, corner));
                let [a, b, c] = corners;
                let low = (a.min(b).min(c) - Depths::MOST).ceil().as_i64vec3();
                let high = (a.max(b).max(c) + Depths::MOST).floor().as_i64vec3() + 1;
                let dims = I64Vec3::from_array(dims.map(|n| i64::try_from(n).unwrap_or(i64::MAX)));
                let near = [low.max(I64Vec3::ZERO), high.min(dims)];
                parts.push(Part { corners, values, near });
            }
        }
        Ok(parts)
    }
}

/// Lowers distances of the samples of some planes to those to triangles, with the field there.
fn compare(
    parts: &[Part],
    [nx, ny, _]: [usize; 3],
    planes: Range<usize>,
    found: &mut [(f64, f64)],
    ticket: &Ticket,
) -> Result<(), Cancelled> {
    let mut looks = Looks::every(ticket, A_RUN);
    let number = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
    let (begin, end) = (number(planes.start), number(planes.end));
    for Part { corners, values, near: [low, high] } in parts {
        let [a, b, c] = *corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for z in low.z.max(begin)..high.z.min(end) {
            for y in low.y..high.y {
                let row = DVec3::new(0.0, y as f64, z as f64);
                let [first, last] = within((row - a).dot(normal), normal.x, [low.x, high.x]);
                looks.after(1)?;
                for x in first..last {
                    looks.after(1)?;
                    let place = row.with_x(x as f64);
                    let [of_a, of_b, of_c] = nearest(*corners, place);
                    let distance = (a * of_a + b * of_b + c * of_c).distance(place);
                    #[expect(
                        clippy::cast_sign_loss,
                        clippy::cast_possible_truncation,
                        reason = "in the lattice"
                    )]
                    let at = ((z - begin) as usize * ny + y as usize) * nx + x as usize;
                    if distance < found[at].0 {
                        let [at_a, at_b, at_c] = values;
                        found[at] = (distance, at_a * of_a + at_b * of_b + at_c * of_c);
                    }
                }
            }
        }
    }
    Ok(())
}

/// The samples of a row from `low` to before `high` that lie less than [`Depths::MOST`] from a plane, of whose distance it has `at` where
/// x is 0, and `slope` more a sample.
#[expect(clippy::cast_possible_truncation, reason = "casts saturate, and are clamped")]
fn within(at: f64, slope: f64, [low, high]: [i64; 2]) -> [i64; 2] {
    let ends = [-Depths::MOST, Depths::MOST].map(|end| (end - at) / slope);
    match slope == 0.0 {
        true if at.abs() < Depths::MOST => [low, high],
        true => [low, low],
        false => {
            let [first, last] = [ends[0].min(ends[1]).ceil(), ends[0].max(ends[1]).floor()];
            [low.max(first as i64), high.min((last as i64).saturating_add(1))]
        }
    }
}

/// The point of a triangle nearest to a place, as shares of its corners: of the place's own shadow, where it falls on the triangle,
/// and of points on the edges. All are compared, as slivers have shadows by rounding alone.
fn nearest([a, b, c]: [DVec3; 3], place: DVec3) -> [f64; 3] {
    let (u, v, w) = (b - a, c - a, place - a);
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let (uw, vw) = (u.dot(w), v.dot(w));
    let determinant = uu * vv - uv * uv;
    let [s, t] = [(vv * uw - uv * vw) / determinant, (uu * vw - uv * uw) / determinant];
    let along = |from: DVec3, to: DVec3| {
        let edge = to - from;
        let share = (place - from).dot(edge) / edge.length_squared();
        // From one end of an edge without a length.
        if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
    };
    let [ab, bc, ca] = [along(a, b), along(b, c), along(c, a)];
    let edges = [[1.0 - ab, ab, 0.0], [0.0, 1.0 - bc, bc], [ca, 0.0, 1.0 - ca]];
    let distance =
        |[of_a, of_b, of_c]: [f64; 3]| (a * of_a + b * of_b + c * of_c).distance_squared(place);
    let nearer = |best, other| if distance(other) < distance(best) { other } else { best };
    let best = edges.into_iter().reduce(nearer).unwrap_or_default();
    let is_on = s >= 0.0 && t >= 0.0 && s + t <= 1.0;
    if is_on { nearer(best, [1.0 - s - t, s, t]) } else { best }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::cells::{Cells, On};
    use crate::core::assert_stops;

    const DIMS: [usize; 3] = [12, 11, 13];
    const ORIGIN: DVec3 = DVec3::new(-3.0, 40.0, 7.0);
    const STEP: f64 = 0.25;

    fn index_of(place: DVec3) -> DVec3 {
        (place - ORIGIN) / STEP
    }

    /// A box between two corners in steps of the lattice, of so many cells along each axis; values are the places' x + 2 y − 3 z.
    fn block(on: On, cells: [usize; 3], [low, high]: [DVec3; 2]) -> CellField {
        let sides = cells.map(|n| n + 1);
        let place = |i: usize| {
            let at = [i % sides[0], i / sides[0] % sides[1], i / (sides[0] * sides[1])];
            let share = DVec3::from([0, 1, 2].map(|axis| at[axis] as f64 / cells[axis] as f64));
            ORIGIN + STEP * (low + (high - low) * share)
        };
        let points: Arc<[DVec3]> = (0..sides.iter().product()).map(place).collect();
        let values = match on {
            On::Points => points.iter().map(|at| value(*at)).collect(),
            On::Cells => (0..cells.iter().product::<usize>()).map(|i| i as f64).collect(),
        };
        CellField::new(Arc::new(Cells::of_grid(&points, sides)), on, values)
    }

    fn value(place: DVec3) -> f64 {
        place.dot(DVec3::new(1.0, 2.0, -3.0))
    }

    fn sample(i: usize) -> DVec3 {
        let [nx, ny, _] = DIMS;
        DVec3::from([i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64))
    }

    #[test]
    fn depths_are_distances_to_the_border_and_samples_beside_it_have_the_value_there() {
        let ends = [DVec3::new(2.3, 2.6, 0.0), DVec3::new(8.4, 7.2, 9.1)];
        let field = block(On::Points, [3, 2, 4], ends);
        let is_outside = |i: usize| {
            let at = sample(i);
            at != at.clamp(ends[0], ends[1])
        };
        let found = field.depths(DIMS, index_of, is_outside, &Ticket::new()).expect("depths");
        let (mut inside, mut beside) = (0, found.beside.iter().peekable());
        for (i, depth) in found.depths.iter().enumerate() {
            let at = sample(i);
            let nearest = at.clamp(ends[0], ends[1]);
            let within = (at - ends[0]).min(ends[1] - at).min_element();
            let expected = if is_outside(i) { -at.distance(nearest) } else { within };
            let off = f64::from(*depth) - expected.clamp(-Depths::MOST, Depths::MOST);
            assert!(off.abs() < 1e-6, "{at}: {depth}, not {expected}");
            inside += usize::from(*depth >= 0.0);
            if is_outside(i) && at.distance(nearest) <= Depths::BESIDE {
                let (sample, told) = beside.next().expect("every one is told");
                assert_eq!(*sample, i);
                assert!((told - value(ORIGIN + STEP * nearest)).abs() < 1e-9, "{at}");
            }
        }
        assert_eq!((inside, beside.next()), (6 * 5 * 10, None));
        // Of (1, 2, −3).
        assert!((found.strength - 14.0_f64.sqrt()).abs() < 1e-9, "{}", found.strength);
    }

    #[test]
    fn beside_cells_with_one_number_each_it_is_the_nearest_ones() {
        let ends = [DVec3::splat(3.0), DVec3::splat(7.0)];
        let field = block(On::Cells, [2, 1, 1], ends);
        let is_outside = |i: usize| {
            let at = sample(i);
            at != at.clamp(ends[0], ends[1])
        };
        let found = field.depths(DIMS, index_of, is_outside, &Ticket::new()).expect("depths");
        for (i, value) in &found.beside {
            let x = sample(*i).x;
            let expected = if x < 5.0 { 0.0 } else { 1.0 };
            assert!(*value == expected || x == 5.0, "{}: {value}", sample(*i));
        }
        assert!(found.beside.len() > 100);
    }

    #[test]
    fn the_nearest_point_of_a_triangle_is_no_farther_than_any_other() {
        let any = |i: usize| {
            DVec3::from(
                [3 * i, 3 * i + 1, 3 * i + 2].map(|i| ((i * 7919 + 13) % 997) as f64 / 99.7),
            )
        };
        for i in 0..60 {
            let [a, b, mut c, place] = [4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3].map(any);
            // Some are lines, and some points.
            match i % 10 {
                8 => c = a.lerp(b, 0.3),
                9 => c = a,
                _ => {}
            }
            let corners = if i == 19 { [a; 3] } else { [a, b, c] };
            let at = |weights: [f64; 3]| {
                corners.iter().zip(weights).map(|(corner, weight)| *corner * weight).sum::<DVec3>()
            };
            let found = nearest(corners, place);
            assert!(
                found.iter().all(|weight| (-1e-12..=1.0 + 1e-12).contains(weight)),
                "{found:?}"
            );
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let distance = at(found).distance(place);
            for (s, t) in (0..=20).flat_map(|s| (0..=20 - s).map(move |t| (s, t))) {
                let weights = [f64::from(20 - s - t), f64::from(s), f64::from(t)].map(|w| w / 20.0);
                assert!(distance <= at(weights).distance(place) + 1e-9, "{i}: {weights:?}");
            }
        }
    }

    #[test]
    fn depths_are_left_off_where_a_ticket_says_so() {
        let ends = [DVec3::splat(10.0), DVec3::splat(70.0)];
        let field = block(On::Points, [20; 3], ends);
        // Most samples within three steps of six faces of 60 × 60.
        let least = 6 * 60 * 60 * 5 / A_RUN;
        assert_stops("depths", least, |ticket| field.depths([80; 3], index_of, |_| true, ticket));
    }
}

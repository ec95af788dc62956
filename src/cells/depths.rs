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

/// The point of a triangle nearest to a place, as shares of its corners.
fn nearest([a, b, c]: [DVec3; 3], place: DVec3) -> [f64; 3] {
    let (u, v, w) = (b - a, c - a, place - a);
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let (uw, vw) = (u.dot(w), v.dot(w));
    let determinant = uu * vv - uv * uv;
    let [s, t] = [(vv * uw - uv * vw) / determinant, (uu * vw - uv * uw) / determinant];
    // Not so of one without an area.
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return [1.0 - s - t, s, t];
    }
    let along = |from: DVec3, to: DVec3| {
        let edge = to - from;
        let share = (place - from).dot(edge) / edge.length_squared();
        // From one end of an edge without a length.
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        (share, from.lerp(to, share).distance_squared(place))
    };
    let [(ab, to_ab), (bc, to_bc), (ca, to_ca)] = [along(a, b), along(b, c), along(c, a)];
    if to_ab <= to_bc && to_ab <= to_ca {
        [1.0 - ab, ab, 0.0]
    } else if to_bc <= to_ca {
        [0.0, 1.0 - bc, bc]
    } else {
        [ca, 0.0, 1.0 - ca]
    }
}

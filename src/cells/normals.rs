//! What light takes for the growth of a field on cells: where these end they are seen as a surface, which is lit as it is
//! turned, not as values grow behind it.

use glam::DVec3;

use super::{CellField, Cells, Face, Solid};
use crate::core::{Cancelled, Looks, Ticket, mapped};

/// Faces that are turned to each other by less than this are parts of one smooth surface, as triangles of polygons are.
const SOFT_DEGREES: f64 = 30.0;
/// Faces about a point of which each is compared with all: beyond, they are flat there.
const MOST_ABOUT: usize = 256;
/// Growth over an edge, as a share of the values, that rounding may leave of none.
const ROUNDING: f64 = 1e-12;
/// Faces, or pairs of them, between two looks at the ticket.
const A_PART: usize = 1 << 13;
/// And points or solids.
const A_RUN: usize = 1 << 16;

/// What light takes for the field's growth at a corner of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadingNormal {
    /// Growth per unit of the world, as recovered; on the border into the cells, as strong as the field grows anywhere.
    pub growth: DVec3,
    /// Whether the corner lies on an outer face.
    pub is_on_border: bool,
}

/// The corners of a solid as light has them where a ray has come into its cell through one of the outer faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LitFace {
    /// A world position on the face: the mean of its points.
    pub on: DVec3,
    /// Unit vector into the cell, across the face.
    pub inwards: DVec3,
    /// Numbers of normals, one for each corner of the solid.
    pub corners: [u32; 8],
}

impl LitFace {
    /// Less of a ray than this crosses a face that it goes along.
    pub const ALONG: f64 = 1e-3;

    /// How near a place is to where a ray through it has passed the face's plane on its way in, or, where it only leaves by
    /// it, less than nothing and the more the nearer. `direction` is of length 1, away from the eye.
    pub fn nearness(&self, place: DVec3, direction: DVec3) -> f64 {
        let height = (place - self.on).dot(self.inwards).abs();
        let slope = self.inwards.dot(direction);
        if slope > Self::ALONG { slope / height } else { -height / (-slope).max(Self::ALONG) }
    }
}

/// Light's growth at a place (r, s, t) of a solid, with the shape functions φᵢ of its corners: N = Σ φᵢ nᵢ of those on the
/// border and G = Σ φᵢ gᵢ of the others make N + G or N − G, whichever is longer, as a surface and its back are lit alike. So
/// the outermost layer of cells is lit as the border before it, and what lies deeper as the field grows.
///
/// Where a cell has several outer faces, the border is the one that the ray came in through: of a convex cell the one whose plane it
/// passed last ([`LitFace::nearness`]), so that a face is lit alike however deep one sees through it. Where it
/// came in through another cell, it is the one that it leaves by. Faces that a solid touches with an edge or a point, and those
/// of others that its cell was split into, count where they are turned another way than its own. A solid that touches one smooth
/// surface alone has the normals of the points. Engines do the same per index: lattices over cells are of cubes, so that angles are the
/// world's.
#[derive(Debug, Clone)]
pub struct ShadingNormals {
    /// Of each point, then those that points have beside one face alone.
    normals: Vec<ShadingNormal>,
    faces: Vec<LitFace>,
    /// Where the faces of each solid begin, and the last ones end.
    starts: Vec<u32>,
}

impl ShadingNormals {
    /// By their numbers: those of the points come first.
    pub fn normals(&self) -> &[ShadingNormal] {
        &self.normals
    }

    /// All outer faces, by their solids' numbers.
    pub fn faces(&self) -> &[LitFace] {
        &self.faces
    }

    /// Where the faces of each solid begin among them, and the last ones end.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// The outer faces that a solid is lit by: its own, then those of others.
    pub fn faces_of(&self, solid: usize) -> &[LitFace] {
        &self.faces[self.starts[solid] as usize..self.starts[solid + 1] as usize]
    }

    /// What light takes for the growth per unit of the world, at (r, s, t) of a solid and its number, for a ray through this place of
    /// the world in a direction.
    pub fn growth(
        &self,
        (number, solid): (usize, &Solid),
        unit: DVec3,
        (place, direction): (DVec3, DVec3),
    ) -> DVec3 {
        let direction = direction.normalize_or_zero();
        let nearness = |face: &LitFace| face.nearness(place, direction);
        let mut faces = self.faces_of(number).iter();
        let first = faces.next();
        let entered = first.map(|first| {
            let nearer = |(at, best): (_, f64), face| {
                let own = nearness(face);
                if own > best { (face, own) } else { (at, best) }
            };
            faces.fold((first, nearness(first)), nearer).0
        });
        let corners = entered.map_or(solid.corners(), |face| &face.corners);
        let [mut inside, mut border] = [DVec3::ZERO; 2];
        for (corner, weight) in corners.iter().zip(solid.kind().weights(unit)) {
            let normal = self.normals[*corner as usize];
            let sum = if normal.is_on_border { &mut border } else { &mut inside };
            *sum += normal.growth * weight;
        }
        if border.dot(inside) < 0.0 { border - inside } else { border + inside }
    }

    /// How strong the growth at the border is taken to be, per unit of the world: as it is anywhere, of points that grow by `growths`.
    pub(super) fn strength(field: &CellField, growths: &[DVec3]) -> f64 {
        let strength = growths.iter().map(|growth| growth.length()).filter(|l| l.is_finite());
        let strength = strength.fold(0.0, f64::max);
        // What rounding leaves of a constant is none.
        let [low, high] = field.range().unwrap_or_default();
        let least = ROUNDING * low.abs().max(high.abs()) / field.cells().median_edge();
        if strength > least { strength } else { 1.0 }
    }

    /// Of a field whose points grow by `growths`.
    pub(super) fn new(
        field: &CellField,
        growths: &[DVec3],
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let cells = field.cells();
        let outer = &field.surface(ticket)?.faces;
        let mut looks = Looks::every(ticket, A_PART);
        let inner = |i: usize| ShadingNormal { growth: growths[i], is_on_border: false };
        let mut made = Self {
            normals: mapped(growths.len(), A_RUN, inner, ticket)?,
            faces: Vec::with_capacity(outer.len()),
            starts: Vec::with_capacity(cells.solids().len() + 1),
        };
        let strength = Self::strength(field, growths);
        let areas = mapped(outer.len(), A_PART, |i| cells.area(&outer[i]), ticket)?;
        let about = faces_about(outer, growths.len(), ticket)?;
        let border = Border { cells, outer, about, flat: narrow(growths.len()) };
        let on_border = |outwards: DVec3| ShadingNormal {
            growth: -outwards.normalize_or_zero() * strength,
            is_on_border: true,
        };
        for own in border.about.chunk_by(|a, b| a.0 == b.0) {
            looks.after(own.len())?;
            let sum = own.iter().map(|(_, face)| areas[*face as usize]).sum();
            made.normals[own[0].0 as usize] = on_border(sum);
        }
        // Flat, until softened.
        for (face, area) in outer.iter().zip(&areas) {
            looks.after(1)?;
            let solid = &cells.solids()[face.solid as usize];
            let flat = narrow(made.normals.len());
            made.normals.push(on_border(*area));
            let corners = made.corners_beside(solid, |_| flat);
            let [.., c, d] = face.corners;
            let on = face.corners.iter().take(if c == d { 3 } else { 4 });
            let count = on.len() as f64;
            let on = on.map(|corner| cells.points()[*corner as usize]).sum::<DVec3>() / count;
            made.faces.push(LitFace { on, inwards: -area.normalize_or_zero(), corners });
        }
        for own in border.about.chunk_by(|a, b| a.0 == b.0) {
            if own.len() <= MOST_ABOUT {
                // Each is compared with all.
                looks.after(own.len() * own.len())?;
                made.soften(cells, (outer, &areas), own, on_border);
            }
        }
        for (i, face) in outer.iter().enumerate() {
            looks.after(1)?;
            made.carry_inwards(cells, (i, face), strength);
        }
        made.share(cells, &border, ticket)?;
        Ok(made)
    }

    /// The corners of a solid beside a face: those on the border have the normals that `beside` gives to their points.
    fn corners_beside(&self, solid: &Solid, beside: impl Fn(u32) -> u32) -> [u32; 8] {
        let mut corners = [0; 8];
        for (to, corner) in corners.iter_mut().zip(solid.corners()) {
            let is_on_border = self.normals[*corner as usize].is_on_border;
            *to = if is_on_border { beside(*corner) } else { *corner };
        }
        corners
    }

    /// Lists the faces by solids. Behind those of each come others that it touches, or that its cell has, which are turned
    /// another way: rays come through them, too.
    fn share(
        &mut self,
        cells: &Cells,
        border: &Border<'_>,
        ticket: &Ticket,
    ) -> Result<(), Cancelled> {
        let mut looks = Looks::every(ticket, A_RUN);
        let faces = std::mem::take(&mut self.faces);
        let (mut solid, mut of_cell) = (0, 0);
        for pieces in cells.sources().chunk_by(|a, b| a == b) {
            let (end, first_of_cell) = (solid + pieces.len(), of_cell);
            let is_of_cell = |face: &Face| (face.solid as usize) < end;
            let behind = of_cell + border.outer[of_cell..].partition_point(is_of_cell);
            for piece in solid..end {
                self.starts.push(narrow(self.faces.len()));
                let is_own = |face: &Face| face.solid as usize == piece;
                let own = border.outer[of_cell..behind].partition_point(is_own);
                let first = self.faces.len();
                self.faces.extend_from_slice(&faces[of_cell..of_cell + own]);
                of_cell += own;
                let mut touched = self.faces_touched(&cells.solids()[piece], border);
                looks.after(1 + touched.len())?;
                if touched.is_empty() {
                    continue;
                }
                if pieces.len() > 1 {
                    touched.extend(narrow(first_of_cell)..narrow(behind));
                }
                for number in touched {
                    let face = &faces[number as usize];
                    let is_known = self.faces[first..].iter().any(|known| is_alike(known, face));
                    if face.inwards != DVec3::ZERO && !is_known {
                        let normal = |point| border.normal(&faces, point, number);
                        let corners = self.corners_beside(&cells.solids()[piece], normal);
                        self.faces.push(LitFace { corners, ..*face });
                    }
                }
                // Of one that is another's alone the points have the normals.
                if own == 0 && self.faces.len() == first + 1 {
                    self.faces.pop();
                }
            }
            (solid, of_cell) = (end, behind);
        }
        self.starts.push(narrow(self.faces.len()));
        Ok(())
    }

    /// Numbers of the outer faces about a solid's corners.
    fn faces_touched(&self, solid: &Solid, border: &Border<'_>) -> Vec<u32> {
        let corners = solid.corners().iter();
        let on_border = corners.filter(|corner| self.normals[**corner as usize].is_on_border);
        on_border.flat_map(|corner| border.about(*corner)).map(|(_, face)| *face).collect()
    }

    /// Corners that lie on other outer faces have, beside this face, the mean of the corners on it that edges join
    /// them to: what lies behind it is lit alike, however deep.
    fn carry_inwards(&mut self, cells: &Cells, (number, face): (usize, &Face), strength: f64) {
        let solid = &cells.solids()[face.solid as usize];
        let points = solid.corners();
        for corner in 0..points.len() {
            let is_on_border = self.normals[points[corner] as usize].is_on_border;
            if face.corners.contains(&points[corner]) || !is_on_border {
                continue;
            }
            let joined = solid.kind().edges().iter().filter_map(|edge| match edge {
                [a, b] if *a == corner => Some(*b),
                [a, b] if *b == corner => Some(*a),
                _ => None,
            });
            let joined = joined.filter(|other| face.corners.contains(&points[*other]));
            let own = self.faces[number].corners;
            let normals: Vec<u32> = joined.map(|other| own[other]).collect();
            let first = normals.first().map(|first| self.normals[*first as usize]);
            let are_alike =
                normals.iter().all(|normal| Some(self.normals[*normal as usize]) == first);
            let to = match &normals[..] {
                // Corners that have fallen together: as flat as the face.
                [] => continue,
                [first, ..] if are_alike => *first,
                _ => {
                    let sum: DVec3 = normals.iter().map(|i| self.normals[*i as usize].growth).sum();
                    let growth = sum.normalize_or_zero() * strength;
                    self.normals.push(ShadingNormal { growth, is_on_border: true });
                    narrow(self.normals.len() - 1)
                }
            };
            self.faces[number].corners[corner] = to;
        }
    }

    /// Gives the faces about a point the mean of those that they are hardly turned to.
    fn soften(
        &mut self,
        cells: &Cells,
        (outer, areas): (&[Face], &[DVec3]),
        own: &[(u32, u32)],
        on_border: impl Fn(DVec3) -> ShadingNormal,
    ) {
        let least = SOFT_DEGREES.to_radians().cos();
        let (point, first) = (own[0].0, self.normals.len());
        for (_, face) in own {
            let area = areas[*face as usize];
            let are_alike = |other: &DVec3| {
                let size = other.length() * area.length();
                size > 0.0 && other.dot(area) > least * size
            };
            let others = own.iter().map(|(_, other)| areas[*other as usize]);
            let normal = on_border(others.filter(are_alike).sum());
            if normal.growth == DVec3::ZERO {
                continue;
            }
            // Most have the same: that of the point.
            let number = if self.normals[point as usize] == normal {
                point as usize
            } else {
                match self.normals[first..].iter().position(|known| *known == normal) {
                    Some(at) => first + at,
                    None => {
                        self.normals.push(normal);
                        self.normals.len() - 1
                    }
                }
            };
            let solid = &cells.solids()[outer[*face as usize].solid as usize];
            let lit = &mut self.faces[*face as usize];
            for (to, corner) in lit.corners.iter_mut().zip(solid.corners()) {
                if *corner == point {
                    *to = narrow(number);
                }
            }
        }
    }
}

/// The outer faces, and those about each point.
struct Border<'a> {
    cells: &'a Cells,
    outer: &'a [Face],
    /// Numbers of points, and of the faces about them: by the points, and then by the faces.
    about: Vec<(u32, u32)>,
    /// The number of the first face's flat normal. Those of the others follow.
    flat: u32,
}

impl Border<'_> {
    /// What lies about a point.
    fn about(&self, point: u32) -> &[(u32, u32)] {
        let first = self.about.partition_point(|(at, _)| *at < point);
        let count = self.about[first..].iter().take_while(|(at, _)| *at == point).count();
        &self.about[first..first + count]
    }

    /// The number of the normal at a point beside a face that others than its solid are lit by: that of the face about the
    /// point which is turned most alike, or its own flat one where none is nearly.
    fn normal(&self, faces: &[LitFace], point: u32, number: u32) -> u32 {
        let face = &faces[number as usize];
        let alike = |of: &u32| faces[*of as usize].inwards.dot(face.inwards);
        let others = self.about(point).iter().map(|(_, of)| *of);
        // The first of several.
        let best = others.rev().max_by(|a, b| alike(a).total_cmp(&alike(b)));
        let best = best.map(|of| of as usize).filter(|of| is_alike(&faces[*of], face));
        let corner = best.and_then(|best| {
            let own = self.cells.solids()[self.outer[best].solid as usize].corners();
            Some(faces[best].corners[own.iter().position(|corner| *corner == point)?])
        });
        corner.unwrap_or(self.flat + number)
    }
}

/// Memory holds fewer normals and faces than 2³².
#[expect(clippy::cast_possible_truncation, reason = "memory holds fewer of each than 2^32")]
fn narrow(number: usize) -> u32 {
    number as u32
}

/// Whether two faces are parts of one smooth surface.
fn is_alike(a: &LitFace, b: &LitFace) -> bool {
    a.inwards.dot(b.inwards) > SOFT_DEGREES.to_radians().cos()
}

/// Numbers of points, and of the faces about them: by the points, and then by the faces.
fn faces_about(
    outer: &[Face],
    points: usize,
    ticket: &Ticket,
) -> Result<Vec<(u32, u32)>, Cancelled> {
    let corners_of = |face: &Face| {
        let [.., c, d] = face.corners;
        face.corners.into_iter().take(if c == d { 3 } else { 4 })
    };
    let mut looks = Looks::every(ticket, A_RUN);
    let mut next = vec![0_usize; points + 1];
    for face in outer {
        looks.after(1)?;
        corners_of(face).for_each(|corner| next[corner as usize + 1] += 1);
    }
    for point in 1..next.len() {
        next[point] += next[point - 1];
    }
    let mut about = vec![(0, 0); next[points]];
    for (number, face) in outer.iter().enumerate() {
        looks.after(1)?;
        for corner in corners_of(face) {
            let at = &mut next[corner as usize];
            about[*at] = (corner, narrow(number));
            *at += 1;
        }
    }
    Ok(about)
}

impl Cells {
    /// A face's area, square world units: a vector out of its solid.
    pub fn area(&self, face: &Face) -> DVec3 {
        let points = self.points();
        let [a, b, c, d] = face.corners.map(|corner| points[corner as usize]);
        // Half of what the diagonals span; of a triangle its own.
        let area = (c - a).cross(d - b) / 2.0;
        let area =
            if face.corners[2] == face.corners[3] { (b - a).cross(c - a) / 2.0 } else { area };
        let solid = self.placed(face.solid as usize);
        let outwards = (a + b + c + d) / 4.0 - solid.at(solid.kind().middle()).0;
        if area.dot(outwards) < 0.0 { -area } else { area }
    }
}

//! Cells of a file's types as solids (`vtkCellType.h` numbers them; *The VTK User's Guide* orders their points).
//!
//! Quadratic cells are split at their middle points, Lagrange's at all of theirs: linear in between, with their own values
//! at every point. What has many faces is split into tetrahedra about its middle.

pub(super) mod lagrange;

use std::collections::HashMap;

use glam::DVec3;

use super::solid::{Kind, Solid};
use super::{Blend, CellsError};
use crate::core::triangles_of;

/// VTK's number.
pub(super) const HEXAHEDRON: u8 = 12;

/// Whether VTK's number is of a polygon that is drawn.
const fn is_polygon(kind: u8) -> bool {
    matches!(kind, 5..=9 | 22 | 23 | 28 | 30 | 34 | 36 | 69 | 70)
}

/// Whether VTK's number is of a cell that has an area and no volume.
pub fn is_flat(kind: u8) -> bool {
    is_polygon(kind) || matches!(kind, 61..=63 | 76 | 77)
}

/// Whether VTK's number is of a cell that has a volume.
pub fn has_volume(kind: u8) -> bool {
    !is_flat(kind) && !matches!(kind, 0..=4 | 21 | 35 | 51 | 60 | 66 | 68 | 75)
}

/// Whether VTK's number is of a cell that is more than points or lines.
pub fn has_extent(kind: u8) -> bool {
    is_flat(kind) || has_volume(kind)
}

/// Whether VTK's number is of a cell that joins points: neither nothing nor vertices are.
pub(super) const fn joins(kind: u8) -> bool {
    kind > 2
}

/// Solids so far.
pub(super) struct Split<'a> {
    points: &'a [DVec3],
    pub solids: Vec<Solid>,
    /// Of cells without volume, those that are polygons.
    pub triangles: Vec<[u32; 3]>,
    /// Which of the file's cells each of these is of.
    pub triangle_sources: Vec<u32>,
    pub blends: Vec<Blend>,
    /// Places of the blends.
    pub added: Vec<DVec3>,
    /// Blends by what they are the mean of, so that neighbours share those on their common face.
    known: HashMap<Vec<(u32, u64)>, u32>,
    /// The parts of Lagrange's tetrahedra and wedges of the order that was last met.
    tetrahedra: (usize, Vec<[usize; 4]>),
    wedges: (usize, Vec<[usize; 6]>),
}

impl<'a> Split<'a> {
    pub(super) fn new(points: &'a [DVec3]) -> Self {
        let none = HashMap::new();
        let triangles = Vec::new();
        Self {
            points,
            solids: Vec::new(),
            triangles,
            triangle_sources: Vec::new(),
            blends: Vec::new(),
            added: Vec::new(),
            known: none,
            tetrahedra: (0, Vec::new()),
            wedges: (0, Vec::new()),
        }
    }

    /// Adds a cell's solids; whether it had to be split.
    ///
    /// # Errors
    /// Another number of corners than the type has, and types that are not known.
    pub(super) fn push(
        &mut self,
        kind: u8,
        corners: &[u32],
        faces: &[Vec<u32>],
        cell: usize,
    ) -> Result<bool, CellsError> {
        let of = |expected: usize| match corners.len() == expected {
            true => Ok(()),
            false => Err(CellsError {
                expected: format!(
                    "{expected} corners of cell {cell}, which is of VTK's type {kind}"
                ),
                found: corners.len().to_string(),
                advice: CellsError::COPY,
            }),
        };
        match kind {
            69 | 70 => self.lagrange_polygon(kind, corners, cell),
            30 => of(6).map(|()| self.polygon(kind, corners, cell)),
            _ if is_polygon(kind) => Ok(self.polygon(kind, corners, cell)),
            // Nothing, points and lines.
            _ if !has_extent(kind) => Ok(false),
            10 => of(4).map(|()| self.one(Kind::Tetrahedron, corners)),
            11 => of(8).map(|()| {
                let [a, b, c, d, e, f, g, h] = [0, 1, 3, 2, 4, 5, 7, 6].map(|i: usize| corners[i]);
                self.one(Kind::Hexahedron, &[a, b, c, d, e, f, g, h])
            }),
            HEXAHEDRON => of(8).map(|()| self.one(Kind::Hexahedron, corners)),
            13 => of(6).map(|()| self.one(Kind::Wedge, corners)),
            14 => of(5).map(|()| self.one(Kind::Pyramid, corners)),
            15 => of(10).map(|()| self.prism(corners)),
            16 => of(12).map(|()| self.prism(corners)),
            24 => of(10).map(|()| self.quadratic_tetrahedron(corners)),
            25 => of(20).map(|()| self.quadratic_hexahedron(corners)),
            26 => of(15).map(|()| self.quadratic_wedge(corners)),
            31 => of(12).map(|()| {
                let layer = |own: [usize; 6]| own.map(|i| corners[i]);
                self.wedges(&[layer([0, 1, 2, 6, 7, 8]), layer([3, 4, 5, 9, 10, 11])])
            }),
            32 => of(18).map(|()| self.quadratic_wedge(corners)),
            27 => of(13).map(|()| self.quadratic_pyramid(corners)),
            29 => of(27).map(|()| self.quadratic_hexahedron(corners)),
            42 => {
                self.polyhedron(corners, faces);
                Ok(true)
            }
            71 => {
                let order = order_of(corners.len(), cell, kind, |n| (n + 1) * (n + 2) * (n + 3) / 6)?;
                Ok(self.lagrange_tetrahedron(corners, order))
            }
            72 => {
                let order = order_of(corners.len(), cell, kind, |n| (n + 1).pow(3))?;
                self.lagrange_hexahedron(corners, order);
                Ok(order > 1)
            }
            73 => {
                let points = |n: usize| (n + 1) * (n + 1) * (n + 2) / 2;
                let order = order_of(corners.len(), cell, kind, points)?;
                Ok(self.lagrange_wedge(corners, order))
            }
            _ => Err(CellsError {
                expected: "cells of linear, quadratic or polyhedral types, or Lagrange's triangles, quadrilaterals, tetrahedra, wedges and hexahedra".into(),
                found: match kind {
                    76..=81 => format!("VTK's type {kind}, Bézier's, at cell {cell}"),
                    _ => format!("VTK's type {kind} at cell {cell}"),
                },
                advice: if is_flat(kind) { CellsError::SPLIT_FLAT } else { CellsError::SPLIT },
            }),
        }
    }

    fn one(&mut self, kind: Kind, corners: &[u32]) -> bool {
        self.solids.push(Solid::of(kind, corners));
        false
    }

    /// A polygon's triangles: of strips one after another, of quadratic ones at the middles of their edges, too. No solids.
    fn polygon(&mut self, kind: u8, c: &[u32], cell: usize) -> bool {
        let within = |ring: &[u32]| -> Vec<[u32; 3]> {
            let places: Vec<DVec3> = ring.iter().map(|corner| self.place(*corner)).collect();
            triangles_of(&places).into_iter().map(|t| t.map(|i| ring[i])).collect()
        };
        let found = match (kind, c) {
            // A strip turns about from one to the next.
            (6, _) => c
                .windows(3)
                .enumerate()
                .map(|(i, t)| match i % 2 {
                    0 => [t[0], t[1], t[2]],
                    _ => [t[1], t[0], t[2]],
                })
                .collect(),
            (8, [a, b, c, d, ..]) => within(&[*a, *b, *d, *c]),
            (22 | 34, [a, b, c, ab, bc, ca, ..]) => {
                vec![[*a, *ab, *ca], [*ab, *b, *bc], [*ca, *bc, *c], [*ab, *bc, *ca]]
            }
            (23 | 28, [a, b, c, d, ab, bc, cd, da, ..]) => {
                within(&[*a, *ab, *b, *bc, *c, *cd, *d, *da])
            }
            (30, [a, b, c, d, ab, cd]) => within(&[*a, *ab, *b, *c, *cd, *d]),
            // All corners, then the middles of all edges.
            (36, _) => {
                let (corners, middles) = c.split_at(c.len() / 2);
                let ring = corners.iter().zip(middles).flat_map(|(a, b)| [*a, *b]);
                within(&ring.collect::<Vec<_>>())
            }
            _ => within(c),
        };
        self.add_triangles(found, cell);
        false
    }

    /// Triangles of a cell of the file.
    fn add_triangles(&mut self, found: impl IntoIterator<Item = [u32; 3]>, cell: usize) {
        self.triangles.extend(found);
        #[expect(clippy::cast_possible_truncation, reason = "files have fewer cells than 2^32")]
        self.triangle_sources.resize(self.triangles.len(), cell as u32);
    }

    /// Triangles between all points of Lagrange's triangles and quadrilaterals; whether there are several of the latter, or
    /// of the squares that these have.
    fn lagrange_polygon(
        &mut self,
        kind: u8,
        corners: &[u32],
        cell: usize,
    ) -> Result<bool, CellsError> {
        if kind == 69 {
            // With one in its middle, that of the second order has seven.
            if corners.len() == 7 {
                self.polygon(34, corners, cell);
                return Ok(true);
            }
            let order = order_of(corners.len(), cell, kind, |n| (n + 1) * (n + 2) / 2)?;
            let parts = lagrange::triangles(order).into_iter();
            self.add_triangles(parts.map(|part| part.map(|point| corners[point])), cell);
            return Ok(order > 1);
        }
        let order = order_of(corners.len(), cell, kind, |n| (n + 1).pow(2))?;
        let at = |i, j| corners[lagrange::of_quadrilateral([i, j], order)];
        for (i, j) in (0..order).flat_map(|j| (0..order).map(move |i| (i, j))) {
            self.polygon(9, &[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], cell);
        }
        Ok(order > 1)
    }

    /// Where a point is, of the file's or of those that were added.
    fn place(&self, point: u32) -> DVec3 {
        let point = point as usize;
        self.points.get(point).copied().unwrap_or_else(|| self.added[point - self.points.len()])
    }

    /// The mean of points, with weights that belong to them.
    fn blend(&mut self, of: &[(u32, f64)]) -> u32 {
        let mut key: Vec<(u32, u64)> =
            of.iter().map(|(point, weight)| (*point, weight.to_bits())).collect();
        key.sort_unstable();
        if let Some(known) = self.known.get(&key) {
            return *known;
        }
        let at = of.iter().map(|(point, weight)| self.place(*point) * *weight).sum();
        #[expect(clippy::cast_possible_truncation, reason = "points of files have 32 bits")]
        let number = (self.points.len() + self.added.len()) as u32;
        self.added.push(at);
        self.blends.push(Blend { of: of.to_vec() });
        self.known.insert(key, number);
        number
    }

    fn middle(&mut self, of: &[u32]) -> u32 {
        let share = 1.0 / of.len() as f64;
        let even: Vec<(u32, f64)> = of.iter().map(|point| (*point, share)).collect();
        self.blend(&even)
    }

    /// The middle of a face of eight points, by the shape functions of a quadratic square: corners weigh −1/4, the middles
    /// of edges 1/2.
    fn middle_of_face(&mut self, corners: [u32; 4], edges: [u32; 4]) -> u32 {
        let corners = corners.map(|point| (point, -0.25));
        let edges = edges.map(|point| (point, 0.5));
        self.blend(&[corners, edges].concat())
    }

    /// The point that a cell has in the middle of a face, or what follows from those that it has there.
    fn face_of(
        &mut self,
        c: &[u32],
        (corners, edges): ([usize; 4], [usize; 4]),
        own: usize,
    ) -> u32 {
        let at = |i: usize| c[i];
        match c.get(own) {
            Some(own) => *own,
            None => self.middle_of_face(corners.map(at), edges.map(at)),
        }
    }

    /// A prism over a polygon of half of the corners: wedges about its axis.
    fn prism(&mut self, corners: &[u32]) -> bool {
        let (below, above) = corners.split_at(corners.len() / 2);
        let axis = [self.middle(below), self.middle(above)];
        for (i, _) in below.iter().enumerate() {
            let next = (i + 1) % below.len();
            let wedge = [axis[0], below[i], below[next], axis[1], above[i], above[next]];
            self.solids.push(Solid::of(Kind::Wedge, &wedge));
        }
        true
    }

    /// Four tetrahedra at the corners, and four about the diagonal between the middles of two opposite edges.
    fn quadratic_tetrahedron(&mut self, c: &[u32]) -> bool {
        const PARTS: [[usize; 4]; 8] = [
            [0, 4, 6, 7],
            [4, 1, 5, 8],
            [6, 5, 2, 9],
            [7, 8, 9, 3],
            // About 6–8.
            [6, 8, 4, 5],
            [6, 8, 5, 9],
            [6, 8, 9, 7],
            [6, 8, 7, 4],
        ];
        for part in PARTS {
            self.solids.push(Solid::of(Kind::Tetrahedron, &part.map(|i| c[i])));
        }
        true
    }

    /// Eight hexahedra; of 20 points the middles of faces and of the solid follow from the shape functions.
    fn quadratic_hexahedron(&mut self, c: &[u32]) -> bool {
        let mut face = |corners, edges, own| self.face_of(c, (corners, edges), own);
        // VTK's 27 points: 20 at x low, 21 at x high, 22 at y low, 23 at y high, 24 at z low, 25 at z high, 26.
        let x0 = face([0, 3, 7, 4], [11, 19, 15, 16], 20);
        let x1 = face([1, 2, 6, 5], [9, 18, 13, 17], 21);
        let y0 = face([0, 1, 5, 4], [8, 17, 12, 16], 22);
        let y1 = face([3, 2, 6, 7], [10, 18, 14, 19], 23);
        let z0 = face([0, 1, 2, 3], [8, 9, 10, 11], 24);
        let z1 = face([4, 5, 6, 7], [12, 13, 14, 15], 25);
        let middle = match c.get(26) {
            Some(own) => *own,
            None => {
                let corners = (0..8).map(|i| (c[i], -0.25));
                let edges = (8..20).map(|i| (c[i], 0.25));
                self.blend(&corners.chain(edges).collect::<Vec<_>>())
            }
        };
        // Three along x, three along y, three along z.
        let lattice = [
            [[c[0], c[8], c[1]], [c[11], z0, c[9]], [c[3], c[10], c[2]]],
            [[c[16], y0, c[17]], [x0, middle, x1], [c[19], y1, c[18]]],
            [[c[4], c[12], c[5]], [c[15], z1, c[13]], [c[7], c[14], c[6]]],
        ];
        self.solids.extend(Solid::hexahedra([3; 3], |x, y, z| lattice[z][y][x]));
        true
    }

    /// Eight wedges: two layers of four. Of 15 points the middles of squares follow from the shape functions.
    fn quadratic_wedge(&mut self, c: &[u32]) -> bool {
        let mut face = |corners, edges, own| self.face_of(c, (corners, edges), own);
        // Of the three squares: between the edges 6 and 9, 7 and 10, 8 and 11.
        let f0 = face([0, 1, 4, 3], [6, 13, 9, 12], 15);
        let f1 = face([1, 2, 5, 4], [7, 14, 10, 13], 16);
        let f2 = face([2, 0, 3, 5], [8, 12, 11, 14], 17);
        self.wedges(&[
            [c[0], c[1], c[2], c[6], c[7], c[8]],
            [c[12], c[13], c[14], f0, f1, f2],
            [c[3], c[4], c[5], c[9], c[10], c[11]],
        ])
    }

    /// Four wedges between every two layers of three corners and the middles between these.
    fn wedges(&mut self, layers: &[[u32; 6]]) -> bool {
        for pair in layers.windows(2) {
            for triangle in [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]] {
                let [low, high] = [&pair[0], &pair[1]].map(|l| triangle.map(|i: usize| l[i]));
                self.solids.push(Solid::of(Kind::Wedge, &[low, high].concat()));
            }
        }
        true
    }

    /// Six pyramids and four tetrahedra.
    fn quadratic_pyramid(&mut self, c: &[u32]) -> bool {
        let at = |i: usize| c[i];
        let base = self.middle_of_face([0, 1, 2, 3].map(at), [5, 6, 7, 8].map(at));
        let above = [c[9], c[10], c[11], c[12]];
        let edges = [c[5], c[6], c[7], c[8]];
        let pyramid = |split: &mut Self, ring: [u32; 4], top: u32| {
            let [a, b, c, d] = ring;
            split.solids.push(Solid::of(Kind::Pyramid, &[a, b, c, d, top]));
        };
        for i in 0..4 {
            let before = edges[(i + 3) % 4];
            pyramid(self, [c[i], edges[i], base, before], above[i]);
            let next = (i + 1) % 4;
            let side = [edges[i], base, above[i], above[next]];
            self.solids.push(Solid::of(Kind::Tetrahedron, &side));
        }
        pyramid(self, above, c[4]);
        let [a, b, d, e] = above;
        pyramid(self, [e, d, b, a], base);
        true
    }

    /// Tetrahedra between the middle of its corners and triangles of its faces, which are split about their middles.
    fn polyhedron(&mut self, corners: &[u32], faces: &[Vec<u32>]) {
        if corners.is_empty() {
            return;
        }
        let middle = self.middle(corners);
        let first = self.solids.len();
        for face in faces {
            let about = match face.len() {
                0..=2 => continue,
                3 => {
                    self.solids
                        .push(Solid::of(Kind::Tetrahedron, &[face[0], face[1], face[2], middle]));
                    continue;
                }
                _ => self.middle(face),
            };
            for (i, point) in face.iter().enumerate() {
                let next = face[(i + 1) % face.len()];
                self.solids.push(Solid::of(Kind::Tetrahedron, &[*point, next, about, middle]));
            }
        }
        // Faces may go round either way; what they enclose is no less than nothing.
        let place = |point: &u32| {
            let at = *point as usize;
            self.points.get(at).copied().unwrap_or_else(|| self.added[at - self.points.len()])
        };
        let volume = |solid: &Solid| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i: usize| place(&solid.corners()[i]));
            (b - a).cross(c - a).dot(d - a)
        };
        if self.solids[first..].iter().map(volume).sum::<f64>() < 0.0 {
            for solid in &mut self.solids[first..] {
                let &[a, b, c, d] = solid.corners() else { continue };
                *solid = Solid::of(Kind::Tetrahedron, &[b, a, c, d]);
            }
        }
    }

    /// Tetrahedra between all of its points: those into which planes along its faces and one diagonal cut it.
    fn lagrange_tetrahedron(&mut self, corners: &[u32], order: usize) -> bool {
        match order {
            1 => self.one(Kind::Tetrahedron, corners),
            2 => self.quadratic_tetrahedron(corners),
            _ => {
                if self.tetrahedra.0 != order {
                    self.tetrahedra = (order, lagrange::tetrahedra(order));
                }
                let solid = |part: &[usize; 4]| {
                    Solid::of(Kind::Tetrahedron, &part.map(|point| corners[point]))
                };
                self.solids.extend(self.tetrahedra.1.iter().map(solid));
                true
            }
        }
    }

    /// Wedges between all of its points.
    fn lagrange_wedge(&mut self, corners: &[u32], order: usize) -> bool {
        match order {
            1 => self.one(Kind::Wedge, corners),
            2 => self.quadratic_wedge(corners),
            _ => {
                if self.wedges.0 != order {
                    self.wedges = (order, lagrange::wedges(order));
                }
                let solid =
                    |part: &[usize; 6]| Solid::of(Kind::Wedge, &part.map(|point| corners[point]));
                self.solids.extend(self.wedges.1.iter().map(solid));
                true
            }
        }
    }

    /// Hexahedra between all of its points.
    fn lagrange_hexahedron(&mut self, corners: &[u32], order: usize) {
        let at = |x, y, z| corners[lagrange::of_hexahedron([x, y, z], order)];
        self.solids.extend(Solid::hexahedra([order + 1; 3], at));
    }
}

/// The order of a cell with so many points.
fn order_of(
    count: usize,
    cell: usize,
    kind: u8,
    points: impl Fn(usize) -> usize,
) -> Result<usize, CellsError> {
    (1..=10).find(|order| points(*order) == count).ok_or_else(|| CellsError {
        expected: format!(
            "as many points as an order up to 10 has, for cell {cell} of VTK's type {kind}"
        ),
        found: count.to_string(),
        advice: CellsError::COPY,
    })
}

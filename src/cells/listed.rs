//! Which solids lie near a place: lists of them by the boxes of a lattice's index space.

use std::ops::Range;

use glam::{DMat3, DVec3};

use super::{Cells, Kind, Solid};
use crate::core::parallel;
use crate::core::{Cancelled, Looks, Ticket, mapped};

/// Boxes along an axis, at most.
const MOST_ALONG: f64 = 256.0;
/// Boxes for each solid; for each of several tetrahedra, of which five or six fill what another solid does.
const BOXES_A_SOLID: f64 = 2.0;
const BOXES_A_TETRAHEDRON: f64 = 0.5;
/// Entries of all lists for each solid, at most; boxes are larger where they would be more.
const MOST_ENTRIES_A_SOLID: usize = 64;
/// Solids placed, or boxes touched, between two looks at the ticket.
const A_PART: usize = 1 << 14;
/// A solid is as much work as so many boxes.
const A_SOLID: usize = 8;
/// Sums between two looks at it.
const A_RUN: usize = 1 << 20;
/// Parts of all boxes for each thread.
const BANDS_A_THREAD: usize = 4;
/// Places on a border belong to either side, by rounding: up to so many samples, and so much of the solid, beyond it.
const RIM: f64 = 1e-4;

/// The solids of cells in the index space of a lattice, and which of them touch each box of it.
///
/// Boxes are cubes of so many samples along each edge. The first begins half a sample before the first sample.
#[derive(Debug, Clone)]
pub struct Listed {
    /// The points, in index space.
    pub points: Vec<DVec3>,
    /// Samples along the edge of a box.
    pub edge: f64,
    /// Boxes along each axis.
    pub boxes: [usize; 3],
    /// Where the list of each box begins, x fastest, and where the last ends.
    pub starts: Vec<u32>,
    /// Which solids, box by box, each list rising.
    pub lists: Vec<u32>,
}

impl Listed {
    /// Over a lattice of `dims` samples; `index_from_world` leads to its index space. Solids that are not `there` are in no
    /// list.
    ///
    /// # Errors
    /// [`Cancelled`].
    #[expect(
        clippy::cast_possible_truncation,
        reason = "lists are bounded, and files have fewer solids"
    )]
    pub fn new(
        cells: &Cells,
        (dims, index_from_world): ([usize; 3], impl Fn(DVec3) -> DVec3 + Sync),
        is_there: impl Fn(usize) -> bool,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let mut looks = Looks::every(ticket, A_PART);
        let world = cells.points();
        let points = mapped(world.len(), A_PART, |i| index_from_world(world[i]), ticket)?;
        let mut there = Vec::with_capacity(cells.solids().len());
        for solid in 0..cells.solids().len() {
            looks.after(1)?;
            if is_there(solid) {
                there.push(solid as u32);
            }
        }
        let solid = |i: usize| &cells.solids()[there[i] as usize];
        let bounds_of = |i: usize| {
            let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            solid(i).corners().iter().fold(none, |[low, high], corner| {
                let point = points[*corner as usize];
                [low.min(point), high.max(point)]
            })
        };
        let bounds = mapped(there.len(), A_PART, bounds_of, ticket)?;
        let are_parts = (0..there.len()).filter(|i| solid(*i).kind() == Kind::Tetrahedron).count();
        let wanted = (there.len() - are_parts) as f64 * BOXES_A_SOLID
            + are_parts as f64 * BOXES_A_TETRAHEDRON;
        let (boxes, spans) = Boxes::as_fine_as_may_be(dims, wanted, &bounds, ticket)?;
        let [nx, ny, nz] = boxes.count;
        // Each thread has layers of boxes to itself.
        let band = nz.div_ceil(BANDS_A_THREAD * rayon::current_num_threads()).max(1);
        let layers = |i: usize| parallel::part(nz, band, i);
        // The solids that touch some layers, each with a box, from the first of these.
        let touched = |layers: Range<usize>| -> Result<Vec<[u32; 2]>, Cancelled> {
            let first = layers.start * ny * nx;
            let mut looks = Looks::every(ticket, A_PART);
            let mut found = Vec::new();
            for (i, [xs, ys, [low, high]]) in spans.iter().enumerate() {
                let zs =
                    usize::from(*low).max(layers.start)..(usize::from(*high) + 1).min(layers.end);
                if zs.is_empty() {
                    looks.after(1)?;
                    continue;
                }
                let before = found.len();
                let sides = boxes.hold(bounds[i]).then(|| Sides::of(solid(i), &points, boxes.edge));
                let sides = sides.flatten();
                for z in zs {
                    for y in usize::from(ys[0])..=usize::from(ys[1]) {
                        for x in usize::from(xs[0])..=usize::from(xs[1]) {
                            if sides.as_ref().is_none_or(|sides| sides.reach([x, y, z])) {
                                found.push([((z * ny + y) * nx + x - first) as u32, there[i]]);
                            }
                        }
                    }
                }
                looks.after(A_SOLID + found.len() - before)?;
            }
            Ok(found)
        };
        let bands = parallel::try_list(nz.div_ceil(band), |i| touched(layers(i)))?;
        let mut starts = vec![0_u32; nx * ny * nz + 1];
        let of_bands = starts[1..].chunks_mut(band * ny * nx).zip(&bands);
        parallel::each(of_bands, |(counts, band): (_, &Vec<[u32; 2]>)| {
            band.iter().for_each(|[at, _]| counts[*at as usize] += 1);
        });
        for at in 1..starts.len() {
            if at.is_multiple_of(A_RUN) {
                ticket.look()?;
            }
            starts[at] += starts[at - 1];
        }
        let mut lists = vec![0; starts[starts.len() - 1] as usize];
        let mut left = &mut lists[..];
        let of_bands: Vec<_> = starts[..nx * ny * nz]
            .chunks(band * ny * nx)
            .zip(bands)
            .map(|(starts, band)| {
                let (own, rest) = std::mem::take(&mut left).split_at_mut(band.len());
                left = rest;
                (starts, band, own)
            })
            .collect();
        ticket.look()?;
        parallel::each(of_bands.into_iter(), |(starts, band, lists)| {
            let mut next: Vec<u32> = starts.iter().map(|start| start - starts[0]).collect();
            for [at, solid] in band {
                let next = &mut next[at as usize];
                lists[*next as usize] = solid;
                *next += 1;
            }
        });
        let Boxes { edge, count: boxes } = boxes;
        Ok(Self { points, edge, boxes, starts, lists })
    }

    /// The solids that may hold a place of index space.
    pub fn near(&self, place: DVec3) -> &[u32] {
        let [x, y, z] = Boxes { edge: self.edge, count: self.boxes }.about(place);
        let at = (z * self.boxes[1] + y) * self.boxes[0] + x;
        &self.lists[self.starts[at] as usize..self.starts[at + 1] as usize]
    }

    /// Bytes of memory.
    pub fn size_bytes(&self) -> usize {
        size_of_val(&self.points[..]) + size_of_val(&self.starts[..]) + size_of_val(&self.lists[..])
    }
}

/// The first and the last of some boxes along an axis.
type Span = [u8; 2];

/// Cubes of index space.
#[derive(Clone, Copy)]
struct Boxes {
    /// Samples along the edge of one.
    edge: f64,
    /// How many along each axis.
    count: [usize; 3],
}

impl Boxes {
    /// So many as are wanted over a lattice, or as lists of solids with these bounds have room for; and those along each axis
    /// that each solid's bounds touch.
    fn as_fine_as_may_be(
        dims: [usize; 3],
        wanted: f64,
        bounds: &[[DVec3; 2]],
        ticket: &Ticket,
    ) -> Result<(Self, Vec<[Span; 3]>), Cancelled> {
        let along = dims.map(|n| n as f64);
        let mut edge = (along.iter().product::<f64>() / wanted.max(1.0)).cbrt();
        edge = along.iter().fold(edge, |edge, n| edge.max(n / MOST_ALONG));
        loop {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "256 at most"
            )]
            let count = along.map(|n| ((n / edge).ceil() as usize).max(1));
            let boxes = Self { edge, count };
            let spans = mapped(bounds.len(), A_PART, |i| boxes.spans(bounds[i]), ticket)?;
            let count_of = |[low, high]: &Span| usize::from(high - low) + 1;
            let entries: usize =
                spans.iter().map(|spans| spans.iter().map(count_of).product::<usize>()).sum();
            let most = (bounds.len() * MOST_ENTRIES_A_SOLID).max(count.iter().product());
            if entries <= most || count == [1; 3] {
                return Ok((boxes, spans));
            }
            edge *= 1.5;
        }
    }

    /// Whether a box of index space lies within them: what lies beyond is listed in the outermost.
    fn hold(self, [low, high]: [DVec3; 2]) -> bool {
        let end = self.edge * DVec3::from(self.count.map(|n| n as f64)) - 0.5;
        low.cmpge(DVec3::splat(-0.5)).all() && high.cmple(end).all()
    }

    /// Those along each axis that a box of index space touches.
    #[expect(clippy::cast_possible_truncation, reason = "256 at most")]
    fn spans(self, [low, high]: [DVec3; 2]) -> [Span; 3] {
        let rim = RIM * (high - low) + RIM;
        let (first, last) = (self.about(low - rim), self.about(high + rim));
        std::array::from_fn(|axis| [first[axis] as u8, last[axis] as u8])
    }

    /// The one that a place lies in, or the nearest.
    fn about(self, place: DVec3) -> [usize; 3] {
        [0, 1, 2].map(|axis| {
            let at = (place[axis] + 0.5) / self.edge;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            let at = at.clamp(0.0, (self.count[axis] - 1) as f64) as usize;
            at
        })
    }
}

/// The four sides of a tetrahedron among boxes: how high the highest corner of a box lies above each, in units of the
/// tetrahedron, by factors of 1 and of the box's place.
struct Sides([[f64; 4]; 4]);

impl Sides {
    /// Among boxes of an edge; `None` of other solids, and of those without volume.
    fn of(solid: &Solid, points: &[DVec3], edge: f64) -> Option<Self> {
        if solid.kind() != Kind::Tetrahedron {
            return None;
        }
        let &[a, b, c, d] = solid.corners() else { return None };
        let [a, b, c, d] = [a, b, c, d].map(|corner| points[corner as usize]);
        let rows = DMat3::from_cols(b - a, c - a, d - a).inverse().transpose();
        let [r, s, t] = [rows.x_axis, rows.y_axis, rows.z_axis];
        let side = |growth: DVec3, height: f64| {
            let reach = growth.abs().element_sum();
            // From the middle of the first box to its highest corner, and the rim.
            let first = growth.dot(DVec3::splat(edge / 2.0 - 0.5) - a) + reach * (edge / 2.0 + RIM);
            let [x, y, z] = (growth * edge).to_array();
            [height + first + RIM, x, y, z]
        };
        let sides = [side(r, 0.0), side(s, 0.0), side(t, 0.0), side(-(r + s + t), 1.0)];
        sides.iter().flatten().all(|factor| factor.is_finite()).then_some(Self(sides))
    }

    /// Whether a box reaches between them.
    fn reach(&self, place: [usize; 3]) -> bool {
        let [x, y, z] = place.map(|n| n as f64);
        self.0.iter().all(|[one, by_x, by_y, by_z]| one + by_x * x + by_y * y + by_z * z >= 0.0)
    }
}

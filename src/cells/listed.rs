//! Which solids lie near a place: lists of them by the boxes of a lattice's index space.

use std::ops::RangeInclusive;

use glam::DVec3;

use super::Cells;
use crate::core::{Cancelled, Looks, Ticket, mapped};

/// Boxes along an axis, at most.
const MOST_ALONG: f64 = 256.0;
/// Boxes for each solid.
const BOXES_A_SOLID: f64 = 2.0;
/// Entries of all lists for each solid, at most; boxes are larger where they would be more.
const MOST_ENTRIES_A_SOLID: usize = 64;
/// Solids placed, or boxes touched, between two looks at the ticket.
const A_PART: usize = 1 << 14;
/// A solid is as much work as so many boxes.
const A_SOLID: usize = 8;
/// Sums between two looks at it.
const A_RUN: usize = 1 << 20;

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
        let bounds_of = |i: usize| {
            let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            let corners = cells.solids()[there[i] as usize].corners().iter();
            corners.fold(none, |[low, high], corner| {
                let point = points[*corner as usize];
                [low.min(point), high.max(point)]
            })
        };
        let bounds = mapped(there.len(), A_PART, bounds_of, ticket)?;
        let (edge, boxes) = boxes_for(&bounds, dims, ticket)?;
        let mut starts = vec![0_u32; boxes.iter().product::<usize>() + 1];
        for bounds in &bounds {
            let mut count = A_SOLID;
            touch(*bounds, (edge, boxes), |at| {
                starts[at + 1] += 1;
                count += 1;
            });
            looks.after(count)?;
        }
        for at in 1..starts.len() {
            if at.is_multiple_of(A_RUN) {
                ticket.look()?;
            }
            starts[at] += starts[at - 1];
        }
        let mut next = starts.clone();
        let mut lists = vec![0; starts[starts.len() - 1] as usize];
        for (bounds, solid) in bounds.iter().zip(&there) {
            let mut count = A_SOLID;
            touch(*bounds, (edge, boxes), |at| {
                lists[next[at] as usize] = *solid;
                next[at] += 1;
                count += 1;
            });
            looks.after(count)?;
        }
        Ok(Self { points, edge, boxes, starts, lists })
    }

    /// The solids that may hold a place of index space.
    pub fn near(&self, place: DVec3) -> &[u32] {
        let [x, y, z] = box_of(place, (self.edge, self.boxes));
        let at = (z * self.boxes[1] + y) * self.boxes[0] + x;
        &self.lists[self.starts[at] as usize..self.starts[at + 1] as usize]
    }

    /// Bytes of memory.
    pub fn size_bytes(&self) -> usize {
        size_of_val(&self.points[..]) + size_of_val(&self.starts[..]) + size_of_val(&self.lists[..])
    }
}

/// Samples along the edge of a box, and boxes along each axis: as fine as lists have room for.
fn boxes_for(
    bounds: &[[DVec3; 2]],
    dims: [usize; 3],
    ticket: &Ticket,
) -> Result<(f64, [usize; 3]), Cancelled> {
    let mut looks = Looks::every(ticket, A_PART);
    let along = dims.map(|n| n as f64);
    let wanted = (bounds.len() as f64 * BOXES_A_SOLID).max(1.0);
    let mut edge = (along.iter().product::<f64>() / wanted).cbrt();
    edge = along.iter().fold(edge, |edge, n| edge.max(n / MOST_ALONG));
    loop {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "256 at most")]
        let boxes = along.map(|n| ((n / edge).ceil() as usize).max(1));
        let most = (bounds.len() * MOST_ENTRIES_A_SOLID).max(boxes.iter().product());
        let mut entries = 0;
        for bounds in bounds {
            looks.after(1)?;
            let spans = spans(*bounds, (edge, boxes));
            entries += spans.iter().map(|span| span.end() - span.start() + 1).product::<usize>();
            if entries > most {
                break;
            }
        }
        if entries <= most || boxes == [1; 3] {
            return Ok((edge, boxes));
        }
        edge *= 1.5;
    }
}

/// The boxes along each axis that a box of index space touches.
fn spans([low, high]: [DVec3; 2], boxes: (f64, [usize; 3])) -> [RangeInclusive<usize>; 3] {
    // Places on a border belong to either side, by rounding.
    let rim = 1e-4 * (high - low) + 1e-4;
    let (first, last) = (box_of(low - rim, boxes), box_of(high + rim, boxes));
    std::array::from_fn(|axis| first[axis]..=last[axis])
}

/// The box that a place lies in, or the nearest.
fn box_of(place: DVec3, (edge, boxes): (f64, [usize; 3])) -> [usize; 3] {
    [0, 1, 2].map(|axis| {
        let at = ((place[axis] + 0.5) / edge).floor();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let at = at.clamp(0.0, (boxes[axis] - 1) as f64) as usize;
        at
    })
}

fn touch(bounds: [DVec3; 2], boxes: (f64, [usize; 3]), mut touched: impl FnMut(usize)) {
    let [xs, ys, zs] = spans(bounds, boxes);
    let [nx, ny, _] = boxes.1;
    for z in zs {
        for y in ys.clone() {
            for x in xs.clone() {
                touched((z * ny + y) * nx + x);
            }
        }
    }
}

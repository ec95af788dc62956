//! Values on cells that lie anywhere, in float64: a tree of their boxes, where a place lies in one by Newton's method, and
//! where a ray passes from one to the next.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::sources::Line;
use crate::cells::{CellField, Kind, On, Placed, ShadingNormals};
use crate::core::Ticket;
use crate::volume::Lattice;

/// Cells in a leaf of the tree.
const A_LEAF: usize = 4;
/// Boxes of cells are wider by this share, for rounding.
const RIM: f64 = 1e-6;

/// Cells in the index space of a lattice.
pub(super) struct Cells {
    field: Arc<CellField>,
    lattice: Lattice,
    nodes: Vec<Node>,
    /// Numbers of solids, leaf by leaf.
    order: Vec<u32>,
    /// What the field grows by at its points, and what light takes for that, once they are asked for.
    growths: OnceLock<Vec<DVec3>>,
    lit: OnceLock<Option<ShadingNormals>>,
}

/// A box that holds some cells.
struct Node {
    bounds: [DVec3; 2],
    /// Of a leaf the first of its cells in the order; else the second child, as the first comes next.
    at: usize,
    /// Cells of a leaf; 0 of others.
    count: usize,
}

impl Cells {
    pub(super) fn new(field: Arc<CellField>, lattice: Lattice) -> Self {
        let (growths, lit) = (OnceLock::new(), OnceLock::new());
        let mut cells = Self { field, lattice, nodes: Vec::new(), order: Vec::new(), growths, lit };
        let count = cells.field.cells().solids().len();
        let is_there = |solid: &u32| cells.field.is_there(*solid as usize);
        let mut order: Vec<u32> = (0..count as u32).filter(is_there).collect();
        let bounds: Vec<[DVec3; 2]> =
            (0..count).map(|solid| cells.placed(solid).bounds()).collect();
        if !order.is_empty() {
            cells.build(&mut order, 0, &bounds);
        }
        cells.order = order;
        cells
    }

    /// Adds the node of a part of the order that begins at `first`.
    fn build(&mut self, part: &mut [u32], first: usize, bounds: &[[DVec3; 2]]) {
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let all = part.iter().map(|solid| bounds[*solid as usize]);
        let [low, high] = all.fold(none, |[a, b], [low, high]| [a.min(low), b.max(high)]);
        let rim = DVec3::splat(RIM * (1.0 + (high - low).max_element()));
        let own = self.nodes.len();
        self.nodes.push(Node { bounds: [low - rim, high + rim], at: first, count: part.len() });
        if part.len() <= A_LEAF {
            return;
        }
        let axis = (high - low).max_position();
        let middle = part.len() / 2;
        let place =
            |solid: &u32| bounds[*solid as usize][0][axis] + bounds[*solid as usize][1][axis];
        part.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)));
        let (left, right) = part.split_at_mut(middle);
        self.build(left, first, bounds);
        self.nodes[own].at = self.nodes.len();
        self.nodes[own].count = 0;
        self.build(right, first + middle, bounds);
    }

    fn placed(&self, solid: usize) -> Placed {
        let placed = self.field.cells().placed(solid);
        let mut corners = [DVec3::ZERO; 8];
        for (to, from) in corners.iter_mut().zip(placed.corners()) {
            *to = self.lattice.index_from_world(*from);
        }
        Placed::new(placed.kind(), corners)
    }

    /// Calls `visit` with the cells in leaves that are met, as are all boxes about them.
    fn each(&self, meets: impl Fn(&[DVec3; 2]) -> bool, mut visit: impl FnMut(usize)) {
        let mut open: Vec<usize> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(at) = open.pop() {
            let node = &self.nodes[at];
            if !meets(&node.bounds) {
                continue;
            }
            if node.count == 0 {
                open.extend([node.at, at + 1]);
            } else {
                let own = &self.order[node.at..node.at + node.count];
                own.iter().for_each(|solid| visit(*solid as usize));
            }
        }
    }

    /// The cell that a place of index space lies in, the first where several have it, and where.
    pub(super) fn find(&self, place: DVec3) -> Option<(usize, DVec3)> {
        let mut found: Option<(usize, DVec3)> = None;
        let meets = |[low, high]: &[DVec3; 2]| place.cmpge(*low).all() && place.cmple(*high).all();
        self.each(meets, |solid| {
            if found.is_none_or(|(first, _)| solid < first)
                && let Some(unit) = self.placed(solid).unit_from(place)
            {
                found = Some((solid, unit));
            }
        });
        found
    }

    /// Which of the file's cells one is of.
    pub(super) fn source(&self, solid: usize) -> u32 {
        self.field.cells().sources()[solid]
    }

    /// The value at a place; `None` outside all cells.
    pub(super) fn value(&self, place: DVec3) -> Option<f64> {
        self.find(place).map(|(solid, unit)| self.field.value(solid, unit))
    }

    /// Whether the field has a level at a place at which it is passed. Numbers of cells have theirs up to their faces, where the
    /// surface is.
    pub(super) fn has_level(&self, place: DVec3, level: f64) -> bool {
        self.field.on() == On::Cells
            || self.find(place).is_some_and(|(solid, unit)| {
                let off = (self.field.value(solid, unit) - level).abs();
                off <= self.field.slack(solid, Placed::RIM)
            })
    }

    /// The value at a place of one cell; `None` beyond its faces.
    pub(super) fn value_in(&self, solid: usize, place: DVec3) -> Option<f64> {
        self.placed(solid).unit_from(place).map(|unit| self.field.value(solid, unit))
    }

    /// Whether the values of a cell are linear, or one.
    pub(super) fn degree(&self, solid: usize) -> Option<usize> {
        match (self.field.on(), self.field.cells().solids()[solid].kind()) {
            (On::Cells, _) => Some(0),
            (On::Points, Kind::Tetrahedron) => Some(1),
            (On::Points, _) => None,
        }
    }

    /// Growth per index, as recovered at the points, between these by the shape functions; 0 outside.
    pub(super) fn growth(&self, place: DVec3) -> DVec3 {
        let Some((solid, unit)) = self.find(place) else { return DVec3::ZERO };
        let solid = &self.field.cells().solids()[solid];
        // Nobody cancels a fresh ticket.
        let made = || self.field.growths(&Ticket::new()).unwrap_or_default();
        let growths = self.growths.get_or_init(made);
        let weights = solid.kind().weights(unit);
        let world: DVec3 = solid
            .corners()
            .iter()
            .zip(weights)
            .map(|(corner, weight)| growths[*corner as usize] * weight)
            .sum();
        self.lattice.axes().transpose() * world
    }

    /// What light takes for it, for a ray through a place in a direction: see [`ShadingNormals`].
    pub(super) fn growth_for_light(&self, place: DVec3, direction: DVec3) -> DVec3 {
        let Some((own, unit)) = self.find(place) else { return DVec3::ZERO };
        // Nobody cancels a fresh ticket.
        let made = || self.field.shading_normals(&Ticket::new()).ok();
        let Some(lit) = self.lit.get_or_init(made) else { return DVec3::ZERO };
        let axes = self.lattice.axes();
        let ray = (self.lattice.world_from_index(place), axes * direction);
        let growth = lit.growth((own, &self.field.cells().solids()[own]), unit, ray);
        axes.transpose() * growth
    }

    /// Where a part of a ray passes the faces of cells, and some places beside them, in no order.
    pub(super) fn crossings(&self, line: &Line, [a, b]: [f64; 2]) -> Vec<f64> {
        let mut found = Vec::new();
        let meets = |[low, high]: &[DVec3; 2]| {
            let mut span = [a, b];
            for axis in 0..3 {
                let (start, step) = (line.start[axis], line.step[axis]);
                if step == 0.0 {
                    if !(low[axis]..=high[axis]).contains(&start) {
                        return false;
                    }
                    continue;
                }
                let ends = [(low[axis] - start) / step, (high[axis] - start) / step];
                span = [span[0].max(ends[0].min(ends[1])), span[1].min(ends[0].max(ends[1]))];
            }
            span[0] <= span[1]
        };
        self.each(meets, |solid| {
            let placed = self.placed(solid);
            for face in placed.kind().faces() {
                let corner = |i: usize| placed.corners()[face[i]];
                match face.len() {
                    3 => {
                        let normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
                        found.push(normal.dot(corner(0) - line.start) / normal.dot(line.step));
                    }
                    _ => bilinear([corner(0), corner(1), corner(3), corner(2)], line, &mut found),
                }
            }
        });
        found.retain(|t| *t > a && *t < b);
        found
    }
}

/// Where a line passes a face that is bilinear between p(0, 0), p(1, 0), p(0, 1) and p(1, 1): seen along the line it is
/// 0 = A + u B + v C + u v D in two coordinates across it, of which u is eliminated.
fn bilinear([p00, p10, p01, p11]: [DVec3; 4], line: &Line, found: &mut Vec<f64>) {
    let (u, v) = line.step.normalize().any_orthonormal_pair();
    let seen = |p: DVec3| [p.dot(u), p.dot(v)];
    let (a, b, c, d) =
        (seen(p00 - line.start), seen(p10 - p00), seen(p01 - p00), seen(p11 - p10 - p01 + p00));
    let det = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    // (A + vC) × (B + vD) = 0.
    let (two, one, zero) = (det(c, d), det(a, d) + det(c, b), det(a, b));
    let mut vs = Vec::new();
    if two.abs() <= 1e-14 * (one.abs() + zero.abs()) {
        vs.push(-zero / one);
    } else {
        let root = (one * one - 4.0 * two * zero).sqrt();
        // Without the difference of like numbers.
        let sum = -0.5 * (one + root.copysign(one));
        vs.extend([sum / two, zero / sum]);
    }
    for v in vs.into_iter().filter(|v| v.is_finite() && (-0.01..=1.01).contains(v)) {
        let (from, by) = ([a[0] + v * c[0], a[1] + v * c[1]], [b[0] + v * d[0], b[1] + v * d[1]]);
        let i = usize::from(by[1].abs() > by[0].abs());
        let u = -from[i] / by[i];
        if u.is_finite() {
            let place = p00 + u * (p10 - p00) + v * (p01 - p00) + u * v * (p11 - p10 - p01 + p00);
            found.push((place - line.start).dot(line.step) / line.step.length_squared());
        }
    }
}

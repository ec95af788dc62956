//! The cells of an octree cut as plain data, and where their edges land on a picture.
//!
//! Laur–Hanrahan draw them at falling errors (their figure 5): where a field changes quickly cells
//! are small, and where it is flat they are large.

use std::collections::HashSet;

use glam::{DVec2, DVec3};

use super::View;
use crate::core::Srgb8;
use crate::hierarchy::{Cut, CutLimits, CutNode};

/// Nearest depth of what is drawn, in distances from the eye to the focal plane.
const NEAREST: f64 = 1e-6;

/// Colours of the levels from single voxels up, starting over after the last: Okabe and Ito's, which
/// people with any colour vision can tell apart.
const LEVEL_COLOURS: [Srgb8; 7] = [
    Srgb8([86, 180, 233]),
    Srgb8([230, 159, 0]),
    Srgb8([0, 158, 115]),
    Srgb8([240, 228, 66]),
    Srgb8([204, 121, 167]),
    Srgb8([213, 94, 0]),
    Srgb8([0, 114, 178]),
];

/// The colour that cells of a level are drawn in.
pub fn level_colour(level: u8) -> Srgb8 {
    LEVEL_COLOURS[usize::from(level) % LEVEL_COLOURS.len()]
}

/// Why a node was drawn rather than its children.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WhyWhole {
    /// It is a voxel: there is nothing to split.
    Voxel,
    /// Its error is below the one asked for.
    ErrorSmallEnough,
    /// Its children's kernels would have a radius under a pixel of the picture.
    UnderAPixel,
    /// Its level was asked for, whatever the errors.
    LevelAskedFor,
    /// It is a brick of a field that is drawn from the samples themselves.
    Samples,
    /// It is a brick of a field whose finer levels have not come yet.
    NotCome,
}

/// One node of a cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// First voxel of the box of real voxels.
    pub low: [u32; 3],
    /// Voxels along each axis.
    pub size: [u32; 3],
    /// Its level: 2^level voxels along each edge, but at the volume's borders.
    pub level: u8,
    /// Its error (see `hierarchy::Node::error`); 0 for voxels.
    pub error: f32,
    /// Mean extinction per unit distance.
    pub extinction: f32,
    /// Mean colour, linear light, as 16-bit fractions of 1.
    pub colour: [u16; 3],
    /// Why it is not split.
    pub why: WhyWhole,
}

impl Cell {
    fn of(node: &CutNode, limits: &CutLimits) -> Self {
        let why = match () {
            () if node.size == [1; 3] => WhyWhole::Voxel,
            () if node.node.error < limits.max_error => WhyWhole::ErrorSmallEnough,
            () if usize::from(node.level) <= limits.finest_level => WhyWhole::LevelAskedFor,
            () => WhyWhole::UnderAPixel,
        };
        Self {
            low: node.low,
            size: node.size,
            level: node.level,
            error: node.node.error,
            extinction: node.node.extinction,
            colour: node.node.colour,
            why,
        }
    }

    /// Real voxels in it.
    pub fn voxels(&self) -> u64 {
        self.size.iter().map(|&n| u64::from(n)).product()
    }

    /// Opacity over one unit distance.
    pub fn opacity(&self) -> f64 {
        -(-f64::from(self.extinction)).exp_m1()
    }

    /// The corners of its box in index space: half a voxel beyond the first and the last.
    fn corners(&self) -> [DVec3; 2] {
        let low = DVec3::from_array(self.low.map(f64::from)) - DVec3::splat(0.5);
        [low, low + DVec3::from_array(self.size.map(f64::from))]
    }
}

/// An edge of one cell, or of several that share it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Edge {
    /// The corner it begins at: between voxels, 0 to the dimensions.
    from: [u32; 3],
    /// Along which axis of the lattice.
    axis: u8,
    /// How far, voxels.
    length: u32,
    /// The level of the first cell that has it.
    pub level: u8,
}

impl Edge {
    /// Its ends in index space.
    fn ends(&self) -> [DVec3; 2] {
        let from = DVec3::from_array(self.from.map(f64::from)) - DVec3::splat(0.5);
        let mut to = from;
        to[usize::from(self.axis)] += f64::from(self.length);
        [from, to]
    }
}

/// The cells of a cut, or the largest of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cells {
    /// The cells, far to near.
    pub cells: Vec<Cell>,
    /// Their edges, those that several share once.
    pub edges: Vec<Edge>,
    /// Cells of the whole cut.
    pub total: u64,
    /// The error that was asked for.
    pub max_error: f32,
}

impl Cells {
    /// The cells of a cut found within `limits`: where there are more than `most`, those with the most
    /// voxels.
    pub(crate) fn of(cut: &Cut, limits: &CutLimits, most: usize) -> Self {
        let total = cut.nodes.len();
        let voxels = |i: usize| cut.nodes[i].size.iter().map(|&n| u64::from(n)).product::<u64>();
        let mut kept: Vec<usize> = (0..total).collect();
        if total > most {
            kept.select_nth_unstable_by_key(most, |&i| (std::cmp::Reverse(voxels(i)), i));
            kept.truncate(most);
            // Far to near again.
            kept.sort_unstable();
        }
        let cells: Vec<Cell> = kept.iter().map(|&i| Cell::of(&cut.nodes[i], limits)).collect();
        Self::from_cells(cells, total as u64, limits.max_error)
    }

    /// The same from cells, far to near, of `total`.
    pub fn from_cells(cells: Vec<Cell>, total: u64, max_error: f32) -> Self {
        let edges = edges_of(&cells);
        Self { cells, edges, total, max_error }
    }

    /// The cell that a ray meets first. `ray` is from [`View::index_ray`].
    pub fn first_met(&self, ray: &IndexRay) -> Option<&Cell> {
        let met = self.cells.iter().filter_map(|cell| Some((ray.enters(cell.corners())?, cell)));
        met.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, cell)| cell)
    }

    /// The levels that there are, finest first, and how many cells of each.
    pub fn levels(&self) -> Vec<(u8, u64)> {
        let mut counts = [0_u64; 256];
        self.cells.iter().for_each(|cell| counts[usize::from(cell.level)] += 1);
        (0..=u8::MAX).zip(counts).filter(|(_, count)| *count > 0).collect()
    }
}

/// The edges of all cells, each once.
fn edges_of(cells: &[Cell]) -> Vec<Edge> {
    let mut seen = HashSet::with_capacity(4 * cells.len());
    let mut edges = Vec::new();
    for cell in cells {
        for axis in 0..3_u8 {
            let length = cell.size[usize::from(axis)];
            for corner in 0..4_u32 {
                let mut from = cell.low;
                let others = (0..3_usize).filter(|&a| a != usize::from(axis));
                for (bit, other) in others.enumerate() {
                    from[other] += (corner >> bit & 1) * cell.size[other];
                }
                if seen.insert((from, axis, length)) {
                    edges.push(Edge { from, axis, length, level: cell.level });
                }
            }
        }
    }
    edges
}

/// A ray in index space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IndexRay {
    origin: DVec3,
    direction: DVec3,
    /// Nothing before the origin counts: it is an eye.
    from_eye: bool,
}

impl IndexRay {
    /// Where it enters a box, in lengths of its direction; `None` where it misses it.
    fn enters(&self, [low, high]: [DVec3; 2]) -> Option<f64> {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        if self.from_eye {
            enter = 0.0;
        }
        for axis in 0..3 {
            let (origin, step) = (self.origin[axis], self.direction[axis]);
            if step == 0.0 {
                if origin < low[axis] || origin > high[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low[axis] - origin) / step, (high[axis] - origin) / step);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some(enter)
    }
}

impl View {
    /// Where an edge lands on the picture, pixels from its top left corner: clipped at the eye and at
    /// the picture's borders. `None` where nothing of it is left.
    pub fn edge_on_picture(&self, edge: &Edge) -> Option<[DVec2; 2]> {
        self.segment_on_picture(edge.ends())
    }

    /// Where the twelve edges of a cell land.
    pub fn cell_on_picture(&self, cell: &Cell) -> Vec<[DVec2; 2]> {
        edges_of(std::slice::from_ref(cell))
            .iter()
            .filter_map(|edge| self.edge_on_picture(edge))
            .collect()
    }

    /// Where the twelve edges of a box of index space land.
    pub fn box_on_picture(&self, [low, high]: [DVec3; 2]) -> Vec<[DVec2; 2]> {
        let corner = |bits: usize| {
            let part = |a: usize| if bits >> a & 1 == 1 { high[a] } else { low[a] };
            DVec3::new(part(0), part(1), part(2))
        };
        let edges = (0..8).flat_map(|bits| (0..3).map(move |axis| (bits, bits | 1 << axis)));
        edges
            .filter(|(from, to)| from != to)
            .filter_map(|(from, to)| self.segment_on_picture([corner(from), corner(to)]))
            .collect()
    }

    /// Where a place of index space lands, pixels from the top left corner, also beside the picture;
    /// `None` at or behind the eye.
    pub fn point_on_picture(&self, index: DVec3) -> Option<DVec2> {
        let view = self.view_centre + self.view_from_index * (index - self.lattice_centre);
        let shrink = match self.eye_distance {
            Some(distance) if view.z < NEAREST * distance => return None,
            Some(distance) => distance / view.z,
            None => 1.0,
        };
        let half = DVec2::new(f64::from(self.size[0]), f64::from(self.size[1])) / 2.0;
        Some(DVec2::new(half.x + view.x * shrink, half.y - view.y * shrink))
    }

    /// The ray through a position on the picture, pixels from its top left corner.
    pub fn index_ray(&self, pixel: DVec2) -> IndexRay {
        let half = DVec2::new(f64::from(self.size[0]), f64::from(self.size[1])) / 2.0;
        let (x, y) = (pixel.x - half.x, half.y - pixel.y);
        let (origin, direction) = match self.eye_distance {
            None => (DVec3::new(x, y, 0.0), DVec3::Z),
            Some(distance) => (DVec3::ZERO, DVec3::new(x, y, distance)),
        };
        let index_from_view = self.view_from_index.inverse();
        IndexRay {
            origin: self.lattice_centre + index_from_view * (origin - self.view_centre),
            direction: index_from_view * direction,
            from_eye: self.eye_distance.is_some(),
        }
    }

    /// Where a segment of index space lands; see [`View::edge_on_picture`].
    fn segment_on_picture(&self, ends: [DVec3; 2]) -> Option<[DVec2; 2]> {
        let to_view =
            |index| self.view_centre + self.view_from_index * (index - self.lattice_centre);
        let [mut a, mut b] = ends.map(to_view);
        if let Some(distance) = self.eye_distance {
            let nearest = NEAREST * distance;
            if a.z < nearest && b.z < nearest {
                return None;
            }
            let at_nearest = |out: DVec3, other: DVec3| {
                out + (other - out) * ((nearest - out.z) / (other.z - out.z))
            };
            if a.z < nearest {
                a = at_nearest(a, b);
            } else if b.z < nearest {
                b = at_nearest(b, a);
            }
        }
        let size = DVec2::new(f64::from(self.size[0]), f64::from(self.size[1]));
        let to_pixel = |view: DVec3| {
            let shrink = self.eye_distance.map_or(1.0, |distance| distance / view.z);
            DVec2::new(size.x / 2.0 + view.x * shrink, size.y / 2.0 - view.y * shrink)
        };
        clipped([a, b].map(to_pixel), size)
    }
}

/// The part of a segment that is on a picture of this size (Liang and Barsky).
fn clipped([a, b]: [DVec2; 2], size: DVec2) -> Option<[DVec2; 2]> {
    let along = b - a;
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        if along[axis] == 0.0 {
            if a[axis] < 0.0 || a[axis] > size[axis] {
                return None;
            }
            continue;
        }
        let (s, t) = (-a[axis] / along[axis], (size[axis] - a[axis]) / along[axis]);
        first = first.max(s.min(t));
        last = last.min(s.max(t));
    }
    // Not a number where a position was infinite: nothing is drawn then.
    (first <= last).then(|| [a + along * first, a + along * last])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Camera, Projection};
    use crate::hierarchy::Node;
    use crate::volume::Lattice;

    fn node(low: [u32; 3], size: [u32; 3], level: u8, error: f32) -> CutNode {
        let node = Node { extinction: 1.0, error, colour: [0; 3], active_children: 8 };
        CutNode { low, size, level, node }
    }

    fn cells(nodes: Vec<CutNode>, max_error: f32, most: usize) -> Cells {
        let limits = CutLimits::of_error(max_error);
        Cells::of(&Cut { nodes, visited: 0 }, &limits, most)
    }

    /// Eight pixels a voxel in a picture of 100 × 80; the middle of 8³ voxels in its middle.
    fn camera() -> Camera {
        Camera::new(DVec3::splat(3.5), DVec3::Z, DVec3::Y, 5.0)
    }

    fn is_near(found: [DVec2; 2], expected: [[f64; 2]; 2]) -> bool {
        let off = |a: DVec2, b: [f64; 2]| (a - DVec2::from_array(b)).length();
        let same = off(found[0], expected[0]).max(off(found[1], expected[1]));
        let turned = off(found[0], expected[1]).max(off(found[1], expected[0]));
        same.min(turned) < 1e-9
    }

    #[test]
    fn a_cells_edges_land_where_arithmetic_by_hand_puts_them() {
        let lattice = Lattice::unit([8; 3]);
        let view = View::of(&camera(), &lattice, [100, 80]);
        let cell = cells(vec![node([4, 4, 4], [2, 2, 2], 1, 0.0)], 1.0, 9).cells[0];
        let edges = view.cell_on_picture(&cell);
        assert_eq!(edges.len(), 12);
        // Along z, right is direction × up = −x. The box 3.5 to 5.5 is 0 to 2 voxels from the middle:
        // 0 to 16 pixels to the left and up.
        let square = [
            [[50.0, 40.0], [34.0, 40.0]],
            [[50.0, 24.0], [34.0, 24.0]],
            [[50.0, 40.0], [50.0, 24.0]],
            [[34.0, 40.0], [34.0, 24.0]],
        ];
        for side in square {
            let count = edges.iter().filter(|&&edge| is_near(edge, side)).count();
            assert_eq!(count, 2, "front and back face: {side:?} in {edges:?}");
        }
        // In perspective from 10 away the near face, z = 3.5, is in the focal plane, and the far one
        // 10 / 12 times as large.
        let view_angle = 2.0 * 0.5_f64.atan();
        let camera = Camera { projection: Projection::Perspective { view_angle }, ..camera() };
        let view = View::of(&camera, &lattice, [100, 80]);
        let edges = view.cell_on_picture(&cell);
        let far = 16.0 * 10.0 / 12.0;
        for (side, count) in [
            ([[50.0, 24.0], [34.0, 24.0]], 1),
            ([[50.0, 40.0 - far], [50.0 - far, 40.0 - far]], 1),
            ([[34.0, 24.0], [50.0 - far, 40.0 - far]], 1),
        ] {
            assert_eq!(edges.iter().filter(|&&e| is_near(e, side)).count(), count, "{side:?}");
        }
    }

    #[test]
    fn a_boxs_edges_are_those_of_a_cell_of_its_size() {
        let lattice = Lattice::unit([8; 3]);
        let view_angle = 2.0 * 0.5_f64.atan();
        let projection = Projection::Perspective { view_angle };
        for camera in [camera(), Camera { projection, ..camera() }] {
            let view = View::of(&camera, &lattice, [100, 80]);
            let cell = cells(vec![node([3, 4, 4], [1, 2, 2], 1, 0.0)], 1.0, 9).cells[0];
            let expected = view.cell_on_picture(&cell);
            let ends = [DVec3::new(2.5, 3.5, 3.5), DVec3::new(3.5, 5.5, 5.5)];
            let found = view.box_on_picture(ends);
            assert_eq!((found.len(), expected.len()), (12, 12));
            for edge in expected {
                let edge = edge.map(|end| end.to_array());
                assert!(found.iter().any(|&other| is_near(other, edge)), "{edge:?}");
            }
            let corner = view.point_on_picture(ends[0]).unwrap();
            let is_end = |end: &DVec2| (*end - corner).length() < 1e-9;
            // Along an axis, the corner behind it is seen in the same place.
            let count = if view.eye_distance.is_some() { 3 } else { 6 };
            assert_eq!(found.iter().flatten().filter(|end| is_end(end)).count(), count);
        }
    }

    #[test]
    fn edges_are_cut_at_the_eye_and_at_the_pictures_borders() {
        let lattice = Lattice::unit([8; 3]);
        let view_angle = 2.0 * 0.5_f64.atan();
        let mut camera = Camera { projection: Projection::Perspective { view_angle }, ..camera() };
        // The eye is 10 before the focal point: at z = 3.5, in the middle of the volume.
        camera.focal_point.z = 13.5;
        let view = View::of(&camera, &lattice, [100, 80]);
        let whole = cells(vec![node([0; 3], [8, 8, 8], 3, 0.0)], 1.0, 9).cells[0];
        for edge in view.cell_on_picture(&whole) {
            for end in edge {
                let inside = (-1e-9..=100.0 + 1e-9).contains(&end.x)
                    && (-1e-9..=80.0 + 1e-9).contains(&end.y);
                assert!(inside, "{end}");
            }
        }
        // Behind the eye from its first to its last point.
        let behind = cells(vec![node([2, 2, 0], [2, 2, 2], 1, 0.0)], 1.0, 9).cells[0];
        assert!(view.cell_on_picture(&behind).is_empty());
        // Beside the eye's axis, from before to behind it: what is left runs from the far end, 4 away
        // and so 80 / 4 = 20 pixels a voxel, out of the picture.
        let through = Edge { from: [5, 4, 0], axis: 2, length: 8, level: 0 };
        let [a, b] = view.edge_on_picture(&through).unwrap();
        assert!(is_near([a, b], [[30.0, 40.0], [0.0, 40.0]]), "{a} {b}");
        let across =
            clipped([DVec2::new(-10.0, -10.0), DVec2::new(30.0, 30.0)], DVec2::splat(20.0));
        assert!(is_near(across.unwrap(), [[0.0, 0.0], [20.0, 20.0]]));
        let beside = clipped([DVec2::new(-10.0, 5.0), DVec2::new(5.0, -11.0)], DVec2::splat(20.0));
        assert_eq!(beside, None);
        let nowhere = clipped([DVec2::new(f64::NAN, 5.0), DVec2::splat(3.0)], DVec2::splat(20.0));
        assert_eq!(nowhere.filter(|ends| ends[0].is_finite()), None);
    }

    #[test]
    fn what_cells_share_is_one_edge_and_the_largest_are_kept_in_their_order() {
        let pair = vec![node([0; 3], [2; 3], 1, 0.0), node([2, 0, 0], [2; 3], 1, 0.0)];
        let found = cells(pair, 1.0, 9);
        // Twelve each, four shared.
        assert_eq!((found.edges.len(), found.total), (20, 2));
        let nodes = vec![
            node([0; 3], [1; 3], 0, 0.0),
            node([2, 0, 0], [2; 3], 1, 0.0),
            node([1, 0, 0], [1; 3], 0, 0.0),
            node([4, 0, 0], [4; 3], 2, 0.0),
        ];
        let found = cells(nodes, 1.0, 3);
        let lows: Vec<u32> = found.cells.iter().map(|cell| cell.low[0]).collect();
        assert_eq!((lows, found.total), (vec![0, 2, 4], 4));
        assert_eq!(found.levels(), [(0, 1), (1, 1), (2, 1)]);
    }

    #[test]
    fn a_cell_says_why_it_is_whole() {
        let nodes = vec![
            node([0; 3], [1; 3], 0, 0.0),
            node([2, 0, 0], [2; 3], 1, 0.05),
            node([4, 0, 0], [4; 3], 2, 0.5),
            // What is left of a node at the border can be one voxel.
            node([8, 0, 0], [1; 3], 2, 0.0),
        ];
        let found = cells(nodes, 0.1, 9);
        let why: Vec<WhyWhole> = found.cells.iter().map(|cell| cell.why).collect();
        use WhyWhole::{ErrorSmallEnough, UnderAPixel, Voxel};
        assert_eq!(why, [Voxel, ErrorSmallEnough, UnderAPixel, Voxel]);
        assert_eq!(found.cells[2].voxels(), 64);
        assert!((found.cells[0].opacity() - 0.632_120_558_828_557_7).abs() < 1e-12, "1 − 1/e");
    }

    #[test]
    fn the_cell_under_the_cursor_is_the_nearest_one_along_its_ray() {
        let lattice = Lattice { spacing: DVec3::new(1.0, 1.0, 2.0), ..Lattice::unit([8; 3]) };
        let found =
            cells(vec![node([4, 4, 4], [4; 3], 2, 0.0), node([4, 4, 0], [2; 3], 1, 0.0)], 1.0, 9);
        let camera = Camera { focal_point: DVec3::new(3.5, 3.5, 7.0), ..camera() };
        let view_angle = 2.0 * 0.5_f64.atan();
        let perspective = Camera { projection: Projection::Perspective { view_angle }, ..camera };
        for camera in [camera, perspective] {
            let view = View::of(&camera, &lattice, [100, 80]);
            let at = |x, y| found.first_met(&view.index_ray(DVec2::new(x, y)));
            assert_eq!(at(45.0, 35.0), Some(&found.cells[1]), "the near one hides the far one");
            // 27 pixels are 3.4 voxels where rays are parallel: beside the near one's 2. To an eye 10
            // before the focal plane, and 2 before the near one, they are 0.7 voxels of it.
            let expected = if camera.eye_distance().is_none() { 0 } else { 1 };
            assert_eq!(at(23.0, 13.0), Some(&found.cells[expected]));
            if camera.eye_distance().is_none() {
                assert_eq!(at(17.0, 13.0), None, "33 pixels are more than the far one's 4 voxels");
            }
            assert_eq!(at(55.0, 35.0), None);
        }
        // With the eye between them, only what is before it.
        let mut inside = perspective;
        inside.focal_point.z = 17.5;
        let view = View::of(&inside, &lattice, [100, 80]);
        assert_eq!(found.first_met(&view.index_ray(DVec2::new(45.0, 35.0))), Some(&found.cells[0]));
        inside.focal_point.z = 60.0;
        let view = View::of(&inside, &lattice, [100, 80]);
        assert_eq!(found.first_met(&view.index_ray(DVec2::new(45.0, 35.0))), None);
    }

    #[test]
    fn neighbouring_levels_differ_in_colour() {
        for level in 0..20 {
            assert_ne!(level_colour(level), level_colour(level + 1));
        }
    }
}

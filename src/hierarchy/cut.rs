//! Octree cuts: the coarsest nodes whose error is small enough, far to near.

use std::collections::HashSet;

use glam::{DMat3, DVec2, DVec3};

use super::occlusion::Occlusion;
use super::pyramid::{Node, Pyramid};

/// A cut that is fitted to a count is fitted again at most so often,
const MOST_REFITS: usize = 10;
/// its error by this power of how many times too many nodes it has, or to between what was too many and too few.
const REFIT_POWER: f32 = 0.8;
/// and by this factor besides where the step before made no difference: between two levels of an even body there
/// are no errors.
const REFIT_LEAP: f32 = 8.0;

/// A node beside nothing is off by as much as if so large a share of what its kernel covers were empty.
const BEYOND_EDGE: f32 = 1.0 / 7.0;

/// When a node is drawn rather than its children.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutLimits {
    /// Nodes with less than this error are drawn; 0 goes down to single voxels, in flat regions too.
    pub max_error: f32,
    /// Nodes of at most this level are drawn whatever their error (0: voxels).
    pub finest_level: usize,
    /// Nodes whose children's kernels would have a radius under this many pixels are drawn.
    pub min_radius_px: f64,
    /// Weighs a node's error by what of it shows before it is held to `max_error`: by the transmittance
    /// of what lies in front of it, along a coarse raster of rays, and in perspective by how much
    /// nearer than the focal plane it is. Assumes that no gap in front falls between two rays, and that
    /// errors show in proportion. An error of 0 still goes down to every voxel.
    pub view_dependent: bool,
    /// What a splat takes whatever its size, as pixels that one covers: nodes are split, too, where
    /// those of their children that show take no more than they do. A large node that holds a piece of
    /// one vessel covers many times the pixels of its few children. `None`: by error alone.
    pub splat_px: Option<f64>,
    /// Counts what a node's kernel lays beyond its box as an error, too, where nothing is beside it: by errors
    /// within boxes alone, a solid cube would be one node, and blurred.
    pub minds_edges: bool,
    /// Splits further until nodes that share a face differ by at most one level.
    pub balanced: bool,
}

impl CutLimits {
    /// By error alone, down to nodes whose kernels are a pixel wide.
    pub const fn of_error(max_error: f32) -> Self {
        Self {
            max_error,
            finest_level: 0,
            min_radius_px: 1.0,
            view_dependent: false,
            splat_px: None,
            minds_edges: false,
            balanced: false,
        }
    }
}

/// Far-to-near order of octants, and what of the octree is in view.
#[derive(Debug, Clone, Copy)]
pub enum VisitOrder {
    /// Parallel rays along this index-space direction.
    Along(DVec3),
    /// Rays from this index-space point.
    From(DVec3),
}

/// Where index space lands on the picture, for leaving out what is beside it.
#[derive(Debug, Clone, Copy)]
pub struct Visibility {
    /// View-space steps of one index along x, y, z, in pixels at the focal plane.
    pub view_from_index: DMat3,
    /// View-space position of index (0, 0, 0), pixels.
    pub view_origin: DVec3,
    /// Half the picture, pixels.
    pub half_size: DVec2,
    /// Eye distance in pixels, or `None` when orthographic.
    pub eye_distance: Option<f64>,
    /// Kernel radius in voxels.
    pub kernel_radius: f64,
}

impl Visibility {
    /// View-space position of an index-space point, pixels.
    pub(super) fn view(&self, index: DVec3) -> DVec3 {
        self.view_origin + self.view_from_index * index
    }

    /// Pixels at the focal plane of the longest step along an axis.
    fn longest_step(&self) -> f64 {
        let m = &self.view_from_index;
        m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length())
    }

    /// Radius in pixels of the kernel of a node whose longest edge is `edge` voxels, and whether
    /// any of it is on the picture. Conservative: what is kept may turn out not to show.
    fn project(&self, centre: DVec3, edge: f64) -> (f64, bool) {
        let radius = self.longest_step() * edge * self.kernel_radius;
        let view = self.view(centre);
        let Some(distance) = self.eye_distance else {
            let inside = view.x.abs() <= self.half_size.x + radius * 1.8
                && view.y.abs() <= self.half_size.y + radius * 1.8;
            return (radius, inside);
        };
        // The corner of a cube is √3 from its middle; 1.8 covers it.
        let nearest = view.z - radius * 1.8;
        if view.z + radius * 1.8 <= 0.0 {
            return (radius, false);
        }
        if nearest <= 0.0 {
            return (f64::INFINITY, true);
        }
        let shrink = distance / nearest;
        let reach =
            |x: f64, half: f64| x.abs() - radius * 1.8 <= half * (view.z + radius * 1.8) / distance;
        (radius * shrink, reach(view.x, self.half_size.x) && reach(view.y, self.half_size.y))
    }
}

/// One splat of a cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutNode {
    /// First voxel of the box of real voxels.
    pub low: [u32; 3],
    /// Voxels along each axis.
    pub size: [u32; 3],
    /// Level of the pyramid; 0 is a voxel.
    pub level: u8,
    /// What to draw.
    pub node: Node,
}

/// A cut through the octree, far to near: no parent is in it with its children.
#[derive(Debug, Clone, Default)]
pub struct Cut {
    /// The nodes, in drawing order.
    pub nodes: Vec<CutNode>,
    /// Nodes looked at.
    pub visited: u64,
}

impl Cut {
    /// A cut of about `count` nodes and the limits that it has: near those given, of the error for that
    /// count, which is known for cuts that are the same in every view and not balanced. `cut_of` makes one.
    pub fn of_count(
        mut limits: CutLimits,
        count: u64,
        cut_of: impl Fn(CutLimits) -> Self,
    ) -> (Self, CutLimits) {
        let cut = cut_of(limits);
        let is_known = !limits.view_dependent && !limits.balanced && limits.splat_px.is_none();
        // In no node there is nothing to fit.
        if is_known || cut.nodes.is_empty() {
            return (cut, limits);
        }
        // Aims a little below, as too many nodes take too long.
        let share = |cut: &Self| cut.nodes.len() as f32 / (0.9 * count.max(1) as f32);
        let (mut last, mut before) = (share(&cut), f32::NAN);
        let (mut nearest, mut nearest_off) = ((cut, limits), last.ln().abs());
        // Errors of too many and of too few nodes: the one that is looked for lies between them.
        let (mut of_many, mut of_few) = (0.0_f32, f32::INFINITY);
        for _ in 0..MOST_REFITS {
            // With an error of 0 there is nothing finer.
            if limits.max_error == 0.0 || (0.8..=1.0).contains(&(0.9 * last)) {
                break;
            }
            match last > 1.0 {
                true => of_many = of_many.max(limits.max_error),
                false => of_few = of_few.min(limits.max_error),
            }
            let leap = if last == before { REFIT_LEAP.powf(last.ln().signum()) } else { 1.0 };
            before = last;
            let stepped = limits.max_error * last.powf(REFIT_POWER) * leap;
            // Where the count falls faster than thought, a step goes too far.
            let is_between = stepped > of_many && stepped < of_few;
            limits.max_error = if is_between { stepped } else { (of_many * of_few).sqrt() };
            let cut = cut_of(limits);
            last = share(&cut);
            if last.ln().abs() < nearest_off {
                (nearest, nearest_off) = ((cut, limits), last.ln().abs());
            }
        }
        nearest
    }

    /// One traversal from the root. `voxel` classifies the voxel of a linear index: its linear
    /// colour and extinction; it is only asked where the cut reaches level 0. No cut goes below
    /// [`Pyramid::finest_level`].
    pub fn of(
        pyramid: &Pyramid,
        limits: CutLimits,
        order: VisitOrder,
        visibility: &Visibility,
        voxel: impl Fn(usize) -> [f32; 4],
    ) -> Self {
        let finest_level = limits.finest_level.max(pyramid.finest_level);
        let limits = CutLimits { finest_level, ..limits };
        let occlusion = limits
            .view_dependent
            .then(|| Occlusion::new(visibility, pyramid.dims, pyramid.voxel_depth));
        let splits = limits.balanced.then(|| vec![HashSet::new(); pyramid.height() + 1]);
        let cut = Self::default();
        let (height, root) = (pyramid.height(), [0, 0, 0]);
        let mut walk = Walk {
            pyramid,
            limits,
            order,
            visibility,
            voxel,
            occlusion,
            splits,
            is_final: false,
            cut,
        };
        if limits.view_dependent || limits.balanced {
            walk.visit(height, root);
            walk.cut.nodes.reverse();
        }
        if limits.balanced {
            walk.balance();
            walk.cut.nodes.clear();
        }
        if limits.balanced || !limits.view_dependent {
            walk.is_final = true;
            walk.visit(height, root);
        }
        walk.cut
    }
}

struct Walk<'a, F> {
    pyramid: &'a Pyramid,
    limits: CutLimits,
    order: VisitOrder,
    visibility: &'a Visibility,
    voxel: F,
    /// What lies in front of the nodes visited so far, where that matters.
    occlusion: Option<Occlusion>,
    /// Nodes that are split, level by level, where that is settled before they are drawn.
    splits: Option<Vec<HashSet<usize>>>,
    /// Whether nodes come far to near, to be drawn so; else near to far.
    is_final: bool,
    cut: Cut,
}

impl<F: Fn(usize) -> [f32; 4]> Walk<'_, F> {
    /// Nodes of a level along each axis.
    fn dims(&self, level: usize) -> [usize; 3] {
        match level {
            0 => self.pyramid.dims,
            _ => self.pyramid.levels[level - 1].dims,
        }
    }

    fn index(&self, level: usize, at: [usize; 3]) -> usize {
        let dims = self.dims(level);
        (at[2] * dims[1] + at[1]) * dims[0] + at[0]
    }

    fn node(&self, level: usize, at: [usize; 3]) -> Node {
        let index = self.index(level, at);
        if level == 0 {
            let [r, g, b, extinction] = (self.voxel)(index);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0..=65535"
            )]
            let colour = [r, g, b].map(|c| (c.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16);
            return Node { extinction, error: 0.0, colour, active_children: 0 };
        }
        self.pyramid.levels[level - 1].nodes[index]
    }

    /// Whether a node, whose longest edge is `edge` voxels, takes no less to draw than its children that
    /// show.
    fn is_dearer_whole(&self, node: Node, level: usize, edge: f64, radius_px: f64) -> bool {
        self.limits.splat_px.is_some_and(|splat_px| {
            let covered_px = 4.0 * radius_px * radius_px;
            // A quarter, but where the border cuts the node.
            let child_px = covered_px * (f64::from(1_u32 << (level - 1)) / edge).powi(2);
            f64::from(node.active_children) * (splat_px + child_px) <= splat_px + covered_px
        })
    }

    fn visit(&mut self, level: usize, at: [usize; 3]) {
        self.cut.visited += 1;
        let node = self.node(level, at);
        if !node.is_active() {
            return;
        }
        let low = at.map(|i| i << level);
        let size: [usize; 3] =
            std::array::from_fn(|a| (1 << level).min(self.pyramid.dims[a] - low[a]));
        let centre = DVec3::from_array(std::array::from_fn(|a| {
            low[a] as f64 + (size[a] as f64 - 1.0) / 2.0
        }));
        let edge = size.into_iter().max().unwrap_or(1) as f64;
        let (radius_px, in_view) = self.visibility.project(centre, edge);
        if !in_view {
            return;
        }
        let is_whole = level == 0
            || match &self.splits {
                Some(splits) if self.is_final => !splits[level].contains(&self.index(level, at)),
                _ => {
                    level <= self.limits.finest_level
                        || radius_px * 0.5 < self.limits.min_radius_px
                        || self.error(node, level, at) * self.weight(centre, edge)
                            < self.limits.max_error
                            && !self.is_dearer_whole(node, level, edge, radius_px)
                }
            };
        if is_whole {
            if let Some(occlusion) = self.occlusion.as_mut().filter(|_| !self.is_final) {
                let half = DVec3::from(size.map(|n| n as f64)) / 2.0;
                let view = self.visibility.view(centre);
                // Half the diagonal of a cube of the longest step.
                let radius = self.visibility.longest_step() * edge * 0.87;
                occlusion.pass(centre, half, f64::from(node.extinction), view, radius);
            }
            #[expect(clippy::cast_possible_truncation, reason = "axes are far below 2^32")]
            self.cut.nodes.push(CutNode {
                low: low.map(|v| v as u32),
                size: size.map(|v| v as u32),
                level: level as u8,
                node,
            });
            return;
        }
        if !self.is_final {
            let index = self.index(level, at);
            if let Some(splits) = &mut self.splits {
                splits[level].insert(index);
            }
        }
        let child_dims = self.dims(level - 1);
        // The child in the far octant first. Its bits say on which side of the middle the far
        // side is; flipping bits one by one from there never shows a nearer child too early.
        let middle = DVec3::from_array(std::array::from_fn(|a| {
            low[a] as f64 + f64::from(1_u32 << (level - 1)) - 0.5
        }));
        let away = match self.order {
            VisitOrder::Along(direction) => direction,
            VisitOrder::From(eye) => middle - eye,
        };
        let far = usize::from(away.x > 0.0)
            | usize::from(away.y > 0.0) << 1
            | usize::from(away.z > 0.0) << 2;
        let mut flips = self.flips(away);
        if !self.is_final {
            flips.reverse();
        }
        for flip in flips {
            let bits = far ^ flip;
            let child =
                [2 * at[0] + (bits & 1), 2 * at[1] + (bits >> 1 & 1), 2 * at[2] + (bits >> 2)];
            if child.iter().zip(child_dims).all(|(&c, n)| c < n) {
                self.visit(level - 1, child);
            }
        }
    }

    /// The error that is held to the limit.
    fn error(&self, node: Node, level: usize, at: [usize; 3]) -> f32 {
        if !self.limits.minds_edges || !self.is_beside_nothing(level, at) {
            return node.error;
        }
        // As of classified voxels (`Sums::rms`): their opacity, and their light.
        let alpha = -(-f64::from(node.extinction) * self.pyramid.voxel_depth).exp_m1();
        let light: f64 = node.colour.iter().map(|&c| (f64::from(c) / 65535.0).powi(2)).sum();
        #[expect(clippy::cast_possible_truncation, reason = "an error")]
        let size = (alpha * (1.0 + light).sqrt() * f64::from(1_u32 << (level - 1))) as f32;
        node.error.max(size * (BEYOND_EDGE * (1.0 - BEYOND_EDGE)).sqrt())
    }

    /// Whether nothing shows beside one of a node's faces.
    fn is_beside_nothing(&self, level: usize, at: [usize; 3]) -> bool {
        let dims = self.dims(level);
        (0..6).any(|face| {
            let axis = face / 2;
            let mut beside = at;
            beside[axis] = match face % 2 {
                0 if at[axis] > 0 => at[axis] - 1,
                1 if at[axis] + 1 < dims[axis] => at[axis] + 1,
                _ => return true,
            };
            !self.node(level, beside).is_active()
        })
    }

    /// What of an error shows (see [`CutLimits::view_dependent`]).
    fn weight(&self, centre: DVec3, edge: f64) -> f32 {
        let Some(occlusion) = &self.occlusion else { return 1.0 };
        let view = self.visibility.view(centre);
        let radius = self.visibility.longest_step() * edge * self.visibility.kernel_radius;
        let nearness = match self.visibility.eye_distance {
            None => 1.0,
            Some(_) if view.z <= radius => return f32::INFINITY,
            Some(distance) => distance / (view.z - radius),
        };
        #[expect(clippy::cast_possible_truncation, reason = "a factor")]
        let weight = (nearness * occlusion.in_front(view, radius)) as f32;
        weight
    }

    /// Splits further until no two nodes that share a face are more than one level apart: the
    /// parents of what lies beside a split node are split, too.
    fn balance(&mut self) {
        let Some(mut splits) = self.splits.take() else { return };
        for level in 1..self.pyramid.height() {
            let dims = self.dims(level);
            let split: Vec<usize> = splits[level].iter().copied().collect();
            for index in split {
                let at = [index % dims[0], index / dims[0] % dims[1], index / (dims[0] * dims[1])];
                for axis in 0..3 {
                    for up in [false, true] {
                        let mut beside = at;
                        beside[axis] = match up {
                            true if at[axis] + 1 < dims[axis] => at[axis] + 1,
                            false if at[axis] > 0 => at[axis] - 1,
                            _ => continue,
                        };
                        if self.shows_at(level, at, axis, up) {
                            self.split_above(&mut splits, level, beside);
                        }
                    }
                }
            }
        }
        self.splits = Some(splits);
    }

    /// Whether a node has a child that shows on one of its faces.
    fn shows_at(&self, level: usize, at: [usize; 3], axis: usize, up: bool) -> bool {
        let dims = self.dims(level - 1);
        (0..8).filter(|bits| (bits >> axis & 1 == 1) == up).any(|bits| {
            let child: [usize; 3] = std::array::from_fn(|a| 2 * at[a] + (bits >> a & 1));
            (0..3).all(|a| child[a] < dims[a]) && self.node(level - 1, child).is_active()
        })
    }

    /// Splits every node above one.
    fn split_above(&self, splits: &mut [HashSet<usize>], level: usize, at: [usize; 3]) {
        let mut at = at;
        for (above, splits) in splits.iter_mut().enumerate().skip(level + 1) {
            at = at.map(|i| i / 2);
            if !splits.insert(self.index(above, at)) {
                return;
            }
        }
    }

    /// Octants as flips of the far one, farthest first: the axis along which the view runs most
    /// is the slowest to change, so that overlaps across it are in depth order.
    fn flips(&self, away: DVec3) -> [usize; 8] {
        let axes = away.abs();
        let mut order = [(axes.x, 1), (axes.y, 2), (axes.z, 4)];
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        std::array::from_fn(|i| (0..3).filter(|b| i >> b & 1 == 1).map(|b| order[b].1).sum())
    }
}

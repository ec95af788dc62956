//! Octree cuts: the coarsest nodes whose error is small enough, far to near.

use glam::{DMat3, DVec2, DVec3};

use super::pyramid::{Node, Pyramid};

/// When a node is drawn rather than its children.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutLimits {
    /// Nodes with less than this error are drawn; 0 goes down to single voxels, in flat regions too.
    pub max_error: f32,
    /// Nodes of at most this level are drawn whatever their error (0: voxels).
    pub finest_level: usize,
    /// Nodes whose children's kernels would have a radius under this many pixels are drawn.
    pub min_radius_px: f64,
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
    /// Radius in pixels of the kernel of a node whose longest edge is `edge` voxels, and whether
    /// any of it is on the picture. Conservative: what is kept may turn out not to show.
    fn project(&self, centre: DVec3, edge: f64) -> (f64, bool) {
        let longest = self
            .view_from_index
            .x_axis
            .length()
            .max(self.view_from_index.y_axis.length())
            .max(self.view_from_index.z_axis.length());
        let radius = longest * edge * self.kernel_radius;
        let view = self.view_origin + self.view_from_index * centre;
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
    /// One traversal from the root. `voxel` classifies the voxel of a linear index: its linear
    /// colour and extinction; it is only asked where the cut reaches level 0.
    pub fn of(
        pyramid: &Pyramid,
        limits: CutLimits,
        order: VisitOrder,
        visibility: &Visibility,
        voxel: impl Fn(usize) -> [f32; 4],
    ) -> Self {
        let mut walk = Walk { pyramid, limits, order, visibility, voxel, cut: Self::default() };
        walk.visit(pyramid.height(), [0, 0, 0]);
        walk.cut
    }
}

struct Walk<'a, F> {
    pyramid: &'a Pyramid,
    limits: CutLimits,
    order: VisitOrder,
    visibility: &'a Visibility,
    voxel: F,
    cut: Cut,
}

impl<F: Fn(usize) -> [f32; 4]> Walk<'_, F> {
    fn node(&self, level: usize, at: [usize; 3]) -> Node {
        if level == 0 {
            let dims = self.pyramid.dims;
            let [r, g, b, extinction] = (self.voxel)((at[2] * dims[1] + at[1]) * dims[0] + at[0]);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0..=65535"
            )]
            let colour = [r, g, b].map(|c| (c.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16);
            return Node { extinction, error: 0.0, colour, active_children: 0 };
        }
        let level = &self.pyramid.levels[level - 1];
        level.nodes[(at[2] * level.dims[1] + at[1]) * level.dims[0] + at[0]]
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
        let fine_enough = level <= self.limits.finest_level
            || node.error < self.limits.max_error
            || radius_px * 0.5 < self.limits.min_radius_px;
        if fine_enough || level == 0 {
            #[expect(clippy::cast_possible_truncation, reason = "axes are far below 2^32")]
            self.cut.nodes.push(CutNode {
                low: low.map(|v| v as u32),
                size: size.map(|v| v as u32),
                level: level as u8,
                node,
            });
            return;
        }
        let child_dims = match level {
            1 => self.pyramid.dims,
            _ => self.pyramid.levels[level - 2].dims,
        };
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
        for flip in self.flips(away) {
            let bits = far ^ flip;
            let child =
                [2 * at[0] + (bits & 1), 2 * at[1] + (bits >> 1 & 1), 2 * at[2] + (bits >> 2)];
            if child.iter().zip(child_dims).all(|(&c, n)| c < n) {
                self.visit(level - 1, child);
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

//! Rays in index space, and what of each is looked at.

use fearless_simd::{Simd, prelude::*};
use glam::DVec3;

use super::lanes::{LANES, Lanes, Mask, Vec3, all, choose};
use super::supports::Unsupported;
use crate::kernel::Kernel;
use crate::plan::Plan;
use crate::scene::{AlongRay, HalfSpace, Order, View};

/// Edge of a tile, pixels.
pub(super) const TILE: u32 = 8;
/// Faces in a slab of which values are projected: those have more to them than light that adds up. Of
/// noise, the greatest values are off by 2.0e-2 with one (as colours, rmse), by 1.2e-3 with two.
const PROJECTED_FACES: f64 = 2.0;
/// The same of cells, between which values bend anywhere: of noise, the greatest values are off by 1.3e-1 with two.
const PROJECTED_FACES_OF_CELLS: f64 = 8.0;

/// The rays of a picture, in the index space of a field. Depths are in pixels along the view direction, 0 in the plane
/// through the lattice's centre.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rays {
    pub size: [u32; 2],
    /// Where the ray through the picture's middle meets that plane.
    base: [f32; 3],
    /// Index steps of one pixel to the right, up, and of depth.
    right: [f32; 3],
    up: [f32; 3],
    along: [f32; 3],
    /// Scale of a pixel in that plane, and its growth per pixel of depth, 0 when orthographic.
    scale: f32,
    pub growth: f32,
    /// Depth of the eye; very small when orthographic.
    pub eye: f32,
    /// Unit distances a pixel of depth.
    per_pixel: f32,
    /// Distance between faces of slabs.
    pub step: f32,
    /// Where the lattice ends.
    end: [f32; 3],
    /// What is kept: a normal, and the least product with it.
    pub clip: Vec<[f32; 4]>,
    /// Rays along the side of a pixel.
    pub side: u32,
    pub back_to_front: bool,
    /// The same in float64, for what is projected.
    pub view: View,
}

/// Eight rays.
#[derive(Clone, Copy)]
pub(super) struct Packet<S: Simd> {
    pub origin: Vec3<S>,
    pub direction: Vec3<S>,
    /// Depths where it begins and ends; the same where nothing of it is looked at.
    pub enter: Lanes<S>,
    pub leave: Lanes<S>,
    /// Its pixel is in the picture: the last block of a row may reach beyond.
    pub in_picture: Mask<S>,
    /// Something of it is looked at.
    pub is_there: Mask<S>,
    /// It begins where the volume is cut, rather than at its border or at the eye.
    pub is_cut: Mask<S>,
    /// Unit distances a pixel of depth.
    pub stretch: Lanes<S>,
    /// Offset from the picture's middle, pixels, to the right and up.
    pub screen: [Lanes<S>; 2],
}

/// Distance between the faces of a field's slabs, pixels of view depth.
pub fn slab_thickness(plan: &Plan) -> f64 {
    let spacing = plan.frame.lattice.smallest_spacing();
    spacing / plan.mode.slabs_per_voxel * plan.view().pixels_per_unit
}

/// Slabs along a ray, at most: a picture takes seconds with so many, and single precision does not tell 16 times as many
/// apart.
const MOST_SLABS: f64 = (1 << 20) as f64;

/// Whether a plan's lattice, and so many samples beyond it along each axis, lie in few enough slabs.
///
/// # Errors
/// They do not.
pub(super) fn check_slabs(plan: &Plan, beyond: DVec3) -> Result<(), Unsupported> {
    let dims = DVec3::from(plan.frame.lattice.dims.map(|n| n as f64)) + 2.0 * beyond;
    let depth = plan.view().view_from_index.transpose().z_axis.abs().dot(dims);
    let slabs = depth / slab_thickness(plan);
    if slabs <= MOST_SLABS {
        return Ok(());
    }
    Err(Unsupported(format!("more than {MOST_SLABS} slabs along a ray ({slabs:.1e})")))
}

impl Rays {
    /// Of a plan, through a lattice that ends there.
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits, as the device's")]
    pub(super) fn new(plan: &Plan, end: [f64; 3], clip: &[HalfSpace]) -> Self {
        let view = plan.view();
        let index_from_view = view.view_from_index.inverse();
        let centre = view.view_centre;
        let base = view.lattice_centre - index_from_view * centre.truncate().extend(0.0);
        let (scale, growth, eye) = match view.eye_distance {
            None => (1.0, 0.0, -1e30),
            Some(distance) => (centre.z / distance, 1.0 / distance, -centre.z),
        };
        let narrow = |v: DVec3| v.as_vec3().to_array();
        // Capped where a voxel is 1e20 unit distances thick: beyond, 32 bits would overflow.
        let per_pixel = (1.0 / (plan.frame.unit_distance * view.pixels_per_unit)).min(1e20);
        let slab = slab_thickness(plan);
        let faces = match (plan.inside.along, plan.mode.kernel) {
            (AlongRay::Composite, _) => 1.0,
            (_, Kernel::Cells | Kernel::Ellipsoids) => PROJECTED_FACES_OF_CELLS,
            _ => PROJECTED_FACES,
        };
        Self {
            size: plan.size,
            base: narrow(base),
            right: narrow(index_from_view.x_axis),
            up: narrow(index_from_view.y_axis),
            along: narrow(index_from_view.z_axis),
            scale: scale as f32,
            growth: growth as f32,
            eye: eye as f32,
            per_pixel: per_pixel as f32,
            step: (slab / faces) as f32,
            end: end.map(|end| end as f32),
            clip: clip
                .iter()
                .map(|half| half.normal.as_vec3().extend(half.least as f32).to_array())
                .collect(),
            side: view.rays_per_side(plan.mode.kernel, plan.mode.extent),
            back_to_front: plan.mode.order == Order::BackToFront,
            view,
        }
    }

    /// Where a box lands whose middle is so far from the lattice's, and whose half sides reach so far, in view space:
    /// left, right, top and bottom of the picture's pixels, and the depths between which it lies. All with a hundredth of
    /// a pixel more for rounding: these are in float64, and rays are not.
    pub(super) fn landing(&self, from_centre: DVec3, reach: DVec3) -> ([f64; 4], [f64; 2]) {
        const SLACK: f64 = 1e-2;
        let view = &self.view;
        let seen = view.view_centre.truncate().extend(0.0) + from_centre;
        let half_size = self.size.map(|n| f64::from(n) / 2.0);
        let depths = [seen.z - reach.z, seen.z + reach.z];
        let (mut low, mut high) =
            ([seen.x - reach.x, seen.y - reach.y], [seen.x + reach.x, seen.y + reach.y]);
        if let Some(distance) = view.eye_distance {
            // Depth from the eye of the box's near and far face.
            let [near, far] = depths.map(|z| z + view.view_centre.z);
            if near <= distance * 1e-3 {
                (low, high) = ([-1e9; 2], [1e9; 2]);
            } else {
                for a in 0..2 {
                    let at = [low[a], high[a]].map(|x| [x * distance / near, x * distance / far]);
                    low[a] = at[0][0].min(at[0][1]);
                    high[a] = at[1][0].max(at[1][1]);
                }
            }
        }
        let screen = [
            low[0] + half_size[0] - SLACK,
            high[0] + half_size[0] + SLACK,
            half_size[1] - high[1] - SLACK,
            half_size[1] - low[1] + SLACK,
        ];
        (screen, [depths[0] - SLACK, depths[1] + SLACK])
    }

    /// Pixels of a plane at a depth that one of the picture shows.
    #[inline(always)]
    pub(super) fn scale_at(&self, depth: f32) -> f32 {
        self.scale + self.growth * depth
    }

    /// Tiles across and down.
    pub(super) fn tiles(&self) -> [u32; 2] {
        self.size.map(|n| n.div_ceil(TILE))
    }

    /// The rays of a block of 4 × 2 pixels, through the same place `part` (0..1, down) of each.
    #[inline(always)]
    pub(super) fn packet<S: Simd>(&self, simd: S, corner: [u32; 2], part: [f32; 2]) -> Packet<S> {
        // No `map`: the compiler does not inline it here.
        let half = [self.size[0] as f32 / 2.0, self.size[1] as f32 / 2.0];
        let across: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];
        let down: [f32; LANES] = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        let x = Lanes::load_array(simd, across) + (corner[0] as f32 + part[0] - half[0]);
        let y = all(simd, half[1] - corner[1] as f32 - part[1]) - Lanes::load_array(simd, down);
        let splat = |v| Vec3::splat(simd, v);
        let side = splat(self.right).scaled(x).add(splat(self.up).scaled(y));
        let origin = splat(self.base).add(side.scaled(all(simd, self.scale)));
        let direction = splat(self.along).add(side.scaled(all(simd, self.growth)));
        let (mut enter, mut leave) = (all(simd, self.eye), all(simd, 3e38));
        let axes = [
            (origin.x, direction.x, self.end[0]),
            (origin.y, direction.y, self.end[1]),
            (origin.z, direction.z, self.end[2]),
        ];
        for (o, d, end) in axes {
            // A ray along a plane of the lattice is inside it or it is not: no infinities are needed.
            let tiny = d.abs().simd_lt(all(simd, 1e-20));
            let inverse = all(simd, 1.0) / choose(tiny, all(simd, 1e-20), d);
            let lower = (all(simd, -0.5) - o) * inverse;
            let upper = (all(simd, end) - o) * inverse;
            enter = enter.max(lower.min(upper));
            leave = leave.min(lower.max(upper));
        }
        let ([enter, leave], is_cut) = self.cut(simd, [origin, direction], [enter, leave]);
        let in_picture = x.simd_lt(all(simd, half[0])) & y.simd_gt(all(simd, -half[1]));
        let is_there = enter.simd_lt(leave) & in_picture;
        let zero = all(simd, 0.0);
        let slant = (x * self.growth) * (x * self.growth) + (y * self.growth) * (y * self.growth);
        Packet {
            origin,
            direction,
            enter: choose(is_there, enter, zero),
            leave: choose(is_there, leave, zero),
            in_picture,
            is_there,
            is_cut: is_cut & is_there,
            stretch: (slant + 1.0).sqrt() * self.per_pixel,
            screen: [x, y],
        }
    }
}

impl Rays {
    /// What is kept of rays between two depths; and where that begins with a cut.
    #[inline(always)]
    fn cut<S: Simd>(
        &self,
        simd: S,
        [origin, direction]: [Vec3<S>; 2],
        [mut enter, mut leave]: [Lanes<S>; 2],
    ) -> ([Lanes<S>; 2], Mask<S>) {
        let mut is_cut = Mask::splat(simd, false);
        for &[nx, ny, nz, least] in &self.clip {
            let normal = Vec3::splat(simd, [nx, ny, nz]);
            let height = normal.dot(origin) - least;
            let growth = normal.dot(direction);
            // A ray along a plane is on one side of it.
            let is_along = growth.abs().simd_lt(all(simd, 1e-20));
            let t = -height / choose(is_along, all(simd, 1.0), growth);
            let rises = growth.simd_gt(all(simd, 0.0));
            let enters = !is_along & rises & t.simd_gt(enter);
            is_cut |= enters;
            enter = choose(enters, t, enter);
            leave = choose(!is_along & !rises, leave.min(t), leave);
            leave = choose(is_along & height.simd_lt(all(simd, 0.0)), enter, leave);
        }
        ([enter, leave], is_cut)
    }

    /// Origins and directions of rays so many pixels to the right of those of a packet, and above them.
    #[inline(always)]
    pub(super) fn beside<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        [right, up]: [f32; 2],
    ) -> [Vec3<S>; 2] {
        let part = |v: [f32; 3], by: f32| Vec3::splat(simd, v.map(|x| x * by));
        let side = part(self.right, right).add(part(self.up, up));
        [
            packet.origin.add(side.scaled(all(simd, self.scale))),
            packet.direction.add(side.scaled(all(simd, self.growth))),
        ]
    }

    /// Depths between which anything is kept of rays, wherever the lattice ends.
    #[inline(always)]
    pub(super) fn kept<S: Simd>(&self, simd: S, packet: &Packet<S>) -> [Lanes<S>; 2] {
        let endless = [all(simd, -1e30), all(simd, 1e30)];
        self.cut(simd, [packet.origin, packet.direction], endless).0
    }
}

impl<S: Simd> Packet<S> {
    /// The place of each ray at a depth of its own.
    #[inline(always)]
    pub(super) fn at(&self, t: Lanes<S>) -> Vec3<S> {
        self.origin.at(self.direction, t)
    }

    /// The first slab that a ray looks at, and the last, of so many pixels.
    #[inline(always)]
    pub(super) fn slabs(&self, simd: S, step: f32) -> [i32; 2] {
        let far = all(simd, 3e38);
        let enter = choose(self.is_there, self.enter, far).reduce_min();
        let leave = choose(self.is_there, self.leave, -far).reduce_max();
        #[expect(clippy::cast_possible_truncation, reason = "saturates")]
        let slabs =
            [(enter / step).floor() as i32, ((leave / step).ceil() as i32).saturating_sub(1)];
        slabs
    }
}

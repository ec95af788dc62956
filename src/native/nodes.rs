//! Kernels of single voxels and of boxes of these, as an octree cut has them, by lists: where each lands on the picture.
//!
//! Each is seen as in its middle, and is an ellipse, a box or a pixel there. They come in the order of compositing; those
//! that are cut into slabs in that of the first of these.

use fearless_simd::{Simd, prelude::*};
use glam::{DMat3, DVec2, DVec3};

use super::cells::{Cells, Span, middle_of, touches};
use super::grid::{NEAR, POINT_TIE, Part, Shape};
use super::in_order::{by_first_slab, look, taken};
use super::lanes::{all, any, choose};
use super::passing::footprint;
use super::rays::{Packet, slab_thickness};
use super::samples::SampleLook;
use super::supports::{NotBegun, Unsupported};
use crate::core::Ticket;
use crate::core::parallel;
use crate::kernel::{
    FootprintPolynomial, Kernel, ProjectedKernel, RadialKernel, SlabShare, perspective_jacobian,
};
use crate::plan::Plan;
use crate::scene::{OpacityModel, Order, View, Visibility};

/// Half axis, in pixels, that thinner kernels are widened to.
const LEAST_HALF_AXIS: f64 = 1.0;
/// No slab lies farther from the lattice's centre than so many: beyond, single precision does not tell them apart.
const MOST_PLACE: f64 = (1 << 22) as f64;
/// Kernels that are placed between two looks at the ticket.
const A_PART: usize = 1 << 13;
/// Slabs that one kernel may lie in.
const MOST_SLABS: u32 = 1 << 16;

/// The kernel of a box of voxels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Its first voxel, and voxels along each axis.
    pub low: [u32; 3],
    /// Voxels along each axis.
    pub size: [u32; 3],
    /// Per unit distance.
    pub extinction: f32,
    /// Linear light.
    pub colour: [f32; 3],
}

/// A kernel on the picture. Lengths are in pixels.
#[derive(Debug, Clone, Copy)]
struct Splat {
    /// To the right and up from the picture's middle, and how deep beyond the lattice's centre.
    middle: [f32; 3],
    /// Colour; and depth, or opacity, of a unit of its footprint.
    look: SampleLook,
    /// Of a radial one, from offsets on the screen to the circle of radius 1: a lower triangle. Of a box, columns of the
    /// map from offsets to its own space.
    right: [f32; 3],
    up: [f32; 3],
    /// Of a box, its own step of a pixel of depth. Of a radial one, how much deeper its middle lies a pixel to the right
    /// and up, and half chords of a line through it in a pixel of depth.
    deep: [f32; 3],
}

/// The kernels of a picture.
#[derive(Debug)]
pub(super) struct Nodes {
    pub shape: Shape,
    splats: Vec<Splat>,
    /// Where they are cut into slabs: those of each, in the order of compositing.
    slabs: Vec<[i32; 2]>,
    cells: Cells,
    half_size: [f32; 2],
    /// Distance between the faces of slabs, where they are cut into such.
    pub thickness: Option<f32>,
    pub most_slabs: u32,
    growth: f32,
}

/// Where nodes are seen.
struct Seen {
    view: View,
    kernel: Kernel,
    radius: f64,
    /// Unit distances a pixel of depth.
    per_pixel: f64,
    published: bool,
    thickness: f64,
    back_to_front: bool,
}

impl Nodes {
    /// Of a plan whose kernels are shaded first, from nodes in the order of compositing far to near.
    ///
    /// # Errors
    /// A kernel that lies in too many slabs, or a cancelled ticket.
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits, as the device's")]
    pub(super) fn new(plan: &Plan, nodes: &[Node], ticket: &Ticket) -> Result<Self, NotBegun> {
        let (view, mode) = (plan.view(), &plan.mode);
        let kernel = mode.kernel.splatted();
        let radial = RadialKernel::new(kernel, mode.splatted_extent());
        let shape = match (kernel, radial) {
            (_, Some(radial)) => {
                Shape::Radial(FootprintPolynomial::of(radial), SlabShare::of(radial))
            }
            (Kernel::Point, _) => Shape::Point,
            _ => Shape::Box,
        };
        let seen = Seen {
            view,
            kernel,
            radius: radial.map_or(0.5, RadialKernel::radius),
            per_pixel: (1.0 / (plan.frame.unit_distance * view.pixels_per_unit)).min(1e20),
            published: mode.opacity_model == OpacityModel::Published,
            thickness: slab_thickness(plan),
            back_to_front: mode.order == Order::BackToFront,
        };
        let in_slabs = mode.visibility == Visibility::Slabs;
        let mut all = Vec::new();
        for some in nodes.chunks(A_PART) {
            look(ticket)?;
            let lands = parallel::list(some.len(), |i| seen.lands(&some[i]));
            all.extend(lands.into_iter().flatten());
        }
        if !seen.back_to_front {
            all.reverse();
        }
        let order = match in_slabs {
            true => by_first_slab(&all, |(_, _, slabs)| slabs[0], ticket)?,
            false => (0..all.len() as u32).collect(),
        };
        let spans = taken(&all, &order, |(_, span, _)| *span, ticket)?;
        let cells = Cells::new(view.size, &spans, ticket)?;
        let slabs = taken(&all, &order, |(_, _, slabs)| *slabs, ticket)?;
        let most = slabs.iter().map(|[first, last]| last.abs_diff(*first) + 1).max().unwrap_or(0);
        if in_slabs && most > MOST_SLABS {
            return Err(Unsupported(format!(
                "kernels that lie in more than {MOST_SLABS} slabs ({most})"
            ))
            .into());
        }
        Ok(Self {
            shape,
            splats: taken(&all, &order, |(splat, _, _)| *splat, ticket)?,
            slabs,
            cells,
            half_size: view.size.map(|n| n as f32 / 2.0),
            thickness: in_slabs.then_some(seen.thickness as f32),
            most_slabs: most,
            growth: view.eye_distance.map_or(0.0, |eye| (1.0 / eye) as f32),
        })
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        let own = size_of_val(&self.splats[..]) + size_of_val(&self.slabs[..]);
        self.cells.size_bytes() + own as u64
    }

    /// The kernels that may touch a tile, whose first pixel is `corner`, in the order of compositing.
    pub(super) fn touching(&self, corner: [u32; 2], found: &mut Vec<u32>) {
        found.clear();
        let tile = middle_of(corner, self.half_size);
        found.extend(self.cells.at(corner).iter().filter(|&&node| {
            if !matches!(self.shape, Shape::Radial(..)) {
                return true;
            }
            let Splat { middle, right: to_circle, .. } = &self.splats[node as usize];
            touches(tile, [middle[0], middle[1]], *to_circle)
        }));
    }

    /// The first slab of a kernel, and the last, in the order of compositing.
    pub(super) fn slabs_of(&self, node: u32) -> [i32; 2] {
        self.slabs[node as usize]
    }

    /// What a kernel looks like.
    pub(super) fn look(&self, node: u32) -> &SampleLook {
        &self.splats[node as usize].look
    }

    /// What rays have of a kernel.
    #[inline(always)]
    pub(super) fn part<S: Simd>(&self, simd: S, node: u32, packet: &Packet<S>) -> Option<Part<S>> {
        let ([x, y], in_picture) = (packet.screen, packet.in_picture);
        let Splat { middle, right, up, deep, .. } = &self.splats[node as usize];
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let (across, above) = (x - middle[0], y - middle[1]);
        let (growth_x, growth_y) = (x * self.growth, y * self.growth);
        let slant = growth_x.mul_add(growth_x, growth_y.mul_add(growth_y, one)).sqrt();
        match &self.shape {
            Shape::Radial(polynomial, _) => {
                let [a, b, c] = *right;
                let unit = [across * a, across.mul_add(all(simd, b), above * c)];
                let q = unit[0].mul_add(unit[0], unit[1] * unit[1]);
                let is_hit = q.simd_lt(one) & in_picture;
                if !any(is_hit) {
                    return None;
                }
                let amount = footprint(simd, polynomial, q) * slant;
                let lean = across.mul_add(all(simd, deep[0]), above * deep[1]);
                let half = (one - q).max(all(simd, 1e-12)).sqrt() / deep[2];
                Some(Part { is_hit, amount, q, middle: lean + middle[2], half })
            }
            Shape::Box => {
                let (mut enter, mut leave) = (all(simd, -1e30), all(simd, 1e30));
                for k in 0..3 {
                    let point = across.mul_add(all(simd, right[k]), above * up[k]);
                    let step = deep[k];
                    if step.abs() < 1e-12 {
                        let is_beside = point.abs().simd_gt(all(simd, 0.5));
                        leave = choose(is_beside, all(simd, -1e30), leave);
                    } else {
                        let (a, b) = ((-point - 0.5) / step, (-point + 0.5) / step);
                        enter = enter.max(a.min(b));
                        leave = leave.min(a.max(b));
                    }
                }
                let is_hit = enter.simd_lt(leave) & in_picture;
                if !any(is_hit) {
                    return None;
                }
                let half = (leave - enter) * 0.5;
                let middle = (leave + enter) * 0.5 + middle[2];
                Some(Part { is_hit, amount: half * 2.0 * slant, q: zero, middle, half })
            }
            Shape::Point | Shape::Separable(_) => {
                let quarter = all(simd, 0.25);
                let is_hit = across.abs().simd_lt(quarter) & above.abs().simd_lt(quarter);
                let is_hit = is_hit & in_picture;
                let middle = all(simd, middle[2]);
                any(is_hit).then_some(Part { is_hit, amount: slant, q: zero, middle, half: zero })
            }
        }
    }
}

impl Seen {
    /// Where a kernel lands; `None` where it is not seen, or is flat.
    #[expect(clippy::cast_possible_truncation, reason = "clamped")]
    fn lands(&self, node: &Node) -> Option<(Splat, Span, [i32; 2])> {
        let view = &self.view;
        let size = DVec3::from(node.size.map(f64::from));
        let centre = DVec3::from(node.low.map(f64::from)) + (size - DVec3::ONE) / 2.0;
        let from_middle = view.view_from_index * (centre - view.lattice_centre);
        let place = view.view_centre + from_middle;
        let map = view.view_from_index * DMat3::from_diagonal(size);
        let (middle, map) = match view.eye_distance {
            None => (place.truncate(), map),
            Some(eye) if place.z > eye * f64::from(NEAR) => {
                (place.truncate() * (eye / place.z), perspective_jacobian(place, eye)? * map)
            }
            Some(_) => return None,
        };
        let extinction = f64::from(node.extinction);
        let density = if self.published { -(-extinction).exp_m1() } else { extinction };
        let narrow = |v: DVec3| v.as_vec3().to_array();
        let rows = map.transpose();
        let picture = view.size.map(f64::from);
        let mut middle = middle;
        let (reach, amount, depths, [right, up, deep]) = match self.kernel {
            Kernel::Point => {
                // The pixel that holds it.
                let down = DVec2::new(middle.x + picture[0] / 2.0, picture[1] / 2.0 - middle.y);
                let pixel = (down + f64::from(POINT_TIE)).floor() + 0.5;
                middle = DVec2::new(pixel.x - picture[0] / 2.0, picture[1] / 2.0 - pixel.y);
                let length = map.determinant().abs() / rows.x_axis.cross(rows.y_axis).length();
                (DVec2::splat(0.25), length, 0.0, [[0.0; 3]; 3])
            }
            Kernel::Nearest => {
                let inverse = map.inverse();
                let reach = |row: DVec3| 0.5 * row.abs().element_sum();
                let columns = [inverse.x_axis, inverse.y_axis, inverse.z_axis].map(narrow);
                let around = DVec2::new(reach(rows.x_axis), reach(rows.y_axis));
                (around, 1.0, reach(rows.z_axis), columns)
            }
            _ => {
                let narrowest = ProjectedKernel::new(map)?;
                let drawn = narrowest.widened(LEAST_HALF_AXIS / self.radius);
                let l = drawn.unit_from_screen * (1.0 / self.radius);
                let per_depth = 1.0 / (narrowest.depth_per_unit * self.radius);
                let lean = drawn.screen_from_unit.transpose() * drawn.tilt;
                let along = (lean.length_squared() + narrowest.depth_per_unit.powi(2)).sqrt();
                let columns = [
                    narrow(DVec3::new(l.x_axis.x, l.x_axis.y, l.y_axis.y)),
                    [0.0; 3],
                    narrow(drawn.tilt.extend(per_depth)),
                ];
                let around = drawn.half_extents * self.radius;
                (around, drawn.depth_per_unit, along * self.radius, columns)
            }
        };
        let (across, down) = (middle.x + picture[0] / 2.0, picture[1] / 2.0 - middle.y);
        let span = Span::of(
            view.size,
            [across - reach.x, across + reach.x],
            [down - reach.y, down + reach.y],
        )?;
        let amount = density * amount * self.per_pixel;
        // False where anything is not a number, too.
        let shows = amount > 0.0 && from_middle.is_finite();
        if !shows {
            return None;
        }
        let slab_at =
            |depth: f64| (depth / self.thickness).floor().clamp(-MOST_PLACE, MOST_PLACE) as i32;
        let [first, last] = [slab_at(from_middle.z - depths), slab_at(from_middle.z + depths)];
        let [r, g, b] = node.colour;
        let splat = Splat {
            middle: narrow(middle.extend(from_middle.z)),
            look: [r, g, b, amount.min(1e30) as f32],
            right,
            up,
            deep,
        };
        Some((splat, span, if self.back_to_front { [-last, -first] } else { [first, last] }))
    }
}

//! Where the kernels of a lattice's samples lie about rays, and in what they are laid down.
//!
//! What is counted along the lattice's axes is in the order of the traversal (`scene::Traversal`): outermost first.

use fearless_simd::{Simd, prelude::*};
use glam::DVec3;

use super::lanes::{Lanes, Mask, all, choose};
use super::rays::{Packet, check_slabs, slab_thickness};
use super::samples::Samples;
use super::supports::Unsupported;
use crate::kernel::{FootprintPolynomial, Kernel, RadialKernel, SlabShare};
use crate::plan::Plan;
use crate::scene::Visibility;
use crate::volume::BRICK;

/// How much farther than their kernels rays look, voxels: roundings must not lose a sample.
const MARGIN: f64 = 2e-3;
/// Rays that cross slices at a lesser slope go along them: all that they pass of a slice is looked at at once.
const LEAST_SLOPE: f32 = 0.02;
/// A pixel owns its left and its upper edge, and what of points lies this close before them, in pixels.
pub(super) const POINT_TIE: f32 = 1.0 / 1024.0;
/// Points nearer to the eye than this part of its distance to the focal plane are not drawn.
pub(super) const NEAR: f32 = 1e-3;

/// What is composited at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layering {
    /// Each sample.
    Sample,
    /// Each slice of the lattice's outermost axis, footprints whole.
    Slice,
    /// Layers perpendicular to that axis, which cut kernels.
    Sheets,
    /// Layers perpendicular to the view.
    Slabs,
}

/// What a kernel is on a ray.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shape {
    /// Its footprint, and the shares of it that layers have.
    Radial(FootprintPolynomial, SlabShare),
    /// A voxel's box.
    Box,
    /// All of it in one pixel.
    Point,
    /// A product of tents, or of cubic B-splines.
    Separable(Product),
}

/// A product of tents, or of cubic B-splines, so many times wider than natural.
#[derive(Debug, Clone, Copy)]
pub(super) struct Product {
    pub is_tent: bool,
    pub scale: f32,
    /// So many samples to either side of a place.
    pub side: i32,
}

/// What eight rays have of one kernel.
#[derive(Clone, Copy)]
pub(super) struct Part<S: Simd> {
    pub is_hit: Mask<S>,
    /// Of a unit of density.
    pub amount: Lanes<S>,
    /// (l / radius)² of a radial kernel.
    pub q: Lanes<S>,
    /// Depth of the middle of what they pass of it, and half the depth that it has.
    pub middle: Lanes<S>,
    pub half: Lanes<S>,
}

/// Where samples land on the picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Points {
    /// View-space steps of one index along each axis, pixels.
    steps: [[f32; 3]; 3],
    middle: [f32; 3],
    centre: [f32; 3],
    /// Volume of a voxel in view space.
    determinant: f32,
    /// Distance from the eye to the focal plane, pixels.
    eye: Option<f32>,
}

/// A point on the picture.
pub(super) struct Landed {
    /// Offset from the picture's middle, pixels, to the right and up.
    pub screen: [f32; 2],
    /// Beyond the lattice's centre.
    pub depth: f32,
    /// Pixels of depth that its voxel has.
    pub length: f32,
}

/// The kernels of a lattice.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    pub shape: Shape,
    /// Of points.
    pub points: Points,
    pub layering: Layering,
    pub axes: [usize; 3],
    /// First and last sample of those that can show.
    pub low: [i32; 3],
    pub high: [i32; 3],
    /// Indices at or before the eye.
    pub splits: [i32; 3],
    /// How far kernels reach, voxels.
    reach: [f32; 3],
    /// Of a radial kernel.
    pub radius: f32,
    /// Of a layer: pixels of view depth, or slices.
    thickness: f32,
    /// The lattice's middle along the outermost axis.
    middle: f32,
    pub is_perspective: bool,
}

/// Eight rays about a grid.
#[derive(Clone, Copy)]
pub(super) struct Line<S: Simd> {
    pub origin: [Lanes<S>; 3],
    /// An index step of one pixel of depth, of one unit of length, and how many pixels that is deep.
    pub direction: [Lanes<S>; 3],
    pub unit: [Lanes<S>; 3],
    pub per_index: Lanes<S>,
    /// 1 over the direction.
    pub inverse: [Lanes<S>; 3],
    /// Depths between which any kernel is in reach.
    pub enter: Lanes<S>,
    pub leave: Lanes<S>,
    pub is_in: Mask<S>,
    /// It goes along slices.
    grazes: Mask<S>,
    /// How far from where it crosses a slice the kernels of that may lie, along the two inner axes.
    reach: [Lanes<S>; 2],
    /// How much before and behind that, pixels of depth.
    pub spread: Lanes<S>,
}

/// Faces of layers along eight rays: depth `begin` + number · `step`.
#[derive(Clone, Copy)]
pub(super) struct Faces<S: Simd> {
    pub begin: Lanes<S>,
    pub step: Lanes<S>,
}

/// Samples along an axis in the order of compositing: from `first` on, so many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Run {
    pub first: i32,
    pub count: i32,
    pub way: i32,
}

impl Run {
    pub(super) fn at(self, i: i32) -> i32 {
        self.first + self.way * i
    }
}

/// Samples from `low` to `high` along an axis, of which those before `split` are at or before the eye: far to near, or
/// near to far.
#[inline(always)]
pub(super) fn runs([low, high]: [i32; 2], split: i32, back_to_front: bool) -> [Run; 2] {
    let beyond = split.max(low);
    let before = (split - 1).min(high);
    let (count_beyond, count_before) = ((high - beyond + 1).max(0), (before - low + 1).max(0));
    match back_to_front {
        true => [
            Run { first: high, count: count_beyond, way: -1 },
            Run { first: low, count: count_before, way: 1 },
        ],
        false => [
            Run { first: before, count: count_before, way: -1 },
            Run { first: beyond, count: count_beyond, way: 1 },
        ],
    }
}

impl Grid {
    /// Of a plan's samples; `None` where nothing of them can show.
    ///
    /// # Errors
    /// More layers than are counted.
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits, as the device's")]
    pub(super) fn new(plan: &Plan, samples: &Samples) -> Result<Option<Self>, Unsupported> {
        let Some(showing) = samples.showing else { return Ok(None) };
        let (view, mode) = (plan.view(), &plan.mode);
        let axes = view.traversal.axes;
        let turned = |v: DVec3| axes.map(|axis| v[axis]);
        let narrow = |v: [f64; 3]| v.map(|x| x as f32);
        let index_from_view = view.view_from_index.inverse();
        let radial = RadialKernel::new(mode.kernel, mode.extent);
        let whole = mode.sheets_per_kernel == 1 || mode.kernel == Kernel::Point;
        let layering = match mode.visibility {
            Visibility::EverySample => Layering::Sample,
            Visibility::Sheets if whole => Layering::Slice,
            Visibility::Sheets => Layering::Sheets,
            Visibility::Slabs => Layering::Slabs,
        };
        let steps = axes.map(|axis| narrow(view.view_from_index.col(axis).to_array()));
        let shape = match (mode.kernel, radial) {
            (_, Some(radial)) => {
                Shape::Radial(FootprintPolynomial::of(radial), SlabShare::of(radial))
            }
            (Kernel::Point, _) => Shape::Point,
            (Kernel::Linear | Kernel::BSpline, _) => Shape::Separable(Product {
                is_tent: mode.kernel == Kernel::Linear,
                scale: mode.kernel.scale(mode.extent) as f32,
                side: mode.kernel.reach(mode.extent).ceil() as i32,
            }),
            _ => Shape::Box,
        };
        let points = Points {
            steps,
            middle: narrow(view.view_centre.to_array()),
            centre: narrow(turned(view.lattice_centre)),
            determinant: view.view_from_index.determinant().abs() as f32,
            eye: view.eye_distance.map(|eye| eye as f32),
        };
        let radius = radial.map_or(0.5, RadialKernel::radius);
        let reach = match shape {
            Shape::Radial(..) => DVec3::splat(radius),
            Shape::Box => DVec3::splat(0.5),
            Shape::Separable(product) => DVec3::splat(f64::from(product.side)),
            Shape::Point => {
                // Half a pixel, and what counts to it, at the far end.
                let m = view.view_from_index;
                let half = view.lattice_centre + DVec3::splat(0.5);
                let depth = m.transpose().z_axis.abs().dot(half);
                let most = view
                    .eye_distance
                    .map_or(1.0, |eye| (view.view_centre.z + depth).max(0.0) / eye);
                let pixel = index_from_view.x_axis.abs() + index_from_view.y_axis.abs();
                pixel * ((0.5 + f64::from(POINT_TIE)) * most)
            }
        };
        let sheet = 2.0 * radius / f64::from(mode.sheets_per_kernel);
        let thickness = match layering {
            Layering::Sheets => sheet,
            _ => slab_thickness(plan),
        };
        let first = axes.map(|axis| showing[0][axis] * BRICK);
        let last =
            axes.map(|axis| (samples.dims[axis] - 1).min(showing[1][axis] * BRICK + BRICK - 1));
        if layering == Layering::Slabs {
            check_slabs(plan, reach)?;
        }
        let reach = turned(reach).map(|reach| reach + MARGIN);
        #[expect(clippy::cast_possible_wrap, reason = "an axis has at most 65535 samples")]
        let samples_at = |at: [usize; 3]| at.map(|i| i as i32);
        Ok(Some(Self {
            shape,
            points,
            layering,
            axes,
            low: samples_at(first),
            high: samples_at(last),
            splits: samples_at(view.traversal.splits),
            reach: narrow(reach),
            radius: radius as f32,
            thickness: thickness as f32,
            middle: turned(view.lattice_centre)[0] as f32,
            is_perspective: view.eye_distance.is_some(),
        }))
    }

    /// Eight rays, from the eye on.
    #[inline(always)]
    pub(super) fn line<S: Simd>(&self, simd: S, packet: &Packet<S>, eye: f32) -> Line<S> {
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let turned = |v: super::lanes::Vec3<S>| {
            let v = [v.x, v.y, v.z];
            [v[self.axes[0]], v[self.axes[1]], v[self.axes[2]]]
        };
        let (origin, direction) = (turned(packet.origin), turned(packet.direction));
        let [a, b, c] = direction;
        // By its greatest part: squares of tiny ones are 0.
        let most = a.abs().max(b.abs()).max(c.abs()).max(all(simd, 1e-37));
        let [x, y, z] = [a / most, b / most, c / most];
        let length = x.mul_add(x, y.mul_add(y, z * z)).sqrt();
        let unit = [x / length, y / length, z / length];
        let per_index = one / (most * length);
        let (mut enter, mut leave) = (all(simd, eye), all(simd, 3e38));
        let mut inverse = [zero; 3];
        for k in 0..3 {
            // A ray along a plane of the lattice is inside it or it is not: no infinities are needed.
            let tiny = unit[k].abs().simd_lt(all(simd, 1e-9));
            inverse[k] = one / choose(tiny, all(simd, 1e-9) / per_index, direction[k]);
            let lower = (all(simd, self.low[k] as f32 - self.reach[k]) - origin[k]) * inverse[k];
            let upper = (all(simd, self.high[k] as f32 + self.reach[k]) - origin[k]) * inverse[k];
            enter = enter.max(lower.min(upper));
            leave = leave.min(lower.max(upper));
        }
        let is_in = enter.simd_lt(leave) & packet.in_picture;
        let grazes = unit[0].abs().simd_lt(all(simd, LEAST_SLOPE));
        let steep = choose(grazes, one, unit[0].abs());
        let half = (leave - enter) * 0.5 / per_index;
        let mut reach = [zero; 2];
        let [_, along_b, along_c] = [0, 1, 2].map(|k| match self.shape {
            Shape::Point => self.points.steps[k][2].abs(),
            _ => 0.0,
        });
        for (k, reach) in reach.iter_mut().enumerate() {
            let own = all(simd, self.reach[k + 1]);
            let slope = unit[k + 1].abs() / steep;
            let crossing = match self.shape {
                Shape::Radial(..) => own * slope.mul_add(slope, one).sqrt(),
                _ => slope.mul_add(all(simd, self.reach[0]), own),
            };
            *reach = choose(grazes, unit[k + 1].abs().mul_add(half, own), crossing);
        }
        let spread = match self.shape {
            Shape::Point => (reach[0] * along_b).mul_add(one, reach[1] * along_c),
            _ => all(simd, self.reach[0]) / steep * per_index,
        };
        Line {
            origin,
            direction,
            unit,
            per_index,
            inverse,
            enter,
            leave,
            is_in,
            grazes,
            reach,
            spread,
        }
    }

    /// Faces of its layers along eight rays.
    #[inline(always)]
    pub(super) fn faces<S: Simd>(&self, simd: S, line: &Line<S>) -> Faces<S> {
        let thickness = all(simd, self.thickness);
        if self.layering != Layering::Sheets {
            return Faces { begin: all(simd, 0.0), step: thickness };
        }
        // A ray along the sheets stays in one.
        let least = all(simd, 1e-6) * thickness / line.per_index;
        let growth = line.direction[0].abs().max(least);
        let from_middle = line.origin[0] - all(simd, self.middle);
        let forwards = choose(line.direction[0].simd_ge(all(simd, 0.0)), from_middle, -from_middle);
        Faces { begin: -forwards / growth, step: thickness / growth }
    }
}

impl<S: Simd> Faces<S> {
    /// Depth of a face.
    #[inline(always)]
    pub(super) fn at(&self, simd: S, face: i32) -> Lanes<S> {
        self.step.mul_add(all(simd, face as f32), self.begin)
    }

    /// The layer that a depth lies in, as a fraction from its face.
    #[inline(always)]
    pub(super) fn place(&self, depth: Lanes<S>) -> Lanes<S> {
        (depth - self.begin) / self.step
    }
}

impl<S: Simd> Line<S> {
    /// Whether any ray goes along slices.
    #[inline(always)]
    pub(super) fn grazes_any(&self) -> bool {
        (self.grazes & self.is_in).any_true()
    }

    /// Where rays cross a slice, or the middle of what they pass along it: depths, and places.
    #[inline(always)]
    pub(super) fn crossing(&self, simd: S, slice: i32) -> (Lanes<S>, [Lanes<S>; 3]) {
        let across = (all(simd, slice as f32) - self.origin[0]) * self.inverse[0];
        let at = choose(self.grazes, (self.enter + self.leave) * 0.5, across);
        let [a, b, c] = self.direction;
        let [x, y, z] = self.origin;
        (at, [a.mul_add(at, x), b.mul_add(at, y), c.mul_add(at, z)])
    }

    /// The rows and the columns of a slice whose kernels rays may meet, by where they cross it, among some.
    #[inline(always)]
    pub(super) fn window(&self, simd: S, place: &[Lanes<S>; 3], grid: &Grid) -> [[i32; 2]; 2] {
        let mut found = [[0; 2]; 2];
        for (k, found) in found.iter_mut().enumerate() {
            let low = least(simd, self.is_in, place[k + 1] - self.reach[k]);
            let high = most(simd, self.is_in, place[k + 1] + self.reach[k]);
            *found = within([low, high], [grid.low[k + 1], grid.high[k + 1]]);
        }
        found
    }

    /// The slices whose kernels rays may meet.
    #[inline(always)]
    pub(super) fn slices(&self, simd: S, grid: &Grid) -> [i32; 2] {
        let ends = [self.enter, self.leave].map(
            #[inline(always)]
            |t| self.direction[0].mul_add(t, self.origin[0]),
        );
        let low = least(simd, self.is_in, ends[0].min(ends[1])) - grid.reach[0];
        let high = most(simd, self.is_in, ends[0].max(ends[1])) + grid.reach[0];
        within([low, high], [grid.low[0], grid.high[0]])
    }
}

/// The least of some numbers.
#[inline(always)]
pub(super) fn least<S: Simd>(simd: S, of: Mask<S>, numbers: Lanes<S>) -> f32 {
    choose(of, numbers, all(simd, 3e38)).reduce_min()
}

/// The greatest of some numbers.
#[inline(always)]
pub(super) fn most<S: Simd>(simd: S, of: Mask<S>, numbers: Lanes<S>) -> f32 {
    choose(of, numbers, all(simd, -3e38)).reduce_max()
}

/// Whole numbers between two numbers, and between two others.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
pub(super) fn within([low, high]: [f32; 2], limits: [i32; 2]) -> [i32; 2] {
    [
        (low.ceil() as i32).clamp(limits[0], limits[1] + 1),
        (high.floor() as i32).clamp(limits[0] - 1, limits[1]),
    ]
}

impl Points {
    /// Where a sample lands; `None` where it is not before the eye.
    pub(super) fn land(&self, sample: [i32; 3]) -> Option<Landed> {
        let from_centre: [f32; 3] = std::array::from_fn(|k| sample[k] as f32 - self.centre[k]);
        let along = |c: usize| (0..3).map(|k| self.steps[k][c] * from_centre[k]).sum::<f32>();
        let [x, y, depth] = [along(0), along(1), along(2)];
        let (x, y, z) = (x + self.middle[0], y + self.middle[1], depth + self.middle[2]);
        let row = |c: usize| [0, 1, 2].map(|k| self.steps[k][c]);
        let (mut row_x, mut row_y, mut shrink) = (row(0), row(1), 1.0);
        if let Some(eye) = self.eye {
            if z <= eye * NEAR {
                return None;
            }
            let row_z = row(2);
            shrink = eye / z;
            for k in 0..3 {
                row_x[k] = (row_x[k] - row_z[k] * (x / z)) * shrink;
                row_y[k] = (row_y[k] - row_z[k] * (y / z)) * shrink;
            }
        }
        let [a, b] = [glam::Vec3::from(row_x), glam::Vec3::from(row_y)];
        let length = self.determinant * shrink * shrink / a.cross(b).length();
        Some(Landed { screen: [x * shrink, y * shrink], depth, length })
    }
}

impl Landed {
    /// The pixels that hold it, of those at these offsets from the picture's middle.
    #[inline(always)]
    pub(super) fn is_in<S: Simd>(&self, simd: S, [x, y]: [Lanes<S>; 2]) -> Mask<S> {
        let half = all(simd, 0.5);
        let right = all(simd, self.screen[0] + POINT_TIE) - x;
        let down = y - all(simd, self.screen[1] - POINT_TIE);
        right.simd_ge(-half) & right.simd_lt(half) & down.simd_ge(-half) & down.simd_lt(half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(run: [Run; 2]) -> Vec<i32> {
        run.iter().flat_map(|run| (0..run.count).map(|i| run.at(i))).collect()
    }

    #[test]
    fn samples_come_far_to_near_on_either_side_of_the_eye() {
        assert_eq!(order(runs([2, 6], 4, true)), [6, 5, 4, 2, 3]);
        assert_eq!(order(runs([2, 6], 4, false)), [3, 2, 4, 5, 6]);
        for split in [0, 2] {
            assert_eq!(order(runs([2, 4], split, true)), [4, 3, 2]);
            assert_eq!(order(runs([2, 4], split, false)), [2, 3, 4]);
        }
        assert_eq!(order(runs([2, 4], 9, true)), [2, 3, 4]);
        assert_eq!(order(runs([2, 4], 9, false)), [4, 3, 2]);
        assert!(order(runs([3, 2], 1, true)).is_empty());
    }

    #[test]
    fn whole_numbers_are_found_between_any_two() {
        assert_eq!(within([1.2, 3.9], [0, 9]), [2, 3]);
        assert_eq!(within([-4.0, 30.0], [0, 9]), [0, 9]);
        assert_eq!(within([12.0, 30.0], [0, 9]), [10, 9]);
        assert_eq!(within([-12.0, -3.0], [0, 9]), [0, -1]);
        assert_eq!(within([3e38, -3e38], [0, 9]), [10, -1]);
    }
}

//! The value between samples, eight rays at a time.

use fearless_simd::{Simd, f32x4, f64x2, i32x8, prelude::*};

use super::super::lanes::{LANES, Lanes, Mask, Vec3, all, choose, columns, exponential};
use super::super::own::Own;
use super::super::weights::{self, natural};
use super::{CellBorder, Lattice, NOTHING};
use crate::kernel::Kernel;
use crate::scene::NAMES_REACH;

/// Steps from the border of cells inwards within which light falls on it: about as deep as a cell, of which there are eight samples.
const LAYER: f32 = 2.0;

/// How a value is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::native) enum Method {
    /// 64 samples by cubic B-splines.
    BSpline,
    /// Eight samples by tents.
    Linear,
    /// Any other kernel, or width.
    Other,
    /// Basis functions and ellipsoids, of which there are no samples.
    Functions,
    /// Cells, alike.
    Cells,
}

/// A method that the compiler knows, so that a loop never holds the others, not even while it is compiled.
pub(in crate::native) trait Finds {
    const METHOD: Method;
}

/// A type for each method.
pub(in crate::native) mod by {
    use super::{Finds, Method};

    macro_rules! known {
        ($($name:ident),*) => { $(
            pub(in crate::native) struct $name;
            impl Finds for $name {
                const METHOD: Method = Method::$name;
            }
        )* };
    }
    known!(BSpline, Linear, Other, Functions, Cells);
}

impl Method {
    /// Whether it is of no samples.
    #[inline(always)]
    pub(in crate::native) fn is_own(self) -> bool {
        matches!(self, Self::Functions | Self::Cells)
    }
}

impl Lattice {
    /// The cells that places lie in, and where in them (0..1).
    #[inline(always)]
    fn cell<S: Simd>(&self, simd: S, place: Vec3<S>) -> ([Lanes<S>; 3], [Lanes<S>; 3]) {
        let axis = |p: Lanes<S>, n: usize| {
            // Rays that are not there ask far away: every load must stay in memory.
            let p = p.max(all(simd, -1.0)).min(all(simd, n as f32));
            let cell = p.floor().min(all(simd, n as f32 - 1.0));
            (cell, p - cell)
        };
        let (x, fx) = axis(place.x, self.dims[0]);
        let (y, fy) = axis(place.y, self.dims[1]);
        let (z, fz) = axis(place.z, self.dims[2]);
        ([x, y, z], [fx, fy, fz])
    }

    /// Where the sample `first` samples before a cell, along each axis, is stored.
    #[inline(always)]
    fn stored_at<S: Simd>(&self, simd: S, cell: [Lanes<S>; 3], first: usize) -> [i32; LANES] {
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "1..=16")]
        let shift = self.pad as i32 - first as i32;
        let [x, y, z] = cell;
        let place = |c: Lanes<S>| c.to_int::<i32x8<S>>() + i32x8::splat(simd, shift);
        let (x, y, z) = (place(x), place(y), place(z));
        let at = z * i32x8::splat(simd, self.plane) + y * i32x8::splat(simd, self.row) + x;
        at.to_array()
    }

    /// Four neighbours along x.
    #[inline(always)]
    fn four<S: Simd>(&self, simd: S, at: i32) -> f32x4<S> {
        #[expect(clippy::cast_sign_loss, reason = "stored_at clamps")]
        let at = at as usize;
        assert!(!cfg!(test) || at + 4 <= self.values.len());
        // SAFETY: `cell` holds every place between the padded borders, whose rows end `SLACK` samples before the
        // vector does, and makes a border of NaN: a load of four from any sample in reach of a cell stays in it.
        // Checked in this room's own tests; here are 64 loads a sample.
        #[expect(unsafe_code, reason = "unchecked loads in the innermost loop")]
        let four = unsafe { self.values.as_ptr().add(at).cast::<[f32; 4]>().read_unaligned() };
        f32x4::load_array(simd, four)
    }

    /// Four neighbours along x of either of two rays.
    #[inline(always)]
    fn fours<S: Simd>(&self, simd: S, [near, far]: [i32; 2], offset: i32) -> Lanes<S> {
        self.four(simd, near + offset).combine(self.four(simd, far + offset))
    }

    /// Four neighbours along x of each ray, a lane a ray.
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, at: [i32; LANES], offset: i32) -> [Lanes<S>; 4] {
        // By name: what the compiler does not inline of a `map` knows no wide instructions.
        let [a, b, c, d, e, f, g, h] = at;
        columns([
            self.four(simd, a + offset),
            self.four(simd, b + offset),
            self.four(simd, c + offset),
            self.four(simd, d + offset),
            self.four(simd, e + offset),
            self.four(simd, f + offset),
            self.four(simd, g + offset),
            self.four(simd, h + offset),
        ])
    }

    /// Two neighbours along x among numbers that are stored as the values are, as they lie in memory.
    #[inline(always)]
    fn pair(&self, of: &[f32], at: i32) -> f64 {
        #[expect(clippy::cast_sign_loss, reason = "stored_at clamps")]
        let at = at as usize;
        debug_assert_eq!(of.len(), self.values.len());
        assert!(!cfg!(test) || at + 2 <= of.len());
        // SAFETY: as of `four`; these are 8 bytes of its 16, and depths are as many as values.
        #[expect(unsafe_code, reason = "unchecked loads in the innermost loop")]
        let pair = unsafe { of.as_ptr().add(at).cast::<f64>().read_unaligned() };
        pair
    }

    /// Two neighbours along x of either of two rays.
    #[inline(always)]
    fn pairs<S: Simd>(&self, simd: S, of: &[f32], [near, far]: [i32; 2]) -> f32x4<S> {
        f64x2::load_array(simd, [self.pair(of, near), self.pair(of, far)]).bitcast()
    }

    /// Two neighbours along x of each ray, a lane a ray.
    #[inline(always)]
    fn two<S: Simd>(&self, simd: S, of: &[f32], at: [i32; LANES], offset: i32) -> [Lanes<S>; 2] {
        let [a, b, c, d, e, f, g, h] = at;
        let o = offset;
        let (ab, cd) = (self.pairs(simd, of, [a + o, b + o]), self.pairs(simd, of, [c + o, d + o]));
        let (ef, gh) = (self.pairs(simd, of, [e + o, f + o]), self.pairs(simd, of, [g + o, h + o]));
        [ab.unzip_low(cd).combine(ef.unzip_low(gh)), ab.unzip_high(cd).combine(ef.unzip_high(gh))]
    }

    /// Σ of the 4³ samples of each ray, by the products of their weights along x, y and z. Two rays go together, a row of
    /// either beside the other, so that no row is turned about before the sums are. Not in loops, which would be kept, and
    /// look up in memory what is spread here from registers: a quarter of the time.
    #[inline(always)]
    fn weighted<S: Simd>(&self, simd: S, at: [i32; LANES], by: &[[Lanes<S>; 4]; 3]) -> Lanes<S> {
        let [x, y, z] = by;
        let [a, b, c, d] = turned_about([
            self.of_two::<S, 0>(simd, at, y, z),
            self.of_two::<S, 1>(simd, at, y, z),
            self.of_two::<S, 2>(simd, at, y, z),
            self.of_two::<S, 3>(simd, at, y, z),
        ]);
        dot([a, b, c, d], *x)
    }

    /// What of that rays `J` and `J` + 4 have at each of four places along x.
    #[inline(always)]
    fn of_two<S: Simd, const J: usize>(
        &self,
        simd: S,
        at: [i32; LANES],
        y: &[Lanes<S>; 4],
        z: &[Lanes<S>; 4],
    ) -> Lanes<S> {
        let (at, plane) = ([at[J], at[J + 4]], self.plane);
        let y = spread::<S, J>(simd, y);
        let planes = [
            self.plane_of_two(simd, at, 0, y),
            self.plane_of_two(simd, at, plane, y),
            self.plane_of_two(simd, at, 2 * plane, y),
            self.plane_of_two(simd, at, 3 * plane, y),
        ];
        dot(planes, spread::<S, J>(simd, z))
    }

    /// The four rows of a plane about either of two rays.
    #[inline(always)]
    fn rows_of_two<S: Simd>(&self, simd: S, at: [i32; 2], offset: i32) -> [Lanes<S>; 4] {
        [
            self.fours(simd, at, offset),
            self.fours(simd, at, offset + self.row),
            self.fours(simd, at, offset + 2 * self.row),
            self.fours(simd, at, offset + 3 * self.row),
        ]
    }

    #[inline(always)]
    fn plane_of_two<S: Simd>(
        &self,
        simd: S,
        at: [i32; 2],
        offset: i32,
        y: [Lanes<S>; 4],
    ) -> Lanes<S> {
        dot(self.rows_of_two(simd, at, offset), y)
    }

    /// Not inlined: its loops are written out, and would take the compiler long in every loop that calls it.
    #[inline(never)]
    fn spline<S: Simd>(&self, simd: S, place: Vec3<S>) -> Lanes<S> {
        simd.vectorize(
            #[inline(always)]
            || {
                let (cell, [fx, fy, fz]) = self.cell(simd, place);
                let at = self.stored_at(simd, cell, 1);
                self.weighted(simd, at, &[natural(simd, fx), natural(simd, fy), natural(simd, fz)])
            },
        )
    }

    /// A B-spline and its growth, of the same samples: little more than half the time of both by themselves. Two rays go
    /// together as in [`Self::weighted`].
    #[inline(always)]
    fn spline_with_growth<S: Simd>(&self, simd: S, place: Vec3<S>) -> (Lanes<S>, Vec3<S>) {
        let (cell, [fx, fy, fz]) = self.cell(simd, place);
        let at = self.stored_at(simd, cell, 1);
        let across = [natural(simd, fy), slopes(simd, fy), natural(simd, fz), slopes(simd, fz)];
        let [a, b, c, d] = [
            self.of_two_with_growth::<S, 0>(simd, at, &across),
            self.of_two_with_growth::<S, 1>(simd, at, &across),
            self.of_two_with_growth::<S, 2>(simd, at, &across),
            self.of_two_with_growth::<S, 3>(simd, at, &across),
        ];
        let along = natural(simd, fx);
        let values = turned_about([a[0], b[0], c[0], d[0]]);
        let growth = Vec3 {
            x: dot(values, slopes(simd, fx)),
            y: dot(turned_about([a[1], b[1], c[1], d[1]]), along),
            z: dot(turned_about([a[2], b[2], c[2], d[2]]), along),
        };
        (dot(values, along), growth)
    }

    /// What of a value, and of its growth along y and z, rays `J` and `J` + 4 have at each of four places along x, by weights and
    /// their slopes along y and z.
    #[inline(always)]
    fn of_two_with_growth<S: Simd, const J: usize>(
        &self,
        simd: S,
        at: [i32; LANES],
        [y, along_y, z, along_z]: &[[Lanes<S>; 4]; 4],
    ) -> [Lanes<S>; 3] {
        let (at, plane) = ([at[J], at[J + 4]], self.plane);
        let by = [spread::<S, J>(simd, y), spread::<S, J>(simd, along_y)];
        let (z, along_z) = (spread::<S, J>(simd, z), spread::<S, J>(simd, along_z));
        let none = all(simd, 0.0);
        let sums = self.plane_with_growth(simd, at, 0, &by, [z[0], along_z[0]], [none; 3]);
        let sums = self.plane_with_growth(simd, at, plane, &by, [z[1], along_z[1]], sums);
        let sums = self.plane_with_growth(simd, at, 2 * plane, &by, [z[2], along_z[2]], sums);
        self.plane_with_growth(simd, at, 3 * plane, &by, [z[3], along_z[3]], sums)
    }

    /// Sums of that, and what one plane of samples adds to them.
    #[inline(always)]
    fn plane_with_growth<S: Simd>(
        &self,
        simd: S,
        at: [i32; 2],
        offset: i32,
        [y, along_y]: &[[Lanes<S>; 4]; 2],
        [z, along_z]: [Lanes<S>; 2],
        [value, of_y, of_z]: [Lanes<S>; 3],
    ) -> [Lanes<S>; 3] {
        let rows = self.rows_of_two(simd, at, offset);
        let of_plane = dot(rows, *y);
        [
            of_plane.mul_add(z, value),
            dot(rows, *along_y).mul_add(z, of_y),
            of_plane.mul_add(along_z, of_z),
        ]
    }

    /// Tents through numbers that are stored as the values are.
    #[inline(always)]
    fn tents<S: Simd>(&self, simd: S, of: &[f32], place: Vec3<S>) -> Lanes<S> {
        let (cell, [fx, fy, fz]) = self.cell(simd, place);
        let at = self.stored_at(simd, cell, 0);
        let [a, b] = self.two(simd, of, at, 0);
        let [c, d] = self.two(simd, of, at, self.row);
        let [e, f] = self.two(simd, of, at, self.plane);
        let [g, h] = self.two(simd, of, at, self.plane + self.row);
        let front = between(between(a, b, fx), between(c, d, fx), fy);
        let behind = between(between(e, f, fx), between(g, h, fx), fy);
        between(front, behind, fz)
    }

    /// The same, and their growth within the cell.
    #[inline(always)]
    fn tents_with_growth<S: Simd>(
        &self,
        simd: S,
        of: &[f32],
        place: Vec3<S>,
    ) -> (Lanes<S>, Vec3<S>) {
        let (cell, [fx, fy, fz]) = self.cell(simd, place);
        let at = self.stored_at(simd, cell, 0);
        let [a, b] = self.two(simd, of, at, 0);
        let [c, d] = self.two(simd, of, at, self.row);
        let [e, f] = self.two(simd, of, at, self.plane);
        let [g, h] = self.two(simd, of, at, self.plane + self.row);
        let [near_x, far_x] = [between(a, b, fx), between(c, d, fx)];
        let [near_z, far_z] = [between(e, f, fx), between(g, h, fx)];
        let [front, behind] = [between(near_x, far_x, fy), between(near_z, far_z, fy)];
        let along_x = between(between(b - a, d - c, fy), between(f - e, h - g, fy), fz);
        let along_y = between(far_x - near_x, far_z - near_z, fz);
        let growth = Vec3 { x: along_x, y: along_y, z: behind - front };
        (between(front, behind, fz), growth)
    }

    /// Growth of tents from half a sample before to half a sample on, along each axis. Not inlined, as it is long.
    #[inline(never)]
    fn growth_of_tents<S: Simd>(&self, simd: S, place: Vec3<S>) -> Vec3<S> {
        simd.vectorize(
            #[inline(always)]
            || self.growth_of_tents_here(simd, place),
        )
    }

    /// Written out rather than with closures: those that are not inlined are compiled without the instructions of `S`.
    #[inline(always)]
    fn growth_of_tents_here<S: Simd>(&self, simd: S, place: Vec3<S>) -> Vec3<S> {
        let (cell, [fx, fy, fz]) = self.cell(simd, place);
        let at = self.stored_at(simd, cell, 1);
        let (dx, dy, dz) = (about(simd, fx), about(simd, fy), about(simd, fz));
        let (row, plane) = (self.row, self.plane);
        // Of the 4 × 4 rows from one before the cell to one behind it: those at its corners, and the two that lie beyond
        // either side of it.
        let low = [self.row(simd, at, row + plane), self.row(simd, at, 2 * row + plane)];
        let high = [self.row(simd, at, row + 2 * plane), self.row(simd, at, 2 * row + 2 * plane)];
        let a = inner(low[0], fx);
        let b = inner(low[1], fx);
        let c = inner(high[0], fx);
        let d = inner(high[1], fx);
        let x = between(
            between(dot(low[0], dx), dot(low[1], dx), fy),
            between(dot(high[0], dx), dot(high[1], dx), fy),
            fz,
        );
        let y = between(
            self.growth_across(simd, at, [plane, row], [a, b], fx, dy),
            self.growth_across(simd, at, [2 * plane, row], [c, d], fx, dy),
            fz,
        );
        let z = between(
            self.growth_across(simd, at, [row, plane], [a, c], fx, dz),
            self.growth_across(simd, at, [2 * row, plane], [b, d], fx, dz),
            fy,
        );
        Vec3 { x, y, z }
    }

    /// Growth along the axis whose samples lie `step` apart, of values found `fx` along rows: `inside`, which are at hand,
    /// and those of the rows before and behind them, the first of which lies `offset` from `at`.
    #[inline(always)]
    fn growth_across<S: Simd>(
        &self,
        simd: S,
        at: [i32; LANES],
        [offset, step]: [i32; 2],
        inside: [Lanes<S>; 2],
        fx: Lanes<S>,
        by: [Lanes<S>; 4],
    ) -> Lanes<S> {
        let before = inner(self.row(simd, at, offset), fx);
        let behind = inner(self.row(simd, at, offset + 3 * step), fx);
        dot([before, inside[0], inside[1], behind], by)
    }

    /// Whether a growth costs little where its value is found.
    #[inline(always)]
    pub(in crate::native) fn grows_with_value(&self, method: Method) -> bool {
        method == Method::BSpline || (method == Method::Linear && self.is_quick)
    }

    /// The stored value and its growth per index, of methods whose growth costs little beside it ([`Self::grows_with_value`]).
    /// Not inlined, as it is long.
    #[inline(never)]
    pub(in crate::native) fn value_with_growth<S: Simd>(
        &self,
        simd: S,
        method: Method,
        place: Vec3<S>,
    ) -> (Lanes<S>, Vec3<S>) {
        simd.vectorize(
            #[inline(always)]
            || match method {
                Method::BSpline => self.spline_with_growth(simd, place),
                _ => self.tents_with_growth(simd, &self.values, place),
            },
        )
    }

    /// The stored value at places in index space, [`NOTHING`] where no kernel reaches. What `bias` is is not added.
    #[inline(always)]
    pub(in crate::native) fn value<S: Simd>(
        &self,
        simd: S,
        method: Method,
        place: Vec3<S>,
    ) -> Lanes<S> {
        match method {
            Method::BSpline => self.spline(simd, place),
            Method::Linear => self.tents(simd, &self.values, place),
            Method::Other => self.other(simd, place),
            Method::Functions | Method::Cells => match &self.own {
                Some(own) => own.value(simd, place),
                None => all(simd, 0.0),
            },
        }
    }

    /// What four samples of an axis weigh at `f` beyond the second, by B-splines narrower than natural, or by tents of
    /// another width, normalised. Where none is in reach, the nearest alone.
    #[inline(always)]
    fn scaled_weights<S: Simd>(&self, simd: S, f: Lanes<S>) -> [Lanes<S>; 4] {
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let h = [f + 1.0, f, one - f, all(simd, 2.0) - f].map(
            #[inline(always)]
            |x| weights::at(simd, x * (1.0 / self.stretch), self.kernel == Kernel::Linear),
        );
        let total = h[0] + h[1] + (h[2] + h[3]);
        let is_met = total.simd_gt(zero);
        let share = one / choose(is_met, total, one);
        let far = choose(f.simd_ge(all(simd, 0.5)), one, zero);
        let alone = [zero, one - far, far, zero];
        [0, 1, 2, 3].map(
            #[inline(always)]
            |i| choose(is_met, h[i] * share, alone[i]),
        )
    }

    /// Boxes, kernels of another than their natural width, and radial ones, normalised. Not inlined, as it is long.
    #[inline(never)]
    fn other<S: Simd>(&self, simd: S, place: Vec3<S>) -> Lanes<S> {
        simd.vectorize(
            #[inline(always)]
            || self.other_here(simd, place),
        )
    }

    #[inline(always)]
    fn other_here<S: Simd>(&self, simd: S, place: Vec3<S>) -> Lanes<S> {
        if matches!(self.kernel, Kernel::Point | Kernel::Nearest) {
            let [nx, ny, nz] = self.dims;
            let cell = [
                nearest(simd, place.x, nx),
                nearest(simd, place.y, ny),
                nearest(simd, place.z, nz),
            ];
            return self.taps(simd, cell);
        }
        let (cell, f) = self.cell(simd, place);
        if self.kernel.is_separable() {
            let at = self.stored_at(simd, cell, 1);
            let by = f.map(
                #[inline(always)]
                |f| self.scaled_weights(simd, f),
            );
            return self.weighted(simd, at, &by);
        }
        let before = self.pad - 1;
        let at = self.stored_at(simd, cell, before);
        let scale = 1.0 / self.stretch;
        let (mut sum, mut total) = (all(simd, 0.0), all(simd, 0.0));
        for z in 0..2 * self.pad {
            let dz = all(simd, z as f32 - before as f32) - f[2];
            for y in 0..2 * self.pad {
                let dy = all(simd, y as f32 - before as f32) - f[1];
                let across = dy.mul_add(dy, dz * dz);
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_possible_wrap,
                    reason = "< 32"
                )]
                let row = z as i32 * self.plane + y as i32 * self.row;
                for x in 0..2 * self.pad {
                    let dx = all(simd, x as f32 - before as f32) - f[0];
                    let h = self.radial(simd, dx.mul_add(dx, across) * (scale * scale));
                    #[expect(clippy::cast_sign_loss, reason = "clamped")]
                    let taps = at.map(|at| self.values[(at + row) as usize + x]);
                    let taps = Lanes::load_array(simd, taps);
                    sum = taps.mul_add(h, sum);
                    total += h;
                }
            }
        }
        let is_there = total.simd_gt(all(simd, 0.0));
        choose(is_there, sum / total, all(simd, NOTHING))
    }

    /// A radial kernel's value, to a factor that normalisation takes out.
    #[inline(always)]
    fn radial<S: Simd>(&self, simd: S, squared: Lanes<S>) -> Lanes<S> {
        let zero = all(simd, 0.0);
        if self.kernel == Kernel::Gaussian {
            // σ 0.6, cut where exp falls to 0.004.
            let h = exponential(simd, squared * (-1.0 / 0.72));
            return choose(squared.simd_gt(all(simd, 3.975_53)), zero, h);
        }
        let r = squared.sqrt();
        let t = all(simd, 1.556_228) - r;
        let inner = squared.mul_add(r * 0.671_033 - 1.157_743, all(simd, 0.557_526));
        let outer = t * t * t.mul_add(all(simd, 0.282_474), all(simd, 0.067_599));
        let outer = choose(t.simd_gt(zero), outer, zero);
        choose(r.simd_gt(all(simd, 0.889_392)), outer, inner)
    }

    /// Growth of the stored value per index. Of B-splines the derivative, and of tents for quick pictures; of other
    /// kernels, whose derivative jumps, the growth from half a sample before to half a sample on.
    #[inline(always)]
    pub(in crate::native) fn gradient<S: Simd>(
        &self,
        simd: S,
        method: Method,
        place: Vec3<S>,
    ) -> Vec3<S> {
        if self.grows_with_value(method) {
            return self.value_with_growth(simd, method, place).1;
        }
        if method.is_own()
            && let Some(own) = &self.own
        {
            return own.gradient(simd, place);
        }
        if method == Method::Linear {
            return self.growth_of_tents(simd, place);
        }
        // A loop, so that the value is compiled into it once.
        let mut growth = [all(simd, 0.0); 3];
        for (axis, growth) in growth.iter_mut().enumerate() {
            let offset = [0, 1, 2].map(|a| if a == axis { 0.5 } else { 0.0 });
            let past = self.value(simd, method, place.add(Vec3::splat(simd, offset)));
            let offset = offset.map(|x: f32| -x);
            let before = self.value(simd, method, place.add(Vec3::splat(simd, offset)));
            let nothing = past.simd_eq(all(simd, NOTHING)) | before.simd_eq(all(simd, NOTHING));
            *growth = choose(nothing, all(simd, 0.0), past - before);
        }
        let [x, y, z] = growth;
        Vec3 { x, y, z }
    }

    /// What light takes for that: of ellipsoids, where it falls on borders, something else near these.
    #[inline(always)]
    pub(in crate::native) fn lit_growth<S: Simd>(
        &self,
        simd: S,
        method: Method,
        place: Vec3<S>,
        of_borders: bool,
    ) -> Vec3<S> {
        match &self.own {
            Some(Own::Functions(functions)) if of_borders && method == Method::Functions => {
                functions.growth_for_light(simd, place)
            }
            _ if of_borders && let Some(border) = &self.border => {
                self.growth_by_border(simd, border, method, place)
            }
            _ => self.gradient(simd, method, place),
        }
    }

    /// The growth of a lattice over cells, in whose outermost layer light falls on their border as it does on the cells
    /// themselves ([`crate::cells::ShadingNormals`]). Not inlined, as it is long.
    #[inline(never)]
    fn growth_by_border<S: Simd>(
        &self,
        simd: S,
        border: &CellBorder,
        method: Method,
        place: Vec3<S>,
    ) -> Vec3<S> {
        simd.vectorize(
            #[inline(always)]
            || {
                let inside = self.gradient(simd, method, place);
                let (depth, inwards) = self.tents_with_growth(simd, &border.depths, place);
                let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
                let share = (one - depth.max(zero) * (1.0 / LAYER)).max(zero);
                let length = inwards.dot(inwards).sqrt().max(all(simd, 1e-6));
                let inwards = inwards.scaled(share * border.strength / length);
                // A surface and its back are lit alike.
                let is_turned = inwards.dot(inside).simd_lt(zero);
                let of_inside = one - share;
                inwards.at(inside, choose(is_turned, zero - of_inside, of_inside))
            },
        )
    }

    /// What light takes for the growth of numbers that name things (`scene::shading` has the rule), which are `range` apart at most.
    /// Not inlined, as it is long.
    #[inline(never)]
    pub(in crate::native) fn end_of_name<S: Simd>(
        &self,
        simd: S,
        place: Vec3<S>,
        range: f32,
    ) -> Vec3<S> {
        simd.vectorize(
            #[inline(always)]
            || self.end_of_name_here(simd, place, range),
        )
    }

    #[inline(always)]
    fn end_of_name_here<S: Simd>(&self, simd: S, place: Vec3<S>, range: f32) -> Vec3<S> {
        let [nx, ny, nz] = self.dims;
        let middle = Vec3 {
            x: nearest(simd, place.x, nx),
            y: nearest(simd, place.y, ny),
            z: nearest(simd, place.z, nz),
        };
        let own = self.taps(simd, [middle.x, middle.y, middle.z]);
        let (zero, none) = (all(simd, 0.0), Vec3::splat(simd, [0.0; 3]));
        let (mut sum, mut total) = (none, zero);
        for k in -NAMES_REACH..=NAMES_REACH {
            let (z, dz, of_z) = beside(simd, (middle.z, k), place.z, nz);
            for j in -NAMES_REACH..=NAMES_REACH {
                let (y, dy, of_y) = beside(simd, (middle.y, j), place.y, ny);
                for i in -NAMES_REACH..=NAMES_REACH {
                    let (x, dx, of_x) = beside(simd, (middle.x, i), place.x, nx);
                    let weight = of_x * (of_y * of_z);
                    let is_other = self.taps(simd, [x, y, z]).simd_ne(own);
                    let share = choose(is_other, weight, zero);
                    sum = sum.at(Vec3 { x: dx, y: dy, z: dz }, share);
                    total += weight;
                }
            }
        }
        sum.scaled(all(simd, range) / total)
    }

    /// The samples with these numbers along x, y and z.
    #[inline(always)]
    fn taps<S: Simd>(&self, simd: S, at: [Lanes<S>; 3]) -> Lanes<S> {
        #[expect(clippy::cast_sign_loss, reason = "clamped")]
        let [a, b, c, d, e, f, g, h] = self.stored_at(simd, at, 0).map(|at| at as usize);
        let v = &self.values;
        Lanes::load_array(simd, [v[a], v[b], v[c], v[d], v[e], v[f], v[g], v[h]])
    }

    /// How deep places lie in the cells that it is over, in steps.
    #[inline(always)]
    pub(in crate::native) fn depth<S: Simd>(
        &self,
        simd: S,
        border: &CellBorder,
        place: Vec3<S>,
    ) -> Lanes<S> {
        self.tents(simd, &border.depths, place)
    }

    /// The rays whose places no data lie about, or no cells.
    #[inline(always)]
    pub(in crate::native) fn is_outside<S: Simd>(&self, simd: S, place: Vec3<S>) -> Mask<S> {
        match &self.border {
            Some(border) => self.depth(simd, border, place).simd_lt(all(simd, 0.0)),
            None => self.holes_at(simd, place),
        }
    }

    /// The rays that a method finds no value for.
    #[inline(always)]
    pub(in crate::native) fn is_nothing<S: Simd>(
        simd: S,
        method: Method,
        value: Lanes<S>,
    ) -> Mask<S> {
        match method {
            Method::BSpline | Method::Linear => Mask::splat(simd, false),
            Method::Other | Method::Functions | Method::Cells => value.simd_eq(all(simd, NOTHING)),
        }
    }
}

/// Sums of rays i and i + 4 beside one another, as what each place along x has of eight rays.
#[inline(always)]
fn turned_about<S: Simd>([a, b, c, d]: [Lanes<S>; 4]) -> [Lanes<S>; 4] {
    let (a, b, c, d) = (a.split(), b.split(), c.split(), d.split());
    columns([a.0, b.0, c.0, d.0, a.1, b.1, c.1, d.1])
}

/// Weights of rays `J` and `J` + 4, each of the four places that its ray has along x.
#[inline(always)]
fn spread<S: Simd, const J: usize>(simd: S, [a, b, c, d]: &[Lanes<S>; 4]) -> [Lanes<S>; 4] {
    [
        spread_one::<S, J>(simd, *a),
        spread_one::<S, J>(simd, *b),
        spread_one::<S, J>(simd, *c),
        spread_one::<S, J>(simd, *d),
    ]
}

#[inline(always)]
fn spread_one<S: Simd, const J: usize>(simd: S, weight: Lanes<S>) -> Lanes<S> {
    let (low, high) = weight.split();
    f32x4::splat(simd, low[J]).combine(f32x4::splat(simd, high[J]))
}

/// Four numbers by their weights.
#[inline(always)]
fn dot<S: Simd>([a, b, c, d]: [Lanes<S>; 4], by: [Lanes<S>; 4]) -> Lanes<S> {
    a.mul_add(by[0], b.mul_add(by[1], c.mul_add(by[2], d * by[3])))
}

/// What the growth of tents from half a sample before a place to half a sample on weighs the four samples about it, `f` beyond
/// the second.
#[inline(always)]
fn about<S: Simd>(simd: S, f: Lanes<S>) -> [Lanes<S>; 4] {
    let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
    let is_far = f.simd_ge(all(simd, 0.5));
    let h = f + choose(is_far, all(simd, -0.5), all(simd, 0.5));
    let (first, second) = (h - one, one - h * 2.0);
    [
        choose(is_far, zero, first),
        choose(is_far, first, second),
        choose(is_far, second, h),
        choose(is_far, h, zero),
    ]
}

/// A number on the way from one to another.
#[inline(always)]
fn between<S: Simd>(from: Lanes<S>, to: Lanes<S>, share: Lanes<S>) -> Lanes<S> {
    (to - from).mul_add(share, from)
}

/// The tent's value of a row of four samples, `f` of the way from the second to the third.
#[inline(always)]
fn inner<S: Simd>([_, a, b, _]: [Lanes<S>; 4], f: Lanes<S>) -> Lanes<S> {
    between(a, b, f)
}

/// The sample nearest to a place, along an axis of `n`.
#[inline(always)]
fn nearest<S: Simd>(simd: S, p: Lanes<S>, n: usize) -> Lanes<S> {
    (p + 0.5).floor().max(all(simd, 0.0)).min(all(simd, n as f32 - 1.0))
}

/// The sample so many beyond a middle one along an axis of `n`, or the last that there is, how far beyond a place the number would lie,
/// and its weight.
#[inline(always)]
fn beside<S: Simd>(
    simd: S,
    (middle, off): (Lanes<S>, i32),
    place: Lanes<S>,
    n: usize,
) -> (Lanes<S>, Lanes<S>, Lanes<S>) {
    let at = middle + all(simd, off as f32);
    let away = at - place;
    let share = away * (1.0 / (NAMES_REACH as f32 + 0.5));
    let hump = (all(simd, 1.0) - share * share).max(all(simd, 0.0));
    (at.max(all(simd, 0.0)).min(all(simd, n as f32 - 1.0)), away, hump * hump)
}

/// Derivatives of the weights of the four samples about a place in its cell ([`weights::natural`]).
#[inline(always)]
fn slopes<S: Simd>(simd: S, f: Lanes<S>) -> [Lanes<S>; 4] {
    let g = all(simd, 1.0) - f;
    let inner = |f: Lanes<S>| f * (f * 1.5 - 2.0);
    [g * g * -0.5, inner(f), -inner(g), f * f * 0.5]
}

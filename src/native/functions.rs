//! Sums of basis functions in index space, eight rays at a time, at places anywhere (`rbf` has the definition).

use fearless_simd::{Level, Simd, i32x8, prelude::*};

use super::bricks::ends;
use super::in_order::look;
use super::lanes::{LANES, Lanes, Mask, Vec3, all, any, choose, dispatched, exponential};
use super::lattice::NOTHING;
use crate::core::parallel;
use crate::core::{Cancelled, Ticket, mapped};
use crate::kernel::Bounds;
use crate::rbf::{Basis, Blend, Encoding, Function, LIT, LeftOut, Limits, Listed};
use crate::volume::Lattice;

/// Functions between two looks at the ticket.
const A_RUN: usize = 1 << 14;

/// A function, in index space.
#[derive(Debug, Clone, Copy)]
pub(super) struct Summand {
    pub centre: [f32; 3],
    /// Upper triangle, by rows, of what takes an offset to one in widths.
    pub shape: [f32; 6],
    pub weight: f32,
    /// The squared distance, in widths, at which it ends.
    pub reach: f32,
    /// Of a mean, what it is at its centre, less than 0 of a hole; 1 of a sum.
    pub height: f32,
}

impl Summand {
    /// An offset in widths.
    #[inline(always)]
    pub(super) fn widths<S: Simd>(&self, offset: Vec3<S>) -> Vec3<S> {
        let [xx, xy, xz, yy, yz, zz] = self.shape;
        Vec3 {
            x: (offset.x * xx) + (offset.y * xy) + (offset.z * xz),
            y: (offset.y * yy) + (offset.z * yz),
            z: offset.z * zz,
        }
    }

    /// The offset of places from its centre.
    #[inline(always)]
    pub(super) fn offset<S: Simd>(&self, place: Vec3<S>) -> Vec3<S> {
        let [x, y, z] = self.centre;
        Vec3 { x: place.x - x, y: place.y - y, z: place.z - z }
    }

    /// What growth per width is per index.
    #[inline(always)]
    fn turned<S: Simd>(&self, by: Vec3<S>) -> Vec3<S> {
        let [xx, xy, xz, yy, yz, zz] = self.shape;
        Vec3 {
            x: by.x * xx,
            y: (by.x * xy) + (by.y * yy),
            z: (by.x * xz) + (by.y * yz) + (by.z * zz),
        }
    }
}

/// φ of squared distances in widths.
#[inline(always)]
pub(super) fn basis_of<S: Simd>(simd: S, basis: Basis, square: Lanes<S>) -> Lanes<S> {
    match basis {
        Basis::Gaussian | Basis::Ellipsoid => exponential(simd, square * -0.5),
        Basis::Multiquadric => all(simd, 1.0) / (square + 1.0).sqrt(),
    }
}

/// The functions of an encoding over a lattice.
#[derive(Debug)]
pub(super) struct Functions {
    pub listed: Listed,
    pub all: Vec<Summand>,
    /// What is added for functions that each cell leaves out, at its corners, x fastest; empty where nothing is.
    corners: Vec<[f32; 8]>,
}

impl Functions {
    /// Of an encoding less what is left out, over a lattice.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn new(
        encoding: &Encoding,
        limits: &Limits,
        lattice: &Lattice,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let space = (lattice.dims, lattice.axes(), lattice.origin);
        let listed = limits.listed(encoding, space, ticket)?;
        #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
        let narrow = |i: usize| {
            let (function, reach): (&Function, f64) = (&listed.functions[i], listed.reaches[i]);
            let rows = function.shape.transpose();
            let [x, y, z] = [rows.x_axis, rows.y_axis, rows.z_axis];
            Summand {
                centre: function.centre.as_vec3().to_array(),
                shape: [x.x, x.y, x.z, y.y, y.z, z.z].map(|v| v as f32),
                weight: function.weight as f32,
                reach: reach as f32,
                height: listed.heights.get(i).map_or(1.0, |height| *height as f32),
            }
        };
        let all = mapped(listed.functions.len(), A_RUN, narrow, ticket)?;
        let corners = listed.left_out.as_ref().map_or(&[][..], |LeftOut { corners, .. }| corners);
        #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
        let corners = corners.iter().map(|values| values.map(|value| value as f32)).collect();
        Ok(Self { listed, all, corners })
    }

    /// Whether cells leave functions out, so that what is summed up at a place depends on its cell.
    pub(super) fn is_limited(&self) -> bool {
        self.listed.left_out.is_some()
    }

    pub(super) fn basis(&self) -> Basis {
        self.listed.basis
    }

    /// Whether they are weighed against each other rather than summed up.
    pub(super) fn is_mean(&self) -> bool {
        self.listed.blend == Blend::Mean
    }

    /// What is taken from φ: of a mean what it is where it ends.
    #[inline(always)]
    pub(super) fn end(&self) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
        let end = if self.is_mean() { self.listed.epsilon as f32 } else { 0.0 };
        end
    }

    /// The values at the samples, x fastest.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn at_samples(&self, ticket: &Ticket) -> Result<Vec<f32>, Cancelled> {
        let [nx, ny, nz] = self.listed.dims;
        let level = Level::new();
        let mut values = vec![0.0_f32; nx * ny * nz];
        parallel::try_each(values.chunks_mut(nx).enumerate(), |(i, row)| {
            if ticket.is_cancelled() {
                return Err(Cancelled);
            }
            let (y, z) = ((i % ny) as f32, (i / ny) as f32);
            dispatched!(level, simd => self.row(simd, [y, z], row));
            Ok(())
        })?;
        Ok(values)
    }

    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, [y, z]: [f32; 2], row: &mut [f32]) {
        let ahead = Lanes::load_array(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        for (i, part) in row.chunks_mut(LANES).enumerate() {
            let x = ahead + (i * LANES) as f32;
            let found = self.value(simd, Vec3 { x, y: all(simd, y), z: all(simd, z) });
            part.copy_from_slice(&found.to_array()[..part.len()]);
        }
    }

    /// Takes bounds of the values at samples to those of the values between these.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn bound(&self, bounds: &mut Bounds, ticket: &Ticket) -> Result<(), Cancelled> {
        if self.is_mean() {
            return bounds.set_to_boxes(self.listed.boxes(), (-1.0, 0.0), NOTHING, ticket);
        }
        let dims = self.listed.dims;
        let slacks: Result<Vec<f64>, Cancelled> =
            parallel::try_list(bounds.ranges.len(), |brick| {
                look(ticket)?;
                let [low, high] = ends(bounds, brick, dims);
                Ok(self.listed.slack(low, high))
            });
        for ([low, high], slack) in bounds.ranges.iter_mut().zip(slacks?) {
            #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
            let slack = (slack as f32).next_up();
            *low -= slack;
            *high += slack;
        }
        Ok(())
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> usize {
        self.listed.size_bytes() + size_of_val(&self.all[..]) + size_of_val(&self.corners[..])
    }

    #[inline(always)]
    fn list(&self, cell: i32) -> &[u32] {
        #[expect(clippy::cast_sign_loss, reason = "clamped")]
        let cell = cell as usize;
        let Listed { starts, lists, .. } = &self.listed;
        &lists[starts[cell] as usize..starts[cell + 1] as usize]
    }

    /// The cells of places.
    #[inline(always)]
    fn cells_of<S: Simd>(&self, simd: S, place: Vec3<S>) -> [i32; LANES] {
        let scale = 1.0 / self.listed.edge as f32;
        let along = |p: Lanes<S>, n: i32| {
            let cell = ((p + 0.5) * scale).floor();
            cell.max(all(simd, 0.0)).min(all(simd, (n - 1) as f32)).to_int::<i32x8<S>>()
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_possible_wrap,
            reason = "32 at most"
        )]
        let [nx, ny, nz] = self.listed.cells.map(|n| n as i32);
        let (x, y, z) = (along(place.x, nx), along(place.y, ny), along(place.z, nz));
        let at = (z * i32x8::splat(simd, ny) + y) * i32x8::splat(simd, nx) + x;
        at.to_array()
    }

    /// The values at places. Not inlined: its loop is long, and many ask.
    #[inline(never)]
    pub(super) fn value<S: Simd>(&self, simd: S, place: Vec3<S>) -> Lanes<S> {
        simd.vectorize(
            #[inline(always)]
            || self.value_at(simd, place),
        )
    }

    #[inline(always)]
    fn value_at<S: Simd>(&self, simd: S, place: Vec3<S>) -> Lanes<S> {
        if self.is_mean() {
            let (value, coverage) = self.weighed_at(simd, place);
            return covered(simd, value, coverage);
        }
        let zero = all(simd, 0.0);
        let mut sum = zero;
        self.each(
            simd,
            place,
            #[inline(always)]
            |function, _, square, within| {
                let phi = choose(within, basis_of(simd, self.basis(), square), zero);
                sum += phi * function.weight;
            },
        );
        if self.corners.is_empty() { sum } else { sum + self.added(simd, place).0 }
    }

    /// Of a mean, what it comes to at places, and how far these are covered (`rbf::Blend::Mean`): it has a value from 1 on.
    #[inline(never)]
    pub(super) fn weighed<S: Simd>(&self, simd: S, place: Vec3<S>) -> (Lanes<S>, Lanes<S>) {
        simd.vectorize(
            #[inline(always)]
            || self.weighed_at(simd, place),
        )
    }

    #[inline(always)]
    fn weighed_at<S: Simd>(&self, simd: S, place: Vec3<S>) -> (Lanes<S>, Lanes<S>) {
        let zero = all(simd, 0.0);
        let (mut sum, mut total, mut coverage) = (zero, zero, zero);
        self.each(
            simd,
            place,
            #[inline(always)]
            |function, _, square, within| {
                let phi = (basis_of(simd, self.basis(), square) - self.end()) * function.height;
                let phi = choose(within, phi, zero);
                coverage += phi;
                if function.height > 0.0 {
                    sum += phi * function.weight;
                    total += phi;
                }
            },
        );
        (mean(simd, sum, total), coverage)
    }

    /// The values' growth per index at places. Of a sum Σ 2 w φ′(r²) Sᵀ S (x − c), of a mean the same of (w − s) h, by Σ h φ.
    #[inline(never)]
    pub(super) fn gradient<S: Simd>(&self, simd: S, place: Vec3<S>) -> Vec3<S> {
        simd.vectorize(
            #[inline(always)]
            || match self.is_mean() {
                true => self.growths_at(simd, place).0,
                false => self.gradient_at(simd, place),
            },
        )
    }

    /// What light takes for that (`rbf::Encoding::growth_for_light`).
    #[inline(never)]
    pub(super) fn growth_for_light<S: Simd>(&self, simd: S, place: Vec3<S>) -> Vec3<S> {
        simd.vectorize(
            #[inline(always)]
            || match self.is_mean() {
                true => {
                    let (growth, border) = self.growths_at(simd, place);
                    let zero = all(simd, 0.0);
                    let is_across = border.dot(growth).simd_lt(zero);
                    border.add(growth.scaled(choose(is_across, all(simd, -1.0), all(simd, 1.0))))
                }
                false => self.gradient_at(simd, place),
            },
        )
    }

    #[inline(always)]
    fn gradient_at<S: Simd>(&self, simd: S, place: Vec3<S>) -> Vec3<S> {
        let zero = all(simd, 0.0);
        let mut growth = Vec3::splat(simd, [0.0; 3]);
        self.each(
            simd,
            place,
            #[inline(always)]
            |function, offset, square, within| {
                let phi = choose(within, basis_of(simd, self.basis(), square), zero);
                let slope = match self.basis() {
                    Basis::Gaussian | Basis::Ellipsoid => phi,
                    Basis::Multiquadric => phi * phi * phi,
                };
                growth = growth.add(function.turned(offset.scaled(slope * -function.weight)));
            },
        );
        if self.corners.is_empty() { growth } else { growth.add(self.added(simd, place).1) }
    }

    /// Of a mean, its growth and what stands for that at its border.
    #[inline(always)]
    fn growths_at<S: Simd>(&self, simd: S, place: Vec3<S>) -> (Vec3<S>, Vec3<S>) {
        let (zero, one, none) = (all(simd, 0.0), all(simd, 1.0), Vec3::splat(simd, [0.0; 3]));
        let (mut growth, mut of_total, mut thickening) = (none, none, none);
        let (mut sum, mut total, mut coverage) = (zero, zero, zero);
        self.each(
            simd,
            place,
            #[inline(always)]
            |function, offset, square, within| {
                let phi = basis_of(simd, self.basis(), square);
                let slope = choose(within, phi * -function.height, zero);
                let along = function.turned(offset.scaled(slope));
                let share = choose(within, (phi - self.end()) * function.height, zero);
                coverage += share;
                thickening = thickening.add(along);
                if function.height > 0.0 {
                    growth = growth.add(along.scaled(all(simd, function.weight)));
                    of_total = of_total.add(along);
                    sum += share * function.weight;
                    total += share;
                }
            },
        );
        let is_there = total.simd_gt(zero);
        let share = choose(is_there, one / choose(is_there, total, one), zero);
        let growth = growth.add(of_total.scaled(-(sum * share))).scaled(share);
        #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
        let (lit, range) = (LIT as f32, self.listed.range as f32);
        let near = ((all(simd, lit) - coverage) * (1.0 / (lit - 1.0))).max(zero).min(one);
        (growth, thickening.scaled(near * near * range))
    }

    /// What is added at places for functions that their cells leave out, and how that grows per index.
    #[inline(always)]
    fn added<S: Simd>(&self, simd: S, place: Vec3<S>) -> (Lanes<S>, Vec3<S>) {
        let cells = self.cells_of(simd, place);
        #[expect(clippy::cast_sign_loss, reason = "clamped")]
        let corners = cells.map(|cell| self.corners[cell as usize]);
        let corner = |i: usize| Lanes::load_array(simd, corners.map(|values| values[i]));
        let scale = 1.0 / self.listed.edge as f32;
        let part = |p: Lanes<S>, n: usize| {
            let at = (p + 0.5) * scale;
            at - at.floor().max(all(simd, 0.0)).min(all(simd, (n - 1) as f32))
        };
        let [nx, ny, nz] = self.listed.cells;
        let (x, y, z) = (part(place.x, nx), part(place.y, ny), part(place.z, nz));
        let mix = |low: Lanes<S>, high: Lanes<S>, share: Lanes<S>| (high - low).mul_add(share, low);
        // Along x: both ends of four edges.
        let edges = [0, 2, 4, 6].map(|i| (corner(i), corner(i + 1)));
        let on = edges.map(|(low, high)| mix(low, high, x));
        let slopes = edges.map(|(low, high)| high - low);
        let (near, far) = (mix(on[0], on[1], y), mix(on[2], on[3], y));
        let growth = Vec3 {
            x: mix(mix(slopes[0], slopes[1], y), mix(slopes[2], slopes[3], y), z),
            y: mix(on[1] - on[0], on[3] - on[2], z),
            z: far - near,
        };
        (mix(near, far, z), growth.scaled(all(simd, scale)))
    }

    /// Calls `visit` with each function that reaches any of some places, their offsets in widths, these squared, and which
    /// it reaches.
    #[inline(always)]
    fn each<S: Simd>(
        &self,
        simd: S,
        place: Vec3<S>,
        mut visit: impl FnMut(&Summand, Vec3<S>, Lanes<S>, Mask<S>),
    ) {
        let cells = self.cells_of(simd, place);
        let mut left = Left::all();
        while let Some((cell, here)) = left.next(simd, &cells) {
            for &i in self.list(cell) {
                let function = &self.all[i as usize];
                let offset = function.widths(function.offset(place));
                let square = offset.dot(offset);
                let within = square.simd_le(all(simd, function.reach)) & here;
                if any(within) {
                    visit(function, offset, square, within);
                }
            }
        }
    }
}

/// Σ w h φ / Σ h φ; 0 where there is nothing to weigh.
#[inline(always)]
pub(super) fn mean<S: Simd>(simd: S, sum: Lanes<S>, total: Lanes<S>) -> Lanes<S> {
    let is_there = total.simd_gt(all(simd, 0.0));
    choose(is_there, sum / choose(is_there, total, all(simd, 1.0)), all(simd, 0.0))
}

/// Values of a mean, and nothing where it has none.
#[inline(always)]
pub(super) fn covered<S: Simd>(simd: S, value: Lanes<S>, coverage: Lanes<S>) -> Lanes<S> {
    choose(coverage.simd_ge(all(simd, 1.0)), value, all(simd, NOTHING))
}

/// Rays whose cell was not looked at yet.
pub(super) struct Left(u32);

impl Left {
    #[inline(always)]
    pub(super) fn all() -> Self {
        Self((1 << LANES) - 1)
    }

    /// The cell of the first of them, and all rays in it.
    #[inline(always)]
    pub(super) fn next<S: Simd>(
        &mut self,
        simd: S,
        cells: &[i32; LANES],
    ) -> Option<(i32, Mask<S>)> {
        if self.0 == 0 {
            return None;
        }
        let cell = cells[self.0.trailing_zeros() as usize];
        let mut bits = 0;
        for (i, own) in cells.iter().enumerate() {
            bits |= u32::from(*own == cell) << i;
        }
        self.0 &= !bits;
        Some((cell, Mask::from_bitmask(simd, u64::from(bits))))
    }
}

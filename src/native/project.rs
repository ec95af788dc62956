//! The greatest, the least or the mean value that each ray meets in what is kept of a field, in its colour.
//!
//! What lies between two faces is taken for a parabola. Where its top is greater than all before, the field itself is
//! asked there.

use fearless_simd::{Simd, prelude::*};

use super::lanes::{LANES, Lanes, Mask, Vec3, all, any, choose};
use super::lattice::{Lattice, Method, NOTHING};
use super::own::OwnAlong;
use super::rays::{Packet, TILE};
use super::walk::{Pixel, Scene, block_of, corner_of};
use crate::scene::AlongRay;

/// Least depth of three slabs together, in slabs, for all three to be whole.
const WHOLE_SLABS: f32 = 2.99;

impl Scene<'_> {
    /// Draws a tile of values along rays.
    #[inline(always)]
    pub(super) fn projected_tile<S: Simd>(
        &self,
        simd: S,
        method: Method,
        along: AlongRay,
        tile: usize,
        out: &mut [Pixel],
    ) {
        out.fill([0.0; 4]);
        let corner = corner_of(self.rays, tile);
        let side = self.rays.side;
        let share = 1.0 / (side * side) as f32;
        for block in 0..TILE * TILE / LANES as u32 {
            let Some(at) = block_of(self.rays, corner, block) else { continue };
            let [x, y] = [block % 2 * 4, block / 2 * 2];
            for i in 0..side * side {
                let part = [i % side, i / side].map(|n| (n as f32 + 0.5) / side as f32);
                let packet = self.rays.packet(simd, at, part);
                if !any(packet.is_there) {
                    continue;
                }
                let own = self.own_along(simd, method, at, None);
                let (stands, is_met) = self.along_rays(simd, (method, own), along, &packet);
                let look = self.table.look(simd, stands);
                for lane in 0..LANES {
                    if is_met.test(lane) {
                        let at = (y as usize + lane / 4) * TILE as usize + x as usize + lane % 4;
                        let [r, g, b] = look.colour.lane(lane);
                        for (sum, v) in out[at].iter_mut().zip([r, g, b, 1.0]) {
                            *sum += v * share;
                        }
                    }
                }
            }
        }
    }

    /// The cell of the value at a depth, turned about for the minimum: the greatest is looked for.
    #[inline(always)]
    fn turned_value<S: Simd>(
        &self,
        simd: S,
        method: Method,
        packet: &Packet<S>,
        sign: f32,
        t: Lanes<S>,
    ) -> Lanes<S> {
        let place = packet.at(t);
        let stored = self.lattice.value(simd, method, place);
        self.turned(simd, method, sign, (place, stored))
    }

    #[inline(always)]
    fn turned<S: Simd>(
        &self,
        simd: S,
        method: Method,
        sign: f32,
        (place, stored): (Vec3<S>, Lanes<S>),
    ) -> Lanes<S> {
        let mut is_nothing = Lattice::is_nothing(simd, method, stored);
        if self.lattice.ends_within() {
            is_nothing |= self.lattice.is_outside(simd, place);
        }
        choose(is_nothing, all(simd, NOTHING), self.table.cell(simd, stored) * sign)
    }

    /// The cell of the value that stands for each ray, and whether there is one.
    #[inline(always)]
    fn along_rays<S: Simd>(
        &self,
        simd: S,
        (method, mut own): (Method, Option<OwnAlong<'_, S>>),
        along: AlongRay,
        packet: &Packet<S>,
    ) -> (Lanes<S>, Mask<S>) {
        let (zero, one, nothing) = (all(simd, 0.0), all(simd, 1.0), all(simd, NOTHING));
        let sign = if along == AlongRay::Minimum { -1.0 } else { 1.0 };
        let step = self.rays.step;
        let (mut greatest, mut sum, mut total) = (nothing, zero, zero);
        let (mut before, mut near, mut far) = ((nothing, zero), (nothing, zero), (nothing, zero));
        let [first, last] = packet.slabs(simd, step);
        for k in first..=last + 2 {
            let t = all(simd, k as f32 * step).max(packet.enter).min(packet.leave);
            let here = match &mut own {
                Some(own) => {
                    let stored = own.at(simd, packet, (k, 1, last + 2), t).value;
                    self.turned(simd, method, sign, (packet.at(t), stored))
                }
                None => self.turned_value(simd, method, packet, sign, t),
            };
            greatest = greatest.max(choose(packet.is_there, here, nothing));
            let length = far.1 - near.1;
            let mut is_slab =
                near.0.simd_ne(nothing) & far.0.simd_ne(nothing) & length.simd_gt(zero);
            if any(is_slab) && self.lattice.ends_within() {
                let middle = packet.at((near.1 + far.1) * 0.5);
                is_slab &= !self.lattice.is_outside(simd, middle);
            }
            if any(is_slab) {
                let rise = far.0 - near.0;
                let is_whole = (t - before.1).simd_ge(all(simd, WHOLE_SLABS * step));
                let is_whole = is_whole & before.0.simd_ne(nothing) & here.simd_ne(nothing);
                // The mean is that of the cubic through four faces.
                let bend = ((near.0 - before.0) + (far.0 - here)) * (1.0 / 24.0);
                let mean = (near.0 + far.0).mul_add(all(simd, 0.5), choose(is_whole, bend, zero));
                sum = choose(is_slab, mean.mul_add(length, sum), sum);
                total = choose(is_slab, total + length, total);
                if along != AlongRay::Average {
                    // At the ends of the ray, that of the parabola through three.
                    let has_next = here.simd_ne(nothing) & t.simd_gt(far.1);
                    let has_last = before.0.simd_ne(nothing) & near.1.simd_gt(before.1);
                    let growth = rise / choose(is_slab, length, one);
                    let next = (here - far.0) / choose(has_next, t - far.1, one) - growth;
                    let last =
                        growth - (near.0 - before.0) / choose(has_last, near.1 - before.1, one);
                    let third = choose(
                        has_next,
                        next / choose(has_next, t - near.1, one),
                        choose(has_last, last / choose(has_last, far.1 - before.1, one), zero),
                    );
                    let bulge = choose(is_whole, bend, third * length * length * (-1.0 / 6.0));
                    // near (1 − s) + far s + 6 bulge s (1 − s), at its top.
                    let s = rise / (bulge.max(all(simd, 1e-30)) * 12.0) + 0.5;
                    let top = rise.mul_add(s, near.0) + bulge * 6.0 * s * (one - s);
                    let rises = is_slab
                        & bulge.simd_gt(zero)
                        & rise.abs().simd_lt(bulge * 6.0)
                        & top.simd_gt(greatest);
                    if any(rises) {
                        let t = length.mul_add(s, near.1);
                        let asked = self.turned_value(simd, method, packet, sign, t);
                        greatest = greatest.max(choose(rises, asked, nothing));
                    }
                }
            }
            (before, near, far) = (near, far, (here, t));
        }
        match along {
            AlongRay::Average => {
                let is_met = total.simd_gt(zero);
                (sum / choose(is_met, total, one), is_met)
            }
            _ => (greatest * sign, greatest.simd_ne(nothing) & packet.is_there),
        }
    }
}

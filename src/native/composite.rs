//! Compositing of slabs, with what kernels have beside and the surfaces in them, for eight rays at a time.
//!
//! What fills a pixel lies on all of its four samples, and triangles on those that they cover: so edges are smooth, and
//! where two triangles meet in a pixel nothing shows between them. Without triangles one sample stands for all.

use fearless_simd::{Simd, prelude::*};

use super::lanes::{LANES, Lanes, Look, Mask, Vec3, all, any, choose, opacity};
use super::passing::{Passing, Sum};
use super::rays::Packet;
use super::surfaces::{Ahead, EVERY_SAMPLE};
use super::table::Halves;
use super::walk::{Rich, Wants};

/// By what rule slabs become a picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rule {
    /// The value in the middle of a slab is classified, rather than all between its faces.
    pub middle: bool,
    /// Opacity is weight times length, capped, rather than 1 − exp(−depth).
    pub published: bool,
    pub back_to_front: bool,
    /// Transmittance at which rays end.
    pub stop_below: f32,
}

impl Rule {
    /// Lays down what kernels have before one of their slabs; opacities that were lowered to 1. Not inlined: see
    /// `Scene::lay_before`.
    #[inline(never)]
    pub(super) fn lay_kernels<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        passing: &mut Passing<'_, S>,
        slab: i32,
        (light, ahead): (&mut Gathered<S>, &mut Option<Ahead<'_, S>>),
    ) -> u64 {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut capped = 0;
                let none = Halves::none(simd);
                while let Some((at, sum)) = passing.before(simd, slab) {
                    let ts = passing.ends(simd, at);
                    let state = (&mut *light, &mut *ahead);
                    capped += self.lay::<S, Rich>(simd, packet, (&none, Some(sum)), ts, state);
                    if !light.goes_on(simd, self.stop_below) {
                        break;
                    }
                }
                capped
            },
        )
    }

    /// Lays a slab down, with what kernels have beside it and the surfaces in it; opacities that were lowered to 1.
    #[inline(always)]
    pub(super) fn lay<S: Simd, W: Wants>(
        &self,
        simd: S,
        packet: &Packet<S>,
        (found, beside): (&Halves<S>, Option<Sum<S>>),
        ts: [Lanes<S>; 2],
        (light, ahead): (&mut Gathered<S>, &mut Option<Ahead<'_, S>>),
    ) -> u64 {
        let mut length = (ts[1] - ts[0]).abs() * packet.stretch;
        let mut beside = beside.filter(|_| W::MORE);
        let back = W::MORE && self.back_to_front;
        if W::MORE
            && let Some(ahead) = ahead
        {
            let is_met = match back {
                true => ahead.next.simd_ge(ts[1]),
                false => ahead.next.simd_le(ts[1]),
            };
            if any(is_met) {
                let what = (found, beside.as_ref());
                let capped = self.lay_split(what, (length, ts), (light, ahead), is_met);
                ahead.passed(simd);
                let zero = all(simd, 0.0);
                length = choose(is_met, zero, length);
                if let Some(beside) = &mut beside {
                    *beside = Look::choose(is_met, Look::splat(simd, [0.0; 4]), *beside);
                }
                return capped + self.composite::<S, W>(simd, found, (length, beside), light);
            }
        }
        self.composite::<S, W>(simd, found, (length, beside), light)
    }

    /// Composites a slab of so many unit distances, with what kernels have beside.
    #[inline(always)]
    fn composite<S: Simd, W: Wants>(
        &self,
        simd: S,
        found: &Halves<S>,
        (length, beside): (Lanes<S>, Option<Sum<S>>),
        light: &mut Gathered<S>,
    ) -> u64 {
        let back = W::MORE && self.back_to_front;
        if W::MORE && self.published {
            // Opacities are given to slabs: the mean of the two halves.
            let weight = found.weight();
            let share = all(simd, 1.0) / weight.max(all(simd, 1e-30));
            let near = found.near.colour.scaled(found.near.weight);
            let colour = near.add(found.far.colour.scaled(found.far.weight)).scaled(share);
            let halves = if self.middle { 1.0 } else { 0.5 };
            let (colour, amount) = with(simd, colour, weight * halves * length, beside, 1.0);
            return light.cover_capped(simd, colour, amount, back);
        }
        if W::MORE && self.middle {
            let (colour, depth) = (found.near.colour, found.near.weight * length);
            let (colour, depth) = with(simd, colour, depth, beside, 1.0);
            light.cover(colour, opacity(simd, depth), back);
            return 0;
        }
        let half = length * 0.5;
        for look in [&found.near, &found.far] {
            let (colour, depth) = (look.colour, look.weight * half);
            let (colour, depth) =
                if W::MORE { with(simd, colour, depth, beside, 0.5) } else { (colour, depth) };
            light.cover(colour, opacity(simd, depth), back);
        }
        0
    }

    /// Lays a sum of light and depth, or opacity, over what there is, or under it; opacities that were lowered to 1.
    #[inline(always)]
    pub(super) fn cover<S: Simd>(&self, simd: S, sum: &Sum<S>, light: &mut Gathered<S>) -> u64 {
        let share = all(simd, 1.0) / sum.weight.max(all(simd, 1e-30));
        self.cover_with(simd, sum.colour.scaled(share), sum.weight, light)
    }

    /// The same of a colour and a depth, or opacity.
    #[inline(always)]
    pub(super) fn cover_with<S: Simd>(
        &self,
        simd: S,
        colour: Vec3<S>,
        amount: Lanes<S>,
        light: &mut Gathered<S>,
    ) -> u64 {
        if self.published {
            return light.cover_capped(simd, colour, amount, self.back_to_front);
        }
        light.cover(colour, opacity(simd, amount), self.back_to_front);
        0
    }

    /// The same of one ray.
    pub(super) fn cover_ray<S: Simd>(
        &self,
        lane: usize,
        (colour, amount): ([f32; 3], f32),
        light: &mut Gathered<S>,
    ) -> u64 {
        let alpha = if self.published { amount.min(1.0) } else { -(-amount).exp_m1() };
        light.cover_ray(lane, (colour, alpha), EVERY_SAMPLE, self.back_to_front);
        u64::from(self.published && amount > 1.0)
    }

    /// Lays down the surfaces that are left.
    pub(super) fn lay_rest<S: Simd>(&self, light: &mut Gathered<S>, ahead: &mut Ahead<'_, S>) {
        for lane in 0..LANES {
            while let Some(met) = ahead.peek(lane) {
                let look = (met.colour, met.opacity);
                light.cover_ray(lane, look, met.samples, self.back_to_front);
                ahead.pass(lane);
            }
        }
    }

    /// The same of rays that meet surfaces in it, one by one.
    fn lay_split<S: Simd>(
        &self,
        (found, beside): (&Halves<S>, Option<&Sum<S>>),
        (length, ts): (Lanes<S>, [Lanes<S>; 2]),
        (light, ahead): (&mut Gathered<S>, &mut Ahead<'_, S>),
        is_met: Mask<S>,
    ) -> u64 {
        let back = self.back_to_front;
        let mut capped = 0;
        for lane in 0..LANES {
            if !is_met.test(lane) {
                continue;
            }
            let (begin_t, end_t) = (ts[0][lane], ts[1][lane]);
            let span = if end_t == begin_t { 1.0 } else { end_t - begin_t };
            let (near, far) = (found.near.colour.lane(lane), found.far.colour.lane(lane));
            let (near_weight, far_weight) = (found.near.weight[lane], found.far.weight[lane]);
            let kernels = beside.map_or([0.0; 4], |beside| {
                let [r, g, b] = beside.colour.lane(lane);
                [r, g, b, beside.weight[lane]]
            });
            // A part of the field, and a share of what is beside.
            let mut layer = |light: &mut Gathered<S>, colour: [f32; 3], amount: f32, share: f32| {
                let [r, g, b, more] = kernels;
                let [r, g, b, more] = [r * share, g * share, b * share, more * share];
                let sum = amount + more;
                let (colour, amount) = if more > 0.0 {
                    let mixed = |c: usize, light: f32| (colour[c] * amount + light) / sum;
                    ([mixed(0, r), mixed(1, g), mixed(2, b)], sum)
                } else {
                    (colour, amount)
                };
                capped += self.cover_ray(lane, (colour, amount), light);
            };
            // Shares of the slab: what is laid down ends here.
            let mut begin = 0.0_f32;
            loop {
                let is_in = |t: f32| if back { t >= end_t } else { t <= end_t };
                let next = ahead.peek(lane).filter(|met| is_in(met.t));
                let end = next.map_or(1.0, |met| ((met.t - begin_t) / span).clamp(begin, 1.0));
                let (length, share) = (length[lane], end - begin);
                if self.middle {
                    layer(light, near, near_weight * length * share, share);
                } else if self.published {
                    let weight = near_weight + far_weight;
                    let mean = |c: usize| {
                        (near[c] * near_weight + far[c] * far_weight) / weight.max(1e-30)
                    };
                    let amount = 0.5 * weight * length * share;
                    layer(light, [mean(0), mean(1), mean(2)], amount, share);
                } else {
                    let in_near = (end.min(0.5) - begin).max(0.0);
                    let in_far = (end - begin.max(0.5)).max(0.0);
                    layer(light, near, near_weight * length * in_near, in_near);
                    layer(light, far, far_weight * length * in_far, in_far);
                }
                let Some(met) = next else { break };
                light.cover_ray(lane, (met.colour, met.opacity), met.samples, back);
                ahead.pass(lane);
                begin = end;
            }
        }
        capped
    }
}

/// A colour and a depth (or opacity), with a share of what kernels have beside.
#[inline(always)]
fn with<S: Simd>(
    simd: S,
    colour: Vec3<S>,
    amount: Lanes<S>,
    beside: Option<Sum<S>>,
    share: f32,
) -> (Vec3<S>, Lanes<S>) {
    let Some(beside) = beside else { return (colour, amount) };
    let sum = beside.weight.mul_add(all(simd, share), amount);
    let light = colour.scaled(amount).add(beside.colour.scaled(all(simd, share)));
    (light.scaled(all(simd, 1.0) / sum.max(all(simd, 1e-30))), sum)
}

/// What eight rays have gathered so far.
#[derive(Clone, Copy)]
pub(super) struct Gathered<S: Simd> {
    first: Sample<S>,
    /// The other three samples, where triangles are in the tile.
    others: Option<[Sample<S>; 3]>,
}

/// The same of a sample of each.
#[derive(Clone, Copy)]
struct Sample<S: Simd> {
    /// Premultiplied.
    colour: Vec3<S>,
    transmittance: Lanes<S>,
    /// Added up: 1 − transmittance has no digits left where opacities are small.
    alpha: Lanes<S>,
}

impl<S: Simd> Gathered<S> {
    /// Nothing, of the rays that are there; of others nothing will be.
    #[inline(always)]
    pub(super) fn none(simd: S, is_there: Mask<S>, has_triangles: bool) -> Self {
        let zero = all(simd, 0.0);
        let first = Sample {
            colour: Vec3::splat(simd, [0.0; 3]),
            transmittance: choose(is_there, all(simd, 1.0), zero),
            alpha: zero,
        };
        Self { first, others: has_triangles.then_some([first; 3]) }
    }

    /// The rays behind which more can be seen.
    #[inline(always)]
    pub(super) fn is_open(&self, simd: S, stop_below: f32) -> Mask<S> {
        let mut left = self.first.transmittance;
        for other in self.others.iter().flatten() {
            left = left.max(other.transmittance);
        }
        left.simd_ge(all(simd, stop_below))
    }

    #[inline(always)]
    pub(super) fn goes_on(&self, simd: S, stop_below: f32) -> bool {
        any(self.is_open(simd, stop_below))
    }

    /// Premultiplied colour, and opacity: the mean of the samples.
    #[inline(always)]
    pub(super) fn light(&self, simd: S) -> Look<S> {
        let Sample { colour, alpha, .. } = self.first;
        let Some(others) = &self.others else { return Look { colour, weight: alpha } };
        let (mut sum, mut opacity) = (colour, alpha);
        for other in others {
            sum = sum.add(other.colour);
            opacity += other.alpha;
        }
        Look { colour: sum.scaled(all(simd, 0.25)), weight: opacity * 0.25 }
    }

    /// One layer more, of an opacity that may be over 1; how many were.
    #[inline(always)]
    fn cover_capped(
        &mut self,
        simd: S,
        colour: Vec3<S>,
        amount: Lanes<S>,
        back_to_front: bool,
    ) -> u64 {
        let one = all(simd, 1.0);
        self.cover(colour, amount.min(one), back_to_front);
        amount.simd_gt(one).to_bitmask().count_ones().into()
    }

    /// One layer more, of an opacity.
    #[inline(always)]
    fn cover(&mut self, colour: Vec3<S>, opacity: Lanes<S>, back_to_front: bool) {
        self.first.cover(colour, opacity, back_to_front);
        for other in self.others.iter_mut().flatten() {
            other.cover(colour, opacity, back_to_front);
        }
    }

    /// The same of one ray, on some of its samples, a bit for each.
    pub(super) fn cover_ray(
        &mut self,
        lane: usize,
        (colour, opacity): ([f32; 3], f32),
        samples: u8,
        back_to_front: bool,
    ) {
        let all = std::iter::once(&mut self.first).chain(self.others.iter_mut().flatten());
        for (i, sample) in all.enumerate() {
            if samples >> i & 1 == 1 {
                sample.cover_ray(lane, (colour, opacity), back_to_front);
            }
        }
    }
}

impl<S: Simd> Sample<S> {
    #[inline(always)]
    fn cover(&mut self, colour: Vec3<S>, opacity: Lanes<S>, back_to_front: bool) {
        let shown = opacity * self.transmittance;
        if back_to_front {
            let mix = |behind: Lanes<S>, front: Lanes<S>| (front - behind).mul_add(opacity, behind);
            self.colour = Vec3 {
                x: mix(self.colour.x, colour.x),
                y: mix(self.colour.y, colour.y),
                z: mix(self.colour.z, colour.z),
            };
        } else {
            self.colour = self.colour.at(colour, shown);
        }
        self.alpha += shown;
        self.transmittance -= shown;
    }

    fn cover_ray(&mut self, lane: usize, (colour, opacity): ([f32; 3], f32), back_to_front: bool) {
        let shown = opacity * self.transmittance[lane];
        let Vec3 { x, y, z } = &mut self.colour;
        for (sum, front) in [x, y, z].into_iter().zip(colour) {
            if back_to_front {
                sum[lane] += (front - sum[lane]) * opacity;
            } else {
                sum[lane] += front * shown;
            }
        }
        self.alpha[lane] += shown;
        self.transmittance[lane] -= shown;
    }
}

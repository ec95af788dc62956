//! Kernels on their way into a picture, eight rays at a time: laid down one by one, in slices, or shared out among layers.
//!
//! What layers have of kernels is summed up in a ring of these, from the next one to be composited on.

use fearless_simd::{Simd, prelude::*};

use super::among::Among;
use super::composite::{Gathered, Rule};
use super::grid::{Faces, Layering, Part, Shape, least, most};
use super::lanes::{Lanes, Look, Vec3, all, any, choose};
use super::nodes::Nodes;
use super::passing::Sum;
use super::rays::Packet;
use super::samples::SampleLook;
use super::table::Halves;
use super::walk::Rich;
use crate::kernel::{SHARE_FACTORS, SlabShare};

/// More would not be a number of single precision once it is multiplied.
pub(super) const MOST_AMOUNT: f32 = 1e30;

/// Sums of layers, counted in the order of compositing, by their numbers modulo the length of the ring, a power of two.
pub(super) struct Layers<'a, S: Simd> {
    pub ring: &'a mut Vec<Sum<S>>,
    /// The next one to be composited, and the one after the last that anything was added to.
    pub next: i32,
    pub end: i32,
}

impl<S: Simd> Layers<'_, S> {
    #[inline(always)]
    #[expect(clippy::cast_sign_loss, reason = "a remainder")]
    fn at(&mut self, layer: i32) -> &mut Sum<S> {
        let place = (layer as usize) & (self.ring.len() - 1);
        &mut self.ring[place]
    }
}

/// What eight rays lay down, and into what.
pub(super) struct Laying<'a, 'k, S: Simd> {
    pub simd: S,
    pub rule: Rule,
    pub shape: &'a Shape,
    pub layering: Layering,
    pub packet: &'a Packet<S>,
    /// What lies before this depth is not seen, where kernels are cut there.
    pub eye: Option<Lanes<S>>,
    pub faces: Faces<S>,
    /// Of a slice.
    pub sum: Sum<S>,
    pub layers: Layers<'a, S>,
    pub light: &'a mut Gathered<S>,
    pub among: &'a mut Among<'k, S>,
    /// Opacities that were over 1, and lowered to it.
    pub capped: u64,
}

impl<S: Simd> Laying<'_, '_, S> {
    /// Takes a kernel in.
    #[inline(always)]
    pub(super) fn add(&mut self, look: &SampleLook, part: Part<S>) {
        let simd = self.simd;
        let [r, g, b, weight] = *look;
        let zero = all(simd, 0.0);
        let amount = (part.amount * weight).min(all(simd, MOST_AMOUNT));
        let mut amount = choose(part.is_hit, amount, zero);
        let colour = Vec3::splat(simd, [r, g, b]);
        match self.layering {
            Layering::Sample | Layering::Slice => {
                if let (Shape::Radial(_, shares), Some(eye)) = (self.shape, self.eye)
                    && any(part.is_hit & eye.simd_gt(part.middle - part.half))
                {
                    // Behind the eye there is nothing of it.
                    let factors = factors(simd, shares, part.q);
                    let place = (eye - part.middle) / part.half;
                    // Rounding must not take anything away.
                    let left = all(simd, 1.0) - share(simd, &factors, place);
                    amount *= left.max(zero);
                }
                if self.layering == Layering::Sample {
                    self.capped += self.rule.cover_with(simd, colour, amount, self.light);
                } else {
                    self.sum.colour = self.sum.colour.at(colour, amount);
                    self.sum.weight += amount;
                }
            }
            Layering::Sheets | Layering::Slabs => self.share_out(colour, amount, part),
        }
    }

    /// Shares a kernel out among the layers that it lies in.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "saturates")]
    fn share_out(&mut self, colour: Vec3<S>, amount: Lanes<S>, part: Part<S>) {
        let simd = self.simd;
        let light = colour.scaled(amount);
        let back = self.rule.back_to_front;
        let Part { is_hit, q, middle, half, .. } = part;
        let ends = [self.faces.place(middle - half), self.faces.place(middle + half)];
        if let Shape::Point = self.shape {
            let place = ends[0].floor();
            let layer = least(simd, is_hit, place) as i32;
            return self.give(if back { -layer } else { layer }, light, amount, all(simd, 1.0));
        }
        let near = least(simd, is_hit, ends[0]).floor() as i32;
        let far = most(simd, is_hit, ends[1]).floor() as i32;
        let one = all(simd, 1.0);
        let begin = match self.eye {
            Some(eye) => ((eye - middle) / half).max(-one).min(one),
            None => -one,
        };
        let per_half = one / half;
        let factors = match self.shape {
            Shape::Radial(_, shares) => Some(factors(simd, shares, q)),
            _ => None,
        };
        let mut place = (self.faces.at(simd, near) - middle) * per_half;
        let step = (self.faces.at(simd, 1) - self.faces.at(simd, 0)) * per_half;
        let mut before = self.share(factors.as_ref(), place.max(begin).min(one));
        for layer in near..=far {
            place += step;
            let behind = self.share(factors.as_ref(), place.max(begin).min(one));
            // Rounding must not take anything away: what is divided by later would be of either sign.
            let share = (behind - before).max(all(simd, 0.0));
            before = behind;
            self.give(if back { -layer } else { layer }, light, amount, share);
        }
    }

    #[inline(always)]
    fn share(&self, factors: Option<&[Lanes<S>; SHARE_FACTORS]>, place: Lanes<S>) -> Lanes<S> {
        match factors {
            Some(factors) => share(self.simd, factors, place),
            None => place.mul_add(all(self.simd, 0.5), all(self.simd, 0.5)),
        }
    }

    /// Gives a layer a share of a kernel.
    #[inline(always)]
    fn give(&mut self, layer: i32, light: Vec3<S>, amount: Lanes<S>, share: Lanes<S>) {
        // By rounding it may begin before the last layer that was composited.
        let last = self.layers.next.saturating_add(self.layers.ring.len() as i32 - 1);
        let layer = layer.clamp(self.layers.next, last);
        let sum = self.layers.at(layer);
        sum.colour = sum.colour.at(light, share);
        sum.weight = amount.mul_add(share, sum.weight);
        self.layers.end = self.layers.end.max(layer + 1);
    }

    /// Lays down the layers up to one.
    #[inline(always)]
    pub(super) fn lay_until(&mut self, until: i32) {
        while self.layers.next < until && self.layers.next < self.layers.end {
            let layer = self.layers.next;
            let none = Look::splat(self.simd, [0.0; 4]);
            let sum = std::mem::replace(self.layers.at(layer), none);
            self.layers.next += 1;
            self.lay_layer(layer, &sum);
        }
        self.layers.next = self.layers.next.max(until);
    }

    /// Lays down what a layer has, with what lies in it.
    #[inline(always)]
    pub(super) fn lay_layer(&mut self, layer: i32, sum: &Sum<S>) {
        let simd = self.simd;
        if self.among.is_none() {
            self.capped += self.rule.cover(simd, sum, self.light);
            return;
        }
        let back = self.rule.back_to_front;
        let nearer = if back { -layer } else { layer };
        let ends = [nearer, nearer + 1].map(
            #[inline(always)]
            |face| {
                let at = self.faces.at(simd, face);
                self.eye.map_or(at, |eye| at.max(eye))
            },
        );
        let ends = if back { [ends[1], ends[0]] } else { ends };
        if self.layering == Layering::Sheets {
            let what = (sum, ends);
            self.capped += self.among.lay_between(simd, &self.rule, what, self.light);
            return;
        }
        let mut sum = *sum;
        let Among { passing, ahead, .. } = &mut *self.among;
        if let Some(passing) = passing {
            let of_kernels = passing.slab_of(nearer);
            let state = (&mut *self.light, &mut *ahead);
            self.capped += self.rule.lay_kernels(simd, self.packet, passing, of_kernels, state);
            if let Some(beside) = passing.take(simd, of_kernels) {
                sum.colour = sum.colour.add(beside.colour);
                sum.weight += beside.weight;
            }
        }
        let what = (&Halves::none(simd), Some(sum));
        self.capped +=
            self.rule.lay::<S, Rich>(simd, self.packet, what, ends, (&mut *self.light, ahead));
    }

    /// Lays down kernels of lists, by their numbers.
    #[inline(always)]
    pub(super) fn lay_nodes(&mut self, nodes: &Nodes, list: &[u32]) {
        let in_slabs = self.layering == Layering::Slabs;
        if in_slabs {
            let none = Look::splat(self.simd, [0.0; 4]);
            self.layers.ring.clear();
            self.layers.ring.resize(nodes.most_slabs.next_power_of_two() as usize, none);
        }
        for &node in list {
            let Some(part) = nodes.part(self.simd, node, self.packet) else { continue };
            if in_slabs {
                // No later one begins before it.
                self.lay_until(nodes.slabs_of(node)[0]);
            }
            self.add(nodes.look(node), part);
            if !self.goes_on() {
                return;
            }
        }
        if in_slabs {
            self.lay_until(i32::MAX);
        }
    }

    /// Whether anything behind can be seen.
    #[inline(always)]
    pub(super) fn goes_on(&self) -> bool {
        self.light.goes_on(self.simd, self.rule.stop_below)
    }

    /// Lays a slice down.
    #[inline(always)]
    pub(super) fn lay_slice(&mut self) {
        let sum = std::mem::replace(&mut self.sum, Look::splat(self.simd, [0.0; 4]));
        self.capped += self.rule.cover(self.simd, &sum, self.light);
    }
}

/// The factors of a share (`kernel::SlabShare`) at a squared distance.
#[inline(always)]
fn factors<S: Simd>(simd: S, share: &SlabShare, q: Lanes<S>) -> [Lanes<S>; SHARE_FACTORS] {
    let mut found = [all(simd, 0.0); SHARE_FACTORS];
    for (found, [a, b, c, d]) in found.iter_mut().zip(share.factors) {
        let high = q.mul_add(all(simd, d), all(simd, c));
        *found = q.mul_add(q.mul_add(high, all(simd, b)), all(simd, a));
    }
    found
}

/// The part of a kernel that lies before a place, in half chords of the line.
#[inline(always)]
fn share<S: Simd>(simd: S, factors: &[Lanes<S>; SHARE_FACTORS], place: Lanes<S>) -> Lanes<S> {
    let one = all(simd, 1.0);
    let place = place.max(-one).min(one);
    let x = place * place;
    let mut sum = factors[SHARE_FACTORS - 1];
    for factor in factors.iter().rev().skip(1) {
        sum = sum.mul_add(x, *factor);
    }
    sum.mul_add(place, all(simd, 0.5))
}

//! What lies among samples that are laid down one by one, or in slices or sheets: triangles, and slabs of the kernels of
//! lists, each of these in its middle.

use std::collections::VecDeque;

use fearless_simd::{Simd, prelude::*};

use super::composite::{Gathered, Rule};
use super::lanes::{LANES, Lanes, Look, Mask, all, any, choose};
use super::passing::{EVERY_SLAB, Passing, Sum};
use super::surfaces::Ahead;

/// After everything.
pub(super) const BEYOND_ALL: f32 = 3e38;

/// What eight rays have ahead of them.
pub(super) struct Among<'a, S: Simd> {
    pub ahead: Option<Ahead<'a, S>>,
    pub passing: Option<Passing<'a, S>>,
    /// Slabs that some rays have not come to yet.
    waiting: VecDeque<Slab<S>>,
}

/// What a slab has of kernels.
struct Slab<S: Simd> {
    middle: f32,
    sum: Sum<S>,
    /// Rays that have not come to it.
    left: Mask<S>,
}

impl<'a, S: Simd> Among<'a, S> {
    #[inline(always)]
    pub(super) fn new(ahead: Option<Ahead<'a, S>>, passing: Option<Passing<'a, S>>) -> Self {
        Self { ahead, passing, waiting: VecDeque::new() }
    }

    /// Whether there is nothing.
    pub(super) fn is_none(&self) -> bool {
        self.ahead.is_none() && self.passing.is_none()
    }

    /// Whether one depth comes before another.
    #[inline(always)]
    fn is_before(rule: &Rule, a: Lanes<S>, b: Lanes<S>) -> Mask<S> {
        if rule.back_to_front { b.simd_lt(a) } else { a.simd_lt(b) }
    }

    /// Has all slabs at hand whose middles come before the last of some depths.
    #[expect(clippy::cast_possible_truncation, reason = "saturates")]
    fn look_ahead(&mut self, simd: S, rule: &Rule, depths: Lanes<S>) {
        let Some(passing) = &mut self.passing else { return };
        let back = rule.back_to_front;
        let farthest = if back { -depths.reduce_min() } else { depths.reduce_max() };
        let thickness = passing.thickness();
        let until = match farthest >= BEYOND_ALL {
            true => EVERY_SLAB,
            // In the order of compositing: far to near slab n lies at −n.
            false => (farthest / thickness - if back { -0.5 } else { 0.5 }).ceil() as i32,
        };
        while let Some((slab, sum)) = passing.before(simd, until) {
            let nearer = if back { -slab } else { slab } as f32;
            let middle = (nearer + 0.5) * thickness;
            self.waiting.push_back(Slab { middle, sum, left: Mask::splat(simd, true) });
        }
    }

    /// Lays down what comes before the depth of each ray; opacities that were lowered to 1.
    pub(super) fn lay_until(
        &mut self,
        simd: S,
        rule: &Rule,
        depths: Lanes<S>,
        light: &mut Gathered<S>,
    ) -> u64 {
        self.look_ahead(simd, rule, depths);
        let mut capped = 0;
        for i in 0..self.waiting.len() {
            let Slab { middle, sum, left } = &self.waiting[i];
            let middle = all(simd, *middle);
            let due = *left & Self::is_before(rule, middle, depths);
            if !any(due) {
                continue;
            }
            let due_sum = Look::choose(due, *sum, Look::splat(simd, [0.0; 4]));
            self.lay_triangles(simd, rule, middle, due, light);
            capped += rule.cover(simd, &due_sum, light);
            self.waiting[i].left &= !due;
        }
        while self.waiting.front().is_some_and(|slab| !any(slab.left)) {
            self.waiting.pop_front();
        }
        self.lay_triangles(simd, rule, depths, Mask::splat(simd, true), light);
        capped
    }

    /// Lays down the triangles of some rays up to a depth.
    fn lay_triangles(
        &mut self,
        simd: S,
        rule: &Rule,
        depths: Lanes<S>,
        of: Mask<S>,
        light: &mut Gathered<S>,
    ) {
        let Some(ahead) = &mut self.ahead else { return };
        let due = of & !Self::is_before(rule, depths, ahead.next);
        if !any(due) {
            return;
        }
        for lane in (0..LANES).filter(|&lane| due.test(lane)) {
            let is_due = |t: f32| match rule.back_to_front {
                true => t >= depths[lane],
                false => t <= depths[lane],
            };
            while let Some(met) = ahead.peek(lane).filter(|met| is_due(met.t)) {
                light.cover_ray(lane, (met.colour, met.opacity), met.samples, rule.back_to_front);
                ahead.pass(lane);
            }
        }
        ahead.passed(simd);
    }

    /// Lays down what is as dense everywhere between two depths, the first on the way first, with what lies there.
    pub(super) fn lay_between(
        &mut self,
        simd: S,
        rule: &Rule,
        (sum, ends): (&Sum<S>, [Lanes<S>; 2]),
        light: &mut Gathered<S>,
    ) -> u64 {
        self.look_ahead(simd, rule, ends[1]);
        let mut met = Mask::splat(simd, false);
        if let Some(ahead) = &self.ahead {
            met |= !Self::is_before(rule, ends[1], ahead.next);
        }
        for slab in &self.waiting {
            let middle = all(simd, slab.middle);
            met |= slab.left & Self::is_before(rule, middle, ends[1]);
        }
        let none = Look::splat(simd, [0.0; 4]);
        let mut capped = rule.cover(simd, &Look::choose(met, none, *sum), light);
        for lane in (0..LANES).filter(|&lane| met.test(lane)) {
            capped += self.lay_ray(rule, lane, (sum, ends), light);
        }
        if let Some(ahead) = &mut self.ahead {
            ahead.passed(simd);
        }
        while self.waiting.front().is_some_and(|slab| !any(slab.left)) {
            self.waiting.pop_front();
        }
        capped
    }

    /// The same of one ray.
    fn lay_ray(
        &mut self,
        rule: &Rule,
        lane: usize,
        (sum, ends): (&Sum<S>, [Lanes<S>; 2]),
        light: &mut Gathered<S>,
    ) -> u64 {
        let (begin, end) = (ends[0][lane], ends[1][lane]);
        let back = rule.back_to_front;
        let span = if end == begin { 1.0 } else { end - begin };
        let weight = sum.weight[lane];
        let colour = sum.colour.lane(lane).map(|light| light / weight.max(1e-30));
        let mut laid = 0.0_f32;
        let mut capped = 0;
        let is_in = |t: f32| if back { t >= end } else { t <= end };
        loop {
            let triangle = self.ahead.as_ref().and_then(|ahead| ahead.peek(lane));
            let triangle = triangle.filter(|met| is_in(met.t));
            let is_due = |slab: &&mut Slab<S>| slab.left.test(lane) && is_in(slab.middle);
            let slab = self.waiting.iter_mut().find(is_due);
            let first = match (triangle, &slab) {
                (Some(met), Some(slab)) if back => met.t.max(slab.middle),
                (Some(met), Some(slab)) => met.t.min(slab.middle),
                (Some(met), None) => met.t,
                (None, Some(slab)) => slab.middle,
                (None, None) => end,
            };
            let share = if first == end { 1.0 } else { (first - begin) / span };
            let share = share.clamp(laid, 1.0);
            capped += rule.cover_ray(lane, (colour, weight * (share - laid)), light);
            laid = share;
            match (triangle, slab) {
                (Some(met), _) if met.t == first => {
                    light.cover_ray(lane, (met.colour, met.opacity), met.samples, back);
                    if let Some(ahead) = &mut self.ahead {
                        ahead.pass(lane);
                    }
                }
                (_, Some(slab)) => {
                    let weight = slab.sum.weight[lane];
                    let colour = slab.sum.colour.lane(lane).map(|c| c / weight.max(1e-30));
                    capped += rule.cover_ray(lane, (colour, weight), light);
                    slab.left.set(lane, false);
                }
                _ => return capped + rule.cover_ray(lane, (colour, weight * (1.0 - laid)), light),
            }
        }
    }

    /// Lays down all that is left.
    pub(super) fn lay_rest(&mut self, simd: S, rule: &Rule, light: &mut Gathered<S>) -> u64 {
        let end = if rule.back_to_front { -BEYOND_ALL } else { BEYOND_ALL };
        self.lay_until(simd, rule, all(simd, end), light)
    }
}

/// A share of a choice between two depths that is far off either way.
#[inline(always)]
pub(super) fn beyond<S: Simd>(simd: S, is_far: Mask<S>) -> Lanes<S> {
    choose(is_far, all(simd, BEYOND_ALL), all(simd, -BEYOND_ALL))
}

//! Sums of basis functions along rays: each function lands on the tiles of the picture that it reaches, and eight rays
//! go through the list of their tile together, for many faces of slabs at a time.
//!
//! Along a ray a Gaussian is one again, exp(−(m + a τ²)/2): m is how near the ray comes, and τ the distance from there. At
//! faces that lie evenly apart each value is the last one times a ratio, which itself shrinks by a constant ratio: two
//! products a face, and no exponential. A function ends where φ has fallen to a value of its own, which is compared with φ.
//!
//! Where rays are parallel a is the function's, m is a square of its place on the screen, and τ begins at a depth that is
//! linear in that ([`Seen`]).

use fearless_simd::{Simd, prelude::*};

use super::functions::{Functions, basis_of, covered, mean};
use super::landed::{Entry, block_bit};
use super::lanes::{LANES, Lanes, Mask, Vec3, all, any, choose, exponential, logarithm};
use super::own::{Found, no_border, widen_border};
use super::rays::{Packet, Rays};
use super::seen::{Landing, Seen};
use super::window::{Ends, FACES, Here, Window};
use crate::rbf::Basis;
use crate::scene::Classify;

/// Products go from face to face as long as no ray begins so far down a function's flank, as an exponent.
const STEEPEST: f32 = 20.0;

/// Steps towards the place where a mean ends, at most, and how far off 1 coverage may be there.
const STEPS: usize = 12;
const NEAR: f32 = 1e-5;
/// Places of a slab, as shares of it, at which it is looked for a mean that neither face has: those of the device.
const LOOKS: [f32; 9] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];

/// Gaussians that are made ready before they are added.
const READY: usize = 16;

/// A place of rays, and what a mean has there.
#[derive(Clone, Copy)]
struct Covered<S: Simd> {
    t: Lanes<S>,
    cover: Lanes<S>,
    value: Lanes<S>,
}

impl<S: Simd> Covered<S> {
    #[inline(always)]
    fn choose(mask: Mask<S>, yes: Self, no: Self) -> Self {
        Self {
            t: choose(mask, yes.t, no.t),
            cover: choose(mask, yes.cover, no.cover),
            value: choose(mask, yes.value, no.value),
        }
    }
}

/// What of a slab counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asked {
    /// The value on its face.
    Faces,
    /// The value in its middle.
    Middles,
    /// The mean of its values.
    Means,
}

impl Asked {
    pub(super) fn of(classify: Classify) -> Self {
        match classify {
            Classify::Before | Classify::PreIntegrated => Self::Faces,
            Classify::After => Self::Middles,
            Classify::Mean => Self::Means,
        }
    }

    /// How far behind its slab's face rays look, in slabs, if only at one depth of each.
    pub(super) fn shift(self) -> Option<f32> {
        match self {
            Self::Faces => Some(0.0),
            Self::Middles => Some(0.5),
            Self::Means => None,
        }
    }
}

/// The values of eight rays, at some faces (middles, means) after one another.
pub(super) struct Sums<'a, S: Simd> {
    functions: &'a Functions,
    seen: &'a [Seen],
    list: &'a [Entry],
    /// The block's bit in entries.
    block: u8,
    rays: &'a Rays,
    window: Window,
    ends: Ends<S>,
    values: [Lanes<S>; FACES + 1],
    /// Of functions that are weighed against each other: Σ h φ of those that are no holes, the coverage, and see
    /// [`Found::border`]. Of the face behind the last as well.
    totals: [Lanes<S>; FACES + 1],
    coverages: [Lanes<S>; FACES + 1],
    borders: [[Lanes<S>; 4]; FACES],
}

/// A function along eight rays, lengths in steps: exp(−(near + a τ²)/2) or its like, τ from `middle`.
#[derive(Clone, Copy)]
struct Along<'a, S: Simd> {
    seen: &'a Seen,
    middle: Lanes<S>,
    near: Lanes<S>,
    a: Lanes<S>,
    /// exp(−a/2), of Gaussians.
    fall: Lanes<S>,
    /// Where about the middles are, and between which depths any ray meets it.
    about: f32,
    between: [f32; 2],
}

/// A Gaussian along eight rays, made ready to be added: its values at a face in its middle, by what they grow from there to the next
/// one and to the one before, and by what that shrinks from face to face.
#[derive(Clone, Copy)]
struct Ready<S: Simd> {
    start: Lanes<S>,
    up: Lanes<S>,
    down: Lanes<S>,
    shrinking: Lanes<S>,
    end: f32,
    weight: f32,
    height: f32,
    /// The first face, the one in the middle and the last one.
    faces: [u8; 3],
}

impl<S: Simd> Ready<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        let [start, up, down, shrinking] = [all(simd, 0.0); 4];
        Self { start, up, down, shrinking, end: 0.0, weight: 0.0, height: 0.0, faces: [0; 3] }
    }
}

/// The faces between two depths in steps, the first rounded as said, up to a last one; `None` where there is none.
#[inline(always)]
fn faces_from([low, high]: [f32; 2], rounded: fn(f32) -> f32, last: f32) -> Option<[usize; 2]> {
    let (low, high) = (rounded(low).max(0.0), high.floor().min(last));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=32")]
    let faces = [low as usize, high as usize];
    (low <= high).then_some(faces)
}

impl<S: Simd> Along<'_, S> {
    /// How far on either side of the middle each ray meets it; less than 0 of those that do not.
    #[inline(always)]
    fn half(&self, simd: S) -> Lanes<S> {
        let left = all(simd, self.seen.reach) - self.near;
        let is_met = left.simd_ge(all(simd, 0.0));
        choose(is_met, (choose(is_met, left, all(simd, 0.0)) / self.a).sqrt(), all(simd, -1.0))
    }
}

impl<'a, S: Simd> Sums<'a, S> {
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        (functions, landing): (&'a Functions, &'a Landing),
        (rays, at): (&'a Rays, [u32; 2]),
        asked: Asked,
    ) -> Self {
        Self {
            functions,
            seen: &landing.seen,
            list: landing.landed.on(at),
            block: block_bit(at),
            rays,
            window: Window::new(asked, rays.step),
            ends: Ends::new(),
            values: [all(simd, 0.0); FACES + 1],
            totals: [all(simd, 0.0); FACES + 1],
            coverages: [all(simd, 0.0); FACES + 1],
            borders: [no_border(simd); FACES],
        }
    }

    /// What lies at face `k`, at depths `t` (in the middle of the slab that begins there; its mean). Others that are asked
    /// for next lie in the direction of `way`, as far as `last`. At the borders of the lattice faces and middles are not
    /// where they would be elsewhere.
    #[inline(always)]
    pub(super) fn at(
        &mut self,
        simd: S,
        packet: &Packet<S>,
        which: (i32, i32, i32),
        t: Lanes<S>,
    ) -> Found<S> {
        if self.window.is_moved_to(which) {
            self.fill(simd, packet);
        }
        let (k, ..) = which;
        let i = self.window.index(k);
        let (value, border) = (self.values[i], self.borders[i]);
        let mut found = Found { value, growth: None, border, border_growths: None };
        if self.window.asked == Asked::Means {
            return found;
        }
        let is_elsewhere = self.window.is_elsewhere(simd, packet, k, t);
        if any(is_elsewhere) {
            let functions = self.functions;
            let other = Here { value: found.value, growth: None };
            let here = self.ends.put(
                packet,
                (t, is_elsewhere),
                other,
                #[inline(always)]
                |place| Here { value: functions.value(simd, place), growth: None },
            );
            found.value = here.value;
        }
        found
    }

    /// A function of the list along the rays; between no depths where none of them meets it.
    #[inline(always)]
    fn along(&self, simd: S, packet: &Packet<S>, seen: &'a Seen) -> Along<'a, S> {
        let (reach, [x, y, depth]) = (all(simd, seen.reach), seen.centre);
        let ([xx, xy, yy], [zx, zy, zz]) = (seen.across, seen.deep);
        // Seen from its own depth: far from there the squares would leave few digits to their difference.
        let grown = self.rays.scale_at(depth);
        let [right, up] = [packet.screen[0] * grown - x, packet.screen[1] * grown - y];
        let first = right.mul_add(all(simd, xx), up * xy);
        let second = up * yy;
        let per_step = 1.0 / self.window.step;
        if self.rays.growth == 0.0 {
            let near = first.mul_add(first, second * second);
            let nearest = near.reduce_min();
            let [by_x, by_y] = seen.tilt;
            let depths = up.mul_add(all(simd, by_y), all(simd, depth * per_step));
            let middle = right.mul_add(all(simd, by_x), depths);
            let about = 0.5 * (middle[0] + middle[LANES - 1]);
            let is_met = nearest < seen.reach;
            let beyond = if is_met { seen.reaches(nearest) } else { f32::NEG_INFINITY };
            let between = [about - beyond, about + beyond];
            let (a, fall) = (all(simd, seen.a), all(simd, seen.fall));
            return Along { seen, middle, near, a, fall, about, between };
        }
        let growth = self.rays.growth;
        let [by_x, by_y] = [packet.screen[0] * growth, packet.screen[1] * growth];
        let from = Vec3 { x: first, y: second, z: right.mul_add(all(simd, zx), up * zy) };
        let direction = Vec3 {
            x: by_x.mul_add(all(simd, xx), by_y * xy),
            y: by_y * yy,
            z: by_x.mul_add(all(simd, zx), by_y.mul_add(all(simd, zy), all(simd, zz))),
        };
        let a = direction.dot(direction);
        let t = -(direction.dot(from)) / a;
        let nearest = from.at(direction, t);
        let near = nearest.dot(nearest);
        let is_met = near.simd_lt(reach);
        let middle = (t + depth) * per_step;
        let a = a * (self.window.step * self.window.step);
        let mut found = Along { seen, middle, near, a, fall: a, about: 0.0, between: [0.0; 2] };
        let (half, far) = (found.half(simd), all(simd, 1e9));
        let low = choose(is_met, middle - half, far).reduce_min();
        let high = choose(is_met, middle + half, -far).reduce_max();
        (found.about, found.between) = (0.5 * (low + high), [low, high]);
        found.fall = exponential(simd, a * -0.5);
        found
    }

    /// Sums up at all faces that are to be there. Not inlined: few ask, and for many faces.
    #[inline(never)]
    fn fill(&mut self, simd: S, packet: &Packet<S>) {
        simd.vectorize(
            #[inline(always)]
            || match self.functions.is_mean() {
                true => {
                    self.sum_up::<true>(simd, packet);
                    self.weigh(simd, packet);
                }
                false => self.sum_up::<false>(simd, packet),
            },
        );
    }

    #[inline(always)]
    fn sum_up<const MEAN: bool>(&mut self, simd: S, packet: &Packet<S>) {
        let step = self.window.step;
        let count = self.window.len() + usize::from(MEAN);
        self.values[..count].fill(all(simd, 0.0));
        if MEAN {
            self.totals[..count].fill(all(simd, 0.0));
            self.coverages[..count].fill(all(simd, 0.0));
        }
        let first = self.window.begin();
        let of_means = self.window.asked == Asked::Means;
        // Of means, from the first face to the last.
        let beyond = if of_means { 0.0 } else { 1.0 };
        let depths = [first * step, (first + (count as f32 - beyond)) * step];
        let last = (count - 1) as f32;
        match self.functions.basis() {
            _ if of_means => self.each(
                simd,
                (packet, depths),
                #[inline(always)]
                |sums, along| {
                    let [low, high] = along.between;
                    if let Some(faces) = faces_from([low - first, high - first], f32::floor, last) {
                        sums.add_means(simd, packet, along, faces);
                    }
                },
            ),
            Basis::Multiquadric => self.each(
                simd,
                (packet, depths),
                #[inline(always)]
                |sums, along| {
                    let [low, high] = along.between;
                    if let Some(faces) = faces_from([low - first, high - first], f32::ceil, last) {
                        sums.add_each::<MEAN>(simd, (along.middle - first, along), faces);
                    }
                },
            ),
            Basis::Gaussian | Basis::Ellipsoid => {
                self.add_gaussians::<MEAN>(simd, (packet, depths), (first, last));
            }
        }
    }

    /// Calls `visit` with each function that may be met between two depths.
    #[inline(always)]
    fn each(
        &mut self,
        simd: S,
        (packet, depths): (&Packet<S>, [f32; 2]),
        mut visit: impl FnMut(&mut Self, &Along<'_, S>),
    ) {
        let (list, seen, block) = (self.list, self.seen, self.block);
        for entry in list.iter().filter(|entry| entry.may_be_met(block, depths)) {
            let along = self.along(simd, packet, &seen[entry.number as usize]);
            visit(self, &along);
        }
    }

    /// Adds all Gaussians of the list: some are made ready, one like the other, and these are added. The ends of loops over faces are
    /// known long before these begin, as nothing in between depends on them.
    #[inline(always)]
    fn add_gaussians<const MEAN: bool>(
        &mut self,
        simd: S,
        (packet, depths): (&Packet<S>, [f32; 2]),
        (first, last): (f32, f32),
    ) {
        let zero = all(simd, 0.0);
        let (list, seen, block) = (self.list, self.seen, self.block);
        let mut ready = [Ready::none(simd); READY];
        let mut count = 0;
        for entry in list.iter().filter(|entry| entry.may_be_met(block, depths)) {
            let seen = &seen[entry.number as usize];
            let along = self.along(simd, packet, seen);
            let low = (along.between[0] - first).ceil().max(0.0);
            let high = (along.between[1] - first).floor().min(last);
            if low > high {
                continue;
            }
            let begin = (along.about - first).round_ties_even().max(low).min(high);
            let middle = along.middle - first;
            let is_met = along.near.simd_lt(all(simd, seen.reach));
            // About the middle of the block: those of all rays that meet it lie near, or products go too far down a flank.
            let off = all(simd, begin) - middle;
            let slope = off * along.a;
            let square = off * slope;
            if any(is_met & square.simd_gt(all(simd, 2.0 * STEEPEST))) {
                // Rays that meet it at far-away depths.
                if let Some(faces) = faces_from([low, high], f32::ceil, last) {
                    self.add_each::<MEAN>(simd, (middle, &along), faces);
                }
                continue;
            }
            // Rays that do not meet it have nothing of it, whatever their ratios are.
            let start = choose(is_met, exponential(simd, (square + along.near) * -0.5), zero);
            let growth = exponential(simd, -slope);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..32")]
            let faces = [low as u8, begin as u8, high as u8];
            let (up, down) = (along.fall * growth, along.fall / growth);
            let shrinking = along.fall * along.fall;
            let Seen { end, weight, height, .. } = *seen;
            ready[count] = Ready { start, up, down, shrinking, end, weight, height, faces };
            count += 1;
            if count == READY {
                self.add_ready::<MEAN>(simd, &ready);
                count = 0;
            }
        }
        self.add_ready::<MEAN>(simd, &ready[..count]);
    }

    /// Adds what Gaussians have at their faces, by products from one in the middle to both sides.
    #[inline(always)]
    fn add_ready<const MEAN: bool>(&mut self, simd: S, ready: &[Ready<S>]) {
        for one in ready {
            let [low, begin, high] = [one.faces[0], one.faces[1], one.faces[2]];
            let (low, begin, high) = (usize::from(low), usize::from(begin), usize::from(high));
            let of = (one.end, one.weight, one.height);
            let (shrinking, end) = (one.shrinking, all(simd, one.end));
            let (weight, zero) = (all(simd, one.weight), all(simd, 0.0));
            let (mut value, mut ratio) = (one.start, one.up);
            if MEAN {
                for i in begin..high + 1 {
                    self.add::<MEAN>(simd, i, value, of);
                    value *= ratio;
                    ratio *= shrinking;
                }
            } else {
                for sum in &mut self.values[begin..high + 1] {
                    let phi = choose(value.simd_ge(end), value, zero);
                    *sum = phi.mul_add(weight, *sum);
                    value *= ratio;
                    ratio *= shrinking;
                }
            }
            let mut ratio = one.down;
            let mut value = one.start * ratio;
            if MEAN {
                for i in (low..begin).rev() {
                    ratio *= shrinking;
                    self.add::<MEAN>(simd, i, value, of);
                    value *= ratio;
                }
            } else {
                for sum in self.values[low..begin].iter_mut().rev() {
                    ratio *= shrinking;
                    let phi = choose(value.simd_ge(end), value, zero);
                    *sum = phi.mul_add(weight, *sum);
                    value *= ratio;
                }
            }
        }
    }

    /// Adds what a function has at a face to the rays that it reaches there.
    #[inline(always)]
    fn add<const MEAN: bool>(
        &mut self,
        simd: S,
        i: usize,
        phi: Lanes<S>,
        (end, weight, height): (f32, f32, f32),
    ) {
        let within = phi.simd_ge(all(simd, end));
        if !MEAN {
            let phi = choose(within, phi, all(simd, 0.0));
            self.values[i] = phi.mul_add(all(simd, weight), self.values[i]);
            return;
        }
        let phi = choose(within, (phi - self.functions.end()) * height, all(simd, 0.0));
        self.coverages[i] += phi;
        if height >= 0.0 {
            self.totals[i] += phi;
            self.values[i] = phi.mul_add(all(simd, weight), self.values[i]);
        }
    }

    /// Makes means of sums, and finds where rays pass the border of a mean in slabs of which a face has none.
    #[inline(always)]
    fn weigh(&mut self, simd: S, packet: &Packet<S>) {
        let count = self.window.len();
        for i in 0..=count {
            self.values[i] = mean(simd, self.values[i], self.totals[i]);
        }
        if self.window.asked == Asked::Faces {
            for i in 0..count {
                self.borders[i] = self.border_of(simd, packet, i);
            }
        }
        for i in 0..count {
            self.values[i] = covered(simd, self.values[i], self.coverages[i]);
        }
    }

    /// Where rays pass the border in a slab, and the values there.
    #[inline(always)]
    fn border_of(&self, simd: S, packet: &Packet<S>, i: usize) -> [Lanes<S>; 4] {
        let mut border = no_border(simd);
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let first = self.window.begin() + i as f32;
        let mut ends = [Covered { t: zero, cover: zero, value: zero }; 2];
        for (side, end) in ends.iter_mut().enumerate() {
            let whole = all(simd, (first + side as f32) * self.window.step);
            let t = whole.max(packet.enter).min(packet.leave);
            let (mut value, mut cover) = (self.values[i + side], self.coverages[i + side]);
            let is_elsewhere = !t.simd_eq(whole) & packet.is_there;
            if any(is_elsewhere) {
                let (found, there) = self.functions.weighed(simd, packet.at(t));
                value = choose(is_elsewhere, found, value);
                cover = choose(is_elsewhere, there, cover);
            }
            *end = Covered { t, cover, value };
        }
        let [near, far] = ends;
        let is_slab = near.t.simd_lt(far.t) & packet.is_there;
        let is_in = [near.cover.simd_ge(one), far.cover.simd_ge(one)];
        let is_passed = is_slab & (is_in[0] ^ is_in[1]);
        if any(is_passed) {
            let outside = Covered::choose(is_in[0], far, near);
            let inside = Covered::choose(is_in[0], near, far);
            let found = self.passed(simd, packet, is_passed, [outside, inside]);
            widen_border(&mut border, is_passed, found);
        }
        // What lies between two faces alone, as the device looks for it.
        let is_near = near.cover.max(far.cover).simd_gt(zero);
        let may_be = is_slab & !is_in[0] & !is_in[1] & is_near;
        if any(may_be) {
            let (mut first, mut last, mut is_met) = (near, far, zero.simd_gt(one));
            for share in LOOKS {
                let t = (far.t - near.t).mul_add(all(simd, share), near.t);
                let (value, cover) = self.functions.weighed(simd, packet.at(t));
                let (is_inside, here) = (cover.simd_ge(one), Covered { t, cover, value });
                first = Covered::choose(is_inside & !is_met, here, first);
                last = Covered::choose(is_inside, here, last);
                is_met |= is_inside;
            }
            let is_there = may_be & is_met;
            if any(is_there) {
                for ends in [[near, first], [far, last]] {
                    let found = self.passed(simd, packet, is_there, ends);
                    widen_border(&mut border, is_there, found);
                }
            }
        }
        border
    }

    /// Where coverage passes 1 between a place outside and one inside, for those that ask, and the value there: by false
    /// position, the end that stays twice counting half (Illinois). The place inside that is nearest, where none is near enough.
    #[inline(always)]
    fn passed(
        &self,
        simd: S,
        packet: &Packet<S>,
        asks: Mask<S>,
        [mut outside, mut inside]: [Covered<S>; 2],
    ) -> (Lanes<S>, Lanes<S>) {
        let (zero, one, half) = (all(simd, 0.0), all(simd, 1.0), all(simd, 0.5));
        // How far coverage is off 1, or half of it.
        let mut off = [outside.cover - one, inside.cover - one];
        for _ in 0..STEPS {
            let rise = off[1] - off[0];
            let has_rise = rise.simd_gt(zero);
            let share = choose(has_rise, -off[0] / choose(has_rise, rise, one), one);
            let share = share.max(zero).min(one);
            let t = (inside.t - outside.t).mul_add(share, outside.t);
            let (value, cover) = self.functions.weighed(simd, packet.at(t));
            let is_near = (cover - one).abs().simd_le(all(simd, NEAR));
            let (is_in, found) = (cover.simd_ge(one) | is_near, Covered { t, cover, value });
            off = [
                choose(is_in, off[0] * half, cover - one),
                choose(is_in, cover - one, off[1] * half),
            ];
            inside = Covered::choose(is_in, found, inside);
            outside = Covered::choose(is_in, outside, found);
            if !any(asks & !is_near) {
                break;
            }
        }
        (inside.t, inside.value)
    }

    /// Adds what a function has at faces from `low` to `high`, each by itself.
    #[inline(always)]
    fn add_each<const MEAN: bool>(
        &mut self,
        simd: S,
        (middle, along): (Lanes<S>, &Along<'_, S>),
        [low, high]: [usize; 2],
    ) {
        for i in low..=high {
            let off = middle - i as f32;
            let square = (off * off).mul_add(along.a, along.near);
            let phi = basis_of(simd, self.functions.basis(), square);
            let Seen { end, weight, height, .. } = *along.seen;
            self.add::<MEAN>(simd, i, phi, (end, weight, height));
        }
    }

    /// Adds what a function has in slabs from `low` to `high`, as a share of each one's length.
    #[inline(always)]
    fn add_means(
        &mut self,
        simd: S,
        packet: &Packet<S>,
        along: &Along<'_, S>,
        [low, high]: [usize; 2],
    ) {
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let half = along.half(simd);
        let is_met = half.simd_gt(zero);
        let half = choose(is_met, half, zero);
        let is_gaussian = self.functions.basis() != Basis::Multiquadric;
        // The integral is `height` times a function of `scale` times the distance.
        let (height, scale) = if is_gaussian {
            // ∫ exp(−a τ²/2) dτ = √(π/2a) erf(√(a/2) τ).
            let scale = (along.a * 0.5).sqrt();
            let height = exponential(simd, choose(is_met, along.near * -0.5, zero));
            (height / scale * (0.5 * std::f32::consts::PI.sqrt()), scale)
        } else {
            // ∫ 1/√(c + a τ²) dτ = asinh(τ √(a/c))/√a, c = 1 + m.
            let speed = along.a.sqrt();
            (one / speed, speed / (along.near + 1.0).sqrt())
        };
        let height = choose(is_met, height * along.seen.weight, zero);
        let first = self.window.first();
        let mut depth = self.depth_of(simd, packet, first, low);
        let mut integral = integral(simd, is_gaussian, (depth, along.middle), (half, scale));
        for i in low..=high {
            let next = self.depth_of(simd, packet, first, i + 1);
            let beyond = self::integral(simd, is_gaussian, (next, along.middle), (half, scale));
            let length = next - depth;
            let has_length = length.simd_gt(zero);
            let mean = (beyond - integral) * height / choose(has_length, length, one);
            self.values[i] += choose(has_length, mean, zero);
            (depth, integral) = (next, beyond);
        }
    }

    /// Where a face lies along rays, in steps.
    #[inline(always)]
    fn depth_of(&self, simd: S, packet: &Packet<S>, first: i32, i: usize) -> Lanes<S> {
        #[expect(clippy::cast_possible_truncation, reason = "0..=32")]
        let number = first + i.cast_signed() as i32;
        face(simd, packet, number, self.window.step) * (1.0 / self.window.step)
    }
}

/// The integral of a function from its middle to a depth, no farther than it reaches, over its height.
#[inline(always)]
fn integral<S: Simd>(
    simd: S,
    is_gaussian: bool,
    (depth, middle): (Lanes<S>, Lanes<S>),
    (half, scale): (Lanes<S>, Lanes<S>),
) -> Lanes<S> {
    let off = (depth - middle).max(-half).min(half) * scale;
    if is_gaussian { erf(simd, off) } else { area_sine(simd, off) }
}

/// Where a face lies along rays: at the borders of the lattice they are clipped.
#[inline(always)]
pub(super) fn face<S: Simd>(simd: S, packet: &Packet<S>, k: i32, step: f32) -> Lanes<S> {
    all(simd, k as f32 * step).max(packet.enter).min(packet.leave)
}

/// erf(x) to 1.5e-7 (Abramowitz and Stegun 7.1.26).
#[inline(always)]
pub(super) fn erf<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    let one = all(simd, 1.0);
    let size = x.abs();
    let t = one / size.mul_add(all(simd, 0.327_591_1), one);
    let mut series = all(simd, 1.061_405_4);
    for term in [-1.453_152, 1.421_413_7, -0.284_496_74, 0.254_829_6] {
        series = series.mul_add(t, all(simd, term));
    }
    let found = one - series * t * exponential(simd, -(size * size));
    choose(x.simd_lt(all(simd, 0.0)), -found, found)
}

/// asinh(x).
#[inline(always)]
fn area_sine<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    let size = x.abs();
    let found = logarithm(simd, size + size.mul_add(size, all(simd, 1.0)).sqrt());
    choose(x.simd_lt(all(simd, 0.0)), -found, found)
}

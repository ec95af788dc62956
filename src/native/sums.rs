//! Sums of basis functions along rays: each function lands on the tiles of the picture that it reaches, and eight rays
//! go through the list of their tile together, for many faces of slabs at a time.
//!
//! Along a ray a Gaussian is one again, exp(−(m + a τ²)/2): m is how near the ray comes, and τ the distance from there. At
//! faces that lie evenly apart each value is the last one times a ratio, which itself shrinks by a constant ratio: two
//! products a face, and no exponential.

use fearless_simd::{Simd, prelude::*};

use super::functions::{Functions, basis_of, covered, mean};
use super::landed::{Entry, Landed};
use super::lanes::{LANES, Lanes, Mask, all, any, choose, exponential, logarithm};
use super::own::{Found, no_border, widen_border};
use super::rays::{Packet, Rays};
use super::supports::NotBegun;
use super::window::{Ends, FACES, Here, Window};
use crate::core::{Ticket, mapped};
use crate::rbf::{Basis, Function};
use crate::scene::{Classify, View};

/// Products go from face to face as long as no ray begins so far down a function's flank, as an exponent.
const STEEPEST: f32 = 20.0;

/// Steps towards the place where a mean ends, at most, and how far off 1 coverage may be there.
const STEPS: usize = 12;
const NEAR: f32 = 1e-5;
/// Places of a slab, as shares of it, at which it is looked for a mean that neither face has: those of the device.
const LOOKS: [f32; 9] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];

/// Functions that are placed between two looks at the ticket.
const A_RUN: usize = 1 << 13;

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

/// Where the functions land in a picture.
///
/// # Errors
/// More than lists have room for, and a cancelled ticket.
pub(super) fn landed(
    functions: &Functions,
    rays: &Rays,
    ticket: &Ticket,
) -> Result<Landed, NotBegun> {
    let listed = &functions.listed;
    let extent = |i: usize| {
        let (function, reach): (&Function, f64) = (&listed.functions[i], listed.reaches[i]);
        let view: &View = &rays.view;
        let middle = view.view_from_index * (function.centre - view.lattice_centre);
        let rows = (view.view_from_index * function.shape.inverse()).transpose();
        let lengths = [rows.x_axis, rows.y_axis, rows.z_axis].map(glam::DVec3::length);
        Some([middle, glam::DVec3::from(lengths) * reach.sqrt()])
    };
    let extents = mapped(listed.functions.len(), A_RUN, extent, ticket)?;
    Landed::new((&extents, "basis functions"), (rays, None), ticket)
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
    list: &'a [Entry],
    window: Window,
    ends: Ends<S>,
    values: [Lanes<S>; FACES + 1],
    /// Of functions that are weighed against each other: Σ h φ of those that are no holes, the coverage, and see
    /// [`Found::border`]. Of the face behind the last as well.
    totals: [Lanes<S>; FACES + 1],
    coverages: [Lanes<S>; FACES + 1],
    borders: [[Lanes<S>; 4]; FACES],
}

/// A function along eight rays, lengths in steps: exp(−(near + a τ²)/2) or its like, as far as `half` on either side.
#[derive(Clone, Copy)]
struct Along<S: Simd> {
    weight: f32,
    height: f32,
    middle: Lanes<S>,
    half: Lanes<S>,
    near: Lanes<S>,
    a: Lanes<S>,
}

impl<'a, S: Simd> Sums<'a, S> {
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        (functions, landed): (&'a Functions, &'a Landed),
        (rays, at): (&Rays, [u32; 2]),
        asked: Asked,
    ) -> Self {
        Self {
            functions,
            list: landed.on(at),
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

    /// A function of the list, where any ray meets it between two depths.
    #[inline(always)]
    fn along(
        &self,
        simd: S,
        packet: &Packet<S>,
        entry: &Entry,
        depths: [f32; 2],
    ) -> Option<Along<S>> {
        if entry.depths[1] < depths[0] || entry.depths[0] > depths[1] {
            return None;
        }
        let function = &self.functions.all[entry.number as usize];
        // From a place nearby: far from it the squares would leave few digits to their difference.
        let begin = 0.5 * (entry.depths[0] + entry.depths[1]);
        let from = function.widths(function.offset(packet.at(all(simd, begin))));
        let direction = function.widths(packet.direction);
        let a = direction.dot(direction);
        let inverse = all(simd, 1.0) / a;
        let t = -(direction.dot(from)) * inverse;
        let nearest = from.at(direction, t);
        let near = nearest.dot(nearest);
        let reach = all(simd, function.reach);
        let is_met = near.simd_lt(reach);
        if !any(is_met) {
            return None;
        }
        let half = ((reach - near).max(all(simd, 0.0)) * inverse).sqrt() * (1.0 / self.window.step);
        // What a ray does not meet reaches nowhere.
        let half = choose(is_met, half, all(simd, -1.0));
        let middle = (t + begin) * (1.0 / self.window.step);
        let a = a * (self.window.step * self.window.step);
        let (weight, height) = (function.weight, function.height);
        Some(Along { weight, height, middle, half, near, a })
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
        let is_gaussian = self.functions.basis() != Basis::Multiquadric;
        let list = self.list;
        for entry in list {
            let Some(along) = self.along(simd, packet, entry, depths) else { continue };
            let is_met = along.half.simd_ge(all(simd, 0.0));
            // Faces from the first one, that any ray meets.
            let middle = along.middle - first;
            let far = all(simd, 1e9);
            let low = choose(is_met, middle - along.half, far).reduce_min();
            let high = choose(is_met, middle + along.half, -far).reduce_max();
            let low = if of_means { low.floor() } else { low.ceil() };
            let (low, high) = (low.max(0.0), high.floor().min((count - 1) as f32));
            if low > high {
                continue;
            }
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..32")]
            let (low, high) = (low as usize, high as usize);
            if of_means {
                self.add_means(simd, packet, &along, [low, high]);
            } else if is_gaussian {
                self.add_gaussian::<MEAN>(simd, (middle, &along), [low, high]);
            } else {
                self.add_each::<MEAN>(simd, (middle, &along), [low, high]);
            }
        }
    }

    /// Adds what a function has at a face, φ for a mean and else φ times its weight, to the rays that it reaches there.
    #[inline(always)]
    fn add<const MEAN: bool>(
        &mut self,
        simd: S,
        i: usize,
        (phi, within): (Lanes<S>, Mask<S>),
        along: &Along<S>,
    ) {
        if !MEAN {
            self.values[i] += choose(within, phi, all(simd, 0.0));
            return;
        }
        let phi = choose(within, (phi - self.functions.end()) * along.height, all(simd, 0.0));
        self.coverages[i] += phi;
        if along.height >= 0.0 {
            self.totals[i] += phi;
            self.values[i] += phi * along.weight;
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
        (middle, along): (Lanes<S>, &Along<S>),
        [low, high]: [usize; 2],
    ) {
        for i in low..=high {
            let off = middle - i as f32;
            let square = (off * off).mul_add(along.a, along.near);
            let phi = basis_of(simd, self.functions.basis(), square);
            let phi = if MEAN { phi } else { phi * along.weight };
            let within = off.abs().simd_le(along.half);
            self.add::<MEAN>(simd, i, (phi, within), along);
        }
    }

    /// Adds what a Gaussian has at faces from `low` to `high`, by products from a face in its middle to both sides.
    #[inline(always)]
    fn add_gaussian<const MEAN: bool>(
        &mut self,
        simd: S,
        (middle, along): (Lanes<S>, &Along<S>),
        [low, high]: [usize; 2],
    ) {
        let (zero, half) = (all(simd, 0.0), all(simd, 0.5));
        let is_met = along.half.simd_ge(zero);
        // About the middle of the first ray that meets it: those of the others lie near, or products go too far down a flank.
        let first = is_met.to_bitmask().trailing_zeros() as usize % LANES;
        let begin = middle[first].round().clamp(low as f32, high as f32);
        let off = all(simd, begin) - middle;
        let slope = off * along.a;
        let flank = choose(is_met, off * slope, zero);
        if any(flank.simd_gt(all(simd, 2.0 * STEEPEST))) {
            // Rays that meet it at far-away depths.
            return self.add_each::<MEAN>(simd, (middle, along), [low, high]);
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..32")]
        let begin = begin as usize;
        let square = off.mul_add(slope, along.near);
        let mut start = exponential(simd, square * -0.5);
        if !MEAN {
            start *= along.weight;
        }
        let shrinking = exponential(simd, -along.a);
        // What rays that do not meet it have is left out, whatever it is.
        let up = exponential(simd, along.a.mul_add(-half, -slope));
        let (mut value, mut ratio, mut place) = (start, up, off);
        for i in begin..=high {
            let within = place.abs().simd_le(along.half);
            self.add::<MEAN>(simd, i, (value, within), along);
            value *= ratio;
            ratio *= shrinking;
            place += 1.0;
        }
        if low == begin {
            return;
        }
        let mut ratio = exponential(simd, along.a.mul_add(-half, slope));
        let (mut value, mut place) = (start * ratio, off - 1.0);
        for i in (low..begin).rev() {
            ratio *= shrinking;
            let within = place.abs().simd_le(along.half);
            self.add::<MEAN>(simd, i, (value, within), along);
            value *= ratio;
            place -= 1.0;
        }
    }

    /// Adds what a function has in slabs from `low` to `high`, as a share of each one's length.
    #[inline(always)]
    fn add_means(
        &mut self,
        simd: S,
        packet: &Packet<S>,
        along: &Along<S>,
        [low, high]: [usize; 2],
    ) {
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let is_met = along.half.simd_gt(zero);
        let half = choose(is_met, along.half, zero);
        // The integral is `height` times a function of `scale` times the distance.
        let (height, scale) = match self.functions.basis() {
            Basis::Gaussian | Basis::Ellipsoid => {
                // ∫ exp(−a τ²/2) dτ = √(π/2a) erf(√(a/2) τ).
                let scale = (along.a * 0.5).sqrt();
                let height = exponential(simd, choose(is_met, along.near * -0.5, zero));
                (height / scale * (0.5 * std::f32::consts::PI.sqrt()), scale)
            }
            Basis::Multiquadric => {
                // ∫ 1/√(c + a τ²) dτ = asinh(τ √(a/c))/√a, c = 1 + m.
                let speed = along.a.sqrt();
                (one / speed, speed / (along.near + 1.0).sqrt())
            }
        };
        let height = choose(is_met, height * along.weight, zero);
        let (first, step) = (self.window.first(), self.window.step);
        let is_gaussian = self.functions.basis() != Basis::Multiquadric;
        let integral = |i: usize| {
            let t = face(simd, packet, first + i.cast_signed() as i32, step) * (1.0 / step);
            let off = (t - along.middle).max(-half).min(half) * scale;
            let share = if is_gaussian { erf(simd, off) } else { area_sine(simd, off) };
            (t, share)
        };
        let mut before = integral(low);
        for i in low..=high {
            let here = integral(i + 1);
            let length = here.0 - before.0;
            let has_length = length.simd_gt(zero);
            let mean = (here.1 - before.1) * height / choose(has_length, length, one);
            self.values[i] += choose(has_length, mean, zero);
            before = here;
        }
    }
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

//! Cells along rays: each cell lands on the tiles of the picture that it reaches, and eight rays go through the list of
//! their tile together, for many faces of slabs at a time.
//!
//! Between where a ray enters a tetrahedron and where it leaves it values are linear: a face of a slab in between costs one
//! product. In other solids a face's place is found by Newton's method, from where the last one's was. No order is needed,
//! since a face lies in one cell (the first, where several overlap), and is not looked for again once it is found. A slab with a
//! face outside all cells reaches from where it enters them to where it leaves them: the outer faces say where.

use std::ops::RangeInclusive;

use fearless_simd::{Simd, prelude::*};

use super::landed::{Entry, Landed, block_bit};
use super::lanes::{Lanes, Mask, Vec3, all, any, choose};
use super::lattice::NOTHING;
use super::lit_cells::Growths;
use super::own::{Found, widen_border};
use super::rays::{Packet, Rays};
use super::shapes::{Bent, Straight, cross};
use super::solids::{Outer, Solid, Solids};
use super::sums::Asked;
use super::window::{Ends, FACES, Here, Window};

/// A face reaches so far beyond its sides, in units of them: no ray slips between two.
const SIDE_RIM: f32 = 1e-4;
/// More cells than this on a tile for each face that is asked for, and each face looks for the cell about it.
const LONG: usize = 1 << 10;
/// Steps of Newton's method to where a ray passes a face of four corners.
const FACE_STEPS: usize = 5;
const FAR: f32 = 1e30;
/// Faces so near, in slabs, may lie where cells, and rays, end: by rounding.
const NEAR: f32 = 0.01;

/// Bits of the whole numbers between two, of the first 32.
#[inline(always)]
fn between([low, high]: [f32; 2]) -> u32 {
    let (low, high) = (low.max(0.0), high.min((FACES - 1) as f32));
    if low > high {
        return 0;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..32")]
    let (low, high) = (low as u32, high as u32);
    u32::MAX << low & u32::MAX >> (FACES as u32 - 1 - high)
}

/// What eight rays have of cells, at some faces (middles) after one another.
pub(super) struct AlongSolids<'a, S: Simd> {
    cells: &'a Solids,
    list: &'a [Entry],
    outer: &'a [Entry],
    /// The block of the tile that the rays are of, as a bit.
    block: u8,
    window: Window,
    ends: Ends<S>,
    values: [Lanes<S>; FACES],
    /// The faces at which a ray has no value yet, a bit each.
    open: u32,
    /// The growths that the light asks for, if it does, and those at the faces.
    of: Growths<'a>,
    growths: Option<Box<[Vec3<S>; FACES]>>,
    /// In the slab behind each face, the nearest and the farthest place where the ray passes the cells' border, and the
    /// values there.
    borders: [[Lanes<S>; 4]; FACES],
    /// The growths there, where the light asks for them.
    border_growths: Option<Box<[[Vec3<S>; 2]; FACES]>>,
}

impl<'a, S: Simd> AlongSolids<'a, S> {
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        (cells, [solids, outer]): (&'a Solids, &'a [Landed; 2]),
        (rays, at): (&Rays, [u32; 2]),
        (asked, of): (Asked, Growths<'a>),
    ) -> Self {
        Self {
            cells,
            list: solids.on(at),
            outer: outer.on(at),
            block: block_bit(at),
            window: Window::new(asked, rays.step),
            ends: Ends::new(),
            values: [all(simd, NOTHING); FACES],
            open: 0,
            of,
            growths: of.are_asked_for().then(|| Box::new([Vec3::splat(simd, [0.0; 3]); FACES])),
            borders: [[all(simd, 0.0); 4]; FACES],
            border_growths: of
                .are_asked_for()
                .then(|| Box::new([[Vec3::splat(simd, [0.0; 3]); 2]; FACES])),
        }
    }

    /// What lies at face `k`, at depths `t` (in the middle of the slab that begins there). Others that are asked for next
    /// lie in the direction of `way`, as far as `last`. At the borders of the lattice faces and middles are not where they
    /// would be elsewhere.
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
        let mut found = Found {
            value: self.values[i],
            growth: self.growths.as_ref().map(|growths| growths[i]),
            border: self.borders[i],
            border_growths: self.border_growths.as_ref().map(|growths| growths[i]),
        };
        let is_elsewhere = self.window.is_elsewhere(simd, packet, k, t);
        if any(is_elsewhere) {
            let (cells, of) = (self.cells, self.of);
            let other = Here { value: found.value, growth: found.growth };
            let Here { value, growth } = self.ends.put(
                packet,
                (t, is_elsewhere),
                other,
                #[inline(always)]
                |place| cells.here(simd, (place, packet.is_there), (of, packet.direction)),
            );
            (found.value, found.growth) = (value, growth);
        }
        found
    }

    /// Looks at all faces that are to be there. Not inlined: few ask, and for many faces.
    #[inline(never)]
    fn fill(&mut self, simd: S, packet: &Packet<S>) {
        simd.vectorize(
            #[inline(always)]
            || self.look(simd, packet),
        );
    }

    #[inline(always)]
    fn look(&mut self, simd: S, packet: &Packet<S>) {
        let (count, step) = (self.window.len(), self.window.step);
        for i in 0..count {
            self.values[i] = all(simd, NOTHING);
            self.borders[i] = [all(simd, FAR), all(simd, -FAR), all(simd, 0.0), all(simd, 0.0)];
        }
        self.open =
            (0..count).fold(0, |open, i| open | u32::from(self.is_open(simd, packet, i)) << i);
        if self.list.len() > LONG * count {
            self.look_about(simd, packet);
        } else {
            self.look_along(simd, packet);
        }
        if self.window.asked == Asked::Faces {
            let cells = self.cells;
            // Slabs with a face outside all cells, or beyond a ray's ends, and the last, whose far face is not known yet.
            let is_outside = |i: usize| {
                let is_inside = !self.values[i].simd_eq(all(simd, NOTHING));
                any(packet.is_there & !(is_inside & self.counts(simd, packet, i)))
            };
            let outside = (0..count).fold(0, |outside, i| outside | u32::from(is_outside(i)) << i);
            let asked = outside | outside >> 1 | 1 << (count - 1);
            let scale = 1.0 / step;
            let first = self.window.first() as f32;
            for entry in self.outer {
                let [near, far] = entry.depths.map(|depth| depth * scale - first);
                let slabs = between([(near - NEAR).floor(), (far + NEAR).floor()]);
                if entry.blocks & self.block != 0 && asked & slabs != 0 {
                    self.add_border(simd, packet, (&cells.outer[entry.number as usize], entry));
                }
            }
        }
    }

    /// Whether a ray that has a place at face `i` has no value there yet.
    #[inline(always)]
    fn is_open(&self, simd: S, packet: &Packet<S>, i: usize) -> bool {
        any(self.counts(simd, packet, i) & self.values[i].simd_eq(all(simd, NOTHING)))
    }

    /// The rays that have a place at face `i`: others are asked for where the ray begins or ends.
    #[inline(always)]
    fn counts(&self, simd: S, packet: &Packet<S>, i: usize) -> Mask<S> {
        let (t, rim) =
            ((self.window.begin() + i as f32) * self.window.step, NEAR * self.window.step);
        packet.is_there
            & packet.enter.simd_le(all(simd, t + rim))
            & packet.leave.simd_ge(all(simd, t - rim))
    }

    /// The values at all faces, each by the cells that lie near it: where a tile has so many that a look at each of them takes
    /// longer, as in small pictures of large meshes.
    #[inline(always)]
    fn look_about(&mut self, simd: S, packet: &Packet<S>) {
        let (first, step) = (self.window.begin(), self.window.step);
        for i in 0..self.window.len() {
            let t = all(simd, (first + i as f32) * step);
            let counts = self.counts(simd, packet, i);
            if !any(counts) {
                continue;
            }
            let of = (packet.at(t), counts);
            let Here { value, growth } = self.cells.here(simd, of, (self.of, packet.direction));
            self.values[i] = value;
            if let (Some(growths), Some(growth)) = (&mut self.growths, growth) {
                growths[i] = growth;
            }
        }
    }

    /// The values at faces, from each cell of the tile's list that may have one that no cell before it has.
    #[inline(always)]
    fn look_along(&mut self, simd: S, packet: &Packet<S>) {
        let (cells, first) = (self.cells, self.window.begin());
        // Rays along a plane are inside a box's or they are not: no infinities are needed.
        let tiny = all(simd, 1e-20);
        let Vec3 { x, y, z } = packet.direction;
        let inverse = Vec3 {
            x: all(simd, 1.0) / choose(x.abs().simd_lt(tiny), tiny, x),
            y: all(simd, 1.0) / choose(y.abs().simd_lt(tiny), tiny, y),
            z: all(simd, 1.0) / choose(z.abs().simd_lt(tiny), tiny, z),
        };
        let scale = 1.0 / self.window.step;
        for entry in self.list {
            let [near, far] = entry.depths.map(|depth| depth * scale - first);
            let faces = between([(near - NEAR).ceil(), (far + NEAR).floor()]);
            if entry.blocks & self.block == 0 || faces & self.open == 0 {
                continue;
            }
            match cells.solids[entry.number as usize] {
                Solid::Straight(i) => {
                    self.add_straight(simd, packet, (&cells.straight[i as usize], entry), first);
                }
                Solid::Bent(i) => {
                    let own = (&cells.bent[i as usize], entry);
                    self.add_bent(simd, (packet, inverse), own, first);
                }
                Solid::Nothing => {}
            }
        }
    }

    /// The faces of the window that lie between two places of any ray that is met, counted from its first.
    #[inline(always)]
    fn faces_within(
        &self,
        simd: S,
        is_met: Mask<S>,
        [enter, leave]: [Lanes<S>; 2],
    ) -> Option<RangeInclusive<usize>> {
        let far = all(simd, 1e9);
        let low = choose(is_met, enter, far).reduce_min().ceil().max(0.0);
        let high = choose(is_met, leave, -far).reduce_max().floor();
        let high = high.min((self.window.len() - 1) as f32);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..32")]
        let faces = (low <= high).then_some(low as usize..=high as usize);
        faces
    }

    /// Puts a value of a solid to the rays whose face `i` lies there, and what it grows by where that is asked for.
    #[inline(always)]
    fn put(
        &mut self,
        simd: S,
        (packet, i): (&Packet<S>, usize),
        within: Mask<S>,
        (value, solid, unit): (Lanes<S>, u32, Vec3<S>),
    ) {
        self.values[i] = choose(within, value, self.values[i]);
        if let Some(growths) = &mut self.growths {
            let t = all(simd, (self.window.begin() + i as f32) * self.window.step);
            let ray = (packet.at(t), packet.direction);
            let growth = self.cells.growth_in(simd, self.of, (solid, unit), ray);
            growths[i] = Vec3::choose(within, growth, growths[i]);
        }
        if !self.is_open(simd, packet, i) {
            self.open &= !(1 << i);
        }
    }

    #[inline(always)]
    fn add_straight(
        &mut self,
        simd: S,
        packet: &Packet<S>,
        (own, entry): (&Straight, &Entry),
        first: f32,
    ) {
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        // From a place nearby: far from it differences would leave few digits.
        let begin = 0.5 * (entry.depths[0] + entry.depths[1]);
        let from = own.turned(simd, own.offset(packet.at(all(simd, begin))));
        let by = own.turned(simd, packet.direction);
        let (mut enter, mut leave) = (all(simd, -FAR), all(simd, FAR));
        let mut is_met = packet.is_there;
        let sides = [
            (from.x, by.x, own.rims[0]),
            (from.y, by.y, own.rims[1]),
            (from.z, by.z, own.rims[2]),
            (one - from.x - from.y - from.z, zero - by.x - by.y - by.z, own.rims[3]),
        ];
        for (height, growth, rim) in sides {
            let height = height + rim;
            let is_along = growth.abs().simd_lt(all(simd, 1e-20));
            let t = (zero - height) / choose(is_along, one, growth);
            let rises = growth.simd_gt(zero);
            enter = choose(rises & !is_along, enter.max(t), enter);
            leave = choose(!rises & !is_along, leave.min(t), leave);
            is_met &= !(is_along & height.simd_lt(zero));
        }
        is_met &= enter.simd_le(leave);
        if !any(is_met) {
            return;
        }
        let scale = 1.0 / self.window.step;
        // In faces from the first one.
        let enter = (enter + begin) * scale - first;
        let leave = (leave + begin) * scale - first;
        let Some(faces) = self.faces_within(simd, is_met, [enter, leave]) else { return };
        let nothing = all(simd, NOTHING);
        for i in faces {
            if self.open >> i & 1 == 0 {
                continue;
            }
            let place = i as f32;
            let within = is_met & enter.simd_le(all(simd, place)) & leave.simd_ge(all(simd, place));
            let within = within & self.values[i].simd_eq(nothing);
            if !any(within) {
                continue;
            }
            let t = all(simd, (first + place) * self.window.step - begin);
            let unit = from.at(by, t);
            self.put(simd, (packet, i), within, (own.value(simd, unit), entry.number, unit));
        }
    }

    #[inline(always)]
    fn add_bent(
        &mut self,
        simd: S,
        (packet, inverse): (&Packet<S>, Vec3<S>),
        (own, entry): (&Bent, &Entry),
        first: f32,
    ) {
        let scale = 1.0 / self.window.step;
        let [enter, leave] = own.span(packet, inverse);
        let is_met = packet.is_there & enter.simd_le(leave);
        if !any(is_met) {
            return;
        }
        // In faces from the first one, and a little more for rounding.
        let (enter, leave) = (enter * scale - (first + NEAR), leave * scale - (first - NEAR));
        let Some(faces) = self.faces_within(simd, is_met, [enter, leave]) else { return };
        let nothing = all(simd, NOTHING);
        let middle = own.middle(simd);
        let [mut guess, mut last] = [middle; 2];
        let mut was_within = Mask::splat(simd, false);
        for i in faces {
            if self.open >> i & 1 == 0 {
                continue;
            }
            let place = all(simd, i as f32);
            let open = self.values[i].simd_eq(nothing)
                & is_met
                & enter.simd_le(place)
                & leave.simd_ge(place);
            if !any(open) {
                continue;
            }
            let place = packet.at(all(simd, (first + i as f32) * self.window.step));
            let (found, within) = own.unit(simd, (place, open), guess);
            // The next face lies about as far on. Others begin anew.
            let on = found.scaled(all(simd, 2.0)).at(last, all(simd, -1.0));
            guess = Vec3::choose(within & was_within, on, Vec3::choose(within, found, middle));
            (last, was_within) = (found, within);
            if !any(within) {
                continue;
            }
            self.put(simd, (packet, i), within, (own.value(simd, found), entry.number, found));
        }
    }

    /// Where rays pass an outer face: by Newton's method for u, v and the depth, which is exact at once in triangles.
    #[inline(always)]
    fn add_border(&mut self, simd: S, packet: &Packet<S>, (own, entry): (&Outer, &Entry)) {
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let begin = 0.5 * (entry.depths[0] + entry.depths[1]);
        let [ox, oy, oz] = own.origin;
        let place = packet.at(all(simd, begin));
        let from = Vec3 { x: place.x - ox, y: place.y - oy, z: place.z - oz };
        let [by_u, by_v, by_uv] = own.places.map(|by| Vec3::splat(simd, by));
        let back = packet.direction.scaled(all(simd, -1.0));
        let speed = back.dot(back);
        let [mut u, mut v] = [all(simd, 0.5); 2];
        let mut t = zero;
        let mut is_found = Mask::splat(simd, false);
        let steps = if own.is_triangle { 1 } else { FACE_STEPS };
        let mut last = one;
        for _ in 0..steps {
            let (along_u, along_v) = (by_u.at(by_uv, v), by_v.at(by_uv, u));
            // What is left: the ray's place less the face's.
            let here = Vec3::splat(simd, [0.0; 3]).at(by_u, u).at(along_v, v);
            let there = from.at(packet.direction, t);
            let off = Vec3 { x: there.x - here.x, y: there.y - here.y, z: there.z - here.z };
            let across = cross(along_v, back);
            let determinant = along_u.dot(across);
            // A face that is seen from its side is passed by the faces beside it.
            let size = along_u.dot(along_u) * along_v.dot(along_v);
            let is_sound = (determinant * determinant).simd_gt(size * (speed * 1e-10));
            let share = one / choose(is_sound, determinant, one);
            let share = choose(is_sound, share, zero);
            is_found = is_sound;
            let [du, dv, dt] = [
                off.dot(across) * share,
                off.dot(cross(back, along_u)) * share,
                off.dot(cross(along_u, along_v)) * share,
            ];
            u = (u + du).max(all(simd, -2.0)).min(all(simd, 3.0));
            v = (v + dv).max(all(simd, -2.0)).min(all(simd, 3.0));
            t += dt;
            last = du.abs().max(dv.abs());
        }
        let rim = all(simd, -SIDE_RIM);
        let end = one - rim;
        let is_settled = last.simd_le(all(simd, 1e-2)) | Mask::splat(simd, own.is_triangle);
        let beyond = if own.is_triangle { u + v } else { u.max(v) };
        let is_met = packet.is_there
            & is_found
            & is_settled
            & u.simd_ge(rim)
            & v.simd_ge(rim)
            & beyond.simd_le(end);
        if !any(is_met) {
            return;
        }
        let t = t + begin;
        let [value, value_u, value_v, value_uv] = own.values;
        let along_v = u.mul_add(all(simd, value_uv), all(simd, value_v));
        let value = v.mul_add(along_v, u.mul_add(all(simd, value_u), all(simd, value)));
        let slab = (t * (1.0 / self.window.step)).floor() - self.window.first() as f32;
        let Some(slabs) = self.faces_within(simd, is_met, [slab; 2]) else { return };
        let growth = match &self.border_growths {
            Some(_) => {
                let ray = (packet.at(t), packet.direction);
                self.cells.growth_on(simd, self.of, (entry.number, [u, v]), ray)
            }
            None => Vec3::splat(simd, [0.0; 3]),
        };
        for i in slabs {
            let here = is_met & slab.simd_eq(all(simd, i as f32));
            let moved = widen_border(&mut self.borders[i], here, (t, value));
            if let Some(growths) = &mut self.border_growths {
                for (end, moved) in growths[i].iter_mut().zip(moved) {
                    *end = Vec3::choose(moved, growth, *end);
                }
            }
        }
    }
}

//! Which faces of slabs are known along eight rays, of things that are looked at for many faces at a time.

use fearless_simd::{Simd, prelude::*};

use super::lanes::{Lanes, Mask, Vec3, all, any, choose};
use super::rays::Packet;
use super::sums::Asked;

/// Faces that are looked at together.
pub(super) const FACES: usize = 32;
/// What is left of a slab is whole within this part of it.
const WHOLE: f32 = 1e-3;

/// Faces (middles, means) after one another, as far as they are known.
#[derive(Clone, Copy)]
pub(super) struct Window {
    pub asked: Asked,
    pub step: f32,
    /// The number of the first that is known, and how many are.
    first: i32,
    count: i32,
}

impl Window {
    /// Of none.
    pub(super) fn new(asked: Asked, step: f32) -> Self {
        Self { asked, step, first: 0, count: 0 }
    }

    /// Moves it to where face `k` is known, as others that lie in the direction of `way`, as far as `last`; whether it had
    /// to be moved, so that all of them are to be looked at.
    #[inline(always)]
    pub(super) fn is_moved_to(&mut self, (k, way, last): (i32, i32, i32)) -> bool {
        if (0..self.count).contains(&(k - self.first)) {
            return false;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "32")]
        let count = ((last - k) * way + 1).clamp(1, FACES as i32);
        self.first = if way < 0 { k - count + 1 } else { k };
        self.count = count;
        true
    }

    /// The number in the window of a face that is known.
    #[inline(always)]
    pub(super) fn index(&self, k: i32) -> usize {
        #[expect(clippy::cast_sign_loss, reason = "it is known")]
        let index = (k - self.first) as usize;
        index
    }

    /// How many are known.
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        #[expect(clippy::cast_sign_loss, reason = "0..=32")]
        let len = self.count as usize;
        len
    }

    /// The number of the first.
    #[inline(always)]
    pub(super) fn first(&self) -> i32 {
        self.first
    }

    /// Where the first lies, in steps.
    #[inline(always)]
    pub(super) fn begin(&self) -> f32 {
        self.first as f32 + self.shift()
    }

    /// How far a middle is behind its slab's face, in steps.
    #[inline(always)]
    fn shift(&self) -> f32 {
        self.asked.shift().unwrap_or(0.0)
    }

    /// The rays whose face `k`, or middle, lies elsewhere, at depths `t`: at the borders of the lattice they are not where
    /// they would be.
    #[inline(always)]
    pub(super) fn is_elsewhere<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        k: i32,
        t: Lanes<S>,
    ) -> Mask<S> {
        let off = (t - (k as f32 + self.shift()) * self.step).abs();
        off.simd_gt(all(simd, WHOLE * self.step)) & packet.is_there
    }
}

/// A value, and its growth per index where that is asked for.
#[derive(Clone, Copy)]
pub(super) struct Here<S: Simd> {
    pub value: Lanes<S>,
    pub growth: Option<Vec3<S>>,
}

impl<S: Simd> Here<S> {
    /// That of some rays, and `other` elsewhere.
    #[inline(always)]
    pub(super) fn choose(which: Mask<S>, own: Self, other: Self) -> Self {
        let growth = match (own.growth, other.growth) {
            (Some(own), Some(other)) => Some(Vec3::choose(which, own, other)),
            _ => other.growth,
        };
        Self { value: choose(which, own.value, other.value), growth }
    }
}

/// What lies where eight rays enter the lattice, and where they leave it. In a small picture they enter it many slabs apart, and
/// are asked for faces there again and again.
pub(super) struct Ends<S: Simd>([Option<Here<S>>; 2]);

impl<S: Simd> Ends<S> {
    /// Of rays that nobody has looked at.
    pub(super) fn new() -> Self {
        Self([None; 2])
    }

    /// What lies at depths `t` of the rays `elsewhere`, as `find` says of places, and `other` of the others.
    #[inline(always)]
    pub(super) fn put(
        &mut self,
        packet: &Packet<S>,
        (t, elsewhere): (Lanes<S>, Mask<S>),
        other: Here<S>,
        find: impl Fn(Vec3<S>) -> Here<S>,
    ) -> Here<S> {
        let are = [t.simd_eq(packet.enter) & elsewhere, t.simd_eq(packet.leave) & elsewhere];
        // The middle of a part of a slab.
        if any(elsewhere & !(are[0] | are[1])) {
            return Here::choose(elsewhere, find(packet.at(t)), other);
        }
        let mut here = other;
        for (i, end) in [packet.enter, packet.leave].into_iter().enumerate() {
            if any(are[i]) {
                let own = match self.0[i] {
                    Some(own) => own,
                    None => *self.0[i].insert(find(packet.at(end))),
                };
                here = Here::choose(are[i], own, here);
            }
        }
        here
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use fearless_simd::Level;

    use super::*;
    use crate::native::lanes::dispatched;

    /// Rays along x from 0 on: a place's x is its depth.
    fn packet<S: Simd>(simd: S, enter: Lanes<S>, leave: Lanes<S>) -> Packet<S> {
        let is_there = Mask::splat(simd, true);
        Packet {
            origin: Vec3::splat(simd, [0.0; 3]),
            direction: Vec3::splat(simd, [1.0, 0.0, 0.0]),
            enter,
            leave,
            in_picture: is_there,
            is_there,
            is_cut: !is_there,
            stretch: all(simd, 1.0),
            screen: [all(simd, 0.0); 2],
        }
    }

    #[test]
    fn ends_of_rays_are_looked_at_once_each_and_all_else_whenever_it_is_asked_for() {
        let found = |depths: [[f32; 8]; 2]| {
            dispatched!(Level::new(), simd => {
                let enter = Lanes::load_array(simd, [0., 1., 2., 3., 4., 5., 6., 7.]);
                let packet = packet(simd, enter, enter + 20.0);
                let (mut ends, looks) = (Ends::new(), Cell::new(0));
                let other = Here { value: all(simd, -1.0), growth: Some(Vec3::splat(simd, [-1.0; 3])) };
                let found = depths.map(|depths| {
                    let t = Lanes::load_array(simd, depths);
                    let elsewhere = t.simd_ge(all(simd, 0.0));
                    let find = |place: Vec3<_>| {
                        looks.set(looks.get() + 1);
                        Here { value: place.x, growth: Some(place) }
                    };
                    let here = ends.put(&packet, (t, elsewhere), other, find);
                    let growth = here.growth.map(|growth| growth.x.to_array());
                    (here.value.to_array(), growth)
                });
                (found, looks.get())
            })
        };
        // Some where they begin, some where they end, and one that is known already.
        let first = [0., 1., -1., 3., 24., 25., 26., 7.];
        let then = [20., 21., -1., 23., 4., 5., 6., 27.];
        let expected = [first, then].map(|depths| (depths, Some(depths)));
        assert_eq!(found([first, then]), (expected, 2));
        // In between.
        let between = [0., 1., 2.5, 3., -1., 5., 6., 7.];
        assert_eq!(found([between; 2]), ([(between, Some(between)); 2], 2));
        let known = [-1.0; 8];
        assert_eq!(found([known; 2]), ([(known, Some(known)); 2], 0));
    }
}

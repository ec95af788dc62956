//! Which faces of slabs are known along eight rays, of things that are looked at for many faces at a time.

use fearless_simd::{Simd, prelude::*};

use super::lanes::{Lanes, Mask, all};
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
        if self.asked == Asked::Middles { 0.5 } else { 0.0 }
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

//! What light takes for the growth of a field on cells, eight places at a time (`cells` has the definitions).

use fearless_simd::{Simd, prelude::*};

use crate::cells;

use super::lanes::{Lanes, Vec3, all, any, choose};

/// What light takes for the growth of a field ([`crate::cells::ShadingNormals`]).
#[derive(Debug, Default)]
pub(super) struct Lit {
    /// Growth per index, and 1 on the border, 0 elsewhere.
    pub normals: Vec<[f32; 4]>,
    pub faces: Vec<LitFace>,
    /// Where the faces of each solid begin, and the last ones end.
    pub starts: Vec<u32>,
}

/// An outer face as light has it.
#[derive(Debug)]
pub(super) struct LitFace {
    /// Of its plane: a unit vector inwards, and what its product is with places on the face, per index.
    pub plane: [f32; 4],
    /// Numbers of normals of the solid's corners.
    pub corners: [u32; 8],
}

/// Where a ray is in a solid: the place and the ray's direction per index, and the shape functions of the corners.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a, S: Simd> {
    pub place: Vec3<S>,
    pub direction: Vec3<S>,
    pub weights: &'a [Lanes<S>; 8],
}

/// Which growth is asked for.
#[derive(Clone, Copy)]
pub(super) enum Growths<'a> {
    None,
    /// As recovered at the points.
    Own(&'a [[f32; 3]]),
    /// For light that falls on borders, too.
    ForLight(&'a Lit),
}

impl Growths<'_> {
    /// Whether there are any.
    pub(super) fn are_asked_for(self) -> bool {
        !matches!(self, Self::None)
    }
}

impl Lit {
    pub(super) fn faces_of(&self, solid: u32) -> &[LitFace] {
        let [begin, end] = [solid, solid + 1].map(|i| self.starts[i as usize] as usize);
        &self.faces[begin..end]
    }

    /// Of corners with weights: those beyond a solid's own have none.
    #[inline(always)]
    pub(super) fn growth<S: Simd>(
        &self,
        simd: S,
        corners: &[u32],
        weights: &[Lanes<S>; 8],
    ) -> Vec3<S> {
        let mut sums = [Vec3::splat(simd, [0.0; 3]); 2];
        let mut is_border = false;
        for (corner, weight) in corners.iter().zip(weights) {
            let [x, y, z, on_border] = self.normals[*corner as usize];
            let sum = usize::from(on_border > 0.0);
            is_border |= on_border > 0.0;
            sums[sum] = sums[sum].at(Vec3::splat(simd, [x, y, z]), *weight);
        }
        let [inside, border] = sums;
        if !is_border {
            return inside;
        }
        // A surface and its back are lit alike.
        let is_turned = border.dot(inside).simd_lt(all(simd, 0.0));
        border.at(inside, choose(is_turned, all(simd, -1.0), all(simd, 1.0)))
    }

    /// What light takes for the growth in a solid.
    #[inline(always)]
    pub(super) fn growth_in<S: Simd>(
        &self,
        simd: S,
        (solid, corners): (u32, &[u32]),
        seen: Seen<'_, S>,
    ) -> Vec3<S> {
        match self.faces_of(solid) {
            [] => self.growth(simd, corners, seen.weights),
            [face] => self.growth(simd, &face.corners[..corners.len()], seen.weights),
            faces => self.growth_by_entry(simd, (faces, corners.len()), seen),
        }
    }

    /// Of several outer faces by the one that each ray came in through ([`cells::LitFace::nearness`]).
    #[inline(always)]
    fn growth_by_entry<S: Simd>(
        &self,
        simd: S,
        (faces, corners): (&[LitFace], usize),
        seen: Seen<'_, S>,
    ) -> Vec3<S> {
        #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
        let along = all(simd, cells::LitFace::ALONG as f32);
        let one = all(simd, 1.0);
        let forward = seen.direction.scaled(one / seen.direction.dot(seen.direction).sqrt());
        let mut nearest = all(simd, -3e38);
        let mut entered = all(simd, 0.0);
        for (number, face) in faces.iter().enumerate() {
            let [x, y, z, on] = face.plane;
            let inwards = Vec3::splat(simd, [x, y, z]);
            let height = (inwards.dot(seen.place) - on).abs();
            let slope = inwards.dot(forward);
            let left = height / (all(simd, 0.0) - slope).max(along);
            let passed = slope / height.max(all(simd, 1e-20));
            let nearness = choose(slope.simd_gt(along), passed, all(simd, 0.0) - left);
            entered = choose(nearness.simd_gt(nearest), all(simd, number as f32), entered);
            nearest = nearest.max(nearness);
        }
        // Rays beside each other come in through one or two.
        let mut found = Vec3::splat(simd, [0.0; 3]);
        for (number, face) in faces.iter().enumerate() {
            let is_entered = entered.simd_eq(all(simd, number as f32));
            if any(is_entered) {
                let own = self.growth(simd, &face.corners[..corners], seen.weights);
                found = Vec3::choose(is_entered, own, found);
            }
        }
        found
    }

    pub(super) fn size_bytes(&self) -> usize {
        size_of_val(&self.normals[..])
            + size_of_val(&self.faces[..])
            + size_of_val(&self.starts[..])
    }
}

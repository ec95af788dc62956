//! What light takes for the growth of a field on cells, eight places at a time (`cells` has the definitions).

use fearless_simd::{Simd, prelude::*};

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
    /// Factors of 1, r, s and t of the height above it.
    pub height: [f32; 4],
    /// Numbers of normals of the solid's corners, and of the face's own.
    pub corners: [u32; 8],
    pub own: [u32; 4],
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

    /// Of several outer faces of a solid, by the one that is nearest to each place.
    #[inline(always)]
    pub(super) fn growth_by_nearest<S: Simd>(
        &self,
        simd: S,
        faces: &[LitFace],
        (unit, weights): (Vec3<S>, &[Lanes<S>; 8]),
    ) -> Vec3<S> {
        let height = |face: &LitFace| {
            let [one, r, s, t] = face.height;
            Vec3::splat(simd, [r, s, t]).dot(unit) + one
        };
        let mut least = all(simd, 2.0);
        let mut found = Vec3::splat(simd, [0.0; 3]);
        for face in faces {
            let height = height(face);
            let is_nearest = height.simd_lt(least);
            if any(is_nearest) {
                let own = self.growth(simd, &face.corners, weights);
                found = Vec3::choose(is_nearest, own, found);
                least = least.min(height);
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

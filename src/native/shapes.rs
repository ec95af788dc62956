//! The shapes of cells: where a place lies in one, and the value there, eight places at a time.

use fearless_simd::{Simd, prelude::*};
use glam::DVec3;

use super::lanes::{Lanes, Mask, Vec3, all, any, choose};
use super::rays::Packet;
use crate::cells::{Kind, Placed, Rim};

/// Samples about a cell in which it may be found, for its rim.
pub(super) const BEYOND: f64 = 1e-3;
/// Steps of Newton's method, at most.
const MOST_STEPS: usize = 8;
/// No more steps follow one as short as this, in units of the cell, however bent that is.
const SHORT: f64 = 1e-4;
/// Steps are never longer.
const LONGEST: f64 = 1e3;
/// How far from the place itself the last step may end, in units of the cell.
const NEAR_ENOUGH: f64 = 3e-6;

/// A tetrahedron.
#[derive(Debug, Clone, Copy)]
pub(super) struct Straight {
    /// Its first corner.
    pub origin: [f32; 3],
    /// What leads from an offset to (r, s, t): rows.
    pub rows: [[f32; 3]; 3],
    /// Value at the first corner, and its growth along r, s and t.
    pub values: [f32; 4],
    /// How far outside counts as inside, along r, s, t and towards the first corner, in units of it.
    pub rims: [f32; 4],
}

/// Any other solid: factors of 1, r, s, t, rs, st, rt and rst.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bent {
    pub origin: [f32; 3],
    pub kind: Kind,
    pub places: [[f32; 3]; 8],
    pub values: [f32; 8],
    /// Its box, and a little about it.
    pub bounds: [[f32; 3]; 2],
    /// How far outside counts as inside, along r, s and t, in units of it.
    pub rims: [f32; 3],
    /// No more steps of Newton's method follow one as short as this, in units of it: any of a parallelepiped, where the first
    /// one ends at the place.
    pub last_step: f32,
}

#[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
pub(super) fn narrow(v: f64) -> f32 {
    v as f32
}

/// `None` where it has no volume that single precision can tell.
pub(super) fn of_tetrahedron(
    placed: &Placed,
    [a, b, c, d, ..]: [f32; 8],
    rim: Rim,
) -> Option<Straight> {
    let rows = placed.rows();
    let last = rows[0] + rows[1] + rows[2];
    let rims = [rows[0], rows[1], rows[2], last].map(|row| rim.along(row));
    let is_sound = rims.iter().all(|rim| *rim < Rim::WIDEST);
    is_sound.then(|| Straight {
        origin: placed.corners()[0].as_vec3().to_array(),
        rows: rows.map(|row| row.as_vec3().to_array()),
        values: [a, b - a, c - a, d - a],
        rims: rims.map(narrow),
    })
}

/// The length of a step of Newton's method after which what is left is no more than [`NEAR_ENOUGH`].
///
/// A step of length h leaves |J⁻¹| |Δ|, where Δ is what the map from (r, s, t) to places has beside its linear part about the
/// place: no more than h² times the sum of the factors of rs, st, rt and, four times, rst.
fn last_step(placed: &Placed) -> f64 {
    let [_, _, _, _, by_rs, by_st, by_rt, by_rst] = placed.factors();
    let bend = by_rs.length() + by_st.length() + by_rt.length() + 4.0 * by_rst.length();
    let corner = |which: u32| DVec3::from([0, 1, 2].map(|axis| f64::from(which >> axis & 1)));
    let steepest = (0..8).map(|which| {
        let (_, slopes) = placed.at(corner(which));
        let [x, y, z] = slopes.inverse().to_cols_array_2d().map(DVec3::from);
        (x.length_squared() + y.length_squared() + z.length_squared()).sqrt()
    });
    // Not a number, or infinite, where a corner has no inverse, as the tip of a pyramid.
    let steepest = steepest.fold(0.0, |most, own| if own <= most { most } else { own });
    match (NEAR_ENOUGH / (bend * steepest)).sqrt() {
        step if steepest.is_finite() && step > SHORT => step.min(LONGEST),
        _ => SHORT,
    }
}

pub(super) fn of_solid(placed: &Placed, values: [f32; 8], rim: Rim) -> Bent {
    let [low, high] = placed.bounds();
    let about = DVec3::splat(BEYOND);
    // By how fast r, s and t grow in its middle.
    let rims = placed.rows().map(|row| rim.along(row).min(Rim::WIDEST / 10.0));
    let (kind, factors) = (placed.kind(), placed.factors());
    Bent {
        origin: placed.corners()[0].as_vec3().to_array(),
        kind,
        places: factors.map(|by| by.as_vec3().to_array()),
        values: kind.polynomial(values),
        bounds: [(low - about).as_vec3().to_array(), (high + about).as_vec3().to_array()],
        rims: rims.map(narrow),
        last_step: narrow(last_step(placed)),
    }
}

/// The shape functions of the corners.
#[inline(always)]
pub(super) fn weights<S: Simd>(
    simd: S,
    kind: Kind,
    Vec3 { x: r, y: s, z: t }: Vec3<S>,
) -> [Lanes<S>; 8] {
    let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
    match kind {
        Kind::Tetrahedron => [one - r - s - t, r, s, t, zero, zero, zero, zero],
        Kind::Wedge => {
            let (below, first) = (one - t, one - r - s);
            [first * below, r * below, s * below, first * t, r * t, s * t, zero, zero]
        }
        Kind::Pyramid => {
            let (below, r1, s1) = (one - t, one - r, one - s);
            [r1 * s1 * below, r * s1 * below, r * s * below, r1 * s * below, t, zero, zero, zero]
        }
        Kind::Hexahedron => {
            let (below, r1, s1) = (one - t, one - r, one - s);
            let [a, b, c, d] = [r1 * s1, r * s1, r * s, r1 * s];
            [a * below, b * below, c * below, d * below, a * t, b * t, c * t, d * t]
        }
    }
}

impl Straight {
    /// Where places lie in it, and which do.
    #[inline(always)]
    pub(super) fn unit<S: Simd>(&self, simd: S, place: Vec3<S>) -> (Vec3<S>, Mask<S>) {
        let offset = self.offset(place);
        let unit = self.turned(simd, offset);
        let [r, s, t, u] = self.rims;
        let last = all(simd, 1.0) - unit.x - unit.y - unit.z;
        let least = (unit.x + r).min(unit.y + s).min(unit.z + t).min(last + u);
        (unit, least.simd_ge(all(simd, 0.0)))
    }

    #[inline(always)]
    pub(super) fn offset<S: Simd>(&self, place: Vec3<S>) -> Vec3<S> {
        let [x, y, z] = self.origin;
        Vec3 { x: place.x - x, y: place.y - y, z: place.z - z }
    }

    /// (r, s, t) of an offset.
    #[inline(always)]
    pub(super) fn turned<S: Simd>(&self, simd: S, offset: Vec3<S>) -> Vec3<S> {
        let [r, s, t] = self.rows;
        Vec3 {
            x: Vec3::splat(simd, r).dot(offset),
            y: Vec3::splat(simd, s).dot(offset),
            z: Vec3::splat(simd, t).dot(offset),
        }
    }

    #[inline(always)]
    pub(super) fn value<S: Simd>(&self, simd: S, unit: Vec3<S>) -> Lanes<S> {
        let unit = clamped(simd, unit);
        let [v, r, s, t] = self.values;
        Vec3::splat(simd, [r, s, t]).dot(unit) + v
    }
}

impl Bent {
    /// Where Newton's method begins.
    #[inline(always)]
    pub(super) fn middle<S: Simd>(&self, simd: S) -> Vec3<S> {
        let DVec3 { x, y, z } = self.kind.middle();
        Vec3::splat(simd, [narrow(x), narrow(y), narrow(z)])
    }

    /// Where places lie in it, from where they are guessed to, and which of those that ask do.
    #[inline(always)]
    pub(super) fn unit<S: Simd>(
        &self,
        simd: S,
        (place, asks): (Vec3<S>, Mask<S>),
        start: Vec3<S>,
    ) -> (Vec3<S>, Mask<S>) {
        let [ox, oy, oz] = self.origin;
        let aim = Vec3 { x: place.x - ox, y: place.y - oy, z: place.z - oz };
        let (low, high) = (all(simd, -1.0), all(simd, 2.0));
        let factor = |i: usize| Vec3::splat(simd, self.places[i]);
        let [cr, cs, ct, crs, cst, crt, crst] =
            [factor(1), factor(2), factor(3), factor(4), factor(5), factor(6), factor(7)];
        let mut unit = start;
        let mut step = all(simd, 1.0);
        let mut was_far = Mask::splat(simd, false);
        for _ in 0..MOST_STEPS {
            let Vec3 { x: r, y: s, z: t } = unit;
            // What is left of the way, by Horner's rule; and the slopes.
            let along_t = ct.at(cst, s).at(crt.at(crst, s), r);
            let along_s = cs.at(crs, r).at(cst.at(crst, r), t);
            let along_r = cr.at(crs, s).at(crt.at(crst, s), t);
            let flat = Vec3::splat(simd, [0.0; 3]).at(cr, r).at(cs.at(crs, r), s);
            let here = flat.at(along_t, t);
            let off = Vec3 { x: aim.x - here.x, y: aim.y - here.y, z: aim.z - here.z };
            let across = cross(along_s, along_t);
            let determinant = along_r.dot(across);
            let is_sound = determinant.abs().simd_gt(all(simd, 1e-20));
            let share = all(simd, 1.0) / choose(is_sound, determinant, all(simd, 1.0));
            let share = choose(is_sound, share, all(simd, 0.0));
            let by_r = off.dot(across) * share;
            let by_s = off.dot(cross(along_t, along_r)) * share;
            let by_t = off.dot(cross(along_r, along_s)) * share;
            unit = Vec3 {
                x: (r + by_r).max(low).min(high),
                y: (s + by_s).max(low).min(high),
                z: (t + by_t).max(low).min(high),
            };
            // Where slopes have no inverse nothing was found.
            let size = by_r.abs().max(by_s.abs()).max(by_t.abs());
            step = choose(is_sound, size, all(simd, 1.0));
            // Places that are far outside twice do not settle, and need not.
            let is_far = self.beyond(simd, unit).simd_gt(all(simd, 0.5));
            if !any(asks & step.simd_gt(all(simd, self.last_step)) & !(is_far & was_far)) {
                break;
            }
            was_far = is_far;
        }
        let [r, s, t] = self.rims;
        let most = r.max(s).max(t);
        let is_near = self.beyond(simd, unit).simd_le(all(simd, most))
            & (unit.x + r).min(unit.y + s).min(unit.z + t).simd_ge(all(simd, 0.0));
        let is_near = match self.kind {
            // Towards the sides that lean.
            Kind::Tetrahedron | Kind::Wedge => is_near,
            Kind::Pyramid | Kind::Hexahedron => {
                let one = all(simd, 1.0);
                is_near
                    & (one - unit.x + r)
                        .min(one - unit.y + s)
                        .min(one - unit.z + t)
                        .simd_ge(all(simd, 0.0))
            }
        };
        let settled = self.last_step.max(narrow(30.0 * SHORT));
        (unit, asks & is_near & step.simd_le(all(simd, settled)))
    }

    /// The places in its box.
    #[inline(always)]
    pub(super) fn is_about<S: Simd>(&self, simd: S, place: Vec3<S>) -> Mask<S> {
        let [low, high] = self.bounds;
        let mut is_about = Mask::splat(simd, true);
        for (place, (low, high)) in
            [place.x, place.y, place.z].into_iter().zip(low.into_iter().zip(high))
        {
            is_about &= place.simd_ge(all(simd, low)) & place.simd_le(all(simd, high));
        }
        is_about
    }

    /// Depths between which rays are in its box, by 1 over their directions.
    #[inline(always)]
    pub(super) fn span<S: Simd>(&self, packet: &Packet<S>, inverse: Vec3<S>) -> [Lanes<S>; 2] {
        let [low, high] = self.bounds;
        let x = [
            (packet.origin.x * -1.0 + low[0]) * inverse.x,
            (packet.origin.x * -1.0 + high[0]) * inverse.x,
        ];
        let y = [
            (packet.origin.y * -1.0 + low[1]) * inverse.y,
            (packet.origin.y * -1.0 + high[1]) * inverse.y,
        ];
        let z = [
            (packet.origin.z * -1.0 + low[2]) * inverse.z,
            (packet.origin.z * -1.0 + high[2]) * inverse.z,
        ];
        [
            x[0].min(x[1]).max(y[0].min(y[1])).max(z[0].min(z[1])),
            x[0].max(x[1]).min(y[0].max(y[1])).min(z[0].max(z[1])),
        ]
    }

    /// How far (r, s, t) lies beyond its region.
    #[inline(always)]
    fn beyond<S: Simd>(&self, simd: S, Vec3 { x: r, y: s, z: t }: Vec3<S>) -> Lanes<S> {
        let one = all(simd, 1.0);
        let below = (-r).max(-s).max(-t);
        match self.kind {
            Kind::Tetrahedron => below.max(r + s + t - one),
            Kind::Wedge => below.max(r + s - one).max(t - one),
            Kind::Pyramid | Kind::Hexahedron => below.max(r - one).max(s - one).max(t - one),
        }
    }

    #[inline(always)]
    pub(super) fn value<S: Simd>(&self, simd: S, unit: Vec3<S>) -> Lanes<S> {
        let Vec3 { x: r, y: s, z: t } = clamped(simd, unit);
        let [v, vr, vs, vt, vrs, vst, vrt, vrst] = self.values;
        let at = |x: f32| all(simd, x);
        let along_t = r.mul_add(s.mul_add(at(vrst), at(vrt)), s.mul_add(at(vst), at(vt)));
        let along_s = r.mul_add(at(vrs), at(vs));
        t.mul_add(along_t, s.mul_add(along_s, r.mul_add(at(vr), at(v))))
    }
}

/// Between 0 and 1.
#[inline(always)]
pub(super) fn clamped<S: Simd>(simd: S, unit: Vec3<S>) -> Vec3<S> {
    let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
    Vec3 {
        x: unit.x.max(zero).min(one),
        y: unit.y.max(zero).min(one),
        z: unit.z.max(zero).min(one),
    }
}

#[inline(always)]
pub(super) fn cross<S: Simd>(a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    Vec3 {
        x: (a.y * b.z) - (a.z * b.y),
        y: (a.z * b.x) - (a.x * b.z),
        z: (a.x * b.y) - (a.y * b.x),
    }
}

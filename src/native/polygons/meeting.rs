//! Where lines through the picture meet a triangle.

use glam::{DVec2, DVec3};

use crate::scene::View;

/// Where the samples of a pixel are, from its upper left.
pub(super) const SAMPLES: [[f64; 2]; 4] =
    [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];
/// The same in eighths of a pixel.
pub(super) const EIGHTHS: [[i32; 2]; 4] = [[3, 1], [7, 3], [1, 5], [5, 7]];
/// How far beside their places samples may be met, pixels.
pub(super) const ROUNDING: f64 = 0.01;
/// What is nearer to the eye than this share of its distance to the focal plane is left out.
pub(super) const NEAREST: f64 = 1e-4;

/// Where the eye is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Eye {
    /// How far before the focal plane, pixels; `None` where rays are parallel.
    pub(super) distance: Option<f64>,
    /// How far the frame's centre lies beyond the focal plane.
    pub(super) beyond: f64,
    /// The least depth beyond the frame's centre that is seen.
    pub(super) nearest: f64,
}

impl Eye {
    pub(super) fn of(view: &View) -> Self {
        let (distance, beyond) = (view.eye_distance, view.view_centre.z);
        let nearest = distance.map_or(f64::NEG_INFINITY, |eye| eye * NEAREST - beyond);
        Self { distance, beyond, nearest }
    }

    /// The part that a pixel at the focal plane is as long at a depth beyond the frame's centre.
    pub(super) fn scale(&self, depth: f64) -> f64 {
        self.distance.map_or(1.0, |eye| (depth + self.beyond) / eye)
    }
}

/// Whether a box holds any sample of any pixel, rounding included: `[[left, right], [top, bottom]]` from the picture's upper left.
/// A box far beyond the picture may be said to hold one.
pub(super) fn has_sample(ends: [[f64; 2]; 2]) -> bool {
    // Samples lie at odd eighths of a pixel, and conversions to whole numbers, which round towards 0, take a fraction of the time that
    // rounding down takes where processors have no instruction for that.
    const BEYOND: f64 = (1 << 20) as f64;
    #[expect(clippy::cast_possible_truncation, reason = "clamped")]
    let eighths = |at: f64| (8.0 * (at + BEYOND)).clamp(-1e9, 1e9) as i32;
    // The first eighth after the lower end, and the last one before the upper end.
    let [x, y] = ends.map(|[low, high]| [eighths(low - ROUNDING) + 1, eighths(high + ROUNDING)]);
    let holds = |[low, high]: [i32; 2], eighth: i32| (high - eighth) >> 3 > (low - eighth - 1) >> 3;
    EIGHTHS.iter().any(|[right, down]| holds(x, *right) & holds(y, *down))
}

/// A triangle as lines through the picture meet it.
///
/// A line through the place s of the picture passes corner i, at that corner's own depth, at pᵢ − s kᵢ, k the part that a
/// pixel at the focal plane is as long there. Products of two of these are the corner's share in where the line meets
/// the triangle's plane, and linear in s: nothing is divided by, so that triangles that reach behind the eye need no
/// cutting; and of two triangles the share at an edge of both is the same but for its sign, so that they leave no seam.
pub(super) struct Seen {
    /// Of each corner's share: at the picture's middle, and its growth to the right and up.
    shares: [[f64; 3]; 3],
    /// Its growth from the upper left corner of a pixel to each sample.
    to_samples: [[f64; 4]; 3],
    /// The least share of each corner where a sample is covered: of two triangles at an edge one has what is 0.
    least: [f64; 3],
    depths: [f64; 3],
    /// The least depth that is seen, where it reaches nearer than that.
    nearest: Option<f64>,
}

impl Seen {
    /// `None` where it is seen from its edge, or lies behind the eye, or where a corner is not a number.
    pub(super) fn new(corners: [DVec3; 3], eye: &Eye) -> Option<Self> {
        /// The least number that is greater than 0.
        const MORE_THAN_0: f64 = f64::from_bits(1);
        let depths = [corners[0].z, corners[1].z, corners[2].z];
        let is_before = |depth: &f64| *depth >= eye.nearest;
        if !depths.iter().any(is_before) {
            return None;
        }
        let scales = [eye.scale(depths[0]), eye.scale(depths[1]), eye.scale(depths[2])];
        let share = |b: usize, c: usize| {
            let (p, q) = (corners[b], corners[c]);
            let (k, l) = (scales[b], scales[c]);
            // (p − s k) × (q − s l).
            [p.x * q.y - p.y * q.x, k * -q.y - l * -p.y, k * q.x - l * p.x]
        };
        let mut shares = [share(1, 2), share(2, 0), share(0, 1)];
        // Which way round it is seen: the volume under the eye.
        let around = corners[0].truncate().extend(scales[0]).dot(
            corners[1].truncate().extend(scales[1]).cross(corners[2].truncate().extend(scales[2])),
        );
        if around == 0.0 || !around.is_finite() {
            return None;
        }
        let is_first = |b: usize, c: usize| {
            let key = |i: usize| [corners[i].x, corners[i].y, corners[i].z];
            key(b) < key(c)
        };
        let owns = [is_first(1, 2), is_first(2, 0), is_first(0, 1)];
        let is_behind = around < 0.0;
        let side = if is_behind { -1.0 } else { 1.0 };
        let mut to_samples = [[0.0; SAMPLES.len()]; 3];
        let mut least = [0.0; 3];
        for i in 0..3 {
            for number in &mut shares[i] {
                *number *= side;
            }
            for (to_sample, [right, down]) in to_samples[i].iter_mut().zip(SAMPLES) {
                *to_sample = shares[i][1] * right - shares[i][2] * down;
            }
            if owns[i] == is_behind {
                least[i] = MORE_THAN_0;
            }
        }
        let nearest = (!depths.iter().all(is_before)).then_some(eye.nearest);
        Some(Self { shares, to_samples, least, depths, nearest })
    }

    #[inline(always)]
    fn shares_at(&self, at: DVec2) -> [f64; 3] {
        let share = |i: usize| {
            let [share, right, up] = self.shares[i];
            share + (right * at.x + up * at.y)
        };
        [share(0), share(1), share(2)]
    }

    /// The samples of a pixel whose lines meet it in front of the eye, a bit each, by the pixel's upper left corner.
    pub(super) fn covers(&self, corner: DVec2) -> u8 {
        let shares = self.shares_at(corner);
        let mut is_in = [true; SAMPLES.len()];
        for ((share, least), to_samples) in shares.into_iter().zip(self.least).zip(self.to_samples)
        {
            for (is_in, to_sample) in is_in.iter_mut().zip(to_samples) {
                *is_in &= share + to_sample >= least;
            }
        }
        if let Some(nearest) = self.nearest {
            for (bit, is_in) in is_in.iter_mut().enumerate() {
                let own = |i: usize| shares[i] + self.to_samples[i][bit];
                let own = [own(0), own(1), own(2)];
                let depth = own.iter().zip(self.depths).map(|(s, depth)| s * depth).sum::<f64>();
                *is_in &= depth / own.iter().sum::<f64>() >= nearest;
            }
        }
        is_in.iter().enumerate().fold(0, |all, (bit, is_in)| all | u8::from(*is_in) << bit)
    }

    /// The place on it that is nearest to where that line meets its plane, in its own coordinates: how deep it is, and
    /// the shares of the corners.
    pub(super) fn place(&self, at: DVec2) -> (f64, [f64; 3]) {
        let inner = self.shares_at(at).map(|s| s.max(0.0));
        let sum: f64 = inner.iter().sum();
        let shares = if sum > 0.0 { inner.map(|s| s / sum) } else { [1.0 / 3.0; 3] };
        (shares.iter().zip(self.depths).map(|(s, depth)| s * depth).sum(), shares)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Camera, Projection};
    use crate::volume::Lattice;

    /// A square in the plane that is looked at, cut into triangles about a grid of corners; some lie on samples.
    fn square(corners: usize) -> Vec<[DVec3; 3]> {
        let at = |i: usize| {
            let [x, y] = [i % corners, i / corners].map(|n| n as f64 - (corners / 2) as f64);
            DVec3::new(3.0 * x + 0.375, 3.0 * y - 0.125, 2.0 * x - 0.5 * y)
        };
        let triangle = |corners: [usize; 3]| corners.map(at);
        let cells = (0..(corners - 1) * (corners - 1)).map(|i| {
            let first = i / (corners - 1) * corners + i % (corners - 1);
            // Every other one the other way round.
            let [b, c] = if i % 2 == 0 { [1, corners] } else { [corners, 1] };
            [[first, first + b, first + c], [first + 1 + corners, first + c, first + b]]
        });
        cells.flatten().map(triangle).collect()
    }

    #[test]
    fn triangles_beside_one_another_leave_no_seam_and_share_no_sample() {
        let lattice = Lattice::unit([9; 3]);
        for projection in [Projection::Orthographic, Projection::Perspective { view_angle: 0.9 }] {
            let camera =
                Camera { projection, ..Camera::new(DVec3::ZERO, DVec3::Z, DVec3::Y, 20.0) };
            let view = View::of(&camera, &lattice, [24, 24]);
            let triangles = square(17);
            let eye = Eye::of(&view);
            let seen: Vec<Seen> = triangles.iter().filter_map(|t| Seen::new(*t, &eye)).collect();
            let mut covered = 0;
            for i in 0..48 * 48 {
                // In quarters of a pixel, so that samples lie on the edges, too.
                let at = [i % 48, i / 48].map(|n| f64::from(n) * 0.25 - 6.0);
                let mut counts = [0; SAMPLES.len()];
                for samples in seen.iter().map(|seen| seen.covers(DVec2::from(at))) {
                    for (bit, count) in counts.iter_mut().enumerate() {
                        *count += samples >> bit & 1;
                    }
                }
                assert_eq!(counts, [1; SAMPLES.len()], "{projection:?} {at:?}");
                covered += 1;
            }
            assert_eq!(covered, 48 * 48);
        }
    }

    #[test]
    fn boxes_between_all_samples_are_known_from_those_with_one() {
        let mut without = 0;
        for i in 0..4000 {
            let share = |by: f64| (f64::from(i) * by).fract();
            let low = DVec2::new(5.0 * share(0.754_877_7) - 1.0, 5.0 * share(0.569_840_3) - 1.0);
            let high = low + DVec2::new(share(0.323_45), share(0.819_17));
            let is_in = |at: DVec2| at.cmpge(low).all() && at.cmple(high).all();
            let has_one = (-3..8).any(|x| {
                (-3..8).any(|y| {
                    let corner = DVec2::new(f64::from(x), f64::from(y));
                    SAMPLES.iter().any(|sample| is_in(corner + DVec2::from(*sample)))
                })
            });
            let found = has_sample([[low.x, high.x], [low.y, high.y]]);
            assert!(found || !has_one, "{low} {high}");
            without += usize::from(!found);
        }
        assert!((1000..3000).contains(&without), "{without} of 4000");
    }

    #[test]
    fn a_triangle_that_reaches_behind_the_eye_is_seen_as_far_as_it_lies_before_it() {
        let lattice = Lattice::unit([9; 3]);
        let projection = Projection::Perspective { view_angle: 0.9 };
        let camera =
            Camera { projection, ..Camera::new(lattice.centre(), DVec3::Z, DVec3::Y, 20.0) };
        let view = View::of(&camera, &lattice, [24, 24]);
        let eye = view.eye_distance.expect("a perspective");
        // A floor one pixel under the eye, from far behind it to far before it.
        let corners = [[-9e3, -1.0, -9e3], [9e3, -1.0, -9e3], [0.0, -1.0, 9e5]].map(DVec3::from);
        let corners = corners.map(|corner| corner - DVec3::Z * view.view_centre.z);
        let seen = Seen::new(corners, &Eye::of(&view)).expect("it is seen");
        // The first sample of the pixel that has it there.
        let covers = |x: f64, y: f64| {
            let [right, down] = SAMPLES[0];
            seen.covers(DVec2::new(x - right, y + down)) & 1 == 1
        };
        for x in [-11.0, -3.0, 0.0, 8.0] {
            for y in [-11.0, -4.0, -0.5] {
                assert!(covers(x, y), "{x} {y}: the floor");
                assert!(!covers(x, -y), "{x} {y}: the sky");
                let (depth, _) = seen.place(DVec2::new(x, y));
                // y = −1 · eye / depth, from the eye.
                let expected = -eye / y - view.view_centre.z;
                assert!((depth - expected).abs() < 1e-6 * expected.abs(), "{depth} {expected}");
            }
        }
    }
}

//! A field at several levels: which one rays find where they are.

use fearless_simd::{Simd, i32x8, prelude::*};

use super::lanes::{LANES, Lanes, Mask, Vec3, all};
use super::lattice::{Lattice, Method};
use crate::plan::{COARSER, EMPTY, FieldCut, LOOKS, SEGMENT};

/// A cut of a field, and what it is drawn from beside the field itself.
#[derive(Debug, Clone, Copy)]
pub(super) struct Levels<'a> {
    coarser: &'a [Lattice; COARSER],
    cut: &'a FieldCut,
    /// What the stored values of means are raised by to be those of the field.
    shifts: [f32; COARSER],
}

impl<'a> Levels<'a> {
    /// Of a field.
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
    pub(super) fn new(field: &Lattice, coarser: &'a [Lattice; COARSER], cut: &'a FieldCut) -> Self {
        let shifts = [0, 1].map(|i| (coarser[i].bias - field.bias) as f32);
        Self { coarser, cut, shifts }
    }
}

impl Levels<'_> {
    /// The finest level that any of some rays finds between two depths.
    #[inline(always)]
    pub(super) fn finest<S: Simd>(
        &self,
        simd: S,
        (origin, direction): (Vec3<S>, Vec3<S>),
        [near, far]: [Lanes<S>; 2],
        rays: Mask<S>,
    ) -> u8 {
        let levels = self.cut.levels();
        let [nx, ny, _] = self.cut.dims;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_possible_wrap,
            reason = "MOST_STORED"
        )]
        let (row, plane, none) = (nx as i32, (nx * ny) as i32, levels.len() as i32 - 1);
        let mut finest = EMPTY;
        for share in LOOKS {
            let place = origin.at(direction, (far - near).mul_add(all(simd, share), near));
            let brick = |p: Lanes<S>, n: usize| {
                let b = ((p + 1.0) * 0.25).floor();
                // Not a number is 0.
                b.max(all(simd, 0.0)).min(all(simd, n as f32 - 1.0)).to_int::<i32x8<S>>()
            };
            let [x, y, z] = [place.x, place.y, place.z];
            let [bx, by, bz] = self.cut.dims;
            let at = brick(z, bz) * i32x8::splat(simd, plane)
                + brick(y, by) * i32x8::splat(simd, row)
                + brick(x, bx);
            let at = rays.select(at, i32x8::splat(simd, none)).to_array();
            for lane in 0..LANES {
                #[expect(clippy::cast_sign_loss, reason = "clamped")]
                let level = levels[at[lane] as usize];
                finest = finest.min(level);
            }
        }
        finest
    }

    /// The stored value at places in the index space of the field, of a level of means.
    #[inline(always)]
    pub(super) fn value<S: Simd>(&self, simd: S, level: u8, place: Vec3<S>) -> Lanes<S> {
        let i = usize::from(level) - 1;
        let value = self.coarser[i].value(simd, Method::Linear, within(simd, level, place));
        value + self.shifts[i]
    }

    /// That, and its growth per index of the field.
    #[inline(always)]
    pub(super) fn value_with_growth<S: Simd>(
        &self,
        simd: S,
        level: u8,
        place: Vec3<S>,
    ) -> (Lanes<S>, Vec3<S>) {
        let i = usize::from(level) - 1;
        let place = within(simd, level, place);
        let (value, growth) = self.coarser[i].value_with_growth(simd, Method::Linear, place);
        (value + self.shifts[i], growth.scaled(all(simd, scale(level))))
    }

    /// Growth of that per index of the field.
    #[inline(always)]
    pub(super) fn gradient<S: Simd>(&self, simd: S, level: u8, place: Vec3<S>) -> Vec3<S> {
        let lattice = &self.coarser[usize::from(level) - 1];
        let growth = lattice.gradient(simd, Method::Linear, within(simd, level, place));
        growth.scaled(all(simd, scale(level)))
    }
}

/// Samples of a level a sample of the field.
#[inline(always)]
fn scale(level: u8) -> f32 {
    if level == 1 { 0.5 } else { 0.25 }
}

/// A place among the means of a level: the first is in the middle of the samples that it stands for.
#[inline(always)]
fn within<S: Simd>(simd: S, level: u8, place: Vec3<S>) -> Vec3<S> {
    let scale = all(simd, scale(level));
    let offset = scale * 0.5 - 0.5;
    Vec3 {
        x: place.x.mul_add(scale, offset),
        y: place.y.mul_add(scale, offset),
        z: place.z.mul_add(scale, offset),
    }
}

/// The slabs of the segments that some slabs lie in, the first and the last.
pub(super) fn segments_of([first, last]: [i32; 2]) -> [i32; 2] {
    [first.div_euclid(SEGMENT) * SEGMENT, last.div_euclid(SEGMENT) * SEGMENT + SEGMENT - 1]
}

/// What a walk along a run of slabs asks for next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    /// The face before a slab, or behind one, of a level.
    Face(i32, u8),
    /// Nothing shows from here to where the next face is.
    Gap,
}

/// The faces of a run of slabs, of the levels found on the way.
pub(super) struct Faces {
    /// The next face, and the last.
    next: i32,
    last: i32,
    /// Of the segment that is walked through: its end, and its level.
    end: i32,
    level: u8,
    /// The face that the next slab begins with is known.
    is_joined: bool,
    ended: bool,
}

impl Faces {
    /// Of the slabs from `first` to `last`, which are whole segments.
    pub(super) fn new([first, last]: [i32; 2]) -> Self {
        Self {
            next: first,
            last: last + 1,
            end: first,
            level: EMPTY,
            is_joined: false,
            ended: false,
        }
    }

    /// The next face; `level_of` says which level a segment has that begins with a face.
    #[inline(always)]
    pub(super) fn next(&mut self, mut level_of: impl FnMut(i32) -> u8) -> Option<Next> {
        loop {
            if self.next < self.end {
                // Within a segment: the face behind the next slab.
                self.next += 1 << self.level;
                return Some(Next::Face(self.next, self.level));
            }
            if self.next >= self.last {
                // What lies behind the last slab says nothing of it.
                let first_time = !std::mem::replace(&mut self.ended, true);
                return first_time.then_some(Next::Gap);
            }
            self.level = level_of(self.next);
            if self.level == EMPTY {
                self.next += SEGMENT;
                self.end = self.next;
                if std::mem::replace(&mut self.is_joined, false) {
                    return Some(Next::Gap);
                }
                continue;
            }
            self.end = self.next + SEGMENT;
            if !std::mem::replace(&mut self.is_joined, true) {
                return Some(Next::Face(self.next, self.level));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use fearless_simd::Level;

    use super::*;
    use crate::core::Ticket;
    use crate::kernel::{Averaged, Coefficients, Kernel, coefficients};
    use crate::native::lanes::dispatched;
    use crate::scene::SplatSettings;
    use crate::volume::{Lattice as Grid, Samples, ScalarVolume};

    fn walked(run: [i32; 2], levels: &[u8]) -> Vec<Next> {
        let mut faces = Faces::new(segments_of(run));
        let level_of = |k: i32| {
            assert_eq!(k % SEGMENT, 0, "segments begin everywhere in a picture alike");
            levels[(k / SEGMENT) as usize]
        };
        std::iter::from_fn(|| faces.next(level_of)).collect()
    }

    #[test]
    fn faces_are_as_far_apart_as_their_level_says_and_gaps_part_what_is_not_joined() {
        use Next::{Face, Gap};
        let fine = [Face(0, 0), Face(1, 0), Face(2, 0), Face(3, 0), Face(4, 0)];
        assert_eq!(walked([1, 2], &[0]), [&fine[..], &[Gap]].concat());
        // Finer after coarser begins with the face that the coarser one ended with.
        let joined = [Face(0, 2), Face(4, 2), Face(6, 1), Face(8, 1), Face(9, 0)];
        assert_eq!(walked([0, 11], &[2, 1, 0])[..5], joined);
        let parted = [Face(4, 1), Face(6, 1), Face(8, 1), Gap, Face(12, 2), Face(16, 2), Gap];
        assert_eq!(walked([3, 15], &[EMPTY, 1, EMPTY, 2]), parted);
        assert_eq!(walked([0, 7], &[EMPTY, EMPTY]), [Gap]);
    }

    const DIMS: [usize; 3] = [16, 12, 20];

    fn ramp(x: f64, y: f64, z: f64) -> f64 {
        1e6 + 3.0 * x - 2.0 * y + 0.5 * z
    }

    /// A ramp, and its means, whose bias is another.
    fn ramp_and_means() -> (Lattice, [Lattice; COARSER]) {
        let ticket = Ticket::new();
        let [nx, ny, nz] = DIMS;
        let places = |step: usize| {
            let [nx, ny, nz] = [nx / step, ny / step, nz / step];
            let middle = move |i: usize| (i * step) as f64 + (step as f64 - 1.0) / 2.0;
            (0..nx * ny * nz)
                .map(move |i| ramp(middle(i % nx), middle(i / nx % ny), middle(i / (nx * ny))))
        };
        let samples = Samples::Float64(places(1).collect());
        let volume = ScalarVolume::from_samples("ramp", Grid::unit(DIMS), samples).expect("made");
        let volume = Arc::new(volume);
        let mode = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };
        let made = coefficients(&volume, Kernel::Linear, None, true, &ticket).expect("they fit");
        let own = Lattice::new(&volume, (&mode, false), made, &ticket).expect("not cancelled");
        let means = [1_u32, 2].map(|level| {
            let step = 1 << level;
            let values = places(step).map(|v| (v - 999_990.0) as f32).collect();
            let averaged = Averaged { level, volume_dims: DIMS, half_widths: Vec::new() };
            let dims = DIMS.map(|n| n / step);
            let made = Coefficients::of_means(dims, values, 999_990.0, averaged, &ticket);
            Lattice::new(&volume, (&mode, true), made.expect("made"), &ticket).expect("made")
        });
        (own, means)
    }

    #[test]
    fn means_of_a_ramp_have_its_values_and_its_growth_at_every_level() {
        let (own, means) = ramp_and_means();
        let cut = FieldCut::new([1, 1, 1], vec![0]);
        let levels = Levels::new(&own, &means, &cut);
        for place in [[4.0_f32, 3.5, 7.25], [9.1, 6.0, 11.9], [6.5, 5.5, 9.5]] {
            let [x, y, z] = place.map(f64::from);
            for level in [1, 2] {
                let (value, growth) = dispatched!(Level::new(), simd => {
                    let place = Vec3::splat(simd, place);
                    (levels.value(simd, level, place)[3], levels.gradient(simd, level, place).lane(5))
                });
                let off = f64::from(value) + own.bias - ramp(x, y, z);
                assert!(off.abs() < 1e-3, "level {level} at {place:?}: off by {off}");
                for (growth, expected) in growth.into_iter().zip([3.0, -2.0, 0.5]) {
                    assert!((growth - expected).abs() < 1e-4, "level {level}: {growth}");
                }
            }
        }
    }

    #[test]
    fn the_finest_level_that_a_ray_meets_is_found_and_rays_that_are_done_do_not_count() {
        let (own, means) = ramp_and_means();
        let bricks = own.bricks.dims;
        let level_of = |i: usize| match i {
            i if i % 23 == 5 => 1,
            i if i % 3 == 0 => EMPTY,
            _ => 2,
        };
        let cut = FieldCut::new(bricks, (0..bricks.iter().product()).map(level_of).collect());
        let levels = Levels::new(&own, &means, &cut);
        let at = |place: [f32; 3]| {
            let b = [0, 1, 2]
                .map(|a| (((place[a] + 1.0) / 4.0).floor().max(0.0) as usize).min(bricks[a] - 1));
            level_of((b[2] * bricks[1] + b[1]) * bricks[0] + b[0])
        };
        let mut found_of = [0; 4];
        for i in 0..64 {
            let spread = |n: usize| ((i * n) % 97) as f32 / 97.0;
            let origins: [[f32; 3]; LANES] = std::array::from_fn(|lane| {
                let x = spread(7919) * 15.0 + (lane % 4) as f32 * 0.7;
                let y = spread(104_729) * 11.0 + (lane / 4) as f32 * 0.7;
                [x, y, -2.0]
            });
            let direction = [0.1, -0.05, 1.0];
            let rays = 0b1101_1010_u64;
            let (near, far) = (spread(31) * 18.0, spread(31) * 18.0 + 4.0);
            let found = dispatched!(Level::new(), simd => {
                let axis = |a: usize| Lanes::load_array(simd, origins.map(|origin| origin[a]));
                let origin = Vec3 { x: axis(0), y: axis(1), z: axis(2) };
                let rays = Mask::from_bitmask(simd, rays);
                let ends = [all(simd, near), all(simd, far)];
                levels.finest(simd, (origin, Vec3::splat(simd, direction)), ends, rays)
            });
            let mut expected = EMPTY;
            for (_, origin) in origins.iter().enumerate().filter(|(i, _)| rays >> i & 1 == 1) {
                for share in [0.2, 0.8] {
                    let t = near + (far - near) * share;
                    let place = [0, 1, 2].map(|a| origin[a] + direction[a] * t);
                    expected = expected.min(at(place));
                }
            }
            assert_eq!(found, expected, "{i}");
            found_of[usize::from(found)] += 1;
        }
        assert!(found_of[1] > 3 && found_of[2] > 5, "levels differ: {found_of:?}");
    }
}

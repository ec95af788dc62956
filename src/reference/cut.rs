//! A field of which parts are drawn from means of its samples: bricks of 4³ cells at three levels.

use glam::DVec3;

use super::classes::Classes;
use super::field::{Field, Shape, filled, mirrored};
use super::inside::{Part, Slice};
use super::layers::Planes;
use super::shading::{RayShader, gradient};
use super::sources::Line;
use crate::volume::ScalarVolume;

/// Edge of a brick, cells between samples, and slabs for which one level is found.
const BRICK: i64 = 4;
/// Where in these the level is asked for, as shares of the part of the ray that lies in them.
const LOOKS: [f64; 2] = [0.2, 0.8];
/// Of a brick that is left out.
const EMPTY: u8 = 3;

/// Plain means of blocks of samples, those that the lattice has of a block.
struct Means {
    edge: usize,
    dims: [usize; 3],
    values: Vec<f64>,
}

impl Means {
    fn new(volume: &ScalarVolume, edge: usize) -> Self {
        let all = volume.lattice.dims;
        let dims = all.map(|n| n.div_ceil(edge));
        let mut sums = vec![(0.0, 0.0); dims.iter().product()];
        for i in 0..volume.samples.len() {
            let at = [i % all[0], i / all[0] % all[1], i / (all[0] * all[1])].map(|n| n / edge);
            let value = volume.samples.get(i);
            if !value.is_nan() {
                let (sum, count) = &mut sums[(at[2] * dims[1] + at[1]) * dims[0] + at[0]];
                (*sum, *count) = (*sum + value, *count + 1.0);
            }
        }
        let values = sums.into_iter().map(|(sum, count)| sum / count).collect();
        Self { edge, dims, values: filled(values, dims) }
    }

    /// Value and growth per index of the field: tents through the means, each in the middle of its block.
    fn at(&self, place: DVec3) -> (f64, DVec3) {
        let edge = self.edge as f64;
        let within = (place - (edge - 1.0) / 2.0) / edge;
        let cell = within.floor();
        let f = within - cell;
        let (mut value, mut growth) = (0.0, DVec3::ZERO);
        for corner in 0..8_usize {
            let bits = [corner & 1, corner >> 1 & 1, corner >> 2];
            let [x, y, z] = [0, 1, 2].map(|a| {
                let index = cell[a] as i64 + bits[a] as i64;
                mirrored(index, self.dims[a])
            });
            let own = self.values[(z * self.dims[1] + y) * self.dims[0] + x];
            let weight = |a: usize| if bits[a] == 1 { f[a] } else { 1.0 - f[a] };
            let slope = |a: usize| if bits[a] == 1 { 1.0 } else { -1.0 };
            let [a, b, c] = [0, 1, 2].map(weight);
            value += own * a * b * c;
            growth += own * DVec3::new(slope(0) * b * c, a * slope(1) * c, a * b * slope(2));
        }
        (value, growth / edge)
    }
}

/// A level for each brick.
pub(super) struct Cut {
    bricks: [usize; 3],
    levels: Vec<u8>,
    means: [Means; 2],
}

/// What a ray finds at a face.
struct Face {
    t: f64,
    value: f64,
    level: u8,
}

impl Cut {
    /// Brick b has the places from 4b − 1 to 4b + 3 along each axis, x fastest.
    pub(super) fn new(volume: &ScalarVolume, (bricks, levels): ([usize; 3], &[u8])) -> Self {
        Self { bricks, levels: levels.to_vec(), means: [2, 4].map(|edge| Means::new(volume, edge)) }
    }

    /// Whether it is one of a field between samples of which means make sense.
    pub(super) fn is_of(shape: Shape) -> bool {
        matches!(shape, Shape::Separable(_))
    }

    fn level_at(&self, place: DVec3) -> u8 {
        let [x, y, z] = [0, 1, 2].map(|a| {
            let brick = ((place[a] + 1.0) / BRICK as f64).floor().max(0.0) as usize;
            brick.min(self.bricks[a] - 1)
        });
        self.levels[(z * self.bricks[1] + y) * self.bricks[0] + x]
    }

    fn growth(&self, field: &Field, place: DVec3, level: u8) -> DVec3 {
        match level {
            0 => gradient(field, place),
            level => self.means[usize::from(level) - 1].at(place).1,
        }
    }

    /// Slabs of the cut, clipped to a part of the ray, from front to back, with all values between their faces: of the field
    /// itself two halves, along a parabola where four faces of it are there; of means whole ones, as many times thicker as
    /// the means are wide.
    pub(super) fn classified(
        &self,
        (field, classes): (&Field, &Classes),
        planes: &Planes,
        ray: RayShader<'_>,
        part: &Part,
    ) -> Vec<Slice> {
        let ([a, b], line) = (part.ends, ray.index);
        let mut slices = Vec::new();
        let mut faces: Vec<Face> = Vec::new();
        let first = planes.layer_of(a).div_euclid(BRICK) * BRICK;
        for segment in (first..=planes.layer_of(b)).step_by(BRICK as usize) {
            let ends = [segment, segment + BRICK].map(|face| planes.face(face).clamp(a, b));
            let look = |share: f64| self.level_at(line.at(ends[0] + share * (ends[1] - ends[0])));
            let level = LOOKS.map(look).into_iter().min().unwrap_or(EMPTY);
            if level >= EMPTY || ends[0] >= ends[1] {
                slices.extend(self.run((field, classes), &faces, planes, ray));
                faces.clear();
                continue;
            }
            let face = |number: i64| {
                let t = planes.face(number).clamp(a, b);
                Some(Face { t, value: self.value(field, line, t, level)?, level })
            };
            // A segment begins with the face that the one before it ended with.
            let begin = if faces.is_empty() { segment } else { segment + (1 << level) };
            faces.extend((begin..=segment + BRICK).step_by(1 << level).filter_map(face));
        }
        slices.extend(self.run((field, classes), &faces, planes, ray));
        slices
    }

    fn value(&self, field: &Field, line: &Line, t: f64, level: u8) -> Option<f64> {
        match level {
            0 => field.value(line.at(t)),
            level => Some(self.means[usize::from(level) - 1].at(line.at(t)).0),
        }
    }

    /// Slabs between faces that follow one another.
    fn run(
        &self,
        (field, classes): (&Field, &Classes),
        faces: &[Face],
        planes: &Planes,
        ray: RayShader<'_>,
    ) -> Vec<Slice> {
        let mut slices = Vec::new();
        for (i, pair) in faces.windows(2).enumerate() {
            let [near, far] = [&pair[0], &pair[1]];
            let ends = [near.t, far.t];
            if ends[0] >= ends[1] {
                continue;
            }
            let (slab, t) = (0, f64::midpoint(near.t, far.t));
            if field.is_hole(ray.index.at(t)) {
                let density = classes.at(f64::NAN);
                slices.extend((density[0] > 0.0).then_some(Slice { slab, ends, density }));
                continue;
            }
            let value = f64::midpoint(near.value, far.value);
            let growth = |face: &Face| self.growth(field, ray.index.at(face.t), face.level);
            let shaded =
                |density| ray.shaded_with(density, t, value, || [growth(near), growth(far)]);
            if far.level > 0 {
                let density = shaded(classes.mean(near.value, far.value));
                slices.push(Slice { slab, ends, density });
                continue;
            }
            let bend = || {
                let (before, after) = (faces.get(i.checked_sub(1)?)?, faces.get(i + 2)?);
                let are_fine = before.level + near.level + after.level == 0;
                let are_whole = after.t - before.t >= 2.99 * planes.step;
                (are_fine && are_whole)
                    .then(|| (near.value + far.value - before.value - after.value) / 24.0)
            };
            let bend = bend().unwrap_or(0.0);
            let middle = value + 1.5 * bend;
            let half = |from, to| shaded(classes.mean(from + bend / 4.0, to + bend / 4.0));
            let density = half(near.value, middle);
            slices.push(Slice { slab, ends: [near.t, t], density });
            let density = half(middle, far.value);
            slices.push(Slice { slab, ends: [t, far.t], density });
        }
        slices
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};

    /// Blocks that the border cuts stand for the samples that they have; holes count for nothing.
    #[test]
    fn means_are_those_of_their_blocks_and_straight_between_them() {
        let dims = [6, 5, 1];
        let value = |i: usize| if i == 0 { f64::NAN } else { (i * i % 23) as f64 };
        let samples = Samples::Float64((0..30).map(value).collect());
        let volume = ScalarVolume::from_samples("few", Lattice::unit(dims), samples).unwrap();
        let means = Means::new(&volume, 4);
        assert_eq!(means.dims, [2, 2, 1]);
        let of = |xs: std::ops::Range<usize>, ys: std::ops::Range<usize>| {
            let all = ys.flat_map(|y| xs.clone().map(move |x| y * 6 + x));
            let values: Vec<f64> = all.map(value).filter(|v| !v.is_nan()).collect();
            values.iter().sum::<f64>() / values.len() as f64
        };
        let [a, b, c] = [of(0..4, 0..4), of(4..6, 0..4), of(0..4, 4..5)];
        let middle = DVec3::new(1.5, 1.5, 0.0);
        assert!((means.at(middle).0 - a).abs() < 1e-12);
        assert!((means.at(middle + DVec3::X * 4.0).0 - b).abs() < 1e-12);
        let (value, growth) = means.at(middle + DVec3::X);
        assert!((value - (0.75 * a + 0.25 * b)).abs() < 1e-12);
        assert!((growth.x - (b - a) / 4.0).abs() < 1e-12 && growth.z.abs() < 1e-12);
        assert!((means.at(middle).1.y - (c - a) / 4.0).abs() < 1e-12);
    }
}

//! The kernels that a ray meets: of a grid, found along the ray, or of a list, binned by pixels.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use super::RefKernel;
use super::classes::Classes;
use super::kernels::loops;
use super::line;
use super::picture::{Rays, Splat, View};
use super::quadrature::Density;
use super::shading::SampleShader;
use crate::core::Camera;
use crate::core::parallel;
use crate::kernel::{Kernel, RadialKernel};
use crate::volume::{Lattice, Samples, ScalarVolume};

/// Pixels along the edge of a list's bins, and samples along that of a grid's bricks.
const TILE: usize = 8;

/// A straight line that is parametrised by world length: places `start + t·step`, t ≥ `from`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub(super) start: DVec3,
    pub(super) step: DVec3,
    pub(super) from: f64,
}

impl Line {
    /// The ray through a place of a camera's picture, pixels.
    pub(super) fn through(camera: &Camera, place: DVec2, size: [f64; 2]) -> Self {
        let (start, step) = camera.ray(place, size);
        let from = camera.eye_distance().map_or(f64::NEG_INFINITY, |_| 0.0);
        Self { start, step, from }
    }

    pub(super) fn at(&self, t: f64) -> DVec3 {
        self.start + self.step * t
    }

    /// The same line seen from another space.
    pub(super) fn mapped(&self, map: DMat3, origin: DVec3) -> Self {
        Self { start: map * (self.start - origin), step: map * self.step, from: self.from }
    }

    /// Where it crosses planes of an axis inside a..b, in no order.
    pub(super) fn crossings(
        &self,
        axis: usize,
        planes: impl Iterator<Item = f64>,
        [a, b]: [f64; 2],
    ) -> impl Iterator<Item = f64> {
        let (start, step) = (self.start[axis], self.step[axis]);
        planes.map(move |plane| (plane - start) / step).filter(move |t| *t > a && *t < b)
    }

    /// The part inside a box, t ≥ `from`.
    pub(super) fn inside(&self, low: DVec3, high: DVec3) -> Option<[f64; 2]> {
        let size = high - low;
        let start = (self.start - low) / size - 0.5;
        let [a, b] = line::voxel_span(start, self.step / size)?;
        (b > a.max(self.from)).then(|| [a.max(self.from), b])
    }
}

/// How a kernel lies along a ray.
#[derive(Debug, Clone, Copy)]
pub(super) enum Along {
    /// Kernel space about the kernel's centre.
    Through { start: DVec3, step: DVec3 },
    /// All of it in one place, this long.
    Point { t: f64, length: f64 },
}

/// A kernel that a ray meets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub(super) along: Along,
    /// Per world unit where h is 1.
    pub(super) weight: Density,
    /// Greater is drawn later: nearer.
    pub(super) rank: usize,
    /// Which slice across the traversal's outermost axis, numbered far to near.
    pub(super) slice: usize,
}

impl Hit {
    /// ∫ h over a part of the ray; a box for `None`.
    pub(super) fn length(&self, shape: Option<RadialKernel>, part: [f64; 2]) -> f64 {
        match (self.along, shape) {
            (Along::Point { t, length }, _) => {
                if (part[0]..part[1]).contains(&t) {
                    length
                } else {
                    0.0
                }
            }
            (Along::Through { start, step }, Some(kernel)) => {
                line::radial(kernel, start, step, part)
            }
            (Along::Through { start, step }, None) => line::voxel_chord(start, step, part),
        }
    }

    /// The part of the ray where it is not 0.
    pub(super) fn span(&self, shape: Option<RadialKernel>) -> Option<[f64; 2]> {
        match (self.along, shape) {
            (Along::Point { t, .. }, _) => Some([t, t]),
            (Along::Through { start, step }, Some(kernel)) => {
                let (nearest, l) = nearest(start, step);
                let half = line::half_chord(kernel.radius(), l)? / step.length();
                Some([nearest - half, nearest + half])
            }
            (Along::Through { start, step }, None) => line::voxel_span(start, step),
        }
    }
}

/// Where a line comes nearest to the origin, and how near.
pub(super) fn nearest(start: DVec3, step: DVec3) -> (f64, f64) {
    let t = -start.dot(step) / step.length_squared();
    (t, (start + step * t).length())
}

/// Every index triple in low..=high that may lie within `reach` of the part of a line.
pub(super) fn indices_near(
    line: &Line,
    reach: f64,
    low: [i64; 3],
    high: [i64; 3],
    [from, to]: [f64; 2],
    mut visit: impl FnMut([i64; 3]),
) {
    let step = line.step.abs();
    let a = if step.x >= step.y && step.x >= step.z { 0 } else { 1 + usize::from(step.z > step.y) };
    let (b, c) = ((a + 1) % 3, (a + 2) % 3);
    let clip = |first: f64, last: f64, axis: usize| {
        let first = first.ceil().max(low[axis] as f64) as i64;
        first..=(last.floor().min(high[axis] as f64) as i64)
    };
    let ends = [line.at(from)[a], line.at(to)[a]];
    let along = clip(ends[0].min(ends[1]) - reach, ends[0].max(ends[1]) + reach, a);
    let half = reach * line.step.length() / step[a];
    for i in along {
        let place = line.at((i as f64 - line.start[a]) / line.step[a]);
        for j in clip(place[b] - half, place[b] + half, b) {
            for k in clip(place[c] - half, place[c] + half, c) {
                let mut index = [0; 3];
                (index[a], index[b], index[c]) = (i, j, k);
                visit(index);
            }
        }
    }
}

/// A grid's kernels, classified first.
pub(super) struct GridKernels {
    pub(super) lattice: Lattice,
    samples: Arc<Samples>,
    pub(super) classes: Classes,
    /// Densities of 8- and 16-bit samples: one each code, first the least.
    codes: Option<(f64, Vec<Density>)>,
    /// Bricks of `TILE`³ samples in which anything shows, x fastest.
    visible: Vec<bool>,
    bricks: [usize; 3],
    shader: Option<SampleShader>,
    /// Lattice axes, outermost first, and the place of each index in the loop along it.
    order: [usize; 3],
    places: [Vec<usize>; 3],
}

impl GridKernels {
    pub(super) fn new(
        volume: &ScalarVolume,
        camera: &Camera,
        classes: Classes,
        shader: Option<SampleShader>,
    ) -> Self {
        let lattice = volume.lattice;
        let codes = match &*volume.samples {
            Samples::UInt8(_) => Some((0.0, 1 << 8)),
            Samples::Int8(_) => Some((-128.0, 1 << 8)),
            Samples::UInt16(_) => Some((0.0, 1 << 16)),
            Samples::Int16(_) => Some((-32768.0, 1 << 16)),
            _ => None,
        };
        let codes = codes
            .map(|(first, count)| (first, parallel::list(count, |i| classes.at(first + i as f64))));
        let (order, runs) = loops(&lattice, camera);
        let places = runs.map(|run| {
            let mut places = vec![0; run.len()];
            run.iter().enumerate().for_each(|(place, &index)| places[index] = place);
            places
        });
        let bricks = lattice.dims.map(|n| n.div_ceil(TILE));
        let mut grid = Self {
            lattice,
            samples: Arc::clone(&volume.samples),
            classes,
            codes,
            visible: Vec::new(),
            bricks,
            shader,
            order,
            places,
        };
        grid.visible = parallel::list(bricks.iter().product(), |b| {
            let at = [b % bricks[0], b / bricks[0] % bricks[1], b / (bricks[0] * bricks[1])];
            let span = |a: usize| at[a] * TILE..((at[a] + 1) * TILE).min(lattice.dims[a]);
            span(2).any(|z| span(1).any(|y| span(0).any(|x| grid.by_value([x, y, z])[0] > 0.0)))
        });
        grid
    }

    /// Density of a sample's kernel, as far as its value says.
    fn by_value(&self, [x, y, z]: [usize; 3]) -> Density {
        let dims = self.lattice.dims;
        let value = self.samples.get((z * dims[1] + y) * dims[0] + x);
        match &self.codes {
            Some((first, codes)) => codes[(value - first) as usize],
            None => self.classes.at(value),
        }
    }

    /// Density of a sample, nothing beyond the border.
    pub(super) fn density_at(&self, index: [i64; 3]) -> Density {
        let dims = self.lattice.dims;
        let inside = (0..3).all(|a| (0..dims[a] as i64).contains(&index[a]));
        if !inside {
            return [0.0; 4];
        }
        let index = index.map(|i| i as usize);
        let [x, y, z] = index.map(|i| i / TILE);
        if !self.visible[(z * self.bricks[1] + y) * self.bricks[0] + x] {
            return [0.0; 4];
        }
        let density = self.by_value(index);
        match &self.shader {
            Some(shader) => shader.shaded(density, index),
            None => density,
        }
    }

    /// The ray in index space.
    pub(super) fn line(&self, ray: &Line) -> Line {
        ray.mapped(self.lattice.axes().inverse(), self.lattice.origin)
    }

    pub(super) fn hits(&self, ray: &Line, shape: Option<RadialKernel>) -> Vec<Hit> {
        let line = self.line(ray);
        let reach = shape.map_or(0.75_f64.sqrt(), RadialKernel::radius) + 1e-9;
        let high = self.lattice.dims.map(|n| n as i64 - 1);
        let part = [line.from, f64::INFINITY];
        let mut hits = Vec::new();
        indices_near(&line, reach, [0; 3], high, part, |index| {
            let weight = self.density_at(index);
            if weight[0] <= 0.0 {
                return;
            }
            let centre = DVec3::from_array(index.map(|i| i as f64));
            let [outer, middle, inner] =
                [0, 1, 2].map(|k| self.places[k][index[self.order[k]] as usize]);
            let counts = [0, 1, 2].map(|k| self.places[k].len());
            let along = Along::Through { start: line.start - centre, step: line.step };
            let rank = (outer * counts[1] + middle) * counts[2] + inner;
            hits.push(Hit { along, weight, rank, slice: outer });
        });
        hits
    }
}

/// Kernels of any kind, given from back to front.
pub(super) struct ListKernels {
    kernels: Vec<RefKernel>,
    weights: Vec<Density>,
    slices: Vec<usize>,
    splats: Vec<Splat>,
    kind: Kernel,
    tiles: Vec<Vec<u32>>,
    columns: usize,
    camera: Camera,
    size: [usize; 2],
}

impl ListKernels {
    /// `weight` gives the density of each. Slices are those of `lattice` that centres are nearest to.
    pub(super) fn new(
        kernels: Vec<RefKernel>,
        kind: Kernel,
        extent: Option<f64>,
        camera: &Camera,
        lattice: &Lattice,
        weight: impl Fn(&RefKernel) -> Density,
        size: [usize; 2],
    ) -> Self {
        let view = View::new(camera, size);
        let shape = RadialKernel::new(kind, extent);
        let splat = |k: &RefKernel| Splat::new(k, kind, shape, &view, Rays::Exact);
        let splats: Vec<Splat> = kernels.iter().map(splat).collect();
        let [columns, rows] = size.map(|n| n.div_ceil(TILE));
        let mut tiles = vec![Vec::new(); columns * rows];
        for (i, splat) in splats.iter().enumerate() {
            if splat.columns[0] >= splat.columns[1] || splat.rows[0] >= splat.rows[1] {
                continue;
            }
            for y in splat.rows[0] / TILE..=(splat.rows[1] - 1) / TILE {
                for x in splat.columns[0] / TILE..=(splat.columns[1] - 1) / TILE {
                    tiles[y * columns + x].push(i as u32);
                }
            }
        }
        let (order, runs) = loops(lattice, camera);
        let last = runs[0].len() as f64 - 1.0;
        let slice = |k: &RefKernel| {
            let index = lattice.index_from_world(k.centre)[order[0]].round().clamp(0.0, last);
            runs[0].iter().position(|&i| i == index as usize).unwrap_or_default()
        };
        Self {
            weights: kernels.iter().map(weight).collect(),
            slices: kernels.iter().map(slice).collect(),
            kernels,
            splats,
            kind,
            tiles,
            columns,
            camera: *camera,
            size,
        }
    }

    pub(super) fn hits(&self, ray: &Line, [x, y]: [usize; 2]) -> Vec<Hit> {
        let view = View::new(&self.camera, self.size);
        let mut hits = Vec::new();
        for &i in &self.tiles[y / TILE * self.columns + x / TILE] {
            let i = i as usize;
            let (kernel, splat) = (&self.kernels[i], &self.splats[i]);
            let inside = (splat.columns[0]..splat.columns[1]).contains(&x)
                && (splat.rows[0]..splat.rows[1]).contains(&y);
            if !inside {
                continue;
            }
            let along = if self.kind == Kernel::Point {
                let t = (kernel.centre - ray.start).dot(self.camera.direction)
                    / ray.step.dot(self.camera.direction);
                Along::Point { t, length: splat.length(&view, [x, y]) }
            } else {
                let line = ray.mapped(kernel.map.inverse(), kernel.centre);
                Along::Through { start: line.start, step: line.step }
            };
            let (weight, slice) = (self.weights[i], self.slices[i]);
            hits.push(Hit { along, weight, rank: i, slice });
        }
        hits
    }
}

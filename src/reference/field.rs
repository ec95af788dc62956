//! A lattice's values between its samples, in float64, by ways of its own.

use std::sync::Arc;

use glam::DVec3;

use super::cells::Cells;
use super::sources::Line;
use crate::core::parallel;
use crate::core::progress::Ticket;
use crate::kernel::{Kernel, RadialKernel};
use crate::rbf::{Encoding, Limits, Listed};
use crate::scene::{NAMES_REACH, Reconstruction, SplatSettings};
use crate::volume::{Lattice, ScalarVolume};

/// Sweeps c ← c + (s − h∗c) that sharpen radial kernels.
const SWEEPS: usize = 2;
/// Samples along the edge of a brick.
const BRICK: usize = 8;
/// Places of a voxel at which it is looked whether ellipsoids cover them.
const LOOKS: f64 = 8.0;

/// What lies between samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// The voxel's own value.
    Nearest,
    /// Products of three weights.
    Separable(Basis),
    /// The same of kernels that are so many times wider than natural, not 1, normalised.
    Scaled(Basis, f64),
    /// Σ cᵢ hᵢ / Σ hᵢ.
    Radial(RadialKernel),
    /// The sum of basis functions, less what is left out.
    Functions(Limits),
    /// The mean of ellipsoids about points.
    Ellipsoids,
    /// What cells have.
    Cells,
}

/// A kernel in one dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Basis {
    Tent,
    CubicBSpline,
}

impl Basis {
    /// Weights of the samples −1, 0, 1 and 2 at `f` beyond sample 0.
    pub(super) fn weights(self, f: f64) -> [f64; 4] {
        let g = 1.0 - f;
        match self {
            Self::Tent => [0.0, g, f, 0.0],
            // The truncated powers of the cubic B-spline, written out by pieces.
            Self::CubicBSpline => [
                g.powi(3) / 6.0,
                (4.0 - 6.0 * f * f + 3.0 * f.powi(3)) / 6.0,
                (4.0 - 6.0 * g * g + 3.0 * g.powi(3)) / 6.0,
                f.powi(3) / 6.0,
            ],
        }
    }

    /// How far the one-dimensional kernel reaches.
    pub(super) fn reach(self) -> f64 {
        match self {
            Self::Tent => 1.0,
            Self::CubicBSpline => 2.0,
        }
    }

    /// Of kernels `scale` times wider than natural: h(x/s) at x samples from its middle.
    pub(super) fn scaled(self, x: f64, scale: f64) -> f64 {
        let x = (x / scale).abs();
        match self {
            _ if x >= self.reach() => 0.0,
            Self::Tent => 1.0 - x,
            Self::CubicBSpline if x > 1.0 => (2.0 - x).powi(3) / 6.0,
            Self::CubicBSpline => (4.0 - 6.0 * x * x + 3.0 * x.powi(3)) / 6.0,
        }
    }

    /// Σ over the samples of an axis of what they weigh at a place, h((x − i)/s) / Σ h((x − i)/s), times `of`. Where
    /// none is in reach, the nearest alone: what is left as they narrow until they do not meet.
    fn mean(self, scale: f64, x: f64, of: impl Fn(i64) -> f64) -> f64 {
        let reach = scale * self.reach();
        let (mut sum, mut total) = (0.0, 0.0);
        for i in (x - reach).ceil() as i64..=(x + reach).floor() as i64 {
            let h = self.scaled(x - i as f64, scale);
            if h > 0.0 {
                sum += h * of(i);
                total += h;
            }
        }
        if total > 0.0 { sum / total } else { of((x + 0.5).floor() as i64) }
    }

    /// Degree along any line within a cell.
    pub(super) fn degree(self) -> usize {
        match self {
            Self::Tent => 3,
            Self::CubicBSpline => 9,
        }
    }
}

impl Shape {
    /// `None` for points, which leave nothing between them.
    pub(super) fn new(kernel: Kernel, extent: Option<f64>) -> Option<Self> {
        match kernel {
            Kernel::Point => None,
            Kernel::Nearest => Some(Self::Nearest),
            Kernel::Functions => Some(Self::Functions(Limits::NONE)),
            Kernel::Ellipsoids => Some(Self::Ellipsoids),
            Kernel::Cells => Some(Self::Cells),
            Kernel::Linear | Kernel::BSpline => {
                let is_tent = kernel == Kernel::Linear;
                let basis = if is_tent { Basis::Tent } else { Basis::CubicBSpline };
                let scale = extent.map_or(1.0, |extent| extent / basis.reach());
                let is_natural = scale == 1.0;
                Some(if is_natural { Self::Separable(basis) } else { Self::Scaled(basis, scale) })
            }
            Kernel::Gaussian | Kernel::Cubic | Kernel::Gouraud => {
                RadialKernel::new(kernel, extent).map(Self::Radial)
            }
        }
    }

    /// Of a mode; as [`Shape::new`].
    pub(super) fn of(mode: &SplatSettings) -> Option<Self> {
        Self::new(mode.kernel, mode.extent).map(|shape| match shape {
            Self::Functions(_) => Self::Functions(mode.limits()),
            other => other,
        })
    }

    /// Of products, the kernel in one dimension, and how many times wider than natural it is.
    pub(super) fn product(self) -> Option<(Basis, f64)> {
        match self {
            Self::Separable(basis) => Some((basis, 1.0)),
            Self::Scaled(basis, scale) => Some((basis, scale)),
            Self::Nearest
            | Self::Radial(_)
            | Self::Functions(_)
            | Self::Ellipsoids
            | Self::Cells => None,
        }
    }

    /// How far from a sample its kernel reaches along an axis, voxels.
    pub(super) fn reach(self) -> f64 {
        match self {
            Self::Nearest | Self::Functions(_) | Self::Ellipsoids | Self::Cells => 0.5,
            Self::Separable(basis) => basis.reach(),
            Self::Scaled(basis, scale) => (scale * basis.reach()).max(0.5),
            Self::Radial(kernel) => kernel.radius(),
        }
    }
}

/// Index of the sample that a place beyond the border mirrors.
pub(super) fn mirrored(index: i64, count: usize) -> usize {
    let period = 2 * (count as i64 - 1);
    if period == 0 {
        return 0;
    }
    let inside = index.rem_euclid(period);
    inside.min(period - inside) as usize
}

/// s(x) over index space.
pub(super) struct Field {
    pub(super) dims: [usize; 3],
    pub(super) shape: Shape,
    /// x fastest.
    values: Vec<f64>,
    /// What is summed up in the place of these, and the lattice in whose index space.
    functions: Option<(Arc<Encoding>, Lattice)>,
    /// The same, less their bias, where some are left out.
    limited: Option<Listed>,
    /// What is looked into in their place.
    pub(super) cells: Option<Cells>,
    /// Whether it ends somewhere within the lattice: where cells do, or ellipsoids about points.
    pub(super) has_borders: bool,
    /// Samples without data, if any.
    holes: Option<Vec<bool>>,
    bricks: [usize; 3],
    /// Least and greatest value that any place nearest to a brick's samples can have.
    ranges: Vec<[f64; 2]>,
}

impl Field {
    pub(super) fn new(volume: &ScalarVolume, shape: Shape, reconstruction: Reconstruction) -> Self {
        let dims = volume.lattice.dims;
        let samples = &volume.samples;
        let mut values = parallel::list(samples.len(), |i| samples.get(i));
        let holes = fill_holes(&mut values, dims);
        if reconstruction == Reconstruction::Interpolating {
            match shape {
                Shape::Separable(Basis::CubicBSpline) | Shape::Scaled(Basis::CubicBSpline, _) => {
                    prefilter(&mut values, dims);
                }
                Shape::Radial(kernel) => sharpen(&mut values, dims, kernel),
                Shape::Nearest
                | Shape::Functions(_)
                | Shape::Ellipsoids
                | Shape::Cells
                | Shape::Separable(Basis::Tent)
                | Shape::Scaled(Basis::Tent, _) => {}
            }
        }
        let bricks = dims.map(|n| n.div_ceil(BRICK));
        let functions = match shape {
            Shape::Functions(_) => volume.functions.clone(),
            // Nobody cancels a fresh ticket.
            Shape::Ellipsoids => {
                volume.scattered.as_ref().and_then(|all| all.ellipsoids(&Ticket::new()).ok())
            }
            _ => None,
        };
        let functions = functions.map(|functions| (functions, volume.lattice));
        let limited = match (shape, &functions) {
            (Shape::Functions(limits), Some((functions, lattice))) if limits.leaves_out() => {
                let space = (dims, lattice.axes(), lattice.origin);
                // Nobody cancels here, either.
                limits.listed(functions, space, &Ticket::new()).ok()
            }
            _ => None,
        };
        let cells = volume.cells.clone().filter(|_| shape == Shape::Cells);
        let cells = cells.map(|cells| Cells::new(cells, volume.lattice));
        // Samples outside of all cells, and beside all points, are nowhere rather than holes.
        let has_borders = cells.is_some() || shape == Shape::Ellipsoids;
        let holes = holes.filter(|_| !has_borders);
        let ranges = Vec::new();
        let mut field = Self {
            dims,
            shape,
            values,
            functions,
            limited,
            cells,
            has_borders,
            holes,
            bricks,
            ranges,
        };
        field.ranges = parallel::list(bricks.iter().product(), |b| {
            field.range([b % bricks[0], b / bricks[0] % bricks[1], b / (bricks[0] * bricks[1])])
        });
        field
    }

    /// Kernels weigh without sign, so that values lie between those of the samples in reach.
    fn range(&self, brick: [usize; 3]) -> [f64; 2] {
        if matches!(self.shape, Shape::Functions(_) | Shape::Ellipsoids | Shape::Cells) {
            // Anything.
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let margin = self.shape.reach() + 0.5;
        let span: [_; 3] = std::array::from_fn(|a| {
            let low = (brick[a] * BRICK) as f64 - margin;
            let high = ((brick[a] + 1) * BRICK) as f64 - 1.0 + margin;
            let last = self.dims[a] - 1;
            (low.floor().max(0.0) as usize)..=(high.ceil() as usize).min(last)
        });
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for z in span[2].clone() {
            for y in span[1].clone() {
                for x in span[0].clone() {
                    let value = self.values[(z * self.dims[1] + y) * self.dims[0] + x];
                    range = [range[0].min(value), range[1].max(value)];
                }
            }
        }
        // A little more, for rounding.
        let slack = 1e-12 * range[0].abs().max(range[1].abs());
        [range[0] - slack, range[1] + slack]
    }

    /// Which bricks have any value that `keep`s (low, high), x fastest, or hold samples without data if
    /// these are kept.
    pub(super) fn bricks_where(&self, holes: bool, keep: impl Fn(f64, f64) -> bool) -> Vec<bool> {
        let mut kept: Vec<bool> = self.ranges.iter().map(|[low, high]| keep(*low, *high)).collect();
        for (i, _) in self.holes.iter().flatten().enumerate().filter(|(_, is)| holes && **is) {
            let at = [
                i % self.dims[0],
                i / self.dims[0] % self.dims[1],
                i / (self.dims[0] * self.dims[1]),
            ];
            kept[self.brick_of(DVec3::from(at.map(|i| i as f64)))] = true;
        }
        kept
    }

    /// Index into [`Field::bricks_where`] of the brick that a place in the domain is in.
    pub(super) fn brick_of(&self, place: DVec3) -> usize {
        let [x, y, z] = self.nearest(place).map(|i| i / BRICK);
        (z * self.bricks[1] + y) * self.bricks[0] + x
    }

    /// Places along an axis where one brick ends and the next begins.
    pub(super) fn brick_faces(&self, axis: usize) -> impl Iterator<Item = f64> {
        (1..self.bricks[axis]).map(|b| (b * BRICK) as f64 - 0.5)
    }

    fn nearest(&self, place: DVec3) -> [usize; 3] {
        std::array::from_fn(|a| ((place[a] + 0.5).floor().max(0.0) as usize).min(self.dims[a] - 1))
    }

    /// Which of the file's cells a place lies in, where the field is on cells.
    pub(super) fn cell_at(&self, place: DVec3) -> Option<u32> {
        let cells = self.cells.as_ref()?;
        cells.find(place).map(|(solid, _)| cells.source(solid))
    }

    pub(super) fn has_holes(&self) -> bool {
        self.holes.is_some()
    }

    /// Whether the sample nearest to a place has no data.
    pub(super) fn is_hole(&self, place: DVec3) -> bool {
        let [x, y, z] = self.nearest(place);
        self.holes.as_ref().is_some_and(|h| h[(z * self.dims[1] + y) * self.dims[0] + x])
    }

    /// The coefficient of a sample, mirrored about the border samples.
    pub(super) fn coefficient(&self, index: [i64; 3]) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|a| mirrored(index[a], self.dims[a]));
        self.values[(z * self.dims[1] + y) * self.dims[0] + x]
    }

    /// The coefficients −1..=2 about a cell, x fastest.
    pub(super) fn block(&self, cell: [i64; 3]) -> [f64; 64] {
        let at: [[usize; 4]; 3] = std::array::from_fn(|a| {
            std::array::from_fn(|i| mirrored(cell[a] + i as i64 - 1, self.dims[a]))
        });
        std::array::from_fn(|i| {
            let row = at[2][i >> 4] * self.dims[1] + at[1][i >> 2 & 3];
            self.values[row * self.dims[0] + at[0][i & 3]]
        })
    }

    /// Where a part of a ray passes what may be a border: the faces of cells, also of those that leave functions out, or the
    /// surface of what ellipsoids cover; in no order.
    pub(super) fn crossings(&self, line: &Line, [a, b]: [f64; 2]) -> Vec<f64> {
        if let Some(cells) = &self.cells {
            return cells.crossings(line, [a, b]);
        }
        if let Some(limited) = &self.limited {
            let along = move |axis| line.crossings(axis, limited.faces(axis), [a, b]);
            return (0..3).flat_map(along).collect();
        }
        let Some((functions, lattice)) = self.functions.as_ref().filter(|_| self.has_borders)
        else {
            return Vec::new();
        };
        // Where coverage passes 1: looked for between places close together, and halved until nothing is left to halve.
        let count = ((b - a) * line.step.length() * LOOKS).ceil().max(1.0) as usize;
        let place = |i: usize| a + (b - a) * i as f64 / count as f64;
        let is_in = |t: &f64| functions.coverage(lattice.world_from_index(line.at(*t))) >= 1.0;
        let places: Vec<f64> = (0..=count).map(place).collect();
        let sides: Vec<bool> = places.iter().map(is_in).collect();
        let passed = (0..count).filter(|i| sides[*i] != sides[i + 1]).map(|i| {
            let (mut low, mut high) = (places[i], places[i + 1]);
            for _ in 0..40 {
                let middle = f64::midpoint(low, high);
                if is_in(&middle) == sides[i] {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            f64::midpoint(low, high)
        });
        passed.collect()
    }

    /// What light that falls on borders takes for the growth per index, of what has borders; for a ray through a place in a
    /// direction.
    pub(super) fn growth_for_light(&self, place: DVec3, direction: DVec3) -> Option<DVec3> {
        if let Some(cells) = &self.cells {
            return Some(cells.growth_for_light(place, direction));
        }
        let (functions, lattice) = self.functions.as_ref().filter(|_| self.has_borders)?;
        Some(functions.growth_for_light(lattice.world_from_index(place), lattice.axes()))
    }

    /// The growth per index of what has a derivative in closed form.
    pub(super) fn growth(&self, place: DVec3) -> Option<DVec3> {
        if let Some(cells) = &self.cells {
            return Some(cells.growth(place));
        }
        if let Some(limited) = &self.limited {
            return Some(limited.gradient(place));
        }
        let (functions, lattice) = self.functions.as_ref()?;
        let gradient = functions.gradient(lattice.world_from_index(place));
        Some(lattice.axes().transpose() * gradient)
    }

    /// What light takes for the growth per index of numbers that name things (`scene::shading` has the rule), which are `range` apart
    /// at most.
    pub(super) fn end_of_name(&self, place: DVec3, range: f64) -> DVec3 {
        let middle = self.nearest(place);
        let value = |[x, y, z]: [usize; 3]| self.values[(z * self.dims[1] + y) * self.dims[0] + x];
        // Along an axis: each sample's number, how far it lies beyond the place, and its weight.
        let along = |axis: usize| {
            (-NAMES_REACH..=NAMES_REACH).map(move |off| {
                let away = middle[axis] as f64 + f64::from(off) - place[axis];
                let share = away / (f64::from(NAMES_REACH) + 0.5);
                let number = middle[axis].saturating_add_signed(off as isize);
                (number.min(self.dims[axis] - 1), away, (1.0 - share * share).max(0.0).powi(2))
            })
        };
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for (z, dz, of_z) in along(2) {
            for (y, dy, of_y) in along(1) {
                for (x, dx, of_x) in along(0) {
                    let weight = of_x * of_y * of_z;
                    total += weight;
                    if value([x, y, z]) != value(middle) {
                        sum += DVec3::new(dx, dy, dz) * weight;
                    }
                }
            }
        }
        sum * (range / total)
    }

    /// The value at a place of index space; `None` where no kernel reaches it.
    pub(super) fn value(&self, place: DVec3) -> Option<f64> {
        match self.shape {
            Shape::Nearest => {
                let [x, y, z] = self.nearest(place);
                Some(self.values[(z * self.dims[1] + y) * self.dims[0] + x])
            }
            Shape::Cells => self.cells.as_ref().and_then(|cells| cells.value(place)),
            Shape::Functions(_) | Shape::Ellipsoids => self
                .functions
                .as_ref()
                .map(|(functions, lattice)| match &self.limited {
                    Some(limited) => functions.bias() + limited.value(place),
                    None => functions.value(lattice.world_from_index(place)),
                })
                .filter(|value| !value.is_nan()),
            Shape::Separable(basis) => {
                let cell = place.floor();
                let block = self.block(cell.to_array().map(|c| c as i64));
                Some(tensor(basis, &block, place - cell))
            }
            Shape::Scaled(basis, scale) => {
                let mean = |x, of: &dyn Fn(i64) -> f64| basis.mean(scale, x, of);
                Some(mean(place.z, &|z| {
                    mean(place.y, &|y| mean(place.x, &|x| self.coefficient([x, y, z])))
                }))
            }
            Shape::Radial(kernel) => {
                let radius = kernel.radius();
                let low = (place - radius).ceil().to_array().map(|v| v as i64);
                let high = (place + radius).floor().to_array().map(|v| v as i64);
                let (mut sum, mut weights) = (0.0, 0.0);
                for z in low[2]..=high[2] {
                    for y in low[1]..=high[1] {
                        for x in low[0]..=high[0] {
                            let centre = DVec3::new(x as f64, y as f64, z as f64);
                            let h = kernel.value((place - centre).length());
                            if h > 0.0 {
                                sum += h * self.coefficient([x, y, z]);
                                weights += h;
                            }
                        }
                    }
                }
                (weights > 0.0).then(|| sum / weights)
            }
        }
    }
}

/// Σ of a cell's 64 coefficients with their weights at `fraction` beyond the cell's lowest corner.
pub(super) fn tensor(basis: Basis, block: &[f64; 64], fraction: DVec3) -> f64 {
    let [x, y, z] = fraction.to_array().map(|f| basis.weights(f));
    let plane = |plane: &[f64]| -> f64 {
        let row = |row: &[f64]| x[0] * row[0] + x[1] * row[1] + x[2] * row[2] + x[3] * row[3];
        plane.chunks_exact(4).zip(y).map(|(r, w)| w * row(r)).sum()
    };
    block.chunks_exact(16).zip(z).map(|(p, w)| w * plane(p)).sum()
}

/// Values of which those without data have the mean of their neighbours.
pub(super) fn filled(mut values: Vec<f64>, dims: [usize; 3]) -> Vec<f64> {
    fill_holes(&mut values, dims);
    values
}

/// Gives samples without data (NaN) the mean of their finite neighbours, in rounds, and tells which
/// they were. ±∞ count as the ends of the finite range.
fn fill_holes(values: &mut [f64], dims: [usize; 3]) -> Option<Vec<bool>> {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let (least, greatest) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if least <= greatest {
        values.iter_mut().filter(|v| v.is_infinite()).for_each(|v| *v = v.clamp(least, greatest));
    }
    let holes: Vec<bool> = values.iter().map(|v| !v.is_finite()).collect();
    let mut open: Vec<usize> = (0..values.len()).filter(|&i| holes[i]).collect();
    if open.is_empty() {
        return None;
    }
    let strides = [1, dims[0], dims[0] * dims[1]];
    while !open.is_empty() {
        let filled: Vec<(usize, f64)> = open
            .iter()
            .filter_map(|&i| {
                let (mut sum, mut count) = (0.0, 0.0);
                for (stride, n) in strides.into_iter().zip(dims) {
                    let at = i / stride % n;
                    let lower = (at > 0).then(|| values[i - stride]);
                    let upper = (at + 1 < n).then(|| values[i + stride]);
                    for v in lower.into_iter().chain(upper).filter(|v| v.is_finite()) {
                        sum += v;
                        count += 1.0;
                    }
                }
                (count > 0.0).then(|| (i, sum / count))
            })
            .collect();
        if filled.is_empty() {
            // Nothing finite anywhere.
            open.iter().for_each(|&i| values[i] = 0.0);
            break;
        }
        filled.into_iter().for_each(|(i, v)| values[i] = v);
        open.retain(|&i| !values[i].is_finite());
    }
    Some(holes)
}

/// Coefficients with which the cubic B-spline passes through the samples: along each axis the
/// tridiagonal system (c₋ + 4c + c₊)/6 = s, mirrored, by elimination.
fn prefilter(values: &mut [f64], dims: [usize; 3]) {
    let strides = [1, dims[0], dims[0] * dims[1]];
    for axis in 0..3 {
        let (n, stride) = (dims[axis], strides[axis]);
        if n == 1 {
            continue;
        }
        // A block holds `stride` interleaved lines.
        parallel::each(values.chunks_mut(n * stride), |block| {
            let mut line = vec![0.0; n];
            for first in 0..stride {
                line.iter_mut().enumerate().for_each(|(i, v)| *v = 6.0 * block[first + i * stride]);
                solve_mirrored(&mut line);
                line.iter().enumerate().for_each(|(i, v)| block[first + i * stride] = *v);
            }
        });
    }
}

/// Solves c₋ + 4c + c₊ = b with c mirrored about both ends; n ≥ 2.
fn solve_mirrored(b: &mut [f64]) {
    let n = b.len();
    // Above the diagonal: 2 in the first row, 1 in others; below it: 2 in the last row.
    let mut above = vec![0.0; n];
    above[0] = 0.5;
    b[0] /= 4.0;
    for i in 1..n {
        let below = if i == n - 1 { 2.0 } else { 1.0 };
        let pivot = 4.0 - below * above[i - 1];
        above[i] = 1.0 / pivot;
        b[i] = (b[i] - below * b[i - 1]) / pivot;
    }
    for i in (0..n - 1).rev() {
        b[i] -= above[i] * b[i + 1];
    }
}

/// Two Jacobi sweeps towards coefficients that interpolate; Σ h normalises, as in [`Field::value`].
fn sharpen(values: &mut Vec<f64>, dims: [usize; 3], kernel: RadialKernel) {
    let reach = kernel.radius().floor() as i64;
    let mut stencil = Vec::new();
    for z in -reach..=reach {
        for y in -reach..=reach {
            for x in -reach..=reach {
                let h = kernel.value(((x * x + y * y + z * z) as f64).sqrt());
                if h > 0.0 {
                    stencil.push(([x, y, z], h));
                }
            }
        }
    }
    let total: f64 = stencil.iter().map(|(_, h)| h).sum();
    let samples = values.clone();
    for _ in 0..SWEEPS {
        *values = parallel::list(values.len(), |i| {
            let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            let smoothed: f64 = stencil
                .iter()
                .map(|(step, h)| {
                    let [x, y, z] = [0, 1, 2].map(|a| mirrored(at[a] as i64 + step[a], dims[a]));
                    h * values[(z * dims[1] + y) * dims[0] + x]
                })
                .sum();
            values[i] + (samples[i] - smoothed / total)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};

    fn volume(dims: [usize; 3], f: impl Fn(usize) -> f64) -> ScalarVolume {
        let samples = Samples::Float64((0..dims.iter().product()).map(f).collect());
        ScalarVolume::from_samples("v", Lattice::unit(dims), samples).unwrap()
    }

    #[test]
    fn the_interpolating_spline_passes_through_every_sample() {
        let rough = |i: usize| ((i * 7919 + 13) % 101) as f64;
        for dims in [[5, 4, 3], [2, 1, 9], [1, 1, 1], [3, 2, 2]] {
            let volume = volume(dims, rough);
            let shape = Shape::new(Kernel::BSpline, None).unwrap();
            let field = Field::new(&volume, shape, Reconstruction::Interpolating);
            let smooth = Field::new(&volume, shape, Reconstruction::Smooth);
            let mut missed = 0.0_f64;
            for i in 0..volume.samples.len() {
                let place = DVec3::new(
                    (i % dims[0]) as f64,
                    (i / dims[0] % dims[1]) as f64,
                    (i / (dims[0] * dims[1])) as f64,
                );
                let found = field.value(place).unwrap();
                assert!((found - rough(i)).abs() < 1e-11, "{dims:?} {place}: {found}");
                missed = missed.max((smooth.value(place).unwrap() - rough(i)).abs());
            }
            assert!(missed > 1.0 || volume.samples.len() == 1, "smooth must not: {missed}");
        }
    }

    #[test]
    fn every_shape_keeps_a_constant_and_sharpening_comes_nearer() {
        let dims = [6, 5, 4];
        let flat = volume(dims, |_| 3.5);
        let rough = volume(dims, |i| ((i * 7919 + 13) % 101) as f64);
        for kernel in [Kernel::Nearest, Kernel::Linear, Kernel::Gaussian, Kernel::Cubic] {
            let shape = Shape::new(kernel, None).unwrap();
            let residual = |how| {
                let field = Field::new(&rough, shape, how);
                let at = |i: usize| DVec3::new((i % 6) as f64, (i / 6 % 5) as f64, (i / 30) as f64);
                (0..120)
                    .map(|i| (field.value(at(i)).unwrap() - rough.samples.get(i)).powi(2))
                    .sum::<f64>()
                    .sqrt()
            };
            let [smooth, sharp] =
                [Reconstruction::Smooth, Reconstruction::Interpolating].map(residual);
            // Measured on values without any smoothness: the Gaussian leaves 0.77 of the residual.
            assert!(sharp < 0.8 * smooth || smooth < 1e-9, "{kernel:?}: {sharp} {smooth}");
            let field = Field::new(&flat, shape, Reconstruction::Interpolating);
            for place in [DVec3::ZERO, DVec3::new(-0.49, 4.3, 3.49), DVec3::new(2.5, 2.5, 1.5)] {
                assert!((field.value(place).unwrap() - 3.5).abs() < 1e-12, "{kernel:?} {place}");
            }
        }
    }

    /// By the kernel itself and sums over all of a mirrored lattice.
    #[test]
    fn products_of_any_extent_are_their_definition_and_keep_constants() {
        let dims = [5, 3, 4];
        let rough = volume(dims, |i| ((i * 7919 + 13) % 101) as f64);
        let flat = volume(dims, |_| 3.5);
        for (kernel, natural) in [(Kernel::Linear, 1.0), (Kernel::BSpline, 2.0)] {
            let field = |volume: &ScalarVolume, extent: Option<f64>| {
                let shape = Shape::new(kernel, extent).unwrap();
                Field::new(volume, shape, Reconstruction::Interpolating)
            };
            let coefficients = field(&rough, None);
            for scale in [0.25, 0.5, 0.8, 1.5, 2.0, 3.0] {
                if scale * natural < 0.5 {
                    continue;
                }
                let extent = Some(scale * natural);
                let [found, constant] = [&rough, &flat].map(|volume| field(volume, extent));
                let h = |x: f64| {
                    let x = (x / scale).abs();
                    match kernel {
                        Kernel::Linear => (1.0 - x).max(0.0),
                        _ if x < 1.0 => 2.0 / 3.0 - x * x + x * x * x / 2.0,
                        _ => (2.0 - x).max(0.0).powi(3) / 6.0,
                    }
                };
                for i in 0..40_u32 {
                    let part = |k: u32| f64::from(i.wrapping_mul(k) % 97) / 97.0;
                    let place = DVec3::new(part(7), part(31), part(53))
                        * DVec3::from(dims.map(|n| n as f64))
                        - 0.5;
                    let (mut sum, mut total) = (0.0, 0.0);
                    for z in -12..18 {
                        for y in -12..18 {
                            for x in -12..18 {
                                let at = DVec3::from([x, y, z].map(f64::from)) - place;
                                let weight = h(at.x) * h(at.y) * h(at.z);
                                if weight > 0.0 {
                                    let index = [x, y, z].map(i64::from);
                                    sum += weight * coefficients.coefficient(index);
                                    total += weight;
                                }
                            }
                        }
                    }
                    if total == 0.0 {
                        // Half-way between kernels that just meet.
                        continue;
                    }
                    let value = found.value(place).unwrap();
                    let off = (value - sum / total).abs();
                    assert!(off < 1e-9, "{kernel:?} {scale} {place}: {value} {}", sum / total);
                    let [low, high] = found.ranges[found.brick_of(place)];
                    assert!((low..=high).contains(&value), "{kernel:?} {scale} {place}: {value}");
                    assert!((constant.value(place).unwrap() - 3.5).abs() < 1e-12);
                }
            }
            assert_eq!(Shape::new(kernel, Some(natural)), Shape::new(kernel, None));
        }
    }

    #[test]
    fn holes_are_filled_from_outside_inwards_and_known() {
        let field = |values: Vec<f64>| {
            let volume = volume([values.len(), 1, 1], |i| values[i]);
            Field::new(&volume, Shape::Nearest, Reconstruction::Smooth)
        };
        let filled = field(vec![1.0, f64::NAN, f64::NAN, f64::NAN, 5.0]);
        let at = |x: f64| filled.value(DVec3::new(x, 0.0, 0.0)).unwrap();
        assert_eq!([at(0.0), at(1.0), at(2.0), at(3.0), at(4.0)], [1.0, 1.0, 3.0, 5.0, 5.0]);
        assert!(filled.is_hole(DVec3::X * 1.4) && !filled.is_hole(DVec3::X * 0.4));
        assert!(!field(vec![1.0, 2.0]).has_holes());
    }

    #[test]
    fn indices_mirror_about_the_border_samples() {
        let found: Vec<usize> = (-4..8).map(|i| mirrored(i, 4)).collect();
        assert_eq!(found, [2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1]);
        assert_eq!(mirrored(-5, 1), 0);
    }

    #[test]
    fn bricks_hold_every_value_in_them() {
        let dims = [19, 3, 9];
        let volume = volume(dims, |i| ((i * 7919 + 13) % 101) as f64);
        for kernel in [Kernel::Nearest, Kernel::Linear, Kernel::BSpline, Kernel::Cubic] {
            let shape = Shape::new(kernel, None).unwrap();
            let field = Field::new(&volume, shape, Reconstruction::Interpolating);
            for i in 0..3000_u32 {
                let part = |k: u32| f64::from(i.wrapping_mul(k) % 997) / 997.0;
                let place = DVec3::new(
                    part(389) * 19.0 - 0.5,
                    part(211) * 3.0 - 0.5,
                    part(677) * 9.0 - 0.5,
                );
                let [low, high] = field.ranges[field.brick_of(place)];
                let value = field.value(place).unwrap();
                assert!((low..=high).contains(&value), "{kernel:?} {place}: {value}");
            }
        }
    }
}

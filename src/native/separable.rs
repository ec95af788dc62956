//! Kernels that are products of tents, or of cubic B-splines, gathered along rays slab by slab.

use fearless_simd::{Simd, prelude::*};

use super::gather::Walk;
use super::grid::{Line, Product, Run, least, most, within};
use super::lanes::{LANES, Lanes, Look, Mask, Vec3, all, any, choose};
use super::laying::MOST_AMOUNT;
use super::passing::Sum;
use super::weights::{self, natural};

/// Slabs that are looked at together, whether anything shows there.
const AT_ONCE: i32 = 8;
/// Places in a segment at which it is summed up, and their weights (Gauss and Legendre): exact for tents, whose products
/// are of degree 3 along a ray; those of B-splines are of degree 9.
const TENTS: [&[f32]; 2] = [&[0.211_324_87, 0.788_675_1], &[0.5, 0.5]];
const SPLINES: [&[f32]; 2] =
    [&[0.112_701_67, 0.5, 0.887_298_35], &[5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0]];

/// Parts that a cell is summed up in where kernels are of another than their natural width, for each of it where they
/// are narrower.
const TENT_PARTS: f32 = 4.0;
const SPLINE_PARTS: f32 = 2.0;
/// Samples of an axis in reach of a place, at most: of B-splines four times as wide as natural.
const MOST_TAPS: usize = 16;

impl<S: Simd> Walk<'_, '_, S> {
    /// Slabs of kernels that are products of tents, or of cubic B-splines.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "at most 2²⁰ slabs")]
    pub(super) fn along_slabs(&mut self, product: Product) {
        let (simd, side) = (self.laying.simd, product.side);
        let (enter, leave) = (self.line.enter, self.line.leave);
        let first = least(simd, self.line.is_in, self.laying.faces.place(enter)).floor() as i32;
        let last = most(simd, self.line.is_in, self.laying.faces.place(leave)).floor() as i32;
        let count = last - first + 1;
        let run = match self.laying.rule.back_to_front {
            true => Run { first: last, count, way: -1 },
            false => Run { first, count, way: 1 },
        };
        let (mut i, mut unknown) = (0, 0);
        while i < count {
            let slab = run.at(i);
            if i >= unknown {
                let more = (AT_ONCE - 1).min(count - 1 - i);
                unknown = i + more + 1;
                if !self.slabs_may_show(slab, run.at(i + more), side) {
                    i = unknown;
                    continue;
                }
            }
            i += 1;
            if !self.slabs_may_show(slab, slab, side) {
                continue;
            }
            let sum = self.slab(slab, product);
            if any(sum.weight.simd_gt(all(simd, 0.0))) {
                self.laying
                    .lay_layer(if self.laying.rule.back_to_front { -slab } else { slab }, &sum);
                if !self.laying.goes_on() {
                    return;
                }
            }
        }
    }

    /// Depths where rays enter and leave a slab.
    #[inline(always)]
    fn ends_of(&self, slab: i32) -> [Lanes<S>; 2] {
        let Line { enter, leave, .. } = self.line;
        let at = |face: i32| self.laying.faces.at(self.laying.simd, face).max(enter).min(leave);
        [at(slab), at(slab + 1)]
    }

    /// Whether anything can show about the rays in all slabs between two.
    #[inline(always)]
    fn slabs_may_show(&self, first: i32, last: i32, side: i32) -> bool {
        let simd = self.laying.simd;
        let ends = [self.ends_of(first.min(last))[0], self.ends_of(first.max(last))[1]];
        let is_in = self.line.is_in & ends[0].simd_lt(ends[1]);
        if !any(is_in) {
            return false;
        }
        let (mut low, mut high) = ([0; 3], [0; 3]);
        for k in 0..3 {
            let [a, b] = ends.map(
                #[inline(always)]
                |t| self.line.direction[k].mul_add(t, self.line.origin[k]),
            );
            let from = least(simd, is_in, a.min(b)) - side as f32;
            let to = most(simd, is_in, a.max(b)) + side as f32;
            [low[k], high[k]] = within([from, to], [self.grid.low[k], self.grid.high[k]]);
            if low[k] > high[k] {
                return false;
            }
        }
        self.samples.any_shows(low, high)
    }

    /// What a slab has, cell by cell: within one the same samples contribute, as polynomials of degree 3 along a ray for
    /// tents, 9 for B-splines. Quadrature is exact for tents, and near exact for B-splines.
    #[inline(always)]
    fn slab(&self, slab: i32, product: Product) -> Sum<S> {
        let simd = self.laying.simd;
        let [mut at, end] = self.ends_of(slab);
        let mut sum = Look::splat(simd, [0.0; 4]);
        // More cells than a slab meets: rounding must not keep a ray in one.
        let most = 64 + 4 * (least_count(simd, self.line.is_in, &self.line, at, end));
        for _ in 0..most {
            let is_left = self.line.is_in & at.simd_lt(end);
            if !any(is_left) {
                break;
            }
            let mut next = end;
            for k in 0..3 {
                let (direction, origin) = (self.line.direction[k], self.line.origin[k]);
                let place = direction.mul_add(at, origin);
                let up = direction.simd_gt(all(simd, 0.0));
                let face = choose(up, place.floor() + 1.0, place.ceil() - 1.0);
                let to = (face - origin) * self.line.inverse[k];
                // A face that the ray is at by rounding is behind it.
                let further = (face + choose(up, all(simd, 1.0), all(simd, -1.0)) - origin)
                    * self.line.inverse[k];
                let to = choose(to.simd_gt(at), to, further);
                let moves = self.line.unit[k].abs().simd_ge(all(simd, 1e-9));
                next = choose(moves & to.simd_gt(at), next.min(to), next);
            }
            if product.scale == 1.0 {
                self.add_segment(is_left, [at, next], product.side, &mut sum);
            } else {
                self.add_scaled(is_left, [at, next], product, &mut sum);
            }
            at = choose(is_left, next, at);
        }
        sum
    }

    /// Adds what a cell gives to the segment of each ray in it, of kernels of another than their natural width: these
    /// begin, end and bend anywhere in a cell, so that it is summed up in parts.
    #[inline(always)]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an axis has at most 65535 samples, a cell a few dozen parts"
    )]
    fn add_scaled(
        &self,
        is_left: Mask<S>,
        [begin, end]: [Lanes<S>; 2],
        product: Product,
        sum: &mut Sum<S>,
    ) {
        let simd = self.laying.simd;
        let Product { is_tent, scale, side } = product;
        let [nodes, weights] = if is_tent { TENTS } else { SPLINES };
        let parts =
            (if is_tent { TENT_PARTS } else { SPLINE_PARTS } / scale.min(1.0)).ceil() as usize;
        let count = 2 * side as usize;
        let part = (end - begin).max(all(simd, 0.0)) * (1.0 / parts as f32);
        let length = part * (self.laying.packet.stretch / (scale * scale * scale));
        let middle = (begin + end) * 0.5;
        let mut first = [[0_i32; LANES]; 3];
        let mut cells = [all(simd, 0.0); 3];
        for k in 0..3 {
            cells[k] = self.line.direction[k].mul_add(middle, self.line.origin[k]).floor();
            for (lane, found) in first[k].iter_mut().enumerate() {
                *found = cells[k][lane] as i32 - (side - 1);
            }
        }
        let mut light = [[0.0_f32; LANES]; 4];
        for piece in 0..parts {
            for (&node, &share) in nodes.iter().zip(weights) {
                let t = (part).mul_add(all(simd, piece as f32 + node), begin);
                let mut along = [[all(simd, 0.0); MOST_TAPS]; 3];
                for k in 0..3 {
                    let offset = self.line.direction[k].mul_add(t, self.line.origin[k]) - cells[k];
                    for (i, weight) in along[k].iter_mut().enumerate().take(count) {
                        let x = (offset - (i as f32 - (side - 1) as f32)) * (1.0 / scale);
                        *weight = scaled(simd, x, is_tent);
                    }
                }
                for a in 0..count {
                    for b in 0..count {
                        let across = along[0][a] * along[1][b] * (length * share);
                        if !any(across.simd_gt(all(simd, 0.0)) & is_left) {
                            continue;
                        }
                        let mut row = [all(simd, 0.0); MOST_TAPS];
                        for (row, weight) in row.iter_mut().zip(&along[2]).take(count) {
                            *row = across * *weight;
                        }
                        let at = [a as i32, b as i32];
                        self.add_row(is_left, &first, at, &row[..count], &mut light);
                    }
                }
            }
        }
        let [x, y, z, amount] = light.map(|light| Lanes::load_array(simd, light));
        sum.colour = sum.colour.add(Vec3 { x, y, z });
        sum.weight += amount;
    }

    /// Adds what a cell gives to the segment of each ray in it.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "an axis has at most 65535 samples")]
    fn add_segment(
        &self,
        is_left: Mask<S>,
        [begin, end]: [Lanes<S>; 2],
        side: i32,
        sum: &mut Sum<S>,
    ) {
        let simd = self.laying.simd;
        let [nodes, weights] = if side == 1 { TENTS } else { SPLINES };
        let count = 2 * side as usize;
        let length = (end - begin).max(all(simd, 0.0)) * self.laying.packet.stretch;
        let middle = (begin + end) * 0.5;
        let mut cells = [[0_i32; LANES]; 3];
        // Of each axis, node and sample.
        let mut along = [[[all(simd, 0.0); 4]; 3]; 3];
        for k in 0..3 {
            let (direction, origin) = (self.line.direction[k], self.line.origin[k]);
            let cell = direction.mul_add(middle, origin).floor();
            for (lane, found) in cells[k].iter_mut().enumerate() {
                *found = cell[lane] as i32 - (side - 1);
            }
            for (n, &node) in nodes.iter().enumerate() {
                let t = (end - begin).mul_add(all(simd, node), begin);
                let offset = direction.mul_add(t, origin) - cell;
                along[k][n] = basis(simd, offset, side);
            }
        }
        let mut light = [[0.0_f32; LANES]; 4];
        for a in 0..count {
            for b in 0..count {
                let mut row = [all(simd, 0.0); 4];
                for (c, row) in row.iter_mut().enumerate().take(count) {
                    let mut weight = all(simd, 0.0);
                    for (n, &share) in weights.iter().enumerate() {
                        let product = along[0][n][a] * along[1][n][b] * share;
                        weight = product.mul_add(along[2][n][c], weight);
                    }
                    *row = weight * length;
                }
                let at = [a as i32, b as i32];
                self.add_row(is_left, &cells, at, &row[..count], &mut light);
            }
        }
        let [x, y, z, amount] = light.map(|light| Lanes::load_array(simd, light));
        sum.colour = sum.colour.add(Vec3 { x, y, z });
        sum.weight += amount;
    }

    /// Adds what a row of samples gives to each ray in its cell: the row `a` and `b` beyond the `first` samples in reach, by
    /// what its samples weigh, to colour times weight and to weight.
    #[inline(always)]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "a few dozen samples"
    )]
    fn add_row(
        &self,
        is_left: Mask<S>,
        first: &[[i32; LANES]; 3],
        [a, b]: [i32; 2],
        row: &[Lanes<S>],
        light: &mut [[f32; LANES]; 4],
    ) {
        let [low, high] = [self.grid.low, self.grid.high];
        for lane in 0..LANES {
            let [x, y] = [first[0][lane] + a, first[1][lane] + b];
            let is_there = is_left.test(lane)
                && (low[0]..=high[0]).contains(&x)
                && (low[1]..=high[1]).contains(&y);
            if !is_there {
                continue;
            }
            let samples = self.samples.row([x, y]);
            for (c, weight) in row.iter().enumerate() {
                let z = first[2][lane] + c as i32;
                if !(low[2]..=high[2]).contains(&z) {
                    continue;
                }
                let Some(look) = samples.look(z) else { continue };
                let part = (weight[lane] * look[3]).min(MOST_AMOUNT);
                for (light, c) in light.iter_mut().zip(&look[..3]) {
                    light[lane] += part * c;
                }
                light[3][lane] += part;
            }
        }
    }
}

/// Faces of cells that rays pass between two depths, at most.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
fn least_count<S: Simd>(
    simd: S,
    is_in: Mask<S>,
    line: &Line<S>,
    begin: Lanes<S>,
    end: Lanes<S>,
) -> u32 {
    let length = (end - begin) / line.per_index;
    most(simd, is_in, length).max(0.0) as u32
}

/// The weights of the samples about a place in a cell, so many to either side.
#[inline(always)]
fn basis<S: Simd>(simd: S, f: Lanes<S>, side: i32) -> [Lanes<S>; 4] {
    if side == 1 {
        let g = all(simd, 1.0) - f;
        return [g.max(all(simd, 0.0)), f.max(all(simd, 0.0)), all(simd, 0.0), all(simd, 0.0)];
    }
    natural(simd, f)
}

/// The kernel in one dimension, `x` natural widths of a sample from its middle.
#[inline(always)]
fn scaled<S: Simd>(simd: S, x: Lanes<S>, is_tent: bool) -> Lanes<S> {
    let weight = weights::at(simd, x.abs(), is_tent);
    if is_tent { weight } else { weight * (1.0 / 6.0) }
}

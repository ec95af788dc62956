//! Samples that are shaded first, gathered along rays.
//!
//! Eight rays go from slice to slice of the lattice's outermost axis together, and meet the kernels of each that any of
//! them is within reach of, in the order of the traversal. A layer is composited when no later slice has a kernel in it.

use fearless_simd::{Simd, prelude::*};

use super::among::beyond;
use super::grid::{Grid, Layering, Line, Part, Run, Shape, least, most, runs, within};
use super::lanes::{Lanes, Look, Mask, all, any, choose};
use super::laying::Laying;
use super::passing::footprint;
use super::samples::Along;
use crate::volume::BRICK;

/// Surfaces so few steps of the lattice behind a slice count as before it: rounding must not decide, pixel by pixel.
const SLICE_TIE: f32 = 1.0 / 256.0;
/// What is added to the reach of a row, voxels: roundings must not lose a sample.
const ROW_MARGIN: f32 = 1e-3;
/// Layers that roundings may reach beyond what was thought.
const MORE_LAYERS: f32 = 6.0;

/// Eight rays on their way through a lattice.
pub(super) struct Walk<'a, 'k, S: Simd> {
    pub laying: Laying<'a, 'k, S>,
    pub grid: &'a Grid,
    pub samples: Along<'a>,
    pub line: Line<S>,
}

impl<S: Simd> Walk<'_, '_, S> {
    /// All of the way.
    #[inline(always)]
    pub(super) fn along(&mut self) {
        if let Shape::Separable(product) = self.grid.shape {
            return self.along_slabs(product);
        }
        let slices = self.line.slices(self.laying.simd, self.grid);
        if slices[0] > slices[1] {
            return;
        }
        match self.grid.layering {
            Layering::Sample | Layering::Slice => {
                for run in runs(slices, self.grid.splits[0], self.laying.rule.back_to_front) {
                    if !self.slices(run, false) {
                        return;
                    }
                }
            }
            Layering::Sheets | Layering::Slabs => {
                let rises = self.line.direction[0].simd_gt(all(self.laying.simd, 0.0));
                let (up, down) = (rises & self.line.is_in, !rises & self.line.is_in);
                // Only then is a layer done before all slices are.
                let is_straight = !self.line.grazes_any() && any(up) != any(down);
                self.make_ring(slices, is_straight);
                let count = slices[1] - slices[0] + 1;
                let run = match any(up) != self.laying.rule.back_to_front {
                    true => Run { first: slices[0], count, way: 1 },
                    false => Run { first: slices[1], count, way: -1 },
                };
                if self.slices(run, is_straight) {
                    self.laying.lay_until(i32::MAX);
                }
            }
        }
    }

    /// Makes room for the layers that rays are in at once.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 2²¹")]
    fn make_ring(&mut self, slices: [i32; 2], is_straight: bool) {
        let Self { laying: Laying { simd, faces, .. }, line, .. } = self;
        let (simd, is_in) = (*simd, line.is_in);
        let [near, far] = [faces.place(line.enter), faces.place(line.leave)];
        let (nearest, farthest) = (least(simd, is_in, near), most(simd, is_in, far));
        let mut count = farthest - nearest;
        if is_straight {
            let across = slices.map(
                #[inline(always)]
                |slice| {
                    let place = faces.place(line.crossing(simd, slice).0);
                    most(simd, is_in, place) - least(simd, is_in, place)
                },
            );
            let spread = faces.place(line.enter + line.spread * 2.0) - near;
            count = count.min(across[0].max(across[1]) + most(simd, is_in, spread));
        }
        let count = (count + MORE_LAYERS).clamp(1.0, 2e6) as usize;
        self.laying.layers.ring.clear();
        self.laying.layers.ring.resize(count.next_power_of_two(), Look::splat(simd, [0.0; 4]));
        self.laying.layers.next = match self.laying.rule.back_to_front {
            true => -(farthest.floor() as i32) - 1,
            false => nearest.floor() as i32 - 1,
        };
        self.laying.layers.end = i32::MIN;
    }

    /// Slices in their order, leaping over those of bricks in which nothing can show; false where nothing behind can be
    /// seen. Where they come one after another along the rays, layers that no later one has a kernel in are done.
    #[inline(always)]
    fn slices(&mut self, run: Run, are_in_order: bool) -> bool {
        let simd = self.laying.simd;
        let leaps = !self.line.grazes_any();
        // The first slice that has not been looked at as part of a brick.
        let (mut i, mut unknown) = (0, 0);
        while i < run.count {
            let slice = run.at(i);
            if leaps && i >= unknown {
                let brick = BRICK as i32;
                let left = if run.way > 0 { brick - 1 - slice % brick } else { slice % brick };
                let more = left.min(run.count - 1 - i);
                unknown = i + more + 1;
                if !self.may_show(slice, run.at(i + more)) {
                    i = unknown;
                    continue;
                }
            }
            i += 1;
            let (at, place) = self.line.crossing(simd, slice);
            if are_in_order {
                self.lay_before(at);
            }
            let window = self.line.window(simd, &place, self.grid);
            let [rows, columns] = window;
            if rows[0] > rows[1]
                || columns[0] > columns[1]
                || !self
                    .samples
                    .any_shows([slice, rows[0], columns[0]], [slice, rows[1], columns[1]])
            {
                continue;
            }
            if self.grid.layering == Layering::Sample || self.grid.layering == Layering::Slice {
                self.lay_before_slice(slice);
            }
            self.slice(slice, (at, &place), window);
            if self.grid.layering == Layering::Slice {
                self.laying.lay_slice();
            }
            if !self.laying.goes_on() {
                return false;
            }
        }
        true
    }

    /// Whether anything can show about the rays in all slices between two of one brick.
    #[inline(always)]
    fn may_show(&self, first: i32, last: i32) -> bool {
        let simd = self.laying.simd;
        let ends = [first, last].map(
            #[inline(always)]
            |slice| {
                let (_, place) = self.line.crossing(simd, slice);
                self.line.window(simd, &place, self.grid)
            },
        );
        // Rays are straight: between two slices no window reaches beyond both.
        let [rows, columns] =
            [0, 1].map(|k| [ends[0][k][0].min(ends[1][k][0]), ends[0][k][1].max(ends[1][k][1])]);
        let low = [first.min(last), rows[0], columns[0]];
        let high = [first.max(last), rows[1], columns[1]];
        rows[0] <= rows[1] && columns[0] <= columns[1] && self.samples.any_shows(low, high)
    }

    /// Adds the samples of a slice that rays pass within reach.
    #[inline(always)]
    fn slice(
        &mut self,
        slice: i32,
        (at, place): (Lanes<S>, &[Lanes<S>; 3]),
        [rows, columns]: [[i32; 2]; 2],
    ) {
        let simd = self.laying.simd;
        let back = self.laying.rule.back_to_front;
        let [_, split_rows, split_columns] = self.grid.splits;
        for rows in runs(rows, split_rows, back) {
            for i in 0..rows.count {
                let row = rows.at(i);
                let samples = self.samples.row([slice, row]);
                match self.grid.shape {
                    Shape::Radial(..) => {
                        let Some((columns, of_row)) = self.radial_row(slice, row, place, columns)
                        else {
                            continue;
                        };
                        for columns in runs(columns, split_columns, back) {
                            for j in 0..columns.count {
                                let column = columns.at(j);
                                let Some(look) = samples.look(column) else { continue };
                                if let Some(part) = self.radial(column, at, place, &of_row) {
                                    self.laying.add(look, part);
                                }
                            }
                        }
                    }
                    Shape::Box => {
                        let across = [self.chord(0, slice), self.chord(1, row)];
                        let mut near = across[0][0].max(across[1][0]);
                        if let Some(eye) = self.laying.eye {
                            near = near.max(eye);
                        }
                        let far = across[0][1].min(across[1][1]);
                        if !any(near.simd_lt(far) & self.line.is_in) {
                            continue;
                        }
                        for columns in runs(columns, split_columns, back) {
                            for j in 0..columns.count {
                                let column = columns.at(j);
                                let Some(look) = samples.look(column) else { continue };
                                let [enter, leave] = self.chord(2, column);
                                let (enter, leave) = (near.max(enter), far.min(leave));
                                let is_hit = enter.simd_lt(leave) & self.line.is_in;
                                if any(is_hit) {
                                    let half = (leave - enter) * 0.5;
                                    let amount = half * 2.0 * self.laying.packet.stretch;
                                    let middle = (leave + enter) * 0.5;
                                    let q = all(simd, 0.0);
                                    self.laying.add(look, Part { is_hit, amount, q, middle, half });
                                }
                            }
                        }
                    }
                    Shape::Point => {
                        for columns in runs(columns, split_columns, back) {
                            for j in 0..columns.count {
                                let column = columns.at(j);
                                let Some(look) = samples.look(column) else { continue };
                                let Some(landed) = self.grid.points.land([slice, row, column])
                                else {
                                    continue;
                                };
                                let is_hit = landed.is_in(simd, self.laying.packet.screen);
                                let is_hit = is_hit & self.line.is_in;
                                if any(is_hit) {
                                    let amount = self.laying.packet.stretch * landed.length;
                                    let middle = all(simd, landed.depth);
                                    let (q, half) = (all(simd, 0.0), all(simd, 0.0));
                                    self.laying.add(look, Part { is_hit, amount, q, middle, half });
                                }
                            }
                        }
                    }
                    Shape::Separable(_) => {}
                }
            }
        }
    }

    /// Depths between which rays are in the same part of an axis as a sample's box.
    #[inline(always)]
    fn chord(&self, axis: usize, index: i32) -> [Lanes<S>; 2] {
        let simd = self.laying.simd;
        let (origin, inverse) = (self.line.origin[axis], self.line.inverse[axis]);
        let from = all(simd, index as f32) - origin;
        let (low, high) = ((from - 0.5) * inverse, (from + 0.5) * inverse);
        // A face is of the box behind it.
        let is_along = self.line.unit[axis].abs().simd_lt(all(simd, 1e-9));
        let is_in = (origin + 0.5).floor().simd_eq(all(simd, index as f32));
        let endless = choose(is_in, all(simd, 3e38), all(simd, -3e38));
        [choose(is_along, -endless, low.min(high)), choose(is_along, endless, low.max(high))]
    }

    /// The columns of a row that rays pass within reach, and what their kernels have in common: the offset from where the
    /// rays cross the slice, and of that what lies across the step.
    #[inline(always)]
    fn radial_row(
        &self,
        slice: i32,
        row: i32,
        place: &[Lanes<S>; 3],
        columns: [i32; 2],
    ) -> Option<([i32; 2], RadialRow<S>)> {
        let simd = self.laying.simd;
        let [ua, ub, uc] = self.line.unit;
        let a = all(simd, slice as f32) - place[0];
        let b = all(simd, row as f32) - place[1];
        let rest = a * ub - b * ua;
        let part = [b * uc, -(a * uc)];
        let bend = ua.mul_add(ua, ub * ub).max(all(simd, 1e-12));
        let middle = (ub * part[0] - ua * part[1]) / bend;
        let nearest = part[0].mul_add(ua, part[1] * ub);
        let radius2 = all(simd, self.grid.radius * self.grid.radius);
        let half2 = (radius2 - rest * rest - nearest * nearest / bend) / bend;
        let is_in = half2.simd_gt(all(simd, 0.0)) & self.line.is_in;
        if !any(is_in) {
            return None;
        }
        let half = half2.max(all(simd, 0.0)).sqrt() + ROW_MARGIN;
        let middle = place[2] + middle;
        let ends = [least(simd, is_in, middle - half), most(simd, is_in, middle + half)];
        let along = a.mul_add(ua, b * ub);
        Some((within(ends, columns), RadialRow { rest2: rest * rest, part, along, is_in }))
    }

    /// What rays have of the kernel of a sample.
    #[inline(always)]
    fn radial(
        &self,
        column: i32,
        at: Lanes<S>,
        place: &[Lanes<S>; 3],
        row: &RadialRow<S>,
    ) -> Option<Part<S>> {
        let simd = self.laying.simd;
        let Shape::Radial(polynomial, _) = &self.grid.shape else { return None };
        let [ua, ub, uc] = self.line.unit;
        let c = all(simd, column as f32) - place[2];
        // Offset × step.
        let x = row.part[0] - c * ub;
        let y = row.part[1] + c * ua;
        let l2 = x.mul_add(x, y.mul_add(y, row.rest2));
        let radius = self.grid.radius;
        let radius2 = all(simd, radius * radius);
        let is_hit = row.is_in & l2.simd_lt(radius2);
        if !any(is_hit) {
            return None;
        }
        let per_index = self.line.per_index;
        let q = l2 * (1.0 / (radius * radius));
        let amount = footprint(simd, polynomial, q) * per_index * self.laying.packet.stretch;
        let middle = c.mul_add(uc, row.along).mul_add(per_index, at);
        let half = (radius2 - l2).max(all(simd, 1e-20)).sqrt() * per_index;
        Some(Part { is_hit, amount, q, middle, half })
    }

    /// Lays down the layers that end before any kernel of a slice begins, and of those after it.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "saturates")]
    fn lay_before(&mut self, at: Lanes<S>) {
        let Self { laying: Laying { simd, faces, .. }, line, .. } = self;
        let until = match self.laying.rule.back_to_front {
            true => -(most(*simd, line.is_in, faces.place(at + line.spread)).floor() as i32),
            false => least(*simd, line.is_in, faces.place(at - line.spread)).floor() as i32,
        };
        self.laying.lay_until(until);
    }

    /// Lays down what comes before a slice.
    #[inline(always)]
    fn lay_before_slice(&mut self, slice: i32) {
        if self.laying.among.is_none() {
            return;
        }
        let simd = self.laying.simd;
        let (unit, direction) = (self.line.unit[0], self.line.direction[0]);
        let zero = all(simd, 0.0);
        let is_upward = direction.simd_gt(zero);
        let tie = choose(is_upward, all(simd, SLICE_TIE), all(simd, -SLICE_TIE));
        let from = all(simd, slice as f32) - self.line.origin[0];
        let mut depth = (from + tie) * self.line.inverse[0];
        let is_beyond = slice >= self.grid.splits[0];
        if self.grid.is_perspective {
            let is_behind_eye = if is_beyond { !is_upward } else { is_upward };
            let far = beyond(simd, Mask::splat(simd, is_beyond));
            depth = choose(is_behind_eye, far, depth);
        }
        let is_along = unit.abs().simd_lt(all(simd, 1e-9));
        let is_behind = from.simd_gt(zero);
        let is_behind = if is_beyond { is_behind } else { !is_behind };
        depth = choose(is_along, beyond(simd, is_behind), depth);
        let Laying { rule, among, light, capped, .. } = &mut self.laying;
        *capped += among.lay_until(simd, rule, depth, light);
    }
}

/// What the kernels of a row have in common for eight rays.
#[derive(Clone, Copy)]
struct RadialRow<S: Simd> {
    /// Of offset × step: the square of the part along the innermost axis, and the two others at column 0.
    rest2: Lanes<S>,
    part: [Lanes<S>; 2],
    /// Of the offset, what lies along the step.
    along: Lanes<S>,
    is_in: Mask<S>,
}

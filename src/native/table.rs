//! Colours and weights of values, and of all values between two: a transfer function and its integrals, eight rays at
//! a time (`transfer::Cumulative` has the definition).

use fearless_simd::{Simd, f32x4, i32x8, prelude::*, u32x8};

use super::lanes::{LANES, Lanes, Look, Mask, Vec3, all, any, choose, columns};
use super::lattice::Lattice;
use super::light::ValueScale;
use crate::core::parallel;
use crate::core::{Cancelled, Ticket};
use crate::transfer::Cumulative;

/// Part of a cell by which values are lifted, so that rounding does not take one out of the cell that
/// begins with it.
const LIFT_CELLS: f64 = 0.0625;
/// Values nearer to each other than this many cells are classified by the one in their middle: single
/// precision has too few digits for the difference of their integrals.
const NEAR_CELLS: f32 = 4.0;

/// Bricks between two looks at the ticket.
const A_PART: usize = 1 << 12;

/// A transfer function, ready for a lattice, and where it shows anything of it.
#[derive(Debug)]
pub(super) struct Table {
    /// Of each cell: red and green, blue, as 16-bit fractions; growth of the weight across it; its mean weight. Then
    /// what is integrated up to where each cell begins, and to the end: colour times weight, and weight.
    entries: Vec<[u32; 4]>,
    cells: f32,
    /// Cells between which all lie that show.
    shown: [f32; 2],
    /// Colour and weight below the first cell, and beyond the last.
    below: [f32; 4],
    beyond: [f32; 4],
    /// Colour and weight of samples without data.
    pub no_data: [f32; 4],
    /// Cell of a stored value 0, and cells per unit of it.
    pub offset: f32,
    pub scale: f32,
    /// Cells by value.
    pub values: ValueScale,
    /// Bricks in which anything can show.
    pub visible: Vec<u32>,
}

/// Looks of the two halves of a slab.
#[derive(Clone, Copy)]
pub(super) struct Halves<S: Simd> {
    pub near: Look<S>,
    pub far: Look<S>,
}

impl<S: Simd> Halves<S> {
    /// Nothing.
    #[inline(always)]
    pub(super) fn none(simd: S) -> Self {
        let none = Look::splat(simd, [0.0; 4]);
        Self { near: none, far: none }
    }

    /// What both weigh together.
    #[inline(always)]
    pub(super) fn weight(&self) -> Lanes<S> {
        self.near.weight + self.far.weight
    }

    /// Nothing, of some rays.
    #[inline(always)]
    pub(super) fn without(mut self, simd: S, rays: Mask<S>) -> Self {
        self.near.weight = choose(rays, all(simd, 0.0), self.near.weight);
        self.far.weight = choose(rays, all(simd, 0.0), self.far.weight);
        self
    }
}

impl Table {
    /// Isosurfaces at `levels` show where the field passes them.
    ///
    /// # Errors
    /// [`Cancelled`].
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits, as the device's")]
    pub(super) fn new(
        lattice: &Lattice,
        of: &Cumulative,
        levels: &[f64],
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let cells = of.cells.iter().zip(&of.slopes).map(|(&[r, g, b, weight], &slope)| {
            #[expect(clippy::cast_sign_loss, reason = "0..=65535")]
            let unorm = |x: f32| (x.clamp(0.0, 1.0) * 65535.0 + 0.5) as u32;
            [unorm(r) | unorm(g) << 16, unorm(b), slope.to_bits(), weight.to_bits()]
        });
        let sums = of.emission.iter().zip(&of.depth);
        let sums = sums.map(|(e, &w)| [e[0], e[1], e[2], w].map(f32::to_bits));
        let holes_show = of.no_data[3] > 0.0;
        let near_holes = if holes_show { lattice.near_holes(ticket)? } else { &[] };
        let shows = |brick: usize, [low, high]: [f32; 2]| {
            let (low, high) = (f64::from(low) + lattice.bias, f64::from(high) + lattice.bias);
            // The rounding of 32 bits.
            let slack = 1e-6 * low.abs().max(high.abs());
            let (low, high) = (low - slack, high + slack);
            of.shows(low, high)
                || near_holes.get(brick).is_some_and(|is| *is)
                || levels.iter().any(|level| (low..=high).contains(level))
        };
        let mut visible = Vec::new();
        for (part, ranges) in lattice.bricks.ranges.chunks(A_PART).enumerate() {
            ticket.look()?;
            let first = part * A_PART;
            let shown = parallel::list(ranges.len(), |i| shows(first + i, ranges[i]));
            let shown = (first..).zip(shown).filter(|(_, shows)| *shows);
            visible.extend(shown.map(|(brick, _)| brick as u32));
        }
        Ok(Self {
            entries: cells.chain(sums).collect(),
            cells: of.cells.len() as f32,
            shown: of.shown(),
            below: of.ends[0],
            beyond: of.ends[1],
            no_data: of.no_data,
            offset: ((lattice.bias - of.low) * of.scale + LIFT_CELLS) as f32,
            scale: of.scale as f32,
            values: ValueScale { of_zero: LIFT_CELLS - of.low * of.scale, per_value: of.scale },
            visible,
        })
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        (size_of_val(&self.entries[..]) + size_of_val(&self.visible[..])) as u64
    }

    /// The cells of stored values.
    #[inline(always)]
    pub(super) fn cell<S: Simd>(&self, simd: S, stored: Lanes<S>) -> Lanes<S> {
        stored.mul_add(all(simd, self.scale), all(simd, self.offset))
    }

    /// Whether values between two, and along a parabola with so much `bend` (below), can lie in cells that show.
    #[inline(always)]
    pub(super) fn may_show<S: Simd>(
        &self,
        simd: S,
        [near, far]: [Lanes<S>; 2],
        bend: Lanes<S>,
    ) -> Mask<S> {
        let middle = (near + far).mul_add(all(simd, 0.5), bend * 1.5);
        let shift = bend * 0.25;
        let least = near.min(far).min(middle) + shift;
        let most = near.max(far).max(middle) + shift;
        most.simd_ge(all(simd, self.shown[0])) & least.simd_le(all(simd, self.shown[1]))
    }

    /// The looks of single values.
    #[inline(always)]
    pub(super) fn look<S: Simd>(&self, simd: S, cell: Lanes<S>) -> Look<S> {
        self.fetched(simd, cell, Mask::splat(simd, true))
    }

    /// All values between two faces, along a parabola whose mean differs by `bend` from theirs: in each half along the
    /// straight line with its mean.
    #[inline(always)]
    pub(super) fn between<S: Simd>(
        &self,
        simd: S,
        [near, far]: [Lanes<S>; 2],
        bend: Lanes<S>,
    ) -> Halves<S> {
        let shift = bend * 0.25;
        let half = (near + far).mul_add(all(simd, 0.5), bend * 1.5);
        // The nearest places in the table: unbiased, and never further off than half a cell.
        let nearest = |u: Lanes<S>| (u + shift + 0.5).floor();
        let (begin, middle, end) = (nearest(near), nearest(half), nearest(far));
        let limit = all(simd, NEAR_CELLS);
        let near_is_close = (middle - begin).abs().simd_lt(limit);
        let far_is_close = (end - middle).abs().simd_lt(limit);
        let mean = |a: Lanes<S>, b: Lanes<S>| (a + b).mul_add(all(simd, 0.5), shift);
        let first =
            self.fetched(simd, choose(near_is_close, mean(near, half), begin), near_is_close);
        let third = self.fetched(simd, choose(far_is_close, mean(half, far), end), far_is_close);
        if any(!(near_is_close & far_is_close)) {
            let second = self.fetched(simd, middle, Mask::splat(simd, false));
            let before = mean_between(simd, &first, &second, middle - begin);
            let after = mean_between(simd, &second, &third, end - middle);
            return Halves {
                near: Look::choose(near_is_close, first, before),
                far: Look::choose(far_is_close, third, after),
            };
        }
        Halves { near: first, far: third }
    }

    /// All values between two faces along a straight line, of the whole slab together.
    #[inline(always)]
    pub(super) fn whole<S: Simd>(&self, simd: S, [near, far]: [Lanes<S>; 2]) -> Halves<S> {
        let [begin, end] = [(near + 0.5).floor(), (far + 0.5).floor()];
        let is_close = (end - begin).abs().simd_lt(all(simd, NEAR_CELLS));
        let middle = (near + far) * 0.5;
        let first = self.fetched(simd, choose(is_close, middle, begin), is_close);
        if !any(!is_close) {
            return Halves { near: first, far: first };
        }
        let last = self.fetched(simd, end, Mask::splat(simd, false));
        let found = Look::choose(is_close, first, mean_between(simd, &first, &last, end - begin));
        Halves { near: found, far: found }
    }

    /// What the table holds about a place: colour and weight of `is_cell`, else what is integrated up to there, where
    /// places are whole.
    #[inline(always)]
    fn fetched<S: Simd>(&self, simd: S, place: Lanes<S>, is_cell: Mask<S>) -> Look<S> {
        let last = all(simd, self.cells);
        let zero = all(simd, 0.0);
        let most = choose(is_cell, last - 1.0, last);
        let first = choose(is_cell, zero, last);
        // Not a number is 0, too: `max` before `min`.
        let index = (place.max(zero).min(most)).floor() + first;
        let index = index.to_int::<i32x8<S>>().to_array();
        let mut rows = [f32x4::splat(simd, 0.0); LANES];
        for (row, i) in rows.iter_mut().zip(index) {
            #[expect(clippy::cast_sign_loss, reason = "clamped")]
            let [a, b, c, d] = self.entries[i as usize];
            *row = f32x4::load_array(simd, [a, b, c, d].map(f32::from_bits));
        }
        let [x, y, z, w] = columns(rows);
        let (mut colour, mut weight) = (Vec3 { x, y, z }, w);
        if any(is_cell) {
            let low: u32x8<S> = u32x8::splat(simd, 0xffff);
            let unorm = |bits: u32x8<S>| {
                let bits: i32x8<S> = bits.bitcast();
                bits.to_float::<Lanes<S>>() * (1.0 / 65535.0)
            };
            let (red_green, blue): (u32x8<S>, u32x8<S>) = (x.to_bits(), y.to_bits());
            let held = Look {
                colour: Vec3 {
                    x: unorm(red_green & low),
                    y: unorm(red_green >> 16_u32),
                    z: unorm(blue & low),
                },
                #[expect(clippy::cast_possible_truncation, reason = "a constant")]
                weight: z.mul_add(place - place.floor() - (0.5 + LIFT_CELLS as f32), w).max(zero),
            };
            let beyond = place.simd_ge(last);
            let below = place.simd_lt(zero);
            let held = Look::choose(beyond, Look::splat(simd, self.beyond), held);
            let held = Look::choose(below, Look::splat(simd, self.below), held);
            let found = Look::choose(is_cell, held, Look { colour, weight });
            (colour, weight) = (found.colour, found.weight);
        }
        let outside = choose(is_cell, zero, place.min(zero));
        let past = choose(is_cell, zero, (place - last).max(zero));
        if any(outside.simd_lt(zero) | past.simd_gt(zero)) {
            let more = |[r, g, b, w]: [f32; 4], by: Lanes<S>| {
                (Vec3::splat(simd, [r * w, g * w, b * w]).scaled(by), by * w)
            };
            let (before, weight_before) = more(self.below, outside);
            let (after, weight_after) = more(self.beyond, past);
            colour = colour.add(before).add(after);
            weight += weight_before + weight_after;
        }
        Look { colour, weight }
    }
}

/// Mean colour and weight from two integrals over values, and the cells between them.
#[inline(always)]
fn mean_between<S: Simd>(simd: S, from: &Look<S>, to: &Look<S>, width: Lanes<S>) -> Look<S> {
    let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
    let weight = to.weight - from.weight;
    let share = one / choose(weight.simd_eq(zero), one, weight);
    let colour = |to: Lanes<S>, from: Lanes<S>| ((to - from) * share).max(zero).min(one);
    let width = choose(width.simd_eq(zero), one, width);
    Look {
        colour: Vec3 {
            x: colour(to.colour.x, from.colour.x),
            y: colour(to.colour.y, from.colour.y),
            z: colour(to.colour.z, from.colour.z),
        },
        weight: (weight / width).max(zero),
    }
}

//! The marks of kernels (`vector::Marks`), eight rays at a time.

use fearless_simd::{Simd, i32x8, prelude::*, u32x8};

use super::kernels::{Footprint, LEAST_ACROSS};
use super::lanes::{LANES, Lanes, all};
use crate::core::{Cancelled, Ticket};
use crate::vector::{Design, FORESHORTENINGS, Foreshortening, MARK_COLUMNS, Marks, PHASES};

/// The number of the smallest size.
pub(super) const LAST_LEVEL: u8 = 4;

/// A table of marks, so laid out that a lookup finds what it mixes in one place.
#[derive(Debug)]
pub(super) struct MarkTable {
    pub design: Design,
    /// By size; each by column, phase, y, x.
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    side: usize,
    /// Intensities of a byte: of a foreshortening and a phase, the next phase, and both of the next foreshortening.
    texels: Vec<u32>,
    /// What the marks have lost of their contrast, by column.
    blur: [f32; MARK_COLUMNS],
}

impl MarkTable {
    /// Of a design.
    ///
    /// # Errors
    /// [`Cancelled`].
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits, as the device's")]
    pub(super) fn new(design: Design, ticket: &Ticket) -> Result<Self, Cancelled> {
        let made = Marks::of(design, ticket)?;
        let levels = made.levels.iter().map(|level| {
            ticket.look()?;
            let texels = level.texels().into_iter().map(u32::from_le_bytes).collect();
            Ok(Level { side: level.side, texels, blur: level.blur.map(|blur| blur as f32) })
        });
        Ok(Self { design, levels: levels.collect::<Result<_, Cancelled>>()? })
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        self.levels.iter().map(|level| size_of_val(&level.texels[..]) as u64).sum()
    }

    /// Intensities of a kernel's marks (0..=1) at places in its window, `phase` cycles on; and the part of what is not
    /// marked that blurred marks give light for all the same (`Marks::light`).
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small, positive")]
    pub(super) fn at<S: Simd>(
        &self,
        simd: S,
        kernel: &Footprint,
        (phase, foreshortening): (f32, Foreshortening),
        [x, y]: [Lanes<S>; 2],
    ) -> (Lanes<S>, f32) {
        let is_round = foreshortening == Foreshortening::Coordinates;
        let level = &self.levels[usize::from(kernel.level)];
        let turns = phase + kernel.phase;
        let turns = (turns - turns.floor()) * PHASES as f32;
        let early = (turns as usize).min(PHASES - 1);
        let place = kernel.across * (FORESHORTENINGS - 1) as f32;
        let low = (place as usize).min(FORESHORTENINGS - 2);
        let (column, share) =
            if is_round { (FORESHORTENINGS, 0.0) } else { (low, place - low as f32) };
        let side = level.side;
        let picture = &level.texels[(column * PHASES + early) * side * side..][..side * side];
        let last = all(simd, side as f32 - 1.0);
        let zero = all(simd, 0.0);
        let texel = |v: Lanes<S>| v.mul_add(all(simd, 0.5), all(simd, 0.5)) * side as f32 - 0.5;
        let stretched = if is_round { x / kernel.across.max(LEAST_ACROSS as f32) } else { x };
        let (x, y) = (texel(stretched), texel(y));
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = (x - left, y - top);
        let clamped = |v: Lanes<S>| v.max(zero).min(last).to_int::<i32x8<S>>();
        let (left, right) = if is_round {
            // The side is a power of two.
            let mask = i32x8::splat(simd, side as i32 - 1);
            let left = left.max(all(simd, -1e6)).min(all(simd, 1e6)).to_int::<i32x8<S>>();
            (left & mask, (left + i32x8::splat(simd, 1)) & mask)
        } else {
            (clamped(left), clamped(left + 1.0))
        };
        let row = |v: Lanes<S>| clamped(v) * i32x8::splat(simd, side as i32);
        let (upper, lower) = (row(top), row(top + 1.0));
        let late = turns - early as f32;
        let scale = 1.0 / 255.0;
        let weights = [
            (1.0 - late) * (1.0 - share) * scale,
            late * (1.0 - share) * scale,
            (1.0 - late) * share * scale,
            late * share * scale,
        ];
        let corners = [upper + left, upper + right, lower + left, lower + right];
        let mut found = [zero; 4];
        for (found, at) in found.iter_mut().zip(corners) {
            let at: [i32; LANES] = at.to_array();
            let mut texels = [0_u32; LANES];
            for (texel, at) in texels.iter_mut().zip(at) {
                *texel = picture[at as usize];
            }
            let texels = u32x8::load_array(simd, texels);
            let byte = u32x8::splat(simd, 0xff);
            let mut sum = zero;
            for (i, weight) in weights.into_iter().enumerate() {
                let bits: i32x8<S> = ((texels >> (8 * i as u32)) & byte).bitcast();
                sum = bits.to_float::<Lanes<S>>().mul_add(all(simd, weight), sum);
            }
            *found = sum;
        }
        let mix = |a: Lanes<S>, b: Lanes<S>, f: Lanes<S>| (b - a).mul_add(f, a);
        let mark = mix(mix(found[0], found[1], fx), mix(found[2], found[3], fx), fy);
        let blur = level.blur[column];
        let beside = level.blur[(column + 1).min(MARK_COLUMNS - 1)];
        (mark, blur + (beside - blur) * share)
    }
}

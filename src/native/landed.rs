//! What lands where in a picture: the list of each part of it, of things that reach so far on the screen and in depth.

use std::ops::Range;

use glam::DVec3;

use super::in_order::look;
use super::rays::{Rays, TILE};
use super::sums::Asked;
use super::supports::{NotBegun, Unsupported};
use crate::core::Ticket;
use crate::core::parallel;

/// The most entries that the lists of a picture have: more take seconds for each picture.
const MOST_ENTRIES: u64 = 1 << 26;
/// Things before a pixel, at most, in the mean over a picture of some parts: its ray asks each of them, and would take seconds.
const MOST_BEFORE_A_PIXEL: u64 = 1 << 16;
const SOME_PARTS: u64 = 256;
/// Things that are placed between two looks at the ticket.
const A_PART: usize = 1 << 12;
/// And things that are listed: one may land on every part.
const A_FEW: usize = 1 << 6;
/// Lists are of blocks where these have so many times as many entries as tiles, at most: things are small, and rays would look
/// at many of their tile's in vain.
const BLOCKS_OVER_TILES: u64 = 4;
/// Pixels of a block, which eight rays go through together.
const BLOCK: [u32; 2] = [4, 2];

/// The things that land on each part of a picture, in the order of their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Landed {
    /// Pixels of a part, across and down: a tile's or a block's.
    part: [u32; 2],
    /// Parts in a row.
    across: usize,
    /// Where the list of each part begins, rows from the top, and where the last ends.
    starts: Vec<usize>,
    entries: Vec<Entry>,
}

/// A thing on a part of a picture.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Entry {
    /// Which one.
    pub number: u32,
    /// The blocks of the tile that it may be met in, a bit each.
    pub blocks: u8,
    /// Depths between which it can be met there, pixels.
    pub depths: [f32; 2],
}

impl Entry {
    /// Whether it may be met in the block of a bit, between two depths.
    #[inline(always)]
    pub(super) fn may_be_met(&self, block: u8, [near, far]: [f32; 2]) -> bool {
        self.blocks & block != 0 && self.depths[1] >= near && self.depths[0] <= far
    }
}

/// The bit in [`Entry::blocks`] of the block that begins at a pixel.
#[inline(always)]
pub(super) fn block_bit(pixel: [u32; 2]) -> u8 {
    let [x, y] = pixel.map(|at| at % TILE);
    1 << (y / BLOCK[1] * (TILE / BLOCK[0]) + x / BLOCK[0])
}

/// A thing about a place: its box's middle from the lattice's, and half its sides, in view space, pixels.
pub(super) type Extent = [DVec3; 2];

/// Where a thing lands: the pixels that a ray of theirs may meet it in, from and up to.
#[derive(Debug, Clone)]
struct Place {
    number: u32,
    columns: Range<u32>,
    rows: Range<u32>,
    depths: [f32; 2],
}

impl Landed {
    /// Of things whose boxes are known; what lies nowhere has none. `what` names them. Where `asked` says at which depths
    /// rays look, what lies between two of these is left out. The same on any number of threads.
    ///
    /// # Errors
    /// More than lists have room for, and a cancelled ticket.
    pub(super) fn new(
        (extents, what): (&[Option<Extent>], &str),
        (rays, asked): (&Rays, Option<Asked>),
        ticket: &Ticket,
    ) -> Result<Self, NotBegun> {
        let depths = asked.and_then(Asked::shift).map(|shift| (rays.step, shift));
        let mut places = Vec::new();
        for (i, some) in extents.chunks(A_PART).enumerate() {
            look(ticket)?;
            let place = |at: usize| {
                let number = (i * A_PART + at) as u32;
                some[at].and_then(|extent| Place::of(number, extent, (rays, depths)))
            };
            places.extend(parallel::list(some.len(), place).into_iter().flatten());
        }
        let [on_tiles, on_blocks] = [[TILE; 2], BLOCK]
            .map(|part| places.iter().map(|place| place.parts(part)).sum::<u64>());
        let is_of_blocks = on_blocks <= BLOCKS_OVER_TILES * on_tiles;
        let (part, count) = if is_of_blocks { (BLOCK, on_blocks) } else { ([TILE; 2], on_tiles) };
        let across = rays.size[0].div_ceil(part[0]) as usize;
        let down = rays.size[1].div_ceil(part[1]) as usize;
        let before_a_pixel = count / (across * down).max(1) as u64;
        if before_a_pixel > MOST_BEFORE_A_PIXEL && (across * down) as u64 >= SOME_PARTS {
            let found = format!("{what} that lie on each other, {before_a_pixel} before a pixel");
            return Err(Unsupported(found).into());
        }
        if count > MOST_ENTRIES {
            let found = format!("{what} that land on more than {MOST_ENTRIES} tiles");
            return Err(Unsupported(found).into());
        }
        // Each thread has bands of rows to itself.
        let band = down.div_ceil(4 * rayon::current_num_threads()).max(1);
        let rows = |i: usize| (i * band) as u32..((i + 1) * band).min(down) as u32;
        let mut starts = vec![0_usize; across * down + 1];
        let counts = starts[1..].chunks_mut((band * across).max(1));
        parallel::each(counts.enumerate(), |(i, counts)| {
            let rows = rows(i);
            // A list of all is long where cells lie on each other.
            for some in places.chunks(A_FEW).take_while(|_| !ticket.is_cancelled()) {
                for place in some {
                    place.each(part, &rows, |row, column| counts[row * across + column] += 1);
                }
            }
        });
        look(ticket)?;
        for tile in 1..starts.len() {
            starts[tile] += starts[tile - 1];
        }
        let mut entries = vec![Entry::default(); starts[across * down]];
        let mut left = &mut entries[..];
        let bands: Vec<_> = (0..down.div_ceil(band))
            .map(|i| {
                let Range { start, end } = rows(i);
                let own = [start, end].map(|row| starts[row as usize * across]);
                let (band, rest) = std::mem::take(&mut left).split_at_mut(own[1] - own[0]);
                left = rest;
                (start..end, band)
            })
            .collect();
        parallel::each(bands.into_iter(), |(rows, entries)| {
            let first = rows.start as usize * across;
            let begin = starts[first];
            let mut next: Vec<usize> = starts[first..first + rows.len() * across].to_vec();
            let asked = places.chunks(A_FEW).take_while(|_| !ticket.is_cancelled());
            for place in asked.flatten() {
                place.each(part, &rows, |row, column| {
                    let at = &mut next[row * across + column];
                    let tile = [column as u32, rows.start + row as u32];
                    let blocks = if is_of_blocks { u8::MAX } else { place.blocks(tile) };
                    let Place { number, depths, .. } = *place;
                    entries[*at - begin] = Entry { number, blocks, depths };
                    *at += 1;
                });
            }
        });
        look(ticket)?;
        Ok(Self { part, across, starts, entries })
    }

    /// The list of the part that a pixel is in.
    pub(super) fn on(&self, pixel: [u32; 2]) -> &[Entry] {
        let [column, row] = [0, 1].map(|a| (pixel[a] / self.part[a]) as usize);
        let part = row * self.across + column;
        &self.entries[self.starts[part]..self.starts[part + 1]]
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        (size_of_val(&self.starts[..]) + size_of_val(&self.entries[..])) as u64
    }
}

impl Place {
    /// `None` where no ray may meet it.
    #[expect(clippy::cast_possible_truncation, reason = "32 bits, as rays have")]
    fn of(
        number: u32,
        [middle, half]: Extent,
        (rays, looks): (&Rays, Option<(f32, f32)>),
    ) -> Option<Self> {
        let ([left, right, top, bottom], depths) = rays.landing(middle, half);
        if let Some(looks) = looks
            && !is_looked_at(depths, looks)
        {
            return None;
        }
        let side = f64::from(rays.side);
        let columns = pixels([left, right], side, rays.size[0])?;
        let rows = pixels([top, bottom], side, rays.size[1])?;
        Some(Self { number, columns, rows, depths: depths.map(|depth| depth as f32) })
    }

    /// How many parts of a size it lands on.
    fn parts(&self, [width, height]: [u32; 2]) -> u64 {
        let [columns, rows] = [parts(&self.columns, width), parts(&self.rows, height)];
        columns.len() as u64 * rows.len() as u64
    }

    /// Calls `visit` with each part that it lands on: its row from the first of `band`, and its column.
    #[inline(always)]
    fn each(
        &self,
        [width, height]: [u32; 2],
        band: &Range<u32>,
        mut visit: impl FnMut(usize, usize),
    ) {
        let rows = parts(&self.rows, height);
        for row in rows.start.max(band.start)..rows.end.min(band.end) {
            for column in parts(&self.columns, width) {
                visit((row - band.start) as usize, column as usize);
            }
        }
    }

    /// The blocks of a tile that it lands on: two beside one another, four times.
    fn blocks(&self, tile: [u32; 2]) -> u8 {
        let [x, y] = tile.map(|n| n * TILE);
        let mut found = 0;
        for block in 0..8 {
            let [left, top] = [x + block % 2 * BLOCK[0], y + block / 2 * BLOCK[1]];
            let is_touched = self.columns.start < left + BLOCK[0]
                && self.columns.end > left
                && self.rows.start < top + BLOCK[1]
                && self.rows.end > top;
            found |= u8::from(is_touched) << block;
        }
        found
    }
}

/// The pixels along an axis of a picture that have a ray between two places, of so many to a pixel.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn pixels([low, high]: [f64; 2], side: f64, size: u32) -> Option<Range<u32>> {
    let last_ray = f64::from(size) * side - 1.0;
    let first = (low * side - 0.5).ceil().max(0.0);
    let last = (high * side - 0.5).floor().min(last_ray);
    (first <= last).then(|| (first / side) as u32..(last / side) as u32 + 1)
}

/// Whether one of many depths lies between two: whole multiples of a step, and a share of one more.
fn is_looked_at([near, far]: [f64; 2], (step, shift): (f32, f32)) -> bool {
    let [step, shift] = [step, shift].map(f64::from);
    (near / step - shift).ceil() <= (far / step - shift).floor()
}

/// The parts of a size that pixels lie in.
fn parts(pixels: &Range<u32>, size: u32) -> Range<u32> {
    pixels.start / size..pixels.end.div_ceil(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(columns: Range<u32>, rows: Range<u32>) -> Place {
        Place { number: 0, columns, rows, depths: [0.0; 2] }
    }

    #[test]
    fn blocks_are_those_that_a_rectangle_of_pixels_touches() {
        assert_eq!(place(0..100, 0..100).blocks([1, 1]), 0xff);
        assert_eq!(place(9..11, 9..10).blocks([1, 1]), 0b1);
        assert_eq!(place(13..15, 12..14).blocks([1, 1]), 0b10_0000);
        assert_eq!(place(11..13, 0..10).blocks([1, 1]), 0b11);
        assert_eq!(place(17..19, 8..16).blocks([1, 1]), 0);
    }

    #[test]
    fn pixels_are_those_with_a_ray_between_two_places() {
        // Rays go through the middles of pixels, or of halves of them.
        assert_eq!(pixels([2.6, 4.4], 1.0, 10), Some(3..4));
        assert_eq!(pixels([2.5, 4.5], 1.0, 10), Some(2..5));
        assert_eq!(pixels([2.6, 3.4], 1.0, 10), None);
        assert_eq!(pixels([2.6, 3.4], 2.0, 10), Some(2..4));
        assert_eq!(pixels([-5.0, 0.4], 1.0, 10), None);
        assert_eq!(pixels([-5.0, 50.0], 2.0, 10), Some(0..10));
        assert_eq!(pixels([9.6, 50.0], 1.0, 10), None);
        assert_eq!(pixels([f64::NAN, 5.0], 1.0, 10), Some(0..5));
    }

    #[test]
    fn depths_are_looked_at_step_by_step() {
        assert!(is_looked_at([5.9, 6.1], (3.0, 0.0)));
        assert!(is_looked_at([6.0, 6.0], (3.0, 0.0)));
        assert!(!is_looked_at([6.1, 8.9], (3.0, 0.0)));
        assert!(is_looked_at([6.1, 8.9], (3.0, 0.5)));
        assert!(!is_looked_at([5.9, 6.1], (3.0, 0.5)));
        assert!(is_looked_at([-3.1, -2.9], (3.0, 0.0)));
    }

    #[test]
    fn parts_are_counted_as_they_are_visited() {
        let place = place(3..13, 6..9);
        for (part, expected) in [([TILE; 2], 4), (BLOCK, 8)] {
            let mut seen = Vec::new();
            for band in [0..1, 1..3, 3..9] {
                place.each(part, &band, |row, column| {
                    seen.push([row + band.start as usize, column]);
                });
            }
            assert_eq!(seen.len(), expected);
            assert_eq!(place.parts(part), expected as u64);
            assert_eq!(seen[0], [6 / part[1] as usize, 3 / part[0] as usize]);
        }
    }
}

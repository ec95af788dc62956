//! What lands where in a picture: the list of each tile, of things that reach so far on the screen and in depth.

use glam::DVec3;

use super::in_order::look;
use super::rays::{Rays, TILE};
use super::supports::{NotBegun, Unsupported};
use crate::core::Ticket;

/// The most entries that the lists of a picture have: more take seconds for each picture.
const MOST_ENTRIES: usize = 1 << 26;
/// Things that are placed between two looks at the ticket.
const A_PART: usize = 1 << 10;

/// The things that land on each tile of a picture.
#[derive(Debug, Clone, Default)]
pub(super) struct Landed {
    /// Where the list of each tile begins, rows from the top, and where the last ends.
    starts: Vec<usize>,
    entries: Vec<Entry>,
}

/// A thing on a tile.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    /// Which one.
    pub number: u32,
    /// The blocks of 4 × 2 pixels that it may be met in, a bit each.
    pub blocks: u8,
    /// Depths between which it can be met there, pixels.
    pub depths: [f32; 2],
}

/// A thing about a place: its box's middle from the lattice's, and half its sides, in view space, pixels.
pub(super) type Extent = [DVec3; 2];

impl Landed {
    /// Of things whose boxes are known; what lies nowhere has none. `what` names them.
    ///
    /// # Errors
    /// More than lists have room for, and a cancelled ticket.
    #[expect(clippy::cast_possible_truncation, reason = "32 bits, as rays have; few enough things")]
    pub(super) fn new(
        (extents, what): (&[Option<Extent>], &str),
        rays: &Rays,
        ticket: &Ticket,
    ) -> Result<Self, NotBegun> {
        let [across, down] = rays.tiles().map(|n| n as usize);
        let tile = f64::from(TILE);
        let spans = |[left, right, top, bottom]: [f64; 4]| {
            let span = |low: f64, high: f64, most: usize| {
                let cell = |x: f64| (x / tile).floor().clamp(0.0, most as f64) as usize;
                cell(low)..if high < 0.0 { 0 } else { (cell(high) + 1).min(most) }
            };
            [span(left, right, across), span(top, bottom, down)]
        };
        let mut starts = vec![0_usize; across * down + 1];
        let mut places = Vec::with_capacity(extents.len());
        let mut count = 0_usize;
        for (i, extent) in extents.iter().enumerate() {
            if i.is_multiple_of(A_PART) {
                look(ticket)?;
            }
            let Some([middle, half]) = *extent else { continue };
            let (screen, depths) = rays.landing(middle, half);
            let [columns, rows] = spans(screen);
            count += columns.len() * rows.len();
            if count > MOST_ENTRIES {
                let found = format!("{what} that land on more than {MOST_ENTRIES} tiles");
                return Err(Unsupported(found).into());
            }
            for row in rows.clone() {
                for column in columns.clone() {
                    starts[row * across + column + 1] += 1;
                }
            }
            if !columns.is_empty() && !rows.is_empty() {
                let screen = screen.map(|at| at as f32);
                places.push((i as u32, screen, columns, rows, depths.map(|depth| depth as f32)));
            }
        }
        for tile in 1..starts.len() {
            starts[tile] += starts[tile - 1];
        }
        let mut next = starts.clone();
        let mut entries = vec![Entry { number: 0, blocks: 0, depths: [0.0; 2] }; count];
        for (i, (number, screen, columns, rows, depths)) in places.into_iter().enumerate() {
            if i.is_multiple_of(A_PART) {
                look(ticket)?;
            }
            for row in rows {
                for column in columns.clone() {
                    let at = &mut next[row * across + column];
                    let corner = [column, row].map(|n| n as f32 * TILE as f32);
                    let blocks = blocks(screen, corner);
                    entries[*at] = Entry { number, blocks, depths };
                    *at += 1;
                }
            }
        }
        Ok(Self { starts, entries })
    }

    /// The list of the tile that a pixel is the first of.
    pub(super) fn on(&self, rays: &Rays, corner: [u32; 2]) -> &[Entry] {
        let [column, row] = corner.map(|n| (n / TILE) as usize);
        let tile = row * rays.tiles()[0] as usize + column;
        &self.entries[self.starts[tile]..self.starts[tile + 1]]
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        (size_of_val(&self.starts[..]) + size_of_val(&self.entries[..])) as u64
    }
}

/// The blocks of a tile that a rectangle (left, right, top, bottom) of the screen touches: two beside one another, four
/// times.
fn blocks([left, right, top, bottom]: [f32; 4], [x, y]: [f32; 2]) -> u8 {
    let mut found = 0;
    for block in 0..8_u8 {
        let [begin_x, begin_y] = [x + f32::from(block % 2) * 4.0, y + f32::from(block / 2) * 2.0];
        let is_touched =
            left <= begin_x + 4.0 && right >= begin_x && top <= begin_y + 2.0 && bottom >= begin_y;
        found |= u8::from(is_touched) << block;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_those_that_a_rectangle_touches() {
        assert_eq!(blocks([0.0, 100.0, 0.0, 100.0], [8.0, 8.0]), 0xff);
        assert_eq!(blocks([9.0, 10.0, 9.0, 9.5], [8.0, 8.0]), 0b1);
        assert_eq!(blocks([13.0, 14.0, 12.5, 13.5], [8.0, 8.0]), 0b10_0000);
        assert_eq!(blocks([11.5, 12.5, 0.0, 9.0], [8.0, 8.0]), 0b11);
        assert_eq!(blocks([17.0, 18.0, 8.0, 16.0], [8.0, 8.0]), 0);
    }
}

//! Which of many things may touch each part of a picture.

use super::in_order::look;
use super::rays::TILE;
use crate::core::parallel;
use crate::core::{Cancelled, Ticket};

/// Things that are looked at between two looks at the ticket.
const BETWEEN_LOOKS: u32 = 1 << 12;

/// Pixels along a cell's side: lists are kept by cell, and each tile takes from its cell's what touches it.
const CELL: u32 = 4 * TILE;

/// The cells that something may touch: columns and rows, the last ones exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    columns: [u32; 2],
    rows: [u32; 2],
}

impl Span {
    /// Of pixels whose centres lie between two places to the right of the picture's left edge, and down from its upper
    /// one; `None` where there is none, and where anything is not a number.
    pub(super) fn of(size: [u32; 2], right: [f64; 2], down: [f64; 2]) -> Option<Self> {
        Some(Self { columns: cells(right, size[0])?, rows: cells(down, size[1])? })
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn cells([low, high]: [f64; 2], size: u32) -> Option<[u32; 2]> {
    // A hundredth of a pixel for rounding: these are in float64, and rays are not.
    const SLACK: f64 = 1e-2;
    let first = (low - 0.5 - SLACK).ceil().clamp(0.0, f64::from(size));
    let end = ((high - 0.5 + SLACK).floor() + 1.0).clamp(0.0, f64::from(size));
    (first < end).then(|| [first as u32 / CELL, (end as u32).div_ceil(CELL)])
}

/// Lists of a picture's cells.
#[derive(Debug)]
pub(super) struct Cells {
    /// Rows from the top.
    lists: Vec<Vec<u32>>,
    across: u32,
}

impl Cells {
    /// Of a picture of a size; each list has the numbers of its spans in their order.
    ///
    /// # Errors
    /// [`Cancelled`].
    #[expect(clippy::cast_possible_truncation, reason = "fewer than 2³² of everything")]
    pub(super) fn new(size: [u32; 2], spans: &[Span], ticket: &Ticket) -> Result<Self, Cancelled> {
        let [across, down] = size.map(|n| n.div_ceil(CELL) as usize);
        let mut lists = vec![Vec::new(); across * down];
        // Each thread has a band of rows to itself.
        let band = down.div_ceil(4 * rayon::current_num_threads()).max(1);
        parallel::each(lists.chunks_mut((band * across).max(1)).enumerate(), |(i, lists)| {
            let first = (i * band) as u32;
            let end = first + (lists.len() / across) as u32;
            for (number, Span { columns, rows }) in (0_u32..).zip(spans) {
                if number % BETWEEN_LOOKS == 0 && ticket.is_cancelled() {
                    return;
                }
                for row in rows[0].max(first)..rows[1].min(end) {
                    let row = &mut lists[(row - first) as usize * across..][..across];
                    for list in &mut row[columns[0] as usize..columns[1] as usize] {
                        list.push(number);
                    }
                }
            }
        });
        look(ticket)?;
        Ok(Self { lists, across: across as u32 })
    }

    /// The list of the cell that a pixel is in.
    pub(super) fn at(&self, pixel: [u32; 2]) -> &[u32] {
        let [x, y] = pixel.map(|n| n / CELL);
        &self.lists[(y * self.across + x) as usize]
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        let lists = self.lists.iter().map(|list| size_of::<Vec<u32>>() + size_of_val(&list[..]));
        lists.sum::<usize>() as u64
    }
}

/// The middle of the tile that begins with a pixel, to the right and up from the middle of a picture of half a size.
pub(super) fn middle_of(corner: [u32; 2], half_size: [f32; 2]) -> [f32; 2] {
    let across = corner[0] as f32 + 0.5 * TILE as f32 - half_size[0];
    [across, half_size[1] - corner[1] as f32 - 0.5 * TILE as f32]
}

/// Whether an ellipse about a place may touch a tile, by the tile's middle and the lower triangle that takes offsets to
/// the circle that the ellipse becomes.
pub(super) fn touches(tile: [f32; 2], ellipse: [f32; 2], [a, b, c]: [f32; 3]) -> bool {
    // From the middle of a tile to the farthest centres of its pixels.
    const HALF: f32 = 0.5 * TILE as f32 - 0.5;
    let (right, up) = (tile[0] - ellipse[0], tile[1] - ellipse[1]);
    // The tile in the circle lies within a box.
    let x = ((a * right).abs() - HALF * a.abs()).max(0.0);
    let y = ((b * right + c * up).abs() - HALF * (b.abs() + c.abs())).max(0.0);
    x * x + y * y < 1.0001
}

//! At which depths anything can show in each part of a picture.

use super::bricks::ends;
use super::in_order::look;
use super::rays::{Rays, TILE};
use crate::core::parallel;
use crate::core::{Cancelled, Ticket};
use crate::kernel::Bounds;

/// Segments of depth, a bit each.
const SEGMENTS: i32 = 64;
/// Bricks between two looks at the ticket: one near the eye may lie before all patches.
const BETWEEN_LOOKS: usize = 1 << 8;
/// Edge of a patch, pixels: a few to a tile, as those of quick pictures have many voxels before them.
const PATCH: u32 = 4;

/// For each patch the slabs in which anything can show, in segments of equal length.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Masks {
    /// A bit a segment, a word a patch, rows from the top.
    words: Vec<u64>,
    /// Patches along a row.
    across: usize,
    /// The slab in which the first segment begins, and the slabs of a segment.
    first: i32,
    length: i32,
}

impl Masks {
    /// Of the bricks that show.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn new(
        rays: &Rays,
        bricks: &Bounds,
        (dims, visible): ([usize; 3], &[u32]),
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let [across, down] = patches(rays).map(|n| n as usize);
        let mut masks = Self { words: vec![0; across * down], across, first: 0, length: 1 };
        let landed = parallel::try_list(visible.len(), |i| {
            look(ticket).map(|()| Landed::of(rays, bricks, dims, visible[i]))
        })?;
        let slabs = landed.iter().map(|landed| landed.slabs);
        let Some([first, last]) = slabs.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else {
            return Ok(masks);
        };
        masks.first = first;
        masks.length = (last.saturating_sub(first) / SEGMENTS).saturating_add(1);
        // Each thread has a band of rows to itself.
        let band = down.div_ceil(4 * rayon::current_num_threads()).max(1);
        let (first, length) = (masks.first, masks.length);
        parallel::each(masks.words.chunks_mut(band * across).enumerate(), |(i, words)| {
            let rows = i * band..i * band + words.len() / across;
            for (number, Landed { left, right, top, bottom, slabs }) in landed.iter().enumerate() {
                if number.is_multiple_of(BETWEEN_LOOKS) && ticket.is_cancelled() {
                    return;
                }
                let (top, bottom) =
                    ((*top as usize).max(rows.start), (*bottom as usize).min(rows.end));
                if top >= bottom {
                    continue;
                }
                let bit = |slab: i32| slab.saturating_sub(first) / length;
                let (low, high) = (bit(slabs[0]), bit(slabs[1]));
                let bits = (u64::MAX >> (63 - (high - low))) << low;
                for row in top..bottom {
                    let start = (row - rows.start) * across;
                    for word in &mut words[start + *left as usize..start + *right as usize] {
                        *word |= bits;
                    }
                }
            }
        });
        look(ticket)?;
        Ok(masks)
    }

    /// Whether anything can show in the tile that begins with a pixel.
    pub(super) fn shows(&self, corner: [u32; 2]) -> bool {
        let [left, top] = corner.map(|n| (n / PATCH) as usize);
        let patches = (TILE / PATCH) as usize;
        self.words
            .chunks_exact(self.across)
            .skip(top)
            .take(patches)
            .any(|row| row[left..(left + patches).min(self.across)].iter().any(|&word| word != 0))
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        size_of_val(&self.words[..]) as u64
    }

    /// Runs of slabs, first and last, in which anything can show about a pixel between two slabs.
    #[inline]
    pub(super) fn runs(
        &self,
        pixel: [u32; 2],
        [first, last]: [i32; 2],
    ) -> impl DoubleEndedIterator<Item = [i32; 2]> + use<> {
        let (begin, length) = (self.first, self.length);
        let mut runs = [[0; 2]; 33];
        let mut count = 0;
        let [x, y] = [(pixel[0] / PATCH) as usize, (pixel[1] / PATCH) as usize];
        let mut word = self.words[y * self.across + x];
        while word != 0 {
            let low = word.trailing_zeros();
            let ones = (!(word >> low)).trailing_zeros().min(64 - low);
            let at = |bit: u32| begin + bit.cast_signed() * length;
            let [from, to] = [at(low), at(low + ones)];
            let run = [from.max(first), (to - 1).min(last)];
            if run[0] <= run[1] {
                runs[count] = run;
                count += 1;
            }
            word = if low + ones == 64 { 0 } else { word >> (low + ones) << (low + ones) };
        }
        runs.into_iter().take(count)
    }
}

/// Patches across and down.
fn patches(rays: &Rays) -> [u32; 2] {
    rays.size.map(|n| n.div_ceil(PATCH))
}

/// Where a brick lands: patches, the last ones exclusive, and slabs, inclusive.
struct Landed {
    left: u32,
    right: u32,
    top: u32,
    bottom: u32,
    slabs: [i32; 2],
}

impl Landed {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped, or saturates"
    )]
    fn of(rays: &Rays, bricks: &Bounds, dims: [usize; 3], brick: u32) -> Self {
        let view = &rays.view;
        let [begin, end] = ends(bricks, brick as usize, dims);
        let (middle, half) = ((begin + end) / 2.0, (end - begin) / 2.0);
        let from_centre = view.view_from_index * (middle - view.lattice_centre);
        let m = view.view_from_index;
        let reach =
            (m.x_axis.abs() * half.x) + (m.y_axis.abs() * half.y) + (m.z_axis.abs() * half.z);
        let ([left, right, top, bottom], depths) = rays.landing(from_centre, reach);
        let floor =
            |pixels: f64, most: u32| (pixels / f64::from(PATCH)).clamp(0.0, f64::from(most)) as u32;
        let [across, down] = patches(rays);
        let ceil = |pixels: f64, most: u32| {
            (pixels / f64::from(PATCH)).ceil().clamp(0.0, f64::from(most)) as u32
        };
        let step = f64::from(rays.step);
        Self {
            left: floor(left, across),
            right: ceil(right, across),
            top: floor(top, down),
            bottom: ceil(bottom, down),
            slabs: [(depths[0] / step).floor() as i32, (depths[1] / step).floor() as i32],
        }
    }
}

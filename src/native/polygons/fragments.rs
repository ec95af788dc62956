//! What the pixels of a tile see of triangles, from the eye inwards.

use crate::native::rays::TILE;

/// What of light comes through to less than this adds nothing that 32 bits tell.
pub(super) const LEAST_THROUGH: f32 = 1e-9;
/// Pixels of a tile.
pub(super) const PIXELS: usize = (TILE * TILE) as usize;

/// What a pixel sees of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::native) struct Fragment {
    /// View depth beyond the frame's centre, pixels.
    pub t: f32,
    pub opacity: f32,
    /// Lit, linear.
    pub colour: [f32; 3],
    /// A bit for each sample of the pixel that it covers.
    pub samples: u8,
}

/// Where a pixel meets a triangle, before that is lit: lights take longer than all else, and most of what is met is hidden.
#[derive(Debug, Clone, Copy)]
pub(super) struct Met {
    pub(super) t: f32,
    pub(super) opacity: f32,
    pub(super) samples: u8,
    /// Of the tile, in rows from the top.
    pub(super) pixel: u8,
    /// Of those in the world.
    pub(super) triangle: u32,
    /// Of the corners.
    pub(super) shares: [f64; 3],
}

/// What the pixels of a tile see, each from the eye inwards.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::native) struct Fragments {
    pub(super) list: Vec<Fragment>,
    /// Where each pixel's begin, and the last one's end.
    pub(super) begins: [u32; PIXELS + 1],
}

impl Fragments {
    /// Those of a pixel of the tile.
    pub(in crate::native) fn of(&self, pixel: usize) -> &[Fragment] {
        &self.list[self.begins[pixel] as usize..self.begins[pixel + 1] as usize]
    }
}

/// By pixels, from the eye inwards; those at one depth stay in the order of their triangles.
pub(super) fn sort(list: &mut [Met]) {
    list.sort_by(|a, b| {
        (a.pixel.cmp(&b.pixel)).then(a.t.total_cmp(&b.t)).then(a.triangle.cmp(&b.triangle))
    });
}

/// Leaves out of a sorted list what nobody sees, since nothing comes through what lies before it.
pub(super) fn leave_out_hidden(list: &mut Vec<Met>) {
    let (mut pixel, mut through) = (None, [1.0_f32; 4]);
    list.retain(|fragment| {
        if pixel != Some(fragment.pixel) {
            (pixel, through) = (Some(fragment.pixel), [1.0; 4]);
        }
        let mut is_seen = false;
        for (bit, through) in through.iter_mut().enumerate() {
            if fragment.samples & 1 << bit != 0 {
                is_seen |= *through > LEAST_THROUGH;
                *through *= 1.0 - fragment.opacity;
            }
        }
        is_seen
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_behind_opaque_triangles_or_very_many_clear_ones_is_left_out() {
        let fragment = |t: usize, opacity: f32, samples: u8, pixel: u8| Met {
            t: t as f32,
            opacity,
            samples,
            pixel,
            triangle: t as u32,
            shares: [1.0, 0.0, 0.0],
        };
        // Two samples of a pixel are hidden from 2 on, the others from 3 on; another pixel is not.
        let mut list: Vec<_> = (4..9).map(|t| fragment(t, 1.0, 15, 0)).collect();
        list.extend([fragment(2, 1.0, 3, 0), fragment(3, 1.0, 12, 0), fragment(1, 0.5, 15, 0)]);
        list.push(fragment(9, 1.0, 15, 1));
        sort(&mut list);
        leave_out_hidden(&mut list);
        let left: Vec<(u8, u32)> = list.iter().map(|f| (f.pixel, f.triangle)).collect();
        assert_eq!(left, [(0, 1), (0, 2), (0, 3), (1, 9)]);
        let mut clear: Vec<_> = (0..1000).map(|t| fragment(t, 0.5, 15, 0)).collect();
        leave_out_hidden(&mut clear);
        assert_eq!(clear.len(), 30, "0.5³⁰ is less than 1e-9");
    }
}

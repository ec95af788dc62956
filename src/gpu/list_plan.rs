//! What lists of scattered kernels are made for: rectangles of tiles, and layers of slabs.

use super::layout::{LAYER_SLABS, Record, TILE};
use crate::scene::View;

/// Bits of a layer's number: beyond, single precision would not tell slabs apart.
pub(super) const MOST_LAYER_BITS: u32 = 22;

/// Tiles of a picture: first column and row, columns, rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rectangle(pub(super) [u32; 4]);

impl Rectangle {
    pub(super) fn of(size: [u32; 2]) -> Self {
        Self([0, 0, size[0].div_ceil(TILE), size[1].div_ceil(TILE)])
    }

    pub(super) fn tiles(self) -> u32 {
        self.0[2] * self.0[3]
    }

    /// Its halves, across the longer side; `None` for a single tile.
    pub(super) fn halves(self) -> Option<[Self; 2]> {
        let [x, y, columns, rows] = self.0;
        if self.tiles() < 2 {
            return None;
        }
        Some(if columns > rows {
            let left = columns / 2;
            [Self([x, y, left, rows]), Self([x + left, y, columns - left, rows])]
        } else {
            let top = rows / 2;
            [Self([x, y, columns, top]), Self([x, y + top, columns, rows - top])]
        })
    }
}

/// Bits that hold the numbers below `count`.
pub(super) fn bits_below(count: u32) -> u32 {
    u32::BITS - count.saturating_sub(1).leading_zeros()
}

/// Layers of slabs that hold every kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Layers {
    /// The nearest, counted from the one behind the lattice's centre.
    pub(super) first: i32,
    pub(super) count: u32,
    /// Thickness of a slab in pixels of view depth.
    pub(super) slab: f64,
}

impl Layers {
    pub(super) const ONE: Self = Self { first: 0, count: 1, slab: 0.0 };

    /// Slabs' faces lie at whole multiples of the smallest spacing / `slabs_per_voxel` from the
    /// middle of the lattice, in view depth; `radius` is the kernel's, in voxels.
    pub(super) fn of(
        view: &View,
        records: &[Record],
        radius: f64,
        slabs_per_voxel: f64,
    ) -> Option<Self> {
        let m = view.view_from_index;
        let spacing = m.x_axis.length().min(m.y_axis.length()).min(m.z_axis.length());
        let slab = spacing / slabs_per_voxel;
        let depth = glam::DVec3::new(m.x_axis.z, m.y_axis.z, m.z_axis.z);
        let (mut near, mut far) = (0.0_f64, 0.0_f64);
        for record in records {
            let [xy, z, _] = record.packed;
            let size = [xy & 0xffff, xy >> 16, z & 0xffff].map(f64::from);
            let middle =
                (glam::Vec3::from(record.centre).as_dvec3() - view.lattice_centre).dot(depth);
            let reach = (glam::DVec3::from(size) * depth).length() * radius;
            near = near.min(middle - reach);
            far = far.max(middle + reach);
        }
        let layer = slab * f64::from(LAYER_SLABS);
        // One more on each side: the device rounds.
        let (first, last) = ((near / layer).floor() - 1.0, (far / layer).floor() + 1.0);
        let count = last - first + 1.0;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "2^22 at most")]
        (count <= f64::from(1_u32 << MOST_LAYER_BITS)).then_some(Self {
            first: first as i32,
            count: count as u32,
            slab,
        })
    }
}

/// Lists of one rectangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    pub(super) rectangle: Rectangle,
    pub(super) layers: Layers,
    /// Records.
    pub(super) count: u32,
    pub(super) stop_below: f32,
    /// Half the picture's width and height.
    pub(super) half_size: [f32; 2],
}

impl Plan {
    pub(super) fn key_bits(&self) -> u32 {
        bits_below(self.rectangle.tiles() + 1) + bits_below(self.layers.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_the_whole_and_end_at_single_tiles() {
        let mut left = vec![Rectangle::of([100, 33])];
        assert_eq!(left[0], Rectangle([0, 0, 13, 5]));
        let mut seen = std::collections::BTreeSet::new();
        while let Some(rectangle) = left.pop() {
            match rectangle.halves() {
                Some(halves) => left.extend(halves),
                None => assert!(seen.insert(rectangle.0), "{rectangle:?} twice"),
            }
        }
        assert_eq!(seen.len(), 65);
        assert!(seen.iter().all(|&[x, y, w, h]| x < 13 && y < 5 && (w, h) == (1, 1)));
    }

    #[test]
    fn as_many_bits_as_the_largest_number_has() {
        assert_eq!([1, 2, 3, 4, 5, 1 << 22].map(bits_below), [0, 1, 2, 2, 3, 22]);
    }
}

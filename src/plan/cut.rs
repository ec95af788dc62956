//! Which level each brick of a field is drawn from.
//!
//! **What a picture of a cut is.** Slabs go four to a *segment*, counted from the plane through the lattice's centre: the faces
//! at which segments begin have numbers that are multiples of four. In a segment a ray has one level: the finest of the bricks
//! that it is in at two places, [`LOOKS`] of the part of the ray that lies in the segment and in what is kept of the lattice.
//! Where both are empty it has none, and a gap. Faces of level l are 2^l slabs apart; a segment begins with the face that the
//! one before it ended with, of that one's level, and after a gap with one of its own. Between two faces lie all values from one
//! to the other: where the second is of level 0 in two halves, along the parabola through four faces where all of these are of
//! level 0 and whole slabs apart, and else in one, evenly. Light takes the growth of what each face is of. What a slice or a cut
//! face shows, and what has no data, is of the field itself; so are isosurfaces, which are looked for where a face of level 0 comes
//! second: bricks that one passes are of that level.
//!
//! `reference` draws just that, ray by ray, and so does the GPU engine; in the native one eight rays have the finest level of any
//! of them.

/// Levels of means beside a field's own samples: of 2³ and of 4³.
pub const COARSER: usize = 2;
/// Slabs of which a ray has one level. A brick is as many voxels wide.
pub const SEGMENT: i32 = 4;
/// Where in a segment the bricks are looked up, as shares of it. A single look misses bricks that a ray crosses at a corner.
pub const LOOKS: [f32; 2] = [0.2, 0.8];
/// Of a brick in which nothing can show.
pub const EMPTY: u8 = COARSER as u8 + 1;

/// A cut of a field: a level for each brick of 4³ cells, b from place 4b − 1 to 4b + 3 along each axis, in index space.
/// Level 0 is the field itself, level l tents through the means of 2^l samples a side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldCut {
    /// Bricks along x, y, z.
    pub dims: [usize; 3],
    /// x fastest, and one more that is empty: what rays find that ask for no brick.
    levels: Vec<u8>,
    /// Bricks of each level, and empty ones.
    counts: [u64; COARSER + 2],
}

/// Bricks of a cut along each axis of a lattice: the first begins half a cell before it does.
pub fn bricks_of_cut(dims: [usize; 3]) -> [usize; 3] {
    dims.map(|n| (n + 1).div_ceil(4))
}

impl FieldCut {
    /// Of a level a brick.
    ///
    /// # Panics
    /// Where there are not as many levels as bricks.
    pub fn new(dims: [usize; 3], mut levels: Vec<u8>) -> Self {
        assert_eq!(levels.len(), dims.iter().product::<usize>(), "a level a brick");
        let mut counts = [0; COARSER + 2];
        for level in &mut levels {
            *level = (*level).min(EMPTY);
            counts[usize::from(*level)] += 1;
        }
        levels.push(EMPTY);
        Self { dims, levels, counts }
    }

    /// Levels by brick, x fastest; the last one is no brick's, and empty.
    pub fn levels(&self) -> &[u8] {
        &self.levels
    }

    /// Bricks of each level, the finest first.
    pub fn counts(&self) -> [u64; COARSER + 1] {
        std::array::from_fn(|level| self.counts[level])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_are_counted_by_level_and_rays_that_ask_for_none_find_nothing() {
        let cut = FieldCut::new([3, 2, 1], vec![0, 2, EMPTY, 1, 2, 200]);
        assert_eq!(cut.counts(), [1, 1, 2]);
        assert_eq!(cut.levels(), [0, 2, EMPTY, 1, 2, EMPTY, EMPTY]);
    }
}

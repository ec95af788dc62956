//! Which level each brick of a field is drawn from.

/// Levels of means beside a field's own samples: of 2³ and of 4³.
pub const COARSER: usize = 2;
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

//! A pyramid whose finest levels are merged elsewhere, rows of bricks at a time.

use super::bricks::{LEVELS, level_dims};
use super::pyramid::{ActiveCounts, ErrorMeasure, Node, Pyramid, PyramidError, PyramidLevel};
use super::sums::Sums;
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::transfer::Table;
use crate::volume::{BRICK, ScalarVolume};

/// What a brick of voxels comes to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MergedBrick {
    /// Of all of it: what level 4 is made of.
    pub sums: Sums,
    /// Voxels that show by index in the brick along x, y and z; 0 beyond the border.
    pub slices: [[u8; BRICK]; 3],
}

/// The parts of a [`Pyramid`] that are there; all of them make one.
#[derive(Debug, Clone)]
pub struct PyramidParts {
    dims: [usize; 3],
    bricks: [usize; 3],
    is_coarse: bool,
    measure: ErrorMeasure,
    voxel_depth: f64,
    levels: Vec<PyramidLevel>,
    sums: Vec<Sums>,
    active: ActiveCounts,
    /// Rows of bricks that are there, y before z.
    rows: usize,
}

impl PyramidParts {
    /// With nothing there yet; `None` where a volume has no level 3. Coarse ones know nothing below it
    /// ([`Pyramid::coarse`]).
    ///
    /// # Errors
    /// Too little memory.
    pub fn new(
        volume: &ScalarVolume,
        voxel_depth: f64,
        measure: ErrorMeasure,
        is_coarse: bool,
    ) -> Result<Option<Self>, PyramidError> {
        let dims = volume.lattice.dims;
        let all = level_dims(dims);
        if all.len() < LEVELS {
            return Ok(None);
        }
        Pyramid::require_room(dims, if is_coarse { LEVELS } else { 0 })?;
        let level = |&dims: &[usize; 3]| {
            let count = if is_coarse { 0 } else { dims.iter().product() };
            PyramidLevel { dims, nodes: bytemuck::zeroed_vec(count) }
        };
        let per_slice = if is_coarse { Default::default() } else { dims.map(|n| vec![0; n]) };
        Ok(Some(Self {
            dims,
            bricks: all[LEVELS - 1],
            is_coarse,
            measure,
            voxel_depth,
            levels: all[..LEVELS].iter().map(level).collect(),
            sums: Vec::with_capacity(all[LEVELS - 1].iter().product()),
            active: ActiveCounts { total: 0, per_slice },
            rows: 0,
        }))
    }

    /// What errors are of.
    pub fn measure(&self) -> ErrorMeasure {
        self.measure
    }

    /// Thickness of a voxel in opacity unit distances.
    pub fn voxel_depth(&self) -> f64 {
        self.voxel_depth
    }

    /// Whether nodes below level 4 are left out.
    pub fn is_coarse(&self) -> bool {
        self.is_coarse
    }

    /// The next rows of bricks along y and z, of about so many bricks: rows of one layer, or whole
    /// layers. `None` where nothing is missing.
    pub fn next_rows(&self, bricks: usize) -> Option<[std::ops::Range<usize>; 2]> {
        let [nx, ny, nz] = self.bricks;
        let (y, z) = (self.rows % ny, self.rows / ny);
        let rows = (bricks / nx).max(1);
        match (z < nz, y, rows / ny) {
            (false, ..) => None,
            (true, 0, layers @ 1..) => Some([0..ny, z..(z + layers).min(nz)]),
            _ => Some([y..(y + rows).min(ny), z..z + 1]),
        }
    }

    /// Takes the rows that [`PyramidParts::next_rows`] named; nodes of each level x fastest, none of
    /// coarse ones.
    pub fn take(
        &mut self,
        [y, z]: [std::ops::Range<usize>; 2],
        bricks: &[MergedBrick],
        nodes: &[Vec<Node>; LEVELS],
    ) {
        let nx = self.bricks[0];
        self.rows += y.len() * z.len();
        self.sums.extend(bricks.iter().map(|brick| brick.sums));
        for (i, MergedBrick { slices, .. }) in bricks.iter().enumerate() {
            self.active.total += slices[0].iter().map(|&n| u64::from(n)).sum::<u64>();
            let at = [i % nx, y.start + i / nx % y.len(), z.start + i / (nx * y.len())];
            for (axis, per_slice) in self.active.per_slice.iter_mut().enumerate() {
                let own = per_slice.iter_mut().skip(at[axis] * BRICK).zip(slices[axis]);
                own.for_each(|(all, n)| *all += u32::from(n));
            }
        }
        if self.is_coarse {
            return;
        }
        for (index, (level, nodes)) in self.levels.iter_mut().zip(nodes).enumerate() {
            let [nx, ny, _] = level.dims;
            let shift = LEVELS - 1 - index;
            let rows = ((y.end << shift).min(ny)) - (y.start << shift);
            // A run of each slice of the level, which are one where they are whole.
            for (i, run) in nodes.chunks(nx * rows).enumerate() {
                let first = (((z.start << shift) + i) * ny + (y.start << shift)) * nx;
                level.nodes[first..][..run.len()].copy_from_slice(run);
            }
        }
    }

    /// The pyramid, once nothing is missing.
    ///
    /// # Errors
    /// Cancelled.
    pub fn finish(
        mut self,
        volume: &ScalarVolume,
        table: &Table,
        ticket: &Ticket,
    ) -> Result<Pyramid, Cancelled> {
        if self.is_coarse {
            self.levels[LEVELS - 1].nodes =
                parallel::list(self.sums.len(), |i| self.sums[i].node(0));
        }
        let finest_level = if self.is_coarse { LEVELS } else { 0 };
        let finest = Pyramid::of_finest(
            (self.dims, finest_level, self.levels),
            self.measure,
            self.voxel_depth,
            self.active,
        );
        finest.completed(volume, table, self.sums, ticket)
    }
}

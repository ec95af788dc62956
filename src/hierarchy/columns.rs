//! How far the columns through a node are from what it is drawn as: [`ErrorMeasure::OpticalDepth`].
//!
//! [`ErrorMeasure::OpticalDepth`]: super::ErrorMeasure::OpticalDepth

use super::pyramid::PyramidLevel;
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::transfer::Table;
use crate::volume::{Scalar, ScalarVolume};
use crate::with_samples;

/// A node is seen as at most this many columns along an edge, as a power of two: 2³.
const COLUMN_LEVELS: usize = 3;
const COLUMNS: usize = 1 << COLUMN_LEVELS;

/// Replaces the error of every node that shows.
///
/// `voxel_depth` is the thickness of a voxel in opacity unit distances. Columns of nodes of level 3 and
/// less are as wide as a voxel; of larger ones they run through the nodes three levels below, which
/// keep their mean transmittance. Where there is nothing below level `finest`, its nodes' errors stay as
/// they are, and larger nodes' columns run through those of `finest` at least.
pub(super) fn measure(
    volume: &ScalarVolume,
    table: &Table,
    voxel_depth: f64,
    finest: usize,
    levels: &mut [PyramidLevel],
    ticket: &Ticket,
) -> Result<(), Cancelled> {
    for index in finest..levels.len() {
        let level = index + 1;
        let (finer, coarser) = levels.split_at_mut(index);
        let cell_level = level.saturating_sub(COLUMN_LEVELS).max(finest);
        let grid = Grid { dims: volume.lattice.dims, level, cell_level, voxel_depth };
        if cell_level == 0 {
            with_samples!(&*volume.samples, values => {
                let voxel = |i: usize| f64::from(table.lookup(Scalar::to_f64(values[i]))[3]);
                grid.measure(&mut coarser[0], finer.last(), voxel, ticket)
            })?;
        } else {
            let cells = &finer[cell_level - 1].nodes;
            let cell = |i: usize| f64::from(cells[i].extinction);
            grid.measure(&mut coarser[0], finer.last(), cell, ticket)?;
        }
    }
    Ok(())
}

/// A level's nodes over the voxels.
#[derive(Clone, Copy)]
struct Grid {
    /// Voxels along x, y, z.
    dims: [usize; 3],
    level: usize,
    /// That of the nodes that columns run through.
    cell_level: usize,
    voxel_depth: f64,
}

impl Grid {
    /// `children` are the next finer level, `None` where those are voxels; `extinction` is asked for
    /// cells, by their index in their level.
    fn measure(
        &self,
        level: &mut PyramidLevel,
        children: Option<&PyramidLevel>,
        extinction: impl Fn(usize) -> f64 + Sync,
        ticket: &Ticket,
    ) -> Result<(), Cancelled> {
        let [nx, ny, _] = level.dims;
        let edge = f64::from(1_u32 << (self.level - 1));
        parallel::try_each(level.nodes.chunks_mut(nx * ny).enumerate(), |(z, nodes)| {
            if ticket.is_cancelled() {
                return Err(Cancelled);
            }
            for (i, node) in nodes.iter_mut().enumerate().filter(|(_, node)| node.is_active()) {
                let at = [i % nx, i / nx, z];
                let own = self.deviation(at, f64::from(node.extinction), &extinction) * edge;
                #[expect(clippy::cast_possible_truncation, reason = "as far as it goes")]
                let own = (own as f32).min(f32::MAX);
                node.error = children.map_or(own, |finer| own.max(greatest_error(finer, at)));
            }
            Ok(())
        })
    }

    /// Root mean square, over the three axes and the columns along each, of the difference of a
    /// column's optical depth from that of the node `at`, whose own extinction is `whole`.
    fn deviation(&self, at: [usize; 3], whole: f64, extinction: &impl Fn(usize) -> f64) -> f64 {
        let cell_level = self.cell_level;
        let cells = self.dims.map(|n| n.div_ceil(1 << cell_level));
        let first = at.map(|i| i << (self.level - cell_level));
        let count: [usize; 3] =
            std::array::from_fn(|a| (1 << (self.level - cell_level)).min(cells[a] - first[a]));
        // Real voxels of each cell along each axis: border cells have fewer.
        let mut thick = [[0.0; COLUMNS]; 3];
        for a in 0..3 {
            for (i, thick) in thick[a].iter_mut().enumerate().take(count[a]) {
                let low = (first[a] + i) << cell_level;
                *thick = (1 << cell_level).min(self.dims[a] - low) as f64;
            }
        }
        let mut depths = [[0.0; COLUMNS * COLUMNS]; 3];
        for z in 0..count[2] {
            for y in 0..count[1] {
                let row = ((first[2] + z) * cells[1] + first[1] + y) * cells[0] + first[0];
                for x in 0..count[0] {
                    let depth = extinction(row + x) * self.voxel_depth;
                    depths[0][z * COLUMNS + y] += depth * thick[0][x];
                    depths[1][z * COLUMNS + x] += depth * thick[1][y];
                    depths[2][y * COLUMNS + x] += depth * thick[2][z];
                }
            }
        }
        let mut squares = 0.0;
        for (axis, [outer, inner]) in [[2, 1], [2, 0], [1, 0]].into_iter().enumerate() {
            let length: f64 = thick[axis].iter().sum();
            let drawn = whole * length * self.voxel_depth;
            let (mut sum, mut area) = (0.0, 0.0);
            for i in 0..count[outer] {
                for j in 0..count[inner] {
                    let weight = thick[outer][i] * thick[inner][j];
                    let off = depths[axis][i * COLUMNS + j] - drawn;
                    sum += weight * off * off;
                    area += weight;
                }
            }
            squares += sum / area;
        }
        (squares / 3.0).sqrt()
    }
}

/// The greatest error of a node's children, which are those of `finer`.
fn greatest_error(finer: &PyramidLevel, at: [usize; 3]) -> f32 {
    let [nx, ny, nz] = finer.dims;
    let span = |a: usize, n: usize| 2 * at[a]..(2 * at[a] + 2).min(n);
    let mut greatest = 0.0_f32;
    for z in span(2, nz) {
        for y in span(1, ny) {
            for x in span(0, nx) {
                greatest = greatest.max(finer.nodes[(z * ny + y) * nx + x].error);
            }
        }
    }
    greatest
}

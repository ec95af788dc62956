//! Averages and errors of a classified volume, level by level.
//!
//! Level 0 is the volume itself and is not stored. A node of level L covers the 2^L voxels along
//! each axis that really exist: odd sizes make smaller border nodes, never phantom voxels.

use std::convert::Infallible;

use serde::{Deserialize, Serialize};

use super::bricks::{Finest, LEVELS, finest, level_dims};
use super::coarse::coarse;
use super::columns;
use super::sums::Sums;
use super::thinning::Thinning;
use crate::core::memory::{self, TooLarge};
use crate::core::names;
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::transfer::Table;
use crate::volume::{BRICK, ScalarVolume};
use crate::with_samples;

/// What is lost where a node is drawn rather than its voxels: what [`Node::error`] is of.
///
/// Each is a root mean square deviation, times the node's edge over a level-1
/// node's, since what drawing a node whole costs the picture grows with the pixels it covers; and
/// never less than a child's, so that a cut is found without looking down.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ErrorMeasure {
    /// Of the values of the node's voxels, NaN left out, from their mean, as a part of the range of
    /// the volume's finite values (Laur and Hanrahan's, whatever the transfer function): a display
    /// range would follow the transfer function after all.
    Scalar,
    /// Of the voxels' (opacity, opacity · colour) from its mean.
    #[default]
    Classified,
    /// Of the optical depths of columns along x, y and z through the node from those of the node drawn
    /// whole. Columns are as wide as a voxel, or an eighth of the node where that is more. Depths
    /// rather than opacities: all columns through an opaque node have the same opacity, wherever in
    /// it the matter is, and cuts of as many nodes are further from the reference by up to 4.3 times.
    OpticalDepth,
}

names!(ErrorMeasure {
    Scalar => "scalar",
    Classified => "classified",
    OpticalDepth => "optical-depth",
});

/// What a coarse splat is drawn with.
///
/// As the device writes it, too (`shaders/merge_bricks.wgsl`).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Node {
    /// Extinction per unit distance, averaged so that the mean transmittance along the axes is
    /// kept (a mean of extinctions would make one opaque voxel among eight 3.6 times too bright).
    pub extinction: f32,
    /// What drawing it whole costs, by the pyramid's [`ErrorMeasure`]; 0 where nothing shows.
    pub error: f32,
    /// Extinction-weighted mean colour, linear light, as 16-bit fractions of 1.
    pub colour: [u16; 3],
    /// Children with opacity, 0..=8.
    pub active_children: u16,
}

impl Node {
    /// Whether anything of it can be seen.
    pub fn is_active(&self) -> bool {
        self.extinction > 0.0
    }
}

/// One level of the pyramid.
#[derive(Debug, Clone)]
pub struct PyramidLevel {
    /// Nodes along x, y, z.
    pub dims: [usize; 3],
    /// The nodes, x fastest.
    pub nodes: Vec<Node>,
}

/// How many voxels have opacity, in all and slice by slice.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ActiveCounts {
    /// Voxels with opacity.
    pub total: u64,
    /// The same by index along x, y and z.
    pub per_slice: [Vec<u32>; 3],
}

/// Levels 1 and up of a classified volume, finest first; the last is a single node.
///
/// A volume of one voxel has one level, whose node is that voxel.
#[derive(Debug, Clone)]
pub struct Pyramid {
    /// Voxels along x, y, z.
    pub dims: [usize; 3],
    /// Nothing is known below this level, and `levels` has no nodes there; 0 where everything is.
    pub finest_level: usize,
    /// `levels[i]` is level i + 1.
    pub levels: Vec<PyramidLevel>,
    /// What the nodes' errors are of.
    pub measure: ErrorMeasure,
    /// Thickness of a voxel in opacity unit distances.
    pub voxel_depth: f64,
    /// Voxels with opacity.
    pub active: ActiveCounts,
    /// How much thinner its cuts are drawn in quick pictures.
    pub thinning: Thinning,
    /// For each bin of error, how many nodes a cut gains by splitting the nodes in it.
    gains: Vec<u64>,
}

/// Bins of [`Pyramid::error_for_count`], logarithmic between these errors, or up to the root's where that
/// is greater: no other exceeds it.
const GAIN_BINS: usize = 2048;
const LEAST_ERROR: f32 = 1e-5;
/// No node is larger than 2^15 voxels, and no deviation but that of optical depths larger than 1.
const GREATEST_ERROR: f32 = 32768.0;

/// Why there is no [`Pyramid`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PyramidError {
    /// The work was told to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// It does not fit in memory.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}

impl Pyramid {
    /// Classifies every voxel of every brick that can show, and averages upwards.
    ///
    /// `voxel_depth` is the thickness of a voxel in opacity unit distances; `measure` says what the
    /// nodes' errors are of. Takes 2.3 bytes a voxel, and 0.2 more while it is built.
    ///
    /// # Errors
    /// Cancelled within a few milliseconds, or too little memory.
    pub fn build(
        volume: &ScalarVolume,
        table: &Table,
        voxel_depth: f64,
        measure: ErrorMeasure,
        ticket: &Ticket,
    ) -> Result<Self, PyramidError> {
        require_memory(volume.lattice.dims, 0, memory::free_bytes())?;
        #[expect(clippy::cast_possible_truncation, reason = "a ratio of order 1")]
        let depth = voxel_depth as f32;
        let Finest { levels, sums, active } = with_samples!(&*volume.samples, values => {
            finest(volume, values, table, depth, measure, ticket)
        })?;
        let dims = volume.lattice.dims;
        let finest = Self::of_finest((dims, 0, levels), measure, voxel_depth, active);
        Ok(finest.completed(volume, table, sums, ticket)?)
    }

    /// Level 3 and those above, in a fraction of the time: for quick pictures.
    ///
    /// Colours are exact. Extinctions and errors are not, as nothing is known of how matter lies in a
    /// node of level 3. Of 32-bit values and wider the nearest entry of the table is taken, and
    /// [`ActiveCounts::per_slice`] is left empty. Volumes that have no level 3 are built whole.
    ///
    /// # Errors
    /// See [`Pyramid::build`].
    pub fn coarse(
        volume: &ScalarVolume,
        table: &Table,
        voxel_depth: f64,
        measure: ErrorMeasure,
        ticket: &Ticket,
    ) -> Result<Self, PyramidError> {
        let dims = volume.lattice.dims;
        let all = level_dims(dims);
        if all.len() < LEVELS {
            return Self::build(volume, table, voxel_depth, measure, ticket);
        }
        require_memory(dims, LEVELS, memory::free_bytes())?;
        #[expect(clippy::cast_possible_truncation, reason = "a ratio of order 1")]
        let depth = voxel_depth as f32;
        let (sums, total) = with_samples!(&*volume.samples, values => {
            coarse(volume, values, table, depth, measure, ticket)
        })?;
        let mut levels: Vec<PyramidLevel> =
            all[..LEVELS].iter().map(|&dims| PyramidLevel { dims, nodes: Vec::new() }).collect();
        levels[LEVELS - 1].nodes = parallel::list(sums.len(), |i| sums[i].node(0));
        let active = ActiveCounts { total, ..ActiveCounts::default() };
        let finest = Self::of_finest((dims, LEVELS, levels), measure, voxel_depth, active);
        Ok(finest.completed(volume, table, sums, ticket)?)
    }

    /// The finest levels, of which those up to `finest_level` have no nodes.
    pub(super) fn of_finest(
        (dims, finest_level, levels): ([usize; 3], usize, Vec<PyramidLevel>),
        measure: ErrorMeasure,
        voxel_depth: f64,
        active: ActiveCounts,
    ) -> Self {
        let (thinning, gains) = (Thinning::default(), Vec::new());
        Self { dims, finest_level, levels, measure, voxel_depth, active, thinning, gains }
    }

    /// Refuses a pyramid of the levels above `finest` that does not fit in memory.
    pub(super) fn require_room(dims: [usize; 3], finest: usize) -> Result<(), TooLarge> {
        require_memory(dims, finest, memory::free_bytes())
    }

    /// With the levels above the last one, of which there are the `sums`.
    pub(super) fn completed(
        mut self,
        volume: &ScalarVolume,
        table: &Table,
        mut sums: Vec<Sums>,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        #[expect(clippy::cast_possible_truncation, reason = "a ratio of order 1")]
        let voxel_depth = self.voxel_depth as f32;
        for &coarser in &level_dims(self.dims)[self.levels.len()..] {
            ticket.checkpoint(1, 1)?;
            let edge = (1_u32 << self.levels.len()) as f32;
            let fine = self.levels[self.levels.len() - 1].dims;
            let (level, theirs) = next_level(fine, &sums, coarser, voxel_depth * edge, edge);
            self.levels.push(level);
            sums = theirs;
        }
        if self.measure == ErrorMeasure::OpticalDepth {
            let (depth, finest) = (self.voxel_depth, self.finest_level);
            columns::measure(volume, table, depth, finest, &mut self.levels, ticket)?;
        }
        self.gains = gains(&self.levels);
        self.thinning = Thinning::of(&self, volume, table, ticket)?;
        Ok(self)
    }

    /// Voxels in bricks that can show, about: what [`Pyramid::build`] has to classify.
    pub fn visible_voxels(volume: &ScalarVolume, table: &Table) -> u64 {
        let bricks = &volume.bricks;
        let shows = |i: usize| u64::from(table.shows(bricks.ranges[i], bricks.has_holes(i)));
        let count = parallel::merged(bricks.ranges.len(), || 0, shows, |a, b| a + b);
        count * (BRICK as u64).pow(3)
    }

    /// Whether there is every level, and every voxel is counted.
    pub fn is_whole(&self) -> bool {
        self.finest_level == 0
    }

    /// Number of levels above the voxels.
    pub fn height(&self) -> usize {
        self.levels.len()
    }

    /// The smallest error whose cut has at most about `count` nodes (exact to the binning of
    /// errors, before anything outside the view is left out); 0 where every voxel fits.
    pub fn error_for_count(&self, count: u64) -> f32 {
        let mut nodes = 1;
        for bin in (0..GAIN_BINS).rev() {
            nodes += self.gains[bin];
            if nodes > count {
                return self.bin_error(bin + 1);
            }
        }
        0.0
    }

    /// Lower edge of a bin; the bin holds errors at or above it.
    fn bin_error(&self, bin: usize) -> f32 {
        if bin == 0 {
            return 0.0;
        }
        let least = LEAST_ERROR.ln();
        let span = greatest_error(&self.levels).ln() - least;
        (least + span * (bin as f32 / GAIN_BINS as f32)).exp().min(f32::MAX)
    }

    /// Bytes held.
    pub fn size_bytes(&self) -> usize {
        self.levels.iter().map(|l| l.nodes.len() * size_of::<Node>()).sum()
    }
}

/// Refuses a pyramid of the levels above `finest` that does not fit in `free_bytes`.
fn require_memory(dims: [usize; 3], finest: usize, free_bytes: u64) -> Result<(), TooLarge> {
    let nodes = |dims: &[usize; 3]| dims.iter().map(|&n| n as u64).product::<u64>();
    let all = level_dims(dims);
    let held = all.iter().skip(finest.saturating_sub(1)).map(nodes).sum::<u64>();
    // Of the last level made brick by brick, and the one above.
    let last = all.len().min(LEVELS) - 1;
    let sums = all.iter().skip(last).take(2).map(nodes).sum::<u64>();
    let bytes = held * size_of::<Node>() as u64 + sums * size_of::<Sums>() as u64;
    memory::require("the octree of the volume", bytes, free_bytes)
}

/// Where the bins end: beyond the greatest error, so that a cut of it is the root.
fn greatest_error(levels: &[PyramidLevel]) -> f32 {
    let root = levels.last().map_or(0.0, |level| level.nodes[0].error);
    (root * 1.001).clamp(GREATEST_ERROR, f32::MAX)
}

fn error_bin(error: f32, greatest: f32) -> usize {
    if error <= LEAST_ERROR {
        return 0;
    }
    // Not of their ratios: those overflow.
    let least = LEAST_ERROR.ln();
    let scaled = (error.ln() - least) / (greatest.ln() - least) * GAIN_BINS as f32;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the bins")]
    let bin = scaled as usize;
    bin.min(GAIN_BINS - 1)
}

fn gains(levels: &[PyramidLevel]) -> Vec<u64> {
    let greatest = greatest_error(levels);
    let parts: Vec<&[Node]> = levels.iter().flat_map(|level| level.nodes.chunks(1 << 16)).collect();
    let count = |bins: &mut Vec<u64>, nodes: &[Node]| {
        for node in nodes.iter().filter(|n| n.active_children > 1) {
            bins[error_bin(node.error, greatest)] += u64::from(node.active_children) - 1;
        }
        Ok::<(), Infallible>(())
    };
    let Ok(gains) =
        parallel::try_summed(parts.into_iter(), || vec![0; GAIN_BINS], count, parallel::add_up);
    gains
}

/// The level above one, and its sums.
fn next_level(
    fine: [usize; 3],
    sums: &[Sums],
    coarse: [usize; 3],
    child_depth: f32,
    edge: f32,
) -> (PyramidLevel, Vec<Sums>) {
    let parent = |i: usize| {
        let [nx, ny, _] = coarse;
        let corner = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| 2 * n);
        let children = std::array::from_fn(|bit| {
            let at = [corner[0] + (bit & 1), corner[1] + (bit >> 1 & 1), corner[2] + (bit >> 2)];
            let is_real = (0..3).all(|a| at[a] < fine[a]);
            is_real.then(|| &sums[(at[2] * fine[1] + at[1]) * fine[0] + at[0]])
        });
        let (sums, active) = Sums::parent(children, child_depth, edge);
        (sums.node(active), sums)
    };
    let (nodes, sums) = parallel::list(coarse.iter().product(), parent).into_iter().unzip();
    (PyramidLevel { dims: coarse, nodes }, sums)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::{ColourMap, ColourSource, TransferFunction};
    use crate::volume::{Lattice, Samples};

    #[test]
    fn what_does_not_fit_is_refused_in_one_sentence_before_anything_is_made() {
        let dims = [19, 33, 40];
        let samples = Samples::UInt8(vec![9; dims.iter().product()]);
        let volume = ScalarVolume::from_samples("test", Lattice::unit(dims), samples).unwrap();
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 9.0] };
        let transfer = TransferFunction::of(vec![(0.0, 0.0), (9.0, 0.5)], colour);
        let table = Table::new(&transfer, volume.samples.scalar_type());
        let measure = ErrorMeasure::Classified;
        for (finest, pyramid) in [
            (0, Pyramid::build(&volume, &table, 1.0, measure, &Ticket::new()).unwrap()),
            (LEVELS, Pyramid::coarse(&volume, &table, 1.0, measure, &Ticket::new()).unwrap()),
        ] {
            let held = pyramid.size_bytes() as u64;
            // Sums of 3 × 5 × 5 nodes and of 2 × 3 × 3.
            let needed = held + (75 + 18) * size_of::<Sums>() as u64;
            assert_eq!(require_memory(dims, finest, needed), Ok(()));
            let refusal = require_memory(dims, finest, needed - 1).unwrap_err();
            assert_eq!(refusal.needed_bytes, needed);
            let sentence = refusal.to_string();
            assert!(
                sentence.starts_with("expected the octree of the volume to fit in memory, found")
            );
            assert!(sentence.contains("; close other programs") && !sentence.contains('\n'));
        }
        // Sizes that no machine has do not overflow.
        assert!(require_memory([65_535; 3], 0, 1 << 40).is_err());
    }
}

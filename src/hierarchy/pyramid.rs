//! Averages and errors of a classified volume, level by level.
//!
//! Level 0 is the volume itself and is not stored. A node of level L covers the 2^L voxels along
//! each axis that really exist: odd sizes make smaller border nodes, never phantom voxels.

use rayon::prelude::*;

use serde::{Deserialize, Serialize};

use super::columns;
use crate::core::progress::{Cancelled, Ticket};
use crate::transfer::Table;
use crate::volume::{BRICK, Scalar, ScalarVolume, Statistics};
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

impl ErrorMeasure {
    /// Every one.
    pub const ALL: &[Self] = &[Self::Scalar, Self::Classified, Self::OpticalDepth];

    /// The name scripts use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Classified => "classified",
            Self::OpticalDepth => "optical-depth",
        }
    }

    /// The one of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|one| one.name() == name)
    }
}

/// What a coarse splat is drawn with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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
    /// `levels[i]` is level i + 1.
    pub levels: Vec<PyramidLevel>,
    /// What the nodes' errors are of.
    pub measure: ErrorMeasure,
    /// Thickness of a voxel in opacity unit distances.
    pub voxel_depth: f64,
    /// Voxels with opacity.
    pub active: ActiveCounts,
    /// For each bin of error, how many nodes a cut gains by splitting the nodes in it.
    gains: Vec<u64>,
}

/// Bins of [`Pyramid::error_for_count`], logarithmic between these errors, or up to the root's where that
/// is greater: no other exceeds it.
const GAIN_BINS: usize = 2048;
const LEAST_ERROR: f32 = 1e-5;
/// No node is larger than 2^15 voxels, and no deviation but that of optical depths larger than 1.
const GREATEST_ERROR: f32 = 32768.0;

/// Running sums of one node while the pyramid is built; means over its real voxels.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Real voxels.
    count: f32,
    /// Those among them that `appearance` is the mean of.
    weight: f32,
    /// Mean of what deviates: (opacity, opacity · rgb) of a voxel one voxel thick, or (value, 0, 0, 0)
    /// as a part of the volume's range.
    appearance: [f32; 4],
    /// Sum of squared deviations from `appearance`, over voxels and components.
    m2: f32,
    /// Mean extinction and extinction · rgb.
    extinction: f32,
    emission: [f32; 3],
    /// Extinction of equal mean transmittance.
    effective: f32,
    /// Greatest error of a descendant.
    error: f32,
}

impl Sums {
    /// Chan's merge of counts, means and M2: stable however small the spread.
    fn merge(&mut self, other: &Self) {
        if self.count == 0.0 {
            *self = *other;
            return;
        }
        let count = self.count + other.count;
        if other.weight > 0.0 {
            let weight = other.weight / (self.weight + other.weight);
            let mut squared = 0.0;
            for (mean, theirs) in self.appearance.iter_mut().zip(other.appearance) {
                let delta = theirs - *mean;
                *mean += delta * weight;
                squared += delta * delta;
            }
            self.m2 += other.m2 + squared * self.weight * weight;
            self.weight += other.weight;
        }
        let weight = other.count / count;
        self.extinction += (other.extinction - self.extinction) * weight;
        for (mean, theirs) in self.emission.iter_mut().zip(other.emission) {
            *mean += (theirs - *mean) * weight;
        }
        self.error = self.error.max(other.error);
        self.count = count;
    }

    fn rms(&self) -> f32 {
        (self.m2 / self.weight.max(1.0)).max(0.0).sqrt()
    }

    fn node(&self, active_children: u16) -> Node {
        let weight = if self.extinction > 0.0 { 1.0 / self.extinction } else { 0.0 };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=65535")]
        let colour = self.emission.map(|e| ((e * weight).clamp(0.0, 1.0) * 65535.0 + 0.5) as u16);
        Node { extinction: self.effective, error: self.error, colour, active_children }
    }
}

/// Extinction whose transmittance through the node equals the mean over its columns of children,
/// averaged over the three axes (−ln⟨exp(−column depth)⟩ / size).
///
/// `children` are in x, y, z bit order; absent ones (beyond the border) are `None`. `size` is the
/// thickness of a child in unit distances.
fn effective_extinction(children: &[Option<f32>; 8], size: f32) -> f32 {
    let mut present = children.iter().flatten();
    let Some(&first) = present.next() else { return 0.0 };
    if present.all(|&c| c == first) {
        return first;
    }
    let mut axes = 0.0;
    let mut mean = 0.0;
    for axis in 0..3 {
        let step = 1 << axis;
        let mut depths = [f32::INFINITY; 4];
        let (mut columns, mut longest) = (0, 0.0_f32);
        for start in (0..8).filter(|i| i & step == 0) {
            let pair = [children[start], children[start | step]];
            let length = pair.iter().flatten().count();
            if length == 0 {
                continue;
            }
            depths[columns] = pair.iter().flatten().sum::<f32>() * size;
            columns += 1;
            longest = longest.max(length as f32);
        }
        if columns > 0 {
            // Relative to the least: exp(−104) is 0 in single precision, and its logarithm −∞.
            let depths = &depths[..columns];
            let least = depths.iter().copied().fold(f32::INFINITY, f32::min);
            let beyond: f32 = depths.iter().map(|depth| (least - depth).exp()).sum();
            mean += (least - (beyond / columns as f32).ln()) / (size * longest);
            axes += 1.0;
        }
    }
    mean / axes
}

impl Pyramid {
    /// Classifies every voxel of every brick that can show, and averages upwards.
    ///
    /// `voxel_depth` is the thickness of a voxel in opacity unit distances; `measure` says what the
    /// nodes' errors are of.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn build(
        volume: &ScalarVolume,
        table: &Table,
        voxel_depth: f64,
        measure: ErrorMeasure,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let voxel_thickness = voxel_depth;
        #[expect(clippy::cast_possible_truncation, reason = "a ratio of order 1")]
        let voxel_depth = voxel_depth as f32;
        let dims = volume.lattice.dims;
        let (mut sums, active) = with_samples!(&*volume.samples, values => first_level(volume, values, table, voxel_depth, measure, ticket))?;
        let mut level_dims = dims.map(|n| n.div_ceil(2));
        let mut levels = vec![to_level(level_dims, &sums)];
        let mut size = voxel_depth * 2.0;
        let mut edge = 2.0;
        while level_dims != [1, 1, 1] {
            ticket.checkpoint(0, 1)?;
            let coarser = level_dims.map(|n| n.div_ceil(2));
            sums = next_level(level_dims, &sums, coarser, size, edge);
            levels.push(to_level(coarser, &sums));
            level_dims = coarser;
            size *= 2.0;
            edge *= 2.0;
        }
        if measure == ErrorMeasure::OpticalDepth {
            columns::measure(volume, table, voxel_thickness, &mut levels, ticket)?;
        }
        let gains = gains(&levels);
        Ok(Self { dims, levels, measure, voxel_depth: voxel_thickness, active, gains })
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
    levels
        .iter()
        .map(|level| {
            level
                .nodes
                .par_chunks(1 << 16)
                .fold(
                    || vec![0_u64; GAIN_BINS],
                    |mut bins, nodes| {
                        for node in nodes.iter().filter(|n| n.active_children > 1) {
                            bins[error_bin(node.error, greatest)] +=
                                u64::from(node.active_children) - 1;
                        }
                        bins
                    },
                )
                .reduce(|| vec![0; GAIN_BINS], add)
        })
        .fold(vec![0; GAIN_BINS], add)
}

fn add(mut a: Vec<u64>, b: Vec<u64>) -> Vec<u64> {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
    a
}

fn to_level(dims: [usize; 3], sums: &[(Sums, u16)]) -> PyramidLevel {
    PyramidLevel { dims, nodes: sums.par_iter().map(|(s, active)| s.node(*active)).collect() }
}

/// A voxel as one [`Sums`] of count 1, or nothing where it is transparent.
fn voxel_sums(entry: [f32; 4], voxel_depth: f32) -> Sums {
    let [r, g, b, extinction] = entry;
    let alpha = -(-extinction * voxel_depth).exp_m1();
    Sums {
        count: 1.0,
        weight: 1.0,
        appearance: [alpha, alpha * r, alpha * g, alpha * b],
        m2: 0.0,
        extinction,
        emission: [extinction * r, extinction * g, extinction * b],
        effective: extinction,
        error: 0.0,
    }
}

/// Where a value lies between the least and the greatest finite one, 0..=1; ±∞ lie at the ends, and
/// NaN nowhere.
fn part_of_range(statistics: &Statistics) -> impl Fn(f64) -> Option<f32> {
    // Halved, so that ±1e308 does not overflow.
    let (low, high) = (statistics.min / 2.0, statistics.max / 2.0);
    let per_range = if high > low { 1.0 / (high - low) } else { 0.0 };
    move |value| {
        let part = ((value / 2.0).clamp(low, high) - low) * per_range;
        #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
        (!part.is_nan()).then_some(part as f32)
    }
}

type Counted = (Vec<(Sums, u16)>, ActiveCounts);

fn first_level<T: Scalar>(
    volume: &ScalarVolume,
    values: &[T],
    table: &Table,
    voxel_depth: f32,
    measure: ErrorMeasure,
    ticket: &Ticket,
) -> Result<Counted, Cancelled> {
    let dims = volume.lattice.dims;
    let coarse = dims.map(|n| n.div_ceil(2));
    let layer = coarse[0] * coarse[1];
    // One entry per table entry: exact for types that have one per code.
    let voxel_of_entry: Vec<Sums> =
        table.entries.par_iter().map(|&entry| voxel_sums(entry, voxel_depth)).collect();
    let exact = volume.samples.scalar_type().size_bytes() <= 2;
    let offset = table.coordinate.offset;
    let classify = |value: T| {
        let value = value.to_f64();
        if exact {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a code")]
            let code = (value - offset) as usize;
            voxel_of_entry[code]
        } else {
            voxel_sums(table.lookup(value), voxel_depth)
        }
    };
    let by_value = measure == ErrorMeasure::Scalar;
    let part_of_range = part_of_range(&volume.statistics);
    let visible: Vec<bool> = volume
        .bricks
        .ranges
        .par_iter()
        .map(|&[low, high]| low <= high && table.greatest_extinction(low, high) > 0.0)
        .collect();
    let bricks = volume.bricks.dims;
    let mut sums = vec![(Sums::default(), 0); layer * coarse[2]];
    let empty_counts = || ActiveCounts { total: 0, per_slice: dims.map(|n| vec![0; n]) };
    let active = sums
        .par_chunks_mut(layer)
        .enumerate()
        .try_fold(empty_counts, |mut counts, (cz, nodes)| {
            ticket.checkpoint(cz as u64, coarse[2] as u64)?;
            for cy in 0..coarse[1] {
                for cx in 0..coarse[0] {
                    let corner = [2 * cx, 2 * cy, 2 * cz];
                    let brick = corner.map(|i| i / BRICK);
                    let cell = &mut nodes[cy * coarse[0] + cx];
                    // What is clear has values, too, and its neighbours' parents are of both.
                    if !by_value
                        && !visible[(brick[2] * bricks[1] + brick[1]) * bricks[0] + brick[0]]
                    {
                        let real: usize = (0..3).map(|a| (dims[a] - corner[a]).min(2)).product();
                        cell.0.count = real as f32;
                        cell.0.weight = real as f32;
                        continue;
                    }
                    let mut merged = Sums::default();
                    let mut children = [None; 8];
                    for (bit, child) in children.iter_mut().enumerate() {
                        let at = [
                            corner[0] + (bit & 1),
                            corner[1] + (bit >> 1 & 1),
                            corner[2] + (bit >> 2),
                        ];
                        if at[0] >= dims[0] || at[1] >= dims[1] || at[2] >= dims[2] {
                            continue;
                        }
                        let value = values[(at[2] * dims[1] + at[1]) * dims[0] + at[0]];
                        let mut voxel = classify(value);
                        if by_value {
                            let part = part_of_range(value.to_f64());
                            voxel.weight = if part.is_some() { 1.0 } else { 0.0 };
                            voxel.appearance = [part.unwrap_or(0.0), 0.0, 0.0, 0.0];
                        }
                        *child = Some(voxel.extinction);
                        if voxel.extinction > 0.0 {
                            cell.1 += 1;
                            counts.total += 1;
                            for (slices, index) in counts.per_slice.iter_mut().zip(at) {
                                slices[index] += 1;
                            }
                        }
                        merged.merge(&voxel);
                    }
                    merged.effective = effective_extinction(&children, voxel_depth);
                    if cell.1 > 0 {
                        merged.error = merged.rms();
                    }
                    cell.0 = merged;
                }
            }
            Ok(counts)
        })
        .try_reduce(empty_counts, |mut a, b| {
            a.total += b.total;
            for (a, b) in a.per_slice.iter_mut().zip(b.per_slice) {
                a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            }
            Ok(a)
        })?;
    Ok((sums, active))
}

fn next_level(
    fine: [usize; 3],
    sums: &[(Sums, u16)],
    coarse: [usize; 3],
    child_size: f32,
    edge: f32,
) -> Vec<(Sums, u16)> {
    let layer = coarse[0] * coarse[1];
    let mut out = vec![(Sums::default(), 0_u16); layer * coarse[2]];
    out.par_chunks_mut(layer).enumerate().for_each(|(cz, nodes)| {
        for (i, (merged, active)) in nodes.iter_mut().enumerate() {
            let corner = [2 * (i % coarse[0]), 2 * (i / coarse[0]), 2 * cz];
            let mut children = [None; 8];
            for (bit, child) in children.iter_mut().enumerate() {
                let at =
                    [corner[0] + (bit & 1), corner[1] + (bit >> 1 & 1), corner[2] + (bit >> 2)];
                if at[0] >= fine[0] || at[1] >= fine[1] || at[2] >= fine[2] {
                    continue;
                }
                let (theirs, _) = &sums[(at[2] * fine[1] + at[1]) * fine[0] + at[0]];
                *child = Some(theirs.effective);
                *active += u16::from(theirs.effective > 0.0);
                merged.merge(theirs);
            }
            if *active > 0 {
                merged.effective = effective_extinction(&children, child_size);
                merged.error = merged.error.max(merged.rms() * edge);
            }
        }
    });
    out
}

//! The finest levels of the pyramid, made brick by brick.
//!
//! A brick of voxels becomes its nodes of levels 1 to 3 while they are in the cache: only what is drawn
//! of them goes to memory, and what level 4 is made of. Bricks in which nothing can show stay as they
//! were allocated.

use super::pyramid::{ActiveCounts, ErrorMeasure, Node, PyramidLevel};
use super::sums::{Sums, Voxel, effective_extinction};
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::transfer::Table;
use crate::volume::{BRICK, Scalar, ScalarVolume, Statistics};

/// Levels of a brick.
pub const LEVELS: usize = BRICK.ilog2() as usize;
/// Nodes of level 1 along a brick's edge.
const EDGE: usize = BRICK / 2;

/// The finest levels, at most [`LEVELS`], and the sums of the last of them.
pub(super) struct Finest {
    pub levels: Vec<PyramidLevel>,
    pub sums: Vec<Sums>,
    pub active: ActiveCounts,
}

/// How a volume's voxels are classified and measured.
struct Classifier<'a> {
    volume: &'a ScalarVolume,
    table: &'a Table,
    voxel_depth: f32,
    /// One a table entry, for types that have one a code; else empty.
    of_code: Vec<Voxel>,
    /// The value of entry 0.
    first_code: i64,
    by_value: bool,
}

impl Classifier<'_> {
    #[inline]
    fn voxel<T: Scalar>(&self, value: T) -> Voxel {
        if self.of_code.is_empty() {
            return Voxel::new(self.table.lookup(value.to_f64()), self.voxel_depth);
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a code")]
        let code = (value.to_i64() - self.first_code) as usize;
        self.of_code[code]
    }
}

/// Classifies every voxel of every brick that can show.
pub(super) fn finest<T: Scalar>(
    volume: &ScalarVolume,
    values: &[T],
    table: &Table,
    voxel_depth: f32,
    measure: ErrorMeasure,
    ticket: &Ticket,
) -> Result<Finest, Cancelled> {
    let dims = volume.lattice.dims;
    // Exact for types that have an entry a code.
    let of_code = match volume.samples.scalar_type().size_bytes() <= 2 {
        true => table.entries.iter().map(|&e| Voxel::new(e, voxel_depth)).collect(),
        false => Vec::new(),
    };
    let by_value = measure == ErrorMeasure::Scalar;
    #[expect(clippy::cast_possible_truncation, reason = "whole, where it is asked for")]
    let first_code = table.coordinate.offset as i64;
    let classifier = Classifier { volume, table, voxel_depth, of_code, first_code, by_value };
    let mut levels: Vec<PyramidLevel> = level_dims(dims)
        .into_iter()
        .take(LEVELS)
        .map(|dims| PyramidLevel { dims, nodes: bytemuck::zeroed_vec(dims.iter().product()) })
        .collect();
    let last = levels[levels.len() - 1].dims;
    let mut sums = vec![Sums::default(); last.iter().product()];
    let rows = rows_of_bricks(&mut levels, &mut sums, volume.bricks.dims);
    let count = rows.len() as u64;
    let empty_counts = || ActiveCounts { total: 0, per_slice: dims.map(|n| vec![0; n]) };
    let fill = |counts: &mut ActiveCounts, (i, mut row): (usize, BrickRow<'_>)| {
        ticket.checkpoint(i as u64, count)?;
        row.fill(&classifier, values, counts);
        Ok::<(), Cancelled>(())
    };
    let add = |a: &mut ActiveCounts, b: ActiveCounts| {
        a.total += b.total;
        for (a, b) in a.per_slice.iter_mut().zip(b.per_slice) {
            parallel::add_up(a, b);
        }
    };
    let active = parallel::try_summed(rows.into_iter().enumerate(), empty_counts, fill, add)?;
    Ok(Finest { levels, sums, active })
}

/// Nodes along each axis of level 1 and up, to a single one.
pub(super) fn level_dims(dims: [usize; 3]) -> Vec<[usize; 3]> {
    let mut all = vec![dims.map(|n| n.div_ceil(2))];
    while all[all.len() - 1] != [1; 3] {
        all.push(all[all.len() - 1].map(|n| n.div_ceil(2)));
    }
    all
}

/// Bricks along x, and the rows of nodes that are theirs.
struct BrickRow<'a> {
    /// Brick along y and z.
    at: [usize; 2],
    /// Level by level, y before z.
    nodes: [Vec<&'a mut [Node]>; LEVELS],
    sums: &'a mut [Sums],
}

/// Shares the levels out among rows of bricks, y before z.
fn rows_of_bricks<'a>(
    levels: &'a mut [PyramidLevel],
    sums: &'a mut [Sums],
    bricks: [usize; 3],
) -> Vec<BrickRow<'a>> {
    // A row of the last level, where that has fewer nodes than there are bricks, is one all the same.
    let mut rows: Vec<BrickRow> = sums
        .chunks_mut(bricks[0])
        .enumerate()
        .map(|(i, sums)| {
            let nodes =
                std::array::from_fn(|level| Vec::with_capacity(1 << (2 * (LEVELS - 1 - level))));
            BrickRow { at: [i % bricks[1], i / bricks[1]], nodes, sums }
        })
        .collect();
    for (index, level) in levels.iter_mut().enumerate() {
        let [nx, ny, _] = level.dims;
        let shift = LEVELS - 1 - index;
        for (i, nodes) in level.nodes.chunks_mut(nx).enumerate() {
            let (y, z) = (i % ny, i / ny);
            rows[(z >> shift) * bricks[1] + (y >> shift)].nodes[index].push(nodes);
        }
    }
    rows
}

impl BrickRow<'_> {
    fn fill<T: Scalar>(&mut self, by: &Classifier, values: &[T], counts: &mut ActiveCounts) {
        let Classifier { volume, table, .. } = by;
        let (dims, bricks) = (volume.lattice.dims, &volume.bricks);
        let first = (self.at[1] * bricks.dims[1] + self.at[0]) * bricks.dims[0];
        for bx in 0..bricks.dims[0] {
            let low = [bx, self.at[0], self.at[1]].map(|i| i * BRICK);
            let size: [usize; 3] = std::array::from_fn(|a| BRICK.min(dims[a] - low[a]));
            let shows = table.shows(bricks.ranges[first + bx], bricks.has_holes(first + bx));
            // What is clear has values, too, and its neighbours' parents are of both.
            self.sums[bx] = match shows || by.by_value {
                true => self.brick(by, values, low, size, counts),
                false => Sums::clear(size.iter().product()),
            };
        }
    }

    /// The nodes of one brick, and its sums.
    fn brick<T: Scalar>(
        &mut self,
        by: &Classifier,
        values: &[T],
        low: [usize; 3],
        size: [usize; 3],
        counts: &mut ActiveCounts,
    ) -> Sums {
        let mut held = [Sums::default(); EDGE * EDGE * EDGE];
        let mut dims = size.map(|n| n.div_ceil(2));
        let mut slices = [[0_u32; BRICK]; 3];
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                let row = &mut self.nodes[0][z * dims[1] + y][low[0] / 2..][..dims[0]];
                let held = &mut held[(z * EDGE + y) * EDGE..][..dims[0]];
                nodes_of_voxels(by, values, low, size, [y, z], held, row, &mut slices);
            }
        }
        let total: u32 = slices[0].iter().sum();
        counts.total += u64::from(total);
        for a in 0..3 {
            for (i, n) in slices[a].iter().enumerate().take(size[a]) {
                counts.per_slice[a][low[a] + i] += n;
            }
        }
        let (mut depth, mut edge) = (by.voxel_depth * 2.0, 2.0);
        for level in 1..LEVELS {
            if self.nodes[level].is_empty() {
                break;
            }
            let finer = dims;
            dims = dims.map(|n| n.div_ceil(2));
            for z in 0..dims[2] {
                for y in 0..dims[1] {
                    let nodes = &mut self.nodes[level][z * dims[1] + y][low[0] >> (level + 1)..];
                    for (x, node) in nodes.iter_mut().enumerate().take(dims[0]) {
                        let children = std::array::from_fn(|bit| {
                            let at =
                                [2 * x + (bit & 1), 2 * y + (bit >> 1 & 1), 2 * z + (bit >> 2)];
                            let is_real = (0..3).all(|a| at[a] < finer[a]);
                            is_real.then(|| &held[(at[2] * EDGE + at[1]) * EDGE + at[0]])
                        });
                        let (sums, active) = Sums::parent(children, depth, edge);
                        *node = sums.node(active);
                        // No child that is still to be looked at lies there.
                        held[(z * EDGE + y) * EDGE + x] = sums;
                    }
                }
            }
            depth *= 2.0;
            edge *= 2.0;
        }
        held[0]
    }
}

/// A row of nodes of level 1 in a brick from `low`, of `size` voxels; `at` is its y and z in nodes.
#[expect(clippy::too_many_arguments, reason = "three results of one pass over the voxels")]
fn nodes_of_voxels<T: Scalar>(
    by: &Classifier,
    values: &[T],
    low: [usize; 3],
    size: [usize; 3],
    at: [usize; 2],
    held: &mut [Sums],
    nodes: &mut [Node],
    slices: &mut [[u32; BRICK]; 3],
) {
    let dims = by.volume.lattice.dims;
    let part_of_range = part_of_range(&by.volume.statistics);
    let rows = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dy, dz)| {
        let (y, z) = (2 * at[0] + dy, 2 * at[1] + dz);
        // Beyond the border: no voxels.
        let is_real = y < size[1] && z < size[2];
        let start = ((low[2] + z) * dims[1] + low[1] + y) * dims[0] + low[0];
        if is_real { &values[start..start + size[0]] } else { &[] }
    });
    for (x, (held, node)) in held.iter_mut().zip(nodes).enumerate() {
        // Which of its voxels show, in x, y, z bit order.
        let mut shown = 0_u8;
        let whole = 2 * x..2 * x + 2;
        if let (Some(&[a, b]), Some(&[c, d]), Some(&[e, f]), Some(&[g, h])) = (
            rows[0].get(whole.clone()),
            rows[1].get(whole.clone()),
            rows[2].get(whole.clone()),
            rows[3].get(whole.clone()),
        ) && !by.by_value
        {
            let mut voxels = [Voxel::CLEAR; 8];
            for (bit, value) in [a, b, c, d, e, f, g, h].into_iter().enumerate() {
                voxels[bit] = by.voxel(value);
                shown |= u8::from(voxels[bit].extinction() > 0.0) << bit;
            }
            *held = match shown {
                0 => Sums::clear(8),
                _ => Sums::of_eight(&voxels, by.voxel_depth),
            };
        } else {
            let mut merged = Sums::default();
            let mut children = [None; 8];
            for (bit, child) in children.iter_mut().enumerate() {
                let Some(&value) = rows[bit >> 1].get(2 * x + (bit & 1)) else { continue };
                let voxel = by.voxel(value);
                let mut sums = voxel.sums();
                if by.by_value {
                    let part = part_of_range(value.to_f64());
                    sums.weight = if part.is_some() { 1.0 } else { 0.0 };
                    sums.appearance = [part.unwrap_or(0.0), 0.0, 0.0, 0.0];
                }
                *child = Some(voxel.extinction());
                shown |= u8::from(voxel.extinction() > 0.0) << bit;
                merged.merge(&sums);
            }
            merged.effective = effective_extinction(&children, by.voxel_depth);
            if shown > 0 {
                merged.error = merged.rms();
            }
            *held = merged;
        }
        if shown > 0 {
            for (axis, (slices, low)) in slices.iter_mut().zip([x, at[0], at[1]]).enumerate() {
                let first = shown & [0b0101_0101, 0b0011_0011, 0b0000_1111][axis];
                slices[2 * low] += first.count_ones();
                slices[2 * low + 1] += (shown ^ first).count_ones();
            }
            *node = held.node(shown.count_ones() as u16);
        }
    }
}

/// Where a value lies between the least and the greatest finite one, 0..=1; ±∞ lie at the ends, and
/// NaN nowhere.
pub(super) fn part_of_range(statistics: &Statistics) -> impl Fn(f64) -> Option<f32> {
    // Halved, so that ±1e308 does not overflow.
    let (low, high) = (statistics.min / 2.0, statistics.max / 2.0);
    let per_range = if high > low { 1.0 / (high - low) } else { 0.0 };
    move |value| {
        let part = ((value / 2.0).clamp(low, high) - low) * per_range;
        #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
        (!part.is_nan()).then_some(part as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::super::pyramid::Pyramid;
    use super::*;
    use crate::core::Srgb8;
    use crate::transfer::{ColourSource, TransferFunction};
    use crate::volume::{Lattice, Samples};

    /// Every level from all voxels, one after the other, level by level: slow, and nothing left out.
    fn level_by_level(
        volume: &ScalarVolume,
        table: &Table,
        voxel_depth: f32,
        measure: ErrorMeasure,
    ) -> Vec<PyramidLevel> {
        let part_of_range = part_of_range(&volume.statistics);
        let mut dims = volume.lattice.dims;
        let mut held: Vec<Sums> = (0..volume.lattice.len())
            .map(|i| {
                let value = volume.samples.get(i);
                let mut sums = Voxel::new(table.lookup(value), voxel_depth).sums();
                if measure == ErrorMeasure::Scalar {
                    let part = part_of_range(value);
                    sums.weight = f32::from(u8::from(part.is_some()));
                    sums.appearance = [part.unwrap_or(0.0), 0.0, 0.0, 0.0];
                }
                sums
            })
            .collect();
        let (mut depth, mut edge) = (voxel_depth, 1.0);
        let mut levels = Vec::new();
        for coarser in level_dims(dims) {
            let nodes = voxels(coarser).map(|at| {
                let children = std::array::from_fn(|bit| {
                    let at: [usize; 3] = std::array::from_fn(|a| 2 * at[a] + (bit >> a & 1));
                    let is_real = (0..3).all(|a| at[a] < dims[a]);
                    is_real.then(|| &held[(at[2] * dims[1] + at[1]) * dims[0] + at[0]])
                });
                Sums::parent(children, depth, edge)
            });
            let nodes: Vec<(Sums, u16)> = nodes.collect();
            levels.push(PyramidLevel {
                dims: coarser,
                nodes: nodes.iter().map(|(sums, active)| sums.node(*active)).collect(),
            });
            held = nodes.into_iter().map(|(sums, _)| sums).collect();
            (dims, depth, edge) = (coarser, depth * 2.0, edge * 2.0);
        }
        levels
    }

    fn voxels([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
        (0..nx * ny * nz).map(move |i| [i % nx, i / nx % ny, i / (nx * ny)])
    }

    /// Noise in some bricks, and nothing that shows in others.
    fn value([x, y, z]: [usize; 3]) -> f64 {
        let noise = ((x * 7919 + y * 104_729 + z * 1_299_709) % 251) as f64;
        if (x / 9 + y / 7 + z / 11) % 3 == 0 { noise } else { noise * 0.3 }
    }

    #[test]
    fn bricks_give_the_bits_that_all_voxels_give_one_after_the_other() {
        let transfer = TransferFunction::of(
            vec![(80.0, 0.0), (120.0, 0.2), (250.0, 0.97)],
            ColourSource::Stops(vec![(80.0, Srgb8([250, 20, 10])), (250.0, Srgb8([20, 90, 255]))]),
        );
        for dims in
            [[24, 16, 8], [19, 9, 10], [33, 2, 5], [1, 13, 6], [1, 1, 300], [3, 4, 1], [1; 3]]
        {
            let values: Vec<f64> = voxels(dims).map(value).collect();
            let holed = |(i, &v): (usize, &f64)| if i % 13 == 5 { f64::NAN } else { v * 1.01 };
            for samples in [
                Samples::UInt8(values.iter().map(|&v| v as u8).collect()),
                Samples::Int16(values.iter().map(|&v| v as i16 - 20).collect()),
                Samples::Float64(values.iter().enumerate().map(holed).collect()),
            ] {
                let volume =
                    ScalarVolume::from_samples("test", Lattice::unit(dims), samples).unwrap();
                let table = Table::new(&transfer, volume.samples.scalar_type());
                for measure in [ErrorMeasure::Classified, ErrorMeasure::Scalar] {
                    let built =
                        Pyramid::build(&volume, &table, 0.9, measure, &Ticket::new()).unwrap();
                    let expected = level_by_level(&volume, &table, 0.9, measure);
                    assert_eq!(built.levels.len(), expected.len());
                    for (found, expected) in built.levels.iter().zip(&expected) {
                        assert_eq!(found.dims, expected.dims);
                        // No two numbers are equal but by their bits, zeros aside.
                        assert!(
                            found.nodes == expected.nodes,
                            "{dims:?} {:?} {measure:?}",
                            found.dims
                        );
                    }
                    let shown: Vec<[usize; 3]> = voxels(dims)
                        .enumerate()
                        .filter(|(i, _)| table.lookup(volume.samples.get(*i))[3] > 0.0)
                        .map(|(_, at)| at)
                        .collect();
                    assert_eq!(built.active.total, shown.len() as u64);
                    for (axis, slices) in built.active.per_slice.iter().enumerate() {
                        for (index, &n) in slices.iter().enumerate() {
                            let there = shown.iter().filter(|at| at[axis] == index).count();
                            assert_eq!(n as usize, there, "{dims:?} axis {axis} slice {index}");
                        }
                    }
                }
            }
        }
    }
}

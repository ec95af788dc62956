//! How much thinner a cut's nodes are drawn in a quick picture, so that it hides as much as the voxels do.
//!
//! A node spreads its matter over its box and its kernel beyond it, and what it lets through the next node along a ray meets as if
//! it lay anywhere; in truth skins and vessels run on from node to node, and columns between them stay
//! clear. So cuts of few nodes are too opaque, each node's own mean transmittance notwithstanding. What they
//! should hide is known along the axes of the lattice: the mean over all columns of voxels, from border to
//! border. Cuts of a few sizes are laid over the same columns, and one factor of all extinctions of a cut makes both means equal.

use super::cut::{Cut, CutLimits, CutNode, Visibility, VisitOrder};
use super::pyramid::Pyramid;
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::transfer::Table;
use crate::volume::cover::{Cover, Map, PAD, REACH, across};
use crate::volume::{BRICK, Scalar, ScalarVolume};
use crate::with_samples;
use glam::{DMat3, DVec2, DVec3};

/// Nodes of the cuts that are measured, about.
const COUNTS: [u64; 3] = [300, 2_000, 12_000];
/// Cuts of so many are drawn as they are: too bright by 0.2 of 255 at most on three scans, and no nearer if thinned.
const AS_THEY_ARE: u64 = 72_000;
/// Factors of extinctions, by how coarse a cut is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Thinning {
    /// Mean level of a cut's matter, and its factor, 0..=1; by level. Of cuts that are finer, 1.
    steps: Vec<[f32; 2]>,
}

impl Thinning {
    /// What all extinctions of a cut are to be multiplied by, 0..=1.
    pub fn factor(&self, cut: &[CutNode]) -> f32 {
        let level = mean_level(cut);
        let after = self.steps.partition_point(|&[at, _]| at < level);
        let before = after.checked_sub(1).map_or([0.0, 1.0], |i| self.steps[i]);
        let Some(next) = self.steps.get(after) else { return before[1] };
        let share = (level - before[0]) / (next[0] - before[0]).max(f32::MIN_POSITIVE);
        before[1] + (next[1] - before[1]) * share
    }

    /// Measured on cuts of a pyramid.
    pub(super) fn of(
        pyramid: &Pyramid,
        volume: &ScalarVolume,
        table: &Table,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        #[expect(clippy::cast_possible_truncation, reason = "a ratio of order 1")]
        let depth = pyramid.voxel_depth as f32;
        let columns = with_samples!(&*volume.samples, values => {
            columns(volume, values, table, ticket)
        })?;
        let dims = volume.lattice.dims;
        let voxels = (0..3).map(|axis| spread(&columns[axis], dims, axis));
        let hidden = Cover::of(voxels, depth).hidden(1.0);
        let mut steps: Vec<[f32; 2]> = parallel::try_list(COUNTS.len(), |i| {
            ticket.checkpoint(1, 1)?;
            let max_error = pyramid.error_for_count(COUNTS[i]);
            let cut = whole_cut(pyramid, max_error, volume, table);
            let bins = Cover::of((0..3).map(|axis| laid_over(&cut, dims, axis)), depth);
            Ok::<_, Cancelled>([mean_level(&cut), bins.factor(hidden)])
        })?;
        if pyramid.is_whole() {
            let max_error = pyramid.error_for_count(AS_THEY_ARE);
            steps.push([mean_level(&whole_cut(pyramid, max_error, volume, table)), 1.0]);
        }
        // Where there are fewer nodes than asked for, cuts are the same: the first is as it is.
        steps.retain(|step| step[0] > 0.0);
        steps.sort_by(|a, b| a[0].total_cmp(&b[0]).then(b[1].total_cmp(&a[1])));
        steps.dedup_by(|a, b| a[0] - b[0] < 1e-3);
        Ok(Self { steps })
    }
}

/// Mean level of a cut's nodes, weighted by the matter in them.
fn mean_level(cut: &[CutNode]) -> f32 {
    let (mut sum, mut all) = (0.0, 0.0);
    for CutNode { size, level, node, .. } in cut {
        let matter = f64::from(node.extinction) * f64::from(size[0] * size[1] * size[2]);
        sum += matter * f64::from(*level);
        all += matter;
    }
    #[expect(clippy::cast_possible_truncation, reason = "a level")]
    let mean = (sum / f64::max(all, f64::MIN_POSITIVE)) as f32;
    mean
}

/// The cut of an error in no view.
fn whole_cut(
    pyramid: &Pyramid,
    max_error: f32,
    volume: &ScalarVolume,
    table: &Table,
) -> Vec<CutNode> {
    let limits = CutLimits { min_radius_px: 0.0, ..CutLimits::of_error(max_error) };
    let everything = Visibility {
        view_from_index: DMat3::IDENTITY,
        view_origin: DVec3::ZERO,
        half_size: DVec2::splat(1e9),
        eye_distance: None,
        kernel_radius: 1.0,
    };
    let voxel = |index| table.lookup(volume.samples.get(index));
    Cut::of(pyramid, limits, VisitOrder::Along(DVec3::Z), &everything, voxel).nodes
}

/// Sums of extinction along each axis, for each column of voxels.
fn columns<T: Scalar>(
    volume: &ScalarVolume,
    values: &[T],
    table: &Table,
    ticket: &Ticket,
) -> Result<[Vec<f32>; 3], Cancelled> {
    let [nx, ny, nz] = volume.lattice.dims;
    let bricks = &volume.bricks;
    let shows =
        parallel::list(bricks.ranges.len(), |i| table.shows(bricks.ranges[i], bricks.has_holes(i)));
    let is_coded = volume.samples.scalar_type().size_bytes() <= 2;
    #[expect(clippy::cast_possible_truncation, reason = "whole, where it is asked for")]
    let first_code = table.coordinate.offset as i64;
    let extinctions: Vec<f32> = table.entries.iter().map(|entry| entry[3]).collect();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an entry")]
    let extinction = |value: T| match is_coded {
        true => extinctions[(value.to_i64() - first_code) as usize],
        false => match value.to_f64() {
            value if value.is_nan() => table.no_data[3],
            value => extinctions[(table.coordinate.of(value) + 0.5) as usize],
        },
    };
    let mut along = [vec![0.0; ny * nz], vec![0.0; nx * nz], Vec::new()];
    let [along_x, along_y, _] = &mut along;
    let empty = || vec![0.0_f32; nx * ny];
    let layers = along_x.chunks_mut(ny * BRICK).zip(along_y.chunks_mut(nx * BRICK));
    type Layer<'a> = (usize, (&'a mut [f32], &'a mut [f32]));
    let add = |along_z: &mut Vec<f32>, (bz, (along_x, along_y)): Layer<'_>| {
        ticket.checkpoint(1, 1)?;
        for z in bz * BRICK..((bz + 1) * BRICK).min(nz) {
            let along_x = &mut along_x[z % BRICK * ny..][..ny];
            let along_y = &mut along_y[z % BRICK * nx..][..nx];
            for y in 0..ny {
                let bricks_before = (bz * bricks.dims[1] + y / BRICK) * bricks.dims[0];
                let row = &values[(z * ny + y) * nx..][..nx];
                for (bx, run) in row.chunks(BRICK).enumerate() {
                    if !shows[bricks_before + bx] {
                        continue;
                    }
                    let own = &mut along_z[y * nx + bx * BRICK..][..run.len()];
                    let across = &mut along_y[bx * BRICK..][..run.len()];
                    let mut sum = 0.0;
                    for ((&value, z), y) in run.iter().zip(own).zip(across) {
                        let extinction = extinction(value);
                        *z += extinction;
                        *y += extinction;
                        sum += extinction;
                    }
                    along_x[y] += sum;
                }
            }
        }
        Ok::<(), Cancelled>(())
    };
    along[2] = parallel::try_summed(layers.enumerate(), empty, add, parallel::add_up)?;
    Ok(along)
}

/// What voxels' kernels make of columns of voxels.
fn spread(columns: &[f32], dims: [usize; 3], axis: usize) -> Map {
    let [nu, nv] = across(axis).map(|a| dims[a]);
    let mut map = Map::new([nu, nv]);
    let beside = (REACH - 1.0) / 2.0 / REACH;
    let taps = [beside, 1.0 / REACH, beside];
    for (i, &sum) in columns.iter().enumerate().filter(|(_, sum)| **sum > 0.0) {
        let place = (i / nu + PAD) * map.width + i % nu + PAD;
        for (dv, v) in taps.into_iter().enumerate() {
            for (du, u) in taps.into_iter().enumerate() {
                map.sums[place + (dv * map.width + du) - map.width - 1] += sum * u * v;
            }
        }
    }
    map
}

/// What kernels of a cut make of the same columns.
fn laid_over(cut: &[CutNode], dims: [usize; 3], axis: usize) -> Map {
    let [u, v] = across(axis);
    let mut map = Map::new([dims[u], dims[v]]);
    for CutNode { low, size, node, .. } in cut {
        let edges = |a: usize| [low[a] as f32, size[a] as f32];
        map.lay([edges(u), edges(v)], REACH, node.extinction * size[axis] as f32);
    }
    map.summed()
}

#[cfg(test)]
mod tests {
    use super::super::pyramid::{ErrorMeasure, Node};
    use super::*;
    use crate::core::Srgb8;
    use crate::transfer::{ColourSource, NoData, TransferFunction};
    use crate::volume::{Lattice, Samples};

    const DIMS: [usize; 3] = [19, 10, 25];

    fn transfer() -> TransferFunction {
        let transfer = TransferFunction::of(
            vec![(60.0, 0.0), (100.0, 0.6)],
            ColourSource::Stops(vec![(0.0, Srgb8([250, 20, 10])), (100.0, Srgb8([20, 90, 255]))]),
        );
        TransferFunction { no_data: NoData { opacity: 0.3, ..NoData::default() }, ..transfer }
    }

    fn volume(samples: Samples) -> ScalarVolume {
        ScalarVolume::from_samples("test", Lattice::unit(DIMS), samples).unwrap()
    }

    /// Clear bricks, mixed ones, and holes where there can be.
    fn value(i: usize) -> f64 {
        let z = i / (DIMS[0] * DIMS[1]);
        if z < 9 { 3.0 } else { (i * 7919 % 101) as f64 }
    }

    #[test]
    fn columns_are_the_sums_of_all_their_voxels() {
        let count = DIMS.iter().product();
        let holed = |i: usize| if i % 11 == 3 { f32::NAN } else { value(i) as f32 };
        for samples in [
            Samples::UInt8((0..count).map(|i| value(i) as u8).collect()),
            Samples::Int16((0..count).map(|i| value(i) as i16).collect()),
            Samples::Float32((0..count).map(holed).collect()),
        ] {
            let volume = volume(samples);
            let table = Table::new(&transfer(), volume.samples.scalar_type());
            let found = with_samples!(&*volume.samples, values => {
                columns(&volume, values, &table, &Ticket::new()).unwrap()
            });
            for axis in 0..3 {
                let [u, v] = across(axis);
                let mut expected = vec![0.0_f64; DIMS[u] * DIMS[v]];
                for i in 0..count {
                    let at = [i % DIMS[0], i / DIMS[0] % DIMS[1], i / (DIMS[0] * DIMS[1])];
                    let voxel = table.lookup(volume.samples.get(i));
                    expected[at[v] * DIMS[u] + at[u]] += f64::from(voxel[3]);
                }
                assert!(expected.iter().any(|sum| *sum > 1.0));
                for (found, expected) in found[axis].iter().zip(expected) {
                    // Of wide types the nearest of 65 536 entries is taken.
                    assert!((f64::from(*found) - expected).abs() < 1e-3, "{found} {expected}");
                }
            }
        }
    }

    #[test]
    fn nodes_are_laid_over_the_cells_that_their_kernels_reach() {
        let node = |low, size, extinction| CutNode {
            low,
            size,
            level: 1,
            node: Node { extinction, ..Node::default() },
        };
        let cut = [node([4, 2, 8], [4; 3], 0.7), node([16, 8, 24], [3, 2, 1], 2.0)];
        for axis in 0..3 {
            let map = laid_over(&cut, DIMS, axis);
            let [u, v] = across(axis);
            let mut sum = 0.0;
            for (i, &found) in map.sums.iter().enumerate() {
                let at = [i % map.width, i / map.width].map(|n| n as f32 - PAD as f32);
                let expected: f32 = cut
                    .iter()
                    .map(|node| {
                        let part = |at: f32, a: usize| {
                            let (low, size) = (node.low[a] as f32, node.size[a] as f32);
                            let (middle, half) = (low + size / 2.0, size * REACH / 2.0);
                            ((at + 1.0).min(middle + half) - at.max(middle - half)).max(0.0)
                        };
                        let [pu, pv] = [part(at[0], u), part(at[1], v)];
                        node.node.extinction * node.size[axis] as f32 / (REACH * REACH) * pu * pv
                    })
                    .sum();
                assert!((found - expected).abs() < 2e-5, "{axis} {at:?}: {found} {expected}");
                sum += found;
            }
            // Nothing is lost, and nothing added.
            assert!((sum - (0.7 * 64.0 + 2.0 * 6.0)).abs() < 1e-2, "{sum}");
        }
    }

    #[test]
    fn voxels_by_themselves_are_spread_alike_and_need_no_factor() {
        let volume = volume(Samples::UInt8((0..4750).map(|i| value(i) as u8).collect()));
        let table = Table::new(&transfer(), volume.samples.scalar_type());
        let ticket = Ticket::new();
        let measure = ErrorMeasure::Classified;
        let pyramid = Pyramid::build(&volume, &table, 1.0, measure, &ticket).unwrap();
        let all = whole_cut(&pyramid, 0.0, &volume, &table);
        assert!(all.len() > 1000 && mean_level(&all) == 0.0);
        assert_eq!(pyramid.thinning.factor(&all), 1.0);
        let columns = with_samples!(&*volume.samples, values => {
            columns(&volume, values, &table, &ticket).unwrap()
        });
        for (axis, columns) in columns.iter().enumerate() {
            let [a, b] = [spread(columns, DIMS, axis), laid_over(&all, DIMS, axis)];
            let most = a.sums.iter().zip(&b.sums).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(most < 1e-4, "{most}");
            let exact: f64 = a.sums.iter().map(|&tau| -f64::from(-tau).exp_m1()).sum();
            // Bins are a sixteenth of a doubling wide, and know their means.
            let bins = Cover::of([b].into_iter(), 1.0);
            assert!((bins.hidden(1.0) / exact - 1.0).abs() < 1e-4, "{} {exact}", bins.hidden(1.0));
            assert!((f64::from(bins.factor(exact * 0.999)) - 1.0).abs() < 0.02);
            assert!(bins.factor(exact / 2.0) < 0.5);
            assert_eq!(bins.factor(exact * 1.01), 1.0);
        }
    }

    #[test]
    fn factors_lie_between_those_that_were_measured() {
        let thinning = Thinning { steps: vec![[1.0, 0.9], [3.0, 0.5]] };
        let cut = |level: u8| {
            let node = Node { extinction: 1.0, ..Node::default() };
            [CutNode { low: [0; 3], size: [1; 3], level, node }]
        };
        let factors = [0, 1, 2, 3, 7].map(|level| thinning.factor(&cut(level)));
        let expected = [1.0, 0.9, 0.7, 0.5, 0.5];
        assert!(factors.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{factors:?}");
        assert_eq!(thinning.factor(&[]), 1.0);
        assert_eq!(Thinning::default().factor(&cut(3)), 1.0);
    }

    /// Cuts of few nodes are thinned, of [`AS_THEY_ARE`] and more not; coarse levels alone have none of those.
    #[test]
    fn thinning_fades_out_towards_cuts_of_many_nodes() {
        let grid = crate::volume::demo::open("head:64", None).unwrap();
        let component = crate::volume::Component::Index(0);
        let volume = grid.scalar(&grid.fields[0], component, &Ticket::new()).unwrap();
        let [min, max] = [volume.statistics.min, volume.statistics.max];
        let transfer = TransferFunction { opacity: vec![(min, 0.0), (max, 0.6)], ..transfer() };
        let table = Table::new(&transfer, volume.samples.scalar_type());
        let measure = ErrorMeasure::Classified;
        let pyramid = Pyramid::build(&volume, &table, 1.0, measure, &Ticket::new()).unwrap();
        let factors = [2_000, 12_000, 30_000, AS_THEY_ARE, 2 * AS_THEY_ARE].map(|count| {
            let max_error = pyramid.error_for_count(count);
            let cut = whole_cut(&pyramid, max_error, &volume, &table);
            pyramid.thinning.factor(&cut)
        });
        println!("measured {factors:?}");
        assert!(factors[..3].iter().all(|factor| *factor < 0.99), "{factors:?}");
        assert!(factors[1] < factors[2], "{factors:?}");
        assert_eq!(factors[3..], [1.0; 2]);
        let columns = with_samples!(&*volume.samples, values => {
            columns(&volume, values, &table, &Ticket::new()).unwrap()
        });
        let dims = volume.lattice.dims;
        let hidden = Cover::of((0..3).map(|axis| spread(&columns[axis], dims, axis)), 1.0);
        for count in COUNTS {
            let cut = whole_cut(&pyramid, pyramid.error_for_count(count), &volume, &table);
            let cover = Cover::of((0..3).map(|axis| laid_over(&cut, dims, axis)), 1.0);
            let found = cover.hidden(f64::from(pyramid.thinning.factor(&cut)));
            let ratio = found / hidden.hidden(1.0);
            assert!((ratio - 1.0).abs() < 1e-4, "{count}: {ratio}");
        }
        let coarse = Pyramid::coarse(&volume, &table, 1.0, measure, &Ticket::new()).unwrap();
        let finest = whole_cut(&coarse, 0.0, &volume, &table);
        assert!(coarse.thinning.factor(&finest) < 0.99, "{:?}", coarse.thinning);
    }

    /// Voxels of a tenth of the depth that are denser by as much are the same.
    #[test]
    fn factors_are_of_optical_depths() {
        let grid = crate::volume::demo::open("head:48", None).unwrap();
        let component = crate::volume::Component::Index(0);
        let volume = grid.scalar(&grid.fields[0], component, &Ticket::new()).unwrap();
        let middle = f64::midpoint(volume.statistics.min, volume.statistics.max);
        let of = |opacity: f64, depth: f64| {
            let step = vec![(middle, 0.0), (middle, opacity)];
            let transfer = TransferFunction { opacity: step, ..transfer() };
            let table = Table::new(&transfer, volume.samples.scalar_type());
            let measure = ErrorMeasure::Classified;
            Pyramid::build(&volume, &table, depth, measure, &Ticket::new()).unwrap().thinning.steps
        };
        let [thick, thin] = [of(1.0 - 0.65_f64.powi(10), 0.1), of(0.35, 1.0)];
        println!("measured {thick:?} {thin:?}");
        assert!(thick.len() > 1 && thick.iter().all(|step| step[1] < 0.99), "{thick:?}");
        assert_eq!(thick.len(), thin.len());
        for (a, b) in thick.as_flattened().iter().zip(thin.as_flattened()) {
            assert!((a - b).abs() < 2e-3, "{thick:?} {thin:?}");
        }
    }

    #[test]
    fn what_has_nothing_to_show_is_as_it_is() {
        let volume = volume(Samples::UInt8(vec![0; 4750]));
        let table = Table::new(&transfer(), volume.samples.scalar_type());
        for build in [Pyramid::build, Pyramid::coarse] {
            let measure = ErrorMeasure::Classified;
            let pyramid = build(&volume, &table, 1.0, measure, &Ticket::new()).unwrap();
            assert_eq!(pyramid.thinning, Thinning::default());
        }
    }
}

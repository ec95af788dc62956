//! Coarser fields of splats: what eight of them come to.

use glam::{DMat3, DVec3};

use super::marks::MARKED;
use super::splats::{columns, own_phase};
use super::{Splat, Splats, VectorMode, VectorSettings};
use crate::core::Cancelled;
use crate::core::progress::Ticket;
use crate::kernel::{Kernel, RadialKernel};
use crate::transfer::extinction_from_opacity;
use crate::volume::cover::{Cover, Map, REACH, across};

/// A field of splats, and coarser ones, each of means of 2 × 2 × 2 of the one before.
///
/// As Laur and Hanrahan's pyramid of colours: depths are averaged over the whole box, transparent grid points
/// included; colours and directions are weighed by them. Splats that are spread over a box hide more than
/// those that they stand for, which lie behind each other and leave gaps. So each level is thinned until it
/// hides as much as the finest does, in the mean over all columns along the grid's axes ([`Cover`]).
/// How far directions differ is kept as [`Splat::spread`].
#[derive(Debug, Clone, PartialEq)]
pub struct VectorPyramid {
    /// The finest first; at least one.
    pub levels: Vec<Splats>,
}

/// Sums over a box.
#[derive(Clone, Copy, Default)]
struct Sum {
    weight: f64,
    centre: DVec3,
    direction: DVec3,
    colour: DVec3,
    marks: DVec3,
    axes: DMat3,
}

impl VectorPyramid {
    /// All levels above a field, down to one splat; `settings` and `published` as it was classified.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn new(
        finest: Splats,
        settings: &VectorSettings,
        published: bool,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let mut levels = vec![finest];
        while let Some(finer) = levels.last().filter(|l| l.dims.iter().any(|&n| n > 1)) {
            if ticket.is_cancelled() {
                return Err(Cancelled);
            }
            let level = levels.len() as u32;
            let coarser = halved(finer, published, settings.seed, level);
            levels.push(coarser);
        }
        let marked = if settings.mode == VectorMode::Modulate { MARKED } else { 1.0 };
        let dims = levels[0].dims;
        let hidden = cover(&levels[0], dims, published, marked).hidden(1.0);
        for level in &mut levels[1..] {
            if ticket.is_cancelled() {
                return Err(Cancelled);
            }
            let factor = f64::from(cover(level, dims, published, marked).factor(hidden));
            for splat in &mut level.list {
                splat.amount = amount_of(depth_of(splat.amount, published) * factor, published);
            }
        }
        Ok(Self { levels })
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
fn halved(finer: &Splats, published: bool, seed: u64, level: u32) -> Splats {
    let [nx, ny, _] = finer.dims;
    let dims = finer.dims.map(|n| n.div_ceil(2));
    // The default of a matrix is not zero.
    let nothing = Sum { axes: DMat3::ZERO, ..Sum::default() };
    let mut sums = vec![nothing; dims.iter().product()];
    for (i, (splat, &index)) in finer.list.iter().zip(&finer.indices).enumerate() {
        let index = index as usize;
        let at = [index % nx, index / nx % ny, index / (nx * ny)].map(|i| i / 2);
        let sum = &mut sums[(at[2] * dims[1] + at[1]) * dims[0] + at[0]];
        let weight = depth_of(splat.amount, published);
        let of = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        sum.weight += weight;
        sum.centre += of(splat.centre) * weight;
        // A mean of means is as long as its directions agree.
        sum.direction += of(splat.direction) * (weight * (1.0 - f64::from(splat.spread)));
        sum.colour += of(splat.colour) * weight;
        sum.marks += of(splat.marks) * weight;
        if !finer.own_axes.is_empty() {
            sum.axes += finer.axes_of(i) * weight;
        }
    }
    let size = finer.list.first().map_or(1.0, |splat| splat.size) * 2.0;
    let mut coarser = Splats {
        dims,
        own_axes: Vec::new(),
        list: Vec::new(),
        indices: Vec::new(),
        ..finer.clone_frame()
    };
    for (index, sum) in sums.iter().enumerate().filter(|(_, sum)| sum.weight > 0.0) {
        // Boxes at borders have fewer points, but are drawn as large: spread over all eight, or over the
        // four columns, where the opacity of a splat is the same whatever its size.
        let depth = sum.weight / if published { 4.0 } else { 8.0 };
        let mean = |v: DVec3| (v / sum.weight).as_vec3().to_array();
        let direction = sum.direction / sum.weight;
        let length = direction.length();
        // Opposite directions leave nothing but rounding.
        let agrees = length > 1e-6;
        coarser.list.push(Splat {
            centre: mean(sum.centre),
            amount: amount_of(depth, published),
            direction: if agrees { (direction / length).as_vec3().to_array() } else { [0.0; 3] },
            phase: own_phase(seed, level, index),
            colour: mean(sum.colour),
            size,
            marks: mean(sum.marks),
            spread: (1.0 - length).clamp(0.0, 1.0) as f32,
        });
        if !finer.own_axes.is_empty() {
            coarser.own_axes.push(columns(sum.axes * (1.0 / sum.weight)));
        }
        coarser.indices.push(index as u32);
    }
    coarser
}

/// Where splats lie side by side, each has this share of its opacity.
const BESIDE: f64 = 1.0 / (REACH as f64 * REACH as f64);

/// What adds up along a ray: an amount, or what opacities that are multiplied along it are powers of.
fn depth_of(amount: f32, published: bool) -> f64 {
    let amount = f64::from(amount);
    if published { extinction_from_opacity(amount * BESIDE) / BESIDE } else { amount }
}

#[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
fn amount_of(depth: f64, published: bool) -> f32 {
    (if published { (-(-depth * BESIDE).exp_m1() / BESIDE).min(1.0) } else { depth }) as f32
}

/// How much a level covers of the columns of the finest, whose dimensions are `dims`; `marked` is the share
/// of its depth that marks leave.
#[expect(clippy::cast_possible_truncation, reason = "a map in single precision")]
fn cover(level: &Splats, dims: [usize; 3], published: bool, marked: f64) -> Cover {
    let natural = RadialKernel::new(Kernel::Cubic, None).map_or(1.0, RadialKernel::radius);
    let wider = level.radius / natural;
    let spread_out = wider.powi(3) * level.stretch;
    let size = level.list.first().map_or(1.0, |splat| splat.size);
    let [nx, ny, _] = level.dims;
    let maps = (0..3).map(|axis| {
        let [u, v] = across(axis);
        let mut columns = vec![0.0_f64; level.dims[u] * level.dims[v]];
        for (i, (splat, &index)) in level.list.iter().zip(&level.indices).enumerate() {
            let index = index as usize;
            let at = [index % nx, index / nx % ny, index / (nx * ny)];
            let thick = match published {
                true => 1.0,
                false => level.axes_of(i).col(axis).length() * f64::from(size) * spread_out,
            };
            columns[at[v] * level.dims[u] + at[u]] += depth_of(splat.amount, published) * thick;
        }
        let mut map = Map::new([dims[u], dims[v]]);
        for (i, &depth) in columns.iter().enumerate().filter(|(_, depth)| **depth > 0.0) {
            let low = [i % level.dims[u], i / level.dims[u]].map(|n| n as f32 * size);
            map.lay(low.map(|low| [low, size]), REACH * wider as f32, depth as f32);
        }
        map.summed()
    });
    Cover::of(maps, marked as f32)
}

impl Splats {
    /// The same without any splat.
    fn clone_frame(&self) -> Self {
        Self { own_axes: Vec::new(), list: Vec::new(), indices: Vec::new(), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Samples, Statistics};

    fn splat(centre: [f32; 3], amount: f32, direction: [f32; 3], colour: f32) -> Splat {
        Splat {
            centre,
            amount,
            direction,
            phase: 0.0,
            colour: [colour; 3],
            size: 1.0,
            marks: [0.5; 3],
            spread: 0.0,
        }
    }

    fn field(dims: [usize; 3], list: Vec<(u32, Splat)>) -> Splats {
        let (indices, list) = list.into_iter().unzip();
        Splats {
            origin: DVec3::ZERO,
            unit: 1.0,
            dims,
            axes: DMat3::IDENTITY,
            own_axes: Vec::new(),
            list,
            indices,
            holes: 0,
            stretch: 1.0,
            radius: 1.6,
        }
    }

    fn settings(mode: VectorMode) -> VectorSettings {
        let lengths = Statistics::of(&Samples::Float32(vec![0.0, 1.0]), &Ticket::new()).unwrap();
        VectorSettings { mode, ..VectorSettings::for_lengths(&lengths) }
    }

    fn pyramid(finest: Splats, published: bool) -> VectorPyramid {
        VectorPyramid::new(finest, &settings(VectorMode::Blend), published, &Ticket::new()).unwrap()
    }

    fn levels(list: Vec<(u32, Splat)>, dims: [usize; 3], published: bool) -> Vec<Splats> {
        pyramid(field(dims, list), published).levels
    }

    /// A box of so many edges has the variance of the kernel's footprint along each axis.
    #[test]
    fn boxes_reach_as_far_as_the_cubic_kernel() {
        let kernel = RadialKernel::new(Kernel::Cubic, None).unwrap();
        let (mut all, mut squares) = (0.0, 0.0);
        for i in 0..4000 {
            let l = (f64::from(i) + 0.5) / 4000.0 * kernel.radius();
            // Of a ring: half of l² along either axis.
            all += kernel.footprint(l) * l;
            squares += kernel.footprint(l) * l * l * l / 2.0;
        }
        let reach = (12.0 * squares / all).sqrt();
        assert!((reach - f64::from(REACH)).abs() < 1e-3, "{reach}");
    }

    #[test]
    fn eight_become_one_of_their_weighted_means() {
        let a = splat([0.0; 3], 3e-6, [1.0, 0.0, 0.0], 1.0);
        let b = splat([1.0, 0.0, 0.0], 1e-6, [0.0, 1.0, 0.0], 0.0);
        let levels = levels(vec![(0, a), (1, b)], [2, 2, 2], false);
        let [_, top] = levels.as_slice() else { panic!("two levels") };
        assert_eq!((top.dims, top.list.len()), ([1; 3], 1));
        let found = top.list[0];
        assert_eq!((found.colour[0], found.size), (0.75, 2.0));
        // What is so clear hides nothing behind it.
        assert!((found.amount / 0.5e-6 - 1.0).abs() < 1e-3, "{}", found.amount);
        assert_eq!(found.centre, [0.25, 0.0, 0.0]);
        let length = 10.0_f32.sqrt() / 4.0;
        assert!((found.direction[0] - 0.75 / length).abs() < 1e-6);
        assert!((found.spread - (1.0 - length)).abs() < 1e-6);
    }

    #[test]
    fn opposite_neighbours_have_no_direction_and_full_spread() {
        let a = splat([0.0; 3], 1.0, [0.0, 0.6, 0.8], 1.0);
        let b = splat([1.0, 0.0, 0.0], 1.0, [0.0, -0.6, -0.8], 1.0);
        let top = levels(vec![(0, a), (1, b)], [2, 1, 1], false).remove(1).list[0];
        assert_eq!((top.direction, top.spread), ([0.0; 3], 1.0));
        assert!(top.amount > 0.0);
    }

    #[test]
    fn steps_of_a_curvilinear_grid_are_weighted_means() {
        let a = splat([0.0; 3], 3e-6, [1.0, 0.0, 0.0], 1.0);
        let b = splat([1.0, 0.0, 0.0], 1e-6, [1.0, 0.0, 0.0], 0.0);
        let mut finest = field([2, 1, 1], vec![(0, a), (1, b)]);
        finest.own_axes = vec![columns(DMat3::IDENTITY), columns(DMat3::IDENTITY * 5.0)];
        let found = pyramid(finest, false).levels.remove(1).axes_of(0);
        assert!(found.abs_diff_eq(DMat3::IDENTITY * 2.0, 1e-6), "{found}");
    }

    #[test]
    fn means_of_means_are_those_of_all_and_have_phases_of_their_own() {
        let directions = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.6, 0.8]];
        let list = directions.into_iter().zip(0_u32..).map(|(direction, i)| {
            let one = splat([i as f32, 0.0, 0.0], 1e-6 * (i + 1) as f32, direction, 0.5);
            (i, Splat { marks: [i as f32, 0.0, 1.0], ..one })
        });
        let levels = levels(list.collect(), [4, 1, 1], false);
        assert_eq!(levels.len(), 3);
        let top = levels[2].list[0];
        let mean = DVec3::new(0.1, 0.2 + 0.4 * 0.6, 0.3 + 0.4 * 0.8);
        assert!((f64::from(top.spread) - (1.0 - mean.length())).abs() < 1e-6, "{}", top.spread);
        let direction = DVec3::from(top.direction.map(f64::from));
        assert!(direction.abs_diff_eq(mean.normalize(), 1e-6), "{direction}");
        assert!((top.marks[0] - 2.0).abs() < 1e-6 && top.marks[2] == 1.0, "{:?}", top.marks);
        let phases: Vec<f32> = levels[1..].iter().map(|level| level.list[0].phase).collect();
        let seed = settings(VectorMode::Blend).seed;
        assert_eq!(phases, [1, 2].map(|level| own_phase(seed, level, 0)));
        assert_ne!(phases[0], phases[1]);
    }

    /// Through grids of any steps, wide and stretched kernels: what is clear covers as much as there is of it,
    /// what is opaque every column that its kernel reaches.
    #[test]
    fn columns_are_covered_by_all_matter_as_far_as_kernels_reach() {
        let natural = RadialKernel::new(Kernel::Cubic, None).unwrap().radius();
        let axes = DMat3::from_diagonal(DVec3::new(1.0, 2.0, 4.0));
        for own_axes in [vec![], vec![columns(axes * 0.5), columns(axes)]] {
            let of = |amount: f32| {
                let large = |i: usize| {
                    let one = splat([0.0; 3], amount * i as f32, [1.0, 0.0, 0.0], 0.5);
                    (i as u32, Splat { size: 8.0, ..one })
                };
                Splats {
                    own_axes: own_axes.clone(),
                    axes,
                    radius: 1.25 * natural,
                    stretch: 3.0,
                    ..field([2, 1, 1], vec![large(0), large(1)])
                }
            };
            let clear = cover(&of(1e-9), [16, 8, 8], false, 1.0).hidden(1.0);
            // Lengths along the axes, the box, and how much more the kernel is spread out.
            let matter = 1e-9 * 7.0 * 8.0_f64.powi(3) * 1.25_f64.powi(3) * 3.0;
            assert!((clear / matter - 1.0).abs() < 1e-3, "{clear} {matter}");
            // 8 cells × 1.547 × 1.25, of which 3.7 lie before the box: 16 cells, at least in part.
            // Single precision leaves a little beside it.
            let opaque = cover(&of(30.0), [16, 8, 8], false, 1.0).hidden(1.0);
            assert!((opaque - 3.0 * 256.0).abs() < 8.0, "{opaque}");
            let published = cover(&of(1e-9), [16, 8, 8], true, 1.0).hidden(1.0);
            assert!((published / (1e-9 * 3.0 * 64.0) - 1.0).abs() < 1e-3, "{published}");
        }
    }

    /// Two thirds of a grid, of uneven amounts.
    fn speckled(dims: [usize; 3], most: f32) -> Vec<(u32, Splat)> {
        let some = (0..dims.iter().product::<usize>()).filter(|i| i % 3 != 0);
        let one = |i: usize| {
            let amount = most * (0.2 + 0.2 * (i % 5) as f32);
            (i as u32, splat([(i % dims[0]) as f32, 0.0, 0.0], amount, [1.0, 0.0, 0.0], 0.5))
        };
        some.map(one).collect()
    }

    #[test]
    fn what_is_clear_keeps_its_matter_in_every_level() {
        let natural = RadialKernel::new(Kernel::Cubic, None).unwrap().radius();
        for published in [false, true] {
            let levels = levels(speckled([5, 3, 7], 1e-5), [5, 3, 7], published);
            // Extinction times the volume of the kernel, or opacity times the area it covers, added up.
            let matter = |level: &Splats| -> f64 {
                let of = |i: usize| {
                    let size = f64::from(level.list[i].size);
                    let amount = f64::from(level.list[i].amount);
                    let volume = level.map_of(i).determinant() / (level.radius / natural).powi(3);
                    amount * if published { size * size } else { volume }
                };
                (0..level.list.len()).map(of).sum()
            };
            let finest = matter(&levels[0]);
            assert_eq!(levels.last().map(|l| l.dims), Some([1; 3]));
            for level in &levels {
                let ratio = matter(level) / finest;
                assert!((ratio - 1.0).abs() < 1e-3, "{published} {:?}: {ratio}", level.dims);
            }
        }
    }

    /// A wall one step thick hides what a mean of it and the nothing beside it may not hide more of.
    #[test]
    fn what_is_dense_is_thinned_and_all_of_a_level_alike() {
        let dims = [16, 16, 16];
        let wall = |x: usize, y: usize| {
            let splat = splat([x as f32, y as f32, 3.0], 4.0, [1.0, 0.0, 0.0], 0.5);
            ((3 * 16 + y) as u32 * 16 + x as u32, splat)
        };
        let mut list: Vec<_> = (0..16 * 16).map(|i| wall(i % 16, i / 16)).collect();
        // And a piece of it, a third as dense.
        list[17].1.amount /= 3.0;
        // All levels hide as much: of MODULATE what marks leave of it.
        for (mode, marked) in [(VectorMode::Modulate, MARKED), (VectorMode::Blend, 1.0)] {
            let finest = field(dims, list.clone());
            let all = VectorPyramid::new(finest, &settings(mode), false, &Ticket::new()).unwrap();
            let hidden = |level: &Splats| cover(level, dims, false, marked).hidden(1.0);
            let finest = hidden(&all.levels[0]);
            for level in &all.levels[1..3] {
                let ratio = hidden(level) / finest;
                assert!((ratio - 1.0).abs() < 1e-4, "{mode:?} {:?}: {ratio}", level.dims);
            }
        }
        let levels = levels(list, dims, false);
        for level in &levels[1..3] {
            let size = level.list[0].size;
            let [first, second] = [level.list[0].amount, level.list[1].amount];
            let plain = 4.0 / size;
            assert!(second < 0.95 * plain, "{second} of {plain}");
            let part = (f64::from(size * size) - 2.0 / 3.0) / f64::from(size * size);
            assert!((f64::from(first / second) - part).abs() < 1e-5, "{}", first / second);
        }
    }
}

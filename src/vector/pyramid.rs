//! Coarser fields of splats: what eight of them come to.

use glam::{DMat3, DVec3};

use super::splats::{columns, own_phase};
use super::{Splat, Splats};
use crate::core::Cancelled;
use crate::core::progress::Ticket;

/// A field of splats, and coarser ones, each of means of 2 × 2 × 2 of the one before.
///
/// As Laur and Hanrahan's pyramid of colours: extinctions are averaged over the whole box, transparent
/// grid points included; colours and directions are weighed by extinction; a splat twice as large then
/// has the depth of those that it stands for. How far directions differ is kept as [`Splat::spread`].
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
    count: f64,
}

impl VectorPyramid {
    /// All levels above a field, down to one splat; `published` as it was classified.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn new(
        finest: Splats,
        published: bool,
        seed: u64,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let mut levels = vec![finest];
        while let Some(finer) = levels.last().filter(|l| l.dims.iter().any(|&n| n > 1)) {
            if ticket.is_cancelled() {
                return Err(Cancelled);
            }
            let level = levels.len() as u32;
            let coarser = halved(finer, published, seed, level);
            levels.push(coarser);
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
        let weight = f64::from(splat.amount);
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
        sum.count += 1.0;
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
        // Boxes at borders have fewer points, but are drawn as large: spread over all eight.
        let amount = match published {
            false => sum.weight / 8.0,
            // Opacities of what shows: a mean over the rest would all but vanish, as nothing is
            // added up along depth.
            true => sum.weight / sum.count,
        };
        let mean = |v: DVec3| (v / sum.weight).as_vec3().to_array();
        let direction = sum.direction / sum.weight;
        let length = direction.length();
        // Opposite directions leave nothing but rounding.
        let agrees = length > 1e-6;
        coarser.list.push(Splat {
            centre: mean(sum.centre),
            amount: amount as f32,
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

impl Splats {
    /// The same without any splat.
    fn clone_frame(&self) -> Self {
        Self { own_axes: Vec::new(), list: Vec::new(), indices: Vec::new(), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{Kernel, RadialKernel};

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

    fn pyramid(finest: Splats) -> VectorPyramid {
        VectorPyramid::new(finest, false, 1, &Ticket::new()).unwrap()
    }

    #[test]
    fn eight_become_one_of_their_weighted_means() {
        let a = splat([0.0; 3], 3.0, [1.0, 0.0, 0.0], 1.0);
        let b = splat([1.0, 0.0, 0.0], 1.0, [0.0, 1.0, 0.0], 0.0);
        let pyramid = pyramid(field([2, 2, 2], vec![(0, a), (1, b)]));
        let [_, top] = pyramid.levels.as_slice() else { panic!("two levels") };
        assert_eq!((top.dims, top.list.len()), ([1; 3], 1));
        let found = top.list[0];
        assert_eq!((found.amount, found.colour[0], found.size), (0.5, 0.75, 2.0));
        assert_eq!(found.centre, [0.25, 0.0, 0.0]);
        let length = 10.0_f32.sqrt() / 4.0;
        assert!((found.direction[0] - 0.75 / length).abs() < 1e-6);
        assert!((found.spread - (1.0 - length)).abs() < 1e-6);
    }

    #[test]
    fn opposite_neighbours_have_no_direction_and_full_spread() {
        let a = splat([0.0; 3], 1.0, [0.0, 0.6, 0.8], 1.0);
        let b = splat([1.0, 0.0, 0.0], 1.0, [0.0, -0.6, -0.8], 1.0);
        let top = pyramid(field([2, 1, 1], vec![(0, a), (1, b)])).levels.remove(1).list[0];
        assert_eq!((top.direction, top.spread), ([0.0; 3], 1.0));
        assert!(top.amount > 0.0);
    }

    #[test]
    fn steps_of_a_curvilinear_grid_are_weighted_means() {
        let a = splat([0.0; 3], 3e-6, [1.0, 0.0, 0.0], 1.0);
        let b = splat([1.0, 0.0, 0.0], 1e-6, [1.0, 0.0, 0.0], 0.0);
        let mut finest = field([2, 1, 1], vec![(0, a), (1, b)]);
        finest.own_axes = vec![columns(DMat3::IDENTITY), columns(DMat3::IDENTITY * 5.0)];
        let found = pyramid(finest).levels.remove(1).axes_of(0);
        assert!(found.abs_diff_eq(DMat3::IDENTITY * 2.0, 1e-6), "{found}");
    }

    #[test]
    fn every_level_holds_the_same_matter() {
        // Matter: extinction times the volume of the kernel, added up.
        let list = (0..5 * 3 * 7).filter(|i| i % 3 != 0).map(|i| {
            let amount = 0.1 + (i % 5) as f32;
            (i as u32, splat([(i % 5) as f32, 0.0, 0.0], amount, [1.0, 0.0, 0.0], 0.5))
        });
        let pyramid = pyramid(field([5, 3, 7], list.collect()));
        let natural = RadialKernel::new(Kernel::Cubic, None).unwrap().radius();
        let matter = |level: &Splats| -> f64 {
            (0..level.list.len())
                .map(|i| f64::from(level.list[i].amount) * level.map_of(i).determinant())
                .sum::<f64>()
                / (level.radius / natural).powi(3)
        };
        let finest = matter(&pyramid.levels[0]);
        assert_eq!(pyramid.levels.last().map(|l| l.dims), Some([1; 3]));
        for level in &pyramid.levels {
            assert!((matter(level) / finest - 1.0).abs() < 1e-5, "{:?}", level.dims);
        }
    }
}

//! Vectors as splats, from their definition: classified, and means of them.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};

use super::marks::hashed;
use crate::kernel::{Kernel, RadialKernel};
use crate::transfer::extinction_from_opacity;
use crate::vector::{ColourBy, VectorMode, VectorSettings};
use crate::volume::cover::REACH;
use crate::volume::{Places, ScalarVolume, VectorField};

/// An axis is at most so many times as long as the second longest.
const MOST_ASPECT: f64 = 2.0;
/// Of splats in which marks have the mapped colour.
const GREY: f64 = 0.2;
/// What marks leave of MODULATE's depths, in the mean over designs and directions.
const MARKED: f64 = 0.24;
/// A mean of directions that is no longer has none.
const NO_FLOW: f64 = 1e-6;

/// A vector or a mean of some, in the world.
pub(super) struct Splat {
    /// Of its vector, or box, in its grid.
    pub(super) index: [usize; 3],
    pub(super) centre: DVec3,
    /// A step of kernel space along each axis, but for extent and stretch.
    pub(super) axes: DMat3,
    /// Mean of unit vectors.
    pub(super) flow: DVec3,
    /// Extinction per world unit where the kernel is 1, or opacity.
    pub(super) amount: f64,
    /// In cycles.
    pub(super) phase: f64,
    /// Linear light: MODULATE's colour or that of BLEND's body, and BLEND's constant colour.
    pub(super) colour: DVec3,
    pub(super) marks: DVec3,
}

/// A field, and all that decides how its splats look.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    pub(super) field: &'a VectorField,
    pub(super) settings: &'a VectorSettings,
    pub(super) scalar: Option<&'a ScalarVolume>,
    pub(super) unit_distance: f64,
    /// Opacities, not extinctions.
    pub(super) published: bool,
}

impl Asked<'_> {
    /// Those with opacity, as often halved as settings say, and how many steps of the grid each is wide.
    pub(super) fn splats(&self) -> (Vec<Splat>, usize) {
        let finest = (0..self.field.vectors.len()).filter_map(|index| self.classified(index));
        let mut splats: Vec<Splat> = finest.collect();
        let (mut dims, mut size) = (self.field.places.dims(), 1);
        let wanted = (self.settings.coarser > 0).then(|| self.columns(&splats, size));
        for level in 1..=self.settings.coarser {
            if dims != [1; 3] {
                (dims, size) = (dims.map(|n| n.div_ceil(2)), 2 * size);
                splats = self.halved(&splats, dims, level);
            }
        }
        if let Some(wanted) = wanted {
            let factor = thinning(&self.columns(&splats, size), &wanted);
            for splat in &mut splats {
                splat.amount = self.amount_of(self.depth_of(splat.amount) * factor);
            }
        }
        for splat in &mut splats {
            let agrees = splat.flow.length() > NO_FLOW;
            splat.flow = if agrees { splat.flow.normalize() } else { DVec3::ZERO };
        }
        (splats, size)
    }

    /// How many times longer or wider than the cubic kernel a splat's is.
    pub(super) fn wider(&self) -> f64 {
        let natural = RadialKernel::new(Kernel::Cubic, None).map_or(1.0, RadialKernel::radius);
        self.settings.radius() / natural
    }

    /// How many times thinner matter is in the volume that it is spread over.
    fn spread_out(&self) -> f64 {
        self.wider().powi(3) * self.settings.stretch
    }

    /// `None` without data or opacity.
    fn classified(&self, index: usize) -> Option<Splat> {
        let vector = self.field.vectors[index].as_dvec3();
        let (centre, steps) = self.field.places.at(index);
        let VectorSettings { transfer, opacity_by, colour_by, .. } = self.settings;
        let by = |by| quantity(by, vector, centre, self.scalar);
        let opacity = transfer.opacity_at(by(*opacity_by));
        if !vector.is_finite() || opacity <= 0.0 {
            return None;
        }
        let (axes, share) = slimmed(steps);
        let extinction = extinction_from_opacity(opacity) / self.unit_distance;
        let amount =
            if self.published { opacity } else { extinction / (self.spread_out() * share) };
        let mapped = DVec3::from(transfer.colour_at(by(*colour_by)).0);
        let chosen = self.settings.marks.map(|c| DVec3::from(c.to_linear().0));
        let (colour, marks) = match (self.settings.mode, chosen) {
            (VectorMode::Blend, None) => (DVec3::splat(GREY), mapped),
            (_, chosen) => (mapped, chosen.unwrap_or_default()),
        };
        let [nx, ny, _] = self.field.places.dims();
        let phase = self.phase(0, index);
        let flow = vector.normalize_or_zero();
        let index = [index % nx, index / nx % ny, index / (nx * ny)];
        Some(Splat { index, centre, axes, flow, amount, phase, colour, marks })
    }

    /// The own phase of a splat by its number in a level.
    fn phase(&self, level: u32, number: usize) -> f64 {
        let seed = self.settings.seed.wrapping_mul(0x2545_f491_4f6c_dd1d);
        hashed(seed ^ u64::from(level) << 58 ^ number as u64)
    }

    /// Means over boxes of 2 × 2 × 2, of which there are `dims`: of depths over all of the box, of the rest
    /// weighed by these.
    fn halved(&self, finer: &[Splat], dims: [usize; 3], level: u32) -> Vec<Splat> {
        let mut boxes = BTreeMap::<usize, Vec<(&Splat, f64)>>::new();
        for splat in finer {
            let [x, y, z] = splat.index.map(|i| i / 2);
            let list = boxes.entry((z * dims[1] + y) * dims[0] + x).or_default();
            list.push((splat, self.depth_of(splat.amount)));
        }
        let of_box = |(number, list): (usize, Vec<(&Splat, f64)>)| {
            let all: f64 = list.iter().map(|(_, depth)| depth).sum();
            let mean = |of: fn(&Splat) -> DVec3| {
                list.iter().map(|(splat, depth)| of(splat) * *depth).sum::<DVec3>() / all
            };
            Splat {
                index: list[0].0.index.map(|i| i / 2),
                centre: mean(|s| s.centre),
                axes: list.iter().map(|(splat, depth)| splat.axes * (depth / all)).sum(),
                flow: mean(|s| s.flow),
                // The opacity of a splat is that of a column: four lie side by side.
                amount: self.amount_of(all / if self.published { 4.0 } else { 8.0 }),
                phase: self.phase(level, number),
                colour: mean(|s| s.colour),
                marks: mean(|s| s.marks),
            }
        };
        boxes.into_iter().map(of_box).collect()
    }

    /// What adds up along a ray. Opacities are spread over a box, in which each has its part.
    fn depth_of(&self, amount: f64) -> f64 {
        let part = f64::from(REACH).powi(-2);
        if self.published { extinction_from_opacity(amount * part) / part } else { amount }
    }

    fn amount_of(&self, depth: f64) -> f64 {
        let part = f64::from(REACH).powi(-2);
        if self.published { (-(-depth * part).exp_m1() / part).min(1.0) } else { depth }
    }

    /// Depths of all columns of cells of the grid along each of its axes, where splats that are `size` cells
    /// wide are boxes that reach as far as their kernels.
    fn columns(&self, splats: &[Splat], size: usize) -> Vec<f64> {
        let (size, marked) = (size as f64, self.settings.mode == VectorMode::Modulate);
        let width = size * f64::from(REACH) * self.wider();
        let mut cells = BTreeMap::<[i64; 3], f64>::new();
        for (axis, splat) in (0..3).flat_map(|axis| splats.iter().map(move |s| (axis, s))) {
            let length = splat.axes.col(axis).length() * size * self.spread_out();
            let depth = self.depth_of(splat.amount) * if self.published { 1.0 } else { length };
            let depth = depth * if marked { MARKED } else { 1.0 } * (size / width).powi(2);
            let [us, vs] = [1, 2].map(|beside| {
                let middle = (splat.index[(axis + beside) % 3] as f64 + 0.5) * size;
                let (low, high) = (middle - width / 2.0, middle + width / 2.0);
                let part = move |n: i64| high.min(n as f64 + 1.0) - low.max(n as f64);
                (low.floor() as i64..high.ceil() as i64).map(move |n| (n, part(n)))
            });
            for (u, part) in us {
                for (v, other) in vs.clone() {
                    *cells.entry([axis as i64, u, v]).or_default() += depth * part * other;
                }
            }
        }
        cells.into_values().collect()
    }
}

/// What depths of columns are multiplied by, 1 at most, to hide as much together as others.
fn thinning(depths: &[f64], others: &[f64]) -> f64 {
    let hidden = |depths: &[f64], factor: f64| -> f64 {
        depths.iter().map(|depth| -(-depth * factor).exp_m1()).sum()
    };
    let wanted = hidden(others, 1.0);
    if hidden(depths, 1.0) <= wanted {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        *(if hidden(depths, middle) > wanted { &mut high } else { &mut low }) = middle;
    }
    high
}

/// What a colour or an opacity is looked up by, of a vector at a place.
pub(super) fn quantity(
    by: ColourBy,
    vector: DVec3,
    place: DVec3,
    scalar: Option<&ScalarVolume>,
) -> f64 {
    match by {
        ColourBy::Magnitude => vector.length(),
        ColourBy::X => place.x,
        ColourBy::Y => place.y,
        ColourBy::Z => place.z,
        ColourBy::Scalar => scalar.map_or(f64::NAN, |scalar| scalar.value_at(place)),
    }
}

/// Steps of a grid as the axes of a splat, of which the longest may be too long, and to which part of it.
pub(super) fn slimmed(steps: DMat3) -> (DMat3, f64) {
    let lengths = [steps.x_axis, steps.y_axis, steps.z_axis].map(DVec3::length);
    let mut sorted = lengths;
    sorted.sort_by(f64::total_cmp);
    let [_, second, longest] = sorted;
    let part = MOST_ASPECT * second / longest;
    if !(part > 0.0 && part < 1.0) {
        return (steps, 1.0);
    }
    let part_of = |length: f64| if length < longest { 1.0 } else { part };
    (steps * DMat3::from_diagonal(DVec3::from(lengths.map(part_of))), part)
}

/// World length of a step of a grid: the shortest, or the mean of these.
pub(super) fn step(places: &Places) -> f64 {
    let shortest = |m: &DMat3| m.x_axis.length().min(m.y_axis.length()).min(m.z_axis.length());
    let mean = match places {
        Places::Lattice(lattice) => shortest(&lattice.axes()),
        Places::Points { axes, .. } => axes.iter().map(shortest).sum::<f64>() / axes.len() as f64,
    };
    if mean > 0.0 { mean } else { 1.0 }
}

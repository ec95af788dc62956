//! The modes that draw in layers: every sample, sheets, slabs.

use super::classes::Classes;
use super::field::{Basis, Field};
use super::inside::{Layer, Part, Slice};
use super::quadrature::{self, Density};
use super::shading::RayShader;
use super::sources::{Along, GridKernels, Hit, Line};
use super::truth::separable_cells;
use crate::kernel::RadialKernel;
use crate::scene::{Classify, OpacityModel, Order};

/// A layer's opacity and colour, from its summed densities × length.
fn shade(model: OpacityModel, sum: Density) -> (f64, [f64; 3]) {
    let alpha = match model {
        OpacityModel::OpticalDepth => -(-sum[0]).exp_m1(),
        OpacityModel::Published => sum[0].min(1.0),
    };
    let share = if sum[0] > 0.0 { 1.0 / sum[0] } else { 0.0 };
    (alpha, [sum[1] * share, sum[2] * share, sum[3] * share])
}

/// Layers given from front to back, laid over one another in either order.
pub(super) fn composite(layers: &[Layer], model: OpacityModel, order: Order) -> [f64; 4] {
    let mut pixel = [0.0; 4];
    let shaded = |layer: Layer| match layer {
        Layer::Matter(sum) => shade(model, sum),
        Layer::Surface(surface) => (surface.opacity, surface.colour),
    };
    match order {
        Order::FrontToBack => {
            for &layer in layers {
                let (alpha, [r, g, b]) = shaded(layer);
                let left = 1.0 - pixel[3];
                for (p, c) in pixel.iter_mut().zip([r, g, b, 1.0]) {
                    *p += left * alpha * c;
                }
            }
        }
        Order::BackToFront => {
            for &layer in layers.iter().rev() {
                let (alpha, [r, g, b]) = shaded(layer);
                for (p, c) in pixel.iter_mut().zip([r, g, b, 1.0]) {
                    *p = alpha * c + (1.0 - alpha) * *p;
                }
            }
        }
    }
    pixel
}

fn add(to: &mut Density, weight: Density, length: f64) {
    to.iter_mut().zip(weight).for_each(|(t, w)| *t += w * length);
}

/// A layer that is no slice, and how many slices of the traversal are farther.
pub(super) type Seated = (Layer, usize);

/// Matter of slices, from front to back, and others each before the slices that are farther.
fn seated(matter: impl IntoIterator<Item = (usize, Density)>, others: &[Seated]) -> Vec<Layer> {
    let mut layers = Vec::new();
    let mut next = others.iter().peekable();
    for (slice, sum) in matter {
        while let Some((other, _)) = next.next_if(|(_, farther)| slice < *farther) {
            layers.push(*other);
        }
        layers.push(Layer::Matter(sum));
    }
    layers.extend(next.map(|(other, _)| *other));
    layers
}

/// Each kernel for itself, from front to back, and others among them.
pub(super) fn every_sample(
    mut hits: Vec<Hit>,
    shape: Option<RadialKernel>,
    from: f64,
    others: &[Seated],
) -> Vec<Layer> {
    hits.sort_by_key(|hit| std::cmp::Reverse(hit.rank));
    let whole = [from, f64::INFINITY];
    let sum = |hit: &Hit| (hit.slice, hit.weight.map(|w| w * hit.length(shape, whole)));
    seated(hits.iter().map(sum), others)
}

/// Kernels summed up in the slice they are centred on, from front to back, and others among them.
pub(super) fn slices(
    hits: &[Hit],
    shape: Option<RadialKernel>,
    from: f64,
    others: &[Seated],
) -> Vec<Layer> {
    let count = hits.iter().map(|hit| hit.slice + 1).max().unwrap_or(0);
    let mut layers = vec![[0.0; 4]; count];
    for hit in hits {
        let length = hit.length(shape, [from, f64::INFINITY]);
        add(&mut layers[hit.slice], hit.weight, length);
    }
    seated(layers.into_iter().enumerate().rev(), others)
}

/// Planes that a ray crosses at even distances.
#[derive(Debug, Clone, Copy)]
pub(super) struct Planes {
    /// Where it crosses the one through the lattice's centre.
    pub(super) centre: f64,
    /// World length between two along the ray, > 0; infinite where it crosses none.
    pub(super) step: f64,
}

impl Planes {
    pub(super) fn layer_of(&self, t: f64) -> i64 {
        if self.step.is_finite() { ((t - self.centre) / self.step).floor() as i64 } else { 0 }
    }

    pub(super) fn face(&self, layer: i64) -> f64 {
        if self.step.is_finite() {
            self.centre + layer as f64 * self.step
        } else if layer > 0 {
            f64::INFINITY
        } else {
            f64::NEG_INFINITY
        }
    }

    /// What is as dense everywhere between two planes, as far as the ray has begun there.
    fn slice(&self, slab: i64, sum: Density, from: f64) -> Slice {
        let ends = [self.face(slab).max(from), self.face(slab + 1)];
        let ends = if self.step.is_finite() { ends } else { [-1e12, 1e12] };
        Slice { slab, ends, density: sum.map(|w| w / (ends[1] - ends[0])) }
    }
}

/// Sums by the number of the layer.
struct Sums {
    first: i64,
    sums: Vec<Density>,
}

impl Sums {
    fn over(planes: &Planes, [a, b]: [f64; 2]) -> Self {
        let (first, last) = (planes.layer_of(a), planes.layer_of(b));
        Self { first, sums: vec![[0.0; 4]; (last - first + 1).max(0) as usize] }
    }

    fn at(&mut self, layer: i64) -> &mut Density {
        &mut self.sums[(layer - self.first) as usize]
    }
}

/// Each kernel's integrals between the planes, from front to back, as matter that is as dense everywhere
/// between two of them.
pub(super) fn between_planes(
    hits: &[Hit],
    shape: Option<RadialKernel>,
    planes: &Planes,
    from: f64,
) -> Vec<Slice> {
    let spans: Vec<_> = hits.iter().map(|hit| hit.span(shape)).collect();
    let ends = spans
        .iter()
        .flatten()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], s| [a.min(s[0]), b.max(s[1])]);
    let ends = [ends[0].max(from), ends[1]];
    if ends[0] > ends[1] {
        return Vec::new();
    }
    let mut sums = Sums::over(planes, ends);
    for (hit, span) in hits.iter().zip(spans) {
        let Some([a, b]) = span else { continue };
        let a = a.max(from);
        if a > b {
            continue;
        }
        for layer in planes.layer_of(a)..=planes.layer_of(b) {
            let length = match hit.along {
                // Whole, wherever rounding puts the faces.
                Along::Point { length, .. } => length,
                Along::Through { .. } => {
                    hit.length(shape, [planes.face(layer).max(from), planes.face(layer + 1)])
                }
            };
            add(sums.at(layer), hit.weight, length);
        }
    }
    let first = sums.first;
    (first..).zip(sums.sums).map(|(slab, sum)| planes.slice(slab, sum, from)).collect()
}

/// The same for separable kernels: the densities' integrals over each slab.
pub(super) fn separable_between_planes(
    grid: &GridKernels,
    product: (Basis, f64),
    ray: &Line,
    planes: &Planes,
) -> Vec<Slice> {
    let mut layers: Vec<(i64, Density)> = Vec::new();
    separable_cells(grid, product, ray, |a, b, density| {
        for layer in planes.layer_of(a)..=planes.layer_of(b) {
            let (low, high) = (a.max(planes.face(layer)), b.min(planes.face(layer + 1)));
            if high <= low {
                continue;
            }
            let part = quadrature::sum(low, high, density);
            match layers.last_mut() {
                Some((last, sum)) if *last == layer => add(sum, part, 1.0),
                _ => layers.push((layer, part)),
            }
        }
        true
    });
    layers.into_iter().map(|(slab, sum)| planes.slice(slab, sum, ray.from)).collect()
}

/// Slabs of reconstructed values, clipped to a part of the ray, from front to back: the value in
/// the middle of each, the mean of its values, or all values between its faces, along a parabola: a
/// layer for each half. Each with the number of its slab.
pub(super) fn classified(
    field: &Field,
    classes: &Classes,
    planes: &Planes,
    classify: Classify,
    model: OpacityModel,
    ray: RayShader<'_>,
    part: &Part,
) -> Vec<Slice> {
    let ([a, b], line) = (part.ends, ray.index);
    let pre_integrated = classify == Classify::PreIntegrated;
    let faces: Vec<f64> = (planes.layer_of(a)..=planes.layer_of(b) + 1)
        .map(|layer| planes.face(layer).clamp(a, b))
        .collect();
    let values: Vec<_> = if pre_integrated {
        faces.iter().map(|&t| field.value(line.at(t))).collect()
    } else {
        Vec::new()
    };
    let borders = borders(field, line, &faces, &values);
    let mut pieces = Vec::new();
    let first = planes.layer_of(a);
    for (i, pair) in faces.windows(2).enumerate() {
        let slab = first + i as i64;
        let [low, high] = [pair[0], pair[1]];
        let t = f64::midpoint(low, high);
        let middle = line.at(t);
        if high <= low {
            continue;
        }
        if field.is_hole(middle) {
            let density = classes.at(f64::NAN);
            if density[0] > 0.0 {
                pieces.push(Slice { slab, ends: [low, high], density });
            }
            continue;
        }
        if !pre_integrated {
            let shaded = |v| ray.shaded(classes.at(v), t, v);
            let value = match classify {
                Classify::Mean => mean(field, line, [low, high]),
                _ => field.value(middle),
            };
            pieces.extend(value.map(|v| Slice { slab, ends: [low, high], density: shaded(v) }));
            continue;
        }
        let known = [values[i].map(|_| low), values[i + 1].map(|_| high)];
        let (near, far, [low, high]) = match (values[i], values[i + 1], borders.get(i)) {
            (Some(near), Some(far), _) => (near, far, [low, high]),
            (near, far, Some(Some([first, last]))) => {
                let (low, near) = near.map_or(*first, |near| (low, near));
                let (high, far) = far.map_or(*last, |far| (high, far));
                (near, far, [low, high])
            }
            _ => continue,
        };
        let t = f64::midpoint(low, high);
        let bend = if field.cells.is_none() { bend(&faces, &values, i, planes.step) } else { 0.0 };
        let value = f64::midpoint(near, far);
        let half = value + 1.5 * bend;
        // Each half along the straight line that has the parabola's mean.
        let half_slab = |from, to| {
            let mean = classes.mean(from + bend / 4.0, to + bend / 4.0);
            let inwards = INWARDS * (high - low);
            // By the two ends of what is left of the slab.
            let [near, far] = known;
            let ends = [near.unwrap_or(low + inwards), far.unwrap_or(high - inwards)];
            ray.shaded_by(mean, t, value, ends)
        };
        let (near, far) = (half_slab(near, half), half_slab(half, far));
        if model == OpacityModel::Published {
            // Opacities are given to slabs.
            let density = std::array::from_fn(|c| f64::midpoint(near[c], far[c]));
            pieces.push(Slice { slab, ends: [low, high], density });
        } else {
            pieces.push(Slice { slab, ends: [low, t], density: near });
            pieces.push(Slice { slab, ends: [t, high], density: far });
        }
    }
    pieces
}

/// Where a slab ends at the border of cells, the gradient is taken this share of its length inside them, so that rounding
/// leaves the place within a cell.
const INWARDS: f64 = 1e-6;

/// A place of a ray, and the value there.
type Border = (f64, f64);

/// Of what has borders, where a ray enters it first and leaves it last in each slab of which a face lies outside.
fn borders(
    field: &Field,
    line: &Line,
    faces: &[f64],
    values: &[Option<f64>],
) -> Vec<Option<[Border; 2]>> {
    if !field.has_borders {
        return Vec::new();
    }
    let of = |(ends, known): (&[f64], &[Option<f64>])| {
        let ends = [ends[0], ends[1]];
        if ends[0] >= ends[1] || known.iter().all(Option::is_some) {
            return None;
        }
        let mut cuts = field.crossings(line, ends);
        cuts.extend(ends);
        cuts.sort_by(f64::total_cmp);
        let is_inside = |pair: &&[f64]| {
            pair[1] > pair[0] && field.value(line.at(f64::midpoint(pair[0], pair[1]))).is_some()
        };
        let first = cuts.windows(2).find(is_inside)?;
        let last = cuts.windows(2).rev().find(is_inside)?;
        // From within, where no rounding leaves it.
        let value = |at: f64, inwards: f64| {
            let steps = [0.0, 1e-9, 1e-6, 1e-3, 0.1];
            let mut places = steps.iter().map(|step| at + step * inwards);
            places.find_map(|t| field.value(line.at(t)))
        };
        let near = value(first[0], first[1] - first[0])?;
        let far = value(last[1], last[0] - last[1])?;
        Some([(first[0], near), (last[1], far)])
    };
    faces.windows(2).zip(values.windows(2)).map(of).collect()
}

/// The mean of the values on a part of a ray, by quadrature.
fn mean(field: &Field, line: &Line, [low, high]: [f64; 2]) -> Option<f64> {
    const PANELS: u32 = 4;
    let half = (high - low) / f64::from(2 * PANELS);
    let mut sum = 0.0;
    for panel in 0..PANELS {
        let middle = low + half * f64::from(2 * panel + 1);
        for (x, weight) in quadrature::GAUSS {
            sum += weight * field.value(line.at(middle + half * x))?;
        }
    }
    Some(sum / f64::from(2 * PANELS))
}

/// What the mean value of slab `i` differs by from the mean of its two faces: that of the cubic
/// through the two and the next on either side, (v₀ + v₁ − v₋₁ − v₂)/24. 0 where one of these is
/// missing or one of the three slabs is clipped: a parabola through three faces was tried there, and
/// is worse, because a mirrored lattice bends too abruptly at its border.
fn bend(faces: &[f64], values: &[Option<f64>], i: usize, step: f64) -> f64 {
    let four = || {
        let before = i.checked_sub(1)?;
        let whole = faces.get(i + 2)? - faces[before] >= 2.99 * step;
        let [v0, v1, v2, v3] = [values[before]?, values[i]?, values[i + 1]?, values[i + 2]?];
        whole.then_some((v1 + v2 - v0 - v3) / 24.0)
    };
    four().unwrap_or(0.0)
}

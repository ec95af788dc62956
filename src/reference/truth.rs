//! The continuous integral ∫ q·exp(−∫κ) along a ray.

use glam::DVec3;

use super::cells::Cells;
use super::classes::Classes;
use super::field::{Basis, Field, Shape, tensor};
use super::inside::{Part, Surface};
use super::polynomial::Piece;
use super::quadrature::{Density, Light};
use super::shading::RayShader;
use super::sources::{Along, GridKernels, Hit, Line, indices_near, nearest};
use super::vectors::{OnRay, density_of};
use crate::kernel::RadialKernel;

/// Degree of the polynomials that stand for values between the rims of radial kernels.
const RADIAL_DEGREE: usize = 5;
/// How far those may be from the values, as a part of the values' size.
const RADIAL_ERROR: f64 = 1e-11;

/// A radial kernel, or a box, along a ray.
struct Along1<T> {
    enter: f64,
    leave: f64,
    /// Where the ray is nearest to the centre, and the square of how near.
    middle: f64,
    near2: f64,
    /// Square of kernel-space length per t.
    speed2: f64,
    weight: T,
}

impl<T> Along1<T> {
    fn value(&self, shape: Option<RadialKernel>, t: f64) -> f64 {
        let along = t - self.middle;
        shape.map_or(1.0, |k| k.value((self.near2 + along * along * self.speed2).sqrt()))
    }
}

/// Kernels that lie along a ray, and every place where one of them begins, ends or bends.
struct Sweep<T> {
    kernels: Vec<Along1<T>>,
    places: Vec<f64>,
}

impl<T> Sweep<T> {
    fn new() -> Self {
        Self { kernels: Vec::new(), places: Vec::new() }
    }

    fn push(&mut self, start: DVec3, step: DVec3, shape: Option<RadialKernel>, weight: T) {
        let hit =
            Hit { along: Along::Through { start, step }, weight: [0.0; 4], rank: 0, slice: 0 };
        let Some([enter, leave]) = hit.span(shape) else { return };
        let (middle, near) = nearest(start, step);
        let speed2 = step.length_squared();
        self.places.extend([enter, leave]);
        if let Some(knot) = shape.and_then(RadialKernel::knot)
            && near < knot
        {
            let half = ((knot - near) * (knot + near) / speed2).sqrt();
            self.places.extend([middle - half, middle + half]);
        }
        self.kernels.push(Along1 { enter, leave, middle, near2: near * near, speed2, weight });
    }

    /// Calls `visit` for each smooth part of a..b, from the eye inwards, with the kernels there.
    /// `visit` returns whether to go on.
    fn run(mut self, [a, b]: [f64; 2], mut visit: impl FnMut(f64, f64, &[&Along1<T>]) -> bool) {
        self.kernels.sort_by(|p, q| p.enter.total_cmp(&q.enter));
        let mut places = self.places;
        places.retain(|t| *t > a && *t < b);
        places.push(b);
        places.sort_by(f64::total_cmp);
        let (mut next, mut active, mut from) = (0, Vec::<&Along1<T>>::new(), a);
        for to in places {
            if to <= from {
                continue;
            }
            let middle = f64::midpoint(from, to);
            while let Some(kernel) = self.kernels.get(next).filter(|k| k.enter < middle) {
                active.push(kernel);
                next += 1;
            }
            active.retain(|k| k.leave > middle);
            if !active.is_empty() && !visit(from, to, &active) {
                return;
            }
            from = to;
        }
    }
}

/// Surfaces that are still to come, from the eye inwards.
pub(super) struct Surfaces<'a>(pub(super) &'a [Surface]);

impl Surfaces<'_> {
    /// Lays down those before a place.
    pub(super) fn lay_until(&mut self, light: &mut Light, t: f64) {
        while let [first, rest @ ..] = self.0
            && first.t < t
        {
            light.cover(first.opacity, first.colour);
            self.0 = rest;
        }
    }

    /// Adds matter between two places, and the surfaces before and in it.
    pub(super) fn add(
        &mut self,
        light: &mut Light,
        mut a: f64,
        b: f64,
        density: &impl Fn(f64) -> Density,
    ) {
        self.lay_until(light, a);
        while let Some(first) = self.0.first().filter(|first| first.t < b) {
            let t = first.t;
            light.add(a, t, density);
            self.lay_until(light, t.next_up());
            a = t;
        }
        light.add(a, b, density);
    }
}

/// Kernels shaded first, and surfaces among them; boxes where there is no `shape`.
pub(super) fn shade_first(
    hits: &[Hit],
    shape: Option<RadialKernel>,
    from: f64,
    tolerance: f64,
    surfaces: &[Surface],
) -> [f64; 4] {
    let mut sweep = Sweep::new();
    let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
    for hit in hits {
        if let (Along::Through { start, step }, Some([enter, leave])) = (hit.along, hit.span(shape))
        {
            sweep.push(start, step, shape, hit.weight);
            (first, last) = (first.min(enter), last.max(leave));
        }
    }
    first = first.max(from);
    let mut surfaces = Surfaces(surfaces);
    let mut light = Light::new(tolerance, if first < last { last - first } else { 1.0 });
    sweep.run([first, last], |a, b, active| {
        surfaces.add(&mut light, a, b, &|t| {
            let mut density = [0.0; 4];
            for kernel in active {
                let h = kernel.value(shape, t);
                density.iter_mut().zip(kernel.weight).for_each(|(d, w)| *d += h * w);
            }
            density
        });
        !light.is_opaque()
    });
    surfaces.lay_until(&mut light, f64::INFINITY);
    light.pixel()
}

/// The parts of a ray between integer planes, with the densities of the kernels that reach each:
/// `visit` gets its ends and the density at any t in it, and returns whether to go on.
pub(super) fn separable_cells(
    grid: &GridKernels,
    (basis, scale): (Basis, f64),
    ray: &Line,
    mut visit: impl FnMut(f64, f64, &dyn Fn(f64) -> Density) -> bool,
) {
    if scale != 1.0 {
        return scaled_cells(grid, (basis, scale), ray, visit);
    }
    let line = grid.line(ray);
    let reach = basis.reach();
    let dims = grid.lattice.dims;
    let high = DVec3::from(dims.map(|n| n as f64)) - 1.0 + reach;
    let Some([a, b]) = line.inside(DVec3::splat(-reach), high) else { return };
    let mut cuts = vec![a, b];
    for (axis, count) in dims.into_iter().enumerate() {
        let planes = (-2..count as i64 + 2).map(|i| i as f64);
        cuts.extend(line.crossings(axis, planes, [a, b]));
    }
    cuts.sort_by(f64::total_cmp);
    for pair in cuts.windows(2).filter(|w| w[1] > w[0]) {
        let cell = line.at(f64::midpoint(pair[0], pair[1])).floor();
        let base = cell.to_array().map(|c| c as i64 - 1);
        let mut blocks = [[0.0; 64]; 4];
        for i in 0..64 {
            let step = [i & 3, i >> 2 & 3, i >> 4].map(|s| s as i64);
            let density = grid.density_at(std::array::from_fn(|a| base[a] + step[a]));
            blocks.iter_mut().zip(density).for_each(|(block, d)| block[i] = d);
        }
        if blocks[0].iter().all(|w| *w <= 0.0) {
            continue;
        }
        let density = |t: f64| {
            let fraction = line.at(t) - cell;
            [0, 1, 2, 3].map(|c| tensor(basis, &blocks[c], fraction))
        };
        if !visit(pair[0], pair[1], &density) {
            return;
        }
    }
}

/// The same of kernels so many times wider than natural: h(x/s)/s along each axis, between the places where any of
/// them begins, ends, or passes from one of its pieces to the next.
fn scaled_cells(
    grid: &GridKernels,
    (basis, scale): (Basis, f64),
    ray: &Line,
    mut visit: impl FnMut(f64, f64, &dyn Fn(f64) -> Density) -> bool,
) {
    let line = grid.line(ray);
    let reach = scale * basis.reach();
    let dims = grid.lattice.dims;
    let high = DVec3::from(dims.map(|n| n as f64)) - 1.0 + reach;
    let Some([a, b]) = line.inside(DVec3::splat(-reach), high) else { return };
    let mut cuts = vec![a, b];
    for (axis, count) in dims.into_iter().enumerate() {
        for knot in -(basis.reach() as i64)..=basis.reach() as i64 {
            let planes = (0..count as i64).map(|i| i as f64 + knot as f64 * scale);
            cuts.extend(line.crossings(axis, planes, [a, b]));
        }
    }
    cuts.sort_by(f64::total_cmp);
    for pair in cuts.windows(2).filter(|w| w[1] > w[0]) {
        let middle = line.at(f64::midpoint(pair[0], pair[1]));
        let spans: [_; 3] = std::array::from_fn(|a| {
            (middle[a] - reach).ceil() as i64..=(middle[a] + reach).floor() as i64
        });
        let mut densities = Vec::new();
        for z in spans[2].clone() {
            for y in spans[1].clone() {
                densities.extend(spans[0].clone().map(|x| grid.density_at([x, y, z])));
            }
        }
        if densities.iter().all(|density| density[0] <= 0.0) {
            continue;
        }
        let density = |t: f64| {
            let place = line.at(t);
            let [wx, wy, wz]: [Vec<f64>; 3] = std::array::from_fn(|a| {
                let of = |i: i64| basis.scaled(place[a] - i as f64, scale) / scale;
                spans[a].clone().map(of).collect()
            });
            let mut sum = [0.0; 4];
            let mut next = densities.iter();
            for z in &wz {
                for y in &wy {
                    for x in &wx {
                        let Some(density) = next.next() else { break };
                        sum.iter_mut().zip(density).for_each(|(s, d)| *s += d * (x * y * z));
                    }
                }
            }
            sum
        };
        if !visit(pair[0], pair[1], &density) {
            return;
        }
    }
}

/// The box in which a lattice's values are defined, along a ray.
pub(super) fn domain(dims: [usize; 3], line: &Line) -> Option<[f64; 2]> {
    let high = DVec3::from(dims.map(|n| n as f64)) - 0.5;
    line.inside(DVec3::splat(-0.5), high)
}

/// Values reconstructed, then classified, on a part of the ray. `visible` tells which of the field's bricks may show.
pub(super) fn after(
    field: &Field,
    classes: &Classes,
    visible: &[bool],
    ray: RayShader<'_>,
    part: &Part,
    tolerance: f64,
) -> [f64; 4] {
    let [a, b] = part.ends;
    let mut light = Light::new(tolerance, b - a);
    let mut from = a;
    for surface in &part.surfaces {
        // Polygons may lie before the part, or behind it.
        let to = surface.t.clamp(a, b);
        if to > from {
            gather(field, classes, visible, ray, [from, to], &mut light);
        }
        light.cover(surface.opacity, surface.colour);
        from = to;
    }
    if b > from {
        gather(field, classes, visible, ray, [from, b], &mut light);
    }
    light.pixel()
}

/// The same among splats of vectors, nearest first, and without any field where there is none: what
/// ever thinner slabs of both converge to. Both lie where they are along the ray.
pub(super) fn among_vectors(
    matter: Option<(&Field, &Classes, &[bool], RayShader<'_>)>,
    part: &Part,
    splats: &[OnRay],
    tolerance: f64,
) -> [f64; 4] {
    let [a, b] = part.ends;
    let mut places = vec![a, b];
    places.extend(splats.iter().flat_map(OnRay::places));
    places.extend(part.surfaces.iter().map(|surface| surface.t));
    places.sort_by(f64::total_cmp);
    let mut light = Light::new(tolerance, places[places.len() - 1] - places[0]);
    let mut surfaces = Surfaces(&part.surfaces);
    let (mut next, mut active) = (0, Vec::<&OnRay>::new());
    for pair in places.windows(2).filter(|w| w[1] > w[0]) {
        let (from, to) = (pair[0], pair[1]);
        surfaces.lay_until(&mut light, from.next_up());
        if light.is_opaque() {
            break;
        }
        let middle = f64::midpoint(from, to);
        while let Some(splat) = splats.get(next).filter(|splat| splat.enter < middle) {
            active.push(splat);
            next += 1;
        }
        active.retain(|splat| splat.leave > middle);
        match matter.filter(|_| a < middle && middle < b) {
            Some((field, classes, visible, ray)) => {
                let ray = RayShader { beside: &active, ..ray };
                gather(field, classes, visible, ray, [from, to], &mut light);
            }
            None if active.is_empty() => {}
            None => light.add(from, to, &|t| density_of(&active, t)),
        }
    }
    surfaces.lay_until(&mut light, f64::INFINITY);
    light.pixel()
}

/// The part a..b of a ray, which lies in the field's domain and meets no surface.
pub(super) fn gather(
    field: &Field,
    classes: &Classes,
    visible: &[bool],
    ray: RayShader<'_>,
    [a, b]: [f64; 2],
    light: &mut Light,
) {
    let line = ray.index;
    let mut cuts = vec![a, b];
    for axis in 0..3 {
        cuts.extend(line.crossings(axis, field.brick_faces(axis), [a, b]));
    }
    cuts.sort_by(f64::total_cmp);
    let mut from = None;
    for pair in cuts.windows(2) {
        let brick = field.brick_of(line.at(f64::midpoint(pair[0], pair[1])));
        let seen = visible[brick] || !ray.beside.is_empty();
        if seen {
            from.get_or_insert(pair[0]);
        }
        if let Some(start) = from.take_if(|_| !seen) {
            visible_part(field, classes, ray, [start, pair[0]], light);
        }
    }
    if let Some(start) = from {
        visible_part(field, classes, ray, [start, b], light);
    }
}

/// One part of the ray, all of it in bricks that may show.
fn visible_part(
    field: &Field,
    classes: &Classes,
    ray: RayShader<'_>,
    [a, b]: [f64; 2],
    light: &mut Light,
) {
    let line = ray.index;
    let mut cuts = vec![a, b];
    let is_narrow = |shape| matches!(shape, Shape::Scaled(basis, s) if s * basis.reach() <= 0.5);
    let halves = field.has_holes() || field.shape == Shape::Nearest || is_narrow(field.shape);
    for axis in 0..3 {
        let count = field.dims[axis] as i64;
        if let Shape::Separable(_) | Shape::Functions(_) | Shape::Ellipsoids = field.shape {
            cuts.extend(line.crossings(axis, (0..count).map(|i| i as f64), [a, b]));
        }
        if let Shape::Scaled(basis, scale) = field.shape {
            // Where a kernel of a sample on the ray's way begins, ends, or passes from a piece to the next.
            let margin = (scale * basis.reach()).ceil() as i64 + 1;
            let reach = basis.reach() as i64;
            for knot in (-reach..=reach).map(|k| k as f64 * scale) {
                let places = (-margin..count + margin).map(|i| i as f64 + knot);
                cuts.extend(line.crossings(axis, places, [a, b]));
            }
        }
        if halves {
            cuts.extend(line.crossings(axis, (0..count).map(|i| i as f64 + 0.5), [a, b]));
        }
    }
    if let Some(cells) = &field.cells {
        cuts.extend(cells.crossings(line, [a, b]));
        cuts.sort_by(f64::total_cmp);
        return along_cells(cells, classes, ray, &cuts, light);
    }
    cuts.extend(field.crossings(line, [a, b]));
    cuts.sort_by(f64::total_cmp);
    if let Shape::Radial(kernel) = field.shape {
        for pair in cuts.windows(2).filter(|w| w[1] > w[0]) {
            if field.is_hole(line.at(f64::midpoint(pair[0], pair[1]))) {
                without_data(classes, ray, [pair[0], pair[1]], light);
            } else {
                radial(field, kernel, classes, ray, [pair[0], pair[1]], light);
            }
        }
        return;
    }
    for pair in cuts.windows(2).filter(|w| w[1] > w[0]) {
        let (a, b) = (pair[0], pair[1]);
        let middle = line.at(f64::midpoint(a, b));
        if light.is_opaque() {
            return;
        }
        if field.is_hole(middle) {
            without_data(classes, ray, [a, b], light);
            continue;
        }
        if field.has_borders && field.value(middle).is_none() {
            continue;
        }
        if let Shape::Scaled(..) | Shape::Functions(_) | Shape::Ellipsoids = field.shape {
            let value = |t: f64| field.value(line.at(t)).unwrap_or(f64::NAN);
            smooth(a, b, &value, classes, ray, light, 10);
            continue;
        }
        let piece = match field.shape {
            Shape::Separable(basis) => {
                let cell = middle.floor();
                let block = field.block(cell.to_array().map(|c| c as i64));
                Piece::through(a, b, basis.degree(), |t| tensor(basis, &block, line.at(t) - cell))
            }
            _ => {
                let value = field.value(middle).unwrap_or(f64::NAN);
                Piece::through(a, b, 0, |_| value)
            }
        };
        shine(&piece, classes, ray, light);
    }
}

/// Adds the light of cells, between places where a ray passes from one to another.
fn along_cells(
    cells: &Cells,
    classes: &Classes,
    ray: RayShader<'_>,
    cuts: &[f64],
    light: &mut Light,
) {
    let line = ray.index;
    for pair in cuts.windows(2).filter(|w| w[1] > w[0]) {
        let (a, b) = (pair[0], pair[1]);
        if light.is_opaque() {
            return;
        }
        let Some((solid, _)) = cells.find(line.at(f64::midpoint(a, b))) else {
            if !ray.beside.is_empty() {
                light.add(a, b, &|t| ray.among([0.0; 4], t));
            }
            continue;
        };
        let value = |t: f64| cells.value_in(solid, line.at(t)).unwrap_or(f64::NAN);
        // From within, where no rounding leaves the cell.
        let (mut low, mut high) = (a, b);
        if value(a).is_nan() || value(b).is_nan() {
            let inset = 1e-3 * (b - a);
            (low, high) = (a + inset, b - inset);
        }
        match cells.degree(solid) {
            Some(degree) => {
                let ends = [value(low), value(high)];
                let at = |t: f64| ends[0] + (ends[1] - ends[0]) * (t - low) / (high - low);
                shine(&Piece::through(a, b, degree, at), classes, ray, light);
            }
            None => {
                let inside = |t: f64| value(t.clamp(low, high));
                smooth(a, b, &inside, classes, ray, light, 10);
            }
        }
    }
}

/// Adds the light of samples without data: of one density, which no light falls on.
fn without_data(classes: &Classes, ray: RayShader<'_>, [a, b]: [f64; 2], light: &mut Light) {
    let density = classes.at(f64::NAN);
    if density[0] > 0.0 || !ray.beside.is_empty() {
        light.add(a, b, &|t| ray.among(density, t));
    }
}

/// Adds the light of a value that is a polynomial of t.
fn shine(piece: &Piece, classes: &Classes, ray: RayShader<'_>, light: &mut Light) {
    let [low, high] = piece.range();
    if classes.is_clear(low, high) && ray.beside.is_empty() {
        return;
    }
    let mut cuts = vec![piece.a];
    piece.crossings(&|low, high| classes.splits_within(low, high), &mut cuts);
    cuts.push(piece.b);
    for pair in cuts.windows(2) {
        light.add(pair[0], pair[1], &|t| {
            let value = piece.at(t);
            ray.among(ray.shaded(classes.at(value), t, value), t)
        });
    }
}

/// Σ cᵢ hᵢ / Σ hᵢ along a part of the ray, between the rims and knots of all its kernels.
fn radial(
    field: &Field,
    kernel: RadialKernel,
    classes: &Classes,
    ray: RayShader<'_>,
    part: [f64; 2],
    light: &mut Light,
) {
    let line = ray.index;
    let margin = kernel.radius().ceil() as i64 + 1;
    let high = field.dims.map(|n| n as i64 - 1 + margin);
    let mut sweep = Sweep::new();
    indices_near(line, kernel.radius(), [-margin; 3], high, part, |index| {
        let centre = DVec3::from_array(index.map(|i| i as f64));
        sweep.push(line.start - centre, line.step, Some(kernel), field.coefficient(index));
    });
    sweep.run(part, |a, b, active| {
        let value = |t: f64| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for k in active {
                let h = k.value(Some(kernel), t);
                sum += h * k.weight;
                weights += h;
            }
            sum / weights
        };
        smooth(a, b, &value, classes, ray, light, 10);
        !light.is_opaque()
    });
}

/// A smooth value as polynomials close enough to it.
fn smooth(
    a: f64,
    b: f64,
    value: &impl Fn(f64) -> f64,
    classes: &Classes,
    ray: RayShader<'_>,
    light: &mut Light,
    deepest: u32,
) {
    let piece = Piece::through(a, b, RADIAL_DEGREE, value);
    let probe = a + 0.11 * (b - a);
    let found = value(probe);
    let error = (piece.at(probe) - found).abs();
    if error.is_nan() {
        // No weight to divide by: the rims of kernels that barely reach.
        return;
    }
    if deepest > 0 && error > RADIAL_ERROR * found.abs().max(f64::MIN_POSITIVE) {
        let [low, high] = piece.range();
        if error > RADIAL_ERROR * (high - low).max(found.abs()) {
            let middle = f64::midpoint(a, b);
            smooth(a, middle, value, classes, ray, light, deepest - 1);
            smooth(middle, b, value, classes, ray, light, deepest - 1);
            return;
        }
    }
    shine(&piece, classes, ray, light);
}

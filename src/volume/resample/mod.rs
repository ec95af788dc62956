//! Scalars of grids that are not evenly spaced, on a lattice that is: by the shape functions of the cell that a lattice
//! point lies in, NaN outside all cells. Cells are drawn themselves where the mode asks for that; the lattice is for
//! statistics, quick pictures and every other mode.

mod cells;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;

use super::shape::Shape;
use super::{
    Association, Field, Grid, Lattice, Samples, ScalarType, Scattered, Statistics, VolumeError,
    without_strays,
};
use crate::cells::{CellField, Cells, Kind, On, Solid};
use crate::core::memory;
use crate::core::parallel;
use crate::core::progress::Ticket;
use crate::rbf::Encoding;

/// Most samples of the lattice for each of the grid.
const MOST_SAMPLES: usize = 4;
/// Small grids may have this many however few they have.
const ALWAYS_SAMPLES: usize = 1 << 15;
/// Samples of the lattice for each of the cells that it holds, and how many there are at least and at most.
const SAMPLES_A_CELL: f64 = 8.0;
const SAMPLES_OF_CELLS: [f64; 2] = [262_144.0, 16_777_216.0];
/// Boxes are taken to be no thinner than this share of their longest side.
const FLATTEST: f64 = 1e-3;

/// Axes whose cosine is larger are not at right angles.
const LEANING: f64 = 1e-6;

/// A lattice, the samples there, and what these are of.
#[derive(Debug)]
pub(super) struct Spaced {
    pub lattice: Lattice,
    pub samples: Arc<Samples>,
    /// Where there are any.
    pub cells: Option<Arc<CellField>>,
    pub scattered: Option<Arc<Scattered>>,
    /// Of the values themselves, where those of the samples say something else.
    pub statistics: Option<Statistics>,
    /// Of the file's places, where the lattice was made for them.
    pub own_bounds: Option<[DVec3; 2]>,
}

impl Spaced {
    /// Samples that are drawn as they are.
    fn plain(lattice: Lattice, samples: Arc<Samples>) -> Self {
        Self { lattice, samples, cells: None, scattered: None, statistics: None, own_bounds: None }
    }
}

impl Grid {
    /// How samples on points or cells lie, and how many along each axis.
    pub(super) fn shape_of(&self, association: Association) -> (Shape, [usize; 3]) {
        let dims = self.dims_of(association);
        match association {
            Association::Point => (self.shape.clone(), dims),
            Association::Cell => (self.shape.cells(self.lattice.dims), dims),
        }
    }

    /// A sentence that tells on which lattice the scalars of a grid that is not evenly spaced are drawn.
    pub fn resampling(&self) -> Option<String> {
        let mut sizes = Vec::new();
        for (association, of) in
            [(Association::Point, "points"), (Association::Cell, "cells' middles")]
        {
            let (shape, dims) = self.shape_of(association);
            let is_used = self.fields.iter().any(|field| field.association == association);
            let is_drawn_itself = matches!(shape, Shape::Curvilinear(_) | Shape::Unstructured(_));
            if is_drawn_itself
                || !is_used
                || matches!(shape, Shape::Affine)
                || shape.even(dims).is_some()
            {
                continue;
            }
            let lattice = lattice(&shape, dims);
            let [from, to] =
                [dims, lattice.dims].map(|dims| dims.map(|n| n.to_string()).join(" × "));
            sizes.push(format!("{to} for its {from} {of}"));
        }
        let sizes = sizes.join(", ");
        let kind = self.shape.name();
        (!sizes.is_empty()).then(|| {
            format!(
                "the grid is {kind}, not evenly spaced: its scalars are drawn as interpolated on an even \
                 lattice, {sizes}"
            )
        })
    }

    /// Whether a field's cells are drawn where its samples, the points or middles of cells, are those of a lattice: values of
    /// cells of a curvilinear grid have the cells' own shape, and points of one that leans have no lattice of cubes.
    fn is_drawn_as_cells(&self, association: Association) -> bool {
        let Shape::Curvilinear(_) = &self.shape else { return false };
        let dims = self.lattice.dims;
        let leans = |lattice: Lattice| {
            let [x, y, z] = [0, 1, 2].map(|a| lattice.axes().col(a).normalize());
            [x.dot(y), y.dot(z), z.dot(x)].iter().any(|cosine| cosine.abs() > LEANING)
        };
        let of_cells = association == Association::Cell;
        !dims.contains(&1) && (of_cells || self.shape.even(dims).is_some_and(leans))
    }

    /// Whether points are all that there is: no cell joins any, nor has a number of its own that no point has.
    pub fn are_points_alone(&self) -> bool {
        let Shape::Unstructured(cells) = &self.shape else { return false };
        let is_on_cells = |field: &Field| field.association == Association::Cell;
        let is_one_each = cells.own_cells() == cells.own_points();
        cells.join_nothing() && (is_one_each || !self.fields.iter().any(is_on_cells))
    }

    /// The lattice that a field is drawn on, its `samples` there, and the cells and points that these are samples of, where
    /// there are any.
    ///
    /// # Errors
    /// See [`lattice`] and [`samples`].
    pub(super) fn evenly_spaced(
        &self,
        field: &Field,
        values: Arc<Samples>,
        ticket: &Ticket,
    ) -> Result<Spaced, VolumeError> {
        let (shape, dims) = self.shape_of(field.association);
        if matches!(shape, Shape::Affine) {
            return Ok(Spaced::plain(self.lattice_of(field), values));
        }
        if let Some(lattice) = shape.even(dims)
            && !self.is_drawn_as_cells(field.association)
        {
            return Ok(Spaced::plain(lattice, values));
        }
        let own = || parallel::list(values.len(), |i| values.get(i));
        if let Some(cells) = self.cells()? {
            // Numbers, what is known of each solid, and the faces among which the outer ones are sought; light, which may be
            // asked for later, takes growths of each point in double and in single precision.
            let faces: usize = cells.solids().iter().map(|solid| solid.kind().faces().len()).sum();
            let of_cells = 64 * cells.solids().len() as u64 + 48 * faces as u64;
            let needed = 8 * values.len() as u64 + of_cells + 40 * cells.points().len() as u64;
            memory::require("the values of the cells", needed, memory::free_bytes())?;
            let on = match field.association {
                Association::Point => On::Points,
                Association::Cell => On::Cells,
            };
            let cells = Arc::new(CellField::new(cells, on, own()));
            let bounds = cells.cells().bounds();
            let lattice = lattice_in(bounds, like_cubes(cells.cells()));
            let fill = Fill::Cells(&cells);
            let samples = Arc::new(fill.samples(&lattice, is_wide(&values), ticket)?);
            let scattered = Scattered::of_cells(&cells).map(Arc::new);
            // No sample may lie where cells have their least or greatest value; those outside are no data that is missing.
            let statistics = match cells.range() {
                Some(range) => {
                    let sampled = Statistics::between(&samples, range, ticket)?;
                    Some(Statistics { nan_count: 0, ..sampled })
                }
                None => None,
            };
            let (cells, own_bounds) = (Some(cells), Some(bounds));
            return Ok(Spaced { lattice, samples, cells, scattered, statistics, own_bounds });
        }
        if let Shape::Unstructured(cells) = &self.shape {
            return self.of_points(cells, field, &values, ticket);
        }
        let lattice = lattice(&shape, dims);
        let values = samples(&values, &shape, &lattice, ticket)?;
        let last = DVec3::from(lattice.dims.map(|n| (n - 1) as f64));
        let own_bounds = Some([lattice.origin, lattice.world_from_index(last)]);
        Ok(Spaced { own_bounds, ..Spaced::plain(lattice, Arc::new(values)) })
    }

    /// Values on points or cells of which none is a solid. Where they are many, a sample of the lattice is one of them, or none.
    fn of_points(
        &self,
        cells: &Cells,
        field: &Field,
        values: &Samples,
        ticket: &Ticket,
    ) -> Result<Spaced, VolumeError> {
        let places = field.association.places(cells);
        let own = parallel::list(values.len(), |i| values.get(i));
        if own.len() > Scattered::MOST_SAMPLED && cells.is_surface() {
            return dotted(&places, &own, (&field.name, 0.0));
        }
        let needed = Scattered::BYTES * own.len() as u64;
        memory::require("the ellipsoids about the points", needed, memory::free_bytes())?;
        let scattered = Scattered::new(places.iter().copied().zip(own.iter().copied()).collect());
        let Some(scattered) = scattered.map(Arc::new) else {
            let found = nothing_finite(&own);
            return Err(VolumeError::NothingFinite { field: field.name.clone(), found });
        };
        // Each value counts once, and those at places that are nowhere do not.
        let there = places.iter().zip(&own).filter(|(at, _)| at.is_finite());
        let there = Samples::Float64(there.map(|(_, value)| *value).collect());
        let statistics = Some(Statistics::of(&there, ticket)?);
        if scattered.are_many_points() {
            // Ellipsoids go on beyond the last points.
            let beyond = scattered.spacing().unwrap_or_default();
            let lattice = dotted(&places, &own, (&field.name, beyond))?;
            return Ok(Spaced { scattered: Some(scattered), statistics, ..lattice });
        }
        let ellipsoids = scattered.ellipsoids(ticket)?;
        let there: Vec<DVec3> = places.iter().copied().filter(|at| at.is_finite()).collect();
        // Between strays and the rest the lattice would have no sample of the rest.
        let own_bounds = bounds_of(there.iter());
        let [low, high] = ellipsoids.bounds();
        let (bounds, own_bounds) = match without_strays(&there) {
            Some(([from, to], _)) => {
                let within = |at: DVec3| at.clamp(from, to);
                ([low, high].map(within), own_bounds.map(within))
            }
            None => ([low, high], own_bounds),
        };
        let lattice = lattice_in(bounds, scattered.count());
        let samples = Fill::Ellipsoids(&ellipsoids).samples(&lattice, is_wide(values), ticket)?;
        let plain = Spaced::plain(lattice, Arc::new(samples));
        Ok(Spaced { scattered: Some(scattered), statistics, own_bounds: Some(own_bounds), ..plain })
    }

    /// The lattice that functions which are fitted to a field are sampled on: of unstructured cells and points one of cubes
    /// over them, of other grids their own.
    pub fn lattice_of_functions(&self, field: &Field) -> Lattice {
        match &self.shape {
            Shape::Unstructured(cells) => {
                lattice_in(cells.bounds(), cells.solids().len().max(cells.own_points()))
            }
            _ => self.lattice_of(field),
        }
    }

    /// Whether the source has values at each sample of that lattice: within cells whose corners have some, about points, at
    /// samples that are finite. `values` are one number of each of the field's samples.
    ///
    /// # Errors
    /// Too little memory, or cancelled.
    pub fn has_values(
        &self,
        (field, values): (&Field, &Samples),
        lattice: &Lattice,
        ticket: &Ticket,
    ) -> Result<Vec<bool>, VolumeError> {
        let own = || parallel::list(values.len(), |i| values.get(i));
        let is_flat = self.lattice.dims.contains(&1);
        let is_there = |found: &Samples| parallel::list(found.len(), |i| found.get(i).is_finite());
        let found = match &self.shape {
            Shape::Affine => return Ok(is_there(values)),
            // What has no depth is met by few places between its samples, and may be all of them.
            Shape::Curvilinear(_) if is_flat => return Ok(vec![true; lattice.len()]),
            Shape::Rectilinear(_) => {
                let (shape, _) = self.shape_of(field.association);
                samples(values, &shape, lattice, ticket)?
            }
            Shape::Curvilinear(_) | Shape::Unstructured(_) => match self.cells()? {
                Some(cells) => {
                    let on = match field.association {
                        Association::Point => On::Points,
                        Association::Cell => On::Cells,
                    };
                    let field = CellField::new(cells, on, own());
                    Fill::Cells(&field).samples(lattice, false, ticket)?
                }
                None => {
                    let places = self.places(field.association);
                    let all = own().into_iter().enumerate().map(|(i, v)| (places.at(i).0, v));
                    let Some(points) = Scattered::new(all.collect()) else {
                        return Ok(vec![false; lattice.len()]);
                    };
                    let ellipsoids = points.ellipsoids(ticket)?;
                    Fill::Ellipsoids(&ellipsoids).samples(lattice, false, ticket)?
                }
            },
        };
        Ok(is_there(&found))
    }

    /// The most samples that [`Grid::lattice_of_functions`] has of so many points: eight for each of up to eight solids a point,
    /// and twice that, for thin boxes. Flat ones have three in depth, where a thousandth of their side would be less than one.
    pub fn most_samples_of_functions(points: u64) -> u64 {
        let [least, most] = SAMPLES_OF_CELLS;
        let wanted = (points as f64 * 8.0 * SAMPLES_A_CELL).clamp(least, most);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let most =
            (2.0 * wanted).max(3.5 * FLATTEST.powf(-2.0 / 3.0) * wanted.powf(2.0 / 3.0)) as u64;
        most
    }

    /// The cells with volume of an unstructured or curvilinear grid; `None` where there are none.
    ///
    /// # Errors
    /// A surface of a curvilinear grid, and too little memory.
    pub fn cells(&self) -> Result<Option<Arc<Cells>>, VolumeError> {
        match &self.shape {
            Shape::Affine | Shape::Rectilinear(_) => Ok(None),
            Shape::Unstructured(cells) if cells.solids().is_empty() => Ok(None),
            Shape::Unstructured(cells) => Ok(Some(Arc::clone(cells))),
            Shape::Curvilinear(points) => {
                let dims = self.lattice.dims;
                if dims.contains(&1) {
                    let [x, y, z] = dims;
                    return Err(VolumeError::Surface { found: format!("{x} × {y} × {z}") });
                }
                let needed = 48 * points.len() as u64;
                memory::require("the cells of the grid", needed, memory::free_bytes())?;
                Ok(Some(Arc::new(Cells::of_grid(points, dims))))
            }
        }
    }
}

/// Samples of a lattice, each with the value of a place about it, and the rest without any: points without a look at their
/// neighbours. The least and the greatest value are among them. The lattice goes on so far beyond them. Strays have no sample.
fn dotted(
    places: &[DVec3],
    values: &[f64],
    (name, beyond): (&str, f64),
) -> Result<Spaced, VolumeError> {
    let is_there = |at: &usize| values[*at].is_finite() && places[*at].is_finite();
    let mut there: Vec<usize> = (0..values.len().min(places.len())).filter(is_there).collect();
    let all: Vec<DVec3> = there.iter().map(|at| places[*at]).collect();
    if let Some(([low, high], _)) = without_strays(&all) {
        there.retain(|at| places[*at].clamp(low, high) == places[*at]);
    }
    let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
    let ends = [there.iter().copied().min_by(by_value), there.iter().copied().max_by(by_value)];
    let [Some(least), Some(most)] = ends else {
        let found = nothing_finite(values);
        return Err(VolumeError::NothingFinite { field: name.to_owned(), found });
    };
    let bounds = bounds_of(there.iter().map(|at| &places[*at]));
    let lattice = lattice_in([bounds[0] - beyond, bounds[1] + beyond], 0);
    let mut samples = vec![f64::NAN; lattice.len()];
    let [nx, ny, _] = lattice.dims;
    for at in there.into_iter().chain([least, most]) {
        let index = lattice.index_from_world(places[at]).round();
        let last = DVec3::from(lattice.dims.map(|n| (n - 1) as f64));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let [x, y, z] = index.clamp(DVec3::ZERO, last).to_array().map(|v| v as usize);
        samples[(z * ny + y) * nx + x] = values[at];
    }
    let plain = Spaced::plain(lattice, Arc::new(Samples::Float64(samples)));
    Ok(Spaced { own_bounds: Some(bounds), ..plain })
}

/// What there is in place of a finite value at a finite place.
fn nothing_finite(values: &[f64]) -> String {
    let nan = values.iter().filter(|value| value.is_nan()).count();
    let infinite = values.iter().filter(|value| value.is_infinite()).count();
    match values.len() - nan - infinite {
        0 if infinite == 0 => format!("{nan} NaN"),
        0 if nan == 0 => format!("{infinite} infinite"),
        0 => format!("{nan} NaN and {infinite} infinite"),
        finite => format!("{finite} of {} at places that are not finite", values.len()),
    }
}

/// Least and greatest x, y, z of places.
fn bounds_of<'a>(places: impl Iterator<Item = &'a DVec3>) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    places.fold(none, |[low, high], at| [low.min(*at), high.max(*at)])
}

/// How many cubes solids are worth: five tetrahedra or six are one, cut.
fn like_cubes(cells: &Cells) -> usize {
    let is_part = |solid: &&Solid| solid.kind() == Kind::Tetrahedron;
    let parts = cells.solids().iter().filter(is_part).count();
    cells.solids().len() - parts + parts / 4
}

/// A lattice of cubes over the box of so many cells or points: eight samples for each, but no fewer than about 64³ of them
/// and no more than 256³.
fn lattice_in([low, high]: [DVec3; 2], count: usize) -> Lattice {
    let extent = high - low;
    let greatest = extent.max_element();
    // Flat boxes have a depth of one sample.
    let thick = extent.max(DVec3::splat(greatest * FLATTEST));
    let [least, most] = SAMPLES_OF_CELLS;
    let wanted = (count as f64 * SAMPLES_A_CELL).clamp(least, most);
    let scale = if greatest > 0.0 { greatest } else { 1.0 };
    let mut step = scale * ((thick / scale).element_product() / wanted).cbrt();
    if !(step > 0.0 && step.is_finite()) {
        step = 1.0;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "16 million at most"
    )]
    let dims = extent.to_array().map(|length| match length / step {
        // One in the middle of what is thinner than a step.
        steps if steps < 1.0 => 3,
        steps => steps.min(1e6).ceil() as usize + 1,
    });
    let last = DVec3::from(dims.map(|n| (n - 1) as f64));
    // The box in the middle of the samples.
    let origin = low + (extent - last * step) / 2.0;
    Lattice { origin, spacing: DVec3::splat(step), ..Lattice::unit(dims) }
}

/// What fills a lattice.
enum Fill<'a> {
    Cells(&'a CellField),
    Ellipsoids(&'a Encoding),
}

impl Fill<'_> {
    /// The value at each point of a lattice.
    fn samples(
        &self,
        lattice: &Lattice,
        is_wide: bool,
        ticket: &Ticket,
    ) -> Result<Samples, VolumeError> {
        let count = lattice.len();
        let needed = (count * if is_wide { 8 } else { 4 }) as u64;
        memory::require("the evenly spaced samples", needed, memory::free_bytes())?;
        if is_wide {
            let mut out = vec![f64::NAN; count];
            self.fill(&mut out, |v| v, lattice, ticket)?;
            return Ok(Samples::Float64(out));
        }
        #[expect(clippy::cast_possible_truncation, reason = "the sources have 24 bits at most")]
        let narrow = |v: f64| v as f32;
        let mut out = vec![f32::NAN; count];
        self.fill(&mut out, narrow, lattice, ticket)?;
        Ok(Samples::Float32(out))
    }

    fn fill<T: Copy + Send + Sync>(
        &self,
        out: &mut [T],
        from_f64: impl Fn(f64) -> T + Sync,
        lattice: &Lattice,
        ticket: &Ticket,
    ) -> Result<(), VolumeError> {
        match self {
            Self::Cells(field) => cells::fill(out, from_f64, field, lattice, ticket),
            Self::Ellipsoids(encoding) => {
                let [nx, ny, _] = lattice.dims;
                let (done, rows) = (AtomicU64::new(0), (out.len() / nx) as u64);
                parallel::try_each(out.chunks_mut(nx).enumerate(), |(row, out)| {
                    for (x, out) in out.iter_mut().enumerate() {
                        let at = DVec3::from([x, row % ny, row / ny].map(|i| i as f64));
                        *out = from_f64(encoding.value(lattice.world_from_index(at)));
                    }
                    let before = done.fetch_add(1, Ordering::Relaxed);
                    Ok(ticket.checkpoint(before + 1, rows)?)
                })
            }
        }
    }
}

/// Whether samples have more digits than 32-bit floats.
fn is_wide(samples: &Samples) -> bool {
    matches!(
        samples.scalar_type(),
        ScalarType::Float64
            | ScalarType::Int32
            | ScalarType::UInt32
            | ScalarType::Int64
            | ScalarType::UInt64
    )
}

/// The lattice that scalars of a grid are drawn on: over the box of its points, as fine along each axis
/// as the grid is where it is finest, but not of more than four times its samples (or 32 768), and of no
/// fewer along an axis than that has.
fn lattice(shape: &Shape, dims: [usize; 3]) -> Lattice {
    let outline = shape.outline(dims);
    let Shape::Rectilinear(axes) = shape else { return outline };
    let (least, steps) = (dims, axes.each_ref().map(|list| least_step(list)));
    let last = DVec3::from(dims.map(|n| n.saturating_sub(1) as f64));
    let low = outline.origin;
    let extent = outline.spacing * last;
    let most = (MOST_SAMPLES * dims.iter().product::<usize>()).max(ALWAYS_SAMPLES);
    let sizes = |coarser: f64| {
        let mut sizes = [1; 3];
        for axis in 0..3 {
            if dims[axis] > 1 && extent[axis] > 0.0 {
                // Digits that were lost must not cost a sample; beyond any size that is allowed, all are
                // as large.
                let cells = (extent[axis] / (steps[axis] * coarser) * (1.0 - 1e-3)).ceil().min(1e9);
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "between 1 and 1e9"
                )]
                let samples = cells as usize + 1;
                sizes[axis] = samples.max(least[axis]);
            }
        }
        sizes
    };
    let fits = |sizes: [usize; 3]| {
        let count = memory::checked_product(&sizes.map(|n| n as u64));
        count.is_some_and(|count| count <= most as u64)
    };
    let mut coarser = 1.0;
    // Infinitely coarse there are as many as the grid has, which fit; coordinates next to each other are far from it.
    while !fits(sizes(coarser)) {
        coarser *= if coarser < 1e12 { 1.01 } else { 2.0 };
    }
    let sizes = sizes(coarser);
    let mut lattice = Lattice { origin: low, spacing: outline.spacing, ..Lattice::unit(sizes) };
    for axis in 0..3 {
        if sizes[axis] > 1 {
            lattice.spacing[axis] = extent[axis] / (sizes[axis] - 1) as f64;
        }
    }
    lattice
}

fn least_step(list: &[f64]) -> f64 {
    list.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(f64::INFINITY, f64::min)
}

/// One number a point of a rectilinear grid, at each point of the lattice. Integers become floats.
///
/// # Errors
/// Too little memory, or cancelled.
fn samples(
    samples: &Samples,
    shape: &Shape,
    lattice: &Lattice,
    ticket: &Ticket,
) -> Result<Samples, VolumeError> {
    let Shape::Rectilinear(axes) = shape else { return Ok(samples.clone()) };
    let axes = axes.each_ref().map(|list| &**list);
    let (is_wide, count) = (is_wide(samples), lattice.len());
    let needed = (count * if is_wide { 8 } else { 4 }) as u64;
    memory::require("the evenly spaced samples", needed, memory::free_bytes())?;
    if is_wide {
        let mut out = vec![f64::NAN; count];
        rectilinear(&mut out, |v| v, samples, axes, lattice, ticket)?;
        return Ok(Samples::Float64(out));
    }
    #[expect(clippy::cast_possible_truncation, reason = "the sources have 24 bits at most")]
    let narrow = |v: f64| v as f32;
    let mut out = vec![f32::NAN; count];
    rectilinear(&mut out, narrow, samples, axes, lattice, ticket)?;
    Ok(Samples::Float32(out))
}

/// Between which entries of a list each of a lattice's coordinates lies: the first one's number, and how
/// far it is to the next.
fn places(list: &[f64], n: usize, origin: f64, step: f64) -> Vec<(usize, f64)> {
    let last = list.len() - 1;
    let rises = list[last] >= list[0];
    (0..n)
        .map(|i| {
            let at = origin + step * i as f64;
            let after =
                list.partition_point(|value| if rises { *value <= at } else { *value >= at });
            let first = after.saturating_sub(1).min(last.saturating_sub(1));
            if last == 0 {
                return (0, 0.0);
            }
            // Rounding puts the ends a hair outside.
            let share = (at - list[first]) / (list[first + 1] - list[first]);
            (first, share.clamp(0.0, 1.0))
        })
        .collect()
}

fn rectilinear<T: Copy + Send + Sync>(
    out: &mut [T],
    from_f64: impl Fn(f64) -> T + Sync,
    samples: &Samples,
    axes: [&[f64]; 3],
    lattice: &Lattice,
    ticket: &Ticket,
) -> Result<(), VolumeError> {
    let [nx, ny, _] = axes.map(<[f64]>::len);
    let [mx, my, mz] = lattice.dims;
    let along = |axis: usize| {
        places(axes[axis], lattice.dims[axis], lattice.origin[axis], lattice.spacing[axis])
    };
    let (xs, ys, zs) = (along(0), along(1), along(2));
    let done = AtomicU64::new(0);
    parallel::try_each(out.chunks_exact_mut(mx * my).zip(&zs), |(slice, z)| {
        let before = done.fetch_add(1, Ordering::Relaxed);
        ticket.checkpoint(before, mz as u64)?;
        for (row, y) in slice.chunks_exact_mut(mx).zip(&ys) {
            for (to, x) in row.iter_mut().zip(&xs) {
                let mut sum = 0.0;
                for corner in 0..8 {
                    let pick = |bit: usize, (first, share): (usize, f64)| match corner & bit {
                        0 => (first, 1.0 - share),
                        _ => (first + 1, share),
                    };
                    let ((i, wx), (j, wy), (k, wz)) = (pick(1, *x), pick(2, *y), pick(4, *z));
                    let weight = wx * wy * wz;
                    // Holes reach no further than to where they count.
                    if weight > 0.0 {
                        sum += weight * samples.get((k * ny + j) * nx + i);
                    }
                }
                *to = from_f64(sum);
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests;

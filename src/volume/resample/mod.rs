//! Scalars of grids that are not evenly spaced, on a lattice that is: trilinear between the points of the
//! cell that a lattice point lies in, NaN outside all cells.

mod cells;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::shape::{Shape, bounds};
use super::{Association, Field, Grid, Lattice, Samples, ScalarType, VolumeError};
use crate::core::memory;
use crate::core::progress::Ticket;

/// Most samples of the lattice for each of the grid.
const MOST_SAMPLES: usize = 4;
/// Small grids may have this many however few they have.
const ALWAYS_SAMPLES: usize = 1 << 15;

impl Grid {
    /// How samples on points or cells lie, and how many along each axis.
    pub(super) fn shape_of(&self, association: Association) -> (Shape, [usize; 3]) {
        let dims = self.lattice.dims;
        match association {
            Association::Point => (self.shape.clone(), dims),
            Association::Cell => (self.shape.cells(dims), dims.map(|n| n.saturating_sub(1).max(1))),
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
            if !is_used || matches!(shape, Shape::Affine) || shape.even(dims).is_some() {
                continue;
            }
            // Surfaces are refused when they are to be drawn.
            let Ok(lattice) = lattice(&shape, dims) else { continue };
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

    /// The lattice that a field is drawn on, and its `samples` there.
    ///
    /// # Errors
    /// See [`lattice`] and [`samples`].
    pub(super) fn evenly_spaced(
        &self,
        field: &Field,
        values: Arc<Samples>,
        ticket: &Ticket,
    ) -> Result<(Lattice, Arc<Samples>), VolumeError> {
        let (shape, dims) = self.shape_of(field.association);
        if matches!(shape, Shape::Affine) {
            return Ok((self.lattice_of(field), values));
        }
        if let Some(lattice) = shape.even(dims) {
            return Ok((lattice, values));
        }
        let lattice = lattice(&shape, dims)?;
        let values = samples(&values, &shape, dims, &lattice, ticket)?;
        Ok((lattice, Arc::new(values)))
    }
}

/// The lattice that scalars of a grid are drawn on: over the box of its points, as fine along each axis
/// as the grid is where it is finest, but not of more than four times its samples (or 32 768), and of no
/// fewer along an axis of a rectilinear grid than that has.
///
/// # Errors
/// A curved surface or line, which has no cells to be inside of.
fn lattice(shape: &Shape, dims: [usize; 3]) -> Result<Lattice, VolumeError> {
    let outline = shape.outline(dims);
    let (least, steps) = match shape {
        Shape::Affine => return Ok(outline),
        Shape::Rectilinear(axes) => (dims, axes.each_ref().map(|list| least_step(list))),
        Shape::Curvilinear(points) => {
            if dims.contains(&1) {
                let [x, y, z] = dims;
                return Err(VolumeError::Surface { found: format!("{x} × {y} × {z}") });
            }
            ([2; 3], cells::least_edges(points, dims))
        }
    };
    let [low, high] = match shape {
        Shape::Curvilinear(points) => bounds(points),
        _ => {
            let last = DVec3::from(dims.map(|n| n.saturating_sub(1) as f64));
            [outline.origin, outline.origin + outline.spacing * last]
        }
    };
    let extent = high - low;
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
    while !fits(sizes(coarser)) && coarser < 1e12 {
        coarser *= 1.01;
    }
    let sizes = sizes(coarser);
    let mut lattice = Lattice { origin: low, spacing: outline.spacing, ..Lattice::unit(sizes) };
    for axis in 0..3 {
        if sizes[axis] > 1 {
            lattice.spacing[axis] = extent[axis] / (sizes[axis] - 1) as f64;
        }
    }
    Ok(lattice)
}

fn least_step(list: &[f64]) -> f64 {
    list.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(f64::INFINITY, f64::min)
}

/// One number a point of the grid, at each point of the lattice. Integers become floats.
///
/// # Errors
/// Too little memory, or cancelled.
fn samples(
    samples: &Samples,
    shape: &Shape,
    dims: [usize; 3],
    lattice: &Lattice,
    ticket: &Ticket,
) -> Result<Samples, VolumeError> {
    let is_wide = matches!(
        samples.scalar_type(),
        ScalarType::Float64
            | ScalarType::Int32
            | ScalarType::UInt32
            | ScalarType::Int64
            | ScalarType::UInt64
    );
    let count = lattice.len();
    let needed = (count * if is_wide { 8 } else { 4 }) as u64;
    memory::require("the evenly spaced samples", needed, memory::free_bytes())?;
    // Cells are looked through in double precision, a few slices at a time.
    if is_wide {
        let mut out = vec![f64::NAN; count];
        fill(&mut out, |v| v, samples, shape, dims, lattice, ticket)?;
        Ok(Samples::Float64(out))
    } else {
        #[expect(clippy::cast_possible_truncation, reason = "the sources have 24 bits at most")]
        let narrow = |v: f64| v as f32;
        let mut out = vec![f32::NAN; count];
        fill(&mut out, narrow, samples, shape, dims, lattice, ticket)?;
        Ok(Samples::Float32(out))
    }
}

fn fill<T: Copy + Send + Sync>(
    out: &mut [T],
    from_f64: impl Fn(f64) -> T + Sync,
    samples: &Samples,
    shape: &Shape,
    dims: [usize; 3],
    lattice: &Lattice,
    ticket: &Ticket,
) -> Result<(), VolumeError> {
    match shape {
        Shape::Affine => Ok(()),
        Shape::Rectilinear(axes) => rectilinear(
            out,
            from_f64,
            samples,
            axes.each_ref().map(|list| &**list),
            lattice,
            ticket,
        ),
        Shape::Curvilinear(points) => {
            cells::fill(out, from_f64, samples, points, dims, lattice, ticket)
        }
    }
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
    out.par_chunks_exact_mut(mx * my).zip(&zs).try_for_each(|(slice, z)| {
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

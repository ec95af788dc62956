//! The coefficients of a field in memory, and what lies between them (`values`).

mod values;

use std::sync::{Arc, OnceLock};

use fearless_simd::{Simd, prelude::*};

pub(super) use values::{Finds, Method, by};

use super::bricks::{self, BRICK};
use super::lanes::{LANES, Mask, Vec3};
use super::own::Own;
use crate::cells::Depths;
use crate::core::parallel;
use crate::core::{Cancelled, LargePages, Ticket, mapped};
use crate::kernel::{Bounds, Coefficients, Kernel, Weighs, mirrored};
use crate::rbf::Limits;
use crate::scene::{Reconstruction, SplatSettings};
use crate::volume::ScalarVolume;

/// Stands for "no value here".
pub(super) const NOTHING: f32 = -3e38;
/// Samples beyond the last row that a load of four may touch.
const SLACK: usize = 4;
/// Of a brick without values.
const NO_RANGE: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];
/// Bricks between two looks at the ticket.
const A_PART: usize = 1 << 11;
/// The greatest number of stored samples: places among them are 32-bit integers.
pub(super) const MOST_STORED: usize = (1 << 31) - 1;

/// Coefficients with as many mirrored samples about them as their kernel reaches.
#[derive(Debug)]
pub(super) struct Lattice {
    source: Arc<ScalarVolume>,
    pub kernel: Kernel,
    extent: Option<f64>,
    reconstruction: Reconstruction,
    limits: Limits,
    values: LargePages,
    /// What is to be added to each value.
    pub bias: f64,
    pub dims: [usize; 3],
    /// Mirrored samples beyond each border.
    pad: usize,
    /// Stored samples in a row, and in a plane.
    row: i32,
    plane: i32,
    /// What distances are divided by before a kernel of another than its natural width.
    stretch: f32,
    /// It is for quick pictures.
    is_quick: bool,
    holes: Option<Vec<u32>>,
    near_holes: OnceLock<Vec<bool>>,
    /// Where the cells end that its values are samples of.
    pub border: Option<CellBorder>,
    pub bricks: Bounds,
    /// What is drawn in the place of samples.
    pub own: Option<Own>,
}

/// The border of the cells that a lattice is over.
#[derive(Debug)]
pub(super) struct CellBorder {
    /// How deep each sample lies in them, in steps, less than 0 outside; stored as the values are.
    pub depths: LargePages,
    /// What light takes for the growth there, per index.
    pub strength: f32,
}

impl Lattice {
    /// Samples that it stores of a volume in a mode; `None` where they overflow.
    pub(super) fn stored(dims: [usize; 3], mode: &SplatSettings) -> Option<usize> {
        let pad = 2 * padding(mode.kernel, mode.extent);
        dims.iter().try_fold(1_usize, |n, &d| n.checked_mul(d + pad))
    }

    /// The coefficients of a volume in a mode.
    ///
    /// # Errors
    /// [`Cancelled`].
    #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "MOST_STORED")]
    pub(super) fn new(
        source: &Arc<ScalarVolume>,
        (mode, is_quick): (&SplatSettings, bool),
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let Coefficients { dims, mut values, bias, mut holes, depths, .. } = coefficients;
        let SplatSettings { kernel, extent, reconstruction, .. } = *mode;
        let limits = mode.limits();
        let own = Own::of(source, (kernel, &limits), bias, ticket)?;
        match &own {
            // They may have been fitted to the samples.
            Some(Own::Functions(functions)) if !functions.is_mean() => {
                values = functions.at_samples(ticket)?;
            }
            // Samples outside of all cells, and beside all points, are nowhere.
            Some(Own::Cells(_) | Own::Functions(_)) => holes = None,
            None => {}
        }
        let pad = padding(kernel, extent);
        let stored = padded(&values, dims, pad, mirrored, ticket)?;
        let [row, plane] = [dims[0] + 2 * pad, (dims[0] + 2 * pad) * (dims[1] + 2 * pad)];
        let stretch = kernel.stretch(extent);
        let weighs = match kernel {
            Kernel::BSpline if stretch == 1.0 => Weighs::Splines,
            _ => Weighs::Samples(kernel.window(extent)),
        };
        let mut bricks = bricks::bounds(&values, dims, weighs, ticket)?;
        drop(values);
        if let Some(own) = &own {
            own.bound(&mut bricks, bias, ticket)?;
        }
        let border = match depths {
            Some(Depths { depths, strength, .. }) => {
                holes = None;
                let deepest = bricks::bounds(&depths, dims, weighs, ticket)?;
                for (range, [_, depth]) in bricks.ranges.iter_mut().zip(deepest.ranges) {
                    if depth < 0.0 {
                        *range = NO_RANGE;
                    }
                }
                let step = source.lattice.axes().x_axis.length();
                let depths = padded_depths(&depths, dims, pad, ticket)?;
                Some(CellBorder { depths, strength: (strength * step) as f32 })
            }
            None => None,
        };
        Ok(Self {
            source: Arc::clone(source),
            kernel,
            extent,
            reconstruction,
            limits,
            values: stored,
            bias,
            dims,
            pad,
            row: row as i32,
            plane: plane as i32,
            stretch: stretch as f32,
            is_quick,
            holes,
            near_holes: OnceLock::new(),
            border,
            bricks,
            own,
        })
    }

    /// Whether it is of a volume.
    pub(super) fn is_of_volume(&self, volume: &Arc<ScalarVolume>) -> bool {
        Arc::ptr_eq(&self.source, volume)
    }

    /// Whether it is of a volume in a mode.
    pub(super) fn is_of(&self, volume: &Arc<ScalarVolume>, mode: &SplatSettings) -> bool {
        Arc::ptr_eq(&self.source, volume)
            && (self.kernel, self.extent, self.reconstruction, self.limits)
                == (mode.kernel, mode.extent, mode.reconstruction, mode.limits())
    }

    /// How its values are found.
    pub(super) fn method(&self) -> Method {
        match self.kernel {
            Kernel::BSpline if self.stretch == 1.0 => Method::BSpline,
            Kernel::Linear if self.stretch == 1.0 => Method::Linear,
            Kernel::Functions | Kernel::Ellipsoids => Method::Functions,
            Kernel::Cells => Method::Cells,
            _ => Method::Other,
        }
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        let holes = self.holes.as_ref().map_or(0, |holes| 4 * holes.len());
        let own = self.own.as_ref().map_or(0, Own::size_bytes);
        let border = self.border.as_ref().map_or(0, |border| 4 * border.depths.len());
        (4 * self.values.len() + holes + border + self.bricks.size_bytes() + own) as u64
    }

    /// Whether samples hold no data.
    pub(super) fn has_holes(&self) -> bool {
        self.holes.is_some()
    }

    /// Whether there are places in it that it has no value at.
    pub(super) fn ends_within(&self) -> bool {
        self.holes.is_some() || self.border.is_some()
    }

    /// Whether samples without data are in each brick, or beside it; none of it where there are no such samples.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn near_holes(&self, ticket: &Ticket) -> Result<&[bool], Cancelled> {
        let Some(holes) = &self.holes else { return Ok(&[]) };
        if let Some(known) = self.near_holes.get() {
            return Ok(known);
        }
        let [nx, ny, _] = self.dims;
        let has = |x: usize, y: usize, z: usize| {
            let i = (z * ny + y) * nx + x;
            holes[i / 32] >> (i % 32) & 1 == 1
        };
        let span = |b: usize, n: usize| {
            (b * BRICK).saturating_sub(2).min(n - 1)..=(b * BRICK + BRICK).min(n - 1)
        };
        let bricks = self.bricks.dims;
        let is_near = |i: usize| {
            let b = [i % bricks[0], i / bricks[0] % bricks[1], i / (bricks[0] * bricks[1])];
            span(b[2], self.dims[2])
                .any(|z| span(b[1], ny).any(|y| span(b[0], nx).any(|x| has(x, y, z))))
        };
        let found = mapped(bricks.iter().product(), A_PART, is_near, ticket)?;
        Ok(self.near_holes.get_or_init(|| found))
    }

    /// Whether the sample nearest to a place in index space has no data.
    pub(super) fn is_hole(&self, place: [f32; 3]) -> bool {
        let Some(holes) = &self.holes else { return false };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let [x, y, z] =
            [0, 1, 2].map(|a| ((place[a] + 0.5).floor().max(0.0) as usize).min(self.dims[a] - 1));
        let i = (z * self.dims[1] + y) * self.dims[0] + x;
        holes[i / 32] >> (i % 32) & 1 == 1
    }

    /// The rays whose places are in samples without data.
    #[inline(always)]
    pub(super) fn holes_at<S: Simd>(&self, simd: S, place: Vec3<S>) -> Mask<S> {
        let mut bits = 0;
        for i in 0..LANES {
            bits |= u64::from(self.is_hole(place.lane(i))) << i;
        }
        Mask::from_bitmask(simd, bits)
    }
}

/// Samples that are stored beyond each border: as many as a kernel reaches. The growth of tents looks one further.
fn padding(kernel: Kernel, extent: Option<f64>) -> usize {
    kernel.window(extent).max(if kernel == Kernel::Linear { 2 } else { 1 })
}

/// Numbers of a lattice with so many more beyond each border: copies of those that `number` says, as `mirrored` does.
fn padded(
    values: &[f32],
    dims: [usize; 3],
    pad: usize,
    number: impl Fn(usize, usize, usize) -> usize,
    ticket: &Ticket,
) -> Result<LargePages, Cancelled> {
    let [sx, sy, sz] = dims.map(|n| n + 2 * pad);
    let place: [Vec<usize>; 3] =
        [0, 1, 2].map(|a| (0..dims[a] + 2 * pad).map(|i| number(i, pad, dims[a])).collect());
    let mut stored = LargePages::zeros(sx * sy * sz + SLACK);
    let planes = stored[..sx * sy * sz].chunks_mut(sx * sy);
    parallel::try_each(planes.enumerate(), |(z, plane)| {
        if ticket.is_cancelled() {
            return Err(Cancelled);
        }
        for (y, row) in plane.chunks_mut(sx).enumerate() {
            let start = (place[2][z] * dims[1] + place[1][y]) * dims[0];
            let from = &values[start..start + dims[0]];
            row[pad..pad + dims[0]].copy_from_slice(from);
            for x in (0..pad).chain(pad + dims[0]..sx) {
                row[x] = from[place[0][x]];
            }
        }
        Ok(())
    })?;
    Ok(stored)
}

/// Depths with so many more beyond each border, where no cells are: less than the nearest one by how far that is.
fn padded_depths(
    depths: &[f32],
    dims: [usize; 3],
    pad: usize,
    ticket: &Ticket,
) -> Result<LargePages, Cancelled> {
    let clamped = |i: usize, pad: usize, n: usize| i.saturating_sub(pad).min(n - 1);
    let mut stored = padded(depths, dims, pad, clamped, ticket)?;
    let [sx, sy, sz] = dims.map(|n| n + 2 * pad);
    let off = |i: usize, n: usize| i.abs_diff(clamped(i, pad, n) + pad).pow(2);
    let planes = stored[..sx * sy * sz].chunks_mut(sx * sy);
    parallel::try_each(planes.enumerate(), |(z, plane)| {
        if ticket.is_cancelled() {
            return Err(Cancelled);
        }
        for (y, row) in plane.chunks_mut(sx).enumerate() {
            let across = off(z, dims[2]) + off(y, dims[1]);
            for (x, depth) in row.iter_mut().enumerate() {
                *depth -= ((across + off(x, dims[0])) as f32).sqrt();
            }
        }
        Ok(())
    })?;
    Ok(stored)
}

//! What weighs a lattice's kernels: the samples, or values sharpened so that the kernels pass
//! through the samples.

mod holes;
mod prefilter;
mod stencil;
#[cfg(test)]
mod tests;

use self::prefilter::{Target, Widened};
use self::stencil::Stencil;
use super::{Kernel, RadialKernel, Separable};
use crate::cells::Depths;
use crate::core::memory::{self, TooLarge};
use crate::core::parallel;
use crate::core::plain_number;
use crate::core::progress::{Cancelled, Ticket};
use crate::volume::{Scalar, ScalarVolume};
use crate::with_samples;

/// The greatest splat radius, voxels, that coefficients are made for.
pub const MOST_EXTENT: f64 = 8.0;
/// The greatest one of tents: beyond, more than four samples an axis would be in reach.
pub const MOST_TENT_EXTENT: f64 = 2.0;
/// Sweeps with which radial kernels are sharpened.
const SWEEPS: usize = 2;
/// The greatest magnitude that is stored, less the bias: sums of a few still are finite in float32.
const MOST: f64 = 3.3e38;
/// Samples converted between two looks at the ticket.
const CHUNK: usize = 1 << 16;

/// Why there are no coefficients.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CoefficientsError {
    /// The work was told to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// They do not fit in memory.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// The kernel is too wide to be summed up at every sample.
    #[error("expected an extent of at most {most} voxels, found {}; choose a smaller extent", plain_number(*extent))]
    #[expect(missing_docs, reason = "the sentence tells")]
    Extent { most: f64, extent: f64 },
}

/// What the reconstruction leaves of the samples: sample − Σ cᵢ hᵢ / Σ hᵢ at the samples that hold
/// data, as parts of the range of their values. Measured, not predicted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Root of the mean square.
    pub rms: f64,
    /// Greatest magnitude.
    pub max: f64,
}

/// The values cᵢ of s(x) = Σ cᵢ hᵢ(x) / Σ hᵢ(x) on a lattice that is mirrored about its border
/// samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficients {
    /// Along x, y, z: the lattice's own.
    pub dims: [usize; 3],
    /// cᵢ − [`Coefficients::bias`], x fastest; all finite.
    pub values: Vec<f32>,
    /// What was taken off each before it was rounded to 32 bits: the end of the samples' range that
    /// is nearest to 0, so that samples near 1e6 with a spread of 1 keep their differences.
    pub bias: f64,
    /// Least cᵢ, bias included. No kernel here is negative, so no reconstruction is less.
    pub min: f64,
    /// Greatest cᵢ, bias included, and no reconstruction is greater.
    pub max: f64,
    /// After each step: first of the samples as they are, then after the prefilter or each sweep.
    /// At least one, but of means and the nearest tents none. Of kernels with more than 64 samples in reach the first and the last are
    /// measured on every n-th slice.
    pub residuals: Vec<Residual>,
    /// One bit a sample, in the order of `values` from each word's lowest bit: set where the volume
    /// holds no data (NaN). `None` where it holds data everywhere.
    pub holes: Option<Vec<u32>>,
    /// What they are means of, where they are no samples.
    pub averaged: Option<Averaged>,
    /// How deep they lie in the cells that they are samples of, where that is known: what draws them then ends where cells do,
    /// rather than at the samples without data.
    pub depths: Option<Depths>,
}

/// What means of a volume's values stand for.
#[derive(Debug, Clone, PartialEq)]
pub struct Averaged {
    /// Of 2^level samples along each axis; coefficient i is in the middle of samples
    /// 2^level · i … 2^level · (i + 1) − 1.
    pub level: u32,
    /// Samples along x, y, z of the volume itself: the last means may be of fewer.
    pub volume_dims: [usize; 3],
    /// Half the width of the values about each mean: √3 standard deviations, as if they were spread
    /// evenly.
    pub half_widths: Vec<f32>,
}

impl Coefficients {
    /// Of means of `averaged.level` levels, less `bias`, NaN where there are no data.
    ///
    /// # Errors
    /// Cancelled by the ticket.
    pub fn of_means(
        dims: [usize; 3],
        mut values: Vec<f32>,
        bias: f64,
        averaged: Averaged,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let holes = holes::of(&values, ticket)?;
        if let Some(holes) = &holes {
            holes::fill(&mut values, dims, holes, ticket)?;
        }
        let (min, max) = extremes(&values, ticket)?;
        let (min, max) = (min + bias, max + bias);
        let (residuals, averaged) = (Vec::new(), Some(averaged));
        Ok(Self { dims, values, bias, min, max, residuals, holes, averaged, depths: None })
    }

    /// What is left of the samples.
    pub fn residual(&self) -> Option<Residual> {
        self.residuals.last().copied()
    }

    /// Coefficient `index`, bias included.
    pub fn get(&self, index: usize) -> f64 {
        f64::from(self.values[index]) + self.bias
    }

    /// Whether the volume holds no data at sample `index`.
    pub fn is_hole(&self, index: usize) -> bool {
        self.holes.as_ref().is_some_and(|holes| holes::contains(holes, index))
    }
}

/// Makes the coefficients with which a kernel of splat radius `extent` reconstructs a volume.
///
/// As they are (`interpolating` false): the samples. Interpolating:
/// - B-spline: the exact recursive prefilter, after which it passes through every sample at its natural
///   extent;
/// - cubic and Gaussian: two Jacobi sweeps c ← c + (s − h∗c), which
///   sharpen without quite interpolating, h∗c being the reconstruction at the samples;
/// - linear, nearest and point: nothing, they interpolate as they are.
///
/// B-splines that are wider than natural are brought back to the natural ones, so that nobody who draws them has
/// more than four samples an axis to weigh: the field Σ cᵢ h((x − i)/s) / Σ h((x − i)/s), a product of axes, is taken
/// at the samples, in float64 along each axis, and what is made are the coefficients of the natural spline that passes
/// through it there. Between the samples both differ by what the wider field has of frequencies that the natural spline
/// does not follow (tests have figures). Narrower ones, and tents of any width, are for who draws them to weigh
/// ([`Separable::weights`]).
///
/// Samples without data (NaN) are first given the mean of those of their six neighbours that have a
/// value, ring by ring until every sample has one. ±∞ count as the ends of the finite range, and
/// coefficients beyond ±3.3e38 of the bias as that.
///
/// Takes 4 bytes a sample, 8 while radial kernels are sharpened.
///
/// # Errors
/// Cancelled, too little memory, or an `extent` above [`MOST_EXTENT`] (tents: [`MOST_TENT_EXTENT`]).
pub fn coefficients(
    volume: &ScalarVolume,
    kernel: Kernel,
    extent: Option<f64>,
    interpolating: bool,
    ticket: &Ticket,
) -> Result<Coefficients, CoefficientsError> {
    let extent = extent.filter(|_| kernel.natural_extent().is_some());
    let most = if kernel == Kernel::Linear { MOST_TENT_EXTENT } else { MOST_EXTENT };
    if let Some(extent) = extent.filter(|&extent| extent > most) {
        return Err(CoefficientsError::Extent { most, extent });
    }
    let sweeps = interpolating && RadialKernel::new(kernel, extent).is_some();
    let bytes = volume.samples.len() as u64 * if sweeps { 8 } else { 4 };
    memory::require("the reconstruction's coefficients", bytes, memory::free_bytes())?;
    with_samples!(&*volume.samples, samples => {
        of_samples(samples, volume, kernel, extent, interpolating, ticket)
    })
    .map_err(CoefficientsError::from)
}

/// The coefficients of the tents that are nearest to the interpolating cubic B-splines, in the mean
/// square over space: quicker to evaluate, and as bright.
///
/// Takes 4 bytes a sample, of cells 8. They have no residuals. Of samples of cells, those beside the border have the value there.
///
/// # Errors
/// Cancelled, or too little memory.
pub fn nearest_tents(
    volume: &ScalarVolume,
    ticket: &Ticket,
) -> Result<Coefficients, CoefficientsError> {
    let mut tents = coefficients(volume, Kernel::Linear, None, true, ticket)?;
    if let (Some(field), Some(holes)) = (&volume.cells, &tents.holes) {
        let lattice = &volume.lattice;
        let to_index = |place| lattice.index_from_world(place);
        let is_outside = |sample: usize| holes::contains(holes, sample);
        let depths = field.depths(lattice.dims, to_index, is_outside, ticket)?;
        for (sample, value) in &depths.beside {
            tents.values[*sample] = store(value - tents.bias);
        }
        tents.depths = Some(depths);
    }
    prefilter::prefilter(&mut tents.values, tents.dims, Target::Tents, ticket)?;
    let (min, max) = extremes(&tents.values, ticket)?;
    (tents.min, tents.max) = (min + tents.bias, max + tents.bias);
    tents.residuals.clear();
    Ok(tents)
}

/// The B-spline of an extent, where it is wider than the natural one.
fn wide(kernel: Kernel, extent: Option<f64>) -> Option<Separable> {
    let spline = Separable::new(kernel, extent).filter(|_| kernel == Kernel::BSpline);
    spline.filter(|spline| spline.scale() > 1.0)
}

fn of_samples<T: Scalar>(
    samples: &[T],
    volume: &ScalarVolume,
    kernel: Kernel,
    extent: Option<f64>,
    interpolating: bool,
    ticket: &Ticket,
) -> Result<Coefficients, Cancelled> {
    let dims = volume.lattice.dims;
    let (least, greatest) = (volume.statistics.min, volume.statistics.max);
    // What is stored of functions is without their bias.
    let bias = match kernel.functions_of(volume, ticket)? {
        Some(functions) => functions.bias(),
        None => 0.0_f64.clamp(least, greatest),
    };
    // NaN stays NaN.
    let code = |value: T| store(value.to_f64().clamp(least, greatest) - bias);
    let mut values = vec![0.0; samples.len()];
    let runs = values.chunks_mut(CHUNK).zip(samples.chunks(CHUNK));
    parallel::try_each(runs, |(to, from)| {
        ticket.look()?;
        to.iter_mut().zip(from).for_each(|(to, &from)| *to = code(from));
        Ok::<(), Cancelled>(())
    })?;
    let holes = holes::of(&values, ticket)?;
    if let Some(holes) = &holes {
        holes::fill(&mut values, dims, holes, ticket)?;
    }
    let range = f64::from(store(greatest - bias)) - f64::from(store(least - bias));
    let wide = wide(kernel, extent);
    // What is made of a wide one is a natural one's.
    let stencil = Stencil::new(kernel, extent.filter(|_| wide.is_none()));
    let sample = |index: usize| Some(code(samples[index])).filter(|s| !s.is_nan());
    let measure = |values: &[f32]| stencil.residual(values, dims, range, sample, ticket);
    let mut residuals = Vec::new();
    match kernel {
        Kernel::BSpline if let Some(wide) = wide => {
            let widened = Widened::new(wide, interpolating);
            prefilter::prefilter(&mut values, dims, Target::Widened(&widened), ticket)?;
            prefilter::prefilter(&mut values, dims, Target::Spline, ticket)?;
        }
        Kernel::BSpline if interpolating => {
            residuals.push(measure(&values)?);
            prefilter::prefilter(&mut values, dims, Target::Spline, ticket)?;
        }
        Kernel::Gaussian | Kernel::Cubic if interpolating => {
            let sharpened = values.clone();
            let original = std::mem::replace(&mut values, sharpened);
            for _ in 0..SWEEPS {
                let before =
                    stencil.sweep(&mut values, &original, dims, range, holes.as_deref(), ticket)?;
                residuals.push(before);
            }
        }
        _ => {}
    }
    residuals.push(measure(&values)?);
    let (min, max) = extremes(&values, ticket)?;
    let (min, max) = (min + bias, max + bias);
    let (averaged, depths) = (None, None);
    Ok(Coefficients { dims, values, bias, min, max, residuals, holes, averaged, depths })
}

/// The least and the greatest of values.
///
/// # Errors
/// [`Cancelled`].
fn extremes(values: &[f32], ticket: &Ticket) -> Result<(f64, f64), Cancelled> {
    let none = (f32::INFINITY, f32::NEG_INFINITY);
    let wider = |a: (f32, f32), b: (f32, f32)| (a.0.min(b.0), a.1.max(b.1));
    let ranges = parallel::try_list(values.len().div_ceil(CHUNK), |part| {
        ticket.look()?;
        let own = &values[parallel::part(values.len(), CHUNK, part)];
        Ok::<_, Cancelled>(own.iter().fold(none, |range, &v| wider(range, (v, v))))
    })?;
    let (min, max) = ranges.into_iter().fold(none, wider);
    Ok((f64::from(min), f64::from(max)))
}

/// A value less the bias in 32 bits; NaN stays NaN.
#[expect(clippy::cast_possible_truncation, reason = "this is where 64 bits become 32")]
fn store(value: f64) -> f32 {
    value.clamp(-MOST, MOST) as f32
}

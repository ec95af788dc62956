//! A reconstructed field on the device: its coefficients, and where it can show.

use std::ops::{Range, RangeInclusive};
use std::sync::OnceLock;

use super::GpuError;
use super::buffers::Growing;
use super::context::Context;
use super::{cells, functions};
use crate::cells::{Depths, On};
use crate::core::parallel;
use crate::core::{Cancelled, Ticket};
use crate::hierarchy::{EMPTY_BRICK, distances, widen};
use crate::kernel::{BOUND_BRICK, Bounds, Coefficients, Kernel, Weighs, mirrored};
use crate::rbf::{Basis, Blend, Limits};
use crate::transfer::Cumulative;
use crate::volume::{Lattice, ScalarType, ScalarVolume};

/// Storage bindings that hold coefficients.
pub(super) const FIELD_CHUNKS: usize = 4;
/// Voxels from a position, along each axis, that its brick's bounds hold for.
const BOUNDED_REACH: usize = 1;
const _: () = assert!(EMPTY_BRICK == BOUND_BRICK);
/// Words packed between two looks at the ticket.
const UPLOAD_WORDS: usize = 1 << 20;

/// How a coefficient is stored; numbered as `shaders/lib/field.wgsl` does. With half its width
/// beside it a word holds both, or two words of 32-bit floats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Format {
    /// 16 bits, beside those of the next sample along x: one fetch brings two.
    Pairs,
    /// 16 bits, two samples a word.
    Halves,
    /// 32-bit floats.
    Floats,
}

/// Coefficients on the device, with as many mirrored samples about them as their kernel reaches.
#[derive(Debug)]
pub(super) struct DeviceField {
    pub kernel: Kernel,
    pub extent: Option<f64>,
    /// Of basis functions, which stand in the place of coefficients: samples along the edge of a cell, and what they look
    /// like.
    pub functions: Option<(usize, Basis)>,
    /// What of them is left out, and whether anything is added for it.
    pub limits: Limits,
    /// Of cells, that what light takes for their growths is among them.
    pub is_lit: bool,
    pub adds_left_out: bool,
    /// It is of cells with values on their points, which may jump where cells overlap.
    pub may_jump: bool,
    pub chunks: Vec<wgpu::Buffer>,
    /// Words in each chunk but the last.
    pub chunk_words: u32,
    pub format: Format,
    /// The value that is stored as 0, and what the stored value 1 is more.
    pub offset: f64,
    pub scale: f64,
    /// Mirrored samples beyond each border.
    pub pad: usize,
    pub dims: [usize; 3],
    /// Where the lattice ends, in its own index space.
    pub end: [f64; 3],
    /// How many times it was halved.
    pub level: u32,
    /// Whether half the widths of the values about means stand beside them.
    pub has_widths: bool,
    pub stored: [usize; 3],
    /// Where samples are without data: a bit each. Of samples of cells, how deep each lies in these, a byte each, ±127 for
    /// ±[`Depths::MOST`].
    pub holes: Option<Vec<u32>>,
    /// What light takes for the growth at the border of the cells that it has depths in, per index.
    pub border_strength: Option<f64>,
    /// Bricks from which samples without data are in reach, once they are asked for.
    near_holes: OnceLock<Vec<bool>>,
    /// Of positions and steps of up to a voxel from them, less `bias`.
    bounds: Bounds,
    bias: f64,
    size_bytes: u64,
}

impl DeviceField {
    pub(super) fn upload(
        context: &Context,
        volume: &ScalarVolume,
        (kernel, limits): (Kernel, Limits),
        (extent, is_lit): (Option<f64>, bool),
        coefficients: Coefficients,
        ticket: &Ticket,
    ) -> Result<Self, GpuError> {
        let Coefficients { dims, mut values, bias, min, max, mut holes, averaged, depths, .. } =
            coefficients;
        let step = volume.lattice.axes().x_axis.length();
        let border_strength = depths.as_ref().map(|depths| depths.strength * step);
        if let Some(Depths { depths, .. }) = depths {
            holes = Some(packed_depths(&depths));
        }
        let encoding = kernel.functions_of(volume, ticket).map_err(|_| GpuError::Cancelled)?;
        let listed = match encoding {
            Some(encoding) => {
                let Lattice { origin, .. } = volume.lattice;
                let space = (dims, volume.lattice.axes(), origin);
                let listed =
                    limits.listed(&encoding, space, ticket).map_err(|_| GpuError::Cancelled)?;
                match listed.blend {
                    Blend::Sum => values = functions::sums(&listed, ticket)?,
                    // Samples beside all of them are nowhere.
                    Blend::Mean => holes = None,
                }
                Some(listed)
            }
            None => None,
        };
        let cells = volume.cells.as_deref().filter(|_| kernel == Kernel::Cells);
        let mut listed_cells = None;
        let own_words = match (&listed, cells) {
            (Some(listed), _) => Some(functions::words(listed)),
            (None, Some(field)) => {
                let (words, listed) = cells::words(field, &volume.lattice, (bias, is_lit), ticket)?;
                listed_cells = Some((field, listed));
                // Samples outside of all cells are nowhere.
                holes = None;
                Some(words)
            }
            (None, None) => None,
        };
        let level = averaged.as_ref().map_or(0, |averaged| averaged.level);
        let volume_dims = averaged.as_ref().map_or(dims, |averaged| averaged.volume_dims);
        let end = volume_dims.map(|n| n as f64 / f64::from(1_u32 << level) - 0.5);
        let widths = averaged.map(|averaged| averaged.half_widths);
        let pad = kernel.window(extent);
        let stored = dims.map(|n| n + 2 * pad);
        let has_widths = widths.is_some();
        // Widths take the same steps as means, and may be far greater than what those span.
        let widest = widths.iter().flatten().fold(0.0, |most, &width| f64::from(width).max(most));
        let span = (max - min).max(widest);
        let step = step_of_sixteen_bits(volume, min, min + span);
        let (format, most_words) = match &own_words {
            Some(words) => (Format::Floats, room_for(context, kernel, words.len())?),
            None => storage(context, stored, step, has_widths)?,
        };
        let (offset, scale) = match format {
            Format::Floats => (bias, 1.0),
            Format::Pairs | Format::Halves => (min, span.max(f64::MIN_POSITIVE)),
        };
        let [sx, sy, sz] = stored;
        // Which of the field's own samples a stored one is.
        let own = |index: usize| {
            let at = [index % sx, index / sx % sy, index / (sx * sy)];
            let [x, y, z] = [0, 1, 2].map(|a| mirrored(at[a], pad, dims[a]));
            (z * dims[1] + y) * dims[0] + x
        };
        let code = |index: usize| -> u32 {
            let value = f64::from(values[own(index)]) + bias;
            // Rounded to the nearest of 65 536.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            let code = ((value - min) / scale * 65535.0 + 0.5).clamp(0.0, 65535.0) as u32;
            code
        };
        let float = |index: usize| values[own(index)].to_bits();
        // Half a width as what it is more than 0.
        let width = |index: usize| {
            widths.as_ref().map_or(0.0, |widths| f64::from(widths[own(index)]) / scale)
        };
        let samples = sx * sy * sz;
        let words = match format {
            _ if let Some(words) = &own_words => words.len(),
            Format::Halves => samples.div_ceil(2),
            Format::Floats if has_widths => 2 * samples,
            Format::Pairs | Format::Floats => samples,
        };
        let word = |index: usize| -> u32 {
            let pair = |first: usize| {
                code(first.min(samples - 1)) | code((first + 1).min(samples - 1)) << 16
            };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            match format {
                _ if let Some(words) = &own_words => words[index],
                Format::Pairs | Format::Halves if has_widths => {
                    let width = (width(index) * 65535.0 + 0.5).clamp(0.0, 65535.0);
                    code(index) | (width as u32) << 16
                }
                Format::Floats if has_widths && index % 2 == 1 => {
                    (width(index / 2) as f32).to_bits()
                }
                Format::Floats if has_widths => float(index / 2),
                Format::Pairs => pair(index),
                Format::Halves => pair(2 * index),
                Format::Floats => float(index),
            }
        };
        let shares = words.div_ceil(most_words).max(1);
        let chunk_words = words.div_ceil(shares).next_multiple_of(4).max(4);
        let mut chunks = Vec::new();
        let mut size_bytes = 0;
        for start in (0..words).step_by(chunk_words) {
            let end = (start + chunk_words).min(words);
            let bytes = ((end - start) * 4).next_multiple_of(16) as u64;
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            let buffer = Growing::make(context, "field", usage, bytes);
            size_bytes += bytes;
            write_words(context, (&buffer, 0), start..end, &word, ticket)?;
            chunks.push(buffer);
        }
        let weighs = match kernel {
            Kernel::BSpline if kernel.stretch(extent) == 1.0 => Weighs::Splines,
            _ => Weighs::Samples(pad),
        };
        let bounds_of =
            |values: &[f32]| bounds(values, dims, weighs, ticket).map_err(|_| GpuError::Cancelled);
        let mut bounds = bounds_of(&values)?;
        if let Some(widths) = &widths {
            let widest = bounds_of(widths)?;
            for ([low, high], [_, width]) in bounds.ranges.iter_mut().zip(widest.ranges) {
                *low -= width;
                *high += width;
            }
        }
        if let Some(listed) = &listed {
            functions::bound(&mut bounds, (listed, BOUNDED_REACH as f64), NOTHING, ticket)?;
        }
        if let Some((field, listed)) = &listed_cells {
            let by = (bias, BOUNDED_REACH as f64);
            cells::bound(&mut bounds, (field, listed), by, NOTHING, ticket)?;
        }
        let left_out = listed.as_ref().and_then(|listed| listed.left_out.as_ref());
        Ok(Self {
            kernel,
            extent,
            limits,
            is_lit,
            adds_left_out: left_out.is_some_and(|left_out| !left_out.corners.is_empty()),
            functions: listed.map(|listed| (listed.edge, listed.basis)),
            may_jump: cells.is_some_and(|field| field.on() == On::Points),
            chunks,
            chunk_words: chunk_words as u32,
            format,
            offset,
            scale,
            pad,
            dims,
            end,
            level,
            has_widths,
            stored,
            holes,
            border_strength,
            near_holes: OnceLock::new(),
            bounds,
            bias,
            size_bytes,
        })
    }

    /// Bytes on the device.
    pub(super) fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    /// For each brick the distance to the nearest in which a position, or a step of `reach` voxels
    /// from it, can have a value that shows, or one of `levels`; then what is known of samples without data; and
    /// the word at which those begin. Also which bricks show within a voxel of them.
    pub(super) fn empty_space(
        &self,
        table: &Cumulative,
        reach: usize,
        levels: &[f64],
    ) -> (Vec<u32>, u32, Vec<bool>) {
        let further = further_bricks(reach);
        let near_holes = if table.no_data[3] > 0.0 { self.near_holes() } else { &[] };
        let mut bytes = distances(self.bounds.dims, |brick| {
            let range = self.range(brick);
            table.shows(*range.start(), *range.end())
                || near_holes.get(brick).is_some_and(|is| *is)
                || self.has_any(brick, levels)
        });
        let shows = bytes.iter().map(|&distance| distance == 0).collect();
        widen(&mut bytes, further);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        let mut words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
        #[expect(clippy::cast_possible_truncation, reason = "a sixty-fourth of the samples")]
        let holes_at = words.len() as u32;
        if let Some(holes) = &self.holes {
            words.extend(holes);
        }
        (words, holes_at, shows)
    }

    /// Between which values all positions within [`BOUNDED_REACH`] of a brick are.
    fn range(&self, brick: usize) -> RangeInclusive<f64> {
        let [low, high] = self.bounds.ranges[brick].map(|end| f64::from(end) + self.bias);
        let slack = self.slack(low.abs().max(high.abs()));
        low - slack..=high + slack
    }

    /// Whether a position within [`BOUNDED_REACH`] of a brick may have one of some values.
    pub(super) fn has_any(&self, brick: usize, levels: &[f64]) -> bool {
        let range = self.range(brick);
        levels.iter().any(|level| range.contains(level))
    }

    /// For each brick the greatest value of a position within `reach` voxels of it, or the least, turned about: at least
    /// [`BOUNDED_REACH`] voxels, and as many bricks more as are needed.
    pub(super) fn tops(&self, turns: bool, reach: usize) -> Vec<f64> {
        let top = |&[low, high]: &[f32; 2]| {
            let top = f64::from(if turns { low } else { high }) + self.bias;
            let top = if turns { -top } else { top };
            top + self.slack(top.abs())
        };
        let mut tops: Vec<f64> = self.bounds.ranges.iter().map(top).collect();
        let [nx, ny, nz] = self.bounds.dims;
        for _ in 0..further_bricks(reach) {
            for (stride, n) in [(1, nx), (nx, ny), (nx * ny, nz)] {
                let before = tops.clone();
                for (i, top) in tops.iter_mut().enumerate() {
                    let at = i / stride % n;
                    let left = if at > 0 { before[i - stride] } else { *top };
                    let right = if at + 1 < n { before[i + stride] } else { *top };
                    *top = top.max(left).max(right);
                }
            }
        }
        tops
    }

    /// How far what the device finds may be off from a value of this size: half a step of 16 bits, and the rounding of 32.
    fn slack(&self, size: f64) -> f64 {
        let step = match self.format {
            Format::Floats => 0.0,
            Format::Pairs | Format::Halves => self.scale / 65535.0,
        };
        step + 1e-6 * size
    }

    /// Whether samples without data are in reach of each brick, or of a step of a voxel from it; none of
    /// it where there are no such samples.
    fn near_holes(&self) -> &[bool] {
        let Some(holes) = self.holes.as_ref().filter(|_| self.border_strength.is_none()) else {
            return &[];
        };
        self.near_holes.get_or_init(|| {
            let bit = |i: usize| (holes[i / 32] >> (i % 32) & 1) as f32;
            let mask: Vec<f32> = (0..self.dims.iter().product()).map(bit).collect();
            match bounds(&mask, self.dims, Weighs::Samples(1), &Ticket::new()) {
                Ok(bounds) => bounds.ranges.iter().map(|[_, most]| *most > 0.0).collect(),
                // Nobody cancels; and nothing would be missed.
                Err(_) => vec![true; self.bounds.ranges.len()],
            }
        })
    }

    /// Bricks along x, y, z.
    pub(super) fn bricks(&self) -> [usize; 3] {
        self.dims.map(|n| n.div_ceil(EMPTY_BRICK))
    }
}

/// Bricks beyond the one it begins in, and those that [`BOUNDED_REACH`] covers, that a step of so many voxels may end in.
fn further_bricks(reach: usize) -> usize {
    reach.saturating_sub(BOUNDED_REACH).div_ceil(EMPTY_BRICK)
}

/// Bounds by brick: b covers the positions 4b − ½ … 4b + 3½ along each axis, in index space, and [`BOUNDED_REACH`] more
/// about them: from the cell of the first to that of the last.
fn bounds(
    values: &[f32],
    dims: [usize; 3],
    weighs: Weighs,
    ticket: &Ticket,
) -> Result<Bounds, Cancelled> {
    let bricks = dims.map(|n| n.div_ceil(EMPTY_BRICK));
    let cells = [1 + BOUNDED_REACH, EMPTY_BRICK - 1 + BOUNDED_REACH];
    Bounds::of(values, dims, weighs, (bricks, cells), ticket)
}

/// Depths in cells as bytes, four a word.
fn packed_depths(depths: &[f32]) -> Vec<u32> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "±127, as a byte")]
    let byte = |depth: &f32| {
        let part = (f64::from(*depth) / Depths::MOST).clamp(-1.0, 1.0);
        u32::from((part * 127.0).round() as i8 as u8)
    };
    let word = |four: &[f32]| {
        four.iter().enumerate().fold(0, |word, (i, depth)| word | byte(depth) << (8 * i))
    };
    depths.chunks(4).map(word).collect()
}

/// How coarse 65 536 steps over the coefficients are: in whole numbers of whole-number data; of others
/// in 1024ths of the range that holds all values but the outer hundredths.
pub(super) fn step_of_sixteen_bits(volume: &ScalarVolume, min: f64, max: f64) -> Step {
    let step = (max - min) / 65535.0;
    match volume.samples.scalar_type() {
        ScalarType::Float32 | ScalarType::Float64 => {
            let quantiles = &volume.statistics.quantiles;
            let last = quantiles.len().saturating_sub(1);
            let at = |share: f64| quantiles.get((share * last as f64) as usize);
            Step::OfAny(match (at(0.01), at(0.99)) {
                (Some(low), Some(high)) => step * 1024.0 / (high - low),
                _ => 0.0,
            })
        }
        _ => Step::OfWhole(step),
    }
}

/// A step of 16 bits, see [`step_of_sixteen_bits`].
#[derive(Debug, Clone, Copy)]
pub(super) enum Step {
    OfWhole(f64),
    OfAny(f64),
}

impl Step {
    /// Whether 16 bits lose nothing that counts.
    pub(super) fn is_fine(self) -> bool {
        let (Self::OfWhole(step) | Self::OfAny(step)) = self;
        step <= 0.25
    }

    /// Whether what they lose is no more than whole numbers had lost before: half of one at most.
    fn is_whole(self) -> bool {
        matches!(self, Self::OfWhole(step) if step <= 1.0)
    }
}

/// Writes some of the words that there are into a buffer, from one of its words on.
///
/// # Errors
/// Cancelled, or a failing device.
pub(super) fn write_words(
    context: &Context,
    (buffer, first): (&wgpu::Buffer, usize),
    words: Range<usize>,
    word: &(impl Fn(usize) -> u32 + Sync),
    ticket: &Ticket,
) -> Result<(), GpuError> {
    let mut packed: Vec<u32> = Vec::new();
    for run in words.clone().step_by(UPLOAD_WORDS) {
        ticket.checkpoint(run as u64, words.end as u64).map_err(|_| GpuError::Cancelled)?;
        packed.clear();
        packed.resize((words.end - run).min(UPLOAD_WORDS), 0);
        parallel::each(packed.chunks_mut(1 << 14).enumerate(), |(i, part)| {
            for (j, out) in part.iter_mut().enumerate() {
                *out = word(run + i * (1 << 14) + j);
            }
        });
        let at = ((first + run - words.start) * 4) as u64;
        context.queue.write_buffer(buffer, at, bytemuck::cast_slice(&packed));
        // Let the copies go before the next ones are staged.
        context.queue.submit([]);
        context.finish()?;
    }
    Ok(())
}

/// Stands for "no value here": a value that no table shows.
const NOTHING: f32 = -3e38;

/// Room for functions or cells of so many words: words in a binding.
fn room_for(context: &Context, kernel: Kernel, words: usize) -> Result<usize, GpuError> {
    let most_words = most_words(context);
    let room = (FIELD_CHUNKS as u64 * most_words).min(u64::from(u32::MAX));
    if words as u64 > room {
        let (what, of, advice) = match kernel {
            Kernel::Cells => ("a mesh", "cells", "choose --engine native, or --kernel linear"),
            Kernel::Ellipsoids => {
                ("points", "ellipsoids", "choose --engine native, or --kernel linear")
            }
            _ => {
                let advice = "encode it with fewer functions, or choose --engine native";
                ("an encoding", "functions", advice)
            }
        };
        return Err(GpuError::TooLarge {
            what,
            limit: format!("{room} numbers for its {of} and the lists of these"),
            found: words.to_string(),
            advice,
        });
    }
    Ok(most_words as usize)
}

/// Words in a storage binding.
pub(super) fn most_words(context: &Context) -> u64 {
    let limits = &context.limits;
    let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    // Whole vectors, and numbers of 32 bits.
    (binding / 4).min(1 << 31) / 4 * 4
}

/// The quickest storage that fits the device: 32 bits where 16 are not fine, but 16 for whole numbers
/// that do not fit in 32.
fn storage(
    context: &Context,
    stored: [usize; 3],
    step: Step,
    has_widths: bool,
) -> Result<(Format, usize), GpuError> {
    let most_words = most_words(context);
    let samples = stored.iter().try_fold(1_u64, |n, &s| n.checked_mul(s as u64));
    let room = FIELD_CHUNKS as u64 * most_words;
    let most = |sixteen: bool| {
        let most = match (sixteen, has_widths) {
            (true, true) | (false, false) => room,
            (true, false) => 2 * room,
            (false, true) => room / 2,
        };
        most.min(u64::from(u32::MAX))
    };
    let fits = |sixteen: bool| samples.filter(|&n| n <= most(sixteen));
    let sixteen = step.is_fine() || step.is_whole() && fits(false).is_none();
    let samples = fits(sixteen).ok_or_else(|| GpuError::TooLarge {
        what: "a volume to reconstruct",
        limit: format!("{} voxels with its borders", most(sixteen)),
        found: format!("{} × {} × {}", stored[0], stored[1], stored[2]),
        advice: "open a subsampled copy, or choose --visibility every-sample",
    })?;
    let format = match sixteen {
        true if has_widths || samples <= most_words => Format::Pairs,
        true => Format::Halves,
        false => Format::Floats,
    };
    Ok((format, most_words as usize))
}

//! Means of a volume on the device, and the cut of a field that is drawn from them (`shaders/lib/cut.wgsl`).

use std::sync::Arc;

use super::GpuError;
use super::buffers::Growing;
use super::context::Context;
use super::field::{most_words, step_of_sixteen_bits, write_words};
use super::layout::{CUT_HEAD, narrow};
use super::shade::CellsOfValues;
use crate::core::Ticket;
use crate::hierarchy::distances;
use crate::kernel::{Coefficients, mirrored};
use crate::plan::{COARSER, EMPTY, FieldCut, bricks_of_cut};
use crate::volume::ScalarVolume;

/// Mirrored means beyond each border: tents reach one.
const PAD: usize = 1;

/// Means of 2³ and of 4³ samples, and a cut.
#[derive(Debug)]
pub(super) struct DeviceLevels {
    source: Arc<ScalarVolume>,
    pub(super) buffer: wgpu::Buffer,
    pub(super) are_floats: bool,
    /// The value that is stored as 0, and what the stored value 1 is more.
    offset: f64,
    scale: f64,
    bricks: [usize; 3],
    /// Of each level: stored means along x and y, and the word at which they begin.
    places: [[u32; 3]; COARSER],
    /// That which was written last.
    cut: Option<Arc<FieldCut>>,
}

impl DeviceLevels {
    /// Brings the means of a volume to the device, the finer ones first.
    ///
    /// # Errors
    /// More than a pass is bound to in one buffer, cancelled, or a failing device.
    pub(super) fn upload(
        context: &Context,
        volume: &Arc<ScalarVolume>,
        means: &[Coefficients; COARSER],
        ticket: &Ticket,
    ) -> Result<Self, GpuError> {
        let bricks = bricks_of_cut(volume.lattice.dims);
        let stored = [0, 1].map(|i| means[i].dims.map(|n| n + 2 * PAD));
        let first = CUT_HEAD as usize + bricks.iter().product::<usize>().div_ceil(4);
        let begins = [first, first + stored[0].iter().product::<usize>()];
        let words = begins[1] + stored[1].iter().product::<usize>();
        let most = most_words(context);
        if words as u64 > most {
            return Err(GpuError::TooLarge {
                what: "means of a volume",
                limit: format!("{most} of them with their borders, and bricks"),
                found: words.to_string(),
                advice: "quick pictures are of all of the field",
            });
        }
        let min = means[0].min.min(means[1].min);
        let max = means[0].max.max(means[1].max);
        let are_floats = !step_of_sixteen_bits(volume, min, max).is_fine();
        let (offset, scale) = match are_floats {
            true => (means[0].bias, 1.0),
            false => (min, (max - min).max(f64::MIN_POSITIVE)),
        };
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let buffer = Growing::make(context, "means for cuts", usage, 4 * words as u64);
        for ((level, [sx, sy, sz]), begin) in means.iter().zip(stored).zip(begins) {
            let dims = level.dims;
            let value = |index: usize| {
                let at = [index % sx, index / sx % sy, index / (sx * sy)];
                let [x, y, z] = [0, 1, 2].map(|a| mirrored(at[a], PAD, dims[a]));
                level.get((z * dims[1] + y) * dims[0] + x)
            };
            let count = sx * sy * sz;
            let code = |index: usize| -> u32 {
                // Rounded to the nearest of 65 536.
                let code = (value(index) - offset) / scale * 65535.0 + 0.5;
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "clamped"
                )]
                let code = code.clamp(0.0, 65535.0) as u32;
                code
            };
            let word = |index: usize| match are_floats {
                true => narrow(value(index) - offset).to_bits(),
                false => code(index) | code((index + 1).min(count - 1)) << 16,
            };
            write_words(context, (&buffer, begin), 0..count, &word, ticket)?;
        }
        #[expect(clippy::cast_possible_truncation, reason = "no more than `most_words`")]
        let place = |i: usize| [stored[i][0], stored[i][1], begins[i]].map(|n| n as u32);
        let (source, places) = (Arc::clone(volume), [place(0), place(1)]);
        Ok(Self { source, buffer, are_floats, offset, scale, bricks, places, cut: None })
    }

    pub(super) fn size_bytes(&self) -> u64 {
        self.buffer.size()
    }

    pub(super) fn are_of(&self, volume: &Arc<ScalarVolume>) -> bool {
        Arc::ptr_eq(&self.source, volume)
    }

    /// Writes a cut, unless it is there, for a field with so many cells for its values.
    ///
    /// # Errors
    /// One of another lattice.
    pub(super) fn set_cut(
        &mut self,
        context: &Context,
        cut: &Arc<FieldCut>,
        values: CellsOfValues,
    ) -> Result<(), GpuError> {
        if cut.dims != self.bricks {
            return Err(GpuError::Unsupported(format!(
                "expected a cut of {:?} bricks, found one of {:?}",
                self.bricks, cut.dims
            )));
        }
        let [bx, by, bz] = self.bricks.map(|n| n as u32);
        let [[ax, ay, a], [cx, cy, c]] = self.places;
        // The same numbers as those of a field's own cells, so that no step is where they meet.
        let at_zero = narrow(values.at_zero + values.per_value * self.offset);
        let per_stored = narrow(values.per_value * self.scale);
        let [x, y] = [at_zero, per_stored].map(f32::to_bits);
        let head: [u32; CUT_HEAD as usize] =
            [bx, by, bz, 0, ax, ay, a, 0, cx, cy, c, 0, x, y, 0, 0];
        context.queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&head));
        if self.cut.as_ref().is_some_and(|held| Arc::ptr_eq(held, cut)) {
            return Ok(());
        }
        let levels = cut.levels();
        let mut bytes = distances(self.bricks, |brick| levels[brick] < EMPTY);
        for (byte, &level) in bytes.iter_mut().zip(levels) {
            *byte = if level < EMPTY { level } else { *byte + EMPTY - 1 };
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        context.queue.write_buffer(&self.buffer, 4 * u64::from(CUT_HEAD), &bytes);
        self.cut = Some(Arc::clone(cut));
        Ok(())
    }
}

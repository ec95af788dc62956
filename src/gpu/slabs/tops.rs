//! The greatest value near each brick, so that rays whose greatest value is sought leap over what lies below it.

use super::SlabTable;
use crate::gpu::buffers::Growing;
use crate::gpu::context::Context;
use crate::gpu::field::DeviceField;
use crate::gpu::layout::narrow;
use crate::scene::AlongRay;

/// Four bytes a word, a byte a brick: a top in steps above the least of them.
#[derive(Debug)]
pub(super) struct Tops {
    pub(super) words: wgpu::Buffer,
    along: AlongRay,
    reach: usize,
    lowest: f64,
    step: f64,
}

/// Steps that tops are rounded up to.
const STEPS: f64 = 255.0;

impl Tops {
    /// Tops within `reach` voxels of each brick, of values that are turned about where the least is sought.
    pub(super) fn new(
        context: &Context,
        field: &DeviceField,
        along: AlongRay,
        reach: usize,
    ) -> Self {
        let tops = field.tops(along == AlongRay::Minimum, reach);
        let is_known = |top: &&f64| top.abs() < f64::from(f32::MAX) / 2.0;
        let known = tops.iter().filter(is_known);
        let [lowest, highest] =
            known.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], &top| [a.min(top), b.max(top)]);
        let step = ((highest - lowest) / (STEPS - 1.0)).max(f64::MIN_POSITIVE);
        // A step more, so that no rounding puts one below what it stands for. Unknown ones are above all.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let code = |top: &f64| (((top - lowest) / step).ceil() + 1.0).clamp(0.0, STEPS) as u8;
        let mut bytes: Vec<u8> = tops.iter().map(code).collect();
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let words = Growing::make(context, "greatest values", usage, bytes.len() as u64);
        context.queue.write_buffer(&words, 0, &bytes);
        Self { words, along, reach, lowest, step }
    }

    /// Whether they serve for another picture.
    pub(super) fn serve(&self, along: AlongRay, reach: usize) -> bool {
        self.along == along && self.reach == reach
    }

    /// `Slabs::tops`: the top of byte 0, and what one more is, as cells of a table.
    pub(super) fn in_cells(&self, table: &SlabTable) -> [f32; 4] {
        let sign = if self.along == AlongRay::Minimum { -1.0 } else { 1.0 };
        let values = table.values;
        let lowest = sign * values.at_zero + values.per_value * self.lowest;
        [narrow(lowest), narrow(values.per_value * self.step), 0.0, 0.0]
    }
}

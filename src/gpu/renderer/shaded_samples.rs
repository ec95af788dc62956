//! Samples are shaded once for all the rays of a picture that meet them.

use super::Renderer;
use crate::gpu::GpuError;
use crate::gpu::buffers::Growing;
use crate::gpu::clock::Timestamps;
use crate::gpu::compute::{buffer, buffers, dispatch, rows_of};
use crate::gpu::frame::Pass;
use crate::gpu::shaded_samples::{BRICK_SAMPLES, SAMPLE_BYTES, ShadedSamples, Variant, slots_of};
use crate::gpu::shader;
use crate::scene::{OpacityModel, SplatSettings, View};
use std::ops::Range;

impl Renderer {
    /// Makes room for the shaded samples of a picture, and says how many bricks are to be shaded by
    /// [`Renderer::shade_bricks`] before it is drawn: 0 where a scene shades no samples, and where they are
    /// there.
    ///
    /// # Errors
    /// More samples that show than a buffer holds, or a failing device.
    pub fn bricks_to_shade(
        &mut self,
        view: &View,
        settings: &SplatSettings,
        unit_distance: f64,
    ) -> Result<u32, GpuError> {
        let variant = self.sample_shade().map(|shade| Variant {
            shade: shade.variant,
            published: settings.opacity_model == OpacityModel::Published,
            perspective: view.eye_distance.is_some(),
        });
        let Some(variant) = variant else {
            self.shaded.clear();
            self.write_looks(view);
            return Ok(0);
        };
        let Some(constants) = self.gather_constants(view, settings, (unit_distance, 0.0), 0..0)
        else {
            return Ok(0);
        };
        self.write_looks(view);
        let Some(volume) = &self.volume else { return Ok(0) };
        let Some(table) = &volume.table else { return Ok(0) };
        let mut key = bytemuck::bytes_of(&constants).to_vec();
        key.extend_from_slice(self.gathering.looks_bytes());
        let bricks = volume.source.bricks.dims.iter().product::<usize>();
        let bricks = u32::try_from(bricks).unwrap_or(u32::MAX);
        if key == self.shaded.key && self.shaded.variant == Some(variant) {
            return Ok(if self.shaded.is_whole { 0 } else { bricks });
        }
        let (slots, count) = slots_of(&table.visible_bits);
        let bytes = u64::from(count) * BRICK_SAMPLES * SAMPLE_BYTES;
        let limits = &self.context.limits;
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes > most {
            self.shaded.clear();
            return Err(GpuError::TooLarge {
                what: "shaded samples that can show",
                limit: format!("{}", most / SAMPLE_BYTES),
                found: (bytes / SAMPLE_BYTES).to_string(),
                advice: "let fewer values show, choose --classify after, or --engine native",
            });
        }
        use wgpu::BufferUsages as Usage;
        let make = |label, bytes| {
            Growing::make(&self.context, label, Usage::STORAGE | Usage::COPY_DST, bytes)
        };
        if self.shaded.samples.as_ref().is_none_or(|held| held.size() < bytes) {
            // The old ones go first: two need not fit.
            self.shaded.clear();
            self.shaded.samples = Some(make("shaded samples", bytes.max(SAMPLE_BYTES)));
        }
        let slots_held = make("brick slots", size_of_val(&slots[..]) as u64);
        self.context.queue.write_buffer(&slots_held, 0, bytemuck::cast_slice(&slots));
        self.shaded.slots = Some(slots_held);
        (self.shaded.key, self.shaded.is_whole) = (key, false);
        self.shaded.variant = Some(variant);
        self.write_traversal(view, &(0..0), 0);
        self.gathering.shading = constants;
        self.note_bytes();
        self.context.check()?;
        Ok(bricks)
    }

    /// Shades the samples of some of the volume's bricks; once the last were, all are. Returns wall
    /// milliseconds.
    ///
    /// # Errors
    /// A failing device.
    pub fn shade_bricks(&mut self, bricks: Range<u32>) -> Result<f64, GpuError> {
        let mut constants = self.gathering.shading;
        (constants.piece[1], constants.piece[2]) = (bricks.start, bricks.end);
        self.gathering.write(&self.context, &constants);
        let wall_ms = self.run(&[Pass::ShadeSamples { bricks: bricks.len() as u32 }])?;
        let all = self.volume.as_ref().map_or(0, |v| v.source.bricks.dims.iter().product());
        self.shaded.is_whole = bricks.end as usize == all;
        Ok(wall_ms)
    }

    pub(super) fn shade_samples(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        bricks: u32,
        clock: Option<&Timestamps>,
    ) {
        let ShadedSamples { slots, samples, variant, .. } = &self.shaded;
        let (Some(slots), Some(samples), &Some(variant)) = (slots, samples, variant) else {
            return;
        };
        let Some(volume) = &self.volume else { return };
        let Some(table) = &volume.table else { return };
        let pipeline = self.pipelines.compute(&self.context, &variant.program());
        let mut entries = vec![buffer(0, &self.traversal)];
        entries.extend(buffers(1, volume.samples.bound()));
        entries.extend(buffers(5, [&table.entries, &table.visible, self.gathering.buffer()]));
        entries.extend(self.gathering.looks().map(|looks| buffer(9, looks)));
        entries.extend(buffers(12, [slots, samples]));
        let name = shader::SHADE_SAMPLES.name;
        dispatch(&self.context, encoder, name, &pipeline, &entries, rows_of(bricks), clock);
    }
}

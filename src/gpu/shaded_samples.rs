//! Samples that are shaded once for all the rays of a picture that meet them (`shaders/shade_samples.wgsl`).

use std::ops::Range;

use super::GpuError;
use super::buffers::Growing;
use super::compute::{buffer, buffers, dispatch, rows_of};
use super::frame::Pass;
use super::pipelines::{Program, flag};
use super::renderer::Renderer;
use super::shade::ShadeVariant;
use super::shader;
use super::timing::Timestamps;
use crate::scene::{OpacityModel, SplatSettings, View};

/// Samples of a brick.
const BRICK_SAMPLES: u64 = 512;
/// Bytes of a sample: four 32-bit floats.
const SAMPLE_BYTES: u64 = 16;

/// What the samples on the device are shaded for.
#[derive(Debug, Default)]
pub(super) struct ShadedSamples {
    slots: Option<wgpu::Buffer>,
    samples: Option<wgpu::Buffer>,
    /// Every constant that they depend on, and whether all of them are shaded.
    key: Vec<u8>,
    is_whole: bool,
    variant: Option<Variant>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Variant {
    shade: ShadeVariant,
    published: bool,
    perspective: bool,
}

impl ShadedSamples {
    /// Lets go of them.
    pub(super) fn clear(&mut self) {
        (self.slots, self.samples, self.is_whole) = (None, None, false);
        self.key.clear();
    }

    /// Slots of bricks, and samples, where all are there.
    pub(super) fn whole(&self) -> Option<[&wgpu::Buffer; 2]> {
        if !self.is_whole {
            return None;
        }
        Some([self.slots.as_ref()?, self.samples.as_ref()?])
    }

    pub(super) fn size_bytes(&self) -> u64 {
        [&self.slots, &self.samples].into_iter().flatten().map(wgpu::Buffer::size).sum()
    }
}

/// How many bricks show before each word of their bits, and in all.
fn slots_of(visible: &[u32]) -> (Vec<u32>, u32) {
    let mut before = 0;
    let slots = visible
        .iter()
        .map(|word| {
            let slot = before;
            before += word.count_ones();
            slot
        })
        .collect();
    (slots, before)
}

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
        self.write_traversal(view, &(0..0), 0, 0);
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

impl Variant {
    fn program(self) -> Program {
        let mut constants = self.shade.constants();
        constants.push(("published", flag(self.published)));
        constants.push(("perspective", flag(self.perspective)));
        Program { shader: shader::SHADE_SAMPLES, constants }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_that_show_have_slots_one_after_the_other() {
        assert_eq!(slots_of(&[0b1011, 0, u32::MAX, 1]), (vec![0, 3, 3, 35], 36));
        assert_eq!(slots_of(&[]), (vec![], 0));
    }
}

//! Samples that are shaded once for all the rays of a picture that meet them (`shaders/shade_samples.wgsl`).

use std::collections::HashMap;
use std::ops::Range;

use super::GpuError;
use super::buffers::Growing;
use super::compute::{dispatch, groups_of_tiles};
use super::context::Context;
use super::frame::Pass;
use super::gather::entry;
use super::pipelines::{compute_pipeline, flag};
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
    pipelines: HashMap<Variant, wgpu::ComputePipeline>,
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

    pub(super) fn pipeline_count(&self) -> usize {
        self.pipelines.len()
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
    /// [`Renderer::shade_bricks`] before it is drawn: 0 where a scene shades no samples, where they are
    /// there, and where there is no room: each ray then shades those it meets.
    ///
    /// # Errors
    /// A failing device.
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
        if bytes > limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) {
            self.shaded.clear();
            return Ok(0);
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
        (constants.part[0], constants.part[1]) =
            (bricks.start.cast_signed(), bricks.end.cast_signed());
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
        let ShadedSamples { slots, samples, variant, pipelines, .. } = &mut self.shaded;
        let (Some(slots), Some(samples), &mut Some(variant)) = (slots, samples, variant) else {
            return;
        };
        let context = &self.context;
        let pipeline = pipelines.entry(variant).or_insert_with(|| pipeline(context, variant));
        let Some(volume) = &self.volume else { return };
        let Some(table) = &volume.table else { return };
        let mut bound = vec![&self.traversal];
        bound.extend(volume.samples.bound());
        bound.extend([&table.entries, &table.visible, self.gathering.buffer()]);
        let bound = (0_u32..).zip(bound).chain(self.gathering.looks());
        let groups = [bound.collect::<Vec<_>>(), vec![(0, &*slots), (1, &*samples)]];
        let groups = (0..).zip(&groups).map(|(at, bound)| {
            let entries: Vec<_> = bound.iter().copied().map(entry).collect();
            context.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(shader::SHADE_SAMPLES),
                layout: &pipeline.get_bind_group_layout(at),
                entries: &entries,
            })
        });
        let groups: Vec<_> = groups.collect();
        let [across, down] = groups_of_tiles(bricks);
        dispatch(encoder, shader::SHADE_SAMPLES, pipeline, &groups, [across, down, 1], clock);
    }
}

fn pipeline(context: &Context, variant: Variant) -> wgpu::ComputePipeline {
    let shader = shader::shading_samples(variant.shade.regions > 0);
    let mut constants = variant.shade.constants();
    constants.push(("published", flag(variant.published)));
    constants.push(("perspective", flag(variant.perspective)));
    compute_pipeline(context, shader, &shader.module(&context.device), &constants)
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

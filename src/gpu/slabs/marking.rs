//! Which pixels of a smaller picture get more rays.

use super::SlabPass;
use crate::gpu::buffers::Growing;
use crate::gpu::context::Context;
use crate::gpu::marks::{
    LANES, MOST_PIXELS, MOST_PIXELS_OF_MEANS, Marked, RAYS_A_SAMPLE, WORD_BITS, marks,
};
use crate::hierarchy::{EMPTY_BRICK, specks};
use crate::scene::{MOST_RAYS, SplatSettings, View};

/// Samples that all rays of a marked pixel pass, at most, where threads are many. One thread walks all of them. A processor,
/// which ends loops, draws other pixels meanwhile; a GPU has long drawn all others. 8 × 8 rays through 1024³ samples took
/// 45 ms of an H200, all of the picture 31.
const MOST_STEPS_OF_GPUS: f64 = 10_000.0;

impl SlabPass {
    /// Marks the pixels of a smaller picture in which rays would miss small things: they get rays half a
    /// sample apart, or a sample where that is more than [`MOST_RAYS`] or `most_rays` together. Where those do
    /// not suffice for all things that touch nothing large, nothing is marked. The number of rays.
    pub(in crate::gpu) fn mark(
        &mut self,
        context: &Context,
        view: &View,
        settings: &SplatSettings,
        most_rays: u64,
    ) -> u64 {
        self.marked = None;
        let Some(halved) = self.halved(view).filter(|view| view.enlarged > 1.0) else { return 0 };
        let apart = 1.0 / halved.narrowest_voxel_pixels();
        let side = apart * RAYS_A_SAMPLE;
        let is_averaged = halved.rays_per_side(settings.kernel, settings.extent) > 1;
        let are_means = self.field.as_ref().is_some_and(|field| field.has_widths);
        if side.is_nan() || side <= 1.0 && !are_means || is_averaged {
            return 0;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1..=8")]
        let [wanted, apart] = [side, apart].map(|n| n.ceil().clamp(1.0, MOST_RAYS) as u32);
        let (Some(field), Some(table)) = (&self.field, &mut self.table) else { return 0 };
        let longest = field.dims.into_iter().max().unwrap_or(1) as f64;
        let wanted = match context.ends_loops {
            true => wanted,
            false => wanted.min((MOST_STEPS_OF_GPUS / longest).sqrt().max(2.0) as u32),
        };
        let wanted = if are_means { wanted.max(2) } else { wanted };
        if apart > wanted {
            return 0;
        }
        // A voxel of tents shows in two bricks along each axis, one of splines that are sharpened in up to
        // four, and so does what is a little wider.
        let plate = 2 * field.pad + (apart as usize).div_ceil(EMPTY_BRICK);
        let found = match &mut table.specks {
            Some((of, found)) if *of == plate => found,
            specks_of => {
                let found = specks(field.bricks(), &table.shows, plate);
                &mut specks_of.insert((plate, found)).1
            }
        };
        if found.is_empty() {
            return 0;
        }
        // Pixels beside one another wait for the one among them with the most rays.
        let more = |side: u32| u64::from(LANES * (side * side - 1));
        let least_side = apart.max(2).min(wanted);
        let most_blocks = most_rays / more(least_side);
        let apart = &found[..found.partition_point(|speck| speck.is_apart)];
        // All of them, or none: a part of many looks like something else.
        let sets = [&found[..], apart];
        let most = (if are_means { MOST_PIXELS_OF_MEANS } else { MOST_PIXELS }, most_blocks);
        let Some(marks) = sets.iter().find_map(|set| marks(set, &halved, most)) else {
            return 0;
        };
        if marks.blocks == 0 {
            return 0;
        }
        let fits = |side: &u32| marks.blocks * more(*side) <= most_rays;
        let side = (least_side..=wanted).rev().find(fits).unwrap_or(least_side);
        let (begin, bytes) = (4 * table.empty_words, bytemuck::cast_slice(&marks.words));
        if begin >= 4 << WORD_BITS {
            return 0;
        }
        let needed = begin + bytes.len() as u64;
        if table.empty.size() < needed {
            let usage = table.empty.usage();
            let larger = Growing::make(context, "empty space and marks", usage, needed);
            let mut encoder = context.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&table.empty, 0, &larger, 0, begin);
            context.queue.submit([encoder.finish()]);
            table.empty = larger;
        }
        context.queue.write_buffer(&table.empty, begin, bytes);
        #[expect(clippy::cast_possible_truncation, reason = "below 2^28")]
        let word = table.empty_words as u32;
        self.marked = Some(Marked { view: *view, word, side });
        marks.blocks * more(side)
    }
}

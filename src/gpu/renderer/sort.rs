//! Keys are sorted, for tests and measurements.

use super::Renderer;
use crate::gpu::GpuError;
use crate::gpu::buffers::read_words;
use crate::gpu::scattered::Lists;
use crate::gpu::sort::MOST_KEYS;

impl Renderer {
    /// Sorts keys of at most `bits` bits, each with the word of the same place; equal ones keep
    /// their order. Returns keys, words, and the wall milliseconds of the sort alone. For tests and
    /// measurements.
    ///
    /// # Errors
    /// Over [`MOST_KEYS`], or a failing device.
    #[doc(hidden)]
    pub fn sort_pairs(
        &mut self,
        keys: &[u32],
        words: &[u32],
        bits: u32,
    ) -> Result<(Vec<u32>, Vec<u32>, f64), GpuError> {
        let count = u32::try_from(keys.len()).ok().filter(|&n| n <= MOST_KEYS);
        let Some(count) = count.filter(|_| keys.len() == words.len()) else {
            return Err(GpuError::Device(format!("{} keys to sort at once", keys.len())));
        };
        let context = &self.context;
        let sorter = &mut self.lists.get_or_insert_with(|| Lists::new(context)).sorter;
        sorter.reserve(context, count)?;
        context.queue.write_buffer(&sorter.keys[0].buffer, 0, bytemuck::cast_slice(keys));
        context.queue.write_buffer(&sorter.words[0].buffer, 0, bytemuck::cast_slice(words));
        let (passes, side) = sorter.prepare(context, count, bits)?;
        let wall_ms = self.run(&passes)?;
        let Some(lists) = &self.lists else { return Ok((Vec::new(), Vec::new(), 0.0)) };
        let bytes = u64::from(count) * 4;
        let keys = read_words(&self.context, &lists.sorter.keys[side].buffer, bytes)?;
        let words = read_words(&self.context, &lists.sorter.words[side].buffer, bytes)?;
        Ok((keys, words, wall_ms))
    }
}

//! Samples that are shaded once for all the rays of a picture that meet them (`shaders/shade_samples.wgsl`).

use super::pipelines::{Program, flag};
use super::shade::ShadeVariant;
use super::shader;

/// Samples of a brick.
pub(super) const BRICK_SAMPLES: u64 = 512;
/// Bytes of a sample: four 32-bit floats.
pub(super) const SAMPLE_BYTES: u64 = 16;

/// What the samples on the device are shaded for.
#[derive(Debug, Default)]
pub(super) struct ShadedSamples {
    pub(super) slots: Option<wgpu::Buffer>,
    pub(super) samples: Option<wgpu::Buffer>,
    /// Every constant that they depend on, and whether all of them are shaded.
    pub(super) key: Vec<u8>,
    pub(super) is_whole: bool,
    pub(super) variant: Option<Variant>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    pub(super) shade: ShadeVariant,
    pub(super) published: bool,
    pub(super) perspective: bool,
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
pub(super) fn slots_of(visible: &[u32]) -> (Vec<u32>, u32) {
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

impl Variant {
    pub(super) fn program(self) -> Program {
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

//! Numbers in memory of large pages.

use std::alloc::{Layout, handle_alloc_error};
use std::ops::{Deref, DerefMut};

use memmap2::MmapMut;

/// Many numbers, 0 at first, in pages of megabytes where the system has some. Rays that lie far apart ask for samples that
/// lie far apart: of pages of 4 KiB the processor looks up the place of nearly each of them anew.
#[derive(Debug)]
pub struct LargePages {
    pages: MmapMut,
    count: usize,
}

impl LargePages {
    /// So many zeros. Where there is no memory the program ends, as it does with a `Vec`: whoever asks has looked before
    /// ([`super::memory::require`]).
    pub fn zeros(count: usize) -> Self {
        let bytes = count.max(1).saturating_mul(size_of::<f32>());
        let pages = MmapMut::map_anon(bytes).unwrap_or_else(|_| {
            handle_alloc_error(Layout::array::<f32>(count).unwrap_or(Layout::new::<f32>()))
        });
        #[cfg(target_os = "linux")]
        if let Err(error) = pages.advise(memmap2::Advice::HugePage) {
            log::debug!("memory has small pages alone: {error}");
        }
        Self { pages, count }
    }

    /// Where they begin: what a loop asks for that looks at no lengths.
    #[inline(always)]
    pub fn as_ptr(&self) -> *const f32 {
        self.pages.as_ptr().cast()
    }
}

impl Deref for LargePages {
    type Target = [f32];

    #[inline(always)]
    fn deref(&self) -> &[f32] {
        &bytemuck::cast_slice(&self.pages)[..self.count]
    }
}

impl DerefMut for LargePages {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut bytemuck::cast_slice_mut(&mut self.pages)[..self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::LargePages;

    #[test]
    fn there_are_as_many_zeros_as_were_asked_for_and_they_keep_what_is_written() {
        for count in [0, 1, 3, 1 << 20] {
            let mut pages = LargePages::zeros(count);
            assert_eq!(pages.len(), count);
            assert!(pages.iter().all(|value| *value == 0.0), "{count}");
            pages.fill(1.5);
            assert!(pages.iter().all(|value| *value == 1.5), "{count}");
        }
    }
}

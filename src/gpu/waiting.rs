//! Rays among vectors in as many dispatches as they need, on adapters that end loops (`gpu::turns`).
//!
//! How many splats a ray meets, and where, only it knows: so it counts its turns, keeps what it has and
//! waits for another dispatch, and says so, until nothing of it is left. No list is too long for this.

use std::ops::Range;

use super::GpuError;
use super::frame;
use super::renderer::Renderer;
use super::slabs::PictureConstants;
use super::turns::{ENDS, GOES_ON};
use crate::plan::SlabField;
use crate::scene::{SplatSettings, View};

impl Renderer {
    /// Repeats a dispatch, told by its argument whether it goes on or ends rays, until no ray waits;
    /// milliseconds.
    pub(super) fn until_none_waits(
        &mut self,
        mut dispatch: impl FnMut(&mut Self, u32) -> Result<f64, GpuError>,
    ) -> Result<f64, GpuError> {
        let (mut wall_ms, mut goes_on) = (0.0, 0);
        loop {
            self.kept.clear_waiting(&self.context);
            wall_ms += dispatch(self, goes_on)?;
            let [waiting, ended] = self.kept.waiting(&self.context)?;
            if ended > 0 {
                return Err(self.too_many_turns());
            }
            if waiting == 0 {
                break;
            }
            goes_on = GOES_ON;
        }
        Ok(wall_ms + dispatch(self, GOES_ON | ENDS)?)
    }

    /// The slabs of a field and the vectors in them, of some tiles.
    pub(super) fn draw_slabs_among_vectors(
        &mut self,
        which: SlabField,
        view: &View,
        settings: &SplatSettings,
        picture: PictureConstants,
        ranges: &[Range<u32>],
    ) -> Result<f64, GpuError> {
        let what = (view, settings, picture);
        let Some((side, [looks, turns])) = self.rays_among_vectors(which, what) else {
            return Err(GpuError::Device("slabs came before their field".to_owned()));
        };
        let mut wall_ms = 0.0;
        for tiles in ranges {
            for ray in 0..side * side {
                wall_ms += self.until_none_waits(|renderer, flags| {
                    let part = [ray, ray + 1, looks, flags | turns << 2];
                    renderer.write_slabs(which, what, (tiles, part))?;
                    renderer.run(&frame::slab_piece(tiles.len() as u32, false))
                })?;
            }
        }
        Ok(wall_ms)
    }
}

//! Which back end draws a kernel faster here: measured, where both can.

use std::collections::HashMap;

use super::draw::{DrawError, Drawer, Observer};
use super::slabs::STOP_BELOW;
use crate::gpu::tile_count;
use crate::kernel::Kernel;
use crate::scene::{Backend, Scene, View};

/// Runs of tiles that are timed, spread over the picture,
const RUNS: u32 = 16;
/// each this share of all tiles.
const SHARE: u32 = 256;

/// What was measured on this device.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    faster: HashMap<Kernel, Backend>,
}

impl Drawer {
    /// What draws a scene at full quality in the window: what was chosen, or can; else the faster
    /// one, or until that was measured the fixed rule's.
    pub fn window_backend(&self, scene: &Scene) -> Backend {
        let splat = &scene.splat;
        if splat.backend != Backend::Auto || splat.needs_tiles() {
            return splat.fixed_backend();
        }
        self.calibration.faster.get(&splat.kernel).copied().unwrap_or(splat.fixed_backend())
    }

    /// Whether the faster back end for a scene is still to be found.
    pub fn is_to_be_calibrated(&self, scene: &Scene) -> bool {
        let splat = &scene.splat;
        let open = splat.backend == Backend::Auto && !splat.needs_tiles();
        open && !self.calibration.faster.contains_key(&splat.kernel)
    }

    /// Times a sixteenth of the tiles of a picture that took triangles `raster_ms`, and remembers
    /// which is faster for its kernel. The picture on the device is lost.
    ///
    /// # Errors
    /// Interrupted by the observer, or the device.
    pub fn calibrate(
        &mut self,
        scene: &Scene,
        size: [u32; 2],
        raster_ms: f64,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let view = View::new(scene, size);
        self.begin(scene, &view, scene.splat.kernel)?;
        let total = tile_count(size);
        let length = (total / SHARE).max(1);
        let (mut tiles_ms, mut timed) = (0.0, 0);
        // The first run is drawn twice: once to compile, which does not count.
        for (number, run) in std::iter::once(0).chain(0..RUNS).enumerate() {
            let from = u64::from(total) * u64::from(run) / u64::from(RUNS);
            let from = u32::try_from(from).unwrap_or(0);
            let tiles = from..(from + length).min(total);
            let count = tiles.len();
            let (splat, unit) = (&scene.splat, scene.opacity_unit_distance());
            let ms = self.renderer.draw_gathered(&view, splat, unit, STOP_BELOW, tiles)?;
            if observer.piece_done(&mut self.renderer, 0.0) {
                return Err(DrawError::Interrupted);
            }
            if number > 0 {
                tiles_ms += ms;
                timed += count;
            }
        }
        let whole_ms = tiles_ms * f64::from(total) / timed.max(1) as f64;
        let faster = if whole_ms < raster_ms { Backend::Tiles } else { Backend::Raster };
        log::info!(
            "{} kernels: {raster_ms:.0} ms as triangles, about {whole_ms:.0} ms in tiles",
            scene.splat.kernel.name()
        );
        self.calibration.faster.insert(scene.splat.kernel, faster);
        Ok(())
    }
}

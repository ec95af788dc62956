//! Which back end draws a task faster here: measured, where both can.

use std::collections::HashMap;

use super::draw::{DrawError, Drawer, Observer};
use super::engines::EngineKind;
use super::slabs::STOP_BELOW;
use crate::gpu::tile_count;
use crate::kernel::Kernel;
use crate::plan::Plan;
use crate::scene::Backend;

/// Runs of tiles that are timed, spread over the picture,
const RUNS: u32 = 16;
/// each this share of all tiles.
const SHARE: u32 = 256;

/// What both back ends take for one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BackEndTimes {
    /// With which kernel.
    pub kernel: Kernel,
    /// Milliseconds of the picture as triangles.
    pub raster_ms: f64,
    /// What it is thought to take in tiles, from a sixteenth of them, milliseconds.
    pub tiles_ms: f64,
}

impl BackEndTimes {
    /// What is faster.
    pub fn faster(&self) -> Backend {
        if self.tiles_ms < self.raster_ms { Backend::Tiles } else { Backend::Raster }
    }
}

/// What decides which back end is faster, beside the volume: a kernel, and how large it is on the
/// picture, in doublings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Task {
    kernel: Kernel,
    perspective: bool,
    doublings: i32,
}

impl Task {
    fn of(plan: &Plan) -> Self {
        let view = plan.view();
        #[expect(clippy::cast_possible_truncation, reason = "a few doublings of a pixel")]
        let doublings = view.voxel_pixels().max(f64::MIN_POSITIVE).log2().round() as i32;
        Self { kernel: plan.mode.kernel, perspective: view.eye_distance.is_some(), doublings }
    }
}

/// What was measured on this device, for the volume that is open.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    times: HashMap<Task, BackEndTimes>,
}

impl Drawer {
    /// What draws a plan at full quality in the window: what was chosen, or can (the native engine has tiles alone);
    /// else the faster one, or until that was measured the fixed rule's.
    pub fn window_backend(&self, plan: &Plan) -> Backend {
        if self.engines.of_plan(plan) == EngineKind::Native {
            return Backend::Tiles;
        }
        let measured = self.back_end_times(plan);
        measured.map_or_else(|| plan.backend(), |times| times.faster())
    }

    /// What was measured for a plan, where the choice is open.
    pub fn back_end_times(&self, plan: &Plan) -> Option<BackEndTimes> {
        let measured = || self.calibration.times.get(&Task::of(plan)).copied();
        plan.is_backend_open().then(measured).flatten()
    }

    /// Whether the faster back end for a plan is still to be found.
    pub fn is_to_be_calibrated(&self, plan: &Plan) -> bool {
        !self.is_native() && plan.is_backend_open() && self.back_end_times(plan).is_none()
    }

    /// Times a sixteenth of the tiles of a picture that took triangles `raster_ms`, and remembers
    /// both. The picture on the device is lost.
    ///
    /// # Errors
    /// Interrupted by the observer, or the device.
    pub fn calibrate(
        &mut self,
        plan: &Plan,
        raster_ms: f64,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        self.within(plan, |drawer| drawer.calibrate_begun(plan, raster_ms, observer))
    }

    fn calibrate_begun(
        &mut self,
        plan: &Plan,
        raster_ms: f64,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let (view, size) = (plan.view(), plan.size);
        self.begin(plan, &view, plan.mode.kernel)?;
        let total = tile_count(size);
        let length = (total / SHARE).max(1);
        let (mut timed_ms, mut timed) = (0.0, 0);
        // The first run is drawn twice: once to compile, which does not count.
        for (number, run) in std::iter::once(0).chain(0..RUNS).enumerate() {
            let from = u64::from(total) * u64::from(run) / u64::from(RUNS);
            let from = u32::try_from(from).unwrap_or(0);
            let tiles = from..(from + length).min(total);
            let count = tiles.len();
            let (splat, unit) = (&plan.mode, plan.frame.unit_distance);
            let ms = self.engines.gpu()?.draw_gathered(&view, splat, unit, STOP_BELOW, tiles)?;
            if observer.piece_done(&mut self.engines, 0.0) {
                return Err(DrawError::Interrupted);
            }
            if number > 0 {
                timed_ms += ms;
                timed += count;
            }
        }
        let tiles_ms = timed_ms * f64::from(total) / timed.max(1) as f64;
        let kernel = plan.mode.kernel;
        log::info!(
            "{} kernels: {raster_ms:.0} ms as triangles, about {tiles_ms:.0} ms in tiles",
            kernel.name()
        );
        let times = BackEndTimes { kernel, raster_ms, tiles_ms };
        self.calibration.times.insert(Task::of(plan), times);
        Ok(())
    }
}

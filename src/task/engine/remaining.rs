//! The end of a view's way: what its last picture is still off by, and smooth edges.

use std::sync::Arc;
use std::time::Instant;

use super::rungs::{no_device, smooths};
use super::watch::{Manner, Watch};
use super::worker::Worker;
use super::{FrameRequest, Picture};
use crate::core::colour::srgb_bytes;
use crate::plan::Plan;
use crate::scene::SplatSettings;
use crate::task::draw::{DrawError, Drawer, Rung};
use crate::task::remaining::{self, Told};
use crate::task::smooth;

/// The picture is there already.
const BEHIND_IT: Manner = Manner::InPieces { show_partial: false, before: 1.0, after: 1.0 };

/// The last picture of a view, and its request with the slabs that it came to.
pub(super) struct LastOfView {
    pub(super) request: FrameRequest,
    pub(super) picture: Arc<Picture>,
}

impl Worker {
    /// [`Worker::end`] with the `full` that was published last, where nothing follows it.
    pub(super) fn end_in_full(&mut self) -> Result<(), DrawError> {
        match self.finished.clone() {
            Some((request, picture)) => self.end(LastOfView { request, picture }),
            None => Ok(()),
        }
    }

    /// Measures what the last picture of a view is off by, and smooths its edges where that is wanted and it has some, unless
    /// something newer comes; it is published again with each. The light on the device is another one afterwards.
    pub(super) fn end(&mut self, last: LastOfView) -> Result<(), DrawError> {
        let LastOfView { request, picture } = last;
        if picture.size != request.size {
            return Ok(());
        }
        let plan = request.plan();
        let is_measured = picture.report.remaining_rmse.is_some();
        let is_smooth = picture.report.smoothed_ms.is_some();
        let smooths = smooths(&request) && !is_smooth && smooth::has_edges(&plan);
        let needs_light = smooths || !is_measured && remaining::needs_light(&plan);
        let light = if needs_light { self.finished_light(&request)? } else { Vec::new() };
        let picture = match is_measured {
            true => picture,
            false => self.tell_remaining(&request, (&plan, &light), &picture)?,
        };
        if smooths {
            self.smooth(&request, light, &picture)?;
        }
        Ok(())
    }

    /// The light of the last picture of a view: drawn again, where something was drawn since.
    fn finished_light(&mut self, request: &FrameRequest) -> Result<Vec<[f32; 4]>, DrawError> {
        if !self.holds_finished {
            self.drawn(request, Rung::Full, BEHIND_IT)?;
        }
        Ok(self.device()?.engines.read_light()?)
    }

    fn tell_remaining(
        &mut self,
        request: &FrameRequest,
        (plan, light): (&Plan, &[[f32; 4]]),
        picture: &Arc<Picture>,
    ) -> Result<Arc<Picture>, DrawError> {
        let found = self.behind(request, |drawer, watch| {
            Ok(remaining::of_finished(drawer, plan, light, watch))
        })?;
        let found = Told::of(plan, found)?;
        let Told { rmse, within_db } = found;
        self.last_told = Some((plan.clone(), found));
        let mut told = (**picture).clone();
        (told.report.remaining_rmse, told.report.remaining_within_db) = (Some(rmse), within_db);
        Ok(self.publish_instead(picture, told))
    }

    fn smooth(
        &mut self,
        request: &FrameRequest,
        light: Vec<[f32; 4]>,
        picture: &Arc<Picture>,
    ) -> Result<(), DrawError> {
        let start = Instant::now();
        let smoothed = self.behind(request, |drawer, watch| {
            let plan = request.plan();
            let backend = drawer.window_backend(&plan);
            let plan = plan.in_mode(SplatSettings { backend, ..plan.mode });
            drawer.smoothed(&plan, light, watch)
        })?;
        let mut smooth = (**picture).clone();
        smooth.rgba = srgb_bytes(&smoothed, request.scene.background.light());
        smooth.report.smoothed_ms = Some(start.elapsed().as_secs_f64() * 1e3);
        self.publish_instead(picture, smooth);
        Ok(())
    }

    /// Work of the drawer behind a finished picture, which the device has no longer afterwards.
    fn behind<T>(
        &mut self,
        request: &FrameRequest,
        work: impl FnOnce(&mut Drawer, &mut Watch<'_>) -> Result<T, DrawError>,
    ) -> Result<T, DrawError> {
        let Some(mut drawer) = self.drawer.take() else { return Err(no_device()) };
        self.holds_finished = false;
        let mut watch = Watch::new(self, request, BEHIND_IT, &drawer);
        let done = work(&mut drawer, &mut watch);
        self.drawer = Some(drawer);
        done
    }

    /// Publishes the picture of a view once more, of which more is known or seen.
    fn publish_instead(&mut self, picture: &Arc<Picture>, by: Picture) -> Arc<Picture> {
        let by = Arc::new(by);
        if let Some((_, finished)) = &mut self.finished
            && Arc::ptr_eq(finished, picture)
        {
            *finished = Arc::clone(&by);
        }
        self.publish(Arc::clone(&by));
        by
    }
}

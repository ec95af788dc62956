//! What the last picture of a view is still off by, found once nothing else is to be drawn.

use std::sync::Arc;

use super::rungs::no_device;
use super::watch::{Manner, Watch};
use super::worker::Worker;
use super::{FrameRequest, Picture};
use crate::task::draw::{DrawError, Rung};
use crate::task::remaining::{self, Told};

/// The last picture of a view, and its request with the slabs that it came to.
pub(super) struct LastOfView {
    pub(super) request: FrameRequest,
    pub(super) picture: Arc<Picture>,
}

impl Worker {
    /// [`Worker::tell_remaining`] of the `full` that was published last, where nothing follows it.
    pub(super) fn tell_remaining_of_full(&mut self) -> Result<(), DrawError> {
        match self.finished.clone() {
            Some((request, picture)) => self.tell_remaining(LastOfView { request, picture }),
            None => Ok(()),
        }
    }

    /// Measures what the last picture of a view is off by, unless something newer comes, and publishes it again with
    /// that. The light on the device is another one afterwards.
    pub(super) fn tell_remaining(&mut self, last: LastOfView) -> Result<(), DrawError> {
        let LastOfView { request, picture } = last;
        if picture.report.remaining_rmse.is_some() || picture.size != request.size {
            return Ok(());
        }
        let plan = request.plan();
        let light = match remaining::needs_light(&plan) {
            true => {
                if !self.holds_finished {
                    let manner = Manner::InPieces { show_partial: false, before: 1.0, after: 1.0 };
                    self.drawn(&request, Rung::Full, manner)?;
                }
                self.device()?.engines.read_light()?
            }
            false => Vec::new(),
        };
        let Some(mut drawer) = self.drawer.take() else { return Err(no_device()) };
        self.holds_finished = false;
        let manner = Manner::InPieces { show_partial: false, before: 1.0, after: 1.0 };
        let mut watch = Watch::new(self, &request, manner, &drawer);
        let found = remaining::of_finished(&mut drawer, &plan, &light, &mut watch);
        self.drawer = Some(drawer);
        let found = Told::of(&plan, found)?;
        let Told { rmse, within_db } = found;
        self.last_told = Some((plan, found));
        let mut told = (*picture).clone();
        (told.report.remaining_rmse, told.report.remaining_within_db) = (Some(rmse), within_db);
        let told = Arc::new(told);
        if let Some((_, finished)) = &mut self.finished
            && Arc::ptr_eq(finished, &picture)
        {
            *finished = Arc::clone(&told);
        }
        self.publish(told);
        Ok(())
    }
}

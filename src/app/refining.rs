//! The window's part in refining beyond `full`: when it is asked for, and what is then on screen.

use super::window::Window;
use crate::scene::{Scene, SplatSettings, Visibility};
use crate::task::engine::EngineState;

impl Window {
    /// Refines the view at rest, however long that takes.
    pub(super) fn converge(&mut self) {
        let Some(scene) = &self.scene else { return };
        let refined = self.viewport.picture().and_then(|picture| picture.report.refined);
        if scene.splat.visibility != Visibility::Slabs {
            self.notices.note("Only slabs can be refined further: every other mode ends in full");
        } else if self.pacing.is_judging() {
            self.notices.note(
                "Modes are shown as they are while they are compared: close the accuracy panel \
                 and the comparison first",
            );
        } else if refined.is_none_or(|refined| !refined.convergence.is_reached()) {
            self.pacing.insist();
        }
    }

    /// The mode of the picture on screen: the scene's, perhaps with slabs that were doubled.
    pub(super) fn shown_mode(&self, scene: &Scene) -> SplatSettings {
        let refined = self.viewport.picture().and_then(|picture| picture.report.refined);
        let refined = refined.filter(|_| !self.pacing.is_moving());
        let slabs_per_voxel = refined.map_or(scene.splat.slabs_per_voxel, |refined| {
            refined.convergence.slabs_per_voxel.max(scene.splat.slabs_per_voxel)
        });
        SplatSettings { slabs_per_voxel, ..scene.splat }
    }

    /// Modes that are judged end in `full`.
    pub(super) fn pace_refining(&mut self) {
        let judging = self.accuracy.open || self.compare.on;
        let idle = matches!(self.parts.drawer.state(), EngineState::Idle);
        let is_full = self
            .viewport
            .picture()
            .is_some_and(|picture| picture.report.progress >= 1.0 && picture.report.rung == "full");
        if judging && idle && is_full {
            self.pacing.keep_full();
        }
        self.pacing.set_judging(judging);
    }
}

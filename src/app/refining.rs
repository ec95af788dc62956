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
            self.notices
                .hint("This mode cannot be refined further: choose the exact mode under Splats, or Slabs for Visibility there");
        } else if let Some(hint) = stays_full(self.accuracy.open, self.compare.on) {
            self.notices.hint(hint);
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
        let full = self
            .viewport
            .picture()
            .filter(|picture| picture.report.progress >= 1.0 && picture.report.level.is_full());
        if let Some(full) = full.filter(|_| judging && idle) {
            self.pacing.keep_full(full.report.smoothed_ms.is_some());
        }
        self.pacing.set_judging(judging);
    }
}

/// Why the view is not refined beyond `full` while modes are judged: what has to be closed, by its
/// key.
fn stays_full(accuracy: bool, comparison: bool) -> Option<&'static str> {
    match (accuracy, comparison) {
        (false, false) => None,
        (true, false) => Some("To refine further, close the accuracy panel (A)"),
        (false, true) => Some("To refine further, close the comparison (C)"),
        (true, true) => {
            Some("To refine further, close the accuracy panel (A) and the comparison (C)")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::stays_full;

    #[test]
    fn only_what_is_open_is_to_be_closed() {
        assert_eq!(stays_full(false, false), None);
        for (accuracy, comparison) in [(true, false), (false, true), (true, true)] {
            let words = stays_full(accuracy, comparison).expect("something is open");
            assert_eq!(words.contains("panel (A)"), accuracy, "{words}");
            assert_eq!(words.contains("comparison (C)"), comparison, "{words}");
        }
    }
}

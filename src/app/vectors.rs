//! Vectors in the window: which field, and the animation's clock.

use std::sync::Arc;
use std::time::Duration;

use eframe::egui::Context;

use super::job::{Ended, Job};
use super::window::Window;
use crate::scene::VectorLayer;
use crate::vector::PhaseClock;
use crate::volume::{VectorField, VolumeError};

/// Cycles a second when an animation is first started.
const FIRST_SPEED: f64 = 0.4;
/// Animated pictures a second at most, unless someone chooses otherwise: enough for motion, and sparing
/// of a battery.
pub(super) const MOST_FPS: u32 = 20;

/// The window's side of vectors.
#[derive(Debug)]
pub(super) struct Vectors {
    pub(super) clock: PhaseClock,
    /// Vectors of a field that was chosen, on their way.
    job: Option<Job<Result<VectorField, VolumeError>>>,
    /// When the phase was last moved on, seconds.
    moved_at: f64,
}

impl Default for Vectors {
    fn default() -> Self {
        Self { clock: PhaseClock::new(0.0, FIRST_SPEED), job: None, moved_at: 0.0 }
    }
}

impl Window {
    /// Starts to make the vectors of a field of the open file ready, or takes those there are away.
    pub(super) fn choose_vectors(&mut self, ctx: &Context, field: Option<usize>) {
        self.vectors.job = None;
        let Some(index) = field else {
            if let Some(scene) = &mut self.scene {
                scene.vectors = None;
            }
            return;
        };
        let Some(grid) = self.document.as_ref().map(|document| Arc::clone(&document.grid)) else {
            return;
        };
        let job = Job::start("vectors", "Preparing the vectors", ctx, move |ticket| {
            match grid.fields.get(index) {
                Some(field) => grid.vectors(field, ticket),
                None => Err(VolumeError::NoSuchField {
                    asked: format!("number {index}"),
                    available: grid.fields.iter().map(|field| field.name.clone()).collect(),
                }),
            }
        });
        self.vectors.job = Some(job);
    }

    /// Puts vectors that are ready into the scene.
    pub(super) fn take_vectors(&mut self) {
        let Some(ended) = self.vectors.job.as_ref().and_then(Job::poll) else { return };
        self.vectors.job = None;
        let Some(scene) = &mut self.scene else { return };
        match ended {
            Ended::Finished(Ok(field)) => {
                let opening = VectorLayer::new(Arc::new(field), false);
                let layer = match scene.vectors.take() {
                    // Another field keeps what was chosen, but for what belongs to its lengths.
                    Some(before) => VectorLayer {
                        settings: crate::vector::VectorSettings {
                            transfer: opening.settings.transfer.clone(),
                            opacity_by: opening.settings.opacity_by,
                            colour_by: opening.settings.colour_by,
                            coarser: opening.settings.coarser,
                            ..before.settings
                        },
                        phase: before.phase,
                        alone: before.alone,
                        ..opening
                    },
                    None => opening,
                };
                scene.vectors = Some(layer);
            }
            Ended::Finished(Err(VolumeError::Cancelled(_))) => {}
            Ended::Finished(Err(error)) => self.notices.error(error.to_string()),
            Ended::Lost => {
                self.notices.error("Preparing the vectors stopped on a bug of the program")
            }
        }
    }

    /// Starts or stops the animation.
    pub(super) fn toggle_animation(&mut self, ctx: &Context) {
        let has_vectors = self.scene.as_ref().is_some_and(|scene| scene.vectors.is_some());
        if !has_vectors {
            self.notices.hint("There are no vectors to animate: choose some under Vectors");
            return;
        }
        let runs = self.vectors.clock.is_running();
        self.vectors.clock.set_running(!runs, ctx.time());
    }

    /// Moves the marks on, as often as asked for.
    pub(super) fn pace_animation(&mut self, ctx: &Context) {
        let now = ctx.time();
        let Some(layer) = self.scene.as_mut().and_then(|scene| scene.vectors.as_mut()) else {
            self.vectors.clock.set_running(false, now);
            self.pacing.set_animation(None);
            return;
        };
        let clock = &self.vectors.clock;
        if !clock.is_moving() {
            layer.phase = clock.phase(now);
            self.pacing.set_animation(None);
            return;
        }
        let every = 1.0 / f64::from(self.settings.animation_fps.max(1));
        self.pacing.set_animation(Some(every * 1000.0));
        let waited = now - self.vectors.moved_at;
        // Passes come a little early or late.
        if waited >= 0.9 * every || waited < 0.0 {
            layer.phase = clock.phase(now);
            self.vectors.moved_at = now;
            ctx.request_repaint_after(Duration::from_secs_f64(every));
        } else {
            ctx.request_repaint_after(Duration::from_secs_f64(every - waited));
        }
    }
}

//! What is told of a picture while it is drawn, and what stops it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::report::picture;
use super::worker::Worker;
use super::{EngineState, FrameRequest};
use crate::scene::Shading;
use crate::task::cells::CutSource;
use crate::task::draw::{Drawer, Drawn, Observer, PIECE_MS};
use crate::task::engines::Canvas;
use crate::task::estimate;
use crate::task::level::LevelOfDetail;

/// How often progress within a rung is announced.
const PROGRESS_EVERY: Duration = Duration::from_millis(250);
/// How often a partial picture is published: presenting it takes longer than a piece.
const PARTIAL_EVERY: Duration = Duration::from_millis(300);
/// Pieces of a picture that nothing interrupts, milliseconds: each costs a wait, and adapters end
/// what takes seconds.
const WHOLE_PIECE_MS: f64 = 100.0;

/// How a rung is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) enum Manner {
    /// To its end, which its budget bounds, unless nobody wants it any more: a hand that moves on still sees it.
    Whole,
    /// Until something newer comes.
    InPieces {
        /// Publish the picture while it is drawn.
        show_partial: bool,
        /// Share of the whole way that is behind it, and that will be when it is done.
        before: f64,
        /// See `before`.
        after: f64,
    },
}

/// Announces a rung's progress, and stops it when something newer came.
pub(super) struct Watch<'a> {
    worker: &'a Worker,
    request: &'a FrameRequest,
    manner: Manner,
    start: Instant,
    last_progress: Instant,
    last_partial: Instant,
    active: Option<u64>,
    /// What cells that are asked for meanwhile are found in.
    cuts: Option<CutSource>,
}

impl<'a> Watch<'a> {
    pub(super) fn new(
        worker: &'a Worker,
        request: &'a FrameRequest,
        manner: Manner,
        drawer: &Drawer,
    ) -> Self {
        let start = Instant::now();
        Self {
            worker,
            request,
            manner,
            start,
            last_progress: start,
            last_partial: start,
            active: drawer.active_count(),
            cuts: drawer.cut_source(),
        }
    }
}

impl Observer for Watch<'_> {
    fn piece_ms(&self) -> f64 {
        match self.manner {
            Manner::Whole => WHOLE_PIECE_MS,
            Manner::InPieces { .. } => PIECE_MS,
        }
    }

    fn is_overtaken(&mut self) -> bool {
        match self.manner {
            Manner::Whole => self.worker.is_unwanted(),
            Manner::InPieces { .. } => self.worker.newer_came(),
        }
    }

    fn piece_done(&mut self, drawn_so_far: &mut dyn Canvas, done: f64) -> bool {
        if self.is_overtaken() {
            return true;
        }
        let Manner::InPieces { show_partial, before, after } = self.manner else { return false };
        self.worker.find_cells(self.cuts.as_ref());
        let share = before + (after - before) * done;
        if self.last_progress.elapsed() >= PROGRESS_EVERY {
            self.last_progress = Instant::now();
            #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
            self.worker.announce(EngineState::Drawing(share as f32));
        }
        if show_partial && done > 0.0 && done < 1.0 && self.last_partial.elapsed() >= PARTIAL_EVERY
        {
            let background = self.request.scene.background.light();
            // A failing device is reported by the rung itself.
            if let Ok(rgba) = drawn_so_far.present(background) {
                let kernels = (self.active.unwrap_or(0) as f64 * done) as u64;
                let drawn = Drawn {
                    size: self.request.size,
                    kernels,
                    is_shaded: Shading::is_shown_by(&self.request.scene.splat),
                    wall_ms: self.start.elapsed().as_secs_f64() * 1e3,
                    ..Drawn::default()
                };
                #[expect(clippy::cast_possible_truncation, reason = "0..1")]
                let progress = share.min(0.99) as f32;
                let level = (LevelOfDetail::FullInPart, progress);
                let seen = (&self.request.scene, self.request.size);
                let mut picture = picture(seen, level, &drawn, rgba, self.active);
                let coarse = self.worker.nearest_of(self.request);
                picture.report.estimated_rmse = Some(estimate::part_rmse(&picture, done, coarse));
                self.worker.publish(Arc::new(picture));
            }
            self.last_partial = Instant::now();
        }
        false
    }
}

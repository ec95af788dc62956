//! The cells of octree cuts for the window, found on the engine's thread beside the pictures.

use std::sync::Arc;

use super::worker::{REBUILDS, Worker};
use super::{Effort, Engine, FrameRequest};
use crate::gpu::GpuError;
use crate::plan::Plan;
use crate::scene::{Cells, Scene};
use crate::task::cells::CutSource;
use crate::task::draw::{DrawError, Observer};
use crate::task::engines::Canvas;
use crate::volume::ScalarVolume;

/// Most cells that are handed out, the largest first: their edges are painted in every pass.
pub const MOST_CELLS: usize = 20_000;

/// The cells of one cut of a view at rest.
#[derive(Debug, Clone)]
pub struct CellsRequest {
    /// What is to be seen.
    pub scene: Scene,
    /// Picture size in physical pixels, each at least 1: nodes under a pixel are not split.
    pub size: [u32; 2],
    /// The error that the cut is fitted to.
    pub max_error: f32,
}

/// The cells of a cut, and what they are of.
#[derive(Debug, Clone)]
pub struct FoundCells {
    /// The volume that they are cells of.
    pub volume: Arc<ScalarVolume>,
    /// The cells. Their error is the one asked for, or the least of a cut that is found quickly.
    pub cells: Cells,
    /// The error that was asked for.
    pub asked_error: f32,
    /// Whether this is the cut on the picture of a moving view, rather than one that was asked for.
    pub is_drawn: bool,
}

impl Engine {
    /// Asks for the cells of a cut, and from now on for those of every cut that a moving view is drawn
    /// with; `None` ends both. They are found between two pieces of a picture. Never blocks.
    pub fn request_cells(&self, request: Option<CellsRequest>) {
        let mut slot = self.shared.lock();
        slot.cells_wanted = request.is_some();
        slot.cells = request;
        slot.found_cells = None;
        drop(slot);
        self.shared.posted.notify_one();
    }

    /// The newest cells not yet taken, if any. Never blocks.
    pub fn take_cells(&self) -> Option<Arc<FoundCells>> {
        self.shared.lock().found_cells.take()
    }
}

impl Worker {
    /// Whether the cut of a moving view's picture is to be kept for its cells.
    pub(super) fn wants_cut_of(&self, request: &FrameRequest) -> bool {
        matches!(request.effort, Effort::Moving { .. }) && self.shared.lock().cells_wanted
    }

    /// The cells of the cut that was just drawn, where there was one.
    pub(super) fn publish_drawn_cells(&mut self, request: &FrameRequest) {
        let Some(cells) = self.drawer.as_mut().and_then(|drawer| drawer.take_cells(MOST_CELLS))
        else {
            return;
        };
        let Some(volume) = request.scene.volume().map(Arc::clone) else { return };
        let asked_error = cells.max_error;
        self.publish_cells(FoundCells { volume, cells, asked_error, is_drawn: true });
    }

    /// Finds the cells that were asked for, if they can be found in `source`.
    pub(super) fn find_cells(&self, source: Option<&CutSource>) {
        let Some(source) = source else { return };
        let request = {
            let mut slot = self.shared.lock();
            match &slot.cells {
                Some(request) if source.is_for(&request.scene) => slot.cells.take(),
                _ => None,
            }
        };
        let Some(CellsRequest { scene, size, max_error }) = request else { return };
        let cells = source.cells(&scene, size, max_error, MOST_CELLS);
        let Some(volume) = scene.volume().map(Arc::clone) else { return };
        let asked_error = max_error;
        self.publish_cells(FoundCells { volume, cells, asked_error, is_drawn: false });
    }

    fn publish_cells(&self, found: FoundCells) {
        {
            let mut slot = self.shared.lock();
            if !slot.cells_wanted {
                return;
            }
            slot.found_cells = Some(Arc::new(found));
        }
        (self.wake)();
    }

    /// Finds cells while nothing else is to be drawn.
    pub(super) fn serve_cells(&mut self, request: CellsRequest) {
        let mut tries = 0;
        let prepared = loop {
            match self.prepare_cells(&request) {
                Err(DrawError::Gpu(GpuError::Lost(_))) if tries < REBUILDS => self.drop_device(),
                other => break other,
            }
            tries += 1;
        };
        match prepared {
            Ok(()) => {
                self.shared.lock().cells.get_or_insert(request);
                let source = self.drawer.as_ref().and_then(|drawer| drawer.cut_source());
                self.find_cells(source.as_ref());
            }
            // What came goes first. After a hand the view is another.
            Err(DrawError::Interrupted) => {
                let mut slot = self.shared.lock();
                let moves = |frame: &FrameRequest| matches!(frame.effort, Effort::Moving { .. });
                if slot.cells_wanted && !slot.frame.as_ref().is_some_and(moves) {
                    slot.cells.get_or_insert(request);
                }
            }
            Err(error) => self.fail(&error),
        }
    }

    /// Has the octree that cells are found in at hand, unless something newer comes.
    fn prepare_cells(&mut self, request: &CellsRequest) -> Result<(), DrawError> {
        self.device()?;
        let Some(mut drawer) = self.drawer.take() else { return Ok(()) };
        // Nothing of it is drawn: no device is needed.
        let plan = Plan::of(&request.scene, request.size);
        let prepared = drawer.prepare_octree(&plan, false, &mut Meanwhile(self));
        self.drawer = Some(drawer);
        prepared
    }
}

/// Stops where something newer came.
struct Meanwhile<'a>(&'a Worker);

impl Observer for Meanwhile<'_> {
    fn piece_done(&mut self, _: &mut dyn Canvas, _: f64) -> bool {
        self.0.newer_came()
    }

    fn is_overtaken(&mut self) -> bool {
        self.0.newer_came()
    }
}

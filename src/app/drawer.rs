//! What the window asks of whoever draws: the engine, or a stand-in in tests.

use std::sync::Arc;

use crate::task::engine::{
    CellsRequest, Engine, EngineChoice, EngineState, FoundCells, FrameRequest, Picture,
    SecondPicture, SecondRequest,
};

/// The window's end of the drawing service. No call blocks.
pub trait Drawer {
    /// Replaces whatever was asked for before.
    fn request(&self, request: FrameRequest);
    /// The newest picture not yet taken, if any.
    fn take_picture(&self) -> Option<Arc<Picture>>;
    /// Asks for a second picture, drawn once nothing else is to be done; `None` forgets it.
    fn request_second(&self, request: Option<SecondRequest>);
    /// The second picture not yet taken, if any.
    fn take_second(&self) -> Option<Arc<SecondPicture>>;
    /// Asks for the cells of a cut, and from then on for those of every cut that a moving view is
    /// drawn with; `None` ends both.
    fn request_cells(&self, request: Option<CellsRequest>);
    /// The newest cells not yet taken, if any.
    fn take_cells(&self) -> Option<Arc<FoundCells>>;
    /// What is being done now.
    fn state(&self) -> EngineState;
    /// The adapter's name, once there is one.
    fn adapter_name(&self) -> Option<String>;
    /// Which engine was asked for last.
    fn engine_choice(&self) -> EngineChoice;
    /// Has another engine draw from now on.
    fn choose_engine(&self, engine: EngineChoice);
}

impl Drawer for Engine {
    fn request(&self, request: FrameRequest) {
        Self::request(self, request);
    }

    fn take_picture(&self) -> Option<Arc<Picture>> {
        Self::take_picture(self)
    }

    fn request_second(&self, request: Option<SecondRequest>) {
        Self::request_second(self, request);
    }

    fn take_second(&self) -> Option<Arc<SecondPicture>> {
        Self::take_second(self)
    }

    fn request_cells(&self, request: Option<CellsRequest>) {
        Self::request_cells(self, request);
    }

    fn take_cells(&self) -> Option<Arc<FoundCells>> {
        Self::take_cells(self)
    }

    fn state(&self) -> EngineState {
        Self::state(self)
    }

    fn adapter_name(&self) -> Option<String> {
        Self::adapter_name(self)
    }

    fn engine_choice(&self) -> EngineChoice {
        Self::engine_choice(self)
    }

    fn choose_engine(&self, engine: EngineChoice) {
        Self::choose_engine(self, engine);
    }
}

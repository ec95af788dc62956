//! What the window asks of whoever draws: the engine, or a stand-in in tests.

use std::sync::Arc;

use crate::task::engine::{Engine, EngineState, FrameRequest, Picture};

/// The window's end of the drawing service. No call blocks.
pub trait Drawer {
    /// Replaces whatever was asked for before.
    fn request(&self, request: FrameRequest);
    /// The newest picture not yet taken, if any.
    fn take_picture(&self) -> Option<Arc<Picture>>;
    /// What is being done now.
    fn state(&self) -> EngineState;
    /// The adapter's name, once there is one.
    fn adapter_name(&self) -> Option<String>;
}

impl Drawer for Engine {
    fn request(&self, request: FrameRequest) {
        Self::request(self, request);
    }

    fn take_picture(&self) -> Option<Arc<Picture>> {
        Self::take_picture(self)
    }

    fn state(&self) -> EngineState {
        Self::state(self)
    }

    fn adapter_name(&self) -> Option<String> {
        Self::adapter_name(self)
    }
}

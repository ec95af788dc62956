//! The window: panels, dialogs and keys over one picture that follows the hand.
//!
//! Owns everything that is seen and touched. Refuses drawing and reading: it posts requests to the
//! engine and jobs to the readers, and shows what comes back. Nothing here waits for either longer
//! than a blink. Called by `main` only.

pub mod actions;
pub mod camera_control;
pub mod dialogs;
pub mod document;
pub mod drawer;
pub mod file_dialog;
pub mod job;
mod layout;
pub mod notices;
pub mod pacing;
pub mod panels;
pub mod reading;
pub mod saving;
pub mod settings;
pub mod theme;
pub mod trihedron;
pub mod viewport;
mod window;
pub mod words;

pub use window::{Parts, Window};

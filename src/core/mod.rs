//! What every other room speaks: cameras and spaces, colour, sizes, progress, work shared out over threads, and cancellation.
//!
//! Owns plain values and their arithmetic. Refuses input and output, threads of its own, and the GPU.
//! Every room may import it; it imports none.

pub mod camera;
pub mod colour;
pub mod enlarge;
pub mod memory;
mod names;
mod pace;
mod pages;
pub mod panics;
pub mod parallel;
mod pieces;
mod polygon;
pub mod progress;

pub use camera::{Camera, Projection};
pub use colour::{LinearRgb, Srgb8};
pub(crate) use names::names;
pub use names::{counted, plain_number, plain_numbers};
pub use pace::Pace;
pub use pages::LargePages;
#[cfg(test)]
pub(crate) use pieces::assert_stops;
pub use pieces::{Looks, mapped};
pub use polygon::triangles_of;
pub use progress::{Cancelled, Ticket};

//! From values to opacity and colour.
//!
//! Owns colour maps, transfer functions in data units, and the tables made of them for drawing.
//! Refuses files, the GPU and grids: it sees statistics, never samples. Imports `core` and
//! `volume`.

pub mod colour_map;
mod cumulative;
mod diverging;
mod function;
pub mod presets;
mod table;

pub use colour_map::ColourMap;
pub use cumulative::{Cumulative, Weight};
pub use function::{
    ColourSource, TRANSMITTANCE_FLOOR, TransferError, TransferFunction, extinction_from_opacity,
};
pub use table::{Coordinate, Table};

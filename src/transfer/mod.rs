//! From values to opacity and colour.
//!
//! Owns colour maps, transfer functions in data units, and the tables made of them for drawing.
//! Refuses files, the GPU and grids: it sees statistics, never samples. Imports `core` and
//! `volume`.

pub mod colour_map;
mod cumulative;
mod design;
mod diverging;
mod function;
mod gaussian;
mod kind;
mod labels;
mod named_presets;
mod no_data;
pub mod presets;
pub mod regions;
mod simplify;
mod table;

pub use colour_map::ColourMap;
pub use cumulative::{Cumulative, Weight};
pub use design::{Design, DesignError, MOST_POINTS, MOST_TEXT_BYTES};
pub use function::{
    ColourSource, TRANSMITTANCE_FLOOR, TransferError, TransferFunction, extinction_from_opacity,
    interpolate,
};
pub use gaussian::{GAUSSIAN_TOLERANCE, Gaussian, MOST_GAUSSIANS, opacity_of, points_of};
pub use kind::{Kind, colour_of_label};
pub use labels::labels_of;
pub use no_data::NoData;
pub use regions::{MOST_REGIONS, Region, RegionError, RegionShape};
pub use simplify::{FREEHAND_TOLERANCE, MOST_DRAWN_POINTS, redrawn};
pub use table::{Coordinate, Table};

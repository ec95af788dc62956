//! Vectors as splats: the marks that show their direction, the classified splats, and the phase.
//!
//! Owns what a vector field becomes before it is drawn (Crawfis and Max, "Texture splats for 3D scalar
//! and vector field visualization"): tables of moving marks, one splat a vector, coarser fields of
//! mean vectors, and time as a phase; lines along them and arrows, as polygons. Refuses pictures and the
//! GPU. Imports `core`, `volume`, `transfer`, `kernel`, `polygons`.

mod glyphs;
mod grid_map;
mod marks;
mod phase;
mod pyramid;
mod settings;
mod splats;
mod streamlines;

pub use glyphs::{GlyphError, MOST_ARROW_SIZE, MOST_ARROWS, arrows, tubes};
pub use marks::{Design, FORESHORTENINGS, Level, MARK_COLUMNS, MARK_SIDE, Marks, PHASES, Seen};
pub use phase::{MOST_SPEED, PhaseClock};
pub use pyramid::VectorPyramid;
pub use settings::{
    ColourBy, Foreshortening, MOST_COARSER, MOST_STRETCH, MOST_VECTOR_EXTENT, VectorMode,
    VectorSettings, VectorSettingsError,
};
pub use splats::{Splat, Splats, WINDOW, typical_step};
pub use streamlines::{
    End, Following, Seeds, Streamline, StreamlineError, seeds_about, seeds_at_vectors,
    seeds_on_line, streamlines,
};

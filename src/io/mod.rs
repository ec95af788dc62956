//! Files to grids: one file a format, recognised by content first and extension second.
//!
//! Owns readers and what they refuse. Refuses drawing. Imports `core`, `volume`.

//! Voxsplat: a viewer for volume data that draws by splatting, and shows what accuracy costs in
//! time. `ARCHITECTURE.md` has the map of the rooms and the way of the data.

pub mod accuracy;
pub mod app;
pub mod cells;
pub mod cli;
pub mod core;
pub mod gpu;
pub mod hierarchy;
pub mod io;
pub mod kernel;
pub mod native;
pub mod plan;
pub mod polygons;
pub mod rbf;
pub mod reference;
pub mod scene;
pub mod task;
pub mod transfer;
pub mod vector;
pub mod volume;

//! Drawing on the GPU: the device, the passes, and the frame as a list of them.
//!
//! Owns everything that names wgpu outside the window. Refuses egui, clap and files, and what a
//! picture is for: it is told what to draw piece by piece. Imports `core`, `volume`, `transfer`,
//! `kernel`, `hierarchy`, `vector`, `polygons`, `scene`, `plan`.

mod buffers;
pub mod cells;
mod clock;
mod compute;
mod constants;
mod context;
mod device_volume;
mod field;
mod folding;
pub mod frame;
mod functions;
mod gather;
mod inside;
pub mod layout;
mod levels;
mod list_plan;
mod marks;
mod meshes;
mod octree;
mod pipelines;
mod polygons;
mod rays;
mod renderer;
mod samples;
mod scan;
mod scattered;
mod shade;
mod shaded_samples;
pub mod shader;
mod slabs;
mod sort;
mod supports;
mod target;
pub mod timing;
mod triangles;
mod vectors;

pub use crate::plan::SlabField;
pub use context::{AdapterChoice, Context, OctreeBuilder, Wishes, has_hardware};
pub use frame::{Pass, PassTime};
pub use gather::tile_count;
pub use octree::{BrickRows, MergedBricks, bricks_of};
pub use renderer::Renderer;
pub use scattered::{ListTotals, Scattered};
pub use slabs::PictureConstants;
pub use sort::MOST_KEYS;
pub use supports::supports;
pub use triangles::GridTotals;
pub use vectors::{VectorLook, VectorSplats};

impl GpuError {
    /// Whether it says what cannot be drawn, rather than that the device failed.
    pub fn is_refusal(&self) -> bool {
        match self {
            Self::TooLarge { .. }
            | Self::NoSheets
            | Self::TooManyVectors { .. }
            | Self::EndedLoops
            | Self::Unsupported(_)
            | Self::Cancelled => true,
            Self::NoAdapter { .. }
            | Self::NoDevice { .. }
            | Self::Lost(_)
            | Self::OutOfMemory
            | Self::Device(_) => false,
        }
    }
}

/// What can go wrong on the device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No adapter, or not the one asked for.
    #[error(
        "expected {wanted}, found {}",
        if found.is_empty() {
            "none at all; install a Vulkan driver (on Debian and Ubuntu: mesa-vulkan-drivers)".into()
        } else {
            format!("only {}; name one of these, or install a driver for another", found.join(", "))
        }
    )]
    NoAdapter {
        /// What was asked for, in words.
        wanted: String,
        /// The names there are.
        found: Vec<String>,
    },
    /// The adapter gives no device.
    #[error(
        "expected a device from adapter {adapter}, found: {found}; update its driver or choose another adapter"
    )]
    NoDevice {
        /// Which adapter.
        adapter: String,
        /// The driver's words.
        found: String,
    },
    /// The device is gone; everything on it must be rebuilt.
    #[error("the graphics device was lost: {0}")]
    Lost(String),
    /// The device has no room left.
    #[error(
        "expected room on the graphics device for the volume and the picture, found its memory \
         full; choose a smaller picture, or open a smaller or subsampled volume"
    )]
    OutOfMemory,
    /// A wrong call of ours, or a driver's failure.
    #[error("the graphics device reported: {0}")]
    Device(String),
    /// More than the device can hold.
    #[error("expected {what} of at most {limit} on this adapter, found {found}; {advice}")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// The limit, with its unit.
        limit: String,
        /// What was asked for.
        found: String,
        /// What to try.
        advice: &'static str,
    },
    /// Sheets are slices of a lattice; scattered kernels lie in none.
    #[error(
        "expected --visibility slabs or every-sample for kernels off a lattice, found sheets; \
         choose one of those two"
    )]
    NoSheets,
    /// More vector splats over one tile of the picture than a ray can walk.
    #[error(
        "expected at most {most} vector splats and layers over a tile of the picture, found {found}; \
         draw means of them with --vector-coarser, or lower the opacity of short vectors to 0"
    )]
    TooManyVectors {
        /// The limit.
        most: u64,
        /// What lies over it.
        found: u64,
    },
    /// A software adapter ended the loops of a ray: the picture would have been short of what it had not met.
    #[error(
        "expected an adapter that ends no loop before its time, found one that ends those of a ray after 65 535 \
         turns; choose --engine native, or a graphics processor with --adapter"
    )]
    EndedLoops,
    /// A plan that this engine does not draw: one sentence.
    #[error("{0}")]
    Unsupported(String),
    /// See [`crate::core::Cancelled`].
    #[error("cancelled")]
    Cancelled,
}

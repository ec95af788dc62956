//! What of a plan this engine does not draw.

use super::lattice::{Lattice, MOST_STORED};
use crate::core::Cancelled;
use crate::kernel::Kernel;
use crate::plan::{Plan, Way};
use crate::scene::{Backend, SplatSettings};

/// Why a plan is not drawn, in words that stand after "the native engine does not draw".
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct Unsupported(pub String);

/// Why a picture was not begun.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotBegun {
    /// It was told to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// What shows only once kernels are placed.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
}

/// Whether this engine draws a plan.
///
/// # Errors
/// [`Unsupported`]: what of the plan it does not draw.
pub fn supports(plan: &Plan) -> Result<(), Unsupported> {
    let refuse = |what: &str| Err(Unsupported(what.to_owned()));
    if let Some(fault) = &plan.fault {
        return Err(Unsupported(fault.to_string()));
    }
    match plan.way {
        Way::Slabs => {}
        Way::Nothing | Way::Gathered => return Ok(()),
        Way::Triangles | Way::Nodes
            if plan.mode.backend == Backend::Raster || plan.mode.kernel == Kernel::Gouraud =>
        {
            return refuse("splats as triangles");
        }
        // Where nobody asked for triangles rays show the same, and in perspective more exactly.
        Way::Triangles | Way::Nodes => return Ok(()),
    }
    match plan.field() {
        Some(field) => {
            let dims = field.volume.lattice.dims;
            match Lattice::stored(dims, &plan.mode).is_some_and(|stored| stored <= MOST_STORED) {
                true => Ok(()),
                false => Err(Unsupported(format!(
                    "more than {MOST_STORED} samples, and this volume has {} × {} × {}",
                    dims[0], dims[1], dims[2]
                ))),
            }
        }
        None => Ok(()),
    }
}

/// Bytes that the field of a volume of so many samples in a mode takes.
pub fn stored_bytes(dims: [usize; 3], mode: &SplatSettings) -> u64 {
    // 32 bits a sample, and least and greatest of each of its bricks.
    Lattice::stored(dims, mode).map_or(u64::MAX, |stored| 5 * stored as u64)
}

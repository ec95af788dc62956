//! What of a plan this engine does not draw.

use super::lattice::{Lattice, MOST_STORED};
use crate::plan::{Plan, Way};
use crate::scene::SplatSettings;

/// Why a plan is not drawn, in words that stand after "the native engine does not draw".
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct Unsupported(pub String);

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
        Way::Nothing => return Ok(()),
        Way::Gathered => return refuse("samples that are shaded before they are put together yet"),
        Way::Triangles | Way::Nodes => return refuse("splats as triangles"),
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

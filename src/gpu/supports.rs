//! What of a plan this engine cannot draw.

use super::GpuError;
use crate::plan::Plan;

/// Kernel lists that one picture may have.
const MOST_KERNEL_LISTS: usize = 2;

/// Whether this engine draws a plan.
///
/// # Errors
/// [`GpuError::Unsupported`], with one sentence. The device has nothing to do with it.
pub fn supports(plan: &Plan) -> Result<(), GpuError> {
    let refuse = |sentence: String| Err(GpuError::Unsupported(sentence));
    if let Some(fault) = &plan.fault {
        return refuse(fault.to_string());
    }
    if plan.kernels.len() > MOST_KERNEL_LISTS {
        return refuse(format!(
            "expected at most {MOST_KERNEL_LISTS} fields of vectors in a picture, found {}; hide the others",
            plan.kernels.len()
        ));
    }
    Ok(())
}

//! What of a plan this engine cannot draw.

use super::GpuError;
use crate::plan::{Plan, Way};
use crate::scene::{Effect, Ground, Refusal};

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
    if plan.way == Way::Nothing && !plan.polygons.is_empty() {
        return refuse(
            "expected a field or vectors beside polygons, found polygons alone; show one of these"
                .to_owned(),
        );
    }
    match plan.kernels.is_empty() || plan.fields.is_empty() {
        true => Ok(()),
        // Among triangles of the field there is no room for kernels.
        false => match Ground::of_mode(&plan.mode) {
            Some(ground) => refuse(Refusal { part: Effect::Vectors, ground }.to_string()),
            None => Ok(()),
        },
    }
}

//! What of a plan this engine cannot draw.

use super::GpuError;
use crate::kernel::Kernel;
use crate::plan::Plan;
use crate::scene::{AlongRay, Classify, OpacityModel, Order, Visibility};

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
    if plan.cut.is_some() && !draws_cut(plan) {
        return refuse(
            "expected a cut of B-splines or tents of their natural width, in pre-integrated slabs from the front on, without \
             vectors, found another; draw all of the field"
                .to_owned(),
        );
    }
    Ok(())
}

/// Whether a plan is one of which this engine draws cuts of the field: what vectors have in a slab is shared out among slabs of
/// one thickness.
fn draws_cut(plan: &Plan) -> bool {
    let mode = &plan.mode;
    let is_product = matches!(mode.kernel, Kernel::Linear | Kernel::BSpline);
    mode.visibility == Visibility::Slabs
        && mode.classify == Classify::PreIntegrated
        && mode.opacity_model == OpacityModel::OpticalDepth
        && mode.order == Order::FrontToBack
        && is_product
        && mode.kernel.stretch(mode.extent) == 1.0
        && plan.inside.along == AlongRay::Composite
        && plan.kernels.is_empty()
}

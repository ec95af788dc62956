//! Which plans have cuts of their field at all.

use crate::kernel::Kernel;
use crate::plan::Plan;
use crate::scene::{
    AlongRay, Classify, Colours, Index, OpacityModel, Reconstruction, Scene, Visibility,
};
use crate::task::previews::is_scaled;

/// Why pictures of a plan are never of cuts of its field, in words that follow "there is no cut: "; `None`
/// where they may be.
///
/// A cut is of values, and classified after they are reconstructed. What is right beside any such field is right beside a cut:
/// lights, clips, slices, isosurfaces (bricks that one passes are drawn from the samples), polygons. Left out is what
/// depends on how thick slabs are, what no mean can tell, and what the errors of bricks know nothing of.
pub fn why_no_cut(plan: &Plan) -> Option<&'static str> {
    let (mode, shading) = (&plan.mode, &plan.shading);
    let is_of_strength = |index: Option<Index>| index == Some(Index::GradientStrength);
    let colours = |of: &Option<Colours>| is_of_strength(of.as_ref().map(|of| of.index));
    let reasons = [
        (plan.field().is_none(), "no field of values is shown"),
        (
            mode.visibility != Visibility::Slabs || mode.classify == Classify::Before,
            "samples are classified before they are reconstructed, and a cut is of values",
        ),
        (
            !matches!(mode.kernel, Kernel::Linear | Kernel::BSpline),
            "only fields of linear kernels and of B-splines have one",
        ),
        (
            mode.kernel == Kernel::BSpline && mode.reconstruction != Reconstruction::Interpolating,
            "the field is smoothed, and means are of the samples as they are",
        ),
        (is_scaled(mode), "its kernels are wider or narrower than natural"),
        (
            mode.classify != Classify::PreIntegrated,
            "one value stands for each slab, so that thicker ones would be another picture",
        ),
        (
            mode.opacity_model != OpacityModel::OpticalDepth,
            "published opacities do not add up to those of thicker slabs",
        ),
        (
            plan.inside.along != AlongRay::Composite,
            "a projection looks for single values, which means do not keep",
        ),
        (
            // What kernels have in a slab is shared out among slabs of one thickness.
            !plan.kernels.is_empty(),
            "vectors are composited in slabs of one thickness",
        ),
        (
            shading.opacity.is_some() || !shading.painted().is_empty(),
            "opacities are by gradient or by a table of their own, and the errors of its nodes are of the transfer function",
        ),
        (
            is_of_strength(shading.modulation.as_ref().map(|of| of.index))
                || colours(&shading.reflection)
                || colours(&shading.emission),
            "a table is by gradient strength, which means make smaller",
        ),
    ];
    reasons.into_iter().find_map(|(is_so, why)| is_so.then_some(why))
}

/// The same of the plan of a scene, whatever its size.
pub fn why_no_cut_of(scene: &Scene) -> Option<&'static str> {
    why_no_cut(&Plan::of(scene, [1, 1]))
}

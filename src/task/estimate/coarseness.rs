//! How a picture is coarser than the finished one, and what that is thought to cost before anything was learnt.

use super::seen::{light_rms, sampling_rmse};
use crate::kernel::Kernel;
use crate::plan::{Plan, SlabField};
use crate::scene::Classify;
use crate::task::draw::{Drawn, Rung};

/// RMSE that a cut adds, per unit of its greatest node error: 0.03 to 0.08 on the demos shells,
/// tornado and head (48³) and on hydrogen, 480 × 400 pixels, budgets of 4 to 50 ms.
pub(super) const PER_ERROR: f64 = 0.06;
/// How much farther off averages of every second or fourth sample are than cuts of the same greatest error, most of whose nodes
/// are nearer: 2.4 to 5.6 dB of a head.
pub(super) const SUBSAMPLED: f32 = 1.5;
/// RMSE that drawing an octree cut smaller adds, for each time that it is smaller: 0.001 to 0.005
/// there.
pub(super) const PER_SHRINK: f64 = 0.002;
/// RMSE of a whole picture of the nearest tents: 0.0057 on aneurism, 0.0045 on LIDC2, 0.0012 on bonsai,
/// 1280 × 800 pixels.
pub(super) const TENTS_RMSE: f64 = 0.004;
/// The same of what lights fall on, since tents have other gradients: 0.024 on aneurism, 0.02 on bonsai, as they open.
pub(super) const LIT_TENTS_RMSE: f64 = 0.02;
/// And of cells, whose border is lit as it is turned, which tents know nothing of: 0.045 on a million tetrahedra.
pub(super) const LIT_TENTS_OF_CELLS_RMSE: f64 = 0.045;
/// RMSE of means of vectors in the place of all, of the root mean square of their picture's light: 0.27 to 0.98
/// at 3 ms and 0.18 to 0.75 at 150 ms on carotid, office and the tornado (MODULATE and BLEND), 640 × 400 pixels.
pub(super) const MEANS_SHARE: f64 = 0.5;
/// The same of vectors that are all there, whose marks are blurred for larger pixels, for each time that the
/// picture is halved, up to that of means: 0.22 on carotid and 0.065 on the tornado (BLEND) at 226 × 141 for
/// 640 × 400 pixels. A picture drawn smaller cannot tell: what it lacks it does not show.
pub(super) const BLUR_SHARE: f64 = 0.12;
/// What shading before reconstruction costs even with every voxel drawn: 0.0009 to 0.028 there, 0.01
/// to 0.05 on scans (design.md §1).
pub(super) const SHADE_FIRST_RMSE: f64 = 0.01;
/// RMSE of every voxel as a point, which leaves holes: 0.34 and 0.35 of heads, 0.16 of a scan (`docs/reproductions.md`).
pub(super) const POINTS_RMSE: f64 = 0.27;
/// And as a box: 0.09 and 0.05 there, 0.017 of a head of 64³ samples at 640 × 480 pixels.
pub(super) const NEAREST_RMSE: f64 = 0.042;
/// No estimate by a model begins below this: bytes hardly show it.
pub(super) const LEAST_RMSE: f64 = 1e-3;
/// Nor one of fields, whose parts are measured, below this: no difference that is told from rounding to bytes.
pub(super) const LEAST_OF_FIELDS: f64 = 1e-4;
/// Of coarseness.
pub(super) const KINDS: usize = 9;

/// How a picture is coarser than the finished one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Coarseness {
    /// A cut of the octree, shaded first whatever the mode, perhaps drawn smaller.
    Octree {
        /// The greatest error of its nodes.
        max_error: f32,
        /// What pixels that points leave out are thought to cost (see `Drawn`).
        missing_rmse: f64,
    },
    /// The scene's own mode, only smaller.
    Reduced {
        /// See [`sampling_rmse`].
        sampling_rmse: f64,
        /// Of which field.
        field: SlabField,
        /// What it is thought to cost that this is another than the scene's own.
        field_rmse: f64,
        /// What a cut of it is thought to cost, where it is one.
        cut_rmse: Option<f64>,
    },
    /// Every so many-th sample, averaged: a cut of the octree that nobody fitted.
    Subsampled {
        /// The greatest error of its nodes.
        max_error: f32,
    },
    /// Every voxel with a cheaper kernel than the mode's.
    Cheaper(Kernel),
    /// A scene with vectors, smaller.
    Vectors {
        /// See [`sampling_rmse`].
        sampling_rmse: f64,
        /// What it is thought to cost that means stand for them, or that their marks are blurred.
        marks_rmse: f64,
        /// Whether means do.
        are_means: bool,
    },
}

impl Coarseness {
    /// How the picture of a rung of `plan` is coarser, drawn `shrink` times smaller than it is shown; `rgba`
    /// are its bytes at the size drawn, as in [`crate::task::engine::Picture`]. `None` for rungs without an estimate.
    pub(in crate::task) fn of(
        plan: &Plan,
        rung: Rung,
        drawn: &Drawn,
        shrink: f64,
        rgba: &[u8],
    ) -> Option<Self> {
        match rung {
            Rung::Octree { .. } | Rung::Subsampled { .. } | Rung::Cheaper(_)
                if drawn.is_reduced => {}
            Rung::Subsampled { .. } => {
                return Some(Self::Subsampled { max_error: drawn.max_error });
            }
            Rung::Cheaper(kernel) => return Some(Self::Cheaper(kernel)),
            _ => {}
        }
        match rung {
            Rung::Coarse { .. } | Rung::Octree { .. } if !drawn.is_reduced => {
                let &Drawn { max_error, missing_rmse, .. } = drawn;
                // What it leaves out of a scene, nobody has seen: as much light, it is thought, as is there.
                let left_out = match plan.kernels.is_empty() {
                    true => 0.0,
                    false => light_rms(plan.background, rgba),
                };
                Some(Self::Octree { max_error, missing_rmse: missing_rmse.hypot(left_out) })
            }
            Rung::Full => None,
            _ => {
                let is_smaller = shrink > 1.0;
                if !is_smaller && drawn.is_of_own() {
                    // The finished picture.
                    return None;
                }
                let sampling_rmse = if is_smaller { sampling_rmse(drawn.size, rgba) } else { 0.0 };
                if !plan.kernels.is_empty() {
                    let are_means = drawn.vectors_averaged > 0;
                    let share = match are_means {
                        true => MEANS_SHARE,
                        false => (BLUR_SHARE * shrink.max(1.0).log2()).min(MEANS_SHARE),
                    };
                    let marks_rmse = match share {
                        0.0 => 0.0,
                        _ => share * light_rms(plan.background, rgba),
                    };
                    return Some(Self::Vectors { sampling_rmse, marks_rmse, are_means });
                }
                let cut_rmse = drawn.cut.map(|cut| cut.rmse);
                let &Drawn { field, field_rmse, .. } = drawn;
                Some(Self::Reduced { sampling_rmse, field, field_rmse, cut_rmse })
            }
        }
    }

    pub(super) fn kind(self) -> usize {
        match self {
            Self::Octree { .. } => 0,
            Self::Reduced { cut_rmse: Some(_), .. } => 5,
            Self::Reduced { field: SlabField::Own, .. } => 1,
            Self::Reduced { field: SlabField::Preview, .. } => 2,
            Self::Vectors { are_means, .. } => 3 + usize::from(are_means),
            Self::Subsampled { .. } => 6,
            Self::Cheaper(Kernel::Point) => 7,
            Self::Cheaper(_) => 8,
        }
    }

    pub(super) fn least_rmse(self) -> f64 {
        if let Self::Reduced { .. } = self { LEAST_OF_FIELDS } else { LEAST_RMSE }
    }

    /// The estimate before anything was learnt: RMSE in linear light. Errors of different origin add
    /// up in squares.
    pub(super) fn first_rmse(self, classify: Classify, shrink: f64) -> f64 {
        let (max_error, missing_rmse) = match self {
            Self::Reduced { sampling_rmse, field_rmse, cut_rmse, .. } => {
                return field_rmse.hypot(sampling_rmse).hypot(cut_rmse.unwrap_or(0.0));
            }
            Self::Vectors { sampling_rmse, marks_rmse, .. } => {
                return marks_rmse.hypot(sampling_rmse);
            }
            Self::Cheaper(Kernel::Point) => return POINTS_RMSE,
            Self::Cheaper(_) => return NEAREST_RMSE,
            Self::Octree { max_error, missing_rmse } => (max_error, missing_rmse),
            Self::Subsampled { max_error } => (SUBSAMPLED * max_error, 0.0),
        };
        let enlarged = PER_SHRINK * (shrink - 1.0).max(0.0);
        // Nor is any picture further off than black from white.
        let octree = (PER_ERROR * f64::from(max_error).max(0.0)).min(1.0);
        let shade_first = match classify {
            Classify::Before => 0.0,
            Classify::After | Classify::PreIntegrated | Classify::Mean => SHADE_FIRST_RMSE,
        };
        octree.hypot(enlarged).hypot(shade_first).hypot(missing_rmse)
    }
}

/// What it is thought to cost to draw a plan from a field: RMSE of a whole picture.
pub(in crate::task) fn field_rmse(plan: &Plan, field: SlabField) -> f64 {
    match field {
        SlabField::Own => 0.0,
        SlabField::Preview
            if plan.mode.kernel == Kernel::Cells && plan.shading.lights_borders() =>
        {
            LIT_TENTS_OF_CELLS_RMSE
        }
        SlabField::Preview if plan.shading.uses_gradient() => LIT_TENTS_RMSE,
        SlabField::Preview => TENTS_RMSE,
    }
}

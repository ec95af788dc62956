//! Quick pictures of a reconstructed field: from which field on the device, and how small.
//!
//! The scene's own field looks exactly as it will at rest, only smaller. Rays far apart share no
//! memory, and one through B-splines fetches eight times as much as one through tents: where the own
//! field would have to be drawn very small, tents through the samples are nearer to it.

use crate::core::Ticket;
use crate::gpu::{GpuError, SlabField};
use crate::hierarchy::{ScalarPyramid, ScalarPyramidError};
use crate::kernel::{Averaged, Coefficients, CoefficientsError, Kernel, coefficients};
use crate::scene::{Reconstruction, Scene, SplatSettings, View};
use crate::volume::ScalarVolume;

use super::draw::{DrawError, Drawer, Drawn, LEAST_SIDE, Observer, Rung, shrunk};
use super::slabs;

/// A field may be drawn this much smaller before an octree cut stands in for it: at 1280 × 800 pixels
/// the own one is 30.9, 37.0, 42.0 dB from the exact picture when 4 times smaller, and 27.8, 33.8,
/// 37.3 when 8 times, on the scans aneurism, LIDC2, bonsai; an octree cut of 57 ms, 28.1, 31.8, 33.5,
/// and too bright by up to 0.005.
const MOST_REDUCTION: f64 = 8.0;
/// Steps of it.
const REDUCTION_STEP: f64 = 0.25;
/// How many times smaller than that it may become where the last preview was of a field, too.
const PATIENCE: f64 = 1.5;
/// Tents are taken where they are drawn less small than the own field by so much: on aneurism and LIDC2
/// tents 1.9, 3.9, 5.6 times smaller are as near to the exact picture as the own field 4, 6, 8 times.
const WORTH_TENTS: f64 = 2.1;
/// The same where the last preview was of tents.
const STILL_WORTH_TENTS: f64 = 1.6;
/// A field for previews has no more samples than this, or means of them: 256³, and a quarter more. What
/// is larger is seen with less than a pixel a sample, and would cost the memory of two.
const MOST_SAMPLES: usize = 5 << 22;

/// A field drawn smaller than it is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reduction {
    /// Of which field.
    pub field: SlabField,
    /// How many times smaller, ≥ 1.
    pub shrink: f64,
}

impl Reduction {
    /// How many times smaller a picture of the own field is that is as near to the exact one.
    pub(super) fn own_shrink(self) -> f64 {
        match self.field {
            SlabField::Own => self.shrink,
            SlabField::Preview => self.shrink + WORTH_TENTS,
        }
    }
}

/// The mode of the field for previews of a scene, where one would be quicker than the scene's own and
/// look alike: tents, through the samples or through means of them. A smooth field is not like them.
pub(super) fn preview_mode(scene: &Scene) -> Option<SplatSettings> {
    let splat = scene.splat;
    let is_sharp = match splat.kernel {
        // They interpolate in any case.
        Kernel::Linear => level(scene.volume.lattice.dims) > 0,
        Kernel::Point | Kernel::Nearest => false,
        Kernel::Gaussian | Kernel::Cubic | Kernel::BSpline | Kernel::Gouraud => {
            splat.reconstruction == Reconstruction::Interpolating
        }
    };
    (slabs::reconstructs(&splat) && is_sharp).then_some(SplatSettings {
        kernel: Kernel::Linear,
        extent: None,
        reconstruction: Reconstruction::Interpolating,
        slabs_per_voxel: splat.slabs_per_voxel.min(1.0),
        ..splat
    })
}

/// How many times a volume is halved for its previews.
fn level(dims: [usize; 3]) -> u32 {
    let samples = |level: u32| dims.iter().map(|n| n.div_ceil(1 << level)).product::<usize>();
    (0..u32::BITS - 1).find(|&level| samples(level) <= MOST_SAMPLES).unwrap_or(0)
}

/// Voxels that a sample of a field is seen across. Rays farther apart could miss a single bright one.
fn widest_voxels(field: SlabField, scene: &Scene) -> f64 {
    let Scene { volume, splat, .. } = scene;
    2.0 * match field {
        SlabField::Own => splat.kernel.reach(splat.extent),
        SlabField::Preview => {
            Kernel::Linear.reach(None) * f64::from(1_u32 << level(volume.lattice.dims))
        }
    }
}

/// The field for previews: the samples, or means of them with the spread of what they stand for.
pub(super) fn preview_coefficients(
    volume: &ScalarVolume,
    ticket: &Ticket,
) -> Result<Coefficients, CoefficientsError> {
    let level = level(volume.lattice.dims);
    if level == 0 {
        return coefficients(volume, Kernel::Linear, None, true, ticket);
    }
    let pyramid = ScalarPyramid::build_levels(volume, level as usize, ticket);
    let ScalarPyramid { dims, bias, mut levels } = pyramid.map_err(|error| match error {
        ScalarPyramidError::Cancelled(error) => CoefficientsError::Cancelled(error),
        ScalarPyramidError::TooLarge(error) => CoefficientsError::TooLarge(error),
    })?;
    let coarse = levels.swap_remove(level as usize - 1);
    let mut half_widths = coarse.spread;
    half_widths.iter_mut().for_each(|width| *width *= 3.0_f32.sqrt());
    let averaged = Averaged { level, volume_dims: dims, half_widths };
    Ok(Coefficients::of_means(coarse.dims, coarse.mean, bias, averaged, ticket)?)
}

impl Drawer {
    /// Brings to the device what previews of a scene are drawn from, if anything, beside its own field.
    pub(super) fn prepare_preview_field(
        &mut self,
        scene: &Scene,
        size: [u32; 2],
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let Some(splat) = preview_mode(scene) else { return Ok(()) };
        let scene = Scene { splat, ..scene.clone() };
        match self.prepare_field(&scene, size, SlabField::Preview, observer) {
            // It is not needed for any picture but a quick one.
            Err(DrawError::Gpu(GpuError::TooLarge { .. })) => Ok(()),
            other => other,
        }
    }

    /// Which field is drawn within a budget, and how much smaller; `None` where none is on the device
    /// yet, or an octree cut would be nearer to the exact picture.
    pub(super) fn reduction(
        &self,
        scene: &Scene,
        size: [u32; 2],
        budget_ms: f64,
    ) -> Option<Reduction> {
        if !slabs::reconstructs(&scene.splat) {
            return None;
        }
        let rays = f64::from(size[0]) * f64::from(size[1]);
        // A hand should not see one kind of preview change into the other and back.
        let patience = if self.last_reduction.is_some() { PATIENCE } else { 1.0 };
        let least_side = f64::from(size[0].min(size[1])) / LEAST_SIDE;
        let voxel_px = View::new(scene, size).narrowest_voxel_pixels();
        let most = |field| {
            let reach = voxel_px * widest_voxels(field, scene);
            (MOST_REDUCTION * patience).min(least_side).min(reach.max(1.0))
        };
        let affordable = |field: SlabField, splat: &SplatSettings| {
            if !self.renderer.holds_field(field, &scene.volume, splat) {
                return None;
            }
            let affordable = self.costs.reduced_rays_within(field, budget_ms);
            let shrink = (rays / affordable).sqrt().max(1.0);
            // In steps, so that the hand does not see sharpness flicker.
            Some((shrink / REDUCTION_STEP).ceil() * REDUCTION_STEP)
        };
        let own = affordable(SlabField::Own, &scene.splat);
        let tents = preview_mode(scene).and_then(|splat| affordable(SlabField::Preview, &splat));
        let worth = match self.last_reduction {
            Some(SlabField::Preview) => STILL_WORTH_TENTS,
            _ => WORTH_TENTS,
        };
        let (field, shrink) = match (own, tents) {
            (Some(own), Some(tents)) if own - tents < worth => (SlabField::Own, own),
            (_, Some(tents)) => (SlabField::Preview, tents),
            (own, None) => (SlabField::Own, own?),
        };
        (shrink <= most(field)).then_some(Reduction { field, shrink })
    }

    /// A picture so many times smaller than `size`.
    pub(super) fn reduced(
        &mut self,
        scene: &Scene,
        size: [u32; 2],
        Reduction { field, shrink }: Reduction,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        let smaller = shrunk(size, shrink);
        let drawn = match field {
            SlabField::Preview => {
                let splat = preview_mode(scene).unwrap_or(scene.splat);
                let scene = Scene { splat, ..scene.clone() };
                self.slabs(&scene, smaller, field, shrink, observer)
            }
            SlabField::Own if slabs::reconstructs(&scene.splat) => {
                self.slabs(scene, smaller, field, shrink, observer)
            }
            SlabField::Own => self.draw(scene, smaller, Rung::Full, observer),
        };
        Ok(Drawn { is_reduced: true, field, ..drawn? })
    }
}

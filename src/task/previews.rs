//! Quick pictures of a reconstructed field: from which field on the device, and how small.
//!
//! The scene's own field looks exactly as it will at rest, only smaller. Rays far apart share no
//! memory, and one through B-splines fetches eight times as much as one through tents. Tents through
//! the samples would be darker; those nearest to the spline (`kernel::nearest_tents`) are as bright.

use std::sync::Arc;

use crate::core::Ticket;
use crate::gpu::GpuError;
use crate::hierarchy::{ScalarPyramid, ScalarPyramidError};
use crate::kernel::{Averaged, Coefficients, CoefficientsError, Kernel, nearest_tents};
use crate::plan::{Field, Plan, SlabField, Way};
use crate::scene::{Backend, Order, Reconstruction, SplatSettings};
use crate::volume::ScalarVolume;

use super::cuts::CutNumber;
use super::draw::{CutLevels, DrawError, Drawer, Drawn, Observer, most_shrink, shrunk};

/// A picture changes its size by no less than this, so that the hand does not see sharpness flicker: by
/// an eighth a side.
const SIZE_STEPS_A_HALVING: f64 = 6.0;
/// A size is kept while it is thought to take no more than this share of the budget,
const MOST_KEPT: f64 = 1.1;
/// and the next larger one no less than this.
const LARGER_WITHIN: f64 = 0.9;
/// Tents are taken where they are drawn less small than the own field by so much. At equal size they are
/// as near to the exact picture to 0.3 dB, where that is 4 times smaller; at full size 44.9, 47, 58.1 dB.
const WORTH_TENTS: f64 = 0.5;
/// The same where the last preview was of tents.
const STILL_WORTH_TENTS: f64 = 0.25;
/// Cells up to so many are drawn themselves wherever a picture of them can be had in the time, however small: tents end in steps
/// at their border. 1280 × 800, native: `can.vtu` 35.6 dB at a quarter of the size and 31.2 at an eighth, by tents 26.8 at two
/// fifths; `disk_out_ref.ex2` 40.3, 37.1, 35.9; 37 479 hexahedra of the blunt fin 38.8, 33.3, 27.2. A million tetrahedra, 41.1
/// beside 29.3, are too many for the hand.
const MOST_OWN_CELLS: usize = 1 << 17;
/// The least share of slabs a voxel in their smaller pictures: cells between two faces of slabs cost nothing. At a quarter of the
/// size half the slabs are 0.1 to 1.4 dB farther from the finished picture, at an eighth 0.4 at most, in half to three quarters of
/// the time.
const LEAST_CELLS_SLABS: f64 = 0.5;
/// A field for previews has no more samples than this, or means of them: 256³, and a quarter more. What
/// is larger is seen with less than a pixel a sample, and would cost the memory of two.
const MOST_SAMPLES: usize = 5 << 22;
/// Voxels that show may be splatted one by one in place of the field where they are no more than so many: a few
/// scattered ones. Of more, rays are the nearer to the exact picture, and are sent where small things lie (`gpu::marks`):
/// aneurism as it opens, 114 695 voxels, 944 × 943 pixels, llvmpipe: 33.8 dB in 370 ms by rays, 26.7 in 386 by splats.
const MOST_SPARSE: u64 = 4096;
/// How many times longer a picture with vectors that nobody has drawn yet is thought to take.
const UNKNOWN_VECTORS: f64 = 16.0;

/// A field drawn smaller than it is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reduction {
    /// Of which field.
    pub field: SlabField,
    /// How many times smaller, ≥ 1.
    pub shrink: f64,
    /// From which cut of it, if not from all of it.
    pub cut: Option<CutNumber>,
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

/// Rays of a picture that is drawn so many times smaller than `size`.
fn rays(size: [u32; 2], shrink: f64) -> f64 {
    f64::from(size[0]) * f64::from(size[1]) / (shrink * shrink)
}

/// The mode of the field for previews of a scene, where one would be quicker than the scene's own and
/// look alike: the tents nearest to it, or tents through means; or the functions that matter most, where those are asked for. A
/// smooth field is not like them, nor are products of
/// another than their natural width; but where samples are shaded first it is the only one that can be lit.
pub(super) fn preview_mode(plan: &Plan) -> Option<SplatSettings> {
    let splat = plan.mode;
    let of_points = plan.field().and_then(|field| field.volume.scattered.as_ref());
    let are_dots = of_points.is_some_and(|scattered| scattered.are_many_points());
    let is_sharp = match splat.kernel {
        // They interpolate in any case.
        Kernel::Linear => level(plan.frame.lattice.dims) > 0,
        Kernel::Point | Kernel::Nearest => false,
        // Tents through single points would be dots.
        Kernel::Ellipsoids => !are_dots,
        Kernel::Functions | Kernel::Cells => true,
        Kernel::Gaussian | Kernel::Cubic | Kernel::BSpline | Kernel::Gouraud => {
            splat.reconstruction == Reconstruction::Interpolating
        }
    };
    if let Some(functions) = splat.quick_limits().filter(|_| plan.reconstructs()) {
        let slabs_per_voxel = splat.slabs_per_voxel.min(1.0);
        return Some(SplatSettings { functions, slabs_per_voxel, ..splat });
    }
    let tents = SplatSettings {
        kernel: Kernel::Linear,
        extent: None,
        reconstruction: Reconstruction::Interpolating,
        slabs_per_voxel: splat.slabs_per_voxel.min(1.0),
        ..splat
    };
    if plan.is_gathered() {
        // Octree cuts are unlit, and of nothing but the field.
        let SplatSettings { visibility, classify, order, .. } = SplatSettings::EXACT;
        return Some(SplatSettings {
            visibility,
            classify,
            order,
            slabs_per_voxel: 1.0,
            backend: Backend::Auto,
            ..tents
        });
    }
    let is_like_tents = is_sharp && !is_scaled(&splat);
    (plan.reconstructs() && is_like_tents && plan.field().is_some()).then_some(tents)
}

/// Whether a plan has nothing that cuts of classified voxels do not show: these know neither lights nor tables, and show what
/// is cut away.
pub(super) fn is_plain(plan: &Plan) -> bool {
    plan.shading.is_plain()
        && plan.inside.is_plain()
        && plan.kernels.is_empty()
        && plan.surfaces.is_empty()
}

/// Whether a plan's field is on cells so few that quick pictures are of these themselves.
pub(super) fn is_of_few_cells(plan: &Plan) -> bool {
    let cells = plan.field().and_then(|field| field.volume.cells.as_ref());
    let are_few = cells.is_some_and(|field| field.cells().solids().len() <= MOST_OWN_CELLS);
    are_few && plan.mode.kernel == Kernel::Cells
}

/// The share of slabs a voxel in a picture of cells so many times smaller.
fn cells_slabs(shrink: f64) -> f64 {
    (2.0 / shrink).clamp(LEAST_CELLS_SLABS, 1.0)
}

/// Slabs a voxel of a picture of the own field so many times smaller, where they are fewer than the finished picture's. Of numbers
/// that name things they are fewer by as many times as the picture is smaller, down to one a voxel. A frog of 500 × 470 × 136 voxels,
/// native engine, two threads of a busy machine: 262 × 202 pixels by one slab a voxel take about as long as 166 × 128 by four, and are
/// 18.6 and 17.7 dB from the picture of 1100 × 850.
fn quick_slabs(plan: &Plan, shrink: f64) -> Option<f64> {
    let slabs = plan.mode.slabs_per_voxel;
    match plan.mode.kernel {
        _ if shrink <= 1.0 => None,
        Kernel::Cells if is_of_few_cells(plan) => Some(slabs.min(1.0) * cells_slabs(shrink)),
        Kernel::Nearest if plan.reconstructs() => Some((slabs / shrink).max(slabs.min(1.0))),
        _ => None,
    }
}

/// Whether a mode's kernels are products of another than their natural width: quick pictures are of its own field,
/// so that they show the same.
pub(super) fn is_scaled(mode: &SplatSettings) -> bool {
    mode.kernel.is_separable() && mode.kernel.scale(mode.extent) != 1.0
}

/// How many times a volume is halved for its previews.
fn level(dims: [usize; 3]) -> u32 {
    let samples = |level: u32| dims.iter().map(|n| n.div_ceil(1 << level)).product::<usize>();
    (0..u32::BITS - 1).find(|&level| samples(level) <= MOST_SAMPLES).unwrap_or(0)
}

/// Voxels that a sample of a field is seen across.
fn widest_voxels(field: SlabField, plan: &Plan) -> f64 {
    2.0 * match field {
        SlabField::Own => plan.mode.kernel.reach(plan.mode.extent),
        SlabField::Preview => {
            Kernel::Linear.reach(None) * f64::from(1_u32 << level(plan.frame.lattice.dims))
        }
    }
}

/// The field for previews: the nearest tents, or means of the samples with the spread of what they
/// stand for.
pub(super) fn preview_coefficients(
    volume: &ScalarVolume,
    ticket: &Ticket,
) -> Result<Coefficients, CoefficientsError> {
    coefficients_of(volume, level(volume.lattice.dims), ticket)
}

/// The same of a volume halved so many times.
///
/// # Errors
/// Cancelled, or too little memory.
pub fn coefficients_of(
    volume: &ScalarVolume,
    level: u32,
    ticket: &Ticket,
) -> Result<Coefficients, CoefficientsError> {
    if level == 0 {
        return nearest_tents(volume, ticket);
    }
    let pyramid = ScalarPyramid::build_levels(volume, level as usize, ticket);
    let ScalarPyramid { dims, bias, mut levels } = pyramid.map_err(|error| match error {
        ScalarPyramidError::Cancelled(error) => CoefficientsError::Cancelled(error),
        ScalarPyramidError::TooLarge(error) => CoefficientsError::TooLarge(error),
    })?;
    let coarse = levels.swap_remove(level as usize - 1);
    let mut half_widths = coarse.spread;
    let extremes = coarse.low.iter().zip(&coarse.high).zip(&coarse.mean);
    for (width, ((low, high), mean)) in half_widths.iter_mut().zip(extremes) {
        // As far as every value: else a single bright voxel could not be seen at all. NaN are no data.
        *width = (*width * 3.0_f32.sqrt()).max(high - mean).max(mean - low);
    }
    let averaged = Averaged { level, volume_dims: dims, half_widths };
    Ok(Coefficients::of_means(coarse.dims, coarse.mean, bias, averaged, ticket)?)
}

impl Drawer {
    /// Brings to the device what previews of a scene are drawn from, if anything, beside its own field.
    pub(super) fn prepare_preview_field(
        &mut self,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let Some(mode) = preview_mode(plan) else { return Ok(()) };
        let is_of_means = mode.kernel == Kernel::Linear && level(plan.frame.lattice.dims) > 0;
        if self.is_native() && is_of_means {
            // The native engine draws no means yet: quick pictures of large volumes are of their own field.
            return Ok(());
        }
        match self.prepare_field(&plan.in_mode(mode), SlabField::Preview, observer) {
            // It is not needed for any picture but a quick one, which then shows another.
            Err(DrawError::Gpu(error @ GpuError::TooLarge { .. })) => {
                log::warn!("no field for previews: {error}");
                Ok(())
            }
            other => other,
        }
    }

    /// Whether quick pictures of a plan are of its samples until its cells are listed: of many that takes far longer.
    pub(super) fn begins_with_samples(&self, plan: &Plan) -> bool {
        let is_of_many_cells = plan.mode.kernel == Kernel::Cells && !is_of_few_cells(plan);
        self.is_native()
            && is_of_many_cells
            && plan.reconstructs()
            && plan
                .field()
                .is_some_and(|field| !self.holds_field(SlabField::Own, &field.volume, &plan.mode))
    }

    /// Which field is drawn within a budget, and how much smaller; `None` where none is on the device
    /// yet, or an octree cut shows what rays would miss.
    ///
    /// Cuts are no match at any size: at 1280 × 800 pixels, on the scans aneurism, LIDC2, bonsai, tents
    /// 8.5 to 9.5 times smaller are 26.4, 32.4, 36.5 dB from the exact picture and as bright within
    /// 0.1/255; cuts that take twice the time 26.3, 30.6, 31.7, and too bright by 0.5 to 1.5 of 255.
    pub(super) fn reduction(&self, plan: &Plan, budget_ms: f64) -> Option<Reduction> {
        let size = plan.size;
        if plan.is_of_kernels_alone() {
            let shrink = self.affordable_among_vectors(plan, SlabField::Own, budget_ms);
            return Some(Reduction { field: SlabField::Own, shrink, cut: None });
        }
        let Some(Field { volume, .. }) = plan.field() else {
            // Nothing takes no time.
            return Some(Reduction { field: SlabField::Own, shrink: 1.0, cut: None });
        };
        let is_gathered = plan.is_gathered();
        if !plan.reconstructs() && !is_gathered {
            return None;
        }
        let affordable = |field: SlabField, mode: &SplatSettings| {
            let is_there = self.holds_field(field, volume, mode);
            is_there.then(|| match plan.kernels.is_empty() {
                false => self.affordable_among_vectors(plan, field, budget_ms),
                true => self.affordable(field, size, budget_ms),
            })
        };
        let tents = preview_mode(plan);
        let tents = tents.and_then(|splat| affordable(SlabField::Preview, &splat));
        let own = match is_gathered {
            false => affordable(SlabField::Own, &plan.mode),
            // Samples cost more a ray than tents.
            true => (self.is_native() && tents.is_none())
                .then(|| self.affordable(SlabField::Own, size, budget_ms)),
        };
        let worth = match self.last_reduction {
            _ if is_of_few_cells(plan) => f64::INFINITY,
            Some(Reduction { field: SlabField::Preview, .. }) => STILL_WORTH_TENTS,
            _ => WORTH_TENTS,
        };
        let thought_ms = |field, shrink| self.thought_ms(plan, field, shrink);
        let (field, shrink) = match (own, tents) {
            // Where neither may be smaller, the cheaper one.
            (Some(own), Some(tents))
                if own - tents < worth
                    && thought_ms(SlabField::Own, own)
                        <= thought_ms(SlabField::Preview, tents).max(MOST_KEPT * budget_ms) =>
            {
                (SlabField::Own, own)
            }
            (_, Some(tents)) => (SlabField::Preview, tents),
            (own, None) => (SlabField::Own, own?),
        };
        // Between rays farther apart than a sample is wide a single bright one is lost: where every voxel
        // that shows can be splatted in the time, no ray need find it.
        let width_px = plan.view().narrowest_voxel_pixels() * widest_voxels(field, plan);
        let splats = self.costs.splats_within(budget_ms).min(MOST_SPARSE);
        let is_sparse = self.active_count().is_some_and(|active| active <= splats);
        let is_lost = shrink > width_px.max(1.0) && is_sparse && is_plain(plan);
        let whole = Reduction { field, shrink, cut: None };
        (!is_lost).then(|| self.with_cut(plan, whole, budget_ms))
    }

    /// Whether a field that quick pictures of a plan may be of is there, with its table.
    pub(super) fn is_at_hand(&self, plan: &Plan, field: SlabField) -> bool {
        let Some(Field { volume, .. }) = plan.field() else { return false };
        let mode = match field {
            SlabField::Own => Some(plan.mode),
            SlabField::Preview => preview_mode(plan),
        };
        mode.is_some_and(|mode| self.holds_field(field, volume, &mode))
    }

    /// The last picture's size, up to so many times smaller, where one of so many milliseconds would hardly differ.
    fn kept_shrink(
        &self,
        field: SlabField,
        (most, most_ms): (f64, f64),
        thought_ms: impl Fn(f64) -> f64,
    ) -> Option<f64> {
        // One of a cut says at once how large the next of that cut may be; of another it says nothing.
        let last = self.last_reduction.filter(|last| last.field == field)?.shrink;
        let step = (1.0 / SIZE_STEPS_A_HALVING).exp2();
        let is_kept = (1.0..=most).contains(&last)
            && thought_ms(last) <= MOST_KEPT * most_ms
            && (last == 1.0 || thought_ms(last / step) >= LARGER_WITHIN * most_ms);
        is_kept.then_some(last)
    }

    /// How much smaller a field is drawn within a budget: as little as that allows, or as the last
    /// time where that is hardly different. No picture is smaller than [`most_shrink`] allows, which
    /// may take longer than the budget.
    fn affordable(&self, field: SlabField, size: [u32; 2], budget_ms: f64) -> f64 {
        self.affordable_at(field, 1.0, size, budget_ms)
    }

    /// The same where a ray costs a share of what one through all of the field does.
    pub(super) fn affordable_at(
        &self,
        field: SlabField,
        share: f64,
        size: [u32; 2],
        budget_ms: f64,
    ) -> f64 {
        let thought_ms = |shrink: f64| self.costs.reduced_ms(field, rays(size, shrink) * share);
        let most = most_shrink(size);
        let affordable = self.costs.reduced_rays_within(field, budget_ms) / share;
        // More than the budget where that is not enough for anything.
        let most_ms = self.costs.reduced_ms(field, affordable * share).max(budget_ms);
        if let Some(kept) = self.kept_shrink(field, (most, most_ms), thought_ms) {
            return kept;
        }
        let shrink = (rays(size, 1.0) / affordable).sqrt().max(1.0);
        // Up to the next step, but for what rounding adds to one.
        let steps = (shrink.log2() * SIZE_STEPS_A_HALVING - 1e-9).ceil();
        (steps / SIZE_STEPS_A_HALVING).exp2().min(most)
    }

    /// What a picture of a field, with a scene's vectors, is thought to take, so many times smaller.
    pub(super) fn thought_ms(&self, plan: &Plan, field: SlabField, shrink: f64) -> f64 {
        let rays = rays(plan.size, shrink);
        if plan.kernels.is_empty() {
            return self.costs.reduced_ms(field, rays);
        }
        match self.thought_visits(plan, shrink) {
            Some(visits) => {
                let of_field = if plan.is_of_kernels_alone() { 0.0 } else { rays };
                let thought = self.costs.among_vectors_ms(field, of_field, visits);
                // Whole ones have thinner slabs and finer marks, and a price of their own.
                if shrink > 1.0 { thought } else { thought.max(rays * self.costs.ray_ms) }
            }
            // As long as nobody knows how many there are.
            None => UNKNOWN_VECTORS * self.costs.reduced_ms(field, rays),
        }
    }

    /// [`Self::affordable`] of a scene with vectors, of which there are other ones in pictures of other sizes.
    fn affordable_among_vectors(&self, plan: &Plan, field: SlabField, budget_ms: f64) -> f64 {
        let size = plan.size;
        let thought_ms = |shrink: f64| self.thought_ms(plan, field, shrink);
        let most = most_shrink(size);
        if let Some(kept) = self.kept_shrink(field, (most, budget_ms), thought_ms) {
            return kept;
        }
        #[expect(clippy::cast_possible_truncation, reason = "a few dozen")]
        let steps = (most.log2() * SIZE_STEPS_A_HALVING).ceil() as i32;
        let shrinks = (0..=steps).rev().map(|n| (f64::from(n) / SIZE_STEPS_A_HALVING).exp2());
        // From the smallest picture on: the next size may have finer vectors, and many more.
        let affordable = shrinks.map(|s| s.min(most)).take_while(|s| thought_ms(*s) <= budget_ms);
        affordable.last().unwrap_or(most)
    }

    /// A picture so many times smaller than `size`.
    pub(super) fn reduced(
        &mut self,
        plan: &Plan,
        Reduction { field, shrink, cut }: Reduction,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        let (smaller, enlarged) = (shrunk(plan.size, shrink), plan.enlarged * shrink);
        let found = cut.and_then(|number| Some((number, self.cuts.numbered(number)?)));
        let found = found.map(|(number, (cut, levels))| (number, cut, levels));
        let with_cut = |plan: Plan| match &found {
            None => plan,
            // Slabs are as thick as the samples are wide, and laid down near to far: the light is the same either way.
            Some((_, cut, _)) => {
                let slabs_per_voxel = plan.mode.slabs_per_voxel.min(1.0);
                let order = Order::FrontToBack;
                let mode = SplatSettings { slabs_per_voxel, order, ..plan.mode };
                Plan { cut: Some(Arc::clone(cut)), ..plan.in_mode(mode) }
            }
        };
        let drawn = match field {
            SlabField::Preview => {
                let mode = preview_mode(plan).unwrap_or(plan.mode);
                let plan = with_cut(plan.in_mode(mode).at_size(smaller, enlarged));
                self.slabs_of(&plan, field, observer)
            }
            SlabField::Own if let Some(slabs_per_voxel) = quick_slabs(plan, shrink) => {
                let mode = SplatSettings { slabs_per_voxel, ..plan.mode };
                let smaller = plan.in_mode(mode).at_size(smaller, enlarged);
                self.slabs_of(&with_cut(smaller), field, observer)
            }
            SlabField::Own if plan.way == Way::Slabs => {
                self.slabs_of(&with_cut(plan.at_size(smaller, enlarged)), field, observer)
            }
            SlabField::Own => self.full(&plan.at_size(smaller, 1.0), observer),
        }?;
        let field_rmse = self.cuts.stand_in_rmse(plan, field, None);
        let drawn = Drawn { is_reduced: true, field, field_rmse, ..drawn };
        let Some((number, _, levels)) = found else {
            self.cuts.learn(None);
            return Ok(Drawn { awaits_cut: self.awaits_cuts(plan), ..drawn });
        };
        // What all of the field was thought to cost is not touched by what a cut of it does, but where that explains nothing.
        let rays = f64::from(smaller[0]) * f64::from(smaller[1]);
        let of_cut = rays * self.cuts.share(number, field);
        let longer = (drawn.wall_ms / self.costs.reduced_ms(field, of_cut)).clamp(0.25, 4.0);
        // The next one will not wait for a compiler.
        if !drawn.made_pipelines && !self.cuts.learn(Some((field, longer))) {
            self.costs.learn_reduced(field, of_cut, drawn.wall_ms);
            self.costs.hold_fields_together(field);
        }
        self.kept_bricks = self.keeps_cut.then_some(number);
        let of_cut = self.cuts.stand_in_rmse(plan, field, Some(number));
        let rmse = (of_cut * of_cut - field_rmse * field_rmse).max(0.0).sqrt();
        let cut = CutLevels { rmse, ..levels };
        Ok(Drawn { cut: Some(cut), ..drawn })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::{Scene, Visibility, opening};
    use crate::volume::{Lattice, Samples};

    #[test]
    fn slabs_of_cells_are_thicker_in_pictures_that_are_much_smaller() {
        let shares = [1.0, 2.0, 3.0, 4.0, 12.0].map(cells_slabs);
        assert_eq!(shares, [1.0, 1.0, 2.0 / 3.0, 0.5, 0.5]);
    }

    #[test]
    fn a_volume_is_halved_until_no_more_than_five_million_quads_are_left() {
        assert_eq!(level([256; 3]), 0);
        assert_eq!(level([257, 256, 333]), 1);
        assert_eq!(level([512; 3]), 1);
        assert_eq!(level([600; 3]), 2);
        assert_eq!(level([1024; 3]), 2);
        assert_eq!(level([5 << 11, 1 << 11, 1]), 0, "exactly as many");
        assert_eq!(level([5 << 11, (1 << 11) + 1, 1]), 1);
        // What is one sample thick stays so.
        assert_eq!(level([1, 1, 60_000]), 0);
        assert_eq!(level([1, 1, 5 << 23]), 1);
        assert_eq!(level([1, 6_000, 5_000]), 1);
        assert_eq!(level([1, 60_000, 5_000]), 2);
    }

    fn scene(dims: [usize; 3]) -> Scene {
        let mut samples = vec![0_u8; dims.iter().product()];
        samples[0] = 255;
        let volume =
            ScalarVolume::from_samples("flat", Lattice::unit(dims), Samples::UInt8(samples));
        Scene {
            splat: SplatSettings::EXACT,
            ..opening(Default::default(), Arc::new(volume.unwrap()), None)
        }
    }

    #[test]
    fn sharp_fields_are_previewed_by_tents_and_others_by_themselves() {
        let mut scene = scene([4; 3]);
        scene.splat.slabs_per_voxel = 3.0;
        let tents = |scene: &Scene| {
            let splat = preview_mode(&Plan::of(scene, [8, 8]))?;
            assert_eq!((splat.kernel, splat.extent), (Kernel::Linear, None));
            assert_eq!(splat.reconstruction, Reconstruction::Interpolating);
            assert_eq!(splat.classify, scene.splat.classify);
            assert_eq!(splat.opacity_model, scene.splat.opacity_model);
            Some(splat.slabs_per_voxel)
        };
        assert_eq!(tents(&scene), Some(1.0), "no finer than a slab a voxel");
        scene.splat.slabs_per_voxel = 0.5;
        assert_eq!(tents(&scene), Some(0.5));
        scene.splat.opacity_model = crate::scene::OpacityModel::Published;
        scene.splat.classify = crate::scene::Classify::After;
        for kernel in [Kernel::BSpline, Kernel::Cubic, Kernel::Gaussian] {
            scene.splat.kernel = kernel;
            scene.splat.extent = (kernel == Kernel::Cubic).then_some(2.5);
            scene.splat.reconstruction = Reconstruction::Interpolating;
            assert!(tents(&scene).is_some(), "{kernel:?}");
            scene.splat.reconstruction = Reconstruction::Smooth;
            assert_eq!(tents(&scene), None, "{kernel:?} that smooths");
        }
        for (extent, is_like_tents) in [(0.5, false), (2.0, true), (3.0, false)] {
            scene.splat = SplatSettings { extent: Some(extent), ..SplatSettings::EXACT };
            assert_eq!(tents(&scene).is_some(), is_like_tents, "{extent}: quick pictures show it");
        }
        scene.splat = SplatSettings { kernel: Kernel::Nearest, ..SplatSettings::EXACT };
        assert_eq!(tents(&scene), None, "steps stay steps");
        for visibility in [Visibility::EverySample, Visibility::Sheets, Visibility::Slabs] {
            scene.splat = SplatSettings { visibility, ..SplatSettings::SHADE_FIRST };
            assert_eq!(tents(&scene), None, "shaded first");
        }
    }

    #[test]
    fn functions_are_previewed_by_tents_unless_fewer_functions_are_asked_for() {
        let all = SplatSettings { kernel: Kernel::Functions, ..SplatSettings::EXACT };
        let preview = |splat: SplatSettings| {
            let found = preview_mode(&Plan::of(&Scene { splat, ..scene([4; 3]) }, [8, 8]));
            found.map(|splat| (splat.kernel, splat.limits().max_rms))
        };
        assert_eq!(preview(all), Some((Kernel::Linear, 0.0)));
        let quick = SplatSettings { quick_functions: Some(2.0), ..all };
        assert_eq!(preview(quick), Some((Kernel::Functions, 2.0)));
        // Nobody chose quick pictures to be nearer than finished ones.
        let functions = crate::rbf::Limits { max_rms: 3.0, ..all.functions };
        let fewer = SplatSettings { functions, ..quick };
        assert_eq!(preview(fewer), Some((Kernel::Functions, 3.0)));
        let samples = SplatSettings { kernel: Kernel::BSpline, ..quick };
        assert_eq!(preview(samples), Some((Kernel::Linear, 0.0)));
    }

    #[test]
    fn tents_are_previewed_by_tents_only_where_those_are_fewer() {
        let linear = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };
        assert_eq!(
            preview_mode(&Plan::of(&Scene { splat: linear, ..scene([4; 3]) }, [8, 8])),
            None
        );
        let large = Scene { splat: linear, ..scene([1, 4600, 4600]) };
        assert!(level(large.lattice().dims) > 0);
        assert_eq!(
            preview_mode(&Plan::of(&large, [8, 8])).map(|splat| splat.kernel),
            Some(Kernel::Linear)
        );
    }

    /// Means and half widths by brute force, of blocks that the border cuts and that hold holes.
    #[test]
    fn means_and_widths_are_those_of_what_they_stand_for() {
        let dims = [7, 5, 6];
        let count = dims.iter().product::<usize>();
        let value = |i: usize| 1e6 + ((i * 7919) % 101) as f64 / 50.0;
        let is_hole =
            |i: usize| i % dims[0] < 4 && i < 4 * 35 && i / 7 % 5 < 4 || i.is_multiple_of(3);
        let samples = (0..count).map(|i| if is_hole(i) { f64::NAN } else { value(i) }).collect();
        let samples = Samples::Float64(samples);
        let volume = ScalarVolume::from_samples("holed", Lattice::unit(dims), samples).unwrap();
        let same = coefficients_of(&volume, 0, &Ticket::new()).unwrap();
        assert_eq!((same.dims, same.averaged), (dims, None));
        for level in [1, 2] {
            let found = coefficients_of(&volume, level, &Ticket::new()).unwrap();
            let averaged = found.averaged.as_ref().unwrap();
            assert_eq!((averaged.level, averaged.volume_dims), (level, dims));
            assert_eq!(found.dims, dims.map(|n| n.div_ceil(1 << level)));
            let (mut holes, mut extended) = (0, 0);
            for i in 0..found.values.len() {
                let [nx, ny, _] = found.dims;
                let block = [i % nx, i / nx % ny, i / (nx * ny)];
                let held: Vec<f64> = (0..count)
                    .filter(|v| [v % 7, v / 7 % 5, v / 35].map(|n| n >> level) == block)
                    .map(|v| volume.samples.get(v))
                    .filter(|v| !v.is_nan())
                    .collect();
                let bit = found.holes.as_ref().unwrap()[i / 32] >> (i % 32) & 1 == 1;
                assert_eq!(bit, held.is_empty());
                holes += u32::from(bit);
                let n = held.len() as f64;
                let mean = held.iter().sum::<f64>() / n;
                let squares = held.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
                let farthest = held.iter().map(|v| (v - mean).abs()).fold(0.0, f64::max);
                let width = if bit { 0.0 } else { (3.0 * squares / n).sqrt().max(farthest) };
                extended += u32::from(!bit && width == farthest);
                assert!(bit || (found.get(i) - mean).abs() < 1e-6, "{} {mean}", found.get(i));
                assert!((f64::from(averaged.half_widths[i]) - width).abs() < 1e-6, "{width}");
            }
            assert!(holes > 0, "no block is without data");
            assert!(level > 1 || extended > 0, "no block has a value far from the others");
        }
    }
}
